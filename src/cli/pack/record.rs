//! One entry of a pack: its digest, its run in a directory of its own, and what the matrix keeps of it.
//!
//! A finished entry is a directory with `entry.json`, whose digest binds it to scene, files, limits, level
//! and program. It is made as `.NAME.part` and renamed, so that a killed run leaves whole entries and parts
//! that the next one removes. Numbers are kept as text: they are written once and never rounded again. Wall
//! times are in no file of an entry.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use toml::{Table as Document, Value};

use super::args::Level;
use super::manifest::Entry;
use crate::cli::error::CliError;
use crate::cli::made::{self, Failure, Wanted};
use crate::cli::run::{judge_error, receiver_error};
use crate::cli::scenario::scenario_error;
use analysis::judge::judgement::{Judgement, Status};
use analysis::judge::summary::Summary;
use analysis::show::staged::Staged;
use analysis::show::{tables, write::write_whole};
use generator::fidelity::Grade;
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use receiver::ReceiveError;
use receiver::lead::undated;
use receiver::settings::Settings;

/// File that a finished entry has.
const RECORD: &str = "entry.json";

/// Verdict of an entry's run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every figure is within its limit.
    Pass,
    /// Every figure is within its limit, one at least by little.
    Marginal,
    /// A figure is beyond its limit.
    Fail,
    /// The level has no model of an effect of the scene: nothing ran.
    NotModelled,
}

/// Figure of a verdict against its limit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Figure {
    pub figure: String,
    /// Path in `summary.json`; empty where there is none.
    pub path: String,
    pub value: String,
    pub unit: String,
    pub limit: String,
}

/// Figures of an entry that the matrix keeps.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record {
    pub digest: String,
    pub verdict: Verdict,
    /// Reason for which nothing ran; empty otherwise.
    pub reason: String,
    pub passed: usize,
    pub marginal: usize,
    /// Horizontal error that 95 % of the fixes stay below, metres.
    pub horizontal_p95_m: Option<String>,
    /// Share of the epochs from the first fix to the end that have a fix, percent; 0 without a fix.
    pub fixes_percent: Option<String>,
    /// Seconds from the first sample to the first fix.
    pub first_fix_s: Option<String>,
    /// Figure with the least margin to its limit, of the failed ones if there are any.
    pub worst: Option<Figure>,
    pub failed: Vec<Figure>,
}

/// Scenes of an entry's front ends at a level, and the settings of its receiver.
///
/// # Errors
/// Values of the scene that do not fit together, at the entry's position in the manifest.
pub fn composed(entry: &Entry, level: Level) -> Result<(Vec<Scene>, Settings), CliError> {
    let at = |error: CliError| error.at(&format!("{}: {}", entry.place, entry.name));
    let scenario = at_level(&entry.scenario, level);
    let composed = scenario.compose_all(&scenario.directory, &Overrides::default());
    let (scenes, _) = composed.map_err(|error| at(scenario_error(error)))?;
    let settings = twin::settings_for(&scenes, &entry.settings);
    if let Some((signal, reason)) = undated(&settings.acquisition.signals()) {
        return Err(at(receiver_error(ReceiveError::Unsupported { signal: signal.name, reason })));
    }
    Ok((scenes, settings))
}

fn at_level(scenario: &Scenario, level: Level) -> Scenario {
    let mut scenario = scenario.clone();
    let grade = match level {
        Level::Samples => return scenario,
        Level::Correlations => Grade::Correlations,
        Level::Observations => Grade::Observations,
    };
    let ends = scenario.front_ends.iter_mut();
    ends.for_each(|front_end| front_end.fidelity = front_end.fidelity.at(grade));
    scenario
}

