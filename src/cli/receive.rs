//! `receive`: a cold start on anyone's recording, or on samples while they are made.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use serde_json::{Value, json};

use crate::cli::args;
use crate::cli::error::{CliError, shown};
use crate::cli::interrupt;
use crate::cli::lines::{self, Made};
use crate::cli::printed::{Printed, last_fix, last_fix_line};
use crate::cli::progress::Progress;
use crate::cli::recording::{self, Recording};
use crate::cli::run::{output_error, receiver_error};
use crate::cli::scenario;
use crate::cli::source::Ahead;
use crate::cli::staging::{InSight, Staging};
use gnss::samples::IfMetadata;
use gnss::signal::Signal;
use receiver::Outcome;
use receiver::acquire::{ALL, AcquisitionSettings};
use receiver::output::{JsonLines, Nmea, Output, OutputError, Record, Rinex, Sink};
use receiver::settings::Settings;

/// Receives a recording or a stream.
pub fn execute(arguments: &args::Receive) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    scenario::describe_signals(&arguments.signal_files)?;
    let settings = match &arguments.receiver {
        None => Settings::default(),
        Some(path) => {
            let (name, text) = scenario::text(path)?;
            let settings = Settings::parse(&text, &name).map_err(|error| scenario::refused(&error))?;
            scenario::with_keys(settings, path.parent(), &name, "")?
        }
    };
    let taken = to_lines(arguments).filter(|spec| **spec == lines::Spec::Stdout).count();
    if taken + usize::from(printed(arguments).json) > 1 {
        return Err(CliError::usage("--nmea - and --json: standard output takes one of them"));
    }
    let recordings = recording::open(arguments)?;
    let settings = searched(&recordings, settings, arguments)?;
    let samples = recordings.first().and_then(|first| first.samples);
    let format = recordings.first().map(|first| first.metadata.format);
    let broken: Vec<Arc<OnceLock<String>>> = recordings.iter().filter_map(|one| one.broken.clone()).collect();
    let directory = Directory::new(arguments)?;
    let (mut listeners, made) = Listeners::new(arguments, &settings, directory.path())?;
    let mut front_ends = read_ahead(recordings, arguments.live)?;
    let progress = Progress::new("receive", samples, printed(arguments).in_words());
    let outcome = receiver::receive_several(&mut front_ends, &settings, &mut listeners, &mut |done| progress.set(done));
    drop(progress);
    let outcome = outcome.map_err(receiver_error)?;
    let summary = std::mem::take(&mut listeners.summary);
    drop(listeners);
    let broken = broken.iter().find_map(|broken| broken.get());
    if let Some(format) = format.filter(|_| outcome.samples == 0) {
        let why = broken.map_or_else(String::new, |broken| format!(" ({broken})"));
        return Err(CliError::input(format!(
            "{}: no whole sample: expected {} bytes or more of {format}{why}",
            shown(&arguments.file),
            format.bytes()
        )));
    }
    directory.commit()?;
    made.into_iter().try_for_each(Made::commit)?;
    report(arguments, &outcome, &summary)?;
    if let Some(signal) = interrupt::ending() {
        return Err(CliError::signal(signal));
    }
    if let Some(broken) = broken {
        return Err(CliError::broken(format!("{broken}: the results end there")));
    }
    outcome.diagnosis.map_or(Ok(()), |diagnosis| Err(CliError::incomplete(diagnosis.headline())))
}

/// The settings with the signals that are searched for: the flag's, or those that they name; or else those
/// that every recording's metadata name; or else what the bands hold, which is said.
fn searched(recordings: &[Recording], mut settings: Settings, arguments: &args::Receive) -> Result<Settings, CliError> {
    if !arguments.signals.is_empty() {
        let signals = arguments.signals.iter().map(|name| name.trim().to_owned()).collect();
        let asked = AcquisitionSettings { signals, ..AcquisitionSettings::default() };
        asked.validate().map_err(|error| CliError::usage(format!("--signals: {error}")))?;
        settings.acquisition.signals = asked.signals;
    }
    let are_named = recordings.iter().all(|recording| !recording.signals.is_empty());
    if settings.acquisition.signals.is_empty() && are_named {
        let named: Vec<&'static Signal> =
            recordings.iter().flat_map(|recording| recording.signals.iter().copied()).collect();
        settings.acquisition.or_signals(&named);
    }
    let is_open = settings.acquisition.signals.is_empty() || settings.acquisition.is_all();
    if !is_open || settings.validate("settings").is_err() {
        return Ok(settings);
    }
    let metadata: Vec<IfMetadata> = recordings.iter().map(|recording| recording.metadata.clone()).collect();
    let settings = receiver::searched(&metadata, &settings);
    if printed(arguments).in_words() {
        let names = |settings: &Settings| -> Vec<&str> {
            settings.acquisition.signals().into_iter().map(|signal| signal.name).collect()
        };
        let mut all = settings.clone();
        all.acquisition.signals = vec![ALL.to_owned()];
        let (chosen, held) = (names(&settings), names(&receiver::searched(&metadata, &all)));
        let others: Vec<&str> = held.into_iter().filter(|name| !chosen.contains(name)).collect();
        let more = match others.as_slice() {
            [] => String::new(),
            others => format!("; --signals all adds what else the bands hold: {}", others.join(", ")),
        };
        scenario::note(&format!("searching for {}{more}", chosen.join(", ")));
    }
    Ok(settings)
}

