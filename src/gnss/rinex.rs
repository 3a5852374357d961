//! RINEX navigation files, versions 2 to 4: GPS LNAV ephemerides, the ionosphere's coefficients and the leap seconds.
//!
//! Source: RINEX 2.11, table A4; RINEX 3.05, table A6; RINEX 4.02. Lines and columns are `columns`'s matter;
//! here every element is held against the range of its LNAV field (IS-GPS-200N, tables 20-I and 20-III). A
//! record that fails is left out and named in [`Navigation::skipped`].

mod columns;

use thiserror::Error;

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::gps::lnav::{LeapEvent, UtcPolynomial};
use crate::gnss::inflate::{InflateError, inflate};
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::satellite::Sv;
use crate::gnss::time::{Epoch, WEEK_S};
use columns::Record;

/// Step of the reference time of UTC, and the last one inside a week.
const UTC_STEP_S: f64 = 4096.0;
const UTC_LAST_S: f64 = 602_112.0;
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
    /// A change of these that the file names.
    pub leap_event: Option<LeapEvent>,
    /// GPS time minus UTC beyond whole seconds.
    pub utc: Option<UtcPolynomial>,
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
    let contents = columns::read(&text).map_err(|detail| NavigationError::Damaged { name: name.to_owned(), detail })?;
    let columns::Contents { records, klobuchar, leap_seconds, leap_event, utc, others, reasons } = contents;
    let leap_event = leap_event.map(|(after_s, week, day)| LeapEvent { after_s, week, day });
    let mut navigation = Navigation { klobuchar, leap_seconds, leap_event, skipped: reasons, ..Navigation::default() };
    let mut found: Vec<(usize, Ephemeris)> = Vec::new();
    for record in &records {
        match ephemeris(record) {
            Ok(set) => found.push((record.line, set)),
            Err(reason) => {
                let skipped = format!("line {} (G{:02} {}): {reason}", record.line, record.number, record.toc);
                navigation.skipped.push(skipped);
            }
        }
    }
    // Of sets of one time the one that was sent last goes first, and stays.
    found.sort_by(|(line, a), (other, b)| {
        let of_time = (a.sv, a.toc.seconds()).cmp(&(b.sv, b.toc.seconds()));
        let newer = b.transmitted.since(a.transmitted).total_cmp(&0.0);
        of_time.then(a.toc.fraction().total_cmp(&b.toc.fraction())).then(newer).then(other.cmp(line))
    });
    for (line, set) in found {
        match navigation.ephemerides.last() {
            Some(kept) if (kept.sv, kept.toc) == (set.sv, set.toc) => {
                if *kept != set {
                    let what = "another record of the same time, sent later or further down, replaces it";
                    navigation.skipped.push(format!("line {line} ({} {}): {what}", set.sv, set.toc));
                }
            }
            _ => navigation.ephemerides.push(set),
        }
    }
    if let (Some(line), Some(first)) = (utc, navigation.ephemerides.first()) {
        match utc_polynomial(line, first.toe) {
            Ok(found) => navigation.utc = found,
            Err(reason) => navigation.skipped.push(reason),
        }
    }
    if navigation.ephemerides.is_empty() {
        let reasons = navigation.skipped.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
        let found = format!(
            "{others} records of other systems or messages, {} things left out{}{reasons}",
            navigation.skipped.len(),
            if reasons.is_empty() { "" } else { ": " },
        );
        return Err(NavigationError::Nothing { name: name.to_owned(), found });
    }
    Ok(navigation)
}

/// GPS time against UTC with its week near `anchor`, for files write it counted on or modulo 1024 or 256;
/// none where all is zero, as files have it that know nothing.
fn utc_polynomial(line: columns::UtcLine, anchor: Epoch) -> Result<Option<UtcPolynomial>, String> {
    let columns::UtcLine { a0_s, a1_sps, tow_s, week } = line;
    if (a0_s, a1_sps) == (0.0, 0.0) && tow_s == 0.0 {
        return Ok(None);
    }
    // The field's step and its largest value inside a week (IS-GPS-200N, table 20-IX).
    let on_step = tow_s.rem_euclid(UTC_STEP_S) == 0.0 && (0.0..=UTC_LAST_S).contains(&tow_s);
    if !on_step || a0_s.abs() > 1.0 || a1_sps.abs() > 7.451e-9 {
        return Err(format!(
            "UTC: A0 = {a0_s:e}, A1 = {a1_sps:e}, reference time {tow_s} s: expected at most 1 s and 7.451e-9 s/s in size, and a \
             multiple of {UTC_STEP_S} s up to {UTC_LAST_S}"
        ));
    }
    // Eight bits of the week are in the message.
    let ahead = (week - anchor.week() + 128).rem_euclid(256) - 128;
    let reference = Epoch::new((anchor.week() + ahead) * WEEK_S, tow_s);
    Ok(Some(UtcPolynomial { a0_s, a1_sps, reference }))
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

/// An element that must stand there and lie within its range, in SI units.
fn field(record: &Record, key: &'static str, least: f64, most: f64) -> Result<f64, String> {
    let value = record.get(key).ok_or_else(|| format!("{key} is blank"))?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{key} = {value:e}: expected {least:e} to {most:e}"))
    }
}

