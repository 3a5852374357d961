//! Codes of a description: digits of each satellite, or shift registers.
//!
//! A logical 0 is +1 and a logical 1 is −1, as everywhere. A register's output is its last stage; the sum of
//! its taps is fed back to its first one, as in figure 3-8 of IS-GPS-200N. All registers begin again with
//! each period of the code, and their outputs are added.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

use super::{DescriptionError, Part, refused};
use crate::satellite::{Sv, System};

const MOST_REGISTERS: usize = 4;
const MOST_STAGES: u32 = 60;

/// Table `[[component.register]]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Register {
    stages: u32,
    taps: Vec<f64>,
    start: Option<String>,
    #[serde(default)]
    starts: BTreeMap<String, String>,
}

/// Codes of the satellites by their numbers.
pub(super) enum Source {
    /// Digits of each satellite, four chips in one, the first chip highest.
    Digits { chips: usize, codes: BTreeMap<u8, String> },
    /// Shift registers whose outputs are added.
    Registers { chips: usize, registers: Vec<Shifted> },
}

/// A register as it runs; stage 1 is the lowest bit.
pub(super) struct Shifted {
    stages: u32,
    /// Stages that are fed back.
    taps: u64,
    /// First state of satellites that have one of their own.
    starts: BTreeMap<u8, u64>,
    /// First state of all satellites if these are none.
    start: u64,
}

impl Source {
    /// # Errors
    /// Codes that are of another length, of no satellite of the system, or given twice or not at all.
    pub(super) fn new(part: &Part, path: &str, system: System) -> Result<Self, DescriptionError> {
        let chips = part.code_chips as usize;
        match (part.codes.is_empty(), part.register.is_empty()) {
            (false, true) => {
                let at = format!("{path}.codes");
                let codes = by_number(&part.codes, &at, system, |digits| digits_of(digits, chips))?;
                Ok(Self::Digits { chips, codes })
            }
            (true, false) if part.register.len() <= MOST_REGISTERS => {
                let numbered = (1..).zip(&part.register);
                let shifted = |(number, register): (usize, &Register)| {
                    register.shifted(&format!("{path}.register[{number}]"), system)
                };
                let registers: Vec<Shifted> = numbered.map(shifted).collect::<Result<_, _>>()?;
                Self::of_registers(chips, registers, path)
            }
            (true, false) => Err(refused(&format!("{path}.register"), &format!("at most {MOST_REGISTERS}"))),
            _ => Err(refused(&format!("{path}.codes"), "either codes or registers")),
        }
    }

    fn of_registers(chips: usize, registers: Vec<Shifted>, path: &str) -> Result<Self, DescriptionError> {
        let mut own = registers.iter().map(|register| &register.starts).filter(|starts| !starts.is_empty());
        let at = format!("{path}.register");
        let Some(first) = own.next() else {
            return Err(refused(&at, "starts of each satellite in one of the registers"));
        };
        if !own.all(|starts| starts.keys().eq(first.keys())) {
            return Err(refused(&at, "starts of the same satellites in all registers that have them"));
        }
        Ok(Self::Registers { chips, registers })
    }

    /// Numbers of the satellites that have codes.
    pub(super) fn satellites(&self) -> BTreeSet<u8> {
        match self {
            Self::Digits { codes, .. } => codes.keys().copied().collect(),
            Self::Registers { registers, .. } => registers.iter().flat_map(|one| one.starts.keys().copied()).collect(),
        }
    }

    /// Code of a satellite: values of ±1. `None` if the description gives none.
    pub(super) fn code(&self, number: u8) -> Option<Vec<i8>> {
        let sign = |one: bool| if one { -1 } else { 1 };
        match self {
            Self::Digits { chips, codes } => {
                let digits = codes.get(&number)?.chars().filter_map(|digit| digit.to_digit(16));
                let bits = digits.flat_map(|digit| (0..4).rev().map(move |bit| digit >> bit & 1 == 1));
                Some(bits.take(*chips).map(sign).collect())
            }
            Self::Registers { chips, registers } => {
                let mut running: Vec<(&Shifted, u64)> =
                    registers.iter().map(|one| Some((one, one.first(number)?))).collect::<Option<_>>()?;
                let mut chip = || running.iter_mut().fold(false, |sum, (one, state)| sum ^ one.shift(state));
                Some((0..*chips).map(|_| sign(chip())).collect())
            }
        }
    }
}

