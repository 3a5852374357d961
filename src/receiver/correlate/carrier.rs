//! The carrier replica: one phasor for sixteen samples, from powers in `f64`.
//!
//! A vector of sixteen samples is turned by the phasor of its first sample only; what is left, the turn
//! within a vector, is the same for every vector and is applied to the sums. Phasors carry an error of a few
//! 1e-7.

use num_complex::Complex64;

use super::{Nco, TURN};

/// Samples in a vector, and vectors whose phasors are made together.
pub(super) const LANES: usize = 16;
/// Samples whose phasors are made together.
pub(super) const BLOCK: usize = LANES * LANES;

/// Sixteen complex numbers.
struct Sixteen {
    re: [f64; LANES],
    im: [f64; LANES],
}

impl Sixteen {
    /// Powers 0 to 15 of `base`, and the sixteenth.
    #[inline(always)]
    fn powers(base: Complex64) -> (Self, Complex64) {
        let (second, one) = (base * base, Complex64::ONE);
        let fourth = second * second;
        let eighth = fourth * fourth;
        let low = [one, base, second, second * base];
        let high = [one, fourth, eighth, eighth * fourth];
        let mut powers = Self { re: [0.0; LANES], im: [0.0; LANES] };
        for k in 0..LANES {
            let (a, b) = (low[k % 4], high[k / 4]);
            powers.re[k] = a.re * b.re - a.im * b.im;
            powers.im[k] = a.re * b.im + a.im * b.re;
        }
        (powers, eighth * eighth)
    }
}

/// The carrier, block by block.
pub(super) struct Carrier {
    within: Sixteen,
    turns_re: [f32; LANES],
    turns_im: [f32; LANES],
    block: Complex64,
    block_turn: Complex64,
}

impl Carrier {
    #[inline(always)]
    pub fn new(nco: &Nco) -> Self {
        let (within, vector_turn) = Sixteen::powers(phasor(nco.carrier_step));
        let (turns, block_turn) = Sixteen::powers(vector_turn);
        // Loops take on the instruction set of where they stand; a closure that `map` calls does not.
        let (mut turns_re, mut turns_im) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            turns_re[k] = turns.re[k] as f32;
            turns_im[k] = turns.im[k] as f32;
        }
        Self { within, turns_re, turns_im, block: phasor(nco.carrier), block_turn }
    }

    /// Cosines and sines of the first samples of the next sixteen vectors.
    #[inline(always)]
    pub fn next_block(&mut self) -> ([f32; LANES], [f32; LANES]) {
        let (re, im) = (self.block.re as f32, self.block.im as f32);
        let (mut cos, mut sin) = ([0.0; LANES], [0.0; LANES]);
        for m in 0..LANES {
            cos[m] = self.turns_re[m] * re - self.turns_im[m] * im;
            sin[m] = self.turns_re[m] * im + self.turns_im[m] * re;
        }
        self.block *= self.block_turn;
        (cos, sin)
    }

    /// The sum of lanes, each turned back to the vectors' first samples.
    #[inline(always)]
    pub fn fold(&self, re: &[f64; LANES], im: &[f64; LANES]) -> Complex64 {
        let (mut turned_re, mut turned_im) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            turned_re[k] = re[k] * self.within.re[k] + im[k] * self.within.im[k];
            turned_im[k] = im[k] * self.within.re[k] - re[k] * self.within.im[k];
        }
        Complex64::new(sum(turned_re), sum(turned_im))
    }
}

/// The few samples after the last whole vector or group, and zeros.
#[inline(always)]
pub(super) fn filled<const N: usize>(rest: &[f32]) -> [f32; N] {
    let mut all = [0.0; N];
    all[..rest.len()].copy_from_slice(rest);
    all
}

/// Halves added to each other until one is left.
#[inline(always)]
fn sum(mut x: [f64; LANES]) -> f64 {
    for half in [8, 4, 2, 1] {
        for k in 0..half {
            x[k] += x[k + half];
        }
    }
    x[0]
}

/// e^{jθ} of a phase in 2⁻⁶⁴ turns.
fn phasor(turns: u64) -> Complex64 {
    let (sin, cos) = libm::sincos(turns as i64 as f64 / TURN * std::f64::consts::TAU);
    Complex64::new(cos, sin)
}
