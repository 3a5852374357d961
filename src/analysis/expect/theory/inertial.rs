//! Allan variance of inertial sensors by their errors, and the spread of attitude and position integrated
//! from them.
//!
//! Source of the Allan variances: IEEE Std 952-1997, annex C. The spread of an integration counts every bias
//! as constant over it and the largest specific force as if it kept its direction, so that it is an upper
//! bound.

use std::f64::consts::{LN_2, LN_10, PI};

use gnss::facts::{InertialFacts, TriadErrors};

/// Variance of 1/f noise in units of B²: a density of B²/(π f) over six decades, from hours to milliseconds.
const FLICKER: f64 = 6.0 * LN_10 / PI;

/// Allan variance of a sensor's output after averaging over `tau_s`, in squares of its unit.
pub fn allan_variance(errors: &TriadErrors, tau_s: f64) -> f64 {
    let [white, flicker, walk] = allan_variances(errors, tau_s);
    white + flicker + walk
}

/// Parts of [`allan_variance`] by white noise, 1/f noise and the random walk of the bias.
pub fn allan_variances(errors: &TriadErrors, tau_s: f64) -> [f64; 3] {
    let TriadErrors { random_walk, bias_instability, rate_walk, .. } = errors;
    [
        random_walk * random_walk / tau_s,
        2.0 * LN_2 / PI * bias_instability * bias_instability,
        rate_walk * rate_walk * tau_s / 3.0,
    ]
}

/// Variance of the bias `age_s` after the sensors were switched on, without its constant part.
fn bias_variance(errors: &TriadErrors, age_s: f64) -> f64 {
    FLICKER * errors.bias_instability * errors.bias_instability + errors.rate_walk * errors.rate_walk * age_s
}

/// Standard deviation in radians about each axis of an attitude that was integrated over `time_s`.
pub fn attitude_sigma_rad(facts: &InertialFacts, time_s: f64, age_s: f64) -> f64 {
    let white = facts.gyro.random_walk * facts.gyro.random_walk;
    (white * time_s + bias_variance(&facts.gyro, age_s) * time_s * time_s).sqrt()
}

/// Standard deviation in metres along each axis of a position that was integrated over `time_s`, under
/// specific forces of up to `force_mps2`.
pub fn position_sigma_m(facts: &InertialFacts, time_s: f64, age_s: f64, force_mps2: f64) -> f64 {
    let (gyro, accelerometer, t) = (&facts.gyro, &facts.accelerometer, time_s);
    let force2 = force_mps2 * force_mps2;
    let white = accelerometer.random_walk * accelerometer.random_walk * t.powi(3) / 3.0;
    let bias = bias_variance(accelerometer, age_s) * t.powi(4) / 4.0;
    let tilt = force2 * gyro.random_walk * gyro.random_walk * t.powi(5) / 20.0;
    let drift = force2 * bias_variance(gyro, age_s) * t.powi(6) / 36.0;
    (white + bias + tilt + drift).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sigmas_are_those_of_the_textbook() {
        let mut facts = InertialFacts { rate_hz: 100.0, ..InertialFacts::default() };
        facts.gyro.random_walk = 2e-4;
        facts.accelerometer.random_walk = 1e-3;
        // By hand: 2e-4·√100; then √(1e-6·1e6/3 + 96.04·4e-8·1e10/20).
        assert!((attitude_sigma_rad(&facts, 100.0, 0.0) - 2e-3).abs() < 1e-15);
        let position_m = position_sigma_m(&facts, 100.0, 0.0, 9.8);
        assert!((position_m - (1.0_f64 / 3.0 + 1920.8).sqrt()).abs() < 1e-9, "{position_m}");
        // Bias instability of 1 deg/h: a floor of 0.664 deg/h.
        let errors = TriadErrors { bias_instability: 1.0, ..TriadErrors::default() };
        assert!((allan_variance(&errors, 10.0).sqrt() - 0.664).abs() < 1e-3);
    }
}
