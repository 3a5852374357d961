//! The fast correlator: sixteen lanes of plain Rust, compiled for three instruction sets.
//!
//! No fused multiply-add that could round otherwise and a fixed order of sums, so that every level gives the same bits.
//! A vector of sixteen samples is turned by the phasor of its first sample only; what is left, the turn within a
//! vector, is the same for every vector and is applied to the sums. Phasors come from powers in `f64` and carry an error
//! of a few 1e-7; code phases of lanes resolve 2⁻²⁷ chip. With AVX-512 chips are looked up sixteen at a time.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

use num_complex::{Complex32, Complex64};

use super::{CODE_BITS, Edge, Nco, Replica, TURN};

const LANES: usize = 16;
/// Vectors whose sums stay in `f32`.
const VECTORS: usize = 64;
const CHUNK: usize = LANES * VECTORS;
/// Fraction bits of a lane's code phase.
const FINE: u32 = 27;
const FINE_MASK: u32 = (1 << FINE) - 1;
/// Entries of a chip table beyond one period.
pub(super) const TABLE_MARGIN: usize = CHUNK + LANES;
/// Steps of the code up to this keep a vector's chips within one register of the table.
#[cfg(target_arch = "x86_64")]
const LOOKUP_STEP: u64 = 15 << (CODE_BITS - 4);

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
struct Job<'a> {
    replica: &'a Replica,
    i: &'a [f32],
    q: &'a [f32],
    nco: Nco,
}

/// Correlates `taps` in groups of three, then one by one. `level` must be one that this processor has.
pub(super) fn correlate<const T: usize>(
    level: Level,
    replica: &Replica,
    i: &[f32],
    q: &[f32],
    nco: &Nco,
    taps: &[i64; T],
) -> [Complex64; T] {
    let length = i.len().min(q.len());
    let job = Job { replica, i: &i[..length], q: &q[..length], nco: *nco };
    let step = nco.code_step as i64;
    // Area edges look at the chip in which the sample's interval ends, and at the one before.
    let ahead = match replica.edge {
        Edge::Area => step - step / 2 - (1 << CODE_BITS),
        Edge::Nearest => 0,
    };
    let begin = |tap: i64| (nco.code + tap + ahead).rem_euclid(replica.period()) as u64;
    let mut sums = [Complex64::ZERO; T];
    let (threes, ones) = taps.as_chunks::<3>();
    let (sums_of_threes, sums_of_ones) = sums.as_chunks_mut::<3>();
    for (taps, sums) in threes.iter().zip(sums_of_threes) {
        *sums = at_level(level, &job, taps.map(begin));
    }
    for (tap, sum) in ones.iter().zip(sums_of_ones) {
        [*sum] = at_level(level, &job, [begin(*tap)]);
    }
    sums
}

fn at_level<const T: usize>(level: Level, job: &Job, begins: [u64; T]) -> [Complex64; T] {
    match (level, job.replica.edge) {
        (Level::Baseline, Edge::Area) => body::<T>(job, begins, lanes::<T, true>),
        (Level::Baseline, Edge::Nearest) => body::<T>(job, begins, lanes::<T, false>),
        // SAFETY: `Level` values beyond the baseline come from `best` (and `all` in tests), which detected the features.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Area) if job.nco.code_step <= LOOKUP_STEP => unsafe {
            body_avx512::<T, true>(job, begins)
        },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Nearest) if job.nco.code_step <= LOOKUP_STEP => unsafe {
            body_avx512::<T, false>(job, begins)
        },
        // SAFETY: as above; `avx512` asks for AVX2 too.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2 | Level::Avx512, Edge::Area) => unsafe { body_avx2::<T, true>(job, begins) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2 | Level::Avx512, Edge::Nearest) => unsafe { body_avx2::<T, false>(job, begins) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
// A closure has the instruction set of its function, `lanes` as a value has not.
#[expect(clippy::redundant_closure)]
fn body_avx2<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    body::<T>(job, begins, |chunk, code| lanes::<T, AREA>(chunk, code))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn body_avx512<const T: usize, const AREA: bool>(job: &Job, begins: [u64; T]) -> [Complex64; T] {
    body::<T>(job, begins, |chunk, code| lanes_avx512::<T, AREA>(chunk, code))
}

