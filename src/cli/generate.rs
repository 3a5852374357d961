//! `generate`: samples, metadata and truth of a scene, without a receiver. Those of several front ends are
//! written by `collection`.

use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde_json::json;

use crate::cli::args;
use crate::cli::collection;
use crate::cli::error::{CliError, shown};
use crate::cli::progress::Progress;
use crate::cli::run::{generator_error, truth_error};
use crate::cli::scenario;
use crate::cli::sidecar;
use crate::cli::sink;
use crate::cli::staging::Staging;
use generator::scenario::Overrides;
use generator::scene::Scene;
use generator::stream::Options;
use generator::{self, GenerateError, truth};
use gnss::packed::Packer;
use gnss::samples::{Format, IfMetadata};
use gnss::sigmf::{self, Beside};

/// Writes a scene's samples to a file.
pub fn execute(arguments: &args::Generate) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    let stream = sink::Spec::of_out(&arguments.out)?;
    if stream.is_none() && arguments.truth.is_some() {
        return Err(CliError::usage("--truth names the truth of a stream: that of a file lies beside it"));
    }
    let forms = [("--rinex", arguments.rinex.is_some()), ("--nmea", arguments.nmea), ("--maps", arguments.maps)];
    let wanted = forms.iter().find(|(_, wanted)| *wanted && stream.is_some() && arguments.truth.is_none());
    if let Some((flag, _)) = wanted {
        return Err(CliError::usage(format!("{flag} lies in the truth: a stream has one with --truth DIR")));
    }
    if arguments.printed.json && matches!(stream, Some(sink::Spec::Stdout)) {
        return Err(CliError::usage("--json and --out -: standard output takes one of them"));
    }
    let named = scenario::read(Some(&arguments.scenario), arguments.allow_outside)?
        .at_station(arguments.station.as_deref())?
        .choose(arguments.front_end.as_deref())?;
    let (mut scenes, warnings) = scenario::compose_all(
        &named,
        &Overrides {
            seed: arguments.seed,
            format: format(arguments, stream.as_ref()),
            allow_outside: arguments.allow_outside,
        },
    )?;
    for warning in warnings {
        scenario::warn(&warning);
    }
    if scenes.len() > 1 && stream.is_some() {
        let names: Vec<&str> = scenes.iter().filter_map(|scene| scene.front_end_name.as_deref()).collect();
        return Err(CliError::usage(format!(
            "--out {}: a stream carries one front end, and the scene has several: choose with --front-end NAME one \
             of {}",
            shown(&arguments.out),
            names.join(", ")
        )));
    }
    let one_file = [
        ("--gnss-sdr", arguments.gnss_sdr),
        ("--pocketsdr", arguments.pocketsdr),
        ("--bits", arguments.packed.given()),
    ];
    if let Some((flag, _)) = one_file.iter().find(|(_, wanted)| *wanted && (scenes.len() > 1 || stream.is_some())) {
        return Err(CliError::usage(format!(
            "{flag}: expected one file of samples: choose a front end, and name a file"
        )));
    }
    if scenes.len() > 1 {
        return collection::generate(arguments, &scenes);
    }
    let Some(scene) = scenes.pop() else { return Err(CliError::bug("a scenario without a front end")) };
    let first = arguments.seek;
    let end = arguments.samples.map_or(scene.samples, |count| first.saturating_add(count));
    if first >= scene.samples || end > scene.samples || end == first {
        return Err(CliError::usage(format!(
            "--seek {first}{}: the scene has samples 0 to {}",
            arguments.samples.map_or_else(String::new, |count| format!(" --samples {count}")),
            scene.samples.saturating_sub(1)
        )));
    }
    if let Some(stream) = stream {
        return to_stream(&stream, arguments, &scene, first..end);
    }
    let meta_path = arguments.out.with_extension("sigmf-meta");
    let truth_path = arguments.out.with_extension("truth");
    if meta_path == arguments.out || truth_path == arguments.out {
        return Err(CliError::usage(format!(
            "--out {}: the samples need another name than their metadata (.sigmf-meta) and truth (.truth): use \
             .sigmf-data",
            arguments.out.display()
        )));
    }
    let packed = arguments.packed.of_scene(&scene, end - first)?;
    let sidecars = sidecars(arguments, &scene, first)?;
    let samples = Staging::file(&arguments.out)?;
    let meta = Staging::file(&meta_path)?;
    let truth = Staging::directory(&truth_path)?;

    let mut writer = truth_files(arguments, truth.path())?;
    let progress = Progress::new(&format!("generate {}", scene.name), Some(end - first), arguments.printed.in_words());
    let options = Options::default();
    let mut generate = |out: &mut dyn io::Write| {
        generator::generate_part(&scene, first..end, out, &mut writer, &mut |done| progress.set(done), &options)
    };
    let generated = match &packed {
        None => generate(&mut samples.writer()),
        Some((_, layout)) => {
            let mut packer = Packer::new(layout.clone(), samples.writer());
            generate(&mut packer).and_then(|made| packer.finish().map(|()| made).map_err(GenerateError::Write))
        }
    };
    drop(progress);
    let generated = generated.map_err(generator_error)?;
    drop(writer);
    // What the receiver's clock reads at the first sample of the file.
    let metadata = IfMetadata { start: Some(scene.clock.epoch(first)), ..scene.metadata.clone() };
    let packed = packed.as_ref().map(|(of, _)| of);
    let text = sigmf::write_with(&metadata, &Beside { signals: &scene.signals, packed, ..Beside::default() });
    meta.write(text.as_bytes())?;
    // Metadata last, and never those of other samples: a run that is killed here leaves none.
    discard(&meta_path)?;
    truth.commit()?;
    samples.commit()?;
    meta.commit()?;
    let mut beside = String::new();
    for Sidecar { path, text, opened_by } in sidecars {
        let file = Staging::file(&path)?;
        file.write(text.as_bytes())?;
        file.commit()?;
        beside += &format!("\nopened by: {opened_by}");
    }
    let (out, meta, truth) = (arguments.out.display(), meta_path.display(), truth_path.display());
    let text = format!("{generated}\nsamples in {out}, metadata in {meta}, truth in {truth}{beside}\n");
    arguments.printed.results(
        &text,
        || json!({ "samples": arguments.out, "metadata": meta_path, "truth": truth_path, "made": [generated] }),
    )
}

