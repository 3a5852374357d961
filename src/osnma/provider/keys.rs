//! Secret keys and Merkle trees that follow from a seed.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6.1 and 6.2. A tree has 16 leaves: public keys 1 to 15, and the alert
//! message. Every secret is a SHA-256 of the seed and of its purpose.

use p256::ecdsa::SigningKey;
use sha2::{Digest, Sha256};

use super::schedule::Leaf;
use crate::dsm::LEVELS;
use crate::keys::MerkleRoot;

/// Position of the alert in a tree.
const ALERT: u8 = 15;
/// Bytes of an alert message: those that fill 13 blocks (ICD, 3.2.3.2).
const ALERT_BYTES: usize = 39;

/// Source of all secrets.
#[derive(Clone, Debug)]
pub(super) struct Secrets {
    seed: u64,
}

impl Secrets {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// Bytes for a purpose and two numbers of it.
    pub(super) fn bytes(&self, purpose: &str, first: usize, second: usize) -> [u8; 32] {
        let text = format!("gnss-twin OSNMA test key {} {purpose} {first} {second}", self.seed);
        Sha256::digest(text).into()
    }

    /// Signing key by its position in a tree.
    pub(super) fn signer(&self, tree: usize, key: u8) -> SigningKey {
        // One number in 2^32 is none of the curve's.
        let tried = (0..).find_map(|attempt| {
            let bytes = self.bytes("public key", 16 * tree + usize::from(key), attempt);
            SigningKey::from_slice(&bytes).ok()
        });
        tried.unwrap_or_else(|| unreachable!("an endless search"))
    }

    /// Point of a public key in compressed form.
    pub(super) fn point(&self, tree: usize, key: u8) -> Vec<u8> {
        self.signer(tree, key).verifying_key().to_sec1_point(true).as_bytes().to_vec()
    }

    /// Leaf: type and number of a key, and the key (ICD, 6.2).
    pub(super) fn leaf(&self, tree: usize, index: u8) -> Vec<u8> {
        if index == ALERT {
            let text = [self.bytes("alert", tree, 0), self.bytes("alert", tree, 1)].concat();
            return [&[0x40][..], &text[..ALERT_BYTES]].concat();
        }
        [&[0x10 | (index + 1)][..], &self.point(tree, index)].concat()
    }

    /// Nodes of a tree with level and index, the leaves first.
    pub(super) fn nodes(&self, tree: usize) -> Vec<(usize, usize, [u8; 32])> {
        let mut level: Vec<[u8; 32]> = (0..16).map(|index| Sha256::digest(self.leaf(tree, index)).into()).collect();
        let mut all = Vec::new();
        for height in 0..=LEVELS {
            all.extend(level.iter().enumerate().map(|(index, node)| (height, index, *node)));
            level = level.chunks_exact(2).map(|pair| Sha256::digest(pair.concat()).into()).collect();
        }
        all
    }

    pub(super) fn root(&self, tree: usize) -> MerkleRoot {
        MerkleRoot(self.nodes(tree).last().map_or([0; 32], |(_, _, node)| *node))
    }

    /// Nodes beside the path of a leaf, its neighbour first.
    pub(super) fn path(&self, tree: usize, index: u8) -> Vec<u8> {
        let nodes = self.nodes(tree);
        let beside = |height: usize| {
            let at = usize::from(index >> height) ^ 1;
            nodes.iter().find(|(own, place, _)| (*own, *place) == (height, at)).map(|(_, _, node)| *node)
        };
        (0..LEVELS).filter_map(beside).flatten().collect()
    }
}

impl Leaf {
    /// Position in the tree.
    pub(super) fn index(self) -> u8 {
        match self {
            Self::Key { key, .. } => key,
            Self::Alert { .. } => ALERT,
        }
    }
}
