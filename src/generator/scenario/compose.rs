//! From a scenario to a scene: files are loaded, effects put in order, and values checked against each other.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::motion::{FileKind, MotionSpec};
use super::stages::PlaybackSpec;
use super::{Scenario, ScenarioError, hostile, parts, satellite};
use crate::generator::presence;
use crate::generator::random::Stream;
use crate::generator::ray::Ray;
use crate::generator::ripple::scintillation::Scintillation;
use crate::generator::scene::{Scene, folded_hz, is_link_outside, is_outside, main_lobe_hz};
use crate::generator::sky::emission;
use crate::generator::stage::playback::Playback;
use crate::generator::vehicle::attitude::Nose;
use crate::generator::vehicle::{Trajectory, file, route};
use crate::gnss::broadcast::OrbitError;
use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::samples::{Format, IfMetadata};
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{Carrier, Signal};
use crate::gnss::time::SampleClock;

/// Samples of one scene at most: 19 days at 60 Msps.
const MAX_SAMPLES: f64 = 1e14;
/// Beyond this the equations of [`crate::generator::sky`], which keep no square of speed over light's for the
/// user, are no longer a receiver's world.
const LARGEST_SPEED_MPS: f64 = 0.1 * SPEED_OF_LIGHT_MPS;
/// Largest navigation file, packed.
const MAX_NAVIGATION_BYTES: u64 = 64 << 20;

/// What the command line changes in a scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overrides {
    pub seed: Option<u64>,
    pub format: Option<Format>,
    /// Whether files may lie outside the scenario's directory.
    pub allow_outside: bool,
}

/// Where a scenario's files are.
pub(super) struct Files<'a> {
    pub directory: &'a Path,
    pub overrides: &'a Overrides,
}

impl Scenario {
    /// Makes the scene, reading files relative to `directory`; also returns what the user should know of.
    pub fn compose(&self, directory: &Path, overrides: &Overrides) -> Result<(Scene, Vec<String>), ScenarioError> {
        let mut warnings = Vec::new();
        let metadata = self.metadata(overrides)?;
        let clock = SampleClock { start: self.start, rate: metadata.rate };
        let samples = self.samples()?;
        let trajectory = self.turned(self.trajectory_of(&self.motion, directory, overrides, &mut warnings)?)?;
        let speed_mps = trajectory.knots().iter().fold(0.0_f64, |most, knot| most.max(knot.motion.velocity_mps.norm()));
        if speed_mps > LARGEST_SPEED_MPS {
            let reason =
                format!("reaches {speed_mps:e} m/s: expected at most {LARGEST_SPEED_MPS:e} m/s, a tenth of light's");
            return Err(self.conflict("motion", reason));
        }
        let seed = overrides.seed.unwrap_or(self.seed);
        let receiver_clock = self.receiver_clock.clock(seed, metadata.rate, &trajectory);
        let end_s = receiver_clock.true_elapsed_s(self.start, clock.epoch(samples));
        let start_s = receiver_clock.true_elapsed_s(self.start, self.start);
        // A file that begins at the scene's start must do with a receiver's clock that is ahead by its bias.
        self.covers(&self.motion, &trajectory, start_s.max(0.0), end_s.min(self.duration_s))?;
        let signals = self.signals_in_band(&metadata, &mut warnings)?;
        let navigation = parts::navigation(self, directory, overrides, &mut warnings)?;
        let files = Files { directory, overrides };
        let sky = parts::sky(self, &navigation, &files, end_s, &mut warnings)?;
        let message_faults = satellite::message_faults(self, &sky.catalogue, seed)?;
        let satellite_clocks = satellite::clocks(self, &sky.catalogue, &receiver_clock, seed, metadata.rate);
        let effects = parts::effects(self, &files, &navigation, (&sky, &trajectory), end_s)?;
        let noise_lsb = self.front_end.noise_lsb.unwrap_or_else(|| default_noise_lsb(metadata.format));
        let front_end = self.stages.front_end(&self.front_end, metadata.format, seed, noise_lsb);
        let mut scene = Scene {
            name: self.name.clone(),
            seed,
            samples,
            clock,
            receiver_clock,
            trajectory,
            catalogue: Arc::new(sky.catalogue),
            broadcast: Arc::new(sky.broadcast),
            message_faults,
            satellite_clocks,
            signals,
            excluded: sky.excluded,
            mask_rad: self.mask_rad,
            effects,
            scintillation: self
                .scintillation
                .clone()
                .filter(|strength| strength.is_felt())
                .map(|strength| Scintillation::new(strength, metadata.rate, Stream::new(seed, "scintillation"))),
            playback: None,
            interference: Vec::new(),
            spoofers: Vec::new(),
            noise: self.noise,
            front_end: front_end.map_err(|reason| self.conflict("filter.bandwidth_hz", reason))?,
            noise_lsb,
            fidelity: self.fidelity,
            truth_interval_s: self.truth_interval_s,
            expect: self.expect.clone(),
            faults: self.faults(),
            metadata,
        };
        scene.interference = hostile::interferers(self, &scene, directory, overrides, &mut warnings)?;
        scene.spoofers = hostile::spoofers(self, &scene, end_s, directory, overrides, &mut warnings)?;
        let orbit = |e: OrbitError| {
            let key = if matches!(e, OrbitError::Near { .. }) { "motion" } else { "navigation.file" };
            self.conflict(key, e.to_string())
        };
        let (visible, signals_lsb) = at_start(&scene).map_err(orbit)?;
        if let Some(PlaybackSpec { bits, load_sigma, attenuation_db }) = self.stages.playback {
            let step_lsb = signals_lsb * 2.0 * load_sigma / libm::exp2(f64::from(bits));
            if signals_lsb == 0.0 {
                let reason = "no satellite is above the mask at the start: there is nothing to set its level by";
                return Err(self.conflict("playback", reason.to_owned()));
            }
            scene.playback = Some(Playback { bits, step_lsb: step_lsb as f32, attenuation_db });
        }
        let missing = presence::missing(&scene, end_s).map_err(orbit)?;
        warnings.extend(presence::warning(&missing, self.start));
        warnings.extend(scene.fidelity.warning(scene.clock.rate.hz()));
        if visible < 4 {
            let mask_deg = self.mask_rad.to_degrees();
            warnings.push(format!(
                "{visible} satellites above satellites.mask_deg = {mask_deg}, or from space not behind the Earth, at the \
                 start: a position needs 4"
            ));
        }
        Ok((scene, warnings))
    }

