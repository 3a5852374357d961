//! Tracking: one channel follows one signal of one satellite.
//!
//! A [`Channel`] takes consecutive blocks of samples and gives the state of its replica at requested samples,
//! message symbols, rows for the judge and events. Its loops ([`loops`]) are designed in the discrete domain
//! and closed in [`closed`]; detectors are in [`lock`], [`cn0`] and `sync`, the pull-in of weak signals in
//! `pull_in`, the secondary code of pilots in `secondary_code`, both sidebands of a sub-carrier in `sides`,
//! sums for detectors of distorted correlations in [`shape`]. Limits: loops follow the component that leads,
//! a code period is at least as long as a few samples.

use gnss::record::{Event, TrackingRow};
use shape::Shape;

mod bits;
mod channel;
pub mod closed;
pub mod cn0;
#[cfg(test)]
mod ensemble_tests;
mod halves;
pub mod lock;
mod long;
pub mod loops;
pub mod model;
mod pull_in;
mod secondary_code;
pub mod settings;
pub mod shape;
pub mod side;
mod sides;
#[cfg(test)]
mod signals_tests;
#[cfg(test)]
mod stream_tests;
mod sync;
#[cfg(test)]
mod taps_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod weak_tests;

pub use channel::{Channel, Glance, Past, pilot_group};
pub use model::ReplicaModel;
pub use settings::{CodeDiscriminator, LoopMargin, TrackingSettings, TrackingSettingsError};

/// Results of a channel for a block.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// States at the samples that were asked for.
    pub measurements: Vec<Measurement>,
    /// Symbols that ended in the block.
    pub symbols: Vec<Symbol>,
    /// One a measurement, with the latest loop update.
    pub rows: Vec<TrackingRow>,
    /// Events with the sample at which they were noticed.
    pub events: Vec<(u64, Event)>,
    /// Shape of the correlation since it was taken last; `None` where nobody asks for it.
    pub shape: Option<Shape>,
}

/// The state of a channel's replica at a requested sample.
#[derive(Clone, Copy, Debug)]
pub struct Measurement {
    /// The sample.
    pub sample: u64,
    /// Whole code periods since the channel's own period 0, and the fraction of the running one.
    pub code_periods: u64,
    /// Fraction of the running code period.
    pub code_fraction: f64,
    /// Accumulated carrier in the RINEX sense (grows with range, that is, against Doppler), nominal IF
    /// removed: θ(n)/turns − f_IF·n/fs, negated, and negated once more for an inverted spectrum. Unknown
    /// whole number, and half while `half_cycle_known` is false.
    pub carrier_cycles: f64,
    /// True if the carrier's half cycle is resolved.
    pub half_cycle_known: bool,
    /// Positive when approaching.
    pub doppler_hz: f64,
    /// C/N0 of the whole signal in dB-Hz.
    pub cn0_dbhz: f64,
    /// Time since the carrier was locked.
    pub locked_s: f64,
    /// True if the carrier loop is locked now.
    pub locked: bool,
}

/// One message symbol, with the polarity that the channel happened to lock to.
#[derive(Clone, Copy, Debug)]
pub struct Symbol {
    /// The channel's number of the code period in which the symbol began.
    pub first_period: u64,
    /// The sample after its last one.
    pub end: u64,
    /// In-phase prompt summed over the symbol, in standard deviations of the noise of that sum: its sign is
    /// the bit.
    pub soft: f32,
}
