//! Signals that a text describes: a scenario names it as a file, and metadata and truth carry it to a
//! receiver and a judge that have no such file.
//!
//! The text is TOML. It takes system, time, satellites and message from a built-in signal, and gives carrier,
//! components and codes itself. Every value is checked before the signal is registered. What a description
//! cannot say, a `static` [`Signal`] can: a message, system or time scale of its own, a secondary code of
//! each satellite's own, pulses on some of the chips, several carriers.

mod codes;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{PoisonError, RwLock};

use serde::Deserialize;
use thiserror::Error;

use super::{Carrier, Component, Layer, SIGNALS, SecondaryCode, Signal, register};
use codes::{Register, Source};

/// Carriers in Hz.
const CARRIERS_HZ: [f64; 2] = [1e8, 3e10];
/// Received powers in dBW.
const POWERS_DBW: [f64; 2] = [-220.0, -100.0];
/// Chips per second.
const CHIP_RATES_HZ: [f64; 2] = [1e3, 1e8];
const MOST_CHIPS: u32 = 1_000_000;
const MOST_COMPONENTS: usize = 8;
const MOST_LAYERS: usize = 8;
const MOST_STEPS: usize = 64;
const MOST_SECONDARY_CHIPS: usize = 10_000;
/// Difference from one of a sum of shares that were written in decimal digits.
const ROUNDING: f64 = 1e-9;

/// Reason for which a text describes no signal.
#[derive(Debug, Error, PartialEq)]
pub enum DescriptionError {
    /// Text that is no TOML, or a key or type that a description does not have.
    #[error("description of a signal: {0}")]
    Toml(String),
    /// Value that cannot be used.
    #[error("description of a signal: {path}: expected {expected}")]
    Value {
        /// The key with the tables that it is in; tables of an array count from 1: `component[2].codes.G01`.
        path: String,
        /// Values that are expected.
        expected: String,
    },
}

/// Content of a text.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    name: String,
    rinex: String,
    like: String,
    carrier_hz: Option<f64>,
    minimum_power_dbw: Option<f64>,
    component: Vec<Part>,
}

/// Table `[[component]]`.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Part {
    power_share: f64,
    #[serde(default)]
    phase_cycles: f64,
    chip_rate_hz: f64,
    code_chips: u32,
    #[serde(default)]
    codes: BTreeMap<String, String>,
    #[serde(default)]
    register: Vec<Register>,
    pulse: Option<Vec<f64>>,
    #[serde(default)]
    layer: Vec<Pulse>,
    secondary_code: Option<String>,
    #[serde(default)]
    message: bool,
}

/// Table `[[component.layer]]`.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Pulse {
    power_share: f64,
    #[serde(default)]
    phase_cycles: f64,
    pulse: Vec<f64>,
}

/// A registered signal and its text.
struct Entry {
    signal: &'static Signal,
    description: Description,
    text: String,
}

/// Signals that texts have described, as long as the program runs.
static DESCRIBED: RwLock<Vec<Entry>> = RwLock::new(Vec::new());

/// Registers the signal that a text describes, or returns the one that an equal text has described before.
///
/// # Errors
/// Text that describes no signal, or another one of a name that is taken.
pub fn registered(text: &str) -> Result<&'static Signal, DescriptionError> {
    let description: Description =
        toml::from_str(text).map_err(|error| DescriptionError::Toml(error.message().to_owned()))?;
    let mut described = DESCRIBED.write().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = described.iter().find(|known| known.description == description) {
        return Ok(known.signal);
    }
    let signal = description.signal()?;
    if Signal::find(signal.name).is_some() {
        return Err(refused("name", "a name that no other signal has"));
    }
    let signal: &'static Signal = Box::leak(Box::new(signal));
    register(signal).map_err(|taken| refused("name", &taken.to_string()))?;
    described.push(Entry { signal, description, text: text.to_owned() });
    Ok(signal)
}

/// Texts of those among the signals that texts have described, each once.
pub fn texts_of<'s>(signals: impl IntoIterator<Item = &'s Signal>) -> Vec<String> {
    let names: BTreeSet<&str> = signals.into_iter().map(|signal| signal.name).collect();
    let described = DESCRIBED.read().unwrap_or_else(PoisonError::into_inner);
    described.iter().filter(|entry| names.contains(entry.signal.name)).map(|entry| entry.text.clone()).collect()
}

fn refused(path: &str, expected: &str) -> DescriptionError {
    DescriptionError::Value { path: path.to_owned(), expected: expected.to_owned() }
}

