//! The field tables of NavIC's message: positions count from 0, the first bit of a subframe before coding
//! (IRNSS SIS ICD for SPS 1.1, tables of the subframes and of message types 7, 9, 11 and 26).

use super::NAVIC_WEEK;
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Bits, Element, Field, element, fields, plain};
use crate::broadcast::Ephemeris;
use crate::klobuchar::Klobuchar;
use crate::message::Common;
use crate::time::Epoch;

/// Number of bits of a subframe before its check.
pub const DATA_BITS: usize = 262;

/// Bits of a subframe that its check covers, in order of transmission.
pub type Subframe = Bits<DATA_BITS>;

const CLOCK: &str = "subframe 1, clock parameters";
const ORBIT: &str = "subframes 1 and 2, ephemeris parameters";
const ALMANAC: &str = "message type 7";
const UTC: &str = "message types 9 and 26";
const ELECTRONS: &str = "message type 11";

type Of = Element<Ephemeris>;

fn navic_week(at: Epoch) -> f64 {
    (at.week() - NAVIC_WEEK).rem_euclid(1024) as f64
}

/// Clock, health and corrections. The week is that of sending; what sets it is the caller.
#[rustfmt::skip]
pub(super) static SUBFRAME_1: [Of; 17] = [
    element(Field::new("week", &[(30, 10)], Whole, 0, CLOCK), |e| navic_week(e.transmitted), |_, _| {}),
    plain!("af0_s", [(40, 22)], Signed, -31, CLOCK, af0_s),
    plain!("af1_sps", [(62, 16)], Signed, -43, CLOCK, af1_sps),
    plain!("af2_sps2", [(78, 8)], Signed, -55, CLOCK, af2_sps2),
    element(Field::new("ura_index", &[(86, 4)], Whole, 0, CLOCK),
        |e| f64::from(e.ura_index), |e, v| e.ura_index = v as u8),
    element(Field::new("toc_s", &[(90, 16)], Whole, 4, CLOCK),
        |e| e.toc.tow_s(), |e, v| e.toc = e.toc.nearest_tow(v as i64)),
    plain!("tgd_s", [(106, 8)], Signed, -31, CLOCK, tgd_s),
    plain!("delta_n_radps", [(114, 22)], Semicircles, -41, ORBIT, delta_n_radps),
    element(Field::new("iodec", &[(136, 8)], Whole, 0, ORBIT),
        |e| f64::from(e.iode), |e, v| (e.iode, e.iodc) = (v as u16, v as u16)),
    // The flag of L5, then that of S.
    element(Field::new("health", &[(154, 2)], Whole, 0, CLOCK),
        |e| f64::from(e.health), |e, v| e.health = v as u16),
    plain!("cuc_rad", [(156, 15)], Signed, -28, ORBIT, cuc_rad),
    plain!("cus_rad", [(171, 15)], Signed, -28, ORBIT, cus_rad),
    plain!("cic_rad", [(186, 15)], Signed, -28, ORBIT, cic_rad),
    plain!("cis_rad", [(201, 15)], Signed, -28, ORBIT, cis_rad),
    plain!("crc_m", [(216, 15)], Signed, -4, ORBIT, crc_m),
    plain!("crs_m", [(231, 15)], Signed, -4, ORBIT, crs_m),
    plain!("idot_radps", [(246, 14)], Semicircles, -43, ORBIT, idot_radps),
];

/// The orbit.
#[rustfmt::skip]
pub(super) static SUBFRAME_2: [Of; 8] = [
    plain!("m0_rad", [(30, 32)], Turn, -31, ORBIT, m0_rad),
    element(Field::new("toe_s", &[(62, 16)], Whole, 4, ORBIT),
        |e| e.toe.tow_s(), |e, v| e.toe = e.toe.nearest_tow(v as i64)),
    plain!("eccentricity", [(78, 32)], Unsigned, -33, ORBIT, eccentricity),
    plain!("sqrt_a_sqrtm", [(110, 32)], Unsigned, -19, ORBIT, sqrt_a_sqrtm),
    plain!("omega0_rad", [(142, 32)], Turn, -31, ORBIT, omega0_rad),
    plain!("omega_rad", [(174, 32)], Turn, -31, ORBIT, omega_rad),
    plain!("omega_dot_radps", [(206, 22)], Semicircles, -41, ORBIT, omega_dot_radps),
    plain!("i0_rad", [(228, 32)], Semicircles, -31, ORBIT, i0_rad),
];

/// Almanac of a satellite as message type 7 carries it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Almanac {
    pub number: u8,
    pub week: f64,
    pub toa_s: f64,
    pub eccentricity: f64,
    pub i0_rad: f64,
    pub omega_dot_radps: f64,
    pub sqrt_a_sqrtm: f64,
    pub omega0_rad: f64,
    pub omega_rad: f64,
    pub m0_rad: f64,
    pub af0_s: f64,
    pub af1_sps: f64,
    pub tgd_s: f64,
}

/// Step of an almanac's reference time.
const TOA_STEP_S: i64 = 16;

impl Almanac {
    /// Computes the almanac of an ephemeris, propagated to a reference time near `near`.
    pub(super) fn of(set: &Ephemeris, near: Epoch) -> Self {
        let toa = Epoch::new(near.seconds().div_euclid(TOA_STEP_S) * TOA_STEP_S, 0.0);
        let mean = set.mean_at(toa);
        Self {
            number: set.sv.number,
            week: navic_week(toa),
            toa_s: toa.tow_s(),
            eccentricity: set.eccentricity,
            i0_rad: mean.inclination_rad,
            omega_dot_radps: set.omega_dot_radps,
            sqrt_a_sqrtm: mean.sqrt_a_sqrtm,
            omega0_rad: mean.omega0_rad,
            omega_rad: set.omega_rad,
            m0_rad: mean.m0_rad,
            af0_s: mean.af0_s,
            af1_sps: set.af1_sps,
            tgd_s: set.tgd_s,
        }
    }
}

