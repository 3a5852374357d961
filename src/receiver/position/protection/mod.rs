//! Protection levels of a fix: bounds of its horizontal and vertical error that hold with a promised
//! probability, also under faults.
//!
//! Three methods: [`araim`], [`sbas`] and [`raim`]. All take the fix as a linear estimator of its ranges
//! ([`geometry`]), with the receiver's own weights, so that the levels are those of the position in
//! `fixes.csv`. Without `[integrity]` in the settings nothing is computed. Limits: levels are of single
//! epochs; a fix whose residual test left satellites out has the levels of the remaining ones.

pub mod araim;
pub mod geometry;
pub mod normal;
pub mod raim;
pub mod sbas;
mod settings;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector3};
use thiserror::Error;

use super::augmentation::Store;
use super::least_squares::{COORDINATES, Ionosphere, Range, Solution, freedom};
use super::{Solver, chi_square_threshold};
use geometry::Geometry;
use gnss::earth::{Geodetic, look};
use gnss::record::{Fix, IntegrityRow};
use gnss::satellite::{Sv, System};
pub use settings::{IntegritySettings, Method, Operation};

/// Protection levels of one fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// Horizontal protection level.
    pub hpl_m: Option<f64>,
    /// Vertical protection level, of methods and operations that have one.
    pub vpl_m: Option<f64>,
    /// Effective monitor threshold, of method araim.
    pub emt_m: Option<f64>,
    /// Vertical standard deviation for accuracy.
    pub sigma_v_acc_m: Option<f64>,
    /// True if solutions without some of the ranges lie further apart than their thresholds.
    pub is_contradicted: bool,
}

/// Reason for which a fix has no protection levels.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unprotected {
    /// Ranges that give no position by themselves.
    #[error("singular geometry")]
    Singular,
    /// Faults that no test sees are likelier than the promise.
    #[error("unmonitored faults of probability {probability:.1e}: below {promised:.1e} expected")]
    Unmonitored {
        /// Probability of the faults.
        probability: f64,
        /// Probability of misleading information that is promised.
        promised: f64,
    },
    /// A satellite whose error enters no residual.
    #[error("no residual shows a fault of one satellite")]
    Unseen,
    /// A satellite of the fix without a bound of its corrections.
    #[error("no SBAS corrections of {0}")]
    Uncorrected(Sv),
    /// A satellite without a delay of the grid.
    #[error("no SBAS ionosphere for {0}")]
    NoGrid(Sv),
}

/// Standard deviation along the longer axis of a horizontal error ellipse, in metres.
fn major_m(covariance: &DMatrix<f64>) -> f64 {
    let (east, north, both) = (covariance[(0, 0)], covariance[(1, 1)], covariance[(0, 1)]);
    let both = planted!("receiver.sbas.ellipse", both, 0.0);
    (0.5 * (east + north) + libm::hypot(0.5 * (east - north), both)).max(0.0).sqrt()
}

impl Solver {
    /// Gives every fix protection levels by these settings.
    pub fn set_integrity(&mut self, settings: &IntegritySettings) {
        self.integrity = Some(settings.clone());
    }

    /// Protection levels of a fix, where they are asked for.
    pub(super) fn protected(
        &self,
        ranges: &[Range],
        solution: &Solution,
        fix: &Fix,
        ionosphere: &Ionosphere,
    ) -> Option<IntegrityRow> {
        let settings = self.integrity.as_ref()?;
        let store = ranges.first().and_then(|range| self.augmentation.serving(range.emitted));
        let false_alarm = self.settings.false_alarm;
        Some(Fixed { ranges, solution, fix, ionosphere, store, false_alarm }.protect(settings))
    }
}

