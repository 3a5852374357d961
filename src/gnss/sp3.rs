//! Precise orbits and clocks: SP3 files of versions c and d, read for satellites of GPS and Galileo.
//!
//! Source: The Extended Standard Product 3 Orbit Format (SP3-d), S. Hilla, 2016; the columns below are those
//! of its tables. Positions are of the centre of mass in the axes of the Earth. Clocks belong to the
//! ionosphere-free combination of P1 and P2 and leave out the periodic part of relativity, as broadcast
//! clocks do before that part is added. Limits: velocities, accuracies and correlations are not read,
//! versions a and b are refused, and epochs are at whole seconds.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use thiserror::Error;

use crate::inflate::{InflateError, inflate};
use crate::rinex::clean;
use crate::satellite::Sv;
use crate::time::{self, Epoch, TimeScale};

/// Largest file that is read, in bytes after decompression.
const LARGEST_BYTES: u64 = 256 << 20;
/// A clock from here on is none (SP3-d, table of the position record).
const NO_CLOCK_US: f64 = 999_999.0;
/// Distances from the Earth's centre that a satellite of GPS (26 560 km, an eccentricity below 0.1) or
/// Galileo (29 600 km; two at 27 980 km with 0.16) can have.
const RADII_M: std::ops::RangeInclusive<f64> = 2.3e7..=3.3e7;

/// One satellite at one epoch of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Centre of mass, ECEF.
    pub position_m: Vector3<f64>,
    /// Clock offset in seconds from the file's time, without the periodic part of relativity.
    pub clock_s: Option<f64>,
    /// True if the clock jumped or the satellite was manoeuvred between the epoch before and this one.
    pub broken: bool,
}

/// Content of a file for GPS and Galileo: orbit samples by satellite and GPS time in whole seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Precise {
    /// Samples of each satellite by GPS time.
    pub satellites: BTreeMap<Sv, BTreeMap<i64, Sample>>,
}

/// Reason for which a file contains no usable orbits.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Sp3Error {
    /// A file that cannot be decompressed.
    #[error("{name}: {source}: expected an SP3 file, plain or gzip")]
    Packed {
        /// Name of the file.
        name: String,
        /// Error of unpacking.
        source: InflateError,
    },
    /// No SP3 file.
    #[error("{name}: begins with '{found}': expected an SP3 file of version c or d (#cP… or #dP…)")]
    NotSp3 {
        /// Name of the file.
        name: String,
        /// First characters of the file.
        found: String,
    },
    /// A line that is not as the format has it.
    #[error("{name}: damaged SP3 file ({detail}): expected version c or d as the format has it")]
    Damaged {
        /// Name of the file.
        name: String,
        /// Position and description of the error.
        detail: String,
    },
    /// An epoch between two seconds.
    #[error("{name}:{line}: '{found}': expected an epoch at a whole second")]
    Fraction {
        /// Name of the file.
        name: String,
        /// Line number, from 1.
        line: usize,
        /// The epoch.
        found: String,
    },
    /// No orbit that can be used.
    #[error("{name}: no position of a satellite of GPS or Galileo")]
    Nothing {
        /// Name of the file.
        name: String,
    },
}

/// Reads an SP3 file, plain or gzip, whose `name` goes into errors.
///
/// # Errors
/// [`Sp3Error`], also when no satellite of GPS or Galileo is in it.
pub fn read(bytes: &[u8], name: &str) -> Result<Precise, Sp3Error> {
    let packed = |source| Sp3Error::Packed { name: name.to_owned(), source };
    let text = clean(&inflate(bytes, LARGEST_BYTES).map_err(packed)?);
    // `clean` left nothing but ASCII, so columns are bytes.
    let text = String::from_utf8_lossy(&text);
    if !["#cP", "#cV", "#dP", "#dV"].iter().any(|begin| text.starts_with(begin)) {
        return Err(Sp3Error::NotSp3 { name: name.to_owned(), found: quoted(text.lines().next().unwrap_or_default()) });
    }
    let mut reader = Reader::default();
    for (index, line) in text.lines().enumerate().take_while(|(_, line)| !line.starts_with("EOF")) {
        reader.take(line).map_err(|fault| fault.at(name, index + 1, line))?;
    }
    let precise = reader.precise;
    if precise.satellites.is_empty() { Err(Sp3Error::Nothing { name: name.to_owned() }) } else { Ok(precise) }
}

