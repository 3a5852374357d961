//! Composition of scenes from a scenario: files are loaded, effects put in order, and values checked against
//! each other.
//!
//! What front ends share (motion, clock, sky, effects) is made once; each front end becomes a scene of its
//! own, the one that it would be alone.

use std::path::Path;
use std::sync::Arc;

use super::files::Files;
use super::front_end::FrontEnd;
use super::own_sky::Own;
use super::stages::PlaybackSpec;
use super::{Scenario, ScenarioError, parts, satellite, spoofing_and_jamming};
use crate::authentication::Osnma;
use crate::catalogue::Catalogue;
use crate::clock::ReceiverClock;
use crate::clock::nodes::Nodes;
use crate::fast_phase::satellite::SatelliteClocks;
use crate::fast_phase::scintillation::Scintillation;
use crate::inertial::Imu;
use crate::message::{MessageFault, Senders};
use crate::presence;
use crate::random::{Stream, seed_of};
use crate::ray::{Effect, Ray};
use crate::scene::Scene;
use crate::sky::emission;
use crate::stage::playback::Playback;
use crate::switches::Switches;
use crate::vehicle::Trajectory;
use gnss::broadcast::OrbitError;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::message::Authentication;
use gnss::place::counted;
use gnss::samples::{Format, IfMetadata};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::SampleClock;

/// Largest speed in m/s. The equations of [`crate::sky`] neglect the square of the user's speed over that of
/// light.
const LARGEST_SPEED_MPS: f64 = 0.1 * SPEED_OF_LIGHT_MPS;

/// Values of a scenario that the command line overrides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Seed that replaces the scenario's.
    pub seed: Option<u64>,
    /// Sample format of every front end.
    pub format: Option<Format>,
    /// True if files may lie outside the scenario's directory.
    pub allow_outside: bool,
}

/// Parts that the front ends of a scene share.
struct World {
    /// Seed of what is common to all stations, and of what is a station's own.
    seed: u64,
    own_seed: u64,
    nodes: Nodes,
    /// Motion of the antenna that the attitude states, and of the one whose position the truth states: an
    /// array's first element.
    body: Trajectory,
    trajectory: Trajectory,
    imu: Option<Imu>,
    switches: Option<Arc<Switches>>,
    receiver_clock: ReceiverClock,
    /// True time since the start at which the scene ends.
    end_s: f64,
    catalogue: Arc<Catalogue>,
    /// Spoofers with ephemerides of their own.
    own: Vec<Own>,
    messages: Arc<Senders>,
    osnma: Option<Arc<Osnma>>,
    excluded: Vec<Sv>,
    message_faults: Vec<MessageFault>,
    satellite_clocks: Arc<SatelliteClocks>,
    effects: Vec<Arc<dyn Effect>>,
    scintillation: Option<Arc<Scintillation>>,
}

/// Band and format of a front end's samples.
struct Band<'s> {
    front_end: &'s FrontEnd,
    metadata: IfMetadata,
    samples: u64,
    signals: Vec<&'static Signal>,
}

impl Scenario {
    /// Composes the scene of a scenario with one front end. Warnings of [`Scenario::compose`] are dropped.
    ///
    /// # Errors
    /// Errors of [`Scenario::compose`].
    pub fn scene(&self) -> Result<Scene, ScenarioError> {
        self.compose(&self.directory, &Overrides::default()).map(|(scene, _)| scene)
    }

    /// Composes the scene of a scenario with one front end, with files relative to `directory`. It also
    /// returns warnings for the user.
    ///
    /// # Errors
    /// Values that are impossible, alone or together; several front ends, of which
    /// [`Scenario::with_front_end`] chooses one.
    pub fn compose(&self, directory: &Path, overrides: &Overrides) -> Result<(Scene, Vec<String>), ScenarioError> {
        if self.front_ends.len() > 1 {
            let names = self.front_end_names();
            let reason = format!("there are {}, {}: expected one here", names.len(), names.join(", "));
            return Err(self.conflict("front_end", reason));
        }
        let (scenes, warnings) = self.compose_all(directory, overrides)?;
        let none = || self.conflict("front_end", "there is none: expected one".to_owned());
        scenes.into_iter().next().map(|scene| (scene, warnings)).ok_or_else(none)
    }

