//! Protection levels of SBAS: deviations of what its messages bound, and of the air at the receiver.
//!
//! Source: RTCA DO-229D, appendix J (J.1 for approaches with vertical guidance and J.2.1 for the factors,
//! J.2.2 corrections, J.2.3 ionosphere, J.2.4 receiver and multipath, J.2.5 troposphere), A.4.2.5 and
//! A.4.5.1. The fix has the receiver's own weights, and its levels are those of its own estimator. Limits:
//! the noise of the receiver is what it states, not the largest of a class.

use super::geometry::Geometry;
use super::{Levels, Unprotected, major_m};

/// Factor of the vertical level (J.2.1).
const VERTICAL: f64 = 5.33;
/// Factor of the horizontal level on an approach with vertical guidance (J.2.1).
const HORIZONTAL_APPROACH: f64 = 6.0;
/// Factor of the horizontal level en route to non-precision approach (J.2.1).
const HORIZONTAL_EN_ROUTE: f64 = 6.18;

/// Standard deviation of airborne multipath at an elevation (J.2.4).
pub fn multipath_m(elevation_rad: f64) -> f64 {
    0.13 + 0.53 * libm::exp(-elevation_rad.to_degrees() / 10.0)
}

/// Standard deviation of the troposphere that is left at an elevation (A.4.2.5).
pub fn troposphere_m(elevation_rad: f64) -> f64 {
    let sine = libm::sin(elevation_rad);
    0.12 * 1.001 / (0.002_001 + sine * sine).sqrt()
}

/// Levels of a fix whose integrity covariance has all deviations of J.1.
///
/// # Errors
/// [`Unprotected::Singular`] where the geometry is singular.
pub fn levels(geometry: &Geometry, is_approach: bool) -> Result<Levels, Unprotected> {
    let all = geometry.of_all().ok_or(Unprotected::Singular)?;
    let covariance = all.covariance(&geometry.integrity);
    let horizontal = if is_approach { HORIZONTAL_APPROACH } else { HORIZONTAL_EN_ROUTE };
    let vertical = planted!("receiver.sbas.factor", VERTICAL, HORIZONTAL_APPROACH);
    Ok(Levels {
        hpl_m: Some(horizontal * major_m(&covariance)),
        vpl_m: is_approach.then(|| vertical * covariance[(2, 2)].max(0.0).sqrt()),
        emt_m: None,
        sigma_v_acc_m: Some(all.sigmas_m(&geometry.accuracy)[2]),
        is_contradicted: false,
    })
}
