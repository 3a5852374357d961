//! Ionospheric delays that the receiver measured with two bands, against the truth's delays.
//!
//! The truth has a delay on each signal's carrier. The factor (f/1575.42 MHz)² of that carrier converts it to
//! the receiver's. Limits: delays between the receiver's own bands count as its error.

use serde::Serialize;

use crate::error::JudgeError;
use crate::read::{Numbers, Run};
use crate::statistics::Sum;
use gnss::gps::l1ca::L1_CA;
use gnss::record::SkyRow;

/// `ionosphere` in `summary.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ionosphere {
    /// Measurements at samples that the truth has.
    pub count: usize,
    /// Mean of the true delays on 1575.42 MHz.
    pub true_mean_m: f64,
    /// Root mean square of the errors.
    pub error_rms_m: f64,
    /// 95th percentile of the errors' sizes.
    pub error_p95_m: f64,
    /// Root mean square of the standard deviations that the receiver states.
    pub stated_rms_m: f64,
}

impl Ionosphere {
    /// `None` without a measurement.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &Run) -> Result<Option<Self>, JudgeError> {
        let (mut errors_m, [mut true_m, mut stated_m]) =
            (Numbers::new(run.ionosphere.directory()), [Sum::default(); 2]);
        for sv in run.ionosphere.keys() {
            let on_l1 = |row: SkyRow| {
                let ratio = row.link().carrier_hz() / L1_CA.carrier_hz(sv);
                ratio * ratio * row.ionosphere_m
            };
            let Some(mut delays) = run.seen_at(sv)? else { continue };
            for row in run.ionosphere.cursor(sv) {
                let row = row?;
                let Some(delay_m) = delays.get(row.sample).map(on_l1) else { continue };
                errors_m.push(row.delay_m - delay_m)?;
                true_m.add(delay_m);
                stated_m.add(row.sigma_m);
            }
        }
        let figures = (true_m.mean(), errors_m.rms()?, errors_m.size_percentile(0.95)?, stated_m.rms());
        let (Some(true_mean_m), Some(error_rms_m), Some(error_p95_m), Some(stated_rms_m)) = figures else {
            return Ok(None);
        };
        Ok(Some(Self { count: errors_m.len(), true_mean_m, error_rms_m, error_p95_m, stated_rms_m }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::{planted, two_bands};
    use crate::read::Run;

    #[test]
    fn its_figures_are_those_of_the_planted_errors() {
        let run = planted();
        // Of 41 rows two err by a metre, the others by a decimetre either way; true delays are 3 m.
        two_bands(run.path(), |row| match row {
            3 | 30 => 1.0,
            even if even % 2 == 0 => 0.1,
            _ => -0.1,
        });
        let found = Ionosphere::of(&Run::read(run.path()).unwrap()).unwrap().unwrap();
        assert_eq!(found.count, 41);
        assert!((found.true_mean_m - 3.0).abs() < 1e-12 && (found.stated_rms_m - 0.05).abs() < 1e-12, "{found:?}");
        assert!((found.error_p95_m - 0.1).abs() < 1e-12, "{found:?}");
        assert!((found.error_rms_m - ((2.0 + 39.0 * 0.01) / 41.0_f64).sqrt()).abs() < 1e-12, "{found:?}");
    }
}
