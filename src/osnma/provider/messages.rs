//! Digital signature messages as they are sent, and the key files beside them.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 3.2.2 and 3.2.3. Satellites send the blocks of a message in turn, each
//! begins with another one. Signatures are deterministic (RFC 6979).

use std::fmt::Write;

use p256::ecdsa::signature::Signer;
use p256::ecdsa::{Signature, SigningKey};
use sha2::{Digest, Sha256};

use super::keys::Secrets;
use super::schedule::Leaf;
use crate::bits::hex;
use crate::chain::{Chain, Hash, MacFunction, TeslaKey};
use crate::fields::NmaHeader;
use crate::page::PAGES;
use crate::subframe::BLOCK_BYTES;
use crate::time::{Gst, SUBFRAME_S};

/// Sizes of a key of 128 bits and of a tag of 40 bits (ICD, tables 9 and 10).
const SIZES: u8 = 0x49;
/// Remark in every key file.
const REMARK: &str = "Test keys of a simulated scene of gnss-twin. They authenticate no signal of Galileo.";

/// DSM-KROOT of a chain's root key.
pub(super) fn kroot(header: NmaHeader, chain: &Chain, root: &TeslaKey, signer: &SigningKey, key_id: u8) -> Vec<u8> {
    let Chain { id, hash, mac, table, alpha, .. } = chain;
    let first = root.start.later(1);
    let functions = u8::from(*hash == Hash::Sha3) * 8 + u8::from(*mac == MacFunction::CmacAes);
    // Eight blocks (ICD, table 5).
    let mut message = vec![2 << 4 | key_id, id << 6 | functions, SIZES, *table];
    message.extend(first.week().to_be_bytes());
    message.push((first.tow_s() / 3600) as u8);
    message.extend(alpha);
    message.extend(&root.bytes);
    let signed = [&[header.0], &message[1..]].concat();
    let signature: Signature = signer.sign(&signed);
    message.extend(signature.to_bytes());
    let padding = Sha256::digest([&signed[..], &signature.to_bytes()].concat());
    padded(message, &padding, 8)
}

/// DSM-PKR of a leaf.
pub(super) fn pkr(secrets: &Secrets, leaf: Leaf) -> Vec<u8> {
    let (tree, index) = (leaf.tree(), leaf.index());
    let bytes = secrets.leaf(tree, index);
    // Thirteen blocks (ICD, table 3).
    let message = [&[7 << 4 | index][..], &secrets.path(tree, index), &bytes].concat();
    let padding = Sha256::digest([&secrets.root(tree).0[..], &bytes].concat());
    padded(message, &padding, 13)
}

fn padded(mut message: Vec<u8>, padding: &[u8], blocks: usize) -> Vec<u8> {
    let missing = (blocks * BLOCK_BYTES).saturating_sub(message.len());
    message.extend(padding.iter().take(missing));
    message
}

/// Header and root key section of a satellite's sub-frame.
pub(super) fn section(header: NmaHeader, id: u8, message: &[u8], sender: u8, start: Gst) -> [u8; PAGES] {
    let blocks = (message.len() / BLOCK_BYTES).max(1) as i64;
    let number = (start.seconds().div_euclid(SUBFRAME_S) + i64::from(sender)).rem_euclid(blocks) as usize;
    let mut section = [0; PAGES];
    let block = message.chunks_exact(BLOCK_BYTES).nth(number).unwrap_or_default();
    let bytes = [header.0, id << 4 | number as u8].into_iter().chain(block.iter().copied());
    section.iter_mut().zip(bytes).for_each(|(slot, byte)| *slot = byte);
    section
}

fn public_key(id: u8, point: &[u8]) -> String {
    format!(
        "<PublicKey><i>{}</i><PKID>{id}</PKID><point>{}</point><PKType>ECDSA P-256/SHA-256</PKType></PublicKey>",
        id - 1,
        hex(point)
    )
}

/// File of a public key.
pub(super) fn key_file(id: u8, point: &[u8]) -> String {
    format!("<?xml version=\"1.0\"?>\n<!-- {REMARK} -->\n<keys>\n{}\n</keys>\n", public_key(id, point))
}

/// File of a tree: one public key and all nodes.
pub(super) fn tree_file(id: u8, point: &[u8], nodes: &[(usize, usize, [u8; 32])]) -> String {
    let mut text = format!("<?xml version=\"1.0\"?>\n<!-- {REMARK} -->\n<keys>\n<MerkleTree>\n<N>16</N>\n");
    let _ = writeln!(text, "<HashFunction>SHA-256</HashFunction>\n{}", public_key(id, point));
    for (level, index, node) in nodes {
        let _ = writeln!(text, "<TreeNode><j>{level}</j><i>{index}</i><x_ji>{}</x_ji></TreeNode>", hex(node));
    }
    text + "</MerkleTree>\n</keys>\n"
}
