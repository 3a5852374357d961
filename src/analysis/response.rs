//! Responses of a front end's filters as sampled filters have them, by their documented designs.
//!
//! A Butterworth filter is the analogue prototype's impulse response at the middles of the sample intervals:
//! its response is Σ (−1)^k·H(f + k·rate), H = Π ω/(jf·2π − p) over the prototype's poles p, and 1 at zero. A
//! wall is a sinc under a Kaiser window of 80 dB with an edge of a twentieth of its width (Kaiser 1974:
//! length 1 + (80 − 7.95)/(14.36·edge), β = 0.1102·(80 − 8.7)). Limits: lags below −100 dB of a Butterworth's
//! response and roundings of taps are left out.

use num_complex::Complex;

use crate::waveform::KaiserSinc;
use gnss::facts::{FilterShape, FilterSpec};

/// Attenuation of a wall, dB, and its edge over the filter's width.
const WALL_DB: f64 = 80.0;
const EDGE: f64 = 0.05;
/// Aliases of an analogue response to each side.
const ALIASES: i32 = 40;

/// Amplitude response against the frequency from the filter's middle.
#[derive(Clone, Debug)]
pub enum Response {
    /// Of a wall.
    Wall(KaiserSinc, f64),
    /// Of sampled poles.
    Poles {
        /// Poles of the prototype, radians a second.
        poles: Vec<Complex<f64>>,
        /// Distance from zero of all of them, radians a second.
        omega: f64,
        /// Samples a second.
        rate_hz: f64,
        /// One over the sum of aliases at zero.
        scale: f64,
    },
}

impl Response {
    /// Of a filter for samples at `rate_hz`.
    pub fn of(filter: &FilterSpec, rate_hz: f64) -> Self {
        let width = filter.bandwidth_hz / rate_hz;
        match filter.shape {
            FilterShape::BrickWall => {
                let length = ((WALL_DB - 7.95) / (14.36 * EDGE * width)).ceil() as usize | 1;
                let beta = 0.1102 * (WALL_DB - 8.7);
                Self::Wall(KaiserSinc::new(0.5 * width, 0.5 * length as f64, beta), rate_hz)
            }
            FilterShape::Butterworth { order } => {
                let omega = std::f64::consts::PI * filter.bandwidth_hz;
                let place = |k: u32| planted!("analysis.response.poles", 2 * k + order + 1, 2 * k + order);
                let angle = |k: u32| std::f64::consts::PI * f64::from(place(k)) / f64::from(2 * order);
                let pole = |k: u32| Complex::new(omega * libm::cos(angle(k)), omega * libm::sin(angle(k)));
                let mut made = Self::Poles { poles: (0..order).map(pole).collect(), omega, rate_hz, scale: 1.0 };
                // Real, as every alias meets its mirror image there.
                let at_zero = made.gain(0.0).re;
                if let Self::Poles { scale, .. } = &mut made {
                    *scale = 1.0 / at_zero;
                }
                made
            }
        }
    }

    /// Amplitude at `f_hz` from the middle.
    pub fn amplitude(&self, f_hz: f64) -> f64 {
        match self {
            Self::Wall(wall, rate_hz) => {
                let cycles = f_hz / rate_hz;
                wall.amplitude(cycles - cycles.round())
            }
            Self::Poles { rate_hz, .. } => self.gain(f_hz - rate_hz * (f_hz / rate_hz).round()).norm(),
        }
    }

    /// Amplitude and phase at `f_hz` from the middle, within half a sample rate of it. Of poles the phase is
    /// that of the response at its own instants, the middles of intervals: samples, which count from the
    /// first of them, come half an interval earlier. Of a wall it is zero, without the wall's delay.
    pub fn gain(&self, f_hz: f64) -> Complex<f64> {
        match self {
            Self::Wall(..) => Complex::new(self.amplitude(f_hz), 0.0),
            Self::Poles { poles, omega, rate_hz, scale } => {
                let analogue = |f_hz: f64| {
                    let at = Complex::new(0.0, std::f64::consts::TAU * f_hz);
                    poles.iter().fold(Complex::new(1.0, 0.0), |product, pole| product * *omega / (at - pole))
                };
                let alias = |k: i32| {
                    let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                    analogue(f_hz + f64::from(k) * rate_hz) * sign
                };
                (-ALIASES..=ALIASES).map(alias).sum::<Complex<f64>>() * *scale
            }
        }
    }

    /// The same squared.
    pub fn power(&self, f_hz: f64) -> f64 {
        let amplitude = self.amplitude(f_hz);
        amplitude * amplitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(shape: FilterShape, rate_hz: f64) -> Response {
        Response::of(&FilterSpec { shape, bandwidth_hz: 2e6, group_delay_s: 0.0, middle_hz: None }, rate_hz)
    }

    #[test]
    fn filters_halve_the_power_where_they_say() {
        let butterworth = of(FilterShape::Butterworth { order: 4 }, 60e6);
        assert!((butterworth.power(0.0) - 1.0).abs() < 1e-12);
        // Printed: 1/(1 + (f/f₀)^2n); aliases at thirty times the band are 1e-5 of the amplitude.
        assert!((butterworth.power(1e6) - 0.5).abs() < 1e-3, "{}", butterworth.power(1e6));
        assert!((butterworth.power(2e6) * 257.0 - 1.0).abs() < 1e-2, "{}", butterworth.power(2e6));
        let wall = of(FilterShape::BrickWall, 10e6);
        assert!((wall.power(1e6) - 0.25).abs() < 1e-3, "{}", wall.power(1e6));
        assert!((wall.power(0.9e6) - 1.0).abs() < 1e-3 && wall.power(1.06e6) < 1e-7, "{}", wall.power(1.06e6));
    }

    #[test]
    fn a_sampled_butterworth_is_the_transform_of_its_response() {
        // First order: h(t) = ω·e^(−ωt), sampled at the middles; second order: √2·ω·e^(−ωt/√2)·sin(ωt/√2).
        let (rate_hz, omega) = (5e6, std::f64::consts::PI * 2e6);
        let slow = omega / std::f64::consts::SQRT_2;
        let responses: [&dyn Fn(f64) -> f64; 2] =
            [&|t| libm::exp(-omega * t), &|t| libm::exp(-slow * t) * libm::sin(slow * t)];
        for (order, response) in [(1, responses[0]), (2, responses[1])] {
            let found = of(FilterShape::Butterworth { order }, rate_hz);
            let sum = |f_hz: f64| {
                let one = |k: i32| {
                    let (sin, cos) = libm::sincos(std::f64::consts::TAU * f_hz * f64::from(k) / rate_hz);
                    Complex::new(cos, -sin) * response((f64::from(k) + 0.5) / rate_hz)
                };
                (0..200).map(one).sum::<Complex<f64>>().norm()
            };
            for f_hz in [0.4e6, 1e6, 1.9e6, 2.5e6] {
                let expected = sum(f_hz) / sum(0.0);
                // Forty alternating aliases of a first order leave 1 % of the last, 1e-4 of the whole.
                assert!((found.amplitude(f_hz) - expected).abs() < 2e-3, "{order} {f_hz}: {expected}");
            }
        }
    }
}
