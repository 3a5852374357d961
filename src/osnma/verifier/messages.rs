//! Digital signature messages within a verifier: public keys, roots of chains, revocations and alerts.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 5 and 6.2. Limits: a root key that is older than the one of its chain,
//! or of a revoked chain, changes nothing, so that a replayed message cannot bring an old chain back.

use super::Verifier;
use crate::chain::Trust;
use crate::dsm::{Kroot, Pkr};
use crate::fields::{NmaHeader, NmaStatus, Notice};
use crate::subframe::Subframe;

impl Verifier {
    /// Takes the block of a sub-frame, and the message if it is whole.
    pub(super) fn messages(&mut self, subframe: &Subframe) {
        let Some(nma) = subframe.nma_header() else { return };
        let Some((header, block)) = subframe.dsm_block() else { return };
        let Some(message) = self.collector.put(nma, header, block) else { return };
        let seen = (if header.is_key() { 0 } else { nma.0 }, message);
        if self.handled.contains(&seen) {
            return;
        }
        let settled = if header.is_key() { self.public_key(&seen.1) } else { self.root_key(nma, &seen.1, subframe) };
        if settled {
            self.handled.insert(seen);
        } else {
            self.collector.forget(nma, header);
        }
    }

    /// Handles a DSM-PKR; returns false if the same message may be worth another look.
    fn public_key(&mut self, message: &[u8]) -> bool {
        let Ok(pkr) = Pkr::parse(message) else {
            self.counts.dsm_unreadable += 1;
            return false;
        };
        let Some(tree) = self.tree else {
            self.counts.pkr_without_tree += 1;
            return true;
        };
        match tree.verify(&pkr) {
            Err(_) => {
                self.counts.pkr_refused += 1;
                return false;
            }
            Ok(None) => self.alert = true,
            Ok(Some(key)) if key.id >= self.least_key => {
                self.keys.insert(key.id, key);
            }
            Ok(Some(_)) => {}
        }
        self.counts.pkr_verified += 1;
        true
    }

    /// Handles a DSM-KROOT; returns false if the same message may be worth another look.
    fn root_key(&mut self, nma: NmaHeader, message: &[u8], subframe: &Subframe) -> bool {
        let Ok(kroot) = Kroot::parse(nma, message) else {
            self.counts.dsm_unreadable += 1;
            return false;
        };
        let Some(key) = self.keys.get(&kroot.key_id) else {
            self.counts.kroot_without_key += 1;
            return false;
        };
        if key.verify(&kroot).is_err() {
            self.counts.kroot_refused += 1;
            return false;
        }
        self.counts.kroot_verified += 1;
        self.first_root.get_or_insert(subframe.start.later(1));
        self.kroot = Some((nma, message.to_vec()));
        self.trust(kroot);
        true
    }

    /// Acts on a root key whose signature is right.
    pub(super) fn trust(&mut self, kroot: Kroot) {
        self.status = Some(kroot.header.status());
        let in_force = kroot.header.chain();
        match kroot.header.notice() {
            // First the chain in force is the revoked one and must not be used, then its successor is.
            Notice::ChainRevoked => {
                let must_stop = kroot.header.status() == NmaStatus::DoNotUse;
                self.revoke(|trust| {
                    let is_in_force = trust.chain.id == in_force;
                    if must_stop { is_in_force } else { !is_in_force && trust.chain.id != kroot.chain.id }
                });
            }
            Notice::PublicKeyRevoked => {
                self.least_key = self.least_key.max(kroot.key_id);
                let least = self.least_key;
                self.keys.retain(|&id, _| id >= least);
                self.revoke(|trust| trust.signed_by < least);
            }
            _ => {}
        }
        if self.revoked.contains(&kroot.chain.alpha) {
            return;
        }
        match self.chains.get_mut(&kroot.chain.id) {
            Some(trust) if trust.chain == kroot.chain => {
                // A newer root of the same chain is one of its keys.
                if kroot.root.start > trust.newest().start && trust.accept(&kroot.root).is_err() {
                    self.counts.keys_refused += 1;
                }
            }
            Some(trust) if kroot.root.start <= trust.root().start => {}
            _ => {
                self.chains.insert(kroot.chain.id, Trust::new(kroot.chain, kroot.key_id, kroot.root));
            }
        }
    }

    fn revoke(&mut self, is_revoked: impl Fn(&Trust) -> bool) {
        let gone = self.chains.values().filter(|trust| is_revoked(trust)).map(|trust| trust.chain.alpha);
        self.revoked.extend(gone);
        let revoked = &self.revoked;
        self.chains.retain(|_, trust| !revoked.contains(&trust.chain.alpha));
    }
}
