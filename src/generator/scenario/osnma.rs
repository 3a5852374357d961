//! Table `[osnma]` as written, and the provider of authentication that it becomes.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::read::Table;
use super::{Overrides, Scenario, ScenarioError, satellite_list};
use crate::authentication::{Osnma, gst};
use crate::catalogue::Catalogue;
use crate::random::Stream;
use gnss::facts::{OsnmaFacts, SpoofedBits, SpoofedMessages};
use gnss::galileo::inav::INAV;
use gnss::message::{Authentication, Common};
use gnss::satellite::System;
use gnss::time::GST;
use osnma::chain::{Hash, MacFunction};
use osnma::page::satellite;
use osnma::provider::{Change, Provider, Published, Settings, Transition};
use osnma::time::SUBFRAME_S;

/// Hashes of a chain with their names.
const HASHES: [(&str, Hash); 2] = [("sha256", Hash::Sha256), ("sha3_256", Hash::Sha3)];
/// Functions of tags with their names.
const MACS: [(&str, MacFunction); 2] = [("hmac_sha256", MacFunction::HmacSha256), ("cmac_aes", MacFunction::CmacAes)];
/// States of the service with their names: true where it is operational.
const STATES: [(&str, bool); 2] = [("operational", true), ("test", false)];
/// Authentication of a spoofer's messages with its names.
const SPOOFED: [(&str, Spoofed); 3] =
    [("true", Spoofed::True), ("none", Spoofed::None), ("own_keys", Spoofed::OwnKeys)];

/// Authentication in a spoofer's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spoofed {
    /// Bits of the true satellites.
    #[default]
    True,
    /// Zeros.
    None,
    /// Bits that the spoofer signs by keys of its own.
    OwnKeys,
}

/// `[osnma]`.
#[derive(Clone, Debug, PartialEq)]
pub struct OsnmaSpec {
    /// Hash of the chain.
    pub hash: Hash,
    /// Function of the tags.
    pub mac: MacFunction,
    /// Number of the MAC look-up table.
    pub table: u8,
    /// True for the status "operational", false for "test".
    pub is_operational: bool,
    /// Numbers of satellites that send zeros.
    pub without: BTreeSet<u8>,
    /// Seconds from one turn of the public key to the next, and of each turn.
    pub key_turn_s: [f64; 2],
    /// Seconds of each step of a transition.
    pub step_s: f64,
    /// Transitions with the time of their first step, in seconds since the scene's start.
    pub transitions: Vec<(Change, f64)>,
}

/// Number of a spoofer, and the authentication in its messages; `None` for zeros.
pub(super) type OfSpoofer = (usize, Option<Arc<dyn Authentication>>);

pub(crate) fn hashes() -> Vec<&'static str> {
    HASHES.map(|(name, _)| name).to_vec()
}

pub(crate) fn macs() -> Vec<&'static str> {
    MACS.map(|(name, _)| name).to_vec()
}

pub(crate) fn states() -> Vec<&'static str> {
    STATES.map(|(name, _)| name).to_vec()
}

pub(crate) fn changes() -> Vec<&'static str> {
    Change::NAMES.map(|(name, _)| name).to_vec()
}

pub(crate) fn spoofed_names() -> Vec<&'static str> {
    SPOOFED.map(|(name, _)| name).to_vec()
}

/// Seconds of whole sub-frames.
fn whole(table: &Table<'_>, key: &str) -> Result<f64, ScenarioError> {
    let value = table.need(key)?;
    let is_whole = value % SUBFRAME_S as f64 == 0.0;
    if is_whole { Ok(value) } else { Err(table.bad(key, format!("a multiple of {SUBFRAME_S} s, a sub-frame"))) }
}

pub(super) fn osnma(table: &Table<'_>) -> Result<OsnmaSpec, ScenarioError> {
    let without = satellite_list(table, "without")?.unwrap_or_default();
    if without.iter().any(|sv| sv.system != System::Galileo) {
        return Err(table.bad("without", "satellites of Galileo like [\"E05\"]"));
    }
    let key_turn_s = [whole(table, "public_key_every_s")?, whole(table, "public_key_for_s")?];
    if key_turn_s[1] > key_turn_s[0] {
        return Err(table.bad("public_key_for_s", format!("at most {} s (public_key_every_s)", key_turn_s[0])));
    }
    let transition = |table: &Table<'_>| Ok((table.need_choice("kind", &Change::NAMES)?, table.need("time_s")?));
    let transitions = table.tables("transition")?.unwrap_or_default();
    Ok(OsnmaSpec {
        hash: table.choice("chain_hash", &HASHES)?.unwrap_or(Hash::Sha256),
        mac: table.choice("mac_function", &MACS)?.unwrap_or(MacFunction::HmacSha256),
        table: table.need_integer("maclt")? as u8,
        is_operational: table.choice("status", &STATES)?.unwrap_or(true),
        without: without.iter().map(|sv| sv.number).collect(),
        key_turn_s,
        step_s: whole(table, "step_s")?,
        transitions: transitions.iter().map(transition).collect::<Result<_, ScenarioError>>()?,
    })
}

