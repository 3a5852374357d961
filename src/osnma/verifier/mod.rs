//! Verifier of a receiver: pages in, results of tags out.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6, and OSNMA receiver guidelines 1.3. Pages of all satellites come in
//! the order of time with the receiver's own time; a sub-frame is closed by the first page of a later one. At
//! its end its messages and keys are verified, then tags whose key has come, then its own tags wait for
//! theirs. Loose time synchronisation: a tag counts only if, by the receiver's own time and its uncertainty,
//! it came before its key was sent (30 s, or 330 s for the slow MAC). Limits: pages of a closed sub-frame are
//! counted and not used; sub-frames wait two hours for the root of their chain, and tags for their key, at
//! most.

mod messages;
mod tags;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::bits::Row;
use crate::chain::Trust;
use crate::data::Words;
use crate::dsm::{Collector, Kroot};
use crate::fields::{NmaHeader, NmaStatus};
use crate::keys::{Anchor, KeyFault, MerkleRoot, PublicKey};
use crate::page::{Page, PageError};
use crate::report::{Counts, State, TagReport};
use crate::subframe::Subframe;
use crate::time::{Gst, SUBFRAME_S};
use tags::Waiting;

/// Delay from which on a key may be known before its tag, in seconds: one sub-frame.
const FAST_LIMIT_S: f64 = 30.0;
/// Delay from which on also the slow MAC's key may be known: ten sub-frames more.
const SLOW_LIMIT_S: f64 = 330.0;
/// Time for which sub-frames wait for a root and tags for a key, in seconds.
const PATIENCE_S: i64 = 2 * 3600;
/// Sub-frames for which authenticated data keep the state [`State::Authentic`].
const RECENT: i64 = 10;

/// Settings of a verifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Bound of the error of the receiver's own time, in seconds.
    pub time_uncertainty_s: f64,
    /// Bits of right tags after which data are authentic.
    pub tag_bits: u32,
}

impl Default for Settings {
    /// An own time within 15 s, and 40 bits (receiver guidelines 1.3, 4.2).
    fn default() -> Self {
        Self { time_uncertainty_s: 15.0, tag_bits: 40 }
    }
}

/// Verifier of all satellites' authentication.
#[derive(Clone, Debug)]
pub struct Verifier {
    settings: Settings,
    tree: Option<MerkleRoot>,
    keys: BTreeMap<u8, PublicKey>,
    /// Least number of a public key that is not revoked.
    least_key: u8,
    chains: BTreeMap<u8, Trust>,
    /// Numbers alpha of revoked chains.
    revoked: BTreeSet<[u8; 6]>,
    collector: Collector,
    /// Messages that were handled, with the NMA header of a root key.
    handled: BTreeSet<(u8, Vec<u8>)>,
    /// Newest root key, for a hot start.
    kroot: Option<(NmaHeader, Vec<u8>)>,
    words: Words,
    open: BTreeMap<u8, Subframe>,
    now: Option<Gst>,
    waiting: Vec<Waiting>,
    /// Sub-frames before the root of their chain is known, with the words before each.
    unrooted: Vec<(Subframe, Arc<Words>)>,
    /// Sub-frames of the last hours whose key was proved, with the number of the chain.
    proved: BTreeMap<Gst, u8>,
    status: Option<NmaStatus>,
    alert: bool,
    clock_disagrees: bool,
    /// Data and bits of right tags, by satellite and whether they are timing parameters.
    strength: BTreeMap<(u8, bool), (Row, u32)>,
    first_root: Option<Gst>,
    first_authentic: Option<Gst>,
    last_authentic: Option<Gst>,
    counts: Counts,
    reports: Vec<TagReport>,
    /// Ephemerides that became authentic since they were taken last.
    authentic: Vec<Authenticated>,
}

/// Ephemeris, clock and status of a satellite that became authentic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Authenticated {
    /// Satellite whose data they are.
    pub satellite: u8,
    /// Words 1 to 5 with the covered bits ([`crate::data::words_under`]).
    pub words: [u128; 5],
    /// Sub-frame of the tag that made them authentic.
    pub sent: Gst,
}

impl Verifier {
    /// Verifier that trusts an anchor. A stored root key is verified at once.
    ///
    /// # Errors
    /// [`KeyFault`] of a stored root key that its public key did not sign.
    pub fn new(anchor: Anchor, settings: Settings) -> Result<Self, KeyFault> {
        let mut verifier = Self {
            settings,
            tree: None,
            keys: BTreeMap::new(),
            least_key: 0,
            chains: BTreeMap::new(),
            revoked: BTreeSet::new(),
            collector: Collector::default(),
            handled: BTreeSet::new(),
            kroot: None,
            words: Words::default(),
            open: BTreeMap::new(),
            now: None,
            waiting: Vec::new(),
            unrooted: Vec::new(),
            proved: BTreeMap::new(),
            status: None,
            alert: false,
            clock_disagrees: false,
            strength: BTreeMap::new(),
            first_root: None,
            first_authentic: None,
            last_authentic: None,
            counts: Counts::default(),
            reports: Vec::new(),
            authentic: Vec::new(),
        };
        match anchor {
            Anchor::Tree(root) => verifier.tree = Some(root),
            Anchor::Key(key) => {
                verifier.keys.insert(key.id, key);
            }
            Anchor::Root(key, kroot) => {
                key.verify(&kroot)?;
                verifier.keys.insert(key.id, key);
                verifier.trust(*kroot);
            }
        }
        Ok(verifier)
    }

