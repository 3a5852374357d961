//! The carrier replica: one phasor for sixteen samples, or for sixteen pairs of them, from powers in `f64`.
//!
//! A vector is turned by the phasor of its first sample only; what is left, the turn within a vector, is the
//! same for every vector and is applied to the sums. Phasors carry an error of a few 1e-7.

use num_complex::Complex64;

use super::{Nco, TURN, kernel};

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
        // Plain numbers of one kind side by side, which makes vectors.
        let (mut low_re, mut low_im) = ([0.0; 4], [0.0; 4]);
        for k in 0..4 {
            (low_re[k], low_im[k]) = (low[k].re, low[k].im);
        }
        let mut powers = Self { re: [0.0; LANES], im: [0.0; LANES] };
        let fours = powers.re.as_chunks_mut::<4>().0.iter_mut().zip(powers.im.as_chunks_mut::<4>().0);
        for ((re, im), b) in fours.zip(high) {
            for k in 0..4 {
                re[k] = low_re[k] * b.re - low_im[k] * b.im;
                im[k] = low_re[k] * b.im + low_im[k] * b.re;
            }
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
    /// Carrier for vectors of sixteen samples.
    #[inline(always)]
    pub fn new(nco: &Nco) -> Self {
        let (within, vector_turn) = Sixteen::powers(phasor(nco.carrier_step));
        Self::of(nco, within, vector_turn)
    }

    /// Carrier for vectors of sixteen pairs of samples. It is constant over each pair, at the value in its
    /// middle.
    #[inline(always)]
    pub fn of_pairs(nco: &Nco) -> Self {
        let one = phasor(nco.carrier_step);
        let (mut within, vector_turn) = Sixteen::powers(one * one);
        let middle = 0.5 * (Complex64::ONE + one);
        for k in 0..LANES {
            let (re, im) = (within.re[k], within.im[k]);
            within.re[k] = re * middle.re - im * middle.im;
            within.im[k] = re * middle.im + im * middle.re;
        }
        Self::of(nco, within, vector_turn)
    }

    #[inline(always)]
    fn of(nco: &Nco, within: Sixteen, vector_turn: Complex64) -> Self {
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

    /// The sum of lanes, or of pairs, each turned back to the vectors' first samples.
    #[inline(always)]
    pub fn fold(&self, re: &[f64; LANES], im: &[f64; LANES]) -> Complex64 {
        kernel::fold([re, im], [&self.within.re, &self.within.im])
    }
}

/// The few samples after the last whole vector or group, and zeros.
#[inline(always)]
pub(super) fn filled<T: Copy + Default, const N: usize>(rest: &[T]) -> [T; N] {
    let mut all = [T::default(); N];
    all[..rest.len()].copy_from_slice(rest);
    all
}

/// e^{jθ} of a phase in 2⁻⁶⁴ turns, to 2e-16: Taylor's polynomials on either side of the nearest quarter.
#[inline(always)]
pub fn phasor(turns: u64) -> Complex64 {
    let quarter = turns.wrapping_add(1 << 61) >> 62;
    let x = turns.wrapping_sub(quarter << 62) as i64 as f64 * (std::f64::consts::TAU / TURN);
    let z = x * x;
    let (mut sin, mut cos) = (1.0, 1.0);
    for n in [15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        // Of z alone, so that only one product waits for the term before.
        sin = 1.0 - sin * (z * (1.0 / (n * (n - 1.0))));
        cos = 1.0 - cos * (z * (1.0 / (n * (n + 1.0))));
    }
    sin *= x;
    cos = 1.0 - 0.5 * z * cos;
    match quarter {
        0 => Complex64::new(cos, sin),
        1 => Complex64::new(-sin, cos),
        2 => Complex64::new(-cos, -sin),
        _ => Complex64::new(sin, -cos),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_and_pairs_are_turned_back_to_the_first_sample_of_their_vector() {
        let step = 0x0123_4567_89ab_cdef;
        let nco = Nco { carrier: 0, carrier_step: step, code: 0, code_step: 0 };
        let at = |sample: u64| phasor(step.wrapping_mul(sample));
        let number = |k: u64| Complex64::new(libm::sin(k as f64), libm::cos(3.0 * k as f64));
        let pair = |k: u64| 0.5 * (at(2 * k) + at(2 * k + 1));
        for (carrier, turn) in
            [(Carrier::new(&nco), &at as &dyn Fn(u64) -> Complex64), (Carrier::of_pairs(&nco), &pair)]
        {
            let re = std::array::from_fn(|k| number(k as u64).re);
            let im = std::array::from_fn(|k| number(k as u64).im);
            let expected: Complex64 = (0..LANES as u64).map(|k| number(k) * turn(k).conj()).sum();
            // Sixteen products of about one.
            assert!((carrier.fold(&re, &im) - expected).norm() < 1e-14);
            let turns = [&carrier.within.re, &carrier.within.im];
            assert_eq!(carrier.fold(&re, &im), kernel::fold_plain([&re, &im], turns));
        }
    }

    #[test]
    fn phasors_are_those_of_the_library() {
        for turn in 0..100_000_u64 {
            let turns = turn.wrapping_mul(0x0123_4567_89ab_cdef) ^ turn << 44;
            let (sin, cos) = libm::sincos(turns as i64 as f64 / TURN * std::f64::consts::TAU);
            // The library's argument is rounded to 4e-16.
            assert!((phasor(turns) - Complex64::new(cos, sin)).norm() < 1e-15, "{turns}");
        }
        assert_eq!(phasor(0), Complex64::ONE);
    }
}
