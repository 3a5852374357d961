//! Run of a scene in memory: the generator's samples go to the receiver and to taps, truth and records to
//! files.
//!
//! `run` and `pack run` share it. The loop itself is [`twin::feed`]; here are the files, the spectrum of the
//! samples and the peaks of its signals. The bytes of the files do not depend on the number of threads.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::cli::error::CliError;
use crate::cli::glimpse::Moment;
use crate::cli::run::{generator_error, judge_error, output_error, receiver_error, truth_error};
use analysis::expect::welch::{self, Looks};
use analysis::measure::psd::Psd;
use analysis::read::{PeakRow, psd_name};
use analysis::show::tables;
use generator::scene::Scene;
use generator::stream::Generated;
use generator::{GenerateError, truth};
use gnss::exchange::Version;
use gnss::samples::IfMetadata;
use gnss::sigmf::{self, Beside};
use gnss::signal::Signal;
use receiver::output::{Nmea, Output, Rinex, Sink, Tracks};
use receiver::settings::Settings;
use receiver::{Outcome, Reception};
use twin::Refused;
use twin::TwinError;

/// Bytes that are made numbers at a time: whole samples of any format.
const SEEN_BYTES: usize = 1 << 17;

/// Files beyond those that the judge reads, and who is told of the progress.
pub struct Wanted<'a> {
    /// RINEX of that version, NMEA 0183 and tracks, of truth and receiver.
    pub exchanged: Option<Version>,
    /// True if the samples are kept.
    pub keep_if: bool,
    /// Takes the number of samples of the first front end that are done.
    pub told: &'a (dyn Fn(u64) + Sync),
}

/// End of a run that is not success.
pub enum Failure {
    /// A level without samples has no model of an effect.
    Refused(Refused),
    /// Anything else, with its exit code.
    Other(CliError),
}

impl From<CliError> for Failure {
    fn from(error: CliError) -> Self {
        Self::Other(error)
    }
}

impl From<Failure> for CliError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Refused(refused) => Self::input(refused),
            Failure::Other(error) => error,
        }
    }
}

/// Failure that an error of the twin means.
pub fn failure(error: TwinError) -> Failure {
    match error {
        TwinError::Generate(error) => generator_error(error).into(),
        TwinError::Receive(error) => receiver_error(error).into(),
        TwinError::Refused(refused) => Failure::Refused(refused),
    }
}

/// Results of a run, beside its files.
pub struct Both {
    pub generated: Vec<Generated>,
    pub outcome: Outcome,
    pub generator_busy: Duration,
    pub receiver_busy: Duration,
    pub whole: Duration,
}

