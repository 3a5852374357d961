//! Errors of the fixes within twice the sigma that the receiver states, and the normalised error squared.

use crate::analysis::error::JudgeError;
use crate::analysis::measure::consistency::{FREEDOM, NormalisedError};
use crate::analysis::show::plot::canvas::{Axis, BLUE, Chart, GREEN, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::analysis::show::plot::judged::Judged;
use crate::analysis::show::plot::sketch::Sketch;

type Points = Vec<(f64, f64)>;

/// Draws them.
pub fn consistency(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let found = judged.consistency;
    let x = judged.time_axis(found.rows.iter().map(|row| row.time_s));
    let over = |of: &dyn Fn(&NormalisedError) -> f64| -> Points {
        found.rows.iter().map(|row| (row.time_s, of(row))).collect()
    };
    type Axis3 = (&'static str, fn(&NormalisedError) -> f64, fn(&NormalisedError) -> f64);
    let axes: [Axis3; 3] = [
        ("East", |row| row.east_m, |row| row.sigma_east_m),
        ("North", |row| row.north_m, |row| row.sigma_north_m),
        ("Up", |row| row.up_m, |row| row.sigma_up_m),
    ];
    let mut charts: Vec<Chart> = axes
        .into_iter()
        .map(|(name, error, sigma)| {
            let series = vec![
                Series::new("error", BLUE, Mark::Dots, over(&error)),
                Series::new("formal ±2σ", ORANGE, Mark::Line, over(&|row| 2.0 * sigma(row))),
                Series::new("", ORANGE, Mark::Line, over(&|row| -2.0 * sigma(row))),
            ];
            let y = Axis::around("error (m)", series.iter().flat_map(|s| s.points.iter().map(|p| p.1)), 0.2);
            Chart::new(format!("{name} with the receiver's own ±2σ"), x.clone(), y, series)
        })
        .collect();
    let nees = over(&|row| row.nees);
    let flat = |value: f64| vec![(x.from, value), (x.to, value)];
    let mut series = vec![
        Series::new("normalised error²", BLUE, Mark::Dots, nees),
        Series::new("expected", GREEN, Mark::Dash, flat(FREEDOM)),
        Series::new("mean", ORANGE, Mark::Line, found.nees_mean.map(flat).unwrap_or_default()),
    ];
    for end in found.band.into_iter().flat_map(|(low, high)| [low, high]) {
        series.push(Series::new("", GREY, Mark::Dash, flat(end)));
    }
    let words = match (found.nees_mean, found.band, found.independent) {
        (Some(mean), Some((low, high)), Some(independent)) => format!(
            "Normalised error squared: mean {mean:.2}, 95 % band {low:.2} to {high:.2} of {independent:.0} \
             independent fixes"
        ),
        _ => "Normalised error squared: no fixes".to_owned(),
    };
    let y = Axis::around("eᵀP⁻¹e", series.iter().flat_map(|s| s.points.iter().map(|p| p.1)).chain([0.0]), 4.0);
    charts.push(Chart::new(words, x, y, series));
    let legend = [
        Series::new("error", BLUE, Mark::Dots, Vec::new()),
        Series::new("±2σ, mean", ORANGE, Mark::Line, Vec::new()),
        Series::new("expected", GREEN, Mark::Dash, Vec::new()),
        Series::new("95 % band", GREY, Mark::Dash, Vec::new()),
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 700), 1, charts, legend)))
}
