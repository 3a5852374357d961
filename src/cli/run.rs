//! `run`: generator and receiver side by side with samples passed in memory, then the judge.
//!
//! All front ends of a scene are received in one reception. The loop itself is [`twin::feed`]; here are the
//! files, the spectrum of the samples, the peaks of its signals and the times.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::json;

use crate::cli::args;
use crate::cli::check::Gate;
use crate::cli::error::CliError;
use crate::cli::glimpse::Moment;
use crate::cli::printed;
use crate::cli::progress::Progress;
use crate::cli::scenario;
use crate::cli::speed::Speed;
use crate::cli::staging::Staging;
use analysis::expect::welch::{self, Looks};
use analysis::judge::schema::SUMMARY;
use analysis::measure::psd::Psd;
use analysis::read::{PeakRow, psd_name};
use analysis::show::tables;
use analysis::{self, JudgeError};
use generator::fidelity::Grade;
use generator::scenario::Overrides;
use generator::scene::Scene;
use generator::stream::Generated;
use generator::{GenerateError, truth};
use gnss::samples::IfMetadata;
use gnss::sigmf::{self, Beside};
use gnss::signal::Signal;
use receiver::lead::undated;
use receiver::output::{Nmea, Output, OutputError, Rinex, Sink, Tracks};
use receiver::settings::Settings;
use receiver::{Outcome, ReceiveError, Reception};

/// Bytes that are made numbers at a time: whole samples of any format.
const SEEN_BYTES: usize = 1 << 17;

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

    let below = |name| {
        let path = run.join(name);
        fs::create_dir(&path).map_err(|error| CliError::create(path.display(), &error)).map(|()| path)
    };
    let (truth_in, rx_in) = (below("truth")?, below("rx")?);
    let mut output = Output::create(&rx_in).map_err(output_error)?;
    // The same as other programs read it.
    let mut truth = truth::Several(vec![
        Box::new(truth::Writer::create(&truth_in).map_err(truth_error)?),
        Box::new(truth::Rinex::new(&truth_in, arguments.rinex)),
        Box::new(truth::Nmea::create(&truth_in).map_err(truth_error)?),
        Box::new(truth::Tracks::new(&truth_in)),
    ]);
    let mut files =
        Rinex::create(&rx_in, arguments.rinex, &scene.name, &settings.acquisition.signals()).map_err(output_error)?;
    let (keep, changing) = (arguments.keep_if, scenes.iter().any(|scene| !scene.interference.is_empty()));
    let is_sampled = scene.fidelity.grade != Grade::Correlations;
    if keep && !is_sampled {
        return Err(generator_error(GenerateError::NoSamples));
    }
    let mut moment = Moment::of(scene);
    let tap = |scene: &Scene| Tap::new(scene, run, (keep, changing), (scenes.len(), moment.samples(scene)));
    let mut taps: Vec<Tap> = scenes.iter().filter(|_| is_sampled).map(tap).collect::<Result<_, _>>()?;
    let mut sentences = sentences(&rx_in)?;
    let mut tracks = Tracks::create(&rx_in, &scene.name).map_err(output_error)?;
    let outputs = &mut (&mut output, &mut (&mut files, &mut (&mut sentences, &mut tracks)));
    let with_progress = arguments.printed.in_words();
    let both = if is_sampled {
        both(&scenes, &settings, &mut (&mut truth, &mut moment), outputs, (&mut taps, with_progress))?
    } else {
        by_correlations(&scenes, &settings, (&mut truth, outputs), with_progress)?
    };
    for (place, tap) in taps.iter().enumerate() {
        let later = Some(tap.name.as_str()).filter(|_| place > 0);
        tables::write_psd(&run.join(psd_name(later)), &tap.psd).map_err(judge_error)?;
    }
    let of = |(tap, own): (&Tap, &Scene)| moment.peaks(scene, own, &tap.glimpsed);
    let peaks: Vec<PeakRow> = taps.iter().zip(&scenes).flat_map(of).collect();
    tables::write_peaks(&run.join("peaks.csv"), &peaks).map_err(judge_error)?;
    taps.into_iter().try_for_each(|tap| tap.finish(run))?;
    drop((truth, output, files, sentences, tracks));

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

/// Sink that writes the fixes as NMEA 0183.
fn sentences(directory: &Path) -> Result<Nmea<File>, CliError> {
    let path = directory.join("fixes.nmea");
    let file = File::create(&path).map_err(|error| CliError::create(path.display(), &error))?;
    Ok(Nmea::new(path, file))
}

struct Both {
    generated: Vec<Generated>,
    outcome: Outcome,
    generator_busy: Duration,
    receiver_busy: Duration,
    whole: Duration,
}

/// Generates and receives side by side, and looks at the samples on their way; shows progress if wanted.
fn both(
    scenes: &[Scene],
    settings: &Settings,
    truth: &mut (dyn truth::Sink + Send),
    output: &mut (dyn Sink + Send),
    (taps, with_progress): (&mut [Tap], bool),
) -> Result<Both, CliError> {
    let name = scenes.first().map_or("", |scene| scene.name.as_str());
    let progress = Progress::new(&format!("run {name}"), scenes.first().map(|scene| scene.samples), with_progress);
    let start = Instant::now();
    let mut receiver_busy = Duration::ZERO;
    let metadata: Vec<IfMetadata> = scenes.iter().map(|scene| scene.metadata.clone()).collect();
    let mut reception = Reception::of_several(&metadata, settings).map_err(receiver_error)?;
    let fed = twin::feed(scenes, truth, &mut |number, samples| {
        if let Some(tap) = taps.get_mut(number) {
            tap.see(samples).map_err(|error| CliError::output("samples", &error))?;
        }
        timed(&mut receiver_busy, || reception.take_of(number, samples, output)).map_err(receiver_error)?;
        progress.set(reception.samples());
        Ok::<_, CliError>(())
    })?;
    let outcome = reception.finish(output).map_err(receiver_error)?;
    let twin::Fed { generated, busy: generator_busy } = fed;
    Ok(Both { generated, outcome, generator_busy, receiver_busy, whole: start.elapsed() })
}

