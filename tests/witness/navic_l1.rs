//! NavIC's L1: codes by digests, the printed places of its message's fields, and the one real set that is at
//! hand: the record of NVS-01 of 2023-06-24 that RINEX 4.02 prints (tables A32 and A41). The frame itself,
//! its interleaver and the count of frames rest on two open decoders; no symbols of a real satellite were at
//! hand.

use std::collections::BTreeMap;

use gnss::bits::{Store, number};
use gnss::broadcast::Ephemeris;
use gnss::crc::crc24q;
use gnss::earth::Geodetic;
use gnss::exchange::{NavigationSets, Version};
use gnss::ionosphere::Coefficients;
use gnss::klobuchar::Klobuchar;
use gnss::message::{Common, Read};
use gnss::navic::l1::{CODE_CHIPS, Code, L1, SECONDARY_CODE_CHIPS, code, secondary_code};
use gnss::navic::l1nav::{self, L1_NAV};
use gnss::navic::sps::{L5, S};
use gnss::rinex;
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;

use super::codes::holds;
use super::data::{Printed, fields_are_as_printed, keplerian};

/// Signal, PRN, ones, first and last 24 chips in hexadecimal, SHA-256 of a byte 0 or 1 for each chip.
const CODES: &str = include_str!("../../data/witness/navic_codes.csv");

#[test]
fn all_chips_of_all_codes_and_secondary_codes_of_l1_are_those_of_another_program() {
    let mut codes = 0;
    for line in CODES.lines().skip(1).filter(|line| line.starts_with("NAVL1")) {
        let column: Vec<&str> = line.split(',').collect();
        let of = column[1].parse().unwrap();
        let (signs, length) = match column[0] {
            "NAVL1D" => (code(Code::Data, of), CODE_CHIPS),
            "NAVL1P" => (code(Code::Pilot, of), CODE_CHIPS),
            _ => (secondary_code(of), SECONDARY_CODE_CHIPS),
        };
        let chips: Vec<u8> = signs.unwrap().into_iter().map(|sign| u8::from(sign < 0)).collect();
        assert_eq!(chips.len(), length as usize);
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 42);
}

const NVS_01: Sv = Sv { system: System::Navic, number: 10 };

/// Start bit, length, sign and power of two of every field, by subframe, as decoders have them, written here
/// again; angles in semicircles.
const PRINTED: [Printed; 47] = [
    ("subframe 2", "week", 0, 13, false, 0, false),
    ("subframe 2", "itow_2h", 13, 8, false, 0, false),
    ("subframe 2", "alert", 21, 1, false, 0, false),
    ("subframe 2", "l1_health", 22, 1, false, 0, false),
    ("subframe 2", "iodec", 23, 4, false, 0, false),
    ("subframe 2", "ura_index", 27, 5, false, 0, false),
    ("subframe 2", "toe_5min", 32, 11, false, 0, false),
    ("subframe 2", "delta_a_m", 43, 26, true, -9, false),
    ("subframe 2", "a_rate_mps", 69, 26, true, -21, false),
    ("subframe 2", "delta_n_radps", 95, 19, true, -44, true),
    ("subframe 2", "delta_n_rate_radps2", 114, 23, true, -57, true),
    ("subframe 2", "m0_rad", 137, 33, true, -32, true),
    ("subframe 2", "eccentricity", 170, 33, false, -34, false),
    ("subframe 2", "omega_rad", 203, 33, true, -32, true),
    ("subframe 2", "omega0_rad", 236, 33, true, -32, true),
    ("subframe 2", "omega_dot_radps", 269, 25, true, -44, true),
    ("subframe 2", "i0_rad", 294, 33, true, -32, true),
    ("subframe 2", "idot_radps", 327, 15, true, -44, true),
    ("subframe 2", "cis_rad", 342, 16, true, -30, false),
    ("subframe 2", "cic_rad", 358, 16, true, -30, false),
    ("subframe 2", "crs_m", 374, 24, true, -8, false),
    ("subframe 2", "crc_m", 398, 24, true, -8, false),
    ("subframe 2", "cus_rad", 422, 21, true, -30, false),
    ("subframe 2", "cuc_rad", 443, 21, true, -30, false),
    ("subframe 2", "af0_s", 464, 29, true, -35, false),
    ("subframe 2", "af1_sps", 493, 22, true, -50, false),
    ("subframe 2", "af2_sps2", 515, 15, true, -66, false),
    ("subframe 2", "tgd_s", 530, 12, true, -35, false),
    ("subframe 2", "isc_first_s", 542, 12, true, -35, false),
    ("subframe 2", "isc_second_s", 554, 12, true, -35, false),
    ("subframe 2", "reference_flag", 566, 1, false, 0, false),
    ("subframe 2", "prn", 570, 6, false, 0, false),
    ("subframe 3, message 10", "message_type", 0, 6, false, 0, false),
    ("subframe 3, message 10", "message_invalid", 6, 1, false, 0, false),
    ("subframe 3, message 10", "alpha_0", 145, 8, true, -30, false),
    ("subframe 3, message 10", "alpha_1", 153, 8, true, -27, false),
    ("subframe 3, message 10", "alpha_2", 161, 10, true, -24, false),
    ("subframe 3, message 10", "alpha_3", 171, 12, true, -24, false),
    ("subframe 3, message 10", "beta_0", 183, 8, true, 11, false),
    ("subframe 3, message 10", "beta_1", 191, 8, true, 14, false),
    ("subframe 3, message 10", "beta_2", 199, 11, true, 16, false),
    ("subframe 3, message 10", "beta_3", 210, 14, true, 16, false),
    ("subframe 3, message 10", "region_east_5deg", 224, 6, false, 0, false),
    ("subframe 3, message 10", "region_west_5deg", 230, 6, false, 0, false),
    ("subframe 3, message 10", "region_north_5deg", 236, 5, true, 0, false),
    ("subframe 3, message 10", "region_south_5deg", 241, 5, true, 0, false),
    ("subframe 3, message 10", "iodk", 246, 2, false, 0, false),
];

