//! The receiver's settings as a TOML file writes them.
//!
//! Every key has a default, an unknown key is refused with the nearest right one, every value has a range.
//! All errors of a text are reported at once, in its order. The known keys are those of the defaults
//! themselves, so the list cannot go stale.

pub mod array;
pub mod detection;
pub mod osnma;
pub mod reference;

use serde::{Deserialize, Serialize};
use thiserror::Error;
use toml::{Table, Value};

use crate::acquire::{AcquireError, AcquisitionSettings};
use crate::described::described;
use crate::position::PositionSettings;
use crate::position::protection::IntegritySettings;
use crate::track::{TrackingSettings, TrackingSettingsError};
use array::ArraySettings;
use detection::DetectionSettings;
use gnss::place::{Keys, hint, nearest};
use gnss::time::{Epoch, TimeError};
use osnma::OsnmaSettings;

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
    /// Verification of Galileo's message authentication; `None` for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osnma: Option<OsnmaSettings>,
    /// Protection levels; absent: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integrity: Option<IntegritySettings>,
    /// Detectors of jamming and spoofing; absent: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detection: Option<DetectionSettings>,
    /// Spatial filter of an array; absent: several front ends are several bands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub array: Option<ArraySettings>,
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
    /// Factor on the false-alarm probability in searches after the first, but for those at the end of a
    /// recording of less than a second.
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
    /// A text that is no TOML.
    #[error("{origin}: {message}")]
    Toml {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Message of the parser.
        message: String,
    },
    /// A key that there is not.
    #[error("{origin}: unknown key '{}'{}; known here: {known}", key.escape_debug(), hint(key, nearest.as_deref()))]
    UnknownKey {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// The key with its tables.
        key: String,
        /// The known key that is spelled most alike.
        nearest: Option<String>,
        /// The keys that the table has.
        known: String,
    },
    /// A value of the wrong type.
    #[error("{origin}: {key} = {value}: expected {expected}")]
    Type {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// The key with its tables.
        key: String,
        /// The value as it is written.
        value: String,
        /// Values that are expected instead.
        expected: String,
    },
    /// A value out of its range.
    #[error("{origin}: {above}{key} = {value}: expected {expected}")]
    Range {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Tables above the settings, with a dot behind each.
        above: String,
        /// The key with its tables.
        key: &'static str,
        /// The value.
        value: String,
        /// Values that are expected instead.
        expected: String,
    },
    /// A setting of the search.
    #[error("{origin}: {above}{source}")]
    Acquisition {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Tables above the settings, with a dot behind each.
        above: String,
        /// Error of the acquisition settings.
        source: AcquireError,
    },
    /// A setting of the channels.
    #[error("{origin}: {above}{source}")]
    Tracking {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Tables above the settings, with a dot behind each.
        above: String,
        /// Error of the tracking settings.
        source: TrackingSettingsError,
    },
    /// A week reference that is no time.
    #[error("{origin}: {above}operation.week_reference: {source}")]
    Week {
        /// Name of the file, with line and column where they are known.
        origin: String,
        /// Tables above the settings, with a dot behind each.
        above: String,
        /// Error of the week's reference time.
        source: TimeError,
    },
    /// All that is wrong, in the order of the text: two at least.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<SettingsError>),
}

impl Settings {
    /// Reads a TOML text; `origin` names it in errors.
    ///
    /// # Errors
    /// Text that is no TOML, or all unknown keys, values of the wrong type and values out of their range,
    /// each with its position.
    pub fn parse(text: &str, origin: &str) -> Result<Self, SettingsError> {
        Self::read(text, origin, "")
    }

    /// Reads the table `[receiver]` of a scenario's text; defaults if it has none.
    ///
    /// # Errors
    /// Errors of [`Self::parse`].
    pub fn of_scenario(text: &str, origin: &str) -> Result<Self, SettingsError> {
        Self::read(text, origin, "receiver")
    }

