//! The published test vectors of OSNMA: an hour each of pages that satellites sent in test phases of 2023.
//!
//! The files' conditions do not let us ship them. Counts are those that another verifier found in the same
//! files: 23 951 right tags, eight of them aside that say that their sender had no data.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use gnss::galileo::e1::E1;
use gnss::galileo::inav::{GST_WEEK, encode_page};
use gnss::inflate::inflate;
use gnss::satellite::Sv;
use gnss::time::{Epoch, Rate, WEEK_S};
use osnma::fields::Adkd;
use osnma::files;
use osnma::keys::Anchor;
use osnma::page::{Page, satellite};
use osnma::report::{Gap, Outcome, State, TagReport};
use osnma::verifier::{Settings, Verifier};
use receiver::authentic::Authentic;
use receiver::decode::{Decoder, News};
use receiver::output::Record;
use receiver::settings::osnma::OsnmaSettings;
use receiver::track::Symbol;

use super::data::external;

/// Verifier after a whole recording, and the results of all tags.
fn verified(pages: &str, key: &str) -> Option<(Verifier, Vec<TagReport>)> {
    verified_after(pages, key, 0.0)
}

/// Verifier of a recording that is replayed so much later by the receiver's own time.
fn verified_after(pages: &str, key: &str, later_s: f64) -> Option<(Verifier, Vec<TagReport>)> {
    let (pages, key) = (external(pages)?, external(key)?);
    let text = fs::read_to_string(&key).unwrap();
    let anchor = if key.to_string_lossy().contains("MerkleTree") {
        Anchor::Tree(files::merkle_root(&text).unwrap())
    } else {
        Anchor::Key(files::key(&text).unwrap())
    };
    let mut verifier = Verifier::new(anchor, Settings::default()).unwrap();
    let mut reports = Vec::new();
    let text = String::from_utf8(inflate(&fs::read(pages).unwrap(), 1 << 24).unwrap()).unwrap();
    for row in text.lines() {
        let page = Page::from_row(row).unwrap();
        reports.extend(verifier.page(&page, page.start.seconds() as f64 + later_s));
    }
    reports.extend(verifier.finish());
    Some((verifier, reports))
}

/// Right tags by kind, and those without data.
fn right(reports: &[TagReport]) -> [usize; 4] {
    let count = |fits: &dyn Fn(&TagReport) -> bool| reports.iter().filter(|report| fits(report)).count();
    let of = |kind: Adkd| count(&|report| report.adkd == kind && report.outcome == Outcome::Authentic);
    [of(Adkd::Ephemeris), of(Adkd::Timing), of(Adkd::SlowMac), count(&|report| report.outcome == Outcome::NoData)]
}

/// Tags that no later key or no earlier words could settle are at the ends of the recording.
fn only_the_ends_are_open(reports: &[TagReport]) {
    let first = reports.iter().map(|report| report.sent).min().unwrap();
    let last = reports.iter().map(|report| report.sent).max().unwrap();
    for report in reports {
        match report.outcome {
            Outcome::Authentic | Outcome::NoData => {}
            Outcome::NotVerifiable(Gap::NoWords) => assert_eq!(report.sent, first),
            Outcome::NotVerifiable(Gap::NoKey) => {
                assert!(report.sent.later(report.adkd.key_after()) > last, "{report:?}");
            }
            other => panic!("{other:?}: {report:?}"),
        }
    }
}

#[test]
fn every_tag_of_august_is_right_from_the_public_key_on() {
    let key = "osnma/OSNMA_PublicKey_16_AUG_2023.xml";
    let Some((verifier, reports)) = verified("osnma/16_AUG_2023_fixed.csv.gz", key) else { return };
    assert_eq!(right(&reports), [8536, 1065, 2923, 8]);
    let counts = verifier.counts();
    assert_eq!((counts.keys_verified, counts.kroot_verified, counts.refused()), (120, 1, 0));
    only_the_ends_are_open(&reports);
    // Four satellites at one change of issue, each with a tag of ADKD 0 and one of ADKD 12.
    let empty: Vec<&TagReport> = reports.iter().filter(|report| report.outcome == Outcome::NoData).collect();
    assert!(empty.iter().all(|report| report.sent.tow_s() == 277_650 && report.of == report.sender));
    assert_eq!(verifier.state(), State::Authentic);
}

#[test]
fn every_tag_of_july_is_right_from_the_root_of_the_tree_alone() {
    let tree = "osnma/OSNMA_MerkleTree_27_JUL_2023.xml";
    let Some((verifier, reports)) = verified("osnma/27_JUL_2023_fixed.csv.gz", tree) else { return };
    assert_eq!(right(&reports), [7788, 970, 2669, 0]);
    let counts = verifier.counts();
    assert_eq!((counts.pkr_verified, counts.kroot_verified), (1, 1));
    assert_eq!((counts.keys_verified, counts.refused()), (120, 0));
    only_the_ends_are_open(&reports);
    // The first blocks of the root key are sent from TOW 345990 on.
    assert_eq!(verifier.first_root().map(|time| time.tow_s()), Some(346_050));
}

