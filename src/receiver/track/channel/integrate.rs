//! A code period: its correlations, what the detectors and symbols get of them, and the update that ends an
//! integration.

use num_complex::Complex64;

use super::accumulator::{Correlations, Period};
use super::{Channel, Stage};
use crate::correlate::chips_to_units;
use crate::correlate::correlator::Correlator;
use crate::track::closed::Mode;
use crate::track::secondary_code::SecondaryCodePhase;
use crate::track::side::SidePeaks;
use crate::track::{Report, Symbol};

/// Halves of periods are compared in one of this many, once they have shown a true lock.
const HALVES_EVERY: u64 = 16;

impl Channel {
    /// Correlates the running code period and moves on to the next.
    pub(super) fn correlate<C: Correlator>(&mut self, period: &Period<C>, report: &mut Report) {
        let Correlations { sums, noise, sides } = self.correlations(period);
        let scale = self.accumulator.scale(period, self.whole);
        if let Some(phase) = self.signs.phase.filter(|_| self.whole && self.signs.confirmed && !self.held)
            && let Some(data) = &mut self.companions.data
        {
            report.symbols.extend(data.read(period, phase, scale));
        }
        let first = self.first_half(period);
        let found = self.seek_segment(period, scale);
        self.pass(period.interval.to);
        self.nco.end_period();
        if !self.whole {
            // The first period was met on its way.
            self.whole = true;
            self.accumulator.since = self.nco.first;
            return;
        }
        let signed = scale * self.signs.chip(period.number);
        let taps = sums.map(|sum| sum * signed);
        if !self.held && !self.moved {
            self.detectors.cn0.add(taps[1], noise.map(|sum| (sum * scale).norm_sqr()));
        }
        if let Some(sides) = sides {
            self.watch_side_peaks(taps[1], sides.map(|sum| sum * scale), report);
        }
        if let Some(first) = first {
            self.detectors.halves.add(sums[1] * scale, first * scale);
        }
        self.take(period.number, taps, report);
        if let Some(phase) = found {
            self.follow_long(phase);
        }
    }

    /// All taps of the running period.
    fn correlations<C: Correlator>(&mut self, period: &Period<C>) -> Correlations {
        let wants_noise = self.whole && self.detectors.cn0.needs_reference();
        let quiet = self.accumulator.quiet_tap(period.number).filter(|_| wants_noise);
        let sides = self.detectors.side_peaks.as_ref().filter(|_| self.whole && !self.held).map(SidePeaks::taps);
        self.accumulator.correlate(period, quiet, sides)
    }

    /// The prompt of the running period's first half, where a false lock shows there alone.
    fn first_half<C: Correlator>(&self, period: &Period<C>) -> Option<Complex64> {
        let is_due = !self.detectors.is_true || period.number.is_multiple_of(HALVES_EVERY);
        // The frequency loop alone has come to rest before.
        let rests = matches!(self.stage, Stage::Assisted(_) | Stage::Tracking(_));
        let is_wanted = self.signs.are_single() && self.whole && !self.held && rests && is_due;
        self.accumulator.coded.as_ref().filter(|_| is_wanted).map(|coded| period.first_half(coded))
    }

    /// Correlates the running period with all segments of the long code, where the carrier is locked to
    /// symbols; gives the long code's phase once it is beyond doubt.
    fn seek_segment<C: Correlator>(&mut self, period: &Period<C>, scale: f64) -> Option<SecondaryCodePhase> {
        let ready = self.whole && self.signs.confirmed && !self.held && !self.moved && self.signs.phase.is_none();
        if !ready || self.stage.begin().is_none() || !self.detectors.lock.is_locked() {
            return None;
        }
        let code = &self.accumulator.coded.as_ref()?.code;
        self.companions.long.as_mut()?.add(period.number, code, |coded| scale * period.prompt(coded).re)
    }

