//! Errors of observations over elevation, and the multipath combination over time.

use crate::analysis::elevation::Point;
use crate::analysis::plot::Judged;
use crate::analysis::plot::canvas::{Axis, Chart, Drawing, Failure, Series, WIDTH_PX, compose};
use crate::analysis::plot::signals::{legend, over_time};
use crate::analysis::statistics::percentile;

/// Draws them.
pub fn elevation(judged: &Judged<'_>) -> Result<Option<Drawing>, Failure> {
    let all = &judged.elevations.points;
    let chart = |title: &str, label: &str, least: f64, of: fn(&Point) -> f64| {
        let values: Vec<f64> = all.values().flatten().map(of).collect();
        let [low, high] = [0.002, 0.998].map(|p| percentile(&values, p).unwrap_or(0.0));
        let y = Axis::around(label, [low, high].into_iter(), least.max(1.3 * (high - low)));
        let inside = |point: &&Point| (y.from..=y.to).contains(&of(point));
        let series = all.iter().enumerate().map(|(index, ((sv, _), points))| {
            let shown = points.iter().filter(inside).map(|point| (point.elevation_deg, of(point))).collect();
            Series::numbered(sv.to_string(), index, shown)
        });
        let series = series.collect();
        Chart::new(title, Axis::new("elevation (degrees)", (0.0, 90.0)), y, series)
    };
    let multipath: Vec<(String, Vec<(f64, f64)>)> = all
        .iter()
        .map(|((sv, _), points)| (sv.to_string(), points.iter().map(|p| (p.time_s, p.multipath_m)).collect()))
        .collect();
    let charts = [
        chart("Code error, the epoch's common part removed", "error (m)", 0.1, |point| point.code_m),
        chart("Carrier error", "error (cycles)", 0.01, |point| point.carrier_cycles),
        chart("Doppler error", "error (Hz)", 0.1, |point| point.doppler_hz),
        chart("C/N0 measured minus expected", "difference (dB)", 1.0, |point| point.cn0_db),
        over_time(judged, "Code minus carrier without twice the ionosphere", "combination (m)", 0.1, &multipath),
    ];
    compose((WIDTH_PX, 900), 1, &charts, &legend(all.keys().map(|(sv, _)| sv.to_string()))).map(Some)
}