/// Refuses a number out of its range.
fn within(path: &str, number: f64, [least, most]: [f64; 2], unit: &str) -> Result<(), DescriptionError> {
    let refuse = || refused(path, format!("a number from {least} to {most} {unit}").trim_end());
    (least..=most).contains(&number).then_some(()).ok_or_else(refuse)
}

impl Description {
    fn signal(&self) -> Result<Signal, DescriptionError> {
        let like = SIGNALS.iter().find(|signal| signal.name == self.like);
        let like = *like.ok_or_else(|| refused("like", "the name of a built-in signal"))?;
        self.check_names(like)?;
        let carrier = match self.carrier_hz {
            None => like.carrier,
            Some(hz) => within("carrier_hz", hz, CARRIERS_HZ, "Hz").map(|()| Carrier::Common(hz))?,
        };
        if let Some(dbw) = self.minimum_power_dbw {
            within("minimum_power_dbw", dbw, POWERS_DBW, "dBW")?;
        }
        if !(1..=MOST_COMPONENTS).contains(&self.component.len()) {
            return Err(refused("component", &format!("1 to {MOST_COMPONENTS} components")));
        }
        let power: f64 = self.component.iter().map(|part| part.power_share).sum();
        if (power - 1.0).abs() > ROUNDING {
            return Err(refused("component", &format!("power shares that add up to 1, not to {power}")));
        }
        let parts = (1..).zip(&self.component).map(|(number, part)| (format!("component[{number}]"), part));
        let parts: Vec<_> = parts.map(|(path, part)| part.component(&path, like)).collect::<Result<_, _>>()?;
        let mut first = None;
        let mut components = Vec::with_capacity(parts.len());
        for (number, (component, satellites)) in (1..).zip(parts) {
            if *first.get_or_insert_with(|| satellites.clone()) != satellites {
                return Err(refused(&format!("component[{number}]"), "codes of the same satellites as component 1"));
            }
            components.push(component);
        }
        Ok(Signal {
            name: String::leak(self.name.clone()),
            rinex: String::leak(self.rinex.clone()),
            system: like.system,
            time: like.time,
            constellation: like.constellation,
            carrier,
            sent: like.sent,
            minimum_power_dbw: self.minimum_power_dbw.or(like.minimum_power_dbw),
            components: Vec::leak(components),
        })
    }

    fn check_names(&self, like: &Signal) -> Result<(), DescriptionError> {
        let fits = |c: char| c.is_ascii_alphanumeric() || " /-+_.()".contains(c);
        let name = self.name.as_str();
        // Settings write `all` for the signals of the band.
        let is_name = (1..=40).contains(&name.len()) && name.trim() == name && name.chars().all(fits);
        if !is_name || name.eq_ignore_ascii_case("all") {
            return Err(refused("name", "1 to 40 letters, digits, blanks and /-+_.(), and not all"));
        }
        let is_code = matches!(self.rinex.as_bytes(), [b'1'..=b'9', b'A'..=b'Z']);
        let is_taken = SIGNALS.iter().any(|other| other.system == like.system && other.rinex == self.rinex);
        if !is_code || is_taken {
            let expected = "a digit and a capital letter, such as 1A, that no built-in signal of the system has";
            return Err(refused("rinex", expected));
        }
        Ok(())
    }
}

impl Part {
    /// The component, and the numbers of the satellites that have codes.
    fn component(&self, path: &str, like: &Signal) -> Result<(Component, BTreeSet<u8>), DescriptionError> {
        let at = |key: &str| format!("{path}.{key}");
        within(&at("power_share"), self.power_share, [1e-6, 1.0], "")?;
        within(&at("phase_cycles"), self.phase_cycles, [-1.0, 1.0], "cycles")?;
        within(&at("chip_rate_hz"), self.chip_rate_hz, CHIP_RATES_HZ, "Hz")?;
        if !(1..=MOST_CHIPS).contains(&self.code_chips) {
            return Err(refused(&at("code_chips"), &format!("an integer from 1 to {MOST_CHIPS}")));
        }
        let source = Source::new(self, path, like.system)?;
        let satellites = source.satellites();
        let source: &'static Source = Box::leak(Box::new(source));
        let message = match like.components.iter().find_map(|component| component.message) {
            None if self.message => return Err(refused(&at("message"), &format!("no message, as {like} has none"))),
            message => message.filter(|_| self.message),
        };
        let component = Component {
            power_share: self.power_share,
            phase_cycles: self.phase_cycles,
            chip_rate_hz: self.chip_rate_hz,
            code_chips: self.code_chips,
            code: Box::leak(Box::new(move |number| source.code(number))),
            layers: Vec::leak(self.layers(path)?),
            secondary_code: self.secondary_code(path)?,
            message,
        };
        let power = component.shape().correlation(0.0);
        if (power - 1.0).abs() > ROUNDING {
            let expected = format!("layers whose sum has a mean power of 1, not of {power}");
            return Err(refused(&at("layer"), &expected));
        }
        let half_cycles = component.tone().map_or(0, |tone| tone.half_cycles.unsigned_abs());
        if !(half_cycles * self.code_chips).is_multiple_of(2) {
            return Err(refused(&at("code_chips"), "an even number, after which the subcarrier begins again"));
        }
        self.check_symbols(&component, path)?;
        Ok((component, satellites))
    }

