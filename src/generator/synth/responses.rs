//! The band-limited waveform of a run for the `f64` kernel, a tile of samples at a time.
//!
//! It is the square wave, which changes its sign at the first sample behind each change of the code's, plus
//! at each change the filter's response less the change itself. Positions of changes are counted in 2^-48
//! sample from the tile on (error below 2^-35). Changes take turns in three sums, so that one need not wait
//! for what the one before has written where they reach the same samples.
//!
//! Where at most nine changes reach a sample the sums are whole numbers of 2^-29, exact in any order. A
//! response is within 3e-9 there, and nine of them within 2.7e-8: less than the rounding of a sum of `f32`
//! that is above a half. For longer steps responses are `f64`, within 1e-9.

use std::slice::IterMut;

use super::band::{CELLS, Cell, Filter, HALF_WIDTH, UNIT, UNIT_CELLS, UNITS, UnitCell, WIDTH};
use super::{CODE_BITS, CODE_ONE, Run};

/// Samples that are made at a time.
pub const TILE: usize = 512;
/// Positions before a tile, as many as a word of signs has.
const BORDER: usize = 64;
/// Positions that are counted before they begin again: a tile, its borders, and room for what is not used.
const PLACES: usize = 1024;
/// Words of signs of all positions.
const WORDS: usize = PLACES / 64;
/// Position of changes that reach no sample.
const NOWHERE: u64 = ((TILE + 2 * BORDER) as u64) << CODE_BITS;
/// Sums in which changes take turns.
const SUMS: usize = 3;
/// Values of a sum. Those of equal positions in two sums are no multiple of 4096 bytes apart, which a
/// processor would take for the same position for a while.
const LENGTH: usize = PLACES + 128;
/// Index of the tile in a sum: each value is delayed by half a response.
const BODY: usize = BORDER + HALF_WIDTH;
/// Longest step, in 2^-48 code steps, at which a sample has no more than nine changes in its reach.
const LONGEST_IN_UNITS: u64 = CODE_ONE / 2;
/// Steps below which the responses of two changes never reach the same sample.
const LONGEST_APART: u64 = CODE_ONE / WIDTH as u64;

/// A number of which responses are made.
trait Number: Copy {
    /// Responses to changes in a part of a sample.
    type Cell;
    /// Position of a change within its cell.
    type Within: Copy;
    const ZERO: Self;

    fn cells(filter: &Filter) -> &[Self::Cell];
    fn within(place: u64) -> Self::Within;
    /// The cell of a position; their number is a power of two.
    fn cell(place: u64) -> usize;
    fn response(cell: &Self::Cell, within: Self::Within) -> [Self; WIDTH];
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    /// Ones with the signs of a word, from its lowest bit on.
    fn ones(signs: u64) -> [Self; 64];
    fn value(self) -> f64;
}

impl Number for f64 {
    type Cell = Cell;
    type Within = f64;
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn cells(filter: &Filter) -> &[Cell] {
        filter.cells()
    }

    #[inline(always)]
    fn within(place: u64) -> f64 {
        // Between one and two.
        f64::from_bits(place << (64 - CODE_BITS + CELLS.ilog2()) >> 12 | 1.0_f64.to_bits()) - 1.0
    }

    #[inline(always)]
    fn cell(place: u64) -> usize {
        (place >> (CODE_BITS - CELLS.ilog2())) as usize % CELLS
    }

    #[inline(always)]
    fn response(cell: &Cell, within: f64) -> [Self; WIDTH] {
        cell.at(within)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self - other
    }

    #[inline(always)]
    fn ones(signs: u64) -> [Self; 64] {
        let mut ones = [0.0; 64];
        for (one, k) in ones.iter_mut().zip(0..) {
            *one = f64::from_bits(1.0_f64.to_bits() ^ (signs << (63 - k) & 1 << 63));
        }
        ones
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
}

impl Number for i32 {
    type Cell = UnitCell;
    type Within = f32;
    const ZERO: Self = 0;

