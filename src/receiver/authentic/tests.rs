//! Pages that are signed with test keys, as symbols through decoders to the verifier of a receiver.

#[allow(dead_code, reason = "the tests of the verifier use the rest")]
#[path = "../../osnma/tests/signed.rs"]
mod signed;

use std::collections::BTreeMap;

use super::*;
use crate::decode::{Decoder, News};
use crate::track::Symbol;
use gnss::galileo::inav::encode_page;
use gnss::record::TagRow;
use osnma::bits::hex;
use osnma::chain::{Hash, MacFunction};
use osnma::fields::NmaHeader;
use signed::{BEGIN, SENDERS, Signed, point, root, sky};

const HEADER: NmaHeader = NmaHeader(0b1001_0010);
const RATE_HZ: i64 = 1_000_000;
/// Time of the first page's travel.
const TRAVEL_S: f64 = 0.08;

fn signer() -> Signed {
    Signed::new(1, Hash::Sha256, MacFunction::HmacSha256)
}

fn cold() -> OsnmaSettings {
    OsnmaSettings { merkle_root: hex(&root().0), ..OsnmaSettings::default() }
}

fn hot() -> OsnmaSettings {
    let kroot = [&[HEADER.0], &signer().kroot(HEADER, 1, 0)[..]].concat();
    OsnmaSettings { public_key: format!("1:{}", hex(&point(1))), kroot: hex(&kroot), ..OsnmaSettings::default() }
}

fn gps(at: Gst) -> Epoch {
    Epoch::new(at.seconds() + GST_WEEK * WEEK_S, 0.0)
}

/// Symbols of pages, by satellite, each with the sample at which it ends; the first page begins at sample 0.
fn symbols(pages: &[Page]) -> Vec<(Sv, Symbol)> {
    let first = pages.iter().map(|page| page.start).min().unwrap();
    let bits = |part: u128| (0..120).map(move |at| part >> (119 - at) & 1 == 1).collect::<Vec<bool>>();
    let one = |page: &Page| {
        let begin = 250 * page.start.since_s(first) as u64;
        let coded = encode_page(&page.parts().map(bits));
        let sv = satellite(page.sender);
        coded.into_iter().zip(begin..).map(move |(bit, period)| {
            let soft = if bit { -9.0 } else { 9.0 };
            (sv, Symbol { first_period: period, end: (period + 1) * 4 * RATE_HZ as u64 / 1000, soft })
        })
    };
    let mut all: Vec<(Sv, Symbol)> = pages.iter().flat_map(one).collect();
    all.sort_by_key(|(_, symbol)| symbol.end);
    all
}

/// Verifier after pages, and the rows of its tags; pages are verified after every `batch` symbols of the air.
fn verified(settings: &OsnmaSettings, pages: &[Page], batch: usize) -> (Authentic, Vec<TagRow>) {
    let start = gps(pages.iter().map(|page| page.start).min().unwrap()).plus_s(TRAVEL_S);
    let rate = Rate::from_hz(RATE_HZ as f64).unwrap();
    let mut own = Authentic::new(settings, &[&E1], Some(start), rate).unwrap();
    let mut decoders = BTreeMap::new();
    let mut records: Vec<Record> = Vec::new();
    for (count, (sv, symbol)) in symbols(pages).into_iter().enumerate() {
        let decoder = decoders.entry(sv).or_insert_with(|| Decoder::new(&E1, sv).unwrap().with_pages());
        for news in decoder.take(&symbol, start) {
            if let News::Page(page) = news {
                own.take(sv, symbol.end, page);
            }
        }
        if count % batch == 0 {
            own.verify(&mut records).unwrap();
        }
    }
    own.finish(&mut records).unwrap();
    let rows = records.into_iter().filter_map(|record| if let Record::Tag(row) = record { Some(row) } else { None });
    (own, rows.collect())
}

fn count(rows: &[TagRow], result: &str) -> usize {
    rows.iter().filter(|row| row.result == result).count()
}

#[test]
fn signed_pages_are_authentic_from_each_start_and_their_ephemerides_are_trusted() {
    let pages = sky(&signer(), HEADER, 0, 24);
    for settings in [cold(), hot()] {
        let (own, rows) = verified(&settings, &pages, 40);
        let outcome = own.outcome();
        assert_eq!((outcome.state, count(&rows, "refused")), ("authentic", 0), "{outcome}");
        assert!(count(&rows, "authentic") > 100, "{outcome}");
        assert_eq!(outcome.satellites, SENDERS.map(satellite).to_vec());
        let root = outcome.kroot.clone().unwrap();
        assert_eq!(root, hot().kroot);
        // Data of the first sub-frame have a tag in the second and its key in the third. The first page after
        // it closes it, and the first symbol is sent a second after a sub-frame begins.
        if outcome.start == "hot" {
            assert_eq!(outcome.first_data_s, Some(92.0));
            assert_eq!(outcome.states.first().unwrap().state, "root verified");
        }
    }
}

