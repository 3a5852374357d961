//! Whole turns of wind-up on a body with pushed attitude: there is no known axis about which to count them.
//!
//! Geometry gives the phase modulo one. Within a tick it is unwrapped from the tick's beginning on, and from
//! one beginning to the next the whole turns are counted, satellite by satellite, in the order of ticks. So a
//! replay counts as the run did. Limits: less than half a turn a tick; a stream that begins within a scene
//! counts from there; ticks that are further back than 1024 others are those of the oldest one.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Mutex, PoisonError};

use crate::vehicle::grown::Grown;
use gnss::satellite::Sv;

/// Ticks that are kept of a satellite: some batches.
const KEPT: usize = 1024;

/// Beginnings of ticks for each satellite.
#[derive(Debug, Default)]
pub struct Counted {
    known: Mutex<BTreeMap<Sv, VecDeque<Beginning>>>,
}

/// A tick's beginning: whole turns so far, and the phase modulo one.
#[derive(Clone, Copy, Debug)]
struct Beginning {
    tick: u64,
    whole: f64,
    raw: f64,
}

impl Counted {
    /// Wind-up of `sv` at `t_s` in cycles with its whole turns. `raw` gives the phase modulo one cycle at any
    /// instant.
    pub fn cycles(&self, grown: &Grown, sv: Sv, t_s: f64, raw: impl Fn(f64) -> f64) -> f64 {
        let (tick, begins_s) = grown.tick_of(t_s);
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let ticks = known.entry(sv).or_default();
        if ticks.is_empty() {
            ticks.push_back(Beginning { tick, whole: 0.0, raw: raw(begins_s) });
        }
        while let Some(last) = ticks.back().copied().filter(|last| last.tick < tick) {
            let next = last.tick + 1;
            let now = raw(grown.begins_s(next).unwrap_or(begins_s));
            ticks.push_back(Beginning { tick: next, whole: last.whole + (last.raw - now).round(), raw: now });
            if ticks.len() > KEPT {
                ticks.pop_front();
            }
        }
        let place = ticks.partition_point(|beginning| beginning.tick <= tick).saturating_sub(1);
        let Some(beginning) = ticks.get(place).copied() else { return 0.0 };
        drop(known);
        let now = raw(t_s);
        now + beginning.whole + (beginning.raw - now).round()
    }
}
