//! Velocity and drift at each fix: weighted least squares of the rates of all carriers, with one drift.

use nalgebra::{Cholesky, Matrix4, Vector4};

use super::ranges::Forecast;
use super::unshared::Unshared;

/// Sums over the rates of a fix. Vectors are east, north, up and the drift.
#[derive(Clone, Debug)]
pub(super) struct Rates {
    normal: Matrix4<f64>,
    noise: Matrix4<f64>,
    bias: Vector4<f64>,
    /// Weights of each signal's satellites.
    of_signals: Vec<Vector4<f64>>,
}

impl Rates {
    /// No rates yet, of as many signals.
    pub fn new(signals: usize) -> Self {
        let of_signals = vec![Vector4::zeros(); signals];
        Self { normal: Matrix4::zeros(), noise: Matrix4::zeros(), bias: Vector4::zeros(), of_signals }
    }

    /// Adds a range's rate. All systems' times run alike: one drift.
    pub fn add(&mut self, range: &Forecast) {
        let row = Vector4::new(-range.sight.x, -range.sight.y, -range.sight.z, 1.0);
        let outer = row * row.transpose();
        self.normal += range.cn0_hz * outer;
        let spread = range.cn0_hz * range.rate_sigma_mps;
        self.noise += spread * spread * outer;
        self.bias += range.cn0_hz * range.rate_bias_mps * row;
        if let Some(sum) = self.of_signals.get_mut(range.signal) {
            *sum += range.cn0_hz * row;
        }
    }

    /// Covariance of velocity and c times the drift in (m/s)², and largest bias of each in m/s; `None` where
    /// the satellites do not determine them.
    pub fn solved(&self, unshared: &Unshared) -> Option<(Matrix4<f64>, Vector4<f64>)> {
        let inverse = Cholesky::new(self.normal)?.inverse();
        let mut noise = self.noise;
        for (one, of_one) in self.of_signals.iter().enumerate() {
            for (other, of_other) in self.of_signals.iter().enumerate() {
                noise += unshared.between(one, other) * of_one * of_other.transpose();
            }
        }
        Some((inverse * noise * inverse, 2.0 * (inverse * self.bias).abs()))
    }
}
