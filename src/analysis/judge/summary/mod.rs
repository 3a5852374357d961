//! Summary of a run: the numbers that scripts gate on, and the finer ones that the report prints.
//!
//! The serialised keys and their order are a contract. A number that a scene cannot have is null. [`Details`]
//! stays in memory.

mod details;

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::spectrum::{self, Spectrum};
use crate::expect::stated::Stated;
use crate::expect::theory::clock::white_phase;
use crate::measure::allan::Deviation;
use crate::measure::clock;
use crate::measure::clock::{Of, Series};
use crate::measure::consistency::{Calibration, Consistency};
use crate::measure::detection;
use crate::measure::errors::{Errors, Link, SignalError};
use crate::measure::ionosphere::Ionosphere;
use crate::measure::jitter::{Jitter as LoopJitter, Loop, Pooled};
use crate::measure::lines::Lines;
use crate::measure::osnma::Osnma;
use crate::measure::protection;
use crate::measure::slips::{Cause, Slips};
use crate::measure::spoofing::Spoofing;
use crate::measure::{attitude, inertial};
use crate::read::{Numbers, Run, Speed};
use crate::statistics::{Sum, mean};
use crate::waveform::leading;
pub use details::{Details, Thresholds};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{Event, NavigationRow};
use gnss::satellite::Sv;
use gnss::signal::{Component, Signal};

/// Rule-of-thumb bound of a Costas loop's 1σ error (theory: 3σ ≤ 45°).
pub const PLL_THRESHOLD_DEG: f64 = 15.0;

/// `summary.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// The scene's name.
    pub scene: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Length of the samples, seconds.
    pub duration_s: f64,
    /// Samples a second, Hz.
    pub sample_rate_hz: f64,
    /// The generator's level of fidelity, by name.
    pub fidelity: String,
    /// Satellites that there were and that were found.
    pub satellites: Satellites,
    /// Errors of the fixes.
    pub position: Position,
    /// The receiver's clock.
    pub clock: Clock,
    /// Errors of the observations of all signals.
    pub observables: Observables,
    /// The loops of all signals.
    pub tracking: Tracking,
    /// Every signal that was observed by its name, also where it is the only one.
    pub signals: BTreeMap<&'static str, BySignal>,
    /// The decoded messages.
    pub navigation: Navigation,
    /// The spectrum of the samples.
    pub psd: Spectrum,
    /// Continuous waves that the receiver reported; absent of one that does not look.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interference: Option<Lines>,
    /// Effect of a spoofer on the fixes; absent without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spoofing: Option<Spoofing>,
    /// Verification of Galileo's authentication; absent of a receiver that does not verify.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osnma: Option<Osnma>,
    /// Attitudes by the elements of an array; absent of a receiver that was not asked for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude: Option<attitude::Figures>,
    /// Inertial measurements integrated back, and their noise; absent of a scene without inertial sensors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertial: Option<inertial::Figures>,
    /// The ionosphere that two bands showed; absent without a satellite that has them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ionosphere: Option<Ionosphere>,
    /// Errors against the protection levels; absent of a receiver that states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub protection: Option<protection::Figures>,
    /// Alarms of the detectors of jamming and spoofing; absent of a receiver without them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detection: Option<detection::Figures>,
    /// Figures that the verdict does not judge, each with the reason.
    pub not_judged: Vec<String>,
    /// Speed of the stages.
    pub speed: Speed,
    /// True if there was interference.
    #[serde(skip)]
    pub jammed: bool,
    /// Further figures that the report prints.
    #[serde(skip)]
    pub details: Details,
}

/// Number of satellites, by the stages that they reached.
#[derive(Clone, Debug, Serialize)]
pub struct Satellites {
    /// Above the scene's mask at its first sample.
    pub in_view: usize,
    /// Found by the receiver's search, true or not.
    pub acquired: usize,
    /// Largest number of satellites in one fix.
    pub used: usize,
    /// Signals of satellites acquired though the truth never has them.
    pub false_acquired: usize,
}

