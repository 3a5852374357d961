//! Laws of the verifier, on a synthetic recording that is signed with test keys.

mod provided;
mod signed;

use crate::chain::{Hash, MacFunction};
use crate::fields::{Adkd, NmaHeader};
use crate::keys::{Anchor, KeyFault, PublicKey};
use crate::page::Page;
use crate::report::{Counts, Gap, Outcome, Refusal, State, TagReport};
use crate::time::Gst;
use crate::verifier::{Settings, Verifier};
use signed::{BEGIN, SENDERS, Signed, merged, page, pkr, point, public, root, sky};

/// Operational, chain 1, nominal: two bits, two bits, three bits and a reserved one.
const NOMINAL: NmaHeader = NmaHeader(0b1001_0010);
/// Not to be used, chain 1, nominal.
const STOP: NmaHeader = NmaHeader(0b1101_0010);

fn chain() -> Signed {
    Signed::new(1, Hash::Sha256, MacFunction::HmacSha256)
}

fn verifier(anchor: Anchor) -> Verifier {
    Verifier::new(anchor, Settings { time_uncertainty_s: 1.0, tag_bits: 40 }).unwrap()
}

fn warm() -> Verifier {
    verifier(Anchor::Key(public(1)))
}

/// Feeds pages that come `late_s` after they were sent.
fn feed(verifier: &mut Verifier, pages: &[Page], late_s: f64) -> Vec<TagReport> {
    let mut reports = Vec::new();
    for page in pages {
        reports.extend(verifier.page(page, page.start.seconds() as f64 + late_s));
    }
    reports
}

fn count(counts: &Counts, outcome: Outcome) -> u64 {
    counts.tags_where(|_, own| own == outcome)
}

fn refused(counts: &Counts) -> u64 {
    counts.tags_where(|_, own| matches!(own, Outcome::Refused(_)))
}

/// Changes a page's word, header section and MAC section, with a right check.
fn forged(own: &Page, change: impl Fn(&mut u128, &mut u8, &mut u32)) -> Page {
    let (mut word, mut hkroot, mut mack) = (own.word(), own.hkroot(), own.mack());
    change(&mut word, &mut hkroot, &mut mack);
    page(own.sender, own.start, word, hkroot, mack)
}

#[test]
fn a_cold_start_passes_each_state_and_every_tag_becomes_authentic() {
    for (hash, mac) in [(Hash::Sha256, MacFunction::HmacSha256), (Hash::Sha3, MacFunction::CmacAes)] {
        let mut own = verifier(Anchor::Tree(root()));
        let mut states = vec![own.state()];
        for page in sky(&Signed::new(1, hash, mac), NOMINAL, 0, 60) {
            feed(&mut own, &[page], 0.0);
            if states.last() != Some(&own.state()) {
                states.push(own.state());
            }
        }
        own.finish();
        // Tags that waited for the root are verified with it.
        assert_eq!(states, [State::NoKey, State::KeyVerified, State::Authentic], "{hash:?}");
        let counts = own.counts();
        assert_eq!((counts.pkr_verified, counts.kroot_verified, counts.keys_verified), (1, 1, 60));
        assert_eq!(counts.refused(), 0);
        // Six tags of four satellites; those of the first sub-frame have no data before them.
        assert_eq!(count(counts, Outcome::NotVerifiable(Gap::NoWords)), 24);
        let unsettled = count(counts, Outcome::NotVerifiable(Gap::NoKey));
        assert_eq!(count(counts, Outcome::Authentic) + 24 + unsettled, 60 * 24);
        // The last sub-frame waits for its keys, and the slow MAC of eleven.
        let slow: u64 = (49..59).map(|number| if number % 2 == 0 { 4 } else { 8 }).sum();
        assert_eq!(unsettled, 24 + slow);
        assert_eq!(counts.authentic_data, 8);
    }
}

