//! Attitude that a receiver finds by the elements of an array, and the phases of their channels, against the
//! truth and against the deviations that geometry and noise allow.
//!
//! Errors are divided by the deviations that the receiver states, which are compared with theory: the
//! covariance of a rotation and of the channels' phases, from phases that scatter by noise and by
//! `phase_sigma_deg`. Limits: a body at rest; the truth's directions, the receiver's C/N0, which is judged by
//! itself; channels without coupling.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use num_complex::Complex64;
use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::quantile::mean_square;
use crate::measure::inertial::Limited;
use crate::read::Run;
use crate::read::each_of_any;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::facts::ArrayFacts;
use gnss::record::{AttitudeRow, ElementRow};
use gnss::signal::Link;

/// Code period in which noise is taken for the phases' deviation.
const PERIOD_S: f64 = 1e-3;

/// Figures of attitudes.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Intervals from the first fix on, by the receiver's settings.
    pub due: usize,
    /// Intervals with an attitude.
    pub intervals: usize,
    /// Root mean square of the rotation between attitude and truth, in degrees.
    pub error_rms_deg: Option<f64>,
    /// Root mean square of its parts over the deviations that are stated.
    pub error_ratio: Option<Limited>,
    /// Mean of the stated deviations over those of theory.
    pub stated_ratio: Option<f64>,
    /// Root mean square error of the channels' phases, in degrees; none with coupling.
    pub phase_rms_deg: Option<f64>,
    /// Root mean square of these errors over their stated deviations.
    pub phase_ratio: Option<Limited>,
}

/// Sum of squares and their number.
#[derive(Default)]
struct Squares(f64, usize);

impl Squares {
    fn add(&mut self, value: f64) {
        (self.0, self.1) = (self.0 + value * value, self.1 + 1);
    }

    fn rms(&self) -> Option<f64> {
        (self.1 > 0).then(|| (self.0 / self.1 as f64).sqrt())
    }
}

impl Figures {
    /// Figures of a run; `None` where the receiver was not asked for attitudes or the body does not rest.
    ///
    /// # Errors
    /// Rows that cannot be read.
    pub fn of(run: &Run) -> Result<Option<Self>, JudgeError> {
        let Some((facts, truth)) = resting(run) else { return Ok(None) };
        let Some(theory) = Theory::of(run, facts, truth) else { return Ok(None) };
        let errors = errors(run)?;
        let (mut rotations, mut ratios) = (Squares::default(), Squares::default());
        for error in &errors {
            rotations.add(error.turned_deg.norm());
            error.turned_deg.iter().zip(error.sigma_deg).for_each(|(part, sigma_deg)| ratios.add(part / sigma_deg));
        }
        let first_s = run.fixes.earliest_sample().map(|sample| run.time_s(sample));
        let until = |seconds: f64| (seconds / theory.interval_s).floor() as usize;
        let due = first_s.map_or(0, |first_s| until(run.scene.duration_s).saturating_sub(until(first_s)));
        let limit = most(errors.len());
        let (mut phases, mut of_phases) = (Squares::default(), Squares::default());
        if let (Some(channels), Some(rx)) = (channels_rad(facts), &run.rx) {
            each_of_any(&rx.join("elements.csv"), |_, row: ElementRow| {
                let own_rad = row.element.checked_sub(1).and_then(|place| channels.get(place));
                let Some(own_rad) = own_rad else { return Ok(()) };
                let turns = (row.phase_deg - own_rad.to_degrees()) / 360.0;
                let off_deg = 360.0 * (turns - turns.round());
                phases.add(off_deg);
                of_phases.add(off_deg / row.sigma_deg);
                Ok(())
            })?;
        }
        Ok(Some(Self {
            due,
            intervals: errors.len(),
            error_rms_deg: rotations.rms(),
            error_ratio: ratios.rms().map(|value| Limited { value, limit }),
            stated_ratio: theory.stated(&errors)?,
            phase_rms_deg: phases.rms(),
            phase_ratio: of_phases.rms().map(|value| Limited { value, limit }),
        }))
    }
}

/// Error of one attitude.
#[derive(Clone, Debug)]
pub struct AttitudeError {
    /// Sample in the middle of its interval.
    pub sample: u64,
    /// Rotation from the truth to the attitude: axis in east, north and up times its angle, in degrees.
    pub turned_deg: Vector3<f64>,
    /// Stated deviations about these axes, in degrees.
    pub sigma_deg: [f64; 3],
    signals: usize,
}

/// Errors of a run's attitudes; none of a body that does not rest.
///
/// # Errors
/// Rows that cannot be read.
pub fn errors(run: &Run) -> Result<Vec<AttitudeError>, JudgeError> {
    let mut errors = Vec::new();
    let (Some((_, truth)), Some(rx)) = (resting(run), &run.rx) else { return Ok(errors) };
    each_of_any(&rx.join("attitude.csv"), |_, row: AttitudeRow| {
        errors.push(AttitudeError {
            sample: row.sample,
            turned_deg: rotation_vector(&(rotation(&row) * truth.transpose())).map(f64::to_degrees),
            sigma_deg: [row.sigma_east_deg, row.sigma_north_deg, row.sigma_up_deg],
            signals: row.signals,
        });
        Ok(())
    })?;
    Ok(errors)
}

