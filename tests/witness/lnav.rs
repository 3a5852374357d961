//! LNAV against real subframes, the RINEX file of the same hour, and parity in its printed form.

use std::collections::BTreeMap;

use gnss::broadcast::Ephemeris;
use gnss::earth::GPS_PI;
use gnss::gps::lnav::{self, Almanac, Broadcast, FieldError, Subframe, SubframeError};
use gnss::klobuchar::Klobuchar;
use gnss::satellite::Sv;
use gnss::time::Epoch;
use proptest::prelude::*;

use super::data::{external, keplerian};

/// Rows of IS-GPS-200N, table 20-XIV: the starred bit, then the data bits of D25..D30.
const PARITY_ROWS: [(u32, &[u32]); 6] = [
    (29, &[1, 2, 3, 5, 6, 10, 11, 12, 13, 14, 17, 18, 20, 23]),
    (30, &[2, 3, 4, 6, 7, 11, 12, 13, 14, 15, 18, 19, 21, 24]),
    (29, &[1, 3, 4, 5, 7, 8, 12, 13, 14, 15, 16, 19, 20, 22]),
    (30, &[2, 4, 5, 6, 8, 9, 13, 14, 15, 16, 17, 20, 21, 23]),
    (30, &[1, 3, 5, 6, 7, 9, 10, 14, 15, 16, 17, 18, 21, 22, 24]),
    (29, &[3, 5, 6, 8, 9, 10, 11, 13, 15, 19, 22, 23, 24]),
];

/// The word sent for 24 source bits, by the rows as printed, bit by bit.
pub(super) fn printed_word(data: u32, previous: u32) -> u32 {
    let starred = |number: u32| (previous >> (30 - number)) & 1;
    let mut word = 0;
    for number in 1..=24 {
        word = (word << 1) | (((data >> (24 - number)) & 1) ^ starred(30));
    }
    for (star, bits) in PARITY_ROWS {
        word = (word << 1) | bits.iter().fold(starred(star), |sum, bit| sum ^ ((data >> (24 - bit)) & 1));
    }
    word
}

/// The 30 bits on the air of each stored word, which the file complements where D30* is 1.
fn received(hex: &str) -> [u32; 10] {
    let mut previous = 0;
    std::array::from_fn(|i| {
        let stored = u32::from_str_radix(&hex[8 * i..8 * i + 8], 16).unwrap() & 0x3FFF_FFFF;
        previous = if previous & 1 == 1 { stored ^ 0x3FFF_FFFF } else { stored };
        previous
    })
}

/// Satellite, week, TOW of the next subframe, words.
type RealSubframe = (Sv, u32, u32, [u32; 10]);

fn real_subframes() -> Option<Vec<RealSubframe>> {
    let text = std::fs::read_to_string(external("lnav/046r_gpslnav.txt")?).unwrap();
    let parse = |line: &str| {
        let column: Vec<&str> = line.split_whitespace().collect();
        let number = |i: usize| column[i].parse::<u32>().unwrap();
        (Sv::gps(number(2) as u8), number(0), number(1), received(column[5]))
    };
    Some(text.lines().map(parse).collect())
}

/// URA index of a RINEX accuracy in metres (IS-GPS-200N, 20.3.3.3.1.3).
fn ura_index(accuracy_m: f64) -> u8 {
    let limits = [2.4, 3.4, 4.85, 6.85, 9.65, 13.65, 24.0, 48.0, 96.0, 192.0, 384.0, 768.0, 1536.0, 3072.0, 6144.0];
    limits.iter().position(|limit| accuracy_m <= *limit).unwrap_or(15) as u8
}

/// GPS LNAV records of a RINEX 4 file by fixed columns.
fn rinex_records(text: &str) -> Vec<Ephemeris> {
    let lines: Vec<&str> = text.lines().collect();
    let mut records = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        if !(line.starts_with("> EPH G") && line.contains("LNAV")) {
            continue;
        }
        let (set, v) = keplerian(&lines[at + 1..]);
        let week = v(5, 2) as u32;
        records.push(Ephemeris {
            form: &lnav::LNAV_SETS,
            transmitted: Epoch::from_week(week, v(7, 0)),
            iodc: v(6, 3) as u16,
            ura_index: ura_index(v(6, 0)),
            health: v(6, 1) as u16,
            l2_codes: v(5, 1) as u8,
            l2_p_data_off: v(5, 3) != 0.0,
            long_fit: v(7, 1) > 4.0 || v(7, 1) == 1.0,
            tgd_s: v(6, 2),
            ..set
        });
    }
    records
}

