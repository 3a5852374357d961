//! B-CNAV1 and B1C against codes of another program and the subframes of a satellite that a receiver's maker
//! prints.

use gnss::bdgim::Bdgim;
use gnss::beidou::b1c::{self, Code};
use gnss::beidou::bcnav1::{self, B_CNAV1, Frame};
use gnss::bits::{bits_of, number};
use gnss::broadcast::Ephemeris;
use gnss::crc::crc24q;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::fec::ldpc64::product;
use gnss::message::{Common, Read};
use gnss::satellite::{Sv, System};
use gnss::time::{BDT, BDT_WEEK, Epoch};
use gnss::{inflate, rinex};

use super::codes::holds;
use super::data::external;

/// Code, number, ones, first and last 24 chips in hexadecimal, SHA-256 of a byte 0 or 1 for each chip.
const CODES: &str = include_str!("../../data/witness/b1c_codes.csv");

#[test]
fn all_chips_of_all_codes_and_secondary_codes_of_b1c_are_those_of_another_program() {
    let mut codes = 0;
    for line in CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let number = column[1].parse().unwrap();
        let signs = match column[0] {
            "B1CD" => b1c::code(Code::Data, number),
            "B1CP" => b1c::code(Code::Pilot, number),
            _ => b1c::secondary_code(number),
        };
        let chips: Vec<u8> = signs.unwrap().into_iter().map(|sign| u8::from(sign < 0)).collect();
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 189);
    assert!(
        [0, 64].iter().all(|number| b1c::code(Code::Data, *number).is_none() && b1c::secondary_code(*number).is_none())
    );
}

pub fn soft(symbols: &[bool], inverted: bool) -> impl Iterator<Item = f32> {
    symbols.iter().map(move |&one| if one ^ inverted { -1.0 } else { 1.0 })
}

/// Sets of satellites of the third generation in the embedded file.
pub fn sets() -> Vec<Ephemeris> {
    let all = rinex::embedded_two_systems().unwrap().ephemerides;
    let mut own: Vec<Ephemeris> = all.into_iter().filter(|set| b1c::sent(set.sv.number, set.toe)).collect();
    own.retain(|set| set.sv.system == System::BeiDou);
    own
}

#[test]
fn frames_are_read_from_any_symbol_inverted_or_not_to_what_was_sent() {
    let sets = sets();
    let set = sets.iter().find(|set| set.sv.number > 20).unwrap();
    let sender = (B_CNAV1.sender)(&Common::default()).unwrap();
    let carried = (B_CNAV1.form)(set).timed(|at| BDT.label(at));
    // Over the end of an hour.
    let begin = Epoch::new(carried.toe.seconds() + 3600 - 36, 0.0);
    let stream: Vec<bool> =
        (0..4).flat_map(|k| sender.unit(&carried, begin.plus_s(18.0 * f64::from(k))).unwrap()).collect();
    for (first, inverted) in [(0, false), (1, true), (700, false), (1799, true)] {
        let mut reader = (B_CNAV1.reader)(set.sv);
        let mut news = Vec::new();
        for (place, one) in (first..).zip(soft(&stream[first..], inverted)) {
            for read in reader.take(one, begin) {
                if let Read::Unit { symbols, of_week_s, inverted: found } = read {
                    assert_eq!((symbols, found, (place + 1) % 1800), (1800, inverted, 0));
                    let start = begin.plus_s(18.0 * (place / 1800) as f64);
                    assert_eq!(of_week_s, start.tow_whole_s());
                }
                news.push(read);
            }
        }
        let read = news.iter().find_map(|read| if let Read::Ephemeris(set) = read { Some(&**set) } else { None });
        let expected = B_CNAV1.fields.quantised(set).unwrap().timed(|at| BDT.label(at));
        assert_eq!(*read.unwrap(), Ephemeris { transmitted: read.unwrap().transmitted, ..expected });
    }
    // Of another satellite nothing is read.
    let mut other = (B_CNAV1.reader)(Sv { number: set.sv.number + 1, ..set.sv });
    assert!(soft(&stream, false).all(|one| other.take(one, begin).is_empty()));
}

