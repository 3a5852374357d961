//! `report.pdf` and `report.html` of a run: what was run and what came of it on one page, then the whole
//! verdict, tables, pictures, settings, and how the figures were made.

pub(crate) mod foreign;
mod front;
mod method;
mod tables;

use std::fmt::Display;
use std::path::Path;

use serde_json::Value;

use crate::error::JudgeError;
use crate::judge::judgement::{Status, number};
use crate::judge::schema;
use crate::judge::verdict::Verdict;
use crate::measure::osnma::Osnma;
use crate::read::Run;
use crate::show::document::{Cell, Forms, Item, Report, Side, Table, Tone};
use crate::show::plot::canvas::Failure;
use crate::show::plot::sketch::{Figure, Sketch};
use crate::show::plot::{self, Judged};
use crate::show::report::is_modelled;
use crate::show::write::{retire, write_whole};
use crate::statistics::larger;

/// A run's report, complete but for its pictures.
pub(crate) struct RunReport {
    report: Report,
    /// Index among the items at which the pictures are inserted.
    figures: usize,
    /// Sketches of the first page, and the number of the page's item before which they come.
    front: ([Sketch; 2], usize),
}

impl RunReport {
    /// Report of a run.
    pub fn new(judged: &Judged<'_>) -> Result<Self, JudgeError> {
        let summary = judged.summary;
        let head = format!("receiver against truth · seed {}", summary.seed);
        let mut report = Report::new(summary.scene.clone(), front::place_and_time(judged.run), head);
        let verdict_of = &summary.details.verdict;
        front::banner(&mut report, verdict_of, front::lacking(judged.run, summary).as_deref());
        front::failures(&mut report, verdict_of);
        report.add(Item::Facts(facts(judged)?));
        let front = (plot::front(judged)?, report.items.len());
        let values = serde_json::to_value(summary).unwrap_or(Value::Null);
        front::figures(&mut report, verdict_of, &values, &front::FIGURES, &schema::SUMMARY);
        front::groups(&mut report, verdict_of);
        report.add(Item::NewPage).heading("Verdict");
        verdict(&mut report, verdict_of);
        report.add(Item::NewPage);
        tables::add(&mut report, judged)?;
        report.add(Item::NewPage).heading("Figures");
        let figures = report.items.len();
        report.add(Item::NewPage);
        settings(&mut report, judged);
        method::add(&mut report, judged);
        Ok(Self { report, figures, front })
    }

    /// Writes `report.pdf` and `report.html` with their pictures into a run's directory, as asked.
    pub fn write(mut self, directory: &Path, forms: Forms, figures: Vec<Figure>) -> Result<(), JudgeError> {
        let ([sky, errors], front) = self.front;
        let failed = |error: Failure| not_drawn(directory, &error);
        let pair = [
            Figure::new("front_sky", sky, "").map_err(failed)?,
            Figure::new("front_errors", errors, "").map_err(failed)?,
        ];
        // A run that was too short for a fix has nothing to show in half of its pictures.
        let (figures, empty): (Vec<Figure>, Vec<Figure>) =
            figures.into_iter().partition(|figure| figure.sketch.has_data());
        let names: Vec<&str> = empty.iter().map(|figure| plot::title(&figure.name)).collect();
        let note = (!names.is_empty())
            .then(|| Item::Note(format!("Left out, because this run has no data for them: {}.", names.join(", "))));
        self.report.items.splice(self.figures..self.figures, figures.into_iter().map(Item::Figure).chain(note));
        self.report.items.insert(front, Item::Pair(Box::new(pair)));
        publish(&self.report, &directory.join("report"), forms)
    }
}

fn not_drawn(path: &Path, error: &dyn Display) -> JudgeError {
    JudgeError::Plot { path: path.to_owned(), reason: error.to_string() }
}

