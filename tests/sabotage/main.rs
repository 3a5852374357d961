//! The judge judged: results of a sound receiver are damaged, a little and a little more, and the verdict
//! must pass the one and fail the other.
//!
//! Six closed loops are run: at rest, in motion, of two systems, of two bands, without the ionosphere's
//! parameters, and with authenticated messages. Each kind of damage edits the
//! tables of `rx/` or the spectrum in a copy and has two sizes: one that an evaluator would still call sound,
//! with which no row may fail, and one a small factor larger, which must fail by a row that names it. Where
//! no size is sound (a row twice, a week too many) the smaller one is absent.
//! `GNSS_TWIN_WRITE_SABOTAGE=$PWD/reports/sabotage.md` makes a run write the table, and
//! `GNSS_TWIN_SABOTAGE_ONLY` names the kinds that are run by a part of their name.
#![cfg(all(feature = "cli", feature = "pdf"))]

mod detection;
mod early;
mod excused;
mod files;
mod fixes;
mod foreign;
mod links;
mod observations;
mod osnma;
mod protection;
mod rinex;
mod run;
mod spectrum;
mod table;
mod tables;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use analysis::{JudgeError, assess};
use run::{Rx, Scene, at_rest, elsewhere, in_motion};

/// One kind of damage.
pub struct Kind {
    pub name: &'static str,
    pub unit: &'static str,
    /// Largest size that passes, as a user would call it sound; none where any is a fault.
    pub tolerable: Option<f64>,
    pub broken: f64,
    /// Rows of the verdict of which one must fail.
    pub rows: &'static [&'static str],
    pub scene: Scene,
    pub apply: fn(&mut Rx, f64),
}

fn kinds() -> Vec<Kind> {
    [
        fixes::kinds(),
        observations::kinds(),
        links::kinds(),
        tables::kinds(),
        spectrum::kinds(),
        files::kinds(),
        excused::kinds(),
        early::kinds(),
        osnma::kinds(),
        protection::kinds(),
        detection::kinds(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Rows that fail of a scene's results, damaged so.
fn failed(kind: &Kind, size: f64) -> Result<BTreeSet<String>, JudgeError> {
    let directory = tempfile::tempdir().unwrap();
    let mut rx = Rx::copy(kind.scene, directory.path());
    (kind.apply)(&mut rx, size);
    rx.write();
    let summary = assess(directory.path(), None)?;
    let rows = summary.details.verdict.rows;
    Ok(rows.into_iter().filter(|row| row.status.word() == "FAIL").map(|row| row.figure).collect())
}

/// Line of the table for a kind, and its fault, if there is one.
fn outcome(kind: &Kind) -> (String, Option<String>) {
    let listed = |rows: &BTreeSet<String>| rows.iter().cloned().collect::<Vec<_>>().join(", ");
    let mut wrong = Vec::new();
    if let Some(size) = kind.tolerable {
        match failed(kind, size) {
            Ok(rows) if rows.is_empty() => {}
            Ok(rows) => wrong.push(format!("{size} {} fails {}", kind.unit, listed(&rows))),
            Err(error) => wrong.push(format!("{size} {}: {error}", kind.unit)),
        }
    }
    let caught = match failed(kind, kind.broken) {
        Ok(rows) => {
            let caught: BTreeSet<String> =
                rows.iter().filter(|row| kind.rows.contains(&row.as_str())).cloned().collect();
            if caught.is_empty() {
                wrong.push(format!("{} {} fails only: {}", kind.broken, kind.unit, listed(&rows)));
            }
            listed(&caught)
        }
        Err(error) => {
            wrong.push(format!("{} {}: {error}", kind.broken, kind.unit));
            String::new()
        }
    };
    let small = kind.tolerable.map_or("none".to_owned(), |size| format!("{size} {}", kind.unit));
    let line = format!("| {} | {small} | {} {} | {caught} |", kind.name, kind.broken, kind.unit);
    (line, (!wrong.is_empty()).then(|| format!("{}: {}", kind.name, wrong.join("; "))))
}

#[test]
fn every_kind_of_damage_passes_where_it_is_tolerable_and_fails_by_its_row_where_it_is_not() {
    let mut kinds = kinds();
    let names: BTreeSet<&str> = kinds.iter().map(|kind| kind.name).collect();
    assert_eq!(names.len(), kinds.len(), "two kinds bear one name");
    let both = kinds.iter().filter(|kind| kind.tolerable.is_some()).count();
    assert!(both >= 60, "{both} kinds with two sizes");
    let only = std::env::var("GNSS_TWIN_SABOTAGE_ONLY").unwrap_or_default();
    kinds.retain(|kind| kind.name.contains(&only));
    // Every third each day, all with `GNSS_TWIN_LONG` or of those that are asked for.
    if only.is_empty() && std::env::var_os("GNSS_TWIN_LONG").is_none() {
        let mut number = 0..;
        kinds.retain(|_| number.next().is_some_and(|n: usize| n.is_multiple_of(3)));
    }
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((number, kind)) = {
                    let n = next.fetch_add(1, Ordering::Relaxed);
                    kinds.get(n).map(|k| (n, k))
                } {
                    let outcome = outcome(kind);
                    found.lock().unwrap_or_else(PoisonError::into_inner).push((number, outcome));
                }
            });
        }
    });
    let mut found = found.into_inner().unwrap();
    found.sort_by_key(|(number, _)| *number);
    if let Some(path) = std::env::var_os("GNSS_TWIN_WRITE_SABOTAGE") {
        std::fs::write(path, report(both, &found)).unwrap();
    }
    let wrong: Vec<String> = found.into_iter().filter_map(|(_, (_, wrong))| wrong).collect();
    assert!(wrong.is_empty(), "{} of {} kinds:\n{}", wrong.len(), kinds.len(), wrong.join("\n"));
}

