//! Pushed states become ticks of a smooth motion.
//!
//! A tick follows a quintic from the state that is transmitted now to the newest pushed state, extrapolated
//! to the end of the joining time: position, velocity and acceleration are continuous whatever is pushed. The
//! next tick aims again. Without news the acceleration is kept for the holding time, fades over another one,
//! and the velocity stays. Where a join needs more jerk than allowed, the tick moves all the way within
//! itself, still without a step: a snap. Limits: a velocity that is not pushed is the slope from the push
//! before, half an interval old, and the acceleration then zero.

use std::collections::VecDeque;

use nalgebra::Vector3;
use thiserror::Error;

use super::grown::Joining;
use super::turn::{PushedTurn, Turn, Turning};
use super::{Knot, Motion, between, third_fourth_fifth};
use gnss::earth::SPEED_OF_LIGHT_MPS;

/// Pushes that wait for their time at most.
const MOST_WAITING: usize = 1024;
/// Time by which a push may lie ahead of the tick that is made next.
const MOST_AHEAD_S: f64 = 3600.0;
/// Distances from the Earth's centre that a push may have: inside the Earth, and beyond the Moon.
const LEAST_RADIUS_M: f64 = 6.0e6;
const MOST_RADIUS_M: f64 = 1e9;
/// Largest speed, acceleration and jerk that a push may have.
const MOST_SPEED_MPS: f64 = 0.01 * SPEED_OF_LIGHT_MPS;
const MOST_ACCELERATION_MPS2: f64 = 1e6;
const MOST_JERK_MPS3: f64 = 1e9;
/// Largest angular rate, in rad/s.
const MOST_TURNING_RADPS: f64 = 1e3;
/// Mean speed of a snap at most; its peak is 1.875 times that.
const SNAP_SPEED_MPS: f64 = 0.05 * SPEED_OF_LIGHT_MPS;
/// Positions in a join at which its jerk is taken.
const PLACES: u32 = 8;

/// A state of the vehicle as it is pushed, ECEF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// True time since the scene's start that it describes.
    pub t_s: f64,
    /// Position, in metres.
    pub position_m: Vector3<f64>,
    /// Velocity in ECEF, if known, in m/s.
    pub velocity_mps: Option<Vector3<f64>>,
    /// Acceleration in ECEF, if known, in m/s².
    pub acceleration_mps2: Option<Vector3<f64>>,
    /// Jerk in ECEF, if known, in m/s³.
    pub jerk_mps3: Option<Vector3<f64>>,
    /// Attitude of the body, if known.
    pub turn: Option<PushedTurn>,
}

impl Push {
    /// A position alone.
    pub fn at(t_s: f64, position_m: Vector3<f64>) -> Self {
        Self { t_s, position_m, velocity_mps: None, acceleration_mps2: None, jerk_mps3: None, turn: None }
    }

    /// A whole state.
    pub fn of(t_s: f64, motion: &Motion) -> Self {
        let (velocity_mps, acceleration_mps2) = (Some(motion.velocity_mps), Some(motion.acceleration_mps2));
        Self { velocity_mps, acceleration_mps2, ..Self::at(t_s, motion.position_m) }
    }
}

/// Reason for which a push is refused.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum Refusal {
    /// A motion that takes no pushes.
    #[error("the scene's motion is known before: only [motion] kind = \"pushed\" takes states")]
    Known,
    /// A number that is none.
    #[error("a number that is not finite")]
    NotFinite,
    /// A position that no vehicle has.
    #[error("{0:e} m from the Earth's centre: expected {LEAST_RADIUS_M:e} to {MOST_RADIUS_M:e} m, ECEF")]
    Place(f64),
    /// A derivative of an implausible size.
    #[error("{what} of {value:e}: expected at most {most:e}")]
    Rate {
        /// Name of the derivative, with its unit.
        what: &'static str,
        /// Size of the derivative.
        value: f64,
        /// The most that is taken.
        most: f64,
    },
    /// A time before the scene's start.
    #[error("{0} s: expected a time after the scene's start")]
    BeforeStart(f64),
    /// A time beyond any that can be waited for.
    #[error("{0:e} s while the scene is at {1} s: expected at most {MOST_AHEAD_S} s ahead")]
    Ahead(f64, f64),
    /// A time that a push which waits or steers has already.
    #[error("{0} s again")]
    Duplicate(f64),
    /// A time before that of the push which steers.
    #[error("{0} s after {1} s: out of order")]
    OutOfOrder(f64, f64),
    /// More pushes ahead of their time than are kept.
    #[error("{MOST_WAITING} pushes ahead of their time wait already")]
    TooMany,
    /// A jump that no tick can make.
    #[error("{0:.0} m from where the vehicle is: expected at most {1:.0} m; the scene's [motion] says where it begins")]
    Far(f64, f64),
}

