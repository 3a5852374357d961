//! Expectations from a receiver's settings: sensitivity and speed of its search, and the weakest signal it
//! holds.
//!
//! Search and loops are those of theory as `rx/receiver.json` states them for each signal. A receiver that
//! states none is taken to have the defaults of a common one. Losses of the search are its worst: half a cell
//! of code, half a step of Doppler, and signs that turn within its sums.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde_json::Value;

use crate::expect::followed::{Entry, efficiency};
use crate::expect::loops::Carrier;
use crate::expect::spectrum;
use crate::expect::theory::clock::PowerLaw;
use crate::expect::theory::detection;
use crate::read::Run;
use crate::waveform::leading;
use gnss::ionosphere::Model;
use gnss::signal::{Component, SIGNALS, Signal};

/// Jitter up to which a phase loop is expected to hold for good: 3σ leaves a third of the discriminator's 45°
/// to oscillator and motion.
const HOLDING_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Least C/N0 at which the message can be read: at 27 dB-Hz one bit in 4e6 is wrong (Eb/N0 of 10 dB).
const MESSAGE_DBHZ: f64 = 27.0;
/// Share of the power that the worst position between cells leaves: 1.5 dB of code, of cells half a chip
/// apart with others between them, at few samples a chip.
const CODE_LOSS: f64 = 0.7;
/// Positions of an edge within a sum that are looked at.
const EDGES: u32 = 8;
/// Factor of the number of independent cells with one cell between any two.
const CELLS_BETWEEN: f64 = 1.5;
/// Detection so sure that one search counts no more.
const SUREST: f64 = 1.0 - 1e-7;

/// The expectations that settings justify.
#[derive(Clone, Debug, PartialEq)]
pub struct Receiver {
    /// Content of `rx/receiver.json`.
    stated: Value,
    /// Noise of the scene's oscillator.
    oscillator: Option<PowerLaw>,
    /// Threshold of a cell's statistic, for the first search and for later ones.
    thresholds: [f64; 2],
    search: Search,
    step_cycles: f64,
    /// Time between two searches for what is not tracked, seconds.
    pub search_interval_s: f64,
    /// Frequencies searched on either side; `None` where it is not known.
    pub doppler_max_hz: Option<f64>,
    /// Least C/N0 at which loops and message last; infinite where the oscillator alone is too much for them.
    pub hold_dbhz: f64,
    /// Time between observations.
    pub interval_s: f64,
    /// Elevation below which it uses no satellite, degrees.
    pub mask_deg: f64,
    /// True if fixes need the ionosphere's page.
    pub requires_ionosphere: bool,
    /// Time that the first fix waits for the ionosphere's parameters, seconds.
    pub ionosphere_wait_s: f64,
    /// Correction of the ionosphere, in the word of its setting.
    ionosphere: String,
    /// True if the receiver uses satellites by their reduced elements.
    pub reduced_elements: bool,
    /// Loss of the signal in the front end by filter, converter and edges between samples, dB.
    pub cost_db: f64,
    costs_db: Arc<BTreeMap<&'static Signal, f64>>,
}

impl Receiver {
    /// Expectations on the receiver whose settings a run kept. Values that depend on the signal are those of
    /// the truth's first one.
    pub fn of(run: &Run) -> Self {
        let oscillator = run.scene.oscillator.map(|noise| PowerLaw { h: noise.h });
        let costs_db = front_end_costs_db(run);
        let first = run.signals.first().copied();
        Self::new(&run.receiver, oscillator, first).with(Arc::new(costs_db), first)
    }

    /// Expectations for another signal.
    pub fn of_signal(&self, signal: &'static Signal) -> Self {
        Self::new(&self.stated, self.oscillator, Some(signal)).with(Arc::clone(&self.costs_db), Some(signal))
    }

    fn with(self, costs_db: Arc<BTreeMap<&'static Signal, f64>>, signal: Option<&'static Signal>) -> Self {
        let cost_db = signal.and_then(|signal| costs_db.get(signal).copied()).unwrap_or(0.0);
        Self { cost_db, costs_db, ..self }
    }

