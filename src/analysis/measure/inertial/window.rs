//! Angular rate and specific force between the ends of an inertial unit's intervals.
//!
//! Sums of means times intervals are known exactly at the ends. The polynomial through the ends of a window
//! of intervals is differentiated: coning and sculling within an interval follow from its neighbours. Limits:
//! of a sinusoid that turns by θ in an interval, a window of 15 leaves 3e-6 θ^16 between the ends. Where the
//! turn rate of a spinning body begins to grow by 1.65 rad/s² in the middle of an interval, the attitude is
//! off by 2e-7 rad at 0.67 rad an interval, by 3e-8 rad at 0.33 rad and by 2e-9 rad at 0.13 rad.

use nalgebra::Vector3;

/// Intervals of a window.
pub const LENGTH: usize = 15;
/// Turn in an interval up to which a step of the specific force within it, as that of sensors off the centre
/// where the nose begins to turn, leaves less than 1 mm in a minute. What it leaves grows with the square.
pub const EASY_TURN_RAD: f64 = 0.2;
/// Largest turn in an interval at which the integration is judged.
pub const LARGEST_TURN_RAD: f64 = 0.4;

/// Factors that make polynomials of means, for each interval of a window.
pub struct Window {
    /// Rows of each interval: one for each power, with a factor for each mean.
    factors: Vec<Vec<Vec<f64>>>,
}

/// Polynomial in the time from an interval's middle, in intervals.
pub struct Smooth(Vec<Vector3<f64>>);

impl Window {
    /// Creates the window of `length` intervals.
    pub fn new(length: usize) -> Self {
        Self { factors: (0..length).map(|place| factors(length, place)).collect() }
    }

    /// Polynomial over interval `place` of a window, by the means of all of its intervals.
    pub fn smooth<'m>(&self, place: usize, means: impl Iterator<Item = &'m Vector3<f64>> + Clone) -> Smooth {
        let rows = self.factors.get(place).map(Vec::as_slice).unwrap_or_default();
        let coefficient =
            |row: &Vec<f64>| row.iter().zip(means.clone()).map(|(factor, mean)| mean * *factor).sum::<Vector3<f64>>();
        Smooth(rows.iter().map(coefficient).collect())
    }
}

impl Smooth {
    /// Value at a time from the interval's middle, −0.5 to 0.5.
    pub fn at(&self, x: f64) -> Vector3<f64> {
        self.0.iter().rev().fold(Vector3::zeros(), |sum, coefficient| sum * x + coefficient)
    }
}

/// Factors of interval `place`: derivatives of Lagrange's polynomials through the ends, added up over the
/// ends after each mean.
fn factors(length: usize, place: usize) -> Vec<Vec<f64>> {
    let ends: Vec<f64> = (0..=length).map(|end| end as f64 - place as f64 - 0.5).collect();
    let mut rows = vec![vec![0.0; length]; length];
    for (end, x) in ends.iter().enumerate() {
        let slope = derivative(&lagrange(&ends, *x));
        for (row, slope) in rows.iter_mut().zip(slope) {
            row.iter_mut().take(end).for_each(|factor| *factor += slope);
        }
    }
    rows
}

/// Coefficients of the polynomial that is one at `own` and zero at the other ends.
fn lagrange(ends: &[f64], own: f64) -> Vec<f64> {
    let mut product = vec![1.0];
    for other in ends.iter().filter(|other| **other != own) {
        let scale = 1.0 / (own - other);
        let mut next = vec![0.0; product.len() + 1];
        for (power, coefficient) in product.iter().enumerate() {
            next[power] -= coefficient * other * scale;
            next[power + 1] += coefficient * scale;
        }
        product = next;
    }
    product
}

fn derivative(coefficients: &[f64]) -> Vec<f64> {
    coefficients.iter().enumerate().skip(1).map(|(power, coefficient)| coefficient * power as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sinusoid_is_found_between_its_means() {
        let (theta, window) = (0.5_f64, Window::new(LENGTH));
        // Means of cos θx over intervals of one.
        let mean = |middle: f64| 2.0 * libm::sin(0.5 * theta) / theta * libm::cos(theta * middle);
        for (place, tolerance) in [(7, 1e-9), (0, 1e-5), (14, 1e-5)] {
            let means: Vec<Vector3<f64>> =
                (0..LENGTH).map(|k| Vector3::new(mean(k as f64 - place as f64), 1.0, 0.0)).collect();
            let smooth = window.smooth(place, means.iter());
            for x in [-0.5, -0.2, 0.0, 0.3, 0.5] {
                let found = smooth.at(x) - Vector3::new(libm::cos(theta * x), 1.0, 0.0);
                // Of the middle 3e-6·0.5^16 = 5e-11 of the integral, of its slope θ^15 times some 3e-5, 1e-9;
                // of the ends 1500 times as much and twice that slope.
                assert!(found.norm() < tolerance, "{place} {x}: {found}");
            }
        }
    }
}
