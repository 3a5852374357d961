//! Motion of the antenna: one representation for every kind of motion.
//!
//! A [`Trajectory`] is a row of knots (time, ECEF position, velocity, acceleration) joined by quintic Hermite
//! pieces, so position, velocity and acceleration are continuous and each is the exact derivative of the one
//! before. One knot at rest is a static antenna. Where the acceleration's slope jumps, a break is reported,
//! so that knots of the signal can be put there. With an [`Attitude`] the antenna sits on a body that turns.
//! The knots of a [`grown`] motion become known while it is sent.

pub mod attitude;
pub mod file;
pub mod grown;
pub mod joining;
pub mod log;
pub mod orbit;
pub mod ramp;
pub mod rocket;
pub mod route;
pub mod shaking;
pub mod spline;
pub mod turn;

use std::sync::Arc;

use attitude::{Attitude, Orientation};
use grown::{Grown, Joining};
use nalgebra::Vector3;
use turn::Turn;

use gnss::earth::Geodetic;

/// Position, velocity and acceleration of the antenna in ECEF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// ECEF position, in metres.
    pub position_m: Vector3<f64>,
    /// Velocity in ECEF, in m/s.
    pub velocity_mps: Vector3<f64>,
    /// Acceleration in ECEF, in the rotating axes, in m/s².
    pub acceleration_mps2: Vector3<f64>,
}

impl Motion {
    /// Creates the motion of a point at rest on the rotating Earth.
    pub fn at_rest(position_m: Vector3<f64>) -> Self {
        Self { position_m, velocity_mps: Vector3::zeros(), acceleration_mps2: Vector3::zeros() }
    }

    /// `dt_s` later with the acceleration kept.
    fn extrapolated(&self, dt_s: f64) -> Self {
        Self {
            position_m: self.position_m + (self.velocity_mps + self.acceleration_mps2 * (0.5 * dt_s)) * dt_s,
            velocity_mps: self.velocity_mps + self.acceleration_mps2 * dt_s,
            acceleration_mps2: self.acceleration_mps2,
        }
    }
}

/// The motion at one instant, true seconds after the scene's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// True time since the scene's start.
    pub t_s: f64,
    /// The motion then.
    pub motion: Motion,
}

/// Antenna motion over true time since the scene's start.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Knots, at least one, with strictly ascending times. Copies of the trajectory share them.
    knots: Arc<[Knot]>,
    breaks_s: Vec<f64>,
    first: Knot,
    attitude: Option<Attitude>,
    /// Motion that is pushed while it is sent. The knots above are then its first one alone.
    grown: Option<Arc<Grown>>,
}

impl Trajectory {
    /// An antenna that does not move.
    pub fn fixed(position_m: Vector3<f64>) -> Self {
        let first = Knot { t_s: 0.0, motion: Motion::at_rest(position_m) };
        Self { knots: Arc::new([first]), breaks_s: Vec::new(), first, attitude: None, grown: None }
    }

    /// Motion through `knots`, whose times must ascend; `None` if they do not, or if there are none.
    /// `breaks_s` are the times at which acceleration or its slope jumps.
    pub fn through(knots: Vec<Knot>, mut breaks_s: Vec<f64>) -> Option<Self> {
        let first = *knots.first()?;
        let finite = knots.iter().all(|k| k.t_s.is_finite());
        if !finite || knots.windows(2).any(|pair| matches!(pair, [a, b] if a.t_s >= b.t_s)) {
            return None;
        }
        breaks_s.sort_by(f64::total_cmp);
        breaks_s.dedup();
        Some(Self { knots: knots.into(), breaks_s, first, attitude: None, grown: None })
    }

    /// Motion that begins as `first` and grows by [`Self::append`]; the newest `keep` knots are kept.
    pub fn growing(first: Motion, joining: Joining, keep: usize) -> Self {
        let first = Knot { t_s: 0.0, motion: first };
        let grown = Some(Arc::new(Grown::new(joining, first, keep)));
        Self { knots: Arc::new([first]), breaks_s: Vec::new(), first, attitude: None, grown }
    }

    /// The knots of a motion that grows.
    pub fn grown(&self) -> Option<&Grown> {
        self.grown.as_deref()
    }

    /// Samples of a tick of a motion that grows.
    pub fn tick_samples(&self) -> Option<u64> {
        self.grown().map(|grown| grown.joining().tick_samples)
    }

