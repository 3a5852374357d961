//! What pictures show before they are drawn: charts with no more points than can be told apart.

use super::canvas::{Area, Chart, Failure, Mark, Series, compose};
use super::drawing::Drawing;

/// Draws on a surface whatever it holds.
pub type Drawer = dyn Fn(&Area<'_>) -> Result<(), Failure> + Send + Sync;

/// What a picture shows, with no more points than are drawn: what it was made from can go before it is drawn.
pub enum Sketch {
    /// Charts, so many a row, with one legend below all of them.
    Charts { size: (u32, u32), columns: usize, charts: Vec<Chart>, legend: Vec<Series> },
    /// Anything else.
    Free { size: (u32, u32), draw: Box<Drawer> },
}

impl Sketch {
    /// Charts, `columns` a row, with one legend below all of them.
    pub fn charts(
        size: (u32, u32),
        columns: usize,
        charts: impl Into<Vec<Chart>>,
        legend: impl Into<Vec<Series>>,
    ) -> Self {
        let (mut charts, mut legend): (Vec<Chart>, Vec<Series>) = (charts.into(), legend.into());
        for chart in &mut charts {
            let clouds = chart.series.iter().filter(|series| series.is_cloud()).count();
            chart.series.iter_mut().for_each(|series| series.thin(clouds));
        }
        legend.iter_mut().for_each(|series| series.points = Vec::new());
        Self::Charts { size, columns, charts, legend }
    }

    /// The picture.
    ///
    /// # Errors
    /// Whatever the drawing library reports.
    pub fn draw(&self) -> Result<Drawing, Failure> {
        match self {
            Self::Charts { size, columns, charts, legend } => compose(*size, *columns, charts, legend),
            Self::Free { size, draw } => Drawing::new(*size, draw),
        }
    }
}

impl Series {
    /// Leaves as many points as are drawn where so many series of marks share a chart; bars and tiles are all drawn.
    pub fn thin(&mut self, clouds: usize) {
        if !matches!(self.mark, Mark::Bars(_) | Mark::Tile(..)) {
            let most = if self.is_cloud() { (MOST_MARKS / clouds.max(1)).clamp(100, MOST_POINTS) } else { MOST_POINTS };
            self.points = thinned(&self.points, self.mark, most);
        }
    }

    /// Whether its points stand alone.
    fn is_cloud(&self) -> bool {
        matches!(self.mark, Mark::Dots | Mark::Rings)
    }
}

/// Most points that a series is drawn with, and most marks that the series of a run's chart have together:
/// they cover it then.
const MOST_POINTS: usize = 1000;
const MOST_MARKS: usize = 4000;

/// Few enough points to draw. Of a line, the lowest and the highest of each run of neighbours, so that no
/// spike is lost; of marks that stand alone, every so many, so that their density stays true.
fn thinned(points: &[(f64, f64)], mark: Mark, most: usize) -> Vec<(f64, f64)> {
    let finite: Vec<(f64, f64)> = points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    if finite.len() <= most {
        return finite;
    }
    if !matches!(mark, Mark::Line | Mark::Dash) {
        return finite.iter().copied().step_by(finite.len().div_ceil(most)).collect();
    }
    let extremes = |run: &[(f64, f64)]| {
        let numbered = || run.iter().enumerate();
        let low = numbered().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let high = numbered().max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let mut pair: Vec<(usize, (f64, f64))> =
            low.into_iter().chain(high).map(|(index, point)| (index, *point)).collect();
        pair.sort_by_key(|(index, _)| *index);
        pair.into_iter().map(|(_, point)| point)
    };
    finite.chunks(finite.len().div_ceil(most / 2)).flat_map(extremes).collect()
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
    }

    #[test]
    fn satellites_share_the_marks_of_a_chart_and_a_line_has_its_own() {
        let points: Vec<(f64, f64)> = (0..5000).map(|n| (f64::from(n), 1.0)).collect();
        let series = |index: usize| Series::numbered(index.to_string(), index, points.clone());
        let mut all: Vec<Series> = (0..10).map(series).collect();
        all.push(Series::new("line", super::super::canvas::BLUE, Mark::Line, points.clone()));
        let axis = || super::super::canvas::Axis::new("", (0.0, 1.0));
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
}
