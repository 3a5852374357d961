//! Errors of observations over elevation, and the multipath combination over time.

use crate::error::JudgeError;
use crate::measure::elevation::{Point, points};
use crate::show::plot::canvas::{Axis, Chart, WIDTH_PX};
use crate::show::plot::judged::Judged;
use crate::show::plot::signals::{Cloud, Frame, See, legend, observed, over_time};
use crate::show::plot::sketch::Sketch;

/// Draws them.
pub fn elevation(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let links = observed(judged);
    let points = |link, of: &dyn Fn(&Point) -> (f64, f64), see: See<'_>| {
        points(judged.run, (judged.errors, &judged.summary.details.stated), link, |point| {
            let (x, y) = of(&point);
            see(x, y);
            Ok(())
        })
    };
    let chart = |title, y_label, least, of: fn(&Point) -> f64| {
        let of_link = |link, see: See<'_>| points(link, &|point| (point.elevation_deg, of(point)), see);
        let cloud = Cloud::new(judged, &links, &Frame { title, y_label, least }, of_link)?;
        Ok::<_, JudgeError>(Chart::new(title, Axis::new("elevation (degrees)", (0.0, 90.0)), cloud.y, cloud.series))
    };
    let combination =
        Frame { title: "Code minus carrier without twice the ionosphere", y_label: "combination (m)", least: 0.1 };
    let charts = [
        chart("Code error, the epoch's common part removed", "error (m)", 0.1, |point| {
            point.code_m.unwrap_or(f64::NAN)
        })?,
        chart("Carrier error", "error (cycles)", 0.01, |point| point.carrier_cycles)?,
        chart("Doppler error", "error (Hz)", 0.1, |point| point.doppler_hz)?,
        chart("C/N0 measured minus expected", "difference (dB)", 1.0, |point| point.cn0_db)?,
        over_time(judged, &links, &combination, |link, see| {
            points(link, &|point| (point.time_s, point.multipath_m), see)
        })?,
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 900), 1, charts, legend(judged, &links))))
}
