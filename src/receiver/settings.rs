//! The receiver's settings as a TOML file or a scenario's `[receiver]` table writes them.
//!
//! Every key has a default; an unknown key is refused with the nearest right one, a bad value with its key and range.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::receiver::acquire::AcquisitionSettings;
use crate::receiver::position::PositionSettings;
use crate::receiver::track::TrackingSettings;

/// All choices of the receiver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Spacing of observations and fixes: a whole number of milliseconds.
    pub interval_s: f64,
    /// Spacing of rows in `tracking.csv`.
    pub tracking_row_interval_s: f64,
    /// How often satellites that are not tracked are searched again; 0 for never.
    pub search_interval_s: f64,
    /// Earliest GPS week that the recording can be of, when its start was not written down: the message gives weeks modulo
    /// 1024. 1526 is April 2009, so weeks up to November 2028 are told apart.
    pub earliest_week: u32,
    pub acquisition: AcquisitionSettings,
    pub tracking: TrackingSettings,
    pub position: PositionSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            interval_s: 0.1,
            tracking_row_interval_s: 0.1,
            search_interval_s: 30.0,
            earliest_week: 1526,
            acquisition: AcquisitionSettings::default(),
            tracking: TrackingSettings::default(),
            position: PositionSettings::default(),
        }
    }
}

/// Why settings are not accepted.
#[derive(Debug, Error)]
pub enum SettingsError {
    #[error("{origin}: {message}")]
    Syntax { origin: String, message: String },
    #[error("{origin}: unknown key '{key}'{}", nearest.as_ref().map_or(String::new(), |n| format!(": did you mean '{n}'?")))]
    UnknownKey { origin: String, key: String, nearest: Option<String> },
    #[error("{origin}: {key} = {value}: expected {expected}")]
    Range { origin: String, key: String, value: f64, expected: &'static str },
    #[error("{origin}: {message}")]
    Room { origin: String, message: String },
}

impl Settings {
    /// Reads a settings file's text; `origin` names it in messages.
    ///
    /// # Errors
    /// The first thing that is wrong, see [`SettingsError`].
    pub fn parse(text: &str, origin: &str) -> Result<Self, SettingsError> {
        let table = text
            .parse::<toml::Table>()
            .map_err(|error| SettingsError::Syntax { origin: origin.to_owned(), message: error.to_string() })?;
        Self::from_table(table, origin)
    }

    /// Reads a table that was already parsed.
    ///
    /// # Errors
    /// The first thing that is wrong, see [`SettingsError`].
    pub fn from_table(table: toml::Table, origin: &str) -> Result<Self, SettingsError> {
        unknown_key(&table, &known(), "", origin)?;
        let settings: Self = toml::Value::Table(table)
            .try_into()
            .map_err(|error| SettingsError::Syntax { origin: origin.to_owned(), message: error.to_string() })?;
        settings.validate(origin)?;
        Ok(settings)
    }

    fn validate(&self, origin: &str) -> Result<(), SettingsError> {
        let milliseconds = self.interval_s * 1000.0;
        let whole = (milliseconds - milliseconds.round()).abs() < 1e-9 && (1.0..=60_000.0).contains(&milliseconds);
        let mut checks = vec![
            ("interval_s".to_owned(), self.interval_s, whole, "a whole number of milliseconds, 0.001 to 60"),
            (
                "tracking_row_interval_s".to_owned(),
                self.tracking_row_interval_s,
                (0.001..=60.0).contains(&self.tracking_row_interval_s),
                "0.001 to 60",
            ),
            (
                "search_interval_s".to_owned(),
                self.search_interval_s,
                self.search_interval_s == 0.0 || (0.1..=86_400.0).contains(&self.search_interval_s),
                "0 for never, or 0.1 to 86400",
            ),
            ("earliest_week".to_owned(), f64::from(self.earliest_week), self.earliest_week < 10_000, "0 to 9999"),
        ];
        checks.extend(
            self.position.checks().map(|(key, value, good, range)| (format!("position.{key}"), value, good, range)),
        );
        if let Some((key, value, _, expected)) = checks.into_iter().find(|check| !check.2) {
            return Err(SettingsError::Range { origin: origin.to_owned(), key, value, expected });
        }
        let room = |message: String| SettingsError::Room { origin: origin.to_owned(), message };
        self.acquisition.validate().map_err(|error| room(error.to_string()))?;
        // The shortest code period of any signal limits how often loops can be updated.
        let period_s = crate::gnss::signal::SIGNALS
            .iter()
            .flat_map(|signal| signal.components)
            .map(|component| component.period_s())
            .fold(f64::INFINITY, f64::min);
        self.tracking.validate(period_s).map_err(|error| room(error.to_string()))
    }

