//! Settings of the protection levels: method, promise, what is stated of faults, and limits of an operation.

use serde::{Deserialize, Serialize};

use crate::described::described;

/// Method of the protection levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Multiple hypotheses and separations of their solutions.
    Araim,
    /// Bounds that an SBAS sends.
    Sbas,
    /// The residual test.
    Raim,
}

impl Method {
    /// Name as settings and tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Araim => "araim",
            Self::Sbas => "sbas",
            Self::Raim => "raim",
        }
    }
}

/// Kind of operation that SBAS levels are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Operation {
    /// Approach with vertical guidance.
    Approach,
    /// En route to non-precision approach: no vertical level.
    EnRoute,
}

described! {
/// Choices of the protection levels. The defaults are those of LPV-200.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IntegritySettings {
    /// Method. araim: multiple hypotheses, for faults of satellites and constellations. sbas: bounds that an
    /// SBAS sends; all satellites of the fix need its corrections, and the ionosphere its grid. raim: slopes
    /// of the residual test, for a fault of one satellite.
    pub method: Method,
    /// Operation of method sbas. approach: horizontal factor 6.0 and a vertical level. en_route: horizontal
    /// factor 6.18 and no vertical level.
    pub operation: Operation,
    /// Standard deviation of a satellite's orbit and clock errors that bounds them for integrity (σ_URA).
    pub sigma_ura_m: f64,
    /// Standard deviation of a satellite's orbit and clock errors for accuracy and continuity (σ_URE).
    pub sigma_ure_m: f64,
    /// Largest bias of a range without a fault (b_nom).
    pub b_nom_m: f64,
    /// Probability that a satellite is faulty (P_sat). 0: satellites have no faults.
    pub p_sat: f64,
    /// Probability that a whole constellation is faulty (P_const). A receiver of one constellation has no
    /// test for it, and has levels only where this is far below phmi_vertical, such as 1e-8.
    pub p_const: f64,
    /// Probability of a vertical error beyond its level. Method sbas has its own, 1e-7.
    pub phmi_vertical: f64,
    /// Probability of a horizontal error beyond its level. Method sbas has its own, 2e-9 (approach).
    pub phmi_horizontal: f64,
    /// Probability that a vertical test of method araim raises a false alarm.
    pub false_alarm_vertical: f64,
    /// Probability that a horizontal test of method araim raises a false alarm.
    pub false_alarm_horizontal: f64,
    /// Largest probability of faults that method araim does not monitor (P_THRES).
    pub p_threshold: f64,
    /// Smallest probability of faults that the effective monitor threshold has (P_EMT).
    pub p_emt: f64,
    /// Probability that method raim misses a fault whose error is beyond the level.
    pub missed_detection: f64,
    /// Horizontal alert limit: a fix with a larger level is not available.
    pub hal_m: f64,
    /// Vertical alert limit: a fix with a larger level is not available.
    pub val_m: f64,
    /// Largest effective monitor threshold of an available fix.
    pub emt_limit_m: f64,
    /// Largest vertical standard deviation, for accuracy, of an available fix.
    pub sigma_v_acc_limit_m: f64,
}
}

impl Default for IntegritySettings {
    fn default() -> Self {
        Self {
            method: Method::Araim,
            operation: Operation::Approach,
            sigma_ura_m: 1.0,
            sigma_ure_m: 0.67,
            b_nom_m: 0.75,
            p_sat: 1e-5,
            p_const: 1e-4,
            phmi_vertical: 9.8e-8,
            phmi_horizontal: 2e-9,
            false_alarm_vertical: 3.9e-6,
            false_alarm_horizontal: 9e-8,
            p_threshold: 8e-8,
            p_emt: 1e-5,
            missed_detection: 1e-3,
            hal_m: 40.0,
            val_m: 35.0,
            emt_limit_m: 15.0,
            sigma_v_acc_limit_m: 1.87,
        }
    }
}

impl IntegritySettings {
    /// Each number with the smallest and the largest value that it may have.
    pub fn ranges(&self) -> [(&'static str, f64, f64, f64); 16] {
        [
            ("integrity.sigma_ura_m", self.sigma_ura_m, 0.0, 1000.0),
            ("integrity.sigma_ure_m", self.sigma_ure_m, 0.0, 1000.0),
            ("integrity.b_nom_m", self.b_nom_m, 0.0, 1000.0),
            ("integrity.p_sat", self.p_sat, 0.0, 0.01),
            ("integrity.p_const", self.p_const, 0.0, 0.01),
            ("integrity.phmi_vertical", self.phmi_vertical, 1e-15, 0.1),
            ("integrity.phmi_horizontal", self.phmi_horizontal, 1e-15, 0.1),
            ("integrity.false_alarm_vertical", self.false_alarm_vertical, 1e-15, 0.5),
            ("integrity.false_alarm_horizontal", self.false_alarm_horizontal, 1e-15, 0.5),
            ("integrity.p_threshold", self.p_threshold, 1e-18, 0.1),
            ("integrity.p_emt", self.p_emt, 0.0, 1.0),
            ("integrity.missed_detection", self.missed_detection, 1e-12, 0.5),
            ("integrity.hal_m", self.hal_m, 0.1, 1e6),
            ("integrity.val_m", self.val_m, 0.1, 1e6),
            ("integrity.emt_limit_m", self.emt_limit_m, 0.1, 1e6),
            ("integrity.sigma_v_acc_limit_m", self.sigma_v_acc_limit_m, 0.01, 1e6),
        ]
    }
}
