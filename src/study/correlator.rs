//! The receiver's loops on modelled correlations: one channel in steady tracking, without a sample.
//!
//! Every code period early, prompt and late, and the taps that watch for side peaks, are drawn with means
//! √(2T·C/N0)·R(ε)·sinc(ΔfT)·e^(jφ) and unit noise a component whose covariance is that of the taps; they go
//! through the loops, discriminators and C/N0 estimate of `receiver::track`, and what is left between truth
//! and oscillators is measured. Source of the model: Kaplan and Hegarty, Understanding GPS 2nd ed., 5.3.
//! Limits: one satellite, constant C/N0, no multipath; a period lasts its nominal time; signals of which both
//! sidebands of a sub-carrier are followed are left out.

use num_complex::Complex64;

use super::correlation::Correlation;
use super::measure::Moments;
use super::motion::{Motion, Truth};
use super::normal::{Normals, Purpose, symbol};
use super::watch::Watch;
use analysis::expect::theory::clock::PowerLaw;
use gnss::signal::{self, Component, Signal};
use receiver::correlate::units_to_chips;
use receiver::lead::{lead, other_side};
use receiver::track::closed::{Loops, Mode, Update};
use receiver::track::cn0::Cn0;
use receiver::track::loops::Rates;
use receiver::track::side::SidePeaks;
use receiver::track::{TrackingSettings, pilot_group};
use twin::correlations::factors;

/// One channel to be simulated.
#[derive(Clone, Debug)]
pub struct Case {
    /// The signal that is followed.
    pub signal: &'static Signal,
    /// The component of it whose replica is made.
    pub component: &'static Component,
    /// Settings of the channel, validated and fitted to the component.
    pub settings: TrackingSettings,
    /// Set of loops that run.
    pub mode: Mode,
    /// C/N0 of the whole signal in dB-Hz; `None` for no noise.
    pub cn0_dbhz: Option<f64>,
    /// Motion of the truth.
    pub motion: Motion,
    /// Noise of the receiver's oscillator, if it has any.
    pub oscillator: Option<PowerLaw>,
    /// Shape of the correlation's peak.
    pub correlation: Correlation,
    /// True if the receiver's detectors may declare the signal lost.
    pub watched: bool,
    /// Delay of the code at the beginning, in chips.
    pub start_chips: f64,
    /// Time before anything is measured; the loops begin on the true Doppler and its rate.
    pub settle_s: f64,
    /// Time that is measured, seconds.
    pub duration_s: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// The signals that a channel of this kind can follow: those of which one component is followed. The carrier
/// of one with channels is that of channel 0.
pub fn signals() -> Vec<&'static Signal> {
    let alone = |signal: &&'static Signal| lead(signal).is_some_and(|lead| other_side(lead, signal).is_none());
    signal::all().into_iter().filter(alone).collect()
}

impl Case {
    /// Code periods whose signs are known among each other in steady tracking: those of a symbol, of symbols
    /// that are chips of a known code those of a bit, of BeiDou that of D1, and of a pilot as many as are
    /// grouped.
    fn group(&self) -> u32 {
        let symbol = self.component.message.zip(self.component.periods_per_symbol());
        let known = symbol.map(|(message, periods)| {
            let signs = self.signal.satellites().map(|sv| (message.bit)(sv).len() as u32).max();
            if periods == 1 { signs.unwrap_or(1) } else { periods }
        });
        known.unwrap_or_else(|| pilot_group(self.period_s()))
    }

    fn period_s(&self) -> f64 {
        self.component.period_s()
    }

    pub(super) fn has_symbols(&self) -> bool {
        self.component.message.is_some()
    }

    /// C/N0 of the component before any front end; `None` without noise.
    pub(super) fn component_hz(&self) -> Option<f64> {
        Some(libm::pow(10.0, self.cn0_dbhz? / 10.0) * self.component.power_share)
    }

    /// Time between loop updates, which is the coherent integration.
    pub fn update_s(&self) -> f64 {
        self.period_s() * f64::from(self.mode.periods_per_update(&self.settings, self.group()))
    }
}

/// Reason why a run ended early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The replica left the correlation peak.
    Code,
    /// The frequency error left the range of the carrier's discriminator.
    Carrier,
    /// The receiver's detectors gave the signal up: phase unlocked or C/N0 too low for `loss_s`.
    Declared,
}

