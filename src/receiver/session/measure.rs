//! Observations and a fix at one tick.

use super::hear::{date, is_wrong_time};
use super::{FrontEnd, Session, Tick, WRONG_TIME_FIXES};
use crate::observe::Reading;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use gnss::record::{Event, EventRow};

/// Number of satellites that have to show by how much a front end is out of step.
const SHOWING: usize = 3;
/// Difference in seconds within which they have to agree: the ionosphere separates two carriers by less than
/// a microsecond.
const AGREEING_S: f64 = 1e-6;

impl FrontEnd {
    /// Readings of this front end's channels at a tick.
    fn readings(&self, main: u64) -> Vec<Reading> {
        let Some(Tick { own, .. }) = self.ticks.iter().find(|tick| tick.main == main) else { return Vec::new() };
        let later_s = self.step.later_s(main, *own);
        let one = |track: &super::Track| {
            let measurement = track.report.measurements.iter().find(|measurement| measurement.sample == *own)?;
            let reading =
                Reading::new(track.channel.sv(), track.channel.signal(), measurement, track.decoder.as_ref()?)?;
            Some(if later_s == 0.0 { reading } else { reading.later(later_s) })
        };
        self.tracks.iter().filter(|track| !track.dropped).filter_map(one).collect()
    }

    /// Dates channels whose messages do not say their time by what other signals of their satellites read at
    /// a tick.
    fn date(&mut self, main: u64, known: &[Reading], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let Some(Tick { own, .. }) = self.ticks.iter().find(|tick| tick.main == main).copied() else { return Ok(()) };
        let sink = &mut super::step::Counted { sink, step: self.step, ticks: &[] };
        for track in &mut self.tracks {
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            let Some(decoder) = track.decoder.as_mut().filter(|decoder| decoder.is_dated_elsewhere()) else { continue };
            let measurement = track.report.measurements.iter().find(|one| one.sample == own && one.locked);
            let Some(measurement) = measurement else { continue };
            if date(decoder, signal.link(sv), measurement, known) {
                let event = Event::FrameSynchronised;
                sink.take(Record::Event(EventRow { sample: own, sv, signal, event }))?;
            }
        }
        Ok(())
    }
}

impl Session {
    /// Observes and solves at one tick.
    pub(super) fn measure(&mut self, tick: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        self.date(tick, sink)?;
        let readings = self.readings(tick, sink)?;
        let shared = &mut self.shared;
        let Some(solved) = shared.solve(tick, &readings, sink)? else { return Ok(()) };
        let Some(first) = self.front_ends.first_mut() else { return Ok(()) };
        if first.clock_jumped(&solved.fix, shared, sink)? {
            self.keep_step();
            return Ok(());
        }
        let excluded = shared.settle((tick, first.metadata.rate), solved, sink)?;
        for track in self.front_ends.iter_mut().flat_map(|front_end| &mut front_end.tracks) {
            let wrong = is_wrong_time(&excluded, track.channel.sv());
            track.wrong_time = if wrong { track.wrong_time + 1 } else { 0 };
            track.dropped |= track.wrong_time >= WRONG_TIME_FIXES;
        }
        Ok(())
    }

    /// Dates channels that cannot know their time by themselves: front ends that are in step read the same
    /// to a sample.
    fn date(&mut self, tick: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let waiting = |front_end: &FrontEnd| {
            let mut decoders = front_end.tracks.iter().filter_map(|track| track.decoder.as_ref());
            decoders.any(|decoder| decoder.is_dated_elsewhere())
        };
        if !self.front_ends.iter().any(waiting) {
            return Ok(());
        }
        let in_step = self.front_ends.iter().filter(|front_end| front_end.gap.unknown.is_none());
        let known: Vec<Reading> = in_step.flat_map(|front_end| front_end.readings(tick)).collect();
        let known: Vec<Reading> = known.into_iter().filter(|reading| reading.signal.is_dated()).collect();
        let each = &mut self.front_ends.iter_mut().filter(|front_end| front_end.gap.unknown.is_none());
        each.try_for_each(|front_end| front_end.date(tick, &known, sink))
    }

    /// Readings of all channels at a tick, in the order of the channels. A front end that lost an unknown
    /// number of samples is left out until it is synchronised again. Satellites that another front end
    /// follows too allow that.
    fn readings(&mut self, tick: u64, sink: &mut dyn Sink) -> Result<Vec<Reading>, ReceiveError> {
        let mut all: Vec<Vec<Reading>> = self.front_ends.iter().map(|front_end| front_end.readings(tick)).collect();
        let known = |front_ends: &[FrontEnd]| -> Vec<bool> {
            front_ends.iter().map(|front_end| front_end.gap.unknown.is_none()).collect()
        };
        let mut in_step = known(&self.front_ends);
        for number in 0..self.front_ends.len() {
            if in_step[number] {
                continue;
            }
            let others = all.iter().zip(&in_step).filter(|(_, known)| **known).flat_map(|(readings, _)| readings);
            let apart_s = apart_s(&all[number], &others.copied().collect::<Vec<_>>());
            let front_end = &mut self.front_ends[number];
            if let (Some(apart_s), Some(since)) = (apart_s, front_end.gap.unknown) {
                let samples = (apart_s * front_end.metadata.rate.hz()).round() as i64;
                let step = front_end.step;
                let sink = &mut super::step::Counted { sink, step, ticks: &[] };
                front_end.report(since, samples, &mut self.shared, sink)?;
                self.shared.solver.jump(&front_end.signals, false);
                self.keep_step();
            }
            // Its ticks were those of another instant.
            all[number].clear();
            in_step[number] = false;
        }
        // By itself the first front end sets the clock again.
        if in_step.iter().all(|known| !known)
            && let Some(first) = self.front_ends.first()
        {
            all[0] = first.readings(tick);
        }
        let mut readings = all.concat();
        readings.sort_by_key(|reading| (reading.sv, reading.signal));
        Ok(readings)
    }
}

/// Difference in transmit time between readings of one front end and those of others by the same satellites.
/// It is the median in seconds, where enough readings agree with it.
fn apart_s(own: &[Reading], others: &[Reading]) -> Option<f64> {
    let mut apart_s: Vec<f64> = own
        .iter()
        .filter_map(|reading| others.iter().find(|other| other.sv == reading.sv).map(|other| (reading, other)))
        .map(|(reading, other)| reading.sent_after_s(other))
        .collect();
    apart_s.sort_by(f64::total_cmp);
    let median_s = *apart_s.get(apart_s.len() / 2)?;
    let agreeing = apart_s.iter().filter(|apart_s| (*apart_s - median_s).abs() < AGREEING_S).count();
    (agreeing >= SHOWING && 2 * agreeing > apart_s.len()).then_some(median_s)
}
