//! Rendering of one block of samples: satellites are added, stages act on their sum, and the format rounds
//! it.
//!
//! A block is a pure function of the scene and of what transmitters have prepared, so blocks are made side by
//! side. What stages look back at is rendered before it and not sent on.

use crate::error::GenerateError;
use crate::scene::{CodeEdge, Scene};
use crate::stage::Block;
use crate::synth::band::Filter;
use crate::synth::isa;
use crate::synth::{Edge, Kernel, RUN_SAMPLES};
use crate::transmit::{Scratch, Transmitter};
use gnss::samples::Format;

impl Scene {
    /// Refuses a level at which no samples exist.
    pub(super) fn has_samples(&self) -> Result<(), GenerateError> {
        let grade = self.fidelity.grade;
        if grade.is_sampled() { Ok(()) } else { Err(GenerateError::NoSamples(grade.name())) }
    }
}

/// The sample at which the run of a sample begins.
pub(super) fn run_begin(sample: u64) -> u64 {
    sample / RUN_SAMPLES as u64 * RUN_SAMPLES as u64
}

/// Samples that are made at least from `from` on where stages look back: gain control measures the scene's
/// first run whole.
pub(super) fn first_run(scene: &Scene, from: u64, memory: u64) -> u64 {
    if from == 0 && memory > 0 { scene.samples.min(RUN_SAMPLES as u64) } else { 0 }
}

/// The scene's edges; band-limited where there is a `filter`.
pub(super) fn edge<'a>(scene: &Scene, filter: Option<&'a Filter>) -> Edge<'a> {
    match filter {
        Some(filter) => Edge::BandLimited(filter),
        None if scene.fidelity.code_edge == CodeEdge::Nearest => Edge::Nearest,
        None => Edge::Area,
    }
}

/// Buffers of one worker.
#[derive(Default)]
pub(super) struct Worker {
    scratch: Scratch,
    i: Vec<f32>,
    q: Vec<f32>,
}

/// Renders one block into `bytes`, and returns how many of its components were clipped.
///
/// Run by run, so that the planar samples of one stay in the first-level cache; in one piece with what lies
/// before it if a stage looks back.
pub(super) fn render(
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
    // A block that begins within a run begins with the rest of it, so that no run is rendered twice.
    let rest = (run_begin(start) + RUN_SAMPLES as u64 - start) as usize * format.bytes();
    let cut = if piece_bytes == bytes.len() { 0 } else { rest.min(bytes.len()) };
    let (head, tail) = bytes.split_at_mut(cut);
    for bytes in std::iter::once(head).filter(|head| !head.is_empty()).chain(tail.chunks_mut(piece_bytes.max(1))) {
        let samples = bytes.len() / format.bytes();
        let mut block = satellites(scene, transmitters, kernel, (first, samples, memory), worker);
        scene.stages(|stage| stage.act(&mut block));
        clipped += block.clipped + pack(&block, samples, format, bytes);
        first += samples as u64;
    }
    clipped
}

/// Renders the satellites in `samples` samples from `first` on, with the samples before them that stages
/// need.
pub(super) fn satellites<'w>(
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
pub(super) fn pack(block: &Block<'_>, samples: usize, format: Format, bytes: &mut [u8]) -> u64 {
    let sent = block.lead..block.lead + samples;
    let (Some(i), Some(q)) = (block.i.get(sent.clone()), block.q.get(sent)) else { return 0 };
    isa::pack(block.level, format, i, q, bytes)
}
