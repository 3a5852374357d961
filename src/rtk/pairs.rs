//! Epochs that both receivers observe, and what they have in common there.
//!
//! Each receiver labels its epochs by its own clock, milliseconds off GPS time. A satellite's position is
//! taken at the time at which it sent what each receiver observed, which follows from label and pseudorange
//! alone, so that clocks need not agree: they are common to all satellites and cancel in the differences.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use crate::carrier::Code;
use crate::error::{LEAST, RtkError};
use crate::files::Receiver;
use crate::orbits::{Emission, Orbits, emission};
use crate::site::Site;
use analysis::read::rinex_obs::{ObservedEpoch, Values};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::{Sv, System};
use gnss::signal::band_hz;
use gnss::time::Epoch;
use gnss::troposphere::delay_m;

/// Signal of a satellite.
pub type Track = (Sv, Code);

/// Largest difference between the labels of an epoch, seconds. Receivers that steer their clocks keep to half
/// a millisecond.
pub const WITHIN_S: f64 = 0.005;

/// Phase of both receivers, base first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phases {
    /// Accumulated carrier, metres.
    pub phase_m: [f64; 2],
    /// True if one of the receivers says that the count is broken since the epoch before.
    pub is_broken: bool,
    /// True if one of the receivers says that half a cycle may be missing.
    pub is_half: bool,
}

/// Signal of a satellite that both receivers observe.
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Satellite and signal.
    pub track: Track,
    /// Length of a carrier's wave, metres.
    pub wavelength_m: f64,
    /// Pseudoranges of base and rover, metres.
    pub code_m: [f64; 2],
    /// Carriers of both; `None` if one of them has none.
    pub phases: Option<Phases>,
    /// The lower C/N0 of the two, if the files state it, dB-Hz.
    pub cn0_dbhz: Option<f64>,
    /// Satellite when it sent to base and rover.
    pub emissions: [Emission; 2],
}

/// Epoch of both receivers.
#[derive(Clone, Debug)]
pub struct Pair {
    /// Labels of base and rover.
    pub labels: [Epoch; 2],
    /// Common signals, by satellite and signal.
    pub shared: Vec<Shared>,
}

/// Choice of the signals that take part.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Systems with their codes, such as `G1C`; all that both observe if it is empty.
    pub signals: BTreeSet<(System, Code)>,
}

impl Choice {
    fn takes(&self, (sv, code): Track) -> bool {
        self.signals.is_empty() || self.signals.contains(&(sv.system, code))
    }
}

/// Epochs that base and rover have in common, in their order.
///
/// # Errors
/// [`RtkError::NoCommonEpochs`]; [`RtkError::NoCommonSatellites`] if no epoch has four on one signal.
pub fn pairs(base: &Receiver, rover: &Receiver, orbits: &Orbits, choice: &Choice) -> Result<Vec<Pair>, RtkError> {
    let mut found = Vec::new();
    let mut next = 0;
    for own in &rover.epochs {
        let off_s = |other: &ObservedEpoch| other.label.since(own.label);
        while base.epochs.get(next).is_some_and(|other| off_s(other) < -WITHIN_S) {
            next += 1;
        }
        let Some(other) = base.epochs.get(next).filter(|other| off_s(other) <= WITHIN_S) else { continue };
        next += 1;
        found.push(Pair {
            labels: [other.label, own.label],
            shared: shared(base, rover, [other, own], (orbits, choice)),
        });
    }
    if found.is_empty() {
        let span = |receiver: &Receiver| {
            let at = |epoch: Option<&ObservedEpoch>| epoch.map_or(Epoch::new(0, 0.0), |epoch| epoch.label);
            [at(receiver.epochs.first()), at(receiver.epochs.last())]
        };
        return Err(RtkError::NoCommonEpochs { base: span(base), rover: span(rover), within_s: WITHIN_S });
    }
    let most = found.iter().map(|pair| largest(&pair.shared)).max().unwrap_or(0);
    if most < LEAST {
        let (base, rover) = (satellites(base), satellites(rover));
        return Err(RtkError::NoCommonSatellites { epochs: found.len(), most, base, rover });
    }
    Ok(found)
}

