//! One way through the table: where pieces are among the samples, and what their sums come to.

use num_complex::Complex64;

use super::super::kernel::Level;
use super::super::sums::Sums;
use super::super::{CODE_BITS, Nco, TURN};
use super::lanes::{Chunk, PAIRS, PLACE_BITS, PRODUCT_BITS, Products, phasor};
use super::{GROUP, GROUPS, LONGEST_CHIPS, MARGIN, MOST_SAMPLES, Pieces, extent, kernel};

/// Positions of chunks are held within 16 bits.
const FARTHEST: f64 = 32_000.0;
/// Unit of the entries.
const HALF: f64 = 0.5;
/// 2³².
const PHASE: f64 = 4_294_967_296.0;

/// Correlates samples over which all taps stay within the table: phases count steps.
pub(super) fn correlate<const T: usize>(
    level: Level,
    pieces: &Pieces,
    sums: Sums,
    nco: &Nco,
    taps: &[i64; T],
) -> [Complex64; T] {
    let way = Way::new(pieces, sums.samples(), nco, taps);
    let entries = sums.entries();
    let base = entries[0];
    let mut totals = [([0.0_f64; 2 * PAIRS], [0.0_f64; 2 * PAIRS]); T];
    let mut bases = ([0.0_f64; 2], [0.0_f64; 2]);
    let mut last = None;
    let mut from = way.groups.0;
    while from < way.groups.1 {
        let to = way.groups.1.min(from + way.most);
        let chunk = way.chunk(pieces, sums, (from, to), taps);
        let before = last.unwrap_or_else(|| way.before(pieces, &chunk, from));
        let mut products = Products::after(before);
        let inner = [way.inner.0, way.inner.1].map(|group| group.clamp(from, to) - from);
        kernel::add(level, &chunk, inner, &mut products);
        for (total, (cos, sin)) in totals.iter_mut().zip(products.cos.iter().zip(&products.sin)) {
            total.0.iter_mut().zip(cos).for_each(|(total, one)| *total += f64::from(*one));
            total.1.iter_mut().zip(sin).for_each(|(total, one)| *total += f64::from(*one));
        }
        // What the chunk's base is above the first entry meets the sum of all changes.
        let above = [0, 1].map(|c| f64::from(chunk.base[c].wrapping_sub(base[c])));
        let changed = [0, 1].map(|part| f64::from(before[part]) - f64::from(products.last[part]));
        for ((by_cos, by_sin), above) in bases.0.iter_mut().zip(&mut bases.1).zip(above) {
            *by_cos += changed[0] * above;
            *by_sin += changed[1] * above;
        }
        last = Some(products.last);
        from = to;
    }
    let [cos, sin] = last.unwrap_or_default().map(f64::from);
    let end = entries[sums.samples()];
    let whole = [0, 1].map(|c| f64::from(end[c].wrapping_sub(base[c])));
    let mut found = [Complex64::ZERO; T];
    for ((found, (by_cos, by_sin)), tap) in found.iter_mut().zip(&totals).zip(taps) {
        let fold = |sums: &[f64; 2 * PAIRS], c: usize| (0..PAIRS).map(|pair| sums[2 * pair + c]).sum::<f64>();
        let [ci, cq] = [0, 1].map(|c| fold(by_cos, c) + bases.0[c] + cos * whole[c]);
        let [si, sq] = [0, 1].map(|c| fold(by_sin, c) + bases.1[c] + sin * whole[c]);
        // A tap ahead meets each piece so much earlier.
        let [turn_re, turn_im] = phasor(phase(way.turns * (*tap as f64 * way.samples_a_unit))).map(f64::from);
        *found = Complex64::new(ci + sq, cq - si) * Complex64::new(turn_re, turn_im) * HALF;
    }
    found
}

/// Position of the table over the samples.
struct Way {
    /// Phase of the table's steps where the first sample's interval begins.
    begin: i64,
    /// Groups that are met, and those of them about whose positions all four sums are there.
    groups: (usize, usize),
    inner: (usize, usize),
    /// Groups of a chunk at most.
    most: usize,
    samples_a_unit: f64,
    /// Turns of the carrier per sample.
    turns: f64,
    /// Turns of the carrier at the first sample.
    first_turns: f64,
    /// Samples between prompt and the taps beside it.
    apart: f64,
}

