//! A navigation file as lines and columns: the header's lines that are used, and records of GPS LNAV, Galileo
//! I/NAV and F/NAV, NavIC and BeiDou D1 and D2, eight lines with a number or nothing in each field of 19
//! columns, and of GLONASS, four lines or, since 3.05, five.
//!
//! Source: RINEX 2.11, tables A3, A4, A10 and A11; RINEX 3.05, tables A5, A6, A8, A10 and A18; RINEX 4.02,
//! tables A9, A13 and A33, and those of NavIC and GLONASS. Where a line is missing, doubled or cut, or text
//! is beside the fields, what follows would be read into the wrong elements; so such a record is left out and
//! named with its line and column, and so is whatever cannot be recognised as of another system. Records of
//! other systems and messages are counted and not read. `record` has the names of fields.

mod corrections;
mod delays;
mod numbers;
mod record;

use crate::bdgim::Bdgim;
use crate::klobuchar::Klobuchar;
use crate::satellite::System;
use crate::time::Epoch;
use corrections::{Thirds, delta_utc, leap_event, system_time};
pub(super) use delays::Delays;
use numbers::{digits, numbers};
pub(super) use record::Record;
use record::{CLOCK_FNAV, MESSAGES, READ, is_spare};

const FIELD: usize = 19;
/// Width of a coefficient in the header, whose lines end in a label from this column on.
const HEADER_FIELD: usize = 12;
const LABEL: usize = 60;

/// Labels that a header of any version may have.
const LABELS: [&str; 21] = [
    "RINEX VERSION / TYPE",
    "PGM / RUN BY / DATE",
    "COMMENT",
    "ION ALPHA",
    "ION BETA",
    "DELTA-UTC: A0,A1,T,W",
    "DELTA UTC: A0,A1,T,W",
    "D-UTC A0,A1,T,W,S,U",
    "CORR TO SYSTEM TIME",
    "IONOSPHERIC CORR",
    "TIME SYSTEM CORR",
    "LEAP SECONDS",
    "REC # / TYPE / VERS",
    "ANT # / TYPE",
    "MERGED FILE",
    "DOI",
    "LICENSE OF USE",
    "STATION INFORMATION",
    "MARKER NAME",
    "MARKER NUMBER",
    "END OF HEADER",
];

/// Type of a file of version 2 with records of GLONASS.
pub(super) const OLD_GLONASS: &str = "G";
/// Kinds of time offsets: GPS time against UTC, and Galileo's against GPS time with its name of older
/// versions.
const UTC: &str = "GPUT";
const GALILEO: &str = "GAGP";
const GALILEO_OLD: &str = "GPGA";

/// Content of a file.
#[derive(Default)]
pub(super) struct Contents {
    pub records: Vec<Record>,
    /// Group delays from the messages whose orbits are not read.
    pub delays: Vec<Delays>,
    pub klobuchar: Option<Klobuchar>,
    /// Klobuchar coefficients as NavIC sends them.
    pub klobuchar_navic: Option<Klobuchar>,
    /// Klobuchar coefficients as BeiDou sends them.
    pub klobuchar_beidou: Option<Klobuchar>,
    /// BDGIM coefficients of BeiDou's third generation.
    pub bdgim: Option<Bdgim>,
    /// Effective ionisation coefficients of Galileo.
    pub nequick: Option<[f64; 3]>,
    pub leap_seconds: Option<i64>,
    /// Seconds after the last or next change, week and day at whose end it comes.
    pub leap_event: Option<(i64, i64, u8)>,
    /// Polynomial of GPS time against UTC: A0, A1, reference time of week, week as written.
    pub utc: Option<Polynomial>,
    /// Polynomial of Galileo's time against GPS time: A0, A1, reference time of week, week as written.
    pub galileo: Option<Polynomial>,
    /// Records of other systems and messages.
    pub others: usize,
    /// Records that were left out, with the reason.
    pub reasons: Vec<String>,
}

