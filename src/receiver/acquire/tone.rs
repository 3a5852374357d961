//! Continuous waves among the samples of a search, and how they are taken out.
//!
//! A C/A code is a comb of lines 1 kHz apart, the largest 21.3 dB below the whole (PRN 24). Where a wave
//! meets one, every code phase of that Doppler shows it: one of J/N0 54 dB-Hz passes for a satellite of 33. A
//! short look at the spectrum costs a thousandth of a search. What rises above it by [`STRONG_HZ`] is
//! subtracted, with the amplitude and phase that it has in each quarter of a millisecond: a notch some
//! kilohertz wide. Weaker waves are left to the threshold ([`super::multiple_access`]). Satellites' own lines
//! are no stronger than that below 71 dB-Hz. Limits: pulses shorter than the look's segments, sweeps, and
//! modulation beyond some kilohertz are no lines.

use std::f64::consts::TAU;

use fft::Planner;
use num_complex::Complex;

use super::window::Window;
use crate::interference::hann_peak;

/// Power over noise density from which a wave is taken out: 50 dB-Hz.
const STRONG_HZ: f64 = 1e5;
/// Number of segments of the look, spread over the window.
const SEGMENTS: usize = 4;
/// Largest number of samples in a segment.
const SEGMENT: usize = 4096;
/// Number of bins on either side whose median is the density.
const BESIDE: usize = 32;
/// Number of bins between those and the tested one: a Hann window's lobe and more.
const GUARD: usize = 8;
/// Noise bandwidth of a Hann window in bins.
const HANN_BINS: f64 = 1.5;
/// Number of waves that are removed at a time.
const AT_ONCE: usize = 8;
/// Number of looks.
const LOOKS: usize = 4;
/// Time over which a wave keeps amplitude and phase.
const BLOCK_S: f64 = 2.5e-4;

/// Subtracts strong continuous waves from the window and returns how many there were.
pub(super) fn remove(window: &mut Window, rate_hz: f64, complex: bool) -> usize {
    let mut removed = 0;
    for _ in 0..LOOKS {
        let found = lines(window, rate_hz, complex);
        for cycles in &found {
            subtract(window, *cycles, rate_hz, complex);
        }
        removed += found.len();
        if found.is_empty() {
            break;
        }
    }
    removed
}

/// Frequencies of the strongest lines, in cycles a sample.
fn lines(window: &Window, rate_hz: f64, complex: bool) -> Vec<f64> {
    let samples = window.i.len();
    let bins = SEGMENT.min((samples + 1).next_power_of_two() / 2);
    if bins < 4 * (BESIDE + GUARD) {
        return Vec::new();
    }
    let powers = spectrum(window, bins);
    let tested = if complex { bins } else { bins / 2 };
    let at = |n: usize| powers[n % bins];
    let mut highest: Vec<usize> = (0..tested).filter(|&n| at(n) > at(n + bins - 1) && at(n) >= at(n + 1)).collect();
    highest.sort_by(|a, b| at(*b).total_cmp(&at(*a)));
    let ratio = STRONG_HZ / (HANN_BINS * rate_hz / bins as f64);
    let density = |n: usize| {
        let side = |first: usize| {
            let mut beside: Vec<f64> = (first..first + BESIDE).map(at).collect();
            beside.sort_by(f64::total_cmp);
            beside[BESIDE / 2]
        };
        side(n + GUARD).max(side(n + bins - GUARD - BESIDE))
    };
    let strong = highest.into_iter().take(4 * AT_ONCE).filter(|&n| at(n) > ratio * density(n));
    let place = |n: usize| n as f64 + hann_peak(at(n + bins - 1), at(n), at(n + 1));
    strong.take(AT_ONCE).map(|n| place(n) / bins as f64).collect()
}

/// Powers of the segments together, by a Hann window.
fn spectrum(window: &Window, bins: usize) -> Vec<f64> {
    let fft = Planner::<f32>::new().plan_fft_forward(bins);
    let mut powers = vec![0.0; bins];
    let last = window.i.len() - bins;
    for segment in 0..SEGMENTS {
        let first = last * segment / (SEGMENTS - 1);
        let samples = window.i.iter().zip(&window.q).skip(first);
        let mut buffer: Vec<Complex<f32>> = (0..bins)
            .zip(samples)
            .map(|(n, (i, q))| {
                let hann = 0.5 - 0.5 * libm::cos(TAU * n as f64 / bins as f64);
                Complex::new(*i, *q) * hann as f32
            })
            .collect();
        fft.process(&mut buffer);
        powers.iter_mut().zip(&buffer).for_each(|(power, x)| *power += f64::from(x.norm_sqr()));
    }
    powers
}

