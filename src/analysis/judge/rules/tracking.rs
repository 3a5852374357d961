//! Loop jitter against its thresholds, and the measured C/N0 against the one that the scene allows.

use super::kind::THEORY;
use crate::expect::loops::Carrier;
use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use gnss::facts::Sizes;

/// 10 lg(π/2).
pub(super) const ONE_BIT_LOSS_DB: f64 = 1.961;

/// Largest jitter of a sound loop: what the rule of thumb allows, or more where oscillator, motion and noise
/// together make more of a loop of these settings.
fn most(rule: f64, theory_sigma: Option<f64>) -> f64 {
    rule.max(THEORY * theory_sigma.unwrap_or(0.0))
}

impl Verdict {
    pub(super) fn tracking(&mut self, run: &Run, summary: &Summary) {
        if run.scene.expect.intervals.iter().any(|interval| interval.terms.errors == Some(Sizes::Any)) {
            let reason = "the scene expects any errors for a time; satellites are judged one by one outside it";
            self.not_judged.push(format!("jitter of all loops together: {reason}"));
            return;
        }
        let (tracking, limits) = (&summary.tracking, &summary.details.thresholds);
        let rows = [
            ("DLL", "tracking.dll_sigma_chips", tracking.dll_sigma_chips, "chips", limits.dll_chips, "d/6"),
            ("PLL", "tracking.pll_sigma_deg", tracking.pll_sigma_deg, "°", limits.pll_deg, "15°"),
            ("FLL", "tracking.fll_sigma_hz", tracking.fll_sigma_hz, "Hz", limits.fll_hz, "1/(12T)"),
        ];
        let pooled = [&tracking.dll_chips, &tracking.pll_deg, &tracking.fll_hz];
        let carriers = run.signals.iter().map(|signal| Carrier::in_run(run, signal).oscillator_rad());
        let oscillator_deg = carriers.fold(0.0, f64::max).to_degrees();
        for ((name, path, value, unit, limit, rule), pooled) in rows.into_iter().zip(pooled) {
            let figure = format!("{name} jitter, 1σ");
            let Some(value) = value else {
                self.not_judged.push(format!("{figure}: no observation past its pull-in"));
                continue;
            };
            // What no loop of this bandwidth can have is no measure of one; theory judges each satellite.
            if path == "tracking.pll_sigma_deg" && oscillator_deg > limit {
                self.not_judged.push(format!("{figure}: the oscillator alone leaves {oscillator_deg:.0}° of {limit}°"));
                continue;
            }
            let most = most(limit, pooled.as_ref().map(|pooled| pooled.theory_sigma));
            let source = match most > limit {
                true => format!("theory of these loops, where the rule of thumb {rule} asks for less"),
                false => format!("rule of thumb {rule} (Kaplan and Hegarty, 5.6)"),
            };
            self.judge(&figure, path, value, unit, Bound::Max(most), &source);
        }
    }

    pub(super) fn cn0(&mut self, run: &Run, summary: &Summary) {
        if let Some(bias) = summary.observables.cn0_bias_db.filter(|_| run.scene.noise) {
            if !run.scene.expect.always_bounded() {
                let reason = "the scene expects any errors for a time; satellites are judged one by one outside it";
                self.not_judged.push(format!("C/N0 bias of all satellites together: {reason}"));
                return;
            }
            self.judge(
                "C/N0 bias, magnitude",
                "",
                bias.abs(),
                "dB",
                Bound::Max(ONE_BIT_LOSS_DB),
                "loss of a one-bit quantiser, 10 lg(π/2): more is unexplained",
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_of_thumb_gives_way_to_a_theory_that_has_more_and_to_no_other() {
        // An oven's oscillator 13°, noise of 36 dB-Hz 4°, a jerk of 4 m/s³ 9°: 16.5° together, 15.1° found.
        let theory_deg = libm::hypot(libm::hypot(12.97, 3.97), 9.36);
        assert!((most(15.0, Some(theory_deg)) - 1.2 * 16.48).abs() < 0.01);
        assert_eq!((most(15.0, Some(4.0)), most(15.0, None)), (15.0, 15.0));
    }
}
