//! Tables of IS-GPS-200N and of Galileo's document, typed again: positions and scales of the messages'
//! fields, checks, codes, and times.

use std::fmt::Debug;

use gnss::beidou::in_phase::{B1I, B2I, B3I};
use gnss::bits::Store;
use gnss::broadcast::{Ephemeris, StateVector};
use gnss::crc::crc24q;
use gnss::earth::{EARTH_ROTATION_RADPS, Geodetic, Look, SEMI_MAJOR_AXIS_M, look, rotate_earth};
use gnss::galileo::altboc::E5;
use gnss::galileo::e1::E1;
use gnss::galileo::e6::E6;
use gnss::galileo::fnav::FNAV;
use gnss::galileo::inav::{self, INAV_SETS};
use gnss::glonass::fdma::{G1, G2};
use gnss::glonass::gnav::GNAV_SETS;
use gnss::gps::cnav::CNAV_SETS;
use gnss::gps::cnav2::CNAV2_SETS;
use gnss::gps::l1c::L1C;
use gnss::gps::l1ca::L1_CA;
use gnss::gps::l2c::L2C;
use gnss::gps::l5::L5;
use gnss::gps::lnav::{self, Field, Kind};
use gnss::gravity::{central_mps2, gravitation_mps2};
use gnss::navic::sps;
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;
use nalgebra::Vector3;

/// Subframe or page; parameter; first bit and length of each piece; signed; power of two of the scale; in
/// semicircles.
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

/// Holds a field to its printed row: `ones` are stores with a single one, by the number of its place.
fn hold<S: Store + Default + PartialEq + Debug>(page: &str, field: &Field, printed: &Row, ones: &[(u16, S)]) {
    let &(_, name, pieces, signed, exponent, semicircles) = printed;
    let bits: u32 = pieces.iter().map(|piece| u32::from(piece.1)).sum();
    assert_eq!(field.bits(), bits, "{page}: {name}");
    let least = if signed { -(1_i64 << (bits - 1)) } else { 0 };
    assert_eq!(field.range().0, least, "{page}: {name}");
    // A one at each place in turn: that bit's weight in the field, or none.
    for (number, data) in ones {
        let mut below = bits;
        let mut weight = 0;
        for &(first, length) in pieces {
            below -= u32::from(length);
            if (first..first + u16::from(length)).contains(number) {
                weight = 1_i64 << (below + u32::from(first + u16::from(length) - 1 - number));
            }
        }
        let sign = if signed && weight == 1 << (bits - 1) { -1 } else { 1 };
        assert_eq!(field.read(data), sign * weight, "{page}: {name}, bit {number}");
        if weight != 0 {
            let scale = libm::ldexp(if semicircles { PRINTED_PI } else { 1.0 }, exponent);
            let (found, printed) = (field.value(sign * weight), (sign * weight) as f64 * scale);
            assert!((found - printed).abs() <= 1e-15 * printed.abs(), "{page}: {name}, bit {number}: {found}");
            if field.kind != Kind::Turn || weight != 1 << (bits - 1) {
                assert_eq!(field.raw(printed), Ok(sign * weight), "{page}: {name}, bit {number}");
            }
            let mut written = S::default();
            field.write(&mut written, weight);
            assert_eq!(&written, data, "{page}: {name}, bit {number}");
        }
    }
}

fn printed_row<'a>(rows: &'a [Row], page: &str, name: &str) -> &'a Row {
    rows.iter().find(|row| (row.0, row.1) == (page, name)).unwrap_or_else(|| panic!("{page}: {name} is not printed"))
}

#[test]
fn every_field_of_the_message_has_the_printed_position_sign_and_scale() {
    let mut met = 0;
    let data_bits = (1..=300_u16).filter(|number| (number - 1) % 30 < 24);
    let ones: Vec<(u16, [u32; 10])> = data_bits
        .map(|number| {
            let mut data = [0_u32; 10];
            data[usize::from(number - 1) / 30] = 1 << (23 - (number - 1) % 30);
            (number, data)
        })
        .collect();
    for (page, fields) in lnav::tables() {
        for field in fields {
            hold(page, field, printed_row(&FIELDS, page, field.name), &ones);
            met += 1;
        }
    }
    assert_eq!(met, 59);
}

