//! Charts as data: points, axes and how they look, with no more points than the eye can resolve.

use plotters::style::RGBColor;

use super::clip::Frame;
use super::marks;
pub(super) use super::marks::LIGHT;
pub use super::marks::{BLUE, COLOURS, GREEN, GREY, Mark, ORANGE, Shape};
use super::ticks::{self, LEAST_SHARE, Tick, Ticks};

/// Part of a receiver's bounds that an axis has room for: those of the first fixes would hide the errors.
pub(super) const SHOWN_BOUNDS: f64 = 0.98;

/// Width of a picture that fills a page's text width.
pub const WIDTH_PX: u32 = 680;

/// Points in data units and how they look.
#[derive(Clone, Debug)]
pub struct Series {
    /// Words of the legend.
    pub name: String,
    /// Colour of the marks.
    pub colour: RGBColor,
    /// Form of the points.
    pub mark: Mark,
    /// Points in data units.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// Points with a name of the legend, a colour and a mark.
    pub fn new(name: impl Into<String>, colour: RGBColor, mark: Mark, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), colour, mark, points }
    }

    /// Small marks of one of many series, which differ from those of every other number.
    pub fn numbered(name: String, index: usize, points: Vec<(f64, f64)>) -> Self {
        let (colour, mark) = marks::numbered(index);
        Self { name, colour, mark, points }
    }

    /// Large marks of one of many series, which differ from those of every other number.
    pub fn large(name: String, index: usize, points: Vec<(f64, f64)>) -> Self {
        let (colour, mark) = marks::large(index);
        Self { name, colour, mark, points }
    }

    /// A line that is one of many, in a colour and a pattern of its own.
    pub fn lined(name: String, index: usize, points: Vec<(f64, f64)>) -> Self {
        let (colour, mark) = marks::lined(index);
        Self { name, colour, mark, points }
    }
}

/// Meaning of the numbers of an axis.
#[derive(Clone, Debug, Default)]
pub enum Scale {
    /// The values themselves.
    #[default]
    Linear,
    /// Common logarithms of the values at the ticks.
    Logarithmic,
    /// Positions of names along the axis.
    Named(Vec<(f64, String)>),
}

/// An axis in data units.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Words beside it, with the unit.
    pub label: String,
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Meaning of the axis' numbers.
    pub scale: Scale,
}

impl Axis {
    /// An axis from one value to another. If they are equal, it extends to either side of them.
    pub fn new(label: &str, (from, to): (f64, f64)) -> Self {
        // Ticks need a range with a length.
        let (from, to) = if from.is_finite() && to.is_finite() { (from, to) } else { (0.0, 1.0) };
        let least = (LEAST_SHARE * from.abs().max(to.abs())).max(f64::MIN_POSITIVE * 1e12);
        let (from, to) = match to - from > least {
            true => (from, to),
            false if from < to => (from - least, from + least),
            false => (from - least.max(0.5), from + least.max(0.5)),
        };
        Self { label: label.to_owned(), from, to, scale: Scale::Linear }
    }

    /// An axis around every finite value, with a margin, not shorter than `least`.
    pub fn around(label: &str, values: impl Iterator<Item = f64>, least: f64) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let half = ((high - low) * 0.54).max(least / 2.0);
        let middle = (low + high) / 2.0;
        Self::new(label, (middle - half, middle + half))
    }

    /// Makes the axis logarithmic: its numbers are common logarithms, over at least a thousandth of a decade.
    #[must_use]
    pub fn logarithmic(self) -> Self {
        let (from, to) = (self.from.clamp(-300.0, 300.0), self.to.clamp(-300.0, 300.0));
        let short = (0.5e-3 - 0.5 * (to - from)).max(0.0);
        Self { scale: Scale::Logarithmic, from: from - short, to: to + short, ..self }
    }

    /// Gives the axis names in place of numbers.
    #[must_use]
    pub fn named(self, names: Vec<(f64, String)>) -> Self {
        Self { scale: Scale::Named(names), ..self }
    }

    /// Ticks of the axis, at most `most` of them if that leaves two; each name is a tick.
    pub fn ticks(&self, most: usize) -> Ticks {
        match &self.scale {
            Scale::Linear => ticks::linear(self.from, self.to, most),
            Scale::Logarithmic => ticks::logarithmic(self.from, self.to, most),
            Scale::Named(names) => {
                let tick = |(at, label): &(f64, String)| Tick { at: *at, label: label.clone() };
                Ticks { ticks: names.iter().map(tick).collect(), offset: None }
            }
        }
    }

    pub(super) fn ends(&self) -> (f64, f64) {
        (self.from, self.to)
    }

    /// True if a value lies between the ends of the axis.
    pub fn holds(&self, value: f64) -> bool {
        (self.from..=self.to).contains(&value)
    }

    pub(super) fn span(&self) -> f64 {
        self.to - self.from
    }
}

