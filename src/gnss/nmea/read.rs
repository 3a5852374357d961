//! Parser of NMEA 0183 sentences: GGA, RMC, VTG and ZDA of any talker.
//!
//! Source: NMEA 0183, version 4.11; fields may be empty, and the checksum of versions before 2.0 is optional.
//! A sentence without a checksum is taken where all its fields are there, since one that was cut off has
//! fewer; a wrong checksum is an error. Limits: one sentence a `$`; encapsulated (`!`) and proprietary (`$P`)
//! sentences are not read.

use nalgebra::Vector3;
use thiserror::Error;

use super::KNOT_MPS;
use crate::earth::Geodetic;
use crate::geoid::separation_m;

/// Fields of whole sentences (version 2.0), the address among them.
const GGA_FIELDS: usize = 15;
const RMC_FIELDS: usize = 12;
const VTG_FIELDS: usize = 9;
const ZDA_FIELDS: usize = 7;

/// Error in a sentence.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SentenceError {
    /// Bytes that are not ASCII.
    #[error("not ASCII text")]
    NotText,
    /// A checksum that is not the exclusive or of the characters between `$` and `*`.
    #[error("the checksum is wrong: '{found}', expected {expected:02X}")]
    Checksum {
        /// Text after the `*`.
        found: String,
        /// Checksum of the characters.
        expected: u8,
    },
    /// Less than the sentence has.
    #[error("{have} fields: expected at least {need} of {kind}{}", if *.checked { "" } else { " without a checksum" })]
    Short {
        /// Fields of the sentence, its address among them.
        have: usize,
        /// Fields that are needed.
        need: usize,
        /// Three letters, as GGA.
        kind: String,
        /// True if the sentence has a valid checksum.
        checked: bool,
    },
    /// A field that does not have its form.
    #[error("{what} '{text}': expected {expected}")]
    Field {
        /// Meaning of the field.
        what: &'static str,
        /// Text of the field.
        text: String,
        /// Values that the field may have.
        expected: &'static str,
    },
}

type Read<T> = Result<T, SentenceError>;

fn field<T>(found: Option<T>, what: &'static str, text: &str, expected: &'static str) -> Read<T> {
    found.ok_or_else(|| SentenceError::Field { what, text: text.chars().take(40).collect(), expected })
}

/// Splits a line into sentences, each from its `$`. Text before the first one belongs to another protocol or
/// to a logger. A sentence that another one interrupts has no checksum and is dropped.
pub fn sentences(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let next = |from: usize| line.iter().skip(from).position(|byte| *byte == b'$').map(|at| from + at);
    std::iter::successors(next(0), move |from| next(from + 1)).filter_map(move |from| {
        let text = line.get(from..next(from + 1).unwrap_or(line.len()))?;
        (next(from + 1).is_none() || text.contains(&b'*')).then_some(text)
    })
}

/// Sentence with a correct checksum, or without a checksum.
#[derive(Clone, Debug, PartialEq)]
pub struct Sentence<'t> {
    /// Talker identifier, such as `GN`.
    pub talker: &'t str,
    /// Sentence type, such as `GGA`.
    pub kind: &'t str,
    /// True if the sentence has a checksum.
    pub checked: bool,
    fields: Vec<&'t str>,
}

/// Fix of a GGA sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Gga<'t> {
    /// UTC time of day, `hhmmss.ss` as written.
    pub time: &'t str,
    /// Latitude, degrees, north positive.
    pub latitude_deg: f64,
    /// Longitude, degrees, east positive.
    pub longitude_deg: f64,
    /// Altitude above mean sea level, in metres.
    pub altitude_m: f64,
    /// Separation of geoid and ellipsoid in metres, if the sentence has it.
    pub separation_m: Option<f64>,
    /// Number of satellites used; 0 if the field is empty.
    pub satellites: u32,
    /// Number of digits after the point in the minutes of latitude.
    pub decimals: u32,
}

impl Gga<'_> {
    /// The position in ECEF, metres: altitude and separation make the height above the ellipsoid. EGM96 gives
    /// a separation that is missing, since the altitude is one above the sea.
    pub fn position_m(&self) -> Vector3<f64> {
        let [latitude_rad, longitude_rad] = [self.latitude_deg, self.longitude_deg].map(f64::to_radians);
        let separation_m = self.separation_m.unwrap_or_else(|| separation_m(latitude_rad, longitude_rad));
        Geodetic::from_degrees(self.latitude_deg, self.longitude_deg, self.altitude_m + separation_m).to_ecef()
    }
}

