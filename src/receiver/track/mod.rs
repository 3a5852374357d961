//! Tracking: one channel follows one signal of one satellite.

/// The state of a channel's replica at a requested sample.
#[derive(Clone, Copy, Debug)]
pub struct Measurement {
    pub sample: u64,
    /// Whole code periods since the channel's own period 0, and the fraction of the running one.
    pub code_periods: u64,
    pub code_fraction: f64,
    /// Accumulated carrier in the RINEX sense (grows with range, that is, against Doppler), nominal IF
    /// removed: θ(n)/turns − f_IF·n/fs, negated. Unknown whole number, and half while `half_cycle_known` is false.
    pub carrier_cycles: f64,
    pub half_cycle_known: bool,
    pub doppler_hz: f64,
    pub cn0_dbhz: f64,
    pub locked_s: f64,
    /// Whether the carrier loop is locked now.
    pub locked: bool,
}

/// One message symbol, with the polarity that the channel happened to lock to.
#[derive(Clone, Copy, Debug)]
pub struct Symbol {
    /// The channel's number of the code period in which the symbol began.
    pub first_period: u64,
    /// In-phase prompt summed over the symbol, in noise standard deviations: its sign is the bit.
    pub soft: f32,
}
