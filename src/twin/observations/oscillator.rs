//! Phase loops on the noise of the receiver's oscillator, which they follow in part.
//!
//! Noise quicker than a second moves the carriers of all satellites alike, so one loop stands for those of
//! all channels with the same gains. As a correlation does, its discriminator takes the noise's mean over
//! an update interval. Limits: slower noise is followed without error; a loop runs from sample 0 on,
//! whenever a channel began; the signal's own noise adds to its errors.

use std::collections::VecDeque;
use std::sync::Arc;

use generator::clock::nodes::Nodes;
use generator::clock::oscillator::Oscillator;
use generator::scene::Scene;
use gnss::time::Rate;
use receiver::track::loops::{Gains, Rates, step};

/// A phase loop on an oscillator's quick noise.
pub(super) struct OscillatorLoop {
    oscillator: Arc<Oscillator>,
    nodes: Nodes,
    rate: Rate,
    gains: Gains,
    update_s: f64,
    sum: NodeSum,
    rates: Rates,
    /// Number of the first interval that is kept.
    first: u64,
    /// Phase at the beginning of an interval, in seconds, and its rate.
    kept: VecDeque<(f64, f64)>,
}

/// The oscillator in a channel at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OscillatorError {
    /// Noise that the loop has not followed, in seconds.
    pub lag_s: f64,
    /// Rate at which the loop follows.
    pub rate: f64,
}

/// Integral over the line through the noise at nodes, up to a node.
#[derive(Clone, Copy)]
struct NodeSum {
    node: u64,
    /// Integral in seconds times nodes.
    sum: f64,
    /// Noise at the node and the next one.
    ends_s: [f64; 2],
}

impl NodeSum {
    fn new(oscillator: &Oscillator) -> Self {
        Self { node: 0, sum: 0.0, ends_s: [oscillator.quick_s(0), oscillator.quick_s(1)] }
    }

    /// Integral up to a position in nodes, not before those of earlier calls.
    fn up_to(&mut self, oscillator: &Oscillator, place: f64) -> f64 {
        while place >= (self.node + 1) as f64 {
            let [from_s, to_s] = self.ends_s;
            self.sum += 0.5 * (from_s + to_s);
            self.node += 1;
            self.ends_s = [to_s, oscillator.quick_s(self.node + 1)];
        }
        let (share, [from_s, to_s]) = (place - self.node as f64, self.ends_s);
        self.sum + share * (from_s + 0.5 * share * (to_s - from_s))
    }
}

impl OscillatorLoop {
    /// Loop of those gains and that update interval in a front end; `None` without noise.
    pub fn new(scene: &Scene, gains: Gains, update_s: f64) -> Option<Self> {
        let oscillator = scene.receiver_clock.oscillator.clone()?;
        Some(Self {
            sum: NodeSum::new(&oscillator),
            oscillator,
            nodes: scene.nodes,
            rate: scene.clock.rate,
            gains,
            update_s,
            rates: Rates::default(),
            first: 0,
            kept: VecDeque::from([(0.0, 0.0)]),
        })
    }

    /// True if the loop is one of those gains and that update interval in a front end.
    pub fn is_of(&self, scene: &Scene, gains: &Gains, update_s: f64) -> bool {
        (self.rate, self.gains, self.update_s) == (scene.clock.rate, *gains, update_s)
    }

    /// Runs the loop up to a time, and forgets what is older than `kept_s`.
    pub fn run(&mut self, to_s: f64, kept_s: f64) {
        let last = (to_s / self.update_s) as u64 + 1;
        while self.first + (self.kept.len() as u64) <= last {
            let number = self.first + self.kept.len() as u64 - 1;
            let (phase_s, rate) = self.kept.back().copied().unwrap_or_default();
            let mean_s = self.mean_s(number);
            let error_s = mean_s - (phase_s + 0.5 * rate * self.update_s);
            let (next, jump_s) = step(&self.gains, &self.rates, error_s, self.update_s);
            self.rates = next;
            self.kept.push_back((phase_s + rate * self.update_s + jump_s, next.mean(self.update_s)));
        }
        let oldest = ((to_s - kept_s).max(0.0) / self.update_s) as u64;
        while self.first < oldest && self.kept.len() > 1 {
            self.kept.pop_front();
            self.first += 1;
        }
    }

    /// Mean of the noise over an update interval.
    fn mean_s(&mut self, number: u64) -> f64 {
        let place = |number: u64| self.nodes.place(self.rate, number as f64 * self.update_s * self.rate.hz());
        let (from, to) = (place(number), place(number + 1));
        let before = self.sum.up_to(&self.oscillator, from);
        (self.sum.up_to(&self.oscillator, to) - before) / (to - from)
    }

    /// Noise at a sample, in seconds.
    pub fn noise_s(&self, sample: u64) -> f64 {
        self.oscillator.quick_at_s(self.nodes.place(self.rate, sample as f64))
    }

    /// Error of the loop at a sample up to which it has run.
    pub fn at(&self, sample: u64) -> OscillatorError {
        let seconds = self.rate.elapsed_s(sample);
        let number = ((seconds / self.update_s) as u64).saturating_sub(self.first);
        let Some((phase_s, rate)) = self.kept.get(number as usize).copied() else { return OscillatorError::default() };
        let since_s = seconds - (self.first + number) as f64 * self.update_s;
        OscillatorError { lag_s: self.noise_s(sample) - phase_s - rate * since_s, rate }
    }
}
