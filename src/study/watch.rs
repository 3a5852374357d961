//! The lock detectors of a channel in steady tracking: the receiver's own, fed with modelled prompts.

use num_complex::Complex64;

use receiver::track::TrackingSettings;
use receiver::track::lock::{LockChange, LockState, SymbolLock, is_weak};

/// Phase lock and signal strength over time, counted in code periods.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    symbol_lock: SymbolLock,
    state: LockState,
    period_s: f64,
    /// Duration of a symbol.
    symbol_s: f64,
    /// Breaks of the carrier's count so far.
    pub(super) interruptions: u64,
}

impl Watch {
    /// Locked, as a channel is that has just found its symbols, of `group` code periods each.
    pub(super) fn new(period_s: f64, group: u32) -> Self {
        Self {
            symbol_lock: SymbolLock::locked(period_s * f64::from(group)),
            state: LockState::locked(0),
            period_s,
            symbol_s: period_s * f64::from(group),
            interruptions: 0,
        }
    }

    /// Takes the prompt of a symbol that ended with code period `now`; says whether the receiver gives the
    /// signal up.
    pub(super) fn add(
        &mut self,
        symbol: Complex64,
        cn0_hz: Option<f64>,
        now: u64,
        settings: &TrackingSettings,
    ) -> bool {
        let slipped = self.symbol_lock.add(symbol, cn0_hz.map(|hz| hz * self.symbol_s));
        let slipped = slipped && self.state.slip(now);
        let lock = (self.symbol_lock.value(), self.symbol_lock.settled());
        let change = self.state.follow(now, lock, is_weak(cn0_hz, settings.least_cn0_hz()), settings);
        self.interruptions += u64::from(slipped) + u64::from(change == Some(LockChange::Broken));
        let time_s = |period: u64| period as f64 * self.period_s;
        self.state.is_lost(|since| time_s(now) - time_s(since), settings)
    }
}