/// Up to [`CHUNK`] samples, and what is needed to correlate them.
struct Chunk<'a> {
    replica: &'a Replica,
    steps: &'a Steps,
    i: &'a [f32],
    q: &'a [f32],
    /// Phasor of each vector's first sample.
    cos: [f32; VECTORS],
    sin: [f32; VECTORS],
}

/// How the code moves.
struct Steps {
    lane: [u32; LANES],
    inverse_width: f32,
    advance: u64,
    period: u64,
}

/// Sums of each lane, a tap.
struct Lanes<const T: usize> {
    re: [[f32; LANES]; T],
    im: [[f32; LANES]; T],
}

/// Powers of one phasor.
struct Powers<const N: usize> {
    re: [f64; N],
    im: [f64; N],
}

impl<const N: usize> Powers<N> {
    /// Powers 0 to N − 1 and the N-th; N is a power of two.
    #[inline(always)]
    fn of(base: Complex64) -> (Self, Complex64) {
        let mut powers = Self { re: [1.0; N], im: [0.0; N] };
        let (mut size, mut next) = (1, base);
        while size < N {
            let (low_re, high_re) = powers.re.split_at_mut(size);
            let (low_im, high_im) = powers.im.split_at_mut(size);
            for k in 0..size {
                high_re[k] = low_re[k] * next.re - low_im[k] * next.im;
                high_im[k] = low_re[k] * next.im + low_im[k] * next.re;
            }
            next *= next;
            size *= 2;
        }
        (powers, next)
    }
}

#[inline(always)]
fn body<const T: usize>(
    job: &Job,
    begins: [u64; T],
    lanes: impl Fn(&Chunk, &mut [u64; T]) -> Lanes<T>,
) -> [Complex64; T] {
    let step = job.nco.code_step;
    let fine = CODE_BITS - FINE;
    let width = (step >> fine) as u32;
    let period = job.replica.period() as u64;
    let steps = Steps {
        lane: std::array::from_fn(|k| (step.wrapping_mul(k as u64) >> fine) as u32),
        inverse_width: 1.0 / width.max(1) as f32,
        advance: step.wrapping_mul(LANES as u64) % period,
        period,
    };
    let (within, vector_turn) = Powers::<LANES>::of(phasor(job.nco.carrier_step));
    let (turns, chunk_turn) = Powers::<VECTORS>::of(vector_turn);
    let (turns_re, turns_im) = (turns.re.map(|x| x as f32), turns.im.map(|x| x as f32));
    let mut anchor = phasor(job.nco.carrier);
    let mut code = begins;
    let mut totals = [([0.0_f64; LANES], [0.0_f64; LANES]); T];
    for (i, q) in job.i.chunks(CHUNK).zip(job.q.chunks(CHUNK)) {
        let (re, im) = (anchor.re as f32, anchor.im as f32);
        let mut chunk = Chunk { replica: job.replica, steps: &steps, i, q, cos: [0.0; VECTORS], sin: [0.0; VECTORS] };
        for m in 0..VECTORS {
            chunk.cos[m] = turns_re[m] * re - turns_im[m] * im;
            chunk.sin[m] = turns_re[m] * im + turns_im[m] * re;
        }
        let sums = lanes(&chunk, &mut code);
        for (total, (re, im)) in totals.iter_mut().zip(sums.re.iter().zip(&sums.im)) {
            for k in 0..LANES {
                total.0[k] += f64::from(re[k]);
                total.1[k] += f64::from(im[k]);
            }
        }
        anchor *= chunk_turn;
    }
    totals.map(|(re, im)| {
        (0..LANES).map(|k| Complex64::new(re[k], im[k]) * Complex64::new(within.re[k], -within.im[k])).sum()
    })
}

