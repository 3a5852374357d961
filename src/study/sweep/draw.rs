//! Curves with bands of confidence, heat maps, and where a figure crosses a level.
//!
//! [`pictures`] turns results into charts as data; nothing is drawn before [`Picture::draw`]. A value without
//! a number has its position by its rank. Limits: a crossing is found by straight lines between neighbouring
//! cells.

use std::fmt::Write;
use std::path::Path;

use plotters::style::RGBColor;

use super::StudyError;
use super::axis::{self, Axis as StudyAxis};
use super::estimate::Estimate;
use super::publish::short;
use super::result::{Cell, Results, THEORY};
use super::spec::{Plot, PlotKind};
use super::words;
use analysis::show::plot::canvas::{Axis, Chart, Failure, GREY, Mark, Series, WIDTH_PX, figure};
use analysis::show::plot::sketch::{Figure, Sketch};

/// A picture of a study.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name of its file, without an ending.
    pub stem: String,
    /// Words above all charts.
    pub title: String,
    /// Charts of the picture.
    pub charts: Vec<Chart>,
    /// Series that are named below them.
    pub legend: Vec<Series>,
    /// Names of the columns and rows of a table of crossings, for such pictures.
    pub crossings: Option<(Vec<String>, Vec<Vec<String>>)>,
}

impl Picture {
    /// Draws it into a file, a PNG or an SVG by its ending.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn draw(&self, path: &Path) -> Result<(), StudyError> {
        let columns = self.charts.len().clamp(1, 3);
        let rows = self.charts.len().div_ceil(columns).max(1);
        let width = if columns == 1 { 900 } else { 220 + 480 * columns };
        Ok(figure(path, (width as u32, 440 * rows as u32), columns, &self.charts, &self.legend)?)
    }

    /// The picture as wide as a page's text.
    ///
    /// # Errors
    /// Errors of the drawing library.
    pub fn figure(&self) -> Result<Figure, Failure> {
        let columns = self.charts.len().clamp(1, 2);
        let rows = self.charts.len().div_ceil(columns).max(1);
        let size = (WIDTH_PX, 300 * rows as u32 + 40);
        let sketch = Sketch::of(size, columns, self.charts.clone(), self.legend.clone());
        Figure::new(&self.stem, sketch, &self.title)
    }

    /// Table of the crossings in Markdown; empty for other pictures.
    pub fn table(&self) -> String {
        let Some((heads, rows)) = &self.crossings else { return String::new() };
        let mut text = format!("\n| {} |\n|{}\n", heads.join(" | "), " --- |".repeat(heads.len()));
        for row in rows {
            let _ = writeln!(text, "| {} |", row.join(" | "));
        }
        text
    }
}

/// Every picture that the study asks for.
pub fn pictures(results: &Results) -> Vec<Picture> {
    let name = |number: usize, plot: &Plot| match results.study.plots.len() {
        1 => results.study.name.clone(),
        _ => format!("{}_{}_{}", results.study.name, number + 1, plot.figure.replace('.', "_")),
    };
    results
        .study
        .plots
        .iter()
        .enumerate()
        .filter_map(|(number, plot)| picture(results, plot, name(number, plot)))
        .collect()
}

/// Name of bands in the legend.
const BAND: &str = "95 % of the mean";
/// Name of the band about where a curve crosses a level.
const CROSSING_BAND: &str = "95 % interval";
/// Columns of a heat map up to which its values have three digits.
const MOST_COLUMNS: usize = 10;
/// Bands reach beyond the curves by this part of their span at most, unless most bands do: the interval of a
/// few runs that survive would hide all else.
const MOST_BAND: f64 = 0.5;
/// Distance from one series to the next where names are on the axis, in steps of the names.
const NAMED_STEP: f64 = 0.12;

/// Part of the results that a plot shows.
struct View<'r> {
    results: &'r Results,
    plot: &'r Plot,
    figure: usize,
    theory: Option<usize>,
}

