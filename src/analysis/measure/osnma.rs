//! Tags that a receiver took for authentic or refused, against what the scene's satellites and spoofers sent.
//!
//! Truth decides, and no verifier. The time of sending that an observation states tells which signal the
//! receiver followed: that of the satellite, or that of a spoofer. A tag is false if its sender was followed
//! at a spoofer that does not send the true bits; if it came so late, by a replay or by the receiver's own
//! clock, that its key could have been known; or if a fault changed the words that it covers. A tag is true
//! if its sender and the satellite of its data were followed at their own signals, with no fault of their
//! messages. Tags of mixed sub-frames are neither. Limits: each fault of a parameter counts as one of I/NAV;
//! a spoofer whose signal lies within 30 m of the true one counts as followed if it is the stronger one.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::authenticated::{SUBFRAME_S, Verification, begin_gst_s, first_s};
use crate::expect::due::satellite::LOCK_S;
use crate::read::Run;
use gnss::facts::{FaultKind, SpoofedBits, SpoofedMessages};
use gnss::galileo::e1::E1;
use gnss::record::{Observation, TagRow};
use gnss::satellite::Sv;
use gnss::time::WEEK_S;

/// Difference in times of sending below which signals cannot be told apart by them: 30 m.
const ALIKE_S: f64 = 1e-7;
/// Time that words of a fault may stay in a receiver: two sub-frames.
const REMEMBERED_S: f64 = 60.0;
/// Travel of a signal.
const TRAVEL_S: f64 = 0.1;

/// `osnma` in `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Osnma {
    /// The receiver's start by its keys: cold, warm or hot.
    pub start: String,
    /// Last state of the receiver's verification.
    pub state: String,
    /// Tags by the receiver's result.
    pub tags_authentic: u64,
    /// Tags that it refused.
    pub tags_refused: u64,
    /// Tags that it could not verify, or that state no data.
    pub tags_open: u64,
    /// Tags that it took for authentic and that are false.
    pub false_accepted: u64,
    /// True tags that it refused.
    pub true_refused: u64,
    /// Difference between its own counts and its table.
    pub rows_differing: u64,
    /// Time of its first authentic data.
    pub first_authentic_s: Option<f64>,
    /// Time by which the message's timetable has them.
    pub first_authentic_due_s: Option<f64>,
    /// Time of its first fix by authentic data.
    pub first_authentic_fix_s: Option<f64>,
    /// Derivation of the time that is due.
    #[serde(skip)]
    pub timetable: String,
    /// The first false tags that were accepted and the first true ones that were refused, in words.
    #[serde(skip)]
    pub wrong: [Vec<String>; 2],
}

/// Signals at which a satellite was followed in a sub-frame: 0 is its own, others are the spoofers' numbers.
type Followed = BTreeMap<(Sv, i64), BTreeSet<usize>>;

/// Truth about a tag.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Truth {
    True,
    False(String),
    Unknown,
}

impl Osnma {
    /// `None` for a receiver that does not verify, and in a scene without authentication.
    ///
    /// # Errors
    /// Tables that cannot be read.
    pub fn of(run: &Run) -> Result<Option<Self>, JudgeError> {
        let (Some(verification), Some(facts)) = (Verification::of(&run.receiver), &run.scene.osnma) else {
            return Ok(None);
        };
        let stated = &run.receiver["osnma"];
        let text = |key: &str| stated[key].as_str().unwrap_or_default().to_owned();
        let rows = run.tags()?;
        let count = |result: &str| rows.iter().filter(|row| row.result == result).count() as u64;
        let told = |result: &str| stated["tags"]["all"][result].as_u64().unwrap_or(0);
        let results = ["authentic", "refused", "no_data", "not_verifiable"];
        let (timetable_s, timetable) = first_s(run, &verification, LOCK_S).unzip();
        let judge = Judge { run, verification, spoofers: &facts.spoofers, followed: followed(run, &facts.spoofers)? };
        let mut wrong = [Vec::new(), Vec::new()];
        let (mut false_accepted, mut true_refused) = (0, 0);
        let begin_s = begin_gst_s(run).unwrap_or(0.0);
        for row in &rows {
            let place = match (row.result.as_str(), judge.truth(row, begin_s)) {
                ("authentic", Truth::False(why)) => {
                    false_accepted += 1;
                    Some((0, why))
                }
                ("refused", Truth::True) => {
                    true_refused += 1;
                    Some((1, row.reason.clone()))
                }
                _ => None,
            };
            if let Some((list, why)) = place.filter(|(list, _)| wrong[*list].len() < 3) {
                let TagRow { tow_s, sender, satellite, adkd, .. } = row;
                wrong[list].push(format!("{sender} at TOW {tow_s}, ADKD {adkd} of {satellite}: {why}"));
            }
        }
        Ok(Some(Self {
            start: text("start"),
            state: text("state"),
            tags_authentic: count("authentic"),
            tags_refused: count("refused"),
            tags_open: count("no_data") + count("not_verifiable"),
            false_accepted,
            true_refused,
            rows_differing: results.iter().map(|result| count(result).abs_diff(told(result))).sum(),
            first_authentic_s: stated["first_authentic_s"].as_f64(),
            first_authentic_due_s: timetable_s.filter(|due_s| *due_s <= run.scene.duration_s),
            first_authentic_fix_s: stated["first_authentic_fix_s"].as_f64(),
            timetable: timetable.unwrap_or_default(),
            wrong,
        }))
    }
}

