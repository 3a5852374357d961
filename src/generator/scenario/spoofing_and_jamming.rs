//! Conversion of `[[interference]]` and `[[spoofer]]` as written to sources in a scene.

use std::path::Path;
use std::sync::Arc;

use nalgebra::Vector3;

use super::interference::{InterferenceSpec, Kind, SpooferSpec, Strength};
use super::own_sky::Own;
use super::{MotionSpec, Overrides, Power, Scenario, ScenarioError};
use crate::effect::link::LinkBudget;
use crate::levels::strongest;
use crate::scene::{CodeEdge, Scene};
use crate::spoof::{Constellation, Drag, Emitter, Place};
use crate::stage::interference::arrival::{Path as Way, Repetition, Tuning};
use crate::stage::interference::period::Period;
use crate::stage::interference::{ChipEdge, Interferer, Recorded, Waveform};
use crate::synth::band::Filter;
use crate::synth::resample::Interpolator;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::gps::l1ca::L1_CA;
use gnss::samples::Format;

/// Source samples a cycle of a noise's bandwidth: its filter falls within 0.08 of that beyond each edge.
const NOISE_RATE: f64 = 1.5;

/// A part of the sampled band from which on noise is white in all of it.
const WHOLE: f64 = 0.98;

/// Creates the sources of interference of a scene. Sources wholly outside the samples' band are left out:
/// [`unheard`].
pub(super) fn interferers(
    scenario: &Scenario,
    scene: &Scene,
    directory: &Path,
    overrides: &Overrides,
    warnings: &mut Vec<String>,
) -> Result<Vec<Interferer>, ScenarioError> {
    let mut found = Vec::new();
    for (number, spec) in (1_u64..).zip(&scenario.interference) {
        let source = Source { scenario, scene, spec, number, tuning: scene.tuning() };
        found.extend(source.interferer(directory, overrides, warnings)?);
    }
    Ok(found)
}

/// Warnings about sources that lie outside the bands of all front ends.
pub(super) fn unheard<'s>(scenario: &'s Scenario, scenes: &'s [Scene]) -> impl Iterator<Item = String> + 's {
    let numbered = (1_u64..).zip(&scenario.interference);
    let received =
        |number: u64| scenes.iter().flat_map(|scene| &scene.interference).any(|found| found.source == number);
    numbered.filter(move |(number, _)| !received(*number)).map(|(number, spec)| {
        let kind = spec.kind.name();
        format!("interference number {number} ({kind}) lies outside the samples' band: it is not computed")
    })
}

struct Source<'a> {
    scenario: &'a Scenario,
    scene: &'a Scene,
    spec: &'a InterferenceSpec,
    number: u64,
    tuning: Tuning,
}

/// Waveform within the samples' band, with the share of its power there and the middle of this part.
struct Fitted {
    waveform: Waveform,
    share: f64,
    carrier_hz: f64,
    text: String,
}

