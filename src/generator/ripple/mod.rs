//! What changes too quickly for knots: the noise of the receiver's oscillator, scintillation.
//!
//! Such a thing is known at nodes on an absolute grid of samples, less than a millisecond apart, and is linear between
//! them; runs of the synthesiser end at nodes, so samples and truth follow the same line. Limits: a ripple of the clock
//! moves code and carrier by its own size, not the satellites (1 ns at 1 km/s is a micrometre).

pub mod markov;
pub mod oscillator;
pub mod scintillation;

use crate::generator::scene::Scene;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;
use crate::gnss::time::Rate;

/// Samples between nodes: the largest power of two within a millisecond.
pub fn node_samples(rate: Rate) -> u64 {
    1 << ((rate.hz() * 1e-3) as u64).max(64).ilog2()
}

/// What is added to a satellite's signal at one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    /// To the delay of the code.
    pub delay_s: f64,
    /// To the pseudorange of the carrier, in cycles at RF.
    pub carrier_cycles: f64,
    /// Factor of the amplitude.
    pub gain: f64,
}

impl Ripple {
    /// No ripple.
    pub const STILL: Self = Self { delay_s: 0.0, carrier_cycles: 0.0, gain: 1.0 };

    fn between(self, other: Self, u: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * u;
        Self {
            delay_s: mix(self.delay_s, other.delay_s),
            carrier_cycles: mix(self.carrier_cycles, other.carrier_cycles),
            gain: mix(self.gain, other.gain),
        }
    }
}

/// Whether anything in the scene ripples.
pub fn any(scene: &Scene) -> bool {
    scene.receiver_clock.oscillator.is_some() || scene.scintillation.is_some()
}

/// The ripple of a signal, which fades with satellite `fading`, at node number `node`.
fn at_node(scene: &Scene, fading: Option<Sv>, signal: &Signal, node: u64) -> Ripple {
    let mut ripple = Ripple::STILL;
    if let Some(oscillator) = &scene.receiver_clock.oscillator {
        let quick_s = oscillator.quick_s(node);
        ripple.delay_s += quick_s;
        ripple.carrier_cycles += signal.carrier_hz * quick_s;
    }
    let scintillation = scene.scintillation.as_ref().zip(fading);
    if let Some((gain, phase_rad)) = scintillation.and_then(|(scintillation, sv)| scintillation.at(sv, node)) {
        // A phase that runs ahead is a shorter path of the carrier.
        ripple.carrier_cycles -= phase_rad / std::f64::consts::TAU;
        ripple.gain *= gain;
    }
    ripple
}

/// The ripple of a signal, which fades with satellite `fading`, at a place between samples; before the first sample that of the first.
pub fn at(scene: &Scene, fading: Option<Sv>, signal: &Signal, sample: f64) -> Ripple {
    if !any(scene) {
        return Ripple::STILL;
    }
    let place = sample.max(0.0) / node_samples(scene.clock.rate) as f64;
    let node = place.floor();
    let (from, to) = (at_node(scene, fading, signal, node as u64), at_node(scene, fading, signal, node as u64 + 1));
    from.between(to, place - node)
}

/// The ripple of one signal over a stretch of samples.
#[derive(Clone, Debug, Default)]
pub struct Ripples {
    spacing: u64,
    first: u64,
    nodes: Vec<Ripple>,
}

impl Ripples {
    /// Gathers what samples `from..=to` need; nothing where nothing ripples.
    pub fn prepare(&mut self, scene: &Scene, fading: Option<Sv>, signal: &Signal, from: u64, to: u64) {
        if !any(scene) {
            return;
        }
        self.spacing = node_samples(scene.clock.rate);
        self.first = from / self.spacing;
        self.nodes.clear();
        self.nodes.extend((self.first..=to / self.spacing + 1).map(|node| at_node(scene, fading, signal, node)));
    }

    /// Longest run of samples that ends at nodes, if there are any.
    pub fn run_samples(&self) -> Option<u64> {
        (!self.nodes.is_empty()).then_some(self.spacing)
    }

    /// The ripple at the ends of a run between two nodes.
    pub fn ends(&self, from: u64, to: u64) -> [Ripple; 2] {
        let Some(spacing) = self.run_samples() else { return [Ripple::STILL; 2] };
        let node = from / spacing;
        let at = |node: u64| self.nodes.get((node - self.first) as usize).copied().unwrap_or(Ripple::STILL);
        let (left, right) = (at(node), at(node + 1));
        let fraction = |sample: u64| (sample - node * spacing) as f64 / spacing as f64;
        [left.between(right, fraction(from)), left.between(right, fraction(to))]
    }
}