    pub(super) fn conflict(&self, key: &'static str, reason: String) -> ScenarioError {
        ScenarioError::Conflict { origin: self.origin.clone(), key, reason }
    }

    fn metadata(&self, overrides: &Overrides) -> Result<IfMetadata, ScenarioError> {
        let front_end = &self.front_end;
        let format = overrides.format.unwrap_or(front_end.format);
        if !format.is_complex() && front_end.if_hz <= 0.0 {
            let reason = format!("{} Hz with the real format {format}: expected more than 0", front_end.if_hz);
            return Err(self.conflict("front_end.if_hz", reason));
        }
        // The intermediate frequency is that of the first signal.
        let carrier_hz = self.signals.first().map_or(0.0, |signal| signal.centre_hz());
        let offset_hz = if front_end.inverted { -front_end.if_hz } else { front_end.if_hz };
        let center_hz = carrier_hz - offset_hz;
        Ok(IfMetadata {
            format,
            rate: front_end.rate,
            center_hz,
            inverted: front_end.inverted,
            start: Some(self.start),
        })
    }

    /// Whole samples in the scene.
    fn samples(&self) -> Result<u64, ScenarioError> {
        let samples = (self.duration_s * self.front_end.rate.hz()).round();
        if samples > MAX_SAMPLES {
            let rate_hz = self.front_end.rate.hz();
            let reason =
                format!("{} s at {rate_hz} Hz are {samples:e} samples: expected at most 1e14", self.duration_s);
            return Err(self.conflict("duration_s", reason));
        }
        Ok(samples as u64)
    }

