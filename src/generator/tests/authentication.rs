//! Pages as the message encoder sends them, at our verifier and at another one: the crate `galileo-osnma`,
//! which passes the published test vectors.
//!
//! The other verifier reports each tag in its log, by which these tests count.

use std::cell::RefCell;
use std::ops::Range;
use std::path::Path;
use std::sync::Once;

use galileo_osnma::storage::FullStorage;
use galileo_osnma::{InavBand, Osnma, Svn};

use crate::arrival;
use crate::authentication::gst;
use crate::message::{self, Slot};
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use gnss::galileo::e1::E1;
use gnss::galileo::inav::{INAV, decode_soft};
use gnss::time::GST;
use osnma::keys::{Anchor, MerkleRoot};
use osnma::page::Page;
use osnma::provider::Published;
use osnma::report::{Outcome, State, TagReport};
use osnma::verifier::{Settings, Verifier};

const SCENE: &str = "name = \"signed\"\nstart = 2026-03-09T10:40:00\nduration_s = 3600\nseed = 7\n\
    signals = [\"Galileo E1\"]\nnavigation = { file = \"full_sky_2026-03-09_10h_12h.rnx\" }\n\
    motion = { kind = \"static\", latitude_deg = 13.0, longitude_deg = 100.5, height_m = 60 }\n\
    front_end = { sample_rate_hz = 4.1e6 }\n";

thread_local! {
    /// Tags that were right, tags and sections that were wrong, and messages with a wrong key or signature.
    static COUNTS: RefCell<[u32; 3]> = const { RefCell::new([0; 3]) };
}

/// Counter of what the other verifier says.
struct Listener;

impl log::Log for Listener {
    fn enabled(&self, _: &log::Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &log::Record<'_>) {
        let text = record.args().to_string();
        let is = |part: &str| text.contains(part);
        let counted =
            [is(" correct (auth by"), is(" wrong (auth by") || is("error validating"), is("could not verify")];
        COUNTS.with_borrow_mut(|counts| counts.iter_mut().zip(counted).for_each(|(sum, own)| *sum += u32::from(own)));
    }

    fn flush(&self) {}
}

/// Counts of what a closure makes the other verifier say.
fn said(act: impl FnOnce()) -> [u32; 3] {
    static LISTENER: Listener = Listener;
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        log::set_logger(&LISTENER).unwrap();
        log::set_max_level(log::LevelFilter::Info);
    });
    COUNTS.with_borrow_mut(|counts| *counts = [0; 3]);
    act();
    COUNTS.with_borrow(|counts| *counts)
}

fn scenario(more: &str) -> Scenario {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    Scenario::parse_in(&format!("{SCENE}{more}"), "signed.toml", &directory, false).unwrap()
}

/// Pages that a constellation sends in some sub-frames from the scene's start on, in the order of time.
fn pages(scene: &Scene, constellation: usize, subframes: Range<i64>) -> Vec<Page> {
    let sender = scene.messages.of_constellation(constellation).of(&INAV).unwrap();
    let faults = if constellation == 0 { scene.message_faults.as_slice() } else { &[] };
    let begin = GST.label(scene.clock.start).seconds();
    let mut pages = Vec::new();
    for number in 15 * subframes.start..15 * subframes.end {
        let slot = Slot { message: &INAV, time: &GST, unit: INAV.unit_at(begin + 1 + 2 * number) };
        for sv in scene.senders() {
            let Some(set) = scene.catalogue.sent_at(sv, slot.set_chosen()) else { continue };
            let sent = message::unit(faults, sender, [set, set], &slot).unwrap();
            let soft: Vec<f32> = sent.symbols.iter().map(|&bit| if bit { -1.0 } else { 1.0 }).collect();
            let ([even, odd], _) = decode_soft(&soft).unwrap();
            let joined = |bits: &[bool]| bits.iter().fold(0_u128, |all, &bit| all << 1 | u128::from(bit));
            pages.push(Page::new(sv.number, gst(INAV.unit_start(slot.unit)), joined(&even), joined(&odd)));
        }
    }
    pages
}

