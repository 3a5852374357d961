//! What is true at one reading of the receiver's clock, and the files that tell it to the judge.
//!
//! One definition serves samples and records: with T the clock's reading, t the true time and τ the
//! light time, the delay of the code is (T − t) + τ + (delays of the ray) − (satellite clock); that of the
//! carrier takes the ray's carrier delay instead, and is counted in cycles at RF. Doppler is
//! minus the derivative of that same carrier by the receiver's clock. Limits: tropospheric and
//! ionospheric shares in `sky.csv` are half the sum and half the difference of code and carrier delays.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

use crate::generator::knots::Arrival;
use crate::generator::ray::Ray;
use crate::generator::scene::{CodeEdge, Scene};
use crate::generator::sky::{Emission, emission};
use crate::generator::vehicle::Motion;
use crate::gnss::broadcast::OrbitError;
use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::record::{NavigationRow, Observation, SkyRow, TrajectoryRow};
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;
use crate::gnss::time::Epoch;

/// Step of the difference quotient behind the Doppler.
const DOPPLER_STEP_S: f64 = 0.01;

/// A satellite's signal as it arrives at one reading of the receiver's clock.
#[derive(Clone, Debug)]
pub struct Seen {
    pub emission: Emission,
    pub rays: Vec<Ray>,
    pub arrivals: Vec<Arrival>,
}

/// Antenna motion and true time when the receiver's clock reads `local`.
fn received(scene: &Scene, local: Epoch) -> (Epoch, f64, Motion) {
    let start = scene.clock.start;
    let elapsed_s = scene.receiver_clock.true_elapsed_s(start, local);
    (scene.receiver_clock.true_time(start, local), elapsed_s, scene.trajectory.at(elapsed_s))
}

/// What arrives from `sv` when the receiver's clock reads `local`; `None` without an ephemeris.
///
/// # Errors
/// Those of the orbit.
pub fn seen(scene: &Scene, sv: Sv, signal: &Signal, local: Epoch) -> Result<Option<Seen>, OrbitError> {
    let (time, _, motion) = received(scene, local);
    let Some(emission) = emission(&scene.catalogue, sv, time, &motion)? else { return Ok(None) };
    let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
    for effect in &scene.effects {
        effect.act(&emission.sight, signal, &mut rays);
    }
    // Small numbers only: no reading of a clock enters a sum of seconds.
    let common_s = local.since(time) + emission.travel_s - emission.satellite_clock_s;
    let arrivals = rays
        .iter()
        .map(|ray| Arrival {
            delay_s: common_s + ray.code_delay_s,
            carrier_cycles: signal.carrier_hz * (common_s + ray.carrier_delay_s) + ray.phase_cycles,
            cn0_hz: ray.cn0_hz,
        })
        .collect();
    Ok(Some(Seen { emission, rays, arrivals }))
}

/// Whether `sv` is in the scene's sky when the receiver's clock reads `local`: it has a message to send
/// and stands above the mask. Health is the scene's to judge, through its exclusions.
///
/// # Errors
/// Those of the orbit.
pub fn in_view(scene: &Scene, sv: Sv, local: Epoch) -> Result<bool, OrbitError> {
    let (time, _, motion) = received(scene, local);
    if scene.catalogue.sent_at(sv, time).is_none() {
        return Ok(false);
    }
    let found = emission(&scene.catalogue, sv, time, &motion)?;
    Ok(found.is_some_and(|emission| emission.sight.look.elevation_rad >= scene.mask_rad))
}

