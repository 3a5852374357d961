//! stub
use nalgebra::Vector3;

pub struct Trajectory;

/// ECEF motion of the antenna at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    pub position_m: Vector3<f64>,
    pub velocity_mps: Vector3<f64>,
    pub acceleration_mps2: Vector3<f64>,
}
