//! Thermal noise of the receiver: the kernels of [`synth::noise`](crate::synth::noise) as a stage.

use crate::fidelity::Arithmetic;
use crate::stage::{Block, Stage};
use crate::synth::isa;
use crate::synth::noise::{BLOCK_SAMPLES, add_block_exact};

/// Thermal noise of the receiver, white over the band of the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// Seed of the random numbers.
    pub seed: u64,
    /// Standard deviation per component, in LSB.
    pub sigma_lsb: f32,
    /// Arithmetic of the kernel.
    pub arithmetic: Arithmetic,
}

impl Stage for Thermal {
    fn name(&self) -> &'static str {
        "noise"
    }

    fn describe(&self) -> String {
        format!("seed {}, {} LSB a component", self.seed, self.sigma_lsb)
    }

    fn act(&self, block: &mut Block<'_>) {
        let sigma_lsb = planted!("generator.noise.level", self.sigma_lsb, 1.06 * self.sigma_lsb);
        let pieces = block.i.chunks_mut(BLOCK_SAMPLES).zip(block.q.chunks_mut(BLOCK_SAMPLES));
        for (number, (i, q)) in (block.start / BLOCK_SAMPLES as u64..).zip(pieces) {
            let number = planted!("generator.noise.repeats", number, number % 2);
            match self.arithmetic {
                Arithmetic::F32 => isa::add_noise(block.level, self.seed, number, sigma_lsb, i, q),
                Arithmetic::F64 => add_block_exact(self.seed, number, sigma_lsb, i, q),
            }
        }
    }
}
