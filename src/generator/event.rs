//! Events that switch sources while a scene is sent, written as lines of text.
//!
//! `power G05 -10` · `spoofer 1 3` · `jammer 1 off` · `jammer 1 on` · `spoofer 1 off` ·
//! `range_error G05 30 0.5` (metres, metres per second) · `range_error G05 0`. A power is in decibels over
//! that of the scene, `off` none at all. The record of a live run holds them in a table with the sample of
//! each, which a replay reads.

use std::fmt;
use std::io::{BufRead, BufReader, Read};
use std::str::FromStr;

use thiserror::Error;

use crate::scene::Scene;
use crate::switches::{MOST, Source};
use crate::vehicle::file::{Fault, FileError};
use gnss::renamed::{self, Class};
use gnss::satellite::Sv;

/// Decibels that a power may be changed by.
const MOST_DB: f64 = 100.0;
/// Largest range error of a satellite in metres, and its largest rate in m/s.
const MOST_RANGE_ERROR: f64 = 1e7;

/// Event that changes a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Power over that of the scene in decibels; `None` is off.
    Power(Source, Option<f64>),
    /// A true satellite's ranges are too long by metres, and by as many more a second.
    RangeError(Sv, f64, f64),
}

/// Reason for which a line is not a valid event, or not one of the scene.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum EventError {
    /// Line that is not a known event.
    #[error("'{0}': expected power SV DB|off, jammer N on|off|DB, spoofer N on|off|DB or range_error SV M [M/S]")]
    Unknown(String),
    /// Event under a name of an earlier version, and its name now.
    #[error("'{0}' is called '{1}' now")]
    Renamed(&'static str, &'static str),
    /// A number beyond its range.
    #[error("{0}: expected {1:e} at most")]
    Range(f64, f64),
    /// A source that the scene has not.
    #[error("{0}: the scene has no such source")]
    NoSuch(String),
    /// A scene that is not driven.
    #[error("only a scene with [motion] kind = \"pushed\" takes events")]
    Known,
    /// Too many changes.
    #[error("{MOST} changes were made: no more are taken")]
    TooMany,
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Power(source, db) => {
                match source {
                    Source::Satellite(sv) => write!(f, "power {sv} ")?,
                    Source::Jammer(number) => write!(f, "jammer {number} ")?,
                    Source::Spoofer(number) => write!(f, "spoofer {number} ")?,
                }
                match db {
                    Some(0.0) => f.write_str("on"),
                    Some(db) => write!(f, "{db:?}"),
                    None => f.write_str("off"),
                }
            }
            Self::RangeError(sv, m, mps) => write!(f, "range_error {sv} {m:?} {mps:?}"),
        }
    }
}

impl FromStr for Event {
    type Err = EventError;

    fn from_str(line: &str) -> Result<Self, EventError> {
        let shown = || line.chars().take(60).flat_map(char::escape_debug).collect();
        let unknown = || EventError::Unknown(shown());
        let mut words = line.split_ascii_whitespace();
        let (verb, name) = (words.next().unwrap_or_default(), words.next().ok_or_else(unknown)?);
        let number = |word: &str, most: f64| {
            let value: f64 = word.parse().map_err(|_| unknown())?;
            if value.abs() <= most { Ok(value) } else { Err(EventError::Range(value, most)) }
        };
        let satellite = || name.parse::<Sv>().map_err(|_| unknown());
        let event = if verb == "range_error" {
            let m = number(words.next().ok_or_else(unknown)?, MOST_RANGE_ERROR)?;
            Self::RangeError(satellite()?, m, words.next().map_or(Ok(0.0), |word| number(word, MOST_RANGE_ERROR))?)
        } else {
            let source = match verb {
                "power" => Source::Satellite(satellite()?),
                "jammer" => Source::Jammer(name.parse().map_err(|_| unknown())?),
                "spoofer" => Source::Spoofer(name.parse().map_err(|_| unknown())?),
                other => {
                    let renamed = renamed::find(Class::Event, other);
                    return Err(renamed.map_or_else(unknown, |(earlier, now)| EventError::Renamed(earlier, now)));
                }
            };
            Self::Power(
                source,
                match words.next().ok_or_else(unknown)? {
                    "on" => Some(0.0),
                    "off" => None,
                    word => Some(number(word, MOST_DB)?),
                },
            )
        };
        if words.next().is_some() { Err(unknown()) } else { Ok(event) }
    }
}

impl Event {
    /// Checks that the scene contains the source that is switched.
    ///
    /// # Errors
    /// [`EventError::NoSuch`].
    pub fn check(&self, scene: &Scene) -> Result<(), EventError> {
        let there = match self {
            Self::Power(Source::Satellite(sv), _) | Self::RangeError(sv, ..) => {
                scene.catalogue.satellites().any(|known| known == *sv) && !scene.excluded.contains(sv)
            }
            Self::Power(Source::Jammer(number), _) => scene.interference.iter().any(|one| one.source == *number),
            Self::Power(Source::Spoofer(number), _) => scene.spoofers.iter().any(|one| one.number == *number),
        };
        if there { Ok(()) } else { Err(EventError::NoSuch(self.to_string())) }
    }

