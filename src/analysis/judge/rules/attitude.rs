//! Rules for attitudes that a receiver finds by the elements of an array.

use serde_json::Value;

use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;

/// Least share of intervals with an attitude.
const LEAST_SHARE: f64 = 0.9;
/// Largest stated deviation over that of theory: the receiver's C/N0 of one instant stands for an interval.
const LARGEST_STATED: f64 = 1.15;

impl Verdict {
    pub(super) fn attitude(&mut self, run: &Run, summary: &Summary) {
        let Some(figures) = &summary.attitude else {
            let is_asked = run.receiver.pointer("/settings/array/attitude_ms").and_then(Value::as_u64) > Some(0);
            if is_asked && run.scene.array.as_ref().is_some_and(|facts| !facts.is_still) {
                self.not_judged.push("attitude: the body moves or turns".to_owned());
            }
            return;
        };
        if figures.due == 0 {
            self.not_judged.push("intervals with an attitude: none is due".to_owned());
        } else if run.scene.interference.is_empty() && run.scene.spoofers.is_empty() {
            let share = figures.intervals as f64 / figures.due as f64;
            let source = "the elements hear the satellites of the fix";
            self.judge("intervals with an attitude, of those due", "", share, "of 1", Bound::Min(LEAST_SHARE), source);
        } else {
            let why = "intervals with an attitude: what is sent besides the satellites may hide them";
            self.not_judged.push(why.to_owned());
        }
        let source = "deviations that the receiver states";
        if let Some(ratio) = figures.error_ratio {
            let (figure, path) = ("attitude error over its deviation, rms", "attitude.error_ratio");
            self.judge(figure, path, ratio.value, "of 1", Bound::Max(ratio.limit), source);
        }
        if let Some(ratio) = figures.phase_ratio {
            let (figure, path) = ("phases of the elements' channels over their deviation, rms", "attitude.phase_ratio");
            self.judge(figure, path, ratio.value, "of 1", Bound::Max(ratio.limit), source);
        }
        if let Some(ratio) = figures.stated_ratio {
            let (figure, path) = ("stated deviation of the attitude over theory", "attitude.stated_ratio");
            let source = "geometry of the elements and satellites, noise of their carriers";
            self.judge(figure, path, ratio, "of 1", Bound::Max(LARGEST_STATED), source);
        }
    }
}
