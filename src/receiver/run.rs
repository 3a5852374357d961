//! The receiver at work: samples in, records out.
//!
//! Block by block: search when it is due, follow every channel in parallel, then, in a fixed order, read messages,
//! make observables, solve. Results do not depend on the number of threads. Memory holds one block, one search
//! window and what the satellites said.

use std::fmt;
use std::io::{ErrorKind, Read};

use serde::Serialize;
use serde_json::json;
use thiserror::Error;

use crate::gnss::record::LineRow;
use crate::gnss::samples::IfMetadata;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{Component, Link, Signal};
use crate::receiver::acquire::{self, AcquireError, AcquisitionSettings};
use crate::receiver::correlate::standing_bias_m;
use crate::receiver::diagnosis::{Diagnosis, Stage, duration};
use crate::receiver::format::Check;
use crate::receiver::gap::Jump;
use crate::receiver::lead::lead;
use crate::receiver::output::{OutputError, Record, Sink};
use crate::receiver::parting::Parted;
use crate::receiver::session::Session;
use crate::receiver::settings::{Settings, SettingsError};
use crate::receiver::source::Source;
use crate::receiver::track::LoopMargin;

/// Length of the blocks that channels work on.
const BLOCK_MS: u64 = 50;
/// Samples in a block at most.
const BLOCK_SAMPLES: u64 = 1 << 17;
/// Bytes read at a time.
const READ_BYTES: usize = 1 << 18;

/// Why a reception was broken off.
#[derive(Debug, Error)]
pub enum ReceiveError {
    #[error("acquisition.signals: {signal} cannot be received: {reason}")]
    Unsupported { signal: &'static str, reason: String },
    #[error(transparent)]
    Settings(#[from] SettingsError),
    #[error(transparent)]
    Acquire(#[from] AcquireError),
    #[error("cannot read the samples after sample {sample}: {error}")]
    Read { sample: u64, error: std::io::Error },
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// What a reception came to.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Whole samples read, and their time.
    pub samples: u64,
    pub seconds: f64,
    /// Satellites found by any search, and those in any fix.
    pub acquired: Vec<Sv>,
    pub used: Vec<Sv>,
    pub fixes: u64,
    /// Time of the first fix since the first sample.
    pub first_fix_s: Option<f64>,
    /// Channels lost or dropped.
    pub losses: u64,
    /// Bytes of a sample that the end cut off.
    pub cut_bytes: usize,
    /// What the bytes look like, if not like the format that was taken.
    pub format_warning: Option<String>,
    /// Why there was no fix, when there was none.
    pub diagnosis: Option<Diagnosis>,
    /// Continuous waves that were met; the rows are in `interference.csv`.
    pub interfered: Option<Interfered>,
    /// How far carrier and code part on all satellites alike, where they do.
    pub parted: Option<Parted>,
    /// Where samples are missing, or came twice.
    pub jumps: Vec<Jump>,
    pub conditioning: Conditioning,
    /// What makes the results worse than need be, and the remedy.
    pub warnings: Vec<String>,
}

/// How near the reception was to what is refused as ill-conditioned.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Conditioning {
    /// Largest ratio of the geometry's singular values that a fix had, and from which on there is none.
    pub geometry_worst: Option<f64>,
    pub geometry_limit: f64,
    /// Bandwidth times update time of every loop.
    pub loops: Vec<LoopMargin>,
}

impl fmt::Display for Conditioning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(worst) = self.geometry_worst {
            write!(f, "condition of the geometry up to {worst:.1}, refused from {:e}; ", self.geometry_limit)?;
        }
        let least = self.loops.iter().min_by(|a, b| a.margin_share.total_cmp(&b.margin_share));
        let Some(LoopMargin { key, bandwidth_time, limit, margin_share, .. }) = least else { return Ok(()) };
        write!(
            f,
            "largest bandwidth times update time {bandwidth_time:.3} ({key}), refused above {limit}: {:.0} % left",
            100.0 * margin_share
        )
    }
}

/// What there was of continuous waves.
#[derive(Clone, Debug, PartialEq)]
pub struct Interfered {
    /// Spectra of a second that had a line.
    pub spectra: u64,
    /// The strongest line.
    pub strongest: LineRow,
}

