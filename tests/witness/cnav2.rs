//! CNAV-2 against real frames, before the interleaver, and the RINEX records of the same hour.

use std::collections::BTreeMap;

use gnss::bits::{Field, number};
use gnss::broadcast::Ephemeris;
use gnss::crc::crc24q;
use gnss::gps::cnav2::{self, CNAV2, Frame};
use gnss::inflate;
use gnss::message::{Common, Message, Read};
use gnss::qzss::civil;
use gnss::rinex;
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;

use super::cnav::{agrees_in_orbit_and_clock, records};
use super::data::external;

/// Eight frames of QZSS satellites, which send the same message, 2024-10-31 and 2025-08-21: of each satellite
/// page 1 and the frame after it, and of two the last frame of two hours.
const FRAMES: &str = include_str!("../../data/witness/cnav2_frames.csv");

/// A frame on the air: the satellite, when it began, and its 1800 symbols before the interleaver.
struct Sent {
    sv: Sv,
    start: Epoch,
    symbols: Vec<bool>,
}

fn bits(hex: &str, count: usize) -> Vec<bool> {
    let digits = hex.chars().map(|digit| digit.to_digit(16).unwrap());
    digits.flat_map(|digit| (0..4).rev().map(move |bit| digit >> bit & 1 == 1)).take(count).collect()
}

/// A frame, from the number of the code, the week and the second at which the frame ends.
fn sent(prn: u8, [week, end_s]: [&str; 2], hex: &str) -> Sent {
    let start = Epoch::from_week(week.parse().unwrap(), end_s.parse::<f64>().unwrap() - 18.0);
    Sent { sv: Sv { system: System::Qzss, number: prn - 192 }, start, symbols: bits(hex, 1800) }
}

fn shipped() -> Vec<Sent> {
    let parse = |line: &str| {
        let column: Vec<&str> = line.split(',').collect();
        sent(column[0].parse().unwrap(), [column[1], column[2]], column[3])
    };
    FRAMES.lines().skip(1).map(parse).collect()
}

fn real(name: &str) -> Option<Vec<Sent>> {
    let packed = std::fs::read(external(name)?).unwrap();
    let text = String::from_utf8(inflate::inflate(&packed, 1 << 26).unwrap()).unwrap();
    let rows = text.lines().filter(|line| line.starts_with('2'));
    let mut all: Vec<Sent> = rows
        .map(|line| line.split(',').collect::<Vec<&str>>())
        .map(|column| sent(192 + column[3].parse::<u8>().unwrap(), [column[0], column[1]], column[5]))
        .collect();
    all.sort_by_key(|sent| (sent.sv, sent.start.seconds()));
    Some(all)
}

fn soft(symbols: &[bool], inverted: bool) -> Vec<f32> {
    symbols.iter().map(|&one| if one ^ inverted { -1.0 } else { 1.0 }).collect()
}

/// Times, checks, and that its information is coded again to all 1800 symbols.
fn holds(sent: &Sent) -> Frame {
    let frame = cnav2::decode(&soft(&cnav2::interleaved(&sent.symbols), false)).unwrap();
    assert!(!frame.0.inverted);
    assert_eq!(frame.sent_at(sent.start), sent.start, "{} {}", sent.sv, sent.start);
    let three = frame.0.three.as_ref().unwrap();
    assert_eq!(number(&three[..8]), 192 + u128::from(sent.sv.number));
    assert!(cnav2::coded(frame.0.time, &frame.0.two, three) == sent.symbols, "{} {}", sent.sv, sent.start);
    frame
}

fn message(sv: Sv) -> &'static Message {
    if sv.system == System::Qzss { &civil::CNAV2 } else { &CNAV2 }
}

/// Content that a reader finds in a satellite's frames.
fn read(all: &[&Sent], inverted: bool) -> Vec<Read> {
    let mut reader = (message(all[0].sv).reader)(all[0].sv);
    let mut news = Vec::new();
    let mut next = all[0].start;
    // Some symbols of the frame before.
    news.extend(soft(&all[0].symbols[1000..1700], inverted).into_iter().flat_map(|one| reader.take(one, next)));
    for sent in all {
        if sent.start != next {
            reader.skip();
        }
        next = sent.start.plus_s(18.0);
        let symbols = soft(&cnav2::interleaved(&sent.symbols), inverted);
        news.extend(symbols.into_iter().flat_map(|one| reader.take(one, sent.start)));
    }
    news
}

