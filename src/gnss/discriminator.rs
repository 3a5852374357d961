//! Code discriminators by the taps that they take.
//!
//! Receivers and their judges name them alike. How a receiver normalises them, and what noise and rays make
//! of them, is no matter of this room.

use serde::de::IntoDeserializer;
use serde::de::value::{self, StrDeserializer};
use serde::{Deserialize, Serialize};

/// Discriminator of a code loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CodeDiscriminator {
    /// Non-coherent early minus late power over early plus late power.
    EarlyMinusLate,
    /// (early − late)·prompt over prompt power.
    DotProduct,
    /// The dot product of two pairs, (early − late − ½·(very early − very late))·prompt over prompt power.
    /// The outer pair is twice as far apart. Late rays move it less than the others: the slopes of both pairs
    /// cancel where no tap is near a ray's peak (G. A. McGraw and M. S. Braasch, ION NTM 1999).
    DoubleDelta,
}

impl CodeDiscriminator {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::EarlyMinusLate, Self::DotProduct, Self::DoubleDelta];

    /// Discriminator by its name in settings; `None` of another name.
    pub fn named(name: &str) -> Option<Self> {
        let name: StrDeserializer<'_, value::Error> = name.into_deserializer();
        Self::deserialize(name).ok()
    }

    /// Pairs of an early and a late tap: their distance in spacings from early to late, and the weight of
    /// their difference.
    pub const fn pairs(self) -> &'static [(f64, f64)] {
        match self {
            Self::EarlyMinusLate | Self::DotProduct => &[(1.0, 1.0)],
            Self::DoubleDelta => &[(1.0, 1.0), (2.0, -0.5)],
        }
    }

    /// Distance of the outermost taps in spacings.
    pub fn widest(self) -> f64 {
        self.pairs().iter().fold(0.0, |most, (apart, _)| f64::max(most, *apart))
    }
}
