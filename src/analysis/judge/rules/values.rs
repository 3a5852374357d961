//! Errors of the fixes and what is stated of them, against what theory expects of a sound receiver
//! ([`crate::analysis::expect`]).
//!
//! Each kind of error has three rows: its mean, its 95th percentile, and the largest against the limit of its
//! own epoch. Limits are quantiles of theory's σ for a stated probability of a false alarm, widened by what
//! theory itself may err, with known biases taken out. Stated sigmas lie within a factor of the ones that
//! follow from settings, true C/N0 and geometry, on both sides.

use std::collections::{BTreeMap, HashMap};

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use super::motion::Motion;
use super::reception::is_augmented;
use crate::analysis::error::JudgeError;
use crate::analysis::expect::due::satellite::FADE_DB;
use crate::analysis::expect::loops::Theory;
use crate::analysis::expect::quantile::{largest, mean_square};
use crate::analysis::judge::forecast::ranges::{Choices, Scene};
use crate::analysis::judge::forecast::solution::{Expected, expected, largest_axis};
use crate::analysis::judge::judgement::Bound;
use crate::analysis::judge::summary::Summary;
use crate::analysis::judge::verdict::Verdict;
use crate::analysis::measure::errors::{Errors, PositionError};
use crate::analysis::read::{Emission, Run};
use crate::analysis::statistics::{mean, percentile};
use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::record::{Event, Fix};
use crate::gnss::signal::Link;

/// By how much theory's σ may be too small: 1 dB of C/N0 (1.12), and 7 % between the linear loop and a real
/// one.
pub(super) const THEORY: f64 = 1.2;
/// Factor within which a stated sigma lies about the expected one: 1 dB of C/N0 (1.12) and 12 % of theory and
/// smoothing.
const SIGMA: f64 = 1.25;
/// How far dilutions and condition may be from the true geometry's: elevations seen from a fix metres away.
const GEOMETRY: f64 = 2e-3;
/// Weights of 1 dB of C/N0, as a factor.
const DECIBEL: f64 = 1.259;
/// Share of fixes that may leave out a satellite without cause: a residual test of probability 1e-3 whose
/// errors last.
const BLAMELESS_SHARE: f64 = 0.05;
/// Independent fixes from which on a mean normalised error squared says something: below, a factor of three
/// of sigma is within its band.
const ENOUGH: f64 = 5.0;
/// A satellite found again after a loss is used before its half cycle is known, and observed after: two
/// subframes, and the lock.
const RETURN_S: f64 = 20.0;

/// A stated sigma over the expected one.
type Ratio = fn(&Fix, &Expected) -> f64;

/// A fix, its error and what was expected of it.
struct Case<'a> {
    fix: &'a Fix,
    error: &'a PositionError,
    expected: Expected,
    drift_mps: f64,
}

/// One kind of error.
struct Kind {
    name: &'static str,
    path: &'static str,
    unit: &'static str,
    axes: u32,
    /// Independent values among them.
    independent: f64,
    values: Vec<Value>,
}

/// An error less its known bias, theory's σ along its longest axis, and what may come on top.
struct Value {
    time_s: f64,
    error: Vector3<f64>,
    sigma: f64,
    allowed: f64,
}

impl Value {
    fn limit(&self, factor: f64) -> f64 {
        factor * THEORY * self.sigma + self.allowed
    }
}

