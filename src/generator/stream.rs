//! Conversion of a scene to a stream of packed IF samples, with the truth beside it.
//!
//! [`Generator`] iterates batches of samples with their truth as values. [`Stream`] gives the truth to a
//! [`Sink`] and the samples to a buffer of the caller's, [`generate`] writes both to their ends,
//! [`Fronts`] does so for several front ends.
//!
//! The stream is made of blocks on an absolute grid, each a pure function of the scene: satellites are
//! added, then noise, then samples are rounded and packed. Blocks of a batch run side by side and
//! are written in order, so bytes depend neither on threads nor on block lengths, and memory stays flat.

mod block;
mod front;
mod fronts;
mod generator;
mod measure;
mod ticks;

use std::collections::BTreeSet;
use std::fmt;
use std::io::Write;
use std::ops::Range;

pub(crate) use front::transmitters;
use front::{Front, share_geometry};
pub use fronts::{Due, Fronts};
pub use generator::{Batch, Generator};
pub(crate) use measure::{Kept, Stretch, measured};
use ticks::Ticks;

use serde::Serialize;

pub use crate::error::GenerateError;
use crate::scene::Scene;
use crate::synth::isa::Level;
use crate::truth::{Record, Sink};
use gnss::place::counted;
use gnss::record::{NavigationRow, PassRow};
use gnss::satellite::Sv;
use gnss::time::Rate;

/// Partition of the work; no option changes a byte of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Number of runs of 4096 samples in a block.
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

/// Summary of a generator run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Generated {
    /// Samples made; none at the level of correlations.
    pub samples: u64,
    /// Satellites that were in view at some time.
    pub satellites: Vec<Sv>,
    /// Number of components that exceeded the format's range.
    pub clipped: u64,
    /// Polynomials made.
    pub knots: u64,
    /// Largest error of the carrier met between their knots, in cycles.
    pub worst_knot_cycles: f64,
    /// Knot tolerance that the scene allows, in cycles.
    pub knot_tolerance_cycles: f64,
}

impl Generated {
    /// Text about what was modelled over `duration_s` seconds without samples.
    pub fn modelled(&self, duration_s: f64) -> String {
        format!("{duration_s} s of {}; {}", self.sent(), self.accuracy())
    }

    fn sent(&self) -> String {
        let names: Vec<String> = self.satellites.iter().map(Sv::to_string).collect();
        format!("{} ({})", counted(names.len(), "satellite"), names.join(" "))
    }

    fn accuracy(&self) -> String {
        let (worst, allowed) = (self.worst_knot_cycles, self.knot_tolerance_cycles);
        let left = 100.0 * (1.0 - worst / allowed);
        let share = if worst > allowed {
            format!("beyond the {allowed:e} that the scene allows: knots are no closer")
        } else {
            format!("{left:.0} % below what the scene allows, {allowed:e}")
        };
        format!("the carrier is up to {worst:.1e} cycles off between {} knots, {share}", self.knots)
    }
}

impl fmt::Display for Generated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} samples of {}", self.samples, self.sent())?;
        if self.clipped > 0 {
            let share = self.clipped as f64 / (2.0 * self.samples as f64);
            write!(f, "; {} components clipped ({:.1e} of them)", self.clipped, share)?;
        }
        write!(f, "; {}", self.accuracy())
    }
}

/// Writes the samples of `scene` and passes the true values to `truth`. `progress` is called with the number
/// of finished samples after each batch.
///
/// # Errors
/// [`GenerateError`]; what was written before stays.
pub fn generate(
    scene: &Scene,
    samples: &mut dyn Write,
    truth: &mut dyn Sink,
    progress: &mut dyn FnMut(u64),
) -> Result<Generated, GenerateError> {
    generate_with(scene, samples, truth, progress, &Options::default())
}

/// [`generate`] with the work cut as `options` state.
///
/// # Errors
/// Errors of [`generate`].
pub fn generate_with(
    scene: &Scene,
    samples: &mut dyn Write,
    truth: &mut dyn Sink,
    progress: &mut dyn FnMut(u64),
    options: &Options,
) -> Result<Generated, GenerateError> {
    generate_part(scene, 0..scene.samples, samples, truth, progress, options)
}