/// Data bits that RINEX carries: not the reserved ones of subframe 1 (word 4 after its first bit, words 5
/// and 6, the first 16 bits of word 7), not AODO (subframe 2), not the two solved bits of word 10.
fn carried(id: u8) -> [u32; 10] {
    let mut mask = [0xFF_FFFF; 10];
    (mask[0], mask[1], mask[9]) = (0, 0, 0xFF_FFFC);
    match id {
        1 => (mask[3], mask[4], mask[5], mask[6]) = (0x80_0000, 0, 0, 0xFF),
        2 => mask[9] = 0xFF_FF80,
        _ => {}
    }
    mask
}

#[test]
fn real_subframes_decode_to_the_rinex_file_and_it_encodes_to_them() {
    let (Some(real), Some(path)) = (real_subframes(), external("lnav/046r_rnx.nav")) else { return };
    let records = rinex_records(&std::fs::read_to_string(path).unwrap());
    let all: Vec<Ephemeris> = Vec::new();
    let empty = Broadcast::new(None, 18, &all, Epoch::from_week(2353, 579_600.0)).unwrap();
    let mut parts: BTreeMap<Sv, [Option<Subframe>; 3]> = BTreeMap::new();
    let (mut decoded, mut matched, mut sets) = (0, 0, 0);
    for (sv, week, next_tow, words) in &real {
        let subframe = Subframe::decode(words, 0).unwrap();
        decoded += 1;
        assert_eq!(subframe.tow_count * 6, *next_tow);
        assert!(subframe.antispoof && !subframe.alert);
        if subframe.id > 3 {
            continue;
        }
        let parts = parts.entry(*sv).or_default();
        parts[usize::from(subframe.id) - 1] = Some(subframe);
        let start = Epoch::from_week(*week, f64::from(*next_tow) - 6.0);
        let [Some(one), Some(two), Some(three)] = parts else { continue };
        let Ok(heard) = lnav::ephemeris(*sv, one, two, three, start.plus_s(300.0 * 604_800.0)) else { continue };
        let Some(record) = records.iter().find(|r| r.sv == *sv && r.iodc == heard.iodc && r.toe == heard.toe) else {
            continue;
        };
        let mut rounded = lnav::LNAV.fields.quantised(record).unwrap();
        (rounded.aodo, rounded.transmitted) = (heard.aodo, heard.transmitted);
        assert_eq!(rounded, heard);
        sets += 1;
        let sent = empty.subframe(record, start).unwrap();
        let sent = Subframe::decode(&sent, 0).unwrap();
        assert_eq!((sent.id, sent.tow_count), (subframe.id, subframe.tow_count));
        for (word, mask) in carried(subframe.id).into_iter().enumerate() {
            assert_eq!(sent.data[word] & mask, subframe.data[word] & mask, "{sv} {} word {}", subframe.id, word + 1);
        }
        // With what RINEX leaves out taken from the air, subframes 2 and 3 are the same words, parity
        // included (from word 3 on: the telemetry message also decides the polarity of word 2).
        if subframe.id > 1 {
            let complete = Ephemeris { aodo: heard.aodo, ..record.clone() };
            assert_eq!(empty.subframe(&complete, start).unwrap()[2..], words[2..]);
        }
        matched += 1;
    }
    println!("{decoded} real subframes decoded; {matched} of 1 to 3 equal RINEX bit by bit, {sets} element sets");
    assert_eq!(decoded, 5811);
    assert!(matched > 2000, "{matched}");
}

