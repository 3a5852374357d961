//! Almanacs and GPS time offset of I/NAV: words 7 to 10.
//!
//! Source: Galileo OS SIS ICD 2.1, 5.1.10 (almanac) and 5.1.8 (offset of GPS time). They carry three
//! satellites a minute, a whole almanac in twelve minutes. Reference orbits: 29 600 km, 56°.

use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element};
use crate::broadcast::Ephemeris;
use crate::earth::GPS_PI;
use crate::satellite::System;
use crate::time::{Epoch, TimePolynomial, WEEK_S};

use super::fields::GST_WEEK;
use crate::galileo::status::{E1B, E5A, E5B};

/// Semi-major axis from which almanacs and reduced elements count.
pub(super) const NOMINAL_AXIS_M: f64 = 29_600_000.0;
/// Inclination from which they count, 56°.
pub(super) const NOMINAL_INCLINATION_RAD: f64 = 56.0 / 180.0 * GPS_PI;
/// Step of the almanac's reference time, and its last one inside a week.
pub(in crate::galileo) const TOA_STEP_S: i64 = 600;
const TOA_LAST_S: i64 = WEEK_S - TOA_STEP_S;
const HOUR_S: i64 = 3600;
/// Duration of what carries three satellites, and how many of them there are until all have been sent.
const TRIPLE_S: i64 = 60;
pub(in crate::galileo) const TRIPLES: i64 = 12;
const TRIPLE: u8 = 3;

const ALMANAC: &str = "5.1.10, table 71";
const STATUS: &str = "5.1.9.7";
const OFFSET: &str = "5.1.8, table 69";

/// One satellite in the almanac; number 0 for an entry without one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::galileo) struct Entry {
    pub number: u8,
    pub delta_sqrt_a_sqrtm: f64,
    pub eccentricity: f64,
    pub omega_rad: f64,
    pub delta_i_rad: f64,
    pub omega0_rad: f64,
    pub omega_dot_radps: f64,
    pub m0_rad: f64,
    pub af0_s: f64,
    pub af1_sps: f64,
    pub e5a_health: u8,
    e5b_health: u8,
    e1b_health: u8,
}

impl Entry {
    /// True if the fields can hold the entry. The two satellites on eccentric orbits do not fit.
    fn fits(&self) -> bool {
        self.delta_sqrt_a_sqrtm.abs() < 7.9 && self.eccentricity < 0.031 && self.delta_i_rad.abs() < 0.19
    }

    /// Almanac elements of an ephemeris at an almanac's reference time. The axis absorbs the correction of
    /// the mean motion, for which an almanac has no field.
    fn of(set: &Ephemeris, toa: Epoch) -> Self {
        let mean = set.mean_at(toa);
        Self {
            number: set.sv.number,
            delta_sqrt_a_sqrtm: mean.sqrt_a_sqrtm - NOMINAL_AXIS_M.sqrt(),
            eccentricity: set.eccentricity,
            omega_rad: set.omega_rad,
            delta_i_rad: mean.inclination_rad - NOMINAL_INCLINATION_RAD,
            omega0_rad: mean.omega0_rad,
            omega_dot_radps: set.omega_dot_radps,
            m0_rad: mean.m0_rad,
            af0_s: mean.af0_s,
            af1_sps: set.af1_sps,
            e5a_health: E5A.health(set) as u8,
            e5b_health: E5B.health(set) as u8,
            e1b_health: E1B.health(set) as u8,
        }
    }
}

/// The content of words 7 to 10: three satellites, and the offset of GPS time.
#[derive(Clone, Debug)]
pub(in crate::galileo) struct Triple {
    pub issue: u8,
    pub toa: Epoch,
    pub entries: [Entry; TRIPLE as usize],
    offset: Offset,
}

/// Offset of the system's time ahead of GPS time; `None` if the message does not state it.
#[derive(Clone, Copy, Debug)]
pub(in crate::galileo) struct Offset(pub Option<TimePolynomial>);

impl Triple {
    /// Almanac words that I/NAV sends in the minute of `start`.
    pub(super) fn at(start: Epoch, sets: &[Ephemeris], reference: Epoch, offset: Option<TimePolynomial>) -> Self {
        let turn = start.tow_whole_s().div_euclid(TRIPLE_S).rem_euclid(TRIPLES) as u8;
        Self::of(turn, sets, reference, offset)
    }

