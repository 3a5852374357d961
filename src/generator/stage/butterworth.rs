//! Butterworth filter with the analogue filter's response, amplitude and phase, within the samples' band.
//!
//! The taps are the inverse Fourier transform of the analogue response over the samples' band, under a Kaiser
//! window (Kaiser 1974) as far as they differ from the analogue impulse response: what lies beyond half the
//! sample rate does not fold into the band. A part of a sample of delay lets the phases of both ends of the
//! band meet. Limits: the gain is within 0.0015 of the analogue one, of 1 in the middle, up to a fiftieth of
//! the rate from the ends of the samples' band; at the ends the window rounds its corner. Where the filter is
//! not about the middle of that band, its gains at both ends differ, and the last fiftieth leads from one to
//! the other. Taps below −100 dB are left out.

use std::f64::consts::{PI, TAU};

use gnss::signal::phasor;
use num_complex::Complex64;

use crate::low_pass::kaiser;

/// Truncation level of an endless response, relative to its largest value.
const CUT: f64 = 1e-5;
/// Half width of the window in samples, and its shape: 60 dB, led through in 0.03 of the sample rate.
const REACH: usize = 64;
const BETA: f64 = 5.65;

/// The low-pass prototype, by its poles in radians per sample.
pub(super) struct Analogue {
    poles: Vec<Complex64>,
    residues: Vec<Complex64>,
    omega: f64,
}

impl Analogue {
    /// Computes the prototype with half power at ±`width`/2 cycles per sample.
    pub(super) fn new(order: u32, width: f64) -> Self {
        let omega = PI * width;
        let poles: Vec<Complex64> = (0..order)
            .map(|k| PI * f64::from(2 * k + order + 1) / f64::from(2 * order))
            .map(|angle| Complex64::new(omega * libm::cos(angle), omega * libm::sin(angle)))
            .collect();
        let residue = |(k, pole): (usize, &Complex64)| {
            let others = poles.iter().enumerate().filter(|(j, _)| *j != k);
            others.fold(Complex64::new(omega, 0.0), |product, (_, other)| product * omega / (pole - other))
        };
        let residues = poles.iter().enumerate().map(residue).collect();
        Self { poles, residues, omega }
    }

    /// Samples until its slowest pole has died out.
    pub(super) fn length(&self) -> usize {
        let slowest = self.poles.iter().fold(f64::MAX, |least, pole| least.min(-pole.re));
        (-libm::log(CUT) / slowest).ceil() as usize + 1
    }

    /// Gain at `cycles` a sample: Π ω/(s − p).
    fn gain(&self, cycles: f64) -> Complex64 {
        let at = Complex64::new(0.0, TAU * cycles);
        self.poles.iter().fold(Complex64::ONE, |product, pole| product * self.omega / (at - pole))
    }

    /// Group delay at zero frequency in samples: Σ Re(−1/p).
    fn delay(&self) -> f64 {
        self.poles.iter().fold(0.0, |sum, pole| sum - pole.re) / (self.omega * self.omega)
    }

    /// Impulse response at `t` samples.
    fn at(&self, t: f64) -> f64 {
        if t <= 0.0 {
            return 0.0;
        }
        self.poles.iter().zip(&self.residues).fold(0.0, |sum, (pole, residue)| {
            let (sin, cos) = libm::sincos(pole.im * t);
            sum + (residue * Complex64::new(cos, sin) * libm::exp(pole.re * t)).re
        })
    }
}

/// The taps of the filter about `middle` cycles per sample, of a real one about both signs of it, and its
/// delay in samples in the middle of its band.
pub(super) fn taps(filter: &Analogue, middle: f64, real: bool) -> (Vec<Complex64>, f64) {
    // The carrier in the middle of the band is delayed as its envelope is.
    let turn = phasor(-TAU * middle * filter.delay());
    let carried = |upper: Complex64, lower: Complex64| {
        let upper = upper * turn;
        if real { upper + lower * turn.conj() } else { upper }
    };
    let gain = |cycles: f64| carried(filter.gain(cycles - middle), filter.gain(cycles + middle));
    let at = |t: f64| {
        let (envelope, carrier) = (filter.at(t), phasor(TAU * middle * t));
        carried(carrier * envelope, carrier.conj() * envelope)
    };
    let part = ((gain(0.5) * gain(-0.5).conj()).arg() / TAU).rem_euclid(1.0);
    let length = filter.length().max(REACH);
    // Midpoints so dense that the response has died out before its repetition begins.
    let points = (2 * (length + REACH)).next_power_of_two().max(2048);
    let cycles = |k: usize| (k as f64 + 0.5) / points as f64 - 0.5;
    let gains: Vec<Complex64> = (0..points).map(|k| gain(cycles(k))).collect();
    let within_band = |t: f64| {
        let lines = gains.iter().enumerate();
        lines.fold(Complex64::ZERO, |sum, (k, gain)| sum + gain * phasor(TAU * cycles(k) * t)) / points as f64
    };
    let mut taps: Vec<Complex64> = (0..=REACH + length)
        .map(|k| {
            let t = k as f64 - REACH as f64 - part;
            if t.abs() >= REACH as f64 {
                return at(t);
            }
            let window = kaiser(t / REACH as f64, BETA);
            window * within_band(t) + (1.0 - window) * at(t)
        })
        .collect();
    let most = taps.iter().fold(0.0, |most: f64, tap| most.max(tap.norm()));
    let counts = |tap: &Complex64| tap.norm() > CUT * most;
    taps.truncate(taps.iter().rposition(counts).map_or(0, |last| last + 1));
    let first = taps.iter().position(counts).unwrap_or(0);
    taps.drain(..first);
    (taps, REACH as f64 - first as f64 + part + filter.delay())
}

