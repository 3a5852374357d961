//! What a receiver's settings let one expect of it: how weak a signal it finds, how soon, how weak a one it
//! holds.
//!
//! Search and loops are those of theory with the settings of `rx/receiver.json`: a receiver that names none
//! is taken to have the defaults of a common one. Losses of the search are its worst: half a cell of code,
//! half a step of Doppler.

use serde_json::Value;

use crate::expect::theory::{detection, pll};
use crate::read::Run;
use crate::waveform::leading;
use gnss::signal::{SIGNALS, Signal};

/// Jitter up to which a phase loop is expected to hold for good: 3σ leaves a third of the discriminator's 45°
/// to oscillator and motion.
const HOLDING_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Least C/N0 at which the message can be read: at 27 dB-Hz one bit in 4e6 is wrong (Eb/N0 of 10 dB).
const MESSAGE_DBHZ: f64 = 27.0;
/// Share of the power that the worst place between cells leaves: 2.0 dB of code at few samples a chip, and
/// one sum in ten half lost to a data bit.
const CODE_LOSS: f64 = 0.6 * 0.95;
/// With one cell between any two there are so many more of the same law.
const CELLS_BETWEEN: f64 = 1.5;
/// Detection so sure that one search counts no more.
const SUREST: f64 = 1.0 - 1e-7;

/// The expectations that settings justify.
#[derive(Clone, Debug, PartialEq)]
pub struct Receiver {
    /// As `rx/receiver.json` has them.
    settings: Value,
    /// Of the first search and of later ones: threshold of a cell's statistic.
    thresholds: [f64; 2],
    pairs: u32,
    coherent_s: f64,
    step_cycles: f64,
    /// Time between two searches for what is not tracked, seconds.
    pub search_interval_s: f64,
    /// Frequencies searched on either side; `None` where it is not known.
    pub doppler_max_hz: Option<f64>,
    /// Least C/N0 at which loops and message last.
    pub hold_dbhz: f64,
    /// Time between observations.
    pub interval_s: f64,
    /// Elevation below which it uses no satellite, degrees.
    pub mask_deg: f64,
    /// Whether fixes need the ionosphere's page, and else how long the first one waits for it.
    pub requires_ionosphere: bool,
    /// How long it waits for the ionosphere's parameters before a fix, seconds.
    pub ionosphere_wait_s: f64,
    /// Whether it uses satellites by their elements in short.
    pub reduced_elements: bool,
    /// What its front end takes from every signal.
    pub cost_db: f64,
}

impl Receiver {
    /// Of the receiver whose settings a run kept; what depends on the signal is of the truth's first one.
    pub fn of(run: &Run) -> Self {
        let signal = run.signals.first().copied();
        let settings = run.receiver.get("settings").unwrap_or(&run.receiver);
        Self { cost_db: front_end_cost_db(run), ..Self::new(settings, signal) }
    }

    /// The same for another signal.
    pub fn of_signal(&self, signal: &'static Signal) -> Self {
        Self { cost_db: self.cost_db, ..Self::new(&self.settings, Some(signal)) }
    }

    fn new(settings: &Value, signal: Option<&'static Signal>) -> Self {
        let value = |table: &str, key: &str| settings.get(table).and_then(|table| table.get(key));
        let number =
            |table: &str, key: &str, default: f64| value(table, key).and_then(Value::as_f64).unwrap_or(default);
        // Without a signal there is nothing to expect: any will do.
        let component = signal.and_then(leading).or_else(|| leading(SIGNALS[0]));
        let (period_s, chips) = component.map_or((1.0, 1.0), |c| (c.period_s(), f64::from(c.code_chips)));
        let coherent_s = period_s * number("acquisition", "coherent_periods", 2.0);
        let pairs = number("acquisition", "noncoherent_sums", 10.0).max(1.0) as u32;
        let step_cycles = number("acquisition", "doppler_step_cycles", 0.5);
        let doppler_max_hz = number("acquisition", "doppler_max_hz", 5000.0);
        let dopplers = 2.0 * doppler_max_hz * coherent_s / step_cycles + 1.0;
        let cells = CELLS_BETWEEN * chips * number("acquisition", "cells_per_chip", 2.0) * dopplers;
        let false_alarm = number("acquisition", "false_alarm_probability", 1e-6);
        let later = number("operation", "repeated_false_alarm_share", 0.01);
        let threshold = |search: f64| {
            let cell = -libm::expm1(libm::log1p(-search.clamp(1e-12, 0.5)) / cells);
            detection::threshold(cell, pairs)
        };
        let update_s = period_s * number("tracking", "integration", 4.0);
        let loop_dbhz = pll::cn0_dbhz(HOLDING_RAD, number("tracking", "pll_bandwidth_hz", 18.0), update_s);
        let broadcast = value("position", "ionosphere").and_then(Value::as_str).unwrap_or("none") != "none";
        let required = value("position", "require_ionosphere").and_then(Value::as_bool).unwrap_or(false);
        Self {
            settings: settings.clone(),
            thresholds: [false_alarm, false_alarm * later].map(threshold),
            pairs,
            coherent_s,
            step_cycles,
            search_interval_s: number("operation", "search_interval_s", 15.0),
            doppler_max_hz: value("acquisition", "doppler_max_hz").and_then(Value::as_f64),
            hold_dbhz: loop_dbhz.max(MESSAGE_DBHZ).max(number("tracking", "cn0_threshold_dbhz", 25.0)),
            interval_s: 1e-3 * number("operation", "measurement_interval_ms", 100.0),
            mask_deg: number("position", "mask_deg", 5.0),
            requires_ionosphere: broadcast && required,
            reduced_elements: value("position", "reduced_elements").and_then(Value::as_bool).unwrap_or(false),
            cost_db: 0.0,
            ionosphere_wait_s: if broadcast { number("position", "ionosphere_wait_s", 0.0) } else { 0.0 },
        }
    }

