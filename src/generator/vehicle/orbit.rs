//! A satellite as the user: Kepler's ellipse in inertial space, as the rotating Earth sees it.
//!
//! The orbital plane is placed by the Earth-fixed longitude that the ascending node has at the scene's start.
//! Closed form but for Kepler's equation; knots are so close that the quintics between them err by
//! nanometres. Limits: two bodies, no oblateness (which turns a low orbit's node by some degrees a day), no
//! drag, no Moon.

use nalgebra::Vector3;
use thiserror::Error;

use super::{Knot, Motion, Trajectory};
use gnss::broadcast::solve_kepler;
use gnss::earth::{EARTH_ROTATION_RADPS, SEMI_MAJOR_AXIS_M, rotate_earth};
use gnss::gravity::MU_M3PS2;

/// True anomaly between knots at perigee. A quintic over h misses by h⁶/46080 of the sixth derivative, which
/// is r·ω⁶ on a circle and below 60 times that at the perigee of an ellipse (found numerically up to e =
/// 0.98): 6.6e6 m · 60 · 1e-12 / 46080 is 9 nm.
const STEP_RAD: f64 = 0.01;
/// Knots at most, 80 bytes each: 46 days of a low orbit.
const MOST_KNOTS: f64 = 5e5;
/// Lowest perigee in metres, below which atmospheric drag ends an orbit.
const LOWEST_M: f64 = 80e3;

/// Elements at the scene's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Half of the longest diameter, in metres.
    pub semi_major_axis_m: f64,
    /// Eccentricity, from 0 to below 1.
    pub eccentricity: f64,
    /// Angle between the orbit's plane and the equator, in radians.
    pub inclination_rad: f64,
    /// Longitude of the ascending node in the Earth-fixed axes of the scene's start, in radians.
    pub node_longitude_rad: f64,
    /// Argument of the perigee from the ascending node, in radians.
    pub argument_of_perigee_rad: f64,
    /// Mean anomaly at the scene's start, in radians.
    pub mean_anomaly_rad: f64,
}

/// Reason for which an orbit cannot be flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum OrbitMotionError {
    /// An orbit that meets the Earth or its air.
    #[error(
        "semi_major_axis_m = {semi_major_axis_m} and eccentricity = {eccentricity} put the perigee {perigee_m:.0} m \
         above the equator's radius: expected at least 80 000 m"
    )]
    Perigee {
        /// Half of the longest diameter, in metres.
        semi_major_axis_m: f64,
        /// Eccentricity, from 0 to below 1.
        eccentricity: f64,
        /// Height of the perigee, in metres.
        perigee_m: f64,
    },
    /// A flight with more knots than are kept.
    #[error("an orbit over {duration_s} s needs {knots:.0} knots: expected at most 500 000, a shorter duration_s")]
    Long {
        /// Length of the flight, in seconds.
        duration_s: f64,
        /// Knots that it would take.
        knots: f64,
    },
    /// Kepler's equation was not solved.
    #[error("Kepler's equation did not converge for eccentricity = {eccentricity}")]
    Kepler {
        /// Eccentricity, from 0 to below 1.
        eccentricity: f64,
    },
}

impl Orbit {
    /// The flight from `from_s` to `until_s`, true seconds after the scene's start.
    ///
    /// # Errors
    /// [`OrbitMotionError`] for an orbit that meets the Earth, or too long a flight.
    pub fn trajectory(&self, from_s: f64, until_s: f64) -> Result<Trajectory, OrbitMotionError> {
        let (semi_major_axis_m, eccentricity) = (self.semi_major_axis_m, self.eccentricity);
        let perigee_m = semi_major_axis_m * (1.0 - eccentricity) - SEMI_MAJOR_AXIS_M;
        if perigee_m.is_nan() || perigee_m < LOWEST_M {
            return Err(OrbitMotionError::Perigee { semi_major_axis_m, eccentricity, perigee_m });
        }
        // Rate of the true anomaly at perigee.
        let flatness = (1.0 - eccentricity * eccentricity).sqrt();
        let rate_radps = self.mean_motion() * flatness / ((1.0 - eccentricity) * (1.0 - eccentricity));
        let duration_s = until_s - from_s;
        let knots = (duration_s * rate_radps / STEP_RAD).ceil().max(1.0);
        if knots > MOST_KNOTS {
            return Err(OrbitMotionError::Long { duration_s, knots });
        }
        let all: Option<Vec<Knot>> = (0..=knots as u64)
            .map(|k| {
                let t_s = from_s + duration_s * (k as f64 / knots);
                Some(Knot { t_s, motion: self.at(t_s)? })
            })
            .collect();
        let kepler = OrbitMotionError::Kepler { eccentricity };
        all.and_then(|knots| Trajectory::through(knots, Vec::new())).ok_or(kepler)
    }

    fn mean_motion(&self) -> f64 {
        (MU_M3PS2 / (self.semi_major_axis_m * self.semi_major_axis_m * self.semi_major_axis_m)).sqrt()
    }

