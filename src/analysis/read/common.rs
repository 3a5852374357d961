//! Common errors of all satellites' signals in the samples besides the receiver's clock, from the truth.
//!
//! A front end's filter delays every code by its group delay. A local oscillator off its frequency shifts
//! every carrier. An antenna that turns winds up every carrier. A receiver that measures them is right: they
//! are part of the truth. The first two are facts of the scene. The third is the mean of the truth's carriers
//! less its pseudoranges. Limits: that mean holds twice the ionosphere's rate too, millimetres a second.

use std::collections::{BTreeMap, HashMap};

use serde_json::Value;

use super::delay;
use crate::waveform::{Edge, Sampler, Waveform};
use gnss::discriminator::CodeDiscriminator;
use gnss::facts::{FilterSpec, SceneFacts, filters, oscillator_offset_hz};
use gnss::record::Observation;
use gnss::signal::{Link, Signal};

/// Largest rate of a carrier less its pseudorange that the ionosphere may cause, metres a second.
const LEAST_WOUND_MPS: f64 = 0.02;

/// Distance of early and late where the receiver does not state it, chips.
const USUAL_SPACING_CHIPS: f64 = 0.5;

/// Edge rule of the receiver's replica, from its own settings. A receiver that does not state it has the
/// samples' own edges, but no filter.
pub(crate) fn replica_edge(receiver: &Value, samples: Edge) -> Edge {
    let settings = receiver.get("settings").unwrap_or(receiver);
    match (settings.pointer("/tracking/replica").and_then(Value::as_str), samples) {
        (Some("area"), _) | (None, Edge::Area) => Edge::Area,
        _ => Edge::Nearest,
    }
}

/// Distance of early and late with which a signal is followed.
fn spacing_chips(receiver: &Value, signal: &Signal) -> f64 {
    let is_own = |one: &&Value| one.get("signal").and_then(Value::as_str) == Some(signal.name);
    let followed = receiver.get("followed").and_then(Value::as_array);
    let own = followed.and_then(|all| all.iter().find(is_own)?.get("spacing_chips"));
    let settings = receiver.get("settings").unwrap_or(receiver);
    own.or_else(|| settings.pointer("/tracking/spacing_chips")).and_then(Value::as_f64).unwrap_or(USUAL_SPACING_CHIPS)
}

/// Discriminator of the code loops; the usual one where a receiver names none that is known.
fn discriminator(receiver: &Value) -> CodeDiscriminator {
    let settings = receiver.get("settings").unwrap_or(receiver);
    let named = settings.pointer("/tracking/dll_discriminator").and_then(Value::as_str);
    named.and_then(CodeDiscriminator::named).unwrap_or(CodeDiscriminator::EarlyMinusLate)
}

/// The common part.
#[derive(Clone, Debug, Default)]
pub struct Common {
    /// Delay of every code in the front end, by its signal, and of how many satellites.
    code_delays_s: BTreeMap<&'static Signal, f64>,
    satellites: BTreeMap<&'static Signal, usize>,
    /// Common offset of every Doppler, in hertz.
    pub doppler_hz: f64,
    last: HashMap<Link, (u64, f64)>,
    /// Sample of each epoch in their order, with sum and number of what each satellite's carrier gained on
    /// its pseudorange since the epoch before, in metres a sample.
    gains: Vec<(u64, f64, u32)>,
    rate_hz: f64,
}

impl Common {
    /// Common errors before any row of the truth.
    pub(super) fn new(rate_hz: f64) -> Self {
        Self { rate_hz, ..Self::default() }
    }