/// One pair of axes with what is drawn in it.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Words above it.
    pub title: String,
    /// Across.
    pub x: Axis,
    /// Upward.
    pub y: Axis,
    /// Series of the chart, the first below the others.
    pub series: Vec<Series>,
    /// One metre is as long up as across.
    pub equal: bool,
    /// Words at points, so many pixels above them.
    pub labels: Vec<((f64, f64), String, i32)>,
}

impl Chart {
    /// True if the chart draws a series that looks like this entry of a legend.
    pub fn shows(&self, entry: &Series) -> bool {
        let frame = Frame::new(self.x.ends(), self.y.ends());
        let alike = |series: &&Series| series.colour == entry.colour && series.mark.is_like(entry.mark);
        self.series.iter().filter(alike).any(|series| match series.mark {
            mark if mark.is_line() => !frame.pieces(&series.points).is_empty(),
            Mark::Bars(_) | Mark::Band | Mark::Tile(..) => !series.points.is_empty(),
            _ => series.points.iter().any(|point| frame.holds(*point)),
        })
    }

    /// Axes with series, without labels of its own.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        Self { title: title.into(), x, y, series, equal: false, labels: Vec::new() }
    }
}

impl Series {
    /// Leaves as many points as are drawn where so many series of marks share a chart; bars and tiles are all
    /// drawn.
    pub fn thin(&mut self, clouds: usize) {
        if !matches!(self.mark, Mark::Bars(_) | Mark::Tile(..)) {
            self.points = thinned(&self.points, self.mark, self.mark.most_points(clouds));
        }
    }

    /// True if the points are separate marks.
    pub(super) fn is_cloud(&self) -> bool {
        self.mark.is_cloud()
    }
}

impl Mark {
    /// True if a legend shows both marks alike.
    fn is_like(self, other: Self) -> bool {
        match (self, other) {
            (Self::Bars(_), Self::Bars(_)) | (Self::Tile(..), Self::Tile(..)) => true,
            _ => self == other,
        }
    }

    /// True if the mark joins its points.
    pub(super) fn is_line(self) -> bool {
        matches!(self, Self::Line | Self::Dash | Self::Dashes(..))
    }

    fn is_cloud(self) -> bool {
        matches!(self, Self::Dots | Self::Rings | Self::Small(_))
    }

    /// Points with which a series of it is drawn where so many series of marks share a chart.
    fn most_points(self, clouds: usize) -> usize {
        if self.is_cloud() { (MOST_MARKS / clouds.max(1)).clamp(100, MOST_POINTS) } else { MOST_POINTS }
    }
}

/// Ends of a range of numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    low: f64,
    high: f64,
}

impl Ends {
    /// Ends of an empty range.
    pub fn none() -> Self {
        Self { low: f64::INFINITY, high: f64::NEG_INFINITY }
    }

    /// Counts a number in that is finite.
    pub fn add(&mut self, value: f64) {
        if value.is_finite() {
            *self = Self { low: self.low.min(value), high: self.high.max(value) };
        }
    }

    /// Counts others in.
    pub fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Values of both ends, if there is a number: an axis around all numbers is one around these.
    pub fn values(self) -> impl Iterator<Item = f64> {
        [self.low, self.high].into_iter().filter(move |_| self.low <= self.high)
    }
}

/// The points of a series that are drawn, of however many, and the ends of all.
pub(super) struct Shown {
    pub points: Vec<(f64, f64)>,
    pub x: Ends,
    pub y: Ends,
    /// Number of all points that are finite.
    pub count: usize,
}

impl Shown {
    /// Points of `each`, which is called whenever they are needed, for one series of marks in the chart.
    ///
    /// # Errors
    ///
    /// Errors of `each`.
    pub fn of<E>(mark: Mark, each: impl Fn(&mut dyn FnMut(f64, f64)) -> Result<(), E>) -> Result<Self, E> {
        Self::among(1, mark, each)
    }

