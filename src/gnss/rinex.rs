//! RINEX navigation files, versions 2 to 4: ephemerides of GPS LNAV, Galileo I/NAV (or F/NAV of
//! satellites that have no I/NAV), NavIC, BeiDou D1 or D2, GLONASS, LNAV of QZSS and SBAS, group delays of
//! the signals that came after these by the records of their own messages (CNAV, CNAV-2, B-CNAV1 to 3), the
//! coefficients of these systems' ionosphere but of the last two (of BeiDou those of BDGIM too), times of GPS
//! and Galileo against each other and UTC, and the leap seconds.
//!
//! Source: RINEX 2.11, tables A4 and A10; RINEX 3.05, tables A6, A8, A10, A12 and A18; RINEX 4.02. Lines and
//! columns are read in `columns`; `elements` holds every element against the range of its field in the
//! message. A record that fails is left out and named in [`Navigation::skipped`].
//!
//! A reader of our own, held to the `rinex` crate's in the tests (`tests/witness/orbit.rs`): that crate
//! (0.24) panics where a `LEAP SECONDS` line has no content, refuses a whole file for one foreign letter in
//! a comment, and tests no element's range.

mod columns;
mod delays;
mod elements;

use std::collections::BTreeSet;

use thiserror::Error;

use crate::bdgim::Bdgim;
use crate::broadcast::Ephemeris;
use crate::gps::lnav::LeapEvent;
use crate::inflate::{InflateError, inflate};
use crate::klobuchar::Klobuchar;
use crate::satellite::{Sv, System};
use crate::time::{Epoch, TimePolynomial, WEEK_S};

/// Largest file that is read, in bytes after decompression.
pub const LARGEST_BYTES: u64 = 256 << 20;

/// Content of a navigation file for GPS, Galileo, NavIC, BeiDou, GLONASS, QZSS and SBAS.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Navigation {
    /// Ephemerides of LNAV of GPS and QZSS, Galileo I/NAV, NavIC, BeiDou D1 or D2, GLONASS and SBAS, ordered
    /// by satellite and time of clock. A Galileo satellite without I/NAV has those of F/NAV.
    pub ephemerides: Vec<Ephemeris>,
    /// Klobuchar coefficients of GPS, if the header has them.
    pub klobuchar: Option<Klobuchar>,
    /// Klobuchar coefficients of NavIC, for L5, if the header has them.
    pub klobuchar_navic: Option<Klobuchar>,
    /// Klobuchar coefficients of BeiDou, where the header has them.
    pub klobuchar_beidou: Option<Klobuchar>,
    /// BDGIM coefficients. Version 4 gives the first record that is not all zero. Version 3 gives the
    /// header's lines BDS1 to BDS3, which some providers write.
    pub bdgim: Option<Bdgim>,
    /// Effective ionisation coefficients of NeQuick-G, in solar flux units, per degree, per degree squared.
    pub nequick: Option<[f64; 3]>,
    /// GPS time minus UTC, in whole seconds.
    pub leap_seconds: Option<i64>,
    /// A change of these that the file names.
    pub leap_event: Option<LeapEvent>,
    /// GPS time minus UTC beyond whole seconds.
    pub utc: Option<TimePolynomial>,
    /// Galileo's time minus GPS time, whole weeks apart.
    pub galileo: Option<TimePolynomial>,
    /// Records that were left out, each with its reason.
    pub skipped: Vec<String>,
}

/// Reason for which a file yields no navigation data.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NavigationError {
    /// More than a navigation file can have.
    #[error("{name}: more than {LARGEST_BYTES} bytes after decompression: expected a RINEX navigation file")]
    TooLarge {
        /// Name of the file.
        name: String,
    },
    /// A file that is packed otherwise than by gzip.
    #[error("{name}: {error}")]
    Packed {
        /// Name of the file.
        name: String,
        /// Error of unpacking.
        error: InflateError,
    },
    /// A file that cannot be decompressed.
    #[error("{name}: damaged gzip data ({detail}): expected a RINEX navigation file, plain or gzip")]
    Gzip {
        /// Name of the file.
        name: String,
        /// Description of the error.
        detail: String,
    },
    /// No RINEX file.
    #[error("{name}: begins with '{found}': expected a first line that ends in RINEX VERSION / TYPE")]
    NotRinex {
        /// Name of the file.
        name: String,
        /// First characters of the file.
        found: String,
    },
    /// A RINEX file of something else.
    #[error("{name}: a RINEX file of type '{found}': expected navigation data (N)")]
    NotNavigation {
        /// Name of the file.
        name: String,
        /// File type that was found.
        found: String,
    },
    /// A record or header that is not as the format has it.
    #[error("{name}: damaged RINEX file ({detail}): expected navigation data of version 2, 3 or 4")]
    Damaged {
        /// Name of the file.
        name: String,
        /// Position and description of the error.
        detail: String,
    },
    /// No ephemeris that can be used.
    #[error("{name}: no usable ephemeris of GPS, Galileo, NavIC, BeiDou, GLONASS, QZSS or SBAS: found {found}")]
    Nothing {
        /// Name of the file.
        name: String,
        /// Content that was found instead.
        found: String,
    },
}

