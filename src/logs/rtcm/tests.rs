use std::io::Cursor;

use super::*;
use crate::frames::{Frames, Protocol};
use crate::observed::{Event, ObservedEpoch};
use gnss::time::Epoch;

/// Frames of a shipped log of RTCM 3.
fn frames(name: &str) -> Vec<Vec<u8>> {
    let path = format!("{}/../../data/witness/logs/{name}", env!("CARGO_MANIFEST_DIR"));
    let frames = Frames::new(Cursor::new(std::fs::read(path).unwrap())).map(Result::unwrap);
    frames.filter(|frame| frame.protocol == Protocol::Rtcm).map(|frame| frame.bytes).collect()
}

fn observed(near: &str) -> Vec<ObservedEpoch> {
    let (mut calendar, mut locks) = (Calendar::new(Epoch::parse(near).ok()), Locks::default());
    let read = |frame: Vec<u8>| match super::read(&frame, &mut calendar, &mut locks).event {
        Some(Event::Observations(epoch)) => Some(epoch),
        _ => None,
    };
    frames("MIXED-RTCM3.rtcm3").into_iter().filter_map(read).collect()
}

#[test]
fn the_printed_station_has_the_printed_position() {
    // RTCM 10403.3, 4.2: the example of message 1005.
    let frame = [
        0xd3, 0x00, 0x13, 0x3e, 0xd7, 0xd3, 0x02, 0x02, 0x98, 0x0e, 0xde, 0xef, 0x34, 0xb4, 0xbd, 0x62, 0xac, 0x09,
        0x41, 0x98, 0x6f, 0x33, 0x36, 0x0b, 0x98,
    ];
    let table = read(&frame, &mut Calendar::default(), &mut Locks::default()).table.unwrap();
    assert_eq!(table.integer(0, "DF003"), Some(2003));
    let place = ["DF025", "DF026", "DF027"].map(|name| table.number(0, name).unwrap());
    assert_eq!(place, [1_114_104.599_9, -4_850_729.710_8, 3_975_521.464_3]);
}

#[test]
fn all_systems_of_one_epoch_have_one_time() {
    // The log's epoch is Tuesday 8:42:17.001 UTC of a week that it does not name.
    let epochs = observed("2022-02-09T00:00:00");
    assert_eq!(epochs.len(), 4);
    for epoch in &epochs {
        assert_eq!(epoch.label, epochs[0].label, "{:?}", epoch.values[0].sv);
    }
    assert_eq!(epochs[0].label.week(), Epoch::parse("2022-02-09T00:00:00").unwrap().week());
}

#[test]
fn code_and_carrier_of_a_satellite_agree_on_both_bands() {
    for epoch in observed("2022-02-09T00:00:00") {
        for value in &epoch.values {
            let (code_m, cycles) = (value.pseudorange_m.unwrap(), value.carrier_cycles.unwrap());
            let hz = (cycles / code_m) * gnss::earth::SPEED_OF_LIGHT_MPS;
            assert!((1.17e9..1.61e9).contains(&hz), "{} {}: {hz}", value.sv, value.code);
            assert!((1.8e7..4.5e7).contains(&code_m) && value.doppler_hz.unwrap().abs() < 6e3);
        }
    }
}

#[test]
fn a_message_without_a_known_week_says_so() {
    let all = frames("MIXED-RTCM3.rtcm3");
    let undated = all
        .iter()
        .filter(|frame| read(frame, &mut Calendar::default(), &mut Locks::default()).event == Some(Event::Undated));
    assert_eq!(undated.count(), 4);
}

#[test]
fn a_message_that_ends_too_early_has_no_table_and_does_not_stop() {
    for name in ["MIXED-RTCM3.rtcm3", "NTRIP-USCL00CHL0.rtcm3"] {
        for frame in frames(name) {
            for length in 0..frame.len() {
                let mut calendar = Calendar::new(Some(Epoch::from_week(2200, 0.0)));
                let found = read(&frame[..length], &mut calendar, &mut Locks::default());
                assert!(found.table.is_none_or(|table| table.rows.len() <= 64), "{name} {length}");
            }
        }
    }
}
