//! Headers of observation files: what they observe, in RINEX 3's codes, and how their records are written.

use std::collections::BTreeMap;
use std::io::BufRead;

use super::{Lines, Parsed, columns};
use gnss::satellite::{Sv, System};

/// Header of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// `PGM` and `REC # / TYPE / VERS`, to say whose file it is.
    pub receiver: String,
    /// True if the header says that a clock offset was applied to epoch, code and phase.
    pub clock_applied: bool,
    /// Interval of its epochs, if it says one, seconds.
    pub interval_s: Option<f64>,
    /// Frequency channels of GLONASS satellites.
    pub channels: BTreeMap<Sv, i8>,
    /// True if the records are those of RINEX 2.
    pub(super) is_second: bool,
    /// True if the records are compressed by Hatanaka's scheme.
    pub(super) is_compressed: bool,
    /// System of satellites without a letter.
    letter: char,
    /// Codes by system, in the order of the records. An empty one is of an observation that is not read.
    types: BTreeMap<char, Vec<String>>,
    scales: BTreeMap<(char, String), f64>,
    /// Observations of RINEX 2, and how many more of them the header names.
    second: (Vec<String>, usize),
    /// A system whose list of types is not complete, and how many are missing.
    wanted: Option<(char, usize)>,
}

impl Header {
    pub(super) fn read<R: BufRead>(lines: &mut Lines<R>) -> Parsed<Self> {
        let mut first = lines.next()?.unwrap_or_default();
        let label = |line: &str| columns(line, 60, 80).to_owned();
        let mut header = Self::default();
        if label(&first) == "CRINEX VERS   / TYPE" {
            let version = columns(&first, 0, 20);
            if !["1.0", "3.0", "3.1"].contains(&version) {
                return Err(lines.fault(format!("CRINEX version '{version}': expected 1.0, 3.0 or 3.1")));
            }
            header.is_compressed = true;
            let program = lines.next()?.unwrap_or_default();
            if label(&program) != "CRINEX PROG / DATE" {
                return Err(lines.fault("expected a line that ends in CRINEX PROG / DATE"));
            }
            first = lines.next()?.unwrap_or_default();
        }
        if label(&first) != "RINEX VERSION / TYPE" {
            return Err(lines.fault("expected a first line that ends in RINEX VERSION / TYPE"));
        }
        let text = columns(&first, 0, 9);
        let version = text.parse::<f64>().ok();
        let version = version.filter(|v| (2.0..2.115).contains(v) || (3.0..5.0).contains(v));
        let Some(version) = version else {
            return Err(lines.fault(format!("version '{text}': expected 2.00 to 2.11 or 3.00 to 4.02")));
        };
        header.is_second = version < 3.0;
        if !columns(&first, 20, 40).starts_with('O') {
            let kind = columns(&first, 20, 40);
            return Err(lines.fault(format!("file type '{kind}': expected O, observation data")));
        }
        // A blank is GPS, and so are satellites without a letter in a mixed file.
        let letter = columns(&first, 40, 60).chars().next().filter(|letter| *letter != 'M');
        header.letter = letter.unwrap_or('G');
        while let Some(line) = lines.next()? {
            if label(&line) == "END OF HEADER" {
                header.complete().map_err(|what| lines.fault(what))?;
                return Ok(header);
            }
            header.line(&line).map_err(|what| lines.fault(what))?;
        }
        Err(lines.fault("the header does not end: expected END OF HEADER"))
    }

    /// Takes a line of the header, or of a record of header lines among the epochs.
    pub(super) fn line(&mut self, line: &str) -> Result<(), String> {
        match columns(line, 60, 80) {
            "SYS / # / OBS TYPES" if !self.is_second => self.types(line)?,
            "# / TYPES OF OBSERV" if self.is_second => self.second_types(line)?,
            "TIME OF FIRST OBS" => {
                let name = columns(line, 48, 51);
                time_system(if name.is_empty() && self.letter == 'R' { "GLO" } else { name })?;
            }
            "SYS / SCALE FACTOR" => self.scale(line)?,
            "GLONASS SLOT / FRQ #" => self.channels(line),
            // 2.11, table A1, and 3.05, table A2. Some say zero.
            "INTERVAL" => self.interval_s = columns(line, 0, 10).parse().ok().filter(|s: &f64| *s > 0.0),
            "RCV CLOCK OFFS APPL" => self.clock_applied = columns(line, 0, 6) == "1",
            "PGM / RUN BY / DATE" => columns(line, 0, 20).clone_into(&mut self.receiver),
            "REC # / TYPE / VERS" => {
                let own = format!("{} {}", columns(line, 20, 40), columns(line, 40, 60));
                own.trim().clone_into(&mut self.receiver);
            }
            _ => {}
        }
        Ok(())
    }

    /// Checks that all types are there that were announced, and gives those of RINEX 2 their codes.
    pub(super) fn complete(&mut self) -> Result<(), String> {
        self.no_more_wanted()?;
        if self.is_second {
            let (named, missing) = &self.second;
            if *missing > 0 {
                return Err(format!("{missing} observation types are missing before this line"));
            }
            self.types.clear();
            for (system, letter) in System::LETTERS.iter().filter(|_| !named.is_empty()) {
                let code = |text: &String| third(*system, text, named).unwrap_or_default();
                self.types.insert(*letter, named.iter().map(code).collect());
            }
        }
        if self.types.is_empty() {
            let label = if self.is_second { "# / TYPES OF OBSERV" } else { "SYS / # / OBS TYPES" };
            return Err(format!("the header names no observations: expected {label}"));
        }
        Ok(())
    }

