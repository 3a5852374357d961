//! The correlator by rows: products of 16 bits with replica values from a table, for samples that are few to
//! a chip.
//!
//! A row is a period of the replica, area edges and all, sampled at the signal's nominal code rate. Rows are
//! 1/16 sample apart, and what lies between two of them is their weighted mean. That mean is exact but where
//! a change enters or leaves a sample between the two rows: there the edge is as if smoothed over less than
//! 1/16 sample, with no shift. Values have 8 bits; what rounding does to one edge the next ones make up for.
//! Weights are those of the middle of [`SEGMENT`] samples, in steps of 2⁻¹⁰ sample; what rounding does to one
//! segment the next one makes up for.
//!
//! Samples have 2⁻⁴ of their last bit, phasors 2⁻¹⁵. The carrier stands still over two samples, which costs
//! ω²/4 of the power at ω radians a sample: 0.0002 dB at 5 kHz and 2.6 Msps. Sums are integers, so any order
//! of them gives the same bits. Limits: code rates within [`MOST_APART`] of the nominal one.

use num_complex::Complex64;

use super::carrier::{Carrier, LANES, filled};
use super::fixed::{Fixed, POINT_BITS};
use super::kernel::Level;
use super::{CODE_BITS, MOST_STEPS, Nco, TURN, Wave};
use kernel::{Stretch, Sums, VECTOR, VECTORS};

pub(super) mod kernel;

/// Rows a sample.
const ROWS: usize = 16;
/// Samples whose replica is taken from the same rows.
const SEGMENT: usize = 512;
/// Number of such segments whose products are added in 32 bits.
const SEGMENTS: usize = 2;
/// Entries of a row before the period: half a segment, and a little more.
const BEFORE: usize = SEGMENT / 2 + 2;
/// Entries of a row after the period: a whole segment, and a little more.
const AFTER: usize = SEGMENT + LANES + 2;
/// Value of a step of ±1 in a row.
const AMPLITUDE: f64 = 127.0;
/// The weights of two rows add up to this.
const WEIGHTS: i64 = 64;
/// Bits of a position behind the point.
const PLACE_BITS: u32 = 40;
/// Bits of a position behind a weight's last one.
const FINE_BITS: u32 = PLACE_BITS - (ROWS as i64 * WEIGHTS).ilog2();
/// Undoes the scales of samples, values, weights and phasors.
const SCALE: f64 = 32_768.0 / ((1 << POINT_BITS) as f64 * AMPLITUDE * WEIGHTS as f64 * kernel::UNIT as f64);
/// Samples of a period at most: 256 KiB a satellite.
const MOST_SAMPLES: f64 = 8192.0;
/// Samples from one change to the next at most: with more of them pieces are quicker.
const MOST_SAMPLES_A_CHANGE: f64 = 12.0;
/// Turns of the carrier a sample at most.
const MOST_TURNS: f64 = 0.01;
/// Largest relative error of the code rate against the nominal one: 0.013 sample at a segment's ends.
const MOST_APART: f64 = 5e-5;

/// A period of the replica at every row's position.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    steps_per_chip: i64,
    /// Length of the period in phase units of steps.
    period: i64,
    /// Nominal samples in a phase unit of steps.
    samples_a_unit: f64,
    /// Length of the period in 2⁻⁴⁰ samples.
    places: i64,
    /// Entries of a row, each the value there and that of the next row.
    stride: usize,
    entries: Vec<[i8; 2]>,
}

impl Rows {
    /// Rows of a wave that moves by `code_step` phase units of chips a sample; `None` where there are too
    /// many, and where pieces are quicker.
    pub fn of(wave: &Wave, code_step: u64) -> Option<Self> {
        let length = wave.values.len();
        if wave.steps_per_chip == 0 || code_step == 0 || !(64..MOST_STEPS).contains(&length) {
            return None;
        }
        let unit = (1_u64 << CODE_BITS) as f64;
        let step = (code_step * wave.steps_per_chip as u64) as f64 / unit;
        let samples = length as f64 / step;
        let changes = wave.values.windows(2).filter(|pair| pair[0] != pair[1]).count().max(1);
        if samples > MOST_SAMPLES || samples > MOST_SAMPLES_A_CHANGE * changes as f64 || step > 1.0 {
            return None;
        }
        let stride = BEFORE + samples.ceil() as usize + AFTER;
        // From half a sample before the first entry on.
        let first = -(BEFORE as f64 + 0.5) * step;
        let places = Places::new(&wave.values, (first, step / ROWS as f64), (stride + 2) * ROWS);
        let mut entries = vec![[0; 2]; stride * ROWS];
        kernel::fill(Level::best(), &mut entries, &places, step);
        Some(Self {
            steps_per_chip: wave.steps_per_chip as i64,
            period: (length as i64) << CODE_BITS,
            samples_a_unit: 1.0 / (step * unit),
            places: (samples * (1_i64 << PLACE_BITS) as f64).round() as i64,
            stride,
            entries,
        })
    }

