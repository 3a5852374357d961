//! The pictures of a run, one PNG a question.
//!
//! [`canvas`] wraps the drawing libraries; every other file here says what is drawn. A picture
//! with nothing to show is drawn with empty axes, so that a script finds the files it expects;
//! only `psd.png` depends on `psd.csv` being there, `spoofing.png` on a spoofer and `multipath.png` on `truth/rays.csv`.

pub mod canvas;
mod clock;
mod delays;
mod elevation;
pub(crate) mod foreign;
mod honesty;
mod multipath;
mod position;
mod signals;
mod sky;
mod spectrum;

use std::path::Path;

use rayon::prelude::*;

use crate::analysis::JudgeError;
use crate::analysis::clock::Clock;
use crate::analysis::elevation::Elevations;
use crate::analysis::errors::Errors;
use crate::analysis::honesty::Honesty;
use crate::analysis::load::Run;
use crate::analysis::summary::Summary;

/// Everything that a picture is drawn from.
pub(crate) struct Judged<'a> {
    pub run: &'a Run,
    pub errors: &'a Errors,
    pub clock: &'a Clock,
    pub honesty: &'a Honesty,
    pub elevations: &'a Elevations,
    pub summary: &'a Summary,
}

impl Judged<'_> {
    /// An axis over the times at which there is something, or the whole run if there is nothing.
    fn time_axis(&self, times_s: impl Iterator<Item = f64>) -> canvas::Axis {
        let first_s = times_s.fold(self.run.scene.duration_s, f64::min);
        let end_s = self.run.scene.duration_s;
        // Some room before the first point shows that nothing came before it.
        let from_s = if first_s < end_s { (first_s - 0.05 * (end_s - first_s)).max(0.0) } else { 0.0 };
        canvas::Axis::new("time (s)", (from_s, end_s))
    }
}

/// Draws one picture into a file.
type Picture = fn(&Path, &Judged<'_>) -> Result<(), JudgeError>;

/// The pictures by their file names.
const PICTURES: [(&str, Picture); 17] = [
    ("psd.png", spectrum::psd),
    ("acquisition.png", spectrum::acquisition),
    ("discriminators.png", signals::discriminators),
    ("cn0.png", signals::cn0),
    ("observables.png", signals::observables),
    ("elevation.png", elevation::elevation),
    ("jitter.png", signals::jitter),
    ("multipath.png", multipath::multipath),
    ("sky.png", sky::sky),
    ("delays.png", delays::delays),
    ("position_scatter.png", position::scatter),
    ("position_time.png", position::time),
    ("position_honesty.png", honesty::honesty),
    ("trajectory.png", position::trajectory),
    ("clock_bias.png", clock::bias),
    ("allan.png", clock::stability),
    ("spoofing.png", position::spoofing),
];

/// Draws every picture of a run into its directory.
pub(crate) fn all(directory: &Path, judged: &Judged<'_>) -> Result<(), JudgeError> {
    PICTURES.par_iter().try_for_each(|(name, picture)| picture(&directory.join(name), judged))
}
