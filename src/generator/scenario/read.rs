//! Typed access to TOML tables: one place where a key's name, type, range and unit are checked.
//!
//! A key that a table does not know is refused before anything else, with the nearest one that it does know. Every
//! refusal carries the file, the line and the column, because values are read off the spanned document; serde's
//! derived structures lose the place of a value behind `kind = …`.

use std::fmt::Display;
use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::ScenarioError;

/// The text of a scenario and where it came from.
pub(crate) struct Source<'t> {
    pub origin: &'t str,
    pub text: &'t str,
}

/// A place in it, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    pub origin: String,
    pub line: usize,
    pub column: usize,
}

impl Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}:{}", self.origin, self.line, self.column)
    }
}

impl Source<'_> {
    pub fn place(&self, byte: usize) -> Place {
        let before = self.text.get(..byte).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        Place {
            origin: self.origin.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before.get(line_start..).unwrap_or("").chars().count() + 1,
        }
    }

    /// The text of a value, shortened and without control characters.
    fn excerpt(&self, span: &Range<usize>) -> String {
        let text = self.text.get(span.clone()).unwrap_or("");
        let mut short: String = text.chars().take(60).flat_map(char::escape_debug).collect();
        if text.chars().count() > 60 {
            short.push('…');
        }
        short.replace("\\\"", "\"").replace("\\'", "'")
    }
}

/// One table of the scenario.
pub(crate) struct Table<'t> {
    source: &'t Source<'t>,
    path: String,
    at: usize,
    table: &'t DeTable<'t>,
}

impl<'t> Table<'t> {
    pub fn new(source: &'t Source<'t>, path: &str, at: usize, table: &'t DeTable<'t>) -> Self {
        Self { source, path: path.to_owned(), at, table }
    }

    /// Refuses keys that are not among `keys`.
    pub fn allow(&self, keys: &[&str]) -> Result<(), ScenarioError> {
        for key in self.table.keys() {
            let name: &str = key.get_ref();
            if !keys.contains(&name) {
                return Err(ScenarioError::UnknownKey {
                    place: self.source.place(key.span().start),
                    key: self.key(&name.escape_debug().to_string()),
                    nearest: nearest(name, keys),
                    known: if keys.is_empty() { "none".to_owned() } else { keys.join(", ") },
                });
            }
        }
        Ok(())
    }

    /// The full name of a key.
    pub fn key(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// The place of a key's value, or of the table if it is absent.
    pub fn place(&self, name: &str) -> Place {
        self.source.place(self.get(name).map_or(self.at, |value| value.span().start))
    }

    fn get(&self, name: &str) -> Option<&'t Spanned<DeValue<'t>>> {
        self.table.get(name)
    }

    /// The refusal of a value.
    pub fn bad(&self, name: &str, expected: impl Display) -> ScenarioError {
        ScenarioError::Value {
            place: self.place(name),
            key: self.key(name),
            value: self.get(name).map_or_else(|| "absent".to_owned(), |v| self.source.excerpt(&v.span())),
            expected: expected.to_string(),
        }
    }

    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    pub fn number(&self, name: &str, range: RangeInclusive<f64>, unit: &str) -> Result<Option<f64>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let number = as_number(value.get_ref()).filter(|x| range.contains(x));
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let expected = || format!("a number from {} to {}{unit}", Short(*range.start()), Short(*range.end()));
        number.map(Some).ok_or_else(|| self.bad(name, expected()))
    }

    pub fn required(&self, name: &str, range: RangeInclusive<f64>, unit: &str) -> Result<f64, ScenarioError> {
        let expected = format!("a number from {} to {} {unit}", Short(*range.start()), Short(*range.end()));
        self.number(name, range, unit)?.ok_or_else(|| self.bad(name, expected.trim_end()))
    }

