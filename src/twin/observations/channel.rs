//! One channel by theory: when it finds, locks and loses a signal, and what it measures at a tick.
//!
//! A search draws the power of its sums, which has as many degrees of freedom as theirs, against the
//! receiver's threshold. Lock follows the mean cosine of the phase error, strength the estimate of C/N0, and
//! slips come as often as those of a first-order loop (A. J. Viterbi, Principles of Coherent Communication,
//! 1966). Errors of code, carrier and C/N0 are first-order processes. Limits: no hand-over to a wrong peak or
//! frequency; a slip is one of a whole or half cycle.

use std::f64::consts::{PI, TAU};

use generator::random::Stream;
use generator::scene::Scene;
use generator::transmit::Transmitter;
use gnss::record::Event;
use gnss::satellite::System;
use gnss::signal::Link;
use receiver::Given;
use receiver::settings::Settings;
use receiver::track::cn0::{LARGEST_CN0_DBHZ, relative_sigma};
use receiver::track::{Measurement, Report, Symbol};

use super::clock::Instant;
use super::law::Law;
use super::listening::Listening;
use super::oscillator::OscillatorLoop;
use super::rays::Sight;

/// Longest step in which rays, lock and strength are followed where they change.
const STEP_S: f64 = 0.05;
/// C/N0 of the whole signal below which they are.
const WEAK_HZ: f64 = 1000.0;
/// Time in which the mean of phase lock follows.
const LOCK_S: f64 = 0.12;
/// Share of the time between searches for all in which a lost satellite is searched for.
pub(super) const LOST_SHARE: f64 = 0.25;
/// Time for which a satellite whose message leads nowhere is left alone.
const REFUSED_S: f64 = 120.0;
/// Largest standard deviation of a phase error that counts, in radians: it has no lock.
const MOST_RAD: f64 = 2.0;

/// State of a search or of tracking.
pub(super) enum State {
    /// Searched for next at that time, after so many searches without result.
    Sought { next_s: f64, misses: u32 },
    /// Followed.
    Followed(Followed),
}

/// Times of a channel, in seconds.
pub(super) struct Followed {
    pub lock_s: f64,
    /// Time from which on symbols are known; infinite before phase lock.
    pub symbols_s: f64,
    pub is_synchronised: bool,
    pub locked_since_s: Option<f64>,
    pub missing_since_s: Option<f64>,
    /// Mean cosine of twice the phase error.
    pub cosine: f64,
    /// First code period that is counted.
    pub base: i64,
    /// First code period of the next symbol to be handed over.
    pub symbol: Option<i64>,
}

/// Facts about the rest of the receiver.
#[derive(Clone, Copy)]
pub(super) struct Around {
    /// True if there was a fix.
    pub has_fix: bool,
    /// True if another signal of the satellite is followed.
    pub is_led: bool,
}

/// One satellite's signal in the receiver.
pub(super) struct Channel {
    pub link: Link,
    /// Index of the law and of the transmitter in its front end.
    pub law: usize,
    pub transmitter: usize,
    /// Noise density over the thermal one; none without noise.
    pub density: Option<f64>,
    pub(super) stream: Stream,
    pub(super) state: State,
    pub(super) listening: Listening,
    /// Time at which the satellite was lost.
    pub(super) lost_s: Option<f64>,
    pub(super) known: bool,
    pub(super) attempts: u64,
    last_s: Option<f64>,
    /// Errors of code and carrier in deviations, and of C/N0 as a share.
    pub(super) code: f64,
    pub(super) carrier: f64,
    pub(super) strength: f64,
    /// C/N0 of the whole signal that is estimated, in hertz.
    pub(super) mean_hz: f64,
    /// Position of the code loop in chips behind the first ray, and the carrier's turn there, in cycles.
    rest_chips: f64,
    turn_cycles: f64,
    /// Whole cycles that join the carriers of polynomials, and what they join.
    joined: Option<(f64, f64)>,
    /// Cycles of slips, and the unknown whole number.
    pub(super) slipped_cycles: f64,
    pub(super) inverted: bool,
}

/// Scene and settings of a channel.
pub(super) struct World<'a> {
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub law: &'a Law,
    pub transmitter: &'a Transmitter,
    pub oscillator: Option<&'a OscillatorLoop>,
    /// Time of the first search, and samples of the first front end a second.
    pub first_search_s: f64,
    pub rate_hz: f64,
}

impl Channel {
    /// A channel that has found nothing.
    pub fn new(link: Link, (law, transmitter): (usize, usize), stream: Stream, first_search_s: f64) -> Self {
        Self {
            link,
            law,
            transmitter,
            density: None,
            stream: stream.satellite(link.sv).named(link.signal.name),
            state: State::Sought { next_s: first_search_s, misses: 0 },
            listening: Listening::new(link.sv.system == System::Sbas),
            lost_s: None,
            known: false,
            attempts: 0,
            last_s: None,
            code: 0.0,
            carrier: 0.0,
            strength: 0.0,
            mean_hz: 0.0,
            rest_chips: 0.0,
            turn_cycles: 0.0,
            joined: None,
            slipped_cycles: 0.0,
            inverted: false,
        }
    }

