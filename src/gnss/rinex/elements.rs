//! Records of a navigation file as ephemerides: every element held against the range of its field in the
//! message.
//!
//! Source: IS-GPS-200N, tables 20-I and 20-III; Galileo OS SIS ICD 2.1, tables 57, 62 and 64; IRNSS SIS ICD
//! for SPS 1.1, subframes 1 and 2; RINEX 3.05, table A18; RINEX 4.02, tables A9 and A13.

use nalgebra::Vector3;

use super::columns::Record;
use crate::beidou::d1d2::{D1_SETS, issue};
use crate::broadcast::{Ephemeris, STRING_3_UNHEALTHY, StateVector, status_of_record};
use crate::galileo::fnav::FNAV_SETS;
use crate::galileo::inav::{INAV_SETS, sisa_index};
use crate::glonass::fdma::channel;
use crate::glonass::gnav::GNAV_SETS;
use crate::gps::lnav::LNAV_SETS;
use crate::qzss::lnav;
use crate::satellite::System;
use crate::sbas::message::{SBAS_SETS, step_of_day};
use crate::time::{BDT, BDT_WEEK, Epoch, GLONASST, UTC, WEEK_S};

/// An element that must be there and lie within its range, in SI units.
fn field(record: &Record, key: &'static str, least: f64, most: f64) -> Result<f64, String> {
    let value = record.get(key).ok_or_else(|| format!("{key} is blank"))?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{key} = {value:e}: expected {least:e} to {most:e}"))
    }
}

fn whole(record: &Record, key: &'static str, most: u32) -> Result<u32, String> {
    let value = field(record, key, 0.0, f64::from(most))?;
    if value == value.floor() { Ok(value as u32) } else { Err(format!("{key} = {value}: expected a whole number")) }
}

/// The ephemeris in a record.
///
/// # Errors
/// The element that is missing or out of its range.
pub(super) fn ephemeris(record: &Record) -> Result<Ephemeris, String> {
    if record.sv.system == System::Glonass {
        return glonass(record);
    }
    if record.sv.system == System::Sbas {
        return sbas(record);
    }
    // Fields that both messages have in the same units and lengths; RINEX rounds to twelve digits.
    const ANGLE_RAD: f64 = 2.0 * std::f64::consts::TAU;
    const HARMONIC_RAD: f64 = 6.104e-5;
    const HARMONIC_M: f64 = 1024.001;
    let both = |name, most: f64| field(record, name, -most, most);
    let harmonic_m = if record.sv.system == System::BeiDou { 2.0 * HARMONIC_M } else { HARMONIC_M };

    let toc = record.toc;
    let toe = near(toc, field(record, "toe", 0.0, 604_800.0)?);
    // BeiDou's records are in its own time.
    let before = if record.sv.system == System::BeiDou { BDT_WEEK as f64 } else { 0.0 };
    let week = f64::from(whole(record, "week", 9999)?) + before;
    let astray = (week - toe.week() as f64).abs() % 1024.0;
    if astray > 1.0 && astray < 1023.0 {
        return Err(format!("week = {}: expected that of its epoch, {}", week - before, toe.week() as f64 - before));
    }
    // The last line of a record begins with it: without it the file was cut, perhaps inside a number.
    if record.get("t_tm").is_none() {
        return Err("no transmission time: the record is cut short".to_owned());
    }
    let common = Ephemeris {
        toe,
        toc,
        m0_rad: both("m0", ANGLE_RAD)?,
        delta_n_radps: both("deltaN", if record.sv.system == System::Navic { 2.997e-6 } else { 1.171e-8 })?,
        omega0_rad: both("omega0", ANGLE_RAD)?,
        omega_dot_radps: both("omegaDot", 2.997e-6)?,
        omega_rad: both("omega", ANGLE_RAD)?,
        i0_rad: field(record, "i0", 0.0, std::f64::consts::PI)?,
        idot_radps: both("idot", 2.927e-9)?,
        cuc_rad: both("cuc", HARMONIC_RAD)?,
        cus_rad: both("cus", HARMONIC_RAD)?,
        crc_m: both("crc", harmonic_m)?,
        crs_m: both("crs", harmonic_m)?,
        cic_rad: both("cic", HARMONIC_RAD)?,
        cis_rad: both("cis", HARMONIC_RAD)?,
        ..Ephemeris::blank(record.sv, toe)
    };
    match record.sv.system {
        System::Galileo => galileo(record, common),
        System::Navic => navic(record, common),
        System::BeiDou => beidou(record, common).map(|set| set.timed(|label| BDT.instant(label))),
        System::Qzss => gps(record, common).map(|set| Ephemeris { form: &lnav::LNAV_SETS, ..set }),
        _ => gps(record, common),
    }
}