    /// Reads the table `above` of a text, or all of it, and gives errors their positions.
    fn read(text: &str, origin: &str, above: &str) -> Result<Self, SettingsError> {
        let keys = Keys::new(origin, text);
        let syntax = |error: toml::de::Error| SettingsError::Toml {
            origin: keys.place(error.span().map_or(0, |span| span.start)),
            message: error.message().replace("wanted ", "expected "),
        };
        let mut table = text.parse::<Table>().map_err(syntax)?;
        let table = match table.remove(above) {
            _ if above.is_empty() => table,
            None => Table::new(),
            Some(Value::Table(table)) => table,
            Some(other) => {
                return Err(SettingsError::Type {
                    origin: keys.place_of(above),
                    key: above.to_owned(),
                    value: other.to_string(),
                    expected: "a table".to_owned(),
                });
            }
        };
        Self::checked(table, origin).map_err(|faults| {
            let mut faults: Vec<_> = faults.into_iter().map(|fault| fault.at(&keys, above)).collect();
            faults.sort_by_key(|(start, _)| *start);
            several(faults.into_iter().map(|(_, fault)| fault).collect())
        })
    }

    /// Reads a TOML table that is in no text.
    ///
    /// # Errors
    /// Errors of [`Self::parse`], without positions.
    pub fn from_table(table: Table, origin: &str) -> Result<Self, SettingsError> {
        Self::checked(table, origin).map_err(several)
    }

    /// Settings of a table, or all that is wrong with it. A key that is refused is left out, so that the rest
    /// is checked against its default.
    fn checked(mut table: Table, origin: &str) -> Result<Self, Vec<SettingsError>> {
        let known = known();
        let mut faults = without_unknown(&mut table, &known, "", origin);
        faults.extend(without_mistyped(&mut table, &known, origin));
        loop {
            let settings: Self = match table.clone().try_into() {
                Ok(settings) => settings,
                Err(error) => {
                    faults.push(SettingsError::Toml { origin: origin.to_owned(), message: error.message().to_owned() });
                    return Err(faults);
                }
            };
            match settings.validate(origin) {
                Ok(()) if faults.is_empty() => return Ok(settings),
                Ok(()) => return Err(faults),
                Err(fault) => {
                    let is_written = remove(&mut table, &fault.key().unwrap_or_default());
                    faults.push(fault);
                    if !is_written {
                        return Err(faults);
                    }
                }
            }
        }
    }

