//! The field tables of CNAV: positions count from 0, the first bit of a message (IS-GPS-705J, figures 20-1 to
//! 20-7, tables 20-I to 20-IX).

use super::Content;
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element, fields, plain};
use crate::earth::GPS_PI;
use crate::satellite::{Sv, System};
use crate::time::Epoch;

/// Semi-major axis from which the elements count (table 20-II; IS-QZSS-PNT-005, 5.4).
pub(in crate::gps) fn reference_axis_m(sv: Sv) -> f64 {
    match sv.system {
        System::Qzss => planted!("gnss.qzss.axis", 42_164_200.0, 42_164_000.0),
        _ => 26_559_710.0,
    }
}
/// Rate of the node likewise.
pub(in crate::gps) const REFERENCE_NODE_RADPS: f64 = -2.6e-9 * GPS_PI;
/// Step of reference times.
pub(in crate::gps) const STEP_S: i64 = 300;
/// Bits of health, by carrier.
pub(in crate::gps) const L1: u16 = 1;
pub(in crate::gps) const L2: u16 = 2;
pub(in crate::gps) const L5: u16 = 4;

const HEAD: &str = "20.3.2";
const ORBIT: &str = "20.3.3.1, table 20-I";
const CLOCK: &str = "20.3.3.2, table 20-III";
const DELAYS: &str = "20.3.3.3, table 20-IV";
const UTC: &str = "20.3.3.6, table 20-IX";

type Of = Element<Content>;

fn steps(at: Epoch) -> f64 {
    at.tow_s() / STEP_S as f64
}

fn at_step(near: Epoch, steps: f64) -> Epoch {
    near.nearest_tow(steps as i64 * STEP_S)
}

/// A bit of health.
fn set_bit(health: &mut u16, bit: u16, value: f64) {
    *health = *health & !bit | if value > 0.0 { bit } else { 0 };
}

/// The reference time of the orbit, whose steps are the issue of the ephemeris.
const fn toe(pieces: &'static [(u16, u8)]) -> Of {
    element(
        Field::new("toe_5min", pieces, Whole, 0, ORBIT),
        |c| steps(c.set.toe),
        |c, v| {
            c.set.toe = at_step(c.set.toe, v);
            (c.set.iode, c.set.iodc) = (v as u16, v as u16);
        },
    )
}

/// The time of the prediction, in steps.
const fn top(pieces: &'static [(u16, u8)]) -> Of {
    element(Field::new("top_5min", pieces, Whole, 0, CLOCK), |c| c.top, |c, v| c.top = v)
}

/// Fields with which every message begins. The count is that of the next message (20.3.2).
#[rustfmt::skip]
pub(super) static HEADER: [Of; 5] = [
    plain!("preamble", [(0, 8)], Whole, 0, HEAD, preamble),
    element(Field::new("prn", &[(8, 6)], Whole, 0, HEAD), |c| f64::from(c.set.sv.number), |_, _| {}),
    plain!("type", [(14, 6)], Whole, 0, HEAD, kind),
    plain!("tow_count", [(20, 17)], Whole, 0, HEAD, tow_count),
    plain!("alert", [(37, 1)], Whole, 0, HEAD, alert),
];

#[rustfmt::skip]
pub(super) static ORBIT_1: [Of; 15] = [
    plain!("week", [(38, 13)], Whole, 0, ORBIT, week),
    element(Field::new("l1_health", &[(51, 1)], Whole, 0, ORBIT),
        |c| f64::from(u8::from(c.set.health & L1 > 0)), |c, v| set_bit(&mut c.set.health, L1, v)),
    element(Field::new("l2_health", &[(52, 1)], Whole, 0, ORBIT),
        |c| f64::from(u8::from(c.set.health & L2 > 0)), |c, v| set_bit(&mut c.set.health, L2, v)),
    element(Field::new("l5_health", &[(53, 1)], Whole, 0, ORBIT),
        |c| f64::from(u8::from(c.set.health & L5 > 0)), |c, v| set_bit(&mut c.set.health, L5, v)),
    top(&[(54, 11)]),
    // Two's complement of five bits, as it stands.
    element(Field::new("ura_ed_index", &[(65, 5)], Whole, 0, ORBIT),
        |c| f64::from(c.set.ura_index), |c, v| c.set.ura_index = v as u8),
    toe(&[(70, 11)]),
    element(Field::new("delta_a_m", &[(81, 26)], Signed, -9, ORBIT),
        |c| c.set.sqrt_a_sqrtm * c.set.sqrt_a_sqrtm - reference_axis_m(c.set.sv),
        |c, v| c.set.sqrt_a_sqrtm = (v + reference_axis_m(c.set.sv)).sqrt()),
    plain!("a_rate_mps", [(107, 25)], Signed, -21, ORBIT, set.axis_rate_mps),
    plain!("delta_n_radps", [(132, 17)], Semicircles, -44, ORBIT, set.delta_n_radps),
    plain!("delta_n_rate_radps2", [(149, 23)], Semicircles, -57, ORBIT, set.delta_n_rate_radps2),
    plain!("m0_rad", [(172, 1), (173, 32)], Turn, -32, ORBIT, set.m0_rad),
    plain!("eccentricity", [(205, 1), (206, 32)], Unsigned, -34, ORBIT, set.eccentricity),
    plain!("omega_rad", [(238, 1), (239, 32)], Turn, -32, ORBIT, set.omega_rad),
    plain!("integrity_flags", [(271, 2)], Whole, 0, ORBIT, flags),
];

