//! Rows of inertial sensors.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::time::Epoch;

/// Measurement of inertial sensors over one interval: one row of `truth/imu.csv`.
///
/// Angular rate against inertial space and specific force along the body's nose, right side and down, each
/// the mean over the interval before its time. Times the interval they are the increments that an inertial
/// unit puts out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InertialRow {
    /// True GPS time of the interval's end, whole seconds since 1980.
    pub gps_s: i64,
    /// Fraction of the true GPS time, in seconds.
    pub gps_fraction_s: f64,
    /// Angular rate about the nose, in rad/s.
    pub rate_x_radps: f64,
    /// Angular rate about the right side, in rad/s.
    pub rate_y_radps: f64,
    /// Angular rate about the body's down axis, in rad/s.
    pub rate_z_radps: f64,
    /// Specific force along the nose, in m/s².
    pub force_x_mps2: f64,
    /// Specific force along the right side, in m/s².
    pub force_y_mps2: f64,
    /// Specific force along the body's down axis, in m/s².
    pub force_z_mps2: f64,
}

impl InertialRow {
    /// True GPS time of the interval's end.
    pub fn time(&self) -> Epoch {
        Epoch::new(self.gps_s, self.gps_fraction_s)
    }

    /// Mean angular rate in body axes, in rad/s.
    pub fn rate_radps(&self) -> Vector3<f64> {
        Vector3::new(self.rate_x_radps, self.rate_y_radps, self.rate_z_radps)
    }

    /// Mean specific force in body axes, in m/s².
    pub fn force_mps2(&self) -> Vector3<f64> {
        Vector3::new(self.force_x_mps2, self.force_y_mps2, self.force_z_mps2)
    }
}

/// True motion and attitude of the inertial sensors at the end of an interval: one row of `truth/body.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyRow {
    /// True GPS time, whole seconds since 1980.
    pub gps_s: i64,
    /// Fraction of the true GPS time, in seconds.
    pub gps_fraction_s: f64,
    /// ECEF position x, in metres.
    pub x_m: f64,
    /// ECEF position y, in metres.
    pub y_m: f64,
    /// ECEF position z, in metres.
    pub z_m: f64,
    /// ECEF velocity x, in m/s.
    pub vx_mps: f64,
    /// ECEF velocity y, in m/s.
    pub vy_mps: f64,
    /// ECEF velocity z, in m/s.
    pub vz_mps: f64,
    /// Scalar part of the unit quaternion from body axes (nose, right, down) to ECEF.
    pub qw: f64,
    /// Part x of the quaternion.
    pub qx: f64,
    /// Part y of the quaternion.
    pub qy: f64,
    /// Part z of the quaternion.
    pub qz: f64,
}

impl BodyRow {
    /// True GPS time.
    pub fn time(&self) -> Epoch {
        Epoch::new(self.gps_s, self.gps_fraction_s)
    }

    /// ECEF position, in metres.
    pub fn position_m(&self) -> Vector3<f64> {
        Vector3::new(self.x_m, self.y_m, self.z_m)
    }

    /// ECEF velocity, in m/s.
    pub fn velocity_mps(&self) -> Vector3<f64> {
        Vector3::new(self.vx_mps, self.vy_mps, self.vz_mps)
    }
}
