//! Attitude of the body that carries the antenna, and where on it the antenna sits.
//!
//! Body axes are nose, right, down. The nose either keeps a direction of the local frame (yaw, pitch, roll
//! about down, right, nose) or follows the velocity; the body may spin about its nose at a constant rate,
//! right-handed. The spin stays a number of turns, so that a carrier can count it over any time. Of a pushed
//! attitude the turn at an instant is handed in. Limits: a
//! nose along the velocity has no roll of its own (its right side stays level), which is undefined while it
//! points straight up or down, and it leans towards its direction at rest by up to 1 m/s over the speed.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use super::Motion;
use super::turn::Turn;
use gnss::earth::{ECCENTRICITY_SQUARED, Geodetic, SEMI_MAJOR_AXIS_M};

/// Weight of the direction at rest against the velocity, in m/s.
const REST_MPS: f64 = 1.0;

/// Direction of the nose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Nose {
    /// Yaw from north over east, pitch above the horizon, roll to the right.
    Fixed {
        /// Yaw in radians, clockwise from north.
        yaw_rad: f64,
        /// Pitch in radians, positive nose up.
        pitch_rad: f64,
        /// Roll in radians, positive right side down.
        roll_rad: f64,
    },
    /// Pushed attitude; these angles apply before the first push.
    Pushed {
        /// Yaw in radians, clockwise from north.
        yaw_rad: f64,
        /// Pitch in radians, positive nose up.
        pitch_rad: f64,
        /// Roll in radians, positive right side down.
        roll_rad: f64,
    },
    /// Nose along the velocity over ground, and in the given direction at rest.
    Velocity {
        /// Yaw at rest in radians, clockwise from north.
        yaw_rad: f64,
        /// Pitch at rest in radians, positive nose up.
        pitch_rad: f64,
    },
}

/// Attitude of a body, and the mounting of the antenna on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Direction of the body.
    pub nose: Nose,
    /// Turns per second about the nose, positive to the right.
    pub spin_hz: f64,
    /// Lever arm in metres from the point that moves along the trajectory to the antenna, in body axes.
    pub lever_arm_m: Vector3<f64>,
    /// Direction in which the antenna looks, in body axes.
    pub boresight: Unit<Vector3<f64>>,
}

/// A body's axes at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Rotation from body axes to ECEF, as if the body had never spun.
    pub still: Rotation3<f64>,
    /// Turns about the nose since the scene's start, whole ones included.
    pub spin_cycles: f64,
}

impl Orientation {
    /// Rotation from body axes to ECEF.
    pub fn axes(&self) -> Rotation3<f64> {
        let turn = TAU * (self.spin_cycles - self.spin_cycles.floor());
        self.still * about_nose(turn)
    }
}

impl Attitude {
    /// Attitude of the body before the first push; `None` if no attitude is pushed.
    pub fn first_turn(&self) -> Option<Turn> {
        match self.nose {
            Nose::Pushed { yaw_rad, pitch_rad, roll_rad } => Some(Turn::of(yaw_rad, pitch_rad, roll_rad)),
            Nose::Fixed { .. } | Nose::Velocity { .. } => None,
        }
    }

    /// The body's axes `t_s` seconds after the scene's start, when its trajectory states `motion`, and
    /// `pushed` where the turn is pushed.
    pub fn at(&self, t_s: f64, motion: &Motion, pushed: Option<&Turn>) -> Orientation {
        let local = local_axes(Geodetic::from_ecef(&motion.position_m));
        let still = match self.nose {
            Nose::Fixed { yaw_rad, pitch_rad, roll_rad } => local * turned(yaw_rad, pitch_rad, roll_rad),
            Nose::Pushed { yaw_rad, pitch_rad, roll_rad } => {
                local * pushed.map_or_else(|| turned(yaw_rad, pitch_rad, roll_rad), Turn::rotation)
            }
            Nose::Velocity { yaw_rad, pitch_rad } => {
                let at_rest = turned(yaw_rad, pitch_rad, 0.0) * Vector3::x();
                let nose = local.inverse() * motion.velocity_mps + at_rest * REST_MPS;
                let level = libm::hypot(nose.x, nose.y);
                local * turned(libm::atan2(nose.y, nose.x), libm::atan2(-nose.z, level), 0.0)
            }
        };
        Orientation { still, spin_cycles: self.spin_hz * t_s }
    }

