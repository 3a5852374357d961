//! The field table: where each parameter of the message stands, and what its integer means.
//!
//! Source: IS-GPS-200N, figure 20-1 (places) and tables 20-I, 20-III, 20-VI, 20-IX and 20-X (lengths and
//! scales). A field is read and written through the same entry. Places are the document's: bit 1 is
//! the first of a subframe's 300, parity included.

use thiserror::Error;

use super::almanac::{Almanac, Utc};
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::earth::GPS_PI;
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::time::{Epoch, WEEK_S};

/// Why a value cannot be sent.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum FieldError {
    #[error("{name} = {value} does not fit the navigation message: expected {minimum} to {maximum}")]
    OutOfRange { name: &'static str, value: f64, minimum: f64, maximum: f64 },
    #[error("{name} = {value} cannot be sent exactly: expected a multiple of {step}")]
    NotMultiple { name: &'static str, value: f64, step: f64 },
    #[error("iode = {iode} contradicts iodc = {iodc}: expected the low eight bits of it")]
    Issue { iode: u8, iodc: u16 },
}

/// What the integer of a field stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Not negative, rounded to the nearest step.
    Unsigned,
    /// A count or a time: not negative, and refused when not a whole number of steps.
    Whole,
    /// Two's complement.
    Signed,
    /// Two's complement of semicircles (or semicircles a second); the value is in radians.
    Semicircles,
    /// The same for an angle that is meant modulo a turn: a value outside ±π is brought there first.
    Turn,
}

/// One parameter's place and scale.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Unit last, as everywhere.
    pub name: &'static str,
    /// First bit (1..=300) and length of each piece, most significant first.
    pub pieces: &'static [(u16, u8)],
    pub kind: Kind,
    /// One step is two to this power.
    pub exponent: i32,
    /// Where IS-GPS-200N defines it.
    pub clause: &'static str,
}

impl Field {
    const fn new(
        name: &'static str,
        pieces: &'static [(u16, u8)],
        kind: Kind,
        exponent: i32,
        clause: &'static str,
    ) -> Self {
        Self { name, pieces, kind, exponent, clause }
    }

    /// Length in bits.
    pub fn bits(&self) -> u32 {
        self.pieces.iter().map(|piece| u32::from(piece.1)).sum()
    }

    fn is_signed(&self) -> bool {
        let kind =
            planted!("gnss.lnav.sign_tgd", self.kind, if self.name == "tgd_s" { Kind::Unsigned } else { self.kind });
        matches!(kind, Kind::Signed | Kind::Semicircles | Kind::Turn)
    }

    /// Smallest and largest integer that it holds.
    pub fn range(&self) -> (i64, i64) {
        let span = 1_i64 << self.bits();
        if self.is_signed() { (-span / 2, span / 2 - 1) } else { (0, span - 1) }
    }

    /// The scale's power of two.
    fn exponent(&self) -> i32 {
        let wrong = planted!("gnss.lnav.scale_crs", false, self.name == "crs_m")
            || planted!("gnss.lnav.scale_af1", false, self.name == "af1_sps" && self.bits() == 16)
            || planted!("gnss.lnav.scale_alpha", false, self.name == "alpha_2");
        self.exponent + i32::from(wrong)
    }

    fn step(&self) -> f64 {
        let power = libm::ldexp(1.0, self.exponent());
        if matches!(self.kind, Kind::Semicircles | Kind::Turn) { power * GPS_PI } else { power }
    }

    /// The integer in ten words of 24 data bits.
    pub fn read(&self, data: &[u32; 10]) -> i64 {
        let raw = self.pieces.iter().fold(0_i64, |raw, piece| {
            let (word, shift, mask) = place(*piece);
            (raw << piece.1) | i64::from(data.get(word).map_or(0, |bits| (bits >> shift) & mask))
        });
        let span = 1_i64 << self.bits();
        if self.is_signed() && raw >= span / 2 { raw - span } else { raw }
    }