    /// Creates the almanacs of three of twelve satellites, by their turn, counted from 0.
    pub fn of(turn: u8, sets: &[Ephemeris], reference: Epoch, offset: Option<TimePolynomial>) -> Self {
        let toa_s = ((reference.tow_whole_s() + TOA_STEP_S / 2) / TOA_STEP_S * TOA_STEP_S).min(TOA_LAST_S);
        let toa = Epoch::new(reference.week() * WEEK_S + toa_s, 0.0);
        let entry = |place: u8| {
            let number = TRIPLE * turn + place + 1;
            let set = sets.iter().find(|set| set.sv.system == System::Galileo && set.sv.number == number);
            set.map(|set| Entry::of(set, toa)).filter(Entry::fits).unwrap_or_default()
        };
        // Four bits that change with the reference time.
        let issue = (toa_s / TOA_STEP_S).rem_euclid(16) as u8;
        Self { issue, toa, entries: [0, 1, 2].map(entry), offset: Offset(offset) }
    }
}

impl Offset {
    /// The offset's constant and rate with its reference time of week in hours and week; all ones in the
    /// message, here −1 and 255 and 63, where nothing is stated.
    pub fn field(&self, field: usize) -> f64 {
        let Some(offset) = self.0 else { return NO_OFFSET[field] };
        let week = (offset.reference.week() - GST_WEEK).rem_euclid(64);
        // The reference time has steps of an hour; the constant is that of the last one before.
        let hours = offset.reference.tow_whole_s() / HOUR_S;
        let whole = Epoch::new(offset.reference.week() * WEEK_S + hours * HOUR_S, 0.0);
        [offset.at_s(whole), offset.a1_sps, hours as f64, week as f64][field]
    }
}

/// Field values that mean "no offset": all bits are ones.
const NO_OFFSET: [f64; 4] = [-1.0 / 34_359_738_368.0, -1.0 / 2_251_799_813_685_248.0, 255.0, 63.0];

type Of = Element<Triple>;

pub(in crate::galileo) const ISSUE: Of = element(
    Field::new("almanac_issue", &[(6, 4)], Whole, 0, ALMANAC),
    |t| f64::from(t.issue),
    |t, v| t.issue = v as u8,
);
pub(in crate::galileo) const WEEK: Of = element(
    Field::new("almanac_week", &[(10, 2)], Whole, 0, ALMANAC),
    |t| (t.toa.week() - GST_WEEK).rem_euclid(4) as f64,
    |_, _| {},
);
pub(in crate::galileo) const TOA: Of = element(
    Field::new("toa_10min", &[(12, 10)], Whole, 0, ALMANAC),
    |t| t.toa.tow_s() / TOA_STEP_S as f64,
    |t, v| t.toa = Epoch::new(t.toa.week() * WEEK_S + v as i64 * TOA_STEP_S, 0.0),
);

/// A field of one of the three satellites, from its first bit on.
macro_rules! of {
    ($entry:literal, number, $at:literal) => {
        element(
            Field::new("svid", &[($at, 6)], Whole, 0, ALMANAC),
            |t| f64::from(t.entries[$entry].number),
            |t, v| t.entries[$entry].number = v as u8,
        )
    };
    ($entry:literal, $status:ident, $at:literal, status) => {
        element(
            Field::new(stringify!($status), &[($at, 2)], Whole, 0, STATUS),
            |t| f64::from(t.entries[$entry].$status),
            |t, v| t.entries[$entry].$status = v as u8,
        )
    };
    ($entry:literal, $field:ident, $at:literal, $bits:literal, $kind:ident, $exponent:literal) => {
        element(
            Field::new(stringify!($field), &[($at, $bits)], $kind, $exponent, ALMANAC),
            |t| t.entries[$entry].$field,
            |t, v| t.entries[$entry].$field = v,
        )
    };
}

pub(in crate::galileo) use of;