fn picture(results: &Results, plot: &Plot, stem: String) -> Option<Picture> {
    let figure = results.figure(&plot.figure)?;
    let theory = results.figure(&format!("{THEORY}{}", plot.figure));
    let view = View { results, plot, figure, theory };
    let panels = view.values_of(plot.panel.as_deref());
    let mut picture =
        Picture { stem, title: plot.title.clone(), charts: Vec::new(), legend: Vec::new(), crossings: None };
    for panel in &panels {
        let cells = view.cells(*panel);
        let title = panel.map_or_else(|| plot.title.clone(), |(axis, value)| view.words(axis, value));
        match &plot.kind {
            PlotKind::Curve => view.curve(&mut picture, title, &cells),
            PlotKind::Heat { y } => view.heat(&mut picture, title, &cells, y),
            PlotKind::Crossing { along, level } => view.crossing(&mut picture, title, &cells, (along, *level)),
        }
    }
    Some(picture)
}

/// A number to two digits.
fn shorter(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { (1 - libm::floor(libm::log10(x.abs())) as i32).clamp(0, 3) };
    let text = format!("{x:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A value of an axis by its numbers.
type Chosen = Option<(usize, usize)>;

impl View<'_> {
    /// Every value of an axis; one of none without an axis.
    fn values_of(&self, key: Option<&str>) -> Vec<Chosen> {
        let Some(axis) = key.and_then(|key| self.results.axis(key)) else { return vec![None] };
        let count = self.axis(axis).map_or(0, |axis| axis.values.len());
        let fixed = |value: &usize| self.allows(axis, *value);
        (0..count).filter(fixed).map(|value| Some((axis, value))).collect()
    }

    fn axis(&self, number: usize) -> Option<&StudyAxis> {
        self.results.study.axes.get(number)
    }

    /// True if `where` admits this value of an axis.
    fn allows(&self, axis: usize, value: usize) -> bool {
        let Some(axis) = self.axis(axis) else { return false };
        let text = axis.values.get(value).map(axis::text_of);
        self.plot.fixed.iter().all(|(key, wanted)| *key != axis.key || Some(axis::text_of(wanted)) == text)
    }

    fn cells(&self, panel: Chosen) -> Vec<&Cell> {
        let chosen = |cell: &&Cell| {
            cell.at.iter().enumerate().all(|(axis, value)| self.allows(axis, *value))
                && panel.is_none_or(|(axis, value)| cell.at.get(axis) == Some(&value))
        };
        self.results.cells.iter().filter(chosen).collect()
    }

    fn words(&self, axis: usize, value: usize) -> String {
        let Some(axis) = self.axis(axis) else { return String::new() };
        let words = axis.words();
        // The unit goes to the value.
        match words.strip_suffix(')').and_then(|words| words.rsplit_once(" (")) {
            Some((name, unit)) => format!("{name} = {} {unit}", axis.words_of(value)),
            None => format!("{words} = {}", axis.words_of(value)),
        }
    }

    /// The figure in words, with its unit.
    fn figure_words(&self) -> String {
        self.plot.label.clone().unwrap_or_else(|| words::of_figure(&self.plot.figure))
    }

    fn estimate(&self, cell: &Cell) -> Option<Estimate> {
        cell.estimates.get(self.figure).copied().flatten()
    }

    /// Coordinate of a cell on an axis: its number, or its rank where values are not numbers. It is a
    /// logarithm if `log` is true.
    fn place(&self, cell: &Cell, key: &str, log: bool) -> Option<f64> {
        let axis = self.results.axis(key)?;
        let numbers = self.axis(axis)?.is_of_numbers();
        let number = match numbers {
            true => axis::number_of(self.results.value(cell, axis)?)?,
            false => *cell.at.get(axis)? as f64,
        };
        if log { (number > 0.0).then(|| libm::log10(number)) } else { Some(number) }
    }

    /// The axis across, with words under it where values are no numbers.
    fn across(&self, cells: &[&Cell]) -> Axis {
        let key = &self.plot.x;
        let places = cells.iter().filter_map(|cell| self.place(cell, key, self.plot.log_x));
        let number = self.results.axis(key);
        let study_axis = number.and_then(|number| self.axis(number));
        let numbers = study_axis.is_some_and(axis::Axis::is_of_numbers);
        // Names have half a step on either side of them.
        let named = study_axis.filter(|_| !numbers).map_or(0.0, |axis| axis.values.len() as f64);
        let room = [-0.5, named - 0.5].into_iter().filter(|_| !numbers);
        let label = study_axis.map_or(key.clone(), StudyAxis::words);
        let least = if self.plot.log_x { 0.3 } else { 1e-9 };
        let across = Axis::around(&label, places.chain(room), least);
        match study_axis.filter(|_| !numbers) {
            Some(axis) => across.named((0..axis.values.len()).map(|rank| (rank as f64, axis.words_of(rank))).collect()),
            None if self.plot.log_x => across.logarithmic(),
            None => across,
        }
    }

    /// The axis upward around curves and, as far as these stay readable, the bands about them.
    fn up(&self, series: &[Series]) -> Axis {
        let values = |is_band: bool| -> Vec<f64> {
            let own = series.iter().filter(|series| (series.mark == Mark::Band) == is_band);
            own.flat_map(|series| series.points.iter().map(|point| point.1)).filter(|y| y.is_finite()).collect()
        };
        upward(&self.figure_words(), &values(false), &values(true), self.plot.log_y)
    }

    fn height(&self, value: f64) -> Option<f64> {
        if self.plot.log_y { (value > 0.0).then(|| libm::log10(value)) } else { Some(value) }
    }

    fn curve(&self, picture: &mut Picture, title: String, cells: &[&Cell]) {
        let (mut series, mut first) = (Vec::new(), picture.legend.is_empty());
        let across = self.results.axis(&self.plot.x).and_then(|axis| self.axis(axis));
        let named = across.is_some_and(|axis| !axis.is_of_numbers());
        let every = self.values_of(self.plot.series.as_deref());
        let theory_mark = if named { Mark::Rings } else { Mark::Line };
        let middle = 0.5 * every.len().saturating_sub(1) as f64;
        for (rank, chosen) in every.into_iter().enumerate() {
            let aside = if named { NAMED_STEP * (rank as f64 - middle) } else { 0.0 };
            let own = |cell: &&&Cell| chosen.is_none_or(|(axis, value)| cell.at.get(axis) == Some(&value));
            let mut points: Vec<(f64, &Cell)> = cells
                .iter()
                .filter(own)
                .filter_map(|c| Some((self.place(c, &self.plot.x, self.plot.log_x)? + aside, *c)))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let line = |of: &dyn Fn(&Cell) -> Option<f64>| -> Vec<(f64, f64)> {
                points.iter().filter_map(|(x, cell)| Some((*x, self.height(of(cell)?)?))).collect()
            };
            let low = line(&|cell| self.estimate(cell)?.interval.map(|(low, _)| low));
            let high = line(&|cell| self.estimate(cell)?.interval.map(|(_, high)| high));
            let means = line(&|cell| Some(self.estimate(cell)?.mean));
            let name = chosen.map_or_else(|| self.figure_words(), |(axis, value)| self.words(axis, value));
            // Nothing lies between names: each has its own interval, and no line leads to the next.
            // A line needs two points.
            let apart = self.theory.is_some() || named || means.len() < 2;
            let means = if apart { Series::large(name, rank, means) } else { Series::lined(name, rank, means) };
            let colour = means.colour;
            if first {
                picture.legend.push(Series { points: Vec::new(), ..means.clone() });
            }
            if named {
                let box_of = |((x, low), (_, high)): (&(f64, f64), &(f64, f64))| {
                    let (left, right) = (x - 0.3 * NAMED_STEP, x + 0.3 * NAMED_STEP);
                    let corners = vec![(left, *low), (right, *low), (right, *high), (left, *high)];
                    Series::new("band", colour, Mark::Band, corners)
                };
                series.extend(low.iter().zip(&high).map(box_of));
            } else {
                let band = low.into_iter().chain(high.into_iter().rev()).collect();
                series.push(Series::new("band", colour, Mark::Band, band));
            }
            if let Some(theory) = self.theory {
                let expected = line(&|cell| cell.estimates.get(theory).copied().flatten().map(|e| e.mean));
                let mark = if named { Mark::Rings } else { Series::lined(String::new(), rank, Vec::new()).mark };
                series.push(Series::new("theory", colour, mark, expected));
            }
            series.push(means);
        }
        if std::mem::take(&mut first) {
            if self.theory.is_some() {
                picture.legend.push(Series::new("theory", GREY, theory_mark, Vec::new()));
            }
            if self.results.study.grid.repetitions > 1 {
                picture.legend.push(Series::new(BAND, GREY, Mark::Band, Vec::new()));
            }
        }
        self.chart(picture, title, cells, series);
    }

    fn chart(&self, picture: &mut Picture, title: String, cells: &[&Cell], series: Vec<Series>) {
        let y = self.up(&series);
        let is_cut = |band: &Series| band.mark == Mark::Band && band.points.iter().any(|point| !y.holds(point.1));
        if series.iter().any(is_cut) {
            let bands = picture.legend.iter_mut().filter(|entry| entry.name == BAND);
            bands.for_each(|entry| entry.name += ", cut at the axis");
        }
        picture.charts.push(Chart::new(title, self.across(cells), y, series));
    }

    /// Colours by value, the same for all panels, and the value in each tile.
    fn heat(&self, picture: &mut Picture, title: String, cells: &[&Cell], y: &str) {
        let all = self.results.cells.iter().filter_map(|cell| self.height(self.estimate(cell)?.mean));
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let (Some(x_axis), Some(y_axis)) = (self.results.axis(&self.plot.x), self.results.axis(y)) else { return };
        let share = |value: f64| if high > low { (value - low) / (high - low) } else { 0.5 };
        // A value has to fit into its tile.
        let columns = self.axis(x_axis).map_or(0, |axis| axis.values.len());
        let words = |mean: f64| if columns > MOST_COLUMNS { shorter(mean) } else { short(mean) };
        let (mut tiles, mut labels) = (Vec::new(), Vec::new());
        for cell in cells {
            let (Some(x), Some(y)) = (cell.at.get(x_axis), cell.at.get(y_axis)) else { continue };
            let place = (*x as f64, *y as f64);
            let estimate = self.estimate(cell).and_then(|estimate| Some((estimate.mean, self.height(estimate.mean)?)));
            let (colour, label) = match estimate {
                Some((mean, height)) => (warmth(share(height)), words(mean)),
                None => (RGBColor(255, 255, 255), "–".to_owned()),
            };
            tiles.push(Series::new("tile", colour, Mark::Tile(0.98, 0.98), vec![place]));
            labels.push(((place.0 - 0.3, place.1), label, 0));
        }
        if picture.legend.is_empty() && low <= high {
            let back = |height: f64| if self.plot.log_y { libm::pow(10.0, height) } else { height };
            picture.legend = (0..=4_u32)
                .rev()
                .map(|step| f64::from(step) / 4.0)
                .map(|at| (warmth(at), short(back(low + at * (high - low)))))
                .map(|(colour, name)| Series::new(name, colour, Mark::Tile(1.0, 1.0), Vec::new()))
                .collect();
            // The first entry says what the numbers are.
            if let Some(first) = picture.legend.first_mut() {
                first.name = format!("{}: {}", self.figure_words(), first.name);
            }
        }
        let ticks = |axis: usize| -> Vec<(f64, String)> {
            let of =
                |axis: &axis::Axis| (0..axis.values.len()).map(|rank| (rank as f64, axis.words_of(rank))).collect();
            self.axis(axis).map_or_else(Vec::new, of)
        };
        let side = |axis: usize| {
            let (label, count) = self.axis(axis).map_or((String::new(), 0), |axis| (axis.words(), axis.values.len()));
            Axis::new(&label, (-0.5, count as f64 - 0.5)).named(ticks(axis))
        };
        picture.charts.push(Chart { labels, ..Chart::new(title, side(x_axis), side(y_axis), tiles) });
    }

    /// Draws the crossing of a level along an axis by the mean and by the ends of its interval, over x.
    fn crossing(&self, picture: &mut Picture, title: String, cells: &[&Cell], (along, level): (&str, f64)) {
        let first = picture.legend.is_empty();
        let (mut series, mut rows) = (Vec::new(), Vec::new());
        for (rank, chosen) in self.values_of(self.plot.series.as_deref()).into_iter().enumerate() {
            let (mut means, mut lows, mut highs) = (Vec::new(), Vec::new(), Vec::new());
            for x in self.values_of(Some(&self.plot.x)) {
                let own = |cell: &&&Cell| {
                    [chosen, x].iter().all(|c| c.is_none_or(|(axis, value)| cell.at.get(axis) == Some(&value)))
                };
                let mut line: Vec<(f64, &Cell)> =
                    cells.iter().filter(own).filter_map(|c| Some((self.place(c, along, false)?, *c))).collect();
                line.sort_by(|a, b| a.0.total_cmp(&b.0));
                let at = |of: &dyn Fn(Estimate) -> f64| {
                    let points: Vec<(f64, f64)> =
                        line.iter().filter_map(|(place, cell)| Some((*place, of(self.estimate(cell)?)))).collect();
                    crossed(&points, level)
                };
                let mean = at(&|estimate| estimate.mean);
                let ends = [
                    at(&|estimate| estimate.interval.map_or(estimate.mean, |(low, _)| low)),
                    at(&|estimate| estimate.interval.map_or(estimate.mean, |(_, high)| high)),
                ];
                let place = line.first().and_then(|(_, cell)| self.place(cell, &self.plot.x, self.plot.log_x));
                if let (Some(place), Some(height)) = (place, mean.and_then(|mean| self.height(mean))) {
                    means.push((place, height));
                    if let [Some(a), Some(b)] = ends.map(|end| end.and_then(|end| self.height(end))) {
                        lows.push((place, a.min(b)));
                        highs.push((place, a.max(b)));
                    }
                }
                let both = ends.iter().all(Option::is_some);
                let mut row: Vec<String> = self.plot.panel.iter().map(|_| title.clone()).collect();
                row.extend(
                    [chosen, x]
                        .into_iter()
                        .flatten()
                        .map(|(axis, value)| self.axis(axis).map_or_else(String::new, |axis| axis.words_of(value))),
                );
                let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), short);
                row.extend([number(mean), number(least(ends).filter(|_| both)), number(most(ends).filter(|_| both))]);
                rows.push(row);
            }
            let name = chosen.map_or_else(|| self.figure_words(), |(axis, value)| self.words(axis, value));
            let balls = Series::large(name.clone(), rank, means.clone());
            let line = Series::lined(name, rank, means);
            let colour = balls.colour;
            if first {
                picture.legend.push(Series { points: Vec::new(), ..balls.clone() });
            }
            series.push(Series::new(
                "band",
                colour,
                Mark::Band,
                lows.into_iter().chain(highs.into_iter().rev()).collect(),
            ));
            series.push(Series { colour, ..line });
            series.push(balls);
        }
        if first && self.results.study.grid.repetitions > 1 {
            picture.legend.push(Series::new(CROSSING_BAND, GREY, Mark::Band, Vec::new()));
        }
        let label =
            |key: &str| self.results.axis(key).and_then(|n| self.axis(n)).map_or(key.to_owned(), StudyAxis::words);
        let y_values = series.iter().flat_map(|series| series.points.iter().map(|point| point.1));
        let (least, is_log) = if self.plot.log_y { (0.3, true) } else { (1e-9, false) };
        let y = Axis::around(&label(along), y_values, least);
        let y = if is_log { y.logarithmic() } else { y };
        picture.charts.push(Chart::new(title, self.across(cells), y, series));
        let mut heads: Vec<String> = self.plot.panel.iter().chain(&self.plot.series).map(|key| label(key)).collect();
        heads.push(label(&self.plot.x));
        heads.push(format!("{} where {} = {level}", label(along), self.figure_words()));
        heads.extend(["from".to_owned(), "to".to_owned()]);
        let (_, all) = picture.crossings.get_or_insert_with(|| (heads, Vec::new()));
        all.extend(rows);
    }
}

