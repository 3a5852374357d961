//! Provider of OSNMA: the 40 bits of authentication that satellites send in each page of I/NAV on E1-B.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 3 to 6. Keys, tree and chains follow from a seed: they are test keys
//! and authenticate no signal of Galileo. The bits are a pure function of settings, data and time, and any
//! sub-frame is computed by itself. A tag is made with the key that is sent one sub-frame later, or eleven
//! for the slow MAC, by the chain that is in force then. Limits: keys of 128 bits, tags of 40 bits, ECDSA
//! P-256; chains last 32 days.

mod chains;
mod keys;
mod messages;
mod schedule;
mod sections;
mod transmission;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::OnceLock;

use thiserror::Error;

use crate::chain::{Hash, MacFunction};
use crate::dsm::{DsmError, Kroot};
use crate::fields::NmaHeader;
use crate::keys::{Anchor, MerkleRoot, PublicKey};
use crate::page::PAGES;
use crate::tables::slots;
use crate::time::Gst;
use chains::KeyChain;
use keys::Secrets;
pub use schedule::{Change, Transition};
use schedule::{Stage, stages};
pub use transmission::{Broadcast, Transmission};

/// Length of a tag, in bits.
const TAG_BITS: usize = 40;
/// Length of a key, in bytes.
const KEY_BYTES: usize = 16;
/// Seconds of an hour, at which root keys stand.
const HOUR_S: i64 = 3600;

/// Bits of the pages of one sub-frame: 40 each, the first sent the most significant.
pub type Fields = [u64; PAGES];
/// Words of I/NAV that a satellite sends in one sub-frame, by type.
pub type Words = BTreeMap<u8, u128>;

/// Settings of a provider.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Seed of all keys.
    pub seed: u64,
    /// Time from which on keys are needed. The chain and its first root begin an hour before.
    pub start: Gst,
    /// Hash of the chain.
    pub hash: Hash,
    /// Function of the tags.
    pub mac: MacFunction,
    /// Number of the MAC look-up table.
    pub table: u8,
    /// True for the status "operational", false for "test".
    pub is_operational: bool,
    /// Numbers of satellites that send zeros instead of authentication.
    pub without: BTreeSet<u8>,
    /// Sub-frames from one turn of the public key to the next.
    pub key_every: i64,
    /// Sub-frames for which each turn of the public key lasts.
    pub key_for: i64,
    /// Sub-frames of each step of a transition.
    pub step: i64,
    /// Transitions in the order of time.
    pub transitions: Vec<Transition>,
}

impl Settings {
    /// Settings with the parameters that the operational service has: SHA-256, HMAC-SHA-256, table 34.
    pub fn new(seed: u64, start: Gst) -> Self {
        Self {
            seed,
            start,
            hash: Hash::Sha256,
            mac: MacFunction::HmacSha256,
            table: 34,
            is_operational: true,
            without: BTreeSet::new(),
            key_every: 20,
            key_for: 6,
            step: 20,
            transitions: Vec::new(),
        }
    }
}

/// Reason for which settings make no provider.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum SettingsError {
    /// A look-up table that does not exist, or that has another number of tags.
    #[error("table {0}: expected 27, 33, 34 or 35, which have as many tags of 40 bits as a sub-frame")]
    Table(u8),
    /// A transition that begins before the one before has ended.
    #[error("transition {0} begins before the one before it has ended: expected at least {1} s between them")]
    Overlap(usize, i64),
    /// A transition after the alert.
    #[error("transition {0} follows an alert, which is the last one")]
    AfterAlert(usize),
    /// More changes of the chain than there are numbers of chains.
    #[error("{0} changes of the chain: expected at most 3, because chains are numbered from 0 to 3")]
    Chains(usize),
    /// More changes of the public key than there are numbers of keys.
    #[error("{0} changes of the public key: expected at most 14, because keys are numbered from 1 to 15")]
    Keys(usize),
}

/// Keys that a receiver may trust at its start, by the scene that made them.
#[derive(Clone, Debug)]
pub struct Published {
    /// Root of the Merkle tree.
    pub root: MerkleRoot,
    /// Public key in force.
    pub key: PublicKey,
    /// Root key of the chain in force with its NMA header first, as [`crate::verifier::Verifier::root_of`]
    /// reads it.
    pub kroot: Vec<u8>,
    point: Vec<u8>,
    tree: Vec<(usize, usize, [u8; 32])>,
}

/// Deterministic provider of keys, signatures and tags.
pub struct Provider {
    settings: Settings,
    secrets: Secrets,
    chains: Vec<KeyChain>,
    stages: Vec<Stage>,
    /// Root key and public key or alert of each stage, as they are sent.
    messages: Vec<OnceLock<[Vec<u8>; 2]>>,
}

