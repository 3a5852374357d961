//! Table `[attitude]`: the attitude of the body that carries the antenna.

use nalgebra::{Unit, Vector3};

use super::ScenarioError;
use super::read::Table;
use crate::vehicle::attitude::{Attitude, Nose};

pub(super) fn attitude(table: &Table<'_>) -> Result<Attitude, ScenarioError> {
    let kinds = [("fixed", 0), ("velocity", 1), ("pushed", 2)];
    let kind = table.need_choice("kind", &kinds)?;
    let follows = kind == 1;
    let spin_hz = table.need("spin_hz")?;
    if kind == 2 && spin_hz != 0.0 {
        return Err(table.bad("spin_hz", "absent, because kind = \"pushed\" turns as it is pushed"));
    }
    let angle = |key: &str| -> Result<f64, ScenarioError> { Ok(table.need(key)?.to_radians()) };
    let (yaw_rad, pitch_rad) = (angle("yaw_deg")?, angle("pitch_deg")?);
    if follows && table.has("roll_deg") {
        return Err(table.bad("roll_deg", "absent, because kind = \"velocity\" keeps the right side level"));
    }
    let boresight = Vector3::from(table.numbers::<3>("boresight")?.unwrap_or([0.0, 0.0, -1.0]));
    let boresight = Unit::try_new(boresight, 1e-6)
        .ok_or_else(|| table.bad("boresight", "a direction: three numbers that are not all 0"))?;
    Ok(Attitude {
        nose: match kind {
            0 => Nose::Fixed { yaw_rad, pitch_rad, roll_rad: angle("roll_deg")? },
            1 => Nose::Velocity { yaw_rad, pitch_rad },
            _ => Nose::Pushed { yaw_rad, pitch_rad, roll_rad: angle("roll_deg")? },
        },
        spin_hz,
        lever_arm_m: Vector3::from(table.numbers::<3>("lever_arm_m")?.unwrap_or_default()),
        boresight,
    })
}