/// Guidelines 1.3, 4.2: by the receiver's own time and its uncertainty of 15 s a tag has to come within 30 s
/// of its beginning, before its key is sent, and a tag of the slow MAC within 330 s.
#[test]
fn of_a_recording_that_is_replayed_a_minute_later_only_tags_of_the_slow_mac_are_right() {
    let (pages, key) = ("osnma/16_AUG_2023_fixed.csv.gz", "osnma/OSNMA_PublicKey_16_AUG_2023.xml");
    let Some((_, reports)) = verified_after(pages, key, 60.0) else { return };
    let [ephemeris, timing, slow, _] = right(&reports);
    assert_eq!((ephemeris, timing), (0, 0));
    assert!(slow > 2500, "{slow}");
    let Some((_, reports)) = verified_after(pages, key, 400.0) else { return };
    assert!(reports.is_empty());
}

#[test]
fn another_trees_root_or_another_days_key_makes_no_tag_authentic() {
    for key in ["osnma/OSNMA_MerkleTree_16_AUG_2023.xml", "osnma/OSNMA_PublicKey_16_AUG_2023.xml"] {
        let Some((verifier, reports)) = verified("osnma/27_JUL_2023_fixed.csv.gz", key) else { return };
        assert!(reports.is_empty(), "{key}");
        assert_ne!(verifier.state(), State::Authentic, "{key}");
    }
}

/// Symbols of pages of the recording, by satellite, each with its number from the first page on.
fn symbols(pages: &[Page]) -> Vec<(u64, Sv, f32)> {
    let first = pages.iter().map(|page| page.start).min().unwrap();
    let bits = |part: u128| (0..120).map(move |at| part >> (119 - at) & 1 == 1).collect::<Vec<bool>>();
    let mut all = Vec::new();
    for page in pages {
        let begin = 250 * page.start.since_s(first) as u64;
        let coded = encode_page(&page.parts().map(bits));
        let sv = satellite(page.sender);
        all.extend((begin..).zip(coded).map(|(number, bit)| (number, sv, if bit { -9.0 } else { 9.0 })));
    }
    all.sort_by_key(|(number, sv, _)| (*number, *sv));
    all
}

#[test]
fn recorded_pages_come_through_symbols_and_decoders_bit_for_bit_and_their_tags_are_as_right() {
    let (pages, key) = ("osnma/16_AUG_2023_fixed.csv.gz", "osnma/OSNMA_PublicKey_16_AUG_2023.xml");
    let Some((_, expected)) = verified(pages, key) else { return };
    let (Some(pages), Some(key)) = (external(pages), external(key)) else { return };
    let text = String::from_utf8(inflate(&fs::read(pages).unwrap(), 1 << 24).unwrap()).unwrap();
    let pages: Vec<Page> = text.lines().map(|row| Page::from_row(row).unwrap()).collect();
    let key = fs::canonicalize(key).unwrap();
    let mut settings = OsnmaSettings { public_key: key.to_string_lossy().into_owned(), ..OsnmaSettings::default() };
    settings.read_files(Path::new("/"), "rx.toml", "").unwrap();
    let first = pages.iter().map(|page| page.start).min().unwrap();
    let start = Epoch::new(first.seconds() + GST_WEEK * WEEK_S, 0.08);
    // A sample a symbol.
    let mut own = Authentic::new(&settings, &[&E1], Some(start), Rate::from_hz(250.0).unwrap()).unwrap();
    let mut decoders: BTreeMap<Sv, Decoder> = BTreeMap::new();
    let (mut found, mut records) = (BTreeMap::new(), Vec::<Record>::new());
    for (number, sv, soft) in symbols(&pages) {
        let decoder = decoders.entry(sv).or_insert_with(|| Decoder::new(&E1, sv).unwrap().with_pages());
        for news in decoder.take(&Symbol { first_period: number, end: number + 1, soft }, start) {
            if let News::Page(page) = news {
                found.insert((page.start.seconds() - GST_WEEK * WEEK_S, sv.number), page.parts);
                own.take(sv, number + 1, page);
            }
        }
        if number % 25 == 0 {
            own.verify(&mut records).unwrap();
        }
    }
    own.finish(&mut records).unwrap();
    // A frame that follows lost symbols is not found at once, and its page has no time until one states it.
    // One satellite sends nothing but dummy words and never states its time.
    let has_time = |sender: u8| pages.iter().any(|page| page.sender == sender && page.word() >> 122 == 5);
    let dated: Vec<u8> = (1..=36).filter(|sender| has_time(*sender)).collect();
    let is_due = |page: &&Page| page.check().is_ok() && dated.contains(&page.sender);
    let checked: Vec<&Page> = pages.iter().filter(is_due).collect();
    let there = |page: &&&Page| found.contains_key(&(page.start.seconds(), page.sender));
    assert!(100 * checked.iter().filter(there).count() >= 99 * checked.len(), "{} of {}", found.len(), checked.len());
    for page in checked.iter().filter(there) {
        assert_eq!(found[&(page.start.seconds(), page.sender)], page.parts(), "{}", page.start);
    }
    let count =
        |name: &str| records.iter().filter(|record| matches!(record, Record::Tag(row) if row.result == name)).count();
    let given = |name: &str| expected.iter().filter(|report| report.outcome.name() == name).count();
    assert_eq!(count("refused"), 0);
    assert!(100 * count("authentic") >= 95 * given("authentic"), "{} of {}", count("authentic"), given("authentic"));
    assert_eq!(own.outcome().state, "authentic");
    // The ephemerides that became authentic are those that the decoders read.
    assert!(own.outcome().satellites.len() > 15, "{:?}", own.outcome().satellites);
}
