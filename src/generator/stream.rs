//! A scene becomes a stream of packed IF samples, with the truth beside it.
//!
//! The stream is made of blocks on an absolute grid, each a pure function of the scene: satellites are
//! added, then noise, then samples are rounded and packed. Blocks of a batch run side by side and
//! are written in order, so bytes depend neither on threads nor on block lengths, and memory stays flat.

mod block;
mod measure;
mod ticks;

use std::collections::BTreeSet;
use std::fmt;
use std::io::Write;
use std::ops::Range;
use std::sync::Arc;

pub(crate) use block::cutoff_cps;
use block::{Worker, edge, first_run, render, run_begin};
pub use measure::machinery;
pub(crate) use measure::{Stretch, measured};
use rayon::prelude::*;
use thiserror::Error;
use ticks::Ticks;

use crate::generator::scene::{CodeEdge, Scene};
use crate::generator::spoof::Constellation;
use crate::generator::synth::band::Filter;
use crate::generator::synth::isa::Level;
use crate::generator::synth::transmitter::Transmitter;
use crate::generator::synth::waveform::WaveformError;
use crate::generator::synth::{Edge, Kernel, RUN_SAMPLES};
use crate::generator::truth::{self, TruthError};
use crate::gnss::broadcast::OrbitError;
use crate::gnss::gps::lnav::FieldError;
use crate::gnss::record::PassRow;
use crate::gnss::satellite::Sv;

/// Length of a block at least, in units of what its stages look back at.
const LEADS_PER_BLOCK: u64 = 8;

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
    /// What the scene allows of it.
    pub knot_tolerance_cycles: f64,
}

impl fmt::Display for Generated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self.satellites.iter().map(Sv::to_string).collect();
        write!(f, "{} samples of {} satellites ({})", self.samples, names.len(), names.join(" "))?;
        if self.clipped > 0 {
            let share = self.clipped as f64 / (2.0 * self.samples as f64);
            write!(f, "; {} components clipped ({:.1e} of them)", self.clipped, share)?;
        }
        let (worst, allowed) = (self.worst_knot_cycles, self.knot_tolerance_cycles);
        write!(f, "; the carrier is up to {worst:.1e} cycles off between {} knots, ", self.knots)?;
        let left = 100.0 * (1.0 - worst / allowed);
        if worst > allowed {
            write!(f, "beyond the {allowed:e} that the scene allows: knots stand no closer")
        } else {
            write!(f, "{left:.0} % below what the scene allows, {allowed:e}")
        }
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
    #[error(transparent)]
    Waveform(#[from] WaveformError),
    #[error("truth_interval_s = {0}: expected 1e-6 to 1e6 s")]
    TruthInterval(f64),
    #[error("samples {first} to {end} of a scene that has {samples}: expected a first one before the last")]
    Part { first: u64, end: u64, samples: u64 },
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
    generate_part(scene, 0..scene.samples, samples, truth, progress, options)
}

/// The samples of `part` of the scene, the same bits as those of the whole; the truth counts from the part's
/// first sample.
///
/// # Errors
/// As [`generate`], and [`GenerateError::Part`] for a part that the scene does not have.
pub fn generate_part(
    scene: &Scene,
    part: Range<u64>,
    samples: &mut dyn Write,
    truth: &mut truth::Writer,
    progress: &mut dyn FnMut(u64),
    options: &Options,
) -> Result<Generated, GenerateError> {
    let mut stream = Stream::of(scene, part, truth, options)?;
    let mut packed = Vec::new();
    while stream.next(truth, &mut packed)? {
        samples.write_all(&packed)?;
        progress(stream.samples());
    }
    stream.finish(truth)
}

/// A scene on its way to samples, batch by batch.
pub struct Stream<'a> {
    scene: &'a Scene,
    /// Of band-limited edges, where the scene has them.
    filter: Option<Filter>,
    level: Level,
    transmitters: Vec<Transmitter>,
    /// Samples of the scene that are asked for, and the next of them.
    part: Range<u64>,
    next: u64,
    ticks: Ticks,
    /// Samples that a block's stages look back at, of a block and of a batch.
    lead: u64,
    block: u64,
    batch: u64,
    done: Generated,
}

impl<'a> Stream<'a> {
    /// The stream of `scene` from its first sample on; tells `truth` what the scene is.
    ///
    /// # Errors
    /// A rate that the scene's signals cannot have, a truth that cannot be written.
    pub fn new(scene: &'a Scene, truth: &mut truth::Writer, options: &Options) -> Result<Self, GenerateError> {
        Self::of(scene, 0..scene.samples, truth, options)
    }

