//! Chips behind a band-limiting filter: the response to one whole pulse instead of those to its edges.
//!
//! A chip of BOC(6,1) has twelve edges, and one response replaces theirs. It is tabulated about the
//! chip's middle for positions in cells of a 64th of a sample, as cubic polynomials, and for its lengthening:
//! a Doppler makes a chip longer or shorter than at the nominal rate. Errors: 1e-9 for each edge in reach, as
//! for single edges; the square of the lengthening times that of half a chip's samples, 1e-8 at 3e-5, a
//! satellite in low orbit; and at a sample that an edge's response just reaches, where that has a corner,
//! 6e-7 of the edge. Chips take turns in two sums, so that one need not wait for what the one before has
//! written.

use super::band::{CELLS, Filter, HALF_WIDTH, cubic};
use super::chips::window;
use super::waves::TILE;
use super::{CODE_BITS, CODE_ONE, Run};

/// Values of a block of a response, and most blocks of one.
const BLOCK: usize = 8;
const MOST: usize = 10;
/// Coefficients of a position: four of the cubic polynomial, two of what a lengthening adds.
const TERMS: usize = 6;
/// Values before a tile, and behind it: as many as the response to a chip that does not reach the tile, half
/// a chip away, may have there.
const BORDER: usize = MOST * BLOCK + 32;
/// Sums in which chips take turns.
const SUMS: usize = 2;

/// The response of a filter to a pulse of one chip.
#[derive(Clone, Debug, PartialEq)]
pub struct Pulse {
    /// Levels of equal steps of the chip.
    levels: Vec<f64>,
    /// Chips per sample without a Doppler.
    step: f64,
    /// Blocks of a response.
    blocks: usize,
    /// Polynomial terms by cell and block.
    terms: Vec<[[f64; BLOCK]; TERMS]>,
}

/// Scratch.
#[derive(Clone, Debug)]
pub(super) struct Pulses {
    sums: [[f64; TILE + 2 * BORDER]; SUMS],
    weights: Vec<f64>,
}

impl Default for Pulses {
    fn default() -> Self {
        Self { sums: [[0.0; TILE + 2 * BORDER]; SUMS], weights: Vec::new() }
    }
}

impl Pulse {
    /// The response to a pulse of those levels, of `step` chips per sample; `None` where a chip is longer
    /// than 48 samples.
    pub(super) fn new(filter: &Filter, levels: &[f64], step: f64) -> Option<Self> {
        let blocks = Self::blocks(step)?;
        let mut pulse = Self { levels: levels.to_vec(), step, blocks, terms: Vec::new() };
        // A chip's middle lies behind sample number `before` − 1 of the response.
        let before = blocks * BLOCK / 2;
        for cell in 0..CELLS {
            let place = |within: f64| (cell as f64 + within) / CELLS as f64;
            for block in 0..blocks {
                let mut terms = [[0.0; BLOCK]; TERMS];
                for k in 0..BLOCK {
                    let since = |within: f64| (block * BLOCK + k + 1) as f64 - before as f64 - place(within);
                    let [a, b, c, d] = cubic(|within| pulse.response(filter, since(within), 0.0));
                    let [first, last] = [0.25, 0.75].map(|within| pulse.stretch(filter, since(within)));
                    let of_one = [a, b, c, d, 1.5 * first - 0.5 * last, 2.0 * (last - first)];
                    terms.iter_mut().zip(of_one).for_each(|(term, value)| term[k] = value);
                }
                pulse.terms.push(terms);
            }
        }
        Some(pulse)
    }

    /// Blocks of the response to a chip at so many chips per sample.
    pub(super) fn blocks(step: f64) -> Option<usize> {
        let half = HALF_WIDTH as f64 + 0.5 / step;
        let taps = 2 * half.ceil() as usize;
        (1..=MOST).find(|blocks| blocks * BLOCK >= taps)
    }

    /// True if the pulse is the response to these levels.
    pub(super) fn is_of(&self, levels: &[f64], step: f64) -> bool {
        self.levels == levels && self.step == step
    }

