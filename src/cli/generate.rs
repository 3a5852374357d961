//! `generate`: samples, metadata and truth of a scene, without a receiver. Those of several front ends are
//! written by `collection`.

use std::fs;
use std::io;
use std::path::Path;

use crate::cli::args;
use crate::cli::collection;
use crate::cli::error::CliError;
use crate::cli::progress::Progress;
use crate::cli::run::{generator_error, truth_error};
use crate::cli::scenario;
use crate::cli::staging::Staging;
use crate::generator::scenario::Overrides;
use crate::generator::stream::Options;
use crate::generator::{self, truth};
use crate::gnss::samples::IfMetadata;
use crate::gnss::sigmf;

/// Writes a scene's samples to a file.
pub fn execute(arguments: &args::Generate) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    let named = scenario::read(Some(&arguments.scenario))?.choose(arguments.front_end.as_deref())?;
    let (mut scenes, warnings) = scenario::compose_all(
        &named,
        &Overrides { seed: arguments.seed, format: arguments.format, allow_outside: arguments.allow_outside },
    )?;
    for warning in warnings {
        scenario::warn(&warning);
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
    let meta_path = arguments.out.with_extension("sigmf-meta");
    let truth_path = arguments.out.with_extension("truth");
    if meta_path == arguments.out || truth_path == arguments.out {
        return Err(CliError::usage(format!(
            "--out {}: the samples need another name than their metadata (.sigmf-meta) and truth (.truth): use .sigmf-data",
            arguments.out.display()
        )));
    }
    let samples = Staging::file(&arguments.out)?;
    let meta = Staging::file(&meta_path)?;
    let truth = Staging::directory(&truth_path)?;

    let mut writer = truth::Writer::create(truth.path()).map_err(truth_error)?;
    let progress = Progress::new(&format!("generate {}", scene.name), Some(end - first));
    let options = Options::default();
    let generated = generator::generate_part(
        &scene,
        first..end,
        &mut samples.writer(),
        &mut writer,
        &mut |done| progress.set(done),
        &options,
    );
    drop(progress);
    let generated = generated.map_err(generator_error)?;
    drop(writer);
    // What the receiver's clock reads at the first sample of the file.
    let metadata = IfMetadata { start: Some(scene.clock.epoch(first)), ..scene.metadata.clone() };
    meta.write(sigmf::write(&metadata).as_bytes())?;
    // Metadata last, and never those of other samples: a run that is killed here leaves none.
    discard(&meta_path)?;
    truth.commit()?;
    samples.commit()?;
    meta.commit()?;

    scenario::print(&format!(
        "{generated}\nsamples in {}, metadata in {}, truth in {}\n",
        arguments.out.display(),
        meta_path.display(),
        truth_path.display()
    ))
}

fn discard(path: &Path) -> Result<(), CliError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(CliError::create(path.display(), &error)),
        _ => Ok(()),
    }
}
