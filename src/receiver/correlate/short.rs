//! The correlator in integers of 16 bits, for samples of 8: exact sums, so any order of them gives the same
//! bits.
//!
//! Samples are taken in 2⁻⁷ LSB, phasors in 2⁻¹⁵, replicas in 2⁻⁸, and products are summed in 32 bits. Of the
//! 16 bits of a code phase as many are whole chips as a group of 32 samples spans (2⁻¹² chip is the last bit
//! at 2.6 Msps). It is rounded to nearest for a group and within it, so errors at edges average out over
//! edges. Limits: a sample must pass at least 513 of these last bits (65 Msps for C/A) and at most 30/31
//! chip.

use num_complex::Complex64;

use super::carrier::{BLOCK, Carrier, LANES, filled};
use super::kernel::{Job, wrapped};
use super::{CODE_BITS, Edge, Pattern};

/// Samples in a group: two vectors, whose products are added in pairs.
pub(super) const GROUP: usize = 2 * LANES;
/// Groups whose sums stay in 32 bits: 64 samples a lane · 127.5·2⁷·√2 · 2⁸ < 2²⁹.
const GROUPS: usize = 32;
const CHUNK: usize = GROUPS * GROUP;
/// Value of a chip in the table.
pub(super) const AMPLITUDE: i16 = 256;
/// A float of this size has 2⁻⁷ in its last bit, and zeros in its last sixteen.
pub(super) const ALIGN: f32 = 98_304.0;
/// Phasors of length one.
const UNIT: f32 = 32_767.0;
/// Adding this to a float leaves its integer, rounded half to even, in the low bits.
const ROUND: f32 = 12_582_912.0;
/// Undoes the scales of samples, replica and phasors; products with phasors lose 15 bits.
const SCALE: f64 = 32_768.0 / (128.0 * AMPLITUDE as f64 * UNIT as f64);

/// Motion of the code in 16 bits.
pub(super) struct Steps {
    /// Phase of samples k and k + 16 of a group, from that of its first one.
    pub lanes: [[u16; 2]; LANES],
    /// Fraction bits of a phase.
    pub fine: u32,
    /// Width of a sample's interval, in 2⁻¹⁵.
    pub width: u16,
    /// Slope of the replica within the interval, in 2⁻¹⁵.
    pub slope: i16,
    /// Added to a code phase at the beginning.
    offset: u64,
    advance: u64,
    pub period: u64,
}

impl Steps {
    /// `None` where 16 bits do not do.
    pub fn new(replica: &Pattern, step: u64) -> Option<Self> {
        let last = step.checked_mul(GROUP as u64 - 1)?;
        let index_bits = (1..=5_u32).find(|bits| last <= ((1 << bits) - 1) << CODE_BITS)?;
        let fine = 16 - index_bits;
        let rounded = |units: u64| ((units >> (CODE_BITS - fine - 1)) + 1) >> 1;
        let width = rounded(step);
        let rise = u64::from(AMPLITUDE.unsigned_abs()) << 16;
        let slope = i16::try_from((rise + width / 2).checked_div(width)?).ok()?;
        // Rounded to nearest from here on; a ramp of the rounded width has its middle where it should be.
        let half = 1 << (CODE_BITS - fine - 1);
        let offset = match replica.edge {
            Edge::Area => (half + (width << (CODE_BITS - fine)) / 2).saturating_sub(step / 2),
            Edge::Nearest => half,
        };
        let mut lanes = [[0; 2]; LANES];
        for (k, pair) in lanes.iter_mut().enumerate() {
            *pair = [rounded(step * k as u64) as u16, rounded(step * (k + LANES) as u64) as u16];
        }
        Some(Self {
            lanes,
            fine,
            width: width as u16,
            slope,
            offset,
            advance: step * GROUP as u64,
            period: replica.period() as u64,
        })
    }

    /// Chip and fraction of a code phase that was rounded to nearest.
    #[inline(always)]
    pub fn split(&self, code: u64) -> (usize, u16) {
        let fraction = code >> (CODE_BITS - self.fine) & ((1 << self.fine) - 1);
        ((code >> CODE_BITS) as usize, fraction as u16)
    }

    /// The code phase of the next group, which is less than a period away.
    #[inline(always)]
    pub fn next(&self, code: u64) -> u64 {
        let moved = code + self.advance;
        if moved < self.period { moved } else { moved - self.period }
    }
}

/// Chunk of up to [`GROUPS`] groups and their phasors.
pub(super) struct Chunk<'a> {
    pub replica: &'a Pattern,
    pub steps: &'a Steps,
    pub i: &'a [[f32; GROUP]],
    pub q: &'a [[f32; GROUP]],
    /// Cosines of samples 0 and 16 of each group, the latter in the upper half.
    pub cos: &'a [i32],
    /// Sines of samples 0 and 16 of each group, the latter in the upper half.
    pub sin: &'a [i32],
}

/// Sums of samples k and k + 16 of all groups, a tap.
pub(super) struct Sums<const T: usize> {
    pub re: [[i32; LANES]; T],
    pub im: [[i32; LANES]; T],
}

