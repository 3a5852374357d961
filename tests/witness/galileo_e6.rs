//! Galileo's C/NAV on E6-B against pages that satellites sent, and the time that E6 is given.

use gnss::bits::{Store, bits_of};
use gnss::broadcast::Ephemeris;
use gnss::crc::crc24q;
use gnss::galileo::cnav::{self, CNAV};
use gnss::galileo::e6::E6;
use gnss::message::{Common, Read};
use gnss::satellite::{Sv, System};
use gnss::time::{Epoch, WEEK_S};
use receiver::decode::{Decoder, News};
use receiver::track::Symbol;

/// Satellite, week and time of week of the end, 496 bits in hexadecimal: 14 reserved, the page of the
/// service, check, tail and four more.
const PAGES: &str = include_str!("../../data/witness/galileo_e6_pages.csv");

/// Bits of a page without its check, with it, and with the tail.
const DATA_BITS: usize = 462;
const CHECKED_BITS: usize = 486;
const PAGE_BITS: usize = 492;

struct Page {
    sv: String,
    start: Epoch,
    bits: Vec<bool>,
}

fn pages() -> Vec<Page> {
    let page = |line: &str| {
        let column: Vec<&str> = line.split(',').collect();
        let nibbles = column[3].chars().map(|digit| u128::from(digit.to_digit(16).unwrap()));
        let bits: Vec<bool> = nibbles.flat_map(|nibble| bits_of(nibble, 4)).collect();
        assert_eq!(bits.len(), PAGE_BITS + 4);
        let end = Epoch::new(column[1].parse::<i64>().unwrap() * WEEK_S + column[2].parse::<i64>().unwrap(), 0.0);
        Page { sv: column[0].to_owned(), start: end.plus_s(-1.0), bits }
    };
    PAGES.lines().skip(1).map(page).collect()
}

fn soft(symbols: &[bool], inverted: bool) -> Vec<f32> {
    symbols.iter().map(|&one| if one == inverted { 1.0 } else { -1.0 }).collect()
}

fn sent(start: Epoch) -> Vec<bool> {
    let set = Ephemeris::blank(Sv { system: System::Galileo, number: 12 }, start);
    (CNAV.sender)(&Common::default()).unwrap().unit(&set, start).unwrap()
}

#[test]
fn real_pages_of_e6_keep_their_checks_and_come_back_through_our_coding_either_way_up() {
    let pages = pages();
    assert_eq!(pages.len(), 18);
    for Page { sv, bits, .. } in &pages {
        assert_eq!(crc24q(bits[..CHECKED_BITS].iter().copied()), 0, "{sv}");
        assert!(bits[CHECKED_BITS..].iter().all(|bit| !bit), "{sv}: a tail");
        let symbols = cnav::encode_page(&bits[..DATA_BITS]);
        for inverted in [false, true] {
            let (back, found) = cnav::decode_soft(&soft(&symbols, inverted)).unwrap();
            assert_eq!((&back[..], found), (&bits[..DATA_BITS], inverted), "{sv}");
        }
        // A wrong bit among those that are checked shows.
        for wrong in [0, 14, 37, 38, 300, DATA_BITS - 1] {
            let mut bits = bits[..CHECKED_BITS].to_vec();
            bits[wrong] ^= true;
            assert_ne!(crc24q(bits.into_iter()), 0, "{sv}: {wrong}");
        }
    }
    // Their headers: messages of type 1 in operation, of 11 and of two pages, with numbers that count up.
    let value = |bits: &Vec<bool>, name: &str| {
        let all = cnav::parameters(&bits[..DATA_BITS].to_vec());
        all.into_iter().find(|(own, _)| *own == name).unwrap().1
    };
    let real: Vec<&Page> = pages.iter().filter(|page| !cnav::is_dummy(&page.bits)).collect();
    assert_eq!(real.len(), 13);
    for page in &real {
        let of = |name| value(&page.bits, name);
        assert_eq!((of("has_status"), of("has_type")), (1, 1), "{}", page.sv);
        let round = page.start.tow_whole_s().rem_euclid(3600) / 10;
        // Both begin in a round of ten seconds; the longer one goes on in the next.
        let number = match of("has_pages_less_one") {
            10 => [(0, 16), (55, 18), (56, 18)].into_iter().find(|(own, _)| *own == round).unwrap().1,
            1 => [(0, 17), (55, 19)].into_iter().find(|(own, _)| *own == round).unwrap().1,
            other => panic!("{}: {other} pages less one", page.sv),
        };
        assert_eq!(of("has_message"), number, "{} at {:?}", page.sv, page.start);
    }
    // The first page of a message begins with the time of the hour at which its sending began, the last ends
    // with the filling: what follows a message of ours.
    let of_page = |number: i64| real.iter().find(|page| value(&page.bits, "has_page") == number).unwrap();
    let first = of_page(1);
    assert_eq!(i64::from(first.bits.piece((38, 12))), first.start.tow_whole_s().rem_euclid(3600));
    assert_eq!(of_page(11).bits.piece((430, 32)), 0x5555_5555);
    let (own, _) = cnav::decode_soft(&soft(&sent(first.start.plus_s(1.0)), false)).unwrap();
    assert_eq!(own.piece((38, 12)), first.bits.piece((38, 12)));
    assert_eq!(own.piece((430, 32)), 0x5555_5555);
    // Of the 32 bits that begin a message after the time six say what follows: none of ours does.
    assert_eq!((own.piece((50, 20)), own.piece((14, 2)), value(&own_page(&own), "has_page")), (0, 0, 1));
}

