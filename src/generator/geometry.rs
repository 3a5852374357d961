//! Quantities that all signals of a satellite share on arrival: orbit, light time, clocks and position in the
//! sky.
//!
//! It is computed once for an instant, and kept for the other signals and for other front ends that ask for
//! the same one: those at one sample rate do. What is kept is what would be computed again, so no bit depends
//! on who asks first. Where nodes are dense the same holds of the antenna ([`Places`]), which is one for all
//! satellites. Limits: instants that are further back than 1024 others are computed again.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::clock::ReceiverClock;
use crate::scene::Scene;
use crate::sky::{Emission, Place};
use gnss::broadcast::OrbitError;
use gnss::time::Epoch;

/// Instants that are kept of a satellite: some 300 KB.
const KEPT: usize = 1024;

/// Arrival of one satellite of a constellation at one time of the receiver's clock, for any signal.
#[derive(Clone, Debug)]
pub struct Arriving {
    /// Time and position of emission.
    pub emission: Emission,
    /// Clock offset of the receiver minus that of the sender, in seconds.
    pub bias_s: f64,
    /// Delay of an emitter's wave beyond that at the antenna for which it is meant, in seconds.
    pub path_s: f64,
    /// Factor on the power of every ray.
    pub gain: f64,
}

/// Time of the receiver's clock, whole seconds and the bits of the fraction, and the bits of the guess of
/// the light time: the last digit of an emission may depend on that.
type Key = (i64, u64, u64);

/// Stored arrivals of one satellite.
#[derive(Debug, Default)]
pub struct Geometry {
    known: Mutex<BTreeMap<Key, Option<Arriving>>>,
}

impl Geometry {
    /// Returns the arrival at the time `local` of the receiver's clock. If it is not stored, `find` computes
    /// it.
    ///
    /// # Errors
    /// Errors of `find`.
    pub fn at(
        &self,
        local: Epoch,
        guess_s: f64,
        find: impl FnOnce() -> Result<Option<Arriving>, OrbitError>,
    ) -> Result<Option<Arriving>, OrbitError> {
        let key = (local.seconds(), local.fraction().to_bits(), guess_s.to_bits());
        // Who asks for the same instant meanwhile waits for it: it would compute the same.
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = known.get(&key) {
            return Ok(found.clone());
        }
        let found = find()?;
        known.insert(key, found.clone());
        while known.len() > KEPT {
            known.pop_first();
        }
        Ok(found)
    }
}

/// Antenna positions at the stored times of the receiver's clock.
#[derive(Debug, Default)]
pub struct Places {
    known: Mutex<BTreeMap<(i64, u64), Place>>,
}

impl Places {
    /// Returns the antenna at the time `local` of the clock. If it is not stored, `find` computes it.
    pub fn at(&self, local: Epoch, find: impl FnOnce() -> Place) -> Place {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let place = *known.entry((local.seconds(), local.fraction().to_bits())).or_insert_with(find);
        while known.len() > KEPT {
            known.pop_first();
        }
        place
    }
}

/// True if satellites arrive identically in two scenes at one time of the clock.
pub fn is_shared(one: &Scene, other: &Scene) -> bool {
    Arc::ptr_eq(&one.catalogue, &other.catalogue)
        && one.clock.start == other.clock.start
        && one.trajectory == other.trajectory
        && one.spoofers == other.spoofers
        && is_same_clock(&one.receiver_clock, &other.receiver_clock)
}

fn is_same_clock(one: &ReceiverClock, other: &ReceiverClock) -> bool {
    let steady = |clock: &ReceiverClock| (clock.bias_s, clock.drift, clock.ageing_per_s);
    let parts =
        |clock: &ReceiverClock| (clock.shaking.as_ref().map(Arc::as_ptr), clock.oscillator.as_ref().map(Arc::as_ptr));
    steady(one) == steady(other) && parts(one) == parts(other)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use nalgebra::Vector3;

    use super::*;
    use crate::catalogue::Catalogue;
    use crate::sky::{LIGHT_TIME_S, emission_near};
    use crate::vehicle::Motion;
    use gnss::rinex;
    use gnss::satellite::Sv;

    #[test]
    fn an_instant_is_computed_once_and_memory_is_bounded() {
        let (catalogue, _) = Catalogue::new(rinex::embedded().unwrap().ephemerides);
        let motion = Motion::at_rest(Vector3::new(6.4e6, 0.0, 0.0));
        let (geometry, computed) = (Geometry::default(), Cell::new(0));
        let ask = |k: usize, guess_s: f64| {
            let local = Epoch::from_week(1590, 377_000.0 + 0.25 * k as f64);
            let find = || {
                computed.set(computed.get() + 1);
                let emission = emission_near(&catalogue, Sv::gps(13), local, &motion, guess_s)?;
                Ok(emission.map(|emission| Arriving { emission, bias_s: 0.0, path_s: 0.0, gain: 1.0 }))
            };
            geometry.at(local, guess_s, find).unwrap().unwrap().emission.travel_s
        };
        let first = ask(0, LIGHT_TIME_S);
        assert_eq!((first, computed.get()), (ask(0, LIGHT_TIME_S), 1));
        // Another guess is another question.
        ask(0, first);
        assert_eq!(computed.get(), 2);
        (0..2 * KEPT).for_each(|k| assert!(ask(k, LIGHT_TIME_S) > 0.06));
        assert_eq!(geometry.known.lock().unwrap().len(), KEPT);
    }
}
