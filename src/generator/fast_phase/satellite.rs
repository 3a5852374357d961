//! Errors of satellite clocks relative to what they broadcast: steps, ramps and the oscillator's noise.
//!
//! An error reaches the antenna as a change of code and carrier alike. Steps and ramps begin and end at
//! nodes, up to a millisecond after the time that the scene gives, which is that of arrival; a step takes no
//! time. Limits: the noise is drawn over the received samples, whose time runs a millionth faster or slower
//! than the satellite's; that of stations, over the true time of arrival.

use std::collections::BTreeMap;

use super::Sources;
use crate::clock::nodes::Nodes;
use crate::clock::oscillator::Oscillator;
use gnss::satellite::Sv;

/// Change of a clock between two nodes; the end is `u64::MAX` if there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Number of the node at which it begins.
    pub from_node: u64,
    /// Number of the node at which it ends.
    pub until_node: u64,
    /// Effect on the clock between the two nodes.
    pub kind: ChangeKind,
}

/// Kind of a clock change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChangeKind {
    /// Constant clock offset between the nodes.
    Step {
        /// Clock offset in seconds, positive ahead.
        step_s: f64,
    },
    /// Constant drift between the nodes, whose accumulated offset remains.
    Ramp {
        /// Drift in s/s.
        drift: f64,
    },
}

/// Error of one satellite's clock relative to its broadcast value.
#[derive(Debug, Default)]
pub struct SatelliteClock {
    /// Steps and ramps, which are added up.
    pub changes: Vec<Change>,
    /// Noise beyond that of the broadcast clock; its parts are added up.
    pub noise: Vec<Oscillator>,
}

/// Clocks of the satellites that differ from the broadcast.
#[derive(Debug, Default)]
pub struct SatelliteClocks {
    /// Clocks with errors, by satellite.
    pub clocks: BTreeMap<Sv, SatelliteClock>,
    /// Descriptions of the clock errors for the plan.
    pub descriptions: Vec<String>,
    /// Nodes in true time at which noise is drawn that several stations see; absent means the receiver's.
    pub shared: Option<Nodes>,
}

impl SatelliteClocks {
    /// Clock of a satellite, if it has an error.
    pub fn of(&self, sv: Sv) -> Option<&SatelliteClock> {
        self.clocks.get(&sv)
    }
}

/// True seconds since the scene's start at a node.
fn elapsed_s(sources: &Sources<'_>, node: u64) -> f64 {
    let local = sources.nodes.clock(sources.clock).epoch(sources.nodes.tick(node));
    sources.receiver_clock.true_elapsed_s(sources.clock.start, local)
}

impl SatelliteClock {
    /// Clock minus its broadcast value in seconds, at the beginning and at the end of the interval from node
    /// number `node` to the next.
    pub fn cell_s(&self, sources: &Sources<'_>, node: u64) -> [f64; 2] {
        [node, node + 1].map(|at| {
            let changed = self.changes.iter().map(|change| change.offset_s(sources, node, at));
            let elapsed_s = sources.nodes.elapsed_s(at);
            let noise = |oscillator: &Oscillator| match sources.satellite_clocks.shared {
                None => oscillator.slow_s(elapsed_s) + oscillator.quick_s(at),
                Some(nodes) => {
                    let true_s = self::elapsed_s(sources, at).max(0.0);
                    let rate = nodes.rate();
                    oscillator.slow_s(true_s) + oscillator.quick_at_s(nodes.place(rate, true_s * rate.hz()))
                }
            };
            changed.chain(self.noise.iter().map(noise)).sum::<f64>()
        })
    }

    /// Clock minus its broadcast value, in seconds, at a position between samples.
    pub fn at_s(&self, sources: &Sources<'_>, sample: f64) -> f64 {
        let place = sources.nodes.place(sources.clock.rate, sample);
        let node = place.floor();
        let [from_s, to_s] = self.cell_s(sources, node as u64);
        from_s + (to_s - from_s) * (place - node)
    }

    /// True times in seconds since the scene's start at which offset or drift jumps.
    pub fn breaks_s(&self, sources: &Sources<'_>) -> impl Iterator<Item = f64> {
        let nodes = self.changes.iter().flat_map(|change| [change.from_node, change.until_node]);
        nodes.filter(|node| *node != u64::MAX).map(|node| elapsed_s(sources, node))
    }
}

impl Change {
    /// Clock offset in seconds at node `at`, which ends or begins the segment behind node `node`.
    fn offset_s(&self, sources: &Sources<'_>, node: u64, at: u64) -> f64 {
        match self.kind {
            ChangeKind::Step { step_s } if (self.from_node..self.until_node).contains(&node) => step_s,
            ChangeKind::Step { .. } => 0.0,
            ChangeKind::Ramp { .. } if at <= self.from_node => 0.0,
            ChangeKind::Ramp { drift } => {
                drift * (elapsed_s(sources, at.min(self.until_node)) - elapsed_s(sources, self.from_node))
            }
        }
    }
}
