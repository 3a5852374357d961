//! `run`: generator and receiver side by side with samples passed in memory, then the judge.
//!
//! All front ends of a scene are received in one reception ([`made`]); here are the verdict and the times.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::json;

use crate::cli::args;
use crate::cli::check::Gate;
use crate::cli::error::CliError;
use crate::cli::made::{self, Wanted};
use crate::cli::printed;
use crate::cli::progress::Progress;
use crate::cli::scenario;
use crate::cli::speed::Speed;
use crate::cli::staging::Staging;
use analysis::judge::schema::SUMMARY;
use analysis::{self, JudgeError};
use generator::fidelity::Grade;
use generator::scenario::Overrides;
use generator::{GenerateError, truth};
use receiver::ReceiveError;
use receiver::lead::undated;
use receiver::output::OutputError;

/// Runs a scene end to end.
pub fn execute(arguments: &args::Run) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    let mut named = scenario::read(arguments.scenario.as_deref(), arguments.allow_outside)?
        .choose(arguments.front_end.as_deref())?;
    if let Some(grade) = arguments.level {
        named.scenario.front_ends.iter_mut().for_each(|front_end| front_end.fidelity = front_end.fidelity.at(grade));
    }
    let gate = Gate::read(arguments.check.as_ref(), &SUMMARY)?;
    let (scenes, warnings) = scenario::compose_all(
        &named,
        &Overrides { seed: arguments.seed, format: None, allow_outside: arguments.allow_outside },
    )?;
    let Some(scene) = scenes.first() else { return Err(CliError::bug("a scenario without a front end")) };
    let settings = twin::settings_for(&scenes, &scenario::receiver_settings(&named)?);
    // A scene is made for its position: without one there is nothing to judge.
    if let Some((signal, reason)) = undated(&settings.acquisition.signals()) {
        return Err(receiver_error(ReceiveError::Unsupported { signal: signal.name, reason }));
    }
    for warning in warnings {
        scenario::warn(&warning);
    }
    let own = arguments.front_end.as_ref().map_or_else(String::new, |name| format!("-{name}"));
    let usual = || PathBuf::from("reports").join(scenario::file_name(&scene.name) + &own);
    let target = arguments.out.clone().unwrap_or_else(usual);
    let staging = Staging::directory(&target)?;
    let run = staging.path();

    let is_sampled = scene.fidelity.grade != Grade::Correlations;
    let label = format!("run {}", scene.name);
    let progress = Progress::new(&label, Some(scene.samples), arguments.printed.in_words());
    let told = |samples| progress.set(samples);
    let wanted = Wanted { exchanged: Some(arguments.rinex), keep_if: arguments.keep_if, told: &told };
    let both = made::make(run, &scenes, &settings, &wanted)?;
    drop(progress);

    let duration_s = scene.metadata.rate.elapsed_s(scene.samples);
    let speed = Speed::new(duration_s, both.generator_busy, both.receiver_busy, both.whole);
    write_json(&run.join("speed.json"), &speed)?;
    let path = run.join("scenario.toml");
    fs::write(&path, &named.text).map_err(|error| CliError::output(path.display(), &error))?;
    let summary = analysis::judge_into(run, gate.limits(), arguments.report.forms()).map_err(judge_error)?;
    staging.commit()?;

    for warning in &both.outcome.warnings {
        scenario::warn(warning);
    }
    let mut text = format!("{summary}\n");
    if let Some(diagnosis) = &both.outcome.diagnosis {
        text += &format!("{diagnosis}\n");
    }
    text += &printed::last_fix_line(both.outcome.last_fix.as_ref());
    text += &format!("margins       {}\n", both.outcome.conditioning);
    for generated in &both.generated {
        text += &if is_sampled {
            format!("made          {generated}\n")
        } else {
            format!("modelled      {}\n", generated.modelled(duration_s))
        };
    }
    text += &format!("results in {}\n", target.display());
    let verdict = &summary.details.verdict;
    arguments.printed.results(&text, || {
        json!({
            "results": target,
            "made": both.generated,
            "last_fix": printed::last_fix(both.outcome.last_fix.as_ref()),
            "diagnosis": both.outcome.diagnosis.as_ref().map(ToString::to_string),
            "margins": both.outcome.conditioning,
            "summary": summary,
            "verdict": printed::verdict(verdict),
        })
    })?;
    gate.enforce(verdict, arguments.printed)
}

fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), CliError> {
    let mut text = serde_json::to_string_pretty(value).map_err(CliError::bug)?;
    text.push('\n');
    fs::write(path, text).map_err(|error| CliError::output(path.display(), &error))
}

impl From<GenerateError> for CliError {
    fn from(error: GenerateError) -> Self {
        generator_error(error)
    }
}

/// The exit that a generator's failure means.
pub fn generator_error(error: GenerateError) -> CliError {
    match error {
        GenerateError::Write(error) => CliError::output("samples", &error),
        GenerateError::Truth(error) => truth_error(error),
        other => CliError::input(other),
    }
}

/// The exit that a failure to write the truth means.
pub fn truth_error(error: truth::TruthError) -> CliError {
    match error {
        truth::TruthError::File { path, source } => CliError::output(path.display(), &source),
        truth::TruthError::Row { path, source } => {
            // What the conversion to an I/O error would lose: which one it was.
            let source = match source.into_kind() {
                csv::ErrorKind::Io(source) => source,
                other => return CliError::bug(format!("{}: {other:?}", path.display())),
            };
            CliError::output(path.display(), &source)
        }
        truth::TruthError::Refused(error) => CliError::output("truth", &io::Error::other(error)),
    }
}

/// The exit that a receiver's failure means.
pub fn receiver_error(error: ReceiveError) -> CliError {
    match error {
        ReceiveError::Output(error) => output_error(error),
        ReceiveError::Read { error, .. } => CliError::read("samples", &error),
        other => CliError::input(other),
    }
}

/// The exit that a failure to write what the receiver found means.
pub fn output_error(error: OutputError) -> CliError {
    match error {
        OutputError::Create { path, error } => CliError::create(path.display(), &error),
        OutputError::Write { path, error } => CliError::output(path.display(), &error),
        OutputError::Refused(error) => CliError::output("results", &io::Error::other(error)),
    }
}

/// The exit that a judge's failure means.
pub fn judge_error(error: JudgeError) -> CliError {
    match &error {
        JudgeError::File { path, source } => CliError::output(path.display(), source),
        JudgeError::Read { path, source } => CliError::read(path.display(), source),
        JudgeError::Plot { .. } => CliError::bug(error),
        _ => CliError::input(error),
    }
}
