//! Correlation peaks: what a few milliseconds of the samples hold of each signal, about its true delay.
//!
//! Samples without their carrier are laid over one code period, each as long as a sample is, and summed from
//! edge to edge of the replica: exact for any rate. Each period is turned by the phase of its own prompt, so
//! that data bits and a carrier that accelerates do not cancel the sum (coherent within a period, aligned
//! between them).
//!
//! Limits: one component of a signal, the strongest whose code repeats within 20 ms; no more samples than
//! 200 000, but one period at least. A signal below some 25 dB-Hz is aligned to its noise.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::read::PeakRow;
use gnss::record::Observation;
use gnss::samples::IfMetadata;
use gnss::signal::{Component, Shape, Signal, chip_kinds};

/// Duration of a glimpse of the samples, in seconds.
pub const GLIMPSE_S: f64 = 0.04;
/// Longest period of a code that is looked at, in seconds: a glimpse holds a whole one, wherever it begins.
const LONGEST_S: f64 = 0.5 * GLIMPSE_S;
/// Largest delay in chips, and delays in a chip, at least.
const REACH_CHIPS: f64 = 1.5;
const LEAST_PER_CHIP: usize = 40;
/// Samples of a signal that are looked at: they cost some milliseconds.
const MOST_SAMPLES: f64 = 200_000.0;
/// Part of a chip by which a period may begin before the samples do.
const NEAR_CHIPS: f64 = 1e-3;

/// A few milliseconds of a front end's samples.
#[derive(Clone, Debug)]
pub struct Glimpse {
    /// Rate, centre and form of the samples.
    pub metadata: IfMetadata,
    /// Offset in hertz that the front end adds to every Doppler.
    pub doppler_hz: f64,
    /// Time in seconds from the instant of the truth to that which the first sample shows. The front end
    /// delays its samples, which makes it negative.
    pub later_s: f64,
    /// In-phase samples.
    pub i: Vec<f32>,
    /// Quadrature samples, as many, or none of real samples.
    pub q: Vec<f32>,
}

impl Glimpse {
    /// Peaks of the signals that these observations describe, without those of which no whole code period is
    /// there.
    pub fn peaks(&self, truth: &[Observation]) -> Vec<PeakRow> {
        let all: Vec<Vec<PeakRow>> = truth.par_iter().filter_map(|row| self.peak(row)).collect();
        all.concat()
    }

    fn peak(&self, truth: &Observation) -> Option<Vec<PeakRow>> {
        let component = looked_at(truth.signal)?;
        let code = Replica::new(component, truth.sv.number)?;
        let carrier_hz = truth.signal.carrier_hz(truth.sv);
        let rate_hz = self.metadata.rate.hz();
        let stretch = 1.0 + truth.doppler_hz / carrier_hz;
        let chips_per_sample = component.chip_rate_hz * stretch / rate_hz;

        // Chips of the code at the first sample, and whole periods within the samples.
        let label = truth.signal.time.label(truth.sent().plus_s(self.later_s * stretch));
        let chips = f64::from(component.code_chips);
        let whole = (label.seconds() as f64 * component.chip_rate_hz) % chips;
        let first = (whole + label.fraction() * component.chip_rate_hz).rem_euclid(chips);
        let begins = if first < NEAR_CHIPS { 0.0 } else { chips - first };
        let there = self.i.len() as f64 * chips_per_sample - begins;
        let most = (MOST_SAMPLES * chips_per_sample / chips).max(1.0);
        let periods = ((there + NEAR_CHIPS) / chips).min(most).max(0.0) as usize;

        let cycles = (carrier_hz + truth.doppler_hz + self.doppler_hz - self.metadata.center_hz) / rate_hz;
        let mut laid = Laid::new(&code, chips_per_sample);
        for period in 0..periods {
            let from = begins + period as f64 * chips;
            let at = |chips: f64| ((chips / chips_per_sample).ceil().max(0.0) as usize).min(self.i.len());
            let (start, end) = (at(from), at(from + chips));
            laid.add(&self.turned(start..end, cycles), start as f64 * chips_per_sample - from);
        }
        let (lags, values) = laid.correlations();
        let largest = values.iter().map(|value| value.norm()).fold(0.0, f64::max);
        let row = |(lag, value): (i32, Complex64)| PeakRow {
            sample: truth.sample,
            sv: truth.sv,
            signal: truth.signal,
            delay_chips: f64::from(lag) / code.per_chip as f64,
            in_phase: value.re / largest,
            quadrature: value.im / largest,
        };
        (largest > 0.0).then(|| (-lags..=lags).zip(values).map(row).collect())
    }

    /// Samples after a carrier of so many cycles a sample is removed. Of real ones both sides of the spectrum
    /// stay.
    fn turned(&self, range: std::ops::Range<usize>, cycles: f64) -> Vec<Complex64> {
        let side = if self.metadata.inverted { -1.0 } else { 1.0 };
        let phasor = |cycles: f64| {
            let (sin, cos) = libm::sincos(-std::f64::consts::TAU * cycles.fract());
            Complex64::new(cos, sin)
        };
        // Rounding of the products stays below 1e-10 over half a million samples.
        let (mut carrier, step) = (phasor(cycles * range.start as f64), phasor(cycles));
        let mut turn = |(i, q): (f32, f32)| {
            let value = Complex64::new(f64::from(i), side * f64::from(q)) * carrier;
            carrier *= step;
            value
        };
        let i = self.i.get(range.clone()).unwrap_or(&[]).iter().copied();
        match self.q.get(range) {
            Some(q) => i.zip(q.iter().copied()).map(turn).collect(),
            None => i.map(|i| turn((i, 0.0))).collect(),
        }
    }
}

