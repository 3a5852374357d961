//! RTCM 3, the protocol of reference stations and of many receivers.
//!
//! Source: RTCM 10403.3, 3.5. Multiple Signal Messages (MSM) 4 to 7 of all systems become observations;
//! 1005, 1006, 1033 and 1230 become tables; further messages are counted by their numbers. Columns are the
//! standard's numbers of data fields, such as `DF406`, values in their units, scales applied. Times are those
//! of the day or of the week: the week is the one nearest to a time that is known. Limits: messages 1001 to
//! 1012 and MSM 1 to 3, which hold no whole range, are not decoded.

mod msm;

use crate::bits::Bits;
use crate::content::Content;
use crate::observed::{Calendar, Locks};
use crate::table::{Table, Value};

/// Messages that the judge needs.
pub const NEEDED: &str = "MSM4 to MSM7 (1074 to 1137) for observations";

/// Reads a frame.
pub fn read(frame: &[u8], calendar: &Calendar, locks: &mut Locks) -> Content {
    let body = frame.get(3..frame.len().saturating_sub(3)).unwrap_or_default();
    let Some(number) = Bits::new(body).unsigned(12) else { return Content::default() };
    let name = name(number);
    let table = match number {
        1005 => station("1005", body),
        1006 => station("1006", body),
        1033 => antenna(body),
        1230 => glonass_biases(body),
        _ => {
            let Some(kind) = msm::Kind::of(number) else { return Content { name, ..Content::default() } };
            let read = kind.read(body);
            let event = read.as_ref().map(|message| message.event(calendar, locks));
            return Content { name, is_known: true, table: read.map(|message| message.table), event };
        }
    };
    Content { name, is_known: true, table, event: None }
}

/// Number of a message with the name of what the judge or a user may look for.
fn name(number: u64) -> String {
    let word = match number {
        1019 => " (GPS ephemeris)",
        1020 => " (GLONASS ephemeris)",
        1042 => " (BeiDou ephemeris)",
        1044 => " (QZSS ephemeris)",
        1045 => " (Galileo F/NAV ephemeris)",
        1046 => " (Galileo I/NAV ephemeris)",
        4072 => " (u-blox)",
        _ => "",
    };
    format!("{number}{word}")
}

/// Rows of one message in the making.
struct Row(Table);

impl Row {
    fn new(name: &'static str) -> Self {
        Self(Table { name, columns: Vec::new(), rows: vec![Vec::new()] })
    }

    fn add(&mut self, column: &'static str, value: Value) {
        self.0.columns.push(column);
        if let Some(row) = self.0.rows.last_mut() {
            row.push(value);
        }
    }

    fn unsigned(&mut self, bits: &mut Bits<'_>, column: &'static str, count: usize) -> Option<u64> {
        let number = bits.unsigned(count)?;
        self.add(column, Value::Integer(number as i64));
        Some(number)
    }

    fn signed(&mut self, bits: &mut Bits<'_>, column: &'static str, count: usize, divisor: f64) -> Option<()> {
        let number = bits.signed(count)?;
        self.add(column, Value::Real(number as f64 / divisor));
        Some(())
    }
}

/// Position of a station's antenna in metres, Earth-fixed (messages 1005 and 1006).
fn station(name: &'static str, body: &[u8]) -> Option<Table> {
    let (mut bits, mut row) = (Bits::new(body), Row::new(name));
    for (column, count) in [("DF002", 12), ("DF003", 12), ("DF021", 6), ("DF022", 1), ("DF023", 1), ("DF024", 1)] {
        row.unsigned(&mut bits, column, count)?;
    }
    row.unsigned(&mut bits, "DF141", 1)?;
    row.signed(&mut bits, "DF025", 38, 1e4)?;
    row.unsigned(&mut bits, "DF142", 1)?;
    bits.unsigned(1)?;
    row.signed(&mut bits, "DF026", 38, 1e4)?;
    row.unsigned(&mut bits, "DF364", 2)?;
    row.signed(&mut bits, "DF027", 38, 1e4)?;
    if name == "1006" {
        let height = bits.unsigned(16)?;
        row.add("DF028", Value::Real(height as f64 / 1e4));
    }
    Some(row.0)
}

/// Descriptions of antenna and receiver (message 1033).
fn antenna(body: &[u8]) -> Option<Table> {
    let (mut bits, mut row) = (Bits::new(body), Row::new("1033"));
    row.unsigned(&mut bits, "DF002", 12)?;
    row.unsigned(&mut bits, "DF003", 12)?;
    for (index, column) in ["DF030", "DF033", "DF228", "DF230", "DF232"].into_iter().enumerate() {
        if index == 1 {
            row.unsigned(&mut bits, "DF031", 8)?;
        }
        let length = bits.unsigned(8)? as usize;
        let text = bits.text(length)?;
        row.add(column, Value::Text(text));
    }
    Some(row.0)
}

/// Code biases of GLONASS in metres (message 1230); a cell is empty where its signal is not in the mask.
fn glonass_biases(body: &[u8]) -> Option<Table> {
    let (mut bits, mut row) = (Bits::new(body), Row::new("1230"));
    row.unsigned(&mut bits, "DF002", 12)?;
    row.unsigned(&mut bits, "DF003", 12)?;
    row.unsigned(&mut bits, "DF421", 1)?;
    bits.unsigned(3)?;
    let mask = row.unsigned(&mut bits, "DF422", 4)?;
    for (index, column) in ["DF423", "DF424", "DF425", "DF426"].into_iter().enumerate() {
        if mask >> (3 - index) & 1 == 1 {
            row.signed(&mut bits, column, 16, 50.0)?;
        } else {
            row.add(column, Value::Absent);
        }
    }
    Some(row.0)
}

#[cfg(test)]
#[path = "rtcm/tests.rs"]
mod tests;
