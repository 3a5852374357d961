//! Samples at another rate: band-limited noise from white noise, and recordings.
//!
//! A sample is the sum of 64 neighbours weighted with a sinc under a Kaiser window (80 dB in the stop band),
//! from a table of 256 phases, linear between them (−94 dB). The response falls from 1 to 0 within ±0.04 of
//! the source's rate about the cut-off. Limits: noise is drawn on the samples' own grid, so a drifting clock
//! moves its band and not its shape.

use crate::low_pass::windowed_sinc;
use crate::synth::angle::cos_sin;
use crate::synth::isa::{self, Level};
use crate::synth::noise::{BLOCK_SAMPLES, LANES};

/// Neighbours that make one sample.
pub const TAPS: usize = 64;
const HALF: usize = TAPS / 2;
const PHASES: usize = 256;
/// Kaiser's shape parameter for 80 dB.
const BETA: f64 = 7.857;

/// One of a source's samples, in units of 2^-32, and the step from one of ours to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Number of the sample.
    pub whole: i64,
    /// Fraction of a sample, in 2^-32.
    pub fraction: u32,
    /// Source samples per sample, in 2^-32.
    pub step: u64,
}

/// A low-pass interpolator.
#[derive(Clone, Debug)]
pub struct Interpolator {
    rows: Vec<[f32; TAPS]>,
}

impl Interpolator {
    /// Cut-off (−6 dB) in cycles per sample of the source. `unit_noise` scales white noise of unit power to
    /// unit power; otherwise slow signals keep their size.
    pub fn new(cutoff_cps: f64, unit_noise: bool) -> Self {
        let mut rows: Vec<[f64; TAPS]> = (0..=PHASES)
            .map(|phase| {
                std::array::from_fn(|tap| {
                    let x = tap as f64 - (HALF as f64 - 1.0) - phase as f64 / PHASES as f64;
                    windowed_sinc(x, cutoff_cps, HALF as f64, BETA)
                })
            })
            .collect();
        let (mut sum, mut power) = (0.0, 0.0);
        for row in rows.iter().take(PHASES) {
            sum += row.iter().sum::<f64>();
            power += row.iter().map(|h| h * h).sum::<f64>();
        }
        let scale = if unit_noise { (PHASES as f64 / power).sqrt() } else { PHASES as f64 / sum };
        rows.iter_mut().flatten().for_each(|h| *h *= scale);
        Self { rows: rows.into_iter().map(|row| row.map(|h| h as f32)).collect() }
    }

    /// First and last source sample (exclusive) that `samples` of ours from `position` on read.
    pub fn reach(position: Position, samples: usize) -> (i64, i64) {
        let last = (u64::from(position.fraction) + position.step * samples.saturating_sub(1) as u64) >> 32;
        (position.whole - (HALF as i64 - 1), position.whole + last as i64 + HALF as i64 + 1)
    }

    /// Interpolates into `out`; `source` begins at the first sample of [`Self::reach`].
    #[inline(always)]
    pub fn apply(&self, position: Position, source: (&[f32], &[f32]), out: (&mut [f32], &mut [f32])) {
        const WIDTH: usize = 16;
        let mut place = u64::from(position.fraction);
        for (oi, oq) in out.0.iter_mut().zip(out.1) {
            let (at, fraction) = ((place >> 32) as usize, place as u32);
            let row = (fraction >> 24) as usize;
            let weight = (fraction & 0x00ff_ffff) as f32 * (1.0 / 16_777_216.0);
            place += position.step;
            let (Some([a, b]), Some(i), Some(q)) =
                (self.rows.get(row..row + 2), source.0.get(at..at + TAPS), source.1.get(at..at + TAPS))
            else {
                continue;
            };
            let (mut si, mut sq) = ([0.0_f32; WIDTH], [0.0_f32; WIDTH]);
            let taps = a.chunks_exact(WIDTH).zip(b.chunks_exact(WIDTH));
            for ((a, b), (i, q)) in taps.zip(i.chunks_exact(WIDTH).zip(q.chunks_exact(WIDTH))) {
                for k in 0..WIDTH {
                    let h = a[k] + (b[k] - a[k]) * weight;
                    si[k] += h * i[k];
                    sq[k] += h * q[k];
                }
            }
            let mut half = WIDTH / 2;
            while half > 0 {
                for k in 0..half {
                    si[k] += si[k + half];
                    sq[k] += sq[k + half];
                }
                half /= 2;
            }
            (*oi, *oq) = (si[0], sq[0]);
        }
    }
}

