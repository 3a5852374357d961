//! A scene becomes a stream of packed IF samples, with the truth beside it.
//!
//! The stream is made of blocks on an absolute grid, each a pure function of the scene: satellites are
//! added, then noise, then samples are rounded and packed. Blocks of a batch run side by side and
//! are written in order, so bytes depend neither on threads nor on block lengths, and memory stays flat.

use std::collections::BTreeSet;
use std::fmt;
use std::io::Write;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use thiserror::Error;

use crate::generator::plan::Machinery;
use crate::generator::scene::{CodeEdge, Scene, folded_hz};
use crate::generator::spoof::Constellation;
use crate::generator::stage::Block;
use crate::generator::synth::band::Filter;
use crate::generator::synth::isa::{self, Level};
use crate::generator::synth::transmitter::{Scratch, Transmitter};
use crate::generator::synth::waveform::WaveformError;
use crate::generator::synth::{Edge, Kernel, RUN_SAMPLES};
use crate::generator::truth::{self, TruthError};
use crate::gnss::broadcast::OrbitError;
use crate::gnss::gps::lnav::FieldError;
use crate::gnss::record::{PassRow, TrajectoryRow};
use crate::gnss::samples::Format;
use crate::gnss::satellite::Sv;

/// Cut-off of band-limited edges, in cycles a sample.
const CUTOFF_CPS: f64 = 0.45;

/// Length of a block at least, in units of what its stages look back at.
const LEADS_PER_BLOCK: u64 = 8;

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

