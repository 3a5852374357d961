//! Laws of the provider at the verifier.

use std::collections::BTreeMap;

use super::signed::{SENDERS, page, words};
use super::{count, feed, refused};
use crate::chain::{Hash, MacFunction};
use crate::keys::Anchor;
use crate::page::Page;
use crate::provider::{Broadcast, Change, Provider, Settings, Transition, Transmission, Words};
use crate::report::{Gap, Outcome, State};
use crate::time::Gst;
use crate::verifier::{self, Verifier};

/// Second of an hour at which scenes of these tests begin.
const START: Gst = Gst::of_seconds(1300 * 604_800 + 36_300);

/// Words of four satellites whose ephemerides change once, in the middle of a sub-frame for one of them.
#[derive(Debug)]
struct Sky {
    changed: i64,
}

fn word_at(index: usize, start: Gst) -> u8 {
    let second_half = 2 * start.half() as u8;
    match index {
        0 => 2,
        1 => 4,
        2 => 6,
        3 => 7 + second_half,
        4 => 8 + second_half,
        10 => 1,
        11 => 3,
        12 => 5,
        _ => 0,
    }
}

impl Sky {
    fn word(&self, sender: u8, index: usize, start: Gst) -> u128 {
        let kind = word_at(index, start);
        let mut word = words(sender).get(&kind).copied().unwrap_or_default();
        let at_s = start.seconds() + 2 * index as i64 + if sender == 5 { 10 } else { 0 };
        if (1..=5).contains(&kind) && at_s >= START.seconds() + self.changed {
            word ^= if kind < 5 { 3 << 112 } else { 0 } | 0x700;
        }
        word
    }
}

impl Broadcast for Sky {
    fn words(&self, start: Gst) -> BTreeMap<u8, Words> {
        let of = |sender: u8| {
            let words = (0..15).map(|index| (word_at(index, start), self.word(sender, index, start)));
            (sender, words.filter(|(kind, _)| *kind != 0).collect())
        };
        SENDERS.iter().map(|&sender| of(sender)).collect()
    }
}

const SKY: Sky = Sky { changed: 15 * 30 };

fn transmission(settings: Settings) -> Transmission {
    Transmission::new(Provider::new(settings).unwrap(), Box::new(SKY))
}

/// Pages of all satellites in some sub-frames, in the order of time.
fn pages(sent: &Transmission, from: i64, to: i64) -> Vec<Page> {
    let mut pages = Vec::new();
    for number in from..to {
        let start = START.later(number);
        for index in 0..15 {
            for sender in SENDERS {
                let at = Gst::of_seconds(start.seconds() + 2 * index as i64 + 1);
                let bits = sent.page(sender, at);
                let word = SKY.word(sender, index, start);
                pages.push(page(sender, at, word, (bits >> 32) as u8, bits as u32));
            }
        }
    }
    pages
}

fn own(anchor: Anchor) -> Verifier {
    Verifier::new(anchor, verifier::Settings { time_uncertainty_s: 1.0, tag_bits: 40 }).unwrap()
}

#[test]
fn every_table_and_function_is_authentic_and_a_change_of_data_within_a_sub_frame_too() {
    let functions = [(Hash::Sha256, MacFunction::HmacSha256), (Hash::Sha3, MacFunction::CmacAes)];
    for table in [27, 33, 34, 35] {
        for (hash, mac) in functions {
            let sent = transmission(Settings { hash, mac, table, ..Settings::new(5, START) });
            let mut own = own(sent.provider().anchor(START).unwrap().hot().unwrap());
            feed(&mut own, &pages(&sent, 0, 40), 0.0);
            own.finish();
            let counts = own.counts();
            assert_eq!(counts.refused(), 0, "{table}: {counts:?}");
            assert_eq!(counts.keys_verified, 40, "{table}: {counts:?}");
            let open = counts.tags_where(|_, own| {
                !matches!(own, Outcome::Authentic | Outcome::NoData | Outcome::NotVerifiable(Gap::NoWords | Gap::NoKey))
            });
            assert_eq!(open, 0, "{table}: {counts:?}");
            assert!(count(counts, Outcome::NoData) > 0, "{table}: {counts:?}");
            assert_eq!(refused(counts), 0);
        }
    }
    for table in [26, 28, 31, 41] {
        assert!(Provider::new(Settings { table, ..Settings::new(5, START) }).is_err());
    }
}

