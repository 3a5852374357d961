//! The first page of a run's report: what was run and where, whether it passed, and by what.

use serde_json::Value;

use super::tone;
use crate::judge::judgement::{Judgement, Status, number, shown};
use crate::judge::schema::{self, Figures};
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use crate::show::document::{Cell, Item, Report, Side, Table, Tone};
use gnss::earth::Geodetic;
use gnss::facts::Fixes;

/// Figures whose reasons the first page of paper has room for.
const MOST_NAMED: usize = 5;

/// A figure of the first page: its name there, its path in the summary, and how the verdict names its row.
pub(super) struct Figure {
    pub name: &'static str,
    /// Empty where the summary has no such figure, so that the row's value is the measured one.
    pub path: &'static str,
    pub row: &'static str,
}

/// Figures of a run's first page.
pub(super) const FIGURES: [Figure; 6] = [
    Figure { name: "time to first fix", path: "position.first_fix_s", row: "time to first fix" },
    Figure { name: "horizontal error, 95 %", path: "position.horizontal_p95_m", row: "horizontal error, 95 %" },
    Figure { name: "vertical error, 95 %", path: "position.vertical_p95_m", row: "vertical error, 95 %" },
    Figure { name: "velocity error, 95 %", path: "position.velocity_p95_mps", row: "velocity error, 95 %" },
    Figure { name: "epochs without a fix", path: "", row: "epochs without a fix" },
    Figure { name: "cycle slips", path: "tracking.cycle_slips", row: "unexpected cycle slips" },
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

/// The receiver's settings on which errors depend most, in words: of its loops, and of its positions.
pub(super) fn receiver(file: &Value) -> [Option<String>; 2] {
    let settings = file.get("settings").unwrap_or(file);
    let number_at = |path: &str| settings.pointer(path).and_then(Value::as_f64).map(number);
    let text_at = |path: &str| settings.pointer(path).and_then(Value::as_str).map(|text| text.replace('_', " "));
    let loops = [
        number_at("/tracking/pll_bandwidth_hz").map(|hz| format!("phase {hz} Hz")),
        number_at("/tracking/dll_bandwidth_hz").map(|hz| format!("code {hz} Hz")),
        number_at("/tracking/spacing_chips").map(|chips| format!("early to late {chips} chips")),
    ];
    let positions = [
        number_at("/position/smoothing_s").map(|s| format!("smoothing {s} s")),
        text_at("/position/ionosphere").map(|model| format!("ionosphere {model}")),
        text_at("/position/troposphere").map(|model| format!("troposphere {model}")),
    ];
    [loops, positions].map(|parts| {
        let words = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
        (!words.is_empty()).then_some(words)
    })
}

/// The verdict in one bar; `lacking` says what it says nothing of.
pub(super) fn banner(report: &mut Report, verdict: &Verdict, lacking: Option<&str>) {
    let [marginal, fail] = [Status::Marginal, Status::Fail].map(|status| verdict.count(status));
    let all = verdict.rows.len();
    let mut words = match verdict.status() {
        Status::Pass => format!("Passed: {all} of {all} judged figures"),
        Status::Marginal => format!("Passed, in part marginally: {all} of {all} judged figures, {marginal} marginal"),
        Status::Fail if marginal > 0 => format!("Failed: {fail} of {all} judged figures, and {marginal} marginal"),
        Status::Fail => format!("Failed: {fail} of {all} judged figures"),
    };
    let mut tone = tone(verdict.status());
    if let Some(lacking) = lacking {
        words += &format!("; {lacking}");
        // What was asked of a receiver is a position: green would say more than was judged.
        tone = if tone == Tone::Good { Tone::Strong } else { tone };
    }
    report.add(Item::Banner(words, tone));
}

/// Words for what a run's verdict says nothing of: its position.
pub(super) fn lacking(run: &Run, summary: &Summary) -> Option<String> {
    let verdict = &summary.details.verdict;
    let is_judged = verdict.rows.iter().any(|row| {
        let of_place = ["horizontal error", "vertical error", "position error"];
        of_place.iter().any(|name| row.figure.starts_with(name))
            || row.path.as_deref().is_some_and(|path| path.starts_with("position."))
    });
    if is_judged || run.scene.expect.fix(0.0) == Some(Fixes::None) {
        return None;
    }
    Some(match summary.position.first_fix_s {
        None => format!("no fix in {} s, position not judged", number(summary.duration_s)),
        Some(_) => "position not judged".to_owned(),
    })
}

/// Figures as the summary has them, with their limits. Where the verdict judges something else than the
/// measured figure, both stand there, and a note says what was taken out.
pub(super) fn figures(report: &mut Report, verdict: &Verdict, summary: &Value, figures: &[Figure], leaves: &Figures) {
    let rows: Vec<(&Figure, Option<&Judgement>)> =
        figures.iter().map(|figure| (figure, figure.judged(verdict))).collect();
    let measured = |figure: &Figure, row: Option<&Judgement>| match schema::find(summary, figure.path) {
        Some(Value::Null) => "none".to_owned(),
        Some(value) => {
            let unit = leaves.leaf(figure.path).map(|leaf| leaf.unit).filter(|unit| unit != "1");
            with_unit(&shown(value), &unit.unwrap_or_default())
        }
        None => row.map_or_else(|| "–".to_owned(), value_with_unit),
    };
    let differs = |figure: &Figure, row: &Judgement| measured(figure, Some(row)) != value_with_unit(row);
    let are_equal = !rows.iter().any(|(figure, row)| row.is_some_and(|row| differs(figure, row)));
    let columns = [
        ("figure", Side::Left),
        ("measured", Side::Right),
        ("judged", Side::Right),
        ("limit", Side::Right),
        ("verdict", Side::Left),
    ];
    let mut table = Table::new("", columns.into_iter().filter(|(title, _)| !(are_equal && *title == "judged")));
    // Names of figures that are judged without the same.
    let mut notes: Vec<(&str, Vec<String>)> = Vec::new();
    for (figure, row) in rows {
        let mut cells = vec![Cell::from(figure.named(row)), Cell::from(measured(figure, row))];
        if !are_equal {
            cells.push(Cell::from(row.map_or_else(|| "–".to_owned(), value_with_unit)));
        }
        match row {
            Some(row) => {
                cells.push(Cell::from(with_unit(&row.bound.to_string(), &row.unit)));
                cells.push(Cell::toned(row.status.word(), tone(row.status)));
                if differs(figure, row) && !row.without.is_empty() {
                    let name = figure.named(Some(row));
                    match notes.iter_mut().find(|(without, _)| *without == row.without) {
                        Some((_, names)) => names.push(name),
                        None => notes.push((&row.without, vec![name])),
                    }
                }
            }
            None => cells.extend(["–", "not judged"].map(Cell::from)),
        }
        table.row(cells);
    }
    report.table(table);
    if !notes.is_empty() {
        let words = notes.iter().map(|(without, names)| format!("{} without {without}", names.join(" and ")));
        report.add(Item::Note(format!("Judged: {}.", words.collect::<Vec<_>>().join("; "))));
    }
}

impl Figure {
    /// The verdict's row of the figure: the worst of several parts of a run.
    fn judged<'v>(&self, verdict: &'v Verdict) -> Option<&'v Judgement> {
        let at_path = |row: &&Judgement| !self.path.is_empty() && row.path.as_deref() == Some(self.path);
        let parts = || verdict.rows.iter().filter(|row| row.figure == self.row || self.part(row).is_some());
        // Of equal ones the first.
        verdict.rows.iter().find(at_path).or_else(|| parts().rev().max_by_key(|row| row.status))
    }

    /// Part of a run that a row is about.
    fn part<'r>(&self, row: &'r Judgement) -> Option<&'r str> {
        row.figure.strip_prefix(self.row).filter(|rest| rest.starts_with(", "))
    }

    fn named(&self, row: Option<&Judgement>) -> String {
        format!("{}{}", self.name, row.and_then(|row| self.part(row)).unwrap_or(""))
    }
}