    /// True while the signal is followed.
    pub fn is_followed(&self) -> bool {
        matches!(self.state, State::Followed(_))
    }

    /// True if messages may be asked for in what begins at an instant.
    pub fn hears(&mut self, scene: &Scene, from: &Instant) -> bool {
        if self.is_followed() {
            self.listening.look(scene, self.link, from);
        }
        !self.is_followed() || self.listening.is_open()
    }

    /// Leaves a signal alone whose message leads nowhere.
    pub fn give_up(&mut self, now_s: f64) {
        self.state = State::Sought { next_s: now_s + REFUSED_S, misses: 0 };
        self.lost_s = Some(now_s);
    }

    /// Follows the signal up to a tick. `at` gives the instant of a time in seconds.
    pub fn follow(&mut self, world: &World<'_>, around: Around, tick: &Instant, at: &dyn Fn(f64) -> Instant) -> Given {
        let mut given = Given { link: self.link, found: None, report: Report::default() };
        let now_s = tick.seconds;
        let from_s = self.last_s.replace(now_s).unwrap_or(now_s);
        let passed_s = now_s - from_s;
        let sight = self.see(world, tick);
        let is_steady = sight.as_ref().is_some_and(|sight| !sight.is_reflected())
            && self.mean_hz > WEAK_HZ
            && self.cn0_hz(world, sight.as_ref()) > 0.5 * self.mean_hz
            && matches!(&self.state, State::Followed(one) if one.is_synchronised && one.cosine > 0.9);
        let is_idle = sight.is_none() && !self.is_followed();
        let steps = if is_steady || is_idle { 1 } else { (passed_s / STEP_S).ceil().max(1.0) as u64 };
        for step in 1..steps {
            let instant = at(from_s + passed_s * step as f64 / steps as f64);
            let sight = self.see(world, &instant);
            let key = tick.number * 4096 + step;
            self.step(world, around, (&instant, passed_s / steps as f64, key), sight.as_ref(), &mut given);
        }
        let last = (tick, passed_s / steps as f64, tick.number * 4096);
        self.step(world, around, last, sight.as_ref(), &mut given);
        if let Some(sight) = &sight {
            self.measure(world, tick, sight, &mut given.report);
        }
        given
    }

    fn see(&self, world: &World<'_>, instant: &Instant) -> Option<Sight> {
        let (own, later_s) = instant.own(world.law.front)?;
        Sight::new((world.scene, world.transmitter, world.law), world.oscillator, (own, later_s))
    }

    /// C/N0 of the whole signal in the noise that the replica meets, where the code loop is.
    fn cn0_hz(&self, world: &World<'_>, sight: Option<&Sight>) -> f64 {
        let Some(sight) = sight else { return 0.0 };
        let peak = world.law.found.value(0.0);
        let hz = sight.sum(world.law, self.rest_chips).norm_sqr() / (peak * peak);
        self.density.map_or(1e10, |density| hz / density)
    }

    /// One step of the channel's state.
    fn step(
        &mut self,
        world: &World<'_>,
        around: Around,
        (instant, passed_s, key): (&Instant, f64, u64),
        sight: Option<&Sight>,
        given: &mut Given,
    ) {
        let now_s = instant.seconds;
        self.join(sight);
        if let Some(sight) = sight {
            self.rest(world.law, sight, passed_s);
        }
        let cn0_hz = self.cn0_hz(world, sight);
        match &self.state {
            State::Sought { next_s, misses } => {
                let (next_s, misses) = (*next_s, *misses);
                if next_s <= now_s {
                    given.found = self.search(world, around, (cn0_hz, next_s, misses), (instant, sight));
                }
            }
            State::Followed(_) => self.track(world, (cn0_hz, passed_s, key), sight, instant, &mut given.report),
        }
    }

    /// Joins the carriers of neighbouring polynomials: less the delay they change slowly.
    fn join(&mut self, sight: Option<&Sight>) {
        let Some(sight) = sight else {
            self.joined = None;
            return;
        };
        let apart = sight.carrier_cycles - self.link.carrier_hz() * sight.delay_s;
        let whole = self.joined.map_or(0.0, |(whole, before)| (before - apart - whole).round() + whole);
        self.joined = Some((whole, apart + whole));
    }

