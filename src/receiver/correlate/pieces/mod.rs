//! The correlator by pieces: work for each change of the code's sign, whatever the rate of the samples.
//!
//! Between two changes of its sign a replica is constant. What the samples add up to there is a difference of
//! their running sums ([`super::sums`]), which all channels share. With S(p) the sum up to position p,
//! between samples in proportion, and u the replica's value times the carrier's conjugate phasor in the
//! middle of a piece, a correlation is
//!
//! > Σ u·(S(end) − S(begin)) = Σ (u before − u after)·S(change) + u last·S(last sample)
//!
//! (Abel's summation), so a tap takes one interpolation for each change. That is exact for area edges of any
//! code: steps of zero and steps shorter than a sample are pieces as others are.
//!
//! The one approximation is the carrier, which stands still within a piece. Pieces end at [`LONGEST_CHIPS`],
//! and are taken only where it turns by [`MOST_TURNS`] at most in so long: against a replica that turns with
//! every sample that costs (πfL)²/3 of the power on average over pieces of length L, 0.003 dB at 5 kHz and
//! 0.011 dB at 10 kHz for C/A, and no bias. Positions have 2⁻¹⁶ of a sample, phasors an error of 5e-6.
//!
//! [`lanes`] is the plain twin of [`kernel`]: the same sums in the same order, so the same bits.

use num_complex::Complex64;

use super::kernel::Level;
use super::sums::Sums;
use super::{CODE_BITS, MOST_STEPS, Nco, TURN, Wave};

pub(super) mod kernel;
mod lanes;
mod pass;

/// Pieces that are worked on together.
const GROUP: usize = 8;
/// Groups whose sums stay in `f32`.
const GROUPS: usize = 64;
/// Steps by which the table goes beyond the period on either side.
const MARGIN: i64 = 16;
/// Taps so many steps apart share a pass.
const NEAR: i64 = MARGIN / 2;
/// Chips of a piece at most.
const LONGEST_CHIPS: usize = 4;
/// Turns of the carrier in so many chips at most.
const MOST_TURNS: f64 = 0.04;
/// Pieces a sample at most: with more of them products sample by sample are quicker.
const MOST_PIECES: f64 = 0.3;
/// Samples that a group spans at most: positions within a chunk have 16 bits, and sums 24.
const MOST_SAMPLES: f64 = 28_000.0;
/// Samples in a step at most: steps have 6 bits before the point.
const MOST_SAMPLES_A_STEP: f64 = 60.0;

/// The pieces of a period and a little more, in groups. Counted is from [`MARGIN`] steps before the period
/// on.
#[derive(Clone, Debug)]
pub(super) struct Pieces {
    /// Part of the replica.
    gain: Complex64,
    steps_per_chip: usize,
    /// Steps of a period.
    length: usize,
    /// Beginnings of the pieces, in steps.
    starts: Vec<[u32; GROUP]>,
    /// Middles of the pieces, in half steps.
    middles: Vec<[u32; GROUP]>,
    /// Values of the replica in the pieces.
    levels: Vec<[f32; GROUP]>,
    /// Pieces for each step.
    density: f64,
}

impl Pieces {
    /// The pieces of a wave that is `gain` of a replica; `None` where their positions cannot be counted.
    pub fn of(wave: &Wave, gain: Complex64) -> Option<Self> {
        let length = wave.values.len();
        if wave.steps_per_chip == 0 || !(64..MOST_STEPS - 4 * MARGIN as usize).contains(&length) {
            return None;
        }
        let margin = MARGIN as usize;
        let values: Vec<i8> = (length - margin..2 * length + margin).map(|step| wave.values[step % length]).collect();
        // A piece that the samples cut is not met in its middle: where a period begins and ends they are
        // short.
        let period = margin..margin + length;
        let longest = |step: usize| if period.contains(&step) { LONGEST_CHIPS } else { 1 } * wave.steps_per_chip;
        let mut starts: Vec<usize> = vec![0];
        for (step, pair) in (1..).zip(values.windows(2)) {
            let is_long = starts.last().is_some_and(|last| step - last >= longest(*last));
            if pair[0] != pair[1] || is_long || step == period.start || step == period.end {
                starts.push(step);
            }
        }
        let count = starts.len();
        let whole = count.div_ceil(GROUP) * GROUP;
        // What fills up the last group has no length.
        starts.resize(whole + 1, values.len());
        let mut table = Self {
            gain,
            steps_per_chip: wave.steps_per_chip,
            length,
            starts: Vec::with_capacity(whole / GROUP),
            middles: Vec::with_capacity(whole / GROUP),
            levels: Vec::with_capacity(whole / GROUP),
            density: count as f64 / values.len() as f64,
        };
        for group in 0..whole / GROUP {
            let of = |k: usize| (starts[GROUP * group + k], starts[GROUP * group + k + 1]);
            table.starts.push(std::array::from_fn(|k| of(k).0 as u32));
            table.middles.push(std::array::from_fn(|k| (of(k).0 + of(k).1) as u32));
            table.levels.push(std::array::from_fn(|k| values.get(of(k).0).map_or(0.0, |&value| f32::from(value))));
        }
        Some(table)
    }