/// Array of a body at rest, and the rotation from its axes to east, north and up.
fn resting(run: &Run) -> Option<(&ArrayFacts, Matrix3<f64>)> {
    let facts = run.scene.array.as_ref().filter(|facts| facts.is_still)?;
    Some((facts, Matrix3::from_columns(&facts.axes.map(Vector3::from))))
}

/// Largest root mean square of ratios of unit deviation in so many intervals. The parts of one interval
/// may be alike; intervals are not.
fn most(intervals: usize) -> f64 {
    mean_square(intervals as f64).1.sqrt()
}

/// Rotation of a row, from the body's axes to east, north and up.
fn rotation(row: &AttitudeRow) -> Matrix3<f64> {
    let [(sin_y, cos_y), (sin_p, cos_p), (sin_r, cos_r)] =
        [row.yaw_deg, row.pitch_deg, row.roll_deg].map(|deg| libm::sincos(deg.to_radians()));
    let nose = Vector3::new(sin_y * cos_p, cos_y * cos_p, sin_p);
    // Right side and down of a body that does not roll.
    let right = Vector3::new(cos_y, -sin_y, 0.0);
    let down = nose.cross(&right);
    Matrix3::from_columns(&[nose, right * cos_r + down * sin_r, down * cos_r - right * sin_r])
}

/// Axis of a rotation times its angle.
fn rotation_vector(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let twice = Vector3::new(
        rotation[(2, 1)] - rotation[(1, 2)],
        rotation[(0, 2)] - rotation[(2, 0)],
        rotation[(1, 0)] - rotation[(0, 1)],
    );
    let (sine, cosine) = (0.5 * twice.norm(), 0.5 * (rotation.trace() - 1.0));
    let angle = libm::atan2(sine, cosine);
    // Half a turn leaves no axis here; its size is what counts.
    if sine > 1e-12 { twice * (0.5 * angle / sine) } else { Vector3::new(angle, 0.0, 0.0) }
}

/// Phases of the channels ahead of the first one's; none with coupling.
fn channels_rad(facts: &ArrayFacts) -> Option<Vec<f64>> {
    let count = facts.lever_arms_m.len();
    let entry = |j: usize, k: usize| facts.mixing.get(j * count + k).map(|[re, im]| Complex64::new(*re, *im));
    let is_coupled = (0..count).any(|j| (0..count).any(|k| j != k && entry(j, k).is_some_and(|x| x.norm() > 0.0)));
    let first = entry(0, 0)?;
    let of = |k: usize| entry(k, k).map(|own| own * first.conj()).map(|x| libm::atan2(x.im, x.re));
    if is_coupled { None } else { (0..count).map(of).collect() }
}

/// Deviations of a rotation by geometry and noise.
struct Theory<'a> {
    run: &'a Run,
    /// Lever arms in east, north and up.
    arms_m: Vec<Vector3<f64>>,
    interval_s: f64,
    extra_rad: f64,
}

impl<'a> Theory<'a> {
    fn of(run: &'a Run, facts: &ArrayFacts, truth: Matrix3<f64>) -> Option<Self> {
        let setting = |key: &str| run.receiver.pointer(&format!("/settings/array/{key}"))?.as_f64();
        Some(Self {
            run,
            arms_m: facts.lever_arms_m.iter().map(|arm| truth * Vector3::from(*arm)).collect(),
            interval_s: 1e-3 * setting("attitude_ms").filter(|ms| *ms > 0.0)?,
            extra_rad: setting("phase_sigma_deg")?.to_radians(),
        })
    }

    /// Mean of stated deviations over those of theory, where the receiver compared every signal that it
    /// observed; none without such an interval.
    fn stated(&self, errors: &[AttitudeError]) -> Result<Option<f64>, JudgeError> {
        let mut seen: Vec<BTreeMap<Link, (Vector3<f64>, f64)>> = vec![BTreeMap::new(); errors.len()];
        let second = self.run.scene.sample_rate_hz;
        for link in self.run.observations.keys() {
            let Some(mut sky) = self.run.seen_at(link.sv)? else { continue };
            let mut observed = self.run.observations.finder(link)?;
            for (AttitudeError { sample, .. }, seen) in errors.iter().zip(&mut seen) {
                let found = sky.until_sample(*sample).zip(observed.until_sample(*sample));
                let Some((row, own)) = found.filter(|(_, own)| (sample - own.sample) as f64 <= second) else {
                    continue;
                };
                let ((sin_a, cos_a), (sin_e, cos_e)) =
                    (libm::sincos(row.azimuth_deg.to_radians()), libm::sincos(row.elevation_deg.to_radians()));
                seen.insert(link, (Vector3::new(cos_e * sin_a, cos_e * cos_a, sin_e), own.cn0_dbhz));
            }
        }
        let ratio = |(seen, error): (&BTreeMap<_, _>, &AttitudeError)| {
            let stated_deg = Vector3::from(error.sigma_deg).norm();
            (seen.len() == error.signals).then(|| Some(stated_deg / self.sigma_deg(seen)?)).flatten()
        };
        let ratios: Vec<f64> = seen.iter().zip(errors).filter_map(ratio).collect();
        Ok((!ratios.is_empty()).then(|| ratios.iter().sum::<f64>() / ratios.len() as f64))
    }

