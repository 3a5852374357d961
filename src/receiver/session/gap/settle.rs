//! Number of missing samples, once the replicas are aligned with the codes again.

use super::reseat::whole_number;
use super::{FrontEnd, LOOK_S, Moved, Stage, Track, Units};
use crate::gap::scan::Found;
use crate::gap::{Fit, Step};
use crate::lead::lead;
use crate::outcome::ReceiveError;
use crate::output::Sink;
use crate::session::WRONG_TIME_FIXES;
use crate::session::shared::Shared;
use crate::track::Glance;
use gnss::signal::{Component, Signal};

/// Least time of the inspection of the signs' turns, seconds.
const TURNS_S: f64 = 0.2;
/// Largest time of that inspection, seconds.
const TURNS_LIMIT_S: f64 = 2.0;
/// Largest difference of a jump from a whole number of samples, in samples.
const WHOLE_SAMPLES: f64 = 0.2;
/// Additional difference that is allowed, in standard deviations.
const WHOLE_SIGMAS: f64 = 4.0;
/// A code is foreseen over so long a jump: a satellite's acceleration of 0.1 m/s² moves it by a millimetre.
const FORESEEN_S: f64 = 0.1;
/// The time that is missing is known when it is nearer to one possibility than to the next by so many
/// deviations.
const SURE_SIGMAS: f64 = 5.0;
/// Milliseconds by which no model errs.
const MODEL_S: f64 = 1e-3;

impl FrontEnd {
    /// Takes what a look shows of the codes since they were reseated.
    pub(super) fn gather(&mut self, glances: &[Option<Glance>], at_s: f64) {
        for (track, glance) in self.tracks.iter_mut().zip(glances) {
            if let (Some(glance), Some(expected)) = (glance, track.watched.trend.forecast(at_s)) {
                let since = &mut track.watched.since;
                since.0 += glance.code_chips - expected.chips;
                since.1 += at_s;
                since.2 += 1;
            }
        }
    }

    /// The codes' steps beyond what the scan found.
    fn steps(&self, shared: &Shared) -> Vec<Step> {
        let one = |track: &Track| {
            let (chips, seconds, count) = track.watched.since;
            let n = f64::from(count);
            let expected = track.watched.trend.forecast(seconds / n)?;
            let periods = LOOK_S / lead(track.channel.signal())?.period_s();
            let look = (chips / n, periods, 1.0 / n + expected.variance_ratio);
            self.step_of(track, look, &track.watched.rates?, shared)
        };
        let seen = |track: &&Track| track.watched.since.2 > 0 && !track.dropped;
        self.tracks.iter().filter(seen).filter_map(one).collect()
    }

