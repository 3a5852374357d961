//! Power spectral density of the samples by Welch's method, and the spectra of codes.
//!
//! Hann window, half overlap, periodograms averaged in f64 (Welch 1967). A code's spectrum is that of its chips,
//! sinc²(f/R_c)/R_c, summed over its aliases; [`super::spectrum`] builds what is expected of the samples from it.
//! The lines 1 kHz apart of a repeating code and the data are below the resolution and left out.

use std::path::Path;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::analysis::JudgeError;
use crate::analysis::errors::Link;
use crate::analysis::load::PsdRow;
use crate::analysis::shelf::Shelf;
use crate::analysis::statistics::mean;
use crate::gnss::record::Observation;
use crate::gnss::satellite::Sv;

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
    /// A spectrum of `bins` frequencies (at least 8, made even) of samples at `rate_hz`; `one_sided` for real samples.
    pub fn new(rate_hz: f64, one_sided: bool, bins: usize) -> Self {
        let bins = bins.max(8).next_multiple_of(2);
        let fft = FftPlanner::new().plan_fft_forward(bins);
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

    /// Writes `psd.csv`; nothing before the first whole segment.
    pub fn write(&self, path: &Path) -> Result<(), JudgeError> {
        let Some(density) = self.density() else { return Ok(()) };
        let mut writer = csv::Writer::from_writer(Vec::new());
        let row_error = |source| JudgeError::Row { path: path.to_owned(), source };
        for (frequency_hz, density) in density {
            writer.serialize(PsdRow { frequency_hz, density_db: decibels(density) }).map_err(row_error)?;
        }
        let bytes = writer
            .into_inner()
            .map_err(|error| JudgeError::File { path: path.to_owned(), source: error.into_error() })?;
        super::write_whole(path, &bytes)
    }
}

/// 10 log10, with silence at −300 dB.
fn decibels(power: f64) -> f64 {
    10.0 * libm::log10(power.max(1e-30))
}

/// A satellite's signal on average over the run.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    pub sv: Sv,
    /// Carrier as received, and as sent.
    pub carrier_hz: f64,
    pub nominal_hz: f64,
    pub chip_rate_hz: f64,
    pub cn0_hz: f64,
    pub cn0_mean_dbhz: f64,
}

/// The mean of each satellite's true signal over the run.
pub(super) fn expected(truth: &Shelf<Link, Observation>) -> Result<Vec<Expected>, JudgeError> {
    let mut all = Vec::new();
    for Link { sv, signal } in truth.keys() {
        let rows = truth.rows(Link { sv, signal })?;
        let of = |of: fn(&Observation) -> f64| mean(&rows.iter().map(of).collect::<Vec<_>>());
        let means = (of(|row| row.doppler_hz), of(|row| libm::pow(10.0, row.cn0_dbhz / 10.0)), of(|row| row.cn0_dbhz));
        let ((Some(doppler_hz), Some(cn0_hz), Some(cn0_mean_dbhz)), Some(code)) = (means, signal.components.first())
        else {
            continue;
        };
        all.push(Expected {
            sv,
            carrier_hz: signal.carrier_hz(sv) + doppler_hz,
            nominal_hz: signal.carrier_hz(sv),
            chip_rate_hz: code.chip_rate_hz,
            cn0_hz,
            cn0_mean_dbhz,
        });
    }
    Ok(all)
}

/// Density of a rectangular-chip code at `f_hz` from its carrier as the sampler meets it, before anything
/// aliases, per hertz.
pub(super) fn pulse_density(code_edge: &str, f_hz: f64, chip_rate_hz: f64, rate_hz: f64) -> f64 {
    let chip = sinc_squared(f_hz / chip_rate_hz) / chip_rate_hz;
    match edge(code_edge) {
        Edge::BandLimited if f_hz.abs() > 0.5 * rate_hz => 0.0,
        Edge::BandLimited | Edge::Nearest => chip,
        // A mean over the sample's interval has its own sinc².
        Edge::Area => chip * sinc_squared(f_hz / rate_hz),
    }
}

enum Edge {
    Nearest,
    Area,
    BandLimited,
}

fn edge(code_edge: &str) -> Edge {
    let name: String = code_edge.chars().filter(char::is_ascii_alphabetic).collect();
    match name.to_ascii_lowercase().as_str() {
        "bandlimited" => Edge::BandLimited,
        "area" => Edge::Area,
        _ => Edge::Nearest,
    }
}

/// Density of a unit-power rectangular-chip code, sampled, at `f_hz` from its carrier, per hertz.
pub(super) fn code_density(code_edge: &str, f_hz: f64, chip_rate_hz: f64, rate_hz: f64) -> f64 {
    let density = |f: f64| pulse_density(code_edge, f, chip_rate_hz, rate_hz);
    match edge(code_edge) {
        // Filtered to half the sample rate: no alias but the one that the frequency itself may be.
        Edge::BandLimited => density(f_hz - rate_hz * (f_hz / rate_hz).round()),
        Edge::Area | Edge::Nearest => aliases(density, f_hz, rate_hz),
    }
}

/// Sum over the aliases. The tail after ±50 is below 1 % of a density that is itself 50 dB down.
fn aliases(density: impl Fn(f64) -> f64, f_hz: f64, rate_hz: f64) -> f64 {
    (-50..=50).map(|k| density(f_hz + f64::from(k) * rate_hz)).sum()
}

pub(super) fn sinc_squared(x: f64) -> f64 {
    let angle = std::f64::consts::PI * x;
    if angle.abs() < 1e-9 {
        return 1.0;
    }
    let sinc = libm::sin(angle) / angle;
    sinc * sinc
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
    fn a_sampled_code_keeps_its_power_and_has_its_nulls() {
        for edge in ["nearest", "band_limited"] {
            let rate_hz = 10.0e6;
            let step_hz = 1e3;
            let power: f64 =
                (-5000..5000).map(|k| step_hz * code_density(edge, f64::from(k) * step_hz, 1.023e6, rate_hz)).sum();
            // Outside ±5 MHz lies 1/(pi^2 * 4.9) of the power or 2 %; aliases bring it back.
            let expected = if edge == "nearest" { 1.0 } else { 0.98 };
            assert!((power - expected).abs() < 5e-3, "{edge} {power}");
        }
        assert!(code_density("band_limited", 1.023e6, 1.023e6, 10e6) < 1e-20);
    }

    #[test]
    fn too_few_samples_have_no_spectrum() {
        let mut psd = Psd::new(1e6, false, 64);
        psd.add(&[0.0; 63], &[0.0; 63]);
        assert!(psd.density().is_none());
    }
}
