//! Protection levels that the receiver states, against the errors of its fixes.

use crate::judge::judgement::{Bound, number};
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::measure::protection::Stanford;

impl Verdict {
    /// Rows of a receiver with protection levels.
    pub(super) fn protection(&mut self, summary: &Summary) {
        let Some(figures) = &summary.protection else { return };
        let source = "a receiver with protection levels states them of every fix";
        let path = "protection.without_row";
        self.judge("fixes without protection levels", path, figures.without_row, "", Bound::Max(0.0), source);
        self.promise("horizontal", figures.horizontal.as_ref());
        self.promise("vertical", figures.vertical.as_ref());
    }

    /// Compares exceedances with the promise: it is refuted where all of the interval lies above it.
    fn promise(&mut self, axis: &str, diagram: Option<&Stanford>) {
        let figure = format!("{axis} errors beyond their protection level, at least");
        let Some(found) = diagram else {
            self.not_judged.push(format!("{figure}: no fix has such a level"));
            return;
        };
        let Some(promised) = found.promised else {
            self.not_judged.push(format!("{figure}: the receiver's settings promise no probability"));
            return;
        };
        let beyond = found.misleading + found.hazardous + found.unavailable_misleading;
        let source = format!(
            "promised probability; lower end of the exact 95 % interval, {} to {}, of {beyond} of {} fixes; fixes of a \
             run are correlated",
            number(found.exceeded_low),
            number(found.exceeded_high),
            found.fixes
        );
        let path = format!("protection.{axis}.exceeded_low");
        self.judge(&figure, &path, found.exceeded_low, "of 1", Bound::Max(promised), &source);
    }
}