    /// Says at which true time the first tick of a growing motion begins.
    pub fn begin(&self, t_s: f64) {
        let first = Knot { t_s, ..self.first };
        if let Some(grown) = &self.grown {
            let turn = self.attitude.and_then(|attitude| attitude.first_turn());
            grown.begin(first, self.heading_of(&first, turn.as_ref()), turn);
        }
    }

    /// Ends the next tick of a growing motion with `knot`, which must be later than the last one, and where
    /// the attitude is pushed with its turn.
    pub fn append(&self, knot: Knot, turn: Option<Turn>) {
        if let Some(grown) = &self.grown {
            grown.append(knot, self.heading_of(&knot, turn.as_ref()), turn);
        }
    }

    /// True if the attitude of the body is pushed.
    pub fn is_turned(&self) -> bool {
        self.attitude.is_some_and(|attitude| attitude.first_turn().is_some())
    }

    /// The turn at an instant, where it is pushed.
    fn turn(&self, t_s: f64) -> Option<Turn> {
        self.grown.as_ref().filter(|_| self.is_turned()).and_then(|grown| grown.turn(t_s))
    }

    /// Heading of the nose at a knot in turns, within one; 0 without an attitude.
    fn heading_of(&self, Knot { t_s, motion }: &Knot, turn: Option<&Turn>) -> f64 {
        self.attitude.map_or(0.0, |attitude| {
            heading_cycles(&attitude.at(*t_s, motion, turn), &attitude.antenna(*t_s, motion, turn).position_m)
        })
    }

    /// Heading of the nose in turns, within one, where the body has an attitude.
    pub fn heading_cycles(&self, t_s: f64) -> f64 {
        self.orientation(t_s).map_or(0.0, |axes| heading_cycles(&axes, &self.at(t_s).position_m))
    }

    /// The antenna's motion for which the scene was composed: that at the scene's start, and of a growing
    /// motion the one that it begins with.
    pub fn composed_for(&self) -> Motion {
        match (&self.grown, &self.attitude) {
            (None, _) => self.at(0.0),
            (Some(_), None) => self.first.motion,
            (Some(_), Some(attitude)) => {
                attitude.antenna(self.first.t_s, &self.first.motion, attitude.first_turn().as_ref())
            }
        }
    }

    /// Returns the motion with an attitude of the body.
    pub fn with_attitude(self, attitude: Attitude) -> Self {
        Self { attitude: Some(attitude), ..self }
    }

    /// The body's attitude, where the scene gives it one.
    pub fn attitude(&self) -> Option<&Attitude> {
        self.attitude.as_ref()
    }

    /// The body's axes `t_s` true seconds after the scene's start, where it has an attitude.
    pub fn orientation(&self, t_s: f64) -> Option<Orientation> {
        self.attitude.map(|attitude| attitude.at(t_s, &self.body(t_s), self.turn(t_s).as_ref()))
    }

    /// True if the body spins.
    pub fn spins(&self) -> bool {
        self.attitude.is_some_and(|attitude| attitude.spin_hz != 0.0)
    }

    /// The antenna's motion `t_s` true seconds after the scene's start.
    pub fn at(&self, t_s: f64) -> Motion {
        let body = self.body(t_s);
        self.attitude.map_or(body, |attitude| attitude.antenna(t_s, &body, self.turn(t_s).as_ref()))
    }

    /// Distance in metres of the antenna from the axis of a spinning body, and its turns per second.
    pub fn circle(&self) -> Option<(f64, f64)> {
        let attitude = self.attitude.as_ref().filter(|attitude| attitude.spin_hz != 0.0)?;
        let radius_m = attitude.lever_arm_m.yz().norm();
        (radius_m > 0.0).then_some((radius_m, attitude.spin_hz.abs()))
    }

    /// The motion of the body that carries the antenna. Before the first knot and after the last one the
    /// acceleration there continues; [`Self::span_s`] states where that is.
    pub fn body(&self, t_s: f64) -> Motion {
        if let Some(grown) = &self.grown {
            return grown.body(t_s).unwrap_or(self.first.motion);
        }
        let next = self.knots.partition_point(|knot| knot.t_s <= t_s);
        let left = next.checked_sub(1).and_then(|i| self.knots.get(i)).unwrap_or(&self.first);
        match self.knots.get(next) {
            Some(right) if next > 0 => between(left, right, t_s),
            _ => left.motion.extrapolated(t_s - left.t_s),
        }
    }

