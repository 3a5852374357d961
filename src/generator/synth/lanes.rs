//! The fast kernel: 32 samples side by side in plain arrays that the compiler turns into vectors.
//!
//! No fused multiply-add and no intrinsics: each operation is one IEEE rounding, so every
//! instruction set gives the same bits. Carrier phasors are anchored in `f64` at the run's start and
//! rotated in `f32` 32 samples at a time (128 rotations at most, error below 1e-5 of the amplitude).
//! Chip signs come from one window of the strip per 32 samples, by a shift per lane.

use super::band::HALF_WIDTH;
use super::chips::window;
use super::{CODE_BITS, CODE_ONE, Edge, Run, radians, reference};

/// Samples side by side. The same on every instruction set, because the phasor's rounding depends on it.
pub const LANES: usize = 32;

/// Fractional bits of a lane's code phase; the five above count steps in the window.
const LANE_BITS: u32 = 27;

type Lane = [f32; LANES];

struct Phasors {
    re: Lane,
    im: Lane,
    turn_re: f32,
    turn_im: f32,
}

impl Phasors {
    #[inline(always)]
    fn anchor(run: &Run<'_>) -> Self {
        let (sin, cos) = libm::sincos(radians(run.turns));
        let mut re = [0.0_f64; LANES];
        let mut im = [0.0_f64; LANES];
        (re[0], im[0]) = (run.amplitude * cos, run.amplitude * sin);
        let (mut step_im, mut step_re) = libm::sincos(radians(run.turns_step));
        let mut known = 1;
        // Doubling: lane k + known is lane k turned by `known` samples.
        while known < LANES {
            for k in 0..known {
                re[k + known] = re[k] * step_re - im[k] * step_im;
                im[k + known] = re[k] * step_im + im[k] * step_re;
            }
            (step_re, step_im) = (step_re * step_re - step_im * step_im, 2.0 * step_re * step_im);
            known *= 2;
        }
        Self { re: re.map(|x| x as f32), im: im.map(|x| x as f32), turn_re: step_re as f32, turn_im: step_im as f32 }
    }

    #[inline(always)]
    fn advance(&mut self) {
        for k in 0..LANES {
            let (re, im) = (self.re[k], self.im[k]);
            self.re[k] = re * self.turn_re - im * self.turn_im;
            self.im[k] = re * self.turn_im + im * self.turn_re;
        }
    }
}

/// Adds the run to planar samples; `i` and `q` have the same length, `wave` is scratch.
#[inline(always)]
pub fn accumulate(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<f32>) {
    let dense = run.step > CODE_ONE;
    match edge {
        Edge::Nearest if !dense => fused::<false>(run, i, q),
        Edge::Area if !dense => fused::<true>(run, i, q),
        Edge::Nearest | Edge::Area => {
            wave.clear();
            wave.extend(
                (0..i.len()).map(|n| reference::waveform(edge, run, run.position + run.step * n as u64) as f32),
            );
            rotate(run, wave, i, q);
        }
        Edge::BandLimited(filter) => {
            let skip = band_limited(filter, run, i.len(), wave);
            rotate(run, wave.get(skip..).unwrap_or(&[]), i, q);
        }
    }
}

/// Code and carrier in one pass, for at most one code step a sample.
#[inline(always)]
fn fused<const AREA: bool>(run: &Run<'_>, i: &mut [f32], q: &mut [f32]) {
    let mut phasors = Phasors::anchor(run);
    // The area of a sample ends half a step after its instant.
    let mut position = if AREA { run.position - run.step / 2 + run.step } else { run.position };
    let lane_steps: [u32; LANES] = std::array::from_fn(|k| ((run.step * k as u64) >> (CODE_BITS - LANE_BITS)) as u32);
    // Twice the share of the sample behind an edge, for each unit of the lane's fraction.
    let slope = 2.0 * (CODE_ONE as f64 / run.step as f64) as f32 / (1_u32 << LANE_BITS) as f32;
    let mut is = i.chunks_exact_mut(LANES);
    let mut qs = q.chunks_exact_mut(LANES);
    for (bi, bq) in is.by_ref().zip(qs.by_ref()) {
        if let (Ok(bi), Ok(bq)) = (bi.try_into(), bq.try_into()) {
            vector::<AREA>(run.bits, position, &lane_steps, slope, &phasors, bi, bq);
        }
        phasors.advance();
        position += run.step * LANES as u64;
    }
    let (ti, tq) = (is.into_remainder(), qs.into_remainder());
    if !ti.is_empty() {
        let (mut bi, mut bq) = ([0.0; LANES], [0.0; LANES]);
        bi[..ti.len()].copy_from_slice(ti);
        bq[..tq.len()].copy_from_slice(tq);
        vector::<AREA>(run.bits, position, &lane_steps, slope, &phasors, &mut bi, &mut bq);
        ti.copy_from_slice(&bi[..ti.len()]);
        tq.copy_from_slice(&bq[..tq.len()]);
    }
}

