//! `[[multipath]]`: reflected rays.

use super::read::Table;
use super::{Scenario, ScenarioError};
use crate::generator::effect::multipath::{Detour, Echo, Multipath};
use crate::generator::vehicle::Trajectory;

pub(super) const KEYS: &[&str] =
    &["kind", "amplitude", "phase_deg", "satellites", "excess_m", "rate_mps", "height_m", "azimuth_deg", "distance_m"];

#[derive(Clone, Copy)]
enum Kind {
    Given,
    Ground,
    Wall,
}

/// Most rays that a scene adds to each satellite.
const MOST: usize = 64;

pub(super) fn echoes(tables: &[Table<'_>]) -> Result<Vec<Echo>, ScenarioError> {
    if let Some(table) = tables.get(MOST) {
        return Err(table.bad("kind", format!("at most {MOST} tables [[multipath]]")));
    }
    tables.iter().map(echo).collect()
}

fn echo(table: &Table<'_>) -> Result<Echo, ScenarioError> {
    table.allow(KEYS)?;
    let kinds = [("given", Kind::Given), ("ground", Kind::Ground), ("wall", Kind::Wall)];
    let kind = table.choice("kind", &kinds)?.ok_or_else(|| table.bad("kind", "one of given, ground, wall"))?;
    let own: &[&str] = match kind {
        Kind::Given => &["excess_m", "rate_mps"],
        Kind::Ground => &["height_m"],
        Kind::Wall => &["azimuth_deg", "distance_m"],
    };
    table.allow(&[&["kind", "amplitude", "phase_deg", "satellites"], own].concat())?;
    let detour = match kind {
        Kind::Given => Detour::Given {
            excess_m: table.required("excess_m", 0.0..=1e5, "m")?,
            rate_mps: table.number("rate_mps", -1e3..=1e3, "m/s")?.unwrap_or(0.0),
        },
        Kind::Ground => Detour::Ground { height_m: table.required("height_m", 0.0..=1e4, "m")? },
        Kind::Wall => Detour::Wall {
            azimuth_rad: table.required("azimuth_deg", -360.0..=360.0, "deg")?.to_radians(),
            distance_m: table.required("distance_m", 0.01..=1e4, "m")?,
        },
    };
    let expected = "an array of satellites like [\"G01\", \"G12\"], or absent for all";
    let words = table.words("satellites", expected)?;
    let satellites: Result<Vec<_>, _> = words.iter().flatten().map(|word| word.parse()).collect();
    let satellites = satellites.map_err(|_| table.bad("satellites", expected))?;
    if words.is_some() && satellites.is_empty() {
        return Err(table.bad("satellites", expected));
    }
    // A surface turns the field round unless it is told otherwise.
    let usual_deg = if matches!(kind, Kind::Given) { 0.0 } else { 180.0 };
    // Where the direct ray goes through a wall or leaves, its echo may be the stronger; planes reflect no more than they get.
    let most = if matches!(kind, Kind::Given) { 10.0 } else { 1.0 };
    Ok(Echo {
        detour,
        amplitude: table.required("amplitude", 0.0..=most, "(of the direct ray's)")?,
        phase_cycles: table.number("phase_deg", -360.0..=360.0, "deg")?.unwrap_or(usual_deg) / 360.0,
        satellites,
    })
}

/// The effect, after checking that no ray comes before the direct one while the antenna moves.
pub(super) fn effect(scenario: &Scenario, trajectory: &Trajectory) -> Result<Multipath, ScenarioError> {
    let effect = Multipath {
        echoes: scenario.multipath.clone(),
        start: scenario.start,
        origin_m: trajectory.at(0.0).position_m,
    };
    let duration_s = scenario.duration_s;
    for (number, echo) in (1..).zip(&effect.echoes) {
        let refuse = |reason: String| Err(scenario.conflict("multipath", format!("ray {number}: {reason}")));
        match echo.detour {
            Detour::Given { excess_m, rate_mps } if excess_m + rate_mps * duration_s < 0.0 => {
                return refuse(format!(
                    "excess_m = {excess_m} and rate_mps = {rate_mps} fall below 0 after {:.3} s of {duration_s}: expected \
                     a path that is never shorter than the direct one; begin further away or end the scene before",
                    -excess_m / rate_mps
                ));
            }
            Detour::Wall { azimuth_rad, distance_m } => {
                let inside =
                    trajectory.knots().iter().map(|knot| knot.t_s).filter(|t_s| (0.0..=duration_s).contains(t_s));
                let behind = inside
                    .chain([duration_s])
                    .find(|t_s| effect.clearance_m(azimuth_rad, distance_m, &trajectory.at(*t_s).position_m) <= 0.0);
                if let Some(t_s) = behind {
                    return refuse(format!(
                        "the antenna is behind the wall, {distance_m} m off at the start, after {t_s:.1} s: move the wall \
                         (azimuth_deg, distance_m) or the route"
                    ));
                }
            }
            Detour::Given { .. } | Detour::Ground { .. } => {}
        }
    }
    Ok(effect)
}
