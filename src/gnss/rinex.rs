//! RINEX navigation files, versions 2 to 4: an adapter over the `rinex` crate that yields GPS LNAV ephemerides.
//!
//! Source: RINEX 2.11, table A4; RINEX 3.05, table A6; RINEX 4.02. The crate panics on some damaged files,
//! refuses non-ASCII bytes and checks no ranges, so here the bytes are filtered, the call is fenced
//! and every element is held against the range of its LNAV field (IS-GPS-200N, tables 20-I and
//! 20-III). Before that, records that are not in form are taken out (`columns`). A record that fails is left out and named
//! in [`Navigation::skipped`].

mod columns;

use std::cell::Cell;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use ::rinex::navigation::{Ephemeris as Frame, NavKey, NavMessageType};
use ::rinex::prelude::{Constellation, Rinex, TimeScale};
use ::rinex::record::{ParsingDiagnostic, ParsingDiagnosticKind};
use thiserror::Error;

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::inflate::{InflateError, inflate};
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::satellite::Sv;
use crate::gnss::time::{Epoch, WEEK_S};
use columns::Sifted;

/// Largest file that is read, in bytes after decompression.
pub const LARGEST_BYTES: u64 = 256 << 20;

/// What a navigation file says about GPS.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Navigation {
    /// GPS LNAV sets by satellite and time of clock.
    pub ephemerides: Vec<Ephemeris>,
    pub klobuchar: Option<Klobuchar>,
    /// GPS time minus UTC, in whole seconds.
    pub leap_seconds: Option<i64>,
    /// Records that were left out, each with its reason.
    pub skipped: Vec<String>,
}

/// Why a file gives no navigation data.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NavigationError {
    #[error("{name}: more than {LARGEST_BYTES} bytes after decompression: expected a RINEX navigation file")]
    TooLarge { name: String },
    #[error("{name}: damaged gzip data ({detail}): expected a RINEX navigation file, plain or gzip")]
    Gzip { name: String, detail: String },
    #[error("{name}: begins with '{found}': expected a first line that ends in RINEX VERSION / TYPE")]
    NotRinex { name: String, found: String },
    #[error("{name}: a RINEX file of type '{found}': expected navigation data (N)")]
    NotNavigation { name: String, found: String },
    #[error("{name}: damaged RINEX file ({detail}): expected navigation data of version 2, 3 or 4")]
    Damaged { name: String, detail: String },
    #[error("{name}: no usable GPS ephemeris: found {found}")]
    Nothing { name: String, found: String },
}

/// The whole day of 2010-07-01 as broadcast: what a scene uses that names no file.
///
/// # Errors
/// As [`read`]; a test sees to it that there are none.
pub fn embedded() -> Result<Navigation, NavigationError> {
    read(include_bytes!("../../data/brdc1820-2010.n.gz"), "embedded brdc1820-2010.n.gz")
}

/// Reads a navigation file, plain or gzip, whose `name` goes into errors.
///
/// # Errors
/// [`NavigationError`], also when not one usable GPS LNAV ephemeris is in it.
pub fn read(bytes: &[u8], name: &str) -> Result<Navigation, NavigationError> {
    let text = clean(&unpack(bytes, name)?);
    check_first_line(&text, name)?;
    let sifted = columns::sift(&text);
    let damaged = |detail: String| NavigationError::Damaged { name: name.to_owned(), detail };
    let found = quietly(|| extract(&sifted))
        .map_err(|()| damaged("its parser gave up on a malformed line".to_owned()))?
        .map_err(damaged)?;
    if found.navigation.ephemerides.is_empty() {
        let reasons = found.navigation.skipped.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
        let found = format!(
            "{} records of other systems or messages, {} GPS records left out{}{reasons}",
            found.others,
            found.navigation.skipped.len(),
            if reasons.is_empty() { "" } else { ": " },
        );
        return Err(NavigationError::Nothing { name: name.to_owned(), found });
    }
    Ok(found.navigation)
}

fn unpack(bytes: &[u8], name: &str) -> Result<Vec<u8>, NavigationError> {
    inflate(bytes, LARGEST_BYTES).map_err(|error| match error {
        InflateError::TooLarge(_) => NavigationError::TooLarge { name: name.to_owned() },
        InflateError::Damaged(detail) => NavigationError::Gzip { name: name.to_owned(), detail },
    })
}