#[test]
fn real_pages_of_subframes_4_and_5_are_where_ours_are_and_say_what_ours_would() {
    let (Some(real), Some(path)) = (real_subframes(), external("lnav/046r_rnx.nav")) else { return };
    let records = rinex_records(&std::fs::read_to_string(path).unwrap());
    let everyone: Vec<Ephemeris> =
        (1..=32).filter(|n| *n != 21).map(|n| Ephemeris { sv: Sv::gps(n), ..records[0].clone() }).collect();
    let zero = Klobuchar { alpha: [0.0; 4], beta: [0.0; 4] };
    let reference = Epoch::from_week(2353, 579_600.0);
    let ours = Broadcast::new(Some(zero), 18, &everyone, reference).unwrap();
    // The real almanac's reference time, read off its page: 61 440 s of week 2354.
    let toa = Epoch::from_week(2354, 61_440.0);
    let (mut pages, mut almanacs, mut page_18) = (0, 0, 0);
    let (mut along_rad, mut node_rad) = (0.0_f64, 0.0_f64);
    for (sv, week, next_tow, words) in &real {
        let subframe = Subframe::decode(words, 0).unwrap();
        let Some(sv_id) = subframe.sv_id() else { continue };
        let start = Epoch::from_week(*week, f64::from(*next_tow) - 6.0);
        let mine = Subframe::decode(&ours.subframe(&records[0], start).unwrap(), 0).unwrap();
        assert_eq!(mine.data[2] >> 16, subframe.data[2] >> 16, "{sv} {start}");
        pages += 1;
        match sv_id {
            0 => assert_eq!(mine.data[2..9], subframe.data[2..9]),
            // Some satellites fill the correction table's page like a reserved one.
            52 if subframe.data[3] != 0xAA_AAAA => assert_eq!(mine.data[2..9], subframe.data[2..9]),
            _ => {}
        }
        if let Some(utc) = subframe.utc() {
            // The leap second of 2016-12-31 (week 1929, day 7) was the last one; 1929 modulo 256 is 137.
            assert_eq!((utc.leap_s, utc.leap_after_s, utc.event_week, utc.event_day), (18, 18, 137, 7));
            assert_eq!(i64::from(utc.week), 2354 % 256);
            assert!(utc.a0_s.abs() < 1e-6, "GPS time is steered to UTC within a microsecond");
            let klobuchar = subframe.klobuchar().unwrap();
            // Same page of our own encoder, from the decoded values.
            let again = Broadcast::new(Some(klobuchar), 18, &[], reference).unwrap();
            let again = Subframe::decode(&again.subframe(&records[0], start).unwrap(), 0).unwrap();
            assert_eq!(again.parameters()[..8], subframe.parameters()[..8]);
            assert!(klobuchar.alpha[0] > 0.0 && klobuchar.beta[0] > 72_000.0);
            page_18 += 1;
        }
        let Some(almanac) = subframe.almanac() else { continue };
        let Some(record) = records.iter().find(|r| r.sv.number == almanac.number) else { continue };
        if almanac.toa_s != toa.tow_s() {
            continue;
        }
        let derived = Almanac::derive(record, toa);
        let turn = |a: f64, b: f64| ((a - b) / (2.0 * GPS_PI) - ((a - b) / (2.0 * GPS_PI)).round()) * 2.0 * GPS_PI;
        // A fitted almanac leaves out the half-daily terms that an ephemeris follows; measured at most 6e-5
        // rad along the orbit and 3.4e-5 rad in the node, held to three times that. The node's momentary rate
        // differs by up to 1e-9 rad/s. A node of the wrong week would be 0.12 rad off, a missing correction
        // of the mean motion 3.6e-4 rad along the orbit.
        assert!((derived.eccentricity - almanac.eccentricity).abs() < 2e-4);
        assert!((derived.delta_i_rad - almanac.delta_i_rad).abs() < 2e-4);
        assert!(turn(derived.omega0_rad, almanac.omega0_rad).abs() < 1e-4);
        assert!(turn(derived.omega_rad + derived.m0_rad, almanac.omega_rad + almanac.m0_rad).abs() < 2e-4);
        assert!((derived.sqrt_a_sqrtm - almanac.sqrt_a_sqrtm).abs() < 0.02);
        assert!((derived.omega_dot_radps - almanac.omega_dot_radps).abs() < 1.5e-9);
        assert!((derived.af0_s - almanac.af0_s).abs() < 5e-6);
        along_rad = along_rad.max(turn(derived.omega_rad + derived.m0_rad, almanac.omega_rad + almanac.m0_rad).abs());
        node_rad = node_rad.max(turn(derived.omega0_rad, almanac.omega0_rad).abs());
        almanacs += 1;
    }
    println!("{pages} real pages where ours are, {page_18} of page 18, {almanacs} almanacs against derived ones:");
    println!("at most {along_rad:.1e} rad along the orbit, {node_rad:.1e} rad in the node");
    assert!(pages > 2000 && page_18 > 10 && almanacs > 90, "{pages} {page_18} {almanacs}");
}

