//! Consistency of fixes with the covariance that the receiver states: normalised error squared (NEES).
//!
//! With e the error of a fix east, north, up and P the covariance that the receiver states, eᵀP⁻¹e is
//! chi-square of three degrees if P is right (Bar-Shalom, Li and Kirubarajan 2001, 5.4). Its mean is then 3.
//! Fixes of smoothed ranges are correlated. The mean of n of them is therefore compared with the band of n'
//! *independent* ones. The number n' follows from the autocorrelation of L⁻¹e, P = LLᵀ, about zero, so that a
//! lasting error counts once. Limits: with a window of smoothing as long as the run there are few, and the
//! band is wide. A fix without a formal covariance is left out.

use nalgebra::{Cholesky, Matrix3};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::error::JudgeError;
use crate::measure::errors::Errors;
use crate::measure::independent::Correlated;
use crate::read::spill_store::{SpillRow, Words};
use crate::read::{Run, Table};
use crate::statistics::Sum;
use gnss::record::Fix;

/// Degrees of freedom of one fix.
pub const FREEDOM: f64 = 3.0;
/// Probability with which the mean of a consistent receiver lies within the band.
pub const CONFIDENCE: f64 = 0.95;

/// Result of the comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Calibration {
    /// The mean lies within the band.
    #[serde(rename = "consistent")]
    Consistent,
    /// Mean above the band: errors are larger than the receiver reports.
    Optimistic,
    /// Mean below the band: errors are smaller than the receiver reports.
    Pessimistic,
}

impl Calibration {
    /// Name of the result in `summary.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Optimistic => "optimistic",
            Self::Pessimistic => "pessimistic",
        }
    }
}

/// One fix: a row of `consistency.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NormalisedError {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Error to the east, metres.
    pub east_m: f64,
    /// Error to the north, metres.
    pub north_m: f64,
    /// Error upward, metres.
    pub up_m: f64,
    /// Standard deviation to the east that the receiver states, metres.
    pub sigma_east_m: f64,
    /// Standard deviation to the north that the receiver states, metres.
    pub sigma_north_m: f64,
    /// Standard deviation upward that the receiver states, metres.
    pub sigma_up_m: f64,
    /// Normalised error squared.
    pub nees: f64,
}

impl SpillRow<()> for NormalisedError {
    const WORDS: usize = 9;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.time_s.to_bits()]);
        words.extend([self.east_m, self.north_m, self.up_m].map(f64::to_bits));
        words.extend([self.sigma_east_m, self.sigma_north_m, self.sigma_up_m, self.nees].map(f64::to_bits));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        Self {
            sample: words.word(),
            time_s: words.number(),
            east_m: words.number(),
            north_m: words.number(),
            up_m: words.number(),
            sigma_east_m: words.number(),
            sigma_north_m: words.number(),
            sigma_up_m: words.number(),
            nees: words.number(),
        }
    }
}

/// A run's covariance against its errors.
#[derive(Debug)]
pub struct Consistency {
    /// Every fix that states a covariance.
    pub rows: Table<NormalisedError>,
    /// Mean of the normalised errors squared; 3 where the covariance is right.
    pub nees_mean: Option<f64>,
    /// Number of independent fixes that the mean is worth.
    pub independent: Option<f64>,
    /// Ends of the 95 % band of the mean.
    pub band: Option<(f64, f64)>,
    /// Result of the comparison of the mean with the band.
    pub verdict: Option<Calibration>,
    /// Share of east, north and up errors within twice their sigma; 0.954 of normal ones.
    pub within_two_sigma: Option<f64>,
}

/// Share of normal errors within two standard deviations.
pub const TWO_SIGMA_SHARE: f64 = 0.954_499_736;

