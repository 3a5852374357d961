//! Inertial sensors on the body: the specific force and the angular rate that its motion gives them.
//!
//! Each row is the mean over one interval of the sensors' clock, which keeps true time from the scene's start
//! on. Times the interval it is the increment of an inertial unit. Specific force is the acceleration against
//! inertial space less gravitation ([`gnss::gravity`]: WGS 84, central and J2); angular rate is against
//! inertial space, with the Earth's. Both are integrated over the interval by Gauss-Legendre of five points,
//! piece by piece between the knots of the motion, so that they err by rounding alone. The lever arm's
//! tangential part is the exact difference of the rates at the interval's ends. [`errors`] adds what the
//! sensors do. Limits: motion in a field without J2 (an orbit, a rocket with central gravity) shows the
//! difference as a specific force; a nose along the velocity turns quickly where it passes the vertical.

pub mod errors;

use std::f64::consts::TAU;

use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use crate::random::Stream;
use crate::vehicle::Trajectory;
use crate::vehicle::attitude::Attitude;
use errors::Errors;
use gnss::earth::EARTH_ROTATION_RADPS;
use gnss::facts::InertialFacts;
use gnss::gravity::gravitation_mps2;
use gnss::record::{BodyRow, InertialRow};
use gnss::time::Epoch;

/// Nodes and weights of Gauss and Legendre on −1 to 1 (Abramowitz and Stegun, table 25.4, n = 5).
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];
/// Largest turn in a piece of the quadrature: what five points leave of a sinusoid is 1e-14 of it.
const PIECE_RAD: f64 = 0.5;
/// Longest piece. A nose that begins to follow the velocity turns within 1 m/s over the acceleration, 5 ms
/// at 20 g.
const PIECE_S: f64 = 0.005;

/// Inertial measurement unit of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Imu {
    /// Rate, lever arm and errors.
    pub facts: InertialFacts,
    /// Seed of the noise.
    pub seed: u64,
}

impl Imu {
    /// Rate and errors in words.
    pub fn describe(&self) -> String {
        let noise = if self.facts.is_noisy() { "with noise" } else { "without noise" };
        format!("{} Hz, {noise}, in truth/imu.csv", self.facts.rate_hz)
    }
}

/// State of the sensors at an instant.
#[derive(Clone, Copy)]
struct Instant {
    /// Rotation from body axes to ECEF.
    axes: Rotation3<f64>,
    /// Angular rate against inertial space, in body axes.
    rate_radps: Vector3<f64>,
    /// Specific force in body axes, but for the part of the angular acceleration.
    force_mps2: Vector3<f64>,
    position_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
}

/// Measurements of a unit, interval by interval.
pub struct Measurements {
    trajectory: Trajectory,
    attitude: Attitude,
    start: Epoch,
    rate_hz: f64,
    lever_arm_m: Vector3<f64>,
    errors: Errors,
    /// Intervals from the scene's start to the last end.
    count: u64,
    now: Instant,
}

impl Measurements {
    /// Creates the measurements of `imu` on a body from the first end of an interval on that is not before
    /// `from_s`, in true seconds since `start`; `None` without an attitude.
    pub fn new(imu: &Imu, trajectory: &Trajectory, start: Epoch, from_s: f64) -> Option<Self> {
        let attitude = *trajectory.attitude()?;
        let count = (from_s * imu.facts.rate_hz).ceil().max(0.0) as u64;
        let lever_arm_m = Vector3::from(imu.facts.lever_arm_m);
        let t_s = count as f64 / imu.facts.rate_hz;
        Some(Self {
            now: instant(trajectory, &attitude, &lever_arm_m, t_s),
            trajectory: trajectory.clone(),
            attitude,
            start,
            rate_hz: imu.facts.rate_hz,
            lever_arm_m,
            errors: Errors::new(&imu.facts, Stream::new(imu.seed, "imu"), count),
            count,
        })
    }

    /// Intervals from the scene's start to the end of the last one.
    pub fn count(&self) -> u64 {
        self.count
    }

    fn at_s(&self, count: u64) -> f64 {
        count as f64 / self.rate_hz
    }

