//! Writer of Multiple Signal Messages.
//!
//! Source: RTCM 10403.3, 3.5.16. A message has whole milliseconds of its system's time, so an epoch between
//! two of them is given as if the receiver's clock had read the nearest one: ranges and carriers grow by the
//! same time. Each carrier has whole cycles taken from it that bring it near its code, the same ones as long
//! as it is locked; where it leaves the field's range, it is brought near again and its lock begins again
//! (DF406). A satellite's rough range is the middle of its signals'. Values beyond their fields are sent as
//! not known, C/N0 above its field too. Satellites times signals above 64 cells make several messages.

use std::collections::BTreeMap;

use super::{HEAD, Kind, MOST_CELLS, NO_RANGE, SATELLITE};
use crate::bits::Writer;
use crate::observed::{Observed, ObservedEpoch};
use crate::rtcm::field::Refused;
use crate::rtcm::signals;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::glonass::fdma;
use gnss::satellite::{Sv, System};
use gnss::time::{BDT, Epoch, GLONASST};

/// Metres of a millisecond of light.
const MS_M: f64 = 1e-3 * SPEED_OF_LIGHT_MPS;
/// Largest difference in seconds between two counts of one lock.
const SAME_S: f64 = 5e-4;
/// Seconds at which counts of lock times end in receivers that count least.
const LEAST_S: f64 = 64.0;
/// Longest gap in seconds that a carrier without a lock time survives.
const GAP_S: f64 = 30.0;
/// Largest indicators of a lock time: of MSM4 and 5, of MSM6 and 7.
const LARGEST_LOCK: [i64; 2] = [15, 704];

/// Carriers in the writing, by satellite and signal.
#[derive(Clone, Debug, Default)]
pub struct Arcs {
    known: BTreeMap<(Sv, &'static str), Arc>,
}

/// Carrier since its lock began.
#[derive(Clone, Copy, Debug)]
struct Arc {
    /// Whole cycles that are taken from it.
    cycles: f64,
    /// Time from which its lock is counted.
    since: Epoch,
    /// Lock time of the epoch before in seconds, and that epoch.
    lock_s: f64,
    at: Epoch,
}

/// One signal of a satellite as it is sent.
struct Cell {
    bit: u8,
    fine: [i64; 6],
}

/// One satellite as it is sent.
struct Row {
    bit: u8,
    rough: [i64; 4],
    cells: Vec<Cell>,
}

/// Message without its flag for further ones.
pub struct Draft {
    kind: Kind,
    time: u64,
    rows: Vec<Row>,
    signals: Vec<u8>,
}

/// A signal with values that belong to a whole millisecond.
struct Value<'a> {
    own: &'a Observed,
    bit: u8,
    code: &'static str,
    range_ms: Option<f64>,
    cycles: Option<f64>,
    wave_m: f64,
    rate_mps: Option<f64>,
}

/// Time of a message of a system: milliseconds of its week, of GLONASS day of the week and milliseconds of it
/// (DF004, DF416 and DF034, DF248, DF427, DF428, DF546).
fn time_field(system: System, label: Epoch) -> u64 {
    let ms = |at: Epoch| 1000 * at.tow_whole_s() + (at.fraction() * 1e3).round() as i64;
    let number = match system {
        System::BeiDou => ms(BDT.label(label)),
        System::Glonass => {
            let ms = ms(GLONASST.label(label));
            ((ms / 86_400_000) << 27) | (ms % 86_400_000)
        }
        _ => ms(label),
    };
    number as u64
}

/// Nearest whole millisecond to a label, and by how many seconds it is later.
fn rounded(label: Epoch) -> (Epoch, f64) {
    let ms = (label.fraction() * 1e3).round();
    let whole = Epoch::new(label.seconds(), ms * 1e-3);
    (whole, whole.since(label))
}

/// Messages of one system at one epoch; those of a value that is left out are refused.
pub fn drafts(kind: Kind, epoch: &ObservedEpoch, arcs: &mut Arcs, refused: &mut Vec<Refused>) -> Vec<Draft> {
    let (label, later_s) = rounded(epoch.label);
    let mut satellites: BTreeMap<u8, Vec<Value<'_>>> = BTreeMap::new();
    for own in epoch.values.iter().filter(|own| own.sv.system == kind.system) {
        match value(own, later_s) {
            Ok((satellite, value)) => satellites.entry(satellite).or_default().push(value),
            Err(reason) => refused.push(reason),
        }
    }
    let mut rows = Vec::new();
    for (bit, mut values) in satellites {
        values.sort_by_key(|value| value.bit);
        values.dedup_by_key(|value| value.bit);
        match kind.satellite(bit, &values, label, arcs) {
            Ok(row) => rows.push(row),
            Err(reason) => refused.push(reason),
        }
    }
    let mut signals: Vec<u8> = rows.iter().flat_map(|row| row.cells.iter().map(|cell| cell.bit)).collect();
    signals.sort_unstable();
    signals.dedup();
    let time = time_field(kind.system, label);
    let most = MOST_CELLS / signals.len().max(1);
    let mut drafts = Vec::new();
    while !rows.is_empty() {
        let rest = rows.split_off(most.min(rows.len()));
        drafts.push(Draft { kind, time, rows: std::mem::replace(&mut rows, rest), signals: signals.clone() });
    }
    drafts
}

