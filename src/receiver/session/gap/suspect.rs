//! Signs of a jump: steps that all codes share, steps in proportion to their Dopplers, lost power, and sign
//! changes at the wrong code periods.

use std::collections::VecDeque;

use super::{FrontEnd, LEAST_CHANNELS, LOOK_S, Moved, Stage, Track, VANISHED_SHARE};
use crate::gap::scan::{Found, Profile};
use crate::gap::{Edges, Step, Trend, common_step, doppler_step, turned_by};
use crate::outcome::ReceiveError;
use crate::output::Sink;
use crate::session::shared::Shared;
use crate::track::Glance;
use gnss::signal::Signal;

/// Power has vanished below this share of what it was.
const VANISHED: f64 = 0.25;
/// Channels whose power is this many deviations of a look above the noise count.
const SEEN_SIGMAS: f64 = 4.0;
/// Turns of signs are compared with where symbols begin so often while nothing is suspected.
const EDGES_S: f64 = 0.4;
/// Code periods in a window over which the turns of a secondary code are compared, at least. Two windows of a
/// chip sequence of 25 show every displacement; a phase loop in a wrong secondary code loses its lock after
/// 0.2 s.
const SECONDARY_CODE_PERIODS: u64 = 10;
/// A misaligned secondary code shakes the phase loop until no power is left: for so long after a scan has
/// found the codes aligned, that is no reason for another.
const SHAKEN_S: f64 = 0.3;
/// Looks that are averaged before they enter a trend: whole symbols that are missing move codes by their
/// Dopplers alone, 0.02 chip in 20 ms, twice the noise of one look at 45 dB-Hz.
const AVERAGED: usize = 8;

/// A look at a code: when, where it was, over how many code periods, and its power.
#[derive(Clone, Copy, Debug)]
struct Look {
    t_s: f64,
    chips: f64,
    periods: u32,
    power: f64,
}

/// A trend without the latest looks, and these: what moves codes a little, and stays, shows in their mean.
#[derive(Clone, Debug, Default)]
pub(super) struct Settled {
    trend: Trend,
    /// Seconds, chips, code periods and power of each.
    latest: VecDeque<Look>,
}

impl Settled {
    /// Takes a look at `t_s`.
    pub fn take(&mut self, t_s: f64, glance: &Glance) {
        if self.latest.len() >= AVERAGED
            && let Some(Look { t_s, chips, power, .. }) = self.latest.pop_front()
        {
            self.trend.take(t_s, chips, power);
        }
        let Glance { code_chips, periods, power, .. } = *glance;
        self.latest.push_back(Look { t_s, chips: code_chips, periods, power });
    }

    /// The mean of the latest looks beyond what the looks before them foretell: chips, code periods, and its
    /// variance over that of a look of as many periods.
    fn step(&self) -> Option<(f64, f64, f64)> {
        if self.latest.len() < AVERAGED {
            return None;
        }
        let n = self.latest.len() as f64;
        let mean = |of: &dyn Fn(&Look) -> f64| self.latest.iter().map(of).sum::<f64>() / n;
        let expected = self.trend.forecast(mean(&|look| look.t_s))?;
        let periods = n * mean(&|look| f64::from(look.periods));
        // A trend's variance is in that of one look.
        Some((mean(&|look| look.chips) - expected.chips, periods, 1.0 + n * expected.variance_ratio))
    }
}

/// Latest sign changes, and the first sample of symbols. For a secondary code they are those of the last two
/// windows. For symbols they are those since the last comparison, where another is `due`. `None` where there
/// is nothing to compare.
fn latest_turns(track: &mut Track, due: bool) -> Option<(Edges, u64)> {
    let begin = track.channel.symbols_begin();
    if !track.channel.has_secondary_code() {
        return due.then(|| track.channel.take_edges()).zip(begin);
    }
    if track.channel.edges().count() < SECONDARY_CODE_PERIODS {
        return None;
    }
    let latest = track.channel.take_edges();
    let both = track.watched.turns.replace(latest.clone()).map_or_else(|| latest.clone(), |before| before.and(&latest));
    Some((both, begin?))
}

