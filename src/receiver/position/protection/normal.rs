//! Tail of the normal distribution and its inverse, from `libm` alone: the same bits on every machine.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Probability that a standard normal value exceeds `x`.
pub fn beyond(x: f64) -> f64 {
    0.5 * libm::erfc(x * FRAC_1_SQRT_2)
}

/// The value that a standard normal one exceeds with a probability: negative infinity from 1 on.
///
/// Newton's method on the logarithm of the tail, which is concave and nearly a parabola: from √(−2 ln p) the
/// last of eight steps is at rest for every probability from 1e-300 on.
pub fn quantile(probability: f64) -> f64 {
    if probability >= 1.0 {
        return f64::NEG_INFINITY;
    }
    if probability <= 0.0 {
        return f64::INFINITY;
    }
    if probability > 0.5 {
        return -quantile(1.0 - probability);
    }
    let mut x = (-2.0 * libm::log(probability)).sqrt();
    for _ in 0..8 {
        let density = libm::exp(-0.5 * x * x) / (2.0 * PI).sqrt();
        let tail = beyond(x);
        x += libm::log(tail / probability) * tail / density;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz and Stegun, table 26.6, and the factors of DO-229D, J.2.1: 5.33 for 1e-7 on both sides, 6.0
    /// for 2e-9.
    #[test]
    fn quantiles_are_those_of_the_tables_and_beyond_is_their_inverse() {
        for (probability, x) in [(0.5, 0.0), (0.1, 1.281_552), (1e-3, 3.090_232), (5e-8, 5.326_724), (1e-9, 5.997_807)]
        {
            assert!((quantile(probability) - x).abs() < 1e-6, "{probability}: {}", quantile(probability));
            assert!((quantile(1.0 - probability) + x).abs() < 1e-6 || probability < 1e-8);
        }
        for power in 1..300 {
            let probability = libm::pow(10.0, -f64::from(power));
            assert!((beyond(quantile(probability)) / probability - 1.0).abs() < 1e-9, "1e-{power}");
        }
        assert_eq!((quantile(1.0), quantile(0.0)), (f64::NEG_INFINITY, f64::INFINITY));
    }
}
