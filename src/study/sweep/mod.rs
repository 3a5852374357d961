//! Studies: a base scene, axes and repetitions become a table of figures, in shards that survive what kills a
//! run.
//!
//! [`spec`] is STUDY.toml as written, [`axis`] its grid: case i follows from mixed radix, so no list of cases
//! exists. A case is run by [`model`] (the loops on modelled correlations) or [`sampled`] (generator and
//! receiver of a scene); [`engine`] runs what is missing on all cores, [`plan`] and [`shard`] keep
//! manifest and results on disk, [`result`] condenses repetitions, [`ensemble`] takes all cases together,
//! [`draw`] and [`publish`] show them, [`export`] hands [`part`]s of the plan to other machines' engines.
//!
//! **Exactly once** rests on no engine: a shard's bytes are a function of the manifest and its number alone,
//! a file under its final name is whole and bound to its manifest, and merging takes each shard once or
//! fails.

pub mod axis;
mod cost;
pub mod draw;
pub mod engine;
pub mod ensemble;
pub mod estimate;
pub mod export;
pub mod fixes;
pub mod keys;
pub mod model;
mod paper;
pub mod part;
pub mod plan;
pub mod publish;
pub mod result;
pub mod sampled;
pub mod shard;
pub mod spec;
mod temporary;
mod words;

use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256, Sha512};
use thiserror::Error;

use analysis::JudgeError;
use generator::GenerateError;
use generator::scenario::Place;
use generator::scenario::ScenarioError;
use receiver::ReceiveError;
use receiver::output::OutputError;

/// Error that prevents the planning, the run or the merge of a study.
#[derive(Debug, Error)]
pub enum StudyError {
    /// The study's file is not as its keys ask.
    #[error(transparent)]
    Text(#[from] ScenarioError),
    /// A value of an axis is not one that its key can have.
    #[error("{place}: axis {key} = {value}: {reason}")]
    Axis {
        /// Position in the file at which the value is named.
        place: Place,
        /// The key.
        key: String,
        /// The value as written.
        value: String,
        /// Reason in words.
        reason: String,
    },
    /// A case's values together make no scene or no settings.
    #[error("{origin}: case {case} ({values}): {reason}")]
    Case {
        /// The study's file.
        origin: String,
        /// Number of the case.
        case: u64,
        /// The case's values, as written.
        values: String,
        /// Reason in words.
        reason: String,
    },
    /// Data that no repetition will mend: a file that the study names cannot be used.
    #[error("{}: {reason}", path.display())]
    Input {
        /// The file or directory.
        path: PathBuf,
        /// Reason in words.
        reason: String,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// Error of the operating system or of the parser.
        source: io::Error,
    },
    /// A file or directory cannot be made.
    #[error("cannot create {}: {source}", path.display())]
    Create {
        /// The file or directory.
        path: PathBuf,
        /// Error of the operating system or of the parser.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or directory.
        path: PathBuf,
        /// Error of the operating system or of the parser.
        source: io::Error,
    },
    /// The directory holds something else.
    #[error("{} {reason}", path.display())]
    Occupied {
        /// The file or directory.
        path: PathBuf,
        /// Reason in words.
        reason: String,
    },
    /// A shard that was made again differs from the one that is there.
    #[error(
        "{} is there with other bytes than were computed now: the study is not reproducible on these machines; compare \
         their builds and remove the wrong file",
        path.display()
    )]
    NotReproducible {
        /// The file or directory.
        path: PathBuf,
    },
    /// Shards are missing.
    #[error("{missing} of {shards} shards are missing: {list}")]
    Incomplete {
        /// Number of missing shards.
        missing: usize,
        /// Number of all shards.
        shards: u32,
        /// Numbers of the missing ones.
        list: String,
    },
    /// The plan has no such shard.
    #[error("shard {shard}: expected 0 to {last}")]
    NoSuchShard {
        /// The number asked for.
        shard: u32,
        /// The largest number.
        last: u32,
    },
    /// Stopped, because another case had failed.
    #[error("stopped")]
    Stopped,
    /// The generator failed.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// The receiver failed.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The receiver's results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The judge failed.
    #[error(transparent)]
    Judge(#[from] JudgeError),
    /// A fault of this program.
    #[error("{0}")]
    Bug(String),
}

impl StudyError {
    fn input(path: &Path, reason: impl Into<String>) -> Self {
        Self::Input { path: path.to_owned(), reason: reason.into() }
    }
}

/// SHA-256 in hexadecimal digits.
pub fn sha256_hex(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// SHA-512 in hexadecimal digits.
pub fn sha512_hex(bytes: &[u8]) -> String {
    hex(&Sha512::digest(bytes))
}

/// SHA-256 of a whole file, in hexadecimal digits.
///
/// # Errors
/// Errors of reading.
pub fn sha256_of_file(path: &Path) -> io::Result<String> {
    let (mut file, mut hash, mut bytes) = (std::fs::File::open(path)?, Sha256::new(), vec![0; 1 << 20]);
    loop {
        match file.read(&mut bytes) {
            Ok(0) => return Ok(hex(&hash.finalize())),
            Ok(count) => hash.update(bytes.get(..count).unwrap_or_default()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Ends of names that state a unit, with the unit. An end that another one contains comes after it.
const UNITS: [(&str, &str); 21] = [
    ("_dbhz", "dB-Hz"),
    ("_db", "dB"),
    ("_dbw", "dBW"),
    ("_deg", "deg"),
    ("_rad", "rad"),
    ("_cycles", "cycle"),
    ("_chips", "chip"),
    ("_per_hour", "1/h"),
    ("_g_per_s", "g/s"),
    ("_mps3", "m/s^3"),
    ("_mps2", "m/s^2"),
    ("_mps", "m/s"),
    ("_hz", "Hz"),
    ("_msps", "Msps"),
    ("_ms", "ms"),
    ("_ns", "ns"),
    ("_sps", "s/s"),
    ("_lsb", "LSB"),
    ("_g", "g"),
    ("_m", "m"),
    ("_s", "s"),
];

/// The unit that the end of a name states; "1" for a pure number.
pub fn unit_of(name: &str) -> &'static str {
    // "bias_enu_m.0" carries its unit before the index.
    let is_index = |last: &str| last.bytes().all(|byte| byte.is_ascii_digit());
    let stem = name.rsplit_once('.').filter(|(_, last)| is_index(last)).map_or(name, |(stem, _)| stem);
    UNITS.iter().find(|(end, _)| stem.ends_with(end)).map_or("1", |(_, unit)| unit)
}
