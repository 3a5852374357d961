//! A finished study on paper: `report.pdf`, of the same figures as `report.md`.

use super::StudyError;
use super::draw::Picture;
use super::plan::Plan;
use super::publish::{self, Rows};
use super::result::{Compared, Results};
use super::spec::Level;
use crate::analysis::JudgeError;
use crate::analysis::pdf::{Item, Report, Side, Table, Tone};

/// The report's bytes; they follow from plan and results alone.
///
/// # Errors
/// A picture that cannot be drawn.
pub(super) fn pdf(plan: &Plan, results: &Results, pictures: &[Picture]) -> Result<Vec<u8>, StudyError> {
    let failed =
        |reason: String| StudyError::Judge(JudgeError::Plot { path: plan.directory.join("report.pdf"), reason });
    let (study, grid) = (&results.study, &results.study.grid);
    let mut report = Report::new(&study.title, &study.about, &study.name);
    let level = match study.level {
        Level::Correlator => "correlator",
        Level::Samples => "samples",
    };
    report.add(Item::Facts(vec![
        ("level".to_owned(), level.to_owned()),
        ("cases".to_owned(), format!("{} ({} cells of {})", grid.cases(), grid.cells(), grid.repetitions)),
        ("seed".to_owned(), study.seed.to_string()),
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
    ]));
    report.text(format!(
        "What a case is: {} Intervals hold the mean with 95 % confidence. Every case stands in cases.csv, every cell in cells.csv; \
         manifest.json binds them to their inputs.",
        publish::level(results)
    ));
    let agreements = results.agreement();
    if !agreements.is_empty() {
        report.heading("Beside theory");
    }
    for agreement in &agreements {
        let beyond: Vec<&Compared> = agreement.cells.iter().filter(|cell| !cell.holds()).collect();
        let broken = beyond.iter().any(|cell| cell.in_region());
        let tone = if broken { Tone::Bad } else { Tone::Good };
        report.add(Item::Banner(
            if broken { "beyond theory in its region" } else { "within theory in its region" }.to_owned(),
            tone,
        ));
        report.text(publish::in_words(results, agreement) + ".");
        if !beyond.is_empty() {
            report.table(table("Cells beyond their bar of theory", publish::beyond_theory(results, &beyond)));
        }
    }
    report.heading("Pictures");
    for picture in pictures {
        report.figure(picture.drawing().map_err(|error| failed(error.to_string()))?, &picture.title);
        if let Some(rows) = &picture.crossings {
            report.table(table(&picture.title, rows.clone()));
        }
    }
    report.heading("Base and axes");
    report.table(table("Axes, the slowest first", publish::axes(results)));
    report.add(Item::Listing(publish::base(plan, results)));
    if let Some(rows) = publish::cells(results) {
        report.heading("Cells");
        report.table(table("Figures with their intervals of 95 %", rows));
    }
    report.pdf().map_err(|error| failed(error.to_string()))
}

fn table(caption: &str, (heads, rows): Rows) -> Table {
    let mut table = Table::new(caption, heads.iter().map(|head| (head.as_str(), Side::Left)));
    rows.into_iter().for_each(|row| table.row(row));
    table
}