    /// Motion and attitude of the sensors at the end of the last interval.
    pub fn body(&self) -> BodyRow {
        let (time, at) = (self.start.plus_s(self.at_s(self.count)), &self.now);
        let q = UnitQuaternion::from_rotation_matrix(&at.axes);
        BodyRow {
            gps_s: time.seconds(),
            gps_fraction_s: time.fraction(),
            x_m: at.position_m.x,
            y_m: at.position_m.y,
            z_m: at.position_m.z,
            vx_mps: at.velocity_mps.x,
            vy_mps: at.velocity_mps.y,
            vz_mps: at.velocity_mps.z,
            qw: q.w,
            qx: q.i,
            qy: q.j,
            qz: q.k,
        }
    }

    /// Measurement over the next interval, unless it ends after `to_s`, in true seconds since the start.
    pub fn next(&mut self, to_s: f64) -> Option<InertialRow> {
        let (from_s, end_s) = (self.at_s(self.count), self.at_s(self.count + 1));
        if end_s > to_s {
            return None;
        }
        let (rate_radps, force_mps2) = self.mean(from_s, end_s);
        let (rate, force) = self.errors.measured(rate_radps, force_mps2);
        self.count += 1;
        let time = self.start.plus_s(end_s);
        Some(InertialRow {
            gps_s: time.seconds(),
            gps_fraction_s: time.fraction(),
            rate_x_radps: rate.x,
            rate_y_radps: rate.y,
            rate_z_radps: rate.z,
            force_x_mps2: force.x,
            force_y_mps2: force.y,
            force_z_mps2: force.z,
        })
    }

    /// Means of angular rate and specific force over an interval that begins at the last end.
    fn mean(&mut self, from_s: f64, to_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let knots = self.trajectory.knots();
        let first = knots.partition_point(|knot| knot.t_s <= from_s);
        let inner = knots.iter().skip(first).map(|knot| knot.t_s).take_while(|t_s| *t_s < to_s);
        let mut edges_s: Vec<f64> = [from_s].into_iter().chain(inner).chain([to_s]).collect();
        edges_s.extend(self.trajectory.breaks_s().iter().filter(|t_s| (from_s..to_s).contains(*t_s)));
        edges_s.sort_by(f64::total_cmp);
        let (mut angle_rad, mut speed_mps) = (Vector3::zeros(), Vector3::zeros());
        for pair in edges_s.windows(2) {
            let [a_s, b_s] = *pair else { continue };
            let turn_rad = TAU * self.attitude.spin_hz.abs() * (b_s - a_s);
            let pieces = (turn_rad / PIECE_RAD).max((b_s - a_s) / PIECE_S).ceil().max(1.0);
            let half_s = 0.5 * (b_s - a_s) / pieces;
            for piece in 0..pieces as u64 {
                let middle_s = a_s + (2 * piece + 1) as f64 * half_s;
                for (node, weight) in GAUSS {
                    let at = instant(&self.trajectory, &self.attitude, &self.lever_arm_m, middle_s + node * half_s);
                    angle_rad += at.rate_radps * (weight * half_s);
                    speed_mps += at.force_mps2 * (weight * half_s);
                }
            }
        }
        let before =
            std::mem::replace(&mut self.now, instant(&self.trajectory, &self.attitude, &self.lever_arm_m, to_s));
        speed_mps += (self.now.rate_radps - before.rate_radps).cross(&self.lever_arm_m);
        (angle_rad / (to_s - from_s), speed_mps / (to_s - from_s))
    }
}

