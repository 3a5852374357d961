//! Rotation of the carrier within code periods of unknown sign.
//!
//! Each period may have its own sign, of a symbol or of a secondary code's chip. Neighbouring periods then
//! show the frequency modulo half a cycle a period. The search of sums over two periods has side lobes there,
//! and frequency detector and Costas loop can settle there. The two halves of one period have the same sign.
//! The turn between them is therefore the frequency itself, within a cycle a period on either side.

use std::f64::consts::PI;

use num_complex::Complex64;

/// Code periods before a decision is tried.
const LEAST_PERIODS: u32 = 32;
/// Largest deviation of the angle between the halves with which one is made: a false lock turns them by π/2,
/// and half of that, which parts it from none, is six of these.
const LARGEST_SIGMA_RAD: f64 = 0.125;

/// Products of the halves of code periods.
#[derive(Clone, Debug, Default)]
pub(super) struct Halves {
    product: Complex64,
    periods: u32,
}

impl Halves {
    /// Takes the prompt of a code period and that of its first half, both in the unit in which noise of the
    /// whole has unit variance a component.
    pub fn add(&mut self, whole: Complex64, first: Complex64) {
        // Noise of a half has half the variance.
        self.product += 2.0 * (whole - first) * first.conj();
        self.periods += 1;
    }

    /// Cycles a code period by which the carrier is faster than the oscillator, once that is beyond doubt.
    pub fn cycles(&self) -> Option<f64> {
        let periods = f64::from(self.periods);
        let power = self.product.norm() / periods;
        // Of a product of two phasors of squared amplitude a with noise of unit variance a component: 2a + 2
        // across their mean, which is a.
        let sigma_rad = ((2.0 * power + 2.0) / periods).sqrt() / power;
        let is_sure = self.periods >= LEAST_PERIODS && sigma_rad < LARGEST_SIGMA_RAD;
        // Their middles are half a period apart.
        is_sure.then(|| self.product.arg() / PI)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;

    #[test]
    fn the_frequency_shows_modulo_two_cycles_a_period_from_30_dbhz_on_and_never_in_noise() {
        for (dbhz, most) in [(30.0, 500), (36.0, 80), (45.0, 32)] {
            let mut normal = Normal::new(5);
            let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) * 1e-3).sqrt();
            for cycles in [-0.5, -0.1, 0.0, 0.3, 0.5] {
                let (mut halves, mut taken) = (Halves::default(), 0);
                let found = loop {
                    let sign = if normal.next() > 0.0 { 0.5 } else { -0.5 };
                    // Half the amplitude and half the variance in each half.
                    let mut half = |turn: f64| {
                        let (sin, cos) = libm::sincos(PI * cycles * turn);
                        let noise = Complex64::new(normal.next(), normal.next()) * 0.5_f64.sqrt();
                        Complex64::new(cos, sin) * (sign * amplitude) + noise
                    };
                    let (first, second) = (half(-0.5), half(0.5));
                    halves.add(first + second, first);
                    taken += 1;
                    if let Some(found) = halves.cycles() {
                        break found;
                    }
                };
                // Five deviations of the angle.
                assert!(
                    (found - cycles).abs() < 5.0 * LARGEST_SIGMA_RAD / PI && taken <= most,
                    "{dbhz}: {found} {taken}"
                );
            }
        }
        let (mut normal, mut halves) = (Normal::new(6), Halves::default());
        for _ in 0..100_000 {
            let mut half = || Complex64::new(normal.next(), normal.next()) * 0.5_f64.sqrt();
            let (first, second) = (half(), half());
            halves.add(first + second, first);
            assert_eq!(halves.cycles(), None);
        }
    }
}