/// A fix and the ranges that it is made of.
struct Fixed<'a> {
    ranges: &'a [Range],
    solution: &'a Solution,
    fix: &'a Fix,
    /// Ionosphere by which the ranges were corrected.
    ionosphere: &'a Ionosphere,
    /// Messages of the augmentation system that serves, if there is one.
    store: Option<&'a Store>,
    /// Probability that the residual test raises a false alarm.
    false_alarm: f64,
}

impl Fixed<'_> {
    /// Protection levels of the fix as a row.
    fn protect(&self, settings: &IntegritySettings) -> IntegrityRow {
        let found = self.levels(settings);
        let (hpl_m, vpl_m) = found.as_ref().map_or((None, None), |levels| (levels.hpl_m, levels.vpl_m));
        let (emt_m, sigma_m) = found.as_ref().map_or((None, None), |levels| (levels.emt_m, levels.sigma_v_acc_m));
        let has_vertical = settings.method != Method::Sbas || settings.operation == Operation::Approach;
        let above = |value: Option<f64>, limit_m: f64| value.is_some_and(|value_m| value_m > limit_m);
        let reason = match &found {
            Err(reason) => reason.to_string(),
            Ok(levels) if levels.is_contradicted => "solutions contradict each other".to_owned(),
            Ok(_) if above(hpl_m, settings.hal_m) => "HPL above its limit".to_owned(),
            Ok(_) if has_vertical && above(vpl_m, settings.val_m) => "VPL above its limit".to_owned(),
            Ok(_) if above(emt_m, settings.emt_limit_m) => "EMT above its limit".to_owned(),
            Ok(_) if has_vertical && above(sigma_m, settings.sigma_v_acc_limit_m) => {
                "vertical accuracy above its limit".to_owned()
            }
            Ok(_) => String::new(),
        };
        IntegrityRow {
            sample: self.fix.sample,
            gps_s: self.fix.gps_s,
            gps_fraction_s: self.fix.gps_fraction_s,
            method: settings.method.name().to_owned(),
            hpl_m,
            vpl_m,
            emt_m,
            sigma_v_acc_m: sigma_m,
            satellites: self.fix.satellites,
            detected: !self.fix.excluded.is_empty() || found.is_ok_and(|levels| levels.is_contradicted),
            excluded: self.fix.excluded.clone(),
            available: reason.is_empty(),
            reason,
        }
    }

    fn levels(&self, settings: &IntegritySettings) -> Result<Levels, Unprotected> {
        let mut geometry = self.geometry();
        match settings.method {
            Method::Araim => {
                let biases_m = vec![settings.b_nom_m; self.ranges.len()];
                geometry.integrity += self.of_satellites(&geometry, settings.sigma_ura_m);
                geometry.accuracy += self.of_satellites(&geometry, settings.sigma_ure_m);
                araim::levels(&Geometry { biases_m, ..geometry }, settings)
            }
            Method::Sbas => {
                geometry.integrity = self.bounded()?;
                sbas::levels(&geometry, settings.operation == Operation::Approach)
            }
            Method::Raim => {
                let freedom = usize::try_from(freedom(self.ranges)).ok().filter(|freedom| *freedom > 0);
                let threshold = chi_square_threshold(freedom.ok_or(Unprotected::Unseen)?, self.false_alarm);
                let test = raim::Test {
                    threshold,
                    missed_detection: settings.missed_detection,
                    phmi_vertical: settings.phmi_vertical,
                    phmi_horizontal: settings.phmi_horizontal,
                };
                raim::levels(&geometry, &test)
            }
        }
    }

    /// The fix as the receiver solved it. The errors that the ranges have in common, by the ionosphere's
    /// model, are in the covariances.
    fn geometry(&self) -> Geometry {
        let solution = self.solution;
        let axes = Geodetic::from_ecef(&solution.position_m).ecef_to_enu();
        let count = self.ranges.len();
        let mut rows = DMatrix::zeros(count, COORDINATES + solution.clocks.len());
        for (index, (sight, clock)) in solution.sights.iter().zip(&solution.clock_of).enumerate() {
            let enu = axes * sight;
            (0..COORDINATES).for_each(|axis| rows[(index, axis)] = -enu[axis]);
            rows[(index, COORDINATES + clock)] = 1.0;
        }
        let of = |a: usize, b: usize| {
            let own = if a == b { solution.sigmas_m[a] * solution.sigmas_m[a] } else { 0.0 };
            own + solution.commons_m[a].dot(&solution.commons_m[b])
        };
        let covariance = DMatrix::from_fn(count, count, of);
        let raw = |(residual_m, common_m): (&f64, &Vector3<f64>)| residual_m + solution.ionosphere_error.dot(common_m);
        let residuals = solution.residuals_m.iter().zip(&solution.commons_m).map(raw);
        Geometry {
            rows,
            satellites: indices(self.ranges.iter().map(|range| range.sv)),
            constellations: indices(self.ranges.iter().map(|range| range.sv.system)),
            weighting: covariance.clone(),
            integrity: covariance.clone(),
            accuracy: covariance,
            biases_m: vec![0.0; count],
            residuals_m: DVector::from_iterator(count, residuals),
        }
    }

    /// Covariance of errors of this standard deviation that all ranges of a satellite share.
    fn of_satellites(&self, geometry: &Geometry, sigma_m: f64) -> DMatrix<f64> {
        let satellite = &geometry.satellites;
        let of = |a: usize, b: usize| if satellite[a] == satellite[b] { sigma_m * sigma_m } else { 0.0 };
        DMatrix::from_fn(self.ranges.len(), self.ranges.len(), of)
    }

    /// Standard deviation in metres of a range's orbit and clock that the system bounds, and the variance of
    /// its noise. Of a satellite of the system itself the accuracy counts that its type 9 states.
    fn corrected(&self, range: &Range) -> Option<(f64, f64)> {
        let (stated_m, noise_m2) = (range.augmented_m?, range.noise_m * range.noise_m);
        if range.sv.system == System::Sbas {
            return Some((stated_m, noise_m2));
        }
        let bound_m = self.store?.bound_m(range, &self.solution.position_m)?;
        Some((bound_m, (noise_m2 - stated_m * stated_m).max(0.0)))
    }

    /// Covariance that SBAS bounds: corrections, ionosphere, receiver and multipath, troposphere.
    fn bounded(&self) -> Result<DMatrix<f64>, Unprotected> {
        let place_m = &self.solution.position_m;
        let user = Geodetic::from_ecef(place_m);
        let variance = |range: &Range| {
            let (corrected_m, noise_m2) = self.corrected(range).ok_or(Unprotected::Uncorrected(range.sv))?;
            let direction = look(user, place_m, &range.satellite.position_m);
            let delay = match self.ionosphere {
                Ionosphere::Grid(grid, _) => grid.slant_bound_m(user, direction, range.carrier_hz),
                _ => None,
            };
            let delay_m = delay.ok_or(Unprotected::NoGrid(range.sv))?;
            let multipath_m = sbas::multipath_m(direction.elevation_rad);
            let troposphere_m = sbas::troposphere_m(direction.elevation_rad);
            let squares = [corrected_m, delay_m, multipath_m, troposphere_m].map(|sigma_m| sigma_m * sigma_m);
            Ok(noise_m2 + squares.iter().sum::<f64>())
        };
        let variances = self.ranges.iter().map(variance).collect::<Result<Vec<f64>, Unprotected>>()?;
        Ok(DMatrix::from_diagonal(&DVector::from_vec(variances)))
    }
}

/// Index of each value among the different ones.
fn indices<T: Ord + Copy>(values: impl Iterator<Item = T>) -> Vec<usize> {
    let mut known: BTreeMap<T, usize> = BTreeMap::new();
    values
        .map(|value| {
            let next = known.len();
            *known.entry(value).or_insert(next)
        })
        .collect()
}
