//! SBAS's places by real records, its blocks read from any symbol on, and its corrections by printed blocks.

use gnss::augmentation::grid::{Point, points};
use gnss::augmentation::{Content, Degradation, GridMask, Mask};
use gnss::bits::number;
use gnss::broadcast::Ephemeris;
use gnss::fec::convolutional::Convolutional;
use gnss::message::{Common, Read};
use gnss::rinex;
use gnss::satellite::System;
use gnss::sbas::message::{SBAS, tables, type_at};
use gnss::time::Epoch;

use super::orbit::outside;

/// The merged records of a day.
const DAY: &str = "multi-gnss/BRD400DLR_S_20260680000_01D_MN.rnx.gz";
/// Records of three satellites that the program's scene uses.
const SHIPPED: &[u8] = include_bytes!("../../scenarios/gps_sbas_2026-03-09_11h.rnx");

fn of_sbas(all: Vec<Ephemeris>) -> Vec<Ephemeris> {
    all.into_iter().filter(|set| set.sv.system == System::Sbas).collect()
}

fn day() -> Option<Vec<Ephemeris>> {
    Some(of_sbas(rinex::read(&outside(DAY)?, DAY).unwrap().ephemerides))
}

/// Checks that a set is whole steps of type 9: numbers of records have twelve digits.
fn is_whole_steps(set: &Ephemeris) {
    let sent = SBAS.fields.quantised(set).unwrap();
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
fn shipped_sets_are_whole_steps_of_the_fields_and_are_read_again_from_any_symbol_inverted_or_not() {
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
        let sent = SBAS.fields.quantised(set).unwrap();
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

/// The bits of a block whose 212 bits of content are printed in hexadecimal digits.
fn printed(digits: &str) -> Vec<bool> {
    let digits = digits.chars().filter(|digit| !digit.is_whitespace());
    let content = digits.flat_map(|digit| {
        let value = digit.to_digit(16).unwrap();
        (0..4).rev().map(move |place| value >> place & 1 == 1)
    });
    let bits: Vec<bool> = vec![false; 14].into_iter().chain(content).collect();
    assert_eq!(bits.len(), 226);
    bits
}

/// Content of a block. Writing it gives the bits that it was read from.
fn read_and_written(kind: u8, bits: &Vec<bool>) -> Content {
    let content = Content::read(kind, bits).unwrap();
    let mut again = vec![false; 226];
    content.write(&mut again).unwrap();
    assert_eq!((content.kind(), &again), (kind, bits));
    content
}

/// Spirent, GSS6100 and SimCHAN user manual (DGP000814AAA 12-01), H.1.2.4 and H.1.2.8.
#[test]
fn blocks_of_a_mask_and_of_ageing_are_the_printed_ones() {
    let mask = printed("42420481000000000000000000 00010000000000000000000000 3");
    let numbers = vec![2, 7, 10, 15, 22, 25, 32, 120];
    assert_eq!(read_and_written(1, &mask), Content::Mask(Mask { iodp: 3, numbers }));
    let ageing = printed("0C000550555555555555555555 55555555555555555555555555 5");
    let Content::Degradation(said) = read_and_written(7, &ageing) else { panic!("no type 7") };
    let Degradation { latency_s, iodp, indicators } = *said;
    assert_eq!((latency_s, iodp, &indicators[..6]), (0, 3, &[0, 0, 0, 5, 5, 0][..]));
    assert_eq!(indicators[6..], [5; 45]);
}

/// Source: Spirent, GSS6100 and SimCHAN user manual (DGP000814AAA 12-01), H.1.2.12, with points of bands 2
/// and 3. They are chosen alike on both sides of the equator except for two. A mask of MSAS was decoded by a
/// receiver (ComNav, OEM board reference manual CNT-OEM-RM001 1.8, 4.2.10.11). Its points of a meridian are
/// complete between 5° and 50° north.
#[test]
fn points_of_printed_masks_of_the_grid_lie_where_the_bands_have_them() {
    let [second, third] = [
        "321FE00FF0890083FC07F81000 10FF007F8440441FC01FC10001 0",
        "331FF01FF0800081FC01FC1101 10FF007F8400041FE03FC10001 0",
    ]
    .map(|digits| {
        let Content::GridMask(mask) = read_and_written(18, &printed(digits)) else { panic!("no type 18") };
        mask
    });
    let on_earth = |mask: &GridMask| -> Vec<Point> {
        let all = points(mask.band);
        mask.points.iter().map(|number| all[usize::from(*number) - 1]).collect()
    };
    let alone = |mask: &GridMask| {
        let all = on_earth(mask);
        all.iter().filter(|(latitude, longitude)| !all.contains(&(-latitude, *longitude))).count()
    };
    assert_eq!((second.bands, second.band, second.iodi, third.bands, third.band, third.iodi), (3, 2, 0, 3, 3, 0));
    assert_eq!((alone(&second), alone(&third)), (2, 0));
    // The first meridian of band 3 has the points between 20° and 65° on both sides.
    let first: Vec<i16> = on_earth(&third).iter().filter(|point| point.1 == -60).map(|point| point.0).collect();
    assert_eq!(first[9..], [20, 25, 30, 35, 40, 45, 50, 55, 65]);
    // 208 bits of 201, without the head.
    let digits = "0003FFC180FFC0C03FF0001FF00007FC0000FC00003F00000000";
    let bits: Vec<bool> = digits
        .chars()
        .flat_map(|digit| (0..4).rev().map(move |place| digit.to_digit(16).unwrap() >> place & 1 == 1))
        .collect();
    let received: Vec<Point> =
        points(0).into_iter().zip(&bits).filter(|(_, set)| **set).map(|(point, _)| point).collect();
    for longitude in (-180..-145).step_by(5) {
        let north: Vec<i16> =
            received.iter().filter(|point| point.1 == longitude && (5..=50).contains(&point.0)).map(|p| p.0).collect();
        assert!(north.len() >= 5 && north.windows(2).all(|two| two[1] - two[0] == 5), "{longitude}: {north:?}");
        assert_eq!(north.last(), Some(&50));
    }
    assert_eq!(received.iter().filter(|point| point.0 < 0).count(), 4);
}

/// Fields fill the 212 bits of a block but for the spare ones that documents name: of type 6 none, of type 7
/// two, of type 10 eighty-one, of type 18 one, of type 24 four in its first half, of type 26 seven, of
/// type 27 fifteen, of half a block one or none.
#[test]
fn fields_of_corrections_fill_their_blocks_and_none_lies_on_another() {
    for (name, first, bits, spare) in [
        ("type 1", 14, 212, 0),
        ("types 0 and 2 to 5", 14, 212, 0),
        ("type 6", 14, 212, 0),
        ("type 7", 14, 212, 2),
        ("type 18", 14, 212, 1),
        ("type 24, first half", 14, 106, 4),
        ("types 24 and 25, half with velocity code 0", 0, 106, 1),
        ("types 24 and 25, half with velocity code 1", 0, 106, 0),
        ("type 26", 14, 212, 7),
        ("type 10", 14, 212, 81),
        ("type 17", 14, 212, 0),
        ("type 27", 14, 212, 15),
        ("type 28", 14, 212, 0),
    ] {
        let (_, fields) = tables().into_iter().find(|(other, _)| *other == name).unwrap();
        let mut taken = vec![false; first + bits];
        for (place, length) in fields.iter().flat_map(|field| field.pieces) {
            let (from, to) = (usize::from(*place), usize::from(*place) + usize::from(*length));
            assert!(taken[from..to].iter().all(|bit| !bit), "{name}: bits {from} to {to}");
            taken[from..to].fill(true);
        }
        // The velocity code is the first bit of either half.
        let code = usize::from(first == 0);
        let free = taken.iter().skip(first).filter(|bit| !**bit).count();
        assert_eq!(free - code, spare, "{name}");
        assert!(taken.iter().take(first).all(|bit| !bit), "{name}");
    }
}

/// Bits of a whole block, printed in hexadecimal digits with six bits of padding.
fn received(digits: &str) -> Vec<bool> {
    let bits = digits.chars().flat_map(|digit| {
        let value = digit.to_digit(16).unwrap();
        (0..4).rev().map(move |place| value >> place & 1 == 1)
    });
    bits.take(250).collect()
}

/// Real blocks of GAGAN (PRN 128) and MSAS (PRN 137), week 2286, 525602 s to 525609 s. Source: CSSRlib's
/// sample data (MIT licence), file `308c_sbas.txt`. Their checks are right, writing gives the bits again, and
/// values keep the ranges that the standard prints.
#[test]
fn real_blocks_of_degradation_and_covariances_are_read_and_written_again() {
    let factors = received("9a28360984c80130644dc53800ddc4b00000000000000000000000001005f7c0");
    assert_eq!((gnss::crc::crc24q(factors.iter().copied()), number(&factors[8..14])), (0, 10));
    let content = Content::read(10, &factors[..226].to_vec()).unwrap();
    let mut again = factors[..14].to_vec();
    again.resize(226, false);
    content.write(&mut again).unwrap();
    assert_eq!(again, factors[..226]);
    let Content::Factors(said) = content else { panic!("no type 10") };
    // Ten bits a field from bit 14 on: 216 steps of 2 mm, 76 of 2 mm, 200 of 0.05 mm/s, then 2 s.
    let raw = |first: usize, bits: usize| number(&factors[first..first + bits]) as f64;
    assert!((said.b_rrc_m - 0.002 * raw(14, 10)).abs() < 1e-9 && said.b_rrc_m < 2.047);
    assert!((said.c_ltc_v1_mps - 0.000_05 * raw(34, 10)).abs() < 1e-9 && said.c_ltc_v1_mps < 0.0512);
    assert_eq!((said.i_ltc_v1_s, said.i_ltc_v0_s), (raw(44, 9), raw(63, 9)));
    assert!((said.c_iono_ramp_mps - 0.000_005 * raw(126, 10)).abs() < 1e-12);
    for digits in [
        "c67364c45046a087f1d401c1a7fa2e365cb4e7184059d8fa7db445dd3a79d280",
        "c67330844241108009fb808027fc0600000000000000000000000000190a1600",
    ] {
        let block = received(digits);
        assert_eq!((gnss::crc::crc24q(block.iter().copied()), number(&block[8..14])), (0, 28));
        let content = Content::read(28, &block[..226].to_vec()).unwrap();
        let mut again = block[..14].to_vec();
        again.resize(226, false);
        content.write(&mut again).unwrap();
        assert_eq!(again, block[..226]);
        let Content::Covariances(said) = content else { panic!("no type 28") };
        for one in said.both.iter().filter(|one| one.place > 0) {
            assert!(one.place <= 51 && one.diagonal.iter().any(|element| *element > 0), "{one:?}");
            // Towards the Earth a bound is of the size of one: it multiplies that of the worst user.
            let sight = nalgebra::Vector3::new(0.6, 0.0, 0.8);
            let delta = one.delta(&sight, 0.0);
            assert!(delta.is_finite() && delta < 1e3, "{one:?} {delta}");
        }
    }
}
