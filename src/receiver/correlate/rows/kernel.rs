//! Products of rows with samples, sixteen at a time with AVX2 and 32 with AVX-512, and their plain twin:
//! exact integers. The rows themselves.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

use num_complex::Complex64;

use super::super::carrier::LANES;
use super::super::kernel::Level;
use super::{AMPLITUDE, Job, Places, ROWS, SEGMENT, body};

/// Pairs of samples in a vector.
pub(super) const PAIRS: usize = LANES / 2;
/// Samples that are taken together, two vectors.
pub(super) const TOGETHER: usize = 2 * LANES;
/// Vectors of a segment.
pub(super) const VECTORS: usize = SEGMENT / LANES;
/// Phasors of length one.
pub(super) const UNIT: f32 = 32_767.0;
/// Adding this to a float leaves its integer, rounded half to even, in the low bits.
const ROUND: f32 = 12_582_912.0;

/// Sums of the pairs of all vectors, in phase and in quadrature, a tap: whole numbers. Those of a segment, 32
/// pairs of 127.5·2⁴·√2 · 127 · 64, stay below 2³¹.
pub(super) type Sums<const T: usize> = [[[f64; PAIRS]; 2]; T];

/// Samples and what they are multiplied by.
pub(super) struct Segment<'a, const T: usize> {
    pub i: &'a [[i16; TOGETHER]],
    pub q: &'a [[i16; TOGETHER]],
    /// A phasor for each vector, the same in both halves.
    pub cos: &'a [[i32; 2]],
    pub sin: &'a [[i32; 2]],
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
        Level::Avx2 => unsafe { correlate_avx2(job, codes) },
        // SAFETY: as above, AVX-512.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { correlate_avx512(job, codes) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq")]
fn correlate_avx512<const T: usize>(job: &Job, codes: [i64; T]) -> [Complex64; T] {
    body(job, codes, |segment, sums| add_avx512(segment, sums))
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
        for k in 0..TOGETHER {
            let (cos, sin) = (segment.cos[v][k / LANES] as i16, segment.sin[v][k / LANES] as i16);
            let re = product(i[k], cos) + product(q[k], sin);
            let im = product(q[k], cos) - product(i[k], sin);
            for (t, sums) in sums.iter_mut().enumerate() {
                let [near, next] = segment.entries[segment.from[t] + TOGETHER * v + k].map(i32::from);
                let [weight, next_weight] = segment.weights[t].map(i32::from);
                let value = weight * near + next_weight * next;
                sums[0][k % LANES / 2] += f64::from(re * value);
                sums[1][k % LANES / 2] += f64::from(im * value);
            }
        }
    }
}