    /// Takes what a scene's facts say, for the rows counted so far and what `receiver.json` says of code
    /// loops; `received` gives the front end in which a signal is received, by its index.
    pub(super) fn set_front_end(&mut self, scene: &SceneFacts, receiver: &Value, received: &dyn Fn(&Signal) -> usize) {
        let offset_hz = oscillator_offset_hz(&scene.front_end);
        self.doppler_hz = if scene.inverted { -offset_hz } else { offset_hz };
        self.satellites.clear();
        for link in self.last.keys() {
            *self.satellites.entry(link.signal).or_default() += 1;
        }
        let delay_s = |signal: &&'static Signal| {
            let code = Waveform::sent(signal, scene.waveform)?;
            let (stages, rate_hz) = scene.stages(received(signal));
            let samples = Sampler::of(scene, received(signal));
            let replica = Sampler::new(replica_edge(receiver, samples.edge()), rate_hz);
            let taps = (discriminator(receiver), spacing_chips(receiver, signal));
            let of = |filter: &FilterSpec| delay::code_delay_s(filter, &code, [&samples, &replica], taps);
            Some((*signal, filters(stages).map(of).sum()))
        };
        self.code_delays_s = self.satellites.keys().filter_map(delay_s).collect();
    }

    /// Delay of a signal's code in the front end.
    pub fn code_delay_s(&self, signal: &Signal) -> f64 {
        self.code_delays_s.get(signal).copied().unwrap_or(0.0)
    }

    /// Mean delay of all codes in seconds, which a clock solved from them has.
    pub fn clock_delay_s(&self) -> f64 {
        self.mean_delay_s(|_| true)
    }

    /// Mean delay of the codes of one time scale, and the largest difference of one of them from it, seconds.
    pub fn scale_delay_s(&self, scale: &str) -> (f64, f64) {
        let is_own = |signal: &Signal| signal.time.name == scale;
        let mean_s = self.mean_delay_s(is_own);
        let own = self.code_delays_s.iter().filter(|(signal, _)| is_own(signal));
        (mean_s, own.map(|(_, delay_s)| (delay_s - mean_s).abs()).fold(0.0, f64::max))
    }

    fn mean_delay_s(&self, counts: impl Fn(&Signal) -> bool) -> f64 {
        let mut delays_s = self.code_delays_s.iter().filter(|(signal, _)| counts(signal)).map(|(_, delay_s)| *delay_s);
        let first_s = delays_s.next().unwrap_or(0.0);
        if delays_s.all(|delay_s| delay_s == first_s) {
            return first_s;
        }
        let own = || self.satellites.iter().filter(|(signal, _)| counts(signal));
        let count: usize = own().map(|(_, count)| count).sum();
        own().map(|(signal, count)| self.code_delay_s(signal) * *count as f64).sum::<f64>() / count.max(1) as f64
    }

    /// Counts a row of the truth in.
    pub(super) fn add(&mut self, row: &Observation) {
        let apart_m = row.carrier_cycles * row.signal.wavelength_m(row.sv) - row.pseudorange_m;
        let before = self.last.insert(row.link(), (row.sample, apart_m));
        if let Some((sample, before_m)) = before.filter(|(sample, _)| row.sample > *sample) {
            let place = match self.gains.last() {
                Some((last, ..)) if *last < row.sample => Err(self.gains.len()),
                _ => self.place(row.sample),
            };
            let place = place.unwrap_or_else(|place| {
                self.gains.insert(place, (row.sample, 0.0, 0));
                place
            });
            if let Some((_, sum, count)) = self.gains.get_mut(place) {
                (*sum, *count) = (*sum + (apart_m - before_m) / (row.sample - sample) as f64, *count + 1);
            }
        }
    }

    /// Index of a sample's epoch among the gains, or the index at which it would be inserted.
    fn place(&self, sample: u64) -> Result<usize, usize> {
        self.gains.binary_search_by_key(&sample, |gain| gain.0)
    }

    /// Carrier that an oscillator's offset takes from every satellite until a sample, in cycles (carriers
    /// grow with range).
    pub fn carrier_cycles(&self, sample: u64) -> f64 {
        -self.doppler_hz * sample as f64 / self.rate_hz
    }

    /// Rate at which carriers gain on pseudoranges at a sample, wind-up and oscillator together: metres a
    /// second that a clock solved from Dopplers drifts more than the clock does.
    pub fn drift_mps(&self, sample: u64, wavelength_m: f64) -> f64 {
        let gain = self.place(sample).ok().and_then(|place| self.gains.get(place));
        let both = gain.map_or(0.0, |(_, sum, count)| sum / f64::from(*count) * self.rate_hz);
        both - self.doppler_hz * wavelength_m
    }

    /// The part of it that an antenna's turning makes: a millimetre a second and less is the ionosphere's.
    pub fn wound_mps(&self, sample: u64, wavelength_m: f64) -> f64 {
        let wound = self.drift_mps(sample, wavelength_m) + self.doppler_hz * wavelength_m;
        if wound.abs() > LEAST_WOUND_MPS { wound } else { 0.0 }
    }
}
