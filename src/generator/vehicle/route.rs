//! A route through waypoints: straight chords joined by smooth turns, with changes of speed on the chords.
//!
//! Each waypoint has the speed at which it is rounded. The turn (or the bend into a climb) lies in the plane
//! of its two chords and is flown at that speed: the turn rate rises, holds and falls linearly, so curvature
//! is continuous and jerk finite. Then the speed changes to that of the next waypoint, by a trapezoid of
//! acceleration. Limit: a chord is straight in space, so it sags below the Earth's curve by d²/(8R), 2 m on
//! 10 km.

use nalgebra::Vector3;
use thiserror::Error;

use super::ramp::Ramp;
use super::{Knot, Motion, Trajectory};
use gnss::earth::Geodetic;

/// Waypoint of a route: a position, the speed there and a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Position of the waypoint.
    pub place: Geodetic,
    /// Speed there; 0 is a stop.
    pub speed_mps: f64,
    /// Duration of a stop, in seconds.
    pub hold_s: f64,
}

/// Limit of a vehicle's turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turning {
    /// Lateral acceleration held in a turn.
    Acceleration {
        /// The acceleration across the way.
        mps2: f64,
    },
    /// Radius of the circular part of a turn.
    Radius {
        /// The radius of turns.
        m: f64,
    },
}

/// Limits of a vehicle's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Limit of turns.
    pub turning: Turning,
    /// Largest acceleration along the path, in m/s².
    pub acceleration_mps2: f64,
    /// Largest jerk, in m/s³.
    pub jerk_mps3: f64,
}

/// Reason for which waypoints do not form a route. Waypoints are counted from 1.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RouteError {
    /// Fewer waypoints than a route needs.
    #[error("a route needs at least 2 waypoints, not {have}")]
    TooFew {
        /// Number of waypoints.
        have: usize,
    },
    /// A leg that is too short or too long.
    #[error("waypoints {from} and {} are {length_m:.3} m apart: expected 1 m to 50 km (add points on a longer \
             leg)", from + 1)]
    Length {
        /// Number of the waypoint at which the leg begins, from 1.
        from: usize,
        /// Length of the leg, in metres.
        length_m: f64,
    },
    /// A leg without a speed at either end.
    #[error("waypoints {from} and {} both have speed_mps = 0: give one of them a speed, or add a point \
             between", from + 1)]
    Standstill {
        /// Number of the waypoint at which the leg begins, from 1.
        from: usize,
    },
    /// A turn that is too sharp.
    #[error(
        "the route turns by {angle_deg:.1} deg at waypoint {at}: expected at most 165 deg (stop there, or add points)"
    )]
    Sharp {
        /// Number of the waypoint, from 1.
        at: usize,
        /// Change of direction, in degrees.
        angle_deg: f64,
    },
    /// A leg in which the speed cannot change as much.
    #[error(
        "the leg from waypoint {from} to {} is {length_m:.1} m long, but its turns and its change of speed need \
         {needed_m:.1} m",
        from + 1
    )]
    Short {
        /// Number of the waypoint at which the leg begins, from 1.
        from: usize,
        /// Length of the leg, in metres.
        length_m: f64,
        /// Length that it would take, in metres.
        needed_m: f64,
    },
}

/// A turn at constant speed from direction `from` towards `side`, a unit vector square to it.
struct Turn {
    from: Vector3<f64>,
    side: Vector3<f64>,
    speed_mps: f64,
    angle: Ramp,
    /// Distance in metres from the waypoint to the turn's beginning and end.
    reach_m: f64,
}

/// The trajectory along `waypoints`, starting at time 0. After a last stop the antenna rests for ever.
pub fn trajectory(waypoints: &[Waypoint], limits: &Limits) -> Result<Trajectory, RouteError> {
    let too_few = || RouteError::TooFew { have: waypoints.len() };
    let points: Vec<Vector3<f64>> = waypoints.iter().map(|w| w.place.to_ecef()).collect();
    let (Some(first), [_, _, ..]) = (waypoints.first(), points.as_slice()) else { return Err(too_few()) };
    let chords = chords(&points, waypoints)?;
    let turns = turns(&chords, waypoints, limits)?;

    let start_m = points.first().copied().unwrap_or_default();
    let mut path = Path::new(start_m);
    if first.speed_mps == 0.0 {
        path.rest(first.hold_s);
    }
    for (leg, (&(direction, length_m), ends)) in chords.iter().zip(waypoints.windows(2)).enumerate() {
        let [here, there] = ends else { continue };
        let reach_m = |at: usize| turns.get(at).and_then(Option::as_ref).map_or(0.0, |t| t.reach_m);
        let (v0, v1) = (here.speed_mps, there.speed_mps);
        let change = Ramp::quickest(v1 - v0, limits.acceleration_mps2, limits.jerk_mps3);
        let change_m = 0.5 * (v0 + v1) * change.duration_s();
        let needed_m = reach_m(leg) + reach_m(leg + 1) + change_m;
        if needed_m > length_m {
            return Err(RouteError::Short { from: leg + 1, length_m, needed_m });
        }
        // A vehicle that stops keeps its speed up to the stop; any other changes speed right after the turn.
        let cruise_m = length_m - needed_m;
        if v1 == 0.0 {
            path.cruise(direction, v0, cruise_m);
            path.change_speed(direction, v0, &change);
            path.rest(there.hold_s);
        } else {
            path.change_speed(direction, v0, &change);
            path.cruise(direction, v1, cruise_m);
        }
        if let Some(turn) = turns.get(leg + 1).and_then(Option::as_ref) {
            path.turn(turn);
        }
    }
    Trajectory::through(path.knots, path.breaks_s).ok_or_else(too_few)
}

