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

use super::carrier::{BLOCK, Carrier, LANES};
use super::fixed::{Fixed, POINT_BITS};
use super::kernel::Level;
use super::{CODE_BITS, MOST_STEPS, Nco, TURN, Wave};
use kernel::{PAIRS, Sums};

pub(super) mod kernel;

/// Rows a sample.
const ROWS: usize = 16;
/// Samples whose replica is taken from the same rows.
const SEGMENT: usize = 2 * BLOCK;
/// Entries of a row before the period and after it: half a segment, a whole one, and a little more.
const BEFORE: usize = SEGMENT / 2 + 2;
const AFTER: usize = SEGMENT + LANES + 2;
/// What a step of ±1 is in a row.
const AMPLITUDE: f64 = 127.0;
/// The weights of two rows add up to this.
const WEIGHTS: i64 = 64;
/// Bits of a place behind the point, and behind a weight's last one.
const PLACE_BITS: u32 = 40;
const FINE_BITS: u32 = PLACE_BITS - (ROWS as i64 * WEIGHTS).ilog2();
/// Undoes the scales of samples, values, weights and phasors.
const SCALE: f64 = 32_768.0 / ((1 << POINT_BITS) as f64 * AMPLITUDE * WEIGHTS as f64 * kernel::UNIT as f64);
/// Samples of a period at most: 256 KiB a satellite.
const MOST_SAMPLES: f64 = 8192.0;
/// Samples from one change to the next at most: with more of them pieces are quicker.
const MOST_SAMPLES_A_CHANGE: f64 = 12.0;
/// Turns of the carrier a sample at most.
const MOST_TURNS: f64 = 0.01;
/// What the code rate may be off the nominal one: 0.013 sample at a segment's ends.
const MOST_APART: f64 = 5e-5;

/// A period of the replica at every row's place.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    steps_per_chip: usize,
    /// Length of the period in phase units of steps.
    period: i64,
    /// Nominal samples in a phase unit of steps.
    samples_a_unit: f64,
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
        let places = Places::of(&wave.values, first, step / ROWS as f64, (stride + 2) * ROWS + 1);
        let mut entries = vec![[0; 2]; stride * ROWS];
        let mut owed = [0.0; ROWS + 1];
        // All rows at once, as what one owes waits for its entry before.
        for entry in 0..stride {
            let mut values = [0; ROWS + 1];
            for (row, (value, owed)) in values.iter_mut().zip(&mut owed).enumerate() {
                let from = entry * ROWS + row;
                let mean = (places.sums[from + ROWS] - places.sums[from]) / step;
                // A change's place is seen in the sign in which it goes.
                let way = f64::from((places.values[from + ROWS] - places.values[from]).signum());
                let way = if mean.abs() < 1.0 { way } else { 0.0 };
                let exact = AMPLITUDE * mean;
                let wanted = exact + way * *owed;
                let whole = f64::from((wanted + 0.5_f64.copysign(wanted)) as i32).clamp(-AMPLITUDE, AMPLITUDE);
                *owed += way * (exact - whole);
                *value = whole as i8;
            }
            for (row, pair) in values.windows(2).enumerate() {
                entries[row * stride + entry] = [pair[0], pair[1]];
            }
        }
        Some(Self {
            steps_per_chip: wave.steps_per_chip,
            period: (length as i64) << CODE_BITS,
            samples_a_unit: 1.0 / (step * unit),
            stride,
            entries,
        })
    }

    /// Whether rows do at these steps of carrier and code.
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
        let each = self.steps_per_chip as i64;
        let code = nco.code.rem_euclid(self.period / each) * each;
        let mut places = [0; T];
        for (place, tap) in places.iter_mut().zip(taps) {
            let tap = (tap * each).rem_euclid(self.period);
            // Both are below 2⁶³.
            *place = ((code as u64 + tap as u64) % self.period as u64) as i64;
        }
        kernel::correlate(level, &Job { rows: self, samples, nco, step: nco.code_step as i64 * each }, places)
    }
}

/// Samples and rows of one call.
struct Job<'a> {
    rows: &'a Rows,
    samples: Fixed<'a>,
    nco: &'a Nco,
    /// Phase units of steps a sample.
    step: i64,
}

/// Where a tap is in the table, in 2⁻⁴⁰ samples.
#[derive(Clone, Copy)]
struct Place {
    /// Of the segment's first sample, less than a period.
    at: i64,
    /// What rounding owes.
    owed: i64,
}

/// How places move, in 2⁻⁴⁰ samples.
struct Motion {
    /// Beyond a sample, in a sample.
    gain: i64,
    period: i64,
    stride: usize,
}

