//! The scene's sky: navigation data, orbits, what the satellites send, and the effects on the way.

use std::path::Path;

use super::files::Files;
use super::{Ionosphere, Overrides, Scenario, ScenarioError, multipath, satellite};
use crate::generator::catalogue::Catalogue;
use crate::generator::effect::obstruction::Obstruction;
use crate::generator::effect::wind_up::WindUp;
use crate::generator::message::Senders;
use crate::generator::ray::Effect;
use crate::generator::vehicle::Trajectory;
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::gps::lnav::UtcData;
use crate::gnss::message::Common;
use crate::gnss::rinex::{self, Navigation};
use crate::gnss::satellite::Sv;

/// Warnings of one kind that are told in full.
const TOLD: usize = 4;

/// Orbits, messages, and who is left out.
pub(super) struct Sky {
    pub catalogue: Catalogue,
    pub messages: Senders,
    pub excluded: Vec<Sv>,
}

/// The navigation files that the scenario names, or the embedded one. What is not an ephemeris is taken from
/// the first file that has it.
pub(super) fn navigation(
    scenario: &Scenario,
    directory: &Path,
    overrides: &Overrides,
    warnings: &mut Vec<String>,
) -> Result<Navigation, ScenarioError> {
    let refuse = |e: rinex::NavigationError| scenario.conflict("navigation.file", e.to_string());
    let mut navigation =
        if scenario.navigation.is_empty() { rinex::embedded().map_err(refuse)? } else { Navigation::default() };
    for path in &scenario.navigation {
        let bytes = scenario.load("navigation.file", directory, path, overrides)?;
        let Navigation { ephemerides, klobuchar, leap_seconds, leap_event, utc, skipped } =
            rinex::read(&bytes, &path.display().to_string()).map_err(refuse)?;
        navigation.ephemerides.extend(ephemerides);
        navigation.klobuchar = navigation.klobuchar.or(klobuchar);
        navigation.leap_seconds = navigation.leap_seconds.or(leap_seconds);
        navigation.leap_event = navigation.leap_event.or(leap_event);
        navigation.utc = navigation.utc.or(utc);
        navigation.skipped.extend(skipped);
    }
    tell(warnings, &navigation.skipped, "records of the navigation file left out");
    Ok(navigation)
}

/// Arranges the ephemerides and checks that they reach over the scene, which lasts `end_s`.
pub(super) fn sky(
    scenario: &Scenario,
    navigation: &Navigation,
    files: &Files<'_>,
    end_s: f64,
    warnings: &mut Vec<String>,
) -> Result<Sky, ScenarioError> {
    let (mut catalogue, rogues) = Catalogue::new(navigation.ephemerides.clone());
    tell(warnings, &rogues, "ephemerides left out");
    let (start, end) = (scenario.start, scenario.start.plus_s(end_s));
    let sending = |at| catalogue.satellites().filter(|sv| catalogue.sent_at(*sv, at).is_some()).count();
    for at in [start, end] {
        if sending(at) == 0 {
            return Err(scenario.conflict("start", outside(&navigation.ephemerides, scenario)));
        }
    }
    for sv in scenario.excluded.iter().filter(|sv| catalogue.sent_at(**sv, start).is_none()) {
        warnings.push(format!("satellites.exclude names {sv}, which has no ephemeris then"));
    }
    let mut excluded = scenario.excluded.clone();
    if !scenario.include_unhealthy {
        let sick: Vec<Sv> = catalogue
            .satellites()
            .filter(|sv| catalogue.sent_at(*sv, start).is_some() && !catalogue.healthy(*sv, start))
            .collect();
        if !sick.is_empty() {
            let names: Vec<String> = sick.iter().map(Sv::to_string).collect();
            warnings.push(format!("unhealthy by their own message and left out: {}", names.join(", ")));
        }
        excluded.extend(sick);
    }
    if let Some(orbits) = &scenario.orbits {
        let missing = orbits.follow(scenario, files, &mut catalogue, end_s)?;
        let missing = missing.into_iter().filter(|sv| catalogue.sent_at(*sv, start).is_some());
        let missing: Vec<Sv> = missing.filter(|sv| !excluded.contains(sv)).collect();
        if !missing.is_empty() {
            let names: Vec<String> = missing.iter().map(Sv::to_string).collect();
            warnings
                .push(format!("without a precise orbit and clock over the scene and left out: {}", names.join(", ")));
        }
        excluded.extend(missing);
    }
    catalogue.depart(satellite::departures(scenario));
    warnings.extend(satellite::strangers(scenario, &catalogue));
    excluded.sort();
    excluded.dedup();
    let almanac: Vec<Ephemeris> = catalogue
        .satellites()
        .filter(|sv| catalogue.healthy(*sv, start))
        .filter_map(|sv| catalogue.sent_at(sv, start).cloned())
        .collect();
    let messages = messages(scenario, navigation, almanac)?;
    Ok(Sky { catalogue, messages, excluded })
}

