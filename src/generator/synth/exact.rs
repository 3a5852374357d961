//! The `f64` kernel of the `reference` level: every sample by itself, as in
//! [`reference`](mod@super::reference), at speed.
//!
//! A sample's carrier is the product of two phasors, that of a group's first sample and that of its place
//! in the group, each from its own 64-bit turns by Taylor series within 2e-16 over an eighth of a turn; code
//! positions are read with all their 48 fractional bits. No value depends on the sample before. Only the sum
//! over satellites is `f32`.

use super::band::{Filter, HALF_WIDTH};
use super::chips::{Changes, sign, window};
use super::{CODE_ONE, Edge, Run, reference};

/// Samples of a group, of which the carrier's two factors are counted.
const LANES: usize = 16;

/// Samples of a waveform side by side.
const BLOCK: usize = 8;

/// Blocks of a waveform before its first sample and after its last, which changes of sign there reach.
const BORDER: usize = 2 * HALF_WIDTH / BLOCK;

/// Values of a waveform.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Block([f64; BLOCK]);

/// Adds the run to planar samples; `i` and `q` have the same length, `wave` is scratch.
#[inline(always)]
pub fn accumulate(edge: Edge<'_>, run: &Run<'_>, i: &mut [f32], q: &mut [f32], wave: &mut Vec<Block>) {
    waveform(edge, run, i.len(), wave);
    let (cos, sin) = cos_sin(&ramp(0, run.turns_step));
    let stride = run.turns_step.wrapping_mul(LANES as u64);
    let wave = wave.get(BORDER..).unwrap_or(&[]).as_chunks::<{ LANES / BLOCK }>().0;
    let mut groups = i.chunks_mut(LANES).zip(q.chunks_mut(LANES)).zip(wave);
    let mut turns = run.turns;
    loop {
        let (first_cos, first_sin) = cos_sin(&ramp(turns, stride));
        turns = turns.wrapping_add(stride.wrapping_mul(LANES as u64));
        for (re, im) in first_cos.into_iter().zip(first_sin) {
            let Some(((i, q), wave)) = groups.next() else { return };
            let mut code = [0.0; LANES];
            code.as_chunks_mut::<BLOCK>().0.iter_mut().zip(wave).for_each(|(code, wave)| *code = wave.0);
            let (re, im) = (run.amplitude * re, run.amplitude * im);
            if let (Ok(i), Ok(q)) = (<&mut [f32; LANES]>::try_from(&mut *i), <&mut [f32; LANES]>::try_from(&mut *q)) {
                for k in 0..LANES {
                    i[k] += (code[k] * (re * cos[k] - im * sin[k])) as f32;
                    q[k] += (code[k] * (re * sin[k] + im * cos[k])) as f32;
                }
            } else {
                for (k, ((i, q), code)) in i.iter_mut().zip(q).zip(code).enumerate() {
                    *i += (code * (re * cos[k] - im * sin[k])) as f32;
                    *q += (code * (re * sin[k] + im * cos[k])) as f32;
                }
            }
        }
    }
}

/// `start`, `start + step`, …, in 2^-64 turn.
#[inline(always)]
fn ramp(start: u64, step: u64) -> [u64; LANES] {
    let mut turns = [0; LANES];
    for (turns, k) in turns.iter_mut().zip(0..) {
        *turns = start.wrapping_add(step.wrapping_mul(k));
    }
    turns
}

/// Writes the code at each sample, behind a border.
#[inline(always)]
fn waveform(edge: Edge<'_>, run: &Run<'_>, samples: usize, wave: &mut Vec<Block>) {
    wave.clear();
    wave.resize(samples.div_ceil(BLOCK) + 2 * BORDER, Block::default());
    let Some(body) = wave.get_mut(BORDER..samples.div_ceil(BLOCK) + BORDER) else { return };
    let blocks = (0..).step_by(BLOCK).zip(body);
    // Loops here, as what closures do may be compiled for the baseline.
    match edge {
        Edge::Nearest | Edge::BandLimited(_) => {
            for (first, block) in blocks {
                *block = square(run, first);
            }
        }
        Edge::Area if run.step <= CODE_ONE => {
            for (first, block) in blocks {
                *block = area(run, first);
            }
        }
        Edge::Area => {
            for (first, block) in blocks {
                *block = each_mean(edge, run, first);
            }
        }
    }
    if let Edge::BandLimited(filter) = edge {
        add_responses(filter, run, samples, wave);
    }
}

/// The code at the instants of a block.
#[inline(always)]
fn square(run: &Run<'_>, first: u64) -> Block {
    let position = run.position + run.step * first;
    let mut block = Block::default();
    // As many steps as a window has.
    if run.step * (BLOCK as u64 - 1) > 63 * CODE_ONE {
        for (k, value) in (0..).zip(&mut block.0) {
            *value = sign(run.bits, ((position + run.step * k) / CODE_ONE) as usize);
        }
        return block;
    }
    let signs = window(run.bits, (position / CODE_ONE) as usize);
    let mut steps = [0; BLOCK];
    for (steps, k) in steps.iter_mut().zip(0..) {
        *steps = (position % CODE_ONE + run.step * k) / CODE_ONE;
    }
    for (value, steps) in block.0.iter_mut().zip(steps) {
        *value = signed(1.0, signs << (steps & 63));
    }
    block
}

