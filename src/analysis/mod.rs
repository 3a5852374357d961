//! The judge: joins truth and estimate, measures every error, draws and reports them.
//!
//! It reads only what generator and receiver wrote into a run's directory, joins the rows on (sample number,
//! satellite, signal) and writes `summary.json` and pictures beside them. [`load`] reads it once and puts
//! what is long on a [`shelf`], satellite by satellite, so that a long run takes little more memory than a
//! short one; [`errors`] measures, [`slips`] finds breaks and their causes, [`elevation`] sorts errors by
//! satellite and elevation, [`jitter`] holds each loop against theory, [`honesty`] the fixes against their
//! own covariance, [`clock`] does so for the receiver's clock with the deviations of [`allan`],
//! [`statistics`] condenses, [`access`] and [`jamming`] expect C/N0 under other codes and interference,
//! [`lines`] holds the receiver's word of continuous waves against them, [`spoofing`] tells what a spoofer
//! did, [`summary`] is what scripts gate on with its [`schema`], [`verdict`] holds it against theory and a
//! user's [`limits`], [`making`] keeps unfinished files from sight, [`plot`] draws, [`report`] prints on a
//! terminal and `pdf` on paper, [`psd`] estimates the spectrum of the samples, [`spectrum`] says what it
//! should be from each signal's [`waveform`], [`foreign`] judges receivers that this project did not write,
//! [`trade`] weighs speed against accuracy, [`theory`] says what errors to expect.

pub mod access;
pub mod allan;
pub mod clock;
pub mod due;
pub mod elevation;
pub mod errors;
pub mod expect;
pub mod foreign;
pub mod honesty;
pub mod independent;
pub mod integrity;
pub mod jamming;
pub mod jitter;
pub mod limits;
pub mod lines;
pub mod load;
pub mod making;
#[cfg(feature = "pdf")]
pub mod pdf;
pub mod plot;
pub mod psd;
pub mod report;
#[cfg(feature = "pdf")]
mod run_report;
pub mod schema;
pub mod shelf;
pub mod slips;
pub mod spectrum;
pub mod spoofing;
pub mod statistics;
pub mod summary;
mod tables;
pub mod theory;
pub mod trade;
pub mod verdict;
pub mod waveform;
mod write;

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

pub use summary::Summary;
pub(crate) use write::{Table, write_rows, write_whole};

/// Why a run cannot be judged.
#[derive(Debug, Error)]
pub enum JudgeError {
    #[error("{} is missing: {remedy}", path.display())]
    Missing { path: PathBuf, remedy: &'static str },
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: io::Error },
    #[error("cannot read {}: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("{} holds a row that is not as expected: {source}", path.display())]
    Row { path: PathBuf, source: csv::Error },
    #[error("{} is not the JSON expected: {source}", path.display())]
    Json { path: PathBuf, source: serde_json::Error },
    #[error("scene.json: {key} = {value}, expected {expected}")]
    Scene { key: &'static str, value: f64, expected: &'static str },
    #[error(
        "none of the receiver's {count} {what} falls on a sample of the truth: do both come from the same run, \
         with the same measurement interval?"
    )]
    NothingJoins { what: &'static str, count: usize },
    #[error("{}: line {line}: {what}", path.display())]
    Line { path: PathBuf, line: u64, what: String },
    #[error("{}: {what}", path.display())]
    NotOfThisTruth { path: PathBuf, what: String },
    #[error("{} could not be drawn: {reason}", path.display())]
    Plot { path: PathBuf, reason: String },
}

/// Judges the run in a directory: writes `summary.json`, tables, pictures and `report.pdf` there and returns
/// the summary.
///
/// Reads `truth/{observations,sky,trajectory,navigation}.csv`, `truth/scene.json`,
/// `rx/{observations,fixes,acquisition,tracking,navigation,events}.csv`, and where they exist
/// `rx/receiver.json`, `psd.csv`, `speed.json`, `scenario.toml`, `truth/interference.csv` and
/// `truth/claimed.csv`.
///
/// # Errors
/// [`JudgeError`] with the file that is missing, is not as expected or cannot be written.
pub fn judge(run: &Path) -> Result<Summary, JudgeError> {
    judge_against(run, None)
}