#[inline(always)]
fn vector<const AREA: bool>(
    bits: &[u64],
    position: u64,
    lane_steps: &[u32; LANES],
    slope: f32,
    phasors: &Phasors,
    i: &mut Lane,
    q: &mut Lane,
) {
    const SIGN: u32 = 1 << 31;
    const FRACTION: u32 = (1 << LANE_BITS) - 1;
    // One step early, so that each sign's predecessor is at hand.
    let signs = window(bits, (position / CODE_ONE) as usize - 1);
    let now = ((signs << 1) >> 32) as u32;
    let changes = ((signs ^ (signs << 1)) >> 32) as u32;
    let fraction = ((position >> (CODE_BITS - LANE_BITS)) as u32) & FRACTION;
    for k in 0..LANES {
        let place = fraction.wrapping_add(lane_steps[k]);
        let index = place >> LANE_BITS;
        let sign = (now << index) & SIGN;
        if AREA {
            // 1 where no edge falls into the sample, else 2w − 1 with w the share behind the edge.
            let behind = ((place & FRACTION) as i32 as f32 * slope).min(2.0) - 2.0;
            let mask = (((changes << index) as i32) >> 31) as u32;
            let value = 1.0 + f32::from_bits(behind.to_bits() & mask);
            let value = f32::from_bits(value.to_bits() ^ sign);
            i[k] += value * phasors.re[k];
            q[k] += value * phasors.im[k];
        } else {
            i[k] += f32::from_bits(phasors.re[k].to_bits() ^ sign);
            q[k] += f32::from_bits(phasors.im[k].to_bits() ^ sign);
        }
    }
}

/// Turns a ready waveform by the carrier.
#[inline(always)]
fn rotate(run: &Run<'_>, wave: &[f32], i: &mut [f32], q: &mut [f32]) {
    let mut phasors = Phasors::anchor(run);
    for ((bi, bq), bw) in i.chunks_mut(LANES).zip(q.chunks_mut(LANES)).zip(wave.chunks(LANES)) {
        if let (Ok(bi), Ok(bq), Ok(bw)) =
            (<&mut Lane>::try_from(&mut *bi), <&mut Lane>::try_from(&mut *bq), <&Lane>::try_from(bw))
        {
            for k in 0..LANES {
                bi[k] += bw[k] * phasors.re[k];
                bq[k] += bw[k] * phasors.im[k];
            }
        } else {
            for (k, w) in bw.iter().enumerate().take(bi.len()) {
                bi[k] += w * phasors.re[k];
                bq[k] += w * phasors.im[k];
            }
        }
        phasors.advance();
    }
}

/// Writes the band-limited waveform with borders into `wave`, and returns where sample 0 stands.
///
/// The square wave between edges, plus at each edge the filter's response minus the ideal step.
#[inline(always)]
fn band_limited(filter: &super::band::Filter, run: &Run<'_>, samples: usize, wave: &mut Vec<f32>) -> usize {
    const BORDER: usize = 2 * HALF_WIDTH + 2;
    wave.clear();
    wave.resize(samples + 2 * BORDER, 0.0);
    let reach = (HALF_WIDTH as u64 + 1) * run.step;
    let first = (run.position - reach) / CODE_ONE;
    let last = (run.position + run.step * samples as u64 + reach) / CODE_ONE;
    let per_step = 1.0 / run.step as f64;
    let mut negative = window(run.bits, first as usize) >> 63;
    let mut filled = 0;
    let mut step = first + 1;
    while step <= last {
        // Skips to the next change of sign within the window.
        let ahead = window(run.bits, step as usize) ^ negative.wrapping_neg();
        let zeros = u64::from(ahead.leading_zeros());
        step += zeros;
        if zeros == 64 || step > last {
            continue;
        }
        let x = ((step * CODE_ONE) as i64 - run.position as i64) as f64 * per_step;
        let place = x.ceil();
        let at = (place as i64 + BORDER as i64).max(0) as usize;
        let old = if negative == 1 { -1.0 } else { 1.0 };
        if let Some(run) = wave.get_mut(filled..at) {
            run.iter_mut().for_each(|w| *w += old);
        }
        filled = filled.max(at);
        if let Some(near) = at.checked_sub(HALF_WIDTH).and_then(|from| wave.get_mut(from..from + 2 * HALF_WIDTH)) {
            let change = -2.0 * old;
            for (w, r) in near.iter_mut().zip(filter.residual(place - x)) {
                *w += change * r;
            }
        }
        negative ^= 1;
        step += 1;
    }
    let old = if negative == 1 { -1.0 } else { 1.0 };
    if let Some(rest) = wave.get_mut(filled..) {
        rest.iter_mut().for_each(|w| *w += old);
    }
    BORDER
}
