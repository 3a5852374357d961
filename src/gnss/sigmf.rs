//! SigMF metadata: the description of a recording as a data sheet gives it, as JSON beside the samples.
//!
//! Source: SigMF 1.2.0 (core namespace). One capture is written; of other people's files, unknown keys
//! are passed over, and what is absent is left to whoever reads them ([`describe`]). Headers, offsets,
//! channels and data sets of other names are described; a retuning, a later header and an extension that
//! must be known and is not are refused by name. Recordings of one time are grouped by a collection. What
//! has no core key is in an extension: `gnss_twin:spectrum_inverted`, and of samples of a few bits, whose
//! `core:datatype` is `ru8`, `gnss_twin:bits` with `encoding`, `components` (`real`, `iq`, `qi`),
//! `bit_order` (`msb` or `lsb` first), `word_bytes` and `byte_order` (`little` or `big`), and
//! `gnss_twin:signals` with the names of the signals that samples were made of; names that this version does
//! not know are passed over. `gnss_twin:described_signals` has the texts of those that are not built in.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::packed::{Components, Encoding, Interleaved};
use crate::recording::{Description, Samples};
use crate::samples::{Format, IfMetadata};
use crate::signal::Signal;
use crate::signal::described::{DescriptionError, registered, texts_of};
use crate::time::{Epoch, Rate};

const VERSION: &str = "1.2.0";
const EXTENSION: &str = "gnss_twin";

/// Reason for which a text does not describe readable samples.
#[derive(Debug, Error)]
pub enum SigmfError {
    /// Text that is not JSON, or lacks the objects of SigMF.
    #[error("{name}: not SigMF metadata: {error}")]
    Syntax {
        /// Name of the file.
        name: String,
        /// Error of the JSON parser.
        error: serde_json::Error,
    },
    /// A needed key is absent.
    #[error("{name}: {key} is missing: expected {expected}")]
    Missing {
        /// Name of the file.
        name: String,
        /// The key.
        key: &'static str,
        /// Content that is expected there.
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
        /// Content that is expected.
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
    #[serde(flatten)]
    packed: Packed,
    #[serde(rename = "core:offset", skip_serializing_if = "Option::is_none")]
    offset: Option<Value>,
    #[serde(rename = "core:dataset", skip_serializing_if = "Option::is_none")]
    dataset: Option<Value>,
    #[serde(rename = "core:trailing_bytes", skip_serializing_if = "Option::is_none")]
    trailing_bytes: Option<Value>,
    #[serde(rename = "core:metadata_only", skip_serializing_if = "Option::is_none")]
    metadata_only: Option<Value>,
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
    #[serde(rename = "gnss_twin:signals", skip_serializing_if = "Option::is_none")]
    signals: Option<Value>,
    #[serde(rename = "gnss_twin:described_signals", skip_serializing_if = "Vec::is_empty")]
    described_signals: Vec<String>,
}

/// Samples of a few bits.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Packed {
    #[serde(rename = "gnss_twin:bits", skip_serializing_if = "Option::is_none")]
    bits: Option<Value>,
    #[serde(rename = "gnss_twin:encoding", skip_serializing_if = "Option::is_none")]
    encoding: Option<Value>,
    #[serde(rename = "gnss_twin:components", skip_serializing_if = "Option::is_none")]
    components: Option<Value>,
    #[serde(rename = "gnss_twin:bit_order", skip_serializing_if = "Option::is_none")]
    bit_order: Option<Value>,
    #[serde(rename = "gnss_twin:word_bytes", skip_serializing_if = "Option::is_none")]
    word_bytes: Option<Value>,
    #[serde(rename = "gnss_twin:byte_order", skip_serializing_if = "Option::is_none")]
    byte_order: Option<Value>,
}

impl Packed {
    fn of(layout: &Interleaved) -> Self {
        let components = match layout.components {
            Components::Iq => "iq",
            Components::Qi => "qi",
            Components::Real => "real",
        };
        Self {
            bits: Some(layout.bits.into()),
            encoding: Some(layout.encoding.to_string().into()),
            components: Some(components.into()),
            bit_order: Some(if layout.lowest_first { "lsb" } else { "msb" }.into()),
            word_bytes: Some(layout.word_bytes.into()),
            byte_order: Some(if layout.big_endian { "big" } else { "little" }.into()),
        }
    }
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

/// Metadata of a recording beyond the sample format.
#[derive(Clone, Copy, Debug, Default)]
pub struct Beside<'a> {
    /// Signals in the samples; empty if they are unknown.
    pub signals: &'a [&'static Signal],
    /// Base name of the `.sigmf-collection` file to which the recording belongs.
    pub collection: Option<&'a str>,
    /// Packing of the samples in the file. A program that ignores it would read bytes as samples, so the
    /// extension is declared mandatory.
    pub packed: Option<&'a Interleaved>,
}