impl Source<'_> {
    fn refuse(&self, reason: &str) -> ScenarioError {
        let reason = format!("number {} ({}): {reason}", self.number, self.spec.kind.name());
        self.scenario.conflict("interference", reason)
    }

    /// True if stations or elements hear the source, each on its own path.
    fn is_shared(&self) -> bool {
        self.scenario.station.is_some() || self.scenario.array.is_some()
    }

    /// Refuses a source whose power or delay belongs to one antenna, where there are stations.
    fn suits_stations(&self) -> Result<(), ScenarioError> {
        if self.scenario.array.is_some() && self.spec.place.is_none() {
            return Err(self.refuse(
                "elements of an array hear it from where it is: write its position (latitude_deg, longitude_deg and \
                 height_m)",
            ));
        }
        match (self.scenario.station.is_some(), self.spec.place, self.spec.strength) {
            (false, ..) => Ok(()),
            (true, None, _) => Err(self.refuse(
                "stations hear it from where it is: write its position (latitude_deg, longitude_deg and height_m)",
            )),
            (true, Some(_), Strength::Radiated { .. }) if matches!(self.scenario.power, Power::Fixed { .. }) => {
                Err(self.refuse("eirp_dbw needs [power] kind = \"link_budget\", at every station"))
            }
            (true, Some(_), Strength::Radiated { .. }) => Ok(()),
            (true, Some(_), strength) => Err(self.refuse(&format!(
                "{} is the power at one antenna: write eirp_dbw, which all stations share",
                strength.key()
            ))),
        }
    }

    fn interferer(
        &self,
        directory: &Path,
        overrides: &Overrides,
        warnings: &mut Vec<String>,
    ) -> Result<Option<Interferer>, ScenarioError> {
        let spec = self.spec;
        let kind = spec.kind.name();
        self.suits_stations()?;
        let Some(fitted) = self.waveform(directory, overrides, warnings)? else { return Ok(None) };
        let path = spec.place.map(|place| Way { emitter_m: place.to_ecef(), antenna: self.scene.trajectory.clone() });
        let jn0_dbhz = self.jn0_dbhz(path.as_ref())? + 10.0 * libm::log10(fitted.share);
        // Stations hear a switch when its wave arrives.
        let travel_s = |t_s: f64| path.as_ref().filter(|_| self.is_shared()).map_or(0.0, |path| path.travel_s(t_s));
        let switched = |t_s: f64| self.tuning.sample_at(t_s + travel_s(t_s));
        let on = switched(spec.on_s)..spec.off_s.map_or(u64::MAX, switched);
        let place = if path.is_some() { " from its position" } else { "" };
        let end = spec.off_s.map_or(String::new(), |t_s| format!(" to {t_s} s"));
        let description = format!(
            "{kind} at L1 {:+.6} MHz{}{place}, {jn0_dbhz:.1} dB-Hz over the noise, from {} s{end}",
            (fitted.carrier_hz - L1_CA.centre_hz()) / 1e6,
            fitted.text,
            spec.on_s
        );
        // Noise is drawn at the front end's rate, all else by the time: that is the same for every front end.
        let own = matches!(fitted.waveform, Waveform::Noise { .. } | Waveform::White);
        let seed = if own { self.scene.noise_seed() } else { self.scene.seed };
        let (low_hz, high_hz) = self.tuning.band_hz();
        let place_hz = self.tuning.place_hz(fitted.carrier_hz);
        let period = fitted.waveform.sweeps_at().and_then(|repetition| {
            let modulation = fitted.waveform.modulation(self.tuning.sign());
            Period::of(modulation, repetition.hz(), (low_hz - place_hz, high_hz - place_hz))
        });
        Ok(Some(Interferer {
            source: self.number,
            kind,
            waveform: fitted.waveform,
            period: period.map(Arc::new),
            carrier_hz: fitted.carrier_hz,
            jn0_hz: libm::pow(10.0, jn0_dbhz / 10.0),
            path,
            on,
            sent_s: self.is_shared().then_some(spec.on_s),
            // Sources of one scene, and the thermal noise, draw from streams of their own.
            seed: seed ^ self.number.wrapping_mul(0xd1b5_4a32_d192_ed03),
            tuning: self.tuning.clone(),
            switches: self.scene.switches.clone(),
            element: None,
            shared: None,
            description,
        }))
    }

    /// Total power over noise density in dB-Hz at the antenna when the scene starts.
    fn jn0_dbhz(&self, path: Option<&Way>) -> Result<f64, ScenarioError> {
        let budget = match &self.scenario.power {
            Power::Fixed { cn0_dbhz, .. } => match self.spec.strength {
                Strength::OverSignal { db } => return Ok(cn0_dbhz + db),
                Strength::Received { .. } | Strength::Radiated { .. } => {
                    let key = self.spec.strength.key();
                    let reason =
                        format!("{key} is in dBW and needs [power] kind = \"link_budget\"; write js_db instead");
                    return Err(self.refuse(&reason));
                }
            },
            Power::LinkBudget { noise_figure_db, loss_db, .. } => {
                LinkBudget { noise_figure_db: *noise_figure_db, extra_loss_db: *loss_db, ..LinkBudget::default() }
            }
        };
        let radiated = |dbw: f64, travel_s: f64| {
            let turns = 2.0 * std::f64::consts::TAU * travel_s * L1_CA.centre_hz();
            budget.over_noise_dbhz(dbw - 20.0 * libm::log10(turns))
        };
        match (self.spec.strength, path) {
            (Strength::Received { dbw }, _) => Ok(budget.over_noise_dbhz(dbw)),
            (Strength::Radiated { dbw, distance_m: Some(distance_m) }, _) => {
                Ok(radiated(dbw, distance_m / SPEED_OF_LIGHT_MPS))
            }
            (Strength::Radiated { dbw, distance_m: None }, Some(path)) => Ok(radiated(dbw, path.travel_s(0.0))),
            (Strength::Radiated { distance_m: None, .. }, None) => {
                Err(self.refuse("eirp_dbw needs a position, or distance_m"))
            }
            (Strength::OverSignal { db }, _) => {
                let strongest = strongest(self.scene).map_err(|e| self.refuse(&e.to_string()))?;
                let nothing = "js_db counts from the strongest satellite in view at the scene's start, and there is \
                               none; write power_dbw instead";
                strongest.map(|(_, cn0_dbhz)| cn0_dbhz + db).ok_or_else(|| self.refuse(nothing))
            }
        }
    }

    /// Lowest and highest frequency of a band of `width_hz` about the carrier that samples hold, in Hz.
    fn overlap_hz(&self, width_hz: f64) -> Option<(f64, f64)> {
        let (low_hz, high_hz) = self.tuning.band_hz();
        let place_hz = self.tuning.place_hz(self.spec.center_hz);
        let (low_hz, high_hz) = (low_hz.max(place_hz - 0.5 * width_hz), high_hz.min(place_hz + 0.5 * width_hz));
        // A line has no width, and lies inside or outside.
        (low_hz < high_hz || (width_hz == 0.0 && low_hz == high_hz)).then_some((low_hz, high_hz))
    }

    fn waveform(
        &self,
        directory: &Path,
        overrides: &Overrides,
        warnings: &mut Vec<String>,
    ) -> Result<Option<Fitted>, ScenarioError> {
        let (waveform, width_hz, text) = match &self.spec.kind {
            Kind::Cw => (Waveform::Cw, 0.0, String::new()),
            Kind::Chirp { sweep_hz, sweep_s } => {
                self.lasts("sweep_s", *sweep_s)?;
                let waveform = Waveform::Chirp { sweep_hz: *sweep_hz, repetition: Repetition::every_s(*sweep_s) };
                (waveform, sweep_hz.abs(), format!(", sweep of {sweep_hz:e} Hz in {sweep_s:e} s"))
            }
            Kind::Fmcw { sweep_hz, sweep_s } => {
                self.lasts("sweep_s", *sweep_s)?;
                let waveform = Waveform::Fmcw { sweep_hz: *sweep_hz, repetition: Repetition::every_s(2.0 * sweep_s) };
                (waveform, sweep_hz.abs(), format!(", sweeps of {sweep_hz:e} Hz in {sweep_s:e} s and back"))
            }
            Kind::SineFm { deviation_hz, rate_hz } => {
                self.lasts("1/rate_hz", 1.0 / rate_hz)?;
                let waveform =
                    Waveform::SineFm { deviation_hz: *deviation_hz, repetition: Repetition::of_hz(*rate_hz) };
                (waveform, 2.0 * deviation_hz, format!(", deviation {deviation_hz:e} Hz at {rate_hz} Hz"))
            }
            Kind::Pulse { width_s, rate_hz, jitter } => {
                self.lasts("width_s", *width_s)?;
                let repetition = Repetition::of_hz(*rate_hz);
                let waveform = Waveform::Pulse { width_s: *width_s, repetition, jitter: *jitter };
                (waveform, 0.0, format!(", {width_s:e} s on, {rate_hz} times a second, jitter {jitter}"))
            }
            Kind::Matched => {
                let chips_hz = L1_CA.components.first().map_or(0.0, |c| c.chip_rate_hz);
                let waveform = Waveform::Matched { chips: Repetition::of_hz(chips_hz), edge: self.edge() };
                (waveform, 2.0 * chips_hz, format!(", random chips at {:.3} MHz", chips_hz / 1e6))
            }
            Kind::Noise { bandwidth_hz } if self.is_shared() => return self.emitted(*bandwidth_hz, warnings),
            Kind::Noise { bandwidth_hz } => return Ok(self.noise(*bandwidth_hz)),
            Kind::Recording { path, format, rate_hz, repeat } => {
                let bytes = self.scenario.load("interference.file", directory, path, overrides)?;
                return self.recording(&bytes, (*format, *rate_hz, *repeat), warnings).map(Some);
            }
        };
        let Some((low_hz, high_hz)) = self.overlap_hz(width_hz) else { return Ok(None) };
        if high_hz - low_hz < width_hz * (1.0 - 1e-12) {
            let what = if matches!(waveform, Waveform::Matched { .. }) { "folds over" } else { "is silent" };
            warnings.push(format!(
                "interference number {} ({}): only {:.6} of its {:.6} MHz lie in the samples' band: the rest {what}",
                self.number,
                self.spec.kind.name(),
                (high_hz - low_hz) / 1e6,
                width_hz / 1e6
            ));
        }
        let carrier_hz = self.spec.center_hz;
        Ok(Some(Fitted { waveform, share: 1.0, carrier_hz, text }))
    }

    /// Refuses a duration shorter than two samples.
    fn lasts(&self, what: &str, time_s: f64) -> Result<(), ScenarioError> {
        let least_s = 2.0 / self.scene.clock.rate.hz();
        if time_s >= least_s {
            return Ok(());
        }
        Err(self.refuse(&format!("{what} = {time_s:e} s: expected at least two samples, {least_s:e} s")))
    }

    fn edge(&self) -> ChipEdge {
        match self.scene.fidelity.code_edge {
            CodeEdge::Nearest => ChipEdge::Nearest,
            CodeEdge::Area => ChipEdge::Area,
            CodeEdge::BandLimited => ChipEdge::BandLimited(Arc::new(Filter::new(self.scene.cutoff_cps()))),
        }
    }

    /// Noise in the common part of its band and the samples' band.
    fn noise(&self, bandwidth_hz: f64) -> Option<Fitted> {
        let (low_hz, high_hz) = self.overlap_hz(bandwidth_hz)?;
        let rate_hz = self.scene.clock.rate.hz();
        let width_hz = high_hz - low_hz;
        let text = format!(", Gaussian in {:.6} MHz of {:.6} MHz", width_hz / 1e6, bandwidth_hz / 1e6);
        let carrier_hz = self.scene.metadata.center_hz + self.tuning.sign() * 0.5 * (low_hz + high_hz);
        let waveform = if width_hz >= WHOLE * rate_hz {
            Waveform::White
        } else {
            // To a source sample in 2^32; the cut-off takes the rounding up.
            let step = (NOISE_RATE * width_hz / rate_hz * 4_294_967_296.0).round().max(1.0);
            let source_hz = step / 4_294_967_296.0 * rate_hz;
            Waveform::Noise { width_hz, step: step as u64, by: Interpolator::new(0.5 * width_hz / source_hz, true) }
        };
        Some(Fitted { waveform, share: width_hz / bandwidth_hz, carrier_hz, text })
    }

    /// Noise that stations share: in its whole band, of which a front end passes what its samples hold about
    /// the middle.
    fn emitted(&self, bandwidth_hz: f64, warnings: &mut Vec<String>) -> Result<Option<Fitted>, ScenarioError> {
        if self.overlap_hz(bandwidth_hz).is_none() {
            return Ok(None);
        }
        let rate = Repetition::of_hz(NOISE_RATE * bandwidth_hz);
        let cutoff_cps = self.cutoff_cps(rate.hz(), "1.5 times bandwidth_hz", warnings)?;
        let cutoff_cps = cutoff_cps.min(0.5 * bandwidth_hz / rate.hz());
        let width_hz = 2.0 * cutoff_cps * rate.hz();
        let text = format!(", Gaussian in {:.6} MHz of {:.6} MHz", width_hz / 1e6, bandwidth_hz / 1e6);
        let waveform = Waveform::Emitted { width_hz, rate, by: Interpolator::new(cutoff_cps, true) };
        Ok(Some(Fitted { waveform, share: width_hz / bandwidth_hz, carrier_hz: self.spec.center_hz, text }))
    }

    /// Cut-off of the interpolator of a source at `rate_hz`, whose name is `key`, in cycles per sample of it:
    /// what the samples' band holds on each side of its middle.
    fn cutoff_cps(&self, rate_hz: f64, key: &str, warnings: &mut Vec<String>) -> Result<f64, ScenarioError> {
        let (low_hz, high_hz) = self.tuning.band_hz();
        let place_hz = self.tuning.place_hz(self.spec.center_hz);
        let room_hz = (place_hz - low_hz).min(high_hz - place_hz);
        let cutoff_cps = (room_hz / rate_hz).min(0.5);
        // Below a sixteenth of the source's rate the interpolator's 64 neighbours hold no two cycles of the
        // cut-off.
        if cutoff_cps < 1.0 / 16.0 {
            let reason = format!(
                "the samples' band leaves {room_hz} Hz on a side of it: expected at least a sixteenth of {key}, {} Hz",
                rate_hz / 16.0
            );
            return Err(self.refuse(&reason));
        }
        let needed_cps = if matches!(self.spec.kind, Kind::Noise { .. }) { 0.5 / NOISE_RATE } else { 0.5 };
        if cutoff_cps < needed_cps * (1.0 - 1e-9) {
            warnings.push(format!(
                "interference number {} ({}): the samples' band holds {:.6} MHz on each side of its middle: the rest \
                 is filtered away",
                self.number,
                self.spec.kind.name(),
                room_hz / 1e6
            ));
        }
        Ok(cutoff_cps)
    }

    fn recording(
        &self,
        bytes: &[u8],
        (format, file_rate_hz, repeat): (Format, f64, bool),
        warnings: &mut Vec<String>,
    ) -> Result<Fitted, ScenarioError> {
        let (mut i, mut q) = (Vec::new(), Vec::new());
        format.unpack(bytes, &mut i, &mut q);
        let power: f64 = i.iter().zip(&q).map(|(i, q)| f64::from(*i).powi(2) + f64::from(*q).powi(2)).sum();
        let mean = power / i.len() as f64;
        if i.len() < 64 || !mean.is_finite() || mean <= 0.0 {
            return Err(
                self.refuse(&format!("{} samples of mean power {mean}: expected at least 64, not silent", i.len()))
            );
        }
        let scale = (1.0 / mean.sqrt()) as f32;
        i.iter_mut().chain(&mut q).for_each(|x| *x *= scale);
        let cutoff_cps = self.cutoff_cps(file_rate_hz, "sample_rate_hz", warnings)?;
        let waveform = Waveform::Recording {
            samples: Arc::new(Recorded { i, q }),
            rate: Repetition::of_hz(file_rate_hz),
            by: Interpolator::new(cutoff_cps, false),
            repeat,
        };
        let text = format!(", {:.3} s at {file_rate_hz} Hz", bytes.len() as f64 / format.bytes() as f64 / file_rate_hz);
        Ok(Fitted { waveform, share: 1.0, carrier_hz: self.spec.center_hz, text })
    }
}

