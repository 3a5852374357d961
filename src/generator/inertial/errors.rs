//! Errors of inertial sensors: misalignment, scale factor, bias, g-sensitivity and noise.
//!
//! A triad turned by its misalignment sees its own components; each sensor scales them and adds its bias and
//! its noise ([`TriadErrors`]). Noise is the mean over the interval of processes that are stepped without
//! error ([`crate::random::markov`]): white, random walk, and 1/f as a sum of first-order Gauss-Markov
//! processes. Source of the terms: IEEE Std 952-1997, annex C. Limits: 1/f noise lies between the slowest and
//! the fastest of these processes; its Allan deviation is that of unending 1/f noise, less 1.4 % at most,
//! from 1 s to 500 s. Quantisation, temperature, vibration and the sensors' bandwidth are left out.

use std::f64::consts::PI;

use nalgebra::{Rotation3, Vector3};

use crate::random::Stream;
use crate::random::markov::{Process, Step};
use crate::vehicle::turn::{Turn, exponential};
use gnss::facts::{InertialFacts, TriadErrors};

/// Exponents of four that give the time constants of 1/f noise in seconds: 1/64 s to 4096 s.
const OCTAVES: std::ops::RangeInclusive<i32> = -3..=6;

/// Errors of gyroscopes and accelerometers, interval by interval.
pub struct Errors {
    gyro: Triad,
    accelerometer: Triad,
    g_sensitivity_radps_per_mps2: Vector3<f64>,
}

impl Errors {
    /// Creates the errors from interval `first` on; `stream` has the random numbers of the noise.
    pub fn new(facts: &InertialFacts, stream: Stream, first: u64) -> Self {
        let step_s = 1.0 / facts.rate_hz;
        let mut errors = Self {
            gyro: Triad::new(&facts.gyro, step_s, stream.named("gyro")),
            accelerometer: Triad::new(&facts.accelerometer, step_s, stream.named("accelerometer")),
            g_sensitivity_radps_per_mps2: Vector3::from(facts.g_sensitivity_radps_per_mps2),
        };
        for _ in 0..first {
            errors.gyro.noise();
            errors.accelerometer.noise();
        }
        errors
    }

    /// Returns measured angular rate and specific force by the true means over the next interval.
    pub fn measured(&mut self, rate_radps: Vector3<f64>, force_mps2: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let by_force = self.g_sensitivity_radps_per_mps2.component_mul(&force_mps2);
        (self.gyro.measured(rate_radps) + by_force, self.accelerometer.measured(force_mps2))
    }
}

/// Three sensors.
struct Triad {
    /// Rotation from the body's axes to the sensors'.
    turned: Rotation3<f64>,
    gain: Vector3<f64>,
    bias: Vector3<f64>,
    step_s: f64,
    noises: Vec<Noise>,
    count: u64,
}

/// One process on each axis.
struct Noise {
    step: Step,
    streams: [Stream; 3],
    levels: [f64; 3],
}

impl Triad {
    fn new(errors: &TriadErrors, step_s: f64, stream: Stream) -> Self {
        let noise = |(number, process): (u64, Process)| {
            let streams = [0, 1, 2].map(|axis| stream.part(number).part(axis));
            let levels = streams.map(|stream| process.begin(stream.normals(0))[1]);
            Noise { step: process.step(step_s), streams, levels }
        };
        Self {
            turned: Turn {
                quaternion: exponential(&-Vector3::from(errors.misalignment_rad)),
                rate_radps: Vector3::zeros(),
            }
            .rotation(),
            gain: Vector3::from(errors.scale_factor).add_scalar(1.0),
            bias: Vector3::from(errors.bias),
            step_s,
            noises: processes(errors).map(noise).collect(),
            count: 0,
        }
    }

    fn measured(&mut self, of_body: Vector3<f64>) -> Vector3<f64> {
        (self.turned * of_body).component_mul(&self.gain) + self.bias + self.noise()
    }

