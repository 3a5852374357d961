//! RINEX 3 observation files, read epoch by epoch.
//!
//! Source: RINEX 3.05, tables A2 and A3. Columns are fixed: an epoch line, then a line a satellite with F14.3
//! values, each followed by a loss-of-lock indicator and a signal strength digit. A reader of our own because
//! a file under judgement is to be refused with its line and reason, and the `rinex` crate drops bad records,
//! keeps the whole file and panics on some damage; it is the oracle of the tests. Limits: versions 3.00 to
//! 4.02, time systems GPS and Galileo; only pseudorange, phase, Doppler and strength; records of events
//! (flags 2 to 6) are passed over and counted.

use std::collections::BTreeMap;
use std::io::BufRead;

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

/// Lines of a file, numbered from 1.
struct Lines<R> {
    input: R,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    /// The next one without its end. Names of stations and agencies come in every encoding; the data are
    /// ASCII.
    fn next(&mut self) -> Parsed<Option<String>> {
        let mut bytes = Vec::new();
        let read = self.input.read_until(b'\n', &mut bytes);
        if read.map_err(|error| Fault { line: self.number + 1, what: error.to_string() })? == 0 {
            return Ok(None);
        }
        self.number += 1;
        if self.number == 1 && bytes.starts_with(b"\xef\xbb\xbf") {
            bytes.drain(..3);
        }
        bytes.iter_mut().filter(|byte| !byte.is_ascii()).for_each(|byte| *byte = b'?');
        let mut text = String::from_utf8(bytes).unwrap_or_default();
        text.truncate(text.trim_end_matches(['\n', '\r']).len());
        Ok(Some(text))
    }

    /// A fault in the line that was read last.
    fn fault(&self, what: impl Into<String>) -> Fault {
        Fault { line: self.number.max(1), what: what.into() }
    }
}

/// Columns `from..to` of a line, blanks stripped; a line may end early.
fn columns(line: &str, from: usize, to: usize) -> &str {
    let to = to.min(line.len());
    if from >= to { "" } else { line.get(from..to).unwrap_or("").trim() }
}

/// What a file's header says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// `PGM` and `REC # / TYPE / VERS`, to say whose file it is.
    pub receiver: String,
    /// Whether it says that a clock offset was applied to epoch, code and phase.
    pub clock_applied: bool,
    /// Frequency channels of GLONASS satellites.
    pub channels: BTreeMap<Sv, i8>,
    types: BTreeMap<char, Vec<String>>,
    scales: BTreeMap<(char, String), f64>,
}

/// A file in reading: one epoch is held.
pub struct Reader<R> {
    lines: Lines<R>,
    /// What the header says.
    pub header: Header,
    /// Event records passed over so far.
    pub events: usize,
    before: Option<Epoch>,
}

/// Reads a whole file's text.
///
/// # Errors
/// The first line that is not as RINEX 3 has it.
pub fn read(bytes: &[u8]) -> Parsed<Observations> {
    let mut reader = Reader::new(bytes)?;
    let mut epochs = Vec::new();
    while let Some(epoch) = reader.next_epoch()? {
        epochs.push(epoch);
    }
    let Header { receiver, clock_applied, .. } = reader.header;
    Ok(Observations { receiver, epochs, events: reader.events, clock_applied })
}

