//! True observations and the messages that were sent, as RINEX files.

use std::fs::File;
use std::io::{self, BufWriter};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::{Record, Sink, TruthError};
use crate::scene::Scene;
use gnss::exchange::{NavigationSets, ObservationFile, Version};
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Writer of `observations.rnx` while the truth arrives, and of `navigation.rnx` at the end. They contain the
/// data of an ideal receiver with the scene's clock.
pub struct Rinex {
    directory: PathBuf,
    version: Version,
    observations: Option<ObservationFile<BufWriter<File>>>,
    messages: NavigationSets,
    signals: Vec<&'static Signal>,
    near: Option<Epoch>,
}

impl Rinex {
    /// Creates the writer for an existing directory. Files are made when the truth begins.
    pub fn new(directory: &Path, version: Version) -> Self {
        let (directory, messages) = (directory.to_owned(), NavigationSets::default());
        Self { directory, version, observations: None, messages, signals: Vec::new(), near: None }
    }

    fn create(&self, name: &str) -> Result<BufWriter<File>, TruthError> {
        let path = self.directory.join(name);
        File::create(&path).map(BufWriter::new).map_err(|source| TruthError::File { path, source })
    }

    fn held(&self, name: &str, done: io::Result<()>) -> Result<(), TruthError> {
        done.map_err(|source| TruthError::File { path: self.directory.join(name), source })
    }
}

const OBSERVATIONS: &str = "observations.rnx";
const NAVIGATION: &str = "navigation.rnx";

impl Sink for Rinex {
    fn begin(&mut self, scenes: &[Scene], _: &Range<u64>) -> Result<(), TruthError> {
        for signal in scenes.iter().flat_map(|scene| &scene.signals) {
            if !self.signals.iter().any(|known| known.name == signal.name) {
                self.signals.push(signal);
            }
        }
        let marker = scenes.first().map_or("", |scene| scene.name.as_str());
        let file = self.create(OBSERVATIONS)?;
        self.observations = Some(ObservationFile::new(file, self.version, marker, &self.signals));
        Ok(())
    }

    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        let Some(observations) = &mut self.observations else { return Ok(()) };
        match record {
            // The first of a tick's records.
            Record::Trajectory(row) => {
                let ended = observations.end_epoch();
                observations.set_clock(row.clock_bias_s);
                self.near = Some(row.time());
                self.held(OBSERVATIONS, ended)
            }
            Record::Observation(row) => {
                let taken = observations.take(row);
                self.held(OBSERVATIONS, taken)
            }
            Record::Navigation(row) => {
                self.messages.take(&row);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn finish(&mut self) -> Result<(), TruthError> {
        let (Some(observations), Some(near)) = (&mut self.observations, self.near) else { return Ok(()) };
        let ended = observations.finish();
        self.held(OBSERVATIONS, ended)?;
        let file = self.create(NAVIGATION)?;
        self.held(NAVIGATION, self.messages.write(file, self.version, &self.signals, near))
    }
}
