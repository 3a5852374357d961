//! Groups of pieces eight at a time with AVX2, and running sums; elsewhere [`super::lanes`].
//!
//! Sums lie as (in-phase, quadrature) pairs, four to a register. Phasors and positions of a chunk are made
//! first: so every loop has few values at hand, and runs that do not wait for each other. No operation is
//! fused, so the bits are those of the plain twin.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

use super::super::fixed::POINT_BITS;
use super::super::kernel::Level;
use super::lanes::{self, Chunk, Products};
#[cfg(target_arch = "x86_64")]
use super::lanes::{PLACE_BITS, PRODUCT_BITS, SINE, TURNS, WINDOW_TAPS};
#[cfg(target_arch = "x86_64")]
use super::{GROUP, GROUPS};

/// Adds the products of a chunk. Groups `inner` go by windows: early, prompt and late come first, a sample
/// apart at most, with two samples on either side of every position; `level` must be one that this processor
/// has.
pub(super) fn add<const T: usize>(level: Level, chunk: &Chunk<T>, inner: [usize; 2], products: &mut Products<T>) {
    let ([from, to], all) = (inner, chunk.starts.len());
    match level {
        Level::Baseline => {
            lanes::anywhere(chunk, (0, from), products);
            lanes::window(chunk, (from, to), products);
            lanes::anywhere(chunk, (to, all), products);
        }
        // SAFETY: `Level` values beyond the baseline come from `best` (and `all` in tests), which detected
        // AVX2.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe {
            groups::<T, false>(chunk, (0, from), products);
            groups::<T, true>(chunk, (from, to), products);
            groups::<T, false>(chunk, (to, all), products);
        },
    }
}

/// Fills `entries`, one more than samples, with the sums of the samples before each: halves are summed as
/// integers.
pub(in super::super) fn running_sums(level: Level, i: &[f32], q: &[f32], entries: &mut [[i32; 2]]) {
    let done = match level {
        Level::Baseline => Done { samples: 0, halves: [0; 2] },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { running_sums_avx2(i, q, entries) },
    };
    let mut halves = done.halves;
    if let Some(first) = entries.first_mut() {
        *first = [0; 2];
    }
    let rest = i.iter().zip(q).zip(entries.iter_mut().skip(1)).skip(done.samples);
    for ((i, q), entry) in rest {
        halves = [halves[0].wrapping_add((2.0 * i) as i32), halves[1].wrapping_add((2.0 * q) as i32)];
        *entry = halves;
    }
}

