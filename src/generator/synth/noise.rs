//! The kernel of Gaussian noise, as a pure function of (seed, sample number).
//!
//! Each block of 4096 samples has 32 xoshiro128++ generators (Blackman and Vigna 2021), seeded
//! by SplitMix64 from (seed, block, lane); polynomial Box–Muller turns two draws into a complex
//! sample (cosine to I, sine to Q). Limits: |x| ≤ 6.77 σ; logarithm and sines within 3e-7.

use super::angle::cos_sin;
use crate::random::mix;

/// Samples in one independently seeded block.
pub const BLOCK_SAMPLES: usize = 4096;

/// Samples side by side.
pub(super) const LANES: usize = 32;

pub(super) type Words = [u32; LANES];

/// Adds noise of `sigma` per component to the samples of block number `block`, from its first one on.
/// At most [`BLOCK_SAMPLES`] samples; `i` and `q` have the same length.
#[inline(always)]
pub fn add_block(seed: u64, block: u64, sigma: f32, i: &mut [f32], q: &mut [f32]) {
    let mut state = seeded(seed, block);
    for (bi, bq) in i.chunks_mut(LANES).zip(q.chunks_mut(LANES)) {
        let radius = radius(&next(&mut state), sigma);
        let angle = next(&mut state);
        let (cos, sin) = cos_sin(&angle);
        if let (Ok(bi), Ok(bq)) = (<&mut [f32; LANES]>::try_from(&mut *bi), <&mut [f32; LANES]>::try_from(&mut *bq)) {
            for k in 0..LANES {
                bi[k] += radius[k] * cos[k];
                bq[k] += radius[k] * sin[k];
            }
        } else {
            for (k, (i, q)) in bi.iter_mut().zip(bq).enumerate() {
                *i += radius[k] * cos[k];
                *q += radius[k] * sin[k];
            }
        }
    }
}

fn seeded(seed: u64, block: u64) -> [Words; 4] {
    // The block's number passes the mixer once before lanes are counted, so that blocks do not overlap.
    let mut counter = mix(seed ^ mix(block.wrapping_add(0x9e37_79b9_7f4a_7c15)));
    let [mut a, mut b, mut c, mut d] = [[0; LANES]; 4];
    let mut draw = || {
        counter = counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let word = mix(counter);
        (word as u32, (word >> 32) as u32)
    };
    for (((a, b), c), d) in a.iter_mut().zip(&mut b).zip(&mut c).zip(&mut d) {
        (*a, *b) = draw();
        (*c, *d) = draw();
    }
    [a, b, c, d]
}

#[inline(always)]
fn next(state: &mut [Words; 4]) -> Words {
    let mut out = [0; LANES];
    let [a, b, c, d] = state;
    for k in 0..LANES {
        out[k] = a[k].wrapping_add(d[k]).rotate_left(7).wrapping_add(a[k]);
        let shifted = b[k] << 9;
        c[k] ^= a[k];
        d[k] ^= b[k];
        b[k] ^= c[k];
        a[k] ^= d[k];
        c[k] ^= shifted;
        d[k] = d[k].rotate_left(11);
    }
    out
}

/// `sigma · sqrt(−2 ln u)` with u = (word + 1/2) / 2^32.
#[inline(always)]
fn radius<const N: usize>(words: &[u32; N], sigma: f32) -> [f32; N] {
    let mut out = [0.0; N];
    for k in 0..N {
        let u = (words[k] as f32 + 0.5) * (1.0 / 4_294_967_296.0);
        // u = m · 2^e with m from sqrt(1/2) to sqrt(2): subtracting the bits of sqrt(1/2) carries e into the
        // exponent.
        let shifted = u.to_bits().wrapping_sub(0x3f35_04f3);
        let exponent = (shifted as i32) >> 23;
        let m = f32::from_bits((shifted & 0x007f_ffff) + 0x3f35_04f3);
        // ln m = 2 artanh s = 2 (s + s³/3 + s⁵/5 + s⁷/7 + …); |s| < 0.172, so s⁹ leaves 3e-8.
        let s = (m - 1.0) / (m + 1.0);
        let z = s * s;
        let series = 2.0 + z * (2.0 / 3.0 + z * (2.0 / 5.0 + z * (2.0 / 7.0)));
        let ln = exponent as f32 * std::f32::consts::LN_2 + s * series;
        out[k] = sigma * (-2.0 * ln).max(0.0).sqrt();
    }
    out
}

/// Complex normals of unit variance a component, real and imaginary parts, each from a word of its own.
pub fn normals<const N: usize>(words: &[u64; N]) -> [[f32; N]; 2] {
    let radius = radius(&words.map(|word| word as u32), 1.0);
    let (cos, sin) = cos_sin(&words.map(|word| (word >> 32) as u32));
    [std::array::from_fn(|k| radius[k] * cos[k]), std::array::from_fn(|k| radius[k] * sin[k])]
}

/// [`add_block`] in `f64`: the same words, with logarithm, sine and cosine from `libm`.
pub fn add_block_exact(seed: u64, block: u64, sigma: f32, i: &mut [f32], q: &mut [f32]) {
    let mut state = seeded(seed, block);
    for (bi, bq) in i.chunks_mut(LANES).zip(q.chunks_mut(LANES)) {
        let (radii, angles) = (next(&mut state), next(&mut state));
        for (((i, q), radius), angle) in bi.iter_mut().zip(bq).zip(radii).zip(angles) {
            let u = (f64::from(radius) + 0.5) / 4_294_967_296.0;
            let radius = f64::from(sigma) * (-2.0 * libm::log(u)).sqrt();
            let (sin, cos) = libm::sincos(f64::from(angle) * (std::f64::consts::TAU / 4_294_967_296.0));
            *i += (radius * cos) as f32;
            *q += (radius * sin) as f32;
        }
    }
}
