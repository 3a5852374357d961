//! A scene becomes a stream of packed IF samples, with the truth beside it.
//!
//! The stream is made of blocks on an absolute grid, each a pure function of the scene: satellites are
//! added, then noise, then samples are rounded and packed. Blocks of a batch run side by side and
//! are written in order, so bytes depend neither on threads nor on block lengths, and memory stays flat.

mod block;
mod front;
mod fronts;
mod measure;
#[cfg(test)]
mod tests;
mod ticks;

use std::fmt;
use std::io::Write;
use std::ops::Range;

pub(crate) use block::cutoff_cps;
use front::{Front, share_geometry};
pub use fronts::Fronts;
pub use measure::machinery;
pub(crate) use measure::{Stretch, measured};
use thiserror::Error;
use ticks::Ticks;

use crate::generator::scene::Scene;
use crate::generator::synth::isa::Level;
use crate::generator::synth::waveform::WaveformError;
use crate::generator::truth::{self, TruthError};
use crate::gnss::broadcast::OrbitError;
use crate::gnss::gps::lnav::FieldError;
use crate::gnss::satellite::Sv;

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
    #[error("no front end: expected one at least")]
    NoFrontEnd,
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
    front: Front<'a>,
    ticks: Ticks,
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
        let mut front = Front::new(scene, part.clone(), options)?;
        share_geometry(std::slice::from_mut(&mut front));
        truth.scene(scene, &part)?;
        Ok(Self { front, ticks: Ticks::new(scene, part.start)? })
    }

    /// Samples made so far.
    pub fn samples(&self) -> u64 {
        self.front.samples()
    }

    /// Replaces what `packed` holds by the next batch, and writes the truth as far; `false` after the last
    /// sample.
    ///
    /// # Errors
    /// [`GenerateError`] of orbits, messages and truth.
    pub fn next(&mut self, truth: &mut truth::Writer, packed: &mut Vec<u8>) -> Result<bool, GenerateError> {
        let to = self.front.batch_end();
        if !self.front.is_before(to) {
            packed.clear();
            return Ok(false);
        }
        self.front.prepare(to)?;
        self.ticks.write(std::slice::from_ref(&self.front), to, truth)?;
        self.front.render(to, packed);
        Ok(true)
    }

    /// Writes the rest of the truth, and tells what was done.
    ///
    /// # Errors
    /// A truth that cannot be written.
    pub fn finish(self, truth: &mut truth::Writer) -> Result<Generated, GenerateError> {
        let mut front = self.front;
        truth.finish(&front.navigation(), &front.passes().collect())?;
        Ok(front.done())
    }
}
