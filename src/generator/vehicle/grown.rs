//! Motion that becomes known while it is sent, tick by tick.
//!
//! A tick is a fixed number of samples on the absolute grid of the samples; a knot stands at the true time of
//! each of its ends, and knots are joined like those of any other motion. All copies of the trajectory share
//! the knots, so what was composed before sees what is pushed later. Whoever looks no further than the last
//! knot sees the same bits whether later knots are there or not: that makes a replay equal to the original.
//! Limits: where only the last ticks are kept, earlier times are those of the oldest one.

use std::collections::VecDeque;
use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use super::turn::Turn;
use super::{Knot, Motion, between};

/// Parameters by which pushed motion becomes ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joining {
    /// Samples of a tick.
    pub tick_samples: u64,
    /// Time in seconds in which the transmitted motion joins the pushed one.
    pub join_s: f64,
    /// Age of the newest push up to which its acceleration is kept.
    pub hold_s: f64,
    /// Largest jerk of a join in m/s³; a join that needs more becomes a snap.
    pub max_jerk_mps3: f64,
}

/// The knots of a motion that grows.
#[derive(Debug)]
pub struct Grown {
    joining: Joining,
    rows: RwLock<Rows>,
}

#[derive(Debug)]
struct Rows {
    rows: VecDeque<Row>,
    /// Ticks appended so far, and how many knots are kept.
    ticks: u64,
    keep: usize,
}

/// A knot, and the heading of the nose there in turns, whole ones counted; where the attitude is pushed, the
/// turn there.
#[derive(Clone, Copy, Debug)]
struct Row {
    knot: Knot,
    heading_cycles: f64,
    turn: Option<Turn>,
}

/// Two trajectories are the same where they share their knots.
impl PartialEq for Grown {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Grown {
    /// One knot, at which the first tick begins; the newest `keep` knots are kept.
    pub(super) fn new(joining: Joining, first: Knot, keep: usize) -> Self {
        let rows = VecDeque::from([Row { knot: first, heading_cycles: 0.0, turn: None }]);
        Self { joining, rows: RwLock::new(Rows { rows, ticks: 0, keep: keep.max(2) }) }
    }

    /// Returns the parameters by which pushed motion becomes ticks.
    pub fn joining(&self) -> Joining {
        self.joining
    }

    /// Ticks whose end is known.
    pub fn ticks(&self) -> u64 {
        self.read().ticks
    }

    /// The newest knot.
    pub fn last(&self) -> Option<Knot> {
        self.read().rows.back().map(|row| row.knot)
    }

    /// Sets the first knot again, before the first tick.
    pub(super) fn begin(&self, first: Knot, heading_cycles: f64, turn: Option<Turn>) {
        let mut rows = self.rows.write().unwrap_or_else(PoisonError::into_inner);
        if rows.ticks == 0 {
            rows.rows = VecDeque::from([Row { knot: first, heading_cycles, turn }]);
        }
    }

    /// Ends the next tick with `knot`, which must be later than the last one; `heading` is that of the nose
    /// within a turn.
    pub(super) fn append(&self, knot: Knot, heading: f64, turn: Option<Turn>) {
        let mut rows = self.rows.write().unwrap_or_else(PoisonError::into_inner);
        let last = rows.rows.back().map_or(heading, |row| row.heading_cycles);
        rows.rows.push_back(Row { knot, heading_cycles: heading + (last - heading).round(), turn });
        rows.ticks += 1;
        while rows.rows.len() > rows.keep {
            rows.rows.pop_front();
        }
    }

    /// The motion of the body `t_s` true seconds after the scene's start; `None` without a knot.
    pub(super) fn body(&self, t_s: f64) -> Option<Motion> {
        let rows = self.read();
        let (left, right) = rows.around(t_s);
        Some(match (left, right) {
            (Some(left), Some(right)) => between(&left.knot, &right.knot, t_s),
            (Some(one), None) | (None, Some(one)) => one.knot.motion.extrapolated(t_s - one.knot.t_s),
            (None, None) => return None,
        })
    }

    /// The turn that the newest knot has.
    pub fn last_turn(&self) -> Option<Turn> {
        self.read().rows.back().and_then(|row| row.turn)
    }

    /// The turn `t_s` true seconds after the scene's start, where the attitude is pushed.
    pub(super) fn turn(&self, t_s: f64) -> Option<Turn> {
        let rows = self.read();
        match rows.around(t_s) {
            (Some(a), Some(b)) => {
                let length_s = b.knot.t_s - a.knot.t_s;
                Some(a.turn?.between(&b.turn?, length_s, t_s - a.knot.t_s))
            }
            (Some(one), None) | (None, Some(one)) => Some(one.turn?.turned(t_s - one.knot.t_s)),
            (None, None) => None,
        }
    }

    /// Number of the tick in which an instant lies, 0 before the first, and when it begins.
    pub fn tick_of(&self, t_s: f64) -> (u64, f64) {
        let rows = self.read();
        let oldest = (rows.ticks + 1).saturating_sub(rows.rows.len() as u64);
        let place = rows.rows.partition_point(|row| row.knot.t_s <= t_s).saturating_sub(1);
        (oldest + place as u64, rows.rows.get(place).map_or(t_s, |row| row.knot.t_s))
    }

    /// Start time of a tick in seconds. For a tick that is no longer kept, it is that of the oldest one kept.
    pub fn begins_s(&self, tick: u64) -> Option<f64> {
        let rows = self.read();
        let oldest = (rows.ticks + 1).saturating_sub(rows.rows.len() as u64);
        rows.rows.get(tick.saturating_sub(oldest) as usize).map(|row| row.knot.t_s)
    }

    /// The counted heading between the knots around a time, straight from one to the other.
    pub fn heading_near_cycles(&self, t_s: f64) -> Option<f64> {
        let rows = self.read();
        match rows.around(t_s) {
            (Some(a), Some(b)) => {
                let share = (t_s - a.knot.t_s) / (b.knot.t_s - a.knot.t_s);
                Some(a.heading_cycles + (b.heading_cycles - a.heading_cycles) * share)
            }
            (Some(one), None) | (None, Some(one)) => Some(one.heading_cycles),
            (None, None) => None,
        }
    }

    fn read(&self) -> RwLockReadGuard<'_, Rows> {
        self.rows.read().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Rows {
    /// The last knot that is not after a time, and the next one.
    fn around(&self, t_s: f64) -> (Option<&Row>, Option<&Row>) {
        let next = self.rows.partition_point(|row| row.knot.t_s <= t_s);
        (next.checked_sub(1).and_then(|left| self.rows.get(left)), self.rows.get(next))
    }
}