/// An axis around curves and, as far as these stay readable, bands; values of a logarithmic one are
/// logarithms. Bands that most others are like are shown whole.
fn upward(label: &str, curves: &[f64], bands: &[f64], is_log: bool) -> Axis {
    let (low, high) =
        curves.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(*y), high.max(*y)));
    let (span, most) = ((high - low).max(0.0), low.abs().max(high.abs()));
    let mut beyond: Vec<f64> = bands.iter().map(|y| (low - y).max(y - high).max(0.0)).collect();
    beyond.sort_by(f64::total_cmp);
    let usual = beyond.get(beyond.len() * 3 / 4).copied().unwrap_or(0.0);
    // Curves of one height show their bands whole.
    let room = if span > 1e-9 * most { (MOST_BAND * span).max(1.5 * usual) } else { f64::INFINITY };
    let shown = bands.iter().map(|y| y.clamp(low.min(high) - room, high.max(low) + room));
    // Half a decade at least, or a part of values that are all alike.
    let least = match is_log {
        true => 0.5,
        false if most > 0.0 && most.is_finite() => 0.02 * most,
        false => 1.0,
    };
    let axis = Axis::around(label, curves.iter().copied().chain(shown), least);
    if is_log { axis.logarithmic() } else { axis }
}

fn least(ends: [Option<f64>; 2]) -> Option<f64> {
    ends.into_iter().flatten().reduce(f64::min)
}

