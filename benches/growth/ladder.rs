//! Costs along one quantity, the straight line through them, their table and their curve.

use std::fmt::Write as _;
use std::path::Path;

use analysis::show::plot::canvas::{Axis, BLUE, Chart, GREY, Mark, Series, figure};

/// A cost where the quantity has one value.
#[derive(Clone, Debug)]
pub struct Step {
    pub x: f64,
    pub cost: f64,
    /// Largest resident set of the process, where it is one.
    pub peak_mib: Option<f64>,
}

/// Costs along one quantity.
#[derive(Clone, Debug)]
pub struct Ladder {
    pub title: String,
    /// The quantity with its unit.
    pub x: &'static str,
    /// The cost's unit.
    pub unit: &'static str,
    /// Expected amount of work.
    pub expected: &'static str,
    pub steps: Vec<Step>,
    /// Least quantity from which on costs should be on a straight line; `None` where no line is expected.
    pub line_from: Option<f64>,
    /// True if the quantity is drawn by its logarithm.
    pub is_log: bool,
}

/// cost = fixed + slope·x.
#[derive(Clone, Copy, Debug)]
struct Line {
    fixed: f64,
    slope: f64,
    /// Largest deviation of a cost from the line, over that cost.
    off: f64,
}

impl Ladder {
    /// The line with the least sum of squares of relative errors, as costs span decades.
    fn line(&self) -> Option<Line> {
        let from = self.line_from?;
        let steps = || self.steps.iter().filter(|step| step.x >= from);
        let weight = |step: &Step| 1.0 / (step.cost * step.cost);
        let sum = |of: &dyn Fn(&Step) -> f64| steps().map(|step| weight(step) * of(step)).sum::<f64>();
        let (all, x, y) = (sum(&|_| 1.0), sum(&|step| step.x), sum(&|step| step.cost));
        let (xx, xy) = (sum(&|step| step.x * step.x), sum(&|step| step.x * step.cost));
        let determinant = all * xx - x * x;
        let (fixed, slope) = ((xx * y - x * xy) / determinant, (all * xy - x * y) / determinant);
        let off = |step: &Step| ((fixed + slope * step.x) / step.cost - 1.0).abs();
        Some(Line { fixed, slope, off: steps().map(off).fold(0.0, f64::max) })
    }

    pub fn table(&self) -> String {
        let mut text =
            format!("\n**{}**\n\n|{}|{}|largest memory (MiB)|\n|---|---|---|\n", self.title, self.x, self.unit);
        for step in &self.steps {
            let memory = step.peak_mib.map_or_else(String::new, |mib| format!("{mib:.0}"));
            let _ = writeln!(text, "|{}|{}|{memory}|", step.x, significant(step.cost));
        }
        let _ = writeln!(text, "\nExpected: {}.", self.expected);
        if let Some(Line { fixed, slope, off }) = self.line() {
            let (fixed, slope, off) = (significant(fixed), significant(slope), 100.0 * off);
            let from = self.line_from.filter(|from| self.steps.iter().any(|step| step.x < *from));
            let whence = from.map_or_else(String::new, |from| format!(" from {from} on"));
            let _ = writeln!(text, "Line{whence}: {fixed} + {slope} x; furthest from it {off:.0} %.");
        }
        text
    }

    fn chart(&self) -> Chart {
        let line = self.line();
        let place = |x: f64| if self.is_log { libm::log10(x) } else { x };
        let points: Vec<(f64, f64)> = self.steps.iter().map(|step| (place(step.x), step.cost)).collect();
        let last = self.steps.iter().map(|step| step.x).fold(0.0, f64::max);
        let first = self.steps.iter().map(|step| step.x).fold(last, f64::min);
        let from = if self.is_log { first } else { 0.0 };
        let xs = (0..=100).map(|n| {
            let share = f64::from(n) / 100.0;
            if self.is_log { from * libm::pow(last / from, share) } else { last * share }
        });
        let along: Vec<(f64, f64)> = line.map_or_else(Vec::new, |line| {
            let from = self.line_from.unwrap_or(0.0);
            xs.filter(|x| from <= first || *x >= from).map(|x| (place(x), line.fixed + line.slope * x)).collect()
        });
        let top = points.iter().chain(&along).map(|point| point.1).fold(0.0, f64::max);
        let x = Axis::new(self.x, (place(from), place(last) + 0.02 * (place(last) - place(from))));
        let x = if self.is_log { x.logarithmic() } else { x };
        let y = Axis::new(self.unit, (0.0, 1.08 * top));
        let series =
            vec![Series::new("line", GREY, Mark::Line, along), Series::new("measured", BLUE, Mark::Balls, points)];
        Chart::new(self.title.clone(), x, y, series)
    }
}

/// Three digits, without zeros that say nothing.
fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2.0 - libm::floor(libm::log10(value.abs()))).max(0.0) as usize;
    format!("{value:.digits$}")
}

/// One chart for each ladder.
pub fn draw(path: &Path, ladders: &[Ladder]) -> Result<(), String> {
    let charts: Vec<Chart> = ladders.iter().map(Ladder::chart).collect();
    let legend = [
        Series::new("measured", BLUE, Mark::Balls, Vec::new()),
        Series::new("straight line through them", GREY, Mark::Line, Vec::new()),
    ];
    let height = 60 + 300 * charts.len().div_ceil(2) as u32;
    figure(path, (1280, height), 2, &charts, &legend).map_err(|error| error.to_string())
}
