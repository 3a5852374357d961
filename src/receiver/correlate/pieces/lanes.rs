//! Groups of pieces in plain Rust: what [`super::kernel`] does eight pieces at a time, in the same order.

use super::super::sums::Sums;
use super::{GROUP, GROUPS};

/// Fraction bits of a position in samples.
pub(super) const PLACE_BITS: u32 = 16;
/// Fraction bits of the products that give a position.
pub(super) const PRODUCT_BITS: u32 = 26;
/// Pairs of sums side by side: half a group.
pub(super) const PAIRS: usize = GROUP / 2;
/// The pieces of either half of a group, as two instructions part them.
const HALVES: [[usize; PAIRS]; 2] = [[0, 1, 4, 5], [2, 3, 6, 7]];
/// sin 2πy = y·(…y²) for |y| ≤ 1/4 to 5e-6: coefficients of the polynomial that is nearest at Chebyshev's
/// positions.
pub(super) const SINE: [f32; 4] = [6.283_180_5, -41.339_246, 81.408_01, -71.607_68];
/// Taps that a window serves.
pub(super) const WINDOW_TAPS: usize = 3;
/// Turns of an integer phase of 32 bits.
pub(super) const TURNS: f32 = 1.0 / 4_294_967_296.0;

/// Chunk of up to [`GROUPS`] groups, with their positions among the samples.
pub(super) struct Chunk<'a, const T: usize> {
    pub starts: &'a [[u32; GROUP]],
    pub middles: &'a [[u32; GROUP]],
    pub levels: &'a [[f32; GROUP]],
    pub sums: Sums<'a>,
    /// Offset that is subtracted from all entries, in-phase and quadrature.
    pub base: [i32; 2],
    /// The entry from which positions count, which may lie before the first one.
    pub origin: isize,
    /// Positions of the first and after the last sample.
    pub bounds: [i32; 2],
    /// Position of the start at step 0, in 2⁻²⁶ samples.
    pub place: i64,
    /// Increment of the position for each step, in 2⁻²⁶ samples.
    pub samples_a_step: u32,
    /// Shifts of the taps that are added to a position.
    pub taps: [i32; T],
    /// Phase of the middle at half step 0, in 2⁻³² turns.
    pub phase: u32,
    /// Increment of the phase for each half step, in 2⁻³² turns.
    pub phase_a_step: u32,
    /// Samples between early, prompt and late.
    pub apart: f32,
}

/// Sums of cosines and of sines of the carrier with (in-phase, quadrature) pairs, a tap.
pub(super) struct Products<const T: usize> {
    pub cos: [[f32; 2 * PAIRS]; T],
    pub sin: [[f32; 2 * PAIRS]; T],
    /// The replica's value times the phasor, of the piece before.
    pub last: [f32; 2],
}

impl<const T: usize> Products<T> {
    /// Nothing so far.
    pub fn after(last: [f32; 2]) -> Self {
        Self { cos: [[0.0; 2 * PAIRS]; T], sin: [[0.0; 2 * PAIRS]; T], last }
    }
}

/// Cosine and sine of a phase.
#[inline(always)]
pub(super) fn phasor(phase: u32) -> [f32; 2] {
    let turns = phase as i32 as f32 * TURNS;
    let sine = |y: f32| {
        let z = y * y;
        y * (SINE[0] + z * (SINE[1] + z * (SINE[2] + z * SINE[3])))
    };
    let quarter = 0.25 - turns.abs();
    // Beyond a quarter a sine goes back.
    let folded = f32::from_bits((0.25 - quarter.abs()).to_bits() | (turns.to_bits() & 0x8000_0000));
    [sine(quarter), sine(folded)]
}

/// Groups `from` to `to` of a chunk, taps wherever they are; positions beyond the samples are held at their
/// ends.
pub(super) fn anywhere<const T: usize>(chunk: &Chunk<T>, groups: (usize, usize), products: &mut Products<T>) {
    let mut own = Products::after(products.last);
    let gains = changes(chunk, groups, &mut own.last);
    each_tap(chunk, groups.0, &gains, 0, &mut own);
    add(products, &own);
}

