//! Given loops against the rules of thumb: jitter over C/N0 beside 15°, d/6 and 1/(12T), and error under
//! jerk.
//!
//! The rules are those of Kaplan and Hegarty, Understanding GPS 2nd ed., 5.6: 3σ and dynamic error within
//! 45°, d/2 and 1/(4T). They are conservative. They do not mark the point of loss, which the simulation shows
//! beside them. Limits: one run a level.

use super::correlation::Correlation;
use super::correlator::{Case, Loss, run, simulate};
use super::expect::{self, Jitter};
use super::motion::Motion;
use analysis::expect::theory::clock::PowerLaw;
use analysis::expect::theory::oscillator;
use analysis::expect::theory::pll;
use gnss::gps::l1ca;
use gnss::signal::Signal;
use receiver::lead::lead;
use receiver::track::TrackingSettings;
use receiver::track::closed::Mode;
use receiver::track::loops::Gains;

/// Jitter of the loops at one C/N0; predicted and measured.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    /// C/N0, dB-Hz.
    pub cn0_dbhz: f64,
    /// Phase loop, thermal noise alone, degrees.
    pub phase_deg: (f64, Option<f64>),
    /// Phase loop with the oscillator, degrees.
    pub phase_with_oscillator_deg: (f64, Option<f64>),
    /// Code loop, chips.
    pub code_chips: (f64, Option<f64>),
    /// Frequency loop of the pull-in, hertz.
    pub frequency_hz: (f64, Option<f64>),
    /// Per hour, thermal noise alone.
    pub slips_per_hour: f64,
    /// Time to the signal's loss in seconds, with the oscillator and under the receiver's detectors, and its
    /// reason.
    pub lost: Option<(f64, Loss)>,
}

/// A channel of GPS L1 C/A with these settings.
pub fn channel(settings: &TrackingSettings, mode: Mode, cn0_dbhz: Option<f64>) -> Case {
    channel_of(&l1ca::L1_CA, settings, mode, cn0_dbhz)
}

/// A channel of a signal's leading component with these settings, without a front end.
pub fn channel_of(signal: &'static Signal, settings: &TrackingSettings, mode: Mode, cn0_dbhz: Option<f64>) -> Case {
    let component = lead(signal).unwrap_or(&l1ca::L1_CA.components[0]);
    Case {
        signal,
        component,
        settings: settings.fitted(component),
        mode,
        cn0_dbhz,
        motion: Motion::default(),
        oscillator: None,
        correlation: Correlation::of_component(component, settings.waveform),
        watched: false,
        start_chips: 0.0,
        settle_s: 10.0,
        duration_s: 600.0,
        seed: 1,
    }
}

/// Runs the loops at one C/N0 for `duration_s`, without and with an oscillator.
pub fn level(settings: &TrackingSettings, noise: &PowerLaw, cn0_dbhz: f64, duration_s: f64) -> Level {
    let tracking = Case { duration_s, ..channel(settings, Mode::Phase, Some(cn0_dbhz)) };
    let pull_in = Case { mode: Mode::Frequency, duration_s: duration_s / 10.0, ..tracking.clone() };
    let shaken = Case { oscillator: Some(*noise), watched: true, ..tracking.clone() };
    let (thermal, disturbed, pulled) = (run(&tracking), run(&shaken), run(&pull_in));
    let predicted = |jitter: Option<Jitter>| jitter.map_or(f64::NAN, |jitter| jitter.sigma);
    let phase_deg = 360.0 * predicted(expect::phase_cycles(&tracking));
    let system = expect::carrier_loop(settings, Mode::Phase, tracking.update_s()).linear();
    let oscillator_deg =
        oscillator::jitter_discrete_rad(noise, tracking.signal.centre_hz(), &system, tracking.update_s()).to_degrees();
    let hours = thermal.phase_cycles.count as f64 * tracking.update_s() / 3600.0;
    let degrees = |cycles: Option<f64>| cycles.map(|cycles| 360.0 * cycles);
    Level {
        cn0_dbhz,
        phase_deg: (phase_deg, degrees(thermal.phase_cycles.sigma())),
        phase_with_oscillator_deg: (
            (phase_deg * phase_deg + oscillator_deg * oscillator_deg).sqrt(),
            degrees(disturbed.phase_cycles.sigma()),
        ),
        code_chips: (predicted(expect::code_chips(&tracking)), thermal.code_chips.sigma()),
        frequency_hz: (predicted(expect::frequency_hz(&pull_in)), pulled.frequency_hz.sigma()),
        slips_per_hour: thermal.slips as f64 / hours,
        lost: disturbed.lost,
    }
}

/// Steady phase error of a loop of order 3 under a constant jerk along the line of sight: theory and
/// simulation without noise, degrees.
///
/// The simulated one is `None` where the loop lets go within four seconds.
pub fn jerk_stress_deg(settings: &TrackingSettings, jerk_mps3: f64) -> (f64, Option<f64>) {
    let jerk_hz_s2 = jerk_mps3 / l1ca::L1_CA.wavelength_m(gnss::satellite::Sv::gps(1));
    let mut case = Case { settle_s: 0.0, duration_s: 4.0, ..channel(settings, Mode::Phase, None) };
    case.motion.steps.push(super::motion::Step { at_s: 0.0, rate_step_hz_s: 0.0, jerk_hz_s2 });
    let gains = Gains::design(settings.pll_order, settings.pll_bandwidth_hz * case.update_s());
    let theory = pll::stress_discrete(3, gains.acceleration, case.update_s(), jerk_hz_s2);
    let mut last = f64::INFINITY;
    let (_, lost) = simulate(&case, |epoch| last = epoch.phase_cycles);
    // A Costas loop that still holds is less than a quarter of a cycle away.
    (360.0 * theory, (lost.is_none() && last.abs() < 0.25).then_some(360.0 * last))
}
