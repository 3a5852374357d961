//! The `f64` kernel of the `reference` level: every sample by itself, as in
//! [`reference`](mod@super::reference), at speed.
//!
//! Carrier phase is the 64-bit turns of each sample, its sine and cosine are Taylor series within 2e-16 over
//! an eighth of a turn; code positions are read with all their 48 fractional bits. No value depends on the
//! sample before. Only the sum over satellites is `f32`.

use super::band::{Filter, HALF_WIDTH};
use super::chips::{sign, window};
use super::{CODE_ONE, Edge, Run, reference, to_step};

/// Samples side by side; results do not depend on it.
const LANES: usize = 16;

/// Samples before and after a run that edges reach.
const BORDER: usize = 2 * HALF_WIDTH + 2;

/// Adds the run to planar samples; `i` and `q` have the same length, `wave` is scratch.
#[inline(always)]
pub fn accumulate(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<f64>) {
    let skip = waveform(edge, run, i.len(), wave);
    let wave = wave.get(skip..).unwrap_or(&[]);
    let mut turns: [u64; LANES] =
        std::array::from_fn(|k| run.turns.wrapping_add(run.turns_step.wrapping_mul(k as u64)));
    let stride = run.turns_step.wrapping_mul(LANES as u64);
    for ((bi, bq), bw) in i.chunks_mut(LANES).zip(q.chunks_mut(LANES)).zip(wave.chunks(LANES)) {
        let (cos, sin) = cos_sin(&turns);
        if let (Ok(bi), Ok(bq), Ok(bw)) = (
            <&mut [f32; LANES]>::try_from(&mut *bi),
            <&mut [f32; LANES]>::try_from(&mut *bq),
            <&[f64; LANES]>::try_from(bw),
        ) {
            for k in 0..LANES {
                let value = run.amplitude * bw[k];
                bi[k] += (value * cos[k]) as f32;
                bq[k] += (value * sin[k]) as f32;
            }
        } else {
            for (k, ((i, q), w)) in bi.iter_mut().zip(bq).zip(bw).enumerate() {
                let value = run.amplitude * w;
                *i += (value * cos[k]) as f32;
                *q += (value * sin[k]) as f32;
            }
        }
        turns.iter_mut().for_each(|t| *t = t.wrapping_add(stride));
    }
}

/// Writes the code at each sample and returns the place of sample 0.
#[inline(always)]
fn waveform(edge: Edge<'_>, run: &Run<'_>, samples: usize, wave: &mut Vec<f64>) -> usize {
    wave.clear();
    let at = |n: usize| run.position + run.step * n as u64;
    match edge {
        Edge::Nearest => wave.extend((0..samples).map(|n| sign(run.bits, (at(n) / CODE_ONE) as usize))),
        Edge::Area if run.step <= CODE_ONE => {
            let scale = 1.0 / run.step as f64;
            wave.extend((0..samples).map(|n| {
                let from = at(n) - run.step / 2;
                let signs = window(run.bits, (from / CODE_ONE) as usize);
                let (first, second) = (1.0 - 2.0 * (signs >> 63) as f64, 1.0 - 2.0 * (signs >> 62 & 1) as f64);
                let behind = (from % CODE_ONE + run.step).saturating_sub(CODE_ONE) as f64 * scale;
                first + (second - first) * behind
            }));
        }
        Edge::Area => wave.extend((0..samples).map(|n| reference::waveform(edge, run, at(n)))),
        Edge::BandLimited(filter) => {
            band_limited(filter, run, samples, wave);
            return BORDER;
        }
    }
    0
}

/// The square wave between edges, plus at each edge the filter's response minus the ideal step.
#[inline(always)]
fn band_limited(filter: &Filter, run: &Run<'_>, samples: usize, wave: &mut Vec<f64>) {
    wave.resize(samples + 2 * BORDER, 0.0);
    let reach = (HALF_WIDTH as u64 + 1) * run.step;
    let first = (run.position - reach) / CODE_ONE;
    let last = (run.position + run.step * samples as u64 + reach) / CODE_ONE;
    let per_step = 1.0 / run.step as f64;
    let mut filled = 0;
    for step in first + 1..=last {
        let signs = window(run.bits, step as usize - 1);
        let (old, new) = (1.0 - 2.0 * (signs >> 63) as f64, 1.0 - 2.0 * (signs >> 62 & 1) as f64);
        // Samples from the run's first one to the edge.
        let x = to_step(run.position, step) * per_step;
        let place = x.ceil();
        let at = (place as i64 + BORDER as i64).max(0) as usize;
        if let Some(stretch) = wave.get_mut(filled..at) {
            stretch.iter_mut().for_each(|w| *w += old);
        }
        filled = filled.max(at);
        if old == new {
            continue;
        }
        if let Some(near) = at.checked_sub(HALF_WIDTH).and_then(|from| wave.get_mut(from..from + 2 * HALF_WIDTH)) {
            for (w, residual) in near.iter_mut().zip(filter.exact_residual(place - x)) {
                *w += (new - old) * residual;
            }
        }
    }
    let rest = sign(run.bits, last as usize);
    wave.iter_mut().skip(filled).for_each(|w| *w += rest);
}

