//! Content of subframes 4 and 5 about the whole constellation: almanac, health, ionosphere and UTC, page by
//! page.
//!
//! Source: IS-GPS-200N, 20.3.3.5 and table 20-V. An almanac is an ephemeris without its
//! corrections, moved to a common reference time; it is good to a few kilometres for days.

use super::fields::{ALMANAC_PAGE, IONOSPHERE_PAGE, UTC_PAGE};
use crate::bits::{FieldError, write_all};
use crate::broadcast::Ephemeris;
use crate::earth::GPS_PI;
use crate::klobuchar::Klobuchar;
use crate::message::{ALMANAC_STEP_S, almanac_time};
use crate::satellite::{Sv, System};
use crate::time::{Epoch, TimePolynomial};

/// The inclination from which the almanac counts, in semicircles (IS-GPS-200N, table 20-VI).
pub const ALMANAC_INCLINATION_SEMICIRCLES: f64 = 0.30;
const DAY_S: i64 = 86_400;
/// "Data ID" of the present structure, 01, in bits 61 and 62 (IS-GPS-200N, 20.3.3.5.1.1).
const DATA_ID: u32 = 1;
/// Reserved bits alternate (IS-GPS-200N, 20.3.3.5.1).
pub(super) const ALTERNATING: u32 = 0xAA_AAAA;
/// A-S on, a satellite of block IIR (IS-GPS-200N, 20.3.3.5.1.4).
const CONFIGURATION: u32 = 0b1001;
/// Health of a satellite that is not there (IS-GPS-200N, table 20-VIII).
const ABSENT: u32 = 0b11_1111;

/// The SV ID of each page of subframe 4 (IS-GPS-200N, table 20-V).
const SUBFRAME_4_IDS: [u8; 25] =
    [57, 25, 26, 27, 28, 57, 29, 30, 31, 32, 57, 62, 52, 53, 54, 57, 55, 56, 58, 59, 57, 60, 61, 62, 63];
/// The SV ID of page 25 of subframe 5 (IS-GPS-200N, table 20-V).
const HEALTH_ID: u8 = 51;

/// Almanac of one satellite. The week of `toa_s` is in page 25 of subframe 5.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Almanac {
    /// PRN.
    pub number: u8,
    /// Eccentricity of the orbit.
    pub eccentricity: f64,
    /// Reference time in its week, in seconds.
    pub toa_s: f64,
    /// Inclination minus [`ALMANAC_INCLINATION_SEMICIRCLES`], in radians.
    pub delta_i_rad: f64,
    /// Rate of right ascension of the node, in rad/s.
    pub omega_dot_radps: f64,
    /// Health in eight bits: three of the message, five of the signals (IS-GPS-200N, 20.3.3.5.1.3).
    pub health: u8,
    /// Square root of the semi-major axis, in √m.
    pub sqrt_a_sqrtm: f64,
    /// Longitude of the ascending node at the beginning of the week, in radians.
    pub omega0_rad: f64,
    /// Argument of perigee, in radians.
    pub omega_rad: f64,
    /// Mean anomaly at the reference time, in radians.
    pub m0_rad: f64,
    /// Clock offset at the reference time, in seconds.
    pub af0_s: f64,
    /// Clock's drift, s/s.
    pub af1_sps: f64,
}

impl Almanac {
    /// Derives the almanac at `toa` from an ephemeris, not yet rounded.
    ///
    /// The mean-motion correction goes into the semi-major axis, for an almanac has no field for it.
    pub fn derive(ephemeris: &Ephemeris, toa: Epoch) -> Self {
        let mean = ephemeris.mean_at(toa);
        Self {
            number: ephemeris.sv.number,
            eccentricity: ephemeris.eccentricity,
            toa_s: toa.tow_s(),
            delta_i_rad: mean.inclination_rad - ALMANAC_INCLINATION_SEMICIRCLES * GPS_PI,
            omega_dot_radps: ephemeris.omega_dot_radps,
            health: match ephemeris.health as u8 {
                whole if whole & 0x20 == 0 => whole,
                bad => 0xE0 | (bad & 0x1F),
            },
            sqrt_a_sqrtm: mean.sqrt_a_sqrtm,
            omega0_rad: mean.omega0_rad,
            omega_rad: ephemeris.omega_rad,
            m0_rad: mean.m0_rad,
            af0_s: mean.af0_s,
            af1_sps: ephemeris.af1_sps,
        }
    }
}