/// The same with a user's limits beside those of theory; what came of them is in the summary's details.
///
/// # Errors
/// As [`judge`].
pub fn judge_against(run: &Path, limits: Option<&limits::Limits>) -> Result<Summary, JudgeError> {
    // On one of the threads that draw: what it needed before serves again.
    rayon::scope(|_| judged(run, limits))
}

/// The verdict alone: what [`judge_against`] finds of the tables as they lie there, with nothing written or
/// drawn.
///
/// # Errors
/// As [`judge`], but for files that cannot be written.
pub fn assess(run: &Path, limits: Option<&limits::Limits>) -> Result<Summary, JudgeError> {
    Ok(measure(load::Run::read(run)?, run, limits)?.summary)
}

fn judged(run: &Path, limits: Option<&limits::Limits>) -> Result<Summary, JudgeError> {
    let Found { summary, sketches, report } = find(run, limits)?;
    // What was read is gone by now: drawing takes memory of its own.
    let pictures = plot::draw(run, &sketches)?;
    drop(sketches);
    #[cfg(feature = "pdf")]
    report.write(run, pictures)?;
    #[cfg(not(feature = "pdf"))]
    drop((pictures, report));
    let path = run.join("summary.json");
    let mut json =
        serde_json::to_vec_pretty(&summary).map_err(|source| JudgeError::Json { path: path.clone(), source })?;
    json.push(b'\n');
    write_whole(&path, &json)?;
    Ok(summary)
}

/// What came of a run, its tables written and its pictures not drawn yet.
struct Found {
    summary: Summary,
    sketches: Vec<(&'static plot::Picture, plot::Sketch)>,
    #[cfg(feature = "pdf")]
    report: run_report::RunReport,
    #[cfg(not(feature = "pdf"))]
    report: (),
}

/// What is measured of a run.
struct Measured {
    read: load::Run,
    errors: errors::Errors,
    clock: clock::Clock,
    honesty: honesty::Honesty,
    slips: slips::Slips,
    jitter: jitter::Jitter,
    summary: Summary,
}

fn measure(read: load::Run, run: &Path, limits: Option<&limits::Limits>) -> Result<Measured, JudgeError> {
    let errors = errors::Errors::measure(&read)?;
    let clock = clock::Clock::measure(&read, &errors)?;
    let honesty = honesty::Honesty::measure(&read, &errors);
    let slips = slips::Slips::find(&read, &errors)?;
    let jitter = jitter::Jitter::measure(&read, &errors)?;
    let mut summary = Summary::new(&read, &errors, &clock)?;
    summary.add(&honesty, &slips, &jitter);
    let not_json = |source| JudgeError::Json { path: run.join("summary.json"), source };
    let verdict = verdict::Verdict::of(&read, &errors, &slips, &summary)?;
    summary.details.verdict = match limits {
        Some(limits) => verdict.with_user(limits.judge(&serde_json::to_value(&summary).map_err(not_json)?)),
        None => verdict,
    };
    Ok(Measured { read, errors, clock, honesty, slips, jitter, summary })
}

fn find(run: &Path, limits: Option<&limits::Limits>) -> Result<Found, JudgeError> {
    let measured = measure(load::Run::read(run)?, run, limits)?;
    let Measured { read, errors, clock, honesty, slips, jitter, summary } = measured;
    let elevations = elevation::Elevations::measure(&read, &errors)?;
    let judged = plot::Judged { run: &read, errors: &errors, clock: &clock, honesty: &honesty, summary: &summary };
    clock.write(run)?;
    honesty.write(run)?;
    elevations.write(run)?;
    slips.write(run)?;
    jitter.write(run)?;
    tables::write(run, &judged)?;
    let sketches = plot::sketches(&judged)?;
    #[cfg(feature = "pdf")]
    let report = run_report::RunReport::new(&judged)?;
    #[cfg(not(feature = "pdf"))]
    let report = ();
    Ok(Found { summary, sketches, report })
}

#[cfg(test)]
mod tests;