/// Galileo OS SIS ICD 2.1, tables 42 to 54 (places, from 0) and 57 to 71 (lengths and scales). Times in words
/// 1 and 4 count minutes, t0UTC and t0G hours, t0a ten minutes.
#[rustfmt::skip]
const INAV_FIELDS: [Row; 104] = [
    ("word 0", "week", &[(96, 12)], false, 0, false),
    ("word 0", "tow_s", &[(108, 20)], false, 0, false),
    ("word 1", "iodnav", &[(6, 10)], false, 0, false),
    ("word 1", "toe_min", &[(16, 14)], false, 0, false),
    ("word 1", "m0_rad", &[(30, 32)], true, -31, true),
    ("word 1", "eccentricity", &[(62, 32)], false, -33, false),
    ("word 1", "sqrt_a_sqrtm", &[(94, 32)], false, -19, false),
    ("word 2", "iodnav", &[(6, 10)], false, 0, false),
    ("word 2", "omega0_rad", &[(16, 32)], true, -31, true),
    ("word 2", "i0_rad", &[(48, 32)], true, -31, true),
    ("word 2", "omega_rad", &[(80, 32)], true, -31, true),
    ("word 2", "idot_radps", &[(112, 14)], true, -43, true),
    ("word 3", "iodnav", &[(6, 10)], false, 0, false),
    ("word 3", "omega_dot_radps", &[(16, 24)], true, -43, true),
    ("word 3", "delta_n_radps", &[(40, 16)], true, -43, true),
    ("word 3", "cuc_rad", &[(56, 16)], true, -29, false),
    ("word 3", "cus_rad", &[(72, 16)], true, -29, false),
    ("word 3", "crc_m", &[(88, 16)], true, -5, false),
    ("word 3", "crs_m", &[(104, 16)], true, -5, false),
    ("word 3", "sisa_index", &[(120, 8)], false, 0, false),
    ("word 4", "iodnav", &[(6, 10)], false, 0, false),
    ("word 4", "svid", &[(16, 6)], false, 0, false),
    ("word 4", "cic_rad", &[(22, 16)], true, -29, false),
    ("word 4", "cis_rad", &[(38, 16)], true, -29, false),
    ("word 4", "toc_min", &[(54, 14)], false, 0, false),
    ("word 4", "af0_s", &[(68, 31)], true, -34, false),
    ("word 4", "af1_sps", &[(99, 21)], true, -46, false),
    ("word 4", "af2_sps2", &[(120, 6)], true, -59, false),
    ("word 5", "ai0_sfu", &[(6, 11)], false, -2, false),
    ("word 5", "ai1_sfupdeg", &[(17, 11)], true, -8, false),
    ("word 5", "ai2_sfupdeg2", &[(28, 14)], true, -15, false),
    ("word 5", "bgd_e1_e5a_s", &[(47, 10)], true, -32, false),
    ("word 5", "bgd_e1_e5b_s", &[(57, 10)], true, -32, false),
    ("word 5", "e5b_health", &[(67, 2)], false, 0, false),
    ("word 5", "e1b_health", &[(69, 2)], false, 0, false),
    ("word 5", "e5b_data_validity", &[(71, 1)], false, 0, false),
    ("word 5", "e1b_data_validity", &[(72, 1)], false, 0, false),
    ("word 5", "week", &[(73, 12)], false, 0, false),
    ("word 5", "tow_s", &[(85, 20)], false, 0, false),
    ("word 6", "utc_a0_s", &[(6, 32)], true, -30, false),
    ("word 6", "utc_a1_sps", &[(38, 24)], true, -50, false),
    ("word 6", "utc_leap_s", &[(62, 8)], true, 0, false),
    ("word 6", "utc_t0_h", &[(70, 8)], false, 0, false),
    ("word 6", "utc_week", &[(78, 8)], false, 0, false),
    ("word 6", "utc_event_week", &[(86, 8)], false, 0, false),
    ("word 6", "utc_event_day", &[(94, 3)], false, 0, false),
    ("word 6", "utc_leap_after_s", &[(97, 8)], true, 0, false),
    ("word 6", "tow_s", &[(105, 20)], false, 0, false),
    ("word 7", "almanac_issue", &[(6, 4)], false, 0, false),
    ("word 7", "almanac_week", &[(10, 2)], false, 0, false),
    ("word 7", "toa_10min", &[(12, 10)], false, 0, false),
    ("word 7", "svid", &[(22, 6)], false, 0, false),
    ("word 7", "delta_sqrt_a_sqrtm", &[(28, 13)], true, -9, false),
    ("word 7", "eccentricity", &[(41, 11)], false, -16, false),
    ("word 7", "omega_rad", &[(52, 16)], true, -15, true),
    ("word 7", "delta_i_rad", &[(68, 11)], true, -14, true),
    ("word 7", "omega0_rad", &[(79, 16)], true, -15, true),
    ("word 7", "omega_dot_radps", &[(95, 11)], true, -33, true),
    ("word 7", "m0_rad", &[(106, 16)], true, -15, true),
    ("word 8", "almanac_issue", &[(6, 4)], false, 0, false),
    ("word 8", "af0_s", &[(10, 16)], true, -19, false),
    ("word 8", "af1_sps", &[(26, 13)], true, -38, false),
    ("word 8", "e5b_health", &[(39, 2)], false, 0, false),
    ("word 8", "e1b_health", &[(41, 2)], false, 0, false),
    ("word 8", "svid", &[(43, 6)], false, 0, false),
    ("word 8", "delta_sqrt_a_sqrtm", &[(49, 13)], true, -9, false),
    ("word 8", "eccentricity", &[(62, 11)], false, -16, false),
    ("word 8", "omega_rad", &[(73, 16)], true, -15, true),
    ("word 8", "delta_i_rad", &[(89, 11)], true, -14, true),
    ("word 8", "omega0_rad", &[(100, 16)], true, -15, true),
    ("word 8", "omega_dot_radps", &[(116, 11)], true, -33, true),
    ("word 9", "almanac_issue", &[(6, 4)], false, 0, false),
    ("word 9", "almanac_week", &[(10, 2)], false, 0, false),
    ("word 9", "toa_10min", &[(12, 10)], false, 0, false),
    ("word 9", "m0_rad", &[(22, 16)], true, -15, true),
    ("word 9", "af0_s", &[(38, 16)], true, -19, false),
    ("word 9", "af1_sps", &[(54, 13)], true, -38, false),
    ("word 9", "e5b_health", &[(67, 2)], false, 0, false),
    ("word 9", "e1b_health", &[(69, 2)], false, 0, false),
    ("word 9", "svid", &[(71, 6)], false, 0, false),
    ("word 9", "delta_sqrt_a_sqrtm", &[(77, 13)], true, -9, false),
    ("word 9", "eccentricity", &[(90, 11)], false, -16, false),
    ("word 9", "omega_rad", &[(101, 16)], true, -15, true),
    ("word 9", "delta_i_rad", &[(117, 11)], true, -14, true),
    ("word 10", "almanac_issue", &[(6, 4)], false, 0, false),
    ("word 10", "omega0_rad", &[(10, 16)], true, -15, true),
    ("word 10", "omega_dot_radps", &[(26, 11)], true, -33, true),
    ("word 10", "m0_rad", &[(37, 16)], true, -15, true),
    ("word 10", "af0_s", &[(53, 16)], true, -19, false),
    ("word 10", "af1_sps", &[(69, 13)], true, -38, false),
    ("word 10", "e5b_health", &[(82, 2)], false, 0, false),
    ("word 10", "e1b_health", &[(84, 2)], false, 0, false),
    ("word 10", "ggto_a0_s", &[(86, 16)], true, -35, false),
    ("word 10", "ggto_a1_sps", &[(102, 12)], true, -51, false),
    ("word 10", "ggto_t0_h", &[(114, 8)], false, 0, false),
    ("word 10", "ggto_week", &[(122, 6)], false, 0, false),
    ("word 16", "delta_axis_m", &[(6, 5)], true, 8, false),
    ("word 16", "ex", &[(11, 13)], true, -22, false),
    ("word 16", "ey", &[(24, 13)], true, -22, false),
    ("word 16", "delta_i_rad", &[(37, 17)], true, -22, true),
    ("word 16", "omega0_rad", &[(54, 23)], true, -22, true),
    ("word 16", "latitude_rad", &[(77, 23)], true, -22, true),
    ("word 16", "af0_s", &[(100, 22)], true, -26, false),
    ("word 16", "af1_sps", &[(122, 6)], true, -35, false),
];