    /// The response so many samples behind the middle of a chip that is longer by the factor 1 + `stretch`:
    /// the definition.
    pub(super) fn response(&self, filter: &Filter, since: f64, stretch: f64) -> f64 {
        let samples = (1.0 + stretch) / self.step;
        self.edges(|from_middle, change| change * filter.step(since - from_middle * samples))
    }

    /// Derivative of the response with respect to the relative lengthening of the chip.
    fn stretch(&self, filter: &Filter, since: f64) -> f64 {
        // The response's slope over the finest points of the filter's own table.
        const BESIDE: f64 = 1.0 / 4096.0;
        let slope = |x: f64| (filter.step(x + BESIDE) - filter.step(x - BESIDE)) / (2.0 * BESIDE);
        self.edges(|from_middle, change| {
            let samples = from_middle / self.step;
            -change * samples * slope(since - samples)
        })
    }

    /// Sum over the edges of a chip of a function of each edge's position from the middle, in chips, and its
    /// height.
    fn edges(&self, of: impl Fn(f64, f64) -> f64) -> f64 {
        let steps = self.levels.len() as f64;
        let (mut sum, mut before) = (0.0, 0.0);
        for (number, level) in self.levels.iter().chain([&0.0]).enumerate() {
            if *level != before {
                sum += of(number as f64 / steps - 0.5, level - before);
            }
            before = *level;
        }
        sum
    }

    /// Relative lengthening of a run's chips by the Doppler.
    fn stretch_of(&self, run: &Run<'_>) -> f64 {
        self.step * CODE_ONE as f64 / run.step as f64 - 1.0
    }

    /// The wave of a run at a position, chip by chip: the definition.
    pub(super) fn waveform(&self, filter: &Filter, run: &Run<'_>, position: u64) -> f64 {
        let reach = (self.blocks * BLOCK) as u64 * run.step;
        let stretch = self.stretch_of(run);
        let (first, last) = ((position - reach) / CODE_ONE, (position + reach) / CODE_ONE);
        (first..=last)
            .map(|chip| {
                let middle = chip * CODE_ONE + CODE_ONE / 2;
                let since = (position.wrapping_sub(middle) as i64) as f64 / run.step as f64;
                super::chips::sign(run.bits, chip as usize) * self.response(filter, since, stretch)
            })
            .sum()
    }
}

impl Pulses {
    /// Adds the pulses of runs that have their chips at the same positions over a tile, of which the first of
    /// `run` is the first sample: of each its bits and amplitude.
    #[inline(always)]
    pub fn add<'r>(
        &mut self,
        pulse: &Pulse,
        run: &Run<'_>,
        together: impl Iterator<Item = (&'r [u64], f64)>,
        sum: &mut [f64; TILE],
    ) {
        // No chip whose middle is farther away reaches the tile.
        let reach = (pulse.blocks * BLOCK / 2 + 1) as u64 * run.step;
        let first = (run.position - reach) / CODE_ONE;
        let last = (run.position + run.step * TILE as u64 + reach) / CODE_ONE;
        self.weights.clear();
        self.weights.resize((last - first + 1) as usize, 0.0);
        for (bits, amplitude) in together {
            for (weights, from) in self.weights.chunks_mut(64).zip((first..).step_by(64)) {
                let signs = window(bits, from as usize);
                for (weight, k) in weights.iter_mut().zip(0..) {
                    *weight += f64::from_bits(amplitude.to_bits() ^ (signs << k & 1 << 63));
                }
            }
        }
        self.add_responses(pulse, run, first);
        let [a, b] = &mut self.sums;
        for (k, sum) in sum.iter_mut().enumerate() {
            *sum += a[BORDER + k] + b[BORDER + k];
        }
        a.fill(0.0);
        b.fill(0.0);
    }

