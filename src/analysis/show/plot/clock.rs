//! The receiver's clock: its bias over time, and its stability over averaging time.

use plotters::style::RGBColor;

use crate::error::JudgeError;
use crate::expect::theory::clock::white_phase;
use crate::measure::allan::{Deviation, Point};
use crate::measure::clock::{ClockRow, Line, Of};
use crate::show::plot::canvas::{Axis, BLUE, COLOURS, Chart, GREEN, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::chart::{Ends, Shown};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;

type Points = Vec<(f64, f64)>;

const ESTIMATE: (&str, RGBColor, Mark) = ("estimate", BLUE, Mark::Dots);
const TRUTH: (&str, RGBColor, Mark) = ("truth", ORANGE, Mark::Line);
const STRAIGHT: (&str, RGBColor, Mark) = ("straight line", COLOURS[6], Mark::Dash);

/// Bias as estimated and as it was with the straight line through it, the error, and both without their
/// lines.
pub fn bias(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let clock = judged.clock;
    let mut times = Ends::none();
    clock.rows.each(|row| times.add(row.time_s))?;
    let shown = |(name, colour, mark): (&str, RGBColor, Mark), scale: f64, of: &dyn Fn(&ClockRow) -> f64| {
        let shown = Shown::of(mark, |see| clock.rows.each(|row| see(row.time_s, scale * of(&row))))?;
        Ok::<_, JudgeError>((Series::new(name, colour, mark, shown.points), shown.y))
    };
    let line = |scale: f64, line: Option<Line>| match line {
        Some(line) => shown(STRAIGHT, scale, &|row| line.at(row.time_s)),
        None => Ok((Series::new(STRAIGHT.0, STRAIGHT.1, STRAIGHT.2, Vec::new()), Ends::none())),
    };
    let chart = |title: String, label: &str, least: f64, series: Vec<(Series, Ends)>| {
        let ends = series.iter().fold(Ends::none(), |ends, (_, own)| ends.with(*own));
        let series = series.into_iter().map(|(series, _)| series).collect();
        Chart::new(title, judged.time_axis(times.values()), Axis::around(label, ends.values(), least), series)
    };
    let drift = |line: Option<Line>| line.map_or_else(|| "unknown".to_owned(), |line| format!("{:+.4e}", line.slope));
    let above = vec![
        shown(ESTIMATE, 1e6, &|row| row.estimate_s)?,
        shown(TRUTH, 1e6, &|row| row.truth_s)?,
        line(1e6, clock.estimate_line)?,
    ];
    let title =
        format!("Clock bias: drift {} s/s estimated, {} s/s true", drift(clock.estimate_line), drift(clock.truth_line));
    let legend: Vec<Series> = above.iter().map(|(series, _)| series.clone()).collect();
    let error = vec![shown(ESTIMATE, 1e9, &|row| row.error_s)?, line(1e9, clock.error_line)?];
    let true_rest = |row: &ClockRow| clock.truth_line.map_or(0.0, |line| row.truth_s - line.at(row.time_s));
    let rest = vec![shown(TRUTH, 1e9, &true_rest)?, shown(ESTIMATE, 1e9, &|row| row.detrended_s)?];
    let charts = [
        chart(title, "bias (µs)", 1e-3, above),
        chart("Estimate minus truth".to_owned(), "error (ns)", 0.1, error),
        chart("Estimate and truth, each without its straight line".to_owned(), "bias (ns)", 0.1, rest),
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 540), 1, charts, legend)))
}

/// Points and lines of one chart of deviations, in common logarithms.
struct Curves<'a> {
    judged: &'a Judged<'a>,
    deviation: Deviation,
}

