//! SigMF metadata: what a data sheet says of a recording, as JSON beside the samples.
//!
//! Source: SigMF 1.2.0 (core namespace). One capture is written; of other people's files, unknown keys are
//! passed over, while whatever would change the meaning of the samples (several channels, a header, a
//! retuning) is refused. Recordings of one time are grouped by a collection. An inverted spectrum has no core
//! key: it is written in an optional extension, `gnss_twin:spectrum_inverted`.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::gnss::samples::IfMetadata;
use crate::gnss::time::{Epoch, Rate};

const VERSION: &str = "1.2.0";
const EXTENSION: &str = "gnss_twin";

/// Why a text does not describe samples that can be read.
#[derive(Debug, Error)]
pub enum SigmfError {
    /// Not JSON, or not the objects that SigMF asks for.
    #[error("{name}: not SigMF metadata: {error}")]
    Syntax {
        /// Name of the file.
        name: String,
        /// What the parser reports.
        error: serde_json::Error,
    },
    /// A needed key is absent.
    #[error("{name}: {key} is missing: expected {expected}")]
    Missing {
        /// Name of the file.
        name: String,
        /// The key.
        key: &'static str,
        /// What is expected there.
        expected: &'static str,
    },
    /// A key has a value that cannot be used.
    #[error("{name}: {key} is {value}: expected {expected}")]
    Value {
        /// Name of the file.
        name: String,
        /// The key.
        key: &'static str,
        /// The value as written.
        value: String,
        /// What is expected.
        expected: &'static str,
    },
}

