//! GPS CNAV of L5 and L2C against real messages and the RINEX records of the same hours.

use std::collections::BTreeMap;

use gnss::bits::number;
use gnss::broadcast::Ephemeris;
use gnss::crc::crc24q;
use gnss::earth::{GPS_PI, SPEED_OF_LIGHT_MPS};
use gnss::exchange::{NavigationSets, Version};
use gnss::fec::convolutional::Convolutional;
use gnss::gps::cnav::{self, CNAV, CNAV_L2C};
use gnss::gps::cnav2::CNAV2;
use gnss::gps::l1c::L1C;
use gnss::gps::l1ca::L1_CA;
use gnss::gps::l2c::L2C;
use gnss::gps::l5::L5;
use gnss::gps::modernised;
use gnss::message::{Common, Message, Read};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;
use gnss::{inflate, rinex};

use super::data::external;

/// Eight successive messages of three satellites that sent L5 over Japan, 2025-02-15.
const MESSAGES: &str = include_str!("../../data/witness/gps_cnav.csv");
/// Seven of L2C, 2025-08-21: two satellites of Block IIR-M and one of IIF.
const MESSAGES_L2C: &str = include_str!("../../data/witness/gps_cnav_l2c.csv");

/// Records of another converter for their ephemerides.
const RECORDS_L2C: &str = include_str!("../../data/witness/gps_cnav_records.rnx");

/// The message of each signal as the files name it.
const BOTH: [(&str, &Message); 2] = [("L5", &CNAV), ("L2C", &CNAV_L2C)];

/// A message on the air: satellite, start and its 300 bits.
pub struct Sent {
    pub sv: Sv,
    pub start: Epoch,
    pub bits: Vec<bool>,
}

fn bits(hex: &str) -> Vec<bool> {
    let digits = hex.chars().map(|digit| digit.to_digit(16).unwrap());
    digits.flat_map(|digit| (0..4).rev().map(move |bit| digit >> bit & 1 == 1)).take(300).collect()
}

fn shipped(messages: &str) -> Vec<Sent> {
    let parse = |line: &str| {
        let column: Vec<&str> = line.split(',').collect();
        let start = Epoch::from_week(column[1].parse().unwrap(), column[2].parse().unwrap());
        Sent { sv: column[0].parse().unwrap(), start, bits: bits(column[3]) }
    };
    messages.lines().skip(1).map(parse).collect()
}

/// Messages of a signal in a file, by satellite and time.
pub fn real(name: &str, (signal, message): (&str, &Message)) -> Option<Vec<Sent>> {
    let packed = std::fs::read(external(name)?).unwrap();
    let text = String::from_utf8(inflate::inflate(&packed, 1 << 26).unwrap()).unwrap();
    let mut all: Vec<Sent> = (text.lines().skip(1))
        .map(|line| line.split(',').collect::<Vec<&str>>())
        .filter(|column| column[4] == signal)
        .map(|column| {
            let number = |i: usize| column[i].parse::<u32>().unwrap();
            // The file says when the message ends.
            let start = Epoch::from_week(number(0), f64::from(number(1)) - message.unit_s as f64);
            Sent { sv: format!("{}{}", column[2], column[3]).parse().unwrap(), start, bits: bits(column[5]) }
        })
        .collect();
    all.sort_by_key(|sent| (sent.sv, sent.start.seconds()));
    Some(all)
}

pub fn soft(one: bool) -> f32 {
    if one { -1.0 } else { 1.0 }
}

/// Content that a reader finds in a satellite's messages, whose code runs on.
pub fn read(message: &Message, all: &[Sent], inverted: bool) -> Vec<Read> {
    let mut reader = (message.reader)(all[0].sv);
    let (mut memory, mut next) = (Vec::new(), all[0].start);
    let mut news = Vec::new();
    for sent in all {
        if sent.start != next {
            reader.skip();
            memory.clear();
        }
        next = sent.start.plus_s(message.unit_s as f64);
        for one in cnav::encode(&memory, &sent.bits) {
            news.extend(reader.take(soft(one ^ inverted), sent.start));
        }
        memory = sent.bits[294..].to_vec();
    }
    // The code's memory after the last message.
    news.extend((0..200).flat_map(|_| reader.take(0.0, next)));
    news
}

