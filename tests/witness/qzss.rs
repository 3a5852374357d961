//! QZSS's LNAV by real records, its CNAV by real messages, and its codes in a real recording.

use std::collections::BTreeMap;

use gnss::bits::number;
use gnss::broadcast::Ephemeris;
use gnss::crc::crc24q;
use gnss::fec::convolutional::Convolutional;
use gnss::gps::cnav::{message_type, type_at};
use gnss::message::{Common, Message, Read};
use gnss::qzss::civil::{CNAV, CNAV_L2C, CNAV_SETS};
use gnss::qzss::l1c::L1C;
use gnss::qzss::l1ca::L1_CA;
use gnss::qzss::l2c::L2C;
use gnss::qzss::l5::L5;
use gnss::qzss::lnav::LNAV;
use gnss::qzss::satellites;
use gnss::rinex;
use gnss::samples::{Format, IfMetadata};
use gnss::satellite::{Sv, System};
use gnss::signal::{Link, Signal};
use gnss::time::{Epoch, Rate};
use receiver::acquire::{AcquisitionSettings, Searcher};
use receiver::source::Block;

use super::cnav;
use super::data::external;
use super::orbit::outside;
use super::recording;

/// Records of an hour with all that was broadcast over Japan, and the merged ones of a day.
const HOUR: &str = "navbits/233h_rnx.nav.gz";
const DAY: &str = "multi-gnss/BRD400DLR_S_20260680000_01D_MN.rnx.gz";

fn sets(name: &str) -> Option<Vec<Ephemeris>> {
    let all = rinex::read(&outside(name)?, name).unwrap().ephemerides;
    Some(all.into_iter().filter(|set| set.sv.system == System::Qzss).collect())
}

#[test]
fn real_sets_are_whole_steps_of_the_fields_and_are_sent_and_read_again() {
    // `grep -c '> EPH J.. LNAV'`.
    for (name, count) in [(HOUR, 10), (DAY, 105)] {
        let Some(own) = sets(name) else { return };
        assert_eq!(own.len(), count, "{name}");
        let sender = (LNAV.sender)(&Common::default()).unwrap();
        for set in &own {
            // RINEX prints twelve digits of radians: 1e-12 of an angle of π, a hundredth of its step.
            let sent = LNAV.fields.quantised(set).unwrap();
            for (one, other, step) in [
                (sent.m0_rad, set.m0_rad, 1.5e-9),
                (sent.omega0_rad, set.omega0_rad, 1.5e-9),
                (sent.i0_rad, set.i0_rad, 1.5e-9),
                (sent.eccentricity, set.eccentricity, 1.2e-10),
                (sent.sqrt_a_sqrtm, set.sqrt_a_sqrtm, 1.9e-6),
                (sent.crs_m, set.crs_m, 0.03125),
                (sent.af0_s, set.af0_s, 4.7e-10),
            ] {
                assert!((one - other).abs() < 0.01 * step, "{name} {} {}: {one} {other}", set.sv, set.toe);
            }
            let mut reader = (LNAV.reader)(set.sv);
            let start = Epoch::new(set.toe.seconds() - 1800, 0.0);
            let mut read = Vec::new();
            // From a subframe before on, for its last two bits, to one after, whose handover word proves
            // the first.
            for unit in -1..6 {
                for one in sender.unit(set, Epoch::new(start.seconds() + 6 * unit, 0.0)).unwrap() {
                    read.extend(reader.take(if one { -1.0 } else { 1.0 }, start));
                }
            }
            let back = read.into_iter().find_map(|read| match read {
                Read::Ephemeris(back) => Some(*back),
                _ => None,
            });
            let back = back.unwrap();
            // Delays of other signals' messages are not LNAV's.
            let sent = Ephemeris { signal_delays_s: Vec::new(), ..sent };
            assert_eq!(Ephemeris { transmitted: sent.transmitted, ..back }, sent, "{name} {}", set.sv);
        }
    }
}