/// Signals at which each satellite was followed, by sub-frames of true time; without a spoofer nothing.
fn followed(run: &Run, spoofers: &[SpoofedMessages]) -> Result<Followed, JudgeError> {
    let mut all = Followed::new();
    let Some(begin_s) = begin_gst_s(run).filter(|_| !spoofers.is_empty()) else { return Ok(all) };
    let claimed: Vec<BTreeMap<(Sv, u64), Observation>> =
        (1..=spoofers.len()).map(|number| run.spoofed(number)).collect::<Result<_, _>>()?;
    for link in run.observations.keys().filter(|link| link.signal == &E1) {
        let own: BTreeMap<u64, Observation> = run.truth.map(link, |row| (row.sample, row))?.into_iter().collect();
        run.observations.each(link, |row| {
            let signals = own.get(&row.sample).map(|row| (0, row)).into_iter();
            let spoofed =
                (1..).zip(&claimed).filter_map(|(number, rows)| Some((number, rows.get(&(link.sv, row.sample))?)));
            let apart_s = |other: &Observation| {
                ((row.sent_s - other.sent_s) as f64 + (row.sent_fraction_s - other.sent_fraction_s)).abs()
            };
            let all_signals: Vec<(usize, &Observation)> = signals.chain(spoofed).collect();
            let nearest_s = all_signals.iter().map(|(_, other)| apart_s(other)).fold(f64::INFINITY, f64::min);
            let near = all_signals.iter().filter(|(_, other)| apart_s(other) <= nearest_s + ALIKE_S);
            if let Some((number, _)) = near.max_by(|a, b| a.1.cn0_dbhz.total_cmp(&b.1.cn0_dbhz)) {
                let subframe = ((begin_s + run.time_s(row.sample)) / SUBFRAME_S as f64).floor() as i64;
                all.entry((link.sv, subframe)).or_default().insert(*number);
            }
        })?;
    }
    Ok(all)
}

struct Judge<'a> {
    run: &'a Run,
    verification: Verification,
    spoofers: &'a [SpoofedMessages],
    followed: Followed,
}

