//! A component of one satellite as kernels read it: sequences of ±1, each with an amplitude and a phase.
//!
//! Every layer is expanded into the steps of its own pulse, so a kernel knows neither BPSK nor BOC. Where a
//! layer has chips of zero it becomes the mean of two sequences, which differ there and are equal elsewhere:
//! their sum is exact and kernels read one sign a step. The mean power of the whole follows from the code's
//! own correlation on the steps that all layers share. Limits: that correlation is cyclic, as if neither data
//! nor secondary code changed from one period to the next, which concerns as many steps of a period as an
//! edge reaches.

use std::f64::consts::TAU;
use std::sync::Arc;

use thiserror::Error;

use super::Edge;
use super::band::Filter;
use super::chips::{MAX_STEP, Pace, Spreading, packed, window};
use super::pulse::Pulse;
use super::responses::edge_vectors;
use gnss::satellite::Sv;
use gnss::signal::{Component, Layer, Layers, Link, Signal, least_common_multiple};

/// A sequence with its part in the component.
#[derive(Clone, Debug)]
pub struct Voice {
    /// Signs of the sequence over a code period.
    pub spreading: Spreading,
    /// Factor of the component's amplitude.
    pub amplitude: f64,
    /// Carrier phase relative to the component's, in cycles.
    pub phase_cycles: f64,
    /// Pulse for the steps of a sequence that are not levels of ±1: chips behind a filter.
    pub pulse: Option<Arc<Pulse>>,
}

/// One period of a sequence of a component's layers.
struct Sequence {
    /// −1, 0 or +1.
    steps: Vec<i8>,
    steps_hz: f64,
    weight: f64,
    phase_cycles: f64,
    pulse: Option<Arc<Pulse>>,
}

/// Amplitude of a layer in its component.
fn weight(layer: &Layer) -> f64 {
    planted!("generator.synth.layers", 1.0, if layer.pulse.len() > 2 { 0.8 } else { 1.0 }) * layer.weight
}

/// Operations on eight doubles in a block of the response to a chip, and in a vector of that to an edge.
const BLOCK_COST: f64 = 12.0;
const EDGE_COST: f64 = 8.0;

/// Operations that the edges of a layer take in a chip; between chips every second one is an edge.
fn edges_cost(layer: &Layer, chips_a_sample: f64) -> f64 {
    let within = layer.pulse.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // A layer with zeros is two sequences.
    let sequences = if layer.pulse.contains(&0) { 2.0 } else { 1.0 };
    let vectors = edge_vectors(chips_a_sample * layer.pulse.len() as f64);
    sequences * EDGE_COST * vectors * (within as f64 + 0.5)
}

/// A component's code and pulses for one satellite.
#[derive(Clone, Debug)]
pub struct Waveform {
    link: Link,
    /// Position of the component in its signal.
    index: usize,
    component: &'static Component,
    chips: Vec<i8>,
    secondary_code: Arc<[bool]>,
}

/// Reason for which a component cannot be rendered.
#[derive(Debug, Error, PartialEq)]
pub enum WaveformError {
    /// A rate at which a sample would span more than 15 steps of a sequence.
    #[error(
        "{signal}, component {component}, layer {layer}: {steps_hz} steps a second at {rate_hz} samples a second: \
         expected at least {least_hz} samples a second"
    )]
    Rate {
        /// The signal.
        signal: &'static str,
        /// Number of the component, from 0.
        component: usize,
        /// Number of the layer, from 0.
        layer: usize,
        /// Steps per second.
        steps_hz: f64,
        /// The sample rate, in Hz.
        rate_hz: f64,
        /// The least rate that would do, in Hz.
        least_hz: f64,
    },
    /// A table that is no code.
    #[error("{signal}, component {component}, {what} of {sv}: {found}: expected {expected}")]
    Code {
        /// The signal.
        signal: &'static str,
        /// Number of the component, from 0.
        component: usize,
        /// The satellite.
        sv: Sv,
        /// Name of the table.
        what: &'static str,
        /// Value that was found.
        found: String,
        /// Values that are expected.
        expected: String,
    },
}

