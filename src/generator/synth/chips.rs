//! Codes as packed signs, and the strip of signs that a run reads.
//!
//! A [`Spreading`] is one sequence of ±1: the steps of a layer's chips, see [`super::waveform`]. A strip has
//! code periods, secondary code and data signs already joined: a wrap of the code and a change of sign fall
//! at their exact phase, and kernels know neither. Codes and secondary codes run by the time of the signal's
//! system, from the beginning of its weeks.

use std::sync::Arc;

use gnss::time::{Epoch, TimeScale};

use super::{CODE_BITS, CODE_ONE};

/// Number of code steps that a strip keeps before its first sample and after its last.
pub const MARGIN_STEPS: u64 = 160;

/// Largest number of code steps in a sample. 4096 of them and both margins stay below 2^16, and nine samples
/// stay within a margin.
pub const MAX_STEP: f64 = 15.0;

/// Timing of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// Steps in one code period.
    pub steps: u32,
    /// Steps per second in thousandths, by the satellite's clock.
    step_rate_mhz: i64,
    /// The fewest whole seconds that are whole periods, and those periods.
    cycle_s: i64,
    cycle_periods: i64,
    /// The time of the signal's system.
    time: &'static TimeScale,
}

/// Sequence of ±1 of a satellite, ready to be cut into strips.
#[derive(Clone, Debug)]
pub struct Spreading {
    /// Signs, most significant bit first, continued cyclically for two words; a set bit is −1.
    words: Vec<u64>,
    pace: Pace,
    /// Inversion of each code period by the secondary code; empty without a secondary code.
    secondary_code: Arc<[bool]>,
}

/// Position in a code: whole periods since 1980-01-06T00:00:00 by the satellite's clock in its system's time,
/// whole steps, and a fraction of a step in 2^-48.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CodeTime {
    /// Whole periods.
    pub period: i64,
    /// Whole steps of the period.
    pub step: u32,
    /// Fraction of a step, in 2^-48 step.
    pub fraction: u64,
}

impl CodeTime {
    /// Creates the position `phase` (in 2^-48 steps) after the beginning of a period.
    pub fn new(period: i64, phase: u64) -> Self {
        Self { period, step: (phase / CODE_ONE) as u32, fraction: phase % CODE_ONE }
    }

    /// Steps since the beginning of the period.
    pub fn steps(self) -> f64 {
        f64::from(self.step) + self.fraction as f64 / CODE_ONE as f64
    }

    /// Time since the beginning of the period, in 2^-48 steps.
    pub fn phase(self) -> u128 {
        u128::from(self.step) << CODE_BITS | u128::from(self.fraction)
    }
}

impl Pace {
    /// Creates the timing of `steps` in a period at `step_rate_hz`, by the time of the signal's system.
    /// `None` for a rate that is not in whole thousandths of a hertz, or whose periods fill no whole seconds
    /// below 2^63 thousandths of a step.
    pub fn new(steps: usize, step_rate_hz: f64, time: &'static TimeScale) -> Option<Self> {
        let steps = u32::try_from(steps).ok().filter(|&steps| steps > 0)?;
        let exact_mhz = step_rate_hz * 1000.0;
        // Products of printed rates with small integers are rounded by an ulp or two.
        let is_whole = (exact_mhz - exact_mhz.round()).abs() <= 4.0 * f64::EPSILON * exact_mhz;
        if !(is_whole && (1.0..1e15).contains(&exact_mhz)) {
            return None;
        }
        let step_rate_mhz = exact_mhz.round() as i64;
        let per_period = i64::from(steps) * 1000;
        let shared = greatest_common_divisor(per_period, step_rate_mhz);
        let (cycle_s, cycle_periods) = (per_period / shared, step_rate_mhz / shared);
        cycle_s.checked_mul(step_rate_mhz)?;
        Some(Self { steps, step_rate_mhz, cycle_s, cycle_periods, time })
    }

    /// Steps per second by the satellite's clock.
    pub fn step_rate_hz(&self) -> f64 {
        self.step_rate_mhz as f64 / 1000.0
    }

