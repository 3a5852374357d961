//! Table `[fidelity]`.

use super::ScenarioError;
use super::read::Table;
use crate::fidelity::{Budget, Wishes};
use crate::scene::{Arithmetic, CodeEdge, Grade};
use gnss::signal::Layers;

/// Level and single knobs that the table names, or its budget.
pub(super) fn fidelity_of(table: Option<&Table<'_>>, allowed_m: f64) -> Result<Wishes, ScenarioError> {
    let wishes = Wishes::of(Grade::Balanced, allowed_m);
    let Some(table) = table else { return Ok(wishes) };
    if let Some(errors) = table.table("budget")? {
        let knobs = ["level", "code_edge", "waveform", "carrier", "noise", "knot_tolerance_cycles"];
        if let Some(knob) = knobs.into_iter().find(|knob| table.has(knob)) {
            return Err(table.bad(knob, "nothing beside fidelity.budget, which chooses the level and every knob"));
        }
        let [code_m, carrier_cycles, cn0_db] =
            [errors.number("code_m")?, errors.number("carrier_cycles")?, errors.number("cn0_db")?]
                .map(|bound| bound.unwrap_or(f64::INFINITY));
        if [code_m, carrier_cycles, cn0_db].iter().all(|bound| bound.is_infinite()) {
            return Err(table.bad("budget", "at least one of code_m, carrier_cycles and cn0_db"));
        }
        return Ok(Wishes { grade: Grade::Budget(Budget { code_m, carrier_cycles, cn0_db }), ..wishes });
    }
    Ok(Wishes {
        grade: table.choice("level", &Grade::NAMES)?.unwrap_or(wishes.grade),
        code_edge: table.choice("code_edge", &CodeEdge::NAMES)?,
        waveform: table.choice("waveform", &Layers::NAMES)?,
        carrier: table.choice("carrier", &Arithmetic::NAMES)?,
        noise: table.choice("noise", &Arithmetic::NAMES)?,
        knot_tolerance_cycles: table.number("knot_tolerance_cycles")?,
        ..wishes
    })
}
