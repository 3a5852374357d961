//! Writes a finished study down: `cases.csv`, `cells.csv`, pictures, `report.md`, `report.pdf` and
//! `report.html` in its directory.
//!
//! Bytes follow from plan and results alone: how long it took and where is not in them. Other forms of report
//! start from [`Results`] and [`draw::pictures`] as this one does.

use std::fmt::Write;

use super::draw::{self, Picture};
use super::plan::Plan;
use super::result::{self, Agreement, Compared, Results, THEORY};
use super::spec::Level;
use super::{StudyError, axis, plan, words};
use crate::proof::LEAST_SNR;
use analysis::show::document::Forms;

/// Cells that the report lists; the rest are in `cells.csv`.
const MOST_LISTED: usize = 60;

/// Values of an axis that the report lists; all are in `cells.csv`.
const MOST_VALUES: usize = 40;

/// Writes everything, the report in the forms that are asked for.
///
/// # Errors
/// A file that cannot be written.
pub fn write(plan: &Plan, lines: &[String], results: &Results, forms: Forms) -> Result<(), StudyError> {
    let directory = &plan.directory;
    plan::write(&directory.join("cases.csv"), &result::table(plan, lines))?;
    plan::write(&directory.join("cells.csv"), &results.table()?)?;
    if let Some(table) = results.ensemble_table()? {
        plan::write(&directory.join("ensemble.csv"), &table)?;
    }
    let pictures = draw::pictures(results);
    for picture in &pictures {
        for ending in ["png", "svg"] {
            picture.draw(&directory.join(format!("{}.{ending}", picture.stem)))?;
        }
    }
    super::paper::write(plan, &super::paper::report(plan, results, &pictures)?, forms)?;
    plan::write(&directory.join("report.md"), text(plan, results, &pictures).as_bytes())
}

/// Summary of a finished study for a terminal: theory beside measurement.
pub fn in_short(results: &Results) -> String {
    results.agreement().iter().map(|agreement| in_words(results, agreement) + "\n").collect()
}

pub(super) fn in_words(results: &Results, agreement: &Agreement) -> String {
    let name = results.figures.get(agreement.figure).map_or_else(String::new, |figure| words::of_figure(&figure.name));
    let (region, outside): (Vec<&Compared>, Vec<&Compared>) = agreement.cells.iter().partition(|cell| cell.in_region());
    let good = |cells: &[&Compared]| cells.iter().filter(|cell| cell.holds()).count();
    let ratios = || region.iter().map(|cell| cell.ratio);
    let mut words = format!(
        "{name}: {} of {} cells with T·C/N0 ≥ {LEAST_SNR} are within {:.0} % of theory or the measurement's 95 % \
         interval",
        good(&region),
        region.len(),
        100.0 * result::BAR,
    );
    if !region.is_empty() {
        let (least, most) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(f64::NEG_INFINITY, f64::max));
        let _ =
            write!(words, " (ratios {least:.3} to {most:.3}, mean {:.3})", ratios().sum::<f64>() / region.len() as f64);
    }
    if !outside.is_empty() {
        let _ = write!(words, ", {} of {} below", good(&outside), outside.len());
    }
    words
}

fn text(plan: &Plan, results: &Results, pictures: &[Picture]) -> String {
    let study = &results.study;
    let grid = &study.grid;
    let mut text = format!("# {}\n", study.title);
    if !study.about.is_empty() {
        let _ = write!(text, "\n{}\n", study.about);
    }
    let name = match study.level {
        Level::Correlator => "Correlator level",
        Level::Samples if plan.is_sampled() => "Sample level",
        Level::Samples => "Levels of the scenes",
        Level::Correlations => "Level of correlations",
        Level::Observations => "Level of observations",
    };
    let _ = write!(
        text,
        "\n**{name}**: {} {} cases: {} cells, {} repetitions each with other noise. Intervals hold the mean with 95 \
         % confidence. Everything: `cases.csv`, `cells.csv`.\n",
        level(plan),
        grid.cases(),
        grid.cells(),
        grid.repetitions
    );
    if let Some(rows) = results.ensembles_in_short() {
        text += "\n## All cases together\n";
        text += &markdown(&worded(results, rows));
    }
    for picture in pictures {
        let _ = write!(text, "\n## {}\n\n![{}]({}.png)\n", picture.title, picture.title, picture.stem);
        text += &picture.table();
    }
    text += &theory(results);
    text += "\n## Base and axes\n";
    text += &markdown(&axes(results));
    let base = base(plan, results);
    let _ = match study.level {
        Level::Correlator => write!(text, "\n```toml\n{base}\n```\n"),
        _ => write!(text, "\n{base}\n"),
    };
    let _ = write!(text, "\nSeed {}; what is not named is the receiver's default.\n", study.seed);
    if let Some(rows) = cells(results) {
        text += "\n## Cells\n";
        text += &markdown(&rows);
    }
    text
}