/// UTC parameters of page 18; weeks are modulo 256 (IS-GPS-200N, 20.3.3.5.2.4).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Utc {
    /// GPS time minus UTC beyond whole seconds at the reference time, in seconds.
    pub a0_s: f64,
    /// Rate of GPS time minus UTC, in s/s.
    pub a1_sps: f64,
    /// Reference time in its week, in seconds.
    pub tot_s: f64,
    /// Week of the reference time, modulo 256.
    pub week: u8,
    /// GPS time minus UTC in whole seconds.
    pub leap_s: i64,
    /// Week, modulo 256, at the end of whose day `event_day` the value `leap_after_s` takes effect.
    pub event_week: u8,
    /// Day of the week, 1 to 7.
    pub event_day: u8,
    /// GPS time minus UTC in whole seconds after the change.
    pub leap_after_s: i64,
}

/// UTC parameters of a message, in the form of a navigation file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UtcData {
    /// GPS time minus UTC in whole seconds.
    pub leap_s: i64,
    /// Remainder of the offset beyond whole seconds. Its reference time is a multiple of 4096 s inside its
    /// week (IS-GPS-200N, 20.3.3.5.2.4). Absent means none, referred to the almanac's time.
    pub polynomial: Option<TimePolynomial>,
    /// Last or next change of the whole seconds.
    pub event: Option<LeapEvent>,
}

/// Change of the whole seconds at the end of a day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeapEvent {
    /// GPS time minus UTC in whole seconds after the change.
    pub after_s: i64,
    /// Week of the change in any count; its lowest 8 bits are sent.
    pub week: i64,
    /// Day of the week, 1 to 7, Sunday first.
    pub day: u8,
}

impl LeapEvent {
    /// First change after one time and up to another, from this program's table of known changes.
    pub fn first(after: Epoch, until: Epoch) -> Option<Self> {
        let leap_s = |seconds: i64| Epoch::new(seconds, 0.0).leap_seconds();
        let (mut before, mut behind) = (after.seconds(), until.seconds());
        if leap_s(before) == leap_s(behind) {
            return None;
        }
        while behind - before > 1 {
            let middle = before + (behind - before) / 2;
            if leap_s(middle) == leap_s(after.seconds()) { before = middle } else { behind = middle }
        }
        let after_s = leap_s(behind);
        // UTC's midnight, at the end of the day before.
        let days = (behind - after_s).div_euclid(DAY_S) - 1;
        Some(Self { after_s, week: days.div_euclid(7), day: days.rem_euclid(7) as u8 + 1 })
    }
}

/// A page of reserved or dummy content: everything after the SV ID alternates.
fn blank(sv_id: u8) -> [u32; 10] {
    let mut data = [ALTERNATING; 10];
    put(&mut data, 0, &[(DATA_ID << 6) | u32::from(sv_id)], 8);
    data
}

/// Writes `values` of `length` bits each one after another from data bit `first` (0 is the first of word 3;
/// parity is not counted).
fn put(data: &mut [u32; 10], first: u32, values: &[u32], length: u32) {
    let mut at = first;
    for value in values {
        for bit in (0..length).rev() {
            if let Some(word) = data.get_mut(2 + (at / 24) as usize) {
                let shift = 23 - at % 24;
                *word = (*word & !(1 << shift)) | (((value >> bit) & 1) << shift);
            }
            at += 1;
        }
    }
}

fn almanac_page(sv_id: u8, almanac: &[Almanac]) -> Result<[u32; 10], FieldError> {
    match almanac.iter().find(|entry| entry.number == sv_id) {
        Some(entry) => {
            let mut data = blank(sv_id);
            write_all(&ALMANAC_PAGE, entry, &mut data)?;
            Ok(data)
        }
        None => Ok(blank(0)),
    }
}

fn health_of(number: u8, ephemerides: &[Ephemeris]) -> u32 {
    ephemerides.iter().find(|e| e.sv.number == number).map_or(ABSENT, |e| u32::from(e.health))
}

