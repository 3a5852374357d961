//! Fields of messages in which they follow one another, each read and written by one declaration.
//!
//! Source: RTCM 10403.3, 3.4 (data fields) and 3.3 (types of data). A field has the standard's number as its
//! name, a width in bits and a scale. A table of a message has one row. Limits: a field is there or not by
//! one bit of a mask alone.

use thiserror::Error;

use crate::bits::{Bits, Writer};
use crate::table::{Table, Value};
use gnss::satellite::Sv;

/// Most characters of a text (DF029 and its like).
pub const MOST_CHARACTERS: usize = 31;

/// Reason for which a message cannot be written.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Refused {
    /// A value beyond its field.
    #[error("{column} = {value} does not fit the message: expected {least} to {most}")]
    Range {
        /// Number of the data field.
        column: &'static str,
        /// Value in the field's unit.
        value: f64,
        /// Least value that the field holds.
        least: f64,
        /// Largest value that the field holds.
        most: f64,
    },
    /// A field without a value.
    #[error("{0} has no value: expected one")]
    Missing(&'static str),
    /// A text that does not fit.
    #[error("{column} = '{text}': expected at most {MOST_CHARACTERS} characters of ASCII")]
    Text {
        /// Number of the data field.
        column: &'static str,
        /// The text.
        text: String,
    },
    /// A signal without a bit in the signal mask of its system.
    #[error("{sv} {code}: expected a signal that the mask of {} has", sv.system)]
    Signal {
        /// The satellite.
        sv: Sv,
        /// RINEX band and attribute.
        code: String,
    },
    /// A satellite without a bit in the satellite mask of its system.
    #[error("{0}: expected a satellite that the mask of {system} has", system = .0.system)]
    Satellite(Sv),
    /// Observations of a satellite whose range is not known.
    #[error("{0}: no pseudorange: expected one of the satellite's signals with it")]
    NoRange(Sv),
    /// A range that a message does not hold.
    #[error("{sv}: range of {range_ms} ms: expected 0 to 255 ms")]
    Far {
        /// The satellite.
        sv: Sv,
        /// Range in milliseconds of light.
        range_ms: f64,
    },
    /// A satellite whose carrier is not known.
    #[error("{0}: no frequency channel of this slot is known")]
    Channel(Sv),
    /// An ephemeris of a message that RTCM does not have.
    #[error("{sv}: no RTCM message has ephemerides of {message}")]
    Ephemeris {
        /// The satellite.
        sv: Sv,
        /// Name of the satellite's message.
        message: &'static str,
    },
}

/// Interpretation of a field's bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Unsigned,
    /// Two's complement.
    Signed,
    /// Two's complement of an angle, modulo two semicircles.
    Turn,
    /// A sign and a magnitude.
    Magnitude,
    Reserved,
    /// Characters after the number of them, which has eight bits.
    Text,
}

/// Field of a message.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Number of the data field, such as `DF025`.
    pub column: &'static str,
    width: usize,
    kind: Kind,
    times: f64,
    over: f64,
    /// Column and bit of a mask that says that the field is there.
    when: Option<(&'static str, u32)>,
}

const fn field(column: &'static str, width: usize, kind: Kind) -> Field {
    Field { column, width, kind, times: 1.0, over: 1.0, when: None }
}

/// Unsigned number of so many bits.
pub const fn u(width: usize, column: &'static str) -> Field {
    field(column, width, Kind::Unsigned)
}

/// Signed number of so many bits, in two's complement.
pub const fn i(width: usize, column: &'static str) -> Field {
    field(column, width, Kind::Signed)
}

/// Signed number of so many bits, of sign and magnitude.
pub const fn m(width: usize, column: &'static str) -> Field {
    field(column, width, Kind::Magnitude)
}

/// Angle in semicircles of 32 bits, modulo two of them.
pub const fn turn(column: &'static str) -> Field {
    field(column, 32, Kind::Turn).halved(31)
}

/// Reserved bits, which no table has.
pub const fn reserved(width: usize) -> Field {
    field("", width, Kind::Reserved)
}