    /// The antenna's motion `t_s` seconds after the scene's start, when the trajectory states `motion`, and
    /// `pushed` where the turn is pushed. Limit: the body's angular acceleration does not enter the
    /// acceleration.
    pub fn antenna(&self, t_s: f64, motion: &Motion, pushed: Option<&Turn>) -> Motion {
        if self.lever_arm_m == Vector3::zeros() {
            return *motion;
        }
        let axes = self.at(t_s, motion, pushed).axes();
        let rate = self.rate_radps(motion, &axes, pushed);
        let velocity = rate.cross(&self.lever_arm_m);
        Motion {
            position_m: motion.position_m + axes * self.lever_arm_m,
            velocity_mps: motion.velocity_mps + axes * velocity,
            acceleration_mps2: motion.acceleration_mps2 + axes * rate.cross(&velocity),
        }
    }
}

impl Attitude {
    /// Angular rate in rad/s of the body against the Earth, in body axes, when its trajectory states `motion`
    /// and [`Self::at`] the `axes`, with the rate of the turn where it is pushed.
    pub fn rate_radps(&self, motion: &Motion, axes: &Rotation3<f64>, pushed: Option<&Turn>) -> Vector3<f64> {
        let place = Geodetic::from_ecef(&motion.position_m);
        let frame_radps = local_rate_radps(place, motion);
        let against_local_radps = match self.nose {
            Nose::Fixed { .. } => Vector3::x() * (TAU * self.spin_hz),
            Nose::Pushed { .. } => pushed.map_or_else(Vector3::zeros, |turn| turn.rate_radps),
            Nose::Velocity { yaw_rad, pitch_rad } => {
                let to_local = local_axes(place).inverse();
                let nose = to_local * motion.velocity_mps + turned(yaw_rad, pitch_rad, 0.0) * Vector3::x() * REST_MPS;
                let slope = to_local * (motion.acceleration_mps2 - frame_radps.cross(&motion.velocity_mps));
                let level2 = nose.x * nose.x + nose.y * nose.y;
                if level2 == 0.0 {
                    // Straight up or down: no yaw is defined there.
                    return axes.inverse() * frame_radps + Vector3::x() * (TAU * self.spin_hz);
                }
                let level = level2.sqrt();
                let yaw_radps = (nose.x * slope.y - nose.y * slope.x) / level2;
                let level_slope = (nose.x * slope.x + nose.y * slope.y) / level;
                let pitch_radps = (nose.z * level_slope - level * slope.z) / nose.norm_squared();
                // Yaw about the local vertical, pitch about the level right side, the spin about the nose.
                let (sin_yaw, cos_yaw) = (nose.y / level, nose.x / level);
                let against_local = Vector3::new(-sin_yaw * pitch_radps, cos_yaw * pitch_radps, yaw_radps);
                axes.inverse() * (to_local.inverse() * against_local) + Vector3::x() * (TAU * self.spin_hz)
            }
        };
        axes.inverse() * frame_radps + against_local_radps
    }
}

/// Angular rate in rad/s, in ECEF, of north, east and down against the Earth along a motion. At the poles,
/// where they have none, that of a body at rest.
fn local_rate_radps(place: Geodetic, motion: &Motion) -> Vector3<f64> {
    let enu_mps = place.ecef_to_enu() * motion.velocity_mps;
    let (sin_lat, cos_lat) = libm::sincos(place.latitude_rad);
    let width = 1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat;
    let normal_m = SEMI_MAJOR_AXIS_M / width.sqrt();
    let meridian_m = normal_m * (1.0 - ECCENTRICITY_SQUARED) / width;
    let longitude_radps = if enu_mps.x == 0.0 { 0.0 } else { enu_mps.x / ((normal_m + place.height_m) * cos_lat) };
    let latitude_radps = enu_mps.y / (meridian_m + place.height_m);
    let east = place.ecef_to_enu().row(0).transpose();
    Vector3::z() * longitude_radps - east * latitude_radps
}