#[test]
fn every_field_of_navic_s_message_on_l1_has_the_place_sign_and_scale_that_decoders_have() {
    fields_are_as_printed(&l1nav::tables(), &PRINTED, 600);
    // What no field has: three bits before the number; the Earth's orientation and two bits at the end.
    let of = |table: &str| PRINTED.iter().filter(|row| row.0 == table).map(|row| usize::from(row.3)).sum::<usize>();
    assert_eq!((of("subframe 2"), of("subframe 3, message 10")), (576 - 3, 250 - 138 - 2));
}

/// Record of NVS-01 as printed in RINEX 4.02, tables A32 and A41.
const RECORD: &str = "\
I10 2023 06 24 00 05 00 1.527369022369e-07 1.364242052659e-12 0.000000000000e+00
     0.000000000000e+00-2.593125000000e+02 7.028864208979e-09 2.300305834983e+00
    -8.691102266312e-06 4.531537415460e-04-3.855675458908e-06 6.493495117188e+03
     7.000000000000e+00 1.341104507446e-07 1.359342162629e-01-7.078051567078e-08
     8.594830530333e-02 1.214375000000e+02-5.136403830694e-02-5.858815471753e-09
    -4.846630453041e-10 0.000000000000e+00                    1.000000000000e+00
     1.500000000000e+01 0.000000000000e+00                   -3.608874976635e-09
                                           6.984919309616e-09 5.995389074087e-09
     5.191380000000e+05
";
const IONOSPHERE: &str = "     5.867332220078e-08 2.533197402954e-07-1.430511474609e-06-7.510185241699e-06
     1.495040000000e+05-5.406720000000e+05 2.883584000000e+06 8.323072000000e+06
     5.000000000000e+01 1.100000000000e+02 0.000000000000e+00 5.000000000000e+01
";

