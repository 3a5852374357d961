//! Precise orbits and clocks, SP3 versions c and d: an adapter over the `sp3` crate that yields satellites of
//! GPS and Galileo.
//!
//! Source: The Extended Standard Product 3 Orbit Format (SP3-d), S. Hilla, 2016. Positions are of the centre
//! of mass in the axes of the Earth; clocks belong to the ionosphere-free combination of P1 and P2 and leave
//! out the periodic part of relativity, as broadcast ones do before theirs is added. The crate panics on
//! damaged lines, gives a missing clock as 999999 µs, drops fractions of seconds, reads a version a in the
//! wrong time and writes y into the x of velocities, so here the call is fenced, the first three are looked
//! after and versions a and b refused; velocities are not used.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use ::sp3::prelude::{Constellation, SP3, TimeScale, Version};
use nalgebra::Vector3;
use thiserror::Error;

use crate::gnss::inflate::{InflateError, inflate};
use crate::gnss::rinex::clean;
use crate::gnss::satellite::{Sv, System};
use crate::gnss::time::Epoch;

/// Largest file that is read, in bytes after decompression.
const LARGEST_BYTES: u64 = 256 << 20;
/// A clock from here on is none (SP3-d, table of the position record).
const NO_CLOCK_US: f64 = 999_999.0;

/// One satellite at one epoch of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Centre of mass, ECEF.
    pub position_m: Vector3<f64>,
    /// Clock minus the file's time, without relativity's periodic part.
    pub clock_s: Option<f64>,
    /// The clock jumped, or the satellite was manoeuvred, between the epoch before and this one.
    pub broken: bool,
}

/// What a file says about GPS and Galileo: samples by satellite and GPS time (its whole seconds).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Precise {
    /// Samples of each satellite by GPS time.
    pub satellites: BTreeMap<Sv, BTreeMap<i64, Sample>>,
}

/// Why a file gives no orbits.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Sp3Error {
    /// A file that cannot be decompressed.
    #[error("{name}: {source}: expected an SP3 file, plain or gzip")]
    Packed {
        /// Name of the file.
        name: String,
        /// Why.
        source: InflateError,
    },
    /// No SP3 file.
    #[error("{name}: begins with '{found}': expected an SP3 file of version c or d (#cP… or #dP…)")]
    NotSp3 {
        /// Name of the file.
        name: String,
        /// How it begins.
        found: String,
    },
    /// A line that is not as the format has it.
    #[error("{name}: damaged SP3 file ({detail}): expected version c or d as the format has it")]
    Damaged {
        /// Name of the file.
        name: String,
        /// Where and what.
        detail: String,
    },
    /// An epoch between two seconds.
    #[error("{name}:{line}: '{found}': expected an epoch at a whole second")]
    Fraction {
        /// Name of the file.
        name: String,
        /// Its number, from 1.
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
    check_lines(&text, name)?;
    let damaged = |detail: String| Sp3Error::Damaged { name: name.to_owned(), detail };
    let file = quietly(|| SP3::from_reader(&mut BufReader::new(text.as_slice())))
        .map_err(|()| damaged("its parser gave up on a malformed line".to_owned()))?
        .map_err(|error| damaged(error.to_string()))?;
    if !matches!(file.header.version, Version::C | Version::D) {
        return Err(damaged(format!("version {}", file.header.version)));
    }
    let mut precise = Precise::default();
    for (key, entry) in &file.data {
        let (x_km, y_km, z_km) = entry.position_km;
        let position_m = Vector3::new(x_km, y_km, z_km) * 1e3;
        let system = match key.sv.constellation {
            Constellation::GPS => System::Gps,
            Constellation::Galileo => System::Galileo,
            _ => continue,
        };
        let sv = Sv { system, number: key.sv.prn };
        // Orbits of any age: 26 560 km and an eccentricity below 0.1, 29 600 km, and two of 27 980 km and
        // 0.16.
        let radius_m = position_m.norm();
        if !(2.3e7..=3.3e7).contains(&radius_m) {
            let epoch = key.epoch;
            let what = format!("{sv} at {epoch}: {radius_m:e} m from the Earth's centre, expected 2.3e7 to 3.3e7");
            return Err(damaged(what));
        }
        let nanoseconds = key.epoch.to_time_scale(TimeScale::GPST).duration.total_nanoseconds();
        let seconds = i64::try_from(nanoseconds / 1_000_000_000).map_err(|e| damaged(e.to_string()))?;
        let clock_s = entry.clock_us.filter(|us| us.abs() < NO_CLOCK_US).map(|us| us * 1e-6);
        let sample = Sample { position_m, clock_s, broken: entry.clock_event || entry.maneuver };
        precise.satellites.entry(sv).or_default().insert(seconds, sample);
    }
    if precise.satellites.is_empty() { Err(Sp3Error::Nothing { name: name.to_owned() }) } else { Ok(precise) }
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs what may panic; its panic becomes `Err` and prints nothing. Panics elsewhere print as before.
fn quietly<T>(run: impl FnOnce() -> T) -> Result<T, ()> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !QUIET.with(Cell::get) {
                previous(info);
            }
        }));
    });
    let before = QUIET.with(|quiet| quiet.replace(true));
    let outcome = catch_unwind(AssertUnwindSafe(run));
    QUIET.with(|quiet| quiet.set(before));
    outcome.map_err(|_| ())
}

/// The first line's version, and that epochs are at whole seconds.
fn check_lines(text: &[u8], name: &str) -> Result<(), Sp3Error> {
    // `clean` left nothing but ASCII.
    let text = String::from_utf8_lossy(text);
    let first = text.lines().next().unwrap_or_default();
    if !["#cP", "#cV", "#dP", "#dV"].iter().any(|begin| first.starts_with(begin)) {
        let found = first.chars().take(40).flat_map(char::escape_default).collect();
        return Err(Sp3Error::NotSp3 { name: name.to_owned(), found });
    }
    for (index, line) in text.lines().enumerate().filter(|(_, line)| line.starts_with("*  ")) {
        let fraction = line.split_once('.').map_or("", |(_, digits)| digits.trim_end());
        if fraction.bytes().any(|digit| digit != b'0') {
            let found = line.chars().take(40).flat_map(char::escape_default).collect();
            return Err(Sp3Error::Fraction { name: name.to_owned(), line: index + 1, found });
        }
    }
    Ok(())
}

impl Precise {
    /// Takes in what another file says; where both say something, that one counts.
    pub fn extend(&mut self, other: Self) {
        for (sv, samples) in other.satellites {
            self.satellites.entry(sv).or_default().extend(samples);
        }
    }

    /// The first and the last epoch of any satellite.
    pub fn span(&self) -> Option<(Epoch, Epoch)> {
        let first = self.satellites.values().filter_map(|samples| samples.keys().next()).min()?;
        let last = self.satellites.values().filter_map(|samples| samples.keys().next_back()).max()?;
        Some((Epoch::new(*first, 0.0), Epoch::new(*last, 0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
