//! Statistics of a live run: counts, ages and rates, once a second as a line of JSON and at the end.

use std::mem::{Discriminant, discriminant};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use generator::vehicle::joining::{Kind, Refusal, Tick};
use gnss::time::Rate;

/// Width of a bin of ages.
const BIN: Duration = Duration::from_micros(100);
/// Number of bins; older ages count in the last.
const BINS: usize = 5000;
/// Least time over which the sink's rate is measured, seconds.
const SETTLED_S: f64 = 5.0;

/// Ages in bins.
pub struct Ages {
    bins: Vec<u64>,
    count: u64,
    largest: Duration,
}

impl Default for Ages {
    fn default() -> Self {
        Self { bins: vec![0; BINS], count: 0, largest: Duration::ZERO }
    }
}

impl Ages {
    pub fn add(&mut self, age: Duration) {
        let bin = (age.as_nanos() / BIN.as_nanos()).min(BINS as u128 - 1) as usize;
        if let Some(bin) = self.bins.get_mut(bin) {
            *bin += 1;
        }
        self.count += 1;
        self.largest = self.largest.max(age);
    }

    /// The age in milliseconds that so great a share does not exceed, to the bin.
    fn quantile_ms(&self, share: f64) -> Option<f64> {
        let wanted = (share * self.count as f64).ceil().max(1.0) as u64;
        let mut sum = 0;
        let bin = self.bins.iter().position(|count| {
            sum += count;
            sum >= wanted
        })?;
        let upper_ms = (bin as f64 + 1.0) * BIN.as_secs_f64() * 1e3;
        Some(upper_ms.min(self.largest.as_secs_f64() * 1e3))
    }

    fn json(&self) -> Value {
        let rounded = |ms: f64| (ms * 1e3).round() / 1e3;
        json!({
            "count": self.count,
            "p50": self.quantile_ms(0.5).map(rounded),
            "p99": self.quantile_ms(0.99).map(rounded),
            "max": (self.count > 0).then(|| rounded(self.largest.as_secs_f64() * 1e3)),
        })
    }
}

/// Counts of the first sink's thread.
#[derive(Default)]
pub struct Handed {
    /// Number of samples handed over.
    pub samples: u64,
    /// Time of the first of them.
    pub since: Option<Instant>,
    /// Time of the last of them.
    pub until: Option<Instant>,
    /// Times at which the sink wanted samples that were not there.
    pub underruns: u64,
    /// Writes that took longer than the sink's samples in the ring last.
    pub stalls: u64,
    pub longest_write: Duration,
    /// Clients that left, and blocks that were lost until another one came.
    pub clients_left: u64,
    pub lost_blocks: u64,
    /// Ages from a push's arrival until its first sample was handed over.
    pub ages: Ages,
}

/// Inputs that were received but not used.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Intake {
    pub messages: u64,
    /// Number of messages that are malformed, by length or contents.
    pub malformed: u64,
    /// Description of the first malformed message.
    pub first_malformed: Option<String>,
    /// Messages from another sender than the one that is heard.
    pub strangers: u64,
    /// Too many at once.
    pub dropped: u64,
}

/// Counts of the generator's side.
#[derive(Default)]
pub struct Made {
    pub samples: u64,
    pub waiting: u64,
    pub fresh: u64,
    pub extrapolated: u64,
    pub snaps: u64,
    /// First sample of the last snap.
    pub last_snap: Option<u64>,
    pub worst_gap_m: f64,
    /// Largest jerk over ticks that are not snaps, m/s³.
    pub worst_jerk_mps3: f64,
    /// Number of pushes that were taken.
    pub taken: u64,
    /// Number of pushes whose time had been sent more than the joining time before.
    pub late: u64,
    /// Number of states with an attitude that turns the body.
    pub attitudes: u64,
    /// Number of states with an attitude that the scene does not use.
    pub attitudes_not_used: u64,
    /// Offset that was added to the times of states, seconds.
    pub offset_s: Option<f64>,
    /// Refused by what they say, and the last reason.
    pub duplicates: u64,
    pub out_of_order: u64,
    pub before_start: u64,
    pub ahead: u64,
    pub not_finite: u64,
    pub refused: u64,
    pub last_refusal: Option<String>,
    /// Kinds of refusals so far.
    kinds: Vec<Discriminant<Refusal>>,
    pub events: u64,
    pub events_refused: u64,
    /// Fewest blocks that waited for the first sink in the second.
    pub low_water: Option<usize>,
    /// Number of blocks dropped before other sinks.
    pub dropped_blocks: u64,
    /// Longest time that a tick took to make.
    pub slowest_tick: Duration,
}

