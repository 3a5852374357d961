//! A user's limits: a TOML file whose keys are paths into `summary.json`.
//!
//! ```toml
//! marginal_share = 0.1                       # what is left of a limit below this share of it is marginal
//! "position.horizontal_p95_m" = { max = 1.5 }
//! "satellites.used" = { min = 8 }
//! "fidelity" = { equals = "balanced" }
//! ```
//!
//! A path may also be written as nested tables; a number in it counts list items from 0. A path that the
//! schema ([`super::schema`]) does not have is an error, one that a run has no figure for fails.

use serde_json::Value;
use thiserror::Error;
use toml::{Table, Value as Toml};

use crate::judge::judgement::{Bound, Judgement, MARGINAL_SHARE};
use crate::judge::schema::{self, Figures};
use gnss::place::Keys;
use gnss::renamed::{self, Class};

/// Error of a file of limits. `name` is the file's, with line and column where they are known.
#[derive(Debug, Error, PartialEq)]
pub enum LimitsError {
    /// The file is not TOML.
    #[error("{name}: {message}")]
    Toml {
        /// Name of the file of limits.
        name: String,
        /// Message of the parser, with line and column.
        message: String,
    },
    /// A path that the file of figures does not have.
    #[error("{name}: {} is not in {file}; {} {nearest} (all: {listed})", path.escape_debug(), instead(path))]
    Path {
        /// Name of the file of limits.
        name: String,
        /// The file of figures.
        file: &'static str,
        /// File in which a user finds all paths.
        listed: &'static str,
        /// The path into that file.
        path: String,
        /// The path that is spelt most like it.
        nearest: String,
    },
    /// A value that a limit cannot have.
    #[error("{name}: {path}.{} = {value}, expected {expected}", key.escape_debug())]
    Value {
        /// Name of the file of limits.
        name: String,
        /// The path into `summary.json`.
        path: String,
        /// The key beside the limit.
        key: String,
        /// The value as written.
        value: String,
        /// Expected value, in words.
        expected: String,
    },
    /// A path without a limit.
    #[error("{name}: {path} has no limit; expected {{ min = … }}, {{ max = … }}, both, or {{ equals = … }}")]
    Empty {
        /// Name of the file of limits.
        name: String,
        /// The path into `summary.json`.
        path: String,
    },
    /// A file without any limit.
    #[error("{name} sets no limit at all")]
    Nothing {
        /// Name of the file of limits.
        name: String,
    },
}

impl LimitsError {
    /// The error with the position of its key instead of the file's name alone.
    fn at(mut self, keys: &Keys<'_>) -> Self {
        let (name, key) = match &mut self {
            Self::Toml { .. } | Self::Nothing { .. } => return self,
            Self::Path { name, path, .. } | Self::Empty { name, path } => (name, path.clone()),
            Self::Value { name, key, .. } if key == "marginal_share" => (name, key.clone()),
            Self::Value { name, path, key, .. } => (name, format!("{path}.{key}")),
        };
        *name = keys.place_of(&key);
        self
    }
}

/// The limits as read.
#[derive(Clone, Debug)]
pub struct Limits {
    /// The file, as messages call it.
    pub name: String,
    entries: Vec<(String, Bound)>,
    marginal_share: f64,
    figures: &'static Figures,
}

impl PartialEq for Limits {
    fn eq(&self, other: &Self) -> bool {
        let parts = |limits: &Self| (limits.name.clone(), limits.entries.clone(), limits.figures.file);
        parts(self) == parts(other) && self.marginal_share == other.marginal_share
    }
}

const KEYS: [&str; 3] = ["min", "max", "equals"];

impl Limits {
    /// Reads and checks a file's text of limits for `summary.json`; `name` is what messages call it.
    ///
    /// # Errors
    /// [`LimitsError`] with the path in question.
    pub fn parse(text: &str, name: &str) -> Result<Self, LimitsError> {
        Self::parse_for(&schema::SUMMARY, text, name)
    }

    /// Reads and checks a text of limits for another file of figures.
    ///
    /// # Errors
    ///
    /// Same as [`Limits::parse`].
    pub fn parse_for(figures: &'static Figures, text: &str, name: &str) -> Result<Self, LimitsError> {
        let table: Table = text.parse().map_err(|error: toml::de::Error| LimitsError::Toml {
            name: Keys::new(name, text).place(error.span().map_or(0, |span| span.start)),
            message: error.message().to_owned(),
        })?;
        Self::of(figures, table, name).map_err(|error| error.at(&Keys::new(name, text)))
    }

