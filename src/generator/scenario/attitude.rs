//! `[attitude]`: how the body that carries the antenna is turned.

use nalgebra::{Unit, Vector3};

use super::ScenarioError;
use super::read::Table;
use crate::generator::vehicle::attitude::{Attitude, Nose};

pub(super) const KEYS: &[&str] = &["kind", "yaw_deg", "pitch_deg", "roll_deg", "spin_hz", "lever_arm_m", "boresight"];

pub(super) fn attitude(table: &Table<'_>) -> Result<Attitude, ScenarioError> {
    let kinds = [("fixed", false), ("velocity", true)];
    let follows = table.choice("kind", &kinds)?.ok_or_else(|| table.bad("kind", "one of fixed, velocity"))?;
    let angle = |key: &str, most: f64| -> Result<f64, ScenarioError> {
        Ok(table.number(key, -most..=most, "deg")?.unwrap_or(0.0).to_radians())
    };
    let (yaw_rad, pitch_rad, roll_rad) =
        (angle("yaw_deg", 360.0)?, angle("pitch_deg", 90.0)?, angle("roll_deg", 360.0)?);
    if follows && table.has("roll_deg") {
        return Err(table.bad("roll_deg", "absent, because kind = \"velocity\" keeps the right side level"));
    }
    let boresight = Vector3::from(table.numbers::<3>("boresight", 1e3)?.unwrap_or([0.0, 0.0, -1.0]));
    let boresight = Unit::try_new(boresight, 1e-6)
        .ok_or_else(|| table.bad("boresight", "a direction: three numbers that are not all 0"))?;
    Ok(Attitude {
        nose: if follows {
            Nose::Velocity { yaw_rad, pitch_rad }
        } else {
            Nose::Fixed { yaw_rad, pitch_rad, roll_rad }
        },
        spin_hz: table.number("spin_hz", -1000.0..=1000.0, "Hz")?.unwrap_or(0.0),
        lever_arm_m: Vector3::from(table.numbers::<3>("lever_arm_m", 1e3)?.unwrap_or_default()),
        boresight,
    })
}