fn example() -> Ephemeris {
    let toe = Epoch::from_week(2353, 583_200.0);
    Ephemeris {
        sv: Sv::gps(5),
        form: &lnav::LNAV_SETS,
        toe,
        toc: toe,
        transmitted: Epoch::from_week(2353, 576_000.0),
        iode: 42,
        iodc: 0x300 + 42,
        ura_index: 1,
        health: 0,
        l2_codes: 1,
        l2_p_data_off: false,
        long_fit: false,
        aodo: 11,
        sqrt_a_sqrtm: 5153.7,
        eccentricity: 0.0056,
        m0_rad: 1.7,
        delta_n_radps: 4.4e-9,
        omega0_rad: -1.6,
        omega_dot_radps: -8.1e-9,
        omega_rad: 1.3,
        i0_rad: 0.97,
        idot_radps: 3.9e-10,
        cuc_rad: 3.5e-6,
        cus_rad: 6.1e-6,
        crc_m: 271.0,
        crs_m: 69.7,
        cic_rad: 2.2e-8,
        cis_rad: -1.2e-7,
        af0_s: -2.0e-4,
        af1_sps: -1.0e-12,
        af2_sps2: 0.0,
        tgd_s: -1.07e-8,
        tgd2_s: 0.0,
        axis_rate_mps: 0.0,
        delta_n_rate_radps2: 0.0,
        isc_s: [0.0; 6],
        reference_flag: 0,
        signal_delays_s: Vec::new(),
        vector: None,
    }
}

#[test]
fn every_field_extreme_round_trips_and_one_step_more_is_refused() {
    for (page, fields) in lnav::tables() {
        let mut taken = [0_u32; 10];
        for field in fields {
            let (minimum, maximum) = field.range();
            for raw in [minimum, minimum + 1, -1_i64.min(maximum), 0, 1, maximum - 1, maximum] {
                if raw < minimum || raw > maximum {
                    continue;
                }
                for background in [0, 0xFF_FFFF] {
                    let mut data = [background; 10];
                    field.write(&mut data, raw);
                    assert_eq!(field.read(&data), raw, "{page}: {}", field.name);
                }
                assert_eq!(field.raw(field.value(raw)), Ok(raw), "{page}: {}", field.name);
            }
            // Bits of different fields never overlap, and none is a parity bit.
            let mut bits = [0; 10];
            field.write(&mut bits, -1);
            assert_eq!(bits.iter().map(|b| b.count_ones()).sum::<u32>(), field.bits(), "{page}: {}", field.name);
            for (used, new) in taken.iter_mut().zip(bits) {
                assert_eq!(*used & new, 0, "{page}: {}", field.name);
                *used |= new;
            }
            if field.kind != lnav::Kind::Turn {
                assert!(field.raw(field.value(maximum + 1)).is_err(), "{page}: {}", field.name);
                assert!(field.raw(field.value(minimum - 1)).is_err(), "{page}: {}", field.name);
            }
            assert!(field.raw(f64::NAN).is_err() && field.raw(f64::INFINITY).is_err(), "{page}: {}", field.name);
        }
    }
}

#[test]
fn what_does_not_fit_or_contradicts_itself_is_an_error_with_its_name() {
    let wide = Ephemeris { crs_m: 2000.0, ..example() };
    assert!(matches!(
        lnav::LNAV.fields.quantised(&wide),
        Err(FieldError::OutOfRange { name: "crs_m", value: 2000.0, .. })
    ));
    let odd = Ephemeris { toe: example().toe.plus_s(8.0), ..example() };
    assert!(matches!(lnav::LNAV.fields.quantised(&odd), Err(FieldError::NotMultiple { name: "toe_s", .. })));
    let issue = Ephemeris { iode: 43, ..example() };
    assert!(matches!(lnav::LNAV.fields.quantised(&issue), Err(FieldError::Issue { .. })));
}

