//! Level: power of the samples against that of the intervals before.
//!
//! A jammer or a stronger copy of the sky adds power (D. M. Akos, Who's Afraid of the Spoofer? GPS/GNSS
//! Spoofing Detection via Automatic Gain Control, Navigation 59 (2012)). Block by block the mean power of
//! some samples is taken. Under noise of one density block powers are independent, and nearly normal as sums
//! of thousands of samples. The difference of two means over its standard deviation, which the scatter within
//! the intervals shows, is Student's. Satellites rise and set and gains drift, so that `TOLERANCE` is taken
//! off first: the probability of a false alarm is at most the stated one. Limits: a gain control before the
//! samples hides a change of level, and so does a converter of one bit; a change that comes more slowly than
//! the reference moves on is not seen.

use std::collections::VecDeque;

use super::law::normal_of_student;
use crate::source::{Packed, Planes};

/// Samples of a block whose power is taken.
const SAMPLES: usize = 16_384;
/// Change of power that no alarm counts, of a clean sky or of a gain: 0.1 dB.
const TOLERANCE: f64 = 0.0233;
/// Fewest blocks of an interval.
const LEAST_BLOCKS: f64 = 4.0;

/// Block powers of an interval.
#[derive(Clone, Copy, Debug, Default)]
struct Powers {
    count: f64,
    sum: f64,
    square: f64,
}

impl Powers {
    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    /// Sum of the squared deviations from the mean.
    fn scatter(&self) -> f64 {
        (self.square - self.sum * self.sum / self.count).max(0.0)
    }
}

/// Level of one front end.
#[derive(Debug, Default)]
pub struct Level {
    planes: Planes,
    running: Powers,
    reference: VecDeque<Powers>,
}

impl Level {
    /// Takes a block of samples.
    pub fn take(&mut self, block: &Packed) {
        let count = block.samples().min(SAMPLES);
        if count == 0 {
            return;
        }
        let part = block.unpack(0..count, &mut self.planes);
        let squares = |values: &[f32]| values.iter().map(|x| f64::from(*x) * f64::from(*x)).sum::<f64>();
        let power = (squares(part.i) + squares(part.q)) / count as f64;
        self.take_power(power);
    }

    fn take_power(&mut self, power: f64) {
        self.running.count += 1.0;
        self.running.sum += power;
        self.running.square += power * power;
    }

    /// Forgets the running interval.
    pub fn interrupt(&mut self) {
        self.running = Powers::default();
    }

    /// Ends the interval: the statistic, standard normal in modulus, once there is a reference of `least`
    /// intervals. The interval becomes a part of a reference of `most` intervals unless the statistic exceeds
    /// `threshold`.
    pub fn close(&mut self, (least, most): (usize, usize), threshold: f64) -> Option<f64> {
        let running = std::mem::take(&mut self.running);
        if running.count < LEAST_BLOCKS {
            return None;
        }
        let statistic = (self.reference.len() >= least).then(|| self.statistic(&running)).flatten();
        if statistic.is_none_or(|statistic| statistic <= threshold) {
            self.reference.push_back(running);
            while self.reference.len() > most {
                self.reference.pop_front();
            }
        }
        statistic
    }

    fn statistic(&self, running: &Powers) -> Option<f64> {
        let blocks: f64 = self.reference.iter().map(|powers| powers.count).sum();
        let mean = self.reference.iter().map(|powers| powers.sum).sum::<f64>() / blocks;
        // Within each interval, so that a slow drift is no noise.
        let scatter: f64 = self.reference.iter().map(Powers::scatter).sum();
        let freedom = blocks - self.reference.len() as f64;
        let sigma = (scatter / freedom * (1.0 / running.count + 1.0 / blocks)).sqrt();
        let beyond = (running.mean() - mean).abs() - TOLERANCE * mean;
        (sigma > 0.0).then(|| normal_of_student(beyond.max(0.0) / sigma, freedom))
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Normal;
    use super::*;

    /// Statistics of intervals of 20 blocks whose mean power is `of` the interval's number.
    fn run(intervals: u32, of: impl Fn(u32) -> f64) -> Vec<f64> {
        let (mut level, mut normal) = (Level::default(), Normal::new(3));
        let mut found = Vec::new();
        for k in 0..intervals {
            for _ in 0..20 {
                level.take_power(of(k) * (1.0 + 0.005 * normal.draw()));
            }
            found.extend(level.close((5, 20), 3.29));
        }
        found
    }

    #[test]
    fn a_steady_level_and_one_within_the_tolerance_raise_no_alarm() {
        let steady = run(2000, |_| 100.0);
        assert!(steady.len() == 1995 && steady.iter().all(|statistic| *statistic == 0.0));
        let slow = run(2000, |k| 100.0 * (1.0 + 1e-4 * f64::from(k)));
        assert!(slow.iter().all(|statistic| *statistic <= 3.29));
    }

    #[test]
    fn a_step_is_reported_as_long_as_it_lasts() {
        let found = run(100, |k| if (40..80).contains(&k) { 104.0 } else { 100.0 });
        let alarms: Vec<usize> = (0..found.len()).filter(|k| found[*k] > 3.29).map(|k| k + 5).collect();
        assert_eq!(alarms, (40..80).collect::<Vec<_>>());
    }
}
