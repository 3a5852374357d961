//! The field table: where each parameter of the message stands, and what its integer means.
//!
//! Source: IS-GPS-200N, figure 20-1 (places) and tables 20-I, 20-III, 20-VI, 20-IX and 20-X (lengths and
//! scales). A field is read and written through the same entry. Places are the document's: bit 1 is
//! the first of a subframe's 300, parity included.

use super::almanac::{Almanac, Utc};
use crate::gnss::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::gnss::bits::{Element, Field, Store, element};
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::klobuchar::Klobuchar;

/// Ten words of 24 data bits; bit 1 is the first of a subframe's 300, parity included.
impl Store for [u32; 10] {
    fn piece(&self, piece: (u16, u8)) -> u32 {
        let (word, shift, mask) = place(piece);
        self.get(word).map_or(0, |bits| (bits >> shift) & mask)
    }

    fn set_piece(&mut self, piece: (u16, u8), value: u32) {
        let (word, shift, mask) = place(piece);
        if let Some(bits) = self.get_mut(word) {
            *bits = (*bits & !(mask << shift)) | ((value & mask) << shift);
        }
    }
}

/// Word (from 0), shift inside its 24 data bits and mask of a piece.
fn place((first, length): (u16, u8)) -> (usize, u32, u32) {
    let first = planted!("gnss.lnav.field_place", first, if (first, length) == (151, 16) { 152 } else { first });
    let offset = u32::from(first - 1) % 30;
    (usize::from(first - 1) / 30, (24 - offset).saturating_sub(u32::from(length)), (1 << length) - 1)
}

const ORBIT: &str = "20.3.3.4.1, table 20-III";
const CLOCK: &str = "20.3.3.3.3, table 20-I";
const ALMANAC: &str = "20.3.3.5.1.2, table 20-VI";
const CORRECTIONS: &str = "20.3.3.5.2.4, table 20-IX";
const IONOSPHERE: &str = "20.3.3.5.2.5, table 20-X";

/// Clock and health (figure 20-1, sheet 1). The week is that of `transmitted`; what sets it is the caller.
#[rustfmt::skip]
pub(super) static SUBFRAME_1: [Element<Ephemeris>; 11] = [
    element(Field::new("week", &[(61, 10)], Whole, 0, "20.3.3.3.1.1"), |e| e.transmitted.week().rem_euclid(1024) as f64, |_, _| {}),
    element(Field::new("l2_codes", &[(71, 2)], Whole, 0, "20.3.3.3.1.2"), |e| f64::from(e.l2_codes), |e, v| e.l2_codes = v as u8),
    element(Field::new("ura_index", &[(73, 4)], Whole, 0, "20.3.3.3.1.3"), |e| f64::from(e.ura_index), |e, v| e.ura_index = v as u8),
    element(Field::new("health", &[(77, 6)], Whole, 0, "20.3.3.3.1.4"), |e| f64::from(e.health), |e, v| e.health = v as u8),
    element(Field::new("iodc", &[(83, 2), (211, 8)], Whole, 0, "20.3.3.3.1.5"), |e| f64::from(e.iodc), |e, v| e.iodc = v as u16),
    element(Field::new("l2_p_data_off", &[(91, 1)], Whole, 0, "20.3.3.3.1.6"), |e| f64::from(u8::from(e.l2_p_data_off)), |e, v| e.l2_p_data_off = v > 0.0),
    element(Field::new("tgd_s", &[(197, 8)], Signed, -31, CLOCK), |e| e.tgd_s, |e, v| e.tgd_s = v),
    element(Field::new("toc_s", &[(219, 16)], Whole, 4, CLOCK), |e| e.toc.tow_s(), |e, v| e.toc = e.toc.nearest_tow(v as i64)),
    element(Field::new("af2_sps2", &[(241, 8)], Signed, -55, CLOCK), |e| e.af2_sps2, |e, v| e.af2_sps2 = v),
    element(Field::new("af1_sps", &[(249, 16)], Signed, -43, CLOCK), |e| e.af1_sps, |e, v| e.af1_sps = v),
    element(Field::new("af0_s", &[(271, 22)], Signed, -31, CLOCK), |e| e.af0_s, |e, v| e.af0_s = v),
];