/// One time against another as written: constant, rate, time of week and week.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Polynomial {
    pub a0_s: f64,
    pub a1_sps: f64,
    pub tow_s: f64,
    /// Counted on, or modulo 1024 or 256.
    pub week: i64,
}

type Line<'t> = (usize, &'t str);

/// Reads an ASCII text.
///
/// # Errors
/// No header that states how to read the rest.
pub(super) fn read(text: &[u8]) -> Result<Contents, String> {
    let whole = String::from_utf8_lossy(text);
    let all: Vec<Line<'_>> = (1..).zip(whole.lines()).collect();
    let head = all.iter().position(|(_, line)| label(line) == "END OF HEADER").ok_or("no line END OF HEADER")? + 1;
    let (header, body) = all.split_at(head);
    let first = header.first().map_or("", |(_, line)| *line);
    let written = first.get(..9).unwrap_or("").trim();
    let version = written.parse::<f64>().ok().filter(|version| (2.0..5.0).contains(version));
    let version = version.ok_or_else(|| format!("line 1, column 1: version '{written}'"))?;
    let form = Form {
        version: version as u8,
        system: match first.get(20..21) {
            Some(OLD_GLONASS) if version < 3.0 => 'R',
            _ => first.get(40..41).and_then(|letter| letter.chars().next()).unwrap_or(' '),
        },
        cut: (!text.ends_with(b"\n")).then_some(all.len()),
    };
    let mut contents = Contents::default();
    form.header(header, &mut contents);
    // Of what satellites repeat, the first of the day, whatever the order in the file.
    let mut ionosphere: Option<(String, Klobuchar)> = None;
    let mut navic: Option<(String, Klobuchar)> = None;
    let mut beidou: Option<(String, Klobuchar)> = None;
    let mut bdgim: Option<(String, Bdgim)> = None;
    let mut nequick: Option<(String, [f64; 3])> = None;
    let mut utc: Option<(String, Polynomial)> = None;
    let mut galileo: Option<(String, Polynomial)> = None;
    let is_blank = |(_, line): &&Line<'_>| line.trim().is_empty();
    let body = body.get(body.iter().take_while(is_blank).count()..).unwrap_or_default();
    for whole in body.chunk_by(|_, next| is_blank(&next) || !form.begins(next.1)) {
        let group: Vec<Line<'_>> = whole.iter().filter(|line| !is_blank(line)).copied().collect();
        match form.group(&group, whole) {
            Ok(Group::Record(record)) => contents.records.push(*record),
            Ok(Group::Delays(delays)) => contents.delays.push(delays),
            Ok(Group::Ionosphere(System::Navic, age, found)) => keep_first(&mut navic, age, found),
            Ok(Group::Ionosphere(System::BeiDou, age, found)) => keep_first(&mut beidou, age, found),
            Ok(Group::Ionosphere(_, age, found)) => keep_first(&mut ionosphere, age, found),
            Ok(Group::Bdgim(age, found)) => keep_first(&mut bdgim, age, found),
            Ok(Group::Ionisation(age, found)) => keep_first(&mut nequick, age, found),
            Ok(Group::Utc(age, found)) => keep_first(&mut utc, age, found),
            Ok(Group::Galileo(age, found)) => keep_first(&mut galileo, age, found),
            Ok(Group::Other) => contents.others += 1,
            Err(reason) => contents.reasons.push(reason),
        }
    }
    contents.klobuchar = contents.klobuchar.or(ionosphere.map(|(_, found)| found));
    contents.klobuchar_navic = contents.klobuchar_navic.or(navic.map(|(_, found)| found));
    contents.klobuchar_beidou = contents.klobuchar_beidou.or(beidou.map(|(_, found)| found));
    contents.bdgim = contents.bdgim.or(bdgim.map(|(_, found)| found));
    contents.nequick = contents.nequick.or(nequick.map(|(_, found)| found));
    contents.utc = contents.utc.or(utc.map(|(_, found)| found));
    contents.galileo = contents.galileo.or(galileo.map(|(_, found)| found));
    Ok(contents)
}