fn keys(scene: &Scene, subframe: i64) -> Published {
    let at = scene.clock.start.plus_s(30.0 * subframe as f64);
    scene.osnma.as_ref().unwrap().anchor(at).unwrap()
}

fn feed(other: &mut Osnma<FullStorage>, pages: &[Page]) {
    for page in pages {
        let svn = Svn::try_from(page.sender).unwrap();
        let time = galileo_osnma::Gst::new(page.start.week(), page.start.tow_s());
        other.feed_inav(&page.word().to_be_bytes(), svn, time, InavBand::E1B);
        let bits = u64::from(page.hkroot()) << 32 | u64::from(page.mack());
        other.feed_osnma(bits.to_be_bytes()[3..].try_into().unwrap(), svn, time);
    }
}

/// Results of the other verifier, from a cold start.
fn foreign(root: MerkleRoot, pages: &[Page]) -> [u32; 3] {
    said(|| feed(&mut Osnma::from_merkle_tree(root.0, None, false), pages))
}

fn verified(anchor: Anchor, pages: &[Page]) -> (Verifier, Vec<TagReport>) {
    let mut verifier = Verifier::new(anchor, Settings::default()).unwrap();
    let mut reports = Vec::new();
    pages.iter().for_each(|page| reports.extend(verifier.page(page, page.start.seconds() as f64)));
    reports.extend(verifier.finish());
    (verifier, reports)
}

fn right(verifier: &Verifier) -> u64 {
    verifier.counts().tags_where(|_, outcome| matches!(outcome, Outcome::Authentic | Outcome::NoData))
}

#[test]
fn an_hour_with_every_transition_is_right_at_both_verifiers_and_none_refuses_a_tag() {
    let mut more = "[osnma]\nstep_s = 300\n".to_owned();
    let kinds = ["end_of_chain", "chain_revoked", "new_public_key", "public_key_revoked", "new_merkle_tree", "alert"];
    for (number, kind) in kinds.iter().enumerate() {
        more += &format!("[[osnma.transition]]\nkind = \"{kind}\"\ntime_s = {}\n", 300 + 600 * number);
    }
    let scene = scenario(&more).scene().unwrap();
    let hour = pages(&scene, 0, 0..120);
    // Sub-frames up to the renewal of the tree, whose root comes from outside of the signal, and after it.
    let begin = gst(GST.label(scene.clock.start));
    let (before, after) = hour.split_at(hour.partition_point(|page| page.start < begin.later(10 + 4 * 20)));
    assert_ne!(keys(&scene, 0).root, keys(&scene, 119).root);
    for (pages, start, at_least) in [(before, 0, 2000), (after, 119, 400)] {
        let anchor = keys(&scene, start);
        let [correct, wrong, messages] = foreign(anchor.root, pages);
        let (own, _) = verified(anchor.cold(), pages);
        println!("foreign {correct} right, {wrong} wrong, {messages} messages; own {} {:?}", right(&own), own.counts());
        assert_eq!((wrong, own.counts().tags_where(|_, own| matches!(own, Outcome::Refused(_)))), (0, 0));
        assert!(correct > at_least && right(&own) > u64::from(at_least));
    }
    let (own, _) = verified(keys(&scene, 119).cold(), after);
    assert_eq!(own.state(), State::DoNotUse);
}

#[test]
fn a_hot_start_authenticates_after_two_sub_frames_whatever_the_functions() {
    for more in ["", "chain_hash = \"sha3_256\"\nmac_function = \"cmac_aes\"\nmaclt = 35\nstatus = \"test\"\n"] {
        let scenario = scenario(&format!("[osnma]\nwithout = [\"E13\"]\n{more}"));
        let scene = scenario.scene().unwrap();
        assert!(scene.osnma.as_ref().unwrap().describe().contains("zeros from E13"));
        let pages = pages(&scene, 0, 0..24);
        let anchor = scenario.osnma_anchor(&Overrides::default()).unwrap().unwrap();
        let (own, reports) = verified(anchor.hot().unwrap(), &pages);
        let begin = gst(GST.label(scene.clock.start));
        assert_eq!((own.counts().refused(), own.state()), (0, State::Authentic), "{:?}", own.counts());
        assert_eq!((own.first_authentic(), own.counts().unsigned_subframes), (Some(begin.later(3)), 24));
        assert!(reports.iter().any(|report| report.of == 13 && report.outcome == Outcome::Authentic));
        let [correct, wrong, messages] = foreign(anchor.root, &pages);
        assert!(correct > 500 && (wrong, messages) == (0, 0), "{correct} {wrong} {messages}");
    }
}