/// Digest of everything that an entry's results follow from. `build` stands for the program.
///
/// # Errors
/// A file of the scene that cannot be read.
pub fn digest(entry: &Entry, level: Level, keep: bool, build: &str) -> Result<String, CliError> {
    let mut hash = Sha256::new();
    let mut add = |bytes: &[u8]| {
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    };
    let limits = entry.limits.as_ref().map_or("", |(_, text)| text.as_str());
    let kept = if keep { "kept" } else { "" };
    [build, level.name(), kept, &entry.name, &entry.text, limits].into_iter().for_each(|text| add(text.as_bytes()));
    // Files that the scene names: any text in it that is one.
    let document: Document = toml::from_str(&entry.text).map_err(CliError::bug)?;
    let mut named = Vec::new();
    document.values().for_each(|value| texts(value, &mut named));
    for name in named {
        let path = entry.scenario.directory.join(name);
        if path.is_file() {
            add(name.as_bytes());
            add(&fs::read(&path).map_err(|error| CliError::read(path.display(), &error))?);
        }
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

fn texts<'v>(value: &'v Value, found: &mut Vec<&'v str>) {
    match value {
        Value::String(text) => found.push(text),
        Value::Array(items) => items.iter().for_each(|item| texts(item, found)),
        Value::Table(table) => table.values().for_each(|value| texts(value, found)),
        _ => {}
    }
}

/// The record of a finished entry with that digest; `None` where it has to run.
pub fn finished(directory: &Path, digest: &str) -> Option<Record> {
    let text = fs::read_to_string(directory.join(RECORD)).ok()?;
    serde_json::from_str::<Record>(&text).ok().filter(|record| record.digest == digest)
}

/// Runs an entry and judges it; its directory is there when this returns.
///
/// # Errors
/// A file that cannot be written, or samples that cannot be generated or received.
pub fn run(
    entry: &Entry,
    (level, keep): (Level, bool),
    (digest, directory): (&str, &Path),
    told: &(dyn Fn(u64) + Sync),
) -> Result<Record, CliError> {
    let (scenes, settings) = composed(entry, level)?;
    let part = directory.with_file_name(format!(".{}.part", entry.name));
    let making = Staged::directory(part).map_err(|error| CliError::create(directory.display(), &error))?;
    let here = making.path();
    write(&here.join("scenario.toml"), entry.text.as_bytes())?;
    let wanted = Wanted { exchanged: None, keep_if: false, told };
    let record = match made::make(here, &scenes, &settings, &wanted) {
        Ok(_) => {
            let summary = analysis::assess(here, entry.limits.as_ref().map(|(limits, _)| limits));
            let summary = summary.map_err(judge_error)?;
            tables::write_verdict(here, &summary.details.verdict).map_err(judge_error)?;
            json(&here.join("summary.json"), &summary)?;
            let interval_s = f64::from(settings.operation.measurement_interval_ms) * 1e-3;
            Record::of(digest, &summary, interval_s)
        }
        Err(Failure::Refused(refused)) => Record::not_modelled(digest, &refused.effect),
        Err(Failure::Other(error)) => return Err(error.at(&entry.name)),
    };
    if !keep {
        for name in ["truth", "rx"] {
            let path = here.join(name);
            fs::remove_dir_all(&path).map_err(|error| CliError::output(path.display(), &error))?;
        }
    }
    json(&here.join(RECORD), &record)?;
    making.finish(directory).map_err(|error| CliError::create(directory.display(), &error))?;
    Ok(record)
}

fn json(path: &Path, value: &impl Serialize) -> Result<(), CliError> {
    let mut text = serde_json::to_string_pretty(value).map_err(CliError::bug)?;
    text.push('\n');
    write(path, text.as_bytes())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    write_whole(path, bytes).map_err(judge_error)
}

impl Record {
    fn of(digest: &str, summary: &Summary, interval_s: f64) -> Self {
        let verdict = &summary.details.verdict;
        let position = &summary.position;
        let epochs = |first_s: f64| ((summary.duration_s - first_s) / interval_s + 1e-6).floor().max(1.0);
        let share = position.first_fix_s.map_or(0.0, |first_s| position.fixes as f64 / epochs(first_s));
        Self {
            digest: digest.to_owned(),
            verdict: match verdict.status() {
                Status::Pass => Verdict::Pass,
                Status::Marginal => Verdict::Marginal,
                Status::Fail => Verdict::Fail,
            },
            reason: String::new(),
            passed: verdict.count(Status::Pass),
            marginal: verdict.count(Status::Marginal),
            horizontal_p95_m: position.horizontal_p95_m.map(|metres| format!("{metres:.2}")),
            fixes_percent: Some(format!("{:.1}", 100.0 * share)),
            first_fix_s: position.first_fix_s.map(|first_s| format!("{first_s:.1}")),
            worst: worst(&verdict.rows).map(Figure::of),
            failed: verdict.rows.iter().filter(|row| row.status == Status::Fail).map(Figure::of).collect(),
        }
    }

    fn not_modelled(digest: &str, effect: &str) -> Self {
        Self {
            digest: digest.to_owned(),
            verdict: Verdict::NotModelled,
            reason: format!("no model of {effect} at this level"),
            passed: 0,
            marginal: 0,
            horizontal_p95_m: None,
            fixes_percent: None,
            first_fix_s: None,
            worst: None,
            failed: Vec::new(),
        }
    }
}

/// The worst judgement: by status, then by its margin, of which a figure without one has most.
fn worst(rows: &[Judgement]) -> Option<&Judgement> {
    let margin = |row: &Judgement| row.margin.unwrap_or(f64::INFINITY);
    let order = |a: &&Judgement, b: &&Judgement| b.status.cmp(&a.status).then(margin(a).total_cmp(&margin(b)));
    rows.iter().min_by(order)
}

impl Figure {
    fn of(row: &Judgement) -> Self {
        Self {
            figure: row.figure.clone(),
            path: row.path.clone().unwrap_or_default(),
            value: row.value_text(),
            unit: row.unit.clone(),
            limit: row.bound.to_string(),
        }
    }

    /// The figure in words: `horizontal error 3.2 m, limit ≤ 1.5`.
    pub fn in_words(&self) -> String {
        let value = format!("{} {} {}", self.figure, self.value, self.unit);
        format!("{}, limit {}", value.trim_end(), self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use analysis::judge::judgement::{Bound, MARGINAL_SHARE};

    #[test]
    fn the_worst_figure_is_a_failed_one_before_any_with_less_margin() {
        let row = |figure: &str, value: f64, limit: f64| {
            Judgement::new(figure, value.into(), "m", Bound::Max(limit), MARGINAL_SHARE, "test")
        };
        let rows = [row("good", 0.1, 1.0), row("near", 0.99, 1.0), row("beyond", 2.0, 1.0), row("far", 9.0, 1.0)];
        assert_eq!(worst(&rows).map(|row| row.figure.as_str()), Some("far"));
        assert_eq!(worst(&rows[..2]).map(|row| row.figure.as_str()), Some("near"));
        assert_eq!(Figure::of(&rows[3]).in_words(), "far 9 m, limit ≤ 1");
        assert!(worst(&[]).is_none());
    }
}
