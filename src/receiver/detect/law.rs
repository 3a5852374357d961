//! Laws of the detectors' statistics, and the thresholds that follow from a probability of false alarm.
//!
//! Sources: D. L. Wallace, Bounds on normal approximations to Student's and the chi-square distributions,
//! Annals of Mathematical Statistics 30 (1959), for [`normal_of_student`]; the binomial law of order
//! statistics (H. A. David, Order Statistics, section 2.1) for [`of_ranked`]. Limits: Wallace's normal value
//! is right to 0.02 of itself from five degrees of freedom on.

pub use crate::position::protection::normal::quantile;

use crate::position::protection::normal::beyond;

/// Threshold of the modulus of a standard normal statistic.
pub fn two_sided(probability: f64) -> f64 {
    quantile(0.5 * probability)
}

/// Standard normal value that is exceeded as often as `t` of Student's law with `freedom` degrees of freedom.
pub fn normal_of_student(t: f64, freedom: f64) -> f64 {
    let size = (freedom * libm::log1p(t * t / freedom)).sqrt();
    (size * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)).copysign(t)
}

/// Value that the `rank`-th largest of `count` independent standard normal values exceeds with `probability`:
/// at least `rank` of them do.
pub fn of_ranked(probability: f64, count: usize, rank: usize) -> f64 {
    let exceeded = |x: f64| {
        let one = beyond(x);
        let mut ways = 1.0;
        let mut sum = 0.0;
        for more in 0..=count {
            if more >= rank {
                sum += ways * libm::pow(one, more as f64) * libm::pow(1.0 - one, (count - more) as f64);
            }
            ways *= (count - more) as f64 / (more + 1) as f64;
        }
        sum
    };
    let (mut low, mut high) = (-10.0, 40.0);
    // Halving beyond the resolution of the statistic.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if exceeded(middle) > probability { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF, StudentsT};

    #[test]
    fn a_student_value_becomes_the_normal_value_of_the_same_tail() {
        for freedom in [5.0, 49.0, 249.0] {
            let law = StudentsT::new(0.0, 1.0, freedom).unwrap();
            for t in [0.5_f64, 2.0, 3.5, 5.0] {
                let exact = quantile(law.sf(t));
                let found = normal_of_student(t, freedom);
                assert!((found / exact - 1.0).abs() < 0.02, "{t} of {freedom}: {found} {exact}");
                assert_eq!(normal_of_student(-t, freedom), -found);
            }
        }
    }

    #[test]
    fn a_ranked_value_has_the_binomial_tail() {
        // One of one is the normal law itself, the largest of n has 1 − (1 − p)ⁿ.
        assert!((of_ranked(1e-3, 1, 1) - quantile(1e-3)).abs() < 1e-9);
        let single = -libm::expm1(libm::log1p(-0.01) / 8.0);
        assert!((of_ranked(0.01, 8, 1) - quantile(single)).abs() < 1e-9);
        // Two of three: 3p² − 2p³ = 0.028 at p = 0.1.
        assert!((of_ranked(0.028, 3, 2) - quantile(0.1)).abs() < 1e-9);
    }
}