/// True errors and raw discriminators at one loop update.
#[derive(Clone, Copy, Debug)]
pub struct Epoch {
    /// End of the integration.
    pub time_s: f64,
    /// Mean errors over the integration, truth minus oscillator.
    pub code_chips: f64,
    /// Phase error since the start in cycles, without regard to slips.
    pub phase_cycles: f64,
    /// Mean error of the frequency, Hz.
    pub frequency_hz: f64,
    /// Discriminator values, and the loops' response to them.
    pub update: Update,
}

/// Measurements over a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    /// Time of an update, seconds.
    pub update_s: f64,
    /// Truth minus oscillator, means over an integration.
    pub code_chips: Moments,
    /// Phase error in cycles from the point of lock nearest in time; empty in [`Mode::Frequency`].
    pub phase_cycles: Moments,
    /// Largest of those.
    pub phase_peak_cycles: f64,
    /// Error of the frequency, Hz.
    pub frequency_hz: Moments,
    /// Values of the discriminators.
    pub raw_code_chips: Moments,
    /// Values of the phase discriminator, cycles.
    pub raw_phase_cycles: Moments,
    /// Values of the frequency discriminator, Hz.
    pub raw_frequency_hz: Moments,
    /// Passages to the next point of lock, half a cycle away with symbols and a whole one without.
    pub slips: u64,
    /// Breaks of the carrier that the receiver's detectors declared, from the start on.
    pub interruptions: u64,
    /// Time of the signal's loss in seconds, and its reason.
    pub lost: Option<(f64, Loss)>,
    /// Last time at which the code was off the main peak, from the start on.
    pub off_main_s: f64,
    /// True if the code was on the main peak at the end.
    pub on_main: bool,
}

/// Distance from the main peak within which the code is on it: half the way to the first side peak of
/// BOC(1,1).
const MAIN_CHIPS: f64 = 0.25;

/// Runs a case and condenses it.
pub fn run(case: &Case) -> Outcome {
    let mut outcome = Outcome::default();
    let spacing = if case.has_symbols() { 0.5 } else { 1.0 };
    let mut locked_at = 0.0;
    let follows_phase = case.mode != Mode::Frequency;
    let end = simulate(case, |epoch| {
        outcome.update_s = epoch.update.integration_s;
        outcome.on_main = epoch.code_chips.abs() <= MAIN_CHIPS;
        if !outcome.on_main {
            outcome.off_main_s = epoch.time_s;
        }
        let settled = epoch.time_s > case.settle_s;
        while follows_phase && (epoch.phase_cycles - locked_at).abs() > spacing {
            locked_at += spacing.copysign(epoch.phase_cycles - locked_at);
            outcome.slips += u64::from(settled);
        }
        if !settled {
            return;
        }
        outcome.code_chips.add(epoch.code_chips);
        outcome.frequency_hz.add(epoch.frequency_hz);
        if follows_phase {
            outcome.phase_cycles.add(epoch.phase_cycles - locked_at);
            outcome.phase_peak_cycles = outcome.phase_peak_cycles.max((epoch.phase_cycles - locked_at).abs());
        }
        outcome.raw_code_chips.add(epoch.update.dll_chips);
        outcome.raw_phase_cycles.add(epoch.update.pll_cycles);
        outcome.raw_frequency_hz.add(epoch.update.fll_hz);
    });
    (outcome.interruptions, outcome.lost) = end;
    outcome
}

/// Runs a case and hands out every loop update; gives the breaks that the receiver's detectors declared, and
/// when and why the signal was lost.
pub fn simulate(case: &Case, mut each: impl FnMut(&Epoch)) -> (u64, Option<(f64, Loss)>) {
    let mut channel = Channel::new(case);
    let updates = (case.duration_s + case.settle_s) / channel.update_s;
    for _ in 0..updates.ceil() as u64 {
        let epoch = channel.integrate();
        each(&epoch);
        let loss = if epoch.code_chips.abs() > 1.0 {
            Some(Loss::Code)
        } else if epoch.frequency_hz.abs() * channel.update_s > 0.5 {
            Some(Loss::Carrier)
        } else if channel.given_up {
            Some(Loss::Declared)
        } else {
            None
        };
        if let Some(loss) = loss {
            return (channel.watch.interruptions, Some((epoch.time_s, loss)));
        }
    }
    (channel.watch.interruptions, None)
}

/// Early, prompt and late; the taps on either side peak where those are watched; very early and very late
/// where the discriminator takes them.
#[derive(Clone, Copy, Debug)]
struct Taps {
    count: usize,
    /// Lead of each tap over the prompt, chips.
    ahead_chips: [f64; MOST_TAPS],
    /// Rows that give them their covariance, from independent normals (Cholesky).
    rows: [[f64; MOST_TAPS]; MOST_TAPS],
}

