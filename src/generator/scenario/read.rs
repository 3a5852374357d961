//! Typed access to TOML tables: one point where a key's name, type, range and unit are checked.
//!
//! Values are read by the declarations of [`super::schema`]: a reader names a key, and its type, range and
//! default are there. [`Table::check`] holds a whole document against them and collects every refusal. Each
//! carries the file, the line and the column, because values are read off the spanned document; serde's
//! derived structures lose the position of a value behind `kind = …`.

mod refusals;

use std::fmt::Display;

use refusals::ABSENT;
pub use refusals::{Place, Refusals, Source};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::ScenarioError;
use super::schema::{Absent, Key, Value};
use gnss::place::nearest;

/// Table of the scenario.
#[derive(Clone)]
pub struct Table<'t> {
    source: &'t Source<'t>,
    path: String,
    at: usize,
    table: &'t DeTable<'t>,
    keys: &'static [Key],
    /// Description of each key in a table whose keys are satellites.
    each: Option<&'static Key>,
    /// The word that states which kind of its tables it is.
    kind: Option<&'t str>,
}

impl<'t> Table<'t> {
    /// Creates a table with the keys that it may contain.
    pub fn new(source: &'t Source<'t>, path: &str, at: usize, table: &'t DeTable<'t>, keys: &'static [Key]) -> Self {
        let decides = |key: &&Key| ["kind", "model"].contains(&key.name) && matches!(key.value, Value::Word(_));
        let kind =
            keys.iter().find(decides).and_then(|key| match (table.get(key.name).map(Spanned::get_ref), key.value) {
                (Some(DeValue::String(word)), Value::Word(words)) => {
                    Some(word.as_ref()).filter(|word| words().contains(word))
                }
                _ => None,
            });
        Self { source, path: path.to_owned(), at, table, keys, each: None, kind }
    }

    /// Returns the table with `kind` as its kind, which it need not state itself.
    pub fn of_kind(&self, kind: &'static str) -> Self {
        Self { kind: Some(kind), ..self.clone() }
    }

