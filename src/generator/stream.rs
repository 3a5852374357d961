//! A scene becomes a stream of packed IF samples, with the truth beside it.
//!
//! The stream is made of blocks on an absolute grid, each a pure function of the scene: satellites are
//! added, then noise, then samples are rounded and packed. Blocks of a batch run side by side and
//! are written in order, so bytes depend neither on threads nor on block lengths, and memory stays flat.

use std::collections::BTreeSet;
use std::fmt;
use std::io::Write;

use rayon::prelude::*;
use thiserror::Error;

use crate::generator::plan::Machinery;
use crate::generator::scene::{Arithmetic, CodeEdge, Scene};
use crate::generator::stage::noise;
use crate::generator::synth::band::Filter;
use crate::generator::synth::isa::{self, Level};
use crate::generator::synth::transmitter::{Scratch, Transmitter};
use crate::generator::synth::{Edge, Kernel, RUN_SAMPLES};
use crate::generator::truth::{self, TruthError};
use crate::gnss::broadcast::OrbitError;
use crate::gnss::gps::lnav::FieldError;
use crate::gnss::record::{Observation, SkyRow};
use crate::gnss::satellite::Sv;

/// Cut-off of band-limited edges, in cycles a sample.
const CUTOFF_CPS: f64 = 0.45;

/// Roots of each satellite's grid that a plan looks at.
const PLANNED_ROOTS: u64 = 16;

/// How the work is cut; no choice changes a byte.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Runs of 4096 samples in a block.
    pub block_runs: u32,
    /// Blocks in a batch.
    pub batch_blocks: u32,
    /// Instruction set of the kernels.
    pub level: Level,
}

impl Default for Options {
    fn default() -> Self {
        Self { block_runs: 8, batch_blocks: 16, level: Level::detect() }
    }
}

/// What a run of the generator did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Generated {
    pub samples: u64,
    /// Satellites that were in view at some time.
    pub satellites: Vec<Sv>,
    /// Components that the format could not hold.
    pub clipped: u64,
    /// Polynomials made, and the largest error met between their knots.
    pub knots: u64,
    pub worst_knot_cycles: f64,
}

impl fmt::Display for Generated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self.satellites.iter().map(Sv::to_string).collect();
        write!(f, "{} samples of {} satellites ({})", self.samples, names.len(), names.join(" "))?;
        if self.clipped > 0 {
            let share = self.clipped as f64 / (2.0 * self.samples as f64);
            write!(f, "; {} components clipped ({:.1e} of them)", self.clipped, share)?;
        }
        Ok(())
    }
}

