//! The receiver's settings as a TOML file writes them.
//!
//! Every key has a default, an unknown key is refused with the nearest right one, every value has a range.
//! The known keys are those of the defaults themselves, so the list cannot go stale.

pub mod reference;

use serde::{Deserialize, Serialize};
use thiserror::Error;
use toml::{Table, Value};

use crate::acquire::{AcquireError, AcquisitionSettings};
use crate::described::described;
use crate::position::PositionSettings;
use crate::track::{TrackingSettings, TrackingSettingsError};
use gnss::place::Keys;
use gnss::time::{Epoch, TimeError};

/// All choices of the receiver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Search.
    pub acquisition: AcquisitionSettings,
    /// Channels.
    pub tracking: TrackingSettings,
    /// Position solution.
    pub position: PositionSettings,
    /// Main loop.
    pub operation: OperationSettings,
}

described! {
/// Settings of the main loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OperationSettings {
    /// Milliseconds between observations and fixes.
    pub measurement_interval_ms: u32,
    /// Milliseconds between rows of `tracking.csv`: a divisor of `measurement_interval_ms`.
    pub tracking_interval_ms: u32,
    /// Time between searches for satellites not found yet.
    pub search_interval_s: f64,
    /// Time between searches for a satellite that was tracked within the last 30 s. It also separates short
    /// searches for expected satellites: those tracked on another signal, and after a fix those that known
    /// ephemerides predict. It is a quarter while a satellite is lost, and doubles after each search without
    /// result, up to 16 times.
    pub reacquisition_interval_s: f64,
    /// Factor on the false-alarm probability in searches after the first.
    pub repeated_false_alarm_share: f64,
    /// Time after which a channel without frame synchronisation is dropped.
    pub frame_limit_s: f64,
    /// GPS time near which the 10-bit week is resolved when the recording has no start time.
    pub week_reference: String,
}
}

impl Default for OperationSettings {
    fn default() -> Self {
        Self {
            measurement_interval_ms: 100,
            tracking_interval_ms: 20,
            search_interval_s: 15.0,
            reacquisition_interval_s: 2.0,
            repeated_false_alarm_share: 0.01,
            frame_limit_s: 40.0,
            week_reference: "2024-01-01T00:00:00".to_owned(),
        }
    }
}

/// Error of refused settings. `origin` is the file's name, with line and column where they are known.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// A text that is no TOML, or a value of the wrong type.
    #[error("{origin}: {message}")]
    Toml {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Message of the parser.
        message: String,
    },
    /// A key that there is not.
    #[error("{origin}: unknown key '{}': expected {expected}", key.escape_debug())]
    UnknownKey {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// The key with its tables.
        key: String,
        /// Keys that are expected instead.
        expected: String,
    },
    /// A value out of its range.
    #[error("{origin}: {key} = {value}: expected {expected}")]
    Range {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// The key with its tables.
        key: &'static str,
        /// The value.
        value: String,
        /// Values that are expected instead.
        expected: String,
    },
    /// A setting of the search.
    #[error("{origin}: {source}")]
    Acquisition {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Error of the acquisition settings.
        source: AcquireError,
    },
    /// A setting of the channels.
    #[error("{origin}: {source}")]
    Tracking {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Error of the tracking settings.
        source: TrackingSettingsError,
    },
    /// A week reference that is no time.
    #[error("{origin}: operation.week_reference: {source}")]
    Week {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Error of the week's reference time.
        source: TimeError,
    },
}

impl Settings {
    /// Reads a TOML text; `origin` names it in errors.
    ///
    /// # Errors
    /// Text that is no TOML, an unknown key, a value of the wrong type or out of its range, each with its
    /// position.
    pub fn parse(text: &str, origin: &str) -> Result<Self, SettingsError> {
        Self::read(text, origin, "", |text| toml::from_str(text))
    }

    /// Reads the table `[receiver]` of a scenario's text; defaults if it has none.
    ///
    /// # Errors
    /// Errors of [`Self::parse`].
    pub fn of_scenario(text: &str, origin: &str) -> Result<Self, SettingsError> {
        #[derive(Deserialize)]
        struct Scenario {
            #[serde(default)]
            receiver: Settings,
        }
        Self::read(text, origin, "receiver", |text| toml::from_str::<Scenario>(text).map(|scenario| scenario.receiver))
    }