/// Direction and length of each leg.
fn chords(points: &[Vector3<f64>], waypoints: &[Waypoint]) -> Result<Vec<(Vector3<f64>, f64)>, RouteError> {
    let mut chords = Vec::with_capacity(points.len());
    for (leg, (ends, speeds)) in points.windows(2).zip(waypoints.windows(2)).enumerate() {
        let ([a, b], [before, after]) = (ends, speeds) else { continue };
        let length_m = (b - a).norm();
        if !(1.0..=50_000.0).contains(&length_m) {
            return Err(RouteError::Length { from: leg + 1, length_m });
        }
        if before.speed_mps == 0.0 && after.speed_mps == 0.0 {
            return Err(RouteError::Standstill { from: leg + 1 });
        }
        chords.push(((b - a) / length_m, length_m));
    }
    Ok(chords)
}

/// The turn at each waypoint; none at the ends, at stops and where the route goes straight on.
fn turns(
    chords: &[(Vector3<f64>, f64)],
    waypoints: &[Waypoint],
    limits: &Limits,
) -> Result<Vec<Option<Turn>>, RouteError> {
    let mut turns = vec![None];
    for (i, (pair, waypoint)) in chords.windows(2).zip(waypoints.iter().skip(1)).enumerate() {
        let [(from, _), (to, _)] = pair else { continue };
        let across = to - from * from.dot(to);
        let angle_rad = libm::atan2(across.norm(), from.dot(to));
        // Below 1e-9 rad the kink moves no point of the path by a wavelength's millionth.
        if waypoint.speed_mps == 0.0 || angle_rad < 1e-9 {
            turns.push(None);
            continue;
        }
        if angle_rad.to_degrees() > 165.0 {
            return Err(RouteError::Sharp { at: i + 2, angle_deg: angle_rad.to_degrees() });
        }
        let speed_mps = waypoint.speed_mps;
        let rate = match limits.turning {
            Turning::Acceleration { mps2 } => mps2 / speed_mps,
            Turning::Radius { m } => speed_mps / m,
        };
        let angle = Ramp::quickest(angle_rad, rate, limits.jerk_mps3 / speed_mps);
        let mut turn = Turn { from: *from, side: across / across.norm(), speed_mps, angle, reach_m: 0.0 };
        // The turn is symmetric, so it moves the antenna along from + to, and its ends lie on the chords.
        let moved_m: Vector3<f64> = turn.steps().iter().map(|&(a, b)| turn.displacement(a, b)).sum();
        turn.reach_m = moved_m.norm() / (from + to).norm();
        turns.push(Some(turn));
    }
    turns.push(None);
    Ok(turns)
}

impl Turn {
    fn direction(&self, t_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (angle_rad, rate_radps) = self.angle.at(t_s);
        let (sin, cos) = libm::sincos(angle_rad);
        (self.from * cos + self.side * sin, (self.side * cos - self.from * sin) * rate_radps)
    }

    /// The turn cut at its corners and then every twentieth of a radian at most: a quintic over 0.05 rad of a
    /// circle of radius R is off by R·0.05⁶/46080 < 4e-13 R. At most 63 steps, however slow the turn.
    fn steps(&self) -> Vec<(f64, f64)> {
        let corners = self.angle.corners_s();
        let mut steps = Vec::new();
        for pair in corners.windows(2) {
            let [a, b] = pair else { continue };
            let pieces = ((b - a) * self.angle.rate / 0.05).ceil().max(2.0);
            let cut = |k: f64| if k == pieces { *b } else { a + (b - a) * (k / pieces) };
            let mut k = 0.0;
            while k < pieces {
                steps.push((cut(k), cut(k + 1.0)));
                k += 1.0;
            }
        }
        steps
    }

