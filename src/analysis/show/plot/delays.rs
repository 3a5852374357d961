//! What the atmosphere truly adds to each satellite's code.

use crate::analysis::error::JudgeError;
use crate::analysis::read::Emission;
use crate::analysis::show::plot::canvas::{Axis, COLOURS, Chart, Mark, Series, WIDTH_PX};
use crate::analysis::show::plot::judged::Judged;
use crate::analysis::show::plot::sketch::Sketch;
use crate::gnss::record::SkyRow;
use crate::gnss::satellite::Sv;

/// Slant delays over time, satellite by satellite: ionosphere above, troposphere below.
pub fn delays(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let run = judged.run;
    let chart = |title: &str, of: fn(&SkyRow) -> f64| {
        let (mut series, mut ends, mut first_s) = (Vec::new(), vec![0.0], f64::INFINITY);
        for (index, sv) in run.in_the_sky().into_iter().enumerate() {
            let points: Vec<(f64, f64)> = run.seen(sv, |row| (run.time_s(row.sample), of(&row)))?;
            first_s = points.iter().map(|point| point.0).fold(first_s, f64::min);
            let values = || points.iter().map(|point| point.1).filter(|value| value.is_finite());
            ends.extend(values().reduce(f64::min).into_iter().chain(values().reduce(f64::max)));
            let mut one = line(sv, index, points);
            one.thin(1);
            series.push(one);
        }
        let x = judged.time_axis(std::iter::once(first_s));
        Ok::<_, JudgeError>(Chart::new(title, x, Axis::around("slant delay (m)", ends.into_iter(), 1.0), series))
    };
    let mut carriers = Emission::all(run.truth.keys()).into_iter();
    let first = carriers.next().map(|one| one.carrier_hz() / 1e6).filter(|_| carriers.next().is_none());
    let on = first.map_or(" on a satellite's first carrier".to_owned(), |mhz| format!(" at {mhz:.2} MHz"));
    let charts = [
        chart(&format!("Ionosphere{on}, as it is"), |row| row.ionosphere_m)?,
        chart("Troposphere, as it is", |row| row.troposphere_m)?,
    ];
    let names: Vec<Series> =
        run.in_the_sky().into_iter().enumerate().map(|(index, sv)| line(sv, index, Vec::new())).collect();
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 2, charts, names)))
}

/// A satellite's line, dashed once the colours begin again.
fn line(sv: Sv, index: usize, points: Vec<(f64, f64)>) -> Series {
    let mut series = Series::numbered(sv.to_string(), index, points);
    series.mark = if (index / COLOURS.len()).is_multiple_of(2) { Mark::Line } else { Mark::Dash };
    series
}
