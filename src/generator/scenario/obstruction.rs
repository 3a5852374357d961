//! What stands between antenna and sky, as written: `[[obstruction]]`.

use super::ScenarioError;
use super::read::Table;
use crate::generator::effect::obstruction::{Building, Obstacle};

/// All keys of an obstruction, whatever its kind.
pub(super) const KEYS: &[&str] = &[
    "kind",
    "azimuth_deg",
    "elevation_deg",
    "from_deg",
    "to_deg",
    "roof_deg",
    "east_m",
    "north_m",
    "top_m",
    "edge_deg",
    "loss_db",
];
/// Width of an edge unless the scene says otherwise: from ν = −1 to 1, 2·sqrt(λd/2), behind a skyline 1.2 km away.
const EDGE_DEG: f64 = 1.0;
/// Farthest that a building may stand, and how high.
const FAR_M: f64 = 10_000.0;

pub(super) fn obstacles(tables: &[Table<'_>]) -> Result<Vec<Obstacle>, ScenarioError> {
    tables.iter().map(obstacle).collect()
}

fn obstacle(table: &Table<'_>) -> Result<Obstacle, ScenarioError> {
    table.allow(KEYS)?;
    let kinds = [("horizon", 0), ("sector", 1), ("building", 2)];
    let kind = table.choice("kind", &kinds)?.ok_or_else(|| table.bad("kind", "horizon, sector or building"))?;
    // Blocked unless something goes through.
    let share = table.number("loss_db", 0.0..=100.0, "dB")?.map_or(0.0, |db| libm::pow(10.0, -db / 10.0));
    let edge_rad =
        |table: &Table<'_>| Ok(table.number("edge_deg", 0.01..=45.0, "deg")?.unwrap_or(EDGE_DEG).to_radians());
    match kind {
        0 => {
            table.allow(&["kind", "azimuth_deg", "elevation_deg", "edge_deg", "loss_db"])?;
            Ok(Obstacle::Horizon { points_rad: line(table)?, edge_rad: edge_rad(table)?, share })
        }
        1 => {
            table.allow(&["kind", "from_deg", "to_deg", "roof_deg", "edge_deg", "loss_db"])?;
            Ok(Obstacle::Sector {
                from_rad: table.required("from_deg", -360.0..=360.0, "deg")?.to_radians(),
                to_rad: table.required("to_deg", -360.0..=360.0, "deg")?.to_radians(),
                roof_rad: table.required("roof_deg", -10.0..=90.0, "deg")?.to_radians(),
                edge_rad: edge_rad(table)?,
                share,
            })
        }
        _ => {
            table.allow(&["kind", "east_m", "north_m", "top_m", "loss_db"])?;
            let side = |key: &'static str| {
                let side: [f64; 2] = table.numbers(key, FAR_M)?.ok_or_else(|| table.bad(key, "its two sides in m"))?;
                if side[0] < side[1] { Ok(side) } else { Err(table.bad(key, "the smaller of its two sides (m) first")) }
            };
            let (east_m, north_m) = (side("east_m")?, side("north_m")?);
            let top_m = table.required("top_m", -FAR_M..=FAR_M, "m")?;
            Ok(Obstacle::Building(Building { east_m, north_m, top_m, share }))
        }
    }
}

/// A horizon's points by azimuth.
fn line(table: &Table<'_>) -> Result<Vec<(f64, f64)>, ScenarioError> {
    let list = |key: &'static str, range| {
        table.list(key, range, "deg")?.ok_or_else(|| table.bad(key, "an array of numbers in degrees"))
    };
    let (azimuths, elevations) = (list("azimuth_deg", 0.0..=360.0)?, list("elevation_deg", -10.0..=90.0)?);
    if azimuths.len() != elevations.len() || azimuths.is_empty() {
        let expected = format!("as many as azimuth_deg has: {}", azimuths.len());
        return Err(table.bad("elevation_deg", expected));
    }
    if azimuths.windows(2).any(|pair| matches!(pair, [a, b] if a >= b)) || azimuths.last() == Some(&360.0) {
        return Err(table.bad("azimuth_deg", "ascending azimuths below 360"));
    }
    Ok(azimuths.into_iter().zip(elevations).map(|(a, e)| (a.to_radians(), e.to_radians())).collect())
}