/// Generates the samples of `part` of the scene, with the same bits as in the whole. The truth counts from
/// the part's first sample.
///
/// # Errors
/// Errors of [`generate`], and [`GenerateError::Part`] for a part that the scene does not have.
pub fn generate_part(
    scene: &Scene,
    part: Range<u64>,
    samples: &mut dyn Write,
    truth: &mut dyn Sink,
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

/// Stream of a scene's samples, batch by batch.
pub struct Stream<'a> {
    front: Front<'a>,
    ticks: Ticks,
}

impl<'a> Stream<'a> {
    /// Creates the stream of `scene` from its first sample on, and passes the scene's facts to `truth`.
    ///
    /// # Errors
    /// A rate that the scene's signals cannot have, a sink that does not take the truth.
    pub fn new(scene: &'a Scene, truth: &mut dyn Sink, options: &Options) -> Result<Self, GenerateError> {
        Self::of(scene, 0..scene.samples, truth, options)
    }

    /// Creates the stream of a part of `scene`.
    ///
    /// # Errors
    /// Errors of [`Stream::new`], and [`GenerateError::Part`].
    pub fn of(
        scene: &'a Scene,
        part: Range<u64>,
        truth: &mut dyn Sink,
        options: &Options,
    ) -> Result<Self, GenerateError> {
        if part.start > part.end || part.end > scene.samples {
            return Err(GenerateError::Part { first: part.start, end: part.end, samples: scene.samples });
        }
        let mut front = Front::new(scene, part.clone(), options)?;
        share_geometry(std::slice::from_mut(&mut front));
        truth.begin(std::slice::from_ref(scene), &part)?;
        Ok(Self { front, ticks: Ticks::new(scene, part.start)? })
    }

    /// Samples made so far.
    pub fn samples(&self) -> u64 {
        self.front.samples()
    }

    /// Replaces the content of `packed` by the next batch, and passes its true values to `truth`. Returns
    /// `false` after the last sample.
    ///
    /// # Errors
    /// [`GenerateError`] of orbits, messages and truth.
    pub fn next(&mut self, truth: &mut dyn Sink, packed: &mut Vec<u8>) -> Result<bool, GenerateError> {
        self.advance(self.front.batch_end(), truth, packed)
    }

    /// Like `next`, but makes samples only up to `to`, counted in the scene.
    ///
    /// # Errors
    /// Errors of [`Stream::next`], and [`GenerateError::Unpushed`] where the motion is not known so far.
    pub fn advance(&mut self, to: u64, truth: &mut dyn Sink, packed: &mut Vec<u8>) -> Result<bool, GenerateError> {
        self.front.scene.has_samples()?;
        let to = to.min(self.front.part.end);
        if !self.front.is_before(to) {
            packed.clear();
            return Ok(false);
        }
        self.front.prepare(to)?;
        self.ticks.give(std::slice::from_ref(&self.front), to, truth)?;
        self.front.render(to, packed);
        Ok(true)
    }

    /// Passes the remaining truth to `truth`, and returns the summary of the run.
    ///
    /// # Errors
    /// A sink that does not take the truth.
    pub fn finish(self, truth: &mut dyn Sink) -> Result<Generated, GenerateError> {
        let mut front = self.front;
        end(truth, front.scene.clock.rate, front.navigation(), front.passes().collect())?;
        Ok(front.done())
    }
}

/// Passes the records to `truth` that are known only at the end; `rate` is the one that its samples count by.
fn end(
    truth: &mut dyn Sink,
    rate: Rate,
    navigation: BTreeSet<(u32, NavigationRow)>,
    passes: BTreeSet<PassRow>,
) -> Result<(), GenerateError> {
    for (since_s, row) in navigation {
        let sample = rate.first_sample_at(u64::from(since_s), 1);
        truth.take(Record::Navigation(NavigationRow { sample, ..row }))?;
    }
    passes.into_iter().try_for_each(|row| truth.take(Record::Pass(row)))?;
    Ok(truth.finish()?)
}
