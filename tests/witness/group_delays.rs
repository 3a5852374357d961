//! Group delays of the civil signals that came after L1 C/A and B1I: those that satellites broadcast in the
//! messages of these signals, by fixed columns of the records, against what a scene of that day sends.

use std::collections::BTreeMap;

use gnss::beidou::{b1c::B1C, b2a::B2A, b2b::B2B};
use gnss::broadcast::Ephemeris;
use gnss::gps::{l1c, l2c, l5};
use gnss::qzss;
use gnss::satellite::System;
use gnss::signal::Signal;
use gnss::time::{BDT, Epoch};
use gnss::{inflate, rinex};

use super::data::external;

/// Records of seven satellites with all their messages' forms, of an hour each.
const SHIPPED: &str = include_str!("../../data/witness/group_delays.rnx");

/// Signals of which a record of their own has the delay.
const SIGNALS: [&str; 8] =
    ["BeiDou B1C", "BeiDou B2a", "BeiDou B2b", "GPS L2C", "GPS L5", "QZSS L1C", "QZSS L2C", "QZSS L5"];

/// Content of a record: satellite, message, time of its clock, and the numbers of its lines.
struct Record {
    satellite: String,
    message: String,
    toc: Epoch,
    rows: Vec<[Option<f64>; 4]>,
}

fn records(text: &str) -> Vec<Record> {
    let lines: Vec<&str> = text.lines().collect();
    let heads = (0..lines.len()).filter(|at| lines[*at].starts_with("> EPH"));
    heads
        .filter_map(|at| {
            let word: Vec<&str> = lines[at].split_whitespace().collect();
            let body = lines[at + 1..].iter().take_while(|line| !line.starts_with('>'));
            let field = |line: &str, place: usize| {
                line.get(4 + 19 * place..)
                    .map(|rest| rest.get(..19).unwrap_or(rest))
                    .and_then(|text| text.trim().parse().ok())
            };
            let rows = body.map(|line| [0, 1, 2, 3].map(|place| field(line, place))).collect();
            let time: Vec<&str> = lines[at + 1][4..23].split_whitespace().collect();
            let calendar = format!("{}-{}-{}T{}:{}:{}", time[0], time[1], time[2], time[3], time[4], time[5]);
            let toc = Epoch::parse(&calendar).ok()?;
            Some(Record { satellite: word[2].to_owned(), message: word[3].to_owned(), toc, rows })
        })
        .collect()
}

/// The signal of a message that a record is of, its delay and that of the data; IS-GPS-705J, 20.3.3.3.1.2,
/// and BDS-SIS-ICD-B1C 1.0, 7.6.
fn broadcast(record: &Record) -> Vec<(&'static Signal, f64, Option<f64>)> {
    let v = |row: usize, place: usize| record.rows.get(row).and_then(|row| row[place]);
    let gps = record.satellite.starts_with('G');
    let corrected = |signal, row, place, data: Option<(usize, usize)>| {
        let own = v(6, 2).zip(v(row, place)).map(|(tgd, isc)| tgd - isc);
        let data = data.and_then(|(row, place)| Some(v(6, 2)? - v(row, place)?));
        own.map(|own| (signal, own, data))
    };
    let found = match (&record.satellite[..1], record.message.as_str()) {
        ("G" | "J", "CNAV") => vec![
            corrected(if gps { &l5::L5 } else { &qzss::l5::L5 }, 7, 3, Some((7, 2))),
            corrected(if gps { &l2c::L2C } else { &qzss::l2c::L2C }, 7, 1, None),
        ],
        ("G" | "J", "CNV2") => vec![corrected(if gps { &l1c::L1C } else { &qzss::l1c::L1C }, 8, 1, Some((8, 0)))],
        ("C", "CNV1") => vec![v(7, 2).map(|own| (&B1C, own, v(7, 0).map(|isc| own + isc)))],
        ("C", "CNV2") => vec![v(7, 3).map(|own| (&B2A, own, v(7, 1).map(|isc| own + isc)))],
        ("C", "CNV3") => vec![v(7, 3).map(|own| (&B2B, own, None))],
        _ => Vec::new(),
    };
    found.into_iter().flatten().collect()
}

/// Delay of a signal's data by the set that it sends.
fn data_s(sent: &Ephemeris, signal: &Signal) -> f64 {
    match signal.rinex {
        "5Q" => sent.tgd_s - sent.isc_s[2],
        "1L" => sent.tgd_s - sent.isc_s[5],
        "1P" => sent.tgd_s + sent.isc_s[0],
        _ => sent.tgd2_s + sent.isc_s[0],
    }
}