    /// Displacement of the antenna in metres between two instants of one step. Gauss-Legendre quadrature of
    /// five points is used (Abramowitz and Stegun, table 25.4). Its error over 0.05 rad is below 1e-19 of the
    /// radius.
    fn displacement(&self, a: f64, b: f64) -> Vector3<f64> {
        const POINTS: [(f64, f64); 3] = [
            (0.0, 0.568_888_888_888_889),
            (0.538_469_310_105_683, 0.478_628_670_499_366),
            (0.906_179_845_938_664, 0.236_926_885_056_189),
        ];
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let mut sum = self.direction(middle).0 * POINTS[0].1;
        for (x, weight) in [POINTS[1], POINTS[2]] {
            sum += (self.direction(middle - half * x).0 + self.direction(middle + half * x).0) * weight;
        }
        sum * (half * self.speed_mps)
    }
}

/// A path that grows at its end.
struct Path {
    t_s: f64,
    position_m: Vector3<f64>,
    knots: Vec<Knot>,
    breaks_s: Vec<f64>,
}

impl Path {
    fn new(position_m: Vector3<f64>) -> Self {
        Self { t_s: 0.0, position_m, knots: Vec::new(), breaks_s: Vec::new() }
    }

    fn knot(&mut self, velocity_mps: Vector3<f64>, acceleration_mps2: Vector3<f64>) {
        let motion = Motion { position_m: self.position_m, velocity_mps, acceleration_mps2 };
        // Two pieces share an instant: the later one says the same.
        if self.knots.last().is_none_or(|last| last.t_s < self.t_s) {
            self.knots.push(Knot { t_s: self.t_s, motion });
        }
    }

    fn rest(&mut self, hold_s: f64) {
        self.knot(Vector3::zeros(), Vector3::zeros());
        self.t_s += hold_s;
        self.knot(Vector3::zeros(), Vector3::zeros());
    }

    fn cruise(&mut self, direction: Vector3<f64>, speed_mps: f64, length_m: f64) {
        self.knot(direction * speed_mps, Vector3::zeros());
        self.t_s += length_m / speed_mps;
        self.position_m += direction * length_m;
        self.knot(direction * speed_mps, Vector3::zeros());
    }

    fn change_speed(&mut self, direction: Vector3<f64>, from_mps: f64, change: &Ramp) {
        if change.rate == 0.0 {
            return;
        }
        let (start_s, start_m) = (self.t_s, self.position_m);
        for t_s in change.corners_s() {
            let (gained_mps, rate_mps2) = change.at(t_s);
            self.t_s = start_s + t_s;
            self.position_m = start_m + direction * (from_mps * t_s + change.integral(t_s));
            self.knot(direction * (from_mps + gained_mps), direction * rate_mps2);
            self.breaks_s.push(self.t_s);
        }
    }

