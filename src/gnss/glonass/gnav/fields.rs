//! The field tables of GLONASS's strings: positions count from 0, the first bit sent, which the document
//! numbers 85 (GLONASS ICD L1, L2 5.1, 4.3.2 and table 4.5). Kilometres are those of the document.

use crate::bits::Kind::{Magnitude, Whole};
use crate::bits::{Bits, Element, Field, element, fields, plain};
use crate::broadcast::{Ephemeris, StateVector};
use crate::time::Epoch;

/// Bits of a string, the first an idle one, the last eight its checks.
pub const STRING_BITS: usize = 85;

/// A string.
pub type GlonassString = Bits<STRING_BITS>;

const IMMEDIATE: &str = "4.4, strings 1 to 4";
const SYSTEM: &str = "4.4, string 5";

/// Seconds of the steps in which the reference time counts.
const TB_STEP_S: i64 = 900;
const DAY_S: i64 = 86_400;
/// Days from 1980-01-06, with which epochs begin, to 1996-01-01, with which the first four years do.
const FIRST_DAY: i64 = 5839;
const DAYS_OF_FOUR_YEARS: i64 = 1461;
const KM: f64 = 1000.0;

type Of = Element<Ephemeris>;

/// Number of the four years, from 1996 on, and of the day in them, both from 1.
pub(super) fn date(at: Epoch) -> (i64, i64) {
    let days = at.seconds().div_euclid(DAY_S) - FIRST_DAY;
    (days.div_euclid(DAYS_OF_FOUR_YEARS) + 1, days.rem_euclid(DAYS_OF_FOUR_YEARS) + 1)
}

/// The beginning of a day by its four years' number and its own.
pub(super) fn midnight((four_years, day): (i64, i64)) -> Epoch {
    let days = FIRST_DAY + (four_years - 1) * DAYS_OF_FOUR_YEARS + day - 1;
    Epoch::new(planted!("gnss.glonass.day", days, days + 1) * DAY_S, 0.0)
}

/// The time of that second of a day nearest to `near`.
fn nearest_of_day(near: Epoch, second: i64) -> Epoch {
    let ahead_s = (second - near.seconds() + DAY_S / 2).rem_euclid(DAY_S) - DAY_S / 2;
    Epoch::new(near.seconds() + ahead_s, 0.0)
}

fn vector(set: &Ephemeris) -> StateVector {
    set.vector.unwrap_or_default()
}

fn change(set: &mut Ephemeris, change: impl FnOnce(&mut StateVector)) {
    change(set.vector.get_or_insert_default());
}

/// Sets the reference times of orbit and clock, which are one.
fn refer(set: &mut Ephemeris, at: Epoch) {
    (set.toe, set.toc) = (at, at);
}

/// String 1.
#[rustfmt::skip]
pub(super) static STRING_1: [Of; 3] = [
    element(Field::new("vx_kmps", &[(21, 24)], Magnitude, -20, IMMEDIATE),
        |e| vector(e).velocity_mps.x / KM, |e, v| change(e, |of| of.velocity_mps.x = v * KM)),
    element(Field::new("ax_kmps2", &[(45, 5)], Magnitude, -30, IMMEDIATE),
        |e| vector(e).acceleration_mps2.x / KM, |e, v| change(e, |of| of.acceleration_mps2.x = v * KM)),
    element(Field::new("x_km", &[(50, 27)], Magnitude, -11, IMMEDIATE),
        |e| vector(e).position_m.x / KM, |e, v| change(e, |of| of.position_m.x = v * KM)),
];

/// String 2.
#[rustfmt::skip]
pub(super) static STRING_2: [Of; 5] = [
    element(Field::new("health", &[(5, 3)], Whole, 0, IMMEDIATE),
        |e| f64::from(e.health & 7), |e, v| e.health = v as u16 | e.health & 8),
    // In quarters of an hour; whole ones, as the field has no fractions.
    element(Field::new("tb_quarters", &[(9, 7)], Whole, 0, IMMEDIATE),
        |e| e.toe.seconds().rem_euclid(DAY_S) as f64 / TB_STEP_S as f64, |e, v| {
            refer(e, nearest_of_day(e.toe, v as i64 * TB_STEP_S));
            (e.iode, e.iodc) = (v as u16, v as u16);
        }),
    element(Field::new("vy_kmps", &[(21, 24)], Magnitude, -20, IMMEDIATE),
        |e| vector(e).velocity_mps.y / KM, |e, v| change(e, |of| of.velocity_mps.y = v * KM)),
    element(Field::new("ay_kmps2", &[(45, 5)], Magnitude, -30, IMMEDIATE),
        |e| vector(e).acceleration_mps2.y / KM, |e, v| change(e, |of| of.acceleration_mps2.y = v * KM)),
    element(Field::new("y_km", &[(50, 27)], Magnitude, -11, IMMEDIATE),
        |e| vector(e).position_m.y / KM, |e, v| change(e, |of| of.position_m.y = v * KM)),
];

