//! All that is known of a foreign receiver after its files were read and joined.

use super::measured::Measured;
use super::place::Places;
use crate::expect::timeline;

/// Everything that a foreign receiver's pictures and summary are made from.
pub struct Judged {
    /// The scene's name.
    pub scene: String,
    /// The receiver's name by its own file.
    pub receiver: Option<String>,
    /// Time between the truth's rows, seconds.
    pub truth_interval_s: f64,
    /// Largest errors of interpolation between the truth's rows.
    pub interpolation: timeline::Interpolation,
    /// Rate of the sampler's clock, seconds a second.
    pub sampler_drift: f64,
    /// Seconds, a multiple of 1024 weeks, that observations and positions were ahead.
    pub rollover_s: [i64; 2],
    /// Observations, where there is a file of them.
    pub observables: Option<Measured>,
    /// Positions, where there is a file of them.
    pub places: Option<Places>,
    /// Whole seconds that positions' labels must be earlier for more of them to join: GPS time in place of
    /// UTC.
    pub labels_late_s: Option<i64>,
    /// Positions whose file names no geoid separation, so that EGM96's was added to their altitude.
    pub separations_assumed: usize,
}