    /// Puts the low bits of `raw` into ten words of 24 data bits.
    pub fn write(&self, data: &mut [u32; 10], raw: i64) {
        let mut left = self.bits();
        for piece in self.pieces {
            left -= u32::from(piece.1);
            let (word, shift, mask) = place(*piece);
            if let Some(bits) = data.get_mut(word) {
                *bits = (*bits & !(mask << shift)) | ((((raw >> left) as u32) & mask) << shift);
            }
        }
    }

    /// What an integer of this field stands for, in the unit of its name.
    pub fn value(&self, raw: i64) -> f64 {
        let scaled = libm::ldexp(raw as f64, self.exponent());
        let angle = matches!(self.kind, Kind::Semicircles | Kind::Turn);
        let angle = planted!("gnss.lnav.idot_in_radians", angle, angle && self.name != "idot_radps");
        if angle { scaled * GPS_PI } else { scaled }
    }

    /// The nearest integer that stands for `value`.
    pub fn raw(&self, value: f64) -> Result<i64, FieldError> {
        let angle = matches!(self.kind, Kind::Semicircles | Kind::Turn);
        let scaled = libm::ldexp(if angle { value / GPS_PI } else { value }, -self.exponent());
        let mut rounded = scaled.round();
        if self.kind == Kind::Whole && rounded != scaled {
            return Err(FieldError::NotMultiple { name: self.name, value, step: self.step() });
        }
        let (minimum, maximum) = self.range();
        if self.kind == Kind::Turn {
            let span = libm::ldexp(1.0, self.bits() as i32);
            rounded -= span * ((rounded + span / 2.0) / span).floor();
        }
        if (minimum as f64..=maximum as f64).contains(&rounded) {
            Ok(rounded as i64)
        } else {
            let (minimum, maximum) = (self.value(minimum), self.value(maximum));
            Err(FieldError::OutOfRange { name: self.name, value, minimum, maximum })
        }
    }
}

/// Word (from 0), shift inside its 24 data bits and mask of a piece.
fn place((first, length): (u16, u8)) -> (usize, u32, u32) {
    let first = planted!("gnss.lnav.field_place", first, if (first, length) == (151, 16) { 152 } else { first });
    let offset = u32::from(first - 1) % 30;
    (usize::from(first - 1) / 30, (24 - offset).saturating_sub(u32::from(length)), (1 << length) - 1)
}

/// A field bound to a member of what carries it.
pub(super) struct Element<T> {
    pub field: Field,
    get: fn(&T) -> f64,
    set: fn(&mut T, f64),
}

const fn element<T>(field: Field, get: fn(&T) -> f64, set: fn(&mut T, f64)) -> Element<T> {
    Element { field, get, set }
}

/// Writes every field of `table` into `data`.
pub(super) fn write_all<T>(table: &[Element<T>], from: &T, data: &mut [u32; 10]) -> Result<(), FieldError> {
    table.iter().try_for_each(|element| {
        element.field.write(data, element.field.raw((element.get)(from))?);
        Ok(())
    })
}

/// Reads every field of `table` out of `data`.
pub(super) fn read_all<T>(table: &[Element<T>], data: &[u32; 10], into: &mut T) {
    for element in table {
        (element.set)(into, element.field.value(element.field.read(data)));
    }
}

/// Replaces every field of `table` by what it is after being sent.
pub(super) fn quantise_all<T>(table: &[Element<T>], into: &mut T) -> Result<(), FieldError> {
    table.iter().try_for_each(|element| {
        let raw = element.field.raw((element.get)(into))?;
        (element.set)(into, element.field.value(raw));
        Ok(())
    })
}

/// Adds `by` to the field of `table` called `name`; whether there is one.
pub(super) fn add_to<T>(table: &[Element<T>], name: &str, into: &mut T, by: f64) -> bool {
    let Some(element) = table.iter().find(|element| element.field.name == name) else { return false };
    (element.set)(into, (element.get)(into) + by);
    true
}

