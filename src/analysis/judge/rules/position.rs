//! Errors of the fixes, against the receiver's own covariance.

use crate::error::JudgeError;
use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use gnss::record::Fix;

/// Deviations within which the largest of twelve normals lies with 99 %.
const WORST_OF_TWELVE: f64 = 3.3;
/// Half a step of a broadcast group delay, 2⁻³² s: that of E1 and E5a is as much in the measured ionosphere.
const STEPS_M: f64 = 0.035;

impl Verdict {
    pub(super) fn position(&mut self, run: &Run, summary: &Summary) -> Result<(), JudgeError> {
        let position = &summary.position;
        if run.fixes.is_empty() || !run.scene.expect.bounded(0.0) {
            return Ok(());
        }
        let expected = |factor: f64, of: fn(&Fix) -> f64| {
            let mut sum = -0.0;
            run.fixes.each(|fix| sum += of(&fix))?;
            let variance = sum / run.fixes.len().max(1) as f64;
            Ok::<_, JudgeError>((variance > 0.0).then(|| factor * variance.sqrt()))
        };
        // A circle that holds 95 % of two equal normals has a radius of √(−2 ln 0.05) σ; an ellipse of the
        // same mean variance needs less, so that the bound is not too tight.
        let flat = expected(2.4477, |fix| {
            0.5 * (fix.sigma_east_m * fix.sigma_east_m + fix.sigma_north_m * fix.sigma_north_m)
        })?;
        let up = expected(1.96, |fix| fix.sigma_up_m * fix.sigma_up_m)?;
        let clock = expected(1.96, |fix| fix.sigma_clock_m * fix.sigma_clock_m)?;
        if let Some(measured) = &summary.ionosphere {
            // Errors last as long as an arc is smoothed, so that each satellite counts as one: the largest of
            // a dozen normals stays below 3.3 of their deviations in 99 of 100 runs.
            let bound = Bound::Max(WORST_OF_TWELVE * measured.stated_rms_m + STEPS_M);
            let source = "3.3 σ of what the receiver states, and the steps of group delays";
            let figure = "error of the measured ionosphere, 95 %";
            self.judge(figure, "ionosphere.error_p95_m", measured.error_p95_m, "m", bound, source);
        }
        let details = &summary.details;
        let rows = [
            ("horizontal error, 95 %", "position.horizontal_p95_m", position.horizontal_p95_m, flat, "2.45 σ"),
            ("vertical error, 95 %", "position.vertical_p95_m", position.vertical_p95_m, up, "1.96 σ"),
            ("clock error, 95 %", "", details.clock_m.map(|clock| clock.p95), clock, "1.96 σ"),
        ];
        for (figure, path, value, bound, factor) in rows {
            let Some(bound) = bound else { continue };
            let source = format!("{factor} of the receiver's own covariance");
            self.judge(figure, path, value, "m", Bound::Max(bound), &source);
        }
        Ok(())
    }
}
