//! The receiver's copy of a code, as the mean over the interval of each sample.
//!
//! The mean is a difference of the code's running integral, so a chip's edge falls where the phase
//! says and not on the nearest sample; any chip shape made of equal steps works.

use crate::correlate::Wave;
use gnss::signal::Component;

/// The running integral of one code period, in steps of the chip's shape.
#[derive(Clone, Debug)]
pub(super) struct Replica {
    /// Integral at each step's beginning, and at the end.
    integral: Vec<f64>,
    levels: Vec<f64>,
    steps_per_chip: f64,
}

impl Replica {
    /// The code of satellite `number`, or `None` if it has none.
    pub fn new(component: &Component, number: u8) -> Option<Self> {
        let wave = Wave::new(component, number)?;
        let levels: Vec<f64> = wave.values.iter().map(|&value| f64::from(value)).collect();
        let steps_per_chip = wave.steps_per_chip as f64;
        let integral = std::iter::once(0.0)
            .chain(levels.iter().scan(0.0, |sum, level| {
                *sum += level;
                Some(*sum)
            }))
            .collect();
        Some(Self { integral, levels, steps_per_chip })
    }

    /// Means over consecutive intervals of `step_chips`, less than a period, the first beginning at
    /// `start_chips`.
    pub fn means(&self, start_chips: f64, step_chips: f64, out: &mut [f32]) {
        let (levels, last) = (&self.levels[..], self.levels.len() - 1);
        let (period, whole) = (levels.len() as f64, self.integral[levels.len()]);
        let (start, step) = (start_chips * self.steps_per_chip, step_chips * self.steps_per_chip);
        let scale = 1.0 / step;
        let integral = |steps: f64| {
            let index = (steps as u32 as usize).min(last);
            self.integral[index] + (steps - index as f64) * levels[index]
        };
        // Whole periods are taken out as they pass.
        let mut passed = period * (start / period).floor();
        let mut previous = integral(start - passed);
        for (n, out) in out.iter_mut().enumerate() {
            let mut steps = start + (n + 1) as f64 * step - passed;
            if steps >= period {
                passed += period;
                steps -= period;
                previous -= whole;
            }
            let next = integral(steps);
            *out = ((next - previous) * scale) as f32;
            previous = next;
        }
    }

    /// The code at instants `step_chips` apart, less than a period, the first at `start_chips`.
    pub fn instants(&self, start_chips: f64, step_chips: f64, out: &mut [f32]) {
        let period = self.levels.len() as f64;
        let (start, step) = (start_chips * self.steps_per_chip, step_chips * self.steps_per_chip);
        let mut passed = period * (start / period).floor();
        for (n, out) in out.iter_mut().enumerate() {
            let mut steps = start + n as f64 * step - passed;
            if steps >= period {
                passed += period;
                steps -= period;
            }
            // Not below zero: a negative number of small size, as rounding may leave it, is cast to zero.
            *out = self.levels.get(steps as usize).map_or(0.0, |level| *level as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca;

    #[test]
    fn a_sample_holds_the_mean_of_the_chips_that_it_covers() {
        let component = &l1ca::L1_CA.components[0];
        let replica = Replica::new(component, 7).unwrap();
        let level = |chip: usize| if l1ca::code(7).unwrap()[chip % 1023] { -1.0 } else { 1.0 };
        let mut whole = [0.0; 2046];
        for start in [0.0, -2046.0, 5.0 * 1023.0] {
            replica.means(start, 1.0, &mut whole);
            assert!((0..2046).all(|n| whole[n] == level(n)));
        }
        // From 0.75 before the end of the period, over 1.5 chips: ¾ of the last and ¾ of the first.
        let mut mean = [0.0];
        replica.means(1022.25, 1.5, &mut mean);
        assert!((mean[0] - 0.5 * (level(1022) + level(0))).abs() < 1e-7);
        // At the middles of chips each has its own, over the end of the period, too.
        let mut instants = [0.0; 1500];
        replica.instants(600.5, 1.0, &mut instants);
        assert!((0..1500).all(|n| instants[n] == level(600 + n)));
        assert!(Replica::new(component, 0).is_none());
    }
}
