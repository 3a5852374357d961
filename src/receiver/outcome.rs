//! Outcome of a reception, its conditioning, and the errors that end it.

use std::fmt;

use serde::Serialize;
use thiserror::Error;

use crate::acquire::AcquireError;
use crate::array::{ArrayError, Formed};
use crate::authentic::{AnchorError, Authenticity};
use crate::detect::Detected;
use crate::diagnosis::{Diagnosis, duration};
use crate::gap::Jump;
use crate::output::OutputError;
use crate::parting::Parted;
use crate::settings::SettingsError;
use crate::track::LoopMargin;
use gnss::record::{Fix, LineRow};
use gnss::samples::Format;
use gnss::satellite::Sv;

/// Error that ends a reception.
#[derive(Debug, Error)]
pub enum ReceiveError {
    /// No samples at all.
    #[error("no front end: expected the samples of one at least")]
    NoFrontEnd,
    /// Samples of a front end that the reception does not have.
    #[error("front end {number} of a reception that has {have}: expected one of them, from 0 on")]
    UnknownFrontEnd {
        /// The number that was given.
        number: usize,
        /// Front ends of the reception.
        have: usize,
    },
    /// Complex samples for a front end whose samples are real.
    #[error("complex samples for a front end of {format}, which is real: expected a complex format")]
    Real {
        /// Format of the front end.
        format: Format,
    },
    /// A signal that cannot be followed to a position.
    #[error("acquisition.signals: {signal} cannot be received: {reason}")]
    Unsupported {
        /// Name of the signal.
        signal: &'static str,
        /// Reason in words.
        reason: String,
    },
    /// Verification of authentication that cannot begin.
    #[error(transparent)]
    Osnma(#[from] AnchorError),
    /// Settings that are refused.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Elements of an array whose samples do not become one stream.
    #[error(transparent)]
    Array(#[from] ArrayError),
    /// A search that cannot be made.
    #[error(transparent)]
    Acquire(#[from] AcquireError),
    /// Samples that cannot be read.
    #[error("cannot read the samples after sample {sample}: {error}")]
    Read {
        /// The last sample that was read.
        sample: u64,
        /// Error that the reader returned.
        error: std::io::Error,
    },
    /// Records that cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Result of a reception.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Whole samples read, and their time.
    pub samples: u64,
    /// The time of those samples.
    pub seconds: f64,
    /// Satellites found by any search, and those in any fix.
    pub acquired: Vec<Sv>,
    /// Satellites in any fix.
    pub used: Vec<Sv>,
    /// Fixes written.
    pub fixes: u64,
    /// Time of the first fix since the first sample.
    pub first_fix_s: Option<f64>,
    /// The last of them.
    pub last_fix: Option<Fix>,
    /// Channels lost or dropped.
    pub losses: u64,
    /// Bytes of a sample that the end cut off.
    pub cut_bytes: usize,
    /// Encoding that the bytes resemble, if it is not the format that was assumed.
    pub format_warning: Option<String>,
    /// Diagnosis, if there was no fix.
    pub diagnosis: Option<Diagnosis>,
    /// Continuous waves that were met; the rows are in `interference.csv`.
    pub interfered: Option<Interfered>,
    /// Code-carrier divergence that all satellites share, if any.
    pub parted: Option<Parted>,
    /// Verification of Galileo's authentication, if the settings ask for it.
    pub osnma: Option<Authenticity>,
    /// Tests of the detectors of jamming and spoofing, if the settings ask for them.
    pub detection: Option<Detected>,
    /// Work of the spatial filter of an array, if the settings have one.
    pub array: Option<Formed>,
    /// Gaps and repetitions in the samples.
    pub jumps: Vec<Jump>,
    /// Margins to what is refused.
    pub conditioning: Conditioning,
    /// Conditions that make the results worse than necessary, each with its remedy.
    pub warnings: Vec<String>,
}

/// Margins of a reception to the limits beyond which it is refused as ill-conditioned.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Conditioning {
    /// Largest ratio of the geometry's singular values that a fix had, and from which on there is none.
    pub geometry_worst: Option<f64>,
    /// The largest condition that is solved.
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

/// Continuous-wave interference that was met.
#[derive(Clone, Debug, PartialEq)]
pub struct Interfered {
    /// Spectra with a line, each of a second, or of all samples where there are fewer.
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
        let spectra = if self.spectra == 1 { "spectrum" } else { "spectra" };
        write!(f, ", in {} {spectra}", self.spectra)
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
        self.osnma.as_ref().map_or(Ok(()), |osnma| write!(f, "; {osnma}"))?;
        self.detection.as_ref().map_or(Ok(()), |detected| write!(f, "; {detected}"))?;
        self.jumps.iter().try_for_each(|jump| write!(f, "; {jump}"))
    }
}
