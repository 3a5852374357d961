//! Files of a receiver: RINEX observations with ephemerides, of a run's directory or of any receiver.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::error::RtkError;
use crate::orbits::Orbits;
use analysis::read::rinex_obs::{LARGEST_BYTES, ObservedEpoch, Reader};
use gnss::inflate::inflate;
use gnss::rinex::{self, NavigationError};
use gnss::satellite::Sv;

/// One receiver of a baseline.
#[derive(Clone, Debug)]
pub struct Receiver {
    /// File of its observations.
    pub path: PathBuf,
    /// Epochs in their order.
    pub epochs: Vec<ObservedEpoch>,
    /// Frequency channels of GLONASS by the file's header.
    pub channels: BTreeMap<Sv, i8>,
}

/// Observations of a run's directory, or of a RINEX file.
///
/// # Errors
/// A file that cannot be read or is none of RINEX; of a run without an epoch [`RtkError::NoFix`].
pub fn receiver(run: &Path, who: &'static str) -> Result<Receiver, RtkError> {
    let is_run = run.is_dir();
    let path = if is_run { run.join("rx").join("observations.rnx") } else { run.to_owned() };
    let bytes = fs::read(&path).map_err(|source| RtkError::Read { path: path.clone(), source })?;
    let fault = |line, what| RtkError::Observations { path: path.clone(), line, what };
    let plain = inflate(&bytes, LARGEST_BYTES).map_err(|error| fault(1, error.to_string()))?;
    // A receiver that never knew the time wrote a header alone.
    if is_run && !plain.windows(2).any(|pair| pair == b"\n>") {
        return Err(RtkError::NoFix { who, path: run.join("rx") });
    }
    let of = |error: analysis::read::Fault| fault(error.line, error.what);
    let mut reader = Reader::new(plain.as_slice()).map_err(of)?;
    let mut epochs = Vec::new();
    while let Some(epoch) = reader.next_epoch().map_err(of)? {
        epochs.push(epoch);
    }
    let channels = std::mem::take(&mut reader.header.channels);
    Ok(Receiver { path, epochs, channels })
}

/// Ephemerides that both receivers read, from `rx/navigation.rnx`, or those of files that are named.
///
/// # Errors
/// A file that cannot be read or holds no ephemeris.
pub fn orbits(runs: [&Path; 2], named: &[PathBuf]) -> Result<Orbits, RtkError> {
    let mut orbits = Orbits::default();
    if !named.is_empty() {
        for path in named {
            orbits.add(ephemerides(path)?);
        }
        return Ok(orbits);
    }
    let mut refused = None;
    for run in runs.into_iter().filter(|run| run.is_dir()) {
        let path = run.join("rx").join("navigation.rnx");
        match ephemerides(&path) {
            Ok(sets) => orbits.add(sets),
            // A receiver that read no ephemeris may use the other's.
            Err(error @ RtkError::Navigation(NavigationError::Nothing { .. })) => refused = Some(error),
            Err(error) => return Err(error),
        }
    }
    match refused {
        _ if orbits.satellites() > 0 => Ok(orbits),
        Some(error) => Err(error),
        None => Err(RtkError::NoEphemerides),
    }
}

fn ephemerides(path: &Path) -> Result<Vec<gnss::broadcast::Ephemeris>, RtkError> {
    let bytes = fs::read(path).map_err(|source| RtkError::Read { path: path.to_owned(), source })?;
    Ok(rinex::read(&bytes, &path.display().to_string())?.ephemerides)
}