/// Words as a cell of a table can have them.
fn word(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

fn theory(results: &Results) -> String {
    let mut text = String::new();
    for agreement in results.agreement() {
        if text.is_empty() {
            text += "\n## Beside theory\n";
        }
        let _ = write!(text, "\n{}.\n", in_words(results, &agreement));
        let beyond: Vec<_> = agreement.cells.iter().filter(|cell| !cell.holds()).collect();
        if beyond.is_empty() {
            continue;
        }
        text += "\nBeyond:\n";
        text += &markdown(&beyond_theory(results, &beyond));
    }
    text
}

/// Titles of columns, and rows.
pub(super) type Rows = (Vec<String>, Vec<Vec<String>>);

fn markdown((heads, rows): &Rows) -> String {
    let line = |cells: &[String]| cells.iter().map(|cell| word(cell)).collect::<Vec<_>>().join(" | ");
    let mut text = format!("\n| {} |\n|{}\n", line(heads), " --- |".repeat(heads.len()));
    for row in rows {
        let _ = writeln!(text, "| {} |", line(row));
    }
    text
}

/// Cells that are not within their bar of theory.
pub(super) fn beyond_theory(results: &Results, beyond: &[&Compared]) -> Rows {
    let labels = results.study.axes.iter().map(|axis| axis.label().to_owned());
    let heads: Vec<String> = labels.chain(["T·C/N0", "ratio", "allowed"].map(str::to_owned)).collect();
    let row = |compared: &&Compared| {
        let cell = results.cells.get(compared.cell)?;
        let values = (0..results.study.axes.len()).map(|axis| results.words(cell, axis));
        let snr = compared.snr.map_or_else(|| "–".to_owned(), short);
        Some(values.chain([snr, format!("{:.3}", compared.ratio), format!("± {:.3}", compared.bar)]).collect())
    };
    worded(results, (heads, beyond.iter().filter_map(row).collect()))
}

/// Table whose heads are axes and figures in words in place of their keys.
pub(super) fn worded(results: &Results, (heads, rows): Rows) -> Rows {
    let word = |head: String| {
        if let Some(axis) = results.study.axes.iter().find(|axis| axis.label() == head) {
            return axis.words();
        }
        let theory = if head.starts_with(THEORY) { "theory of " } else { "" };
        let known = results.figures.iter().any(|figure| figure.name == head);
        if known { format!("{theory}{}", words::of_figure(&head)) } else { head }
    };
    (heads.into_iter().map(word).collect(), rows)
}

/// Axes and their values.
pub(super) fn axes(results: &Results) -> Rows {
    let row = |axis: &axis::Axis| {
        let (shown, more) = match axis.values.len() {
            count if count > MOST_VALUES => (MOST_VALUES, format!(", … ({count} values)")),
            count => (count, String::new()),
        };
        let values: Vec<String> = axis.values.iter().take(shown).map(axis::text_of).collect();
        let zipped = axis.zip.as_ref().map_or(String::new(), |word| format!(" (steps with others of `{word}`)"));
        vec![format!("{}: `{}`{zipped}", axis.words(), axis.key), values.join(", ") + &more]
    };
    (vec!["axis".to_owned(), "values".to_owned()], results.study.axes.iter().map(row).collect())
}

/// Every cell with its figures; none where there are too many to be read.
pub(super) fn cells(results: &Results) -> Option<Rows> {
    if results.cells.len() > MOST_LISTED {
        return None;
    }
    let labels = results.study.axes.iter().map(|axis| axis.label().to_owned());
    let heads = labels.chain(results.figures.iter().map(|figure| figure.name.clone())).collect();
    let row = |cell: &result::Cell| {
        let values = (0..results.study.axes.len()).map(|axis| results.words(cell, axis));
        let figures = results.figures.iter().zip(&cell.estimates).map(|(figure, estimate)| match estimate {
            None => "–".to_owned(),
            Some(estimate) => match estimate.interval {
                Some((low, high)) if !figure.name.starts_with(THEORY) && high > low => {
                    format!("{} ({} to {})", short(estimate.mean), short(low), short(high))
                }
                _ => short(estimate.mean),
            },
        });
        values.chain(figures).collect()
    };
    Some(worded(results, (heads, results.cells.iter().map(row).collect())))
}

/// The level in words.
pub(super) fn level(plan: &Plan) -> &'static str {
    match plan.study.level {
        Level::Correlator => {
            "the receiver's own loops on modelled correlations (means from signal and errors, noise of the taps' \
             covariance), no samples."
        }
        Level::Samples if plan.is_sampled() => {
            "samples go from the generator to the receiver in memory, from a cold start; cases that differ in the \
             receiver alone receive the same ones."
        }
        Level::Samples => {
            "generator and receiver run in memory, from a cold start, at the level that `[fidelity]` of the scene \
             names."
        }
        Level::Correlations => {
            "the receiver runs on modelled correlations of the scene (`run --level correlations`), from a cold start; \
             no samples are made."
        }
        Level::Observations => {
            "the receiver's navigation runs on modelled observations of the scene (`run --level observations`), from a \
             cold start; no samples are made."
        }
    }
}

/// Text of the base that the axes vary.
pub(super) fn base(plan: &Plan, results: &Results) -> String {
    match results.study.level {
        Level::Correlator => toml::to_string(&results.study.base).unwrap_or_default().trim().to_owned(),
        _ => {
            let names: Vec<String> = plan.bases.iter().map(|base| format!("`{}`", base.written.display())).collect();
            format!("Scenes: {}.", names.join(", "))
        }
    }
}

/// Four digits.
pub(super) fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let digits = libm::floor(libm::log10(x.abs()));
    if (-4.0..6.0).contains(&digits) { format!("{x:.*}", (3.0 - digits).max(0.0) as usize) } else { format!("{x:.3e}") }
}