    /// The motion in the Earth-fixed axes `t_s` after the start; `None` where Kepler's equation is not
    /// solved.
    pub fn at(&self, t_s: f64) -> Option<Motion> {
        let (n, e) = (self.mean_motion(), self.eccentricity);
        let anomaly = solve_kepler(self.mean_anomaly_rad + n * t_s, e)?;
        let (sin, cos) = libm::sincos(anomaly);
        let (a, flatness, shrink) = (self.semi_major_axis_m, (1.0 - e * e).sqrt(), 1.0 - e * cos);
        let (ahead, aside) = self.axes();
        let position_m = ahead * (a * (cos - e)) + aside * (a * flatness * sin);
        let velocity_mps = (aside * (flatness * cos) - ahead * sin) * (a * n / shrink);
        let acceleration_mps2 = position_m * (-MU_M3PS2 / libm::pow(a * shrink, 3.0));
        // Into axes that turn with the Earth.
        let w = Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS);
        let [r, v, g] = [position_m, velocity_mps, acceleration_mps2].map(|x| rotate_earth(&x, t_s));
        let turning_mps = v - w.cross(&r);
        Some(Motion {
            position_m: r,
            velocity_mps: turning_mps,
            acceleration_mps2: g - w.cross(&turning_mps) * 2.0 - w.cross(&w.cross(&r)),
        })
    }

    /// Unit vectors towards the perigee and a quarter turn on, in the inertial axes that are Earth-fixed at
    /// the start.
    fn axes(&self) -> (Vector3<f64>, Vector3<f64>) {
        let (sin_node, cos_node) = libm::sincos(self.node_longitude_rad);
        let (sin_i, cos_i) = libm::sincos(self.inclination_rad);
        let (sin_w, cos_w) = libm::sincos(self.argument_of_perigee_rad);
        let node = Vector3::new(cos_node, sin_node, 0.0);
        let climb = Vector3::new(-sin_node * cos_i, cos_node * cos_i, sin_i);
        (node * cos_w + climb * sin_w, climb * cos_w - node * sin_w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn low() -> Orbit {
        Orbit {
            semi_major_axis_m: 6.878e6,
            eccentricity: 0.001,
            inclination_rad: 0.9,
            node_longitude_rad: 0.3,
            argument_of_perigee_rad: 1.0,
            mean_anomaly_rad: -0.2,
        }
    }

    #[test]
    fn knots_and_quintics_are_the_ellipse_to_ten_nanometres() {
        // A low orbit, Molniya's perigee and one on the way to the Moon.
        for (a, e) in [(6.878e6, 0.001), (2.656e7, 0.74), (1.957e8, 0.9665)] {
            let orbit = Orbit { semi_major_axis_m: a, eccentricity: e, ..low() };
            let flight = orbit.trajectory(-2.0, 3600.0).unwrap();
            for k in 0..3_000 {
                let t_s = 1.2 * f64::from(k) + 0.137;
                let (found, want) = (flight.at(t_s), orbit.at(t_s).unwrap());
                // The quintic's 9 nm; and half a dozen roundings in both, to 2^-53 of the distance or of an
                // anomaly near one radian, which moves the position by a·√((1 + e cos E)/(1 − e cos E)), less
                // than 2a here.
                let bound_m = 1e-8 + 8.0 * (want.position_m.norm() + 2.0 * a) * (0.5_f64).powi(53);
                let apart_m = (found.position_m - want.position_m).norm();
                assert!(apart_m < bound_m, "{e} {t_s}: {apart_m} above {bound_m}");
                assert!((found.velocity_mps - want.velocity_mps).norm() < 1e-7, "{e} {t_s}");
            }
        }
    }

    #[test]
    fn rates_are_derivatives_and_a_geostationary_orbit_stands_still() {
        let (orbit, h) = (low(), 0.01);
        for k in 0..50 {
            let t_s = 100.0 * f64::from(k);
            let (before, here, after) =
                (orbit.at(t_s - h).unwrap(), orbit.at(t_s).unwrap(), orbit.at(t_s + h).unwrap());
            // Truncation h²/6 · r·ω³ = 1.5e-7 m/s; rounding 2e-9 m / 2h = 1e-7 m/s.
            assert!(((after.position_m - before.position_m) / (2.0 * h) - here.velocity_mps).norm() < 5e-7);
            assert!(((after.velocity_mps - before.velocity_mps) / (2.0 * h) - here.acceleration_mps2).norm() < 1e-8);
        }
        let a = libm::cbrt(MU_M3PS2 / (EARTH_ROTATION_RADPS * EARTH_ROTATION_RADPS));
        let belt = Orbit { semi_major_axis_m: a, eccentricity: 0.0, inclination_rad: 0.0, ..low() };
        let (first, last) = (belt.at(0.0).unwrap(), belt.at(86_400.0).unwrap());
        // A rounding of 2π a day at 42 164 km.
        assert!((last.position_m - first.position_m).norm() < 1e-6 && last.velocity_mps.norm() < 1e-8);
    }

    #[test]
    fn what_meets_the_earth_or_lasts_too_long_is_refused_with_its_numbers() {
        let grazing = Orbit { eccentricity: 0.1, ..low() }.trajectory(0.0, 60.0).unwrap_err().to_string();
        assert!(grazing.contains("-187937 m"), "{grazing}");
        assert!(matches!(low().trajectory(0.0, 1e9), Err(OrbitMotionError::Long { .. })));
    }
}
