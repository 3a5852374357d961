//! The detectors of a channel, and what they lead to: the next stage, an interrupted carrier, the end.

use num_complex::Complex64;

use super::{Channel, LOCK_PERIODS, Stage, WEAK_DBHZ};
use crate::correlate::TURN;
use crate::track::halves::Halves;
use crate::track::lock::{LockChange, PhaseLock, Rotation, SymbolLock, is_weak};
use crate::track::loops::Rates;
use crate::track::pull_in::Batch;
use crate::track::sync::SymbolSync;
use crate::track::{Report, TrackingSettings};
use gnss::record::Event;

/// A frequency error beyond this, in spite of phase lock, is a false lock: between 0 and the nearest one,
/// 1/(2·symbol).
const FALSE_LOCK_SHARE: f64 = 0.4;
/// Symbols over which the frequency is verified.
const VERIFY_SYMBOLS: u32 = 25;
/// Least time of the verification, seconds. At 25 dB-Hz the error that is found in symbols of 20 ms scatters
/// by 2 Hz.
const VERIFY_S: f64 = 0.5;
/// Phase lock must come within this share of the limit for symbols.
const PHASE_LIMIT_SHARE: f64 = 0.5;
/// Batches of a weak signal's pull-in that may fail.
const BATCHES: f64 = 4.0;

/// Duration of a pilot's prompts that are summed like a symbol's.
const PILOT_S: f64 = 0.02;

/// Code periods of a pilot that are summed like a symbol's.
pub fn pilot_group(period_s: f64) -> u32 {
    ((PILOT_S / period_s).round() as u32).max(1)
}

/// An empty batch for symbols of `group` code periods of `period_s`: as long as the frequency loop's pull-in.
pub(super) fn batch(settings: &TrackingSettings, group: u32, period_s: f64) -> Batch {
    let periods = (settings.fll_pull_in_s / period_s) as usize;
    Batch::new(group, periods.max(4 * group as usize))
}

impl Channel {
    /// Detectors and changes of stage after code period `number`.
    pub(super) fn supervise(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        if self.held {
            return;
        }
        self.watch_phase(report);
        if self.wide && self.start.is_some_and(|start| self.since_s(start) >= self.settings.dll_pull_in_s) {
            self.wide = false;
            self.design();
        }
        match self.stage {
            Stage::Open => self.search_batch(number, report),
            Stage::Frequency if self.since_s(self.stage_since) >= self.settings.fll_pull_in_s => {
                if self.settings.pll_order < 3 {
                    // No loop would correct it from here on.
                    self.loops.carrier.acceleration = 0.0;
                }
                self.enter(Stage::Assisted);
            }
            Stage::Frequency => {}
            Stage::Assisted => {
                self.limit_pull_in(self.stage_since, report);
                if self.lock.is_locked() {
                    self.find_symbols(number, prompt, report);
                }
            }
            Stage::Tracking(begin) => {
                if !self.confirmed {
                    self.limit_pull_in(self.pull_in_since, report);
                }
                if self.lock.is_locked() {
                    self.verify_symbols(begin, number, prompt, report);
                    self.find_bits(number, prompt);
                }
                if self.rotation.symbols() >= VERIFY_SYMBOLS.max((VERIFY_S / self.symbol_s()) as u32) {
                    self.verify_frequency(report);
                }
            }
        }
        self.verify_within_periods(report);
    }

    /// True if each code period has its own sign, as far as is known.
    pub(super) fn has_single_periods(&self) -> bool {
        self.group == 1 && self.has_symbols
    }

    /// Checks for a frequency error of half a cycle a period, where loops also settle if each period has its
    /// own sign. The halves of periods show it.
    fn verify_within_periods(&mut self, report: &mut Report) {
        let Some(cycles) = self.halves.cycles() else { return };
        self.halves = Halves::default();
        let steps = (2.0 * cycles).round();
        self.is_true = steps == 0.0;
        if !self.is_true {
            let rate = self.loops.carrier.rate + 0.5 * steps / self.period_s;
            self.loops.carrier = Rates { rate, acceleration: 0.0 };
            self.interrupt(report);
            self.begin_pull_in();
        }
    }