/// String 3.
#[rustfmt::skip]
pub(super) static STRING_3: [Of; 5] = [
    plain!("gamma", [(6, 11)], Magnitude, -40, IMMEDIATE, af1_sps),
    element(Field::new("unhealthy", &[(20, 1)], Whole, 0, IMMEDIATE),
        |e| f64::from(e.health >> 3 & 1), |e, v| e.health = e.health & 7 | (v as u16) << 3),
    element(Field::new("vz_kmps", &[(21, 24)], Magnitude, -20, IMMEDIATE),
        |e| vector(e).velocity_mps.z / KM, |e, v| change(e, |of| of.velocity_mps.z = v * KM)),
    element(Field::new("az_kmps2", &[(45, 5)], Magnitude, -30, IMMEDIATE),
        |e| vector(e).acceleration_mps2.z / KM, |e, v| change(e, |of| of.acceleration_mps2.z = v * KM)),
    element(Field::new("z_km", &[(50, 27)], Magnitude, -11, IMMEDIATE),
        |e| vector(e).position_m.z / KM, |e, v| change(e, |of| of.position_m.z = v * KM)),
];

/// String 4. The day is that of the reference time, for ephemerides refer to no midnight but where they are
/// sent.
#[rustfmt::skip]
pub(super) static STRING_4: [Of; 6] = [
    // What is sent is by how much GLONASS time is ahead of the satellite's.
    element(Field::new("tau_s", &[(5, 22)], Magnitude, -30, IMMEDIATE),
        |e| planted!("gnss.glonass.tau_sent", -e.af0_s, e.af0_s),
        |e, v| e.af0_s = planted!("gnss.glonass.tau_read", -v, v)),
    plain!("delta_tau_s", [(27, 5)], Magnitude, -30, IMMEDIATE, tgd_s),
    element(Field::new("age_days", &[(32, 5)], Whole, 0, IMMEDIATE),
        |e| f64::from(e.aodo), |e, v| e.aodo = v as u8),
    element(Field::new("accuracy_index", &[(52, 4)], Whole, 0, IMMEDIATE),
        |e| f64::from(e.ura_index), |e, v| e.ura_index = v as u8),
    element(Field::new("day", &[(59, 11)], Whole, 0, IMMEDIATE),
        |e| date(e.toe).1 as f64, |e, v| {
            let (four_years, _) = date(e.toe);
            let of_day = e.toe.seconds().rem_euclid(DAY_S) as f64;
            // The day of the four years that is nearest: they may just have ended.
            let days = [four_years - 1, four_years, four_years + 1].map(|years| midnight((years, v as i64)));
            let far = |day: &Epoch| day.plus_s(of_day).since(e.toe).abs();
            let day = days.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            refer(e, day.unwrap_or(e.toe).plus_s(of_day));
        }),
    element(Field::new("slot", &[(70, 5)], Whole, 0, IMMEDIATE), |e| f64::from(e.sv.number), |_, _| {}),
];

/// Content of string 5 about the system's time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SystemTime {
    /// Number of the four years, from 1996 on.
    pub four_years: f64,
    /// UTC(SU) minus GLONASS time in seconds, without the three hours between both.
    pub tau_c_s: f64,
    /// GPS time minus GLONASS time in days, without the whole seconds between both.
    pub tau_gps_days: f64,
}

#[rustfmt::skip]
pub(super) static STRING_5: [Element<SystemTime>; 3] = [
    plain!("tau_c_s", [(16, 32)], Magnitude, -31, SYSTEM, tau_c_s),
    plain!("four_years", [(49, 5)], Whole, 0, SYSTEM, four_years),
    plain!("tau_gps_days", [(54, 22)], Magnitude, -30, SYSTEM, tau_gps_days),
];

/// Lists every field by its string.
pub fn tables() -> Vec<(u8, Vec<&'static Field>)> {
    vec![
        (1, fields(&[&STRING_1])),
        (2, fields(&[&STRING_2])),
        (3, fields(&[&STRING_3])),
        (4, fields(&[&STRING_4])),
        (5, fields(&[&STRING_5])),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_count_from_1996_on_in_fours_of_years() {
        let of = |text: &str| date(Epoch::parse(text).unwrap());
        assert_eq!([of("1996-01-01T00:00:00"), of("1999-12-31T23:59:59")], [(1, 1), (1, 1461)]);
        assert_eq!([of("2000-01-01T00:00:00"), of("2023-09-19T00:00:00")], [(2, 1), (7, 1358)]);
        for day in 0..3000 {
            let at = Epoch::new((FIRST_DAY + day) * DAY_S, 0.0);
            assert_eq!(midnight(date(at)), at);
        }
    }
}
