//! Settings of the detectors of jamming and spoofing.
//!
//! The table `[detection]` turns detectors on; without it nothing is tested.

use serde::{Deserialize, Serialize};

use crate::described::described;

described! {
/// Choices of the detectors of jamming and spoofing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DetectionSettings {
    /// Probability that one test of a detector raises an alarm while nobody interferes.
    pub false_alarm: f64,
    /// Time of one test. Rows of `detection.csv` are so far apart.
    pub interval_s: f64,
    /// Time before a test with which it compares: levels, correlations and ranges are held against what they
    /// were. Intervals with an alarm do not become a part of it. At least five intervals.
    pub reference_s: f64,
}
}

impl Default for DetectionSettings {
    fn default() -> Self {
        Self { false_alarm: 1e-3, interval_s: 1.0, reference_s: 20.0 }
    }
}

/// Fewest intervals of a reference.
const LEAST_INTERVALS: usize = 5;

impl DetectionSettings {
    /// Each number with the smallest and the largest value that it may have.
    pub fn ranges(&self) -> [(&'static str, f64, f64, f64); 3] {
        [
            ("detection.false_alarm", self.false_alarm, 1e-9, 0.5),
            ("detection.interval_s", self.interval_s, 0.25, 60.0),
            ("detection.reference_s", self.reference_s, 1.0, 3600.0),
        ]
    }

    /// Intervals of the reference.
    pub fn intervals(&self) -> usize {
        ((self.reference_s / self.interval_s).round() as usize).max(LEAST_INTERVALS)
    }
}
