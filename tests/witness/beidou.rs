//! BeiDou's codes by digests, D1 and D2 against real subframes and records, and orbits against precise ones.

use std::collections::BTreeMap;

use gnss::beidou::d1d2::{self, D1_D2, SUBFRAME_BITS, Subframe};
use gnss::beidou::in_phase::{B1I, B3I};
use gnss::bits::{Bits, bits_of};
use gnss::broadcast::Ephemeris;
use gnss::earth::{Geodetic, Look};
use gnss::klobuchar::Klobuchar;
use gnss::message::{Common, Read};
use gnss::rinex;
use gnss::satellite::{Sv, System};
use gnss::time::{BDT, Epoch};

use super::codes::holds;
use super::data::{external, orbit_is_recorded};
use super::orbit::{outside, sp3_columns};

/// Signal, PRN, ones, first and last 24 chips in hexadecimal, SHA-256 of a byte 0 or 1 for each chip.
const CODES: &str = include_str!("../../data/witness/beidou_codes.csv");

#[test]
fn all_chips_of_all_codes_are_those_of_another_program() {
    let mut codes = 0;
    for line in CODES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let signal = if column[0] == "B1I" { &B1I } else { &B3I };
        let signs = signal.code(column[1].parse().unwrap()).unwrap();
        let chips: Vec<u8> = signs.into_iter().map(|sign| u8::from(sign < 0)).collect();
        assert_eq!(chips.len(), signal.components[0].code_chips as usize);
        holds(&chips, &column[2..], line);
        codes += 1;
    }
    assert_eq!(codes, 126);
}

fn beidou(number: u8) -> Sv {
    Sv { system: System::BeiDou, number }
}

/// A real subframe without its interleaving: its time of GPS, its satellite, and its bits.
struct Real {
    at: Epoch,
    sv: Sv,
    subframe: Subframe,
}

fn real(name: &str) -> Option<Vec<Real>> {
    let text = std::fs::read_to_string(external(name)?).unwrap();
    let rows = text.lines().skip(1).filter(|line| !line.is_empty()).map(|line| {
        let column: Vec<&str> = line.split(',').collect();
        let nibbles = column[5].chars().map(|digit| u128::from(digit.to_digit(16).unwrap()));
        let bits: Vec<bool> = nibbles.flat_map(|nibble| bits_of(nibble, 4)).take(SUBFRAME_BITS).collect();
        let at = Epoch::from_week(column[0].parse().unwrap(), column[1].parse().unwrap());
        Real { at, sv: beidou(column[3].parse().unwrap()), subframe: Bits(bits.try_into().unwrap()) }
    });
    Some(rows.collect())
}

const FILES: [&str; 2] = ["navbits/20230919_bds_d1.csv", "navbits/gnsstk_bds_d1d2.csv"];

#[test]
fn real_subframes_keep_their_parities_and_come_back_through_our_interleaving() {
    let mut counts = [0, 0];
    for name in FILES {
        let Some(all) = real(name) else { return };
        for Real { sv, subframe, .. } in all {
            // Parities are made again, and are the real ones.
            assert_eq!(d1d2::decode(&d1d2::encode(&subframe)), Some(subframe), "{sv}");
            counts[usize::from(sv.is_geostationary())] += 1;
        }
    }
    assert_eq!(counts, [105, 148]);
}

/// The sets that our reader finds in real subframes, sent as code periods carry them, in order of time;
/// stamped with their `ends` or else with their beginnings.
fn sets(all: &[Real], ends: bool) -> BTreeMap<Sv, Vec<Ephemeris>> {
    let mut found: BTreeMap<Sv, Vec<Ephemeris>> = BTreeMap::new();
    let mut satellites: Vec<Sv> = all.iter().map(|real| real.sv).collect();
    satellites.sort();
    satellites.dedup();
    for sv in satellites {
        let mut reader = (D1_D2.reader)(sv);
        // There is one round of D2's pages: where bits begin has to be known before it, from a subframe that
        // comes twice.
        let own = || all.iter().filter(|real| real.sv == sv);
        for real in own().take(usize::from(sv.is_geostationary())).chain(own()) {
            let sent = d1d2::encode(&real.subframe);
            for (index, bit) in sent.iter().enumerate() {
                let symbols: Vec<bool> = if sv.is_geostationary() {
                    vec![*bit; 2]
                } else {
                    // Written out here: 0000 0100 1101 0100 1110.
                    "00000100110101001110".chars().map(|chip| *bit ^ (chip == '1')).collect()
                };
                for one in symbols {
                    let news = reader.take(if one { -1.0 } else { 1.0 }, BDT.label(real.at));
                    for read in news {
                        match read {
                            Read::Ephemeris(set) => found.entry(sv).or_default().push(*set),
                            Read::Unit { of_week_s, .. } => {
                                assert_eq!(index, SUBFRAME_BITS - 1);
                                // Stamped with their end, or with their beginning, of D2 within the frame.
                                let within_s = if sv.is_geostationary() {
                                    0.6 * f64::from(d1d2::id(&real.subframe) - 1)
                                } else {
                                    0.0
                                };
                                let said_s = of_week_s as f64 + if ends { 6.0 } else { within_s };
                                let stamp_s = BDT.label(real.at).tow_s();
                                assert!((stamp_s - said_s).abs() < 0.05, "{sv}: {stamp_s} {said_s}");
                            }
                            _ => {}
                        }
                    }
                }
            }
        }
    }
    found
}

