//! Lost and doubled samples of one front end: suspicion, scan, and what follows for channels, clock and
//! solver.
//!
//! [`suspect`] compares every code with its own past, [`reseat`] moves the replicas to where a scan finds the
//! codes, [`settle`] counts the samples. Codes of all signals take part: their steps are compared in chips of
//! the front end's first signal, the scan takes the signal whose code is longest, and whole code periods are
//! counted by the signal whose symbols or secondary code are longest. Limits: a channel whose code period
//! does not divide what the scan leaves open is searched for again. Whole periods of all codes that are no
//! whole symbol show in no code but in the signs of symbols within 0.4 s and of secondary codes within 0.15
//! s, in which a phase loop loses its lock: where that takes longer than the lock's patience (code periods of
//! 10 ms and more), or the signs stay in doubt for two seconds, channels are lost and found again.

use std::collections::VecDeque;

use super::front_end::{FrontEnd, Track};
use super::shared::{LastFix, Shared};
use crate::gap::scan::{Found, Profile, Scan};
use crate::gap::{Edges, Jump, Step, Trend};
use crate::lead::lead;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use crate::source::{Planes, Stretch};
use crate::track::loops::Rates;
use crate::track::{Channel, Glance};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{Event, EventRow, Fix};
use gnss::signal::{Component, Signal};

mod reseat;
mod settle;
mod suspect;

/// Seconds between looks at least.
const LOOK_S: f64 = 0.045;
/// Looks whose rates are remembered: a phase loop that a secondary code misleads is noticed after three at
/// most.
const REMEMBERED: usize = 5;
/// Least number of channels whose power has to vanish at once.
const LEAST_CHANNELS: usize = 3;
/// Least share of the channels whose power has to vanish at once.
const VANISHED_SHARE: f64 = 0.66;
/// A clock whose reading after a pause is off by more than noise, this drift and this much was moved by a
/// jump.
const CLOCK_SIGMAS: f64 = 6.0;
const CLOCK_DRIFT: f64 = 2e-8;
const CLOCK_LEAST_S: f64 = 1e-6;
/// Shortest pause in seconds. A shorter one counts only when a jump of unknown size is known.
const PAUSE_S: f64 = 1.05;

/// Observations of a channel's code.
#[derive(Clone, Debug, Default)]
pub(super) struct Watched {
    trend: Trend,
    /// Code observations without the latest looks, which are kept beside it.
    settled: suspect::Settled,
    /// Rates when it last took a look.
    rates: Option<[Rates; 2]>,
    /// Rates at the last looks with their times in seconds, the latest last.
    rates_of_late: VecDeque<(f64, [Rates; 2])>,
    /// Looks in a row without a carrier lock.
    unlocked: usize,
    /// Edges of the signs of a secondary code in the window before the current one.
    turns: Option<Edges>,
    moved_chips: f64,
    profile: Profile,
    /// Sample at which symbols began before the jump.
    begin: Option<u64>,
    /// Steps since the code was reseated: sum of chips, of seconds, and number.
    since: (f64, f64, u32),
}

impl Watched {
    /// The trend begins again: the code's aid has changed.
    pub fn forget(&mut self) {
        self.trend.clear();
        self.settled = suspect::Settled::default();
        self.rates_of_late.clear();
    }

    /// A look without a carrier lock: what it shows is not taken, and after some nothing before counts. A
    /// phase loop that a secondary code misleads loses its lock first.
    fn pause(&mut self) {
        self.unlocked += 1;
        if self.unlocked >= REMEMBERED {
            self.forget();
        }
    }

    /// Remembers the rates of a look at `t_s`.
    fn remember(&mut self, t_s: f64, rates: [Rates; 2]) {
        if self.rates_of_late.len() >= REMEMBERED {
            self.rates_of_late.pop_front();
        }
        self.rates_of_late.push_back((t_s, rates));
    }

