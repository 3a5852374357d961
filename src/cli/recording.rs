//! Recordings and streams as `receive` finds them: what their samples are, and where they come from.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use crate::cli::archive;
use crate::cli::args;
use crate::cli::error::{CliError, shown};
use crate::cli::scenario;
use crate::cli::source;
use analysis::show::staged::present;
use gnss::gps::l1ca::L1_CA;
use gnss::packed::{Layout, Unpacker};
use gnss::recording::{Description, Samples, Unblocked};
use gnss::samples::{Format, IfMetadata};
use gnss::signal::Signal;
use gnss::time::{Epoch, Rate};
use gnss::{ion, sigmf};

/// The samples of a front end.
pub struct Recording {
    pub metadata: IfMetadata,
    /// The signals that its metadata name.
    pub signals: Vec<&'static Signal>,
    pub reader: Box<dyn Read + Send>,
    /// Number of samples, where it is known.
    pub samples: Option<u64>,
    /// Cell that takes the reason if the sender breaks off.
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
        if let Some(flag) = arguments.packed.given() {
            return Err(CliError::usage(format!("{flag}: rtl-tcp sends cu8 of one channel and nothing else")));
        }
        if let Some(format) = arguments.format.filter(|format| *format != Format::Cu8) {
            return Err(CliError::usage(format!("--format {format}: rtl-tcp sends cu8 and nothing else")));
        }
        arguments.format = Some(Format::Cu8);
    }
    let (metadata, layout) = metadata(&arguments, Description::default())?;
    let stream = spec.open(&metadata)?;
    let broken = Some(stream.broken());
    Ok(Recording { metadata, signals: Vec::new(), broken, reader: unpacked(layout, stream), samples: None })
}

/// The reader of samples, unpacked where they are packed.
fn unpacked(layout: Option<Layout>, reader: impl Read + Send + 'static) -> Box<dyn Read + Send> {
    match layout {
        None => Box::new(reader),
        Some(layout) => Box::new(Unpacker::new(layout, reader)),
    }
}

/// File of a recording with the position and form of its samples.
struct Found {
    name: String,
    file: File,
    /// Bytes of the file that are the recording's: where they begin, and how many there are.
    first: u64,
    bytes: Option<u64>,
    description: Description,
}

/// Opens a recording and finds out what it is: metadata if there are any, then flags over them.
fn open_one(arguments: &args::Receive) -> Result<Recording, CliError> {
    let extension = arguments.file.extension().and_then(|extension| extension.to_str());
    if arguments.file.as_os_str() == "-" {
        let (metadata, layout) = metadata(arguments, Description::default())?;
        let reader = unpacked(layout, io::stdin());
        return Ok(Recording { metadata, signals: Vec::new(), reader, samples: None, broken: None });
    }
    let found = match extension {
        Some("sigmf") => of_archive(&arguments.file)?,
        Some(extension) if ION.contains(&extension) => of_ion(&arguments.file, arguments)?,
        _ => match ion_beside(&arguments.file)? {
            Some(path) => of_ion(&path, arguments)?,
            None => of_pair(arguments)?,
        },
    };
    let Found { name, mut file, first, bytes, description } = found;
    let (header, trailing, blocks) = (description.header_bytes, description.trailing_bytes, description.blocks);
    let skipped = description.skipped_samples;
    let channels = u64::from(description.channels);
    let signals = description.signals.clone();
    let (metadata, layout) = metadata(arguments, description)?;
    // Samples before the first one that is described: of all channels.
    let sample_bytes = metadata.format.bytes() as u64;
    let skipped = match &layout {
        None => skipped * sample_bytes * channels,
        Some(_) if skipped == 0 => 0,
        Some(_) => return Err(CliError::input(format!("{name}: packed samples of which {skipped} are to be skipped"))),
    };
    let before = header + skipped;
    let left = bytes.map(|bytes| bytes.saturating_sub(before + trailing));
    let within = left.map(|left| blocks.map_or(left, |blocks| blocks.samples_among(left)));
    if first + before > 0 {
        file.seek(SeekFrom::Start(first + before)).map_err(|error| CliError::read(&name, &error))?;
    }
    let samples = within.map(|left| match &layout {
        None => left / sample_bytes,
        Some(layout) => left / layout.group_bytes() as u64 * layout.group_samples() as u64,
    });
    let limited = first + trailing > 0;
    let reader = match (left.filter(|_| limited), blocks) {
        (Some(left), _) => unpacked(layout, file.take(left)),
        (None, Some(blocks)) => unpacked(layout, Unblocked::new(blocks, file)),
        (None, None) => unpacked(layout, file),
    };
    Ok(Recording { metadata, signals, reader, samples, broken: None })
}

