//! The inner loops of the fast correlators for AVX-512: chips are looked up in tables, sixteen or thirty-two
//! at a time.

use std::arch::x86_64 as x86;

use super::super::carrier::{LANES, filled};
use super::super::pattern::Table;
use super::super::short::{self, GROUP};
use super::super::single::{CHUNK, Chunk, FINE, FINE_MASK, Lanes, split};
use super::{CODE_BITS, LOOKUP_STEP, wrapped};

/// [`short::lanes`] with chips looked up in tables.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
#[inline]
pub(super) fn short_lanes<const T: usize, const AREA: bool>(
    chunk: &short::Chunk,
    code: &mut [u64; T],
) -> short::Sums<T> {
    let steps = chunk.steps;
    let Table { values, changes } = chunk.replica.shorts();
    // Code phases are below the period.
    assert!((steps.period >> CODE_BITS) as usize + GROUP <= values.len().min(changes.len()));
    let lanes = load_lanes(&steps.lanes);
    let fine = x86::_mm_cvtsi32_si128(steps.fine as i32);
    let fine_mask = x86::_mm512_set1_epi16(((1_u32 << steps.fine) - 1) as i16);
    let width = x86::_mm512_set1_epi16(steps.width as i16);
    let slope = x86::_mm512_set1_epi16(steps.slope);
    let none = x86::_mm512_setzero_si512();
    let (mut sums_re, mut sums_im) = ([none; T], [none; T]);
    let mut codes = *code;
    let phasors = chunk.cos.iter().zip(chunk.sin);
    for ((i, q), (&cos, &sin)) in chunk.i.iter().zip(chunk.q).zip(phasors) {
        let (i, q) = (fixed(i), fixed(q));
        let (cos, sin) = (x86::_mm512_set1_epi32(cos), x86::_mm512_set1_epi32(sin));
        let re = x86::_mm512_add_epi16(x86::_mm512_mulhrs_epi16(i, cos), x86::_mm512_mulhrs_epi16(q, sin));
        let im = x86::_mm512_sub_epi16(x86::_mm512_mulhrs_epi16(q, cos), x86::_mm512_mulhrs_epi16(i, sin));
        let (mut phase, mut index, mut value, mut within) = ([none; T], [none; T], [none; T], [none; T]);
        let (mut near, mut near_slope) = ([none; T], [none; T]);
        for t in 0..T {
            let (chip, fraction) = steps.split(codes[t]);
            codes[t] = steps.next(codes[t]);
            phase[t] = x86::_mm512_set1_epi16(fraction as i16);
            // SAFETY: `chip` is within the period, and thirty-two entries from there on are in the table.
            near[t] = unsafe { x86::_mm512_loadu_epi16(values.as_ptr().add(chip)) };
            if AREA {
                // SAFETY: as above.
                near_slope[t] = unsafe { x86::_mm512_loadu_epi16(changes.as_ptr().add(chip)) };
            }
        }
        for phase in &mut phase {
            *phase = x86::_mm512_add_epi16(*phase, lanes);
        }
        for t in 0..T {
            index[t] = x86::_mm512_srl_epi16(phase[t], fine);
        }
        if AREA {
            for near_slope in &mut near_slope {
                *near_slope = x86::_mm512_mullo_epi16(*near_slope, slope);
            }
            for t in 0..T {
                within[t] = x86::_mm512_min_epu16(x86::_mm512_and_si512(phase[t], fine_mask), width);
            }
            for t in 0..T {
                near_slope[t] = x86::_mm512_permutexvar_epi16(index[t], near_slope[t]);
            }
        }
        for t in 0..T {
            value[t] = x86::_mm512_permutexvar_epi16(index[t], near[t]);
        }
        if AREA {
            for t in 0..T {
                within[t] = x86::_mm512_mulhrs_epi16(near_slope[t], within[t]);
            }
            for t in 0..T {
                value[t] = x86::_mm512_add_epi16(value[t], within[t]);
            }
        }
        for t in 0..T {
            sums_re[t] = x86::_mm512_add_epi32(sums_re[t], x86::_mm512_madd_epi16(re, value[t]));
            sums_im[t] = x86::_mm512_add_epi32(sums_im[t], x86::_mm512_madd_epi16(im, value[t]));
        }
    }
    *code = codes;
    // Loops, here and in what follows: a closure that `map` calls remains a call.
    let mut sums = short::Sums { re: [[0; LANES]; T], im: [[0; LANES]; T] };
    for t in 0..T {
        sums.re[t] = store_int(sums_re[t]);
        sums.im[t] = store_int(sums_im[t]);
    }
    sums
}

/// Samples k and k + 16 side by side, in 2⁻⁷ LSB.
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn fixed(x: &[f32; GROUP]) -> x86::__m512i {
    let align = x86::_mm512_set1_ps(short::ALIGN);
    // SAFETY: thirty-two values are there, and any alignment will do.
    let (first, second) = unsafe { (x86::_mm512_loadu_ps(x.as_ptr()), x86::_mm512_loadu_ps(x.as_ptr().add(LANES))) };
    let first = x86::_mm512_castps_si512(x86::_mm512_add_ps(first, align));
    let second = x86::_mm512_castps_si512(x86::_mm512_add_ps(second, align));
    x86::_mm512_mask_blend_epi16(0xaaaa_aaaa, first, x86::_mm512_slli_epi32::<16>(second))
}

