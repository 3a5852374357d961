//! Protection levels of the residual test: the largest error of one satellite that the test may miss.
//!
//! Source: T. Walter and P. Enge, Weighted RAIM for Precision Approach, Proceedings of ION GPS-95, 1995. An
//! error of one satellite enters the position and the root of the weighted sum of squares in a ratio, its
//! slope. The level is the largest slope times the test's threshold, and a number of deviations for noise. A
//! fix without a fault has a level of its own, and the larger one counts. Limits: one fault at a time; noise
//! is normal with the receiver's own covariance.

use nalgebra::Cholesky;

use super::geometry::{AXES, Geometry};
use super::normal::quantile;
use super::{Levels, Unprotected, major_m};

/// Probabilities of the levels and threshold of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// Value of the weighted sum of squares from which the test reports a fault.
    pub threshold: f64,
    /// Probability that the error of a fault exceeds its level unnoticed.
    pub missed_detection: f64,
    /// Probability of a vertical error beyond its level without a fault.
    pub phmi_vertical: f64,
    /// Probability of a horizontal error beyond its level without a fault.
    pub phmi_horizontal: f64,
}

/// Levels of a fix.
///
/// # Errors
/// [`Unprotected`] where a satellite's error is in no residual, or the geometry is singular.
pub fn levels(geometry: &Geometry, test: &Test) -> Result<Levels, Unprotected> {
    let all = geometry.of_all().ok_or(Unprotected::Singular)?;
    let covariance = all.covariance(&geometry.weighting);
    let weights = Cholesky::new(geometry.weighting.clone()).ok_or(Unprotected::Singular)?.inverse();
    // What the sum of squares keeps of an error: W − W G (GᵀWG)⁻¹ GᵀW.
    let weighted = &weights * &geometry.rows;
    let normal = Cholesky::new(geometry.rows.transpose() * &weighted).ok_or(Unprotected::Singular)?;
    let seen = &weights - &weighted * normal.solve(&weighted.transpose());
    let root = test.threshold.max(0.0).sqrt();
    let (mut flat_m, mut up_m) = (0.0_f64, 0.0_f64);
    let last = geometry.satellites.iter().max().map_or(0, |last| last + 1);
    for satellite in 0..last {
        let own: Vec<usize> = (0..geometry.ranges()).filter(|&range| geometry.satellites[range] == satellite).collect();
        if own.is_empty() {
            continue;
        }
        // One error is common to all ranges of the satellite.
        let kept: f64 = own.iter().flat_map(|&a| own.iter().map(move |&b| (a, b))).map(|at| seen[at]).sum();
        let moved_m: [f64; AXES] = std::array::from_fn(|axis| own.iter().map(|&range| all.0[(axis, range)]).sum());
        let unseen = 1e-9 * weights.diagonal().max();
        if kept <= unseen {
            return Err(Unprotected::Unseen);
        }
        flat_m = flat_m.max(libm::hypot(moved_m[0], moved_m[1]) * root / kept.sqrt());
        up_m = up_m.max(moved_m[2].abs() * root / kept.sqrt());
    }
    let (sigma_flat_m, sigma_up_m) = (major_m(&covariance), covariance[(2, 2)].max(0.0).sqrt());
    let noise = quantile(test.missed_detection);
    let sound = [test.phmi_horizontal, test.phmi_vertical].map(|promised| quantile(0.5 * promised));
    Ok(Levels {
        hpl_m: Some((flat_m + noise * sigma_flat_m).max(sound[0] * sigma_flat_m)),
        vpl_m: Some((up_m + noise * sigma_up_m).max(sound[1] * sigma_up_m)),
        emt_m: None,
        sigma_v_acc_m: Some(all.sigmas_m(&geometry.accuracy)[2]),
        is_contradicted: false,
    })
}
