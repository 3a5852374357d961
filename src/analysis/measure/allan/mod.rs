//! Stability of a clock from its phase: Allan's family of deviations with their confidence.
//!
//! Source: W. J. Riley, Handbook of Frequency Stability Analysis, NIST Special Publication 1065 (2008),
//! section 5.2. Input is phase, the reading minus the true time, in seconds on an even grid without gaps; a
//! constant offset and rate of it change nothing. Every estimate takes one pass over the data. [`noise`]
//! identifies the noise type, [`freedom`] the confidence, [`fit`] the strengths. Limits: no drift is removed;
//! the total deviation's bias is not corrected.

pub mod fit;
pub mod freedom;
pub mod noise;

use freedom::Estimator;

pub use crate::expect::theory::clock::Deviation;

/// A deviation as estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Dimensionless; in seconds for the time deviation.
    pub deviation: f64,
    /// Differences that went into it.
    pub terms: usize,
}

impl Deviation {
    fn estimator(self) -> Estimator {
        let (order, modified, overlapped) = match self {
            Self::Adev => (2, false, false),
            Self::Oadev | Self::Totdev => (2, false, true),
            Self::Mdev | Self::Tdev => (2, true, true),
            Self::Hdev => (3, false, false),
            Self::Ohdev => (3, false, true),
        };
        Estimator { order, modified, overlapped }
    }

    /// Estimates at `m` steps of `tau0_s` from phases `x` in seconds; `None` if no difference fits.
    pub fn estimate(self, x: &[f64], tau0_s: f64, m: usize) -> Option<Estimate> {
        if m == 0 {
            return None;
        }
        let tau_s = m as f64 * tau0_s;
        let (square, terms) = match self {
            Self::Adev => mean_square(second_differences(x, m).step_by(m)),
            Self::Oadev => mean_square(second_differences(x, m)),
            Self::Mdev | Self::Tdev => mean_square(averages(&second_differences(x, m).collect::<Vec<_>>(), m)),
            Self::Hdev => mean_square(third_differences(x, m).step_by(m)),
            Self::Ohdev => mean_square(third_differences(x, m)),
            Self::Totdev => mean_square(reflected_differences(x, m)),
        }?;
        let allan = || (square / planted!("analysis.allan.half", 2.0, 1.0)).sqrt() / tau_s;
        let deviation = match self {
            Self::Adev | Self::Oadev | Self::Mdev | Self::Totdev => allan(),
            Self::Tdev => tau_s / 3.0_f64.sqrt() * allan(),
            Self::Hdev | Self::Ohdev => (square / 6.0).sqrt() / tau_s,
        };
        Some(Estimate { deviation, terms })
    }

    /// Differences τ apart that `count` phases hold: the independent ones.
    fn independent(self, count: usize, m: usize) -> usize {
        let Estimator { order, modified, .. } = self.estimator();
        let span = order * m + if modified { m } else { 1 };
        count.checked_sub(span).map_or(0, |rest| 1 + rest / m)
    }
}

fn mean_square(values: impl Iterator<Item = f64>) -> Option<(f64, usize)> {
    let (sum, terms) = values.fold((0.0, 0), |(sum, terms), value| (sum + value * value, terms + 1));
    (terms > 0).then(|| (sum / terms as f64, terms))
}

fn from(x: &[f64], index: usize) -> &[f64] {
    x.get(index..).unwrap_or_default()
}

fn second_differences(x: &[f64], m: usize) -> impl Iterator<Item = f64> + '_ {
    let triples = x.iter().zip(from(x, m)).zip(from(x, 2 * m));
    triples.map(|((a, b), c)| c - 2.0 * b + a)
}

fn third_differences(x: &[f64], m: usize) -> impl Iterator<Item = f64> + '_ {
    let quadruples = x.iter().zip(from(x, m)).zip(from(x, 2 * m)).zip(from(x, 3 * m));
    quadruples.map(|(((a, b), c), d)| d - 3.0 * c + 3.0 * b - a)
}

/// Means of every `m` neighbours, by a running sum.
fn averages(values: &[f64], m: usize) -> impl Iterator<Item = f64> + '_ {
    let first = values.get(..m).map(|head| head.iter().sum::<f64>());
    let steps = from(values, m).iter().zip(values).map(|(new, old)| new - old);
    let sums = steps.scan(first.unwrap_or_default(), |sum, step| {
        *sum += step;
        Some(*sum)
    });
    first.into_iter().chain(sums).map(move |sum| sum / m as f64)
}