#[derive(Serialize, Deserialize)]
struct Document {
    global: Global,
    #[serde(default)]
    captures: Vec<Capture>,
    #[serde(default)]
    annotations: Vec<Value>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Global {
    #[serde(rename = "core:datatype", skip_serializing_if = "Option::is_none")]
    datatype: Option<Value>,
    #[serde(rename = "core:sample_rate", skip_serializing_if = "Option::is_none")]
    sample_rate: Option<Value>,
    #[serde(rename = "core:version", skip_serializing_if = "Option::is_none")]
    version: Option<Value>,
    #[serde(rename = "core:description", skip_serializing_if = "Option::is_none")]
    description: Option<Value>,
    #[serde(rename = "core:num_channels", skip_serializing_if = "Option::is_none")]
    channels: Option<Value>,
    #[serde(rename = "core:collection", skip_serializing_if = "Option::is_none")]
    collection: Option<Value>,
    #[serde(rename = "core:extensions", skip_serializing_if = "Option::is_none")]
    extensions: Option<Value>,
    #[serde(rename = "gnss_twin:spectrum_inverted", skip_serializing_if = "Option::is_none")]
    inverted: Option<Value>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Capture {
    #[serde(rename = "core:sample_start", skip_serializing_if = "Option::is_none")]
    sample_start: Option<Value>,
    #[serde(rename = "core:frequency", skip_serializing_if = "Option::is_none")]
    frequency: Option<Value>,
    #[serde(rename = "core:datetime", skip_serializing_if = "Option::is_none")]
    datetime: Option<Value>,
    #[serde(rename = "core:header_bytes", skip_serializing_if = "Option::is_none")]
    header_bytes: Option<Value>,
}

/// The metadata as the JSON text of a `.sigmf-meta` file.
pub fn write(metadata: &IfMetadata) -> String {
    write_in(metadata, None)
}

/// [`write()`] of a recording that belongs to a collection: the base name of its `.sigmf-collection` file.
pub fn write_in(metadata: &IfMetadata, collection: Option<&str>) -> String {
    let document = Document {
        global: Global {
            datatype: Some(metadata.format.name().into()),
            sample_rate: Some(number(metadata.rate.hz())),
            version: Some(VERSION.into()),
            description: Some("GNSS IF samples".into()),
            channels: None,
            collection: collection.map(Value::from),
            extensions: Some(serde_json::json!([{ "name": EXTENSION, "version": "0.1.0", "optional": true }])),
            inverted: Some(metadata.inverted.into()),
        },
        captures: vec![Capture {
            sample_start: Some(0.into()),
            frequency: Some(number(metadata.center_hz)),
            datetime: metadata.start.map(|start| utc_text(start).into()),
            header_bytes: None,
        }],
        annotations: Vec::new(),
    };
    // `Value` displays as JSON; these structs have string keys only, so nothing can fail on the way there.
    serde_json::to_value(&document).map_or_else(|_| String::new(), |value| format!("{value:#}\n"))
}

/// A recording of a collection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Base name of its files.
    pub name: String,
    /// SHA-512 of its `.sigmf-meta` file, in hexadecimal digits.
    pub hash: String,
}

/// The JSON text of a `.sigmf-collection` file (SigMF 1.2.0, "SigMF Collection Format").
pub fn write_collection(description: &str, members: &[Member]) -> String {
    let streams: Vec<Value> =
        members.iter().map(|member| serde_json::json!({ "name": member.name, "hash": member.hash })).collect();
    let collection = serde_json::json!({
        "collection": { "core:version": VERSION, "core:description": description, "core:streams": streams }
    });
    format!("{collection:#}\n")
}

/// The base names of the recordings in the JSON text of a `.sigmf-collection` file; `name` is how errors call
/// it.
///
/// # Errors
/// [`SigmfError`] with the file, the key, its value and what was expected.
pub fn parse_collection(text: &str, name: &str) -> Result<Vec<String>, SigmfError> {
    let document: Value =
        serde_json::from_str(text).map_err(|error| SigmfError::Syntax { name: name.to_owned(), error })?;
    let (file, key, expected) = (File { name }, "core:streams", "an array of recordings, each with a name");
    let streams = document.get("collection").and_then(|collection| collection.get(key)).cloned();
    let streams = file.needed(key, streams, expected)?;
    // Before 1.0.1 a recording was an array of its name and its hash.
    let of = |stream: &Value| stream.get("name").or(stream.get(0)).and_then(Value::as_str).map(str::to_owned);
    let names = streams.as_array().and_then(|streams| streams.iter().map(of).collect::<Option<Vec<String>>>());
    names.ok_or_else(|| file.bad(key, &streams, expected))
}

/// A whole number without a fraction, as people write sample rates.
fn number(x: f64) -> Value {
    if x.floor() == x && x.abs() < 1e15 { (x as i64).into() } else { x.into() }
}

/// ISO 8601 in UTC with as many digits as the instant needs to read back the same.
fn utc_text(start: Epoch) -> String {
    let whole = Epoch::new(start.seconds(), 0.0).to_utc_text();
    let whole = whole.split('.').next().unwrap_or_default();
    // `Display` of f64 is the shortest decimal that reads back the same, never with an exponent.
    let fraction = start.fraction().to_string();
    format!("{whole}.{}Z", fraction.strip_prefix("0.").unwrap_or("0"))
}

/// Reads the JSON text of a `.sigmf-meta` file; `name` is how errors call it.
///
/// # Errors
/// [`SigmfError`] with the file, the key, its value and what was expected.
pub fn parse(text: &str, name: &str) -> Result<IfMetadata, SigmfError> {
    let document: Document =
        serde_json::from_str(text).map_err(|error| SigmfError::Syntax { name: name.to_owned(), error })?;
    let Document { global, captures, .. } = document;
    let file = File { name };

    let expected = "one of ci8, cu8, ci16_le, cf32_le, ri8, ri16_le";
    let datatype = file.needed("core:datatype", global.datatype, expected)?;
    let format = datatype.as_str().and_then(|text| text.parse().ok());
    let format = format.ok_or_else(|| file.bad("core:datatype", &datatype, expected))?;

    let expected = "samples a second, above 0 and below 1e12";
    let sample_rate = file.needed("core:sample_rate", global.sample_rate, expected)?;
    let rate = sample_rate.as_f64().and_then(Rate::from_hz);
    let rate = rate.ok_or_else(|| file.bad("core:sample_rate", &sample_rate, expected))?;

    file.only("core:num_channels", global.channels, 1, "1 (a single channel)")?;
    let inverted = match global.inverted {
        None => false,
        Some(Value::Bool(inverted)) => inverted,
        Some(other) => return Err(file.bad("gnss_twin:spectrum_inverted", &other, "true or false")),
    };

    let mut captures = captures.into_iter();
    let expected = "the radio frequency at 0 Hz of the samples, in Hz";
    let Some(first) = captures.next() else {
        return Err(SigmfError::Missing { name: name.to_owned(), key: "captures[0]", expected: "one capture" });
    };
    file.only("core:sample_start", first.sample_start, 0, "0 (the capture starts with the file)")?;
    file.only("core:header_bytes", first.header_bytes, 0, "0 (no header)")?;
    let frequency = file.needed("core:frequency", first.frequency, expected)?;
    let center_hz = frequency.as_f64().filter(|hz| hz.is_finite() && *hz >= 0.0);
    let center_hz = center_hz.ok_or_else(|| file.bad("core:frequency", &frequency, expected))?;
    for later in captures {
        file.only("core:header_bytes", later.header_bytes, 0, "0 (no header)")?;
        match later.frequency {
            Some(other) if other.as_f64() != Some(center_hz) => {
                return Err(file.bad("core:frequency", &other, "the frequency of the first capture (no retuning)"));
            }
            _ => {}
        }
    }

    let expected = "ISO 8601 in UTC with a final Z, like 2010-07-01T08:12:30.5Z";
    let start = match first.datetime {
        None => None,
        Some(value) => {
            let text = value.as_str().filter(|text| text.ends_with('Z'));
            let epoch = text.and_then(|text| Epoch::parse(text).ok());
            Some(epoch.ok_or_else(|| file.bad("core:datetime", &value, expected))?)
        }
    };
    Ok(IfMetadata { format, rate, center_hz, inverted, start })
}

/// Makes errors that name the file.
struct File<'a> {
    name: &'a str,
}