/// Text.
pub const fn text(column: &'static str) -> Field {
    field(column, 8, Kind::Text)
}

impl Field {
    /// The field with a unit of so many of its table's.
    pub const fn times(self, times: f64) -> Self {
        Self { times, ..self }
    }

    /// The field with a unit of which so many are one of its table's.
    pub const fn over(self, over: f64) -> Self {
        Self { over, ..self }
    }

    /// The field with a unit of two to the power of minus `halvings`, 62 at most.
    pub const fn halved(self, halvings: u32) -> Self {
        if halvings > 62 {
            return Self { over: (1_u64 << 62) as f64 * (1_u64 << (halvings - 62)) as f64, ..self };
        }
        Self { over: (1_u64 << halvings) as f64, ..self }
    }

    /// The field where a bit of a mask before it is set.
    pub const fn when(self, mask: &'static str, bit: u32) -> Self {
        Self { when: Some((mask, bit)), ..self }
    }

    /// Width in bits; of a text that of its count.
    pub fn width(&self) -> usize {
        self.width
    }

    fn range(&self) -> [i64; 2] {
        let span = 1_i64 << self.width;
        match self.kind {
            Kind::Signed | Kind::Turn => [-span / 2, span / 2 - 1],
            Kind::Magnitude => [1 - span / 2, span / 2 - 1],
            Kind::Unsigned | Kind::Reserved | Kind::Text => [0, span - 1],
        }
    }

    fn value(&self, raw: i64) -> Value {
        if self.times == 1.0 && self.over == 1.0 {
            Value::Integer(raw)
        } else {
            Value::Real(raw as f64 * self.times / self.over)
        }
    }

    /// Reads the field; none where the message ends before it.
    fn read(&self, bits: &mut Bits<'_>) -> Option<Value> {
        Some(match self.kind {
            Kind::Unsigned | Kind::Reserved => self.value(bits.unsigned(self.width)? as i64),
            Kind::Signed | Kind::Turn => self.value(bits.signed(self.width)?),
            Kind::Magnitude => {
                let is_negative = bits.unsigned(1)? == 1;
                let size = bits.unsigned(self.width - 1)? as i64;
                self.value(if planted!("logs.rtcm.magnitude", is_negative, false) { -size } else { size })
            }
            Kind::Text => {
                let count = bits.unsigned(self.width)? as usize;
                Value::Text(bits.text(count)?)
            }
        })
    }

    /// Integer that is nearest to a value.
    fn raw(&self, value: f64) -> Result<i64, Refused> {
        let [least, most] = self.range();
        let mut raw = (value / self.times * self.over).round();
        if self.kind == Kind::Turn {
            let span = 2.0 * (most as f64 + 1.0);
            raw -= span * ((raw + span / 2.0) / span).floor();
        }
        if (least as f64..=most as f64).contains(&raw) {
            return Ok(raw as i64);
        }
        let [least, most] = [least, most].map(|raw| raw as f64 * self.times / self.over);
        Err(Refused::Range { column: self.column, value, least, most })
    }

    fn write(&self, value: &Value, into: &mut Writer) -> Result<(), Refused> {
        match (self.kind, value) {
            (Kind::Text, Value::Text(text)) => {
                if text.len() > MOST_CHARACTERS || !text.is_ascii() {
                    return Err(Refused::Text { column: self.column, text: text.clone() });
                }
                into.put(text.len() as i64, self.width);
                text.bytes().for_each(|byte| into.put(i64::from(byte), 8));
            }
            _ => {
                let raw = self.raw(value.number().ok_or(Refused::Missing(self.column))?)?;
                let sign = 1_i64 << (self.width - 1);
                into.put(if self.kind == Kind::Magnitude && raw < 0 { sign | -raw } else { raw }, self.width);
            }
        }
        Ok(())
    }
}

