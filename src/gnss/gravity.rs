//! Gravitation of the Earth in WGS 84: the central term and the oblateness.
//!
//! Source: NGA.STND.0036 (WGS 84), tables 3.1 and 5.1. Accelerations are those of a body at rest in inertial
//! axes, without the centrifugal part of gravity. Limits: zonal terms from J4 on are left out, which are
//! 4.4e-5 m/s² at the equator and 1.2e-4 m/s² at the poles, and so are the anomalies of the real field, up
//! to some 1e-3 m/s².

use nalgebra::Vector3;

use crate::earth::SEMI_MAJOR_AXIS_M;

/// Earth's gravitational parameter with its atmosphere (NGA.STND.0036, table 3.1).
pub const MU_M3PS2: f64 = 3.986_004_418e14;
/// Dynamic form factor: −√5 times the EGM's C̄20 = −4.841 653 717 36e-4 (NGA.STND.0036, table 5.1).
pub const J2: f64 = 1.082_629_8e-3;

/// Gravitation of a sphere in m/s² at an ECEF position in metres.
pub fn central_mps2(position_m: &Vector3<f64>) -> Vector3<f64> {
    position_m * -size_mps2(position_m.norm_squared())
}

/// Part of the oblateness J2 in m/s² at an ECEF position in metres: the gradient of its potential.
pub fn oblateness_mps2(position_m: &Vector3<f64>) -> Vector3<f64> {
    let r = position_m;
    let r2 = r.norm_squared();
    let scale =
        planted!("gnss.gravity.oblateness", 1.5, -1.5) * J2 * size_mps2(r2) * SEMI_MAJOR_AXIS_M * SEMI_MAJOR_AXIS_M
            / r2;
    let z2 = 5.0 * r.z * r.z / r2;
    Vector3::new(r.x * (z2 - 1.0), r.y * (z2 - 1.0), r.z * (z2 - 3.0)) * scale
}

/// Both parts in m/s² at an ECEF position in metres.
pub fn gravitation_mps2(position_m: &Vector3<f64>) -> Vector3<f64> {
    central_mps2(position_m) + oblateness_mps2(position_m)
}

/// Central gravitation over distance, in 1/s², by the distance squared in m².
fn size_mps2(r2: f64) -> f64 {
    MU_M3PS2 / (r2 * r2.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::Geodetic;

    #[test]
    fn oblateness_is_the_gradient_of_its_potential() {
        let potential = |r: &Vector3<f64>| {
            let sin2 = r.z * r.z / r.norm_squared();
            -MU_M3PS2 / r.norm() * J2 * SEMI_MAJOR_AXIS_M * SEMI_MAJOR_AXIS_M / r.norm_squared() * (1.5 * sin2 - 0.5)
        };
        let at_m = Geodetic::from_degrees(26.5, 80.2, 2e5).to_ecef();
        let step_m = 100.0;
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let slope = (potential(&(at_m + axis * step_m)) - potential(&(at_m - axis * step_m))) / (2.0 * step_m);
            // Third derivatives, some 60·(potential 7e4)/r³ = 1.5e-14, times step²/6 = 1700; rounding of 7e4
            // over 200 m: 7e-14.
            assert!((slope - oblateness_mps2(&at_m).dot(&axis)).abs() < 1e-9);
        }
    }
}
