//! The fast correlators compiled for three instruction sets, and all that is written for one of them.
//!
//! [`single`] and [`short`] are plain Rust for any processor and for AVX2. With AVX-512 chips are looked up
//! in tables, sixteen or thirty-two at a time. Every level gives the same bits.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

use num_complex::Complex64;

use super::carrier::LANES;
#[cfg(target_arch = "x86_64")]
use super::carrier::filled;
#[cfg(target_arch = "x86_64")]
use super::pattern::Table;
use super::short::{self, GROUP};
use super::single::{self, CHUNK};
#[cfg(target_arch = "x86_64")]
use super::single::{Chunk, FINE, FINE_MASK, Lanes, split};
use super::{CODE_BITS, Edge, Nco, Pattern};

/// Entries of a chip table beyond one period.
pub(super) const TABLE_MARGIN: usize = CHUNK + LANES;
/// The same of a table of short integers.
pub(super) const SHORT_MARGIN: usize = GROUP;
/// Steps of the code up to this keep a vector's chips within one register of the table.
#[cfg(target_arch = "x86_64")]
const LOOKUP_STEP: u64 = 15 << (CODE_BITS - 4);

/// Taps that share one pass, which unpacks the samples and wipes the carrier off once: the sums of five and
/// what they need fit the registers of AVX-512 but for a few.
const AT_ONCE: usize = 5;

/// What the fast correlators compute in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fast {
    /// `short`, or `single` where the code's step does not suit it.
    Short,
    Single,
}

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::receiver) enum Level {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// What this processor can run, the best last.
    #[cfg(test)]
    pub(in crate::receiver) fn all() -> Vec<Self> {
        let mut levels = vec![Self::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") {
                levels.push(Self::Avx2);
            }
            if avx512() {
                levels.push(Self::Avx512);
            }
        }
        levels
    }

    /// The best that this processor can run.
    pub(in crate::receiver) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if avx512() {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }
}

#[cfg(target_arch = "x86_64")]
fn avx512() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

/// Samples and replica of one call.
pub(super) struct Job<'a> {
    pub replica: &'a Pattern,
    pub i: &'a [f32],
    pub q: &'a [f32],
    pub nco: Nco,
    /// In 16 bits, if asked for and possible.
    short: Option<short::Steps>,
}

/// Correlates `taps`, those of up to [`AT_ONCE`] in one pass over the samples, more in passes of three and of
/// what is left. `level` must be one that this processor has.
pub(super) fn correlate<const T: usize>(
    level: Level,
    fast: Fast,
    replica: &Pattern,
    (i, q): (&[f32], &[f32]),
    nco: &Nco,
    taps: &[i64; T],
) -> [Complex64; T] {
    let length = i.len().min(q.len());
    let short = match fast {
        Fast::Short => short::Steps::new(replica, nco.code_step),
        Fast::Single => None,
    };
    let job = Job { replica, i: &i[..length], q: &q[..length], nco: *nco, short };
    let step = nco.code_step as i64;
    // Area edges look at the chip in which the sample's interval ends, and at the one before.
    let ahead = match replica.edge {
        Edge::Area => step - step / 2 - (1 << CODE_BITS),
        Edge::Nearest => 0,
    };
    let period = replica.period();
    let code = (nco.code + ahead).rem_euclid(period) as u64;
    let begin = |tap: i64| {
        let tap = if (0..period).contains(&tap) { tap } else { tap.rem_euclid(period) };
        // Both are below 2⁶³.
        wrapped(code + tap as u64, period as u64)
    };
    if T <= AT_ONCE {
        return at_level(level, &job, taps.map(begin));
    }
    let mut sums = [Complex64::ZERO; T];
    let (threes, rest) = taps.as_chunks::<3>();
    let (sums_of_threes, sums_of_rest) = sums.as_chunks_mut::<3>();
    let (twos, ones) = rest.as_chunks::<2>();
    let (sums_of_twos, sums_of_ones) = sums_of_rest.as_chunks_mut::<2>();
    for (taps, sums) in threes.iter().zip(sums_of_threes) {
        *sums = at_level(level, &job, taps.map(begin));
    }
    for (taps, sums) in twos.iter().zip(sums_of_twos) {
        *sums = at_level(level, &job, taps.map(begin));
    }
    for (tap, sum) in ones.iter().zip(sums_of_ones) {
        [*sum] = at_level(level, &job, [begin(*tap)]);
    }
    sums
}

