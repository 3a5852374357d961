//! Multiple Signal Messages: observations of one system at one epoch (RTCM 10403.3, 3.5.16).
//!
//! A range is given in three parts: whole milliseconds and a fraction of 1/1024 ms of the satellite, and a
//! fine part of each signal; the fine parts of code and carrier are independent. Lock times are bounds below
//! the true ones. The carrier of GLONASS needs the channel of the satellite, which MSM5 and MSM7 have; of
//! MSM4 and MSM6 it is the one that the slot has by [`gnss::glonass::fdma`]. [`mod@write`] writes what
//! [`Kind::read`] reads, by the same widths and scales.

pub mod write;

use super::signals;
use crate::bits::Bits;
use crate::observed::{Calendar, Event, Locks, Observed, ObservedEpoch};
use crate::table::{Table, Value};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::{Sv, System};
use gnss::time::{Epoch, WEEK_S};

/// Kind of a message.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    system: System,
    /// Number of the message, and its last digit: 4 to 7.
    name: &'static str,
    level: u64,
}

/// A message that was read.
#[derive(Clone, Debug)]
pub struct Message {
    kind: Kind,
    /// Time as sent: milliseconds of the week; of GLONASS the day of the week before milliseconds of the day.
    time: u64,
    values: Vec<Observed>,
    /// Fields, one row for each signal.
    pub table: Table,
}

/// GPS time minus the time of BeiDou, seconds (BDS-SIS-ICD-B1I 3.0, 3.3).
const BDT_BEHIND_S: i64 = 14;
/// Fields before the masks with their widths in bits; reserved ones have no name (table 3.5-78).
const HEAD: [(&str, usize); 10] = [
    ("DF002", 12),
    ("DF003", 12),
    ("epoch", 30),
    ("DF393", 1),
    ("DF409", 3),
    ("", 7),
    ("DF411", 2),
    ("DF412", 2),
    ("DF417", 1),
    ("DF418", 3),
];
/// Index of the time among them.
const TIME: usize = 2;
/// Widths of whole milliseconds, extended information, fraction and rate of a satellite (table 3.5-80).
const SATELLITE: [usize; 4] = [8, 4, 10, 14];
/// Whole milliseconds that say that there is no range.
const NO_RANGE: u64 = 255;
/// Most cells of a mask.
const MOST_CELLS: usize = 64;

/// Parts of one satellite.
#[derive(Clone, Copy, Debug, Default)]
struct Satellite {
    number: u8,
    /// Whole milliseconds of the range (DF397); none where it is not valid.
    whole_ms: Option<u64>,
    /// Extended information, or of GLONASS the channel plus 7 (DF419).
    extended: Option<u64>,
    /// Fraction of the range in 1/1024 ms (DF398).
    fraction: u64,
    /// Rough rate of the range, m/s (DF399).
    rate_mps: Option<i64>,
}

impl Kind {
    /// Kind of a message with this number.
    pub fn of(number: u64) -> Option<Self> {
        let (_, system, names) = signals::SYSTEMS.into_iter().find(|(tens, ..)| *tens == number / 10)?;
        let level = number % 10;
        let name = names.into_iter().nth(usize::try_from(level.checked_sub(4)?).ok()?)?;
        Some(Self { system, name, level })
    }

    /// Number of the message.
    pub fn number(self) -> u64 {
        let tens = signals::SYSTEMS.into_iter().find(|(_, system, _)| *system == self.system);
        tens.map_or(0, |(tens, ..)| 10 * tens + self.level)
    }

    /// System of the satellites.
    pub fn system(self) -> System {
        self.system
    }