/// Rotation from north, east, down at a position to ECEF.
fn local_axes(place: Geodetic) -> Rotation3<f64> {
    let enu = place.ecef_to_enu();
    let axes = Matrix3::from_columns(&[enu.row(1).transpose(), enu.row(0).transpose(), -enu.row(2).transpose()]);
    Rotation3::from_matrix_unchecked(axes)
}

/// Rotation from body axes to north, east, down.
pub(super) fn turned(yaw_rad: f64, pitch_rad: f64, roll_rad: f64) -> Rotation3<f64> {
    let (sin_yaw, cos_yaw) = libm::sincos(yaw_rad);
    let (sin_pitch, cos_pitch) = libm::sincos(pitch_rad);
    #[rustfmt::skip]
    let nose = Matrix3::new(
        cos_yaw * cos_pitch, -sin_yaw, cos_yaw * sin_pitch,
        sin_yaw * cos_pitch,  cos_yaw, sin_yaw * sin_pitch,
        -sin_pitch,           0.0,     cos_pitch,
    );
    Rotation3::from_matrix_unchecked(nose) * about_nose(roll_rad)
}

/// A right-handed turn about the nose.
fn about_nose(angle_rad: f64) -> Rotation3<f64> {
    let (sin, cos) = libm::sincos(angle_rad);
    Rotation3::from_matrix_unchecked(Matrix3::new(1.0, 0.0, 0.0, 0.0, cos, -sin, 0.0, sin, cos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn attitude(nose: Nose, spin_hz: f64) -> Attitude {
        Attitude { nose, spin_hz, lever_arm_m: Vector3::new(0.1, 0.2, -0.3), boresight: -Vector3::z_axis() }
    }

    /// Motion on the equator at longitude 0, where north, east, down are z, y, −x of ECEF.
    fn there(velocity_mps: Vector3<f64>) -> Motion {
        let position_m = Geodetic::from_degrees(0.0, 0.0, 0.0).to_ecef();
        Motion { position_m, velocity_mps, acceleration_mps2: Vector3::zeros() }
    }

    #[test]
    fn yaw_pitch_and_roll_turn_the_axes_as_an_aircraft_s() {
        let still = |yaw: f64, pitch: f64, roll: f64| {
            let nose =
                Nose::Fixed { yaw_rad: yaw.to_radians(), pitch_rad: pitch.to_radians(), roll_rad: roll.to_radians() };
            attitude(nose, 0.0).at(0.0, &there(Vector3::zeros()), None).axes()
        };
        let (north, east, up) = (Vector3::z(), Vector3::y(), Vector3::x());
        // Products of sines and cosines, each within 1e-16.
        let same = |a: Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() < 1e-15, "{a} {b}");
        same(still(0.0, 0.0, 0.0) * Vector3::x(), north);
        same(still(90.0, 0.0, 0.0) * Vector3::x(), east);
        same(still(90.0, 0.0, 0.0) * Vector3::y(), -north);
        same(still(0.0, 90.0, 0.0) * Vector3::x(), up);
        same(still(0.0, 0.0, 90.0) * Vector3::y(), -up);
        same(still(0.0, 0.0, 0.0) * Vector3::z(), -up);
    }

    #[test]
    fn the_nose_follows_the_velocity_and_rests_where_it_is_told() {
        let body = attitude(Nose::Velocity { yaw_rad: 0.0, pitch_rad: 1.0 }, 0.0);
        let nose = |velocity_mps| body.at(0.0, &there(velocity_mps), None).axes() * Vector3::x();
        let at_rest = Vector3::new(libm::sin(1.0), 0.0, libm::cos(1.0));
        assert!((nose(Vector3::zeros()) - at_rest).norm() < 1e-15);
        // One metre a second in six hundred: 1/600 rad at most.
        let flying = Vector3::new(0.0, 600.0, 10.0);
        assert!((nose(flying) - flying.normalize()).norm() < 1.0 / 600.0);
    }

    #[test]
    fn the_angular_rate_is_the_derivative_of_the_axes() {
        let start_m = Geodetic::from_degrees(48.0, 11.0, 500.0).to_ecef();
        let (v, a) = (Vector3::new(210.0, -90.0, 130.0), Vector3::new(-8.0, 15.0, 30.0));
        let at = |t_s: f64| Motion {
            position_m: start_m + (v + a * (0.5 * t_s)) * t_s,
            velocity_mps: v + a * t_s,
            acceleration_mps2: a,
        };
        let noses = [
            Nose::Fixed { yaw_rad: 0.3, pitch_rad: 0.2, roll_rad: 0.1 },
            Nose::Velocity { yaw_rad: 0.5, pitch_rad: 1.0 },
        ];
        for (nose, spin_hz) in noses.into_iter().flat_map(|nose| [(nose, 0.0), (nose, 3.0)]) {
            let body = attitude(nose, spin_hz);
            let axes = |t_s: f64| body.at(t_s, &at(t_s), None).axes();
            let step_s = 1e-4;
            for t_s in [0.0, 0.37, 4.2] {
                // By a quaternion: the angle of a matrix is lost below 1e-8.
                let turned = UnitQuaternion::from_rotation_matrix(&(axes(t_s - step_s).inverse() * axes(t_s + step_s)));
                let turn = turned.scaled_axis() / (2.0 * step_s);
                let rate = body.rate_radps(&at(t_s), &axes(t_s), None);
                // Axes are rounded to 1e-16 over 2e-4 s. Third derivatives of the angles are below 30 rad/s³
                // (spin² times the nose's rate, 0.15 rad/s and less): times step²/6 5e-8.
                assert!((turn - rate).norm() < 1e-7, "{nose:?} {spin_hz} {t_s}: {turn} {rate}");
            }
        }
    }

    #[test]
    fn the_antenna_s_velocity_is_the_derivative_of_its_place() {
        let fixed = attitude(Nose::Fixed { yaw_rad: 0.3, pitch_rad: 0.2, roll_rad: 0.1 }, 7.0);
        let moved = attitude(Nose::Velocity { yaw_rad: 0.5, pitch_rad: 0.0 }, 0.0);
        let still = |_: f64| there(Vector3::zeros());
        // A car's corner: 12 m/s and 4 m/s² across, a third of a turn a second.
        let (v, a) = (Vector3::new(0.0, 12.0, 0.0), Vector3::new(0.0, 0.0, 4.0));
        let corner = |t_s: f64| Motion {
            position_m: there(v).position_m + (v + a * (0.5 * t_s)) * t_s,
            velocity_mps: v + a * t_s,
            acceleration_mps2: a,
        };
        let cases: [(&Attitude, &dyn Fn(f64) -> Motion); 2] = [(&fixed, &still), (&moved, &corner)];
        let step_s = 1e-5;
        for (body, motion) in cases {
            for t_s in [0.0, 0.123, 10.01] {
                let [before, now, after] =
                    [t_s - step_s, t_s, t_s + step_s].map(|t_s| body.antenna(t_s, &motion(t_s), None));
                let slope = (after.position_m - before.position_m) / (2.0 * step_s);
                // Third derivative 0.36 m (44/s)³ times step²/6 is 5e-7; positions rounded to 1e-9 m over
                // 2e-5 s are 1e-4.
                assert!((slope - now.velocity_mps).norm() < 2e-4, "{t_s}: {slope} {}", now.velocity_mps);
                let bend = (after.velocity_mps - before.velocity_mps) / (2.0 * step_s);
                // In the corner the yaw's rate of 0.33 rad/s falls by 0.05 rad/s² and less, times 0.36 m.
                let tangential_mps2 = if body.spin_hz == 0.0 { 0.05 } else { 0.0 };
                assert!((bend - now.acceleration_mps2).norm() < 1e-4 + tangential_mps2, "{t_s}");
            }
        }
        let upright = attitude(Nose::Velocity { yaw_rad: 0.0, pitch_rad: 0.0 }, 0.0);
        let level = Motion { velocity_mps: -Vector3::z() + Vector3::x() * 9.0, ..there(Vector3::zeros()) };
        assert!(upright.antenna(0.0, &level, None).velocity_mps.iter().all(|value| value.is_finite()));
    }
}
