//! Hints about errors of fixes, from the scene's atmosphere, the receiver's corrections and its dates.

use serde_json::Value;

use crate::judge::judgement::Status;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use gnss::earth::Geodetic;
use gnss::record::IonosphereModel;
use gnss::time::WEEK_S;

/// Delays below this are none: a millimetre.
const NOTHING_M: f64 = 1e-3;
/// Height above which neither side has a troposphere.
const AIR_M: f64 = 50e3;
/// Weeks after which LNAV's count of them begins again.
const ERA_WEEKS: f64 = 1024.0;
/// Words of figures that an uncorrected delay spoils.
const SPOILED: [&str; 6] = ["error", "bias", "NEES", "consistency", "horizontal", "vertical"];

impl Verdict {
    /// Adds what may explain them to failed rows about positions and ranges.
    pub(super) fn hint(&mut self, run: &Run) {
        let hints: Vec<String> = era(run).into_iter().chain(mismatches(run)).collect();
        let spoiled = |figure: &str| SPOILED.iter().any(|word| figure.contains(word)) && !figure.contains("C/N0");
        for row in self.rows.iter_mut().filter(|row| row.status == Status::Fail && spoiled(&row.figure)) {
            row.why.extend(hints.iter().cloned());
        }
    }
}

/// Hint where the receiver's dates are off by whole multiples of the time after which GPS's weeks repeat.
fn era(run: &Run) -> Option<String> {
    let (fix, truth) = (run.fixes.cursor().next()?.ok()?, run.trajectory.first()?);
    let off_s = (fix.gps_s - truth.gps_s) as f64 - run.time_s(fix.sample) + run.time_s(truth.sample);
    let weeks = ERA_WEEKS * (off_s / (ERA_WEEKS * WEEK_S as f64)).round();
    let side = if weeks > 0.0 { "late" } else { "early" };
    (weeks != 0.0).then(|| {
        format!(
            "hint: the receiver's dates are {:.0} weeks {side}, since the message counts weeks modulo 1024 and nothing \
             said the year: receive with --start TIME, or set [operation] week_reference",
            weeks.abs()
        )
    })
}

/// Corrections that do not fit the scene, each with its cure.
fn mismatches(run: &Run) -> Vec<String> {
    let settings = run.receiver.get("settings").unwrap_or(&run.receiver);
    let choice = |key: &str| settings.get("position").and_then(|table| table.get(key)).and_then(Value::as_str);
    let on_ground = run.trajectory.first().is_some_and(|row| Geodetic::from_ecef(&row.position_m()).height_m < AIR_M);
    let mut found = Vec::new();
    let mut compare = |name: &str, true_m: f64, corrected: bool, on: &str| {
        if corrected && true_m < NOTHING_M {
            found.push(format!(
                "hint: the receiver corrects {name} that the scene does not have: give the scene [{name}], or set \
                 [receiver.position] {name} = \"none\""
            ));
        } else if !corrected && true_m >= NOTHING_M {
            found.push(format!(
                "hint: the scene has {name} of up to {true_m:.1} m that the receiver does not correct: set \
                 [receiver.position] {name} = \"{on}\""
            ));
        }
    };
    if let Some(troposphere) = choice("troposphere").filter(|_| on_ground) {
        compare("troposphere", run.troposphere_m, troposphere != "none", "standard");
    }
    if let Some(ionosphere) = choice("ionosphere") {
        let used = |model: IonosphereModel| run.fixes.uses(model);
        if ionosphere == "none"
            || used(IonosphereModel::Broadcast)
            || used(IonosphereModel::NequickG)
            || used(IonosphereModel::Bdgim)
            || used(IonosphereModel::Combined)
            || used(IonosphereModel::Grid)
            || run.ionosphere_m < NOTHING_M
        {
            compare("ionosphere", run.ionosphere_m, ionosphere != "none", "broadcast");
        } else if run.ionosphere_m >= NOTHING_M {
            found.push(format!(
                "hint: the ionosphere's page was never decoded, up to {:.1} m are corrected by a nominal model: \
                 [receiver.position] require_ionosphere = true waits for the page",
                run.ionosphere_m
            ));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::judgement::Bound;

    #[test]
    fn a_correction_without_its_delay_is_named_with_its_cure_beside_the_figure_that_fails() {
        let directory = crate::hand_made::planted();
        let mut run = Run::read(directory.path()).unwrap();
        run.receiver = serde_json::json!({ "position": { "troposphere": "standard", "ionosphere": "none" } });
        (run.troposphere_m, run.ionosphere_m) = (0.0, 0.0);
        let hinted = |run: &Run, value: f64| {
            let mut verdict = Verdict::default();
            verdict.judge("vertical error, 95 %", "", value, "m", Bound::Max(1.0), "test");
            verdict.judge("false acquisitions", "", 1, "", Bound::Max(0.0), "test");
            verdict.hint(run);
            assert!(verdict.rows[1].why.is_empty());
            verdict.rows[0].why.join(" ")
        };
        assert!(hinted(&run, 9.0).contains("troposphere = \"none\""));
        assert_eq!(hinted(&run, 0.5), "", "nothing to explain");
        run.ionosphere_m = 7.25;
        assert!(hinted(&run, 9.0).contains("ionosphere of up to 7.2 m"), "{}", hinted(&run, 9.0));
        run.troposphere_m = 12.0;
        assert!(!hinted(&run, 9.0).contains("troposphere"));
        assert!(!hinted(&run, 9.0).contains("weeks"));
        run.fixes.change(|fixes| fixes.iter_mut().for_each(|fix| fix.gps_s += 1024 * WEEK_S));
        assert!(hinted(&run, 9.0).contains("1024 weeks late"));
    }
}