/// Checks that subframe 2 equals our own of a set, except for time of prediction, accuracies and flags.
fn is_sent(set: &Ephemeris, start: Epoch, two: &[bool]) {
    let symbols = (message(set.sv).sender)(&Common::default()).unwrap().unit(set, start).unwrap();
    let ours = cnav2::decode(&soft(&symbols, false)).unwrap();
    assert_eq!(ours.sent_at(start), start);
    let compared = |place: &usize| !(21..32).contains(place) && !(459..470).contains(place) && *place < 565;
    let differ: Vec<usize> = (0..576).filter(compared).filter(|place| ours.0.two[*place] != two[*place]).collect();
    assert!(differ.is_empty(), "{} {start} {differ:?}", set.sv);
}

#[test]
fn shipped_frames_are_coded_again_symbol_by_symbol_read_inverted_or_not_and_sent_again() {
    let all = shipped();
    let frames: Vec<Frame> = all.iter().map(holds).collect();
    // Two are the last of their two hours: the count is that of the next, the interval their own.
    assert_eq!(frames.iter().filter(|frame| frame.0.time == 0).count(), 2);
    let mut satellites = 0;
    for of_one in all.iter().collect::<Vec<_>>().chunk_by(|a, b| a.sv == b.sv) {
        satellites += 1;
        for inverted in [false, true] {
            let news = read(of_one, inverted);
            let units: Vec<&Read> = news.iter().filter(|read| matches!(read, Read::Unit { .. })).collect();
            assert_eq!(units.len(), of_one.len());
            for (unit, sent) in units.iter().zip(of_one) {
                assert_eq!(**unit, Read::Unit { symbols: 1800, of_week_s: sent.start.tow_whole_s(), inverted });
            }
            assert!(news.iter().any(|read| matches!(read, Read::Ionosphere(_))));
            let sets: Vec<&Ephemeris> = news
                .iter()
                .filter_map(|read| if let Read::Ephemeris(set) = read { Some(&**set) } else { None })
                .collect();
            assert!(!sets.is_empty());
            for (sent, frame) in all.iter().zip(&frames).filter(|(sent, _)| sent.sv == of_one[0].sv) {
                let toe = number(&frame.0.two[38..49]) as i64 * 300;
                if let Some(set) = sets.iter().find(|set| set.toe.tow_whole_s() == toe) {
                    is_sent(set, sent.start, &frame.0.two);
                }
            }
        }
    }
    assert_eq!((satellites, all.len()), (3, 8));
}

/// Ephemeris from subframe 2. Values of page 1, which is not there, are zeros.
fn orbit_and_clock(sv: Sv, two: &Vec<bool>, start: Epoch) -> Ephemeris {
    let (_, fields) = cnav2::tables().into_iter().find(|(table, _)| *table == "subframe 2").unwrap();
    let raw = |name: &str| Some(fields.iter().find(|field| field.name == name).map_or(0, |field| field.read(two)));
    message(sv).fields.elements(sv, &raw, start).unwrap()
}

#[test]
fn every_real_frame_is_coded_again_and_its_sets_are_the_records_of_the_hour() {
    for (name, file, least) in [("233h_qzscnav2", Some("navbits/233h_rnx.nav.gz"), 10), ("305a_qzscnav2", None, 0)] {
        let Some(all) = real(&format!("navbits/{name}.csv.gz")) else { return };
        let mut sets: BTreeMap<(Sv, i64), Ephemeris> = BTreeMap::new();
        let mut read_whole = 0;
        for of_one in all.chunk_by(|a, b| a.sv == b.sv) {
            let sv = of_one[0].sv;
            for sent in of_one {
                let set = orbit_and_clock(sent.sv, &holds(sent).0.two, sent.start);
                sets.insert((sv, set.toe.seconds()), set);
            }
            // Sets are whole from the first page 1 on.
            for read in read(&of_one.iter().collect::<Vec<_>>(), false) {
                let Read::Ephemeris(set) = read else { continue };
                let own = &sets[&(sv, set.toe.seconds())];
                assert_eq!((set.af0_s, set.m0_rad, set.tgd_s), (own.af0_s, own.m0_rad, own.tgd_s), "{sv}");
                read_whole += 1;
            }
        }
        let path = match file.map(external) {
            Some(None) => return,
            path => path.flatten(),
        };
        let records = path.map_or(Vec::new(), |path| records(&path, 'J'));
        // Records are those of CNAV, whose group delays are a step from those of CNAV-2 at times.
        let matched = records.into_iter().filter(|record| agrees_in_orbit_and_clock(record, &sets)).count();
        println!("{name}: {} frames, {} sets, {read_whole} read, {matched} records", all.len(), sets.len());
        assert!(all.len() >= 800 && matched >= least && read_whole >= 3, "{} {matched} {read_whole}", all.len());
    }
}