fn instant(trajectory: &Trajectory, attitude: &Attitude, lever_arm_m: &Vector3<f64>, t_s: f64) -> Instant {
    let motion = trajectory.body(t_s);
    let axes = attitude.at(t_s, &motion, None).axes();
    let earth_radps = Vector3::z() * planted!("generator.inertial.earth", EARTH_ROTATION_RADPS, 0.0);
    let against_earth_radps = attitude.rate_radps(&motion, &axes, None);
    let rate_radps = against_earth_radps + axes.inverse() * earth_radps;
    let position_m = motion.position_m + axes * lever_arm_m;
    let acceleration_mps2 = motion.acceleration_mps2
        + earth_radps.cross(&motion.velocity_mps) * 2.0
        + earth_radps.cross(&earth_radps.cross(&motion.position_m));
    let own = axes.inverse() * (acceleration_mps2 - gravitation_mps2(&position_m));
    Instant {
        axes,
        rate_radps,
        force_mps2: own + rate_radps.cross(&rate_radps.cross(lever_arm_m)),
        position_m,
        velocity_mps: motion.velocity_mps + axes * against_earth_radps.cross(lever_arm_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::attitude::Nose;
    use gnss::earth::Geodetic;
    use nalgebra::Unit;

    fn level(spin_hz: f64) -> Attitude {
        Attitude {
            nose: Nose::Fixed { yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 },
            spin_hz,
            lever_arm_m: Vector3::zeros(),
            boresight: Unit::new_normalize(-Vector3::z()),
        }
    }

    fn rows(imu: &InertialFacts, trajectory: &Trajectory, from_s: f64, to_s: f64) -> Vec<InertialRow> {
        let start = Epoch::parse("2010-07-01T08:06:00").unwrap();
        let imu = Imu { facts: imu.clone(), seed: 3 };
        let mut all = Measurements::new(&imu, trajectory, start, from_s).unwrap();
        std::iter::from_fn(|| all.next(to_s)).collect()
    }

    #[test]
    fn a_body_at_rest_measures_the_earth_s_rate_and_gravity_upwards() {
        let place = Geodetic::from_degrees(30.0, 80.0, 0.0);
        let trajectory = Trajectory::fixed(place.to_ecef()).with_attitude(level(0.0));
        let facts = InertialFacts { rate_hz: 100.0, ..InertialFacts::default() };
        let rows = rows(&facts, &trajectory, 0.0, 0.5);
        assert_eq!(rows.len(), 50);
        for row in rows {
            // North, east, down: the Earth turns northwards and up; cos 30° and −sin 30°. Local axes and
            // means are rounded to 1e-16 of a radian and of one.
            let rate = row.rate_radps() - Vector3::new(0.75_f64.sqrt(), 0.0, -0.5) * EARTH_ROTATION_RADPS;
            assert!(rate.norm() < 1e-18, "{row:?}");
            // Somigliana's normal gravity there (NGA.STND.0036, 4.1) is 9.793 247 m/s²; the term of degree
            // four, left out, is below 1.2e-4. North of gravity there is the deflection of a field without
            // it, below the same.
            let force = row.force_mps2() - Vector3::new(0.0, 0.0, -9.793_247);
            assert!(force.norm() < 1.2e-4, "{row:?}");
        }
    }

    #[test]
    fn sensors_off_the_axis_of_a_spin_measure_its_centripetal_acceleration() {
        let trajectory = Trajectory::fixed(Geodetic::from_degrees(0.0, 0.0, 0.0).to_ecef()).with_attitude(level(5.0));
        let at = |lever_arm_m| {
            let facts = InertialFacts { rate_hz: 200.0, lever_arm_m, ..InertialFacts::default() };
            rows(&facts, &trajectory, 0.0, 0.2)
        };
        let centre = at([0.0; 3]);
        for (off, centre) in at([0.3, 0.02, 0.0]).iter().zip(&centre) {
            let found = off.force_mps2() - centre.force_mps2();
            let radps = TAU * 5.0 + EARTH_ROTATION_RADPS;
            // To the Earth's rate times the spin times the lever arm along the nose: 7e-4 m/s²; gravity
            // differs by 3e-6 of a metre.
            assert!((found - Vector3::new(0.0, -0.02 * radps * radps, 0.0)).norm() < 1e-3, "{found}");
        }
    }

    #[test]
    fn a_part_has_the_rows_of_the_whole() {
        let trajectory =
            Trajectory::fixed(Geodetic::from_degrees(48.0, 11.0, 500.0).to_ecef()).with_attitude(level(1.0));
        let mut facts = InertialFacts { rate_hz: 50.0, ..InertialFacts::default() };
        (facts.gyro.random_walk, facts.gyro.bias_instability, facts.gyro.rate_walk) = (1e-4, 2e-5, 1e-6);
        facts.accelerometer = facts.gyro;
        let (whole, part) = (rows(&facts, &trajectory, 0.0, 4.0), rows(&facts, &trajectory, 1.99, 4.0));
        assert_eq!((whole.len(), part.len()), (200, 100));
        assert_eq!(whole[100..], part);
    }
}
