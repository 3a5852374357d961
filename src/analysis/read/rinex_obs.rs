//! RINEX 3 observation files, read epoch by epoch.
//!
//! Source: RINEX 3.05, tables A2 and A3. Columns are fixed: an epoch line, then a line a satellite with F14.3
//! values, each followed by a loss-of-lock indicator and a signal strength digit. A reader of our own because
//! a file under judgement is to be refused with its line and reason, and the `rinex` crate drops bad records,
//! keeps the whole file and panics on some damage; it is the oracle of the tests. Limits: versions 3.00 to
//! 4.02, time systems GPS and Galileo; only pseudorange, phase, Doppler and strength; records of events
//! (flags 2 to 6) are passed over and counted.

use std::collections::BTreeMap;

use crate::read::fault::Fault;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// What one satellite's signal gave at one epoch; a blank or a zero in the file is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// Pseudorange, metres.
    pub pseudorange_m: Option<f64>,
    /// Carrier, cycles.
    pub carrier_cycles: Option<f64>,
    /// Bit 0 of the phase's loss-of-lock indicator: its count is broken since the epoch before.
    pub lost_lock: bool,
    /// Bit 1: half a cycle may be missing.
    pub half_cycle_ambiguous: bool,
    /// Doppler, Hz; positive where the satellite comes nearer.
    pub doppler_hz: Option<f64>,
    /// C/N0, dB-Hz.
    pub cn0_dbhz: Option<f64>,
}

/// One epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservedEpoch {
    /// As the receiver labels it, in GPS time.
    pub label: Epoch,
    /// By satellite and RINEX band and attribute, as `1C`.
    pub values: BTreeMap<(Sv, String), Values>,
}

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observations {
    /// `PGM` and `REC # / TYPE / VERS`, to say whose file it is.
    pub receiver: String,
    /// In the order of the file.
    pub epochs: Vec<ObservedEpoch>,
    /// Event records passed over.
    pub events: usize,
    /// Whether the header says that a clock offset was applied to epoch, code and phase.
    pub clock_applied: bool,
}

/// Largest file that is read.
pub const LARGEST_BYTES: u64 = 256 << 20;

type Parsed<T> = Result<T, Fault>;

fn fault(line: usize, what: impl Into<String>) -> Fault {
    Fault { line: line as u64 + 1, what: what.into() }
}

/// Columns `from..to` of a line, blanks stripped; a line may end early.
fn columns(line: &str, from: usize, to: usize) -> &str {
    let to = to.min(line.len());
    if from >= to { "" } else { line.get(from..to).unwrap_or("").trim() }
}

struct Header {
    types: BTreeMap<char, Vec<String>>,
    scales: BTreeMap<(char, String), f64>,
}

/// Reads a whole file's text.
///
/// # Errors
/// The first line that is not as RINEX 3 has it.
pub fn read(bytes: &[u8]) -> Parsed<Observations> {
    // Names of stations and agencies come in every encoding; the data are ASCII.
    let text: String = bytes
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(bytes)
        .iter()
        .map(|byte| if byte.is_ascii() { char::from(*byte) } else { '?' })
        .collect();
    let lines: Vec<&str> = text.lines().map(|line| line.trim_end_matches('\r')).collect();
    let mut found = Observations::default();
    let (header, mut at) = header(&lines, &mut found)?;
    while at < lines.len() {
        let line = lines[at];
        if line.trim().is_empty() {
            at += 1;
            continue;
        }
        at = epoch(&lines, at, &header, &mut found)?;
    }
    if found.epochs.is_empty() {
        return Err(fault(lines.len().saturating_sub(1), "no epoch: expected a line that begins with '>'"));
    }
    Ok(found)
}

