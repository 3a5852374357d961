//! Why there is no fix, by the stage at which it ended, and what to check.

use std::fmt;

use crate::gnss::record::AcquisitionRow;
use crate::gnss::samples::IfMetadata;
use crate::gnss::satellite::Sv;
use crate::receiver::position::solve::NoFix;

/// The first stage that failed.
#[derive(Clone, Debug)]
pub enum Stage {
    /// There were fewer samples than a search takes.
    TooShort { have_s: f64, need_s: f64 },
    /// No satellite passed the threshold.
    NothingAcquired { strongest: Option<Box<AcquisitionRow>> },
    /// Satellites were acquired, and none was tracked to its symbols.
    NoSymbols { acquired: Vec<Sv>, lost: usize },
    /// Symbols came, but no subframe was whole.
    NoFrame { tracked: Vec<Sv> },
    /// Too few ephemerides were complete: which subframes are missing.
    NoEphemeris { complete: usize, missing: Vec<(Sv, Vec<u8>)> },
    /// Enough was known, and the solution failed.
    NoSolution { reason: NoFix },
}

/// A stage, the recording's facts, and what to check.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    pub stage: Stage,
    pub metadata: IfMetadata,
    pub seconds: f64,
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no fix: ")?;
        match &self.stage {
            Stage::TooShort { have_s, need_s } => {
                write!(f, "{:.1} ms of samples, and a search takes {:.1} ms", have_s * 1e3, need_s * 1e3)?;
            }
            Stage::NothingAcquired { strongest: None } => write!(f, "there was nothing to search for")?,
            Stage::NothingAcquired { strongest: Some(row) } => write!(
                f,
                "no satellite found; the strongest peak was {} with {:.1} at {:.0} Hz, the threshold {:.1}",
                row.sv, row.statistic, row.doppler_hz, row.threshold
            )?,
            Stage::NoSymbols { acquired, lost } => {
                write!(f, "{} acquired, but none tracked to its data bits ({lost} channels lost)", names(acquired))?
            }
            Stage::NoFrame { tracked } => write!(f, "{} tracked, but no whole subframe was received", names(tracked))?,
            Stage::NoEphemeris { complete, missing } => {
                write!(f, "{complete} satellites have their ephemeris and 4 are needed; missing:")?;
                for (sv, subframes) in missing {
                    let list: Vec<String> = subframes.iter().map(u8::to_string).collect();
                    write!(f, " {sv} subframe {}", list.join("+"))?;
                }
            }
            Stage::NoSolution { reason } => write!(f, "{reason}")?,
        }
        writeln!(f)?;
        self.advice(f)
    }
}

impl Diagnosis {
    fn advice(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let metadata = &self.metadata;
        let facts = format!(
            "sample rate {} Hz, format {}, 0 Hz at {:.6} MHz{}",
            metadata.rate.hz(),
            metadata.format,
            metadata.center_hz * 1e-6,
            if metadata.inverted { ", spectrum inverted" } else { "" }
        );
        match self.stage {
            Stage::NothingAcquired { .. } | Stage::TooShort { .. } => write!(
                f,
                "check: are these right? {facts}; an oscillator more than a few ppm off needs a larger acquisition.doppler_max_hz"
            ),
            Stage::NoSymbols { .. } => write!(
                f,
                "check: {facts}; a mirrored spectrum (--inverted) finds satellites and loses them; bits need about 2 s of signal, \
                 and this is {:.1} s",
                self.seconds
            ),
            Stage::NoFrame { .. } | Stage::NoEphemeris { .. } => {
                write!(f, "check: a cold start needs 18 to 36 s of unbroken signal, and this is {:.1} s", self.seconds)
            }
            Stage::NoSolution { .. } => {
                write!(f, "check: more satellites, a lower position.mask_deg, a longer recording")
            }
        }
    }
}

fn names(satellites: &[Sv]) -> String {
    let names: Vec<String> = satellites.iter().map(Sv::to_string).collect();
    names.join(" ")
}