    /// Checks every value's range.
    ///
    /// # Errors
    /// The first value out of its range.
    pub fn validate(&self, origin: &str) -> Result<(), SettingsError> {
        self.acquisition.validate().map_err(|source| SettingsError::Acquisition {
            origin: origin.to_owned(),
            above: String::new(),
            source,
        })?;
        // Longer codes have settings that are fitted to them.
        self.tracking.validate(1e-3).map_err(|source| SettingsError::Tracking {
            origin: origin.to_owned(),
            above: String::new(),
            source,
        })?;
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
        let of_levels = self.integrity.as_ref().map(IntegritySettings::ranges).into_iter().flatten();
        let of_detectors = self.detection.as_ref().map(DetectionSettings::ranges).into_iter().flatten();
        let of_array = self.array.as_ref().map(ArraySettings::ranges).into_iter().flatten();
        for (key, value, low, high) in ranges.into_iter().chain(of_levels).chain(of_detectors).chain(of_array) {
            if !(low..=high).contains(&value) {
                let expected = format!("{low} to {high}");
                return Err(SettingsError::Range {
                    origin: origin.to_owned(),
                    above: String::new(),
                    key,
                    value: value.to_string(),
                    expected,
                });
            }
        }
        let refused = self.osnma.as_ref().map_or(Ok(()), OsnmaSettings::validate);
        let refused = refused.and_then(|()| self.array.as_ref().map_or(Ok(()), ArraySettings::validate));
        refused.map_err(|(key, value, expected)| SettingsError::Range {
            origin: origin.to_owned(),
            above: String::new(),
            key,
            value,
            expected,
        })?;
        if !operation.measurement_interval_ms.is_multiple_of(operation.tracking_interval_ms) {
            return Err(SettingsError::Range {
                origin: origin.to_owned(),
                above: String::new(),
                key: "operation.tracking_interval_ms",
                value: operation.tracking_interval_ms.to_string(),
                expected: format!("a divisor of measurement_interval_ms, {}", operation.measurement_interval_ms),
            });
        }
        let refuse = |source| SettingsError::Week { origin: origin.to_owned(), above: String::new(), source };
        self.week_reference().map_err(refuse)?;
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
    /// Lists the single errors.
    pub fn each(&self) -> &[Self] {
        match self {
            Self::Several(errors) => errors,
            one => std::slice::from_ref(one),
        }
    }

    /// The file's name, with line and column where they are known: the beginning of the message. Empty for
    /// several errors.
    pub fn place(&self) -> &str {
        match self {
            Self::Toml { origin, .. }
            | Self::UnknownKey { origin, .. }
            | Self::Type { origin, .. }
            | Self::Range { origin, .. }
            | Self::Acquisition { origin, .. }
            | Self::Tracking { origin, .. }
            | Self::Week { origin, .. } => origin,
            Self::Several(_) => "",
        }
    }

    /// Key that is at fault, from the settings' own top.
    fn key(&self) -> Option<String> {
        match self {
            Self::Toml { .. } | Self::Several(_) => None,
            Self::UnknownKey { key, .. } | Self::Type { key, .. } => Some(key.clone()),
            Self::Range { key, .. } => Some((*key).to_owned()),
            Self::Acquisition { source: AcquireError::Setting { key, .. }, .. } => Some(format!("acquisition.{key}")),
            Self::Acquisition { source: AcquireError::UnknownSignal { .. }, .. } => {
                Some("acquisition.signals".to_owned())
            }
            Self::Acquisition { .. } => None,
            Self::Tracking { source, .. } => {
                let (TrackingSettingsError::Range { key, .. } | TrackingSettingsError::Bandwidth { key, .. }) = source;
                Some(format!("tracking.{key}"))
            }
            Self::Week { .. } => Some("operation.week_reference".to_owned()),
        }
    }

    /// The error with the position of its key in place of the file's name alone, and the byte at which the
    /// key begins; settings are below `above`.
    fn at(mut self, keys: &Keys<'_>, above: &str) -> (usize, Self) {
        let Some(key) = self.key() else { return (0, self) };
        let whole = if above.is_empty() { key } else { format!("{above}.{key}") };
        match &mut self {
            Self::UnknownKey { origin, key, .. } | Self::Type { origin, key, .. } => {
                (*origin, *key) = (keys.place_of(&whole), whole.clone());
            }
            Self::Range { origin, above: tables, .. }
            | Self::Acquisition { origin, above: tables, .. }
            | Self::Tracking { origin, above: tables, .. }
            | Self::Week { origin, above: tables, .. } => {
                *origin = keys.place_of(&whole);
                *tables = if above.is_empty() { String::new() } else { format!("{above}.") };
            }
            Self::Toml { .. } | Self::Several(_) => {}
        }
        (keys.start_of(&whole).unwrap_or_default(), self)
    }
}

/// One error for all: the only one as it is.
fn several(mut faults: Vec<SettingsError>) -> SettingsError {
    match faults.pop() {
        Some(only) if faults.is_empty() => only,
        last => {
            faults.extend(last);
            SettingsError::Several(faults)
        }
    }
}

/// The keys of the defaults, with their defaults. Tables that are off by default are among them.
fn known() -> Table {
    let settings = Settings {
        osnma: Some(OsnmaSettings::default()),
        integrity: Some(IntegritySettings::default()),
        detection: Some(DetectionSettings::default()),
        array: Some(ArraySettings::default()),
        ..Settings::default()
    };
    // A structure of numbers, words and truth values is a table.
    Table::try_from(settings).unwrap_or_default()
}

/// Takes the keys that `known` does not have out of `table`, by walking both, and returns their errors.
fn without_unknown(table: &mut Table, known: &Table, path: &str, origin: &str) -> Vec<SettingsError> {
    let names: Vec<&str> = known.keys().map(String::as_str).collect();
    let mut faults = Vec::new();
    table.retain(|key, value| {
        let whole = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        match (known.get(key), value) {
            (None, _) => faults.push(SettingsError::UnknownKey {
                origin: origin.to_owned(),
                key: whole,
                nearest: nearest(key, &names),
                known: names.join(", "),
            }),
            (Some(Value::Table(inner)), Value::Table(given)) => {
                faults.extend(without_unknown(given, inner, &whole, origin));
            }
            _ => {}
        }
        known.contains_key(key)
    });
    faults
}

/// Takes the values of a wrong type out of a table, and returns their errors.
fn without_mistyped(table: &mut Table, known: &Table, origin: &str) -> Vec<SettingsError> {
    let mut faults = Vec::new();
    let mut keep = |key: String, value: &Value, alone: Table| {
        let Err(error) = alone.try_into::<Settings>() else { return true };
        let expected = reference::of_type(known, &key, &error);
        faults.push(SettingsError::Type { origin: origin.to_owned(), key, value: value.to_string(), expected });
        false
    };
    table.retain(|section, value| match value {
        Value::Table(given) => {
            given.retain(|key, value| {
                let alone = Table::from_iter([(key.to_owned(), value.clone())]);
                keep(format!("{section}.{key}"), value, Table::from_iter([(section.to_owned(), alone.into())]))
            });
            true
        }
        other => keep(section.to_owned(), other, Table::from_iter([(section.to_owned(), other.clone())])),
    });
    faults
}

/// Takes a key, `section.name`, out of a table; true if it was there.
fn remove(table: &mut Table, key: &str) -> bool {
    let Some((section, name)) = key.split_once('.') else { return false };
    let given = table.get_mut(section).and_then(Value::as_table_mut);
    given.is_some_and(|given| given.remove(name).is_some())
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
            ("pll_order = 7", "s.toml:3:1: receiver.tracking.pll_order = 7: expected 2 or 3"),
            ("dll_bandwidth_hz = -1", "s.toml:3:1: receiver.tracking.dll_bandwidth_hz = -1: expected above 0"),
            ("[receiver.position]\nmask_deg = 91", "s.toml:4:1: receiver.position.mask_deg = 91: expected 0 to 90"),
            ("[receiver.acquisition]\nsignals = ['x']", "s.toml:4:1: receiver.acquisition.signals names 'x'"),
            ("[receiver.operation]\nweek_reference = 'x'", "s.toml:4:1: receiver.operation.week_reference: "),
            ("pll_order = \"x\"", "s.toml:3:1: receiver.tracking.pll_order = \"x\": expected 2 or 3"),
            ("pll_ordr = 3", "s.toml:3:1: unknown key 'receiver.tracking.pll_ordr'"),
        ] {
            let error = Settings::of_scenario(&text(line), "s.toml").unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
        assert_eq!(Settings::of_scenario("name = 1", "s.toml").unwrap(), Settings::default());
    }

