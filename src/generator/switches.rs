//! Switches that act while a scene is sent: powers of satellites, spoofers and jammers, and satellites whose
//! ranges drift.
//!
//! A change holds from the first sample of a tick on. Signals have their polynomials tick by tick, so every
//! change is exact to the sample, and a replay that knows of later ones sends the same bits. Limits: changes
//! are bounded in number ([`MOST`]); the range error of a satellite is in code and carrier alike.

use std::collections::BTreeMap;
use std::sync::{PoisonError, RwLock};

use crate::knots::Arrival;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::Sv;
use gnss::time::Rate;

/// Largest number of changes in a scene.
pub const MOST: usize = 100_000;

/// Source that can be switched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// A true satellite, all its signals.
    Satellite(Sv),
    /// A source of interference by its number, from 1.
    Jammer(u64),
    /// A spoofer by its number, from 1.
    Spoofer(usize),
}

/// Switch state of a source from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switched {
    /// Factor on its power.
    pub gain: f64,
    /// Error of pseudorange and carrier in metres at sample `since`.
    pub range_error_m: f64,
    /// Growth of the range error, in m/s.
    pub range_error_mps: f64,
    /// First sample of the tick from which the state applies.
    pub since: u64,
}

impl Default for Switched {
    /// State of the scene without switches.
    fn default() -> Self {
        Self { gain: 1.0, range_error_m: 0.0, range_error_mps: 0.0, since: 0 }
    }
}

impl Switched {
    /// Range error in metres at a position between samples, as if the satellite's clock were behind by as
    /// much.
    pub fn range_error_m(&self, sample: f64, rate: Rate) -> f64 {
        self.range_error_m + self.range_error_mps * (sample - self.since as f64) / rate.hz()
    }

    /// Applies the switch state to an arrival at a position between samples.
    pub fn act(&self, arrival: Arrival, carrier_hz: f64, sample: f64, rate: Rate) -> Arrival {
        if *self == Self::default() {
            return arrival;
        }
        let range_error_s = self.range_error_m(sample, rate) / SPEED_OF_LIGHT_MPS;
        Arrival {
            delay_s: arrival.delay_s + range_error_s,
            carrier_cycles: arrival.carrier_cycles + carrier_hz * range_error_s,
            cn0_hz: arrival.cn0_hz * self.gain,
        }
    }
}

/// Range error of a satellite from a sample on, until its next change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stray {
    /// The satellite.
    pub sv: Sv,
    /// First sample of it.
    pub first: u64,
    /// Range error at that time, in metres.
    pub m: f64,
    /// Rate of the range error, in m/s.
    pub mps: f64,
    /// Jump of the range error at that time, in metres.
    pub step_m: f64,
}

/// Switches of a scene; clones of their `Arc` share them.
#[derive(Debug)]
pub struct Switches {
    tick_samples: u64,
    rows: RwLock<BTreeMap<Source, Vec<(u64, Switched)>>>,
}

impl Switches {
    /// Creates switches of which none has been used. A tick has `tick_samples` samples.
    pub fn new(tick_samples: u64) -> Self {
        Self { tick_samples: tick_samples.max(1), rows: RwLock::new(BTreeMap::new()) }
    }

    /// Samples of a tick.
    pub fn tick_samples(&self) -> u64 {
        self.tick_samples
    }

    /// Number of the tick in which a sample lies.
    pub fn tick_of(&self, sample: u64) -> u64 {
        sample / self.tick_samples
    }

    /// Changes a source from `tick` on, which must not be before its last change. Returns `false` if there
    /// are too many changes.
    pub fn set(&self, source: Source, tick: u64, change: impl FnOnce(&mut Switched)) -> bool {
        let mut rows = self.rows.write().unwrap_or_else(PoisonError::into_inner);
        if rows.values().map(Vec::len).sum::<usize>() >= MOST {
            return false;
        }
        let changes = rows.entry(source).or_default();
        let mut switched = changes.last().map_or_else(Switched::default, |(_, switched)| *switched);
        let error = (switched.range_error_m, switched.range_error_mps);
        change(&mut switched);
        if (switched.range_error_m, switched.range_error_mps) != error {
            switched.since = tick * self.tick_samples;
        }
        match changes.last_mut().filter(|(last, _)| *last == tick) {
            Some((_, last)) => *last = switched,
            None => changes.push((tick, switched)),
        }
        true
    }

