//! Galileo I/NAV against real pages, the symbols of one as received, and the RINEX records of the same hour.

use std::collections::BTreeMap;

use gnss::broadcast::Ephemeris;
use gnss::earth::GPS_PI;
use gnss::galileo::inav::{self, INAV, InavReader};
use gnss::inflate;
use gnss::message::{Common, Read, Reader};
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;

use super::data::{external, keplerian, orbit_is_recorded};

/// A page on the air: satellite, whether on E1-B, start, and both parts of 120 bits.
pub struct RealPage {
    pub sv: Sv,
    pub on_e1b: bool,
    pub start: Epoch,
    pub parts: [Vec<bool>; 2],
}

pub fn real_pages(name: &str) -> Option<Vec<RealPage>> {
    let packed = std::fs::read(external(name)?).unwrap();
    let text = String::from_utf8(inflate::inflate(&packed, 1 << 26).unwrap()).unwrap();
    let parse = |line: &str| {
        let column: Vec<&str> = line.split(',').collect();
        let number = |i: usize| column[i].parse::<u32>().unwrap();
        let digits = column[5].chars().map(|digit| digit.to_digit(16).unwrap());
        let bits: Vec<bool> = digits.flat_map(|digit| (0..4).rev().map(move |bit| digit >> bit & 1 == 1)).collect();
        RealPage {
            sv: Sv { system: System::Galileo, number: number(3) as u8 },
            on_e1b: column[4] == "E1B",
            // The file says when the page ends.
            start: Epoch::from_week(number(0), f64::from(number(1)) - 2.0),
            parts: [bits[..120].to_vec(), bits[120..240].to_vec()],
        }
    };
    Some(text.lines().skip(1).map(parse).collect())
}

/// Galileo I/NAV records of a RINEX 4 file by fixed columns; satellite, reference time and issue, then the
/// rest.
fn rinex_records(text: &str) -> Vec<Ephemeris> {
    let lines: Vec<&str> = text.lines().collect();
    let mut records = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        if !(line.starts_with("> EPH E") && line.contains("INAV")) {
            continue;
        }
        let (set, v) = keplerian(&lines[at + 1..]);
        records.push(Ephemeris { iodc: set.iode, tgd2_s: v(6, 2), tgd_s: v(6, 3), ..set });
    }
    records
}

#[test]
fn the_symbols_of_a_page_as_received_decode_and_encode_back_to_themselves() {
    let Some(path) = external("navbits/galileo_page_symbols.csv") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let part = |name: &str| -> Vec<bool> {
        let line = text.lines().find_map(|line| line.strip_prefix(name)).unwrap();
        line.trim_start_matches(',').chars().map(|symbol| symbol == '1').collect()
    };
    // The file leaves the patterns out.
    let pattern = "0101100000".chars().map(|symbol| symbol == '1');
    let symbols: Vec<bool> =
        ["INAV_even", "INAV_odd"].into_iter().flat_map(|name| pattern.clone().chain(part(name))).collect();
    for sense in [1.0_f32, -1.0] {
        let soft: Vec<f32> = symbols.iter().map(|&one| if one { -sense } else { sense }).collect();
        let (parts, inverted) = inav::decode_soft(&soft).expect("a page with a right check");
        assert_eq!(inverted, sense < 0.0);
        assert_eq!(inav::encode_page(&parts), symbols);
    }
}

#[test]
fn real_pages_pass_their_checks_say_their_time_and_have_the_words_in_the_order_of_ours() {
    let Some(pages) = real_pages("navbits/046r_galinav.csv.gz") else { return };
    let (mut checked, mut timed, mut in_order) = (0, 0, 0);
    for RealPage { sv, on_e1b, start, parts } in &pages {
        let symbols = inav::encode_page(parts);
        let soft: Vec<f32> = symbols.iter().map(|&one| if one { -1.0 } else { 1.0 }).collect();
        let (decoded, _) = inav::decode_soft(&soft).unwrap_or_else(|| panic!("{sv} {start}: no page"));
        assert_eq!(&decoded, parts, "{sv} {start}");
        checked += 1;
        let word = inav::word_of(&decoded);
        let mut reader = InavReader::new(*sv);
        let news: Vec<Read> = soft.iter().flat_map(|soft| reader.take(*soft, *start)).collect();
        for read in &news {
            match read {
                Read::Unit { symbols, of_week_s, inverted } => {
                    assert_eq!((*symbols, *of_week_s, *inverted), (500, start.tow_whole_s(), false), "{sv} {start}");
                    timed += 1;
                }
                Read::Time(time) => assert_eq!(time, start, "{sv}"),
                _ => {}
            }
        }
        let expected = inav::word_at(*start);
        // Older satellites send neither reduced elements nor redundancy.
        let sent = inav::word_type(&word);
        if *on_e1b && expected != 0 && !(expected >= 16 && sent == 0) {
            assert_eq!(sent, expected, "{sv} {start}");
            in_order += 1;
        }
    }
    println!("{checked} pages, {timed} with their time, {in_order} words of E1-B in their places");
    assert_eq!(checked, 33_658);
    assert!(timed > 17_000 && in_order > 9000, "{timed} {in_order}");
}

