//! Observation files, which are written as observations arrive.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Write};

use super::{Version, calendar, header_line, opening};
use crate::earth::SPEED_OF_LIGHT_MPS;
use crate::record::Observation;
use crate::satellite::{Sv, System};
use crate::signal::{Carrier, Link, Signal};
use crate::time::Epoch;

/// Satellites with their channels on a line of the header.
const CHANNELS_ON_A_LINE: usize = 8;
/// Observation types on a line of the header.
const TYPES_ON_A_LINE: usize = 13;
/// Largest value that `F14.3` holds.
const LARGEST: f64 = 999_999_999.999;
/// Time tags are written to 0.1 µs.
const TICKS_A_SECOND: f64 = 1e7;
/// Largest difference between two values of one time, in seconds.
const SAME_TIME_S: f64 = 1e-6;

/// Observation file that is being written. Only the rows of one epoch are kept in memory.
///
/// An epoch is labelled with the time of the receiver's clock. A carrier that was not locked all the time
/// since the epoch before has its loss-of-lock flag set.
pub struct ObservationFile<W> {
    writer: W,
    version: Version,
    marker: String,
    signals: Vec<&'static Signal>,
    begun: bool,
    rows: Vec<Observation>,
    clock_bias_s: Option<f64>,
    /// Time by the receiver's clock of each signal's newest observation.
    seen: BTreeMap<Link, Epoch>,
}

impl<W: Write> ObservationFile<W> {
    /// Creates a file for these signals and a marker of this name; nothing is written yet.
    pub fn new(writer: W, version: Version, marker: &str, signals: &[&'static Signal]) -> Self {
        let mut own: Vec<&'static Signal> = Vec::new();
        for signal in signals {
            if !own.iter().any(|known| (known.system, known.rinex) == (signal.system, signal.rinex)) {
                own.push(signal);
            }
        }
        own.sort_by_key(|signal| (signal.system, signal.rinex));
        let marker = marker.chars().filter(char::is_ascii_graphic).take(60).collect();
        let (rows, seen) = (Vec::new(), BTreeMap::new());
        Self { writer, version, marker, signals: own, begun: false, rows, clock_bias_s: None, seen }
    }

    /// Takes an observation; those of a sample come one after the other.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn take(&mut self, row: Observation) -> io::Result<()> {
        if self.rows.first().is_some_and(|first| first.sample != row.sample) {
            self.end_epoch()?;
        }
        self.rows.push(row);
        Ok(())
    }

    /// States the offset of the receiver's clock from GPS time at the sample of the newest observations.
    pub fn set_clock(&mut self, bias_s: f64) {
        self.clock_bias_s = Some(bias_s);
    }