/// The spoofers of a scene that ends at `end_s`.
pub(super) fn spoofers(
    scenario: &Scenario,
    (scene, own): (&Scene, &[Own]),
    end_s: f64,
    directory: &Path,
    overrides: &Overrides,
    warnings: &mut Vec<String>,
) -> Result<Vec<Arc<Constellation>>, ScenarioError> {
    let mut found = Vec::new();
    for (number, spec) in (1..).zip(&scenario.spoofers) {
        let place = match &spec.motion {
            None => Place::Antenna,
            Some(motion @ (MotionSpec::Pushed { .. } | MotionSpec::Ticks { .. })) => {
                let reason = format!("kind = {:?}: the antenna's motion alone can be pushed", motion.kind());
                return Err(scenario.conflict("spoofer.motion", reason));
            }
            Some(motion) => {
                let trajectory = scenario.trajectory_of(motion, directory, overrides, warnings)?;
                let last_s = spec.off_s.map_or(end_s, |off_s| off_s.min(end_s));
                scenario.covers(motion, &trajectory, spec.on_s.min(last_s), last_s)?;
                Place::Claimed(Box::new(trajectory))
            }
        };
        let mut constellation = Constellation {
            number,
            place,
            drag: None,
            clock_bias_s: spec.clock_bias_s,
            clock_drift: spec.clock_drift,
            emitter: emitter(scenario, (number, spec), scene)?,
            replay_s: spec.replay_s,
            ahead_s: spec.ahead_s,
            sky: own.iter().find(|own| own.number == number).and_then(|own| own.sky.clone()),
            satellites: spec.satellites.clone(),
            advantage: Some(spec.advantage),
            on_s: spec.on_s..spec.off_s.unwrap_or(f64::INFINITY),
        };
        constellation.drag = drag(spec, &constellation, scene);
        found.push(Arc::new(constellation));
    }
    Ok(found)
}