/// The data words of all pages, subframe 4 first; words 1 and 2 are the caller's.
pub(super) fn pages(
    klobuchar: Option<&Klobuchar>,
    utc: &UtcData,
    ephemerides: &[Ephemeris],
    reference: Epoch,
) -> Result<Vec<[u32; 10]>, FieldError> {
    if let Some(stranger) = ephemerides.iter().find(|e| e.sv.system != System::Gps || !(1..=32).contains(&e.sv.number))
    {
        let value = f64::from(stranger.sv.number);
        return Err(FieldError::OutOfRange { name: "sv_id", value, minimum: 1.0, maximum: 32.0 });
    }
    let toa = almanac_time(reference);
    let almanac: Vec<Almanac> = ephemerides.iter().map(|e| Almanac::derive(e, toa)).collect();
    let mut all = Vec::with_capacity(50);
    for id in SUBFRAME_4_IDS {
        all.push(match id {
            25..=32 => almanac_page(id, &almanac)?,
            52 => correction_table(),
            55 => special_message(),
            56 => ionosphere_and_utc(klobuchar, utc, toa)?,
            63 => configuration(ephemerides),
            reserved => blank(reserved),
        });
    }
    for number in 1..=24 {
        all.push(almanac_page(number, &almanac)?);
    }
    all.push(health(ephemerides, toa));
    Ok(all)
}

/// Page 13: the table is not available, nor is any of its entries (IS-GPS-200N, 20.3.3.5.1.9).
fn correction_table() -> [u32; 10] {
    let mut data = blank(52);
    put(&mut data, 8, &[0b10], 2);
    put(&mut data, 10, &[0b10_0000; 30], 6);
    data
}

/// Page 17: 22 characters, all spaces (IS-GPS-200N, 20.3.3.5.1.8).
fn special_message() -> [u32; 10] {
    let mut data = blank(55);
    put(&mut data, 8, &[0x20; 22], 8);
    data
}

/// Page 18; a dummy page when there is no ionosphere to report, since the page cannot state "none".
fn ionosphere_and_utc(
    klobuchar: Option<&Klobuchar>,
    utc: &UtcData,
    almanac_time: Epoch,
) -> Result<[u32; 10], FieldError> {
    let Some(klobuchar) = klobuchar else { return Ok(blank(0)) };
    let mut data = blank(56);
    write_all(&IONOSPHERE_PAGE, klobuchar, &mut data)?;
    let none = TimePolynomial { a0_s: 0.0, a1_sps: 0.0, reference: almanac_time };
    let TimePolynomial { a0_s, a1_sps, reference } = utc.polynomial.unwrap_or(none);
    // Without an event the numbers before and after are the same, at the end of this week.
    let still = LeapEvent { after_s: utc.leap_s, week: almanac_time.week(), day: 7 };
    let LeapEvent { after_s, week, day } = utc.event.unwrap_or(still);
    let utc = Utc {
        a0_s,
        a1_sps,
        tot_s: reference.tow_s(),
        week: reference.week().rem_euclid(256) as u8,
        leap_s: utc.leap_s,
        event_week: week.rem_euclid(256) as u8,
        event_day: day,
        leap_after_s: after_s,
    };
    write_all(&UTC_PAGE, &utc, &mut data)?;
    Ok(data)
}

/// Page 25 of subframe 4: configurations of all, health of 25 to 32 (figure 20-1, sheet 9).
fn configuration(ephemerides: &[Ephemeris]) -> [u32; 10] {
    let mut data = blank(63);
    let present = |number| if ephemerides.iter().any(|e| e.sv == Sv::gps(number)) { CONFIGURATION } else { 0 };
    put(&mut data, 8, &(1..=32).map(present).collect::<Vec<_>>(), 4);
    put(&mut data, 138, &(25..=32).map(|number| health_of(number, ephemerides)).collect::<Vec<_>>(), 6);
    data
}

/// Page 25 of subframe 5: reference time, health of 1 to 24 (figure 20-1, sheet 5).
fn health(ephemerides: &[Ephemeris], toa: Epoch) -> [u32; 10] {
    let mut data = blank(HEALTH_ID);
    put(&mut data, 8, &[(toa.tow_whole_s() / ALMANAC_STEP_S) as u32, toa.week().rem_euclid(256) as u32], 8);
    put(&mut data, 24, &(1..=24).map(|number| health_of(number, ephemerides)).collect::<Vec<_>>(), 6);
    data
}