/// The set of the record, and the coefficients.
fn printed() -> (Ephemeris, Klobuchar) {
    let number = |text: &str| text.trim().parse::<f64>().unwrap();
    let lines: Vec<String> = RECORD.lines().map(|line| format!("{line:80}")).collect();
    // The third line begins with the issue and the fifth has no week: as those of the older message.
    let mut rows = lines.clone();
    rows[3].replace_range(4..23, " 5.187000000000e+05");
    rows[5].replace_range(42..61, " 2.267000000000e+03");
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let (set, v) = keplerian(&rows);
    let set = Ephemeris {
        form: &l1nav::L1_NAV_SETS,
        iode: number(&lines[3][4..23]) as u16,
        iodc: number(&lines[3][4..23]) as u16,
        axis_rate_mps: v(1, 0),
        ura_index: v(6, 0) as u8,
        reference_flag: v(5, 3) as u8,
        tgd_s: v(6, 3),
        isc_s: [0.0, 0.0, 0.0, 0.0, v(7, 2), v(7, 3)],
        transmitted: Epoch::from_week(2267, v(8, 0)),
        ..set
    };
    let four = |line: usize| {
        let line = IONOSPHERE.lines().nth(line).unwrap();
        [0, 1, 2, 3].map(|at| number(&line[4 + 19 * at..23 + 19 * at]))
    };
    (set, Klobuchar { alpha: four(0), beta: four(1) })
}

fn soft(symbols: &[bool], inverted: bool) -> Vec<f32> {
    symbols.iter().map(|&one| if one ^ inverted { -1.0 } else { 1.0 }).collect()
}

#[test]
fn a_real_set_is_whole_steps_of_the_fields_stands_over_its_place_and_is_written_as_rinex_prints_it() {
    let (set, klobuchar) = printed();
    // NVS-01 stands over 129.5° East and has an inclination of some degrees.
    let place = Geodetic::from_ecef(&set.state(set.toe).unwrap().position_m);
    assert!((place.longitude_rad.to_degrees() - 129.5).abs() < 0.2, "{place:?}");
    let quantised = l1nav::L1_NAV.fields.quantised(&set).unwrap();
    // All of it fits: to the thirteen digits printed. The axis was printed from a number of 24 bits.
    let axis_m = |set: &Ephemeris| set.sqrt_a_sqrtm * set.sqrt_a_sqrtm;
    assert!((axis_m(&quantised) - axis_m(&set)).abs() <= 0.5 / 512.0);
    let near = |found: f64, printed: f64| (found - printed).abs() <= 0.6e-12 * printed.abs();
    for (found, printed) in [
        (quantised.af0_s, set.af0_s),
        (quantised.af1_sps, set.af1_sps),
        (quantised.crs_m, set.crs_m),
        (quantised.crc_m, set.crc_m),
        (quantised.delta_n_radps, set.delta_n_radps),
        (quantised.m0_rad, set.m0_rad),
        (quantised.cuc_rad, set.cuc_rad),
        (quantised.cus_rad, set.cus_rad),
        (quantised.cic_rad, set.cic_rad),
        (quantised.cis_rad, set.cis_rad),
        (quantised.eccentricity, set.eccentricity),
        (quantised.omega0_rad, set.omega0_rad),
        (quantised.omega_rad, set.omega_rad),
        (quantised.omega_dot_radps, set.omega_dot_radps),
        (quantised.i0_rad, set.i0_rad),
        (quantised.idot_radps, set.idot_radps),
        (quantised.tgd_s, set.tgd_s),
        (quantised.isc_s[4], set.isc_s[4]),
        (quantised.isc_s[5], set.isc_s[5]),
    ] {
        assert!(near(found, printed), "{found} {printed}");
    }
    // Sent when the record says, read, and written: the record again.
    assert_eq!(set.transmitted.tow_whole_s() % 18, 0);
    let common = Common { klobuchar_navic: Some(klobuchar), ..Common::default() };
    let symbols = (L1_NAV.sender)(&common).unwrap().unit(&set, set.transmitted).unwrap();
    let mut reader = (L1_NAV.reader)(NVS_01);
    let mut sets = NavigationSets::default();
    for read in soft(&symbols, false).into_iter().flat_map(|one| reader.take(one, set.transmitted)) {
        if let Read::Parameters(rows) = read {
            rows.iter().for_each(|row| sets.take(row));
        }
    }
    let mut written = Vec::new();
    sets.write(&mut written, Version::Four, &[&L1], set.transmitted).unwrap();
    let written = String::from_utf8(written).unwrap().replace('E', "e");
    let body = |head: &str| written.split_once(head).unwrap_or_else(|| panic!("{written}")).1;
    let (mut same, mut differ) = (0, Vec::new());
    let ours = body("> ePH I10 L1NV\n").lines().chain(body("> ION I10 L1NV KLOB\n").lines().skip(1));
    let theirs = RECORD.lines().chain(IONOSPHERE.lines());
    for (ours, theirs) in ours.zip(theirs) {
        let fields = |line: &str| line.as_bytes()[4..].chunks(19).map(<[u8]>::to_vec).collect::<Vec<_>>();
        if ours[..4] == theirs[..4] {
            let (ours, theirs) = (fields(ours), fields(theirs));
            let pairs = ours.iter().zip(&theirs).filter(|(one, other)| one != other);
            differ.extend(pairs.map(|(one, other)| {
                let text = |field: &[u8]| String::from_utf8_lossy(field).into_owned();
                (text(one), text(other))
            }));
            same += theirs.len();
        }
    }
    // The axis, and of the time of sending, that of the set's first frame, nothing else.
    assert_eq!(differ.len(), 1, "{differ:?}\n{written}");
    assert!(differ[0].1.contains("6.493495117188"), "{differ:?}");
    assert!(same > 40, "{same}\n{written}");
}

