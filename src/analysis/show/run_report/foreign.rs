//! `foreign_report.pdf` and `.html` of a receiver that this project did not write: the verdict, and its
//! pictures.

use std::path::Path;

use super::{front, publish, verdict};
use crate::error::JudgeError;
use crate::judge::foreign::Judgement;
use crate::judge::judgement::number;
use crate::judge::verdict::Verdict;
use crate::show::document::{Forms, Item, Report};
use crate::show::plot::sketch::Figure;

/// Writes them into an existing directory, as asked.
///
/// # Errors
/// [`JudgeError::Plot`] where the report cannot be made, [`JudgeError::File`] where it cannot be written.
pub(crate) fn write(
    out: &Path,
    judgement: &Judgement,
    found: &Verdict,
    mut figures: Vec<Figure>,
    forms: Forms,
) -> Result<(), JudgeError> {
    let (run, judged) = (&judgement.run, &judgement.judged);
    let receiver = judged.receiver.clone().unwrap_or_else(|| "receiver under test".to_owned());
    let mut report =
        Report::new(format!("{receiver}: {}", judged.scene), front::place_and_time(run), "foreign receiver");
    front::banner(&mut report, found);
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
    // Positions come last, and are what the first page shows.
    if let Some(last) = figures.pop() {
        report.figure(last);
    }
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
