//! Digital signature messages (DSM): their blocks collected from all satellites, and their fields.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 3.2.3. A DSM-KROOT has the root key of a chain and its signature, a
//! DSM-PKR a public key with its path in the Merkle tree. Blocks of 104 bits come one a sub-frame and
//! satellite, so several satellites fill a message within a few sub-frames. Limits: a block that differs from
//! one held replaces it, and a forged block can hold up a message, never make one.

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::bits::leading;
use crate::chain::{Chain, Hash, MacFunction, TeslaKey};
use crate::fields::{DsmHeader, NmaHeader};
use crate::subframe::BLOCK_BYTES;
use crate::time::Gst;

/// Bytes of a DSM-KROOT before its root key.
const KROOT_HEAD: usize = 13;
/// Bytes of a signature with ECDSA P-256.
const SIGNATURE_BYTES: usize = 64;
/// Bytes of a node of the Merkle tree.
const NODE_BYTES: usize = 32;
/// Levels of the tree.
pub const LEVELS: usize = 4;
/// Bytes of a DSM-PKR before its key: counts, path, and type and number of the key.
const PKR_HEAD: usize = 1 + LEVELS * NODE_BYTES + 1;

/// Reason for which a message is refused before any key is asked.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum DsmError {
    /// A field with a value that has no meaning.
    #[error("{0} has a reserved value")]
    Reserved(&'static str),
    /// A message that is shorter than its fields.
    #[error("the message is shorter than its fields")]
    Short,
    /// Padding that is not the hash of the message.
    #[error("the padding is wrong")]
    Padding,
    /// A function that is not supported, by its name.
    #[error("{0} is not supported")]
    Unsupported(&'static str),
}

/// Root key of a chain with its signature (ICD, 3.2.3.1).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kroot {
    /// NMA header that is signed with it.
    pub header: NmaHeader,
    /// Number of the public key that signed.
    pub key_id: u8,
    /// Parameters of the chain.
    pub chain: Chain,
    /// Root key; its sub-frame is the one before the time that the message states.
    pub root: TeslaKey,
    /// Message that is signed.
    pub signed: Vec<u8>,
    /// Signature, its two numbers one after the other.
    pub signature: [u8; SIGNATURE_BYTES],
}

impl Kroot {
    /// Reads the fields of a whole message, and holds the padding to its hash.
    ///
    /// # Errors
    /// [`DsmError`].
    pub fn parse(header: NmaHeader, bytes: &[u8]) -> Result<Self, DsmError> {
        let head: &[u8; KROOT_HEAD] = bytes.first_chunk().ok_or(DsmError::Short)?;
        let hash = match head[1] >> 2 & 3 {
            0 => Hash::Sha256,
            2 => Hash::Sha3,
            _ => return Err(DsmError::Reserved("the hash function")),
        };
        let mac = match head[1] & 3 {
            0 => MacFunction::HmacSha256,
            1 => MacFunction::CmacAes,
            _ => return Err(DsmError::Reserved("the MAC function")),
        };
        let key_bytes = *[12, 13, 14, 15, 16, 20, 24, 28, 32]
            .get(usize::from(head[2] >> 4))
            .ok_or(DsmError::Reserved("the key size"))?;
        if mac == MacFunction::CmacAes && key_bytes != 16 {
            return Err(DsmError::Unsupported("CMAC-AES with keys that are not of 128 bits"));
        }
        let tag_bits = match head[2] & 15 {
            5 => 20,
            6 => 24,
            7 => 28,
            8 => 32,
            9 => 40,
            _ => return Err(DsmError::Reserved("the tag size")),
        };
        let fixed = KROOT_HEAD + key_bytes;
        let message = bytes.get(1..fixed).ok_or(DsmError::Short)?;
        let blocks = |signature: usize| (fixed + signature).div_ceil(BLOCK_BYTES) * BLOCK_BYTES;
        match bytes.len() {
            length if length == blocks(SIGNATURE_BYTES) => {}
            // A signature of P-521 has 132 bytes.
            length if length == blocks(132) => return Err(DsmError::Unsupported("ECDSA P-521")),
            length if length < blocks(SIGNATURE_BYTES) => return Err(DsmError::Short),
            _ => return Err(DsmError::Reserved("the number of blocks")),
        }
        let (signature, padding) = bytes[fixed..].split_first_chunk().ok_or(DsmError::Short)?;
        let signed = [&[header.0], message].concat();
        let digest = Sha256::new().chain_update(&signed).chain_update(signature).finalize();
        if digest[..padding.len()] != *padding {
            return Err(DsmError::Padding);
        }
        let week = u16::from(head[4] & 15) << 8 | u16::from(head[5]);
        let alpha = [head[7], head[8], head[9], head[10], head[11], head[12]];
        let chain = Chain { id: head[1] >> 6, hash, mac, key_bytes, tag_bits, table: head[3], alpha };
        let start = Gst::new(week, u32::from(head[6]) * 3600).later(-1);
        let root = TeslaKey { start, bytes: bytes[KROOT_HEAD..fixed].to_vec() };
        Ok(Self { header, key_id: head[0] & 15, chain, root, signed, signature: *signature })
    }
}