/// Largest difference in seconds between the reference times of BeiDou's orbit and clock: the time for which
/// an ephemeris is used. Among 2218 records of two days, three differ by an hour.
const REFERENCES_S: f64 = 4.0 * 3600.0;

/// The rest of an ephemeris of BeiDou, by its own time (BDS-SIS-ICD-B1I 3.0, tables 5-6 and 5-8; RINEX 3.05,
/// table A14).
fn beidou(record: &Record, common: Ephemeris) -> Result<Ephemeris, String> {
    let both = |name, most: f64| field(record, name, -most, most);
    if common.toe.since(common.toc).abs() > REFERENCES_S {
        return Err(format!("toe = {}: expected within 4 h of the record's epoch, {}", common.toe, common.toc));
    }
    Ok(Ephemeris {
        form: &D1_SETS,
        transmitted: transmitted(record, common.toe, common.toe),
        iode: issue(common.toe.tow_s()),
        iodc: whole(record, "aodc", 31)? as u16,
        aodo: whole(record, "iode", 31)? as u8,
        ura_index: ura_index(optional_accuracy(record)?),
        health: whole(record, "health", 1)? as u16,
        sqrt_a_sqrtm: field(record, "sqrta", 5200.0, 6540.0)?,
        eccentricity: field(record, "e", 0.0, 0.1)?,
        af0_s: both("af0", 9.766e-4)?,
        af1_sps: both("af1", 1.863e-9)?,
        af2_sps2: both("af2", 1.388e-17)?,
        tgd_s: both("tgd1", 5.121e-8)?,
        tgd2_s: both("tgd2", 5.121e-8)?,
        ..common
    })
}

/// An ephemeris of GLONASS: a state vector (GLONASS ICD L1, L2 5.1, table 4.5; RINEX 3.05, table A10). Its
/// epoch is the reference time, in UTC.
fn glonass(record: &Record) -> Result<Ephemeris, String> {
    const DAY_S: f64 = 86_400.0;
    let both = |name, most: f64| field(record, name, -most, most);
    let three = |names: [&'static str; 3], most: f64| -> Result<Vector3<f64>, String> {
        let [x, y, z] = names;
        Ok(Vector3::new(both(x, most)?, both(y, most)?, both(z, most)?) * 1000.0)
    };
    let own = channel(record.sv.number);
    let channel = both("channel", 24.0)?;
    if own.map(f64::from) != Some(channel) {
        let own = own.map_or("none".to_owned(), |own| own.to_string());
        return Err(format!("channel = {channel}: expected {own}, the one that this program knows for the slot"));
    }
    let toe = UTC.instant(record.toc);
    // The beginning of the frame, by the second of the day, or since version 3 of the week.
    let late_s = field(record, "t_tm", 0.0, WEEK_S as f64)? - record.toc.seconds().rem_euclid(DAY_S as i64) as f64;
    let late_s = late_s - (late_s / DAY_S).round() * DAY_S;
    let quarter = (GLONASST.label(toe).seconds().rem_euclid(DAY_S as i64) / 900) as u16;
    let vector = StateVector {
        position_m: three(["x", "y", "z"], 32_768.0)?,
        velocity_mps: three(["vx", "vy", "vz"], 8.0)?,
        acceleration_mps2: three(["ax", "ay", "az"], 1.4e-8)?,
    };
    // Not known to earlier versions, and to receivers of one band.
    let later_s = record.get("deltaTau").filter(|seconds| seconds.abs() < 1e-6).unwrap_or(0.0);
    let accuracy = record.get("accuracyIndex").filter(|index| (0.0..15.0).contains(index)).unwrap_or(15.0);
    // Its other bits say what the almanac says, which is not sent here.
    let unhealthy = record.get("healthFlags").map_or(0, |flags| flags as u16 >> STRING_3_UNHEALTHY & 1);
    Ok(Ephemeris {
        form: &GNAV_SETS,
        transmitted: toe.plus_s(late_s),
        iode: quarter,
        iodc: quarter,
        ura_index: accuracy as u8,
        health: if field(record, "health", 0.0, 7.0)? == 0.0 { 0 } else { 0b100 } | unhealthy << 3,
        aodo: whole(record, "age", 31)? as u8,
        af0_s: both("af0", 1.954e-3)?,
        af1_sps: both("af1", 9.32e-10)?,
        tgd_s: later_s,
        vector: Some(vector),
        ..Ephemeris::blank(record.sv, toe)
    })
}

