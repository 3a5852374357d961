//! Limits of random errors for a stated probability of a false alarm.
//!
//! A row of the verdict may fail a sound receiver once in [`FALSE_ALARM`] runs⁻¹. For the largest of n values
//! each gets an nth of it (Bonferroni), which holds whatever their correlation. The 95th percentile of values
//! below their limits is below that of the limits. A mean of correlated values varies as that of fewer
//! independent ones, which the caller counts.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Probability with which one row of the verdict fails a receiver that is as theory says: 1000 runs of 40
/// rows make less than one false failure.
pub const FALSE_ALARM: f64 = 1e-5;

/// Factor of σ that the largest of `count` normal values of `axes` dimensions exceeds with that probability.
/// The length of a vector counts in units of its longest axis.
pub fn largest(axes: u32, count: usize) -> f64 {
    beyond(axes, FALSE_ALARM / count.max(1) as f64)
}

/// Factor of σ that a normal vector's length exceeds with probability `p`.
fn beyond(axes: u32, p: f64) -> f64 {
    // From 1 − 1e-15 on the inverse of a double's cumulative function ends.
    let p = p.max(1e-14);
    match axes {
        1 => Normal::standard().inverse_cdf(0.5 * p).abs(),
        2 => (-2.0 * libm::log(p)).sqrt(),
        _ => ChiSquared::new(f64::from(axes)).map_or(f64::INFINITY, |law| law.inverse_cdf(1.0 - p)).sqrt(),
    }
}

/// Band of the mean square of so many independent normal values of unit variance, half of the false alarm on
/// each side.
pub fn mean_square(independent: f64) -> (f64, f64) {
    mean_squares(independent, 1)
}

/// [`mean_square`] for each of `count` means.
pub fn mean_squares(independent: f64, count: usize) -> (f64, f64) {
    let freedom = independent.max(1.0);
    let Ok(law) = ChiSquared::new(freedom) else { return (0.0, f64::INFINITY) };
    let beyond = 0.5 * FALSE_ALARM / count.max(1) as f64;
    (law.inverse_cdf(beyond) / freedom, law.inverse_cdf(1.0 - beyond) / freedom)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_those_of_the_tables() {
        // Normal, two-sided 1e-5: 4.4172; Rayleigh: √(2·ln 1e5); chi-square of three degrees beyond 1e-5:
        // 25.902.
        assert!((largest(1, 1) - 4.4172).abs() < 1e-3, "{}", largest(1, 1));
        assert!((largest(2, 1) - 4.7985).abs() < 1e-3, "{}", largest(2, 1));
        assert!((largest(3, 1) - 25.902_f64.sqrt()).abs() < 2e-3, "{}", largest(3, 1));
        assert!(largest(1, 1000) > largest(1, 10) && largest(1, usize::MAX).is_finite());
    }

    #[test]
    fn the_band_of_a_mean_square_narrows_to_one() {
        let (low, high) = mean_square(1e4);
        // Normal limit: 1 ± 4.42·√(2/n) = 1 ± 0.0625.
        assert!((low - 0.9375).abs() < 3e-3 && (high - 1.0625).abs() < 3e-3, "{low} {high}");
        let (low, high) = mean_square(0.2);
        assert!(low < 1e-9 && high > 19.0, "{low} {high}");
    }
}