    #[test]
    fn all_errors_are_reported_at_once_in_the_order_of_the_text() {
        let text = "[acquisition]\nsignals = ['GPS L9']\n\
                    [tracking]\npll_order = 7\ndll_order = 'two'\npll_bandwith_hz = 15.0\n[positon]\nmask_deg = 3\n\
                    [position]\nmask_deg = 91\n[operation]\nmeasurement_interval_ms = 5\nfram_limit_s = 3\n";
        let error = Settings::parse(text, "rx.toml").unwrap_err();
        let shown: Vec<String> = error.each().iter().map(ToString::to_string).collect();
        let expected = [
            "rx.toml:2:1: acquisition.signals names 'GPS L9': expected some of",
            "rx.toml:4:1: tracking.pll_order = 7: expected 2 or 3",
            "rx.toml:5:1: tracking.dll_order = \"two\": expected ",
            "rx.toml:6:1: unknown key 'tracking.pll_bandwith_hz': did you mean 'pll_bandwidth_hz'?",
            "rx.toml:7:2: unknown key 'positon': did you mean 'position'?",
            "rx.toml:10:1: position.mask_deg = 91: expected 0 to 90",
            "rx.toml:12:1: operation.measurement_interval_ms = 5: expected 10 to 60000",
            "rx.toml:13:1: unknown key 'operation.fram_limit_s': did you mean 'frame_limit_s'?",
        ];
        assert_eq!(shown.len(), expected.len(), "{shown:#?}");
        assert!(shown.iter().zip(expected).all(|(shown, expected)| shown.starts_with(expected)), "{shown:#?}");
    }

    #[test]
    fn every_number_out_of_its_range_is_refused_by_name() {
        // What no key can be: not a number. Walks all keys of the defaults, so that none is forgotten.
        for (section, keys) in known() {
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
