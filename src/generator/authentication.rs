//! Authentication of Galileo's messages on E1-B by the constellation of a scene.
//!
//! The provider signs what the ephemerides of all satellites give, whoever sees them, and before any message
//! fault acts: a fault leaves the tags as they were signed for the true words. Limits: a satellite without an
//! ephemeris at the time of a page has no word there, and tags about it state that there are no data.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use crate::catalogue::Catalogue;
use gnss::facts::OsnmaFacts;
use gnss::galileo::e1::E1;
use gnss::galileo::inav::{self, GST_WEEK, INAV};
use gnss::message::{Authentication, Common};
use gnss::satellite::{Sv, System};
use gnss::time::{Epoch, GST, WEEK_S};
use osnma::chain::{Hash, MacFunction};
use osnma::page::{PAGES, SATELLITES, satellite};
use osnma::provider::{Broadcast, Change, Provider, Published, Transition, Transmission, Words};
use osnma::time::Gst;

/// Provider of OSNMA of a constellation.
#[derive(Debug)]
pub struct Osnma {
    transmission: Transmission,
    /// Facts about it for the judge.
    pub facts: OsnmaFacts,
}

/// Words that satellites send on E1-B without faults.
struct Sent {
    catalogue: Arc<Catalogue>,
    words: inav::Words,
}

/// Time as OSNMA counts it, of an instant labelled in GST.
pub fn gst(label: Epoch) -> Gst {
    Gst::of_seconds(label.seconds() - GST_WEEK * WEEK_S)
}

impl Osnma {
    /// Creates the authentication of the words that satellites send by their ephemerides and `common`.
    pub fn new(provider: Provider, catalogue: &Arc<Catalogue>, common: &Common) -> Self {
        let sent = Sent { catalogue: Arc::clone(catalogue), words: inav::Words::new(common) };
        Self { transmission: Transmission::new(provider, Box::new(sent)), facts: OsnmaFacts::default() }
    }

    /// Authentication with facts about it.
    pub fn with_facts(self, facts: OsnmaFacts) -> Self {
        Self { facts, ..self }
    }

    /// Describes the authentication for the plan.
    pub fn describe(&self) -> String {
        let settings = self.transmission.provider().settings();
        let hash = if settings.hash == Hash::Sha256 { "SHA-256" } else { "SHA3-256" };
        let mac = if settings.mac == MacFunction::HmacSha256 { "HMAC-SHA-256" } else { "CMAC-AES" };
        let mut text = format!("OSNMA with test keys: {hash}, {mac}, look-up table {}", settings.table);
        if !settings.without.is_empty() {
            let names: Vec<String> = settings.without.iter().map(|&number| satellite(number).to_string()).collect();
            text += &format!("; zeros from {}", names.join(", "));
        }
        for Transition { kind, start } in &settings.transitions {
            let name = Change::NAMES.iter().find(|(_, own)| own == kind).map_or("", |(name, _)| name);
            text += &format!("; {name} at {start}");
        }
        text
    }

    /// Keys that a receiver may trust which starts at an instant.
    pub fn anchor(&self, start: Epoch) -> Option<Published> {
        self.transmission.provider().anchor(gst(GST.label(start)))
    }
}

impl Authentication for Osnma {
    fn bits(&self, sv: Sv, start: Epoch) -> u64 {
        if sv.system == System::Galileo { self.transmission.page(sv.number, gst(start)) } else { 0 }
    }
}

impl Sent {
    /// Words of a satellite in the sub-frame that begins at `label`.
    fn words_of(&self, sv: Sv, label: Epoch) -> Words {
        let mut words = Words::new();
        for page in 0..PAGES {
            let start = Epoch::new(label.seconds() + INAV.first_s + INAV.unit_s * page as i64, 0.0);
            let Some(set) = self.catalogue.sent_at(sv, GST.instant(start)) else { continue };
            let set = (INAV.form)(set).timed(|at| GST.label(at));
            if let Ok(word) = self.words.at(&set, start) {
                words.insert((word >> 122) as u8, word);
            }
        }
        words
    }
}

impl Broadcast for Sent {
    fn words(&self, start: Gst) -> BTreeMap<u8, Words> {
        let label = Epoch::new(start.seconds() + GST_WEEK * WEEK_S, 0.0);
        let sends = |number: &u8| (E1.sent)(*number, GST.instant(label));
        let of = |number: u8| (number, self.words_of(satellite(number), label));
        SATELLITES.filter(sends).map(of).filter(|(_, words)| !words.is_empty()).collect()
    }
}

impl fmt::Debug for Sent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("words of the scene's satellites")
    }
}
