//! The stages of a channel, each with the detectors that it alone has.

use num_complex::Complex64;

use crate::track::closed::Mode;
use crate::track::lock::{PhaseLock, Rotation, SymbolLock};
use crate::track::pull_in::Batch;

/// Prompts over which phase lock is averaged before symbols are known.
const LOCK_PERIODS: f64 = 100.0;

/// Stage of a channel.
#[derive(Clone, Debug)]
pub(super) enum Stage {
    /// The carrier's oscillator runs free, while prompts are collected.
    Open(Batch),
    /// The frequency loop runs.
    Frequency(PhaseLock),
    /// The phase loop runs, assisted by the frequency loop.
    Assisted(PhaseLock),
    /// The phase loop runs, and integrations keep to symbols.
    Tracking(Tracking),
}

/// State of a channel whose symbols are known.
#[derive(Clone, Debug)]
pub(super) struct Tracking {
    /// Symbols begin at code periods of this residue.
    pub begin: u64,
    /// Sum of the running symbol's prompts, and their number.
    pub symbol: (Complex64, u32),
    pub rotation: Rotation,
    pub lock: SymbolLock,
}

impl Stage {
    /// The frequency loop, which has not begun.
    pub fn frequency() -> Self {
        Self::Frequency(PhaseLock::new(LOCK_PERIODS))
    }

    /// The assisted phase loop, which has not begun.
    pub fn assisted() -> Self {
        Self::Assisted(PhaseLock::new(LOCK_PERIODS))
    }

    /// Set of loops that run.
    pub fn mode(&self) -> Mode {
        match self {
            Self::Open(_) | Self::Frequency(_) => Mode::Frequency,
            Self::Assisted(_) => Mode::Assisted,
            Self::Tracking(_) => Mode::Phase,
        }
    }

    /// Code period, modulo a symbol's, in which symbols begin; `None` before they are known.
    pub fn begin(&self) -> Option<u64> {
        match self {
            Self::Tracking(tracking) => Some(tracking.begin),
            Self::Open(_) | Self::Frequency(_) | Self::Assisted(_) => None,
        }
    }

    /// Value of phase lock, from −1 to 1.
    pub fn lock_value(&self) -> f64 {
        match self {
            Self::Tracking(tracking) => tracking.lock.value(),
            Self::Frequency(lock) | Self::Assisted(lock) => lock.value(),
            Self::Open(_) => 0.0,
        }
    }

    /// True if the value of phase lock counts for a new lock.
    pub fn is_settled(&self) -> bool {
        match self {
            Self::Tracking(tracking) => tracking.lock.settled(),
            Self::Assisted(lock) => lock.settled(),
            Self::Open(_) | Self::Frequency(_) => false,
        }
    }

    /// Begins the averages of the running stage again, for symbols of `symbol_s`.
    pub fn restart(&mut self, symbol_s: f64) {
        match self {
            Self::Tracking(tracking) => {
                (tracking.rotation, tracking.lock) = (Rotation::default(), SymbolLock::new(symbol_s));
            }
            Self::Frequency(lock) | Self::Assisted(lock) => *lock = PhaseLock::new(LOCK_PERIODS),
            Self::Open(_) => {}
        }
    }

    /// Forgets the running symbol.
    pub fn forget_symbol(&mut self) {
        if let Self::Tracking(tracking) = self {
            tracking.symbol = (Complex64::ZERO, 0);
        }
    }
}