impl Verdict {
    /// Rows of position, velocity and clock.
    pub(super) fn values(&mut self, run: &Run, errors: &Errors, summary: &Summary) -> Result<(), JudgeError> {
        if run.fixes.is_empty() {
            return Ok(());
        }
        let Some(scene) = Scene::new(run) else {
            self.not_judged.push("fixes against theory: the receiver names no settings".to_owned());
            self.position(run, summary);
            return Ok(());
        };
        let mut cases = cases(&scene, errors)?;
        let bounded = Bounded::new(run, &cases);
        if cases.iter().all(|case| !bounded.holds(case.error.time_s)) {
            return Ok(());
        }
        self.satellites_of_fixes(run, &cases, &bounded);
        cases.retain(|case| bounded.holds(case.error.time_s));
        if cases.is_empty() {
            self.not_judged.push("fixes against theory: no satellite with a message and a truth".to_owned());
            self.position(run, summary);
            return Ok(());
        }
        let fading = cases.iter().filter(|case| case.expected.fading).count();
        if fading > 0 {
            self.not_judged.push(format!("velocity of {fading} fixes in which a signal fades by {FADE_DB} dB"));
        }
        for kind in kinds(run, &scene.choices, &cases) {
            self.kind(&kind);
        }
        self.sigmas(&cases);
        self.geometry(&cases);
        self.consistency(summary, &cases);
        Ok(())
    }

    fn kind(&mut self, kind: &Kind) {
        let Kind { name, path, unit, axes, .. } = *kind;
        if kind.values.is_empty() {
            return;
        }
        let lengths: Vec<f64> = kind.values.iter().map(|value| value.error.norm()).collect();
        let sum: Vector3<f64> = kind.values.iter().map(|value| value.error).sum();
        let count = kind.values.len() as f64;
        let square = kind.values.iter().map(|value| value.sigma * value.sigma).sum::<f64>() / count;
        let allowed = kind.values.iter().map(|value| value.allowed).sum::<f64>() / count;
        let limit = largest(axes, 1) * THEORY * (square / kind.independent).sqrt() + allowed;
        let source = format!("theory of C/N0, geometry and loops; {:.0} independent", kind.independent);
        self.judge(&format!("{name} error, mean"), "", sum.norm() / count, unit, Bound::Max(limit), &source);
        // More than a twentieth beyond a limit has twenty times the probability of one beyond, at most
        // (Markov).
        let limits: Vec<f64> = kind.values.iter().map(|value| value.limit(largest(axes, 20))).collect();
        let (value, limit) = (percentile(&lengths, 0.95), percentile(&limits, 0.95));
        if let Some(limit) = limit {
            let source = "theory of C/N0, geometry and loops";
            self.judge(&format!("{name} error, 95 %"), path, value, unit, Bound::Max(limit), source);
        }
        let factor = largest(axes, kind.values.len());
        let over = |value: &Value| value.error.norm() / value.limit(factor);
        if let Some(worst) = kind.values.iter().max_by(|a, b| over(a).total_cmp(&over(b))) {
            let source =
                format!("theory at {:.1} s, where it is nearest to its limit or farthest beyond", worst.time_s);
            let bound = Bound::Max(worst.limit(factor));
            self.judge(&format!("{name} error, largest"), "", worst.error.norm(), unit, bound, &source);
        }
    }

