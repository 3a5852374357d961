//! Inertial sensors of a scene: their rate, their lever arm and the errors that were asked for.

use serde::{Deserialize, Serialize};

/// Inertial measurement unit of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InertialFacts {
    /// Measurements per second, Hz.
    pub rate_hz: f64,
    /// Lever arm in metres from the point that moves along the trajectory to the sensors, in body axes.
    pub lever_arm_m: [f64; 3],
    /// True if the body neither moves nor turns against the Earth.
    #[serde(default)]
    pub is_still: bool,
    /// Errors of the gyroscopes, in rad/s.
    pub gyro: TriadErrors,
    /// Errors of the accelerometers, in m/s².
    pub accelerometer: TriadErrors,
    /// Error of each gyroscope by the specific force along its axis, in rad/s for each m/s².
    pub g_sensitivity_radps_per_mps2: [f64; 3],
}

/// Errors of three sensors. A unit is rad/s for gyroscopes and m/s² for accelerometers.
///
/// Each sensor puts out (1 + scale factor) × (what arrives along its axis) + bias + noise. Noise is white
/// (its integral is a random walk), of 1/f and a random walk, as IEEE Std 952 names them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TriadErrors {
    /// Constant bias of each axis, in units.
    pub bias: [f64; 3],
    /// Error of the scale factor of each axis, of one.
    pub scale_factor: [f64; 3],
    /// Rotation vector from the body's axes to those of the sensors, in radians.
    pub misalignment_rad: [f64; 3],
    /// White noise: standard deviation of the integral after one second, in units × √s.
    pub random_walk: f64,
    /// Coefficient B of 1/f noise, in units: its Allan deviation is B √(2 ln 2/π) at every averaging time.
    pub bias_instability: f64,
    /// Random walk of the bias: standard deviation after one second, in units/√s.
    pub rate_walk: f64,
}

impl TriadErrors {
    /// True if the sensors have noise.
    pub fn is_noisy(&self) -> bool {
        self.random_walk > 0.0 || self.bias_instability > 0.0 || self.rate_walk > 0.0
    }
}

impl InertialFacts {
    /// True if any sensor has noise.
    pub fn is_noisy(&self) -> bool {
        self.gyro.is_noisy() || self.accelerometer.is_noisy()
    }
}
