//! The scene's parts out of other rooms: navigation data, orbits, effects.

use std::path::Path;

use super::{Overrides, Scenario, ScenarioError};
use crate::generator::catalogue::Catalogue;
use crate::generator::ray::Effect;
use crate::gnss::gps::lnav::Broadcast;
use crate::gnss::satellite::Sv;

// Stand-ins until those rooms are built.
pub(super) struct Navigation;

pub(super) struct Sky {
    pub catalogue: Catalogue,
    pub broadcast: Broadcast,
    pub excluded: Vec<Sv>,
}

pub(super) fn navigation(
    scenario: &Scenario,
    directory: &Path,
    overrides: &Overrides,
    _warnings: &mut Vec<String>,
) -> Result<Navigation, ScenarioError> {
    if let Some(path) = &scenario.navigation {
        scenario.load("navigation.file", directory, path, overrides)?;
    }
    Ok(Navigation)
}

pub(super) fn sky(
    scenario: &Scenario,
    _navigation: &Navigation,
    _end_s: f64,
    _warnings: &mut Vec<String>,
) -> Result<Sky, ScenarioError> {
    Ok(Sky { catalogue: Catalogue, broadcast: Broadcast, excluded: scenario.excluded.clone() })
}

pub(super) fn effects(_scenario: &Scenario, _navigation: &Navigation) -> Result<Vec<Box<dyn Effect>>, ScenarioError> {
    Ok(Vec::new())
}
