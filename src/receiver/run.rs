//! The receiver at work: samples in, records out.
//!
//! Block by block: search when it is due, follow every channel in parallel, then, in a fixed order, read messages,
//! make observables, solve. Results do not depend on the number of threads. Memory holds one block, one search
//! window and what the satellites said.

use std::fmt;
use std::io::Read;

use serde_json::json;
use thiserror::Error;

use crate::gnss::samples::IfMetadata;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{SIGNALS, Signal};
use crate::receiver::acquire::{self, AcquireError};
use crate::receiver::diagnosis::{Diagnosis, Stage};
use crate::receiver::output::{Output, OutputError};
use crate::receiver::session::Session;
use crate::receiver::settings::{Settings, SettingsError};
use crate::receiver::source::{Source, SourceError};

/// Length of the blocks that channels work on.
const BLOCK_MS: u64 = 50;
/// Samples in a block at most: 1 MiB in planar `f32`, which stays in a core's cache while all channels go over it.
const BLOCK_SAMPLES: u64 = 1 << 17;

/// Why a reception was broken off.
#[derive(Debug, Error)]
pub enum ReceiveError {
    #[error(transparent)]
    Settings(#[from] SettingsError),
    #[error(transparent)]
    Acquire(#[from] AcquireError),
    #[error(transparent)]
    Source(#[from] SourceError),
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
    /// Why there was no fix, when there was none.
    pub diagnosis: Option<Diagnosis>,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.1} s received: {} satellites acquired, {} used, {} fixes",
            self.seconds,
            self.acquired.len(),
            self.used.len(),
            self.fixes
        )?;
        self.first_fix_s.map_or(Ok(()), |s| write!(f, ", the first after {s:.1} s"))?;
        if self.cut_bytes > 0 {
            write!(f, " ({} bytes of a cut sample left out)", self.cut_bytes)?;
        }
        Ok(())
    }
}

/// Signals and satellites that the samples can hold.
pub(super) fn candidates(metadata: &IfMetadata) -> Vec<(&'static Signal, Sv)> {
    let half_hz = 0.5 * metadata.rate.hz();
    SIGNALS
        .into_iter()
        // A real recording's IF may lie beyond half the rate on purpose.
        .filter(|signal| !metadata.format.is_complex() || metadata.if_hz(signal).abs() <= half_hz)
        .flat_map(|signal| signal.satellites().map(move |sv| (signal, sv)))
        .collect()
}

/// Receives `samples`, packed as `metadata` says, from the first to the last, and writes everything to `output`.
/// `progress` is told the number of samples done after every block.
///
/// # Errors
/// Settings out of range, samples that cannot be searched or read, records that cannot be written. No fix is no error: see
/// [`Outcome::diagnosis`].
pub fn receive<R: Read>(
    metadata: &IfMetadata,
    samples: R,
    settings: &Settings,
    output: &mut Output,
    progress: &mut dyn FnMut(u64),
) -> Result<Outcome, ReceiveError> {
    settings.validate("settings")?;
    let interval = u64::from(settings.operation.measurement_interval_ms);
    let stride = metadata.rate.first_sample_at(interval.min(BLOCK_MS), 1000).clamp(1, BLOCK_SAMPLES);
    let mut source = Source::new(samples, metadata.format, stride as usize)?;
    let mut session = Session::new(metadata, settings)?;
    while let Some(block) = source.next_block()? {
        session.process(&block, output)?;
        progress(block.first + block.i.len() as u64);
    }
    let (count, cut_bytes) = (source.samples(), source.cut_bytes());
    let seconds = metadata.rate.elapsed_s(count);
    let mut outcome = session.outcome();
    outcome.samples = count;
    outcome.seconds = seconds;
    outcome.cut_bytes = cut_bytes;
    if outcome.fixes == 0 {
        let needed = acquire::samples_needed(metadata, &settings.acquisition)?;
        let stage =
            if count < needed { Stage::NothingSearched { samples: count, needed } } else { session.failed_stage() };
        let if_hz = SIGNALS.first().map_or(0.0, |signal| metadata.if_hz(signal));
        let format = metadata.format.name();
        outcome.diagnosis = Some(Diagnosis::new(stage, seconds, metadata.rate.hz(), format, if_hz, cut_bytes));
    }
    output.finish(&summary(metadata, settings, &outcome))?;
    Ok(outcome)
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
        "acquired": names(&outcome.acquired),
        "used": names(&outcome.used),
        "fixes": outcome.fixes,
        "first_fix_s": outcome.first_fix_s,
        "losses": outcome.losses,
        "diagnosis": outcome.diagnosis.as_ref().map(ToString::to_string),
    })
}
