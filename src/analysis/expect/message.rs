//! Orbits, clocks and ionosphere as the truth says that they were sent: what a receiver can know at best.
//!
//! The raw integers of `truth/navigation.csv` go through the message's own table. Limits: a satellite whose
//! subframes 1 to 3 are incomplete there has no set. Where a satellite sends a new set during the run, the one that the
//! receiver says that it had read last counts, as all of them are right.

use std::collections::{BTreeMap, BTreeSet};

use crate::analysis::load::Run;
use crate::gnss::broadcast::Ephemeris;
use crate::gnss::gps::lnav::{Subframe, ephemeris, tables};
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::record::{Event, NavigationRow};
use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;

/// What all satellites sent.
#[derive(Clone, Debug, Default)]
pub struct Message {
    /// With their issues.
    sets: BTreeMap<Sv, Vec<(u32, Ephemeris)>>,
    /// From which sample on the receiver had which issue, ascending.
    read: BTreeMap<Sv, Vec<(u64, u32)>>,
    pub klobuchar: Option<Klobuchar>,
}

/// Low eight bits of an issue of data: what IODC and IODE share (IS-GPS-200N, 20.3.3.4.1).
const SHARED_ISSUE: u32 = 0xFF;

impl Message {
    /// Of a run's truth.
    pub fn of(run: &Run) -> Self {
        let Some(near) = run.trajectory.first().map(|row| row.time()) else { return Self::default() };
        let mut groups: BTreeMap<(Sv, u32), Vec<&NavigationRow>> = BTreeMap::new();
        for row in &run.truth_navigation {
            groups.entry((row.sv, row.issue & SHARED_ISSUE)).or_default().push(row);
        }
        let mut message = Self::default();
        for ((sv, issue), rows) in groups {
            if let Some(set) = set(sv, &rows, near) {
                message.sets.entry(sv).or_default().push((issue, set));
            }
            message.klobuchar = message.klobuchar.or_else(|| klobuchar(&rows));
        }
        message.read = message.sets.keys().map(|sv| (*sv, read(run, *sv))).collect();
        message
    }

    /// The set of a satellite that the receiver had read last at `sample`, or else the one whose reference time is nearest
    /// to `at`.
    pub fn ephemeris(&self, sv: Sv, (sample, at): (u64, Epoch)) -> Option<&Ephemeris> {
        let sets = self.sets.get(&sv)?;
        let last = self.read.get(&sv).and_then(|read| read.iter().rev().find(|(since, _)| *since <= sample));
        let issued = last.and_then(|(_, issue)| sets.iter().find(|(other, _)| other == issue));
        let age_s = |(_, set): &&(u32, Ephemeris)| at.since(set.toe).abs();
        issued.or_else(|| sets.iter().min_by(|a, b| age_s(a).total_cmp(&age_s(b)))).map(|(_, set)| set)
    }
}

/// When the receiver completed the sets of a satellite, with their issues in the order in which it wrote them down. A
/// set that it read again after a loss comes before a new one.
fn read(run: &Run, sv: Sv) -> Vec<(u64, u32)> {
    let mut issues: Vec<u32> = Vec::new();
    for row in run.navigation.iter().filter(|row| row.sv == sv && row.parameter == "toe_s") {
        let issue = row.issue & SHARED_ISSUE;
        if !issues.contains(&issue) {
            issues.push(issue);
        }
    }
    let completed = run.events.iter().filter(|row| row.sv == sv && row.event == Event::EphemerisComplete);
    let completed: Vec<u64> = completed.map(|row| row.sample).collect();
    let again = completed.len().saturating_sub(issues.len());
    let issue = |index: usize| issues.get(index.saturating_sub(again)).copied();
    completed.iter().enumerate().filter_map(|(index, sample)| Some((*sample, issue(index)?))).collect()
}

/// Ten words that carry those rows' parameters, and whether all of the table's are there.
fn words(table: &str, rows: &[&NavigationRow]) -> Option<[u32; 10]> {
    let mut data = [0; 10];
    let fields = tables().into_iter().find(|(name, _)| name.starts_with(table))?.1;
    for field in fields {
        field.write(&mut data, rows.iter().find(|row| row.parameter == field.name)?.raw);
    }
    Some(data)
}

fn set(sv: Sv, rows: &[&NavigationRow], near: Epoch) -> Option<Ephemeris> {
    // The count is that of the subframe after; ten minutes more or less change no reference time.
    let tow_count = ((near.tow_whole_s() / 6 + 1) % 100_800) as u32;
    let subframe = |id: u8| {
        let data = words(&format!("subframe {id}"), rows)?;
        Some(Subframe { id, tow_count, alert: false, antispoof: false, data })
    };
    ephemeris(sv, &subframe(1)?, &subframe(2)?, &subframe(3)?, near).ok()
}

fn klobuchar(rows: &[&NavigationRow]) -> Option<Klobuchar> {
    let data = words("ionosphere", rows)?;
    // Page 18 of subframe 4 bears the identity 56 (IS-GPS-200N, table 20-V).
    let mut page = Subframe { id: 4, tow_count: 0, alert: false, antispoof: false, data };
    if let Some(word) = page.data.get_mut(2) {
        *word |= 56 << 16;
    }
    page.klobuchar()
}

/// Names of the parameters of subframes 1 to 3.
pub fn orbit_parameters() -> BTreeSet<&'static str> {
    let orbit = tables().into_iter().filter(|(name, _)| name.starts_with("subframe"));
    orbit.flat_map(|(_, fields)| fields).map(|field| field.name).collect()
}