#[inline(always)]
pub(super) fn body<const T: usize>(
    job: &Job,
    steps: &Steps,
    begins: [u64; T],
    lanes: impl Fn(&Chunk, &mut [u64; T]) -> Sums<T>,
) -> [Complex64; T] {
    let mut carrier = Carrier::new(&job.nco);
    let mut code = begins.map(|code| wrapped(code + steps.offset, steps.period));
    let mut totals = [([0.0_f64; LANES], [0.0_f64; LANES]); T];
    for (i, q) in job.i.chunks(CHUNK).zip(job.q.chunks(CHUNK)) {
        let (mut cos, mut sin) = ([0; GROUPS], [0; GROUPS]);
        let blocks = cos.as_chunks_mut().0.iter_mut().zip(sin.as_chunks_mut().0);
        for (cos, sin) in blocks.take(i.len().div_ceil(BLOCK)) {
            let phasors = carrier.next_block();
            (*cos, *sin) = (pairs(phasors.0), pairs(phasors.1));
        }
        let ((whole_i, rest_i), (whole_q, rest_q)) = (i.as_chunks(), q.as_chunks());
        let (last_i, last_q) = ([filled(rest_i)], [filled(rest_q)]);
        let whole = whole_i.len();
        let parts: [(&[_], &[_], _); 2] = [(whole_i, whole_q, 0), (&last_i, &last_q, whole)];
        for (i, q, first) in parts.into_iter().take(1 + usize::from(!rest_i.is_empty())) {
            let part = Chunk { replica: job.replica, steps, i, q, cos: &cos[first..], sin: &sin[first..] };
            let sums = lanes(&part, &mut code);
            for (total, (re, im)) in totals.iter_mut().zip(sums.re.iter().zip(&sums.im)) {
                for k in 0..LANES {
                    total.0[k] += f64::from(re[k]);
                    total.1[k] += f64::from(im[k]);
                }
            }
        }
    }
    let mut folded = [Complex64::ZERO; T];
    for (folded, (re, im)) in folded.iter_mut().zip(&totals) {
        *folded = carrier.fold(re, im) * SCALE;
    }
    folded
}

/// Phasors in 2⁻¹⁵, two in each integer.
#[inline(always)]
fn pairs(x: [f32; LANES]) -> [i32; LANES / 2] {
    let mut short = [0; LANES];
    for (short, x) in short.iter_mut().zip(&x) {
        *short = (x * UNIT + ROUND).to_bits();
    }
    let mut both = [0; LANES / 2];
    for (both, [first, second]) in both.iter_mut().zip(short.as_chunks().0) {
        *both = (first & 0xffff | second << 16) as i32;
    }
    both
}

/// One chunk in plain lanes of 32 bits, which wrap as those of 16 would.
#[inline(always)]
pub(super) fn lanes<const T: usize, const AREA: bool>(chunk: &Chunk, code: &mut [u64; T]) -> Sums<T> {
    let steps = chunk.steps;
    let (mask, width, slope) = ((1_u32 << steps.fine) - 1, u32::from(steps.width), i32::from(steps.slope));
    let offsets = [0, 1].map(|half| steps.lanes.map(|pair| u32::from(pair[half])));
    let mut sums = Sums { re: [[0; LANES]; T], im: [[0; LANES]; T] };
    let phasors = chunk.cos.iter().zip(chunk.sin);
    for ((i, q), (cos, sin)) in chunk.i.iter().zip(chunk.q).zip(phasors) {
        let (halves_i, halves_q) = (i.as_chunks::<LANES>().0, q.as_chunks::<LANES>().0);
        for (half, (i, q)) in halves_i.iter().zip(halves_q).enumerate().take(2) {
            let (cos, sin) = (upper(cos << (16 * (1 - half))), upper(sin << (16 * (1 - half))));
            let (mut re, mut im) = ([0_i32; LANES], [0_i32; LANES]);
            for k in 0..LANES {
                let (i, q) = (fixed(i[k]), fixed(q[k]));
                re[k] = upper(product(i, cos).wrapping_add(product(q, sin)) << 16);
                im[k] = upper(product(q, cos).wrapping_sub(product(i, sin)) << 16);
            }
            for (code, (sum_re, sum_im)) in code.iter().zip(sums.re.iter_mut().zip(&mut sums.im)) {
                let (chip, fraction) = steps.split(*code);
                let window = chunk.replica.words[chip >> 5].wrapping_shl((chip & 31) as u32);
                let (window, window_after) = ((window >> 32) as u32, (window >> 31) as u32);
                for k in 0..LANES {
                    let phase = u32::from(fraction) + offsets[half][k];
                    let index = phase >> steps.fine;
                    let one = sign_bits(window, index);
                    let mut value = i32::from(AMPLITUDE) + one * (2 * i32::from(AMPLITUDE));
                    if AREA {
                        let change = sign_bits(window_after, index) - one;
                        value += product(change * slope, (phase & mask).min(width) as i32);
                    }
                    sum_re[k] = sum_re[k].wrapping_add(re[k].wrapping_mul(value));
                    sum_im[k] = sum_im[k].wrapping_add(im[k].wrapping_mul(value));
                }
            }
        }
        *code = code.map(|code| steps.next(code));
    }
    sums
}

/// The upper half, with its sign.
#[inline(always)]
fn upper(x: i32) -> i32 {
    x >> 16
}

/// A sample in 2⁻⁷ LSB.
#[inline(always)]
fn fixed(x: f32) -> i32 {
    upper(((x + ALIGN).to_bits() << 16) as i32)
}

/// a·b/2¹⁵, rounded.
#[inline(always)]
fn product(a: i32, b: i32) -> i32 {
    (a.wrapping_mul(b).wrapping_add(1 << 14)) >> 15
}

/// −1 where that chip of the window is a logical 1, else 0.
#[inline(always)]
fn sign_bits(window: u32, index: u32) -> i32 {
    window.wrapping_shl(index) as i32 >> 31
}
