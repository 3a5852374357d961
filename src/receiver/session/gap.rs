//! Lost and doubled samples: suspicion, scan, and what follows for channels, clock and solver.

use rayon::prelude::*;

use super::{Session, Track, WRONG_TIME_FIXES};
use crate::gnss::record::{Event, EventRow, Fix};
use crate::gnss::signal::{Component, Signal};
use crate::receiver::decode::Decoder;
use crate::receiver::gap::scan::{Found, Profile, Scan};
use crate::receiver::gap::{Fit, Jump, Step, Trend, common_step, doppler_step, turned_by};
use crate::receiver::lead::lead;
use crate::receiver::output::{Record, Sink};
use crate::receiver::run::ReceiveError;
use crate::receiver::source::{Packed, Planes};
use crate::receiver::track::loops::Rates;
use crate::receiver::track::{Channel, Glance, Report};

/// Seconds between looks at least.
const LOOK_S: f64 = 0.045;
/// A scan that finds nothing ends so long after the suspicion.
const SCAN_S: f64 = 0.4;
/// The turns of the signs are looked at for so long at least, and at most.
const TURNS_S: f64 = 0.2;
const TURNS_LIMIT_S: f64 = 2.0;
/// Power has vanished below this share of what it was.
const VANISHED: f64 = 0.25;
/// Channels whose power is this many deviations of a look above the noise count.
const SEEN_SIGMAS: f64 = 4.0;
/// Channels whose power has to vanish at once, and their share.
const LEAST_CHANNELS: usize = 3;
const VANISHED_SHARE: f64 = 0.66;
/// A jump is a whole number of samples within this and so many deviations.
const WHOLE_SAMPLES: f64 = 0.2;
const WHOLE_SIGMAS: f64 = 4.0;
/// A code is foreseen over so long a jump: a satellite's acceleration of 0.1 m/s² moves it by a millimetre.
const FORESEEN_S: f64 = 0.1;
/// Turns of signs are compared with where symbols begin so often while nothing is suspected.
const EDGES_S: f64 = 0.4;
/// The time that is missing is known when it is nearer to one possibility than to the next by so many deviations.
const SURE_SIGMAS: f64 = 5.0;
/// Milliseconds by which no model errs.
const MODEL_S: f64 = 1e-3;
/// A clock whose reading after a pause is off by more than noise, this drift and this much was moved by a jump.
const CLOCK_SIGMAS: f64 = 6.0;
const CLOCK_DRIFT: f64 = 2e-8;
const CLOCK_LEAST_S: f64 = 1e-6;
/// Less is a pause only when a jump is known whose size is not.
const PAUSE_S: f64 = 1.05;

/// What a channel showed of its code.
#[derive(Clone, Debug, Default)]
pub(super) struct Watched {
    trend: Trend,
    /// Rates when it last took a look.
    rates: Option<[Rates; 2]>,
    moved_chips: f64,
    profile: Profile,
    /// Where symbols began before the jump.
    begin: Option<u64>,
    /// Steps since the code was reseated: sum of chips, of seconds, and number.
    since: (f64, f64, u32),
}

impl Watched {
    /// The trend begins anew: the code's aid has changed.
    pub(super) fn forget(&mut self) {
        self.trend.clear();
    }
}

/// How far the search for a jump is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Stage {
    #[default]
    Quiet,
    /// Since a sample; whether carriers are whole.
    Scanning { since: u64, whole: bool },
    /// The replicas were moved at a sample by what the scan found.
    Settling { since: u64, moved: u64, found: Found, whole: bool },
}

/// The search for jumps, and those that were found.
#[derive(Default)]
pub(super) struct Gap {
    stage: Stage,
    last_look: u64,
    last_edges: u64,
    scan: Option<Scan>,
    planes: Planes,
    pub(super) jumps: Vec<Jump>,
    /// Since when nobody knows how many periods are missing.
    pub(super) unknown: Option<u64>,
    /// The last fix: its sample, seconds of its clock's error and drift, and the error's deviation.
    last_fix: Option<(u64, f64, f64, f64)>,
}