fn whole(record: &Record, key: &'static str, most: u32) -> Result<u32, String> {
    let value = field(record, key, 0.0, f64::from(most))?;
    if value == value.floor() { Ok(value as u32) } else { Err(format!("{key} = {value}: expected a whole number")) }
}

fn ephemeris(record: &Record) -> Result<Ephemeris, String> {
    // Field ranges of IS-GPS-200N, tables 20-I and 20-III; RINEX rounds to twelve digits.
    const ANGLE_RAD: f64 = 2.0 * std::f64::consts::TAU;
    const HARMONIC_RAD: f64 = 6.104e-5;
    const HARMONIC_M: f64 = 1024.001;
    let both = |name, most: f64| field(record, name, -most, most);
    let optional = |name, most| if record.get(name).is_some() { whole(record, name, most).map(Some) } else { Ok(None) };

    let toc = record.toc;
    let toe = near(toc, field(record, "toe", 0.0, 604_800.0)?);
    let week = f64::from(whole(record, "week", 9999)?);
    let astray = (week - toe.week() as f64).abs() % 1024.0;
    if astray > 1.0 && astray < 1023.0 {
        return Err(format!("week = {week}: expected that of its epoch, {}", toe.week()));
    }
    // The last line of a record begins with it: without it the file was cut, perhaps inside a number.
    if record.get("t_tm").is_none() {
        return Err("no transmission time: the record is cut short".to_owned());
    }
    let iode = whole(record, "iode", 255)?;
    Ok(Ephemeris {
        sv: Sv::gps(record.number),
        toe,
        toc,
        transmitted: transmitted(record, toe),
        iode: iode as u16,
        iodc: optional("iodc", 1023)?.unwrap_or(iode) as u16,
        ura_index: ura_index(optional_accuracy(record)?),
        health: whole(record, "health", 63)? as u8,
        l2_codes: optional("l2Codes", 3)?.unwrap_or(0) as u8,
        l2_p_data_off: optional("l2p", 1)? == Some(1),
        // Hours or the flag itself, as the file's producer meant it; blank is the usual four hours.
        long_fit: record.get("fitInt").is_some_and(|fit| fit == 1.0 || fit > 4.0),
        aodo: 0,
        sqrt_a_sqrtm: field(record, "sqrta", 5000.0, 5300.0)?,
        eccentricity: field(record, "e", 0.0, 0.1)?,
        m0_rad: both("m0", ANGLE_RAD)?,
        delta_n_radps: both("deltaN", 1.171e-8)?,
        omega0_rad: both("omega0", ANGLE_RAD)?,
        omega_dot_radps: both("omegaDot", 2.997e-6)?,
        omega_rad: both("omega", ANGLE_RAD)?,
        i0_rad: field(record, "i0", 0.0, std::f64::consts::PI)?,
        idot_radps: both("idot", 2.927e-9)?,
        cuc_rad: both("cuc", HARMONIC_RAD)?,
        cus_rad: both("cus", HARMONIC_RAD)?,
        crc_m: both("crc", HARMONIC_M)?,
        crs_m: both("crs", HARMONIC_M)?,
        cic_rad: both("cic", HARMONIC_RAD)?,
        cis_rad: both("cis", HARMONIC_RAD)?,
        af0_s: both("af0", 9.766e-4)?,
        af1_sps: both("af1", 3.726e-9)?,
        af2_sps2: both("af2", 3.553e-15)?,
        tgd_s: both("tgd", 5.961e-8)?,
        tgd2_s: 0.0,
        signal_delays_s: Vec::new(),
    })
}

/// Metres of accuracy, where they are given; a negative one says nothing.
fn optional_accuracy(record: &Record) -> Result<Option<f64>, String> {
    if record.get("accuracy").is_some() { field(record, "accuracy", 0.0, 1e6).map(Some) } else { Ok(None) }
}

