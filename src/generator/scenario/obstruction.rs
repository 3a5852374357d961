//! Obstructions of the sky, as written: `[[obstruction]]`.

use super::ScenarioError;
use super::read::Table;
use crate::effect::obstruction::{Building, Obstacle};

pub(super) fn obstacle(table: &Table<'_>) -> Result<Obstacle, ScenarioError> {
    let kinds = [("horizon", 0), ("sector", 1), ("building", 2)];
    let kind = table.need_choice("kind", &kinds)?;
    // Blocked unless something goes through.
    let share = table.number("loss_db")?.map_or(0.0, |db| libm::pow(10.0, -db / 10.0));
    let edge_rad = |table: &Table<'_>| Ok(table.need("edge_deg")?.to_radians());
    match kind {
        0 => Ok(Obstacle::Horizon { points_rad: line(table)?, edge_rad: edge_rad(table)?, share }),
        1 => Ok(Obstacle::Sector {
            from_rad: table.need("from_deg")?.to_radians(),
            to_rad: table.need("to_deg")?.to_radians(),
            roof_rad: table.need("roof_deg")?.to_radians(),
            edge_rad: edge_rad(table)?,
            share,
        }),
        _ => {
            let side = |key: &'static str| {
                let side: [f64; 2] = table.numbers(key)?.ok_or_else(|| table.bad(key, "its two sides in m"))?;
                if side[0] < side[1] { Ok(side) } else { Err(table.bad(key, "the smaller of its two sides (m) first")) }
            };
            let (east_m, north_m) = (side("east_m")?, side("north_m")?);
            let top_m = table.need("top_m")?;
            Ok(Obstacle::Building(Building { east_m, north_m, top_m, share }))
        }
    }
}

/// A horizon's points by azimuth.
fn line(table: &Table<'_>) -> Result<Vec<(f64, f64)>, ScenarioError> {
    let list = |key: &'static str| table.list(key)?.ok_or_else(|| table.bad(key, "an array of numbers in degrees"));
    let (azimuths, elevations) = (list("azimuth_deg")?, list("elevation_deg")?);
    if azimuths.len() != elevations.len() || azimuths.is_empty() {
        let expected = format!("as many as azimuth_deg has: {}", azimuths.len());
        return Err(table.bad("elevation_deg", expected));
    }
    if azimuths.windows(2).any(|pair| matches!(pair, [a, b] if a >= b)) || azimuths.last() == Some(&360.0) {
        return Err(table.bad("azimuth_deg", "ascending azimuths below 360"));
    }
    Ok(azimuths.into_iter().zip(elevations).map(|(a, e)| (a.to_radians(), e.to_radians())).collect())
}
