//! The receiver's copy of a code, as the mean over the interval of each sample.
//!
//! The mean is a difference of the code's running integral, so a chip's edge falls where the phase
//! says and not on the nearest sample; any chip shape made of equal steps works.

use crate::gnss::signal::Component;
use crate::receiver::correlate::{self, Edge, Wave};

/// The running integral of one code period, in steps of the chip's shape.
#[derive(Clone, Debug)]
pub(super) struct Replica {
    /// Integral at each step's beginning, and at the end.
    integral: Vec<f64>,
    levels: Vec<f64>,
    steps_per_chip: f64,
    /// The same for the tracking correlator.
    correlator: correlate::Replica,
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
        let correlator = correlate::Replica::of(wave, Edge::Area)?;
        Some(Self { integral, levels, steps_per_chip, correlator })
    }

    /// For correlation with phases in chips.
    pub fn correlator(&self) -> &correlate::Replica {
        &self.correlator
    }

    pub fn steps_per_chip(&self) -> f64 {
        self.steps_per_chip
    }

    /// Integral of the periodic code from phase 0, in steps.
    fn integral(&self, phase_chips: f64) -> f64 {
        let steps = phase_chips * self.steps_per_chip;
        let length = self.levels.len() as f64;
        let periods = (steps / length).floor();
        let rest = steps - periods * length;
        let index = (rest as usize).min(self.levels.len() - 1);
        periods * self.integral[self.levels.len()] + self.integral[index] + (rest - index as f64) * self.levels[index]
    }

    /// Means over consecutive intervals of `step_chips`, the first beginning at `start_chips`.
    pub fn means(&self, start_chips: f64, step_chips: f64) -> impl Iterator<Item = f64> + '_ {
        let scale = 1.0 / (step_chips * self.steps_per_chip);
        let mut previous = self.integral(start_chips);
        (1_u64..).map(move |n| {
            let next = self.integral(start_chips + n as f64 * step_chips);
            let mean = (next - previous) * scale;
            previous = next;
            mean
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::gps::l1ca;

    #[test]
    fn a_sample_holds_the_mean_of_the_chips_that_it_covers() {
        let component = &l1ca::L1_CA.components[0];
        let replica = Replica::new(component, 7).unwrap();
        let level = |chip: usize| if l1ca::code(7).unwrap()[chip % 1023] { -1.0 } else { 1.0 };
        let whole: Vec<f64> = replica.means(0.0, 1.0).take(2046).collect();
        assert!((0..2046).all(|n| whole[n] == level(n)));
        // From 0.75 before the end of the period, over 1.5 chips: ¾ of the last and ¾ of the first.
        let mean = replica.means(1022.25, 1.5).next().unwrap();
        assert!((mean - 0.5 * (level(1022) + level(0))).abs() < 1e-12);
        assert!(Replica::new(component, 0).is_none());
    }
}
