//! Weights of an array's elements from their covariance.
//!
//! Least power `wᴴRw` with `wᴴa = 1` has `w = R⁻¹a / (aᴴR⁻¹a)` (Capon 1969; van Trees 2002, section 6.2).
//! With a the answer to a wave from one direction that is MVDR; with a = (1, 0, …) it is power inversion
//! (Compton 1979). A signal of power P then has the SINR `P aᴴR⁻¹a`, R without the signal.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};
use num_complex::Complex64;

use gnss::earth::SPEED_OF_LIGHT_MPS;

/// Smallest eigenvalue of a covariance that is inverted, as a share of the mean of its diagonal.
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

/// Weights with least power and a gain of 1 for the answer `kept`; `loading` times the smallest eigenvalue is
/// added to the diagonal. `None` where the covariance has no inverse.
pub fn weights(covariance: &DMatrix<Complex64>, kept: &DVector<Complex64>, loading: f64) -> Option<DVector<Complex64>> {
    let count = covariance.nrows();
    let eigenvalues = covariance.clone().symmetric_eigenvalues();
    let least = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    let mean = covariance.trace().re / count.max(1) as f64;
    if !(least.is_finite() && least > LEAST_SHARE * mean) {
        return None;
    }
    let loaded = covariance + DMatrix::from_diagonal_element(count, count, Complex64::from(loading * least));
    let solved = Cholesky::new(loaded)?.solve(kept);
    let gain = kept.dotc(&solved);
    (gain.re > 0.0).then(|| solved / Complex64::from(gain.re))
}
