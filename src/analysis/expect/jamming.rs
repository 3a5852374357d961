//! The spectra of interference, and what they take from a satellite's C/N0.
//!
//! A periodic waveform has lines at the multiples of its repetition rate, powers |c_k|² of its Fourier
//! series, found here by a transform of one period; noise and random chips have densities. Interference of
//! power J adds J·κ to the noise density, κ = ∫ G_J·G_S df with the code's spectrum G_S (J. W. Betz,
//! NAVIGATION 48(4), 2001). Random chips come through the sampler as a code does. Limits: a code's own lines,
//! 1 kHz apart, are left out of κ (a CW on a line is worth up to 9 dB more or nothing); recordings count as
//! flat.

use std::collections::BTreeMap;

use fft::Planner;
use num_complex::Complex;

use crate::read::Run;
use crate::statistics::mean;
use crate::waveform::{Sampler, Waveform};
use gnss::facts::Interference;
use gnss::signal::sinc_squared;

/// Cycles of a sweep beyond which its lines lie too close to be distinguished from a band.
const MOST_CYCLES: f64 = 131_072.0;

/// A spectrum of unit power about its carrier.
#[derive(Clone, Debug, Default)]
pub struct Spectrum {
    /// Offset and power of each line, upwards.
    pub lines: Vec<(f64, f64)>,
    density: Option<Density>,
}

#[derive(Clone, Copy, Debug)]
enum Density {
    Flat {
        width_hz: f64,
    },
    Chips {
        rate_hz: f64,
    },
    /// Reduction of a pulse train's lines by its jitter.
    Pulses {
        width_s: f64,
        late_s: f64,
    },
}

impl Spectrum {
    /// Spectrum of a source's shape.
    pub fn of(source: &Interference) -> Self {
        let flat =
            |width_hz: f64| Self { lines: Vec::new(), density: Some(Density::Flat { width_hz: width_hz.abs() }) };
        match *source {
            Interference::Cw => Self { lines: vec![(0.0, 1.0)], density: None },
            Interference::Chirp { width_hz, .. } | Interference::Fmcw { width_hz, .. } => {
                harmonics(source).map_or_else(|| flat(width_hz), Self::of_lines)
            }
            Interference::SineFm { .. } => harmonics(source).map_or_else(Self::default, Self::of_lines),
            Interference::Noise { width_hz } | Interference::Recording { width_hz } => flat(width_hz),
            Interference::Matched { repetition_hz } => {
                Self { lines: Vec::new(), density: Some(Density::Chips { rate_hz: repetition_hz }) }
            }
            Interference::Pulse { repetition_hz, duty, jitter } => Self::pulses(repetition_hz, duty, jitter),
        }
    }

    fn of_lines(lines: Vec<(f64, Complex<f64>)>) -> Self {
        let power = lines.into_iter().map(|(hz, line)| (hz, line.norm_sqr())).filter(|(_, power)| *power > 1e-9);
        Self { lines: power.collect(), density: None }
    }

    /// Rectangular pulses, each late by a uniform random share `jitter` of the period.
    fn pulses(repetition_hz: f64, duty: f64, jitter: f64) -> Self {
        let most = (16.0 / duty).min(65_536.0) as i64;
        let line = |k: i64| {
            let x = k as f64;
            (x * repetition_hz, duty * sinc_squared(x * duty) * sinc_squared(x * jitter))
        };
        let pulses = Density::Pulses { width_s: duty / repetition_hz, late_s: jitter / repetition_hz };
        Self { lines: (-most..=most).map(line).collect(), density: (jitter > 0.0).then_some(pulses) }
    }

    /// Density off the lines, per hertz.
    pub fn density(&self, f_hz: f64) -> f64 {
        match self.density {
            None => 0.0,
            Some(Density::Flat { width_hz }) if f_hz.abs() <= 0.5 * width_hz => 1.0 / width_hz,
            Some(Density::Flat { .. }) => 0.0,
            Some(Density::Chips { rate_hz }) => sinc_squared(f_hz / rate_hz) / rate_hz,
            Some(Density::Pulses { width_s, late_s }) => {
                width_s * sinc_squared(f_hz * width_s) * (1.0 - sinc_squared(f_hz * late_s))
            }
        }
    }

    /// Density off the lines in samples, per hertz, `f_hz` from the source's own frequency: chips have the
    /// edges of the satellites', and what lies beyond the samples' band folds back.
    fn sampled(&self, sampler: &Sampler, f_hz: f64) -> f64 {
        let Some(Density::Chips { .. }) = self.density else { return self.density(f_hz) };
        let rate_hz = sampler.rate_hz();
        let within_hz = f_hz - rate_hz * (f_hz / rate_hz).round();
        let met = |alias: i32| {
            let hz = within_hz + f64::from(alias) * rate_hz;
            let amplitude = sampler.amplitude(hz);
            self.density(hz) * amplitude * amplitude
        };
        sampler.aliases().map(met).sum()
    }
}

