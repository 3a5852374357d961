//! A body's turn against the local frame while it is pushed: quaternions, their rates, and pieces between
//! them.
//!
//! A piece is a cubic of the rotation vector from its left end on, with the turn and the rate of both ends:
//! neither steps, and a body at a constant rate stays at it. Everything is computed by `libm` and plain
//! arithmetic, so that a replay has the same bits. Limits: a piece turns by less than half a turn, the short
//! way round; the angular acceleration steps where pieces meet.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// Angle in radians below which the series of a rotation vector are exact to the last digit.
const SMALL_RAD: f64 = 1e-4;

/// Orientation of a body and its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Unit quaternion from body axes (nose, right, down) to north, east, down: scalar first.
    pub quaternion: [f64; 4],
    /// Angular rate against the local frame, in body axes.
    pub rate_radps: Vector3<f64>,
}

/// A turn as it is pushed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PushedTurn {
    /// Yaw clockwise from north, pitch up, roll to the right.
    pub angles_rad: [f64; 3],
    /// Rates of yaw, pitch and roll in rad/s, if known.
    pub rates_radps: Option<[f64; 3]>,
}

impl PushedTurn {
    /// True if all numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.angles_rad.iter().chain(self.rates_radps.iter().flatten()).all(|value| value.is_finite())
    }

    /// The turn, at rest where no rates were pushed.
    pub fn turn(&self) -> Turn {
        let [yaw, pitch, roll] = self.angles_rad;
        let still = Turn::of(yaw, pitch, roll);
        let Some([yaw_radps, pitch_radps, roll_radps]) = self.rates_radps else { return still };
        let ((sin_p, cos_p), (sin_r, cos_r)) = (libm::sincos(pitch), libm::sincos(roll));
        let rate_radps = Vector3::new(
            roll_radps - yaw_radps * sin_p,
            pitch_radps * cos_r + yaw_radps * cos_p * sin_r,
            yaw_radps * cos_p * cos_r - pitch_radps * sin_r,
        );
        Turn { rate_radps, ..still }
    }
}

impl Turn {
    /// Creates an orientation at rest from yaw, pitch and roll in radians.
    pub fn of(yaw_rad: f64, pitch_rad: f64, roll_rad: f64) -> Self {
        let half = |angle: f64| libm::sincos(0.5 * angle);
        let ((sy, cy), (sp, cp), (sr, cr)) = (half(yaw_rad), half(pitch_rad), half(roll_rad));
        let quaternion = product([cy, 0.0, 0.0, sy], product([cp, 0.0, sp, 0.0], [cr, sr, 0.0, 0.0]));
        Self { quaternion: unit(quaternion), rate_radps: Vector3::zeros() }
    }

    /// The rotation from body axes to north, east, down.
    pub fn rotation(&self) -> Rotation3<f64> {
        let [w, x, y, z] = self.quaternion;
        #[rustfmt::skip]
        let matrix = Matrix3::new(
            1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
            2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
            2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
        );
        Rotation3::from_matrix_unchecked(matrix)
    }

    /// `dt_s` later at the same rate.
    pub fn turned(&self, dt_s: f64) -> Self {
        // To the last digit: whether more is known later must not be seen.
        if dt_s == 0.0 {
            return *self;
        }
        Self { quaternion: unit(product(self.quaternion, exponential(&(self.rate_radps * dt_s)))), ..*self }
    }

    /// The rotation vector from this turn to another, in body axes: half a turn at most.
    pub fn to(&self, other: &Self) -> Vector3<f64> {
        let [w, x, y, z] = self.quaternion;
        logarithm(product([w, -x, -y, -z], other.quaternion))
    }