#[test]
fn real_sets_are_the_records_of_two_converters_and_are_sent_by_us_bit_by_bit() {
    let Some(pages) = real_pages("navbits/046r_galinav.csv.gz") else { return };
    let files = ["lnav/046r_rnx.nav", "navbits/sept046r.nav"];
    let Some(files) = files.iter().map(|name| external(name)).collect::<Option<Vec<_>>>() else { return };
    let records: Vec<Ephemeris> =
        files.iter().flat_map(|path| rinex_records(&std::fs::read_to_string(path).unwrap())).collect();
    let mut readers: BTreeMap<(Sv, bool), (InavReader, Epoch)> = BTreeMap::new();
    let mut sets: BTreeMap<(Sv, u16), Ephemeris> = BTreeMap::new();
    let (mut matched, mut resent) = (0, 0);
    let sender = (INAV.sender)(&Common::default()).unwrap();
    for RealPage { sv, on_e1b, start, parts } in &pages {
        let (reader, next) = readers.entry((*sv, *on_e1b)).or_insert((InavReader::new(*sv), *start));
        if start != next {
            reader.skip();
        }
        *next = start.plus_s(2.0);
        for one in inav::encode_page(parts) {
            for read in reader.take(if one { -1.0 } else { 1.0 }, *start) {
                if let Read::Ephemeris(set) = read {
                    sets.insert((*sv, set.iode), *set);
                }
            }
        }
        // What was decoded before is sent again by the satellite, and by us.
        let word = inav::word_of(parts);
        let number = inav::word_type(&word);
        if !on_e1b || !(1..=4).contains(&number) {
            continue;
        }
        let issue = (word >> 112 & 0x3FF) as u16;
        let Some(set) = sets.get(&(*sv, issue)) else { continue };
        let symbols = sender.unit(set, *start).unwrap();
        let soft: Vec<f32> = symbols.iter().map(|&one| if one { -1.0 } else { 1.0 }).collect();
        let ours = inav::word_of(&inav::decode_soft(&soft).unwrap().0);
        // The last two bits of words 1, 2 and 4 are reserved.
        let mask = if number == 3 { u128::MAX } else { !3 };
        assert_eq!(ours & mask, word & mask, "{sv} word {number} of issue {issue}");
        resent += 1;
    }
    for record in &records {
        let Some(set) = sets.get(&(record.sv, record.iode)).filter(|set| set.toe == record.toe) else { continue };
        let close = |name: &str, one: f64, other: f64, step: f64| {
            // RINEX prints twelve digits after the first.
            let printed = 1e-12 * one.abs();
            assert!((one - other).abs() <= 0.5 * step + printed, "{} {name}: {one} {other}", record.sv);
        };
        assert_eq!(set.toc, record.toc, "{}", record.sv);
        orbit_is_recorded(set, record);
        let all = [
            (set.cuc_rad, record.cuc_rad),
            (set.cus_rad, record.cus_rad),
            (set.cic_rad, record.cic_rad),
            (set.cis_rad, record.cis_rad),
        ];
        all.into_iter().for_each(|(one, other)| close("harmonic", one, other, libm::exp2(-29.0)));
        close("crc", set.crc_m, record.crc_m, libm::exp2(-5.0));
        close("crs", set.crs_m, record.crs_m, libm::exp2(-5.0));
        close("af0", set.af0_s, record.af0_s, libm::exp2(-34.0));
        close("af1", set.af1_sps, record.af1_sps, libm::exp2(-46.0));
        close("af2", set.af2_sps2, record.af2_sps2, libm::exp2(-59.0));
        close("bgd e5a", set.tgd2_s, record.tgd2_s, libm::exp2(-32.0));
        close("bgd e5b", set.tgd_s, record.tgd_s, libm::exp2(-32.0));
        matched += 1;
    }
    println!("{} sets, {matched} records of two converters equal, {resent} words sent again", sets.len());
    assert!(sets.len() >= 40 && matched >= 80 && resent > 4000, "{} {matched} {resent}", sets.len());
}

