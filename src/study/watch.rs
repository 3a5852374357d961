//! The lock detectors of a channel in steady tracking, by the receiver's own rules:
//! `receiver::track::channel::supervise`.

use num_complex::Complex64;

use crate::receiver::track::TrackingSettings;
use crate::receiver::track::lock::SymbolLock;

/// Phase lock and signal strength over time.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    symbol_lock: SymbolLock,
    symbol_s: f64,
    locked: bool,
    /// When lock or strength was lost.
    since_s: Option<f64>,
    pub(super) interruptions: u64,
}

impl Watch {
    /// Locked, as a channel is that has just found its symbols, of `symbol_s` each.
    pub(super) fn new(symbol_s: f64) -> Self {
        Self { symbol_lock: SymbolLock::locked(), symbol_s, locked: true, since_s: None, interruptions: 0 }
    }

    /// Takes the prompt of a symbol that ended at `time_s`; says whether the receiver gives the signal up.
    pub(super) fn add(
        &mut self,
        symbol: Complex64,
        cn0_hz: Option<f64>,
        time_s: f64,
        settings: &TrackingSettings,
    ) -> bool {
        let slipped = self.symbol_lock.add(symbol, cn0_hz.map(|hz| hz * self.symbol_s));
        let weak = cn0_hz.is_some_and(|hz| 10.0 * libm::log10(hz) < settings.cn0_threshold_dbhz);
        let value = self.symbol_lock.value();
        if self.locked && (slipped || value < settings.phase_unlock_threshold) {
            self.locked = false;
            self.interruptions += 1;
            self.since_s = Some(time_s);
        } else if !self.locked && value >= settings.phase_lock_threshold && self.symbol_lock.settled() {
            self.locked = true;
        }
        if weak {
            self.since_s = self.since_s.or(Some(time_s));
        } else if self.locked {
            self.since_s = None;
        }
        self.since_s.is_some_and(|since_s| time_s - since_s >= settings.loss_s)
    }
}
