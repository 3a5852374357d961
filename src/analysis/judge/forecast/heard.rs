//! Knowledge of a receiver about satellites, from its own events.

use std::collections::BTreeMap;

use crate::read::Run;
use gnss::message::Message;
use gnss::record::Event;
use gnss::satellite::Sv;
use gnss::signal::Link;

/// Samples from which each satellite's message is known, and intervals in which it marks a signal as
/// unhealthy.
pub struct Heard {
    /// Message of each satellite, complete or in short form, with the sample from which it is known.
    known: BTreeMap<(Sv, &'static str), (u64, &'static Message)>,
    whole: BTreeMap<Sv, u64>,
    health: BTreeMap<Link, Vec<(u64, bool)>>,
}

impl Heard {
    /// Knowledge that the events of a run give.
    pub fn of(run: &Run) -> Self {
        let mut heard = Self { known: BTreeMap::new(), whole: BTreeMap::new(), health: BTreeMap::new() };
        for row in &run.events {
            if matches!(row.event, Event::EphemerisComplete | Event::ReducedElements) {
                for message in row.signal.components.iter().filter_map(|component| component.message) {
                    heard.known.entry((row.sv, message.name)).or_insert((row.sample, message));
                }
            }
            match row.event {
                Event::EphemerisComplete => {
                    heard.whole.entry(row.sv).or_insert(row.sample);
                }
                Event::Unhealthy => heard.health.entry(row.link()).or_default().push((row.sample, false)),
                Event::Healthy => heard.health.entry(row.link()).or_default().push((row.sample, true)),
                _ => {}
            }
        }
        heard
    }

    /// True if a fix at that sample may use the signal of the satellite, by its messages.
    pub fn usable(&self, link: Link, sample: u64) -> bool {
        let mut own = self.known.iter().filter(|((sv, _), _)| *sv == link.sv).map(|(_, known)| known);
        let known = own.any(|(since, message)| *since <= sample && (message.sets.serves)(link.signal));
        let last = self.health.get(&link).and_then(|all| all.iter().rev().find(|(since, _)| *since <= sample));
        known && last.is_none_or(|(_, healthy)| *healthy)
    }

    /// True if more than the reduced elements of a satellite is known at that sample.
    pub fn is_whole(&self, sv: Sv, sample: u64) -> bool {
        self.whole.get(&sv).is_some_and(|since| *since <= sample)
    }
}