#[test]
fn forged_words_and_the_keys_of_a_spoofer_are_refused_by_both_verifiers() {
    let fault = "[osnma]\n[[message_fault]]\nkind = \"parameter\"\nparameter = \"crs_m\"\nadd = 40.0\n\
        satellites = [\"E13\"]\non_s = 300\n[[spoofer]]\npower_db = 6\nosnma = \"own_keys\"\n\
        [[spoofer]]\npower_db = 6\nosnma = \"none\"\n[[spoofer]]\npower_db = 6\n";
    let scene = scenario(fault).scene().unwrap();
    let anchor = keys(&scene, 0);
    let forged = pages(&scene, 0, 0..24);
    let (own, reports) = verified(anchor.hot().unwrap(), &forged);
    let changed = gst(GST.label(scene.clock.start)).later(11);
    let of_forged: Vec<_> =
        reports.iter().filter(|r| r.of == 13 && r.adkd.number() != 4 && r.sent >= changed).collect();
    assert!(of_forged.iter().all(|report| report.outcome != Outcome::Authentic), "{:?}", own.counts());
    assert!(of_forged.iter().any(|report| matches!(report.outcome, Outcome::Refused(_))));
    let others = |report: &&TagReport| report.of != 13 && matches!(report.outcome, Outcome::Refused(_));
    assert_eq!(reports.iter().filter(others).count(), 0);
    let [correct, wrong, _] = foreign(anchor.root, &forged);
    assert!(correct > 300 && wrong > 20, "{correct} {wrong}");
    // Keys of its own, zeros, and the true bits.
    let spoofed = pages(&scene, 1, 0..24);
    let (own, _) = verified(anchor.hot().unwrap(), &spoofed);
    assert!(right(&own) == 0 && own.counts().keys_refused > 0, "{:?}", own.counts());
    let [correct, _, messages] = foreign(anchor.root, &spoofed);
    assert!(correct == 0 && messages > 0, "{correct} {messages}");
    assert!(pages(&scene, 2, 0..2).iter().all(|page| (page.hkroot(), page.mack()) == (0, 0)));
    let (own, _) = verified(anchor.hot().unwrap(), &pages(&scene, 3, 0..6));
    assert!(right(&own) > 0 && own.counts().refused() == 0, "{:?}", own.counts());
}

#[test]
fn a_replay_sends_what_was_sent_so_much_earlier_and_its_samples_are_made() {
    let text = "[osnma]\n[[spoofer]]\npower_db = 6\nreplay_s = 40\n";
    let scene = scenario(text).scene().unwrap();
    let (spoofer, local) = (&scene.spoofers[0], scene.clock.start.plus_s(100.0));
    for sv in scene.senders() {
        let late = arrival::seen_from(&scene, spoofer, sv, &E1, local).unwrap().unwrap();
        let then = arrival::seen(&scene, sv, &E1, local.plus_s(-40.0)).unwrap().unwrap();
        let [late, then] = [&late, &then].map(|seen| seen.arrivals.first().copied().unwrap());
        // Steps of the numbers: 7e-15 s of a delay of 40 s, and some more of the sums.
        assert!((late.delay_s - then.delay_s - 40.0).abs() < 1e-13, "{sv}");
        assert!((late.carrier_cycles - then.carrier_cycles).abs() < 1e-4, "{sv}");
    }
    let short = text.replace("[osnma]", "[noise]\n[osnma]");
    let mut scenario = scenario(&short);
    scenario.duration_s = 0.2;
    let scene = scenario.scene().unwrap();
    let made = crate::Generator::new(&scene).unwrap().map(|batch| batch.unwrap().samples.len()).sum::<usize>();
    assert_eq!(made, 2 * scene.samples as usize);
}