/// Origin of a tick's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// No push has arrived.
    Waiting,
    /// A new push steered it.
    Fresh,
    /// An older push was extrapolated.
    Extrapolated,
    /// A snap: the tick moved to the newest push within its own length.
    Snap,
}

impl Kind {
    /// All kinds with their words in a log.
    pub const NAMES: [(&'static str, Self); 4] = [
        ("waiting", Self::Waiting),
        ("fresh", Self::Fresh),
        ("extrapolated", Self::Extrapolated),
        ("snap", Self::Snap),
    ];

    /// Word of the kind in a log.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }
}

/// Result of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// The motion at its end.
    pub end: Motion,
    /// The turn there, where the attitude is pushed.
    pub turn: Option<Turn>,
    /// Origin of the tick's motion.
    pub kind: Kind,
    /// The push that steered it for the first time, by its number; an older one, or none, gives `None`.
    pub news: Option<u64>,
    /// Distance in metres of the tick's end from the pushed motion.
    pub gap_m: f64,
    /// Age in seconds of the push at the tick's end; negative while the push lies ahead.
    pub age_s: f64,
    /// The largest jerk of the tick, in m/s³.
    pub jerk_mps3: f64,
}

/// A push with all derivatives.
#[derive(Clone, Copy, Debug)]
struct State {
    number: u64,
    t_s: f64,
    motion: Motion,
    jerk_mps3: Vector3<f64>,
    /// True if the velocity was pushed.
    own_velocity: bool,
    turn: Option<PushedTurn>,
}

/// Makes ticks of pushes.
#[derive(Clone, Debug)]
pub struct Joiner {
    joining: Joining,
    /// Length of a tick, in seconds.
    tick_s: f64,
    /// Motion that is transmitted now, and its time.
    now: Motion,
    now_s: f64,
    /// The push in use, and those that wait for their time, by time.
    used: Option<State>,
    waiting: VecDeque<State>,
    /// Number of pushes taken so far.
    taken: u64,
    /// State of the attitude, if it is pushed.
    turning: Option<Turning>,
}

impl Joiner {
    /// Begins with `now`; a tick lasts `tick_s`.
    pub fn new(joining: Joining, tick_s: f64, now: Motion) -> Self {
        Self { joining, tick_s, now, now_s: 0.0, used: None, waiting: VecDeque::new(), taken: 0, turning: None }
    }

    /// Adds a pushed attitude, which is `first` before the first push.
    pub fn turning(self, first: Option<Turn>) -> Self {
        Self { turning: first.map(Turning::new), ..self }
    }