fn report(both: usize, found: &[(usize, (String, Option<String>))]) -> String {
    let caught = found.iter().filter(|(_, (_, wrong))| wrong.is_none()).count();
    let mut text = format!(
        "# Sabotaged results\n\nThe results of a sound receiver, damaged in `rx/` or `psd.csv` and judged again. The tolerable \
         size passes every row, the broken one fails by the rows named; {both} of {} kinds have a tolerable size. \
         Caught: {caught} of {}. Written by `tests/sabotage`.\n\n\
         | damage | tolerable | broken | failed by |\n| --- | --- | --- | --- |\n",
        found.len(),
        found.len()
    );
    for (_, (line, _)) in found {
        writeln!(text, "{line}").unwrap();
    }
    text
}

#[test]
fn results_as_the_receiver_wrote_them_fail_no_row() {
    for (name, run) in [("at rest", at_rest()), ("in motion", in_motion()), ("elsewhere", elsewhere())] {
        let summary = assess(run, None).unwrap();
        let failed: Vec<String> = (summary.details.verdict.rows.iter())
            .filter(|row| row.status.word() == "FAIL")
            .map(|row| format!("{}: {} {}, {}", row.figure, row.value_text(), row.unit, row.source))
            .collect();
        assert!(failed.is_empty(), "{name}:\n{}", failed.join("\n"));
    }
}

#[test]
fn a_number_that_is_none_is_refused_with_file_line_and_column() {
    for (table, column, text) in [
        ("fixes", "x_m", "NaN"),
        ("observations", "doppler_hz", "inf"),
        ("tracking", "prompt_i", "-inf"),
        ("fixes", "sigma_up_m", "1e999"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let mut rx = Rx::copy(Scene::AtRest, directory.path());
        rx.table(table).put(3, column, text);
        rx.write();
        let error = assess(directory.path(), None).unwrap_err().to_string();
        // The header is line 1, so that row 3 is line 5.
        assert!(error.contains(&format!("{table}.csv: line 5: {column} = {text}")), "{error}");
    }
}