    /// Takes the correlations of code period `number`: early, prompt, late, and very early less very late.
    fn take(&mut self, number: u64, taps: [Complex64; 4], report: &mut Report) {
        let prompt = taps[1];
        self.accumulator.add(taps);
        self.glances.add(number, prompt, self.accumulator.previous);
        match &mut self.stage {
            Stage::Open(batch) => batch.add(prompt),
            Stage::Frequency(lock) | Stage::Assisted(lock) => lock.add(prompt, self.detectors.noise()),
            Stage::Tracking(_) => self.take_in_symbol(number, prompt, report),
        }
        if self.accumulator.periods >= self.periods_per_update() {
            self.update();
            if let Some(shape) = report.shape.as_mut().filter(|_| self.is_at_rest()) {
                shape.add(self.last.prompt, self.last.sides, self.last.integration_s);
            }
            self.accumulator.clear(self.nco.first);
        }
        self.keep_to_symbols(number);
        self.accumulator.previous = Some(prompt);
        self.supervise(number, prompt, report);
        self.take_offset();
        self.set_steps();
    }

    /// Collects the prompts of a symbol and gives it out at its end.
    fn take_in_symbol(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        let Stage::Tracking(tracking) = &mut self.stage else { return };
        if self.held {
            return;
        }
        let (signs, first) = (&self.signs, self.nco.first);
        let is_in_bit = signs.bit_begin.is_some();
        if is_in_bit && signs.confirmed {
            // As it was sent, with the sign that its bit's code has there.
            let soft = (prompt.re * signs.chip(number)) as f32;
            report.symbols.push(Symbol { first_period: number, end: first, soft });
        }
        tracking.symbol.0 += prompt;
        tracking.symbol.1 += 1;
        tracking.rotation.add(prompt, tracking.symbol.1, signs.group);
        if !signs.ends_symbol(number, tracking.begin) {
            return;
        }
        let (sum, periods) = std::mem::take(&mut tracking.symbol);
        if periods != signs.group {
            return;
        }
        let symbol_s = self.period_s * f64::from(signs.group);
        let slipped = tracking.lock.add(sum, self.detectors.cn0.hz().map(|hz| hz * symbol_s));
        let (first_period, length) = (number + 1 - u64::from(signs.group), f64::from(signs.group));
        let (has_symbols, confirmed) = (signs.has_symbols, signs.confirmed);
        if slipped && self.detectors.lock.slip(first) {
            self.break_count(report);
        }
        if has_symbols && confirmed && !is_in_bit {
            report.symbols.push(Symbol { first_period, end: first, soft: (sum.re / length.sqrt()) as f32 });
        }
    }

    /// True while all loops follow a signal whose symbols are known, with their final bandwidths.
    fn is_at_rest(&self) -> bool {
        let tracks = matches!(self.stage, Stage::Tracking(_)) && self.detectors.lock.is_locked();
        tracks && self.signs.confirmed && !self.held && !self.moved && !self.pull_in.is_wide
    }

    /// Closes the loops with the sums of an integration.
    fn update(&mut self) {
        let sums = self.accumulator.sums;
        let periods = self.accumulator.periods;
        // With a secondary code out of place nothing but the code is where it seems.
        let astray = self.held && self.has_secondary_code();
        let before = match self.stage {
            _ if astray => None,
            Stage::Tracking(_) => self.accumulator.previous_sum,
            // The batch gives the frequency to tenths of a hertz; pairs of weak prompts would add hertz.
            Stage::Assisted(_) if self.pull_in.is_batched => None,
            Stage::Frequency(_) | Stage::Assisted(_) => self.accumulator.previous,
            // Nothing may correct the frequency.
            Stage::Open(_) => None,
        };
        self.accumulator.previous_sum = Some(sums[1]);
        let mode = if astray { Mode::Frequency } else { self.stage.mode() };
        let t_s = self.period_s * f64::from(periods);
        self.last = self.loops.close(mode, sums, before, periods, t_s, Some(self.detectors.cn0_hz()));
        self.nco.turn(self.last.carrier_jump_cycles);
        self.glances.close(self.last.dll_chips, self.last.code_jump_chips);
        self.nco.code += chips_to_units(self.last.code_jump_chips);
    }

    /// Takes over a new offset between carrier and code, and moves the code to where the loop would settle
    /// with it.
    fn take_offset(&mut self) {
        let Some(chips_per_s) = self.nco.take_offset() else { return };
        let jump_chips = self.loops.aid_code(chips_per_s, self.update_s());
        self.glances.move_by(jump_chips);
        self.nco.code += chips_to_units(jump_chips);
    }
}