#[test]
fn subframes_of_a_gps_satellite_are_sent_again_by_us_bit_by_bit() {
    let Some(path) = external("navbits/gnsstk_gps_cnav2_sf2.csv") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let mut seen = 0;
    for line in text.lines().skip(1).filter(|line| line.contains(",G,")) {
        let column: Vec<&str> = line.split(',').collect();
        let two = bits(column[6], 600);
        assert_eq!(crc24q(two.iter().copied()), 0, "{line}");
        let week: u32 = column[0].parse().unwrap();
        assert_eq!(number(&two[..13]), u128::from(week % 8192));
        let interval_s = number(&two[13..21]) as f64 * 7200.0;
        let start = Epoch::from_week(week, interval_s);
        let set = orbit_and_clock(Sv::gps(column[3].parse().unwrap()), &two, start);
        let radius_m = set.state(start).unwrap().position_m.norm();
        assert!((26.3e6..26.9e6).contains(&radius_m), "{radius_m}");
        is_sent(&set, start, &two);
        seen += 1;
    }
    assert!(seen >= 4, "{seen}");
}

/// Subframe 3 without its check as J02 sent it on 2025-08-21: two pages 3 and five pages 4.
const ALMANACS: [&str; 7] = [
    "c20d29a0001555555c201c5446380005a30fe82ac189e2a04000aaaaaa80000",
    "c20d29a019000010000aaaaaa80555555402aaaaaa0155555500aaaaaa80000",
    "c21129a01841fae2bfed95d6c399bff6e169ffa000000000000000000000000",
    "c21129a018e00800700595d781e90535d33a000000000000000000000000000",
    "c21129a01861da655ff595d20a8bbf7f98cdffe000000000000000000000000",
    "c21129a01881da519fef95ce4f5dbf805050000000000000000000000000000",
    "c21129a019000480600795d840f44716b846000000000000000000000000000",
];

fn fields_of(page: u128) -> Vec<&'static Field> {
    let name = format!("subframe 3, page {page}");
    cnav2::tables().into_iter().find(|(table, _)| *table == name).map(|(_, fields)| fields).unwrap()
}

/// The values of a field that a page has once for each satellite.
fn values(page: u128, name: &str, three: &Vec<bool>) -> Vec<f64> {
    let own = fields_of(page).into_iter().filter(|field| field.name == name);
    own.map(|field| field.value(field.read(three))).collect()
}

#[test]
fn almanacs_of_real_pages_are_all_read_and_their_two_kinds_are_of_the_same_orbits() {
    use std::f64::consts::{PI, TAU};
    let mut reduced = BTreeMap::new();
    let mut compared = 0;
    for hex in ALMANACS {
        let three = bits(hex, 250);
        let page = number(&three[8..14]);
        // What the fields hold, written again, is the page; the rest is reserved and zero.
        let mut again = vec![false; 250];
        again[..14].copy_from_slice(&three[..14]);
        fields_of(page).iter().for_each(|field| field.write(&mut again, field.read(&three)));
        assert_eq!(again, three, "{hex}");
        let of = |name: &str| values(page, name, &three);
        assert_eq!((of("almanac_week"), of("toa_4096s")), (vec![2381.0], vec![0.0]));
        if page == 3 {
            let angles = [of("almanac_omega0_rad"), of("almanac_phi0_rad"), of("almanac_delta_a_m")];
            for (place, prn) in of("almanac_prn").into_iter().enumerate() {
                reduced.insert(prn as u8, angles.each_ref().map(|values| values[place]));
                // A packet without satellite alternates, as ours does.
                assert!(prn != 0.0 || angles[2][place] == -86.0 * 512.0);
            }
            continue;
        }
        let one = |name: &str| of(name)[0];
        let [node, latitude, axis_m] = reduced[&(one("almanac_prn") as u8)];
        // Geostationary satellites have no node in the short one.
        let is_inclined = one("almanac_eccentricity") > 1e-3;
        let own_node = if is_inclined { one("almanac_omega0_rad") } else { 0.0 };
        let step = PI / 64.0;
        assert!(libm::remainder(node - own_node, TAU).abs() <= step, "{hex}");
        let own = one("almanac_omega0_rad") - own_node + one("almanac_omega_rad") + one("almanac_m0_rad");
        assert!(libm::remainder(latitude - own, TAU).abs() <= step, "{hex}");
        // Steps of 1/16 of the root's unit are 0.8 km, and of the axis 0.5 km.
        let root = one("almanac_sqrt_a_sqrtm");
        assert!((axis_m + 42_164_200.0 - root * root).abs() < 1.5e3, "{hex}");
        compared += 1;
    }
    assert_eq!((compared, reduced.len()), (5, 6));
}