/// Error in one line.
enum Fault {
    /// An epoch has a fraction of a second.
    Fraction,
    /// Anything else.
    Damaged(String),
}

impl Fault {
    fn at(self, name: &str, line: usize, text: &str) -> Sp3Error {
        let name = name.to_owned();
        match self {
            Self::Fraction => Sp3Error::Fraction { name, line, found: quoted(text) },
            Self::Damaged(what) => Sp3Error::Damaged { name, detail: format!("line {line}: {what}") },
        }
    }
}

/// The beginning of a line as an error shows it.
fn quoted(line: &str) -> String {
    line.chars().take(40).flat_map(char::escape_default).collect()
}

/// Columns `first` to `last` of a line, counted from 1 as in the standard. Columns beyond the line's end are
/// missing.
fn columns(line: &str, first: usize, last: usize) -> &str {
    line.get(first - 1..last.min(line.len())).unwrap_or_default()
}

/// The state of reading: the scale of time of the file and the epoch of the records that follow.
#[derive(Default)]
struct Reader {
    scale: Option<&'static TimeScale>,
    epoch: Option<Epoch>,
    precise: Precise,
}

impl Reader {
    fn take(&mut self, line: &str) -> Result<(), Fault> {
        match line.as_bytes().first() {
            // The second line of this kind holds nothing yet.
            Some(b'%') if line.starts_with("%c") && self.scale.is_none() => {
                self.scale = Some(time_scale(columns(line, 10, 12))?);
            }
            Some(b'*') => self.epoch = Some(epoch(line, self.scale()?)?),
            Some(b'P') => self.position(line)?,
            _ => {}
        }
        Ok(())
    }

    fn scale(&self) -> Result<&'static TimeScale, Fault> {
        self.scale.ok_or_else(|| Fault::Damaged("an epoch before the line '%c' with its scale of time".to_owned()))
    }

    /// Takes a position and clock record (SP3-d, table of the position record).
    fn position(&mut self, line: &str) -> Result<(), Fault> {
        let at = self.epoch.ok_or_else(|| Fault::Damaged("a position before any epoch".to_owned()))?;
        let sv = columns(line, 2, 4).replace(' ', "0");
        if !sv.starts_with(['G', 'E']) {
            return Ok(());
        }
        let sv: Sv = sv.parse().map_err(|_| Fault::Damaged(format!("'{sv}': expected a satellite such as G01")))?;
        let [x_km, y_km, z_km] = [(5, 18), (19, 32), (33, 46)].map(|(first, last)| decimal(line, first, last));
        let position_m = Vector3::new(x_km?, y_km?, z_km?) * 1e3;
        // Three zeros stand for a position that is not known.
        if position_m == Vector3::zeros() {
            return Ok(());
        }
        let radius_m = position_m.norm();
        if !RADII_M.contains(&radius_m) {
            return Err(Fault::Damaged(format!(
                "{sv} at {at}: {radius_m:e} m from the Earth's centre, expected 2.3e7 to 3.3e7"
            )));
        }
        let no_clock = columns(line, 47, 60).trim().is_empty();
        let clock_us = if no_clock { None } else { Some(decimal(line, 47, 60)?) };
        let clock_s = clock_us.filter(|us| us.abs() < NO_CLOCK_US).map(|us| us * 1e-6);
        let broken = columns(line, 75, 75) == "E" || columns(line, 79, 79) == "M";
        self.precise.satellites.entry(sv).or_default().insert(at.seconds(), Sample { position_m, clock_s, broken });
        Ok(())
    }
}

/// The scale of time by its name in the first line `%c`.
fn time_scale(name: &str) -> Result<&'static TimeScale, Fault> {
    /// International atomic time, 19 s ahead of GPS time.
    static TAI: TimeScale = TimeScale { name: "TAI", behind_gpst_s: -19, has_leap_seconds: false };
    match name {
        "GPS" => Ok(&time::GPST),
        "GAL" => Ok(&time::GST),
        "QZS" => Ok(&time::QZSST),
        "IRN" => Ok(&time::IRNSST),
        "BDT" => Ok(&time::BDT),
        "TAI" => Ok(&TAI),
        // The standard's GLO is the UTC of GLONASS, without the three hours of Moscow.
        "UTC" | "GLO" => Ok(&time::UTC),
        _ => Err(Fault::Damaged(format!("scale of time '{name}': expected GPS, GAL, QZS, IRN, BDT, TAI, UTC or GLO"))),
    }
}

