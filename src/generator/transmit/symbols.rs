//! The data of a satellite: which code periods its messages invert.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::GenerateError;
use crate::message::{self, MessageFault, Sent as SentSymbols, Slot};
use crate::scene::Scene;
use crate::spoof::Constellation;
use gnss::message::Message;
use gnss::record::NavigationRow;
use gnss::satellite::Sv;
use gnss::signal::{Component, Signal};
use gnss::time::Epoch;

/// Symbols that a satellite sends in a segment of time.
pub struct Symbols {
    /// Units by their number since 1980-01-06T00:00:00 of the system's time, of each form of message.
    units: Vec<(&'static Message, BTreeMap<i64, Vec<bool>>)>,
    /// Navigation data that have been sent so far, each with the second after the start of the samples at
    /// which its set was due, 0 for those before.
    pub navigation: BTreeSet<(u32, NavigationRow)>,
}

/// Message symbols of a component: index of the form among the satellite's, and code periods per symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Data {
    form: usize,
    periods_per_symbol: i64,
}

impl Symbols {
    /// Creates the state for the messages of a signal, of which nothing has been sent.
    pub fn new(signal: &Signal) -> Self {
        let mut units: Vec<(&'static Message, BTreeMap<i64, Vec<bool>>)> = Vec::new();
        for message in signal.components.iter().filter_map(|component| component.message) {
            if units.iter().all(|(known, _)| *known != message) {
                units.push((message, BTreeMap::new()));
            }
        }
        Self { units, navigation: BTreeSet::new() }
    }

    /// True if nothing modulates the signal.
    pub fn is_empty(&self) -> bool {
        self.units.is_empty()
    }

    /// The data of a component; `None` for a pilot.
    pub fn of(&self, component: &Component) -> Option<Data> {
        let message = component.message?;
        let form = self.units.iter().position(|(known, _)| *known == message)?;
        Some(Data { form, periods_per_symbol: i64::from(component.periods_per_symbol()?) })
    }

    /// Prepares the symbols that `sv` sends from `first` to `last`, and drops earlier ones. A unit for which
    /// no ephemeris was uploaded carries the one of `received`.
    ///
    /// # Errors
    /// Errors of messages.
    pub fn prepare(
        &mut self,
        scene: &Scene,
        from: &Constellation,
        (sv, signal): (Sv, &Signal),
        [first, last]: [Epoch; 2],
        received: Epoch,
    ) -> Result<(), GenerateError> {
        let own = |fault: &&MessageFault| fault.constellation == from.number;
        let faults: Vec<MessageFault> = scene.message_faults.iter().filter(own).cloned().collect();
        let catalogue = scene.catalogue_of(from);
        let start = from.ahead(scene.clock.start);
        let messages = scene.messages.of_constellation(from.number);
        for (message, units) in &mut self.units {
            let Some(sender) = messages.of(message) else { continue };
            let number = |at: Epoch| message.unit_at(signal.time.label(at).seconds());
            let (first, last) = (number(first), number(last));
            *units = units.split_off(&first);
            for unit in first..=last {
                if units.contains_key(&unit) {
                    continue;
                }
                let slot = Slot { message, time: signal.time, unit };
                let fallback = || catalogue.sent_since(sv, received);
                let Some((since, ephemeris)) = catalogue.sent_since(sv, slot.set_chosen()).or_else(fallback) else {
                    continue;
                };
                let since_s = since.since(start).max(0.0).round() as u32;
                let earlier = Slot { unit: unit - 1, ..slot }.set_chosen();
                let before = catalogue.sent_at(sv, earlier).unwrap_or(ephemeris);
                let SentSymbols { encoded, symbols, restored } =
                    message::unit(&faults, sender, [before, ephemeris], &slot)?;
                // What was meant and, where wrong symbols pass for right ones, what was sent.
                let both = [&encoded, &symbols];
                let distinct = if symbols == encoded { 1 } else { 2 };
                let sent = both.into_iter().take(distinct).chain(&restored);
                for (of_set, parameters) in sent.filter_map(|sent| (message.parameters)(sent)) {
                    let (since_s, issue) =
                        if of_set { (since_s, u32::from((message.form)(ephemeris).iode)) } else { (0, 0) };
                    let rows = NavigationRow::each(sv, message.name, issue, parameters);
                    self.navigation.extend(rows.map(|row| (since_s, row)));
                }
                units.insert(unit, symbols);
            }
        }
        Ok(())
    }

    /// Sign of a component's code period, true if inverted, and the period at which its symbol ends. The
    /// periods before that one have the same sign.
    pub fn negative(&self, data: Option<Data>, period: i64) -> (bool, i64) {
        let Some(Data { form, periods_per_symbol }) = data else { return (false, i64::MAX) };
        let Some((message, units)) = self.units.get(form) else { return (false, i64::MAX) };
        let period = planted!("generator.synth.message_time", period, period + 1);
        let length = message.unit_symbols() as i64;
        // Units of a message need not begin where the week does.
        let before = (message.first_s as f64 / message.symbol_s).round() as i64;
        let since_first = period.div_euclid(periods_per_symbol);
        let (symbol, end) = (since_first - before, (since_first + 1) * periods_per_symbol);
        let Some(symbols) = units.get(&symbol.div_euclid(length)) else { return (false, end) };
        let place = symbol.rem_euclid(length) as usize;
        let place = planted!("generator.synth.bit_order", place, place / 30 * 30 + 29 - place % 30);
        (symbols.get(place).copied().unwrap_or(false), end)
    }
}