    /// Mean of the noise over the next interval.
    fn noise(&mut self) -> Vector3<f64> {
        self.count += 1;
        let mut sum: Vector3<f64> = Vector3::zeros();
        for noise in &mut self.noises {
            for ((sum, stream), level) in sum.iter_mut().zip(&noise.streams).zip(&mut noise.levels) {
                let [gained, next] = noise.step.take([0.0, *level], stream.normals(self.count));
                *sum += gained / self.step_s;
                *level = next;
            }
        }
        sum
    }
}

/// Processes of the errors that are there, each with a number of its own.
fn processes(errors: &TriadErrors) -> impl Iterator<Item = (u64, Process)> {
    let TriadErrors { random_walk, bias_instability, rate_walk, .. } = *errors;
    let white = Process::WhiteFrequency { level: random_walk * random_walk };
    let walk = Process::FrequencyWalk { level: rate_walk * rate_walk };
    // A sum of processes a factor of four apart has the one-sided density variance/(ln 4 · f); that of
    // bias instability is B²/(π f) (IEEE Std 952-1997, C.1.1).
    let variance = bias_instability * bias_instability * libm::log(4.0) / PI;
    let slow = OCTAVES.map(move |power| Process::Frequency { variance, tau_s: libm::pow(4.0, f64::from(power)) });
    let first = [(0, white), (1, walk)].into_iter().zip([random_walk > 0.0, rate_walk > 0.0]);
    let present = first.filter(|(_, present)| *present).map(|(process, _)| process);
    present.chain((2..).zip(slow).filter(move |_| bias_instability > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_without_noise_are_what_the_model_says() {
        let mut facts = InertialFacts { rate_hz: 100.0, ..InertialFacts::default() };
        facts.gyro.bias = [1e-3, 0.0, 0.0];
        facts.accelerometer.scale_factor = [0.0, 2e-3, 0.0];
        // Sensors turned by 90 degrees about down: their x looks where the body's right side is.
        facts.accelerometer.misalignment_rad = [0.0, 0.0, std::f64::consts::FRAC_PI_2];
        facts.g_sensitivity_radps_per_mps2 = [0.0, 0.0, 1e-4];
        let mut errors = Errors::new(&facts, Stream::new(1, "imu"), 0);
        let (rate, force) = errors.measured(Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, 2.0, 3.0));
        // Roundings of numbers near one.
        assert!((rate - Vector3::new(0.101, 0.2, 0.3003)).norm() < 1e-15, "{rate}");
        assert!((force - Vector3::new(2.0, -1.002, 3.0)).norm() < 1e-14, "{force}");
    }

    #[test]
    fn white_noise_has_its_random_walk_and_one_over_f_its_density() {
        let mut facts = InertialFacts { rate_hz: 100.0, ..InertialFacts::default() };
        facts.gyro.random_walk = 0.02;
        let mut errors = Errors::new(&facts, Stream::new(5, "imu"), 0);
        const N: u32 = 30_000;
        let squares: f64 = (0..N).map(|_| errors.measured(Vector3::zeros(), Vector3::zeros()).0.norm_squared()).sum();
        let found = squares / (3.0 * f64::from(N));
        // Variance of a mean over 10 ms: N²/τ. Five sigma of a variance of 90 000 values: 5 √(2/n).
        assert!((found / (0.02 * 0.02 * 100.0) - 1.0).abs() < 5.0 * (2.0 / (3.0 * f64::from(N))).sqrt(), "{found}");
        // One-sided density of the sum of Lorentzians, 4 σ² T/(1 + (2π f T)²), against B²/(π f), at the
        // geometric middle of the time constants: ripple 0.3 %, and 1/(2π f T) of either end, 2.7 %.
        let errors = TriadErrors { bias_instability: 3.0, ..TriadErrors::default() };
        let hz = 1.0 / (2.0 * PI * 8.0);
        let density: f64 = processes(&errors)
            .map(|(_, process)| match process {
                Process::Frequency { variance, tau_s } => {
                    4.0 * variance * tau_s / (1.0 + (tau_s * 2.0 * PI * hz) * (tau_s * 2.0 * PI * hz))
                }
                other => panic!("{other:?}"),
            })
            .sum();
        assert!((density * PI * hz / 9.0 - 1.0).abs() < 0.01, "{density}");
    }
}
