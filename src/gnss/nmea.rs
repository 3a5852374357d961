//! NMEA 0183 sentences: position, time, satellites.
//!
//! Source: NMEA 0183, version 4.11 (GGA, RMC, VTG, ZDA, GSA with the system's number, GSV with the signal's).
//! Times are UTC to a millisecond, positions are written to 1e-7 of a minute (0.2 mm). Heights are above mean
//! sea level by EGM96 ([`crate::geoid`]), with the separation beside them: their sum is the height above the
//! ellipsoid, to 0.05 mm. [`read`] reads sentences. Limit: no sentence states how far the solution may be
//! off.

pub mod read;

use std::fmt::Write;

use nalgebra::Vector3;

use crate::earth::Geodetic;
use crate::geoid::separation_m;
use crate::satellite::{Sv, System};
use crate::signal::Signal;
use crate::time::Epoch;

/// One knot, metres per second.
pub const KNOT_MPS: f64 = 1852.0 / 3600.0;
/// Satellites of a GSA sentence and of a GSV sentence.
const GSA_SATELLITES: usize = 12;
const GSV_SATELLITES: usize = 4;

/// Position and time of a vehicle.
#[derive(Clone, Debug)]
pub struct Place {
    /// GPS time of the position.
    pub time: Epoch,
    /// ECEF position, in metres.
    pub position_m: Vector3<f64>,
    /// ECEF velocity, in m/s.
    pub velocity_mps: Vector3<f64>,
    /// Satellites in the solution.
    pub satellites: u32,
    /// Dilution of precision: of the position,
    pub pdop: f64,
    /// of the horizontal position,
    pub hdop: f64,
    /// and of the height.
    pub vdop: f64,
}

/// A satellite of a GSA or GSV sentence.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The satellite.
    pub sv: Sv,
    /// Strongest signal of the satellite and its C/N0 in dB-Hz; absent if no signal is received.
    pub signal: Option<(&'static Signal, f64)>,
    /// Azimuth from north over east, in degrees.
    pub azimuth_deg: f64,
    /// Elevation above the horizon, in degrees.
    pub elevation_deg: f64,
    /// True if the satellite is used in the solution.
    pub used: bool,
}

/// Writes all sentences of an epoch: GGA, RMC, VTG, ZDA, then GSA by system and GSV by system and signal.
pub fn epoch(place: &Place, seen: &[Seen]) -> String {
    let mut systems: Vec<System> = seen.iter().filter(|seen| seen.used).map(|seen| seen.sv.system).collect();
    systems.sort();
    systems.dedup();
    // One talker of its own, or all together.
    let talker = match systems.as_slice() {
        [one] => talker(*one),
        _ => "GN",
    };
    let mut text = String::new();
    for body in [gga(place), rmc(place), vtg(place), zda(place)] {
        text += &sentence(talker, &body);
    }
    for system in systems {
        let own = seen.iter().filter(|seen| seen.used && seen.sv.system == system).map(|seen| seen.sv);
        let own: Vec<Sv> = own.collect();
        for some in own.chunks(GSA_SATELLITES) {
            text += &sentence(talker, &gsa(place, system, some));
        }
    }
    text + &in_view(seen)
}

/// Writes a sentence with its checksum, the exclusive or of all characters between `$` and `*`.
pub fn sentence(talker: &str, body: &str) -> String {
    let sum = talker.bytes().chain(body.bytes()).fold(0, |sum, byte| sum ^ byte);
    format!("${talker}{body}*{sum:02X}\r\n")
}

/// Talker identifier of a system (NMEA 0183 4.11, table 1).
pub fn talker(system: System) -> &'static str {
    match system {
        System::Gps | System::Sbas => "GP",
        System::Glonass => "GL",
        System::Galileo => "GA",
        System::BeiDou => "GB",
        System::Qzss => "GQ",
        System::Navic => "GI",
    }
}

/// Number of a system in GSA (NMEA 0183 4.11, GSA).
fn system_number(system: System) -> u8 {
    match system {
        System::Gps | System::Sbas => 1,
        System::Glonass => 2,
        System::Galileo => 3,
        System::BeiDou => 4,
        System::Qzss => 5,
        System::Navic => 6,
    }
}

/// Number of a satellite: those of GLONASS begin at 65, of SBAS at 33 for PRN 120, which RINEX calls S20.
fn number(sv: Sv) -> u16 {
    match sv.system {
        System::Glonass => u16::from(sv.number) + 64,
        System::Sbas => u16::from(sv.number) + 13,
        _ => u16::from(sv.number),
    }
}