/// Doppler: minus the derivative of the carrier, by five points 10 ms apart that do not straddle a break.
fn doppler_hz(scene: &Scene, sv: Sv, signal: &Signal, local: Epoch) -> Result<Option<f64>, OrbitError> {
    let (_, elapsed_s, _) = received(scene, local);
    let reach_s = 2.0 * DOPPLER_STEP_S;
    let breaks = scene.trajectory.breaks_s();
    let near = |b: &&f64| (**b - elapsed_s).abs() < reach_s;
    // Lagrange's derivative weights; the middle of the stencil moves away from the break.
    let (offset, weights) = match breaks.iter().find(near) {
        None => (-2.0, [1.0, -8.0, 0.0, 8.0, -1.0]),
        Some(b) if *b <= elapsed_s => (0.0, [-25.0, 48.0, -36.0, 16.0, -3.0]),
        Some(_) => (-4.0, [3.0, -16.0, 36.0, -48.0, 25.0]),
    };
    let mut sum = 0.0;
    let mut base = None;
    for (k, weight) in weights.into_iter().enumerate() {
        let at = local.plus_s((offset + k as f64) * DOPPLER_STEP_S);
        let Some(seen) = seen(scene, sv, signal, at)? else { return Ok(None) };
        let Some(arrival) = seen.arrivals.first() else { return Ok(None) };
        // Weights add up to zero, so the first value can be left out of all.
        let base = *base.get_or_insert(arrival.carrier_cycles);
        sum += weight * (arrival.carrier_cycles - base);
    }
    Ok(Some(-sum / (12.0 * DOPPLER_STEP_S)))
}

/// The observation of `sv` at a sample, of its first ray, and where it stands in the sky.
///
/// # Errors
/// Those of the orbit.
pub fn observe(
    scene: &Scene,
    sv: Sv,
    signal: &'static Signal,
    sample: u64,
    locked_s: f64,
) -> Result<Option<(Observation, SkyRow)>, OrbitError> {
    let local = scene.clock.epoch(sample);
    let Some(seen) = seen(scene, sv, signal, local)? else { return Ok(None) };
    let (Some(arrival), Some(ray)) = (seen.arrivals.first(), seen.rays.first()) else { return Ok(None) };
    let Some(doppler_hz) = doppler_hz(scene, sv, signal, local)? else { return Ok(None) };
    let sent = local.plus_s(-arrival.delay_s);
    let observation = Observation {
        sample,
        sv,
        signal,
        sent_s: sent.seconds(),
        sent_fraction_s: sent.fraction(),
        pseudorange_m: SPEED_OF_LIGHT_MPS * arrival.delay_s,
        carrier_cycles: arrival.carrier_cycles,
        doppler_hz,
        cn0_dbhz: 10.0 * libm::log10(arrival.cn0_hz),
        locked_s,
    };
    let sight = &seen.emission.sight;
    let sky = SkyRow {
        sample,
        sv,
        azimuth_deg: sight.look.azimuth_rad.to_degrees(),
        elevation_deg: sight.look.elevation_rad.to_degrees(),
        range_m: sight.range_m,
        satellite_clock_m: SPEED_OF_LIGHT_MPS * seen.emission.satellite_clock_s,
        ionosphere_m: 0.5 * SPEED_OF_LIGHT_MPS * (ray.code_delay_s - ray.carrier_delay_s),
        troposphere_m: 0.5 * SPEED_OF_LIGHT_MPS * (ray.code_delay_s + ray.carrier_delay_s),
    };
    Ok(Some((observation, sky)))
}

/// Antenna and clock at a sample.
pub fn trajectory(scene: &Scene, sample: u64) -> TrajectoryRow {
    let (time, elapsed_s, motion) = received(scene, scene.clock.epoch(sample));
    TrajectoryRow {
        sample,
        gps_s: time.seconds(),
        gps_fraction_s: time.fraction(),
        x_m: motion.position_m.x,
        y_m: motion.position_m.y,
        z_m: motion.position_m.z,
        vx_mps: motion.velocity_mps.x,
        vy_mps: motion.velocity_mps.y,
        vz_mps: motion.velocity_mps.z,
        clock_bias_s: scene.receiver_clock.bias_at(elapsed_s),
        clock_drift: scene.receiver_clock.drift,
    }
}

/// Why the truth could not be written.
#[derive(Debug, Error)]
pub enum TruthError {
    #[error("{path}: {source}")]
    File { path: PathBuf, source: io::Error },
    #[error("{path}: {source}")]
    Row { path: PathBuf, source: csv::Error },
}

struct Table {
    path: PathBuf,
    rows: csv::Writer<BufWriter<File>>,
}

