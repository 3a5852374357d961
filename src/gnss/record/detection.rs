//! Rows of what a receiver's detectors of jamming and spoofing find.

use serde::{Deserialize, Serialize};

/// Detector of jamming or spoofing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Detector {
    /// Power of the samples.
    Level,
    /// Fall of C/N0 that most signals share.
    Cn0Fall,
    /// Early and late together against the prompt.
    CorrelationRatio,
    /// Difference of early and late across the prompt's phase.
    CorrelationPhase,
    /// Difference of early and late along the prompt's phase.
    CorrelationDelta,
    /// Code range less carrier range.
    CodeCarrier,
    /// Residuals of the ranges.
    Raim,
    /// Change of the position against the velocity.
    PositionJump,
    /// Change of the clock's bias against its drift.
    ClockJump,
    /// Directions from which the elements of an array receive the signals.
    Directions,
}

impl Detector {
    /// Every detector, in the order of the tables.
    pub const ALL: [Self; 10] = [
        Self::Level,
        Self::Cn0Fall,
        Self::CorrelationRatio,
        Self::CorrelationPhase,
        Self::CorrelationDelta,
        Self::CodeCarrier,
        Self::Raim,
        Self::PositionJump,
        Self::ClockJump,
        Self::Directions,
    ];

    /// Name as the tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Level => "level",
            Self::Cn0Fall => "cn0_fall",
            Self::CorrelationRatio => "correlation_ratio",
            Self::CorrelationPhase => "correlation_phase",
            Self::CorrelationDelta => "correlation_delta",
            Self::CodeCarrier => "code_carrier",
            Self::Raim => "raim",
            Self::PositionJump => "position_jump",
            Self::ClockJump => "clock_jump",
            Self::Directions => "directions",
        }
    }
}

/// One test of a detector: `rx/detection.csv`, for receivers whose settings ask for detection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectionRow {
    /// Sample at the end of the tested interval.
    pub sample: u64,
    /// The detector.
    pub detector: Detector,
    /// Satellite that was tested; empty for a test of the whole receiver.
    pub sv: String,
    /// Signal of that satellite; of a test of samples, the front end, where there are several.
    pub signal: String,
    /// Statistic of the test.
    pub statistic: f64,
    /// Value that the statistic exceeds with the stated probability of a false alarm.
    pub threshold: f64,
    /// True if the statistic exceeds its threshold.
    pub alarm: bool,
}
