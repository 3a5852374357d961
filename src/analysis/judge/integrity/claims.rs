//! Messages, events and `receiver.json` against the tables that they sum up.
//!
//! Limits: keys that `receiver.json` lacks are not compared; an incomplete set of a message's parameters
//! counts only where the receiver says that it is complete.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::{Finding, Found};
use crate::error::JudgeError;
use crate::expect::message::orbit_parameters;
use crate::read::Run;
use gnss::record::{Event, EventRow, IonosphereModel};
use gnss::satellite::Sv;
use gnss::signal::Link;

pub(super) fn findings(run: &Run) -> Result<Vec<Finding>, JudgeError> {
    let mut all = vec![
        Finding::none("parameters missing of complete messages", missing(run), "an ephemeris is complete or absent"),
        Finding::none("messages of unknown satellites", strangers(run), "no such satellite in the scene"),
        Finding::none("events out of their natural order", order(run)?, "found, locked, bits, frame, then observed"),
    ];
    let counts = counts(run)?;
    if let Some(counts) = counts {
        all.push(Finding::none("counts of receiver.json that the tables contradict", counts, "one run made both"));
    }
    Ok(all)
}

/// Parameters that a satellite with a complete message lacks.
fn missing(run: &Run) -> Found {
    let mut decoded: BTreeMap<(Sv, &str), BTreeMap<u32, BTreeSet<&str>>> = BTreeMap::new();
    for row in &run.navigation {
        decoded.entry((row.sv, &row.message)).or_default().entry(row.issue).or_default().insert(&row.parameter);
    }
    let complete = run.events.iter().filter(|row| row.event == Event::EphemerisComplete);
    let message = |row: &EventRow| row.signal.components.iter().find_map(|component| component.message);
    let complete: BTreeSet<(Sv, &str)> = complete.filter_map(|row| Some((row.sv, message(row)?.name))).collect();
    let mut found = Found::default();
    for (sv, name) in complete {
        let expected = orbit_parameters(run, sv).remove(name).unwrap_or_default();
        let lacks = |names: &BTreeSet<&str>| expected.iter().filter(|name| !names.contains(*name)).count();
        let least = decoded.get(&(sv, name)).and_then(|sets| sets.values().map(lacks).min()).unwrap_or(expected.len());
        (0..least).for_each(|_| found.add(|| sv.to_string()));
    }
    // Whoever says that the ionosphere is known has all of its parameters.
    let klobuchar = ["alpha_0", "alpha_1", "alpha_2", "alpha_3", "beta_0", "beta_1", "beta_2", "beta_3"];
    let nequick = ["ai0_sfu", "ai1_sfupdeg", "ai2_sfupdeg2"];
    let bdgim = [1, 2, 3, 4, 5, 6, 7, 8, 9].map(|place| format!("alpha_{place}_tecu"));
    let models = [
        (IonosphereModel::Broadcast, &klobuchar[..]),
        (IonosphereModel::NequickG, &nequick[..]),
        (IonosphereModel::Bdgim, &bdgim.each_ref().map(String::as_str)[..]),
    ];
    for (model, names) in models {
        if run.fixes.uses(model) {
            let lacks = |name: &&&str| !run.navigation.iter().any(|row| row.parameter == **name);
            names.iter().filter(lacks).for_each(|name| found.add(|| (*name).to_owned()));
        }
    }
    found
}

fn strangers(run: &Run) -> Found {
    let there: BTreeSet<Sv> = run.truth.keys().map(|Link { sv, .. }| sv).chain(run.in_the_sky()).collect();
    let senders: BTreeSet<Sv> = run.navigation.iter().map(|row| row.sv).collect();
    let mut found = Found::default();
    for sv in senders.difference(&there) {
        found.add(|| sv.to_string());
    }
    found
}

/// Checks the order of a channel's events, and of the events before its first observation.
fn order(run: &Run) -> Result<Found, JudgeError> {
    let mut reached: BTreeMap<Link, BTreeMap<u8, u64>> = BTreeMap::new();
    let mut found = Found::default();
    for row in &run.events {
        let steps = reached.entry(row.link()).or_default();
        let stage = match row.event {
            Event::Acquired => Some((1, 0)),
            Event::PhaseLocked => Some((2, 1)),
            Event::BitSynchronised => Some((3, 2)),
            Event::FrameSynchronised => Some((4, 3)),
            Event::EphemerisComplete | Event::ReducedElements => Some((5, 4)),
            _ => None,
        };
        let needs = stage.map_or(1, |(_, before)| before);
        if needs > 0 && !steps.contains_key(&needs) {
            found.add(|| format!("{} at sample {}", row.sv, row.sample));
        }
        if let Some((stage, _)) = stage {
            steps.entry(stage).or_insert(row.sample);
        }
    }
    for link in run.observations.keys() {
        let framed = reached.get(&link).and_then(|steps| steps.get(&4).copied()).unwrap_or(u64::MAX);
        run.observations.each(link, |row| {
            if row.sample < framed {
                found.add(|| format!("observation of {} at sample {}", link.sv, row.sample));
            }
        })?;
    }
    Ok(found)
}

/// Checks the counts in `receiver.json`; `None` without the file.
fn counts(run: &Run) -> Result<Option<Found>, JudgeError> {
    if run.receiver.is_null() {
        return Ok(None);
    }
    let mut found = Found::default();
    let mut whole = |key: &str, counted: usize| {
        let stated = run.receiver.get(key).and_then(serde_json::Value::as_u64);
        if stated.is_some_and(|stated| stated != counted as u64) {
            found.add(|| format!("{key}: {counted} in the tables"));
        }
    };
    whole("fixes", run.fixes.len());
    whole("losses", run.events.iter().filter(|row| row.event == Event::LossOfLock).count());
    let first = run.fixes.first_sample().map(|sample| run.time_s(sample));
    let stated = run.receiver.get("first_fix_s").and_then(serde_json::Value::as_f64);
    // Half a sample.
    if run.receiver.get("first_fix_s").is_some()
        && first
            .zip(stated)
            .map_or(first.is_some() != stated.is_some(), |(a, b)| (a - b).abs() > 0.5 / run.scene.sample_rate_hz)
    {
        found.add(|| "first_fix_s".to_owned());
    }
    let names = |key: &str| -> Option<BTreeSet<String>> {
        let list = run.receiver.get(key)?.as_array()?;
        Some(list.iter().filter_map(|name| Some(name.as_str()?.to_owned())).collect())
    };
    let acquired: BTreeSet<String> =
        run.acquisition.iter().filter(|row| row.acquired).map(|row| row.sv.to_string()).collect();
    // Of what a search cannot tell apart, either name is right.
    let either = |name: &String| {
        let alike = run.alike.iter().find(|(link, _)| link.sv.to_string() == *name);
        alike.map_or_else(|| name.clone(), |(_, sv)| sv.to_string())
    };
    let stated = names("acquired").map(|stated| stated.iter().map(either).collect::<BTreeSet<_>>());
    if stated.is_some_and(|stated| stated != acquired) {
        found.add(|| "acquired".to_owned());
    }
    let known: HashMap<String, ()> = (run.events.iter())
        .filter(|row| matches!(row.event, Event::EphemerisComplete | Event::ReducedElements))
        .map(|row| (row.sv.to_string(), ()))
        .collect();
    if let Some(used) = names("used") {
        let most = run.fixes.most_satellites();
        if used.len() < most || used.iter().any(|sv| !known.contains_key(sv)) {
            found.add(|| "used".to_owned());
        }
    }
    Ok(Some(found))
}