    /// Points of `each` for a chart with `clouds` series of marks.
    ///
    /// # Errors
    ///
    /// Errors of `each`.
    pub fn among<E>(
        clouds: usize,
        mark: Mark,
        each: impl Fn(&mut dyn FnMut(f64, f64)) -> Result<(), E>,
    ) -> Result<Self, E> {
        let (mut x, mut y, mut count) = (Ends::none(), Ends::none(), 0);
        each(&mut |a, b| {
            x.add(a);
            y.add(b);
            count += usize::from(a.is_finite() && b.is_finite());
        })?;
        let mut thinner = Thinner::new(mark, mark.most_points(clouds), count);
        each(&mut |a, b| thinner.add((a, b)))?;
        Ok(Self { points: thinner.points(), x, y, count })
    }
}

/// Largest number of points of a drawn series.
const MOST_POINTS: usize = 1000;
/// Largest number of marks of a run's chart over all series. More marks would cover the chart.
const MOST_MARKS: usize = 4000;

/// Few enough points to draw. Of a line, the lowest and the highest of each run of neighbours, so that no
/// spike is lost; of separate marks, every so many, so that their density stays true.
fn thinned(points: &[(f64, f64)], mark: Mark, most: usize) -> Vec<(f64, f64)> {
    let count = points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()).count();
    let mut thinner = Thinner::new(mark, most, count);
    points.iter().for_each(|point| thinner.add(*point));
    thinner.points()
}

/// [`thinned`] of points that come one after the other.
struct Thinner {
    is_line: bool,
    /// Neighbours of which the extremes of a line or the first of separate marks stay.
    run: usize,
    /// Finite points so far.
    seen: usize,
    /// Numbers and points of the lowest and the highest of the newest run.
    extremes: Option<[(usize, (f64, f64)); 2]>,
    points: Vec<(f64, f64)>,
}

impl Thinner {
    /// A thinner for `count` finite points.
    fn new(mark: Mark, most: usize, count: usize) -> Self {
        let is_line = mark.is_line() && count > most;
        let run = match count <= most {
            true => 1,
            false if is_line => count.div_ceil(most / 2),
            false => count.div_ceil(most),
        };
        Self { is_line, run, seen: 0, extremes: None, points: Vec::new() }
    }

    fn add(&mut self, point: (f64, f64)) {
        if !point.0.is_finite() || !point.1.is_finite() {
            return;
        }
        let begins = self.seen.is_multiple_of(self.run);
        let new = (self.seen, point);
        self.seen += 1;
        if !self.is_line {
            self.points.extend(begins.then_some(point));
            return;
        }
        if begins {
            self.close();
        }
        // Of equal ones the first is the lowest and the last the highest.
        self.extremes = Some(self.extremes.map_or([new, new], |[low, high]| {
            [
                if point.1.total_cmp(&low.1.1).is_lt() { new } else { low },
                if point.1.total_cmp(&high.1.1).is_ge() { new } else { high },
            ]
        }));
    }

    /// Ends a run of a line.
    fn close(&mut self) {
        if let Some([low, high]) = self.extremes.take() {
            let pair = if low.0 <= high.0 { [low.1, high.1] } else { [high.1, low.1] };
            self.points.extend(pair);
        }
    }

    fn points(mut self) -> Vec<(f64, f64)> {
        self.close();
        self.points
    }
}

/// The points with which a series is drawn, whoever made it.
pub(super) fn drawn(series: &Series) -> Vec<(f64, f64)> {
    thinned(&series.points, series.mark, MOST_POINTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_a_line_s_spikes_and_the_density_of_marks() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|n| (f64::from(n), 0.0)).collect();
        points[54_321].1 = 9.0;
        points[54_400].1 = -9.0;
        let dots = thinned(&points, Mark::Dots, MOST_POINTS);
        assert!(dots.len() <= MOST_POINTS && dots.iter().filter(|point| point.1 != 0.0).count() <= 1);
        let few = thinned(&points, Mark::Line, MOST_POINTS);
        assert!(few.len() <= MOST_POINTS + 2);
        assert!(few.contains(&(54_321.0, 9.0)) && few.contains(&(54_400.0, -9.0)));
        assert!(few.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        // Points that come one after the other are thinned alike, and what is thin stays as it is.
        for (mark, thin) in [(Mark::Line, few), (Mark::Dots, dots)] {
            let each = |see: &mut dyn FnMut(f64, f64)| {
                points.iter().for_each(|(x, y)| see(*x, *y));
                Ok::<(), ()>(())
            };
            let shown = Shown::of(mark, each).unwrap();
            assert_eq!(shown.points, thin);
            assert_eq!(shown.y.values().collect::<Vec<_>>(), [-9.0, 9.0]);
            assert_eq!(thinned(&thin, mark, MOST_POINTS), thin);
        }
    }
}
