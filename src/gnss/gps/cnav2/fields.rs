//! The field tables of CNAV-2: positions count from 0, the first bit of a subframe (IS-GPS-800J, figures
//! 3.5-1 to 3.5-2, tables 3.5-1 to 3.5-3).

use super::Content;
use super::almanac::{OF_MEDIUM, OF_REDUCED};
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element, fields, plain};
use crate::gps::cnav::{REFERENCE_NODE_RADPS, STEP_S, reference_axis_m};
use crate::time::Epoch;

const TIME: &str = "3.5.3.1 to 3.5.3.4";
const ORBIT: &str = "3.5.3.6, table 3.5-1";
const CLOCK: &str = "3.5.3.7, table 3.5-1";
const DELAYS: &str = "3.5.3.9, table 3.5-1";
const HEAD: &str = "3.5.4.1";
const UTC: &str = "3.5.4.1.1, table 3.5-2";
const IONOSPHERE: &str = "3.5.4.1.2, table 3.5-2";
const CORRECTIONS: &str = "3.5.4.1.3, table 3.5-3";

type Of = Element<Content>;

fn steps(at: Epoch) -> f64 {
    at.tow_s() / STEP_S as f64
}

/// All of subframe 2: time, health, orbit, clock and the delays of L1C. The clock's reference time is that of
/// the orbit, whose steps are the issue of the ephemeris.
#[rustfmt::skip]
pub(super) static SET: [Of; 34] = [
    plain!("week", [(0, 13)], Whole, 0, TIME, week),
    plain!("itow_2h", [(13, 8)], Whole, 0, TIME, itow),
    plain!("top_5min", [(21, 11)], Whole, 0, TIME, top),
    element(Field::new("l1c_health", &[(32, 1)], Whole, 0, TIME),
        |c| f64::from(u8::from(c.set.health > 0)), |c, v| c.set.health = v as u16),
    // Two's complement of five bits, as it stands.
    element(Field::new("ura_ed_index", &[(33, 5)], Whole, 0, ORBIT),
        |c| f64::from(c.set.ura_index), |c, v| c.set.ura_index = v as u8),
    element(Field::new("toe_5min", &[(38, 11)], Whole, 0, ORBIT),
        |c| steps(c.set.toe),
        |c, v| {
            c.set.toe = c.set.toe.nearest_tow(v as i64 * STEP_S);
            c.set.toc = c.set.toe;
            (c.set.iode, c.set.iodc) = (v as u16, v as u16);
        }),
    element(Field::new("delta_a_m", &[(49, 26)], Signed, -9, ORBIT),
        |c| c.set.sqrt_a_sqrtm * c.set.sqrt_a_sqrtm - reference_axis_m(c.set.sv),
        |c, v| c.set.sqrt_a_sqrtm = (v + reference_axis_m(c.set.sv)).sqrt()),
    plain!("a_rate_mps", [(75, 25)], Signed, -21, ORBIT, set.axis_rate_mps),
    plain!("delta_n_radps", [(100, 17)], Semicircles, -44, ORBIT, set.delta_n_radps),
    plain!("delta_n_rate_radps2", [(117, 23)], Semicircles, -57, ORBIT, set.delta_n_rate_radps2),
    plain!("m0_rad", [(140, 1), (141, 32)], Turn, -32, ORBIT, set.m0_rad),
    plain!("eccentricity", [(173, 1), (174, 32)], Unsigned, -34, ORBIT, set.eccentricity),
    plain!("omega_rad", [(206, 1), (207, 32)], Turn, -32, ORBIT, set.omega_rad),
    plain!("omega0_rad", [(239, 1), (240, 32)], Turn, -32, ORBIT, set.omega0_rad),
    plain!("i0_rad", [(272, 1), (273, 32)], Semicircles, -32, ORBIT, set.i0_rad),
    element(Field::new("delta_omega_dot_radps", &[(305, 17)], Semicircles, -44, ORBIT),
        |c| c.set.omega_dot_radps - REFERENCE_NODE_RADPS,
        |c, v| c.set.omega_dot_radps = v + REFERENCE_NODE_RADPS),
    plain!("idot_radps", [(322, 15)], Semicircles, -44, ORBIT, set.idot_radps),
    plain!("cis_rad", [(337, 16)], Signed, -30, ORBIT, set.cis_rad),
    plain!("cic_rad", [(353, 16)], Signed, -30, ORBIT, set.cic_rad),
    plain!("crs_m", [(369, 24)], Signed, -8, ORBIT, set.crs_m),
    plain!("crc_m", [(393, 24)], Signed, -8, ORBIT, set.crc_m),
    plain!("cus_rad", [(417, 21)], Signed, -30, ORBIT, set.cus_rad),
    plain!("cuc_rad", [(438, 21)], Signed, -30, ORBIT, set.cuc_rad),
    plain!("ura_ned0_index", [(459, 5)], Signed, 0, CLOCK, ned[0]),
    plain!("ura_ned1_index", [(464, 3)], Whole, 0, CLOCK, ned[1]),
    plain!("ura_ned2_index", [(467, 3)], Whole, 0, CLOCK, ned[2]),
    plain!("af0_s", [(470, 26)], Signed, -35, CLOCK, set.af0_s),
    plain!("af1_sps", [(496, 20)], Signed, -48, CLOCK, set.af1_sps),
    plain!("af2_sps2", [(516, 10)], Signed, -60, CLOCK, set.af2_sps2),
    plain!("tgd_s", [(526, 13)], Signed, -35, DELAYS, set.tgd_s),
    plain!("isc_l1cp_s", [(539, 13)], Signed, -35, DELAYS, set.isc_s[4]),
    plain!("isc_l1cd_s", [(552, 13)], Signed, -35, DELAYS, set.isc_s[5]),
    plain!("integrity_flag", [(565, 1)], Whole, 0, TIME, flag),
    plain!("op_week", [(566, 8)], Whole, 0, TIME, op_week),
];

