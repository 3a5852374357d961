//! Loop jitter against its thresholds, and the measured C/N0 against the one that the scene allows.

use crate::expect::loops::Carrier;
use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use gnss::facts::Sizes;

/// 10 lg(π/2).
pub(super) const ONE_BIT_LOSS_DB: f64 = 1.961;

impl Verdict {
    pub(super) fn tracking(&mut self, run: &Run, summary: &Summary) {
        if run.scene.expect.intervals.iter().any(|interval| interval.terms.errors == Some(Sizes::Any)) {
            let reason = "the scene expects any errors for a time; satellites are judged one by one outside it";
            self.not_judged.push(format!("jitter of all loops together: {reason}"));
            return;
        }
        let (tracking, limits) = (&summary.tracking, &summary.details.thresholds);
        let rows = [
            ("DLL jitter, 1σ", "tracking.dll_sigma_chips", tracking.dll_sigma_chips, "chips", limits.dll_chips, "d/6"),
            ("PLL jitter, 1σ", "tracking.pll_sigma_deg", tracking.pll_sigma_deg, "°", limits.pll_deg, "15°"),
            ("FLL jitter, 1σ", "tracking.fll_sigma_hz", tracking.fll_sigma_hz, "Hz", limits.fll_hz, "1/(12T)"),
        ];
        let carriers = run.signals.iter().map(|signal| Carrier::in_run(run, signal).oscillator_rad());
        let oscillator_deg = carriers.fold(0.0, f64::max).to_degrees();
        for (figure, path, value, unit, limit, rule) in rows {
            let Some(value) = value else {
                self.not_judged.push(format!("{figure}: no observation past its pull-in"));
                continue;
            };
            // What no loop of this bandwidth can have is no measure of one; theory judges each satellite.
            if path == "tracking.pll_sigma_deg" && oscillator_deg > limit {
                self.not_judged.push(format!("{figure}: the oscillator alone leaves {oscillator_deg:.0}° of {limit}°"));
                continue;
            }
            let source = format!("rule of thumb {rule} (Kaplan and Hegarty, 5.6)");
            self.judge(figure, path, value, unit, Bound::Max(limit), &source);
        }
    }

    pub(super) fn cn0(&mut self, run: &Run, summary: &Summary) {
        if let Some(bias) = summary.observables.cn0_bias_db.filter(|_| run.scene.noise) {
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
