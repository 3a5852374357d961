//! Rows of inertial sensors in step with the truth: a measurement for each interval, and the true motion and
//! attitude at the first of them and once in each interval of the truth.

use std::ops::Range;

use super::record::TruthError;
use crate::inertial::Measurements;
use crate::scene::Scene;
use gnss::record::{BodyRow, InertialRow};
use gnss::time::Epoch;

/// Row of inertial sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorRow {
    /// Measurement over an interval: `imu.csv`.
    Measured(InertialRow),
    /// True motion and attitude at its end: `body.csv`.
    Body(BodyRow),
}

/// Receiver of rows.
pub type Take<'a> = &'a mut dyn FnMut(SensorRow) -> Result<(), TruthError>;

/// Sensors of a scene, or of a part of it.
pub struct Sensors {
    measurements: Measurements,
    /// True time from which the sensors' intervals count, and the end of the scene after it in seconds.
    start: Epoch,
    end_s: f64,
    /// Last true time that was asked for, and the interval between two of them, in seconds.
    asked_s: f64,
    interval_s: f64,
    /// Intervals between rows of the body.
    every: u64,
    has_begun: bool,
}

impl Sensors {
    /// Sensors over a part of a scene, in samples; `None` of a scene without them.
    pub fn of(scene: &Scene, part: &Range<u64>) -> Option<Self> {
        let imu = scene.imu.as_ref()?;
        let (start, from_s) = (scene.clock.start, scene.elapsed_s(part.start));
        Some(Self {
            measurements: Measurements::new(imu, &scene.trajectory, start, from_s)?,
            start,
            end_s: scene.elapsed_s(part.end),
            asked_s: from_s,
            interval_s: scene.truth_interval_s,
            every: (imu.facts.rate_hz * scene.truth_interval_s).round().max(1.0) as u64,
            has_begun: false,
        })
    }

    /// Gives the rows up to a true time to `take`.
    ///
    /// # Errors
    /// Errors of `take`.
    pub fn until(&mut self, time: Epoch, take: Take<'_>) -> Result<(), TruthError> {
        self.asked_s = time.since(self.start).min(self.end_s);
        self.until_s(self.asked_s, take)
    }

    /// Gives the rows up to the end of the scene, or of the truth where it ends early.
    ///
    /// # Errors
    /// Errors of `take`.
    pub fn finish(&mut self, take: Take<'_>) -> Result<(), TruthError> {
        self.until_s(self.end_s.min(self.asked_s + self.interval_s), take)
    }

    fn until_s(&mut self, to_s: f64, take: Take<'_>) -> Result<(), TruthError> {
        if !std::mem::replace(&mut self.has_begun, true) {
            take(SensorRow::Body(self.measurements.body()))?;
        }
        while let Some(row) = self.measurements.next(to_s) {
            take(SensorRow::Measured(row))?;
            if self.measurements.count().is_multiple_of(self.every) {
                take(SensorRow::Body(self.measurements.body()))?;
            }
        }
        Ok(())
    }
}
