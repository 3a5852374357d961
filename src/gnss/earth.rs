//! WGS 84: the ellipsoid, geodetic and local coordinates, the constants of the broadcast algorithms.
//!
//! Source: NGA.STND.0036 (WGS 84) and IS-GPS-200N, 20.3.3.4.3. Positions are earth-centred,
//! earth-fixed (ECEF) metres unless a name states otherwise.

use nalgebra::{Matrix3, Vector3};

/// Speed of light in vacuum, in m/s (IS-GPS-200N, 20.3.4.3).
pub const SPEED_OF_LIGHT_MPS: f64 = 299_792_458.0;
/// Earth's rotation rate, in rad/s (IS-GPS-200N, table 20-IV).
pub const EARTH_ROTATION_RADPS: f64 = 7.292_115_146_7e-5;
/// Earth's gravitational parameter for GPS users (IS-GPS-200N, table 20-IV).
pub const GPS_MU_M3PS2: f64 = 3.986_005e14;
/// π as the broadcast algorithm prints it (IS-GPS-200N, table 20-IV).
#[expect(clippy::approx_constant, reason = "the document prints this many digits and both ends must use them")]
pub const GPS_PI: f64 = 3.141_592_653_589_8;
/// Semi-major axis of the WGS 84 ellipsoid, in metres.
pub const SEMI_MAJOR_AXIS_M: f64 = 6_378_137.0;
/// Flattening of the WGS 84 ellipsoid.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
pub const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);

/// A position given by latitude, longitude and height above the ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geodetic {
    /// Geodetic latitude, north positive, in radians.
    pub latitude_rad: f64,
    /// Longitude, east positive, in radians.
    pub longitude_rad: f64,
    /// Height above the ellipsoid, in metres.
    pub height_m: f64,
}

impl Geodetic {
    /// Creates the position from degrees and metres.
    pub fn from_degrees(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Self {
        Self { latitude_rad: latitude_deg.to_radians(), longitude_rad: longitude_deg.to_radians(), height_m }
    }

    /// ECEF position, in metres.
    pub fn to_ecef(self) -> Vector3<f64> {
        let (sin_lat, cos_lat) = libm::sincos(self.latitude_rad);
        let (sin_lon, cos_lon) = libm::sincos(self.longitude_rad);
        let normal_m = SEMI_MAJOR_AXIS_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
        let in_plane = (normal_m + self.height_m) * cos_lat;
        Vector3::new(
            in_plane * cos_lon,
            in_plane * sin_lon,
            (normal_m * (1.0 - ECCENTRICITY_SQUARED) + planted!("gnss.earth.height", self.height_m, 0.0)) * sin_lat,
        )
    }

    /// Converts an ECEF position in metres.
    ///
    /// Fixed-point iteration on z + e²N sin φ; below 1e-9 m and 1e-14 rad from the ocean floor to
    /// geostationary height. At the geocentre the latitude is 90° and the height minus the polar radius.
    pub fn from_ecef(position_m: &Vector3<f64>) -> Self {
        let in_plane = libm::hypot(position_m.x, position_m.y);
        let mut shifted_z = position_m.z;
        let mut normal_m = SEMI_MAJOR_AXIS_M;
        for _ in 0..20 {
            let distance = libm::hypot(in_plane, shifted_z);
            let sin_lat = if distance > 0.0 { shifted_z / distance } else { 1.0 };
            normal_m = SEMI_MAJOR_AXIS_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
            let next = position_m.z + normal_m * ECCENTRICITY_SQUARED * sin_lat;
            let step = (next - shifted_z).abs();
            shifted_z = next;
            if step < 1e-10 {
                break;
            }
        }
        Self {
            latitude_rad: libm::atan2(shifted_z, in_plane),
            longitude_rad: libm::atan2(position_m.y, position_m.x),
            height_m: libm::hypot(in_plane, shifted_z) - normal_m,
        }
    }

    /// Matrix whose rows are the local east, north and up directions in ECEF.
    pub fn ecef_to_enu(self) -> Matrix3<f64> {
        let (sin_lat, cos_lat) = libm::sincos(self.latitude_rad);
        let (sin_lon, cos_lon) = libm::sincos(self.longitude_rad);
        Matrix3::new(
            -sin_lon,
            cos_lon,
            0.0,
            -sin_lat * cos_lon,
            -sin_lat * sin_lon,
            cos_lat,
            cos_lat * cos_lon,
            cos_lat * sin_lon,
            sin_lat,
        )
    }
}

/// Direction as seen from a position: azimuth and elevation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Azimuth from north over east, in radians, [0, 2π).
    pub azimuth_rad: f64,
    /// Elevation above the horizon, in radians.
    pub elevation_rad: f64,
}

