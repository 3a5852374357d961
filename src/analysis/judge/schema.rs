//! The schema of `summary.json`: every key with its unit and meaning, and paths into it.
//!
//! `src/analysis/assets/summary.schema.json` is a JSON Schema (draft 2020-12) with one annotation more:
//! `unit`, which is `1` for counts, ratios and names. A key that may be any word, such as a signal's name, is
//! `*` in a path. A test compares it with what a run really writes.

use serde_json::{Map, Value};
use std::sync::OnceLock;

use gnss::renamed;

/// The schema's text.
pub static TEXT: &str = include_str!("../assets/summary.schema.json");

/// One figure of the summary.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Keys and list positions, joined by dots.
    pub path: String,
    /// Unit of the value.
    pub unit: String,
    /// Meaning of the figure, in words.
    pub meaning: String,
    /// True if the figure is a number, so that it can have a largest or smallest value.
    pub is_number: bool,
}

/// Every figure, in the order of the schema.
pub fn leaves() -> &'static [Leaf] {
    static LEAVES: OnceLock<Vec<Leaf>> = OnceLock::new();
    LEAVES.get_or_init(|| {
        let mut leaves = Vec::new();
        // The text is part of the program and a test reads it: were it damaged there would be no paths.
        if let Ok(schema) = serde_json::from_str::<Value>(TEXT) {
            walk("", &schema, &mut leaves);
        }
        leaves
    })
}

fn walk(path: &str, schema: &Value, leaves: &mut Vec<Leaf>) {
    let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
        properties.iter().for_each(|(key, schema)| walk(&below(key), schema, leaves));
    } else if let Some(items) = schema.get("prefixItems").and_then(Value::as_array) {
        items.iter().enumerate().for_each(|(index, schema)| walk(&below(&index.to_string()), schema, leaves));
    } else if let Some(any) = schema.get("additionalProperties").or(schema.get("items")).filter(|any| any.is_object()) {
        walk(&below(ANY), any, leaves);
    } else {
        let text = |key: &str| schema.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
        let of = |kind: &str| match schema.get("type") {
            Some(Value::String(one)) => one == kind,
            Some(Value::Array(several)) => several.iter().any(|one| one == kind),
            _ => false,
        };
        let is_number = of("number") || of("integer");
        leaves.push(Leaf { path: path.to_owned(), unit: text("unit"), meaning: text("description"), is_number });
    }
}

/// Wildcard in the schema's paths, for any key such as the name of a signal.
const ANY: &str = "*";

/// True if a path of the schema covers a path.
pub fn covers(pattern: &str, path: &str) -> bool {
    let (mut keys, mut own) = (pattern.split('.'), path.split('.'));
    loop {
        match (keys.next(), own.next()) {
            (None, None) => return true,
            (Some(key), Some(own)) if key == ANY || key == own => {}
            _ => return false,
        }
    }
}

/// The figures of a file that limits may name.
#[derive(Clone, Copy, Debug)]
pub struct Figures {
    /// The file.
    pub file: &'static str,
    /// File in which a user finds all paths.
    pub listed: &'static str,
    /// Function that lists all figures.
    pub leaves: fn() -> &'static [Leaf],
}

/// Figures of `summary.json`.
pub static SUMMARY: Figures =
    Figures { file: "summary.json", listed: "src/analysis/assets/summary.schema.json", leaves };

impl Figures {
    /// The figure at a path.
    pub fn leaf(&self, path: &str) -> Option<Leaf> {
        let found = (self.leaves)().iter().find(|leaf| covers(&leaf.path, path))?;
        Some(Leaf { path: path.to_owned(), ..found.clone() })
    }

    /// True if figures lie below a path.
    pub fn is_branch(&self, path: &str) -> bool {
        let keys = path.split('.').count();
        let begin = |leaf: &Leaf| leaf.path.split('.').take(keys).collect::<Vec<_>>().join(".");
        (self.leaves)().iter().any(|leaf| leaf.path.split('.').count() > keys && covers(&begin(leaf), path))
    }

