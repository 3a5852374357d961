//! The pictures of a run, one a question, with the words that go below them.
//!
//! [`canvas`] wraps the drawing library and [`drawing`] what becomes of its SVG; every other file here
//! says what is drawn, as a sketch that holds all it needs: a run's rows are gone before the first picture
//! is drawn. A picture with nothing to show is drawn with empty axes, so that a script finds the files it
//! expects; only `psd.png` and `peaks.png` depend on `psd.csv` and `peaks.csv` being there, `spoofing.png`
//! on a spoofer, `multipath.png` on `truth/rays.csv`, `stanford.png` on `rx/integrity.csv`, `array.png` on
//! a spatial filter and interference, `attitude.png` on `rx/attitude.csv`, `detection.png` on
//! `rx/detection.csv`, and `discriminators.png` on loops.

mod array;
mod attitude;
pub mod canvas;
pub mod chart;
mod clip;
mod clock;
mod consistency;
mod delays;
mod detection;
pub(crate) mod dome;
pub mod drawing;
mod elevation;
pub(crate) mod foreign;
pub(crate) mod jitter;
mod judged;
mod marks;
mod multipath;
mod names;
mod peaks;
mod position;
mod protection;
mod series;
mod signals;
pub mod sketch;
mod sky;
mod spectrum;
pub mod ticks;

use std::path::Path;

use rayon::prelude::*;

use crate::error::JudgeError;
use canvas::Failure;
use drawing::PNG_SCALE;
pub(crate) use judged::{Detail, Judged};
use sketch::{Figure, Sketch};

/// One picture of a run; `None` where the run has nothing of the kind.
type Sketcher = fn(&Judged<'_>) -> Result<Option<Sketch>, JudgeError>;

/// A picture by its name, what to look at in it, and the files with its numbers.
pub(crate) struct Picture {
    /// The PNG's, without its ending.
    pub name: &'static str,
    /// A few words for its content.
    pub title: &'static str,
    pub caption: &'static str,
    /// Relative to the run's directory.
    pub numbers: &'static [&'static str],
    sketch: Sketcher,
}

