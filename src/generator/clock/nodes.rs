//! Nodes of what changes quickly, in time of the receiver's clock.
//!
//! A scene with one front end has them at its samples. Front ends that share a clock share nodes of a rate of
//! their own, so that what changes there is the same for each of them, whichever others there are. Limits:
//! where nodes lie between samples, runs end at the first sample behind a node, and what steps at a node does
//! so there.

use gnss::time::{Rate, SampleClock};

/// Number of samples between nodes: the largest power of two within a millisecond.
pub fn node_samples(rate: Rate) -> u64 {
    1 << ((rate.hz() * 1e-3) as u64).max(64).ilog2()
}

/// Nodes that are less than a millisecond apart, on a grid of ticks of a rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nodes {
    rate: Rate,
    ticks: u64,
}

impl Nodes {
    /// Nodes at samples of `rate`.
    pub fn of(rate: Rate) -> Self {
        Self { rate, ticks: node_samples(rate) }
    }

    /// Nodes that front ends of any rates share, 0.512 ms apart.
    pub fn common() -> Self {
        Self::of(Rate::MEGAHERTZ)
    }

    /// Rate of the ticks.
    pub fn rate(self) -> Rate {
        self.rate
    }

    /// The position of a sample of a clock among them: number of the node before it, and the share of the way
    /// to the next.
    pub fn at(self, rate: Rate, sample: u64) -> (u64, f64) {
        if rate == self.rate {
            return (sample / self.ticks, (sample % self.ticks) as f64 / self.ticks as f64);
        }
        let (count, seconds) = self.rate.ratio();
        let (node, share) = rate.turns(sample, count, seconds * self.ticks);
        (node as u64, share as f64 / 18_446_744_073_709_551_616.0)
    }

    /// Position between samples as one number of nodes. Before the first sample it is that of the first.
    pub fn place(self, rate: Rate, sample: f64) -> f64 {
        if rate == self.rate {
            return sample.max(0.0) / self.ticks as f64;
        }
        sample.max(0.0) * (self.rate.hz() / rate.hz()) / self.ticks as f64
    }

    /// Samples of a run that ends at nodes, if nodes coincide with samples.
    pub fn run_samples(self, rate: Rate) -> Option<u64> {
        (rate == self.rate).then_some(self.ticks)
    }

    /// First sample behind the node before `sample` and at or after the next one, if nodes lie between
    /// samples.
    pub fn until(self, rate: Rate, sample: u64) -> Option<u64> {
        if rate == self.rate {
            return None;
        }
        let (count, seconds) = self.rate.ratio();
        let (node, _) = self.at(rate, sample);
        Some(rate.first_sample_at((node + 1) * self.ticks * seconds, count))
    }

    /// Seconds from the start to a node, by the clock.
    pub fn elapsed_s(self, node: u64) -> f64 {
        self.rate.elapsed_s(node * self.ticks)
    }

    /// A clock whose time is `start` at sample 0, and which ticks where nodes are.
    pub fn clock(self, clock: SampleClock) -> SampleClock {
        SampleClock { rate: self.rate, ..clock }
    }

    /// Number of a node's tick.
    pub fn tick(self, node: u64) -> u64 {
        node.saturating_mul(self.ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_stands_between_two_nodes_and_runs_end_at_the_first_sample_behind_one() {
        let common = Nodes::common();
        for rate_hz in [1.1e6, 2.6e6, 4e6, 10e6, 16_367_666.667, 100e6] {
            let rate = Rate::from_hz(rate_hz).unwrap();
            for first in [0_u64, 1 << 20, 86_400 * rate_hz as u64] {
                let (node, share) = common.at(rate, first);
                // The position in one number has the resolution of the number of samples, 2^-53 of it.
                let place = common.place(rate, first as f64);
                assert!((place - (node as f64 + share)).abs() <= 4.0 * f64::EPSILON * place, "{rate_hz} {first}");
                let next = common.until(rate, first).unwrap();
                assert_eq!(common.at(rate, next).0, node + 1, "{rate_hz} {first}");
                assert_eq!(common.at(rate, next - 1).0, node, "{rate_hz} {first}");
                // Less than a sample behind it.
                assert!(common.at(rate, next).1 < common.place(rate, 1.0) * (1.0 + 1e-9), "{rate_hz} {first}");
            }
        }
    }

    #[test]
    fn nodes_of_a_scenes_own_rate_are_samples_of_it() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        let own = Nodes::of(rate);
        assert_eq!((own.at(rate, 2048 * 7 + 512), own.until(rate, 5)), ((7, 0.25), None));
        assert_eq!((own.run_samples(rate), own.place(rate, 1024.0)), (Some(2048), 0.5));
    }
}
