//! Ephemerides of both receivers, and where a satellite was when it sent.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use gnss::broadcast::Ephemeris;
use gnss::earth::{SPEED_OF_LIGHT_MPS, rotate_earth};
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Time in seconds for which an ephemeris serves beyond its interval, as the next one may not be read yet.
const GRACE_S: f64 = 600.0;

/// Ephemerides by satellite.
#[derive(Clone, Debug, Default)]
pub struct Orbits {
    sets: BTreeMap<Sv, Vec<Ephemeris>>,
}

/// Satellite at the time at which it sent what a receiver observed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// ECEF position in the axes of that time, metres.
    pub position_m: Vector3<f64>,
    /// Satellite's clock against GPS time, without group delays, which differences do not contain.
    pub clock_s: f64,
    /// Day of the year.
    pub day: f64,
}

impl Orbits {
    /// Adds ephemerides; those that are there already are not doubled.
    pub fn add(&mut self, sets: Vec<Ephemeris>) {
        for set in sets {
            let own = self.sets.entry(set.sv).or_default();
            if !own.contains(&set) {
                own.push(set);
            }
        }
    }

    /// Number of satellites.
    pub fn satellites(&self) -> usize {
        self.sets.len()
    }

    /// The ephemeris whose reference time is nearest to a time, if one serves there and reports the satellite
    /// as healthy. Both receivers of a baseline use the same one.
    pub fn serving(&self, sv: Sv, at: Epoch) -> Option<&Ephemeris> {
        let age_s = |set: &&Ephemeris| at.since(set.toe).abs();
        let nearest = self.sets.get(&sv)?.iter().min_by(|one, other| age_s(one).total_cmp(&age_s(other)))?;
        let serves = age_s(&nearest) <= 0.5 * nearest.fit_interval_s() + GRACE_S;
        Some(nearest).filter(|set| serves && set.is_healthy())
    }
}

/// Satellite at its transmission of what arrived at `label` by the receiver's clock after a pseudorange.
pub fn emission(set: &Ephemeris, label: Epoch, pseudorange_m: f64) -> Option<Emission> {
    let sent = label.plus_s(-planted!("rtk.orbits.travel", pseudorange_m, 0.0) / SPEED_OF_LIGHT_MPS);
    // The clock's argument is GPS time; one correction leaves drift times offset squared, below a picosecond.
    let rough = set.clock(sent).ok()?;
    let emitted = sent.plus_s(-rough.offset_s);
    let clock_s = set.clock(emitted).ok()?.offset_s;
    let emitted = sent.plus_s(-clock_s);
    Some(Emission { position_m: set.state(emitted).ok()?.position_m, clock_s, day: emitted.day_of_year() })
}

impl Emission {
    /// Vector from the satellite to a receiver, in the axes of the time of reception.
    pub fn to(&self, receiver_m: &Vector3<f64>) -> Vector3<f64> {
        let mut sight_m = receiver_m - self.position_m;
        // The Earth turns while the signal travels; the second pass leaves micrometres of it.
        for _ in 0..3 {
            let travel_s = sight_m.norm() / SPEED_OF_LIGHT_MPS;
            sight_m = receiver_m - rotate_earth(&self.position_m, travel_s);
        }
        sight_m
    }
}