/// Largest number of satellites that share one signal.
fn largest(shared: &[Shared]) -> usize {
    let mut counts: BTreeMap<(System, Code), usize> = BTreeMap::new();
    for own in shared {
        *counts.entry((own.track.0.system, own.track.1)).or_default() += 1;
    }
    // Each system has a clock, which its first satellite takes.
    let mut of_system: BTreeMap<System, usize> = BTreeMap::new();
    for ((system, _), count) in counts {
        let most = of_system.entry(system).or_default();
        *most = (*most).max(count);
    }
    let others: usize = of_system.values().map(|count| count - 1).sum();
    if of_system.is_empty() { 0 } else { others + 1 }
}

/// Satellites of a receiver in words.
fn satellites(receiver: &Receiver) -> String {
    let all: BTreeSet<Sv> = receiver.epochs.iter().flat_map(|epoch| epoch.values.keys().map(|(sv, _)| *sv)).collect();
    let names: Vec<String> = all.iter().map(Sv::to_string).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(" ") }
}

fn shared(
    base: &Receiver,
    rover: &Receiver,
    epochs: [&ObservedEpoch; 2],
    (orbits, choice): (&Orbits, &Choice),
) -> Vec<Shared> {
    let [of_base, of_rover] = epochs;
    let mut emissions: BTreeMap<Sv, Option<[Emission; 2]>> = BTreeMap::new();
    let mut found = Vec::new();
    for ((sv, text), own) in &of_rover.values {
        let Some(other) = of_base.values.get(&(*sv, text.clone())) else { continue };
        let Some(code) = Code::new(text).filter(|code| choice.takes((*sv, *code))) else { continue };
        let (Some(of_other), Some(of_own)) = (other.pseudorange_m, own.pseudorange_m) else { continue };
        let channel = rover.channels.get(sv).or_else(|| base.channels.get(sv)).copied();
        let band = planted!("rtk.pairs.second_band", code.band(), b'1');
        let Some(hz) = band_hz(sv.system, band, channel) else { continue };
        let both = emissions.entry(*sv).or_insert_with(|| {
            let set = orbits.serving(*sv, of_base.label)?;
            Some([emission(set, of_base.label, of_other)?, emission(set, of_rover.label, of_own)?])
        });
        let Some(emissions) = *both else { continue };
        let wavelength_m = SPEED_OF_LIGHT_MPS / hz;
        found.push(Shared {
            track: (*sv, code),
            wavelength_m,
            code_m: [of_other, of_own],
            phases: phases(other, own, wavelength_m),
            cn0_dbhz: other.cn0_dbhz.zip(own.cn0_dbhz).map(|(one, other)| one.min(other)),
            emissions,
        });
    }
    found
}

fn phases(base: &Values, rover: &Values, wavelength_m: f64) -> Option<Phases> {
    let phase_m = [base.carrier_cycles? * wavelength_m, rover.carrier_cycles? * wavelength_m];
    Some(Phases {
        phase_m,
        is_broken: base.lost_lock || planted!("rtk.pairs.broken", rover.lost_lock, false),
        is_half: base.half_cycle_ambiguous || rover.half_cycle_ambiguous,
    })
}

/// Model of one observation's range between a receiver and a satellite: geometry, satellite clock and neutral
/// atmosphere, metres; with the direction from the satellite to the receiver and the elevation.
pub fn modelled(emission: &Emission, site: &Site) -> (f64, Vector3<f64>, f64) {
    let sight_m = emission.to(&site.position_m);
    let range_m = sight_m.norm();
    let direction = sight_m / range_m;
    let sine = (-direction.dot(&site.up)).clamp(-1.0, 1.0);
    let air_m = delay_m(site.geodetic, sine, emission.day);
    (range_m - SPEED_OF_LIGHT_MPS * emission.clock_s + air_m, direction, libm::asin(sine))
}