/// Errors of the fixes.
#[derive(Clone, Debug, Serialize)]
pub struct Position {
    /// Number of fixes.
    pub fixes: usize,
    /// Seconds from sample 0 to the first fix.
    pub first_fix_s: Option<f64>,
    /// Mean of the horizontal error, metres.
    pub horizontal_mean_m: Option<f64>,
    /// Horizontal error that 95 % of the fixes stay below, metres.
    pub horizontal_p95_m: Option<f64>,
    /// Vertical error that 95 % of the fixes stay below, metres.
    pub vertical_p95_m: Option<f64>,
    /// Error in space that 95 % of the fixes stay below, metres.
    pub error_3d_p95_m: Option<f64>,
    /// Mean of the errors east, north, up.
    pub bias_enu_m: Option<[f64; 3]>,
    /// 95th percentile of the three-dimensional velocity error, m/s.
    pub velocity_p95_mps: Option<f64>,
    /// Mean normalised error squared with the receiver's own covariance, 3 of a consistent one; the 95 % band
    /// of that mean for as many independent fixes as the errors' autocorrelation leaves.
    pub nees_mean: Option<f64>,
    /// The 95 % band of the mean for a consistent receiver.
    pub nees_band: Option<[f64; 2]>,
    /// Independent fixes that the mean is worth.
    pub nees_independent: Option<f64>,
    /// Result of the comparison of the mean with the band.
    pub nees_verdict: Option<Calibration>,
}

/// The receiver's clock, over the longest segment of fixes without a gap. Deviations at an averaging time of
/// 1 s are null where the record is too short for them, or the clock is steady to rounding.
#[derive(Clone, Debug, Serialize)]
pub struct Clock {
    /// Number of fixes in that segment.
    pub fixes: usize,
    /// Mean of estimated minus true bias.
    pub bias_mean_s: Option<f64>,
    /// Standard deviation of the same, its straight line removed.
    pub bias_sigma_s: Option<f64>,
    /// Slopes of the straight lines through the bias as estimated and as it was, in seconds a second.
    pub drift: Option<f64>,
    /// Slope of the truth's bias, seconds a second.
    pub true_drift: Option<f64>,
    /// Overlapping Allan, modified Allan, overlapping Hadamard and time deviation of the estimate.
    pub oadev_1s: Option<f64>,
    /// Modified Allan deviation at 1 s of the estimate.
    pub mdev_1s: Option<f64>,
    /// Hadamard deviation at 1 s of the estimate.
    pub ohdev_1s: Option<f64>,
    /// Time deviation at 1 s of the estimate, seconds.
    pub tdev_1s_s: Option<f64>,
    /// The true clock's, over the whole run.
    pub true_oadev_1s: Option<f64>,
    /// Overlapping Allan deviation at 1 s of a clock solved from independent code measurements. It is √3 ×
    /// TDOP × σ of the code/(speed of light × 1 s).
    pub code_noise_oadev_1s: Option<f64>,
    /// Strengths h₂, h₁, h₀, h₋₁, h₋₂ of power-law noises (S_y = Σ h f^α, in Hz^(−α − 1)) fitted to the Allan
    /// deviations of the estimate and of the true clock.
    pub h: Option<[f64; 5]>,
    /// Strengths of the power-law noises of the true clock.
    pub true_h: Option<[f64; 5]>,
}

/// Errors of the observations, over every satellite and epoch.
#[derive(Clone, Debug, Serialize)]
pub struct Observables {
    /// Root mean square of the pseudorange errors in metres, after the mean over the satellites of each epoch
    /// is removed.
    pub pseudorange_rms_m: Option<f64>,
    /// Mean of the satellites' mean code errors, nothing removed.
    pub pseudorange_bias_m: Option<f64>,
    /// Root mean square of the carrier errors, cycles.
    pub carrier_rms_cycles: Option<f64>,
    /// Root mean square of the Doppler errors, Hz.
    pub doppler_rms_hz: Option<f64>,
    /// Mean of measured minus expected: the scene's C/N0, which is at the antenna, with other satellites and
    /// interference counted as noise (see [`crate::expect::multiple_access`]), less what filter and converter
    /// ([`crate::expect::spectrum::costs_db`]), edges between samples and the replica cost
    /// ([`crate::expect::spectrum::edge_cost_db`]) and what data in phase with a pilot do.
    pub cn0_bias_db: Option<f64>,
}

