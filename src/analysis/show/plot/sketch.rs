//! Content of pictures before they are drawn: charts with no more points than the eye can resolve.

use super::canvas::compose;
use super::chart::{Chart, Mark, Series};
use super::dome::Sky;
use super::drawing::{Drawing, Failure};

/// Content of a picture, with no more points than are drawn. Its source data can be released before it is
/// drawn.
#[derive(Clone, Debug)]
pub enum Sketch {
    /// Charts, so many a row, with one legend below all of them.
    Charts {
        /// Width and height, pixels.
        size: (u32, u32),
        /// Charts in a row.
        columns: usize,
        /// Charts, row by row.
        charts: Vec<Chart>,
        /// Series that are named.
        legend: Vec<Series>,
    },
    /// Satellites above the horizon.
    Sky(Sky),
}

impl Sketch {
    /// Charts, `columns` a row, with one legend below all of them.
    pub fn charts(
        size: (u32, u32),
        columns: usize,
        charts: impl Into<Vec<Chart>>,
        legend: impl Into<Vec<Series>>,
    ) -> Self {
        let mut charts: Vec<Chart> = charts.into();
        for chart in &mut charts {
            let clouds = chart.series.iter().filter(|series| series.is_cloud()).count();
            chart.series.iter_mut().for_each(|series| series.thin(clouds));
        }
        // What no chart shows is not named.
        let mut legend: Vec<Series> = legend.into();
        legend.retain(|entry| charts.iter().any(|chart| chart.shows(entry)));
        Self::of(size, columns, charts, legend)
    }

    /// Charts with every point and every entry of the legend that they have.
    pub fn of(size: (u32, u32), columns: usize, charts: Vec<Chart>, mut legend: Vec<Series>) -> Self {
        legend.iter_mut().for_each(|series| series.points = Vec::new());
        Self::Charts { size, columns, charts, legend }
    }

    /// True if the picture has data. Crosses, which are true positions, and lines between two points, which
    /// are limits, are none.
    pub fn has_data(&self) -> bool {
        let Self::Charts { charts, .. } = self else { return true };
        charts.iter().flat_map(|chart| &chart.series).any(|series| match series.mark {
            Mark::Cross => false,
            mark if mark.is_line() => series.points.len() > 2,
            _ => !series.points.is_empty(),
        })
    }

    /// The picture.
    ///
    /// # Errors
    /// Errors of the drawing library.
    pub fn draw(&self) -> Result<Drawing, Failure> {
        match self {
            Self::Charts { size, columns, charts, legend } => compose(*size, *columns, charts, legend),
            Self::Sky(sky) => sky.draw(),
        }
    }
}

/// A picture in a report: drawn for paper, and its content for a page.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of the picture's file, without an ending.
    pub name: String,
    /// Drawing as wide as the text, or half as wide in a pair.
    pub drawing: Drawing,
    /// Content that a page draws.
    pub sketch: Sketch,
    /// Words below it, which say what to look at.
    pub caption: String,
}

impl Figure {
    /// A sketch, drawn for paper.
    ///
    /// # Errors
    /// Errors of the drawing library.
    pub fn new(name: impl Into<String>, sketch: Sketch, caption: impl Into<String>) -> Result<Self, Failure> {
        Ok(Self { name: name.into(), drawing: sketch.draw()?, sketch, caption: caption.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::chart::{Axis, BLUE, ORANGE};
    use super::*;

    #[test]
    fn satellites_share_the_marks_of_a_chart_and_a_line_has_its_own() {
        let points: Vec<(f64, f64)> = (0..5000).map(|n| (f64::from(n), 1.0)).collect();
        let series = |index: usize| Series::numbered(index.to_string(), index, points.clone());
        let mut all: Vec<Series> = (0..10).map(series).collect();
        all.push(Series::new("line", BLUE, Mark::Line, points.clone()));
        let axis = || Axis::new("", (0.0, 1.0));
        let legend = all.clone();
        let Sketch::Charts { charts, legend, .. } =
            Sketch::charts((100, 100), 1, [Chart::new("", axis(), axis(), all)], legend)
        else {
            panic!("charts were asked for")
        };
        let counts: Vec<usize> = charts[0].series.iter().map(|one| one.points.len()).collect();
        assert!(counts[..10].iter().all(|count| (300..=400).contains(count)), "{counts:?}");
        assert!((900..=1002).contains(&counts[10]), "{counts:?}");
        assert!(legend.len() == 11 && legend.iter().all(|one| one.points.is_empty()));
    }

    #[test]
    fn a_legend_names_what_is_in_view() {
        let axis = || Axis::new("", (0.0, 1.0));
        let line = |colour, y| Series::new("line", colour, Mark::Line, vec![(0.0, y), (1.0, y)]);
        let series =
            vec![line(BLUE, 0.5), line(ORANGE, 7.0), Series::new("dots", ORANGE, Mark::Dots, vec![(0.5, 0.5)])];
        let Sketch::Charts { legend, .. } =
            Sketch::charts((100, 100), 1, [Chart::new("", axis(), axis(), series.clone())], series)
        else {
            panic!("charts were asked for")
        };
        let names: Vec<(&str, Mark)> = legend.iter().map(|entry| (entry.name.as_str(), entry.mark)).collect();
        assert_eq!(names, [("line", Mark::Line), ("dots", Mark::Dots)]);
        assert_eq!(legend[0].colour, BLUE);
    }

    #[test]
    fn limits_and_true_places_are_no_data() {
        let axis = || Axis::new("", (0.0, 1.0));
        let of = |series: Vec<Series>| Sketch::charts((100, 100), 1, [Chart::new("", axis(), axis(), series)], []);
        let line = |count: i32| (0..count).map(|n| (f64::from(n), 0.5)).collect::<Vec<_>>();
        let frame =
            || vec![Series::new("limit", BLUE, Mark::Dash, line(2)), Series::new("truth", BLUE, Mark::Cross, line(1))];
        assert!(!of(frame()).has_data() && !of(Vec::new()).has_data());
        for (mark, count) in [(Mark::Line, 3), (Mark::Dots, 1), (Mark::Bars(1.0), 1)] {
            let with = |count| [frame(), vec![Series::new("", ORANGE, mark, line(count))]].concat();
            assert!(of(with(count)).has_data() && !of(with(0)).has_data(), "{mark:?}");
        }
    }
}
