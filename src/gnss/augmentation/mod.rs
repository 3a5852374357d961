//! Content of augmentation messages about satellites and the ionosphere, independent of its encoding. The
//! module has the content of each block, its meaning, and the knowledge of a network of ground stations.
//!
//! Source: RTCA DO-229D, A.4.4.1 to A.4.4.10. Satellites go by their position in the mask of type 1, points
//! of the grid by theirs in the mask of type 18. What bounds the corrections beyond their indicators
//! (types 10, 27 and 28) and the system's own satellites (type 17) is in `bounds`.

use std::fmt;

use crate::time::Epoch;
use accuracy::NOT_MONITORED;

pub mod accuracy;
mod bounds;
pub mod grid;

pub use bounds::{Almanac, Almanacs, Covariance, Covariances, Factors, LARGEST_REGIONS, Region, Service};

/// Largest number for which a mask of satellites has a bit.
pub const NUMBERS: u8 = 210;
/// Largest number of satellites in a mask.
pub const MASKED: usize = 51;
/// Number of satellites in a block of fast corrections.
pub const FAST_SLOTS: usize = 13;
/// Number of satellites in the fast half of a block of type 24.
pub const MIXED_SLOTS: usize = 6;
/// Number of points in a block of delays.
pub const DELAY_SLOTS: usize = 15;
/// Issue of fast corrections that states that an alarm is on (A.4.4.4).
pub const ALARM: u8 = 3;

/// Mask of the corrected satellites (type 1).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mask {
    /// Issue of the mask.
    pub iodp: u8,
    /// Numbers of the satellites, in ascending order: GPS has 1 to 37.
    pub numbers: Vec<u8>,
}

/// Fast corrections of thirteen satellites (types 2 to 5, and 0).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fast {
    /// Index of a group of thirteen satellites in the mask, from 0.
    pub part: u8,
    /// True if the block reports test mode, in which the system must not be used for safety (type 0).
    pub is_test: bool,
    /// Issue of these corrections.
    pub iodf: u8,
    /// Issue of the mask.
    pub iodp: u8,
    /// Corrections that users add to the ranges, in metres.
    pub correction_m: [f64; FAST_SLOTS],
    /// Indicators of their accuracy.
    pub udrei: [u8; FAST_SLOTS],
}

/// Integrity of all satellites of the mask (type 6).
#[derive(Clone, Debug, PartialEq)]
pub struct Integrity {
    /// Issues of the fast corrections of types 2 to 5 to which the integrity belongs.
    pub iodf: [u8; 4],
    /// Indicators of the accuracy.
    pub udrei: [u8; MASKED],
}

/// Degradation of the fast corrections (type 7).
#[derive(Clone, Debug, PartialEq)]
pub struct Degradation {
    /// Latency of the system in seconds.
    pub latency_s: u8,
    /// Issue of the mask.
    pub iodp: u8,
    /// Indicators of the degradation.
    pub indicators: [u8; MASKED],
}

/// Long-term corrections of one satellite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LongTerm {
    /// Position in the mask from 1; 0 for none.
    pub place: u8,
    /// Issue of the corrected ephemeris.
    pub iode: u8,
    /// Correction of the satellite's position in ECEF, in metres.
    pub place_m: [f64; 3],
    /// Correction of the satellite's velocity in ECEF, in m/s.
    pub velocity_mps: [f64; 3],
    /// Correction of the satellite's clock offset, in seconds.
    pub af0_s: f64,
    /// Correction of the satellite's clock drift, in s/s.
    pub af1_sps: f64,
    /// Second of the day to which the corrections refer, a multiple of 16 s.
    pub second_of_day: f64,
}

/// Half of a block of long-term corrections.
#[derive(Clone, Debug, PartialEq)]
pub enum Half {
    /// Velocity code 0: positions and clocks of two satellites.
    Steady {
        /// Issue of the mask.
        iodp: u8,
        /// The satellites'.
        both: [LongTerm; 2],
    },
    /// Velocity code 1: position and clock of one satellite, with their rates.
    Moving {
        /// Issue of the mask.
        iodp: u8,
        /// The satellite's.
        one: LongTerm,
    },
}