#[test]
fn every_field_of_i_nav_has_the_printed_position_sign_and_scale() {
    let ones: Vec<(u16, u128)> = (0..128_u16).map(|number| (number, 1 << (127 - number))).collect();
    let mut met = 0;
    for (page, fields) in inav::tables() {
        for field in fields {
            hold(page, field, printed_row(&INAV_FIELDS, page, field.name), &ones);
            met += 1;
        }
    }
    assert_eq!(met, INAV_FIELDS.len());
}

#[test]
fn pages_of_i_nav_are_checked_coded_interleaved_and_timed_as_printed() {
    // The check of CRC-24Q's catalogue entry (polynomial 0x864CFB from zero) for the text 123456789.
    let text = b"123456789".iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1 == 1));
    assert_eq!(crc24q(text), 0xCD_E703);
    // Zeros leave the encoder as zeros and, behind G2's inverter, ones (4.1.4, figure 13). Of the 8 rows of
    // 30 (4.1.4.2) written by columns, the even ones hold the symbols of G1.
    let page = inav::encode_page(&[vec![false; 120], vec![false; 120]]);
    let pattern = [false, true, false, true, true, false, false, false, false, false];
    for part in page.chunks(250) {
        assert_eq!(part[..10], pattern, "the pattern of 4.3.2.1");
        for (row, symbols) in part[10..].chunks(30).enumerate() {
            assert!(symbols.iter().all(|&symbol| symbol == (row % 2 == 1)), "row {row}");
        }
    }
    // E1-B's nominal sub-frame (table 38): seconds of its 30, and words.
    let start = Epoch::from_week(2353, 579_600.0);
    let words = [(1, 2), (3, 4), (5, 6), (21, 1), (23, 3), (25, 5)];
    assert!(words.iter().all(|&(at_s, word)| inav::word_at(start.plus_s(f64::from(at_s))) == word));
}