/// How many of the vectors of two there are, and where the entries of each tap begin.
#[inline(always)]
fn checked<const T: usize>(segment: &Segment<T>) -> (usize, [*const [i8; 2]; T]) {
    let pairs = segment.i.len().min(segment.q.len()).min(segment.cos.len()).min(segment.sin.len());
    let mut entries = [segment.entries.as_ptr(); T];
    for (entries, from) in entries.iter_mut().zip(segment.from) {
        *entries = segment.entries[from..from + TOGETHER * pairs].as_ptr();
    }
    (pairs, entries)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn add_avx2<const T: usize>(segment: &Segment<T>, sums: &mut Sums<T>) {
    let (pairs, entries) = checked(segment);
    let mut weights = [x86::_mm256_setzero_si256(); T];
    for (weights, own) in weights.iter_mut().zip(segment.weights) {
        *weights = x86::_mm256_set1_epi16(i16::from_le_bytes(own));
    }
    let mut re_sums = [x86::_mm256_setzero_si256(); T];
    let mut im_sums = [x86::_mm256_setzero_si256(); T];
    for v in 0..2 * pairs {
        // SAFETY: sixteen values are at either, and any alignment will do.
        let (i, q) = unsafe {
            (
                x86::_mm256_loadu_si256(segment.i.as_ptr().cast::<[i16; LANES]>().add(v).cast()),
                x86::_mm256_loadu_si256(segment.q.as_ptr().cast::<[i16; LANES]>().add(v).cast()),
            )
        };
        let (cos, sin) = (segment.cos[v / 2][v % 2], segment.sin[v / 2][v % 2]);
        let (cos, sin) = (x86::_mm256_set1_epi32(cos), x86::_mm256_set1_epi32(sin));
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

/// [`add_avx2`], two vectors at a time.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq")]
#[inline]
fn add_avx512<const T: usize>(segment: &Segment<T>, sums: &mut Sums<T>) {
    let (pairs, entries) = checked(segment);
    let mut weights = [x86::_mm512_setzero_si512(); T];
    for (weights, own) in weights.iter_mut().zip(segment.weights) {
        *weights = x86::_mm512_set1_epi16(i16::from_le_bytes(own));
    }
    let mut re_sums = [x86::_mm512_setzero_si512(); T];
    let mut im_sums = [x86::_mm512_setzero_si512(); T];
    // Eight lanes of either vector's phasor.
    let halves = |phasors: [i32; 2]| {
        let (low, high) = (x86::_mm512_set1_epi32(phasors[0]), x86::_mm512_set1_epi32(phasors[1]));
        x86::_mm512_mask_blend_epi32(0xff00, low, high)
    };
    for v in 0..pairs {
        // SAFETY: 32 values are at either, and any alignment will do.
        let (i, q) = unsafe {
            (
                x86::_mm512_loadu_si512(segment.i.as_ptr().add(v).cast()),
                x86::_mm512_loadu_si512(segment.q.as_ptr().add(v).cast()),
            )
        };
        let (cos, sin) = (halves(segment.cos[v]), halves(segment.sin[v]));
        let re = x86::_mm512_add_epi16(x86::_mm512_mulhrs_epi16(i, cos), x86::_mm512_mulhrs_epi16(q, sin));
        let im = x86::_mm512_sub_epi16(x86::_mm512_mulhrs_epi16(q, cos), x86::_mm512_mulhrs_epi16(i, sin));
        for t in 0..T {
            // SAFETY: 32 entries for each two vectors were found to be there.
            let near = unsafe { x86::_mm512_loadu_si512(entries[t].add(TOGETHER * v).cast()) };
            let value = x86::_mm512_maddubs_epi16(weights[t], near);
            re_sums[t] = x86::_mm512_add_epi32(re_sums[t], x86::_mm512_madd_epi16(re, value));
            im_sums[t] = x86::_mm512_add_epi32(im_sums[t], x86::_mm512_madd_epi16(im, value));
        }
    }
    for t in 0..T {
        for (sum, own) in sums[t].iter_mut().zip([re_sums[t], im_sums[t]]) {
            // Both vectors together are still those of a segment.
            let low = x86::_mm512_castsi512_si256(own);
            let both = x86::_mm256_add_epi32(low, x86::_mm512_extracti64x4_epi64::<1>(own));
            // SAFETY: eight values are there, and any alignment will do.
            unsafe {
                let total = x86::_mm512_add_pd(x86::_mm512_loadu_pd(sum.as_ptr()), x86::_mm512_cvtepi32_pd(both));
                x86::_mm512_storeu_pd(sum.as_mut_ptr(), total);
            }
        }
    }
}

/// Fills rows with the means of a period's steps over a sample of `step` steps from each of their places,
/// and beside each the next row's.
pub(super) fn fill(level: Level, entries: &mut [[i8; 2]], places: &Places, step: f64) {
    match level {
        Level::Baseline => fill_plain(entries, places, step),
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { fill_avx2(entries, places, step) },
        // SAFETY: as above, AVX-512.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { fill_avx512(entries, places, step) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fill_avx2(entries: &mut [[i8; 2]], places: &Places, step: f64) {
    fill_plain(entries, places, step);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq")]
fn fill_avx512(entries: &mut [[i8; 2]], places: &Places, step: f64) {
    fill_plain(entries, places, step);
}

/// Adding this to a number of this size or less leaves its integer, rounded half to even, in the low bits.
const ROUND_WIDE: f64 = 6_755_399_441_055_744.0;

#[inline(always)]
fn fill_plain(entries: &mut [[i8; 2]], places: &Places, step: f64) {
    let stride = entries.len() / ROWS;
    let scale = AMPLITUDE / step;
    let (mut before, mut owed) = ([0_i8; ROWS], [0.0; ROWS]);
    let [mut sums, mut steps] = places.at(0);
    // All rows at once, as what one owes waits for its entry before.
    for entry in 0..=stride {
        let [next_sums, next_steps] = places.at(entry + 1);
        let mut values = [0_i8; ROWS];
        for row in 0..ROWS {
            let exact = (next_sums[row] - sums[row]) * scale;
            // A change's place is seen in the sign in which it goes.
            let way = (next_steps[row] - steps[row]).clamp(-1.0, 1.0);
            let way = if exact.abs() < AMPLITUDE { way } else { 0.0 };
            let wanted = (exact + way * owed[row]).clamp(-AMPLITUDE, AMPLITUDE);
            let rounded = wanted + ROUND_WIDE;
            owed[row] += way * (exact - (rounded - ROUND_WIDE));
            values[row] = rounded.to_bits() as i8;
        }
        (sums, steps) = (next_sums, next_steps);
        if let Some(place) = entry.checked_sub(1) {
            for (row, value) in before.iter().enumerate() {
                let next = if row + 1 < ROWS { before[row + 1] } else { values[0] };
                entries[row * stride + place] = [*value, next];
            }
        }
        before = values;
    }
}
