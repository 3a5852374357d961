//! Site of an antenna with its local directions.

use nalgebra::{Matrix3, Vector3};

use gnss::earth::Geodetic;

/// Site of an antenna.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// ECEF position, metres.
    pub position_m: Vector3<f64>,
    /// Geodetic coordinates.
    pub geodetic: Geodetic,
    /// Unit vector of the local vertical, ECEF.
    pub up: Vector3<f64>,
    /// Matrix whose rows are east, north and up.
    pub axes: Matrix3<f64>,
}

impl Site {
    /// Site of an ECEF position in metres.
    pub fn new(position_m: Vector3<f64>) -> Self {
        let geodetic = Geodetic::from_ecef(&position_m);
        let axes = geodetic.ecef_to_enu();
        Self { position_m, geodetic, up: axes.row(2).transpose(), axes }
    }
}
