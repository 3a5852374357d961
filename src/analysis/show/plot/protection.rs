//! Stanford diagrams: protection levels over errors, with the regions of misleading information.

use crate::error::JudgeError;
use crate::measure::protection::{Protected, Stanford};
use crate::show::plot::canvas::{Axis, BLUE, Chart, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::chart::Shown;
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;

/// Room beyond the alert limit, as a share of it.
const ROOM: f64 = 1.25;

/// Horizontal and vertical diagram; `None` of a receiver without levels.
pub fn stanford(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let Some(figures) = &judged.protection.figures else { return Ok(None) };
    type Of = fn(&Protected) -> (f64, Option<f64>);
    let axes: [(&str, Option<Stanford>, Of); 2] = [
        ("Horizontal", figures.horizontal, |row| (row.horizontal_m, row.hpl_m)),
        ("Vertical", figures.vertical, |row| (row.vertical_m, row.vpl_m)),
    ];
    let mut charts = Vec::new();
    for (name, diagram, of) in axes {
        let points = Shown::of(Mark::Dots, |see| {
            judged.protection.rows.each(|row| {
                if let (error_m, Some(level_m)) = of(&row) {
                    see(error_m, level_m);
                }
            })
        })?;
        let limit_m = diagram.and_then(|found| found.alert_limit_m);
        let most_m = points.points.iter().map(|point| point.0.max(point.1)).fold(limit_m.unwrap_or(1.0), f64::max);
        // A level of kilometres would hide the others.
        let end_m = limit_m.map_or(most_m, |limit_m| most_m.min(4.0 * limit_m)) * ROOM;
        let shown = points.points.into_iter().filter(|point| point.0 <= end_m && point.1 <= end_m).collect();
        let mut series = vec![
            Series::new("fix", BLUE, Mark::Dots, shown),
            Series::new("error = level", ORANGE, Mark::Line, vec![(0.0, 0.0), (end_m, end_m)]),
        ];
        if let Some(limit_m) = limit_m {
            series.push(Series::new("alert limit", GREY, Mark::Dash, vec![(0.0, limit_m), (end_m, limit_m)]));
            series.push(Series::new("", GREY, Mark::Dash, vec![(limit_m, 0.0), (limit_m, end_m)]));
        }
        let words = diagram.map_or_else(
            || format!("{name}: no levels"),
            |found| {
                format!(
                    "{name}: {} nominal, {} misleading, {} hazardous, {} unavailable, {} without a level",
                    found.nominal,
                    found.misleading + found.unavailable_misleading,
                    found.hazardous,
                    found.unavailable + found.unavailable_misleading,
                    figures.fixes.saturating_sub(found.fixes)
                )
            },
        );
        let (x, y) = (Axis::new("error (m)", (0.0, end_m)), Axis::new("protection level (m)", (0.0, end_m)));
        charts.push(Chart::new(words, x, y, series));
    }
    let legend = [
        Series::new("fix", BLUE, Mark::Dots, Vec::new()),
        Series::new("error = level", ORANGE, Mark::Line, Vec::new()),
        Series::new("alert limit", GREY, Mark::Dash, Vec::new()),
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 700), 1, charts, legend)))
}
