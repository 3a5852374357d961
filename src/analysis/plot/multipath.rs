//! What reflected rays do: the code errors that follow them, and the fading of their sum.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use crate::analysis::plot::Judged;
use crate::analysis::plot::canvas::{Drawing, Failure, WIDTH_PX, compose};
use crate::analysis::plot::signals::{Points, legend, over_time, per_satellite};
use crate::gnss::satellite::Sv;

/// Code errors over time, and the amplitude of all rays against the direct one.
pub fn multipath(judged: &Judged<'_>) -> Result<Option<Drawing>, Failure> {
    if judged.run.rays.is_empty() {
        return Ok(None);
    }
    // Phasors of the echoes, summed at each instant.
    let mut sums: BTreeMap<Sv, BTreeMap<u64, (f64, f64)>> = BTreeMap::new();
    for ray in &judged.run.rays {
        let sum = sums.entry(ray.sv).or_default().entry(ray.sample).or_insert((1.0, 0.0));
        let (sin, cos) = libm::sincos(TAU * ray.phase_cycles);
        sum.0 += ray.amplitude_ratio * cos;
        sum.1 += ray.amplitude_ratio * sin;
    }
    let errors = per_satellite(judged, |row| row.code_m);
    let fading: Vec<(String, Points)> = errors
        .iter()
        .map(|(name, _)| {
            let own = sums.iter().filter(|(sv, _)| sv.to_string() == *name).flat_map(|(_, of)| of);
            let points =
                own.map(|(sample, (re, im))| (judged.run.time_s(*sample), 20.0 * libm::log10(libm::hypot(*re, *im))));
            (name.clone(), points.collect())
        })
        .collect();
    let charts = [
        over_time(judged, "Code error", "error (m)", 0.1, &errors),
        over_time(judged, "All rays against the direct one", "amplitude (dB)", 1.0, &fading),
    ];
    let names = legend(errors.iter().map(|(name, _)| name.clone()));
    compose((WIDTH_PX, 340), 2, &charts, &names).map(Some)
}