    /// Ticks of observations in milliseconds.
    pub fn interval_ms(&self) -> u64 {
        (self.interval_s * 1000.0).round() as u64
    }
}

/// Every key that exists, as the default settings write it.
fn known() -> toml::Table {
    toml::Table::try_from(Settings::default()).unwrap_or_default()
}

fn unknown_key(table: &toml::Table, known: &toml::Table, prefix: &str, origin: &str) -> Result<(), SettingsError> {
    for (key, value) in table {
        match (known.get(key), value) {
            (None, _) => {
                let nearest = known
                    .keys()
                    .map(|other| (strsim::damerau_levenshtein(key, other), other))
                    .min()
                    .map(|(_, other)| format!("{prefix}{other}"));
                return Err(SettingsError::UnknownKey {
                    origin: origin.to_owned(),
                    key: format!("{prefix}{key}"),
                    nearest,
                });
            }
            (Some(toml::Value::Table(inner_known)), toml::Value::Table(inner)) => {
                unknown_key(inner, inner_known, &format!("{prefix}{key}."), origin)?;
            }
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_written_keeps_its_default() {
        let settings =
            Settings::parse("[tracking]\npll_bandwidth_hz = 25\n[position]\nmask_deg = 10", "a.toml").unwrap();
        assert_eq!(settings.tracking.pll_bandwidth_hz, 25.0);
        assert_eq!(settings.position.mask_deg, 10.0);
        assert_eq!(settings.acquisition, AcquisitionSettings::default());
    }

    #[test]
    fn every_misspelt_key_is_refused_with_the_right_one() {
        fn walk(table: &toml::Table, path: &[String], found: &mut Vec<Vec<String>>) {
            for (key, value) in table {
                let mut here = path.to_vec();
                here.push(key.clone());
                match value {
                    toml::Value::Table(inner) => walk(inner, &here, found),
                    _ => found.push(here),
                }
            }
        }
        let mut keys = Vec::new();
        walk(&known(), &[], &mut keys);
        assert!(keys.len() > 20);
        for path in keys {
            let (last, tables) = path.split_last().unwrap();
            let header = if tables.is_empty() { String::new() } else { format!("[{}]\n", tables.join(".")) };
            // One letter twice.
            let typo = format!("{}{last}", &last[..1]);
            let error = Settings::parse(&format!("{header}{typo} = 1"), "a.toml").unwrap_err().to_string();
            assert!(error.contains(&typo) && error.contains(&format!("'{}'", path.join("."))), "{error}");
        }
    }

    #[test]
    fn a_bad_value_names_its_key_value_and_range() {
        for (text, parts) in [
            ("interval_s = 0.00015", ["interval_s", "0.00015", "millisecond"]),
            ("[position]\nmask_deg = 91", ["position.mask_deg", "91", "-90 to 90"]),
            ("[tracking]\nintegration = 3", ["tracking.integration", "3", "20"]),
        ] {
            let error = Settings::parse(text, "a.toml").unwrap_err().to_string();
            assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        }
    }
}
