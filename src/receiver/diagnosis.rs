//! Why there was no fix, by the stage at which the chain broke, and what to check.

use std::fmt;

use crate::gnss::satellite::Sv;
use crate::receiver::position::NoFix;

/// A cold start needs this much signal: one whole frame of 30 s and up to one subframe before it.
pub const SHORTEST_S: f64 = 36.0;

/// The first stage that failed.
#[derive(Clone, Debug, PartialEq)]
pub enum Stage {
    /// There were not enough samples for a search.
    NothingSearched { samples: u64, needed: u64 },
    /// No satellite passed the threshold; the one that came nearest.
    NothingAcquired { strongest: Option<(Sv, f64, f64)> },
    /// Satellites were acquired, but no symbols came out of them.
    NoSymbols { acquired: Vec<Sv> },
    /// Symbols came, but no frame was found in them.
    NoFrame { with_symbols: Vec<Sv> },
    /// Too few satellites have an ephemeris: of each with a frame, the subframes that are missing.
    NoEphemeris { complete: Vec<Sv>, missing: Vec<(Sv, Vec<u8>)> },
    /// Enough ephemerides, but no position.
    NoPosition { with_ephemeris: Vec<Sv>, reason: Option<NoFix> },
}

/// Why there was no fix.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    pub stage: Stage,
    /// Length of the recording.
    pub seconds: f64,
    /// What to check, most likely first.
    pub advice: Vec<String>,
}

impl Diagnosis {
    /// A diagnosis of a recording of `seconds` at `rate_hz` in `format`, whose carrier appears at `if_hz`.
    pub fn new(stage: Stage, seconds: f64, rate_hz: f64, format: &str, if_hz: f64, cut_bytes: usize) -> Self {
        let mut advice = Vec::new();
        let mut say = |text: String| advice.push(text);
        if cut_bytes > 0 {
            say(format!(
                "the recording ends within a sample ({cut_bytes} bytes are left over): is the format {format}?"
            ));
        }
        match &stage {
            Stage::NothingSearched { .. } => say("the length: the recording is too short even to search".into()),
            Stage::NothingAcquired { .. } => {
                say(format!("the sample rate: {rate_hz} Hz was taken"));
                say(format!("the format: {format} was taken"));
                say(format!(
                    "the intermediate frequency: the carrier was looked for at {if_hz} Hz (and whether the spectrum is inverted)"
                ));
                say("the local oscillator: an offset beyond acquisition.doppler_max_hz hides every satellite".into());
                say("the antenna: is there any signal?".into());
            }
            Stage::NoSymbols { .. } => {
                say(format!("the length: symbols need a second or two, there are {seconds:.1} s"));
                say(format!("the sample rate: {rate_hz} Hz was taken; a small error shows here first"));
                say("the signal's strength: below 25 dB-Hz symbols are not to be told".into());
            }
            Stage::NoFrame { .. } | Stage::NoEphemeris { .. } => {
                if seconds < SHORTEST_S {
                    say(format!("the length: a cold start needs {SHORTEST_S} s, there are {seconds:.1} s"));
                }
                say("the signal's strength: below 27 dB-Hz words are lost to wrong bits".into());
            }
            Stage::NoPosition { .. } => {
                say("the sky: at least four healthy satellites above position.mask_deg in different directions".into());
                say("the satellites' agreement: a spoofed or replayed signal contradicts the others".into());
            }
        }
        Self { stage, seconds, advice }
    }
}

fn names(svs: &[Sv]) -> String {
    if svs.is_empty() { "none".to_owned() } else { svs.iter().map(Sv::to_string).collect::<Vec<_>>().join(" ") }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingSearched { samples, needed } => {
                write!(f, "nothing was searched: {samples} samples, the search needs {needed}")
            }
            Self::NothingAcquired { strongest: Some((sv, statistic, threshold)) } => write!(
                f,
                "no satellite was acquired: the strongest peak, of {sv}, is {statistic:.1} against a threshold of {threshold:.1}"
            ),
            Self::NothingAcquired { strongest: None } => {
                write!(f, "no satellite was acquired: no known signal lies within the recorded band")
            }
            Self::NoSymbols { acquired } => write!(f, "no message symbols: acquired {}", names(acquired)),
            Self::NoFrame { with_symbols } => {
                write!(f, "no frame was found in the symbols of {}", names(with_symbols))
            }
            Self::NoEphemeris { complete, missing } => {
                write!(f, "fewer than four satellites with ephemeris: {}", names(complete))?;
                for (sv, subframes) in missing {
                    let list = subframes.iter().map(u8::to_string).collect::<Vec<_>>().join(", ");
                    write!(f, "; {sv} lacks subframe {list}")?;
                }
                Ok(())
            }
            Self::NoPosition { with_ephemeris, reason } => {
                write!(f, "no position from {}", names(with_ephemeris))?;
                reason.as_ref().map_or(Ok(()), |reason| write!(f, ": {reason}"))
            }
        }
    }
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "no fix in {:.1} s: {}", self.seconds, self.stage)?;
        write!(f, "check")?;
        for advice in &self.advice {
            write!(f, "\n  {advice}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagnosis_names_the_stage_the_numbers_and_what_to_check() {
        let strongest = Some((Sv::gps(7), 41.25, 78.0));
        let stage = Stage::NothingAcquired { strongest };
        let text = Diagnosis::new(stage, 2.0, 2.6e6, "ci8", 0.0, 1).to_string();
        for part in ["G07", "41.2", "78.0", "2600000", "ci8", "intermediate frequency", "within a sample"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let stage = Stage::NoEphemeris { complete: vec![Sv::gps(1)], missing: vec![(Sv::gps(9), vec![2, 3])] };
        let text = Diagnosis::new(stage, 20.0, 2.6e6, "ci8", 0.0, 0).to_string();
        assert!(text.contains("G09 lacks subframe 2, 3") && text.contains("36"), "{text}");
    }
}