    /// Takes a push, and returns its number. Pushes that wait are used by their times, in whatever order they
    /// came; of too many, the one that lies furthest ahead is dropped.
    ///
    /// # Errors
    /// Reason for which it is not taken; nothing changes then.
    pub fn offer(&mut self, push: &Push) -> Result<u64, Refusal> {
        self.check(push)?;
        let place = self.waiting.partition_point(|waiting| waiting.t_s < push.t_s);
        let before = place.checked_sub(1).map_or(self.used.as_ref(), |last| self.waiting.get(last));
        match before {
            Some(before) if push.t_s < before.t_s => return Err(Refusal::OutOfOrder(push.t_s, before.t_s)),
            Some(before) if push.t_s == before.t_s => return Err(Refusal::Duplicate(push.t_s)),
            _ if self.waiting.get(place).is_some_and(|after| after.t_s == push.t_s) => {
                return Err(Refusal::Duplicate(push.t_s));
            }
            _ if place >= MOST_WAITING => return Err(Refusal::TooMany),
            _ => {}
        }
        let near = before.filter(|before| push.t_s - before.t_s <= self.joining.hold_s.max(self.joining.join_s));
        let zero = Vector3::zeros();
        let velocity_mps = push.velocity_mps.unwrap_or_else(|| {
            near.map_or(zero, |before| (push.position_m - before.motion.position_m) / (push.t_s - before.t_s))
        });
        let acceleration_mps2 = push.acceleration_mps2.unwrap_or_else(|| {
            let near = near.filter(|before| push.velocity_mps.is_some() && before.own_velocity);
            near.map_or(zero, |before| (velocity_mps - before.motion.velocity_mps) / (push.t_s - before.t_s))
        });
        let motion = Motion { position_m: push.position_m, velocity_mps, acceleration_mps2 };
        let state = State {
            number: self.taken,
            t_s: push.t_s,
            motion,
            jerk_mps3: push.jerk_mps3.unwrap_or(zero),
            own_velocity: push.velocity_mps.is_some(),
            turn: push.turn,
        };
        self.waiting.truncate(MOST_WAITING - 1);
        self.waiting.insert(place, state);
        self.taken += 1;
        Ok(state.number)
    }

    fn check(&self, push: &Push) -> Result<(), Refusal> {
        let rates = [
            ("m/s", push.velocity_mps, MOST_SPEED_MPS),
            ("m/s2", push.acceleration_mps2, MOST_ACCELERATION_MPS2),
            ("m/s3", push.jerk_mps3, MOST_JERK_MPS3),
        ];
        let radius_m = push.position_m.norm();
        let finite = |value: &Vector3<f64>| value.iter().all(|x| x.is_finite());
        if !push.t_s.is_finite()
            || !finite(&push.position_m)
            || rates.iter().any(|(_, rate, _)| rate.is_some_and(|rate| !finite(&rate)))
            || push.turn.is_some_and(|turn| !turn.is_finite())
        {
            return Err(Refusal::NotFinite);
        }
        if !(LEAST_RADIUS_M..=MOST_RADIUS_M).contains(&radius_m) {
            return Err(Refusal::Place(radius_m));
        }
        for (what, rate, most) in rates {
            if let Some(value) = rate.map(|rate| rate.norm()).filter(|value| *value > most) {
                return Err(Refusal::Rate { what, value, most });
            }
        }
        if let Some(value) = push.turn.map(|turn| turn.turn().rate_radps.norm()).filter(|x| *x > MOST_TURNING_RADPS) {
            return Err(Refusal::Rate { what: "rad/s", value, most: MOST_TURNING_RADPS });
        }
        if push.t_s < 0.0 {
            return Err(Refusal::BeforeStart(push.t_s));
        }
        if push.t_s > self.now_s + MOST_AHEAD_S {
            return Err(Refusal::Ahead(push.t_s, self.now_s));
        }
        let (away_m, most_m) = ((push.position_m - self.now.position_m).norm(), SNAP_SPEED_MPS * self.tick_s);
        if away_m > most_m { Err(Refusal::Far(away_m, most_m)) } else { Ok(()) }
    }

    /// Makes the tick from `from_s` to `to_s`, which follows the one before.
    pub fn tick(&mut self, from_s: f64, to_s: f64) -> Tick {
        self.now_s = to_s;
        let horizon_s = from_s + self.joining.join_s.max(to_s - from_s);
        let known = self.used.as_ref().map(|state| state.number);
        while let Some(next) = self.waiting.front() {
            // The first push may lie a little ahead; others wait for their time.
            let ahead_s = if self.used.is_none() { self.joining.hold_s } else { 0.0 };
            if next.t_s > horizon_s + ahead_s {
                break;
            }
            self.used = self.waiting.pop_front();
            if let (Some(turning), Some(state)) = (&mut self.turning, &self.used)
                && let Some(turn) = &state.turn
            {
                turning.take(state.t_s, turn, self.joining.hold_s);
            }
        }
        let turn = self.turning.as_mut().map(|turning| turning.tick((from_s, to_s, horizon_s), self.joining.hold_s));
        let Some(state) = self.used else {
            let end = self.now;
            return Tick { end, turn, kind: Kind::Waiting, news: None, gap_m: 0.0, age_s: 0.0, jerk_mps3: 0.0 };
        };
        let hold_s = self.joining.hold_s;
        let left = Knot { t_s: from_s, motion: self.now };
        let right = Knot { t_s: horizon_s, motion: state.at(horizon_s, hold_s) };
        let due = state.at(to_s, hold_s);
        let news = Some(state.number).filter(|number| known != Some(*number));
        let needed_mps3 = largest_jerk_mps3(&left, &right);
        // A number that is none is no small one.
        let (end, kind, jerk_mps3) = if needed_mps3 <= self.joining.max_jerk_mps3 {
            let kind = if news.is_some() { Kind::Fresh } else { Kind::Extrapolated };
            (between(&left, &right, to_s), kind, needed_mps3)
        } else {
            (due, Kind::Snap, largest_jerk_mps3(&left, &Knot { t_s: to_s, motion: due }))
        };
        self.now = end;
        let gap_m = (end.position_m - due.position_m).norm();
        Tick { end, turn, kind, news, gap_m, age_s: to_s - state.t_s, jerk_mps3 }
    }
}