    /// Writes the last epoch, and the header of a file that has none.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn finish(&mut self) -> io::Result<()> {
        self.end_epoch()?;
        if !self.begun {
            self.begin(Epoch::new(0, 0.0))?;
        }
        self.writer.flush()
    }

    /// Writes the epoch of the newest observations: no more of it come.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn end_epoch(&mut self) -> io::Result<()> {
        let rows = std::mem::take(&mut self.rows);
        let bias_s = self.clock_bias_s.take();
        let Some(first) = rows.first() else { return Ok(()) };
        let reading = first.sent().plus_s(first.pseudorange_m / SPEED_OF_LIGHT_MPS);
        let ticks = (reading.fraction() * TICKS_A_SECOND).round();
        let tag = Epoch::new(reading.seconds(), ticks / TICKS_A_SECOND);
        if !self.begun {
            self.begin(tag)?;
        }
        let mut satellites: BTreeMap<Sv, Vec<&Observation>> = BTreeMap::new();
        rows.iter().for_each(|row| satellites.entry(row.sv).or_default().push(row));
        let [year, month, day, hour, minute, second] = calendar(tag);
        // After a whole second, to the nearest tick: the carry is in the tag.
        let ticks = ticks as u64 % TICKS_A_SECOND as u64;
        let mut text = format!(
            "> {year:04} {month:02} {day:02} {hour:02} {minute:02} {second:2}.{ticks:07}  0{:3}",
            planted!("gnss.exchange.satellites", satellites.len(), rows.len())
        );
        // The label is off by what its rounding took.
        if let Some(offset_s) = bias_s.map(|bias_s| bias_s + tag.since(reading)) {
            let _ = write!(text, "{:6}{offset_s:15.12}", "");
        }
        text.push('\n');
        for (sv, rows) in satellites {
            let mut line = sv.to_string();
            for signal in self.signals.iter().filter(|signal| signal.system == sv.system) {
                match rows.iter().find(|row| row.signal.rinex == signal.rinex) {
                    Some(row) => {
                        let slipped = self
                            .seen
                            .get(&row.link())
                            .is_some_and(|seen| row.locked_s < reading.since(*seen) - SAME_TIME_S);
                        line += &values(row, planted!("gnss.exchange.slips", slipped, false));
                    }
                    None => line += &" ".repeat(64),
                }
            }
            text += line.trim_end();
            text.push('\n');
        }
        for row in &rows {
            self.seen.insert(row.link(), reading);
        }
        self.writer.write_all(text.as_bytes())
    }

    fn begin(&mut self, first: Epoch) -> io::Result<()> {
        let mut systems: Vec<System> = self.signals.iter().map(|signal| signal.system).collect();
        systems.dedup();
        let mut text = opening(self.version, "OBSERVATION DATA", &systems, first);
        text += &header_line(&self.marker, "MARKER NAME");
        text += &header_line("NON_GEODETIC", "MARKER TYPE");
        text += &header_line("", "OBSERVER / AGENCY");
        text += &header_line(
            &format!("{:20}{:20}{:20}", "", "gnss-twin", env!("CARGO_PKG_VERSION")),
            "REC # / TYPE / VERS",
        );
        text += &header_line("", "ANT # / TYPE");
        text += &header_line(&format!("{:14.4}{:14.4}{:14.4}", 0.0, 0.0, 0.0), "ANTENNA: DELTA H/E/N");
        for system in &systems {
            let of_it = self.signals.iter().filter(|signal| signal.system == *system);
            let types: Vec<String> =
                of_it.flat_map(|signal| ["C", "L", "D", "S"].map(|kind| format!("{kind}{}", signal.rinex))).collect();
            for (index, some) in types.chunks(TYPES_ON_A_LINE).enumerate() {
                let begin = if index == 0 { format!("{}  {:3}", system.letter(), types.len()) } else { " ".repeat(6) };
                text += &header_line(&format!("{begin} {}", some.join(" ")), "SYS / # / OBS TYPES");
            }
        }
        text += &header_line("DBHZ", "SIGNAL STRENGTH UNIT");
        let [year, month, day, hour, minute, second] = calendar(first);
        let ticks = (first.fraction() * TICKS_A_SECOND).round() as u64;
        text += &header_line(
            &format!("{year:6}{month:6}{day:6}{hour:6}{minute:6}{second:5}.{ticks:07}     GPS"),
            "TIME OF FIRST OBS",
        );
        text += &channels(&self.signals, self.version);
        // Phases are those of a band's reference signal. RINEX 4 asks for no such line.
        for signal in self.signals.iter().filter(|_| self.version == Version::Three) {
            let one = format!("{} L{} {}", signal.system.letter(), signal.rinex, shift(signal));
            text += &header_line(&one, "SYS / PHASE SHIFT");
        }
        text += &header_line("", "END OF HEADER");
        self.begun = true;
        self.writer.write_all(text.as_bytes())
    }
}

/// Correction in cycles that was added to a signal's phases to align them with the band's reference signal
/// (RINEX 3.05, tables A2 and A23). It is blank if none was added. The pilot's phase is measured where there
/// is one.
fn shift(signal: &Signal) -> String {
    let pilot = signal.components.iter().find(|component| component.message.is_none());
    let cycles = pilot.or(signal.components.first()).map_or(0.0, |component| component.phase_cycles);
    if cycles == 0.0 { String::new() } else { format!("{cycles:8.5}") }
}

