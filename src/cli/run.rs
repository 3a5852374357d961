//! `run`: generator and receiver side by side with samples passed in memory, then the judge.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::analysis::psd::Psd;
use crate::analysis::{self, JudgeError};
use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::interrupt;
use crate::cli::pipe::{Inlet, Outlet, pipe};
use crate::cli::progress::Progress;
use crate::cli::scenario;
use crate::cli::speed::Speed;
use crate::cli::staging::Staging;
use crate::generator::scene::Scene;
use crate::generator::{self, GenerateError, Generated, truth};
use crate::gnss::samples::IfMetadata;
use crate::gnss::sigmf;
use crate::receiver::output::{Output, OutputError};
use crate::receiver::settings::Settings;
use crate::receiver::source::SourceError;
use crate::receiver::{self, Outcome, ReceiveError};

/// Blocks in flight between generator and receiver.
const PIPE_BLOCKS: usize = 8;
/// Length of the signal's start from which the spectrum is estimated.
const SPECTRUM_S: f64 = 0.2;
/// Points of that spectrum.
const SPECTRUM_BINS: usize = 2048;

/// Runs a scene end to end.
pub fn execute(arguments: &args::Run) -> Result<(), CliError> {
    scenario::use_threads(arguments.threads)?;
    let named = scenario::read(arguments.scenario.as_deref())?;
    let (scene, warnings) = scenario::compose(&named, arguments.seed, None)?;
    let settings = scenario::receiver_settings(&named)?;
    for warning in warnings {
        scenario::warn(&warning);
    }
    let target =
        arguments.out.clone().unwrap_or_else(|| PathBuf::from("reports").join(scenario::file_name(&scene.name)));
    let staging = Staging::directory(&target)?;
    let run = staging.path();

    let mut truth = truth::Writer::create(&run.join("truth")).map_err(truth_error)?;
    let mut output = Output::create(&run.join("rx")).map_err(output_error)?;
    let mut tap = Tap::new(&scene, run, arguments.keep_if)?;
    let both = both(&scene, &settings, &mut truth, &mut output, &mut tap)?;
    tap.finish(run)?;
    drop((truth, output));

    let duration_s = scene.metadata.rate.elapsed_s(scene.samples);
    let speed = Speed::new(duration_s, both.generator_busy, both.receiver_busy, both.whole);
    write_json(&run.join("speed.json"), &speed)?;
    let summary = analysis::judge(run).map_err(judge_error)?;
    staging.commit()?;

    let mut text = format!("{summary}\n");
    if let Some(diagnosis) = &both.outcome.diagnosis {
        text += &format!("{diagnosis}\n");
    }
    text += &format!("results in {}\n", target.display());
    scenario::print(&text)
}

struct Both {
    outcome: Outcome,
    generator_busy: Duration,
    receiver_busy: Duration,
    whole: Duration,
}

/// Generates on one thread and receives on another; the first failure that is not a consequence of the other's wins.
fn both(
    scene: &Scene,
    settings: &Settings,
    truth: &mut truth::Writer,
    output: &mut Output,
    tap: &mut Tap,
) -> Result<Both, CliError> {
    let start = Instant::now();
    let (inlet, mut outlet) = pipe(PIPE_BLOCKS);
    let progress = Progress::new(&format!("run {}", scene.name), Some(scene.samples));
    let ((generated, generator_busy), received) = std::thread::scope(|scope| {
        let generator = std::thread::Builder::new()
            .name("generator".into())
            .spawn_scoped(scope, move || generate(scene, inlet, truth, tap))
            .map_err(|error| CliError::passing(format!("cannot start a thread: {error}")))?;
        let received = receive(&scene.metadata, &mut outlet, settings, output, &progress);
        let busy = start.elapsed().saturating_sub(outlet.waited);
        // Without a reader the generator's next write fails, and it ends.
        drop(outlet);
        let generated = generator.join().map_err(|_| CliError::bug("the generator panicked"))?;
        Ok::<_, CliError>((generated, (received, busy)))
    })?;
    drop(progress);
    if let Some(signal) = interrupt::pending() {
        return Err(signal);
    }
    let (received, receiver_busy) = received;
    match (generated, received) {
        // The generator's write fails because the receiver has stopped: the receiver knows why.
        (Err(GenerateError::Write(error)), Err(cause)) if error.kind() == io::ErrorKind::BrokenPipe => Err(cause),
        (Err(error), _) => Err(generator_error(error)),
        (Ok(_), Err(cause)) => Err(cause),
        (Ok(_), Ok(outcome)) => Ok(Both { outcome, generator_busy, receiver_busy, whole: start.elapsed() }),
    }
}

