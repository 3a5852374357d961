//! Time at which a receiver must have authentic data, by the message's own timetable.
//!
//! Galileo OSNMA SIS ICD 1.1, 3 and 6: a sub-frame of 30 s carries the data, the next one tags over them, and
//! the one after that the key of those tags. The first page of the fourth sub-frame ends the third one at a
//! receiver. A hot start needs no more than those; a warm one the root key (8 blocks, one a sub-frame of each
//! satellite) and a cold one the public key before it (13 blocks, in its turns). Satellites send the blocks
//! in turn, each by its number ahead. Limits: satellites count that the truth has nearly always; a start near
//! a transition or a spoofer has no time.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::read::Run;
use gnss::facts::OsnmaFacts;
use gnss::galileo::e1::E1;
use gnss::galileo::inav::GST_WEEK;
use gnss::satellite::Sv;
use gnss::signal::Link;
use gnss::time::{Epoch, WEEK_S};

/// Seconds of a sub-frame.
pub const SUBFRAME_S: i64 = 30;
/// Second of a sub-frame at which its first page has ended: on E1-B it begins at second 1 and lasts two (OS
/// SIS ICD 2.1, 4.3.2.2).
const FIRST_PAGE_S: f64 = 3.0;
/// Travel of the signal and a receiver's block.
const SLACK_S: f64 = 0.5;
/// Blocks of the message with the public key (ICD, table 3) and of that with the root key (table 5).
const KEY_BLOCKS: i64 = 13;
const ROOT_BLOCKS: i64 = 8;
/// Sub-frames that are looked at: two hours.
const LONGEST: i64 = 240;
/// Share of the truth's epochs in which a satellite has to be there.
const NEARLY_ALWAYS: f64 = 0.95;

/// Start of a receiver by the keys that it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Public key and root key.
    Hot,
    /// Public key.
    Warm,
    /// Root of the Merkle tree.
    Cold,
}

/// Settings of a receiver's verification, as it states them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verification {
    /// Start by its keys.
    pub start: Start,
    /// Bound of the error of its own time.
    pub uncertainty_s: f64,
    /// Error of its own time: own less true.
    pub offset_s: f64,
    /// True if positions take authentic data alone.
    pub is_required: bool,
}

impl Verification {
    /// Verification of the receiver of a run; `None` of one that does not verify.
    pub fn of(receiver: &Value) -> Option<Self> {
        let own = receiver.get("settings")?.get("osnma").filter(|own| own.is_object())?;
        let has = |key: &str| own[key].as_str().is_some_and(|text| !text.is_empty());
        let start = match (has("kroot"), has("public_key")) {
            (true, _) => Start::Hot,
            (false, true) => Start::Warm,
            (false, false) => Start::Cold,
        };
        Some(Self {
            start,
            uncertainty_s: own["time_uncertainty_s"].as_f64().unwrap_or(0.0),
            offset_s: own["clock_offset_s"].as_f64().unwrap_or(0.0),
            is_required: own["position"].as_str() == Some("authentic"),
        })
    }

    /// True if a tag of a kind may count that came so many seconds after it was sent: by the receiver's own
    /// time and its bound it came before its key, which is sent a sub-frame after it, or eleven for the slow
    /// MAC (ADKD 12).
    pub fn admits(&self, adkd: u8, late_s: f64) -> bool {
        let key_after_s = if adkd == 12 { 330.0 } else { 30.0 };
        (0.0..key_after_s).contains(&(late_s + self.offset_s + self.uncertainty_s))
    }
}

/// Conditions under which a receiver has positions of authentic data alone.
#[derive(Clone, Debug)]
pub struct Required {
    /// Time from which on they are due; infinite where they never are.
    pub from_s: f64,
    /// Satellites that sign.
    satellites: BTreeSet<Sv>,
}

impl Required {
    /// Conditions of a run whose receiver takes authentic data alone; `None` of another. It has locked by
    /// `lock_s`.
    pub fn of(run: &Run, lock_s: f64) -> Option<Self> {
        let own = Verification::of(&run.receiver).filter(|own| own.is_required)?;
        let satellites = run.scene.osnma.as_ref().map(|facts| signing(run, facts)).unwrap_or_default();
        let from_s = first_s(run, &own, lock_s).map_or(f64::INFINITY, |(at_s, _)| at_s);
        Some(Self { from_s, satellites })
    }

    /// True if a position may use a signal: tags cover I/NAV alone.
    pub fn serves(&self, link: Link) -> bool {
        link.signal == &E1 && self.satellites.contains(&link.sv)
    }
}

/// Seconds of GST at the run's first sample.
pub fn begin_gst_s(run: &Run) -> Option<f64> {
    let start = Epoch::parse(&run.scene.start).ok()?;
    Some((start.seconds() - GST_WEEK * WEEK_S) as f64 + start.fraction())
}

/// Satellites with authentication that the truth has nearly always.
pub fn signing(run: &Run, facts: &OsnmaFacts) -> BTreeSet<Sv> {
    let epochs = run.trajectory.len() as f64;
    let links = run.truth.keys().filter(|link| link.signal == &E1 && !facts.without.contains(&link.sv));
    links.filter(|link| run.truth.count(link) as f64 >= NEARLY_ALWAYS * epochs).map(|link| link.sv).collect()
}

