//! Kepler's equation.
//!
//! Source: IS-GPS-200N, table 20-IV. Limits: eccentricities below one.

/// Residual of Kepler's equation at which it counts as solved, in radians.
const KEPLER_TOLERANCE_RAD: f64 = 1e-13;
const KEPLER_STEPS: u32 = 20;

/// The angle in [−π, π] with the same direction.
pub(super) fn wrap(angle_rad: f64) -> f64 {
    use std::f64::consts::TAU;
    angle_rad - TAU * (angle_rad / TAU).round()
}

/// Eccentric anomaly in radians, [−π, π], of a mean anomaly. `None` when 20 Newton steps leave a residual
/// above 1e-13.
///
/// For M in [0, π] the start min(M + e, π) lies above the root, where E − e sin E is convex, so
/// Newton's steps descend to the root for every eccentricity below one.
pub fn solve_kepler(mean_rad: f64, eccentricity: f64) -> Option<f64> {
    use std::f64::consts::PI;
    let wrapped = wrap(mean_rad);
    let target = wrapped.abs();
    let mut anomaly = (target + eccentricity).min(PI);
    for _ in 0..KEPLER_STEPS {
        let (sin, cos) = libm::sincos(anomaly);
        let residual = anomaly - eccentricity * sin - target;
        anomaly -= residual / (1.0 - eccentricity * cos);
        // The step just made squares what is left of the error: 1e-13 before it is round-off after it.
        if residual.abs() < KEPLER_TOLERANCE_RAD {
            return Some(if wrapped < 0.0 { -anomaly } else { anomaly });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keplers_equation_is_solved_for_every_eccentricity_below_one() {
        for eccentricity in [0.0, 0.01, 0.1, 0.7, 0.9, 0.99, 0.999, 0.9999] {
            for step in -2000..=2000 {
                let mean = f64::from(step) * 0.004;
                let anomaly = solve_kepler(mean, eccentricity).expect("converges");
                let residual = anomaly - eccentricity * libm::sin(anomaly) - mean;
                let turns = residual / std::f64::consts::TAU;
                assert!((residual - turns.round() * std::f64::consts::TAU).abs() < 1e-13, "{eccentricity} {mean}");
            }
            for tiny in [1e-3, 1e-5, 1e-9, 1e-15] {
                assert!(solve_kepler(tiny, eccentricity).is_some(), "{eccentricity} {tiny}");
            }
        }
    }
}