/// Table of a message's bytes; none where the message ends too early.
pub fn read<'f>(name: &'static str, fields: impl Iterator<Item = &'f Field>, body: &[u8]) -> Option<Table> {
    let mut bits = Bits::new(body);
    let mut table = Table { name, columns: Vec::new(), rows: vec![Vec::new()] };
    for field in fields {
        let is_there = field.when.is_none_or(|(mask, bit)| table.integer(0, mask).unwrap_or(0) >> bit & 1 == 1);
        let value = if is_there { field.read(&mut bits)? } else { Value::Absent };
        if field.kind != Kind::Reserved {
            table.columns.push(field.column);
            table.rows.iter_mut().for_each(|row| row.push(value.clone()));
        }
    }
    Some(table)
}

/// Bytes of a message whose fields have these values; reserved bits are zero.
///
/// # Errors
/// A field without a value, or one that it does not hold.
pub fn write<'f>(
    fields: impl Iterator<Item = &'f Field>,
    mut value: impl FnMut(&'static str) -> Value,
) -> Result<Vec<u8>, Refused> {
    let mut into = Writer::default();
    for field in fields {
        let is_there = match field.when {
            None => true,
            Some((mask, bit)) => value(mask).number().ok_or(Refused::Missing(mask))? as i64 >> bit & 1 == 1,
        };
        match field.kind {
            Kind::Reserved => into.put(0, field.width),
            _ if is_there => field.write(&value(field.column), &mut into)?,
            _ => {}
        }
    }
    Ok(into.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIELDS: [Field; 7] = [
        u(4, "mask"),
        i(5, "signed").over(4.0),
        m(5, "magnitude").times(3.0),
        reserved(3),
        u(2, "first").when("mask", 3),
        u(2, "second").when("mask", 0),
        text("text"),
    ];

    #[test]
    fn what_is_written_is_read_back() {
        for mask in 0..16 {
            let cells =
                [("mask", Value::Integer(mask)), ("signed", Value::Real(-4.0)), ("magnitude", Value::Real(-45.0))];
            let more =
                [("first", Value::Integer(3)), ("second", Value::Integer(2)), ("text", Value::Text("a b".into()))];
            let value = |column| {
                let cell = cells.iter().chain(&more).find(|(name, _)| *name == column);
                cell.map_or(Value::Absent, |(_, value)| value.clone())
            };
            let table = read("TEST", FIELDS.iter(), &write(FIELDS.iter(), value).unwrap()).unwrap();
            for (column, cell) in cells.iter().chain(&more) {
                let is_there = !(*column == "first" && mask < 8 || *column == "second" && mask % 2 == 0);
                assert_eq!(table.get(0, column), if is_there { cell } else { &Value::Absent }, "{mask} {column}");
            }
        }
    }

    #[test]
    fn a_value_beyond_its_field_is_refused_by_name() {
        let refused = |field: Field, value: Value| field.write(&value, &mut Writer::default()).unwrap_err().to_string();
        let told = refused(i(5, "DF1").over(4.0), Value::Real(4.0));
        assert_eq!(told, "DF1 = 4 does not fit the message: expected -4 to 3.75");
        assert_eq!(refused(u(5, "DF1"), Value::Real(f64::NAN)), "DF1 = NaN does not fit the message: expected 0 to 31");
        assert_eq!(refused(m(5, "DF1"), Value::Integer(-16)), "DF1 = -16 does not fit the message: expected -15 to 15");
        assert_eq!(refused(u(5, "DF1"), Value::Absent), "DF1 has no value: expected one");
        assert!(refused(text("DF1"), Value::Text("x".repeat(32))).contains("at most 31 characters"));
    }

    #[test]
    fn an_angle_is_reduced_to_a_turn() {
        for (semicircles, expected) in [(1.0, -1.0), (-1.5, 0.5), (0.999_999_999_9, -1.0), (2.25, 0.25)] {
            let mut bits = Writer::default();
            turn("DF1").write(&Value::Real(semicircles), &mut bits).unwrap();
            let bytes = bits.into_bytes();
            assert_eq!(turn("DF1").read(&mut Bits::new(&bytes)), Some(Value::Real(expected)));
        }
    }
}