/// Writes a report in the forms that are asked for, each under the name with its ending. A form that is not
/// asked for would be that of an older verdict, and is removed.
pub(crate) fn publish(report: &Report, name: &Path, forms: Forms) -> Result<(), JudgeError> {
    for (asked, ending) in [(forms.pdf, "pdf"), (forms.html, "html")] {
        if !asked {
            retire(&name.with_extension(ending))?;
        }
    }
    #[cfg(feature = "pdf")]
    if forms.pdf {
        let path = name.with_extension("pdf");
        write_whole(&path, &report.pdf().map_err(|error| not_drawn(&path, &error))?)?;
    }
    if forms.html {
        write_whole(&name.with_extension("html"), report.html().as_bytes())?;
    }
    Ok(())
}

fn tone(status: Status) -> Tone {
    match status {
        Status::Pass => Tone::Good,
        Status::Marginal => Tone::Caution,
        Status::Fail => Tone::Bad,
    }
}

/// Every judged figure, the worst first among equals of their order.
fn verdict(report: &mut Report, verdict: &Verdict) {
    let names = |status: Status| -> String {
        let of = verdict.rows.iter().filter(|row| row.status == status).map(|row| row.figure.as_str());
        of.collect::<Vec<_>>().join(", ")
    };
    let mut words = verdict.in_words();
    for (status, lead) in [(Status::Fail, "Failed"), (Status::Marginal, "Marginal")] {
        if verdict.count(status) > 0 {
            words += &format!("\n{lead}: {}", names(status));
        }
    }
    report.add(Item::Banner(words, tone(verdict.status())));
    let columns = [
        ("figure", Side::Left),
        ("value", Side::Right),
        ("limit", Side::Right),
        ("margin", Side::Right),
        ("verdict", Side::Left),
        ("origin of the limit", Side::Left),
    ];
    let mut table = Table::new("", columns);
    if verdict.groups().len() > 1 {
        table.groups = verdict.rows.iter().map(|row| row.group.words().to_owned()).collect();
    }
    for row in &verdict.rows {
        // Blanks that bind keep a number with its unit.
        let bound = |text: String| Cell::from(text.replace(' ', "\u{a0}"));
        let with_unit = |text: String| if row.unit.is_empty() { text } else { format!("{text} {}", row.unit) };
        table.row([
            Cell::from(row.figure.replace(" %", "\u{a0}%")),
            bound(with_unit(row.value_text())),
            bound(row.bound.to_string()),
            bound(row.margin_text()),
            Cell::toned(row.status.word(), tone(row.status)),
            Cell::toned(row.origin(), Tone::Faint),
        ]);
    }
    report.table(table);
    let mut notes = "Marginal: less than a tenth of the limit is left, or what the file of limits sets. ".to_owned();
    for row in verdict.rows.iter().filter(|row| row.status != Status::Pass && !row.why.is_empty()) {
        notes += &format!("{}: {}. ", row.figure, row.why.join("; "));
    }
    if !verdict.not_judged.is_empty() {
        notes += &format!("Not judged: {}.", verdict.not_judged.join("; "));
    }
    report.add(Item::Note(notes));
}