/// Number of samples summed so far, and the sums there.
struct Done {
    samples: usize,
    halves: [i32; 2],
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn running_sums_avx2(i: &[f32], q: &[f32], entries: &mut [[i32; 2]]) -> Done {
    let (fours_i, fours_q) = (i.as_chunks::<4>().0, q.as_chunks::<4>().0);
    let fours = entries.get_mut(1..).unwrap_or_default().as_chunks_mut::<4>().0;
    let last = x86::_mm256_setr_epi32(6, 7, 6, 7, 6, 7, 6, 7);
    let none = x86::_mm256_setzero_si256();
    let mut before = none;
    let mut samples = 0;
    for ((i, q), out) in fours_i.iter().zip(fours_q).zip(fours) {
        // SAFETY: four values are at either, and any alignment will do.
        let (i, q) = unsafe { (x86::_mm_loadu_ps(i.as_ptr()), x86::_mm_loadu_ps(q.as_ptr())) };
        let pairs = x86::_mm256_insertf128_ps::<1>(
            x86::_mm256_castps128_ps256(x86::_mm_unpacklo_ps(i, q)),
            x86::_mm_unpackhi_ps(i, q),
        );
        let one = x86::_mm256_cvttps_epi32(x86::_mm256_add_ps(pairs, pairs));
        let two = x86::_mm256_add_epi32(one, x86::_mm256_slli_si256::<8>(one));
        // The upper half gets what the lower one adds up to.
        let lower = x86::_mm256_blend_epi32::<0x0f>(x86::_mm256_permute4x64_epi64::<0x50>(two), none);
        let four = x86::_mm256_add_epi32(two, lower);
        let sums = x86::_mm256_add_epi32(four, before);
        before = x86::_mm256_add_epi32(before, x86::_mm256_permutevar8x32_epi32(four, last));
        // SAFETY: there is room for four pairs, and any alignment will do.
        unsafe { x86::_mm256_storeu_si256(out.as_mut_ptr().cast(), sums) };
        samples += 4;
    }
    let pair = x86::_mm256_castsi256_si128(before);
    Done { samples, halves: [x86::_mm_extract_epi32::<0>(pair), x86::_mm_extract_epi32::<1>(pair)] }
}

/// Fills `entries` with the running sums of samples in 16 bits.
pub(in super::super) fn running_sums_of_fixed(level: Level, i: &[i16], q: &[i16], entries: &mut [[i32; 2]]) {
    const DOWN: u32 = POINT_BITS - 1;
    let done = match level {
        Level::Baseline => Done { samples: 0, halves: [0; 2] },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { running_sums_of_fixed_avx2(i, q, entries) },
    };
    let mut halves = done.halves;
    if let Some(first) = entries.first_mut() {
        *first = [0; 2];
    }
    let rest = i.iter().zip(q).zip(entries.iter_mut().skip(1)).skip(done.samples);
    for ((i, q), entry) in rest {
        halves = [halves[0].wrapping_add(i32::from(i >> DOWN)), halves[1].wrapping_add(i32::from(q >> DOWN))];
        *entry = halves;
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn running_sums_of_fixed_avx2(i: &[i16], q: &[i16], entries: &mut [[i32; 2]]) -> Done {
    const DOWN: i32 = POINT_BITS as i32 - 1;
    const EACH: usize = 16;
    let (all_i, all_q) = (i.as_chunks::<EACH>().0, q.as_chunks::<EACH>().0);
    let rooms = entries.get_mut(1..).unwrap_or_default().as_chunks_mut::<EACH>().0;
    let last = x86::_mm256_setr_epi32(6, 7, 6, 7, 6, 7, 6, 7);
    let mut before = x86::_mm256_setzero_si256();
    let mut samples = 0;
    for ((i, q), room) in all_i.iter().zip(all_q).zip(rooms) {
        // SAFETY: sixteen values are at either, and any alignment will do.
        let planes =
            unsafe { [x86::_mm256_loadu_si256(i.as_ptr().cast()), x86::_mm256_loadu_si256(q.as_ptr().cast())] };
        // Sums of up to eight halves, which 16 bits hold.
        let mut summed = planes;
        for plane in &mut summed {
            let one = x86::_mm256_srai_epi16::<DOWN>(*plane);
            let two = x86::_mm256_add_epi16(one, x86::_mm256_slli_si256::<2>(one));
            let four = x86::_mm256_add_epi16(two, x86::_mm256_slli_si256::<4>(two));
            *plane = x86::_mm256_add_epi16(four, x86::_mm256_slli_si256::<8>(four));
        }
        let (low, high) =
            (x86::_mm256_unpacklo_epi16(summed[0], summed[1]), x86::_mm256_unpackhi_epi16(summed[0], summed[1]));
        let eights = [
            [x86::_mm256_castsi256_si128(low), x86::_mm256_castsi256_si128(high)],
            [x86::_mm256_extracti128_si256::<1>(low), x86::_mm256_extracti128_si256::<1>(high)],
        ];
        let rooms = room.as_chunks_mut::<8>().0;
        for (eight, room) in eights.iter().zip(rooms) {
            let (first, second) = (x86::_mm256_cvtepi16_epi32(eight[0]), x86::_mm256_cvtepi16_epi32(eight[1]));
            let out = room.as_mut_ptr().cast::<x86::__m256i>();
            // SAFETY: there is room for eight pairs, and any alignment will do.
            unsafe {
                x86::_mm256_storeu_si256(out, x86::_mm256_add_epi32(first, before));
                x86::_mm256_storeu_si256(out.add(1), x86::_mm256_add_epi32(second, before));
            }
            before = x86::_mm256_add_epi32(before, x86::_mm256_permutevar8x32_epi32(second, last));
        }
        samples += EACH;
    }
    let pair = x86::_mm256_castsi256_si128(before);
    Done { samples, halves: [x86::_mm_extract_epi32::<0>(pair), x86::_mm_extract_epi32::<1>(pair)] }
}

/// Values of a group that are made before its samples are read.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Made {
    cos: [f32; GROUP],
    sin: [f32; GROUP],
    places: [u32; GROUP],
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn groups<const T: usize, const WINDOW: bool>(
    chunk: &Chunk<T>,
    (from, to): (usize, usize),
    products: &mut Products<T>,
) {
    let count = to.saturating_sub(from);
    if count == 0 {
        return;
    }
    let mut made = [const { std::mem::MaybeUninit::<Made>::uninit() }; GROUPS];
    let made = make(chunk, (from, to), &mut products.last, &mut made);
    let (mut cos, mut sin) = ([x86::_mm256_setzero_ps(); T], [x86::_mm256_setzero_ps(); T]);
    if WINDOW {
        windows(chunk, made, &mut cos, &mut sin);
    }
    each_tap(chunk, made, if WINDOW { WINDOW_TAPS } else { 0 }, &mut cos, &mut sin);
    for t in 0..T {
        for (sums, own) in [(&mut products.cos[t], cos[t]), (&mut products.sin[t], sin[t])] {
            // SAFETY: eight values are there, and any alignment will do.
            unsafe {
                let sum = x86::_mm256_add_ps(x86::_mm256_loadu_ps(sums.as_ptr()), own);
                x86::_mm256_storeu_ps(sums.as_mut_ptr(), sum);
            }
        }
    }
}

/// Positions of the groups' starts, and by how much the replica times the phasor changes there.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn make<'a, const T: usize>(
    chunk: &Chunk<T>,
    (from, to): (usize, usize),
    last: &mut [f32; 2],
    room: &'a mut [std::mem::MaybeUninit<Made>; GROUPS],
) -> &'a [Made] {
    let (phase, phase_a_step) =
        (x86::_mm256_set1_epi32(chunk.phase as i32), x86::_mm256_set1_epi32(chunk.phase_a_step as i32));
    let (place, samples_a_step) =
        (x86::_mm256_set1_epi64x(chunk.place), x86::_mm256_set1_epi64x(i64::from(chunk.samples_a_step)));
    let along = x86::_mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6);
    let mut before = last.map(|part| x86::_mm256_set1_ps(part));
    let groups = chunk.starts[from..to].iter().zip(&chunk.middles[from..to]).zip(&chunk.levels[from..to]);
    let mut filled = 0;
    for (((starts, middles), levels), made) in groups.zip(room.iter_mut()) {
        // SAFETY: eight values are at each, and any alignment will do.
        let (starts, middles, levels) = unsafe {
            (
                x86::_mm256_loadu_si256(starts.as_ptr().cast()),
                x86::_mm256_loadu_si256(middles.as_ptr().cast()),
                x86::_mm256_loadu_ps(levels.as_ptr()),
            )
        };
        let turned = x86::_mm256_add_epi32(phase, x86::_mm256_mullo_epi32(middles, phase_a_step));
        let now = phasors(turned).map(|part| x86::_mm256_mul_ps(part, levels));
        let moved = now.map(|part| {
            x86::_mm256_castsi256_ps(x86::_mm256_permutevar8x32_epi32(x86::_mm256_castps_si256(part), along))
        });
        let changes = [0, 1].map(|c| x86::_mm256_sub_ps(x86::_mm256_blend_ps::<1>(moved[c], before[c]), now[c]));
        before = moved;
        let even = x86::_mm256_add_epi64(x86::_mm256_mul_epu32(starts, samples_a_step), place);
        let odd = x86::_mm256_srli_epi64::<32>(starts);
        let odd = x86::_mm256_add_epi64(x86::_mm256_mul_epu32(odd, samples_a_step), place);
        const DOWN: i32 = (PRODUCT_BITS - PLACE_BITS) as i32;
        let places = x86::_mm256_blend_epi32::<0xaa>(
            x86::_mm256_srli_epi64::<DOWN>(even),
            x86::_mm256_slli_epi64::<{ 32 - DOWN }>(odd),
        );
        let made = made.as_mut_ptr();
        // SAFETY: `made` points at room for three times eight values.
        unsafe {
            x86::_mm256_storeu_ps((&raw mut (*made).cos).cast(), changes[0]);
            x86::_mm256_storeu_ps((&raw mut (*made).sin).cast(), changes[1]);
            x86::_mm256_storeu_si256((&raw mut (*made).places).cast(), places);
        }
        filled += 1;
    }
    *last = before.map(|part| x86::_mm256_cvtss_f32(part));
    // SAFETY: so many were filled just now.
    unsafe { std::slice::from_raw_parts(room.as_ptr().cast(), filled) }
}

