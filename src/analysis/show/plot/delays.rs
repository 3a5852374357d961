//! True atmospheric delays of each satellite's code.

use crate::error::JudgeError;
use crate::read::Emission;
use crate::show::plot::canvas::{Axis, Chart, Series, WIDTH_PX};
use crate::show::plot::chart::{Ends, Shown};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;
use gnss::record::SkyRow;

/// Slant delays over time, satellite by satellite: ionosphere above, troposphere below.
pub fn delays(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let run = judged.run;
    let chart = |title: &str, of: fn(&SkyRow) -> f64| {
        let (mut series, mut ends, mut times) = (Vec::new(), Ends::none(), Ends::none());
        ends.add(0.0);
        for (index, sv) in run.in_the_sky().into_iter().enumerate() {
            let mut one = Series::lined(sv.to_string(), index, Vec::new());
            let shown = Shown::of(one.mark, |see| {
                run.seen(sv, |row| see(run.time_s(row.sample), of(&row))).map(|_: Vec<()>| ())
            })?;
            (ends, times) = (ends.with(shown.y), times.with(shown.x));
            one.points = shown.points;
            series.push(one);
        }
        let x = judged.time_axis(times.values());
        Ok::<_, JudgeError>(Chart::new(title, x, Axis::around("slant delay (m)", ends.values(), 1.0), series))
    };
    let mut carriers = Emission::all(run.truth.keys()).into_iter();
    let first = carriers.next().map(|one| one.carrier_hz() / 1e6).filter(|_| carriers.next().is_none());
    let on = first.map_or(" on a satellite's first carrier".to_owned(), |mhz| format!(" at {mhz:.2} MHz"));
    let charts = [
        chart(&format!("Ionosphere{on}, as it is"), |row| row.ionosphere_m)?,
        chart("Troposphere, as it is", |row| row.troposphere_m)?,
    ];
    let names: Vec<Series> = run
        .in_the_sky()
        .into_iter()
        .enumerate()
        .map(|(index, sv)| Series::lined(sv.to_string(), index, Vec::new()))
        .collect();
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 2, charts, names)))
}
