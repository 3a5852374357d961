//! Search: which satellites are there, at which Doppler and code phase.

use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;

/// A satellite that was found.
#[derive(Clone, Copy, Debug)]
pub struct Acquired {
    pub sv: Sv,
    pub signal: &'static Signal,
    /// Sample at which `code_phase_chips` holds.
    pub sample: u64,
    /// Code phase in [0, code length): chips of the received code already begun at `sample`.
    pub code_phase_chips: f64,
    pub doppler_hz: f64,
    pub cn0_dbhz: f64,
}