#[test]
fn results_do_not_depend_on_the_length_of_blocks() {
    let pages = sky(&signer(), HEADER, 0, 8);
    let of = |batch: usize| verified(&hot(), &pages, batch).1;
    let all = of(1);
    assert!(!all.is_empty());
    for batch in [7, 100, 6000] {
        assert_eq!(of(batch), all, "{batch}");
    }
}

#[test]
fn a_clock_an_hour_off_is_a_state_and_makes_no_tag_authentic() {
    let pages = sky(&signer(), HEADER, 0, 8);
    for offset_s in [3600.0, -3600.0, 331.0, -16.0] {
        let (own, rows) = verified(&OsnmaSettings { clock_offset_s: offset_s, ..hot() }, &pages, 40);
        assert_eq!((own.outcome().state, count(&rows, "authentic")), ("clock disagrees", 0), "{offset_s}");
        assert!(own.data().0.satellites().next().is_none());
    }
}

#[test]
fn pages_that_may_be_late_by_a_subframe_have_only_the_slow_tags() {
    let pages = sky(&signer(), HEADER, 0, 24);
    let (_, rows) = verified(&OsnmaSettings { clock_offset_s: 40.0, ..hot() }, &pages, 40);
    assert!(count(&rows, "authentic") > 0);
    assert!(rows.iter().all(|row| row.result != "authentic" || row.adkd == 12));
}

#[test]
fn an_hours_gap_is_bridged_by_the_chain_and_refuses_nothing() {
    let signed = signer();
    let mut pages = sky(&signed, HEADER, 0, 6);
    pages.extend(sky(&signed, HEADER, 126, 134));
    let (own, rows) = verified(&hot(), &pages, 40);
    assert_eq!((own.outcome().state, count(&rows, "refused")), ("authentic", 0), "{}", own.outcome());
    let later = BEGIN.later(127).tow_s();
    assert!(rows.iter().any(|row| row.tow_s == later && row.result == "authentic"));
}

#[test]
fn another_key_or_another_trees_root_is_a_state_and_makes_no_tag_authentic() {
    let pages = sky(&signer(), HEADER, 0, 24);
    let key = OsnmaSettings { public_key: format!("2:{}", hex(&point(2))), ..OsnmaSettings::default() };
    let tree = OsnmaSettings { merkle_root: "0".repeat(64), ..OsnmaSettings::default() };
    for (settings, state) in [(key, "key verified"), (tree, "no key")] {
        let (own, rows) = verified(&settings, &pages, 40);
        assert_eq!((own.outcome().state, count(&rows, "authentic")), (state, 0));
    }
    let mixed = OsnmaSettings { public_key: format!("2:{}", hex(&point(2))), ..hot() };
    let rate = Rate::from_hz(1e6).unwrap();
    let error = Authentic::new(&mixed, &[&E1], Some(gps(BEGIN)), rate).err().unwrap().to_string();
    assert!(error.starts_with("osnma.kroot: signed by public key 1, not 2"), "{error}");
}

#[test]
fn forged_words_are_refused_and_their_ephemeris_is_not_trusted() {
    let forged = |page: Page| {
        let is_it = page.sender == 5 && page.word() >> 122 == 2;
        let word = page.word() ^ if is_it { 1 << 70 } else { 0 };
        signed::page(page.sender, page.start, word, page.hkroot(), page.mack())
    };
    let pages: Vec<Page> = sky(&signer(), HEADER, 0, 24).into_iter().map(forged).collect();
    let (own, rows) = verified(&OsnmaSettings { position: PositionData::Authentic, ..hot() }, &pages, 40);
    assert!(rows.iter().any(|row| row.satellite == "E05" && row.result == "refused"));
    assert!(rows.iter().all(|row| row.satellite != "E05" || row.result != "authentic" || row.adkd == 4));
    assert!(count(&rows, "authentic") > 100 && own.is_required());
    let trusted: Vec<Sv> = own.data().0.satellites().collect();
    assert_eq!(trusted, [2, 11, 36].map(satellite));
}

#[test]
fn what_verification_lacks_is_said_by_name() {
    let rate = Rate::from_hz(1e6).unwrap();
    let refused = |settings: &OsnmaSettings, signals: &[&'static Signal], start: Option<Epoch>| {
        Authentic::new(settings, signals, start, rate).err().unwrap()
    };
    assert_eq!(refused(&hot(), &[&E1], None), AnchorError::NoOwnTime);
    assert_eq!(refused(&hot(), &[&gnss::gps::l1ca::L1_CA], Some(gps(BEGIN))), AnchorError::NoPages);
    let error = refused(&OsnmaSettings::default(), &[&E1], Some(gps(BEGIN))).to_string();
    assert!(error.contains("without a key to trust"), "{error}");
}

#[test]
fn without_being_asked_a_decoder_hands_on_no_page() {
    let pages = sky(&signer(), HEADER, 0, 2);
    let mut decoder = Decoder::new(&E1, satellite(2)).unwrap();
    let own = symbols(&pages).into_iter().filter(|(sv, _)| sv.number == 2);
    let mut news = own.flat_map(|(_, symbol)| decoder.take(&symbol, gps(BEGIN)));
    assert!(!news.any(|news| matches!(news, News::Page(_))));
}