/// Subtracts a wave block by block, its frequency refined by how its phase advances from block to block.
fn subtract(window: &mut Window, cycles: f64, rate_hz: f64, complex: bool) {
    let block = ((BLOCK_S * rate_hz) as usize).max(16);
    let amplitudes = amplitudes(window, cycles, block);
    let advance: Complex<f64> = amplitudes.windows(2).map(|pair| pair[1] * pair[0].conj()).sum();
    let refined = cycles + libm::atan2(advance.im, advance.re) / (TAU * block as f64);
    let amplitudes = self::amplitudes(window, refined, block);
    let blocks = window.i.chunks_mut(block).zip(window.q.chunks_mut(block));
    for (number, ((i, q), amplitude)) in blocks.zip(amplitudes).enumerate() {
        let (mut wave, step) = (phasor(refined, number * block) * amplitude, phasor(refined, 1));
        for (i, q) in i.iter_mut().zip(q) {
            if complex {
                *i -= wave.re as f32;
                *q -= wave.im as f32;
            } else {
                *i -= 2.0 * wave.re as f32;
            }
            wave *= step;
        }
    }
}

/// Mean of every block with the wave turned back.
fn amplitudes(window: &Window, cycles: f64, block: usize) -> Vec<Complex<f64>> {
    let step = phasor(-cycles, 1);
    let of = |(number, (i, q)): (usize, (&[f32], &[f32]))| {
        let mut turn = phasor(-cycles, number * block);
        let mut sum = Complex::default();
        for (i, q) in i.iter().zip(q) {
            sum += Complex::new(f64::from(*i), f64::from(*q)) * turn;
            turn *= step;
        }
        sum / i.len().max(1) as f64
    };
    window.i.chunks(block).zip(window.q.chunks(block)).enumerate().map(of).collect()
}

fn phasor(cycles: f64, sample: usize) -> Complex<f64> {
    let turns = cycles * sample as f64;
    let (sin, cos) = libm::sincos(TAU * (turns - turns.floor()));
    Complex::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A window of noise (unit power) and waves, each with its frequency in cycles a sample and its power
    /// over the noise's.
    fn window(waves: &[(f64, f64)], complex: bool) -> Window {
        let mut state = 9_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        let mut gauss = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let (mut i, mut q) = (Vec::new(), Vec::new());
        for n in 0..60_000 {
            let (mut a, mut b) =
                if complex { (gauss() * 0.5_f64.sqrt(), gauss() * 0.5_f64.sqrt()) } else { (gauss(), 0.0) };
            for &(cycles, power) in waves {
                let wave = phasor(cycles, n) * (if complex { power } else { 4.0 * power }).sqrt();
                a += wave.re;
                b += if complex { wave.im } else { 0.0 };
            }
            i.push(a as f32);
            q.push(b as f32);
        }
        Window { first: 0, i, q }
    }

    #[test]
    fn strong_waves_are_taken_out_and_noise_is_left() {
        for complex in [true, false] {
            // J/N0 of 54, 84 and 94 dB-Hz at 2.6 Msps.
            for power in [0.1, 100.0, 1e3] {
                let waves = [(0.123_456_7, power), (0.3777, 0.5 * power)];
                let mut window = window(&waves, complex);
                assert!(remove(&mut window, 2.6e6, complex) >= 2, "{complex} {power}");
                let mean = window.power() / 60_000.0;
                // A deviation of the noise's own power is 1/√60000 (√2 of that for real samples), the notches
                // take 0.4 %, and each wave disturbs the other's estimate by 1/(π × 650 samples × 0.25
                // cycles): 0.6 % at the highest power.
                assert!((mean - 1.0).abs() < 0.03, "{complex} {power}: {mean}");
                assert_eq!(lines(&window, 2.6e6, complex).len(), 0, "{complex} {power}");
            }
        }
    }

    #[test]
    fn noise_and_weak_waves_are_left_alone() {
        for complex in [true, false] {
            let mut quiet = window(&[(0.2, 0.01)], complex);
            let before = quiet.i.clone();
            assert_eq!(remove(&mut quiet, 2.6e6, complex), 0);
            assert!(quiet.i == before);
        }
    }
}