/// The fields of `table` with their integers in `data`.
pub(super) fn integers<T>(table: &[Element<T>], data: &[u32; 10]) -> Vec<(&'static str, i64)> {
    table.iter().map(|element| (element.field.name, element.field.read(data))).collect()
}

/// The instant nearest to `anchor` whose time of week is `tow_s`.
fn nearest(anchor: Epoch, tow_s: f64) -> Epoch {
    let ahead_s = (tow_s as i64 - anchor.tow_whole_s() + WEEK_S / 2).rem_euclid(WEEK_S) - WEEK_S / 2;
    Epoch::new(anchor.seconds() + ahead_s, 0.0)
}

const ORBIT: &str = "20.3.3.4.1, table 20-III";
const CLOCK: &str = "20.3.3.3.3, table 20-I";
const ALMANAC: &str = "20.3.3.5.1.2, table 20-VI";
const CORRECTIONS: &str = "20.3.3.5.2.4, table 20-IX";
const IONOSPHERE: &str = "20.3.3.5.2.5, table 20-X";

use Kind::{Semicircles, Signed, Turn, Unsigned, Whole};

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
    element(Field::new("toc_s", &[(219, 16)], Whole, 4, CLOCK), |e| e.toc.tow_s(), |e, v| e.toc = nearest(e.toc, v)),
    element(Field::new("af2_sps2", &[(241, 8)], Signed, -55, CLOCK), |e| e.af2_sps2, |e, v| e.af2_sps2 = v),
    element(Field::new("af1_sps", &[(249, 16)], Signed, -43, CLOCK), |e| e.af1_sps, |e, v| e.af1_sps = v),
    element(Field::new("af0_s", &[(271, 22)], Signed, -31, CLOCK), |e| e.af0_s, |e, v| e.af0_s = v),
];

/// Orbit, first half (figure 20-1, sheet 2).
#[rustfmt::skip]
pub(super) static SUBFRAME_2: [Element<Ephemeris>; 11] = [
    element(Field::new("iode", &[(61, 8)], Whole, 0, "20.3.3.4.1"), |e| f64::from(e.iode), |e, v| e.iode = v as u8),
    element(Field::new("crs_m", &[(69, 16)], Signed, -5, ORBIT), |e| e.crs_m, |e, v| e.crs_m = v),
    element(Field::new("delta_n_radps", &[(91, 16)], Semicircles, -43, ORBIT), |e| e.delta_n_radps, |e, v| e.delta_n_radps = v),
    element(Field::new("m0_rad", &[(107, 8), (121, 24)], Turn, -31, ORBIT), |e| e.m0_rad, |e, v| e.m0_rad = v),
    element(Field::new("cuc_rad", &[(151, 16)], Signed, -29, ORBIT), |e| e.cuc_rad, |e, v| e.cuc_rad = v),
    element(Field::new("eccentricity", &[(167, 8), (181, 24)], Unsigned, -33, ORBIT), |e| e.eccentricity, |e, v| e.eccentricity = v),
    element(Field::new("cus_rad", &[(211, 16)], Signed, -29, ORBIT), |e| e.cus_rad, |e, v| e.cus_rad = v),
    element(Field::new("sqrt_a_sqrtm", &[(227, 8), (241, 24)], Unsigned, -19, ORBIT), |e| e.sqrt_a_sqrtm, |e, v| e.sqrt_a_sqrtm = v),
    element(Field::new("toe_s", &[(271, 16)], Whole, 4, ORBIT), |e| e.toe.tow_s(), |e, v| e.toe = nearest(e.toe, v)),
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
    element(Field::new("iode", &[(271, 8)], Whole, 0, "20.3.3.4.1"), |e| f64::from(e.iode), |e, v| e.iode = v as u8),
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