/// What the satellites send about the ionosphere is what the scenario gives, or what the file says.
fn messages(scenario: &Scenario, navigation: &Navigation, almanac: Vec<Ephemeris>) -> Result<Senders, ScenarioError> {
    let given = scenario.ionosphere.as_ref().and_then(Ionosphere::sent);
    let utc = UtcData {
        leap_s: navigation.leap_seconds.unwrap_or_else(|| scenario.start.leap_seconds()),
        polynomial: navigation.utc,
        event: navigation.leap_event,
    };
    let key = if given.is_some() { "ionosphere" } else { "navigation.file" };
    let klobuchar = given.or(navigation.klobuchar);
    let common = Common { klobuchar, nequick: None, utc, almanac, reference: Some(scenario.start) };
    Senders::new(&common, &scenario.signals)
        .map_err(|e| scenario.conflict(key, format!("the navigation message cannot carry it: {e}")))
}

/// Why no ephemeris fits: the span of the file against that of the scene.
fn outside(ephemerides: &[Ephemeris], scenario: &Scenario) -> String {
    let reach = |e: &Ephemeris, sign: f64| e.toe.plus_s(sign * 0.5 * e.fit_interval_s());
    let first = ephemerides.iter().map(|e| reach(e, -1.0)).min_by(|a, b| a.since(*b).total_cmp(&0.0));
    let last = ephemerides.iter().map(|e| reach(e, 1.0)).max_by(|a, b| a.since(*b).total_cmp(&0.0));
    let text = |at: Option<crate::gnss::time::Epoch>| at.map_or_else(|| "nowhere".to_owned(), |at| at.to_string());
    format!(
        "{} and {} s from then on: no ephemeris of the navigation file fits; expected a scene within {} to {}",
        scenario.start,
        scenario.duration_s,
        text(first),
        text(last)
    )
}

/// Passes a list on: the first few, and how many more.
fn tell(warnings: &mut Vec<String>, list: &[String], what: &str) {
    if list.len() <= TOLD {
        warnings.extend_from_slice(list);
    } else {
        let first = list.iter().take(TOLD - 1).cloned().collect::<Vec<_>>().join("; ");
        warnings.push(format!("{} {what}: {first}; …", list.len()));
    }
}

/// The effects in the order in which they act: ionosphere, troposphere, wind-up, strength, echoes of all
/// that, then what stands in the way of the direct ray.
pub(super) fn effects(
    scenario: &Scenario,
    files: &Files<'_>,
    navigation: &Navigation,
    (sky, trajectory): (&Sky, &Trajectory),
    end_s: f64,
) -> Result<Vec<Box<dyn Effect>>, ScenarioError> {
    let mut effects: Vec<Box<dyn Effect>> = Vec::new();
    if let Some(ionosphere) = &scenario.ionosphere {
        effects.push(ionosphere.effect(scenario, files, navigation.klobuchar, end_s)?);
    }
    if let Some(troposphere) = &scenario.troposphere {
        effects.push(troposphere.effect(scenario, files)?);
    }
    let wind_up = WindUp::new(scenario.start, trajectory.clone(), &sky.catalogue)
        .map_err(|e| scenario.conflict("navigation.file", e.to_string()))?;
    if let Some(wind_up) = wind_up {
        effects.push(Box::new(wind_up));
    }
    effects.push(scenario.power.effect(scenario, trajectory, files.directory, files.overrides)?);
    if !scenario.multipath.is_empty() {
        effects.push(Box::new(multipath::effect(scenario, trajectory)?));
    }
    if !scenario.obstacles.is_empty() {
        effects.push(Box::new(Obstruction::new(scenario.obstacles.clone(), trajectory.at(0.0).position_m)));
    }
    Ok(effects)
}