/// A file of samples, and how many bytes it has where it is a regular one.
fn data(path: &Path, description: Description) -> Result<Found, CliError> {
    let name = shown(path);
    let file = File::open(path).map_err(|error| CliError::read(&name, &error))?;
    let about = file.metadata().map_err(|error| CliError::read(&name, &error))?;
    if about.is_dir() {
        return Err(CliError::input(format!("{name} is a directory: expected a recording")));
    }
    Ok(Found { name, bytes: about.is_file().then_some(about.len()), file, first: 0, description })
}

/// A recording with or without SigMF metadata beside it.
fn of_pair(arguments: &args::Receive) -> Result<Found, CliError> {
    let (data_path, meta_path) = pair(&arguments.file);
    if !present(&meta_path).map_err(|error| CliError::read(shown(&meta_path), &error))? {
        // A file that is missing is said before flags that are, and these before a pipe is opened.
        std::fs::metadata(&data_path).map_err(|error| CliError::read(shown(&data_path), &error))?;
        metadata(arguments, Description::default())?;
        return data(&data_path, Description::default());
    }
    let (name, text) = scenario::text(&meta_path)?;
    let description = sigmf::describe(&text, &name).map_err(CliError::input)?;
    let path = match &description.dataset {
        None => data_path,
        Some(dataset) => beside(&meta_path, "core:dataset", dataset)?,
    };
    data(&path, description)
}

/// A file that metadata name: one beside them.
fn beside(path: &Path, key: &str, file: &str) -> Result<PathBuf, CliError> {
    let plain = !file.is_empty() && Path::new(file).file_name().is_some_and(|name| name == file);
    let refuse = || CliError::input(format!("{}: {key} is {file:?}: expected a file beside it", shown(path)));
    plain.then(|| path.with_file_name(file)).ok_or_else(refuse)
}

/// The recording of an archive that has one.
fn of_archive(path: &Path) -> Result<Found, CliError> {
    let mut found = data(path, Description::default())?;
    let name = found.name.clone();
    let broken = |error: io::Error| match error.kind() {
        io::ErrorKind::InvalidData => CliError::input(format!("{name}: {error}")),
        _ => CliError::read(&name, &error),
    };
    let members = archive::members(&mut found.file).map_err(broken)?;
    let metas: Vec<&archive::Member> = members.iter().filter(|one| one.name.ends_with(".sigmf-meta")).collect();
    let &[meta] = &*metas else {
        let names: Vec<&str> = metas.iter().map(|meta| meta.name.as_str()).collect();
        return Err(CliError::input(format!(
            "{name}: an archive of {} recordings ({}): expected one; unpack it and name one of them",
            names.len(),
            names.join(", ")
        )));
    };
    let text = text_of(&mut found.file, meta).map_err(broken)?;
    found.description = sigmf::describe(&text, &format!("{name}: {}", meta.name)).map_err(CliError::input)?;
    let usual = || format!("{}data", meta.name.trim_end_matches("meta"));
    let wanted = found.description.dataset.as_ref().map_or_else(usual, |dataset| match meta.name.rsplit_once('/') {
        Some((directory, _)) => format!("{directory}/{dataset}"),
        None => dataset.clone(),
    });
    let samples = members.iter().find(|member| member.name == wanted);
    let samples = samples.ok_or_else(|| CliError::input(format!("{name}: no {wanted} in the archive")))?;
    (found.first, found.bytes) = (samples.first, Some(samples.size));
    Ok(found)
}

