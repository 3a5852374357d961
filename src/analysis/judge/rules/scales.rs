//! Offsets between time scales, of fixes that estimate a clock for each: against the truth, and against the
//! fixes themselves.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::kind::{Kind, Value};
use super::values::Bounded;
use crate::error::JudgeError;
use crate::judge::forecast::ranges::Scene;
use crate::judge::forecast::solution::{Expected, Offset};
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::read::spill_store::{Finder, SpillRow, Words};
use crate::read::{Run, Table};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{ClockRow, Fix};
use gnss::time::GPST;

/// Clock of a fix against one more time scale.
#[derive(Clone, Copy)]
struct ScaleCase {
    sample: u64,
    /// The offset between the scales as the receiver has it, less the true one and less known biases.
    error_m: f64,
    /// Standard deviation in theory, metres.
    sigma_m: f64,
    /// Additional error that is allowed, metres.
    allowed_m: f64,
    /// The stated sigma of the clock over the one that should be stated; none where that is not known.
    sigma_ratio: Option<f64>,
}

impl SpillRow<()> for ScaleCase {
    const WORDS: usize = 5;

    fn put(&self, words: &mut Vec<u64>) {
        words.push(self.sample);
        let ratio = self.sigma_ratio.unwrap_or(f64::NAN);
        words.extend([self.error_m, self.sigma_m, self.allowed_m, ratio].map(f64::to_bits));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let sample = words.word();
        let [error_m, sigma_m, allowed_m, ratio] = std::array::from_fn(|_| words.number());
        Self { sample, error_m, sigma_m, allowed_m, sigma_ratio: Some(ratio).filter(|ratio| !ratio.is_nan()) }
    }
}

/// Rows of `clocks.csv` by scale.
pub(super) struct Clocks<'r>(Vec<(&'static str, Finder<'r, &'static str, ClockRow>)>);

impl<'r> Clocks<'r> {
    /// Clocks of a run.
    pub(super) fn of(run: &'r Run) -> Result<Self, JudgeError> {
        let finder = |scale| Ok((scale, run.clocks.finder(scale)?));
        Ok(Self(run.clocks.keys().map(finder).collect::<Result<_, JudgeError>>()?))
    }

    fn get(&mut self, scale: &str, sample: u64) -> Option<ClockRow> {
        self.0.iter_mut().find(|(name, _)| *name == scale)?.1.get(sample)
    }

    fn count(&mut self, sample: u64) -> usize {
        self.0.iter_mut().filter_map(|(_, rows)| rows.get(sample)).count()
    }
}

/// Time scales of a run's fixes, from `clocks.csv`.
#[derive(Default)]
pub(super) struct Scales {
    /// Cases by the names of time scales other than the fix's own.
    cases: BTreeMap<&'static str, Table<ScaleCase>>,
    /// Number of fixes whose rows are incomplete.
    missing: usize,
    /// Sample of the first such fix.
    first_missing: Option<u64>,
    /// Largest difference of a row of the fix's own scale from what the fix says, in sigmas of the fix.
    own: f64,
    /// Fixes looked at.
    fixes: usize,
}

impl Scales {
    /// Takes what a fix's rows say.
    pub(super) fn take(
        &mut self,
        scene: &Scene<'_>,
        clocks: &mut Clocks<'_>,
        fix: &Fix,
        (expected, offsets): (&Expected, &[Offset]),
    ) -> Result<(), JudgeError> {
        let due = fix.clocks.map_or(1, |count| count as usize);
        if due == 1 && fix.time_scale == GPST.name {
            return Ok(());
        }
        self.fixes += 1;
        if clocks.count(fix.sample) != due {
            self.missing += 1;
            self.first_missing.get_or_insert(fix.sample);
        }
        let Some(own) = clocks.get(&fix.time_scale, fix.sample) else { return Ok(()) };
        let own_m = SPEED_OF_LIGHT_MPS * (own.clock_bias_s - fix.clock_bias_s);
        self.own = self.own.max(own_m.abs() / fix.sigma_clock_m);
        let known = expected.corrected && expected.steady && expected.is_whole(fix.satellites);
        let (run, facts) = (scene.run, &scene.run.scene);
        let (delay_s, spread_s) = run.common.scale_delay_s(&fix.time_scale);
        for offset in offsets {
            let Some(scale) = scene.scales.get(offset.scale).copied() else { continue };
            let Some(row) = clocks.get(scale, fix.sample) else { continue };
            let (other_s, other_spread_s) = run.common.scale_delay_s(scale);
            // A scale that is ahead has the smaller bias, one whose codes are delayed more the larger.
            let true_s = facts.ahead_s(&fix.time_scale) - facts.ahead_s(scale) + other_s - delay_s;
            let stated_s = row.clock_bias_s - own.clock_bias_s;
            let cases = self.cases.entry(scale).or_insert_with(|| Table::new(run.clocks.directory()));
            cases.push(ScaleCase {
                sample: fix.sample,
                error_m: SPEED_OF_LIGHT_MPS * (stated_s - true_s) - offset.bias_m,
                sigma_m: offset.sigma_m,
                allowed_m: offset.allowed_m + SPEED_OF_LIGHT_MPS * (spread_s + other_spread_s),
                sigma_ratio: known.then_some(row.sigma_clock_m / offset.stated_m),
            })?;
        }
        Ok(())
    }
}

impl Verdict {
    /// Rows of `clocks.csv`; `independent` fixes are among them.
    pub(super) fn scales(
        &mut self,
        run: &Run,
        scales: &Scales,
        bounded: &Bounded<'_>,
        independent: f64,
    ) -> Result<(), JudgeError> {
        if scales.fixes == 0 {
            return Ok(());
        }
        let source = "each fix has a clock for each of its time scales";
        self.judge("fixes whose clocks are not all in clocks.csv", "", scales.missing, "", Bound::Max(0.0), source);
        let first = scales.first_missing.map(|sample| format!("the first at {:.1} s", run.time_s(sample)));
        self.explain(first.into_iter().collect());
        let source = "the fix has this clock too";
        let figure = "clock of a fix in clocks.csv and in fixes.csv, largest difference";
        self.judge(figure, "", scales.own, "σ", Bound::Max(1.0), source);
        for (scale, cases) in &scales.cases {
            let value = |case: &ScaleCase| {
                let time_s = run.time_s(case.sample);
                let error = Vector3::new(case.error_m, 0.0, 0.0);
                bounded.holds(time_s).then_some(Value { time_s, error, sigma: case.sigma_m, allowed: case.allowed_m })
            };
            let name = format!("{scale} offset");
            let (axes, without) = (1, String::new());
            let kind =
                Kind { name: &name, path: "", unit: "m", axes, independent, must_scatter: false, without, of: &value };
            self.kind(&kind, cases)?;
            let mut ends: Option<(f64, f64)> = None;
            cases.each(|case| {
                if let Some(ratio) = case.sigma_ratio {
                    let (low, high) = ends.unwrap_or((ratio, ratio));
                    ends = Some((low.min(ratio), high.max(ratio)));
                }
            })?;
            if let Some(ends) = ends {
                self.sigma_ends(&format!("{scale} clock"), ends);
            }
        }
        Ok(())
    }
}
