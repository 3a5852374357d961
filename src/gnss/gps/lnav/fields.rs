//! Field table of LNAV: the position of each parameter in the message, and the meaning of its integer.
//!
//! Source: IS-GPS-200N, figure 20-1 (positions) and tables 20-I, 20-III, 20-VI, 20-IX and 20-X (lengths and
//! scales). A field is read and written through the same entry. Positions are the document's: bit 1 is
//! the first of a subframe's 300, parity included.

use super::almanac::{Almanac, Utc};
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, Store, element, fields, plain};
use crate::broadcast::Ephemeris;
use crate::klobuchar::Klobuchar;

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
    element(Field::new("week", &[(61, 10)], Whole, 0, "20.3.3.3.1.1"),
        |e| e.transmitted.week().rem_euclid(1024) as f64, |_, _| {}),
    element(Field::new("l2_codes", &[(71, 2)], Whole, 0, "20.3.3.3.1.2"),
        |e| f64::from(e.l2_codes), |e, v| e.l2_codes = v as u8),
    element(Field::new("ura_index", &[(73, 4)], Whole, 0, "20.3.3.3.1.3"),
        |e| f64::from(e.ura_index), |e, v| e.ura_index = v as u8),
    element(Field::new("health", &[(77, 6)], Whole, 0, "20.3.3.3.1.4"),
        |e| f64::from(e.health), |e, v| e.health = v as u16),
    element(Field::new("iodc", &[(83, 2), (211, 8)], Whole, 0, "20.3.3.3.1.5"),
        |e| f64::from(e.iodc), |e, v| e.iodc = v as u16),
    element(Field::new("l2_p_data_off", &[(91, 1)], Whole, 0, "20.3.3.3.1.6"),
        |e| f64::from(u8::from(e.l2_p_data_off)), |e, v| e.l2_p_data_off = v > 0.0),
    plain!("tgd_s", [(197, 8)], Signed, -31, CLOCK, tgd_s),
    element(Field::new("toc_s", &[(219, 16)], Whole, 4, CLOCK),
        |e| e.toc.tow_s(), |e, v| e.toc = e.toc.nearest_tow(v as i64)),
    plain!("af2_sps2", [(241, 8)], Signed, -55, CLOCK, af2_sps2),
    plain!("af1_sps", [(249, 16)], Signed, -43, CLOCK, af1_sps),
    plain!("af0_s", [(271, 22)], Signed, -31, CLOCK, af0_s),
];

/// Orbit, first half (figure 20-1, sheet 2).
#[rustfmt::skip]
pub(super) static SUBFRAME_2: [Element<Ephemeris>; 11] = [
    element(Field::new("iode", &[(61, 8)], Whole, 0, "20.3.3.4.1"), |e| f64::from(e.iode), |e, v| e.iode = v as u16),
    plain!("crs_m", [(69, 16)], Signed, -5, ORBIT, crs_m),
    plain!("delta_n_radps", [(91, 16)], Semicircles, -43, ORBIT, delta_n_radps),
    plain!("m0_rad", [(107, 8), (121, 24)], Turn, -31, ORBIT, m0_rad),
    plain!("cuc_rad", [(151, 16)], Signed, -29, ORBIT, cuc_rad),
    plain!("eccentricity", [(167, 8), (181, 24)], Unsigned, -33, ORBIT, eccentricity),
    plain!("cus_rad", [(211, 16)], Signed, -29, ORBIT, cus_rad),
    plain!("sqrt_a_sqrtm", [(227, 8), (241, 24)], Unsigned, -19, ORBIT, sqrt_a_sqrtm),
    element(Field::new("toe_s", &[(271, 16)], Whole, 4, ORBIT),
        |e| e.toe.tow_s(), |e, v| e.toe = e.toe.nearest_tow(v as i64)),
    element(Field::new("long_fit", &[(287, 1)], Whole, 0, "20.3.3.4.3.1"),
        |e| f64::from(u8::from(e.long_fit)), |e, v| e.long_fit = v > 0.0),
    element(Field::new("aodo", &[(288, 5)], Whole, 0, "20.3.3.4.4"), |e| f64::from(e.aodo), |e, v| e.aodo = v as u8),
];

/// Orbit, second half (figure 20-1, sheet 3).
#[rustfmt::skip]
pub(super) static SUBFRAME_3: [Element<Ephemeris>; 9] = [
    plain!("cic_rad", [(61, 16)], Signed, -29, ORBIT, cic_rad),
    plain!("omega0_rad", [(77, 8), (91, 24)], Turn, -31, ORBIT, omega0_rad),
    plain!("cis_rad", [(121, 16)], Signed, -29, ORBIT, cis_rad),
    plain!("i0_rad", [(137, 8), (151, 24)], Semicircles, -31, ORBIT, i0_rad),
    plain!("crc_m", [(181, 16)], Signed, -5, ORBIT, crc_m),
    plain!("omega_rad", [(197, 8), (211, 24)], Turn, -31, ORBIT, omega_rad),
    plain!("omega_dot_radps", [(241, 24)], Semicircles, -43, ORBIT, omega_dot_radps),
    element(Field::new("iode", &[(271, 8)], Whole, 0, "20.3.3.4.1"), |e| f64::from(e.iode), |e, v| e.iode = v as u16),
    plain!("idot_radps", [(279, 14)], Semicircles, -43, ORBIT, idot_radps),
];

