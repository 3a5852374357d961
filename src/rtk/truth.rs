//! Truth of a run: where its antenna was at each epoch, and the carriers of an ideal receiver.
//!
//! The truth's tables name samples; an epoch's label is what the receiver's clock read there, which is the
//! time of transmission plus the pseudorange, as RINEX labels the receiver's own epochs. A receiver's carrier
//! less the true one is a whole number, the same for all epochs until the phase slips, a clock that all
//! satellites share, and noise. Double differences of that are the true integers.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::Path;

use nalgebra::Vector3;
use serde::de::DeserializeOwned;

use crate::carrier::Code;
use crate::error::RtkError;
use crate::pairs::Track;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{Observation, TrajectoryRow};
use gnss::time::Epoch;

/// True values of a run, by the milliseconds of the labels.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    positions_m: BTreeMap<i64, Vector3<f64>>,
    carriers: BTreeMap<i64, Vec<(Track, f64)>>,
}

/// Largest distance between positions of an antenna at rest, metres.
const LARGEST_REST_M: f64 = 1e-6;

/// Milliseconds of a label, by which epochs are found. Labels of an epoch agree to 0.1 µs.
fn key(label: Epoch) -> i64 {
    label.seconds() * 1000 + (label.fraction() * 1000.0).round() as i64
}

impl Truth {
    /// Reads the truth of a run's directory; `None` if there is none in it.
    ///
    /// # Errors
    /// A table that cannot be read.
    pub fn read(run: &Path) -> Result<Option<Self>, RtkError> {
        let truth = run.join("truth");
        let (trajectory, observations) = (truth.join("trajectory.csv"), truth.join("observations.csv"));
        if !trajectory.exists() {
            return Ok(None);
        }
        let mut places = BTreeMap::new();
        each(&trajectory, |row: TrajectoryRow| {
            places.insert(row.sample, (row.time().plus_s(row.clock_bias_s), row.position_m()));
        })?;
        let mut found = Self::default();
        // Without a satellite in view, the clock alone tells the label; with one, its signal does.
        found.positions_m.extend(places.values().map(|(label, position_m)| (key(*label), *position_m)));
        each(&observations, |row: Observation| {
            let label = row.sent().plus_s(row.pseudorange_m / SPEED_OF_LIGHT_MPS);
            if let Some(code) = Code::new(row.signal.rinex) {
                found.carriers.entry(key(label)).or_default().push(((row.sv, code), row.carrier_cycles));
            }
            if let Some((_, position_m)) = places.get(&row.sample) {
                found.positions_m.insert(key(label), *position_m);
            }
        })?;
        Ok(Some(found))
    }

    /// True ECEF position at a label of the receiver's clock, metres.
    pub fn position_m(&self, label: Epoch) -> Option<Vector3<f64>> {
        self.positions_m.get(&key(label)).copied()
    }

    /// True carrier of a track at a label, cycles.
    pub fn carrier_cycles(&self, label: Epoch, track: Track) -> Option<f64> {
        let all = self.carriers.get(&key(label))?;
        all.iter().find(|(own, _)| *own == track).map(|(_, cycles)| *cycles)
    }

    /// Position of an antenna that is at rest all the time, metres.
    pub fn resting_m(&self) -> Option<Vector3<f64>> {
        let first = self.positions_m.values().next()?;
        let is_near = |other: &Vector3<f64>| (other - first).norm() < LARGEST_REST_M;
        self.positions_m.values().all(is_near).then_some(*first)
    }
}

/// Gives every row of a table to `take`.
pub(crate) fn each<T: DeserializeOwned>(path: &Path, mut take: impl FnMut(T)) -> Result<(), RtkError> {
    let file = File::open(path).map_err(|source| RtkError::Read { path: path.to_owned(), source })?;
    for row in csv::Reader::from_reader(file).into_deserialize() {
        match row {
            Ok(row) => take(row),
            Err(error) if error.is_io_error() => {
                let source = match error.into_kind() {
                    csv::ErrorKind::Io(source) => source,
                    other => io::Error::other(format!("{other:?}")),
                };
                return Err(RtkError::Read { path: path.to_owned(), source });
            }
            Err(source) => return Err(RtkError::Row { path: path.to_owned(), source }),
        }
    }
    Ok(())
}
