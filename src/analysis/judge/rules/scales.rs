//! Offsets between time scales, of fixes that estimate a clock for each: against the truth, and against the
//! fixes themselves.

use super::cases::{ScaleCase, Scales};
use super::values::{Bounded, SIGMA, THEORY};
use crate::error::JudgeError;
use crate::expect::quantile::largest;
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::read::Run;

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
        let (missing, first) = scales.missing;
        self.judge("fixes whose clocks are not all in clocks.csv", "", missing, "", Bound::Max(0.0), source);
        self.explain(first.map(|sample| format!("the first at {:.1} s", run.time_s(sample))).into_iter().collect());
        let source = "the fix has this clock too";
        let figure = "clock of a fix in clocks.csv and in fixes.csv, largest difference";
        self.judge(figure, "", scales.own, "σ", Bound::Max(1.0), source);
        for scale in scales.cases.keys() {
            self.scale(run, scales, scale, bounded, independent)?;
        }
        Ok(())
    }

    fn scale(
        &mut self,
        run: &Run,
        scales: &Scales,
        scale: &'static str,
        bounded: &Bounded<'_>,
        independent: f64,
    ) -> Result<(), JudgeError> {
        let factor = largest(1, scales.cases.count(&scale));
        let over = |case: &ScaleCase| case.error_m.abs() - factor * THEORY * case.sigma_m - case.allowed_m;
        let (mut count, mut sum, mut squares, mut allowed) = (0.0, 0.0, 0.0, 0.0);
        let (mut worst, mut ratios): (Option<ScaleCase>, Option<(f64, f64)>) = (None, None);
        scales.cases.each(scale, |case| {
            if !bounded.holds(run.time_s(case.sample)) {
                return;
            }
            count += 1.0;
            sum += case.error_m;
            squares += case.sigma_m * case.sigma_m;
            allowed += case.allowed_m;
            if worst.as_ref().is_none_or(|old| over(old) < over(&case)) {
                worst = Some(case);
            }
            if let Some(ratio) = case.sigma_ratio {
                let (low, high) = ratios.unwrap_or((ratio, ratio));
                ratios = Some((low.min(ratio), high.max(ratio)));
            }
        })?;
        let Some(worst) = worst else { return Ok(()) };
        let limit = largest(1, 1) * THEORY * (squares / count / independent).sqrt() + allowed / count;
        let figure = |which: &str| format!("time of {scale} against that of the fix, {which}");
        let source = format!("theory of C/N0, geometry and loops; {independent:.0} independent");
        self.judge(&figure("mean error"), "", (sum / count).abs(), "m", Bound::Max(limit), &source);
        let limit = factor * THEORY * worst.sigma_m + worst.allowed_m;
        let source =
            format!("theory at {:.1} s, where it is nearest to its limit or farthest beyond", run.time_s(worst.sample));
        self.judge(&figure("largest error"), "", worst.error_m.abs(), "m", Bound::Max(limit), &source);
        if let Some((low, high)) = ratios {
            let source = "1 dB of C/N0, and 12 % of theory and smoothing";
            let figure = |which: &str| format!("sigma of the clock by {scale} over the expected one, {which}");
            self.judge(&figure("largest"), "", high, "of 1", Bound::Max(SIGMA), source);
            self.judge(&figure("smallest"), "", low, "of 1", Bound::Min(1.0 / SIGMA), source);
        }
        Ok(())
    }
}