/// Tracking errors: the loop's oscillator minus truth, each satellite about its own mean, without the first
/// [`PULL_IN_S`](crate::measure::errors::PULL_IN_S) of each lock.
#[derive(Clone, Debug, Serialize)]
pub struct Tracking {
    /// Number of losses of lock.
    pub losses_of_lock: usize,
    /// Declared by the receiver, or found against the truth and not declared.
    pub cycle_slips: usize,
    /// Standard deviation of the code loop, chips.
    pub dll_sigma_chips: Option<f64>,
    /// Standard deviation of the phase loop, degrees.
    pub pll_sigma_deg: Option<f64>,
    /// Standard deviation of the frequency, Hz.
    pub fll_sigma_hz: Option<f64>,
    /// Slips that the receiver did not declare, and how many slips and losses have which cause (`slips.csv`).
    pub slips_undeclared: usize,
    /// Slips and losses by their cause.
    pub slip_causes: BTreeMap<Cause, usize>,
    /// The loops of all satellites three ways (`jitter.csv`): chips, degrees, hertz. Null where the receiver
    /// names no settings.
    pub dll_chips: Option<Pooled>,
    /// The phase loop of all satellites, degrees.
    pub pll_deg: Option<Pooled>,
    /// The frequency of all satellites, Hz.
    pub fll_hz: Option<Pooled>,
}

/// [`Observables`] and [`Tracking`] of one signal.
#[derive(Clone, Debug, Serialize)]
pub struct BySignal {
    /// Number of observed satellites.
    pub satellites: usize,
    /// Errors of its observations.
    pub observables: Observables,
    /// Standard deviations of the signal's loops.
    pub tracking: SignalTracking,
}

/// Standard deviations of a signal's loops.
#[derive(Clone, Debug, Serialize)]
pub struct SignalTracking {
    /// Number of losses of lock.
    pub losses_of_lock: usize,
    /// Standard deviation of the code loop, chips.
    pub dll_sigma_chips: Option<f64>,
    /// Standard deviation of the phase loop, degrees.
    pub pll_sigma_deg: Option<f64>,
    /// Standard deviation of the frequency, Hz.
    pub fll_sigma_hz: Option<f64>,
}

/// Decoded parameters against those sent.
#[derive(Clone, Debug, Serialize)]
pub struct Navigation {
    /// Parameters that were compared with those sent.
    pub parameters_checked: usize,
    /// Different from what was sent, or never sent.
    pub parameters_wrong: usize,
}