/// The pictures in the order of the report, where a tall one and a low one share a page.
pub(crate) const PICTURES: [Picture; 22] = [
    Picture {
        name: "sky",
        title: "sky",
        caption: "Sky at the antenna. Each track ends in a dot at its last place, coloured by the mean C/N0 that the \
                  scene sets; a hollow dot was never observed by the receiver.",
        numbers: &["truth/sky.csv", "truth/observations.csv"],
        sketch: sky::sky,
    },
    Picture {
        name: "acquisition",
        title: "search for satellites",
        caption: "Largest statistic of the search for every code with the threshold of the designed false-alarm \
                  probability. A cross marks what the scene has: a bar above the threshold without a cross is a false \
                  acquisition, a cross over a short bar a miss.",
        numbers: &["rx/acquisition.csv"],
        sketch: spectrum::acquisition,
    },
    Picture {
        name: "psd",
        title: "spectrum of the samples",
        caption: "Power spectral density of the samples (Welch, Hann window, half overlap) with the theory of this \
                  scene: main spectra of the codes over their aliases, noise floor, interference. Look for lines or \
                  slopes that theory does not have.",
        numbers: &["psd.csv", "psd_theory.csv"],
        sketch: spectrum::psd,
    },
    Picture {
        name: "peaks",
        title: "correlation peaks",
        caption: "Correlation of up to 40 ms of the samples, in the middle of the run, with each satellite's code \
                  about its true delay, in phase with the prompt. A rounded peak shows the front end's band, a second \
                  one or a bent flank a reflection or a spoofer.",
        numbers: &["peaks.csv"],
        sketch: peaks::peaks,
    },
    Picture {
        name: "cn0",
        title: "C/N0",
        caption: "C/N0 as the receiver estimates it against what the scene sets. Below, the difference: the codes of \
                  the other satellites cost about 1 dB, quantisation up to 1.96 dB with one bit.",
        numbers: &["errors.csv"],
        sketch: signals::cn0,
    },
    Picture {
        name: "discriminators",
        title: "discriminators of the loops",
        caption: "Raw discriminator outputs of the three loops while they track, before any filter. They scatter \
                  more than the loops' errors by the root of the loop's bandwidth; a mean off zero shows dynamic \
                  stress.",
        numbers: &["rx/tracking.csv"],
        sketch: signals::discriminators,
    },
    Picture {
        name: "jitter",
        title: "errors of the loops",
        caption: "Errors of the closed loops, replica minus truth, each satellite about its mean and without the \
                  pull-in, with the normal curve of the same mean and σ. The rules of thumb (d/6, 15°, 1/(12T)) are \
                  bounds for σ, and are drawn where they come near. Satellites of different C/N0 together are more \
                  peaked than normal.",
        numbers: &["histograms.csv", "errors.csv"],
        sketch: jitter::jitter,
    },
    Picture {
        name: "observables",
        title: "errors of the observables",
        caption: "Errors of the observables against the truth. Code and carrier share the delays that the receiver \
                  cannot see; what all satellites share is the clock's and harmless to the position.",
        numbers: &["errors.csv"],
        sketch: signals::observables,
    },
    Picture {
        name: "elevation",
        title: "errors over elevation",
        caption: "Errors of the observables over elevation, and the multipath combination over time: code that errs \
                  more low down, or a combination that swings, is multipath or atmosphere.",
        numbers: &["satellites.csv", "elevation.csv"],
        sketch: elevation::elevation,
    },
    Picture {
        name: "position_scatter",
        title: "horizontal errors",
        caption: "Horizontal errors of the fixes about the truth with the ellipses that would hold 50 % and 95 % of \
                  a normal scatter of the same covariance, and how errors are distributed. A cloud off the cross is \
                  a bias.",
        numbers: &["position.csv"],
        sketch: position::scatter,
    },
    Picture {
        name: "position_time",
        title: "position errors over time",
        caption: "Errors of the fixes over time between the bounds that the receiver's own covariance sets (±1.96 σ).",
        numbers: &["position.csv"],
        sketch: position::time,
    },
    Picture {
        name: "position_consistency",
        title: "position errors beside stated sigmas",
        caption: "Errors between the receiver's own ±2σ, and the normalised error squared (NEES), \
                  whose mean should lie in the band that so many independent fixes allow. Above it the receiver is \
                  optimistic, below pessimistic.",
        numbers: &["consistency.csv"],
        sketch: consistency::consistency,
    },
    Picture {
        name: "trajectory",
        title: "track and height",
        caption: "The horizontal track and the height over time, true and as the receiver found them.",
        numbers: &["truth/trajectory.csv", "rx/fixes.csv"],
        sketch: position::trajectory,
    },
    Picture {
        name: "clock_bias",
        title: "receiver's clock",
        caption: "The receiver's clock: its bias as estimated and as it was with the straight line of least squares, \
                  the difference, and both without their lines.",
        numbers: &["clock.csv"],
        sketch: clock::bias,
    },
    Picture {
        name: "delays",
        title: "delays of the atmosphere",
        caption: "What ionosphere and troposphere truly add to the code of each satellite.",
        numbers: &["truth/sky.csv"],
        sketch: delays::delays,
    },
    Picture {
        name: "allan",
        title: "stability of the clock",
        caption: "Stability of the clock with intervals of 95 %: its estimate, the truth, the error, and what white \
                  noise of code or carrier alone would give.",
        numbers: &["allan.csv"],
        sketch: clock::stability,
    },
    Picture {
        name: "multipath",
        title: "multipath",
        caption: "Code errors beside the fading that reflected rays cause: a code error that follows the fading is \
                  multipath.",
        numbers: &["errors.csv", "truth/rays.csv"],
        sketch: multipath::multipath,
    },
    Picture {
        name: "spoofing",
        title: "positions under spoofing",
        caption: "Where the fixes went between the truth and what the spoofer claims.",
        numbers: &["position.csv", "truth/claimed.csv"],
        sketch: position::spoofing,
    },
    Picture {
        name: "stanford",
        title: "protection levels",
        caption: "Protection level of every fix over its error (Stanford diagram). Below the line through the origin \
                  the error is larger than the level: misleading information, and hazardous to the right of the alert \
                  limit. Above the alert limit the fix is not available.",
        numbers: &["protection.csv"],
        sketch: protection::stanford,
    },
    Picture {
        name: "detection",
        title: "detection of jamming and spoofing",
        caption: "Statistic of every test of the receiver's detectors over its threshold: points above the line are \
                  alarms. Below, where the scene has an attack, the share of attacked tests with an alarm over that \
                  of clean ones, for thresholds from high to low.",
        numbers: &["detection.csv"],
        sketch: detection::detection,
    },
    Picture {
        name: "attitude",
        title: "attitude",
        caption: "Errors of the attitude that the carriers of an array's elements give, as a rotation about three \
                  axes, between the receiver's own ±1.96 σ.",
        numbers: &["rx/attitude.csv"],
        sketch: attitude::attitude,
    },
    Picture {
        name: "array",
        title: "pattern of the array",
        caption: "Gain of the spatial filter over azimuth at 5° of elevation, for each set of jammers that were on, \
                  from the covariance that the scene implies: power over noise against that of the first element. \
                  Dashes are the jammers, and a null belongs on each.",
        numbers: &["truth/scene.json", "rx/receiver.json"],
        sketch: array::array,
    },
];