#[test]
fn two_hours_with_all_transitions_is_authentic_and_only_an_alert_ends_it() {
    let kinds = Change::NAMES.map(|(_, kind)| kind);
    let at = |number: i64| START.later(16 + 44 * number);
    let transitions = (0..).zip(kinds).map(|(number, kind)| Transition { kind, start: at(number) }).collect();
    let sent = transmission(Settings { transitions, ..Settings::new(5, START) });
    let published = |number: i64| sent.provider().anchor(START.later(number)).unwrap();
    let mut cold = own(published(0).cold());
    // Until the tree is renewed.
    feed(&mut cold, &pages(&sent, 0, 192), 0.0);
    let counts = cold.counts().clone();
    assert_eq!(counts.refused(), 0, "{counts:?}");
    assert_eq!((cold.state(), counts.pkr_verified), (State::Authentic, 3), "{counts:?}");
    // The first root came while its successor was announced. No key is used after its chain is revoked.
    assert_eq!(counts.keys_verified, 133);
    // The signal does not bring the new tree's root: its key stays unknown, and the chain goes on.
    feed(&mut cold, &pages(&sent, 192, 236), 0.0);
    assert!(cold.state() == State::Authentic && cold.counts().pkr_refused > 0, "{:?}", cold.counts());
    // A receiver with the new root takes it up, until the alert.
    let mut renewed = own(published(216).cold());
    feed(&mut renewed, &pages(&sent, 192, 236), 0.0);
    assert_eq!((renewed.state(), renewed.counts().pkr_verified), (State::Authentic, 1));
    feed(&mut renewed, &pages(&sent, 236, 260), 0.0);
    assert_eq!(renewed.state(), State::DoNotUse);
    assert_ne!(published(216).root, published(0).root);
}

#[test]
fn the_next_chain_follows_the_end_of_one_and_settles_its_last_tags() {
    let transitions = vec![Transition { kind: Change::EndOfChain, start: START.later(20) }];
    let sent = transmission(Settings { transitions, ..Settings::new(5, START) });
    let mut own = own(sent.provider().anchor(START).unwrap().hot().unwrap());
    feed(&mut own, &pages(&sent, 0, 70), 0.0);
    own.finish();
    let counts = own.counts();
    assert_eq!((counts.refused(), counts.keys_verified), (0, 70), "{counts:?}");
    let open = counts.tags_where(|_, own| matches!(own, Outcome::NotVerifiable(Gap::ChainGone)));
    // The last sub-frame waits for its keys, and the slow MAC of eleven.
    assert!(open == 0 && count(counts, Outcome::NotVerifiable(Gap::NoKey)) < 24 + 11 * 12, "{counts:?}");
    assert!(own.last_keys().contains(&(2, START.later(69))));
}

#[test]
fn any_sub_frame_is_the_same_by_itself_and_another_seed_gives_other_bits() {
    let settings = || Settings::new(5, START);
    let (whole, alone) = (transmission(settings()), transmission(settings()));
    let all = pages(&whole, 0, 50);
    assert_eq!(pages(&alone, 49, 50)[..], all[49 * 60..]);
    assert_eq!(pages(&whole, 3, 4)[..], all[3 * 60..4 * 60]);
    let other = transmission(Settings::new(6, START));
    assert!(pages(&other, 3, 4).iter().zip(&all[3 * 60..]).all(|(one, own)| one.mack() != own.mack()));
    let without = transmission(Settings { without: [5].into(), ..settings() });
    let zeros = pages(&without, 0, 2).iter().filter(|page| (page.hkroot(), page.mack()) == (0, 0)).count();
    assert!((30..34).contains(&zeros), "{zeros}");
}

#[test]
fn files_give_the_keys_that_were_published() {
    let published = transmission(Settings::new(5, START)).provider().anchor(START).unwrap();
    assert_eq!(crate::files::merkle_root(&published.tree_file()), Ok(published.root));
    assert_eq!(crate::files::key(&published.key_file()), Ok(published.key.clone()));
    let bytes = crate::bits::unhex(published.kroot_file().trim()).unwrap();
    let kroot = Verifier::root_of(&bytes).unwrap();
    assert_eq!(published.key.verify(&kroot), Ok(()));
    assert!(matches!(published.warm(), Anchor::Key(_)));
}
