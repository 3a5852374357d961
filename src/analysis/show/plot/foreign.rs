//! A foreign receiver's errors: observables and clock, and positions, in the style of a run's pictures.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::JudgeError;
use crate::judge::foreign::Judged;
use crate::judge::foreign::measured::ObservationError;
use crate::read::Run;
use crate::show::plot::canvas::{Axis, BLUE, Chart, GREEN, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::dome::NARROW;
use crate::show::plot::drawing::{Failure, PNG_SCALE};
use crate::show::plot::position::{Plan, chart_of, narrow_of};
use crate::show::plot::sketch::{Figure, Sketch};
use crate::show::plot::sky::sketch_of;
use crate::statistics::{mean, percentile};

type Points = Vec<(f64, f64)>;

/// Draws what there is to draw into a directory.
pub(crate) fn all(directory: &Path, judged: &Judged) -> Result<Vec<Figure>, JudgeError> {
    let sketches =
        [("foreign_observables", OBSERVABLES, observables(judged)), ("foreign_position", POSITION, position(judged)?)];
    let mut figures = Vec::new();
    for (name, caption, sketch) in sketches {
        let Some(sketch) = sketch else { continue };
        let path = directory.join(name).with_extension("png");
        let failed = |error: Failure| JudgeError::Plot { path: path.clone(), reason: error.to_string() };
        let figure = Figure::new(name, sketch, caption).map_err(failed)?;
        figure.drawing.write_png(&path, PNG_SCALE)?;
        figures.push(figure);
    }
    Ok(figures)
}

const OBSERVABLES: &str = "Errors of the receiver's observables against the truth over its own time. What all \
                           satellites share at an epoch is the clock's and removed; the clock stands below.";
const POSITION: &str = "Errors of the receiver's positions over its own time, and horizontal errors.";

/// A chart over the times of its points.
fn over_time(title: &str, label: &str, least: f64, series: Vec<Series>) -> Chart {
    let points = || series.iter().flat_map(|series| series.points.iter());
    let values: Vec<f64> = points().map(|point| point.1).collect();
    let [low, high] = [0.002, 0.998].map(|p| percentile(&values, p).unwrap_or(0.0));
    let y = Axis::around(label, [low, high].into_iter(), least.max(1.3 * (high - low)));
    let (from, to) = points().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
    let x = Axis::new("receiver's time since the truth began (s)", if from <= to { (from, to) } else { (0.0, 1.0) });
    let outside = values.iter().filter(|value| value.is_finite() && !y.holds(**value)).count();
    let total = values.len();
    let title = if outside > 0 { format!("{title} ({outside} of {total} points outside)") } else { title.to_owned() };
    Chart::new(title, x, y, series)
}

fn per_satellite(rows: &[ObservationError], of: fn(&ObservationError) -> Option<f64>) -> Vec<Series> {
    let mut found: BTreeMap<&str, Points> = BTreeMap::new();
    for row in rows {
        let points = found.entry(&row.sv).or_default();
        points.extend(of(row).map(|value| (row.label_s, value)));
    }
    found.into_iter().enumerate().map(|(index, (sv, points))| Series::numbered(sv.to_owned(), index, points)).collect()
}

fn observables(judged: &Judged) -> Option<Sketch> {
    let measured = judged.observables.as_ref()?;
    let rows = &measured.rows;
    let clock: Points = measured.clock.iter().map(|row| (row.label_s, row.bias_s)).collect();
    let middle_s = mean(&clock.iter().map(|point| point.1).collect::<Vec<_>>()).unwrap_or(0.0);
    let clock = clock.into_iter().map(|(time, bias_s)| (time, (bias_s - middle_s) * 1e9)).collect();
    let charts = [
        over_time(
            "Code error, the epoch's common part removed",
            "error (m)",
            0.1,
            per_satellite(rows, |row| row.code_m),
        ),
        over_time(
            "Carrier error, common part and a constant removed",
            "error (cycles)",
            0.01,
            per_satellite(rows, |row| row.carrier_cycles),
        ),
        over_time("Doppler error, common part removed", "error (Hz)", 0.1, per_satellite(rows, |row| row.doppler_hz)),
        over_time("C/N0 measured minus expected", "difference (dB)", 1.0, per_satellite(rows, |row| row.cn0_db)),
        over_time(
            &format!("Clock in the pseudoranges about {:+.4} µs", middle_s * 1e6),
            "clock (ns)",
            1.0,
            vec![Series::new("clock", BLUE, Mark::Dots, clock)],
        ),
    ];
    let legend: Vec<Series> = per_satellite(rows, |_| None);
    Some(Sketch::charts((WIDTH_PX, 900), 1, charts, legend))
}

/// Sky with the satellites that the file observes, and horizontal errors, for the report's first page.
pub(crate) fn front(run: &Run, judged: &Judged) -> Result<[Sketch; 2], JudgeError> {
    let rows = judged.observables.iter().flat_map(|measured| &measured.rows);
    let observed = rows.map(|row| row.link.sv).collect();
    let places = judged.places.iter().flat_map(|places| &places.rows);
    let errors = narrow_of(places.map(|row| (row.east_m, row.north_m)))?;
    Ok([sketch_of(run, &observed, NARROW)?, errors])
}

fn position(judged: &Judged) -> Result<Option<Sketch>, JudgeError> {
    let Some(places) = &judged.places else { return Ok(None) };
    let over = |of: fn(&crate::judge::foreign::place::FixError) -> f64| -> Points {
        places.rows.iter().map(|row| (row.label_s, of(row))).collect()
    };
    let errors = vec![
        Series::new("east", BLUE, Mark::Dots, over(|row| row.east_m)),
        Series::new("north", ORANGE, Mark::Dots, over(|row| row.north_m)),
        Series::new("up", GREEN, Mark::Dots, over(|row| row.up_m)),
    ];
    let Plan { chart, legend, .. } = chart_of(places.rows.iter().map(|row| (row.east_m, row.north_m)))?;
    let legend = [errors.clone(), legend].concat();
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 2, [over_time("Position error", "error (m)", 0.5, errors), chart], legend)))
}
