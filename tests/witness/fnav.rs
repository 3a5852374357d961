//! Galileo F/NAV and I/NAV on E5b against real pages and the RINEX records of the same hours.

use std::collections::BTreeMap;

use gnss::broadcast::Ephemeris;
use gnss::crc::crc24q;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::galileo::fnav::{self, FNAV, FnavReader};
use gnss::galileo::inav::{self, INAV, INAV_E5B};
use gnss::inflate;
use gnss::message::{Common, Message, Read, Reader};
use gnss::rinex;
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;

use super::data::external;
use super::inav::{RealPage, real_pages};

/// Pages of both signals of one issue of eight satellites, in turn with their words on E1-B of the same hour.
const PAGES: &str = include_str!("../../data/witness/galileo_e5_pages.csv");
const WORDS: &str = include_str!("../../data/witness/galileo_words.csv");

/// A page of E5a on the air: satellite, start, and its bits with check and tail.
struct Page {
    sv: Sv,
    start: Epoch,
    bits: Vec<bool>,
}

fn bits(hex: &str, count: usize) -> Vec<bool> {
    let digits = hex.chars().map(|digit| digit.to_digit(16).unwrap());
    let all: Vec<bool> = digits.flat_map(|digit| (0..4).rev().map(move |bit| digit >> bit & 1 == 1)).collect();
    all[..count].to_vec()
}

fn soft(symbols: &[bool]) -> Vec<f32> {
    symbols.iter().map(|&one| if one { -1.0 } else { 1.0 }).collect()
}

fn real(name: &str) -> Option<Vec<Page>> {
    let packed = std::fs::read(external(name)?).unwrap();
    let text = String::from_utf8(inflate::inflate(&packed, 1 << 26).unwrap()).unwrap();
    let parse = |line: &str| {
        let column: Vec<&str> = line.split(',').collect();
        let number = |i: usize| column[i].parse::<u32>().unwrap();
        Page {
            sv: Sv { system: System::Galileo, number: number(3) as u8 },
            // The file says when the page ends.
            start: Epoch::from_week(number(0), f64::from(number(1)) - 10.0),
            bits: bits(column[5], 244),
        }
    };
    Some(text.lines().skip(1).map(parse).collect())
}

fn shipped() -> (Vec<Page>, Vec<RealPage>) {
    let (mut e5a, mut e5b) = (Vec::new(), Vec::new());
    for line in PAGES.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let sv: Sv = column[1].parse().unwrap();
        let start = Epoch::from_week(column[2].parse().unwrap(), column[3].parse().unwrap());
        if column[0] == "E5a" {
            e5a.push(Page { sv, start, bits: bits(column[4], 244) });
        } else {
            let both = bits(column[4], 240);
            e5b.push(RealPage { sv, on_e1b: false, start, parts: [both[..120].to_vec(), both[120..].to_vec()] });
        }
    }
    (e5a, e5b)
}

/// Gives a reader whole pages; what it says of each.
fn told(pages: &[Page], mut take: impl FnMut(&Page, Vec<Read>)) {
    let mut readers: BTreeMap<Sv, (FnavReader, Epoch)> = BTreeMap::new();
    for page in pages {
        let (reader, next) = readers.entry(page.sv).or_insert((FnavReader::new(page.sv), page.start));
        if page.start != *next {
            reader.skip();
        }
        *next = page.start.plus_s(10.0);
        let symbols = fnav::encode_page(&page.bits[..214]);
        take(page, symbols.into_iter().flat_map(|one| reader.take(if one { -1.0 } else { 1.0 }, page.start)).collect());
    }
}

/// Checks every real page: its check and tail, its bits through our code and interleaver and through our
/// tables, its time, and its position. Returns true if its time was read.
fn holds(page: &Page, reads: &[Read]) -> bool {
    let Page { sv, start, bits } = page;
    let (head, check) = (&bits[..214], &bits[214..238]);
    assert_eq!(check.iter().fold(0, |all, bit| all << 1 | u32::from(*bit)), crc24q(head.iter().copied()));
    assert!(bits[238..].iter().all(|bit| !bit));
    let (decoded, inverted) = fnav::decode_soft(&soft(&fnav::encode_page(head))).unwrap();
    assert!(decoded == head && !inverted, "{sv} {start}");
    let kind = fnav::page_type(&decoded);
    // Every bit but type, flags of storms and spare ones is in a field, and is what the field writes.
    let name = format!("page {kind}");
    let (_, fields) = fnav::tables().into_iter().find(|(table, _)| *table == name).unwrap();
    let mut written = decoded.clone();
    for bit in written.iter_mut().skip(6) {
        *bit = !*bit;
    }
    for field in fields {
        field.write(&mut written, field.read(&decoded));
    }
    let unread = |place: usize| match kind {
        1 => (138..143).contains(&place) || place >= 188,
        3 => place >= 206,
        4 => place >= 209,
        6 => place >= 211,
        _ => false,
    };
    assert!((0..214).all(|place| unread(place) != (written[place] == decoded[place])), "{sv} {start} page {kind}");
    // Almanacs begin at places of the satellite's own.
    if kind < 5 {
        assert_eq!(kind, fnav::page_at(*start), "{sv} {start}");
    }
    let unit = Read::Unit { symbols: 500, of_week_s: start.tow_whole_s(), inverted: false };
    assert!(kind > 4 || reads.contains(&unit), "{sv} {start} page {kind}");
    let dated = reads.iter().find_map(|read| if let Read::Time(time) = read { Some(*time) } else { None });
    assert!(dated.is_none_or(|time| time == *start), "{sv}");
    dated.is_some()
}

