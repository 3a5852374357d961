//! A finished study as a report: `report.pdf` and `report.html`, of the same figures as `report.md`.

use super::StudyError;
use super::draw::Picture;
use super::plan::{self, Plan};
use super::publish::{self, Rows};
use super::result::{Compared, Results};
use super::words;
use analysis::JudgeError;
use analysis::show::document::{Forms, Item, Report, Side, Table, Tone};
use analysis::show::write::retire;

/// The report; it follows from plan and results alone.
///
/// # Errors
/// A picture that cannot be drawn.
pub(super) fn report(plan: &Plan, results: &Results, pictures: &[Picture]) -> Result<Report, StudyError> {
    let failed = |reason: String| StudyError::Judge(JudgeError::Plot { path: plan.directory.join("report"), reason });
    let (study, grid) = (&results.study, &results.study.grid);
    // A study's words are broken into lines where it suits their file.
    let about = study.about.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut report = Report::new(&study.title, about, &study.name);
    report.add(Item::Facts(vec![
        ("level".to_owned(), study.level.name().to_owned()),
        ("cases".to_owned(), format!("{} ({} cells of {})", grid.cases(), grid.cells(), grid.repetitions)),
        ("seed".to_owned(), study.seed.to_string()),
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
    ]));
    report.text(format!(
        "What a case is: {} Intervals hold the mean with 95 % confidence. Every case is in cases.csv, every cell \
         in cells.csv; manifest.json binds them to their inputs.",
        publish::level(plan)
    ));
    let agreements = results.agreement();
    if !agreements.is_empty() {
        report.heading("Beside theory");
    }
    for agreement in &agreements {
        let beyond: Vec<&Compared> = agreement.cells.iter().filter(|cell| !cell.holds()).collect();
        let broken = beyond.iter().any(|cell| cell.in_region());
        let (found, tone) = if broken { ("beyond", Tone::Bad) } else { ("within", Tone::Good) };
        let figure = results.figures.get(agreement.figure).map_or("", |figure| figure.name.as_str());
        report.add(Item::Banner(format!("{}: {found} theory in its region", words::of_figure(figure)), tone));
        report.text(publish::in_words(results, agreement) + ".");
        if !beyond.is_empty() {
            let rows = publish::beyond_theory(results, &beyond);
            report.table(table("Cells beyond their bar of theory", rows));
        }
    }
    if let Some(rows) = results.ensembles_in_short() {
        report.heading("All cases together");
        let fixed = study.ensemble.iter().flatten().count() + 1;
        report.table(table("Distribution over the cases", narrow(publish::worded(results, rows), fixed)));
    }
    report.heading("Pictures");
    for picture in pictures {
        report.figure(picture.figure().map_err(|error| failed(error.to_string()))?);
        if let Some(rows) = &picture.crossings {
            report.table(table(&picture.title, rows.clone()));
        }
    }
    report.heading("Base and axes");
    let (heads, mut rows) = publish::axes(results);
    for cell in rows.iter_mut().filter_map(|row| row.first_mut()) {
        *cell = cell.replace('`', "");
    }
    report.table(table("Axes, the slowest first", (heads, rows)));
    report.add(Item::Listing(publish::base(plan, results).replace('`', "")));
    if let Some(rows) = publish::cells(results) {
        report.heading("Cells");
        let rows = narrow(rows, study.axes.len());
        report.table(table("Figures with their intervals of 95 %", rows));
    }
    Ok(report)
}

/// Writes the report in the forms that are asked for into the study's directory.
///
/// # Errors
/// A report that cannot be made or written.
pub(super) fn write(plan: &Plan, report: &Report, forms: Forms) -> Result<(), StudyError> {
    for (asked, name) in [(forms.pdf, "report.pdf"), (forms.html, "report.html")] {
        if !asked {
            retire(&plan.directory.join(name)).map_err(StudyError::Judge)?;
        }
    }
    #[cfg(feature = "pdf")]
    if forms.pdf {
        let path = plan.directory.join("report.pdf");
        let failed = |reason: String| StudyError::Judge(JudgeError::Plot { path: path.clone(), reason });
        plan::write(&path, &report.pdf().map_err(|error| failed(error.to_string()))?)?;
    }
    if forms.html {
        plan::write(&plan.directory.join("report.html"), report.html().as_bytes())?;
    }
    Ok(())
}

/// Largest number of columns that a page holds without breaking words.
const MOST_COLUMNS: usize = 7;

/// Table with a row for each figure, where a column for each would be too narrow. The first `fixed` columns
/// stay.
fn narrow((heads, rows): Rows, fixed: usize) -> Rows {
    if heads.len() <= MOST_COLUMNS {
        return (heads, rows);
    }
    let (names, figures) = heads.split_at(fixed);
    let long = rows.iter().flat_map(|row| {
        let (place, values) = row.split_at(fixed);
        let one = |(figure, value): (&String, &String)| [place, &[figure.clone(), value.clone()]].concat();
        figures.iter().zip(values).map(one).collect::<Vec<_>>()
    });
    ([names, &["figure".to_owned(), "value".to_owned()]].concat(), long.collect())
}

fn table(caption: &str, (heads, rows): Rows) -> Table {
    let mut table = Table::new(caption, heads.iter().map(|head| (head.as_str(), Side::Left)));
    rows.into_iter().for_each(|row| table.row(row));
    table
}

#[cfg(test)]
mod tests {
    use super::narrow;

    #[test]
    fn a_wide_table_gets_a_row_for_each_figure_and_loses_none() {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let wide = (words("a b c d e f g h"), vec![words("1 2 3 4 5 6 7 8"), words("9 2 3 4 5 6 7 0")]);
        let (heads, rows) = narrow(wide.clone(), 1);
        assert_eq!((heads, rows.len()), (words("a figure value"), 14));
        assert_eq!((&rows[0], &rows[13]), (&words("1 b 2"), &words("9 h 0")));
        assert_eq!(narrow((words("a b"), vec![words("1 2")]), 1), (words("a b"), vec![words("1 2")]));
    }
}