/// Fields with which every page of subframe 3 begins.
#[rustfmt::skip]
pub(super) static HEADER: [Of; 2] = [
    element(Field::new("prn", &[(0, 8)], Whole, 0, HEAD), |c| f64::from(c.set.sv.prn()), |_, _| {}),
    plain!("page", [(8, 6)], Whole, 0, HEAD, page),
];

/// Fields of page 1 of subframe 3 for the delays of other signals and the ionosphere.
#[rustfmt::skip]
pub(super) static DELAY: [Of; 12] = [
    plain!("alpha_0", [(112, 8)], Signed, -30, IONOSPHERE, klobuchar.alpha[0]),
    plain!("alpha_1", [(120, 8)], Signed, -27, IONOSPHERE, klobuchar.alpha[1]),
    plain!("alpha_2", [(128, 8)], Signed, -24, IONOSPHERE, klobuchar.alpha[2]),
    plain!("alpha_3", [(136, 8)], Signed, -24, IONOSPHERE, klobuchar.alpha[3]),
    plain!("beta_0", [(144, 8)], Signed, 11, IONOSPHERE, klobuchar.beta[0]),
    plain!("beta_1", [(152, 8)], Signed, 14, IONOSPHERE, klobuchar.beta[1]),
    plain!("beta_2", [(160, 8)], Signed, 16, IONOSPHERE, klobuchar.beta[2]),
    plain!("beta_3", [(168, 8)], Signed, 16, IONOSPHERE, klobuchar.beta[3]),
    plain!("isc_l1ca_s", [(176, 13)], Signed, -35, CORRECTIONS, set.isc_s[0]),
    plain!("isc_l2c_s", [(189, 13)], Signed, -35, CORRECTIONS, set.isc_s[1]),
    plain!("isc_l5i5_s", [(202, 13)], Signed, -35, CORRECTIONS, set.isc_s[2]),
    plain!("isc_l5q5_s", [(215, 13)], Signed, -35, CORRECTIONS, set.isc_s[3]),
];

/// Fields of page 1 of subframe 3 for UTC.
#[rustfmt::skip]
pub(super) static OF_UTC: [Of; 9] = [
    plain!("utc_a0_s", [(14, 16)], Signed, -35, UTC, utc.a0_s),
    plain!("utc_a1_sps", [(30, 13)], Signed, -51, UTC, utc.a1_sps),
    plain!("utc_a2_sps2", [(43, 7)], Signed, -68, UTC, utc.a2_sps2),
    plain!("utc_leap_s", [(50, 8)], Signed, 0, UTC, utc.leap_s),
    plain!("utc_tot_s", [(58, 16)], Whole, 4, UTC, utc.tot_s),
    plain!("utc_week", [(74, 13)], Whole, 0, UTC, utc.week),
    plain!("utc_event_week", [(87, 13)], Whole, 0, UTC, utc.event_week),
    plain!("utc_event_day", [(100, 4)], Whole, 0, UTC, utc.event_day),
    plain!("utc_leap_after_s", [(104, 8)], Signed, 0, UTC, utc.leap_after_s),
];

/// Lists every field by the subframe that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![
        ("subframe 2", fields(&[&SET])),
        ("subframe 3, page 1", fields(&[&HEADER, &OF_UTC, &DELAY])),
        ("subframe 3, page 3", fields(&OF_REDUCED)),
        ("subframe 3, page 4", fields(&OF_MEDIUM)),
    ]
}
