//! Layouts of binary messages and the tables that they give.
//!
//! A [`Layout`] is a list of fields as an interface description prints it: little-endian numbers one after
//! the other, then a part that repeats as often as one of the fields says. Reading it gives a [`Table`] with
//! one row per repetition. Limits: one repeated part, no conditional fields.

use std::fmt;

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Nothing: the field is beyond the end of a shorter version of the message.
    Absent,
    /// A whole number.
    Integer(i64),
    /// A number with a scale, or a floating-point one.
    Real(f64),
    /// A name.
    Text(String),
}

impl Value {
    /// The number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(value) => Some(*value as f64),
            Self::Real(value) => Some(*value),
            Self::Absent | Self::Text(_) => None,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Absent => Ok(()),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Real(value) => write!(f, "{value}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// Rows of one message.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Name of the message by the interface description, such as `NAV-PVT`.
    pub name: &'static str,
    /// Names of the columns, as the interface description has them.
    pub columns: Vec<&'static str>,
    /// One row per repetition of the message's repeated part, or the only one.
    pub rows: Vec<Vec<Value>>,
}

impl Table {
    /// A cell by its row and the name of its column.
    pub fn get(&self, row: usize, column: &str) -> &Value {
        let at = self.columns.iter().position(|name| *name == column);
        at.and_then(|at| self.rows.get(row)?.get(at)).unwrap_or(&Value::Absent)
    }

    /// A cell's number.
    pub fn number(&self, row: usize, column: &str) -> Option<f64> {
        self.get(row, column).number()
    }

    /// A cell's whole number.
    pub fn integer(&self, row: usize, column: &str) -> Option<i64> {
        match self.get(row, column) {
            Value::Integer(value) => Some(*value),
            _ => None,
        }
    }

    /// True if a flag is there and set.
    pub fn is_set(&self, row: usize, column: &str) -> bool {
        self.integer(row, column) == Some(1)
    }
}

/// Type of a field.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Unsigned,
    Signed,
    Real,
    /// Bit fields from the least significant bit on, each with its name (none for reserved bits) and width.
    Flags(&'static [(&'static str, u32)]),
    Reserved,
}

/// Field of a layout.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    name: &'static str,
    bytes: usize,
    kind: Kind,
    divisor: f64,
}

/// Unsigned number of so many bytes.
pub const fn u(bytes: usize, name: &'static str) -> Field {
    Field { name, bytes, kind: Kind::Unsigned, divisor: 1.0 }
}

/// Signed number of so many bytes, in two's complement.
pub const fn i(bytes: usize, name: &'static str) -> Field {
    Field { name, bytes, kind: Kind::Signed, divisor: 1.0 }
}

/// Floating-point number of 4 or 8 bytes (IEEE 754).
pub const fn r(bytes: usize, name: &'static str) -> Field {
    Field { name, bytes, kind: Kind::Real, divisor: 1.0 }
}

/// Bit fields in so many bytes, from the least significant bit on.
pub const fn x(bytes: usize, parts: &'static [(&'static str, u32)]) -> Field {
    Field { name: "", bytes, kind: Kind::Flags(parts), divisor: 1.0 }
}

/// Reserved bytes, which no table has.
pub const fn reserved(bytes: usize) -> Field {
    Field { name: "", bytes, kind: Kind::Reserved, divisor: 1.0 }
}

impl Field {
    /// The field with a scale: its value is the number over this divisor.
    pub const fn over(self, divisor: f64) -> Self {
        Self { divisor, ..self }
    }

    fn columns(&self, into: &mut Vec<&'static str>) {
        match self.kind {
            Kind::Flags(parts) => into.extend(parts.iter().map(|(name, _)| *name).filter(|name| !name.is_empty())),
            Kind::Reserved => {}
            _ => into.push(self.name),
        }
    }

    /// Reads the field from its bytes, which are none where the message has ended before it.
    fn read(&self, bytes: Option<&[u8]>, into: &mut Vec<Value>) {
        let raw = bytes.map(little_endian);
        match self.kind {
            Kind::Reserved => {}
            Kind::Flags(parts) => {
                let mut low = 0;
                for (name, width) in parts {
                    let part = raw.map(|raw| raw >> low & ((1 << width) - 1));
                    if !name.is_empty() {
                        into.push(part.map_or(Value::Absent, |part| Value::Integer(part as i64)));
                    }
                    low += width;
                }
            }
            Kind::Unsigned => into.push(self.scaled(raw.map(|raw| raw as i64))),
            Kind::Signed => {
                let shift = 64 - 8 * self.bytes as u32;
                into.push(self.scaled(raw.map(|raw| (raw << shift) as i64 >> shift)));
            }
            Kind::Real if self.bytes == 4 => {
                into.push(raw.map_or(Value::Absent, |raw| Value::Real(single(f32::from_bits(raw as u32)))));
            }
            Kind::Real => into.push(raw.map_or(Value::Absent, |raw| Value::Real(f64::from_bits(raw)))),
        }
    }

