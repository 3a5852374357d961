//! Errors of the fixes and what is stated of them, against what theory expects of a sound receiver
//! ([`crate::expect`]).
//!
//! Each kind of error has three rows ([`super::kind`]). Stated sigmas lie within a factor of the ones that
//! follow from settings, true C/N0 and geometry, on both sides.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Vector3, Vector4};

use super::cases::{Case, Stated, cases};
use super::kind::{Kind, SIGMA, THEORY, Value};
use super::losses::LOOK_BACK_S;
use super::motion::Motion;
use super::reception::is_augmented;
use crate::error::JudgeError;
use crate::expect::due::satellite::FADE_DB;
use crate::expect::loops::Theory;
use crate::expect::quantile::mean_square;
use crate::judge::forecast::ranges::{Choices, Scene};
use crate::judge::forecast::solution::Expected;
use crate::judge::judgement::{Bound, number};
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::measure::errors::Errors;
use crate::measure::slips::noticed_s;
use crate::read::{Emission, Numbers, Run, Table};
use crate::statistics::{Sum, larger};
use gnss::record::{Event, EventRow, Fix};
use gnss::signal::Link;

/// Largest relative error of dilutions and condition against the true geometry: elevations seen from a fix
/// metres away.
const GEOMETRY: f64 = 2e-3;
/// Weights of 1 dB of C/N0, as a factor.
const DECIBEL: f64 = 1.259;
/// Share of fixes that may leave out a satellite without cause: a residual test of probability 1e-3 whose
/// errors last.
const BLAMELESS_SHARE: f64 = 0.05;
/// A satellite found again after a loss is used before its half cycle is known, and observed after: two
/// subframes, and the lock.
const RETURN_S: f64 = 20.0;

/// A stated sigma over the expected one.
type Ratio = fn(&Stated, &Expected) -> f64;

impl Verdict {
    /// Rows of position, velocity and clock.
    pub(super) fn values(&mut self, run: &Run, errors: &Errors, summary: &Summary) -> Result<(), JudgeError> {
        if run.fixes.is_empty() {
            return Ok(());
        }
        let Some(scene) = Scene::new(run, &summary.details.stated)? else {
            self.not_judged.push("fixes against theory: the receiver names no settings".to_owned());
            return self.position(run, summary);
        };
        let (all, scales) = cases(&scene, errors)?;
        let mut memory_s = 0.0_f64;
        all.each(|case| memory_s = memory_s.max(case.expected.memory_s))?;
        let bounded = Bounded { run, memory_s };
        self.dispersion(&scene, errors, &bounded)?;
        let mut cases = Table::new(all.directory());
        for case in all.cursor() {
            let case = case?;
            if bounded.holds(case.error.time_s) {
                cases.push(case)?;
            }
        }
        if cases.len() < all.len() {
            let excused = all.len() - cases.len();
            self.not_judged.push(format!("sizes of the errors of {excused} fixes: the scene expects any"));
        }
        if cases.is_empty() {
            self.scales(run, &scales, &bounded, 1.0)?;
            self.sigmas(&all)?;
            return self.geometry(&all);
        }
        let breaks = Breaks::of(run);
        self.satellites_of_fixes(&all, &bounded, &breaks)?;
        let (mut fading, mut slipping) = (0, 0);
        cases.each(|case| {
            fading += usize::from(case.expected.fading);
            slipping += usize::from(!case.expected.fading && breaks.follow(case.sample));
        })?;
        if fading > 0 {
            self.not_judged.push(format!("velocity of {fading} fixes in which a signal fades by {FADE_DB} dB"));
        }
        if slipping > 0 {
            self.not_judged.push(format!("velocity of {slipping} fixes right before a loop says that it slips"));
        }
        let slow = self.kinds(&scene, &cases, &breaks, all.len())?;
        self.scales(run, &scales, &bounded, slow)?;
        // What is stated follows from C/N0 and directions, whatever the errors are.
        self.sigmas(&all)?;
        self.geometry(&all)?;
        all.sound()?;
        self.consistency(&cases, slow, cases.len() == all.len())
    }

