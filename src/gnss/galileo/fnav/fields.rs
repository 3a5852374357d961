//! The field tables of F/NAV: positions count from 0, the first bit of a page after its pattern (Galileo OS
//! SIS ICD 2.1, tables 29 to 35).

use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element, fields, plain};
use crate::galileo::inav::GST_WEEK;
use crate::galileo::inav::almanac::{self, Entry, Offset, Triple, of};
use crate::galileo::inav::fields::{
    CLOCK, DELAY, IONOSPHERE, ISSUE, MINUTE_S, ORBIT, Orbit, TIME, UTC, Utc, tow, week,
};
use crate::galileo::status::E5A;
use crate::time::WEEK_S;

type Of = Element<Orbit>;

const ALMANAC: &str = "5.1.10, table 71";
const OFFSET: &str = "5.1.8, table 69";
const STATUS: &str = "5.1.9.7";

#[rustfmt::skip]
pub(super) static PAGE_1: [Of; 15] = [
    element(Field::new("svid", &[(6, 6)], Whole, 0, "5.1.9.3"), |o| f64::from(o.ephemeris.sv.number), |_, _| {}),
    ISSUE.at(&[(12, 10)]),
    element(Field::new("toc_min", &[(22, 14)], Whole, 0, CLOCK),
        |o| o.ephemeris.toc.tow_s() / MINUTE_S,
        |o, v| o.ephemeris.toc = o.ephemeris.toc.nearest_tow((v * MINUTE_S) as i64)),
    plain!("af0_s", [(36, 31)], Signed, -34, CLOCK, ephemeris.af0_s),
    plain!("af1_sps", [(67, 21)], Signed, -46, CLOCK, ephemeris.af1_sps),
    plain!("af2_sps2", [(88, 6)], Signed, -59, CLOCK, ephemeris.af2_sps2),
    element(Field::new("sisa_index", &[(94, 8)], Whole, 0, "5.1.12, table 90"),
        |o| f64::from(o.ephemeris.ura_index), |o, v| o.ephemeris.ura_index = v as u8),
    plain!("ai0_sfu", [(102, 11)], Unsigned, -2, IONOSPHERE, nequick[0]),
    plain!("ai1_sfupdeg", [(113, 11)], Signed, -8, IONOSPHERE, nequick[1]),
    plain!("ai2_sfupdeg2", [(124, 14)], Signed, -15, IONOSPHERE, nequick[2]),
    plain!("bgd_e1_e5a_s", [(143, 10)], Signed, -32, DELAY, ephemeris.tgd2_s),
    element(Field::new("e5a_health", &[(153, 2)], Whole, 0, STATUS),
        |o| E5A.health(&o.ephemeris), |o, v| E5A.set_health(&mut o.ephemeris, v)),
    week(&[(155, 12)]),
    tow(&[(167, 20)]),
    element(Field::new("e5a_data_validity", &[(187, 1)], Whole, 0, "5.1.9.6"),
        |o| E5A.validity(&o.ephemeris), |o, v| E5A.set_validity(&mut o.ephemeris, v)),
];

#[rustfmt::skip]
pub(super) static PAGE_2: [Of; 9] = [
    ISSUE,
    plain!("m0_rad", [(16, 32)], Turn, -31, ORBIT, ephemeris.m0_rad),
    plain!("omega_dot_radps", [(48, 24)], Semicircles, -43, ORBIT, ephemeris.omega_dot_radps),
    plain!("eccentricity", [(72, 32)], Unsigned, -33, ORBIT, ephemeris.eccentricity),
    plain!("sqrt_a_sqrtm", [(104, 32)], Unsigned, -19, ORBIT, ephemeris.sqrt_a_sqrtm),
    plain!("omega0_rad", [(136, 32)], Turn, -31, ORBIT, ephemeris.omega0_rad),
    plain!("idot_radps", [(168, 14)], Semicircles, -43, ORBIT, ephemeris.idot_radps),
    week(&[(182, 12)]),
    tow(&[(194, 20)]),
];

