//! Measurements of a foreign receiver's observables: rows of its tables, and their figures.

use std::collections::BTreeMap;

use serde::Serialize;

use super::fit::Estimate;
use crate::expect::timeline::State;
use crate::read::rinex_obs::Values;
use gnss::signal::{Link, Signal};

/// One observation against the truth: a row of `foreign_observations.csv`. Errors are measured minus true;
/// what is common to the satellites of its epoch is taken out, of carriers also an arc's constant.
#[derive(Clone, Debug, Serialize)]
pub struct ObservationError {
    /// The receiver's label, in seconds after the truth began.
    pub label_s: f64,
    /// The satellite.
    pub sv: String,
    /// Name of the signal.
    pub signal: &'static str,
    /// Elevation of the satellite, degrees.
    pub elevation_deg: f64,
    /// Error of the pseudorange, metres.
    pub code_m: Option<f64>,
    /// Error of the carrier, cycles.
    pub carrier_cycles: Option<f64>,
    /// Error of the Doppler, Hz.
    pub doppler_hz: Option<f64>,
    /// Error of C/N0, dB.
    pub cn0_db: Option<f64>,
    /// Satellite and signal.
    #[serde(skip)]
    pub link: Link,
    /// Time of reception, by the truth's time in seconds after the truth began.
    #[serde(skip)]
    pub at_s: f64,
    /// Values of the file.
    #[serde(skip)]
    pub values: Values,
    /// Values that a receiver with a perfect clock would have observed.
    #[serde(skip)]
    pub truth: State,
}

/// Common errors of an epoch's satellites: a row of `foreign_clock.csv`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ClockRow {
    /// The receiver's label, in seconds after the truth began.
    pub label_s: f64,
    /// Number of satellites.
    pub satellites: usize,
    /// Mean error of the pseudoranges over the speed of light, in seconds: time of the receiver's clock minus
    /// GPS time.
    pub bias_s: f64,
    /// The sampler's clock there.
    pub sampler_bias_s: f64,
}

/// A break of a carrier's count: a row of `foreign_slips.csv`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slip {
    /// The receiver's label, in seconds after the truth began.
    pub label_s: f64,
    /// The satellite.
    pub sv: String,
    /// Size of the slip to the half cycle; `None` where the count was interrupted.
    pub size_cycles: Option<f64>,
    /// True if the file's loss-of-lock indicator declares the slip.
    pub declared: bool,
    /// Satellite and signal.
    #[serde(skip)]
    pub link: Link,
}

/// An unbroken segment of a satellite's carrier.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    /// Satellite and signal.
    pub link: Link,
    /// First and last label, seconds after the truth began.
    pub span_s: (f64, f64),
    /// Number of its carriers.
    pub count: usize,
    /// Slope of the carrier's errors over time, cycles a second.
    pub drift_hz: f64,
    /// Root mean square of the carrier's errors about their line, cycles.
    pub sigma_cycles: f64,
    /// Slope of code minus carrier over time, m/s, the truth's taken out.
    pub code_carrier_mps: Option<f64>,
}

/// Statistics of one satellite's errors: a row of `foreign_satellites.csv`.
#[derive(Clone, Debug, Serialize)]
pub struct Satellite {
    /// The satellite.
    pub sv: String,
    /// Name of the signal.
    pub signal: &'static str,
    /// Epochs in which it was observed.
    pub epochs: usize,
    /// Mean elevation of the satellite, degrees.
    pub elevation_deg: f64,
    /// Mean error of the code, metres.
    pub code_bias_m: Option<f64>,
    /// Standard deviation of the code errors, metres.
    pub code_sigma_m: Option<f64>,
    /// Standard deviation of the carrier errors, cycles.
    pub carrier_sigma_cycles: Option<f64>,
    /// Mean error of the Doppler, Hz.
    pub doppler_bias_hz: Option<f64>,
    /// Standard deviation of the Doppler errors, Hz.
    pub doppler_sigma_hz: Option<f64>,
    /// Mean error of C/N0, dB.
    pub cn0_bias_db: Option<f64>,
    /// Standard deviation of the C/N0 errors, dB.
    pub cn0_sigma_db: Option<f64>,
    /// Code minus carrier, against that of the truth.
    pub code_carrier_drift_mps: Option<f64>,
    /// Number of cycle slips.
    pub slips: usize,
}

/// Everything measured.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Epochs of the file.
    pub epochs: usize,
    /// Interval of them by its header, seconds.
    pub stated_interval_s: Option<f64>,
    /// Epochs that the truth has.
    pub joined: usize,
    /// Observations that the truth has.
    pub observations: usize,
    /// Number of observations whose satellite or time is not in the truth.
    pub unmatched: usize,
    /// Epochs and observations less than a row of the truth before its beginning or after its end.
    pub at_edge: (usize, usize),
    /// Observations left out as of a wrong lock.
    pub outliers: usize,
    /// Distance from the others of their epoch and signal from which on they are, metres.
    pub outlier_limit_m: f64,
    /// Delay of the time labels, seconds.
    pub time_tag_s: Option<Estimate>,
    /// True if the delay was significant, so that the truth was taken at the corrected times.
    pub time_tag_applied: bool,
    /// Every observation.
    pub rows: Vec<ObservationError>,
    /// Every epoch.
    pub clock: Vec<ClockRow>,
    /// Every break of a carrier.
    pub slips: Vec<Slip>,
    /// Every unbroken segment of a carrier with more than two epochs.
    pub arcs: Vec<Arc>,
    /// Every satellite.
    pub satellites: Vec<Satellite>,
    /// Root mean square of the code errors, metres.
    pub code_rms_m: Option<f64>,
    /// Standard deviation of the code errors, metres.
    pub code_sigma_m: Option<f64>,
    /// +1 where carriers grow with range, −1 where they fall.
    pub carrier_sign: Option<f64>,
    /// Root mean square of the carrier errors, cycles.
    pub carrier_rms_cycles: Option<f64>,
    /// Slope of measured over true Doppler; 1 is right.
    pub doppler_scale: Option<Estimate>,
    /// Root mean square of the Doppler errors, Hz.
    pub doppler_rms_hz: Option<f64>,
    /// Mean error of C/N0 against that in the samples, dB.
    pub cn0_db: Option<Estimate>,
    /// Decibels that filter, converter and edges between samples take of each observed signal's C/N0.
    pub front_end_costs_db: BTreeMap<&'static Signal, f64>,
    /// Drift of the receiver's clock by its code, seconds a second.
    pub drift_code: Option<f64>,
    /// Drift of the receiver's clock by its carrier, seconds a second.
    pub drift_carrier: Option<f64>,
    /// Drift of the receiver's clock by its Doppler, seconds a second.
    pub drift_doppler: Option<f64>,
    /// Rate of code minus carrier beside that of the truth, m/s.
    pub code_carrier_mps: Option<Estimate>,
    /// Doppler minus the carrier's own rate, Hz.
    pub doppler_carrier_hz: Option<Estimate>,
}

impl Measured {
    /// −1 where the receiver's Doppler has the opposite sign of the truth's.
    pub(in crate::judge) fn doppler_sign(&self) -> f64 {
        if self.doppler_scale.is_some_and(|scale| scale.value < 0.0) { -1.0 } else { 1.0 }
    }
}
