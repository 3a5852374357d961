//! Records by system: which are read, and the names of their fields.
//!
//! Source: RINEX 3.05, tables A6, A8, A10, A14, A16 and A18; RINEX 4.02, table A9.

use super::numbers::{digits, fields};
use super::{FIELD, Form, Line};
use crate::glonass::fdma::SLOTS;
use crate::qzss::satellites::SATELLITES;
use crate::satellite::{Sv, System};
use crate::sbas::l1::SATELLITES as SBAS_SATELLITES;
use crate::time::Epoch;

/// Fields of a record.
const FIELDS: usize = 31;
/// Lines of a record: satellite, epoch and clock, then seven lines of the orbit.
const LINES: usize = 8;
/// Number of lines in a GLONASS record, without and with the line of later versions.
const LINES_OF_GLONASS: std::ops::RangeInclusive<usize> = 4..=5;
/// Names of the fields with which records begin, in their order.
const FIRST: [&str; 20] = [
    "af0", "af1", "af2", "iode", "crs", "deltaN", "m0", "cuc", "e", "cus", "sqrta", "toe", "cic", "omega0", "cis",
    "i0", "crc", "omega", "omegaDot", "idot",
];
/// Names of the remaining fields of an LNAV, a Galileo and a NavIC record. Spare fields have no name.
const OF_LNAV: [&str; FIELDS - FIRST.len()] =
    ["l2Codes", "week", "l2p", "accuracy", "health", "tgd", "iodc", "t_tm", "fitInt", "", ""];
const OF_GALILEO: [&str; FIELDS - FIRST.len()] =
    ["sources", "week", "", "accuracy", "health", "bgdE5aE1", "bgdE5bE1", "t_tm", "", "", ""];
const OF_NAVIC: [&str; FIELDS - FIRST.len()] = ["", "week", "", "accuracy", "health", "tgd", "", "t_tm", "", "", ""];
const OF_BEIDOU: [&str; FIELDS - FIRST.len()] =
    ["", "week", "", "accuracy", "health", "tgd1", "tgd2", "t_tm", "aodc", "", ""];
/// Fields of a record of GLONASS, of the last line as it has been since 3.05.
const OF_GLONASS: [&str; 19] = [
    "af0",
    "af1",
    "t_tm",
    "x",
    "vx",
    "ax",
    "health",
    "y",
    "vy",
    "ay",
    "channel",
    "z",
    "vz",
    "az",
    "age",
    "status",
    "deltaTau",
    "accuracyIndex",
    "healthFlags",
];
/// Fields of a record of an augmentation system (RINEX 3.05, table A16).
const OF_SBAS: [&str; 15] =
    ["af0", "af1", "t_tm", "x", "vx", "ax", "health", "y", "vy", "ay", "accuracy", "z", "vz", "az", "iodn"];
/// Systems whose records are read, with the largest number of their satellites.
pub(super) const READ: [(char, System, u8); 7] = [
    ('G', System::Gps, 32),
    ('R', System::Glonass, SLOTS),
    ('E', System::Galileo, 36),
    ('I', System::Navic, 14),
    ('C', System::BeiDou, 63),
    ('J', System::Qzss, SATELLITES),
    ('S', System::Sbas, SBAS_SATELLITES[1]),
];
/// Bits of an I/NAV record's sources: sent on E1-B or E5b, sent on E5a (F/NAV), and a clock of E5b and E1.
const SENT_INAV: u32 = 0b101;
const SENT_FNAV: u32 = 0b010;
pub(super) const CLOCK_FNAV: u32 = 1 << 8;
const CLOCK_INAV: u32 = 1 << 9;

/// Systems and the messages with ephemerides that each has in version 4.
pub(super) const MESSAGES: [(char, &[&str]); 7] = [
    ('G', &["LNAV", "CNAV", "CNV2"]),
    ('R', &["FDMA", "L1OC", "L3OC"]),
    ('E', &["INAV", "FNAV"]),
    ('J', &["LNAV", "CNAV", "CNV2"]),
    ('C', &["D1", "D2", "CNV1", "CNV2", "CNV3"]),
    ('I', &["LNAV", "L1NV"]),
    ('S', &["SBAS"]),
];

/// A record in form.
pub(in crate::rinex) struct Record {
    /// True if the record is one of F/NAV.
    pub is_fnav: bool,
    /// Number of its first line.
    pub line: usize,
    pub sv: Sv,
    /// Reference time of the clock as written, in the time scale of the system's records.
    pub toc: Epoch,
    pub(super) values: [Option<f64>; FIELDS],
}

impl Record {
    /// Returns a field by its name; `None` if it is blank.
    pub fn get(&self, name: &str) -> Option<f64> {
        if self.sv.system == System::Glonass {
            let at = OF_GLONASS.iter().position(|field| *field == name)?;
            return self.values.get(at).copied().flatten();
        }
        if self.sv.system == System::Sbas {
            let at = OF_SBAS.iter().position(|field| *field == name)?;
            return self.values.get(at).copied().flatten();
        }
        let rest = match self.sv.system {
            System::Galileo => OF_GALILEO,
            System::Navic => OF_NAVIC,
            System::BeiDou => OF_BEIDOU,
            _ => OF_LNAV,
        };
        let at = FIRST.iter().chain(&rest).position(|field| *field == name)?;
        self.values.get(at).copied().flatten()
    }

