//! True positions of the antenna as NMEA 0183 and as tracks for maps: the output of a receiver without
//! errors.
//!
//! The satellites of the sentences are those of the truth, all of them in the solution; dilutions of
//! precision are those of their directions with a clock for each system. Limits: where there are fewer
//! satellites than unknowns, 99.99 stands for dilutions.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use nalgebra::DMatrix;

use super::{Record, Sink, TruthError};
use crate::scene::Scene;
use gnss::exchange::{Track, TrackForm};
use gnss::nmea::{self, Place, Seen};
use gnss::record::{Observation, TrajectoryRow};
use gnss::satellite::{Sv, System};

/// Base of the files' names.
const BASE: &str = "trajectory";

/// Writes `trajectory.nmea`: the sentences of every tick.
pub struct Nmea {
    path: PathBuf,
    writer: BufWriter<File>,
    place: Option<TrajectoryRow>,
    observed: Option<Observation>,
    seen: BTreeMap<Sv, Seen>,
}

impl Nmea {
    /// Creates the file in an existing directory.
    ///
    /// # Errors
    /// [`TruthError::File`] with the path that cannot be made.
    pub fn create(directory: &Path) -> Result<Self, TruthError> {
        let path = directory.join(BASE).with_extension("nmea");
        let writer = File::create(&path).map(BufWriter::new).map_err(|error| refused(&path, error))?;
        Ok(Self { path, writer, place: None, observed: None, seen: BTreeMap::new() })
    }

    /// Writes the records since the tick began.
    fn end_tick(&mut self) -> Result<(), TruthError> {
        let (Some(row), seen) = (self.place.take(), std::mem::take(&mut self.seen)) else { return Ok(()) };
        let seen: Vec<Seen> = seen.into_values().collect();
        let [pdop, hdop, vdop] = dilutions(&seen).unwrap_or([f64::INFINITY; 3]);
        let place = Place {
            time: row.time(),
            position_m: row.position_m(),
            velocity_mps: row.velocity_mps(),
            satellites: seen.len() as u32,
            pdop,
            hdop,
            vdop,
        };
        let written = self.writer.write_all(nmea::epoch(&place, &seen).as_bytes());
        written.map_err(|error| refused(&self.path, error))
    }
}