    /// Part of the replica.
    pub fn gain(&self) -> Complex64 {
        self.gain
    }

    /// True if pieces suit these steps of carrier and code, and are quicker than products of every sample.
    pub fn suit(&self, nco: &Nco) -> bool {
        let samples_a_chip = (1_u64 << CODE_BITS) as f64 / nco.code_step.max(1) as f64;
        let samples_a_step = samples_a_chip / self.steps_per_chip as f64;
        let longest = LONGEST_CHIPS as f64 * samples_a_chip;
        let turns = (nco.carrier_step as i64 as f64 / TURN).abs() * longest;
        turns <= MOST_TURNS
            && self.density <= MOST_PIECES * samples_a_step
            && samples_a_step <= MOST_SAMPLES_A_STEP
            && GROUP as f64 * longest <= MOST_SAMPLES
    }

    /// Length of the period in phase units of steps.
    fn period(&self) -> i64 {
        (self.length as i64) << CODE_BITS
    }

    /// Σ x·conj(replica) with the replica at each of `taps`, phases of steps, ahead of the prompt.
    pub fn correlate<const T: usize>(&self, level: Level, sums: Sums, nco: &Nco, taps: &[i64; T]) -> [Complex64; T] {
        let each = self.steps_per_chip as i64;
        let code = nco.code.rem_euclid(self.period() / each) * each;
        let nco = Nco { code, code_step: nco.code_step * each as u64, ..*nco };
        let taps = taps.map(|tap| tap * each);
        if are_near(&taps) {
            return self.together(level, sums, &nco, taps);
        }
        // Early, prompt and late come first; what is far from them is by itself.
        let mut found = [Complex64::ZERO; T];
        let first = taps.first_chunk::<3>().filter(|three| are_near(*three));
        if let Some((three, found)) = first.zip(found.first_chunk_mut::<3>()) {
            *found = self.together(level, sums, &nco, *three);
        }
        let by_themselves = if first.is_some() { 3 } else { 0 };
        for (tap, found) in taps.iter().zip(&mut found).skip(by_themselves) {
            // Counted from itself it has a position near those of its changes.
            [*found] = self.together(level, sums, &Nco { code: self.moved(nco.code, *tap), ..nco }, [0]);
        }
        found
    }

    /// A phase of steps and a tap, within the period.
    fn moved(&self, code: i64, tap: i64) -> i64 {
        (i128::from(code) + i128::from(tap)).rem_euclid(i128::from(self.period())) as i64
    }

    /// Correlation for taps that are near each other, over one end of the table after the other.
    fn together<const T: usize>(&self, level: Level, sums: Sums, nco: &Nco, taps: [i64; T]) -> [Complex64; T] {
        let (samples, period, step) = (sums.samples(), self.period(), nco.code_step as i64);
        let (low, high) = extent(&taps);
        let margin = MARGIN << CODE_BITS;
        let begin = self.moved(nco.code, low + margin / 2);
        let mut nco = Nco { code: begin - margin / 2 - low, ..*nco };
        let mut totals = [Complex64::ZERO; T];
        let mut done = 0;
        while done < samples {
            let room = (period - nco.code - high) + margin + step / 2;
            let count = ((room / step).max(1) as usize).min(samples - done);
            let Some(part) = sums.part(done, done + count) else { return totals };
            let found = pass::correlate(level, self, part, &nco, &taps);
            totals.iter_mut().zip(found).for_each(|(total, one)| *total += one);
            done += count;
            nco.carrier = nco.carrier.wrapping_add(nco.carrier_step.wrapping_mul(count as u64));
            nco.code += count as i64 * step - period;
        }
        totals
    }
}

/// The least and the greatest.
fn extent(taps: &[i64]) -> (i64, i64) {
    taps.iter().fold((i64::MAX, i64::MIN), |(low, high), &tap| (low.min(tap), high.max(tap)))
}

fn are_near(taps: &[i64]) -> bool {
    let (low, high) = extent(taps);
    high.saturating_sub(low) <= NEAR << CODE_BITS
        && high.saturating_abs().max(low.saturating_abs()) <= NEAR << CODE_BITS
}

#[cfg(test)]
mod tests;
