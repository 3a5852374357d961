//! Sine and cosine of binary angles in lanes of `f32`, with the same bits on every instruction set.
//!
//! Taylor series over an eighth of a turn; within 2e-7 of the true values.

/// Cosine and sine of `words` / 2^32 turns.
#[inline(always)]
pub fn cos_sin<const N: usize>(words: &[u32; N]) -> ([f32; N], [f32; N]) {
    let (mut cos, mut sin) = ([0.0; N], [0.0; N]);
    for k in 0..N {
        let quadrant = words[k].wrapping_add(1 << 29) >> 30;
        // Signed rest of the quadrant, in 2^-32 turn: the angle is within ±π/4.
        let rest = ((words[k] << 2) as i32) >> 2;
        let x = rest as f32 * (std::f32::consts::TAU / 4_294_967_296.0);
        let z = x * x;
        // The first terms left out are 2e-9 (sine) and 2.5e-8 (cosine).
        let s = x + x * z * (-1.0 / 6.0 + z * (1.0 / 120.0 + z * (-1.0 / 5040.0 + z * (1.0 / 362_880.0))));
        let c = 1.0 + z * (-0.5 + z * (1.0 / 24.0 + z * (-1.0 / 720.0 + z * (1.0 / 40_320.0))));
        let odd = (quadrant & 1).wrapping_neg();
        let (s, c) = (s.to_bits(), c.to_bits());
        let cosine = (c & !odd) | (s & odd);
        let sine = (s & !odd) | (c & odd);
        cos[k] = f32::from_bits(cosine ^ ((quadrant ^ (quadrant >> 1)) << 31));
        sin[k] = f32::from_bits(sine ^ ((quadrant >> 1) << 31));
    }
    (cos, sin)
}

/// Upper halves of `start`, `start + step` and on, in 2^-64 turn: words for [`cos_sin`].
#[inline(always)]
pub(crate) fn ramp<const N: usize>(start: u64, step: u64) -> [u32; N] {
    std::array::from_fn(|k| (start.wrapping_add(step.wrapping_mul(k as u64)) >> 32) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::radians;

    #[test]
    fn sine_and_cosine_are_those_of_libm_all_around_the_turn() {
        for n in 0..100_000_u64 {
            let turns = n.wrapping_mul(0x0003_4567_89ab_cdef);
            let words = ramp::<4>(turns, 1 << 62);
            let (cos, sin) = cos_sin(&words);
            for k in 0..4 {
                let (s, c) = libm::sincos(radians(u64::from(words[k]) << 32));
                // The series 2.5e-8; angle and value rounded to 6e-8 each, of numbers below one.
                let error = (f64::from(cos[k]) - c).abs().max((f64::from(sin[k]) - s).abs());
                assert!(error < 2e-7, "{:x} {error}", words[k]);
            }
        }
    }
}
