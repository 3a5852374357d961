//! The detectors of a channel, and what they lead to: the next stage, an interrupted carrier, the end.

use num_complex::Complex64;

use super::stage::{Stage, Tracking};
use super::{Channel, WEAK_DBHZ};
use crate::track::lock::{LockChange, Rotation, SymbolLock};
use crate::track::loops::Rates;
use crate::track::pull_in::Batch;
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
        let is_settled = self.start.is_some_and(|start| self.nco.since_s(start) >= self.settings.dll_pull_in_s);
        if self.pull_in.is_wide && is_settled {
            self.pull_in.is_wide = false;
            self.design();
        }
        match self.stage {
            Stage::Open(_) => self.search_batch(number, report),
            Stage::Frequency(_) if self.nco.since_s(self.pull_in.stage_since) >= self.settings.fll_pull_in_s => {
                if self.settings.pll_order < 3 {
                    // No loop would correct it from here on.
                    self.loops.carrier.acceleration = 0.0;
                }
                self.enter(Stage::assisted());
            }
            Stage::Frequency(_) => {}
            Stage::Assisted(_) => {
                self.limit_pull_in(self.pull_in.stage_since, report);
                if self.detectors.lock.is_locked() {
                    self.find_symbols(number, prompt, report);
                }
            }
            Stage::Tracking(_) => self.verify(number, prompt, report),
        }
        self.verify_within_periods(report);
    }

    /// Checks symbols and frequency while symbols are known.
    fn verify(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        if !self.signs.confirmed {
            self.limit_pull_in(self.pull_in.since, report);
        }
        if self.detectors.lock.is_locked() {
            self.verify_symbols(number, prompt, report);
            self.find_bits(number, prompt);
        }
        let enough = VERIFY_SYMBOLS.max((VERIFY_S / self.symbol_s()) as u32);
        if let Stage::Tracking(Tracking { rotation, .. }) = &mut self.stage
            && rotation.symbols() >= enough
        {
            let rotation = std::mem::take(rotation);
            self.verify_frequency(&rotation, report);
        }
    }

    /// Checks for a frequency error of half a cycle a period, where loops also settle if each period has its
    /// own sign. The halves of periods show it.
    fn verify_within_periods(&mut self, report: &mut Report) {
        let Some(cycles) = self.detectors.halves.cycles() else { return };
        self.detectors.forget_halves();
        let steps = (2.0 * cycles).round();
        self.detectors.is_true = steps == 0.0;
        if !self.detectors.is_true {
            let rate = self.loops.carrier.rate + 0.5 * steps / self.period_s;
            self.loops.carrier = Rates { rate, acceleration: 0.0 };
            self.interrupt(report);
            self.begin_pull_in();
        }
    }

    /// Gives up a channel that has pulled in since `since` and found no phase or no symbols in time.
    fn limit_pull_in(&mut self, since: u64, report: &mut Report) {
        let (waited_s, limit_s) = (self.nco.since_s(since), self.settings.pull_in_limit_s);
        // A lock that was there and broke has a limit of its own.
        if waited_s > limit_s || (self.detectors.lock.is_new() && waited_s > PHASE_LIMIT_SHARE * limit_s) {
            self.lose(report);
        }
    }

    /// Looks for the signal in the batch, and begins to track at the first probable edge of a symbol.
    fn search_batch(&mut self, number: u64, report: &mut Report) {
        let fresh = self.new_batch();
        let Stage::Open(batch) = &mut self.stage else { return };
        if !batch.is_full() {
            return;
        }
        let Some(found) = batch.search(self.detectors.noise()) else {
            *batch = fresh;
            if self.nco.since_s(self.pull_in.since) >= BATCHES * self.settings.fll_pull_in_s {
                self.lose(report);
            }
            return;
        };
        // Edges that a message does not show yet are waited for, as long as a pull-in may last: wrong ones
        // cost the channel.
        let rate = self.loops.carrier.rate + found.cycles / self.period_s;
        if self.signs.has_symbols && self.signs.group > 1 && !found.changes {
            if !batch.extend() {
                *batch = fresh;
                self.loops.carrier.rate = rate;
                self.limit_pull_in(self.pull_in.since, report);
            }
            return;
        }
        // Batches grow until they end where a symbol does.
        if !(batch.periods() - found.offset).is_multiple_of(self.signs.group as usize) {
            return;
        }
        self.loops.carrier = Rates { rate, acceleration: 0.0 };
        self.nco.turn(found.phase_cycles);
        if self.signs.secondary_code.is_some() && self.signs.phase.is_none() {
            self.enter(Stage::assisted());
            return;
        }
        self.track((number + 1) % u64::from(self.signs.group));
        self.signs.confirmed = !self.signs.has_symbols;
    }

    /// Confirms the edges of symbols, moves them, or restarts where they contradict what was beyond doubt.
    fn verify_symbols(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        let Some(begin) = self.stage.begin().filter(|_| self.signs.has_symbols) else { return };
        match self.signs.sync.add(number, self.detectors.whitened(prompt)) {
            Some(found) if found == begin => self.confirm(report),
            Some(_) if self.signs.confirmed => {
                self.interrupt(report);
                self.enter(Stage::assisted());
            }
            Some(found) => self.signs.pending = Some(found),
            None => {}
        }
        self.track_pending(number, report);
    }

    /// Begins to track at symbols whose edge is known.
    fn track_pending(&mut self, number: u64, report: &mut Report) {
        if let Some(begin) = self.signs.due(number) {
            self.track(begin);
            self.confirm(report);
        }
    }

    fn confirm(&mut self, report: &mut Report) {
        let signs = &mut self.signs;
        if !signs.confirmed && (signs.has_symbols || signs.secondary_code.is_some()) {
            report.events.push((self.nco.first, Event::BitSynchronised));
        }
        signs.confirmed = true;
    }

    /// Begins a stage before symbols are known.
    pub(super) fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.forget_bits();
        self.begin_stage();
        self.detectors.cn0.forget_symbols();
        self.signs.confirmed = false;
        self.detectors.forget_halves();
        self.design();
    }

    /// Begins to track, with symbols that begin at code periods of the residue `begin`.
    pub(super) fn track(&mut self, begin: u64) {
        let made = if self.detectors.lock.is_locked() { SymbolLock::locked } else { SymbolLock::new };
        let (symbol, lock) = ((Complex64::ZERO, 0), made(self.symbol_s()));
        self.stage = Stage::Tracking(Tracking { begin, symbol, rotation: Rotation::default(), lock });
        self.begin_stage();
        self.detectors.cn0.know_symbols();
        self.design();
    }

    /// Begins the search for symbols and an integration with a new stage.
    fn begin_stage(&mut self) {
        self.pull_in.stage_since = self.nco.first;
        self.signs.search_again();
        self.accumulator.clear(self.nco.first);
    }

    /// The stage in which a pull-in begins.
    fn begin_pull_in(&mut self) {
        self.pull_in.is_batched = 10.0 * libm::log10(self.detectors.cn0_hz()) < WEAK_DBHZ;
        self.pull_in.since = self.nco.first;
        // Batches are of code periods where bits are unknown.
        self.forget_bits();
        self.enter(if self.pull_in.is_batched { Stage::Open(self.new_batch()) } else { Stage::frequency() });
    }

    /// Begins to track at the first symbol after its edge is known.
    fn find_symbols(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        let prompt = self.detectors.whitened(prompt);
        let signs = &mut self.signs;
        if let Some(secondary_code) = signs.secondary_code.as_mut().filter(|_| signs.phase.is_none()) {
            if let Some(phase) = secondary_code.add(number, prompt) {
                self.wipe(phase);
            }
            return;
        }
        if signs.pending.is_none() {
            // A symbol of one period begins with each.
            let searched = signs.has_symbols && signs.group > 1;
            signs.pending = if searched { signs.sync.add(number, prompt) } else { Some(0) };
        }
        self.track_pending(number, report);
    }

    /// Follows phase lock; a dip is a slip, a long one the end.
    fn watch_phase(&mut self, report: &mut Report) {
        let now = self.nco.first;
        let is_weak = self.stage.begin().is_some() && self.detectors.is_weak();
        let value = (self.stage.lock_value(), self.stage.is_settled());
        match self.detectors.lock.follow(now, value, is_weak, &self.settings) {
            Some(LockChange::Locked) => report.events.push((now, Event::PhaseLocked)),
            Some(LockChange::Broken) => self.break_count(report),
            None => {}
        }
        if self.detectors.lock.is_lost(|since| self.nco.since_s(since), &self.settings) {
            self.lose(report);
        }
    }

    /// The carrier is not locked any more.
    pub(super) fn interrupt(&mut self, report: &mut Report) {
        if self.detectors.lock.interrupt() {
            self.break_count(report);
        } else {
            self.forget_phase();
        }
    }

    /// The count of a locked carrier is broken here.
    pub(super) fn break_count(&mut self, report: &mut Report) {
        report.events.push((self.nco.first, Event::CycleSlip));
        self.forget_phase();
    }

    /// Symbols and secondary code are sought where the phase is right only.
    fn forget_phase(&mut self) {
        self.signs.polarity = None;
        if self.forget_bits() && self.stage.begin().is_some() {
            // Every code period is a symbol by itself.
            self.track(0);
        }
        self.signs.search_again();
        if let Some(secondary_code) = &mut self.signs.secondary_code {
            secondary_code.clear();
        }
        if let Some(long) = &mut self.companions.long {
            long.clear();
        }
    }

    fn lose(&mut self, report: &mut Report) {
        if !self.lost {
            self.lost = true;
            self.detectors.lock.interrupt();
            report.events.push((self.nco.first, Event::LossOfLock));
        }
    }

    /// A Costas loop also locks where the phase turns by half cycles between symbols or updates; within
    /// symbols it shows.
    fn verify_frequency(&mut self, rotation: &Rotation, report: &mut Report) {
        let error_hz = rotation.cycles(self.signs.group) / self.period_s;
        let nearest_hz = 0.5 / self.symbol_s();
        if error_hz.abs() > FALSE_LOCK_SHARE * nearest_hz && self.detectors.lock.is_locked() {
            self.loops.carrier = Rates { rate: self.loops.carrier.rate + error_hz, acceleration: 0.0 };
            self.interrupt(report);
            self.begin_pull_in();
        }
    }
}