#[test]
fn the_page_with_the_ionosphere_and_the_count_of_the_handover_are_where_they_are_printed() {
    use gnss::gps::lnav::{Broadcast, Subframe};
    use gnss::klobuchar::Klobuchar;
    let model = Klobuchar { alpha: [0.0; 4], beta: [0.0; 4] };
    let sets = gnss::rinex::embedded().unwrap().ephemerides;
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
    // Week 0 began at 1980-01-06T00:00:00; 2010-07-01 was a Thursday in week 1590. IERS Bulletins C 37 and C
    // 52.
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
fn positions_and_directions_are_the_published_ones() {
    // EPSG Guidance Note 7-2, geographic to geocentric: 53°48'33.820"N 2°07'46.380"E 73.0 m.
    let position =
        Geodetic::from_degrees(53.0 + 48.0 / 60.0 + 33.820 / 3600.0, 2.0 + 7.0 / 60.0 + 46.380 / 3600.0, 73.0);
    let printed = Vector3::new(3_771_793.968, 140_253.342, 5_124_304.349);
    assert!((position.to_ecef() - printed).norm() < 1e-3);
    assert!((Geodetic::from_ecef(&printed).height_m - 73.0).abs() < 1e-3);
    // From 0° N 0° E, 1 km to the east is along y and one to the north along z.
    let here = Geodetic::from_degrees(0.0, 0.0, 0.0);
    let towards = |y: f64, z: f64| look(here, &here.to_ecef(), &(here.to_ecef() + Vector3::new(0.0, y, z)));
    let Look { azimuth_rad, .. } = towards(1e3, 0.0);
    assert!((azimuth_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!(towards(0.0, 1e3).azimuth_rad.abs() < 1e-12);
    // A star over the Greenwich meridian stands over 15.04° W a sidereal hour's worth of rotation later: the
    // axes turn east.
    let later = rotate_earth(&Vector3::new(1.0, 0.0, 0.0), 3600.0);
    assert!(later.y < 0.0 && (libm::atan2(-later.y, later.x) - 7.292_115_146_7e-5 * 3600.0).abs() < 1e-12);
}

/// Normal gravity of WGS 84 at the equator and at the poles (NGA.STND.0036, table 3.5), and its form
/// factor of degree four: −3 times the C̄40 = 7.903 037 335 11e-7 of the normal field.
#[test]
fn gravity_is_that_of_the_ellipsoid_once_the_term_of_degree_four_is_added() {
    const J4: f64 = -2.370_911_2e-6;
    for (latitude_deg, published_mps2, factor) in
        [(0.0, 9.780_325_335_9, -1.875), (90.0, 9.832_184_937_8, -5.0), (-90.0, 9.832_184_937_8, -5.0)]
    {
        let at_m = Geodetic::from_degrees(latitude_deg, 33.0, 0.0).to_ecef();
        let turning = Vector3::new(at_m.x, at_m.y, 0.0) * (EARTH_ROTATION_RADPS * EARTH_ROTATION_RADPS);
        let gravity_mps2 = (gravitation_mps2(&at_m) + turning).norm();
        // −(n + 1) Jn (a/r)^n Pn of the central term: P4 is 3/8 at the equator and 1 at the poles.
        let ratio = SEMI_MAJOR_AXIS_M / at_m.norm();
        let fourth_mps2 = factor * J4 * ratio.powi(4) * central_mps2(&at_m).norm();
        // Degree six, J6 = 6.1e-9, is below 7·6.1e-9·1.02·9.9 = 4.3e-7; digits of J2 are 5e-11·3·9.9.
        assert!((gravity_mps2 + fourth_mps2 - published_mps2).abs() < 5e-7, "{latitude_deg} {gravity_mps2}");
    }
}

#[test]
fn clocks_of_single_signals_are_behind_by_the_group_delays_that_documents_print() {
    let at = Epoch::from_week(2380, 370_000.0);
    // A circle, on which relativity adds nothing.
    let blank = |system| Ephemeris { sqrt_a_sqrtm: 5153.6, ..Ephemeris::blank(Sv { system, number: 10 }, at) };
    let of = |set: &Ephemeris, signal| set.clock_of_signal(at, signal).unwrap().offset_s;
    let close = |one: f64, other: f64| assert!((one - other).abs() < 1e-18, "{one:e} {other:e}");
    // IS-GPS-200N, 20.3.3.3.3.2: Δt − T_GD on L1, and with (77/60)² on L2.
    let lnav = Ephemeris { tgd_s: 8e-9, ..blank(System::Gps) };
    close(of(&lnav, &L1_CA), -8e-9);
    close(of(&lnav, &L2C), -8e-9 * (77.0 * 77.0) / (60.0 * 60.0));
    // IS-GPS-705J, 20.3.3.3.1.2: Δt − T_GD + ISC; L5 by its pilot.
    let cnav = Ephemeris { form: &CNAV_SETS, isc_s: [1e-9, 2e-9, 4e-9, 5e-9, 0.0, 0.0], ..lnav };
    for (signal, expected_s) in [(&L1_CA, -7e-9), (&L2C, -6e-9), (&L5, -3e-9)] {
        close(of(&cnav, signal), expected_s);
    }
    // IS-GPS-800J, 3.5.3.9.1: the same with the correction of L1C-P.
    let second = Ephemeris { form: &CNAV2_SETS, isc_s: [1e-9, 2e-9, 4e-9, 5e-9, 6e-9, 7e-9], ..cnav };
    for (signal, expected_s) in [(&L1C, -2e-9), (&L1_CA, -7e-9), (&L5, -3e-9)] {
        close(of(&second, signal), expected_s);
    }
    // Galileo OS SIS ICD 2.1, 5.1.5: Δt − BGD on E1; nothing is said of E6, which has the clock of I/NAV
    // here, by whichever message the set came.
    let galileo = Ephemeris { form: &INAV_SETS, tgd_s: 8e-9, tgd2_s: 3e-9, ..blank(System::Galileo) };
    close(of(&galileo, &E1), -8e-9);
    close(of(&galileo, &E6), 0.0);
    close(of(&(FNAV.form)(&galileo), &E6), 0.0);
    // Of E5 as one signal nothing is said: the mean of what its sides have, (f_E1/f)² times 8 ns on E5b, and
    // on E5a 3 ns as often, from a clock that is 3 − 8 ns ahead.
    let [lower, upper] = [(154.0 / 115.0_f64).powi(2), (154.0 / 118.0_f64).powi(2)];
    let mean_s = 0.5 * (8e-9 * upper + 8e-9 + 3e-9 * (lower - 1.0));
    close(of(&galileo, &E5), -mean_s);
    close(of(&(FNAV.form)(&galileo), &E5), -mean_s);
    // BDS-SIS-ICD-2.1, 5.2.4.10: Δt − T_GD1 on B1I, − T_GD2 on B2I; the clock is that of B3I.
    let beidou = Ephemeris { tgd_s: 8e-9, tgd2_s: 3e-9, ..blank(System::BeiDou) };
    for (signal, expected_s) in [(&B1I, -8e-9), (&B2I, -3e-9), (&B3I, 0.0)] {
        close(of(&beidou, signal), expected_s);
    }
    // IRNSS SIS ICD for SPS 1.1, user algorithms: Δt − T_GD on S, and with (f_S/f_L5)² =
    // (2492.028/1176.45)² on L5.
    let navic = Ephemeris { tgd_s: 8e-9, ..blank(System::Navic) };
    close(of(&navic, &sps::S), -8e-9);
    // GLONASS ICD L1, L2 5.1, 4.4: a satellite's time and tau less gamma times the age are the system's, and
    // G2 leaves the antenna later by Δτ.
    let vector = Some(StateVector::default());
    let (form, toc) = (&GNAV_SETS, at.plus_s(-800.0));
    let glonass = Ephemeris { form, toc, vector, af0_s: -3e-5, af1_sps: 4e-12, tgd_s: 5e-9, ..blank(System::Glonass) };
    for (signal, later_s) in [(&G1, 0.0), (&G2, 5e-9)] {
        close(of(&glonass, signal), -3e-5 + 4e-12 * 800.0 - later_s);
    }
    assert!((of(&navic, &sps::L5) / -8e-9 - 4.487_029).abs() < 1e-6);
}