/// [`lanes::phasor`] of eight phases.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn phasors(phase: x86::__m256i) -> [x86::__m256; 2] {
    let (sign, quarter) = (x86::_mm256_set1_ps(-0.0), x86::_mm256_set1_ps(0.25));
    let turns = x86::_mm256_mul_ps(x86::_mm256_cvtepi32_ps(phase), x86::_mm256_set1_ps(TURNS));
    let rising = x86::_mm256_sub_ps(quarter, x86::_mm256_andnot_ps(sign, turns));
    let folded = x86::_mm256_sub_ps(quarter, x86::_mm256_andnot_ps(sign, rising));
    let folded = x86::_mm256_or_ps(folded, x86::_mm256_and_ps(sign, turns));
    [sines(rising), sines(folded)]
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn sines(y: x86::__m256) -> x86::__m256 {
    let z = x86::_mm256_mul_ps(y, y);
    let [a, b, c, d] = SINE.map(|factor| x86::_mm256_set1_ps(factor));
    let sum = x86::_mm256_add_ps(c, x86::_mm256_mul_ps(z, d));
    let sum = x86::_mm256_add_ps(b, x86::_mm256_mul_ps(z, sum));
    let sum = x86::_mm256_add_ps(a, x86::_mm256_mul_ps(z, sum));
    x86::_mm256_mul_ps(y, sum)
}

