//! Front-end stages: their effect on the spectrum and the timing of samples.
//!
//! In `scene.json` each stage is an object whose key `stage` names its kind. A kind that is not known here is
//! refused by name.

use serde::{Deserialize, Serialize};

/// Placement of chip edges between samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// A sample has the value of its instant.
    #[default]
    Nearest,
    /// A sample is the mean over its interval.
    Area,
    /// Filtered to half the sample rate before sampling.
    BandLimited,
}

/// Stage of a front end, in the order in which the signal passes them. Stages that only add power are not
/// listed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "stage", rename_all = "snake_case")]
pub enum StageSpec {
    /// A band-pass filter about the carrier.
    Filter(FilterSpec),
    /// A local oscillator that is off its nominal frequency.
    LocalOscillator {
        /// Frequency offset of carriers in the samples, in Hz, positive upwards.
        offset_hz: f64,
    },
    /// Two mixers that are out of balance.
    Iq(BalanceSpec),
    /// Gain and quantiser.
    Adc(ConverterSpec),
}

/// The filters among stages, in order.
pub fn filters(stages: &[StageSpec]) -> impl Iterator<Item = &FilterSpec> {
    stages.iter().filter_map(|stage| if let StageSpec::Filter(filter) = stage { Some(filter) } else { None })
}

/// The converter among stages, if there is one.
pub fn converter(stages: &[StageSpec]) -> Option<&ConverterSpec> {
    stages.iter().find_map(|stage| if let StageSpec::Adc(converter) = stage { Some(converter) } else { None })
}

/// Sum of the frequency offsets in Hz that oscillators among the stages add to carriers.
pub fn oscillator_offset_hz(stages: &[StageSpec]) -> f64 {
    let offset_hz =
        |stage: &StageSpec| if let StageSpec::LocalOscillator { offset_hz } = stage { *offset_hz } else { 0.0 };
    stages.iter().map(offset_hz).sum()
}

/// A filter's shape, width and delay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilterSpec {
    /// Shape of the filter's response.
    #[serde(flatten)]
    pub shape: FilterShape,
    /// Two-sided bandwidth in Hz: between the −3 dB points of a Butterworth filter, between the −6 dB points
    /// of a brick wall.
    pub bandwidth_hz: f64,
    /// Group delay in the middle of the band, in seconds; all satellites' codes share it.
    pub group_delay_s: f64,
    /// Frequency of the band's middle in the samples, in Hz; absent means that of the first signal's carrier.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub middle_hz: Option<f64>,
}

/// The response of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum FilterShape {
    /// Flat to a steep edge, linear phase.
    BrickWall,
    /// Butterworth's, with the phase of the analogue filter.
    Butterworth {
        /// Poles of the low-pass prototype.
        order: u32,
    },
}

/// Gain and phase imbalance of the quadratures, and direct current.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BalanceSpec {
    /// Power of the mirrored spectrum relative to the spectrum, in dB; absent if the quadratures are
    /// balanced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image_db: Option<f64>,
    /// Power of the line of direct current, LSB².
    #[serde(default)]
    pub dc_power_lsb2: f64,
}

/// A converter with its gain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConverterSpec {
    /// Bits per component of a sample.
    pub bits: u32,
    /// Quantiser step relative to the standard deviation of a component for which the gain is set.
    pub step_sigma: f64,
    /// Standard deviation of a component, in LSB, for which a fixed gain is set.
    pub nominal_lsb: f64,
    /// True if the gain follows the power of the samples.
    pub gain_control: bool,
    /// True if the quantiser's levels are the format's integers.
    pub whole: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text of `scene.json` before there was a typed record, key by key.
    #[test]
    fn stages_are_written_as_they_always_were_and_read_again() {
        let filter = |shape| FilterSpec { shape, bandwidth_hz: 2.4e6, group_delay_s: 3.5e-7, middle_hz: None };
        let converter =
            ConverterSpec { bits: 4, step_sigma: 0.335, nominal_lsb: 28.0, gain_control: true, whole: false };
        for (stage, text) in [
            (
                StageSpec::Filter(filter(FilterShape::Butterworth { order: 4 })),
                r#"{"stage":"filter","shape":"butterworth","order":4,"bandwidth_hz":2400000.0,"group_delay_s":3.5e-7}"#,
            ),
            (
                StageSpec::Filter(filter(FilterShape::BrickWall)),
                r#"{"stage":"filter","shape":"brick_wall","bandwidth_hz":2400000.0,"group_delay_s":3.5e-7}"#,
            ),
            (StageSpec::LocalOscillator { offset_hz: -50.5 }, r#"{"stage":"local_oscillator","offset_hz":-50.5}"#),
            (
                StageSpec::Iq(BalanceSpec { image_db: Some(-31.25), dc_power_lsb2: 2.0 }),
                r#"{"stage":"iq","image_db":-31.25,"dc_power_lsb2":2.0}"#,
            ),
            (StageSpec::Iq(BalanceSpec::default()), r#"{"stage":"iq","dc_power_lsb2":0.0}"#),
            (
                StageSpec::Adc(converter),
                r#"{"stage":"adc","bits":4,"step_sigma":0.335,"nominal_lsb":28.0,"gain_control":true,"whole":false}"#,
            ),
        ] {
            assert_eq!(serde_json::to_string(&stage).unwrap(), text);
            assert_eq!(serde_json::from_str::<StageSpec>(text).unwrap(), stage);
        }
    }

    #[test]
    fn unknown_names_are_refused_by_name() {
        let refused = |error: serde_json::Error| error.to_string();
        let stage = serde_json::from_str::<StageSpec>(r#"{"stage": "fliter"}"#).map_err(refused).unwrap_err();
        assert!(stage.contains("fliter") && stage.contains("local_oscillator"), "{stage}");
        let shape = r#"{"stage": "filter", "shape": "bessel", "bandwidth_hz": 1.0, "group_delay_s": 0.0}"#;
        let shape = serde_json::from_str::<StageSpec>(shape).map_err(refused).unwrap_err();
        assert!(shape.contains("bessel") && shape.contains("butterworth"), "{shape}");
        let edge = serde_json::from_str::<Edge>("\"aera\"").map_err(refused).unwrap_err();
        assert!(edge.contains("aera") && edge.contains("band_limited"), "{edge}");
    }
}