    /// The signals whose main lobe reaches into the band of the samples; warns when one does not fit as a whole.
    fn signals_in_band(
        &self,
        metadata: &IfMetadata,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<&'static Signal>, ScenarioError> {
        let half = 0.5 * metadata.rate.hz();
        let if_hz = self.front_end.if_hz;
        // Of real samples the band is the one, half the rate wide, in which the IF lies.
        let zone = (if_hz / half).floor();
        let (low, high) = if metadata.format.is_complex() { (-half, half) } else { (zone * half, (zone + 1.0) * half) };
        if !metadata.format.is_complex() && zone > 0.0 {
            let folded = folded_hz(if_hz, metadata.rate.hz());
            let mirrored = if folded < 0.0 { ", mirrored" } else { "" };
            warnings.push(format!(
                "front_end.if_hz = {if_hz} lies above half of sample_rate_hz: the samples hold the band from {:.3} to {:.3} MHz, \
                 the carrier at {:.6} MHz{mirrored}",
                low / 1e6,
                high / 1e6,
                folded.abs() / 1e6
            ));
        }
        let mut inside = Vec::new();
        for &signal in &self.signals {
            let (from, to) = main_lobe_hz(metadata, signal);
            let told = format!(
                "{signal}: its main lobe, {:.3} to {:.3} MHz, does not fit into the samples' band, {:.3} to {:.3} MHz",
                from / 1e6,
                to / 1e6,
                low / 1e6,
                high / 1e6
            );
            if is_outside(metadata, signal) {
                warnings.push(format!("{told} at all: it is not computed"));
                continue;
            }
            if from < low || to > high {
                warnings.push(format!("{told}: it will fold over"));
            }
            let outside = |sv: &Sv| is_link_outside(metadata, signal.link(*sv));
            if matches!(signal.carrier, Carrier::Channels { .. }) {
                let absent: Vec<String> = signal.satellites().filter(outside).map(|sv| sv.to_string()).collect();
                if !absent.is_empty() {
                    let names = absent.join(" ");
                    warnings.push(format!("{signal}: outside the samples' band, and not computed: {names}"));
                }
            }
            inside.push(signal);
        }
        if inside.is_empty() {
            let names: Vec<&str> = self.signals.iter().map(|signal| signal.name).collect();
            let reason = format!(
                "{} Hz: expected one at which the main lobe of some signal ({}) reaches into the samples' band, {:.3} to {:.3} MHz",
                self.front_end.if_hz,
                names.join(", "),
                low / 1e6,
                high / 1e6
            );
            return Err(self.conflict("front_end.if_hz", reason));
        }
        Ok(inside)
    }

    /// A motion, with its file read.
    pub(super) fn trajectory_of(
        &self,
        motion: &MotionSpec,
        directory: &Path,
        overrides: &Overrides,
        warnings: &mut Vec<String>,
    ) -> Result<Trajectory, ScenarioError> {
        match motion {
            MotionSpec::Static(place) => Ok(Trajectory::fixed(place.to_ecef())),
            MotionSpec::Waypoints { points, limits } => {
                route::trajectory(points, limits).map_err(|e| self.conflict("motion.point", e.to_string()))
            }
            MotionSpec::Rocket(rocket) => {
                // A second more than the scene, for a receiver's clock that lags.
                let until_s =
                    self.duration_s * (1.0 + self.receiver_clock.drift.abs()) + 1.0 + self.receiver_clock.bias_s.abs();
                rocket.trajectory(until_s).map_err(|e| self.conflict("motion", e.to_string()))
            }
            MotionSpec::Orbit(orbit) => {
                let reach_s = 2.0 + self.receiver_clock.bias_s.abs();
                let until_s = self.duration_s * (1.0 + self.receiver_clock.drift.abs()) + reach_s;
                orbit.trajectory(-reach_s, until_s).map_err(|e| self.conflict("motion", e.to_string()))
            }
            MotionSpec::File { path, kind, max_gap_s } => {
                let options = file::Options { start: self.start, max_gap_s: *max_gap_s };
                let full = self.resolve("motion.file", directory, path, overrides)?;
                let input = File::open(&full).map_err(|e| self.unreadable("motion.file", path, e))?;
                let name = path.display().to_string();
                let refuse = |e: file::FileError| match e.fault {
                    file::Fault::Read(error) => self.unreadable("motion.file", path, error),
                    _ => self.conflict("motion.file", e.to_string()),
                };
                match kind {
                    FileKind::Csv => {
                        let (trajectory, ignored) = file::read_csv(input, &name, &options).map_err(refuse)?;
                        if !ignored.is_empty() {
                            warnings.push(format!("{name}: columns not used: {}", ignored.join(", ").escape_debug()));
                        }
                        Ok(trajectory)
                    }
                    FileKind::Nmea => {
                        let (trajectory, skipped) = file::read_nmea(input, &name, &options).map_err(refuse)?;
                        if skipped > 0 {
                            warnings.push(format!("{name}: {skipped} GGA sentences without a fix left out"));
                        }
                        Ok(trajectory)
                    }
                }
            }
        }
    }

    /// The motion of a body with the scenario's attitude.
    fn turned(&self, trajectory: Trajectory) -> Result<Trajectory, ScenarioError> {
        let Some(attitude) = self.attitude else { return Ok(trajectory) };
        if matches!(attitude.nose, Nose::Velocity { .. }) && trajectory.is_static() {
            let reason = "kind = \"velocity\", but the motion stands still: use kind = \"fixed\", or let it move";
            return Err(self.conflict("attitude", reason.to_owned()));
        }
        Ok(trajectory.with_attitude(attitude))
    }