    #[inline(always)]
    fn cells(filter: &Filter) -> &[UnitCell] {
        filter.unit_cells()
    }

    #[inline(always)]
    fn within(place: u64) -> f32 {
        let parts = (place >> (CODE_BITS - UNIT_CELLS.ilog2() - 32)) as u32;
        (parts ^ 1 << 31) as i32 as f32 * (1.0 / 4_294_967_296.0)
    }

    #[inline(always)]
    fn cell(place: u64) -> usize {
        (place >> (CODE_BITS - UNIT_CELLS.ilog2())) as usize % UNIT_CELLS
    }

    #[inline(always)]
    fn response(cell: &UnitCell, within: f32) -> [Self; WIDTH] {
        cell.at(within)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.wrapping_add(other)
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.wrapping_sub(other)
    }

    #[inline(always)]
    fn ones(signs: u64) -> [Self; 64] {
        let mut ones = [0; 64];
        for (ones, signs) in ones.as_chunks_mut::<32>().0.iter_mut().zip([signs as u32, (signs >> 32) as u32]) {
            for (one, k) in ones.iter_mut().zip(0..) {
                *one = UNITS - ((signs << (31 - k) & 1 << 31) >> 1) as i32;
            }
        }
        ones
    }

    #[inline(always)]
    fn value(self) -> f64 {
        f64::from(self) * UNIT
    }
}

/// Values of one sum.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Sum<T>([T; LENGTH]);

/// Sums of responses, zero between tiles, and where in their cells the changes are.
#[derive(Clone, Debug)]
struct Sums<T: Number> {
    sums: [Sum<T>; SUMS],
    within: Vec<T::Within>,
}

/// Scratch.
#[derive(Clone, Debug, Default)]
pub struct Responses {
    changes: Changes,
    units: Sums<i32>,
    doubles: Sums<f64>,
}

/// Changes of sign that reach a tile.
#[derive(Clone, Debug, Default)]
struct Changes {
    /// The number of the first sample behind each, of which the tile's first has that of the border, and how
    /// far the change is behind the sample before it, in 2^-48 sample. Rising and falling ones take turns, a
    /// rising one first.
    places: Vec<u64>,
    /// The sign before the first of them in all bits.
    before: u64,
}

impl<T: Number> Default for Sums<T> {
    fn default() -> Self {
        Self { sums: [Sum([T::ZERO; LENGTH]); SUMS], within: Vec::new() }
    }
}

/// Vectors of eight doubles, or of as many bytes, in the response to an edge at so many steps per sample.
pub(super) fn edge_vectors(step: f64) -> f64 {
    if step * CODE_ONE as f64 <= LONGEST_IN_UNITS as f64 { 1.0 } else { 2.0 }
}

/// Writes the code behind the filter at the samples of a tile, of which the run's first is the first.
#[inline(always)]
pub fn waveform(filter: &Filter, run: &Run<'_>, wave: &mut [f64; TILE], scratch: &mut Responses) {
    let Responses { changes, units, doubles } = scratch;
    // Rising and falling changes in each sum at a time.
    const TOGETHER: usize = 2 * SUMS;
    if run.step < LONGEST_APART {
        changes.find(run, 2);
        units.make::<1, 2>(filter, changes, wave);
    } else {
        changes.find(run, TOGETHER);
        if run.step <= LONGEST_IN_UNITS {
            units.make::<SUMS, TOGETHER>(filter, changes, wave);
        } else {
            doubles.make::<SUMS, TOGETHER>(filter, changes, wave);
        }
    }
}

impl<T: Number> Sums<T> {
    /// The waveform of a tile with the changes in the first `N` sums, so many at a time.
    #[inline(always)]
    fn make<const N: usize, const TOGETHER: usize>(
        &mut self,
        filter: &Filter,
        changes: &Changes,
        wave: &mut [f64; TILE],
    ) {
        self.within.clear();
        self.within.resize(changes.places.len(), T::within(0));
        for (within, place) in self.within.iter_mut().zip(&changes.places) {
            *within = T::within(*place);
        }
        let turns = self.add::<N, TOGETHER>(T::cells(filter), &changes.places);
        self.take::<N>(&turns, changes.before, wave);
    }