/// Why a scene could not be generated.
#[derive(Debug, Error)]
pub enum GenerateError {
    #[error(transparent)]
    Orbit(#[from] OrbitError),
    #[error("a navigation message cannot be made: {0}")]
    Message(#[from] FieldError),
    #[error("truth: {0}")]
    Truth(#[from] TruthError),
    #[error("samples could not be written: {0}")]
    Write(#[from] std::io::Error),
    #[error("{signal} at {rate_hz} samples a second: expected at least 1/15 of its code rate")]
    Rate { rate_hz: f64, signal: &'static str },
    #[error("truth_interval_s = {0}: expected 1e-6 to 1e6 s")]
    TruthInterval(f64),
}

/// What the plan tells of the synthesiser: knots met along the scene, memory of a batch, and the usual speed.
///
/// # Errors
/// Those of orbits.
pub fn machinery(scene: &Scene) -> Result<Machinery, GenerateError> {
    let transmitters = transmitters(scene, Edge::Nearest)?;
    let rate = scene.clock.rate;
    let (mut shortest, mut longest) = (u64::MAX, 0);
    for transmitter in &transmitters {
        if !truth::in_view(scene, transmitter.sv, scene.clock.start)? {
            continue;
        }
        let size = transmitter.root_samples();
        let roots = scene.samples.div_ceil(size);
        for root in (0..roots).step_by(roots.div_ceil(PLANNED_ROOTS).max(1) as usize) {
            for part in transmitter.root(scene, root)? {
                shortest = shortest.min(part.end - part.start);
                longest = longest.max(part.end - part.start);
            }
        }
    }
    let shortest = shortest.min(longest);
    let options = Options::default();
    let batch = u64::from(options.block_runs) * u64::from(options.batch_blocks) * RUN_SAMPLES as u64;
    Ok(Machinery {
        knot_spacing_s: rate.elapsed_s(shortest),
        longest_knot_spacing_s: rate.elapsed_s(longest),
        knot_reason: format!(
            "the longest on which a cubic stays within {:e} cycles of the motion",
            scene.fidelity.knot_tolerance_cycles
        ),
        block_bytes: batch.min(scene.samples) * scene.metadata.format.bytes() as u64,
        satellite_samples_per_s: 1e9 / scene.fidelity.satellite_sample_ns(rate.hz()),
    })
}

/// Writes the samples of `scene` and its truth; `progress` hears the samples done after each batch.
///
/// # Errors
/// [`GenerateError`]; what was written before stays.
pub fn generate(
    scene: &Scene,
    samples: &mut dyn Write,
    truth: &mut truth::Writer,
    progress: &mut dyn FnMut(u64),
) -> Result<Generated, GenerateError> {
    generate_with(scene, samples, truth, progress, &Options::default())
}

/// [`generate`] with the work cut as `options` say.
///
/// # Errors
/// As [`generate`].
pub fn generate_with(
    scene: &Scene,
    samples: &mut dyn Write,
    truth: &mut truth::Writer,
    progress: &mut dyn FnMut(u64),
    options: &Options,
) -> Result<Generated, GenerateError> {
    let filter = Filter::new(cutoff_cps(scene));
    let edge = match scene.fidelity.code_edge {
        CodeEdge::Nearest => Edge::Nearest,
        CodeEdge::Area => Edge::Area,
        CodeEdge::BandLimited => Edge::BandLimited(&filter),
    };
    let kernel = Kernel { edge, arithmetic: scene.fidelity.carrier, level: options.level };
    let mut transmitters = transmitters(scene, edge)?;
    truth.scene(scene)?;
    let mut ticks = Ticks::new(scene)?;
    let block = u64::from(options.block_runs.max(1)) * RUN_SAMPLES as u64;
    let batch = block * u64::from(options.batch_blocks.max(1));
    let sample_bytes = scene.metadata.format.bytes();
    let mut packed = vec![0; batch.min(scene.samples) as usize * sample_bytes];
    let mut done = Generated::default();
    while done.samples < scene.samples {
        let (from, to) = (done.samples, (done.samples + batch).min(scene.samples));
        transmitters.par_iter_mut().try_for_each(|t| t.prepare(scene, from, to))?;
        ticks.write(scene, &transmitters, to, truth)?;
        let bytes = usize::try_from(to - from).unwrap_or(usize::MAX).saturating_mul(sample_bytes);
        packed.truncate(bytes);
        let clipped: u64 = packed
            .par_chunks_mut(block as usize * sample_bytes)
            .enumerate()
            .map_init(Scratch::default, |scratch, (index, bytes)| {
                render(scene, &transmitters, kernel, from + index as u64 * block, bytes, scratch)
            })
            .sum();
        // In pieces, so that a reader beside the generator can begin early.
        for bytes in packed.chunks(block as usize * sample_bytes) {
            samples.write_all(bytes)?;
        }
        done.clipped += clipped;
        done.samples = to;
        progress(to);
    }
    let mut navigation = BTreeSet::new();
    for transmitter in &mut transmitters {
        navigation.append(&mut transmitter.navigation);
        done.knots += transmitter.knots;
        done.worst_knot_cycles = done.worst_knot_cycles.max(transmitter.worst_knot_cycles);
    }
    let seen: BTreeSet<Sv> = transmitters.iter().filter(|t| t.seen).map(|t| t.sv).collect();
    done.satellites = seen.into_iter().collect();
    truth.finish(&navigation)?;
    Ok(done)
}

/// In a real format the band around the IF must fit between zero and half the rate.
fn cutoff_cps(scene: &Scene) -> f64 {
    if scene.metadata.format.is_complex() {
        return CUTOFF_CPS;
    }
    let rate_hz = scene.clock.rate.hz();
    scene.signals.iter().fold(CUTOFF_CPS, |least, signal| {
        let place = (scene.metadata.if_hz(signal) / rate_hz).abs();
        let room = place.min(0.5 - place);
        if room > 0.05 { least.min(2.0 * CUTOFF_CPS * room) } else { least }
    })
}

fn transmitters(scene: &Scene, edge: Edge<'_>) -> Result<Vec<Transmitter>, GenerateError> {
    let satellites: BTreeSet<Sv> = scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)).collect();
    let mut found = Vec::new();
    for sv in satellites {
        for signal in scene.signals.iter().filter(|signal| signal.system == sv.system) {
            found.extend(Transmitter::new(scene, sv, signal, edge)?);
        }
    }
    Ok(found)
}

/// Renders one block into `bytes`, and returns how many of its components were clipped.
///
/// Run by run, so that the planar samples of one stay in the first-level cache.
fn render(
    scene: &Scene,
    transmitters: &[Transmitter],
    kernel: Kernel<'_>,
    start: u64,
    bytes: &mut [u8],
    scratch: &mut Scratch,
) -> u64 {
    let format = scene.metadata.format;
    let (mut i, mut q) = ([0.0_f32; RUN_SAMPLES], [0.0_f32; RUN_SAMPLES]);
    let mut clipped = 0;
    for (run, bytes) in (start / RUN_SAMPLES as u64..).zip(bytes.chunks_mut(RUN_SAMPLES * format.bytes())) {
        let length = bytes.len() / format.bytes();
        let (Some(i), Some(q)) = (i.get_mut(..length), q.get_mut(..length)) else { continue };
        i.fill(0.0);
        q.fill(0.0);
        for transmitter in transmitters {
            transmitter.render(scene, kernel, run * RUN_SAMPLES as u64, i, q, scratch);
        }
        if scene.noise {
            match scene.fidelity.noise {
                Arithmetic::F32 => isa::add_noise(kernel.level, scene.seed, run, scene.noise_lsb, i, q),
                Arithmetic::F64 => noise::add_block_exact(scene.seed, run, scene.noise_lsb, i, q),
            }
        }
        clipped += isa::pack(kernel.level, format, i, q, bytes);
    }
    clipped
}

/// The samples at which truth is written.
struct Ticks {
    next: u64,
    interval_us: u64,
}

impl Ticks {
    fn new(scene: &Scene) -> Result<Self, GenerateError> {
        if !(1e-6..=1e6).contains(&scene.truth_interval_s) {
            return Err(GenerateError::TruthInterval(scene.truth_interval_s));
        }
        Ok(Self { next: 0, interval_us: (scene.truth_interval_s * 1e6).round() as u64 })
    }

    /// Writes every tick before sample `to`.
    fn write(
        &mut self,
        scene: &Scene,
        transmitters: &[Transmitter],
        to: u64,
        truth: &mut truth::Writer,
    ) -> Result<(), GenerateError> {
        loop {
            let sample = scene.clock.rate.first_sample_at(self.next * self.interval_us, 1_000_000);
            if sample >= to {
                return Ok(());
            }
            let rows: Vec<Option<(Observation, SkyRow)>> = transmitters
                .par_iter()
                .filter(|t| t.in_view(scene, sample))
                .map(|t| truth::observe(scene, t.sv, t.signal, sample, t.in_view_s(scene, sample)))
                .collect::<Result<_, _>>()?;
            let rows: Vec<_> = rows.into_iter().flatten().collect();
            truth.epoch(&truth::trajectory(scene, sample), &rows)?;
            self.next += 1;
        }
    }
}