const MOST_TAPS: usize = 7;

impl Taps {
    fn new(correlation: &Correlation, settings: &TrackingSettings, side: Option<&SidePeaks>) -> Self {
        let half = 0.5 * settings.spacing_chips;
        let [above, below] = side.map_or([0.0; 2], |side| side.taps().map(units_to_chips));
        let outer = settings.dll_discriminator.widest() * half;
        let ahead_chips = [half, 0.0, -half, above, below, outer, -outer];
        let rows = factors(&ahead_chips, |apart| correlation.noise(apart));
        let count = if outer > half { MOST_TAPS } else { 3 + if side.is_some() { 2 } else { 0 } };
        Self { count, ahead_chips, rows }
    }
}

/// Oscillators, loops and truth of one channel.
struct Channel<'a> {
    case: &'a Case,
    truth: Truth<'a>,
    normals: Normals,
    taps: Taps,
    side: Option<SidePeaks>,
    /// T·C/N0 of the prompt where the search found it.
    found_snr: f64,
    /// Mean of a prompt without errors, over R(0).
    amplitude: f64,
    noisy: bool,
    chips_per_cycle: f64,
    period_s: f64,
    group: u32,
    periods: u32,
    update_s: f64,
    has_symbols: bool,
    symbol: f64,
    loops: Loops,
    cn0: Cn0,
    before: Option<Complex64>,
    watch: Watch,
    given_up: bool,
    symbol_sum: Complex64,
    number: u64,
    /// Truth minus oscillator at the start of the running period.
    phase_cycles: f64,
    code_chips: f64,
}

impl<'a> Channel<'a> {
    fn new(case: &'a Case) -> Self {
        let chip_rate_hz = case.component.chip_rate_hz;
        let (period_s, update_s, group) = (case.period_s(), case.update_s(), case.group());
        let shape = case.correlation.code_shape(&case.settings);
        let mut loops = Loops::new(&case.settings, shape, case.has_symbols(), case.motion.doppler_hz);
        loops.design(&case.settings, case.mode, false, update_s);
        loops.carrier = Rates { acceleration: case.motion.rate_hz_s, ..loops.carrier };
        // As a channel of the receiver estimates it: of prompts each of which has a sign of its own by their
        // power.
        let mut cn0 = if case.has_symbols() && group == 1 {
            Cn0::of_single_periods(period_s, case.settings.cn0_average_s)
        } else {
            Cn0::new(group, period_s, case.settings.cn0_average_s)
        };
        if case.mode == Mode::Phase {
            cn0.know_symbols();
        }
        let cn0_hz = case.component_hz();
        let side = SidePeaks::new(case.component, case.settings.waveform).filter(|_| case.watched);
        let taps = Taps::new(&case.correlation, &case.settings, side.as_ref());
        let amplitude = (2.0 * period_s * cn0_hz.unwrap_or(1.0) / case.correlation.noise_power()).sqrt();
        let found = amplitude * case.correlation.value(case.start_chips);
        Self {
            case,
            truth: Truth::new(&case.motion, case.oscillator.as_ref(), case.signal.centre_hz(), period_s, case.seed),
            normals: Normals::new(case.seed, Purpose::Thermal),
            taps,
            side,
            found_snr: 0.5 * found * found,
            amplitude,
            noisy: cn0_hz.is_some(),
            chips_per_cycle: chip_rate_hz / case.signal.centre_hz(),
            period_s,
            group,
            periods: case.mode.periods_per_update(&case.settings, group),
            update_s,
            has_symbols: case.has_symbols(),
            symbol: 1.0,
            loops,
            cn0,
            before: None,
            watch: Watch::new(period_s, group),
            given_up: false,
            symbol_sum: Complex64::ZERO,
            number: 0,
            // On a side peak of other sign too the loops begin in lock.
            phase_cycles: if found < 0.0 { 0.5 } else { 0.0 },
            code_chips: case.start_chips,
        }
    }