    pub fn numbers<const N: usize>(&self, name: &str, limit: f64) -> Result<Option<[f64; N]>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let bad = || self.bad(name, format!("an array of {N} numbers from {} to {}", Short(-limit), Short(limit)));
        let DeValue::Array(items) = value.get_ref() else { return Err(bad()) };
        let numbers: Vec<f64> =
            items.iter().filter_map(|v| as_number(v.get_ref())).filter(|x| x.abs() <= limit).collect();
        if items.len() != N { Err(bad()) } else { numbers.try_into().map(Some).map_err(|_| bad()) }
    }

    /// An array of numbers of any length.
    pub fn list(&self, name: &str, range: RangeInclusive<f64>, unit: &str) -> Result<Option<Vec<f64>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let expected =
            || format!("an array of numbers from {} to {} {unit}", Short(*range.start()), Short(*range.end()));
        let DeValue::Array(items) = value.get_ref() else { return Err(self.bad(name, expected())) };
        let number = |item: &Spanned<DeValue<'_>>| as_number(item.get_ref()).filter(|x| range.contains(x));
        let numbers: Option<Vec<f64>> = items.iter().map(number).collect();
        numbers.map(Some).ok_or_else(|| self.bad(name, expected()))
    }

    pub fn integer(&self, name: &str) -> Result<Option<u64>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let number = match value.get_ref() {
            DeValue::Integer(i) => u64::from_str_radix(i.as_str(), i.radix()).ok().filter(|x| *x <= i64::MAX as u64),
            _ => None,
        };
        number.map(Some).ok_or_else(|| self.bad(name, "an integer from 0 to 9223372036854775807"))
    }

    pub fn text(&self, name: &str, expected: &str) -> Result<Option<&'t str>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            None => Ok(None),
            Some(DeValue::String(text)) if !text.trim().is_empty() => Ok(Some(text.as_ref())),
            Some(_) => Err(self.bad(name, expected)),
        }
    }

    /// A time: a string, or TOML's own date and time.
    pub fn instant(&self, name: &str) -> Result<Option<String>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            Some(DeValue::Datetime(time)) => Ok(Some(time.to_string())),
            _ => Ok(self.text(name, "GPS time like \"2010-07-01T08:12:30\"")?.map(str::to_owned)),
        }
    }

    pub fn flag(&self, name: &str) -> Result<Option<bool>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            None => Ok(None),
            Some(DeValue::Boolean(flag)) => Ok(Some(*flag)),
            Some(_) => Err(self.bad(name, "true or false")),
        }
    }

    /// One word out of a list.
    pub fn choice<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> Result<Option<T>, ScenarioError> {
        let names: Vec<&str> = choices.iter().map(|(word, _)| *word).collect();
        let expected = format!("one of {}", names.join(", "));
        let Some(word) = self.text(name, &expected)? else { return Ok(None) };
        let found = choices.iter().find(|(w, _)| *w == word).map(|(_, choice)| *choice);
        let hint = nearest(word, &names).map_or(String::new(), |near| format!(" (did you mean {near}?)"));
        found.map(Some).ok_or_else(|| self.bad(name, format!("{expected}{hint}")))
    }

    /// An array of strings.
    pub fn words(&self, name: &str, expected: &str) -> Result<Option<Vec<&'t str>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let DeValue::Array(items) = value.get_ref() else { return Err(self.bad(name, expected)) };
        let words: Option<Vec<&str>> = items
            .iter()
            .map(|item| match item.get_ref() {
                DeValue::String(text) => Some(text.as_ref()),
                _ => None,
            })
            .collect();
        words.map(Some).ok_or_else(|| self.bad(name, expected))
    }

    /// A string, or an array of them.
    pub fn texts(&self, name: &str, expected: &str) -> Result<Option<Vec<&'t str>>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            Some(DeValue::Array(_)) => self.words(name, expected),
            _ => Ok(self.text(name, expected)?.map(|text| vec![text])),
        }
    }

    pub fn table(&self, name: &str) -> Result<Option<Table<'t>>, ScenarioError> {
        match self.get(name) {
            None => Ok(None),
            Some(value) => match value.get_ref() {
                DeValue::Table(table) => Ok(Some(Table::new(self.source, &self.key(name), value.span().start, table))),
                _ => Err(self.bad(name, "a table")),
            },
        }
    }

    pub fn tables(&self, name: &str) -> Result<Option<Vec<Table<'t>>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let expected = "an array of tables";
        let DeValue::Array(items) = value.get_ref() else { return Err(self.bad(name, expected)) };
        let mut tables = Vec::with_capacity(items.len());
        for (i, item) in items.iter().enumerate() {
            let DeValue::Table(table) = item.get_ref() else { return Err(self.bad(name, expected)) };
            let path = format!("{}[{}]", self.key(name), i + 1);
            tables.push(Table::new(self.source, &path, item.span().start, table));
        }
        Ok(Some(tables))
    }

    /// The names of the keys that are there.
    pub fn names(&self) -> impl Iterator<Item = &'t str> + use<'t> {
        self.table.keys().map(|key| key.get_ref().as_ref())
    }
}

