//! The published test vectors of OSNMA: an hour each of pages that satellites sent in test phases of 2023.
//!
//! The files' conditions do not let us ship them. Counts are those that another verifier found in the same
//! files: 23 951 right tags, eight of them aside that say that their sender had no data.

use std::fs;

use gnss::inflate::inflate;
use osnma::fields::Adkd;
use osnma::files;
use osnma::keys::Anchor;
use osnma::page::Page;
use osnma::report::{Gap, Outcome, State, TagReport};
use osnma::verifier::{Settings, Verifier};

use super::data::external;

/// Verifier after a whole recording, and the results of all tags.
fn verified(pages: &str, key: &str) -> Option<(Verifier, Vec<TagReport>)> {
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
        reports.extend(verifier.page(&page, page.start.seconds() as f64));
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

#[test]
fn another_trees_root_or_another_days_key_makes_no_tag_authentic() {
    for key in ["osnma/OSNMA_MerkleTree_16_AUG_2023.xml", "osnma/OSNMA_PublicKey_16_AUG_2023.xml"] {
        let Some((verifier, reports)) = verified("osnma/27_JUL_2023_fixed.csv.gz", key) else { return };
        assert!(reports.is_empty(), "{key}");
        assert_ne!(verifier.state(), State::Authentic, "{key}");
    }
}