    /// Gives up a channel that has pulled in since `since` and found no phase or no symbols in time.
    fn limit_pull_in(&mut self, since: u64, report: &mut Report) {
        let (waited_s, limit_s) = (self.since_s(since), self.settings.pull_in_limit_s);
        // A lock that was there and broke has a limit of its own.
        if waited_s > limit_s || (self.lock.is_new() && waited_s > PHASE_LIMIT_SHARE * limit_s) {
            self.lose(report);
        }
    }

    /// Looks for the signal in the batch, and begins to track at the first probable edge of a symbol.
    fn search_batch(&mut self, number: u64, report: &mut Report) {
        if !self.batch.is_full() {
            return;
        }
        let group = u64::from(self.group);
        let Some(found) = self.batch.search(self.noise()) else {
            if self.since_s(self.pull_in_since) >= BATCHES * self.settings.fll_pull_in_s {
                self.lose(report);
            }
            self.batch = self.new_batch();
            return;
        };
        // Edges that a message does not show yet are waited for, as long as a pull-in may last: wrong ones
        // cost the channel.
        let rate = self.loops.carrier.rate + found.cycles / self.period_s;
        if self.has_symbols && self.group > 1 && !found.changes {
            if !self.batch.extend() {
                self.loops.carrier.rate = rate;
                self.batch = self.new_batch();
                self.limit_pull_in(self.pull_in_since, report);
            }
            return;
        }
        // Batches grow until they end where a symbol does.
        if !(self.batch.periods() - found.offset).is_multiple_of(self.group as usize) {
            return;
        }
        self.loops.carrier = Rates { rate, acceleration: 0.0 };
        self.carrier += (found.phase_cycles * TURN) as i128;
        if self.secondary_code.is_some() && self.secondary_code_phase.is_none() {
            self.enter(Stage::Assisted);
            return;
        }
        self.enter(Stage::Tracking((number + 1) % group));
        self.confirmed = !self.has_symbols;
    }

    /// An empty batch of prompts for the pull-in of a weak signal.
    fn new_batch(&self) -> Batch {
        batch(&self.settings, self.group, self.period_s)
    }

    /// Confirms the edges of symbols, moves them, or restarts where they contradict what was beyond doubt.
    fn verify_symbols(&mut self, begin: u64, number: u64, prompt: Complex64, report: &mut Report) {
        if !self.has_symbols {
            return;
        }
        match self.sync.add(number, self.whitened(prompt)) {
            Some(found) if found == begin => self.confirm(report),
            Some(_) if self.confirmed => {
                self.interrupt(report);
                self.enter(Stage::Assisted);
            }
            Some(found) => self.pending = Some(found),
            None => {}
        }
        if let Some(begin) = self.pending
            && (number + 1) % u64::from(self.group) == begin
        {
            self.enter(Stage::Tracking(begin));
            self.confirm(report);
        }
    }

    fn confirm(&mut self, report: &mut Report) {
        if !self.confirmed && (self.has_symbols || self.secondary_code.is_some()) {
            report.events.push((self.first, Event::BitSynchronised));
        }
        self.confirmed = true;
    }

    /// A prompt with noise of unit variance a component, whatever the front end makes of its spectrum.
    pub(super) fn whitened(&self, prompt: Complex64) -> Complex64 {
        let noise = self.noise();
        if noise > 0.0 { prompt * (2.0 / noise).sqrt() } else { prompt }
    }

    /// Duration of what is summed like a symbol.
    fn symbol_s(&self) -> f64 {
        self.period_s * f64::from(self.group)
    }