pub(super) fn spoofed(table: &Table<'_>) -> Result<Spoofed, ScenarioError> {
    Ok(table.choice("osnma", &SPOOFED)?.unwrap_or_default())
}

impl Scenario {
    /// Keys by which a receiver of the scene may verify it, those of its start; `None` without `[osnma]`.
    ///
    /// # Errors
    /// Settings of `[osnma]` that contradict each other.
    pub fn osnma_anchor(&self, overrides: &Overrides) -> Result<Option<Published>, ScenarioError> {
        let Some(spec) = &self.osnma else { return Ok(None) };
        let provider = self.provider(spec, overrides.seed.unwrap_or(self.seed))?;
        Ok(provider.anchor(gst(GST.label(self.start))))
    }

    /// Authentication of the true satellites; `None` without `[osnma]`.
    pub(super) fn osnma(
        &self,
        catalogue: &Arc<Catalogue>,
        common: &Common,
        seed: u64,
    ) -> Result<Option<Arc<Osnma>>, ScenarioError> {
        let Some(spec) = &self.osnma else {
            return match self.spoofers.iter().any(|spoofer| spoofer.osnma != Spoofed::True) {
                true => Err(self.conflict("spoofer.osnma", "there is no [osnma] that it could differ from".to_owned())),
                false => Ok(None),
            };
        };
        let carries = |component: &gnss::signal::Component| component.message == Some(&INAV);
        if !self.signals.iter().any(|signal| signal.components.iter().any(carries)) {
            let reason = "no signal of the scene carries it: add \"Galileo E1\" to signals";
            return Err(self.conflict("osnma", reason.to_owned()));
        }
        let own = Osnma::new(self.provider(spec, seed)?, catalogue, common);
        Ok(Some(Arc::new(own.with_facts(self.osnma_facts(spec)))))
    }

    fn osnma_facts(&self, spec: &OsnmaSpec) -> OsnmaFacts {
        let bits = |spoofed: Spoofed| match spoofed {
            Spoofed::True => SpoofedBits::True,
            Spoofed::None => SpoofedBits::None,
            Spoofed::OwnKeys => SpoofedBits::OwnKeys,
        };
        OsnmaFacts {
            without: spec.without.iter().map(|number| satellite(*number)).collect(),
            public_key_every_s: spec.key_turn_s[0],
            public_key_for_s: spec.key_turn_s[1],
            first_transition_s: spec.transitions.first().map(|(_, time_s)| *time_s),
            spoofers: (self.spoofers.iter())
                .map(|spoofer| SpoofedMessages {
                    bits: bits(spoofer.osnma),
                    replay_s: spoofer.replay_s,
                    on_s: spoofer.on_s,
                })
                .collect(),
        }
    }

    /// Authentication in the messages of spoofers that do not repeat the true bits, by their number from 1.
    pub(super) fn spoofed_osnma(
        &self,
        catalogue: &Arc<Catalogue>,
        common: &Common,
        seed: u64,
    ) -> Result<Vec<OfSpoofer>, ScenarioError> {
        let mut found: Vec<OfSpoofer> = Vec::new();
        for (number, spoofer) in (1..).zip(&self.spoofers) {
            match (&self.osnma, spoofer.osnma) {
                (Some(spec), Spoofed::OwnKeys) => {
                    let seed = Stream::new(seed, "osnma of a spoofer").part(number as u64).word(0);
                    let own: Arc<dyn Authentication> =
                        Arc::new(Osnma::new(self.provider(spec, seed)?, catalogue, common));
                    found.push((number, Some(own)));
                }
                (Some(_), Spoofed::None) => found.push((number, None)),
                _ => {}
            }
        }
        Ok(found)
    }

    fn provider(&self, spec: &OsnmaSpec, seed: u64) -> Result<Provider, ScenarioError> {
        let subframes = |s: f64| (s / SUBFRAME_S as f64) as i64;
        let at = |time_s: f64| gst(GST.label(self.start.plus_s(time_s)));
        let transitions = spec.transitions.iter().map(|&(kind, time_s)| Transition { kind, start: at(time_s) });
        let settings = Settings {
            hash: spec.hash,
            mac: spec.mac,
            table: spec.table,
            is_operational: spec.is_operational,
            without: spec.without.clone(),
            key_every: subframes(spec.key_turn_s[0]),
            key_for: subframes(spec.key_turn_s[1]),
            step: subframes(spec.step_s),
            transitions: transitions.collect(),
            ..Settings::new(seed, gst(GST.label(self.start)))
        };
        Provider::new(settings).map_err(|error| self.conflict("osnma", error.to_string()))
    }
}