/// Orbit, first half (figure 20-1, sheet 2).
#[rustfmt::skip]
pub(super) static SUBFRAME_2: [Element<Ephemeris>; 11] = [
    element(Field::new("iode", &[(61, 8)], Whole, 0, "20.3.3.4.1"), |e| f64::from(e.iode), |e, v| e.iode = v as u16),
    element(Field::new("crs_m", &[(69, 16)], Signed, -5, ORBIT), |e| e.crs_m, |e, v| e.crs_m = v),
    element(Field::new("delta_n_radps", &[(91, 16)], Semicircles, -43, ORBIT), |e| e.delta_n_radps, |e, v| e.delta_n_radps = v),
    element(Field::new("m0_rad", &[(107, 8), (121, 24)], Turn, -31, ORBIT), |e| e.m0_rad, |e, v| e.m0_rad = v),
    element(Field::new("cuc_rad", &[(151, 16)], Signed, -29, ORBIT), |e| e.cuc_rad, |e, v| e.cuc_rad = v),
    element(Field::new("eccentricity", &[(167, 8), (181, 24)], Unsigned, -33, ORBIT), |e| e.eccentricity, |e, v| e.eccentricity = v),
    element(Field::new("cus_rad", &[(211, 16)], Signed, -29, ORBIT), |e| e.cus_rad, |e, v| e.cus_rad = v),
    element(Field::new("sqrt_a_sqrtm", &[(227, 8), (241, 24)], Unsigned, -19, ORBIT), |e| e.sqrt_a_sqrtm, |e, v| e.sqrt_a_sqrtm = v),
    element(Field::new("toe_s", &[(271, 16)], Whole, 4, ORBIT), |e| e.toe.tow_s(), |e, v| e.toe = e.toe.nearest_tow(v as i64)),
    element(Field::new("long_fit", &[(287, 1)], Whole, 0, "20.3.3.4.3.1"), |e| f64::from(u8::from(e.long_fit)), |e, v| e.long_fit = v > 0.0),
    element(Field::new("aodo", &[(288, 5)], Whole, 0, "20.3.3.4.4"), |e| f64::from(e.aodo), |e, v| e.aodo = v as u8),
];

/// Orbit, second half (figure 20-1, sheet 3).
#[rustfmt::skip]
pub(super) static SUBFRAME_3: [Element<Ephemeris>; 9] = [
    element(Field::new("cic_rad", &[(61, 16)], Signed, -29, ORBIT), |e| e.cic_rad, |e, v| e.cic_rad = v),
    element(Field::new("omega0_rad", &[(77, 8), (91, 24)], Turn, -31, ORBIT), |e| e.omega0_rad, |e, v| e.omega0_rad = v),
    element(Field::new("cis_rad", &[(121, 16)], Signed, -29, ORBIT), |e| e.cis_rad, |e, v| e.cis_rad = v),
    element(Field::new("i0_rad", &[(137, 8), (151, 24)], Semicircles, -31, ORBIT), |e| e.i0_rad, |e, v| e.i0_rad = v),
    element(Field::new("crc_m", &[(181, 16)], Signed, -5, ORBIT), |e| e.crc_m, |e, v| e.crc_m = v),
    element(Field::new("omega_rad", &[(197, 8), (211, 24)], Turn, -31, ORBIT), |e| e.omega_rad, |e, v| e.omega_rad = v),
    element(Field::new("omega_dot_radps", &[(241, 24)], Semicircles, -43, ORBIT), |e| e.omega_dot_radps, |e, v| e.omega_dot_radps = v),
    element(Field::new("iode", &[(271, 8)], Whole, 0, "20.3.3.4.1"), |e| f64::from(e.iode), |e, v| e.iode = v as u16),
    element(Field::new("idot_radps", &[(279, 14)], Semicircles, -43, ORBIT), |e| e.idot_radps, |e, v| e.idot_radps = v),
];

/// One satellite's almanac (figure 20-1, sheet 4).
#[rustfmt::skip]
pub(super) static ALMANAC_PAGE: [Element<Almanac>; 12] = [
    element(Field::new("sv_id", &[(63, 6)], Whole, 0, "20.3.3.5.1.1, table 20-V"), |a| f64::from(a.number), |a, v| a.number = v as u8),
    element(Field::new("eccentricity", &[(69, 16)], Unsigned, -21, ALMANAC), |a| a.eccentricity, |a, v| a.eccentricity = v),
    element(Field::new("toa_s", &[(91, 8)], Whole, 12, ALMANAC), |a| a.toa_s, |a, v| a.toa_s = v),
    element(Field::new("delta_i_rad", &[(99, 16)], Semicircles, -19, ALMANAC), |a| a.delta_i_rad, |a, v| a.delta_i_rad = v),
    element(Field::new("omega_dot_radps", &[(121, 16)], Semicircles, -38, ALMANAC), |a| a.omega_dot_radps, |a, v| a.omega_dot_radps = v),
    element(Field::new("health", &[(137, 8)], Whole, 0, "20.3.3.5.1.3"), |a| f64::from(a.health), |a, v| a.health = v as u8),
    element(Field::new("sqrt_a_sqrtm", &[(151, 24)], Unsigned, -11, ALMANAC), |a| a.sqrt_a_sqrtm, |a, v| a.sqrt_a_sqrtm = v),
    element(Field::new("omega0_rad", &[(181, 24)], Turn, -23, ALMANAC), |a| a.omega0_rad, |a, v| a.omega0_rad = v),
    element(Field::new("omega_rad", &[(211, 24)], Turn, -23, ALMANAC), |a| a.omega_rad, |a, v| a.omega_rad = v),
    element(Field::new("m0_rad", &[(241, 24)], Turn, -23, ALMANAC), |a| a.m0_rad, |a, v| a.m0_rad = v),
    element(Field::new("af0_s", &[(271, 8), (290, 3)], Signed, -20, ALMANAC), |a| a.af0_s, |a, v| a.af0_s = v),
    element(Field::new("af1_sps", &[(279, 11)], Signed, -38, ALMANAC), |a| a.af1_sps, |a, v| a.af1_sps = v),
];