    /// Position of the code at the time `received − delay_s` of the satellite's clock.
    ///
    /// Whole seconds are turned into steps as integers; the fraction of a second resolves 1e-16 of its steps.
    pub fn at(&self, received: Epoch, delay_s: f64) -> CodeTime {
        let sent = received.plus_s(-delay_s);
        let seconds = sent.seconds() - self.time.behind_s(sent);
        // A period is `steps` · 1000 thousandths, and a cycle whole periods in whole seconds.
        let per_period = i64::from(self.steps) * 1000;
        // Most codes have whole periods in each second: no division then, of which a run would pay several.
        let (cycles, rest_s) = match self.cycle_s {
            1 => (seconds, 0),
            cycle_s => (seconds.div_euclid(cycle_s), seconds.rem_euclid(cycle_s)),
        };
        let rest = rest_s * self.step_rate_mhz;
        let (rest_periods, rest) = if rest == 0 { (0, 0) } else { (rest / per_period, rest % per_period) };
        let whole = cycles * self.cycle_periods + rest_periods;
        let steps = rest as f64 / 1000.0 + sent.fraction() * self.step_rate_hz();
        let length = f64::from(self.steps);
        let periods = (steps / length).floor();
        let (period, left) = (whole + periods as i64, steps - periods * length);
        let step = left as u32;
        let fraction = ((left - f64::from(step)) * CODE_ONE as f64) as u64;
        if step >= self.steps {
            return CodeTime { period: period + 1, step: step - self.steps, fraction };
        }
        CodeTime { period, step, fraction }
    }
}

fn greatest_common_divisor(a: i64, b: i64) -> i64 {
    let (mut x, mut y) = (a, b);
    while y > 0 {
        (x, y) = (y, x % y);
    }
    x
}

impl Spreading {
    /// Creates a sequence of signs, −1 where `negative`, with the inversion of each period by the secondary
    /// code.
    pub fn new(negative: &[bool], pace: Pace, secondary_code: Arc<[bool]>) -> Self {
        Self { words: packed(negative, negative.len() + 128), pace, secondary_code }
    }

    /// Returns the timing of the sequence.
    pub fn pace(&self) -> &Pace {
        &self.pace
    }

    /// [`Pace::at`].
    pub fn at(&self, received: Epoch, delay_s: f64) -> CodeTime {
        self.pace.at(received, delay_s)
    }

    /// True if the secondary code inverts a code period.
    pub fn is_overlaid(&self, period: i64) -> bool {
        let length = self.secondary_code.len();
        length > 0
            && self.secondary_code.get(period.rem_euclid(length as i64) as usize).is_some_and(|&negative| negative)
    }

    /// Appends the signs around `samples` samples that start at `at` and advance by `step`, with the data of
    /// each period (`negative` states whether it is sent inverted, asked in their order), and returns the
    /// position of the first sample in them.
    pub fn strip(
        &self,
        at: CodeTime,
        step: u64,
        samples: usize,
        mut negative: impl FnMut(i64) -> bool,
        out: &mut Vec<u64>,
    ) -> u64 {
        let per_period = u64::from(self.pace.steps);
        let first = u64::from(at.step);
        let behind = MARGIN_STEPS.saturating_sub(first).div_ceil(per_period);
        let mut period = at.period - behind as i64;
        let mut chip = first + behind * per_period - MARGIN_STEPS;
        let span = (at.fraction + step * samples as u64) / CODE_ONE;
        let total = (span + 2 * MARGIN_STEPS + 1) as usize;
        let begin = out.len();
        out.resize(begin + total.div_ceil(64) + 2, 0);
        let mut filled = 0;
        while filled < total {
            let take = (total - filled).min((per_period - chip) as usize);
            let words = out.get_mut(begin + filled / 64..begin + (filled + take).div_ceil(64)).unwrap_or(&mut []);
            self.copy(chip as usize, negative(period) ^ self.is_overlaid(period), filled % 64, words);
            filled += take;
            (chip, period) = (0, period + 1);
        }
        MARGIN_STEPS * CODE_ONE + at.fraction
    }

    /// Writes the signs from `chip` on into `out` from its bit `from` to its end.
    fn copy(&self, chip: usize, inverted: bool, from: usize, out: &mut [u64]) {
        let data = if inverted { u64::MAX } else { 0 };
        let Some((head, rest)) = out.split_first_mut() else { return };
        let own = u64::MAX >> from;
        *head = (*head & !own) | ((window(&self.words, chip) ^ data) >> from);
        let next = chip + 64 - from;
        let shift = (next % 64) as u32;
        let pairs = self.words.get(next / 64..).unwrap_or(&[]).windows(2);
        for (out, pair) in rest.iter_mut().zip(pairs) {
            *out = ((pair[0] << shift) | (pair[1] >> 1 >> (63 - shift))) ^ data;
        }
    }
}