/// Cosine and sine of phases in 2^-64 turn.
#[inline(always)]
fn cos_sin(turns: &[u64; LANES]) -> ([f64; LANES], [f64; LANES]) {
    let (mut cos, mut sin) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        let quadrant = turns[k].wrapping_add(1 << 61) >> 62;
        // Signed rest of the quadrant: the angle is within ±π/4.
        let rest = ((turns[k] << 2) as i64) >> 2;
        let x = rest as f64 * (std::f64::consts::TAU / 18_446_744_073_709_551_616.0);
        let z = x * x;
        let mut s = 1.0 / 355_687_428_096_000.0;
        for term in SINE {
            s = term + z * s;
        }
        let mut c = 1.0 / 20_922_789_888_000.0;
        for term in COSINE {
            c = term + z * c;
        }
        let (s, c) = ((x * s).to_bits(), c.to_bits());
        let odd = (quadrant & 1).wrapping_neg();
        cos[k] = f64::from_bits(((c & !odd) | (s & odd)) ^ ((quadrant ^ (quadrant >> 1)) << 63));
        sin[k] = f64::from_bits(((s & !odd) | (c & odd)) ^ ((quadrant >> 1) << 63));
    }
    (cos, sin)
}

/// Taylor's terms from the highest down, after x^17/17! and x^16/16!; the next ones are below 1e-18.
const SINE: [f64; 8] = [
    -1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    -1.0 / 5040.0,
    1.0 / 120.0,
    -1.0 / 6.0,
    1.0,
];
const COSINE: [f64; 8] = [
    -1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    -1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    -1.0 / 720.0,
    1.0 / 24.0,
    -0.5,
    1.0,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::synth::chips::CodeTime;
    use crate::generator::synth::radians;
    use crate::generator::synth::waveform::plain;
    use crate::gnss::gps::l1ca::L1_CA;

    #[test]
    fn sine_and_cosine_are_those_of_libm_all_around_the_turn() {
        for n in 0..5000_u64 {
            let turns = std::array::from_fn(|k| (n * 16 + k as u64).wrapping_mul(0x0003_4567_89ab_cdef));
            let (cos, sin) = cos_sin(&turns);
            for k in 0..LANES {
                // The argument is rounded in both (1.1e-16 of π), the series to an ulp or two.
                let (s, c) = libm::sincos(radians(turns[k]));
                assert!((cos[k] - c).abs() < 1e-15 && (sin[k] - s).abs() < 1e-15, "{}", turns[k]);
            }
        }
    }

    #[test]
    fn it_is_the_definition_to_the_rounding_of_the_sum() {
        let filter = Filter::new(0.45);
        let spreading = plain(&L1_CA, 11).unwrap();
        for rate_hz in [0.9e6, 2.046e6, 2.6e6, 25e6] {
            for edge in [Edge::Nearest, Edge::Area, Edge::BandLimited(&filter)] {
                for length in [1, 15, 16, 17, 4096] {
                    let step = (1.023e6 / rate_hz * CODE_ONE as f64) as u64;
                    let at = CodeTime::new(8, 1020 * CODE_ONE + length as u64 * (CODE_ONE / 131));
                    let mut bits = Vec::new();
                    let position = spreading.strip(at, step, length, |period| period % 2 == 1, &mut bits);
                    let turns_step = 0x0765_4321_0fed_cba9;
                    let run = Run { bits: &bits, position, step, turns: 0x1234 << 48, turns_step, amplitude: 1.0 };
                    let (mut i, mut q, mut wave) = (vec![0.0; length], vec![0.0; length], Vec::new());
                    let (mut ri, mut rq) = (i.clone(), q.clone());
                    accumulate(edge, &run, &mut i, &mut q, &mut wave);
                    reference::accumulate(edge, &run, &mut ri, &mut rq);
                    for n in 0..length {
                        // One f32 rounding of a value up to 1.2; f64 sums in another order leave 1e-15.
                        let error = (i[n] - ri[n]).abs().max((q[n] - rq[n]).abs());
                        assert!(error < 1.3e-7, "{edge:.0?} {rate_hz} {length} {n} {error}");
                    }
                }
            }
        }
    }
}
