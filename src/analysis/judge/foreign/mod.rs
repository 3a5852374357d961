//! Judging a receiver that this project did not write and that was fed this project's samples.
//!
//! It is known by its files alone: observations in RINEX ([`crate::read::rinex_obs`]), positions
//! in NMEA ([`crate::read::nmea`]). They are joined with the truth by GPS time ([`Timeline`]),
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

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::JudgeError;
use crate::expect::due::receiver::front_end_costs_db;
use crate::expect::timeline::Timeline;
use crate::read::nmea::PlaceFix;
use crate::read::rinex_obs::ObservedEpoch;
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
    Draft::new(truth, files).map(Draft::finish)
}

/// Judgement in the making: the truth, and what is joined with it so far.
pub(crate) struct Draft {
    run: Run,
    /// The truth by GPS time.
    pub timeline: Timeline,
    judged: Judged,
}

impl Draft {
    /// Draft with what the files hold; they may be none.
    ///
    /// # Errors
    /// Errors of [`judge`].
    pub fn new(truth: &Path, files: &Files) -> Result<Self, JudgeError> {
        let run = Run::read_truth(truth)?;
        let timeline = Timeline::new(&run)?.ok_or_else(|| JudgeError::NotOfThisTruth {
            path: truth.join("trajectory.csv"),
            what: "no rows: expected the antenna's motion".to_owned(),
        })?;
        let judged = Judged {
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
        let mut draft = Self { run, timeline, judged };
        if let Some(path) = &files.rinex_obs {
            let read = rinex_obs::read(&bytes(path)?).map_err(|fault| line(path, fault))?;
            draft.judged.receiver = Some(read.receiver).filter(|name| !name.is_empty());
            draft.observe(path, &read.epochs, read.interval_s)?;
        }
        if let Some(path) = &files.nmea {
            let read = nmea::read(&bytes(path)?, draft.middle()).map_err(|fault| line(path, fault))?;
            draft.place(path, &read.fixes, read.resolution_m)?;
            draft.judged.labels_late_s = draft.late_s(&read.fixes);
            draft.judged.separations_assumed = read.separations_assumed;
        }
        Ok(draft)
    }

    /// Middle of the truth's time.
    pub fn middle(&self) -> Epoch {
        self.timeline.origin.plus_s(0.5 * self.timeline.span_s().1)
    }

    /// True if observations are joined.
    pub fn has_observations(&self) -> bool {
        self.judged.observables.is_some()
    }

    /// True if positions are joined.
    pub fn has_positions(&self) -> bool {
        self.judged.places.is_some()
    }

    /// Joins observations of a file.
    ///
    /// # Errors
    /// [`JudgeError::NotOfThisTruth`] if none has a truth.
    pub fn observe(
        &mut self,
        path: &Path,
        epochs: &[ObservedEpoch],
        stated_interval_s: Option<f64>,
    ) -> Result<(), JudgeError> {
        let labels: Vec<Epoch> = epochs.iter().map(|epoch| epoch.label).collect();
        let shift_s = self.rollover_s(path, &labels)?;
        let mut measured = observables::measure(epochs, &self.timeline, shift_s, &front_end_costs_db(&self.run));
        measured.stated_interval_s = stated_interval_s;
        if measured.rows.is_empty() {
            return Err(elsewhere(path, &labels, &self.timeline));
        }
        self.judged.rollover_s[0] = shift_s;
        self.judged.observables = Some(measured);
        Ok(())
    }

    /// Joins positions of a file, whose smallest step of a latitude is `resolution_m`.
    ///
    /// # Errors
    /// [`JudgeError::NotOfThisTruth`] if none has a truth.
    pub fn place(&mut self, path: &Path, fixes: &[PlaceFix], resolution_m: f64) -> Result<(), JudgeError> {
        let labels: Vec<Epoch> = fixes.iter().map(|fix| fix.label).collect();
        let shift_s = self.rollover_s(path, &labels)?;
        let mut measured = place::measure(fixes, &self.timeline, shift_s);
        measured.resolution_m = resolution_m;
        if measured.rows.is_empty() {
            return Err(elsewhere(path, &labels, &self.timeline));
        }
        self.judged.rollover_s[1] = shift_s;
        self.judged.places = Some(measured);
        Ok(())
    }

    /// Leap seconds if labels are late by them: GPS time in place of UTC.
    fn late_s(&self, fixes: &[PlaceFix]) -> Option<i64> {
        let (leap_s, shift_s) = (self.timeline.origin.leap_seconds(), self.judged.rollover_s[1]);
        let rows = self.judged.places.as_ref()?.rows.len();
        let end_s = self.timeline.span_s().1 + shift_s as f64;
        // A right label may be past the truth's end by its own error, one in GPS time by the leap seconds.
        let past_end = |fix: &PlaceFix| fix.label.since(self.timeline.origin) - end_s > 0.5 * leap_s as f64;
        let is_late = fixes.iter().any(past_end)
            && leap_s > 0
            && place::measure(fixes, &self.timeline, shift_s + leap_s).rows.len() > rows;
        is_late.then_some(leap_s)
    }

    /// Seconds, a multiple of 1024 weeks, by which labels of a file lie ahead of the truth.
    ///
    /// # Errors
    /// [`JudgeError::NotOfThisTruth`] where no multiple brings one near.
    pub fn rollover_s(&self, path: &Path, labels: &[Epoch]) -> Result<i64, JudgeError> {
        let (from_s, to_s) = self.timeline.span_s();
        let first_s = labels.first().map_or(0.0, |first| first.since(self.timeline.origin));
        let turns = (first_s / ROLLOVER_S as f64).round() as i64;
        let near = |label: &Epoch| {
            let at_s = label.since(self.timeline.origin) - (turns * ROLLOVER_S) as f64;
            (from_s - NEAR_S..=to_s + NEAR_S).contains(&at_s)
        };
        let is_near = labels.iter().any(near);
        is_near.then_some(turns * ROLLOVER_S).ok_or_else(|| elsewhere(path, labels, &self.timeline))
    }

    /// Judgement of what is joined.
    pub fn finish(self) -> Judgement {
        let Self { run, judged, .. } = self;
        let summary = ForeignSummary::new(&judged);
        Judgement { run, judged, summary }
    }
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

/// File of a receiver under test, with its size in bytes.
///
/// # Errors
/// [`JudgeError::Missing`], [`JudgeError::Read`], and [`JudgeError::NotOfThisTruth`] for what is no ordinary
/// file or too large.
pub(crate) fn opened(path: &Path) -> Result<(File, u64), JudgeError> {
    let failed = |source: io::Error| unreadable(path, source);
    let refuse = |what: String| Err(JudgeError::NotOfThisTruth { path: path.to_owned(), what });
    let about = fs::metadata(path).map_err(failed)?;
    // A pipe or a device has no size, and perhaps no end.
    if !about.is_file() {
        return refuse("is not an ordinary file".to_owned());
    }
    if about.len() > rinex_obs::LARGEST_BYTES {
        return refuse(format!("{} bytes: expected at most 256 MiB", about.len()));
    }
    Ok((File::open(path).map_err(failed)?, about.len()))
}

/// Error of a file of a receiver under test that cannot be read.
pub(crate) fn unreadable(path: &Path, source: io::Error) -> JudgeError {
    let remedy = "it is the file of the receiver under test that the command names";
    match source.kind() {
        io::ErrorKind::NotFound => JudgeError::Missing { path: path.to_owned(), remedy },
        _ => JudgeError::Read { path: path.to_owned(), source },
    }
}

fn bytes(path: &Path) -> Result<Vec<u8>, JudgeError> {
    let (mut file, length) = opened(path)?;
    let mut bytes = Vec::with_capacity(length as usize);
    file.read_to_end(&mut bytes).map_err(|source| unreadable(path, source))?;
    Ok(bytes)
}

fn line(path: &Path, fault: Fault) -> JudgeError {
    JudgeError::Line { path: path.to_owned(), line: fault.line, what: fault.what }
}

fn elsewhere(path: &Path, labels: &[Epoch], timeline: &Timeline) -> JudgeError {
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