    /// Adds the responses, in their turns.
    #[inline(always)]
    fn add_responses(&mut self, pulse: &Pulse, run: &Run<'_>, first: u64) {
        let stretch = pulse.stretch_of(run);
        let samples = CODE_ONE as f64 / run.step as f64;
        let each = (samples * CODE_ONE as f64) as u64;
        // Of the first chip's middle, in 2^-48 sample from the border on.
        let middle = (first * CODE_ONE + CODE_ONE / 2).wrapping_sub(run.position) as i64;
        let mut place = ((BORDER as u64) << CODE_BITS).wrapping_add_signed((middle as f64 * samples) as i64);
        for (weight, number) in self.weights.iter().zip(0..) {
            let cell = (place >> (CODE_BITS - CELLS.ilog2())) as usize % CELLS;
            let within = f64::from_bits(place << (64 - CODE_BITS + CELLS.ilog2()) >> 12 | 1.0_f64.to_bits()) - 1.0;
            let begin = ((place >> CODE_BITS) as usize + 1).wrapping_sub(pulse.blocks * BLOCK / 2);
            place = place.wrapping_add(each);
            for block in 0..pulse.blocks {
                let from = begin.wrapping_add(block * BLOCK);
                let sum = self.sums[number % SUMS].get_mut(from..).and_then(|sum| sum.first_chunk_mut());
                if let (Some(sum), Some(terms)) = (sum, pulse.terms.get(cell * pulse.blocks + block)) {
                    *sum = with_response(*sum, terms, within, stretch, *weight);
                }
            }
        }
    }
}

/// A sum with a response at a position within a cell and with a lengthening, times its weight.
#[inline(always)]
fn with_response(
    mut sum: [f64; BLOCK],
    [a, b, c, d, e, f]: &[[f64; BLOCK]; TERMS],
    x: f64,
    stretch: f64,
    weight: f64,
) -> [f64; BLOCK] {
    for k in 0..BLOCK {
        let constant = a[k] + stretch * e[k];
        let slope = b[k] + stretch * f[k];
        sum[k] += weight * (constant + x * (slope + x * (c[k] + x * d[k])));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::chips::MARGIN_STEPS;

    #[test]
    fn a_tile_is_the_sum_of_the_responses_to_its_edges_wherever_chips_fall_and_however_fast_they_move() {
        let filter = Filter::default();
        let mut scratch = Pulses::default();
        let mut word = 0x9e37_79b9_7f4a_7c15_u64;
        let bits: Vec<u64> = std::iter::repeat_with(|| {
            word ^= word << 13;
            word ^= word >> 7;
            word ^= word << 17;
            word
        })
        .take(40)
        .collect();
        // BOC(6,1) with BOC(1,1), a pulse with zeros, and one that begins and ends on different sides.
        let composite = [1.2, 0.6, 1.2, 0.6, 1.2, 0.6, -0.6, -1.2, -0.6, -1.2, -0.6, -1.2];
        for levels in [&composite[..], &[1.0, 0.0], &[1.0, 1.0, -1.0, 1.0]] {
            for samples in [2.54, 4.0, 6.35, 10.2, 24.4, 47.9] {
                let pulse = Pulse::new(&filter, levels, 1.0 / samples).unwrap();
                for stretch in [0.0, 3e-6, -3e-5] {
                    let step = (CODE_ONE as f64 / (samples * (1.0 + stretch))) as u64;
                    for position in [0, 1, CODE_ONE - 1, step / 3, CODE_ONE / 2 - step / 7] {
                        let position = MARGIN_STEPS * CODE_ONE + position;
                        let run = Run {
                            bits: &bits,
                            position,
                            step,
                            turns: 0,
                            turns_step: 0,
                            amplitude: 1.0,
                            pulse: Some(&pulse),
                        };
                        let mut wave = [0.0; TILE];
                        scratch.add(&pulse, &run, [(&bits[..], 0.75), (&bits[..], -0.25)].into_iter(), &mut wave);
                        // As documented: of each edge in reach, and of the stretch; and of the corner, whose
                        // slope is 7.5e-4 and which a cubic polynomial misses by 0.068 of that times a cell.
                        let edges = levels.len() as f64 * (16.0 / samples + 2.0);
                        let corner = 2.0 * 0.068 * 7.5e-4 / CELLS as f64;
                        let bound = 0.5 * (edges * 1.3e-9 + edges * (stretch * 0.5 * samples).powi(2) + corner);
                        for (n, value) in (0..).zip(wave) {
                            let error = value - 0.5 * pulse.waveform(&filter, &run, position + step * n);
                            assert!(error.abs() < bound, "{levels:?} {samples} {stretch} {n} {error} {bound}");
                        }
                    }
                }
            }
        }
    }
}
