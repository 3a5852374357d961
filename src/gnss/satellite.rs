//! Identity of a satellite: its system and its number, written as in RINEX (`G05`).

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A satellite system (RINEX 4.02, table 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum System {
    /// GPS, the United States.
    Gps,
    /// GLONASS, Russia.
    Glonass,
    /// Galileo, the European Union.
    Galileo,
    /// BeiDou, China.
    BeiDou,
    /// QZSS, Japan.
    Qzss,
    /// NavIC (IRNSS), India.
    Navic,
    /// Satellite-based augmentation systems.
    Sbas,
}

impl System {
    /// Every system, with its RINEX letter.
    pub const LETTERS: [(Self, char); 7] = [
        (Self::Gps, 'G'),
        (Self::Glonass, 'R'),
        (Self::Galileo, 'E'),
        (Self::BeiDou, 'C'),
        (Self::Qzss, 'J'),
        (Self::Navic, 'I'),
        (Self::Sbas, 'S'),
    ];

    /// The name that people know it by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gps => "GPS",
            Self::Glonass => "GLONASS",
            Self::Galileo => "Galileo",
            Self::BeiDou => "BeiDou",
            Self::Qzss => "QZSS",
            Self::Navic => "NavIC",
            Self::Sbas => "SBAS",
        }
    }

    /// Nominal semi-major axis of the system's medium orbits in metres. SBAS, QZSS and NavIC, which have
    /// none, have that of orbits synchronous with the Earth.
    pub fn orbit_m(self) -> f64 {
        match self {
            Self::Gps => 26_559.7e3,
            Self::Glonass => 25_510e3,
            Self::Galileo => 29_600.318e3,
            Self::BeiDou => 27_906.1e3,
            Self::Qzss | Self::Navic | Self::Sbas => 42_164.2e3,
        }
    }

    /// The RINEX letter.
    pub fn letter(self) -> char {
        Self::LETTERS.iter().find(|(system, _)| *system == self).map_or('?', |(_, letter)| *letter)
    }
}

impl fmt::Display for System {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Satellite: system and number (for GPS, the PRN).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Sv {
    /// The system.
    pub system: System,
    /// Number within the system: the PRN of GPS, the slot of GLONASS.
    pub number: u8,
}

/// Error for a text that does not name a satellite.
#[derive(Debug, Error, PartialEq)]
#[error("'{0}' is not a satellite: expected a system letter and a number, like G05")]
pub struct SvError(String);

impl Sv {
    /// True for BeiDou's geostationary satellites, whose message and orbit differ from the others
    /// (BDS-SIS-ICD-B1I 3.0, table 4-1).
    pub fn is_geostationary(self) -> bool {
        self.system == System::BeiDou && matches!(self.number, 1..=5 | 59..=63)
    }

    /// Nominal semi-major axis of the satellite's orbit, in metres. BeiDou's inclined synchronous satellites
    /// are those that its status reports named in 2024.
    pub fn orbit_m(self) -> f64 {
        let is_inclined = self.system == System::BeiDou && matches!(self.number, 6..=10 | 13 | 16 | 31 | 38..=40 | 56);
        if self.is_geostationary() || is_inclined { System::Navic.orbit_m() } else { self.system.orbit_m() }
    }

    /// Number of the satellite's codes. QZSS and SBAS share codes with GPS: their numbers are 192 and 100
    /// more than the satellite's own (RINEX 4.02, table 2).
    pub fn prn(self) -> u8 {
        let more = match self.system {
            System::Qzss => planted!("gnss.qzss.prn", 192, 193),
            System::Sbas => 100,
            _ => 0,
        };
        self.number.saturating_add(more)
    }

    /// A GPS satellite by its PRN.
    pub const fn gps(number: u8) -> Self {
        Self { system: System::Gps, number }
    }
}

impl fmt::Display for Sv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Through `pad`, so that width and alignment work.
        f.pad(&format!("{}{:02}", self.system.letter(), self.number))
    }
}

impl FromStr for Sv {
    type Err = SvError;

    fn from_str(text: &str) -> Result<Self, SvError> {
        let error = || SvError(text.to_owned());
        let mut chars = text.chars();
        let letter = chars.next().ok_or_else(error)?;
        let &(system, _) = System::LETTERS.iter().find(|(_, l)| *l == letter).ok_or_else(error)?;
        let digits = chars.as_str();
        if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit()) {
            return Err(error());
        }
        let number = digits.parse().map_err(|_| error())?;
        if number == 0 { Err(error()) } else { Ok(Self { system, number }) }
    }
}

impl From<Sv> for String {
    fn from(sv: Sv) -> Self {
        sv.to_string()
    }
}

impl TryFrom<String> for Sv {
    type Error = SvError;

    fn try_from(text: String) -> Result<Self, SvError> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_satellite_reads_back_as_written_and_nonsense_is_refused() {
        for text in ["G05", "E36", "R24", "C63"] {
            assert_eq!(text.parse::<Sv>().unwrap().to_string(), text);
        }
        for text in ["", "G", "5", "X05", "G00", "G-5", "G+5", "G999", "g05", "GÉ"] {
            assert!(text.parse::<Sv>().is_err(), "{text}");
        }
    }
}
