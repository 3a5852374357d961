//! Whether the ranges look as if there were a troposphere, against what the settings say.
//!
//! Samples of some generators have none; corrected for one, the ranges of low satellites are too short by up
//! to 14 m, and sound satellites contradict each other. Of every position the ranges above the mask are
//! solved with the other choice too. Without faults either sum of squares follows chi-square under its own
//! hypothesis, so half of their difference is the logarithm of the odds between the two (of equal prior
//! probability, Gaussian errors of the stated deviations). Errors of one minute are nearly the same, so all
//! positions together count as one: the mean of the differences decides.

use nalgebra::Vector3;

use super::least_squares::{self, Corrections, Range, Solution, freedom};

/// Mean difference from which on the other choice is right: odds of e^4.6, a hundred to one. Where the choice
/// is right and the other one worse by g, the difference is −g with a deviation of 2√g, and exceeds this with
/// a probability of 0.0012 at most, at g of this size.
const DECISIVE: f64 = 9.2;
/// Positions that say nothing yet.
const LEAST_POSITIONS: u32 = 20;

/// What both choices come to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Air {
    positions: u32,
    gain: f64,
}

impl Air {
    /// Takes the ranges of a position and their solution by the settings' choice.
    pub fn compare(&mut self, ranges: &[Range], all: &Solution, corrections: &Corrections, start_m: Vector3<f64>) {
        if freedom(ranges) <= 0 {
            return;
        }
        self.positions += 1;
        // The other one's sum of squares is above zero.
        if all.chi_square < DECISIVE {
            return;
        }
        let other = Corrections { troposphere: !corrections.troposphere, ..corrections.clone() };
        let Ok(other) = least_squares::position(ranges, start_m, &other) else { return };
        self.gain += all.chi_square - other.chi_square;
    }

    /// Whether the other choice is right.
    pub fn is_otherwise(&self) -> bool {
        let mean = self.gain / f64::from(self.positions.max(1));
        self.positions >= LEAST_POSITIONS && mean > DECISIVE
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{SKY, noise, place, ranges};
    use super::super::{least_squares::Ionosphere, troposphere};
    use super::*;

    /// What is found of samples that have a troposphere or none, by a correction for one or none.
    fn seen(is_there: bool, is_corrected: bool) -> bool {
        let corrections = Corrections { ionosphere: Ionosphere::Absent, troposphere: is_corrected, model_sigma_m: 0.1 };
        let (mut air, mut state) = (Air::default(), 3);
        for _ in 0..40 {
            let mut sky = ranges(&SKY, 1e-4);
            for (range, (_, elevation_deg)) in sky.iter_mut().zip(SKY) {
                // The first of July.
                let sine = libm::sin(f64::to_radians(elevation_deg));
                let delay_m = troposphere::delay_m(place(), sine, 182.0);
                range.noise_m = 0.5;
                range.pseudorange_m += 0.5 * noise(&mut state) + if is_there { delay_m } else { 0.0 };
            }
            let all = least_squares::position(&sky, place().to_ecef(), &corrections).unwrap();
            air.compare(&sky, &all, &corrections, all.position_m);
        }
        air.is_otherwise()
    }

    #[test]
    fn a_correction_for_what_is_not_there_is_recognised_and_the_other_way_about() {
        assert!(seen(false, true) && seen(true, false));
        assert!(!seen(true, true) && !seen(false, false));
    }
}