/// Check, header, and that every bit of the four types is in a field or spare.
fn holds(message: &Message, sent: &Sent) {
    let Sent { sv, start, bits } = sent;
    assert_eq!(crc24q(bits.iter().copied()), 0, "{sv} {start}");
    assert_eq!((number(&bits[..8]), number(&bits[8..14])), (0x8B, u128::from(sv.number)), "{sv} {start}");
    assert_eq!(number(&bits[20..37]) as i64 * 6, start.tow_whole_s() + message.unit_s, "{sv} {start}");
    let kind = cnav::message_type(bits);
    let name = format!("message {kind}");
    let Some((_, fields)) = cnav::tables().into_iter().find(|(table, _)| *table == name) else { return };
    let mut written: Vec<bool> = bits.iter().map(|bit| !bit).collect();
    for field in fields {
        field.write(&mut written, field.read(bits));
    }
    let first_spare = [(10, 273), (11, 269), (30, 264), (33, 225)].into_iter().find(|(of, _)| *of == kind).unwrap().1;
    assert!((0..first_spare).all(|place| written[place] == bits[place]), "{sv} {start} type {kind}");
    // Message 32, of the Earth's orientation, is sent in place of 33 at times.
    assert_eq!(cnav::type_at(message, *start), kind, "{sv} {start}");
}

/// Checks that a message of a set equals our own of it. Exceptions are times of prediction, accuracies, flags
/// and data common to all satellites.
fn is_sent(message: &Message, set: &Ephemeris, sent: &Sent) {
    let sender = (message.sender)(&Common::default()).unwrap();
    let symbols = sender.unit(set, sent.start).unwrap();
    let code = Convolutional { second_inverted: false };
    let ours = code.decode_open(&symbols.iter().map(|one| soft(*one)).collect::<Vec<f32>>());
    let compared = |place: &usize| match cnav::message_type(&sent.bits) {
        10 => !(54..65).contains(place) && *place < 271,
        11 => *place < 269,
        30 => !(38..60).contains(place) && *place < 192,
        _ => *place < 38,
    };
    let differ: Vec<usize> = (0..276).filter(compared).filter(|place| ours[*place] != sent.bits[*place]).collect();
    assert!(differ.is_empty(), "{} {} {differ:?}", sent.sv, sent.start);
}

#[test]
fn shipped_messages_of_l5_and_l2c_hold_and_are_sent_by_us_bit_by_bit() {
    for (messages, message, count) in [(MESSAGES, &CNAV, 24), (MESSAGES_L2C, &CNAV_L2C, 21)] {
        let all = shipped(messages);
        all.iter().for_each(|sent| holds(message, sent));
        let mut satellites = 0;
        for own in all.chunk_by(|a, b| a.sv == b.sv) {
            satellites += 1;
            for inverted in [false, true] {
                let news = read(message, own, inverted);
                let set = news.iter().find_map(|read| if let Read::Ephemeris(set) = read { Some(set) } else { None });
                own.iter().for_each(|sent| is_sent(message, set.unwrap(), sent));
                // The first message is found once the second is on its way; all say their time.
                let units: Vec<&Read> = news.iter().filter(|read| matches!(read, Read::Unit { .. })).collect();
                assert!(units.len() >= own.len() - 1, "{} {}", own[0].sv, units.len());
                for unit in units {
                    let Read::Unit { of_week_s, inverted: found, .. } = unit else { continue };
                    assert!(*found == inverted && own.iter().any(|sent| sent.start.tow_whole_s() == *of_week_s));
                }
                assert!(news.iter().any(|read| matches!(read, Read::Ionosphere(_))));
            }
            // They are of those that send the signal by our table; of G12 and G15 L2C alone.
            let (number, at) = (own[0].sv.number, own[0].start);
            assert!(modernised::sends_l2c(number, at));
            assert_eq!(modernised::sends_l5(number, at), ![12, 15].contains(&number), "{number}");
        }
        assert_eq!((satellites, all.len()), (3, count));
    }
}

#[test]
fn shipped_sets_are_written_in_the_numbers_of_another_converter() {
    let all = shipped(MESSAGES_L2C);
    let mut written = NavigationSets::default();
    for own in all.chunk_by(|a, b| a.sv == b.sv) {
        for read in read(&CNAV_L2C, own, false) {
            let Read::Parameters(rows) = read else { continue };
            rows.iter().for_each(|row| written.take(row));
        }
    }
    assert_eq!(printed_alike(&written, BOTH[1], all[0].start, &records_in(RECORDS_L2C, 'G')), 3);
}

