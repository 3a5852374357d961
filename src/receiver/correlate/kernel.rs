//! The fast correlator: sixteen lanes of plain Rust, compiled for three instruction sets.
//!
//! No fused multiply-add and a fixed order of sums, so that every level gives the same bits. Carrier phasors turn in
//! `f32` and are anchored in `f64` every 1024 samples (error below 1e-6 cycle); code phases of lanes resolve 2⁻²⁷ chip.

use num_complex::Complex64;

use super::{CODE_BITS, Edge, Nco, Replica, Sums, TURN};

const LANES: usize = 16;
/// Samples between anchors of the carrier; also the longest sum in `f32`, per lane 64 terms.
const CHUNK: usize = 1024;
/// Fraction bits of a lane's code phase.
const FINE: u32 = 27;
const FINE_MASK: u32 = (1 << FINE) - 1;

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// What this processor can run, the best last.
    #[cfg(test)]
    pub(super) fn all() -> Vec<Self> {
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
    pub(super) fn best() -> Self {
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
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

/// Samples and replica of one call.
struct Job<'a> {
    words: &'a [u64],
    period: u64,
    i: &'a [f32],
    q: &'a [f32],
    nco: Nco,
}

/// Correlates `taps` in groups of three, then one by one. `level` must be one that this processor has.
pub(super) fn run(level: Level, replica: &Replica, i: &[f32], q: &[f32], nco: &Nco, taps: &[i64]) -> Sums {
    let length = i.len().min(q.len());
    let period = replica.period();
    let job = Job { words: &replica.words, period: period as u64, i: &i[..length], q: &q[..length], nco: *nco };
    let half = match replica.edge {
        Edge::Area => (nco.code_step / 2) as i64,
        Edge::Nearest => 0,
    };
    let starts: Vec<u64> = taps.iter().map(|tap| (nco.code + tap - half).rem_euclid(period) as u64).collect();
    let mut sums = Sums { taps: Vec::with_capacity(taps.len()), power: 0.0 };
    let (threes, ones) = starts.as_chunks::<3>();
    for three in threes {
        let (out, power) = at_level(level, replica.edge, &job, *three);
        sums.taps.extend(out);
        sums.power = power;
    }
    for &one in ones {
        let (out, power) = at_level(level, replica.edge, &job, [one]);
        sums.taps.extend(out);
        sums.power = power;
    }
    sums
}

type Output<const T: usize> = ([Complex64; T], f64);

fn at_level<const T: usize>(level: Level, edge: Edge, job: &Job, starts: [u64; T]) -> Output<T> {
    match (level, edge) {
        (Level::Baseline, Edge::Area) => body::<T, true>(job, starts),
        (Level::Baseline, Edge::Nearest) => body::<T, false>(job, starts),
        // SAFETY: `Level` values beyond the baseline come from `best` (and `all` in tests), which detected the features.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2, Edge::Area) => unsafe { body_avx2::<T, true>(job, starts) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx2, Edge::Nearest) => unsafe { body_avx2::<T, false>(job, starts) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Area) => unsafe { body_avx512::<T, true>(job, starts) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        (Level::Avx512, Edge::Nearest) => unsafe { body_avx512::<T, false>(job, starts) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn body_avx2<const T: usize, const AREA: bool>(job: &Job, starts: [u64; T]) -> Output<T> {
    body::<T, AREA>(job, starts)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn body_avx512<const T: usize, const AREA: bool>(job: &Job, starts: [u64; T]) -> Output<T> {
    body::<T, AREA>(job, starts)
}

/// What moves from vector to vector.
struct Lanes<const T: usize> {
    cos: [f32; LANES],
    sin: [f32; LANES],
    code: [u64; T],
    re: [[f32; LANES]; T],
    im: [[f32; LANES]; T],
    power: [f32; LANES],
}

/// What stays.
struct Steps {
    turn_cos: f32,
    turn_sin: f32,
    lane: [u32; LANES],
    width: u32,
    inverse_width: f32,
    advance: u64,
    period: u64,
}

#[inline(always)]
fn body<const T: usize, const AREA: bool>(job: &Job, starts: [u64; T]) -> Output<T> {
    let step = job.nco.code_step;
    let fine = CODE_BITS - FINE;
    let width = (step >> fine) as u32;
    let (sin, cos) = libm::sincos(radians(job.nco.carrier_step));
    let one = Complex64::new(cos, sin);
    let mut powers = [Complex64::ONE; LANES + 1];
    for k in 0..LANES {
        powers[k + 1] = powers[k] * one;
    }
    let steps = Steps {
        turn_cos: powers[LANES].re as f32,
        turn_sin: powers[LANES].im as f32,
        lane: std::array::from_fn(|k| (step.wrapping_mul(k as u64) >> fine) as u32),
        width,
        inverse_width: 1.0 / width.max(1) as f32,
        advance: step.wrapping_mul(LANES as u64) % job.period,
        period: job.period,
    };
    let mut lanes = Lanes {
        cos: [0.0; LANES],
        sin: [0.0; LANES],
        code: starts,
        re: [[0.0; LANES]; T],
        im: [[0.0; LANES]; T],
        power: [0.0; LANES],
    };
    let mut totals = [Complex64::ZERO; T];
    let mut power = 0.0;
    let mut carrier = job.nco.carrier;
    for (i, q) in job.i.chunks(CHUNK).zip(job.q.chunks(CHUNK)) {
        let (sin, cos) = libm::sincos(radians(carrier));
        let anchor = Complex64::new(cos, sin);
        for ((cos, sin), power) in lanes.cos.iter_mut().zip(&mut lanes.sin).zip(&powers) {
            let phasor = power * anchor;
            (*cos, *sin) = (phasor.re as f32, phasor.im as f32);
        }
        let (vectors_i, rest_i) = i.as_chunks::<LANES>();
        let (vectors_q, rest_q) = q.as_chunks::<LANES>();
        for (i, q) in vectors_i.iter().zip(vectors_q) {
            vector::<T, AREA>(job.words, i, q, &mut lanes, &steps);
        }
        if !rest_i.is_empty() {
            let (mut i, mut q) = ([0.0; LANES], [0.0; LANES]);
            i[..rest_i.len()].copy_from_slice(rest_i);
            q[..rest_q.len()].copy_from_slice(rest_q);
            vector::<T, AREA>(job.words, &i, &q, &mut lanes, &steps);
        }
        for (total, (re, im)) in totals.iter_mut().zip(lanes.re.iter_mut().zip(&mut lanes.im)) {
            *total += Complex64::new(drain(re), drain(im));
        }
        power += drain(&mut lanes.power);
        carrier = carrier.wrapping_add(job.nco.carrier_step.wrapping_mul(CHUNK as u64));
    }
    (totals, power)
}

/// Sixteen samples. Every shift and sum wraps on purpose: indices stay below 32 while a chip is not shorter than a sample.
#[inline(always)]
fn vector<const T: usize, const AREA: bool>(
    words: &[u64],
    i: &[f32; LANES],
    q: &[f32; LANES],
    lanes: &mut Lanes<T>,
    steps: &Steps,
) {
    let (mut re, mut im) = ([0.0_f32; LANES], [0.0_f32; LANES]);
    for k in 0..LANES {
        let (cos, sin) = (lanes.cos[k], lanes.sin[k]);
        re[k] = i[k] * cos + q[k] * sin;
        im[k] = q[k] * cos - i[k] * sin;
        lanes.power[k] += i[k] * i[k] + q[k] * q[k];
        lanes.cos[k] = cos * steps.turn_cos - sin * steps.turn_sin;
        lanes.sin[k] = cos * steps.turn_sin + sin * steps.turn_cos;
    }
    for t in 0..T {
        let code = lanes.code[t];
        let chip = (code >> CODE_BITS) as usize;
        let window = (words[chip >> 5].wrapping_shl((chip & 31) as u32) >> 32) as u32;
        let fraction = (code >> (CODE_BITS - FINE)) as u32 & FINE_MASK;
        for k in 0..LANES {
            let start = fraction.wrapping_add(steps.lane[k]);
            let first = sign(window, start >> FINE);
            let value = if AREA {
                let end = start.wrapping_add(steps.width);
                let w = ((end & FINE_MASK) as i32 as f32 * steps.inverse_width).min(1.0);
                first + (sign(window, end >> FINE) - first) * w
            } else {
                first
            };
            lanes.re[t][k] += re[k] * value;
            lanes.im[t][k] += im[k] * value;
        }
        let next = code.wrapping_add(steps.advance);
        lanes.code[t] = if next >= steps.period { next.wrapping_sub(steps.period) } else { next };
    }
}

/// −1 where that chip of the window is a logical 1.
#[inline(always)]
fn sign(window: u32, index: u32) -> f32 {
    f32::from_bits(0x3f80_0000 ^ (window.wrapping_shl(index) & 0x8000_0000))
}

/// The sum of the lanes, in their order; leaves zeros.
#[inline(always)]
fn drain(lanes: &mut [f32; LANES]) -> f64 {
    let sum = lanes.iter().map(|&x| f64::from(x)).sum();
    *lanes = [0.0; LANES];
    sum
}

/// A phase in 2⁻⁶⁴ turns, as an angle in ±π.
fn radians(turns: u64) -> f64 {
    turns as i64 as f64 / TURN * std::f64::consts::TAU
}