/// Prints the outcome on standard output unless lines go there.
fn report(arguments: &args::Receive, outcome: &Outcome, summary: &Value) -> Result<(), CliError> {
    if let Some(warning) = &outcome.format_warning {
        scenario::warn(&format!("{}: {warning}: check --format or the metadata", shown(&arguments.file)));
    }
    for warning in &outcome.warnings {
        scenario::warn(warning);
    }
    let mut text = format!("{outcome}\n{}{}\n", last_fix_line(outcome.last_fix.as_ref()), outcome.conditioning);
    if let Some(diagnosis) = &outcome.diagnosis {
        text += &format!("{diagnosis}\n");
    }
    text += &format!("results in {}\n", shown(&arguments.out));
    let printed = printed(arguments);
    if to_lines(arguments).any(|spec| *spec == lines::Spec::Stdout) && printed.in_words() {
        scenario::note(text.trim_end());
        return Ok(());
    }
    printed.results(&text, || {
        json!({
            "results": arguments.out,
            "last_fix": last_fix(outcome.last_fix.as_ref()),
            "receiver": summary,
        })
    })
}

/// Form of the printed results. `--json` without a target for lines selects the object.
fn printed(arguments: &args::Receive) -> Printed {
    Printed { quiet: arguments.quiet, json: matches!(arguments.json, Some(None)) }
}

/// Targets of the text lines.
fn to_lines(arguments: &args::Receive) -> impl Iterator<Item = &lines::Spec> {
    arguments.nmea.iter().chain(arguments.json.iter().flatten())
}

/// A front end's samples and what is said of them.
type FrontEnd = (IfMetadata, Box<dyn Read>);

/// The samples of every front end; of a live reception they are read ahead, and end with a signal.
fn read_ahead(recordings: Vec<Recording>, live: bool) -> Result<Vec<FrontEnd>, CliError> {
    if live {
        interrupt::ends_work();
    }
    let one = |recording: Recording| {
        let reader: Box<dyn Read> = if live {
            let passing = |error| CliError::passing(format!("cannot start a thread: {error}"));
            Box::new(Ahead::new(recording.reader).map_err(passing)?)
        } else {
            recording.reader
        };
        Ok((recording.metadata, reader))
    };
    recordings.into_iter().map(one).collect()
}

/// Directory in which the tables are made.
enum Directory {
    Hidden(Staging),
    InSight(InSight),
}

impl Directory {
    fn new(arguments: &args::Receive) -> Result<Self, CliError> {
        if !arguments.live {
            return Staging::directory(&arguments.out).map(Self::Hidden);
        }
        let directory = InSight::directory(&arguments.out)?;
        scenario::note(&format!("rows as they come in {}", shown(directory.path())));
        Ok(Self::InSight(directory))
    }

    fn path(&self) -> &Path {
        match self {
            Self::Hidden(staging) => staging.path(),
            Self::InSight(directory) => directory.path(),
        }
    }

    fn commit(self) -> Result<(), CliError> {
        match self {
            Self::Hidden(staging) => staging.commit(),
            Self::InSight(directory) => directory.commit(),
        }
    }
}

/// All that takes the receiver's records.
struct Listeners {
    output: Output,
    /// True if rows are written as they come.
    live: bool,
    /// The sample of the newest state of channels.
    tracked: u64,
    lines: Vec<Box<dyn Sink>>,
    /// Content of `receiver.json`, set at the end.
    summary: Value,
}

impl Listeners {
    /// The tables in `directory`, and the lines that were asked for with what becomes of them.
    fn new(arguments: &args::Receive, settings: &Settings, directory: &Path) -> Result<(Self, Vec<Made>), CliError> {
        let output = Output::create(directory).map_err(output_error)?;
        let (mut lines, mut made) = (Vec::<Box<dyn Sink>>::new(), Vec::new());
        if let Some(spec) = &arguments.nmea {
            let opened = spec.open("nmea", arguments.live)?;
            lines.push(Box::new(Nmea::new(PathBuf::from(spec.to_string()), opened.writer)));
            made.push(opened.made);
        }
        if let Some(version) = arguments.rinex {
            let signals = settings.acquisition.signals();
            lines.push(Box::new(Rinex::create(directory, version, "receive", &signals).map_err(output_error)?));
        }
        if let Some(Some(spec)) = &arguments.json {
            let opened = spec.open("json", arguments.live)?;
            lines.push(Box::new(JsonLines::new(PathBuf::from(spec.to_string()), opened.writer)));
            made.push(opened.made);
        }
        Ok((Self { output, live: arguments.live, tracked: 0, lines, summary: Value::Null }, made))
    }
}

impl Listeners {
    /// True if a record is the last of its instant, the first of a later one, or of a rare kind.
    fn ends_tick(&mut self, record: &Record) -> bool {
        match record {
            Record::Tracking(row) => std::mem::replace(&mut self.tracked, row.sample) != row.sample,
            Record::Observation(_) | Record::Fix(_) => false,
            _ => true,
        }
    }
}

impl Sink for Listeners {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        for line in &mut self.lines {
            line.take(record.clone())?;
        }
        let flush = self.live && self.ends_tick(&record);
        self.output.take(record)?;
        if flush { self.output.flush() } else { Ok(()) }
    }

    fn finish(&mut self, summary: &serde_json::Value) -> Result<(), OutputError> {
        self.lines.iter_mut().try_for_each(|line| line.finish(summary))?;
        self.summary = summary.clone();
        self.output.finish(summary)
    }
}
