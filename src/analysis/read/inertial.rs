//! Inertial measurements of a run, and the true motion of their sensors.

use super::files::each;
use super::run::TRUTH;
use crate::error::JudgeError;
use crate::read::run::Run;
use crate::read::table::Table;
use gnss::record::{BodyRow, InertialRow};

/// Difference of a row's time from the one that the rate gives, seconds, beyond which rows are not even.
const UNEVEN_S: f64 = 1e-6;

/// Tables of inertial sensors.
pub struct Inertial {
    /// Measurements, each one interval after the one before.
    pub rows: Table<InertialRow>,
    /// True motion; its first row is where the first interval begins.
    pub body: Table<BodyRow>,
}

impl Run {
    /// Inertial measurements, where the scene has sensors.
    ///
    /// # Errors
    /// Tables that are missing or cannot be read, and measurements that are not one interval apart.
    pub fn inertial(&self) -> Result<Option<Inertial>, JudgeError> {
        let Some(facts) = &self.scene.imu else { return Ok(None) };
        let directory = self.trajectory.directory();
        let (mut rows, mut body) = (Table::new(directory), Table::new(directory));
        let path = self.truth_place.join("body.csv");
        each(&path, TRUTH, |_, row: BodyRow| body.push(row))?;
        let Some(first) = body.first().map(BodyRow::time) else {
            return Err(JudgeError::Line { path, line: 2, what: "no row, expected one at least".to_owned() });
        };
        let path = self.truth_place.join("imu.csv");
        each(&path, TRUTH, |line, row: InertialRow| {
            let expected_s = (rows.len() + 1) as f64 / facts.rate_hz;
            let found_s = row.time().since(first);
            if (found_s - expected_s).abs() > UNEVEN_S {
                let what =
                    format!("its time is {found_s:.6} s after the first of body.csv, expected {expected_s:.6} s");
                return Err(JudgeError::Line { path: path.clone(), line, what });
            }
            rows.push(row)
        })?;
        Ok(Some(Inertial { rows, body }))
    }
}
