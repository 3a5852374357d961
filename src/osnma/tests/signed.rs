//! Synthetic recording: satellites that sign, with test keys made of a number.

use std::collections::BTreeMap;

use p256::ecdsa::signature::Signer;
use p256::ecdsa::{Signature, SigningKey};
use sha2::{Digest, Sha256};

use gnss::crc::crc24q;
use osnma::bits::Row;
use osnma::chain::{Chain, Hash, MacFunction, TeslaKey};
use osnma::data::Words;
use osnma::fields::{Adkd, NmaHeader};
use osnma::keys::{MerkleRoot, PublicKey};
use osnma::mac::{Tagged, mac, macseq};
use osnma::page::Page;
use osnma::tables::{Slot, slots};
use osnma::time::Gst;

/// Hour in which the recording begins.
pub const BEGIN: Gst = Gst::of_seconds(1300 * 604_800 + 36_000);

/// Satellites that sign.
pub const SENDERS: [u8; 4] = [2, 5, 11, 36];

/// Test key of a number.
pub fn secret(id: u8) -> SigningKey {
    SigningKey::from_slice(&[id + 1; 32]).unwrap()
}

pub fn point(id: u8) -> Vec<u8> {
    secret(id).verifying_key().to_sec1_point(true).as_bytes().to_vec()
}

pub fn public(id: u8) -> PublicKey {
    PublicKey::new(id, &point(id)).unwrap()
}

/// Leaves of the tree: keys 1 to 15, and an alert.
fn leaf(index: u8) -> Vec<u8> {
    match index {
        15 => [&[0x40][..], &[0x5a; 39]].concat(),
        _ => [&[0x10 | (index + 1)][..], &point(index + 1)].concat(),
    }
}

fn node(level: u32, index: u8) -> [u8; 32] {
    if level == 0 {
        return Sha256::digest(leaf(index)).into();
    }
    Sha256::digest([node(level - 1, 2 * index), node(level - 1, 2 * index + 1)].concat()).into()
}

pub fn root() -> MerkleRoot {
    MerkleRoot(node(4, 0))
}

/// DSM-PKR of a leaf.
pub fn pkr(index: u8) -> Vec<u8> {
    let path: Vec<u8> = (0..4).flat_map(|level| node(level, (index >> level) ^ 1)).collect();
    let mut message = [&[0x70 | index][..], &path, &leaf(index)].concat();
    let padding = Sha256::digest([&root().0[..], &leaf(index)].concat());
    message.extend(&padding[..13 * 13 - message.len()]);
    message
}

/// Chain with the key of its last sub-frame, twelve hours after the beginning.
#[derive(Clone)]
pub struct Signed {
    pub chain: Chain,
    last: TeslaKey,
}

impl Signed {
    pub fn new(id: u8, hash: Hash, mac: MacFunction) -> Self {
        let alpha = [id, 1, 2, 3, 4, 5];
        let chain = Chain { id, hash, mac, key_bytes: 16, tag_bits: 40, table: 34, alpha };
        Self { chain, last: TeslaKey { start: BEGIN.later(1440), bytes: vec![0xc0 | id; 16] } }
    }

    pub fn key(&self, start: Gst) -> TeslaKey {
        self.chain.at(&self.last, start).unwrap()
    }

    /// DSM-KROOT for the root before an hour, signed by a test key.
    pub fn kroot(&self, header: NmaHeader, key_id: u8, hours: i64) -> Vec<u8> {
        let Chain { id, hash, mac, table, alpha, .. } = &self.chain;
        let hour = BEGIN.later(120 * hours);
        let functions = u8::from(*hash == Hash::Sha3) * 8 + u8::from(*mac == MacFunction::CmacAes);
        let mut message = vec![0x20 | key_id, id << 6 | functions, 0x49, *table];
        message.extend(hour.week().to_be_bytes());
        message.push((hour.tow_s() / 3600) as u8);
        message.extend(alpha);
        message.extend(self.key(hour.later(-1)).bytes);
        let signed = [&[header.0], &message[1..]].concat();
        let signature: Signature = secret(key_id).sign(&signed);
        message.extend(signature.to_bytes());
        let padding = Sha256::digest([&signed[..], &signature.to_bytes()].concat());
        message.extend(&padding[..8 * 13 - message.len()]);
        message
    }

    /// Pages of a satellite's sub-frame; `number` counts sub-frames and picks the block of the message.
    pub fn subframe(&self, sender: u8, start: Gst, header: NmaHeader, id: u8, message: &[u8]) -> Vec<Page> {
        let number = start.since_s(BEGIN) / 30 + i64::from(sender);
        let block = (number as usize) % (message.len() / 13);
        let mut hkroot = vec![header.0, id << 4 | block as u8];
        hkroot.extend(&message[13 * block..13 * (block + 1)]);
        let mack = self.mack(sender, start, header);
        let words = words(sender);
        let kinds = [2, 4, 6, 10, 1, 3, 5];
        (0..15)
            .map(|at| {
                let begin = Gst::of_seconds(start.seconds() + 2 * at as i64 + 1);
                let word = kinds.get(at).map_or(63 << 122, |kind| dated(words[kind], begin));
                let section = mack.bytes()[4 * at..4 * at + 4].iter().fold(0, |all, &byte| all << 8 | u32::from(byte));
                page(sender, begin, word, hkroot[at], section)
            })
            .collect()
    }

