//! Figures that the report adds to the summary, and rules of thumb for loops.

use super::PLL_THRESHOLD_DEG;
use crate::expect::stated::Stated;
use crate::judge::verdict::Verdict;
use crate::measure::allan::Point;
use crate::statistics::Spread;
use gnss::record::NavigationRow;

/// Figures that the report adds to the summary.
#[derive(Clone, Debug, Default)]
pub struct Details {
    /// Code error with the epoch's common part removed.
    pub pseudorange_m: Option<Spread>,
    /// Errors of the carriers, cycles.
    pub carrier_cycles: Option<Spread>,
    /// Errors of the Dopplers, Hz.
    pub doppler_hz: Option<Spread>,
    /// Errors of C/N0, dB.
    pub cn0_db: Option<Spread>,
    /// Mean of the C/N0 that the scene sets at the antenna, dB-Hz.
    pub cn0_true_dbhz: Option<f64>,
    /// Mean C/N0 with other satellites and interference counted as noise, dB-Hz.
    pub cn0_effective_dbhz: Option<f64>,
    /// Mean of the C/N0 that the receiver should measure, less what front end and replica cost too, dB-Hz.
    pub cn0_expected_dbhz: Option<f64>,
    /// Mean of the C/N0 that the receiver measures, dB-Hz.
    pub cn0_measured_dbhz: Option<f64>,
    /// Errors of the fixes to the east, metres.
    pub east_m: Option<Spread>,
    /// Errors of the fixes to the north, metres.
    pub north_m: Option<Spread>,
    /// Errors of the fixes upward, metres.
    pub up_m: Option<Spread>,
    /// Errors of the receiver's clock, metres.
    pub clock_m: Option<Spread>,
    /// Errors of the velocity, m/s.
    pub velocity_mps: Option<Spread>,
    /// Overlapping Allan deviation of the clock's estimate at 1 s.
    pub clock_oadev_1s: Option<Point>,
    /// Rules of thumb for the loops.
    pub thresholds: Thresholds,
    /// Lowest point of the spectrum near each first null of the code, noise-free scenes only.
    pub psd_nulls_hz: Vec<f64>,
    /// Expected density at the frequencies of `psd.csv`, in its decibels; empty where there is none.
    pub psd_theory_db: Vec<f64>,
    /// Observations that the truth has no row for.
    pub unmatched_observations: usize,
    /// Wrong parameters, as decoded.
    pub wrong_parameters: Vec<NavigationRow>,
    /// Satellites found that the truth never has.
    pub false_satellites: Vec<String>,
    /// Every figure against its limit.
    pub verdict: Verdict,
    /// Losses that the stated C/N0 does not contain.
    pub stated: Stated,
}

/// Bounds for loop jitter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thresholds {
    /// A sixth of the early-late spacing: 3σ stays inside the discriminator's linear zone.
    pub dll_chips: f64,
    /// Bound of the phase loop, degrees.
    pub pll_deg: f64,
    /// A twelfth of the inverse integration time.
    pub fll_hz: f64,
}

impl Thresholds {
    pub(super) fn new(spacing_chips: f64, integration_s: f64) -> Self {
        Self { dll_chips: spacing_chips / 6.0, pll_deg: PLL_THRESHOLD_DEG, fll_hz: 1.0 / (12.0 * integration_s) }
    }
}