    /// The declaration of a key.
    fn declared(&self, name: &str) -> Option<&'static Key> {
        let mut named = self.keys.iter().filter(|key| key.name == name);
        let first = named.clone().next();
        let own = named.find(|key| self.kind.is_none_or(|kind| key.is_of(kind)));
        self.each.or(own).or(first)
    }

    fn expected(&self, name: &str) -> String {
        self.declared(name).map_or_else(|| "a key of the reference".to_owned(), Key::expected)
    }

    /// The names of the keys that a table of this kind may hold; of all if its kind is not known.
    fn known(&self) -> Vec<&'static str> {
        let mut names: Vec<&str> = Vec::new();
        for key in self.keys.iter().filter(|key| self.kind.is_none_or(|kind| key.is_of(kind))) {
            if !names.contains(&key.name) {
                names.push(key.name);
            }
        }
        names
    }

    /// Refuses keys that are not declared for a table of this kind.
    pub fn allow_own(&self) -> Result<(), ScenarioError> {
        if self.each.is_some() { Ok(()) } else { self.allow(&self.known()) }
    }

    /// Refuses keys that are not among `keys`.
    pub fn allow(&self, keys: &[&str]) -> Result<(), ScenarioError> {
        self.unknown(keys).next().map_or(Ok(()), Err)
    }

    fn unknown(&self, keys: &[&str]) -> impl Iterator<Item = ScenarioError> {
        let strangers = self.table.keys().filter(|key| !keys.contains(&key.get_ref().as_ref()));
        strangers.map(|key| {
            let name: &str = key.get_ref();
            // A word that some kind knows is none misspelt.
            let all: Vec<&str> = self.keys.iter().map(|key| key.name).chain(keys.iter().copied()).collect();
            let nearest = if all.contains(&name) { None } else { nearest(name, &all) };
            ScenarioError::UnknownKey {
                place: self.source.place(key.span().start),
                key: self.key(&name.escape_debug().to_string()),
                nearest,
                known: if keys.is_empty() { "none".to_owned() } else { keys.join(", ") },
            }
        })
    }

    /// Checks the table and those in it against their declarations: unknown keys, values of a wrong type or
    /// out of range, required keys that are absent.
    pub fn check(&self, refusals: &mut Refusals) {
        let known = self.known();
        if self.each.is_none() {
            self.unknown(&known).for_each(|error| refusals.add(error));
        }
        for name in self.names() {
            if let Some(key) = self.declared(name) {
                self.check_value(name, key, refusals);
            }
        }
        let missing = |key: &&&str| {
            let required = self.declared(key).is_some_and(|key| matches!(key.absent, Absent::Required));
            // A key of some kinds is required where the kind is known.
            let sure = self.declared(key).is_some_and(|key| key.kinds.is_empty() || self.kind.is_some());
            required && sure && !self.has(key)
        };
        for name in known.iter().filter(missing) {
            refusals.add(self.bad(name, self.expected(name)));
        }
    }

    fn check_value(&self, name: &str, key: &'static Key, refusals: &mut Refusals) {
        let expected = key.expected();
        let held = match key.value {
            Value::Number { .. } => self.number(name).map(|_| ()),
            Value::Numbers { .. } | Value::List { .. } => self.list(name).map(|_| ()),
            Value::Integer { .. } => self.integer(name).map(|_| ()),
            Value::Flag => self.flag(name).map(|_| ()),
            Value::Text(_) => self.text(name).map(|_| ()),
            Value::Time => self.instant(name).map(|_| ()),
            Value::Word(words) => {
                let words: Vec<(&str, ())> = words().into_iter().map(|word| (word, ())).collect();
                self.choice(name, &words).map(|_| ())
            }
            Value::Words(_) => self.words(name, &expected).map(|_| ()),
            Value::Texts(_) => self.texts(name).map(|_| ()),
            Value::Values | Value::Foreign(_) => Ok(()),
            Value::Table(_) | Value::BySatellite(_) => {
                self.table(name).map(|table| table.iter().for_each(|table| table.check(refusals)))
            }
            Value::OneOrMore(_) => {
                self.one_or_more(name).map(|tables| tables.iter().flatten().for_each(|table| table.check(refusals)))
            }
            Value::Tables(_) => {
                self.tables(name).map(|tables| tables.iter().flatten().for_each(|table| table.check(refusals)))
            }
        };
        refusals.take(held);
    }

    /// Full name of a key.
    pub fn key(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// The position of a key's value, or of the table if it is absent.
    pub fn place(&self, name: &str) -> Place {
        self.source.place(self.get(name).map_or(self.at, |value| value.span().start))
    }

    fn get(&self, name: &str) -> Option<&'t Spanned<DeValue<'t>>> {
        let foreign = self.keys.is_empty();
        debug_assert!(foreign || self.declared(name).is_some(), "{} is not declared", self.key(name));
        self.table.get(name)
    }

    /// Creates the refusal of a value.
    pub fn bad(&self, name: &str, expected: impl Display) -> ScenarioError {
        ScenarioError::Value {
            place: self.place(name),
            key: self.key(name),
            value: self.get(name).map_or_else(|| ABSENT.to_owned(), |v| self.source.excerpt(&v.span())),
            expected: expected.to_string(),
        }
    }

    /// True if the table has the key.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Reads a number within its range.
    pub fn number(&self, name: &str) -> Result<Option<f64>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let bad = || self.bad(name, self.expected(name));
        let Some(Key { value: Value::Number { least, most, .. }, .. }) = self.declared(name) else { return Err(bad()) };
        let number = as_number(value.get_ref()).filter(|x| (*least..=*most).contains(x));
        number.map(Some).ok_or_else(bad)
    }

    /// Reads a number within its range, or returns its default, or a refusal if it has none.
    pub fn need(&self, name: &str) -> Result<f64, ScenarioError> {
        let default = match self.declared(name).map(|key| key.absent) {
            Some(Absent::Number(number)) => Some(number),
            _ => None,
        };
        self.number(name)?.or(default).ok_or_else(|| self.bad(name, self.expected(name)))
    }

    /// Reads an array of `N` numbers within the key's bounds.
    pub fn numbers<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, ScenarioError> {
        let Some(numbers) = self.list(name)? else { return Ok(None) };
        numbers.try_into().map(Some).map_err(|_| self.bad(name, self.expected(name)))
    }

    /// Reads an array of numbers, of any length unless one is declared.
    pub fn list(&self, name: &str) -> Result<Option<Vec<f64>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let bad = || self.bad(name, self.expected(name));
        let (length, range) = match self.declared(name).map(|key| key.value) {
            Some(Value::Numbers { count, least, most, .. }) => (Some(count), least..=most),
            Some(Value::List { least, most, .. }) => (None, least..=most),
            _ => return Err(bad()),
        };
        let DeValue::Array(items) = value.get_ref() else { return Err(bad()) };
        let number = |item: &Spanned<DeValue<'_>>| as_number(item.get_ref()).filter(|x| range.contains(x));
        let numbers: Option<Vec<f64>> = items.iter().map(number).collect();
        numbers.filter(|list| length.is_none_or(|length| list.len() == length)).map(Some).ok_or_else(bad)
    }

    /// Reads an integer within its range.
    pub fn integer(&self, name: &str) -> Result<Option<u64>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let bad = || self.bad(name, self.expected(name));
        let Some(Key { value: Value::Integer { least, most }, .. }) = self.declared(name) else { return Err(bad()) };
        let number = match value.get_ref() {
            DeValue::Integer(i) => u64::from_str_radix(i.as_str(), i.radix()).ok(),
            _ => None,
        };
        number.filter(|x| (*least..=*most).contains(x)).map(Some).ok_or_else(bad)
    }

    /// Reads an integer, or returns its default, or a refusal if it has none.
    pub fn need_integer(&self, name: &str) -> Result<u64, ScenarioError> {
        let default = match self.declared(name).map(|key| key.absent) {
            Some(Absent::Number(number)) => Some(number as u64),
            _ => None,
        };
        self.integer(name)?.or(default).ok_or_else(|| self.bad(name, self.expected(name)))
    }

    /// Reads a text as the key's kind allows it.
    pub fn text(&self, name: &str) -> Result<Option<&'t str>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            None => Ok(None),
            Some(DeValue::String(text)) if !text.trim().is_empty() => Ok(Some(text.as_ref())),
            Some(_) => Err(self.bad(name, self.expected(name))),
        }
    }

    /// Reads a text that is required.
    pub fn need_text(&self, name: &str) -> Result<&'t str, ScenarioError> {
        self.text(name)?.ok_or_else(|| self.bad(name, self.expected(name)))
    }

    /// Reads a time: a string, or TOML's own date and time.
    pub fn instant(&self, name: &str) -> Result<Option<String>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            Some(DeValue::Datetime(time)) => Ok(Some(time.to_string())),
            _ => Ok(self.text(name)?.map(str::to_owned)),
        }
    }

    /// A truth value.
    pub fn flag(&self, name: &str) -> Result<Option<bool>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            None => Ok(None),
            Some(DeValue::Boolean(flag)) => Ok(Some(*flag)),
            Some(_) => Err(self.bad(name, "true or false")),
        }
    }

    /// Reads one word of a list, which is the declared one.
    pub fn choice<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> Result<Option<T>, ScenarioError> {
        let names: Vec<&str> = choices.iter().map(|(word, _)| *word).collect();
        debug_assert!(
            matches!(self.declared(name), Some(Key { value: Value::Word(words), .. }) if words() == names),
            "{}: {names:?} is not what is declared",
            self.key(name)
        );
        let Some(word) = self.text(name)? else { return Ok(None) };
        let found = choices.iter().find(|(w, _)| *w == word).map(|(_, choice)| *choice);
        let hint = nearest(word, &names).map_or(String::new(), |near| format!(" (did you mean {near}?)"));
        found.map(Some).ok_or_else(|| self.bad(name, self.expected(name) + &hint))
    }

    /// Reads one word of a list, which is required.
    pub fn need_choice<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> Result<T, ScenarioError> {
        self.choice(name, choices)?.ok_or_else(|| self.bad(name, self.expected(name)))
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

    /// Reads a string, or an array of them.
    pub fn texts(&self, name: &str) -> Result<Option<Vec<&'t str>>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            Some(DeValue::Array(_)) => self.words(name, &self.expected(name)),
            _ => Ok(self.text(name)?.map(|text| vec![text])),
        }
    }

    /// Reads a table with the keys that are declared for it.
    pub fn table(&self, name: &str) -> Result<Option<Table<'t>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let DeValue::Table(table) = value.get_ref() else { return Err(self.bad(name, "a table")) };
        let (keys, each): (&'static [Key], _) = match self.declared(name).map(|key| key.value) {
            Some(Value::Table(keys) | Value::OneOrMore(keys)) => (keys, None),
            Some(Value::BySatellite(each)) => (&[], Some(each)),
            _ => (&[], None),
        };
        Ok(Some(Self { each, ..Self::new(self.source, &self.key(name), value.span().start, table, keys) }))
    }

    /// Reads an array of tables with the key's own keys.
    pub fn tables(&self, name: &str) -> Result<Option<Vec<Table<'t>>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let expected = "an array of tables";
        let DeValue::Array(items) = value.get_ref() else { return Err(self.bad(name, expected)) };
        let keys: &'static [Key] = match self.declared(name).map(|key| key.value) {
            Some(Value::Tables(keys) | Value::OneOrMore(keys)) => keys,
            _ => &[],
        };
        let mut tables = Vec::with_capacity(items.len());
        for (i, item) in items.iter().enumerate() {
            let DeValue::Table(table) = item.get_ref() else { return Err(self.bad(name, expected)) };
            let path = format!("{}[{}]", self.key(name), i + 1);
            tables.push(Table::new(self.source, &path, item.span().start, table, keys));
        }
        Ok(Some(tables))
    }

    /// Reads a single table, or every table of an array.
    pub fn one_or_more(&self, name: &str) -> Result<Option<Vec<Table<'t>>>, ScenarioError> {
        match self.get(name).map(Spanned::get_ref) {
            Some(DeValue::Array(_)) => self.tables(name),
            Some(DeValue::Table(_)) => Ok(self.table(name)?.map(|table| vec![table])),
            Some(_) => Err(self.bad(name, self.expected(name))),
            None => Ok(None),
        }
    }

    /// Names of the keys that are present.
    pub fn names(&self) -> impl Iterator<Item = &'t str> + use<'t> {
        self.table.keys().map(|key| key.get_ref().as_ref())
    }
}

/// Values of any type, for those who pass them on.
impl Table<'_> {
    /// Reads an array of plain values: numbers, texts, truth values, times and arrays of them.
    pub fn values(&self, name: &str) -> Result<Option<Vec<toml::Value>>, ScenarioError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let expected = "an array of at least one number, text or truth value";
        let DeValue::Array(items) = value.get_ref() else { return Err(self.bad(name, expected)) };
        let values: Option<Vec<toml::Value>> = items.iter().map(|item| plain(item.get_ref())).collect();
        values.filter(|values| !values.is_empty()).map(Some).ok_or_else(|| self.bad(name, expected))
    }

    /// The table without its positions.
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

    /// Reads a plain value of any type.
    pub fn value(&self, name: &str) -> Option<toml::Value> {
        self.get(name).and_then(|value| plain(value.get_ref()))
    }
}

fn as_number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|x| x as f64),
        DeValue::Float(x) => x.as_str().parse().ok().filter(|x: &f64| x.is_finite()),
        _ => None,
    }
}

/// A value without its position; `None` for a table or a number that is none.
pub fn plain(value: &DeValue<'_>) -> Option<toml::Value> {
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