    fn new(stated: &Value, oscillator: Option<PowerLaw>, signal: Option<&'static Signal>) -> Self {
        let settings = stated.get("settings").unwrap_or(stated);
        let value = |table: &str, key: &str| settings.get(table).and_then(|table| table.get(key));
        let number =
            |table: &str, key: &str, default: f64| value(table, key).and_then(Value::as_f64).unwrap_or(default);
        // Without a signal there is nothing to expect: any will do.
        let signal = signal.unwrap_or(SIGNALS[0]);
        let entry = Entry::of(stated, signal);
        let chips = leading(signal).map_or(1.0, |component| f64::from(component.code_chips));
        let search = Search::of(signal, entry.as_ref(), |key, default| number("acquisition", key, default));
        let (coherent_s, pairs) = (search.coherent_s, search.pairs());
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
        let carrier = Carrier::of(signal, entry.as_ref(), oscillator, |key, default| number("tracking", key, default));
        let ionosphere = value("position", "ionosphere").and_then(Value::as_str).unwrap_or("none");
        let broadcast = ionosphere != "none";
        let required = value("position", "require_ionosphere").and_then(Value::as_bool).unwrap_or(false);
        Self {
            stated: stated.clone(),
            oscillator,
            thresholds: [false_alarm, false_alarm * later].map(threshold),
            search,
            step_cycles,
            search_interval_s: number("operation", "search_interval_s", 15.0),
            doppler_max_hz: value("acquisition", "doppler_max_hz").and_then(Value::as_f64),
            hold_dbhz: carrier.least_dbhz(HOLDING_RAD).max(MESSAGE_DBHZ).max(number(
                "tracking",
                "cn0_threshold_dbhz",
                25.0,
            )),
            interval_s: 1e-3 * number("operation", "measurement_interval_ms", 100.0),
            mask_deg: number("position", "mask_deg", 5.0),
            requires_ionosphere: broadcast && required,
            reduced_elements: value("position", "reduced_elements").and_then(Value::as_bool).unwrap_or(false),
            cost_db: 0.0,
            costs_db: Arc::default(),
            ionosphere_wait_s: if broadcast { number("position", "ionosphere_wait_s", 0.0) } else { 0.0 },
            ionosphere: ionosphere.to_owned(),
        }
    }

    /// The model of the ionosphere whose coefficients it waits for, of those that `signals` bring: the one of
    /// its setting, or the first in the order in which a receiver that takes any prefers them.
    pub fn ionosphere_model(&self, signals: &BTreeSet<&'static Signal>) -> Option<Model> {
        let is_brought = |model: &Model| {
            let mut messages = signals.iter().flat_map(|signal| signal.components.iter().filter_map(|c| c.message));
            messages.any(|message| message.ionosphere.model == *model)
        };
        let mut klobuchar = Model::KLOBUCHAR.into_iter();
        match self.ionosphere.as_str() {
            "none" => None,
            "klobuchar" => klobuchar.find(is_brought),
            "nequick_g" => Some(Model::NequickG),
            "bdgim" => Some(Model::Bdgim),
            _ => klobuchar.chain([Model::NequickG, Model::Bdgim]).find(is_brought),
        }
    }

    #[cfg(test)]
    pub(super) fn for_tests(settings: &Value) -> Self {
        Self::new(settings, None, None)
    }

    /// Probability that one search misses a signal, in the worst position between its cells.
    pub fn miss(&self, effective_dbhz: f64, first: bool) -> f64 {
        let [at_first, later] = self.thresholds;
        let threshold = if first { at_first } else { later };
        let Search { coherent_s, sums, share, .. } = self.search;
        let loss = CODE_LOSS * share * detection::frequency_loss(0.5 * self.step_cycles / coherent_s, coherent_s);
        let lambda = detection::noncentrality(sums, coherent_s, libm::pow(10.0, 0.1 * effective_dbhz.min(60.0)), loss);
        let found = |left: f64| detection::detection(threshold, self.search.pairs(), lambda * left).min(SUREST);
        self.search.left().map(|(left, weight)| weight * (1.0 - found(left))).sum()
    }
}

/// The sums of a search, and what is sent of the signal within them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Search {
    coherent_s: f64,
    /// Number of coherent sums of each code.
    sums: u32,
    /// Number of codes.
    codes: u32,
    /// Power that the replicas find, over the signal's.
    share: f64,
    /// Share of the sums in which a sign turns.
    turning: f64,
    /// Share of the sums in which a sign may or may not turn.
    random: f64,
}

impl Search {
    fn of(signal: &'static Signal, entry: Option<&Entry>, number: impl Fn(&str, f64) -> f64) -> Self {
        let lead = leading(signal);
        let period_s = lead.map_or(1.0, Component::period_s);
        let Some(stated) = entry.and_then(|entry| entry.search.as_ref()) else {
            let coherent_s = period_s * number("coherent_periods", 2.0);
            let sums = number("noncoherent_sums", 10.0).max(1.0) as u32;
            // One that does not state it knows how long signs last: of ten sums one has an edge.
            return Self { coherent_s, sums, codes: 1, share: 1.0, turning: 0.05, random: 0.1 };
        };
        let components: Vec<&Component> =
            stated.components.iter().filter_map(|at| signal.components.get(*at)).collect();
        let turns = components.iter().map(|component| turns(signal, component, stated.coherent_s));
        let (turning, random) = turns.fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
        Self {
            coherent_s: stated.coherent_s,
            sums: stated.sums.max(1),
            codes: components.len().max(1) as u32,
            share: components.iter().map(|component| component.power_share * efficiency(component)).sum(),
            turning,
            random,
        }
    }