/// The text of a member: at most as much as of any metadata.
fn text_of(file: &mut File, member: &archive::Member) -> io::Result<String> {
    if member.size > scenario::LARGEST_BYTES {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "metadata of more than 4 MiB"));
    }
    file.seek(SeekFrom::Start(member.first))?;
    let mut text = String::new();
    BufReader::new(file).take(member.size).read_to_string(&mut text)?;
    Ok(text)
}

/// Endings of ION's metadata: the standard's, and those of front ends that add an x to that of their samples.
const ION: [&str; 5] = ["sdrx", "xml", "usbx", "tgx", "smfx"];

/// ION's metadata of a file of samples that has no others: of the same name beside it.
fn ion_beside(file: &Path) -> Result<Option<PathBuf>, CliError> {
    let is_there = |path: &Path| present(path).map_err(|error| CliError::read(shown(path), &error));
    if is_there(&pair(file).1)? {
        return Ok(None);
    }
    for extension in ION {
        let path = file.with_extension(extension);
        if is_there(&path)? {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

/// A stream of a recording that ION's metadata describe.
fn of_ion(path: &Path, arguments: &args::Receive) -> Result<Found, CliError> {
    let (name, text) = scenario::text(path)?;
    let streams = ion::parse(&text, &name).map_err(CliError::input)?;
    let names = || streams.iter().map(|(stream, _)| stream.as_str()).collect::<Vec<_>>().join(", ");
    let wanted = arguments.packed.channel.as_ref();
    let chosen = match (wanted, &*streams) {
        (None, [only]) => Some(only),
        (None, several) => {
            let text = format!("{name}: {} streams: choose one by --channel: {}", several.len(), names());
            return Err(CliError::usage(text));
        }
        (Some(wanted), several) => several.iter().find(|(stream, _)| stream == wanted),
    };
    let unknown = |wanted: &String| CliError::usage(format!("--channel {wanted}: expected one of {}", names()));
    let Some((_, description)) = chosen else {
        return Err(wanted.map_or_else(|| CliError::bug("a stream without a name"), unknown));
    };
    let dataset = description.dataset.as_deref();
    let dataset = dataset.ok_or_else(|| CliError::input(format!("{name}: no <url> in <file>")))?;
    data(&beside(path, "<url>", dataset)?, description.clone())
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
        ("--center-hz", arguments.center_hz.is_some()),
        ("--inverted", arguments.inverted),
        (arguments.packed.given().unwrap_or_default(), arguments.packed.given().is_some()),
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

/// Format of the samples and their packing: the description, with flags over it.
fn metadata(arguments: &args::Receive, of: Description) -> Result<(IfMetadata, Option<Layout>), CliError> {
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
        CliError::usage(format!("{}: there are no metadata beside it, so {flag} is needed", arguments.file.display()))
    };
    let described = arguments.format.map(Samples::Whole).or(of.samples);
    // A stream of ION's metadata is chosen already.
    let samples = match described {
        Some(Samples::Laid(layout)) if arguments.packed.given() == Some("--channel") => Some(Samples::Laid(layout)),
        described => arguments.packed.over(described, of.channels)?,
    };
    let samples = samples.ok_or_else(|| missing("--format"))?;
    let (format, layout) = samples.unpacked().map_err(|error| CliError::input(error.to_string()))?;
    let inverted = of.inverted | arguments.inverted;
    let tuned = |if_hz: f64| L1_CA.centre_hz() - if inverted { -if_hz } else { if_hz };
    let center_hz = match (arguments.center_hz.or(arguments.if_hz.map(tuned)), of.center_hz) {
        (Some(center_hz), _) | (None, Some(center_hz)) => center_hz,
        // Real samples hold nothing about 0 Hz.
        (None, None) if !format.is_complex() => return Err(missing("--if-hz or --center-hz")),
        (None, None) => L1_CA.centre_hz(),
    };
    let rate = rate.or(of.rate).ok_or_else(|| missing("--rate-hz"))?;
    Ok((IfMetadata { format, rate, center_hz, inverted, start: start.or(of.start) }, layout))
}