/// Runs scenes, which are the front ends of one scenario, into a directory: `truth/`, `rx/`, `psd.csv`,
/// `peaks.csv`, and the samples if they are kept.
///
/// # Errors
/// A file that cannot be written, a scene that cannot be generated or received.
pub fn make(run: &Path, scenes: &[Scene], settings: &Settings, wanted: &Wanted<'_>) -> Result<Both, Failure> {
    let Some(scene) = scenes.first() else { return Err(CliError::bug("a scenario without a front end").into()) };
    let below = |name| {
        let path = run.join(name);
        fs::create_dir(&path).map_err(|error| CliError::create(path.display(), &error)).map(|()| path)
    };
    let (truth_in, rx_in) = (below("truth")?, below("rx")?);
    let mut output = Output::create(&rx_in).map_err(output_error)?;
    let mut truth = truth::Several(vec![Box::new(truth::Writer::create(&truth_in).map_err(truth_error)?)]);
    let mut others = None;
    if let Some(version) = wanted.exchanged {
        // The same as other programs read it.
        truth.0.push(Box::new(truth::Rinex::new(&truth_in, version)));
        truth.0.push(Box::new(truth::Nmea::create(&truth_in).map_err(truth_error)?));
        truth.0.push(Box::new(truth::Tracks::new(&truth_in)));
        let signals = settings.acquisition.signals();
        let files = Rinex::create(&rx_in, version, &scene.name, &signals).map_err(output_error)?;
        let tracks = Tracks::create(&rx_in, &scene.name).map_err(output_error)?;
        others = Some((files, sentences(&rx_in)?, tracks));
    }
    let (keep, changing) = (wanted.keep_if, scenes.iter().any(|scene| !scene.interference.is_empty()));
    let is_sampled = scene.fidelity.grade.is_sampled();
    if keep && !is_sampled {
        return Err(generator_error(GenerateError::NoSamples(scene.fidelity.grade.name())).into());
    }
    let mut moment = Moment::of(scene);
    let tap = |scene: &Scene| Tap::new(scene, run, (keep, changing), (scenes.len(), moment.samples(scene)));
    let mut taps: Vec<Tap> = scenes.iter().filter(|_| is_sampled).map(tap).collect::<Result<_, _>>()?;
    let mut go = |outputs: &mut (dyn Sink + Send)| -> Result<Both, Failure> {
        let start = Instant::now();
        let progress = &mut |samples| (wanted.told)(samples);
        match twin::modelled(scenes, settings, (&mut truth, outputs), progress).map_err(failure)? {
            Some(twin::Done { generated, outcome }) => {
                let whole = start.elapsed();
                Ok(Both { generated, outcome, generator_busy: whole, receiver_busy: whole, whole })
            }
            None => Ok(both(scenes, settings, &mut (&mut truth, &mut moment), outputs, (&mut taps, wanted.told))?),
        }
    };
    let made = match &mut others {
        Some((files, sentences, tracks)) => go(&mut (&mut output, &mut (files, &mut (sentences, tracks)))),
        None => go(&mut output),
    }?;
    for (number, tap) in taps.iter().enumerate() {
        let later = Some(tap.name.as_str()).filter(|_| number > 0);
        tables::write_psd(&run.join(psd_name(later)), &tap.psd).map_err(judge_error)?;
    }
    let of = |(tap, own): (&Tap, &Scene)| moment.peaks(scene, own, &tap.glimpsed);
    let peaks: Vec<PeakRow> = taps.iter().zip(scenes).flat_map(of).collect();
    tables::write_peaks(&run.join("peaks.csv"), &peaks).map_err(judge_error)?;
    taps.into_iter().try_for_each(|tap| tap.finish(run))?;
    Ok(made)
}

/// Sink that writes the fixes as NMEA 0183.
fn sentences(directory: &Path) -> Result<Nmea<File>, CliError> {
    let path = directory.join("fixes.nmea");
    let file = File::create(&path).map_err(|error| CliError::create(path.display(), &error))?;
    Ok(Nmea::new(path, file))
}

/// Generates and receives side by side, and looks at the samples on their way.
fn both(
    scenes: &[Scene],
    settings: &Settings,
    truth: &mut (dyn truth::Sink + Send),
    output: &mut (dyn Sink + Send),
    (taps, told): (&mut [Tap], &(dyn Fn(u64) + Sync)),
) -> Result<Both, CliError> {
    let start = Instant::now();
    let mut receiver_busy = Duration::ZERO;
    let metadata: Vec<IfMetadata> = scenes.iter().map(|scene| scene.metadata.clone()).collect();
    let mut reception = Reception::of_several(&metadata, settings).map_err(receiver_error)?;
    let fed = twin::feed(scenes, truth, &mut |number, samples| {
        if let Some(tap) = taps.get_mut(number) {
            tap.see(samples).map_err(|error| CliError::output("samples", &error))?;
        }
        timed(&mut receiver_busy, || reception.take_of(number, samples, output)).map_err(receiver_error)?;
        told(reception.samples());
        Ok::<_, CliError>(())
    })?;
    let outcome = reception.finish(output).map_err(receiver_error)?;
    let twin::Fed { generated, busy: generator_busy } = fed;
    Ok(Both { generated, outcome, generator_busy, receiver_busy, whole: start.elapsed() })
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