    /// Takes a page that the receiver got `own_s` seconds after GST began by its own clock, counted at the
    /// page's beginning. Returns the results of tags that it settled.
    pub fn page(&mut self, page: &Page, own_s: f64) -> Vec<TagReport> {
        self.counts.pages += 1;
        match page.check() {
            Ok(()) => {}
            Err(PageError::Checksum) => {
                self.counts.checksum += 1;
                return Vec::new();
            }
            Err(PageError::Parts) => {
                self.counts.not_nominal += 1;
                return Vec::new();
            }
        }
        let late_s = own_s - page.start.seconds() as f64;
        let bound_s = late_s + self.settings.time_uncertainty_s;
        // A page from the future, one that is older than the slowest key, or a clock that is no number.
        self.clock_disagrees = !(0.0..SLOW_LIMIT_S).contains(&bound_s);
        if self.clock_disagrees {
            self.counts.clock_disagrees += 1;
            return Vec::new();
        }
        let start = page.start.subframe();
        if self.now.is_some_and(|now| start < now) {
            self.counts.out_of_order += 1;
            return Vec::new();
        }
        if self.now.is_some_and(|now| start > now) {
            self.close();
        }
        self.now = Some(start);
        let subframe = self.open.entry(page.sender).or_insert_with(|| Subframe::new(page.sender, start));
        if !subframe.put(page, bound_s) {
            self.counts.out_of_order += 1;
        }
        std::mem::take(&mut self.reports)
    }

    /// Closes the last sub-frame, and gives the tags that still wait as not verifiable.
    pub fn finish(&mut self) -> Vec<TagReport> {
        self.close();
        self.give_up(|_| true);
        std::mem::take(&mut self.reports)
    }

    /// Ephemerides that became authentic since this was asked last.
    pub fn take_authentic(&mut self) -> Vec<Authenticated> {
        std::mem::take(&mut self.authentic)
    }

    /// Sub-frame that is open: that of the newest page.
    pub fn now(&self) -> Option<Gst> {
        self.now
    }

    /// State after the last page.
    pub fn state(&self) -> State {
        let recent = |now: Gst| self.last_authentic.is_some_and(|last| now.since_s(last) <= RECENT * SUBFRAME_S);
        let follows = |trust: &Trust| trust.newest() != trust.root();
        if self.must_not_be_used() {
            State::DoNotUse
        } else if self.clock_disagrees {
            State::ClockDisagrees
        } else if self.now.is_some_and(recent) {
            State::Authentic
        } else if self.chains.values().any(follows) {
            State::TrackingChain
        } else if !self.chains.is_empty() {
            State::RootVerified
        } else if !self.keys.is_empty() {
            State::KeyVerified
        } else {
            State::NoKey
        }
    }

    /// Counts up to now.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// End of the sub-frame in which the first root of a chain was verified.
    pub fn first_root(&self) -> Option<Gst> {
        self.first_root
    }

    /// End of the sub-frame whose key made the first data authentic.
    pub fn first_authentic(&self) -> Option<Gst> {
        self.first_authentic
    }

    /// Newest verified root key as it was sent, with its NMA header first: what a hot start stores.
    pub fn stored_root(&self) -> Option<Vec<u8>> {
        self.kroot.as_ref().map(|(header, bytes)| [&[header.0], &bytes[..]].concat())
    }

    /// Reads a root key that [`Self::stored_root`] gave.
    ///
    /// # Errors
    /// [`crate::dsm::DsmError`].
    pub fn root_of(stored: &[u8]) -> Result<Kroot, crate::dsm::DsmError> {
        let (header, bytes) = stored.split_first().ok_or(crate::dsm::DsmError::Short)?;
        Kroot::parse(NmaHeader(*header), bytes)
    }

    /// Chains that are trusted, each with the sub-frame of its newest key.
    pub fn last_keys(&self) -> Vec<(u8, Gst)> {
        self.chains.values().map(|trust| (trust.chain.id, trust.newest().start)).collect()
    }

    fn must_not_be_used(&self) -> bool {
        self.alert || self.status == Some(NmaStatus::DoNotUse)
    }

    /// Ends the open sub-frame of all satellites.
    fn close(&mut self) {
        let Some(start) = self.now else { return };
        let all = std::mem::take(&mut self.open);
        let (signed, others): (Vec<_>, Vec<_>) = all.values().partition(|subframe| subframe.is_signed());
        self.counts.subframes += signed.len() as u64;
        self.counts.unsigned_subframes += others.len() as u64;
        for subframe in &signed {
            self.messages(subframe);
        }
        self.root_now();
        for subframe in &signed {
            self.take_key(subframe);
        }
        self.settle();
        if planted!("osnma.data.issue", false, true) {
            self.keep_words(&all, start);
        }
        let words = Arc::new(std::mem::take(&mut self.words));
        for subframe in &signed {
            if self.trusts(subframe) {
                self.wait(subframe, &words);
            } else {
                self.unrooted.push(((*subframe).clone(), Arc::clone(&words)));
            }
        }
        self.words = Arc::unwrap_or_clone(words);
        self.keep_words(&all, start);
        self.give_up(|then| start.since_s(then) > PATIENCE_S);
        self.proved.retain(|then, _| start.since_s(*then) <= PATIENCE_S);
    }

    /// Keeps the words of a sub-frame of all satellites.
    fn keep_words(&mut self, all: &BTreeMap<u8, Subframe>, start: Gst) {
        for subframe in all.values() {
            self.words.put(subframe.sender, start, &subframe.words());
        }
    }

    /// Takes keys and tags of sub-frames that waited for a root which is known now.
    fn root_now(&mut self) {
        let waited = std::mem::take(&mut self.unrooted);
        let (rooted, still): (Vec<_>, Vec<_>) = waited.into_iter().partition(|(subframe, _)| self.trusts(subframe));
        self.unrooted = still;
        for (subframe, words) in &rooted {
            self.take_key(subframe);
            self.wait(subframe, words);
        }
    }
}