/// Fractions behind the points of eight positions.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn fractions(places: x86::__m256i) -> x86::__m256 {
    let bits = x86::_mm256_srli_epi32::<{ (16 + PLACE_BITS - 23) as i32 }>(x86::_mm256_slli_epi32::<16>(places));
    let with_one = x86::_mm256_or_si256(bits, x86::_mm256_set1_epi32(0x3f80_0000));
    x86::_mm256_sub_ps(x86::_mm256_castsi256_ps(with_one), x86::_mm256_set1_ps(1.0))
}

/// The difference of two sums.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn less(a: x86::__m256i, b: x86::__m256i) -> x86::__m256 {
    x86::_mm256_cvtepi32_ps(x86::_mm256_sub_epi32(a, b))
}

/// Half a group, each value twice.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn twice(half: usize, values: x86::__m256) -> x86::__m256 {
    if half == 0 { x86::_mm256_unpacklo_ps(values, values) } else { x86::_mm256_unpackhi_ps(values, values) }
}

/// The entries of half a group's positions, and those after them.
///
/// # Safety
/// `entries` and two pairs from each position on must be within one allocation.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
unsafe fn two(entries: *const [i32; 2], places: &[u32; GROUP], half: usize) -> [x86::__m256i; 2] {
    let at = |piece: usize| {
        // SAFETY: a position that is there. Volatile, or the compiler would take it from a register in two
        // steps on one port.
        let place = unsafe { std::ptr::read_volatile(&raw const places[piece]) } >> PLACE_BITS;
        // SAFETY: the caller's.
        unsafe { x86::_mm_loadu_si128(entries.wrapping_add(place as usize).cast()) }
    };
    let pair =
        |piece: usize| x86::_mm256_inserti128_si256::<1>(x86::_mm256_castsi128_si256(at(piece)), at(piece + GROUP / 2));
    let (a, b) = (pair(2 * half), pair(2 * half + 1));
    [x86::_mm256_unpacklo_epi64(a, b), x86::_mm256_unpackhi_epi64(a, b)]
}