fn generate(
    scene: &Scene,
    inlet: Inlet,
    truth: &mut truth::Writer,
    tap: &mut Tap,
) -> (Result<Generated, GenerateError>, Duration) {
    let start = Instant::now();
    let mut splitter = Splitter { inlet, tap };
    let generated = generator::generate(scene, &mut splitter, truth, &mut |_| {});
    (generated, start.elapsed().saturating_sub(splitter.inlet.waited))
}

fn receive(
    metadata: &IfMetadata,
    samples: &mut Outlet,
    settings: &Settings,
    output: &mut Output,
    progress: &Progress,
) -> Result<Outcome, CliError> {
    receiver::receive(metadata, samples, settings, output, &mut |done| progress.set(done)).map_err(receiver_error)
}

/// Copies what the generator writes: to the receiver, and to the tap.
struct Splitter<'a> {
    inlet: Inlet,
    tap: &'a mut Tap,
}

impl Write for Splitter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if interrupt::pending().is_some() {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        self.tap.see(bytes)?;
        self.inlet.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Looks at the samples on their way: estimates the spectrum of the first part, and keeps all of them if asked to.
struct Tap {
    metadata: IfMetadata,
    psd: Psd,
    left_bytes: usize,
    i: Vec<f32>,
    q: Vec<f32>,
    kept: Option<BufWriter<File>>,
}

impl Tap {
    fn new(scene: &Scene, run: &Path, keep: bool) -> Result<Self, CliError> {
        let kept = if keep {
            let path = run.join("if.sigmf-data");
            let file = File::create(&path).map_err(|error| CliError::create(path.display(), &error))?;
            Some(BufWriter::new(file))
        } else {
            None
        };
        let metadata = scene.metadata.clone();
        let samples = (SPECTRUM_S * metadata.rate.hz()) as usize;
        let left_bytes = samples * metadata.format.bytes();
        let psd = Psd::new(metadata.rate.hz(), !metadata.format.is_complex(), SPECTRUM_BINS);
        Ok(Self { psd, metadata, left_bytes, i: Vec::new(), q: Vec::new(), kept })
    }

    fn see(&mut self, bytes: &[u8]) -> io::Result<()> {
        let count = bytes.len().min(self.left_bytes);
        if count > 0 {
            self.left_bytes -= count;
            self.metadata.format.unpack(&bytes[..count], &mut self.i, &mut self.q);
            self.psd.add(&self.i, &self.q);
        }
        match &mut self.kept {
            Some(file) => file.write_all(bytes),
            None => Ok(()),
        }
    }

    fn finish(&mut self, run: &Path) -> Result<(), CliError> {
        let path = run.join("psd.csv");
        self.psd.write(&path).map_err(judge_error)?;
        if let Some(mut file) = self.kept.take() {
            let path = run.join("if.sigmf-data");
            file.flush().map_err(|error| CliError::output(path.display(), &error))?;
            let path = run.join("if.sigmf-meta");
            fs::write(&path, sigmf::write(&self.metadata)).map_err(|error| CliError::output(path.display(), &error))?;
        }
        Ok(())
    }
}

fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), CliError> {
    let mut text = serde_json::to_string_pretty(value).map_err(CliError::bug)?;
    text.push('\n');
    fs::write(path, text).map_err(|error| CliError::output(path.display(), &error))
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
        truth::TruthError::Row { path, source } => CliError::output(path.display(), &source.into()),
    }
}

/// The exit that a receiver's failure means.
pub fn receiver_error(error: ReceiveError) -> CliError {
    match error {
        ReceiveError::Output(error) => output_error(error),
        ReceiveError::Source(SourceError::Read { error, .. }) => CliError::read("samples", &error),
        other => CliError::input(other),
    }
}

/// The exit that a failure to write what the receiver found means.
pub fn output_error(error: OutputError) -> CliError {
    match error {
        OutputError::Create { path, error } => CliError::create(path.display(), &error),
        OutputError::Write { path, error } => CliError::output(path.display(), &error),
    }
}

/// The exit that a judge's failure means.
pub fn judge_error(error: JudgeError) -> CliError {
    match &error {
        JudgeError::File { path, source } => CliError::output(path.display(), source),
        JudgeError::Plot { .. } => CliError::bug(error),
        _ => CliError::input(error),
    }
}
