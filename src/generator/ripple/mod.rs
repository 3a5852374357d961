//! What changes too quickly for knots: the noise of the receiver's oscillator, scintillation, faults of
//! satellites' clocks.
//!
//! Such a thing is known at nodes on an absolute grid of samples, less than a millisecond apart, and is
//! linear between them, but for a clock that steps at one; runs of the synthesiser end at nodes, so samples
//! and truth follow the same line. Limits: a ripple of the clock moves code and carrier by its own size, not
//! the satellites (1 ns at 1 km/s is a micrometre).

pub mod markov;
pub mod nodes;
pub mod oscillator;
pub mod satellite;
pub mod scintillation;

use nodes::Nodes;

use crate::generator::scene::Scene;
use crate::gnss::satellite::Sv;
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

/// Whether anything ripples in a signal that fades with satellite `fading`.
fn any(scene: &Scene, fading: Option<Sv>) -> bool {
    scene.receiver_clock.oscillator.is_some()
        || scene.scintillation.is_some()
        || fading.is_some_and(|sv| scene.satellite_clocks.of(sv).is_some())
}

/// The ripple of a signal on `carrier_hz`, which fades with satellite `fading`, at node number `node`.
fn at_node(scene: &Scene, fading: Option<Sv>, carrier_hz: f64, node: u64) -> Ripple {
    let mut ripple = Ripple::STILL;
    if let Some(oscillator) = &scene.receiver_clock.oscillator {
        let quick_s = oscillator.quick_s(node);
        ripple.delay_s += quick_s;
        ripple.carrier_cycles += carrier_hz * quick_s;
    }
    let scintillation = scene.scintillation.as_ref().zip(fading);
    if let Some((gain, phase_rad)) = scintillation.and_then(|(scintillation, sv)| scintillation.at(sv, node)) {
        // A phase that runs ahead is a shorter path of the carrier.
        ripple.carrier_cycles -= phase_rad / std::f64::consts::TAU;
        ripple.gain *= gain;
    }
    ripple
}

/// The ripple between node number `node` and the next: at its beginning and at its end.
fn cell(scene: &Scene, fading: Option<Sv>, carrier_hz: f64, node: u64, ends: [Ripple; 2]) -> [Ripple; 2] {
    let clock = fading.and_then(|sv| scene.satellite_clocks.of(sv));
    let Some(clock) = clock else { return ends };
    let [from_s, to_s] = clock.cell_s(scene, node);
    // A satellite's clock that is ahead makes its signal older.
    let older = |ripple: Ripple, offset_s: f64| Ripple {
        delay_s: ripple.delay_s - offset_s,
        carrier_cycles: ripple.carrier_cycles - carrier_hz * offset_s,
        gain: ripple.gain,
    };
    let [from, to] = ends;
    [older(from, from_s), older(to, to_s)]
}

/// The ripple of a signal on `carrier_hz`, which fades with satellite `fading`, at a place between samples;
/// before the first sample that of the first.
pub fn at(scene: &Scene, fading: Option<Sv>, carrier_hz: f64, sample: f64) -> Ripple {
    if !any(scene, fading) {
        return Ripple::STILL;
    }
    let place = scene.nodes.place(scene.clock.rate, sample);
    let node = place.floor();
    let ends = [node as u64, node as u64 + 1].map(|node| at_node(scene, fading, carrier_hz, node));
    let [from, to] = cell(scene, fading, carrier_hz, node as u64, ends);
    from.between(to, place - node)
}

/// The ripple of one signal over a stretch of samples.
#[derive(Clone, Debug, Default)]
pub struct Ripples {
    /// The grid of nodes, and the rate of the samples.
    grid: Option<(Nodes, Rate)>,
    /// Number of the first node.
    first: u64,
    /// Beginning and end of the stretch behind each node.
    cells: Vec<[Ripple; 2]>,
}

impl Ripples {
    /// Gathers what samples `from..=to` need; nothing where nothing ripples.
    pub fn prepare(&mut self, scene: &Scene, fading: Option<Sv>, carrier_hz: f64, from: u64, to: u64) {
        if !any(scene, fading) {
            return;
        }
        let (nodes, rate) = (scene.nodes, scene.clock.rate);
        self.grid = Some((nodes, rate));
        self.first = nodes.at(rate, from).0;
        self.cells.clear();
        let mut here = at_node(scene, fading, carrier_hz, self.first);
        for node in self.first..=nodes.at(rate, to).0 {
            let next = at_node(scene, fading, carrier_hz, node + 1);
            self.cells.push(cell(scene, fading, carrier_hz, node, [here, next]));
            here = next;
        }
    }

    /// Longest run of samples that ends at nodes, if there are any and they are samples.
    pub fn run_samples(&self) -> Option<u64> {
        self.grid.and_then(|(nodes, rate)| nodes.run_samples(rate))
    }

    /// The sample at which a run from `sample` on has to end, where nodes lie between samples.
    pub fn until(&self, sample: u64) -> Option<u64> {
        self.grid.and_then(|(nodes, rate)| nodes.until(rate, sample))
    }

    /// The ripple at the ends of a run between two nodes.
    pub fn ends(&self, from: u64, to: u64) -> [Ripple; 2] {
        let Some((nodes, rate)) = self.grid else { return [Ripple::STILL; 2] };
        let (node, share) = nodes.at(rate, from);
        let cell = self.cells.get((node - self.first) as usize).copied();
        let [left, right] = cell.unwrap_or([Ripple::STILL; 2]);
        // The end is the next node, or where nodes lie between samples less than a sample behind it.
        let (last, rest) = nodes.at(rate, to);
        [left.between(right, share), left.between(right, (last - node) as f64 + rest)]
    }
}