/// One satellite's almanac (figure 20-1, sheet 4).
#[rustfmt::skip]
pub(super) static ALMANAC_PAGE: [Element<Almanac>; 12] = [
    element(Field::new("sv_id", &[(63, 6)], Whole, 0, "20.3.3.5.1.1, table 20-V"),
        |a| f64::from(a.number), |a, v| a.number = v as u8),
    plain!("eccentricity", [(69, 16)], Unsigned, -21, ALMANAC, eccentricity),
    plain!("toa_s", [(91, 8)], Whole, 12, ALMANAC, toa_s),
    plain!("delta_i_rad", [(99, 16)], Semicircles, -19, ALMANAC, delta_i_rad),
    plain!("omega_dot_radps", [(121, 16)], Semicircles, -38, ALMANAC, omega_dot_radps),
    element(Field::new("health", &[(137, 8)], Whole, 0, "20.3.3.5.1.3"),
        |a| f64::from(a.health), |a, v| a.health = v as u8),
    plain!("sqrt_a_sqrtm", [(151, 24)], Unsigned, -11, ALMANAC, sqrt_a_sqrtm),
    plain!("omega0_rad", [(181, 24)], Turn, -23, ALMANAC, omega0_rad),
    plain!("omega_rad", [(211, 24)], Turn, -23, ALMANAC, omega_rad),
    plain!("m0_rad", [(241, 24)], Turn, -23, ALMANAC, m0_rad),
    plain!("af0_s", [(271, 8), (290, 3)], Signed, -20, ALMANAC, af0_s),
    plain!("af1_sps", [(279, 11)], Signed, -38, ALMANAC, af1_sps),
];

/// The ionosphere in page 18 of subframe 4 (figure 20-1, sheet 8).
#[rustfmt::skip]
pub(super) static IONOSPHERE_PAGE: [Element<Klobuchar>; 8] = [
    plain!("alpha_0", [(69, 8)], Signed, -30, IONOSPHERE, alpha[0]),
    plain!("alpha_1", [(77, 8)], Signed, -27, IONOSPHERE, alpha[1]),
    plain!("alpha_2", [(91, 8)], Signed, -24, IONOSPHERE, alpha[2]),
    plain!("alpha_3", [(99, 8)], Signed, -24, IONOSPHERE, alpha[3]),
    plain!("beta_0", [(107, 8)], Signed, 11, IONOSPHERE, beta[0]),
    plain!("beta_1", [(121, 8)], Signed, 14, IONOSPHERE, beta[1]),
    plain!("beta_2", [(129, 8)], Signed, 16, IONOSPHERE, beta[2]),
    plain!("beta_3", [(137, 8)], Signed, 16, IONOSPHERE, beta[3]),
];

/// UTC in page 18 of subframe 4 (figure 20-1, sheet 8).
#[rustfmt::skip]
pub(super) static UTC_PAGE: [Element<Utc>; 8] = [
    plain!("utc_a1_sps", [(151, 24)], Signed, -50, CORRECTIONS, a1_sps),
    plain!("utc_a0_s", [(181, 24), (211, 8)], Signed, -30, CORRECTIONS, a0_s),
    plain!("utc_tot_s", [(219, 8)], Whole, 12, CORRECTIONS, tot_s),
    element(Field::new("utc_week", &[(227, 8)], Whole, 0, CORRECTIONS), |u| f64::from(u.week), |u, v| u.week = v as u8),
    element(Field::new("utc_leap_s", &[(241, 8)], Signed, 0, CORRECTIONS),
        |u| u.leap_s as f64, |u, v| u.leap_s = v as i64),
    element(Field::new("utc_event_week", &[(249, 8)], Whole, 0, CORRECTIONS),
        |u| f64::from(u.event_week), |u, v| u.event_week = v as u8),
    element(Field::new("utc_event_day", &[(257, 8)], Whole, 0, CORRECTIONS),
        |u| f64::from(u.event_day), |u, v| u.event_day = v as u8),
    element(Field::new("utc_leap_after_s", &[(271, 8)], Signed, 0, CORRECTIONS),
        |u| u.leap_after_s as f64, |u, v| u.leap_after_s = v as i64),
];

/// Lists every field by the subframe or page that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![
        ("subframe 1", fields(&[&SUBFRAME_1])),
        ("subframe 2", fields(&[&SUBFRAME_2])),
        ("subframe 3", fields(&[&SUBFRAME_3])),
        ("almanac", fields(&[&ALMANAC_PAGE])),
        ("ionosphere, subframe 4 page 18", fields(&[&IONOSPHERE_PAGE])),
        ("utc, subframe 4 page 18", fields(&[&UTC_PAGE])),
    ]
}