/// GPS broadcast of the whole day of 2010-07-01. It is the default of a scene that names no file.
///
/// # Errors
/// Errors of [`read`]; a test makes sure that there are none.
pub fn embedded() -> Result<Navigation, NavigationError> {
    read(include_bytes!("data/brdc1820-2010.n.gz"), "embedded brdc1820-2010.n.gz")
}

/// GPS and Galileo broadcast of the hours around 2020-11-29T12:40. It is the default of scenes of that day.
///
/// # Errors
/// Errors of [`read`]; a test makes sure that there are none.
pub fn embedded_two_systems() -> Result<Navigation, NavigationError> {
    let name = "embedded CARD00ESP_R_20203340900_15H_MN.rnx.gz";
    read(include_bytes!("data/CARD00ESP_R_20203340900_15H_MN.rnx.gz"), name)
}

/// Reads a navigation file, plain or gzip, whose `name` goes into errors.
///
/// # Errors
/// [`NavigationError`], also when not one usable GPS LNAV ephemeris is in it.
pub fn read(bytes: &[u8], name: &str) -> Result<Navigation, NavigationError> {
    let text = clean(&unpack(bytes, name)?);
    check_first_line(&text, name)?;
    let contents = columns::read(&text).map_err(|detail| NavigationError::Damaged { name: name.to_owned(), detail })?;
    let columns::Contents {
        mut records,
        delays,
        klobuchar,
        klobuchar_navic,
        klobuchar_beidou,
        bdgim,
        nequick,
        leap_seconds,
        leap_event,
        utc,
        galileo,
        mut others,
        reasons,
    } = contents;
    // One clock of a satellite: that of I/NAV, from which the other's follows.
    let before = records.len();
    let with_inav: BTreeSet<Sv> = records.iter().filter(|record| !record.is_fnav).map(|record| record.sv).collect();
    records.retain(|record| !record.is_fnav || !with_inav.contains(&record.sv));
    others += before - records.len();
    let leap_event = leap_event.map(|(after_s, week, day)| LeapEvent { after_s, week, day });
    let mut navigation = Navigation {
        klobuchar,
        klobuchar_navic,
        klobuchar_beidou,
        bdgim,
        nequick,
        leap_seconds,
        leap_event,
        skipped: reasons,
        ..Navigation::default()
    };
    let mut found: Vec<(usize, Ephemeris)> = Vec::new();
    for record in &records {
        match elements::ephemeris(record) {
            Ok(set) => found.push((record.line, set)),
            Err(reason) => {
                let skipped = format!("line {} ({} {}): {reason}", record.line, record.sv, record.toc);
                navigation.skipped.push(skipped);
            }
        }
    }
    // Converters join the orbit of a new ephemeris of BeiDou to the clock of the one before, for the message
    // has no mark of an ephemeris.
    let whole: BTreeSet<(Sv, i64)> =
        found.iter().filter(|(_, set)| set.toe == set.toc).map(|(_, set)| (set.sv, set.toe.seconds())).collect();
    found.retain(|(line, set)| {
        let is_joined = set.sv.system == System::BeiDou && set.toe != set.toc;
        let is_astray = is_joined && whole.contains(&(set.sv, set.toe.seconds()));
        if is_astray {
            let what = format!("the orbit of {} with an older clock: another record has both", set.toe);
            navigation.skipped.push(format!("line {line} ({} {}): {what}", set.sv, set.toc));
        }
        !is_astray
    });
    // Of ephemerides of one time the one that was sent last goes first, and stays.
    found.sort_by(|(line, a), (other, b)| {
        let of_time = (a.sv, a.toc.seconds(), a.toe.seconds()).cmp(&(b.sv, b.toc.seconds(), b.toe.seconds()));
        let newer = b.transmitted.since(a.transmitted).total_cmp(&0.0);
        of_time.then(a.toc.fraction().total_cmp(&b.toc.fraction())).then(newer).then(other.cmp(line))
    });
    for (line, set) in found {
        match navigation.ephemerides.last() {
            Some(kept) if (kept.sv, kept.toc, kept.toe) == (set.sv, set.toc, set.toe) => {
                if *kept != set {
                    let what = "another record of the same time, sent later or further down, replaces it";
                    navigation.skipped.push(format!("line {line} ({} {}): {what}", set.sv, set.toc));
                }
            }
            _ => navigation.ephemerides.push(set),
        }
    }
    delays::give(&mut navigation.ephemerides, &delays);
    let near = navigation.ephemerides.first().map(|first| first.toe);
    let mut offset = |line: Option<columns::Polynomial>, allowed| {
        let found = polynomial(line?, near?, allowed);
        found.unwrap_or_else(|reason| {
            navigation.skipped.push(reason);
            None
        })
    };
    (navigation.utc, navigation.galileo) = (offset(utc, &OF_UTC), offset(galileo, &OF_GALILEO));
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

/// Permitted relation between two times of a record.
struct Allowed {
    what: &'static str,
    a0_s: f64,
    a1_sps: f64,
    /// Test of a reference time, and the words for what it must satisfy.
    is_time: fn(f64) -> bool,
    time: &'static str,
    /// Weeks that the message distinguishes.
    weeks: i64,
}

/// IS-GPS-200N, table 20-IX: the field's step and its largest value inside a week.
const OF_UTC: Allowed = Allowed {
    what: "UTC",
    a0_s: 1.0,
    a1_sps: 7.451e-9,
    is_time: |tow_s| tow_s.rem_euclid(4096.0) == 0.0 && (0.0..=602_112.0).contains(&tow_s),
    time: "a multiple of 4096 s up to 602112",
    weeks: 256,
};
/// Galileo OS SIS ICD 2.1, table 69; files write times of transmission too.
const OF_GALILEO: Allowed = Allowed {
    what: "Galileo's time",
    a0_s: 9.54e-7,
    a1_sps: 9.1e-13,
    is_time: |tow_s| (0.0..WEEK_S as f64).contains(&tow_s),
    time: "a time of week",
    weeks: 64,
};

/// One time against another with its week near `anchor`, for files write it counted on or modulo 1024 or 256;
/// none where all is zero, as files have it that know nothing.
fn polynomial(line: columns::Polynomial, anchor: Epoch, allowed: &Allowed) -> Result<Option<TimePolynomial>, String> {
    let columns::Polynomial { a0_s, a1_sps, tow_s, week } = line;
    if (a0_s, a1_sps) == (0.0, 0.0) && tow_s == 0.0 {
        return Ok(None);
    }
    if !(allowed.is_time)(tow_s) || a0_s.abs() > allowed.a0_s || a1_sps.abs() > allowed.a1_sps {
        return Err(format!(
            "{}: A0 = {a0_s:e}, A1 = {a1_sps:e}, reference time {tow_s} s: expected at most {} s and {:e} s/s in size, \
             and {}",
            allowed.what, allowed.a0_s, allowed.a1_sps, allowed.time
        ));
    }
    let half = allowed.weeks / 2;
    let ahead = (week - anchor.week() + half).rem_euclid(allowed.weeks) - half;
    let reference = Epoch::new((anchor.week() + ahead) * WEEK_S, tow_s);
    Ok(Some(TimePolynomial { a0_s, a1_sps, reference }))
}

fn unpack(bytes: &[u8], name: &str) -> Result<Vec<u8>, NavigationError> {
    inflate(bytes, LARGEST_BYTES).map_err(|error| match error {
        InflateError::TooLarge(_) => NavigationError::TooLarge { name: name.to_owned() },
        error @ InflateError::Packed(_) => NavigationError::Packed { name: name.to_owned(), error },
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
        Some("N" | "n" | columns::OLD_GLONASS) => Ok(()),
        found => {
            Err(NavigationError::NotNavigation { name: name.to_owned(), found: found.unwrap_or_default().to_owned() })
        }
    }
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
        let utc = TimePolynomial { a0_s: -0.838190317154e-8, a1_sps: -0.213162820728e-13, reference };
        assert_eq!((day.utc, day.leap_event), (Some(utc), None));
        let first = &day.ephemerides[0];
        assert_eq!((first.sv, first.health, first.iode, first.ura_index), (Sv::gps(1), 63, 63, 0));
        assert_eq!(first.toe, Epoch::from_week(1590, 345_600.0));
        assert_eq!(first.transmitted, Epoch::from_week(1590, 341_670.0));
        assert_eq!(first.sqrt_a_sqrtm, 0.515480139732e4);
    }

    #[test]
    fn coefficients_of_bdgim_are_the_first_that_are_not_all_zero_by_header_or_record() {
        let whole = unpack(include_bytes!("data/brdc1820-2010.n.gz"), "test").unwrap();
        let text = String::from_utf8(whole[..3000].to_vec()).unwrap();
        let records = text.split_once("END OF HEADER").unwrap().1.split_once('\n').unwrap().1;
        let record: Vec<&str> = records.lines().take(8).collect();
        let first = record[0].replacen(" 1 10  7  1  0  0  0.0", "G01 2010 07 01 00 00 00", 1);
        let rest: Vec<String> = record[1..].iter().map(|line| format!(" {line}")).collect();
        let set = format!("{first}\n{}\n", rest.join("\n"));
        let line = |text: &str, label: &str| format!("{text:<60}{label}\n");
        let head = |version: &str| line(&format!("{version:>9}{:11}N{:19}M", "", ""), "RINEX VERSION / TYPE");
        let end = line("", "END OF HEADER");
        let read = |text: String| read(text.as_bytes(), "bdgim").unwrap();

        // Three numbers a line, and a mark of time behind the fourth field.
        let third = |name: &str, values: [f64; 3], mark: &str| {
            let values = values.map(|value| format!("{value:>12.4e}")).concat();
            line(&format!("{name} {values}{:12} {mark}", ""), "IONOSPHERIC CORR")
        };
        let lines = |first: f64, mark: &str| {
            third("BDS1", [first, -1.78, 5.172], mark)
                + &third("BDS2", [3.13, -4.59, 0.325], mark)
                + &third("BDS3", [-0.078, 1.243, 0.378], mark)
        };
        let three = |header: &str| read(head("3.04") + header + &end + &set);
        let expected = |first: f64| Bdgim::given([first, -1.78, 5.172, 3.13, -4.59, 0.325, -0.078, 1.243, 0.378]);
        let found = three(&(lines(14.0, "B") + &lines(13.0, "A")));
        assert_eq!((found.bdgim, &found.skipped), (expected(13.0), &Vec::new()));
        assert_eq!(three(&(third("BDS1", [9.0; 3], "A") + &lines(14.0, "B"))).bdgim, expected(14.0));
        assert_eq!(three(&third("BDS1", [9.0; 3], "A")).bdgim, None);
        let damaged = three(&lines(14.0, "A").replace("BDS2", "BDS2 x"));
        assert!(damaged.bdgim.is_none() && damaged.skipped[0].contains("line 3 (IONOSPHERIC CORR)"), "{damaged:?}");

        let ion = |sv: &str, hour: u8, values: [f64; 9]| {
            let field = |value: &f64| format!("{value:>19.12e}");
            let text = |values: &[f64]| values.iter().map(field).collect::<String>();
            let [one, two, three] = [&values[..3], &values[3..7], &values[7..]].map(text);
            format!("> ION {sv} CNVX\n    2010 07 01 {hour:02} 00 00{one}\n    {two}\n    {three}\n")
        };
        let sent = [30.875, 0.25, 11.625, 10.375, -12.5, 0.75, 0.0, 3.125, 1.875];
        let four = |body: String| read(head("4.01") + &end + "> EPH G01 LNAV\n" + &set + &body);
        let found = four(ion("C30", 4, [9.0; 9]) + &ion("C25", 2, sent) + &ion("C20", 0, [0.0; 9]));
        assert_eq!((found.bdgim, &found.skipped), (Bdgim::given(sent), &Vec::new()));
        // Records of that name of another system are of another model.
        let other = ion("J02", 0, sent);
        assert_eq!(four(other).bdgim, None);
        for (wrong, expected) in [
            (ion("C30", 4, sent).replace("2010 07 01 04 00 00", "2010 07 01 04 00 xx"), "expected an epoch"),
            (ion("C30", 4, sent).lines().take(3).map(|line| format!("{line}\n")).collect(), "a record of 3 lines"),
            (ion("C30", 4, [128.0; 9]), "coefficient of BDGIM 128 TECU: expected -31.875 to 127.875"),
            (ion("C30", 4, sent).replace("1.0375", "1.03x5"), "column"),
            (ion("C30", 4, sent).replace("1.875000000000e0", "                "), "expected nine coefficients"),
        ] {
            let found = four(wrong.clone());
            let named = found.skipped.iter().any(|reason| reason.contains(expected) && reason.contains("ION C30 CNVX"));
            assert!(found.bdgim.is_none() && named, "{wrong}\n{:?}", found.skipped);
        }
    }

    #[test]
    fn utc_is_read_from_every_version_and_refused_off_its_step() {
        let whole = unpack(include_bytes!("data/brdc1820-2010.n.gz"), "test").unwrap();
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
        let utc = TimePolynomial { a0_s: -8.3819031715e-9, a1_sps: -2.131628207e-14, reference };
        assert_eq!((found.utc, &found.skipped), (Some(utc), &Vec::new()));
        assert_eq!(found.leap_event, Some(LeapEvent { after_s: 16, week: 1694, day: 7 }));

        let sto = "> STO G01 LNAV\n    2010 07 02 19 56 48 GPUT                                  UTC(USNO)\n     \
                   3.456000000000e+05-8.381903171540e-09-2.131628207280e-14 0.000000000000e+00\n";
        let eph = format!("> EPH G01 LNAV\n{}", three(&record));
        let found = read((head("4.00") + &leaps + &end + sto + &eph).as_bytes(), "four").unwrap();
        let utc = TimePolynomial { a0_s: -8.38190317154e-9, a1_sps: -2.13162820728e-14, reference };
        assert_eq!((found.utc, &found.skipped), (Some(utc), &Vec::new()));

        let off = corr.replace("503808", "503809");
        let found = read((head("3.04") + &off + &end + &three(&record)).as_bytes(), "off").unwrap();
        assert!(found.utc.is_none() && found.skipped[0].contains("multiple of 4096"), "{:?}", found.skipped);
        let none = line("GPUT  0.0000000000e+00 0.000000000e+00      0    0", "TIME SYSTEM CORR");
        let found = read((head("3.04") + &none + &end + &three(&record)).as_bytes(), "none").unwrap();
        assert_eq!((found.utc, &found.skipped), (None, &Vec::new()));
    }

    #[test]
    fn the_embedded_hours_have_both_systems_with_ionosphere_and_time() {
        let hours = embedded_two_systems().unwrap();
        // By the file's lines GAL and GAGP, the week that of 2020-11-29.
        assert_eq!(hours.nequick, Some([69.25, 3.5156e-2, -3.9063e-3]));
        let reference = Epoch::from_week(2134, 86_400.0);
        let offset = TimePolynomial { a0_s: -4.9185473472e-9, a1_sps: -1.731947918e-14, reference };
        assert_eq!(hours.galileo, Some(offset));
        // E01's only I/NAV record: `E01 2020 11 29 12 20 00`, data sources 517; the one of F/NAV is left
        // alone.
        let e01: Vec<&Ephemeris> = hours.ephemerides.iter().filter(|set| set.sv.to_string() == "E01").collect();
        let [set] = e01.as_slice() else { panic!("{} sets of E01", e01.len()) };
        assert_eq!((set.iode, set.ura_index, set.health), (74, 107, 0));
        assert_eq!((set.af0_s, set.tgd_s, set.tgd2_s), (-9.928549989127e-4, 4.656612873077e-10, 4.656612873077e-10));
        assert_eq!(set.transmitted, Epoch::from_week(2134, 47_792.0));
    }

    #[test]
    fn damaged_files_give_errors_and_never_half_an_ephemeris() {
        let whole = unpack(include_bytes!("data/brdc1820-2010.n.gz"), "test").unwrap();
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
        let packed = include_bytes!("data/brdc1820-2010.n.gz");
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
        let whole = unpack(include_bytes!("data/brdc1820-2010.n.gz"), "test").unwrap();
        let text = String::from_utf8(whole[..3000].to_vec()).unwrap();
        let broken = text.replacen("0.483528291807D-02", "0.483528291807D+02", 1);
        assert_ne!(text, broken);
        let found = read(broken.as_bytes(), "broken").unwrap();
        assert!(found.skipped.iter().any(|reason| reason.contains("G01") && reason.contains("e = ")));
    }
}