#[test]
fn frames_are_counted_to_their_end_from_1_to_400_in_the_two_hours_in_which_they_begin() {
    let (set, _) = printed();
    let sender = (L1_NAV.sender)(&Common::default()).unwrap();
    for (of_week_s, interval, time) in [(0, 0, 1), (18, 0, 2), (7182, 0, 400), (7200, 1, 1), (604_782, 83, 400)] {
        let start = Epoch::from_week(2267, f64::from(of_week_s));
        let symbols = sender.unit(&set, start).unwrap();
        assert_eq!(symbols.len(), 1800);
        let frame = l1nav::decode(&soft(&symbols, false)).unwrap();
        let two = &frame.0.two;
        assert_eq!((frame.0.time, number(&two[13..21]), number(&two[..13])), (time, interval, 2267 - 1024));
        assert_eq!((frame.of_week_s(), frame.sent_at(start)), (i64::from(of_week_s), start));
        assert_eq!(number(&two[570..576]), 10);
        // Without coefficients message type 0.
        let three = frame.0.three.unwrap();
        assert_eq!((number(&three[..7]), crc24q(two.iter().copied()), crc24q(three.iter().copied())), (0, 0, 0));
        // Nine bits of time are the first symbols; the 1748 behind 52 are written in 38 rows of 46.
        assert_eq!(number(&symbols[..9]), u128::from(time));
        let coded: Vec<bool> = (0..1748).map(|m| symbols[52 + m % 46 * 38 + m / 46]).collect();
        assert_eq!((&coded[..600], &coded[1200..1474]), (&two[..], &three[..]));
    }
    assert!(sender.unit(&set, Epoch::from_week(2267, 9.0)).is_err());
}

#[test]
fn a_stream_is_read_from_any_symbol_inverted_or_not_to_what_was_sent() {
    let (set, klobuchar) = printed();
    let common = Common { klobuchar_navic: Some(klobuchar), ..Common::default() };
    let sender = (L1_NAV.sender)(&common).unwrap();
    let start = Epoch::from_week(2267, 518_400.0);
    let units = (0..3).flat_map(|k| sender.unit(&set, start.plus_s(18.0 * f64::from(k))).unwrap());
    let symbols: Vec<bool> = units.collect();
    for (skipped, inverted) in [(0, false), (137, true), (1799, false), (1, true)] {
        let mut reader = (L1_NAV.reader)(NVS_01);
        let mut seen = BTreeMap::new();
        for (index, one) in symbols.iter().enumerate().skip(skipped) {
            for read in reader.take(if *one == inverted { 1.0 } else { -1.0 }, start) {
                match read {
                    Read::Unit { symbols: 1800, of_week_s, inverted: way } => {
                        assert_eq!(way, inverted);
                        assert_eq!(of_week_s, start.tow_whole_s() + 18 * (index as i64 / 1800));
                        *seen.entry("unit").or_insert(0) += 1;
                    }
                    Read::Ephemeris(found) => {
                        let sent = l1nav::L1_NAV.fields.quantised(&set).unwrap();
                        assert_eq!(*found, Ephemeris { transmitted: found.transmitted, ..sent });
                        *seen.entry("set").or_insert(0) += 1;
                    }
                    Read::Ionosphere(Coefficients::KlobucharNavic(found)) => {
                        let differ = found.beta.iter().zip(klobuchar.beta).any(|(one, other)| *one != other);
                        assert!(!differ, "{found:?}");
                        *seen.entry("ionosphere").or_insert(0) += 1;
                    }
                    _ => {}
                }
            }
        }
        let units = 3 - i32::from(skipped > 0);
        let whole = [("ionosphere", units), ("set", 1), ("unit", units)];
        assert_eq!(seen.into_iter().collect::<Vec<_>>(), whole, "{skipped}");
        assert!(reader.missing().is_empty());
    }
    // Frames of another satellite say nothing.
    let mut other = (L1_NAV.reader)(Sv { system: System::Navic, number: 3 });
    let is_refused = |read: &Read| matches!(read, Read::Refused(_));
    assert!(soft(&symbols, false).into_iter().all(|one| other.take(one, start).iter().all(is_refused)));
}

