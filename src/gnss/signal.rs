//! A signal is data: a carrier and components, each with a code, a chip shape and perhaps a message.
//!
//! To add a signal: one file in `gnss/<system>/` with a `static` [`Signal`], one word in
//! [`SIGNALS`]. Law tests walk that registry. Nothing outside `gnss` may branch on a signal's name.

use std::fmt;
use std::hash::{Hash, Hasher};

use crate::gnss::gps;
use crate::gnss::satellite::{Sv, System};

/// Every signal that this program knows.
pub static SIGNALS: [&Signal; 1] = [&gps::l1ca::L1_CA];

/// A signal that satellites of one system send on one carrier.
#[derive(Debug)]
pub struct Signal {
    /// Name as people write it, unique in [`SIGNALS`].
    pub name: &'static str,
    /// RINEX 3 band and attribute, for `C1C`, `L1C`, `D1C`, `S1C`.
    pub rinex: &'static str,
    pub system: System,
    /// First and last number of the constellation's satellites; codes of others are reserved for other transmitters.
    pub constellation: [u8; 2],
    /// Carrier frequency.
    pub carrier_hz: f64,
    /// What is sent on that carrier; powers add up to one.
    pub components: &'static [Component],
}

/// One spreading code on a carrier.
#[derive(Debug)]
pub struct Component {
    /// Share of the signal's power.
    pub power_share: f64,
    /// Carrier phase relative to the signal's reference phase.
    pub phase_cycles: f64,
    /// Chips a second, by the satellite's clock.
    pub chip_rate_hz: f64,
    /// Chips in one period of the code.
    pub code_chips: u32,
    /// The code of a satellite by its number there: `code_chips` values, `true` for a logical 1
    /// (sent as −1). `None` where the document assigns none.
    pub code: fn(u8) -> Option<Vec<bool>>,
    pub shape: Shape,
    pub message: Option<Message>,
}

/// How one chip looks: equal steps of +1 and −1. BPSK has one step.
#[derive(Debug)]
pub struct Shape {
    /// The pulse that a chip wears, as signs of equal steps.
    pub pulse: &'static [i8],
}

/// The data that modulate a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// GPS legacy navigation message, 50 bit/s (IS-GPS-200N, 20.3.2).
    GpsLnav,
}

impl Message {
    /// Code periods that carry one symbol.
    pub fn periods_per_symbol(self) -> u32 {
        match self {
            Self::GpsLnav => 20,
        }
    }
}

impl Signal {
    /// The signal of that name.
    pub fn find(name: &str) -> Option<&'static Self> {
        SIGNALS.into_iter().find(|signal| signal.name == name)
    }

    /// Carrier wavelength.
    pub fn wavelength_m(&self) -> f64 {
        crate::gnss::earth::SPEED_OF_LIGHT_MPS / self.carrier_hz
    }

    /// Satellites of this signal's system to which its documents assign a code.
    pub fn satellites(&'static self) -> impl Iterator<Item = Sv> {
        (1..=u8::MAX)
            .filter(|&number| self.components.iter().all(|c| (c.code)(number).is_some()))
            .map(|number| Sv { system: self.system, number })
    }
}

impl Component {
    /// Duration of one code period by the satellite's clock.
    pub fn period_s(&self) -> f64 {
        f64::from(self.code_chips) / self.chip_rate_hz
    }
}

impl PartialEq for Signal {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Signal {}

impl Hash for Signal {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}

impl PartialOrd for Signal {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Signal {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.name.cmp(other.name)
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}

/// Serde of a `&'static Signal` by its name, for `#[serde(with = …)]`.
pub mod by_name {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    use super::Signal;

    /// Writes the name.
    pub fn serialize<S: Serializer>(signal: &&'static Signal, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(signal.name)
    }

    /// Reads a name and looks the signal up.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<&'static Signal, D::Error> {
        let name = String::deserialize(deserializer)?;
        Signal::find(&name).ok_or_else(|| D::Error::custom(format!("unknown signal '{name}'")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_registered_signal_is_complete_and_found_by_its_name() {
        for signal in SIGNALS {
            assert!(std::ptr::eq(Signal::find(signal.name).unwrap(), signal));
            let power: f64 = signal.components.iter().map(|c| c.power_share).sum();
            assert!((power - 1.0).abs() < 1e-12, "{signal}");
            for component in signal.components {
                assert!(signal.satellites().count() > 0);
                for sv in signal.satellites() {
                    let code = (component.code)(sv.number).unwrap();
                    assert_eq!(code.len(), component.code_chips as usize, "{signal} {sv}");
                }
            }
        }
    }
}