/// An ephemeris of an augmentation system (RTCA DO-229D, A.4.4.11; RINEX 3.05, table A16), whose epoch is the
/// reference time. Flags of health, which type 9 does not have, are left alone.
fn sbas(record: &Record) -> Result<Ephemeris, String> {
    let both = |name, most: f64| field(record, name, -most, most);
    let three = |names: [&'static str; 3], [most, across]: [f64; 2]| -> Result<Vector3<f64>, String> {
        let [x, y, z] = names;
        Ok(Vector3::new(both(x, most)?, both(y, most)?, both(z, across)?) * 1000.0)
    };
    let toe = record.toc;
    let late_s = field(record, "t_tm", 0.0, WEEK_S as f64)? - toe.tow_s();
    let late_s = late_s - (late_s / WEEK_S as f64).round() * WEEK_S as f64;
    let vector = StateVector {
        position_m: three(["x", "y", "z"], [42_950.0, 6_711.0])?,
        velocity_mps: three(["vx", "vy", "vz"], [0.040_96, 0.524_3])?,
        acceleration_mps2: three(["ax", "ay", "az"], [6.4e-6, 3.2e-5])?,
    };
    let step = step_of_day(toe) as u16;
    Ok(Ephemeris {
        form: &SBAS_SETS,
        transmitted: toe.plus_s(late_s),
        iode: step,
        iodc: step,
        aodo: whole(record, "iodn", 255)? as u8,
        ura_index: ura_index(optional_accuracy(record)?),
        af0_s: both("af0", 9.54e-7)?,
        af1_sps: both("af1", 1.165e-10)?,
        vector: Some(vector),
        ..Ephemeris::blank(record.sv, toe)
    })
}

/// The rest of a NavIC ephemeris (IRNSS SIS ICD for SPS 1.1, subframes 1 and 2). Health is a bit each of S
/// and L5.
fn navic(record: &Record, common: Ephemeris) -> Result<Ephemeris, String> {
    let both = |name, most: f64| field(record, name, -most, most);
    let issue = whole(record, "iode", 255)? as u16;
    if common.toe != common.toc {
        return Err(format!("toe = {}: expected the record's epoch, {}", common.toe, common.toc));
    }
    Ok(Ephemeris {
        transmitted: transmitted(record, common.toe, common.toe),
        iode: issue,
        iodc: issue,
        ura_index: ura_index(optional_accuracy(record)?),
        health: whole(record, "health", 3)? as u16,
        sqrt_a_sqrtm: field(record, "sqrta", 6450.0, 6540.0)?,
        eccentricity: field(record, "e", 0.0, 0.1)?,
        af0_s: both("af0", 9.766e-4)?,
        af1_sps: both("af1", 3.726e-9)?,
        af2_sps2: both("af2", 3.553e-15)?,
        tgd_s: both("tgd", 5.961e-8)?,
        ..common
    })
}

/// The rest of an LNAV ephemeris (IS-GPS-200N, tables 20-I and 20-III), of QZSS too.
fn gps(record: &Record, common: Ephemeris) -> Result<Ephemeris, String> {
    let both = |name, most: f64| field(record, name, -most, most);
    let optional = |name, most| if record.get(name).is_some() { whole(record, name, most).map(Some) } else { Ok(None) };
    let iode = whole(record, "iode", 255)?;
    let is_qzss = record.sv.system == System::Qzss;
    let sqrt_a_sqrtm = if is_qzss { 6450.0..=6540.0 } else { 5000.0..=5300.0 };
    Ok(Ephemeris {
        form: &LNAV_SETS,
        // Ephemerides go on the air two hours before their reference time, those of QZSS one.
        transmitted: transmitted(record, common.toe, common.toe.plus_s(if is_qzss { -3600.0 } else { -7200.0 })),
        iode: iode as u16,
        iodc: optional("iodc", 1023)?.unwrap_or(iode) as u16,
        ura_index: ura_index(optional_accuracy(record)?),
        health: whole(record, "health", 63)? as u16,
        l2_codes: optional("l2Codes", 3)?.unwrap_or(0) as u8,
        l2_p_data_off: optional("l2p", 1)? == Some(1),
        // Hours or the flag itself, as the file's producer meant it; blank is the usual four hours.
        long_fit: record.get("fitInt").is_some_and(|fit| fit == 1.0 || fit > 4.0),
        sqrt_a_sqrtm: field(record, "sqrta", *sqrt_a_sqrtm.start(), *sqrt_a_sqrtm.end())?,
        eccentricity: field(record, "e", 0.0, 0.1)?,
        af0_s: both("af0", 9.766e-4)?,
        af1_sps: both("af1", 3.726e-9)?,
        af2_sps2: both("af2", 3.553e-15)?,
        tgd_s: both("tgd", 5.961e-8)?,
        ..common
    })
}