fn with_unit(value: &str, unit: &str) -> String {
    if unit.is_empty() { value.to_owned() } else { format!("{value} {unit}") }
}

fn value_with_unit(row: &Judgement) -> String {
    with_unit(&row.value_text(), if row.value.is_null() { "" } else { &row.unit })
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

/// Every figure that failed or is marginal, with its reason; paper prints as many as its first page has room
/// for.
pub(super) fn failures(report: &mut Report, verdict: &Verdict) {
    let of = |status: Status| verdict.rows.iter().filter(move |row| row.status == status);
    let named: Vec<&Judgement> = of(Status::Fail).chain(of(Status::Marginal)).collect();
    report.subheading(match [Status::Fail, Status::Marginal].map(|status| verdict.count(status) > 0) {
        [true, true] => "What failed or is marginal, and why",
        [true, false] => "What failed, and why",
        [false, true] => "What is marginal, and why",
        [false, false] => return,
    });
    let columns = [
        ("figure", Side::Left),
        ("value", Side::Right),
        ("limit", Side::Right),
        ("verdict", Side::Left),
        ("reason", Side::Left),
    ];
    let mut table = Table::new("", columns);
    table.printed = Some(MOST_NAMED);
    for row in named {
        let margin = row.margin_text();
        let why = if row.why.is_empty() { row.origin() } else { row.why.join("; ") };
        let why = if margin.is_empty() { why } else { format!("{margin}; {why}") };
        let verdict = if row.status == Status::Fail { "failed" } else { "marginal" };
        let cells = [row.figure.clone(), value_with_unit(row), with_unit(&row.bound.to_string(), &row.unit)];
        let cells = cells.into_iter().chain([verdict.to_owned()]).map(|text| Cell::toned(text, tone(row.status)));
        table.row(cells.chain([Cell::from(why)]));
    }
    report.table(table);
}

#[cfg(test)]
mod tests;
