//! Pattern of a spatial filter over azimuth, with its nulls.

use crate::error::JudgeError;
use crate::expect::array::patterns;
use crate::show::plot::canvas::{Axis, Chart, GREY, Mark, Series, WIDTH_PX};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;

/// Elevation of the pattern: that of jammers on the ground not far away.
const ELEVATION_DEG: f64 = 5.0;
/// Ends of the gain's axis, in dB.
const ENDS_DB: (f64, f64) = (-50.0, 10.0);

/// Pattern for each set of sources; `None` without a filter or without sources.
pub fn array(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let patterns = patterns(judged.run, ELEVATION_DEG);
    if patterns.is_empty() {
        return Ok(None);
    }
    let mut charts = Vec::new();
    for pattern in patterns {
        let inside = |(azimuth_deg, db): (f64, f64)| (azimuth_deg, db.clamp(ENDS_DB.0, ENDS_DB.1));
        let points = pattern.points.into_iter().map(inside).collect();
        let mut gain = Series::numbered("gain".to_owned(), 0, points);
        gain.mark = Mark::Line;
        let jammers = pattern.from_deg.iter().map(|azimuth_deg| {
            Series::new("", GREY, Mark::Dash, vec![(*azimuth_deg, ENDS_DB.0), (*azimuth_deg, ENDS_DB.1)])
        });
        let series = std::iter::once(gain).chain(jammers).collect();
        let numbers: Vec<String> = pattern.sources.iter().map(ToString::to_string).collect();
        let title = format!("Interference {}", numbers.join(", "));
        let (x, y) = (Axis::new("azimuth (deg)", (0.0, 360.0)), Axis::new("gain (dB)", ENDS_DB));
        charts.push(Chart::new(title, x, y, series));
    }
    let mut gain = Series::numbered("gain".to_owned(), 0, Vec::new());
    gain.mark = Mark::Line;
    let legend = vec![gain, Series::new("jammer", GREY, Mark::Dash, Vec::new())];
    Ok(Some(Sketch::charts((WIDTH_PX, 300 * charts.len() as u32), 1, charts, legend)))
}