/// The strongest component whose code is short enough.
fn looked_at(signal: &Signal) -> Option<&'static Component> {
    let short = signal.components.iter().filter(|component| component.period_s() < 1.001 * LONGEST_S);
    short.reduce(|best, next| if next.power_share > best.power_share { next } else { best })
}

/// Correlation of the component that is looked at with itself, of unlimited bandwidth, and the duration of
/// its chips in seconds.
pub fn ideal(signal: &Signal) -> Option<(Shape, f64)> {
    looked_at(signal).map(|component| (component.shape(), 1.0 / component.chip_rate_hz))
}

/// One period of a code as its levels in equal steps, conjugate, and the bins of delay in a step and a chip.
struct Replica {
    levels: Vec<Complex64>,
    per_step: usize,
    per_chip: usize,
}

impl Replica {
    fn new(component: &Component, number: u8) -> Option<Self> {
        let chips = (component.code)(number)?;
        let (kinds, pattern) = chip_kinds(component.layers);
        let wave = |index: usize| &kinds[pattern[index % pattern.len()]];
        let steps = wave(0).len();
        let of = |(index, chip): (usize, i8)| wave(index).iter().map(move |step| step.conj() * f64::from(chip));
        let per_step = LEAST_PER_CHIP.div_ceil(steps);
        let levels = chips.into_iter().enumerate().flat_map(of).collect();
        Some(Self { levels, per_step, per_chip: steps * per_step })
    }

    /// Bins of a period.
    fn bins(&self) -> usize {
        self.levels.len() * self.per_step
    }
}

/// Samples that are laid over one period of a code.
struct Laid<'c> {
    code: &'c Replica,
    bins_per_sample: f64,
    /// Second differences of the integral over the samples, at the edges of bins, beyond the period by as
    /// much as a sample is long.
    bends: Vec<Complex64>,
}

impl<'c> Laid<'c> {
    fn new(code: &'c Replica, chips_per_sample: f64) -> Self {
        let bins_per_sample = chips_per_sample * code.per_chip as f64;
        let bends = vec![Complex64::ZERO; code.bins() + bins_per_sample as usize + 3];
        Self { code, bins_per_sample, bends }
    }

    /// Adds the samples of a period, the first of which is so many chips behind its beginning, turned by the
    /// phase of their prompt.
    fn add(&mut self, samples: &[Complex64], first_chips: f64) {
        let first = first_chips * self.code.per_chip as f64;
        let length = self.bins_per_sample;
        let place = move |n: usize| first + n as f64 * length;
        let per_step = self.code.per_step as f64;
        let levels = &self.code.levels;
        let level = |n: usize| levels[((place(n) / per_step) as usize).min(levels.len() - 1)];
        let prompt: Complex64 = samples.iter().enumerate().map(|(n, sample)| sample * level(n)).sum();
        let turn = prompt.conj() / prompt.norm().max(f64::MIN_POSITIVE);
        // A sample stands for the interval about its instant: its beginning is half a sample earlier.
        let half = planted!("analysis.peaks.half", 0.5, 0.0) * length;
        let bins = self.code.bins() as f64;
        for (n, sample) in samples.iter().enumerate() {
            let (value, begin) = (sample * turn, place(n) - half);
            let begin = if begin < 0.0 { begin + bins } else { begin };
            self.bend(begin, value);
            self.bend(begin + length, -value);
        }
    }

    /// Changes the slope of the integral at a position in bins: exact at all edges of bins.
    fn bend(&mut self, at: f64, value: Complex64) {
        let bin = (at as usize).min(self.bends.len() - 2);
        let later = value * (at - bin as f64);
        self.bends[bin] += value - later;
        self.bends[bin + 1] += later;
    }

    /// Largest delay in bins, and the correlations at all delays from the negative one on.
    fn correlations(self) -> (i32, Vec<Complex64>) {
        let (code, bins) = (self.code, self.code.bins());
        let reach = (REACH_CHIPS * code.per_chip as f64).round() as usize;
        let mut slope = Complex64::ZERO;
        let mut contents = vec![Complex64::ZERO; bins];
        for (bin, bend) in self.bends.into_iter().enumerate() {
            slope += bend;
            contents[bin % bins] += slope;
        }
        // The integral from the largest negative delay on, at the edges of bins.
        let mut sum = Complex64::ZERO;
        let behind = (0..bins + 2 * reach).map(|k| contents[(k + bins * reach - reach) % bins]);
        let integral: Vec<Complex64> = std::iter::once(Complex64::ZERO)
            .chain(behind.map(|content| {
                sum += content;
                sum
            }))
            .collect();
        // Steps of one level have no edge between them.
        let mut runs: Vec<(usize, Complex64)> = Vec::new();
        for (step, level) in code.levels.iter().enumerate() {
            match runs.last_mut() {
                Some((end, last)) if last == level => *end = (step + 1) * code.per_step,
                _ => runs.push(((step + 1) * code.per_step, *level)),
            }
        }
        let correlation = |lag: usize| {
            let lag = planted!("analysis.peaks.delay", lag, 2 * reach - lag);
            let (mut total, mut before) = (Complex64::ZERO, integral[lag]);
            for (end, level) in &runs {
                let after = integral[lag + end];
                total += level * (after - before);
                before = after;
            }
            total
        };
        (reach as i32, (0..=2 * reach).map(correlation).collect())
    }
}

#[cfg(test)]
#[path = "peaks_tests.rs"]
mod tests;
