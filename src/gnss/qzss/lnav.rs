//! LNAV as QZSS sends it: the subframes of GPS, each bit at its position, with ephemerides of an hour.
//!
//! Source: IS-QZSS-PNT-005, 4.1. An ephemeris is sent in the hour before its reference time and fits until an
//! hour after it. Health has a bit for the message and one for each signal, so that a satellite with
//! L1C/B instead of L1 C/A is healthy for others. Limits: of subframes 4 and 5 only the page of
//! ionosphere and UTC is sent, where GPS has it, with the coefficients of GPS; real satellites have their
//! own of two regions, and almanacs.

use crate::broadcast::{Ephemeris, SetForm};
use crate::gps::lnav::{self, Broadcast};
use crate::message::{Common, Message};
use crate::qzss::own::{OwnFields, OwnReader, like, named};
use crate::qzss::{l1c, l2c, l5};
use crate::signal::Signal;

/// Definition of LNAV as QZSS sends it.
pub static LNAV: Message = Message {
    name: "LNAV of QZSS",
    sender: |common| Ok(Box::new(Broadcast::of(&Common { almanac: Vec::new(), ..common.clone() })?)),
    fields: &OwnFields { gps: &lnav::LNAV, message: &LNAV },
    reader: |sv| OwnReader::boxed(&lnav::LNAV, &LNAV, sv),
    form: |set| named(Ephemeris { signal_delays_s: Vec::new(), ..set.clone() }, &LNAV),
    sets: &LNAV_SETS,
    ..lnav::LNAV
};

/// Meaning of clock and health in ephemerides of LNAV: one group delay, and health bits by signal.
pub static LNAV_SETS: SetForm = SetForm {
    name: "LNAV of QZSS",
    serves: |signal| (lnav::LNAV_SETS.serves)(like(signal)),
    is_healthy: |set| set.health & planted!("gnss.qzss.health", OF_L1_CA, 0b11_1111) == 0,
    healthy: |set, signal| Some(set.health & of(signal) == 0),
    ..lnav::LNAV_SETS
};

/// Bits of the health that speak of the message and of L1 C/A (4.1.2); those after them are of
/// L2C, L5, L1C and L1C/B.
const OF_L1_CA: u16 = 0b11_0000;
const OF_L2C: u16 = 0b1000;
const OF_L5: u16 = 0b100;
const OF_L1C: u16 = 0b10;

/// The bits that speak of a signal.
fn of(signal: &Signal) -> u16 {
    let own = [(&l2c::L2C, OF_L2C), (&l5::L5, OF_L5), (&l1c::L1C, OF_L1C)];
    own.into_iter().find(|(other, _)| *other == signal).map_or(OF_L1_CA, |(_, bits)| bits)
}

/// Health of L1, L2, L5 and L1C, true if the signal must not be used. L1 is unhealthy if neither L1 C/A nor
/// L1C/B is usable.
pub(super) fn unhealthy(set: &Ephemeris) -> [bool; 4] {
    const EITHER_ON_L1: u16 = 0b1_0001;
    let bad = |bits| set.health & bits != 0;
    let on_l1 = set.health & EITHER_ON_L1 == EITHER_ON_L1;
    [on_l1, bad(OF_L2C), bad(OF_L5), bad(OF_L1C)]
}
