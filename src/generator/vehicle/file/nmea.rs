//! NMEA 0183 sentences as a source of motion: GGA has position and height, RMC position, speed and course.
//!
//! Times are UTC of a day that nobody names: the day is the one nearest to a time that is known, and the date
//! of RMC is passed over, so that a rig of today drives a scene of any year. Altitudes are above mean sea
//! level: where a sentence lacks its geoid separation, EGM96's is added.

use nalgebra::Vector3;

use super::{Epoch, Fault, Row};
use gnss::earth::Geodetic;
use gnss::nmea::KNOT_MPS;
use gnss::nmea::read::{Sentence, SentenceError, time_of_day_s};

const DAY_S: f64 = 86_400.0;

/// Content of an RMC sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rmc {
    /// Seconds since the scene's start.
    pub t_s: f64,
    /// Degrees, north positive.
    pub latitude_deg: f64,
    /// Degrees, east positive.
    pub longitude_deg: f64,
    /// Velocity over ground to the east and to the north, in m/s.
    pub velocity_mps: [f64; 2],
}

/// A fix of a GGA sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Gga {
    /// Time and position.
    pub row: Row,
    /// Talker identifier, such as `GN`.
    pub talker: String,
    /// True if the sentence lacks a geoid separation, so that EGM96's was used.
    pub separation_assumed: bool,
}

/// Reads one GGA sentence: UTC time of day, position and height above the ellipsoid. `None` of one without a
/// fix, and of another kind. The day is the one nearest to `before_s`, or to the scene's start.
///
/// # Errors
/// [`Fault::Sentence`].
pub fn gga(text: &str, start: Epoch, before_s: Option<f64>) -> Result<Option<Gga>, Fault> {
    let fail = |error: SentenceError| refused(text, error.to_string());
    let Some(sentence) = Sentence::of(&["GGA"], text.as_bytes()).map_err(fail)? else { return Ok(None) };
    let Some(found) = sentence.gga().map_err(fail)? else { return Ok(None) };
    let t_s = elapsed_s(found.time, start, before_s);
    Ok(Some(Gga {
        row: Row { t_s, position_m: found.position_m(), velocity_mps: None },
        talker: sentence.talker.to_owned(),
        separation_assumed: found.separation_m.is_none(),
    }))
}

/// Reads one RMC sentence; `None` of one that warns of itself. A course is needed where there is speed.
///
/// # Errors
/// [`Fault::Sentence`].
pub fn rmc(text: &str, start: Epoch, before_s: Option<f64>) -> Result<Option<Rmc>, Fault> {
    let fail = |error: SentenceError| refused(text, error.to_string());
    let Some(sentence) = Sentence::of(&["RMC"], text.as_bytes()).map_err(fail)? else { return Ok(None) };
    let Some(found) = sentence.rmc().map_err(fail)?.filter(|found| found.valid) else { return Ok(None) };
    let Some([latitude_deg, longitude_deg]) = found.place_deg else { return Ok(None) };
    let speed_mps = found.speed_mps.ok_or_else(|| refused(text, "no speed in knots".to_owned()))?;
    // A receiver at rest leaves the course empty.
    let at_rest = (speed_mps < KNOT_MPS).then_some(0.0);
    let course_rad = found.course_rad.or(at_rest);
    let course_rad = course_rad.ok_or_else(|| refused(text, "a speed without a course".to_owned()))?;
    let (sin, cos) = libm::sincos(course_rad);
    let t_s = elapsed_s(found.time, start, before_s);
    Ok(Some(Rmc { t_s, latitude_deg, longitude_deg, velocity_mps: [speed_mps * sin, speed_mps * cos] }))
}

fn refused(text: &str, reason: String) -> Fault {
    Fault::Sentence { sentence: text.to_owned(), reason }
}

/// Seconds since the scene's start of a time of day: of the day nearest to the row before, or to that start.
fn elapsed_s(time: &str, start: Epoch, before_s: Option<f64>) -> f64 {
    let utc_start_s = (start.seconds() - start.leap_seconds()).rem_euclid(86_400) as f64 + start.fraction();
    let t_s = time_of_day_s(time).unwrap_or(f64::NAN) - utc_start_s;
    t_s + DAY_S * ((before_s.unwrap_or(0.0) - t_s) / DAY_S).round()
}

/// Position in metres and velocity in m/s in ECEF, from a velocity over ground and a rate of the height.
pub fn rising(rmc: &Rmc, height_m: f64, up_mps: f64) -> (Vector3<f64>, Vector3<f64>) {
    let place = Geodetic::from_degrees(rmc.latitude_deg, rmc.longitude_deg, height_m);
    let [east, north] = rmc.velocity_mps;
    (place.to_ecef(), place.ecef_to_enu().transpose() * Vector3::new(east, north, up_mps))
}