    /// Checks that a system's list of types is as long as it said.
    fn no_more_wanted(&self) -> Result<(), String> {
        match self.wanted {
            Some((system, missing)) if missing > 0 => {
                Err(format!("{missing} observation types of system {system} are missing before this line"))
            }
            _ => Ok(()),
        }
    }

    fn types(&mut self, line: &str) -> Result<(), String> {
        if let Some(system) = line.chars().next().filter(|letter| !letter.is_whitespace()) {
            self.no_more_wanted()?;
            self.wanted = Some((system, count_of_types(columns(line, 3, 6))?));
            self.types.insert(system, Vec::new());
        }
        let Some((system, missing)) = &mut self.wanted else {
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

    /// Nine types a line (RINEX 2.11, table A1); lines that go on have no number.
    fn second_types(&mut self, line: &str) -> Result<(), String> {
        let (named, missing) = &mut self.second;
        let count = columns(line, 0, 6);
        if !count.is_empty() {
            if *missing > 0 {
                return Err(format!("{missing} observation types are missing before this line"));
            }
            (*named, *missing) = (Vec::new(), count_of_types(count)?);
        }
        for code in columns(line, 6, 60).split_whitespace() {
            if code.len() != 2 || *missing == 0 {
                return Err(format!("observation type '{code}': expected {missing} more codes of two characters"));
            }
            named.push(code.to_owned());
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

    /// Factor of the values of a code in the file.
    pub(super) fn scale_of(&self, sv: Sv, code: &str) -> f64 {
        if self.scales.is_empty() {
            return 1.0;
        }
        self.scales.get(&(sv.system.letter(), code.to_owned())).copied().unwrap_or(1.0)
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

    /// A satellite as the file names it. A blank stands for a leading zero and, in RINEX 2, for the letter of
    /// the file's own system.
    pub(super) fn satellite(&self, name: &str) -> Result<Sv, String> {
        let named = name.char_indices().map(|(at, c)| match (at, c) {
            (0, ' ') if self.is_second => self.letter,
            (_, ' ') => '0',
            _ => c,
        });
        let sv: Sv = named.collect::<String>().parse().map_err(|error| format!("{error}"))?;
        if self.types.contains_key(&sv.system.letter()) {
            return Ok(sv);
        }
        Err(format!("satellite {sv}: the header names no observations of its system"))
    }

    /// Codes of a system, in the order of the records.
    pub(super) fn codes(&self, system: System) -> &[String] {
        self.types.get(&system.letter()).map_or(&[], Vec::as_slice)
    }
}

fn count_of_types(text: &str) -> Result<usize, String> {
    let count = text.parse::<usize>().ok().filter(|count| (1..=200).contains(count));
    count.ok_or_else(|| format!("number of observation types '{text}': expected 1 to 200"))
}

/// Seconds of these scales are those of GPS time; BDT is 14 s behind, GLO is UTC.
fn time_system(name: &str) -> Result<(), String> {
    if ["", "GPS", "GAL", "QZS", "IRN"].contains(&name) {
        return Ok(());
    }
    Err(format!("time system '{name}': expected GPS, GAL, QZS or IRN"))
}

/// The code of RINEX 3 for an observation of RINEX 2.11, whose definition is by system and band alone
/// (2.11, table A1, and 3.05, tables 4 to 10): `X` where it does not say which component is tracked. Phase,
/// Doppler and strength of L1 and L2 belong to the P code where the file has no other one, and at L2 wherever
/// it has it. `None` of what a system does not send, or what is no such observation.
fn third(system: System, text: &str, named: &[String]) -> Option<String> {
    let has = |code: &str| named.iter().any(|name| name == code);
    let (kind, band) = (text.get(..1)?, text.get(1..)?);
    let (kind, is_p) = if kind == "P" { ("C", true) } else { (kind, false) };
    if !["C", "L", "D", "S"].contains(&kind) {
        return None;
    }
    // Of a code itself: which one it is. Of the others: the one that they are taken with.
    let of_p = if kind == "C" { is_p } else { has(&format!("P{band}")) && (band == "2" || !has(&format!("C{band}"))) };
    let attribute = match (system, band) {
        (System::Gps, "1" | "2") if of_p => "W",
        (System::Glonass, "1" | "2") if of_p => "P",
        _ if is_p => return None,
        (System::Gps | System::Glonass | System::Qzss | System::Sbas, "1") | (System::Glonass, "2") => "C",
        (System::Gps | System::Qzss, "2" | "5")
        | (System::Qzss, "6")
        | (System::Galileo, "1" | "5" | "6" | "7" | "8") => "X",
        (System::Sbas, "5") | (System::BeiDou, "2" | "6" | "7") => "I",
        (System::Navic, "5" | "9") => "A",
        _ => return None,
    };
    Some(format!("{kind}{band}{attribute}"))
}