impl Judge<'_> {
    /// Spoofer, or 0 for the satellite itself, at whose signal alone a satellite was followed in a sub-frame
    /// of its message that began at a second of GST.
    fn source(&self, sv: Sv, start_s: i64) -> Option<usize> {
        if self.spoofers.is_empty() {
            return Some(0);
        }
        let at = |number: usize| {
            let late_s =
                number.checked_sub(1).and_then(|index| self.spoofers.get(index)).map_or(0.0, |one| one.replay_s);
            // Sub-frames of a replay lie across two of true time.
            let first = (start_s as f64 + late_s) / SUBFRAME_S as f64;
            let whole: Vec<i64> = if late_s.rem_euclid(SUBFRAME_S as f64) == 0.0 {
                vec![first.floor() as i64]
            } else {
                vec![first.floor() as i64, first.floor() as i64 + 1]
            };
            whole.iter().all(|number_of| {
                self.followed
                    .get(&(sv, *number_of))
                    .is_some_and(|signals| signals.len() == 1 && signals.contains(&number))
            })
        };
        (0..=self.spoofers.len()).find(|number| at(*number))
    }

    /// True if a fault of a satellite's message acts between two times of the run.
    fn is_faulty(&self, sv: Sv, from_s: f64, to_s: f64, all_through: bool) -> bool {
        let changes = |kind: FaultKind| {
            matches!(kind, FaultKind::BitErrors | FaultKind::Bit | FaultKind::Health | FaultKind::Parameter)
        };
        self.run.scene.faults.iter().filter(|fault| changes(fault.kind)).any(|fault| {
            let end_s = fault.to_s.unwrap_or(f64::INFINITY);
            let is_its = fault.satellites.as_ref().is_none_or(|all| all.contains(&sv));
            let acts = if all_through {
                // Wrong bits at random may spare a sub-frame, and one bit may be elsewhere.
                matches!(fault.kind, FaultKind::Parameter | FaultKind::Health)
                    && fault.from_s <= from_s.max(0.0)
                    && to_s <= end_s
            } else {
                fault.from_s < to_s && from_s < end_s
            };
            is_its && acts
        })
    }

    fn truth(&self, row: &TagRow, begin_s: f64) -> Truth {
        let (Ok(sender), Ok(of)) = (row.sender.parse::<Sv>(), row.satellite.parse::<Sv>()) else {
            return Truth::Unknown;
        };
        let start_s = i64::from(row.gst_week) * WEEK_S + i64::from(row.tow_s);
        let time_s = start_s as f64 - begin_s;
        let Some(number) = self.source(sender, start_s) else { return Truth::Unknown };
        let spoofer = number.checked_sub(1).and_then(|index| self.spoofers.get(index)).copied();
        let SpoofedMessages { bits, replay_s, .. } = spoofer.unwrap_or_default();
        if bits != SpoofedBits::True {
            return Truth::False(format!("spoofer {number} sent it, without the true bits"));
        }
        if !self.verification.admits(row.adkd, replay_s + TRAVEL_S) && !self.verification.admits(row.adkd, replay_s) {
            return Truth::False(format!(
                "it came {replay_s} s late at a clock {} s ahead",
                self.verification.offset_s
            ));
        }
        if self.source(of, start_s - SUBFRAME_S) != Some(number) {
            return Truth::Unknown;
        }
        let sub = SUBFRAME_S as f64;
        if row.adkd != 4 && self.is_faulty(of, time_s - 2.0 * sub, time_s, true) {
            return Truth::False(format!("a fault changed the words of {of}"));
        }
        let is_clean = |sv: Sv| !self.is_faulty(sv, time_s - REMEMBERED_S - sub, time_s + sub, false);
        if number == 0 && is_clean(sender) && is_clean(of) { Truth::True } else { Truth::Unknown }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made;

    fn run(offset_s: f64, faulty: bool) -> (tempfile::TempDir, Run) {
        let place = hand_made::planted();
        hand_made::verified(place.path(), offset_s, faulty);
        let run = Run::read(place.path()).unwrap();
        (place, run)
    }

    fn counts(offset_s: f64, faulty: bool) -> [u64; 3] {
        let found = Osnma::of(&run(offset_s, faulty).1).unwrap().unwrap();
        [found.false_accepted, found.true_refused, found.rows_differing]
    }

    #[test]
    fn tags_over_changed_words_and_tags_later_than_their_keys_are_false_and_others_true() {
        assert_eq!(counts(0.0, false), [0, 1, 0]);
        assert_eq!(counts(0.0, true), [2, 1, 0]);
        // Late by 20 s and 15 s of uncertainty ADKD 0 may have its key, late by an hour ADKD 12 too.
        assert_eq!(counts(20.0, false)[0], 1);
        assert_eq!(counts(3600.0, false)[0], 2);
    }

    #[test]
    fn the_sender_that_was_followed_decides_on_its_tags() {
        let (_place, run) = run(0.0, false);
        let verification = Verification::of(&run.receiver).unwrap();
        let subframe = (566 * WEEK_S + 375_240) / SUBFRAME_S;
        let spoofed = |bits, replay_s| SpoofedMessages { bits, replay_s, on_s: 0.0 };
        let truth = |spoofer: SpoofedMessages, followed: &[(&str, i64, usize)]| {
            let mut all = Followed::new();
            for (sv, after, number) in followed {
                all.entry((sv.parse().unwrap(), subframe + after)).or_default().insert(*number);
            }
            let judge = Judge { run: &run, verification, spoofers: &[spoofer], followed: all };
            let row = run.tags().unwrap().remove(2);
            judge.truth(&row, begin_gst_s(&run).unwrap())
        };
        let own_keys = spoofed(SpoofedBits::OwnKeys, 0.0);
        let at_own = [("E05", 0, 0), ("E11", -1, 0)];
        assert_eq!(truth(own_keys, &at_own), Truth::True);
        assert!(matches!(truth(own_keys, &[("E05", 0, 1), ("E11", -1, 0)]), Truth::False(_)));
        // Followed at both in one sub-frame, or not at all.
        assert_eq!(truth(own_keys, &[("E05", 0, 0), ("E05", 0, 1), ("E11", -1, 0)]), Truth::Unknown);
        assert_eq!(truth(own_keys, &[]), Truth::Unknown);
        // A replay of two sub-frames comes after the key, one of none repeats what is true.
        assert!(matches!(truth(spoofed(SpoofedBits::True, 60.0), &[("E05", 2, 1), ("E11", 1, 1)]), Truth::False(_)));
        assert_eq!(truth(spoofed(SpoofedBits::True, 0.0), &[("E05", 0, 1), ("E11", -1, 1)]), Truth::Unknown);
    }
}