#[test]
fn every_real_message_of_l5_and_l2c_holds_and_its_sets_are_the_records_of_the_hour() {
    for (name, file) in [("046r_gpscnav", "lnav/046r_rnx.nav"), ("233h_gpscnav", "navbits/233h_rnx.nav.gz")] {
        for of @ (signal, message) in BOTH {
            let Some(mut all) = real(&format!("navbits/{name}.csv.gz"), of) else { return };
            all.retain(|sent| cnav::message_type(&sent.bits) != 32);
            all.iter().for_each(|sent| holds(message, sent));
            let mut sets: BTreeMap<(Sv, i64), Ephemeris> = BTreeMap::new();
            let (mut written, mut resent) = (NavigationSets::default(), 0);
            for own in all.chunk_by(|a, b| a.sv == b.sv) {
                for read in read(message, own, false) {
                    match read {
                        Read::Ephemeris(set) => _ = sets.insert((set.sv, set.toe.seconds()), *set),
                        Read::Parameters(rows) => rows.iter().for_each(|row| written.take(row)),
                        _ => {}
                    }
                }
            }
            let of_toe = |sent: &Sent, set: &Ephemeris| {
                let place = match cnav::message_type(&sent.bits) {
                    10 => 70,
                    11 => 38,
                    _ => 60,
                };
                set.sv == sent.sv && number(&sent.bits[place..place + 11]) as i64 * 300 == set.toe.tow_whole_s()
            };
            for sent in all.iter().filter(|sent| cnav::message_type(&sent.bits) != 33) {
                let Some(set) = sets.values().find(|set| of_toe(sent, set)) else { continue };
                is_sent(message, set, sent);
                resent += 1;
            }
            let Some(path) = external(file) else { return };
            let theirs = records(&path, 'G');
            let matched = theirs.iter().filter(|record| agrees(record, &sets)).count();
            let same = printed_alike(&written, of, all[0].start, &theirs);
            assert!(same == matched && same >= 5, "{same} of {matched}");
            let count = all.len();
            println!("{name} {signal}: {count} messages, {} sets, {resent} sent again, {matched} records", sets.len());
            assert!(count > 1500 && resent > count / 2 && matched >= 5, "{count} {resent} {matched}");
        }
    }
}

/// Number of our records of decoded sets that have every number of another converter's, prediction and
/// accuracies included.
fn printed_alike(written: &NavigationSets, (signal, _): (&str, &Message), near: Epoch, theirs: &[Record]) -> usize {
    let signal: &Signal = if signal == "L5" { &L5 } else { &L2C };
    let mut text = Vec::new();
    written.write(&mut text, Version::Four, &[signal], near).unwrap();
    let ours = records_in(&String::from_utf8(text).unwrap(), 'G');
    let mut alike = 0;
    for other in theirs {
        let of_set = |own: &&Record| other.sv == own.sv && other.toc == own.toc;
        let Some(own) = ours.iter().find(of_set) else { continue };
        for (row, (one, another)) in own.rows.iter().zip(&other.rows).enumerate().take(8) {
            for (place, (a, b)) in one.iter().zip(another).enumerate() {
                // Time of transmission is that of the set there, and health of one signal.
                let is_health = (row, place) == (6, 1);
                // Both print what is an integer times its step, to twelve digits behind the point.
                assert!(is_health || (a - b).abs() <= 2e-12 * a.abs(), "{} {row} {place}: {a:e} {b:e}", own.sv);
            }
        }
        alike += 1;
    }
    let three = {
        let mut text = Vec::new();
        written.write(&mut text, Version::Three, &[signal], near).unwrap();
        String::from_utf8(text).unwrap()
    };
    assert!(three.trim_end().ends_with("END OF HEADER"), "version 3 has no records of CNAV: {three}");
    alike
}

/// The numbers of a record of CNAV of one system: satellite, time of clock, then rows of four.
pub struct Record {
    pub sv: Sv,
    pub toc: Epoch,
    pub rows: Vec<Vec<f64>>,
}

pub fn records(path: &std::path::Path, system: char) -> Vec<Record> {
    let packed = std::fs::read(path).unwrap();
    let gz = path.extension().is_some_and(|end| end == "gz");
    let whole = if gz { inflate::inflate(&packed, 1 << 26).unwrap() } else { packed };
    records_in(&String::from_utf8_lossy(&whole), system)
}