    /// The turn `t_s` after this one on the way to `right`, which is `length_s` after it.
    pub fn between(&self, right: &Self, length_s: f64, t_s: f64) -> Self {
        if t_s == 0.0 {
            return *self;
        }
        let end = self.to(right);
        // Slopes of the rotation vector times the length: the rate itself at the left end.
        let (left_slope, right_slope) = (self.rate_radps * length_s, slope_of_rate(&end, &right.rate_radps) * length_s);
        let (third, second) = (left_slope + right_slope - end * 2.0, end * 3.0 - left_slope * 2.0 - right_slope);
        let u = t_s / length_s;
        let vector = (left_slope + (second + third * u) * u) * u;
        let slope = (left_slope + (second * 2.0 + third * (3.0 * u)) * u) / length_s;
        Self {
            quaternion: unit(product(self.quaternion, exponential(&vector))),
            rate_radps: rate_of_slope(&vector, &slope),
        }
    }
}

/// Turns of ticks from pushed ones.
#[derive(Clone, Debug)]
pub struct Turning {
    /// Orientation at the end of the last tick.
    now: Turn,
    /// The newest push in use, and when it holds.
    used: Option<(f64, Turn)>,
}

/// Largest rotation in radians that is joined in one segment. Beyond it a tick covers the whole rotation.
const MOST_JOINED_RAD: f64 = 2.0;

impl Turning {
    /// Begins with `now`.
    pub fn new(now: Turn) -> Self {
        Self { now, used: None }
    }

    /// Uses a push of time `t_s`. A rate that is not pushed is the slope from the push before, where that is
    /// not older than `hold_s`.
    pub fn take(&mut self, t_s: f64, pushed: &PushedTurn, hold_s: f64) {
        let mut turn = pushed.turn();
        if let (None, Some((before_s, before))) = (pushed.rates_radps, &self.used)
            && (0.0..=hold_s).contains(&(t_s - before_s))
            && t_s > *before_s
        {
            turn.rate_radps = before.to(&turn) / (t_s - before_s);
        }
        self.used = Some((t_s, turn));
    }

    /// The turn at the end of a tick from `from_s` to `to_s`, on the way to the newest push at `horizon_s`.
    /// Past `hold_s` that one stands still.
    pub fn tick(&mut self, (from_s, to_s, horizon_s): (f64, f64, f64), hold_s: f64) -> Turn {
        let Some((pushed_s, pushed)) = self.used else { return self.now };
        let due = |at_s: f64| {
            let later = pushed.turned((at_s - pushed_s).min(hold_s));
            let rate_radps = if at_s - pushed_s > hold_s { Vector3::zeros() } else { later.rate_radps };
            Turn { rate_radps, ..later }
        };
        let fast = pushed.rate_radps.norm().max(self.now.rate_radps.norm()) * (horizon_s - from_s) > MOST_JOINED_RAD;
        let end_s = if fast { to_s } else { horizon_s };
        self.now = self.now.between(&due(end_s), end_s - from_s, to_s - from_s);
        self.now
    }
}

