//! NMEA 0183 position files: GGA for the place, RMC for date and velocity.
//!
//! Source: NMEA 0183, 6.3 (GGA, RMC); heights become ellipsoidal by the sentence's own geoid separation. A
//! time of day has the date of the RMC before or after it that has the same time; without any RMC the
//! caller's day is taken. UTC becomes GPS time by the leap seconds of that date, which is the right way even
//! for a receiver that mistook its week: it used those too. Sentences of other kinds are passed over; a wrong
//! checksum refuses the file.

use nalgebra::Vector3;

use crate::read::fault::Fault;
use gnss::earth::Geodetic;
use gnss::time::Epoch;

/// One position.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaceFix {
    /// As the receiver labels it, in GPS time.
    pub label: Epoch,
    /// Place, Earth-fixed, metres.
    pub position_m: Vector3<f64>,
    /// Satellites used.
    pub satellites: u32,
    /// Speed over ground and course from north over east, of the RMC with the same time.
    pub ground_mps_rad: Option<(f64, f64)>,
}

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// In the order of the file.
    pub fixes: Vec<PlaceFix>,
    /// Sentences that say that there is no fix.
    pub without_fix: usize,
    /// Whether the date came from RMC sentences.
    pub dated: bool,
    /// Smallest step of a latitude as written.
    pub resolution_m: f64,
}

const KNOT_MPS: f64 = 1852.0 / 3600.0;

struct Gga {
    line: u64,
    time: String,
    position_m: Vector3<f64>,
    satellites: u32,
}

struct Rmc {
    time: String,
    date: String,
    ground_mps_rad: Option<(f64, f64)>,
}

/// Reads a file; `day` (as `2010-07-01`) is the date where it names none.
///
/// # Errors
/// The first sentence that is damaged, and a file without a fix.
pub fn read(bytes: &[u8], day: &str) -> Result<Places, Fault> {
    let (mut ggas, mut rmcs) = (Vec::new(), Vec::new());
    let mut found = Places { resolution_m: f64::INFINITY, ..Places::default() };
    let mut last = 1;
    for (line, bytes) in (1_u64..).zip(bytes.split(|byte| *byte == b'\n')) {
        let refuse = |what: String| Fault { line, what };
        let text = std::str::from_utf8(bytes).map_err(|_| refuse("not ASCII text".to_owned()))?.trim();
        if text.is_empty() {
            continue;
        }
        last = line;
        let kind = text.get(3..6).unwrap_or("");
        if !text.starts_with('$') || !["GGA", "RMC"].contains(&kind) {
            continue;
        }
        let fields = fields(text).map_err(|reason| refuse(reason.to_owned()))?;
        if kind == "GGA" {
            match gga(&fields, line, &mut found.resolution_m).map_err(refuse)? {
                Some(row) => ggas.push(row),
                None => found.without_fix += 1,
            }
        } else if let Some(row) = rmc(&fields).map_err(refuse)? {
            rmcs.push(row);
        }
    }
    if ggas.is_empty() {
        let what = format!("no GGA sentence with a fix ({} without one)", found.without_fix);
        return Err(Fault { line: last, what });
    }
    found.dated = !rmcs.is_empty();
    found.fixes = dated(&ggas, &rmcs, day)?;
    Ok(found)
}

/// Gives every position its date, and its velocity where an RMC has the same time of day.
fn dated(ggas: &[Gga], rmcs: &[Rmc], day: &str) -> Result<Vec<PlaceFix>, Fault> {
    let mut next = 0;
    let mut date = rmcs.first().map_or(day.to_owned(), |rmc| rmc.date.clone());
    let mut fixes: Vec<PlaceFix> = Vec::new();
    for gga in ggas {
        let ahead = rmcs.get(next..).unwrap_or(&[]).iter().position(|rmc| rmc.time == gga.time);
        let rmc = ahead.and_then(|step| rmcs.get(next + step));
        if let (Some(step), Some(rmc)) = (ahead, rmc) {
            next += step + 1;
            date = rmc.date.clone();
        }
        let [hours, minutes, seconds] =
            [gga.time.get(..2), gga.time.get(2..4), gga.time.get(4..)].map(Option::unwrap_or_default);
        let label = Epoch::parse(&format!("{date}T{hours}:{minutes}:{seconds}Z"))
            .map_err(|error| Fault { line: gga.line, what: error.to_string() })?;
        if fixes.last().is_some_and(|before| label.since(before.label) <= 0.0) {
            let what = format!("time {} does not come after the one before", gga.time);
            return Err(Fault { line: gga.line, what });
        }
        fixes.push(PlaceFix {
            label,
            position_m: gga.position_m,
            satellites: gga.satellites,
            ground_mps_rad: rmc.and_then(|rmc| rmc.ground_mps_rad),
        });
    }
    Ok(fixes)
}