/// Mixed block (type 24): fast corrections of six satellites, and half a block of long-term ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixed {
    /// Fast corrections. The other satellites of their thirteen are zero and not monitored.
    pub fast: Fast,
    /// The long-term ones.
    pub half: Half,
}

/// Mask of the points of a band that have delays (type 18).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridMask {
    /// Bands that are sent.
    pub bands: u8,
    /// The band.
    pub band: u8,
    /// Issue of the masks.
    pub iodi: u8,
    /// Numbers of the band's points, from 1, in ascending order.
    pub points: Vec<u8>,
}

/// Vertical delays at fifteen points of a band (type 26).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Delays {
    /// The band.
    pub band: u8,
    /// Index of a group of fifteen grid points in the band's mask, from 0.
    pub part: u8,
    /// Issue of the masks.
    pub iodi: u8,
    /// Vertical delays on L1, in metres.
    pub vertical_m: [f64; DELAY_SLOTS],
    /// Indicators of their accuracy.
    pub givei: [u8; DELAY_SLOTS],
}

/// Content of a block.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Type 0 without corrections: the system is in test mode.
    Test,
    /// Type 1.
    Mask(Mask),
    /// Types 2 to 5, and 0 with the content of type 2.
    Fast(Fast),
    /// Type 6.
    Integrity(Box<Integrity>),
    /// Type 7.
    Degradation(Box<Degradation>),
    /// Type 24.
    Mixed(Box<Mixed>),
    /// Type 25.
    LongTerm(Box<[Half; 2]>),
    /// Type 18.
    GridMask(GridMask),
    /// Type 26.
    Delays(Box<Delays>),
    /// Type 10.
    Factors(Box<Factors>),
    /// Type 17.
    Almanacs(Box<Almanacs>),
    /// Type 27.
    Service(Box<Service>),
    /// Type 28.
    Covariances(Box<Covariances>),
}

impl Half {
    /// Issue of the mask.
    pub fn iodp(&self) -> u8 {
        match self {
            Self::Steady { iodp, .. } | Self::Moving { iodp, .. } => *iodp,
        }
    }

    /// The satellites' corrections.
    pub fn each(&self) -> impl Iterator<Item = &LongTerm> {
        let all = match self {
            Self::Steady { both, .. } => both.as_slice(),
            Self::Moving { one, .. } => std::slice::from_ref(one),
        };
        all.iter().filter(|one| one.place > 0)
    }
}

impl Fast {
    /// Creates corrections without satellites for a part of the mask.
    pub fn unmonitored(part: u8) -> Self {
        Self { part, udrei: [NOT_MONITORED; FAST_SLOTS], ..Self::default() }
    }
}

/// Network's estimate of a satellite at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Fast correction in metres, which is added to ranges beside the long-term correction.
    pub correction_m: f64,
    /// Indicator of the accuracy after both corrections.
    pub udrei: u8,
    /// Indicator of the fast correction's degradation.
    pub degradation: u8,
    /// Long-term correction; its position in the mask is 0.
    pub long_term: LongTerm,
    /// True if the long-term correction includes rates.
    pub is_moving: bool,
}

impl Known {
    /// Creates an estimate with no corrections, only the indicator of the reason.
    pub fn nothing(udrei: u8) -> Self {
        Self { correction_m: 0.0, udrei, degradation: 0, long_term: LongTerm::default(), is_moving: false }
    }
}

/// Network of ground stations that supplies the corrections which satellites send.
pub trait Network: fmt::Debug + Send + Sync {
    /// True if the network reports that it must not be used for safety.
    fn is_test(&self) -> bool;
    /// Numbers of the satellites that it corrects, in ascending order.
    fn numbers(&self) -> &[u8];
    /// Returns the network's estimate of the satellite with this number at a time.
    fn satellite(&self, number: u8, at: Epoch) -> Known;
    /// Bands of the grid with the numbers of the points that it has delays of, in ascending order.
    fn bands(&self) -> &[(u8, Vec<u8>)];
    /// Degradation of the corrections, which type 10 sends; `None` if it is not sent.
    fn factors(&self) -> Option<Factors> {
        None
    }
    /// Vertical delay on L1 at a point of a band and the bound of its error, both in metres.
    fn vertical_m(&self, band: u8, point: u8, at: Epoch) -> Option<(f64, f64)>;
}