impl<R: BufRead> Reader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// The first line that is not as RINEX 3 has it.
    pub fn new(input: R) -> Parsed<Self> {
        let mut lines = Lines { input, number: 0 };
        let header = Header::read(&mut lines)?;
        Ok(Self { lines, header, events: 0, before: None })
    }

    /// The next epoch; none at the end of the file.
    ///
    /// # Errors
    /// The first line that is not as RINEX 3 has it; a file without any epoch.
    pub fn next_epoch(&mut self) -> Parsed<Option<ObservedEpoch>> {
        while let Some(line) = self.lines.next()? {
            if line.trim().is_empty() {
                continue;
            }
            if let Some(found) = self.epoch(&line)? {
                self.before = Some(found.label);
                return Ok(Some(found));
            }
        }
        if self.before.is_none() {
            return Err(self.lines.fault("no epoch: expected a line that begins with '>'"));
        }
        Ok(None)
    }

    /// The record that begins with a line; none of an event.
    fn epoch(&mut self, line: &str) -> Parsed<Option<ObservedEpoch>> {
        let fault = |what: String| Err(self.lines.fault(what));
        if !line.starts_with('>') {
            return fault(format!("'{}': expected an epoch, which begins with '>'", cut(line)));
        }
        let count_text = columns(line, 32, 35);
        let Some(count) = count_text.parse::<usize>().ok().filter(|count| *count <= 999) else {
            return fault(format!("number of satellites '{count_text}': expected 0 to 999"));
        };
        let is_event = match columns(line, 31, 32) {
            "0" | "1" => false,
            "2" | "3" | "4" | "5" | "6" => true,
            other => return fault(format!("epoch flag '{other}': expected 0 to 6")),
        };
        let label = if is_event { None } else { time(line) };
        if !is_event {
            let Some(label) = label else {
                return fault(format!("time '{}': expected yyyy mm dd hh mm ss.s", columns(line, 2, 29)));
            };
            if self.before.is_some_and(|before| label.since(before) <= 0.0) {
                return fault(format!("epoch {label} does not come after the one before"));
            }
        }
        let mut values: BTreeMap<(Sv, String), Values> = BTreeMap::new();
        for have in 0..count {
            let Some(line) = self.lines.next()? else {
                return Err(self.lines.fault(format!("the file ends after {have} of {count} lines of an epoch")));
            };
            if !is_event {
                self.header.satellite(&line, &mut values).map_err(|what| self.lines.fault(what))?;
            }
        }
        self.events += usize::from(is_event);
        Ok(label.map(|label| ObservedEpoch { label, values }))
    }
}

impl Header {
    fn read<R: BufRead>(lines: &mut Lines<R>) -> Parsed<Self> {
        let first = lines.next()?.unwrap_or_default();
        let label = |line: &str| columns(line, 60, 80).to_owned();
        if label(&first) != "RINEX VERSION / TYPE" {
            return Err(Fault { line: 1, what: "expected a first line that ends in RINEX VERSION / TYPE".to_owned() });
        }
        let version = columns(&first, 0, 9).parse::<f64>().ok().filter(|v| (3.0..5.0).contains(v));
        if version.is_none() {
            return Err(lines.fault(format!("version '{}': expected 3.00 to 4.02", columns(&first, 0, 9))));
        }
        if !columns(&first, 20, 40).starts_with('O') {
            let kind = columns(&first, 20, 40);
            return Err(lines.fault(format!("file type '{kind}': expected O, observation data")));
        }
        let mut header = Self::default();
        let mut wanted: Option<(char, usize)> = None;
        while let Some(line) = lines.next()? {
            let told = match label(&line).as_str() {
                "END OF HEADER" if header.types.is_empty() => {
                    Err("the header names no observations: expected SYS / # / OBS TYPES".to_owned())
                }
                "END OF HEADER" => {
                    complete(wanted).map_err(|what| lines.fault(what))?;
                    return Ok(header);
                }
                "SYS / # / OBS TYPES" => header.types(&line, &mut wanted),
                "TIME OF FIRST OBS" => time_system(columns(&line, 48, 51)),
                "SYS / SCALE FACTOR" => header.scale(&line),
                "GLONASS SLOT / FRQ #" => {
                    header.channels(&line);
                    Ok(())
                }
                "RCV CLOCK OFFS APPL" => {
                    header.clock_applied = columns(&line, 0, 6) == "1";
                    Ok(())
                }
                "PGM / RUN BY / DATE" => {
                    header.receiver = columns(&line, 0, 20).to_owned();
                    Ok(())
                }
                "REC # / TYPE / VERS" => {
                    let own = format!("{} {}", columns(&line, 20, 40), columns(&line, 40, 60));
                    header.receiver = own.trim().to_owned();
                    Ok(())
                }
                _ => Ok(()),
            };
            told.map_err(|what| lines.fault(what))?;
        }
        Err(lines.fault("the header does not end: expected END OF HEADER"))
    }

