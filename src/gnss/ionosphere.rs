//! Ionosphere coefficients that satellites broadcast, one type for all models.

use nalgebra::Vector3;

use crate::bdgim::Bdgim;
use crate::earth::{Geodetic, Look};
use crate::klobuchar::Klobuchar;
use crate::nequick::NequickG;
use crate::time::Epoch;

/// The models that there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Klobuchar model of GPS.
    Klobuchar,
    /// NeQuick G model of Galileo.
    NequickG,
    /// Klobuchar model as NavIC sends it: delay on L5.
    KlobucharNavic,
    /// Klobuchar model as BeiDou defines it, with geographic latitudes: delay on B1I.
    KlobucharBeidou,
    /// BDGIM, the model of BeiDou's third generation.
    Bdgim,
}

/// The coefficients of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coefficients {
    /// Klobuchar coefficients of GPS.
    Klobuchar(Klobuchar),
    /// NeQuick G coefficients of Galileo.
    NequickG(NequickG),
    /// Klobuchar coefficients of NavIC, for the delay on L5.
    KlobucharNavic(Klobuchar),
    /// Klobuchar coefficients of BeiDou, for the delay on B1I.
    KlobucharBeidou(Klobuchar),
    /// BDGIM coefficients of BeiDou's third generation.
    Bdgim(Bdgim),
}

/// Carrier frequency in Hz for which NavIC's coefficients give the delay (IRNSS SIS ICD for SPS 1.1: they are
/// for users of L5).
pub const NAVIC_HZ: f64 = 1_176.45e6;

impl Model {
    /// Variants of Klobuchar's model, in the order of preference for a receiver that accepts any.
    pub const KLOBUCHAR: [Self; 3] = [Self::Klobuchar, Self::KlobucharNavic, Self::KlobucharBeidou];
}

impl Coefficients {
    /// Returns the model that the coefficients belong to.
    pub fn model(&self) -> Model {
        match self {
            Self::Klobuchar(_) => Model::Klobuchar,
            Self::NequickG(_) => Model::NequickG,
            Self::KlobucharNavic(_) => Model::KlobucharNavic,
            Self::KlobucharBeidou(_) => Model::KlobucharBeidou,
            Self::Bdgim(_) => Model::Bdgim,
        }
    }

    /// Group delay in seconds on `carrier_hz` at GPS time `at` from `user` to the earth-fixed `satellite_m`,
    /// which is seen at `look`.
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
