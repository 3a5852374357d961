//! Redundancy of I/NAV, words 17 to 20: real ones against the real words 1 to 4 of the same issue, and sets
//! read with words missing.

use std::collections::BTreeMap;

use gnss::broadcast::Ephemeris;
use gnss::galileo::inav::{self, INAV, InavReader, redundancy};
use gnss::message::{Common, Read, Reader};
use gnss::satellite::Sv;
use gnss::time::Epoch;

use super::inav::real_pages;

/// Words 1 to 5 and 17 to 20 of satellites, by type.
fn shipped() -> BTreeMap<Sv, BTreeMap<u8, u128>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/witness/galileo_words.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let mut all: BTreeMap<Sv, BTreeMap<u8, u128>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let word = u128::from_str_radix(columns[2], 16).unwrap();
        all.entry(columns[0].parse().unwrap()).or_default().insert(columns[1].parse().unwrap(), word);
    }
    all
}

#[test]
fn real_words_17_to_20_are_the_redundancy_of_the_real_words_1_to_4() {
    let all = shipped();
    for (sv, words) in &all {
        let ours = redundancy([1, 2, 3, 4].map(|number| &words[&number]));
        for (number, word) in (17..).zip(ours) {
            assert_eq!(word, words[&number], "{sv} word {number}");
        }
    }
    assert!(all.len() >= 8, "{}", all.len());
}

#[test]
fn every_real_word_17_to_20_of_two_days_is_reproduced_bit_by_bit() {
    let files = ["navbits/046r_galinav.csv.gz", "navbits/233h_galinav_10min.csv.gz"];
    for (name, least) in files.into_iter().zip([1500, 270]) {
        let Some(pages) = real_pages(name) else { return };
        let mut words: BTreeMap<Sv, BTreeMap<u8, u128>> = BTreeMap::new();
        let mut same = 0;
        for page in &pages {
            let word = inav::word_of(&page.parts);
            let own = words.entry(page.sv).or_default();
            let number = inav::word_type(&word);
            match number {
                1..=4 => drop(own.insert(number, word)),
                17..=20 => {
                    let [Some(one), Some(two), Some(three), Some(four)] = [1, 2, 3, 4].map(|number| own.get(&number))
                    else {
                        continue;
                    };
                    let issue = |word: &u128| (word >> 112) as u32 & 0x3FF;
                    let is_whole = [two, three, four].iter().all(|word| issue(word) == issue(one));
                    if is_whole && (word >> 112) as u32 & 0b11 == issue(one) & 0b11 {
                        let ours = redundancy([one, two, three, four]);
                        assert_eq!(ours[usize::from(number - 17)], word, "{} {}", page.sv, page.start);
                        same += 1;
                    }
                }
                _ => {}
            }
        }
        println!("{name}: {same} words 17 to 20 are ours");
        assert!(same >= least, "{same}");
    }
}

/// Ephemerides that a reader finds in some words of a satellite, each in a page of its own.
fn read(sv: Sv, words: impl Iterator<Item = u128>) -> Vec<Ephemeris> {
    let mut reader = InavReader::new(sv);
    let near = Epoch::from_week(2353, 579_600.0);
    let mut sets = Vec::new();
    for word in words {
        for one in inav::encode_page(&inav::page(&word, near.plus_s(1.0))) {
            let news = reader.take(if one { -1.0 } else { 1.0 }, near);
            sets.extend(news.into_iter().filter_map(|read| match read {
                Read::Ephemeris(set) => Some(*set),
                _ => None,
            }));
        }
    }
    sets
}

#[test]
fn pages_with_redundancy_restore_the_real_words_1_to_4_and_others_none() {
    let sender = (INAV.sender)(&Common::default()).unwrap();
    // Seconds of a sub-frame at which words 2, 17 and 19 begin.
    for (of_subframe_s, restored) in [(1.0, false), (11.0, true), (13.0, true)] {
        for (sv, words) in shipped() {
            let of_set = [1, 2, 3, 4].map(|number| words[&number]);
            let sets = read(sv, of_set.into_iter().chain([words[&5]]));
            let units = sender.restored(&sets[0], Epoch::from_week(2353, 579_600.0 + of_subframe_s)).unwrap();
            let parameters = |unit: &Vec<bool>| (INAV.parameters)(unit).unwrap();
            let ours: Vec<_> = units.iter().map(parameters).collect();
            let start = Epoch::from_week(2353, 579_601.0);
            let real = of_set.map(|word| parameters(&inav::encode_page(&inav::page(&word, start))));
            assert_eq!(ours, if restored { real.to_vec() } else { Vec::new() }, "{sv}");
        }
    }
}

#[test]
fn as_many_of_words_17_to_20_replace_any_of_words_1_to_4_and_fewer_or_foreign_ones_do_not() {
    let all = shipped();
    let mut checked = 0;
    for (&sv, words) in &all {
        let pick = |numbers: &[u8]| numbers.iter().map(|number| words[number]).collect::<Vec<_>>();
        let [whole] = &read(sv, pick(&[1, 2, 3, 4, 5]).into_iter())[..] else { panic!("{sv}: no set") };
        // Bit n of the mask: word n + 1 is missing. At least one names the issue.
        for mask in 1_u8..15 {
            let own: Vec<u8> = (1..=4).filter(|number| mask >> (number - 1) & 1 == 0).collect();
            let lacking = 4 - own.len();
            for first in 0..=4 - lacking {
                let spare: Vec<u8> = (17..=20).skip(first).take(lacking).collect();
                let order = [&own[..], &[5], &spare[..]].concat();
                assert_eq!(&read(sv, pick(&order).into_iter()), std::slice::from_ref(whole), "{sv} {order:?}");
                let fewer = [&own[..], &[5], &spare[1..]].concat();
                assert!(read(sv, pick(&fewer).into_iter()).is_empty(), "{sv} {fewer:?}");
                // One wrong bit that the page's check did not see.
                let mut wrong = pick(&order);
                *wrong.last_mut().unwrap() ^= 1 << 40;
                assert!(read(sv, wrong.into_iter()).iter().all(|set| set != whole), "{sv} {order:?}");
                checked += 1;
            }
        }
    }
    assert!(checked > 200, "{checked}");
}