#[rustfmt::skip]
pub(super) static MESSAGE_7: [Element<Almanac>; 13] = [
    plain!("almanac_week", [(36, 10)], Whole, 0, ALMANAC, week),
    plain!("almanac_eccentricity", [(46, 16)], Unsigned, -21, ALMANAC, eccentricity),
    plain!("toa_s", [(62, 16)], Whole, 4, ALMANAC, toa_s),
    plain!("almanac_i0_rad", [(78, 24)], Semicircles, -23, ALMANAC, i0_rad),
    plain!("almanac_omega_dot_radps", [(102, 16)], Semicircles, -38, ALMANAC, omega_dot_radps),
    plain!("almanac_sqrt_a_sqrtm", [(118, 24)], Unsigned, -11, ALMANAC, sqrt_a_sqrtm),
    plain!("almanac_omega0_rad", [(142, 24)], Turn, -23, ALMANAC, omega0_rad),
    plain!("almanac_omega_rad", [(166, 24)], Turn, -23, ALMANAC, omega_rad),
    plain!("almanac_m0_rad", [(190, 24)], Turn, -23, ALMANAC, m0_rad),
    plain!("almanac_af0_s", [(214, 11)], Signed, -20, ALMANAC, af0_s),
    plain!("almanac_af1_sps", [(225, 11)], Signed, -38, ALMANAC, af1_sps),
    element(Field::new("almanac_prn", &[(236, 6)], Whole, 0, ALMANAC),
        |a| f64::from(a.number), |a, v| a.number = v as u8),
    plain!("almanac_delay_s", [(242, 8)], Signed, -31, ALMANAC, tgd_s),
];

/// UTC parameters of message type 26.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Utc {
    a0_s: f64,
    a1_sps: f64,
    leap_s: f64,
    reference: (i64, f64),
    event: (i64, f64),
    leap_after_s: f64,
}

impl Utc {
    /// UTC as a scene has it.
    pub(super) fn of(common: &Common, start: Epoch) -> Self {
        let utc = &common.utc;
        let reference = utc.polynomial.map_or(common.reference.unwrap_or(start), |polynomial| polynomial.reference);
        let event = utc.event.map_or((start.week(), 7, utc.leap_s), |e| (e.week, i64::from(e.day), e.after_s));
        Self {
            a0_s: utc.polynomial.map_or(0.0, |polynomial| polynomial.a0_s),
            a1_sps: utc.polynomial.map_or(0.0, |polynomial| polynomial.a1_sps),
            leap_s: utc.leap_s as f64,
            // Rates of 1e-14 over 16 s are nothing.
            reference: (reference.week(), (reference.tow_whole_s().div_euclid(16) * 16) as f64),
            event: (event.0, event.1 as f64),
            leap_after_s: event.2 as f64,
        }
    }
}

#[rustfmt::skip]
pub(super) static MESSAGE_26: [Element<Utc>; 8] = [
    plain!("utc_a0_s", [(36, 16)], Signed, -35, UTC, a0_s),
    plain!("utc_a1_sps", [(52, 13)], Signed, -51, UTC, a1_sps),
    plain!("utc_leap_s", [(72, 8)], Signed, 0, UTC, leap_s),
    plain!("utc_t0_s", [(80, 16)], Whole, 4, UTC, reference.1),
    element(Field::new("utc_week", &[(96, 10)], Whole, 0, UTC),
        |u| (u.reference.0 - NAVIC_WEEK).rem_euclid(1024) as f64, |u, v| u.reference.0 = v as i64 + NAVIC_WEEK),
    element(Field::new("utc_event_week", &[(106, 10)], Whole, 0, UTC),
        |u| (u.event.0 - NAVIC_WEEK).rem_euclid(1024) as f64, |u, v| u.event.0 = v as i64 + NAVIC_WEEK),
    plain!("utc_event_day", [(116, 4)], Whole, 0, UTC, event.1),
    plain!("utc_leap_after_s", [(120, 8)], Signed, 0, UTC, leap_after_s),
];

#[rustfmt::skip]
pub(super) static MESSAGE_11: [Element<Klobuchar>; 8] = [
    plain!("alpha_0", [(174, 8)], Signed, -30, ELECTRONS, alpha[0]),
    plain!("alpha_1", [(182, 8)], Signed, -27, ELECTRONS, alpha[1]),
    plain!("alpha_2", [(190, 8)], Signed, -24, ELECTRONS, alpha[2]),
    plain!("alpha_3", [(198, 8)], Signed, -24, ELECTRONS, alpha[3]),
    plain!("beta_0", [(206, 8)], Signed, 11, ELECTRONS, beta[0]),
    plain!("beta_1", [(214, 8)], Signed, 14, ELECTRONS, beta[1]),
    plain!("beta_2", [(222, 8)], Signed, 16, ELECTRONS, beta[2]),
    plain!("beta_3", [(230, 8)], Signed, 16, ELECTRONS, beta[3]),
];

/// Lists every field by the subframe or message that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![
        ("subframe 1", fields(&[&SUBFRAME_1])),
        ("subframe 2", fields(&[&SUBFRAME_2])),
        ("message 7", fields(&[&MESSAGE_7])),
        ("message 11", fields(&[&MESSAGE_11])),
        ("message 26", fields(&[&MESSAGE_26])),
    ]
}