impl File<'_> {
    fn bad(&self, key: &'static str, value: &Value, expected: &'static str) -> SigmfError {
        SigmfError::Value { name: self.name.to_owned(), key, value: value.to_string(), expected }
    }

    fn needed(&self, key: &'static str, value: Option<Value>, expected: &'static str) -> Result<Value, SigmfError> {
        value.ok_or_else(|| SigmfError::Missing { name: self.name.to_owned(), key, expected })
    }

    /// Accepts absence and the one value that changes nothing.
    fn only(
        &self,
        key: &'static str,
        value: Option<Value>,
        usual: u64,
        expected: &'static str,
    ) -> Result<(), SigmfError> {
        match value {
            Some(value) if value.as_u64() != Some(usual) => Err(self.bad(key, &value, expected)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::samples::Format;

    #[test]
    fn metadata_read_back_as_written() {
        let starts = [
            None,
            Some(Epoch::parse("2010-07-01T00:00:00").unwrap()),
            Some(Epoch::parse("2021-12-02T03:04:05.123456789012Z").unwrap()),
            Some(Epoch::new(1_000_000_000, 1e-9)),
            Some(Epoch::new(1_000_000_000, 1.0 - 1.2e-16)),
        ];
        for start in starts {
            for (format, _) in Format::NAMES {
                for inverted in [false, true] {
                    let metadata = IfMetadata {
                        format,
                        rate: Rate::from_hz(16_367_666.667).unwrap(),
                        center_hz: 1_575.42e6 + 0.25,
                        inverted,
                        start,
                    };
                    let text = write(&metadata);
                    // Exact, so much better than a nanosecond.
                    assert_eq!(parse(&text, "a.sigmf-meta").unwrap(), metadata, "{text}");
                }
            }
        }
    }

    #[test]
    fn a_collection_names_its_recordings_and_they_name_it() {
        let members = ["narrow", "wide"].map(|name| Member { name: name.to_owned(), hash: "0".repeat(128) });
        let text = write_collection("two bands", &members);
        assert_eq!(parse_collection(&text, "x").unwrap(), ["narrow", "wide"]);
        let tuples = r#"{"collection": {"core:streams": [["a", "00"], ["b", "11"]]}}"#;
        assert_eq!(parse_collection(tuples, "x").unwrap(), ["a", "b"]);
        let of = |text: &str| parse_collection(text, "there/a.sigmf-collection").unwrap_err().to_string();
        for (text, word) in [("[", "not SigMF"), ("{}", "missing"), (r#"{"collection":{"core:streams":[1]}}"#, "[1]")] {
            assert!(of(text).starts_with("there/a.sigmf-collection") && of(text).contains(word), "{}", of(text));
        }
        let metadata = IfMetadata {
            format: Format::Ci8,
            rate: Rate::from_hz(2.6e6).unwrap(),
            center_hz: 1_575.42e6,
            inverted: false,
            start: None,
        };
        let text = write_in(&metadata, Some("both"));
        assert!(text.contains("\"core:collection\": \"both\""), "{text}");
        assert_eq!(parse(&text, "x").unwrap(), metadata);
        assert!(!write(&metadata).contains("core:collection"));
    }

    #[test]
    fn other_peoples_files_are_read_and_their_unknown_keys_passed_over() {
        let text = r#"{
            "global": {"core:datatype": "ci16_le", "core:sample_rate": 4e6, "core:version": "1.0.0",
                "core:geolocation": {"type": "Point", "coordinates": [1.5, 2.5]}, "core:author": "N. N.",
                "antenna:gain": 3, "core:num_channels": 1},
            "captures": [{"core:sample_start": 0, "core:frequency": 1575420000, "core:datetime": "2021-12-02T03:04:05Z",
                "core:geolocation": {}}, {"core:sample_start": 500}],
            "annotations": [{"core:sample_start": 0, "core:label": "x"}], "collection": {}
        }"#;
        let metadata = parse(text, "x").unwrap();
        assert_eq!((metadata.format, metadata.rate.hz()), (Format::Ci16Le, 4e6));
        assert_eq!((metadata.center_hz, metadata.inverted), (1_575.42e6, false));
        // 18 leap seconds since 2017 (IERS Bulletin C 52).
        assert_eq!(metadata.start, Some(Epoch::parse("2021-12-02T03:04:23").unwrap()));
    }

    #[test]
    fn errors_name_file_key_value_and_what_was_expected() {
        let good = write(&IfMetadata {
            format: Format::Ci8,
            rate: Rate::from_hz(2.6e6).unwrap(),
            center_hz: 1_575.42e6,
            inverted: false,
            start: Some(Epoch::parse("2010-07-01T00:00:00Z").unwrap()),
        });
        for (from, to, words) in [
            ("\"ci8\"", "\"ci12\"", ["core:datatype", "ci12", "ci16_le"]),
            ("\"core:datatype\"", "\"core:data\"", ["core:datatype", "missing", "ci16_le"]),
            ("2600000", "-1", ["core:sample_rate", "-1", "above 0"]),
            ("2600000", "\"fast\"", ["core:sample_rate", "fast", "above 0"]),
            ("1575420000", "null", ["core:frequency", "missing", "Hz"]),
            ("2010-07-01T00:00:00.0Z", "2010-07-01T00:00:00", ["core:datetime", "2010-07-01T00:00:00", "UTC"]),
            ("\"core:sample_start\": 0", "\"core:sample_start\": 9", ["core:sample_start", "9", "0"]),
            (
                "\"core:sample_start\": 0",
                "\"core:header_bytes\": 512, \"core:sample_start\": 0",
                ["core:header_bytes", "512", "0"],
            ),
            ("false", "\"no\"", ["spectrum_inverted", "no", "true or false"]),
            ("{", "[", ["not SigMF", "", ""]),
        ] {
            let text = good.replace(from, to);
            assert_ne!(text, good, "{from}");
            let error = parse(&text, "there/a.sigmf-meta").unwrap_err().to_string();
            assert!(error.starts_with("there/a.sigmf-meta") && words.iter().all(|w| error.contains(w)), "{error}");
        }
        assert!(parse(r#"{"global":{"core:datatype":"ci8","core:sample_rate":1e6},"captures":[]}"#, "x").is_err());
    }
}
