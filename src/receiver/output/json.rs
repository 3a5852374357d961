//! The receiver's records as JSON lines: one object a line, with its kind under `record`.

use std::io::Write;
use std::path::PathBuf;

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{OutputError, Record, Sink, write_error};
use gnss::earth::Geodetic;
use gnss::record::Fix;

/// Writes fixes, satellites in view, the ionosphere that two bands show, channels, searches, events and lines
/// of interference, and at the end the summary. Observations and parameters of messages are in tables alone.
pub struct JsonLines<W> {
    name: PathBuf,
    writer: W,
}

impl<W: Write> JsonLines<W> {
    /// A sink to a writer that messages call `name`.
    pub fn new(name: PathBuf, writer: W) -> Self {
        Self { name, writer }
    }

    fn line(&mut self, kind: &str, row: Value) -> Result<(), OutputError> {
        let mut line = Map::new();
        line.insert("record".to_owned(), json!(kind));
        match row {
            Value::Object(fields) => line.extend(fields),
            other => _ = line.insert("rows".to_owned(), other),
        }
        let text = Value::Object(line).to_string() + "\n";
        let written = self.writer.write_all(text.as_bytes()).and_then(|()| self.writer.flush());
        written.map_err(|error| write_error(&self.name, error))
    }

    fn row(&mut self, kind: &str, row: &impl Serialize) -> Result<(), OutputError> {
        let value = serde_json::to_value(row).map_err(|error| OutputError::Refused(Box::new(error)))?;
        self.line(kind, value)
    }

    /// A fix with its position as people read it.
    fn fix(&mut self, fix: &Fix) -> Result<(), OutputError> {
        let place = Geodetic::from_ecef(&fix.position_m());
        let mut value = serde_json::to_value(fix).map_err(|error| OutputError::Refused(Box::new(error)))?;
        value["utc"] = json!(fix.time().to_utc_text());
        value["latitude_deg"] = json!(place.latitude_rad.to_degrees());
        value["longitude_deg"] = json!(place.longitude_rad.to_degrees());
        value["height_m"] = json!(place.height_m);
        self.line("fix", value)
    }
}

impl<W: Write> Sink for JsonLines<W> {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        match record {
            Record::Fix(fix) => self.fix(&fix),
            Record::Sights(rows) => self.row("satellites", &rows),
            Record::Ionosphere(rows) if rows.is_empty() => Ok(()),
            Record::Ionosphere(rows) => self.row("ionosphere", &rows),
            Record::Integrity(row) => self.row("integrity", &row),
            Record::Detection(row) => self.row("detection", &row),
            Record::Attitude(row, _) => self.row("attitude", &row),
            Record::Tracking(row) => self.row("channel", &row),
            Record::Event(row) => self.row("event", &row),
            Record::Acquisition(row) => self.row("search", &row),
            Record::Interference { front_end, row } => {
                let mut value = serde_json::to_value(&row).map_err(|error| OutputError::Refused(Box::new(error)))?;
                value["front_end"] = json!(front_end);
                self.line("interference", value)
            }
            Record::Tag(row) => self.row("tag", &row),
            Record::Clocks(_) | Record::Observation(_) | Record::Navigation(_) => Ok(()),
        }
    }

    fn finish(&mut self, summary: &Value) -> Result<(), OutputError> {
        self.line("summary", summary.clone())
    }
}
