//! SBAS's places by real records, and its blocks read from any symbol on.

use gnss_twin::gnss::bits::number;
use gnss_twin::gnss::broadcast::Ephemeris;
use gnss_twin::gnss::fec::convolutional::Convolutional;
use gnss_twin::gnss::message::{Common, Read};
use gnss_twin::gnss::rinex;
use gnss_twin::gnss::satellite::System;
use gnss_twin::gnss::sbas::message::{SBAS, type_at};
use gnss_twin::gnss::time::Epoch;

use super::orbit::outside;

/// The merged records of a day.
const DAY: &str = "multi-gnss/BRD400DLR_S_20260680000_01D_MN.rnx.gz";
/// Those of three satellites that the program's scene uses.
const SHIPPED: &[u8] = include_bytes!("../../scenarios/gps_sbas_2026-03-09_11h.rnx");

fn of_sbas(all: Vec<Ephemeris>) -> Vec<Ephemeris> {
    all.into_iter().filter(|set| set.sv.system == System::Sbas).collect()
}

fn day() -> Option<Vec<Ephemeris>> {
    Some(of_sbas(rinex::read(&outside(DAY)?, DAY).unwrap().ephemerides))
}

/// Whether a set is whole steps of type 9: numbers of records have twelve digits.
fn is_whole_steps(set: &Ephemeris) {
    let sent = (SBAS.quantised)(set).unwrap();
    let (ours, theirs) = (sent.vector.unwrap(), set.vector.unwrap());
    // A hundredth of the steps: 8 cm, 0.625 mm/s, 12.5 µm/s².
    for (one, other, least) in [
        (ours.position_m, theirs.position_m, 8e-4),
        (ours.velocity_mps, theirs.velocity_mps, 6.25e-6),
        (ours.acceleration_mps2, theirs.acceleration_mps2, 1.25e-7),
    ] {
        assert!((one - other).norm() < least, "{} {}: {one} {other}", set.sv, set.toe);
    }
    assert!((sent.af0_s - set.af0_s).abs() < 4e-12 && (sent.af1_sps - set.af1_sps).abs() < 1e-14, "{}", set.sv);
    assert_eq!((sent.toe, sent.ura_index, sent.aodo), (set.toe, set.ura_index, set.aodo), "{} {}", set.sv, set.toe);
}

#[test]
fn shipped_sets_are_whole_steps_of_the_fields_and_are_read_again_from_any_symbol_and_either_way_up() {
    let own = of_sbas(rinex::read(SHIPPED, "shipped").unwrap().ephemerides);
    assert_eq!(own.len(), 12);
    let sender = (SBAS.sender)(&Common::default()).unwrap();
    for (place, set) in own.iter().enumerate() {
        is_whole_steps(set);
        assert!(set.is_healthy() && set.ura_index == 0);
        // Velocity is the derivative of the place to what rounds it, 2e-8 m over 2 s.
        for since_s in [-300.0, -10.0, 200.0] {
            let state = |more_s: f64| set.state(set.toe.plus_s(since_s + more_s)).unwrap();
            let derived_mps = (state(1.0).position_m - state(-1.0).position_m) * 0.5;
            assert!((derived_mps - state(0.0).velocity_mps).norm() < 1e-7, "{} {since_s}", set.sv);
        }
        let sent = (SBAS.quantised)(set).unwrap();
        let start = Epoch::new(set.toe.seconds() - 20, 0.0);
        let symbols: Vec<bool> = (0..20)
            .flat_map(|second| sender.unit(set, Epoch::new(start.seconds() + second, 0.0)).unwrap())
            .skip(37 * place)
            .collect();
        for inverted in [false, true] {
            let mut reader = (SBAS.reader)(set.sv);
            let (mut units, mut back, mut times) = (0, None, 0);
            for (count, one) in symbols.iter().enumerate() {
                for read in reader.take(if one ^ inverted { -1.0 } else { 1.0 }, start.plus_s(1e5)) {
                    match read {
                        Read::Unit { symbols, of_week_s, inverted: found } => {
                            let begun = 37 * place + count + 1 - symbols as usize;
                            assert_eq!((begun % 500, found), (0, inverted));
                            assert_eq!(of_week_s, start.tow_whole_s() + (begun / 500) as i64);
                            units += 1;
                        }
                        Read::Time(at) => {
                            assert_eq!(type_at(at), 12);
                            times += 1;
                        }
                        Read::Ephemeris(set) => back = Some(*set),
                        _ => {}
                    }
                }
            }
            let back = back.unwrap();
            assert_eq!(Ephemeris { transmitted: sent.transmitted, ..back }, sent, "{}", set.sv);
            // All but those before the first of type 12, and the one that ends with the symbols.
            assert!(units >= 11 && times >= 2, "{units} {times}");
        }
    }
}

