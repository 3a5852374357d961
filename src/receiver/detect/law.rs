//! Laws of the detectors' statistics, and the thresholds that follow from a probability of false alarm.
//!
//! Source: D. L. Wallace, Bounds on normal approximations to Student's and the chi-square distributions,
//! Annals of Mathematical Statistics 30 (1959). Limits: his normal value is right to 0.02 of itself from five
//! degrees of freedom on.

pub use crate::position::protection::normal::quantile;

/// Threshold of the modulus of a standard normal statistic.
pub fn two_sided(probability: f64) -> f64 {
    quantile(planted!("receiver.detect.threshold", 0.5, 1.0) * probability)
}

/// Standard normal value that is exceeded as often as `t` of Student's law with `freedom` degrees of freedom.
pub fn normal_of_student(t: f64, freedom: f64) -> f64 {
    let size = (freedom * libm::log1p(t * t / freedom)).sqrt();
    (size * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)).copysign(t)
}

/// Standard normal value of a number that has the law of the others, by their mean and their scatter. Its
/// difference from the mean of n others over their standard deviation and √(1 + 1/n) is Student's with n − 1
/// degrees of freedom. `None` without scatter.
pub fn among(value: f64, others: &[f64]) -> Option<f64> {
    let count = others.len() as f64;
    let mean = others.iter().sum::<f64>() / count;
    let variance = others.iter().map(|other| (other - mean) * (other - mean)).sum::<f64>() / (count - 1.0);
    let new = planted!("receiver.detect.mean", 1.0 + 1.0 / count, 1.0);
    let sigma = (variance * new).sqrt();
    (sigma > 0.0).then(|| normal_of_student((value - mean) / sigma, count - 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::random::Normal;
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
    fn a_number_among_others_is_standard_normal_whatever_their_mean_and_scatter() {
        let mut normal = Normal::new(7);
        let mut draw = || 40.0 + 3.0 * normal.draw();
        let values: Vec<f64> = (0..20_000)
            .map(|_| {
                let others: Vec<f64> = (0..20).map(|_| draw()).collect();
                among(draw(), &others).unwrap()
            })
            .collect();
        // 1 % beyond 2.576, known to 0.07 %; four of these.
        let beyond = values.iter().filter(|value| value.abs() > 2.576).count();
        assert!((140..=260).contains(&beyond), "{beyond}");
        assert_eq!(among(1.0, &[2.0, 2.0, 2.0]), None);
    }
}
