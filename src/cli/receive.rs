//! `receive`: a cold start on anyone's recording.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::analysis::show::staged::present;
use crate::cli::args;
use crate::cli::error::{CliError, shown};
use crate::cli::progress::Progress;
use crate::cli::run::{output_error, receiver_error};
use crate::cli::scenario;
use crate::cli::staging::Staging;
use crate::gnss::gps::l1ca::L1_CA;
use crate::gnss::samples::IfMetadata;
use crate::gnss::sigmf;
use crate::gnss::time::{Epoch, Rate};
use crate::receiver;
use crate::receiver::output::Output;
use crate::receiver::settings::Settings;

/// Receives a recording.
pub fn execute(arguments: &args::Receive) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    let settings = match &arguments.receiver {
        None => Settings::default(),
        Some(path) => {
            let (name, text) = scenario::text(path)?;
            Settings::parse(&text, &name).map_err(CliError::input)?
        }
    };
    let recordings = open(arguments)?;
    let samples = recordings.first().and_then(|first| first.samples);
    let format = recordings.first().map(|first| first.metadata.format);
    let mut front_ends: Vec<(IfMetadata, Box<dyn Read>)> =
        recordings.into_iter().map(|recording| (recording.metadata, recording.reader)).collect();
    let staging = Staging::directory(&arguments.out)?;
    let mut output = Output::create(staging.path()).map_err(output_error)?;
    let progress = Progress::new("receive", samples);
    let outcome = receiver::receive_several(&mut front_ends, &settings, &mut output, &mut |done| progress.set(done));
    drop(progress);
    let outcome = outcome.map_err(receiver_error)?;
    drop(output);
    if let Some(format) = format.filter(|_| outcome.samples == 0) {
        return Err(CliError::input(format!(
            "{}: no whole sample: expected {} bytes or more of {format}",
            shown(&arguments.file),
            format.bytes()
        )));
    }
    staging.commit()?;
    if let Some(warning) = &outcome.format_warning {
        scenario::warn(&format!("{}: {warning}: check --format or the metadata", shown(&arguments.file)));
    }
    for warning in &outcome.warnings {
        scenario::warn(warning);
    }
    let mut text = format!("{outcome}\n{}\n", outcome.conditioning);
    if let Some(diagnosis) = &outcome.diagnosis {
        text += &format!("{diagnosis}\n");
    }
    text += &format!("results in {}\n", shown(&arguments.out));
    scenario::print(&text)?;
    outcome.diagnosis.map_or(Ok(()), |diagnosis| Err(CliError::incomplete(diagnosis.headline())))
}

struct Recording {
    metadata: IfMetadata,
    reader: Box<dyn Read>,
    samples: Option<u64>,
}

/// Opens the recording, or all that a collection names.
fn open(arguments: &args::Receive) -> Result<Vec<Recording>, CliError> {
    if arguments.file.extension().is_some_and(|extension| extension == "sigmf-collection") {
        return of_collection(arguments);
    }
    Ok(vec![open_one(arguments)?])
}

/// Opens a recording and finds out what it is: SigMF metadata if there are any, then flags over them.
fn open_one(arguments: &args::Receive) -> Result<Recording, CliError> {
    let stdin = arguments.file.as_os_str() == "-";
    let (data_path, meta_path) = pair(&arguments.file);
    let there = !stdin && present(&meta_path).map_err(|error| CliError::read(shown(&meta_path), &error))?;
    let described = if there {
        let (name, text) = scenario::text(&meta_path)?;
        Some(sigmf::parse(&text, &name).map_err(CliError::input)?)
    } else {
        None
    };
    let metadata = metadata(arguments, described)?;
    if stdin {
        return Ok(Recording { metadata, reader: Box::new(io::stdin().lock()), samples: None });
    }
    let name = shown(&data_path);
    let file = File::open(&data_path).map_err(|error| CliError::read(&name, &error))?;
    let about = file.metadata().map_err(|error| CliError::read(&name, &error))?;
    if about.is_dir() {
        return Err(CliError::input(format!("{name} is a directory: expected a recording")));
    }
    let samples = about.is_file().then(|| about.len() / metadata.format.bytes() as u64);
    Ok(Recording { metadata, reader: Box::new(file), samples })
}

/// The recordings of a collection: front ends that share a clock.
fn of_collection(arguments: &args::Receive) -> Result<Vec<Recording>, CliError> {
    let path = &arguments.file;
    let (name, text) = scenario::text(path)?;
    let members = sigmf::parse_collection(&text, &name).map_err(CliError::input)?;
    let files: Vec<PathBuf> =
        members.iter().map(|member| path.with_file_name(format!("{member}.sigmf-meta"))).collect();
    let flags = [
        ("--format", arguments.format.is_some()),
        ("--rate-hz", arguments.rate_hz.is_some()),
        ("--if-hz", arguments.if_hz.is_some()),
        ("--inverted", arguments.inverted),
    ];
    if let Some((flag, _)) = flags.into_iter().find(|(_, given)| *given) {
        let names: Vec<String> = files.iter().map(|file| shown(file)).collect();
        return Err(CliError::usage(format!(
            "{flag}: {name} is a collection of {} recordings, each with metadata of its own: receive one of them by \
             its path: {}",
            members.len(),
            names.join(", ")
        )));
    }
    files.into_iter().map(|file| open_one(&args::Receive { file, ..arguments.clone() })).collect()
}

/// The data and metadata files of a recording that is named by either.
fn pair(file: &Path) -> (PathBuf, PathBuf) {
    match file.extension().and_then(|extension| extension.to_str()) {
        Some("sigmf-meta") => (file.with_extension("sigmf-data"), file.to_owned()),
        _ => (file.to_owned(), file.with_extension("sigmf-meta")),
    }
}

fn metadata(arguments: &args::Receive, described: Option<IfMetadata>) -> Result<IfMetadata, CliError> {
    let rate = match arguments.rate_hz {
        None => None,
        Some(hz) => Some(
            Rate::from_hz(hz)
                .ok_or_else(|| CliError::usage(format!("--rate-hz {hz}: expected samples a second, above 0")))?,
        ),
    };
    let start = match &arguments.start {
        None => None,
        Some(text) => Some(Epoch::parse(text).map_err(|error| CliError::usage(format!("--start: {error}")))?),
    };
    let missing = |flag: &str| {
        CliError::usage(format!("{}: no .sigmf-meta beside it, so {flag} is needed", arguments.file.display()))
    };
    let mut metadata = match described {
        Some(metadata) => metadata,
        None => IfMetadata {
            format: arguments.format.ok_or_else(|| missing("--format"))?,
            rate: rate.ok_or_else(|| missing("--rate-hz"))?,
            center_hz: L1_CA.centre_hz(),
            inverted: false,
            start: None,
        },
    };
    metadata.format = arguments.format.unwrap_or(metadata.format);
    metadata.rate = rate.unwrap_or(metadata.rate);
    metadata.start = start.or(metadata.start);
    metadata.inverted |= arguments.inverted;
    if let Some(if_hz) = arguments.if_hz {
        metadata.center_hz = L1_CA.centre_hz() - if metadata.inverted { -if_hz } else { if_hz };
    }
    Ok(metadata)
}