    /// Composes the scenes of all front ends. Each equals the scene that its front end has alone.
    ///
    /// # Errors
    /// Values that are impossible, alone or together; several stations, of which [`Scenario::with_station`]
    /// chooses one.
    pub fn compose_all(
        &self,
        directory: &Path,
        overrides: &Overrides,
    ) -> Result<(Vec<Scene>, Vec<String>), ScenarioError> {
        self.one_station()?;
        self.suits_array()?;
        let mut warnings = Vec::new();
        let files = Files { directory, overrides };
        let mut bands = Vec::with_capacity(self.front_ends.len());
        for front_end in &self.front_ends {
            let metadata = self.metadata(front_end, overrides)?;
            let signals = self.signals_in_band(front_end, &metadata, &mut warnings)?;
            bands.push(Band { samples: self.samples(front_end)?, front_end, metadata, signals });
        }
        let idle = |signal: &&Signal| !bands.iter().any(|band| band.signals.contains(signal));
        if bands.len() > 1 {
            let unheard = self.signals.iter().copied().filter(idle);
            warnings
                .extend(unheard.map(|signal| format!("{signal}: no front end receives it, and it is not computed")));
        }
        let world = self.world(&bands, &files, &mut warnings)?;
        let mut scenes = Vec::with_capacity(bands.len());
        for band in bands {
            scenes.push(self.scene_of(&world, band, &files, &mut warnings)?);
        }
        share_waves(&mut scenes);
        warnings.extend(spoofing_and_jamming::unheard(self, &scenes));
        if let Some(first) = scenes.first() {
            let spoofers = spoofing_and_jamming::spoofers(
                self,
                (first, &world.own),
                world.end_s,
                directory,
                overrides,
                &mut warnings,
            )?;
            scenes.iter_mut().for_each(|scene| scene.spoofers.clone_from(&spoofers));
        }
        // A position may be by the signals of several front ends: the most satellites count.
        let mut most = 0;
        for scene in &mut scenes {
            most = most.max(self.look(scene)?);
        }
        if most < 4 {
            let (satellites, [send, are]) =
                (counted(most, "satellite"), if most == 1 { ["sends", "is"] } else { ["send", "are"] });
            let in_space = scenes.first().is_some_and(|scene| scene.begins_in_space());
            let place = if in_space {
                "in view past the Earth".to_owned()
            } else {
                format!("above satellites.mask_deg = {}", self.mask_rad.to_degrees())
            };
            warnings.push(format!(
                "{satellites} that {send} one of the scene's signals {are} {place} at the start: a position needs 4"
            ));
        }
        if let Some(first) = scenes.first() {
            let missing = presence::missing(first, world.end_s).map_err(|e| self.orbit(&e))?;
            warnings.extend(presence::warning(&missing, self.start));
        }
        for (scene, front_end) in scenes.iter().zip(&self.front_ends) {
            let warning = scene.fidelity.warning(scene.clock.rate.hz(), &scene.signals);
            warnings.extend(warning.map(|warning| front_end.of_it() + &warning));
        }
        scenes.first().map_or(Ok(()), |scene| self.replay(scene, &files))?;
        Ok((scenes, warnings))
    }

    pub(super) fn conflict(&self, key: &'static str, reason: String) -> ScenarioError {
        ScenarioError::Conflict { origin: self.origin.clone(), key, reason }
    }

    fn orbit(&self, error: &OrbitError) -> ScenarioError {
        let key = if matches!(error, OrbitError::Near { .. }) { "motion" } else { "navigation.file" };
        self.conflict(key, error.to_string())
    }