/// Antenna of a spoofer beside an array.
fn emitter(
    scenario: &Scenario,
    (number, spec): (usize, &SpooferSpec),
    scene: &Scene,
) -> Result<Option<Emitter>, ScenarioError> {
    let conflict =
        |reason: &str| Err(scenario.conflict("spoofer.transmitter", format!("of spoofer {number}: {reason}")));
    match (spec.transmitter, &scenario.array) {
        (None, None) => Ok(None),
        (None, Some(_)) => conflict(
            "elements of an array hear it from where it is: write its position ([spoofer.transmitter], latitude_deg, \
             longitude_deg and height_m)",
        ),
        (Some(_), None) => conflict("nothing without [array]: one antenna does not tell where signals come from"),
        (Some(_), Some(elements)) if elements.iter().any(|element| !element.coupling.is_empty()) => {
            conflict("expected elements without coupling_db, which acts on directions of satellites alone")
        }
        (Some(place), Some(_)) => {
            // With one front end alone, the scene may be that of another element than the first.
            let body = scene.element.as_ref().map_or(&scene.trajectory, |element| &element.body);
            Ok(Some(Emitter { position_m: place.to_ecef(), meant_for: scenario.element_motion(body, 0) }))
        }
    }
}

/// The drag in ECEF, its direction that at the position where it begins.
fn drag(spec: &SpooferSpec, from: &Constellation, scene: &Scene) -> Option<Drag> {
    let drag = spec.drag?;
    let here = Geodetic::from_ecef(&from.motion(&scene.trajectory, drag.start_s).position_m);
    let ((sin_a, cos_a), (sin_e, cos_e)) = (libm::sincos(drag.azimuth_rad), libm::sincos(drag.elevation_rad));
    Some(Drag {
        start_s: drag.start_s,
        direction: here.ecef_to_enu().transpose() * Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e),
        speed_mps: drag.speed_mps,
        acceleration_mps2: drag.acceleration_mps2,
    })
}