/// Checks that a page of a set equals our own of it, except for other parts of the page.
fn is_sent(set: &Ephemeris, page: &Page) {
    let sender = (FNAV.sender)(&Common::default()).unwrap();
    let (ours, _) = fnav::decode_soft(&soft(&sender.unit(set, page.start).unwrap())).unwrap();
    let shared = |place: usize| match fnav::page_type(&ours) {
        // The ionosphere, UTC and GPS time.
        1 => !(102..143).contains(&place),
        4 => !(48..189).contains(&place),
        _ => true,
    };
    assert!((0..214).all(|place| !shared(place) || ours[place] == page.bits[place]), "{} {}", page.sv, page.start);
}

#[test]
fn shipped_pages_of_e5a_and_e5b_hold_and_are_sent_by_us_bit_by_bit() {
    let (e5a, e5b) = shipped();
    let mut sets: BTreeMap<Sv, Ephemeris> = BTreeMap::new();
    told(&e5a, |page, reads| {
        holds(page, &reads);
        for read in reads {
            if let Read::Ephemeris(set) = read {
                sets.insert(page.sv, *set);
            }
        }
    });
    assert_eq!((e5a.len(), e5b.len(), sets.len()), (48, 48, 8));
    e5a.iter().filter(|page| fnav::page_type(&page.bits) < 5).for_each(|page| is_sent(&sets[&page.sv], page));
    // The words of E1-B of the same issues.
    let mut words: BTreeMap<Sv, BTreeMap<u8, u128>> = BTreeMap::new();
    for line in WORDS.lines().skip(1) {
        let column: Vec<&str> = line.split(',').collect();
        let word = u128::from_str_radix(column[2], 16).unwrap();
        words.entry(column[0].parse().unwrap()).or_default().insert(column[1].parse().unwrap(), word);
    }
    let e5b_sender = (INAV_E5B.sender)(&Common::default()).unwrap();
    let (mut squares, mut sent) = ([0.0; 2], 0);
    for (sv, set) in &sets {
        let raw = |name: &str| {
            let all = words[sv].iter().filter(|(kind, _)| **kind <= 5);
            all.filter_map(|(_, word)| inav::parameters(word)).flatten().find(|(other, _)| *other == name).map(|p| p.1)
        };
        let other = INAV.fields.elements(*sv, &raw, set.transmitted).unwrap();
        let orbit = |set: &Ephemeris| {
            let e = set;
            let rates = [e.delta_n_radps, e.omega_dot_radps, e.idot_radps, e.cuc_rad, e.cus_rad, e.crc_m, e.crs_m];
            let rest = [e.cic_rad, e.cis_rad, e.sqrt_a_sqrtm, e.eccentricity, e.m0_rad, e.omega0_rad, e.omega_rad];
            (e.toe, e.toc, e.iode, rates, rest, e.i0_rad, e.tgd2_s)
        };
        assert_eq!(orbit(set), orbit(&other), "{sv}");
        // Both clocks are of one satellite: what is between them are the group delays, to the steps of these
        // (0.07 m each) and the errors of two estimates.
        let apart_m = |one: &Ephemeris| SPEED_OF_LIGHT_MPS * (one.af0_s - set.af0_s);
        squares[0] += apart_m(&(FNAV.form)(&other)).powi(2) / 8.0;
        squares[1] += apart_m(&Ephemeris {
            tgd_s: other.tgd2_s,
            tgd2_s: other.tgd_s,
            ..(FNAV.form)(&Ephemeris { tgd_s: other.tgd2_s, tgd2_s: other.tgd_s, ..other.clone() })
        })
        .powi(2)
            / 8.0;
        for page in e5b.iter().filter(|page| page.sv == *sv) {
            let kind = inav::word_type(&inav::word_of(&page.parts));
            assert_eq!((INAV_E5B.number)(page.start), kind, "{sv}");
            let symbols = e5b_sender.unit(&other, page.start).unwrap();
            let (ours, _) = inav::decode_soft(&soft(&symbols)).unwrap();
            // All but the ionosphere, delays and status of word 5 and the two last bits of words 1, 2 and 4.
            let mask = match kind {
                1 | 2 | 4 => !3,
                5 => 0x1FF_FFFF << 30 | 0x3FF << 71 | 0x3F << 122,
                _ => u128::MAX,
            };
            if kind > 0 {
                assert_eq!(inav::word_of(&ours) & mask, inav::word_of(&page.parts) & mask, "{sv} word {kind}");
            }
            // What has no word's content: the even part's head, and reserved bits.
            assert_eq!(ours[1][106..], page.parts[1][106..], "{sv}");
            sent += 1;
        }
    }
    println!(
        "clocks of F/NAV from I/NAV: {:.3} m rms, with the delays exchanged {:.3} m",
        squares[0].sqrt(),
        squares[1].sqrt()
    );
    assert_eq!(sent, 48);
    assert!(squares[0].sqrt() < 0.12 && squares[1].sqrt() > 0.25, "{squares:?}");
}