    /// True if a Galileo record of version 3, which has one form for both messages, is one of F/NAV.
    pub(super) fn says_fnav(&self) -> Result<bool, String> {
        let sources = self.get("sources").unwrap_or(0.0) as u32;
        if sources & SENT_FNAV != 0 {
            return Ok(true);
        }
        if sources & SENT_INAV != 0 && sources & CLOCK_INAV != 0 {
            return Ok(false);
        }
        let expected = "bit 0, 1 or 2 for the signal, and bit 8 or 9 for the clock";
        Err(format!("line {} ({} {}): data sources = {sources}: expected {expected}", self.line, self.sv, self.toc))
    }
}

/// Text of the reason for which a record is left out, with its line and the first columns of that line.
fn refusal(line: usize, title: &str, what: &str) -> String {
    let label: String = title.chars().take(23).collect();
    format!("line {line} ({}): {what}", label.trim_end())
}

impl Form {
    /// A record of eight lines, of GLONASS and SBAS of fewer.
    pub(super) fn record(&self, record: &[Line<'_>]) -> Result<Record, String> {
        let (first, title) = record.first().copied().unwrap_or_default();
        let (system, _) = self.system_of(title);
        let (is_whole, expected) = match system {
            System::Glonass => (LINES_OF_GLONASS.contains(&record.len()), "4 or 5".to_owned()),
            System::Sbas => (record.len() == *LINES_OF_GLONASS.start(), LINES_OF_GLONASS.start().to_string()),
            _ => (record.len() == LINES, LINES.to_string()),
        };
        if !is_whole {
            return Err(refusal(first, title, &format!("a record of {} lines: expected {expected}", record.len())));
        }
        let mut values: Vec<Option<f64>> = self.lines(record)?.concat();
        let (sv, toc) = self.head((first, title))?;
        values.resize(FIELDS, None);
        let Ok(values) = values.try_into() else { return Err(refusal(first, title, "expected 31 fields")) };
        Ok(Record { is_fnav: false, line: first, sv, toc, values })
    }

    /// The system of a record by its first line, and the largest number of its satellites. Version 2 leaves
    /// the letter of the only system out.
    fn system_of(&self, title: &str) -> (System, u8) {
        let read = READ.iter().find(|(letter, ..)| {
            title.starts_with(*letter) || (self.version < 3 && self.system == 'R' && *letter == 'R')
        });
        read.map_or((System::Gps, 32), |(_, system, most)| (*system, *most))
    }

    /// The fields of each line: three beside satellite and epoch, which are as wide as one, four of the
    /// others.
    pub(super) fn lines(&self, record: &[Line<'_>]) -> Result<Vec<Vec<Option<f64>>>, String> {
        let margin = self.margin();
        let title = record.first().map_or("", |(_, title)| *title);
        let one = |(row, &(number, line)): (usize, &Line<'_>)| {
            let (start, count) = if row == 0 { (margin + FIELD, 3) } else { (margin, 4) };
            if row > 0 && line.get(..start).is_some_and(|margin| !margin.trim().is_empty()) {
                return Err(refusal(number, title, &format!("column 1: expected {start} blanks")));
            }
            if self.cut == Some(number) && !line.trim_end().len().saturating_sub(start).is_multiple_of(FIELD) {
                return Err(refusal(number, title, "the file ends within a number"));
            }
            fields(line, start, FIELD, count).map_err(|reason| refusal(number, title, &reason))
        };
        record.iter().enumerate().map(one).collect()
    }

    /// The satellite and the epoch in the first line of a record.
    pub(super) fn head(&self, (first, title): Line<'_>) -> Result<(Sv, Epoch), String> {
        let margin = self.margin();
        let (system, most) = self.system_of(title);
        let refuse = |what: &str| Err(refusal(first, title, what));
        let letter = usize::from(self.version > 2 || title.starts_with('G'));
        let number = title.get(letter..margin - usize::from(letter == 0 || self.version > 2)).unwrap_or("");
        let Some(number) = digits::<u8>(number.trim()).filter(|number| (1..=most).contains(number)) else {
            return refuse(&format!("column {}: PRN '{}': expected 1 to {most}", letter + 1, number.trim()));
        };
        if title.get(margin - 1..margin) != Some(" ") && !(self.version < 3 && letter == 1) {
            return refuse(&format!("column {margin}: expected a blank after the satellite"));
        }
        let date = title.get(margin..margin + FIELD).unwrap_or("");
        let Some(toc) = self.epoch(date) else {
            return refuse(&format!("column {}: '{}': expected an epoch from 1980 to 2180", margin + 1, date.trim()));
        };
        Ok((Sv { system, number }, toc))
    }
}

/// True for a GLONASS satellite beyond the constellation's slots, under trial or in reserve, whose channel is
/// unknown.
pub(super) fn is_spare(satellite: &str) -> bool {
    let number = satellite.strip_prefix('R').and_then(|number| number.parse::<u8>().ok());
    number.is_some_and(|number| number > SLOTS)
}
