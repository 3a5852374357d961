//! Noise of correlators: pure functions of seed, code, interval and tap.
//!
//! Taps of one replica over one interval have the covariance of the replica with itself; taps far apart are
//! independent. A part of a code period has its part of the period's noise.

use generator::random::Stream;
use gnss::signal::PeakTable;
use num_complex::Complex64;

/// Taps that correlate with each other lie within this of the prompt, in chips.
const NEAR_CHIPS: f64 = 4.0;
/// Taps of one question, at most.
const MOST: usize = 8;
/// Number of the draw that splits a code period.
const SPLIT: u64 = 1 << 40;

/// Standard normal noise of one code period's correlations.
pub(super) struct Noise<'a> {
    /// Stream of the code and the interval.
    pub stream: Stream,
    /// Replica with itself.
    pub own: &'a PeakTable,
}

impl Noise<'_> {
    fn normal(&self, index: u64) -> Complex64 {
        let (re, im) = self.stream.normals(index);
        Complex64::new(re, im)
    }

    /// Adds noise of these deviations a component to sums at taps in chips near the prompt, and at others. Of
    /// a code period the first `share` is taken, and the noise has that variance.
    pub fn add(&self, taps: &[f64], share: f64, [scale, far]: [f64; 2], sums: &mut [Complex64]) {
        let mut order: [usize; MOST] = [0, 1, 2, 3, 4, 5, 6, 7];
        let near = |tap: f64| tap.abs() <= NEAR_CHIPS;
        let order = &mut order[..taps.len().min(MOST)];
        order.sort_by(|a, b| taps[*a].abs().total_cmp(&taps[*b].abs()));
        let power = self.own.value(0.0);
        let mut factors = [[0.0; MOST]; MOST];
        let mut normals = [Complex64::ZERO; MOST];
        for row in 0..order.len() {
            let tap = taps[order[row]];
            if !near(tap) {
                // Whole chips tell such taps apart.
                let noise = self.split(tap.round() as i64 as u64, share);
                sums[order[row]] += far * noise;
                continue;
            }
            let mut left = 1.0;
            for column in 0..row {
                let inner: f64 = (0..column).map(|k| factors[row][k] * factors[column][k]).sum();
                let pivot: f64 = factors[column][column];
                let common = self.own.value(tap - taps[order[column]]) / power;
                factors[row][column] = if pivot > 1e-6 { (common - inner) / pivot } else { 0.0 };
                left -= factors[row][column] * factors[row][column];
            }
            factors[row][row] = f64::max(left, 0.0).sqrt();
            normals[row] = self.split((1 << 32) + row as u64, share);
            let noise: Complex64 = (0..=row).map(|k| normals[k] * factors[row][k]).sum();
            sums[order[row]] += scale * noise;
        }
    }

    /// Noise of the first `share` of a code period: a Brownian bridge to that of the whole.
    fn split(&self, index: u64, share: f64) -> Complex64 {
        let whole = self.normal(index);
        if share >= 1.0 {
            return whole;
        }
        whole * share + self.normal(index ^ SPLIT) * (share * (1.0 - share)).sqrt()
    }
}