#[test]
fn a_warm_start_waits_for_the_root_and_a_hot_start_does_not() {
    let pages = sky(&chain(), NOMINAL, 10, 16);
    let mut own = warm();
    assert_eq!(own.state(), State::KeyVerified);
    feed(&mut own, &pages, 0.0);
    assert_eq!(own.first_root(), Some(BEGIN.later(15)));
    let stored = own.stored_root().unwrap();
    let kroot = Verifier::root_of(&stored).unwrap();
    let mut hot = verifier(Anchor::Root(public(1), Box::new(kroot.clone())));
    assert_eq!(hot.state(), State::RootVerified);
    feed(&mut hot, &sky(&chain(), NOMINAL, 4, 6), 0.0);
    assert_eq!((hot.state(), hot.first_authentic()), (State::TrackingChain, None));
    feed(&mut hot, &sky(&chain(), NOMINAL, 6, 8), 0.0);
    assert_eq!((hot.state(), hot.first_authentic()), (State::Authentic, Some(BEGIN.later(7))));
    let other = Verifier::new(Anchor::Root(public(2), Box::new(kroot)), Settings::default());
    assert_eq!(other.err(), Some(KeyFault::Signature));
    assert!(Verifier::root_of(&stored[..50]).is_err() && Verifier::root_of(&[]).is_err());
}

#[test]
fn a_tag_of_other_data_is_refused() {
    // One satellite sends a forged word from sub-frame 16 on.
    let is_forged = |own: &Page| own.sender == 5 && own.start >= BEGIN.later(16) && own.word() >> 122 == 3;
    let pages: Vec<Page> = sky(&chain(), NOMINAL, 10, 40)
        .iter()
        .map(|own| if is_forged(own) { forged(own, |word, _, _| *word ^= 1 << 40) } else { *own })
        .collect();
    let mut own = warm();
    let mut reports = feed(&mut own, &pages, 0.0);
    reports.extend(own.finish());
    let of_forged =
        |report: &&TagReport| report.of == 5 && report.sent >= BEGIN.later(17) && report.adkd != Adkd::Timing;
    let settled: Vec<_> = reports.iter().filter(of_forged).map(|report| report.outcome).collect();
    assert!(settled.contains(&Outcome::Refused(Refusal::Tag)) && !settled.contains(&Outcome::Authentic));
    let others = reports.iter().filter(|report| !of_forged(report));
    assert!(others.clone().all(|report| !matches!(report.outcome, Outcome::Refused(_))));
    assert!(others.clone().any(|report| report.outcome == Outcome::Authentic));
}

#[test]
fn forged_tags_sequences_slots_and_keys_are_refused_by_name() {
    // Position of the page in its sub-frame, bit of the section, and the result that is to be counted.
    type Check = fn(&Counts) -> u64;
    let cases: [(usize, u32, Check); 4] = [
        (0, 1 << 31, |counts| count(counts, Outcome::Refused(Refusal::Tag))),
        (1, 1 << 23, |counts| count(counts, Outcome::Refused(Refusal::Macseq))),
        // Kind of the last tag, whose slot is fixed.
        (10, 1 << 22, |counts| count(counts, Outcome::Refused(Refusal::Slot))),
        (12, 1, |counts| counts.keys_refused),
    ];
    let pages = sky(&chain(), NOMINAL, 10, 40);
    for (index, bit, counted) in cases {
        let is_forged = |own: &Page| own.sender == 5 && own.start >= BEGIN.later(16) && own.index() == index;
        let change = |own: &Page| if is_forged(own) { forged(own, |_, _, mack| *mack ^= bit) } else { *own };
        let mut own = warm();
        feed(&mut own, &pages.iter().map(change).collect::<Vec<_>>(), 0.0);
        own.finish();
        assert!(counted(own.counts()) >= 22, "{index}: {:?}", own.counts());
        assert_eq!(own.counts().keys_verified, 30, "{index}");
        assert!(count(own.counts(), Outcome::Authentic) > 400, "{index}");
    }
}

#[test]
fn a_replay_beyond_the_limit_of_its_key_is_not_verified() {
    let pages = sky(&chain(), NOMINAL, 10, 50);
    let run = |late_s: f64| {
        let mut own = warm();
        feed(&mut own, &pages, late_s);
        let state = own.state();
        own.finish();
        let fast = own.counts().tags_where(|adkd, own| adkd != Adkd::SlowMac && own == Outcome::Authentic);
        let slow = own.counts().tags_where(|adkd, own| adkd == Adkd::SlowMac && own == Outcome::Authentic);
        (state, fast > 0, slow > 0, count(own.counts(), Outcome::NotVerifiable(Gap::Time)) > 0)
    };
    assert_eq!(run(28.9), (State::Authentic, true, true, false));
    assert_eq!(run(29.0), (State::Authentic, false, true, true));
    assert_eq!(run(328.9), (State::Authentic, false, true, true));
    // A clock an hour off, in either direction, and one that is no number.
    for late_s in [329.0, 3600.0, -1.1, -3600.0, f64::NAN] {
        assert_eq!(run(late_s), (State::ClockDisagrees, false, false, false), "{late_s}");
    }
}