/// Public key or alert, with its path in the Merkle tree (ICD, 3.2.3.2).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pkr {
    /// Position of the leaf in the tree, from 0 to 15.
    pub leaf_index: u8,
    /// Nodes beside the path, the leaf's neighbour first.
    pub path: [[u8; NODE_BYTES]; LEVELS],
    /// Type and number of the key, and the key: what the leaf is the hash of.
    pub leaf: Vec<u8>,
    /// Content of the leaf.
    pub content: Content,
    /// Padding, which the root of the tree checks.
    pub padding: Vec<u8>,
}

/// Content of a leaf of the Merkle tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Content {
    /// Public key of ECDSA P-256: its number, and its point in compressed form.
    Key(u8, Vec<u8>),
    /// OSNMA alert message: authentication must not be used.
    Alert,
}

impl Pkr {
    /// Reads the fields of a whole message.
    ///
    /// # Errors
    /// [`DsmError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, DsmError> {
        let head: &[u8; PKR_HEAD] = bytes.first_chunk().ok_or(DsmError::Short)?;
        let mut path = [[0; NODE_BYTES]; LEVELS];
        for (node, own) in path.iter_mut().zip(head[1..].chunks_exact(NODE_BYTES)) {
            node.copy_from_slice(own);
        }
        let rest = &bytes[PKR_HEAD..];
        let (kind, number) = (head[PKR_HEAD - 1] >> 4, head[PKR_HEAD - 1] & 15);
        let (content, length) = match kind {
            1 => (Content::Key(number, rest.get(..33).ok_or(DsmError::Short)?.to_vec()), 33),
            3 => return Err(DsmError::Unsupported("ECDSA P-521")),
            4 => (Content::Alert, rest.len()),
            _ => return Err(DsmError::Reserved("the type of the public key")),
        };
        let leaf = bytes[PKR_HEAD - 1..PKR_HEAD + length].to_vec();
        Ok(Self { leaf_index: head[0] & 15, path, leaf, content, padding: rest[length..].to_vec() })
    }
}

/// Blocks of messages that are not whole yet.
#[derive(Clone, Debug, Default)]
pub struct Collector {
    blocks: BTreeMap<(u8, u8), BTreeMap<usize, [u8; BLOCK_BYTES]>>,
}

impl Collector {
    /// Takes a block, and returns the whole message if this block completes or repeats it.
    ///
    /// Blocks of a DSM-KROOT are kept apart by the NMA header, which is signed with them.
    pub fn put(&mut self, nma: NmaHeader, header: DsmHeader, block: [u8; BLOCK_BYTES]) -> Option<Vec<u8>> {
        let key = (header.id(), if header.is_key() { 0 } else { nma.0 });
        let held = self.blocks.entry(key).or_default();
        if held.insert(header.block(), block).is_some_and(|before| before != block) {
            // Another message under the number.
            held.retain(|&position, _| position == header.block());
        }
        let count = usize::try_from(leading(held.get(&0)?, 4)).ok()?;
        let count = match (header.is_key(), count) {
            // ICD, tables 5 and 9: 7 to 14 blocks, and 13 to 16.
            (false, 1..=8) | (true, 7..=10) => count + 6,
            _ => return None,
        };
        let blocks: Option<Vec<_>> = (0..count).map(|position| held.get(&position).copied()).collect();
        Some(blocks?.concat())
    }