/// First sub-frame after which all blocks of a message have been sent, from the sub-frame `from` on, in the
/// sub-frames in which it is sent.
fn whole(satellites: &BTreeSet<Sv>, blocks: i64, from: i64, is_sent: impl Fn(i64) -> bool) -> Option<i64> {
    let mut missing: BTreeSet<i64> = (0..blocks).collect();
    for number in (from..from + LONGEST).filter(|number| is_sent(*number)) {
        for sv in satellites {
            missing.remove(&(number + i64::from(sv.number)).rem_euclid(blocks));
        }
        if missing.is_empty() {
            return Some(number + 1);
        }
    }
    None
}

/// Seconds from the first sample by which data must be authentic of a receiver that has locked by `lock_s`,
/// with the derivation; `None` where the scene has no such time.
pub fn first_s(run: &Run, verification: &Verification, lock_s: f64) -> Option<(f64, String)> {
    let facts = run.scene.osnma.as_ref()?;
    let begin_s = begin_gst_s(run)?;
    let satellites = signing(run, facts);
    // A satellite's own tag covers its own data.
    if satellites.is_empty() || !verification.admits(12, SLACK_S) {
        return None;
    }
    let every = (facts.public_key_every_s / SUBFRAME_S as f64).round().max(1.0) as i64;
    let turn = (facts.public_key_for_s / SUBFRAME_S as f64).round() as i64;
    let sends_key = |number: i64| number.rem_euclid(every) < turn;
    // The first whole sub-frame after lock.
    let first = ((begin_s + lock_s) / SUBFRAME_S as f64).ceil() as i64;
    let key = match verification.start {
        Start::Cold => whole(&satellites, KEY_BLOCKS, first, sends_key)?,
        Start::Warm | Start::Hot => first,
    };
    let root = match verification.start {
        Start::Hot => first,
        Start::Warm | Start::Cold => whole(&satellites, ROOT_BLOCKS, key, |number| !sends_key(number))?,
    };
    let slow = if verification.admits(0, SLACK_S) { 0 } else { 10 };
    let last = root.max(first + 3 + slow);
    let at_s = (last * SUBFRAME_S) as f64 + FIRST_PAGE_S + SLACK_S - begin_s;
    let changes = facts.first_transition_s.into_iter().chain(facts.spoofers.iter().map(|spoofer| spoofer.on_s));
    if changes.into_iter().any(|change_s| change_s <= at_s) {
        return None;
    }
    let mut text = format!(
        "the message's own timetable: the first whole sub-frame after a lock within {lock_s} s begins at {:.0} s and \
         has data, the next one tags, the one after it their key{}",
        (first * SUBFRAME_S) as f64 - begin_s,
        if slow > 0 { ", of the slow MAC ten later" } else { "" }
    );
    let end_s = |number: i64| (number * SUBFRAME_S) as f64 - begin_s;
    if verification.start == Start::Cold {
        text += &format!("; the public key is whole at {:.0} s", end_s(key));
    }
    if verification.start != Start::Hot {
        text += &format!("; the root key is whole at {:.0} s", end_s(root));
    }
    Some((at_s, text + "; the first page of the next sub-frame ends it"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::satellite::System;

    fn satellites(numbers: &[u8]) -> BTreeSet<Sv> {
        numbers.iter().map(|&number| Sv { system: System::Galileo, number }).collect()
    }

    #[test]
    fn blocks_come_one_a_subframe_from_each_satellite() {
        // One satellite alone needs as many sub-frames as there are blocks; eight in a row need one.
        assert_eq!(whole(&satellites(&[5]), 8, 100, |_| true), Some(108));
        assert_eq!(whole(&satellites(&[1, 2, 3, 4, 5, 6, 7, 8]), 8, 100, |_| true), Some(101));
        // In turns of six of twenty sub-frames, thirteen blocks of one satellite need three turns.
        assert_eq!(whole(&satellites(&[5]), 13, 100, |number| number % 20 < 6), Some(whole_by_hand()));
        assert_eq!(whole(&satellites(&[]), 8, 100, |_| true), None);
    }

    /// Sub-frame after which each remainder was met, by a list.
    fn whole_by_hand() -> i64 {
        let mut met = BTreeSet::new();
        let mut sent = (100..).filter(|number| number % 20 < 6);
        loop {
            let number: i64 = sent.next().unwrap();
            met.insert((number + 5) % 13);
            if met.len() == 13 {
                return number + 1;
            }
        }
    }

    #[test]
    fn a_tag_counts_while_its_key_cannot_have_been_sent() {
        let of =
            |offset_s, uncertainty_s| Verification { start: Start::Hot, uncertainty_s, offset_s, is_required: false };
        assert!(of(0.0, 15.0).admits(0, 0.1) && of(0.0, 15.0).admits(0, 14.8));
        assert!(!of(0.0, 15.0).admits(0, 15.1) && of(0.0, 15.0).admits(12, 15.1));
        assert!(!of(3600.0, 15.0).admits(12, 0.1) && !of(-3600.0, 15.0).admits(12, 0.1));
    }
}
