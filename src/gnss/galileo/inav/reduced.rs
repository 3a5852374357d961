//! Reduced elements of the sender: word 16, which a receiver has completely in two seconds.
//!
//! Source: Galileo OS SIS ICD 2.1, 5.1.11. Eight coarse numbers give orbit and clock from the sub-frame's
//! beginning on for ten minutes; rates, harmonics, health and group delays are zero or not stated. Satellites
//! send what fits best over that time, with the clock making up for the orbit's error along the line to the
//! Earth: the real words of an hour of 2025 are so (`tests/witness`), within 1.9 m in a range (rms), and what
//! is sent here is like them. Limits: satellites whose orbit the fields cannot hold have none.

use nalgebra::Vector3;

use crate::bits::Kind::{Semicircles, Signed, Turn};
use crate::bits::{Element, plain, quantise_all};
use crate::broadcast::{Constants, Ephemeris, State};
use crate::earth::SPEED_OF_LIGHT_MPS;
use crate::satellite::Sv;
use crate::time::Epoch;

use super::almanac::{NOMINAL_AXIS_M, NOMINAL_INCLINATION_RAD};

/// Seconds from a sub-frame's nominal beginning to that on E1-B, to which reduced elements refer.
const BEGIN_S: i64 = 1;
/// Duration in seconds from the reference time for which the elements are fitted.
pub const VALID_S: f64 = 600.0;
/// Step of the semi-major axis.
const AXIS_STEP_M: f64 = 256.0;

const REDUCED: &str = "5.1.11";

/// Content of word 16.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reduced {
    delta_axis_m: f64,
    ex: f64,
    ey: f64,
    delta_i_rad: f64,
    omega0_rad: f64,
    latitude_rad: f64,
    af0_s: f64,
    af1_sps: f64,
}

/// The beginning of the sub-frame in which `start` lies: the reference time.
fn begin(start: Epoch) -> Epoch {
    let since_s = (start.tow_whole_s() - planted!("gnss.inav.reduced_begin", BEGIN_S, 0)).rem_euclid(super::SUBFRAME_S);
    Epoch::new(start.seconds() - since_s, 0.0)
}

impl Reduced {
    /// Reduced elements nearest to an ephemeris over the ten minutes after the beginning of the sub-frame of
    /// `start`. The Keplerian orbit passes through the satellite's position in their middle, on the nearest
    /// axis that can be sent. `None` if there is no such orbit or it does not fit the fields.
    pub(super) fn of(set: &Ephemeris, start: Epoch) -> Option<Self> {
        let middle = begin(start).plus_s(0.5 * VALID_S);
        let mut reduced = Self::through(set.sv, &set.state(middle).ok()?);
        reduced.af1_sps = set.af1_sps + 2.0 * set.af2_sps2 * middle.since(set.toc);
        // Longitude at the week's beginning, and latitude at the sub-frame's.
        let Constants { mu_m3ps2, rotation_radps, .. } = *Constants::of(set.sv.system);
        let axis_m = NOMINAL_AXIS_M + reduced.delta_axis_m;
        let motion_radps = (mu_m3ps2 / (axis_m * axis_m * axis_m)).sqrt();
        reduced.omega0_rad += rotation_radps * (begin(start).tow_s() + 0.5 * VALID_S);
        reduced.latitude_rad -= motion_radps * 0.5 * VALID_S;
        quantise_all(&WORD_16, &mut reduced).ok()?;
        // The clock takes what the steps leave along the line to the Earth.
        let coarse = reduced.ephemeris(set.sv, start);
        let up_m = coarse.state(middle).ok()?.position_m.norm() - set.state(middle).ok()?.position_m.norm();
        let clock_s = set.clock(middle).ok()?.offset_s - coarse.clock(middle).ok()?.offset_s;
        reduced.af0_s = clock_s + up_m / SPEED_OF_LIGHT_MPS;
        quantise_all(&WORD_16, &mut reduced).ok()?;
        Some(reduced)
    }