    /// Reads the table `above` of a text by `typed`, and gives errors their positions.
    fn read(
        text: &str,
        origin: &str,
        above: &str,
        typed: impl Fn(&str) -> Result<Self, toml::de::Error>,
    ) -> Result<Self, SettingsError> {
        let syntax = |error: toml::de::Error| {
            let keys = Keys::new(origin, text);
            let byte = error.span().map_or(0, |span| span.start);
            let key = keys.holding(byte).map_or(String::new(), |key| format!("{key}: "));
            SettingsError::Toml {
                origin: keys.place(byte),
                message: format!("{key}{}", error.message().replace("wanted ", "expected ")),
            }
        };
        let table = text.parse::<Table>().map_err(syntax)?;
        let table = if above.is_empty() { Some(&table) } else { table.get(above).and_then(Value::as_table) };
        let checked = match table {
            Some(table) => check_keys(table, &known(), above, origin),
            None => Ok(()),
        };
        let checked = checked.and_then(|()| {
            let settings = typed(text).map_err(syntax)?;
            settings.validate(origin).map(|()| settings)
        });
        checked.map_err(|error| error.at(&Keys::new(origin, text), above))
    }

    /// Reads a TOML table that is in no text.
    ///
    /// # Errors
    /// Errors of [`Self::parse`], without positions.
    pub fn from_table(table: Table, origin: &str) -> Result<Self, SettingsError> {
        check_keys(&table, &known(), "", origin)?;
        let settings: Self = table.try_into().map_err(|error: toml::de::Error| {
            let message = error.to_string().trim_end().replace('\n', ", ");
            SettingsError::Toml { origin: origin.to_owned(), message }
        })?;
        settings.validate(origin)?;
        Ok(settings)
    }

    /// Checks every value's range.
    ///
    /// # Errors
    /// The first value out of its range.
    pub fn validate(&self, origin: &str) -> Result<(), SettingsError> {
        self.acquisition
            .validate()
            .map_err(|source| SettingsError::Acquisition { origin: origin.to_owned(), source })?;
        // Longer codes have settings that are fitted to them.
        self.tracking.validate(1e-3).map_err(|source| SettingsError::Tracking { origin: origin.to_owned(), source })?;
        let (position, operation) = (&self.position, &self.operation);
        let measurement_ms = f64::from(operation.measurement_interval_ms);
        #[rustfmt::skip]
        let ranges = [
            ("position.mask_deg", position.mask_deg, 0.0, 90.0),
            ("position.smoothing_s", position.smoothing_s, 0.0, 3600.0),
            ("position.false_alarm", position.false_alarm, 1e-12, 0.5),
            ("position.model_sigma_m", position.model_sigma_m, 1e-3, 100.0),
            ("position.ionosphere_error_share", position.ionosphere_error_share, 0.0, 10.0),
            ("position.ionosphere_wait_s", position.ionosphere_wait_s, 0.0, 1500.0),
            ("operation.measurement_interval_ms", measurement_ms, 10.0, 60_000.0),
            ("operation.tracking_interval_ms", f64::from(operation.tracking_interval_ms), 1.0, measurement_ms),
            ("operation.search_interval_s", operation.search_interval_s, 0.1, 86_400.0),
            ("operation.reacquisition_interval_s", operation.reacquisition_interval_s, 0.1, 86_400.0),
            ("operation.repeated_false_alarm_share", operation.repeated_false_alarm_share, 1e-6, 1.0),
            ("operation.frame_limit_s", operation.frame_limit_s, 12.0, 86_400.0),
        ];
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                let expected = format!("{low} to {high}");
                return Err(SettingsError::Range {
                    origin: origin.to_owned(),
                    key,
                    value: value.to_string(),
                    expected,
                });
            }
        }
        if !operation.measurement_interval_ms.is_multiple_of(operation.tracking_interval_ms) {
            return Err(SettingsError::Range {
                origin: origin.to_owned(),
                key: "operation.tracking_interval_ms",
                value: operation.tracking_interval_ms.to_string(),
                expected: format!("a divisor of measurement_interval_ms, {}", operation.measurement_interval_ms),
            });
        }
        self.week_reference().map_err(|source| SettingsError::Week { origin: origin.to_owned(), source })?;
        Ok(())
    }

    /// The time near which weeks are resolved without a start time.
    ///
    /// # Errors
    /// A text that is no time.
    pub fn week_reference(&self) -> Result<Epoch, TimeError> {
        Epoch::parse(&self.operation.week_reference)
    }
}

impl SettingsError {
    /// The file's name, with line and column where they are known: what the message begins with.
    pub fn place(&self) -> &str {
        match self {
            Self::Toml { origin, .. }
            | Self::UnknownKey { origin, .. }
            | Self::Range { origin, .. }
            | Self::Acquisition { origin, .. }
            | Self::Tracking { origin, .. }
            | Self::Week { origin, .. } => origin,
        }
    }

