//! Blocks of fields that the three messages have alike, each at a position of its own in each of them:
//! positions count from 0, the first bit of a message or subframe (BDS-SIS-ICD-B1C 1.0, BDS-SIS-ICD-B2a 1.0
//! and BDS-SIS-ICD-B2b 1.0, section 7; clauses are those of B1C's).

use crate::beidou::bcnav1::almanac::{Entry, PLACES};
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element, plain};
use crate::broadcast::Ephemeris;
use crate::message::UtcNumbers;
use crate::satellite::Sv;
use crate::time::{BDT_WEEK, Epoch};

/// Step of reference times.
pub(in crate::beidou) const STEP_S: i64 = 300;
/// Semi-major axes from which elements count, of medium orbits and of the others (table 7-5).
const MEDIUM_AXIS_M: f64 = 27_906_100.0;
const HIGH_AXIS_M: f64 = 42_162_200.0;
/// The number of medium orbits (7.4.2): 1 is of geostationary ones, 2 of inclined ones that turn with the
/// Earth.
const MEDIUM: f64 = 3.0;

const TIME: &str = "7.3";
const ORBIT: &str = "7.4, table 7-5";
const CLOCK: &str = "7.5, table 7-6";
const UTC: &str = "7.12, table 7-16";
const ELECTRONS: &str = "7.8";
const ACCURACY: &str = "7.15 and 7.16";
const HEALTH: &str = "7.14 to 7.17";

/// Content of the messages.
#[derive(Clone, Debug)]
pub(in crate::beidou) struct Content {
    pub set: Ephemeris,
    /// Transmission time of the message.
    pub sent: Epoch,
    pub kind: f64,
    pub page: f64,
    /// Integrity of the signal that carries the message, and of B1C where that is another.
    pub flags: f64,
    pub flags_b1c: f64,
    pub utc: UtcNumbers,
    /// Coefficients of BDGIM, in TECU; nine zeros state nothing.
    pub alpha_tecu: [f64; 9],
    pub reserved: f64,
    /// Predicted accuracies of the signal in space: the time of the prediction, of the orbit along and across
    /// the track, and the clock's three.
    pub accuracies: [f64; 5],
    /// Reference time of almanacs, and their satellites.
    pub toa: Epoch,
    pub entries: [Entry; PLACES],
}

pub(in crate::beidou) type Of = Element<Content>;

fn steps(at: Epoch) -> f64 {
    at.tow_s() / STEP_S as f64
}

/// The kind of a satellite's orbit.
pub(in crate::beidou) fn kind(sv: Sv) -> f64 {
    match sv.orbit_m() {
        axis_m if axis_m < 35e6 => MEDIUM,
        _ if sv.is_geostationary() => 1.0,
        _ => 2.0,
    }
}

/// Semi-major axis from which the elements of a kind of orbit count.
pub(in crate::beidou) fn reference_axis_of_m(kind: f64) -> f64 {
    if kind == MEDIUM { MEDIUM_AXIS_M } else { HIGH_AXIS_M }
}

fn reference_axis_m(content: &Content) -> f64 {
    reference_axis_of_m(content.kind)
}

/// The week of BDT.
pub(in crate::beidou) const fn week<const AT: u16>() -> Of {
    element(
        Field::new("week", const { &[(AT, 13)] }, Whole, 0, TIME),
        |c| (c.sent.week() - BDT_WEEK).rem_euclid(8192) as f64,
        |_, _| {},
    )
}

/// The issue of the clock.
pub(in crate::beidou) const fn iodc<const AT: u16>() -> Of {
    element(
        Field::new("iodc", const { &[(AT, 10)] }, Whole, 0, CLOCK),
        |c| f64::from(c.set.iodc),
        |c, v| c.set.iodc = v as u16,
    )
}

/// The issue of the orbit.
pub(in crate::beidou) const fn iode<const AT: u16>() -> Of {
    element(
        Field::new("iode", const { &[(AT, 8)] }, Whole, 0, ORBIT),
        |c| f64::from(c.set.iode),
        |c, v| c.set.iode = v as u16,
    )
}