#[test]
fn satellites_with_l1c_b_say_that_l1_c_a_is_not_to_be_used_and_others_that_it_is() {
    let Some(own) = sets(HOUR) else { return };
    for set in own {
        // The other program's records: 1 of those without L1C/B, 16 of those without L1 C/A.
        assert_eq!(
            (set.is_healthy(), set.health),
            match set.sv.number {
                2 | 3 | 7 => (true, 1),
                _ => (false, 16),
            }
        );
    }
}

#[test]
fn neighbouring_sets_of_an_hour_meet_half_way_and_turn_with_the_earth() {
    let Some(own) = sets(DAY) else { return };
    let (mut square, mut pairs) = (0.0, 0);
    for two in own.windows(2).filter(|two| two[0].sv == two[1].sv && two[1].toe.since(two[0].toe) == 3600.0) {
        let at = two[0].toe.plus_s(1800.0);
        let [one, other] = [0, 1].map(|which| two[which].state(at).unwrap());
        square += (one.position_m - other.position_m).norm_squared();
        pairs += 1;
        // Within 8° of longitude about 135° E where it crosses the equator, or over it all the time.
        let period_s = std::f64::consts::TAU / two[0].mean_motion_radps();
        assert!((period_s - 86_164.0).abs() < 60.0, "{} {period_s}", two[0].sv);
    }
    let rms_m = (square / f64::from(pairs)).sqrt();
    println!("{pairs} pairs: {rms_m:.3} m rms");
    assert!(pairs > 50 && rms_m < 1.0, "{pairs} {rms_m}");
}

/// Health that another program wrote: of LNAV by bits of signals, of CNAV by carriers.
#[test]
fn sets_of_lnav_carried_to_cnav_say_the_health_that_satellites_send_there() {
    let Some(own) = sets(HOUR) else { return };
    let Some(path) = external(HOUR) else { return };
    let mut compared = 0;
    for record in cnav::records(&path, 'J') {
        let Some(set) = own.iter().find(|set| set.sv == record.sv) else { continue };
        let carried = (CNAV.form)(set);
        assert_eq!(f64::from(carried.health), record.rows[6][1], "{}", set.sv);
        assert!(carried.is_healthy_on(&L5).unwrap() && set.is_healthy_on(&L5).unwrap(), "{}", set.sv);
        compared += 1;
    }
    assert_eq!(compared, 10);
    // J01 of 2021-09-22, when it was not to be used: all bits but the last.
    let ill = Ephemeris { health: 62, ..own[0].clone() };
    for signal in [&L1_CA, &L1C, &L2C, &L5] {
        assert_eq!(ill.is_healthy_on(signal), Some(false), "{signal}");
        let message = signal.components.iter().find_map(|component| component.message).unwrap();
        assert_eq!((message.form)(&ill).is_healthy_on(signal), Some(false), "{signal}");
    }
}

/// Checks the broadcast signals of satellites: L1 C/A by the health of LNAV of five days, L2C by messages of
/// two.
#[test]
fn satellites_send_the_signals_that_they_broadcast() {
    for (date, with, without) in [
        ("2020-06-25T12:00:00", &[1, 2, 3][..], &[][..]),
        ("2021-09-22T06:30:00", &[1, 2, 3, 7], &[]),
        ("2023-03-12T12:00:00", &[2, 3, 4, 7], &[]),
        ("2025-02-15T17:00:00", &[2, 3, 4, 7], &[]),
        ("2025-08-21T07:00:00", &[2, 3, 7], &[4, 8]),
        ("2026-03-09T12:00:00", &[2, 3, 7], &[4, 8]),
    ] {
        let at = Epoch::parse(date).unwrap();
        assert!(with.iter().all(|number| satellites::sends_l1ca(*number, at)), "{date}");
        assert!(without.iter().all(|number| !satellites::sends_l1ca(*number, at)), "{date}");
    }
    for (name, date) in [(CIVIL[0], "2025-02-15T17:00:00"), (CIVIL[1], "2025-08-21T07:00:00")] {
        let (Some(all), Some(of_l2c)) = (cnav::real(name, ("L5", &CNAV)), cnav::real(name, ("L2C", &CNAV_L2C))) else {
            return;
        };
        let at = Epoch::parse(date).unwrap();
        for sent in &all {
            let own = of_l2c.iter().any(|other| other.sv == sent.sv);
            assert_eq!(satellites::sends_l2c(sent.sv.number, at), own, "{}", sent.sv);
        }
    }
}