    /// Refuses a code whose periods do not divide the message's symbols.
    fn check_symbols(&self, component: &Component, path: &str) -> Result<(), DescriptionError> {
        let Some(message) = component.message else { return Ok(()) };
        let symbol_s = message.symbol_s;
        let Some(periods) = component.periods_per_symbol() else {
            let expected = format!("a code whose periods divide the message's symbols of {symbol_s} s");
            return Err(refused(&format!("{path}.code_chips"), &expected));
        };
        if !periods.is_multiple_of(component.secondary_code.periods()) {
            let expected = format!("a length that divides the {periods} code periods of a symbol");
            return Err(refused(&format!("{path}.secondary_code"), &expected));
        }
        Ok(())
    }

    fn layers(&self, path: &str) -> Result<Vec<Layer>, DescriptionError> {
        let (pulse_path, layer_path) = (format!("{path}.pulse"), format!("{path}.layer"));
        match &self.pulse {
            Some(_) if !self.layer.is_empty() => return Err(refused(&pulse_path, "no pulse beside layers")),
            Some(pulse) => return Ok(vec![Layer { pulse: signs(&pulse_path, pulse)?, ..Layer::BPSK }]),
            None if self.layer.is_empty() => return Ok(vec![Layer::BPSK]),
            None if self.layer.len() > MOST_LAYERS => {
                return Err(refused(&layer_path, &format!("at most {MOST_LAYERS} layers")));
            }
            None => {}
        }
        let layer = |(number, layer): (usize, &Pulse)| {
            let at = |key: &str| format!("{layer_path}[{number}].{key}");
            within(&at("power_share"), layer.power_share, [1e-6, 1.0], "")?;
            within(&at("phase_cycles"), layer.phase_cycles, [-1.0, 1.0], "cycles")?;
            let weight = layer.power_share.sqrt();
            Ok(Layer {
                weight,
                phase_cycles: layer.phase_cycles,
                pulse: signs(&at("pulse"), &layer.pulse)?,
                chips: &[],
            })
        };
        (1..).zip(&self.layer).map(layer).collect()
    }

    fn secondary_code(&self, path: &str) -> Result<SecondaryCode, DescriptionError> {
        let Some(digits) = &self.secondary_code else { return Ok(SecondaryCode::None) };
        let chip = |digit| match digit {
            '0' => Some(1),
            '1' => Some(-1),
            _ => None,
        };
        let chips: Option<Vec<i8>> = digits.chars().map(chip).collect();
        let expected = format!("2 to {MOST_SECONDARY_CHIPS} digits 0 and 1");
        let chips = chips.filter(|chips| (2..=MOST_SECONDARY_CHIPS).contains(&chips.len()));
        let chips = chips.ok_or_else(|| refused(&format!("{path}.secondary_code"), &expected))?;
        Ok(SecondaryCode::Shared(Vec::leak(chips)))
    }
}

/// Signs of a pulse's steps.
fn signs(path: &str, steps: &[f64]) -> Result<&'static [i8], DescriptionError> {
    let sign = |step: &f64| if step.abs() == 1.0 { Some(step.signum() as i8) } else { None };
    let signs: Option<Vec<i8>> = steps.iter().map(sign).collect();
    let signs = signs.filter(|signs| (1..=MOST_STEPS).contains(&signs.len()));
    let signs = signs.ok_or_else(|| refused(path, &format!("1 to {MOST_STEPS} steps of -1 or 1")))?;
    Ok(Vec::leak(signs))
}

#[cfg(test)]
mod tests;