    /// Satellites with range errors: each change by its first sample, with its step.
    pub fn strays(&self, rate: Rate) -> Vec<Stray> {
        let rows = self.rows.read().unwrap_or_else(PoisonError::into_inner);
        let mut found = Vec::new();
        for (source, changes) in rows.iter() {
            let Source::Satellite(sv) = *source else { continue };
            let mut before = Switched::default();
            for (tick, now) in changes {
                let first = tick * self.tick_samples;
                if now.since == first
                    && (now.range_error_m, now.range_error_mps) != (before.range_error_m, before.range_error_mps)
                {
                    let reached_m =
                        before.range_error_m + before.range_error_mps * rate.elapsed_s(first - before.since);
                    found.push(Stray {
                        sv,
                        first,
                        m: now.range_error_m,
                        mps: now.range_error_mps,
                        step_m: now.range_error_m - reached_m,
                    });
                }
                before = *now;
            }
        }
        found
    }

    /// Switch state of a source in a tick.
    pub fn at(&self, source: Source, tick: u64) -> Switched {
        let rows = self.rows.read().unwrap_or_else(PoisonError::into_inner);
        let Some(changes) = rows.get(&source) else { return Switched::default() };
        let next = changes.partition_point(|(from, _)| *from <= tick);
        next.checked_sub(1).and_then(|last| changes.get(last)).map_or_else(Switched::default, |(_, switched)| *switched)
    }

    /// Switch state in a tick of the source with this constellation number (0 for the true one).
    pub fn of_constellation(&self, number: usize, sv: Sv, tick: u64) -> Switched {
        self.at(if number == 0 { Source::Satellite(sv) } else { Source::Spoofer(number) }, tick)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_holds_from_its_tick_on_and_later_ones_are_not_seen_before() {
        let switches = Switches::new(1000);
        let source = Source::Satellite(Sv::gps(5));
        assert!(switches.set(source, 3, |row| row.gain = 0.1));
        assert!(switches.set(source, 3, |row| row.range_error_mps = 2.0));
        assert!(switches.set(source, 7, |row| row.gain = 0.0));
        assert_eq!(switches.at(source, 2), Switched::default());
        let slipping = Switched { gain: 0.1, range_error_m: 0.0, range_error_mps: 2.0, since: 3000 };
        assert_eq!((switches.at(source, 3), switches.at(source, 6)), (slipping, slipping));
        assert_eq!(switches.at(source, 7), Switched { gain: 0.0, ..slipping });
        assert_eq!(switches.at(Source::Spoofer(1), 7), Switched::default());
        // Two metres a second from sample 3000 on, a megasample a second.
        assert!(switches.set(source, 503, |row| (row.range_error_m, row.range_error_mps) = (1.0, 0.0)));
        let strays = switches.strays(Rate::from_hz(1e6).unwrap());
        let stray = |first, m, mps, step_m| Stray { sv: Sv::gps(5), first, m, mps, step_m };
        assert_eq!(strays, [stray(3000, 0.0, 2.0, 0.0), stray(503_000, 1.0, 0.0, 0.0)]);
        let arrival = Arrival { delay_s: 0.07, carrier_cycles: 1.1e8, cn0_hz: 1e4 };
        let rate = Rate::from_hz(1e6).unwrap();
        // Half a second on: a metre, 3.3 ns and 5.25 cycles.
        let late = slipping.act(arrival, 1_575.42e6, 503_000.0, rate);
        assert!((late.delay_s - arrival.delay_s - 1.0 / SPEED_OF_LIGHT_MPS).abs() < 1e-16);
        assert!((late.carrier_cycles - arrival.carrier_cycles - 1_575.42e6 / SPEED_OF_LIGHT_MPS).abs() < 1e-7);
        assert_eq!(late.cn0_hz, 1e3);
        assert_eq!(Switched::default().act(arrival, 1_575.42e6, 5.0, rate), arrival);
    }
}