/// A value and its satellite's bit, `later_s` later by the receiver's clock.
fn value(own: &Observed, later_s: f64) -> Result<(u8, Value<'_>), Refused> {
    let satellite = signals::satellite_bit(own.sv).ok_or(Refused::Satellite(own.sv))?;
    let signal = signals::signal_bit(own.sv.system, own.code);
    let (bit, code) = signal.ok_or_else(|| Refused::Signal { sv: own.sv, code: own.code.to_owned() })?;
    let carrier_hz = signals::carrier_hz(own.sv, code, None).ok_or(Refused::Channel(own.sv))?;
    let known = |value: Option<f64>| value.filter(|value| value.is_finite());
    let wave_m = SPEED_OF_LIGHT_MPS / carrier_hz;
    let range_ms = known(own.pseudorange_m).map(|metres| metres / MS_M + 1e3 * later_s);
    let cycles = known(own.carrier_cycles).map(|cycles| cycles + later_s * carrier_hz);
    let rate_mps = known(own.doppler_hz).map(|hz| -hz * wave_m);
    Ok((satellite, Value { own, bit, code, range_ms, cycles, wave_m, rate_mps }))
}

/// Middle of the extremes of some values.
fn middle(values: impl Iterator<Item = f64>) -> Option<f64> {
    let ends = values.fold(None, |ends: Option<(f64, f64)>, value| {
        Some(ends.map_or((value, value), |(least, most)| (least.min(value), most.max(value))))
    });
    ends.map(|(least, most)| f64::midpoint(least, most))
}