impl Summary {
    /// Condenses the errors of a run.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn new(run: &Run, errors: &Errors, clock: &clock::Clock) -> Result<Self, JudgeError> {
        let mut details = Details::default();
        let satellites = satellites(run, &mut details);
        let position = position(run, errors, &mut details)?;
        let clock = clock_section(clock, &mut details)?;
        let stated = Stated::of(run);
        let observables = observables(errors, (None, &stated), &mut details)?;
        let signals = by_signal(run, errors, &stated)?;
        details.stated = stated;
        let tracking = tracking(run, errors, &mut details)?;
        let navigation = navigation(run, &mut details);
        details.psd_theory_db = spectrum::theory_db(run)?;
        let psd = spectrum::judge(run, &details.psd_theory_db);
        details.psd_nulls_hz = psd.null_low_hz.into_iter().chain(psd.null_high_hz).collect();
        details.unmatched_observations = errors.unmatched;
        Ok(Self {
            scene: run.scene.name.clone(),
            seed: run.scene.seed,
            duration_s: run.scene.duration_s,
            sample_rate_hz: run.scene.sample_rate_hz,
            fidelity: run.scene.fidelity.clone(),
            satellites,
            position,
            clock,
            observables,
            tracking,
            signals,
            navigation,
            psd,
            interference: Lines::of(run)?,
            spoofing: Spoofing::of(run)?,
            osnma: Osnma::of(run)?,
            attitude: attitude::Figures::of(run)?,
            inertial: inertial::Figures::of(run)?,
            ionosphere: Ionosphere::of(run)?,
            protection: None,
            detection: None,
            jammed: !run.scene.interference.is_empty(),
            not_judged: Vec::new(),
            speed: run.speed,
            details,
        })
    }

    /// Adds what covariance, slips and loops come to.
    pub fn add(&mut self, consistency: &Consistency, slips: &Slips, jitter: &LoopJitter) {
        let position = &mut self.position;
        position.nees_mean = consistency.nees_mean;
        position.nees_band = consistency.band.map(|(low, high)| [low, high]);
        position.nees_independent = consistency.independent;
        position.nees_verdict = consistency.verdict;
        let tracking = &mut self.tracking;
        tracking.slips_undeclared = slips.rows.iter().filter(|row| !row.declared).count();
        tracking.slip_causes = slips.causes();
        tracking.dll_chips = jitter.pooled(Loop::Dll);
        tracking.pll_deg = jitter.pooled(Loop::Pll);
        tracking.fll_hz = jitter.pooled(Loop::Fll);
    }
}

fn satellites(run: &Run, details: &mut Details) -> Satellites {
    let mut ever: BTreeSet<Link> = run.truth.keys().collect();
    let received: BTreeSet<Sv> = ever.iter().map(|link| link.sv).collect();
    // In the sky, and never in the truth's observations: with any of the scene's signals.
    for sv in run.in_the_sky().into_iter().filter(|sv| !received.contains(sv)) {
        ever.extend(run.signals.iter().filter(|signal| signal.system == sv.system).map(|signal| signal.link(sv)));
    }
    let acquired: BTreeSet<Link> = run.acquisition.iter().filter(|row| row.acquired).map(|row| row.link()).collect();
    let odd = planted!("analysis.summary.false_satellites", &acquired, &ever).difference(&ever);
    details.false_satellites = odd.map(|link| run.name(*link)).collect();
    Satellites {
        // The truth's sky holds what is in view and nothing else; from space the mask does not bound it.
        in_view: run.in_view_at_start.len(),
        acquired: acquired.iter().map(|link| link.sv).collect::<BTreeSet<_>>().len(),
        used: run.fixes.most_satellites(),
        false_acquired: details.false_satellites.len(),
    }
}

fn position(run: &Run, errors: &Errors, details: &mut Details) -> Result<Position, JudgeError> {
    let of = |f: &dyn Fn(&crate::measure::errors::PositionError) -> f64| {
        let mut found = Numbers::new(errors.positions.directory());
        for error in errors.positions.cursor() {
            found.push(f(&error?))?;
        }
        Ok::<_, JudgeError>(found)
    };
    let axis = |axis: usize| of(&|error| error.enu_m[axis])?.spread();
    (details.east_m, details.north_m, details.up_m) = (axis(0)?, axis(1)?, axis(2)?);
    details.clock_m = of(&|error| error.clock_m)?.spread()?;
    let horizontal =
        of(&|error| libm::hypot(error.enu_m.x, planted!("analysis.summary.horizontal", error.enu_m.y, 0.0)))?;
    let vertical = of(&|error| error.enu_m.z.abs())?;
    let error_3d = of(&|error| error.enu_m.norm())?;
    let velocity = of(&|error| error.velocity_enu_mps.norm())?;
    details.velocity_mps = velocity.spread()?;
    let bias = match (details.east_m, details.north_m, details.up_m) {
        (Some(east), Some(north), Some(up)) => Some([east.mean, north.mean, up.mean]),
        _ => None,
    };
    Ok(Position {
        fixes: run.fixes.len(),
        first_fix_s: run.fixes.earliest_sample().map(|sample| run.time_s(sample)),
        horizontal_mean_m: horizontal.mean()?,
        horizontal_p95_m: horizontal.percentile(0.95)?,
        vertical_p95_m: vertical.percentile(0.95)?,
        error_3d_p95_m: error_3d.percentile(0.95)?,
        bias_enu_m: bias,
        velocity_p95_mps: velocity.percentile(0.95)?,
        nees_mean: None,
        nees_band: None,
        nees_independent: None,
        nees_verdict: None,
    })
}