impl Consistency {
    /// Measures it.
    ///
    /// # Errors
    /// [`JudgeError`] where rows cannot be read or put away.
    pub fn measure(run: &Run, errors: &Errors) -> Result<Self, JudgeError> {
        let mut fixes = run.fixes.finder()?;
        let (mut rows, mut white) = (Table::new(errors.positions.directory()), [Vec::new(), Vec::new(), Vec::new()]);
        let [mut squares, mut within] = [Sum::default(); 2];
        for error in errors.positions.cursor() {
            let error = error?;
            let Some(fix) = fixes.get(error.sample) else { continue };
            let Some(factor) = factor(&fix) else { continue };
            let Some(whitened) = factor.l().solve_lower_triangular(&error.enu_m) else { continue };
            let row = NormalisedError {
                sample: error.sample,
                time_s: error.time_s,
                east_m: error.enu_m.x,
                north_m: error.enu_m.y,
                up_m: error.enu_m.z,
                sigma_east_m: fix.sigma_east_m,
                sigma_north_m: fix.sigma_north_m,
                sigma_up_m: fix.sigma_up_m,
                nees: whitened.norm_squared(),
            };
            squares.add(row.nees);
            let axes = [(row.east_m, row.sigma_east_m), (row.north_m, row.sigma_north_m), (row.up_m, row.sigma_up_m)];
            for (error, sigma) in axes {
                within.add(if error.abs() <= 2.0 * sigma { 1.0 } else { 0.0 });
            }
            rows.push(row)?;
            for (axis, value) in white.iter_mut().zip(whitened.iter()) {
                axis.push(*value);
            }
        }
        let nees_mean = squares.mean();
        // The three axes are three series of one kind; each holds a third of the values.
        let independent = Correlated::about_zero(&white).map(|found| (found.independent() / FREEDOM).max(1.0));
        let band = independent.and_then(band);
        let verdict = nees_mean.zip(band).map(|(mean, (low, high))| match mean {
            mean if mean > high => Calibration::Optimistic,
            mean if mean < low => Calibration::Pessimistic,
            _ => Calibration::Consistent,
        });
        Ok(Self { rows, nees_mean, independent, band, verdict, within_two_sigma: within.mean() })
    }
}

/// Band of the mean of so many independent values of chi-square with three degrees.
fn band(independent: f64) -> Option<(f64, f64)> {
    let law = ChiSquared::new(FREEDOM * independent).ok()?;
    let tail = 0.5 * (1.0 - CONFIDENCE);
    Some((law.inverse_cdf(tail) / independent, law.inverse_cdf(1.0 - tail) / independent))
}

/// Cholesky factor of a fix's formal covariance.
fn factor(fix: &Fix) -> Option<Cholesky<f64, nalgebra::Const<3>>> {
    let (e, n, u) = (fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m);
    let (e, n, u) = planted!("analysis.consistency.axes", (e, n, u), (u, n, e));
    let (en, eu, nu) = (fix.correlation_en * e * n, fix.correlation_eu * e * u, fix.correlation_nu * n * u);
    Cholesky::new(Matrix3::new(e * e, en, eu, en, n * n, nu, eu, nu, u * u))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::independent::tests::Draw;

    #[test]
    fn bands_are_those_of_the_tables() {
        // Chi-square, 2.5 and 97.5 %: 3 degrees 0.2158 and 9.3484; 30 degrees 16.791 and 46.979 over ten.
        let one = band(1.0).unwrap();
        assert!((one.0 - 0.2158).abs() < 1e-4 && (one.1 - 9.3484).abs() < 1e-4, "{one:?}");
        let ten = band(10.0).unwrap();
        assert!((ten.0 - 1.6791).abs() < 1e-4 && (ten.1 - 4.6979).abs() < 1e-4, "{ten:?}");
    }

    #[test]
    fn the_band_holds_a_consistent_receiver_as_often_as_it_says_though_its_errors_remember() {
        let mut draw = Draw(2);
        let held = (0..300)
            .filter(|_| {
                let white: [Vec<f64>; 3] = std::array::from_fn(|_| draw.remembering(0.95, 1000));
                let nees: f64 = white.iter().flatten().map(|x| x * x).sum::<f64>() / 1000.0;
                let (low, high) = band(Correlated::about_zero(&white).unwrap().independent() / 3.0).unwrap();
                (low..=high).contains(&nees)
            })
            .count();
        // 0.95 of 300 is 285 ± 3·3.8; the estimate of the autocorrelation from 50 independent values a series
        // costs some per cent. Without it (1000 independent fixes) the band would hold 40 %.
        assert!((262..=300).contains(&held), "{held}");
    }
}
