//! Rows of what a receiver finds by the elements of an array.

use serde::{Deserialize, Serialize};

/// Attitude of the body of an array: one row of `rx/attitude.csv`, where the receiver's settings ask for it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttitudeRow {
    /// Sample in the middle of the interval whose carriers were compared.
    pub sample: u64,
    /// Direction of the nose from north over east, in degrees, 0 to 360.
    pub yaw_deg: f64,
    /// Elevation of the nose over the horizon, in degrees.
    pub pitch_deg: f64,
    /// Turn about the nose with the right side down, in degrees, −180 to 180.
    pub roll_deg: f64,
    /// Standard deviation of the rotation about the axis to the east, in degrees.
    pub sigma_east_deg: f64,
    /// Standard deviation of the rotation about the axis to the north, in degrees.
    pub sigma_north_deg: f64,
    /// Standard deviation of the rotation about the upward axis, in degrees.
    pub sigma_up_deg: f64,
    /// Number of signals whose carriers were compared.
    pub signals: usize,
    /// Weighted sum of squared residuals of the phases.
    pub chi_square: f64,
    /// Degrees of freedom of that sum.
    pub freedom: usize,
}

impl AttitudeRow {
    /// Columns of the table.
    pub const COLUMNS: [&str; 10] = [
        "sample",
        "yaw_deg",
        "pitch_deg",
        "roll_deg",
        "sigma_east_deg",
        "sigma_north_deg",
        "sigma_up_deg",
        "signals",
        "chi_square",
        "freedom",
    ];
}

/// Phase of the channel of an array's element: one row of `rx/elements.csv`, beside [`AttitudeRow`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ElementRow {
    /// Sample in the middle of the interval whose carriers were compared.
    pub sample: u64,
    /// Signal whose carriers were compared.
    pub signal: String,
    /// Number of the element, from 2 on.
    pub element: usize,
    /// Phase by which its channel is ahead of the first element's, in degrees, −180 to 180.
    pub phase_deg: f64,
    /// Standard deviation of the phase, in degrees.
    pub sigma_deg: f64,
}

impl ElementRow {
    /// Columns of the table.
    pub const COLUMNS: [&str; 5] = ["sample", "signal", "element", "phase_deg", "sigma_deg"];
}
