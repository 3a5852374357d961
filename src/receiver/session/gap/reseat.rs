//! The scan for displaced codes, and the replicas moved to where it finds them.

use rayon::prelude::*;

use super::{FrontEnd, LEAST_CHANNELS, Moved, Stage, Units, Watched};
use crate::gap::scan::{Found, Profile, Scan};
use crate::lead::lead;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use crate::session::WRONG_TIME_FIXES;
use crate::source::Packed;
use crate::track::Report;
use gnss::record::EventRow;
use gnss::signal::{Component, Signal};

/// A scan that finds nothing ends so long after the suspicion.
const SCAN_S: f64 = 0.4;

impl FrontEnd {
    /// The signal whose codes are scanned for: of those that enough channels follow with a trend the one with
    /// the longest code, as a jump is found modulo its period; else the one with most channels.
    fn scanned(&self) -> Option<&'static Signal> {
        let channels = |signal: &Signal| {
            let seen = |track: &&super::Track| track.watched.rates.is_some() && track.channel.signal() == signal;
            self.tracks.iter().filter(seen).count()
        };
        let period_s = |signal: &'static Signal| lead(signal).map_or(0.0, Component::period_s);
        let enough = self.signals.iter().copied().filter(|signal| channels(signal) >= LEAST_CHANNELS).rev();
        let longest = enough.max_by(|a, b| period_s(a).total_cmp(&period_s(b)));
        longest.or_else(|| self.signals.iter().copied().rev().max_by_key(|signal| channels(signal)))
    }

    /// Correlates a block at all delays, and moves the replicas when that shows where the codes are.
    pub(super) fn scan(
        &mut self,
        block: &Packed,
        since: u64,
        whole: bool,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let rate_hz = self.metadata.rate.hz();
        let fresh = self.tracks.iter().all(|track| track.watched.profile.periods() == 0);
        let kept = self.gap.scan.as_ref().map(|(signal, _)| *signal);
        let chosen = if fresh { self.scanned() } else { kept };
        let Some(signal) = chosen else { return Ok(()) };
        let Some(component) = lead(signal) else { return Ok(()) };
        if kept != Some(signal) {
            self.gap.scan = Some((signal, Scan::new(component.period_s(), rate_hz)));
        }
        let Some((_, scan)) = &self.gap.scan else { return Ok(()) };
        let middle_s = self.metadata.rate.elapsed_s((block.first + block.end()) / 2);
        let samples = block.unpack(0..block.samples(), &mut self.gap.planes);
        self.tracks.par_iter_mut().filter(|track| track.channel.signal() == signal).for_each(|track| {
            let Watched { trend, rates: Some(rates), profile, .. } = &mut track.watched else { return };
            let Some(expected) = trend.forecast(middle_s) else { return };
            if let Some((replica, nco)) = track.channel.predicted(block.first, expected.chips, rates) {
                scan.add(&samples, replica, &nco, profile);
            }
        });
        let profiles: Vec<(&Profile, f64)> = self
            .tracks
            .iter()
            .filter_map(|track| {
                let rates = track.watched.rates.filter(|_| track.watched.profile.periods() > 0)?;
                let units = Units::of(&track.channel, component);
                let gain = units.doppler_chips(&track.channel, &rates) * rate_hz / component.chip_rate_hz;
                Some((&track.watched.profile, gain))
            })
            .collect();
        let enough = profiles.len() >= LEAST_CHANNELS;
        match scan.decide(&profiles).filter(|_| enough) {
            // A secondary code out of place shakes the carrier until no power is left: the turns of its signs
            // show it next, and want to know what was before.
            Some(found) if found.samples == 0 && !whole && self.has_secondary_codes() => {
                (self.gap.stage, self.gap.in_place) = (Stage::Quiet, Some(block.end()));
            }
            // Otherwise a power that vanished without a jump is someone else's matter.
            Some(found) if found.samples == 0 && !whole => self.calm(),
            Some(found) => self.reseat(Moved { since, at: block.end(), found, whole }, sink)?,
            None if block.end() > since + self.samples(SCAN_S) => self.calm(),
            None => {}
        }
        Ok(())
    }

    /// Moves all replicas to where the scan found the codes.
    pub(super) fn reseat(&mut self, moved: Moved, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let Moved { at: now, found, whole, .. } = moved;
        let Some(reference) = self.reference() else { return Ok(()) };
        // What is found by a code is known modulo its period.
        let open_s = self.gap.scan.as_ref().and_then(|(signal, _)| lead(signal)).map(Component::period_s);
        let open_s = open_s.filter(|_| found != Found { samples: 0, seconds: 0.0 });
        let sample_chips = reference.chip_rate_hz / self.metadata.rate.hz();
        let now_s = self.metadata.rate.elapsed_s(now);
        let mut report = Report::default();
        for track in &mut self.tracks {
            let units = Units::of(&track.channel, reference);
            if open_s.is_some_and(|open_s| whole_number(open_s / units.period_s).is_none()) {
                // Where its code is remains open: it is searched for again.
                (track.dropped, track.wrong_time) = (true, WRONG_TIME_FIXES);
                continue;
            }
            let watched = &mut track.watched;
            watched.since = (0.0, 0.0, 0);
            watched.turns = None;
            let jump_chips = found.samples as f64 * sample_chips;
            let Some(glanced) = watched.rates else {
                track.channel.reseat(now, jump_chips / units.chips, None, None, &mut report);
                continue;
            };
            let ahead = jump_chips + found.seconds * units.doppler_chips(&track.channel, &glanced);
            let expected = watched.trend.forecast(now_s).map_or(watched.moved_chips, |expected| expected.chips);
            // Where a secondary code is out of place the phase loop has followed anything, for several looks.
            let before = watched.rates_before(now_s).filter(|_| whole && track.channel.has_secondary_code());
            let rates = before.or((!whole).then_some(glanced));
            track.channel.reseat(now, ahead / units.chips, Some(expected), rates, &mut report);
            track.line.clear();
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            for (sample, event) in report.events.drain(..) {
                sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
            }
        }
        self.window = None;
        self.next_search = self.next_search.min(now);
        self.looks = Default::default();
        self.gap.stage = Stage::Settling(moved);
        // What was seen before the replicas moved says nothing.
        self.gap.last_look = now;
        self.tracks.iter_mut().for_each(|track| _ = track.channel.glance());
        Ok(())
    }
}

/// The whole number that a quotient of periods is, if it is one.
pub(super) fn whole_number(quotient: f64) -> Option<i64> {
    let whole = quotient.round();
    ((quotient - whole).abs() < 1e-6 && whole.abs() < 1e15).then_some(whole as i64)
}
