//! The judge: joins truth and estimate, measures every error, draws and reports them.
//!
//! It reads only what generator and receiver wrote into a run's directory, joins the rows on
//! (sample number, satellite, signal) and writes `summary.json` and pictures beside them.
//! [`errors`] measures, [`clock`] does so for the receiver's clock with the deviations of [`allan`], [`statistics`]
//! condenses, [`access`] and [`jamming`] expect C/N0 under other codes and interference, [`spoofing`] tells what a
//! spoofer did, [`summary`] is what scripts gate on, [`plot`] draws, [`report`] prints, [`psd`] estimates the spectrum of
//! the samples, [`trade`] weighs speed against accuracy, [`theory`] says what errors to expect.

pub mod access;
pub mod allan;
pub mod clock;
pub mod errors;
pub mod jamming;
pub mod load;
pub mod plot;
pub mod psd;
pub mod report;
pub mod spoofing;
pub mod statistics;
pub mod summary;
pub mod theory;
pub mod trade;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

pub use summary::Summary;

/// Why a run cannot be judged.
#[derive(Debug, Error)]
pub enum JudgeError {
    #[error("{} is missing: {remedy}", path.display())]
    Missing { path: PathBuf, remedy: &'static str },
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: io::Error },
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
    #[error("{} could not be drawn: {reason}", path.display())]
    Plot { path: PathBuf, reason: String },
}

/// Judges the run in a directory: writes `summary.json`, `clock.csv`, `allan.csv` and the pictures there and returns the summary.
///
/// Reads `truth/{observations,sky,trajectory,navigation}.csv`, `truth/scene.json`,
/// `rx/{observations,fixes,acquisition,tracking,navigation,events}.csv`, and where they exist
/// `rx/receiver.json`, `psd.csv`, `speed.json`, `truth/interference.csv` and `truth/claimed.csv`.
pub fn judge(run: &Path) -> Result<Summary, JudgeError> {
    let read = load::Run::read(run)?;
    let errors = errors::Errors::measure(&read)?;
    let clock = clock::Clock::measure(&read, &errors);
    let summary = Summary::new(&read, &errors, &clock);
    plot::all(run, &plot::Judged { run: &read, errors: &errors, clock: &clock, summary: &summary })?;
    clock.write(run)?;
    let path = run.join("summary.json");
    let mut json =
        serde_json::to_vec_pretty(&summary).map_err(|source| JudgeError::Json { path: path.clone(), source })?;
    json.push(b'\n');
    write_whole(&path, &json)?;
    Ok(summary)
}

/// Writes rows as a CSV file.
pub(crate) fn write_rows<T: Serialize>(path: &Path, rows: impl Iterator<Item = T>) -> Result<(), JudgeError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        table.serialize(row).map_err(|source| JudgeError::Row { path: path.to_owned(), source })?;
    }
    let bytes =
        table.into_inner().map_err(|error| JudgeError::File { path: path.to_owned(), source: error.into_error() })?;
    write_whole(path, &bytes)
}

/// Writes a file so that a reader sees the old one or the new one, never a part.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), JudgeError> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    fs::write(&part, bytes)
        .and_then(|()| fs::rename(&part, path))
        .map_err(|source| JudgeError::File { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests;
