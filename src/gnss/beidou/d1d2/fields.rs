//! The field tables of D1 and D2: positions count from 0, the first bit of a subframe without its
//! interleaving, parities counted, and go on through the subframes of D1, or the pages of D2's subframe 1,
//! that make up a ephemeris (BDS-SIS-ICD-B1I 3.0, 5.2.4 and 5.3.3).

use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Bits, Element, Field, element, plain};
use crate::broadcast::Ephemeris;
use crate::klobuchar::Klobuchar;
use crate::time::{BDT_WEEK, Epoch};

/// Bits of a subframe.
pub const SUBFRAME_BITS: usize = 300;
/// Subframes of D1, and pages of D2, with an ephemeris.
pub const D1_PARTS: usize = 3;
pub const D2_PARTS: usize = 10;

/// Subframes 1 to 3 of D1.
pub type D1Set = Bits<{ D1_PARTS * SUBFRAME_BITS }>;
/// Pages 1 to 10 of D2's subframe 1.
pub type D2Set = Bits<{ D2_PARTS * SUBFRAME_BITS }>;

/// Content of an ephemeris in D1 and D2.
#[derive(Clone, Debug)]
pub(super) struct Orbit {
    pub ephemeris: Ephemeris,
    pub klobuchar: Klobuchar,
}

const CLOCK: &str = "5.2.4, clock";
const ORBIT: &str = "5.2.4, ephemeris";
const ELECTRONS: &str = "5.2.4.7";

type Of = Element<Orbit>;

fn bdt_week(at: Epoch) -> f64 {
    (at.week() - BDT_WEEK).rem_euclid(8192) as f64
}

/// A group delay in tenths of nanoseconds.
const STEP_S: f64 = 1e-10;

/// An ephemeris in D1. The week is that of sending; what sets it is the caller.
#[rustfmt::skip]
const OF_D1: [Of; 35] = [
    element(Field::new("health", &[(42, 1)], Whole, 0, CLOCK),
        |o| f64::from(o.ephemeris.health), |o, v| o.ephemeris.health = v as u16),
    element(Field::new("aodc", &[(43, 5)], Whole, 0, CLOCK),
        |o| f64::from(o.ephemeris.iodc), |o, v| o.ephemeris.iodc = v as u16),
    element(Field::new("ura_index", &[(48, 4)], Whole, 0, CLOCK),
        |o| f64::from(o.ephemeris.ura_index), |o, v| o.ephemeris.ura_index = v as u8),
    element(Field::new("week", &[(60, 13)], Whole, 0, CLOCK), |o| bdt_week(o.ephemeris.transmitted), |_, _| {}),
    element(Field::new("toc_s", &[(73, 9), (90, 8)], Whole, 3, CLOCK),
        |o| o.ephemeris.toc.tow_s(), |o, v| o.ephemeris.toc = o.ephemeris.toc.nearest_tow(v as i64)),
    element(Field::new("tgd1_100ps", &[(98, 10)], Signed, 0, CLOCK),
        |o| o.ephemeris.tgd_s / STEP_S, |o, v| o.ephemeris.tgd_s = v * STEP_S),
    element(Field::new("tgd2_100ps", &[(108, 4), (120, 6)], Signed, 0, CLOCK),
        |o| o.ephemeris.tgd2_s / STEP_S, |o, v| o.ephemeris.tgd2_s = v * STEP_S),
    plain!("alpha_0", [(126, 8)], Signed, -30, ELECTRONS, klobuchar.alpha[0]),
    plain!("alpha_1", [(134, 8)], Signed, -27, ELECTRONS, klobuchar.alpha[1]),
    plain!("alpha_2", [(150, 8)], Signed, -24, ELECTRONS, klobuchar.alpha[2]),
    plain!("alpha_3", [(158, 8)], Signed, -24, ELECTRONS, klobuchar.alpha[3]),
    plain!("beta_0", [(166, 6), (180, 2)], Signed, 11, ELECTRONS, klobuchar.beta[0]),
    plain!("beta_1", [(182, 8)], Signed, 14, ELECTRONS, klobuchar.beta[1]),
    plain!("beta_2", [(190, 8)], Signed, 16, ELECTRONS, klobuchar.beta[2]),
    plain!("beta_3", [(198, 4), (210, 4)], Signed, 16, ELECTRONS, klobuchar.beta[3]),
    plain!("af2_sps2", [(214, 11)], Signed, -66, CLOCK, ephemeris.af2_sps2),
    plain!("af0_s", [(225, 7), (240, 17)], Signed, -33, CLOCK, ephemeris.af0_s),
    plain!("af1_sps", [(257, 5), (270, 17)], Signed, -50, CLOCK, ephemeris.af1_sps),
    element(Field::new("aode", &[(287, 5)], Whole, 0, ORBIT),
        |o| f64::from(o.ephemeris.aodo), |o, v| o.ephemeris.aodo = v as u8),
    plain!("delta_n_radps", [(342, 10), (360, 6)], Semicircles, -43, ORBIT, ephemeris.delta_n_radps),
    plain!("cuc_rad", [(366, 16), (390, 2)], Signed, -31, ORBIT, ephemeris.cuc_rad),
    plain!("m0_rad", [(392, 20), (420, 12)], Turn, -31, ORBIT, ephemeris.m0_rad),
    plain!("eccentricity", [(432, 10), (450, 22)], Unsigned, -33, ORBIT, ephemeris.eccentricity),
    plain!("cus_rad", [(480, 18)], Signed, -31, ORBIT, ephemeris.cus_rad),
    plain!("crc_m", [(498, 4), (510, 14)], Signed, -6, ORBIT, ephemeris.crc_m),
    plain!("crs_m", [(524, 8), (540, 10)], Signed, -6, ORBIT, ephemeris.crs_m),
    plain!("sqrt_a_sqrtm", [(550, 12), (570, 20)], Unsigned, -19, ORBIT, ephemeris.sqrt_a_sqrtm),
    // Two bits in subframe 2, the rest in subframe 3.
    element(Field::new("toe_s", &[(590, 2), (642, 10), (660, 5)], Whole, 3, ORBIT),
        |o| o.ephemeris.toe.tow_s(), |o, v| o.ephemeris.toe = o.ephemeris.toe.nearest_tow(v as i64)),
    plain!("i0_rad", [(665, 17), (690, 15)], Semicircles, -31, ORBIT, ephemeris.i0_rad),
    plain!("cic_rad", [(705, 7), (720, 11)], Signed, -31, ORBIT, ephemeris.cic_rad),
    plain!("omega_dot_radps", [(731, 11), (750, 13)], Semicircles, -43, ORBIT, ephemeris.omega_dot_radps),
    plain!("cis_rad", [(763, 9), (780, 9)], Signed, -31, ORBIT, ephemeris.cis_rad),
    plain!("idot_radps", [(789, 13), (810, 1)], Semicircles, -43, ORBIT, ephemeris.idot_radps),
    plain!("omega0_rad", [(811, 21), (840, 11)], Turn, -31, ORBIT, ephemeris.omega0_rad),
    plain!("omega_rad", [(851, 11), (870, 21)], Turn, -31, ORBIT, ephemeris.omega_rad),
];

