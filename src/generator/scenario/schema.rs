//! Keys as data: name, type, range, unit, default and meaning, in one place for the readers, their refusals
//! and the reference.
//!
//! A table is a list of [`Key`]s; tables in tables make a tree. `read::Table` reads a value by its key's
//! declaration alone, so that no range and no default is written twice. Of a table with kinds (`kind`, or
//! `model`) a key may belong to some of them.

use std::fmt::Write as _;

/// Permitted values of a key.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// A number.
    Number {
        /// The smallest allowed.
        least: f64,
        /// The largest allowed.
        most: f64,
        /// Unit of the number.
        unit: &'static str,
    },
    /// An array of so many numbers.
    Numbers {
        /// Number of elements.
        count: usize,
        /// The smallest allowed.
        least: f64,
        /// The largest allowed.
        most: f64,
        /// Unit of the numbers.
        unit: &'static str,
    },
    /// An array of any number of numbers.
    List {
        /// The smallest allowed.
        least: f64,
        /// The largest allowed.
        most: f64,
        /// Unit of the numbers.
        unit: &'static str,
    },
    /// A whole number.
    Integer {
        /// The smallest allowed.
        least: u64,
        /// The largest allowed.
        most: u64,
    },
    /// True or false.
    Flag,
    /// Text, with a description of its permitted values.
    Text(&'static str),
    /// A time: TOML's own, or a text.
    Time,
    /// One word of a list.
    Word(fn() -> Vec<&'static str>),
    /// Array of texts, with a description of their permitted values.
    Words(&'static str),
    /// Text or array of texts, with a description of the permitted values.
    Texts(&'static str),
    /// An array of plain values.
    Values,
    /// A table whose keys are satellites, and their values.
    BySatellite(&'static Key),
    /// A table of keys.
    Table(&'static [Key]),
    /// An array of tables, `[[…]]`.
    Tables(&'static [Key]),
    /// A table, or an array of tables.
    OneOrMore(&'static [Key]),
    /// A table that another part of the program reads; where its keys are found.
    Foreign(&'static str),
}

/// Meaning of an absent key.
#[derive(Clone, Copy, Debug)]
pub enum Absent {
    /// The scenario is refused.
    Required,
    /// Absence of the feature.
    Optional,
    /// Default number.
    Number(f64),
    /// Something else, in words.
    Means(&'static str),
}

/// Key of a table, with its type, range, default and meaning.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Name of the key as a scenario writes it.
    pub name: &'static str,
    /// Permitted values.
    pub value: Value,
    /// Meaning if the key is absent.
    pub absent: Absent,
    /// Kinds of the table that have the key; empty for all.
    pub kinds: &'static [&'static str],
    /// Meaning of the key, for the reference.
    pub meaning: &'static str,
}

const fn key(name: &'static str, value: Value, meaning: &'static str) -> Key {
    Key { name, value, absent: Absent::Optional, kinds: &[], meaning }
}

/// Declares a number within two bounds, with its unit.
pub const fn number(name: &'static str, least: f64, most: f64, unit: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Number { least, most, unit }, meaning)
}

/// Declares an array of `count` numbers within the same bounds, with their unit.
pub const fn numbers(
    name: &'static str,
    count: usize,
    (least, most): (f64, f64),
    unit: &'static str,
    meaning: &'static str,
) -> Key {
    key(name, Value::Numbers { count, least, most, unit }, meaning)
}

/// Declares an array of any length of numbers within two bounds, with their unit.
pub const fn list(name: &'static str, least: f64, most: f64, unit: &'static str, meaning: &'static str) -> Key {
    key(name, Value::List { least, most, unit }, meaning)
}

/// Declares a whole number within two bounds.
pub const fn integer(name: &'static str, least: u64, most: u64, meaning: &'static str) -> Key {
    key(name, Value::Integer { least, most }, meaning)
}

/// A truth value.
pub const fn flag(name: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Flag, meaning)
}

/// Declares a text; `expected` describes its permitted values.
pub const fn text(name: &'static str, expected: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Text(expected), meaning)
}

/// Declares an instant, as TOML or as text.
pub const fn time(name: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Time, meaning)
}

/// Declares one word of a list.
pub const fn word(name: &'static str, words: fn() -> Vec<&'static str>, meaning: &'static str) -> Key {
    key(name, Value::Word(words), meaning)
}

/// Declares an array of words; `expected` describes the permitted ones.
pub const fn words(name: &'static str, expected: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Words(expected), meaning)
}

/// Declares a text or an array of texts; `expected` describes the permitted values.
pub const fn texts(name: &'static str, expected: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Texts(expected), meaning)
}

/// Declares an array of plain values of any type.
pub const fn values(name: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Values, meaning)
}

/// Declares a table with an entry `each` for every satellite that it names.
pub const fn by_satellite(name: &'static str, each: &'static Key, meaning: &'static str) -> Key {
    key(name, Value::BySatellite(each), meaning)
}

/// A table of keys.
pub const fn table(name: &'static str, keys: &'static [Key], meaning: &'static str) -> Key {
    key(name, Value::Table(keys), meaning)
}

/// Declares an array of tables with the same keys.
pub const fn tables(name: &'static str, keys: &'static [Key], meaning: &'static str) -> Key {
    key(name, Value::Tables(keys), meaning)
}

/// Declares a table or an array of tables with the same keys.
pub const fn one_or_more(name: &'static str, keys: &'static [Key], meaning: &'static str) -> Key {
    key(name, Value::OneOrMore(keys), meaning)
}

/// Declares a table whose keys another reference describes; `found` names that reference.
pub const fn foreign(name: &'static str, found: &'static str, meaning: &'static str) -> Key {
    key(name, Value::Foreign(found), meaning)
}

impl Key {
    /// Returns the key as a required one.
    pub const fn required(self) -> Self {
        Self { absent: Absent::Required, ..self }
    }

    /// Sets the number that holds if the key is absent.
    pub const fn or(self, number: f64) -> Self {
        Self { absent: Absent::Number(number), ..self }
    }

    /// Returns the key with the meaning of its absence, in words.
    pub const fn or_else(self, words: &'static str) -> Self {
        Self { absent: Absent::Means(words), ..self }
    }

    /// Returns the key as one that only tables of these kinds have.
    pub const fn of(self, kinds: &'static [&'static str]) -> Self {
        Self { kinds, ..self }
    }

    /// True if a table of this kind has the key.
    pub fn is_of(&self, kind: &str) -> bool {
        self.kinds.is_empty() || self.kinds.contains(&kind)
    }

    /// Describes the permitted values, for refusals and the reference.
    pub fn expected(&self) -> String {
        let with = |unit: &str| if unit.is_empty() { String::new() } else { format!(" {unit}") };
        match self.value {
            Value::Number { least, most, unit } => {
                format!("a number from {} to {}{}", short(least), short(most), with(unit))
            }
            Value::Numbers { count, least, most, unit } => {
                format!("an array of {count} numbers from {} to {}{}", short(least), short(most), with(unit))
            }
            Value::List { least, most, unit } => {
                format!("an array of numbers from {} to {}{}", short(least), short(most), with(unit))
            }
            Value::Integer { least, most } => format!("an integer from {least} to {most}"),
            Value::Flag => "true or false".to_owned(),
            Value::Text(expected) | Value::Words(expected) | Value::Texts(expected) => expected.to_owned(),
            Value::Time => "GPS time like \"2010-07-01T08:12:30\"".to_owned(),
            Value::Word(words) => format!("one of {}", words().join(", ")),
            Value::Values => "an array of at least one number, text or truth value".to_owned(),
            Value::Table(keys) => {
                let kinds = keys.iter().find_map(|key| match key.value {
                    Value::Word(words) if matches!(key.absent, Absent::Required) => Some((key.name, words())),
                    _ => None,
                });
                match kinds.as_ref().and_then(|(name, words)| words.first().map(|word| (name, word))) {
                    Some((name, word)) => format!("a table with {name} = {word:?}, …"),
                    None => "a table".to_owned(),
                }
            }
            Value::BySatellite(_) | Value::Foreign(_) => "a table".to_owned(),
            Value::Tables(_) => "an array of tables".to_owned(),
            Value::OneOrMore(_) => "a table, or an array of tables".to_owned(),
        }
    }

    /// Describes the meaning of an absent key, for the reference.
    pub fn default_text(&self) -> String {
        match self.absent {
            Absent::Required => "required".to_owned(),
            Absent::Optional => match self.value {
                Value::Flag => "false".to_owned(),
                _ => "none".to_owned(),
            },
            Absent::Number(number) => short(number),
            Absent::Means(words) => words.to_owned(),
        }
    }
}

/// Writes a number without trailing zeros.
pub fn short(number: f64) -> String {
    let size = number.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) { format!("{number:e}") } else { format!("{number}") }
}

/// Table of the reference, without the tables in it.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Heading as a file writes it: `[front_end]`, `[[interference]]`; empty for the top level.
    pub heading: String,
    /// Full name of the table: `front_end`.
    pub path: String,
    /// Meaning of the table, for the reference.
    pub meaning: String,
    /// Keys of the table.
    pub keys: Vec<&'static Key>,
}

/// Lists a tree of tables, the top first, each table once.
pub fn tables_of(top: &'static [Key], above: &str, meaning: &str) -> Vec<Listed> {
    let mut found = Vec::new();
    walk(&mut found, top, (above, false), meaning);
    found
}

fn walk(found: &mut Vec<Listed>, keys: &'static [Key], (path, many): (&str, bool), meaning: &str) {
    let heading = match (path, many) {
        ("", _) => String::new(),
        (path, true) => format!("[[{path}]]"),
        (path, false) => format!("[{path}]"),
    };
    found.push(Listed { heading, path: path.to_owned(), meaning: meaning.to_owned(), keys: keys.iter().collect() });
    for key in keys {
        let below = if path.is_empty() { key.name.to_owned() } else { format!("{path}.{}", key.name) };
        match key.value {
            Value::Table(inner) | Value::OneOrMore(inner) if is_listed(found, inner) => {}
            // At the top tables of different meaning may have equal names of keys.
            Value::Tables(inner) if !path.is_empty() && is_listed(found, inner) => {}
            Value::Table(inner) | Value::OneOrMore(inner) => walk(found, inner, (&below, false), key.meaning),
            Value::Tables(inner) => walk(found, inner, (&below, true), key.meaning),
            Value::BySatellite(each) => found.push(Listed {
                heading: format!("[{below}]"),
                path: below,
                meaning: key.meaning.to_owned(),
                keys: vec![each],
            }),
            _ => {}
        }
    }
}

/// True if a table with these keys is listed under another name.
fn is_listed(found: &[Listed], keys: &'static [Key]) -> bool {
    found.iter().any(|listed| same(&listed.keys, keys))
}

/// True if a table with these keys is the listed one: `[spoofer.motion]` is `[motion]` again.
fn same(listed: &[&'static Key], keys: &'static [Key]) -> bool {
    !keys.is_empty() && listed.len() == keys.len() && listed.iter().zip(keys).all(|(a, b)| a.name == b.name)
}

impl Listed {
    /// Writes the table as Markdown, with a heading of `level` signs.
    pub fn markdown(&self, level: usize) -> String {
        let mut out = String::new();
        if !self.heading.is_empty() {
            let _ = write!(out, "{} `{}`\n\n", "#".repeat(level), self.heading);
        }
        if !self.meaning.is_empty() {
            let _ = write!(out, "{}\n\n", self.meaning);
        }
        if self.keys.is_empty() {
            out += "No keys: the table's presence is the switch.\n\n";
            return out;
        }
        let kinds = self.keys.iter().any(|key| !key.kinds.is_empty());
        out += if kinds {
            "| key | of | value | if absent | meaning |\n| --- | --- | --- | --- | --- |\n"
        } else {
            "| key | value | if absent | meaning |\n| --- | --- | --- | --- |\n"
        };
        for key in &self.keys {
            let of = if key.kinds.is_empty() { "all".to_owned() } else { key.kinds.join(", ") };
            let of = if kinds { format!(" {of} |") } else { String::new() };
            let (value, absent) = (key.expected(), key.default_text());
            let _ = writeln!(out, "| `{}` |{of} {value} | {absent} | {} |", key.name, key.meaning);
        }
        out.push('\n');
        out
    }
}