    /// Deviation of the rotation about all axes together.
    fn sigma_deg(&self, looks: &BTreeMap<Link, (Vector3<f64>, f64)>) -> Option<f64> {
        let count = self.arms_m.len();
        let mut kinds: Vec<&str> = looks.keys().map(|link| link.signal.name).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let unknowns = 3 + kinds.len() * (count - 1);
        let mut normal = DMatrix::<f64>::zeros(unknowns, unknowns);
        for (link, (towards, cn0_dbhz)) in looks {
            let cn0_hz = libm::pow(10.0, 0.1 * cn0_dbhz);
            let noise_rad2 = (1.0 + 1.0 / (count as f64 * cn0_hz * PERIOD_S)) / (2.0 * cn0_hz * self.interval_s);
            let weight = 1.0 / (noise_rad2 + self.extra_rad * self.extra_rad);
            let kind = kinds.iter().position(|name| *name == link.signal.name)?;
            let wave_per_m = TAU * link.carrier_hz() / SPEED_OF_LIGHT_MPS;
            let row = |(k, arm): (usize, &Vector3<f64>)| {
                let mut row = DVector::<f64>::zeros(unknowns);
                row.rows_mut(0, 3).copy_from(&(arm.cross(towards) * wave_per_m));
                if k > 0 {
                    row[3 + kind * (count - 1) + k - 1] = 1.0;
                }
                row
            };
            let rows: Vec<DVector<f64>> = self.arms_m.iter().enumerate().map(row).collect();
            let mean = rows.iter().fold(DVector::zeros(unknowns), |sum, row| sum + row) / count as f64;
            for row in rows {
                let row = row - &mean;
                normal.ger(weight, &row, &row, 1.0);
            }
        }
        let covariance = normal.cholesky()?.inverse();
        Some((0..3).map(|axis| covariance[(axis, axis)]).sum::<f64>().sqrt().to_degrees())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(yaw_deg: f64, pitch_deg: f64, roll_deg: f64) -> AttitudeRow {
        let [sigma_east_deg, sigma_north_deg, sigma_up_deg] = [1.0; 3];
        let (sample, signals, chi_square, freedom) = (0, 8, 1.0, 1);
        AttitudeRow {
            sample,
            yaw_deg,
            pitch_deg,
            roll_deg,
            sigma_east_deg,
            sigma_north_deg,
            sigma_up_deg,
            signals,
            chi_square,
            freedom,
        }
    }

    /// Nose, right side and down, in east, north and up.
    #[test]
    fn angles_turn_the_body_in_the_senses_of_aircraft() {
        let (east, north, up) = (Vector3::x(), Vector3::y(), Vector3::z());
        for ((yaw_deg, pitch_deg, roll_deg), axes) in [
            ((0.0, 0.0, 0.0), [north, east, -up]),
            ((90.0, 0.0, 0.0), [east, -north, -up]),
            ((0.0, 90.0, 0.0), [up, east, north]),
            // The right wing goes down.
            ((0.0, 0.0, 90.0), [north, -up, -east]),
        ] {
            let found = rotation(&row(yaw_deg, pitch_deg, roll_deg));
            for (column, axis) in axes.iter().enumerate() {
                assert!((found.column(column) - axis).norm() < 1e-12, "{yaw_deg} {pitch_deg} {roll_deg}: {found}");
            }
        }
    }

    #[test]
    fn a_rotation_s_vector_is_its_axis_times_its_angle() {
        for vector in [Vector3::new(0.3, -0.2, 1.1), Vector3::new(0.0, 0.0, 1e-9), Vector3::new(-2.0, 1.0, 0.5)] {
            let turned = nalgebra::Rotation3::from_scaled_axis(vector).into_inner();
            assert!((rotation_vector(&turned) - vector).norm() < 1e-12, "{vector}");
        }
    }

    #[test]
    fn channels_are_ahead_of_the_first_one_and_have_no_phase_with_coupling() {
        let at = |deg: f64| [libm::cos(deg.to_radians()), libm::sin(deg.to_radians())];
        let facts = |beside: [f64; 2]| ArrayFacts {
            lever_arms_m: vec![[0.0; 3]; 2],
            mixing: vec![at(20.0), beside, [0.0; 2], at(-50.0)],
            ..ArrayFacts::default()
        };
        let phases = channels_rad(&facts([0.0; 2])).unwrap();
        assert!(phases[0].abs() < 1e-12 && (phases[1].to_degrees() + 70.0).abs() < 1e-9, "{phases:?}");
        assert_eq!(channels_rad(&facts([0.1, 0.0])), None);
    }
}