    /// The Keplerian orbit through a state, whose speed gives way to the steps of the axis; node and mean
    /// latitude are those of its instant.
    fn through(sv: Sv, state: &State) -> Self {
        let Constants { mu_m3ps2, rotation_radps, .. } = *Constants::of(sv.system);
        let (r, spin) = (state.position_m, Vector3::new(0.0, 0.0, rotation_radps));
        let v = state.velocity_mps + spin.cross(&r);
        let (radius_m, normal) = (r.norm(), r.cross(&v).normalize());
        let osculating_m = 1.0 / (2.0 / radius_m - v.norm_squared() / mu_m3ps2);
        let delta_axis_m = ((osculating_m - NOMINAL_AXIS_M) / AXIS_STEP_M).round() * AXIS_STEP_M;
        let axis_m = NOMINAL_AXIS_M + delta_axis_m;
        // e cos E and e sin E from the radius and its rate.
        let (along, across) = (1.0 - radius_m / axis_m, r.dot(&v) / (mu_m3ps2 * axis_m).sqrt());
        let (eccentricity, anomaly_rad) = (libm::hypot(along, across), libm::atan2(across, along));
        let (sin, cos) = libm::sincos(anomaly_rad);
        let flatness = (1.0 - eccentricity * eccentricity).sqrt();
        let true_rad = libm::atan2(flatness * sin, cos - eccentricity);
        let omega0_rad = libm::atan2(normal.x, -normal.y);
        let (node_sin, node_cos) = libm::sincos(omega0_rad);
        let node = Vector3::new(node_cos, node_sin, 0.0);
        let omega_rad = libm::atan2(r.dot(&normal.cross(&node)), r.dot(&node)) - true_rad;
        let (omega_sin, omega_cos) = libm::sincos(omega_rad);
        Self {
            delta_axis_m,
            ex: eccentricity * omega_cos,
            ey: eccentricity * omega_sin,
            delta_i_rad: libm::acos(normal.z) - NOMINAL_INCLINATION_RAD,
            omega0_rad,
            latitude_rad: omega_rad + anomaly_rad - across,
            ..Self::default()
        }
    }

    /// The ephemeris that users of a word sent at `start` compute with.
    pub(super) fn ephemeris(&self, sv: Sv, start: Epoch) -> Ephemeris {
        let reference = begin(start);
        let omega_rad = libm::atan2(self.ey, self.ex);
        Ephemeris {
            form: &super::INAV_SETS,
            transmitted: start,
            sqrt_a_sqrtm: (NOMINAL_AXIS_M + self.delta_axis_m).sqrt(),
            eccentricity: libm::hypot(self.ex, self.ey),
            m0_rad: self.latitude_rad - omega_rad,
            omega0_rad: self.omega0_rad,
            omega_rad,
            i0_rad: NOMINAL_INCLINATION_RAD + self.delta_i_rad,
            af0_s: self.af0_s,
            af1_sps: self.af1_sps,
            ..Ephemeris::blank(sv, reference)
        }
    }
}

/// Word 16.
#[rustfmt::skip]
pub(super) static WORD_16: [Element<Reduced>; 8] = [
    plain!("delta_axis_m", [(6, 5)], Signed, 8, REDUCED, delta_axis_m),
    plain!("ex", [(11, 13)], Signed, -22, REDUCED, ex),
    plain!("ey", [(24, 13)], Signed, -22, REDUCED, ey),
    plain!("delta_i_rad", [(37, 17)], Semicircles, -22, REDUCED, delta_i_rad),
    plain!("omega0_rad", [(54, 23)], Turn, -22, REDUCED, omega0_rad),
    plain!("latitude_rad", [(77, 23)], Turn, -22, REDUCED, latitude_rad),
    plain!("af0_s", [(100, 22)], Signed, -26, REDUCED, af0_s),
    plain!("af1_sps", [(122, 6)], Signed, -35, REDUCED, af1_sps),
];