/// [`lanes`](super::single::lanes) with chips looked up in tables. The one fused operation has an exact
/// product, so it rounds as that one does.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
#[inline]
pub(super) fn lanes<const T: usize, const AREA: bool>(chunk: &Chunk, code: &mut [u64; T]) -> Lanes<T> {
    let steps = chunk.steps;
    let lane = load_u32(&steps.lane);
    let fine_mask = x86::_mm512_set1_epi32(FINE_MASK as i32);
    let inverse_width = x86::_mm512_set1_ps(steps.inverse_width);
    let one = x86::_mm512_set1_ps(1.0);
    let mut sums_re = [x86::_mm512_setzero_ps(); T];
    let mut sums_im = [x86::_mm512_setzero_ps(); T];
    // A chunk moves by less than 1024 chips, which the tables hold beyond a period.
    let Table { values, changes } = chunk.replica.floats();
    let farthest = code.iter().map(|&code| (code.wrapping_add(CHUNK as u64 * LOOKUP_STEP) >> CODE_BITS) as usize).max();
    assert!(farthest.unwrap_or(0) + LANES <= values.len().min(changes.len()));
    let (vectors_i, rest_i) = chunk.i.as_chunks::<LANES>();
    let (vectors_q, rest_q) = chunk.q.as_chunks::<LANES>();
    let (last_i, last_q) = (filled(rest_i), filled(rest_q));
    let rest = usize::from(!rest_i.is_empty());
    let mut phases = *code;
    let mut take = |vectors_i: &[[f32; LANES]], vectors_q: &[[f32; LANES]], cos: &[f32], sin: &[f32]| {
        for ((i, q), (&cos, &sin)) in vectors_i.iter().zip(vectors_q).zip(cos.iter().zip(sin)) {
            let (i, q) = (load(i), load(q));
            let (cos, sin) = (x86::_mm512_set1_ps(cos), x86::_mm512_set1_ps(sin));
            let re = x86::_mm512_add_ps(x86::_mm512_mul_ps(i, cos), x86::_mm512_mul_ps(q, sin));
            let im = x86::_mm512_sub_ps(x86::_mm512_mul_ps(q, cos), x86::_mm512_mul_ps(i, sin));
            for t in 0..T {
                let (chip, fraction) = split(phases[t]);
                phases[t] = phases[t].wrapping_add(steps.advance);
                let phase = x86::_mm512_add_epi32(x86::_mm512_set1_epi32(fraction as i32), lane);
                let index = x86::_mm512_srli_epi32::<FINE>(phase);
                // SAFETY: `chip` is at most `farthest`, and sixteen entries from there on are in the table.
                let near = unsafe { x86::_mm512_loadu_ps(values.as_ptr().add(chip)) };
                let mut value = x86::_mm512_permutexvar_ps(index, near);
                if AREA {
                    // SAFETY: as above.
                    let near = unsafe { x86::_mm512_loadu_ps(changes.as_ptr().add(chip)) };
                    let change = x86::_mm512_permutexvar_ps(index, near);
                    let fraction = x86::_mm512_cvtepi32_ps(x86::_mm512_and_si512(phase, fine_mask));
                    let share = x86::_mm512_min_ps(x86::_mm512_mul_ps(fraction, inverse_width), one);
                    value = x86::_mm512_fmadd_ps(change, share, value);
                }
                sums_re[t] = x86::_mm512_add_ps(sums_re[t], x86::_mm512_mul_ps(re, value));
                sums_im[t] = x86::_mm512_add_ps(sums_im[t], x86::_mm512_mul_ps(im, value));
            }
        }
    };
    let whole = vectors_i.len();
    take(vectors_i, vectors_q, &chunk.cos, &chunk.sin);
    take(&[last_i][..rest], &[last_q][..rest], &chunk.cos[whole..], &chunk.sin[whole..]);
    let mut sums = Lanes { re: [[0.0; LANES]; T], im: [[0.0; LANES]; T] };
    for t in 0..T {
        code[t] = wrapped(phases[t], steps.period);
        sums.re[t] = store(sums_re[t]);
        sums.im[t] = store(sums_im[t]);
    }
    sums
}

#[target_feature(enable = "avx512f")]
#[inline]
fn load(x: &[f32; LANES]) -> x86::__m512 {
    // SAFETY: sixteen values are there, and any alignment will do.
    unsafe { x86::_mm512_loadu_ps(x.as_ptr()) }
}

#[target_feature(enable = "avx512f")]
#[inline]
fn load_u32(x: &[u32; LANES]) -> x86::__m512i {
    // SAFETY: as `load`.
    unsafe { x86::_mm512_loadu_si512(x.as_ptr().cast()) }
}

#[target_feature(enable = "avx512f")]
#[inline]
fn load_lanes(x: &[[u16; 2]; LANES]) -> x86::__m512i {
    // SAFETY: as `load`.
    unsafe { x86::_mm512_loadu_si512(x.as_ptr().cast()) }
}

#[target_feature(enable = "avx512f")]
#[inline]
fn store_int(x: x86::__m512i) -> [i32; LANES] {
    let mut out = [0; LANES];
    // SAFETY: there is room for sixteen values, and any alignment will do.
    unsafe { x86::_mm512_storeu_si512(out.as_mut_ptr().cast(), x) };
    out
}

#[target_feature(enable = "avx512f")]
#[inline]
fn store(x: x86::__m512) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    // SAFETY: there is room for sixteen values, and any alignment will do.
    unsafe { x86::_mm512_storeu_ps(out.as_mut_ptr(), x) };
    out
}
