//! Errors of the fixes within twice the sigma that the receiver states, and the normalised error squared.

use crate::error::JudgeError;
use crate::measure::consistency::{FREEDOM, NormalisedError};
use crate::show::plot::canvas::{Axis, BLUE, Chart, GREEN, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::chart::{Ends, SHOWN_BOUNDS, Shown};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;
use crate::statistics::percentile;

/// Draws them.
pub fn consistency(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let found = judged.consistency;
    let mut times = Ends::none();
    found.rows.each(|row| times.add(row.time_s))?;
    let x = judged.time_axis(times.values());
    let over = |mark: Mark, of: &dyn Fn(&NormalisedError) -> f64| {
        Shown::of(mark, |see| found.rows.each(|row| see(row.time_s, of(&row))))
    };
    type Axis3 = (&'static str, fn(&NormalisedError) -> f64, fn(&NormalisedError) -> f64);
    let axes: [Axis3; 3] = [
        ("East", |row| row.east_m, |row| row.sigma_east_m),
        ("North", |row| row.north_m, |row| row.sigma_north_m),
        ("Up", |row| row.up_m, |row| row.sigma_up_m),
    ];
    let mut charts = Vec::new();
    for (name, error, sigma) in axes {
        let error = over(Mark::Dots, &error)?;
        let above = over(Mark::Line, &|row| 2.0 * sigma(row))?;
        let below = over(Mark::Line, &|row| -2.0 * sigma(row))?;
        let mut all = Vec::new();
        found.rows.each(|row| all.push(2.0 * sigma(&row)))?;
        let most = percentile(&all, SHOWN_BOUNDS).unwrap_or(0.0);
        let y =
            Axis::around("error (m)", error.y.values().chain([-most, most]), if error.count > 0 { 0.2 } else { 2.0 });
        let series = vec![
            Series::new("error", BLUE, Mark::Dots, error.points),
            Series::new("formal ±2σ", ORANGE, Mark::Line, above.points),
            Series::new("", ORANGE, Mark::Line, below.points),
        ];
        charts.push(Chart::new(format!("{name} with the receiver's own ±2σ"), x.clone(), y, series));
    }
    let nees = over(Mark::Dots, &|row| row.nees)?;
    let flat = |value: f64| vec![(x.from, value), (x.to, value)];
    let mut series = vec![
        Series::new("normalised error²", BLUE, Mark::Dots, nees.points),
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
    let others = series.iter().flat_map(|s| s.points.iter().map(|p| p.1)).chain([0.0]);
    let y = Axis::around("eᵀP⁻¹e", others.chain(nees.y.values()), 4.0);
    charts.push(Chart::new(words, x, y, series));
    let legend = [
        Series::new("error", BLUE, Mark::Dots, Vec::new()),
        Series::new("±2σ, mean", ORANGE, Mark::Line, Vec::new()),
        Series::new("expected", GREEN, Mark::Dash, Vec::new()),
        Series::new("95 % band", GREY, Mark::Dash, Vec::new()),
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 700), 1, charts, legend)))
}