/// Four deviations over averaging time, with intervals of 95 %, what independent measurements would give, and
/// theory.
pub fn stability(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let charts = [
        (Deviation::Oadev, "Allan deviation, overlapping", "deviation of relative frequency"),
        (Deviation::Mdev, "Modified Allan deviation", "deviation of relative frequency"),
        (Deviation::Ohdev, "Hadamard deviation, overlapping", "deviation of relative frequency"),
        (Deviation::Tdev, "Time deviation", "deviation of time (s)"),
    ]
    .map(|(deviation, title, label)| Curves { judged, deviation }.chart(title, label));
    // A series that no chart shows is not named.
    let mut legend: Vec<Series> = Vec::new();
    for series in charts.iter().flat_map(|chart| &chart.series) {
        let known = series.name.is_empty() || legend.iter().any(|other| other.name == series.name);
        if !known && !series.points.is_empty() {
            legend.push(series.clone());
        }
    }
    Ok(Some(Sketch::charts((WIDTH_PX, 540), 2, charts, legend)))
}

impl Curves<'_> {
    fn chart(&self, title: &str, label: &str) -> Chart {
        let mut series = self.lines();
        series.extend(self.measured(Of::Truth, "true clock, 95 %", ORANGE));
        // Of a clock without noise the error is the estimate.
        if !self.points(Of::Truth).is_empty() {
            series.extend(self.measured(Of::Error, "error, 95 %", GREEN));
        }
        series.extend(self.measured(Of::Estimate, "estimate, 95 %", BLUE));
        let all = || series.iter().flat_map(|series| series.points.iter());
        let x = log_axis("averaging time (s)", all().map(|point| point.0));
        let y = log_axis(label, all().map(|point| point.1));
        Chart::new(title, x, y, series)
    }

    fn points(&self, of: Of) -> &[Point] {
        self.judged.clock.series(of).map_or(&[], |series| series.curve(self.deviation))
    }

    /// Series of an estimate: a line through the points, and a bar for each interval.
    fn measured(&self, of: Of, name: &str, colour: RGBColor) -> Vec<Series> {
        let points = self.points(of);
        let middle: Points = points.iter().map(|point| log((point.tau_s, point.deviation))).collect();
        let bar = |point: &Point| {
            let (low, high) = point.interval?;
            let ends = [low, high].map(|end| log((point.tau_s, end)));
            Some(Series::new("", colour, Mark::Line, ends.to_vec()))
        };
        let line = Series::new("", colour, Mark::Line, middle.clone());
        let marks = Series::new(name, colour, Mark::Rings, middle);
        [line, marks].into_iter().chain(points.iter().filter_map(bar)).collect()
    }

    /// White phase noise of position and, of the Allan deviation, the oscillator's theory.
    fn lines(&self) -> Vec<Series> {
        let clock = self.judged.clock;
        let mut lines = Vec::new();
        if let Some(estimate) = clock.series(Of::Estimate) {
            let sigmas = [
                ("code noise, if white", COLOURS[3], clock.code_sigma_s),
                ("carrier noise, if white", GREY, clock.carrier_sigma_s),
            ];
            for (name, colour, sigma_s) in sigmas {
                let Some(sigma_s) = sigma_s.filter(|sigma_s| *sigma_s > 0.0) else { continue };
                let expected = |tau_s: f64| white_phase(self.deviation, sigma_s, tau_s, estimate.tau0_s());
                let taus = self.points(Of::Estimate).iter().map(|point| point.tau_s);
                let points = taus.map(|tau_s| log((tau_s, expected(tau_s)))).collect();
                lines.push(Series::new(name, colour, Mark::Dash, points));
            }
        }
        let truth = clock.series(Of::Truth).filter(|_| self.deviation == Deviation::Oadev);
        if let (Some(law), Some(truth)) = (clock.oscillator, truth) {
            let expected = |point: &Point| law.allan_variance(point.tau_s, truth.cutoff_hz()).sqrt();
            let points = self.points(Of::Truth).iter().map(|point| log((point.tau_s, expected(point)))).collect();
            lines.push(Series::new("oscillator, theory", COLOURS[6], Mark::Dash, points));
        }
        lines
    }
}

fn log((x, y): (f64, f64)) -> (f64, f64) {
    (libm::log10(x), libm::log10(y))
}

/// An axis around common logarithms, at least half a decade long.
fn log_axis(label: &str, values: impl Iterator<Item = f64>) -> Axis {
    Axis::around(label, values, 0.5).logarithmic()
}
