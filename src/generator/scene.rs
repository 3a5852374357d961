//! Scene as meant: validated, in SI units, with all its files loaded.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::array::Element;
use crate::authentication::Osnma;
use crate::catalogue::Catalogue;
use crate::clock::ReceiverClock;
use crate::clock::nodes::Nodes;
use crate::effect::troposphere::TOP_M;
use crate::fast_phase;
use crate::fast_phase::satellite::SatelliteClocks;
use crate::fast_phase::scintillation::Scintillation;
pub use crate::fidelity::{Arithmetic, CodeEdge, Fidelity, Grade};
use crate::inertial::Imu;
use crate::low_pass::CUTOFF_CPS;
use crate::message::{MessageFault, Senders};
use crate::random::{Stream, seed_of};
use crate::ray::{Effect, SPACE_M, Sight};
use crate::spoof::Constellation;
use crate::stage::Stage;
use crate::stage::interference::Interferer;
use crate::stage::interference::arrival::Tuning;
use crate::stage::noise::Thermal;
use crate::stage::playback::Playback;
use crate::switches::{Switched, Switches};
use crate::vehicle::Trajectory;
use gnss::earth::{FLATTENING, Geodetic, SEMI_MAJOR_AXIS_M};
use gnss::facts::{Expect, Fault};
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::{Link, Signal};
use gnss::time::SampleClock;

/// Description of everything that the generator computes for the samples of one front end.
pub struct Scene {
    /// Name of the scene.
    pub name: String,
    /// Name of the front end, where the scenario gives it one.
    pub front_end_name: Option<String>,
    /// Name of the station that receives it, where the scenario has stations.
    pub station: Option<String>,
    /// Seed of all random numbers; of what stations share, if there are any.
    pub seed: u64,
    /// Number of samples.
    pub samples: u64,
    /// Time of sample 0 by the receiver's clock, and the sample rate.
    pub clock: SampleClock,
    /// Offset of the receiver's clock from GPS time.
    pub receiver_clock: ReceiverClock,
    /// Node spacing of quantities that change quickly.
    pub nodes: Nodes,
    /// Description of the samples: format, rate, centre, start.
    pub metadata: IfMetadata,
    /// Antenna motion over true time since `clock.start`.
    pub trajectory: Trajectory,
    /// Element of an array that receives it, where the scenario has one.
    pub element: Option<Arc<Element>>,
    /// Inertial sensors on the body, where the scenario has them.
    pub imu: Option<Imu>,
    /// Broadcast ephemerides, and true orbits and clocks.
    pub catalogue: Arc<Catalogue>,
    /// Messages that the satellites send besides their own ephemerides.
    pub messages: Arc<Senders>,
    /// Authentication of Galileo's messages; absent means zeros in its bits.
    pub osnma: Option<Arc<Osnma>>,
    /// Faults of messages.
    pub message_faults: Vec<MessageFault>,
    /// Satellite clock errors that are not broadcast.
    pub satellite_clocks: Arc<SatelliteClocks>,
    /// Signals that satellites send.
    pub signals: Vec<&'static Signal>,
    /// Satellites that the scene leaves out.
    pub excluded: Vec<Sv>,
    /// Elevation mask in radians, for a user below [`SPACE_M`].
    pub mask_rad: f64,
    /// Effects on rays, in order.
    pub effects: Vec<Box<dyn Effect>>,
    /// Quick fading of satellites.
    pub scintillation: Option<Arc<Scintillation>>,
    /// Transmitter that plays the satellites' signals back, before anything else is added.
    pub playback: Option<Playback>,
    /// Sources of interference, in order.
    pub interference: Vec<Interferer>,
    /// Switches that act while the scene is sent, if its motion is pushed.
    pub switches: Option<Arc<Switches>>,
    /// Spoofers, which send other satellites' signals over the true ones.
    pub spoofers: Vec<Arc<Constellation>>,
    /// Thermal noise; absent means none.
    pub noise: bool,
    /// Front-end stages that act on the sum, in the order of the hardware.
    pub front_end: Vec<Box<dyn Stage>>,
    /// Standard deviation of the noise per component, in LSB of the sample format (the gain). The gain also
    /// applies without noise: a ray has amplitude `sqrt(cn0_hz / rate) * sqrt(2) * noise_lsb`.
    pub noise_lsb: f32,
    /// Fidelity with which samples are made.
    pub fidelity: Fidelity,
    /// Spacing of truth records, in seconds.
    pub truth_interval_s: f64,
    /// Expectations about a receiver, for the judge.
    pub expect: Expect,
    /// Satellite faults that the judge must know.
    pub faults: Vec<Fault>,
}