    /// The rates at `t_s` by the earliest look that is remembered.
    fn rates_before(&self, t_s: f64) -> Option<[Rates; 2]> {
        let (seen_s, rates) = self.rates_of_late.front()?;
        let later = |rates: &Rates| Rates { rate: rates.rate + rates.acceleration * (t_s - seen_s), ..*rates };
        Some(rates.each_ref().map(later))
    }
}

/// Stage of the search for a jump.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Stage {
    #[default]
    Quiet,
    /// Scan since a sample; `whole` is true if the carriers keep their whole cycles.
    Scanning { since: u64, whole: bool },
    /// The replicas were moved at a sample by what the scan found.
    Settling(Moved),
}

/// Move of the replicas.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Moved {
    /// Sample of the suspicion.
    since: u64,
    /// Sample of the move.
    at: u64,
    found: Found,
    /// True if the carriers keep their whole cycles.
    whole: bool,
}

/// The search for jumps, and those that were found.
#[derive(Default)]
pub(super) struct Gap {
    stage: Stage,
    last_look: u64,
    last_edges: u64,
    /// Sample at which a scan found the codes at their expected positions.
    in_place: Option<u64>,
    scan: Option<(&'static Signal, Scan)>,
    planes: Planes,
    pub jumps: Vec<Jump>,
    /// Sample since which the number of missing periods is unknown.
    pub unknown: Option<u64>,
}

impl Gap {
    /// True if codes are not at their expected positions.
    pub fn is_busy(&self) -> bool {
        self.stage != Stage::Quiet
    }
}

/// A channel's units in those of the front end's first signal.
#[derive(Clone, Copy)]
struct Units {
    /// Chips of the first signal in one of this.
    chips: f64,
    /// Carrier cycles a chip.
    ratio: f64,
    period_s: f64,
}

impl Units {
    fn of(channel: &Channel, reference: &Component) -> Self {
        let signal = channel.signal();
        let (chip_rate_hz, period_s) = lead(signal).map_or((1.0, 1.0), |c| (c.chip_rate_hz, c.period_s()));
        Self { chips: reference.chip_rate_hz / chip_rate_hz, ratio: signal.centre_hz() / chip_rate_hz, period_s }
    }

    /// Chips of the first signal a second that a code gains by its Doppler.
    fn doppler_chips(&self, channel: &Channel, rates: &[Rates; 2]) -> f64 {
        channel.code_doppler_hz(rates) / self.ratio * self.chips
    }
}

impl FrontEnd {
    /// The component that leads the first signal: steps of all codes are compared in its chips.
    fn reference(&self) -> Option<&'static Component> {
        lead(self.signal()?)
    }

    /// Looks at all codes at the end of a block, and goes on with what it suspects.
    pub(super) fn leap(
        &mut self,
        block: &Stretch,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        if let Stage::Scanning { since, whole } = self.gap.stage {
            match block.packed() {
                Some(block) => self.scan(block, since, whole, sink)?,
                // A model loses no samples.
                None => self.calm(),
            }
        }
        let now = block.end();
        if now < self.gap.last_look + self.samples(LOOK_S) {
            return Ok(());
        }
        let before = std::mem::replace(&mut self.gap.last_look, now);
        let middle_s = 0.5 * (self.metadata.rate.elapsed_s(before) + self.metadata.rate.elapsed_s(now));
        let glances: Vec<Option<Glance>> = self.tracks.iter_mut().map(|track| track.channel.glance()).collect();
        match self.gap.stage {
            Stage::Quiet => {
                // Signs in the wrong position say how many periods are missing; what shakes carriers says
                // less.
                self.compare_edges(now, sink)?;
                if self.gap.stage == Stage::Quiet {
                    self.suspect(&glances, middle_s, before, shared);
                }
            }
            Stage::Scanning { .. } => {}
            Stage::Settling(moved) => {
                self.gather(&glances, middle_s);
                self.settle(now, moved, shared, sink)?;
            }
        }
        Ok(())
    }

