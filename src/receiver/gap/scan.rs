//! A joint search for all codes at once: by how many samples are they ahead of where they were to be?
//!
//! Each channel's replica runs on as it did before. Its correlation with the samples at all delays, in steps
//! of one sample and summed as power over code periods, peaks at the same delay for all of them. Of long
//! jumps each satellite's Doppler takes its share, which is tried in steps. The sum over channels has a
//! deviation of the root of channels over periods where only noise is.

use std::sync::Arc;

use fft::{Fft, Planner};
use num_complex::Complex;

use crate::correlate::{Nco, Replica, TURN};
use crate::source::Block;

/// Code periods before a decision is tried.
const LEAST_PERIODS: u32 = 20;
/// Largest number of code periods taken from one block.
const PERIODS_A_BLOCK: usize = 20;
/// A peak counts beyond so many deviations; with 1e6 positions, noise has one in 1e7 scans.
const PEAK_SIGMAS: f64 = 8.0;
/// Standard deviations by which a peak has to exceed the value at the expected position.
const LEAD_SIGMAS: f64 = 6.0;
/// Longest jump that is tried, in seconds.
const LONGEST_S: f64 = 1.0;
/// Step between the tried jumps, in seconds: 0.06 chip of Doppler at 5 kHz to either side.
const STEP_S: f64 = 0.04;
/// No jump of whole seconds is taken for what one within a step explains as well as this.
const AS_GOOD: f64 = 0.97;

/// Result of a scan. The codes are ahead by so many samples, modulo a code period, with so many seconds of
/// Doppler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Samples by which codes are ahead.
    pub samples: i64,
    /// Seconds of Doppler in that.
    pub seconds: f64,
}

/// Powers of one channel at all delays.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    powers: Vec<f32>,
    periods: u32,
}

/// Plans for one length of the code.
pub struct Scan {
    length: usize,
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
}

impl Scan {
    /// A scan for codes that repeat every `period_s`.
    pub fn new(period_s: f64, rate_hz: f64) -> Self {
        let length = ((period_s * rate_hz).round() as usize).max(2);
        let mut planner = Planner::<f32>::new();
        Self { length, forward: planner.plan_fft_forward(2 * length), inverse: planner.plan_fft_inverse(2 * length) }
    }

    /// Adds what a block shows of one channel, whose replica and oscillators are `nco` at the block's first
    /// sample.
    pub fn add(&self, block: &Block, replica: &Replica, nco: &Nco, profile: &mut Profile) {
        let nco = &replica.beside_carrier(nco);
        profile.powers.resize(self.length, 0.0);
        let half = (self.length / 2) as i64;
        let mut samples = vec![Complex::new(0.0, 0.0); 2 * self.length];
        let mut codes = samples.clone();
        let pieces = block.i.chunks_exact(self.length).zip(block.q.chunks_exact(self.length));
        for (number, (i, q)) in pieces.take(PERIODS_A_BLOCK).enumerate() {
            let start = (number * self.length) as i64;
            samples.fill(Complex::new(0.0, 0.0));
            let mut carrier = nco.carrier_step.wrapping_mul(start as u64);
            for ((sample, i), q) in samples.iter_mut().zip(i).zip(q) {
                let (sin, cos) = libm::sincosf((carrier as f64 / TURN * std::f64::consts::TAU) as f32);
                // The conjugate: the replica's spectrum is multiplied by it.
                *sample = Complex::new(i * cos + q * sin, i * sin - q * cos);
                carrier = carrier.wrapping_add(nco.carrier_step);
            }
            let step = nco.code_step as i64;
            // Within a period, for four periods of a long code are beyond 64 bits.
            let begin = i128::from(nco.code) + i128::from(start - half) * i128::from(step);
            let period = replica.period();
            let mut phase = begin.rem_euclid(i128::from(period)) as i64;
            for code in &mut codes {
                *code = Complex::new(replica.value(phase, nco.code_step) as f32, 0.0);
                // A step is far below a period.
                phase = if phase >= period - step { phase - (period - step) } else { phase + step };
            }
            self.correlate(&mut samples, &mut codes);
            for (power, x) in profile.powers.iter_mut().zip(&samples) {
                *power += x.norm_sqr();
            }
            profile.periods += 1;
        }
    }