    /// Moves the code loop towards the position at which it rests, and the carrier to that of the sum there.
    fn rest(&mut self, law: &Law, sight: &Sight, passed_s: f64) {
        if !sight.is_reflected() {
            (self.rest_chips, self.turn_cycles) = (self.rest_chips * law.code_memory(passed_s), 0.0);
            return;
        }
        let memory = if self.is_followed() { law.code_memory(passed_s) } else { 0.0 };
        let rest = sight.rest_chips(law);
        self.rest_chips = rest + memory * (self.rest_chips - rest);
        let turn = -sight.sum(law, self.rest_chips).arg() / TAU;
        self.turn_cycles = turn + (self.turn_cycles - turn).round();
    }

    /// Follows lock and strength.
    fn track(
        &mut self,
        world: &World<'_>,
        (cn0_hz, passed_s, key): (f64, f64, u64),
        sight: Option<&Sight>,
        instant: &Instant,
        report: &mut Report,
    ) {
        let (law, now_s) = (world.law, instant.seconds);
        let (a, b) = self.stream.part(5).normals(key);
        let (c, d) = self.stream.part(6).normals(key);
        let uniform = (self.stream.part(7).word(key) >> 11) as f64 / 9_007_199_254_740_992.0;
        let age = |memory: f64, value: f64, normal: f64| memory * value + (1.0 - memory * memory).sqrt() * normal;
        self.code = age(law.code_memory(passed_s), self.code, a);
        self.carrier = age(law.carrier_memory, self.carrier, b);
        let average_s = law.tracking.cn0_average_s;
        let memory = libm::exp(-passed_s / average_s);
        self.strength = age(memory, self.strength, c);
        self.mean_hz = cn0_hz + memory * (self.mean_hz - cn0_hz);
        let stated_hz = self.stated_hz(law);
        let State::Followed(followed) = &mut self.state else { return };
        let is_noisy = self.density.is_some();
        let (phase_rad2, _) = if is_noisy { law.carrier_variance(cn0_hz.max(1e-3)) } else { (0.0, 0.0) };
        let phase_rad2 = if sight.is_some() { phase_rad2.min(MOST_RAD * MOST_RAD) } else { MOST_RAD * MOST_RAD };
        let lag_rad = TAU * sight.map_or(0.0, |sight| sight.lag_cycles);
        let cosine = libm::exp(-2.0 * phase_rad2) * libm::cos(2.0 * lag_rad.clamp(-0.5 * PI, 0.5 * PI));
        followed.cosine = cosine + libm::exp(-passed_s / LOCK_S) * (followed.cosine - cosine);
        let sample = instant.sample;
        if followed.lock_s <= now_s && followed.locked_since_s.is_none() {
            if followed.cosine >= law.tracking.phase_lock_threshold {
                let since_s = followed.lock_s.max(now_s - passed_s);
                followed.locked_since_s = Some(since_s);
                followed.missing_since_s = None;
                report.events.push((instant.sample_at(since_s), Event::PhaseLocked));
                if !followed.is_synchronised {
                    followed.symbols_s = since_s + law.symbols_s(cn0_hz);
                }
            } else if now_s > followed.lock_s + 0.5 * law.tracking.pull_in_limit_s {
                followed.missing_since_s = Some(now_s - law.tracking.loss_s);
            }
        }
        // Slips of a first-order loop: 2B/(π²·ρ·I₀²(ρ)) a second, ρ the loop's signal over noise. A message
        // halves the cycle, which makes ρ a quarter.
        let share = if law.is_pilot { 1.0 } else { 4.0 };
        let rho = 1.0 / (share * phase_rad2.max(1e-6));
        let rate_hz =
            if rho > 40.0 { 0.0 } else { 2.0 * law.tracking.pll_bandwidth_hz / (PI * PI * rho * square_i0(rho)) };
        let slips = uniform < -libm::expm1(-rate_hz * passed_s);
        if followed.locked_since_s.is_some() && (followed.cosine < law.tracking.phase_unlock_threshold || slips) {
            followed.locked_since_s = None;
            followed.missing_since_s = Some(now_s);
            followed.lock_s = now_s + LOCK_S;
            report.events.push((sample, Event::CycleSlip));
            self.listening.resume(now_s);
            let cycles = if law.is_pilot { 1.0 } else { 0.5 };
            self.slipped_cycles += libm::copysign(cycles, d);
            if !law.is_pilot {
                self.inverted = !self.inverted;
            }
        }
        let is_weak = stated_hz < law.tracking.least_cn0_hz();
        if is_weak && followed.lock_s <= now_s {
            followed.missing_since_s = followed.missing_since_s.or(Some(now_s));
        } else if followed.locked_since_s.is_some() {
            followed.missing_since_s = None;
        }
        if followed.locked_since_s.is_some() && !followed.is_synchronised && followed.symbols_s <= now_s {
            followed.is_synchronised = true;
            report.events.push((instant.sample_at(followed.symbols_s), Event::BitSynchronised));
        }
        if followed.missing_since_s.is_some_and(|since_s| now_s - since_s >= law.tracking.loss_s) {
            report.events.push((sample, Event::LossOfLock));
            self.lost_s = Some(now_s);
            let wait_s = LOST_SHARE * world.settings.operation.reacquisition_interval_s;
            self.state = State::Sought { next_s: now_s + wait_s, misses: 0 };
        }
    }