    pub(super) fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        if !matches!(stage, Stage::Tracking(_)) {
            self.forget_bits();
        }
        self.stage_since = self.first;
        self.pending = None;
        self.sync = SymbolSync::new(self.group);
        self.batch = self.new_batch();
        self.rotation = Rotation::default();
        self.symbol = (Complex64::ZERO, 0);
        self.sums = [Complex64::ZERO; 3];
        self.summed = 0;
        self.update_since = self.first;
        match stage {
            Stage::Tracking(_) => {
                self.cn0.know_symbols();
                let made = if self.lock.is_locked() { SymbolLock::locked } else { SymbolLock::new };
                self.symbol_lock = made(self.symbol_s());
            }
            Stage::Open | Stage::Frequency | Stage::Assisted => {
                self.cn0.forget_symbols();
                self.phase_lock = PhaseLock::new(LOCK_PERIODS);
                self.confirmed = false;
                (self.halves, self.is_true) = (Halves::default(), false);
            }
        }
        self.design();
    }

    /// The stage in which a pull-in begins.
    fn begin_pull_in(&mut self) {
        self.is_batched = 10.0 * libm::log10(self.cn0_hz()) < WEAK_DBHZ;
        self.pull_in_since = self.first;
        self.enter(if self.is_batched { Stage::Open } else { Stage::Frequency });
    }

    /// Begins to track at the first symbol after its edge is known.
    fn find_symbols(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        let prompt = self.whitened(prompt);
        if self.secondary_code_phase.is_none()
            && let Some(secondary_code) = &mut self.secondary_code
        {
            if let Some(phase) = secondary_code.add(number, prompt) {
                self.wipe(phase);
            }
            return;
        }
        if self.pending.is_none() {
            // A symbol of one period begins with each.
            let searched = self.has_symbols && self.group > 1;
            self.pending = if searched { self.sync.add(number, prompt) } else { Some(0) };
        }
        if let Some(begin) = self.pending
            && (number + 1) % u64::from(self.group) == begin
        {
            self.enter(Stage::Tracking(begin));
            self.confirm(report);
        }
    }

    /// Phase lock, from −1 to 1.
    pub(super) fn lock_value(&self) -> f64 {
        match self.stage {
            Stage::Tracking(_) => self.symbol_lock.value(),
            Stage::Open | Stage::Frequency | Stage::Assisted => self.phase_lock.value(),
        }
    }

    /// Follows phase lock; a dip is a slip, a long one the end.
    fn watch_phase(&mut self, report: &mut Report) {
        let (settled, weak) = match self.stage {
            Stage::Tracking(_) => (self.symbol_lock.settled(), is_weak(self.cn0.hz(), self.least_cn0_hz)),
            Stage::Assisted => (self.phase_lock.settled(), false),
            Stage::Open | Stage::Frequency => (false, false),
        };
        match self.lock.follow(self.first, (self.lock_value(), settled), weak, &self.settings) {
            Some(LockChange::Locked) => report.events.push((self.first, Event::PhaseLocked)),
            Some(LockChange::Broken) => self.break_count(report),
            None => {}
        }
        if self.lock.is_lost(|since| self.since_s(since), &self.settings) {
            self.lose(report);
        }
    }

    /// The carrier is not locked any more.
    pub(super) fn interrupt(&mut self, report: &mut Report) {
        if self.lock.interrupt() {
            self.break_count(report);
        } else {
            self.forget_phase();
        }
    }

    /// The count of a locked carrier is broken here.
    pub(super) fn break_count(&mut self, report: &mut Report) {
        report.events.push((self.first, Event::CycleSlip));
        self.forget_phase();
    }

    /// Symbols and secondary code are sought where the phase is right only.
    fn forget_phase(&mut self) {
        self.polarity = None;
        self.forget_bits();
        self.sync = SymbolSync::new(self.group);
        if let Some(secondary_code) = &mut self.secondary_code {
            secondary_code.clear();
        }
        if let Some(long) = &mut self.long {
            long.clear();
        }
        self.pending = None;
    }

    fn lose(&mut self, report: &mut Report) {
        if !self.lost {
            self.lost = true;
            self.lock.interrupt();
            report.events.push((self.first, Event::LossOfLock));
        }
    }

    /// A Costas loop also locks where the phase turns by half cycles between symbols or updates; within
    /// symbols it shows.
    fn verify_frequency(&mut self, report: &mut Report) {
        let error_hz = self.rotation.cycles(self.group) / self.period_s;
        self.rotation = Rotation::default();
        let nearest_hz = 0.5 / (self.period_s * f64::from(self.group));
        if error_hz.abs() > FALSE_LOCK_SHARE * nearest_hz && self.lock.is_locked() {
            self.loops.carrier = Rates { rate: self.loops.carrier.rate + error_hz, acceleration: 0.0 };
            self.interrupt(report);
            self.begin_pull_in();
        }
    }
}
