//! NMEA 0183 sentences as a source of motion: GGA has place and height, RMC place, speed and course.
//!
//! Times are UTC of a day that nobody names: the day is the one nearest to a time that is known, and the date
//! of RMC is passed over, so that a rig of today drives a scene of any year.

use nalgebra::Vector3;

use super::{Epoch, Fault, Row};
use gnss::earth::Geodetic;

/// One knot.
const KNOT_MPS: f64 = 1852.0 / 3600.0;
const DAY_S: f64 = 86_400.0;

/// What an RMC sentence says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rmc {
    /// Seconds since the scene's start.
    pub t_s: f64,
    /// Degrees, north positive.
    pub latitude_deg: f64,
    /// Degrees, east positive.
    pub longitude_deg: f64,
    /// Over ground, to the east and to the north.
    pub velocity_mps: [f64; 2],
}

/// One GGA sentence (NMEA 0183, 6.3.29): checksum, UTC time of day, place and height above the ellipsoid.
/// `None` of one without a fix. The day is the one nearest to `before_s`, or to the scene's start.
///
/// # Errors
/// [`Fault::Sentence`].
pub fn gga(text: &str, start: Epoch, before_s: Option<f64>) -> Result<Option<Row>, Fault> {
    let fail = |reason| Fault::Sentence { sentence: text.to_owned(), reason };
    let fields = fields(text)?;
    let [_, time, latitude, north, longitude, east, quality, _, _, height, _, geoid, ..] = fields.as_slice() else {
        return Err(fail("expected at least 12 fields"));
    };
    if *quality == "0" {
        return Ok(None);
    }
    let t_s = elapsed_s(time, start, before_s).ok_or_else(|| fail("the time is not hhmmss"))?;
    let (latitude, longitude) =
        place([latitude, north], [longitude, east]).ok_or_else(|| fail("the position is not ddmm.mm,N,dddmm.mm,E"))?;
    let height_m = read(height).ok_or_else(|| fail("no height"))?;
    let geoid_m = read(geoid).ok_or_else(|| fail("no geoid separation: the height above the ellipsoid is unknown"))?;
    let position_m = Geodetic::from_degrees(latitude, longitude, height_m + geoid_m).to_ecef();
    Ok(Some(Row { t_s, position_m, velocity_mps: None }))
}

/// One RMC sentence; `None` of one that warns of itself. A course is needed where there is speed.
///
/// # Errors
/// [`Fault::Sentence`].
pub fn rmc(text: &str, start: Epoch, before_s: Option<f64>) -> Result<Option<Rmc>, Fault> {
    let fail = |reason| Fault::Sentence { sentence: text.to_owned(), reason };
    let fields = fields(text)?;
    let [_, time, status, latitude, north, longitude, east, speed, course, ..] = fields.as_slice() else {
        return Err(fail("expected at least 9 fields"));
    };
    if *status != "A" {
        return Ok(None);
    }
    let t_s = elapsed_s(time, start, before_s).ok_or_else(|| fail("the time is not hhmmss"))?;
    let (latitude_deg, longitude_deg) =
        place([latitude, north], [longitude, east]).ok_or_else(|| fail("the position is not ddmm.mm,N,dddmm.mm,E"))?;
    let speed_mps = KNOT_MPS * read(speed).filter(|x| *x >= 0.0).ok_or_else(|| fail("no speed in knots"))?;
    let course_deg = match read(course) {
        Some(course) => course,
        None if speed_mps == 0.0 || course.is_empty() && speed_mps < KNOT_MPS => 0.0,
        None => return Err(fail("a speed without a course")),
    };
    let (sin, cos) = libm::sincos(course_deg.to_radians());
    Ok(Some(Rmc { t_s, latitude_deg, longitude_deg, velocity_mps: [speed_mps * sin, speed_mps * cos] }))
}

/// The fields of a sentence whose checksum holds.
fn fields(text: &str) -> Result<Vec<&str>, Fault> {
    let fail = |reason| Fault::Sentence { sentence: text.to_owned(), reason };
    let (body, sum) = text.strip_prefix('$').and_then(|t| t.split_once('*')).ok_or_else(|| fail("no checksum"))?;
    let sum = u8::from_str_radix(sum.trim(), 16).map_err(|_| fail("the checksum is not two hexadecimal digits"))?;
    if body.bytes().fold(0, |x, b| x ^ b) != sum {
        return Err(fail("the checksum is wrong"));
    }
    Ok(body.split(',').collect())
}

fn read(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|x| x.is_finite())
}

/// Latitude and longitude in degrees, of `ddmm.mm,N` and `dddmm.mm,E`.
fn place([latitude, north]: [&str; 2], [longitude, east]: [&str; 2]) -> Option<(f64, f64)> {
    let angle = |text: &str, digits: usize, sign: &str, signs: [&str; 2]| {
        let size = read(text.get(..digits)?)? + read(text.get(digits..)?)? / 60.0;
        signs.iter().position(|s| *s == sign).map(|i| if i == 0 { size } else { -size })
    };
    let latitude = angle(latitude, 2, north, ["N", "S"]).filter(|x| x.abs() <= 90.0);
    latitude.zip(angle(longitude, 3, east, ["E", "W"]).filter(|x| x.abs() <= 180.0))
}

/// Seconds since the scene's start of a time of day: of the day nearest to the row before, or to that start.
fn elapsed_s(text: &str, start: Epoch, before_s: Option<f64>) -> Option<f64> {
    let utc_start_s = (start.seconds() - start.leap_seconds()).rem_euclid(86_400) as f64 + start.fraction();
    let t_s = time_of_day_s(text)? - utc_start_s;
    Some(t_s + DAY_S * ((before_s.unwrap_or(0.0) - t_s) / DAY_S).round())
}

/// Seconds of the day of `hhmmss.ss`.
fn time_of_day_s(text: &str) -> Option<f64> {
    let hours: u32 = text.get(..2)?.parse().ok().filter(|h| *h < 24)?;
    let minutes: u32 = text.get(2..4)?.parse().ok().filter(|m| *m < 60)?;
    let seconds: f64 = text.get(4..)?.parse().ok().filter(|s| (0.0..61.0).contains(s))?;
    Some(f64::from(hours * 3600 + minutes * 60) + seconds)
}

/// A velocity over ground in ECEF, with what the height gains.
pub fn rising(rmc: &Rmc, height_m: f64, up_mps: f64) -> (Vector3<f64>, Vector3<f64>) {
    let place = Geodetic::from_degrees(rmc.latitude_deg, rmc.longitude_deg, height_m);
    let [east, north] = rmc.velocity_mps;
    (place.to_ecef(), place.ecef_to_enu().transpose() * Vector3::new(east, north, up_mps))
}