impl fmt::Display for Interfered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LineRow { frequency_hz, jn0_dbhz, js_db, lines, .. } = &self.strongest;
        let what = if *lines > 1 { "lines of interference, the strongest" } else { "a continuous wave" };
        write!(f, "{what} at {:+.1} kHz in the samples, J/N0 {jn0_dbhz:.1} dB-Hz", 1e-3 * frequency_hz)?;
        js_db.map_or(Ok(()), |js_db| write!(f, ", J/S {js_db:.1} dB"))?;
        write!(f, ", in {} s", self.spectra)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} received: {} satellites acquired, {} used, {} fixes",
            duration(self.seconds),
            self.acquired.len(),
            self.used.len(),
            self.fixes
        )?;
        self.first_fix_s.map_or(Ok(()), |s| write!(f, ", the first after {s:.1} s"))?;
        if self.cut_bytes > 0 {
            write!(f, " ({} bytes of a cut sample left out)", self.cut_bytes)?;
        }
        self.interfered.as_ref().map_or(Ok(()), |seen| write!(f, "; {seen}"))?;
        self.parted.as_ref().map_or(Ok(()), |parted| write!(f, "; {parted}"))?;
        self.jumps.iter().try_for_each(|jump| write!(f, "; {jump}"))
    }
}

/// Errors of the code from which on a rate is warned of.
const STANDING_BIAS_M: f64 = 0.5;

/// What of samples and settings makes the results worse than need be.
pub(super) fn warnings(metadata: &IfMetadata, settings: &Settings) -> Vec<String> {
    let rate_hz = metadata.rate.hz();
    let one = |signal: &Signal, component: &Component| {
        let bias_m = standing_bias_m(settings.tracking.replica, rate_hz, component);
        let samples_per_chip = rate_hz / component.chip_rate_hz;
        // The code's error turns once while the code passes a sample; what is quicker than the loop averages.
        let cycles_per_chip = signal.centre_hz() / component.chip_rate_hz;
        let slow_hz = cycles_per_chip * settings.tracking.dll_bandwidth_hz / samples_per_chip;
        (bias_m > STANDING_BIAS_M).then(|| {
            format!(
                "{:.3} Msps are {samples_per_chip:.3} samples a chip: while a satellite's Doppler stays below {slow_hz:.0} Hz, \
                 its pseudorange errs by {bias_m:.1} m rms (tracking.replica = {:?}); another rate, like 2.6 Msps, avoids it",
                1e-6 * rate_hz, settings.tracking.replica
            )
        })
    };
    let signals = settings.acquisition.signals();
    let mut found: Vec<String> = signals.iter().filter_map(|signal| one(signal, lead(signal)?)).collect();
    found.extend(signals.iter().filter_map(|signal| image(metadata, signal, settings.acquisition.doppler_max_hz)));
    found
}

/// Real samples whose carriers meet their own image: at 0 Hz or half the rate a carrier above and one below look alike.
fn image(metadata: &IfMetadata, signal: &Signal, doppler_max_hz: f64) -> Option<String> {
    let half_hz = 0.5 * metadata.rate.hz();
    let if_hz = metadata.if_hz(signal.centre_hz());
    let image_hz = half_hz * (if_hz / half_hz).round();
    let near = !metadata.format.is_complex() && (if_hz - image_hz).abs() < doppler_max_hz;
    near.then(|| {
        format!(
            "{} real samples with {} at {:.4} MHz, {:.1} kHz from {} of the rate: a carrier and its image are less than two Dopplers \
             of {doppler_max_hz:.0} Hz apart, and Dopplers get the wrong sign; another intermediate frequency or complex \
             samples avoid it",
            metadata.format.name(),
            signal.name,
            1e-6 * if_hz,
            1e-3 * (if_hz - image_hz).abs(),
            if (image_hz / half_hz) as i64 % 2 == 0 { "a multiple" } else { "an odd half" },
        )
    })
}

/// Signals and satellites that are searched for, as far as the samples can hold them.
pub(super) fn candidates(metadata: &IfMetadata, settings: &AcquisitionSettings) -> Vec<Link> {
    let signals = settings.signals().into_iter().filter(|signal| acquire::can_hold(metadata, signal));
    signals
        .flat_map(|signal| signal.satellites().map(move |sv| signal.link(sv)))
        .filter(|link| settings.reserved_codes || link.is_of_constellation())
        .collect()
}