#[cfg(test)]
mod tests {
    use crate::stage::filter::{Filter, Shape};
    use num_complex::Complex64;
    use std::f64::consts::TAU;

    /// Order, bandwidth, rate and middle in MHz, and gains by frequency.
    type Case = (u32, [f64; 3], &'static [(f64, f64, f64)]);

    /// Made by SciPy 1.14.1: `b, a = signal.butter(order, π·bandwidth, analog=True)`, `signal.freqs(b, a)` at
    /// the frequency less the middle, times e^(jωτ) with the group delay τ at zero frequency.
    const ANALOGUE: [Case; 6] = [
        (
            4,
            [8.0, 12.0, 0.0],
            &[
                (1.0, 0.999_975, -0.005_870),
                (3.0, 0.929_443, -0.212_446),
                (4.0, 0.610_644, -0.356_530),
                (4.5, 0.428_482, -0.311_201),
                (5.0, 0.302_754, -0.228_054),
                (5.5, 0.224_162, -0.149_456),
                (-5.0, 0.302_754, 0.228_054),
            ],
        ),
        (1, [8.0, 12.0, 0.0], &[(2.0, 0.893_836, 0.032_507), (4.0, 0.690_887, 0.150_584), (5.5, 0.533_890, 0.246_794)]),
        (
            2,
            [2.0, 4.0, 0.0],
            &[
                (0.5, 0.968_985, -0.047_385),
                (1.0, 0.698_456, -0.110_269),
                (1.5, 0.406_072, 0.007_327),
                (1.9, 0.251_194, 0.090_371),
            ],
        ),
        (
            8,
            [20.0, 25.0, 0.0],
            &[
                (8.0, 0.887_408, -0.430_268),
                (10.0, 0.284_090, -0.647_528),
                (11.0, 0.037_793, -0.421_074),
                (12.0, -0.008_217, -0.226_374),
            ],
        ),
        (
            3,
            [2.5, 10.0, 1.1],
            &[
                (0.2, 0.924_100, 0.154_141),
                (1.1, 1.0, 0.0),
                (2.35, 0.662_722, -0.246_575),
                (3.6, 0.116_965, 0.041_278),
                (-1.4, 0.116_965, -0.041_278),
            ],
        ),
        (4, [4.9, 5.2, 0.0], &[(2.45, 0.610_644, -0.356_530)]),
    ];

    #[test]
    fn gains_are_the_analogue_filter_s_however_near_its_edge_is_to_the_band_s() {
        for (order, mhz, gains) in ANALOGUE {
            let [bandwidth_hz, rate_hz, middle_hz] = mhz.map(|mhz| 1e6 * mhz);
            let filter = Filter::new(Shape::Butterworth { order }, bandwidth_hz, rate_hz, middle_hz, false).unwrap();
            for (mhz, re, im) in gains {
                let hz = 1e6 * mhz;
                let found = filter.response(hz / rate_hz) * Complex64::cis(TAU * hz * filter.group_delay_s);
                // 0.02 dB are 0.0023; the least gain here is 0.12.
                let off = (found - Complex64::new(*re, *im)).norm();
                println!("{order} {mhz}: {found} {off}");
                assert!(off < 1.5e-3, "order {order}, {mhz} MHz of {rate_hz}: {found} where {re} {im}");
            }
        }
    }

    #[test]
    fn a_real_filter_has_both_sides_of_zero() {
        let filter = Filter::new(Shape::Butterworth { order: 2 }, 3e6, 12e6, 3e6, true).unwrap();
        let low_pass = |mhz: f64| {
            let s = Complex64::new(0.0, mhz / 1.5);
            (1.0 + std::f64::consts::SQRT_2 * s + s * s).inv() * Complex64::cis(std::f64::consts::SQRT_2 * s.im)
        };
        for mhz in [0.5, 1.5, 3.0, 4.5, 5.5] {
            let expected = low_pass(mhz - 3.0) + low_pass(mhz + 3.0);
            for side in [1.0, -1.0] {
                let found =
                    filter.response(side * mhz / 12.0) * Complex64::cis(side * TAU * mhz * 1e6 * filter.group_delay_s);
                assert!((found.re - expected.re).abs() < 1.5e-3 && (found.im - side * expected.im).abs() < 1.5e-3);
            }
        }
    }
}
