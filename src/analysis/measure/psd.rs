//! Power spectral density of the samples by Welch's method.
//!
//! Hann window, half overlap, periodograms averaged in f64 (Welch 1967).
//! [`crate::expect::spectrum`] says what is expected of it.

use std::sync::Arc;

use fft::{Fft, Planner};
use num_complex::Complex;

use crate::read::PsdRow;

/// A spectrum being accumulated from blocks of planar samples.
pub struct Psd {
    rate_hz: f64,
    one_sided: bool,
    fft: Arc<dyn Fft<f32>>,
    scratch: Vec<Complex<f32>>,
    work: Vec<Complex<f32>>,
    window: Vec<f32>,
    /// Samples that the next segment starts with.
    kept: Vec<Complex<f32>>,
    sum: Vec<f64>,
    segments: u64,
}

impl Psd {
    /// A spectrum of `bins` frequencies (at least 8, made even) of samples at `rate_hz`; `one_sided` for real
    /// samples.
    pub fn new(rate_hz: f64, one_sided: bool, bins: usize) -> Self {
        let bins = bins.max(8).next_multiple_of(2);
        let fft = Planner::<f32>::new().plan_fft_forward(bins);
        let angle = |n: usize| std::f64::consts::TAU * n as f64 / bins as f64;
        Self {
            rate_hz,
            one_sided,
            scratch: vec![Complex::default(); fft.get_inplace_scratch_len()],
            fft,
            work: vec![Complex::default(); bins],
            // Periodic Hann window.
            window: (0..bins).map(|n| (0.5 - 0.5 * libm::cos(angle(n))) as f32).collect(),
            kept: Vec::with_capacity(bins),
            sum: vec![0.0; bins],
            segments: 0,
        }
    }

    /// Takes the next samples; blocks of any length are one stream. `q` may be empty for real samples.
    pub fn add(&mut self, i: &[f32], q: &[f32]) {
        let bins = self.window.len();
        let quadrature = q.iter().copied().chain(std::iter::repeat(0.0));
        for (&i, q) in i.iter().zip(quadrature) {
            self.kept.push(Complex::new(i, q));
            if self.kept.len() == bins {
                self.segment();
                self.kept.drain(..bins / 2);
            }
        }
    }

    /// Says that the next samples do not follow on the last ones.
    pub fn cut(&mut self) {
        self.kept.clear();
    }

    fn segment(&mut self) {
        for ((work, sample), window) in self.work.iter_mut().zip(&self.kept).zip(&self.window) {
            *work = sample * window;
        }
        self.fft.process_with_scratch(&mut self.work, &mut self.scratch);
        for (sum, bin) in self.sum.iter_mut().zip(&self.work) {
            *sum += f64::from(bin.norm_sqr());
        }
        self.segments += 1;
    }

    /// Density against frequency, ascending, in LSB²/Hz: its integral is the mean power. `None` before the
    /// first whole segment.
    pub fn density(&self) -> Option<Vec<(f64, f64)>> {
        if self.segments == 0 {
            return None;
        }
        let bins = self.sum.len();
        let window_power: f64 = self.window.iter().map(|w| f64::from(*w) * f64::from(*w)).sum();
        let scale = 1.0 / (self.segments as f64 * window_power * self.rate_hz);
        let at = |offset: i64| {
            let power = self.sum.get(offset.rem_euclid(bins as i64) as usize).copied().unwrap_or(0.0);
            (offset as f64 * self.rate_hz / bins as f64, power * scale)
        };
        let half = bins as i64 / 2;
        Some(if self.one_sided {
            let folded = |offset: i64| if offset == 0 || offset == half { 1.0 } else { 2.0 };
            (0..=half).map(|offset| (at(offset).0, at(offset).1 * folded(offset))).collect()
        } else {
            (-half..half).map(at).collect()
        })
    }

    /// Density in decibels of LSB²/Hz: the rows of `psd.csv`. `None` before the first whole segment.
    pub fn rows(&self) -> Option<Vec<PsdRow>> {
        let row = |(frequency_hz, density)| PsdRow { frequency_hz, density_db: decibels(density) };
        Some(self.density()?.into_iter().map(row).collect())
    }
}

/// 10 log10, with silence at −300 dB.
fn decibels(power: f64) -> f64 {
    10.0 * libm::log10(power.max(1e-30))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform noise of unit variance, from a 64-bit congruential generator (Knuth's multiplier).
    fn noise(count: usize) -> Vec<f32> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f64 / f64::from(1 << 24) - 0.5) * 12.0_f64.sqrt()
        };
        (0..count).map(|_| next() as f32).collect()
    }

    #[test]
    fn white_noise_has_its_power_over_its_band() {
        let samples = noise(1 << 20);
        let (i, q) = samples.split_at(1 << 19);
        for (one_sided, expected_db) in [(false, decibels(2.0 / 4e6)), (true, decibels(2.0 / 4e6))] {
            let mut psd = Psd::new(4e6, one_sided, 1024);
            // Chunks of an odd length: the stream must not notice.
            for (i, q) in i.chunks(777).zip(q.chunks(777)) {
                psd.add(i, if one_sided { &[] } else { q });
            }
            let density = psd.density().unwrap();
            let level = density.iter().map(|(_, d)| d).sum::<f64>() / density.len() as f64;
            // The power of 2^19 samples is known to 1/sqrt(2^19) of itself: 0.006 dB.
            assert!((decibels(level) - expected_db).abs() < 0.03, "{one_sided} {}", decibels(level));
        }
    }

    #[test]
    fn a_tone_has_its_power_at_its_frequency() {
        let rate_hz = 2.6e6;
        let tone_hz = -300_100.0;
        let phase = |n: usize| std::f64::consts::TAU * (tone_hz * n as f64 / rate_hz).fract();
        let i: Vec<f32> = (0..100_000).map(|n| 3.0 * libm::cos(phase(n)) as f32).collect();
        let q: Vec<f32> = (0..100_000).map(|n| 3.0 * libm::sin(phase(n)) as f32).collect();
        let mut psd = Psd::new(rate_hz, false, 2048);
        psd.add(&i, &q);
        let density = psd.density().unwrap();
        let step_hz = rate_hz / 2048.0;
        let power: f64 =
            density.iter().filter(|(f, _)| (f - tone_hz).abs() < 6.0 * step_hz).map(|(_, d)| d * step_hz).sum();
        assert!((decibels(power) - decibels(9.0)).abs() < 0.1, "{}", decibels(power));
        let peak = density.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((peak.0 - tone_hz).abs() < step_hz);
    }

    #[test]
    fn too_few_samples_have_no_spectrum() {
        let mut psd = Psd::new(1e6, false, 64);
        psd.add(&[0.0; 63], &[0.0; 63]);
        assert!(psd.density().is_none());
    }
}