    /// One loop update: the periods of an integration, then the loops.
    fn integrate(&mut self) -> Epoch {
        let carrier_hz = self.loops.carrier.mean(self.update_s);
        let code_hz = self.loops.code.mean(self.update_s);
        let mut sums = [Complex64::ZERO; 4];
        let (mut phase, mut code, mut frequency) = (0.0, 0.0, 0.0);
        for _ in 0..self.periods {
            let truth = self.truth.advance();
            let ran = carrier_hz * self.period_s;
            let gained = truth.cycles - ran;
            let mean_cycles = self.phase_cycles + truth.mean_cycles - 0.5 * ran;
            // The code's truth follows the carrier's, and so does the aid of its oscillator.
            let code_gained = gained * self.chips_per_cycle - code_hz * self.period_s;
            let mean_chips = self.code_chips + 0.5 * code_gained;
            let [early, prompt, late, ahead, behind, x, y] = self.correlate(mean_cycles, gained, mean_chips);
            // The model's noise has unit variance a component.
            self.cn0.add(prompt, Some(if self.noisy { 2.0 } else { 0.0 }));
            sums.iter_mut().zip([early, prompt, late, x - y]).for_each(|(sum, tap)| *sum += tap);
            phase += mean_cycles;
            code += mean_chips;
            frequency += gained;
            self.phase_cycles += gained;
            self.code_chips += code_gained;
            self.number += 1;
            self.watch(prompt);
            self.watch_side_peaks(prompt, [ahead, behind]);
        }
        let update = self.loops.close(self.case.mode, sums, self.before, self.periods, self.update_s, self.cn0.hz());
        self.before = Some(sums[1]);
        self.phase_cycles -= update.carrier_jump_cycles;
        self.code_chips -= update.code_jump_chips;
        let share = 1.0 / f64::from(self.periods);
        Epoch {
            time_s: self.number as f64 * self.period_s,
            code_chips: code * share,
            phase_cycles: phase * share,
            frequency_hz: frequency / self.update_s,
            update,
        }
    }

    /// Shows the prompt of the period just ended to the detectors of steady tracking.
    fn watch(&mut self, prompt: Complex64) {
        if !self.case.watched || self.case.mode != Mode::Phase {
            return;
        }
        self.symbol_sum += prompt;
        if self.number.is_multiple_of(u64::from(self.group)) {
            self.given_up |= self.watch.add(self.symbol_sum, self.cn0.hz(), self.number, &self.case.settings);
            self.symbol_sum = Complex64::ZERO;
        }
    }

    /// Shows the period just ended to the receiver's evidence for side peaks, and moves as a channel does.
    fn watch_side_peaks(&mut self, prompt: Complex64, neighbours: [Complex64; 2]) {
        let snr = self.cn0.hz().map_or(self.found_snr, |hz| hz * self.period_s);
        let Some(side) = &mut self.side else { return };
        let Some(units) = side.add(prompt.norm_sqr(), neighbours.map(|sum| sum.norm_sqr()), snr) else { return };
        let ratio = side.ratio();
        self.code_chips -= units_to_chips(units);
        if ratio < 0.0 {
            self.phase_cycles -= 0.5;
        }
        self.cn0.raise(1.0 / (ratio * ratio));
        self.watch.interruptions += 1;
    }

    /// The taps of one period ([`Taps`]), of mean phase error `cycles`, which turns by
    /// `turned` cycles in it, and mean code error `chips`.
    fn correlate(&mut self, cycles: f64, turned: f64, chips: f64) -> [Complex64; MOST_TAPS] {
        if self.has_symbols && self.number.is_multiple_of(u64::from(self.group)) {
            self.symbol = symbol(self.case.seed, self.number / u64::from(self.group));
        }
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * (cycles - cycles.floor()));
        let carrier = Complex64::new(cos, sin) * (self.amplitude * self.symbol * sinc(turned));
        let Taps { count, ahead_chips, rows } = &self.taps;
        let (mut sums, mut normals) = ([Complex64::ZERO; MOST_TAPS], [Complex64::ZERO; MOST_TAPS]);
        if self.noisy {
            normals.iter_mut().take(*count).for_each(|normal| *normal = self.normals.next());
        }
        for ((sum, ahead), row) in sums.iter_mut().zip(ahead_chips).zip(rows).take(*count) {
            let noise: Complex64 = row.iter().zip(normals).map(|(factor, normal)| normal * *factor).sum();
            *sum = carrier * self.case.correlation.value(chips - ahead) + noise;
        }
        sums
    }
}

/// sin(πx)/(πx); the series of three terms below 0.1 errs by 2e-7.
fn sinc(x: f64) -> f64 {
    let angle = std::f64::consts::PI * x;
    let square = angle * angle;
    if square < 0.1 { 1.0 - square / 6.0 * (1.0 - square / 20.0) } else { libm::sin(angle) / angle }
}
