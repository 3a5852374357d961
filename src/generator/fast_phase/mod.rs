//! Phases that change too quickly for knots: noise of the receiver's oscillator, scintillation, and faults of
//! satellite clocks.
//!
//! Such a thing is known at nodes on an absolute grid of samples, less than a millisecond apart, and is
//! linear between them, but for a clock that steps at one; runs of the synthesiser end at nodes, so samples
//! and truth follow the same line. Limits: fast noise of the clock moves code and carrier by its own size,
//! not the satellites (1 ns at 1 km/s is a micrometre).

pub mod satellite;
pub mod scintillation;

use satellite::SatelliteClocks;
use scintillation::Scintillation;

use crate::clock::ReceiverClock;
use crate::clock::nodes::Nodes;
use gnss::satellite::Sv;
use gnss::time::{Rate, SampleClock};

/// Phase and amplitude that are added to a satellite's signal at one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FastPhase {
    /// Additional delay of the code, in seconds.
    pub delay_s: f64,
    /// Additional pseudorange of the carrier, in cycles at RF.
    pub carrier_cycles: f64,
    /// Factor of the amplitude.
    pub gain: f64,
}

impl FastPhase {
    /// No addition: zero delay and phase, unit gain.
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

/// Sources that change the phases of a scene's signals quickly.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// Nodes at which the phases are computed.
    pub nodes: Nodes,
    /// Sample numbers as times of the receiver's clock.
    pub clock: SampleClock,
    /// Receiver's clock, whose oscillator may be noisy.
    pub receiver_clock: &'a ReceiverClock,
    /// Scintillation of satellites.
    pub scintillation: Option<&'a Scintillation>,
    /// Faults of satellites' clocks.
    pub satellite_clocks: &'a SatelliteClocks,
}

impl Sources<'_> {
    /// True if any source changes a signal that fades with satellite `fading`.
    fn any(&self, fading: Option<Sv>) -> bool {
        self.receiver_clock.oscillator.is_some()
            || self.scintillation.is_some()
            || fading.is_some_and(|sv| self.satellite_clocks.of(sv).is_some())
    }

    /// The fast phase of a signal on `carrier_hz`, which fades with satellite `fading`, at node number
    /// `node`.
    fn at_node(&self, fading: Option<Sv>, carrier_hz: f64, node: u64) -> FastPhase {
        let mut found = FastPhase::STILL;
        if let Some(oscillator) = &self.receiver_clock.oscillator {
            let quick_s = oscillator.quick_s(node);
            found.delay_s += quick_s;
            found.carrier_cycles += carrier_hz * quick_s;
        }
        let scintillation = self.scintillation.zip(fading);
        if let Some((gain, phase_rad)) =
            scintillation.and_then(|(scintillation, sv)| scintillation.at(sv, carrier_hz, node))
        {
            // A phase that runs ahead is a shorter path of the carrier.
            found.carrier_cycles -= phase_rad / std::f64::consts::TAU;
            found.gain *= gain;
        }
        found
    }

    /// The fast phase between node number `node` and the next: at its beginning and at its end, of which
    /// `ends` lacks what the satellite's clock does.
    fn cell(&self, fading: Option<Sv>, carrier_hz: f64, node: u64, ends: [FastPhase; 2]) -> [FastPhase; 2] {
        let clock = fading.and_then(|sv| self.satellite_clocks.of(sv));
        let Some(clock) = clock else { return ends };
        let [from_s, to_s] = clock.cell_s(self, node);
        // A satellite's clock that is ahead makes its signal older.
        let older = |end: FastPhase, offset_s: f64| FastPhase {
            delay_s: end.delay_s - offset_s,
            carrier_cycles: end.carrier_cycles - carrier_hz * offset_s,
            gain: end.gain,
        };
        let [from, to] = ends;
        [older(from, from_s), older(to, to_s)]
    }

    /// The fast phase of a signal on `carrier_hz`, which fades with satellite `fading`, at a position between
    /// samples; before the first sample that of the first.
    pub fn at(&self, fading: Option<Sv>, carrier_hz: f64, sample: f64) -> FastPhase {
        if !self.any(fading) {
            return FastPhase::STILL;
        }
        let place = self.nodes.place(self.clock.rate, sample);
        let node = place.floor();
        let ends = [node as u64, node as u64 + 1].map(|node| self.at_node(fading, carrier_hz, node));
        let [from, to] = self.cell(fading, carrier_hz, node as u64, ends);
        from.between(to, place - node)
    }
}

/// The fast phase of one signal over a segment of samples.
#[derive(Clone, Debug, Default)]
pub struct FastPhases {
    /// The grid of nodes, and the rate of the samples.
    grid: Option<(Nodes, Rate)>,
    /// Number of the first node.
    first: u64,
    /// Beginning and end of the segment behind each node.
    cells: Vec<[FastPhase; 2]>,
}

impl FastPhases {
    /// Prepares the data for samples `from..=to`; nothing if no source changes the signal.
    pub fn prepare(&mut self, sources: Sources<'_>, fading: Option<Sv>, carrier_hz: f64, from: u64, to: u64) {
        if !sources.any(fading) {
            return;
        }
        let (nodes, rate) = (sources.nodes, sources.clock.rate);
        self.grid = Some((nodes, rate));
        self.first = nodes.at(rate, from).0;
        self.cells.clear();
        let mut here = sources.at_node(fading, carrier_hz, self.first);
        for node in self.first..=nodes.at(rate, to).0 {
            let next = sources.at_node(fading, carrier_hz, node + 1);
            self.cells.push(sources.cell(fading, carrier_hz, node, [here, next]));
            here = next;
        }
    }

    /// True if there is any.
    pub fn is_there(&self) -> bool {
        self.grid.is_some()
    }

    /// Longest run of samples that ends at nodes, if there are any and they are samples.
    pub fn run_samples(&self) -> Option<u64> {
        self.grid.and_then(|(nodes, rate)| nodes.run_samples(rate))
    }

    /// Sample at which a run from `sample` on has to end, if nodes lie between samples.
    pub fn until(&self, sample: u64) -> Option<u64> {
        self.grid.and_then(|(nodes, rate)| nodes.until(rate, sample))
    }

    /// Fast phase at the ends of a run between two nodes.
    pub fn ends(&self, from: u64, to: u64) -> [FastPhase; 2] {
        let Some((nodes, rate)) = self.grid else { return [FastPhase::STILL; 2] };
        let (node, share) = nodes.at(rate, from);
        let cell = node.checked_sub(self.first).and_then(|place| self.cells.get(place as usize)).copied();
        let [left, right] = cell.unwrap_or([FastPhase::STILL; 2]);
        // The end is the next node, or where nodes lie between samples less than a sample behind it.
        let (last, rest) = nodes.at(rate, to);
        [left.between(right, share), left.between(right, (last - node) as f64 + rest)]
    }
}