/// The first half of the orbit, 203 bits.
#[rustfmt::skip]
pub(in crate::beidou) const fn first_half<const AT: u16>() -> [Of; 9] {
    [
        element(Field::new("toe_5min", const { &[(AT, 11)] }, Whole, 0, ORBIT),
            |c| steps(c.set.toe), |c, v| c.set.toe = c.set.toe.nearest_tow(v as i64 * STEP_S)),
        plain!("orbit_kind", const { [(AT + 11, 2)] }, Whole, 0, ORBIT, kind),
        element(Field::new("delta_a_m", const { &[(AT + 13, 26)] }, Signed, -9, ORBIT),
            |c| c.set.sqrt_a_sqrtm * c.set.sqrt_a_sqrtm - reference_axis_m(c),
            |c, v| c.set.sqrt_a_sqrtm = (v + reference_axis_m(c)).sqrt()),
        plain!("a_rate_mps", const { [(AT + 39, 25)] }, Signed, -21, ORBIT, set.axis_rate_mps),
        plain!("delta_n_radps", const { [(AT + 64, 17)] }, Semicircles, -44, ORBIT, set.delta_n_radps),
        plain!("delta_n_rate_radps2", const { [(AT + 81, 23)] }, Semicircles, -57, ORBIT, set.delta_n_rate_radps2),
        plain!("m0_rad", const { [(AT + 104, 1), (AT + 105, 32)] }, Turn, -32, ORBIT, set.m0_rad),
        plain!("eccentricity", const { [(AT + 137, 1), (AT + 138, 32)] }, Unsigned, -34, ORBIT, set.eccentricity),
        plain!("omega_rad", const { [(AT + 170, 1), (AT + 171, 32)] }, Turn, -32, ORBIT, set.omega_rad),
    ]
}

/// The second half of the orbit, 222 bits.
#[rustfmt::skip]
pub(in crate::beidou) const fn second_half<const AT: u16>() -> [Of; 10] {
    [
        plain!("omega0_rad", const { [(AT, 1), (AT + 1, 32)] }, Turn, -32, ORBIT, set.omega0_rad),
        plain!("i0_rad", const { [(AT + 33, 1), (AT + 34, 32)] }, Semicircles, -32, ORBIT, set.i0_rad),
        plain!("omega_dot_radps", const { [(AT + 66, 19)] }, Semicircles, -44, ORBIT, set.omega_dot_radps),
        plain!("idot_radps", const { [(AT + 85, 15)] }, Semicircles, -44, ORBIT, set.idot_radps),
        plain!("cis_rad", const { [(AT + 100, 16)] }, Signed, -30, ORBIT, set.cis_rad),
        plain!("cic_rad", const { [(AT + 116, 16)] }, Signed, -30, ORBIT, set.cic_rad),
        plain!("crs_m", const { [(AT + 132, 24)] }, Signed, -8, ORBIT, set.crs_m),
        plain!("crc_m", const { [(AT + 156, 24)] }, Signed, -8, ORBIT, set.crc_m),
        plain!("cus_rad", const { [(AT + 180, 21)] }, Signed, -30, ORBIT, set.cus_rad),
        plain!("cuc_rad", const { [(AT + 201, 21)] }, Signed, -30, ORBIT, set.cuc_rad),
    ]
}

/// The clock, 69 bits.
#[rustfmt::skip]
pub(in crate::beidou) const fn clock<const AT: u16>() -> [Of; 4] {
    [
        element(Field::new("toc_5min", const { &[(AT, 11)] }, Whole, 0, CLOCK),
            |c| steps(c.set.toc), |c, v| c.set.toc = c.set.toc.nearest_tow(v as i64 * STEP_S)),
        plain!("af0_s", const { [(AT + 11, 25)] }, Signed, -34, CLOCK, set.af0_s),
        plain!("af1_sps", const { [(AT + 36, 22)] }, Signed, -50, CLOCK, set.af1_sps),
        plain!("af2_sps2", const { [(AT + 58, 11)] }, Signed, -66, CLOCK, set.af2_sps2),
    ]
}

/// Position of the coefficient whose field has no sign and means a number below zero (7.8).
const BELOW_ZERO: usize = 4;

/// A coefficient of BDGIM by the number of its field, and that by the coefficient.
pub(super) fn signed(place: usize, value: f64) -> f64 {
    if place == BELOW_ZERO { planted!("gnss.bdgim.fifth", 0.0 - value, value.abs()) } else { value }
}

