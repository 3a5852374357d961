//! RINEX observation files, read epoch by epoch: versions 2.00 to 2.11 and 3.00 to 4.02, plain or compressed
//! by Hatanaka's scheme.
//!
//! Sources: RINEX 2.11, tables A1 and A2; RINEX 3.05, tables A2 and A3; Hatanaka 2008 (Bulletin of the GSI
//! 55). Columns are fixed: an epoch line, then each satellite's F14.3 values, each followed by a loss-of-lock
//! indicator and a signal strength digit. A reader of our own because a file under judgement is to be refused
//! with its line and reason, and the `rinex` crate drops bad records, keeps the whole file and panics on some
//! damage; its kernels restore compressed numbers and texts, and the whole is the oracle of the tests.
//! Limits: time systems whose seconds are GPS's; only pseudorange, phase, Doppler and strength; records of
//! events (flags 2 to 6) are passed over and counted, header lines in them aside.

mod compressed;
mod header;

use std::collections::BTreeMap;
use std::io::BufRead;

use crate::read::fault::Fault;
use compressed::Restorer;
use gnss::inflate::inflate;
use gnss::satellite::Sv;
use gnss::time::Epoch;
pub use header::Header;

/// Observables of one satellite's signal at one epoch; a blank or a zero in the file is `None`.
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
    /// Time label of the receiver, in GPS time.
    pub label: Epoch,
    /// Observables by satellite and RINEX band and attribute, as `1C`.
    pub values: BTreeMap<(Sv, String), Values>,
}

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observations {
    /// `PGM` and `REC # / TYPE / VERS`, to say whose file it is.
    pub receiver: String,
    /// Epochs in the order of the file.
    pub epochs: Vec<ObservedEpoch>,
    /// Event records passed over.
    pub events: usize,
    /// True if the header says that a clock offset was applied to epoch, code and phase.
    pub clock_applied: bool,
    /// Interval of the epochs by the header, seconds.
    pub interval_s: Option<f64>,
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

/// A file in reading: one epoch is held.
pub struct Reader<R> {
    lines: Lines<R>,
    /// Header of the file.
    pub header: Header,
    /// Event records passed over so far.
    pub events: usize,
    before: Option<Epoch>,
    restorer: Option<Restorer>,
}

/// Reads a whole file, which may be packed by gzip.
///
/// # Errors
/// The first line that is not as RINEX has it.
pub fn read(bytes: &[u8]) -> Parsed<Observations> {
    if bytes.starts_with(&[0x1f, 0x9d]) {
        return Err(Fault { line: 1, what: "packed by compress (.Z): expected plain text or gzip".to_owned() });
    }
    let plain = inflate(bytes, LARGEST_BYTES).map_err(|error| Fault { line: 1, what: error.to_string() })?;
    let mut reader = Reader::new(plain.as_slice())?;
    let mut epochs = Vec::new();
    while let Some(epoch) = reader.next_epoch()? {
        epochs.push(epoch);
    }
    let Header { receiver, clock_applied, interval_s, .. } = reader.header;
    Ok(Observations { receiver, epochs, events: reader.events, clock_applied, interval_s })
}

impl<R: BufRead> Reader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// The first line that is not as RINEX has it.
    pub fn new(input: R) -> Parsed<Self> {
        let mut lines = Lines { input, number: 0 };
        let header = Header::read(&mut lines)?;
        let restorer = header.is_compressed.then(|| Restorer::new(header.is_second));
        Ok(Self { lines, header, events: 0, before: None, restorer })
    }

    /// The next epoch; none at the end of the file.
    ///
    /// # Errors
    /// The first line that is not as RINEX has it; a file without any epoch.
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
            let form = if self.header.is_second { "of RINEX 2" } else { "that begins with '>'" };
            return Err(self.lines.fault(format!("no epoch: expected a line {form}")));
        }
        Ok(None)
    }

    /// The record that begins with a line; none of an event.
    fn epoch(&mut self, line: &str) -> Parsed<Option<ObservedEpoch>> {
        let restored = self.restorer.as_mut().map(|restorer| restorer.epoch(line)).transpose();
        let restored = restored.map_err(|what| self.lines.fault(what))?;
        let line = restored.as_deref().unwrap_or(line);
        let head = Head::read(line, self.header.is_second).map_err(|what| self.lines.fault(what))?;
        if head.flag > 1 {
            self.event(&head)?;
            return Ok(None);
        }
        let Some(label) = head.label else {
            return Err(self.lines.fault(format!("time '{}': expected {}", head.time, head.form)));
        };
        if self.before.is_some_and(|before| label.since(before) <= 0.0) {
            return Err(self.lines.fault(format!("epoch {label} does not come after the one before")));
        }
        let named =
            if self.header.is_second || self.restorer.is_some() { self.named(line, &head)? } else { Vec::new() };
        if let Some(restorer) = &mut self.restorer {
            restorer.keep(&named);
            // The receiver's clock, which is not read.
            self.lines.next()?;
        }
        let mut values: BTreeMap<(Sv, String), Values> = BTreeMap::new();
        for have in 0..head.count {
            self.satellite(named.get(have).copied(), [have, head.count], &mut values)?;
        }
        // The receiver lost power since the epoch before.
        if head.flag == 1 {
            values.values_mut().filter(|own| own.carrier_cycles.is_some()).for_each(|own| own.lost_lock = true);
        }
        Ok(Some(ObservedEpoch { label, values }))
    }

    /// A line of an epoch that has so many of so many.
    fn line_of(&mut self, [have, count]: [usize; 2]) -> Parsed<String> {
        let line = self.lines.next()?;
        line.ok_or_else(|| self.lines.fault(format!("the file ends after {have} of {count} lines of an epoch")))
    }

    /// Passes over an event; header lines in it hold from there on.
    fn event(&mut self, head: &Head) -> Parsed<()> {
        self.events += 1;
        // Cycle slips of RINEX 2 are written as observations are.
        let is_observed = head.flag == 6 && self.header.is_second && self.restorer.is_none();
        let types = self.header.codes(gnss::satellite::System::Gps).len();
        let count =
            if is_observed { more_lines(head.count) + head.count * types.div_ceil(PER_LINE) } else { head.count };
        for have in 0..count {
            let line = self.line_of([have, count])?;
            if head.flag == 4 {
                self.header.line(&line).map_err(|what| self.lines.fault(what))?;
            }
        }
        self.header.complete().map_err(|what| self.lines.fault(what))
    }

    /// The satellites of an epoch that its line names: twelve on each line, all on one line of a compressed
    /// file.
    fn named(&mut self, line: &str, head: &Head) -> Parsed<Vec<Sv>> {
        let list = |line: &str| line.get(head.list..).unwrap_or("").to_owned();
        let mut text = list(line);
        if self.restorer.is_none() {
            for have in 0..more_lines(head.count) {
                text.truncate(3 * NAMES * (have + 1));
                text = format!(
                    "{text:width$}{}",
                    list(&self.line_of([have, head.count])?),
                    width = 3 * NAMES * (have + 1)
                );
            }
        }
        let mut found = Vec::new();
        for index in 0..head.count {
            let name = text.get(3 * index..(3 * index + 3).min(text.len())).unwrap_or("");
            if name.trim().is_empty() {
                let what = format!("{} satellites announced, {index} named", head.count);
                return Err(self.lines.fault(what));
            }
            found.push(self.header.satellite(name).map_err(|what| self.lines.fault(what))?);
        }
        Ok(found)
    }

    /// Reads the values of one satellite, which its epoch's line may name, into those of the epoch.
    fn satellite(
        &mut self,
        named: Option<Sv>,
        part: [usize; 2],
        all: &mut BTreeMap<(Sv, String), Values>,
    ) -> Parsed<()> {
        let first = self.line_of(part)?;
        let sv = match named {
            Some(sv) => sv,
            None => self.header.satellite(columns(&first, 0, 3)).map_err(|what| self.lines.fault(what))?,
        };
        if all.keys().any(|(other, _)| *other == sv) {
            return Err(self.lines.fault(format!("satellite {sv} appears twice in one epoch")));
        }
        let count = self.header.codes(sv.system).len();
        let from = if named.is_some() { 0 } else { 3 };
        let restored = self.restorer.as_mut().map(|restorer| restorer.satellite(sv, count, &first)).transpose();
        let restored = restored.map_err(|what| self.lines.fault(what))?;
        let is_whole = named.is_none() || restored.is_some();
        let mut line = restored.unwrap_or(first);
        let per_line = if is_whole { count } else { PER_LINE };
        if is_whole && line.trim_end().len() > from + 16 * count {
            let what = format!("satellite {sv}: more values than the {count} that the header names");
            return Err(self.lines.fault(what));
        }
        for index in 0..count {
            let at = index % per_line.max(1);
            if index > 0 && at == 0 {
                line = self.line_of(part)?;
            }
            let code = self.header.codes(sv.system).get(index).cloned().unwrap_or_default();
            self.value(sv, &code, &line, from + 16 * at, all)?;
        }
        Ok(())
    }

    /// Reads the value that begins in a column of a line.
    fn value(
        &self,
        sv: Sv,
        code: &str,
        line: &str,
        from: usize,
        all: &mut BTreeMap<(Sv, String), Values>,
    ) -> Parsed<()> {
        let text = columns(line, from, from + 14);
        if text.is_empty() || code.is_empty() {
            return Ok(());
        }
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        let value = value.ok_or_else(|| {
            let (first, last) = (from + 1, from + 14);
            self.lines.fault(format!("{sv} {code} = '{text}': expected a number in columns {first} to {last}"))
        })?;
        // A zero means no observation (RINEX 3.05, 6.7).
        if value == 0.0 {
            return Ok(());
        }
        let value = value / self.header.scale_of(sv, code);
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
        Ok(())
    }
}

