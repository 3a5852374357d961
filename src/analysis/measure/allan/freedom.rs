//! Equivalent degrees of freedom of a stability estimate, and the confidence interval that follows.
//!
//! Source: C. A. Greenhall and W. J. Riley, "Uncertainty of stability variances based on finite differences",
//! 35th PTTI (2003), which NIST SP 1065 repeats in section 5.4; in full, without its shortcuts: the sum has
//! (order + 1) m terms. An estimate is the mean of squares of a stationary sequence whose covariance the
//! noise type fixes; its edf is 2 mean²/variance, and edf × estimate/truth is nearly χ². They take each phase
//! as a mean over τ₀; here it is a reading at an instant, which matters below m = 10 (at m = 1 in white
//! frequency noise, theirs is 17 % too many).

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Form of an estimator's differences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimator {
    /// Order of the phase difference: 2 for Allan's variances, 3 for Hadamard's.
    pub order: usize,
    /// True if phase is averaged over τ first.
    pub modified: bool,
    /// True if a difference starts at every sample, false if only every τ.
    pub overlapped: bool,
}

/// Averaging factor up to which a mean of samples is summed; above, a mean over continuous time replaces it,
/// whose covariance differs by less than 1/m².
const SUMMED: usize = 64;

/// Equivalent degrees of freedom of a variance from `count` phases at averaging factor `m`, in noise S_y ∝
/// f^α.
///
/// `None` if the variance does not exist (α ≤ 1 − 2 order) or no difference fits.
pub fn degrees_of_freedom(estimator: Estimator, alpha: i32, m: usize, count: usize) -> Option<f64> {
    let Estimator { order, modified, overlapped } = estimator;
    if alpha + 2 * order as i32 <= 1 || !(-4..=2).contains(&alpha) || m == 0 {
        return None;
    }
    let span = order * m + if modified { m } else { 1 };
    let stride = if overlapped { m } else { 1 };
    let terms = 1 + stride * count.checked_sub(span)? / m;
    let filter = match (modified, alpha > 0 || m > SUMMED) {
        (true, true) => Filter::Mean { steps: 1.0 },
        (true, false) => Filter::Sum(m),
        // Phase noises exist only below a cutoff, here that of a mean over τ₀; sampled white phase noise is
        // just that.
        (false, _) if alpha > 0 => Filter::Mean { steps: m as f64 },
        (false, _) => Filter::Sum(1),
    };
    let squared = |lag: usize| {
        let covariance = differenced(lag as f64 / stride as f64, order, filter, alpha);
        covariance * covariance
    };
    // Differences further apart than their span hardly know of each other.
    let last = terms.min((order + 1) * stride);
    let weight = |lag: usize| 1.0 - lag as f64 / terms as f64;
    let ends = squared(0) + weight(last) * squared(last);
    let between: f64 = (1..last).map(|lag| weight(lag) * squared(lag)).sum();
    Some(terms as f64 * squared(0) / (ends + 2.0 * between))
}

/// Filter that averages the phase; the unit of time is τ.
#[derive(Clone, Copy)]
enum Filter {
    /// A mean over continuous time of 1/steps.
    Mean { steps: f64 },
    /// Samples in τ that are added up; one is the phase itself.
    Sum(usize),
}

/// Generalised autocovariance of the integral of phase, its constant left out: |t|^(3 − α), with ln |t| for
/// odd α.
fn integral(t: f64, alpha: i32) -> f64 {
    let t = t.abs();
    if t == 0.0 {
        return 0.0;
    }
    let power = t.powi(3 - alpha);
    let size = if alpha % 2 == 0 { power } else { power * libm::log(t) };
    if matches!(alpha, 2 | -1 | -2) { -size } else { size }
}

/// Autocovariance of the phase after the averaging.
fn averaged(t: f64, filter: Filter, alpha: i32) -> f64 {
    match filter {
        Filter::Mean { steps } => {
            let step = 1.0 / steps;
            steps * steps * (2.0 * integral(t, alpha) - integral(t - step, alpha) - integral(t + step, alpha))
        }
        // Phase is to its integral as α + 2 is to α.
        Filter::Sum(count) => {
            let last = count as i32 - 1;
            let pairs = |lag: i32| f64::from(count as i32 - lag.abs());
            (-last..=last).map(|lag| pairs(lag) * integral(t + f64::from(lag) / count as f64, alpha + 2)).sum()
        }
    }
}

/// Autocovariance of the differences of order `order` over τ. The weights are the binomials of twice the
/// order with alternating sign.
fn differenced(t: f64, order: usize, filter: Filter, alpha: i32) -> f64 {
    let weights: &[f64] = match order {
        1 => &[2.0, -1.0],
        2 => &[6.0, -4.0, 1.0],
        _ => &[20.0, -15.0, 6.0, -1.0],
    };
    let at = |lag: f64| averaged(t + lag, filter, alpha);
    let pair = |(lag, weight): (i32, &f64)| {
        let lag = f64::from(lag);
        if lag == 0.0 { weight * at(0.0) } else { weight * (at(lag) + at(-lag)) }
    };
    (0..).zip(weights).map(pair).sum()
}

/// Averaging factor from which [`total`] holds; below, total and overlapping Allan deviation hardly differ,
/// and at m = 1 not at all, where the published 1.5 T/τ is more than twice too many.
pub const TOTAL_FROM: usize = 16;

/// Degrees of freedom of the total deviation over `t_over_tau` averaging times, and its variance's mean in
/// units of the Allan variance; `None` for phase noises, for which nothing is published: those of the
/// overlapping Allan variance serve.
pub fn total(alpha: i32, t_over_tau: f64) -> Option<(f64, f64)> {
    match alpha {
        0 => Some((1.5 * t_over_tau, 1.0)),
        // Bias 1/(3 ln 2).
        -1 => Some((1.17 * t_over_tau - 0.22, 1.0 - 1.0 / (3.0 * std::f64::consts::LN_2 * t_over_tau))),
        -2 => Some((0.93 * t_over_tau - 0.36, 1.0 - 0.75 / t_over_tau)),
        _ => None,
    }
}

/// Factors that take an estimated deviation to the ends of the interval that contains the true one with
/// probability `confidence` (0 to 1, both excluded).
pub fn interval(freedom: f64, confidence: f64) -> Option<(f64, f64)> {
    let tail = (1.0 - confidence) / 2.0;
    let chi_square = ChiSquared::new(freedom).ok().filter(|_| tail > 0.0 && tail < 0.5)?;
    let factor = |p: f64| (freedom / chi_square.inverse_cdf(p)).sqrt();
    Some((factor(1.0 - tail), factor(tail)))
}