    /// The path most like another: of an earlier version's, that of its name now.
    pub fn nearest(&self, path: &str) -> String {
        let now = renamed::figure(path);
        let (leaves, path) = ((self.leaves)(), now.as_deref().unwrap_or(path));
        let longer = leaves.iter().find(|leaf| now.is_some() && leaf.path.starts_with(path));
        let distance = |leaf: &&Leaf| strsim::damerau_levenshtein(&leaf.path, path);
        longer.or_else(|| leaves.iter().min_by_key(distance)).map(|leaf| leaf.path.clone()).unwrap_or_default()
    }
}

/// The figure of `summary.json` at a path.
pub fn leaf(path: &str) -> Option<Leaf> {
    SUMMARY.leaf(path)
}

/// True if figures of `summary.json` lie below a path.
pub fn is_branch(path: &str) -> bool {
    SUMMARY.is_branch(path)
}

/// The path of `summary.json` most like another.
pub fn nearest(path: &str) -> String {
    SUMMARY.nearest(path)
}

/// The value at a path.
pub fn find<'a>(summary: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(summary, |value, key| match value {
        Value::Object(map) => Map::get(map, key),
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::{
        detected, measured_at_rest, oriented, planted, protected, reported, two_bands, verified, write,
    };
    use crate::judge;
    use std::fs;

    #[test]
    fn every_key_of_the_summary_is_in_the_schema_with_unit_and_meaning_and_no_other() {
        fn paths(path: &str, value: &serde_json::Value, found: &mut Vec<String>) {
            let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
            match value {
                serde_json::Value::Object(map) => map.iter().for_each(|(key, value)| paths(&below(key), value, found)),
                serde_json::Value::Array(list) => {
                    list.iter().enumerate().for_each(|(index, value)| paths(&below(&index.to_string()), value, found));
                }
                _ => found.push(path.to_owned()),
            }
        }
        let run = planted();
        fs::copy(run.path().join("truth/trajectory.csv"), run.path().join("truth/claimed.csv")).unwrap();
        write(&run.path().join("rx/interference.csv"), &[reported(3, 1e5)]);
        two_bands(run.path(), |_| 0.1);
        verified(run.path(), 0.0, false);
        protected(run.path());
        detected(run.path());
        measured_at_rest(run.path());
        oriented(run.path());
        let summary = judge(run.path()).unwrap();
        let mut written = Vec::new();
        paths("", &serde_json::to_value(&summary).unwrap(), &mut written);
        let documented: Vec<&str> = leaves().iter().map(|leaf| leaf.path.as_str()).collect();
        // A list that this run does not have is one null.
        let covered = |path: &str| leaf(path).is_some() || is_branch(path);
        let undocumented: Vec<_> = written.iter().filter(|path| !covered(path)).collect();
        assert!(undocumented.is_empty(), "not in src/analysis/assets/summary.schema.json: {undocumented:?}");
        let there = |path: &str| written.iter().any(|own| covers(path, own) || path.starts_with(&format!("{own}.")));
        let absent: Vec<_> = documented.iter().filter(|path| !there(path)).collect();
        assert!(absent.is_empty(), "in src/analysis/assets/summary.schema.json, but not written: {absent:?}");
        for leaf in leaves() {
            assert!(!leaf.unit.is_empty() && leaf.meaning.len() > 3, "{} has no unit or no meaning", leaf.path);
            // Where a key ends with a unit, the schema says the same one.
            let endings =
                [("_m", "m"), ("_s", "s"), ("_hz", "Hz"), ("_deg", "degrees"), ("_db", "dB"), ("_mps", "m/s")];
            let key = leaf.path.rsplit('.').next().unwrap_or_default();
            for (ending, unit) in
                endings.into_iter().filter(|(ending, _)| key.ends_with(ending) && !key.ends_with("1s"))
            {
                assert_eq!(leaf.unit, unit, "{} ends with {ending}", leaf.path);
            }
        }
    }
}