pub(super) static D1_SET: [Of; 35] = OF_D1;

/// Bit positions of D1's parameters in D2, in the same order. Page p begins at bit 300 (p − 1).
#[rustfmt::skip]
const IN_D2: [&[(u16, u8)]; 35] = [
    &[(46, 1)], &[(47, 5)], &[(60, 4)], &[(64, 13)], &[(77, 5), (90, 12)], &[(102, 10)], &[(120, 10)],
    // Page 2.
    &[(346, 6), (360, 2)], &[(362, 8)], &[(370, 8)], &[(378, 4), (390, 4)],
    &[(394, 8)], &[(402, 8)], &[(410, 2), (420, 6)], &[(426, 8)],
    // Second drift, offset (page 3), drift (pages 3 and 4), age.
    &[(972, 10), (990, 1)], &[(700, 12), (720, 12)], &[(732, 4), (946, 6), (960, 12)], &[(991, 5)],
    // Mean motion, C_uc (pages 4 and 5), mean anomaly, eccentricity (pages 5 and 6), C_us.
    &[(996, 16)], &[(1020, 14), (1246, 4)], &[(1250, 2), (1260, 22), (1290, 8)],
    &[(1324, 10), (1546, 6), (1560, 16)], &[(1298, 14), (1320, 4)],
    // Page 8: C_rc and C_rs; page 6: root of the axis; page 7: reference time, i0 (and page 8).
    &[(2165, 17), (2190, 1)], &[(2191, 18)], &[(1576, 6), (1590, 22), (1620, 4)], &[(1880, 2), (1890, 15)],
    &[(1905, 7), (1920, 14), (2146, 6), (2160, 5)],
    // C_ic (pages 6 and 7), rate of the node (pages 8 and 9), C_is, rate of the inclination (page 10), node.
    &[(1624, 10), (1846, 6), (1860, 2)], &[(2209, 3), (2220, 16), (2446, 5)], &[(1862, 18)],
    &[(2751, 1), (2760, 13)], &[(2451, 1), (2460, 22), (2490, 9)],
    // Perigee, pages 9 and 10.
    &[(2499, 13), (2520, 14), (2746, 5)],
];

pub(super) static D2_SET: [Of; 35] = in_d2(&OF_D1);

const fn in_d2(of_d1: &[Of; 35]) -> [Of; 35] {
    let mut all = OF_D1;
    let mut index = 0;
    while index < all.len() {
        all[index] = of_d1[index].at(IN_D2[index]);
        index += 1;
    }
    all
}

/// Every field of an ephemeris, by D1 and by D2.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    let of = |table: &'static [Of]| table.iter().map(|element| &element.field).collect();
    vec![("D1", of(&D1_SET)), ("D2", of(&D2_SET))]
}