/// Satellites on an epoch line of RINEX 2.
const NAMES: usize = 12;
/// Values on a line.
const PER_LINE: usize = 5;

/// Lines that continue an epoch line of RINEX 2 with so many satellites.
fn more_lines(satellites: usize) -> usize {
    satellites.div_ceil(NAMES).saturating_sub(1)
}

/// Content of an epoch line.
struct Head {
    /// Time of the epoch, which the file's header says is GPS time, and its text.
    label: Option<Epoch>,
    time: String,
    /// Form in which a time is written.
    form: &'static str,
    flag: u8,
    /// Satellites, or lines of an event.
    count: usize,
    /// Column in which the list of satellites begins, where there is one.
    list: usize,
}

impl Head {
    fn read(line: &str, is_second: bool) -> Result<Self, String> {
        if !is_second && !line.starts_with('>') {
            return Err(format!("'{}': expected an epoch, which begins with '>'", cut(line)));
        }
        // Columns of year, month, day, hour, minute and second; of flag and count.
        let (at, flag, list, form) = if is_second {
            ([(1, 3), (4, 6), (7, 9), (10, 12), (13, 15), (15, 26)], 28, 32, "yy mm dd hh mm ss.s")
        } else {
            ([(2, 6), (7, 9), (10, 12), (13, 15), (16, 18), (18, 29)], 31, 41, "yyyy mm dd hh mm ss.s")
        };
        let count_text = columns(line, flag + 1, flag + 4);
        let Some(count) = count_text.parse::<usize>().ok().filter(|count| *count <= 999) else {
            return Err(format!("number of satellites '{count_text}': expected 0 to 999"));
        };
        let flag_text = columns(line, flag, flag + 1);
        let Some(flag) = flag_text.parse::<u8>().ok().filter(|flag| *flag <= 6) else {
            return Err(format!("epoch flag '{flag_text}': expected 0 to 6"));
        };
        let [year, month, day, hour, minute, seconds] = at.map(|(from, to)| columns(line, from, to));
        let century = match year.parse::<u8>() {
            Ok(year) if is_second => {
                if year >= 80 {
                    "19"
                } else {
                    "20"
                }
            }
            _ => "",
        };
        let (whole, rest) = seconds.split_once('.').unwrap_or((seconds, "0"));
        let text = format!("{century}{year:0>2}-{month:0>2}-{day:0>2}T{hour:0>2}:{minute:0>2}:{whole:0>2}.{rest}");
        let time = columns(line, at[0].0, at[5].1).to_owned();
        Ok(Self { label: Epoch::parse(&text).ok(), time, form, flag, count, list })
    }
}

fn cut(line: &str) -> String {
    line.chars().take(40).collect()
}

#[cfg(test)]
#[path = "rinex_obs_tests.rs"]
mod tests;
