//! Scenario built in code: the keys of a scenario's text, set one by one, and checked as that text is.
//!
//! [`Builder`] holds a document of TOML and passes it through [`Scenario::parse`], so a scene built in code
//! is refused with the errors of a scene in a file. These errors name key and value; they have no line.

use std::path::PathBuf;

use toml::{Table, Value};

use super::{Scenario, ScenarioError};
use crate::scenario::read::Place;
use gnss::earth::Geodetic;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Name of a built scenario in errors.
const ORIGIN: &str = "scenario built in code";

/// Scenario that is built key by key.
#[derive(Clone, Debug)]
pub struct Builder {
    document: Table,
    directory: PathBuf,
    /// First key that has no position in the document.
    refused: Option<String>,
}

impl Scenario {
    /// Begins a scenario by its name; time, duration and motion have to follow.
    pub fn builder(name: &str) -> Builder {
        let empty = Builder { document: Table::new(), directory: PathBuf::from("."), refused: None };
        empty.set("name", name)
    }
}

impl Builder {
    /// Sets any key of the reference, such as `front_end.sample_rate_hz` or `interference[1].js_db`. Entries
    /// of arrays count from 1, and the number after the last one adds an entry.
    #[must_use]
    pub fn set(mut self, key: &str, value: impl Into<Value>) -> Self {
        if let Err(reason) = insert(&mut self.document, key, value.into(), true) {
            self.refused.get_or_insert(format!("{key}: {reason}"));
        }
        self
    }

    /// Adds an empty table, such as `noise`, whose presence alone is a feature of the scene.
    #[must_use]
    pub fn with(self, table: &str) -> Self {
        self.set(table, Table::new())
    }

    /// Sets the time of sample 0.
    #[must_use]
    pub fn start(self, start: Epoch) -> Self {
        let whole = Epoch::new(start.seconds(), 0.0).to_string();
        let fraction = format!("{:.12}", start.fraction().min(1.0 - 1e-12));
        let text = format!("{}{}", whole.split('.').next().unwrap_or(""), fraction.trim_start_matches('0'));
        self.set("start", text)
    }

    /// Sets the length of the scene, in seconds.
    #[must_use]
    pub fn duration_s(self, duration_s: f64) -> Self {
        self.set("duration_s", duration_s)
    }

    /// Sets an antenna at rest.
    #[must_use]
    pub fn fixed(self, place: Geodetic) -> Self {
        self.set("motion.kind", "static")
            .set("motion.latitude_deg", place.latitude_rad.to_degrees())
            .set("motion.longitude_deg", place.longitude_rad.to_degrees())
            .set("motion.height_m", place.height_m)
    }