impl Table {
    fn create(directory: &Path, name: &str) -> Result<Self, TruthError> {
        let path = directory.join(name);
        let file = File::create(&path).map_err(|source| TruthError::File { path: path.clone(), source })?;
        Ok(Self { path, rows: csv::Writer::from_writer(BufWriter::new(file)) })
    }

    fn write(&mut self, row: impl Serialize) -> Result<(), TruthError> {
        self.rows.serialize(row).map_err(|source| TruthError::Row { path: self.path.clone(), source })
    }

    fn flush(&mut self) -> Result<(), TruthError> {
        self.rows.flush().map_err(|source| TruthError::File { path: self.path.clone(), source })
    }
}

/// Writes `observations.csv`, `sky.csv`, `trajectory.csv`, `navigation.csv` and `scene.json`.
pub struct Writer {
    directory: PathBuf,
    observations: Table,
    sky: Table,
    trajectory: Table,
}

#[derive(Serialize)]
struct SceneFile<'a> {
    name: &'a str,
    seed: u64,
    start: String,
    duration_s: f64,
    samples: u64,
    sample_rate_hz: f64,
    center_hz: f64,
    inverted: bool,
    format: &'a str,
    code_edge: &'a str,
    knot_tolerance_cycles: f64,
    mask_deg: f64,
    truth_interval_s: f64,
    signals: Vec<&'a str>,
    noise: bool,
    noise_lsb: f32,
}

impl Writer {
    /// Creates the directory, if need be, and the files in it.
    ///
    /// # Errors
    /// [`TruthError`] with the path that failed.
    pub fn create(directory: &Path) -> Result<Self, TruthError> {
        fs::create_dir_all(directory).map_err(|source| TruthError::File { path: directory.to_owned(), source })?;
        Ok(Self {
            directory: directory.to_owned(),
            observations: Table::create(directory, "observations.csv")?,
            sky: Table::create(directory, "sky.csv")?,
            trajectory: Table::create(directory, "trajectory.csv")?,
        })
    }

    /// Writes `scene.json`.
    pub fn scene(&mut self, scene: &Scene) -> Result<(), TruthError> {
        let file = SceneFile {
            name: &scene.name,
            seed: scene.seed,
            start: scene.clock.start.to_string(),
            duration_s: scene.clock.rate.elapsed_s(scene.samples),
            samples: scene.samples,
            sample_rate_hz: scene.clock.rate.hz(),
            center_hz: scene.metadata.center_hz,
            inverted: scene.metadata.inverted,
            format: scene.metadata.format.name(),
            code_edge: match scene.fidelity.code_edge {
                CodeEdge::Nearest => "nearest",
                CodeEdge::Area => "area",
                CodeEdge::BandLimited => "band_limited",
            },
            knot_tolerance_cycles: scene.fidelity.knot_tolerance_cycles,
            mask_deg: scene.mask_rad.to_degrees(),
            truth_interval_s: scene.truth_interval_s,
            signals: scene.signals.iter().map(|signal| signal.name).collect(),
            noise: scene.noise,
            noise_lsb: scene.noise_lsb,
        };
        let path = self.directory.join("scene.json");
        serde_json::to_string_pretty(&file)
            .map_err(io::Error::from)
            .and_then(|text| fs::write(&path, text + "\n"))
            .map_err(|source| TruthError::File { path, source })
    }

    /// Appends what is true at one sample.
    pub fn epoch(
        &mut self,
        trajectory: &TrajectoryRow,
        satellites: &[(Observation, SkyRow)],
    ) -> Result<(), TruthError> {
        self.trajectory.write(trajectory)?;
        for (observation, sky) in satellites {
            self.observations.write(observation)?;
            self.sky.write(sky)?;
        }
        Ok(())
    }

    /// Writes `navigation.csv` and everything that is still buffered.
    pub fn finish(&mut self, navigation: &BTreeSet<NavigationRow>) -> Result<(), TruthError> {
        let mut table = Table::create(&self.directory, "navigation.csv")?;
        for row in navigation {
            table.write(row)?;
        }
        table.flush()?;
        self.observations.flush()?;
        self.sky.flush()?;
        self.trajectory.flush()
    }
}
