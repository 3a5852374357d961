//! What `truth/scene.json` says of a scene; other keys are left alone.

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::analysis::waveform::Edge;
use crate::gnss::facts::{Expect, Fault, TimeOffset};

/// The facts of a scene.
#[derive(Clone, Debug, Deserialize)]
pub struct SceneFacts {
    pub name: String,
    pub seed: u64,
    pub duration_s: f64,
    pub sample_rate_hz: f64,
    #[serde(default)]
    pub center_hz: Option<f64>,
    /// Whether the samples' spectrum is mirrored about `center_hz`.
    #[serde(default)]
    pub inverted: bool,
    /// SigMF name of the sample format.
    #[serde(default)]
    pub format: String,
    #[serde(default)]
    pub code_edge: Edge,
    #[serde(default)]
    pub mask_deg: Option<f64>,
    /// Whether thermal noise was added.
    #[serde(default = "yes")]
    pub noise: bool,
    #[serde(default)]
    pub fidelity: String,
    /// Azimuth and elevation in degrees below which the direct path is obstructed at the start.
    #[serde(default)]
    pub skyline_deg: Vec<[f64; 2]>,
    /// Shapes of the sources of interference, in the order of their numbers.
    #[serde(default)]
    pub interference: Vec<Interference>,
    /// Standard deviation of the thermal noise per component, in LSB: the gain, also of a scene without noise.
    #[serde(default)]
    pub noise_lsb: Option<f64>,
    /// Stages of the front end, in order.
    #[serde(default)]
    pub front_end: Vec<Stage>,
    /// Where there are several front ends, each of them.
    #[serde(default)]
    pub front_ends: Vec<IgnoredAny>,
    /// The receiver's oscillator, if the scene has one.
    #[serde(default)]
    pub oscillator: Option<Oscillator>,
    /// What the scene expects of a receiver, and what is wrong with its satellites.
    #[serde(default)]
    pub expect: Expect,
    #[serde(default)]
    pub faults: Vec<Fault>,
    /// Systems' times that are off GPS time by more than whole seconds.
    #[serde(default)]
    pub time_offsets: Vec<TimeOffset>,
}

impl SceneFacts {
    /// By how much a system's time is ahead of GPS time, whole seconds apart.
    pub fn ahead_s(&self, scale: &str) -> f64 {
        self.time_offsets.iter().find(|offset| offset.time_scale == scale).map_or(0.0, |offset| offset.ahead_s)
    }
}

/// Noise of an oscillator; other keys are left alone.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Oscillator {
    /// Strengths h₂, h₁, h₀, h₋₁, h₋₂ of S_y = Σ h f^α, in Hz^(−α − 1).
    pub h: [f64; 5],
}

/// The waveform of a source of interference.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Interference {
    pub kind: String,
    #[serde(default)]
    pub width_hz: Option<f64>,
    #[serde(default)]
    pub deviation_hz: Option<f64>,
    #[serde(default)]
    pub repetition_hz: Option<f64>,
    #[serde(default)]
    pub duty: Option<f64>,
    #[serde(default)]
    pub jitter: Option<f64>,
}

/// A stage of the front end.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Stage {
    pub stage: String,
    pub shape: Option<String>,
    pub order: Option<u32>,
    pub bandwidth_hz: Option<f64>,
    /// Delay that every satellite's code has in common.
    pub group_delay_s: Option<f64>,
    /// By how much carriers lie higher in the samples.
    pub offset_hz: Option<f64>,
    pub image_db: Option<f64>,
    pub dc_power_lsb2: Option<f64>,
    pub bits: Option<u32>,
    /// Step over the deviation of a component for which the gain is made.
    pub step_sigma: Option<f64>,
    pub nominal_lsb: Option<f64>,
    pub gain_control: Option<bool>,
    /// Whether levels are the format's integers.
    pub whole: Option<bool>,
}

fn yes() -> bool {
    true
}
