//! The first page of a run's report: what was run and where, whether it passed, and by what.

use super::tone;
use crate::judge::judgement::{Judgement, Status, number};
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use crate::show::document::{Cell, Item, Report, Side, Table, Tone};
use gnss::earth::Geodetic;

/// Failures whose reasons the first page of paper has room for.
const MOST_FAILURES: usize = 5;

/// The verdict's rows that the first page shows as figures.
const FIGURES: [&str; 6] = [
    "time to first fix",
    "horizontal error, 95 %",
    "vertical error, 95 %",
    "velocity error, 95 %",
    "epochs without a fix",
    "unexpected cycle slips",
];

/// Position and time in one line.
pub(super) fn place_and_time(run: &Run) -> String {
    let start = run.scene_json.get("start").and_then(|start| start.as_str()).unwrap_or("");
    let start = start.trim_end_matches(".000000").replace('T', " ");
    let mut parts = Vec::new();
    if let Some(first) = run.trajectory.first() {
        let place = Geodetic::from_ecef(&first.position_m());
        let (latitude, longitude) = (place.latitude_rad.to_degrees(), place.longitude_rad.to_degrees());
        parts.push(format!(
            "{:.4}° {}, {:.4}° {}, {:.0} m",
            latitude.abs(),
            if latitude < 0.0 { "S" } else { "N" },
            longitude.abs(),
            if longitude < 0.0 { "W" } else { "E" },
            place.height_m
        ));
    }
    if !start.is_empty() {
        parts.push(format!("{start} GPS time"));
    }
    parts.push(format!("{} s", number(run.scene.duration_s)));
    parts.join(" · ")
}

/// The verdict in one bar.
pub(super) fn banner(report: &mut Report, verdict: &Verdict) {
    let word = match verdict.status() {
        Status::Pass => "Passed",
        Status::Marginal => "Passed, in part marginally",
        Status::Fail => "Failed",
    };
    report.add(Item::Banner(format!("{word}: {}", verdict.in_words()), tone(verdict.status())));
}

/// Six figures with their limits.
pub(super) fn figures(report: &mut Report, summary: &Summary) {
    let columns = [("figure", Side::Left), ("value", Side::Right), ("limit", Side::Right), ("verdict", Side::Left)];
    let mut table = Table::new("", columns);
    for figure in FIGURES {
        let row = summary.details.verdict.rows.iter().find(|row| row.figure.starts_with(figure));
        match row {
            Some(row) => table.row([
                Cell::from(figure),
                Cell::from(with_unit(row)),
                Cell::from(if row.unit.is_empty() {
                    row.bound.to_string()
                } else {
                    format!("{} {}", row.bound, row.unit)
                }),
                Cell::toned(row.status.word(), tone(row.status)),
            ]),
            None => {
                let first_s = summary.position.first_fix_s.filter(|_| figure == "time to first fix");
                let value = first_s.map_or_else(|| "–".to_owned(), |first_s| format!("{} s", number(first_s)));
                table.row([figure, &value, "–", "not judged"]);
            }
        }
    }
    report.table(table);
}

fn with_unit(row: &Judgement) -> String {
    if row.unit.is_empty() || row.value.is_null() {
        row.value_text()
    } else {
        format!("{} {}", row.value_text(), row.unit)
    }
}

/// Writes how many figures of each group passed.
pub(super) fn groups(report: &mut Report, verdict: &Verdict) {
    let columns =
        [("what was judged", Side::Left), ("passed", Side::Right), ("marginal", Side::Right), ("verdict", Side::Left)];
    let mut table = Table::new("", columns);
    for (group, [pass, marginal, fail]) in verdict.groups() {
        let status = match (marginal, fail) {
            (0, 0) => Status::Pass,
            (_, 0) => Status::Marginal,
            _ => Status::Fail,
        };
        let all = pass + marginal + fail;
        table.row([
            Cell::from(group.words()),
            Cell::from(format!("{} of {all}", pass + marginal)),
            Cell::from(if marginal > 0 { marginal.to_string() } else { String::new() }),
            Cell::toned(status.word(), tone(status)),
        ]);
    }
    report.table(table);
}

/// Every failure with its reason; paper prints as many as its first page has room for.
pub(super) fn failures(report: &mut Report, verdict: &Verdict) {
    let failed: Vec<&Judgement> = verdict.rows.iter().filter(|row| row.status == Status::Fail).collect();
    if failed.is_empty() {
        return;
    }
    report.subheading("What failed, and why");
    let columns = [("figure", Side::Left), ("value", Side::Right), ("limit", Side::Right), ("reason", Side::Left)];
    let mut table = Table::new("", columns);
    table.printed = Some(MOST_FAILURES);
    for row in failed {
        let why = if row.why.is_empty() { row.source.clone() } else { row.why.join("; ") };
        let cells =
            [row.figure.clone(), with_unit(row), row.bound.to_string()].map(|text| Cell::toned(text, Tone::Bad));
        table.row(cells.into_iter().chain([Cell::from(why)]));
    }
    report.table(table);
}