fn keep_first<T>(kept: &mut Option<(String, T)>, age: String, found: T) {
    if kept.as_ref().is_none_or(|(before, _)| age < *before) {
        *kept = Some((age, found));
    }
}

/// Label of a header line. A foreign character before it, of two bytes or more, shifts the label to the
/// right.
fn label(line: &str) -> &str {
    let label = line.get(LABEL..).unwrap_or("").trim();
    if label.ends_with("COMMENT") { "COMMENT" } else { label }
}

/// Lines that belong together.
enum Group {
    Record(Box<Record>),
    /// Group delays of one of the newer messages.
    Delays(Delays),
    /// Klobuchar coefficients with their system, and with time and satellite in a sortable text.
    Ionosphere(System, String, Klobuchar),
    /// BDGIM coefficients with time and satellite in a sortable text.
    Bdgim(String, Bdgim),
    /// Effective ionisation of Galileo with time and satellite in a sortable text.
    Ionisation(String, [f64; 3]),
    /// Polynomial of GPS time against UTC with time and satellite in a sortable text.
    Utc(String, Polynomial),
    /// Polynomial of Galileo's time against GPS time, with time and satellite in a sortable text.
    Galileo(String, Polynomial),
    Other,
}

struct Form {
    version: u8,
    /// The only one in the file, or `M` for several; of version 2 `R` for GLONASS.
    system: char,
    /// The number of a last line that has no end, and may be cut inside a number.
    cut: Option<usize>,
}

impl Form {
    /// Columns before the first field of a line of the orbit.
    fn margin(&self) -> usize {
        if self.version < 3 { 3 } else { 4 }
    }

    /// True if a record begins with this line.
    fn begins(&self, line: &str) -> bool {
        match self.version {
            4.. => line.starts_with('>'),
            _ => line.get(..self.margin()).is_none_or(|margin| !margin.trim().is_empty()),
        }
    }

