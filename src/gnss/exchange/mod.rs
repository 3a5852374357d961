//! Files for other programs: RINEX 3.05 and 4.02 with observations and navigation messages, and tracks for
//! maps.
//!
//! Source: RINEX 3.05, tables A2 to A8 (navigation) and A2, A3 (observations), section 5.2; RINEX 4.02,
//! section 5.4 and tables A9 to A36, whose observations are those of 3.05 and whose navigation messages have
//! a line of their own before each. The `rinex` crate writes columns as well, but holds a whole file in
//! memory; observations of a day at 10 Hz are gigabytes. Limits: GPS, Galileo, NavIC, BeiDou and GLONASS, and
//! of navigation what a message's `rinex` names; no date of the run stands in the header, since the same run
//! gives the same bytes at any time.

pub(crate) mod modern;
mod navigation;
mod observation;
mod offset;
mod track;

pub use navigation::{NavigationSets, bears_issue};
pub use observation::ObservationFile;
pub use track::{Track, TrackForm};

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::satellite::System;
use crate::time::Epoch;

/// Version of RINEX in which files are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Version {
    /// 3.05.
    #[default]
    Three,
    /// 4.02.
    Four,
}

/// Error for a version that is not written.
#[derive(Debug, Error, PartialEq)]
#[error("RINEX {0}: expected 3.05 or 4.02")]
pub struct VersionError(String);

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Three => "3.05",
            Self::Four => "4.02",
        })
    }
}

impl FromStr for Version {
    type Err = VersionError;

    fn from_str(text: &str) -> Result<Self, VersionError> {
        match text {
            "3" | "3.05" => Ok(Self::Three),
            "4" | "4.02" => Ok(Self::Four),
            other => Err(VersionError(other.to_owned())),
        }
    }
}

/// One line of a header: 60 columns and a label.
fn header_line(content: &str, label: &str) -> String {
    format!("{content:<60}{label}\n")
}

/// The first two lines: version and type, and who made it; the date is that of the first epoch.
fn opening(version: Version, kind: &str, systems: &[System], first: Epoch) -> String {
    let mixed = match systems {
        [one] => format!("{}: {}", one.letter(), one.name()),
        _ => "M: Mixed".to_owned(),
    };
    let date: String = first.to_string().chars().filter(char::is_ascii_digit).take(14).collect();
    let (day, time) = date.split_at_checked(8).unwrap_or_default();
    let program = concat!("gnss-twin ", env!("CARGO_PKG_VERSION"));
    header_line(&format!("{version:>9}{:11}{kind:<20}{mixed:<20}", ""), "RINEX VERSION / TYPE")
        + &header_line(&format!("{program:<20}{:20}{day} {time} LCL", ""), "PGM / RUN BY / DATE")
}

/// Year, month, day, hour and minute of a whole second, and the second.
fn calendar(at: Epoch) -> [u32; 6] {
    // As `YYYY-MM-DDThh:mm:ss.ssssss`.
    let text = Epoch::new(at.seconds(), 0.0).to_string();
    let part = |from: usize, to: usize| text.get(from..to).and_then(|part| part.parse().ok()).unwrap_or(0);
    [part(0, 4), part(5, 7), part(8, 10), part(11, 13), part(14, 16), part(17, 19)]
}