    /// True if rows suit these steps of carrier and code.
    pub fn suit(&self, nco: &Nco) -> bool {
        let samples = nco.code_step as f64 * self.steps_per_chip as f64 * self.samples_a_unit;
        let turns = (nco.carrier_step as i64 as f64 / TURN).abs();
        (samples - 1.0).abs() <= MOST_APART && turns <= MOST_TURNS
    }

    /// Σ x·conj(replica) with the replica at each of `taps`, code phase units ahead of the prompt.
    pub fn correlate<const T: usize>(
        &self,
        level: Level,
        samples: Fixed,
        nco: &Nco,
        taps: &[i64; T],
    ) -> [Complex64; T] {
        let mut found = [Complex64::ZERO; T];
        // Sums of more taps would not stay in registers.
        let (threes, rest) = taps.as_chunks::<3>();
        let (threes_found, rest_found) = found.as_chunks_mut::<3>();
        for (taps, found) in threes.iter().zip(threes_found) {
            *found = self.together(level, samples, nco, taps);
        }
        for (tap, found) in rest.iter().zip(rest_found) {
            [*found] = self.together(level, samples, nco, &[*tap]);
        }
        found
    }

    fn together<const T: usize>(&self, level: Level, samples: Fixed, nco: &Nco, taps: &[i64; T]) -> [Complex64; T] {
        let each = self.steps_per_chip;
        let code = within(within(nco.code, self.period / each) * each, self.period);
        // Both are below 2⁶³, their sum may not be.
        let places = taps.map(|tap| {
            let tap = within(tap * each, self.period);
            if code >= self.period - tap { code - (self.period - tap) } else { code + tap }
        });
        kernel::correlate(level, &Job { rows: self, samples, nco, step: nco.code_step as i64 * each }, places)
    }
}

/// A phase within a period; most are.
#[inline(always)]
fn within(phase: i64, period: i64) -> i64 {
    if (0..period).contains(&phase) { phase } else { phase.rem_euclid(period) }
}

/// Samples and rows of one call.
struct Job<'a> {
    rows: &'a Rows,
    samples: Fixed<'a>,
    nco: &'a Nco,
    /// Phase units of steps a sample.
    step: i64,
}

/// Position of a tap in the table, in 2⁻⁴⁰ samples.
#[derive(Clone, Copy)]
struct Place {
    /// Position of the segment's first sample, less than a period.
    at: i64,
    /// Rounding error that is still to be corrected.
    owed: i64,
}

/// Motion of the positions, in 2⁻⁴⁰ samples.
struct Motion {
    /// Motion per sample, beyond one sample.
    gain: i64,
    period: i64,
    stride: usize,
}

impl Motion {
    fn new(rows: &Rows, step: i64) -> Self {
        let samples = step as f64 * rows.samples_a_unit * (1_i64 << PLACE_BITS) as f64;
        // As near one as rows suit.
        Self { gain: (samples + 0.5) as i64 - (1 << PLACE_BITS), period: rows.places, stride: rows.stride }
    }

    /// The entry of a segment's first sample, and the weights of it and of the next row's, a byte each.
    /// Samples are [`SEGMENT`] or, at the end, less.
    #[inline(always)]
    fn next(&self, place: &mut Place, samples: usize) -> (usize, i16) {
        let samples = samples as i64;
        // At least two samples, at most a period and half a segment more.
        let begin = place.at + place.owed + ((BEFORE as i64) << PLACE_BITS) + ((samples * self.gain) >> 1);
        let fine = (begin + (1 << (FINE_BITS - 1))) >> FINE_BITS;
        place.owed = begin - (fine << FINE_BITS);
        // Positive: a shift and a mask.
        let (row, weight) = ((fine as u64 / WEIGHTS as u64) as usize, (fine as u64 % WEIGHTS as u64) as i64);
        let (entry, row) = (row / ROWS, row % ROWS);
        place.at += (samples << PLACE_BITS) + samples * self.gain;
        while place.at >= self.period {
            place.at -= self.period;
        }
        (row * self.stride + entry, (weight << 8 | (WEIGHTS - weight)) as i16)
    }
}