#[test]
fn a_set_of_d1_carried_to_b_cnav1_is_the_same_orbit_and_clock_to_its_steps() {
    let (mut farthest_m, mut latest_m) = (0.0_f64, 0.0_f64);
    let sets = sets();
    for set in &sets {
        let carried = B_CNAV1.fields.quantised(set).unwrap();
        assert_eq!(BDT.label(carried.toe).seconds() % 300, 0);
        for minutes in [-60, 0, 33, 120, 240] {
            let at = set.toe.plus_s(60.0 * f64::from(minutes));
            let apart = carried.state(at).unwrap().position_m - set.state(at).unwrap().position_m;
            farthest_m = farthest_m.max(apart.norm());
            let clock_s = |set: &Ephemeris| set.clock_of_signal(at, &b1c::B1C).unwrap().offset_s;
            latest_m = latest_m.max(SPEED_OF_LIGHT_MPS * (clock_s(&carried) - clock_s(set)).abs());
        }
    }
    println!("{} sets: orbits {farthest_m:.4} m apart, clocks {latest_m:.4} m", sets.len());
    // Angles to half of 2⁻³² semicircles are 0.0102 m each at 27 900 km (0.0154 m at 42 160 km): mean
    // anomaly, perigee and node along the track, node and inclination across it; mean motion and the node's
    // rate to half of 2⁻⁴⁴ semicircles a second are 0.036 m (0.054 m) each after four hours. The clock is
    // rounded to half of 2⁻³⁴ s and of 2⁻⁵⁰ (8.7 mm and, after four hours, 1.9 mm), its delay to half of 2⁻³⁴
    // s.
    assert!(sets.len() >= 4 && farthest_m < 0.2 && latest_m < 0.0195, "{farthest_m} {latest_m}");
}

