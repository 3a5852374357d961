//! Phase jitter that the receiver's oscillator leaves in a phase loop.
//!
//! σ² = ∫ (f0/f)²·S_y(f)·|1−H|² df over one-sided S_y = h₀ + h₋₁/f + h₋₂/f² (NIST SP 1065, 3.3); for a
//! discrete loop times sinc²(fT), the mean over an interval. Coefficients: Winkel 2003, table 2.1. Limits: no
//! white or flicker phase noise, no vibration. Formulas in use with the prefactor 2π² in place of 4π² belong
//! to a two-sided density.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::clock::PowerLaw;
use super::linear::Linear;

/// A temperature-compensated crystal (Winkel 2003, table 2.1).
pub const TCXO: PowerLaw = PowerLaw::of_frequency(1e-21, 1e-20, 2e-20);
/// An oven-controlled crystal of low noise (OCXO2 of the same table).
pub const OCXO: PowerLaw = PowerLaw::of_frequency(2.51e-26, 2.51e-23, 2.51e-22);

/// Points of the integral in an octave; the integrand is smooth there, so that the trapezium rule errs below
/// 1e-4.
const POINTS_PER_OCTAVE: u32 = 48;

/// Jitter in radians of an oscillator multiplied to `carrier_hz`, `remaining(f)` being |1−H|² at `f` Hz,
/// integrated over `octaves` from `lowest_hz` up.
fn jitter_rad(noise: &PowerLaw, carrier_hz: f64, lowest_hz: f64, octaves: u32, remaining: impl Fn(f64) -> f64) -> f64 {
    let points = octaves * POINTS_PER_OCTAVE;
    let step = std::f64::consts::LN_2 / f64::from(POINTS_PER_OCTAVE);
    let sum: f64 = (0..=points)
        .map(|k| {
            let f = lowest_hz * libm::exp(step * f64::from(k));
            let weight = if k == 0 || k == points { 0.5 } else { 1.0 };
            weight * carrier_hz * carrier_hz / f * noise.density(f) * remaining(f)
        })
        .sum();
    (sum * step).sqrt()
}

/// Octaves below and above the natural frequency that the integral of an analogue loop covers.
const OCTAVES: u32 = 15;

/// Jitter in radians of an analogue loop of order 2 (damping a2 = √2) or 3 (a3 = 1.1, b3 = 2.4) of nominal
/// bandwidth B.
pub fn jitter_analogue_rad(noise: &PowerLaw, carrier_hz: f64, order: u32, bandwidth_hz: f64) -> f64 {
    let w0 = if order == 2 { bandwidth_hz / 0.53 } else { bandwidth_hz / 0.7845 };
    let lowest_hz = w0 / TAU / f64::from(1 << OCTAVES);
    jitter_rad(noise, carrier_hz, lowest_hz, 2 * OCTAVES, |f| {
        let s = Complex64::new(0.0, TAU * f / w0);
        let error = if order == 2 {
            s * s / (s * s + std::f64::consts::SQRT_2 * s + 1.0)
        } else {
            s * s * s / (s * s * s + 2.4 * s * s + 1.1 * s + 1.0)
        };
        error.norm_sqr()
    })
}

/// The integral in closed form for order 2 with a2 = √2: 4π²f0²·[π²h₋₂/(√2ω³) + πh₋₁/(4ω²) + h₀/(4√2ω)], in
/// radians.
pub fn jitter_second_order_rad(noise: &PowerLaw, carrier_hz: f64, bandwidth_hz: f64) -> f64 {
    let (w, root2) = (bandwidth_hz / 0.53, std::f64::consts::SQRT_2);
    let walk = PI * PI * noise.h[4] / (root2 * w * w * w);
    let flicker = PI * noise.h[3] / (4.0 * w * w);
    let white = noise.h[2] / (4.0 * root2 * w);
    TAU * carrier_hz * (walk + flicker + white).sqrt()
}

/// Jitter in radians of a discrete phase loop updated every `t_s`: error of the mean phase of an interval.
///
/// From 1e-6 of the update rate to 8 times it, aliases included.
pub fn jitter_discrete_rad(noise: &PowerLaw, carrier_hz: f64, system: &Linear, t_s: f64) -> f64 {
    jitter_rad(noise, carrier_hz, 8.0 / t_s / f64::from(1 << 23), 23, |f| {
        let angle = TAU * f * t_s;
        let (sin, cos) = libm::sincos(angle);
        let half = 0.5 * angle;
        let sinc = libm::sin(half) / half;
        // At a pole nothing can be said; a stable loop has none on the circle.
        system.response(Complex64::new(cos, sin)).map_or(0.0, |h| (1.0 - h).norm_sqr() * sinc * sinc)
    })
}
