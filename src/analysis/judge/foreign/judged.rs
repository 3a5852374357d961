//! All that is known of a foreign receiver after its files were read and joined.

use super::measured::Measured;
use super::place::Places;
use crate::analysis::expect::timeline;

/// Everything that a foreign receiver's pictures and summary are made from.
pub struct Judged {
    pub scene: String,
    pub receiver: Option<String>,
    pub truth_interval_s: f64,
    pub interpolation: timeline::Interpolation,
    pub sampler_drift: f64,
    /// Seconds, a multiple of 1024 weeks, that observations and positions were ahead.
    pub rollover_s: [i64; 2],
    pub observables: Option<Measured>,
    pub places: Option<Places>,
    /// Whole seconds that positions' labels must be earlier for more of them to join: GPS time in place of UTC.
    pub labels_late_s: Option<i64>,
}