impl Made {
    pub fn tick(&mut self, first: u64, end: u64, tick: Option<&Tick>) {
        self.samples = end;
        let Some(tick) = tick else { return };
        match tick.kind {
            Kind::Waiting => self.waiting += 1,
            Kind::Fresh => self.fresh += 1,
            Kind::Extrapolated => self.extrapolated += 1,
            Kind::Snap => {
                self.snaps += 1;
                self.last_snap = Some(first);
            }
        }
        self.worst_gap_m = self.worst_gap_m.max(tick.gap_m);
        if tick.kind != Kind::Snap {
            self.worst_jerk_mps3 = self.worst_jerk_mps3.max(tick.jerk_mps3);
        }
    }

    /// Counts a refusal; true for the first one of its kind.
    pub fn refuse(&mut self, refusal: &Refusal) -> bool {
        match refusal {
            Refusal::Duplicate(_) => self.duplicates += 1,
            Refusal::OutOfOrder(..) => self.out_of_order += 1,
            Refusal::BeforeStart(_) => self.before_start += 1,
            Refusal::Ahead(..) => self.ahead += 1,
            Refusal::NotFinite => self.not_finite += 1,
            _ => self.refused += 1,
        }
        self.last_refusal = Some(refusal.to_string());
        let kind = discriminant(refusal);
        let is_new = !self.kinds.contains(&kind);
        if is_new {
            self.kinds.push(kind);
        }
        is_new
    }

    /// One object with everything.
    pub fn json(&self, rate: Rate, handed: &Handed, intake: &Intake) -> Value {
        json!({
            "t_s": rate.elapsed_s(self.samples),
            "made": self.samples,
            "handed": handed.samples,
            "low_water": self.low_water,
            "underruns": handed.underruns,
            "stalls": handed.stalls,
            "clients_left": handed.clients_left,
            "lost_blocks": handed.lost_blocks,
            "longest_write_ms": handed.longest_write.as_secs_f64() * 1e3,
            "dropped_blocks": self.dropped_blocks,
            "slowest_tick_ms": self.slowest_tick.as_secs_f64() * 1e3,
            "sink_ppm": drift_ppm(rate, handed),
            "age_ms": handed.ages.json(),
            "ticks": {
                "fresh": self.fresh,
                "extrapolated": self.extrapolated,
                "snap": self.snaps,
                "waiting": self.waiting,
                "last_snap": self.last_snap,
                "worst_gap_m": self.worst_gap_m,
                "worst_jerk_mps3": self.worst_jerk_mps3,
            },
            "motion": {
                "messages": intake.messages,
                "taken": self.taken,
                "late": self.late,
                "duplicates": self.duplicates,
                "out_of_order": self.out_of_order,
                "before_start": self.before_start,
                "ahead": self.ahead,
                "not_finite": self.not_finite,
                "refused": self.refused,
                "last_refusal": self.last_refusal,
                "malformed": intake.malformed,
                "first_malformed": intake.first_malformed,
                "strangers": intake.strangers,
                "dropped": intake.dropped,
                "attitudes": self.attitudes,
                "attitudes_not_used": self.attitudes_not_used,
                "offset_s": self.offset_s,
            },
            "events": { "applied": self.events, "refused": self.events_refused },
        })
    }
}

/// Excess of the sink's rate over the host's clock in parts per million; `None` until it is measured.
fn drift_ppm(rate: Rate, handed: &Handed) -> Option<f64> {
    let elapsed_s = handed.until?.duration_since(handed.since?).as_secs_f64();
    (elapsed_s >= SETTLED_S).then(|| (rate.elapsed_s(handed.samples) / elapsed_s - 1.0) * 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_ages_are_right_to_a_bin() {
        let mut ages = Ages::default();
        assert_eq!(ages.json()["p99"], Value::Null);
        (1..=1000).for_each(|k| ages.add(Duration::from_micros(10 * k)));
        assert_eq!(ages.json(), json!({ "count": 1000, "p50": 5.1, "p99": 10.0, "max": 10.0 }));
        ages.add(Duration::from_secs(100));
        assert_eq!(ages.json()["max"], 100_000.0);
    }
}