#[test]
fn real_sets_are_the_records_of_a_converter_and_are_sent_by_us_bit_by_bit() {
    let Some(all) = real(FILES[0]) else { return };
    let Some(bytes) = outside("navbits/20230919_nav.rnx") else { return };
    let records = rinex::read(&bytes, "20230919_nav.rnx").unwrap().ephemerides;
    let records: Vec<&Ephemeris> = records.iter().filter(|set| set.sv.system == System::BeiDou).collect();
    let sets = sets(&all, true);
    let mut matched = 0;
    for (sv, sets) in &sets {
        for label in sets {
            let set = label.clone().timed(|at| BDT.instant(at));
            let Some(record) = records.iter().find(|record| (record.sv, record.toe) == (*sv, set.toe)) else {
                continue;
            };
            let close = |name: &str, one: f64, other: f64, step: f64| {
                // RINEX prints twelve digits after the first.
                assert!((one - other).abs() <= 0.5 * step + 1e-12 * one.abs(), "{sv} {name}: {one} {other}");
            };
            assert_eq!((set.toc, set.iode, set.iodc, set.aodo), (record.toc, record.iode, record.iodc, record.aodo));
            assert_eq!((set.ura_index, set.health), (record.ura_index, record.health));
            orbit_is_recorded(&set, record);
            close("cuc", set.cuc_rad, record.cuc_rad, libm::exp2(-31.0));
            close("cus", set.cus_rad, record.cus_rad, libm::exp2(-31.0));
            close("cic", set.cic_rad, record.cic_rad, libm::exp2(-31.0));
            close("cis", set.cis_rad, record.cis_rad, libm::exp2(-31.0));
            close("crc", set.crc_m, record.crc_m, libm::exp2(-6.0));
            close("crs", set.crs_m, record.crs_m, libm::exp2(-6.0));
            close("af0", set.af0_s, record.af0_s, libm::exp2(-33.0));
            close("af1", set.af1_sps, record.af1_sps, libm::exp2(-50.0));
            close("af2", set.af2_sps2, record.af2_sps2, libm::exp2(-66.0));
            close("tgd1", set.tgd_s, record.tgd_s, 1e-10);
            close("tgd2", set.tgd2_s, record.tgd2_s, 1e-10);
            matched += 1;
        }
        // Sent again by us, but for the ionosphere, which the satellites say and the set does not.
        let Some(set) = sets.last() else { continue };
        let Some(first) = all.iter().find(|real| real.sv == *sv && d1d2::id(&real.subframe) == 1) else { continue };
        let mut reader = (D1_D2.reader)(*sv);
        let near = BDT.label(first.at);
        let mut klobuchar = None;
        for real in all.iter().filter(|real| real.sv == *sv) {
            for bit in d1d2::encode(&real.subframe) {
                for chip in "00000100110101001110".chars() {
                    for read in reader.take(if bit ^ (chip == '1') { -1.0 } else { 1.0 }, near) {
                        if let Read::Ionosphere(gnss::ionosphere::Coefficients::KlobucharBeidou(found)) = read {
                            klobuchar = Some(found);
                        }
                    }
                }
            }
        }
        let sender = (D1_D2.sender)(&Common { klobuchar_beidou: klobuchar, ..Common::default() }).unwrap();
        for real in all.iter().filter(|real| real.sv == *sv && d1d2::id(&real.subframe) <= 3) {
            let second = i64::from(d1d2::second(&real.subframe));
            let start = near.nearest_tow(second / 30 * 30);
            let symbols = sender.unit(set, start).unwrap();
            let place = (second % 30 / 6) as usize * SUBFRAME_BITS;
            // Every code period of a bit, under the code as it is printed.
            for (bit, periods) in symbols.chunks_exact(20).enumerate() {
                let chips = "00000100110101001110".chars().zip(periods);
                assert!(chips.map(|(chip, one)| (chip == '1') ^ one).all(|one| one == periods[0]), "bit {bit}");
            }
            let bits: Vec<bool> = symbols.iter().step_by(20).skip(place).take(SUBFRAME_BITS).copied().collect();
            let ours = d1d2::decode(&bits).unwrap();
            let wrong: Vec<usize> = (0..SUBFRAME_BITS).filter(|at| ours.0[*at] != real.subframe.0[*at]).collect();
            // Four reserved bits of the header and one at the end of subframe 3, and their parities.
            let reserved = |at: &usize| (11..15).contains(at) || *at >= 291;
            assert!(wrong.iter().all(reserved), "{sv} subframe {}: {wrong:?}", d1d2::id(&real.subframe));
        }
    }
    println!("{} satellites, {matched} records equal", sets.len());
    assert!(matched >= 8, "{matched}");
}

