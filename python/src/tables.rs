//! The records of generator and receiver as tables, each under the name of the file that the program writes.

use std::ops::Range;

use generator::scene::Scene;
use generator::truth::{self, SensorRow, Sensors, TruthError};
use gnss::record::{
    AcquisitionRow, AttitudeRow, BodyRow, ClockRow, DetectionRow, ElementRow, EventRow, Fix, Geographic, InertialRow,
    IntegrityRow, InterferenceRow, IonosphereRow, LineRow, NavigationRow, Observation, PassRow, RayRow, SightRow,
    SkyRow, TagRow, TrackingRow, TrajectoryRow,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use receiver::output::{self, OutputError, Parameters};
use serde_json::Value;

use crate::columns::{FrontEnd, Spoofer, Table};

/// Truth of a scene, as tables.
#[derive(Default)]
pub struct Truth {
    trajectory: Table<(TrajectoryRow, Geographic)>,
    observations: Table<Observation>,
    sky: Table<SkyRow>,
    rays: Table<RayRow>,
    interference: Table<InterferenceRow>,
    claimed: Table<((TrajectoryRow, Geographic), Spoofer)>,
    spoofed: Table<(Observation, Spoofer)>,
    navigation: Table<NavigationRow>,
    passes: Table<PassRow>,
    imu: Table<InertialRow>,
    body: Table<BodyRow>,
    sensors: Option<Sensors>,
}

/// A row with its position in degrees.
fn placed(row: TrajectoryRow) -> (TrajectoryRow, Geographic) {
    let place = Geographic::of(&row.position_m(), row.time());
    (row, place)
}

impl Truth {
    /// Takes the rows of the sensors that `ask` asks for.
    fn sense(
        &mut self,
        ask: impl FnOnce(&mut Sensors, truth::Take<'_>) -> Result<(), TruthError>,
    ) -> Result<(), TruthError> {
        let Self { imu, body, sensors, .. } = self;
        let mut take = |row| {
            match row {
                SensorRow::Measured(row) => imu.push(&row),
                SensorRow::Body(row) => body.push(&row),
            }
            Ok(())
        };
        sensors.as_mut().map_or(Ok(()), |sensors| ask(sensors, &mut take))
    }
}

impl truth::Sink for Truth {
    fn begin(&mut self, scenes: &[Scene], part: &Range<u64>) -> Result<(), TruthError> {
        self.sensors = scenes.first().and_then(|scene| Sensors::of(scene, part));
        Ok(())
    }

    fn finish(&mut self) -> Result<(), TruthError> {
        self.sense(|sensors, take| sensors.finish(take))
    }

    fn take(&mut self, record: truth::Record) -> Result<(), TruthError> {
        match record {
            truth::Record::Trajectory(row) => {
                let time = row.time();
                self.sense(|sensors, take| sensors.until(time, take))?;
                self.trajectory.push(&placed(row));
            }
            truth::Record::Observation(row) => self.observations.push(&row),
            truth::Record::Sky(row) => self.sky.push(&row),
            truth::Record::Ray(row) => self.rays.push(&row),
            truth::Record::Interference(row) => self.interference.push(&row),
            truth::Record::Claim { spoofer, place } => self.claimed.push(&(placed(place), Spoofer { spoofer })),
            truth::Record::Spoofed { spoofer, observation } => self.spoofed.push(&(observation, Spoofer { spoofer })),
            truth::Record::Navigation(row) => self.navigation.push(&row),
            truth::Record::Pass(row) => self.passes.push(&row),
        }
        Ok(())
    }
}

/// Hands over all tables, which are empty after it.
macro_rules! tables {
    ($tables:expr, $py:expr; $($name:ident),*) => {{
        let dict = PyDict::new($py);
        $(dict.set_item(stringify!($name), $tables.$name.take($py)?)?;)*
        Ok(dict)
    }};
}

impl Truth {
    /// The tables by their names; they are empty after it.
    pub fn drain<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables!(
            self, py;
            trajectory, observations, sky, rays, interference, claimed, spoofed, navigation, passes, imu, body
        )
    }
}

/// Records of a receiver, as tables.
#[derive(Default)]
pub struct Received {
    acquisition: Table<AcquisitionRow>,
    tracking: Table<TrackingRow>,
    events: Table<EventRow>,
    observations: Table<Observation>,
    navigation: Table<NavigationRow>,
    fixes: Table<(Fix, Geographic)>,
    clocks: Table<ClockRow>,
    sights: Table<SightRow>,
    ionosphere: Table<IonosphereRow>,
    integrity: Table<IntegrityRow>,
    detection: Table<DetectionRow>,
    attitude: Table<AttitudeRow>,
    elements: Table<ElementRow>,
    interference: Table<(LineRow, FrontEnd)>,
    osnma: Table<TagRow>,
    parameters: Parameters,
    /// Summary of the reception, once it has ended.
    pub summary: Option<Value>,
}

impl output::Sink for Received {
    fn take(&mut self, record: output::Record) -> Result<(), OutputError> {
        match record {
            output::Record::Acquisition(row) => self.acquisition.push(&row),
            output::Record::Tracking(row) => self.tracking.push(&row),
            output::Record::Event(row) => self.events.push(&row),
            output::Record::Observation(row) => self.observations.push(&row),
            output::Record::Navigation(rows) => {
                self.parameters.fresh(rows).iter().for_each(|row| self.navigation.push(row));
            }
            output::Record::Fix(fix) => {
                let place = Geographic::of(&fix.position_m(), fix.time());
                self.fixes.push(&(fix, place));
            }
            output::Record::Clocks(rows) => rows.iter().for_each(|row| self.clocks.push(row)),
            output::Record::Sights(rows) => rows.iter().for_each(|row| self.sights.push(row)),
            output::Record::Ionosphere(rows) => rows.iter().for_each(|row| self.ionosphere.push(row)),
            output::Record::Tag(row) => self.osnma.push(&row),
            output::Record::Integrity(row) => self.integrity.push(&*row),
            output::Record::Detection(row) => self.detection.push(&row),
            output::Record::Attitude(row, elements) => {
                self.attitude.push(&row);
                elements.iter().for_each(|row| self.elements.push(row));
            }
            output::Record::Interference { front_end, row } => self.interference.push(&(row, FrontEnd { front_end })),
        }
        Ok(())
    }

    fn finish(&mut self, summary: &Value) -> Result<(), OutputError> {
        self.summary = Some(summary.clone());
        Ok(())
    }
}

impl Received {
    /// The tables by their names; they are empty after it.
    pub fn drain<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables!(
            self, py;
            acquisition, tracking, events, observations, navigation, fixes, clocks, sights, ionosphere, integrity,
            detection, attitude, elements, interference, osnma
        )
    }

    /// The summary as a dictionary; empty before the end.
    pub fn drain_summary<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        object(py, &self.summary.take().unwrap_or_else(|| Value::Object(Default::default())))
    }
}

/// JSON as Python has it.
pub fn object<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (value.to_string(),))
}
