//! The field tables of I/NAV: positions count from 0, the first bit of a word (Galileo OS SIS ICD 2.1, tables
//! 42 to 54).

use super::almanac::{GPS_OFFSET, WORD_7, WORD_8, WORD_9, WORD_10};
use super::reduced::WORD_16;
use crate::bits::Kind::{Semicircles, Signed, Turn, Unsigned, Whole};
use crate::bits::{Element, Field, element, fields, plain};
use crate::broadcast::Ephemeris;
use crate::galileo::status::{E1B, E5B};
use crate::ionosphere::Coefficients;
use crate::message::Common;
use crate::nequick::NequickG;
use crate::time::{Epoch, WEEK_S};

/// Continuous GPS week of week 0 of Galileo's system time (5.1.2).
pub const GST_WEEK: i64 = 1024;

/// Content of words 1 to 5.
#[derive(Clone, Debug)]
pub(in crate::galileo) struct Orbit {
    pub ephemeris: Ephemeris,
    pub nequick: [f64; 3],
}

impl Orbit {
    /// Content with an ephemeris and no ionosphere.
    pub fn of(ephemeris: Ephemeris) -> Self {
        Self { ephemeris, nequick: [0.0; 3] }
    }
}

/// Names of NeQuick-G's coefficients in I/NAV and F/NAV, in their order.
const NEQUICK: [&str; 3] = ["ai0_sfu", "ai1_sfupdeg", "ai2_sfupdeg2"];

/// Parameters of I/NAV and F/NAV by which ephemerides and senders are distinguished, and what all satellites
/// send alike.
pub(in crate::galileo) const FIXED: [&str; 7] = ["iodnav", "svid", "week", "tow_s", NEQUICK[0], NEQUICK[1], NEQUICK[2]];

/// Coefficients of NeQuick-G by the values of their names; `None` if one is missing.
pub(in crate::galileo) fn coefficients(value: impl Fn(&str) -> Option<f64>) -> Option<Coefficients> {
    let mut coefficients = [0.0; 3];
    for (own, name) in coefficients.iter_mut().zip(NEQUICK) {
        *own = value(name)?;
    }
    Some(Coefficients::NequickG(NequickG { coefficients }))
}

/// Content of word 6 (5.1.7) and its time of transmission.
#[derive(Clone, Debug, Default)]
pub(in crate::galileo) struct Utc {
    pub a0_s: f64,
    pub a1_sps: f64,
    pub leap_s: i64,
    pub reference: (i64, i64),
    pub event: (i64, i64),
    pub leap_after_s: i64,
    pub sent_s: i64,
}

impl Utc {
    /// Collects the UTC parameters of a scene: the offset of GPS time, and the offset of the system's own
    /// time ahead of GPS time.
    pub fn of(common: &Common, start: Epoch) -> Self {
        let utc = &common.utc;
        let reference = utc.polynomial.map_or(common.reference.unwrap_or(start), |polynomial| polynomial.reference);
        let event = utc.event.map_or((start.week(), 7, utc.leap_s), |e| (e.week, i64::from(e.day), e.after_s));
        Self {
            a0_s: utc.polynomial.map_or(0.0, |polynomial| polynomial.a0_s)
                + common.galileo.map_or(0.0, |offset| offset.at_s(reference)),
            a1_sps: utc.polynomial.map_or(0.0, |polynomial| polynomial.a1_sps)
                + common.galileo.map_or(0.0, |offset| offset.a1_sps),
            leap_s: utc.leap_s,
            reference: (reference.week(), reference.tow_whole_s() / HOUR_S),
            event: (event.0, event.1),
            leap_after_s: event.2,
            sent_s: start.tow_whole_s(),
        }
    }
}

pub(in crate::galileo) const HOUR_S: i64 = 3600;
pub(in crate::galileo) const MINUTE_S: f64 = 60.0;

pub(in crate::galileo) const ORBIT: &str = "5.1.1, table 57";
pub(in crate::galileo) const CLOCK: &str = "5.1.3, table 62";
pub(in crate::galileo) const DELAY: &str = "5.1.5, table 64";
pub(in crate::galileo) const IONOSPHERE: &str = "5.1.6, table 65";
pub(in crate::galileo) const UTC: &str = "5.1.7, table 68";
pub(in crate::galileo) const TIME: &str = "5.1.2, table 59";

type Of = Element<Orbit>;

/// The week as messages count it.
pub(in crate::galileo) fn gst_week(at: Epoch) -> f64 {
    (at.week() - GST_WEEK).rem_euclid(4096) as f64
}