impl FrontEnd {
    /// Takes a look into the trends, unless it shows something common.
    pub(super) fn suspect(&mut self, glances: &[Option<Glance>], at_s: f64, since: u64, shared: &Shared) {
        let Some(reference) = self.reference() else { return };
        let (mut steps, mut seen, mut gone) = (Vec::new(), 0, 0);
        for (track, glance) in self.tracks.iter().zip(glances) {
            let expected = track.watched.trend.forecast(at_s).filter(|_| track.watched.unlocked == 0);
            let (Some(glance), Some(expected)) = (glance, expected) else { continue };
            let (power, periods) = (track.watched.trend.power(), f64::from(glance.periods));
            if power > SEEN_SIGMAS * ((1.0 + 2.0 * power) / periods).sqrt() {
                seen += 1;
                gone += usize::from(glance.power < VANISHED * power);
            }
            if track.channel.is_settled() {
                let look = (glance.code_chips - expected.chips, periods, 1.0 + expected.variance_ratio);
                steps.extend(self.step_of(track, look, &glance.rates, shared));
            }
        }
        let vanished = gone >= LEAST_CHANNELS && gone as f64 >= VANISHED_SHARE * f64::from(seen);
        // Codes that a scan has found in place: it is the carriers that are shaken.
        let vanished = vanished && self.gap.in_place.is_none_or(|at| since > at + self.samples(SHAKEN_S));
        let sample_chips = reference.chip_rate_hz / self.metadata.rate.hz();
        if vanished
            || common_step(&steps, sample_chips).is_some()
            || doppler_step(&steps)
            || doppler_step(&self.lasting(shared))
        {
            for track in &mut self.tracks {
                track.watched.profile = Profile::default();
                track.watched.begin = track.channel.symbols_begin();
            }
            self.gap.stage = Stage::Scanning { since, whole: !vanished };
            return;
        }
        for (track, glance) in self.tracks.iter_mut().zip(glances) {
            let watched = &mut track.watched;
            match glance {
                Some(glance) if track.channel.is_settled() => {
                    watched.trend.take(at_s, glance.code_chips, glance.power);
                    watched.settled.take(at_s, glance);
                    (watched.rates, watched.moved_chips) = (Some(glance.rates), glance.moved_chips);
                    watched.unlocked = 0;
                    watched.remember(at_s, glance.rates);
                }
                _ => watched.pause(),
            }
        }
    }

    /// True if channels follow pilots whose secondary code is known.
    pub(super) fn has_secondary_codes(&self) -> bool {
        self.tracks.iter().any(|track| track.channel.has_secondary_code())
    }

    /// Steps of the latest looks together.
    fn lasting(&self, shared: &Shared) -> Vec<Step> {
        let one = |track: &Track| {
            let rates = track.watched.rates?;
            self.step_of(track, track.watched.settled.step()?, &rates, shared)
        };
        self.tracks.iter().filter(|track| track.channel.is_settled()).filter_map(one).collect()
    }

    /// Compares the edges of signs with those expected from symbols or secondary codes. A difference means
    /// that code periods are missing, which nothing else shows.
    pub(super) fn compare_edges(&mut self, now: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        if self.gap.stage != Stage::Quiet {
            return Ok(());
        }
        let due = now >= self.gap.last_edges + self.samples(EDGES_S);
        let turns: Vec<Option<(Edges, u64)>> = self.tracks.iter_mut().map(|track| latest_turns(track, due)).collect();
        let moved = self.signals.iter().any(|signal| {
            let own = || self.tracks.iter().zip(&turns).filter(|(track, _)| track.channel.signal() == *signal);
            let edges: Vec<(&Edges, u64)> =
                own().filter_map(|(_, turns)| turns.as_ref().map(|(edges, begin)| (edges, *begin))).collect();
            let enough = edges.len() >= LEAST_CHANNELS && edges.len() as f64 >= VANISHED_SHARE * own().count() as f64;
            enough && turned_by(&edges).is_some_and(|turned| turned != 0)
        });
        // A secondary code shows it within two looks, symbols within the time between two comparisons.
        let since = if due { self.gap.last_edges } else { now.saturating_sub(self.samples(2.0 * LOOK_S)) };
        if due {
            self.gap.last_edges = now;
        }
        if !moved {
            return Ok(());
        }
        for track in &mut self.tracks {
            track.watched.begin = track.channel.symbols_begin();
        }
        let found = Found { samples: 0, seconds: 0.0 };
        self.reseat(Moved { since, at: now, found, whole: true }, sink)
    }

    /// Periods by which the counts of a signal's channels are short, modulo a symbol's or a secondary code's,
    /// with that number of them; `None` while it is in doubt.
    pub(super) fn turned(&self, signal: &'static Signal) -> Option<(u64, u64)> {
        let own = self.tracks.iter().filter(|track| track.channel.signal() == signal);
        let edges: Vec<(&Edges, u64)> =
            own.filter_map(|track| Some((track.channel.edges(), track.watched.begin?))).collect();
        let turned = turned_by(&edges).filter(|_| edges.len() >= LEAST_CHANNELS)?;
        Some((turned, edges.first()?.0.periods()))
    }
}
