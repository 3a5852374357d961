//! Data from which pictures and reports are made.

use crate::judge::summary::Summary;
use crate::measure::clock::Clock;
use crate::measure::consistency::Consistency;
use crate::measure::detection::Detection;
use crate::measure::errors::Errors;
use crate::measure::protection::Protection;
use crate::read::Run;
use crate::show::plot::chart::{Axis, Chart, Mark, Series};
use crate::show::plot::sketch::Sketch;

/// Reader of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Detail {
    /// Paper: no more marks than the eye can resolve, evenly chosen.
    Paper,
    /// A screen that magnifies: more points, the least and the greatest of every run of neighbours.
    Screen,
}

/// Everything that a picture is drawn from.
pub(crate) struct Judged<'a> {
    pub run: &'a Run,
    pub errors: &'a Errors,
    pub clock: &'a Clock,
    pub consistency: &'a Consistency,
    pub protection: &'a Protection,
    pub detection: &'a Detection,
    pub summary: &'a Summary,
    pub detail: Detail,
}

impl Judged<'_> {
    /// The mark by whose rule points of another are thinned.
    pub(super) fn thinned_as(&self, mark: Mark) -> Mark {
        if self.detail == Detail::Screen { Mark::Line } else { mark }
    }

    /// Charts in the detail that is asked for.
    pub(super) fn sketch(
        &self,
        size: (u32, u32),
        columns: usize,
        charts: impl Into<Vec<Chart>>,
        legend: impl Into<Vec<Series>>,
    ) -> Sketch {
        match self.detail {
            Detail::Paper => Sketch::charts(size, columns, charts, legend),
            Detail::Screen => Sketch::of(size, columns, charts.into(), legend.into()),
        }
    }

    /// An axis over the times at which there is something, or the whole run if there is nothing.
    pub(super) fn time_axis(&self, times_s: impl Iterator<Item = f64>) -> Axis {
        let first_s = times_s.fold(self.run.scene.duration_s, f64::min);
        let end_s = self.run.scene.duration_s;
        // Some room before the first point shows that nothing came before it.
        let from_s = if first_s < end_s { (first_s - 0.05 * (end_s - first_s)).max(0.0) } else { 0.0 };
        Axis::new("time (s)", (from_s, end_s))
    }
}