    fn turn(&mut self, turn: &Turn) {
        let start_s = self.t_s;
        self.breaks_s.extend(turn.angle.corners_s().into_iter().map(|t_s| start_s + t_s));
        for (a, b) in turn.steps() {
            self.position_m += turn.displacement(a, b);
            self.t_s = start_s + b;
            let (along, across) = turn.direction(b);
            self.knot(along * turn.speed_mps, across * turn.speed_mps);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(latitude: f64, longitude: f64, height_m: f64, speed_mps: f64) -> Waypoint {
        Waypoint { place: Geodetic::from_degrees(latitude, longitude, height_m), speed_mps, hold_s: 0.0 }
    }

    const LIMITS: Limits =
        Limits { turning: Turning::Acceleration { mps2: 3.0 }, acceleration_mps2: 2.0, jerk_mps3: 1.5 };

    fn circuit() -> Vec<Waypoint> {
        vec![
            Waypoint { hold_s: 2.0, ..at(26.51, 80.23, 130.0, 0.0) },
            at(26.515, 80.23, 130.0, 25.0),
            at(26.515, 80.236, 160.0, 30.0),
            Waypoint { hold_s: 3.0, ..at(26.512, 80.24, 160.0, 0.0) },
            at(26.505, 80.235, 120.0, 20.0),
            at(26.505, 80.231, 120.0, 20.0),
        ]
    }

    #[test]
    fn a_route_rounds_its_corners_within_its_limits_and_passes_its_stops() {
        let waypoints = circuit();
        let trajectory = trajectory(&waypoints, &LIMITS).unwrap();
        let (start_s, end_s) = trajectory.span_s();
        assert!(start_s == f64::NEG_INFINITY && end_s.is_finite());
        let peak = trajectory.max_acceleration_mps2();
        // The quintic between knots overshoots the trapezoid by nothing but its own error, V ω⁵ h⁴ / 384 <
        // 1e-6.
        assert!(peak > 2.999_99 && peak < 3.0 + 1e-5, "{peak}");
        let n = 40_000;
        let mut closest = vec![f64::INFINITY; waypoints.len()];
        let (mut jerk, h) = (0.0_f64, end_s / f64::from(n));
        for k in 0..n {
            let (a, b) = (trajectory.at(f64::from(k) * h), trajectory.at(f64::from(k + 1) * h));
            jerk = jerk.max((b.acceleration_mps2 - a.acceleration_mps2).norm() / h);
            for (closest, waypoint) in closest.iter_mut().zip(&waypoints) {
                *closest = closest.min((waypoint.place.to_ecef() - a.position_m).norm());
            }
        }
        // In the held part of a turn the acceleration vector itself turns: V ω² = a²/V = 9/20 adds to the
        // ramp's 1.5.
        assert!(jerk > 1.49 && jerk < 1.6, "{jerk}");
        // The stop and both ends are hit but for the sampling (20 m/s · 3 ms); corners are cut.
        for i in [0, 3, 5] {
            assert!(closest[i] < 0.2, "{i} {}", closest[i]);
        }
        // A right angle at 25 m/s and 3 m/s² (R = 208 m) passes its corner at more than R(√2 − 1) = 86 m.
        assert!(closest[1] > 86.0 && closest[1] < 150.0, "{}", closest[1]);
    }

    #[test]
    fn the_path_returns_to_the_chord_after_a_turn() {
        let trajectory = trajectory(&circuit(), &LIMITS).unwrap();
        let stop = trajectory.knots().iter().skip(3).find(|k| k.motion.velocity_mps.norm() == 0.0).unwrap();
        // 60 knots of a turn, each sum rounded to an ulp of 6.4e6 m, and the chord's direction rounded to
        // 1e-16.
        assert!((stop.motion.position_m - circuit()[3].place.to_ecef()).norm() < 1e-6);
    }

    #[test]
    fn derivatives_are_continuous_and_consistent_everywhere() {
        let trajectory = trajectory(&circuit(), &LIMITS).unwrap();
        let (d, end_s) = (1e-3, trajectory.span_s().1);
        for k in 1..3_000 {
            let t_s = end_s * f64::from(k) / 3_000.0;
            let (a, m, b) = (trajectory.at(t_s - d), trajectory.at(t_s), trajectory.at(t_s + d));
            // Central difference: jerk·d²/6 = 3e-7, plus rounding of position 1e-9/d = 1e-6.
            let velocity = (b.position_m - a.position_m) / (2.0 * d);
            assert!((velocity - m.velocity_mps).norm() < 3e-6, "{t_s}");
            // A slope that jumps by 3 within the difference leaves 3·d/4.
            let acceleration = (b.velocity_mps - a.velocity_mps) / (2.0 * d);
            assert!((acceleration - m.acceleration_mps2).norm() < 1e-3, "{t_s}");
        }
    }

    #[test]
    fn a_radius_is_flown_as_a_circle_of_that_radius() {
        let limits = Limits { turning: Turning::Radius { m: 150.0 }, ..LIMITS };
        let points = [at(26.50, 80.23, 100.0, 20.0), at(26.51, 80.23, 100.0, 20.0), at(26.51, 80.24, 100.0, 20.0)];
        let trajectory = trajectory(&points, &limits).unwrap();
        let peak = trajectory.max_acceleration_mps2();
        assert!((peak - 20.0 * 20.0 / 150.0).abs() < 1e-6, "{peak}");
    }

    #[test]
    fn what_makes_no_route_is_refused_with_the_waypoint() {
        let route = |points: &[Waypoint]| trajectory(points, &LIMITS).unwrap_err();
        assert!(matches!(route(&[]), RouteError::TooFew { have: 0 }));
        assert!(matches!(route(&[at(1.0, 1.0, 0.0, 5.0)]), RouteError::TooFew { have: 1 }));
        let (a, b) = (at(1.0, 1.0, 0.0, 5.0), at(1.01, 1.0, 0.0, 5.0));
        assert!(matches!(route(&[a, a]), RouteError::Length { from: 1, .. }));
        assert!(matches!(route(&[a, b, at(3.0, 1.0, 0.0, 5.0)]), RouteError::Length { from: 2, .. }));
        assert!(matches!(route(&[a, b, a]), RouteError::Sharp { at: 2, .. }));
        let stop = |w: Waypoint| Waypoint { speed_mps: 0.0, ..w };
        assert!(matches!(route(&[stop(a), stop(b)]), RouteError::Standstill { from: 1 }));
        let near = at(1.000_2, 1.0, 0.0, 40.0);
        assert!(matches!(route(&[stop(a), near]), RouteError::Short { from: 1, .. }));
    }
}
