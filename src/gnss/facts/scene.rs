//! Content of `truth/scene.json`: the facts of a scene, which the generator writes and the judge reads.

use serde::{Deserialize, Serialize};

use super::{ArrayFacts, Edge, Expect, Fault, InertialFacts, Interference, OsnmaFacts, StageSpec, TimeOffset};
use crate::satellite::Sv;
use crate::signal::Layers;

/// Facts of a scene. A key that a file lacks has a default: a scene without that feature.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneFacts {
    /// The scene's name.
    pub name: String,
    /// Name of the front end, where it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front_end_name: Option<String>,
    /// Seed of every random number.
    pub seed: u64,
    /// Time of the first sample by the receiver's clock, as text of GPS time.
    #[serde(default)]
    pub start: String,
    /// First sample of the generated part by the scene's count, if only a part of the scene was generated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_sample: Option<u64>,
    /// Length of the samples, seconds.
    pub duration_s: f64,
    /// Number of samples.
    #[serde(default)]
    pub samples: u64,
    /// Samples per second, Hz.
    pub sample_rate_hz: f64,
    /// Radio frequency that lies at 0 in the samples, Hz.
    #[serde(default)]
    pub center_hz: Option<f64>,
    /// True if the samples' spectrum is mirrored about `center_hz`.
    #[serde(default)]
    pub inverted: bool,
    /// SigMF name of the sample format.
    #[serde(default)]
    pub format: String,
    /// Level of fidelity, by name.
    #[serde(default)]
    pub fidelity: String,
    /// Placement of chip edges between samples.
    #[serde(default)]
    pub code_edge: Edge,
    /// Cut-off (−6 dB) of band-limited edges, cycles per sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_cutoff_cps: Option<f64>,
    /// Layers that are transmitted of waveforms with several layers.
    #[serde(default, skip_serializing_if = "is_whole")]
    pub waveform: Layers,
    /// Arithmetic of the carrier, by name.
    #[serde(default)]
    pub carrier: String,
    /// Largest error of a carrier between knots, cycles.
    #[serde(default)]
    pub knot_tolerance_cycles: f64,
    /// Elevation below which no satellite is received, degrees.
    #[serde(default)]
    pub mask_deg: Option<f64>,
    /// Time between the rows of the truth, seconds.
    #[serde(default)]
    pub truth_interval_s: f64,
    /// Names of the signals.
    #[serde(default)]
    pub signals: Vec<String>,
    /// Texts that describe those of the signals that are not built in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub described_signals: Vec<String>,
    /// True if thermal noise was added.
    #[serde(default = "yes")]
    pub noise: bool,
    /// Arithmetic of the noise, by name.
    #[serde(default)]
    pub noise_arithmetic: String,
    /// Standard deviation of the thermal noise per component, in LSB. It defines the gain, also for a scene
    /// without noise.
    #[serde(default)]
    pub noise_lsb: Option<f64>,
    /// Stages of the front end, in order; of the first front end if there are several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub front_end: Vec<StageSpec>,
    /// Azimuth and elevation in degrees below which the direct path is obstructed at the start.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub skyline_deg: Vec<[f64; 2]>,
    /// The receiver's oscillator, if the scene has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub oscillator: Option<OscillatorFacts>,
    /// Facts of each front end, if there are several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub front_ends: Vec<FrontEndFacts>,
    /// The array whose elements the front ends are, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub array: Option<ArrayFacts>,
    /// Inertial sensors on the body, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imu: Option<InertialFacts>,
    /// Waveforms of the sources of interference, in the order of their numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub interference: Vec<Interference>,
    /// Each spoofer in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spoofers: Vec<String>,
    /// Deviation of the true orbits from the broadcast ones, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orbits: Option<String>,
    /// Faults of satellites, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub satellite_faults: Vec<String>,
    /// Faults of messages, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub message_faults: Vec<String>,
    /// Both kinds of faults again, for the judge.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// Expectations that the scene declares for a receiver.
    #[serde(default, skip_serializing_if = "Expect::is_empty")]
    pub expect: Expect,
    /// Time scales of systems that differ from GPS time by more than whole seconds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub time_offsets: Vec<TimeOffset>,
    /// Times at which satellites begin to send another ephemeris, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub renewals: Vec<Renewal>,
    /// Authentication of Galileo's messages, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub osnma: Option<OsnmaFacts>,
}

impl SceneFacts {
    /// Offset of a system's time ahead of GPS time, in seconds, without the whole seconds between both.
    pub fn ahead_s(&self, scale: &str) -> f64 {
        self.time_offsets.iter().find(|offset| offset.time_scale == scale).map_or(0.0, |offset| offset.ahead_s)
    }

    /// Stages and sample rate in Hz of a front end by its index among several.
    pub fn stages(&self, front_end: usize) -> (&[StageSpec], f64) {
        match self.front_ends.get(front_end) {
            Some(own) => (&own.front_end, own.sample_rate_hz),
            None => (&self.front_end, self.sample_rate_hz),
        }
    }

    /// The converter, if there is one.
    pub fn converter(&self) -> Option<&super::ConverterSpec> {
        super::converter(&self.front_end)
    }

    /// The filters, in order.
    pub fn filters(&self) -> impl Iterator<Item = &super::FilterSpec> {
        super::filters(&self.front_end)
    }

    /// The quadratures' balance, if it is stated.
    pub fn balance(&self) -> Option<&super::BalanceSpec> {
        self.front_end.iter().find_map(|stage| if let StageSpec::Iq(balance) = stage { Some(balance) } else { None })
    }
}

/// Time at which a satellite begins to send another ephemeris.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Renewal {
    /// The satellite.
    pub sv: Sv,
    /// Time from the first sample in seconds, in the time of its system.
    pub at_s: f64,
}

/// Power law of the receiver's oscillator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OscillatorFacts {
    /// Coefficients h₂, h₁, h₀, h₋₁, h₋₂ of S_y = Σ h f^α, in Hz^(−α − 1).
    pub h: [f64; 5],
}

/// Facts of one of several front ends. Keys are as in [`SceneFacts`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FrontEndFacts {
    /// Name of the front end, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Number of samples.
    pub samples: u64,
    /// Samples per second, Hz.
    pub sample_rate_hz: f64,
    /// Radio frequency that lies at 0 in the samples, Hz.
    pub center_hz: f64,
    /// True if the samples' spectrum is mirrored.
    pub inverted: bool,
    /// SigMF name of the sample format.
    pub format: String,
    /// Placement of chip edges between samples.
    pub code_edge: Edge,
    /// Cut-off (−6 dB) of band-limited edges, cycles per sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edge_cutoff_cps: Option<f64>,
    /// Names of the signals.
    pub signals: Vec<String>,
    /// Standard deviation of the thermal noise per component, in LSB.
    pub noise_lsb: f64,
    /// Stages, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub front_end: Vec<StageSpec>,
}

impl FrontEndFacts {
    /// Frequency offset in Hz that the front end's oscillator adds to every Doppler.
    pub fn doppler_hz(&self) -> f64 {
        let offset_hz = super::oscillator_offset_hz(&self.front_end);
        if self.inverted { -offset_hz } else { offset_hz }
    }
}

fn is_whole(waveform: &Layers) -> bool {
    *waveform == Layers::Whole
}

fn yes() -> bool {
    true
}
