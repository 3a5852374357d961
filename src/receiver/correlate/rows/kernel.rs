//! Products of rows with samples, sixteen at a time with AVX2, and their plain twin: exact integers.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

use num_complex::Complex64;

use super::super::carrier::LANES;
use super::super::kernel::Level;
use super::{Job, SEGMENT, body};

/// Pairs of samples in a vector.
pub(super) const PAIRS: usize = LANES / 2;
/// Vectors of a segment.
pub(super) const VECTORS: usize = SEGMENT / LANES;
/// Phasors of length one.
pub(super) const UNIT: f32 = 32_767.0;
/// Adding this to a float leaves its integer, rounded half to even, in the low bits.
const ROUND: f32 = 12_582_912.0;

/// Sums of the pairs of all vectors, in phase and in quadrature, a tap: whole numbers. Those of a segment, 32
/// pairs of 127.5·2⁴·√2 · 127 · 64, stay below 2³¹.
pub(super) type Sums<const T: usize> = [[[f64; PAIRS]; 2]; T];

/// Up to [`VECTORS`] vectors of samples, and what they are multiplied by.
pub(super) struct Segment<'a, const T: usize> {
    pub i: &'a [[i16; LANES]],
    pub q: &'a [[i16; LANES]],
    /// A phasor for each vector, the same in both halves.
    pub cos: [i32; VECTORS],
    pub sin: [i32; VECTORS],
    /// Values of two rows side by side; those of the first sample are entry `from`.
    pub entries: &'a [[i8; 2]],
    pub from: [usize; T],
    pub weights: [[u8; 2]; T],
}

/// Correlates with the code at the first sample at each of `codes`; `level` must be one that this processor
/// has.
pub(super) fn correlate<const T: usize>(level: Level, job: &Job, codes: [i64; T]) -> [Complex64; T] {
    match level {
        Level::Baseline => body(job, codes, add_plain),
        // SAFETY: `Level` values beyond the baseline come from `best` (and `all` in tests), which detected
        // AVX2.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { correlate_avx2(job, codes) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn correlate_avx2<const T: usize>(job: &Job, codes: [i64; T]) -> [Complex64; T] {
    body(job, codes, |segment, sums| add_avx2(segment, sums))
}

/// A float of this size has 2⁻⁴ in its last bit, and zeros in its last sixteen.
const ALIGN: f32 = 786_432.0;

/// Samples of 8 bits in 2⁻⁴.
pub(in super::super) fn fixed(level: Level, plane: &[f32], fixed: &mut [i16]) {
    match level {
        Level::Baseline => fixed_plain(plane, fixed),
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { fixed_avx2(plane, fixed) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fixed_avx2(plane: &[f32], fixed: &mut [i16]) {
    fixed_plain(plane, fixed);
}

#[inline(always)]
fn fixed_plain(plane: &[f32], fixed: &mut [i16]) {
    for (fixed, x) in fixed.iter_mut().zip(plane) {
        *fixed = (x + ALIGN).to_bits() as u16 as i16;
    }
}

/// Phasors in 2⁻¹⁵, each in both halves of an integer.
#[inline(always)]
pub(super) fn twice(x: [f32; LANES]) -> [i32; LANES] {
    let mut both = [0; LANES];
    for (both, x) in both.iter_mut().zip(&x) {
        let short = (x * UNIT + ROUND).to_bits() & 0xffff;
        *both = (short | short << 16) as i32;
    }
    both
}

/// a·b/2¹⁵, rounded.
#[inline(always)]
fn product(a: i16, b: i16) -> i32 {
    (i32::from(a) * i32::from(b) + (1 << 14)) >> 15
}

/// [`add_avx2`] in plain Rust.
fn add_plain<const T: usize>(segment: &Segment<T>, sums: &mut Sums<T>) {
    for (v, (i, q)) in segment.i.iter().zip(segment.q).enumerate() {
        let (cos, sin) = (segment.cos[v] as i16, segment.sin[v] as i16);
        for k in 0..LANES {
            let re = product(i[k], cos) + product(q[k], sin);
            let im = product(q[k], cos) - product(i[k], sin);
            for (t, sums) in sums.iter_mut().enumerate() {
                let [near, next] = segment.entries[segment.from[t] + LANES * v + k].map(i32::from);
                let [weight, next_weight] = segment.weights[t].map(i32::from);
                let value = weight * near + next_weight * next;
                sums[0][k / 2] += f64::from(re * value);
                sums[1][k / 2] += f64::from(im * value);
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn add_avx2<const T: usize>(segment: &Segment<T>, sums: &mut Sums<T>) {
    let vectors = segment.i.len().min(segment.q.len()).min(VECTORS);
    let mut entries = [segment.entries.as_ptr(); T];
    let mut weights = [x86::_mm256_setzero_si256(); T];
    for t in 0..T {
        let from = segment.from[t];
        entries[t] = segment.entries[from..from + LANES * vectors].as_ptr();
        weights[t] = x86::_mm256_set1_epi16(i16::from_le_bytes(segment.weights[t]));
    }
    let mut re_sums = [x86::_mm256_setzero_si256(); T];
    let mut im_sums = [x86::_mm256_setzero_si256(); T];
    for v in 0..vectors {
        // SAFETY: sixteen values are at either, and any alignment will do.
        let (i, q) = unsafe {
            (
                x86::_mm256_loadu_si256(segment.i.as_ptr().add(v).cast()),
                x86::_mm256_loadu_si256(segment.q.as_ptr().add(v).cast()),
            )
        };
        let (cos, sin) = (x86::_mm256_set1_epi32(segment.cos[v]), x86::_mm256_set1_epi32(segment.sin[v]));
        let re = x86::_mm256_add_epi16(x86::_mm256_mulhrs_epi16(i, cos), x86::_mm256_mulhrs_epi16(q, sin));
        let im = x86::_mm256_sub_epi16(x86::_mm256_mulhrs_epi16(q, cos), x86::_mm256_mulhrs_epi16(i, sin));
        for t in 0..T {
            // SAFETY: sixteen entries for each vector were found to be there.
            let near = unsafe { x86::_mm256_loadu_si256(entries[t].add(LANES * v).cast()) };
            let value = x86::_mm256_maddubs_epi16(weights[t], near);
            re_sums[t] = x86::_mm256_add_epi32(re_sums[t], x86::_mm256_madd_epi16(re, value));
            im_sums[t] = x86::_mm256_add_epi32(im_sums[t], x86::_mm256_madd_epi16(im, value));
        }
    }
    for t in 0..T {
        for (sum, own) in sums[t].iter_mut().zip([re_sums[t], im_sums[t]]) {
            let halves = [x86::_mm256_castsi256_si128(own), x86::_mm256_extracti128_si256::<1>(own)];
            for (sum, half) in sum.as_chunks_mut::<4>().0.iter_mut().zip(halves) {
                // SAFETY: four values are there, and any alignment will do.
                unsafe {
                    let total = x86::_mm256_add_pd(x86::_mm256_loadu_pd(sum.as_ptr()), x86::_mm256_cvtepi32_pd(half));
                    x86::_mm256_storeu_pd(sum.as_mut_ptr(), total);
                }
            }
        }
    }
}