/// Values of any type, for those who pass them on.
#[cfg(feature = "study")]
impl Table<'_> {
    /// An array of plain values: numbers, texts, truth values, times and arrays of them.
    pub fn values(&self, name: &str) -> Result<Option<Vec<toml::Value>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let expected = "an array of at least one number, text or truth value";
        let DeValue::Array(items) = value.get_ref() else { return Err(self.bad(name, expected)) };
        let values: Option<Vec<toml::Value>> = items.iter().map(|item| plain(item.get_ref())).collect();
        values.filter(|values| !values.is_empty()).map(Some).ok_or_else(|| self.bad(name, expected))
    }

    /// The table without its places.
    pub fn whole(&self) -> Result<toml::Table, ScenarioError> {
        let mut whole = toml::Table::new();
        for name in self.names() {
            let value = match self.get(name).map(Spanned::get_ref) {
                Some(DeValue::Table(_)) => {
                    self.table(name)?.map(|table| table.whole()).transpose()?.map(toml::Value::Table)
                }
                _ => self.value(name),
            };
            let value = value.ok_or_else(|| self.bad(name, "a number, a text, a truth value, or a table of these"))?;
            whole.insert(name.to_owned(), value);
        }
        Ok(whole)
    }

    /// A plain value of any type.
    pub fn value(&self, name: &str) -> Option<toml::Value> {
        self.get(name).and_then(|value| plain(value.get_ref()))
    }
}

/// A range's end without a tail of zeros.
struct Short(f64);

impl Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = self.0.abs();
        if size != 0.0 && !(1e-3..1e6).contains(&size) { write!(f, "{:e}", self.0) } else { write!(f, "{}", self.0) }
    }
}

fn as_number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|x| x as f64),
        DeValue::Float(x) => x.as_str().parse().ok().filter(|x: &f64| x.is_finite()),
        _ => None,
    }
}

/// A value without its place; `None` for a table or a number that is none.
#[cfg(feature = "study")]
pub(crate) fn plain(value: &DeValue<'_>) -> Option<toml::Value> {
    Some(match value {
        DeValue::Integer(i) => toml::Value::Integer(i64::from_str_radix(i.as_str(), i.radix()).ok()?),
        DeValue::Float(_) => toml::Value::Float(as_number(value)?),
        DeValue::String(text) => toml::Value::String(text.to_string()),
        DeValue::Boolean(flag) => toml::Value::Boolean(*flag),
        DeValue::Datetime(time) => toml::Value::Datetime(*time),
        DeValue::Array(items) => {
            toml::Value::Array(items.iter().map(|item| plain(item.get_ref())).collect::<Option<_>>()?)
        }
        DeValue::Table(_) => return None,
    })
}

/// The candidate most like `word`, if any is like it at all.
pub(crate) fn nearest(word: &str, candidates: &[&str]) -> Option<String> {
    let lower = word.to_lowercase();
    candidates
        .iter()
        .map(|candidate| (strsim::jaro_winkler(&lower, &candidate.to_lowercase()), *candidate))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(likeness, _)| *likeness > 0.7)
        .map(|(_, candidate)| candidate.to_owned())
}