impl Register {
    fn shifted(&self, path: &str, system: System) -> Result<Shifted, DescriptionError> {
        let at = |key: &str| format!("{path}.{key}");
        let stages = self.stages;
        if !(2..=MOST_STAGES).contains(&stages) {
            return Err(refused(&at("stages"), &format!("an integer from 2 to {MOST_STAGES}")));
        }
        let is_stage = |tap: &f64| (1..=stages).any(|stage| f64::from(stage) == *tap);
        if !self.taps.iter().all(is_stage) || !self.taps.contains(&f64::from(stages)) {
            return Err(refused(&at("taps"), &format!("stages from 1 to {stages}, the last one among them")));
        }
        let taps = self.taps.iter().fold(0_u64, |mask, tap| mask | 1 << (*tap as u32 - 1));
        let state = |digits: &str| state_of(digits, stages);
        if self.start.is_some() && !self.starts.is_empty() {
            return Err(refused(&at("start"), "no start beside starts"));
        }
        let start = match &self.start {
            None => (1 << stages) - 1,
            Some(digits) => state(digits).map_err(|expected| refused(&at("start"), &expected))?,
        };
        let states = by_number(&self.starts, &at("starts"), system, |digits| state(digits).map(|_| digits.to_owned()))?;
        let starts = states.into_iter().filter_map(|(number, digits)| Some((number, state(&digits).ok()?))).collect();
        Ok(Shifted { stages, taps, starts, start })
    }
}

impl Shifted {
    /// First state for a satellite; `None` if others have states and it has none.
    fn first(&self, number: u8) -> Option<u64> {
        if self.starts.is_empty() { Some(self.start) } else { self.starts.get(&number).copied() }
    }

    /// Output of the last stage, and the next state.
    fn shift(&self, state: &mut u64) -> bool {
        let output = *state >> (self.stages - 1) & 1 == 1;
        let fed_back = u64::from((*state & self.taps).count_ones() & 1);
        *state = (*state << 1 | fed_back) & ((1 << self.stages) - 1);
        output
    }
}

/// Texts by the numbers of the satellites, each checked and without what `read` leaves out.
fn by_number(
    texts: &BTreeMap<String, String>,
    path: &str,
    system: System,
    read: impl Fn(&str) -> Result<String, String>,
) -> Result<BTreeMap<u8, String>, DescriptionError> {
    let mut found = BTreeMap::new();
    for (name, text) in texts {
        // G1 and G01 would be one satellite.
        let sv = name.parse::<Sv>().ok().filter(|sv| sv.system == system && sv.to_string() == *name);
        let Some(sv) = sv else {
            let expected = format!("satellites like {}01 as keys, not {name:?}", system.letter());
            return Err(refused(path, &expected));
        };
        found.insert(sv.number, read(text).map_err(|expected| refused(&format!("{path}.{name}"), &expected))?);
    }
    Ok(found)
}

/// Digits of a code without blanks and breaks of lines, or what is expected of them.
fn digits_of(text: &str, chips: usize) -> Result<String, String> {
    let digits: String = text.chars().filter(|c| !c.is_ascii_whitespace()).collect();
    let count = chips.div_ceil(4);
    let unused = (4 * count - chips) as u32;
    let last = digits.chars().last().and_then(|digit| digit.to_digit(16)).unwrap_or(0);
    let is_code = digits.chars().all(|c| c.is_ascii_hexdigit()) && digits.len() == count;
    match last & ((1 << unused) - 1) {
        0 if is_code => Ok(digits),
        _ if is_code => Err(format!("zeros in the last {unused} bits, which are beyond the {chips} chips")),
        _ => {
            let have = digits.chars().count();
            Err(format!("{count} hexadecimal digits for {chips} chips, not {have} characters"))
        }
    }
}

/// State of a register of so many stages, whose digits begin with stage 1, or what is expected of them.
fn state_of(digits: &str, stages: u32) -> Result<u64, String> {
    let is_state = digits.len() == stages as usize && digits.bytes().all(|digit| matches!(digit, b'0' | b'1'));
    let ones = || digits.bytes().zip(0..).filter(|(digit, _)| *digit == b'1');
    let state = is_state.then(|| ones().fold(0_u64, |state, (_, stage)| state | 1 << stage));
    state.ok_or_else(|| format!("{stages} digits 0 and 1, stage 1 first"))
}