/// ASCII with line feeds: no byte order mark, `?` for foreign bytes, one kind of line end.
pub(super) fn clean(bytes: &[u8]) -> Vec<u8> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut text = Vec::with_capacity(bytes.len());
    let mut previous = 0;
    for &byte in bytes {
        match byte {
            b'\n' if previous == b'\r' => {}
            b'\r' => text.push(b'\n'),
            _ => text.push(if byte.is_ascii() { byte } else { b'?' }),
        }
        previous = byte;
    }
    text
}

fn check_first_line(text: &[u8], name: &str) -> Result<(), NavigationError> {
    let line: String = text.iter().take_while(|b| **b != b'\n').take(80).map(|b| char::from(*b)).collect();
    if line.get(60..).is_none_or(|label| label.trim_end() != "RINEX VERSION / TYPE") {
        return Err(NavigationError::NotRinex { name: name.to_owned(), found: line.trim_end().to_owned() });
    }
    match line.get(20..21) {
        Some("N" | "n") => Ok(()),
        found => {
            Err(NavigationError::NotNavigation { name: name.to_owned(), found: found.unwrap_or_default().to_owned() })
        }
    }
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs what may panic; its panic becomes `Err` and prints nothing. Panics elsewhere print as before.
pub(super) fn quietly<T>(run: impl FnOnce() -> T) -> Result<T, ()> {
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

struct Found {
    navigation: Navigation,
    others: usize,
}

fn extract(sifted: &Sifted) -> Result<Found, String> {
    let (file, diagnostics) = Rinex::parse_with_diagnostics(&mut BufReader::new(sifted.text.as_slice()))
        .map_err(|error| error.to_string())?;
    let mut navigation = Navigation {
        klobuchar: klobuchar(&file),
        leap_seconds: file.header.leap.map(|leap| i64::from(leap.leap)),
        skipped: [sifted.reasons.clone(), skipped(sifted, &diagnostics)].concat(),
        ..Navigation::default()
    };
    let mut others = 0;
    for (key, frame) in file.nav_ephemeris_frames_iter() {
        if key.sv.constellation != Constellation::GPS || key.msgtype != NavMessageType::LNAV {
            others += 1;
            continue;
        }
        match ephemeris(key, frame) {
            Ok(set) => navigation.ephemerides.push(set),
            Err(reason) => navigation.skipped.push(format!("G{:02} at {}: {reason}", key.sv.prn, key.epoch)),
        }
    }
    navigation.ephemerides.sort_by_key(|set| (set.sv, set.toc.seconds()));
    Ok(Found { navigation, others })
}

/// What the crate dropped of GPS; records of other systems and faithful repetitions are no loss.
fn skipped(sifted: &Sifted, diagnostics: &[ParsingDiagnostic]) -> Vec<String> {
    if diagnostics.is_empty() {
        return Vec::new();
    }
    // `clean` left nothing but ASCII.
    let text = String::from_utf8_lossy(&sifted.text);
    let lines: Vec<&str> = text.lines().collect();
    let head = lines.iter().position(|line| line.contains("END OF HEADER")).unwrap_or(0);
    // The crate counts from the header's last line.
    let number = |at: usize| sifted.lines.get(head + at).copied().unwrap_or_default();
    let mut reasons = Vec::new();
    for diagnostic in diagnostics {
        let line = lines.get(head + diagnostic.record_line).copied().unwrap_or_default();
        // Version 4 has a line of its own before the record; version 2 has no letter.
        let named = line.strip_prefix("> EPH ").unwrap_or(line);
        if !named.starts_with(|first: char| first == 'G' || first == ' ' || first.is_ascii_digit()) {
            continue;
        }
        let what = match &diagnostic.kind {
            ParsingDiagnosticKind::NavigationFailure(error) => error.to_string(),
            ParsingDiagnosticKind::DuplicateNavigation { conflicting: true, previous_record_line, .. } => {
                format!("replaces a different record of the same time at line {}", number(*previous_record_line))
            }
            _ => continue,
        };
        let label: String = line.chars().take(23).collect();
        reasons.push(format!("line {} ({label}): {what}", number(diagnostic.record_line)));
    }
    reasons
}

fn klobuchar(file: &Rinex) -> Option<Klobuchar> {
    let header = file.header.ionod_corrections.get(&Constellation::GPS).and_then(|model| model.as_klobuchar());
    let body = || {
        file.nav_ionosphere_models_iter()
            .filter(|(key, _)| key.sv.constellation == Constellation::GPS)
            .find_map(|(_, model)| model.as_klobuchar())
    };
    let model = header.or_else(body)?;
    let array = |t: (f64, f64, f64, f64)| [t.0, t.1, t.2, t.3];
    let found = Klobuchar { alpha: array(model.alpha), beta: array(model.beta) };
    found.alpha.iter().chain(&found.beta).all(|value| value.is_finite()).then_some(found)
}

/// Elements with the crate's key and the largest magnitude that their LNAV field can hold, in SI units.
fn field(frame: &Frame, key: &'static str, least: f64, most: f64) -> Result<f64, String> {
    let value = frame.get_orbit_f64(key).ok_or_else(|| format!("{key} is blank"))?;
    within(key, value, least, most)
}

fn within(key: &str, value: f64, least: f64, most: f64) -> Result<f64, String> {
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{key} = {value:e}: expected {least:e} to {most:e}"))
    }
}

fn whole(frame: &Frame, key: &'static str, most: u32) -> Result<u32, String> {
    let value = field(frame, key, 0.0, f64::from(most))?;
    if value == value.floor() { Ok(value as u32) } else { Err(format!("{key} = {value}: expected a whole number")) }
}

fn ephemeris(key: &NavKey, frame: &Frame) -> Result<Ephemeris, String> {
    // Field ranges of IS-GPS-200N, tables 20-I and 20-III; RINEX rounds to twelve digits.
    const ANGLE_RAD: f64 = 2.0 * std::f64::consts::TAU;
    const HARMONIC_RAD: f64 = 6.104e-5;
    const HARMONIC_M: f64 = 1024.001;
    let both = |name, most: f64| field(frame, name, -most, most);

    let number = key.sv.prn;
    if !(1..=32).contains(&number) {
        return Err(format!("PRN {number}: expected 1 to 32"));
    }
    let toc = epoch(key)?;
    let toe = near(toc, field(frame, "toe", 0.0, 604_800.0)?);
    let week = f64::from(whole(frame, "week", 9999)?);
    let astray = (week - toe.week() as f64).abs() % 1024.0;
    if astray > 1.0 && astray < 1023.0 {
        return Err(format!("week = {week}: expected that of its epoch, {}", toe.week()));
    }
    // The last line of a record begins with it: without it the file was cut, perhaps inside a number.
    if frame.get_orbit_f64("t_tm").is_none() {
        return Err("no transmission time: the record is cut short".to_owned());
    }
    let iode = whole(frame, "iode", 255)?;
    let iodc = if frame.get_orbit_f64("iodc").is_some() { whole(frame, "iodc", 1023)? } else { iode };
    Ok(Ephemeris {
        sv: Sv::gps(number),
        toe,
        toc,
        transmitted: transmitted(frame, toe),
        iode: iode as u8,
        iodc: iodc as u16,
        ura_index: ura_index(frame.get_orbit_f64("accuracy")),
        health: whole(frame, "health", 63)? as u8,
        l2_codes: if frame.get_orbit_f64("l2Codes").is_some() { whole(frame, "l2Codes", 3)? as u8 } else { 0 },
        l2_p_data_off: frame.get_orbit_f64("l2p").is_some_and(|flag| flag != 0.0),
        // Hours or the flag itself, as the file's producer meant it; blank is the usual four hours.
        long_fit: frame.get_orbit_f64("fitInt").is_some_and(|fit| fit == 1.0 || fit > 4.0),
        aodo: 0,
        sqrt_a_sqrtm: field(frame, "sqrta", 5000.0, 5300.0)?,
        eccentricity: field(frame, "e", 0.0, 0.1)?,
        m0_rad: both("m0", ANGLE_RAD)?,
        delta_n_radps: both("deltaN", 1.171e-8)?,
        omega0_rad: both("omega0", ANGLE_RAD)?,
        omega_dot_radps: both("omegaDot", 2.997e-6)?,
        omega_rad: both("omega", ANGLE_RAD)?,
        i0_rad: field(frame, "i0", 0.0, std::f64::consts::PI)?,
        idot_radps: both("idot", 2.927e-9)?,
        cuc_rad: both("cuc", HARMONIC_RAD)?,
        cus_rad: both("cus", HARMONIC_RAD)?,
        crc_m: both("crc", HARMONIC_M)?,
        crs_m: both("crs", HARMONIC_M)?,
        cic_rad: both("cic", HARMONIC_RAD)?,
        cis_rad: both("cis", HARMONIC_RAD)?,
        af0_s: within("af0", frame.clock_bias, -9.766e-4, 9.766e-4)?,
        af1_sps: within("af1", frame.clock_drift, -3.726e-9, 3.726e-9)?,
        af2_sps2: within("af2", frame.clock_drift_rate, -3.553e-15, 3.553e-15)?,
        tgd_s: both("tgd", 5.961e-8)?,
    })
}

fn epoch(key: &NavKey) -> Result<Epoch, String> {
    let nanoseconds = key.epoch.to_time_scale(TimeScale::GPST).duration.total_nanoseconds();
    let seconds = i64::try_from(nanoseconds.div_euclid(1_000_000_000)).map_err(|e| e.to_string())?;
    // 1980 to 2180, so that whole seconds and calendar dates are safe to handle.
    if !(0..=6_400_000_000).contains(&seconds) {
        return Err(format!("epoch {}: expected 1980 to 2180", key.epoch));
    }
    Ok(Epoch::new(seconds, nanoseconds.rem_euclid(1_000_000_000) as f64 * 1e-9))
}

/// The instant nearest to `anchor` with that time of week.
fn near(anchor: Epoch, tow_s: f64) -> Epoch {
    let week_s = WEEK_S as f64;
    let start = Epoch::new(anchor.week() * WEEK_S, 0.0);
    let ahead_s = tow_s - anchor.tow_s();
    start.plus_s(tow_s - (ahead_s / week_s).round() * week_s)
}

/// Time of transmission, or two hours before the reference time where the file leaves it out or fills it.
fn transmitted(frame: &Frame, toe: Epoch) -> Epoch {
    let assumed = toe.plus_s(-7200.0);
    match frame.get_orbit_f64("t_tm") {
        Some(tow_s) if tow_s.abs() <= 2.0 * WEEK_S as f64 => {
            let said = near(toe, tow_s.rem_euclid(WEEK_S as f64));
            if said.since(toe).abs() <= 86_400.0 { said } else { assumed }
        }
        _ => assumed,
    }
}

/// The index whose interval holds an accuracy in metres (IS-GPS-200N, 20.3.3.3.1.3); blank is 15, no prediction.
fn ura_index(accuracy_m: Option<f64>) -> u8 {
    const UPPER_M: [f64; 15] =
        [2.4, 3.4, 4.85, 6.85, 9.65, 13.65, 24.0, 48.0, 96.0, 192.0, 384.0, 768.0, 1536.0, 3072.0, 6144.0];
    let Some(accuracy_m) = accuracy_m.filter(|value| *value >= 0.0) else { return 15 };
    UPPER_M.iter().take_while(|upper| accuracy_m > **upper).count() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_day_reads_whole() {
        let day = embedded().unwrap();
        // Counted in the file: 421 records (`grep -c '^[ 123][0-9] 10'`), 32 satellites.
        assert_eq!(day.ephemerides.len(), 421, "{:?}", day.skipped);
        assert!(day.skipped.is_empty());
        assert_eq!(day.leap_seconds, Some(15));
        let expected = Klobuchar {
            alpha: [0.4657e-8, 0.1490e-7, -0.5960e-7, -0.1192e-6],
            beta: [0.8192e5, 0.8192e5, -0.6554e5, -0.5243e6],
        };
        assert_eq!(day.klobuchar, Some(expected));
        let first = &day.ephemerides[0];
        assert_eq!((first.sv, first.health, first.iode, first.ura_index), (Sv::gps(1), 63, 63, 0));
        assert_eq!(first.toe, Epoch::from_week(1590, 345_600.0));
        assert_eq!(first.transmitted, Epoch::from_week(1590, 341_670.0));
        assert_eq!(first.sqrt_a_sqrtm, 0.515480139732e4);
    }

    #[test]
    fn times_of_week_wrap_to_the_nearest_week() {
        let anchor = Epoch::from_week(1590, 604_000.0);
        assert_eq!(near(anchor, 0.0), Epoch::from_week(1591, 0.0));
        assert_eq!(near(anchor, 604_784.0), Epoch::from_week(1590, 604_784.0));
        assert_eq!(near(Epoch::from_week(1591, 16.0), 604_784.0), Epoch::from_week(1590, 604_784.0));
    }

    #[test]
    fn accuracies_become_the_index_of_their_interval() {
        let cases = [(0.0, 0), (2.0, 0), (2.8, 1), (4.0, 2), (16.0, 6), (4096.0, 14), (8192.0, 15)];
        for (metres, index) in cases {
            assert_eq!(ura_index(Some(metres)), index);
        }
        assert_eq!(ura_index(None), 15);
    }

    #[test]
    fn damaged_files_give_errors_and_never_half_an_ephemeris() {
        let whole = unpack(include_bytes!("../../data/brdc1820-2010.n.gz"), "test").unwrap();
        let head = &whole[..whole.len().min(4000)];
        let reference = read(head, "head").unwrap();
        for cut in 0..head.len() {
            if let Ok(part) = read(&head[..cut], "cut") {
                for set in part.ephemerides {
                    // What only the last line holds may be cut without harm to the elements.
                    let whole = |r: &&Ephemeris| (r.sv, r.toe) == (set.sv, set.toe);
                    let original = reference.ephemerides.iter().find(whole).unwrap();
                    let (transmitted, long_fit) = (set.transmitted, set.long_fit);
                    assert_eq!(set, Ephemeris { transmitted, long_fit, ..original.clone() }, "cut at {cut}");
                }
            }
        }
        for (bytes, name) in [(&b""[..], "empty"), (b"\xff\xfe\x00", "noise"), (b"\x1f\x8b", "gzip head")] {
            assert!(read(bytes, name).unwrap_err().to_string().starts_with(name));
        }
        let packed = include_bytes!("../../data/brdc1820-2010.n.gz");
        for cut in (1..packed.len()).step_by(5003) {
            assert!(read(&packed[..cut], "cut").is_err());
        }
        // Every header line blanked in turn, a foreign byte, other line ends, a byte order mark.
        let text = String::from_utf8(head.to_vec()).unwrap();
        for victim in 0..12 {
            let lines =
                text.lines().enumerate().map(|(i, line)| if i == victim { &line[..line.len() / 3] } else { line });
            let _ = read(lines.collect::<Vec<_>>().join("\n").as_bytes(), "line cut");
        }
        let foreign = text.replacen("BROADCAST", "BR\u{e9}ADCAST", 1);
        assert_eq!(read(foreign.as_bytes(), "foreign").unwrap().ephemerides, reference.ephemerides);
        let mut other = vec![0xef, 0xbb, 0xbf];
        other.extend(text.replace('\n', "\r\n").into_bytes());
        assert_eq!(read(&other, "crlf").unwrap(), reference);
        assert_eq!(read(text.replace('\n', "\r").as_bytes(), "cr").unwrap(), reference);
        let trimmed: Vec<_> = text.lines().map(str::trim_end).collect();
        assert_eq!(read(trimmed.join("\n").as_bytes(), "trimmed").unwrap(), reference);
        assert_eq!(read(text.replace("D-", "E-").replace("D+", "e+").as_bytes(), "exponents").unwrap(), reference);
    }

    #[test]
    fn elements_out_of_their_field_s_range_leave_the_record_out_with_a_reason() {
        let whole = unpack(include_bytes!("../../data/brdc1820-2010.n.gz"), "test").unwrap();
        let text = String::from_utf8(whole[..3000].to_vec()).unwrap();
        let broken = text.replacen("0.483528291807D-02", "0.483528291807D+02", 1);
        assert_ne!(text, broken);
        let found = read(broken.as_bytes(), "broken").unwrap();
        assert!(found.skipped.iter().any(|reason| reason.contains("G01") && reason.contains("e = ")));
    }
}