impl Waveform {
    /// Component number `index` of a satellite's signal; `None` if the signal's documents assign it no code.
    ///
    /// # Errors
    /// [`WaveformError::Code`] for a code, secondary code or pulse that is none.
    pub fn new(link: Link, index: usize) -> Result<Option<Self>, WaveformError> {
        let Some(component) = link.signal.components.get(index) else { return Ok(None) };
        let codes = (component.code)(link.sv.number).zip(component.secondary_code.of(link.sv.number));
        let Some((chips, secondary_code)) = codes else { return Ok(None) };
        let negative: Vec<bool> = secondary_code.iter().map(|&chip| chip < 0).collect();
        let has_secondary_code = negative.contains(&true);
        let secondary_code_chips = secondary_code.len();
        let inverts = if has_secondary_code { negative.into() } else { Arc::default() };
        let waveform = Self { link, index, component, chips, secondary_code: inverts };
        let refuse = |what, found, expected: &str| Err(waveform.refuse(what, found, expected));
        let (length, periods) = (component.code_chips as usize, component.secondary_code.periods() as usize);
        if waveform.chips.len() != length || waveform.chips.iter().all(|&chip| chip == 0) {
            return refuse("code", format!("{} chips", waveform.chips.len()), &format!("{length}, not all zero"));
        }
        if let Some(chip) = waveform.chips.iter().find(|chip| !(-1..=1).contains(*chip)) {
            return refuse("code", format!("a chip of {chip}"), "-1, 0 or 1");
        }
        if secondary_code_chips != periods || periods == 0 {
            return refuse(
                "secondary code",
                format!("{secondary_code_chips} chips"),
                &format!("{periods}, at least one"),
            );
        }
        if let Some(chip) = secondary_code.iter().find(|chip| chip.abs() != 1) {
            return refuse("secondary code", format!("a chip of {chip}"), "-1 or 1");
        }
        let pulses = || component.layers.iter().map(|layer| layer.pulse);
        let is_none = |pulse: &[i8]| pulse.iter().all(|&step| step == 0);
        if component.layers.is_empty() || pulses().any(is_none) {
            return refuse("pulse", "nothing".to_owned(), "a step of -1 or 1 in every layer");
        }
        if let Some(step) = pulses().flatten().find(|step| !(-1..=1).contains(*step)) {
            return refuse("pulse", format!("a step of {step}"), "-1, 0 or 1");
        }
        Ok(Some(waveform))
    }

    fn refuse(&self, what: &'static str, found: String, expected: &str) -> WaveformError {
        let (signal, component, sv) = (self.link.signal.name, self.index + 1, self.link.sv);
        WaveformError::Code { signal, component, sv, what, found, expected: expected.to_owned() }
    }

    /// The sequences of some of its layers for samples at `rate_hz`, as they are in the whole waveform when
    /// that has a mean power of one as sent. What `edge` takes of it ([`Waveform::kept`]) is lost.
    ///
    /// # Errors
    /// [`WaveformError`] for more than 15 steps per sample, and for a code whose periods cannot be counted.
    pub fn voices(&self, layers: Layers, edge: Edge<'_>, rate_hz: f64) -> Result<Vec<Voice>, WaveformError> {
        let layers = self.component.made_with(layers);
        let steps_hz = |layer: &Layer| self.component.chip_rate_hz * layer.pulse.len() as f64;
        for (number, steps_hz) in (1..).zip(layers.iter().map(steps_hz)) {
            if steps_hz > MAX_STEP * rate_hz {
                let (signal, component, least_hz) = (self.link.signal.name, self.index + 1, steps_hz / MAX_STEP);
                return Err(WaveformError::Rate { signal, component, layer: number, steps_hz, rate_hz, least_hz });
            }
        }
        let sent = self.power(Edge::Nearest, rate_hz);
        let gain = 1.0 / planted!("generator.synth.edge_share", sent, self.power(edge, rate_hz)).sqrt();
        let made = match edge {
            Edge::BandLimited(filter) => self.filtered(layers, filter, rate_hz),
            Edge::Nearest | Edge::Area => self.sequences(layers),
        };
        let mut voices = Vec::new();
        for Sequence { steps, steps_hz, weight, phase_cycles, pulse } in made {
            let pace = Pace::new(steps.len(), steps_hz, self.link.signal.time).ok_or_else(|| {
                let found = format!("{} steps at {steps_hz} Hz", steps.len());
                self.refuse("code", found, "a rate of whole thousandths of a hertz, whose periods fill whole seconds")
            })?;
            let negative: Vec<bool> = steps.iter().map(|&step| step < 0).collect();
            let voice = |negative: &[bool], share: f64| Voice {
                spreading: Spreading::new(negative, pace, Arc::clone(&self.secondary_code)),
                amplitude: gain * weight * share,
                phase_cycles,
                pulse: pulse.clone(),
            };
            if steps.contains(&0) {
                let other: Vec<bool> = steps.iter().map(|&step| step <= 0).collect();
                voices.extend([voice(&negative, 0.5), voice(&other, 0.5)]);
            } else {
                voices.push(voice(&negative, 1.0));
            }
        }
        Ok(voices)
    }

