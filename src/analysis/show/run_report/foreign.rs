//! `foreign_report.pdf` of a receiver that this project did not write: the verdict, and its pictures.

use std::path::Path;

use super::{front, verdict};
use crate::error::JudgeError;
use crate::judge::foreign::Judgement;
use crate::judge::judgement::number;
use crate::judge::verdict::Verdict;
use crate::show::pdf::{Item, Report};
use crate::show::plot::foreign::Picture;
use crate::show::write::write_whole;

/// Writes it into an existing directory.
///
/// # Errors
/// [`JudgeError::Plot`] where the report cannot be made, [`JudgeError::File`] where it cannot be written.
pub(crate) fn write(
    out: &Path,
    judgement: &Judgement,
    found: &Verdict,
    pictures: Vec<Picture>,
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
    let mut pictures = pictures;
    if let Some(last) = pictures.pop() {
        report.figure(last.drawing, last.caption);
    }
    report.add(Item::NewPage).heading("Verdict");
    verdict(&mut report, found);
    if !pictures.is_empty() {
        report.add(Item::NewPage).heading("Figures");
    }
    for picture in pictures {
        report.figure(picture.drawing, picture.caption);
    }
    let path = out.join("foreign_report.pdf");
    let failed = |reason: String| JudgeError::Plot { path: path.clone(), reason };
    write_whole(&path, &report.pdf().map_err(|error| failed(error.to_string()))?)
}
