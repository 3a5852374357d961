//! Scintillation as written.

use super::read::Table;
use super::{ScenarioError, satellite_list};
use crate::fast_phase::scintillation::Strength;

pub(super) fn scintillation(table: &Table<'_>) -> Result<Strength, ScenarioError> {
    let strength = Strength {
        s4: table.need("s4")?,
        sigma_phi_rad: table.number("sigma_phi_rad")?,
        decorrelation_s: table.need("decorrelation_s")?,
        satellites: satellite_list(table, "satellites")?,
    };
    let least_rad = strength.intrinsic_phase_rad();
    if strength.sigma_phi_rad.is_some_and(|sigma| sigma < least_rad) {
        let s4 = strength.s4;
        return Err(table.bad("sigma_phi_rad", format!("at least {least_rad:.3} rad, which comes with s4 = {s4}")));
    }
    Ok(strength)
}
