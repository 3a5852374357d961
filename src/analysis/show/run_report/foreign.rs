//! `foreign_report.pdf` and `.html` of a receiver that this project did not write: the verdict, and its
//! pictures.

use std::path::Path;

use super::front::Figure as Front;
use super::{front, not_drawn, publish, verdict};
use crate::error::JudgeError;
use crate::judge::foreign::{self, Judgement};
use crate::judge::judgement::number;
use crate::judge::verdict::Verdict;
use crate::show::document::{Forms, Item, Report};
use crate::show::plot;
use crate::show::plot::drawing::Failure;
use crate::show::plot::sketch::Figure;

/// Figures of the first page.
const FIGURES: [Front; 6] = [
    Front { name: "time to first position", path: "", row: "time to the first of the positions" },
    Front { name: "position error, 95 %", path: "position.error_3d_p95_m", row: "position error, 95 %" },
    Front { name: "horizontal error, 95 %", path: "position.horizontal_p95_m", row: "horizontal error, 95 %" },
    Front { name: "epochs without a fix", path: "", row: "epochs without a fix" },
    Front { name: "carrier error, rms", path: "carrier.rms_cycles", row: "carrier, rms" },
    Front { name: "undeclared cycle slips", path: "carrier.slips_undeclared", row: "undeclared breaks of carriers" },
];

/// Writes them into an existing directory, as asked.
///
/// # Errors
/// [`JudgeError::Plot`] where the report cannot be made, [`JudgeError::File`] where it cannot be written.
pub(crate) fn write(
    out: &Path,
    judgement: &Judgement,
    found: &Verdict,
    figures: Vec<Figure>,
    forms: Forms,
) -> Result<(), JudgeError> {
    let (run, judged) = (&judgement.run, &judgement.judged);
    let receiver = judged.receiver.clone().unwrap_or_else(|| "receiver under test".to_owned());
    let mut report =
        Report::new(format!("{receiver}: {}", judged.scene), front::place_and_time(run), "foreign receiver");
    front::banner(&mut report, found, None);
    let observed = judged.observables.as_ref();
    let facts = [
        ("scene", Some(judged.scene.clone())),
        ("receiver", Some(receiver)),
        ("samples", Some(format!("{} Msps, {}", number(run.scene.sample_rate_hz / 1e6), run.scene.format))),
        ("satellites", observed.map(|measured| format!("{} observed", measured.satellites.len()))),
        ("observations", observed.map(|measured| measured.rows.len().to_string())),
        ("positions", judged.places.as_ref().map(|places| places.rows.len().to_string())),
    ];
    let facts = facts.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?)));
    report.add(Item::Facts(facts.collect()));
    front::failures(&mut report, found);
    let failed = |error: Failure| not_drawn(out, &error);
    let [sky, errors] = plot::foreign::front(run, judged)?;
    let pair =
        [Figure::new("front_sky", sky, "").map_err(failed)?, Figure::new("front_errors", errors, "").map_err(failed)?];
    report.add(Item::Pair(Box::new(pair)));
    let values = serde_json::to_value(&judgement.summary).unwrap_or_default();
    front::figures(&mut report, found, &values, &FIGURES, &foreign::FIGURES);
    front::groups(&mut report, found);
    report.add(Item::NewPage).heading("Verdict");
    verdict(&mut report, found);
    if !figures.is_empty() {
        report.add(Item::NewPage).heading("Figures");
    }
    for figure in figures {
        report.figure(figure);
    }
    publish(&report, &out.join("foreign_report"), forms)
}
