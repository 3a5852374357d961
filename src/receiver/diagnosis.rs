//! Diagnosis of a reception without a fix: the stage at which the chain broke, and checks to make.

use std::fmt;

use crate::position::NoFix;
use crate::position::least_squares::UNKNOWNS;
use gnss::satellite::Sv;
use gnss::signal::Signal;

/// Symbols come a second or two after the start: of a strong signal, whose edges or secondary code are found
/// then.
const SYMBOLS_S: f64 = 2.0;
/// Advice for symbols that make no frame.
const TOO_WEAK: &str = "the signal's strength: below 27 dB-Hz words are lost to wrong bits";
/// Minutes between transmissions of one page of subframes 4 and 5 (IS-GPS-200N, 20.3.3.5).
const PAGE_EVERY_MIN: f64 = 12.5;

/// The first stage that failed.
#[derive(Clone, Debug, PartialEq)]
pub enum Stage {
    /// Search that did not happen, because there were not enough samples.
    NothingSearched {
        /// Samples that there were.
        samples: u64,
        /// Samples that a search asks for.
        needed: u64,
    },
    /// No satellite passed the threshold; the one that came nearest.
    NothingAcquired {
        /// Satellite, its statistic, and the threshold that it missed.
        strongest: Option<(Sv, f64, f64)>,
    },
    /// Satellites were acquired, but no symbols came out of them.
    NoSymbols {
        /// Satellites that were found.
        acquired: Vec<Sv>,
    },
    /// Symbols came, but no frame was found in them.
    NoFrame {
        /// Satellites whose symbols came.
        with_symbols: Vec<Sv>,
    },
    /// Frames came whose checks were right, and none was used.
    Refused {
        /// Refusals, with their reasons.
        refused: Vec<Refusal>,
    },
    /// Too few satellites have an ephemeris: of each with a frame, the subframes that are missing.
    NoEphemeris {
        /// Satellites with a whole ephemeris.
        complete: Vec<Sv>,
        /// Parts that are missing of the others.
        missing: Vec<(Sv, Vec<u8>)>,
    },
    /// Enough ephemerides, but no position.
    NoPosition {
        /// Satellites with an ephemeris.
        with_ephemeris: Vec<Sv>,
        /// Reason of the last attempt's failure.
        reason: Option<NoFix>,
    },
}

/// Units of messages that passed their checks and were not used.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Reason of the refusal.
    pub why: String,
    /// Satellites that sent them.
    pub svs: Vec<Sv>,
    /// Number of the refused units.
    pub units: u64,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { why, svs, units } = self;
        let (unit, was) = if *units == 1 { ("unit", "was") } else { ("units", "were") };
        write!(f, "the message of {}: {units} {unit} with right checks {was} refused: {why}", names(svs))
    }
}

/// Diagnosis of a reception without a fix.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// Stage at which the processing chain broke.
    pub stage: Stage,
    /// Length of the recording.
    pub seconds: f64,
    /// Checks to make, the most likely cause first.
    pub advice: Vec<String>,
}

impl Diagnosis {
    /// A diagnosis of a recording of `seconds` at `rate_hz` in `format`, whose carrier appears at `if_hz`,
    /// and in which `acquired` satellites were found.
    pub fn new(
        stage: Stage,
        seconds: f64,
        rate_hz: f64,
        format: &str,
        if_hz: f64,
        cut_bytes: usize,
        acquired: usize,
    ) -> Self {
        let mut advice = Vec::new();
        let mut say = |text: String| advice.push(text);
        if cut_bytes > 0 {
            say(format!(
                "the recording ends within a sample ({cut_bytes} bytes are left over): is the format {format}?"
            ));
        }
        let length = duration(seconds);
        let few = acquired < UNKNOWNS;
        if few && matches!(stage, Stage::NoSymbols { .. } | Stage::NoFrame { .. } | Stage::NoEphemeris { .. }) {
            say(format!(
                "the number of satellites: a position needs {UNKNOWNS}, there are {acquired}, and one that barely \
                 passes the threshold may be false: are {rate_hz} Hz, {format}, the carrier at {if_hz} Hz and the \
                 sense of the spectrum right?"
            ));
        }
        match &stage {
            Stage::NothingSearched { .. } => say("the length: the recording is too short even to search".into()),
            // Noise exceeds zero in every search.
            Stage::NothingAcquired { strongest: Some((_, 0.0, _)) } => {
                say("the samples: all have one value, as of a recorder whose input is off".into());
            }
            Stage::NothingAcquired { .. } => {
                say(format!("the sample rate: {rate_hz} Hz was taken"));
                say(format!("the format: {format} was taken"));
                say(format!(
                    "the intermediate frequency: the carrier was looked for at {if_hz} Hz (and whether the spectrum \
                     is inverted)"
                ));
                say("the local oscillator: an offset beyond acquisition.doppler_max_hz hides every satellite".into());
                say("the antenna: is there any signal?".into());
            }
            Stage::NoSymbols { .. } => {
                say(format!("the length: symbols need a second or two, there are {length}"));
                say(format!("the sample rate: {rate_hz} Hz was taken; a small error shows here first"));
                say("the signal's strength: below 25 dB-Hz symbols cannot be distinguished".into());
            }
            Stage::NoFrame { .. } | Stage::NoEphemeris { .. } => say(TOO_WEAK.into()),
            Stage::Refused { .. } => say(
                "the start time: --start TIME, or core:datetime in the metadata, gives what a message's date leaves \
                 out"
                .into(),
            ),
            Stage::NoPosition { reason, .. } => advice.extend(without_position(reason.as_ref(), &length)),
        }
        Self { stage, seconds, advice }
    }