    /// Applies the event from `tick` on.
    ///
    /// # Errors
    /// [`EventError`]; nothing changes then.
    pub fn apply(&self, scene: &Scene, tick: u64) -> Result<(), EventError> {
        self.check(scene)?;
        let Some(switches) = &scene.switches else { return Err(EventError::Known) };
        let done = match *self {
            Self::Power(source, db) => {
                let gain = db.map_or(0.0, |db| libm::pow(10.0, db / 10.0));
                switches.set(source, tick, |row| row.gain = gain)
            }
            Self::RangeError(sv, m, mps) => switches.set(Source::Satellite(sv), tick, |row| {
                (row.range_error_m, row.range_error_mps) = (m, mps);
            }),
        };
        if done { Ok(()) } else { Err(EventError::TooMany) }
    }
}

/// First line of a table of events.
pub const HEADER: &str = "sample,event";
/// Bytes of a row of it at most.
const MAX_ROW_BYTES: u64 = 256;

/// Reads a table of events: the sample of each, which ascends.
///
/// # Errors
/// [`FileError`] at the first line that is none.
pub fn read(input: impl Read, file: &str) -> Result<Vec<(u64, Event)>, FileError> {
    let mut input = BufReader::new(input);
    let (mut line, mut events, mut text) = (0, Vec::<(u64, Event)>::new(), Vec::new());
    loop {
        line += 1;
        let refuse = |fault| FileError { file: file.to_owned(), line, fault };
        let wrong = |what: &str, expected: &str| {
            let what = what.chars().take(80).flat_map(char::escape_debug).collect();
            refuse(Fault::Log { what, expected: expected.to_owned() })
        };
        text.clear();
        let length = input.by_ref().take(MAX_ROW_BYTES).read_until(b'\n', &mut text);
        if length.map_err(|error| refuse(Fault::Read(error)))? == 0 {
            return Ok(events);
        }
        let text = std::str::from_utf8(&text).map_err(|_| refuse(Fault::NotText))?.trim_end();
        if line == 1 {
            if text == HEADER { continue } else { return Err(wrong(text, HEADER)) }
        }
        if events.len() >= MOST {
            return Err(wrong(text, "no more events"));
        }
        let (sample, event) = text.split_once(',').ok_or_else(|| wrong(text, "a sample and an event"))?;
        let last = events.last().map_or(0, |(sample, _)| *sample);
        let sample = sample.parse().ok().filter(|sample| *sample >= last);
        let sample = sample.ok_or_else(|| wrong(text, "a sample, not before that of the row before"))?;
        events.push((sample, event.parse().map_err(|error: EventError| wrong(event, &error.to_string()))?));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_events_is_read_in_order_and_refused_at_its_line() {
        let read = |text: &str| super::read(text.as_bytes(), "events.csv");
        let events = read("sample,event\n26000,power G05 off\n26000,jammer 1 on\n").unwrap();
        let power = Event::Power(Source::Satellite(Sv::gps(5)), None);
        assert_eq!(events, [(26_000, power), (26_000, Event::Power(Source::Jammer(1), Some(0.0)))]);
        for text in
            ["event\n", "sample,event\n5,x\n", "sample,event\n-5,jammer 1 on\n", "sample,event\n5 jammer 1 on\n"]
        {
            assert!(read(text).is_err(), "{text}");
        }
        let unordered = read("sample,event\n5,jammer 1 on\n4,jammer 1 off\n").unwrap_err().to_string();
        assert!(unordered.contains("line 3"), "{unordered}");
    }

    #[test]
    fn an_event_reads_as_it_is_written_and_nonsense_is_refused() {
        for line in ["power G05 -10.5", "power E11 off", "jammer 2 on", "spoofer 1 off", "range_error G12 30.0 0.5"] {
            assert_eq!(line.parse::<Event>().unwrap().to_string(), line);
        }
        assert_eq!("range_error G12 30".parse(), Ok(Event::RangeError(Sv::gps(12), 30.0, 0.0)));
        let renamed = "astray G12 30".parse::<Event>().unwrap_err().to_string();
        assert_eq!(renamed, "'astray' is called 'range_error' now");
        for line in ["", "power", "power G05", "power five 3", "power G05 NaN", "power G05 1000", "jammer -1 on"] {
            assert!(line.parse::<Event>().is_err(), "{line}");
        }
        for line in ["jammer 1 on now", "explode 1 on", "range_error G05", "range_error G05 1e9", "power G05 \u{1b}[2J"]
        {
            let error = line.parse::<Event>().unwrap_err().to_string();
            assert!(!error.contains('\u{1b}') && error.contains("expected"), "{error}");
        }
    }
}
