//! The scene's sky: navigation data, orbits, what the satellites send, and the effects on the way.

use std::path::Path;

use super::{Ionosphere, Overrides, Power, Scenario, ScenarioError};
use crate::generator::catalogue::Catalogue;
use crate::generator::effect::ionosphere::KlobucharIonosphere;
use crate::generator::effect::link::{FixedCn0, LinkBudget};
use crate::generator::effect::troposphere::Saastamoinen;
use crate::generator::ray::{Effect, Ray, Sight};
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::gps::lnav::Broadcast;
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::rinex::{self, Navigation};
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;

/// Warnings of one kind that are told in full.
const TOLD: usize = 4;

/// Orbits, messages, and who is left out.
pub(super) struct Sky {
    pub catalogue: Catalogue,
    pub broadcast: Broadcast,
    pub excluded: Vec<Sv>,
}

/// The navigation file that the scenario names, or the embedded one.
pub(super) fn navigation(
    scenario: &Scenario,
    directory: &Path,
    overrides: &Overrides,
    warnings: &mut Vec<String>,
) -> Result<Navigation, ScenarioError> {
    let found = match &scenario.navigation {
        None => rinex::embedded(),
        Some(path) => {
            let bytes = scenario.load("navigation.file", directory, path, overrides)?;
            rinex::read(&bytes, &path.display().to_string())
        }
    };
    let navigation = found.map_err(|e| scenario.conflict("navigation.file", e.to_string()))?;
    tell(warnings, &navigation.skipped, "records of the navigation file left out");
    Ok(navigation)
}

/// Arranges the ephemerides and checks that they reach over the scene, which lasts `end_s`.
pub(super) fn sky(
    scenario: &Scenario,
    navigation: &Navigation,
    end_s: f64,
    warnings: &mut Vec<String>,
) -> Result<Sky, ScenarioError> {
    let (catalogue, rogues) = Catalogue::new(navigation.ephemerides.clone());
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
    excluded.sort();
    excluded.dedup();
    let almanac: Vec<Ephemeris> = catalogue
        .satellites()
        .filter(|sv| catalogue.healthy(*sv, start))
        .filter_map(|sv| catalogue.sent_at(sv, start).cloned())
        .collect();
    let broadcast = broadcast(scenario, navigation, &almanac)?;
    Ok(Sky { catalogue, broadcast, excluded })
}

fn broadcast(scenario: &Scenario, navigation: &Navigation, almanac: &[Ephemeris]) -> Result<Broadcast, ScenarioError> {
    let klobuchar = coefficients(scenario, navigation);
    let leap_seconds = navigation.leap_seconds.unwrap_or_else(|| scenario.start.leap_seconds());
    let key = if matches!(scenario.ionosphere, Some(Ionosphere::Given(_))) { "ionosphere" } else { "navigation.file" };
    Broadcast::new(klobuchar, leap_seconds, almanac, scenario.start)
        .map_err(|e| scenario.conflict(key, format!("the navigation message cannot carry it: {e}")))
}

/// What the satellites send about the ionosphere: what the scenario gives, or what the file says.
fn coefficients(scenario: &Scenario, navigation: &Navigation) -> Option<Klobuchar> {
    match scenario.ionosphere {
        Some(Ionosphere::Given(klobuchar)) => Some(klobuchar),
        Some(Ionosphere::Broadcast) | None => navigation.klobuchar,
    }
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

/// The effects in the order in which they act: ionosphere, troposphere, then strength.
pub(super) fn effects(scenario: &Scenario, navigation: &Navigation) -> Result<Vec<Box<dyn Effect>>, ScenarioError> {
    let mut effects: Vec<Box<dyn Effect>> = Vec::new();
    if scenario.ionosphere.is_some() {
        let model = coefficients(scenario, navigation).ok_or_else(|| {
            let reason = "the navigation file has no Klobuchar coefficients: write alpha and beta here, name a file that \
                          has them, or remove [ionosphere]";
            scenario.conflict("ionosphere", reason.to_owned())
        })?;
        effects.push(Box::new(KlobucharIonosphere { model }));
    }
    if let Some(weather) = scenario.troposphere {
        effects.push(Box::new(Saastamoinen { weather }));
    }
    match &scenario.power {
        Power::LinkBudget { antenna, noise_figure_db, loss_db } => effects.push(Box::new(LinkBudget {
            antenna: *antenna,
            noise_figure_db: *noise_figure_db,
            extra_loss_db: *loss_db,
            ..LinkBudget::default()
        })),
        Power::Fixed { cn0_dbhz, satellites } => {
            let default = FixedCn0 { cn0_dbhz: *cn0_dbhz };
            if satellites.is_empty() {
                effects.push(Box::new(default));
            } else {
                let satellites = satellites.iter().map(|&(sv, cn0_dbhz)| (sv, FixedCn0 { cn0_dbhz })).collect();
                effects.push(Box::new(ListedCn0 { default, satellites }));
            }
        }
    }
    Ok(effects)
}

/// C/N0 by a list of satellites, and one value for all others.
struct ListedCn0 {
    default: FixedCn0,
    satellites: Vec<(Sv, FixedCn0)>,
}

impl Effect for ListedCn0 {
    fn name(&self) -> &'static str {
        self.default.name()
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let listed = self.satellites.iter().find(|(sv, _)| *sv == sight.sv).map(|(_, fixed)| fixed);
        listed.unwrap_or(&self.default).act(sight, signal, rays);
    }
}
