//! Satellites' clocks as they depart from what they broadcast: steps, ramps and the oscillator's noise.
//!
//! A departure reaches the antenna as a change of code and carrier alike. Steps and ramps begin and end at
//! nodes, up to a millisecond after the time that the scene gives, which is that of arrival; a step takes no
//! time. Limits: the noise is drawn over the received samples, whose time runs a millionth faster or slower
//! than the satellite's.

use std::collections::BTreeMap;

use crate::generator::ripple::oscillator::Oscillator;
use crate::generator::scene::Scene;
use crate::gnss::satellite::Sv;

/// A change of a clock between two nodes; the end is `u64::MAX` where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    pub from_node: u64,
    pub until_node: u64,
    pub kind: ChangeKind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChangeKind {
    /// Ahead by so much between the nodes.
    Step { step_s: f64 },
    /// Gains so much a second between the nodes and keeps what it gained.
    Ramp { drift: f64 },
}

/// One satellite's clock against what it broadcasts.
#[derive(Debug, Default)]
pub struct SatelliteClock {
    pub changes: Vec<Change>,
    pub noise: Vec<Oscillator>,
}

/// Those clocks that depart.
#[derive(Debug, Default)]
pub struct SatelliteClocks {
    pub clocks: BTreeMap<Sv, SatelliteClock>,
    /// What they do, for the plan.
    pub descriptions: Vec<String>,
}

impl SatelliteClocks {
    /// The clock of a satellite, if it departs.
    pub fn of(&self, sv: Sv) -> Option<&SatelliteClock> {
        self.clocks.get(&sv)
    }
}

/// True seconds since the scene's start at a node.
fn elapsed_s(scene: &Scene, node: u64) -> f64 {
    let local = scene.nodes.clock(scene.clock).epoch(scene.nodes.tick(node));
    scene.receiver_clock.true_elapsed_s(scene.clock.start, local)
}

impl SatelliteClock {
    /// Clock minus what is broadcast of it, between node number `node` and the next: at its beginning and at its end.
    pub fn cell_s(&self, scene: &Scene, node: u64) -> [f64; 2] {
        [node, node + 1].map(|at| {
            let changed = self.changes.iter().map(|change| change.offset_s(scene, node, at));
            let elapsed_s = scene.nodes.elapsed_s(at);
            let noise = |oscillator: &Oscillator| oscillator.slow_s(elapsed_s) + oscillator.quick_s(at);
            changed.chain(self.noise.iter().map(noise)).sum::<f64>()
        })
    }

    /// The same at a place between samples.
    pub fn at_s(&self, scene: &Scene, sample: f64) -> f64 {
        let place = scene.nodes.place(scene.clock.rate, sample);
        let node = place.floor();
        let [from_s, to_s] = self.cell_s(scene, node as u64);
        from_s + (to_s - from_s) * (place - node)
    }

    /// True times since the scene's start at which offset or drift jumps.
    pub fn breaks_s(&self, scene: &Scene) -> impl Iterator<Item = f64> {
        let nodes = self.changes.iter().flat_map(|change| [change.from_node, change.until_node]);
        nodes.filter(|node| *node != u64::MAX).map(|node| elapsed_s(scene, node))
    }
}

impl Change {
    /// At node `at`, which ends or begins the stretch behind node `node`.
    fn offset_s(&self, scene: &Scene, node: u64, at: u64) -> f64 {
        match self.kind {
            ChangeKind::Step { step_s } if (self.from_node..self.until_node).contains(&node) => step_s,
            ChangeKind::Step { .. } => 0.0,
            ChangeKind::Ramp { .. } if at <= self.from_node => 0.0,
            ChangeKind::Ramp { drift } => {
                drift * (elapsed_s(scene, at.min(self.until_node)) - elapsed_s(scene, self.from_node))
            }
        }
    }
}
