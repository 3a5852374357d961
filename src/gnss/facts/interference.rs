//! Waveforms of interference, with the parameters that determine their spectra.
//!
//! In `scene.json` each source is an object whose key `kind` names its waveform. A kind that is not known
//! here is refused by name.

use serde::{Deserialize, Serialize};

/// The waveform of a source.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Interference {
    /// A carrier alone.
    Cw,
    /// A frequency that runs across a band and jumps back.
    Chirp {
        /// Width of the sweep from end to end, in Hz; negative where the frequency falls.
        width_hz: f64,
        /// Sweeps a second.
        repetition_hz: f64,
    },
    /// A frequency that runs back and forth.
    Fmcw {
        /// Width of the sweep from end to end, in Hz.
        width_hz: f64,
        /// Rate of complete sweeps up and down, in Hz.
        repetition_hz: f64,
    },
    /// A frequency that follows a cosine.
    SineFm {
        /// Largest distance from the middle, Hz.
        deviation_hz: f64,
        /// Periods of the cosine a second.
        repetition_hz: f64,
    },
    /// A carrier in pulses.
    Pulse {
        /// Pulses a second.
        repetition_hz: f64,
        /// Share of a period in which it is on, 0 to 1.
        duty: f64,
        /// Largest random delay of a pulse, as a fraction of the period, 0 to 1.
        jitter: f64,
    },
    /// Random chips.
    Matched {
        /// Chips per second.
        repetition_hz: f64,
    },
    /// Gaussian noise of a flat band.
    Noise {
        /// Both sides together, Hz.
        width_hz: f64,
    },
    /// Recorded samples, taken to fill the band of their rate evenly.
    Recording {
        /// Rate of the recorded samples, Hz.
        width_hz: f64,
    },
}

impl Interference {
    /// Rate at which a sweep repeats, in Hz; `None` for any other waveform.
    pub fn sweeps_hz(&self) -> Option<f64> {
        match *self {
            Self::Chirp { repetition_hz, .. }
            | Self::Fmcw { repetition_hz, .. }
            | Self::SineFm { repetition_hz, .. } => Some(repetition_hz),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text of `scene.json` before there was a typed record, key by key.
    #[test]
    fn waveforms_are_written_as_they_always_were_and_unknown_ones_are_refused_by_name() {
        for (waveform, text) in [
            (Interference::Cw, r#"{"kind":"cw"}"#),
            (
                Interference::Chirp { width_hz: 2e6, repetition_hz: 1e4 },
                r#"{"kind":"chirp","width_hz":2000000.0,"repetition_hz":10000.0}"#,
            ),
            (
                Interference::SineFm { deviation_hz: 5e4, repetition_hz: 10.0 },
                r#"{"kind":"sine_fm","deviation_hz":50000.0,"repetition_hz":10.0}"#,
            ),
            (
                Interference::Pulse { repetition_hz: 1e3, duty: 0.1, jitter: 0.0 },
                r#"{"kind":"pulse","repetition_hz":1000.0,"duty":0.1,"jitter":0.0}"#,
            ),
            (Interference::Matched { repetition_hz: 1.023e6 }, r#"{"kind":"matched","repetition_hz":1023000.0}"#),
            (Interference::Noise { width_hz: 1e6 }, r#"{"kind":"noise","width_hz":1000000.0}"#),
        ] {
            assert_eq!(serde_json::to_string(&waveform).unwrap(), text);
            assert_eq!(serde_json::from_str::<Interference>(text).unwrap(), waveform);
        }
        let refused = serde_json::from_str::<Interference>(r#"{"kind": "chrip"}"#).unwrap_err().to_string();
        assert!(refused.contains("chrip") && refused.contains("sine_fm"), "{refused}");
    }
}