    /// Sets the signals that satellites send; GPS L1 C/A alone without this.
    #[must_use]
    pub fn signals(self, signals: &[&'static Signal]) -> Self {
        let names: Vec<&str> = signals.iter().map(|signal| signal.name).collect();
        self.set("signals", names)
    }

    /// Sets the sample rate, in Hz.
    #[must_use]
    pub fn sample_rate_hz(self, rate_hz: f64) -> Self {
        self.set("front_end.sample_rate_hz", rate_hz)
    }

    /// Sets the carrier power over noise density of every satellite, in dB-Hz.
    #[must_use]
    pub fn cn0_dbhz(self, cn0_dbhz: f64) -> Self {
        self.set("power.cn0_dbhz", cn0_dbhz)
    }

    /// Adds thermal noise.
    #[must_use]
    pub fn noise(self) -> Self {
        self.with("noise")
    }

    /// Sets the directory in which files that the scenario names are looked for.
    #[must_use]
    pub fn directory(self, directory: impl Into<PathBuf>) -> Self {
        Self { directory: directory.into(), ..self }
    }

    /// Checks all keys together and makes the scenario.
    ///
    /// # Errors
    /// Errors of [`Scenario::parse`], without lines; a key that leads through something that is no table.
    pub fn build(self) -> Result<Scenario, ScenarioError> {
        let refuse = |message: String| ScenarioError::Toml { place: nowhere(), message };
        if let Some(reason) = self.refused {
            return Err(refuse(reason));
        }
        let text = toml::to_string(&self.document).map_err(|error| refuse(error.to_string()))?;
        Scenario::parse_in(&text, ORIGIN, &self.directory, false).map_err(placeless)
    }
}

fn nowhere() -> Place {
    Place { origin: ORIGIN.to_owned(), line: 0, column: 0 }
}

/// Error about a text that nobody has seen, with its lines left out.
fn placeless(error: ScenarioError) -> ScenarioError {
    match error {
        // A file that describes a signal has lines.
        error if error.place().is_some_and(|place| place.origin != ORIGIN) => error,
        ScenarioError::Toml { message, .. } => ScenarioError::Toml { place: nowhere(), message },
        ScenarioError::UnknownKey { key, nearest, known, .. } => {
            ScenarioError::UnknownKey { place: nowhere(), key, nearest, known }
        }
        ScenarioError::Value { key, value, expected, .. } => {
            ScenarioError::Value { place: nowhere(), key, value, expected }
        }
        ScenarioError::Several(errors) => ScenarioError::Several(errors.into_iter().map(placeless).collect()),
        other => other,
    }
}

/// Inserts a value under a key like `power.cn0_dbhz` or `interference[1].js_db` (counted from 1) of a
/// document.
///
/// # Errors
/// A key that leads through something that is no table, or to an entry that an array does not have.
pub fn put(document: &mut Table, key: &str, value: &Value) -> Result<(), String> {
    insert(document, key, value.clone(), false)
}

/// Inserts like [`put`]; if `grows`, an array takes one entry more than it has.
fn insert(document: &mut Table, key: &str, value: Value, grows: bool) -> Result<(), String> {
    let mut table = document;
    let mut segments = key.split('.').peekable();
    while let Some(segment) = segments.next() {
        let (name, index) = match segment.strip_suffix(']').and_then(|s| s.split_once('[')) {
            Some((name, index)) => (name, Some(index.parse::<usize>().map_err(|_| format!("[{index}] is no number"))?)),
            None => (segment, None),
        };
        if name.is_empty() {
            return Err("expected names between the points".to_owned());
        }
        if segments.peek().is_none() && index.is_none() {
            table.insert(name.to_owned(), value);
            return Ok(());
        }
        let empty = || if grows && index.is_some() { Value::Array(Vec::new()) } else { Value::Table(Table::new()) };
        let next = table.entry(name).or_insert_with(empty);
        let next = match (next, index) {
            (Value::Array(items), Some(index)) => {
                if grows && index == items.len() + 1 {
                    items.push(Value::Table(Table::new()));
                }
                let count = items.len();
                let item = index.checked_sub(1).and_then(|index| items.get_mut(index));
                item.ok_or_else(|| format!("{name} has {count} entries, counted from 1"))?
            }
            (next, None) => next,
            (_, Some(_)) => return Err(format!("{name} is no array")),
        };
        match next {
            last if segments.peek().is_none() && (grows || !last.is_table()) => {
                *last = value;
                return Ok(());
            }
            Value::Table(inner) => table = inner,
            _ => return Err(format!("{name} is no table")),
        }
    }
    Err("expected a key".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn built() -> Builder {
        Scenario::builder("test")
            .start(Epoch::new(962_006_400, 0.25))
            .duration_s(10.0)
            .fixed(Geodetic::from_degrees(26.5, 80.25, 130.0))
    }

    #[test]
    fn a_built_scenario_is_that_of_its_text() {
        let start = Epoch::new(962_006_400, 0.25);
        let text = format!(
            "name = \"test\"\nstart = \"{start}\"\nduration_s = 10.0\n[motion]\nkind = \"static\"\n\
             latitude_deg = 26.5\nlongitude_deg = 80.25\nheight_m = 130.0\n"
        );
        let own = Scenario { origin: ORIGIN.to_owned(), ..Scenario::from_toml(&text).unwrap() };
        assert_eq!(own.start, start);
        assert_eq!(built().build().unwrap(), own);
    }

    #[test]
    fn all_that_is_wrong_is_said_at_once_and_without_lines() {
        let error = built().duration_s(-1.0).set("noice.x", 1).build().unwrap_err();
        let texts: Vec<String> = error.each().iter().map(ToString::to_string).collect();
        assert_eq!(texts.len(), 2, "{texts:?}");
        assert!(texts[0].starts_with("scenario built in code: duration_s = -1.0: expected "), "{texts:?}");
        assert!(texts[1].contains("unknown key 'noice': did you mean 'noise'?"), "{texts:?}");
    }

    #[test]
    fn a_key_through_a_number_is_refused_by_name() {
        let error = built().set("duration_s.x", 1).build().unwrap_err();
        assert_eq!(error.to_string(), "scenario built in code: duration_s.x: duration_s is no table");
        let error = built().set("interference[2].kind", "cw").build().unwrap_err();
        assert!(error.to_string().contains("interference has 0 entries"), "{error}");
    }
}
