//! Test for a troposphere in the ranges, against the choice in the settings.
//!
//! Samples of some generators have no troposphere. Corrected for one, the ranges of low satellites are too
//! short by up to 14 m, and sound satellites contradict each other. The ranges above the mask of every
//! position are therefore solved with the other choice too. Without faults either sum of squares follows
//! chi-square under its own hypothesis. Half of their difference is then the logarithm of the odds between
//! the two, for equal prior probability and Gaussian errors of the stated deviations. Errors within one
//! minute are nearly equal, so all positions together count as one: the mean of the differences decides.

use nalgebra::Vector3;

use super::least_squares::{self, Corrections, Range, Solution, freedom};

/// Mean difference from which on the other choice is right: odds of e^4.6, a hundred to one. Where the choice
/// is right and the other one worse by g, the difference is −g with a deviation of 2√g, and exceeds this with
/// a probability of 0.0012 at most, at g of this size.
const DECISIVE: f64 = 9.2;
/// Positions that say nothing yet.
const LEAST_POSITIONS: u32 = 20;

/// Number of positions, and the sum of their logarithmic odds for the other choice.
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

    /// True if the other choice is right.
    pub fn is_otherwise(&self) -> bool {
        let mean = self.gain / f64::from(self.positions.max(1));
        self.positions >= LEAST_POSITIONS && mean > DECISIVE
    }
}

#[cfg(test)]
mod tests {
    use super::super::least_squares::Ionosphere;
    use super::super::tests::{SKY, noise, place, ranges};
    use super::*;
    use gnss::troposphere;

    /// Decision on samples with a troposphere or without, under a correction for one or for none.
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