/// The instant nearest to `anchor` with that time of week.
fn near(anchor: Epoch, tow_s: f64) -> Epoch {
    let week_s = WEEK_S as f64;
    let start = Epoch::new(anchor.week() * WEEK_S, 0.0);
    let ahead_s = tow_s - anchor.tow_s();
    start.plus_s(tow_s - (ahead_s / week_s).round() * week_s)
}

/// Time of transmission, or two hours before the reference time where the file leaves it out or fills it.
fn transmitted(record: &Record, toe: Epoch) -> Epoch {
    let assumed = toe.plus_s(-7200.0);
    match record.get("t_tm") {
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
    let Some(accuracy_m) = accuracy_m else { return 15 };
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
        // The file's week is 1590 modulo 1024.
        let reference = Epoch::from_week(1590, 503_808.0);
        let utc = UtcPolynomial { a0_s: -0.838190317154e-8, a1_sps: -0.213162820728e-13, reference };
        assert_eq!((day.utc, day.leap_event), (Some(utc), None));
        let first = &day.ephemerides[0];
        assert_eq!((first.sv, first.health, first.iode, first.ura_index), (Sv::gps(1), 63, 63, 0));
        assert_eq!(first.toe, Epoch::from_week(1590, 345_600.0));
        assert_eq!(first.transmitted, Epoch::from_week(1590, 341_670.0));
        assert_eq!(first.sqrt_a_sqrtm, 0.515480139732e4);
    }

    #[test]
    fn utc_is_read_from_every_version_and_refused_off_its_step() {
        let whole = unpack(include_bytes!("../../data/brdc1820-2010.n.gz"), "test").unwrap();
        let text = String::from_utf8(whole[..3000].to_vec()).unwrap();
        let records = text.split_once("END OF HEADER").unwrap().1.split_once('\n').unwrap().1;
        let record: Vec<&str> = records.lines().take(8).collect();
        // A record of version 3: another first column and year, one column more before each line.
        let three = |body: &[&str]| {
            let first = body[0].replacen(" 1 10  7  1  0  0  0.0", "G01 2010 07 01 00 00 00", 1);
            let rest: Vec<String> = body[1..].iter().map(|line| format!(" {line}")).collect();
            format!("{first}\n{}\n", rest.join("\n"))
        };
        let line = |text: &str, label: &str| format!("{text:<60}{label}\n");
        let head = |version: &str| line(&format!("{version:>9}{:11}N{:19}G", "", ""), "RINEX VERSION / TYPE");
        let end = line("", "END OF HEADER");
        let corr = line("GPUT -8.3819031715e-09-2.131628207e-14 503808 1590", "TIME SYSTEM CORR");
        let leaps = line("    15    16  1694     7", "LEAP SECONDS");
        let found = read((head("3.04") + &corr + &leaps + &end + &three(&record)).as_bytes(), "three").unwrap();
        let reference = Epoch::from_week(1590, 503_808.0);
        let utc = UtcPolynomial { a0_s: -8.3819031715e-9, a1_sps: -2.131628207e-14, reference };
        assert_eq!((found.utc, &found.skipped), (Some(utc), &Vec::new()));
        assert_eq!(found.leap_event, Some(LeapEvent { after_s: 16, week: 1694, day: 7 }));

        let sto = "> STO G01 LNAV\n    2010 07 02 19 56 48 GPUT                                  UTC(USNO)\n     \
                   3.456000000000e+05-8.381903171540e-09-2.131628207280e-14 0.000000000000e+00\n";
        let eph = format!("> EPH G01 LNAV\n{}", three(&record));
        let found = read((head("4.00") + &leaps + &end + sto + &eph).as_bytes(), "four").unwrap();
        let utc = UtcPolynomial { a0_s: -8.38190317154e-9, a1_sps: -2.13162820728e-14, reference };
        assert_eq!((found.utc, &found.skipped), (Some(utc), &Vec::new()));

        let off = corr.replace("503808", "503809");
        let found = read((head("3.04") + &off + &end + &three(&record)).as_bytes(), "off").unwrap();
        assert!(found.utc.is_none() && found.skipped[0].contains("multiple of 4096"), "{:?}", found.skipped);
        let none = line("GPUT  0.0000000000e+00 0.000000000e+00      0    0", "TIME SYSTEM CORR");
        let found = read((head("3.04") + &none + &end + &three(&record)).as_bytes(), "none").unwrap();
        assert_eq!((found.utc, &found.skipped), (None, &Vec::new()));
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