#[test]
fn a_real_geostationary_satellite_stands_over_the_equator() {
    let Some(mut all) = real(FILES[1]) else { return };
    all.retain(|real| real.sv.is_geostationary());
    let sets = sets(&all, false);
    let own = sets.get(&beidou(1)).and_then(|sets| sets.last()).unwrap();
    let set = own.clone().timed(|at| BDT.instant(at));
    // 2021-07-15.
    assert_eq!(set.toe.week(), 2166);
    for hour in 0..6 {
        let state = set.state(set.toe.plus_s(600.0 * f64::from(hour))).unwrap();
        let longitude_deg = libm::atan2(state.position_m.y, state.position_m.x).to_degrees();
        // C01 stood at 140° E, and its successor of 2019 a little further; within 2.5° of the equator.
        let is_there = (139.0..146.0).contains(&longitude_deg);
        assert!((state.position_m.norm() - 42_164e3).abs() < 60e3 && is_there, "{longitude_deg} {state:?}");
        assert!(
            state.position_m.z.abs() < 42_164e3 * libm::sin(2.5_f64.to_radians()) && state.velocity_mps.norm() < 150.0
        );
        // The velocity is the place's derivative.
        let step = |s: f64| set.state(set.toe.plus_s(600.0 * f64::from(hour) + s)).unwrap().position_m;
        let numeric = (step(1.0) - step(-1.0)) / 2.0;
        assert!((numeric - state.velocity_mps).norm() < 1e-4, "{numeric:?} {:?}", state.velocity_mps);
    }
}

#[test]
fn broadcast_orbits_meet_precise_ones() {
    let Some(navigation) = outside("day177-2020/ESBC00DNK_R_20201770000_01D_MN.rnx.gz") else { return };
    let Some(precise) = outside("day177-2020/COD0MGXFIN_20201770000_01D_05M_ORB.SP3.gz") else { return };
    let sets = rinex::read(&navigation, "ESBC").unwrap().ephemerides;
    let (mut square, mut points, mut satellites) = (0.0, 0, Vec::new());
    for (at, places) in sp3_columns(&precise, "C") {
        for (sv, (position_m, _)) in places {
            let is_near = |set: &&Ephemeris| (0.0..=3600.0).contains(&at.since(set.toe));
            let near = sets.iter().rfind(|set| set.sv == sv && set.is_healthy() && is_near(set));
            let Some(set) = near else { continue };
            let off_m = (set.state(at).unwrap().position_m - position_m).norm();
            assert!(off_m < 20.0, "{sv} {at}: {off_m}");
            square += off_m * off_m;
            points += 1;
            if !satellites.contains(&sv) {
                satellites.push(sv);
            }
        }
    }
    let rms_m = libm::sqrt(square / f64::from(points));
    println!("{} satellites, {points} points: {rms_m:.2} m rms", satellites.len());
    // Orbits of BeiDou's second generation and antennas' offsets of a metre or two, which are left in.
    assert!(satellites.len() >= 6 && points > 500 && rms_m < 3.5, "{} {points} {rms_m}", satellites.len());
}

#[test]
fn delays_by_geographic_latitude_are_those_of_another_program() {
    // Coefficients that C34 broadcast on 2026-03-09; computed outside this project, time of week of BDT.
    let model = Klobuchar {
        alpha: [2.514570951462e-8, 3.799796104431e-7, -2.324581146240e-6, 3.159046173096e-6],
        beta: [1.80224e5, -1.097728e6, 4.194304e6, -1.900544e6],
    };
    for (latitude_deg, longitude_deg, azimuth_deg, elevation_deg, tow_s, delay_s) in [
        (26.5, 80.2, 210_f64, 20_f64, 374_386.0, 1.024217425576086e-7),
        (-33.0, 151.0, 300.0, 35.0, 20_000.0, 6.537578761768428e-8),
        (48.0, 11.0, 10.0, 70.0, 50_386.0, 2.619521612937355e-8),
    ] {
        let user = Geodetic::from_degrees(latitude_deg, longitude_deg, 0.0);
        let look = Look { azimuth_rad: azimuth_deg.to_radians(), elevation_rad: elevation_deg.to_radians() };
        let at = BDT.instant(Epoch::from_week(2409, tow_s));
        let found_s = model.beidou_delay_s(user, look, at, B1I.centre_hz());
        assert!((found_s - delay_s).abs() < 1e-19, "{found_s:e} {delay_s:e}");
        // The delay grows with the square of the wavelength.
        let ratio = model.beidou_delay_s(user, look, at, B3I.centre_hz()) / found_s;
        assert!((ratio - (1561.098_f64 / 1268.52).powi(2)).abs() < 1e-12);
    }
}