    /// Times at which the acceleration or its slope jumps, ascending.
    pub fn breaks_s(&self) -> &[f64] {
        &self.breaks_s
    }

    /// Number of motion breaks per second, from the first to the last.
    pub fn breaks_a_second(&self) -> f64 {
        let (Some(first), Some(last)) = (self.breaks_s.first(), self.breaks_s.last()) else { return 0.0 };
        (self.breaks_s.len() - 1) as f64 / (last - first).max(1.0)
    }

    /// The knots themselves; of a growing motion the first alone.
    pub fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// True if the antenna never moves.
    pub fn is_static(&self) -> bool {
        let swings = self.spins() && self.attitude.is_some_and(|attitude| attitude.lever_arm_m.yz().norm() > 0.0);
        !swings
            && self.grown.is_none()
            && self.knots.iter().all(|knot| knot.motion == Motion::at_rest(self.first.motion.position_m))
    }

    /// First and last instant that the knots cover, in seconds; for all times where nothing moves at that
    /// end.
    pub fn span_s(&self) -> (f64, f64) {
        if self.grown.is_some() {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let last = self.knots.last().unwrap_or(&self.first);
        let rests = |knot: &Knot| knot.motion == Motion::at_rest(knot.motion.position_m);
        let start = if rests(&self.first) { f64::NEG_INFINITY } else { self.first.t_s };
        let end = if rests(last) { f64::INFINITY } else { last.t_s };
        (start, end)
    }

    /// Largest acceleration, speed and height-independent distance from the first point up to `until_s`,
    /// sampled at each knot and at nine instants between neighbours.
    pub fn extremes(&self, until_s: f64) -> Extremes {
        let mut extremes = Extremes::default();
        let mut take = |motion: &Motion| {
            extremes.acceleration_mps2 = extremes.acceleration_mps2.max(motion.acceleration_mps2.norm());
            extremes.speed_mps = extremes.speed_mps.max(motion.velocity_mps.norm());
        };
        for pair in self.knots.windows(2) {
            let [a, b] = pair else { continue };
            for k in 0..10 {
                let t_s = a.t_s + (b.t_s - a.t_s) * f64::from(k) / 10.0;
                if t_s <= until_s {
                    take(&between(a, b, t_s));
                }
            }
        }
        if let Some(last) = self.knots.last().filter(|k| k.t_s <= until_s) {
            take(&last.motion);
        }
        extremes
    }

    /// Largest acceleration between the knots, in ECEF.
    pub fn max_acceleration_mps2(&self) -> f64 {
        self.extremes(f64::INFINITY).acceleration_mps2
    }
}

/// Heading of the nose of a body with these axes at a position in ECEF, in turns within one.
fn heading_cycles(axes: &Orientation, place_m: &Vector3<f64>) -> f64 {
    let nose = Geodetic::from_ecef(place_m).ecef_to_enu() * (axes.still * Vector3::x());
    libm::atan2(nose.x, nose.y) / std::f64::consts::TAU
}

/// The largest values that a motion reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Largest acceleration, in m/s².
    pub acceleration_mps2: f64,
    /// Largest speed, in m/s.
    pub speed_mps: f64,
}

/// Difference of the quintic between two knots from the left knot's parabola. The values are the factors of
/// the third, fourth and fifth power of the share of the time between them, in metres.
fn third_fourth_fifth(left: &Knot, right: &Knot) -> [Vector3<f64>; 3] {
    let h = right.t_s - left.t_s;
    let (a, b) = (&left.motion, &right.motion);
    // Differences of the right knot from the left one's parabola, each scaled to metres; differences first,
    // so that the size of ECEF coordinates costs one rounding only.
    let gap = (b.position_m - a.position_m) - (a.velocity_mps + a.acceleration_mps2 * (0.5 * h)) * h;
    let slope = (b.velocity_mps - a.velocity_mps - a.acceleration_mps2 * h) * h;
    let bend = (b.acceleration_mps2 - a.acceleration_mps2) * (h * h);
    let third = gap * 10.0 - slope * 4.0 + bend * 0.5;
    let fourth = gap * -15.0 + slope * 7.0 - bend;
    let fifth = gap * 6.0 - slope * 3.0 + bend * 0.5;
    [third, fourth, fifth]
}

