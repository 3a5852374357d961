//! Identification of the power-law noise that dominates at an averaging time.
//!
//! Source: W. J. Riley and C. A. Greenhall, "Power law noise identification using the lag 1 autocorrelation",
//! 18th EFTF (2004), which NIST SP 1065 repeats in section 5.5. Phase is taken every τ and differenced until
//! it is stationary. The lag-1 autocorrelation then gives the exponent. Limits: one noise a τ, at least
//! [`FEWEST`] phases, drift not removed.

/// Fewest phases at the spacing of τ from which a noise is identified.
pub const FEWEST: usize = 30;

/// Exponent α of S_y ∝ f^α at averaging factor `m`, rounded to the nearest noise for which a variance of that
/// difference order (2 or 3) exists: at most 2, at least 2 − 2 order. `None` with too few phases, or none
/// that differ.
pub fn identify(x: &[f64], m: usize, order: usize) -> Option<i32> {
    let mut z: Vec<f64> = x.iter().step_by(m.max(1)).copied().collect();
    if z.len() < FEWEST {
        return None;
    }
    let mut differences = 0;
    loop {
        let r = lag_one(&z)?;
        let delta = r / (1.0 + r);
        if delta < 0.25 || differences == order {
            let alpha = 2.0 - 2.0 * (delta + differences as f64);
            let lowest = 2.0 - 2.0 * order as f64;
            return Some(alpha.round().clamp(lowest, 2.0) as i32);
        }
        z = z.windows(2).map(|pair| pair[1] - pair[0]).collect();
        differences += 1;
    }
}

/// Autocorrelation at lag 1; `None` if nothing varies.
fn lag_one(z: &[f64]) -> Option<f64> {
    let mean = z.iter().sum::<f64>() / z.len() as f64;
    let square: f64 = z.iter().map(|value| (value - mean) * (value - mean)).sum();
    let product: f64 = z.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
    (square > 0.0).then(|| product / square)
}
