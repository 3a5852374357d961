//! Estimates from repetitions: a mean, and the interval that contains the true one with 95 % confidence.
//!
//! Numbers use Student's t. Figures that are 0 or 1 in every repetition (held, detected) use Wilson's score
//! interval (1927). Its coverage does not collapse at 0 and 1, as that of the normal approximation does.
//! Repetitions are independent by their seeds.

/// Mean and 95 % interval of a figure over the repetitions of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Repetitions that have a value.
    pub count: u64,
    /// Mean of the cases.
    pub mean: f64,
    /// `None` for one repetition.
    pub interval: Option<(f64, f64)>,
}

/// Two-sided 95 % point of Student's t for 1 to 30 degrees of freedom (e.g. NIST/SEMATECH e-Handbook,
/// 1.3.6.7.2).
const T95: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
    2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];
const NORMAL95: f64 = 1.959_964;

/// Quantile of Student's t. Beyond the table it is the first two terms of the expansion in 1/ν (Abramowitz
/// and Stegun 26.7.5), within 1e-4.
fn t95(freedom: usize) -> f64 {
    let (z, v) = (NORMAL95, freedom as f64);
    let (z3, z5) = (z * z * z, z * z * z * z * z);
    let beyond = z + (z3 + z) / (4.0 * v) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * v * v);
    freedom.checked_sub(1).and_then(|index| T95.get(index)).copied().unwrap_or(beyond)
}

impl Estimate {
    /// Estimate from the values, in their order; `None` without values.
    pub fn of(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let interval = if values.len() < 2 {
            None
        } else if values.iter().all(|x| *x == 0.0 || *x == 1.0) {
            let z2 = NORMAL95 * NORMAL95;
            let middle = (mean + z2 / (2.0 * n)) / (1.0 + z2 / n);
            let half = NORMAL95 * (mean * (1.0 - mean) / n + z2 / (4.0 * n * n)).sqrt() / (1.0 + z2 / n);
            Some(((middle - half).max(0.0), (middle + half).min(1.0)))
        } else {
            let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
            let half = t95(values.len() - 1) * (squares / (n - 1.0) / n).sqrt();
            Some((mean - half, mean + half))
        };
        Some(Self { count: values.len() as u64, mean, interval })
    }

    /// Half the interval's length, relative to the mean.
    pub fn relative_half(&self) -> Option<f64> {
        self.interval.map(|(low, high)| 0.5 * (high - low) / self.mean.abs())
    }
}
