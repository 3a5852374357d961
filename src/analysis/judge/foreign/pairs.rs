//! A foreign receiver's observations joined with the truth at their labels.

use std::collections::BTreeMap;

use crate::expect::timeline::{State, Timeline};
use crate::read::rinex_obs::{ObservedEpoch, Values};
use gnss::satellite::System;
use gnss::signal::{self, Link, Signal};

/// One observation and the truth at its time.
#[derive(Clone, Debug)]
pub(super) struct Pair<'a> {
    pub epoch: usize,
    pub label_s: f64,
    /// Time of reception, by the truth's time in seconds.
    pub at_s: f64,
    pub link: Link,
    pub values: &'a Values,
    pub truth: State,
}

impl Pair<'_> {
    /// Error of the pseudorange, the receiver's clock still in.
    pub fn code_m(&self) -> Option<f64> {
        Some(self.values.pseudorange_m? - self.truth.range_m)
    }
}

/// Every observation whose satellite and time the truth has; an epoch's label is late by `late_s` of its
/// number.
pub(super) fn join<'a>(
    epochs: &'a [ObservedEpoch],
    timeline: &Timeline,
    label: impl Fn(&ObservedEpoch) -> f64,
    late_s: impl Fn(usize) -> f64,
) -> Vec<Pair<'a>> {
    let signals = signal::all();
    let mut pairs = Vec::new();
    for (number, epoch) in epochs.iter().enumerate() {
        let label_s = label(epoch);
        let at_s = label_s - late_s(number);
        for ((sv, code), values) in &epoch.values {
            let code = whole(sv.system, code);
            let signal = signals.iter().find(|signal| signal.system == sv.system && signal.rinex == code);
            let Some(signal) = signal else { continue };
            let link = Link { sv: *sv, signal };
            if let Some(truth) = timeline.state(&link, at_s) {
                pairs.push(Pair { epoch: number, label_s, at_s, link, values, truth });
            }
        }
    }
    pairs
}

/// The code of a signal by that of a component or of both: E1's data are 1B, data and pilot 1X (RINEX 4.02,
/// table 14). What RINEX 2 observes has an X where it does not say which component it is.
fn whole(system: System, code: &str) -> &str {
    match (system, code) {
        (System::Galileo, "1B" | "1X") => "1C",
        (System::Galileo, "6X") => "6C",
        (System::Galileo, "7X") => "7Q",
        (System::Galileo, "8X") => "8Q",
        (System::Gps | System::Qzss, "2X") => "2L",
        (System::Gps | System::Qzss | System::Galileo, "5X") => "5Q",
        _ => code,
    }
}

/// Splits pairs, which ascend by epoch, into epochs.
pub(super) fn by_epoch<'p, 'a>(pairs: &'p [Pair<'a>]) -> impl Iterator<Item = &'p [Pair<'a>]> {
    pairs.chunk_by(|a, b| a.epoch == b.epoch)
}

/// Something of each epoch and signal, by epoch number.
pub(super) type BySignal = BTreeMap<(usize, &'static Signal), f64>;

/// Pairs of each epoch and signal. Signals are separate, because a receiver's delays differ by signal.
pub(super) fn by_signal<'p, 'a>(pairs: &'p [Pair<'a>]) -> impl Iterator<Item = Vec<&'p Pair<'a>>> {
    by_epoch(pairs).flat_map(|epoch| {
        let mut groups: BTreeMap<&'static Signal, Vec<&'p Pair<'a>>> = BTreeMap::new();
        epoch.iter().for_each(|pair| groups.entry(pair.link.signal).or_default().push(pair));
        groups.into_values()
    })
}

impl Pair<'_> {
    /// Epoch and signal of the pair.
    pub fn group(&self) -> (usize, &'static Signal) {
        (self.epoch, self.link.signal)
    }
}
