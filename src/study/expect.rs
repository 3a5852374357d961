//! Theory of a simulated channel: the plain description of the receiver's loops, and their thermal jitter.
//!
//! Gains are those of the receiver's settings. Everything else is `analysis::expect::theory`, which does not
//! know the receiver. Half-cycle wraps of the frequency discriminator count as white noise of their own.
//! Limits: small errors, noise by the squaring-loss formulas, no dynamics and no oscillator.

use std::f64::consts::TAU;

use super::correlator::Case;
use analysis::expect::theory::linear::{AssistedLoop, Feedback, FrequencyLoop, Linear, Pairs, PhaseLoop};
use analysis::expect::theory::{fll, pll};
use receiver::track::TrackingSettings;
use receiver::track::closed::Mode;
use receiver::track::loops::Gains;

/// A jitter and how much of a run counts as one value of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jitter {
    /// Standard deviation in the unit that the function names.
    pub sigma: f64,
    /// One-sided noise bandwidth of the loop as it is closed; for a frequency loop, half its noise gain over
    /// T.
    pub bandwidth_hz: f64,
    /// Loop updates per independent value.
    pub updates_per_value: f64,
}

impl Jitter {
    fn of(system: &Linear, raw: f64, update_s: f64) -> Option<Self> {
        let gain = system.noise_gain()?;
        Some(Self {
            sigma: raw * gain.sqrt(),
            bandwidth_hz: 0.5 * gain / update_s,
            updates_per_value: system.updates_per_value()?,
        })
    }
}

/// Variance in cycles² that half-cycle wraps leave in a loop that a two-quadrant frequency discriminator
/// drives.
fn wrapped(case: &Case, system: &Linear) -> Option<f64> {
    let wraps = if case.has_symbols() { fll::wrap_probability(case.update_s(), cn0_hz(case)?) } else { 0.0 };
    Some(0.25 * wraps * system.noise_gain()?)
}

fn plain(gains: Gains) -> [f64; 3] {
    [gains.phase, gains.rate, gains.acceleration]
}

/// The receiver's carrier loop where its phase is closed, updated every `update_s`.
pub fn carrier_loop(settings: &TrackingSettings, mode: Mode, update_s: f64) -> AssistedLoop {
    let assist = match mode {
        Mode::Assisted => Gains::design(1, settings.fll_assist_bandwidth_hz * update_s).phase,
        Mode::Frequency | Mode::Phase => 0.0,
    };
    AssistedLoop { gains: plain(Gains::design(settings.pll_order, settings.pll_bandwidth_hz * update_s)), assist }
}

/// The receiver's frequency loop of the pull-in.
pub fn frequency_loop(settings: &TrackingSettings, update_s: f64) -> FrequencyLoop {
    let gains = Gains::design(settings.fll_order, settings.fll_bandwidth_hz * update_s);
    FrequencyLoop { gains: [gains.phase, gains.rate], pairs: Pairs::Overlapping }
}

/// The receiver's code loop.
pub fn code_loop(settings: &TrackingSettings, update_s: f64) -> PhaseLoop {
    let gains = Gains::design(settings.dll_order, settings.dll_bandwidth_hz * update_s);
    PhaseLoop { gains: plain(gains), feedback: Feedback::PhaseAndRate }
}

/// C/N0 of what the replica finds behind the front end, Hz.
fn cn0_hz(case: &Case) -> Option<f64> {
    Some(case.component_hz()? * case.correlation.efficiency())
}

/// Jitter of the carrier's phase in cycles; `None` without noise, or where no phase is followed.
pub fn phase_cycles(case: &Case) -> Option<Jitter> {
    if case.mode == Mode::Frequency {
        return None;
    }
    let update_s = case.update_s();
    let closed = carrier_loop(&case.settings, case.mode, update_s);
    let mut jitter = Jitter::of(&closed.linear(), pll::raw_rad(update_s, cn0_hz(case)?) / TAU, update_s)?;
    let wraps = wrapped(case, &closed.linear_of_discriminator())?;
    jitter.sigma = (jitter.sigma * jitter.sigma + wraps).sqrt();
    Some(jitter)
}

/// Jitter of the carrier oscillator's frequency in hertz, whichever loop sets it; wraps only where the
/// frequency loop is alone.
pub fn frequency_hz(case: &Case) -> Option<Jitter> {
    let update_s = case.update_s();
    let raw_hz = pll::raw_rad(update_s, cn0_hz(case)?) / (TAU * update_s);
    if case.mode != Mode::Frequency {
        return Jitter::of(&carrier_loop(&case.settings, case.mode, update_s).linear_rate(), raw_hz, update_s);
    }
    let closed = frequency_loop(&case.settings, update_s);
    let mut jitter = Jitter::of(&closed.linear(), raw_hz, update_s)?;
    let wraps = wrapped(case, &closed.linear_of_discriminator())? / (update_s * update_s);
    jitter.sigma = (jitter.sigma * jitter.sigma + wraps).sqrt();
    Some(jitter)
}

/// Jitter of the code in chips; `None` without noise, and for the dot products behind a front end.
pub fn code_chips(case: &Case) -> Option<Jitter> {
    let (update_s, settings) = (case.update_s(), &case.settings);
    let discriminator = settings.dll_discriminator.into();
    let raw = case.correlation.raw_chips(discriminator, settings.spacing_chips, update_s, case.component_hz()?)?;
    Jitter::of(&code_loop(settings, update_s).linear(), raw, update_s)
}