/// What the plan tells of the synthesiser: knots met along the scene, memory of a batch, and the usual speed.
///
/// # Errors
/// Those of orbits.
pub fn machinery(scene: &Scene) -> Result<Machinery, GenerateError> {
    let transmitters = transmitters(scene, Edge::Nearest)?;
    let rate = scene.clock.rate;
    let (mut shortest, mut longest, mut worst_cycles) = (u64::MAX, 0, 0.0_f64);
    for transmitter in &transmitters {
        if !truth::in_view_from(scene, &transmitter.from, transmitter.sv, scene.clock.start)? {
            continue;
        }
        let size = transmitter.root_samples();
        let roots = scene.samples.div_ceil(size);
        for root in (0..roots).step_by(roots.div_ceil(PLANNED_ROOTS).max(1) as usize) {
            for part in transmitter.root(scene, root)? {
                shortest = shortest.min(part.end - part.start);
                longest = longest.max(part.end - part.start);
                worst_cycles = worst_cycles.max(part.error_cycles);
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
            "the longest on which a cubic stays within {:e} cycles of the motion; {worst_cycles:.1e} met",
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

/// The sample at which the run of a sample begins.
fn run_begin(sample: u64) -> u64 {
    sample / RUN_SAMPLES as u64 * RUN_SAMPLES as u64
}

/// Samples that are made at least from `from` on where stages look back: gain control measures the scene's
/// first run whole.
fn first_run(scene: &Scene, from: u64, memory: u64) -> u64 {
    if from == 0 && memory > 0 { scene.samples.min(RUN_SAMPLES as u64) } else { 0 }
}

/// The scene's edges; band-limited where there is a `filter`.
fn edge<'a>(scene: &Scene, filter: Option<&'a Filter>) -> Edge<'a> {
    match filter {
        Some(filter) => Edge::BandLimited(filter),
        None if scene.fidelity.code_edge == CodeEdge::Nearest => Edge::Nearest,
        None => Edge::Area,
    }
}

/// In a real format the band around the IF must fit between zero and half the rate.
pub(crate) fn cutoff_cps(scene: &Scene) -> f64 {
    if scene.metadata.format.is_complex() {
        return CUTOFF_CPS;
    }
    let rate_hz = scene.clock.rate.hz();
    scene.signals.iter().fold(CUTOFF_CPS, |least, signal| {
        let (lowest_hz, highest_hz) = signal.carriers_hz();
        [lowest_hz, highest_hz].into_iter().fold(least, |least, carrier_hz| {
            let place = (folded_hz(scene.metadata.if_hz(carrier_hz), rate_hz) / rate_hz).abs();
            let room = place.min(0.5 - place);
            if room > 0.05 { least.min(2.0 * CUTOFF_CPS * room) } else { least }
        })
    })
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

/// Buffers of one worker.
#[derive(Default)]
struct Worker {
    scratch: Scratch,
    i: Vec<f32>,
    q: Vec<f32>,
}

/// Renders one block into `bytes`, and returns how many of its components were clipped.
///
/// Run by run, so that the planar samples of one stay in the first-level cache; in one piece with what lies
/// before it if a stage looks back.
fn render(
    scene: &Scene,
    transmitters: &[Transmitter],
    kernel: Kernel<'_>,
    start: u64,
    bytes: &mut [u8],
    worker: &mut Worker,
) -> u64 {
    let format = scene.metadata.format;
    let memory = scene.memory_samples();
    let piece_bytes = if memory == 0 { RUN_SAMPLES * format.bytes() } else { bytes.len() };
    let mut clipped = 0;
    let mut first = start;
    for bytes in bytes.chunks_mut(piece_bytes.max(1)) {
        let samples = bytes.len() / format.bytes();
        let mut block = satellites(scene, transmitters, kernel, (first, samples, memory), worker);
        scene.stages(|stage| stage.act(&mut block));
        clipped += block.clipped + pack(&block, samples, format, bytes);
        first += samples as u64;
    }
    clipped
}

/// The satellites in `samples` samples from `first` on, with what stages look back at before them.
fn satellites<'w>(
    scene: &Scene,
    transmitters: &[Transmitter],
    kernel: Kernel<'_>,
    (first, samples, memory): (u64, usize, usize),
    worker: &'w mut Worker,
) -> Block<'w> {
    let from = run_begin(run_begin(first).saturating_sub(memory as u64));
    let lead = (first - from) as usize;
    let length = lead + samples;
    let tail = (first_run(scene, from, memory as u64) as usize).saturating_sub(length);
    let Worker { scratch, i, q } = worker;
    for plane in [&mut *i, &mut *q] {
        plane.clear();
        plane.resize(length + tail, 0.0);
    }
    for (run, (i, q)) in (0_u64..).zip(i.chunks_mut(RUN_SAMPLES).zip(q.chunks_mut(RUN_SAMPLES))) {
        for transmitter in transmitters {
            transmitter.arrange(scene, from + run * RUN_SAMPLES as u64, i.len(), scratch);
        }
        scratch.bank.render(kernel, i, q);
    }
    Block { lead, tail, level: kernel.level, ..Block::whole(from, i, q) }
}

/// Packs the samples of a block that are sent on, and returns how many components the format could not hold.
fn pack(block: &Block<'_>, samples: usize, format: Format, bytes: &mut [u8]) -> u64 {
    let sent = block.lead..block.lead + samples;
    let (Some(i), Some(q)) = (block.i.get(sent.clone()), block.q.get(sent)) else { return 0 };
    isa::pack(block.level, format, i, q, bytes)
}

/// What a stretch of the scene's samples holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stretch {
    /// Components: two a sample, one of real samples.
    pub components: u64,
    /// Sum of their squares before a converter or the format rounds them, in LSB of the scene's gain.
    pub square_lsb2: f64,
    /// Those that were clipped.
    pub clipped: u64,
}