/// The issue of data, alike in words 1 to 4.
pub(in crate::galileo) const ISSUE: Of = element(
    Field::new("iodnav", &[(6, 10)], Whole, 0, "5.1.9.2"),
    |o| f64::from(o.ephemeris.iode),
    |o, v| (o.ephemeris.iode, o.ephemeris.iodc) = (v as u16, v as u16),
);

/// The week of sending; what sets it is the caller.
pub(in crate::galileo) const fn week(pieces: &'static [(u16, u8)]) -> Of {
    element(Field::new("week", pieces, Whole, 0, TIME), |o| gst_week(o.ephemeris.transmitted), |_, _| {})
}

/// The time of week of sending.
pub(in crate::galileo) const fn tow(pieces: &'static [(u16, u8)]) -> Of {
    element(Field::new("tow_s", pieces, Whole, 0, TIME), |o| o.ephemeris.transmitted.tow_s(), |_, _| {})
}

/// The spare word: week and time of week.
#[rustfmt::skip]
pub(super) static WORD_0: [Of; 2] = [
    week(&[(96, 12)]),
    tow(&[(108, 20)]),
];

#[rustfmt::skip]
pub(super) static WORD_1: [Of; 5] = [
    ISSUE,
    element(Field::new("toe_min", &[(16, 14)], Whole, 0, ORBIT),
        |o| o.ephemeris.toe.tow_s() / MINUTE_S,
        |o, v| o.ephemeris.toe = o.ephemeris.toe.nearest_tow((v * MINUTE_S) as i64)),
    plain!("m0_rad", [(30, 32)], Turn, -31, ORBIT, ephemeris.m0_rad),
    plain!("eccentricity", [(62, 32)], Unsigned, -33, ORBIT, ephemeris.eccentricity),
    plain!("sqrt_a_sqrtm", [(94, 32)], Unsigned, -19, ORBIT, ephemeris.sqrt_a_sqrtm),
];

#[rustfmt::skip]
pub(super) static WORD_2: [Of; 5] = [
    ISSUE,
    plain!("omega0_rad", [(16, 32)], Turn, -31, ORBIT, ephemeris.omega0_rad),
    plain!("i0_rad", [(48, 32)], Semicircles, -31, ORBIT, ephemeris.i0_rad),
    plain!("omega_rad", [(80, 32)], Turn, -31, ORBIT, ephemeris.omega_rad),
    plain!("idot_radps", [(112, 14)], Semicircles, -43, ORBIT, ephemeris.idot_radps),
];

#[rustfmt::skip]
pub(super) static WORD_3: [Of; 8] = [
    ISSUE,
    plain!("omega_dot_radps", [(16, 24)], Semicircles, -43, ORBIT, ephemeris.omega_dot_radps),
    plain!("delta_n_radps", [(40, 16)], Semicircles, -43, ORBIT, ephemeris.delta_n_radps),
    plain!("cuc_rad", [(56, 16)], Signed, -29, ORBIT, ephemeris.cuc_rad),
    plain!("cus_rad", [(72, 16)], Signed, -29, ORBIT, ephemeris.cus_rad),
    plain!("crc_m", [(88, 16)], Signed, -5, ORBIT, ephemeris.crc_m),
    plain!("crs_m", [(104, 16)], Signed, -5, ORBIT, ephemeris.crs_m),
    element(Field::new("sisa_index", &[(120, 8)], Whole, 0, "5.1.12, table 90"),
        |o| f64::from(o.ephemeris.ura_index), |o, v| o.ephemeris.ura_index = v as u8),
];

#[rustfmt::skip]
pub(super) static WORD_4: [Of; 8] = [
    ISSUE,
    element(Field::new("svid", &[(16, 6)], Whole, 0, "5.1.9.3"), |o| f64::from(o.ephemeris.sv.number), |_, _| {}),
    plain!("cic_rad", [(22, 16)], Signed, -29, ORBIT, ephemeris.cic_rad),
    plain!("cis_rad", [(38, 16)], Signed, -29, ORBIT, ephemeris.cis_rad),
    element(Field::new("toc_min", &[(54, 14)], Whole, 0, CLOCK),
        |o| o.ephemeris.toc.tow_s() / MINUTE_S,
        |o, v| o.ephemeris.toc = o.ephemeris.toc.nearest_tow((v * MINUTE_S) as i64)),
    plain!("af0_s", [(68, 31)], Signed, -34, CLOCK, ephemeris.af0_s),
    plain!("af1_sps", [(99, 21)], Signed, -46, CLOCK, ephemeris.af1_sps),
    plain!("af2_sps2", [(120, 6)], Signed, -59, CLOCK, ephemeris.af2_sps2),
];