    /// Puts first what the messages of these signals take, where no frame or no complete ephemeris was found
    /// and the recording may have been too short for one.
    pub(super) fn with_messages(mut self, signals: &[&'static Signal]) -> Self {
        let too_short = match self.stage {
            Stage::NoFrame { .. } => too_short_for_a_frame,
            Stage::NoEphemeris { .. } => too_short_for_a_set,
            _ => return self,
        };
        let lengths = signals.iter().filter_map(|signal| too_short(signal, self.seconds));
        self.advice.splice(0..0, lengths);
        self
    }
}

/// Advice for a recording of `seconds` that may be too short to read a signal's time and orbit. Nothing is
/// read before one unit of the message is complete. The first unit may begin one unit's length after the
/// symbols.
fn too_short_for_a_frame(signal: &Signal, seconds: f64) -> Option<String> {
    let message = signal.components.iter().find_map(|component| component.message)?;
    let (unit_s, whole_s) = (message.unit_s, SYMBOLS_S + 2.0 * message.unit_s as f64);
    let length = duration(seconds);
    (seconds < whole_s).then(|| {
        format!(
            "the length: a unit of {name} on {signal} lasts {unit_s} s and is read when it is whole, up to {whole_s} s \
             after the start; there are {length}",
            name = message.name,
        )
    })
}

/// Advice for a recording of `seconds` that may be too short for a complete ephemeris of a signal.
fn too_short_for_a_set(signal: &Signal, seconds: f64) -> Option<String> {
    let message = signal.components.iter().find_map(|component| component.message)?;
    let whole_s = SYMBOLS_S + message.set_within_s()? as f64;
    let length = duration(seconds);
    (seconds < whole_s).then(|| {
        format!(
            "the length: orbit and clock take {name} on {signal} up to {whole_s} s from a cold start; there are \
             {length}",
            name = message.name,
        )
    })
}

/// Advice where enough ephemerides are known, by the reason of the last attempt's failure.
fn without_position(reason: Option<&NoFix>, length: &str) -> Vec<String> {
    let sky = "the sky: at least four healthy satellites above position.mask_deg in different directions".to_owned();
    match reason {
        Some(NoFix::AwaitingIonosphere { limit_s, .. }) => vec![
            format!(
                "the length: the ionosphere's parameters are on page 18 of subframe 4, sent once in {PAGE_EVERY_MIN} \
                 min; there are {length}"
            ),
            match limit_s {
                Some(limit_s) => format!("position.ionosphere_wait_s = {limit_s}: 0 fixes without them at once"),
                None => "position.require_ionosphere = true: false fixes without them, and worse".to_owned(),
            },
        ],
        Some(NoFix::Inconsistent { .. } | NoFix::Ambiguous { .. } | NoFix::Nowhere) => vec![
            "the satellites' agreement: a spoofed or replayed signal, or a false satellite, contradicts the others"
                .to_owned(),
            "the number of satellites: two more than four locate one that is wrong, four more locate two".to_owned(),
        ],
        Some(NoFix::TooFew { .. } | NoFix::Singular { .. } | NoFix::Diverged { .. } | NoFix::TwoPlaces { .. }) => {
            vec![sky]
        }
        None => vec![
            format!(
                "the length: the message's time is known a subframe of 6 s after the ephemerides; there are {length}"
            ),
            sky,
        ],
    }
}

/// A time in seconds, or in milliseconds below one.
pub(super) fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.1} ms", 1e3 * seconds) } else { format!("{seconds:.1} s") }
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
                "no satellite was acquired: the strongest peak, of {sv}, is {statistic:.1} against a threshold of \
                 {threshold:.1}"
            ),
            Self::NothingAcquired { strongest: None } => {
                write!(f, "no satellite was acquired: no known signal lies within the recorded band")
            }
            Self::NoSymbols { acquired } => write!(f, "no message symbols: acquired {}", names(acquired)),
            Self::NoFrame { with_symbols } => {
                write!(f, "no frame was found in the symbols of {}", names(with_symbols))
            }
            Self::Refused { refused } => {
                let all: Vec<String> = refused.iter().map(Refusal::to_string).collect();
                write!(f, "frames were found, and none was used: {}", all.join("; "))
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

impl Diagnosis {
    /// The stage that failed, on one line.
    pub fn headline(&self) -> String {
        format!("no fix in {}: {}", duration(self.seconds), self.stage)
    }
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.headline())?;
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
    use gnss::gps::l1c::L1C;
    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::System;

    #[test]
    fn a_diagnosis_names_the_stage_the_numbers_and_what_to_check() {
        let strongest = Some((Sv::gps(7), 41.25, 78.0));
        let stage = Stage::NothingAcquired { strongest };
        let text = Diagnosis::new(stage, 2.0, 2.6e6, "ci8", 0.0, 1, 0).to_string();
        for part in ["G07", "41.2", "78.0", "2600000", "ci8", "intermediate frequency", "within a sample"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let silent = Stage::NothingAcquired { strongest: Some((Sv::gps(1), 0.0, 95.6)) };
        let text = Diagnosis::new(silent, 2.0, 2.6e6, "ci8", 0.0, 0, 0).to_string();
        assert!(text.contains("all have one value") && !text.contains("antenna"), "{text}");
        let stage = Stage::NoEphemeris { complete: vec![Sv::gps(1)], missing: vec![(Sv::gps(9), vec![2, 3])] };
        let text = Diagnosis::new(stage, 20.0, 2.6e6, "ci8", 0.0, 0, 7).with_messages(&[&L1_CA]).to_string();
        assert!(text.contains("G09 lacks subframe 2, 3") && text.contains("LNAV on GPS L1 C/A up to 38 s"), "{text}");
        assert!(!text.contains("may be false"), "{text}");
    }

    #[test]
    fn frames_that_were_read_and_refused_are_named_with_the_reason_and_not_blamed_on_the_signal() {
        let refused = Refusal {
            why: "N_4 in string 5 is 0".to_owned(),
            svs: vec![Sv { system: System::Glonass, number: 5 }, Sv { system: System::Glonass, number: 6 }],
            units: 44,
        };
        let stage = Stage::Refused { refused: vec![refused] };
        let text = Diagnosis::new(stage, 40.0, 6.6e6, "ci8", 0.0, 0, 5).to_string();
        for part in ["R05 R06: 44 units with right checks were refused: N_4 in string 5 is 0", "--start TIME"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(!text.contains("strength") && !text.contains("dB-Hz"), "{text}");
    }

    #[test]
    fn a_recording_shorter_than_a_message_is_said_to_be_so_with_the_time_that_the_message_takes() {
        let text = |seconds: f64, signals: &[&'static Signal]| {
            let stage = Stage::NoFrame { with_symbols: vec![Sv::gps(18); 5] };
            Diagnosis::new(stage, seconds, 5e6, "ci8", 0.0, 0, 5).with_messages(signals).to_string()
        };
        // A frame of CNAV-2 lasts 18 s (IS-GPS-800J, 3.2.3), a subframe of LNAV 6 s.
        let short = text(12.0, &[&L1C]);
        for part in ["CNAV-2 on GPS L1C lasts 18 s", "up to 38 s after the start", "there are 12.0 s"] {
            assert!(short.contains(part), "{part}: {short}");
        }
        assert!(!short.contains("a cold start needs"), "{short}");
        let both = text(12.0, &[&L1_CA, &L1C]);
        assert!(both.contains("LNAV on GPS L1 C/A lasts 6 s") && both.contains("GPS L1C lasts 18 s"), "{both}");
        let long = text(40.0, &[&L1_CA, &L1C]);
        assert!(!long.contains("the length") && long.contains("27 dB-Hz"), "{long}");
    }

    #[test]
    fn one_satellite_that_may_be_false_does_not_hide_a_wrong_description_of_the_samples() {
        let stage = Stage::NoSymbols { acquired: vec![Sv::gps(7)] };
        let text = Diagnosis::new(stage, 0.5, 2.6e6, "ci8", 1000.0, 0, 1).to_string();
        for part in ["no fix in 500.0 ms", "needs 4, there are 1", "may be false", "2600000 Hz, ci8", "1000 Hz"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    #[test]
    fn advice_on_a_missing_position_is_about_what_it_failed_of() {
        let text = |reason| {
            let stage = Stage::NoPosition { with_ephemeris: vec![Sv::gps(1); 5], reason };
            Diagnosis::new(stage, 41.0, 2.6e6, "ci8", 0.0, 0, 5).to_string()
        };
        let waiting = text(Some(NoFix::AwaitingIonosphere { waited_s: 3.0, limit_s: Some(8.0) }));
        for part in ["3.0 s so far, of 8.0 s", "page 18", "12.5 min", "ionosphere_wait_s = 8", "41.0 s"] {
            assert!(waiting.contains(part), "{part}: {waiting}");
        }
        assert!(!waiting.contains("spoofed") && !waiting.contains("mask_deg"), "{waiting}");
        let required = text(Some(NoFix::AwaitingIonosphere { waited_s: 3.0, limit_s: None }));
        assert!(required.contains("require_ionosphere = true") && !required.contains("spoofed"), "{required}");
        let contradicting = text(Some(NoFix::Inconsistent { chi_square: 99.0, threshold: 10.8 }));
        assert!(contradicting.contains("spoofed") && !contradicting.contains("mask_deg"), "{contradicting}");
        let sky = text(Some(NoFix::Singular { condition: 1e5 }));
        assert!(sky.contains("mask_deg") && !sky.contains("spoofed"), "{sky}");
    }
}