#[test]
fn the_chain_is_followed_across_an_hour_without_pages() {
    let mut own = warm();
    let early = feed(&mut own, &sky(&chain(), NOMINAL, 10, 16), 0.0);
    assert!(early.iter().any(|report| report.outcome == Outcome::Authentic));
    let late = sky(&chain(), NOMINAL, 136, 140);
    feed(&mut own, &late[..30], 0.0);
    assert_eq!(own.state(), State::TrackingChain);
    feed(&mut own, &late[30..], 0.0);
    assert_eq!(own.state(), State::Authentic);
    own.finish();
    // Words of before the gap are older than the tags allow.
    assert_eq!(count(own.counts(), Outcome::NotVerifiable(Gap::OldWords)), 20);
    assert_eq!(own.counts().refused(), 0);
}

#[test]
fn a_wrong_key_or_tree_authenticates_nothing() {
    let pages = sky(&chain(), NOMINAL, 0, 30);
    let run = |anchor: Anchor| {
        let mut own = verifier(anchor);
        feed(&mut own, &pages, 0.0);
        own.finish();
        assert_eq!(count(own.counts(), Outcome::Authentic), 0);
        own
    };
    let own = run(Anchor::Key(PublicKey::new(1, &point(9)).unwrap()));
    assert!(own.counts().kroot_refused > 0 && own.state() == State::KeyVerified);
    let own = run(Anchor::Key(public(2)));
    assert!(own.counts().kroot_without_key > 0 && own.counts().kroot_refused == 0);
    assert_eq!(own.counts().subframes_without_root, 120);
    let own = run(Anchor::Tree(crate::keys::MerkleRoot([7; 32])));
    assert!(own.counts().pkr_refused > 0 && own.state() == State::NoKey);
}

#[test]
fn data_need_as_many_bits_of_tags_as_the_setting_asks() {
    let after = |tag_bits: u32| {
        let settings = Settings { time_uncertainty_s: 1.0, tag_bits };
        let mut own = Verifier::new(Anchor::Key(public(1)), settings).unwrap();
        feed(&mut own, &sky(&chain(), NOMINAL, 10, 30), 0.0);
        own.first_authentic().map(|time| time.since_s(BEGIN) / 30)
    };
    // Four tags of a sub-frame are about a satellite. The root comes at the end of sub-frame 14, and with it
    // the tags of sub-frames 11 to 13.
    assert_eq!((after(40), after(480), after(481)), (Some(15), Some(15), Some(16)));
}

#[test]
fn what_must_not_be_used_is_never_authentic() {
    let mut own = warm();
    feed(&mut own, &sky(&chain(), STOP, 10, 30), 0.0);
    assert_eq!(own.state(), State::DoNotUse);
    assert_eq!(count(own.counts(), Outcome::Authentic), 0);
    assert!(count(own.counts(), Outcome::NotVerifiable(Gap::DoNotUse)) > 100);
    // An alert stays, whatever is sent after it.
    let signed = chain();
    let alert = pkr(15);
    let all = |number: i64| SENDERS.map(|sender| signed.subframe(sender, BEGIN.later(number), NOMINAL, 12, &alert));
    let mut own = verifier(Anchor::Tree(root()));
    feed(&mut own, &sky(&signed, NOMINAL, 0, 20), 0.0);
    assert_eq!(own.state(), State::Authentic);
    feed(&mut own, &merged((20..40).flat_map(all)), 0.0);
    feed(&mut own, &sky(&signed, NOMINAL, 40, 60), 0.0);
    assert_eq!(own.state(), State::DoNotUse);
}

/// Sub-frames of a chain that all carry one message.
fn with(signed: &Signed, header: NmaHeader, message: &[u8], from: i64, to: i64) -> Vec<Page> {
    let all = |number: i64| SENDERS.map(|sender| signed.subframe(sender, BEGIN.later(number), header, 4, message));
    merged((from..to).flat_map(all))
}

