//! Files of inertial sensors: `imu.csv`, a row for each interval, and `body.csv`, the true motion and
//! attitude at the first of them and once in each interval of the truth.

use std::ops::Range;
use std::path::Path;

use super::record::TruthError;
use super::writer::Table;
use crate::inertial::Measurements;
use crate::scene::Scene;
use gnss::time::Epoch;

/// Tables of the sensors, which grow with the scene.
pub(super) struct Inertial {
    measurements: Measurements,
    imu: Table,
    body: Table,
    /// True time from which the sensors' intervals count, and the end of the scene after it in seconds.
    start: Epoch,
    end_s: f64,
    /// Last true time that was asked for, and the interval between two of them, in seconds.
    asked_s: f64,
    interval_s: f64,
    /// Intervals between rows of `body.csv`.
    every: u64,
}

impl Inertial {
    /// Creates the tables for a part of a scene with sensors, and writes where they begin.
    pub fn create(directory: &Path, scene: &Scene, part: &Range<u64>) -> Result<Option<Self>, TruthError> {
        let Some(imu) = &scene.imu else { return Ok(None) };
        let (start, from_s) = (scene.clock.start, scene.elapsed_s(part.start));
        let Some(measurements) = Measurements::new(imu, &scene.trajectory, start, from_s) else { return Ok(None) };
        let mut inertial = Self {
            measurements,
            imu: Table::create(directory, "imu.csv")?,
            body: Table::create(directory, "body.csv")?,
            start,
            end_s: scene.elapsed_s(part.end),
            asked_s: from_s,
            interval_s: scene.truth_interval_s,
            every: (imu.facts.rate_hz * scene.truth_interval_s).round().max(1.0) as u64,
        };
        inertial.body.write(inertial.measurements.body())?;
        Ok(Some(inertial))
    }

    /// Writes the rows up to a true time.
    pub fn until(&mut self, time: Epoch) -> Result<(), TruthError> {
        self.asked_s = time.since(self.start).min(self.end_s);
        self.until_s(self.asked_s)
    }

    fn until_s(&mut self, to_s: f64) -> Result<(), TruthError> {
        while let Some(row) = self.measurements.next(to_s) {
            self.imu.write(row)?;
            if self.measurements.count().is_multiple_of(self.every) {
                self.body.write(self.measurements.body())?;
            }
        }
        Ok(())
    }

    /// Writes the rows up to the end of the scene, or of the truth where it ends early, and everything that
    /// is still buffered.
    pub fn finish(&mut self) -> Result<(), TruthError> {
        self.until_s(self.end_s.min(self.asked_s + self.interval_s))?;
        self.imu.flush()?;
        self.body.flush()
    }
}