/// The instant of an epoch header: year in columns 4 to 7, then two columns each after a blank, seconds in 21
/// to 31.
fn epoch(line: &str, scale: &TimeScale) -> Result<Epoch, Fault> {
    let fields = [(4, 7), (9, 10), (12, 13), (15, 16), (18, 19)].map(|(first, last)| columns(line, first, last).trim());
    let seconds = columns(line, 21, 31).trim();
    let (whole, fraction) = seconds.split_once('.').unwrap_or((seconds, ""));
    if fraction.bytes().any(|digit| digit.is_ascii_digit() && digit != b'0') {
        return Err(Fault::Fraction);
    }
    let [year, month, day, hour, minute] = fields;
    let stamp = format!("{year:0>4}-{month:0>2}-{day:0>2}T{hour:0>2}:{minute:0>2}:{whole:0>2}");
    let label = Epoch::parse(&stamp).map_err(|_| Fault::Damaged(format!("'{}': expected an epoch", quoted(line))))?;
    Ok(scale.instant(label))
}

/// A decimal number in some columns.
fn decimal(line: &str, first: usize, last: usize) -> Result<f64, Fault> {
    let field = columns(line, first, last).trim();
    let number = field.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| Fault::Damaged(format!("'{field}' in columns {first} to {last}: expected a number")))
}

impl Precise {
    /// Adds the content of another file; where both have a value, the other file's counts.
    pub fn extend(&mut self, other: Self) {
        for (sv, samples) in other.satellites {
            self.satellites.entry(sv).or_default().extend(samples);
        }
    }