    /// Layers as sequences of their steps: one for all that take turns, else one each.
    fn sequences(&self, layers: &[Layer]) -> Vec<Sequence> {
        let of = |(steps, steps_hz): (Vec<i8>, f64), layer: &Layer| Sequence {
            steps,
            steps_hz,
            weight: weight(layer),
            phase_cycles: layer.phase_cycles,
            pulse: None,
        };
        if let Some((turns, first)) = self.in_turn(layers).zip(layers.first()) {
            return vec![of(turns, first)];
        }
        let rate = |layer: &Layer| self.component.chip_rate_hz * layer.pulse.len() as f64;
        layers.iter().map(|layer| of((self.steps(layer, layer.pulse.len()), rate(layer)), layer)).collect()
    }

    /// Layers behind a filter. Layers of one phase are one sequence of chips with a pulse where the response
    /// to a chip costs less than those to its edges.
    fn filtered(&self, layers: &[Layer], filter: &Filter, rate_hz: f64) -> Vec<Sequence> {
        if self.chips.contains(&0) || layers.iter().any(|layer| !layer.chips.is_empty()) {
            return self.sequences(layers);
        }
        let chips_a_sample = self.component.chip_rate_hz / rate_hz;
        // A layer that is half a turn apart is one with the other sign.
        let sign = |layer: &Layer, first: &Layer| match (layer.phase_cycles - first.phase_cycles).rem_euclid(1.0) {
            0.0 => Some(1.0),
            0.5 => Some(-1.0),
            _ => None,
        };
        let in_phase = |a: &Layer, b: &Layer| sign(a, b).is_some();
        let mut made = Vec::new();
        for layers in layers.chunk_by(in_phase) {
            let edges_cost: f64 = layers.iter().map(|layer| edges_cost(layer, chips_a_sample)).sum();
            let cost = Pulse::blocks(chips_a_sample).map(|blocks| BLOCK_COST * blocks as f64);
            let levels = || {
                let count = layers.iter().map(|layer| layer.pulse.len()).fold(1, least_common_multiple);
                let level = |layer: &Layer, step: usize| {
                    let sign = layers.first().and_then(|first| sign(layer, first)).unwrap_or(0.0);
                    let step = layer.pulse.get(step * layer.pulse.len() / count).copied().unwrap_or(0);
                    sign * weight(layer) * f64::from(step)
                };
                (0..count).map(|step| layers.iter().map(|layer| level(layer, step)).sum()).collect::<Vec<f64>>()
            };
            let pulse = cost.filter(|cost| *cost < edges_cost).and_then(|_| filter.pulse(&levels(), chips_a_sample));
            match (pulse, layers) {
                (Some(pulse), [first, ..]) => made.push(Sequence {
                    steps: self.chips.clone(),
                    steps_hz: self.component.chip_rate_hz,
                    weight: 1.0,
                    phase_cycles: first.phase_cycles,
                    pulse: Some(pulse),
                }),
                _ => made.extend(self.sequences(layers)),
            }
        }
        made
    }

    /// Layers that take turns, chip by chip, as the one sequence that they are, with its rate of steps.
    fn in_turn(&self, layers: &[Layer]) -> Option<(Vec<i8>, f64)> {
        let [first, others @ ..] = layers else { return None };
        let alike = |layer: &Layer| layer.weight == first.weight && layer.phase_cycles == first.phase_cycles;
        let per_chip = layers.iter().map(|layer| layer.pulse.len()).max()?;
        let fits = |layer: &Layer| alike(layer) && per_chip.is_multiple_of(layer.pulse.len());
        let has_one = |chip: usize| layers.iter().filter(|layer| layer.covers(chip)).count() == 1;
        if others.is_empty() || !others.iter().all(fits) || !(0..self.chips.len()).all(has_one) {
            return None;
        }
        let mut steps = self.steps(first, per_chip);
        for layer in others {
            steps.iter_mut().zip(self.steps(layer, per_chip)).for_each(|(step, other)| *step += other);
        }
        (!steps.contains(&0)).then_some((steps, self.component.chip_rate_hz * per_chip as f64))
    }

