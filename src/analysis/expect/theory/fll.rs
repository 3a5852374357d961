//! Thermal jitter and thresholds of frequency loops.
//!
//! Hertz throughout; T is the integration of one prompt. Source: Kaplan and Hegarty, Understanding GPS 2nd
//! ed., eq. 5.19 and 5.20. The printed formula holds for pairs that share no prompt; the noise of overlapping
//! pairs is anticorrelated and their jitter several times smaller, which the linear system of the loop gives
//! exactly.

use std::f64::consts::TAU;

use super::linear::{FrequencyLoop, Pairs};
use super::pll;

/// Jitter √(4F·B/(C/N0)·(1+1/(T·C/N0)))/(2πT), eq. 5.19, for separate pairs; `f` is 1, or 2 near the
/// threshold.
pub fn jitter_hz(bandwidth_hz: f64, t_s: f64, cn0_hz: f64, f: f64) -> f64 {
    (4.0 * f * bandwidth_hz / cn0_hz * (1.0 + 1.0 / (t_s * cn0_hz))).sqrt() / (TAU * t_s)
}

/// Jitter of a loop as it is closed, from the noise of prompt phases (squaring loss included); `None` if
/// unstable.
pub fn jitter_of_loop_hz(frequency_loop: &FrequencyLoop, t_s: f64, cn0_hz: f64) -> Option<f64> {
    let phase_cycles = pll::raw_rad(t_s, cn0_hz) / TAU;
    let prompts = match frequency_loop.pairs {
        Pairs::Overlapping => 1.0,
        Pairs::Separate => 2.0,
    };
    Some((frequency_loop.linear().noise_gain()? * prompts).sqrt() * phase_cycles / t_s)
}

/// Jitter in hertz for order 1 and gain `k` on overlapping pairs, in closed form, if the discriminator saw
/// the rate of the last interval alone: √(2k²/(2−k))·σ/(2πT).
pub fn jitter_overlapping_first_order_hz(k: f64, t_s: f64, cn0_hz: f64) -> f64 {
    (2.0 * k * k / (2.0 - k)).sqrt() * pll::raw_rad(t_s, cn0_hz) / (TAU * t_s)
}

/// Probability that the phase between two prompts is more than a quarter cycle off, so that a two-quadrant
/// discriminator errs by half a cycle, 1/(2T): ½·e^(−T·C/N0), the error of differential phase shift keying
/// (Proakis, Digital Communications, 5.2-69).
///
/// Such values kick a narrow loop; they rule its jitter where T·C/N0 is below about 10.
pub fn wrap_probability(t_s: f64, cn0_hz: f64) -> f64 {
    0.5 * libm::exp(-t_s * cn0_hz)
}

/// Rule-of-thumb limit of jitter alone: 1/(12T).
pub fn threshold_hz(t_s: f64) -> f64 {
    1.0 / (12.0 * t_s)
}

/// True if 3σ and the dynamic error stay within ±1/(4T), eq. 5.20.
pub fn holds(jitter_hz: f64, stress_hz: f64, t_s: f64) -> bool {
    3.0 * jitter_hz + stress_hz.abs() <= 0.25 / t_s
}