/// The quintic with the position, velocity and acceleration of both knots, at `t_s`.
fn between(left: &Knot, right: &Knot, t_s: f64) -> Motion {
    let h = right.t_s - left.t_s;
    let a = &left.motion;
    let [third, fourth, fifth] = third_fourth_fifth(left, right);
    let t = t_s - left.t_s;
    let x = t / h;
    Motion {
        position_m: a.position_m
            + ((a.velocity_mps + a.acceleration_mps2 * (0.5 * t)) * t
                + (third + (fourth + fifth * x) * x) * (x * x * x)),
        velocity_mps: a.velocity_mps
            + a.acceleration_mps2 * t
            + (third * 3.0 + (fourth * 4.0 + fifth * (5.0 * x)) * x) * (x * x / h),
        acceleration_mps2: a.acceleration_mps2
            + (third * 6.0 + (fourth * 12.0 + fifth * (20.0 * x)) * x) * (x / (h * h)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial of degree five in each axis, about a position on the Earth.
    fn quintic(t: f64) -> Motion {
        let c = [0.0, 30.0, -4.0, 0.7, -0.05, 0.001];
        let axis = |s: f64| {
            let p = c.iter().enumerate().map(|(k, c)| s * c * libm::pow(t, k as f64)).sum::<f64>();
            let v = c.iter().enumerate().skip(1).map(|(k, c)| s * c * k as f64 * libm::pow(t, (k - 1) as f64));
            let a =
                c.iter().enumerate().skip(2).map(|(k, c)| s * c * (k * (k - 1)) as f64 * libm::pow(t, (k - 2) as f64));
            (p, v.sum::<f64>(), a.sum::<f64>())
        };
        let (x, y, z) = (axis(1.0), axis(-0.5), axis(2.0));
        Motion {
            position_m: Vector3::new(970_000.0 + x.0, 5_600_000.0 + y.0, 2_800_000.0 + z.0),
            velocity_mps: Vector3::new(x.1, y.1, z.1),
            acceleration_mps2: Vector3::new(x.2, y.2, z.2),
        }
    }

    #[test]
    fn a_quintic_motion_is_reproduced_exactly() {
        let knots = [0.0, 1.0, 2.5, 6.0].map(|t_s| Knot { t_s, motion: quintic(t_s) });
        let trajectory = Trajectory::through(knots.to_vec(), vec![]).unwrap();
        for k in 0..=600 {
            let t_s = f64::from(k) * 0.01;
            let (got, want) = (trajectory.at(t_s), quintic(t_s));
            // Knots are rounded to 4.7e-10 m; the Hermite weights of position are at most 1, of velocity
            // 1.9/h, of acceleration 5.8/h² with h ≥ 1 s. Three axes and a few roundings on top.
            assert!((got.position_m - want.position_m).norm() < 3e-9, "{t_s}");
            assert!((got.velocity_mps - want.velocity_mps).norm() < 6e-9, "{t_s}");
            assert!((got.acceleration_mps2 - want.acceleration_mps2).norm() < 2e-8, "{t_s}");
        }
    }

    #[test]
    fn a_static_antenna_has_one_position_and_no_rates_at_any_time() {
        let place = Vector3::new(1.0, 2.0, 3.0);
        let trajectory = Trajectory::fixed(place);
        for t_s in [-5.0, 0.0, 1e9] {
            assert_eq!(trajectory.at(t_s), Motion::at_rest(place));
        }
        assert!(trajectory.breaks_s().is_empty() && trajectory.is_static());
        assert_eq!(trajectory.span_s(), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(trajectory.max_acceleration_mps2(), 0.0);
    }

    #[test]
    fn knots_that_do_not_ascend_make_no_trajectory() {
        let knot = |t_s| Knot { t_s, motion: Motion::at_rest(Vector3::zeros()) };
        assert!(Trajectory::through(vec![], vec![]).is_none());
        assert!(Trajectory::through(vec![knot(1.0), knot(1.0)], vec![]).is_none());
        assert!(Trajectory::through(vec![knot(0.0), knot(f64::NAN)], vec![]).is_none());
    }
}
