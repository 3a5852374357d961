//! Strapdown integration of inertial measurements, in inertial axes.
//!
//! Attitude by Magnus's series to the fourth order, velocity and position by Simpson's rule, on steps short
//! enough for the turn in them; gravitation at the middle of each step. The axes are those of the Earth at
//! the begin, so that no term of the turning Earth is needed before the result. Source: P. G. Savage,
//! "Strapdown Inertial Navigation Integration Algorithm Design", JGCD 21(1), 1998, for what must be
//! integrated.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};

use super::window::Smooth;
use gnss::earth::{EARTH_ROTATION_RADPS, rotate_earth};
use gnss::gravity::gravitation_mps2;

/// Largest turn in a step: Magnus's series leaves its fourth power over 720, 4e-9 of a slow turn across it.
const STEP_RAD: f64 = 0.04;

/// Position, velocity and attitude in ECEF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position, in metres.
    pub position_m: Vector3<f64>,
    /// Velocity against the Earth, in m/s.
    pub velocity_mps: Vector3<f64>,
    /// Rotation from body axes.
    pub attitude: UnitQuaternion<f64>,
}

/// Integration from a begin on.
pub struct Strapdown {
    /// Seconds since the begin, whose ECEF axes are kept.
    time_s: f64,
    inertial: Motion,
}

impl Strapdown {
    /// Begins with a motion.
    pub fn new(begin: Motion) -> Self {
        let turning = earth_radps().cross(&begin.position_m);
        Self { time_s: 0.0, inertial: Motion { velocity_mps: begin.velocity_mps + turning, ..begin } }
    }

    /// Integrates over an interval of `interval_s` with its angular rate and specific force, in body axes.
    pub fn advance(&mut self, interval_s: f64, rate_radps: &Smooth, force_mps2: &Smooth) {
        let turn_rad = interval_s * [-0.5, 0.0, 0.5].map(|x| rate_radps.at(x).norm()).into_iter().fold(0.0, f64::max);
        let steps = (turn_rad / STEP_RAD).ceil().max(2.0);
        let (share, step_s) = (1.0 / steps, interval_s / steps);
        for step in 0..steps as u64 {
            let from = step as f64 * share - 0.5;
            let (middle, end) = (from + 0.5 * share, from + share);
            let begin = self.inertial.attitude;
            let half = begin * turned(rate_radps, from, 0.5 * share, interval_s);
            let whole = half * turned(rate_radps, middle, 0.5 * share, interval_s);
            let at = &mut self.inertial;
            let gravitation = gravitation_mps2(&(at.position_m + at.velocity_mps * (0.5 * step_s)));
            let [first, second, third] =
                [(begin, from), (half, middle), (whole, end)].map(|(axes, x)| axes * force_mps2.at(x) + gravitation);
            at.position_m += at.velocity_mps * step_s + (first + second * 2.0) * (step_s * step_s / 6.0);
            at.velocity_mps += (first + second * 4.0 + third) * (step_s / 6.0);
            at.attitude = whole;
        }
        self.inertial.attitude.renormalize();
        self.time_s += interval_s;
    }

    /// The motion now.
    pub fn motion(&self) -> Motion {
        let Motion { position_m, velocity_mps, attitude } = self.inertial;
        let turned = exponential(&(earth_radps() * -self.time_s));
        Motion {
            position_m: rotate_earth(&position_m, self.time_s),
            velocity_mps: rotate_earth(&(velocity_mps - earth_radps().cross(&position_m)), self.time_s),
            attitude: turned * attitude,
        }
    }
}

fn earth_radps() -> Vector3<f64> {
    Vector3::z() * EARTH_ROTATION_RADPS
}

/// Rotation from the axes at the end of a part of an interval to those at its begin, both in intervals.
fn turned(rate_radps: &Smooth, from: f64, share: f64, interval_s: f64) -> UnitQuaternion<f64> {
    let (length_s, root) = (share * interval_s, 3.0_f64.sqrt());
    let [first, second] = [-1.0, 1.0].map(|side| rate_radps.at(from + share * (0.5 + side * root / 6.0)));
    exponential(&((first + second) * (0.5 * length_s) + first.cross(&second) * (root / 12.0 * length_s * length_s)))
}

/// Rotation by a vector in radians.
pub(super) fn exponential(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle = vector.norm();
    let (sin, cos) = libm::sincos(0.5 * angle);
    let share = if angle < 1e-4 { 0.5 - angle * angle / 48.0 } else { sin / angle };
    Unit::new_unchecked(Quaternion::from_parts(cos, vector * share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::inertial::window::Window;
    use gnss::gravity::MU_M3PS2;

    fn constant(value: Vector3<f64>) -> Smooth {
        Window::new(1).smooth(0, std::iter::once(&value))
    }

    #[test]
    fn a_body_in_free_fall_keeps_its_energy_and_turns_as_its_rate_says() {
        let (position_m, speed_mps) = (Vector3::new(7e6, 0.0, 0.0), (MU_M3PS2 / 7e6).sqrt());
        let velocity_mps = Vector3::new(0.0, speed_mps - EARTH_ROTATION_RADPS * 7e6, 0.0);
        let mut integrated = Strapdown::new(Motion { position_m, velocity_mps, attitude: UnitQuaternion::identity() });
        let rate = constant(Vector3::new(0.0, 0.0, 0.1));
        for _ in 0..6000 {
            integrated.advance(0.01, &rate, &constant(Vector3::zeros()));
        }
        // In the equator's plane J2 acts as 1.5·J2·(a/r)² more of the central part.
        let energy = |position_m: Vector3<f64>, velocity_mps: Vector3<f64>| {
            let r = position_m.norm();
            let share = gnss::gravity::J2 * (gnss::earth::SEMI_MAJOR_AXIS_M / r).powi(2) / 2.0;
            0.5 * velocity_mps.norm_squared() - MU_M3PS2 / r * (1.0 + share)
        };
        let now = integrated.inertial;
        let lost = energy(now.position_m, now.velocity_mps) - energy(position_m, Vector3::y() * speed_mps);
        // A force off by 1e-9 m/s² over a path of 453 km at worst; rounding of 6e7 J/kg, 12 000 steps.
        assert!(lost.abs() < 1e-3, "{lost}");
        // Six radians in inertial axes, less what the Earth turned.
        let turn = (6.0 - EARTH_ROTATION_RADPS * 60.0) / 2.0;
        let attitude = integrated.motion().attitude;
        assert!((attitude.w - libm::cos(turn)).abs() < 1e-11 && (attitude.k - libm::sin(turn)).abs() < 1e-11);
    }
}
