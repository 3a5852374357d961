//! Directions of the satellites and their received strength.

use std::collections::BTreeSet;

use crate::error::JudgeError;
use crate::read::Run;
use crate::show::plot::dome::{Dome, NARROW, Sky, Track, WIDE};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;
use crate::statistics::mean;
use gnss::satellite::Sv;

/// Polar plot: north up, zenith in the middle, tracks ending in a labelled dot whose colour is the mean C/N0
/// as set; a satellite that the receiver did not observe is hollow.
pub fn sky(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    sketch(judged, WIDE).map(Some)
}

/// Sketch of the sky, half as wide as a page's text.
pub fn narrow(judged: &Judged<'_>) -> Result<Sketch, JudgeError> {
    sketch(judged, NARROW)
}

fn sketch(judged: &Judged<'_>, dome: Dome) -> Result<Sketch, JudgeError> {
    let observed = judged.errors.signals.keys().map(|link| link.sv).collect();
    sketch_of(judged.run, &observed, dome)
}

/// Sky of a scene with the satellites that a receiver observed.
pub(super) fn sketch_of(run: &Run, observed: &BTreeSet<Sv>, dome: Dome) -> Result<Sketch, JudgeError> {
    let mut tracks = Vec::new();
    for sv in run.in_the_sky() {
        let mut places: Vec<(i32, i32)> = run.seen(sv, |row| dome.place(row.azimuth_deg, row.elevation_deg))?;
        places.dedup();
        let cn0: Vec<f64> = run.expected.iter().filter(|one| one.sv == sv).map(|one| one.cn0_mean_dbhz).collect();
        tracks.push(Track { sv, places, cn0_dbhz: mean(&cn0), observed: observed.contains(&sv) });
    }
    let skyline_deg = run.scene.skyline_deg.clone();
    Ok(Sketch::Sky(Sky { dome, tracks, skyline_deg }))
}