/// Offset that is subtracted from all entries, four times.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn bases<const T: usize>(chunk: &Chunk<T>) -> x86::__m256i {
    let [i, q] = chunk.base;
    x86::_mm256_setr_epi32(i, q, i, q, i, q, i, q)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn each_tap<const T: usize>(
    chunk: &Chunk<T>,
    made: &[Made],
    first_tap: usize,
    cos: &mut [x86::__m256; T],
    sin: &mut [x86::__m256; T],
) {
    let base = bases(chunk);
    let entries = chunk.sums.entries().as_ptr().wrapping_offset(chunk.origin);
    let [first, last] = chunk.bounds.map(|bound| x86::_mm256_set1_epi32(bound));
    for t in first_tap..T {
        let tap = x86::_mm256_set1_epi32(chunk.taps[t]);
        let (mut by_cos, mut by_sin) = (cos[t], sin[t]);
        for made in made {
            // SAFETY: eight values are at each, and any alignment will do.
            let (places, change_cos, change_sin) = unsafe {
                (
                    x86::_mm256_loadu_si256(made.places.as_ptr().cast()),
                    x86::_mm256_loadu_ps(made.cos.as_ptr()),
                    x86::_mm256_loadu_ps(made.sin.as_ptr()),
                )
            };
            let places = x86::_mm256_add_epi32(places, tap);
            let places = x86::_mm256_min_epi32(x86::_mm256_max_epi32(places, first), last);
            let mut held = [0_u32; GROUP];
            // SAFETY: there is room for eight values.
            unsafe { x86::_mm256_storeu_si256(held.as_mut_ptr().cast(), places) };
            let f = fractions(places);
            for half in 0..2 {
                // SAFETY: positions are held between the first entry and that after the last sample, beyond
                // which there is one more.
                let [a, b] = unsafe { two(entries, &held, half) };
                let part = x86::_mm256_mul_ps(twice(half, f), less(b, a));
                let value = x86::_mm256_add_ps(less(a, base), part);
                by_cos = x86::_mm256_add_ps(by_cos, x86::_mm256_mul_ps(twice(half, change_cos), value));
                by_sin = x86::_mm256_add_ps(by_sin, x86::_mm256_mul_ps(twice(half, change_sin), value));
            }
        }
        (cos[t], sin[t]) = (by_cos, by_sin);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn windows<const T: usize>(chunk: &Chunk<T>, made: &[Made], cos: &mut [x86::__m256; T], sin: &mut [x86::__m256; T]) {
    let base = bases(chunk);
    let entries = chunk.sums.entries().as_ptr().wrapping_offset(chunk.origin - 1);
    let (one, none, apart) = (x86::_mm256_set1_ps(1.0), x86::_mm256_setzero_ps(), x86::_mm256_set1_ps(chunk.apart));
    for made in made {
        // SAFETY: eight values are at each, and any alignment will do.
        let (places, change_cos, change_sin) = unsafe {
            (
                x86::_mm256_loadu_si256(made.places.as_ptr().cast()),
                x86::_mm256_loadu_ps(made.cos.as_ptr()),
                x86::_mm256_loadu_ps(made.sin.as_ptr()),
            )
        };
        let f = fractions(places);
        let (early, late) = (x86::_mm256_sub_ps(f, apart), x86::_mm256_add_ps(f, apart));
        let shares = [
            x86::_mm256_max_ps(early, none),
            x86::_mm256_min_ps(early, none),
            x86::_mm256_min_ps(late, one),
            x86::_mm256_max_ps(x86::_mm256_sub_ps(late, one), none),
        ];
        for half in 0..2 {
            // SAFETY: the caller's groups have two entries on either side of every position.
            let ([s0, s1], [s2, s3]) =
                unsafe { (two(entries, &made.places, half), two(entries.wrapping_add(2), &made.places, half)) };
            let (before, here, after) = (less(s1, s0), less(s2, s1), less(s3, s2));
            let begun = less(s1, base);
            let of = |share: usize, part| x86::_mm256_mul_ps(twice(half, shares[share]), part);
            let values = [
                x86::_mm256_add_ps(begun, x86::_mm256_add_ps(of(0, here), of(1, before))),
                x86::_mm256_add_ps(begun, x86::_mm256_mul_ps(twice(half, f), here)),
                x86::_mm256_add_ps(begun, x86::_mm256_add_ps(of(2, here), of(3, after))),
            ];
            let (change_cos, change_sin) = (twice(half, change_cos), twice(half, change_sin));
            for (value, (cos, sin)) in values.into_iter().zip(cos.iter_mut().zip(sin.iter_mut())) {
                *cos = x86::_mm256_add_ps(*cos, x86::_mm256_mul_ps(change_cos, value));
                *sin = x86::_mm256_add_ps(*sin, x86::_mm256_mul_ps(change_sin, value));
            }
        }
    }
}