/// Lines for satellites that divide a band: the channel of each, and by how much codes are aligned with
/// carriers, which here they are (RINEX 3.05, table A2; RINEX 4 does not ask for the latter).
fn channels(signals: &[&'static Signal], version: Version) -> String {
    let own = |signal: &&&'static Signal| matches!(signal.carrier, Carrier::Channels { .. });
    let Some(first) = signals.iter().find(own) else { return String::new() };
    let all: Vec<(Sv, i8)> = first.satellites().filter_map(|sv| Some((sv, first.link(sv).channel()?))).collect();
    let mut text = String::new();
    for (index, some) in all.chunks(CHANNELS_ON_A_LINE).enumerate() {
        let count = if index == 0 { format!("{:3} ", all.len()) } else { " ".repeat(4) };
        let written = |channel: i8| planted!("gnss.exchange.channels", channel, -channel);
        let each: String = some.iter().map(|(sv, channel)| format!("{sv} {:2} ", written(*channel))).collect();
        text += &header_line(&(count + &each), "GLONASS SLOT / FRQ #");
    }
    if version == Version::Three {
        let each: String = signals.iter().filter(own).map(|signal| format!(" C{} {:8.3}", signal.rinex, 0.0)).collect();
        text += &header_line(&each, "GLONASS COD/PHS/BIS");
    }
    text
}

/// Code, carrier, Doppler and C/N0 of a signal, each in 16 columns with its flags.
fn values(row: &Observation, slipped: bool) -> String {
    let number = |value: f64| if value.abs() <= LARGEST { format!("{value:14.3}") } else { " ".repeat(14) };
    // Strength in intervals of 6 dB (RINEX 3.05, table 9).
    let strength = (row.cn0_dbhz / 6.0).floor().clamp(1.0, 9.0);
    let flag = if slipped { "1" } else { " " };
    format!(
        "{} {strength:.0}{}{flag}{strength:.0}{}  {}  ",
        number(row.pseudorange_m),
        number(row.carrier_cycles),
        number(row.doppler_hz),
        number(row.cn0_dbhz)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::galileo::e1::E1;
    use crate::gps::l1ca::L1_CA;

    fn row(sample: u64, sv: Sv, signal: &'static Signal, locked_s: f64) -> Observation {
        let sent_s = Epoch::parse("2010-07-01T08:06:18").unwrap().seconds() + sample as i64;
        Observation {
            sample,
            sv,
            signal,
            sent_s,
            sent_fraction_s: 0.999_999_98 - 0.07,
            pseudorange_m: 0.07 * SPEED_OF_LIGHT_MPS,
            carrier_cycles: -1234.5678,
            doppler_hz: 2500.25,
            cn0_dbhz: 44.5,
            locked_s,
        }
    }

    #[test]
    fn columns_are_those_of_the_format_and_a_slip_is_flagged() {
        let galileo = Sv { system: System::Galileo, number: 11 };
        let mut bytes = Vec::new();
        let mut file = ObservationFile::new(&mut bytes, Version::Three, "roof 7", &[&E1, &L1_CA]);
        for (sample, locked_s) in [(0, 5.0), (1, 6.0), (2, 0.2), (3, 1.2)] {
            file.take(row(sample, Sv::gps(3), &L1_CA, locked_s)).unwrap();
            file.take(row(sample, galileo, &E1, 100.0)).unwrap();
            file.set_clock(1e-3);
        }
        file.finish().unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let (header, body) = text.split_once("END OF HEADER\n").unwrap();
        assert!(header.trim_end().lines().all(|line| line.len() <= 80 && line.len() > 60), "{header}");
        assert!(
            header.starts_with("     3.05           OBSERVATION DATA    M: Mixed            RINEX VERSION / TYPE"),
            "{header}"
        );
        assert!(
            header.contains("\nroof7")
                && header.contains("\nG    4 C1C L1C D1C S1C   ")
                && header.contains("\nE    4 C1C"),
            "{header}"
        );
        // Table A23: E1-B and L1 C/A are what their bands refer to, and E1-C has half a cycle.
        assert!(header.contains("\nG L1C     ") && header.contains("\nE L1C  0.50000     "), "{header}");
        let lines: Vec<&str> = body.lines().collect();
        // 20 ns before a whole second: the label is the second, and its clock less ahead.
        assert_eq!(lines[0], "> 2010 07 01 08 06 19.0000000  0  2       0.001000020000");
        assert_eq!(lines[1], "G03  20985472.060 7     -1234.568 7      2500.250          44.500");
        let flags: Vec<Option<&str>> =
            lines.iter().filter(|line| line.starts_with('G')).map(|line| line.get(33..34)).collect();
        assert_eq!(flags, [Some(" "), Some(" "), Some("1"), Some(" ")], "{body}");
        assert_eq!((lines.len(), body.matches("E11").count()), (12, 4));
    }
}
