//! Errors in a scenario's text: their positions, and the list of all of them.

use std::fmt::Display;
use std::ops::Range;

use crate::scenario::ScenarioError;

/// Placeholder for the value of an absent key; a text would have quotes.
pub(super) const ABSENT: &str = "absent";

/// Text of a scenario, and its origin.
pub struct Source<'t> {
    /// Name of the text in messages.
    pub origin: &'t str,
    /// The whole text.
    pub text: &'t str,
}

/// A position in it, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The text's name.
    pub origin: String,
    /// Line, from 1; 0 for a value that is in no text.
    pub line: usize,
    /// Number of the character in the line, from 1.
    pub column: usize,
}

impl Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            0 => f.write_str(&self.origin),
            line => write!(f, "{}:{line}:{}", self.origin, self.column),
        }
    }
}

impl Source<'_> {
    /// Line and column of a byte of the text.
    pub fn place(&self, byte: usize) -> Place {
        let before = self.text.get(..byte).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        Place {
            origin: self.origin.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before.get(line_start..).unwrap_or("").chars().count() + 1,
        }
    }

    /// Refusal of a text that is no TOML.
    pub fn refused(&self, error: &toml::de::Error) -> ScenarioError {
        let place = self.place(error.span().map_or(0, |span| span.start));
        ScenarioError::Toml { place, message: error.message().to_owned() }
    }

    /// Text of a value, shortened and without control characters.
    pub fn excerpt(&self, span: &Range<usize>) -> String {
        let text = self.text.get(span.clone()).unwrap_or("");
        let mut short: String = text.chars().take(60).flat_map(char::escape_debug).collect();
        if text.chars().count() > 60 {
            short.push('…');
        }
        short.replace("\\\"", "\"").replace("\\'", "'")
    }
}

/// Refusals in the order of their occurrence, each once.
#[derive(Debug, Default)]
pub struct Refusals(Vec<ScenarioError>);

impl Refusals {
    /// Takes in an error, unless one of the same key is there already.
    pub fn add(&mut self, error: ScenarioError) {
        match error {
            ScenarioError::Several(errors) => errors.into_iter().for_each(|error| self.add(error)),
            error => {
                // One refusal of a key is enough; of an absent one the position is its table's.
                let same = |known: &ScenarioError| match (known.key_at(), error.key_at()) {
                    (Some(one), Some(other)) => one == other,
                    _ => known.to_string() == error.to_string(),
                };
                if !self.0.iter().any(same) {
                    self.0.push(error);
                }
            }
        }
    }

    /// Returns the value, or records a refusal and returns `None`.
    pub fn take<T>(&mut self, result: Result<T, ScenarioError>) -> Option<T> {
        result.map_err(|error| self.add(error)).ok()
    }

    /// # Errors
    /// Refusals, in the order of the text.
    pub fn finish(mut self) -> Result<(), ScenarioError> {
        self.leave_out_misspelt();
        self.0.sort_by_key(|error| error.place().map_or((usize::MAX, 0), |place| (place.line, place.column)));
        match (self.0.pop(), self.0.is_empty()) {
            (None, _) => Ok(()),
            (Some(only), true) => Err(only),
            (Some(last), false) => {
                self.0.push(last);
                Err(ScenarioError::Several(self.0))
            }
        }
    }

    /// An unknown key may be the one that its table lacks: that is refused once, where it is written.
    fn leave_out_misspelt(&mut self) {
        let table = |key: &str| key.rsplit_once('.').map_or(String::new(), |(table, _)| table.to_owned());
        let unknown = self.0.iter().filter_map(|error| match error {
            ScenarioError::UnknownKey { key, nearest, .. } => Some((table(key), nearest.clone())),
            _ => None,
        });
        let unknown: Vec<(String, Option<String>)> = unknown.collect();
        let lacking = |key: &str, value: &str| {
            let (own, name) = (table(key), key.rsplit('.').next());
            unknown.iter().any(|(at, meant)| *at == own && (value == ABSENT || meant.as_deref() == name))
        };
        self.0.retain(|error| !matches!(error, ScenarioError::Value { key, value, .. } if lacking(key, value)));
    }
}
