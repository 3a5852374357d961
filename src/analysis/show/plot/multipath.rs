//! Effects of reflected rays: the code errors that follow them, and the fading of their sum.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use crate::error::JudgeError;
use crate::show::plot::canvas::WIDTH_PX;
use crate::show::plot::judged::Judged;
use crate::show::plot::signals::{Frame, legend, observed, of_observations, over_time};
use crate::show::plot::sketch::Sketch;

/// Code errors over time, and the amplitude of all rays against the direct one.
pub fn multipath(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let run = judged.run;
    if run.rays.is_empty() {
        return Ok(None);
    }
    let links = observed(judged);
    let errors = Frame { title: "Code error", y_label: "error (m)", least: 0.1 };
    let fading = Frame { title: "All rays against the direct one", y_label: "amplitude (dB)", least: 1.0 };
    let charts = [
        over_time(judged, &links, &errors, |link, see| of_observations(judged, link, |row| row.code_m, see))?,
        over_time(judged, &links, &fading, |link, see| {
            // Phasors of the echoes, summed at each instant.
            let mut sums: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
            run.rays.each(link, |ray| {
                let sum = sums.entry(ray.sample).or_insert((1.0, 0.0));
                let (sin, cos) = libm::sincos(TAU * ray.phase_cycles);
                sum.0 += ray.amplitude_ratio * cos;
                sum.1 += ray.amplitude_ratio * sin;
            })?;
            let decibels = |(re, im): (f64, f64)| 20.0 * libm::log10(libm::hypot(re, im));
            sums.into_iter().for_each(|(sample, sum)| see(run.time_s(sample), decibels(sum)));
            Ok(())
        })?,
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 2, charts, legend(judged, &links))))
}