/// Content of an RMC sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Rmc<'t> {
    /// UTC time of day, `hhmmss.ss` as written.
    pub time: &'t str,
    /// True if the status is A; V is the receiver's warning.
    pub valid: bool,
    /// Year, month and day, if the sentence has the date.
    pub date: Option<[u32; 3]>,
    /// Latitude and longitude in degrees, if the status is A.
    pub place_deg: Option<[f64; 2]>,
    /// Speed over ground, m/s.
    pub speed_mps: Option<f64>,
    /// Course from north over east, in radians.
    pub course_rad: Option<f64>,
}

impl<'t> Sentence<'t> {
    /// Splits a sentence that begins with `$` and is of one of these kinds. Returns `None` for other kinds,
    /// whose checksum is not tested. Text after the checksum is ignored.
    ///
    /// # Errors
    /// [`SentenceError`]: a wrong checksum, bytes that are not ASCII.
    pub fn of(kinds: &[&str], bytes: &'t [u8]) -> Read<Option<Self>> {
        let kind = bytes.get(3..6).unwrap_or_default();
        let is_address = bytes.first() == Some(&b'$') && bytes.get(1) != Some(&b'P');
        if !is_address || !kinds.iter().any(|known| known.as_bytes() == kind) {
            return Ok(None);
        }
        let end = bytes.iter().position(|byte| *byte == b'*');
        let text = bytes.get(1..end.unwrap_or(bytes.len())).unwrap_or_default();
        if let Some(end) = end {
            let sum = bytes.get(end + 1..bytes.len().min(end + 3)).unwrap_or_default();
            let expected = text.iter().fold(0, |sum, byte| sum ^ byte);
            if !sum.eq_ignore_ascii_case(format!("{expected:02X}").as_bytes()) {
                return Err(SentenceError::Checksum {
                    found: String::from_utf8_lossy(sum).trim().to_owned(),
                    expected,
                });
            }
        }
        let text = std::str::from_utf8(text).ok().filter(|text| text.is_ascii()).ok_or(SentenceError::NotText)?;
        let fields = text.trim_end().split(',').map(str::trim).collect();
        let part = |from, to| text.get(from..to).unwrap_or_default();
        Ok(Some(Self { talker: part(0, 2), kind: part(2, 5), checked: end.is_some(), fields }))
    }

