//! The correlator in `f32`: sixteen lanes of plain Rust with a fixed order of sums.
//!
//! No fused multiply-add that could round otherwise, so that every instruction set gives the same bits. Code
//! phases of lanes resolve 2⁻²⁷ chip.

use num_complex::{Complex32, Complex64};

use super::carrier::{Carrier, LANES, filled};
use super::kernel::{Job, wrapped};
use super::{CODE_BITS, Pattern};

/// Vectors whose sums stay in `f32`.
pub(super) const VECTORS: usize = 64;
pub(super) const CHUNK: usize = LANES * VECTORS;
/// Fraction bits of a lane's code phase.
pub(super) const FINE: u32 = 27;
pub(super) const FINE_MASK: u32 = (1 << FINE) - 1;

/// Chunk of up to [`CHUNK`] samples, with the data to correlate them.
pub(super) struct Chunk<'a> {
    pub replica: &'a Pattern,
    pub steps: &'a Steps,
    pub i: &'a [f32],
    pub q: &'a [f32],
    /// Phasor of each vector's first sample.
    pub cos: [f32; VECTORS],
    pub sin: [f32; VECTORS],
}

/// Motion of the code in single precision.
pub(super) struct Steps {
    pub lane: [u32; LANES],
    pub inverse_width: f32,
    pub advance: u64,
    pub period: u64,
}

/// Sums of each lane, a tap.
pub(super) struct Lanes<const T: usize> {
    pub re: [[f32; LANES]; T],
    pub im: [[f32; LANES]; T],
}

#[inline(always)]
pub(super) fn body<const T: usize>(
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
    let mut carrier = Carrier::new(&job.nco);
    let mut code = begins;
    let mut totals = [([0.0_f64; LANES], [0.0_f64; LANES]); T];
    for (i, q) in job.i.chunks(CHUNK).zip(job.q.chunks(CHUNK)) {
        let mut chunk = Chunk { replica: job.replica, steps: &steps, i, q, cos: [0.0; VECTORS], sin: [0.0; VECTORS] };
        let (cos, sin) = (chunk.cos.as_chunks_mut().0, chunk.sin.as_chunks_mut().0);
        for (cos, sin) in cos.iter_mut().zip(sin) {
            (*cos, *sin) = carrier.next_block();
        }
        let sums = lanes(&chunk, &mut code);
        for (total, (re, im)) in totals.iter_mut().zip(sums.re.iter().zip(&sums.im)) {
            for k in 0..LANES {
                total.0[k] += f64::from(re[k]);
                total.1[k] += f64::from(im[k]);
            }
        }
    }
    totals.map(|(re, im)| carrier.fold(&re, &im))
}

/// One chunk in plain lanes; the last vector is filled up with zeros.
#[inline(always)]
pub(super) fn lanes<const T: usize, const AREA: bool>(chunk: &Chunk, code: &mut [u64; T]) -> Lanes<T> {
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

/// Sixteen samples. Every shift and sum of phases wraps on purpose: indices stay below 32 while a chip is not
/// shorter than a sample.
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

/// Chip and fraction of a code phase.
#[inline(always)]
pub(super) fn split(code: u64) -> (usize, u32) {
    ((code >> CODE_BITS) as usize, (code >> (CODE_BITS - FINE)) as u32 & FINE_MASK)
}

/// −1 where that chip of the window is a logical 1.
#[inline(always)]
fn sign(window: u32, index: u32) -> f32 {
    f32::from_bits(0x3f80_0000 ^ (window.wrapping_shl(index) & 0x8000_0000))
}
