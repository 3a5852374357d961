//! Settings of a search.

use serde::{Deserialize, Serialize};

use crate::described::described;
use gnss::gps::l1ca::L1_CA;
use gnss::signal::{self, Component, Signal};

use super::AcquireError;

described! {
/// Settings of the search. The defaults find 38 dB-Hz with a probability above 0.99 (see [`super`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AcquisitionSettings {
    /// Largest searched Doppler of either sign. It must include the offset of the local oscillator.
    pub doppler_max_hz: f64,
    /// Signals to search for, or "all" for every signal within the bands. Empty means the signals of the
    /// recording's metadata, or in `run` those of the scene; else GPS L1 C/A if it is within the bands; else
    /// all.
    pub signals: Vec<String>,
    /// Code periods of 1 ms summed coherently. Longer codes use as many periods as begin in that time. Codes
    /// under a secondary code use one.
    pub coherent_periods: u32,
    /// Number of coherent sums whose powers are added; shorter sums use more.
    pub noncoherent_sums: u32,
    /// Doppler step times coherent time. 0.5 loses 0.91 dB at worst and 0.29 dB on average; 2/3 loses 1.65
    /// and 0.51 dB.
    pub doppler_step_cycles: f64,
    /// Largest number of search cells per chip, interpolated to twice as many. Faster recordings are
    /// band-limited to this many times the chip rate for the search.
    pub cells_per_chip: f64,
    /// Probability that the search over all cells reports one absent satellite. It holds for noise, and for
    /// cross-correlation where that is seen to make the tail heavier. The default costs 0.7 dB against 1e-3.
    pub false_alarm_probability: f64,
    /// Search for reserved codes, which no satellite of the constellation sends: PRN 33 to 37 of GPS, codes
    /// outside 19 to 50 of BeiDou B1C, B2a and B2b, codes above 18 of B2I.
    pub reserved_codes: bool,
}
}

/// Widest range of Dopplers that a search may be asked for, in hertz.
pub(crate) const MOST_DOPPLER_HZ: f64 = 1e6;
/// Largest number of sums that a search may be asked for.
pub(crate) const MOST_SUMS: u32 = 100_000;

/// Word in place of names, for all signals that the bands hold.
pub const ALL: &str = "all";

/// Code periods of a symbol that are too few to sum more than one coherently before its edges are known.
const FEW: u32 = 3;

/// True if the sign may turn after every code period, or nearly: by a secondary code, or by symbols of few
/// periods. Sums of that length all contain an edge if one does. Half of the power is then found beside the
/// Doppler.
pub(super) fn sign_turns_often(component: &Component) -> bool {
    let few = |periods: Option<u32>| periods.is_none_or(|periods| periods <= FEW);
    component.secondary_code.periods() > 1 || (component.message.is_some() && few(component.periods_per_symbol()))
}

impl Default for AcquisitionSettings {
    fn default() -> Self {
        Self {
            signals: Vec::new(),
            doppler_max_hz: 5000.0,
            coherent_periods: 2,
            noncoherent_sums: 10,
            doppler_step_cycles: 0.5,
            cells_per_chip: 2.0,
            false_alarm_probability: 1e-6,
            reserved_codes: false,
        }
    }
}

impl AcquisitionSettings {
    /// Searches for these, each once, where no names are set.
    pub fn or_signals(&mut self, signals: &[&'static Signal]) {
        if self.signals.is_empty() {
            let first = |(number, signal): &(usize, &&Signal)| {
                signals.iter().position(|other| other == *signal) == Some(*number)
            };
            let each = signals.iter().enumerate().filter(first);
            self.signals = each.map(|(_, signal)| signal.name.to_owned()).collect();
        }
    }

    /// True if the bands decide which signals are searched for.
    pub fn is_all(&self) -> bool {
        self.signals == [ALL]
    }

    /// The signals that are searched for, of names that are known.
    pub fn signals(&self) -> Vec<&'static Signal> {
        if self.signals.is_empty() {
            return vec![&L1_CA];
        }
        self.signals.iter().filter_map(|name| Signal::find(name)).collect()
    }

    /// Code periods of a component that are summed coherently: not beyond what keeps its sign.
    pub fn periods(&self, component: &Component) -> u32 {
        let whole = 1e-3 * f64::from(self.coherent_periods) / component.period_s();
        let steady = if sign_turns_often(component) {
            1
        } else {
            component.message.map_or(u32::MAX, |_| component.periods_per_symbol().unwrap_or(1))
        };
        // Beyond rounding of the quotient a period that has begun counts.
        ((whole - 1e-9).ceil() as u32).clamp(1, steady)
    }

    /// Coherent sums of a component: more where they had to be shorter.
    pub fn sums(&self, component: &Component) -> u32 {
        let asked = 1e-3 * f64::from(self.coherent_periods);
        let share = asked / (component.period_s() * f64::from(self.periods(component)));
        (f64::from(self.noncoherent_sums) * share.max(1.0) - 1e-9).ceil() as u32
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`AcquireError::Setting`] with the first key that is out of its range.
    pub fn validate(&self) -> Result<(), AcquireError> {
        let rules: [(&'static str, f64, f64, f64, &'static str); 6] = [
            ("doppler_max_hz", self.doppler_max_hz, 0.0, MOST_DOPPLER_HZ, "0 to 1e6 Hz"),
            ("coherent_periods", f64::from(self.coherent_periods), 1.0, 1000.0, "1 to 1000"),
            ("noncoherent_sums", f64::from(self.noncoherent_sums), 1.0, f64::from(MOST_SUMS), "1 to 100 000"),
            ("doppler_step_cycles", self.doppler_step_cycles, 0.01, 1.0, "0.01 to 1 cycle"),
            ("cells_per_chip", self.cells_per_chip, 2.0, 100.0, "2 to 100"),
            ("false_alarm_probability", self.false_alarm_probability, 1e-12, 0.5, "1e-12 to 0.5"),
        ];
        if let Some(name) = self.signals.iter().find(|name| Signal::find(name).is_none() && !self.is_all()) {
            let known =
                signal::all().iter().map(|signal| format!("\"{}\"", signal.name)).collect::<Vec<_>>().join(", ");
            return Err(AcquireError::UnknownSignal { name: name.clone(), known: known + &Signal::suggestion(name) });
        }
        for (key, value, low, high, expected) in rules {
            if !(low..=high).contains(&value) {
                return Err(AcquireError::Setting { key, value, expected });
            }
        }
        Ok(())
    }
}