impl fmt::Debug for Provider {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Provider").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl Provider {
    /// Creates the provider of settings.
    ///
    /// # Errors
    /// [`SettingsError`].
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        let fits = slots(settings.table, 0).is_some_and(|slots| slots.len() + 1 == sections::TAGS);
        if !fits {
            return Err(SettingsError::Table(settings.table));
        }
        let begin = hour_of(Gst::of_seconds(settings.start.seconds() - HOUR_S));
        let stages = stages(&settings, begin)?;
        let secrets = Secrets::new(settings.seed);
        let count = stages.iter().map(|stage| stage.announced + 1).max().unwrap_or(1);
        let chains = (0..count).map(|number| KeyChain::new(&secrets, &settings, number, begin)).collect();
        let messages = stages.iter().map(|_| OnceLock::new()).collect();
        Ok(Self { settings, secrets, chains, stages, messages })
    }

    /// Settings of the provider.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Keys that a receiver may have stored before it starts at a time.
    pub fn anchor(&self, start: Gst) -> Option<Published> {
        let (_, stage) = self.stage(start);
        let point = self.secrets.point(stage.tree, stage.key);
        let key = PublicKey::new(stage.key_id(), &point).ok()?;
        let header = stage.nominal(self.settings.is_operational);
        let message = self.kroot(header, stage.in_force, stage, hour_of(start.max(stage.from)))?;
        let kroot = [&[header.0], &message[..]].concat();
        Some(Published { root: self.secrets.root(stage.tree), key, kroot, point, tree: self.secrets.nodes(stage.tree) })
    }

    /// NMA header of a sub-frame.
    pub fn header(&self, start: Gst) -> NmaHeader {
        self.stage(start).1.header(self.settings.is_operational)
    }

    fn stage(&self, start: Gst) -> (usize, &Stage) {
        let after = self.stages.partition_point(|stage| stage.from <= start);
        let index = after.saturating_sub(1);
        (index, &self.stages[index])
    }

    /// Chain in force in a sub-frame.
    fn chain(&self, start: Gst) -> &KeyChain {
        &self.chains[self.stage(start).1.in_force]
    }

    /// Header and root key section of a satellite's sub-frame: one byte a page (ICD, 3.2).
    fn hkroot(&self, sender: u8, start: Gst) -> [u8; PAGES] {
        let (index, stage) = self.stage(start);
        let [kroot, key] = self.messages[index].get_or_init(|| self.messages_of(stage));
        let (id, message) = if stage.sends_key(start, &self.settings) {
            (12 + index as u8 % 4, key)
        } else {
            (index as u8 % 12, kroot)
        };
        messages::section(stage.header(self.settings.is_operational), id, message, sender, start)
    }

    fn messages_of(&self, stage: &Stage) -> [Vec<u8>; 2] {
        let header = stage.header(self.settings.is_operational);
        let kroot = self.kroot(header, stage.announced, stage, hour_of(stage.from)).unwrap_or_default();
        [kroot, messages::pkr(&self.secrets, stage.published)]
    }

    /// DSM-KROOT of a chain, whose root is that of the last sub-frame before an hour.
    fn kroot(&self, header: NmaHeader, chain: usize, stage: &Stage, hour: Gst) -> Option<Vec<u8>> {
        let chain = &self.chains[chain];
        let root = chain.key(hour.later(-1))?;
        Some(messages::kroot(header, &chain.chain, &root, &self.secrets.signer(stage.tree, stage.key), stage.key_id()))
    }
}

impl Published {
    /// Anchor of a cold start.
    pub fn cold(&self) -> Anchor {
        Anchor::Tree(self.root)
    }

    /// Anchor of a warm start.
    pub fn warm(&self) -> Anchor {
        Anchor::Key(self.key.clone())
    }

    /// Anchor of a hot start.
    ///
    /// # Errors
    /// [`DsmError`] of a root key that cannot be read.
    pub fn hot(&self) -> Result<Anchor, DsmError> {
        let (header, message) = self.kroot.split_first().ok_or(DsmError::Short)?;
        Ok(Anchor::Root(self.key.clone(), Box::new(Kroot::parse(NmaHeader(*header), message)?)))
    }

    /// File of the Merkle tree, in the form of [`crate::files::merkle_root`].
    pub fn tree_file(&self) -> String {
        messages::tree_file(self.key.id, &self.point, &self.tree)
    }

    /// File of the public key, in the form of [`crate::files::key`].
    pub fn key_file(&self) -> String {
        messages::key_file(self.key.id, &self.point)
    }

    /// File of the root key, as `osnma verify --kroot` takes it.
    pub fn kroot_file(&self) -> String {
        crate::bits::hex(&self.kroot) + "\n"
    }
}

/// The hour that a time is in.
fn hour_of(time: Gst) -> Gst {
    Gst::of_seconds(time.seconds().div_euclid(HOUR_S) * HOUR_S)
}