fn at_level<const T: usize>(level: Level, job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match (level, job.replica.edge) {
        (Level::Baseline, Edge::Area) => plain::<T, true>(job, begins),
        (Level::Baseline, Edge::Nearest) => plain::<T, false>(job, begins),
        // SAFETY: `Level` values beyond the baseline come from `best` (and `all` in tests), which detected
        // the features.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2, Edge::Area) => unsafe { plain_avx2::<T, true>(job, begins) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2, Edge::Nearest) => unsafe { plain_avx2::<T, false>(job, begins) },
        // SAFETY: as above; `avx512` asks for AVX2 too.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Area) => unsafe { avx512_or_less::<T, true>(job, begins) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Nearest) => unsafe { avx512_or_less::<T, false>(job, begins) },
    }
}

fn plain<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match &job.short {
        Some(steps) => short::body(job, steps, begins, short::lanes::<T, AREA>),
        None => single::body(job, begins, single::lanes::<T, AREA>),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
// A closure has the instruction set of its function, `lanes` as a value has not.
#[expect(clippy::redundant_closure)]
fn plain_avx2<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match &job.short {
        Some(steps) => short::body(job, steps, begins, |chunk, code| short::lanes::<T, AREA>(chunk, code)),
        None => single::body(job, begins, |chunk, code| single::lanes::<T, AREA>(chunk, code)),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2")]
fn avx512_or_less<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match &job.short {
        Some(steps) => short_avx512::<T, AREA>(job, steps, begins),
        None if job.nco.code_step <= LOOKUP_STEP => single_avx512::<T, AREA>(job, begins),
        None => plain_avx2::<T, AREA>(job, begins),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn single_avx512<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    single::body(job, begins, |chunk, code| lanes_avx512::<T, AREA>(chunk, code))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn short_avx512<const T: usize, const AREA: bool>(job: &Job, steps: &short::Steps, begins: [u64; T]) -> [Complex64; T] {
    short::body(job, steps, begins, |chunk, code| short_lanes_avx512::<T, AREA>(chunk, code))
}

/// [`short::lanes`] with chips looked up in tables.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
#[inline]
fn short_lanes_avx512<const T: usize, const AREA: bool>(chunk: &short::Chunk, code: &mut [u64; T]) -> short::Sums<T> {
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
        let (i, q) = (fixed_avx512(i), fixed_avx512(q));
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
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn fixed_avx512(x: &[f32; GROUP]) -> x86::__m512i {
    let align = x86::_mm512_set1_ps(short::ALIGN);
    // SAFETY: thirty-two values are there, and any alignment will do.
    let (first, second) = unsafe { (x86::_mm512_loadu_ps(x.as_ptr()), x86::_mm512_loadu_ps(x.as_ptr().add(LANES))) };
    let first = x86::_mm512_castps_si512(x86::_mm512_add_ps(first, align));
    let second = x86::_mm512_castps_si512(x86::_mm512_add_ps(second, align));
    x86::_mm512_mask_blend_epi16(0xaaaa_aaaa, first, x86::_mm512_slli_epi32::<16>(second))
}

/// [`single::lanes`] with chips looked up in tables. The one fused operation has an exact product, so it
/// rounds as [`single::lanes`] does.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
#[inline]
fn lanes_avx512<const T: usize, const AREA: bool>(chunk: &Chunk, code: &mut [u64; T]) -> Lanes<T> {
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

/// A code phase below `period`; few periods are taken off.
#[inline(always)]
pub(super) fn wrapped(mut code: u64, period: u64) -> u64 {
    while code >= period {
        code -= period;
    }
    code
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn load(x: &[f32; LANES]) -> x86::__m512 {
    // SAFETY: sixteen values are there, and any alignment will do.
    unsafe { x86::_mm512_loadu_ps(x.as_ptr()) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn load_u32(x: &[u32; LANES]) -> x86::__m512i {
    // SAFETY: as `load`.
    unsafe { x86::_mm512_loadu_si512(x.as_ptr().cast()) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn load_lanes(x: &[[u16; 2]; LANES]) -> x86::__m512i {
    // SAFETY: as `load`.
    unsafe { x86::_mm512_loadu_si512(x.as_ptr().cast()) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn store_int(x: x86::__m512i) -> [i32; LANES] {
    let mut out = [0; LANES];
    // SAFETY: there is room for sixteen values, and any alignment will do.
    unsafe { x86::_mm512_storeu_si512(out.as_mut_ptr().cast(), x) };
    out
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn store(x: x86::__m512) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    // SAFETY: there is room for sixteen values, and any alignment will do.
    unsafe { x86::_mm512_storeu_ps(out.as_mut_ptr(), x) };
    out
}

/// Σ |x|², in sixteen lanes of 64 terms each in `f32`, the rest in `f64`.
pub(super) fn power(level: Level, i: &[f32], q: &[f32]) -> f64 {
    match level {
        Level::Baseline => power_lanes(i, q),
        // SAFETY: as in `at_level`.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { power_avx2(i, q) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn power_avx2(i: &[f32], q: &[f32]) -> f64 {
    power_lanes(i, q)
}

#[inline(always)]
fn power_lanes(i: &[f32], q: &[f32]) -> f64 {
    let mut total = 0.0;
    for (i, q) in i.chunks(CHUNK).zip(q.chunks(CHUNK)) {
        let (vectors_i, rest_i) = i.as_chunks::<LANES>();
        let (vectors_q, rest_q) = q.as_chunks::<LANES>();
        let mut lanes = [0.0_f32; LANES];
        for (i, q) in vectors_i.iter().zip(vectors_q) {
            for k in 0..LANES {
                lanes[k] += i[k] * i[k] + q[k] * q[k];
            }
        }
        for (lane, (i, q)) in lanes.iter_mut().zip(rest_i.iter().zip(rest_q)) {
            *lane += i * i + q * q;
        }
        total += lanes.iter().map(|&x| f64::from(x)).sum::<f64>();
    }
    total
}

/// Σ i² + q² of short integers within ±2048.
pub(super) fn fixed_power(level: Level, i: &[i16], q: &[i16]) -> f64 {
    match level {
        Level::Baseline => fixed_power_lanes(i, q),
        // SAFETY: as in `at_level`.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { fixed_power_avx2(i, q) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fixed_power_avx2(i: &[i16], q: &[i16]) -> f64 {
    fixed_power_lanes(i, q)
}

#[inline(always)]
fn fixed_power_lanes(i: &[i16], q: &[i16]) -> f64 {
    let mut total = 0_u64;
    for plane in [i, q] {
        // 128 squares up to 2²² stay below 2³².
        for part in plane.chunks(128) {
            let mut sum = 0_u32;
            for &x in part {
                sum = sum.wrapping_add((i32::from(x) * i32::from(x)) as u32);
            }
            total += u64::from(sum);
        }
    }
    total as f64
}
/// Sixteen numbers by their parts.
type Parts<'a> = [&'a [f64; LANES]; 2];

/// The sum of sixteen numbers, each turned back by its turn. A loop over lanes within one over taps would be
/// made into one over taps, with gathered numbers.
#[inline(always)]
pub(super) fn fold(numbers: Parts<'_>, turns: Parts<'_>) -> Complex64 {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { fold_avx2(numbers, turns) };
    }
    fold_plain(numbers, turns)
}

pub(super) fn fold_plain([re, im]: Parts<'_>, [turn_re, turn_im]: Parts<'_>) -> Complex64 {
    let (mut turned_re, mut turned_im) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        turned_re[k] = re[k] * turn_re[k] + im[k] * turn_im[k];
        turned_im[k] = im[k] * turn_re[k] - re[k] * turn_im[k];
    }
    Complex64::new(sum(turned_re), sum(turned_im))
}

/// Halves added to each other until one is left.
#[inline(always)]
fn sum(mut x: [f64; LANES]) -> f64 {
    let mut half = LANES / 2;
    while half > 0 {
        for k in 0..half {
            x[k] += x[k + half];
        }
        half /= 2;
    }
    x[0]
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn fold_avx2([re, im]: Parts<'_>, [turn_re, turn_im]: Parts<'_>) -> Complex64 {
    let mut re_sums = [x86::_mm256_setzero_pd(); 4];
    let mut im_sums = [x86::_mm256_setzero_pd(); 4];
    for k in 0..4 {
        // SAFETY: four numbers are at each, and any alignment will do.
        let [re, im, turn_re, turn_im] =
            [re, im, turn_re, turn_im].map(|of| unsafe { x86::_mm256_loadu_pd(of.as_ptr().add(4 * k)) });
        re_sums[k] = x86::_mm256_add_pd(x86::_mm256_mul_pd(re, turn_re), x86::_mm256_mul_pd(im, turn_im));
        im_sums[k] = x86::_mm256_sub_pd(x86::_mm256_mul_pd(im, turn_re), x86::_mm256_mul_pd(re, turn_im));
    }
    Complex64::new(sum_avx2(re_sums), sum_avx2(im_sums))
}

/// [`sum`] of four by four numbers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn sum_avx2(fours: [x86::__m256d; 4]) -> f64 {
    let eight = [x86::_mm256_add_pd(fours[0], fours[2]), x86::_mm256_add_pd(fours[1], fours[3])];
    let four = x86::_mm256_add_pd(eight[0], eight[1]);
    let two = x86::_mm_add_pd(x86::_mm256_castpd256_pd128(four), x86::_mm256_extractf128_pd::<1>(four));
    x86::_mm_cvtsd_f64(x86::_mm_add_sd(two, x86::_mm_unpackhi_pd(two, two)))
}
