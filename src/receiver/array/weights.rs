//! Weights of an array's elements from their covariance.
//!
//! Least power `wᴴRw` with `wᴴa = 1` has `w = R⁻¹a / (aᴴR⁻¹a)` (Capon 1969; van Trees 2002, section 6.2).
//! With a the answer to a wave from one direction that is MVDR; with a = (1, 0, …) it is power inversion
//! (Compton 1979). A signal of power P then has the SINR `P aᴴR⁻¹a`, R without the signal.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;

use gnss::earth::SPEED_OF_LIGHT_MPS;

/// Smallest pivot of a covariance that is inverted, as a share of the diagonal's element.
const LEAST_SHARE: f64 = 1e-13;

/// Answer of elements at `lever_arms_m` to a wave of `carrier_hz` from direction `towards` (a unit vector in
/// their axes), relative to the first one's. A wave reaches an element earlier that is nearer to its source.
pub fn steering(lever_arms_m: &[[f64; 3]], towards: &Vector3<f64>, carrier_hz: f64) -> DVector<Complex64> {
    let first = lever_arms_m.first().copied().unwrap_or_default();
    let each = lever_arms_m.iter().map(|arm| {
        let ahead_m = towards.dot(&(Vector3::from(*arm) - Vector3::from(first)));
        let (sin, cos) = libm::sincos(TAU * carrier_hz / SPEED_OF_LIGHT_MPS * ahead_m);
        planted!("receiver.array.steering", Complex64::new(cos, sin), Complex64::new(cos, -sin))
    });
    DVector::from_iterator(lever_arms_m.len(), each)
}

/// Weights with least power and a gain of 1 for the answer `kept`; `loading` times the covariance's smallest
/// pivot is added to the diagonal. `None` where the covariance has no inverse.
pub fn weights(covariance: &DMatrix<Complex64>, kept: &DVector<Complex64>, loading: f64) -> Option<DVector<Complex64>> {
    let least = Factors::of(covariance)?.pivots.into_iter().fold(f64::INFINITY, f64::min);
    let count = covariance.nrows();
    let loaded = covariance + DMatrix::from_diagonal_element(count, count, Complex64::from(loading * least));
    let solved = Factors::of(&loaded)?.solve(kept);
    let gain = kept.dotc(&solved).re;
    (gain > 0.0).then(|| solved / Complex64::from(gain))
}

/// Factors `L D Lᴴ` of a covariance, L with ones on its diagonal and D real. A pivot is the power of an
/// element that those before it do not have, so the smallest one is about the noise's. Sums, products and
/// quotients alone: the same bits on every processor.
struct Factors {
    lower: DMatrix<Complex64>,
    pivots: Vec<f64>,
}

impl Factors {
    /// Factors of a matrix; `None` where a pivot is lost in rounding, so that there is no inverse.
    fn of(matrix: &DMatrix<Complex64>) -> Option<Self> {
        let count = matrix.nrows();
        let (mut lower, mut pivots) = (DMatrix::<Complex64>::identity(count, count), Vec::with_capacity(count));
        for j in 0..count {
            let own = matrix[(j, j)].re;
            let before = pivots.iter().enumerate().map(|(k, pivot)| pivot * lower[(j, k)].norm_sqr());
            let pivot = own - before.sum::<f64>();
            if !(pivot.is_finite() && pivot > LEAST_SHARE * own) {
                return None;
            }
            for i in j + 1..count {
                let before = pivots.iter().enumerate().map(|(k, pivot)| lower[(i, k)] * lower[(j, k)].conj() * *pivot);
                lower[(i, j)] = (matrix[(i, j)] - before.sum::<Complex64>()) / pivot;
            }
            pivots.push(pivot);
        }
        Some(Self { lower, pivots })
    }

    /// Solution x of `L D Lᴴ x = right`.
    fn solve(&self, right: &DVector<Complex64>) -> DVector<Complex64> {
        let mut x = right.clone();
        let count = x.len();
        for i in 0..count {
            for k in 0..i {
                let below = self.lower[(i, k)] * x[k];
                x[i] -= below;
            }
        }
        x.iter_mut().zip(&self.pivots).for_each(|(x, pivot)| *x /= *pivot);
        for i in (0..count).rev() {
            for k in i + 1..count {
                let above = self.lower[(k, i)].conj() * x[k];
                x[i] -= above;
            }
        }
        x
    }
}