/// Second differences about every inner phase of the data mirrored through both end points (SP 1065, section
/// 5.2).
fn reflected_differences(x: &[f64], m: usize) -> impl Iterator<Item = f64> + '_ {
    let count = if m < x.len() { x.len() } else { 0 };
    let before = move |index: usize| match index.checked_sub(m) {
        Some(inside) => x[inside],
        None => 2.0 * x[0] - x[m - index],
    };
    let after = move |index: usize| match (index + m).checked_sub(count) {
        None => x[index + m],
        Some(beyond) => 2.0 * x[count - 1] - x[count - 2 - beyond],
    };
    (1..count.saturating_sub(1)).map(move |index| after(index) - 2.0 * x[index] + before(index))
}

/// 1, 2, 4, 8 … up to `longest`.
pub fn octaves(longest: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(1_usize), |m| m.checked_mul(2)).take_while(move |m| *m <= longest)
}

/// 1, 2, 4 in each decade up to `longest`.
pub fn decades(longest: usize) -> impl Iterator<Item = usize> {
    let starts = std::iter::successors(Some(1_usize), |start| start.checked_mul(10));
    let all = starts.flat_map(|start| [1, 2, 4].map(|k| start.saturating_mul(k)));
    all.take_while(move |m| *m <= longest)
}

/// A deviation at one averaging time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Averaging time in steps of the grid.
    pub m: usize,
    /// Averaging time, seconds.
    pub tau_s: f64,
    /// Dimensionless; in seconds for the time deviation.
    pub deviation: f64,
    /// Differences that went into it.
    pub terms: usize,
    /// Exponent of the noise that dominates, S_y ∝ f^α, if it can be identified.
    pub alpha: Option<i32>,
    /// Equivalent degrees of freedom in that noise.
    pub freedom: Option<f64>,
    /// Lower and upper bound of the true deviation.
    pub interval: Option<(f64, f64)>,
}

/// Fewest differences τ apart that make a point: Allan's τ then ends at a quarter of the record.
const INDEPENDENT: usize = 3;
/// A deviation this small times rounding is rounding: phases are right to a few units in the last place.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A deviation over averaging factors, each with the interval that contains the true one with probability
/// `confidence`.
///
/// A factor that leaves fewer than three independent differences, or a deviation that rounding alone would
/// give, is left out. Where too few phases remain to identify the noise, it is taken to be that of the factor
/// before.
pub fn curve(
    deviation: Deviation,
    x: &[f64],
    tau0_s: f64,
    factors: impl IntoIterator<Item = usize>,
    confidence: f64,
) -> Vec<Point> {
    let estimator = deviation.estimator();
    let rounding_s = ROUNDING * x.iter().fold(0.0_f64, |most, phase| most.max(phase.abs()));
    let mut alpha = None;
    let mut points = Vec::new();
    for m in factors.into_iter().filter(|m| *m > 0 && deviation.independent(x.len(), *m) >= INDEPENDENT) {
        let Some(estimate) = deviation.estimate(x, tau0_s, m) else { continue };
        let tau_s = m as f64 * tau0_s;
        let phase_s = if deviation == Deviation::Tdev { estimate.deviation } else { estimate.deviation * tau_s };
        let resolved = phase_s > rounding_s;
        if !resolved {
            continue;
        }
        alpha = noise::identify(x, m, estimator.order).or(alpha);
        let known = alpha.and_then(|alpha| {
            let total = deviation == Deviation::Totdev && m >= freedom::TOTAL_FROM;
            let published = if total { freedom::total(alpha, (x.len() - 1) as f64 / m as f64) } else { None };
            published.or(freedom::degrees_of_freedom(estimator, alpha, m, x.len()).map(|freedom| (freedom, 1.0)))
        });
        let interval = known.and_then(|(freedom, bias)| {
            let (low, high) = freedom::interval(freedom, confidence)?;
            let unbiased = estimate.deviation / bias.sqrt();
            Some((low * unbiased, high * unbiased))
        });
        points.push(Point {
            m,
            tau_s,
            deviation: estimate.deviation,
            terms: estimate.terms,
            alpha,
            freedom: known.map(|(freedom, _)| freedom),
            interval,
        });
    }
    points
}

#[cfg(test)]
mod tests;