fn facts(judged: &Judged<'_>) -> Result<Vec<(String, String)>, JudgeError> {
    let (scene, summary) = (&judged.run.scene, judged.summary);
    let file = &judged.run.scene_json;
    let text = |key: &str| match file.get(key) {
        None | Some(Value::Null) => None,
        Some(Value::String(text)) => Some(text.clone()),
        Some(Value::Array(items)) => Some(
            items
                .iter()
                .map(|item| item.as_str().map_or_else(|| item.to_string(), str::to_owned))
                .collect::<Vec<_>>()
                .join(", "),
        ),
        Some(other) => Some(other.as_f64().map_or_else(|| other.to_string(), number)),
    };
    let knobs = [
        ("edges", "code_edge"),
        ("waveform", "waveform"),
        ("carrier", "carrier"),
        ("tolerance", "knot_tolerance_cycles"),
        ("noise", "noise_arithmetic"),
    ];
    let is_modelled = is_modelled(&scene.fidelity);
    // Arithmetic of samples that were not made.
    let of_samples = ["carrier", "noise"];
    let knobs: Vec<String> = knobs
        .into_iter()
        .filter(|(name, _)| !(is_modelled && of_samples.contains(name)))
        .filter_map(|(name, key)| {
            Some(format!("{name} {}{}", text(key)?, if name == "tolerance" { " cycles" } else { "" }))
        })
        .collect();
    let satellites = &summary.satellites;
    let front_end = format!("{} Msps, {}", number(scene.sample_rate_hz / 1e6), scene.format);
    let modelled = format!("{} s of {}, no samples", number(summary.duration_s), scene.fidelity);
    let mut facts = vec![
        ("program", Some(concat!("gnss-twin ", env!("CARGO_PKG_VERSION")).to_owned())),
        ("modelled", is_modelled.then_some(modelled)),
        (if is_modelled { "front end" } else { "samples" }, Some(front_end)),
        ("centre", scene.center_hz.map(|hz| format!("{} MHz", hz / 1e6))),
        ("signals", text("signals")),
        ("fidelity", Some(format!("{} ({})", scene.fidelity, knobs.join(", ")))),
        ("thermal noise", Some(if scene.noise { "yes" } else { "none" }.to_owned())),
        ("elevation mask", scene.mask_deg.map(|mask| format!("{mask}°"))),
        ("interference", (!scene.interference.is_empty()).then(|| format!("{} sources", scene.interference.len()))),
        ("spoofer", summary.spoofing.map(|_| "yes".to_owned())),
        ("authentication", summary.osnma.as_ref().map(authentication)),
    ];
    let found = format!("{} in view, {} acquired, {} used", satellites.in_view, satellites.acquired, satellites.used);
    facts.push(("satellites", Some(found)));
    let fixes = summary.position.first_fix_s.map_or_else(
        || "none".to_owned(),
        |first_s| format!("{}, the first after {} s", summary.position.fixes, number(first_s)),
    );
    facts.push(("fixes", Some(fixes)));
    facts.push(("motion", motion(judged.run)?));
    let [loops, positions] = front::receiver(&judged.run.receiver);
    facts.extend([("loops", loops), ("positions", positions)]);
    Ok(facts.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect())
}

/// Counts of a receiver's verification in words.
fn authentication(osnma: &Osnma) -> String {
    let first = osnma.first_authentic_s.map_or("none".to_owned(), |s| format!("the first after {} s", number(s)));
    format!(
        "{} start: {} tags authentic ({} false), {first}; {} refused ({} true), {} open",
        osnma.start,
        osnma.tags_authentic,
        osnma.false_accepted,
        osnma.tags_refused,
        osnma.true_refused,
        osnma.tags_open
    )
}

/// The antenna's motion in words.
fn motion(run: &Run) -> Result<Option<String>, JudgeError> {
    let mut fastest_mps = None;
    run.trajectory.each(|row| fastest_mps = larger(fastest_mps, row.velocity_mps().norm()))?;
    Ok(fastest_mps.map(|mps| if mps < 1e-3 { "at rest".to_owned() } else { format!("up to {} m/s", number(mps)) }))
}

/// The scene as it was written, or as it was understood, and the receiver's settings.
fn settings(report: &mut Report, judged: &Judged<'_>) {
    report.heading("Settings");
    match &judged.run.scenario {
        Some(text) => report.subheading("Scene, scenario.toml").add(Item::Listing(text.clone())),
        None => report.subheading("Scene, truth/scene.json").add(Item::Listing(flat(&judged.run.scene_json))),
    };
    let settings = judged.run.receiver.get("settings").unwrap_or(&judged.run.receiver);
    if !settings.is_null() {
        report.subheading("Receiver, rx/receiver.json").add(Item::Listing(flat(settings)));
    }
}

/// JSON as lines `path = value`.
fn flat(value: &Value) -> String {
    fn walk(path: &str, value: &Value, lines: &mut Vec<String>) {
        match value {
            Value::Object(map) => map.iter().for_each(|(key, below)| {
                walk(&if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, below, lines);
            }),
            other => lines.push(format!("{path} = {other}")),
        }
    }
    let mut lines = Vec::new();
    walk("", value, &mut lines);
    lines.join("\n")
}

#[cfg(test)]
mod tests;