    /// Deviation of a look of so many code periods at a channel's code, in its own chips.
    fn look_chips(&self, track: &Track, periods: f64, shared: &Shared) -> f64 {
        let Some(noise) = shared.noise(track.channel.signal()) else { return 0.0 };
        let t_s = periods * lead(track.channel.signal()).map_or(1e-3, Component::period_s);
        // A loop of bandwidth B averages over 1/(2B).
        let open = 1.0 / (2.0 * noise.bandwidth_hz * t_s).sqrt();
        noise.sigma_m(libm::pow(10.0, track.cn0_dbhz / 10.0)) * open / noise.chip_m
    }

    /// Step that a look of `periods` code periods implies for the code. The look lies `chips` beyond the
    /// forecast. The third number is the forecast's variance over a look's.
    fn step_of(
        &self,
        track: &Track,
        (chips, periods, variance_ratio): (f64, f64, f64),
        rates: &[Rates; 2],
        shared: &Shared,
    ) -> Option<Step> {
        let units = Units::of(&track.channel, self.reference()?);
        Some(Step {
            chips: chips * units.chips,
            sigma_chips: self.look_chips(track, periods, shared) * variance_ratio.sqrt() * units.chips,
            doppler_chips: units.doppler_chips(&track.channel, rates),
        })
    }

    /// Nothing was found.
    fn calm(&mut self) {
        self.gap.stage = Stage::Quiet;
        self.tracks.iter_mut().for_each(|track| track.watched = Watched::default());
    }

    /// Writes what happened, and sets the clock.
    pub(super) fn report(
        &mut self,
        sample: u64,
        samples: i64,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        if self.step.number == 0 {
            shared.timebase.step(samples);
        }
        let main = self.step.main(sample);
        self.step.lose(samples);
        self.gap.jumps.push(Jump { sample: main, samples, front_end: self.step.number });
        self.gap.unknown = None;
        let event = if samples > 0 { Event::SamplesLost } else { Event::SamplesDoubled };
        for track in self.tracks.iter().filter(|track| !track.channel.is_lost()) {
            let (sv, signal) = (track.channel.sv(), track.channel.signal());
            sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
        }
        Ok(())
    }

    /// Compares a fix's clock with that of the fix before: a jump that no channel lived through shows in it.
    /// Returns whether the fix is to be left out, as its clock is to be set first. The front end is the
    /// first.
    pub(super) fn clock_jumped(
        &mut self,
        fix: &Fix,
        shared: &mut Shared,
        sink: &mut dyn Sink,
    ) -> Result<bool, ReceiveError> {
        let rate = self.metadata.rate;
        let sigma_s = fix.sigma_clock_m / SPEED_OF_LIGHT_MPS;
        let now = LastFix { sample: fix.sample, bias_s: fix.clock_bias_s, drift: fix.clock_drift, sigma_s };
        let Some(last) = shared.last_fix.replace(now) else { return Ok(false) };
        let passed_s = rate.elapsed_s(fix.sample.saturating_sub(last.sample));
        if passed_s < PAUSE_S && self.gap.unknown.is_none() {
            return Ok(false);
        }
        let off_s = fix.clock_bias_s - last.bias_s - last.drift * passed_s;
        let samples = -off_s * rate.hz();
        let noise_s = CLOCK_SIGMAS * libm::hypot(sigma_s, last.sigma_s) + CLOCK_DRIFT * passed_s;
        let at = self.gap.unknown.take();
        if off_s.abs() < noise_s + if at.is_some() { 0.5 / rate.hz() } else { CLOCK_LEAST_S } {
            return Ok(false);
        }
        let at = at.unwrap_or(last.sample);
        self.report(at, samples.round() as i64, shared, sink)?;
        shared.solver.jump(&self.signals, false);
        shared.last_fix = Some(last);
        Ok(true)
    }
}