    /// Correlates conjugate samples with codes, in place of the samples: entry j is for delays of j −
    /// length/2.
    fn correlate(&self, samples: &mut [Complex<f32>], codes: &mut [Complex<f32>]) {
        // Of conjugate samples the inverse transform is the spectrum's conjugate.
        self.inverse.process(samples);
        self.forward.process(codes);
        for (sample, code) in samples.iter_mut().zip(codes.iter()) {
            *sample *= code;
        }
        self.inverse.process(samples);
    }

    /// Jump that the profiles show together. Each profile comes with the samples that its code gains by
    /// Doppler in a second. `None` while they show too little.
    pub fn decide(&self, profiles: &[(&Profile, f64)]) -> Option<Found> {
        let periods = profiles.iter().map(|(profile, _)| profile.periods).min()?;
        if periods < LEAST_PERIODS {
            return None;
        }
        let relative: Vec<(Vec<f64>, f64)> =
            profiles.iter().map(|(profile, gain)| (profile.relative(), *gain)).collect();
        let mut best = (self.peak(&relative, 0.0), 0.0);
        let still = best.0.1;
        let steps = (LONGEST_S / STEP_S) as i32;
        for seconds in (1..=steps).flat_map(|step| [step, -step]).map(|step| f64::from(step) * STEP_S) {
            let peak = self.peak(&relative, seconds);
            if peak.1 * AS_GOOD > still && peak.1 > best.0.1 {
                best = (peak, seconds);
            }
        }
        let ((place, value), seconds) = best;
        let deviation = (relative.len() as f64 / f64::from(periods)).sqrt();
        if value < PEAK_SIGMAS * deviation {
            return None;
        }
        let half = self.length / 2;
        let at = |powers: &[f64], place: usize| powers.get(place).copied().unwrap_or(0.0);
        let there = |(powers, gain): &(Vec<f64>, f64)| at(powers, self.moved(place, *gain, seconds));
        let here: f64 = relative.iter().map(|(powers, _)| at(powers, half)).sum();
        let agreeing = relative.iter().filter(|channel| there(channel) > at(&channel.0, half)).count();
        let nothing = value - here < LEAD_SIGMAS * 2_f64.sqrt() * deviation || 2 * agreeing <= relative.len();
        Some(if nothing {
            Found { samples: 0, seconds: 0.0 }
        } else {
            Found { samples: place as i64 - half as i64, seconds }
        })
    }

    /// The position at which a channel that gains so many samples a second is, after so many seconds.
    fn moved(&self, place: usize, gain: f64, seconds: f64) -> usize {
        (place as i64 + (gain * seconds).round() as i64).rem_euclid(self.length as i64) as usize
    }

    /// Position and height of the channels' common peak.
    fn peak(&self, channels: &[(Vec<f64>, f64)], seconds: f64) -> (usize, f64) {
        let mut sums = vec![0.0; self.length];
        for (powers, gain) in channels {
            let (head, tail) = powers.split_at(self.moved(0, *gain, seconds).min(powers.len()));
            sums.iter_mut().zip(tail.iter().chain(head)).for_each(|(sum, power)| *sum += power);
        }
        let greater = |best: (usize, f64), next: (usize, f64)| if next.1 > best.1 { next } else { best };
        sums.into_iter().enumerate().fold((0, f64::NEG_INFINITY), greater)
    }
}

impl Profile {
    /// Code periods in it.
    pub fn periods(&self) -> u32 {
        self.periods
    }

    /// Powers over their mean, less one: 0 with a deviation of one over the root of the periods where there
    /// is noise.
    fn relative(&self) -> Vec<f64> {
        let mean = self.powers.iter().map(|power| f64::from(*power)).sum::<f64>() / self.powers.len().max(1) as f64;
        let scale = if mean > 0.0 { 1.0 / mean } else { 0.0 };
        self.powers.iter().map(|power| f64::from(*power) * scale - 1.0).collect()
    }
}