/// Title of the picture of a name.
pub(crate) fn title(name: &str) -> &str {
    PICTURES.iter().find(|picture| picture.name == name).map_or(name, |picture| picture.title)
}

/// Sky and horizontal errors half as wide as a page's text, for its first page.
pub(crate) fn front(judged: &Judged<'_>) -> Result<[Sketch; 2], JudgeError> {
    Ok([sky::narrow(judged)?, position::narrow(judged)?])
}

/// Names of the pictures that a page magnifies with more points, and shows first.
pub(crate) const ZOOMED: [&str; 3] = ["position_time", "cn0", "observables"];

/// A picture of a run before it is drawn.
pub(crate) struct Sketched {
    pub picture: &'static Picture,
    pub paper: Sketch,
    /// Content with more points, for a page that magnifies them.
    pub screen: Option<Sketch>,
}

/// Content of each picture that a run has; with `pages`, also what a page magnifies.
pub(crate) fn sketches(judged: &Judged<'_>, pages: bool) -> Result<Vec<Sketched>, JudgeError> {
    let magnified = Judged { detail: Detail::Screen, ..*judged };
    let one = |picture: &'static Picture| {
        let Some(paper) = (picture.sketch)(judged)? else { return Ok(None) };
        let screen = if pages && ZOOMED.contains(&picture.name) { (picture.sketch)(&magnified)? } else { None };
        Ok(Some(Sketched { picture, paper, screen }))
    };
    PICTURES.iter().filter_map(|picture| one(picture).transpose()).collect()
}

/// Draws them into the run's directory; the figures of its report.
pub(crate) fn draw(directory: &Path, sketches: Vec<Sketched>) -> Result<Vec<Figure>, JudgeError> {
    let one = |Sketched { picture, paper, screen }: Sketched| {
        let path = directory.join(picture.name).with_extension("png");
        let failed = |error: Failure| JudgeError::Plot { path: path.clone(), reason: error.to_string() };
        let drawing = paper.draw().map_err(failed)?;
        drawing.write_png(&path, PNG_SCALE)?;
        let caption = format!("{} Numbers: {}.", picture.caption, picture.numbers.join(", "));
        Ok(Figure { name: picture.name.to_owned(), drawing, sketch: screen.unwrap_or(paper), caption })
    };
    sketches.into_par_iter().map(one).collect()
}

#[cfg(test)]
mod tests;