/// Hamilton's product.
fn product([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

fn unit(quaternion: [f64; 4]) -> [f64; 4] {
    let norm = quaternion.iter().fold(0.0, |sum, x| sum + x * x).sqrt();
    quaternion.map(|x| x / norm)
}

/// Unit quaternion of the rotation by a vector in radians.
pub(crate) fn exponential(vector: &Vector3<f64>) -> [f64; 4] {
    let angle = vector.norm();
    let (sin, cos) = libm::sincos(0.5 * angle);
    let share = if angle < SMALL_RAD { 0.5 - angle * angle / 48.0 } else { sin / angle };
    [cos, vector.x * share, vector.y * share, vector.z * share]
}

fn logarithm([w, x, y, z]: [f64; 4]) -> Vector3<f64> {
    // A quaternion and its negative are one turn; the short way round has a positive scalar.
    let sign = if w < 0.0 { -1.0 } else { 1.0 };
    let (vector, scalar) = (Vector3::new(x, y, z) * sign, w * sign);
    let sine = vector.norm();
    if sine < SMALL_RAD {
        vector * (2.0 + sine * sine / 3.0)
    } else {
        vector * (2.0 * libm::atan2(sine, scalar) / sine)
    }
}

/// The rate in body axes of a rotation vector with that slope: the right Jacobian of the exponential.
fn rate_of_slope(vector: &Vector3<f64>, slope: &Vector3<f64>) -> Vector3<f64> {
    let square = vector.norm_squared();
    let (a, b) = if square < SMALL_RAD {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        let angle = square.sqrt();
        let (sin, cos) = libm::sincos(angle);
        ((1.0 - cos) / square, (angle - sin) / (square * angle))
    };
    let cross = vector.cross(slope);
    slope - cross * a + vector.cross(&cross) * b
}

/// The slope of a rotation vector whose turn has that rate: the inverse of [`rate_of_slope`].
fn slope_of_rate(vector: &Vector3<f64>, rate: &Vector3<f64>) -> Vector3<f64> {
    let square = vector.norm_squared();
    let b = if square < SMALL_RAD {
        1.0 / 12.0 + square / 720.0
    } else {
        let angle = square.sqrt();
        let (sin, cos) = libm::sincos(0.5 * angle);
        (1.0 - 0.5 * angle * cos / sin) / square
    };
    let cross = vector.cross(rate);
    rate + cross * 0.5 + vector.cross(&cross) * b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::attitude::turned;

    fn pushed(angles_rad: [f64; 3], rates_radps: [f64; 3]) -> Turn {
        PushedTurn { angles_rad, rates_radps: Some(rates_radps) }.turn()
    }

    #[test]
    fn a_quaternion_is_the_rotation_of_its_angles_and_its_rate_their_derivative() {
        let rates = [0.3, -0.7, 1.1];
        for angles in [[0.0; 3], [2.5, 0.4, -1.0], [-3.0, -1.2, 3.0]] {
            let turn = pushed(angles, rates);
            let matrix = turned(angles[0], angles[1], angles[2]);
            // Products of a few sines and cosines, 1e-16 each.
            assert!((turn.rotation().matrix() - matrix.matrix()).norm() < 2e-15, "{angles:?}");
            let step_s = 1e-5;
            let at = |s: f64| pushed([0, 1, 2].map(|k| angles[k] + rates[k] * s), rates);
            let measured = at(-step_s).to(&at(step_s)) / (2.0 * step_s);
            // The second derivative of the rate, of the order of its cube, times step²/6; 1e-16 over 2e-5.
            assert!((measured - turn.rate_radps).norm() < 1e-9, "{angles:?}");
        }
    }

    #[test]
    fn a_piece_has_turn_and_rate_of_both_ends_and_its_rate_is_the_derivative_of_its_turn() {
        let (left, right) = (pushed([0.1, 0.2, 0.3], [1.0, -2.0, 3.0]), pushed([0.5, -0.4, 1.0], [-2.0, 1.0, 0.5]));
        let length_s = 0.1;
        for (t_s, end) in [(0.0, &left), (length_s, &right)] {
            let found = left.between(&right, length_s, t_s);
            assert!(found.to(end).norm() < 1e-14 && (found.rate_radps - end.rate_radps).norm() < 1e-12, "{t_s}");
        }
        let step_s = 1e-6;
        for k in 1..10 {
            let at = |t_s: f64| left.between(&right, length_s, t_s);
            let t_s = 0.01 * f64::from(k);
            let measured = at(t_s - step_s).to(&at(t_s + step_s)) / (2.0 * step_s);
            // Rounding of 1e-16 over 2e-6 s, and third derivatives of 1e4 times step²/6.
            assert!((measured - at(t_s).rate_radps).norm() < 1e-8, "{k}");
        }
        // A constant rate stays one.
        let later = left.turned(length_s);
        let half = left.between(&later, length_s, 0.5 * length_s);
        assert!(half.to(&left.turned(0.5 * length_s)).norm() < 1e-14);
    }
}