/// The raw integer of a field of a word, by the word's name in the tables.
fn raw(table: &str, name: &str, word: &u128) -> f64 {
    let (_, fields) = inav::tables().into_iter().find(|(known, _)| *known == table).unwrap();
    let field = fields.into_iter().find(|field| field.name == name).unwrap();
    field.value(field.read(word))
}

#[test]
fn real_almanacs_and_reduced_elements_describe_the_orbits_of_the_same_hour() {
    let Some(pages) = real_pages("navbits/046r_galinav.csv.gz") else { return };
    let mut readers: BTreeMap<Sv, (InavReader, Epoch)> = BTreeMap::new();
    let mut sets: BTreeMap<Sv, Ephemeris> = BTreeMap::new();
    let (mut almanacs, mut reduced, mut offsets) = (0, 0, 0);
    let sender = (INAV.sender)(&Common::default()).unwrap();
    let turn = |angle: f64| libm::remainder(angle, std::f64::consts::TAU).abs();
    for RealPage { sv, start, parts, .. } in pages.iter().filter(|page| page.on_e1b) {
        let (reader, next) = readers.entry(*sv).or_insert((InavReader::new(*sv), *start));
        if start != next {
            reader.skip();
        }
        *next = start.plus_s(2.0);
        for one in inav::encode_page(parts) {
            for read in reader.take(if one { -1.0 } else { 1.0 }, *start) {
                if let Read::Ephemeris(set) = read {
                    sets.insert(*sv, *set);
                }
            }
        }
        let word = inav::word_of(parts);
        match inav::word_type(&word) {
            // The first satellite of a triple stands in word 7 whole, but for its clock.
            7 => {
                let of = |name| raw("word 7", name, &word);
                let other = Sv { system: System::Galileo, number: of("svid") as u8 };
                let Some(set) = sets.get(&other) else { continue };
                let toa = set.toe.nearest_tow(of("toa_10min") as i64 * 600);
                let mean = set.mean_at(toa);
                // As far as an almanac of some days is right.
                assert!((of("delta_sqrt_a_sqrtm") + 29.6e6_f64.sqrt() - mean.sqrt_a_sqrtm).abs() < 0.2, "{other}");
                assert!((of("eccentricity") - set.eccentricity).abs() < 1e-4, "{other}");
                assert!((of("delta_i_rad") + 56.0 / 180.0 * GPS_PI - mean.inclination_rad).abs() < 5e-4, "{other}");
                assert!(turn(of("omega0_rad") - mean.omega0_rad) < 2e-3, "{other}");
                let along = of("m0_rad") + of("omega_rad") - mean.m0_rad - set.omega_rad;
                assert!(turn(along) < 0.05, "{other}");
                almanacs += 1;
            }
            // Offset of GPS time: that which the receiver's own converter wrote for the hour.
            10 => {
                let offset = inav::gps_offset(&word, *start).unwrap();
                assert_eq!((offset.a0_s, offset.a1_sps), (52.0 * libm::exp2(-35.0), -9.0 * libm::exp2(-51.0)));
                assert_eq!(offset.reference, Epoch::from_week(2354, 0.0));
                offsets += 1;
            }
            16 => {
                let Some(set) = sets.get(sv) else { continue };
                let symbols = sender.unit(set, *start).unwrap();
                let soft: Vec<f32> = symbols.iter().map(|&one| if one { -1.0 } else { 1.0 }).collect();
                let ours = inav::word_of(&inav::decode_soft(&soft).unwrap().0);
                let apart = |name| raw("word 16", name, &ours) - raw("word 16", name, &word);
                // Both are fitted to ten minutes; where the axis falls on another step, the real clock makes
                // up for it. How good they are as ranges, `reduced` holds.
                assert!(apart("delta_axis_m").abs() <= 2048.0, "{sv} {}", apart("delta_axis_m"));
                assert!(apart("ex").abs() < 6e-5 && apart("ey").abs() < 6e-5, "{sv}");
                assert!(apart("delta_i_rad").abs() < 5e-5 && turn(apart("omega0_rad")) < 4e-5, "{sv}");
                assert!(turn(apart("latitude_rad")) < 4e-5, "{sv} {}", apart("latitude_rad"));
                assert!(apart("af0_s").abs() < 5e-7 && apart("af1_sps").abs() < 1e-10, "{sv}");
                reduced += 1;
            }
            _ => {}
        }
    }
    println!("{almanacs} almanac entries, {reduced} reduced sets, {offsets} offsets of GPS time");
    assert!(almanacs > 100 && reduced > 1400 && offsets > 500, "{almanacs} {reduced} {offsets}");
}
