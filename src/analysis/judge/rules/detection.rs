//! False alarms of the receiver's detectors of jamming and spoofing against the probability that it states.

use crate::judge::judgement::{Bound, number};
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;

impl Verdict {
    /// Compares false alarms with the stated probability: it is refuted where all of the interval lies above
    /// it.
    pub(super) fn detection(&mut self, summary: &Summary) {
        let Some(figures) = &summary.detection else { return };
        for (name, found) in &figures.detectors {
            let figure = format!("false alarms of {name}, at least");
            let (Some(low), Some(high)) = (found.false_alarm_low, found.false_alarm_high) else {
                self.not_judged.push(format!("{figure}: no test without an attack"));
                continue;
            };
            let Some(stated) = figures.stated_false_alarm else {
                self.not_judged.push(format!("{figure}: the receiver's settings state no probability"));
                continue;
            };
            let seen = format!("{} of {} tests", found.false_alarms, found.clean_tests);
            let fewer = found.independent_tests.round();
            let as_many = match fewer < found.clean_tests as f64 {
                true => format!(", which count as {fewer} independent ones"),
                false => String::new(),
            };
            if let Some(reason) = figures.disturbance {
                self.not_judged.push(format!("{figure}: {reason}; {seen}, stated {}", number(stated)));
                continue;
            }
            let source = format!(
                "stated probability; lower end of the exact 95 % interval, {} to {}, of {seen}{as_many}",
                number(low),
                number(high)
            );
            let path = format!("detection.detectors.{name}.false_alarm_low");
            self.judge(&figure, &path, low, "of 1", Bound::Max(stated), &source);
        }
    }
}