/// BDGIM's coefficients, 74 bits.
#[rustfmt::skip]
pub(in crate::beidou) const fn electrons<const AT: u16>() -> [Of; 9] {
    [
        plain!("alpha_1_tecu", const { [(AT, 10)] }, Unsigned, -3, ELECTRONS, alpha_tecu[0]),
        plain!("alpha_2_tecu", const { [(AT + 10, 8)] }, Signed, -3, ELECTRONS, alpha_tecu[1]),
        plain!("alpha_3_tecu", const { [(AT + 18, 8)] }, Unsigned, -3, ELECTRONS, alpha_tecu[2]),
        plain!("alpha_4_tecu", const { [(AT + 26, 8)] }, Unsigned, -3, ELECTRONS, alpha_tecu[3]),
        element(Field::new("alpha_5_tecu", const { &[(AT + 34, 8)] }, Unsigned, -3, ELECTRONS),
            |c| signed(BELOW_ZERO, c.alpha_tecu[BELOW_ZERO]), |c, v| c.alpha_tecu[BELOW_ZERO] = signed(BELOW_ZERO, v)),
        plain!("alpha_6_tecu", const { [(AT + 42, 8)] }, Signed, -3, ELECTRONS, alpha_tecu[5]),
        plain!("alpha_7_tecu", const { [(AT + 50, 8)] }, Signed, -3, ELECTRONS, alpha_tecu[6]),
        plain!("alpha_8_tecu", const { [(AT + 58, 8)] }, Signed, -3, ELECTRONS, alpha_tecu[7]),
        plain!("alpha_9_tecu", const { [(AT + 66, 8)] }, Signed, -3, ELECTRONS, alpha_tecu[8]),
    ]
}

/// BDT against UTC, 97 bits.
#[rustfmt::skip]
pub(in crate::beidou) const fn utc<const AT: u16>() -> [Of; 9] {
    [
        plain!("utc_a0_s", const { [(AT, 16)] }, Signed, -35, UTC, utc.a0_s),
        plain!("utc_a1_sps", const { [(AT + 16, 13)] }, Signed, -51, UTC, utc.a1_sps),
        plain!("utc_a2_sps2", const { [(AT + 29, 7)] }, Signed, -68, UTC, utc.a2_sps2),
        plain!("leap_s", const { [(AT + 36, 8)] }, Signed, 0, UTC, utc.leap_s),
        plain!("utc_tot_s", const { [(AT + 44, 16)] }, Whole, 4, UTC, utc.tot_s),
        plain!("utc_week", const { [(AT + 60, 13)] }, Whole, 0, UTC, utc.week),
        plain!("leap_week", const { [(AT + 73, 13)] }, Whole, 0, UTC, utc.event_week),
        plain!("leap_day", const { [(AT + 86, 3)] }, Whole, 0, UTC, utc.event_day),
        plain!("leap_after_s", const { [(AT + 89, 8)] }, Signed, 0, UTC, utc.leap_after_s),
    ]
}

/// Health of the satellite.
pub(in crate::beidou) const fn health<const AT: u16>() -> Of {
    element(
        Field::new("health", const { &[(AT, 2)] }, Whole, 0, HEALTH),
        |c| f64::from(c.set.health),
        |c, v| c.set.health = v as u16,
    )
}

/// Integrity of the signal: three flags.
pub(in crate::beidou) const fn flags<const AT: u16>() -> Of {
    plain!("integrity_flags", const { [(AT, 3)] }, Whole, 0, HEALTH, flags)
}

/// Field of B1C's integrity flags in another signal's message.
pub(in crate::beidou) const fn flags_b1c<const AT: u16>() -> Of {
    plain!("integrity_flags_b1c", const { [(AT, 3)] }, Whole, 0, HEALTH, flags_b1c)
}

/// An index of the signal's accuracy, as it is monitored.
pub(in crate::beidou) const fn sismai<const AT: u16>() -> Of {
    element(
        Field::new("sismai", const { &[(AT, 4)] }, Whole, 0, HEALTH),
        |c| f64::from(c.set.ura_index),
        |c, v| c.set.ura_index = v as u8,
    )
}

/// Predicted accuracies of the clock, 22 bits. Records of RINEX have the indices with a sign.
#[rustfmt::skip]
pub(in crate::beidou) const fn accuracies<const AT: u16>() -> [Of; 4] {
    [
        plain!("top_5min", const { [(AT, 11)] }, Whole, 0, ACCURACY, accuracies[0]),
        plain!("sisai_ocb", const { [(AT + 11, 5)] }, Signed, 0, ACCURACY, accuracies[2]),
        plain!("sisai_oc1", const { [(AT + 16, 3)] }, Signed, 0, ACCURACY, accuracies[3]),
        plain!("sisai_oc2", const { [(AT + 19, 3)] }, Signed, 0, ACCURACY, accuracies[4]),
    ]
}

/// Predicted accuracy of the orbit along and across the track.
pub(in crate::beidou) const fn accuracy_along<const AT: u16>() -> Of {
    plain!("sisai_oe", const { [(AT, 5)] }, Signed, 0, ACCURACY, accuracies[1])
}
