//! Chain of TESLA keys: the one-way function, and the check of a key against one that is trusted.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6.4. Each sub-frame has a key; the hash of a key with the time of the
//! sub-frame before and the chain's own number alpha, cut to the key's length, is the key before. So any
//! later key proves all keys before it, also across a gap. Limits: a key more than ten weeks after the
//! trusted one is refused, so that a wrong key costs a bounded time.

use sha2::{Digest, Sha256};
use sha3::Sha3_256;
use thiserror::Error;

use crate::time::{Gst, SUBFRAME_S};

/// Most steps from a key back to the trusted one: ten weeks.
const MOST_STEPS: i64 = 10 * 7 * 86_400 / SUBFRAME_S;

/// Hash of the one-way function (ICD, table 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hash {
    /// SHA-256.
    Sha256,
    /// SHA3-256.
    Sha3,
}

/// Function of the tags (ICD, table 8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MacFunction {
    /// HMAC with SHA-256.
    HmacSha256,
    /// CMAC with AES-128.
    CmacAes,
}

/// Parameters of a chain, as its root states them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chain {
    /// Number of the chain, from 0 to 3.
    pub id: u8,
    /// Hash of the one-way function.
    pub hash: Hash,
    /// Function of the tags.
    pub mac: MacFunction,
    /// Length of a key, in bytes.
    pub key_bytes: usize,
    /// Length of a tag, in bits.
    pub tag_bits: usize,
    /// Number of the MAC look-up table.
    pub table: u8,
    /// Number that makes the chain's hashes its own.
    pub alpha: [u8; 6],
}

/// Key of a sub-frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TeslaKey {
    /// Beginning of the sub-frame that sends the key.
    pub start: Gst,
    /// Bits of the key.
    pub bytes: Vec<u8>,
}

/// Reason for which a key is not trusted.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum KeyError {
    /// A key that does not lead to the trusted one.
    #[error("the key does not belong to the chain")]
    Foreign,
    /// A key before the root of the chain.
    #[error("the key is before the root of the chain")]
    BeforeRoot,
    /// A key too long after the trusted one.
    #[error("the key is more than ten weeks after the last trusted one")]
    TooFar,
}

impl Chain {
    /// Key of the sub-frame before.
    pub fn before(&self, key: &TeslaKey) -> TeslaKey {
        let start = key.start.later(-1);
        let input = [&key.bytes[..], &start.bytes(), &self.alpha].concat();
        let mut bytes = match self.hash {
            Hash::Sha256 => Sha256::digest(input).to_vec(),
            Hash::Sha3 => Sha3_256::digest(input).to_vec(),
        };
        bytes.truncate(self.key_bytes);
        TeslaKey { start, bytes }
    }

    /// Key of an earlier sub-frame, or the key itself.
    ///
    /// # Errors
    /// [`KeyError`] if the sub-frame is not before the key's, or too far before.
    pub fn at(&self, key: &TeslaKey, start: Gst) -> Result<TeslaKey, KeyError> {
        let steps = key.start.since_s(start) / SUBFRAME_S;
        let steps = planted!("osnma.chain.step", steps, steps - i64::from(steps > 0));
        match steps {
            ..0 => Err(KeyError::BeforeRoot),
            _ if steps > MOST_STEPS => Err(KeyError::TooFar),
            _ => Ok((0..steps).fold(key.clone(), |key, _| self.before(&key))),
        }
    }
}

/// Chain with its root and the newest key that is proved.
#[derive(Clone, Debug)]
pub struct Trust {
    /// Parameters of the chain.
    pub chain: Chain,
    /// Number of the public key that signed the root.
    pub signed_by: u8,
    root: TeslaKey,
    newest: TeslaKey,
}

impl Trust {
    /// Trust in a root.
    pub fn new(chain: Chain, signed_by: u8, root: TeslaKey) -> Self {
        Self { chain, signed_by, newest: root.clone(), root }
    }

    /// Newest proved key.
    pub fn newest(&self) -> &TeslaKey {
        &self.newest
    }

    /// Root of the chain.
    pub fn root(&self) -> &TeslaKey {
        &self.root
    }