/// Makes the samples of `stretches`, which ascend, as the stream does, and measures them.
///
/// # Errors
/// Those of [`Stream::next`].
pub(crate) fn measured(scene: &Scene, stretches: &[Range<u64>]) -> Result<Vec<Stretch>, GenerateError> {
    let limited = scene.fidelity.code_edge == CodeEdge::BandLimited;
    let filter = limited.then(|| Filter::new(cutoff_cps(scene)));
    let edge = edge(scene, filter.as_ref());
    let mut transmitters = transmitters(scene, edge)?;
    let kernel = Kernel { edge, arithmetic: scene.fidelity.carrier, level: Level::detect() };
    let (memory, format) = (scene.memory_samples(), scene.metadata.format);
    let lead = memory.next_multiple_of(RUN_SAMPLES) as u64;
    let (mut worker, mut bytes) = (Worker::default(), Vec::new());
    let mut found = Vec::new();
    for stretch in stretches {
        let needed = run_begin(stretch.start).saturating_sub(lead);
        let made = stretch.end.max(first_run(scene, needed, lead));
        // On this thread alone: a plan has to work where no other can be started.
        transmitters.iter_mut().try_for_each(|t| t.prepare_alone(scene, needed, made))?;
        let samples = (stretch.end - stretch.start) as usize;
        let mut block = satellites(scene, &transmitters, kernel, (stretch.start, samples, memory), &mut worker);
        let sent = block.lead..block.lead + samples;
        let square = |block: &Block<'_>| {
            let of = |plane: &[f32]| {
                plane.get(sent.clone()).unwrap_or(&[]).iter().fold(0.0, |sum, x| sum + f64::from(*x) * f64::from(*x))
            };
            of(block.i) + if format.is_complex() { of(block.q) } else { 0.0 }
        };
        let mut before_lsb2 = None;
        scene.stages(|stage| {
            if stage.full_scale_lsb(1.0).is_some() {
                before_lsb2 = Some(square(&block));
            }
            stage.act(&mut block);
        });
        bytes.resize(samples * format.bytes(), 0);
        found.push(Stretch {
            components: if format.is_complex() { 2 } else { 1 } * samples as u64,
            square_lsb2: before_lsb2.unwrap_or_else(|| square(&block)),
            clipped: block.clipped + pack(&block, samples, format, &mut bytes),
        });
    }
    Ok(found)
}

/// The samples at which truth is written.
struct Ticks {
    next: u64,
    interval_us: u64,
    /// Sample of the scene from which rows count.
    origin: u64,
}

impl Ticks {
    fn new(scene: &Scene, origin: u64) -> Result<Self, GenerateError> {
        if !(1e-6..=1e6).contains(&scene.truth_interval_s) {
            return Err(GenerateError::TruthInterval(scene.truth_interval_s));
        }
        let interval_us = (scene.truth_interval_s * 1e6).round() as u64;
        let (whole, fraction) = scene.clock.rate.elapsed(origin);
        let mut next = (whole as u64 * 1_000_000 + (fraction * 1e6) as u64) / interval_us;
        while scene.clock.rate.first_sample_at(next * interval_us, 1_000_000) < origin {
            next += 1;
        }
        Ok(Self { next, interval_us, origin })
    }

    /// Writes every tick before sample `to`.
    fn write(
        &mut self,
        scene: &Scene,
        transmitters: &[Transmitter],
        to: u64,
        truth: &mut truth::Writer,
    ) -> Result<(), GenerateError> {
        let origin = self.origin;
        let rows = |from: &Constellation, sample: u64| -> Result<Vec<truth::Truth>, OrbitError> {
            let found: Result<Vec<_>, _> = transmitters
                .par_iter()
                .filter(|t| t.from.number == from.number && t.in_view(scene, sample))
                .filter_map(|t| {
                    truth::observe(scene, &t.from, t.sv, t.signal, sample, t.in_view_s(scene, sample)).transpose()
                })
                .collect();
            let mut found = found?;
            for (observation, sky, rays) in &mut found {
                observation.sample -= origin;
                sky.sample -= origin;
                rays.iter_mut().for_each(|ray| ray.sample -= origin);
            }
            Ok(found)
        };
        let place = |from: &Constellation, sample: u64| {
            let row = truth::trajectory(scene, from, sample);
            TrajectoryRow { sample: sample - origin, ..row }
        };
        loop {
            let sample = scene.clock.rate.first_sample_at(self.next * self.interval_us, 1_000_000);
            if sample >= to {
                return Ok(());
            }
            let authentic = Constellation::authentic();
            truth.epoch(&place(&authentic, sample), &rows(&authentic, sample)?)?;
            truth.interference(scene, sample, origin)?;
            for spoofer in scene.spoofers.iter().filter(|spoofer| spoofer.on(scene).contains(&sample)) {
                truth.claim(spoofer, &place(spoofer, sample), &rows(spoofer, sample)?)?;
            }
            self.next += 1;
        }
    }
}