/// The columns of a file of what a maker's receiver printed.
pub fn printed_rows(text: &str) -> Vec<Vec<String>> {
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// Bits of hexadecimal digits, `count` of them.
pub fn hex_bits(hex: &str, count: usize) -> Vec<bool> {
    let digits = hex.chars().map(|digit| digit.to_digit(16).unwrap());
    digits.flat_map(|digit| (0..4).rev().map(move |bit| digit >> bit & 1 == 1)).take(count).collect()
}

/// Compares values that the maker's receiver decoded of a satellite with the bits of its subframes.
#[test]
fn subframes_that_a_receiver_printed_are_what_it_decoded_and_are_sent_by_us_bit_by_bit() {
    let Some(path) = external("navbits/receiver_manual_examples.csv") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let rows = printed_rows(&text);
    let row = |kind: &str, prn: &str| -> Vec<String> {
        rows.iter().find(|row| row[0] == kind && (row.get(3).is_some_and(|own| own == prn))).unwrap().clone()
    };
    let [first, two, three] = [("BCNAV1_SF1", 14), ("BCNAV1_SF2", 576), ("BCNAV1_SF3", 240)]
        .map(|(kind, count)| hex_bits(&row(kind, "35")[5], count));
    let whole = |mut bits: Vec<bool>| {
        let check = crc24q(bits.iter().copied());
        bits.extend(bits_of(u128::from(check), 24));
        bits
    };
    assert_eq!(number(&first[..6]), 35);
    let time = number(&first[6..14]) as u32;
    let symbols = bcnav1::encoded(35, time, &whole(two.clone()), &whole(three.clone()));
    let frame: Frame = bcnav1::decode(35, &soft(&symbols, false).collect::<Vec<f32>>()).unwrap();
    assert!(frame.0.two[..576] == two && frame.0.three.as_ref().unwrap()[..240] == three);
    let sv = Sv { system: System::BeiDou, number: 35 };
    let near = BDT.label(Epoch::from_week(2209, row("BCNAV1_SF2", "35")[2].parse().unwrap()));
    // The receiver writes a subframe down when the frame has ended.
    let late_s = near.since(frame.sent_at(near));
    assert!((0.0..60.0).contains(&late_s), "{late_s}");
    let mut reader = (B_CNAV1.reader)(sv);
    let news: Vec<Read> = soft(&symbols, false).flat_map(|one| reader.take(one, near)).collect();
    let set = news.iter().find_map(|read| if let Read::Ephemeris(set) = read { Some(&**set) } else { None }).unwrap();
    let words: Vec<String> = row("EPH", "35")[5].split_whitespace().map(str::to_owned).collect();
    let printed: Vec<f64> = words.iter().map(|word| word.parse().unwrap()).collect();
    let axis_m = set.sqrt_a_sqrtm * set.sqrt_a_sqrtm - 27_906_100.0;
    // To one of the last digit that is printed: the maker's receiver cuts one of them.
    let close = |name: &str, own: f64, place: usize| {
        let (mantissa, exponent) = words[place].split_once('e').unwrap_or((&words[place], "0"));
        let digits = mantissa.split_once('.').map_or(0, |(_, behind)| behind.len()) as i32;
        let last = libm::pow(10.0, f64::from(exponent.parse::<i32>().unwrap() - digits));
        assert!((own - printed[place]).abs() <= 1.01 * last, "{name}: {own} {}", words[place]);
    };
    assert_eq!((set.toe.tow_s(), set.toc.tow_s(), printed[2]), (printed[1], printed[20], 3.0));
    for (name, own, place) in [
        ("delta a", axis_m, 3),
        ("a rate", set.axis_rate_mps, 4),
        ("delta n", set.delta_n_radps, 5),
        ("delta n rate", set.delta_n_rate_radps2, 6),
        ("m0", set.m0_rad, 7),
        ("e", set.eccentricity, 8),
        ("omega", set.omega_rad, 9),
        ("omega0", set.omega0_rad, 10),
        ("i0", set.i0_rad, 11),
        ("omega dot", set.omega_dot_radps, 12),
        ("idot", set.idot_radps, 13),
        ("cis", set.cis_rad, 14),
        ("cic", set.cic_rad, 15),
        ("crs", set.crs_m, 16),
        ("crc", set.crc_m, 17),
        ("cus", set.cus_rad, 18),
        ("cuc", set.cuc_rad, 19),
        ("af0", set.af0_s, 21),
        ("af1", set.af1_sps, 22),
        ("af2", set.af2_sps2, 23),
    ] {
        close(name, own, place);
    }
    let sender = (B_CNAV1.sender)(&Common::default()).unwrap();
    let ours = sender.unit(set, frame.sent_at(near)).unwrap();
    let ours = bcnav1::decode(35, &soft(&ours, false).collect::<Vec<f32>>()).unwrap();
    assert_eq!(ours.0.time, frame.0.time);
    // All but what is reserved.
    let differ: Vec<usize> = (0..569).filter(|place| ours.0.two[*place] != two[*place]).collect();
    assert!(differ.is_empty(), "{differ:?}");
}

#[test]
fn elements_of_six_bits_are_those_of_the_printed_field() {
    // BDS-SIS-ICD-B1C 1.0, 6.2.2.1: x⁶ = x + 1, so that the powers of x are 1, 2, 4, 8, 16, 32, 3, 6, 12, 24,
    // 48, 35.
    let mut power = 1;
    for expected in [1, 2, 4, 8, 16, 32, 3, 6, 12, 24, 48, 35] {
        assert_eq!(power, expected);
        power = product(power, 2);
    }
}

/// Satellites with records of CNV1 in two merged files, and with observations of the pilot at a station.
#[test]
fn satellites_that_send_b1c_are_those_that_broadcast_b_cnav1() {
    for (name, date, missing) in [
        ("nav/BRD400DLR_S_20230710000_01D_MN.rnx.gz", "2023-03-12T12:00:00", None),
        // Of C46 the day has no record of CNV1, but some of the other two.
        ("multi-gnss/BRD400DLR_S_20260680000_01D_MN.rnx.gz", "2026-03-09T12:00:00", Some(46)),
    ] {
        let Some(path) = external(name) else { return };
        let text = inflate::inflate(&std::fs::read(path).unwrap(), 1 << 28).unwrap();
        let text = String::from_utf8_lossy(&text).into_owned();
        let heads = text.lines().filter(|line| line.starts_with("> EPH C") && line.ends_with("CNV1"));
        let mut senders: Vec<u8> = heads.map(|line| line[7..9].parse().unwrap()).chain(missing).collect();
        senders.sort_unstable();
        senders.dedup();
        let at = Epoch::parse(date).unwrap();
        assert_eq!(senders, (1..=63).filter(|number| b1c::sent(*number, at)).collect::<Vec<u8>>(), "{name}");
    }
    // C1P of the station CARD that day.
    let at = Epoch::parse("2020-11-29T12:40:00").unwrap();
    assert!([21, 22, 26, 36].iter().all(|number| b1c::sent(*number, at)));
    assert!(![5, 7, 10, 11, 14].iter().any(|number| b1c::sent(*number, at)));
}

/// The values of a field of a page, one for each satellite in it.
fn values(page: u128, name: &str, three: &Vec<bool>) -> Vec<f64> {
    let table = format!("subframe 3, page {page}");
    let (_, fields) = bcnav1::tables().into_iter().find(|(own, _)| *own == table).unwrap();
    fields.into_iter().filter(|field| field.name == name).map(|field| field.value(field.read(three))).collect()
}

/// Position of a satellite in metres, from radius, argument of latitude, inclination, and node against
/// Greenwich.
fn placed_m([radius_m, latitude, inclination, node]: [f64; 4]) -> [f64; 3] {
    let [latitude, inclination, node] = [latitude, inclination, node].map(libm::sincos);
    let (x, y) = (radius_m * latitude.1, radius_m * latitude.0);
    let level = y * inclination.1;
    [x * node.1 - level * node.0, x * node.0 + level * node.1, y * inclination.0]
}

#[test]
fn pages_take_turns_and_almanacs_are_near_the_orbits_of_their_satellites() {
    const ROTATION_RADPS: f64 = 7.292_115e-5;
    let mut almanac = rinex::embedded_two_systems().unwrap().ephemerides;
    almanac.retain(|set| set.sv.system == System::BeiDou);
    almanac.sort_by_key(|set| set.sv);
    almanac.dedup_by_key(|set| set.sv);
    let set = almanac.iter().find(|set| b1c::sent(set.sv.number, set.toe)).unwrap();
    let carried = (B_CNAV1.form)(set).timed(|at| BDT.label(at));
    let begin = Epoch::new(carried.toe.seconds().div_euclid(36) * 36, 0.0);
    let (count, places) = (almanac.len(), almanac.len().div_ceil(4));
    let pages = |bdgim: Option<Bdgim>, frames: usize| -> Vec<Vec<bool>> {
        let common = Common { bdgim, almanac: almanac.clone(), reference: Some(set.toe), ..Common::default() };
        let sender = (B_CNAV1.sender)(&common).unwrap();
        let unit = |frame: usize| sender.unit(&carried, begin.plus_s(18.0 * frame as f64)).unwrap();
        let three = |symbols: Vec<bool>| {
            bcnav1::decode(carried.sv.number, &soft(&symbols, false).collect::<Vec<f32>>()).unwrap().0.three.unwrap()
        };
        (0..frames).map(|frame| three(unit(frame))).collect()
    };
    let page = |three: &Vec<bool>| number(&three[..6]);
    // With the ionosphere every other frame is page 1, the others are a round of all satellites.
    let electrons = Some(Bdgim { alpha_tecu: [20.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0] });
    let all = pages(electrons, 2 * (count + places));
    assert!(all.iter().skip(1).step_by(2).all(|three| page(three) == 1));
    let others: Vec<&Vec<bool>> = all.iter().step_by(2).collect();
    assert_eq!(others.iter().filter(|three| page(three) == 2).count(), places);
    assert_eq!(others.iter().filter(|three| page(three) == 4).count(), count);
    // Without it these take all frames.
    assert!(pages(None, count + places).iter().all(|three| [2, 4].contains(&page(three))));
    let mut seen = 0;
    for three in others {
        let page = page(three);
        let of = |name: &str| values(page, name, three);
        let (week, toa_s) = (of("almanac_week")[0], 4096.0 * of("toa_4096s")[0]);
        let toa = Epoch::from_week((week as i64 + BDT_WEEK) as u32, toa_s);
        for (place, prn) in of("almanac_prn").into_iter().enumerate().filter(|(_, prn)| *prn > 0.0) {
            let one = |name: &str| of(name)[place];
            let own = almanac.iter().find(|set| f64::from(set.sv.number) == prn).unwrap();
            let is_medium = one("almanac_orbit_kind") == 3.0;
            assert_eq!(is_medium, own.sv.orbit_m() < 35e6);
            let is_geo = one("almanac_orbit_kind") == 1.0;
            let semicircles = if is_geo { 0.0 } else { 0.3 };
            // The node counts from Greenwich at the beginning of the week of BDT.
            let node = one("almanac_omega0_rad") - ROTATION_RADPS * toa_s;
            let (elements, bound_m) = if page == 4 {
                let (e, m) = (one("almanac_eccentricity"), one("almanac_m0_rad"));
                let anomaly = (0..20).fold(m, |anomaly, _| m + e * libm::sin(anomaly));
                let axis_m = one("almanac_sqrt_a_sqrtm").powi(2);
                let truth = libm::atan2((1.0 - e * e).sqrt() * libm::sin(anomaly), libm::cos(anomaly) - e);
                let inclination = semicircles * std::f64::consts::PI + one("almanac_delta_i_rad");
                let elements =
                    [axis_m * (1.0 - e * libm::cos(anomaly)), truth + one("almanac_omega_rad"), inclination, node];
                // Angles to half of 2⁻¹⁵ semicircles are 2 km each at 42 000 km, and harmonics are left out.
                (elements, 15e3)
            } else {
                let axis_m = if is_medium { 27_906_100.0 } else { 42_162_200.0 } + one("almanac_delta_a_m");
                let inclination: f64 = if is_geo { 0.0 } else { 55_f64.to_radians() };
                // Half of 2⁻⁶ semicircles are 1.0e6 m each at 42 000 km. The eccentricity is left out, up to
                // 0.01 (twice of it in the anomaly), and the inclination is off by some 2.5°.
                ([axis_m, one("almanac_phi0_rad"), inclination, node], 4.2e6)
            };
            let at = BDT.instant(toa);
            // As the message has it: geostationary orbits without their tilt of 5° against the equator.
            let Some(true_m) = (!is_geo).then(|| own.state(at).unwrap().position_m) else { continue };
            let placed = placed_m(elements);
            let apart_m = (0..3).map(|axis| (placed[axis] - true_m[axis]).powi(2)).sum::<f64>().sqrt();
            assert!(apart_m < bound_m, "page {page} C{prn}: {apart_m}");
            seen += 1;
        }
    }
    assert!(seen >= 30, "{seen}");
}
