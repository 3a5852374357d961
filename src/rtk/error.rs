//! Reasons for which there is no baseline.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use gnss::rinex::NavigationError;
use gnss::time::Epoch;

/// Reason for which two runs give no baseline.
#[derive(Debug, Error)]
pub enum RtkError {
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// An observation file that is not as RINEX has it.
    #[error("{}: line {line}: {what}", path.display())]
    Observations {
        /// The file.
        path: PathBuf,
        /// Line of the file, counted from 1.
        line: u64,
        /// The fault in words.
        what: String,
    },
    /// A navigation file that is not as RINEX has it.
    #[error(transparent)]
    Navigation(#[from] NavigationError),
    /// A row of a table that is not as its columns ask.
    #[error("{} holds a row that is not as expected: {source}", path.display())]
    Row {
        /// The table.
        path: PathBuf,
        /// Error of the parser.
        source: csv::Error,
    },
    /// A receiver that found no position.
    #[error(
        "{}: the {who} has no fix: its fixes.csv has no row, so that its observations have no time",
        path.display()
    )]
    NoFix {
        /// Base or rover.
        who: &'static str,
        /// Directory of the receiver's results.
        path: PathBuf,
    },
    /// Observations whose times have nothing in common.
    #[error(
        "no common epochs: the base observes from {} to {}, the rover from {} to {}, and no two times are within \
         {within_s} s",
        base[0], base[1], rover[0], rover[1]
    )]
    NoCommonEpochs {
        /// First and last epoch of the base.
        base: [Epoch; 2],
        /// First and last epoch of the rover.
        rover: [Epoch; 2],
        /// Largest difference of the times of an epoch, seconds.
        within_s: f64,
    },
    /// Epochs in which the two have too few satellites in common.
    #[error(
        "no common satellites: a position needs {LEAST} on one signal with ephemerides, and in {epochs} common epochs \
         base and rover share {most} at most; the base observes {base}, the rover {rover}"
    )]
    NoCommonSatellites {
        /// Common epochs.
        epochs: usize,
        /// Largest number of shared satellites of an epoch.
        most: usize,
        /// Satellites of the base, in words.
        base: String,
        /// Satellites of the rover, in words.
        rover: String,
    },
    /// Observation files without any ephemerides.
    #[error("no ephemerides: expected --navigation for observation files that are not of a run")]
    NoEphemerides,
    /// A base whose position nothing tells.
    #[error(
        "{}: no position of the base in truth/trajectory.csv: expected --base-position, or --moving-base, for a base \
         without a truth",
        path.display()
    )]
    NoPosition {
        /// Directory of the base's run.
        path: PathBuf,
    },
}

/// Satellites without which there is no position: three of its coordinates and one pivot.
pub const LEAST: usize = 4;