    /// Powers that are added.
    fn pairs(&self) -> u32 {
        self.sums * self.codes
    }

    /// Shares of the power that are left where signs turn within the sums, with their probabilities.
    ///
    /// A sum in which a sign turns after a share x of it keeps (1 − 2x)² of its power. Of one code every
    /// sum begins at the same position of a code period, which is as likely as any other. Sums of data and
    /// pilot begin at positions all over the period: mean and mean square of (1 − 2x)² are ⅓ and ⅕. What
    /// random signs add is binomial; three values with the weights ⅙, ⅔, ⅙ have its mean and variance, and
    /// five moments of the normal distribution near it.
    fn left(&self) -> impl Iterator<Item = (f64, f64)> {
        let places = if self.codes > 1 { 1 } else { EDGES };
        let moments = move |place: u32| {
            let kept = (1.0 - (f64::from(place) + 0.5) / f64::from(places)).powi(2);
            if places > 1 { (kept, kept * kept) } else { (1.0 / 3.0, 1.0 / 5.0) }
        };
        let (turning, random, sums) = (self.turning, self.random, f64::from(self.pairs()));
        (0..places).flat_map(move |place| {
            let (mean, square) = moments(place);
            let (middle, either) = (1.0 - turning * (1.0 - mean), 0.5 * (1.0 + mean));
            let variance = random * (0.5 * (1.0 + square) - either * either);
            let apart = (3.0 * variance / sums).sqrt();
            let weighed = [(-apart, 1.0 / 6.0), (0.0, 2.0 / 3.0), (apart, 1.0 / 6.0)];
            weighed.map(|(off, weight)| ((middle + off).clamp(0.0, 1.0), weight / f64::from(places)))
        })
    }
}

/// Share of the sums of so long in which the sign of a component turns on average, and of those at whose edge
/// it turns or not, as data do.
fn turns(signal: &'static Signal, component: &Component, coherent_s: f64) -> (f64, f64) {
    let periods = coherent_s / component.period_s();
    let data = component.message.filter(|_| component.secondary_code.periods() <= 1);
    match (data, component.periods_per_symbol()) {
        // Signs of a known code for each bit; the message with the most turns speaks for all.
        (Some(message), Some(1)) => {
            let of = |bit: &[i8]| {
                let count = bit.len().max(1) as f64;
                let inside = bit.windows(2).filter(|two| two[0] != two[1]).count() as f64;
                ((inside + 0.5) / count * periods, periods / count)
            };
            signal.satellites().map(|sv| of((message.bit)(sv))).fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
        }
        (Some(_), Some(symbol)) => (0.5 * periods / f64::from(symbol), periods / f64::from(symbol)),
        _ if component.secondary_code.periods() > 1 => (0.5 * periods, periods),
        _ => (0.0, 0.0),
    }
}

