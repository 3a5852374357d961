//! The judge: joins truth and estimate, measures every error, judges it, and shows the result.
//!
//! It reads only what generator and receiver wrote into a run's directory, and writes `summary.json`, tables,
//! pictures and a report beside them. [`judge`](judge()) does all of it, [`assess`] stops at the summary.
//! Six rooms follow one another, and each uses only those before it:
//!
//! 1. [`read`]: a run's files as values.
//! 2. [`expect`]: what theory and truth let one expect.
//! 3. [`measure`](mod@measure): estimate minus truth, and what follows from it.
//! 4. [`judge`](mod@judge): figures against limits.
//! 5. [`show`]: tables, pictures, reports.
//! 6. [`logged`]: another receiver by its binary log.
//!
//! Below all of them lie [`error`], [`statistics`] and [`waveform`], the spectrum and the correlation of a
//! signal.
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

#[macro_use(planted)]
extern crate gnss;

pub mod error;
pub mod expect;
pub mod judge;
pub mod logged;
pub mod measure;
pub mod read;
pub mod response;
pub mod show;
pub mod statistics;
pub mod waveform;

use std::path::Path;

pub use error::JudgeError;
use judge::limits::Limits;
pub use judge::summary::Summary;
use judge::verdict::Verdict;
use measure::clock::Clock;
use measure::consistency::Consistency;
use measure::detection::Detection;
use measure::elevation::Elevations;
use measure::errors::Errors;
use measure::jitter::Jitter;
use measure::protection::Protection;
use measure::slips::Slips;
use read::Run;
use show::document::Forms;
use show::plot::{Detail, Judged, Sketched};
use show::run_report::RunReport;
use show::{plot, tables};

/// Judges the run in a directory: writes `summary.json`, tables, pictures, `report.pdf` and `report.html`
/// there and returns the summary.
///
/// Reads `truth/{observations,sky,trajectory,navigation}.csv`, `truth/scene.json`,
/// `rx/{observations,fixes,acquisition,tracking,navigation,events}.csv`, and where they exist
/// `rx/receiver.json`, `psd.csv`, `peaks.csv`, `speed.json`, `scenario.toml`, `truth/interference.csv` and
/// `truth/claimed.csv`.
///
/// # Errors
/// [`JudgeError`] with the file that is missing, is not as expected or cannot be written.
pub fn judge(run: &Path) -> Result<Summary, JudgeError> {
    judge_against(run, None)
}

/// Judges a run by theory and by a user's limits. The summary's details hold the result.
///
/// # Errors
///
/// Same as [`judge()`].
pub fn judge_against(run: &Path, limits: Option<&Limits>) -> Result<Summary, JudgeError> {
    judge_into(run, limits, Forms::BOTH)
}

/// [`judge_against`] with the report in the forms that are asked for.
///
/// # Errors
///
/// Same as [`judge()`].
pub fn judge_into(run: &Path, limits: Option<&Limits>, forms: Forms) -> Result<Summary, JudgeError> {
    // On one of the threads that draw: what it needed before serves again.
    rayon::scope(|_| judged(run, limits, forms))
}

/// The verdict alone: what [`judge_against`] finds of the tables as they lie there, with nothing written or
/// drawn.
///
/// # Errors
/// Errors of [`judge()`], but for files that cannot be written.
pub fn assess(run: &Path, limits: Option<&Limits>) -> Result<Summary, JudgeError> {
    Ok(measure(Run::read(run)?, run, limits)?.summary)
}

fn judged(run: &Path, limits: Option<&Limits>, forms: Forms) -> Result<Summary, JudgeError> {
    let Found { summary, sketches, report } = find(run, limits, forms)?;
    // What was read is gone by now: drawing takes memory of its own.
    let figures = plot::draw(run, sketches)?;
    report.write(run, forms, figures)?;
    let path = run.join("summary.json");
    let mut json =
        serde_json::to_vec_pretty(&summary).map_err(|source| JudgeError::Json { path: path.clone(), source })?;
    json.push(b'\n');
    show::write::write_whole(&path, &json)?;
    Ok(summary)
}

/// Results of a run whose tables are written and whose pictures are not drawn yet.
struct Found {
    summary: Summary,
    sketches: Vec<Sketched>,
    report: RunReport,
}

/// Measurements of a run.
struct Measured {
    read: Run,
    errors: Errors,
    clock: Clock,
    consistency: Consistency,
    protection: Protection,
    detection: Detection,
    slips: Slips,
    jitter: Jitter,
    summary: Summary,
}

fn measure(read: Run, run: &Path, limits: Option<&Limits>) -> Result<Measured, JudgeError> {
    let errors = Errors::measure(&read)?;
    let mut clock = Clock::measure(&read, &errors)?;
    let consistency = Consistency::measure(&read, &errors)?;
    let mut summary = Summary::new(&read, &errors, &clock)?;
    clock.forget_phases();
    let slips = Slips::find(&read, &errors)?;
    let jitter = Jitter::measure(&read, &errors, &summary.details.stated)?;
    summary.add(&consistency, &slips, &jitter);
    let protection = Protection::measure(&read, &errors)?;
    summary.protection.clone_from(&protection.figures);
    let detection = Detection::measure(&read)?;
    summary.detection.clone_from(&detection.figures);
    let not_json = |source| JudgeError::Json { path: run.join("summary.json"), source };
    let verdict = Verdict::of(&read, &errors, &slips, &summary)?;
    summary.details.verdict = match limits {
        Some(limits) => verdict.with_user(limits.judge(&serde_json::to_value(&summary).map_err(not_json)?)),
        None => verdict,
    };
    summary.not_judged.clone_from(&summary.details.verdict.not_judged);
    read.sound()?;
    errors.sound()?;
    Ok(Measured { read, errors, clock, consistency, protection, detection, slips, jitter, summary })
}

fn find(run: &Path, limits: Option<&Limits>, forms: Forms) -> Result<Found, JudgeError> {
    let measured = measure(Run::read(run)?, run, limits)?;
    let Measured { read, errors, clock, consistency, protection, detection, slips, jitter, summary } = measured;
    let elevations = Elevations::measure(&read, &errors, &summary.details.stated)?;
    let detail = Detail::Paper;
    let (consistency, protection) = (&consistency, &protection);
    let judged = Judged {
        run: &read,
        errors: &errors,
        clock: &clock,
        consistency,
        protection,
        detection: &detection,
        summary: &summary,
        detail,
    };
    tables::write_measured(run, &judged, &elevations, &slips, &jitter)?;
    tables::write(run, &judged)?;
    let sketches = plot::sketches(&judged, forms.html)?;
    let report = RunReport::new(&judged)?;
    read.sound()?;
    errors.sound()?;
    Ok(Found { summary, sketches, report })
}

#[cfg(test)]
mod hand_made;