#[test]
fn almanacs_that_we_send_of_qzss_are_those_that_its_satellites_sent() {
    let Some(path) = external("navbits/233h_rnx.nav.gz") else { return };
    let packed = std::fs::read(path).unwrap();
    let mut almanac = rinex::read(&packed, "233h_rnx.nav.gz").unwrap().ephemerides;
    almanac.retain(|set| set.sv.system == System::Qzss && set.form.name.starts_with("LNAV"));
    almanac.reverse();
    almanac.sort_by_key(|set| set.sv);
    almanac.dedup_by_key(|set| set.sv);
    let reference = Some(Epoch::from_week(2381, 0.0));
    let sender = (civil::CNAV2.sender)(&Common { almanac: almanac.clone(), reference, ..Common::default() }).unwrap();
    let own = |frame: i64| {
        let set = (civil::CNAV2.form)(&almanac[0]);
        let symbols = sender.unit(&set, Epoch::from_week(2380, 370_800.0 + 18.0 * frame as f64)).unwrap();
        cnav2::decode(&soft(&symbols, false)).unwrap().0.three.unwrap()
    };
    let pages: Vec<Vec<bool>> = (0..18).map(own).collect();
    // 370 800 s are 20 600 frames, and one of three in a week has almanacs: the second. A round
    // of six of them is one of five satellites and five of one.
    let numbers: Vec<u128> = pages.iter().map(|three| number(&three[8..14])).collect();
    let almanacs: Vec<u128> = numbers.iter().copied().filter(|page| *page != 1).collect();
    assert!((0..18).all(|frame| (numbers[frame] == 1) != ((20_600 + frame) % 3 == 1)), "{numbers:?}");
    assert_eq!(almanacs.iter().filter(|page| **page == 3).count(), 1, "{numbers:?}");
    assert_eq!(almanacs.iter().filter(|page| **page == 4).count(), 5, "{numbers:?}");
    let mut compared = 0;
    for real in ALMANACS.map(|hex| bits(hex, 250)) {
        let page = number(&real[8..14]);
        let prns = |three: &Vec<bool>| values(page, "almanac_prn", three);
        for three in pages.iter().filter(|three| number(&three[8..14]) == page) {
            for (place, prn) in prns(three).into_iter().enumerate().filter(|(_, prn)| *prn > 0.0) {
                let Some(other) = prns(&real).iter().position(|other| *other == prn) else { continue };
                // The operator predicts orbits for days, a set is of hours: Moon and Sun move the axis by a
                // kilometre and the inclination by hundredths of a degree; a day's drift of the axis is along
                // the track. The node's rate of hours has their short periods too. Perigee and node of a
                // round orbit near the equator mean little.
                let round = values(page, "almanac_eccentricity", &real).first().is_some_and(|e| *e < 1e-3);
                for (name, bound) in [
                    ("almanac_omega0_rad", if round { 0.2 } else { 0.06 }),
                    ("almanac_phi0_rad", 0.06),
                    ("almanac_delta_a_m", 2100.0),
                    ("almanac_health", 0.0),
                    ("almanac_eccentricity", 2e-4),
                    ("almanac_delta_i_rad", 1.5e-3),
                    ("almanac_sqrt_a_sqrtm", 0.2),
                    ("almanac_omega_rad", if round { 7.0 } else { 0.01 }),
                    ("almanac_m0_rad", if round { 7.0 } else { 0.01 }),
                    ("almanac_omega_dot_radps", 4e-9),
                    ("almanac_af0_s", 2e-6),
                    ("almanac_af1_sps", 8e-12),
                ] {
                    let [Some(ours), Some(theirs)] = [(three, place), (&real, other)]
                        .map(|(three, place)| values(page, name, three).get(place).copied())
                    else {
                        continue;
                    };
                    let apart = (ours - theirs).abs();
                    let apart = if name.ends_with("0_rad") || name.ends_with("omega_rad") {
                        libm::remainder(apart, std::f64::consts::TAU).abs()
                    } else {
                        apart
                    };
                    println!("page {page} {prn} {name}: {ours} {theirs}");
                    assert!(apart <= bound, "page {page} {prn} {name}: {ours} {theirs}");
                    compared += 1;
                }
            }
        }
    }
    assert!(compared >= 65, "{compared}");
}
