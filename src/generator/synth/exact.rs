//! The `f64` kernel of the `reference` level: every sample by itself, as in
//! [`reference`](mod@super::reference), at speed.
//!
//! A sample's carrier is the product of phasors of its tile, of the middle of its group of 32 and of its
//! position about that middle, each from its own 64-bit turns by Taylor series within 2e-16 over an eighth of
//! a turn; code positions are read with all their 48 fractional bits. Band-limited edges are off by less than
//! the rounding of the sum, as `responses` states. No value depends on the sample before. Sums over
//! satellites are `f64` and become `f32` when all are in.

use super::waves::{TILE, Waves};
use super::{Edge, RUN_SAMPLES, Run};

/// Phasors side by side: of tiles, of groups, and of the samples on each side of a group's middle.
const LANES: usize = 16;

/// Samples of a group. Those before its middle have the same four products as those behind it.
const GROUP: usize = 2 * LANES;

/// Groups of a tile.
const GROUPS: usize = TILE / GROUP;

const _: () = assert!(GROUPS <= LANES && RUN_SAMPLES <= LANES * TILE);

/// A value for each phasor, or for each sample of half a group.
type Side = [f64; LANES];

/// The carrier of a run.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Carrier {
    /// Cosine and sine at the samples' distances from the middle of a group: ½, 1½, 2½ samples.
    place: (Side, Side),
    /// Cosine and sine of the turn from the middle of a tile's first group to that of each.
    groups: (Side, Side),
    /// Cosine and sine at the middle of each tile's first group.
    tiles: (Side, Side),
}

/// Sums over satellites of a group, the earlier half backwards.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Sums {
    i_before: Side,
    q_before: Side,
    i_after: Side,
    q_after: Side,
}

/// Scratch of the kernel.
#[derive(Clone, Debug)]
pub struct Scratch {
    carriers: Vec<Carrier>,
    sums: [Sums; GROUPS],
    waves: Box<Waves>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self { carriers: Vec::new(), sums: [Sums::default(); GROUPS], waves: Box::default() }
    }
}

/// Adds rays to planar samples; `i` and `q` have the same length, which is that of every run, at most
/// [`RUN_SAMPLES`]. The runs of a ray share a carrier ([`Run::shares_carrier`]).
#[inline(always)]
pub fn accumulate(edge: Edge<'_>, rays: &[&[Run<'_>]], i: &mut [f32], q: &mut [f32], scratch: &mut Scratch) {
    let Scratch { carriers, sums, waves } = scratch;
    carriers.clear();
    // Loops, here and below, as what closures do may be compiled for the baseline.
    for runs in rays {
        if let Some(first) = runs.first() {
            carriers.push(Carrier::new(first));
        }
    }
    for (tile, (i, q)) in i.chunks_mut(TILE).zip(q.chunks_mut(TILE)).enumerate() {
        sums.fill(Sums::default());
        for (runs, carrier) in rays.iter().filter(|runs| !runs.is_empty()).zip(&*carriers) {
            waves.make(edge, runs, tile);
            let amplitude = waves.amplitude();
            carrier.turn::<false>(tile, amplitude, waves.in_phase(), sums);
            if let Some(wave) = waves.quadrature() {
                carrier.turn::<true>(tile, amplitude, wave, sums);
            }
        }
        for (sums, (i, q)) in sums.iter().zip(i.chunks_mut(GROUP).zip(q.chunks_mut(GROUP))) {
            add_to(&sums.i_before, &sums.i_after, i);
            add_to(&sums.q_before, &sums.q_after, q);
        }
    }
}

impl Carrier {
    #[inline(always)]
    fn new(run: &Run<'_>) -> Self {
        let half = run.turns_step >> 1;
        let middle = run.turns.wrapping_add(run.turns_step.wrapping_mul(LANES as u64 - 1)).wrapping_add(half);
        let tiles = cos_sin(&ramp(middle, run.turns_step.wrapping_mul(TILE as u64)));
        let groups = cos_sin(&ramp(0, run.turns_step.wrapping_mul(GROUP as u64)));
        Self { place: cos_sin(&ramp(half, run.turns_step)), groups, tiles }
    }