/// Compares every record of a file with the set nearest to it, and gives counts by signal.
fn compare(text: &str, sets: &[Ephemeris]) -> BTreeMap<&'static str, (usize, usize, f64, f64)> {
    let mut counts = BTreeMap::new();
    for record in records(text) {
        let toc = if record.satellite.starts_with('C') { BDT.instant(record.toc) } else { record.toc };
        let own = sets.iter().filter(|set| set.sv.to_string() == record.satellite);
        let Some(set) = own.min_by(|a, b| a.toc.since(toc).abs().total_cmp(&b.toc.since(toc).abs())) else { continue };
        for (signal, own_s, of_data_s) in broadcast(&record) {
            if !(signal.sent)(set.sv.number, record.toc) {
                continue;
            }
            let message = signal.components.iter().find_map(|component| component.message).unwrap();
            // Twelve or thirteen bits, with a step of 2⁻³⁴ s in BeiDou's messages and 2⁻³⁵ s in the others.
            let step_s = libm::exp2(if set.sv.system == System::BeiDou { -34.0 } else { -35.0 });
            let sent = message.fields.quantised(set).unwrap();
            let mut apart = [set.group_delay_s(signal) - own_s, sent.group_delay_s(signal) - own_s].to_vec();
            apart.extend(of_data_s.map(|of_data_s| data_s(&sent, signal) - of_data_s));
            let worst_s = apart.iter().fold(0.0_f64, |most, apart_s| most.max(apart_s.abs()));
            // What the one delay of LNAV or D1 makes of it, as 1/f².
            let invented = Ephemeris { signal_delays_s: Vec::new(), ..set.clone() };
            let entry: &mut (usize, usize, f64, f64) = counts.entry(signal.name).or_default();
            entry.0 += 1;
            entry.1 += usize::from(worst_s <= step_s * 1.001);
            entry.2 = entry.2.max(worst_s);
            entry.3 += (invented.group_delay_s(signal) - own_s).powi(2);
        }
    }
    for (name, (count, equal, worst_s, squares)) in &counts {
        let rms_ns = 1e9 * (squares / *count as f64).sqrt();
        println!(
            "{name}: {equal} of {count} within the step, at most {:.3} ns; as 1/f2 {rms_ns:.2} ns rms",
            1e9 * worst_s
        );
    }
    counts
}

#[test]
fn every_signal_has_the_delay_of_its_own_message_to_the_step() {
    let sets = rinex::read(SHIPPED.as_bytes(), "shipped").unwrap();
    let counts = compare(SHIPPED, &sets.ephemerides);
    let signals: Vec<&str> = counts.keys().copied().collect();
    assert_eq!(signals, SIGNALS);
    assert!(counts.values().all(|(count, equal, ..)| count == equal), "{counts:?}");
    // The delays of LNAV and D1 do not give them.
    assert!(counts.values().any(|(count, _, _, squares)| (squares / *count as f64).sqrt() > 1e-9), "{counts:?}");
}

#[test]
fn over_a_day_of_all_satellites_delays_are_those_of_the_hour_to_the_step() {
    for name in ["nav/BRD400DLR_S_20230710000_01D_MN.rnx.gz", "multi-gnss/BRD400DLR_S_20260680000_01D_MN.rnx.gz"] {
        let Some(path) = external(name) else { return };
        let packed = std::fs::read(path).unwrap();
        let sets = rinex::read(&packed, name).unwrap();
        let text = String::from_utf8(inflate::inflate(&packed, 1 << 26).unwrap()).unwrap();
        let counts = compare(&text, &sets.ephemerides);
        // The older file has none of CNV3, the message of B2b.
        let has_b2b = text.lines().any(|line| line.starts_with("> EPH C") && line.contains("CNV3"));
        let expected = SIGNALS.iter().filter(|signal| has_b2b || **signal != "BeiDou B2b");
        assert!(counts.keys().eq(expected), "{name}: {counts:?}");
        for (signal, (count, equal, worst_s, _)) in &counts {
            // A satellite changes its delays once a day, by a few steps, and sets of both messages do so
            // within the hour.
            assert!(100 * equal >= 97 * count && *worst_s < 1e-9, "{name} {signal}: {equal} of {count}, {worst_s:e} s");
        }
    }
}

/// A day of all systems in RINEX 4, whose records of BeiDou's newer messages say how accurate signals are.
const DAY: &str = "nav/BRD400DLR_S_20230710000_01D_MN.rnx.gz";

#[test]
fn records_of_the_newer_messages_of_beidou_are_read_where_their_accuracies_are_blank() {
    let Some(path) = external(DAY) else { return };
    let packed = std::fs::read(path).unwrap();
    let text = String::from_utf8(inflate::inflate(&packed, 1 << 28).unwrap()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let header: Vec<&str> = lines.iter().copied().take_while(|line| !line.contains("END OF HEADER")).collect();
    let of = |number: &str, message: &str, count: usize| -> Vec<String> {
        let is_head =
            |line: &&str| line.starts_with("> EPH C") && line[7..9] == *number && line.trim_end().ends_with(message);
        let at = lines.iter().position(is_head).unwrap();
        lines[at..at + count].iter().map(|line| (*line).to_owned()).collect()
    };
    let read = |records: &[Vec<String>]| {
        let own = records.iter().flatten().map(String::as_str);
        let end = ["                                                            END OF HEADER"];
        let all: Vec<&str> = header.iter().copied().chain(end).chain(own).collect();
        rinex::read((all.join("\n") + "\n").as_bytes(), "blank").unwrap().ephemerides
    };
    let old = of("29", "D1", 9);
    for (message, count, signal) in [("CNV1", 11, &B1C), ("CNV2", 11, &B2A)] {
        let whole = of("29", message, count);
        let expected = read(&[old.clone(), whole.clone()]);
        let delays = |sets: &[Ephemeris]| -> Vec<(bool, f64)> {
            sets.iter().map(|set| (set.serves(signal), set.group_delay_s(signal))).collect()
        };
        assert!(delays(&expected).iter().all(|(own, _)| *own), "{message}");
        // The seventh line of the record: blanks, or nothing at all where an editor cut them.
        for blank in [" ".repeat(80), String::new()] {
            let mut without = whole.clone();
            without[7] = blank;
            let found = read(&[old.clone(), without]);
            assert_eq!(delays(&found), delays(&expected), "{message}");
        }
    }
}