#[rustfmt::skip]
pub(super) static ORBIT_2: [Of; 11] = [
    toe(&[(38, 11)]),
    plain!("omega0_rad", [(49, 1), (50, 32)], Turn, -32, ORBIT, set.omega0_rad),
    plain!("i0_rad", [(82, 1), (83, 32)], Semicircles, -32, ORBIT, set.i0_rad),
    element(Field::new("delta_omega_dot_radps", &[(115, 17)], Semicircles, -44, ORBIT),
        |c| c.set.omega_dot_radps - REFERENCE_NODE_RADPS,
        |c, v| c.set.omega_dot_radps = v + REFERENCE_NODE_RADPS),
    plain!("idot_radps", [(132, 15)], Semicircles, -44, ORBIT, set.idot_radps),
    plain!("cis_rad", [(147, 16)], Signed, -30, ORBIT, set.cis_rad),
    plain!("cic_rad", [(163, 16)], Signed, -30, ORBIT, set.cic_rad),
    plain!("crs_m", [(179, 24)], Signed, -8, ORBIT, set.crs_m),
    plain!("crc_m", [(203, 24)], Signed, -8, ORBIT, set.crc_m),
    plain!("cus_rad", [(227, 21)], Signed, -30, ORBIT, set.cus_rad),
    plain!("cuc_rad", [(248, 21)], Signed, -30, ORBIT, set.cuc_rad),
];

/// The clock, in all of messages 30 to 37.
#[rustfmt::skip]
pub(super) static CLOCKS: [Of; 8] = [
    top(&[(38, 11)]),
    plain!("ura_ned0_index", [(49, 5)], Signed, 0, CLOCK, ned[0]),
    plain!("ura_ned1_index", [(54, 3)], Whole, 0, CLOCK, ned[1]),
    plain!("ura_ned2_index", [(57, 3)], Whole, 0, CLOCK, ned[2]),
    element(Field::new("toc_5min", &[(60, 11)], Whole, 0, CLOCK),
        |c| steps(c.set.toc), |c, v| c.set.toc = at_step(c.set.toc, v)),
    plain!("af0_s", [(71, 26)], Signed, -35, CLOCK, set.af0_s),
    plain!("af1_sps", [(97, 20)], Signed, -48, CLOCK, set.af1_sps),
    plain!("af2_sps2", [(117, 10)], Signed, -60, CLOCK, set.af2_sps2),
];

/// The rest of message 30.
#[rustfmt::skip]
pub(super) static DELAY: [Of; 14] = [
    plain!("tgd_s", [(127, 13)], Signed, -35, DELAYS, set.tgd_s),
    plain!("isc_l1ca_s", [(140, 13)], Signed, -35, DELAYS, set.isc_s[0]),
    plain!("isc_l2c_s", [(153, 13)], Signed, -35, DELAYS, set.isc_s[1]),
    plain!("isc_l5i5_s", [(166, 13)], Signed, -35, DELAYS, set.isc_s[2]),
    plain!("isc_l5q5_s", [(179, 13)], Signed, -35, DELAYS, set.isc_s[3]),
    plain!("alpha_0", [(192, 8)], Signed, -30, DELAYS, klobuchar.alpha[0]),
    plain!("alpha_1", [(200, 8)], Signed, -27, DELAYS, klobuchar.alpha[1]),
    plain!("alpha_2", [(208, 8)], Signed, -24, DELAYS, klobuchar.alpha[2]),
    plain!("alpha_3", [(216, 8)], Signed, -24, DELAYS, klobuchar.alpha[3]),
    plain!("beta_0", [(224, 8)], Signed, 11, DELAYS, klobuchar.beta[0]),
    plain!("beta_1", [(232, 8)], Signed, 14, DELAYS, klobuchar.beta[1]),
    plain!("beta_2", [(240, 8)], Signed, 16, DELAYS, klobuchar.beta[2]),
    plain!("beta_3", [(248, 8)], Signed, 16, DELAYS, klobuchar.beta[3]),
    plain!("op_week", [(256, 8)], Whole, 0, DELAYS, op_week),
];

/// The rest of message 33.
#[rustfmt::skip]
pub(super) static TIME: [Of; 9] = [
    plain!("utc_a0_s", [(127, 16)], Signed, -35, UTC, utc.a0_s),
    plain!("utc_a1_sps", [(143, 13)], Signed, -51, UTC, utc.a1_sps),
    plain!("utc_a2_sps2", [(156, 7)], Signed, -68, UTC, utc.a2_sps2),
    plain!("utc_leap_s", [(163, 8)], Signed, 0, UTC, utc.leap_s),
    plain!("utc_tot_s", [(171, 16)], Whole, 4, UTC, utc.tot_s),
    plain!("utc_week", [(187, 13)], Whole, 0, UTC, utc.week),
    plain!("utc_event_week", [(200, 13)], Whole, 0, UTC, utc.event_week),
    plain!("utc_event_day", [(213, 4)], Whole, 0, UTC, utc.event_day),
    plain!("utc_leap_after_s", [(217, 8)], Signed, 0, UTC, utc.leap_after_s),
];

/// Lists every field by the message that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![
        ("message 10", fields(&[&HEADER, &ORBIT_1])),
        ("message 11", fields(&[&HEADER, &ORBIT_2])),
        ("message 30", fields(&[&HEADER, &CLOCKS, &DELAY])),
        ("message 33", fields(&[&HEADER, &CLOCKS, &TIME])),
    ]
}