    /// Adds the responses, and returns in which positions the sign changes.
    #[inline(always)]
    fn add<const N: usize, const TOGETHER: usize>(&mut self, cells: &[T::Cell], places: &[u64]) -> [u64; WORDS] {
        let mut turns = [0; WORDS];
        for (places, within) in places.as_chunks::<TOGETHER>().0.iter().zip(self.within.as_chunks::<TOGETHER>().0) {
            for k in 0..TOGETHER {
                let at = (places[k] >> CODE_BITS) as usize % PLACES;
                let sum = self.sums[k % N].0[at..].first_chunk_mut::<WIDTH>();
                let (Some(sum), Some(cell)) = (sum, cells.get(T::cell(places[k]))) else { continue };
                *sum = added(*sum, T::response(cell, within[k]), k % 2 == 1);
            }
            for place in places {
                turns[(place >> (CODE_BITS + 6)) as usize % WORDS] ^= 1 << ((place >> CODE_BITS) % 64);
            }
        }
        turns
    }

    /// Takes the tile's values out of the first `N` sums, which are zero again, with the square wave.
    #[inline(always)]
    fn take<const N: usize>(&mut self, turns: &[u64; WORDS], before: u64, wave: &mut [f64; TILE]) {
        let [a, b, c] = &mut self.sums;
        let [border, turns @ ..] = turns;
        let mut before = before ^ highest_of(turned(*border));
        for (word, wave) in wave.as_chunks_mut::<64>().0.iter_mut().enumerate() {
            let signs = turned(turns[word]);
            let ones = T::ones(signs ^ before);
            before ^= highest_of(signs);
            for k in 0..64 {
                let n = BODY + 64 * word + k;
                let mut sum = a.0[n].plus(ones[k]);
                a.0[n] = T::ZERO;
                if N == SUMS {
                    sum = sum.plus(b.0[n].plus(c.0[n]));
                    b.0[n] = T::ZERO;
                    c.0[n] = T::ZERO;
                }
                wave[k] = sum.value();
            }
        }
        // What reaches beyond the tile.
        for sum in self.sums.iter_mut().take(N) {
            sum.0[BODY - WIDTH..BODY].fill(T::ZERO);
            sum.0[BODY + TILE..BODY + TILE + WIDTH].fill(T::ZERO);
        }
    }
}

/// A sum with a response of a change up or down.
#[inline(always)]
fn added<T: Number>(mut sum: [T; WIDTH], response: [T; WIDTH], down: bool) -> [T; WIDTH] {
    for k in 0..WIDTH {
        sum[k] = if down { sum[k].minus(response[k]) } else { sum[k].plus(response[k]) };
    }
    sum
}

/// Signs of a word that turn at each bit that is set, from the lowest on.
#[inline(always)]
fn turned(mut bits: u64) -> u64 {
    for shift in [1, 2, 4, 8, 16, 32] {
        bits ^= bits << shift;
    }
    bits
}

/// A word's highest bit in all its positions.
#[inline(always)]
fn highest_of(bits: u64) -> u64 {
    (bits as i64 >> 63) as u64
}

impl Changes {
    /// Finds the changes that reach the tile at the run's beginning. Changes without effect fill the list up
    /// to a multiple of `together`.
    #[inline(always)]
    fn find(&mut self, run: &Run<'_>, together: usize) {
        let reach = HALF_WIDTH as u64 * run.step;
        let first = (run.position - reach) / CODE_ONE + 1;
        let last = (run.position + run.step * TILE as u64 + reach) / CODE_ONE;
        // A sample early: a change takes the number of the sample behind it.
        let origin = run.position.wrapping_sub(run.step.wrapping_mul(BORDER as u64 + 1));
        let one = CODE_ONE as f64;
        let per_step = one / run.step as f64;
        let place = ((first * CODE_ONE).wrapping_sub(origin) as i64 as f64 * per_step) as i64 as u64;
        let each = (per_step * one) as i64 as u64;
        // One more where the first one falls.
        self.places.resize(((last - first) as usize + 2).next_multiple_of(together), NOWHERE);
        self.before = highest_of(word(run.bits, (first - 1) / 64) << ((first - 1) % 64));
        let mut slots = self.places.iter_mut();
        if self.before == 0 {
            put(&mut slots, NOWHERE);
        }
        for number in first / 64..=last / 64 {
            let mut left = changes(run.bits, number);
            if number == first / 64 {
                left &= u64::MAX << (first % 64);
            }
            if number == last / 64 {
                left &= u64::MAX >> (63 - last % 64);
            }
            let place = place.wrapping_add((64 * number).wrapping_sub(first).wrapping_mul(each));
            while left != 0 {
                put(&mut slots, place.wrapping_add(each.wrapping_mul(u64::from(left.trailing_zeros()))));
                left &= left - 1;
            }
        }
        for _ in 0..slots.len() % together {
            put(&mut slots, NOWHERE);
        }
        let unused = slots.len();
        self.places.truncate(self.places.len() - unused);
    }
}

/// Puts a position into the next slot.
#[inline(always)]
fn put(slots: &mut IterMut<'_, u64>, place: u64) {
    if let Some(slot) = slots.next() {
        *slot = place;
    }
}

/// A word of signs; zeros where the strip has none.
#[inline(always)]
fn word(bits: &[u64], number: u64) -> u64 {
    bits.get(number as usize).copied().unwrap_or(0)
}

/// Steps of a word whose sign is not that of the step before, from the lowest bit on.
#[inline(always)]
fn changes(bits: &[u64], number: u64) -> u64 {
    let before = number.checked_sub(1).map_or(0, |number| word(bits, number));
    let signs = word(bits, number);
    (signs ^ (signs >> 1 | before << 63)).reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Edge;
    use crate::synth::chips::{MARGIN_STEPS, MAX_STEP};
    use crate::synth::reference;

    #[test]
    fn a_tile_is_the_definition_wherever_changes_fall() {
        let filter = Filter::default();
        let mut scratch = Responses::default();
        // Xorshift; and changes at every step.
        let mut word = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = || {
            word ^= word << 13;
            word ^= word >> 7;
            word ^= word << 17;
            word
        };
        for bits in [(0..200).map(|_| random()).collect(), vec![0x5555_5555_5555_5555; 200]] {
            let bits: Vec<u64> = bits;
            let longest = MAX_STEP as u64 * CODE_ONE - 12_345;
            for step in [CODE_ONE / 25 + 1, CODE_ONE / 16, 11 * CODE_ONE / 26, CODE_ONE / 2, CODE_ONE, longest] {
                // On samples, as near to them as positions are counted, and between them.
                let first = MARGIN_STEPS * CODE_ONE;
                for position in [first, first + 1, first + CODE_ONE - 1, first + step / 3] {
                    let run = Run { bits: &bits, position, step, turns: 0, turns_step: 0, amplitude: 1.0, pulse: None };
                    let mut wave = [0.0; TILE];
                    waveform(&filter, &run, &mut wave, &mut scratch);
                    // As documented for each of the changes in reach.
                    let changes = 2.0 * HALF_WIDTH as f64 * step as f64 / CODE_ONE as f64 + 1.0;
                    let bound = changes * if step <= LONGEST_IN_UNITS { 3e-9 } else { 1e-9 };
                    for (n, value) in wave.iter().enumerate() {
                        let place = position + step * n as u64;
                        let error = value - reference::waveform(Edge::BandLimited(&filter), &run, place);
                        assert!(error.abs() < bound, "{step} {position} {n} {error}");
                    }
                }
            }
        }
    }
}
