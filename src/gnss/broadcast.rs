//! Broadcast orbits and clocks: Keplerian ephemerides and the user algorithm that turns them into states.
//!
//! Source: IS-GPS-200N, 20.3.3.3.3.1 (clock), 20.3.3.4.3 (orbit, table 20-IV; velocity from its
//! derivative, table 20-IV part 3). Limits: one set of elements describes an orbit to about 2 m
//! within its fit interval.

use nalgebra::Vector3;
use thiserror::Error;

use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;

/// A set of broadcast elements of one satellite, in SI units and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Ephemeris {
    pub sv: Sv,
    /// Reference time of the orbit.
    pub toe: Epoch,
    /// Reference time of the clock.
    pub toc: Epoch,
    /// When this set was first transmitted, as far as known.
    pub transmitted: Epoch,
    pub iode: u8,
    pub iodc: u16,
    /// User range accuracy index, 0..=15 (IS-GPS-200N, 20.3.3.3.1.3).
    pub ura_index: u8,
    /// Six-bit health, 0 is healthy (IS-GPS-200N, 20.3.3.3.1.4).
    pub health: u8,
    pub l2_codes: u8,
    pub l2_p_data_off: bool,
    /// Whether the curve fit is longer than four hours (IS-GPS-200N, 20.3.3.4.3.1).
    pub long_fit: bool,
    /// Age of data offset, in its 900 s units.
    pub aodo: u8,
    pub sqrt_a_sqrtm: f64,
    pub eccentricity: f64,
    pub m0_rad: f64,
    pub delta_n_radps: f64,
    pub omega0_rad: f64,
    pub omega_dot_radps: f64,
    pub omega_rad: f64,
    pub i0_rad: f64,
    pub idot_radps: f64,
    pub cuc_rad: f64,
    pub cus_rad: f64,
    pub crc_m: f64,
    pub crs_m: f64,
    pub cic_rad: f64,
    pub cis_rad: f64,
    pub af0_s: f64,
    pub af1_sps: f64,
    pub af2_sps2: f64,
    pub tgd_s: f64,
}

/// Position and velocity in ECEF at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub position_m: Vector3<f64>,
    pub velocity_mps: Vector3<f64>,
}

/// A clock's offset from GPS time (reading minus true) and its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockState {
    pub offset_s: f64,
    pub drift: f64,
}

/// Why elements give no state.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum OrbitError {
    #[error("{sv}: {element} = {value} is not that of an orbit: expected {expected}")]
    Element { sv: Sv, element: &'static str, value: f64, expected: &'static str },
    #[error("{sv}: Kepler's equation did not converge for eccentricity {eccentricity}")]
    Kepler { sv: Sv, eccentricity: f64 },
}

impl Ephemeris {
    /// ECEF state at GPS time `at`, in the ECEF axes of that same instant.
    pub fn state(&self, at: Epoch) -> Result<State, OrbitError> {
        let _ = at;
        todo!()
    }

    /// The satellite clock at GPS time `at` with the relativistic term, without group delay
    /// (IS-GPS-200N, 20.3.3.3.3.1, equation 1).
    pub fn clock(&self, at: Epoch) -> Result<ClockState, OrbitError> {
        let _ = at;
        todo!()
    }

    /// The clock as a single-frequency L1 C/A user meets it: [`Self::clock`] minus T_GD
    /// (IS-GPS-200N, 20.3.3.3.3.2).
    pub fn clock_l1(&self, at: Epoch) -> Result<ClockState, OrbitError> {
        let clock = self.clock(at)?;
        Ok(ClockState { offset_s: clock.offset_s - self.tgd_s, ..clock })
    }
}