/// One chunk in plain lanes; the last vector is filled up with zeros.
#[inline(always)]
fn lanes<const T: usize, const AREA: bool>(chunk: &Chunk, code: &mut [u64; T]) -> Lanes<T> {
    let mut sums = Lanes { re: [[0.0; LANES]; T], im: [[0.0; LANES]; T] };
    let (vectors_i, rest_i) = chunk.i.as_chunks::<LANES>();
    let (vectors_q, rest_q) = chunk.q.as_chunks::<LANES>();
    let phasors = || chunk.cos.iter().zip(&chunk.sin);
    for ((&cos, &sin), (i, q)) in phasors().zip(vectors_i.iter().zip(vectors_q)) {
        vector::<T, AREA>(chunk, Complex32::new(cos, sin), i, q, code, &mut sums);
    }
    if let (Some((&cos, &sin)), false) = (phasors().nth(vectors_i.len()), rest_i.is_empty()) {
        vector::<T, AREA>(chunk, Complex32::new(cos, sin), &filled(rest_i), &filled(rest_q), code, &mut sums);
    }
    sums
}

/// Sixteen samples. Every shift and sum of phases wraps on purpose: indices stay below 32 while a chip is not shorter than
/// a sample.
#[inline(always)]
fn vector<const T: usize, const AREA: bool>(
    chunk: &Chunk,
    phasor: Complex32,
    i: &[f32; LANES],
    q: &[f32; LANES],
    code: &mut [u64; T],
    sums: &mut Lanes<T>,
) {
    let steps = chunk.steps;
    let (mut re, mut im) = ([0.0_f32; LANES], [0.0_f32; LANES]);
    for k in 0..LANES {
        re[k] = i[k] * phasor.re + q[k] * phasor.im;
        im[k] = q[k] * phasor.re - i[k] * phasor.im;
    }
    for (code, (sum_re, sum_im)) in code.iter_mut().zip(sums.re.iter_mut().zip(&mut sums.im)) {
        let (chip, fraction) = split(*code);
        let window = chunk.replica.words[chip >> 5].wrapping_shl((chip & 31) as u32);
        let (window, window_after) = ((window >> 32) as u32, (window >> 31) as u32);
        for k in 0..LANES {
            let phase = fraction.wrapping_add(steps.lane[k]);
            let chip = sign(window, phase >> FINE);
            let value = if AREA {
                let share = ((phase & FINE_MASK) as i32 as f32 * steps.inverse_width).min(1.0);
                // The product is exact.
                chip + (sign(window_after, phase >> FINE) - chip) * share
            } else {
                chip
            };
            sum_re[k] += re[k] * value;
            sum_im[k] += im[k] * value;
        }
        *code = wrapped(code.wrapping_add(steps.advance), steps.period);
    }
}

/// The same with chips looked up in tables. The one fused operation has an exact product, so it rounds as [`lanes`] does.
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
    let (values, changes) = (chunk.replica.values.as_slice(), chunk.replica.changes.as_slice());
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
    *code = phases.map(|phase| wrapped(phase, steps.period));
    Lanes { re: sums_re.map(|sum| store(sum)), im: sums_im.map(|sum| store(sum)) }
}

/// Chip and fraction of a code phase.
#[inline(always)]
fn split(code: u64) -> (usize, u32) {
    ((code >> CODE_BITS) as usize, (code >> (CODE_BITS - FINE)) as u32 & FINE_MASK)
}

/// A code phase below `period`; few periods are taken off.
#[inline(always)]
fn wrapped(mut code: u64, period: u64) -> u64 {
    while code >= period {
        code -= period;
    }
    code
}

#[inline(always)]
fn filled(rest: &[f32]) -> [f32; LANES] {
    let mut all = [0.0; LANES];
    all[..rest.len()].copy_from_slice(rest);
    all
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

/// −1 where that chip of the window is a logical 1.
#[inline(always)]
fn sign(window: u32, index: u32) -> f32 {
    f32::from_bits(0x3f80_0000 ^ (window.wrapping_shl(index) & 0x8000_0000))
}

/// e^{jθ} of a phase in 2⁻⁶⁴ turns.
fn phasor(turns: u64) -> Complex64 {
    let (sin, cos) = libm::sincos(turns as i64 as f64 / TURN * std::f64::consts::TAU);
    Complex64::new(cos, sin)
}