/// Amplitudes of a sweep's lines at unit power by their frequencies from its middle, upwards; `None` for
/// sources without and for those whose lines lie too close.
pub fn harmonics(source: &Interference) -> Option<Vec<(f64, Complex<f64>)>> {
    match *source {
        Interference::Chirp { width_hz, repetition_hz } => {
            let reach = width_hz.abs() / repetition_hz;
            (reach <= MOST_CYCLES).then(|| series(repetition_hz, reach, |x| reach * 0.5 * x * (x - 1.0)))
        }
        Interference::Fmcw { width_hz, repetition_hz } => {
            let reach = width_hz.abs() / repetition_hz;
            let cycles = |x: f64| {
                let (y, sign) = if x < 0.5 { (2.0 * x, 0.5) } else { (2.0 * x - 1.0, -0.5) };
                sign * reach * 0.5 * y * (y - 1.0)
            };
            (reach <= MOST_CYCLES).then(|| series(repetition_hz, reach, cycles))
        }
        Interference::SineFm { deviation_hz, repetition_hz } => {
            let index = deviation_hz / repetition_hz;
            let cycles = index / std::f64::consts::TAU;
            Some(series(repetition_hz, 2.0 * index, |x| cycles * libm::sin(std::f64::consts::TAU * x)))
        }
        _ => None,
    }
}

/// The unit number of a phase in cycles.
pub(super) fn turned(cycles: f64) -> Complex<f64> {
    let (sin, cos) = libm::sincos(std::f64::consts::TAU * cycles);
    Complex::new(cos, sin)
}

/// Lines of a carrier of unit power whose phase over a period is `cycles`.
fn series(repetition_hz: f64, reach: f64, cycles: impl Fn(f64) -> f64) -> Vec<(f64, Complex<f64>)> {
    // Lines beyond the reach fall with the square of their number or faster: eight times it leaves 1e-3 of
    // the power.
    let points = ((8.0 * reach) as usize + 512).next_power_of_two();
    let mut wave: Vec<Complex<f64>> =
        (0..points).map(|k| turned(cycles(k as f64 / points as f64)) / points as f64).collect();
    Planner::<f64>::new().plan_fft_forward(points).process(&mut wave);
    wave.rotate_left(points / 2);
    (-(points as i64) / 2..).zip(wave).map(|(k, line)| (k as f64 * repetition_hz, line)).collect()
}

/// Interference of a run on average, in the samples.
#[derive(Clone, Debug)]
pub struct Source {
    /// Shape of the spectrum at unit power.
    pub spectrum: Spectrum,
    /// Mean frequency in the samples, Hz.
    pub frequency_hz: f64,
    /// Mean over the whole run, silence counted.
    pub jn0_hz: f64,
}

/// The sources of a run by their numbers.
pub fn sources(run: &Run) -> BTreeMap<usize, Source> {
    let ticks = run.trajectory.len().max(1) as f64;
    let one = |(number, shape): (usize, &Interference)| {
        let rows = || run.interference.iter().filter(move |row| row.source == number);
        let frequency_hz = mean(&rows().map(|row| row.frequency_hz).collect::<Vec<_>>())?;
        let jn0_hz = rows().map(|row| libm::pow(10.0, row.jn0_dbhz / 10.0)).sum::<f64>() / ticks;
        Some((number, Source { spectrum: Spectrum::of(shape), frequency_hz, jn0_hz }))
    };
    (1..).zip(&run.scene.interference).filter_map(one).collect()
}

/// κ of a source against a signal at `signal_hz` in the samples, in seconds.
pub fn separation_s(source: &Source, signal: &Waveform, signal_hz: f64, sampler: &Sampler) -> f64 {
    let rate_hz = sampler.rate_hz();
    let code = |f_hz: f64| signal.sampled(sampler, f_hz - signal_hz);
    // The band in 4000 pieces, each looked at in its middle.
    let step_hz = rate_hz / 4000.0;
    let middles = (-2000..2000).map(|k| (f64::from(k) + 0.5) * step_hz);
    let (mut power, mut shared) = (0.0, 0.0);
    for f_hz in middles {
        power += step_hz * code(f_hz);
        shared += step_hz * code(f_hz) * source.spectrum.sampled(sampler, f_hz - source.frequency_hz);
    }
    let inside = |f_hz: &f64| f_hz.abs() <= 0.5 * rate_hz;
    let lines = source.spectrum.lines.iter().map(|(offset_hz, power)| (source.frequency_hz + offset_hz, *power));
    shared += lines.filter(|(f_hz, _)| inside(f_hz)).map(|(f_hz, line)| line * code(f_hz)).sum::<f64>();
    shared / power
}