    fn types(&mut self, line: &str, wanted: &mut Option<(char, usize)>) -> Result<(), String> {
        if let Some(system) = line.chars().next().filter(|letter| !letter.is_whitespace()) {
            complete(*wanted)?;
            let count = columns(line, 3, 6).parse::<usize>().ok().filter(|count| (1..=200).contains(count));
            let count = count
                .ok_or_else(|| format!("number of observation types '{}': expected 1 to 200", columns(line, 3, 6)))?;
            self.types.insert(system, Vec::new());
            *wanted = Some((system, count));
        }
        let Some((system, missing)) = wanted else {
            return Err(
                "observation types continue before they begin: expected a system's letter in column 1".to_owned()
            );
        };
        for code in columns(line, 6, 60).split_whitespace() {
            if code.len() != 3 || *missing == 0 {
                return Err(format!("observation type '{code}': expected {missing} more codes of three characters"));
            }
            self.types.entry(*system).or_default().push(code.to_owned());
            *missing -= 1;
        }
        Ok(())
    }

    fn scale(&mut self, line: &str) -> Result<(), String> {
        let system = line.chars().next().unwrap_or(' ');
        let factor = columns(line, 2, 6).parse::<f64>().ok().filter(|f| [1.0, 10.0, 100.0, 1000.0].contains(f));
        let factor =
            factor.ok_or_else(|| format!("scale factor '{}': expected 1, 10, 100 or 1000", columns(line, 2, 6)))?;
        let named: Vec<String> = columns(line, 10, 60).split_whitespace().map(str::to_owned).collect();
        let of = if named.is_empty() { self.types.get(&system).cloned().unwrap_or_default() } else { named };
        self.scales.extend(of.into_iter().map(|code| ((system, code), factor)));
        Ok(())
    }

    /// Satellites and channels, eight on a line; others' files have them in other forms, and nothing of a
    /// foreign file hangs on them.
    fn channels(&mut self, line: &str) {
        for from in (4..60).step_by(7) {
            if let (Ok(sv), Ok(channel)) =
                (columns(line, from, from + 3).parse(), columns(line, from + 3, from + 6).parse())
            {
                self.channels.insert(sv, channel);
            }
        }
    }

    /// Reads a satellite's line into the values of its epoch.
    fn satellite(&self, line: &str, all: &mut BTreeMap<(Sv, String), Values>) -> Result<(), String> {
        // RINEX allows a blank in place of the leading zero.
        let name = columns(line, 0, 3).replace(' ', "0");
        let sv: Sv = name.parse().map_err(|error| format!("{error}"))?;
        let Some(codes) = self.types.get(&sv.system.letter()) else {
            return Err(format!("satellite {sv}: the header names no observations of its system"));
        };
        if all.keys().any(|(other, _)| *other == sv) {
            return Err(format!("satellite {sv} appears twice in one epoch"));
        }
        if line.trim_end().len() > 3 + 16 * codes.len() {
            return Err(format!("satellite {sv}: more values than the {} that the header names", codes.len()));
        }
        for (index, code) in codes.iter().enumerate() {
            let from = 3 + 16 * index;
            let text = columns(line, from, from + 14);
            if text.is_empty() {
                continue;
            }
            let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
            let value = value.ok_or_else(|| {
                format!("{sv} {code} = '{text}': expected a number in columns {} to {}", from + 1, from + 14)
            })?;
            // A zero means no observation (RINEX 3.05, 6.7).
            if value == 0.0 {
                continue;
            }
            let value = if self.scales.is_empty() {
                value
            } else {
                value / self.scales.get(&(sv.system.letter(), code.clone())).copied().unwrap_or(1.0)
            };
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
}

/// Seconds of these scales are those of GPS time; BDT is 14 s behind, GLO is UTC.
fn time_system(name: &str) -> Result<(), String> {
    if ["", "GPS", "GAL", "QZS", "IRN"].contains(&name) {
        return Ok(());
    }
    Err(format!("time system '{name}': expected GPS, GAL, QZS or IRN"))
}

/// That a system's list of types is as long as it said.
fn complete(wanted: Option<(char, usize)>) -> Result<(), String> {
    match wanted {
        Some((system, missing)) if missing > 0 => {
            Err(format!("{missing} observation types of system {system} are missing before this line"))
        }
        _ => Ok(()),
    }
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
