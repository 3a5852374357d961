//! Satellites that are not there, and decoded navigation parameters.

use super::{Bound, Verdict};
use crate::analysis::summary::Summary;

impl Verdict {
    pub(super) fn reception(&mut self, summary: &Summary) {
        let (satellites, navigation) = (&summary.satellites, &summary.navigation);
        self.judge(
            "false acquisitions",
            "satellites.false_acquired",
            satellites.false_acquired,
            "",
            Bound::Max(0.0),
            "the scene has no such satellite",
        );
        if navigation.parameters_checked > 0 {
            self.judge(
                "wrong navigation parameters",
                "navigation.parameters_wrong",
                navigation.parameters_wrong,
                "",
                Bound::Max(0.0),
                "what was sent",
            );
        } else {
            self.not_judged.push("navigation parameters: none decoded".to_owned());
        }
    }
}
