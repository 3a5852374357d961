//! Spreading codes as packed signs, and the strip of signs that a run reads.
//!
//! A component's chips are expanded into the equal steps of its pulse, so BPSK and BOC look the
//! same from here on. A strip has code periods and data signs already joined: a wrap of the code
//! and a change of data bit fall at their exact phase, and kernels know neither.

use crate::gnss::signal::{Component, Message};
use crate::gnss::time::Epoch;

use super::CODE_ONE;

/// Code steps that a strip keeps before its first sample and after its last.
pub const MARGIN_STEPS: u64 = 160;

/// One component's code of one satellite, ready to be cut into strips.
#[derive(Clone, Debug)]
pub struct Spreading {
    /// Signs, most significant bit first, continued cyclically for two words.
    words: Vec<u64>,
    /// Steps in one period.
    steps: u32,
    /// Steps a second in thousandths, by the satellite's clock.
    step_rate_mhz: i64,
    message: Option<Message>,
    correlation: Vec<f64>,
}

/// A position in a code: whole periods since 1980-01-06T00:00:00 of satellite time, and Q16.48 steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CodeTime {
    pub period: i64,
    pub phase: u64,
}

impl Spreading {
    /// The code of satellite `number`; `None` if the document assigns none or it has 65 536 steps or more.
    pub fn new(component: &Component, number: u8) -> Option<Self> {
        let chips = (component.code)(number)?;
        let pulse = component.layers.first()?.pulse;
        let signs: Vec<bool> =
            chips.iter().flat_map(|&chip| pulse.iter().map(move |&p| (chip < 0) ^ (p < 0))).collect();
        let steps = u32::try_from(signs.len()).ok().filter(|&steps| steps > 0 && steps < 1 << 16)?;
        let mut words = vec![0_u64; (signs.len() + 128).div_ceil(64)];
        for (index, sign) in signs.iter().cycle().take(signs.len() + 128).enumerate() {
            if let Some(word) = words.get_mut(index / 64) {
                *word |= u64::from(*sign) << (63 - index % 64);
            }
        }
        let correlation = (0..signs.len().min(64))
            .map(|lag| {
                let differ = signs.iter().zip(signs.iter().cycle().skip(lag)).filter(|(a, b)| a != b).count();
                1.0 - 2.0 * differ as f64 / signs.len() as f64
            })
            .collect();
        let step_rate_mhz = (component.chip_rate_hz * pulse.len() as f64 * 1000.0).round() as i64;
        Some(Self { words, steps, step_rate_mhz, message: component.message, correlation })
    }

    /// Steps a second by the satellite's clock.
    pub fn step_rate_hz(&self) -> f64 {
        self.step_rate_mhz as f64 / 1000.0
    }

    /// Steps in one code period.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// The message on this component, if it has one.
    pub fn message(&self) -> Option<Message> {
        self.message
    }

    /// Cyclic autocorrelation of the code at its first whole-step lags.
    pub fn correlation(&self) -> &[f64] {
        &self.correlation
    }

    /// Where the code stands when the satellite's clock reads `received − delay_s`.
    ///
    /// Whole seconds are turned into steps as integers; the fraction resolves 1e-10 step.
    pub fn at(&self, received: Epoch, delay_s: f64) -> CodeTime {
        let sent = received.plus_s(-delay_s);
        // A period is `steps` · 1000 thousandths, and a second some whole periods and a rest.
        let per_period = i64::from(self.steps) * 1000;
        let rest = sent.seconds() * (self.step_rate_mhz % per_period);
        let whole = sent.seconds() * (self.step_rate_mhz / per_period) + rest.div_euclid(per_period);
        let steps = rest.rem_euclid(per_period) as f64 / 1000.0 + sent.fraction() * self.step_rate_hz();
        let length = f64::from(self.steps);
        let periods = (steps / length).floor();
        let mut period = whole + periods as i64;
        let mut phase = ((steps - periods * length) * CODE_ONE as f64) as u64;
        if phase >= u64::from(self.steps) * CODE_ONE {
            phase -= u64::from(self.steps) * CODE_ONE;
            period += 1;
        }
        CodeTime { period, phase }
    }

    /// Appends the signs around `samples` samples that start at `at` and advance by `step`, with the
    /// data of each period (`negative` says whether it is sent inverted), and returns the position
    /// of the first sample in them.
    pub fn strip(
        &self,
        at: CodeTime,
        step: u64,
        samples: usize,
        negative: impl Fn(i64) -> bool,
        out: &mut Vec<u64>,
    ) -> u64 {
        let per_period = u64::from(self.steps);
        let first = at.phase / CODE_ONE;
        let behind = MARGIN_STEPS.saturating_sub(first).div_ceil(per_period);
        let mut period = at.period - behind as i64;
        let mut chip = first + behind * per_period - MARGIN_STEPS;
        let span = (at.phase % CODE_ONE + step * samples as u64) / CODE_ONE;
        let total = (span + 2 * MARGIN_STEPS + 1) as usize;
        let begin = out.len();
        out.resize(begin + total.div_ceil(64) + 2, 0);
        let mut filled = 0;
        while filled < total {
            let take = (total - filled).min((per_period - chip) as usize);
            let words = out.get_mut(begin + filled / 64..begin + (filled + take).div_ceil(64)).unwrap_or(&mut []);
            self.copy(chip as usize, negative(period), filled % 64, words);
            filled += take;
            (chip, period) = (0, period + 1);
        }
        MARGIN_STEPS * CODE_ONE + at.phase % CODE_ONE
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
    use crate::gnss::gps::l1ca;

    #[test]
    fn a_strip_holds_each_chip_with_the_data_of_its_period() {
        let spreading = Spreading::new(&l1ca::L1_CA.components[0], 7).unwrap();
        let code = l1ca::code(7).unwrap();
        let negative = |period: i64| period.rem_euclid(3) == 1;
        let mut out = Vec::new();
        for (period, chip, step) in [(0, 0, CODE_ONE / 3), (41, 1022, CODE_ONE), (5, 500, CODE_ONE / 25)] {
            let at = CodeTime { period, phase: chip * CODE_ONE + CODE_ONE / 7 };
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
        let spreading = Spreading::new(&l1ca::L1_CA.components[0], 7).unwrap();
        // 1 461 888 000.25 s: 250 periods into the second, to the chip resolution of the fraction.
        let at = spreading.at(Epoch::new(1_461_888_000, 0.25 + 1e-6), 0.0);
        assert_eq!(at.period, 1_461_888_000_250);
        // Half an ulp of the fraction (2.8e-17 s) times the rate, and that of 255 751 chips (1.5e-11).
        assert!((at.phase as f64 / CODE_ONE as f64 - 1.023).abs() < 1e-10);
    }
}
