//! Table `[imu]`: inertial sensors on the body that carries the antenna.
//!
//! Degrees, hours and parts per million end here. Limits: no pushed motion, whose knots are known only while
//! it is sent.

use super::keys::inertial::GRADES;
use super::read::Table;
use super::{Scenario, ScenarioError};
use crate::inertial::Imu;
use crate::vehicle::Trajectory;
use gnss::facts::{InertialFacts, TriadErrors};

/// Seconds in an hour, and the square root of that number.
const HOUR_S: f64 = 3600.0;
const SQRT_HOUR: f64 = 60.0;
/// Standard acceleration of gravity in m/s² (the SI Brochure, third CGPM).
const STANDARD_GRAVITY_MPS2: f64 = 9.806_65;

pub(super) fn imu(root: &Table<'_>, table: &Table<'_>) -> Result<InertialFacts, ScenarioError> {
    if !root.has("attitude") {
        return Err(root.bad("attitude", "[attitude] beside [imu]: it measures along the body's axes"));
    }
    let [angle, velocity, instability] = table.choice("grade", &GRADES)?.unwrap_or_default();
    let or = |key: &str, of_grade: f64| table.number(key).map(|own| own.unwrap_or(of_grade));
    let three = |key: &str, scale: f64| -> Result<[f64; 3], ScenarioError> {
        Ok(table.numbers::<3>(key)?.unwrap_or_default().map(|value| value * scale))
    };
    let degph = 1_f64.to_radians() / HOUR_S;
    let gyro = TriadErrors {
        bias: three("gyro_bias_deg_per_h", degph)?,
        scale_factor: three("gyro_scale_factor_ppm", 1e-6)?,
        misalignment_rad: three("gyro_misalignment_mrad", 1e-3)?,
        random_walk: or("angle_random_walk_deg_per_sqrt_h", angle)?.to_radians() / SQRT_HOUR,
        bias_instability: or("gyro_bias_instability_deg_per_h", instability)? * degph,
        rate_walk: table.need("rate_random_walk_deg_per_h_per_sqrt_h")? * degph / SQRT_HOUR,
    };
    let accelerometer = TriadErrors {
        bias: three("accelerometer_bias_mps2", 1.0)?,
        scale_factor: three("accelerometer_scale_factor_ppm", 1e-6)?,
        misalignment_rad: three("accelerometer_misalignment_mrad", 1e-3)?,
        random_walk: or("velocity_random_walk_mps_per_sqrt_h", velocity)? / SQRT_HOUR,
        bias_instability: table.need("accelerometer_bias_instability_mps2")?,
        rate_walk: table.need("acceleration_random_walk_mps2_per_sqrt_h")? / SQRT_HOUR,
    };
    Ok(InertialFacts {
        rate_hz: table.need("rate_hz")?,
        lever_arm_m: three("lever_arm_m", 1.0)?,
        is_still: false,
        gyro,
        accelerometer,
        g_sensitivity_radps_per_mps2: three("g_sensitivity_deg_per_h_per_g", degph / STANDARD_GRAVITY_MPS2)?,
    })
}

impl Scenario {
    /// Inertial sensors on a body that moves along `body`, with noise of a seed.
    pub(super) fn imu_on(&self, body: &Trajectory, seed: u64) -> Result<Option<Imu>, ScenarioError> {
        let Some(facts) = &self.imu else { return Ok(None) };
        if body.grown().is_some() {
            return Err(self.conflict("motion", "is pushed beside [imu]: expected another kind".to_owned()));
        }
        let facts = InertialFacts { is_still: body.is_static() && !body.spins(), ..facts.clone() };
        Ok(Some(Imu { facts, seed }))
    }
}
