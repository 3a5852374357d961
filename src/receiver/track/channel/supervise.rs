//! The detectors of a channel, and what they lead to: the next stage, an interrupted carrier, the end.

use num_complex::Complex64;

use super::{Channel, LOCK_PERIODS, Stage};
use crate::gnss::record::Event;
use crate::receiver::track::Report;
use crate::receiver::track::lock::{Cn0, LOCK_SYMBOLS, PhaseLock, SymbolSync};
use crate::receiver::track::loops::{self, Rates};

/// A frequency error beyond this, in spite of phase lock, is a false lock: between 0 and the nearest one, 1/(2·symbol).
const FALSE_LOCK_SHARE: f64 = 0.4;
/// Symbols over which the frequency is verified.
const VERIFY_SYMBOLS: u32 = 25;
/// Phase lock must come within this share of the limit for symbols.
const PHASE_LIMIT_SHARE: f64 = 0.5;

impl Channel {
    /// Detectors and changes of stage after code period `number`.
    pub(super) fn supervise(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        self.watch_phase(report);
        if self.wide && self.start.is_some_and(|start| self.since_s(start) >= self.settings.dll_pull_in_s) {
            self.wide = false;
            self.design();
        }
        let limit_s = self.settings.pull_in_limit_s;
        match self.stage {
            Stage::Frequency if self.since_s(self.stage_since) >= self.settings.fll_pull_in_s => {
                if self.settings.pll_order < 3 {
                    // No loop would correct it from here on.
                    self.loops.carrier.acceleration = 0.0;
                }
                self.enter(Stage::Assisted);
            }
            Stage::Frequency => {}
            Stage::Assisted => {
                let waited_s = self.since_s(self.stage_since);
                if waited_s > limit_s || (self.locked_since.is_none() && waited_s > PHASE_LIMIT_SHARE * limit_s) {
                    self.lose(report);
                } else if self.locked_since.is_some() {
                    self.find_symbols(number, prompt, report);
                }
            }
            Stage::Tracking(begin) => {
                let moved = self.has_symbols && self.sync.add(number, prompt).is_some_and(|found| found != begin);
                if moved {
                    self.interrupt(report);
                    self.enter(Stage::Assisted);
                } else if self.rotation.1 >= VERIFY_SYMBOLS {
                    self.verify_frequency(report);
                }
            }
        }
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.stage_since = self.first;
        self.pending = None;
        self.sync = SymbolSync::new(self.group);
        self.rotation = (Complex64::ZERO, 0);
        self.symbol = (Complex64::ZERO, 0);
        self.sums = [Complex64::ZERO; 3];
        self.summed = 0;
        self.update_since = self.first;
        let tracking = matches!(stage, Stage::Tracking(_));
        let group = if tracking { self.group } else { 2 };
        self.cn0 = Cn0::new(group, self.period_s, self.settings.cn0_average_s);
        if !tracking {
            self.phase_lock = PhaseLock::new(LOCK_PERIODS);
        }
        self.design();
    }

    /// Begins to track at the first symbol after its edge is known.
    fn find_symbols(&mut self, number: u64, prompt: Complex64, report: &mut Report) {
        if self.pending.is_none() {
            self.pending = if self.has_symbols { self.sync.add(number, prompt) } else { Some(0) };
        }
        if let Some(begin) = self.pending
            && (number + 1) % u64::from(self.group) == begin
        {
            self.enter(Stage::Tracking(begin));
            // The lock just shown stands as the first of the longer means.
            self.phase_lock = PhaseLock::new(LOCK_SYMBOLS);
            self.phase_lock.add_equal(Complex64::ONE);
            if self.has_symbols {
                report.events.push((self.first, Event::BitSynchronised));
            }
        }
    }

    /// Follows phase lock; a dip is a slip, a long one the end.
    fn watch_phase(&mut self, report: &mut Report) {
        let value = self.phase_lock.value();
        let weak = matches!(self.stage, Stage::Tracking(_))
            && self.cn0.hz().is_some_and(|hz| 10.0 * libm::log10(hz) < self.settings.cn0_threshold_dbhz);
        if self.locked_since.is_some() {
            if value < self.settings.phase_unlock_threshold {
                self.interrupt(report);
                self.unlocked_since = Some(self.first);
            }
        } else if value >= self.settings.phase_lock_threshold && self.stage != Stage::Frequency {
            let settled = self.phase_lock.settled();
            if settled {
                self.locked_since = Some(self.first);
                report.events.push((self.first, Event::PhaseLocked));
                if !weak {
                    self.unlocked_since = None;
                }
            }
        }
        if weak && self.unlocked_since.is_none() {
            self.unlocked_since = Some(self.first);
        } else if !weak && self.locked_since.is_some() {
            self.unlocked_since = None;
        }
        if self.unlocked_since.is_some_and(|since| self.since_s(since) >= self.settings.loss_s) {
            self.lose(report);
        }
    }

    /// The carrier's count is broken here.
    pub(super) fn interrupt(&mut self, report: &mut Report) {
        if self.locked_since.take().is_some() {
            report.events.push((self.first, Event::CycleSlip));
        }
        self.polarity = None;
    }

    fn lose(&mut self, report: &mut Report) {
        if !self.lost {
            self.lost = true;
            self.locked_since = None;
            report.events.push((self.first, Event::LossOfLock));
        }
    }

    /// A Costas loop also locks where the phase turns by half cycles between symbols or updates; within symbols it shows.
    fn verify_frequency(&mut self, report: &mut Report) {
        let error_hz = loops::phase(self.rotation.0) / self.period_s;
        self.rotation = (Complex64::ZERO, 0);
        let nearest_hz = 0.5 / (self.period_s * f64::from(self.group));
        if error_hz.abs() > FALSE_LOCK_SHARE * nearest_hz && self.locked_since.is_some() {
            self.loops.carrier = Rates { rate: self.loops.carrier.rate + error_hz, acceleration: 0.0 };
            self.interrupt(report);
            self.enter(Stage::Frequency);
        }
    }
}