/// The first `length` of `bits`, repeated from the beginning, most significant bit first.
pub(super) fn packed(bits: &[bool], length: usize) -> Vec<u64> {
    let mut words = vec![0_u64; length.div_ceil(64)];
    for (index, bit) in bits.iter().cycle().take(length).enumerate() {
        if let Some(word) = words.get_mut(index / 64) {
            *word |= u64::from(*bit) << (63 - index % 64);
        }
    }
    words
}

/// The 64 signs that begin at bit `offset`; zeros where the word behind is missing.
#[inline(always)]
pub(crate) fn window(words: &[u64], offset: usize) -> u64 {
    let Some(&[high, low]) = words.get(offset / 64..offset / 64 + 2) else { return 0 };
    let shift = (offset % 64) as u32;
    (high << shift) | (low >> 1 >> (63 - shift))
}

/// The sign at `offset` as ±1.
pub(crate) fn sign(words: &[u64], offset: usize) -> f64 {
    if window(words, offset) >> 63 == 1 { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::waveform::plain;
    use gnss::gps::l1ca::{self, L1_CA};
    use gnss::signal::synthetic::OWN_TIME;
    use gnss::time::GPST;

    #[test]
    fn a_strip_holds_each_chip_with_the_data_of_its_period() {
        let spreading = plain(&L1_CA, 7).unwrap();
        let code = l1ca::code(7).unwrap();
        let negative = |period: i64| period.rem_euclid(3) == 1;
        let mut out = Vec::new();
        for (period, chip, step) in [(0, 0, CODE_ONE / 3), (41, 1022, CODE_ONE), (5, 500, CODE_ONE / 25)] {
            let at = CodeTime::new(period, chip * CODE_ONE + CODE_ONE / 7);
            out.clear();
            let position = spreading.strip(at, step, 4096, negative, &mut out);
            assert_eq!(position % CODE_ONE, CODE_ONE / 7);
            let last = (position + step * 4096) / CODE_ONE + MARGIN_STEPS;
            for index in 0..last {
                let absolute = period * 1023 + chip as i64 + index as i64 - MARGIN_STEPS as i64;
                let expected = code[absolute.rem_euclid(1023) as usize] ^ negative(absolute.div_euclid(1023));
                assert_eq!(sign(&out, index as usize) < 0.0, expected, "{period} {chip} {index}");
            }
        }
    }

    #[test]
    fn the_code_position_is_that_of_exact_integers_decades_after_1980() {
        let spreading = plain(&L1_CA, 7).unwrap();
        // 1 461 888 000.25 s: 250 periods into the second, to the chip resolution of the fraction.
        let at = spreading.at(Epoch::new(1_461_888_000, 0.25 + 1e-6), 0.0);
        assert_eq!(at.period, 1_461_888_000_250);
        // Half an ulp of the fraction (2.8e-17 s) times the rate, and that of 255 751 chips (1.5e-11).
        assert!((at.steps() - 1.023).abs() < 1e-10);
    }

    #[test]
    fn periods_that_do_not_divide_a_second_are_counted_in_the_system_s_time() {
        // 1 534 500 steps in 1.5 s, in a time three seconds behind.
        let pace = Pace::new(1_534_500, 1.023e6, &OWN_TIME).unwrap();
        assert_eq!((pace.cycle_s, pace.cycle_periods), (3, 2));
        for (seconds, fraction, period, steps) in [
            (3, 0.0, 0, 0.0),
            (4, 0.25, 0, 1_278_750.0),
            (4, 0.75, 1, 255_750.0),
            (2, 0.0, -1, 511_500.0),
            (604_803, 0.0, 403_200, 0.0),
            // 6.3e9 s, the year 2180: 2 100 000 000 cycles.
            (6_300_000_005, 0.0, 4_200_000_001, 511_500.0),
        ] {
            let at = pace.at(Epoch::new(seconds, fraction), 0.0);
            assert_eq!((at.period, at.steps()), (period, steps), "{seconds} {fraction}");
        }
        // A third of a thousandth of a hertz cannot be counted, nor can no steps.
        assert_eq!(Pace::new(1023, 1.023e6 + 1.0 / 3000.0, &GPST), None);
        assert_eq!(Pace::new(0, 1.023e6, &GPST), None);
    }
}