fn most(ends: [Option<f64>; 2]) -> Option<f64> {
    ends.into_iter().flatten().reduce(f64::max)
}

/// First crossing of a level by a line through points.
pub(super) fn crossed(points: &[(f64, f64)], level: f64) -> Option<f64> {
    let pairs = points.windows(2).find_map(|pair| match pair {
        [(x0, y0), (x1, y1)] if (y0 - level) * (y1 - level) <= 0.0 && y0 != y1 => {
            Some(x0 + (x1 - x0) * (level - y0) / (y1 - y0))
        }
        _ => None,
    });
    pairs.filter(|x| x.is_finite())
}

/// Colour from pale to dark through blue: dark letters stay readable.
fn warmth(share: f64) -> RGBColor {
    const STOPS: [(f64, f64, f64); 4] =
        [(247.0, 251.0, 255.0), (198.0, 219.0, 239.0), (107.0, 174.0, 214.0), (66.0, 146.0, 198.0)];
    let at = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let index = (at.floor() as usize).min(STOPS.len() - 2);
    let (a, b, u) = (STOPS[index], STOPS[index + 1], at - index as f64);
    let mix = |a: f64, b: f64| (a + (b - a) * u).round() as u8;
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_two_survivors_does_not_hide_the_curves() {
        // Once drawn from -1000° to 1500°: the mean of two runs that held lock, beside curves of 10° to 25°.
        let curves = [10.0, 12.0, 14.0, 16.0, 18.0, 25.0];
        let bands = [9.0, 11.0, 11.0, 13.0, 13.0, 15.0, 15.0, 17.0, 17.0, 19.0, -1000.0, 1500.0];
        let axis = upward("largest phase error (degrees)", &curves, &bands, false);
        assert!((25.0 - 10.0) / (axis.to - axis.from) > 0.4, "{axis:?}");
        assert!(axis.holds(10.0) && axis.holds(25.0));
        // Bands that are all wide are shown whole, as is the band about one point.
        let axis = upward("error (m)", &[0.155, 0.16, 0.14], &[0.05, 0.25, 0.06, 0.26, 0.04, 0.24], false);
        assert!(axis.holds(0.04) && axis.holds(0.26), "{axis:?}");
        let axis = upward("share", &[0.5], &[0.1, 0.9], false);
        assert!(axis.holds(0.1) && axis.holds(0.9));
        // No curve at all still makes an axis.
        assert!(upward("share", &[], &[], false).ticks(5).ticks.len() >= 2);
    }
}
