//! Stages of a provider: which chain, key and tree are in force, and what the NMA header says.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 5. A transition has one or two steps before all is nominal again. The
//! signal tells that a Merkle tree is renewed, and sends a key of the new tree; its root comes from outside
//! of the signal. An alert stays.

use super::{Settings, SettingsError};
use crate::fields::{NmaHeader, Notice};
use crate::time::{Gst, SUBFRAME_S};

/// Kind of a transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The chain ends and the next one follows.
    EndOfChain,
    /// The chain is revoked.
    ChainRevoked,
    /// A new public key comes into force.
    NewPublicKey,
    /// The public key is revoked, and with it the chain.
    PublicKeyRevoked,
    /// A new Merkle tree comes into force, and a key of it.
    NewMerkleTree,
    /// Authentication must not be used any more.
    Alert,
}

impl Change {
    /// Kinds with their names.
    pub const NAMES: [(&'static str, Self); 6] = [
        ("end_of_chain", Self::EndOfChain),
        ("chain_revoked", Self::ChainRevoked),
        ("new_public_key", Self::NewPublicKey),
        ("public_key_revoked", Self::PublicKeyRevoked),
        ("new_merkle_tree", Self::NewMerkleTree),
        ("alert", Self::Alert),
    ];

    fn notice(self) -> Notice {
        match self {
            Self::EndOfChain => Notice::EndOfChain,
            Self::ChainRevoked => Notice::ChainRevoked,
            Self::NewPublicKey => Notice::NewPublicKey,
            Self::PublicKeyRevoked => Notice::PublicKeyRevoked,
            Self::NewMerkleTree => Notice::NewMerkleTree,
            Self::Alert => Notice::Alert,
        }
    }

    /// Number of steps before all is nominal; none for an alert, which stays.
    fn steps(self) -> i64 {
        match self {
            Self::EndOfChain => 1,
            _ => 2,
        }
    }
}

/// Transition with the time of its first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// Kind of the transition.
    pub kind: Change,
    /// Time of its first step, taken to the beginning of a sub-frame.
    pub start: Gst,
}

/// Leaf of a tree that a DSM-PKR brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaf {
    Key { tree: usize, key: u8 },
    Alert { tree: usize },
}

impl Leaf {
    pub(super) fn tree(self) -> usize {
        match self {
            Self::Key { tree, .. } | Self::Alert { tree } => tree,
        }
    }
}

/// Time in which nothing changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    pub(super) from: Gst,
    /// Number of the chain whose keys are sent, from 0.
    pub(super) in_force: usize,
    /// Number of the chain whose root is sent.
    pub(super) announced: usize,
    /// Number of the tree that holds the signing key.
    pub(super) tree: usize,
    /// Position of the signing key in its tree.
    pub(super) key: u8,
    /// Leaf that is sent in the turns of the public key.
    pub(super) published: Leaf,
    notice: Notice,
    must_stop: bool,
}

impl Stage {
    /// Number of the signing key, PKID.
    pub(super) fn key_id(&self) -> u8 {
        self.key + 1
    }

    /// NMA header of the stage.
    pub(super) fn header(&self, is_operational: bool) -> NmaHeader {
        let status = if self.must_stop { 3 } else { 1 + u8::from(is_operational) };
        let notice = match self.notice {
            Notice::Reserved => 0,
            Notice::Nominal => 1,
            Notice::EndOfChain => 2,
            Notice::ChainRevoked => 3,
            Notice::NewPublicKey => 4,
            Notice::PublicKeyRevoked => 5,
            Notice::NewMerkleTree => 6,
            Notice::Alert => 7,
        };
        NmaHeader(status << 6 | ((self.in_force as u8 + 1) % 4) << 4 | notice << 1)
    }

    /// NMA header of its chain while nothing changes.
    pub(super) fn nominal(&self, is_operational: bool) -> NmaHeader {
        Self { notice: Notice::Nominal, must_stop: false, ..*self }.header(is_operational)
    }

    /// True if a sub-frame has the turn of the public key: by the clock, and half of the time while the leaf
    /// is new.
    pub(super) fn sends_key(&self, start: Gst, settings: &Settings) -> bool {
        let number = start.seconds().div_euclid(SUBFRAME_S);
        let is_new = self.published != Leaf::Key { tree: self.tree, key: self.key }
            || matches!(self.notice, Notice::PublicKeyRevoked | Notice::NewPublicKey | Notice::NewMerkleTree);
        if is_new {
            let half = (settings.step / 2).clamp(1, 10);
            return start.since_s(self.from) / SUBFRAME_S % (2 * half) < half;
        }
        number.rem_euclid(settings.key_every.max(1)) < settings.key_for
    }
}

/// Stages of a schedule in the order of time, the first one from `begin` on.
pub(super) fn stages(settings: &Settings, begin: Gst) -> Result<Vec<Stage>, SettingsError> {
    let step = settings.step.max(1);
    let mut now = Stage {
        from: begin,
        in_force: 0,
        announced: 0,
        tree: 0,
        key: 0,
        published: Leaf::Key { tree: 0, key: 0 },
        notice: Notice::Nominal,
        must_stop: false,
    };
    let mut all = vec![now];
    let mut free = begin;
    let (mut chains, mut keys) = (0, 0);
    for (number, transition) in (1..).zip(&settings.transitions) {
        let (kind, start) = (transition.kind, transition.start.subframe());
        if now.notice == Notice::Alert {
            return Err(SettingsError::AfterAlert(number));
        }
        if start < free {
            return Err(SettingsError::Overlap(number, 2 * step * SUBFRAME_S));
        }
        let new_chain = matches!(kind, Change::EndOfChain | Change::ChainRevoked | Change::PublicKeyRevoked);
        let new_tree = usize::from(kind == Change::NewMerkleTree);
        let new_key = matches!(kind, Change::NewPublicKey | Change::PublicKeyRevoked | Change::NewMerkleTree);
        let next_key = Leaf::Key { tree: now.tree + new_tree, key: now.key + 1 };
        (chains, keys) = (chains + usize::from(new_chain), keys + usize::from(new_key));
        if chains > 3 {
            return Err(SettingsError::Chains(chains));
        }
        if keys > 14 {
            return Err(SettingsError::Keys(keys));
        }
        // First step: what comes is announced, and what is revoked must not be used.
        let mut first = Stage { from: start, notice: kind.notice(), announced: now.in_force, ..now };
        first.announced += usize::from(new_chain);
        first.must_stop = matches!(kind, Change::ChainRevoked | Change::PublicKeyRevoked | Change::Alert);
        if new_key {
            first.published = next_key;
        }
        if kind == Change::PublicKeyRevoked {
            first.key += 1;
        }
        if kind == Change::Alert {
            first.published = Leaf::Alert { tree: now.tree };
            all.push(first);
            now = first;
            continue;
        }
        all.push(first);
        // Second step: it is in force, and the header still says why.
        let second = Stage { from: start.later(step), in_force: first.announced, must_stop: false, ..first };
        let second = match next_key {
            Leaf::Key { tree, key } if new_key => Stage { tree, key, ..second },
            _ => second,
        };
        if kind.steps() == 2 {
            all.push(second);
        }
        free = start.later(kind.steps() * step);
        now = Stage { from: free, notice: Notice::Nominal, ..second };
        all.push(now);
    }
    Ok(all)
}
