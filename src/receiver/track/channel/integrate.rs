//! A code period: its correlations, what the detectors and symbols get of them, and the update that ends an
//! integration.

use num_complex::Complex64;

use super::{Channel, Stage};
use crate::correlate::sums::Samples;
use crate::correlate::{Nco, Replica, TURN, chips_to_units};
use crate::track::side::SidePeaks;
use crate::track::{Report, Symbol};

/// Periods over which the power of the samples is averaged.
const POWER_PERIODS: f64 = 100.0;
/// Halves of periods are compared in one of this many, once they have shown a true lock.
const HALVES_EVERY: u64 = 16;
/// The power is measured in one of this many periods.
const POWER_EVERY: u64 = 8;

/// Correlations of a code period.
#[derive(Clone, Copy, Debug, Default)]
struct Correlations {
    /// Early, prompt and late.
    sums: [Complex64; 3],
    /// Correlation at a delay where the code does not correlate with itself, if it was requested.
    noise: Option<Complex64>,
    /// Correlations on the neighbouring peaks, ahead and behind, of a signal that has them.
    sides: Option<[Complex64; 2]>,
}

impl Channel {
    /// Correlates the running period, whose last samples these are, and moves on to the next, which begins at
    /// `next`.
    pub(super) fn correlate(&mut self, replica: &Replica, samples: Samples, next: u64, report: &mut Report) {
        let nco = self.oscillators();
        let Correlations { sums, noise, sides } = self.correlations(replica, samples, &nco);
        let read = self.whole && self.confirmed && !self.held && self.secondary_code_phase.is_some();
        if self.whole && (self.power.is_none() || self.period.is_multiple_of(POWER_EVERY)) {
            let power = samples.power() / samples.count().max(1) as f64;
            self.power =
                Some(self.power.map_or(power, |mean| mean + (power - mean) * POWER_EVERY as f64 / POWER_PERIODS));
        }
        let mean = self.power.unwrap_or_default();
        let count = next - self.first;
        // Noise of a correlation, per component: half the samples' power (real samples too) times the
        // replica's energy.
        let deviation = (0.5 * mean * count as f64 * self.replica_power).sqrt();
        let scale = if deviation > 0.0 { 1.0 / deviation } else { 0.0 };
        if read && let Some(data) = &mut self.data {
            let phase = self.secondary_code_phase.unwrap_or_default();
            report.symbols.extend(data.read(samples, self.arithmetic, &nco, (self.period, phase, next), scale));
        }
        let first = self.first_half(replica, samples, &nco);
        let found = self.seek_segment(samples, &nco, scale);
        self.pass(next);
        self.code -= replica.period();
        let finished = self.period;
        self.period += 1;
        if !self.whole {
            // The first period was met on its way.
            self.whole = true;
            self.update_since = next;
            return;
        }
        let signed = scale * self.secondary_code_chip(finished);
        let mut taps = [Complex64::ZERO; 3];
        taps.iter_mut().zip(&sums).for_each(|(tap, sum)| *tap = sum * signed);
        if !self.held && !self.moved {
            self.cn0.add(taps[1], noise.map(|sum| (sum * scale).norm_sqr()));
        }
        if let Some(sides) = sides {
            self.watch_side_peaks(taps[1], sides.map(|sum| sum * scale), report);
        }
        if let Some(first) = first {
            self.halves.add(sums[1] * scale, first * scale);
        }
        self.take(finished, taps, report);
        if let Some(phase) = found {
            self.follow_long(phase);
        }
    }

    /// The prompt of the running period's first half, where a false lock shows there alone.
    fn first_half(&self, replica: &Replica, samples: Samples, nco: &Nco) -> Option<Complex64> {
        let is_due = !self.is_true || self.period.is_multiple_of(HALVES_EVERY);
        // The frequency loop alone has come to rest before.
        let rests = matches!(self.stage, Stage::Assisted | Stage::Tracking(_));
        let is_wanted = self.has_single_periods() && self.whole && !self.held && rests;
        (is_wanted && is_due).then(|| {
            let [sum] = replica.correlate_in(self.arithmetic, samples.part(0, samples.count() / 2), nco, &[0]);
            sum
        })
    }

