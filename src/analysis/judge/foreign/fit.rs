//! A slope through the origin of points that come in clusters, with an error that does not believe in their
//! independence.
//!
//! A satellite's errors share multipath, filters and everything else that lasts, so that a thousand epochs of
//! one satellite say little more than one. The variance sums each cluster's contribution before it is squared
//! (Liang and Zeger 1986), times c/(c−1) for c clusters. Limits: with few clusters the error is itself
//! uncertain by 1/√(2c).

use std::collections::BTreeMap;

/// A number and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Standard deviation of the value.
    pub sigma: f64,
}

impl Estimate {
    /// True if the value differs from `from` by more than three standard deviations.
    pub fn differs_from(&self, from: f64) -> bool {
        (self.value - from).abs() > 3.0 * self.sigma
    }
}

/// Slope of y over x, both free of their common parts already; points are (cluster, x, y).
///
/// `None` of fewer than two clusters, or where x does not vary.
pub fn slope<K: Ord + Copy>(points: &[(K, f64, f64)]) -> Option<Estimate> {
    let square: f64 = points.iter().map(|(_, x, _)| x * x).sum();
    if square <= 0.0 || !square.is_finite() {
        return None;
    }
    let value = points.iter().map(|(_, x, y)| x * y).sum::<f64>() / square;
    let mut clusters: BTreeMap<K, f64> = BTreeMap::new();
    for (key, x, y) in points {
        *clusters.entry(*key).or_insert(0.0) += x * (y - value * x);
    }
    let count = clusters.len() as f64;
    if count < 2.0 {
        return None;
    }
    let squares: f64 = clusters.values().map(|sum| sum * sum).sum();
    Some(Estimate { value, sigma: (squares * count / (count - 1.0)).sqrt() / square })
}

/// Mean of cluster means, and its standard deviation from their scatter; `None` of fewer than two clusters.
pub fn mean_of_means(means: &[f64]) -> Option<Estimate> {
    let count = means.len() as f64;
    if means.len() < 2 {
        return None;
    }
    let value = means.iter().sum::<f64>() / count;
    let squares: f64 = means.iter().map(|mean| (mean - value) * (mean - value)).sum();
    Some(Estimate { value, sigma: (squares / (count - 1.0) / count).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::independent::tests::Draw;

    #[test]
    fn three_sigma_hold_the_slope_though_clusters_have_offsets() {
        let mut draw = Draw(7);
        let held = (0..200)
            .filter(|_| {
                let mut points = Vec::new();
                for satellite in 0..10 {
                    let (x, offset) = (draw.normal(), draw.normal());
                    points.extend((0..50).map(|_| (satellite, x, 2.0 * x + offset + 0.1 * draw.normal())));
                }
                !slope(&points).unwrap().differs_from(2.0)
            })
            .count();
        // Of ten clusters, Student's t of nine degrees holds 98.5 % within three, and a cluster's pull on the
        // slope costs another few per cent; errors that took the 500 points for independent would hold about
        // 35 %.
        assert!(held > 180, "{held}");
        assert_eq!(slope(&[(1, 1.0, 2.0), (1, 2.0, 4.0)]), None);
        assert_eq!(slope::<u8>(&[]), None);
    }
}