/// The beginnings in turn, that of 53 hexadecimal at a multiple of six seconds of the week.
#[test]
fn blocks_begin_in_turn_and_say_their_type() {
    let set = &of_sbas(rinex::read(SHIPPED, "shipped").unwrap().ephemerides)[0];
    let sender = (SBAS.sender)(&Common::default()).unwrap();
    let code = Convolutional { second_inverted: false };
    for second in 0..12 {
        let start = Epoch::new(set.toe.seconds().div_euclid(6) * 6 + second, 0.0);
        let symbols = sender.unit(set, start).unwrap();
        let soft: Vec<f32> = symbols.iter().map(|one| if *one { -1.0 } else { 1.0 }).collect();
        let bits = code.decode_open(&soft);
        assert_eq!(number(&bits[..8]), [0x53, 0x9A, 0xC6][second as usize % 3]);
        assert_eq!(number(&bits[8..14]), u128::from(type_at(start)));
    }
}

#[test]
fn every_real_set_is_whole_steps_of_type_9_and_its_satellite_where_operators_say() {
    let Some(own) = day() else { return };
    for set in &own {
        is_whole_steps(set);
    }
    // Degrees east: Eutelsat 117 West B, SES-15 and Galaxy 30 of WAAS; GSAT-8, GSAT-10 and GSAT-15 of
    // GAGAN; QZS-3.
    for (number, longitude_deg) in
        [(31, -117.0), (33, -129.0), (35, -125.0), (27, 55.0), (28, 83.0), (32, 93.5), (37, 127.0)]
    {
        let mut seen = 0;
        for set in own.iter().filter(|set| set.sv.number == number) {
            let place_m = set.state(set.toe).unwrap().position_m;
            // Kept within a tenth of a degree, or two of inclination whose eights are as wide as a hundredth.
            let apart_deg = libm::atan2(place_m.y, place_m.x).to_degrees() - longitude_deg;
            assert!(apart_deg.abs() < 0.2, "{} {apart_deg}", set.sv);
            assert!((place_m.norm() - 42_164.2e3).abs() < 60e3, "{} {}", set.sv, place_m.norm());
            seen += 1;
        }
        assert!(seen > 100, "S{number} {seen}");
    }
    println!("{} sets", own.len());
}

#[test]
fn neighbouring_sets_of_four_minutes_meet_half_way() {
    let Some(own) = day() else { return };
    let (mut square, mut pairs) = (0.0, 0);
    for two in own.windows(2).filter(|two| two[0].sv == two[1].sv && two[1].toe.since(two[0].toe) == 256.0) {
        // Those that range; the others are known to kilometres at times.
        if !two.iter().all(Ephemeris::is_healthy) || ![31, 33, 35].contains(&two[0].sv.number) {
            continue;
        }
        let at = two[0].toe.plus_s(128.0);
        let [one, other] = [0, 1].map(|which: usize| two[which].state(at).unwrap().position_m);
        square += (one - other).norm_squared();
        pairs += 1;
    }
    let rms_m = (square / f64::from(pairs)).sqrt();
    println!("{pairs} pairs: {rms_m:.3} m rms");
    // Both say that they are good for 2 m; steps of their fields make 0.35 m.
    assert!(pairs > 900 && rms_m < 2.0, "{pairs} {rms_m}");
}
