//! Orbits, clocks and ionosphere as the truth says that they were sent: what a receiver can know at best.
//!
//! The raw integers of `truth/navigation.csv` go through the message's own tables. Limits: a satellite whose
//! ephemeris is incomplete there has none. Where a satellite sends a new ephemeris during the run, the one
//! that the receiver says that it had read last counts, as all of them are right. Of sets that have one
//! issue, as those of four bits have after hours, it is the newest that was due by then.

use std::collections::{BTreeMap, BTreeSet};

use crate::read::Run;
use gnss::broadcast::Ephemeris;
use gnss::ionosphere::{Coefficients, Model};
use gnss::message::Message as Form;
use gnss::record::{Event, EventRow, NavigationRow};
use gnss::satellite::Sv;
use gnss::signal::Link;
use gnss::time::{Epoch, TimeScale};

/// Issue of an ephemeris, and the sample at which it was due.
type Issue = (u32, u64);

/// Messages that the satellites sent.
#[derive(Clone, Debug, Default)]
pub struct Message {
    /// Ephemerides of each satellite and message, with their issues and the samples at which they were due.
    sets: BTreeMap<(Sv, &'static str), Vec<(Issue, Ephemeris)>>,
    /// Issues that the receiver had, each with the sample from which it had it, ascending; none where its
    /// file does not say samples.
    read: BTreeMap<(Sv, &'static str), Vec<(u64, u32)>>,
    /// The ionosphere's coefficients, where they were sent: one of a model.
    ionospheres: Vec<Coefficients>,
}

impl Message {
    /// Messages from a run's truth.
    pub fn of(run: &Run) -> Self {
        let Some(near) = run.trajectory.first().map(|row| row.time()) else { return Self::default() };
        let mut groups: BTreeMap<(Sv, &str, u32, u64), Vec<&NavigationRow>> = BTreeMap::new();
        for row in &run.truth_navigation {
            groups.entry((row.sv, &row.message, row.issue, row.sample)).or_default().push(row);
        }
        let mut message = Self::default();
        for ((sv, name, issue, due), rows) in &groups {
            // What an ephemeris has beside its issue is sent for all issues alike.
            let common = groups.get(&(*sv, *name, 0, 0)).into_iter().flatten();
            let all: Vec<&NavigationRow> = rows.iter().chain(common).copied().collect();
            let found = set(run, (*sv, name, *issue), &all, near);
            if let Some((name, set)) = found.filter(|(_, set)| u32::from(set.iode) == *issue) {
                message.sets.entry((*sv, name)).or_default().push(((*issue, *due), set));
            }
            if let Some(found) = ionosphere(run, (*sv, name), rows)
                && message.ionosphere(found.model()).is_none()
            {
                message.ionospheres.push(found);
            }
        }
        message.read = message.sets.keys().map(|of| (*of, read(run, *of))).collect();
        message
    }

    /// The coefficients of a model of the ionosphere, where they were sent.
    pub fn ionosphere(&self, model: Model) -> Option<&Coefficients> {
        self.ionospheres.iter().find(|sent| sent.model() == model)
    }

    /// True if no ephemeris of a satellite marks the signal as unhealthy.
    pub fn says_healthy(&self, link: Link) -> bool {
        let mut own = self.sets.iter().filter(|((sv, _), _)| *sv == link.sv).flat_map(|(_, sets)| sets);
        own.all(|(_, set)| set.is_healthy_on(link.signal) != Some(false))
    }

    /// Ephemeris of a satellite that serves a signal. It comes from the message that the signal carries
    /// first. It is the one that the receiver had read last at `sample`, or else the one whose reference time
    /// is nearest to `at`.
    pub fn ephemeris(&self, link: Link, (sample, at): (u64, Epoch)) -> Option<&Ephemeris> {
        let serves = |(_, set): &(Issue, Ephemeris)| (set.form.serves)(link.signal);
        let carried = |name: &str| link.signal.components.iter().any(|c| c.message.is_some_and(|m| m.name == name));
        let own = || self.sets.iter().filter(|((sv, _), sets)| *sv == link.sv && sets.iter().any(serves));
        let (of, sets) = own().find(|((_, name), _)| carried(name)).or_else(|| own().next())?;
        let last = self.read.get(of).and_then(|read| read.iter().rev().find(|(since, _)| *since <= sample));
        let issued = last.and_then(|(since, issue)| {
            let own = sets.iter().filter(|((other, due), _)| other == issue && due <= since);
            own.max_by_key(|((_, due), _)| *due)
        });
        let age_s = |(_, set): &&(Issue, Ephemeris)| at.since(set.toe).abs();
        issued.or_else(|| sets.iter().min_by(|a, b| age_s(a).total_cmp(&age_s(b)))).map(|(_, set)| set)
    }
}

/// Times at which the receiver completed the ephemerides of a satellite's message, with their issues.
fn read(run: &Run, (sv, name): (Sv, &str)) -> Vec<(u64, u32)> {
    // One that every ephemeris has.
    let of_message = messages(run, sv).find(|(message, _)| message.name == name);
    let of_sets = of_message.and_then(|(message, _)| message.fields.parameters().first().copied()).unwrap_or("");
    let own = |row: &&NavigationRow| row.sv == sv && row.message == name && row.parameter == of_sets;
    let mut said: Vec<(u64, u32)> = run.navigation.iter().filter(own).map(|row| (row.sample, row.issue)).collect();
    if said.iter().all(|(sample, _)| *sample == 0) {
        return Vec::new();
    }
    said.sort_unstable_by_key(|(sample, _)| *sample);
    let carried = |row: &EventRow| row.signal.components.iter().any(|c| c.message.is_some_and(|m| m.name == name));
    let completed = run.events.iter().filter(|row| row.sv == sv && row.event == Event::EphemerisComplete);
    let issue = |at: u64| said[..said.partition_point(|(sample, _)| *sample <= at)].last().map(|(_, issue)| *issue);
    completed.filter(|row| carried(row)).filter_map(|row| Some((row.sample, issue(row.sample)?))).collect()
}

/// Ephemeris in those rows, by the message of one of the satellite's signals that has that name.
fn set(
    run: &Run,
    (sv, name, issue): (Sv, &str, u32),
    rows: &[&NavigationRow],
    near: Epoch,
) -> Option<(&'static str, Ephemeris)> {
    messages(run, sv).filter(|(message, _)| message.name == name).find_map(|(message, time)| {
        // What bears an issue is never taken from another one.
        let bound = message.fields.parameters();
        let own = |row: &&&NavigationRow| row.issue == issue || !bound.contains(&row.parameter.as_str());
        let raw = |name: &str| rows.iter().filter(own).find(|row| row.parameter == name).map(|row| row.raw);
        let set = message.fields.elements(sv, &raw, time.label(near))?;
        Some((message.name, set.timed(|label| time.instant(label))))
    })
}

/// Messages of a satellite's signals in the truth, and by whose time they are sent.
fn messages(run: &Run, sv: Sv) -> impl Iterator<Item = (&'static Form, &'static TimeScale)> {
    let own = run.signals.iter().filter(move |signal| signal.system == sv.system);
    own.flat_map(|signal| signal.components.iter().filter_map(|c| Some((c.message?, signal.time))))
}

/// Ionospheric coefficients in those rows, by the message of that name.
fn ionosphere(run: &Run, (sv, name): (Sv, &str), rows: &[&NavigationRow]) -> Option<Coefficients> {
    let raw = |name: &str| rows.iter().find(|row| row.parameter == name).map(|row| row.raw);
    let (message, _) = messages(run, sv).find(|(message, _)| message.name == name)?;
    (message.ionosphere.coefficients)(&raw)
}

/// Names of the parameters of ephemerides that bear their issue, of each message of a satellite's signals.
pub fn orbit_parameters(run: &Run, sv: Sv) -> BTreeMap<&'static str, BTreeSet<&'static str>> {
    messages(run, sv).map(|(message, _)| (message.name, message.fields.parameters().into_iter().collect())).collect()
}
