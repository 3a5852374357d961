//! Pages as the message encoder sends them, at a verifier.

use std::collections::BTreeMap;

use crate::message;
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use gnss::galileo::e1::E1;
use gnss::galileo::inav::{INAV, decode_soft};
use gnss::satellite::Sv;
use gnss::time::{Epoch, GST};
use osnma::fields::Adkd;
use osnma::page::Page;
use osnma::report::{Gap, Outcome, Refusal, State, TagReport};
use osnma::verifier::{Settings, Verifier};

const SCENE: &str = "name = \"signed\"\nstart = 2020-11-29T11:00:00\nduration_s = 3600\nseed = 7\n\
    signals = [\"Galileo E1\"]\n\
    motion = { kind = \"static\", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }\n\
    front_end = { sample_rate_hz = 4.1e6 }\n";

fn scenario(more: &str) -> Scenario {
    Scenario::from_toml(&format!("{SCENE}{more}")).unwrap()
}

/// Pages that a constellation sends in some sub-frames from the scene's start on, in the order of time.
pub(crate) fn pages(scene: &Scene, constellation: usize, subframes: std::ops::Range<i64>) -> Vec<Page> {
    let sender = scene.messages.of_constellation(constellation).of(&INAV).unwrap();
    let begin = GST.label(scene.clock.start).seconds();
    let mut pages = Vec::new();
    for number in 15 * subframes.start..15 * subframes.end {
        let unit = INAV.unit_at(begin + 1 + 2 * number);
        let slot = message::Slot { message: &INAV, time: &GST, unit };
        for sv in scene.senders() {
            let Some(set) = scene.catalogue.sent_at(sv, slot.set_chosen()) else { continue };
            let faults = if constellation == 0 { scene.message_faults.as_slice() } else { &[] };
            let sent = message::unit(faults, sender, [set, set], &slot).unwrap();
            pages.extend(page(sv, INAV.unit_start(unit), &sent.symbols));
        }
    }
    pages
}

fn page(sv: Sv, label: Epoch, symbols: &[bool]) -> Option<Page> {
    let soft: Vec<f32> = symbols.iter().map(|&bit| if bit { -1.0 } else { 1.0 }).collect();
    let ([even, odd], _) = decode_soft(&soft)?;
    let joined = |bits: &[bool]| bits.iter().fold(0_u128, |all, &bit| all << 1 | u128::from(bit));
    Some(Page::new(sv.number, crate::authentication::gst(label), joined(&even), joined(&odd)))
}

fn verified(mut verifier: Verifier, pages: &[Page]) -> (Verifier, Vec<TagReport>) {
    let mut reports = Vec::new();
    for page in pages {
        reports.extend(verifier.page(page, page.start.seconds() as f64));
    }
    reports.extend(verifier.finish());
    (verifier, reports)
}

fn hot(scenario: &Scenario) -> Verifier {
    let keys = scenario.osnma_anchor(&Overrides::default()).unwrap().unwrap();
    Verifier::new(keys.hot().unwrap(), Settings::default()).unwrap()
}

fn counts(reports: &[TagReport]) -> BTreeMap<Outcome, usize> {
    let mut counts = BTreeMap::new();
    reports.iter().for_each(|report| *counts.entry(report.outcome).or_default() += 1);
    counts
}

#[test]
fn a_hot_start_authenticates_after_the_second_sub_frame_and_refuses_nothing() {
    for more in ["[osnma]\n", "[osnma]\nchain_hash = \"sha3_256\"\nmac_function = \"cmac_aes\"\nmaclt = 41\n"] {
        let scenario = scenario(more);
        let scene = scenario.scene().unwrap();
        let pages = pages(&scene, 0, 0..20);
        let (verifier, reports) = verified(hot(&scenario), &pages);
        assert_eq!(verifier.counts().refused(), 0, "{:?}", verifier.counts());
        assert_eq!(verifier.state(), State::Authentic);
        let start = crate::authentication::gst(GST.label(scene.clock.start));
        assert_eq!(verifier.first_authentic(), Some(start.later(3)), "{:?}", counts(&reports));
        println!("{more} {:?}", counts(&reports));
        let _ = (Adkd::Timing, Gap::NoKey, Refusal::Tag, &E1);
    }
}