impl Gap {
    /// Whether codes are where they are not expected.
    pub(super) fn is_busy(&self) -> bool {
        self.stage != Stage::Quiet
    }
}

impl Session {
    /// The signal that is watched, the first of those that are received, and its component that leads.
    fn component(&self) -> Option<(&'static Signal, &'static Component)> {
        let signal = self.signal()?;
        Some((signal, lead(signal)?))
    }

    /// Whether samples that are lost are sought in this track's code.
    fn is_watched(&self, track: &Track) -> bool {
        self.signal() == Some(track.channel.signal())
    }

    /// Looks at all codes at the end of a block, and goes on with what it suspects.
    pub(super) fn leap(&mut self, block: &Packed, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        match self.gap.stage {
            Stage::Scanning { since, whole } => self.scan(block, since, whole, sink)?,
            Stage::Quiet | Stage::Settling { .. } => {}
        }
        let now = block.end();
        if now < self.gap.last_look + self.samples(LOOK_S) {
            return Ok(());
        }
        let before = std::mem::replace(&mut self.gap.last_look, now);
        let middle_s = 0.5 * (self.metadata.rate.elapsed_s(before) + self.metadata.rate.elapsed_s(now));
        let watched = self.signal();
        let glances: Vec<Option<Glance>> = (self.tracks.iter_mut())
            .map(|track| track.channel.glance().filter(|_| Some(track.channel.signal()) == watched))
            .collect();
        match self.gap.stage {
            Stage::Quiet => {
                self.suspect(&glances, middle_s, before);
                self.compare_edges(now, sink)?;
            }
            Stage::Scanning { .. } => {}
            Stage::Settling { since, moved, found, whole } => {
                self.gather(&glances, middle_s);
                self.settle(now, since, moved, found, whole, sink)?;
            }
        }
        Ok(())
    }

    /// Deviation of a look of so many code periods at a channel's code.
    fn look_chips(&self, track: &Track, periods: f64) -> f64 {
        let Some(noise) = self.noise(track.channel.signal()) else { return 0.0 };
        let t_s = periods * self.component().map_or(1e-3, |(_, component)| component.period_s());
        // A loop of bandwidth B averages over 1/(2B).
        let open = 1.0 / (2.0 * noise.bandwidth_hz * t_s).sqrt();
        noise.sigma_m(libm::pow(10.0, track.cn0_dbhz / 10.0)) * open / noise.chip_m
    }

