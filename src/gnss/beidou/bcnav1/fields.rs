//! The field tables of B-CNAV1: places count from 0, the first bit of a subframe (BDS-SIS-ICD-B1C 1.0,
//! figures 6-5 to 6-9, tables 7-2 to 7-7).

use super::Content;
use crate::gnss::beidou::d1d2::BDT_WEEK;
use crate::gnss::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::gnss::bits::{Element, Field, element, plain};
use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;

/// Step of reference times.
pub(super) const STEP_S: i64 = 300;
/// Semi-major axes from which elements count, of medium orbits and of the others (table 7-5).
const MEDIUM_AXIS_M: f64 = 27_906_100.0;
const HIGH_AXIS_M: f64 = 42_162_200.0;
/// The number of medium orbits (7.4.2): 1 is of geostationary ones, 2 of inclined ones that turn with the
/// Earth.
const MEDIUM: f64 = 3.0;

const TIME: &str = "7.3";
const ORBIT: &str = "7.4, table 7-5";
const CLOCK: &str = "7.5, table 7-6";
const DELAYS: &str = "7.6, table 7-7";
const HEALTH: &str = "7.14 to 7.17";

type Of = Element<Content>;

fn steps(at: Epoch) -> f64 {
    at.tow_s() / STEP_S as f64
}

/// The kind of a satellite's orbit.
pub(super) fn kind(sv: Sv) -> f64 {
    match sv.orbit_m() {
        axis_m if axis_m < 35e6 => MEDIUM,
        _ if sv.is_geostationary() => 1.0,
        _ => 2.0,
    }
}

fn reference_axis_m(content: &Content) -> f64 {
    if content.kind == MEDIUM { MEDIUM_AXIS_M } else { HIGH_AXIS_M }
}

/// All of subframe 2.
#[rustfmt::skip]
pub(super) static SET: [Of; 31] = [
    element(Field::new("week", &[(0, 13)], Whole, 0, TIME),
        |c| (c.sent.week() - BDT_WEEK).rem_euclid(8192) as f64, |_, _| {}),
    element(Field::new("how_1h", &[(13, 8)], Whole, 0, TIME),
        |c| (c.sent.tow_whole_s() / 3600) as f64, |_, _| {}),
    element(Field::new("iodc", &[(21, 10)], Whole, 0, CLOCK),
        |c| f64::from(c.set.iodc), |c, v| c.set.iodc = v as u16),
    element(Field::new("iode", &[(31, 8)], Whole, 0, ORBIT),
        |c| f64::from(c.set.iode), |c, v| c.set.iode = v as u16),
    element(Field::new("toe_5min", &[(39, 11)], Whole, 0, ORBIT),
        |c| steps(c.set.toe), |c, v| c.set.toe = c.set.toe.nearest_tow(v as i64 * STEP_S)),
    plain!("orbit_kind", [(50, 2)], Whole, 0, ORBIT, kind),
    element(Field::new("delta_a_m", &[(52, 26)], Signed, -9, ORBIT),
        |c| c.set.sqrt_a_sqrtm * c.set.sqrt_a_sqrtm - reference_axis_m(c),
        |c, v| c.set.sqrt_a_sqrtm = (v + reference_axis_m(c)).sqrt()),
    plain!("a_rate_mps", [(78, 25)], Signed, -21, ORBIT, set.axis_rate_mps),
    plain!("delta_n_radps", [(103, 17)], Semicircles, -44, ORBIT, set.delta_n_radps),
    plain!("delta_n_rate_radps2", [(120, 23)], Semicircles, -57, ORBIT, set.delta_n_rate_radps2),
    plain!("m0_rad", [(143, 1), (144, 32)], Turn, -32, ORBIT, set.m0_rad),
    plain!("eccentricity", [(176, 1), (177, 32)], Unsigned, -34, ORBIT, set.eccentricity),
    plain!("omega_rad", [(209, 1), (210, 32)], Turn, -32, ORBIT, set.omega_rad),
    plain!("omega0_rad", [(242, 1), (243, 32)], Turn, -32, ORBIT, set.omega0_rad),
    plain!("i0_rad", [(275, 1), (276, 32)], Semicircles, -32, ORBIT, set.i0_rad),
    plain!("omega_dot_radps", [(308, 19)], Semicircles, -44, ORBIT, set.omega_dot_radps),
    plain!("idot_radps", [(327, 15)], Semicircles, -44, ORBIT, set.idot_radps),
    plain!("cis_rad", [(342, 16)], Signed, -30, ORBIT, set.cis_rad),
    plain!("cic_rad", [(358, 16)], Signed, -30, ORBIT, set.cic_rad),
    plain!("crs_m", [(374, 24)], Signed, -8, ORBIT, set.crs_m),
    plain!("crc_m", [(398, 24)], Signed, -8, ORBIT, set.crc_m),
    plain!("cus_rad", [(422, 21)], Signed, -30, ORBIT, set.cus_rad),
    plain!("cuc_rad", [(443, 21)], Signed, -30, ORBIT, set.cuc_rad),
    element(Field::new("toc_5min", &[(464, 11)], Whole, 0, CLOCK),
        |c| steps(c.set.toc), |c, v| c.set.toc = c.set.toc.nearest_tow(v as i64 * STEP_S)),
    plain!("af0_s", [(475, 25)], Signed, -34, CLOCK, set.af0_s),
    plain!("af1_sps", [(500, 22)], Signed, -50, CLOCK, set.af1_sps),
    plain!("af2_sps2", [(522, 11)], Signed, -66, CLOCK, set.af2_sps2),
    plain!("tgd_b2ap_s", [(533, 12)], Signed, -34, DELAYS, set.tgd2_s),
    plain!("isc_b1cd_s", [(545, 12)], Signed, -34, DELAYS, set.isc_s[0]),
    plain!("tgd_b1cp_s", [(557, 12)], Signed, -34, DELAYS, set.tgd_s),
    plain!("reserved", [(569, 7)], Whole, 0, DELAYS, reserved),
];

/// What all pages of subframe 3 begin with.
#[rustfmt::skip]
pub(super) static HEADER: [Of; 4] = [
    plain!("page", [(0, 6)], Whole, 0, HEALTH, page),
    element(Field::new("health", &[(6, 2)], Whole, 0, HEALTH),
        |c| f64::from(c.set.health), |c, v| c.set.health = v as u16),
    plain!("integrity_flags", [(8, 3)], Whole, 0, HEALTH, flags),
    element(Field::new("sismai", &[(11, 4)], Whole, 0, HEALTH),
        |c| f64::from(c.set.ura_index), |c, v| c.set.ura_index = v as u8),
];

/// Every field by the subframe that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    fn of(table: &'static [Of]) -> Vec<&'static Field> {
        table.iter().map(|element| &element.field).collect()
    }
    vec![("subframe 2", of(&SET)), ("subframe 3", of(&HEADER))]
}