/// A reception that is given its samples piece by piece.
pub struct Reception {
    metadata: IfMetadata,
    settings: Settings,
    check: Check,
    source: Source,
    session: Session,
}

impl Reception {
    /// A cold start on samples that are packed as `metadata` says.
    ///
    /// # Errors
    /// Settings out of range, samples that cannot be searched.
    pub fn new(metadata: &IfMetadata, settings: &Settings) -> Result<Self, ReceiveError> {
        settings.validate("settings")?;
        let interval = u64::from(settings.operation.measurement_interval_ms);
        let block = metadata.rate.first_sample_at(interval.min(BLOCK_MS), 1000).min(BLOCK_SAMPLES);
        Ok(Self {
            metadata: metadata.clone(),
            settings: settings.clone(),
            check: Check::new(metadata.format),
            source: Source::new(metadata.format, block as usize),
            session: Session::new(metadata, settings)?,
        })
    }

    /// Takes the next bytes, cut anywhere, and gives what they bring to `sink`.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn take(&mut self, mut bytes: &[u8], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        self.check.take(bytes);
        while let Some(block) = self.source.next(&mut bytes) {
            self.session.process(&block, sink)?;
        }
        Ok(())
    }

    /// Samples taken so far, those of a block that is not full yet left out.
    pub fn samples(&self) -> u64 {
        self.source.samples()
    }

    /// Ends the reception: gives what is left to `sink` and returns what came of it.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn finish(mut self, sink: &mut dyn Sink) -> Result<Outcome, ReceiveError> {
        let (rest, cut_bytes) = self.source.rest();
        if let Some(block) = rest {
            self.session.process(&block, sink)?;
        }
        self.session.search_rest(sink)?;
        let (metadata, settings) = (&self.metadata, &self.settings);
        let count = self.source.samples();
        let seconds = metadata.rate.elapsed_s(count);
        let mut outcome = self.session.outcome();
        let findings = self.session.findings();
        outcome.samples = count;
        outcome.seconds = seconds;
        outcome.cut_bytes = cut_bytes;
        outcome.format_warning = self.check.warning();
        if outcome.fixes == 0 {
            let stage = if self.session.has_searched() {
                self.session.failed_stage()
            } else {
                let needed = acquire::least_samples(metadata, &settings.acquisition)?;
                Stage::NothingSearched { samples: count, needed }
            };
            let if_hz = settings.acquisition.signals().first().map_or(0.0, |signal| metadata.if_hz(signal.centre_hz()));
            let format = metadata.format.name();
            let (rate_hz, acquired) = (metadata.rate.hz(), outcome.acquired.len());
            let mut diagnosis = Diagnosis::new(stage, seconds, rate_hz, format, if_hz, cut_bytes, acquired);
            if let Some(seen) = &outcome.interfered {
                diagnosis.advice.insert(0, format!("the spectrum: {seen}"));
            }
            diagnosis.advice.splice(0..0, findings);
            outcome.diagnosis = Some(diagnosis);
        } else {
            outcome.warnings.extend(findings);
        }
        sink.finish(&summary(metadata, settings, &outcome))?;
        Ok(outcome)
    }
}

/// A receiver whose results are values: nothing is written.
///
/// ```no_run
/// use gnss_twin::gnss::samples::{Format, IfMetadata};
/// use gnss_twin::gnss::time::Rate;
/// use gnss_twin::receiver::output::Record;
/// use gnss_twin::receiver::{Receiver, settings::Settings};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let rate = Rate::from_hz(4e6).ok_or("no rate")?;
/// let (format, center_hz) = (Format::Ci8, 1_575.42e6);
/// let metadata = IfMetadata { format, rate, center_hz, inverted: false, start: None };
/// let mut receiver = Receiver::new(&metadata, &Settings::default())?;
/// for chunk in std::fs::read("recording.ci8")?.chunks(1 << 20) {
///     for record in receiver.push(chunk)? {
///         if let Record::Fix(fix) = record {
///             println!("{} {:?}", fix.time(), fix.position_m());
///         }
///     }
/// }
/// let (_, outcome) = receiver.finish()?;
/// println!("{outcome}");
/// # Ok(())
/// # }
/// ```
pub struct Receiver {
    reception: Reception,
}

