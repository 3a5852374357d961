//! Writes a finished study down: `cases.csv`, `cells.csv`, pictures and `report.md` in its directory.
//!
//! Bytes follow from plan and results alone: how long it took and where stands nowhere. Other forms of report start from
//! [`Results`] and [`draw::pictures`] as this one does.

use std::fmt::Write;

use super::draw::{self, Picture};
use super::plan::Plan;
use super::result::{self, Agreement, Compared, Results, THEORY};
use super::spec::Level;
use super::{StudyError, axis, plan};
use crate::study::proof::LEAST_SNR;

/// Cells that the report lists; the rest stand in `cells.csv`.
const MOST_LISTED: usize = 60;

/// Writes everything.
///
/// # Errors
/// A file that cannot be written.
pub fn write(plan: &Plan, lines: &[String], results: &Results) -> Result<(), StudyError> {
    let directory = &plan.directory;
    plan::write(&directory.join("cases.csv"), &result::table(plan, lines))?;
    plan::write(&directory.join("cells.csv"), &results.table()?)?;
    let pictures = draw::pictures(results);
    for picture in &pictures {
        for ending in ["png", "svg"] {
            picture.draw(&directory.join(format!("{}.{ending}", picture.stem)))?;
        }
    }
    plan::write(&directory.join("report.md"), text(plan, results, &pictures).as_bytes())
}

/// What a terminal shows of a finished study: theory beside measurement.
pub fn in_short(results: &Results) -> String {
    results.agreement().iter().map(|agreement| in_words(results, agreement) + "\n").collect()
}

fn in_words(results: &Results, agreement: &Agreement) -> String {
    let name = results.figures.get(agreement.figure).map_or("", |figure| figure.name.as_str());
    let (region, outside): (Vec<&Compared>, Vec<&Compared>) = agreement.cells.iter().partition(|cell| cell.in_region());
    let good = |cells: &[&Compared]| cells.iter().filter(|cell| cell.holds()).count();
    let ratios = || region.iter().map(|cell| cell.ratio);
    let mut words = format!(
        "{name}: {} of {} cells with T·C/N0 ≥ {LEAST_SNR} are within {:.0} % of theory or the measurement's 95 % interval",
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
    let level = match study.level {
        Level::Correlator => {
            "**Correlator level**: the receiver's own loops on modelled correlations (means from signal and errors, noise of \
             the taps' covariance), no samples."
        }
        Level::Samples => {
            "**Sample level**: samples go from the generator to the receiver in memory, from a cold start; cases that differ \
             in the receiver alone hear the same ones."
        }
    };
    let _ = write!(
        text,
        "\n{level} {} cases: {} cells, {} repetitions each with other noise. Intervals hold the mean with 95 % confidence. \
         Everything: `cases.csv`, `cells.csv`.\n",
        grid.cases(),
        grid.cells(),
        grid.repetitions
    );
    for picture in pictures {
        let _ = write!(text, "\n## {}\n\n![{}]({}.png)\n", picture.title, picture.title, picture.stem);
        text += &picture.table();
    }
    text += &theory(results);
    text += &base(plan, results);
    text += &cells(results);
    text
}

/// Words as a cell of a table can hold them.
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
        text += "\nBeyond:\n\n";
        let keys: Vec<String> = results.study.axes.iter().map(|axis| word(axis.label())).collect();
        let _ = writeln!(text, "| {} | T·C/N0 | ratio | allowed |", keys.join(" | "));
        let _ = writeln!(text, "|{}", " --- |".repeat(keys.len() + 3));
        for compared in beyond {
            let Some(cell) = results.cells.get(compared.cell) else { continue };
            let values: Vec<String> = (0..keys.len()).map(|axis| word(&results.value_text(cell, axis))).collect();
            let snr = compared.snr.map_or_else(|| "–".to_owned(), short);
            let _ =
                writeln!(text, "| {} | {snr} | {:.3} | ± {:.3} |", values.join(" | "), compared.ratio, compared.bar);
        }
    }
    text
}

fn base(plan: &Plan, results: &Results) -> String {
    let study = &results.study;
    let mut text = "\n## Base and axes\n\n| axis | values |\n| --- | --- |\n".to_owned();
    for axis in &study.axes {
        let values: Vec<String> = axis.values.iter().map(axis::text_of).collect();
        let zipped = axis.zip.as_ref().map_or(String::new(), |word| format!(" (steps with others of `{word}`)"));
        let _ = writeln!(text, "| `{}`{zipped} | {} |", word(&axis.key), word(&values.join(", ")));
    }
    match study.level {
        Level::Correlator => {
            let base = toml::to_string(&study.base).unwrap_or_default();
            let _ = write!(text, "\n```toml\n{}\n```\n", base.trim());
        }
        Level::Samples => {
            let names: Vec<String> = plan.bases.iter().map(|base| format!("`{}`", base.written.display())).collect();
            let _ = write!(text, "\nScenes: {}.\n", names.join(", "));
        }
    }
    let _ = write!(text, "\nSeed {}; what is not named is the receiver's default.\n", study.seed);
    text
}

fn cells(results: &Results) -> String {
    if results.cells.len() > MOST_LISTED {
        return String::new();
    }
    let keys = results.study.axes.iter().map(|axis| word(axis.label()));
    let heads: Vec<String> = keys.chain(results.figures.iter().map(|figure| word(&figure.name))).collect();
    let mut text = format!("\n## Cells\n\n| {} |\n|{}\n", heads.join(" | "), " --- |".repeat(heads.len()));
    for cell in &results.cells {
        let values = (0..results.study.axes.len()).map(|axis| word(&results.value_text(cell, axis)));
        let figures = results.figures.iter().zip(&cell.estimates).map(|(figure, estimate)| match estimate {
            None => "–".to_owned(),
            Some(estimate) => match estimate.interval {
                Some((low, high)) if !figure.name.starts_with(THEORY) && high > low => {
                    format!("{} ({} to {})", short(estimate.mean), short(low), short(high))
                }
                _ => short(estimate.mean),
            },
        });
        let row: Vec<String> = values.chain(figures).collect();
        let _ = writeln!(text, "| {} |", row.join(" | "));
    }
    text
}

/// Four digits.
pub(super) fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let digits = libm::floor(libm::log10(x.abs()));
    if (-4.0..6.0).contains(&digits) { format!("{x:.*}", (3.0 - digits).max(0.0) as usize) } else { format!("{x:.3e}") }
}