    /// Composes the parts that front ends share. They do not depend on the choice of front ends.
    fn world(&self, bands: &[Band<'_>], files: &Files<'_>, warnings: &mut Vec<String>) -> Result<World, ScenarioError> {
        let Files { directory, overrides } = *files;
        let body = self.turned(self.trajectory_of(&self.motion, directory, overrides, warnings)?)?;
        if self.array.is_some() && body.grown().is_some() {
            return Err(self.conflict("motion", "is pushed beside [array]: expected another kind".to_owned()));
        }
        let trajectory = self.element_motion(&body, 0);
        let speed_mps = trajectory.knots().iter().fold(0.0_f64, |most, knot| most.max(knot.motion.velocity_mps.norm()));
        if speed_mps > LARGEST_SPEED_MPS {
            let reason =
                format!("reaches {speed_mps:e} m/s: expected at most {LARGEST_SPEED_MPS:e} m/s, a tenth of light's");
            return Err(self.conflict("motion", reason));
        }
        let seed = overrides.seed.unwrap_or(self.seed);
        let own_seed = seed_of(self.station.as_deref(), seed);
        // Without a name a front end has the nodes of its own samples; with one, those that any front end
        // has.
        let own = bands.iter().find(|band| band.front_end.name.is_none());
        let nodes = own.map_or_else(Nodes::common, |band| Nodes::of(band.metadata.rate));
        let receiver_clock = self.receiver_clock.clock(own_seed, nodes.rate(), &trajectory);
        let end = match own {
            Some(band) => SampleClock { start: self.start, rate: band.metadata.rate }.epoch(band.samples),
            None => self.start.plus_s(self.duration_s),
        };
        let end_s = receiver_clock.true_elapsed_s(self.start, end);
        let start_s = receiver_clock.true_elapsed_s(self.start, self.start);
        self.begin_ticks(&trajectory, start_s)?;
        // A file that begins at the scene's start must do with a receiver's clock that is ahead by its bias.
        self.covers(&self.motion, &trajectory, start_s.max(0.0), end_s.min(self.duration_s))?;
        let navigation = parts::navigation(self, self.start, files, warnings)?;
        let sky = parts::sky(self, &navigation, files, end_s, warnings)?;
        let effects = parts::effects(self, files, &navigation, (&sky, &trajectory), end_s)?;
        let effects: Vec<Arc<dyn Effect>> = effects.into_iter().map(Arc::from).collect();
        let own = self.own_skies(files, end_s, warnings)?;
        let message_faults = satellite::message_faults(self, &sky.catalogue, &own, seed)?;
        let parts::Sky { catalogue, mut common, excluded } = sky;
        let catalogue = Arc::new(catalogue);
        common.network = self.network(&catalogue, &effects, &message_faults, (&trajectory, end_s), warnings)?;
        let osnma = self.osnma(&catalogue, &common, seed)?;
        let spoofed = self.spoofed_osnma(&catalogue, &common, seed)?;
        common.authentication = osnma.clone().map(|osnma| osnma as Arc<dyn Authentication>);
        let spoofed = self.spoofed_messages(&common, &own, spoofed);
        let messages = Arc::new(parts::messages(self, &common, &spoofed)?);
        let felt = self.scintillation.clone().filter(|strength| strength.is_felt());
        Ok(World {
            message_faults,
            satellite_clocks: Arc::new(satellite::clocks(self, &catalogue, &receiver_clock, seed, nodes)),
            effects,
            scintillation: felt.map(|strength| {
                Arc::new(Scintillation::new(strength, nodes.rate(), Stream::new(own_seed, "scintillation")))
            }),
            catalogue,
            messages,
            osnma,
            own,
            excluded,
            seed,
            own_seed,
            nodes,
            switches: trajectory.tick_samples().map(|samples| Arc::new(Switches::new(samples))),
            imu: self.imu_on(&body, own_seed)?,
            body,
            trajectory,
            receiver_clock,
            end_s,
        })
    }

    /// The scene of a front end, without spoofers and playback.
    fn scene_of(
        &self,
        world: &World,
        band: Band<'_>,
        files: &Files<'_>,
        warnings: &mut Vec<String>,
    ) -> Result<Scene, ScenarioError> {
        let Band { front_end, metadata, samples, signals } = band;
        let noise_lsb = front_end.noise_lsb.unwrap_or_else(|| default_noise_lsb(metadata.format));
        let if_hz = signals.first().map_or(0.0, |signal| metadata.if_hz(signal.centre_hz()));
        let stages = front_end.stages.in_order(front_end, (metadata.format, if_hz), world.own_seed, noise_lsb);
        let refuse = |reason: &str| self.conflict("filter.bandwidth_hz", front_end.of_it() + reason);
        let fidelity = front_end.fidelity.suited(metadata.rate.hz(), &signals);
        let fidelity =
            fidelity.map_err(|unmet| self.conflict("fidelity.budget", front_end.of_it() + &unmet.to_string()));
        let shared = |effect: &Arc<dyn Effect>| Box::new(Arc::clone(effect)) as Box<dyn Effect>;
        let mut scene = Scene {
            name: self.scene_name(),
            front_end_name: front_end.name.clone(),
            station: self.station.clone(),
            seed: world.seed,
            samples,
            clock: SampleClock { start: self.start, rate: metadata.rate },
            receiver_clock: world.receiver_clock.clone(),
            nodes: world.nodes,
            trajectory: world.trajectory.clone(),
            element: None,
            imu: world.imu.clone(),
            catalogue: Arc::clone(&world.catalogue),
            messages: Arc::clone(&world.messages),
            osnma: world.osnma.clone(),
            message_faults: world.message_faults.clone(),
            satellite_clocks: Arc::clone(&world.satellite_clocks),
            fidelity: fidelity?,
            signals,
            excluded: world.excluded.clone(),
            mask_rad: self.mask_rad,
            effects: world.effects.iter().map(shared).collect(),
            scintillation: world.scintillation.clone(),
            playback: None,
            interference: Vec::new(),
            switches: world.switches.clone(),
            spoofers: Vec::new(),
            noise: self.noise,
            front_end: stages.map_err(|reason| refuse(&reason))?,
            noise_lsb,
            truth_interval_s: self.truth_interval_s,
            expect: self.expect.clone(),
            faults: self.faults(),
            metadata,
        };
        let mut own = Vec::new();
        scene.interference =
            spoofing_and_jamming::interferers(self, &scene, files.directory, files.overrides, &mut own)?;
        warnings.extend(own.into_iter().map(|warning| front_end.of_it() + &warning));
        self.at_element(&mut scene, front_end, &world.body);
        Ok(scene)
    }

    /// Looks at the sky over a scene's start: sets the level of its playback, and counts its satellites.
    fn look(&self, scene: &mut Scene) -> Result<usize, ScenarioError> {
        let (visible, signals_lsb) = at_start(scene).map_err(|e| self.orbit(&e))?;
        if let Some(PlaybackSpec { bits, load_sigma, attenuation_db }) = self.playback {
            let step_lsb = signals_lsb * 2.0 * load_sigma / libm::exp2(f64::from(bits));
            if signals_lsb == 0.0 {
                let reason = "no satellite is above the mask at the start: there is nothing to set its level by";
                return Err(self.conflict("playback", reason.to_owned()));
            }
            scene.playback = Some(Playback { bits, step_lsb: step_lsb as f32, attenuation_db });
        }
        Ok(visible)
    }
}

/// Makes the elements of an array share the waves of each source.
fn share_waves(scenes: &mut [Scene]) {
    let Some((first, others)) = scenes.split_first_mut() else { return };
    for source in others.iter_mut().flat_map(|scene| &mut scene.interference) {
        let same = first.interference.iter().find(|known| known.source == source.source);
        if let (Some(own), Some(known)) = (&mut source.shared, same.and_then(|known| known.shared.as_ref())) {
            *own = Arc::clone(known);
        }
    }
}

/// Satellites of the scene above the mask at its start, and the standard deviation per component of their sum
/// in LSB.
fn at_start(scene: &Scene) -> Result<(usize, f64), OrbitError> {
    let motion = scene.trajectory.at(0.0);
    let (mut visible, mut sum_hz) = (0, 0.0);
    for sv in scene.senders() {
        let found = emission(&scene.catalogue, sv, scene.clock.start, &motion)?;
        let Some(found) = found.filter(|e| scene.sees(&e.sight)) else { continue };
        visible += 1;
        for signal in scene.signals_of(sv) {
            let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
            scene.effects.iter().for_each(|effect| effect.act(&found.sight, signal, &mut rays));
            sum_hz += rays.iter().fold(0.0, |sum, ray| sum + ray.cn0_hz);
        }
    }
    let real = if scene.metadata.format.is_complex() { 1.0 } else { 2.0 };
    Ok((visible, f64::from(scene.noise_lsb) * (real * sum_hz / scene.clock.rate.hz()).sqrt()))
}

/// Gain when the scenario sets none. Eleven satellites at 47 dB-Hz in 2.6 Msps add a tenth to the noise's
/// standard deviation, so 8-bit full scale at 4.5 times the noise is 4 times the composite: 1e-4 of the
/// samples saturate. 16 bits leave 24 dB of headroom on top; floating point has the noise as its unit.
fn default_noise_lsb(format: Format) -> f32 {
    match format {
        Format::Ci8 | Format::Cu8 | Format::Ri8 => 28.0,
        Format::Ci16Le | Format::Ri16Le => 512.0,
        Format::Cf32Le => 1.0,
    }
}