#[rustfmt::skip]
pub(super) static PAGE_3: [Of; 11] = [
    ISSUE,
    plain!("i0_rad", [(16, 32)], Semicircles, -31, ORBIT, ephemeris.i0_rad),
    plain!("omega_rad", [(48, 32)], Turn, -31, ORBIT, ephemeris.omega_rad),
    plain!("delta_n_radps", [(80, 16)], Semicircles, -43, ORBIT, ephemeris.delta_n_radps),
    plain!("cuc_rad", [(96, 16)], Signed, -29, ORBIT, ephemeris.cuc_rad),
    plain!("cus_rad", [(112, 16)], Signed, -29, ORBIT, ephemeris.cus_rad),
    plain!("crc_m", [(128, 16)], Signed, -5, ORBIT, ephemeris.crc_m),
    plain!("crs_m", [(144, 16)], Signed, -5, ORBIT, ephemeris.crs_m),
    element(Field::new("toe_min", &[(160, 14)], Whole, 0, ORBIT),
        |o| o.ephemeris.toe.tow_s() / MINUTE_S,
        |o, v| o.ephemeris.toe = o.ephemeris.toe.nearest_tow((v * MINUTE_S) as i64)),
    week(&[(174, 12)]),
    tow(&[(186, 20)]),
];

/// Fields of page 4 that belong to the ephemeris.
#[rustfmt::skip]
pub(super) static PAGE_4: [Of; 3] = [
    ISSUE,
    plain!("cic_rad", [(16, 16)], Signed, -29, ORBIT, ephemeris.cic_rad),
    plain!("cis_rad", [(32, 16)], Signed, -29, ORBIT, ephemeris.cis_rad),
];

/// Fields of page 4 for UTC, with the UTC parameters' own reference time.
#[rustfmt::skip]
pub(super) static PAGE_4_UTC: [Element<Utc>; 9] = [
    plain!("utc_a0_s", [(48, 32)], Signed, -30, UTC, a0_s),
    plain!("utc_a1_sps", [(80, 24)], Signed, -50, UTC, a1_sps),
    element(Field::new("utc_leap_s", &[(104, 8)], Signed, 0, UTC), |u| u.leap_s as f64, |u, v| u.leap_s = v as i64),
    element(Field::new("utc_t0_h", &[(112, 8)], Whole, 0, UTC),
        |u| u.reference.1 as f64, |u, v| u.reference.1 = v as i64),
    element(Field::new("utc_week", &[(120, 8)], Whole, 0, UTC),
        |u| (u.reference.0 - GST_WEEK).rem_euclid(256) as f64, |u, v| u.reference.0 = v as i64 + GST_WEEK),
    element(Field::new("utc_event_week", &[(128, 8)], Whole, 0, UTC),
        |u| (u.event.0 - GST_WEEK).rem_euclid(256) as f64, |u, v| u.event.0 = v as i64 + GST_WEEK),
    element(Field::new("utc_event_day", &[(136, 3)], Whole, 0, UTC),
        |u| u.event.1 as f64, |u, v| u.event.1 = v as i64),
    element(Field::new("utc_leap_after_s", &[(139, 8)], Signed, 0, UTC),
        |u| u.leap_after_s as f64, |u, v| u.leap_after_s = v as i64),
    element(Field::new("tow_s", &[(189, 20)], Whole, 0, TIME),
        |u| (u.sent_s % WEEK_S) as f64, |u, v| u.sent_s = v as i64),
];

/// Fields of page 4 for the offset of the system's time ahead of GPS time, in the order of decoding.
#[rustfmt::skip]
pub(super) static PAGE_4_GPS: [Element<Offset>; 4] = [
    element(Field::new("ggto_a0_s", &[(155, 16)], Signed, -35, OFFSET), |o| o.field(0), |_, _| {}),
    element(Field::new("ggto_a1_sps", &[(171, 12)], Signed, -51, OFFSET), |o| o.field(1), |_, _| {}),
    element(Field::new("ggto_t0_h", &[(147, 8)], Whole, 0, OFFSET), |o| o.field(2), |_, _| {}),
    element(Field::new("ggto_week", &[(183, 6)], Whole, 0, OFFSET), |o| o.field(3), |_, _| {}),
];