/// Sums of groups where the first three taps are at most one sample apart: early, prompt and late. They come
/// from the four entries about the prompt's position, all of which exist.
pub(super) fn window<const T: usize>(chunk: &Chunk<T>, groups: (usize, usize), products: &mut Products<T>) {
    let mut own = Products::after(products.last);
    let gains = changes(chunk, groups, &mut own.last);
    for (g, gains) in (groups.0..).zip(&gains) {
        for (k, pair) in in_order() {
            let at = place(chunk, g, k);
            let f = fraction(at);
            let (early, late) = (f - chunk.apart, f + chunk.apart);
            let shares = [early.max(0.0), early.min(0.0), late.min(1.0), (late - 1.0).max(0.0)];
            for c in 0..2 {
                let s = |n: isize| sum(chunk, at, n, c);
                let less = |a: i32, b: i32| a.wrapping_sub(b) as f32;
                let [before, here, after] = [less(s(0), s(-1)), less(s(1), s(0)), less(s(2), s(1))];
                let begun = less(s(0), chunk.base[c]);
                let values = [
                    begun + (shares[0] * here + shares[1] * before),
                    begun + f * here,
                    begun + (shares[2] * here + shares[3] * after),
                ];
                for (t, value) in values.into_iter().enumerate().take(T) {
                    own.cos[t][2 * pair + c] += gains[k][0] * value;
                    own.sin[t][2 * pair + c] += gains[k][1] * value;
                }
            }
        }
    }
    each_tap(chunk, groups.0, &gains, WINDOW_TAPS, &mut own);
    add(products, &own);
}

/// Taps from number `first` on, one after the other.
fn each_tap<const T: usize>(
    chunk: &Chunk<T>,
    from: usize,
    gains: &[[[f32; 2]; GROUP]],
    first: usize,
    own: &mut Products<T>,
) {
    for t in first..T {
        for (g, gains) in (from..).zip(gains) {
            for (k, pair) in in_order() {
                let at = (place(chunk, g, k) + chunk.taps[t]).max(chunk.bounds[0]).min(chunk.bounds[1]);
                let f = fraction(at);
                for c in 0..2 {
                    let (a, b) = (sum(chunk, at, 0, c), sum(chunk, at, 1, c));
                    let value = a.wrapping_sub(chunk.base[c]) as f32 + f * b.wrapping_sub(a) as f32;
                    own.cos[t][2 * pair + c] += gains[k][0] * value;
                    own.sin[t][2 * pair + c] += gains[k][1] * value;
                }
            }
        }
    }
}

/// Sum of the samples before the one at a position, or `beyond` positions further.
fn sum<const T: usize>(chunk: &Chunk<T>, at: i32, beyond: isize, c: usize) -> i32 {
    let entry = chunk.origin + (at >> PLACE_BITS) as isize + beyond;
    chunk.sums.entries()[entry as usize][c]
}

fn add<const T: usize>(products: &mut Products<T>, own: &Products<T>) {
    for t in 0..T {
        for k in 0..2 * PAIRS {
            products.cos[t][k] += own.cos[t][k];
            products.sin[t][k] += own.sin[t][k];
        }
    }
    products.last = own.last;
}

/// Pieces of a group in the order of their sums, with the pair that takes them.
fn in_order() -> impl Iterator<Item = (usize, usize)> {
    HALVES.iter().flat_map(|half| half.iter().copied().zip(0..))
}

/// Differences across each start: the replica times the phasor before it, less that product after it.
fn changes<const T: usize>(
    chunk: &Chunk<T>,
    (from, to): (usize, usize),
    last: &mut [f32; 2],
) -> Vec<[[f32; 2]; GROUP]> {
    debug_assert!(to.saturating_sub(from) <= GROUPS);
    let of = |g: usize| {
        std::array::from_fn(|k| {
            let [cos, sin] = phasor(chunk.phase.wrapping_add(chunk.middles[g][k].wrapping_mul(chunk.phase_a_step)));
            let now = [cos * chunk.levels[g][k], sin * chunk.levels[g][k]];
            let before = std::mem::replace(last, now);
            [before[0] - now[0], before[1] - now[1]]
        })
    };
    (from..to).map(of).collect()
}

/// Position of a start, in samples with [`PLACE_BITS`] behind the point.
fn place<const T: usize>(chunk: &Chunk<T>, g: usize, k: usize) -> i32 {
    let product = u64::from(chunk.starts[g][k]) * u64::from(chunk.samples_a_step);
    (product.wrapping_add(chunk.place as u64) >> (PRODUCT_BITS - PLACE_BITS)) as i32
}

/// Fraction behind the point of a position.
fn fraction(at: i32) -> f32 {
    f32::from_bits((at as u32 & 0xffff) << (23 - PLACE_BITS) | 0x3f80_0000) - 1.0
}
