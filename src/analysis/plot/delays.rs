//! What the atmosphere truly adds to each satellite's code.

use std::collections::BTreeMap;

use crate::analysis::plot::Judged;
use crate::analysis::plot::canvas::{Axis, COLOURS, Chart, Drawing, Failure, Mark, Series, WIDTH_PX, compose};
use crate::gnss::record::SkyRow;
use crate::gnss::satellite::Sv;

/// Slant delays over time, satellite by satellite: ionosphere above, troposphere below.
pub fn delays(judged: &Judged<'_>) -> Result<Option<Drawing>, Failure> {
    let mut tracks: BTreeMap<Sv, Vec<&SkyRow>> = BTreeMap::new();
    for row in &judged.run.sky {
        tracks.entry(row.sv).or_default().push(row);
    }
    let chart = |title: &str, of: fn(&SkyRow) -> f64| {
        let values = judged.run.sky.iter().map(of).chain([0.0]);
        let series = tracks.iter().enumerate().map(|(index, (sv, rows))| {
            let points = rows.iter().map(|row| (judged.run.time_s(row.sample), of(row))).collect();
            line(*sv, index, points)
        });
        let x = judged.time_axis(judged.run.sky.iter().map(|row| judged.run.time_s(row.sample)));
        Chart::new(title, x, Axis::around("slant delay (m)", values, 1.0), series.collect())
    };
    let charts = [
        chart("Ionosphere on L1, as it is", |row| row.ionosphere_m),
        chart("Troposphere, as it is", |row| row.troposphere_m),
    ];
    let names: Vec<Series> = tracks.keys().enumerate().map(|(index, sv)| line(*sv, index, Vec::new())).collect();
    compose((WIDTH_PX, 340), 2, &charts, &names).map(Some)
}

/// A satellite's line, dashed once the colours begin again.
fn line(sv: Sv, index: usize, points: Vec<(f64, f64)>) -> Series {
    let mut series = Series::numbered(sv.to_string(), index, points);
    series.mark = if (index / COLOURS.len()).is_multiple_of(2) { Mark::Line } else { Mark::Dash };
    series
}