fn header(lines: &[&str], found: &mut Observations) -> Parsed<(Header, usize)> {
    let first = lines.first().copied().unwrap_or("");
    let label = |line: &str| columns(line, 60, 80).to_owned();
    if label(first) != "RINEX VERSION / TYPE" {
        return Err(fault(0, "expected a first line that ends in RINEX VERSION / TYPE"));
    }
    let version = columns(first, 0, 9).parse::<f64>().ok().filter(|v| (3.0..5.0).contains(v));
    if version.is_none() {
        return Err(fault(0, format!("version '{}': expected 3.00 to 4.02", columns(first, 0, 9))));
    }
    if !columns(first, 20, 40).starts_with('O') {
        return Err(fault(0, format!("file type '{}': expected O, observation data", columns(first, 20, 40))));
    }
    let mut header = Header { types: BTreeMap::new(), scales: BTreeMap::new() };
    let mut wanted: Option<(char, usize)> = None;
    for (at, line) in lines.iter().enumerate().skip(1) {
        match label(line).as_str() {
            "END OF HEADER" => {
                if header.types.is_empty() {
                    return Err(fault(at, "the header names no observations: expected SYS / # / OBS TYPES"));
                }
                complete(wanted, at)?;
                return Ok((header, at + 1));
            }
            "SYS / # / OBS TYPES" => types(line, at, &mut header, &mut wanted)?,
            "TIME OF FIRST OBS" => {
                let system = columns(line, 48, 51);
                // Seconds of these scales are those of GPS time; BDT is 14 s behind, GLO is UTC.
                if !["", "GPS", "GAL", "QZS", "IRN"].contains(&system) {
                    return Err(fault(at, format!("time system '{system}': expected GPS, GAL, QZS or IRN")));
                }
            }
            "SYS / SCALE FACTOR" => scale(line, at, &mut header)?,
            "RCV CLOCK OFFS APPL" => found.clock_applied = columns(line, 0, 6) == "1",
            "PGM / RUN BY / DATE" => found.receiver = columns(line, 0, 20).to_owned(),
            "REC # / TYPE / VERS" => {
                found.receiver = format!("{} {}", columns(line, 20, 40), columns(line, 40, 60)).trim().to_owned();
            }
            _ => {}
        }
    }
    Err(fault(lines.len().saturating_sub(1), "the header does not end: expected END OF HEADER"))
}

/// That a system's list of types is as long as it said.
fn complete(wanted: Option<(char, usize)>, at: usize) -> Parsed<()> {
    match wanted {
        Some((system, missing)) if missing > 0 => {
            Err(fault(at, format!("{missing} observation types of system {system} are missing before this line")))
        }
        _ => Ok(()),
    }
}

fn types(line: &str, at: usize, header: &mut Header, wanted: &mut Option<(char, usize)>) -> Parsed<()> {
    if let Some(system) = line.chars().next().filter(|letter| !letter.is_whitespace()) {
        complete(*wanted, at)?;
        let count = columns(line, 3, 6).parse::<usize>().ok().filter(|count| (1..=200).contains(count));
        let count = count.ok_or_else(|| {
            fault(at, format!("number of observation types '{}': expected 1 to 200", columns(line, 3, 6)))
        })?;
        header.types.insert(system, Vec::new());
        *wanted = Some((system, count));
    }
    let Some((system, missing)) = wanted else {
        return Err(fault(at, "observation types continue before they begin: expected a system's letter in column 1"));
    };
    for code in columns(line, 6, 60).split_whitespace() {
        if code.len() != 3 || *missing == 0 {
            return Err(fault(
                at,
                format!("observation type '{code}': expected {missing} more codes of three characters"),
            ));
        }
        header.types.entry(*system).or_default().push(code.to_owned());
        *missing -= 1;
    }
    Ok(())
}

fn scale(line: &str, at: usize, header: &mut Header) -> Parsed<()> {
    let system = line.chars().next().unwrap_or(' ');
    let factor = columns(line, 2, 6).parse::<f64>().ok().filter(|f| [1.0, 10.0, 100.0, 1000.0].contains(f));
    let factor = factor
        .ok_or_else(|| fault(at, format!("scale factor '{}': expected 1, 10, 100 or 1000", columns(line, 2, 6))))?;
    let named: Vec<String> = columns(line, 10, 60).split_whitespace().map(str::to_owned).collect();
    let of = if named.is_empty() { header.types.get(&system).cloned().unwrap_or_default() } else { named };
    header.scales.extend(of.into_iter().map(|code| ((system, code), factor)));
    Ok(())
}