fn own_page(bits: &[bool]) -> Vec<bool> {
    bits.iter().copied().chain([false; PAGE_BITS + 4 - DATA_BITS]).collect()
}

#[test]
fn a_satellite_without_a_message_sends_the_dummy_that_we_send() {
    let dummies: Vec<Page> = pages().into_iter().filter(|page| cnav::is_dummy(&page.bits)).collect();
    assert_eq!(dummies.len(), 5);
    let (ours, _) = cnav::decode_soft(&soft(&sent(Epoch::from_week(2353, 569_350.0)), false)).unwrap();
    // Those of E13 and E33, which have no message: all bits. Those of satellites that have them at other
    // times are the inverse but for the last sixteen, which count seconds.
    for Page { sv, bits, .. } in &dummies {
        let differ = (38..446).filter(|&place| bits[place] != ours[place]).count();
        match sv.as_str() {
            "E13" | "E33" => assert_eq!(bits[..DATA_BITS], ours[..], "{sv}"),
            _ => assert_eq!(differ, 408, "{sv}"),
        }
    }
}

#[test]
fn pages_of_e6_are_coded_and_interleaved_as_printed() {
    // HAS SIS ICD 1.0: 1011011101110000 first, then rows of 123 symbols of what was written in columns of
    // 8, the code's first polynomial 171 octal, the second 133 and inverted; 14 bits, 448, 24 and six.
    let symbols = sent(Epoch::from_week(2353, 569_351.0));
    assert_eq!(symbols.len(), 1000);
    let head = symbols[..16].iter().fold(0_u32, |word, one| word << 1 | u32::from(*one));
    assert_eq!(head, 0b1011_0111_0111_0000);
    let coded: Vec<bool> = (0..984).map(|m| symbols[16 + (m % 8) * 123 + m / 8]).collect();
    // The encoder run backwards: with known memory the first symbol of a pair is the bit and four older ones.
    let (mut bits, mut window): (Vec<bool>, u32) = (Vec::new(), 0);
    for pair in coded.chunks(2) {
        let old = |taps: u32| (window >> 1 & taps).count_ones() % 2 == 1;
        let bit = pair[0] ^ old(0o171);
        assert_eq!(pair[1], !(bit ^ old(0o133)));
        window = window >> 1 | u32::from(bit) << 6;
        bits.push(bit);
    }
    assert_eq!(bits.len(), PAGE_BITS);
    assert_eq!(crc24q(bits[..CHECKED_BITS].iter().copied()), 0);
    assert!(bits[CHECKED_BITS..].iter().all(|bit| !bit));
    // No page begins within a second.
    let set = Ephemeris::blank(Sv { system: System::Galileo, number: 12 }, Epoch::from_week(2353, 0.0));
    assert!((CNAV.sender)(&Common::default()).unwrap().unit(&set, Epoch::from_week(2353, 0.5)).is_err());
}

#[test]
fn pages_of_e6_are_read_from_any_symbol_and_another_signal_tells_which_second_they_are_of() {
    let sv = Sv { system: System::Galileo, number: 12 };
    let start = Epoch::from_week(2353, 604_797.0);
    // Over the end of the week.
    let stream: Vec<bool> = (0..6).flat_map(|second| sent(start.plus_s(f64::from(second)))).collect();
    for (first, inverted) in [(0, false), (1, true), (999, false), (500, true)] {
        let mut reader = (CNAV.reader)(sv);
        let symbols = soft(&stream[first..], inverted);
        let read: Vec<(usize, Read)> = (symbols.iter().enumerate())
            .flat_map(|(at, soft)| reader.take(*soft, start).into_iter().map(move |read| (at, read)))
            .collect();
        let ends: Vec<usize> = (read.iter())
            .filter(|(_, read)| *read == Read::Undated { symbols: 1000, inverted })
            .map(|(at, _)| (at + 1 + first) % 1000)
            .collect();
        assert_eq!(ends, vec![0; if first == 0 { 6 } else { 5 }], "from {first}");

        let mut decoder = Decoder::new(&E6, sv).unwrap();
        let mut polarity = Vec::new();
        for (place, soft) in (7000..).zip(&symbols) {
            let news = decoder.take(&Symbol { first_period: place, end: 0, soft: 9.0 * soft }, start);
            polarity.extend(news.into_iter().filter(|news| matches!(news, News::Polarity { .. })));
        }
        assert!(polarity.iter().all(|news| *news == News::Polarity { inverted }) && !polarity.is_empty());
        assert!(decoder.has_units() && decoder.time_of_week(7000, 0.0).is_none());
        // Period 7000 was sent `first` milliseconds after the start. Three milliseconds later another signal
        // reads so, up to what parts both on their way; one that is two milliseconds off is not believed.
        let then_s = 604_797.0 + 1e-3 * (first as f64 + 3.0);
        for off_s in [-2e-3, 2e-3] {
            assert!(!decoder.date(7003, (then_s as i64, then_s.fract() + off_s)));
        }
        assert!(decoder.time_of_week(7000, 0.0).is_none());
        assert!(decoder.date(7003, (then_s as i64, then_s.fract() + 0.4e-3)));
        let (whole, fraction) = decoder.time_of_week(7000, 0.0).unwrap();
        assert!((whole as f64 + fraction - 604_797.0 - 1e-3 * first as f64).abs() < 1e-9, "{whole} {fraction}");
        // Told again it is the same, and so it is after the end of the week.
        assert!(!decoder.date(9_500 - first as u64, (604_799, 0.500_2)));
        assert_eq!(decoder.time_of_week(10_000 - first as u64, 0.25), Some((0, 0.000_25)));
    }
}