/// Number of a signal in GSV, hexadecimal (NMEA 0183 4.11, GSV); 0 if it has none.
fn signal_number(signal: &Signal) -> u8 {
    match (signal.system, signal.rinex) {
        (System::Gps | System::Glonass | System::Qzss | System::Sbas, "1C") => 1,
        (System::Galileo, "1C") => 7,
        (System::Glonass, "2C") => 3,
        (System::BeiDou, "2I") => 1,
        (System::BeiDou, "6I") => 8,
        (System::BeiDou, "7I") => 0xB,
        (System::Navic, "5A") => 1,
        (System::Navic, "9A") => 2,
        _ => 0,
    }
}

/// Hours, minutes and seconds, then day, month and year: UTC, rounded to a millisecond.
fn time(at: Epoch) -> (String, [String; 3]) {
    // As `YYYY-MM-DDThh:mm:ss.ssssssZ`.
    let text = at.plus_s(0.5e-3).to_utc_text();
    let part = |from: usize, to: usize| text.get(from..to).unwrap_or_default().to_owned();
    let clock = format!("{}{}{}", part(11, 13), part(14, 16), part(17, 23));
    (clock, [part(8, 10), part(5, 7), part(0, 4)])
}

/// Latitude and longitude with their hemispheres, and the position that they name.
fn coordinates(position_m: &Vector3<f64>) -> (String, Geodetic) {
    let place = Geodetic::from_ecef(position_m);
    let one = |rad: f64, width: usize, signs: [char; 2]| {
        // In 1e-7 of a minute, so that no rounding gives 60 minutes.
        let units = (rad.abs().to_degrees() * 60e7).round() as u64;
        let (degrees, minutes) = (units / 600_000_000, units % 600_000_000);
        let sign = if rad < 0.0 { signs[1] } else { signs[0] };
        format!("{degrees:0width$}{:02}.{:07},{sign}", minutes / 10_000_000, minutes % 10_000_000)
    };
    let latitude = one(place.latitude_rad, 2, ['N', 'S']);
    let longitude = one(place.longitude_rad, 3, ['E', 'W']);
    (format!("{latitude},{longitude}"), place)
}

/// Speed over ground and course from north over east.
fn over_ground(place: &Place) -> (f64, f64) {
    let enu = Geodetic::from_ecef(&place.position_m).ecef_to_enu() * place.velocity_mps;
    (libm::hypot(enu.x, enu.y), libm::atan2(enu.x, enu.y).to_degrees().rem_euclid(360.0))
}

/// Limits a dilution of precision to 99.99, which stands for all larger values.
fn dilution(value: f64) -> f64 {
    value.min(99.99)
}

fn gga(place: &Place) -> String {
    let (clock, _) = time(place.time);
    let (coordinates, at) = coordinates(&place.position_m);
    let (count, hdop) = (place.satellites.min(99), dilution(place.hdop));
    // Rounded first, so that altitude and separation add up to the height as it is.
    let separation_m = (1e3 * separation_m(at.latitude_rad, at.longitude_rad)).round() / 1e3;
    let altitude_m = at.height_m - separation_m;
    format!("GGA,{clock},{coordinates},1,{count:02},{hdop:.2},{altitude_m:.4},M,{separation_m:.3},M,,")
}

fn rmc(place: &Place) -> String {
    let (clock, [day, month, year]) = time(place.time);
    let (coordinates, _) = coordinates(&place.position_m);
    let (speed_mps, course_deg) = over_ground(place);
    let (knots, year) = (speed_mps / KNOT_MPS, year.get(2..).unwrap_or_default().to_owned());
    format!("RMC,{clock},A,{coordinates},{knots:.4},{:.2},{day}{month}{year},,,A,V", course(course_deg))
}

fn vtg(place: &Place) -> String {
    let (speed_mps, course_deg) = over_ground(place);
    let (knots, kmh) = (speed_mps / KNOT_MPS, 3.6 * speed_mps);
    format!("VTG,{:.2},T,,M,{knots:.4},N,{kmh:.4},K,A", course(course_deg))
}

/// 359.995 and more would be written as 360.
fn course(course_deg: f64) -> f64 {
    if course_deg >= 359.995 { 0.0 } else { course_deg }
}

fn zda(place: &Place) -> String {
    let (clock, [day, month, year]) = time(place.time);
    format!("ZDA,{clock},{day},{month},{year},00,00")
}

fn gsa(place: &Place, system: System, used: &[Sv]) -> String {
    let mut text = "GSA,A,3".to_owned();
    for place in 0..GSA_SATELLITES {
        text.push(',');
        if let Some(sv) = used.get(place) {
            let _ = write!(text, "{:02}", number(*sv));
        }
    }
    let [pdop, hdop, vdop] = [place.pdop, place.hdop, place.vdop].map(dilution);
    let _ = write!(text, ",{pdop:.2},{hdop:.2},{vdop:.2},{}", system_number(system));
    text
}