/// Reads the record that begins at line `at`; returns the line after it.
fn epoch(lines: &[&str], at: usize, header: &Header, found: &mut Observations) -> Parsed<usize> {
    let line = lines[at];
    if !line.starts_with('>') {
        return Err(fault(at, format!("'{}': expected an epoch, which begins with '>'", cut(line))));
    }
    let flag = columns(line, 31, 32);
    let count_text = columns(line, 32, 35);
    let count = count_text.parse::<usize>().ok().filter(|count| *count <= 999);
    let count = count.ok_or_else(|| fault(at, format!("number of satellites '{count_text}': expected 0 to 999")))?;
    let next = at + 1 + count;
    if next > lines.len() {
        let have = lines.len() - at - 1;
        return Err(fault(lines.len() - 1, format!("the file ends after {have} of {count} lines of an epoch")));
    }
    match flag {
        "0" | "1" => {}
        "2" | "3" | "4" | "5" | "6" => {
            found.events += 1;
            return Ok(next);
        }
        other => return Err(fault(at, format!("epoch flag '{other}': expected 0 to 6"))),
    }
    let label = time(line)
        .ok_or_else(|| fault(at, format!("time '{}': expected yyyy mm dd hh mm ss.s", columns(line, 2, 29))))?;
    if found.epochs.last().is_some_and(|before| label.since(before.label) <= 0.0) {
        return Err(fault(at, format!("epoch {label} does not come after the one before")));
    }
    let mut values: BTreeMap<(Sv, String), Values> = BTreeMap::new();
    for (at, line) in lines.iter().enumerate().take(next).skip(at + 1) {
        satellite(line, at, header, &mut values)?;
    }
    found.epochs.push(ObservedEpoch { label, values });
    Ok(next)
}

fn satellite(line: &str, at: usize, header: &Header, all: &mut BTreeMap<(Sv, String), Values>) -> Parsed<()> {
    // RINEX allows a blank in place of the leading zero.
    let name = columns(line, 0, 3).replace(' ', "0");
    let sv: Sv = name.parse().map_err(|error| fault(at, format!("{error}")))?;
    let Some(codes) = header.types.get(&sv.system.letter()) else {
        return Err(fault(at, format!("satellite {sv}: the header names no observations of its system")));
    };
    if all.keys().any(|(other, _)| *other == sv) {
        return Err(fault(at, format!("satellite {sv} appears twice in one epoch")));
    }
    if line.trim_end().len() > 3 + 16 * codes.len() {
        return Err(fault(at, format!("satellite {sv}: more values than the {} that the header names", codes.len())));
    }
    for (index, code) in codes.iter().enumerate() {
        let from = 3 + 16 * index;
        let text = columns(line, from, from + 14);
        if text.is_empty() {
            continue;
        }
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        let value = value.ok_or_else(|| {
            fault(at, format!("{sv} {code} = '{text}': expected a number in columns {} to {}", from + 1, from + 14))
        })?;
        // A zero means no observation (RINEX 3.05, 6.7).
        if value == 0.0 {
            continue;
        }
        let value = value / header.scales.get(&(sv.system.letter(), code.clone())).copied().unwrap_or(1.0);
        let indicator = columns(line, from + 14, from + 15).parse::<u8>().unwrap_or(0);
        let entry = all.entry((sv, code.get(1..).unwrap_or("").to_owned())).or_default();
        match code.as_bytes().first() {
            Some(b'C') => entry.pseudorange_m = Some(value),
            Some(b'L') => {
                entry.carrier_cycles = Some(value);
                entry.lost_lock = indicator & 1 != 0;
                entry.half_cycle_ambiguous = indicator & 2 != 0;
            }
            Some(b'D') => entry.doppler_hz = Some(value),
            Some(b'S') => entry.cn0_dbhz = Some(value),
            _ => {}
        }
    }
    Ok(())
}

/// The time of an epoch line, which the file's header says is GPS time.
fn time(line: &str) -> Option<Epoch> {
    let part = |from, to| columns(line, from, to);
    let two = |from: usize| format!("{:0>2}", part(from, from + 2));
    let seconds = part(18, 29);
    let (whole, rest) = seconds.split_once('.').unwrap_or((seconds, "0"));
    let text = format!("{}-{}-{}T{}:{}:{whole:0>2}.{rest}", part(2, 6), two(7), two(10), two(13), two(16));
    Epoch::parse(&text).ok()
}

fn cut(line: &str) -> String {
    line.chars().take(40).collect()
}

#[cfg(test)]
#[path = "rinex_obs_tests.rs"]
mod tests;