    /// The stream of a part of `scene`.
    ///
    /// # Errors
    /// As [`Stream::new`], and [`GenerateError::Part`].
    pub fn of(
        scene: &'a Scene,
        part: Range<u64>,
        truth: &mut truth::Writer,
        options: &Options,
    ) -> Result<Self, GenerateError> {
        if part.start > part.end || part.end > scene.samples {
            return Err(GenerateError::Part { first: part.start, end: part.end, samples: scene.samples });
        }
        let limited = scene.fidelity.code_edge == CodeEdge::BandLimited;
        let filter = limited.then(|| Filter::new(cutoff_cps(scene)));
        let transmitters = transmitters(scene, edge(scene, filter.as_ref()))?;
        truth.scene(scene, &part)?;
        // What stages look back at is rendered twice: blocks are long against it.
        let lead = scene.memory_samples().next_multiple_of(RUN_SAMPLES) as u64;
        let block = (u64::from(options.block_runs.max(1)) * RUN_SAMPLES as u64).max(LEADS_PER_BLOCK * lead);
        let batch = block * u64::from(options.batch_blocks.max(1));
        let (ticks, done, next) = (Ticks::new(scene, part.start)?, Generated::default(), part.start);
        let level = options.level;
        Ok(Self { scene, filter, level, transmitters, part, next, ticks, lead, block, batch, done })
    }

    /// Samples made so far.
    pub fn samples(&self) -> u64 {
        self.done.samples
    }

    /// Replaces what `packed` holds by the next batch, and writes the truth as far; `false` after the last
    /// sample.
    ///
    /// # Errors
    /// [`GenerateError`] of orbits, messages and truth.
    pub fn next(&mut self, truth: &mut truth::Writer, packed: &mut Vec<u8>) -> Result<bool, GenerateError> {
        let scene = self.scene;
        // From the second batch on blocks begin with runs.
        let from = self.next;
        let to = (run_begin(from) + self.batch).min(self.part.end);
        let sample_bytes = scene.metadata.format.bytes();
        packed.resize(to.saturating_sub(from) as usize * sample_bytes, 0);
        if from >= to {
            return Ok(false);
        }
        // Runs are made from their beginning on.
        let needed = run_begin(from).saturating_sub(self.lead);
        let made = to.max(first_run(scene, needed, self.lead));
        self.transmitters.par_iter_mut().try_for_each(|t| t.prepare(scene, needed, made))?;
        self.ticks.write(scene, &self.transmitters, to, truth)?;
        let kernel =
            Kernel { edge: edge(scene, self.filter.as_ref()), arithmetic: scene.fidelity.carrier, level: self.level };
        let (transmitters, block) = (&self.transmitters, self.block);
        let clipped: u64 = packed
            .par_chunks_mut(block as usize * sample_bytes)
            .enumerate()
            .map_init(Worker::default, |worker, (index, bytes)| {
                render(scene, transmitters, kernel, from + index as u64 * block, bytes, worker)
            })
            .sum();
        self.done.clipped += clipped;
        self.done.samples = to - self.part.start;
        self.next = to;
        Ok(true)
    }

    /// Writes the rest of the truth, and tells what was done.
    ///
    /// # Errors
    /// A truth that cannot be written.
    pub fn finish(mut self, truth: &mut truth::Writer) -> Result<Generated, GenerateError> {
        let mut navigation = BTreeSet::new();
        for transmitter in &mut self.transmitters {
            navigation.append(&mut transmitter.symbols.navigation);
            self.done.knots += transmitter.knots;
            self.done.worst_knot_cycles = self.done.worst_knot_cycles.max(transmitter.worst_knot_cycles);
        }
        let authentic = self.transmitters.iter().filter(|t| t.from.number == 0);
        let passes: BTreeSet<PassRow> = authentic.flat_map(|t| t.passes.rows(t.sv, &self.part)).collect();
        self.done.knot_tolerance_cycles = self.scene.fidelity.knot_tolerance_cycles;
        let seen: BTreeSet<Sv> =
            self.transmitters.iter().filter(|t| t.seen && t.from.number == 0).map(|t| t.sv).collect();
        self.done.satellites = seen.into_iter().collect();
        truth.finish(&navigation, &passes)?;
        Ok(self.done)
    }
}

fn transmitters(scene: &Scene, edge: Edge<'_>) -> Result<Vec<Transmitter>, GenerateError> {
    let satellites: BTreeSet<Sv> = scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)).collect();
    let mut found = Vec::new();
    let authentic = Arc::new(Constellation::authentic());
    for from in std::iter::once(&authentic).chain(&scene.spoofers) {
        for &sv in satellites.iter().filter(|sv| from.sends(**sv)) {
            for signal in scene.signals_of(sv) {
                found.extend(Transmitter::of(scene, Arc::clone(from), sv, signal, edge)?);
            }
        }
    }
    Ok(found)
}