    /// Refuses a motion that does not last from `start_s` to `end_s`.
    pub(super) fn covers(
        &self,
        motion: &MotionSpec,
        trajectory: &Trajectory,
        start_s: f64,
        end_s: f64,
    ) -> Result<(), ScenarioError> {
        let (from_s, to_s) = trajectory.span_s();
        if from_s > start_s || to_s < end_s {
            let kind = motion.kind();
            return Err(self.conflict(
                "motion",
                format!(
                    "kind = {kind:?} is known from {from_s:.3} s to {to_s:.3} s, but the scene needs {start_s:.6} s to {end_s:.6} s: \
                     change duration_s, or let the motion end at rest"
                ),
            ));
        }
        Ok(())
    }

    fn unreadable(&self, key: &'static str, path: &Path, error: std::io::Error) -> ScenarioError {
        ScenarioError::Read { origin: self.origin.clone(), key, path: path.to_owned(), error }
    }

    /// The full path of a file that the scenario names; it must be a file below the scenario's directory.
    fn resolve(
        &self,
        key: &'static str,
        directory: &Path,
        path: &Path,
        overrides: &Overrides,
    ) -> Result<PathBuf, ScenarioError> {
        let refuse = |reason: &str| ScenarioError::File {
            origin: self.origin.clone(),
            key,
            path: path.to_owned(),
            reason: reason.to_owned(),
        };
        let io = |e: std::io::Error| self.unreadable(key, path, e);
        // An empty directory is that of a scenario named without one.
        let directory = if directory.as_os_str().is_empty() { Path::new(".") } else { directory };
        let full = directory.join(path).canonicalize().map_err(io)?;
        if !overrides.allow_outside && !full.starts_with(directory.canonicalize().map_err(io)?) {
            return Err(refuse(
                "lies outside the scenario's directory (run, generate and plan permit it with --allow-outside)",
            ));
        }
        if !full.metadata().map_err(io)?.is_file() {
            return Err(refuse("is not a file"));
        }
        Ok(full)
    }

    /// The bytes of a file that the scenario names.
    pub(super) fn load(
        &self,
        key: &'static str,
        directory: &Path,
        path: &Path,
        overrides: &Overrides,
    ) -> Result<Vec<u8>, ScenarioError> {
        let full = self.resolve(key, directory, path, overrides)?;
        let bytes = full.metadata().map_err(|e| self.unreadable(key, path, e))?.len();
        if bytes > MAX_NAVIGATION_BYTES {
            return Err(ScenarioError::File {
                origin: self.origin.clone(),
                key,
                path: path.to_owned(),
                reason: format!("{bytes} bytes: expected at most {MAX_NAVIGATION_BYTES}"),
            });
        }
        std::fs::read(full).map_err(|e| self.unreadable(key, path, e))
    }
}

/// Satellites of the scene above the mask at its start, and the standard deviation per component of their sum in LSB.
fn at_start(scene: &Scene) -> Result<(usize, f64), OrbitError> {
    let motion = scene.trajectory.at(0.0);
    let (mut visible, mut sum_hz) = (0, 0.0);
    for sv in scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)) {
        let found = emission(&scene.catalogue, sv, scene.clock.start, &motion)?;
        let Some(found) = found.filter(|e| scene.sees(&e.sight)) else { continue };
        visible += usize::from(scene.signals_of(sv).next().is_some());
        for signal in scene.signals_of(sv) {
            let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
            scene.effects.iter().for_each(|effect| effect.act(&found.sight, signal, &mut rays));
            sum_hz += rays.iter().fold(0.0, |sum, ray| sum + ray.cn0_hz);
        }
    }
    let real = if scene.metadata.format.is_complex() { 1.0 } else { 2.0 };
    Ok((visible, f64::from(scene.noise_lsb) * (real * sum_hz / scene.clock.rate.hz()).sqrt()))
}

/// Gain when the scenario sets none. Eleven satellites at 47 dB-Hz in 2.6 Msps add a tenth to the noise's standard
/// deviation, so 8-bit full scale at 4.5 times the noise is 4 times the composite: 1e-4 of the samples saturate.
/// 16 bits leave 24 dB of headroom on top; floating point has the noise as its unit.
fn default_noise_lsb(format: Format) -> f32 {
    match format {
        Format::Ci8 | Format::Cu8 | Format::Ri8 => 28.0,
        Format::Ci16Le | Format::Ri16Le => 512.0,
        Format::Cf32Le => 1.0,
    }
}
