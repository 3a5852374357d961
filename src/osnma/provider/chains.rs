//! Chains of TESLA keys, made from their last key backwards.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6.4. Every 64th key is kept once a chain is used, so that any key
//! takes 64 hashes at most: 23 kB for 32 days.

use std::sync::OnceLock;

use super::keys::Secrets;
use super::{HOUR_S, KEY_BYTES, Settings, TAG_BITS};
use crate::chain::{Chain, TeslaKey};
use crate::time::{Gst, SUBFRAME_S};

/// Sub-frames between keys that are kept.
const KEPT: i64 = 64;
/// Sub-frames of a chain, a multiple of [`KEPT`]: 32 days.
const LENGTH: i64 = 32 * 24 * HOUR_S / SUBFRAME_S;

/// Chain with its secret.
#[derive(Debug)]
pub(super) struct KeyChain {
    pub(super) chain: Chain,
    begin: Gst,
    last: TeslaKey,
    /// Keys of every 64th sub-frame, the last one first.
    kept: OnceLock<Vec<TeslaKey>>,
}

impl KeyChain {
    /// Chain by its number, counted from 0, whose keys reach from an hour before `begin` on.
    pub(super) fn new(secrets: &Secrets, settings: &Settings, number: usize, begin: Gst) -> Self {
        let begin = Gst::of_seconds(begin.seconds() - HOUR_S);
        let secret = secrets.bytes("chain", number, 0);
        let [key, rest] = [&secret[..KEY_BYTES], &secret[KEY_BYTES..]];
        let chain = Chain {
            id: (number as u8 + 1) % 4,
            hash: settings.hash,
            mac: settings.mac,
            key_bytes: KEY_BYTES,
            tag_bits: TAG_BITS,
            table: settings.table,
            alpha: rest.first_chunk().copied().unwrap_or_default(),
        };
        let last = TeslaKey { start: begin.later(LENGTH), bytes: key.to_vec() };
        Self { chain, begin, last, kept: OnceLock::new() }
    }

    /// Key of a sub-frame; `None` before the chain and after its end.
    pub(super) fn key(&self, start: Gst) -> Option<TeslaKey> {
        if start < self.begin || start > self.last.start {
            return None;
        }
        let back = self.last.start.since_s(start) / SUBFRAME_S;
        let kept = self.kept.get_or_init(|| self.keep()).get((back / KEPT) as usize)?;
        self.chain.at(kept, start).ok()
    }

    fn keep(&self) -> Vec<TeslaKey> {
        let mut kept = Vec::with_capacity((LENGTH / KEPT) as usize + 1);
        let mut key = self.last.clone();
        for back in 0..=LENGTH {
            if back % KEPT == 0 {
                kept.push(key.clone());
            }
            key = self.chain.before(&key);
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_key_leads_to_any_earlier_one_of_its_chain_alone() {
        let settings = Settings::new(3, Gst::new(1300, 40_000));
        let chain = |number| KeyChain::new(&Secrets::new(3), &settings, number, Gst::new(1300, 36_000));
        let (own, other) = (chain(0), chain(1));
        let key = |chain: &KeyChain, after: i64| chain.key(Gst::new(1300, 36_000).later(after)).unwrap();
        let late = key(&own, 700);
        for after in [-120, 0, 63, 64, 65, 699, 700] {
            assert_eq!(own.chain.at(&late, key(&own, after).start), Ok(key(&own, after)));
        }
        assert_ne!(key(&other, 5), key(&own, 5));
        assert_eq!((own.key(Gst::new(1300, 32_370)), own.key(own.last.start.later(1))), (None, None));
        assert_eq!(own.key(own.last.start), Some(own.last.clone()));
    }
}
