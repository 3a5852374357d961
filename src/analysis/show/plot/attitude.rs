//! Errors of attitudes by the elements of an array, over time.

use crate::error::JudgeError;
use crate::measure::attitude::{AttitudeError, errors};
use crate::show::plot::canvas::{Axis, Chart, GREY, Mark, Series, WIDTH_PX};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;

/// Deviations within which 95 % of the errors lie.
const SIGMAS: f64 = 1.96;

/// Rotation errors about three axes between the stated deviations; `None` without attitudes.
pub fn attitude(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let errors = errors(judged.run)?;
    if errors.is_empty() {
        return Ok(None);
    }
    let time_s = |sample: u64| judged.run.time_s(sample);
    let ends = (time_s(errors[0].sample), errors.last().map_or(1.0, |last| time_s(last.sample)));
    let chart = |(axis, name): (usize, &str)| {
        let points = |of: &dyn Fn(f64, f64) -> f64| -> Vec<(f64, f64)> {
            let point =
                |error: &AttitudeError| (time_s(error.sample), of(error.turned_deg[axis], error.sigma_deg[axis]));
            errors.iter().map(point).collect()
        };
        let most = errors.iter().map(|error| error.turned_deg[axis].abs().max(SIGMAS * error.sigma_deg[axis]));
        let most = 1.1 * most.fold(0.0, f64::max);
        let series = vec![
            Series::numbered("error".to_owned(), 0, points(&|error, _| error)),
            Series::new("", GREY, Mark::Line, points(&|_, sigma| SIGMAS * sigma)),
            Series::new("", GREY, Mark::Line, points(&|_, sigma| -SIGMAS * sigma)),
        ];
        let axes = (Axis::new("time (s)", ends), Axis::new("error (deg)", (-most, most)));
        Chart::new(format!("Rotation about {name}"), axes.0, axes.1, series)
    };
    let names = ["the axis to the east", "the axis to the north", "the upward axis"];
    let charts: Vec<Chart> = names.into_iter().enumerate().map(chart).collect();
    let stated = Series::new("stated ±1.96 σ", GREY, Mark::Line, Vec::new());
    let legend = vec![Series::numbered("error".to_owned(), 0, Vec::new()), stated];
    Ok(Some(Sketch::charts((WIDTH_PX, 250 * charts.len() as u32), 1, charts, legend)))
}
