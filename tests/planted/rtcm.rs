//! RTCM 3 against the standard's printed numbers and messages of real stations.

use std::io::Cursor;
use std::path::Path;

use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::glonass::fdma;
use gnss::satellite::System;
use gnss::signal::band_hz;
use gnss::time::Epoch;
use logs::log::{Log, Message};
use logs::observed::{Event, Observed, ObservedEpoch};
use logs::rtcm::framed;
use logs::rtcm::station::{Sender, Station};
use nalgebra::Vector3;

/// Messages of a shipped log of real stations, whose week is that of `near`.
fn messages(name: &str, near: Epoch) -> Vec<Message> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/witness/logs").join(name);
    Log::new(Cursor::new(std::fs::read(path).unwrap()), Some(near)).map(Result::unwrap).collect()
}

#[test]
fn the_printed_station_has_the_printed_check() {
    // RTCM 10403.3, 4.2: message 1005 of station 2003.
    let body = [
        0x3e, 0xd7, 0xd3, 0x02, 0x02, 0x98, 0x0e, 0xde, 0xef, 0x34, 0xb4, 0xbd, 0x62, 0xac, 0x09, 0x41, 0x98, 0x6f,
        0x33,
    ];
    let frame = framed(&body);
    assert_eq!(frame[..3], [0xd3, 0x00, 0x13]);
    assert_eq!(frame[22..], [0x36, 0x0b, 0x98]);
}

#[test]
fn real_messages_of_one_epoch_agree_in_time_and_in_code_and_carrier() {
    let all = messages("MIXED-RTCM3.rtcm3", Epoch::parse("2022-02-09T00:00:00").unwrap());
    let epochs: Vec<ObservedEpoch> = all
        .into_iter()
        .filter_map(|message| match message.event {
            Some(Event::Observations(epoch)) => Some(epoch),
            _ => None,
        })
        .collect();
    let systems: Vec<System> = epochs.iter().map(|epoch| epoch.values[0].sv.system).collect();
    assert_eq!(systems, [System::Gps, System::Glonass, System::Galileo, System::BeiDou]);
    for epoch in &epochs {
        assert_eq!(epoch.label, epochs[0].label, "{:?}", epoch.values[0].sv);
        for value in &epoch.values {
            let channel = fdma::channel(value.sv.number).filter(|_| value.sv.system == System::Glonass);
            let hz = band_hz(value.sv.system, value.code.as_bytes()[0], channel).unwrap();
            // The receiver begins its carriers near its codes, and the ionosphere has moved them apart since
            // then; a fine part of twice its size is up to 146 m off.
            let off_m = value.carrier_cycles.unwrap() * SPEED_OF_LIGHT_MPS / hz - value.pseudorange_m.unwrap();
            assert!(off_m.abs() < 60.0, "{} {}: {off_m}", value.sv, value.code);
        }
    }
}

#[test]
fn lock_times_are_those_of_the_printed_table() {
    let label = Epoch::parse("2022-02-09T00:00:00").unwrap();
    // DF407, table 3.5-75: the indicator of a lock time in milliseconds, and the least time that it means.
    for (lock_ms, indicator, least_ms) in
        [(63.0, 63, 63), (100.0, 82, 100), (1000.0, 190, 992), (1e5, 400, 98_304), (1e8, 704, 67_108_864)]
    {
        let value = Observed {
            sv: "G05".parse().unwrap(),
            code: "1C",
            pseudorange_m: Some(2.3e7),
            carrier_cycles: Some(1.2e8),
            doppler_hz: None,
            cn0_dbhz: Some(45.0),
            lock_s: Some(1e-3 * lock_ms),
            lost_lock: false,
            half_cycle_ambiguous: false,
        };
        let station = Station {
            number: 1,
            position_m: None,
            height_m: 0.0,
            antenna: String::new(),
            receiver: String::new(),
            version: String::new(),
        };
        let mut sender = Sender::new(station, "1077".parse().unwrap(), Vec::new());
        let bytes = sender.epoch(&ObservedEpoch { label, values: vec![value] });
        let message = Log::new(Cursor::new(bytes), Some(label)).next().unwrap().unwrap();
        assert_eq!(message.table.unwrap().integer(0, "DF407"), Some(indicator), "{lock_ms} ms");
        let Some(Event::Observations(epoch)) = message.event else { panic!("no observations") };
        assert_eq!(epoch.values[0].lock_s, Some(1e-3 * f64::from(least_ms)), "{lock_ms} ms");
    }
}

#[test]
fn real_ephemerides_are_orbits_of_their_systems() {
    let all = messages("NTRIP-USCL00CHL0.rtcm3", Epoch::from_week(2305, 324_000.0));
    let mut checked = 0;
    for message in &all {
        if let Some(Event::Ephemeris(set)) = &message.event
            && matches!(set.sv.system, System::Gps | System::Galileo)
        {
            // Planes at 55 and 56 degrees, to what the Moon and the Sun bend them by.
            let inclination_deg = set.i0_rad.to_degrees();
            assert!((52.0..59.0).contains(&inclination_deg), "{}: {inclination_deg}", set.sv);
            checked += 1;
        }
        if let Some(table) = message.table.as_ref().filter(|table| table.name == "1020") {
            let of = |names: [&str; 3]| Vector3::from(names.map(|name| table.number(0, name).unwrap()));
            let (position_km, velocity_kmps) = (of(["DF112", "DF115", "DF118"]), of(["DF111", "DF114", "DF117"]));
            // A circle of 25 510 km, to an eccentricity of 0.01; the axes turn with the Earth, which leaves
            // the angle between the two.
            assert!((position_km.norm() - 25_510.0).abs() < 255.0, "{position_km}");
            let cosine = position_km.dot(&velocity_kmps) / position_km.norm() / velocity_kmps.norm();
            assert!(cosine.abs() < 0.01, "{cosine}");
            checked += 1;
        }
    }
    assert!(checked >= 4, "{checked}");
}