    /// All taps of the running period in one pass.
    fn correlations(&self, replica: &Replica, samples: Samples, nco: &Nco) -> Correlations {
        let arithmetic = self.arithmetic;
        let [e, p, l] = self.taps;
        let sides = self.side_peaks.as_ref().filter(|_| self.whole && !self.held).map(SidePeaks::taps);
        match (self.quiet_tap(), sides) {
            (None, None) => Correlations {
                sums: replica.correlate_in(arithmetic, samples, nco, &self.taps),
                ..Correlations::default()
            },
            (Some(quiet), None) => {
                let [e, p, l, noise] = replica.correlate_in(arithmetic, samples, nco, &[e, p, l, quiet]);
                Correlations { sums: [e, p, l], noise: Some(noise), sides: None }
            }
            (None, Some([a, b])) => {
                let [e, p, l, a, b] = replica.correlate_in(arithmetic, samples, nco, &[e, p, l, a, b]);
                Correlations { sums: [e, p, l], noise: None, sides: Some([a, b]) }
            }
            (Some(quiet), Some([a, b])) => {
                let [e, p, l, noise, a, b] = replica.correlate_in(arithmetic, samples, nco, &[e, p, l, quiet, a, b]);
                Correlations { sums: [e, p, l], noise: Some(noise), sides: Some([a, b]) }
            }
        }
    }

    /// Tap at which the noise of the current period is measured, if it has to be.
    fn quiet_tap(&self) -> Option<i64> {
        let wanted = self.whole && self.cn0.needs_reference();
        let place = self.period as usize % self.noise_taps.len().max(1);
        self.noise_taps.get(place).copied().filter(|_| wanted)
    }

    /// Takes the early, prompt and late correlations of code period `number`.
    fn take(&mut self, number: u64, taps: [Complex64; 3], report: &mut Report) {
        let prompt = taps[1];
        self.sums.iter_mut().zip(taps).for_each(|(sum, tap)| *sum += tap);
        self.summed += 1;
        self.glances.add(number, prompt, self.previous);
        match self.stage {
            Stage::Open => self.batch.add(prompt),
            Stage::Frequency | Stage::Assisted => self.phase_lock.add(prompt, self.noise()),
            Stage::Tracking(begin) => self.take_in_symbol(number, begin, prompt, report),
        }
        if self.summed >= self.periods_per_update() {
            self.update();
            self.sums = [Complex64::ZERO; 3];
            self.summed = 0;
            self.update_since = self.first;
        }
        self.keep_to_symbols(number);
        self.previous = Some(prompt);
        self.supervise(number, prompt, report);
        self.take_offset();
        self.set_steps();
    }

    /// Collects the prompts of a symbol and gives it out at its end.
    fn take_in_symbol(&mut self, number: u64, begin: u64, prompt: Complex64, report: &mut Report) {
        if self.held {
            return;
        }
        let is_in_bit = self.bit_begin.is_some();
        if is_in_bit && self.confirmed {
            // As it was sent, with the sign that its bit's code has there.
            let soft = (prompt.re * self.secondary_code_chip(number)) as f32;
            report.symbols.push(Symbol { first_period: number, end: self.first, soft });
        }
        self.symbol.0 += prompt;
        self.symbol.1 += 1;
        self.rotation.add(prompt, self.symbol.1, self.group);
        let length = u64::from(self.group);
        if (number + 1) % length != begin {
            return;
        }
        if self.symbol.1 == self.group {
            let symbol_s = self.period_s * f64::from(self.group);
            let slipped = self.symbol_lock.add(self.symbol.0, self.cn0.hz().map(|hz| hz * symbol_s));
            if slipped && self.lock.slip(self.first) {
                self.break_count(report);
            }
            if self.has_symbols && self.confirmed && !is_in_bit {
                let soft = (self.symbol.0.re / f64::from(self.group).sqrt()) as f32;
                report.symbols.push(Symbol { first_period: number + 1 - length, end: self.first, soft });
            }
        }
        self.symbol = (Complex64::ZERO, 0);
    }

    /// Closes the loops with the sums of an integration.
    fn update(&mut self) {
        let t_s = self.period_s * f64::from(self.summed);
        // With a secondary code out of place nothing but the code is where it seems.
        let astray = self.held && self.has_secondary_code();
        let before = match self.stage {
            _ if astray => None,
            Stage::Tracking(_) => self.previous_sum,
            // The batch gives the frequency to tenths of a hertz; pairs of weak prompts would add hertz.
            Stage::Assisted if self.is_batched => None,
            Stage::Frequency | Stage::Assisted => self.previous,
            // Nothing may correct the frequency.
            Stage::Open => None,
        };
        self.previous_sum = Some(self.sums[1]);
        let mode = if astray { Stage::Open.mode() } else { self.stage.mode() };
        self.last = self.loops.close(mode, self.sums, before, self.summed, t_s, Some(self.cn0_hz()));
        self.carrier += (self.last.carrier_jump_cycles * TURN) as i128;
        self.glances.close(self.last.dll_chips, self.last.code_jump_chips);
        self.code += chips_to_units(self.last.code_jump_chips);
    }
}