impl Scene {
    /// Calls `visit` for each stage that acts on blocks of samples, in order.
    pub fn stages(&self, mut visit: impl FnMut(&dyn Stage)) {
        self.playback.iter().for_each(|stage| visit(stage));
        self.interference.iter().for_each(|stage| visit(stage));
        if self.noise {
            visit(&Thermal { seed: self.noise_seed(), sigma_lsb: self.noise_lsb, arithmetic: self.fidelity.noise });
        }
        self.front_end.iter().for_each(|stage| visit(stage.as_ref()));
    }

    /// True if the scene begins so high that the Earth's limb replaces the elevation mask.
    pub(crate) fn begins_in_space(&self) -> bool {
        Geodetic::from_ecef(&self.trajectory.at(0.0).position_m).height_m >= SPACE_M
    }

    /// Seed of the random numbers of one front end. It is a function of the names of the front end and its
    /// station, and not of their positions in a list.
    pub fn noise_seed(&self) -> u64 {
        let seed = seed_of(self.station.as_deref(), self.seed);
        let own = |name: &String| Stream::new(seed, "front end").named(name).word(0);
        self.front_end_name.as_ref().map_or(seed, own)
    }

    /// Signals of the scene that a satellite sends and that lie at least partly in the samples' band.
    pub fn signals_of(&self, sv: Sv) -> impl Iterator<Item = &'static Signal> {
        let start = self.clock.start;
        let sent = move |signal: &&Signal| signal.system == sv.system && (signal.sent)(sv.number, start);
        let own = self.signals.iter().copied().filter(move |signal| sent(signal));
        own.filter(move |signal| !is_link_outside(&self.metadata, signal.link(sv)))
    }

    /// Satellites of the scene that send at least one of its signals in the samples' band.
    pub fn senders(&self) -> impl Iterator<Item = Sv> {
        self.satellites().filter(|sv| self.signals_of(*sv).next().is_some())
    }

    /// Ephemerides, orbits and clocks of a constellation's satellites.
    pub fn catalogue_of<'s>(&'s self, from: &'s Constellation) -> &'s Catalogue {
        from.sky.as_ref().map_or(&self.catalogue, |own| &own.catalogue)
    }

    /// Satellites that a constellation may send, in order.
    pub fn satellites_of(&self, from: &Constellation) -> Vec<Sv> {
        let excluded = from.sky.as_ref().map_or(&self.excluded, |own| &own.excluded);
        let all = self.catalogue_of(from).satellites();
        all.filter(|sv| !excluded.contains(sv) && from.sends(*sv)).collect()
    }

    /// Satellites with an ephemeris that the scene does not exclude.
    pub fn satellites(&self) -> impl Iterator<Item = Sv> {
        self.catalogue.satellites().filter(|sv| !self.excluded.contains(sv))
    }

    /// True if a satellite is in view: above the mask, or from space not behind the Earth.
    pub fn sees(&self, sight: &Sight) -> bool {
        if sight.user.height_m < SPACE_M {
            sight.look.elevation_rad >= self.mask_rad
        } else {
            !occulted(&sight.user_m, &sight.satellite.position_m)
        }
    }

    /// Cut-off of band-limited edges, in cycles per sample. In a real format the band around the IF must fit
    /// between zero and half the rate.
    pub fn cutoff_cps(&self) -> f64 {
        if self.metadata.format.is_complex() {
            return CUTOFF_CPS;
        }
        let rate_hz = self.clock.rate.hz();
        self.signals.iter().fold(CUTOFF_CPS, |least, signal| {
            let (lowest_hz, highest_hz) = signal.carriers_hz();
            [lowest_hz, highest_hz].into_iter().fold(least, |least, carrier_hz| {
                let place = (folded_hz(self.metadata.if_hz(carrier_hz), rate_hz) / rate_hz).abs();
                let room = place.min(0.5 - place);
                if room > 0.05 { least.min(2.0 * CUTOFF_CPS * room) } else { least }
            })
        })
    }

    /// Sources that change the phases of the signals quickly.
    pub fn fast_phases(&self) -> fast_phase::Sources<'_> {
        fast_phase::Sources {
            nodes: self.nodes,
            clock: self.clock,
            receiver_clock: &self.receiver_clock,
            scintillation: self.scintillation.as_deref(),
            satellite_clocks: &self.satellite_clocks,
        }
    }

    /// Switch state at a sample of the signals that a constellation (0 for the true one) sends as `sv`.
    pub fn switched(&self, constellation: usize, sv: Sv, sample: u64) -> Switched {
        let switched = |all: &Arc<Switches>| all.of_constellation(constellation, sv, all.tick_of(sample));
        self.switches.as_ref().map_or_else(Switched::default, switched)
    }

    /// True seconds since the scene's start at sample `n`, without the clock's fast noise.
    pub fn elapsed_s(&self, n: u64) -> f64 {
        self.receiver_clock.true_elapsed_s(self.clock.start, self.clock.epoch(n))
    }

    /// Receiver's effect on an interfering wave.
    pub fn tuning(&self) -> Tuning {
        let clocks = (self.clock, &self.receiver_clock);
        Tuning::new(&self.metadata, clocks, &self.signals, f64::from(self.noise_lsb))
    }

    /// Number of samples before a block that its stages need.
    pub fn memory_samples(&self) -> usize {
        let mut sum = 0;
        self.stages(|stage| sum += stage.memory_samples());
        sum
    }
}

