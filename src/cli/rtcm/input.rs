//! Observations, ephemerides and position of a station: from the tables of a run, or from RINEX files.
//!
//! Tables have all digits, and ephemerides by the integers of the messages from which they were decoded.
//! RINEX has its own resolution; its ephemerides are those of [`gnss::rinex`], which of Galileo keeps one
//! message of a satellite.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use nalgebra::Vector3;

use super::args::Rtcm;
use crate::cli::error::{CliError, shown};
use analysis::read::rinex_obs;
use gnss::broadcast::Ephemeris;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::exchange::NavigationSets;
use gnss::record::{NavigationRow, Observation, TrajectoryRow};
use gnss::rinex;
use gnss::satellite::System;
use gnss::signal;
use logs::observed::{Observed, ObservedEpoch};
use logs::rtcm::field::Refused;
use logs::rtcm::signals;

/// Distance in metres within which an antenna stays in place.
const STILL_M: f64 = 0.01;

/// An epoch with the observations that were left out of it.
type Epochs = Box<dyn Iterator<Item = Result<(ObservedEpoch, Vec<Refused>), CliError>>>;

/// Content of a station's stream.
pub struct Input {
    /// Epochs in the order of their times.
    pub epochs: Epochs,
    /// Ephemerides of all satellites.
    pub sets: Vec<Ephemeris>,
    /// Position of the antenna, Earth-fixed, metres, where the truth has one that stays in place.
    pub position_m: Option<Vector3<f64>>,
    /// Name of the receiver.
    pub receiver: String,
    /// Systems of the observations.
    pub systems: Vec<System>,
}

impl Input {
    /// Opens what the arguments name.
    pub fn open(arguments: &Rtcm) -> Result<Self, CliError> {
        let path = &arguments.input;
        let about = fs::metadata(path).map_err(|error| CliError::read(shown(path), &error))?;
        if about.is_dir() {
            return Self::of_run(path, arguments);
        }
        if !about.is_file() {
            return Err(CliError::input(format!("{}: expected a run's directory or a RINEX file", shown(path))));
        }
        if arguments.truth {
            return Err(CliError::usage("--truth: expected the directory of a run before it"));
        }
        Self::of_rinex(path, arguments)
    }

    fn of_run(run: &Path, arguments: &Rtcm) -> Result<Self, CliError> {
        let inner = run.join(if arguments.truth { "truth" } else { "rx" });
        let own = if inner.is_dir() || arguments.truth { inner } else { run.to_owned() };
        let table = own.join("observations.csv");
        let file = "observations.csv of a receiver or a truth";
        if !table.is_file() {
            return Err(CliError::input(format!("{}: expected {file} in it", shown(run))));
        }
        // A first pass for the systems and the time.
        let (mut systems, mut near) = (Vec::new(), None);
        for row in rows::<Observation>(&table)? {
            let row = row?;
            near.get_or_insert(row.sent());
            if !systems.contains(&row.sv.system) {
                systems.push(row.sv.system);
            }
        }
        systems.sort_unstable();
        let near = near.ok_or_else(|| CliError::input(format!("{}: no observation in it", shown(&table))))?;
        let mut sets = NavigationSets::default();
        let navigation = own.join("navigation.csv");
        if navigation.is_file() {
            for row in rows::<NavigationRow>(&navigation)? {
                sets.take(&row?);
            }
        }
        let mut sets = sets.ephemerides(&signal::all(), near);
        sets.extend(files(arguments)?);
        let trajectory = run.join("truth/trajectory.csv");
        let position_m = if trajectory.is_file() { still(&trajectory)? } else { None };
        let epochs = Box::new(Grouped { rows: rows(&table)?, next: None });
        let receiver = if arguments.truth { "gnss-twin truth" } else { "gnss-twin" };
        Ok(Self { epochs, sets, position_m, receiver: receiver.to_owned(), systems })
    }

    fn of_rinex(path: &Path, arguments: &Rtcm) -> Result<Self, CliError> {
        let bytes = fs::read(path).map_err(|error| CliError::read(shown(path), &error))?;
        let read = rinex_obs::read(&bytes)
            .map_err(|fault| CliError::input(format!("{}:{}: {}", shown(path), fault.line, fault.what)))?;
        let mut systems: Vec<System> =
            read.epochs.iter().flat_map(|epoch| epoch.values.keys().map(|(sv, _)| sv.system)).collect();
        systems.sort_unstable();
        systems.dedup();
        let epochs = Box::new(read.epochs.into_iter().map(|epoch| Ok(of_file(&epoch))));
        Ok(Self { epochs, sets: files(arguments)?, position_m: None, receiver: read.receiver, systems })
    }
}