    /// Returns the first and the last epoch of any satellite.
    pub fn span(&self) -> Option<(Epoch, Epoch)> {
        let first = self.satellites.values().filter_map(|samples| samples.keys().next()).min()?;
        let last = self.satellites.values().filter_map(|samples| samples.keys().next_back()).max()?;
        Some((Epoch::new(*first, 0.0), Epoch::new(*last, 0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::satellite::System;

    const HEAD: &str = "#dP2020  6 25  0  0  0.00000000       2 ORBIT IGS14 HLM  IGS\n\
        ## 2111 345600.00000000   900.00000000 59025 0.0000000000000\n\
        %c M  cc GPS ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n";
    const BODY: &str = "*  2020  6 25  0  0  0.00000000\n\
        PG01  15402.861499  21607.418873   -992.500669     10.571484\n\
        PG02  15402.861499  21607.418873   -992.500669 999999.999999\n\
        PE05  15402.861499  21607.418873   -992.500669     10.571484\n\
        PR05  15402.861499  21607.418873   -992.500669     10.571484\n\
        *  2020  6 25  0 15  0.00000000\n\
        PG01  15402.861499  21607.418873   -992.500669    -10.571484 10  9 11 102 E\nEOF\n";

    #[test]
    fn satellites_arrive_in_metres_and_seconds_and_a_missing_clock_as_none() {
        let precise = read(format!("{HEAD}{BODY}").as_bytes(), "x").unwrap();
        let begin = Epoch::parse("2020-06-25T00:00:00").unwrap();
        assert_eq!(precise.span().unwrap(), (begin, begin.plus_s(900.0)));
        assert_eq!(precise.satellites.len(), 3);
        let first = &precise.satellites[&Sv::gps(1)];
        let sample = first[&begin.seconds()];
        assert_eq!(sample.position_m, Vector3::new(15_402.861_499, 21_607.418_873, -992.500_669) * 1e3);
        assert_eq!((sample.clock_s, sample.broken), (Some(10.571_484 * 1e-6), false));
        assert!(first[&(begin.seconds() + 900)].broken);
        let galileo = Sv { system: System::Galileo, number: 5 };
        assert_eq!(precise.satellites[&galileo][&begin.seconds()], Sample { broken: false, ..sample });
        assert_eq!(precise.satellites[&Sv::gps(2)][&begin.seconds()].clock_s, None);
    }

    /// hifitime, which knows the scales by itself, is the witness of the instants.
    #[test]
    fn epochs_are_read_in_the_time_of_the_file() {
        let label = "2020-06-25T00:00:00";
        for (name, scale) in [
            ("GPS", hifitime::TimeScale::GPST),
            ("GAL", hifitime::TimeScale::GST),
            ("BDT", hifitime::TimeScale::BDT),
            ("TAI", hifitime::TimeScale::TAI),
            ("UTC", hifitime::TimeScale::UTC),
            ("GLO", hifitime::TimeScale::UTC),
        ] {
            let text = format!("{HEAD}{BODY}").replacen("cc GPS", &format!("cc {name}"), 1);
            let (first, _) = read(text.as_bytes(), "x").unwrap().span().unwrap();
            let there = hifitime::Epoch::from_gregorian_str(&format!("{label} {scale}")).unwrap();
            let gpst_s = there.to_gpst_seconds();
            assert!((gpst_s - first.seconds() as f64).abs() < 1e-6, "{name}: {gpst_s} s, {first}");
        }
    }

    #[test]
    fn a_position_that_is_not_known_is_left_out_and_a_clock_that_is_blank_is_none() {
        let unknown = "PG03      0.000000      0.000000      0.000000     10.571484\n";
        let blank = "PG04  15402.861499  21607.418873   -992.500669\n";
        let moved = format!("{:78}M\n", "PG05  15402.861499  21607.418873   -992.500669     10.571484");
        let text = format!("{HEAD}{BODY}").replace("EOF\n", &format!("{unknown}{blank}{moved}EOF\n"));
        let precise = read(text.as_bytes(), "x").unwrap();
        let only = |number| precise.satellites.get(&Sv::gps(number)).map(|all| *all.values().next().unwrap());
        assert_eq!(only(3), None);
        assert_eq!(only(4).map(|sample| (sample.clock_s, sample.broken)), Some((None, false)));
        assert!(only(5).unwrap().broken);
    }

    #[test]
    fn damage_is_told_with_its_line_and_what_was_expected() {
        let whole = format!("{HEAD}{BODY}");
        for (right, wrong, said) in [
            (
                "PG01  15402.861499",
                "PG01  15402.86x499",
                "line 5: '15402.86x499' in columns 5 to 18: expected a number",
            ),
            ("PG01  15402.861499", "PG01  15402861.499", "line 5: G01 at 2020-06-25T00:00:00"),
            ("PG01", "PG0x", "line 5: 'G0x': expected a satellite"),
            ("cc GPS", "cc XYZ", "line 3: scale of time 'XYZ'"),
            ("*  2020  6 25", "*  2020 13 25", "line 4: '*  2020 13 25"),
            ("%c M", "%x M", "line 4: an epoch before the line '%c'"),
            ("*  2020", "/* 2020", "line 5: a position before any epoch"),
        ] {
            let hurt = whole.replacen(right, wrong, 1);
            let error = read(hurt.as_bytes(), "a.sp3").unwrap_err().to_string();
            assert!(error.contains("a.sp3: damaged SP3 file") && error.contains(said), "{error}");
        }
    }

    #[test]
    fn what_is_no_sp3_is_refused_by_name_and_nothing_panics() {
        let whole = format!("{HEAD}{BODY}");
        assert!(matches!(read(b"", "x"), Err(Sp3Error::NotSp3 { .. })));
        assert!(matches!(read(whole.replacen("#d", "#a", 1).as_bytes(), "x"), Err(Sp3Error::NotSp3 { .. })));
        let odd = whole.replace("15  0.00000000", "15  0.50000000");
        assert!(matches!(read(odd.as_bytes(), "x"), Err(Sp3Error::Fraction { line: 9, .. })));
        assert_eq!(read(HEAD.as_bytes(), "x"), Err(Sp3Error::Nothing { name: "x".to_owned() }));
        assert!(matches!(read(&[0x1f, 0x8b, 0, 1], "x"), Err(Sp3Error::Packed { .. })));
        for at in 0..whole.len() {
            let _ = read(&whole.as_bytes()[..at], "x");
            let mut hurt = whole.clone().into_bytes();
            hurt[at] = b"\xe9*-9 \nE"[at % 7];
            let _ = read(&hurt, "x");
        }
    }
}
