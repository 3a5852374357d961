//! Constellations whose signals reach the antenna: the true one, or that of a spoofer.
//!
//! A spoofer sends what would arrive from the true satellites at a claimed position and by a clock of its
//! own, with the same messages; every signal of it goes through the machinery of the true ones. It may
//! begin on top of them (claiming the antenna's true motion) and drag the position off smoothly. One that
//! claims another time, or has ephemerides of its own, sends their satellites, messages and code phases.
//! An [`Emitter`] stands somewhere: its waves reach each element of an array from there. Limits: its
//! carriers are those of the claimed geometry (no phase of its own), its own path's delay is taken as
//! compensated, it knows the victim's motion and the orbits without error, atmosphere and surroundings are
//! those of the scene's time, and it repeats no fault of a satellite's clock or message.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::catalogue::Catalogue;
use crate::clock::ReceiverClock;
use crate::ray::Sight;
use crate::vehicle::{Motion, Trajectory};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::Sv;
use gnss::time::{Epoch, SampleClock};

/// Pieces of a power ramp, each linear in power: of 60 dB, a piece is 0.9 dB and off by 0.02 dB at most.
const RAMP_PIECES: u32 = 64;

/// Position for which the signals are made.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// Position of the antenna.
    Antenna,
    /// Position that moves along a trajectory of its own.
    Claimed(Box<Trajectory>),
}

/// Drag of the claimed position away from where it began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Start of the drag in true seconds since the scene's start.
    pub start_s: f64,
    /// Unit vector, ECEF.
    pub direction: Vector3<f64>,
    /// Final speed, in m/s.
    pub speed_mps: f64,
    /// Acceleration in m/s² until the final speed is reached.
    pub acceleration_mps2: f64,
}

/// Antenna of a spoofer, whose signals all come from there.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Position, ECEF.
    pub position_m: Vector3<f64>,
    /// Motion of the antenna for which the signals are meant: the first element of an array.
    pub meant_for: Trajectory,
}

/// Power over that of the true signals (what the scene's effects give at the claimed position).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advantage {
    /// Power advantage at the moment of switching on, in dB.
    pub start_db: f64,
    /// Power advantage after the ramp, in dB.
    pub end_db: f64,
    /// Duration in seconds of the ramp after switching on, linear in decibels.
    pub ramp_s: f64,
}

/// Ephemerides of a spoofer's own.
#[derive(Clone, Debug)]
pub struct OwnSky {
    /// Orbits and clocks, which are those of its messages.
    pub catalogue: Arc<Catalogue>,
    /// Satellites that it does not send.
    pub excluded: Vec<Sv>,
}

impl PartialEq for OwnSky {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.catalogue, &other.catalogue) && self.excluded == other.excluded
    }
}

/// Constellation of satellite signals that have one origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Constellation {
    /// Number of the constellation: 0 for the true satellites; spoofers count from 1.
    pub number: usize,
    /// The position that its signals are made for.
    pub place: Place,
    /// Drag of the claimed position; absent means that it stays.
    pub drag: Option<Drag>,
    /// Clock offset from GPS time at the scene's start, in seconds.
    pub clock_bias_s: f64,
    /// Rate of the clock offset, in s/s.
    pub clock_drift: f64,
    /// Antenna that sends it; `None` without a direction of its own.
    pub emitter: Option<Emitter>,
    /// Seconds by which its time and its messages lie behind the true ones.
    pub replay_s: f64,
    /// Whole seconds by which the time of its satellites and messages is ahead of the true one.
    pub ahead_s: i64,
    /// Ephemerides of its own; `None` for the scene's.
    pub sky: Option<OwnSky>,
    /// `None` for all in view of the claimed position.
    pub satellites: Option<Vec<Sv>>,
    /// Power advantage over the true signals; `None` for the true satellites.
    pub advantage: Option<Advantage>,
    /// Interval of transmission, in true seconds since the scene's start.
    pub on_s: Range<f64>,
}

impl Drag {
    /// Motion that the drag adds, `t_s` true seconds after the scene's start.
    fn motion(&self, t_s: f64) -> Motion {
        let t_s = (t_s - self.start_s).max(0.0);
        let full_s = self.speed_mps / self.acceleration_mps2;
        let (way, speed, acceleration) = if t_s == 0.0 {
            (0.0, 0.0, 0.0)
        } else if t_s < full_s {
            (0.5 * self.acceleration_mps2 * t_s * t_s, self.acceleration_mps2 * t_s, self.acceleration_mps2)
        } else {
            (self.speed_mps * (t_s - 0.5 * full_s), self.speed_mps, 0.0)
        };
        Motion {
            position_m: self.direction * way,
            velocity_mps: self.direction * speed,
            acceleration_mps2: self.direction * acceleration,
        }
    }
}

