//! Fixes with their errors and with what theory expects of them, one after the other and spilled; and so the
//! offsets between their time scales.

use nalgebra::{Matrix3, Matrix4, Vector3};

use super::scales::{Clocks, Scales};
use crate::error::JudgeError;
use crate::judge::forecast::ranges::Scene;
use crate::judge::forecast::solution::{Expected, expected};
use crate::measure::errors::{Errors, PositionError};
use crate::read::Table;
use crate::read::spill_store::{SpillRow, Words};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::Fix;

/// A fix, its error and what was expected of it.
#[derive(Clone)]
pub(super) struct Case {
    pub sample: u64,
    pub fix: Stated,
    pub error: PositionError,
    pub expected: Expected,
    pub drift_mps: f64,
}

/// Statements of a fix about its own accuracy.
#[derive(Clone, Copy)]
pub(super) struct Stated {
    satellites: u32,
    pub sigma_east_m: f64,
    pub sigma_north_m: f64,
    pub sigma_up_m: f64,
    pub sigma_clock_m: f64,
    /// Correlations of east and north, east and up, north and up.
    correlations: [f64; 3],
    /// Dilutions of all unknowns, of the position, of its horizontal and vertical parts, and of the clock.
    dilutions: [f64; 5],
    condition: f64,
}

impl Stated {
    fn of(fix: &Fix) -> Self {
        Self {
            satellites: fix.satellites,
            sigma_east_m: fix.sigma_east_m,
            sigma_north_m: fix.sigma_north_m,
            sigma_up_m: fix.sigma_up_m,
            sigma_clock_m: fix.sigma_clock_m,
            correlations: [fix.correlation_en, fix.correlation_eu, fix.correlation_nu],
            dilutions: [fix.gdop, fix.pdop, fix.hdop, fix.vdop, fix.tdop],
            condition: fix.condition,
        }
    }
}

impl SpillRow<()> for Case {
    const WORDS: usize = 15 + <PositionError as SpillRow<()>>::WORDS + Expected::WORDS;

    fn put(&self, words: &mut Vec<u64>) {
        let fix = &self.fix;
        // The sample is the error's too, and comes first.
        self.error.put(words);
        words.push(u64::from(fix.satellites));
        words.extend([fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m, fix.sigma_clock_m].map(f64::to_bits));
        words.extend(fix.correlations.map(f64::to_bits));
        words.extend(fix.dilutions.map(f64::to_bits));
        words.extend([fix.condition, self.drift_mps].map(f64::to_bits));
        self.expected.put(words);
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let error = PositionError::take((), words);
        // A count was put as such.
        let satellites = u32::try_from(words.word()).unwrap_or(0);
        let [sigma_east_m, sigma_north_m, sigma_up_m, sigma_clock_m] = std::array::from_fn(|_| words.number());
        let (correlations, dilutions) =
            (std::array::from_fn(|_| words.number()), std::array::from_fn(|_| words.number()));
        let (condition, drift_mps) = (words.number(), words.number());
        let fix = Stated {
            satellites,
            sigma_east_m,
            sigma_north_m,
            sigma_up_m,
            sigma_clock_m,
            correlations,
            dilutions,
            condition,
        };
        Self { sample: error.sample, fix, error, expected: Expected::take(error.sample, words), drift_mps }
    }
}

/// All fixes that have an error and of which something is expected, and what their clocks say of time scales.
///
/// # Errors
/// [`JudgeError`] where rows cannot be read or put away.
pub(super) fn cases(scene: &Scene<'_>, errors: &Errors) -> Result<(Table<Case>, Scales), JudgeError> {
    let run = scene.run;
    let mut cases = Table::new(errors.positions.directory());
    let (mut scales, mut clocks) = (Scales::default(), Clocks::of(run)?);
    let mut errors_at = errors.positions.finder()?;
    let wavelength_m = run.mean_wavelength_m();
    expected(scene, errors, |fix, place, expected, offsets| {
        let Some(error) = errors_at.get(expected.sample) else { return Ok(()) };
        scales.take(scene, &mut clocks, &fix, (&expected, offsets))?;
        let common_mps = wavelength_m.map_or(0.0, |wavelength_m| run.common.drift_mps(expected.sample, wavelength_m));
        let beyond_mps = SPEED_OF_LIGHT_MPS * (fix.clock_drift - place.clock_drift);
        // What parts code and carrier is the clock's to a receiver, until it has measured it.
        let (with, without) = (beyond_mps - common_mps, beyond_mps);
        let drift_mps = if with.abs() < without.abs() { with } else { without };
        cases.push(Case { sample: expected.sample, fix: Stated::of(&fix), error, expected, drift_mps })
    })?;
    Ok((cases, scales))
}