#[test]
fn a_week_s_last_frame_carries_its_own_week_and_the_next_week_s_first_count() {
    let broadcast = Broadcast::new(None, 18, &[example()], example().toe).unwrap();
    // Week 3071 is 1023 modulo 1024; toe lies in week 3072.
    let toe = Epoch::from_week(3072, 0.0);
    let sent = Ephemeris { toe, toc: toe, ..example() };
    let start = Epoch::from_week(3071, 604_770.0);
    let at = |k: i64| {
        let words = broadcast.subframe(&sent, start.plus_s(6.0 * k as f64)).unwrap();
        assert!(words[1] & 3 == 0 && words[9] & 3 == 0);
        Subframe::decode(&words, 0).unwrap()
    };
    assert_eq!((at(4).id, at(4).tow_count, at(5).id, at(5).tow_count), (5, 0, 1, 1));
    let heard = lnav::ephemeris(sent.sv, &at(0), &at(1), &at(2), Epoch::from_week(3100, 5.0)).unwrap();
    assert_eq!(heard, Ephemeris { transmitted: start, ..lnav::LNAV.fields.quantised(&sent).unwrap() });
    // The same from raw parameters, whether they are asked about in the week that they name or after its end.
    let raw: BTreeMap<&str, i64> = (0..3).flat_map(|k| at(k).parameters()).collect();
    for near in [start, Epoch::from_week(3072, 30.0)] {
        let found = lnav::LNAV.fields.elements(sent.sv, &|name| raw.get(name).copied(), near).unwrap();
        assert_eq!((found.toe, found.toc), (toe, toe), "{near}");
    }
    assert!(matches!(
        lnav::ephemeris(sent.sv, &at(0), &at(2), &at(1), start),
        Err(SubframeError::Id { id: 3, expected: "2" })
    ));
    // Upside down, the same words decode to the same data.
    let words = broadcast.subframe(&sent, start).unwrap();
    assert_eq!(Subframe::decode(&words.map(|word| word ^ 0x3FFF_FFFF), 3), Ok(at(0)));
}

proptest! {
    #[test]
    fn parity_is_the_printed_one_and_finds_any_one_or_two_wrong_bits(
        data in 0_u32..1 << 24, previous in 0_u32..4, first in 0_u32..32, second in 0_u32..32,
    ) {
        let word = printed_word(data, previous);
        prop_assert_eq!(lnav::check_parity(word, previous), Some(data));
        // Bits 30 and 31 of the code word are D30* and D29*.
        let code = (u64::from(previous) << 30) | u64::from(word);
        let wrong = code ^ (1 << first) ^ if first == second { 0 } else { 1 << second };
        prop_assert_eq!(lnav::check_parity((wrong & 0x3FFF_FFFF) as u32, (wrong >> 30) as u32), None);
    }

    #[test]
    fn quantising_twice_is_quantising_once_and_sending_decodes_to_it(
        m0_rad in -10.0..10.0_f64, omega0_rad in -3.15..3.15_f64, eccentricity in 0.0..0.5_f64,
        i0_rad in -3.1..3.1_f64, af0_s in -9e-4..9e-4_f64, crs_m in -1000.0..1000.0_f64,
    ) {
        let given = Ephemeris { m0_rad, omega0_rad, eccentricity, i0_rad, af0_s, crs_m, ..example() };
        let once = lnav::LNAV.fields.quantised(&given).unwrap();
        prop_assert_eq!(&lnav::LNAV.fields.quantised(&once).unwrap(), &once);
        let broadcast = Broadcast::new(None, 18, &[], given.toe).unwrap();
        let start = given.transmitted;
        let heard: Vec<Subframe> = (0..3)
            .map(|k| Subframe::decode(&broadcast.subframe(&given, start.plus_s(6.0 * f64::from(k))).unwrap(), 0).unwrap())
            .collect();
        let back = lnav::ephemeris(given.sv, &heard[0], &heard[1], &heard[2], start).unwrap();
        prop_assert_eq!(back, once);
    }
}