#[rustfmt::skip]
pub(super) static WORD_7: [Of; 11] = [
    ISSUE,
    WEEK,
    TOA,
    of!(0, number, 22),
    of!(0, delta_sqrt_a_sqrtm, 28, 13, Signed, -9),
    of!(0, eccentricity, 41, 11, Unsigned, -16),
    of!(0, omega_rad, 52, 16, Turn, -15),
    of!(0, delta_i_rad, 68, 11, Semicircles, -14),
    of!(0, omega0_rad, 79, 16, Turn, -15),
    of!(0, omega_dot_radps, 95, 11, Semicircles, -33),
    of!(0, m0_rad, 106, 16, Turn, -15),
];

#[rustfmt::skip]
pub(super) static WORD_8: [Of; 12] = [
    ISSUE,
    of!(0, af0_s, 10, 16, Signed, -19),
    of!(0, af1_sps, 26, 13, Signed, -38),
    of!(0, e5b_health, 39, status),
    of!(0, e1b_health, 41, status),
    of!(1, number, 43),
    of!(1, delta_sqrt_a_sqrtm, 49, 13, Signed, -9),
    of!(1, eccentricity, 62, 11, Unsigned, -16),
    of!(1, omega_rad, 73, 16, Turn, -15),
    of!(1, delta_i_rad, 89, 11, Semicircles, -14),
    of!(1, omega0_rad, 100, 16, Turn, -15),
    of!(1, omega_dot_radps, 116, 11, Semicircles, -33),
];

#[rustfmt::skip]
pub(super) static WORD_9: [Of; 13] = [
    ISSUE,
    WEEK,
    TOA,
    of!(1, m0_rad, 22, 16, Turn, -15),
    of!(1, af0_s, 38, 16, Signed, -19),
    of!(1, af1_sps, 54, 13, Signed, -38),
    of!(1, e5b_health, 67, status),
    of!(1, e1b_health, 69, status),
    of!(2, number, 71),
    of!(2, delta_sqrt_a_sqrtm, 77, 13, Signed, -9),
    of!(2, eccentricity, 90, 11, Unsigned, -16),
    of!(2, omega_rad, 101, 16, Turn, -15),
    of!(2, delta_i_rad, 117, 11, Semicircles, -14),
];

#[rustfmt::skip]
pub(super) static WORD_10: [Of; 8] = [
    ISSUE,
    of!(2, omega0_rad, 10, 16, Turn, -15),
    of!(2, omega_dot_radps, 26, 11, Semicircles, -33),
    of!(2, m0_rad, 37, 16, Turn, -15),
    of!(2, af0_s, 53, 16, Signed, -19),
    of!(2, af1_sps, 69, 13, Signed, -38),
    of!(2, e5b_health, 82, status),
    of!(2, e1b_health, 84, status),
];

/// The rest of word 10: by how much the system's time is ahead of GPS time. What sets it is [`gps_offset`].
#[rustfmt::skip]
pub(super) static GPS_OFFSET: [Of; 4] = [
    element(Field::new("ggto_a0_s", &[(86, 16)], Signed, -35, OFFSET), |t| t.offset.field(0), |_, _| {}),
    element(Field::new("ggto_a1_sps", &[(102, 12)], Signed, -51, OFFSET), |t| t.offset.field(1), |_, _| {}),
    element(Field::new("ggto_t0_h", &[(114, 8)], Whole, 0, OFFSET), |t| t.offset.field(2), |_, _| {}),
    element(Field::new("ggto_week", &[(122, 6)], Whole, 0, OFFSET), |t| t.offset.field(3), |_, _| {}),
];

/// Offset of the system's time ahead of GPS time from word 10, with its week near `near`. `None` if all bits
/// are ones, which means that no offset is stated.
pub fn gps_offset(word: &u128, near: Epoch) -> Option<TimePolynomial> {
    offset_of(GPS_OFFSET.each_ref().map(|element| (element.field, element.field.read(word))), near)
}

/// Offset of the system's time ahead of GPS time from the four fields and their integers, for any message.
pub(in crate::galileo) fn offset_of([a0, a1, hours, week]: [(Field, i64); 4], near: Epoch) -> Option<TimePolynomial> {
    if (a0.1, a1.1, hours.1, week.1) == (-1, -1, 255, 63) {
        return None;
    }
    let week = near.nearest_week(week.1 + GST_WEEK, 64);
    let reference = Epoch::new(week * WEEK_S + hours.1 * HOUR_S, 0.0);
    Some(TimePolynomial { a0_s: a0.0.value(a0.1), a1_sps: a1.0.value(a1.1), reference })
}