impl Way {
    fn new<const T: usize>(pieces: &Pieces, samples: usize, nco: &Nco, taps: &[i64; T]) -> Self {
        let (step, count) = (nco.code_step as i64, samples as i64);
        let (low, high) = extent(taps);
        let begin = nco.code - step / 2 + (MARGIN << CODE_BITS);
        let groups = (seek(pieces, begin + low).saturating_sub(1), seek(pieces, begin + high + step * count));
        let samples_a_unit = 1.0 / step as f64;
        let samples_a_step = samples_a_unit * (1_u64 << CODE_BITS) as f64;
        let apart = taps.first().map_or(0.0, |tap| *tap as f64 * samples_a_unit);
        let is_window =
            matches!(taps.as_slice(), [early, 0, late, ..] if *late == -early) && (0.0..=1.0).contains(&apart);
        // Two samples off either end, so that rounding does not matter.
        let inner = if is_window {
            (seek(pieces, begin + 2 * step), seek(pieces, begin + step * (count - 3)).saturating_sub(1))
        } else {
            (groups.1, groups.1)
        };
        let longest = (GROUP * LONGEST_CHIPS * pieces.steps_per_chip) as f64 * samples_a_step;
        Self {
            begin,
            groups,
            inner: (inner.0.min(inner.1), inner.1),
            most: (MOST_SAMPLES / longest).clamp(1.0, GROUPS as f64) as usize,
            samples_a_unit,
            turns: nco.carrier_step as i64 as f64 / TURN,
            first_turns: nco.carrier as f64 / TURN,
            apart,
        }
    }

    /// Positions and phases are exact at a chunk's first start, and roll on from there.
    fn chunk<'a, const T: usize>(
        &self,
        pieces: &'a Pieces,
        sums: Sums<'a>,
        (from, to): (usize, usize),
        taps: &[i64; T],
    ) -> Chunk<'a, T> {
        let samples_a_step = self.samples_a_unit * (1_u64 << CODE_BITS) as f64;
        let product = (samples_a_step * (1_u64 << PRODUCT_BITS) as f64).round() as u32;
        let phase_a_step = (self.turns * 0.5 * samples_a_step * PHASE).round() as i64 as u32;
        let first = pieces.starts[from][0];
        let at = ((i64::from(first) << CODE_BITS) - self.begin) as f64 * self.samples_a_unit;
        let tap_samples = taps.map(|tap| -(tap as f64 * self.samples_a_unit));
        let reach = tap_samples.iter().fold(2.0_f64, |most, tap| most.max(tap.abs() + 2.0));
        let origin = (at - reach).floor();
        let bound = |sample: f64| (sample - origin).clamp(-FARTHEST, FARTHEST) as i32 * (1 << PLACE_BITS);
        let rounding = 1_i64 << (PRODUCT_BITS - PLACE_BITS - 1);
        let place = ((at - origin + planted!("receiver.sums.place", 0.0, 0.5)) * (1_u64 << PRODUCT_BITS) as f64).round()
            as i64
            + rounding;
        // The middle of the first sample is half a sample after its interval's begin.
        let phase_there = phase(self.first_turns + (at - 0.5) * self.turns);
        Chunk {
            starts: &pieces.starts[from..to],
            middles: &pieces.middles[from..to],
            levels: &pieces.levels[from..to],
            sums,
            // Above this one the sums of a chunk are below 2²⁴ halves, which f32 holds.
            base: sums.entries()[origin.clamp(0.0, sums.samples() as f64) as usize],
            origin: origin as isize,
            bounds: [bound(0.0), bound(sums.samples() as f64)],
            place: place - (u64::from(first) * u64::from(product)) as i64,
            samples_a_step: product,
            taps: tap_samples.map(|samples| (samples * f64::from(1 << PLACE_BITS)).round() as i32),
            phase: phase_there.wrapping_sub((2 * first).wrapping_mul(phase_a_step)),
            phase_a_step,
            apart: planted!("receiver.sums.window", self.apart, -self.apart) as f32,
        }
    }

    /// The replica's value times the phasor, of the piece before group `from`.
    fn before<const T: usize>(&self, pieces: &Pieces, chunk: &Chunk<T>, from: usize) -> [f32; 2] {
        // Before the first group there is no sample.
        let Some(group) = from.checked_sub(1) else { return [0.0; 2] };
        let middle = pieces.middles[group][GROUP - 1];
        let level = pieces.levels[group][GROUP - 1];
        phasor(chunk.phase.wrapping_add(middle.wrapping_mul(chunk.phase_a_step))).map(|part| part * level)
    }
}

/// The first group that begins at a phase of the table's steps or later.
fn seek(pieces: &Pieces, phase: i64) -> usize {
    let starts = &pieces.starts;
    let begins_before = |group: usize| starts.get(group).is_some_and(|of| i64::from(of[0]) << CODE_BITS < phase);
    let step = (phase >> CODE_BITS).max(0) as f64;
    // Pieces are spread evenly enough that this is near.
    let mut group = ((step * pieces.density) as usize / GROUP).min(starts.len());
    while group > 0 && !begins_before(group - 1) {
        group -= 1;
    }
    while begins_before(group) {
        group += 1;
    }
    group
}

/// Turns in 2⁻³².
fn phase(turns: f64) -> u32 {
    ((turns - turns.floor()) * PHASE) as u64 as u32
}