/// GSV sentences, by talker and signal.
fn in_view(seen: &[Seen]) -> String {
    let group = |seen: &Seen| (talker(seen.sv.system), seen.signal.map_or(0, |(signal, _)| signal_number(signal)));
    let mut groups: Vec<(&str, u8)> = seen.iter().map(group).collect();
    groups.sort_unstable();
    groups.dedup();
    let mut text = String::new();
    for (talker, signal) in groups {
        let own: Vec<&Seen> = seen.iter().filter(|seen| group(seen) == (talker, signal)).collect();
        let sentences = own.len().div_ceil(GSV_SATELLITES);
        for (index, some) in own.chunks(GSV_SATELLITES).enumerate() {
            let mut body = format!("GSV,{sentences},{},{:02}", index + 1, own.len());
            for seen in some {
                let elevation = seen.elevation_deg.round().clamp(-90.0, 90.0);
                let azimuth = seen.azimuth_deg.round() as u32 % 360;
                let _ = write!(body, ",{:02},{elevation:02.0},{azimuth:03},", number(seen.sv));
                if let Some((_, cn0_dbhz)) = seen.signal {
                    let _ = write!(body, "{:02.0}", cn0_dbhz.clamp(0.0, 99.0));
                }
            }
            let _ = write!(body, ",{signal:X}");
            text += &sentence(talker, &body);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gps::l1ca::L1_CA;

    fn place(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Place {
        Place {
            time: Epoch::parse("2010-07-01T08:05:59.9996Z").unwrap(),
            position_m: Geodetic::from_degrees(latitude_deg, longitude_deg, height_m).to_ecef(),
            velocity_mps: Vector3::zeros(),
            satellites: 9,
            pdop: 1.5,
            hdop: 0.9,
            vdop: 1.2,
        }
    }

    #[test]
    fn the_printed_example_has_its_checksum() {
        // NMEA 0183, GGA example as gpsd's documentation prints it.
        let body = "GGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,";
        assert_eq!(sentence("GP", body), format!("$GP{body}*47\r\n"));
    }

    #[test]
    fn minutes_and_seconds_never_round_up_to_sixty() {
        let text = gga(&place(-26.999_999_999_9, 179.999_999_999_99, 130.0));
        assert!(text.starts_with("GGA,080600.000,2700.0000000,S,18000.0000000,E,1,09,0.90,"), "{text}");
        let text = gga(&place(0.5, -0.25, -5.0));
        assert!(text.contains(",0030.0000000,N,00015.0000000,W,"), "{text}");
        assert!(zda(&place(0.0, 0.0, 0.0)).contains("080600.000,01,07,2010,00,00"));
    }

    /// Expected values at 38° N 90° W: the sea is 30.262 m below the ellipsoid (WW15MGH), 30.26 m in whole
    /// centimetres.
    #[test]
    fn altitude_is_above_the_sea_and_the_separation_stands_beside_it() {
        let text = gga(&place(38.0, -90.0, 100.012_34));
        assert!(text.ends_with(",130.2723,M,-30.260,M,,"), "{text}");
    }

    #[test]
    fn course_and_speed_are_those_over_ground() {
        let mut here = place(0.0, 90.0, 0.0);
        // East of there is minus x; 10 m/s up do not count.
        here.velocity_mps = Vector3::new(-10.0 * KNOT_MPS, 10.0, 0.0);
        assert!(vtg(&here).starts_with("VTG,90.00,T,,M,10.0000,N,18.5200,K"), "{}", vtg(&here));
        assert!(rmc(&here).contains(",10.0000,90.00,010710,,,A,V"), "{}", rmc(&here));
        assert_eq!(course(359.996), 0.0);
    }

    #[test]
    fn systems_have_their_own_sentences_of_satellites() {
        let galileo = Sv { system: System::Galileo, number: 11 };
        let one = |sv, used| Seen { sv, signal: Some((&L1_CA, 44.6)), azimuth_deg: 359.7, elevation_deg: 8.4, used };
        let seen: Vec<Seen> =
            (1..=5).map(|number| one(Sv::gps(number), number > 1)).chain([one(galileo, true)]).collect();
        let text = epoch(&place(0.0, 0.0, 0.0), &seen);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.iter().all(|line| line.len() <= 82 || line.contains("GGA")), "{text}");
        assert!(
            lines.iter().any(|line| line.starts_with("$GNGSA,A,3,02,03,04,05,,,,,,,,,1.50,0.90,1.20,1*")),
            "{text}"
        );
        assert!(lines.iter().any(|line| line.starts_with("$GNGSA,A,3,11,,,,,,,,,,,,1.50,0.90,1.20,3*")), "{text}");
        assert!(lines.iter().any(|line| line.starts_with("$GPGSV,2,2,05,05,08,000,45,1*")), "{text}");
        assert!(lines.iter().any(|line| line.starts_with("$GAGSV,1,1,01,11,08,000,45,")), "{text}");
        // Of one system alone, its own talker.
        let text = epoch(&place(0.0, 0.0, 0.0), &seen[..5]);
        assert!(text.starts_with("$GPGGA") && text.contains("$GPGSA"), "{text}");
    }
}