/// Writes the metadata as the JSON text of a `.sigmf-meta` file.
pub fn write(metadata: &IfMetadata) -> String {
    write_with(metadata, &Beside::default())
}

/// Writes the metadata with the additional data in `beside`.
pub fn write_with(metadata: &IfMetadata, beside: &Beside<'_>) -> String {
    let (datatype, optional) = match beside.packed {
        Some(_) => ("ru8", false),
        None => (metadata.format.name(), true),
    };
    let names = || beside.signals.iter().map(|signal| signal.name).collect::<Value>();
    let document = Document {
        global: Global {
            packed: beside.packed.map(Packed::of).unwrap_or_default(),
            datatype: Some(datatype.into()),
            sample_rate: Some(number(metadata.rate.hz())),
            version: Some(VERSION.into()),
            description: Some("GNSS IF samples".into()),
            channels: None,
            collection: beside.collection.map(Value::from),
            extensions: Some(serde_json::json!([{ "name": EXTENSION, "version": "0.1.0", "optional": optional }])),
            inverted: Some(metadata.inverted.into()),
            signals: (!beside.signals.is_empty()).then(names),
            described_signals: texts_of(beside.signals.iter().copied()),
            ..Global::default()
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

/// Writes the JSON text of a `.sigmf-collection` file (SigMF 1.2.0, "SigMF Collection Format").
pub fn write_collection(description: &str, members: &[Member]) -> String {
    let streams: Vec<Value> =
        members.iter().map(|member| serde_json::json!({ "name": member.name, "hash": member.hash })).collect();
    let collection = serde_json::json!({
        "collection": { "core:version": VERSION, "core:description": description, "core:streams": streams }
    });
    format!("{collection:#}\n")
}

/// Parses the base names of the recordings in the JSON text of a `.sigmf-collection` file. Errors call the
/// file `name`.
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

/// Parses the JSON text of a `.sigmf-meta` file that describes samples in whole bytes completely. Errors call
/// the file `name`.
///
/// # Errors
/// [`SigmfError`] with the file, the key, its value and what was expected.
pub fn parse(text: &str, name: &str) -> Result<IfMetadata, SigmfError> {
    let of = describe(text, name)?;
    let file = File { name };
    let absent = |key, expected| SigmfError::Missing { name: name.to_owned(), key, expected };
    file.only("core:num_channels", u64::from(of.channels), 1, "1 (a single channel)")?;
    file.only("core:header_bytes", of.header_bytes, 0, "0 (no header)")?;
    file.only("core:trailing_bytes", of.trailing_bytes, 0, "0 (samples to the end)")?;
    file.only("core:sample_start", of.skipped_samples, 0, "0 (the capture starts with the file)")?;
    if let Some(dataset) = of.dataset {
        return Err(file.bad("core:dataset", &dataset.into(), "a data set of the same name"));
    }
    let format = match of.samples {
        Some(Samples::Whole(format)) => format,
        Some(_) => return Err(file.bad("core:datatype", &"packed".into(), DATATYPES)),
        None => return Err(absent("core:datatype", DATATYPES)),
    };
    let rate = of.rate.ok_or_else(|| absent("core:sample_rate", RATES))?;
    let center_hz = of.center_hz.ok_or_else(|| absent("core:frequency", FREQUENCIES))?;
    Ok(IfMetadata { format, rate, center_hz, inverted: of.inverted, start: of.start })
}

const DATATYPES: &str = "one of ci8, cu8, ci16_le, cf32_le, ri8, ri16_le";
const RATES: &str = "samples a second, above 0 and below 1e12";
const FREQUENCIES: &str = "the radio frequency at 0 Hz of the samples, in Hz";

/// Parses the JSON text of a `.sigmf-meta` file as far as it describes the samples. Errors call the file
/// `name`.
///
/// # Errors
/// [`SigmfError`] with the file, the key, its value and what was expected: of what is there and cannot be
/// used.
pub fn describe(text: &str, name: &str) -> Result<Description, SigmfError> {
    let document: Document =
        serde_json::from_str(text).map_err(|error| SigmfError::Syntax { name: name.to_owned(), error })?;
    let Document { global, captures, .. } = document;
    let file = File { name };
    file.known(global.extensions.as_ref())?;
    if let Some(value @ Value::Bool(true)) = &global.metadata_only {
        return Err(file.bad("core:metadata_only", value, "false (there are samples)"));
    }
    let samples = file.samples(global.datatype, global.packed)?;
    let rate = match global.sample_rate {
        None => None,
        Some(value) => {
            let rate = value.as_f64().and_then(Rate::from_hz);
            Some(rate.ok_or_else(|| file.bad("core:sample_rate", &value, RATES))?)
        }
    };
    let inverted = match global.inverted {
        None => false,
        Some(Value::Bool(inverted)) => inverted,
        Some(other) => return Err(file.bad("gnss_twin:spectrum_inverted", &other, "true or false")),
    };
    for text in &global.described_signals {
        let refuse = |error: DescriptionError| {
            file.bad("gnss_twin:described_signals", &error.to_string().into(), "texts that describe signals")
        };
        registered(text).map_err(refuse)?;
    }
    let signals = file.signals(global.signals)?;
    let channels = file.count("core:num_channels", global.channels, 1)?;
    let channels = u32::try_from(channels).ok().filter(|channels| (1..=64).contains(channels));
    let channels = channels.ok_or_else(|| file.bad("core:num_channels", &"0, or too many".into(), "1 to 64"))?;
    let offset = file.count("core:offset", global.offset, 0)?;
    let dataset = match global.dataset {
        None => None,
        Some(Value::String(name)) => Some(name),
        Some(other) => return Err(file.bad("core:dataset", &other, "the name of a file")),
    };
    let described = Description {
        samples,
        rate,
        inverted,
        signals,
        channels,
        dataset,
        trailing_bytes: file.count("core:trailing_bytes", global.trailing_bytes, 0)?,
        ..Description::default()
    };
    file.captures(captures, offset, described)
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

    /// Accepts the one value that changes nothing.
    fn only(&self, key: &'static str, value: u64, usual: u64, expected: &'static str) -> Result<(), SigmfError> {
        if value == usual { Ok(()) } else { Err(self.bad(key, &value.into(), expected)) }
    }

    /// A whole number; `usual` where it is absent.
    fn count(&self, key: &'static str, value: Option<Value>, usual: u64) -> Result<u64, SigmfError> {
        match value {
            None => Ok(usual),
            Some(value) => value.as_u64().ok_or_else(|| self.bad(key, &value, "a whole number, 0 or more")),
        }
    }

    /// Returns the signals with known names in the list `said`.
    fn signals(&self, said: Option<Value>) -> Result<Vec<&'static Signal>, SigmfError> {
        let Some(said) = said else { return Ok(Vec::new()) };
        let names = said.as_array().map(|names| names.iter().map(Value::as_str).collect::<Option<Vec<&str>>>());
        let names = names.flatten().ok_or_else(|| self.bad("gnss_twin:signals", &said, "an array of names"))?;
        Ok(names.into_iter().filter_map(Signal::find).collect())
    }

    /// Refuses an extension that must be known and is not.
    fn known(&self, extensions: Option<&Value>) -> Result<(), SigmfError> {
        let all = extensions.and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
        let needed = |extension: &&Value| extension.get("optional") == Some(&Value::Bool(false));
        let foreign = |extension: &&Value| extension.get("name").and_then(Value::as_str) != Some(EXTENSION);
        match all.iter().filter(needed).find(foreign) {
            None => Ok(()),
            Some(extension) => Err(self.bad("core:extensions", extension, "optional ones, and gnss_twin")),
        }
    }

    /// Returns the arrangement of samples in the file, or `None` if no key states it.
    fn samples(&self, datatype: Option<Value>, packed: Packed) -> Result<Option<Samples>, SigmfError> {
        let Some(datatype) = datatype else { return Ok(None) };
        let name = datatype.as_str().unwrap_or_default();
        if let Some(bits) = packed.bits.clone() {
            if name != "ru8" {
                return Err(self.bad("core:datatype", &datatype, "ru8 (bytes) with gnss_twin:bits"));
            }
            let bits = bits.as_u64().and_then(|bits| u32::try_from(bits).ok());
            let wrong = || self.bad("gnss_twin:bits", &packed.bits.clone().unwrap_or_default(), "1, 2, 3, 4, 8 or 16");
            let bits = bits.ok_or_else(wrong)?;
            return self.packed(bits, &packed).map(Some);
        }
        let bytes = |bits: u32, encoding, components, big_endian| {
            let word_bytes = bits as usize / 8;
            let (lowest_first, channels, channel) = (false, 1, 1);
            Interleaved { bits, encoding, components, lowest_first, word_bytes, big_endian, channels, channel }
        };
        Ok(Some(match name {
            "ru8" => Samples::Interleaved(bytes(8, Encoding::Offset, Components::Real, false)),
            "ri16_be" => Samples::Interleaved(bytes(16, Encoding::TwosComplement, Components::Real, true)),
            "ci16_be" => Samples::Interleaved(bytes(16, Encoding::TwosComplement, Components::Iq, true)),
            name => {
                let format = name.parse::<Format>().map_err(|_| self.bad("core:datatype", &datatype, DATATYPES))?;
                Samples::Whole(format)
            }
        }))
    }

    fn packed(&self, bits: u32, packed: &Packed) -> Result<Samples, SigmfError> {
        let encoding = match &packed.encoding {
            None if bits == 1 => Encoding::Sign,
            None => Encoding::TwosComplement,
            Some(value) => {
                let expected = "sign, negative-sign, sign-magnitude, twos-complement or offset";
                let encoding = value.as_str().and_then(|text| text.parse().ok());
                encoding.ok_or_else(|| self.bad("gnss_twin:encoding", value, expected))?
            }
        };
        let components = [("iq", Components::Iq), ("qi", Components::Qi), ("real", Components::Real)];
        let orders = [("msb", false), ("lsb", true)];
        let ends = [("little", false), ("big", true)];
        let of = Interleaved {
            bits,
            encoding,
            components: self.one_of("gnss_twin:components", &packed.components, &components, "iq, qi or real")?,
            lowest_first: self.one_of("gnss_twin:bit_order", &packed.bit_order, &orders, "msb or lsb")?,
            word_bytes: self.count("gnss_twin:word_bytes", packed.word_bytes.clone(), 1)? as usize,
            big_endian: self.one_of("gnss_twin:byte_order", &packed.byte_order, &ends, "little or big")?,
            channels: 1,
            channel: 1,
        };
        Ok(Samples::Interleaved(of))
    }

    /// Returns the meaning of a word. An absent word has the meaning of the first one.
    fn one_of<T: Copy>(
        &self,
        key: &'static str,
        value: &Option<Value>,
        words: &[(&str, T)],
        expected: &'static str,
    ) -> Result<T, SigmfError> {
        let found = match value {
            None => words.first(),
            Some(value) => words.iter().find(|(word, _)| value.as_str() == Some(*word)),
        };
        let value = || value.clone().unwrap_or_default();
        found.map(|(_, meaning)| *meaning).ok_or_else(|| self.bad(key, &value(), expected))
    }

    /// Adds the data of the captures to the recording. Numbers of samples count from `offset`.
    fn captures(&self, captures: Vec<Capture>, offset: u64, of: Description) -> Result<Description, SigmfError> {
        let mut captures = captures.into_iter();
        let Some(first) = captures.next() else { return Ok(of) };
        let from = self.count("core:sample_start", first.sample_start.clone(), offset)?;
        let before = |_| self.bad("core:sample_start", &from.into(), "core:offset, or more");
        let skipped_samples = from.checked_sub(offset).ok_or(()).map_err(before)?;
        let center_hz = match &first.frequency {
            None => None,
            Some(value) => {
                let hz = value.as_f64().filter(|hz| hz.is_finite() && *hz >= 0.0);
                Some(hz.ok_or_else(|| self.bad("core:frequency", value, FREQUENCIES))?)
            }
        };
        for later in captures {
            let header = self.count("core:header_bytes", later.header_bytes, 0)?;
            self.only("core:header_bytes", header, 0, "0 (a header before the first capture alone)")?;
            match later.frequency {
                Some(other) if other.as_f64() != center_hz => {
                    return Err(self.bad("core:frequency", &other, "the frequency of the first capture (no retuning)"));
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
                Some(epoch.ok_or_else(|| self.bad("core:datetime", &value, expected))?)
            }
        };
        let header_bytes = self.count("core:header_bytes", first.header_bytes, 0)?;
        Ok(Description { center_hz, start, header_bytes, skipped_samples, ..of })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gps::l1ca::L1_CA;
    use crate::samples::Format;

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
        let text = write_with(&metadata, &Beside { collection: Some("both"), ..Beside::default() });
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
        let metadata = IfMetadata {
            format: Format::Ci8,
            rate: Rate::from_hz(2.6e6).unwrap(),
            center_hz: 1_575.42e6,
            inverted: false,
            start: Some(Epoch::parse("2010-07-01T00:00:00Z").unwrap()),
        };
        let good = write_with(&metadata, &Beside { signals: &[&L1_CA], ..Beside::default() });
        assert_eq!(describe(&good, "x").unwrap().signals, [&L1_CA]);
        let newer = good.replace("\"GPS L1 C/A\"", "\"GPS L9\", \"GPS L1 C/A\"");
        assert_eq!(describe(&newer, "x").unwrap().signals, [&L1_CA]);
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
            ("\"GPS L1 C/A\"", "1", ["gnss_twin:signals", "1", "array of names"]),
            ("{", "[", ["not SigMF", "", ""]),
        ] {
            let text = good.replace(from, to);
            assert_ne!(text, good, "{from}");
            let error = parse(&text, "there/a.sigmf-meta").unwrap_err().to_string();
            assert!(error.starts_with("there/a.sigmf-meta") && words.iter().all(|w| error.contains(w)), "{error}");
        }
        assert!(parse(r#"{"global":{"core:datatype":"ci8","core:sample_rate":1e6},"captures":[]}"#, "x").is_err());
    }

    #[test]
    fn what_is_absent_is_left_open_and_what_else_is_in_the_file_is_described() {
        let bare = describe(r#"{"global": {"core:datatype": "ci8", "core:version": "1.2.0"}, "captures": []}"#, "x");
        let open = Description { samples: Some(Samples::Whole(Format::Ci8)), ..Description::default() };
        assert_eq!(bare.unwrap(), open);
        assert_eq!(describe(r#"{"global": {}}"#, "x").unwrap(), Description::default());
        let text = r#"{
            "global": {"core:datatype": "cf32_le", "core:dataset": "a.bin", "core:num_channels": 2, "core:offset": 1000,
                "core:trailing_bytes": 7,
                "core:extensions": [{"name": "antenna", "version": "1.0.0", "optional": true}]},
            "captures": [{"core:sample_start": 1020, "core:header_bytes": 512}, {"core:sample_start": 9000}]
        }"#;
        let expected = Description {
            samples: Some(Samples::Whole(Format::Cf32Le)),
            channels: 2,
            header_bytes: 512,
            trailing_bytes: 7,
            skipped_samples: 20,
            dataset: Some("a.bin".to_owned()),
            ..Description::default()
        };
        assert_eq!(describe(text, "x").unwrap(), expected);
        for (from, to, words) in [
            ("true", "false", ["core:extensions", "antenna", "optional ones"]),
            ("1020", "20", ["core:sample_start", "20", "core:offset"]),
            ("\"core:num_channels\": 2", "\"core:num_channels\": 0", ["core:num_channels", "0", "1 to 64"]),
            ("9000", "9000, \"core:header_bytes\": 3", ["core:header_bytes", "3", "first capture"]),
            ("\"core:offset\"", "\"core:metadata_only\": true, \"core:offset\"", ["metadata_only", "true", "samples"]),
        ] {
            let error = describe(&text.replace(from, to), "x").unwrap_err().to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
        }
    }

    #[test]
    fn samples_of_a_few_bits_are_keys_of_an_extension_over_bytes() {
        let text = r#"{"global": {"core:datatype": "ru8", "gnss_twin:bits": 2, "gnss_twin:encoding": "sign_magnitude",
            "gnss_twin:components": "real", "gnss_twin:bit_order": "lsb",
            "core:extensions": [{"name": "gnss_twin", "version": "0.1.0", "optional": false}]}}"#;
        let expected = Interleaved {
            bits: 2,
            encoding: Encoding::SignMagnitude,
            components: Components::Real,
            lowest_first: true,
            word_bytes: 1,
            big_endian: false,
            channels: 1,
            channel: 1,
        };
        assert_eq!(describe(text, "x").unwrap().samples, Some(Samples::Interleaved(expected)));
        assert!(parse(text, "x").unwrap_err().to_string().contains("packed"));
        for (from, to, word) in [
            ("ru8", "ci8", "core:datatype"),
            ("\"lsb\"", "\"up\"", "msb or lsb"),
            ("sign_magnitude", "gray", "offset"),
            ("bits\": 2", "bits\": \"two\"", "gnss_twin:bits"),
        ] {
            let error = describe(&text.replace(from, to), "x").unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        let big = describe(r#"{"global": {"core:datatype": "ci16_be"}}"#, "x").unwrap().samples.unwrap();
        let (format, layout) = big.unpacked().unwrap();
        let mut out = Vec::new();
        layout.unwrap().unpack(&[1, 2, 0xff, 0xfe], &mut out);
        assert_eq!((format, out), (Format::Ci16Le, vec![2, 1, 0xfe, 0xff]));
    }
}