#[rustfmt::skip]
pub(super) static WORD_5: [Of; 11] = [
    plain!("ai0_sfu", [(6, 11)], Unsigned, -2, IONOSPHERE, nequick[0]),
    plain!("ai1_sfupdeg", [(17, 11)], Signed, -8, IONOSPHERE, nequick[1]),
    plain!("ai2_sfupdeg2", [(28, 14)], Signed, -15, IONOSPHERE, nequick[2]),
    plain!("bgd_e1_e5a_s", [(47, 10)], Signed, -32, DELAY, ephemeris.tgd2_s),
    plain!("bgd_e1_e5b_s", [(57, 10)], Signed, -32, DELAY, ephemeris.tgd_s),
    element(Field::new("e5b_health", &[(67, 2)], Whole, 0, "5.1.9.7"),
        |o| E5B.health(&o.ephemeris), |o, v| E5B.set_health(&mut o.ephemeris, v)),
    element(Field::new("e1b_health", &[(69, 2)], Whole, 0, "5.1.9.7"),
        |o| E1B.health(&o.ephemeris), |o, v| E1B.set_health(&mut o.ephemeris, v)),
    element(Field::new("e5b_data_validity", &[(71, 1)], Whole, 0, "5.1.9.6"),
        |o| E5B.validity(&o.ephemeris), |o, v| E5B.set_validity(&mut o.ephemeris, v)),
    element(Field::new("e1b_data_validity", &[(72, 1)], Whole, 0, "5.1.9.6"),
        |o| E1B.validity(&o.ephemeris), |o, v| E1B.set_validity(&mut o.ephemeris, v)),
    week(&[(73, 12)]),
    tow(&[(85, 20)]),
];

#[rustfmt::skip]
pub(super) static WORD_6: [Element<Utc>; 9] = [
    plain!("utc_a0_s", [(6, 32)], Signed, -30, UTC, a0_s),
    plain!("utc_a1_sps", [(38, 24)], Signed, -50, UTC, a1_sps),
    element(Field::new("utc_leap_s", &[(62, 8)], Signed, 0, UTC), |u| u.leap_s as f64, |u, v| u.leap_s = v as i64),
    element(Field::new("utc_t0_h", &[(70, 8)], Whole, 0, UTC),
        |u| u.reference.1 as f64, |u, v| u.reference.1 = v as i64),
    element(Field::new("utc_week", &[(78, 8)], Whole, 0, UTC),
        |u| (u.reference.0 - GST_WEEK).rem_euclid(256) as f64, |u, v| u.reference.0 = v as i64 + GST_WEEK),
    element(Field::new("utc_event_week", &[(86, 8)], Whole, 0, UTC),
        |u| (u.event.0 - GST_WEEK).rem_euclid(256) as f64, |u, v| u.event.0 = v as i64 + GST_WEEK),
    element(Field::new("utc_event_day", &[(94, 3)], Whole, 0, UTC), |u| u.event.1 as f64, |u, v| u.event.1 = v as i64),
    element(Field::new("utc_leap_after_s", &[(97, 8)], Signed, 0, UTC),
        |u| u.leap_after_s as f64, |u, v| u.leap_after_s = v as i64),
    element(Field::new("tow_s", &[(105, 20)], Whole, 0, TIME),
        |u| (u.sent_s % WEEK_S) as f64, |u, v| u.sent_s = v as i64),
];

/// Index of the signal-in-space accuracy nearest to one in metres (5.1.12, table 90). It is 255, no
/// prediction, without an accuracy or above 6 m.
pub fn sisa_index(accuracy_m: Option<f64>) -> u8 {
    // First index, its metres, and the step to the next one, of each range.
    const RANGES: [(f64, f64, f64); 4] = [(0.0, 0.0, 0.01), (50.0, 0.5, 0.02), (75.0, 1.0, 0.04), (100.0, 2.0, 0.16)];
    let Some(metres) = accuracy_m.filter(|metres| (0.0..=6.0).contains(metres)) else { return 255 };
    let range = RANGES.iter().rev().find(|(_, least, _)| metres > least - 1e-9);
    range.map_or(255, |(first, least, step)| (first + ((metres - least) / step).round()) as u8)
}

/// Lists every field by the word that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    vec![
        ("word 0", fields(&[&WORD_0])),
        ("word 1", fields(&[&WORD_1])),
        ("word 2", fields(&[&WORD_2])),
        ("word 3", fields(&[&WORD_3])),
        ("word 4", fields(&[&WORD_4])),
        ("word 5", fields(&[&WORD_5])),
        ("word 6", fields(&[&WORD_6])),
        ("word 7", fields(&[&WORD_7])),
        ("word 8", fields(&[&WORD_8])),
        ("word 9", fields(&[&WORD_9])),
        ("word 10", fields(&[&WORD_10, &GPS_OFFSET])),
        ("word 16", fields(&[&WORD_16])),
    ]
}