impl State {
    /// Extrapolated to `t_s`: past `hold_s` the acceleration fades over as long, and the velocity stays.
    fn at(&self, t_s: f64, hold_s: f64) -> Motion {
        let kept_s = (t_s - self.t_s).min(hold_s);
        let mut motion = self.motion.extrapolated(kept_s);
        motion.position_m += self.jerk_mps3 * (kept_s * kept_s * kept_s / 6.0);
        motion.velocity_mps += self.jerk_mps3 * (kept_s * kept_s / 2.0);
        motion.acceleration_mps2 += self.jerk_mps3 * kept_s;
        let past_s = t_s - self.t_s - kept_s;
        if past_s <= 0.0 {
            return motion;
        }
        let fading_s = past_s.min(hold_s);
        let pull = motion.acceleration_mps2;
        let ends = |whole: f64| if hold_s > 0.0 { whole / hold_s } else { 0.0 };
        motion.position_m += motion.velocity_mps * fading_s
            + pull * (fading_s * fading_s * 0.5 - ends(fading_s * fading_s * fading_s / 6.0));
        motion.velocity_mps += pull * (fading_s - ends(0.5 * fading_s * fading_s));
        motion.acceleration_mps2 = if past_s < hold_s { pull * (1.0 - past_s / hold_s) } else { Vector3::zeros() };
        motion.position_m += motion.velocity_mps * (past_s - fading_s);
        motion
    }
}

