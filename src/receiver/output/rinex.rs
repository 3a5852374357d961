//! The receiver's observations and the messages that it decoded as RINEX files.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use super::{OutputError, Record, Sink, create_error, write_error};
use gnss::exchange::{NavigationSets, ObservationFile, Version};
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Writes `observations.rnx` as observations come, and `navigation.rnx` at the end.
pub struct Rinex {
    directory: PathBuf,
    version: Version,
    observations: ObservationFile<BufWriter<File>>,
    messages: NavigationSets,
    signals: Vec<&'static Signal>,
    /// Transmit time of the newest observation.
    near: Option<Epoch>,
}

impl Rinex {
    /// Creates the files in an existing directory, for a receiver of these signals at a position named
    /// `marker`.
    ///
    /// # Errors
    ///
    /// [`OutputError::Create`] with the path that cannot be made.
    pub fn create(
        directory: &Path,
        version: Version,
        marker: &str,
        signals: &[&'static Signal],
    ) -> Result<Self, OutputError> {
        let path = directory.join(OBSERVATIONS);
        let file = File::create(&path).map_err(|error| create_error(&path, error))?;
        Ok(Self {
            directory: directory.to_owned(),
            version,
            observations: ObservationFile::new(BufWriter::new(file), version, marker, signals),
            messages: NavigationSets::default(),
            signals: signals.to_vec(),
            near: None,
        })
    }
}

const OBSERVATIONS: &str = "observations.rnx";

impl Sink for Rinex {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        match record {
            Record::Observation(row) => {
                self.near = Some(row.sent());
                let taken = self.observations.take(row);
                taken.map_err(|error| write_error(&self.directory.join(OBSERVATIONS), error))?;
            }
            Record::Fix(fix) => self.observations.set_clock(fix.clock_bias_s),
            Record::Navigation(rows) => rows.iter().for_each(|row| self.messages.take(row)),
            _ => {}
        }
        Ok(())
    }

    fn finish(&mut self, _: &serde_json::Value) -> Result<(), OutputError> {
        let ended = self.observations.finish();
        ended.map_err(|error| write_error(&self.directory.join(OBSERVATIONS), error))?;
        // Without an observation no ephemeris is complete either.
        let Some(near) = self.near else { return Ok(()) };
        let path = self.directory.join("navigation.rnx");
        let file = File::create(&path).map_err(|error| create_error(&path, error))?;
        let written = self.messages.write(BufWriter::new(file), self.version, &self.signals, near);
        written.map_err(|error| write_error(&path, error))
    }
}