/// Lists every source of interference once, with the number of the first scene that receives it. Several
/// front ends may receive the same source.
pub fn sources<'s>(scenes: impl Iterator<Item = &'s Scene>) -> Vec<(usize, &'s Interferer)> {
    let mut found: Vec<(usize, &Interferer)> = Vec::new();
    for (number, scene) in scenes.enumerate() {
        let known: Vec<u64> = found.iter().map(|(_, known)| known.source).collect();
        found.extend(scene.interference.iter().filter(|new| !known.contains(&new.source)).map(|new| (number, new)));
    }
    found
}

/// True if the Earth, with its atmosphere up to [`TOP_M`], lies between two positions.
fn occulted(from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> bool {
    // Axes in which the ellipsoid is the unit sphere.
    let equator_m = SEMI_MAJOR_AXIS_M + TOP_M;
    let pole_m = SEMI_MAJOR_AXIS_M * (1.0 - FLATTENING) + TOP_M;
    let scaled = |m: &Vector3<f64>| Vector3::new(m.x / equator_m, m.y / equator_m, m.z / pole_m);
    let (from, to) = (scaled(from_m), scaled(to_m));
    let along = to - from;
    let share = (-from.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (from + along * share).norm_squared() < 1.0
}

/// Frequency in Hz at which `hz` appears in samples at that rate, from minus half of the rate to half. A
/// negative value in real samples means mirrored.
pub fn folded_hz(hz: f64, rate_hz: f64) -> f64 {
    hz - rate_hz * (hz / rate_hz).round()
}

/// Lower and upper end in Hz of a signal's main lobes in the samples' spectrum, without Doppler, for all its
/// satellites.
pub fn main_lobe_hz(metadata: &IfMetadata, signal: &Signal) -> (f64, f64) {
    let (lowest_hz, highest_hz) = signal.carriers_hz();
    let (one_hz, other_hz) = (metadata.if_hz(lowest_hz), metadata.if_hz(highest_hz));
    (one_hz.min(other_hz) - signal.lobe_hz(), one_hz.max(other_hz) + signal.lobe_hz())
}

/// True if the main lobes lie wholly outside the band of complex samples. The band of real samples is
/// unknown: with bandpass sampling, an IF may exceed half the rate.
pub fn is_outside(metadata: &IfMetadata, signal: &Signal) -> bool {
    is_beyond(metadata, main_lobe_hz(metadata, signal))
}

/// True if the main lobes of one satellite's signal lie wholly outside the band, like [`is_outside`].
pub fn is_link_outside(metadata: &IfMetadata, link: Link) -> bool {
    let (if_hz, half_hz) = (metadata.if_hz(link.carrier_hz()), link.signal.lobe_hz());
    is_beyond(metadata, (if_hz - half_hz, if_hz + half_hz))
}

fn is_beyond(metadata: &IfMetadata, (low_hz, high_hz): (f64, f64)) -> bool {
    let half_hz = 0.5 * metadata.rate.hz();
    metadata.format.is_complex() && (low_hz >= half_hz || high_hz <= -half_hz)
}