    /// Takes a look into the trends, unless it shows something common.
    fn suspect(&mut self, glances: &[Option<Glance>], at_s: f64, since: u64) {
        let Some((signal, component)) = self.component() else { return };
        let ratio = signal.centre_hz() / component.chip_rate_hz;
        let (mut steps, mut seen, mut gone) = (Vec::new(), 0, 0);
        for (track, glance) in self.tracks.iter().zip(glances) {
            let (Some(glance), Some(expected)) = (glance, track.watched.trend.forecast(at_s)) else { continue };
            let (power, periods) = (track.watched.trend.power(), f64::from(glance.periods));
            if power > SEEN_SIGMAS * ((1.0 + 2.0 * power) / periods).sqrt() {
                seen += 1;
                gone += usize::from(glance.power < VANISHED * power);
            }
            if track.channel.is_settled() {
                steps.push(Step {
                    chips: glance.code_chips - expected.chips,
                    sigma_chips: self.look_chips(track, periods) * (1.0 + expected.variance_ratio).sqrt(),
                    doppler_chips: track.channel.code_doppler_hz(&glance.rates) / ratio,
                });
            }
        }
        let vanished = gone >= LEAST_CHANNELS && gone as f64 >= VANISHED_SHARE * f64::from(seen);
        let sample_chips = component.chip_rate_hz / self.metadata.rate.hz();
        if vanished || common_step(&steps, sample_chips).is_some() || doppler_step(&steps) {
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
                    (watched.rates, watched.moved_chips) = (Some(glance.rates), glance.moved_chips);
                }
                _ => watched.trend.clear(),
            }
        }
    }

    /// Whether signs turn elsewhere than where symbols begin: then code periods are missing, and nothing else shows it.
    fn compare_edges(&mut self, now: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        if self.gap.stage != Stage::Quiet || now < self.gap.last_edges + self.samples(EDGES_S) {
            return Ok(());
        }
        let since = std::mem::replace(&mut self.gap.last_edges, now);
        let begins: Vec<Option<u64>> = self.tracks.iter().map(|track| track.channel.symbols_begin()).collect();
        let edges: Vec<_> = (self.tracks.iter().zip(&begins))
            .filter(|(track, _)| self.is_watched(track))
            .filter_map(|(track, begin)| Some((track.channel.edges(), (*begin)?)))
            .collect();
        let watched = self.tracks.iter().filter(|track| self.is_watched(track)).count();
        let enough = edges.len() >= LEAST_CHANNELS && edges.len() as f64 >= VANISHED_SHARE * watched as f64;
        let moved = enough && turned_by(&edges).is_some_and(|turned| turned != 0);
        self.tracks.iter_mut().for_each(|track| track.channel.forget_edges());
        if !moved {
            return Ok(());
        }
        for (track, begin) in self.tracks.iter_mut().zip(begins) {
            track.watched.begin = begin;
        }
        self.reseat(now, since, Found { samples: 0, seconds: 0.0 }, true, sink)
    }

    /// Correlates a block at all delays, and moves the replicas when that shows where the codes are.
    fn scan(&mut self, block: &Packed, since: u64, whole: bool, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let Some((signal, component)) = self.component() else { return Ok(()) };
        let rate_hz = self.metadata.rate.hz();
        let middle_s = self.metadata.rate.elapsed_s((block.first + block.end()) / 2);
        let scan = self.gap.scan.get_or_insert_with(|| Scan::new(component.period_s(), rate_hz));
        let samples = block.unpack(0..block.samples(), &mut self.gap.planes);
        self.tracks.par_iter_mut().for_each(|track| {
            let Watched { trend, rates: Some(rates), profile, .. } = &mut track.watched else { return };
            let Some(expected) = trend.forecast(middle_s) else { return };
            if let Some((replica, nco)) = track.channel.predicted(block.first, expected.chips, rates) {
                scan.add(&samples, replica, &nco, profile);
            }
        });
        let ratio = signal.centre_hz() / component.chip_rate_hz;
        let gain = |channel: &Channel, rates: &[Rates; 2]| {
            channel.code_doppler_hz(rates) / ratio * rate_hz / component.chip_rate_hz
        };
        let profiles: Vec<(&Profile, f64)> = self
            .tracks
            .iter()
            .filter_map(|track| {
                let rates = track.watched.rates.filter(|_| track.watched.profile.periods() > 0)?;
                Some((&track.watched.profile, gain(&track.channel, &rates)))
            })
            .collect();
        let enough = profiles.len() >= LEAST_CHANNELS;
        match scan.decide(&profiles).filter(|_| enough) {
            // A power that vanished without a jump is someone else's matter.
            Some(found) if found.samples == 0 && !whole => self.calm(),
            Some(found) => self.reseat(block.end(), since, found, whole, sink)?,
            None if block.end() > since + self.samples(SCAN_S) => self.calm(),
            None => {}
        }
        Ok(())
    }

    /// Nothing was found.
    fn calm(&mut self) {
        self.gap.stage = Stage::Quiet;
        self.tracks.iter_mut().for_each(|track| track.watched = Watched::default());
    }

    /// Moves all replicas to where the scan found the codes.
    fn reseat(
        &mut self,
        now: u64,
        since: u64,
        found: Found,
        whole: bool,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let Some((signal, component)) = self.component() else { return Ok(()) };
        let ratio = signal.centre_hz() / component.chip_rate_hz;
        let sample_chips = component.chip_rate_hz / self.metadata.rate.hz();
        let now_s = self.metadata.rate.elapsed_s(now);
        let mut report = Report::default();
        let main = self.signal();
        for track in &mut self.tracks {
            if Some(track.channel.signal()) != main {
                // Its periods are others: it is searched for anew.
                (track.dropped, track.wrong_time) = (true, WRONG_TIME_FIXES);
                continue;
            }
            let watched = &mut track.watched;
            watched.since = (0.0, 0.0, 0);
            let Some(glanced) = watched.rates else {
                track.channel.reseat(now, found.samples as f64 * sample_chips, None, None, &mut report);
                continue;
            };
            let doppler = track.channel.code_doppler_hz(&glanced) / ratio;
            let ahead = found.samples as f64 * sample_chips + found.seconds * doppler;
            let expected = watched.trend.forecast(now_s).map_or(watched.moved_chips, |expected| expected.chips);
            let rates = (!whole).then_some(glanced);
            track.channel.reseat(now, ahead, Some(expected), rates, &mut report);
            track.line.clear();
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            for (sample, event) in report.events.drain(..) {
                sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
            }
        }
        self.window = None;
        self.next_search = self.next_search.min(now);
        self.looks = Default::default();
        self.gap.stage = Stage::Settling { since, moved: now, found, whole };
        // What was seen before the replicas moved says nothing.
        self.gap.last_look = now;
        self.tracks.iter_mut().for_each(|track| _ = track.channel.glance());
        Ok(())
    }

    /// Takes what a look shows of the codes since they were reseated.
    fn gather(&mut self, glances: &[Option<Glance>], at_s: f64) {
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
    fn steps(&self) -> Vec<Step> {
        let Some((signal, component)) = self.component() else { return Vec::new() };
        let ratio = signal.centre_hz() / component.chip_rate_hz;
        let periods = LOOK_S / component.period_s();
        let one = |track: &Track| {
            let (chips, seconds, count) = track.watched.since;
            let n = f64::from(count);
            let expected = track.watched.trend.forecast(seconds / n)?;
            let rates = track.watched.rates?;
            Some(Step {
                chips: chips / n,
                sigma_chips: self.look_chips(track, periods) * (1.0 / n + expected.variance_ratio).sqrt(),
                doppler_chips: track.channel.code_doppler_hz(&rates) / ratio,
            })
        };
        self.tracks.iter().filter(|track| track.watched.since.2 > 0).filter_map(one).collect()
    }

    /// Ends the search when it is known how many samples are missing, or has taken too long.
    fn settle(
        &mut self,
        now: u64,
        since: u64,
        moved: u64,
        found: Found,
        whole: bool,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let waited = now.saturating_sub(moved);
        if waited < self.samples(TURNS_S) {
            return Ok(());
        }
        let Some((signal, component)) = self.component() else { return Ok(()) };
        let group = u64::from(component.periods_per_symbol().unwrap_or(1));
        let edges: Vec<_> = (self.tracks.iter().filter(|track| self.is_watched(track)))
            .filter_map(|track| Some((track.channel.edges(), track.watched.begin?)))
            .collect();
        let steps = self.steps();
        let turned = turned_by(&edges).filter(|_| edges.len() >= LEAST_CHANNELS);
        let period_samples = component.period_s() * self.metadata.rate.hz();
        let known = turned.and_then(|turned| {
            let fit = Fit::robust(&steps, None)?;
            whole_periods(found, turned, group, period_samples, self.metadata.rate.hz(), &fit)
        });
        if known.is_none() && waited < self.samples(TURNS_LIMIT_S) {
            return Ok(());
        }
        // Codes that are where they were, on carriers that never broke, have lost no periods as far as anyone can say.
        let known = known.or((whole && found.samples == 0).then_some(0));
        let periods = known.unwrap_or(0);
        let sample_chips = component.chip_rate_hz / self.metadata.rate.hz();
        let rate_hz = self.metadata.rate.hz();
        let ahead = found.samples as f64 + periods as f64 * period_samples;
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
        let whole_number = (rest_samples - exact).abs() < WHOLE_SAMPLES + WHOLE_SIGMAS * sigma;
        let common = if whole_number { exact } else { rest_samples } * sample_chips;
        // Beyond this the way that satellites and antenna took in between is not foreseen.
        let foreseen = known.is_some() && (ahead / rate_hz).abs() < FORESEEN_S;
        let now_s = self.metadata.rate.elapsed_s(now);
        let ratio = signal.centre_hz() / component.chip_rate_hz;
        for track in self.tracks.iter_mut().filter(|track| track.channel.signal() == signal) {
            let watched = &mut track.watched;
            let doppler = watched.rates.map_or(0.0, |rates| track.channel.code_doppler_hz(&rates) / ratio);
            let (chips, _, looks) = watched.since;
            let seen = if foreseen || looks == 0 { common + rest_s * doppler } else { chips / f64::from(looks) };
            let expected = watched.trend.forecast(now_s).map(|expected| expected.chips);
            let begins = known.is_some() && watched.begin.take().is_some();
            track.channel.resume(now, seen, expected, periods, begins);
            if !foreseen {
                watched.trend.clear();
            }
            if known.is_none() {
                track.decoder = Decoder::new(track.channel.signal(), track.channel.sv());
                track.since = now;
            }
        }
        let samples = if whole_number || periods != 0 { samples as i64 } else { 0 };
        self.gap.stage = Stage::Quiet;
        self.solver.jump(whole && known.is_some());
        if known.is_none() {
            self.gap.unknown = Some(since);
        } else if samples != 0 {
            self.report(since, samples, sink)?;
        }
        Ok(())
    }

    /// Writes what happened, and sets the clock.
    fn report(&mut self, sample: u64, samples: i64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        self.timebase.step(samples);
        self.gap.jumps.push(Jump { sample, samples });
        self.gap.unknown = None;
        let event = if samples > 0 { Event::SamplesLost } else { Event::SamplesDoubled };
        for track in self.tracks.iter().filter(|track| !track.channel.is_lost()) {
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
        }
        Ok(())
    }

    /// Compares a fix's clock with that of the fix before: a jump that no channel lived through shows in it.
    /// Says whether the fix is to be left out, as its clock is to be set first.
    pub(super) fn clock_jumped(&mut self, fix: &Fix, sink: &mut dyn Sink) -> Result<bool, ReceiveError> {
        let rate = self.metadata.rate;
        let sigma_s = fix.sigma_clock_m / crate::gnss::earth::SPEED_OF_LIGHT_MPS;
        let now = (fix.sample, fix.clock_bias_s, fix.clock_drift, sigma_s);
        let Some((sample, bias_s, drift, before_s)) = self.gap.last_fix.replace(now) else { return Ok(false) };
        let passed_s = rate.elapsed_s(fix.sample.saturating_sub(sample));
        if passed_s < PAUSE_S && self.gap.unknown.is_none() {
            return Ok(false);
        }
        let off_s = fix.clock_bias_s - bias_s - drift * passed_s;
        let samples = -off_s * rate.hz();
        let noise_s = CLOCK_SIGMAS * libm::hypot(sigma_s, before_s) + CLOCK_DRIFT * passed_s;
        let at = self.gap.unknown.take();
        if off_s.abs() < noise_s + if at.is_some() { 0.5 / rate.hz() } else { CLOCK_LEAST_S } {
            return Ok(false);
        }
        let at = at.unwrap_or(sample);
        self.report(at, samples.round() as i64, sink)?;
        self.solver.jump(false);
        self.gap.last_fix = Some((sample, bias_s, drift, before_s));
        Ok(true)
    }
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
    let small = turned - if 2 * turned > group { group } else { 0 };
    if fits && alone {
        return Some(periods);
    }
    let allowed = (measured_s - seconds(small)).abs() < 3.0 * fit.sigma_s + MODEL_S;
    (allowed && fit.sigma_s < group_s && small.abs() <= 1).then_some(small)
}