/// Sinks that write the truth into an existing directory: its tables, and the requested forms of other
/// programs.
pub fn truth_files(arguments: &args::Generate, directory: &Path) -> Result<truth::Several, CliError> {
    let mut sinks: Vec<Box<dyn truth::Sink + Send>> =
        vec![Box::new(truth::Writer::create(directory).map_err(truth_error)?)];
    if let Some(version) = arguments.rinex {
        sinks.push(Box::new(truth::Rinex::new(directory, version)));
    }
    if arguments.nmea {
        sinks.push(Box::new(truth::Nmea::create(directory).map_err(truth_error)?));
    }
    if arguments.maps {
        sinks.push(Box::new(truth::Tracks::new(directory)));
    }
    Ok(truth::Several(sinks))
}

/// A file beside the samples, and what it opens them with.
struct Sidecar {
    path: PathBuf,
    text: String,
    opened_by: String,
}

/// The sidecars that are asked for, of samples from `first` on.
fn sidecars(arguments: &args::Generate, scene: &Scene, first: u64) -> Result<Vec<Sidecar>, CliError> {
    let mut all = Vec::new();
    let packed = if arguments.packed.given() { Some("--bits") } else { None };
    let refuse = |flag| Err(CliError::usage(format!("{flag} and --bits: expected samples of whole bytes")));
    if arguments.gnss_sdr {
        let text = sidecar::gnss_sdr(scene, &arguments.out)?;
        let path = arguments.out.with_extension("gnss-sdr.conf");
        let opened_by = format!("gnss-sdr --config_file={}", path.display());
        packed.map_or(Ok(()), |_| refuse("--gnss-sdr"))?;
        all.push(Sidecar { path, text, opened_by });
    }
    if arguments.pocketsdr {
        let text = sidecar::pocketsdr(scene, scene.clock.epoch(first))?;
        let mut name = arguments.out.clone().into_os_string();
        name.push(".tag");
        let opened_by = format!("pocket_trk {}", arguments.out.display());
        packed.map_or(Ok(()), |_| refuse("--pocketsdr"))?;
        all.push(Sidecar { path: PathBuf::from(name), text, opened_by });
    }
    Ok(all)
}

/// The format that was asked for; a dongle's samples are rounded to its own zero from the start.
fn format(arguments: &args::Generate, stream: Option<&sink::Spec>) -> Option<Format> {
    let own = matches!(stream, Some(sink::Spec::RtlTcp(_))).then_some(Format::Cu8);
    arguments.format.or(own)
}

/// Hands the samples of a part of the scene to a reader, and says on standard error what they are.
fn to_stream(stream: &sink::Spec, arguments: &args::Generate, scene: &Scene, part: Range<u64>) -> Result<(), CliError> {
    let staging = arguments.truth.as_deref().map(Staging::directory).transpose()?;
    let mut writer = match &staging {
        Some(staging) => truth_files(arguments, staging.path())?,
        None => truth::Several::default(),
    };
    let metadata = &scene.metadata;
    let mut sink = stream.open(metadata, false)?;
    if arguments.printed.in_words() {
        scenario::note(&format!(
            "samples: {}, {} a second, {} Hz in the middle, {} of them to {stream}",
            metadata.format,
            metadata.rate.hz(),
            metadata.center_hz,
            part.end - part.start
        ));
    }
    let progress =
        Progress::new(&format!("generate {}", scene.name), Some(part.end - part.start), arguments.printed.in_words());
    let generated = generator::generate_part(
        scene,
        part,
        &mut sink::Through(sink.as_mut()),
        &mut writer,
        &mut |done| progress.set(done),
        &Options::default(),
    );
    drop(progress);
    let generated = generated.map_err(generator_error)?;
    sink.finish().map_err(|error| CliError::output("samples", &error))?;
    drop(writer);
    staging.map_or(Ok(()), Staging::commit)?;
    // Standard output may have the samples.
    let to = stream.to_string();
    match arguments.printed {
        printed if printed.in_words() => scenario::note(&generated.to_string()),
        printed => printed.results("", || json!({ "samples": to, "truth": arguments.truth, "made": [generated] }))?,
    }
    Ok(())
}

fn discard(path: &Path) -> Result<(), CliError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(CliError::create(path.display(), &error)),
        _ => Ok(()),
    }
}
