//! The truth as values: what is true of a scene ([`Record`]) and who takes it ([`Sink`]).
//!
//! Records come in the order of the samples: at each tick of the truth the trajectory, then each satellite's
//! rows, interference and what spoofers claim; at the end the messages sent and the times in view. Samples
//! count from the first one that is generated. A `Vec` keeps every record, `()` none, and [`super::Writer`]
//! writes files.

use std::ops::Range;
use std::path::PathBuf;

use thiserror::Error;

use crate::scene::Scene;
use gnss::record::{InterferenceRow, NavigationRow, Observation, PassRow, RayRow, SkyRow, TrajectoryRow};

/// Reason for which a sink refuses the truth.
#[derive(Debug, Error)]
pub enum TruthError {
    /// A file that cannot be created, removed or written.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A row that cannot be written.
    #[error("{path}: {source}")]
    Row {
        /// The table.
        path: PathBuf,
        /// Error of the CSV writer.
        source: csv::Error,
    },
    /// Error of a user's own sink.
    #[error("the truth is not taken: {0}")]
    Refused(Box<dyn std::error::Error + Send + Sync>),
}

/// One thing that is true of a scene.
#[derive(Clone, Debug)]
pub enum Record {
    /// Antenna and clocks at a tick.
    Trajectory(TrajectoryRow),
    /// Observation of a signal's first ray by an ideal receiver.
    Observation(Observation),
    /// Direction and delays of the satellite in the preceding observation.
    Sky(SkyRow),
    /// Another ray of that satellite.
    Ray(RayRow),
    /// A source of interference at a tick.
    Interference(InterferenceRow),
    /// Position and clock that a spoofer claims.
    Claim {
        /// Number of the spoofer, from 1.
        spoofer: usize,
        /// The claimed motion, and the receiver's clock against the spoofer's.
        place: TrajectoryRow,
    },
    /// Observation of a spoofer's signal alone.
    Spoofed {
        /// Number of the spoofer, from 1.
        spoofer: usize,
        /// The observation.
        observation: Observation,
    },
    /// A parameter of a navigation message that was sent; at the end.
    Navigation(NavigationRow),
    /// A time in which a satellite was in view; at the end.
    Pass(PassRow),
}

/// Takes the truth of a scene.
pub trait Sink {
    /// The samples `part` of `scenes` will be generated. Several scenes are those of several front ends:
    /// facts that they share, and the numbers of samples, are those of the first.
    ///
    /// # Errors
    /// A reason for which the sink cannot; generation ends with it.
    fn begin(&mut self, scenes: &[Scene], part: &Range<u64>) -> Result<(), TruthError> {
        let _ = (scenes, part);
        Ok(())
    }

    /// Takes a record.
    ///
    /// # Errors
    /// Errors of [`Sink::begin`].
    fn take(&mut self, record: Record) -> Result<(), TruthError>;

    /// The last record was taken.
    ///
    /// # Errors
    /// Errors of [`Sink::begin`].
    fn finish(&mut self) -> Result<(), TruthError> {
        Ok(())
    }
}

/// Hands every record to both.
impl<A: Sink + ?Sized, B: Sink + ?Sized> Sink for (&mut A, &mut B) {
    fn begin(&mut self, scenes: &[Scene], part: &Range<u64>) -> Result<(), TruthError> {
        self.0.begin(scenes, part)?;
        self.1.begin(scenes, part)
    }

    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        self.0.take(record.clone())?;
        self.1.take(record)
    }

    fn finish(&mut self) -> Result<(), TruthError> {
        self.0.finish()?;
        self.1.finish()
    }
}

/// Keeps every record.
impl Sink for Vec<Record> {
    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        self.push(record);
        Ok(())
    }
}

/// Hands every record to all of them, in their order.
#[derive(Default)]
pub struct Several(pub Vec<Box<dyn Sink + Send>>);

impl Sink for Several {
    fn begin(&mut self, scenes: &[Scene], part: &Range<u64>) -> Result<(), TruthError> {
        self.0.iter_mut().try_for_each(|sink| sink.begin(scenes, part))
    }

    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        self.0.iter_mut().try_for_each(|sink| sink.take(record.clone()))
    }

    fn finish(&mut self) -> Result<(), TruthError> {
        self.0.iter_mut().try_for_each(|sink| sink.finish())
    }
}

/// Keeps nothing.
impl Sink for () {
    fn take(&mut self, _: Record) -> Result<(), TruthError> {
        Ok(())
    }
}