    /// Holds a key to the chain, and keeps it if it is newer than the newest one.
    ///
    /// # Errors
    /// [`KeyError`].
    pub fn accept(&mut self, key: &TeslaKey) -> Result<(), KeyError> {
        if key.bytes.len() != self.chain.key_bytes {
            return Err(KeyError::Foreign);
        }
        if key.start <= self.newest.start {
            let proved = self.key_at(key.start)?;
            return if proved == *key { Ok(()) } else { Err(KeyError::Foreign) };
        }
        if self.chain.at(key, self.newest.start)? != self.newest {
            return Err(KeyError::Foreign);
        }
        self.newest = key.clone();
        Ok(())
    }

    /// Proved key of a sub-frame up to the newest.
    ///
    /// # Errors
    /// [`KeyError`] for a sub-frame before the root or after the newest key.
    pub fn key_at(&self, start: Gst) -> Result<TeslaKey, KeyError> {
        if start < self.root.start {
            return Err(KeyError::BeforeRoot);
        }
        self.chain.at(&self.newest, start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bits::unhex;

    fn chain(hash: Hash) -> Chain {
        let alpha = [1, 2, 3, 4, 5, 6];
        Chain { id: 1, hash, mac: MacFunction::HmacSha256, key_bytes: 16, tag_bits: 40, table: 34, alpha }
    }

    fn key(tow_s: u32) -> TeslaKey {
        TeslaKey { start: Gst::new(1251, tow_s), bytes: vec![0x5a; 16] }
    }

    #[test]
    fn a_key_across_a_gap_proves_all_before_it() {
        for hash in [Hash::Sha256, Hash::Sha3] {
            let (chain, last) = (chain(hash), key(36_000));
            let root = chain.at(&last, Gst::new(1251, 0)).unwrap();
            let mut trust = Trust::new(chain.clone(), 1, root);
            let early = chain.at(&last, Gst::new(1251, 60)).unwrap();
            for key in [&early, &early, &last, &early] {
                assert_eq!(trust.accept(key), Ok(()));
            }
            assert_eq!(trust.key_at(Gst::new(1251, 60)), Ok(early));
        }
    }

    #[test]
    fn a_key_of_another_chain_time_or_length_is_refused_by_name() {
        let (own, last) = (chain(Hash::Sha256), key(3000));
        let root = own.at(&last, Gst::new(1251, 30)).unwrap();
        let mut trust = Trust::new(own.clone(), 1, root.clone());
        let mut wrong = last.clone();
        wrong.bytes[3] ^= 1;
        assert_eq!(trust.accept(&wrong), Err(KeyError::Foreign));
        assert_eq!(trust.accept(&TeslaKey { start: last.start.later(1), ..last.clone() }), Err(KeyError::Foreign));
        assert_eq!(trust.accept(&TeslaKey { bytes: vec![0x5a; 15], ..last.clone() }), Err(KeyError::Foreign));
        assert_eq!(trust.accept(&TeslaKey { start: Gst::new(1251, 0), ..last.clone() }), Err(KeyError::BeforeRoot));
        assert_eq!(trust.accept(&TeslaKey { start: Gst::new(1262, 0), ..last.clone() }), Err(KeyError::TooFar));
        assert_eq!(trust.newest(), &root);
        assert_eq!(trust.accept(&last), Ok(()));
        let other = Chain { alpha: [0; 6], ..own };
        assert_ne!(other.at(&last, root.start).unwrap(), root);
    }

    #[test]
    fn the_one_way_function_is_that_of_the_standard_hash() {
        // FIPS 180-4 hash of the 26 bytes, computed by Python's hashlib.
        let before = chain(Hash::Sha256).before(&key(277_230));
        assert_eq!(before.bytes, unhex(SHA_256).unwrap());
        let before = chain(Hash::Sha3).before(&key(277_230));
        assert_eq!(before.bytes, unhex(SHA3_256).unwrap());
    }

    const SHA_256: &str = "1c1ed2e972e387a9cbbf4c3e464dc7f7";
    const SHA3_256: &str = "f670465790f95c90517b0254ee775426";
}