/// Losses of each signal in filter, converter and edges between samples, in dB. A truth that does not state
/// its noise has the loss of a converter of few bits (Van Vleck; optimal steps, white noise).
pub(crate) fn front_end_costs_db(run: &Run) -> BTreeMap<&'static Signal, f64> {
    let mut costs_db = spectrum::costs_db(run);
    for (signal, cost_db) in &mut costs_db {
        *cost_db += spectrum::edge_cost_db(run, signal);
        if run.scene.noise_lsb.is_none() {
            *cost_db += match run.scene.converter().map(|converter| converter.bits) {
                Some(1) => 1.96,
                Some(2) => 0.55,
                Some(3) => 0.17,
                _ => 0.0,
            };
        }
    }
    costs_db
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::beidou::in_phase::B1I;
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;

    #[test]
    fn the_default_search_finds_38_dbhz_almost_surely_and_28_seldom() {
        let receiver = Receiver::new(&Value::Null, None, Some(&L1_CA));
        // The search says above 0.99 at 38 dB-Hz on average; here all losses are at their worst.
        assert!(receiver.miss(38.0, true) < 0.05 && receiver.miss(28.0, true) > 0.9, "{}", receiver.miss(38.0, true));
        assert!(receiver.miss(36.0, false) > receiver.miss(36.0, true), "later searches are stricter");
        assert!(receiver.miss(50.0, true) < 1e-6, "{}", receiver.miss(50.0, true));
    }

    #[test]
    fn sums_are_those_that_the_receiver_states_and_lose_what_signs_take_that_turn_within() {
        let stated = |signal: &Signal, components: &[usize], coherent_s: f64, sums: u32| {
            let entry = serde_json::json!({
                "signal": signal.name, "component": components[0], "layer": 0, "spacing_chips": 0.25,
                "integration_s": 4e-3, "pll_bandwidth_hz": 18.0, "dll_bandwidth_hz": 0.5,
                "search": { "components": components, "coherent_s": coherent_s, "sums": sums },
            });
            serde_json::json!({ "settings": {}, "followed": [entry] })
        };
        let mean = |receiver: &Receiver| receiver.search.left().map(|(left, weight)| weight * left).sum::<f64>();
        // Data and pilot, each in a sum of one period: half of the edges turn, and leave a third.
        let e1 = Receiver::new(&stated(&E1, &[1, 0], 4e-3, 8), None, Some(&E1));
        assert_eq!((e1.search.pairs(), e1.search.turning), (16, 0.5));
        assert!((mean(&e1) - 2.0 / 3.0).abs() < 1e-12 && (e1.search.share - 10.0 / 11.0).abs() < 1e-9);
        // Eight of 4 ms are no 80 ms, which a count of periods in the settings would make: some of 36 dB-Hz
        // are missed, of 42 none.
        assert!((0.01..0.9).contains(&e1.miss(36.0, true)) && e1.miss(42.0, true) < 1e-6, "{}", e1.miss(36.0, true));
        // Of the Neuman-Hofman code of D1 ten of nineteen signs differ from the one before, and data turn the
        // last.
        let b1i = Receiver::new(&stated(&B1I, &[0], 1e-3, 20), None, Some(&B1I));
        assert!((b1i.search.turning - 10.5 / 20.0).abs() < 1e-12, "{}", b1i.search.turning);
        assert!((mean(&b1i) - (1.0 - 10.5 / 20.0 * 2.0 / 3.0)).abs() < 3e-3, "{}", mean(&b1i));
    }

    #[test]
    fn what_an_oscillator_leaves_is_no_longer_left_to_noise() {
        let settings = serde_json::json!({ "tracking": { "pll_bandwidth_hz": 18.0, "integration": 4 } });
        let of = |h0: f64| {
            let law = PowerLaw { h: [0.0, 0.0, h0, 0.0, 0.0] };
            Receiver::new(&settings, Some(law), Some(&L1_CA)).hold_dbhz
        };
        let quiet = Receiver::new(&settings, None, Some(&L1_CA)).hold_dbhz;
        // White frequency noise leaves 2π·f0·√(h0/(4√2·ω)) rad: 1.6° of h0 = 1e-21, and 22° of quartz.
        assert!(of(1e-21) > quiet && of(1e-21) < quiet + 0.3, "{} {quiet}", of(1e-21));
        assert!(of(2e-19).is_infinite());
    }

    #[test]
    fn settings_decide_what_is_held_and_what_a_first_fix_waits_for() {
        let of = |settings: Value| Receiver::new(&settings, None, Some(&L1_CA));
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

    #[test]
    fn it_waits_for_the_one_model_that_it_prefers_of_those_that_signals_bring() {
        let of = |word: &str, names: &[&str]| {
            let settings = serde_json::json!({ "position": { "ionosphere": word } });
            let signals = names.iter().map(|name| Signal::find(name).unwrap()).collect();
            Receiver::new(&settings, None, Some(&L1_CA)).ionosphere_model(&signals)
        };
        // BeiDou's coefficients come every 30 s and those of GPS every 12.5 min: with GPS received none of
        // BeiDou serve.
        let both = ["GPS L1 C/A", "BeiDou B1I"];
        assert_eq!(of("klobuchar", &both), Some(Model::Klobuchar));
        assert_eq!(of("combined", &both), Some(Model::Klobuchar));
        assert_eq!(of("broadcast", &["Galileo E1", "BeiDou B1I"]), Some(Model::KlobucharBeidou));
        assert_eq!(of("broadcast", &["Galileo E1", "BeiDou B1C"]), Some(Model::NequickG));
        assert_eq!(of("nequick_g", &["GPS L1 C/A", "Galileo E1"]), Some(Model::NequickG));
        assert_eq!(of("bdgim", &both), Some(Model::Bdgim));
        assert_eq!(of("none", &both), None);
    }
}
