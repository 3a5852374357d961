//! Table `[[multipath]]`: reflected rays.

use super::read::Table;
use super::{Scenario, ScenarioError};
use crate::effect::multipath::{Detour, Echo, Multipath};
use crate::vehicle::Trajectory;

#[derive(Clone, Copy)]
enum Kind {
    Given,
    Ground,
    Wall,
}

/// Most rays that a scene adds to each satellite.
const MOST: usize = 64;

/// Refuses more rays than a scene may have.
pub(super) fn count(root: &Table<'_>, echoes: &[Echo]) -> Result<(), ScenarioError> {
    if echoes.len() <= MOST {
        Ok(())
    } else {
        Err(root.bad("multipath", format!("at most {MOST} tables [[multipath]]")))
    }
}

pub(super) fn echo(table: &Table<'_>) -> Result<Echo, ScenarioError> {
    let kinds = [("given", Kind::Given), ("ground", Kind::Ground), ("wall", Kind::Wall)];
    let kind = table.need_choice("kind", &kinds)?;
    let detour = match kind {
        Kind::Given => Detour::Given { excess_m: table.need("excess_m")?, rate_mps: table.need("rate_mps")? },
        Kind::Ground => Detour::Ground { height_m: table.need("height_m")? },
        Kind::Wall => {
            Detour::Wall { azimuth_rad: table.need("azimuth_deg")?.to_radians(), distance_m: table.need("distance_m")? }
        }
    };
    let expected = "an array of satellites like [\"G01\", \"G12\"], or absent for all";
    let words = table.words("satellites", expected)?;
    let satellites: Result<Vec<_>, _> = words.iter().flatten().map(|word| word.parse()).collect();
    let satellites = satellites.map_err(|_| table.bad("satellites", expected))?;
    if words.is_some() && satellites.is_empty() {
        return Err(table.bad("satellites", expected));
    }
    Ok(Echo { detour, amplitude: table.need("amplitude")?, phase_cycles: table.need("phase_deg")? / 360.0, satellites })
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
                    "excess_m = {excess_m} and rate_mps = {rate_mps} fall below 0 after {:.3} s of {duration_s}: \
                     expected a path that is never shorter than the direct one; begin further away or end the scene \
                     before",
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
                        "the antenna is behind the wall, {distance_m} m off at the start, after {t_s:.1} s: move the \
                         wall (azimuth_deg, distance_m) or the route"
                    ));
                }
            }
            Detour::Given { .. } | Detour::Ground { .. } => {}
        }
    }
    Ok(effect)
}
