//! Keys of `[osnma]`.

use super::{LONGEST_S, SATELLITES};
use crate::scenario::osnma::{changes, hashes, macs, states};
use crate::scenario::schema::{Key, integer, number, tables, word, words};

pub(crate) const OSNMA: &[Key] = &[
    word("chain_hash", hashes, "hash of the chain of keys").or_else("sha256"),
    word("mac_function", macs, "function of the tags").or_else("hmac_sha256"),
    integer("maclt", 27, 35, "number of the MAC look-up table: 27, 33, 34 or 35").or(34.0),
    word("status", states, "status of the service in the NMA header").or_else("operational"),
    words("without", SATELLITES, "satellites that send zeros instead of authentication").or_else("none"),
    number("public_key_every_s", 30.0, 86_400.0, "s", "interval of the turns in which the public key is sent")
        .or(600.0),
    number("public_key_for_s", 0.0, 86_400.0, "s", "duration of each of those turns; the root key has the others")
        .or(180.0),
    number("step_s", 120.0, 86_400.0, "s", "duration of each step of a transition").or(600.0),
    tables("transition", TRANSITION, "Change of keys. Each ends before the next one begins; an alert is the last."),
];

const TRANSITION: &[Key] = &[
    word("kind", changes, "kind of the change").required(),
    number(
        "time_s",
        0.0,
        LONGEST_S,
        "s",
        "begin of its first step, in true time since the scene's start; taken to the beginning of the sub-frame",
    )
    .required(),
];
