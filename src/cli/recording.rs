//! Recordings and streams as `receive` finds them: what their samples are, and where they come from.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use crate::analysis::show::staged::present;
use crate::cli::args;
use crate::cli::error::{CliError, shown};
use crate::cli::scenario;
use crate::cli::source;
use crate::gnss::gps::l1ca::L1_CA;
use crate::gnss::samples::{Format, IfMetadata};
use crate::gnss::sigmf;
use crate::gnss::time::{Epoch, Rate};

/// The samples of a front end.
pub struct Recording {
    pub metadata: IfMetadata,
    pub reader: Box<dyn Read + Send>,
    /// How many there are, where that is known.
    pub samples: Option<u64>,
    /// Where it is written if the sender breaks off.
    pub broken: Option<Arc<OnceLock<String>>>,
}

/// Opens the recording, or all that a collection names.
pub fn open(arguments: &args::Receive) -> Result<Vec<Recording>, CliError> {
    if let Some(spec) = source::Spec::of_file(&arguments.file)? {
        return Ok(vec![of_stream(&spec, arguments)?]);
    }
    if arguments.file.extension().is_some_and(|extension| extension == "sigmf-collection") {
        return of_collection(arguments);
    }
    Ok(vec![open_one(arguments)?])
}

/// Opens a stream, whose samples the flags describe.
fn of_stream(spec: &source::Spec, arguments: &args::Receive) -> Result<Recording, CliError> {
    let mut arguments = arguments.clone();
    if matches!(spec, source::Spec::RtlTcp(_)) {
        if let Some(format) = arguments.format.filter(|format| *format != Format::Cu8) {
            return Err(CliError::usage(format!("--format {format}: rtl-tcp sends cu8 and nothing else")));
        }
        arguments.format = Some(Format::Cu8);
    }
    let metadata = metadata(&arguments, None)?;
    let stream = spec.open(&metadata)?;
    Ok(Recording { metadata, broken: Some(stream.broken()), reader: Box::new(stream), samples: None })
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
        return Ok(Recording { metadata, reader: Box::new(io::stdin()), samples: None, broken: None });
    }
    let name = shown(&data_path);
    let file = File::open(&data_path).map_err(|error| CliError::read(&name, &error))?;
    let about = file.metadata().map_err(|error| CliError::read(&name, &error))?;
    if about.is_dir() {
        return Err(CliError::input(format!("{name} is a directory: expected a recording")));
    }
    let samples = about.is_file().then(|| about.len() / metadata.format.bytes() as u64);
    Ok(Recording { metadata, reader: Box::new(file), samples, broken: None })
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