/// Fields of a sentence whose checksum is right; the first is its name.
fn fields(text: &str) -> Result<Vec<&str>, &'static str> {
    let (body, sum) =
        text.strip_prefix('$').and_then(|t| t.split_once('*')).ok_or("no checksum: expected *hh at the end")?;
    let sum = u8::from_str_radix(sum.trim(), 16).map_err(|_| "the checksum is not two hexadecimal digits")?;
    if body.bytes().fold(0, |x, b| x ^ b) != sum {
        return Err("the checksum is wrong");
    }
    Ok(body.split(',').collect())
}

fn number(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}

/// `hhmmss` or `hhmmss.ss`, as written.
fn time(text: &str) -> Result<String, String> {
    let digits = |part: Option<&str>| part.is_some_and(|p| p.len() == 2 && p.bytes().all(|b| b.is_ascii_digit()));
    let good = digits(text.get(..2)) && digits(text.get(2..4)) && text.get(4..).and_then(number).is_some();
    if good { Ok(text.to_owned()) } else { Err(format!("time '{text}': expected hhmmss.ss")) }
}

fn gga(fields: &[&str], line: u64, resolution_m: &mut f64) -> Result<Option<Gga>, String> {
    let [_, at, latitude, north, longitude, east, quality, satellites, _, height, _, geoid, ..] = fields else {
        return Err(format!("{} fields: expected at least 12 of GGA", fields.len()));
    };
    if quality.is_empty() || *quality == "0" {
        return Ok(None);
    }
    let angle = |text: &str, digits: usize, sign: &str, signs: [&str; 2], most: f64| {
        let degrees = number(text.get(..digits)?)?;
        let minutes = number(text.get(digits..)?).filter(|minutes| (0.0..60.0).contains(minutes))?;
        let size = degrees + minutes / 60.0;
        let signed = signs.iter().position(|s| *s == sign).map(|i| if i == 0 { size } else { -size })?;
        (signed.abs() <= most).then_some(signed)
    };
    let bad = |what: &str, text: &str, expected: &str| format!("{what} '{text}': expected {expected}");
    let latitude_deg = angle(latitude, 2, north, ["N", "S"], 90.0)
        .ok_or_else(|| bad("latitude", &format!("{latitude},{north}"), "ddmm.mm and N or S"))?;
    let longitude_deg = angle(longitude, 3, east, ["E", "W"], 180.0)
        .ok_or_else(|| bad("longitude", &format!("{longitude},{east}"), "dddmm.mm and E or W"))?;
    let height_m = number(height).ok_or_else(|| bad("height", height, "a number"))?;
    // Receivers that give heights above the ellipsoid leave the separation empty or zero.
    let geoid_m =
        if geoid.is_empty() { 0.0 } else { number(geoid).ok_or_else(|| bad("geoid separation", geoid, "a number"))? };
    let decimals = latitude.split_once('.').map_or(0, |(_, rest)| rest.len()) as i32;
    // A minute of latitude is a nautical mile.
    *resolution_m = resolution_m.min(1852.0 * libm::pow(10.0, -f64::from(decimals)));
    Ok(Some(Gga {
        line,
        time: time(at)?,
        position_m: Geodetic::from_degrees(latitude_deg, longitude_deg, height_m + geoid_m).to_ecef(),
        satellites: satellites.parse().unwrap_or(0),
    }))
}