fn clock_section(clock: &clock::Clock, details: &mut Details) -> Result<Clock, JudgeError> {
    let (mut errors, directory) = (Sum::default(), clock.rows.directory());
    let mut detrended = Numbers::new(directory);
    for row in clock.rows.cursor() {
        let row = row?;
        errors.add(row.error_s);
        clock.error_line.map_or(Ok(()), |line| detrended.push(row.error_s - line.at(row.time_s)))?;
    }
    let (estimate, truth) = (clock.series(Of::Estimate), clock.series(Of::Truth));
    let at = |series: Option<&Series>, deviation| series?.at(deviation, 1.0);
    let value = |series, deviation| at(series, deviation).map(|point| point.deviation);
    details.clock_oadev_1s = at(estimate, Deviation::Oadev);
    Ok(Clock {
        fixes: clock.rows.len(),
        bias_mean_s: errors.mean(),
        bias_sigma_s: detrended.std()?.map(|(sigma, _)| sigma),
        drift: clock.estimate_line.map(|line| line.slope),
        true_drift: clock.truth_line.map(|line| line.slope),
        oadev_1s: details.clock_oadev_1s.map(|point| point.deviation),
        mdev_1s: value(estimate, Deviation::Mdev),
        ohdev_1s: value(estimate, Deviation::Ohdev),
        tdev_1s_s: value(estimate, Deviation::Tdev),
        true_oadev_1s: value(truth, Deviation::Oadev),
        code_noise_oadev_1s: clock.code_sigma_s.map(|sigma_s| white_phase(Deviation::Oadev, sigma_s, 1.0, 1.0)),
        h: estimate.and_then(Series::power_law).map(|law| law.h),
        true_h: truth.and_then(Series::power_law).map(|law| law.h),
    })
}

fn by_signal(run: &Run, errors: &Errors, stated: &Stated) -> Result<BTreeMap<&'static str, BySignal>, JudgeError> {
    let signals: BTreeSet<&'static Signal> = errors.signals.keys().map(|link| link.signal).collect();
    let one = |signal: &'static Signal| {
        let sigma = |of: LoopError| errors.settled_std(Some(signal), of);
        let lost = run.events.iter().filter(|row| row.event == Event::LossOfLock && row.signal == signal);
        let figures = BySignal {
            satellites: errors.signals.keys().filter(|link| link.signal == signal).count(),
            observables: observables(errors, (Some(signal), stated), &mut Details::default())?,
            tracking: SignalTracking {
                losses_of_lock: lost.count(),
                dll_sigma_chips: sigma(DLL_CHIPS)?,
                pll_sigma_deg: sigma(PLL_DEG)?,
                fll_sigma_hz: sigma(FLL_HZ)?,
            },
        };
        Ok((signal.name, figures))
    };
    signals.into_iter().map(one).collect()
}