impl Kind {
    /// Fields of a satellite.
    fn satellite(self, bit: u8, values: &[Value<'_>], label: Epoch, arcs: &mut Arcs) -> Result<Row, Refused> {
        let sv = values.first().map(|value| value.own.sv).ok_or(Refused::Missing("DF394"))?;
        let range_ms = middle(values.iter().filter_map(|value| value.range_ms)).ok_or(Refused::NoRange(sv))?;
        let rough = (range_ms * 1024.0).round();
        if !(0.0..NO_RANGE as f64 * 1024.0).contains(&rough) {
            return Err(Refused::Far { sv, range_ms });
        }
        let rough_rate = middle(values.iter().filter_map(|value| value.rate_mps)).map(f64::round);
        let rough_rate = rough_rate.filter(|rate| rate.abs() <= largest(SATELLITE[3]));
        let extended = match sv.system {
            System::Glonass => fdma::channel(sv.number).map_or(15, |channel| i64::from(channel) + 7),
            _ => 0,
        };
        let no_rate = -1 << (SATELLITE[3] - 1);
        let whole = rough as i64;
        let parts = [whole >> 10, extended, whole & 1023, rough_rate.map_or(no_rate, |rate| rate as i64)];
        let [_, _, _, _, power_width, rate_width] = self.widths();
        let [_, _, power_scale] = self.scales();
        let mut cells = Vec::new();
        for value in values {
            let ([code, carrier], lock_s) = self.ranges(value, rough / 1024.0, label, arcs);
            let power = value.own.cn0_dbhz.map_or(0.0, |power| (power / power_scale).round());
            // Zero means that there is none.
            let power = if (0.0..(1_i64 << power_width) as f64).contains(&power) { power as i64 } else { 0 };
            let fine_rate = value.rate_mps.zip(rough_rate).map(|(rate, rough)| (rate - rough) * 1e4);
            let half = i64::from(value.own.half_cycle_ambiguous);
            let fine = [code, carrier, self.indicator(lock_s), half, power, sent(fine_rate, rate_width)];
            cells.push(Cell { bit: value.bit, fine });
        }
        Ok(Row { bit, rough: parts, cells })
    }

    /// Fine code and carrier of a signal beside a rough range in milliseconds, and the lock time in seconds.
    fn ranges(self, value: &Value<'_>, rough_ms: f64, label: Epoch, arcs: &mut Arcs) -> ([i64; 2], f64) {
        let [code_width, carrier_width, ..] = self.widths();
        let [code_scale, carrier_scale, _] = self.scales();
        let code = sent(value.range_ms.map(|range| (range - rough_ms) / code_scale), code_width);
        let key = (value.own.sv, value.code);
        let Some(cycles) = value.cycles else {
            arcs.known.remove(&key);
            return ([code, sent(None, carrier_width)], 0.0);
        };
        let near_cycles = value.range_ms.unwrap_or(rough_ms) * MS_M / value.wave_m;
        let fine = |arc: Arc| ((cycles - arc.cycles) * value.wave_m / MS_M - rough_ms) / carrier_scale;
        let told_s = value.own.lock_s.filter(|lock_s| lock_s.is_finite());
        let begun = |since: Epoch| Arc { cycles: (cycles - near_cycles).round(), since, lock_s: 0.0, at: label };
        let before = arcs.known.get(&key).copied();
        let kept = before.filter(|arc| {
            let since_s = label.since(arc.at);
            let is_new = match told_s {
                Some(lock_s) => lock_s < arc.lock_s - SAME_S || lock_s < since_s.min(LEAST_S) - SAME_S,
                None => since_s > GAP_S,
            };
            !value.own.lost_lock && !is_new
        });
        let arc = match kept {
            None => begun(told_s.map_or(label, |lock_s| label.plus_s(-lock_s))),
            Some(arc) if fine(arc).abs() > largest(carrier_width) => begun(label),
            Some(arc) => arc,
        };
        let lock_s = label.since(arc.since).min(told_s.unwrap_or(f64::INFINITY)).max(0.0);
        arcs.known.insert(key, Arc { lock_s: told_s.unwrap_or(lock_s), at: label, ..arc });
        ([code, sent(Some(fine(arc)), carrier_width)], lock_s)
    }

    /// Largest indicator whose lock time is not above this one, in seconds.
    fn indicator(self, lock_s: f64) -> i64 {
        let lock_ms = (lock_s * 1e3 + 1e-6).floor();
        let largest = LARGEST_LOCK[usize::from(self.is_fine())];
        let mut below = 0;
        let mut above = largest + 1;
        while above - below > 1 {
            let middle = i64::midpoint(below, above);
            if self.lock_ms(middle) as f64 <= lock_ms { below = middle } else { above = middle }
        }
        below
    }
}

/// Largest size of a number of so many bits in two's complement that says something.
fn largest(width: usize) -> f64 {
    ((1_i64 << (width - 1)) - 1) as f64
}

/// Nearest integer of a value; the least one, which says that there is none, where it does not fit.
fn sent(value: Option<f64>, width: usize) -> i64 {
    let whole = value.map(f64::round).filter(|whole| whole.abs() <= largest(width));
    whole.map_or(-1 << (width - 1), |whole| whole as i64)
}

impl Draft {
    /// Number of the message.
    pub fn number(&self) -> u64 {
        self.kind.number()
    }

    /// Bytes of the message of a station; `more` states that others of the same time follow (DF393).
    pub fn write(&self, station: u16, more: bool) -> Vec<u8> {
        let mut into = Writer::default();
        for (column, width) in HEAD {
            let value = match column {
                "DF002" => self.kind.number() as i64,
                "DF003" => i64::from(station),
                "epoch" => self.time as i64,
                "DF393" => i64::from(more),
                _ => 0,
            };
            into.put(value, width);
        }
        let mask =
            |all: &mut dyn Iterator<Item = u8>, width: u8| all.fold(0, |mask: u64, bit| mask | 1 << (width - bit));
        into.put(mask(&mut self.rows.iter().map(|row| row.bit), 64) as i64, 64);
        into.put(mask(&mut self.signals.iter().copied(), 32) as i64, 32);
        for row in &self.rows {
            for signal in &self.signals {
                into.put(i64::from(row.cells.iter().any(|cell| cell.bit == *signal)), 1);
            }
        }
        for (field, width) in SATELLITE.into_iter().enumerate() {
            if self.kind.has_rates() || !matches!(field, 1 | 3) {
                self.rows.iter().for_each(|row| into.put(row.rough[field], width));
            }
        }
        for (field, width) in self.kind.widths().into_iter().enumerate() {
            if self.kind.has_rates() || field != 5 {
                let cells = self.rows.iter().flat_map(|row| &row.cells);
                cells.for_each(|cell| into.put(cell.fine[field], width));
            }
        }
        into.into_bytes()
    }
}

#[cfg(test)]
#[path = "write_tests.rs"]
mod tests;
