//! What IS-GPS-200N prints, typed again from its tables: places and scales of the message's fields, and times.

use gnss_twin::gnss::earth::{Geodetic, Look, look, rotate_earth};
use gnss_twin::gnss::gps::lnav::{self, Kind};
use gnss_twin::gnss::time::Epoch;
use nalgebra::Vector3;

/// Subframe or page; parameter; first bit and length of each piece; signed; power of two of the scale; in semicircles.
type Row = (&'static str, &'static str, &'static [(u16, u8)], bool, i32, bool);

/// Figure 20-1 (sheets 1, 2, 3, 4 and 8) and tables 20-I, 20-III, 20-VI, 20-IX and 20-X.
#[rustfmt::skip]
const FIELDS: [Row; 59] = [
    ("subframe 1", "week", &[(61, 10)], false, 0, false),
    ("subframe 1", "l2_codes", &[(71, 2)], false, 0, false),
    ("subframe 1", "ura_index", &[(73, 4)], false, 0, false),
    ("subframe 1", "health", &[(77, 6)], false, 0, false),
    ("subframe 1", "iodc", &[(83, 2), (211, 8)], false, 0, false),
    ("subframe 1", "l2_p_data_off", &[(91, 1)], false, 0, false),
    ("subframe 1", "tgd_s", &[(197, 8)], true, -31, false),
    ("subframe 1", "toc_s", &[(219, 16)], false, 4, false),
    ("subframe 1", "af2_sps2", &[(241, 8)], true, -55, false),
    ("subframe 1", "af1_sps", &[(249, 16)], true, -43, false),
    ("subframe 1", "af0_s", &[(271, 22)], true, -31, false),
    ("subframe 2", "iode", &[(61, 8)], false, 0, false),
    ("subframe 2", "crs_m", &[(69, 16)], true, -5, false),
    ("subframe 2", "delta_n_radps", &[(91, 16)], true, -43, true),
    ("subframe 2", "m0_rad", &[(107, 8), (121, 24)], true, -31, true),
    ("subframe 2", "cuc_rad", &[(151, 16)], true, -29, false),
    ("subframe 2", "eccentricity", &[(167, 8), (181, 24)], false, -33, false),
    ("subframe 2", "cus_rad", &[(211, 16)], true, -29, false),
    ("subframe 2", "sqrt_a_sqrtm", &[(227, 8), (241, 24)], false, -19, false),
    ("subframe 2", "toe_s", &[(271, 16)], false, 4, false),
    ("subframe 2", "long_fit", &[(287, 1)], false, 0, false),
    ("subframe 2", "aodo", &[(288, 5)], false, 0, false),
    ("subframe 3", "cic_rad", &[(61, 16)], true, -29, false),
    ("subframe 3", "omega0_rad", &[(77, 8), (91, 24)], true, -31, true),
    ("subframe 3", "cis_rad", &[(121, 16)], true, -29, false),
    ("subframe 3", "i0_rad", &[(137, 8), (151, 24)], true, -31, true),
    ("subframe 3", "crc_m", &[(181, 16)], true, -5, false),
    ("subframe 3", "omega_rad", &[(197, 8), (211, 24)], true, -31, true),
    ("subframe 3", "omega_dot_radps", &[(241, 24)], true, -43, true),
    ("subframe 3", "iode", &[(271, 8)], false, 0, false),
    ("subframe 3", "idot_radps", &[(279, 14)], true, -43, true),
    ("almanac", "sv_id", &[(63, 6)], false, 0, false),
    ("almanac", "eccentricity", &[(69, 16)], false, -21, false),
    ("almanac", "toa_s", &[(91, 8)], false, 12, false),
    ("almanac", "delta_i_rad", &[(99, 16)], true, -19, true),
    ("almanac", "omega_dot_radps", &[(121, 16)], true, -38, true),
    ("almanac", "health", &[(137, 8)], false, 0, false),
    ("almanac", "sqrt_a_sqrtm", &[(151, 24)], false, -11, false),
    ("almanac", "omega0_rad", &[(181, 24)], true, -23, true),
    ("almanac", "omega_rad", &[(211, 24)], true, -23, true),
    ("almanac", "m0_rad", &[(241, 24)], true, -23, true),
    ("almanac", "af0_s", &[(271, 8), (290, 3)], true, -20, false),
    ("almanac", "af1_sps", &[(279, 11)], true, -38, false),
    ("ionosphere, subframe 4 page 18", "alpha_0", &[(69, 8)], true, -30, false),
    ("ionosphere, subframe 4 page 18", "alpha_1", &[(77, 8)], true, -27, false),
    ("ionosphere, subframe 4 page 18", "alpha_2", &[(91, 8)], true, -24, false),
    ("ionosphere, subframe 4 page 18", "alpha_3", &[(99, 8)], true, -24, false),
    ("ionosphere, subframe 4 page 18", "beta_0", &[(107, 8)], true, 11, false),
    ("ionosphere, subframe 4 page 18", "beta_1", &[(121, 8)], true, 14, false),
    ("ionosphere, subframe 4 page 18", "beta_2", &[(129, 8)], true, 16, false),
    ("ionosphere, subframe 4 page 18", "beta_3", &[(137, 8)], true, 16, false),
    ("utc, subframe 4 page 18", "utc_a1_sps", &[(151, 24)], true, -50, false),
    ("utc, subframe 4 page 18", "utc_a0_s", &[(181, 24), (211, 8)], true, -30, false),
    ("utc, subframe 4 page 18", "utc_tot_s", &[(219, 8)], false, 12, false),
    ("utc, subframe 4 page 18", "utc_week", &[(227, 8)], false, 0, false),
    ("utc, subframe 4 page 18", "utc_leap_s", &[(241, 8)], true, 0, false),
    ("utc, subframe 4 page 18", "utc_event_week", &[(249, 8)], false, 0, false),
    ("utc, subframe 4 page 18", "utc_event_day", &[(257, 8)], false, 0, false),
    ("utc, subframe 4 page 18", "utc_leap_after_s", &[(271, 8)], true, 0, false),
];

/// π as table 20-IV prints it.
#[expect(clippy::approx_constant, reason = "the document's own digits")]
const PRINTED_PI: f64 = 3.141_592_653_589_8;

#[test]
fn every_field_of_the_message_has_the_printed_place_sign_and_scale() {
    let mut met = 0;
    for (page, fields) in lnav::tables() {
        for field in fields {
            let row = FIELDS.iter().find(|row| (row.0, row.1) == (page, field.name));
            let Some(&(_, name, pieces, signed, exponent, semicircles)) = row else {
                panic!("{page}: {} is not printed", field.name)
            };
            met += 1;
            let bits: u32 = pieces.iter().map(|piece| u32::from(piece.1)).sum();
            assert_eq!(field.bits(), bits, "{page}: {name}");
            let least = if signed { -(1_i64 << (bits - 1)) } else { 0 };
            assert_eq!(field.range().0, least, "{page}: {name}");
            // A one at each bit of the subframe in turn: that bit's weight in the field, or none.
            for number in 1..=300_u16 {
                let (word, place) = (usize::from(number - 1) / 30, (number - 1) % 30);
                if place >= 24 {
                    continue;
                }
                let mut data = [0_u32; 10];
                data[word] = 1 << (23 - place);
                let mut below = bits;
                let mut weight = 0;
                for &(first, length) in pieces {
                    below -= u32::from(length);
                    if (first..first + u16::from(length)).contains(&number) {
                        weight = 1_i64 << (below + u32::from(first + u16::from(length) - 1 - number));
                    }
                }
                let sign = if signed && weight == 1 << (bits - 1) { -1 } else { 1 };
                assert_eq!(field.read(&data), sign * weight, "{page}: {name}, bit {number}");
                if weight != 0 {
                    let scale = libm::ldexp(if semicircles { PRINTED_PI } else { 1.0 }, exponent);
                    let (found, printed) = (field.value(sign * weight), (sign * weight) as f64 * scale);
                    assert!((found - printed).abs() <= 1e-15 * printed.abs(), "{page}: {name}, bit {number}: {found}");
                    if field.kind != Kind::Turn || weight != 1 << (bits - 1) {
                        assert_eq!(field.raw(printed), Ok(sign * weight), "{page}: {name}, bit {number}");
                    }
                    let mut written = [0_u32; 10];
                    field.write(&mut written, weight);
                    assert_eq!(written, data, "{page}: {name}, bit {number}");
                }
            }
        }
    }
    assert_eq!(met, 59);
}

#[test]
fn the_page_with_the_ionosphere_and_the_count_of_the_handover_are_where_they_are_printed() {
    use gnss_twin::gnss::gps::lnav::{Broadcast, Subframe};
    use gnss_twin::gnss::klobuchar::Klobuchar;
    let model = Klobuchar { alpha: [0.0; 4], beta: [0.0; 4] };
    let sets = gnss_twin::gnss::rinex::embedded().unwrap().ephemerides;
    let start = Epoch::from_week(1590, 374_760.0);
    let set = sets.iter().min_by(|a, b| a.toe.since(start).abs().total_cmp(&b.toe.since(start).abs())).unwrap();
    let broadcast = Broadcast::new(Some(model), 15, &sets, start).unwrap();
    // 20.3.3.5.1: page 18 of subframe 4 in the 18th frame of 12.5 minutes, which begin with the week.
    for frame in 0..25 {
        let at = Epoch::from_week(1590, 374_250.0 + 30.0 * f64::from(frame) + 18.0);
        let words = broadcast.subframe(set, at).unwrap();
        let subframe = Subframe::decode(&words, 0).unwrap();
        assert_eq!(subframe.id, 4);
        let number = (at.tow_whole_s() / 30) % 25 + 1;
        assert_eq!(subframe.klobuchar().is_some(), number == 18, "frame {number}");
        // 20.3.3.2: the count is that of the next subframe's start.
        assert_eq!(i64::from(subframe.tow_count) * 6, at.tow_whole_s() + 6);
    }
}

#[test]
fn a_word_s_parity_is_the_printed_one_and_one_wrong_bit_breaks_it() {
    let mut data = 0x12_3456_u32;
    for previous in (0..4).cycle().take(400) {
        data = data.wrapping_mul(1_664_525).wrapping_add(1_013_904_223) & 0xFF_FFFF;
        let word = super::lnav::printed_word(data, previous);
        assert_eq!(lnav::check_parity(word, previous), Some(data), "{data:06X} after {previous}");
        for bit in 0..30 {
            assert_eq!(lnav::check_parity(word ^ (1 << bit), previous), None, "{data:06X}, bit {bit}");
        }
    }
}

#[test]
fn weeks_begin_on_sunday_and_leap_seconds_are_those_of_the_bulletins() {
    // Week 0 began at 1980-01-06T00:00:00; 2010-07-01 was a Thursday in week 1590. IERS Bulletins C 37 and C 52.
    for (utc, week, tow_s, leap_s) in [
        ("1980-01-06T00:00:00Z", 0, 0.0, 0),
        ("2010-07-01T00:00:00Z", 1590, 345_615.0, 15),
        ("2017-01-01T00:00:00Z", 1930, 18.0, 18),
        ("2019-04-06T23:59:42Z", 2048, 0.0, 18),
    ] {
        let at = Epoch::parse(utc).unwrap();
        assert_eq!(at, Epoch::from_week(week, tow_s), "{utc}");
        assert_eq!(at.leap_seconds(), leap_s, "{utc}");
    }
}

#[test]
fn places_and_directions_are_the_published_ones() {
    // EPSG Guidance Note 7-2, geographic to geocentric: 53°48'33.820"N 2°07'46.380"E 73.0 m.
    let place = Geodetic::from_degrees(53.0 + 48.0 / 60.0 + 33.820 / 3600.0, 2.0 + 7.0 / 60.0 + 46.380 / 3600.0, 73.0);
    let printed = Vector3::new(3_771_793.968, 140_253.342, 5_124_304.349);
    assert!((place.to_ecef() - printed).norm() < 1e-3);
    assert!((Geodetic::from_ecef(&printed).height_m - 73.0).abs() < 1e-3);
    // From 0° N 0° E, 1 km to the east is along y and one to the north along z.
    let here = Geodetic::from_degrees(0.0, 0.0, 0.0);
    let towards = |y: f64, z: f64| look(here, &here.to_ecef(), &(here.to_ecef() + Vector3::new(0.0, y, z)));
    let Look { azimuth_rad, .. } = towards(1e3, 0.0);
    assert!((azimuth_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!(towards(0.0, 1e3).azimuth_rad.abs() < 1e-12);
    // A star over the Greenwich meridian stands over 15.04° W a sidereal hour's worth of rotation later: the axes turn east.
    let later = rotate_earth(&Vector3::new(1.0, 0.0, 0.0), 3600.0);
    assert!(later.y < 0.0 && (libm::atan2(-later.y, later.x) - 7.292_115_146_7e-5 * 3600.0).abs() < 1e-12);
}