    fn mack(&self, sender: u8, start: Gst, header: NmaHeader) -> Row {
        let slots = slots(self.chain.table, start.half()).unwrap();
        let other = SENDERS[(SENDERS.iter().position(|&own| own == sender).unwrap() + 1) % SENDERS.len()];
        let fast = self.key(start.later(1));
        let mut held = Words::default();
        SENDERS.iter().for_each(|&own| held.put(own, start.later(-1), &words(own)));
        let tag = |position: u8, of: u8, adkd: Adkd| {
            let key = self.key(start.later(adkd.key_after()));
            let tagged = Tagged { of, sender, start, position, status: header.status_bits() };
            let message = tagged.message(&held.covered(of, adkd, start, 1).unwrap());
            u128::from(mac(self.chain.mac, &key.bytes, &message, 40).unwrap())
        };
        let kinds: Vec<(u8, Adkd)> = slots
            .iter()
            .map(|slot| match *slot {
                Slot::Fixed(kind, is_own) => (if is_own { sender } else { other }, kind),
                Slot::Flexible => (other, Adkd::Ephemeris),
            })
            .collect();
        let info = |(of, adkd): (u8, Adkd)| u16::from(of) << 8 | u16::from(adkd.number()) << 4 | 1;
        let flexible: Vec<u16> = slots
            .iter()
            .zip(&kinds)
            .filter(|(slot, _)| **slot == Slot::Flexible)
            .map(|(_, kind)| info(*kind))
            .collect();
        let sequence = macseq(self.chain.mac, &fast.bytes, sender, start, &flexible).unwrap();
        let mut row = Row::default();
        row.push(tag(1, sender, Adkd::Ephemeris), 40);
        row.push(u128::from(sequence << 4 | 1), 16);
        for (position, &(of, adkd)) in (2..).zip(&kinds) {
            row.push(tag(position, of, adkd), 40);
            row.push(info((of, adkd)).into(), 16);
        }
        row.push_bytes(&self.key(start).bytes);
        row.push_zeros(480 - row.len());
        row
    }
}

/// Words of a satellite, by type; all of one issue.
pub fn words(sender: u8) -> BTreeMap<u8, u128> {
    let word = |kind: u8| match kind {
        // The satellite's number is at the place that it has in word 4 (OS SIS ICD 2.1, 4.3.5).
        4 => 4 << 122 | 77 << 112 | u128::from(sender) << 106 | 0x1_0000_0000,
        _ => u128::from(kind) << 122 | 77 << 112 | u128::from(sender) << 60 | 0x1_0000_0000 | 0x55,
    };
    (1..=10).map(|kind| (kind, word(kind))).collect()
}

/// Word with the time at which its page begins, where it has one: in words 5 and 6, in bits that no tag
/// covers.
fn dated(word: u128, begin: Gst) -> u128 {
    let put = |word: u128, first: u32, count: u32, value: u32| {
        let shift = 128 - first - count;
        word & !(((1 << count) - 1) << shift) | u128::from(value) << shift
    };
    match word >> 122 {
        5 => put(put(word, 73, 12, begin.week().into()), 85, 20, begin.tow_s()),
        6 => put(word, 105, 20, begin.tow_s()),
        _ => word,
    }
}

/// Even and odd part of a page, each of 120 bits.
pub fn parts(word: u128, hkroot: u8, mack: u32) -> (u128, u128) {
    let even = (word >> 16) << 6;
    let odd = 1 << 119 | (word & 0xffff) << 102 | u128::from(hkroot) << 94 | u128::from(mack) << 62;
    let bits = |value: u128, count: u32| (0..count).map(move |at| value >> (119 - at) & 1 == 1);
    let check = crc24q(bits(even, 114).chain(bits(odd, 82)));
    (even, odd | u128::from(check) << 14)
}

/// Page with its check.
pub fn page(sender: u8, start: Gst, word: u128, hkroot: u8, mack: u32) -> Page {
    let (even, odd) = parts(word, hkroot, mack);
    Page::new(sender, start, even, odd)
}

/// Pages of all satellites in sub-frames `from` to `to`, in the order of time. The public key and the root
/// key take turns of ten sub-frames.
pub fn sky(signed: &Signed, header: NmaHeader, from: i64, to: i64) -> Vec<Page> {
    let (key, kroot) = (pkr(0), signed.kroot(header, 1, 0));
    let subframe = |number: i64, sender: u8| match number / 10 % 2 {
        0 => signed.subframe(sender, BEGIN.later(number), header, 12, &key),
        _ => signed.subframe(sender, BEGIN.later(number), header, 3, &kroot),
    };
    merged((from..to).flat_map(|number| SENDERS.map(|sender| subframe(number, sender))))
}

/// Pages in the order of time.
pub fn merged(subframes: impl Iterator<Item = Vec<Page>>) -> Vec<Page> {
    let mut pages: Vec<Page> = subframes.flatten().collect();
    pages.sort_by_key(|page| page.start);
    pages
}
