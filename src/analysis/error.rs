//! Why a run cannot be judged.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

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