#[test]
fn every_real_page_of_e5a_holds_and_its_sets_are_the_records_of_two_converters() {
    for (name, files, pages, least) in [
        ("046r_galfnav", &["lnav/046r_rnx.nav", "navbits/sept046r.nav"][..], 3384, 78),
        ("233h_galfnav", &["navbits/233h_rnx.nav.gz"], 3514, 53),
    ] {
        let Some(all) = real(&format!("navbits/{name}.csv.gz")) else { return };
        let mut sets: BTreeMap<(Sv, u16), Vec<Ephemeris>> = BTreeMap::new();
        let (mut held, mut dated, mut sent) = (0, 0, 0);
        told(&all, |page, reads| {
            held += 1;
            dated += u32::from(holds(page, &reads));
            for read in reads {
                if let Read::Ephemeris(set) = read {
                    sets.entry((page.sv, set.iode)).or_default().push(*set);
                }
            }
        });
        for page in all.iter().filter(|page| (2..5).contains(&fnav::page_type(&page.bits))) {
            let issue = page.bits[6..16].iter().fold(0, |all, bit| all << 1 | u16::from(*bit));
            let Some(own) = sets.get(&(page.sv, issue)) else { continue };
            is_sent(own.last().unwrap(), page);
            sent += 1;
        }
        let mut matched = 0;
        for path in files {
            let Some(path) = external(path) else { return };
            for record in fnav_records(&path) {
                let Some(own) = sets.get(&(record.sv, record.iode)) else { continue };
                // Delays and status may change within an issue.
                let rounded = FNAV.fields.quantised(&record).unwrap();
                let alike = |set: &Ephemeris| {
                    let tgd_s = rounded.tgd_s;
                    *set == Ephemeris { transmitted: set.transmitted, health: set.health, tgd_s, ..rounded.clone() }
                        || Ephemeris {
                            transmitted: set.transmitted,
                            tgd_s: set.tgd_s,
                            health: set.health,
                            ..rounded.clone()
                        } == *set
                };
                assert!(own.iter().any(alike), "{record:?}\n{own:?}");
                matched += 1;
            }
        }
        println!("{name}: {held} pages, {dated} dated, {sent} sent again, {matched} records");
        assert_eq!(held, pages);
        assert!(dated > 2000 && sent > 1500 && matched >= least, "{dated} {sent} {matched}");
    }
}

/// The records of F/NAV in a file, by our reader of files without those of I/NAV.
fn fnav_records(path: &std::path::Path) -> Vec<Ephemeris> {
    let packed = std::fs::read(path).unwrap();
    let whole = if path.extension().is_some_and(|end| end == "gz") {
        inflate::inflate(&packed, 1 << 26).unwrap()
    } else {
        packed
    };
    let text = String::from_utf8_lossy(&whole).into_owned();
    let mut kept = String::new();
    let mut keeps = true;
    for line in text.lines() {
        if line.starts_with('>') {
            keeps = line.starts_with("> EPH E") && line.contains("FNAV");
        }
        if keeps {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    let found = rinex::read(kept.as_bytes(), "own").unwrap();
    assert!(found.ephemerides.iter().all(|set| set.form == &fnav::FNAV_SETS));
    found.ephemerides
}

#[test]
fn every_real_page_of_e5b_is_in_its_place_and_comes_back_as_it_was() {
    let Some(pages) = real_pages("navbits/046r_galinav.csv.gz") else { return };
    let mut checked = 0;
    let reader: fn(Sv) -> Box<dyn Reader> = INAV_E5B.reader;
    let form: &Message = &INAV_E5B;
    for RealPage { sv, start, parts, .. } in pages.iter().filter(|page| !page.on_e1b) {
        let symbols = inav::encode_page(parts);
        let (back, _) = inav::decode_soft(&soft(&symbols)).unwrap();
        assert_eq!(&back, parts, "{sv} {start}");
        assert_eq!(inav::word_type(&inav::word_of(parts)), (form.number)(*start), "{sv} {start}");
        let mut reader = reader(*sv);
        let reads: Vec<Read> = soft(&symbols).into_iter().flat_map(|one| reader.take(one, *start)).collect();
        let timed = form.timed.contains(&(form.number)(*start));
        let unit = Read::Unit { symbols: 500, of_week_s: start.tow_whole_s(), inverted: false };
        assert_eq!(timed, reads.contains(&unit), "{sv} {start}");
        checked += 1;
    }
    println!("{checked} pages of E5b");
    assert_eq!(checked, 16_841);
}
