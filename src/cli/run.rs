//! `run`: generator and receiver side by side with samples passed in memory, then the judge.
//!
//! All front ends of a scene are received in one reception ([`made`]); here are the verdict and the times.
//! Several stations run one after the other ([`stations`]).

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::cli::args;
use crate::cli::check::Gate;
use crate::cli::error::CliError;
use crate::cli::made::{self, Both, Wanted};
use crate::cli::printed;
use crate::cli::progress::Progress;
use crate::cli::scenario::{self, Named};
use crate::cli::speed::Speed;
use crate::cli::staging::Staging;
use crate::cli::stations;
use analysis::judge::schema::SUMMARY;
use analysis::judge::summary::Summary;
use analysis::judge::verdict::Verdict;
use analysis::{self, JudgeError};
use generator::scenario::Overrides;
use generator::scene::Scene;
use generator::{GenerateError, truth};
use receiver::ReceiveError;
use receiver::lead::undated;
use receiver::output::OutputError;
use receiver::settings::Settings;

/// Runs a scene end to end, or that of each station.
pub fn execute(arguments: &args::Run) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    let named = scenario::read(arguments.scenario.as_deref(), arguments.allow_outside)?
        .at_station(arguments.station.as_deref())?;
    let name = named.scenario.name.clone();
    let mut stations = named.each_station()?;
    let gate = Gate::read(arguments.check.as_ref(), &SUMMARY)?;
    let own = arguments.front_end.as_ref().map_or_else(String::new, |name| format!("-{name}"));
    let usual = |scene: &str| PathBuf::from("reports").join(scenario::file_name(scene) + &own);
    let target = |scene: &str| arguments.out.clone().unwrap_or_else(|| usual(scene));
    if stations.len() > 1 {
        return stations::run(stations, arguments, &gate, &target(&name));
    }
    let Some((_, named)) = stations.pop() else { return Err(CliError::bug("a scenario without a station")) };
    let case = Case::new(named, arguments)?;
    let target = target(case.name());
    let staging = Staging::directory(&target)?;
    let done = case.make(staging.path(), arguments, &gate)?;
    staging.commit()?;

    done.warn();
    let text = done.text() + &format!("results in {}\n", target.display());
    arguments.printed.results(&text, || done.object(&target))?;
    gate.enforce(done.verdict(), arguments.printed)
}

/// A scenario of one station or none, ready to run.
pub struct Case {
    named: Named,
    /// Scenes of the front ends, one at least.
    pub scenes: Vec<Scene>,
    settings: Settings,
}

impl Case {
    /// Composes the scenes, and warns of what they lack.
    pub fn new(named: Named, arguments: &args::Run) -> Result<Self, CliError> {
        let mut named = named.choose(arguments.front_end.as_deref())?;
        if let Some(grade) = arguments.level {
            let each = named.scenario.front_ends.iter_mut();
            each.for_each(|front_end| front_end.fidelity = front_end.fidelity.at(grade));
        }
        let (mut scenes, warnings) = scenario::compose_all(
            &named,
            &Overrides { seed: arguments.seed, format: None, allow_outside: arguments.allow_outside },
        )?;
        if scenes.is_empty() {
            return Err(CliError::bug("a scenario without a front end"));
        }
        // Whoever keeps the samples wants them made.
        if !arguments.keep_if && twin::settle(&mut scenes).map_err(made::failure)? {
            scenario::note("level correlations keeps the budget: no samples are made");
        }
        let settings = twin::settings_for(&scenes, &scenario::receiver_settings(&named)?);
        // A scene is made for its position: without one there is nothing to judge.
        if let Some((signal, reason)) = undated(&settings.acquisition.signals()) {
            return Err(receiver_error(ReceiveError::Unsupported { signal: signal.name, reason }));
        }
        for warning in warnings {
            scenario::warn(&warning);
        }
        Ok(Self { named, scenes, settings })
    }

    /// Name of the scene.
    pub fn name(&self) -> &str {
        self.scenes.first().map_or("", |scene| &scene.name)
    }

    /// Generates, receives and judges into an empty directory.
    pub fn make(&self, run: &Path, arguments: &args::Run, gate: &Gate) -> Result<Done, CliError> {
        let Some(scene) = self.scenes.first() else { return Err(CliError::bug("a scenario without a front end")) };
        let is_sampled = scene.fidelity.grade.is_sampled();
        let label = format!("run {}", scene.name);
        let progress = Progress::new(&label, Some(scene.samples), arguments.printed.in_words());
        let told = |samples| progress.set(samples);
        let wanted = Wanted { exchanged: Some(arguments.rinex), keep_if: arguments.keep_if, told: &told };
        let both = made::make(run, &self.scenes, &self.settings, &wanted)?;
        drop(progress);

        let duration_s = scene.metadata.rate.elapsed_s(scene.samples);
        let speed = Speed::new(duration_s, both.generator_busy, both.receiver_busy, both.whole);
        write_json(&run.join("speed.json"), &speed)?;
        let path = run.join("scenario.toml");
        fs::write(&path, &self.named.text).map_err(|error| CliError::output(path.display(), &error))?;
        let summary = analysis::judge_into(run, gate.limits(), arguments.report.forms()).map_err(judge_error)?;
        Ok(Done { both, summary, modelled_s: (!is_sampled).then_some(duration_s) })
    }
}

/// Results of a run beside its files.
pub struct Done {
    both: Both,
    summary: Summary,
    /// Length of a scene without samples, in seconds.
    modelled_s: Option<f64>,
}

impl Done {
    /// Warnings of the receiver.
    pub fn warn(&self) {
        self.both.outcome.warnings.iter().for_each(|warning| scenario::warn(warning));
    }

    /// Verdict of the judge.
    pub fn verdict(&self) -> &Verdict {
        &self.summary.details.verdict
    }

    /// Summary in words, with what was made.
    pub fn text(&self) -> String {
        let outcome = &self.both.outcome;
        let mut text = format!("{}\n", self.summary);
        if let Some(diagnosis) = &outcome.diagnosis {
            text += &format!("{diagnosis}\n");
        }
        text += &printed::last_fix_line(outcome.last_fix.as_ref());
        text += &format!("margins       {}\n", outcome.conditioning);
        for generated in &self.both.generated {
            text += &match self.modelled_s {
                None => format!("made          {generated}\n"),
                Some(duration_s) => format!("modelled      {}\n", generated.modelled(duration_s)),
            };
        }
        text
    }

    /// JSON object of the run with results in a directory.
    pub fn object(&self, results: &Path) -> Value {
        let outcome = &self.both.outcome;
        json!({
            "results": results,
            "made": self.both.generated,
            "last_fix": printed::last_fix(outcome.last_fix.as_ref()),
            "diagnosis": outcome.diagnosis.as_ref().map(ToString::to_string),
            "margins": outcome.conditioning,
            "summary": self.summary,
            "verdict": printed::verdict(self.verdict()),
        })
    }
}

/// Writes a value as JSON.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), CliError> {
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
