//! Stages that act on samples after the satellites are added: noise, and all front-end hardware.
//!
//! A stage is a function of the absolute sample number and of a bounded number of samples before it, so the
//! stream is the same however it is cut and wherever it starts. The scene fixes the order, which is that of
//! the hardware: what the antenna receives, thermal noise, then the front end. Limits: before sample 0 there
//! is silence.

mod butterworth;
pub mod converter;
pub mod filter;
pub mod interference;
pub mod mixer;
pub mod noise;
pub mod playback;

use crate::synth::isa::Level;
use gnss::facts::StageSpec;

/// A segment of planar samples on its way from the antenna to the file, in LSB of the sample format.
pub struct Block<'a> {
    /// Number of the first sample, a multiple of 4096.
    pub start: u64,
    /// I and Q components, of one length.
    pub i: &'a mut [f32],
    /// Quadrature components.
    pub q: &'a mut [f32],
    /// Number of samples at the front that only serve the memory of stages and are not sent on.
    pub lead: usize,
    /// Number of samples at the end that are not sent on: the rest of the scene's first run, which gain
    /// control measures completely.
    pub tail: usize,
    /// Number of components between lead and tail that exceeded a stage's range.
    pub clipped: u64,
    /// Instruction set of the kernels.
    pub level: Level,
}

impl<'a> Block<'a> {
    /// Creates a block whose samples are all sent on, for the widest instruction set of this processor.
    pub fn whole(start: u64, i: &'a mut [f32], q: &'a mut [f32]) -> Self {
        Self { start, i, q, lead: 0, tail: 0, clipped: 0, level: Level::detect() }
    }
}

/// Stage that acts on all samples of the scene.
///
/// Laws: a stage of zero strength gives the same bits as its absence; sample n depends on n, on the scene and
/// on samples n − [`Stage::memory_samples`] to n alone.
pub trait Stage: Send + Sync {
    /// Name as a scenario writes it.
    fn name(&self) -> &'static str;
    /// Describes the stage for the plan.
    fn describe(&self) -> String;
    /// Describes the stage for the judge's spectrum; `None` if the stage does not change the spectrum.
    fn spec(&self) -> Option<StageSpec> {
        None
    }
    /// Full scale of a converter, in LSB before it, for an input component of standard deviation
    /// `deviation_lsb`.
    fn full_scale_lsb(&self, _deviation_lsb: f64) -> Option<f64> {
        None
    }
    /// Samples before the present one on which its result depends.
    fn memory_samples(&self) -> usize {
        0
    }
    /// Acts on a block. Unless it begins at sample 0, its first [`Stage::memory_samples`] lack their past and
    /// are not used.
    fn act(&self, block: &mut Block<'_>);
}