impl Motion {
    fn new(rows: &Rows, step: i64) -> Self {
        let samples = |units: i64| (units as f64 * rows.samples_a_unit * (1_i64 << PLACE_BITS) as f64).round() as i64;
        Self { gain: samples(step) - (1 << PLACE_BITS), period: samples(rows.period), stride: rows.stride }
    }

    /// The entry of a segment's first sample, and the weights of it and of the next row's. Samples are
    /// [`SEGMENT`] or, at the end, less.
    #[inline(always)]
    fn next(&self, place: &mut Place, samples: usize) -> (usize, [u8; 2]) {
        let samples = samples as i64;
        // At least two samples, at most a period and half a segment more.
        let begin = place.at + place.owed + ((BEFORE as i64) << PLACE_BITS) + ((samples * self.gain) >> 1);
        let fine = (begin + (1 << (FINE_BITS - 1))) >> FINE_BITS;
        place.owed = begin - (fine << FINE_BITS);
        let (row, weight) = ((fine / WEIGHTS) as usize, fine % WEIGHTS);
        let (entry, row) = (row / ROWS, row % ROWS);
        place.at += (samples << PLACE_BITS) + samples * self.gain;
        while place.at >= self.period {
            place.at -= self.period;
        }
        (row * self.stride + entry, [(WEIGHTS - weight) as u8, weight as u8])
    }
}

/// Everything but the products, for each instruction set.
#[inline(always)]
fn body<const T: usize>(job: &Job, codes: [i64; T], add: impl Fn(&kernel::Segment<T>, &mut Sums<T>)) -> [Complex64; T] {
    let mut carrier = Carrier::new(job.nco);
    let motion = Motion::new(job.rows, job.step);
    let mut places = [Place { at: 0, owed: 0 }; T];
    for t in 0..T {
        let at = (codes[t] as f64 * job.rows.samples_a_unit * (1_i64 << PLACE_BITS) as f64) as i64;
        places[t].at = at + planted!("receiver.rows.place", 0, 1 << (PLACE_BITS - 1));
    }
    let mut totals: Sums<T> = [[[0.0; PAIRS]; 2]; T];
    let (mut last_i, mut last_q) = ([0; SEGMENT], [0; SEGMENT]);
    for (i, q) in job.samples.i.chunks(SEGMENT).zip(job.samples.q.chunks(SEGMENT)) {
        let samples = i.len();
        let (mut from, mut weights) = ([0; T], [[0; 2]; T]);
        for t in 0..T {
            (from[t], weights[t]) = motion.next(&mut places[t], samples);
        }
        let (i, q) = if samples < SEGMENT {
            last_i[..samples].copy_from_slice(i);
            last_q[..samples].copy_from_slice(q);
            let whole = samples.next_multiple_of(LANES);
            (&last_i[..whole], &last_q[..whole])
        } else {
            (i, q)
        };
        let (mut cos, mut sin) = ([0; kernel::VECTORS], [0; kernel::VECTORS]);
        let blocks = cos.as_chunks_mut().0.iter_mut().zip(sin.as_chunks_mut().0);
        for (cos, sin) in blocks.take(samples.div_ceil(BLOCK)) {
            let phasors = carrier.next_block();
            (*cos, *sin) = (kernel::twice(phasors.0), kernel::twice(phasors.1));
        }
        let segment = kernel::Segment {
            i: i.as_chunks().0,
            q: q.as_chunks().0,
            cos,
            sin,
            entries: &job.rows.entries,
            from,
            weights,
        };
        add(&segment, &mut totals);
    }
    let mut found = [Complex64::ZERO; T];
    let pairs = carrier.pairs();
    for t in 0..T {
        found[t] = pairs.fold(&totals[t][0], &totals[t][1]) * SCALE;
    }
    found
}

/// A period's steps at places that are equally far apart, less than a step: what they add up to, and the step
/// there.
struct Places {
    sums: Vec<f64>,
    values: Vec<i8>,
}

impl Places {
    /// From `first` on, less than a period before zero.
    fn of(steps: &[i8], first: f64, apart: f64, count: usize) -> Self {
        let mut places = Self { sums: Vec::with_capacity(count), values: Vec::with_capacity(count) };
        // The number of the step, and the sum of those before it.
        let length = steps.len();
        let begin = first + length as f64;
        let mut number = begin as usize;
        let mut before: i64 = steps.iter().take(number).map(|&step| i64::from(step)).sum();
        for place in 0..count {
            let at = begin + place as f64 * apart;
            let here = at as usize;
            while number < here {
                before += i64::from(steps[number % length]);
                number += 1;
            }
            let step = steps[number % length];
            places.sums.push(before as f64 + (at - here as f64) * f64::from(step));
            places.values.push(step);
        }
        places
    }
}

#[cfg(test)]
mod tests;