    fn of(figures: &'static Figures, mut table: Table, name: &str) -> Result<Self, LimitsError> {
        let name = name.to_owned();
        let marginal_share = match table.remove("marginal_share") {
            None => MARGINAL_SHARE,
            Some(value) => {
                as_f64(&value).filter(|share| (0.0..1.0).contains(share)).ok_or_else(|| LimitsError::Value {
                    name: name.clone(),
                    path: "the file".to_owned(),
                    key: "marginal_share".to_owned(),
                    value: value.to_string(),
                    expected: "a number from 0 to below 1".to_owned(),
                })?
            }
        };
        let mut limits = Self { name, entries: Vec::new(), marginal_share, figures };
        limits.collect("", &table)?;
        if limits.entries.is_empty() {
            return Err(LimitsError::Nothing { name: limits.name });
        }
        Ok(limits)
    }

    fn collect(&mut self, above: &str, table: &Table) -> Result<(), LimitsError> {
        for (key, value) in table {
            let path = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
            let known = self.figures.leaf(&path);
            match value.as_table() {
                Some(bounds) if known.is_some() => self.entry(&path, bounds)?,
                Some(below)
                    if !below.keys().any(|key| KEYS.contains(&key.as_str())) && self.figures.is_branch(&path) =>
                {
                    self.collect(&path, below)?;
                }
                _ if known.is_some() => {
                    return Err(self.wrong(&path, "", value, "a table such as { max = 1.5 }"));
                }
                _ => {
                    let path = whole(path, value);
                    let own = strsim::jaro_winkler(&path, "marginal_share") > 0.9;
                    let nearest = if own { "marginal_share".to_owned() } else { self.figures.nearest(&path) };
                    let Figures { file, listed, .. } = *self.figures;
                    return Err(LimitsError::Path { name: self.name.clone(), file, listed, path, nearest });
                }
            }
        }
        Ok(())
    }

    fn entry(&mut self, path: &str, bounds: &Table) -> Result<(), LimitsError> {
        let is_number = self.figures.leaf(path).is_some_and(|leaf| leaf.is_number);
        for (key, value) in bounds {
            let bound = match (key.as_str(), as_f64(value), is_number) {
                ("max", Some(limit), true) => Bound::Max(limit),
                ("min", Some(limit), true) => Bound::Min(limit),
                ("max" | "min", _, true) => return Err(self.wrong(path, key, value, "a finite number")),
                ("max" | "min", _, false) => {
                    return Err(self.wrong(path, key, value, "`equals`: the figure is no number"));
                }
                ("equals", Some(number), _) => Bound::Equals(number.into()),
                ("equals", None, _) => match value {
                    Toml::String(text) => {
                        let earlier = renamed::find(Class::Word, text).filter(|_| path.ends_with("_verdict"));
                        if let Some((_, now)) = earlier {
                            return Err(self.wrong(path, key, value, &format!("\"{now}\", as it is called now")));
                        }
                        Bound::Equals(text.clone().into())
                    }
                    Toml::Boolean(truth) => Bound::Equals((*truth).into()),
                    _ => return Err(self.wrong(path, key, value, "a finite number, a text or a truth value")),
                },
                _ => return Err(self.wrong(path, key, value, "min, max or equals")),
            };
            self.entries.push((path.to_owned(), bound));
        }
        let of = |wanted: fn(&Bound) -> Option<f64>| {
            self.entries.iter().filter(|(other, _)| other == path).find_map(|(_, bound)| wanted(bound))
        };
        let least = of(|bound| if let Bound::Min(limit) = bound { Some(*limit) } else { None });
        let most = of(|bound| if let Bound::Max(limit) = bound { Some(*limit) } else { None });
        if let (Some(least), Some(most)) = (least, most)
            && least > most
        {
            return Err(self.wrong(path, "min", &Toml::Float(least), "no more than max"));
        }
        if bounds.is_empty() {
            return Err(LimitsError::Empty { name: self.name.clone(), path: path.to_owned() });
        }
        Ok(())
    }

    fn wrong(&self, path: &str, key: &str, value: &Toml, expected: &str) -> LimitsError {
        let (name, key) = (self.name.clone(), if key.is_empty() { "limit" } else { key }.to_owned());
        let (path, value, expected) = (path.to_owned(), value.to_string(), expected.to_owned());
        LimitsError::Value { name, path, key, value, expected }
    }

    /// Holds the figures against every limit.
    pub fn judge(&self, summary: &Value) -> Vec<Judgement> {
        let one = |(path, bound): &(String, Bound)| {
            let value = schema::find(summary, path).cloned().unwrap_or(Value::Null);
            let unit = self.figures.leaf(path).map(|leaf| leaf.unit).unwrap_or_default();
            let unit = if unit == "1" { "" } else { &unit };
            let row = Judgement::new(path, value, unit, bound.clone(), self.marginal_share, &self.name);
            Judgement { path: Some(path.clone()), ..row }
        };
        self.entries.iter().map(one).collect()
    }
}