/// Everything but the products, for each instruction set.
#[inline(always)]
fn body<const T: usize>(job: &Job, codes: [i64; T], add: impl Fn(&Stretch<T>, &mut Sums<T>)) -> [Complex64; T] {
    let mut carrier = Carrier::of_pairs(job.nco);
    let motion = Motion::new(job.rows, job.step);
    let mut places = [Place { at: 0, owed: 0 }; T];
    for t in 0..T {
        let at = (codes[t] as f64 * job.rows.samples_a_unit * (1_i64 << PLACE_BITS) as f64) as i64;
        places[t].at = at + planted!("receiver.rows.place", 0, 1 << (PLACE_BITS - 1));
    }
    let mut totals: Sums<T> = [[[0.0; LANES]; 2]; T];
    for (i, q) in job.samples.i.chunks(SEGMENTS * SEGMENT).zip(job.samples.q.chunks(SEGMENTS * SEGMENT)) {
        let (mut from, mut weights) = ([[0; T]; SEGMENTS], [[0; T]; SEGMENTS]);
        for (samples, (from, weights)) in i.chunks(SEGMENT).zip(from.iter_mut().zip(&mut weights)) {
            for t in 0..T {
                (from[t], weights[t]) = motion.next(&mut places[t], samples.len());
            }
        }
        let (mut cos, mut sin) = ([0; VECTORS], [0; VECTORS]);
        let blocks = cos.as_chunks_mut().0.iter_mut().zip(sin.as_chunks_mut().0);
        for (cos, sin) in blocks.take(i.len().div_ceil(LANES * VECTOR)) {
            let phasors = carrier.next_block();
            (*cos, *sin) = (kernel::twice(phasors.0), kernel::twice(phasors.1));
        }
        let (i, last_i) = i.as_chunks();
        let (q, last_q) = q.as_chunks();
        let last = (!last_i.is_empty()).then(|| [filled(last_i), filled(last_q)]);
        let (cos, sin, from, weights) = (&cos, &sin, &from, &weights);
        add(&Stretch { i, q, last: last.as_ref(), cos, sin, entries: &job.rows.entries, from, weights }, &mut totals);
    }
    let mut found = [Complex64::ZERO; T];
    for t in 0..T {
        found[t] = carrier.fold(&totals[t][0], &totals[t][1]) * SCALE;
    }
    found
}

/// A period's steps at positions that are equally far apart, less than a step.
struct Places {
    /// Integral of the steps at each step's beginning and at the end, from a whole number of periods before
    /// zero on.
    integral: Vec<f64>,
    /// First position, in steps from the beginning of the integral.
    begin: f64,
    /// Distance from one position to the next, in steps.
    apart: f64,
}

impl Places {
    /// Positions of a row: `count` of them, from `first` on.
    fn new(steps: &[i8], (first, apart): (f64, f64), count: usize) -> Self {
        let period = steps.len() as f64;
        let begin = first - period * (first / period).floor();
        let reached = (begin + count as f64 * apart).ceil() as usize + 1;
        let mut integral = Vec::with_capacity(reached + 1);
        let mut sum = 0.0;
        integral.push(sum);
        for step in steps.iter().cycle().take(reached) {
            sum += f64::from(*step);
            integral.push(sum);
        }
        Self { integral, begin, apart }
    }

    /// Integral of the steps at a row's next positions, and the step there.
    #[inline(always)]
    fn at(&self, entry: usize) -> [[f64; ROWS]; 2] {
        let [mut sums, mut steps] = [[0.0; ROWS]; 2];
        for row in 0..ROWS {
            let at = self.begin + (entry * ROWS + row) as f64 * self.apart;
            let number = at as u32;
            if let Some([from, to]) = self.integral.get(number as usize..).and_then(|rest| rest.first_chunk()) {
                steps[row] = to - from;
                sums[row] = from + (at - f64::from(number)) * steps[row];
            }
        }
        [sums, steps]
    }
}

#[cfg(test)]
mod tests;