/// Records of CNAV of one system in a text.
fn records_in(text: &str, system: char) -> Vec<Record> {
    let lines: Vec<&str> = text.lines().collect();
    let head = format!("> EPH {system}");
    let heads = (0..lines.len()).filter(|at| lines[*at].starts_with(&head) && lines[*at].contains(" CNAV"));
    heads
        .map(|at| {
            let head = lines[at + 1];
            let time: Vec<&str> = head[4..23].split_whitespace().collect();
            let calendar = format!("{}-{}-{}T{}:{}:{}", time[0], time[1], time[2], time[3], time[4], time[5]);
            let value = |line: &str, place: usize| {
                line.get(4 + 19 * place..23 + 19 * place).and_then(|text| text.trim().parse().ok()).unwrap_or(0.0)
            };
            let rows = lines[at + 1..at + 10].iter().map(|line| (0..4).map(|i| value(line, i)).collect()).collect();
            Record { sv: head[..3].parse().unwrap(), toc: Epoch::parse(&calendar).unwrap(), rows }
        })
        .collect()
}

/// Checks that a value is the record's, to half a step.
fn close(record: &Record, name: &str, [one, other]: [f64; 2], exponent: i32) {
    let step = libm::exp2(f64::from(exponent)) * GPS_PI;
    assert!((one - other).abs() <= 0.5 * step + 1e-12 * one.abs(), "{} {name}: {one} {other}", record.sv);
}

/// True if there is a set of a record's time; its values are then checked against the record's.
fn agrees(record: &Record, sets: &BTreeMap<(Sv, i64), Ephemeris>) -> bool {
    let Some(set) = sets.get(&(record.sv, record.toc.seconds())) else { return false };
    close(record, "tgd", [set.tgd_s, record.rows[6][2]], -37);
    // Of blocks without a signal its correction is not available, which records leave blank.
    for (place, own) in set.isc_s.into_iter().enumerate().take(4) {
        if own > -1.19e-7 {
            close(record, "isc", [own, record.rows[7][place]], -37);
        }
    }
    agrees_in_orbit_and_clock(record, sets)
}

/// True if there is a set of a record's time; its orbit and clock are then checked, without group delays.
pub fn agrees_in_orbit_and_clock(record: &Record, sets: &BTreeMap<(Sv, i64), Ephemeris>) -> bool {
    let Some(set) = sets.get(&(record.sv, record.toc.seconds())) else { return false };
    let v = |row: usize, place: usize| record.rows[row][place];
    let close = |name: &str, one: f64, other: f64, exponent: i32| close(record, name, [one, other], exponent);
    let turn = |angle: f64| libm::remainder(angle, std::f64::consts::TAU);
    assert_eq!(set.toc, record.toc);
    close("af0", set.af0_s, v(0, 1), -37);
    close("af1", set.af1_sps, v(0, 2), -50);
    close("af2", set.af2_sps2, v(0, 3), -62);
    close("a rate", set.axis_rate_mps, v(1, 0), -23);
    close("crs", set.crs_m, v(1, 1), -10);
    close("delta n", set.delta_n_radps, v(1, 2), -44);
    close("m0", turn(set.m0_rad), turn(v(1, 3)), -32);
    close("cuc", set.cuc_rad, v(2, 0), -32);
    close("e", set.eccentricity, v(2, 1), -36);
    close("cus", set.cus_rad, v(2, 2), -32);
    close("sqrt a", set.sqrt_a_sqrtm, v(2, 3), -24);
    close("cic", set.cic_rad, v(3, 1), -32);
    close("omega0", turn(set.omega0_rad), turn(v(3, 2)), -32);
    close("cis", set.cis_rad, v(3, 3), -32);
    close("i0", set.i0_rad, v(4, 0), -32);
    close("crc", set.crc_m, v(4, 1), -10);
    close("omega", turn(set.omega_rad), turn(v(4, 2)), -32);
    close("omega dot", set.omega_dot_radps, v(4, 3), -44);
    close("idot", set.idot_radps, v(5, 0), -44);
    close("delta n rate", set.delta_n_rate_radps2, v(5, 1), -57);
    true
}