impl Case {
    /// True if the satellites of the fix are the expected ones, all of them certain.
    pub fn is_whole(&self) -> bool {
        self.expected.is_whole(self.fix.satellites)
    }

    pub fn geometry_departure(&self) -> f64 {
        let (fix, d) = (self.fix, &self.expected.dilution);
        let flat = d.m11 + d.m22;
        let squares = [flat + d.m33 + d.m44, flat + d.m33, flat, d.m33, d.m44];
        // One satellite more or less at the mask moves all of them.
        if self.expected.satellites.0 != self.expected.satellites.1 {
            return 0.0;
        }
        let condition = (fix.condition / self.expected.condition - 1.0).abs();
        let pairs = fix.dilutions.iter().zip(squares);
        pairs.map(|(stated, square)| (stated / square.sqrt() - 1.0).abs()).fold(condition, f64::max)
    }

    /// Largest deviation of a correlation ρ from the expected one, as the difference of their artanh.
    ///
    /// Weights that err by a factor s at most, each in its own way, change N = Σ w h hᵀ by a share of ±ln s
    /// in the order of matrices, and so N⁻¹. Of two axes with the correlation matrix R, that is R^½ E R^½
    /// with |E| ≤ ln s, and dρ = tr(G E) where G has the eigenvalues ±(1 − ρ²)/2: |dρ| ≤ (1 − ρ²) ln s. So
    /// artanh ρ moves by ln s at most, whatever the geometry.
    pub fn correlation_departure(&self) -> f64 {
        let p = &self.expected.stated;
        let expected = [p.m12 / (p.m11 * p.m22).sqrt(), p.m13 / (p.m11 * p.m33).sqrt(), p.m23 / (p.m22 * p.m33).sqrt()];
        let artanh = |correlation: &f64| libm::atanh(correlation.clamp(-1.0 + 1e-12, 1.0 - 1e-12));
        let pairs = self.fix.correlations.iter().zip(&expected);
        pairs.map(|(stated, expected)| (artanh(stated) - artanh(expected)).abs()).fold(0.0, f64::max)
    }

    /// The fix's error in units of the covariance that it states, beside what theory expects of that; `None`
    /// where no covariance is stated.
    pub fn normalised(&self) -> Option<Normalised> {
        let weight = self.fix.covariance().try_inverse()?;
        let quadratic = |vector: Vector3<f64>| (vector.transpose() * weight * vector).x;
        // What should be stated is the measure of what theory expects.
        let due: Matrix3<f64> = self.expected.stated.fixed_view::<3, 3>(0, 0).into_owned();
        let due = due.try_inverse()?;
        let bias = (self.expected.bias.abs() + self.expected.allowed).fixed_rows::<3>(0).into_owned();
        let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let biases = signs.map(|(n, u)| bias.component_mul(&Vector3::new(1.0, n, u)));
        let largest = biases.iter().map(|bias| (bias.transpose() * due * bias).x).fold(0.0, f64::max);
        let shares = |noise: &Matrix4<f64>| due * noise.fixed_view::<3, 3>(0, 0);
        let (noise, thermal) = (shares(&self.expected.noise), shares(&self.expected.thermal));
        let trace = noise.trace();
        Some(Normalised {
            square: quadratic(self.error.enu_m),
            most: trace + largest,
            least: thermal.trace(),
            freedom: if trace > 0.0 { trace * trace / (noise * noise).trace() } else { 1.0 },
        })
    }
}

impl Stated {
    /// Covariance of east, north and up, m².
    fn covariance(&self) -> Matrix3<f64> {
        let [e, n, u] = [self.sigma_east_m, self.sigma_north_m, self.sigma_up_m];
        let [en, eu, nu] = self.correlations;
        Matrix3::new(e * e, en * e * n, eu * e * u, en * e * n, n * n, nu * n * u, eu * e * u, nu * n * u, u * u)
    }
}

/// A normalised error squared, whose mean is 3 where the covariance is that of the errors.
pub(super) struct Normalised {
    pub square: f64,
    /// The mean that theory expects, biases at their largest.
    pub most: f64,
    /// Expected mean without any bias, and without values that a run draws once: an ionosphere may equal the
    /// nominal one.
    pub least: f64,
    /// Degrees of freedom of a chi-square with the spread that theory expects: fewer than three where most of
    /// the noise lies along one axis (Satterthwaite).
    pub freedom: f64,
}