    #[cfg(test)]
    pub(super) fn for_tests(settings: &Value) -> Self {
        Self::new(settings, None)
    }

    /// Probability that one search misses a signal, in the worst place between its cells.
    pub fn miss(&self, effective_dbhz: f64, first: bool) -> f64 {
        let [at_first, later] = self.thresholds;
        let loss = CODE_LOSS * detection::frequency_loss(0.5 * self.step_cycles / self.coherent_s, self.coherent_s);
        let cn0_hz = libm::pow(10.0, 0.1 * effective_dbhz.min(60.0));
        let lambda = detection::noncentrality(self.pairs, self.coherent_s, cn0_hz, loss);
        1.0 - detection::detection(if first { at_first } else { later }, self.pairs, lambda).min(SUREST)
    }
}

/// What a converter of few bits takes from every signal (Van Vleck; optimal steps, white noise), in dB.
fn front_end_cost_db(run: &Run) -> f64 {
    let bits = run.scene.converter().map(|converter| converter.bits);
    match bits {
        Some(1) => 1.96,
        Some(2) => 0.55,
        Some(3) => 0.17,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;

    #[test]
    fn the_default_search_finds_38_dbhz_almost_surely_and_28_seldom() {
        let receiver = Receiver::new(&Value::Null, Some(&L1_CA));
        // The search says above 0.99 at 38 dB-Hz on average; here all losses are at their worst.
        assert!(receiver.miss(38.0, true) < 0.05 && receiver.miss(28.0, true) > 0.9, "{}", receiver.miss(38.0, true));
        assert!(receiver.miss(36.0, false) > receiver.miss(36.0, true), "later searches are stricter");
        assert_eq!(receiver.miss(50.0, true), 1.0 - SUREST);
    }

    #[test]
    fn settings_decide_what_is_held_and_what_a_first_fix_waits_for() {
        let of = |settings: Value| Receiver::new(&settings, Some(&L1_CA));
        let narrow = of(serde_json::json!({ "tracking": { "pll_bandwidth_hz": 18.0, "integration": 4 } }));
        let wide = of(serde_json::json!({ "tracking": { "pll_bandwidth_hz": 45.0, "integration": 1 } }));
        // σ² = B/(C/N0)·(1 + 1/(2T·C/N0)) of 10° at 18 Hz and 4 ms: 697 Hz.
        assert!((narrow.hold_dbhz - 28.43).abs() < 0.05, "{}", narrow.hold_dbhz);
        assert!(wide.hold_dbhz > narrow.hold_dbhz + 3.0);
        let waits = |position: Value| {
            let receiver = of(serde_json::json!({ "position": position }));
            (receiver.requires_ionosphere, receiver.ionosphere_wait_s)
        };
        assert_eq!(waits(serde_json::json!({ "ionosphere": "broadcast", "require_ionosphere": true })), (true, 0.0));
        assert_eq!(waits(serde_json::json!({ "ionosphere": "broadcast", "ionosphere_wait_s": 8.0 })), (false, 8.0));
        assert_eq!(waits(serde_json::json!({ "ionosphere": "none", "require_ionosphere": true })), (false, 0.0));
    }
}
