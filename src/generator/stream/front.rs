//! Samples of one front end, batch by batch.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::block::{Worker, edge, first_run, render, run_begin};
use super::{GenerateError, Generated, Options};
use crate::geometry::{Geometry, Places};
use crate::scene::{CodeEdge, Scene};
use crate::spoof::Constellation;
use crate::synth::band::Filter;
use crate::synth::isa::Level;
use crate::synth::{Edge, Kernel, RUN_SAMPLES};
use crate::transmit::Transmitter;
use gnss::record::{NavigationRow, PassRow};
use gnss::satellite::Sv;
use gnss::signal::Link;

/// Smallest length of a block, in units of the samples that its stages look back at.
const LEADS_PER_BLOCK: u64 = 8;

/// A front end on its way to samples. A batch is prepared, then rendered; truth may be written in between.
pub(super) struct Front<'a> {
    pub scene: &'a Scene,
    /// Filter of band-limited edges, if the scene has them.
    filter: Option<Filter>,
    level: Level,
    pub transmitters: Vec<Transmitter>,
    /// Samples of the scene that are requested.
    pub part: Range<u64>,
    next: u64,
    /// Samples that a block's stages look back at, of a block and of a batch.
    lead: u64,
    pub block: u64,
    pub batch: u64,
    clipped: u64,
    /// Buffers that wait for a worker.
    workers: Mutex<Vec<Worker>>,
}

/// A worker's buffers, which go back to where they came from.
struct Lent<'a> {
    worker: Worker,
    from: &'a Mutex<Vec<Worker>>,
}

impl<'a> Lent<'a> {
    fn of(from: &'a Mutex<Vec<Worker>>) -> Self {
        let worker = from.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
        Self { worker, from }
    }
}

impl Drop for Lent<'_> {
    fn drop(&mut self) {
        self.from.lock().unwrap_or_else(PoisonError::into_inner).push(std::mem::take(&mut self.worker));
    }
}

impl<'a> Front<'a> {
    /// Creates the front end's samples of `part` of `scene`.
    ///
    /// # Errors
    /// A rate that the scene's signals cannot have.
    pub fn new(scene: &'a Scene, part: Range<u64>, options: &Options) -> Result<Self, GenerateError> {
        let limited = scene.fidelity.code_edge == CodeEdge::BandLimited;
        let filter = limited.then(|| Filter::new(scene.cutoff_cps()));
        let mut transmitters = transmitters(scene, edge(scene, filter.as_ref()))?;
        if scene.trajectory.grown().is_some() {
            // What spoofers send is made for positions of their own.
            let places = Arc::new(Places::default());
            let authentic = transmitters.iter_mut().filter(|t| t.from.number == 0);
            authentic.for_each(|t| t.places = Some(Arc::clone(&places)));
        }
        let (lead, block) = lengths(scene, options);
        let batch = block * u64::from(options.batch_blocks.max(1));
        let (next, level) = (part.start, options.level);
        Ok(Self {
            scene,
            filter,
            level,
            transmitters,
            part,
            next,
            lead,
            block,
            batch,
            clipped: 0,
            workers: Mutex::default(),
        })
    }

    /// Samples made so far.
    pub fn samples(&self) -> u64 {
        self.next - self.part.start
    }

    /// End of a batch that begins at the next sample. From the second batch on, blocks begin with runs.
    pub fn batch_end(&self) -> u64 {
        self.end_after(self.batch)
    }

    /// End of `samples` samples from the run of the next sample on. It is a multiple of runs or the end of
    /// the part.
    pub fn end_after(&self, samples: u64) -> u64 {
        (run_begin(self.next) + samples).min(self.part.end)
    }

    /// True if samples before `to` remain to be made.
    pub fn is_before(&self, to: u64) -> bool {
        self.next < to
    }

    /// Prepares the data for the samples up to `to`.
    ///
    /// # Errors
    /// Errors of orbits and messages.
    pub fn prepare(&mut self, to: u64) -> Result<(), GenerateError> {
        let scene = self.scene;
        // Runs are made from their beginning on.
        let needed = run_begin(self.next).saturating_sub(self.lead);
        let made = to.max(first_run(scene, needed, self.lead));
        if let Some(grown) = scene.trajectory.grown() {
            let known = grown.ticks().saturating_mul(grown.joining().tick_samples);
            if made > known {
                return Err(GenerateError::Unpushed { known, needed: made });
            }
        }
        self.transmitters.par_iter_mut().try_for_each(|t| t.prepare(scene, needed, made))
    }

    /// Prepares the data for the samples from `needed` up to `to`, and drops earlier data; no samples are
    /// made. Messages are those of links that are `heard`.
    ///
    /// # Errors
    /// Errors of orbits and messages.
    pub fn pass(&mut self, needed: u64, to: u64, heard: &(dyn Fn(Link) -> bool + Sync)) -> Result<(), GenerateError> {
        let (scene, needed) = (self.scene, needed.min(self.next));
        self.transmitters.par_iter_mut().try_for_each(|t| {
            let is_heard = heard(t.link());
            t.prepare_heard(scene, (needed, to), is_heard)
        })?;
        self.next = to;
        Ok(())
    }