impl Constellation {
    /// Creates the constellation of the true satellites as the antenna receives them.
    pub fn authentic() -> Self {
        Self {
            number: 0,
            place: Place::Antenna,
            drag: None,
            clock_bias_s: 0.0,
            clock_drift: 0.0,
            emitter: None,
            replay_s: 0.0,
            ahead_s: 0,
            sky: None,
            satellites: None,
            advantage: None,
            on_s: f64::NEG_INFINITY..f64::INFINITY,
        }
    }

    /// Motion for which the signals are made, if the antenna's is `antenna`.
    pub fn motion(&self, antenna: &Trajectory, t_s: f64) -> Motion {
        let mut motion = match &self.place {
            Place::Antenna => self.meant_for(antenna).at(t_s),
            Place::Claimed(trajectory) => trajectory.at(t_s),
        };
        if let Some(drag) = &self.drag {
            let more = drag.motion(t_s);
            motion.position_m += more.position_m;
            motion.velocity_mps += more.velocity_mps;
            motion.acceleration_mps2 += more.acceleration_mps2;
        }
        motion
    }

    fn meant_for<'a>(&'a self, antenna: &'a Trajectory) -> &'a Trajectory {
        self.emitter.as_ref().map_or(antenna, |emitter| &emitter.meant_for)
    }

    /// Delay in seconds by which its waves reach an antenna after the one for which they are meant.
    pub fn path_s(&self, antenna: &Trajectory, t_s: f64) -> f64 {
        let Some(Emitter { position_m, meant_for }) = &self.emitter else { return 0.0 };
        let [own_m, meant_m] = [antenna, meant_for].map(|one| (one.at(t_s).position_m - position_m).norm());
        (own_m - meant_m) / SPEED_OF_LIGHT_MPS
    }

    /// Upper bound in m/s of the speed of that motion until `until_s`. `None` if the motion is pushed while
    /// the scene runs.
    pub fn fastest_mps(&self, antenna: &Trajectory, until_s: f64) -> Option<f64> {
        let trajectory = match &self.place {
            Place::Antenna => self.meant_for(antenna),
            Place::Claimed(trajectory) => trajectory,
        };
        // Between the instants that extremes are sampled at, a quintic is little faster.
        let known = trajectory.grown().is_none();
        let own_mps = if trajectory.is_static() { 0.0 } else { 1.25 * trajectory.extremes(until_s).speed_mps };
        let dragged_mps = self.drag.as_ref().map_or(0.0, |drag| drag.speed_mps);
        known.then_some(own_mps + dragged_mps)
    }

    /// Clock minus GPS time in seconds, `t_s` true seconds after the scene's start.
    pub fn clock_s(&self, t_s: f64) -> f64 {
        self.clock_bias_s + self.clock_drift * t_s
    }

    /// Time whose satellites and messages it sends, instead of the true time `at`.
    pub fn replayed(&self, at: Epoch) -> Epoch {
        self.ahead(if self.replay_s > 0.0 { at.plus_s(-self.replay_s) } else { at })
    }

    /// Time of its signals for the time `at` of a clock. Delays of its signals count from there: they stay
    /// small, and their last digit with them.
    pub fn ahead(&self, at: Epoch) -> Epoch {
        if self.ahead_s == 0 { at } else { Epoch::new(at.seconds() + self.ahead_s, at.fraction()) }
    }

    /// Sight at the scene's time, whose atmosphere and surroundings act on it; `None` where it is of that
    /// time.
    pub fn in_scene(&self, sight: &Sight) -> Option<Sight> {
        let received = Epoch::new(sight.received.seconds() - self.ahead_s, sight.received.fraction());
        (self.ahead_s != 0).then(|| Sight { received, ..sight.clone() })
    }

    /// Factor on the power of every ray.
    pub fn gain(&self, t_s: f64) -> f64 {
        let Some(Advantage { start_db, end_db, ramp_s }) = self.advantage else { return 1.0 };
        let share = if ramp_s > 0.0 { ((t_s - self.on_s.start) / ramp_s).clamp(0.0, 1.0) } else { 1.0 };
        libm::pow(10.0, (start_db + (end_db - start_db) * share) / 10.0)
    }

    /// True if it sends the signals of a satellite at all.
    pub fn sends(&self, sv: Sv) -> bool {
        self.satellites.as_ref().is_none_or(|list| list.contains(&sv))
    }

    /// Satellite whose path through the ionosphere a signal takes: `None` for a spoofer's.
    pub fn fading(&self, sv: Sv) -> Option<Sv> {
        self.advantage.is_none().then_some(sv)
    }

