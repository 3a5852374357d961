//! The receiver's keys with default, range and meaning, from the settings themselves.
//!
//! Defaults are those of [`Settings::default`], meanings the doc comments of the fields, and a range is what
//! the validation says when a value that no key can have is refused.

use toml::{Table, Value};

use super::array::ArraySettings;
use super::detection::DetectionSettings;
use super::osnma::OsnmaSettings;
use super::{OperationSettings, Settings};
use crate::acquire::AcquisitionSettings;
use crate::position::PositionSettings;
use crate::position::protection::IntegritySettings;
use crate::track::TrackingSettings;

/// One key of the receiver's settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Described {
    /// Name within its table.
    pub name: String,
    /// Default as TOML.
    pub default: String,
    /// Values that the key accepts.
    pub expected: String,
    /// Meaning of the key.
    pub meaning: String,
}

/// Every table of the settings with its keys.
pub fn tables() -> Vec<(String, Vec<Described>)> {
    let meanings = [
        ("acquisition", AcquisitionSettings::MEANINGS),
        ("tracking", TrackingSettings::MEANINGS),
        ("position", PositionSettings::MEANINGS),
        ("operation", OperationSettings::MEANINGS),
        ("osnma", OsnmaSettings::MEANINGS),
        ("integrity", IntegritySettings::MEANINGS),
        ("detection", DetectionSettings::MEANINGS),
        ("array", ArraySettings::MEANINGS),
    ];
    let defaults = super::known();
    let described = |section: &str, name: &str, default: &Value| {
        let meaning = meanings.iter().find(|(table, _)| *table == section).and_then(|(_, keys)| {
            keys.iter().find(|(key, _)| *key == name).map(|(_, lines)| lines.iter().map(|line| line.trim()))
        });
        Described {
            name: name.to_owned(),
            default: default.to_string(),
            expected: expected(section, name, default),
            meaning: meaning.map(|lines| lines.collect::<Vec<_>>().join(" ")).unwrap_or_default(),
        }
    };
    let of = |(section, keys): (&String, &Value)| {
        let keys = keys.as_table().into_iter().flatten();
        (section.clone(), keys.map(|(name, default)| described(section, name, default)).collect())
    };
    defaults.iter().map(of).collect()
}

/// Values that a key of a table, `section.name`, accepts where serde refused the type of one.
pub(super) fn of_type(defaults: &Table, key: &str, error: &toml::de::Error) -> String {
    let default = key.split_once('.').and_then(|(section, name)| {
        let default = defaults.get(section)?.get(name)?;
        // The range of a number; serde itself names the words of a choice.
        matches!(default, Value::Float(_) | Value::Integer(_)).then(|| expected(section, name, default))
    });
    let tail = || error.message().split_once("expected ").map_or("another type", |(_, tail)| tail).to_owned();
    default.unwrap_or_else(tail)
}

/// Values that a key accepts, taken from its error message.
fn expected(section: &str, name: &str, default: &Value) -> String {
    // What no key can be.
    let bad = match default {
        Value::Float(_) => "nan",
        Value::Integer(_) => "4294967295",
        Value::Boolean(_) => return "true or false".to_owned(),
        Value::Array(_) => return "an array".to_owned(),
        _ => "'?'",
    };
    let refused = Settings::parse(&format!("[{section}]\n{name} = {bad}"), "").err().map(|error| error.to_string());
    let tail = refused.and_then(|text| text.split_once("expected ").map(|(_, tail)| tail.trim().to_owned()));
    tail.unwrap_or_else(|| default.type_str().to_owned())
}
