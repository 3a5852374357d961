//! Public keys, the Merkle tree above them, and what a verifier trusts at its start.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6.1 to 6.3. A root key is signed by ECDSA with P-256 and SHA-256; a
//! public key is a leaf of a tree of 16 with SHA-256, whose root comes from the GSC and not from the signal.

use p256::ecdsa::signature::Verifier as _;
use p256::ecdsa::{Signature, VerifyingKey};
use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::dsm::{Content, Kroot, Pkr};

/// Public key with its number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PublicKey {
    /// Number of the key, PKID.
    pub id: u8,
    key: VerifyingKey,
}

/// Root of a Merkle tree: a hash of SHA-256.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MerkleRoot(pub [u8; 32]);

/// Trust at the start of a verifier.
#[derive(Clone, Debug)]
pub enum Anchor {
    /// Cold start: the root of the Merkle tree. The signal brings the public key.
    Tree(MerkleRoot),
    /// Warm start: a public key. The signal brings the root key of the chain.
    Key(PublicKey),
    /// Hot start: a public key and a root key that an earlier run stored, with its signature.
    Root(PublicKey, Box<Kroot>),
}

/// Reason for which a key or a signature is refused.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum KeyFault {
    /// Bytes that are no point of the curve P-256.
    #[error("not a point of the curve P-256")]
    Point,
    /// A signature that the key did not make.
    #[error("the signature is not that of the public key")]
    Signature,
    /// A path that does not lead to the root of the tree.
    #[error("the path does not lead to the root of the Merkle tree")]
    Path,
    /// Padding that is not the hash of root and leaf.
    #[error("the padding is wrong")]
    Padding,
}

impl PublicKey {
    /// Key of a point of P-256 in compressed form: a sign (2 or 3) and 32 bytes of x (ICD, table 6).
    ///
    /// # Errors
    /// [`KeyFault::Point`].
    pub fn new(id: u8, point: &[u8]) -> Result<Self, KeyFault> {
        if !matches!(point, [2 | 3, x @ ..] if x.len() == 32) {
            return Err(KeyFault::Point);
        }
        let key = VerifyingKey::from_sec1_bytes(point).map_err(|_| KeyFault::Point)?;
        Ok(Self { id, key })
    }

    /// Point in compressed form.
    pub fn point(&self) -> Vec<u8> {
        self.key.to_sec1_point(true).as_bytes().to_vec()
    }

    /// Holds a root key's signature to this key.
    ///
    /// # Errors
    /// [`KeyFault::Signature`].
    pub fn verify(&self, kroot: &Kroot) -> Result<(), KeyFault> {
        let signature = Signature::from_slice(&kroot.signature).map_err(|_| KeyFault::Signature)?;
        self.key.verify(&kroot.signed, &signature).map_err(|_| KeyFault::Signature)
    }
}

impl MerkleRoot {
    /// Root to which a leaf and the nodes beside its path lead, the leaf's neighbour first.
    pub fn of(leaf: &[u8], index: u8, path: &[[u8; 32]]) -> Self {
        let begin: [u8; 32] = Sha256::digest(leaf).into();
        let step = |node: [u8; 32], (level, beside): (usize, &[u8; 32])| {
            let pair = if index >> level & 1 == 0 { [node, *beside] } else { [*beside, node] };
            Sha256::digest(pair.concat()).into()
        };
        Self(path.iter().enumerate().fold(begin, step))
    }

    /// Holds a public key's path and padding to this root; returns the key, or `None` for an alert.
    ///
    /// # Errors
    /// [`KeyFault`].
    pub fn verify(&self, pkr: &Pkr) -> Result<Option<PublicKey>, KeyFault> {
        if Self::of(&pkr.leaf, pkr.leaf_index, &pkr.path) != *self {
            return Err(KeyFault::Path);
        }
        let digest = Sha256::new().chain_update(self.0).chain_update(&pkr.leaf).finalize();
        if digest.get(..pkr.padding.len()) != Some(&pkr.padding[..]) {
            return Err(KeyFault::Padding);
        }
        match &pkr.content {
            Content::Key(id, point) => PublicKey::new(*id, point).map(Some),
            Content::Alert => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bits::unhex;
    use crate::dsm::tests::{PKR, bytes};

    /// Root that the GSC published with the tree of 2023-12-13.
    const ROOT: &str = "0E63F552C8021709043C239032EFFE941BF22C8389032F5F2701E0FBC80148B8";

    #[test]
    fn the_key_of_2023_12_12_leads_to_the_published_root() {
        let root = MerkleRoot(unhex(ROOT).unwrap().try_into().unwrap());
        let pkr = Pkr::parse(&bytes(PKR)).unwrap();
        assert_eq!(root.verify(&pkr).unwrap().unwrap().id, 1);
        let moved = Pkr { leaf_index: 1, ..pkr.clone() };
        assert_eq!(root.verify(&moved), Err(KeyFault::Path));
        let mut padded = pkr.clone();
        padded.padding[0] ^= 1;
        assert_eq!(root.verify(&padded), Err(KeyFault::Padding));
        assert_eq!(MerkleRoot([0; 32]).verify(&pkr), Err(KeyFault::Path));
    }

    #[test]
    fn bytes_that_are_no_point_are_no_key() {
        assert_eq!(PublicKey::new(1, &[]), Err(KeyFault::Point));
        assert_eq!(PublicKey::new(1, &[5; 33]), Err(KeyFault::Point));
        assert_eq!(PublicKey::new(1, &[2; 34]), Err(KeyFault::Point));
        assert_eq!(PublicKey::new(1, &[0xff; 33]), Err(KeyFault::Point));
    }
}