/// The ionosphere in page 18 of subframe 4 (figure 20-1, sheet 8).
#[rustfmt::skip]
pub(super) static IONOSPHERE_PAGE: [Element<Klobuchar>; 8] = [
    element(Field::new("alpha_0", &[(69, 8)], Signed, -30, IONOSPHERE), |k| k.alpha[0], |k, v| k.alpha[0] = v),
    element(Field::new("alpha_1", &[(77, 8)], Signed, -27, IONOSPHERE), |k| k.alpha[1], |k, v| k.alpha[1] = v),
    element(Field::new("alpha_2", &[(91, 8)], Signed, -24, IONOSPHERE), |k| k.alpha[2], |k, v| k.alpha[2] = v),
    element(Field::new("alpha_3", &[(99, 8)], Signed, -24, IONOSPHERE), |k| k.alpha[3], |k, v| k.alpha[3] = v),
    element(Field::new("beta_0", &[(107, 8)], Signed, 11, IONOSPHERE), |k| k.beta[0], |k, v| k.beta[0] = v),
    element(Field::new("beta_1", &[(121, 8)], Signed, 14, IONOSPHERE), |k| k.beta[1], |k, v| k.beta[1] = v),
    element(Field::new("beta_2", &[(129, 8)], Signed, 16, IONOSPHERE), |k| k.beta[2], |k, v| k.beta[2] = v),
    element(Field::new("beta_3", &[(137, 8)], Signed, 16, IONOSPHERE), |k| k.beta[3], |k, v| k.beta[3] = v),
];

/// UTC in page 18 of subframe 4 (figure 20-1, sheet 8).
#[rustfmt::skip]
pub(super) static UTC_PAGE: [Element<Utc>; 8] = [
    element(Field::new("utc_a1_sps", &[(151, 24)], Signed, -50, CORRECTIONS), |u| u.a1_sps, |u, v| u.a1_sps = v),
    element(Field::new("utc_a0_s", &[(181, 24), (211, 8)], Signed, -30, CORRECTIONS), |u| u.a0_s, |u, v| u.a0_s = v),
    element(Field::new("utc_tot_s", &[(219, 8)], Whole, 12, CORRECTIONS), |u| u.tot_s, |u, v| u.tot_s = v),
    element(Field::new("utc_week", &[(227, 8)], Whole, 0, CORRECTIONS), |u| f64::from(u.week), |u, v| u.week = v as u8),
    element(Field::new("utc_leap_s", &[(241, 8)], Signed, 0, CORRECTIONS), |u| u.leap_s as f64, |u, v| u.leap_s = v as i64),
    element(Field::new("utc_event_week", &[(249, 8)], Whole, 0, CORRECTIONS), |u| f64::from(u.event_week), |u, v| u.event_week = v as u8),
    element(Field::new("utc_event_day", &[(257, 8)], Whole, 0, CORRECTIONS), |u| f64::from(u.event_day), |u, v| u.event_day = v as u8),
    element(Field::new("utc_leap_after_s", &[(271, 8)], Signed, 0, CORRECTIONS), |u| u.leap_after_s as f64, |u, v| u.leap_after_s = v as i64),
];

/// Every field by the subframe or page that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    fn of<T>(table: &'static [Element<T>]) -> Vec<&'static Field> {
        table.iter().map(|element| &element.field).collect()
    }
    vec![
        ("subframe 1", of(&SUBFRAME_1)),
        ("subframe 2", of(&SUBFRAME_2)),
        ("subframe 3", of(&SUBFRAME_3)),
        ("almanac", of(&ALMANAC_PAGE)),
        ("ionosphere, subframe 4 page 18", of(&IONOSPHERE_PAGE)),
        ("utc, subframe 4 page 18", of(&UTC_PAGE)),
    ]
}