    /// Adds a wave of a tile, turned by the carrier: in phase with it, or a quarter of a turn ahead.
    #[inline(always)]
    fn turn<const AHEAD: bool>(&self, tile: usize, amplitude: f64, wave: &[f64; TILE], sums: &mut [Sums; GROUPS]) {
        let Self { place: (cos, sin), groups, tiles } = self;
        let (Some(tile_re), Some(tile_im)) = (tiles.0.get(tile), tiles.1.get(tile)) else { return };
        let (tile_re, tile_im) = (amplitude * tile_re, amplitude * tile_im);
        let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            re[k] = tile_re * groups.0[k] - tile_im * groups.1[k];
            im[k] = tile_re * groups.1[k] + tile_im * groups.0[k];
        }
        for (((sums, wave), re), im) in sums.iter_mut().zip(wave.as_chunks::<GROUP>().0).zip(re).zip(im) {
            let (mut before, mut after) = ([0.0; LANES], [0.0; LANES]);
            for k in 0..LANES {
                (before[k], after[k]) = (wave[LANES - 1 - k], wave[LANES + k]);
            }
            // A copy, which shares its memory with nothing else.
            let mut sum = *sums;
            for k in 0..LANES {
                let (a, b, c, d) = (re * cos[k], im * sin[k], re * sin[k], im * cos[k]);
                if AHEAD {
                    sum.i_before[k] -= before[k] * (d - c);
                    sum.q_before[k] += before[k] * (a + b);
                    sum.i_after[k] -= after[k] * (d + c);
                    sum.q_after[k] += after[k] * (a - b);
                } else {
                    sum.i_before[k] += before[k] * (a + b);
                    sum.q_before[k] += before[k] * (d - c);
                    sum.i_after[k] += after[k] * (a - b);
                    sum.q_after[k] += after[k] * (d + c);
                }
            }
            *sums = sum;
        }
    }
}

/// Adds sums to a group, or to as much of it as there is.
#[inline(always)]
fn add_to(before: &Side, after: &Side, out: &mut [f32]) {
    let mut sums = [0.0; GROUP];
    for k in 0..LANES {
        (sums[LANES - 1 - k], sums[LANES + k]) = (before[k] as f32, after[k] as f32);
    }
    if let Some(out) = out.first_chunk_mut::<GROUP>() {
        for k in 0..GROUP {
            out[k] += sums[k];
        }
    } else {
        for (out, sum) in out.iter_mut().zip(sums) {
            *out += sum;
        }
    }
}

/// Phases `start`, `start + step` and on, in 2^-64 turn.
#[inline(always)]
fn ramp(start: u64, step: u64) -> [u64; LANES] {
    let mut turns = [0; LANES];
    for (turns, k) in turns.iter_mut().zip(0..) {
        *turns = start.wrapping_add(step.wrapping_mul(k));
    }
    turns
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
    use crate::synth::band::Filter;
    use crate::synth::chips::CodeTime;
    use crate::synth::waveform::plain;
    use crate::synth::{CODE_ONE, radians, reference};
    use gnss::gps::l1ca::L1_CA;

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
        let filter = Filter::default();
        let spreading = plain(&L1_CA, 11).unwrap();
        for rate_hz in [0.9e6, 2.046e6, 2.6e6, 25e6] {
            for edge in [Edge::Nearest, Edge::Area, Edge::BandLimited(&filter)] {
                for length in [1, 15, 16, 17, 4096] {
                    let step = (1.023e6 / rate_hz * CODE_ONE as f64) as u64;
                    let at = CodeTime::new(8, 1020 * CODE_ONE + length as u64 * (CODE_ONE / 131));
                    let mut bits = Vec::new();
                    let position = spreading.strip(at, step, length, |period| period % 2 == 1, &mut bits);
                    let turns_step = 0x0765_4321_0fed_cba9;
                    let run = Run {
                        bits: &bits,
                        position,
                        step,
                        turns: 0x1234 << 48,
                        turns_step,
                        amplitude: 1.0,
                        pulse: None,
                    };
                    let (mut i, mut q, mut scratch) = (vec![0.0; length], vec![0.0; length], Scratch::default());
                    let (mut ri, mut rq) = (i.clone(), q.clone());
                    accumulate(edge, &[&[run]], &mut i, &mut q, &mut scratch);
                    reference::accumulate(edge, &run, &mut ri, &mut rq);
                    for n in 0..length {
                        // One f32 rounding of a value up to 1.2; f64 sums in another order leave 1e-15,
                        // responses 3e-9.
                        let error = (i[n] - ri[n]).abs().max((q[n] - rq[n]).abs());
                        assert!(error < 1.3e-7, "{edge:.0?} {rate_hz} {length} {n} {error}");
                    }
                }
            }
        }
    }
}