    fn header(&self, lines: &[Line<'_>], contents: &mut Contents) {
        let (mut alpha, mut beta) = (None, None);
        let (mut navic_alpha, mut navic_beta) = (None, None);
        let (mut beidou_alpha, mut beidou_beta) = (None, None);
        let mut thirds = Thirds::default();
        for (number, line) in lines {
            let mut four = |start: usize, into: &mut Option<[f64; 4]>| match numbers::<4>(line, start, HEADER_FIELD) {
                Ok(found) => *into = Some(found),
                Err(reason) => contents.reasons.push(format!("line {number} ({}): {reason}", label(line))),
            };
            match label(line) {
                "ION ALPHA" if self.version < 3 => four(2, &mut alpha),
                "ION BETA" if self.version < 3 => four(2, &mut beta),
                "IONOSPHERIC CORR" if line.starts_with("GPSA") => four(5, &mut alpha),
                "IONOSPHERIC CORR" if line.starts_with("GPSB") => four(5, &mut beta),
                "IONOSPHERIC CORR" if line.starts_with("IRNA") => four(5, &mut navic_alpha),
                "IONOSPHERIC CORR" if line.starts_with("IRNB") => four(5, &mut navic_beta),
                "IONOSPHERIC CORR" if line.starts_with("BDSA") => four(5, &mut beidou_alpha),
                "IONOSPHERIC CORR" if line.starts_with("BDSB") => four(5, &mut beidou_beta),
                "IONOSPHERIC CORR" if line.starts_with("GAL ") => match numbers::<3>(line, 5, HEADER_FIELD) {
                    Ok(found) => contents.nequick = Some(found),
                    Err(reason) => contents.reasons.push(format!("line {number} (IONOSPHERIC CORR): {reason}")),
                },
                "IONOSPHERIC CORR" if Thirds::has(line) => {
                    if let Err(reason) = thirds.take(line) {
                        contents.reasons.push(format!("line {number} (IONOSPHERIC CORR): {reason}"));
                    }
                }
                "IONOSPHERIC CORR" => {
                    let known = ["QZSA", "QZSB", "BDS "];
                    let name: String = line.chars().take(4).collect();
                    if !known.contains(&name.as_str()) {
                        contents
                            .reasons
                            .push(format!("line {number}, column 1: ionosphere of '{name}': expected GPSA or GPSB"));
                    }
                }
                "DELTA-UTC: A0,A1,T,W" | "DELTA UTC: A0,A1,T,W" if self.version < 3 => match delta_utc(line) {
                    Ok(found) => contents.utc = Some(found),
                    Err(reason) => contents.reasons.push(format!("line {number} ({}): {reason}", label(line))),
                },
                "TIME SYSTEM CORR" if [UTC, GALILEO, GALILEO_OLD].iter().any(|kind| line.starts_with(kind)) => {
                    match system_time(line) {
                        Ok(found) if line.starts_with(UTC) => contents.utc = Some(found),
                        Ok(found) => contents.galileo = Some(found),
                        Err(reason) => contents.reasons.push(format!("line {number} (TIME SYSTEM CORR): {reason}")),
                    }
                }
                "LEAP SECONDS" => match line.get(..6).unwrap_or("").trim().parse() {
                    Ok(seconds) => {
                        contents.leap_seconds = Some(seconds);
                        contents.leap_event = leap_event(line);
                    }
                    Err(_) => contents
                        .reasons
                        .push(format!("line {number} (LEAP SECONDS): column 1: expected a whole number")),
                },
                known if LABELS.contains(&known) => {}
                _ if line.trim().is_empty() => {}
                unknown => contents
                    .reasons
                    .push(format!("line {number}: '{unknown}': expected a label of a navigation header")),
            }
        }
        let mut both = |alpha, beta| match (alpha, beta) {
            (Some(alpha), Some(beta)) => Some(Klobuchar { alpha, beta }),
            (None, None) => None,
            _ => {
                let reason = "the header has only one of the ionosphere's lists, alpha and beta";
                contents.reasons.push(reason.to_owned());
                None
            }
        };
        let found = [both(alpha, beta), both(navic_alpha, navic_beta), both(beidou_alpha, beidou_beta)];
        [contents.klobuchar, contents.klobuchar_navic, contents.klobuchar_beidou] = found;
        contents.bdgim = thirds.first();
    }

    /// Parses a record from its lines without blank ones (`group`) and with them (`whole`).
    fn group(&self, group: &[Line<'_>], whole: &[Line<'_>]) -> Result<Group, String> {
        let Some((first, title)) = group.first() else { return Ok(Group::Other) };
        let refuse = |what: &str| {
            Err(format!("line {first} ({}): {what}", title.chars().take(23).collect::<String>().trim_end()))
        };
        if !self.begins(title) {
            return refuse("expected the first line of a record");
        }
        if self.version < 3 {
            return self.record(group).map(|record| Group::Record(Box::new(record)));
        }
        let words: Vec<&str> = title.split_ascii_whitespace().collect();
        let satellite =
            if self.version == 3 { title.get(..3).unwrap_or("") } else { words.get(2).copied().unwrap_or("") };
        let letter = satellite.chars().next().unwrap_or(' ');
        let Some((_, messages)) = MESSAGES.iter().find(|(system, _)| *system == letter) else {
            return refuse(&format!(
                "'{satellite}': expected a satellite like G05, of one of the systems G, R, E, J, C, I and S"
            ));
        };
        if MESSAGES.iter().any(|(system, _)| *system == self.system) && letter != self.system {
            return refuse(&format!(
                "'{satellite}': expected satellites of the system {} alone, as the first line says",
                self.system
            ));
        }
        if self.version == 3 {
            if !READ.iter().any(|(read, ..)| *read == letter) || is_spare(satellite) {
                return Ok(Group::Other);
            }
            let record = self.record(group)?;
            let is_fnav = letter == 'E' && record.says_fnav()?;
            // Some converters join both messages: a clock that is not that of E1 and E5a is no ephemeris of
            // F/NAV.
            if is_fnav && record.get("sources").unwrap_or(0.0) as u32 & CLOCK_FNAV == 0 {
                return Ok(Group::Other);
            }
            return Ok(Group::Record(Box::new(Record { is_fnav, ..record })));
        }
        match (words.get(1).copied().unwrap_or(""), words.get(3).copied().unwrap_or("")) {
            ("EPH", message) if !messages.contains(&message) => {
                refuse(&format!("message '{message}': expected {}", messages.join(" or ")))
            }
            (
                "EPH",
                message
                @ ("LNAV" | "INAV" | "FNAV" | "D1" | "D2" | "FDMA" | "SBAS" | "CNAV" | "CNV1" | "CNV2" | "CNV3"),
            ) if READ.iter().any(|(read, ..)| *read == letter) && !is_spare(satellite) => {
                let rest = group.get(1..).unwrap_or_default();
                if rest.first().is_none_or(|(_, line)| line.get(..3) != Some(satellite)) {
                    return refuse("expected the same satellite and its epoch in the line after this one");
                }
                if let Some(layout) = delays::layout(letter, message) {
                    return self.delays(layout.lines_of(rest, whole), layout).map(Group::Delays);
                }
                let is_fnav = message == "FNAV";
                self.record(rest).map(|record| Group::Record(Box::new(Record { is_fnav, ..record })))
            }
            ("ION", "LNAV") if ['G', 'I'].contains(&letter) => self.ionosphere(group, satellite),
            ("ION", "D1D2") => self.ionosphere(group, satellite),
            ("ION", "CNVX") if letter == 'C' => self.bdgim(group, satellite),
            ("ION", "IFNV") => self.ionisation(group, satellite),
            ("STO", "LNAV") if letter == 'G' => self.system_time(group, satellite),
            // Merged files name the system alone.
            ("STO", "IFNV") => self.system_time(group, satellite),
            ("EPH" | "STO" | "EOP" | "ION", _) => Ok(Group::Other),
            (kind, _) => refuse(&format!("'{kind}': expected EPH, STO, EOP or ION")),
        }
    }

    /// Year, month, day, hour, minute and second, of GPS time.
    fn epoch(&self, text: &str) -> Option<Epoch> {
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let [year, month, day, hour, minute, second] = words.as_slice() else { return None };
        let written: u16 = digits(year)?;
        // Two digits in version 2: 80 to 99 are of the last century.
        let year = match (self.version, written) {
            (2, 80..=99) => 1900 + written,
            (2, 0..=79) => 2000 + written,
            _ => written,
        };
        let [month, day, hour, minute] = [month, day, hour, minute].map(|word| digits::<u8>(word));
        let (whole, fraction) = second.split_once('.').unwrap_or((second, ""));
        let second = digits::<u8>(whole).filter(|second| *second < 60)?;
        if !fraction.bytes().all(|digit| digit.is_ascii_digit()) {
            return None;
        }
        let (month, day, hour, minute) = (month?, day?, hour?, minute?);
        Epoch::parse(&format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{fraction}")).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_epoch_is_read_to_its_fraction_and_in_its_century() {
        let form = |version| Form { version, system: 'G', cut: None };
        let parse = |text| Epoch::parse(text).ok();
        assert_eq!(form(2).epoch("10  7  1  0  0  0.5"), parse("2010-07-01T00:00:00.5"));
        assert_eq!(form(2).epoch("10  7  1  0  0 0.05"), parse("2010-07-01T00:00:00.05"));
        assert_eq!(form(2).epoch("80  7  1  0  0  0.0"), parse("1980-07-01T00:00:00"));
        assert_eq!(form(2).epoch("79  7  1  0  0  0.0"), parse("2079-07-01T00:00:00"));
        assert_eq!(form(3).epoch("2010 07 01 00 00 00"), parse("2010-07-01T00:00:00"));
        for bad in [
            "2010 07 01 00 00 60",
            "2010 13 01 00 00 00",
            "0010 07 01 00 00 00",
            "2010 07 01 00 00",
            "2010 02 29 0 0 0",
        ] {
            assert_eq!(form(3).epoch(bad), None, "{bad}");
        }
    }
}
