//! Errors that prevent the judgement of a run.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Error that prevents the judgement of a run.
#[derive(Debug, Error)]
pub enum JudgeError {
    /// A file that is needed is not there; the remedy says who writes it.
    #[error("{} is missing: {remedy}", path.display())]
    Missing {
        /// The file or directory.
        path: PathBuf,
        /// Command or program that writes it.
        remedy: &'static str,
    },
    /// A file cannot be created or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file or directory.
        path: PathBuf,
        /// Error of the operating system or of the parser.
        source: io::Error,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// Error of the operating system or of the parser.
        source: io::Error,
    },
    /// A row of a table is not as its columns ask, or cannot be written.
    #[error("{} holds a row that is not as expected: {source}", path.display())]
    Row {
        /// The file or directory.
        path: PathBuf,
        /// Error of the parser.
        source: csv::Error,
    },
    /// A JSON file is not as its record asks.
    #[error("{} is not the JSON expected: {source}", path.display())]
    Json {
        /// The file or directory.
        path: PathBuf,
        /// Error of the parser.
        source: serde_json::Error,
    },
    /// A fact of the scene is one that cannot be judged.
    #[error("scene.json: {key} = {value}, expected {expected}")]
    Scene {
        /// The key.
        key: &'static str,
        /// The value as written.
        value: f64,
        /// Expected value, in words.
        expected: &'static str,
    },
    /// The receiver's rows and the truth's have no sample in common.
    #[error(
        "none of the receiver's {count} {what} falls on a sample of the truth: do both come from the same run, \
         with the same measurement interval?"
    )]
    NothingJoins {
        /// Description of the rows, in words.
        what: &'static str,
        /// Number of the receiver's rows.
        count: usize,
    },
    /// A line of a file is not as its format asks.
    #[error("{}: line {line}: {what}", path.display())]
    Line {
        /// The file or directory.
        path: PathBuf,
        /// Line of the file, counted from 1.
        line: u64,
        /// Description of the fault, in words.
        what: String,
    },
    /// A foreign receiver's file belongs to another time or position than the truth.
    #[error("{}: {what}", path.display())]
    NotOfThisTruth {
        /// The file or directory.
        path: PathBuf,
        /// Description of the rows that do not match, in words.
        what: String,
    },
    /// The drawing library failed.
    #[error("{} could not be drawn: {reason}", path.display())]
    Plot {
        /// The file or directory.
        path: PathBuf,
        /// Reason in words.
        reason: String,
    },
}