    /// The error with the position of its key instead of the file's name alone; settings are below `above`.
    fn at(mut self, keys: &Keys<'_>, above: &str) -> Self {
        let below = |key: String| if above.is_empty() { key } else { format!("{above}.{key}") };
        let (origin, key) = match &mut self {
            Self::Toml { .. } => return self,
            Self::UnknownKey { origin, key, .. } => {
                let key = key.clone();
                (origin, key)
            }
            Self::Range { origin, key, .. } => (origin, below((*key).to_owned())),
            Self::Acquisition { origin, source } => {
                let AcquireError::Setting { key, .. } = source else { return self };
                (origin, below(format!("acquisition.{key}")))
            }
            Self::Tracking { origin, source } => {
                let (TrackingSettingsError::Range { key, .. } | TrackingSettingsError::Bandwidth { key, .. }) = source;
                (origin, below(format!("tracking.{key}")))
            }
            Self::Week { origin, .. } => (origin, below("operation.week_reference".to_owned())),
        };
        *origin = keys.place_of(&key);
        self
    }
}

/// The keys of the defaults, with their defaults.
fn known() -> Table {
    Table::try_from(Settings::default()).unwrap_or_default()
}

/// Refuses the first key of `table` that `known` does not have, by walking both.
fn check_keys(table: &Table, known: &Table, path: &str, origin: &str) -> Result<(), SettingsError> {
    for (key, value) in table {
        let whole = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match (known.get(key), value) {
            (None, _) => {
                let nearest = known.keys().max_by(|a, b| {
                    strsim::jaro_winkler(a, key).total_cmp(&strsim::jaro_winkler(b, key)).then_with(|| b.cmp(a))
                });
                let expected = match nearest {
                    Some(near) if strsim::jaro_winkler(near, key) > 0.7 => format!("perhaps '{near}'"),
                    _ => format!("one of {}", known.keys().cloned().collect::<Vec<_>>().join(", ")),
                };
                return Err(SettingsError::UnknownKey { origin: origin.to_owned(), key: whole, expected });
            }
            (Some(Value::Table(inner)), Value::Table(given)) => check_keys(given, inner, &whole, origin)?,
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_written_is_the_default_and_defaults_are_valid() {
        assert_eq!(Settings::parse("", "x").unwrap(), Settings::default());
    }

    #[test]
    fn an_unknown_key_is_refused_with_the_nearest_right_one() {
        for (text, key, near) in [
            (
                "[tracking]\npll_bandwith_hz = 15.0",
                "rx.toml:2:1: unknown key 'tracking.pll_bandwith_hz'",
                "pll_bandwidth_hz",
            ),
            ("[positon]", "rx.toml:1:2: unknown key 'positon'", "position"),
            ("[position]\nsmoothing = 3.0", "rx.toml:2:1: unknown key 'position.smoothing'", "smoothing_s"),
        ] {
            let error = Settings::parse(text, "rx.toml").unwrap_err().to_string();
            assert!(error.contains("rx.toml") && error.contains(key) && error.contains(near), "{error}");
        }
    }

    #[test]
    fn settings_in_a_scenario_are_refused_at_their_line_there() {
        let text = |line: &str| format!("name = \"x\"\n[receiver.tracking]\n{line}\n");
        for (line, expected) in [
            ("pll_order = 7", "s.toml:3:1: tracking.pll_order = 7: expected 2 or 3"),
            ("pll_order = \"x\"", "s.toml:3:13: receiver.tracking.pll_order: invalid type"),
            ("pll_ordr = 3", "s.toml:3:1: unknown key 'receiver.tracking.pll_ordr'"),
        ] {
            let error = Settings::of_scenario(&text(line), "s.toml").unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
        assert_eq!(Settings::of_scenario("name = 1", "s.toml").unwrap(), Settings::default());
    }

    #[test]
    fn every_number_out_of_its_range_is_refused_by_name() {
        // What no key can be: not a number. Walks all keys of the defaults, so that none is forgotten.
        for (section, keys) in Table::try_from(Settings::default()).unwrap() {
            for (key, value) in keys.as_table().unwrap() {
                let bad = match value {
                    Value::Float(_) => "nan",
                    Value::Integer(_) => "4294967295",
                    Value::String(_) => "'?'",
                    _ => "7",
                };
                let error = Settings::parse(&format!("[{section}]\n{key} = {bad}"), "rx.toml").unwrap_err().to_string();
                assert!(error.contains(key.as_str()), "{section}.{key}: {error}");
            }
        }
    }
}
