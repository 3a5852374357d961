//! Errors of generation.

use thiserror::Error;

use crate::synth::waveform::WaveformError;
use crate::truth::TruthError;
use gnss::broadcast::OrbitError;
use gnss::gps::lnav::FieldError;

/// Reason for which a scene could not be generated.
#[derive(Debug, Error)]
pub enum GenerateError {
    /// An orbit that cannot be computed.
    #[error(transparent)]
    Orbit(#[from] OrbitError),
    /// An ephemeris whose values do not fit its message.
    #[error("a navigation message cannot be made: {0}")]
    Message(#[from] FieldError),
    /// A sink that does not take the truth.
    #[error("truth: {0}")]
    Truth(#[from] TruthError),
    /// A writer that does not take the samples.
    #[error("samples could not be written: {0}")]
    Write(#[from] std::io::Error),
    /// A signal that cannot be rendered at the scene's rate.
    #[error(transparent)]
    Waveform(#[from] WaveformError),
    /// Samples of a scene that has none.
    #[error(
        "fidelity.level = \"{0}\": no samples exist at this level: take \"balanced\", or `gnss-twin run`, which \
         needs none"
    )]
    NoSamples(&'static str),
    /// Front ends without a scene.
    #[error("no front end: expected one at least")]
    NoFrontEnd,
    /// `truth.interval_s` out of range.
    #[error("truth_interval_s = {0}: expected 1e-6 to 1e6 s")]
    TruthInterval(f64),
    /// Samples for which the motion is not known yet, or not any more.
    #[error(
        "the motion is pushed and known up to sample {known}, but sample {needed} is asked for: `gnss-twin live` \
         drives such a scene, and its record replays it"
    )]
    Unpushed {
        /// Samples for which there are ticks.
        known: u64,
        /// The sample after the last one asked for.
        needed: u64,
    },
    /// A part that the scene does not have.
    #[error("samples {first} to {end} of a scene that has {samples}: expected a first one before the last")]
    Part {
        /// First sample asked for.
        first: u64,
        /// The sample after the last one asked for.
        end: u64,
        /// Samples of the scene.
        samples: u64,
    },
}
