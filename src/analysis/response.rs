//! Responses of a front end's filters as sampled filters have them, by their documented designs.
//!
//! A Butterworth filter has the analogue prototype's response within the samples' band: H = Π ω/(jf·2π − p)
//! over the prototype's poles p. A wall is a sinc under a Kaiser window of 80 dB with an edge of a twentieth
//! of its width (Kaiser 1974: length 1 + (80 − 7.95)/(14.36·edge), β = 0.1102·(80 − 8.7)). Limits: the window
//! of a sampled Butterworth filter, which counts within a fiftieth of the rate from the ends of the samples'
//! band, and roundings of taps are left out.

use num_complex::Complex;

use crate::waveform::KaiserSinc;
use gnss::facts::{FilterShape, FilterSpec};

/// Attenuation of a wall, dB, and its edge over the filter's width.
const WALL_DB: f64 = 80.0;
const EDGE: f64 = 0.05;

/// Amplitude response against the frequency from the filter's middle.
#[derive(Clone, Debug)]
pub enum Response {
    /// Response of a brick-wall filter.
    Wall(KaiserSinc, f64),
    /// Response of a filter with poles.
    Poles {
        /// Poles of the prototype, radians a second.
        poles: Vec<Complex<f64>>,
        /// Distance from zero of all of them, radians a second.
        omega: f64,
    },
}

impl Response {
    /// Response of a filter for samples at `rate_hz`.
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
                Self::Poles { poles: (0..order).map(pole).collect(), omega }
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
            Self::Poles { .. } => self.gain(f_hz).norm(),
        }
    }

    /// Amplitude and phase at `f_hz` from the middle, without the delay that the filter has in the middle.
    pub fn gain(&self, f_hz: f64) -> Complex<f64> {
        match self {
            Self::Wall(..) => Complex::new(self.amplitude(f_hz), 0.0),
            Self::Poles { poles, omega } => {
                let at = Complex::new(0.0, std::f64::consts::TAU * f_hz);
                // The group delay of a pole at zero frequency is the real part of −1/p.
                let delay_s = poles.iter().map(|pole| -pole.re).sum::<f64>() / (omega * omega);
                let (sin, cos) = libm::sincos(at.im * delay_s);
                poles.iter().fold(Complex::new(cos, sin), |product, pole| product * *omega / (at - pole))
            }
        }
    }

    /// Power response: the square of the amplitude.
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
    fn a_butterworth_s_phase_is_the_polynomial_s_without_the_delay_in_the_middle() {
        // Order 2, printed: 1/(1 + √2·s + s²), whose delay at zero is √2/ω.
        let found = of(FilterShape::Butterworth { order: 2 }, 5e6);
        for f_hz in [-1.9e6, -0.4e6, 0.0, 1e6, 2.4e6] {
            let s = Complex::new(0.0, f_hz / 1e6);
            let turn = Complex::new(0.0, std::f64::consts::SQRT_2 * s.im).exp();
            let expected = turn / (1.0 + std::f64::consts::SQRT_2 * s + s * s);
            assert!((found.gain(f_hz) - expected).norm() < 1e-12, "{f_hz}: {expected}");
        }
    }
}