    /// Times in seconds at which the motion's acceleration or its slope jumps, ascending.
    pub fn motion_breaks_s(&self, antenna: &Trajectory) -> Vec<f64> {
        let mut breaks = match &self.place {
            Place::Antenna => antenna.breaks_s().to_vec(),
            Place::Claimed(trajectory) => trajectory.breaks_s().to_vec(),
        };
        if let Some(drag) = &self.drag {
            breaks.extend([drag.start_s, drag.start_s + drag.speed_mps / drag.acceleration_mps2]);
        }
        breaks.sort_by(f64::total_cmp);
        breaks
    }

    /// Times in seconds at which the motion's acceleration or its slope jumps, or the slope of the power
    /// changes.
    pub fn breaks_s(&self, antenna: &Trajectory) -> Vec<f64> {
        let mut breaks = self.motion_breaks_s(antenna);
        if let Some(Advantage { ramp_s, .. }) = self.advantage.filter(|a| a.ramp_s > 0.0) {
            breaks.extend((1..=RAMP_PIECES).map(|k| self.on_s.start + ramp_s * f64::from(k) / f64::from(RAMP_PIECES)));
        }
        breaks.extend([self.on_s.start, self.on_s.end].into_iter().filter(|t_s| t_s.is_finite()));
        breaks
    }

    /// Samples during which the constellation is on, as the receiver's clock numbers them.
    pub fn on(&self, clock: SampleClock, receiver_clock: &ReceiverClock) -> Range<u64> {
        let sample = |t_s: f64| {
            let reading_s = receiver_clock.reading_elapsed_s(clock.start, t_s);
            (reading_s * clock.rate.hz()).ceil().max(0.0) as u64
        };
        let end = if self.on_s.end.is_finite() { sample(self.on_s.end) } else { u64::MAX };
        (if self.on_s.start.is_finite() { sample(self.on_s.start) } else { 0 })..end
    }

    /// Describes the spoofer for the plan.
    pub fn describe(&self) -> String {
        let place = match &self.place {
            Place::Antenna => "the antenna's true position".to_owned(),
            Place::Claimed(trajectory) => {
                let here = gnss::earth::Geodetic::from_ecef(&trajectory.at(self.on_s.start).position_m);
                let (latitude, longitude) = (here.latitude_rad.to_degrees(), here.longitude_rad.to_degrees());
                format!("{latitude:.5} deg, {longitude:.5} deg, {:.0} m", here.height_m)
            }
        };
        let mut text = format!("claims {place} from {} s", self.on_s.start);
        if self.on_s.end.is_finite() {
            text += &format!(" to {} s", self.on_s.end);
        }
        if let Some(Advantage { start_db, end_db, ramp_s }) = self.advantage {
            text += &format!(", {end_db:+} dB");
            if ramp_s > 0.0 {
                text += &format!(" after a ramp from {start_db:+} dB in {ramp_s} s");
            }
        }
        if let Some(drag) = &self.drag {
            text += &format!(", dragged at {} m/s from {} s", drag.speed_mps, drag.start_s);
        }
        if self.emitter.is_some() {
            text += ", from one direction";
        }
        if self.ahead_s != 0 {
            text += &format!(", time {:+} s", self.ahead_s);
        }
        if self.replay_s > 0.0 {
            text += &format!(", replays {} s late", self.replay_s);
        }
        if (self.clock_bias_s, self.clock_drift) != (0.0, 0.0) {
            text += &format!(", clock {:e} s {:+e} s/s", self.clock_bias_s, self.clock_drift);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_the_integral_of_its_speed_and_begins_at_rest() {
        let drag = Drag { start_s: 5.0, direction: Vector3::x(), speed_mps: 4.0, acceleration_mps2: 0.5 };
        assert_eq!(drag.motion(5.0).position_m, Vector3::zeros());
        // Half of 8 s at 4 m/s, then 4 m/s.
        assert!((drag.motion(13.0).position_m.x - 16.0).abs() < 1e-12);
        assert!((drag.motion(20.0).position_m.x - 44.0).abs() < 1e-12);
        let h = 1e-4;
        for t_s in [6.0, 12.0, 13.5] {
            let slope = (drag.motion(t_s + h).position_m.x - drag.motion(t_s - h).position_m.x) / (2.0 * h);
            assert!((slope - drag.motion(t_s).velocity_mps.x).abs() < 1e-9, "{t_s}");
        }
    }

    #[test]
    fn power_ramps_in_decibels_from_the_moment_of_switching_on() {
        let advantage = Some(Advantage { start_db: -10.0, end_db: 6.0, ramp_s: 8.0 });
        let spoofer = Constellation { number: 1, advantage, on_s: 10.0..50.0, ..Constellation::authentic() };
        for (t_s, db) in [(10.0, -10.0), (14.0, -2.0), (18.0, 6.0), (40.0, 6.0)] {
            assert!((10.0 * libm::log10(spoofer.gain(t_s)) - db).abs() < 1e-12, "{t_s}");
        }
        assert_eq!(Constellation::authentic().gain(3.0), 1.0);
    }
}
