//! Thermal jitter, dynamic stress, thresholds and cycle slips of Costas phase loops.
//!
//! Angles in radians, C/N0 in hertz, T the coherent integration, B the one-sided noise bandwidth of the
//! discrete loop. Sources: Kaplan and Hegarty, Understanding GPS 2nd ed., 5.6.1; Viterbi, Principles of
//! Coherent Communication 1966. Limits: small errors; the arctangent is 4 % larger where T·C/N0 is 3
//! and by 10 to 20 % where it is 1.

use std::f64::consts::PI;

/// Limit of 3σ plus dynamic error for the two-quadrant arctangent: 45°. Kaplan and Hegarty, eq. 5.5.
pub const LIMIT_RAD: f64 = PI / 4.0;
/// Rule-of-thumb limit of jitter alone: 15°.
pub const THRESHOLD_RAD: f64 = PI / 12.0;

/// Standard deviation of one discriminator value with its squaring loss: √(1/(2T·C/N0)·(1+1/(2T·C/N0))).
pub fn raw_rad(t_s: f64, cn0_hz: f64) -> f64 {
    let x = 1.0 / (planted!("analysis.theory.pll", 2.0, 1.0) * t_s * cn0_hz);
    (x * (1.0 + x)).sqrt()
}

/// Closed-loop jitter √(B/(C/N0)·(1+1/(2T·C/N0))), eq. 5.6.
pub fn jitter_rad(bandwidth_hz: f64, t_s: f64, cn0_hz: f64) -> f64 {
    raw_rad(t_s, cn0_hz) * (2.0 * bandwidth_hz * t_s).sqrt()
}

/// Steady error under a constant n-th derivative of the phase (any unit a second^n), n being the loop's
/// order: derivative/ω0^n for the analogue prototypes of nominal bandwidth B (table 5.6, ω0 = 4B, B/0.53,
/// B/0.7845).
pub fn stress(order: u32, bandwidth_hz: f64, derivative: f64) -> f64 {
    let w = match order {
        1 => 4.0 * bandwidth_hz,
        2 => bandwidth_hz / 0.53,
        _ => bandwidth_hz / 0.7845,
    };
    (0..order.clamp(1, 3)).fold(derivative, |error, _| error / w)
}

/// Steady error, exact for a discrete loop with phase-and-rate feedback: derivative·T^n over the last gain.
pub fn stress_discrete(order: u32, last_gain: f64, t_s: f64, derivative: f64) -> f64 {
    (0..order.clamp(1, 3)).fold(derivative, |error, _| error * t_s) / last_gain
}

/// Jitter from several causes and dynamic error within 3σ + θ ≤ 45°: thermal, vibration and oscillator add in
/// square.
pub fn holds(jitters_rad: &[f64], stress_rad: f64) -> bool {
    let variance: f64 = jitters_rad.iter().map(|sigma| sigma * sigma).sum();
    3.0 * variance.sqrt() + stress_rad.abs() <= LIMIT_RAD
}

/// C/N0 in dB-Hz at which the thermal jitter is `jitter_rad`: the positive root of the quadratic in 1/(C/N0).
pub fn cn0_dbhz(jitter_rad: f64, bandwidth_hz: f64, t_s: f64) -> f64 {
    let x = t_s * ((1.0 + 2.0 * jitter_rad * jitter_rad / (bandwidth_hz * t_s)).sqrt() - 1.0);
    -10.0 * libm::log10(x)
}

/// Least C/N0 in dB-Hz for 3σ + θ ≤ 45°, with other jitter `other_rad` beside the thermal one; `None` where
/// those alone exceed the limit.
pub fn least_cn0_dbhz(bandwidth_hz: f64, t_s: f64, stress_rad: f64, other_rad: f64) -> Option<f64> {
    let total = (LIMIT_RAD - stress_rad.abs()) / 3.0;
    let thermal = total * total - other_rad * other_rad;
    (total > 0.0 && thermal > 0.0).then(|| cn0_dbhz(thermal.sqrt(), bandwidth_hz, t_s))
}

/// Phase jitter from vibration, in radians: f0·√∫Sv²(f)·P(f)/f² df, for a density P (g²/Hz) and a sensitivity
/// Sv (1/g), by the trapezium rule over (frequency, density) points. Kaplan and Hegarty, eq. 5.7.
pub fn vibration_rad(carrier_hz: f64, sensitivity_per_g: f64, density: &[(f64, f64)]) -> f64 {
    let term = |&(f, p): &(f64, f64)| p / (f * f);
    let area: f64 = density.windows(2).map(|w| 0.5 * (w[1].0 - w[0].0) * (term(&w[0]) + term(&w[1]))).sum();
    carrier_hz * sensitivity_per_g * area.sqrt()
}

/// Mean time between cycle slips of a first-order Costas loop with jitter σ: π²ρ·I0²(ρ)/(2B), ρ = 1/(4σ²)
/// (Viterbi 1966, with the doubled angle of a Costas loop). Infinite where it leaves the range of `f64`.
///
/// An order of magnitude: loops of order 2 and 3 slip sooner (Holmes and Raghavan 2009), an arctangent later.
pub fn slip_time_s(jitter_rad: f64, bandwidth_hz: f64) -> f64 {
    let rho = 0.25 / (jitter_rad * jitter_rad);
    let scaled = bessel_i0_scaled(rho);
    PI * PI * rho * scaled * scaled * libm::exp(2.0 * rho) / (2.0 * bandwidth_hz)
}

/// e^−x·I0(x): the power series for small x, Hankel's expansion for large (Abramowitz and Stegun 9.6.12,
/// 9.7.1).
fn bessel_i0_scaled(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    if x < 30.0 {
        for k in 1..=100 {
            let half = 0.5 * x / f64::from(k);
            term *= half * half;
            sum += term;
        }
        sum * libm::exp(-x)
    } else {
        for k in 1..=12 {
            let odd = f64::from(2 * k - 1);
            term *= odd * odd / (8.0 * x * f64::from(k));
            sum += term;
        }
        sum / (2.0 * PI * x).sqrt()
    }
}