/// Messages of two hours, and the records of them.
const CIVIL: [&str; 2] = ["navbits/046r_qzscnav.csv.gz", "navbits/233h_qzscnav.csv.gz"];
const RECORDS: [&str; 2] = ["lnav/046r_rnx.nav", HOUR];

/// Checks that a message of a set equals our own at a time when its type has its turn. Exceptions are counts
/// of time, times of prediction, accuracies, flags and data common to all satellites.
fn is_sent(message: &Message, set: &Ephemeris, sent: &cnav::Sent) -> bool {
    let kind = message_type(&sent.bits);
    let in_week = |turn: i64| Epoch::new(sent.start.seconds() + turn * message.unit_s, 0.0);
    let start = (0..4).map(in_week).find(|start| type_at(message, *start) == kind).unwrap();
    let symbols = (message.sender)(&Common::default()).unwrap().unit(set, start).unwrap();
    let code = Convolutional { second_inverted: false };
    let ours = code.decode_open(&symbols.iter().map(|one| cnav::soft(*one)).collect::<Vec<f32>>());
    let compared = |place: &usize| match kind {
        10 => !(54..65).contains(place) && *place < 271,
        11 => *place < 269,
        _ => !(38..60).contains(place) && *place < 192,
    };
    (0..276).filter(|place| !(20..37).contains(place)).filter(compared).all(|place| ours[place] == sent.bits[place])
}

#[test]
fn every_real_message_of_l5_and_l2c_is_read_and_sent_again_and_its_sets_are_the_records_of_the_hour() {
    for (name, file) in CIVIL.into_iter().zip(RECORDS) {
        for of @ (signal, message) in [("L5", &CNAV), ("L2C", &CNAV_L2C)] {
            let Some(all) = cnav::real(name, of) else { return };
            // Group delays of message 30 change by a step at times within the hour of a set.
            let mut sets: BTreeMap<(Sv, i64), Vec<Ephemeris>> = BTreeMap::new();
            for sent in &all {
                assert_eq!(crc24q(sent.bits.iter().copied()), 0, "{} {}", sent.sv, sent.start);
                let head = (number(&sent.bits[..8]), number(&sent.bits[8..14]));
                assert_eq!(head, (0x8B, u128::from(sent.sv.number)), "{} {}", sent.sv, sent.start);
            }
            for own in all.chunk_by(|a, b| a.sv == b.sv) {
                for read in cnav::read(message, own, false) {
                    if let Read::Ephemeris(set) = read {
                        assert_eq!(set.form, &CNAV_SETS);
                        sets.entry((set.sv, set.toe.seconds())).or_default().push(*set);
                    }
                }
            }
            let (mut resent, mut tried) = (0, 0);
            for sent in all.iter().filter(|sent| [10, 11, 30].contains(&message_type(&sent.bits))) {
                let place = [(10, 70), (11, 38), (30, 60)].into_iter().find(|(of, _)| *of == message_type(&sent.bits));
                let place = place.unwrap().1;
                let toe_s = number(&sent.bits[place..place + 11]) as i64 * 300;
                let of_toe = |set: &&Ephemeris| set.sv == sent.sv && set.toe.tow_whole_s() == toe_s;
                let own: Vec<&Ephemeris> = sets.values().flatten().filter(of_toe).collect();
                tried += usize::from(!own.is_empty());
                resent += usize::from(own.into_iter().any(|set| is_sent(message, set, sent)));
            }
            let Some(path) = external(file) else { return };
            let latest = sets.iter().map(|(key, own)| (*key, own[own.len() - 1].clone())).collect();
            let records = cnav::records(&path, 'J').into_iter();
            let of_record = |one: &cnav::Record| {
                let own = sets.get(&(one.sv, one.toc.seconds())).into_iter().flatten();
                // Half a step of 2⁻³⁵ s.
                let delay = |set: &Ephemeris| (set.tgd_s - one.rows[6][2]).abs() < 1.5e-11;
                cnav::agrees_in_orbit_and_clock(one, &latest) && own.clone().any(delay)
            };
            let matched = records.filter(of_record).count();
            let (count, sets) = (all.len(), sets.len());
            println!(
                "{name} {signal}: {count} messages, {sets} sets, {resent} of {tried} sent again, {matched} records"
            );
            assert!(count > 800 && tried > 300 && resent == tried && matched >= 3, "{tried} {resent} {matched}");
        }
    }
}

