//! Errors of a search.

use thiserror::Error;

use gnss::satellite::Sv;

/// Error of a search that cannot be made.
#[derive(Debug, Error, PartialEq)]
pub enum AcquireError {
    /// A setting out of its range.
    #[error("acquisition.{key} is {value}: expected {expected}")]
    Setting {
        /// Name of the setting.
        key: &'static str,
        /// Value that was given.
        value: f64,
        /// Range of the allowed values.
        expected: &'static str,
    },
    /// A block that is too short.
    #[error("{have} samples are too few for the search: expected at least {need}")]
    TooFewSamples {
        /// Samples that there are.
        have: u64,
        /// Samples that the search asks for.
        need: u64,
    },
    /// Planes of different lengths.
    #[error("a block has {i} in-phase and {q} quadrature samples: expected as many of both")]
    Uneven {
        /// In-phase samples.
        i: usize,
        /// Quadrature samples.
        q: usize,
    },
    /// Fewer samples a second than chips.
    #[error("the sample rate is {rate_hz} Hz: expected at least {need_hz} Hz for {signal}")]
    RateTooLow {
        /// The signal.
        signal: &'static str,
        /// The sample rate.
        rate_hz: f64,
        /// The least rate.
        need_hz: f64,
    },
    /// A carrier that the samples do not hold.
    #[error(
        "{signal} lies {if_hz} Hz from the centre of the samples: expected within half the sample rate, {half_hz} Hz"
    )]
    OutOfBand {
        /// The signal.
        signal: &'static str,
        /// Distance of the signal from the band's centre, in hertz.
        if_hz: f64,
        /// Half the sample rate.
        half_hz: f64,
    },
    /// A signal that is not registered.
    #[error("acquisition.signals names '{name}': expected some of {known}")]
    UnknownSignal {
        /// The name as written.
        name: String,
        /// Names of all registered signals, and which of them may be meant.
        known: String,
    },
    /// A code that this receiver cannot make.
    #[error("no code of {signal} is short enough for this receiver: expected fewer than 65 536 steps a period")]
    TooLong {
        /// The signal.
        signal: &'static str,
    },
    /// A satellite without a code of the signal.
    #[error("{sv} has no {signal} code: expected a satellite to which its documents assign one")]
    NoCode {
        /// The signal.
        signal: &'static str,
        /// The satellite.
        sv: Sv,
    },
}