    fn scaled(&self, raw: Option<i64>) -> Value {
        match raw {
            None => Value::Absent,
            Some(raw) if self.divisor == 1.0 => Value::Integer(raw),
            Some(raw) => Value::Real(raw as f64 / self.divisor),
        }
    }
}

/// A single-precision number, exactly.
fn single(value: f32) -> f64 {
    f64::from(value)
}

/// Unsigned number of up to eight bytes, the least significant first.
pub fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte))
}

/// Layout of a message.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Name of the message.
    pub name: &'static str,
    /// Class and number of a UBX message; zero and the block number of SBF.
    pub key: (u8, u16),
    /// Fields that are there once.
    pub head: &'static [Field],
    /// Name of the field that counts repetitions, and the fields of each.
    pub repeated: Option<(&'static str, &'static [Field])>,
}

impl Layout {
    /// Table of a message's payload; none where the payload ends before its first field does or has fewer
    /// repetitions than it says.
    pub fn read(&self, payload: &[u8]) -> Option<Table> {
        let repeated = self.repeated.map_or(&[][..], |(_, fields)| fields);
        let mut table = Table { name: self.name, ..Table::default() };
        self.head.iter().chain(repeated).for_each(|field| field.columns(&mut table.columns));
        let (mut head, mut at) = (Vec::new(), 0);
        for field in self.head {
            field.read(payload.get(at..at + field.bytes), &mut head);
            at += field.bytes;
        }
        if self.head.first().is_some_and(|first| payload.len() < first.bytes) {
            return None;
        }
        table.rows.push(head);
        let Some((counter, fields)) = self.repeated else { return Some(table) };
        let count = usize::try_from(table.integer(0, counter)?).ok()?;
        let size: usize = fields.iter().map(|field| field.bytes).sum();
        let body = payload.get(at..at + count * size)?;
        let head = table.rows.pop()?;
        for part in body.chunks_exact(size.max(1)) {
            let (mut row, mut at) = (head.clone(), 0);
            for field in fields {
                field.read(part.get(at..at + field.bytes), &mut row);
                at += field.bytes;
            }
            table.rows.push(row);
        }
        if count == 0 {
            let mut row = head;
            fields.iter().for_each(|field| field.read(None, &mut row));
            table.rows.push(row);
        }
        Some(table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUT: Layout = Layout {
        name: "TEST",
        key: (1, 2),
        head: &[u(1, "count"), i(2, "degrees").over(100.0), x(1, &[("low", 3), ("", 4), ("high", 1)])],
        repeated: Some(("count", &[i(1, "signed"), reserved(1), r(4, "real")])),
    };

    #[test]
    fn a_message_is_read_as_its_layout_says() {
        let table = LAYOUT.read(&[2, 0x18, 0xfc, 0x85, 0xff, 9, 0, 0, 0x20, 0xc0, 5, 9, 0, 0, 0, 0x3f]).unwrap();
        assert_eq!(table.columns, ["count", "degrees", "low", "high", "signed", "real"]);
        assert_eq!(table.number(0, "degrees"), Some(-10.0));
        assert_eq!([table.integer(1, "low"), table.integer(1, "high")], [Some(5), Some(1)]);
        assert_eq!([table.integer(0, "signed"), table.integer(1, "signed")], [Some(-1), Some(5)]);
        assert_eq!([table.number(0, "real"), table.number(1, "real")], [Some(-2.5), Some(0.5)]);
    }

    #[test]
    fn a_message_without_repetitions_has_one_row_with_empty_cells() {
        let table = LAYOUT.read(&[0, 0, 0, 0]).unwrap();
        assert_eq!(table.rows.len(), 1);
        assert_eq!(table.get(0, "real"), &Value::Absent);
    }

    #[test]
    fn a_message_with_fewer_repetitions_than_it_says_is_refused() {
        assert_eq!(LAYOUT.read(&[2, 0, 0, 0, 1, 2, 3, 4, 5, 6]), None);
        assert_eq!(LAYOUT.read(&[]), None);
    }
}