impl Sink for Nmea {
    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        match record {
            Record::Trajectory(row) => {
                self.end_tick()?;
                self.place = Some(row);
            }
            Record::Observation(row) => self.observed = Some(row),
            Record::Sky(row) => {
                let Some(observed) = self.observed.take() else { return Ok(()) };
                let one = Seen {
                    sv: row.sv,
                    signal: Some((observed.signal, observed.cn0_dbhz)),
                    azimuth_deg: row.azimuth_deg,
                    elevation_deg: row.elevation_deg,
                    used: true,
                };
                // Of several signals the strongest.
                let power = |seen: &Seen| seen.signal.map_or(f64::NEG_INFINITY, |(_, cn0_dbhz)| cn0_dbhz);
                if self.seen.get(&row.sv).is_none_or(|known| power(known) < power(&one)) {
                    self.seen.insert(row.sv, one);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), TruthError> {
        self.end_tick()?;
        self.writer.flush().map_err(|error| refused(&self.path, error))
    }
}

/// Dilution of precision of the position, the horizontal position and the height; `None` if the directions
/// determine none.
fn dilutions(seen: &[Seen]) -> Option<[f64; 3]> {
    let mut systems: Vec<System> = seen.iter().map(|seen| seen.sv.system).collect();
    systems.sort();
    systems.dedup();
    let unknowns = 3 + systems.len();
    if seen.len() < unknowns {
        return None;
    }
    let design = DMatrix::from_fn(seen.len(), unknowns, |row, column| {
        let Some(seen) = seen.get(row) else { return 0.0 };
        let (sin_azimuth, cos_azimuth) = libm::sincos(seen.azimuth_deg.to_radians());
        let (sin, cos) = libm::sincos(seen.elevation_deg.to_radians());
        match column {
            0 => cos * sin_azimuth,
            1 => cos * cos_azimuth,
            2 => sin,
            _ => f64::from(u8::from(systems.get(column - 3) == Some(&seen.sv.system))),
        }
    });
    let cofactors = (design.transpose() * design).cholesky()?.inverse();
    let [east, north, up] = [0, 1, 2].map(|place| cofactors[(place, place)]);
    Some([(east + north + up).sqrt(), (east + north).sqrt(), up.sqrt()])
}

/// Writes `trajectory.kml` and `trajectory.gpx`, a point a second.
pub struct Tracks {
    directory: PathBuf,
    tracks: Vec<(PathBuf, Track<BufWriter<File>>)>,
}

impl Tracks {
    /// Creates the writer for an existing directory. The files are made when the truth begins.
    pub fn new(directory: &Path) -> Self {
        Self { directory: directory.to_owned(), tracks: Vec::new() }
    }
}

impl Sink for Tracks {
    fn begin(&mut self, scenes: &[Scene], _: &std::ops::Range<u64>) -> Result<(), TruthError> {
        let name = scenes.first().map_or("", |scene| scene.name.as_str());
        for (extension, form) in [("kml", TrackForm::Kml), ("gpx", TrackForm::Gpx)] {
            let path = self.directory.join(BASE).with_extension(extension);
            let made = File::create(&path).and_then(|file| Track::new(BufWriter::new(file), form, name));
            self.tracks.push((path.clone(), made.map_err(|error| refused(&path, error))?));
        }
        Ok(())
    }

    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        let Record::Trajectory(row) = record else { return Ok(()) };
        let add = |(path, track): &mut (PathBuf, Track<_>)| {
            track.add(row.time(), &row.position_m()).map_err(|error| refused(path, error))
        };
        self.tracks.iter_mut().try_for_each(add)
    }

    fn finish(&mut self) -> Result<(), TruthError> {
        let end = |(path, track): &mut (PathBuf, Track<_>)| track.finish().map_err(|error| refused(path, error));
        self.tracks.iter_mut().try_for_each(end)
    }
}

fn refused(path: &Path, source: io::Error) -> TruthError {
    TruthError::File { path: path.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::earth::Geodetic;
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::record::SkyRow;
    use gnss::signal::Signal;
    use gnss::time::Epoch;

    fn seen(sv: Sv, azimuth_deg: f64, elevation_deg: f64) -> Seen {
        Seen { sv, signal: None, azimuth_deg, elevation_deg, used: true }
    }

    #[test]
    fn dilutions_are_those_of_three_satellites_on_the_horizon_and_one_above() {
        let around = |n: u8| seen(Sv::gps(n), 120.0 * f64::from(n), 0.0);
        let mut sky: Vec<Seen> = (1..=3).map(around).collect();
        assert_eq!(dilutions(&sky), None);
        sky.push(seen(Sv::gps(4), 7.0, 90.0));
        // By hand: two thirds of east and of north, four thirds of up beside the clock.
        let expected = [8.0 / 3.0, 4.0 / 3.0, 4.0 / 3.0].map(f64::sqrt);
        let found = dilutions(&sky).unwrap();
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        // One satellite of another system is its own clock's.
        sky.push(seen(Sv { system: System::Galileo, number: 4 }, 200.0, 30.0));
        let with_clock = dilutions(&sky).unwrap();
        assert!(with_clock.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{with_clock:?}");
        // All in one plane say nothing across it.
        let flat: Vec<Seen> = (0..6).map(|n| seen(Sv::gps(n), 0.0, 15.0 * f64::from(n))).collect();
        assert!(dilutions(&flat).is_none_or(|[_, across, _]| across > 1e3));
    }

    #[test]
    fn a_tick_s_sentences_have_its_place_its_time_and_its_satellites_once() {
        let directory = tempfile::tempdir().unwrap();
        let mut file = Nmea::create(directory.path()).unwrap();
        let mut tracks = Tracks::new(directory.path());
        tracks.begin(&[], &(0..1)).unwrap();
        let time = Epoch::parse("2010-07-01T08:06:00Z").unwrap();
        for tick in 0..3_i64 {
            let at = Geodetic::from_degrees(26.5 + 0.25 * tick as f64, -80.25, 130.0).to_ecef();
            let row = TrajectoryRow {
                sample: 100 * tick as u64,
                gps_s: time.seconds() + tick,
                gps_fraction_s: 0.0,
                x_m: at.x,
                y_m: at.y,
                z_m: at.z,
                vx_mps: 0.0,
                vy_mps: 0.0,
                vz_mps: 0.0,
                clock_bias_s: 1e-4,
                clock_drift: 0.0,
            };
            tracks.take(Record::Trajectory(row.clone())).unwrap();
            file.take(Record::Trajectory(row)).unwrap();
            let galileo = Sv { system: System::Galileo, number: 4 };
            let sent: [(Sv, &'static Signal, f64); 3] =
                [(Sv::gps(3), &L1_CA, 44.0), (galileo, &E1, 41.0), (galileo, &L1_CA, 30.0)];
            for (sv, signal, cn0_dbhz) in sent {
                let observation = Observation {
                    sample: 100 * tick as u64,
                    sv,
                    signal,
                    sent_s: 0,
                    sent_fraction_s: 0.0,
                    pseudorange_m: 2e7,
                    carrier_cycles: 0.0,
                    doppler_hz: 0.0,
                    cn0_dbhz,
                    locked_s: 1.0,
                };
                file.take(Record::Observation(observation)).unwrap();
                let sky = SkyRow {
                    sample: 100 * tick as u64,
                    sv,
                    signal,
                    azimuth_deg: 123.0,
                    elevation_deg: 45.0,
                    range_m: 2e7,
                    satellite_clock_m: 0.0,
                    ionosphere_m: 0.0,
                    troposphere_m: 0.0,
                };
                file.take(Record::Sky(sky)).unwrap();
            }
        }
        file.finish().unwrap();
        tracks.finish().unwrap();
        let text = |name: &str| std::fs::read_to_string(directory.path().join(name)).unwrap();
        let sentences = text("trajectory.nmea");
        let first: Vec<&str> = sentences.lines().filter(|line| line.contains("GGA")).collect();
        assert_eq!(first.len(), 3, "{sentences}");
        // The sea is there 27.989 m below the ellipsoid (WW15MGH), to the 1.9 m of a grid of 1°.
        let start = "$GNGGA,080601.000,2645.0000000,N,08015.0000000,W,1,02,99.99,158.6760,M,-28.676,M,,*";
        assert!(first[1].starts_with(start), "{sentences}");
        // Of two signals of a satellite the stronger one.
        assert!(sentences.contains("GAGSV,1,1,01,04,45,123,41,7*"), "{sentences}");
        assert_eq!(sentences.matches("GPGSV").count(), 3, "{sentences}");
        assert_eq!(text("trajectory.gpx").matches("<trkpt lat=\"2").count(), 3);
        assert!(text("trajectory.kml").contains("<gx:coord>-80.250000000 27.000000000 130.0000</gx:coord>"));
    }
}