    /// A field by its number in the standard, the address being 0; empty where it is not there.
    fn get(&self, index: usize) -> &'t str {
        self.fields.get(index).copied().unwrap_or_default()
    }

    /// Checks the number of fields: at least `least` with a checksum, `all` without one.
    fn long_enough(&self, least: usize, all: usize) -> Read<()> {
        let (have, need) = (self.fields.len(), if self.checked { least } else { all });
        let short = || SentenceError::Short { have, need, kind: self.kind.to_owned(), checked: self.checked };
        if have < need { Err(short()) } else { Ok(()) }
    }

    /// The fix of a GGA sentence; `None` where it states that there is none.
    ///
    /// # Errors
    /// [`SentenceError`]: too few fields, one that has not its form.
    pub fn gga(&self) -> Read<Option<Gga<'t>>> {
        self.long_enough(12, GGA_FIELDS)?;
        if ["", "0"].contains(&self.get(6)) {
            return Ok(None);
        }
        let [latitude_deg, longitude_deg] = self.place([2, 3, 4, 5])?;
        let altitude_m = field(number(self.get(9)), "height", self.get(9), "a number")?;
        let separation_m = match self.get(11) {
            "" => None,
            text => Some(field(number(text), "geoid separation", text, "a number or nothing")?),
        };
        let decimals = self.get(2).split_once('.').map_or(0, |(_, rest)| rest.len()) as u32;
        let satellites = self.get(7).parse().unwrap_or(0);
        let time = time(self.get(1))?;
        Ok(Some(Gga { time, latitude_deg, longitude_deg, altitude_m, separation_m, satellites, decimals }))
    }

    /// Returns the content of an RMC sentence, or `None` if it has no time.
    ///
    /// # Errors
    /// [`SentenceError`]: too few fields, one that has not its form.
    pub fn rmc(&self) -> Read<Option<Rmc<'t>>> {
        self.long_enough(9, RMC_FIELDS)?;
        if self.get(1).is_empty() {
            return Ok(None);
        }
        let valid = self.get(2) == "A";
        let date = match self.get(9) {
            "" => None,
            text => Some(field(ddmmyy(text), "date", text, "ddmmyy")?),
        };
        let (speed_mps, course_rad) = self.over_ground(7, 8)?;
        let place_deg = if valid { Some(self.place([3, 4, 5, 6])?) } else { None };
        Ok(Some(Rmc { time: time(self.get(1))?, valid, date, place_deg, speed_mps, course_rad }))
    }

    /// Reads speed over ground in m/s and course from north over east in radians from a VTG sentence, if it
    /// has them.
    ///
    /// # Errors
    /// [`SentenceError`]: too few fields, one that has not its form.
    pub fn vtg(&self) -> Read<Option<(f64, f64)>> {
        self.long_enough(6, VTG_FIELDS)?;
        let (speed_mps, course_rad) = self.over_ground(5, 1)?;
        Ok(speed_mps.zip(course_rad))
    }

    /// Reads time of day, `hhmmss.ss` as written, and year, month and day from a ZDA sentence, if it has
    /// them.
    ///
    /// # Errors
    /// [`SentenceError`]: too few fields, one that has not its form.
    pub fn zda(&self) -> Read<Option<(&'t str, [u32; 3])>> {
        self.long_enough(5, ZDA_FIELDS)?;
        let [day, month, year] = [2, 3, 4].map(|index| self.get(index));
        if [self.get(1), day, month, year].contains(&"") {
            return Ok(None);
        }
        let digits = [(year, 4), (month, 2), (day, 2)].map(|(text, count)| whole(text, count));
        let date = match digits {
            [Some(year), Some(month), Some(day)] => Some([year, month, day]),
            _ => None,
        };
        Ok(Some((time(self.get(1))?, field(date, "date", &format!("{day},{month},{year}"), "dd,mm,yyyy")?)))
    }

    /// Speed in knots and course in degrees by their fields, in m/s and radians.
    fn over_ground(&self, speed: usize, course: usize) -> Read<(Option<f64>, Option<f64>)> {
        let read = |index: usize, what, expected| match self.get(index) {
            "" => Ok(None),
            text => field(number(text), what, text, expected).map(Some),
        };
        let knots = read(speed, "speed", "knots")?;
        field(knots.is_none_or(|knots| knots >= 0.0).then_some(()), "speed", self.get(speed), "knots, not negative")?;
        Ok((knots.map(|knots| knots * KNOT_MPS), read(course, "course", "degrees")?.map(f64::to_radians)))
    }

    /// Latitude and longitude in degrees by the fields of `ddmm.mm`, `N`, `dddmm.mm`, `E`.
    fn place(&self, indices: [usize; 4]) -> Read<[f64; 2]> {
        let [latitude, north, longitude, east] = indices.map(|index| self.get(index));
        let angle = |text: &str, digits: usize, sign: &str, signs: [&str; 2], most: f64| {
            let degrees = f64::from(whole(text.get(..digits)?, digits)?);
            let minutes = number(text.get(digits..)?).filter(|minutes| (0.0..60.0).contains(minutes))?;
            let size = degrees + minutes / 60.0;
            let signed = signs.iter().position(|s| *s == sign).map(|i| if i == 0 { size } else { -size })?;
            (signed.abs() <= most).then_some(signed)
        };
        let bad = |text: &str, sign: &str| format!("{text},{sign}");
        let latitude_deg = angle(latitude, 2, north, ["N", "S"], 90.0);
        let longitude_deg = angle(longitude, 3, east, ["E", "W"], 180.0);
        Ok([
            field(latitude_deg, "latitude", &bad(latitude, north), "ddmm.mm and N or S")?,
            field(longitude_deg, "longitude", &bad(longitude, east), "dddmm.mm and E or W")?,
        ])
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}

/// A number of exactly so many digits.
fn whole(text: &str, digits: usize) -> Option<u32> {
    (text.len() == digits && text.bytes().all(|byte| byte.is_ascii_digit())).then(|| text.parse().ok()).flatten()
}

/// Year, month and day; GPS began in 1980.
fn ddmmyy(text: &str) -> Option<[u32; 3]> {
    let part = |from: usize, to: usize| whole(text.get(from..to)?, to - from);
    let (day, month, year) = (part(0, 2)?, part(2, 4)?, part(4, text.len()).filter(|_| text.len() == 6)?);
    Some([year + if year >= 80 { 1900 } else { 2000 }, month, day])
}

/// Checks `hhmmss` or `hhmmss.ss`; the sixtieth second is an inserted one.
fn time(text: &str) -> Read<&str> {
    field(time_of_day_s(text).map(|_| text), "time", text, "hhmmss.ss of UTC")
}

/// Seconds of the day of `hhmmss` or `hhmmss.ss`.
pub fn time_of_day_s(text: &str) -> Option<f64> {
    let part = |from: usize, most: u32| whole(text.get(from..from + 2)?, 2).filter(|value| *value < most);
    let (hours, minutes) = (part(0, 24)?, part(2, 60)?);
    part(4, 61)?;
    let seconds = number(text.get(4..)?).filter(|seconds| (0.0..61.0).contains(seconds))?;
    Some(f64::from(hours * 3600 + minutes * 60) + seconds)
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;
