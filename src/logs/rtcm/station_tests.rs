use super::*;
use crate::log::Log;
use crate::observed::{Event, Observed};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::rinex;
use std::io::Cursor;

fn station() -> Station {
    Station {
        number: 42,
        position_m: Some(Vector3::new(1_114_104.599_9, -4_850_729.710_8, 3_975_521.464_3)),
        height_m: 1.5,
        antenna: "NONE".into(),
        receiver: "gnss-twin".into(),
        version: "1".into(),
    }
}

/// Epochs of one satellite of each system, a second apart.
fn epochs(count: u32) -> (Vec<Ephemeris>, Vec<ObservedEpoch>) {
    let sets = rinex::embedded_two_systems().unwrap().ephemerides;
    let start = Epoch::parse("2020-11-29T12:50:55").unwrap();
    let satellites = ["G05", "R06", "E27", "C10"].map(|sv| sv.parse::<Sv>().unwrap());
    let epoch = |second: u32| {
        let value = |sv: Sv| Observed {
            sv,
            code: if sv.system == System::BeiDou { "2I" } else { "1C" },
            pseudorange_m: Some(2.3e7),
            carrier_cycles: Some(2.3e7 / SPEED_OF_LIGHT_MPS * 1.5e9),
            doppler_hz: Some(100.0),
            cn0_dbhz: Some(45.0),
            lock_s: Some(f64::from(second)),
            lost_lock: false,
            half_cycle_ambiguous: false,
        };
        ObservedEpoch { label: start.plus_s(f64::from(second)), values: satellites.map(value).to_vec() }
    };
    (sets, (0..count).map(epoch).collect())
}

fn stream(plan: &str, count: u32) -> (Vec<u8>, Sender) {
    let (sets, epochs) = epochs(count);
    let mut sender = Sender::new(station(), plan.parse().unwrap(), sets);
    (epochs.iter().flat_map(|epoch| sender.epoch(epoch)).collect(), sender)
}

#[test]
fn the_printed_station_makes_the_printed_frame_but_for_its_flags() {
    // RTCM 10403.3, 4.2: station 2003 of GPS alone, of which other oscillators and systems are not said.
    let mut own = station();
    own.number = 2003;
    let body = own.message(1005).unwrap().unwrap();
    let printed = [
        0x3e, 0xd7, 0xd3, 0x02, 0x02, 0x98, 0x0e, 0xde, 0xef, 0x34, 0xb4, 0xbd, 0x62, 0xac, 0x09, 0x41, 0x98, 0x6f,
        0x33,
    ];
    let different: Vec<usize> = (0..19).filter(|place| body[*place] != printed[*place]).collect();
    assert_eq!(different, [3, 4, 9], "{body:x?}");
    assert_eq!(super::framed(&printed)[22..], [0x36, 0x0b, 0x98]);
}

#[test]
fn messages_come_in_their_intervals_and_observations_with_every_epoch() {
    let (_, sender) = stream("msm7,1005(2),1006,1033,1230,eph", 20);
    // From 12:50:55 on: whole tens and half minutes of GPS time begin twice and once.
    let count = |number: u64| sender.counts.get(&number).copied().unwrap_or(0);
    assert_eq!([1077, 1087, 1097, 1127].map(count), [20; 4]);
    assert_eq!([1005, 1006, 1033, 1230].map(count), [11, 3, 3, 3]);
    assert_eq!([1019, 1020, 1042, 1046].map(count), [2; 4]);
    assert_eq!(sender.refused, BTreeMap::new());
}

#[test]
fn a_stream_is_read_from_its_middle_on_and_without_a_date_from_outside() {
    let (bytes, sender) = stream("msm7,1006,1033,1230,eph", 40);
    let whole: u64 = sender.counts.values().sum();
    let start = epochs(1).1[0].label;
    for cut in (0..2000).step_by(7) {
        let mut log = Log::new(Cursor::new(&bytes[cut..]), None);
        let messages: Vec<_> = log.by_ref().map(Result::unwrap).collect();
        // The frame that is cut is lost, and those before it.
        let before = Log::new(Cursor::new(&bytes[..cut]), None).filter(Result::is_ok).count() as u64;
        assert!(messages.len() as u64 + before + 1 >= whole, "{cut}");
        assert!(log.contents().messages.iter().all(|(_, _, tally)| tally.malformed == 0));
        let dated = messages.iter().filter_map(|message| match &message.event {
            Some(Event::Observations(epoch)) => Some(epoch.label),
            _ => None,
        });
        let labels: Vec<Epoch> = dated.collect();
        let off: Vec<f64> =
            labels.iter().map(|label| label.since(start)).filter(|s| !(0.0..40.0).contains(s)).collect();
        // The date comes with ephemerides, at the latest with those of 12:51:30: five epochs of four systems.
        assert!(labels.len() >= 20 && off.is_empty(), "{cut}: {} labels, {off:?}", labels.len());
    }
}

#[test]
fn a_damaged_frame_is_counted_and_costs_no_other() {
    let (mut bytes, sender) = stream("msm7,1006,eph", 5);
    let whole: u64 = sender.counts.values().sum();
    bytes[40] ^= 4;
    let mut log = Log::new(Cursor::new(bytes), None);
    let read = log.by_ref().map(Result::unwrap).count() as u64;
    assert_eq!((read, log.contents().count(crate::frames::Protocol::Rtcm).damaged), (whole - 1, 1));
}

#[test]
fn a_plan_is_read_as_it_is_printed_and_nonsense_is_refused() {
    let plan: Plan = "msm4,1005(1),1019".parse().unwrap();
    assert_eq!(plan.to_string().parse::<Plan>().unwrap(), plan);
    assert!(plan.has(1074) && plan.has(1134) && !plan.has(1077));
    for text in ["", "msm3", "1001", "1005(x)", "1005(-1)", "msm7,,eph"] {
        assert!(text.parse::<Plan>().unwrap_err().contains("expected"), "{text}");
    }
}

#[test]
fn the_ephemeris_is_the_one_that_went_on_the_air_last() {
    let at = Epoch::from_week(2134, 50_000.0);
    let set = |toe_s: f64, sent_s: f64| {
        let toe = Epoch::from_week(2134, toe_s);
        Ephemeris { transmitted: Epoch::from_week(2134, sent_s), ..Ephemeris::blank(Sv::gps(1), toe) }
    };
    let sets = [set(50_400.0, 43_200.0), set(57_600.0, 50_400.0), set(43_200.0, 36_000.0)];
    assert_eq!(newest(&sets, at), [&sets[0]]);
    // None had: the nearest one.
    assert_eq!(newest(&sets[1..2], at), [&sets[1]]);
}
