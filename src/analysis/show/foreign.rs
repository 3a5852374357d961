//! Files of a foreign receiver's judgement: tables, pictures, report and `foreign.json`.

use std::path::Path;

use crate::error::JudgeError;
use crate::judge::foreign::Judgement;
use crate::judge::verdict::Verdict;
use crate::show::document::Forms;
use crate::show::write::{write_rows, write_whole};
use crate::show::{columns, plot, run_report};

/// Writes tables, verdict, pictures, the report in its forms and `foreign.json` into an existing directory.
///
/// # Errors
/// The file that cannot be written or drawn.
pub fn write(judgement: &Judgement, verdict: &Verdict, out: &Path, forms: Forms) -> Result<(), JudgeError> {
    let judged = &judgement.judged;
    if let Some(measured) = &judged.observables {
        write_rows(&out.join("foreign_observations.csv"), "", measured.rows.iter())?;
        write_rows(&out.join("foreign_satellites.csv"), "", measured.satellites.iter())?;
        write_rows(&out.join("foreign_clock.csv"), "", measured.clock.iter())?;
        write_rows(&out.join("foreign_slips.csv"), columns::FOREIGN_SLIPS, measured.slips.iter())?;
    }
    if let Some(places) = &judged.places {
        write_rows(&out.join("foreign_fixes.csv"), "", places.rows.iter())?;
    }
    write_rows(&out.join("foreign_verdict.csv"), "", verdict.csv_rows())?;
    let figures = plot::foreign::all(out, judged)?;
    run_report::foreign::write(out, judgement, verdict, figures, forms)?;
    let path = out.join("foreign.json");
    let mut json = serde_json::to_vec_pretty(&judgement.summary)
        .map_err(|source| JudgeError::Json { path: path.clone(), source })?;
    json.push(b'\n');
    write_whole(&path, &json)
}
