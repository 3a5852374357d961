//! Rules for a receiver that verifies Galileo's authentication: no false tag accepted, no true one refused,
//! authentic data in time.

use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::measure::osnma::Osnma;

impl Verdict {
    pub(super) fn osnma(&mut self, summary: &Summary) {
        let Some(osnma) = &summary.osnma else { return };
        let [accepted, refused] = osnma.wrong.clone();
        self.judge(
            "false tags taken for authentic",
            "osnma.false_accepted",
            osnma.false_accepted,
            "",
            Bound::Max(0.0),
            "none that a spoofer signed, that came after its key could be known, or whose words a fault changed",
        );
        self.explain(accepted);
        self.judge(
            "true tags refused",
            "osnma.true_refused",
            osnma.true_refused,
            "",
            Bound::Max(0.0),
            "none that a satellite sent for words that no fault changed",
        );
        self.explain(refused);
        self.judge(
            "tags in the table against the receiver's own counts",
            "osnma.rows_differing",
            osnma.rows_differing,
            "",
            Bound::Max(0.0),
            "a row for each tag",
        );
        self.first_authentic(osnma);
    }

    fn first_authentic(&mut self, osnma: &Osnma) {
        let Some(due_s) = osnma.first_authentic_due_s else {
            self.not_judged.push(format!(
                "time to first authentic data: {}",
                if osnma.timetable.is_empty() {
                    "the scene or the receiver's own time allows none"
                } else {
                    "the scene ends before they are due"
                }
            ));
            return;
        };
        self.judge(
            "time to first authentic data",
            "osnma.first_authentic_s",
            osnma.first_authentic_s,
            "s",
            Bound::Max(due_s),
            &osnma.timetable,
        );
    }
}