/// Ephemerides of the navigation files that are named.
fn files(arguments: &Rtcm) -> Result<Vec<Ephemeris>, CliError> {
    let mut sets = Vec::new();
    for path in &arguments.nav {
        let bytes = fs::read(path).map_err(|error| CliError::read(shown(path), &error))?;
        let read = rinex::read(&bytes, &shown(path)).map_err(CliError::input)?;
        sets.extend(read.ephemerides);
    }
    Ok(sets)
}

/// Rows of a table.
fn rows<R: serde::de::DeserializeOwned + 'static>(
    path: &Path,
) -> Result<Box<dyn Iterator<Item = Result<R, CliError>>>, CliError> {
    let file = File::open(path).map_err(|error| CliError::read(shown(path), &error))?;
    let name = shown(path);
    let reader = csv::Reader::from_reader(BufReader::new(file));
    Ok(Box::new(
        reader.into_deserialize().map(move |row| row.map_err(|error| CliError::input(format!("{name}: {error}")))),
    ))
}

/// Position of an antenna that does not move.
fn still(path: &Path) -> Result<Option<Vector3<f64>>, CliError> {
    let mut first = None;
    for row in rows::<TrajectoryRow>(path)? {
        let here_m = row?.position_m();
        if (here_m - *first.get_or_insert(here_m)).norm() > STILL_M {
            return Ok(None);
        }
    }
    Ok(first)
}

/// Epochs of rows, of which those of one sample come one after the other.
struct Grouped {
    rows: Box<dyn Iterator<Item = Result<Observation, CliError>>>,
    next: Option<Observation>,
}

impl Iterator for Grouped {
    type Item = Result<(ObservedEpoch, Vec<Refused>), CliError>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut rows: Vec<Observation> = self.next.take().into_iter().collect();
        loop {
            match self.rows.next() {
                Some(Err(error)) => return Some(Err(error)),
                Some(Ok(row)) if rows.first().is_none_or(|first| first.sample == row.sample) => rows.push(row),
                other => {
                    self.next = other.and_then(Result::ok);
                    return rows.first().map(|first| Ok(of_rows(first, &rows)));
                }
            }
        }
    }
}

/// Epoch of rows of one sample, labelled with the time of the receiver's clock.
fn of_rows(first: &Observation, rows: &[Observation]) -> (ObservedEpoch, Vec<Refused>) {
    let label = first.sent().plus_s(first.pseudorange_m / SPEED_OF_LIGHT_MPS);
    let observed = |row: &Observation| Observed {
        sv: row.sv,
        code: row.signal.rinex,
        pseudorange_m: Some(row.pseudorange_m),
        carrier_cycles: Some(row.carrier_cycles),
        doppler_hz: Some(row.doppler_hz),
        cn0_dbhz: Some(row.cn0_dbhz),
        lock_s: Some(row.locked_s),
        lost_lock: false,
        half_cycle_ambiguous: false,
    };
    (ObservedEpoch { label, values: rows.iter().map(observed).collect() }, Vec::new())
}

/// Epoch of a RINEX file. Codes that RTCM does not have are refused.
fn of_file(epoch: &rinex_obs::ObservedEpoch) -> (ObservedEpoch, Vec<Refused>) {
    let (mut values, mut refused) = (Vec::new(), Vec::new());
    for ((sv, code), own) in &epoch.values {
        let Some((_, code)) = signals::signal_bit(sv.system, code) else {
            refused.push(Refused::Signal { sv: *sv, code: code.clone() });
            continue;
        };
        values.push(Observed {
            sv: *sv,
            code,
            pseudorange_m: own.pseudorange_m,
            carrier_cycles: own.carrier_cycles,
            doppler_hz: own.doppler_hz,
            cn0_dbhz: own.cn0_dbhz,
            lock_s: None,
            lost_lock: own.lost_lock,
            half_cycle_ambiguous: own.half_cycle_ambiguous,
        });
    }
    (ObservedEpoch { label: epoch.label, values }, refused)
}
