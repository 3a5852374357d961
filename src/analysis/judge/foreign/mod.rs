//! Judging a receiver that this project did not write and that was fed this project's samples.
//!
//! It is known by its files alone: observations in RINEX ([`crate::read::rinex_obs`]), positions
//! in NMEA ([`crate::read::nmea`]). They are joined with the truth by GPS time ([`timeline`]),
//! since a foreign receiver knows nothing of sample numbers. [`observables`] and [`place`] measure;
//! [`report`] names the biases. A receiver that took its week for one 1024 weeks off is moved back, and the
//! report says so. Results: `foreign.json`, `foreign_{observations,satellites,clock,slips,fixes}.csv` and
//! pictures.

mod carriers;
mod fit;
mod judged;
pub mod measured;
pub mod observables;
mod pairs;
pub mod place;
pub mod report;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::JudgeError;
use crate::expect::due::receiver::front_end_costs_db;
use crate::expect::timeline;
use crate::read::{Fault, Run, nmea, rinex_obs};
use gnss::time::{Epoch, WEEK_S};

pub use fit::Estimate;
pub(in crate::judge) use fit::slope;
pub use judged::Judged;
pub use report::{FIGURES, ForeignSummary};

/// The files of a receiver under test.
#[derive(Clone, Debug, Default)]
pub struct Files {
    /// Observations, RINEX 2.11, 3 or 4, also compressed.
    pub rinex_obs: Option<PathBuf>,
    /// Positions, NMEA 0183.
    pub nmea: Option<PathBuf>,
}

/// 1024 weeks, the period of the week number in GPS's legacy message.
const ROLLOVER_S: i64 = 1024 * WEEK_S;
/// Labels may be off by this much, or they are of another day.
const NEAR_S: f64 = 86_400.0;

/// Judges a receiver's files against the truth in a directory.
///
/// # Errors
/// [`JudgeError::Line`] with the first line of a file that is not as its format has it, and
/// [`JudgeError::NotOfThisTruth`] for files of another time.
pub fn judge(truth: &Path, files: &Files) -> Result<Judgement, JudgeError> {
    let run = Run::read_truth(truth)?;
    let timeline = timeline::Timeline::new(&run)?.ok_or_else(|| JudgeError::NotOfThisTruth {
        path: truth.join("trajectory.csv"),
        what: "no rows: expected the antenna's motion".to_owned(),
    })?;
    let mut judged = Judged {
        scene: run.scene.name.clone(),
        receiver: None,
        truth_interval_s: timeline.interval_s(),
        interpolation: timeline.interpolation,
        sampler_drift: run.trajectory.first().map_or(0.0, |row| row.clock_drift),
        rollover_s: [0; 2],
        observables: None,
        places: None,
        labels_late_s: None,
        separations_assumed: 0,
    };
    if let Some(path) = &files.rinex_obs {
        let read = rinex_obs::read(&bytes(path)?).map_err(|fault| line(path, fault))?;
        judged.receiver = Some(read.receiver).filter(|name| !name.is_empty());
        let labels: Vec<Epoch> = read.epochs.iter().map(|epoch| epoch.label).collect();
        judged.rollover_s[0] = rollover(&labels, &timeline).ok_or_else(|| elsewhere(path, &labels, &timeline))?;
        let costs_db = front_end_costs_db(&run);
        let mut measured = observables::measure(&read.epochs, &timeline, judged.rollover_s[0], &costs_db);
        measured.stated_interval_s = read.interval_s;
        if measured.rows.is_empty() {
            return Err(elsewhere(path, &labels, &timeline));
        }
        judged.observables = Some(measured);
    }
    if let Some(path) = &files.nmea {
        let middle = timeline.origin.plus_s(0.5 * timeline.span_s().1);
        let read = nmea::read(&bytes(path)?, middle).map_err(|fault| line(path, fault))?;
        let labels: Vec<Epoch> = read.fixes.iter().map(|fix| fix.label).collect();
        judged.rollover_s[1] = rollover(&labels, &timeline).ok_or_else(|| elsewhere(path, &labels, &timeline))?;
        let mut measured = place::measure(&read.fixes, &timeline, judged.rollover_s[1]);
        measured.resolution_m = read.resolution_m;
        if measured.rows.is_empty() {
            return Err(elsewhere(path, &labels, &timeline));
        }
        let leap_s = timeline.origin.leap_seconds();
        let joined = |late_s: i64| place::measure(&read.fixes, &timeline, judged.rollover_s[1] + late_s).rows.len();
        let end_s = timeline.span_s().1 + judged.rollover_s[1] as f64;
        // A right label may be past the truth's end by its own error, one in GPS time by the leap seconds.
        let past_end = labels.iter().any(|label| label.since(timeline.origin) - end_s > 0.5 * leap_s as f64);
        judged.labels_late_s = (past_end && leap_s > 0 && joined(leap_s) > measured.rows.len()).then_some(leap_s);
        judged.separations_assumed = read.separations_assumed;
        judged.places = Some(measured);
    }
    let summary = ForeignSummary::new(&judged);
    Ok(Judgement { run, judged, summary })
}

/// A judgement that is not written yet.
pub struct Judgement {
    /// The scene's truth.
    pub run: Run,
    /// Everything that was measured.
    pub judged: Judged,
    /// Summary of the measurements.
    pub summary: ForeignSummary,
}

fn bytes(path: &Path) -> Result<Vec<u8>, JudgeError> {
    let remedy = "it is the file of the receiver under test that the command names";
    let failed = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => JudgeError::Missing { path: path.to_owned(), remedy },
        _ => JudgeError::Read { path: path.to_owned(), source },
    };
    let refuse = |what: String| Err(JudgeError::NotOfThisTruth { path: path.to_owned(), what });
    let about = fs::metadata(path).map_err(failed)?;
    // A pipe or a device has no size, and perhaps no end.
    if !about.is_file() {
        return refuse("is not an ordinary file".to_owned());
    }
    if about.len() > rinex_obs::LARGEST_BYTES {
        return refuse(format!("{} bytes: expected at most 256 MiB", about.len()));
    }
    fs::read(path).map_err(failed)
}

fn line(path: &Path, fault: Fault) -> JudgeError {
    JudgeError::Line { path: path.to_owned(), line: fault.line, what: fault.what }
}

/// Seconds, a multiple of 1024 weeks, by which labels lie ahead of the truth; `None` where no multiple brings
/// one near.
fn rollover(labels: &[Epoch], timeline: &timeline::Timeline) -> Option<i64> {
    let (from_s, to_s) = timeline.span_s();
    let first = labels.first()?;
    let turns = (first.since(timeline.origin) / ROLLOVER_S as f64).round() as i64;
    let near = |label: &Epoch| {
        let at_s = label.since(timeline.origin) - (turns * ROLLOVER_S) as f64;
        (from_s - NEAR_S..=to_s + NEAR_S).contains(&at_s)
    };
    labels.iter().any(near).then_some(turns * ROLLOVER_S)
}

fn elsewhere(path: &Path, labels: &[Epoch], timeline: &timeline::Timeline) -> JudgeError {
    let (from_s, to_s) = timeline.span_s();
    let [from, to] = [from_s, to_s].map(|t_s| timeline.origin.plus_s(t_s));
    let own =
        labels.first().zip(labels.last()).map_or("nothing".to_owned(), |(first, last)| format!("{first} to {last}"));
    JudgeError::NotOfThisTruth {
        path: path.to_owned(),
        what: format!("epochs from {own} of GPS time have no truth: expected epochs from {from} to {to}"),
    }
}

#[cfg(test)]
mod tests;