    /// C/N0 of what is followed as it is estimated.
    fn stated_hz(&self, law: &Law) -> f64 {
        let hz = self.mean_hz * law.code.share;
        if self.density.is_none() {
            return hz;
        }
        let periods = 2.0 * law.tracking.cn0_average_s / law.component.period_s();
        let group = (law.group > 1).then_some(law.group);
        let sigma = relative_sigma(hz.max(1.0), law.component.period_s(), group, [periods; 2]);
        // A ratio of powers, which scatters alike in decibels to either side.
        (hz * libm::exp(sigma * self.strength)).max(1.0)
    }

    /// State of the replica at a tick, and the symbols that have ended by then.
    fn measure(&mut self, world: &World<'_>, tick: &Instant, sight: &Sight, report: &mut Report) {
        let (law, chip_rate_hz) = (world.law, world.law.component.chip_rate_hz);
        let cn0_hz = self.cn0_hz(world, Some(sight));
        let stated_hz = self.stated_hz(law);
        let is_noisy = self.density.is_some();
        let State::Followed(followed) = &mut self.state else { return };
        let code_m = if is_noisy { law.code.sigma_m(cn0_hz) * self.code } else { 0.0 };
        let delay_s =
            sight.delay_s - sight.oscillator_lag_s + (self.rest_chips + code_m / law.code.chip_m) / chip_rate_hz;
        let Some((own, later_s)) = tick.own(law.front) else { return };
        let Some(code) = world.transmitter.code_at(world.scene, law.lead, own, delay_s + later_s) else { return };
        if followed.base == 0 {
            // A few periods before it was found.
            followed.base = code.at.period - 100_000;
        }
        let (phase_rad2, rate_hz2) = if is_noisy { law.carrier_variance(cn0_hz.max(1.0)) } else { (0.0, 0.0) };
        let phase = phase_rad2.sqrt() / TAU * self.carrier;
        let (rate, _) = self.stream.part(8).normals(tick.number);
        let whole = self.joined.map_or(0.0, |(whole, _)| whole);
        let locked_s = followed.locked_since_s.map_or(0.0, |since_s| tick.seconds - since_s);
        let stated_dbhz = 10.0 * libm::log10(stated_hz / law.code.share * law.stated);
        report.measurements.push(Measurement {
            sample: tick.sample,
            code_periods: (code.at.period - followed.base).max(0) as u64,
            code_fraction: code.share,
            carrier_cycles: sight.carrier_cycles - sight.lag_cycles
                + whole
                + self.turn_cycles
                + phase
                + self.slipped_cycles,
            half_cycle_known: law.is_pilot && followed.is_synchronised,
            doppler_hz: rate_hz2.sqrt() * rate - sight.rate_hz,
            cn0_dbhz: stated_dbhz.min(LARGEST_CN0_DBHZ),
            locked_s,
            locked: followed.locked_since_s.is_some(),
        });
        if !followed.is_synchronised {
            return;
        }
        let now = code.at.period as f64 + code.share;
        let since = now - (tick.seconds - followed.symbols_s) / law.component.period_s();
        let pps = law.periods_per_symbol;
        let next = *followed.symbol.get_or_insert_with(|| (since / pps as f64).ceil() as i64 * pps);
        let ended = code.at.period.div_euclid(pps) * pps;
        if self.listening.is_open() && followed.locked_since_s.is_some() {
            let amplitude = (2.0 * law.symbol_s * cn0_hz).sqrt();
            let sense = if self.inverted { -1.0 } else { 1.0 };
            for first in (next..ended).step_by(pps.max(1) as usize) {
                let sent = world.transmitter.data_sign(law.data, first);
                let noise = if is_noisy { self.stream.part(9).normals(first as u64).0 } else { 0.0 };
                let left_s = (now - (first + pps) as f64) * law.component.period_s();
                report.symbols.push(Symbol {
                    first_period: (first - followed.base).max(0) as u64,
                    end: tick.sample.saturating_sub((left_s * world.rate_hz) as u64),
                    soft: (sent * sense * amplitude + noise) as f32,
                });
            }
        }
        followed.symbol = Some(next.max(ended));
    }
}

/// Square of the modified Bessel function I₀ (Abramowitz and Stegun, 9.6.12).
fn square_i0(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..=120 {
        let half = 0.5 * x / f64::from(k);
        term *= half * half;
        sum += term;
    }
    sum * sum
}
