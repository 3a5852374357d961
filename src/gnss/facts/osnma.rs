//! Facts of a scene's authentication of Galileo's messages: whose bits are true, and when keys are sent.

use serde::{Deserialize, Serialize};

use crate::satellite::Sv;

/// Authentication in a spoofer's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpoofedBits {
    /// Bits of the true satellites.
    #[default]
    True,
    /// Zeros.
    None,
    /// Bits that the spoofer signs by keys of its own.
    OwnKeys,
}

/// Messages of one spoofer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpoofedMessages {
    /// Authentication in them.
    pub bits: SpoofedBits,
    /// Seconds by which they lie behind the true ones.
    pub replay_s: f64,
    /// Begin of its signals, in seconds since the start of the samples.
    pub on_s: f64,
}

/// Authentication of Galileo's messages on E1-B.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OsnmaFacts {
    /// Satellites that send zeros.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<Sv>,
    /// Seconds from one turn of the public key to the next, counted from the beginning of GST.
    pub public_key_every_s: f64,
    /// Seconds of each turn; the root key has the others.
    pub public_key_for_s: f64,
    /// Begin of the first transition, in seconds since the start of the samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_transition_s: Option<f64>,
    /// Messages of each spoofer, in the order of their numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spoofers: Vec<SpoofedMessages>,
}