    /// Replaces the content of `packed` by the samples up to `to`, which were prepared.
    pub fn render(&mut self, to: u64, packed: &mut Vec<u8>) {
        let (scene, from) = (self.scene, self.next);
        let sample_bytes = scene.metadata.format.bytes();
        let length = to.saturating_sub(from) as usize * sample_bytes;
        packed.resize(length, 0);
        let kernel =
            Kernel { edge: edge(scene, self.filter.as_ref()), arithmetic: scene.fidelity.carrier, level: self.level };
        let (transmitters, block, workers) = (&self.transmitters, self.block, &self.workers);
        // Cut where runs begin: what a cut goes through is made twice.
        let head = (run_begin(from) + block - from) as usize * sample_bytes;
        let (head, tail) = packed.split_at_mut(head.min(length));
        let second = from + (head.len() / sample_bytes) as u64;
        let tail = (0..).zip(tail.chunks_mut(block as usize * sample_bytes));
        let tail = tail.map(|(index, bytes): (u64, _)| (second + index * block, bytes));
        let blocks: Vec<(u64, &mut [u8])> = std::iter::once((from, head)).chain(tail).collect();
        let clipped: u64 = blocks
            .into_par_iter()
            .map_init(
                || Lent::of(workers),
                |lent, (start, bytes)| render(scene, transmitters, kernel, start, bytes, &mut lent.worker),
            )
            .sum();
        self.clipped += clipped;
        self.next = to.max(from);
    }

    /// Navigation data that were sent, with the seconds at which their sets were due.
    pub fn navigation(&mut self) -> BTreeSet<(u32, NavigationRow)> {
        let mut navigation = BTreeSet::new();
        self.transmitters.iter_mut().for_each(|t| navigation.append(&mut t.symbols.navigation));
        navigation
    }

    /// Passes of the true satellites, by the numbers of this front end's samples.
    pub fn passes(&self) -> impl Iterator<Item = PassRow> {
        let authentic = self.transmitters.iter().filter(|t| t.from.number == 0);
        authentic.flat_map(|t| t.passes.rows(t.sv, &self.part))
    }

    /// Summary of the work.
    pub fn done(&self) -> Generated {
        let seen: BTreeSet<Sv> =
            self.transmitters.iter().filter(|t| t.seen && t.from.number == 0).map(|t| t.sv).collect();
        Generated {
            samples: self.samples(),
            satellites: seen.into_iter().collect(),
            clipped: self.clipped,
            knots: self.transmitters.iter().map(|t| t.knots).sum(),
            worst_knot_cycles: self.transmitters.iter().fold(0.0, |worst, t| worst.max(t.worst_knot_cycles)),
            knot_tolerance_cycles: self.scene.fidelity.knot_tolerance_cycles,
        }
    }
}

/// Samples that stages look back at, in whole runs, and samples of a block. What is looked back at is
/// rendered twice: blocks are long against it.
pub(super) fn lengths(scene: &Scene, options: &Options) -> (u64, u64) {
    let lead = scene.memory_samples().next_multiple_of(RUN_SAMPLES) as u64;
    (lead, (u64::from(options.block_runs.max(1)) * RUN_SAMPLES as u64).max(LEADS_PER_BLOCK * lead))
}

/// Shares the geometry among all signals that front ends receive from one satellite of one constellation.
pub(super) fn share_geometry(fronts: &mut [Front<'_>]) {
    let mut count: BTreeMap<(usize, Sv), u32> = BTreeMap::new();
    let transmitters = |front: &Front<'_>| front.transmitters.iter().map(|t| (t.from.number, t.sv)).collect::<Vec<_>>();
    fronts.iter().flat_map(transmitters).for_each(|key| *count.entry(key).or_insert(0) += 1);
    let mut known: BTreeMap<(usize, Sv), Arc<Geometry>> = BTreeMap::new();
    for transmitter in fronts.iter_mut().flat_map(|front| &mut front.transmitters) {
        let key = (transmitter.from.number, transmitter.sv);
        if count.get(&key).is_some_and(|count| *count > 1) {
            transmitter.geometry = Some(Arc::clone(known.entry(key).or_default()));
        }
    }
}

/// The signals of a scene, by constellation, satellite and signal.
pub(crate) fn transmitters(scene: &Scene, edge: Edge<'_>) -> Result<Vec<Transmitter>, GenerateError> {
    let mut found = Vec::new();
    let authentic = Arc::new(Constellation::authentic());
    for from in std::iter::once(&authentic).chain(&scene.spoofers) {
        for sv in scene.satellites_of(from) {
            for signal in scene.signals_of(sv) {
                found.extend(Transmitter::of(scene, Arc::clone(from), sv, signal, edge)?);
            }
        }
    }
    Ok(found)
}