/// The code's mean over the samples of a block, of one step at most each.
#[inline(always)]
fn area(run: &Run<'_>, first: u64) -> Block {
    let position = run.position + run.step * first - run.step / 2;
    let signs = window(run.bits, (position / CODE_ONE) as usize);
    let changes = signs ^ signs << 1;
    let scale = -2.0 / run.step as f64;
    let mut block = Block::default();
    for k in 0..BLOCK {
        let from = position % CODE_ONE + run.step * k as u64;
        let behind = (from % CODE_ONE + run.step).saturating_sub(CODE_ONE) as i64 as f64;
        let changed = ((changes << (from / CODE_ONE)) as i64 >> 63) as u64;
        let mean = 1.0 + scale * f64::from_bits(behind.to_bits() & changed);
        block.0[k] = signed(mean, signs << (from / CODE_ONE));
    }
    block
}

/// The same of any steps.
fn each_mean(edge: Edge<'_>, run: &Run<'_>, first: u64) -> Block {
    let at = |k: usize| run.position + run.step * (first + k as u64);
    Block(std::array::from_fn(|k| reference::waveform(edge, run, at(k))))
}

/// A value with its sign turned by the first of `signs`.
#[inline(always)]
fn signed(value: f64, signs: u64) -> f64 {
    f64::from_bits(value.to_bits() ^ (signs & 1 << 63))
}

/// Changes that are placed side by side.
const PLACED: usize = 32;

/// Adds to the square wave, at each change of its sign, the filter's response minus the ideal step.
///
/// Places are found for many changes at once and then used, so that one does not wait for the other.
#[inline(always)]
fn add_responses(filter: &Filter, run: &Run<'_>, samples: usize, wave: &mut [Block]) {
    // A change behind the first of these is the first that can reach sample 0, and one before the second the
    // last that can reach the last sample.
    let reach = HALF_WIDTH as u64 * run.step;
    let (begin, end) = (run.position - reach, run.position + run.step * samples as u64 + reach);
    let per_step = 1.0 / run.step as f64;
    let mut changes = Changes::after(run.bits, begin / CODE_ONE);
    let (mut ahead, mut signs) = ([0; PLACED], [0; PLACED]);
    let (mut places, mut behind) = ([0; PLACED], [0.0; PLACED]);
    while changes.at < end {
        let mut count = 0;
        while count < PLACED && changes.at < end {
            (ahead[count], signs[count]) = (changes.at - begin, changes.signs);
            changes.advance();
            count += 1;
        }
        for k in 0..PLACED {
            (places[k], behind[k]) = first_behind(ahead[k], run.step, per_step);
        }
        for k in 0..count {
            let (block, within) = (places[k] as usize / BLOCK, places[k] as usize % BLOCK);
            let touched = wave.get_mut(block..).and_then(|wave| wave.first_chunk_mut::<{ BORDER + 1 }>());
            let response = filter.response::<{ BLOCK * (BORDER + 1) }>(behind[k], within);
            let (Some(touched), Some(response)) = (touched, response) else { continue };
            for (b, block) in touched.iter_mut().enumerate() {
                let more = response.at::<BLOCK>(BLOCK * b);
                for (value, more) in block.0.iter_mut().zip(more) {
                    *value += signed(more, signs[k]);
                }
            }
        }
    }
}

/// The number of the first of the samples `step` apart that is at or behind a place `ahead` of number 0, and
/// how far behind it is, in samples.
#[inline(always)]
fn first_behind(ahead: u64, step: u64, per_step: f64) -> (u64, f64) {
    // Half of it is a signed number, which is converted quickly.
    let place = (2.0 * ((ahead >> 1) as i64 as f64 * per_step)) as i64 as u64 + 1;
    // A quotient that is all but whole may be rounded over.
    let behind = step.wrapping_mul(place).wrapping_sub(ahead) as i64;
    let place = place + u64::from(behind < 0) - u64::from(behind >= step as i64);
    (place, step.wrapping_mul(place).wrapping_sub(ahead) as i64 as f64 * per_step)
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
    fn a_change_lies_behind_the_sample_before_and_not_behind_that_which_it_is_given_to() {
        let steps = [CODE_ONE / 2, CODE_ONE, 11 * CODE_ONE / 26, CODE_ONE / 25 + 1, 15 * CODE_ONE - 12_345];
        for step in steps {
            let per_step = 1.0 / step as f64;
            for sample in [1, 2, 3, 77, 4095, 4112_u64] {
                // On a sample, and as near to it as positions are counted.
                for ahead in [step * sample - 1, step * sample, step * sample - step + 1, step * sample - step / 3] {
                    let (place, behind) = first_behind(ahead, step, per_step);
                    let whole = ahead.div_ceil(step);
                    assert_eq!((place, behind), (whole, (step * whole - ahead) as f64 * per_step), "{step} {ahead}");
                }
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
                        // One f32 rounding of a value up to 1.2; f64 sums in another order leave 1e-15,
                        // responses 1e-9.
                        let error = (i[n] - ri[n]).abs().max((q[n] - rq[n]).abs());
                        assert!(error < 1.3e-7, "{edge:.0?} {rate_hz} {length} {n} {error}");
                    }
                }
            }
        }
    }
}