/// The largest jerk of the quintic between two knots, of nine positions in it.
fn largest_jerk_mps3(left: &Knot, right: &Knot) -> f64 {
    let [third, fourth, fifth] = third_fourth_fifth(left, right);
    let h = right.t_s - left.t_s;
    (0..=PLACES).fold(0.0, |most, place| {
        let x = f64::from(place) / f64::from(PLACES);
        let jerk = (third * 6.0 + (fourth * 24.0 + fifth * (60.0 * x)) * x) / (h * h * h);
        // Of a number that is none, the sum stays none.
        if jerk.norm() <= most { most } else { jerk.norm() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 0.01;

    fn joining() -> Joining {
        Joining { tick_samples: 26_000, join_s: 0.1, hold_s: 0.5, max_jerk_mps3: 2e4 }
    }

    /// A circle of 100 m at 20 m/s, 500 m above a position.
    fn circle(t_s: f64) -> Motion {
        let (radius_m, turns) = (100.0, 0.2);
        let (sin, cos) = libm::sincos(turns * t_s);
        Motion {
            position_m: Vector3::new(4_000_000.0 + radius_m * cos, 4_900_000.0 + radius_m * sin, 500.0),
            velocity_mps: Vector3::new(-sin, cos, 0.0) * (radius_m * turns),
            acceleration_mps2: Vector3::new(-cos, -sin, 0.0) * (radius_m * turns * turns),
        }
    }

    fn run(joiner: &mut Joiner, ticks: u64, mut offer: impl FnMut(u64, &mut Joiner)) -> Vec<Tick> {
        (0..ticks)
            .map(|tick| {
                offer(tick, joiner);
                joiner.tick(tick as f64 * TICK_S, (tick + 1) as f64 * TICK_S)
            })
            .collect()
    }

    #[test]
    fn pushes_with_jitter_and_losses_are_followed_within_a_millimetre_and_without_a_step() {
        let mut joiner = Joiner::new(joining(), TICK_S, circle(0.0));
        let mut before = circle(0.0);
        let ticks = run(&mut joiner, 1000, |tick, joiner| {
            // Up to 30 ms late, in order; one of twenty is lost.
            let late_s = 0.03 * ((tick * 7919 % 101) as f64 / 101.0);
            if tick % 20 != 3 {
                let _ = joiner.offer(&Push::of(
                    tick as f64 * TICK_S - late_s + 0.04,
                    &circle(tick as f64 * TICK_S - late_s + 0.04),
                ));
            }
        });
        for (tick, made) in (1_u64..).zip(&ticks) {
            assert_ne!(made.kind, Kind::Snap);
            let truth = circle(tick as f64 * TICK_S);
            // Jerk 0.8 m/s³ over 0.07 s of extrapolation is 5e-5 m; the first join begins at rest of nothing.
            assert!((made.end.position_m - truth.position_m).norm() < 1e-3, "{tick}");
            // From tick to tick no more than speed and acceleration explain: 0.2 m and half a millimetre.
            let moved = before.extrapolated(TICK_S).position_m;
            assert!((made.end.position_m - moved).norm() < 1e-4, "{tick}");
            before = made.end;
        }
        let extrapolated = ticks.iter().filter(|tick| tick.kind == Kind::Extrapolated).count();
        assert!(extrapolated >= 50, "{extrapolated}");
    }

    #[test]
    fn a_displaced_push_is_joined_smoothly_and_a_far_one_snaps_and_is_counted() {
        let start = circle(0.0);
        let still = Motion::at_rest(start.position_m);
        let aside = |away_m: f64| Motion::at_rest(start.position_m + Vector3::new(0.0, 0.0, away_m));
        let mut joiner = Joiner::new(joining(), TICK_S, still);
        // 0.2 m in 0.1 s: 60 × 0.2 / 0.001 = 12 000 m/s³.
        let near = run(&mut joiner, 60, |tick, joiner| {
            let _ = joiner.offer(&Push::of(0.1 + tick as f64 * TICK_S, &aside(0.2)));
        });
        assert!(near.iter().all(|tick| tick.kind == Kind::Fresh));
        assert!((near[0].jerk_mps3 - 12_000.0).abs() < 1.0, "{}", near[0].jerk_mps3);
        assert!((near[59].end.position_m - aside(0.2).position_m).norm() < 1e-4);
        let steps = near.windows(2).map(|w| (w[1].end.acceleration_mps2 - w[0].end.acceleration_mps2).norm());
        assert!(steps.fold(0.0, f64::max) <= 12_000.0 * TICK_S);
        // 50 m: one tick goes there, the next is quiet.
        joiner.offer(&Push::of(2.0, &aside(50.0))).unwrap();
        let far = joiner.tick(2.0, 2.01);
        assert_eq!((far.kind, far.end), (Kind::Snap, aside(50.0)));
        assert_eq!(joiner.tick(2.01, 2.02).kind, Kind::Extrapolated);
        // Half the globe away no tick can go.
        assert!(matches!(joiner.offer(&Push::at(3.0, -start.position_m)), Err(Refusal::Far(..))));
    }

    #[test]
    fn without_news_the_acceleration_fades_and_the_velocity_stays() {
        let mut joiner = Joiner::new(joining(), TICK_S, circle(0.0));
        joiner.offer(&Push::of(0.0, &circle(0.0))).unwrap();
        let ticks = run(&mut joiner, 200, |_, _| {});
        let end = ticks[199].end;
        // Half a second kept and half of the next one: 4 m/s² for 0.75 s.
        let expected = circle(0.0).velocity_mps + circle(0.0).acceleration_mps2 * 0.75;
        assert!((end.velocity_mps - expected).norm() < 1e-6, "{}", end.velocity_mps);
        assert!(end.acceleration_mps2.norm() < 1e-6);
        let largest = ticks.iter().map(|tick| tick.end.acceleration_mps2.norm()).fold(0.0, f64::max);
        // Ticks that each aim again are a loop of third order, which overshoots where the fade begins.
        assert!((4.0 - 1e-6..4.04).contains(&largest), "{largest}");
    }

    #[test]
    fn places_alone_are_followed_by_their_slope() {
        let mut joiner = Joiner::new(joining(), TICK_S, circle(0.0));
        let ticks = run(&mut joiner, 500, |tick, joiner| {
            let t_s = tick as f64 * TICK_S;
            let _ = joiner.offer(&Push::at(t_s, circle(t_s).position_m));
        });
        // The slope is half an interval old, 0.02 m/s over 0.1 s, and 4 m/s² are missed over 0.1 s: 0.02 m.
        let miss = |tick: usize| (ticks[tick].end.position_m - circle((tick + 1) as f64 * TICK_S).position_m).norm();
        assert!((20..500).all(|tick| miss(tick) < 0.05), "{}", miss(499));
    }

    #[test]
    fn what_makes_no_sense_is_refused_by_name_and_changes_nothing() {
        let start = circle(0.0);
        let mut joiner = Joiner::new(joining(), TICK_S, start);
        let good = Push::of(1.0, &start);
        let with = |change: &dyn Fn(&mut Push)| {
            let mut push = good;
            change(&mut push);
            push
        };
        assert_eq!(joiner.offer(&good), Ok(0));
        let refused = [
            (with(&|p| p.t_s = f64::NAN), "NotFinite"),
            (with(&|p| p.position_m.x = f64::INFINITY), "NotFinite"),
            (with(&|p| p.velocity_mps = Some(Vector3::repeat(f64::NAN))), "NotFinite"),
            (with(&|p| p.position_m *= 0.5), "Place"),
            (with(&|p| p.position_m *= 1e9), "Place"),
            (with(&|p| p.velocity_mps = Some(Vector3::repeat(1e8))), "Rate"),
            (with(&|p| p.jerk_mps3 = Some(Vector3::repeat(1e12))), "Rate"),
            (with(&|p| p.t_s = -0.5), "BeforeStart"),
            (good, "Duplicate"),
            (with(&|p| p.t_s = 1e12), "Ahead"),
            (with(&|p| p.t_s = MOST_AHEAD_S + 1.0), "Ahead"),
        ];
        for (push, name) in refused {
            let refusal = joiner.offer(&push).unwrap_err();
            assert!(format!("{refusal:?}").starts_with(name), "{refusal:?}");
        }
        for k in 0..MOST_WAITING as u64 - 1 {
            assert_eq!(joiner.offer(&Push::of(2.0 + k as f64, &start)), Ok(k + 1));
        }
        assert_eq!(joiner.offer(&Push::of(3000.0, &start)), Err(Refusal::TooMany));
        // One that comes sooner is taken in the place of the furthest.
        assert_eq!(joiner.offer(&Push::of(0.9, &start)), Ok(MOST_WAITING as u64));
        assert_eq!(joiner.waiting.len(), MOST_WAITING);
        joiner.tick(0.9, 0.91);
        assert_eq!(joiner.offer(&Push::of(0.9, &start)), Err(Refusal::OutOfOrder(0.9, 1.0)));
    }

    #[test]
    fn a_push_far_ahead_waits_and_later_ones_steer_as_if_it_had_not_come() {
        let ticks = |far: bool| {
            let mut joiner = Joiner::new(joining(), TICK_S, circle(0.0));
            run(&mut joiner, 100, |tick, joiner| {
                if far && tick % 10 == 5 {
                    // Refused by its value, and not refused: an hour ahead and a minute.
                    assert!(matches!(joiner.offer(&Push::of(7200.0, &circle(0.0))), Err(Refusal::Ahead(..))));
                    joiner.offer(&Push::of(60.0 + tick as f64, &circle(0.0))).unwrap();
                }
                let t_s = tick as f64 * TICK_S;
                joiner.offer(&Push::of(t_s, &circle(t_s))).unwrap();
            })
        };
        let ends = |far: bool| ticks(far).into_iter().map(|tick| (tick.kind, tick.end)).collect::<Vec<_>>();
        assert!(ends(true) == ends(false));
    }
}