    /// Fields and observations of a message's bytes; none where the message ends too early.
    pub fn read(self, body: &[u8]) -> Option<Message> {
        let mut bits = Bits::new(body);
        let mut head = Vec::new();
        let mut columns = Vec::new();
        for (column, count) in HEAD {
            let number = bits.unsigned(count)?;
            if !column.is_empty() {
                columns.push(column);
                head.push(Value::Integer(number as i64));
            }
        }
        let time = match head.get(TIME) {
            Some(Value::Integer(time)) => *time as u64,
            _ => return None,
        };
        let (satellites, signals) = (bits.unsigned(64)?, bits.unsigned(32)?);
        let numbers: Vec<u8> = (1..=64).filter(|number| satellites >> (64 - number) & 1 == 1).collect();
        let signals: Vec<u8> = (1..=32).filter(|number| signals >> (32 - number) & 1 == 1).collect();
        let count = numbers.len() * signals.len();
        if count > MOST_CELLS {
            return None;
        }
        let mask = bits.unsigned(count)?;
        let satellites = self.satellites(&mut bits, &numbers)?;
        let all = satellites.iter().flat_map(|satellite| signals.iter().map(move |signal| (*satellite, *signal)));
        let is_there = |place: usize| mask >> (count - 1 - place) & 1 == 1;
        let cells: Vec<(Satellite, u8)> =
            all.enumerate().filter(|(place, _)| is_there(*place)).map(|(_, cell)| cell).collect();
        let fine = self.fine(&mut bits, cells.len())?;
        columns.extend(["sv", "signal", "DF397", "extended", "DF398", "DF399"]);
        columns.extend(self.fine_columns());
        let mut table = Table { name: self.name, columns, rows: Vec::new() };
        let mut values = Vec::new();
        for (index, (satellite, signal)) in cells.into_iter().enumerate() {
            let sv = signals::satellite(self.system, satellite.number);
            let code = signals::code(self.system, signal);
            let of = |list: &[Option<i64>]| list.get(index).copied().flatten();
            let own = fine.each_ref().map(|list| of(list));
            table.rows.push(self.row(&head, satellite, sv, code.unwrap_or(""), own));
            if let (Some(sv), Some(code)) = (sv, code) {
                values.push(self.observed(sv, code, satellite, own));
            }
        }
        if table.rows.is_empty() {
            let mut row = head;
            row.resize(table.columns.len(), Value::Absent);
            table.rows.push(row);
        }
        Some(Message { kind: self, time, values, table })
    }

    fn has_rates(self) -> bool {
        matches!(self.level, 5 | 7)
    }

    fn is_fine(self) -> bool {
        self.level >= 6
    }

    /// Parts of each satellite, field by field.
    fn satellites(self, bits: &mut Bits<'_>, numbers: &[u8]) -> Option<Vec<Satellite>> {
        let mut all: Vec<Satellite> =
            numbers.iter().map(|number| Satellite { number: *number, ..Satellite::default() }).collect();
        let [whole, extended, fraction, rate] = SATELLITE;
        for own in &mut all {
            own.whole_ms = Some(bits.unsigned(whole)?).filter(|whole| *whole != NO_RANGE);
        }
        if self.has_rates() {
            for own in &mut all {
                own.extended = Some(bits.unsigned(extended)?);
            }
        }
        for own in &mut all {
            own.fraction = bits.unsigned(fraction)?;
        }
        if self.has_rates() {
            for own in &mut all {
                own.rate_mps = Some(bits.signed(rate)?).filter(|sent| *sent != -1 << (rate - 1));
            }
        }
        Some(all)
    }

    /// Fine code, fine carrier, lock indicator, half-cycle flag, C/N0 and fine rate of each signal as sent;
    /// none where a value is marked as not there.
    fn fine(self, bits: &mut Bits<'_>, cells: usize) -> Option<[Vec<Option<i64>>; 6]> {
        let widths = self.widths();
        let mut found: [Vec<Option<i64>>; 6] = Default::default();
        for (field, (list, width)) in found.iter_mut().zip(widths).enumerate() {
            if field == 5 && !self.has_rates() {
                continue;
            }
            for _ in 0..cells {
                let is_signed = matches!(field, 0 | 1 | 5);
                let value = if is_signed { bits.signed(width)? } else { bits.unsigned(width)? as i64 };
                let is_absent = is_signed && value == -1 << (width - 1) || field == 4 && value == 0;
                list.push(Some(value).filter(|_| !is_absent));
            }
        }
        Some(found)
    }

    /// Widths in bits of the fields of a signal: of MSM4 and 5, of MSM6 and 7 (tables 3.5-82 to 3.5-87).
    fn widths(self) -> [usize; 6] {
        if self.is_fine() { [20, 24, 10, 1, 10, 15] } else { [15, 22, 4, 1, 6, 15] }
    }

    fn fine_columns(self) -> [&'static str; 6] {
        if self.is_fine() {
            ["DF405", "DF406", "DF407", "DF420", "DF408", "DF404"]
        } else {
            ["DF400", "DF401", "DF402", "DF420", "DF403", "DF404"]
        }
    }

    /// Scales of fine code and carrier in milliseconds, of C/N0 in dB-Hz.
    fn scales(self) -> [f64; 3] {
        let of = |halvings: u32| 1.0 / f64::from(1_u32 << halvings);
        let of_carrier = planted!("logs.rtcm.carrier_scale", 31, 30);
        if self.is_fine() { [of(29), of(of_carrier), 0.0625] } else { [of(24), of(29), 1.0] }
    }