    /// Stated sigmas against those that settings, C/N0 and geometry make.
    fn sigmas(&mut self, cases: &Table<Case>) -> Result<(), JudgeError> {
        let flat = |fix: &Stated, e: &Expected| {
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
        let (mut any, mut ends) = (false, [(f64::INFINITY, 0.0_f64); 5]);
        cases.each(|case| {
            if case.expected.corrected && case.expected.steady && case.is_whole() {
                any = true;
                for ((low, high), (_, ratio)) in ends.iter_mut().zip(rows) {
                    let ratio = ratio(&case.fix, &case.expected);
                    (*low, *high) = (low.min(ratio), high.max(ratio));
                }
            }
        })?;
        if !any {
            self.not_judged.push("sigmas: no fix whose ionosphere, satellites and C/N0 are known".to_owned());
            return Ok(());
        }
        rows.into_iter().zip(ends).for_each(|((name, _), ends)| self.sigma_ends(name, ends));
        Ok(())
    }

    fn geometry(&mut self, cases: &Table<Case>) -> Result<(), JudgeError> {
        let (mut farthest, mut most) = (None, None);
        let mut departures = Numbers::new(cases.directory());
        for case in cases.cursor() {
            let case = case?;
            if !case.is_whole() {
                continue;
            }
            farthest = larger(farthest, case.geometry_departure());
            if case.expected.corrected && case.expected.steady {
                let departure = case.correlation_departure();
                departures.push(departure)?;
                most = larger(most, departure);
            }
        }
        if let Some(value) = farthest {
            let source = "directions to the satellites in the truth";
            let figure = "dilutions and condition against the true geometry, largest difference";
            self.judge(figure, "", value, "of 1", Bound::Max(GEOMETRY), source);
        }
        let figure = |which: &str| format!("formal correlations (artanh) against the expected ones, {which}");
        if let Some((usual, most)) = departures.percentile(0.95)?.zip(most) {
            // See `correlation_departure`: the tolerance of C/N0, and that of sigmas.
            let (bound, source) = (Bound::Max(libm::log(DECIBEL)), "weights within 1 dB of those at the true C/N0");
            self.judge(&figure("95 %"), "", usual, "", bound, source);
            let (bound, source) = (Bound::Max(2.0 * libm::log(SIGMA)), "weights as the limits of sigmas have them");
            self.judge(&figure("largest difference"), "", most, "", bound, source);
        }
        Ok(())
    }

    /// Judges the satellites of fixes, their ionosphere, and their own test.
    fn satellites_of_fixes(
        &mut self,
        cases: &Table<Case>,
        bounded: &Bounded<'_>,
        breaks: &Breaks,
    ) -> Result<(), JudgeError> {
        let run = bounded.run;
        let away = (RETURN_S * run.scene.sample_rate_hz) as u64;
        let before = (LOOK_BACK_S * run.scene.sample_rate_hz) as u64;
        let excused = |sample: u64| {
            let around = |at: &u64| (at.saturating_sub(before)..*at + 3 * away).contains(&sample);
            breaks.samples.iter().any(around) || !bounded.holds(run.time_s(sample))
        };
        let alarm = run.receiver.pointer("/settings/position/false_alarm").and_then(serde_json::Value::as_f64);
        let tested = |fix: &Fix| {
            let freedom = Some(fix.freedom()).filter(|freedom| *freedom > 0)?;
            Some(fix.chi_square / threshold(freedom, alarm?)?)
        };
        let (mut expected, mut odd, mut most): (_, usize, Option<f64>) = (cases.finder()?, 0, None);
        run.fixes.each(|fix| {
            if !excused(fix.sample) {
                odd += usize::from(!expected.get(fix.sample).is_some_and(|case| case.is_whole()));
            }
            if let Some(new) = tested(&fix) {
                most = larger(most, new);
            }
        })?;
        let source = "observed, with a message, above the mask, not excluded";
        let figure = "fixes of other satellites than those observed";
        if is_augmented(run) {
            self.not_judged.push(format!("{figure}: SBAS's corrections choose among them"));
        } else {
            self.judge(figure, "", odd, "", Bound::Max(0.0), source);
        }
        if run.claimed.is_empty() {
            let mut blamed: usize = 0;
            cases.each(|case| {
                blamed += usize::from(case.expected.blameless > 0 && bounded.holds(case.error.time_s));
            })?;
            let share = blamed as f64 / run.fixes.len().max(1) as f64;
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
        self.ionosphere_of_fixes(run)?;
        if let Some(value) = most {
            let source = "the receiver's own test refuses more";
            self.judge("chi-square of a fix over its threshold, largest", "", value, "of 1", Bound::Max(1.0), source);
        }
        Ok(())
    }

    /// Normalised errors squared against the ones that theory expects of the stated covariance; `slow`
    /// independent fixes.
    fn consistency(&mut self, cases: &Table<Case>, slow: f64, is_whole: bool) -> Result<(), JudgeError> {
        let [mut square, mut most, mut least, mut freedom] = [Sum::default(); 4];
        cases.each(|case| {
            let Some(expected) = case.normalised() else { return };
            square.add(expected.square);
            most.add(expected.most);
            least.add(expected.least);
            freedom.add(expected.freedom);
        })?;
        let means = (square.mean(), most.mean(), least.mean(), freedom.mean());
        let (Some(square), Some(most), Some(least), Some(freedom)) = means else { return Ok(()) };
        // A receiver that counts with errors which the scene does not have is no worse for it: what it should
        // state is the measure.
        let (below, above) = mean_square(freedom * slow);
        let limits = (below * least.min(3.0) / (THEORY * THEORY), above * most.max(3.0) * THEORY * THEORY);
        let source = format!("chi-square of {slow:.0} independent fixes, and what the stated covariance should be");
        let figure = "mean normalised error squared";
        let path = if is_whole { "position.nees_mean" } else { "" };
        self.judge(&format!("{figure}, optimistic"), path, square, "", Bound::Max(limits.1), &source);
        self.judge(&format!("{figure}, pessimistic"), "", square, "", Bound::Min(limits.0), &source);
        Ok(())
    }

    /// The five kinds of error among `cases` of `fixes`; gives the number of independent fixes.
    fn kinds(
        &mut self,
        scene: &Scene<'_>,
        cases: &Table<Case>,
        breaks: &Breaks,
        fixes: usize,
    ) -> Result<f64, JudgeError> {
        let (run, choices) = (scene.run, &scene.choices);
        let motion = Motion::new(run, choices)?;
        let allowed_mps = motion.allowed_mps();
        let oscillator_mps = oscillator_mps(run, choices);
        let (mut memory_s, mut before_s, mut steps) = (0.0_f64, None, Vec::new());
        let (mut biases_m, mut no_rate) = ([0.0_f64; 3], 0);
        cases.each(|case| {
            let bias = &case.expected.bias;
            let new = [libm::hypot(bias.x, bias.y), bias.z.abs(), bias.w.abs()];
            biases_m.iter_mut().zip(new).for_each(|(most, new)| *most = most.max(new));
            no_rate += usize::from(case.expected.fading || breaks.follow(case.sample));
            memory_s = memory_s.max(case.expected.memory_s);
            steps.extend(before_s.replace(case.error.time_s).map(|before_s| case.error.time_s - before_s));
        })?;
        let step_s = crate::statistics::median(&steps).unwrap_or(1.0);
        drop(steps);
        let span_s = step_s * cases.len() as f64;
        let slow = (span_s / memory_s.max(step_s)).max(1.0);
        // Noise of the phase loop in the rate is white beyond its bandwidth.
        let fast = (cases.len() as f64).min(2.0 * choices.loops.pll_bandwidth_hz * span_s).max(1.0);
        let value = |case: &Case, error: Vector3<f64>, sigma: f64, allowed: f64| {
            Some(Value { time_s: case.error.time_s, error, sigma, allowed })
        };
        let of = |vector: &Vector4<f64>, axis: usize| vector.as_slice().get(axis).copied().unwrap_or(0.0);
        let horizontal = |case: &Case| {
            let (e, b, a) = (&case.expected, &case.expected.bias, &case.expected.allowed);
            let error = Vector3::new(case.error.enu_m.x - b.x, case.error.enu_m.y - b.y, 0.0);
            value(case, error, e.flat_sigma_m(), libm::hypot(a.x, a.y))
        };
        let vertical = |case: &Case| {
            let e = &case.expected;
            let error = Vector3::new(0.0, 0.0, case.error.enu_m.z - e.bias.z);
            value(case, error, e.noise.m33.sqrt(), of(&e.allowed, 2))
        };
        let clock = |case: &Case| {
            let e = &case.expected;
            // The time found is early by what the bias is too large.
            let error = Vector3::new(case.error.clock_m + e.bias.w, 0.0, 0.0);
            value(case, error, e.noise.m44.sqrt(), of(&e.allowed, 3))
        };
        let velocity = |case: &Case| {
            let e = Some(&case.expected).filter(|e| !e.fading && !breaks.follow(case.sample))?;
            let allowed = e.rate_allowed.fixed_rows::<3>(0).norm() + allowed_mps(case.sample);
            value(case, case.error.velocity_enu_mps, e.rate_sigma_mps(), allowed)
        };
        let drift = |case: &Case| {
            let e = Some(&case.expected).filter(|e| !e.fading && !breaks.follow(case.sample))?;
            let error = Vector3::new(case.drift_mps, 0.0, 0.0);
            let allowed = of(&e.rate_allowed, 3) + allowed_mps(case.sample);
            value(case, error, libm::hypot(e.rate_noise.m44.sqrt(), oscillator_mps), allowed)
        };
        let must_scatter = run.scene.noise;
        let excused = fixes - cases.len();
        let metres = |name, path, axes, bias_m: f64, of| {
            let without = without(bias_m, excused, fixes);
            Kind { name, path, unit: "m", axes, independent: slow, must_scatter: false, without, of }
        };
        let rate = |name, path, axes, of| {
            let without = without(0.0, excused + no_rate, fixes);
            Kind { name, path, unit: "m/s", axes, independent: fast, must_scatter, without, of }
        };
        let [flat_m, up_m, clock_m] = biases_m;
        let all: [Kind<'_, Case>; 5] = [
            metres(
                "horizontal",
                "position.horizontal_p95_m",
                2,
                flat_m,
                &horizontal as &dyn Fn(&Case) -> Option<Value>,
            ),
            metres("vertical", "position.vertical_p95_m", 1, up_m, &vertical),
            metres("clock", "", 1, clock_m, &clock),
            rate("velocity", "position.velocity_p95_mps", 3, &velocity as &dyn Fn(&Case) -> Option<Value>),
            rate("clock drift", "", 1, &drift),
        ];
        all.iter().try_for_each(|kind| self.kind(kind, cases))?;
        motion.sound()?;
        Ok(slow)
    }
}

/// Words for what errors of fixes are judged without: a bias that is expected, and fixes whose errors may
/// have any size.
fn without(bias_m: f64, left_out: usize, fixes: usize) -> String {
    // Below a tenth of a millimetre nothing that is printed changes.
    let bias = (bias_m >= 1e-4).then(|| format!("the expected bias of up to {} m", number(bias_m)));
    let fixes = (left_out > 0).then(|| format!("{left_out} of {fixes} fixes, whose errors may have any size"));
    bias.into_iter().chain(fixes).collect::<Vec<_>>().join(" and ")
}

/// Slips and losses that the receiver declares. A loop that lets go has a wrong rate before it knows.
struct Breaks {
    samples: BTreeSet<u64>,
    noticed: u64,
}

impl Breaks {
    fn of(run: &Run) -> Self {
        let is_break = |row: &&EventRow| matches!(row.event, Event::LossOfLock | Event::CycleSlip);
        Self {
            samples: run.events.iter().filter(is_break).map(|row| row.sample).collect(),
            noticed: (noticed_s(run) * run.scene.sample_rate_hz) as u64,
        }
    }

    /// True if a break follows a sample so soon that the loop may have been losing lock there.
    fn follow(&self, sample: u64) -> bool {
        self.samples.range(sample..=sample + self.noticed).next().is_some()
    }
}

fn threshold(freedom: u32, alarm: f64) -> Option<f64> {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    Some(ChiSquared::new(f64::from(freedom)).ok()?.inverse_cdf(1.0 - alarm))
}

/// Times at which errors of fixes are judged: not while the scene expects any, and not while smoothing
/// remembers that time.
pub(super) struct Bounded<'a> {
    run: &'a Run,
    memory_s: f64,
}

impl Bounded<'_> {
    /// True if errors are judged at a time.
    pub(super) fn holds(&self, time_s: f64) -> bool {
        self.run.scene.expect.bounded_since(time_s, self.memory_s)
    }
}

/// Rate error in metres per second by the scene's oscillator, between a phase loop's rate and the truth's
/// drift.
fn oscillator_mps(run: &Run, choices: &Choices) -> f64 {
    // Of all carriers the one that it moves most.
    let mut links: BTreeMap<Emission, Link> = BTreeMap::new();
    run.truth.keys().for_each(|link| {
        links.entry(Emission::of(link)).or_insert(link);
    });
    let of = |link: &Link| {
        let theory = Theory::new(run, choices.loops, link, *choices.updates_s.get(link)?)?;
        Some(theory.oscillator_rate_hz() * link.wavelength_m())
    };
    links.values().filter_map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_may_have_let_go_before_it_says_so_and_not_after() {
        let breaks = Breaks { samples: [5000, 9000].into(), noticed: 300 };
        let follow = [4699, 4700, 5000, 5001, 8700, 9001].map(|sample| breaks.follow(sample));
        assert_eq!(follow, [false, true, true, false, true, false]);
    }
}
