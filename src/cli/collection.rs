//! Output of `generate` for a scene with several front ends: a directory with a SigMF recording of each, a
//! collection over them, and the truth of all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde_json::json;

use crate::cli::args;
use crate::cli::error::{CliError, shown};
use crate::cli::generate::truth_files;
use crate::cli::progress::Progress;
use crate::cli::run::generator_error;
use crate::cli::scenario;
use crate::cli::staging::Staging;
use generator::scene::Scene;
use generator::stream::Generated;
use generator::{GenerateError, truth};
use gnss::sigmf::{self, Beside, Member};
use study::sweep::sha512_hex;

/// Writes the samples of every front end below the directory that `--out` names.
pub fn generate(arguments: &args::Generate, scenes: &[Scene]) -> Result<(), CliError> {
    let names: Vec<&str> = scenes.iter().filter_map(|scene| scene.front_end_name.as_deref()).collect();
    check(arguments, &names)?;
    let staging = Staging::directory(&arguments.out)?;
    let truth = staging.path().join("truth");
    fs::create_dir(&truth).map_err(|error| CliError::create(truth.display(), &error))?;
    let mut writer = truth_files(arguments, &truth)?;
    let mut files = names.iter().map(|name| Samples::create(staging.path(), name)).collect::<Result<Vec<_>, _>>()?;
    let done = samples(scenes, &mut writer, &mut files, arguments.printed.in_words())?;
    drop(writer);
    files.into_iter().try_for_each(Samples::finish)?;
    let base = scenes.first().map_or_else(String::new, |scene| scenario::file_name(&scene.name));
    describe(staging.path(), &base, scenes, &names)?;
    staging.commit()?;

    let mut text = String::new();
    for (name, done) in names.iter().zip(&done) {
        text += &format!("{name}: {done}\n");
    }
    let out = shown(&arguments.out);
    text += &format!(
        "in {out}: samples and metadata as NAME.sigmf-data and NAME.sigmf-meta, {base}.sigmf-collection over them, \
         truth/ of all of them\n"
    );
    arguments.printed.results(&text, || {
        json!({
            "samples": arguments.out,
            "collection": arguments.out.join(format!("{base}.sigmf-collection")),
            "truth": arguments.out.join("truth"),
            "front_ends": names,
            "made": done,
        })
    })
}

/// Refuses arguments that several front ends cannot have.
fn check(arguments: &args::Generate, names: &[&str]) -> Result<(), CliError> {
    let (count, known) = (names.len(), names.join(", "));
    if arguments.seek != 0 || arguments.samples.is_some() {
        return Err(CliError::usage(format!(
            "--seek and --samples count the samples of one front end, and the scene has {count} ({known}): choose \
             one with --front-end NAME"
        )));
    }
    let extension = arguments.out.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    if extension.starts_with("sigmf") {
        return Err(CliError::usage(format!(
            "--out {}: the scene has {count} front ends ({known}), each with files of its own: name a directory for \
             them, or choose one with --front-end NAME",
            shown(&arguments.out)
        )));
    }
    Ok(())
}

/// Error that ends the work early.
enum Failure {
    Generate(GenerateError),
    Write(CliError),
}

impl From<GenerateError> for Failure {
    fn from(error: GenerateError) -> Self {
        Self::Generate(error)
    }
}

/// Makes the samples of all front ends, slice by slice: one is written while the next is made.
fn samples(
    scenes: &[Scene],
    truth: &mut (dyn truth::Sink + Send),
    files: &mut [Samples],
    with_progress: bool,
) -> Result<Vec<Generated>, CliError> {
    let first = scenes.first().map(|scene| (scene, scene.samples));
    let label = format!("generate {}", first.map_or("", |(scene, _)| &scene.name));
    let progress = Progress::new(&label, first.map(|(_, count)| count), with_progress);
    let sample_bytes = first.map_or(1, |(scene, _)| scene.metadata.format.bytes());
    let mut done = 0;
    let fed = twin::feed(scenes, truth, &mut |number, bytes| {
        let Some(file) = files.get_mut(number) else { return Ok(()) };
        let written = file.file.write_all(bytes);
        written.map_err(|error| Failure::Write(CliError::output(file.path.display(), &error)))?;
        if number == 0 {
            done += (bytes.len() / sample_bytes) as u64;
            progress.set(done);
        }
        Ok(())
    });
    match fed {
        Ok(fed) => Ok(fed.generated),
        Err(Failure::Generate(error)) => Err(generator_error(error)),
        Err(Failure::Write(error)) => Err(error),
    }
}

/// Writes the metadata of every recording, and the collection over them.
fn describe(directory: &Path, base: &str, scenes: &[Scene], names: &[&str]) -> Result<(), CliError> {
    let mut members = Vec::with_capacity(scenes.len());
    for (scene, name) in scenes.iter().zip(names) {
        let beside = Beside { signals: &scene.signals, collection: Some(base), ..Beside::default() };
        let text = sigmf::write_with(&scene.metadata, &beside);
        members.push(Member { name: (*name).to_owned(), hash: sha512_hex(text.as_bytes()) });
        put(&directory.join(format!("{name}.sigmf-meta")), &text)?;
    }
    let description = format!("GNSS IF samples of {} front ends that share a clock", scenes.len());
    put(&directory.join(format!("{base}.sigmf-collection")), &sigmf::write_collection(&description, &members))
}

fn put(path: &Path, text: &str) -> Result<(), CliError> {
    fs::write(path, text).map_err(|error| CliError::output(path.display(), &error))
}

/// The file of one front end's samples.
struct Samples {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Samples {
    fn create(directory: &Path, name: &str) -> Result<Self, CliError> {
        let path = directory.join(format!("{name}.sigmf-data"));
        let file = File::create(&path).map_err(|error| CliError::create(path.display(), &error))?;
        Ok(Self { path, file: BufWriter::new(file) })
    }

    fn finish(mut self) -> Result<(), CliError> {
        let written: io::Result<()> = self.file.flush().and_then(|()| self.file.get_ref().sync_all());
        written.map_err(|error| CliError::output(self.path.display(), &error))
    }
}