    /// Stated sigmas against those that settings, C/N0 and geometry make.
    fn sigmas(&mut self, cases: &[Case<'_>]) {
        let comparable = |case: &&Case<'_>| case.expected.corrected && case.expected.steady && case.is_whole();
        let known: Vec<&Case<'_>> = cases.iter().filter(comparable).collect();
        if known.is_empty() {
            self.not_judged.push("sigmas: no fix whose ionosphere, satellites and C/N0 are known".to_owned());
            return;
        }
        let flat = |fix: &Fix, e: &Expected| {
            let square = fix.sigma_east_m * fix.sigma_east_m + fix.sigma_north_m * fix.sigma_north_m;
            (square / (e.stated.m11 + e.stated.m22)).sqrt()
        };
        let rows: [(&str, Ratio); 5] = [
            ("horizontal", flat),
            ("east", |fix, e| fix.sigma_east_m / e.stated.m11.sqrt()),
            ("north", |fix, e| fix.sigma_north_m / e.stated.m22.sqrt()),
            ("vertical", |fix, e| fix.sigma_up_m / e.stated.m33.sqrt()),
            ("clock", |fix, e| fix.sigma_clock_m / e.stated.m44.sqrt()),
        ];
        let source = "1 dB of C/N0, and 12 % of theory and smoothing";
        for (name, ratio) in rows {
            let ratios = || known.iter().map(|case| ratio(case.fix, &case.expected));
            let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
            let figure = |end: &str| format!("{name} sigma over the expected one, {end}");
            self.judge(&figure("largest"), "", high, "of 1", Bound::Max(SIGMA), source);
            self.judge(&figure("smallest"), "", low, "of 1", Bound::Min(1.0 / SIGMA), source);
        }
    }

    fn geometry(&mut self, cases: &[Case<'_>]) {
        let whole = || cases.iter().filter(|case| case.is_whole());
        let departures = whole().map(Case::geometry_departure);
        if let Some(value) = departures.max_by(f64::total_cmp) {
            let source = "directions to the satellites in the truth";
            let figure = "dilutions and condition against the true geometry, largest departure";
            self.judge(figure, "", value, "of 1", Bound::Max(GEOMETRY), source);
        }
        let known = whole().filter(|case| case.expected.corrected && case.expected.steady);
        let departures: Vec<f64> = known.map(Case::correlation_departure).collect();
        let largest = departures.iter().copied().max_by(f64::total_cmp);
        let figure = |which: &str| format!("formal correlations (artanh) against the expected ones, {which}");
        if let Some((usual, largest)) = percentile(&departures, 0.95).zip(largest) {
            // See `correlation_departure`: the tolerance of C/N0, and that of sigmas.
            let (bound, source) = (Bound::Max(libm::log(DECIBEL)), "weights within 1 dB of those at the true C/N0");
            self.judge(&figure("95 %"), "", usual, "", bound, source);
            let (bound, source) = (Bound::Max(2.0 * libm::log(SIGMA)), "weights as the limits of sigmas have them");
            self.judge(&figure("largest departure"), "", largest, "", bound, source);
        }
    }

    /// Whether fixes use the satellites that are observed, know their ionosphere, and pass their own test.
    fn satellites_of_fixes(&mut self, run: &Run, cases: &[Case<'_>], bounded: &Bounded<'_>) {
        let away = (RETURN_S * run.scene.sample_rate_hz) as u64;
        let breaks: Vec<u64> = run
            .events
            .iter()
            .filter(|row| matches!(row.event, Event::LossOfLock | Event::CycleSlip))
            .map(|row| row.sample)
            .collect();
        let excused = |sample: u64| {
            breaks.iter().any(|at| (*at..*at + 3 * away).contains(&sample)) || !bounded.holds(run.time_s(sample))
        };
        let expected: HashMap<u64, &Case<'_>> = cases.iter().map(|case| (case.fix.sample, case)).collect();
        let others = run.fixes.iter().filter(|fix| !excused(fix.sample));
        let odd = others.filter(|fix| !expected.get(&fix.sample).is_some_and(|case| case.is_whole())).count();
        let source = "observed, with a message, above the mask, not excluded";
        let figure = "fixes of other satellites than those observed";
        if is_augmented(run) {
            self.not_judged.push(format!("{figure}: SBAS's corrections choose among them"));
        } else {
            self.judge(figure, "", odd, "", Bound::Max(0.0), source);
        }
        if run.claimed.is_empty() {
            let blamed = |case: &&Case<'_>| case.expected.blameless > 0 && bounded.holds(case.error.time_s);
            let share = cases.iter().filter(blamed).count() as f64 / run.fixes.len().max(1) as f64;
            let source = "the residual test's false alarms, which last as smoothed errors do";
            self.judge(
                "share of fixes that exclude a good satellite",
                "",
                share,
                "of 1",
                Bound::Max(BLAMELESS_SHARE),
                source,
            );
        }
        self.ionosphere_of_fixes(run);
        let alarm = run.receiver.pointer("/settings/position/false_alarm").and_then(serde_json::Value::as_f64);
        let tested = |fix: &Fix| {
            let freedom = Some(fix.freedom()).filter(|freedom| *freedom > 0)?;
            Some(fix.chi_square / threshold(freedom, alarm?)?)
        };
        if let Some(value) = run.fixes.iter().filter_map(tested).max_by(f64::total_cmp) {
            let source = "the receiver's own test refuses more";
            self.judge("chi-square of a fix over its threshold, largest", "", value, "of 1", Bound::Max(1.0), source);
        }
    }

    /// Normalised errors squared against the ones that theory expects of the stated covariance.
    fn consistency(&mut self, summary: &Summary, cases: &[Case<'_>]) {
        let position = &summary.position;
        let (Some(nees), Some(independent)) = (position.nees_mean, position.nees_independent) else { return };
        if independent < ENOUGH {
            let reason = format!(
                "consistency (mean normalised error squared {nees:.2}): too short to say, {independent:.1} \
                 independent fixes"
            );
            self.not_judged.push(reason);
            return;
        }
        // A receiver that counts with errors which the scene does not have is no worse for it: what it should
        // state is the measure.
        let scaled: Vec<f64> = cases.iter().filter_map(|case| case.expected_square()).collect();
        let least: Vec<f64> = cases.iter().filter_map(|case| case.least_square()).collect();
        let (Some(high), Some(low)) = (mean(&scaled), mean(&least)) else { return };
        let (below, above) = mean_square(3.0 * independent);
        let limits = (3.0 * below * low.min(1.0) / (THEORY * THEORY), 3.0 * above * high.max(1.0) * THEORY * THEORY);
        let source =
            format!("chi-square of {independent:.0} independent fixes, and what the stated covariance should be");
        let figure = "mean normalised error squared";
        self.judge(&format!("{figure}, optimistic"), "position.nees_mean", nees, "", Bound::Max(limits.1), &source);
        self.judge(&format!("{figure}, pessimistic"), "", nees, "", Bound::Min(limits.0), &source);
    }
}

fn threshold(freedom: u32, alarm: f64) -> Option<f64> {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    Some(ChiSquared::new(f64::from(freedom)).ok()?.inverse_cdf(1.0 - alarm))
}

fn cases<'a>(scene: &Scene<'a>, errors: &'a Errors) -> Result<Vec<Case<'a>>, JudgeError> {
    let fixes: HashMap<u64, &Fix> = scene.run.fixes.iter().map(|fix| (fix.sample, fix)).collect();
    let errors_at: HashMap<u64, &PositionError> = errors.positions.iter().map(|error| (error.sample, error)).collect();
    let wavelength_m = scene.run.mean_wavelength_m();
    let one = |expected: Expected| {
        let fix = *fixes.get(&expected.sample)?;
        let error = *errors_at.get(&expected.sample)?;
        let place = scene.trajectory.get(&expected.sample)?;
        let common_mps =
            wavelength_m.map_or(0.0, |wavelength_m| scene.run.common.drift_mps(expected.sample, wavelength_m));
        let beyond_mps = SPEED_OF_LIGHT_MPS * (fix.clock_drift - place.clock_drift);
        // What parts code and carrier is the clock's to a receiver, until it has measured it.
        let (with, without) = (beyond_mps - common_mps, beyond_mps);
        let drift_mps = if with.abs() < without.abs() { with } else { without };
        Some(Case { fix, error, expected, drift_mps })
    };
    Ok(expected(scene, errors)?.into_iter().filter_map(one).collect())
}

impl Case<'_> {
    /// Whether the satellites of the fix are those that were expected, all of them sure.
    fn is_whole(&self) -> bool {
        let (least, most) = self.expected.satellites;
        (least..=most).contains(&self.fix.satellites)
    }

    fn geometry_departure(&self) -> f64 {
        let (fix, d) = (self.fix, &self.expected.dilution);
        let flat = d.m11 + d.m22;
        let pairs = [
            (fix.gdop, flat + d.m33 + d.m44),
            (fix.pdop, flat + d.m33),
            (fix.hdop, flat),
            (fix.vdop, d.m33),
            (fix.tdop, d.m44),
        ];
        // One satellite more or less at the mask moves all of them.
        if self.expected.satellites.0 != self.expected.satellites.1 {
            return 0.0;
        }
        let condition = (fix.condition / self.expected.condition - 1.0).abs();
        pairs.iter().map(|(stated, square)| (stated / square.sqrt() - 1.0).abs()).fold(condition, f64::max)
    }

    /// Largest departure of a correlation ρ from the expected one, as the difference of their artanh.
    ///
    /// Weights that err by a factor s at most, each in its own way, change N = Σ w h hᵀ by a share of ±ln s
    /// in the order of matrices, and so N⁻¹. Of two axes with the correlation matrix R, that is R^½ E R^½
    /// with |E| ≤ ln s, and dρ = tr(G E) where G has the eigenvalues ±(1 − ρ²)/2: |dρ| ≤ (1 − ρ²) ln s. So
    /// artanh ρ moves by ln s at most, whatever the geometry.
    fn correlation_departure(&self) -> f64 {
        let (fix, p) = (self.fix, &self.expected.stated);
        let pairs = [
            (fix.correlation_en, p.m12 / (p.m11 * p.m22).sqrt()),
            (fix.correlation_eu, p.m13 / (p.m11 * p.m33).sqrt()),
            (fix.correlation_nu, p.m23 / (p.m22 * p.m33).sqrt()),
        ];
        let artanh = |correlation: &f64| libm::atanh(correlation.clamp(-1.0 + 1e-12, 1.0 - 1e-12));
        pairs.iter().map(|(stated, expected)| (artanh(stated) - artanh(expected)).abs()).fold(0.0, f64::max)
    }

    /// A third of the normalised error squared that theory expects, biases at their largest.
    fn expected_square(&self) -> Option<f64> {
        let most = (self.expected.bias.abs() + self.expected.allowed).fixed_rows::<3>(0).into_owned();
        Some(self.share(&self.expected.noise)? + self.weight()?.quadratic(most))
    }

    /// The same without any bias, and without what a run draws once: an ionosphere may be as the nominal one.
    fn least_square(&self) -> Option<f64> {
        self.share(&self.expected.thermal)
    }

    /// A third of the normalised error squared that errors of this covariance have.
    fn share(&self, noise: &Matrix4<f64>) -> Option<f64> {
        let noise: Matrix3<f64> = noise.fixed_view::<3, 3>(0, 0).into_owned();
        Some((self.weight()?.0 * noise).trace() / 3.0)
    }

    fn weight(&self) -> Option<Weight> {
        let stated: Matrix3<f64> = self.expected.stated.fixed_view::<3, 3>(0, 0).into_owned();
        Some(Weight(stated.try_inverse()?))
    }
}

/// Inverse of a covariance.
struct Weight(Matrix3<f64>);

impl Weight {
    fn quadratic(&self, vector: Vector3<f64>) -> f64 {
        (vector.transpose() * self.0 * vector).x / 3.0
    }
}

/// When errors of fixes are judged: not while the scene expects any, and not while smoothing remembers that
/// time.
struct Bounded<'a> {
    run: &'a Run,
    memory_s: f64,
}

impl<'a> Bounded<'a> {
    fn new(run: &'a Run, cases: &[Case<'_>]) -> Self {
        Self { run, memory_s: cases.iter().map(|case| case.expected.memory_s).fold(0.0, f64::max) }
    }

    fn holds(&self, time_s: f64) -> bool {
        self.run.scene.expect.bounded_since(time_s, self.memory_s)
    }
}

/// What the scene's oscillator leaves between the rate that a phase loop follows and the truth's drift.
fn oscillator_mps(run: &Run, choices: &Choices) -> f64 {
    // Of all carriers the one that it moves most.
    let mut links: BTreeMap<Emission, Link> = BTreeMap::new();
    run.truth.keys().for_each(|link| {
        links.entry(Emission::of(link)).or_insert(link);
    });
    let of = |link: &Link| {
        let theory = Theory::new(run, choices.loops, link, *choices.updates_s.get(link.signal)?)?;
        Some(theory.oscillator_rate_hz() * link.wavelength_m())
    };
    links.values().filter_map(of).fold(0.0, f64::max)
}

/// The five kinds of error.
fn kinds(run: &Run, choices: &Choices, cases: &[Case<'_>]) -> Vec<Kind> {
    let motion = Motion::new(run, choices);
    let oscillator_mps = oscillator_mps(run, choices);
    let steps: Vec<f64> = cases.windows(2).map(|two| two[1].error.time_s - two[0].error.time_s).collect();
    let step_s = crate::analysis::statistics::median(&steps).unwrap_or(1.0);
    let span_s = step_s * cases.len() as f64;
    let memory_s = cases.iter().map(|case| case.expected.memory_s).fold(0.0, f64::max);
    let slow = (span_s / memory_s.max(step_s)).max(1.0);
    // Noise of the phase loop in the rate is white beyond its bandwidth.
    let fast = (cases.len() as f64).min(2.0 * choices.loops.pll_bandwidth_hz * span_s).max(1.0);
    let kind = |name, path, unit, axes, independent, of: &dyn Fn(&Case<'_>) -> Value| Kind {
        name,
        path,
        unit,
        axes,
        independent,
        values: cases.iter().map(of).collect(),
    };
    let rate = |name, path, axes, of: &dyn Fn(&Case<'_>) -> Value| {
        let steady = cases.iter().filter(|case| !case.expected.fading);
        Kind { name, path, unit: "m/s", axes, independent: fast, values: steady.map(of).collect() }
    };
    let position = |case: &Case<'_>, error: Vector3<f64>, sigma: f64, allowed: f64| Value {
        time_s: case.error.time_s,
        error,
        sigma,
        allowed,
    };
    let of = |vector: &Vector4<f64>, axis: usize| vector.as_slice().get(axis).copied().unwrap_or(0.0);
    vec![
        kind("horizontal", "position.horizontal_p95_m", "m", 2, slow, &|case| {
            let (e, b, a) = (&case.expected, &case.expected.bias, &case.expected.allowed);
            let error = Vector3::new(case.error.enu_m.x - b.x, case.error.enu_m.y - b.y, 0.0);
            position(case, error, e.flat_sigma_m(), libm::hypot(a.x, a.y))
        }),
        kind("vertical", "position.vertical_p95_m", "m", 1, slow, &|case| {
            let e = &case.expected;
            let error = Vector3::new(0.0, 0.0, case.error.enu_m.z - e.bias.z);
            position(case, error, e.noise.m33.sqrt(), of(&e.allowed, 2))
        }),
        kind("clock", "", "m", 1, slow, &|case| {
            let e = &case.expected;
            // The time found is early by what the bias is too large.
            let error = Vector3::new(case.error.clock_m + e.bias.w, 0.0, 0.0);
            position(case, error, e.noise.m44.sqrt(), of(&e.allowed, 3))
        }),
        rate("velocity", "position.velocity_p95_mps", 3, &|case| {
            let e = &case.expected;
            let sigma = largest_axis(&e.rate_noise).max(e.rate_noise.m33.sqrt());
            let allowed = e.rate_allowed.fixed_rows::<3>(0).norm() + motion.allowed_mps(case.fix.sample);
            position(case, case.error.velocity_enu_mps, sigma, allowed)
        }),
        rate("clock drift", "", 1, &|case| {
            let e = &case.expected;
            let error = Vector3::new(case.drift_mps, 0.0, 0.0);
            let allowed = of(&e.rate_allowed, 3) + motion.allowed_mps(case.fix.sample);
            position(case, error, libm::hypot(e.rate_noise.m44.sqrt(), oscillator_mps), allowed)
        }),
    ]
}