#[test]
fn a_set_of_lnav_carried_to_cnav_is_the_same_orbit_and_clock_to_its_steps() {
    let (mut farthest_m, mut latest_m, mut sets) = (0.0_f64, 0.0_f64, 0);
    let all = rinex::embedded().unwrap().ephemerides;
    for set in all.iter().chain(&rinex::embedded_two_systems().unwrap().ephemerides) {
        if set.sv.number > 32 || set.form != &gnss::gps::lnav::LNAV_SETS {
            continue;
        }
        let carried = CNAV.fields.quantised(set).unwrap();
        let second = CNAV2.fields.quantised(set).unwrap();
        // The same, but for its form and corrections of its own.
        assert_eq!(Ephemeris { form: carried.form, health: carried.health, ..second.clone() }, carried);
        assert!((carried.toe.since(set.toe)).abs() <= 150.0 && carried.toe.seconds() % 300 == 0);
        for minutes in [-120, -60, -7, 0, 33, 120] {
            let at = set.toe.plus_s(60.0 * f64::from(minutes));
            let apart = carried.state(at).unwrap().position_m - set.state(at).unwrap().position_m;
            farthest_m = farthest_m.max(apart.norm());
            // Every signal has its clock: corrections have steps of 2⁻³⁵ s, 9 mm.
            for (carried, signal) in [(&carried, &L1_CA), (&carried, &L2C), (&carried, &L5), (&second, &L1C)] {
                let clock_s = |set: &Ephemeris| set.clock_of_signal(at, signal).unwrap().offset_s;
                latest_m = latest_m.max(SPEED_OF_LIGHT_MPS * (clock_s(carried) - clock_s(set)).abs());
            }
        }
        sets += 1;
    }
    println!("{sets} sets: orbits {farthest_m:.4} m apart, clocks {latest_m:.4} m");
    // Angles to half of 2⁻³² semicircles are 0.0097 m each: three along the track, of which the node
    // counts by the cosine of 55°, and node and inclination across it. The node's rate to half of 2⁻⁴⁴ is
    // 0.017 m after 7200 s. Along 0.035 m, across 0.031 m. Offset and corrections are rounded to half of
    // 2⁻³⁵ s, 4.4 mm.
    assert!(sets > 400 && farthest_m < 0.047 && latest_m < 0.0088, "{sets} {farthest_m} {latest_m}");
}

#[test]
fn satellites_send_l5_since_they_are_of_block_iif_or_iii() {
    // C5Q in observations of four real stations, and GPS satellites there without it.
    for (date, with, without) in [
        ("2020-06-25T00:00:00", &[8, 9, 18, 27, 30][..], &[2, 5, 7, 13, 15, 20, 21, 28][..]),
        ("2020-11-29T12:40:00", &[6, 9, 30], &[2, 5, 7, 13, 15, 28]),
        ("2021-09-22T06:30:00", &[14, 18, 23, 24], &[5, 13, 15, 20]),
        ("2025-02-15T17:00:00", &[14, 18, 23, 24, 30], &[]),
        ("2025-08-21T07:00:00", &[10, 18, 23, 24, 25, 28, 32], &[]),
    ] {
        let at = Epoch::parse(date).unwrap();
        assert!(with.iter().all(|number| modernised::sends_l5(*number, at)), "{date}");
        assert!(without.iter().all(|number| !modernised::sends_l5(*number, at)), "{date}");
    }
    let before = Epoch::parse("2010-07-01T00:00:00").unwrap();
    assert!((1..=255).all(|number| !modernised::sends_l2c(number, before)));
}

/// Satellites of CNAV in two merged files are those that send L2C; those without L5 send zeros for its
/// corrections.
#[test]
fn satellites_that_send_l2c_and_l5_are_those_that_broadcast_cnav_and_corrections_for_l5() {
    for (name, date, count) in [
        ("nav/BRD400DLR_S_20230710000_01D_MN.rnx.gz", "2023-03-12T12:00:00", 18),
        ("multi-gnss/BRD400DLR_S_20260680000_01D_MN.rnx.gz", "2026-03-09T12:00:00", 20),
    ] {
        let Some(path) = external(name) else { return };
        let mut senders: Vec<u8> = Vec::new();
        let mut others: Vec<u8> = Vec::new();
        for record in records(&path, 'G') {
            let own = if record.rows[7][2] == 0.0 && record.rows[7][3] == 0.0 { &mut others } else { &mut senders };
            own.push(record.sv.number);
        }
        for all in [&mut senders, &mut others] {
            all.sort_unstable();
            all.dedup();
        }
        let at = Epoch::parse(date).unwrap();
        let ours: Vec<u8> = (1..=63).filter(|number| modernised::sends_l5(*number, at)).collect();
        assert_eq!((&senders, senders.len()), (&ours, count), "{name}");
        let all: Vec<u8> = (1..=63).filter(|number| modernised::sends_l2c(*number, at)).collect();
        others.extend(&senders);
        others.sort_unstable();
        assert_eq!((others, all.len()), (all.clone(), count + 7), "{name}");
    }
}