fn rmc(fields: &[&str]) -> Result<Option<Rmc>, String> {
    let [_, at, status, _, _, _, _, speed, course, date, ..] = fields else {
        return Err(format!("{} fields: expected at least 10 of RMC", fields.len()));
    };
    if *status != "A" {
        return Ok(None);
    }
    let [day, month, year] = [date.get(..2), date.get(2..4), date.get(4..6)].map(Option::unwrap_or_default);
    let year: u32 = year.parse().map_err(|_| format!("date '{date}': expected ddmmyy"))?;
    // GPS began in 1980.
    let century = if year >= 80 { 1900 } else { 2000 };
    let ground = number(speed).zip(number(course));
    Ok(Some(Rmc {
        time: time(at)?,
        date: format!("{}-{month}-{day}", century + year),
        ground_mps_rad: ground.map(|(knots, degrees)| (knots * KNOT_MPS, degrees.to_radians())),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GGA: &str = "$GPGGA,080626.00,2630.7379654,N,08013.9740786,E,1,05,1.0,128.703,M,0.000,M,0.0,*70";
    const RMC: &str = "$GPRMC,080626.00,A,2630.7379654,N,08013.9740786,E,0.06,0.00,140230,0.0,E,A*3E";

    fn with_sum(body: &str) -> String {
        format!("${body}*{:02X}", body.bytes().fold(0, |x, b| x ^ b))
    }

    #[test]
    fn sentences_of_a_real_receiver_become_a_place_a_velocity_and_a_time() {
        let found = read(format!("{RMC}\r\n{GGA}\r\n").as_bytes(), "2010-07-01").unwrap();
        let fix = &found.fixes[0];
        let place = Geodetic::from_ecef(&fix.position_m);
        assert!((place.latitude_rad.to_degrees() - (26.0 + 30.737_965_4 / 60.0)).abs() < 1e-12);
        assert!((place.height_m - 128.703).abs() < 1e-8);
        // 2030-02-14 by its own date: 18 leap seconds, the last that are known.
        assert_eq!(fix.label, Epoch::parse("2030-02-14T08:06:44").unwrap());
        assert!((fix.ground_mps_rad.unwrap().0 - 0.06 * 0.514_444_4).abs() < 1e-6);
        assert!(found.dated && (found.resolution_m - 1852e-7).abs() < 1e-12);
    }

    #[test]
    fn without_a_date_the_given_day_is_taken() {
        let found = read(GGA.as_bytes(), "2010-07-01").unwrap();
        assert_eq!(found.fixes[0].label, Epoch::parse("2010-07-01T08:06:41").unwrap());
        assert!(!found.dated);
    }

    #[test]
    fn each_damage_is_refused_at_its_line() {
        let broken = |from: &str, to: &str| {
            let body = GGA.trim_start_matches('$').split('*').next().unwrap().replace(from, to);
            format!("{RMC}\n{}\n", with_sum(&body))
        };
        let cases = [
            (GGA.replace("*70", "*71"), 1, "checksum is wrong"),
            (GGA.replace("*70", ""), 1, "no checksum"),
            (broken("2630.73", "2690.73"), 2, "latitude '2690.7379654,N'"),
            (broken(",E,1", ",Q,1"), 2, "longitude"),
            (broken("128.703", "x"), 2, "height 'x'"),
            (broken("080626.00", "250626.00"), 2, "25:06:26"),
            (broken("080626.00", "8:06"), 2, "time '8:06'"),
            (broken(",E,1,", ",E,0,"), 2, "no GGA sentence with a fix (1 without one)"),
            (format!("{GGA}\n{GGA}\n"), 2, "does not come after"),
            (String::new(), 1, "no GGA sentence"),
        ];
        for (text, line, words) in cases {
            let fault = read(text.as_bytes(), "2010-07-01").unwrap_err();
            assert_eq!(fault.line, line, "{text}: {}", fault.what);
            assert!(fault.what.contains(words), "{text}: {}", fault.what);
        }
        assert!(read(&[b'$', 0xff, b'\n'], "2010-07-01").is_err());
    }
}