/// The longitude of the second satellite's node, of which page 5 has the first four bits of sixteen and page
/// 6 the others.
const SPLIT: Field = Field::new("omega0_rad", &[(0, 16)], Turn, -15, ALMANAC);
const SPLIT_LOW_BITS: u32 = 12;

/// The bits of the split node as an integer.
fn split(entry: &Entry) -> i64 {
    SPLIT.raw(entry.omega0_rad).unwrap_or(0).rem_euclid(1 << 16)
}

/// Puts some bits of the split node in the field of others.
fn join(entry: &mut Entry, mask: i64, bits: i64) {
    let raw = split(entry) & !mask | bits & mask;
    entry.omega0_rad = SPLIT.value(if raw >= 1 << 15 { raw - (1 << 16) } else { raw });
}

#[rustfmt::skip]
pub(super) static PAGE_5: [Element<Triple>; 20] = [
    almanac::ISSUE,
    almanac::WEEK,
    almanac::TOA,
    of!(0, number, 22),
    of!(0, delta_sqrt_a_sqrtm, 28, 13, Signed, -9),
    of!(0, eccentricity, 41, 11, Unsigned, -16),
    of!(0, omega_rad, 52, 16, Turn, -15),
    of!(0, delta_i_rad, 68, 11, Semicircles, -14),
    of!(0, omega0_rad, 79, 16, Turn, -15),
    of!(0, omega_dot_radps, 95, 11, Semicircles, -33),
    of!(0, m0_rad, 106, 16, Turn, -15),
    of!(0, af0_s, 122, 16, Signed, -19),
    of!(0, af1_sps, 138, 13, Signed, -38),
    of!(0, e5a_health, 151, status),
    of!(1, number, 153),
    of!(1, delta_sqrt_a_sqrtm, 159, 13, Signed, -9),
    of!(1, eccentricity, 172, 11, Unsigned, -16),
    of!(1, omega_rad, 183, 16, Turn, -15),
    of!(1, delta_i_rad, 199, 11, Semicircles, -14),
    element(Field::new("omega0_high", &[(210, 4)], Whole, 0, ALMANAC),
        |t| (split(&t.entries[1]) >> SPLIT_LOW_BITS) as f64,
        |t, v| join(&mut t.entries[1], 0xF000, (v as i64) << SPLIT_LOW_BITS)),
];

#[rustfmt::skip]
pub(super) static PAGE_6: [Element<Triple>; 18] = [
    almanac::ISSUE,
    element(Field::new("omega0_low", &[(10, 12)], Whole, 0, ALMANAC),
        |t| (split(&t.entries[1]) & 0xFFF) as f64,
        |t, v| join(&mut t.entries[1], 0xFFF, v as i64)),
    of!(1, omega_dot_radps, 22, 11, Semicircles, -33),
    of!(1, m0_rad, 33, 16, Turn, -15),
    of!(1, af0_s, 49, 16, Signed, -19),
    of!(1, af1_sps, 65, 13, Signed, -38),
    of!(1, e5a_health, 78, status),
    of!(2, number, 80),
    of!(2, delta_sqrt_a_sqrtm, 86, 13, Signed, -9),
    of!(2, eccentricity, 99, 11, Unsigned, -16),
    of!(2, omega_rad, 110, 16, Turn, -15),
    of!(2, delta_i_rad, 126, 11, Semicircles, -14),
    of!(2, omega0_rad, 137, 16, Turn, -15),
    of!(2, omega_dot_radps, 153, 11, Semicircles, -33),
    of!(2, m0_rad, 164, 16, Turn, -15),
    of!(2, af0_s, 180, 16, Signed, -19),
    of!(2, af1_sps, 196, 13, Signed, -38),
    of!(2, e5a_health, 209, status),
];

/// Lists every field by the page that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![
        ("page 1", fields(&[&PAGE_1])),
        ("page 2", fields(&[&PAGE_2])),
        ("page 3", fields(&[&PAGE_3])),
        ("page 4", [fields(&[&PAGE_4]), fields(&[&PAGE_4_UTC]), fields(&[&PAGE_4_GPS])].concat()),
        ("page 5", fields(&[&PAGE_5])),
        ("page 6", fields(&[&PAGE_6])),
    ]
}