/// Pilots of L1C that others found in it at 0 Hz (J02) and beside it (J03).
#[test]
fn a_recording_holds_the_pilots_of_l1c_of_qzss_and_their_secondary_codes_begin_when_travel_from_their_height_allows() {
    let Some((i, q)) = recording::read("if/pocket_l1_2021-12-02_4msps_ci8.bin", Format::Ci8) else { return };
    let metadata = IfMetadata { inverted: true, ..recording::metadata(Format::Ci8, 4e6, 0.0) };
    let settings = AcquisitionSettings { doppler_max_hz: 2000.0, ..AcquisitionSettings::default() };
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let of = |system, signal: &'static Signal, number| signal.link(Sv { system, number });
    let links = [of(System::Qzss, &L1C, 2), of(System::Qzss, &L1C, 3), of(System::Qzss, &L1C, 5)];
    let rows = searcher.search(&Block { first: 0, i: &i, q: &q }, &links).unwrap();
    let hits: Vec<_> = rows.into_iter().filter_map(|(_, hit)| hit).collect();
    assert_eq!(hits.iter().map(|hit| hit.sv.number).collect::<Vec<_>>(), [2, 3], "{hits:?}");
    let begins_s: Vec<f64> = (hits.iter())
        .map(|hit| {
            let pilot = &L1C.components[0];
            let chips = [(pilot.code)(hit.sv.number).unwrap(), pilot.secondary_code.of(hit.sv.number).unwrap()];
            let (begun_s, lead) = recording::secondary_code_begins_s(hit, [&i, &q], 4e6, [&chips[0], &chips[1]]);
            println!(
                "{} {:.0} Hz: its secondary code begins {begun_s:.4} s after the first sample, {lead:.2}",
                hit.sv, hit.doppler_hz
            );
            // 49 prompts agree; the best of 1800 places and 121 frequencies by chance reaches half of that.
            assert!(lead > 1.5, "{lead}");
            begun_s
        })
        .collect();
    // Both are 32 600 km to 39 000 km from their ground points, and up to 42 000 km at the horizon.
    assert!(recording::after_s(begins_s[0], begins_s[1]).abs() < 0.032, "{begins_s:?}");
}

#[test]
fn a_recording_holds_the_satellites_whose_l1c_others_found_in_it() {
    let Some(path) = external("if/pocket_l1_2021-12-02_4msps_ci8.bin") else { return };
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Format::Ci8.unpack(&std::fs::read(path).unwrap(), &mut i, &mut q);
    let rate = Rate::from_hz(4e6).unwrap();
    let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: L1_CA.centre_hz(), inverted: false, start: None };
    let candidates: Vec<Link> = L1_CA.satellites().map(|sv| L1_CA.link(sv)).collect();
    assert_eq!(candidates.len(), 10);
    let settings = AcquisitionSettings { signals: vec![L1_CA.name.to_owned()], ..AcquisitionSettings::default() };
    let mut searcher = Searcher::new(&metadata, &settings).unwrap();
    let rows = searcher.search(&Block { first: 0, i: &i, q: &q }, &candidates).unwrap();
    let found: Vec<(u8, f64)> =
        rows.iter().filter_map(|(_, hit)| hit.as_ref()).map(|hit| (hit.sv.number, hit.doppler_hz)).collect();
    println!("{found:?}");
    // L1C of J02 at 0 Hz, J03, J07, J01 and J04 (another program, grid of 250 Hz).
    assert!(found.iter().all(|(number, _)| [1, 2, 3, 4, 7].contains(number)), "{found:?}");
    assert!(found.iter().any(|(number, doppler_hz)| *number == 2 && doppler_hz.abs() < 250.0), "{found:?}");
}