impl Receiver {
    /// A cold start on samples that are packed as `metadata` says.
    ///
    /// # Errors
    /// As [`Reception::new`].
    pub fn new(metadata: &IfMetadata, settings: &Settings) -> Result<Self, ReceiveError> {
        Reception::new(metadata, settings).map(|reception| Self { reception })
    }

    /// Takes the next bytes, cut anywhere, and returns what they bring, in the order in which the receiver
    /// found it.
    ///
    /// # Errors
    /// Samples that cannot be searched.
    pub fn push(&mut self, bytes: &[u8]) -> Result<Vec<Record>, ReceiveError> {
        let mut records = Vec::new();
        self.reception.take(bytes, &mut records)?;
        Ok(records)
    }

    /// Ends the reception: returns what was left, and what came of it.
    ///
    /// # Errors
    /// Samples that cannot be searched.
    pub fn finish(self) -> Result<(Vec<Record>, Outcome), ReceiveError> {
        let mut records = Vec::new();
        let outcome = self.reception.finish(&mut records)?;
        Ok((records, outcome))
    }
}

/// Receives `samples`, packed as `metadata` says, from the first to the last, and gives everything to `sink`.
/// `progress` is told the number of samples done after every block.
///
/// # Errors
/// Settings out of range, samples that cannot be searched or read, records that cannot be written. No fix is no error: see
/// [`Outcome::diagnosis`].
pub fn receive<R: Read>(
    metadata: &IfMetadata,
    mut samples: R,
    settings: &Settings,
    sink: &mut dyn Sink,
    progress: &mut dyn FnMut(u64),
) -> Result<Outcome, ReceiveError> {
    let mut reception = Reception::new(metadata, settings)?;
    let mut bytes = vec![0; READ_BYTES];
    loop {
        match samples.read(&mut bytes) {
            Ok(0) => return reception.finish(sink),
            Ok(count) => reception.take(bytes.get(..count).unwrap_or_default(), sink)?,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(ReceiveError::Read { sample: reception.samples(), error }),
        }
        progress(reception.samples());
    }
}

/// What `receiver.json` says.
fn summary(metadata: &IfMetadata, settings: &Settings, outcome: &Outcome) -> serde_json::Value {
    let names = |svs: &[Sv]| svs.iter().map(Sv::to_string).collect::<Vec<_>>();
    json!({
        "settings": settings,
        "metadata": {
            "format": metadata.format.name(),
            "sample_rate_hz": metadata.rate.hz(),
            "center_hz": metadata.center_hz,
            "inverted": metadata.inverted,
            "start": metadata.start.map(|start| start.to_string()),
        },
        "samples": outcome.samples,
        "seconds": outcome.seconds,
        "cut_bytes": outcome.cut_bytes,
        "format_warning": outcome.format_warning,
        "acquired": names(&outcome.acquired),
        "used": names(&outcome.used),
        "fixes": outcome.fixes,
        "first_fix_s": outcome.first_fix_s,
        "losses": outcome.losses,
        "interference": outcome.interfered.as_ref().map(|seen| json!({
            "seconds": seen.spectra,
            "strongest": seen.strongest,
        })),
        "carrier_offset": outcome.parted,
        "sample_jumps": outcome.jumps,
        "conditioning": outcome.conditioning,
        "warnings": outcome.warnings,
        "diagnosis": outcome.diagnosis.as_ref().map(ToString::to_string),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::samples::Format;
    use crate::gnss::time::Rate;

    #[test]
    fn a_failing_reader_is_an_error_with_its_place_and_an_interruption_is_none() {
        /// Gives 1000 bytes, is interrupted, gives 1000 more and breaks.
        struct Broken(u32);
        impl Read for Broken {
            fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
                self.0 += 1;
                match self.0 {
                    1 | 3 => Ok(buffer.len().min(1000)),
                    2 => Err(ErrorKind::Interrupted.into()),
                    _ => Err(std::io::Error::other("unplugged")),
                }
            }
        }
        let rate = Rate::from_hz(1e5).unwrap();
        let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: 1_575.42e6, inverted: false, start: None };
        let mut records: Vec<Record> = Vec::new();
        let error = receive(&metadata, Broken(0), &Settings::default(), &mut records, &mut |_| ()).unwrap_err();
        assert!(error.to_string().contains("sample 0") && error.to_string().contains("unplugged"), "{error}");
    }
}
