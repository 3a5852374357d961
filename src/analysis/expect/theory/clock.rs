//! Theory of a clock's stability: Allan variance of power-law noise, and of white noise in its readings.
//!
//! Source: IEEE Std 1139-2008 and W. J. Riley, NIST Special Publication 1065 (2008). S_y(f) = Σ h_α f^α is
//! one-sided and ends at a cutoff, which affects only the two phase noises. Limit: the flicker-phase form
//! needs 2π × cutoff × τ well above 1. Sampled phase (cutoff at half the rate) meets that at every τ.

use std::f64::consts::{LN_2, PI};

/// A measure of stability.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Deviation {
    /// Allan, from differences that do not overlap.
    Adev,
    /// Allan, from a difference at every sample.
    Oadev,
    /// Modified Allan: phase averaged over τ first.
    Mdev,
    /// Time deviation, τ × modified Allan/√3, in seconds.
    Tdev,
    /// Hadamard, from third differences that do not overlap.
    Hdev,
    /// Hadamard, from a third difference at every sample.
    Ohdev,
    /// Total: Allan over the data reflected at both ends.
    Totdev,
}

impl Deviation {
    /// List of all deviations, in the order of `allan.csv`.
    pub const ALL: [Self; 7] = [Self::Adev, Self::Oadev, Self::Mdev, Self::Tdev, Self::Hdev, Self::Ohdev, Self::Totdev];

    /// Common abbreviation of the deviation, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Adev => "adev",
            Self::Oadev => "oadev",
            Self::Mdev => "mdev",
            Self::Tdev => "tdev",
            Self::Hdev => "hdev",
            Self::Ohdev => "ohdev",
            Self::Totdev => "totdev",
        }
    }
}

/// Exponents α of the noises, in the order of every list of h here: white phase, flicker phase, white
/// frequency, flicker frequency, random walk of frequency.
pub const EXPONENTS: [i32; 5] = [2, 1, 0, -1, -2];

/// Euler's constant.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// Strengths of the power-law noises of a clock, in Hz^(−α − 1).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PowerLaw {
    /// h₂, h₁, h₀, h₋₁, h₋₂.
    pub h: [f64; 5],
}

impl PowerLaw {
    /// Noise of the frequency alone: white, flicker and random walk.
    pub const fn of_frequency(h0: f64, hm1: f64, hm2: f64) -> Self {
        Self { h: [0.0, 0.0, h0, hm1, hm2] }
    }

    /// One-sided density of the fractional frequency at `f_hz`.
    pub fn density(&self, f_hz: f64) -> f64 {
        self.h.iter().fold(0.0, |sum, h| sum * f_hz + h) / (f_hz * f_hz)
    }

    /// Allan variance at an averaging time, of noise up to `cutoff_hz`.
    pub fn allan_variance(&self, tau_s: f64, cutoff_hz: f64) -> f64 {
        self.h.iter().zip(allan_variance_of_each(tau_s, cutoff_hz)).map(|(h, unit)| h * unit).sum()
    }
}

/// Allan variance that each noise would have with h = 1, in the order of [`EXPONENTS`].
pub fn allan_variance_of_each(tau_s: f64, cutoff_hz: f64) -> [f64; 5] {
    let turn_s = 2.0 * PI * tau_s;
    [
        3.0 * cutoff_hz / (turn_s * turn_s),
        // 3γ − ln 2 is the 1.038 of the tables.
        (3.0 * EULER_GAMMA - LN_2 + 3.0 * libm::log(cutoff_hz * turn_s)) / (turn_s * turn_s),
        0.5 / tau_s,
        2.0 * LN_2,
        2.0 / 3.0 * PI * PI * tau_s,
    ]
}

/// A deviation when readings `tau0_s` apart carry independent errors of `sigma_s`; in seconds for the time
/// deviation.
pub fn white_phase(deviation: Deviation, sigma_s: f64, tau_s: f64, tau0_s: f64) -> f64 {
    // Sums of the squared weights of a second and of a third difference, 6 and 20, over the definitions' 2
    // and 6.
    let allan = 3.0_f64.sqrt() * sigma_s / tau_s;
    let averaged = (tau0_s / tau_s).sqrt();
    match deviation {
        Deviation::Adev | Deviation::Oadev | Deviation::Totdev => allan,
        Deviation::Hdev | Deviation::Ohdev => (10.0_f64 / 3.0).sqrt() * sigma_s / tau_s,
        Deviation::Mdev => allan * averaged,
        Deviation::Tdev => sigma_s * averaged,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, σ²(τ) = ∫ S_y(f) 2 sin⁴(πfτ)/(πfτ)² df, by midpoints evenly spaced in ln f.
    fn by_definition(alpha: i32, tau_s: f64, cutoff_hz: f64) -> f64 {
        let (from, to, steps) = (libm::log(1e-7 / tau_s), libm::log(cutoff_hz), 400_000);
        let step = (to - from) / f64::from(steps);
        let density = |k: i32| {
            let f_hz = libm::exp(from + (f64::from(k) + 0.5) * step);
            let (sine, arc) = (libm::sin(PI * f_hz * tau_s), PI * f_hz * tau_s);
            f_hz.powi(alpha) * 2.0 * sine.powi(4) / (arc * arc) * f_hz
        };
        (0..steps).map(density).sum::<f64>() * step
    }

    #[test]
    fn closed_forms_are_the_integral_that_defines_the_allan_variance() {
        let (tau_s, cutoff_hz) = (3.0, 50.0);
        for (alpha, closed) in EXPONENTS.into_iter().zip(allan_variance_of_each(tau_s, cutoff_hz)) {
            let integral = by_definition(alpha, tau_s, cutoff_hz);
            // Beyond the closed forms' leading term: with x = 2π·cutoff·τ = 942, the phase noises leave out
            // terms of 4/(3x) and 1/x; what white frequency noise has above the cutoff is
            // 3/(4π²·cutoff·τ²)·2τ = 1/1000; flicker and random walk have less there, and below 1e-7/τ the
            // integrand ends as f^(4 + α − 2 + 1).
            assert!((integral / closed - 1.0).abs() < 1.5e-3, "h{alpha}: {integral} against {closed}");
        }
    }

    #[test]
    fn winkel_s_temperature_compensated_oscillator_is_a_few_parts_in_ten_billion() {
        // J. Ó. Winkel, Modeling and Simulating GNSS Signal Structures and Receivers (2003), table 2.1.
        let tcxo = PowerLaw { h: [0.0, 0.0, 1e-21, 1e-20, 2e-20] };
        for (tau_s, expected) in [(0.1, 1.8e-10), (1.0, 3.8e-10), (10.0, 1.15e-9)] {
            let deviation = tcxo.allan_variance(tau_s, 50.0).sqrt();
            // Half of the last digit given.
            assert!((deviation / expected - 1.0).abs() < 0.03, "{tau_s} s: {deviation:e}");
        }
    }
}