/// Words before the path that is told instead of an unknown one.
fn instead(path: &str) -> &'static str {
    if renamed::figure(path).is_some() { "it is called now" } else { "the nearest path is" }
}

/// A path with the first keys below it, so that a misspelt table is compared by what it holds.
fn whole(mut path: String, mut value: &Toml) -> String {
    while let Some((key, below)) = value.as_table().and_then(|table| table.iter().next()) {
        if KEYS.contains(&key.as_str()) {
            break;
        }
        path = format!("{path}.{key}");
        value = below;
    }
    path
}

/// A finite number, whole or not.
fn as_f64(value: &Toml) -> Option<f64> {
    match value {
        Toml::Integer(whole) => Some(*whole as f64),
        Toml::Float(number) => Some(*number).filter(|number| number.is_finite()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::judgement::Status;

    fn summary() -> Value {
        serde_json::json!({
            "fidelity": "balanced",
            "position": { "horizontal_p95_m": 1.4, "vertical_p95_m": null, "bias_enu_m": [0.1, -0.2, 0.3] },
            "satellites": { "used": 9 },
        })
    }

    #[test]
    fn limits_are_paths_into_the_summary_quoted_or_nested() {
        let text = "marginal_share = 0.05\n\"position.horizontal_p95_m\" = { max = 1.5 }\n\
                    position.bias_enu_m.1 = { min = -0.3, max = -0.1 }\n[satellites]\nused = { min = 10 }\n\
                    [position]\nvertical_p95_m.max = 3\n";
        // TOML forbids to open `position` twice: dotted keys close it.
        assert!(matches!(Limits::parse(text, "l.toml"), Err(LimitsError::Toml { .. })));
        let text = "marginal_share = 0.05\nfidelity = { equals = \"balanced\" }\n\"position.horizontal_p95_m\" = { \
                    max = 1.5 }\n\
                    [satellites]\nused = { min = 10 }\n[position]\nvertical_p95_m.max = 3\nbias_enu_m.1 = { min = \
                    -0.3, max = -0.1 }\n";
        let limits = Limits::parse(text, "l.toml").unwrap();
        let rows = limits.judge(&summary());
        let of = |path: &str| {
            rows.iter().filter(|row| row.path.as_deref() == Some(path)).map(|row| row.status).collect::<Vec<_>>()
        };
        assert_eq!(of("position.horizontal_p95_m"), [Status::Pass]);
        assert_eq!(of("satellites.used"), [Status::Fail]);
        assert_eq!(of("position.vertical_p95_m"), [Status::Fail], "a missing figure fails");
        assert_eq!(of("position.bias_enu_m.1"), [Status::Pass, Status::Pass]);
        assert_eq!(of("fidelity"), [Status::Pass]);
        assert!(rows.iter().all(|row| row.source == "l.toml"));
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_its_path() {
        let refused = |text: &str| Limits::parse(text, "l.toml").unwrap_err().to_string();
        let message = refused("\"position.horizontal_p59_m\" = { max = 1 }");
        assert!(
            message.contains("position.horizontal_p59_m") && message.contains("position.horizontal_p95_m"),
            "{message}"
        );
        assert!(refused("[positoin]\nfixes.min = 1").contains("the nearest path is position"));
        // Names of earlier versions are told with their names now.
        for text in ["\"honesty.nees\" = { max = 4 }", "[honesty]\nnees_mean.max = 4"] {
            let message = refused(text);
            assert!(message.contains("is not in summary.json; it is called now position.nees_mean ("), "{message}");
        }
        let message = refused("position.nees_verdict = { equals = \"honest\" }");
        assert!(message.contains("equals = \"honest\", expected \"consistent\", as it is called now"), "{message}");
        Limits::parse("scene = { equals = \"honest\" }", "l.toml").unwrap();
        assert!(refused("position.fixes = 3").contains("max = 1.5"));
        assert!(refused("position.fixes = { most = 3 }").contains("min, max or equals"));
        assert!(refused("position.fixes = { max = \"3\" }").contains("finite number"));
        assert!(refused("position.fixes = { max = inf }").contains("finite number"));
        assert!(refused("position.fixes = { min = 5, max = 3 }").contains("no more than max"));
        assert!(refused("position.fixes = {}").contains("no limit"));
        assert!(refused("fidelity = { max = 3 }").contains("equals"));
        assert!(refused("").contains("no limit at all"));
        assert!(refused("marginal_share = 2").contains("from 0 to below 1"));
        assert!(refused("a = = 1").contains("l.toml"));
    }
}