#[test]
fn a_set_of_the_older_message_carried_to_l1_nav_is_the_same_orbit_and_clock_to_its_steps() {
    let bytes = include_bytes!("../../scenarios/navic_2026-03-09_10h_12h.rnx");
    let sets = rinex::read(bytes, "navic").unwrap().ephemerides;
    let mut compared = 0;
    for set in sets.iter().filter(|set| set.sv == NVS_01) {
        let carried = l1nav::L1_NAV.fields.quantised(set).unwrap();
        assert_eq!((carried.toe.tow_whole_s() % 300, carried.toe), (0, carried.toc));
        assert!(carried.toe.since(set.toe).abs() <= 150.0);
        for minutes in [-15, 0, 20] {
            let at = set.toe.plus_s(60.0 * f64::from(minutes));
            let apart_m = (carried.state(at).unwrap().position_m - set.state(at).unwrap().position_m).norm();
            // Half a step of 2⁻³² semicircles is 15 mm at 42 000 km for each of four angles; harmonics of
            // 2⁻³⁰ add 20 mm for each of four, and what they change in 150 s, as they stay, nothing.
            assert!(apart_m < 0.1, "{} {minutes}: {apart_m}", set.toe);
            for signal in [&L1, &L5, &S] {
                let clock_s = |set: &Ephemeris| set.clock_of_signal(at, signal).unwrap().offset_s;
                // Half a step of 2⁻³⁵ s each of clock, delay and correction; L5 has 4.5 times the delay.
                let apart_s = clock_s(&carried) - clock_s(set);
                assert!(apart_s.abs() < 4.0 * libm::exp2(-35.0), "{} {signal}: {apart_s:e}", set.toe);
            }
        }
        compared += 1;
    }
    assert_eq!(compared, 9);
}

#[test]
fn a_clock_of_l1_and_l5_serves_all_three_carriers_too() {
    // The flag 0: T_GD of L1 against L5, corrections of S and of L1's data against L1's pilot.
    let (set, _) = printed();
    let of = |set: &Ephemeris| [&L1, &L5, &S].map(|signal| set.group_delay_s(signal));
    let squared = |one: f64| one * one;
    let are = |set: &Ephemeris, expected: [f64; 3]| {
        let pairs = of(set).into_iter().zip(expected);
        pairs.for_each(|(found, expected)| assert!((found / expected - 1.0).abs() < 1e-14, "{found} {expected}"));
    };
    are(&set, [set.tgd_s - set.isc_s[4], set.tgd_s * squared(2_492.028 / 1_176.45), set.tgd_s]);
    let own = Ephemeris { reference_flag: 0, ..set.clone() };
    are(&own, [set.tgd_s, set.tgd_s * squared(1_575.42 / 1_176.45), set.tgd_s - set.isc_s[4]]);
    // It is sent and read as such.
    let symbols = (L1_NAV.sender)(&Common::default()).unwrap().unit(&own, own.transmitted).unwrap();
    let frame = l1nav::decode(&soft(&symbols, true)).unwrap();
    assert!(frame.0.inverted);
    assert_eq!(frame.0.two.piece((566, 1)), 0);
    assert_eq!(l1nav::L1_NAV.fields.quantised(&own).unwrap().reference_flag, 0);
}