/// The rest of an I/NAV or F/NAV ephemeris (Galileo OS SIS ICD 2.1, tables 57, 62, 64 and 90).
fn galileo(record: &Record, common: Ephemeris) -> Result<Ephemeris, String> {
    let both = |name, most: f64| field(record, name, -most, most);
    let issue = whole(record, "iode", 1023)? as u16;
    let health = whole(record, "health", 511)?;
    Ok(Ephemeris {
        form: if record.is_fnav { &FNAV_SETS } else { &INAV_SETS },
        transmitted: transmitted(record, common.toe, common.toe),
        iode: issue,
        iodc: issue,
        ura_index: sisa_index(record.get("accuracy").filter(|metres| *metres >= 0.0)),
        health: status_of_record(health as u16),
        sqrt_a_sqrtm: field(record, "sqrta", 5200.0, 5500.0)?,
        // Two satellites were left on orbits of 0.16.
        eccentricity: field(record, "e", 0.0, 0.2)?,
        af0_s: both("af0", 6.2501e-2)?,
        af1_sps: both("af1", 1.4902e-8)?,
        af2_sps2: both("af2", 5.552e-17)?,
        // Records of F/NAV may leave it blank, as that message does.
        tgd_s: if record.is_fnav && record.get("bgdE5bE1").is_none() { 0.0 } else { both("bgdE5bE1", 1.1921e-7)? },
        tgd2_s: both("bgdE5aE1", 1.1921e-7)?,
        ..common
    })
}

/// Metres of accuracy, where they are given; a negative one states nothing.
fn optional_accuracy(record: &Record) -> Result<Option<f64>, String> {
    if record.get("accuracy").is_some() { field(record, "accuracy", 0.0, 1e6).map(Some) } else { Ok(None) }
}

/// The instant nearest to `anchor` with that time of week.
fn near(anchor: Epoch, tow_s: f64) -> Epoch {
    let week_s = WEEK_S as f64;
    let start = Epoch::new(anchor.week() * WEEK_S, 0.0);
    let ahead_s = tow_s - anchor.tow_s();
    start.plus_s(tow_s - (ahead_s / week_s).round() * week_s)
}

/// Time of transmission, or an assumed one where the file leaves it out or fills it.
fn transmitted(record: &Record, toe: Epoch, assumed: Epoch) -> Epoch {
    match record.get("t_tm") {
        Some(tow_s) if tow_s.abs() <= 2.0 * WEEK_S as f64 => {
            let said = near(toe, tow_s.rem_euclid(WEEK_S as f64));
            if said.since(toe).abs() <= 86_400.0 { said } else { assumed }
        }
        _ => assumed,
    }
}

/// The index whose interval holds an accuracy in metres (IS-GPS-200N, 20.3.3.3.1.3); blank is 15, no
/// prediction.
fn ura_index(accuracy_m: Option<f64>) -> u8 {
    const UPPER_M: [f64; 15] =
        [2.4, 3.4, 4.85, 6.85, 9.65, 13.65, 24.0, 48.0, 96.0, 192.0, 384.0, 768.0, 1536.0, 3072.0, 6144.0];
    let Some(accuracy_m) = accuracy_m else { return 15 };
    UPPER_M.iter().take_while(|upper| accuracy_m > **upper).count() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_week_wrap_to_the_nearest_week() {
        let anchor = Epoch::from_week(1590, 604_000.0);
        assert_eq!(near(anchor, 0.0), Epoch::from_week(1591, 0.0));
        assert_eq!(near(anchor, 604_784.0), Epoch::from_week(1590, 604_784.0));
        assert_eq!(near(Epoch::from_week(1591, 16.0), 604_784.0), Epoch::from_week(1590, 604_784.0));
    }

    #[test]
    fn accuracies_become_the_index_of_their_interval() {
        let cases = [(0.0, 0), (2.0, 0), (2.8, 1), (4.0, 2), (16.0, 6), (4096.0, 14), (8192.0, 15)];
        for (metres, index) in cases {
            assert_eq!(ura_index(Some(metres)), index);
        }
        assert_eq!(ura_index(None), 15);
    }
}
