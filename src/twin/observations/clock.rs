//! Instants of a tick in the samples of every front end.

use generator::scene::Scene;
use gnss::time::Rate;

/// An instant of the receiver's clock: a sample of the first front end.
#[derive(Clone, Debug)]
pub(super) struct Instant {
    /// Number of the tick that it belongs to.
    pub number: u64,
    pub sample: u64,
    /// Time since sample 0.
    pub seconds: f64,
    rate: Rate,
    /// Sample of each front end that is not earlier, and by how much it is later, in seconds.
    own: Vec<(u64, f64)>,
}

impl Instant {
    /// The instant of a sample of the first of some front ends.
    pub fn new(scenes: &[Scene], number: u64, sample: u64) -> Option<Self> {
        let rate = scenes.first()?.clock.rate;
        let (count, seconds) = rate.ratio();
        let own = |(index, scene): (usize, &Scene)| {
            if index == 0 || scene.clock.rate == rate {
                return (sample, 0.0);
            }
            let own = scene.clock.rate.first_sample_at(sample * seconds, count);
            let ((whole, part), (main, main_part)) = (scene.clock.rate.elapsed(own), rate.elapsed(sample));
            (own, (whole - main) as f64 + (part - main_part))
        };
        let own = scenes.iter().enumerate().map(own).collect();
        Some(Self { number, sample, seconds: rate.elapsed_s(sample), rate, own })
    }

    /// Sample of a front end, and by how much it is later.
    pub fn own(&self, front: usize) -> Option<(u64, f64)> {
        self.own.get(front).copied()
    }

    /// Sample of the first front end at a time before this instant.
    pub fn sample_at(&self, seconds: f64) -> u64 {
        ((seconds.max(0.0) * self.rate.hz()) as u64).min(self.sample)
    }
}
