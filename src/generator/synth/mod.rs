//! Synthesis of samples from rays and waveforms: spreading codes, chip edges, carrier rotation.
//!
//! A [`Run`] is up to 4096 samples of one sequence of a ray with constant carrier and code steps, both phases
//! as fixed-point integers anchored at its first sample, so nothing accumulates from run to run.
//! [`mod@reference`] evaluates each sample in `f64`, [`exact`] the same at speed; [`lanes`] is the fast
//! kernel. Both take all rays of a segment at once, as [`bank`] gathers them, and what the layers and zeros
//! of a ray's components come to as several sequences of ±1 ([`waveform`]), a run each. They are plain
//! lane-array code that [`isa`] compiles for each instruction set with the same bits on all. Limits: 15 code
//! steps per sample.

pub mod angle;
pub mod band;
pub mod bank;
pub mod chips;
mod chorus;
mod dense;
pub mod exact;
pub mod isa;
pub mod lanes;
pub mod noise;
pub mod pulse;
pub mod reference;
pub mod resample;
mod responses;
pub mod tone;
pub mod waveform;
mod waves;

use band::Filter;
use pulse::Pulse;

use crate::fidelity::Arithmetic;

/// Longest run; the single-precision carrier of the fast kernel is re-anchored at least this often.
pub const RUN_SAMPLES: usize = 4096;

/// Fractional bits of a code phase: Q16.48 code steps.
pub const CODE_BITS: u32 = 48;

/// One code step as a Q16.48 phase.
pub const CODE_ONE: u64 = 1 << CODE_BITS;

/// A segment of one ray on which carrier and code advance by constant steps.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// Signs of the code steps in order, secondary code and data applied, most significant bit first. A bit
    /// of one is −1. At least [`chips::MARGIN_STEPS`] steps are before `position` and after the last
    /// sample.
    pub bits: &'a [u64],
    /// Code position of sample 0 in `bits`, Q16.48 steps.
    pub position: u64,
    /// Code steps per sample, Q16.48.
    pub step: u64,
    /// Carrier phase of sample 0, in 2^-64 turn.
    pub turns: u64,
    /// Advance of the carrier per sample, in 2^-64 turn.
    pub turns_step: u64,
    /// Peak amplitude of the carrier, in LSB.
    pub amplitude: f64,
    /// Response of band-limited edges to a step: a pulse instead of a level.
    pub pulse: Option<&'a Pulse>,
}

impl Run<'_> {
    /// True if one carrier serves both runs, which are a multiple of a quarter of a turn apart.
    pub fn shares_carrier(&self, other: &Run<'_>) -> bool {
        self.turns_step == other.turns_step && self.turns.wrapping_sub(other.turns) << 2 == 0
    }

    /// Quarters of a turn by which the run is ahead of one that shares its carrier, 0 to 3.
    #[inline(always)]
    fn quarters_ahead(&self, other: &Run<'_>) -> u64 {
        self.turns.wrapping_sub(other.turns) >> (u64::BITS - 2)
    }

    /// True if both runs have the same pulse and their chips at the same positions.
    fn pulses_with(&self, other: &Run<'_>) -> bool {
        let same = |(a, b): (&Pulse, &Pulse)| std::ptr::eq(a, b);
        let places = |run: &Run<'_>| (run.position, run.step);
        self.pulse.zip(other.pulse).is_some_and(same) && places(self) == places(other)
    }
}

/// Distance from a position to the beginning of a code step, Q16.48 steps. Steps of a run reach beyond 2^15,
/// so neither is a signed number.
#[inline(always)]
fn to_step(position: u64, step: u64) -> f64 {
    let edge = step * CODE_ONE;
    if edge >= position { (edge - position) as f64 } else { -((position - edge) as f64) }
}

/// Model of a code edge between samples, with the data that it needs.
#[derive(Clone, Copy, Debug)]
pub enum Edge<'a> {
    /// Edge at the nearest sample.
    Nearest,
    /// Share of the sample's area on either side of the edge.
    Area,
    /// Through a low-pass filter.
    BandLimited(&'a Filter),
}

/// Configuration of the synthesis: the edge model, the arithmetic and the instruction set.
#[derive(Clone, Copy, Debug)]
pub struct Kernel<'a> {
    /// Model of code edges between samples.
    pub edge: Edge<'a>,
    /// Arithmetic of the kernel.
    pub arithmetic: Arithmetic,
    /// The instruction set.
    pub level: isa::Level,
}

impl Edge<'_> {
    /// Mean power in samples of a waveform of autocorrelation `correlation` (by whole steps, its power at lag
    /// 0) at `step` code steps per sample.
    pub fn power(&self, correlation: &[f64], step: f64) -> f64 {
        match self {
            Edge::Nearest => correlation.first().copied().unwrap_or(1.0),
            Edge::Area => area_power(correlation, step),
            Edge::BandLimited(filter) => filter.power(correlation, step),
        }
    }

    /// Lags of the correlation that [`Edge::power`] reads.
    pub fn lags(&self, step: f64) -> usize {
        match self {
            Edge::Nearest => 1,
            Edge::Area => step.ceil() as usize + 1,
            Edge::BandLimited(_) => (2.0 * band::HALF_WIDTH as f64 * step) as usize + 3,
        }
    }
}

/// Mean power of a stepped waveform averaged over an interval of `d` code steps.
///
/// `(2/d²) ∫₀^d (d − u) ρ(u) du` with ρ linear between the values of `correlation`. For `d` ≤ 1 this
/// is `1 − (d/3)(1 − ρ(1))`, that is `1 − d/3` for a random code, whose neighbours differ half the time.
fn area_power(correlation: &[f64], d: f64) -> f64 {
    let rho = |lag: usize| correlation.get(lag).copied().unwrap_or(0.0);
    let mut sum = 0.0;
    let mut lag = 0;
    while (lag as f64) < d {
        let a = lag as f64;
        let b = (a + 1.0).min(d);
        let at = |u: f64| (d - u) * (rho(lag) + (u - a) * (rho(lag + 1) - rho(lag)));
        // Simpson's rule is exact for this quadratic.
        sum += (b - a) / 6.0 * (at(a) + 4.0 * at(0.5 * (a + b)) + at(b));
        lag += 1;
    }
    2.0 * sum / (d * d)
}

/// A phase in 2^-64 turn as radians in [−π, π).
pub(crate) fn radians(turns: u64) -> f64 {
    turns as i64 as f64 * (std::f64::consts::TAU / 18_446_744_073_709_551_616.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_power_of_area_edges_is_one_minus_a_third_of_the_step() {
        let random = [1.0];
        for d in [0.04, 0.4, 1.0] {
            assert!((area_power(&random, d) - (1.0 - d / 3.0)).abs() < 1e-15);
        }
        // For d >= 1 of a random code the integral ends at lag 1: 1/d - 1/(3 d^2).
        assert!((area_power(&random, 2.5) - (1.0 / 2.5 - 1.0 / (3.0 * 6.25))).abs() < 1e-15);
    }
}
