//! What satellites broadcast of the ionosphere: coefficients of one model or another.

use nalgebra::Vector3;

use crate::bdgim::Bdgim;
use crate::earth::{Geodetic, Look};
use crate::klobuchar::Klobuchar;
use crate::nequick::NequickG;
use crate::time::Epoch;

/// The models that there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Of GPS.
    Klobuchar,
    /// Of Galileo.
    NequickG,
    /// That of GPS as NavIC sends it: the delay of L5.
    KlobucharNavic,
    /// That of GPS as BeiDou has it, with geographic latitudes: the delay of B1I.
    KlobucharBeidou,
    /// Of BeiDou's third generation.
    Bdgim,
}

/// The coefficients of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coefficients {
    /// Of GPS's model.
    Klobuchar(Klobuchar),
    /// Of Galileo's.
    NequickG(NequickG),
    /// Of that of GPS, for the delay of NavIC's L5.
    KlobucharNavic(Klobuchar),
    /// Of BeiDou's form of it.
    KlobucharBeidou(Klobuchar),
    /// Of the model of BeiDou's third generation.
    Bdgim(Bdgim),
}

/// Carrier on which NavIC's coefficients give the delay (IRNSS SIS ICD for SPS 1.1: they are for users of
/// L5).
pub const NAVIC_HZ: f64 = 1_176.45e6;

impl Model {
    /// Forms of Klobuchar's model, in the order in which a receiver that takes any prefers them.
    pub const KLOBUCHAR: [Self; 3] = [Self::Klobuchar, Self::KlobucharNavic, Self::KlobucharBeidou];
}

impl Coefficients {
    /// Of which model they are.
    pub fn model(&self) -> Model {
        match self {
            Self::Klobuchar(_) => Model::Klobuchar,
            Self::NequickG(_) => Model::NequickG,
            Self::KlobucharNavic(_) => Model::KlobucharNavic,
            Self::KlobucharBeidou(_) => Model::KlobucharBeidou,
            Self::Bdgim(_) => Model::Bdgim,
        }
    }

    /// Group delay in seconds on a carrier of `carrier_hz` at GPS time `at` from `user` to `satellite_m`,
    /// earth-fixed, which is seen at `look`.
    pub fn delay_s(
        &self,
        (user, look): (Geodetic, Look),
        satellite_m: &Vector3<f64>,
        at: Epoch,
        carrier_hz: f64,
    ) -> f64 {
        match self {
            Self::Klobuchar(model) => model.delay_s(user, look, at, carrier_hz),
            Self::NequickG(model) => model.delay_s(user, satellite_m, at, carrier_hz),
            Self::KlobucharNavic(model) => model.delay_from_s(NAVIC_HZ, user, look, at, carrier_hz),
            Self::KlobucharBeidou(model) => model.beidou_delay_s(user, look, at, carrier_hz),
            Self::Bdgim(model) => model.delay_s(user, look, at, carrier_hz),
        }
    }
}