#[test]
fn a_revoked_chain_does_not_come_back() {
    let (old, new) = (chain(), Signed::new(2, Hash::Sha256, MacFunction::HmacSha256));
    let mut own = warm();
    feed(&mut own, &sky(&old, NOMINAL, 10, 20), 0.0);
    let (stop, after) = (NmaHeader(0b1101_0110), NmaHeader(0b1010_0110));
    feed(&mut own, &with(&old, stop, &new.kroot(stop, 1, 0), 20, 30), 0.0);
    assert_eq!(own.state(), State::DoNotUse);
    feed(&mut own, &with(&new, after, &new.kroot(after, 1, 0), 30, 50), 0.0);
    assert_eq!(own.state(), State::Authentic);
    // The old chain again, with its root key as it was signed.
    let before = own.counts().clone();
    feed(&mut own, &with(&old, NOMINAL, &old.kroot(NOMINAL, 1, 0), 50, 80), 0.0);
    own.finish();
    let gained = count(own.counts(), Outcome::Authentic) - count(&before, Outcome::Authentic);
    assert!(gained <= 24 + 80, "{gained}");
    assert_eq!(own.last_keys(), [(2, BEGIN.later(49))]);
}

#[test]
fn a_revoked_public_key_signs_nothing_any_more() {
    let (old, new) = (chain(), Signed::new(2, Hash::Sha256, MacFunction::HmacSha256));
    let mut own = verifier(Anchor::Tree(root()));
    feed(&mut own, &sky(&old, NOMINAL, 0, 20), 0.0);
    let (stop, after) = (NmaHeader(0b1101_1010), NmaHeader(0b1010_1010));
    let all = |number: i64| SENDERS.map(|sender| old.subframe(sender, BEGIN.later(number), stop, 13, &pkr(1)));
    feed(&mut own, &merged((20..34).flat_map(all)), 0.0);
    feed(&mut own, &with(&old, stop, &new.kroot(stop, 2, 0), 34, 44), 0.0);
    assert_eq!(own.state(), State::DoNotUse);
    feed(&mut own, &with(&new, after, &new.kroot(after, 2, 0), 44, 60), 0.0);
    assert_eq!(own.state(), State::Authentic);
    // A root key that the old key signs now.
    feed(&mut own, &with(&old, NOMINAL, &old.kroot(NOMINAL, 1, 1), 60, 80), 0.0);
    assert!(own.counts().kroot_without_key > 0);
    assert_eq!(own.last_keys(), [(2, BEGIN.later(59))]);
}

#[test]
fn pages_that_are_lost_or_out_of_order_make_no_tag_wrong() {
    let mut random = 7_u64;
    let mut draw = |below: u64| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % below
    };
    for case in 0..8 {
        let mut pages = sky(&chain(), NOMINAL, 0, 40);
        pages.retain(|_| draw(10) >= case / 2);
        // The receiver's clock is right, so pages that are swapped come late or early.
        let times: Vec<Gst> = pages.iter().map(|page| page.start).collect();
        for _ in 0..40 * case {
            let (one, other) = (draw(pages.len() as u64) as usize, draw(pages.len() as u64) as usize);
            pages.swap(one, other);
        }
        let mut own = verifier(Anchor::Tree(root()));
        for (page, time) in pages.iter().zip(&times) {
            own.page(page, time.seconds() as f64);
        }
        own.finish();
        assert_eq!(refused(own.counts()), 0, "{case}");
        assert_eq!(own.counts().keys_refused, 0, "{case}");
    }
}

#[test]
fn random_fields_with_right_checks_authenticate_nothing() {
    let mut random = 11_u64;
    let mut draw = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        random >> 32
    };
    let mut own = warm();
    feed(&mut own, &sky(&chain(), NOMINAL, 10, 20), 0.0);
    let next = sky(&chain(), NOMINAL, 20, 60);
    feed(&mut own, &next[..1], 0.0);
    let before = count(own.counts(), Outcome::Authentic);
    for sent in &next[1..] {
        // The header stays, so that keys, tags and blocks are read.
        let (keep, first, second) = (sent.index() == 0, draw(), draw());
        let change = |word: &mut u128, hkroot: &mut u8, mack: &mut u32| {
            *word = u128::from(first) << 96 | u128::from(second);
            *hkroot = if keep { *hkroot } else { second as u8 };
            *mack = first as u32;
        };
        feed(&mut own, &[forged(sent, change)], 0.0);
    }
    own.finish();
    assert_eq!(count(own.counts(), Outcome::Authentic), before);
    assert!(own.counts().keys_refused > 100);
    assert_eq!((own.counts().kroot_verified, own.counts().pkr_verified), (1, 0));
}