    /// Code periods that are missing beside what the scan found, and their length: as the signal says whose
    /// symbols or secondary code are longest of those that say something, and near what the Dopplers say.
    fn missing(&self, found: Found, fit: Option<&Fit>) -> Option<(i64, f64)> {
        let rate_hz = self.metadata.rate.hz();
        let one = |signal: &'static Signal| {
            let (turned, group) = self.turned(signal)?;
            let period_s = lead(signal).map_or(1e-3, Component::period_s);
            Some((group as f64 * period_s, (turned, group, period_s)))
        };
        let known = self.signals.iter().rev().filter_map(|signal| one(signal));
        let (_, (turned, group, period_s)) = known.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let periods = match fit {
            Some(fit) => whole_periods(found, turned, group, period_s * rate_hz, rate_hz, fit)?,
            // Where no code has a past to compare with, the smallest is the likely one.
            None => smallest(turned as i64, group as i64),
        };
        Some((periods, period_s))
    }

    /// Ends the search when it is known how many samples are missing, or has taken too long.
    pub(super) fn settle(
        &mut self,
        now: u64,
        moved: Moved,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let Moved { since, at, found, whole } = moved;
        let waited = now.saturating_sub(at);
        if waited < self.samples(TURNS_S) {
            return Ok(());
        }
        let Some(reference) = self.reference() else { return Ok(()) };
        let steps = self.steps(shared);
        let rate_hz = self.metadata.rate.hz();
        let fit = Fit::robust(&steps, None);
        // Codes that did not move may have no past to compare with, where their carriers were shaken for
        // long.
        let guessed = steps.is_empty() && whole && found.samples == 0;
        let known = if fit.is_some() || guessed { self.missing(found, fit.as_ref()) } else { None };
        if known.is_none() && waited < self.samples(TURNS_LIMIT_S) {
            return Ok(());
        }
        // Codes that are where they were, on carriers that never broke, have lost no periods as far as anyone
        // can say.
        let counted = known.is_some();
        let known = known.or((whole && found.samples == 0).then_some((0, 1e-3)));
        let (periods, period_s) = known.unwrap_or((0, 1e-3));
        let missing_s = periods as f64 * period_s;
        let sample_chips = reference.chip_rate_hz / rate_hz;
        let ahead = found.samples as f64 + periods as f64 * (period_s * rate_hz);
        // Seconds of Doppler that the scan did not take off.
        let rest_s = match known {
            Some(_) => ahead / rate_hz - found.seconds,
            None => Fit::robust(&steps, None).map_or(0.0, |fit| fit.seconds),
        };
        let rest = Fit::robust(&steps, Some(rest_s));
        let rest_samples = rest.map_or(0.0, |fit| fit.chips / sample_chips);
        let samples = (ahead + rest_samples).round();
        let exact = samples - ahead;
        // What is no whole number is no jump: the code is where it is seen.
        let sigma = rest.map_or(0.0, |fit| fit.sigma_chips / sample_chips);
        let whole_number_of_samples = (rest_samples - exact).abs() < WHOLE_SAMPLES + WHOLE_SIGMAS * sigma;
        let common = if whole_number_of_samples { exact } else { rest_samples } * sample_chips;
        // Beyond this the way that satellites and antenna took in between is not foreseen.
        let foreseen = known.is_some() && (ahead / rate_hz).abs() < FORESEEN_S;
        let now_s = self.metadata.rate.elapsed_s(now);
        for track in self.tracks.iter_mut().filter(|track| !track.dropped) {
            let units = Units::of(&track.channel, reference);
            // Signs that stay in doubt are those of a secondary code that is somewhere else.
            let own = whole_number(missing_s / units.period_s);
            let Some(own) = own.filter(|_| counted || !track.channel.has_secondary_code()) else {
                // Its code is elsewhere: it is searched for again.
                (track.dropped, track.wrong_time) = (true, WRONG_TIME_FIXES);
                continue;
            };
            let watched = &mut track.watched;
            let doppler = watched.rates.map_or(0.0, |rates| units.doppler_chips(&track.channel, &rates));
            let (chips, _, looks) = watched.since;
            let seen = if foreseen || looks == 0 {
                (common + rest_s * doppler) / units.chips
            } else {
                chips / f64::from(looks)
            };
            let expected = watched.trend.forecast(now_s).map(|expected| expected.chips);
            let begins = known.is_some() && watched.begin.take().is_some();
            track.channel.resume(now, seen, expected, own, begins);
            watched.settled = Default::default();
            if !foreseen {
                watched.trend.clear();
            }
            if known.is_none() {
                track.decoder = shared.decoder(track.channel.signal(), track.channel.sv());
                track.since = now;
            }
        }
        let samples = if whole_number_of_samples || periods != 0 { samples as i64 } else { 0 };
        self.gap.stage = Stage::Quiet;
        // Through whole periods carriers turned by their Dopplers uncounted, 80 cycles in 20 ms at 4 kHz.
        shared.solver.jump(&self.signals, whole && known.is_some() && periods == 0);
        if known.is_none() {
            self.gap.unknown = Some(since);
        } else if samples != 0 {
            self.report(since, samples, shared, sink)?;
        }
        Ok(())
    }
}

/// The number nearest to zero that is `turned` modulo `group`.
fn smallest(turned: i64, group: i64) -> i64 {
    turned - if 2 * turned > group { group } else { 0 }
}

/// The whole code periods that are missing beside what the scan found: `turned` modulo `group`, and near what
/// the Dopplers say.
fn whole_periods(found: Found, turned: u64, group: u64, period_samples: f64, rate_hz: f64, fit: &Fit) -> Option<i64> {
    let seconds = |periods: i64| (found.samples as f64 + periods as f64 * period_samples) / rate_hz;
    let measured_s = found.seconds + fit.seconds;
    let group_s = group as f64 * period_samples / rate_hz;
    let (turned, group) = (turned as i64, group as i64);
    let nearest = ((measured_s - seconds(turned)) / group_s).round() as i64;
    let periods = turned + nearest * group;
    let off_s = (measured_s - seconds(periods)).abs();
    let fits = off_s < SURE_SIGMAS * fit.sigma_s + MODEL_S;
    let alone = group_s > 2.0 * SURE_SIGMAS * fit.sigma_s;
    // Where the Dopplers say little, a jump within half a symbol is the likely one if they allow for it.
    let small = smallest(turned, group);
    if fits && alone {
        return Some(periods);
    }
    let allowed = (measured_s - seconds(small)).abs() < 3.0 * fit.sigma_s + MODEL_S;
    (allowed && fit.sigma_s < group_s && small.abs() <= 1).then_some(small)
}