/// Direction from `here` (with ECEF position `here_m`) to `there_m`.
pub fn look(here: Geodetic, here_m: &Vector3<f64>, there_m: &Vector3<f64>) -> Look {
    look_in(&here.ecef_to_enu(), here_m, there_m)
}

/// [`look`] where the local directions ([`Geodetic::ecef_to_enu`]) are known.
pub fn look_in(axes: &Matrix3<f64>, here_m: &Vector3<f64>, there_m: &Vector3<f64>) -> Look {
    let enu = axes * (there_m - here_m);
    let azimuth_rad = planted!("gnss.earth.azimuth", libm::atan2(enu.x, enu.y), libm::atan2(enu.y, enu.x));
    Look {
        azimuth_rad: if azimuth_rad < 0.0 { azimuth_rad + std::f64::consts::TAU } else { azimuth_rad },
        elevation_rad: libm::atan2(enu.z, libm::hypot(enu.x, enu.y)),
    }
}

/// Rotates `vector` into the ECEF axes of an instant `dt_s` later, without rotation in inertial space.
pub fn rotate_earth(vector: &Vector3<f64>, dt_s: f64) -> Vector3<f64> {
    let (sin, cos) = libm::sincos(planted!("gnss.earth.rotation", EARTH_ROTATION_RADPS, -EARTH_ROTATION_RADPS) * dt_s);
    Vector3::new(cos * vector.x + sin * vector.y, cos * vector.y - sin * vector.x, vector.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geodetic_and_ecef_are_inverse_from_the_geocentre_s_edge_to_beyond_geostationary_height() {
        for latitude in [-90.0_f64, -89.999_999, -45.0, 0.0, 1e-9, 26.5, 89.0, 90.0] {
            for longitude in [-180.0, -77.0, 0.0, 80.2, 179.999_999] {
                for height_m in [-6.0e6_f64, -400.0, 0.0, 8_848.0, 2.02e7, 4.0e7] {
                    // Deep inside the Earth, within 43 km of the evolute, the geodetic height is not unique.
                    if height_m < -1e6 && latitude.abs() < 89.0 {
                        continue;
                    }
                    let place = Geodetic::from_degrees(latitude, longitude, height_m);
                    let back = Geodetic::from_ecef(&place.to_ecef());
                    let again = back.to_ecef();
                    // 4e-8 m is five ulps of a coordinate at geostationary height.
                    assert!((again - place.to_ecef()).norm() < 4e-8, "{latitude} {longitude} {height_m}");
                    assert!((back.height_m - height_m).abs() < 4e-8, "{latitude} {longitude} {height_m}");
                    assert!((back.latitude_rad - place.latitude_rad).abs() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn a_published_station_has_the_published_coordinates() {
        // EPSG Guidance Note 7-2, geographic/geocentric example: 53°48'33.820"N 2°07'46.380"E 73.0 m.
        let place =
            Geodetic::from_degrees(53.0 + 48.0 / 60.0 + 33.820 / 3600.0, 2.0 + 7.0 / 60.0 + 46.380 / 3600.0, 73.0);
        let expected = Vector3::new(3_771_793.968, 140_253.342, 5_124_304.349);
        assert!((place.to_ecef() - expected).norm() < 1e-3);
    }

    #[test]
    fn looking_up_north_and_east_gives_those_angles() {
        let here = Geodetic::from_degrees(26.5, 80.2, 130.0);
        let here_m = here.to_ecef();
        let axes = here.ecef_to_enu().transpose();
        let east = look(here, &here_m, &(here_m + axes * Vector3::new(1.0, 0.0, 0.0)));
        assert!((east.azimuth_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-8 && east.elevation_rad.abs() < 1e-8);
        let up = look(here, &here_m, &(here_m + axes * Vector3::new(0.0, 0.0, 1e6)));
        assert!((up.elevation_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }
}