    /// Forgets a message that was refused, so that its next blocks make it again.
    pub fn forget(&mut self, nma: NmaHeader, header: DsmHeader) {
        self.blocks.remove(&(header.id(), if header.is_key() { 0 } else { nma.0 }));
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::bits::unhex;

    /// DSM-KROOT that satellites sent on 2022-03-07 with the NMA header 0x52.
    pub(crate) const KROOT: &str = "2250492104982125d3964da3a2841e1de4d458c0e9842476e004666cf3\
        7958de28519 7a26353f1a4c66d7e3d291853ba5a13c9c3484a267770112a13383ea52d3a019d5b6e1dd187b9453cdf06ca7f34ea\
        1497525aaf18f1f9f1fcCB12298977 35c021b0417393b5";
    /// DSM-PKR that satellites sent on 2023-12-12.
    pub(crate) const PKR: &str = "7001631bdced79d4317bc2870ee3895bd59cf2b6ea516fabbfdf1d739626146ffe\
        316fa9285f5a1e44042413bdaf18aa3cf684723397d7b8325aeca1ebca9f0f64\
        9905424cbe482a1a32b01064f85d0c36df038e52ce128e7ec5f323e165b182a7\
        1537bdb010972eb4a3b90baacd14941ef40da2cb2b82d378b315c008decefd8e\
        110374a925cfa0ff1805e5c5a58fdba31bf0145d5b5be2f062d3f8bb2ee98f0f6db0e823c5e75e78";

    pub(crate) fn bytes(text: &str) -> Vec<u8> {
        unhex(&text.replace([' ', '\n'], "")).unwrap()
    }

    #[test]
    fn a_root_key_that_was_sent_is_read_with_its_padding_checked() {
        let message = bytes(KROOT);
        assert_eq!(message.len(), 8 * BLOCK_BYTES);
        let kroot = Kroot::parse(NmaHeader(0x52), &message).unwrap();
        assert_eq!((kroot.key_id, kroot.chain.id, kroot.chain.table), (2, 1, 0x21));
        assert_eq!((kroot.chain.hash, kroot.chain.mac), (Hash::Sha256, MacFunction::HmacSha256));
        assert_eq!((kroot.chain.key_bytes, kroot.chain.tag_bits), (16, 40));
        assert_eq!(kroot.root.start, Gst::new(0x498, 0x21 * 3600 - 30));
        assert_eq!(kroot.chain.alpha, [0x25, 0xd3, 0x96, 0x4d, 0xa3, 0xa2]);
        assert_eq!(Kroot::parse(NmaHeader(0x54), &message), Err(DsmError::Padding));
        for length in 0..message.len() {
            assert!(Kroot::parse(NmaHeader(0x52), &message[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn a_public_key_that_was_sent_is_read() {
        let message = bytes(PKR);
        let pkr = Pkr::parse(&message).unwrap();
        assert_eq!((pkr.leaf_index, pkr.padding.len(), pkr.leaf.len()), (0, 6, 34));
        assert!(matches!(&pkr.content, Content::Key(1, point) if point[..2] == [3, 0x74]));
        for length in 0..PKR_HEAD + 33 {
            assert_eq!(Pkr::parse(&message[..length]), Err(DsmError::Short), "{length}");
        }
    }

    #[test]
    fn blocks_in_any_order_make_the_message_and_another_message_begins_again() {
        let message = bytes(KROOT);
        let mut collector = Collector::default();
        let nma = NmaHeader(0x52);
        let blocks: Vec<[u8; 13]> = message.chunks_exact(13).map(|block| block.try_into().unwrap()).collect();
        for position in [5, 1, 7, 0, 2, 3, 6] {
            assert_eq!(collector.put(nma, DsmHeader(0x20 | position), blocks[usize::from(position)]), None);
        }
        // A block under another NMA header is not one of these.
        assert_eq!(collector.put(NmaHeader(0x54), DsmHeader(0x24), blocks[4]), None);
        assert_eq!(collector.put(nma, DsmHeader(0x24), blocks[4]), Some(message.clone()));
        assert_eq!(collector.put(nma, DsmHeader(0x24), [0; 13]), None);
        assert_eq!(collector.put(nma, DsmHeader(0x20), blocks[0]), None);
    }
}