/// Observables of one signal, or of all.
fn observables(
    errors: &Errors,
    (signal, stated): (Option<&Signal>, &Stated),
    details: &mut Details,
) -> Result<Observables, JudgeError> {
    let code = errors.code_without_clock_m(signal)?;
    let pseudorange_rms_m = code.rms()?;
    details.pseudorange_m = code.spread()?;
    drop(code);
    let carrier = errors.pooled(signal, |error| error.carrier_cycles)?;
    let carrier_rms_cycles = carrier.rms()?;
    details.carrier_cycles = carrier.spread()?;
    drop(carrier);
    let doppler = errors.pooled(signal, |error| error.doppler_hz)?;
    let doppler_rms_hz = doppler.rms()?;
    details.doppler_hz = doppler.spread()?;
    drop(doppler);
    let expected_dbhz = |link: &Link, error: &SignalError| stated.expected_dbhz(*link, error.cn0_effective_dbhz);
    let cn0 = errors.pooled_by(signal, |link, error| error.cn0_dbhz - expected_dbhz(link, error))?;
    details.cn0_db = cn0.spread()?;
    let (mut means, [mut truth, mut effective, mut expected, mut measured]) = (Vec::new(), [Sum::default(); 4]);
    for link in errors.signals.keys().filter(|link| signal.is_none_or(|signal| link.signal == signal)) {
        let mut code_m = Sum::default();
        errors.signals.each(link, |row| {
            code_m.add(row.code_m);
            truth.add(row.cn0_true_dbhz);
            effective.add(row.cn0_effective_dbhz);
            expected.add(expected_dbhz(&link, &row));
            measured.add(row.cn0_dbhz);
        })?;
        means.extend(code_m.mean());
    }
    details.cn0_true_dbhz = truth.mean();
    details.cn0_effective_dbhz = effective.mean();
    details.cn0_expected_dbhz = expected.mean();
    details.cn0_measured_dbhz = measured.mean();
    Ok(Observables {
        pseudorange_rms_m,
        pseudorange_bias_m: mean(&means),
        carrier_rms_cycles,
        doppler_rms_hz,
        cn0_bias_db: cn0.mean()?,
    })
}

/// The error of one loop in an observation, in its unit.
pub(crate) type LoopError = fn(&Link, &SignalError) -> f64;
pub(crate) const DLL_CHIPS: LoopError =
    |link, row| row.code_m * leading(link.signal).map_or(f64::NAN, |code| code.chip_rate_hz) / SPEED_OF_LIGHT_MPS;
pub(crate) const PLL_DEG: LoopError = |_, row| row.carrier_cycles * 360.0;
pub(crate) const FLL_HZ: LoopError = |_, row| row.doppler_hz;

fn tracking(run: &Run, errors: &Errors, details: &mut Details) -> Result<Tracking, JudgeError> {
    let sigma = |of: LoopError| errors.settled_std(None, of);
    // Of a receiver that does not say, the longest code period.
    let periods = run.signals.iter().filter_map(|signal| leading(signal)).map(Component::period_s);
    let longest_s = periods.fold(0.0, f64::max);
    let integration_s = run.update_s.or(run.tracking_setting("integration_s")).unwrap_or(longest_s);
    details.thresholds = Thresholds::new(run.tracking_setting("spacing_chips").unwrap_or(0.5), integration_s);
    Ok(Tracking {
        losses_of_lock: run.events.iter().filter(|row| row.event == Event::LossOfLock).count(),
        cycle_slips: errors.cycle_slips,
        dll_sigma_chips: sigma(DLL_CHIPS)?,
        pll_sigma_deg: sigma(PLL_DEG)?,
        fll_sigma_hz: sigma(FLL_HZ)?,
        slips_undeclared: 0,
        slip_causes: BTreeMap::new(),
        dll_chips: None,
        pll_deg: None,
        fll_hz: None,
    })
}

fn navigation(run: &Run, details: &mut Details) -> Navigation {
    let sent: BTreeSet<_> = run.truth_navigation.iter().map(NavigationRow::content).collect();
    let decoded: BTreeMap<_, &NavigationRow> = run.navigation.iter().map(|row| (row.content(), row)).collect();
    let wrong = decoded.iter().filter(|(said, _)| !sent.contains(*said)).map(|(_, row)| (*row).clone());
    details.wrong_parameters = planted!("analysis.summary.navigation", wrong.collect(), Vec::new());
    Navigation { parameters_checked: decoded.len(), parameters_wrong: details.wrong_parameters.len() }
}

#[cfg(test)]
mod tests;
