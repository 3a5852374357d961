//! Information in a series of correlated errors: independent values, intervals of a spread, a test of
//! normality.
//!
//! Errors of loops and of smoothed fixes are correlated, so that n of them count as fewer. With ρ the
//! autocorrelation, a mean square of n normal values varies like one of n/(1 + 2Σρ²) independent ones
//! (Bartlett 1946), a mean like one of n/(1 + 2Σρ). Sums run to the first lag whose ρ is not positive,
//! because later values are mostly the noise of the estimate. Limits: even spacing within a group. Processes
//! that ring need another cut.

/// Largest number of lags looked at.
const MOST_LAGS: usize = 4096;
/// Factor of 95 % of a normal law.
const TWO_SIDED_95: f64 = 1.959_963_984_540_054;

/// Several segments of one kind of error, evenly spaced in each, with their common autocorrelation.
#[derive(Clone, Debug, PartialEq)]
pub struct Correlated {
    /// Values in all.
    pub count: usize,
    /// Autocovariance from lag 0 up to the last positive one.
    covariance: Vec<f64>,
}

impl Correlated {
    /// Autocovariance about zero: where an error's mean ought to be nothing, a lasting one is a part of the
    /// error.
    pub fn about_zero(groups: &[Vec<f64>]) -> Option<Self> {
        let count: usize = groups.iter().map(Vec::len).sum();
        let longest = groups.iter().map(Vec::len).max()?;
        let mut covariance = Vec::new();
        for lag in 0..longest.min(MOST_LAGS) {
            let product =
                |group: &Vec<f64>| group.iter().zip(group.get(lag..).unwrap_or(&[])).map(|(a, b)| a * b).sum::<f64>();
            let value = groups.iter().map(product).sum::<f64>() / count as f64;
            if value <= 0.0 || !value.is_finite() {
                break;
            }
            covariance.push(value);
        }
        (!covariance.is_empty()).then_some(Self { count, covariance })
    }

    /// Autocovariance of each group about its own mean.
    pub fn about_means(groups: &[Vec<f64>]) -> Option<Self> {
        let centred: Vec<Vec<f64>> = groups
            .iter()
            .map(|group| {
                let middle = group.iter().sum::<f64>() / group.len().max(1) as f64;
                group.iter().map(|value| value - middle).collect()
            })
            .collect();
        Self::about_zero(&centred)
    }

    /// Σρᵏ over all lags, both signs.
    fn sum_of_powers(&self, power: i32) -> f64 {
        let variance = self.covariance.first().copied().unwrap_or(1.0);
        self.covariance.iter().skip(1).fold(1.0, |sum, value| sum + 2.0 * (value / variance).powi(power))
    }

    /// Mean square.
    pub fn variance(&self) -> f64 {
        self.covariance.first().copied().unwrap_or(0.0)
    }

    /// Independent values that would fix a mean square as well; at least one.
    pub fn independent(&self) -> f64 {
        (self.count as f64 / self.sum_of_powers(2)).max(1.0)
    }

    /// Independent values that would fix a mean as well; at least one.
    pub fn independent_of_mean(&self) -> f64 {
        (self.count as f64 / self.sum_of_powers(1)).max(1.0)
    }

    /// Half width of the 95 % interval of the standard deviation, relative to it: 1.96/√(2n).
    pub fn relative_interval(&self) -> f64 {
        TWO_SIDED_95 / (2.0 * self.independent()).sqrt()
    }

    /// Probability of such a skewness and kurtosis, or larger, if these values were normal: the test of
    /// Jarque and Bera with the variances that correlation gives them (Lobato and Velasco 2004), chi-square
    /// of two degrees. `None` of fewer than 20 values.
    pub fn normality(&self, values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
        let n = self.count as f64;
        let middle = values.clone().sum::<f64>() / n;
        let moment = |k: i32| values.clone().map(|value| (value - middle).powi(k)).sum::<f64>() / n;
        let (m2, m3, m4) = (moment(2), moment(3), moment(4));
        if self.count < 20 || m2 <= 0.0 {
            return None;
        }
        let skew = n * m3 * m3 / (6.0 * self.sum_of_powers(3) * m2.powi(3));
        let peak = n * (m4 - 3.0 * m2 * m2).powi(2) / (24.0 * self.sum_of_powers(4) * m2.powi(4));
        Some(libm::exp(-0.5 * (skew + peak)))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Normal draws: a congruential generator (Knuth's multiplier) and the sum of twelve uniforms.
    pub(crate) struct Draw(pub u64);

    impl Draw {
        pub(crate) fn normal(&mut self) -> f64 {
            let uniform = |state: &mut u64| {
                *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (*state >> 11) as f64 / (1_u64 << 53) as f64
            };
            (0..12).map(|_| uniform(&mut self.0)).sum::<f64>() - 6.0
        }

        /// First-order process of unit variance.
        pub(crate) fn remembering(&mut self, rho: f64, count: usize) -> Vec<f64> {
            let mut value = self.normal();
            (0..count)
                .map(|_| {
                    value = rho * value + (1.0 - rho * rho).sqrt() * self.normal();
                    value
                })
                .collect()
        }
    }

    #[test]
    fn a_process_that_remembers_counts_as_theory_says() {
        // ρ^|k|: 1 + 2Σρ²ᵏ = (1+ρ²)/(1−ρ²), 1 + 2Σρᵏ = (1+ρ)/(1−ρ).
        let mut draw = Draw(3);
        let rho: f64 = 0.9;
        let groups: Vec<Vec<f64>> = (0..20).map(|_| draw.remembering(rho, 5000)).collect();
        let found = Correlated::about_zero(&groups).unwrap();
        let square = (1.0 + rho * rho) / (1.0 - rho * rho);
        let mean = (1.0 + rho) / (1.0 - rho);
        // 100 000 values, 10 500 and 5 300 independent ones: 1 to 2 % of each lag's estimate; bar 10 %.
        assert!((found.independent() * square / 1e5 - 1.0).abs() < 0.1, "{}", found.independent());
        assert!((found.independent_of_mean() * mean / 1e5 - 1.0).abs() < 0.1, "{}", found.independent_of_mean());
        assert!((found.variance() - 1.0).abs() < 0.04);
    }

    #[test]
    fn normal_draws_pass_as_often_as_they_should_and_uniform_ones_do_not() {
        let mut draw = Draw(11);
        let passed = (0..200)
            .filter(|_| {
                let values = draw.remembering(0.6, 2000);
                let centred = Correlated::about_zero(std::slice::from_ref(&values)).unwrap();
                centred.normality(values.iter().copied()).unwrap() > 0.05
            })
            .count();
        // Binomial of 200 at 95 %: 190 ± 3·3.1; the sum of twelve uniforms has itself a kurtosis of 2.9.
        assert!((178..=200).contains(&passed), "{passed}");
        let mut state = Draw(5);
        let flat: Vec<f64> = (0..2000)
            .map(|_| {
                let x = state.normal();
                x - x.round()
            })
            .collect();
        let found = Correlated::about_zero(std::slice::from_ref(&flat)).unwrap();
        assert!(found.normality(flat.iter().copied()).unwrap() < 1e-6);
    }

    #[test]
    fn nothing_says_nothing() {
        assert_eq!(Correlated::about_zero(&[]), None);
        assert_eq!(Correlated::about_zero(&[vec![]]), None);
        assert_eq!(Correlated::about_means(&[vec![2.0, 2.0]]), None);
    }
}