/// Density of the interference at a frequency of the samples as a Hann window of bins `bin_hz` apart shows
/// it, over N0.
pub fn density(source: &Source, f_hz: f64, bin_hz: f64, sampler: &Sampler) -> f64 {
    let from_hz = f_hz - source.frequency_hz;
    // Lines as far as eight bins; the window's side lobes are 100 dB down there.
    let first = source.spectrum.lines.partition_point(|(line_hz, _)| *line_hz < from_hz - 8.0 * bin_hz);
    let lines = source.spectrum.lines.get(first..).unwrap_or_default().iter();
    let near = lines.take_while(|(line_hz, _)| *line_hz < from_hz + 8.0 * bin_hz);
    let lines: f64 = near.map(|(line_hz, power)| power * hann((from_hz - line_hz) / bin_hz) / bin_hz).sum();
    source.jn0_hz * (lines + source.spectrum.sampled(sampler, from_hz))
}

/// A line's share of density times bin width, `x` bins from it, after a Hann window: its transform squared
/// over its power.
pub(super) fn hann(x: f64) -> f64 {
    let edge = 1.0 - x * x;
    // At one bin sinc(x)/(1 − x²) is 1/2.
    let response = if edge.abs() < 1e-6 { 0.25 } else { sinc_squared(x) / (edge * edge) };
    response / 1.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waveform::Edge;
    use gnss::gps::l1ca::L1_CA;

    /// Separation from C/A at the carrier, wide sampling, in dB of seconds.
    fn separation_db(shape: &Interference, frequency_hz: f64) -> f64 {
        let source = Source { spectrum: Spectrum::of(shape), frequency_hz, jn0_hz: 1.0 };
        10.0 * libm::log10(separation_s(
            &source,
            &Waveform::of(&L1_CA).unwrap(),
            0.0,
            &Sampler::new(Edge::Nearest, 60e6),
        ))
    }

    #[test]
    fn separations_are_the_published_ones() {
        // Computed outside this project from the same integral, for smooth spectra; printed to 0.01 dB.
        let noise = |width_hz: f64| Interference::Noise { width_hz };
        let chirp = |width_hz: f64| Interference::Chirp { width_hz, repetition_hz: 1e5 };
        let cases = [
            (Interference::Cw, 0.0, -60.1),
            (Interference::Matched { repetition_hz: 1.023e6 }, 0.0, -61.86),
            (noise(2.046e6), 0.0, -63.55),
            (noise(4.092e6), 0.0, -66.34),
            (noise(20.46e6), 0.0, -73.15),
            (chirp(10e6), 0.0, -70.09),
            (chirp(20e6), 0.0, -73.05),
        ];
        for (shape, frequency_hz, expected) in cases {
            let found = separation_db(&shape, frequency_hz);
            // Lines of the chirps 100 kHz apart: Fresnel ripple of a tenth of a decibel.
            assert!((found - expected).abs() < 0.1, "{shape:?}: {found} {expected}");
        }
        // Q = 2.36 at half a megahertz.
        let half = separation_db(&Interference::Cw, 0.5e6);
        assert!((half + 60.1 + 10.0 * libm::log10(2.36)).abs() < 0.05, "{half}");
    }

    #[test]
    fn spectra_of_unit_power_keep_it() {
        let fm = Interference::SineFm { deviation_hz: 5e4, repetition_hz: 1e4 };
        let chirp = Interference::Chirp { width_hz: 1e6, repetition_hz: 1e4 };
        let pulse = Interference::Pulse { repetition_hz: 1e3, duty: 0.1, jitter: 0.0 };
        for shape in [fm, chirp, pulse] {
            let power: f64 = Spectrum::of(&shape).lines.iter().map(|line| line.1).sum();
            // A pulse's lines beyond the 160th hold 1/(π²·16) of the power or 0.6 %.
            assert!((power - 1.0).abs() < 0.007, "{shape:?}: {power}");
        }
        let jittered = Interference::Pulse { repetition_hz: 1e3, duty: 0.1, jitter: 0.5 };
        let spectrum = Spectrum::of(&jittered);
        let lines: f64 = spectrum.lines.iter().map(|line| line.1).sum();
        let rest: f64 = (-200_000..200_000).map(|k| spectrum.density(f64::from(k)) * 1.0).sum();
        assert!((lines + rest - 1.0).abs() < 0.007, "{lines} {rest}");
    }
}
