//! The field tables of NavIC's message on L1: positions count from 0, the first bit of a subframe (NavIC SPS
//! ICD for L1 1.0, subframe 2 and message type 10 of subframe 3).

use super::Content;
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element, fields, plain};
use crate::time::Epoch;

const TIME: &str = "subframe 2, time and health";
const ORBIT: &str = "subframe 2, ephemeris parameters";
const CLOCK: &str = "subframe 2, clock parameters";
const DELAYS: &str = "subframe 2, group delays";
const HEAD: &str = "subframe 3, header";
const ELECTRONS: &str = "message type 10";

/// Reference value of the semi-major axis, in metres.
const REFERENCE_AXIS_M: f64 = 42_164_200.0;
/// Step of the reference time of orbit and clock.
pub(super) const STEP_S: i64 = 300;

type Of = Element<Content>;

fn steps(at: Epoch) -> f64 {
    at.tow_s() / STEP_S as f64
}

/// All of subframe 2. The clock's reference time is that of the orbit.
#[rustfmt::skip]
pub(super) static SET: [Of; 32] = [
    plain!("week", [(0, 13)], Whole, 0, TIME, week),
    plain!("itow_2h", [(13, 8)], Whole, 0, TIME, itow),
    plain!("alert", [(21, 1)], Whole, 0, TIME, alert),
    element(Field::new("l1_health", &[(22, 1)], Whole, 0, TIME),
        |c| f64::from(u8::from(c.set.health > 0)), |c, v| c.set.health = v as u16),
    element(Field::new("iodec", &[(23, 4)], Whole, 0, TIME),
        |c| f64::from(c.set.iode), |c, v| (c.set.iode, c.set.iodc) = (v as u16, v as u16)),
    // Two's complement of five bits, as it stands.
    element(Field::new("ura_index", &[(27, 5)], Whole, 0, ORBIT),
        |c| f64::from(c.set.ura_index), |c, v| c.set.ura_index = v as u8),
    element(Field::new("toe_5min", &[(32, 11)], Whole, 0, ORBIT),
        |c| steps(c.set.toe),
        |c, v| {
            c.set.toe = c.set.toe.nearest_tow(v as i64 * STEP_S);
            c.set.toc = c.set.toe;
        }),
    element(Field::new("delta_a_m", &[(43, 26)], Signed, -9, ORBIT),
        |c| c.set.sqrt_a_sqrtm * c.set.sqrt_a_sqrtm - REFERENCE_AXIS_M,
        |c, v| c.set.sqrt_a_sqrtm = (v + REFERENCE_AXIS_M).sqrt()),
    plain!("a_rate_mps", [(69, 26)], Signed, -21, ORBIT, set.axis_rate_mps),
    plain!("delta_n_radps", [(95, 19)], Semicircles, -44, ORBIT, set.delta_n_radps),
    plain!("delta_n_rate_radps2", [(114, 23)], Semicircles, -57, ORBIT, set.delta_n_rate_radps2),
    plain!("m0_rad", [(137, 1), (138, 32)], Turn, -32, ORBIT, set.m0_rad),
    plain!("eccentricity", [(170, 1), (171, 32)], Unsigned, -34, ORBIT, set.eccentricity),
    plain!("omega_rad", [(203, 1), (204, 32)], Turn, -32, ORBIT, set.omega_rad),
    plain!("omega0_rad", [(236, 1), (237, 32)], Turn, -32, ORBIT, set.omega0_rad),
    plain!("omega_dot_radps", [(269, 25)], Semicircles, -44, ORBIT, set.omega_dot_radps),
    plain!("i0_rad", [(294, 1), (295, 32)], Semicircles, -32, ORBIT, set.i0_rad),
    plain!("idot_radps", [(327, 15)], Semicircles, -44, ORBIT, set.idot_radps),
    plain!("cis_rad", [(342, 16)], Signed, -30, ORBIT, set.cis_rad),
    plain!("cic_rad", [(358, 16)], Signed, -30, ORBIT, set.cic_rad),
    plain!("crs_m", [(374, 24)], Signed, -8, ORBIT, set.crs_m),
    plain!("crc_m", [(398, 24)], Signed, -8, ORBIT, set.crc_m),
    plain!("cus_rad", [(422, 21)], Signed, -30, ORBIT, set.cus_rad),
    plain!("cuc_rad", [(443, 21)], Signed, -30, ORBIT, set.cuc_rad),
    plain!("af0_s", [(464, 29)], Signed, -35, CLOCK, set.af0_s),
    plain!("af1_sps", [(493, 22)], Signed, -50, CLOCK, set.af1_sps),
    plain!("af2_sps2", [(515, 15)], Signed, -66, CLOCK, set.af2_sps2),
    plain!("tgd_s", [(530, 12)], Signed, -35, DELAYS, set.tgd_s),
    plain!("isc_first_s", [(542, 12)], Signed, -35, DELAYS, set.isc_s[4]),
    plain!("isc_second_s", [(554, 12)], Signed, -35, DELAYS, set.isc_s[5]),
    element(Field::new("reference_flag", &[(566, 1)], Whole, 0, DELAYS),
        |c| f64::from(c.set.reference_flag), |c, v| c.set.reference_flag = v as u8),
    element(Field::new("prn", &[(570, 6)], Whole, 0, TIME), |c| f64::from(c.set.sv.prn()), |_, _| {}),
];

/// Fields with which every message of subframe 3 begins: its type, and a flag for "must not be used".
#[rustfmt::skip]
pub(super) static HEADER: [Of; 2] = [
    plain!("message_type", [(0, 6)], Whole, 0, HEAD, kind),
    plain!("message_invalid", [(6, 1)], Whole, 0, HEAD, invalid),
];

/// Message type 10 behind the Earth's orientation: the ionosphere, and the region that it is for.
#[rustfmt::skip]
pub(super) static IONOSPHERE: [Of; 13] = [
    plain!("alpha_0", [(145, 8)], Signed, -30, ELECTRONS, klobuchar.alpha[0]),
    plain!("alpha_1", [(153, 8)], Signed, -27, ELECTRONS, klobuchar.alpha[1]),
    plain!("alpha_2", [(161, 10)], Signed, -24, ELECTRONS, klobuchar.alpha[2]),
    plain!("alpha_3", [(171, 12)], Signed, -24, ELECTRONS, klobuchar.alpha[3]),
    plain!("beta_0", [(183, 8)], Signed, 11, ELECTRONS, klobuchar.beta[0]),
    plain!("beta_1", [(191, 8)], Signed, 14, ELECTRONS, klobuchar.beta[1]),
    plain!("beta_2", [(199, 11)], Signed, 16, ELECTRONS, klobuchar.beta[2]),
    plain!("beta_3", [(210, 14)], Signed, 16, ELECTRONS, klobuchar.beta[3]),
    plain!("region_east_5deg", [(224, 6)], Whole, 0, ELECTRONS, region_5deg[1]),
    plain!("region_west_5deg", [(230, 6)], Whole, 0, ELECTRONS, region_5deg[0]),
    plain!("region_north_5deg", [(236, 5)], Signed, 0, ELECTRONS, region_5deg[3]),
    plain!("region_south_5deg", [(241, 5)], Signed, 0, ELECTRONS, region_5deg[2]),
    plain!("iodk", [(246, 2)], Whole, 0, ELECTRONS, iodk),
];

/// Lists every field by the subframe that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![("subframe 2", fields(&[&SET])), ("subframe 3, message 10", fields(&[&HEADER, &IONOSPHERE]))]
}