    /// Mean power behind `edge`, all layers together.
    pub fn power(&self, edge: Edge<'_>, rate_hz: f64) -> f64 {
        let step = self.component.chip_rate_hz * self.component.steps_per_chip() as f64 / rate_hz;
        edge.power(&self.correlation(edge.lags(step)), step)
    }

    /// Share of its power as sent that samples have behind `edge`: all with edges at the nearest sample,
    /// 1 − d/3 of a random code of d ≤ 1 steps a sample with means, with band-limited ones what lies below
    /// the filter's cut-off.
    pub fn kept(&self, edge: Edge<'_>, rate_hz: f64) -> f64 {
        self.power(edge, rate_hz) / self.power(Edge::Nearest, rate_hz)
    }

    /// Cyclic correlation of the waveform with itself at its first `lags` lags of whole steps that all layers
    /// share.
    fn correlation(&self, lags: usize) -> Vec<f64> {
        let layers = self.component.layers;
        let signs: Vec<Ternary> = (layers.iter())
            .map(|layer| Ternary::new(&self.steps(layer, self.component.steps_per_chip()), lags))
            .collect();
        let mut sums = vec![0.0; lags];
        for (a, one) in layers.iter().zip(&signs) {
            for (b, other) in layers.iter().zip(&signs) {
                let weight = a.weight * b.weight * libm::cos(TAU * (a.phase_cycles - b.phase_cycles));
                (0..lags).zip(&mut sums).for_each(|(lag, sum)| *sum += weight * one.correlation(other, lag));
            }
        }
        sums
    }

    /// One period of a layer, `per_chip` steps to each chip.
    fn steps(&self, layer: &Layer, per_chip: usize) -> Vec<i8> {
        let each = per_chip / layer.pulse.len().max(1);
        let mut steps = Vec::with_capacity(self.chips.len() * per_chip);
        for (index, &chip) in self.chips.iter().enumerate() {
            let chip = if layer.covers(index) { chip } else { 0 };
            for &step in layer.pulse {
                steps.extend(std::iter::repeat_n(chip * step, each));
            }
        }
        steps
    }
}

/// The one sequence of a satellite's signal, if that is all that it has: one layer without zeros.
pub fn plain(signal: &'static Signal, number: u8) -> Option<Spreading> {
    let [_] = signal.components else { return None };
    let waveform = Waveform::new(signal.link(Sv { system: signal.system, number }), 0).ok().flatten()?;
    let mut voices = waveform.voices(Layers::Whole, Edge::Nearest, f64::INFINITY).ok()?;
    voices.pop().filter(|_| voices.is_empty()).map(|voice| voice.spreading)
}

/// A sequence of −1, 0 and +1 as two of bits: which are negative, and which are not zero.
struct Ternary {
    length: usize,
    negative: Vec<u64>,
    sent: Vec<u64>,
}

impl Ternary {
    /// `steps`, continued cyclically so that they can be read from the first `lags` on.
    fn new(steps: &[i8], lags: usize) -> Self {
        let length = steps.len() + lags + 128;
        let negative: Vec<bool> = steps.iter().map(|&step| step < 0).collect();
        let sent: Vec<bool> = steps.iter().map(|&step| step != 0).collect();
        Self { length: steps.len(), negative: packed(&negative, length), sent: packed(&sent, length) }
    }

    /// Mean product of each step with that of `other` which is `lag` steps later.
    fn correlation(&self, other: &Self, lag: usize) -> f64 {
        let (mut both, mut differ) = (0_u64, 0_u64);
        for from in (0..self.length).step_by(64) {
            let left = self.length - from;
            let valid = if left < 64 { !(u64::MAX >> left) } else { u64::MAX };
            let sent = window(&self.sent, from) & window(&other.sent, from + lag) & valid;
            let unlike = window(&self.negative, from) ^ window(&other.negative, from + lag);
            both += u64::from(sent.count_ones());
            differ += u64::from((sent & unlike).count_ones());
        }
        let length = self.length as f64;
        both as f64 / length - 2.0 * differ as f64 / length
    }
}