/// Draws the complex white noise of unit power from sample `first` to `last` (exclusive) of its own count.
pub fn draw(level: Level, seed: u64, (first, last): (i64, i64)) -> (Vec<f32>, Vec<f32>) {
    let size = BLOCK_SAMPLES as i64;
    let (low, high) = (first.div_euclid(size), (last - 1).div_euclid(size));
    let length = (high - low + 1).max(0) as usize * BLOCK_SAMPLES;
    let (mut i, mut q) = (vec![0.0; length], vec![0.0; length]);
    for (block, (i, q)) in (low..).zip(i.chunks_mut(BLOCK_SAMPLES).zip(q.chunks_mut(BLOCK_SAMPLES))) {
        isa::add_noise(level, seed, block as u64, std::f32::consts::FRAC_1_SQRT_2, i, q);
    }
    let skip = first.rem_euclid(size) as usize;
    for plane in [&mut i, &mut q] {
        plane.drain(..skip.min(plane.len()));
        plane.truncate((last - first).max(0) as usize);
    }
    (i, q)
}

/// Adds `wave` turned by a carrier (phase of sample 0 and advance, in 2^-64 turn) and multiplied by
/// `amplitude`.
#[inline(always)]
pub fn turn(wave: (&[f32], &[f32]), carrier: (u64, u64), amplitude: f32, i: &mut [f32], q: &mut [f32]) {
    let mut turns: [u64; LANES] = std::array::from_fn(|k| carrier.0.wrapping_add(carrier.1.wrapping_mul(k as u64)));
    let stride = carrier.1.wrapping_mul(LANES as u64);
    let waves = wave.0.chunks(LANES).zip(wave.1.chunks(LANES));
    for ((wi, wq), (bi, bq)) in waves.zip(i.chunks_mut(LANES).zip(q.chunks_mut(LANES))) {
        let angle: [u32; LANES] = std::array::from_fn(|k| (turns[k] >> 32) as u32);
        let (cos, sin) = cos_sin(&angle);
        turns.iter_mut().for_each(|t| *t = t.wrapping_add(stride));
        for (k, ((bi, bq), (wi, wq))) in bi.iter_mut().zip(bq).zip(wi.iter().zip(wq)).enumerate() {
            *bi += amplitude * (wi * cos[k] - wq * sin[k]);
            *bq += amplitude * (wi * sin[k] + wq * cos[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_has_its_power_and_its_edges() {
        // The response by direct evaluation of the table's own taps, against 1 inside and −80 dB outside.
        let cutoff = 1.0 / 3.0;
        let interpolator = Interpolator::new(cutoff, false);
        let gain_db = |cps: f64| {
            let (mut re, mut im) = (0.0, 0.0);
            for (phase, row) in interpolator.rows.iter().take(PHASES).enumerate() {
                for (tap, h) in row.iter().enumerate() {
                    let x = tap as f64 - (HALF as f64 - 1.0) - phase as f64 / PHASES as f64;
                    let (sin, cos) = libm::sincos(std::f64::consts::TAU * cps * x);
                    re += f64::from(*h) * cos / PHASES as f64;
                    im += f64::from(*h) * sin / PHASES as f64;
                }
            }
            10.0 * libm::log10(re * re + im * im)
        };
        for cps in [0.0, 0.1, 0.2, cutoff - 0.045] {
            assert!(gain_db(cps).abs() < 0.01, "{cps}: {}", gain_db(cps));
        }
        assert!((gain_db(cutoff) + 6.0206).abs() < 0.02, "{}", gain_db(cutoff));
        for cps in [cutoff + 0.045, 0.45, 0.7, 0.95] {
            assert!(gain_db(cps) < -75.0, "{cps}: {}", gain_db(cps));
        }
    }

    #[test]
    fn at_its_own_rate_every_sample_comes_back() {
        let interpolator = Interpolator::new(0.5, false);
        let position = Position { whole: 40, fraction: 0, step: 1 << 32 };
        let reach = Interpolator::reach(position, 100);
        assert_eq!(reach, (9, 173 - 1));
        let (si, sq) = draw(Level::Baseline, 3, reach);
        let (mut i, mut q) = (vec![0.0; 100], vec![0.0; 100]);
        interpolator.apply(position, (&si, &sq), (&mut i, &mut q));
        for (k, (i, q)) in i.iter().zip(&q).enumerate() {
            // The taps' zeros are sines of multiples of π: 1e-16 each; the middle one is scaled by 256
            // phases' mean.
            assert!((i - si[k + 31]).abs() < 1e-3 && (q - sq[k + 31]).abs() < 1e-3, "{k}");
        }
    }

    #[test]
    fn noise_is_the_same_wherever_it_is_drawn_from() {
        let (whole, _) = draw(Level::Baseline, 7, (-5000, 9000));
        let (part, _) = draw(Level::Baseline, 7, (4090, 4100));
        assert_eq!(part, whole[9090..9100]);
    }
}
