//! The lock detectors of a channel in steady tracking, by the receiver's own rules: `receiver::track::channel::supervise`.

use num_complex::Complex64;

use crate::receiver::track::TrackingSettings;
use crate::receiver::track::lock::{LOCK_SYMBOLS, PhaseLock, SLIP_COSINE};

/// Phase lock and signal strength over time.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    phase_lock: PhaseLock,
    locked: bool,
    /// When lock or strength was lost.
    since_s: Option<f64>,
    pub(super) interruptions: u64,
}

impl Watch {
    /// Locked, as a channel is that has just found its symbols.
    pub(super) fn new() -> Self {
        let mut phase_lock = PhaseLock::new(LOCK_SYMBOLS);
        phase_lock.add_equal(Complex64::ONE);
        Self { phase_lock, locked: true, since_s: None, interruptions: 0 }
    }

    /// Takes the prompt of a symbol that ended at `time_s`; says whether the receiver gives the signal up.
    pub(super) fn add(
        &mut self,
        symbol: Complex64,
        cn0_hz: Option<f64>,
        time_s: f64,
        settings: &TrackingSettings,
    ) -> bool {
        let cosine = self.phase_lock.add_equal(symbol);
        let weak = cn0_hz.is_some_and(|hz| 10.0 * libm::log10(hz) < settings.cn0_threshold_dbhz);
        let value = self.phase_lock.value();
        if self.locked && (cosine < SLIP_COSINE || value < settings.phase_unlock_threshold) {
            self.locked = false;
            self.interruptions += 1;
            self.since_s = Some(time_s);
        } else if !self.locked && value >= settings.phase_lock_threshold && self.phase_lock.settled() {
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
