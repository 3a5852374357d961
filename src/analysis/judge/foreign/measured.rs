//! What is measured of a foreign receiver's observables: rows of its tables, and their figures.

use serde::Serialize;

use super::fit::Estimate;
use crate::gnss::signal::Link;

/// One observation against the truth: a row of `foreign_observations.csv`. Errors are measured minus true;
/// what is common to the satellites of its epoch is taken out, of carriers also an arc's constant.
#[derive(Clone, Debug, Serialize)]
pub struct ObservationError {
    pub label_s: f64,
    pub sv: String,
    pub signal: &'static str,
    pub elevation_deg: f64,
    pub code_m: Option<f64>,
    pub carrier_cycles: Option<f64>,
    pub doppler_hz: Option<f64>,
    pub cn0_db: Option<f64>,
    #[serde(skip)]
    pub link: Link,
}

/// What an epoch's satellites have in common: a row of `foreign_clock.csv`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ClockRow {
    pub label_s: f64,
    pub satellites: usize,
    /// Mean error of the pseudoranges over the speed of light: reading of the receiver's clock minus GPS time.
    pub bias_s: f64,
    /// The sampler's clock there.
    pub sampler_bias_s: f64,
}

/// A break of a carrier's count: a row of `foreign_slips.csv`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slip {
    pub label_s: f64,
    pub sv: String,
    /// To the half cycle; unknown where the count was interrupted.
    pub size_cycles: Option<f64>,
    /// By the file's loss-of-lock indicator.
    pub declared: bool,
}

/// What one satellite's errors come to: a row of `foreign_satellites.csv`.
#[derive(Clone, Debug, Serialize)]
pub struct Satellite {
    pub sv: String,
    pub signal: &'static str,
    pub epochs: usize,
    pub elevation_deg: f64,
    pub code_bias_m: Option<f64>,
    pub code_sigma_m: Option<f64>,
    pub carrier_sigma_cycles: Option<f64>,
    pub doppler_bias_hz: Option<f64>,
    pub doppler_sigma_hz: Option<f64>,
    pub cn0_bias_db: Option<f64>,
    pub cn0_sigma_db: Option<f64>,
    /// Code minus carrier, against that of the truth.
    pub code_carrier_drift_mps: Option<f64>,
    pub slips: usize,
}

/// Everything measured.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    pub epochs: usize,
    pub joined: usize,
    pub observations: usize,
    /// Of satellites or times that the truth does not have.
    pub unmatched: usize,
    pub outliers: usize,
    pub time_tag_s: Option<Estimate>,
    /// Whether it was significant, so that the truth was taken at the corrected times.
    pub time_tag_applied: bool,
    pub rows: Vec<ObservationError>,
    pub clock: Vec<ClockRow>,
    pub slips: Vec<Slip>,
    pub satellites: Vec<Satellite>,
    pub code_rms_m: Option<f64>,
    pub code_sigma_m: Option<f64>,
    pub carrier_sign: Option<f64>,
    pub carrier_rms_cycles: Option<f64>,
    pub doppler_scale: Option<Estimate>,
    pub doppler_rms_hz: Option<f64>,
    pub cn0_db: Option<Estimate>,
    pub drift_code: Option<f64>,
    pub drift_carrier: Option<f64>,
    pub drift_doppler: Option<f64>,
    pub code_carrier_mps: Option<Estimate>,
    pub doppler_carrier_hz: Option<Estimate>,
}

impl Measured {
    /// −1 where the receiver's Doppler has the opposite sign of the truth's.
    pub(super) fn doppler_sign(&self) -> f64 {
        if self.doppler_scale.is_some_and(|scale| scale.value < 0.0) { -1.0 } else { 1.0 }
    }
}