/// Receives a scene by modelled correlations; shows progress if wanted.
fn by_correlations(
    scenes: &[Scene],
    settings: &Settings,
    sinks: (&mut dyn truth::Sink, &mut dyn Sink),
    with_progress: bool,
) -> Result<Both, CliError> {
    let name = scenes.first().map_or("", |scene| scene.name.as_str());
    let progress = Progress::new(&format!("run {name}"), scenes.first().map(|scene| scene.samples), with_progress);
    let start = Instant::now();
    let done = twin::correlations::run(scenes, settings, sinks, &mut |samples| progress.set(samples));
    let twin::Done { generated, outcome } = done.map_err(twin_error)?;
    let whole = start.elapsed();
    Ok(Both { generated, outcome, generator_busy: whole, receiver_busy: whole, whole })
}

/// The exit that a failure of the twin means.
fn twin_error(error: twin::TwinError) -> CliError {
    match error {
        twin::TwinError::Generate(error) => generator_error(error),
        twin::TwinError::Receive(error) => receiver_error(error),
        twin::TwinError::Refused(error) => CliError::input(error),
    }
}

/// Does `work` and adds the time that it took to `busy`.
fn timed<T>(busy: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let done = work();
    *busy += start.elapsed();
    done
}

/// Looks at the samples on their way: estimates the spectrum of the first part, or of pieces all over a scene
/// whose spectrum changes, and keeps a glimpse of them, or all if asked to.
struct Tap {
    metadata: IfMetadata,
    signals: Vec<&'static Signal>,
    psd: Psd,
    /// Bytes seen, the piece that is looked at next, and the way from one to the next.
    seen: u64,
    piece: Range<u64>,
    stride: u64,
    i: Vec<f32>,
    q: Vec<f32>,
    /// Bytes of the glimpse, by their number in the stream and as far as they came.
    glimpse: Range<u64>,
    glimpsed: Vec<u8>,
    /// Name of its files, and the samples.
    name: String,
    kept: Option<BufWriter<File>>,
}

impl Tap {
    /// A tap for one of `front_ends` front ends, which keeps those samples.
    fn new(
        scene: &Scene,
        run: &Path,
        (keep, changing): (bool, bool),
        (front_ends, glimpse): (usize, Range<u64>),
    ) -> Result<Self, CliError> {
        let own = scene.front_end_name.as_ref().filter(|_| front_ends > 1);
        let name = own.map_or_else(|| "if".to_owned(), Clone::clone);
        let kept = if keep {
            let path = run.join(format!("{name}.sigmf-data"));
            let file = File::create(&path).map_err(|error| CliError::create(path.display(), &error))?;
            Some(BufWriter::new(file))
        } else {
            None
        };
        let metadata = scene.metadata.clone();
        let sample_bytes = metadata.format.bytes() as u64;
        let looks = Looks::at(scene.samples, metadata.rate.hz(), changing);
        let (length, stride) = (looks.length * sample_bytes, looks.stride * sample_bytes);
        let psd = Psd::new(metadata.rate.hz(), !metadata.format.is_complex(), welch::BINS);
        Ok(Self {
            metadata,
            signals: scene.signals.clone(),
            psd,
            seen: 0,
            piece: 0..length,
            stride,
            i: Vec::new(),
            q: Vec::new(),
            glimpse: glimpse.start * sample_bytes..glimpse.end * sample_bytes,
            glimpsed: Vec::new(),
            name,
            kept,
        })
    }

    fn see(&mut self, bytes: &[u8]) -> io::Result<()> {
        let begin = self.seen;
        self.seen += bytes.len() as u64;
        let seen = self.seen;
        let place = |at: u64| (at.clamp(begin, seen) - begin) as usize;
        self.glimpsed.extend(bytes.get(place(self.glimpse.start)..place(self.glimpse.end)).unwrap_or(&[]));
        while self.piece.start < seen {
            let inside = bytes.get(place(self.piece.start)..place(self.piece.end)).unwrap_or(&[]);
            for part in inside.chunks(SEEN_BYTES) {
                self.metadata.format.unpack(part, &mut self.i, &mut self.q);
                self.psd.add(&self.i, &self.q);
            }
            if self.piece.end > seen {
                break;
            }
            self.psd.cut();
            self.piece = self.piece.start + self.stride..self.piece.end + self.stride;
        }
        match &mut self.kept {
            Some(file) => file.write_all(bytes),
            None => Ok(()),
        }
    }

    fn finish(self, run: &Path) -> Result<(), CliError> {
        if let Some(mut file) = self.kept {
            let path = run.join(format!("{}.sigmf-data", self.name));
            file.flush().map_err(|error| CliError::output(path.display(), &error))?;
            let path = run.join(format!("{}.sigmf-meta", self.name));
            let beside = Beside { signals: &self.signals, ..Beside::default() };
            let text = sigmf::write_with(&self.metadata, &beside);
            fs::write(&path, text).map_err(|error| CliError::output(path.display(), &error))?;
        }
        Ok(())
    }
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
        OutputError::Refused(error) => CliError::output("results", &std::io::Error::other(error)),
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