    fn row(
        &self,
        head: &[Value],
        satellite: Satellite,
        sv: Option<Sv>,
        code: &str,
        fine: [Option<i64>; 6],
    ) -> Vec<Value> {
        let integer = |value: Option<u64>| value.map_or(Value::Absent, |value| Value::Integer(value as i64));
        let real =
            |value: Option<i64>, scale: f64| value.map_or(Value::Absent, |value| Value::Real(value as f64 * scale));
        let [code_scale, carrier_scale, power_scale] = self.scales();
        let mut row = head.to_vec();
        row.push(Value::Text(sv.map_or_else(String::new, |sv| sv.to_string())));
        row.push(Value::Text(code.to_owned()));
        row.push(integer(satellite.whole_ms));
        row.push(integer(satellite.extended));
        row.push(Value::Real(satellite.fraction as f64 / 1024.0));
        row.push(satellite.rate_mps.map_or(Value::Absent, Value::Integer));
        row.push(real(fine[0], code_scale));
        row.push(real(fine[1], carrier_scale));
        row.push(fine[2].map_or(Value::Absent, Value::Integer));
        row.push(fine[3].map_or(Value::Absent, Value::Integer));
        row.push(real(fine[4], power_scale));
        row.push(real(fine[5], 1e-4));
        row
    }

    fn observed(&self, sv: Sv, code: &'static str, satellite: Satellite, fine: [Option<i64>; 6]) -> Observed {
        let [code_scale, carrier_scale, power_scale] = self.scales();
        let rough_ms = satellite.whole_ms.map(|whole| whole as f64 + satellite.fraction as f64 / 1024.0);
        let metres = |part: Option<i64>, scale: f64| {
            rough_ms.zip(part).map(|(rough_ms, part)| (rough_ms + part as f64 * scale) * 1e-3 * SPEED_OF_LIGHT_MPS)
        };
        let channel = satellite
            .extended
            .filter(|number| *number <= 13)
            .map(|number| planted!("logs.rtcm.channel", number as i8 - 7, 7 - number as i8));
        let carrier_hz = signals::carrier_hz(sv, code, channel);
        let cycles = |metres: f64| carrier_hz.map(|hz| metres * hz / SPEED_OF_LIGHT_MPS);
        let rate = satellite.rate_mps.zip(fine[5]).map(|(rough, fine)| rough as f64 + fine as f64 * 1e-4);
        let carrier_cycles = metres(fine[1], carrier_scale).and_then(cycles);
        Observed {
            sv,
            code,
            pseudorange_m: metres(fine[0], code_scale),
            carrier_cycles,
            doppler_hz: rate.and_then(cycles).map(|cycles| -cycles),
            cn0_dbhz: fine[4].map(|power| power as f64 * power_scale),
            lock_s: fine[2].map(|indicator| 1e-3 * self.lock_ms(indicator) as f64),
            lost_lock: false,
            half_cycle_ambiguous: carrier_cycles.is_some() && fine[3] == Some(1),
        }
    }

    /// Shortest lock time of an indicator, milliseconds (DF402, table 3.5-74; DF407, table 3.5-75).
    fn lock_ms(self, indicator: i64) -> i64 {
        match (self.is_fine(), indicator) {
            (false, 0) => 0,
            (false, _) => 1 << (indicator + 4).min(40),
            (true, 0..64) => indicator,
            (true, _) => {
                let doublings = (indicator.min(704) >> 5) - 1;
                (indicator.min(704) - planted!("logs.rtcm.lock", 32, 31) * doublings) << doublings
            }
        }
    }
}

impl Message {
    /// Observations with their time.
    pub fn event(&self, calendar: &Calendar, locks: &mut Locks) -> Event {
        let Some(label) = self.label(calendar) else { return Event::Undated };
        let mut epoch = ObservedEpoch { label, values: self.values.clone() };
        locks.mark(&mut epoch, true);
        Event::Observations(epoch)
    }

    fn label(&self, calendar: &Calendar) -> Option<Epoch> {
        const WEEK_MS: i64 = 1000 * WEEK_S;
        const DAY_MS: i64 = 86_400_000;
        let near = calendar.near()?;
        let time = i64::try_from(self.time).ok()?;
        let tow_ms = match self.kind.system {
            System::BeiDou => time + planted!("logs.rtcm.beidou_time", 1000, -1000) * BDT_BEHIND_S,
            System::Glonass => {
                // Moscow's time is UTC and three hours (DF034); day 7 is not known (DF416).
                let (day, of_day) = (time >> 27, time & 0x7ff_ffff);
                let shift = 1000 * (near.leap_seconds() - 3 * 3600);
                let day = if day < 7 {
                    day
                } else {
                    let here_ms = 1000 * near.tow_whole_s() - shift;
                    ((here_ms - of_day) as f64 / DAY_MS as f64).round() as i64
                };
                day * DAY_MS + of_day + shift
            }
            _ => time,
        };
        calendar.at_ms(tow_ms.rem_euclid(WEEK_MS))
    }
}
