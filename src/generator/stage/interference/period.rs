//! One period of a sweep behind a front end that passes the samples' band and nothing else.
//!
//! A sweep that repeats has lines at the multiples of its rate. Those in the band, of a transform of one
//! period, make a waveform without anything that folds; the interpolator of recordings reads it at each
//! sample. Cost: 64 products a sample in place of a sine. Limits: the band's edges are as steep as lines are
//! apart; sweeps of more than `MOST_CYCLES` cycles have none, and cross the edges so slowly that a gate by
//! the momentary frequency is as good.

use fft::{Complex, Planner};

use super::Recorded;
use crate::synth::resample::{Interpolator, Position};
use crate::synth::tone::Modulation;

/// Width times period beyond which there is no table: its transform would take 64 MiB.
const MOST_CYCLES: f64 = 131_072.0;
/// Points of the transformed period over the sweep's cycles: what folds there is 1/256 of a line over the
/// cycles.
const POINTS: f64 = 16.0;
/// Fewest points of a transform beyond those.
const LEAST_POINTS: usize = 1024;

/// Waveform of a period.
#[derive(Clone, Debug)]
pub struct Period {
    samples: Recorded,
    by: Interpolator,
    /// Number of the line in the middle of the band, at 0 Hz in `samples`.
    middle: i64,
}

impl Period {
    /// The period of a sweep whose momentary frequency or its sidebands leave the samples' band; `None` for
    /// any other. `band_hz` is that band less the sweep's middle.
    pub fn of(modulation: Modulation, repetition_hz: f64, band_hz: (f64, f64)) -> Option<Self> {
        let (reach, steepness) = modulation.reach();
        let width_hz = reach * repetition_hz;
        // A linear sweep of slope s crosses an edge in 1/√s and has sidebands as far as √s.
        let farthest_hz = 0.5 * width_hz + (steepness * width_hz * repetition_hz).sqrt();
        if reach > MOST_CYCLES || (-farthest_hz > band_hz.0 && farthest_hz < band_hz.1) {
            return None;
        }
        let points = ((POINTS * reach) as usize + LEAST_POINTS).next_power_of_two();
        let mut wave: Vec<Complex<f64>> = (0..points)
            .map(|k| {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * modulation.cycles_at(k as f64 / points as f64));
                Complex::new(cos, sin) / points as f64
            })
            .collect();
        let mut planner = Planner::<f64>::new();
        planner.plan_fft_forward(points).process(&mut wave);
        let (first, last) = ((band_hz.0 / repetition_hz).ceil() as i64, (band_hz.1 / repetition_hz).ceil() as i64);
        let middle = (first + last) / 2;
        let length = (2 * (last - first).unsigned_abs() as usize + LEAST_POINTS / 8).next_power_of_two();
        let mut lines = vec![Complex::default(); length];
        // Lines beyond half of the transform are less than it resolves.
        let half = points as i64 / 2;
        for line in (first..last).filter(|line| (-half..half).contains(line)) {
            let of = |number: i64, size: usize| number.rem_euclid(size as i64) as usize;
            lines[of(line - middle, length)] = wave[of(line, points)];
        }
        planner.plan_fft_inverse(length).process(&mut lines);
        let samples =
            Recorded { i: lines.iter().map(|c| c.re as f32).collect(), q: lines.iter().map(|c| c.im as f32).collect() };
        Some(Self { samples, by: Interpolator::new(0.5, false), middle })
    }

    /// The interpolator, and the samples that it reads for `samples` of ours, from `place` of the period on
    /// with `step` a sample, in 2^-64.
    pub(super) fn read(
        &self,
        (place, step): (u64, u64),
        samples: usize,
    ) -> (&Interpolator, Position, (Vec<f32>, Vec<f32>)) {
        let length = self.samples.i.len() as u128;
        let at = u128::from(place) * length;
        let step = ((u128::from(step) * length) >> 32) as u64;
        let position = Position { whole: (at >> 64) as i64, fraction: (at >> 32) as u32, step };
        (&self.by, position, self.samples.read(Interpolator::reach(position, samples), true, false))
    }

    /// Phase of the middle line less that of the carrier, or its advance, in 2^-64 turn.
    pub(super) fn turns(&self, place: u64) -> u64 {
        (self.middle as u64).wrapping_mul(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Power of the period in each line from the band's lower end on.
    fn lines(period: &Period, count: usize) -> Vec<f64> {
        let (i, q) = (&period.samples.i, &period.samples.q);
        let length = i.len();
        let mut wave: Vec<Complex<f64>> =
            i.iter().zip(q).map(|(i, q)| Complex::new(f64::from(*i), f64::from(*q)) / length as f64).collect();
        Planner::<f64>::new().plan_fft_forward(length).process(&mut wave);
        (0..count).map(|k| wave[(k + length - count / 2) % length].norm_sqr()).collect()
    }

    #[test]
    fn a_sine_s_lines_are_bessel_functions() {
        // Modulation index 5 at 100 kHz, lines from -200 to 100 kHz: J_k(5)², Abramowitz and Stegun, table
        // 9.2.
        let modulation = Modulation::Sine { cycles: 5.0 / std::f64::consts::TAU };
        let period = Period::of(modulation, 1e5, (-2e5, 2e5)).unwrap();
        let bessel = [0.046_565_116_3_f64, -0.327_579_137_6, -0.177_596_771_3, -0.327_579_137_6];
        for (found, bessel) in lines(&period, 4).iter().zip(bessel) {
            assert!((found - bessel * bessel).abs() < 1e-7, "{found} {bessel}");
        }
    }

    #[test]
    fn a_wide_sweep_s_lines_in_the_band_have_the_share_of_its_power() {
        // 100 MHz in 8.6 us, 27.4 MHz beside the band of 4 MHz: 4 % of the power, with Fresnel's ripple.
        let period = Period::of(Modulation::Sawtooth { cycles: 859.0 }, 1e8 / 859.0, (25.4e6, 29.4e6)).unwrap();
        let power: f64 = lines(&period, 34).iter().sum();
        assert!((power / 0.04 - 1.0).abs() < 0.05, "{power}");
    }

    #[test]
    fn sweeps_that_stay_in_the_band_need_no_period() {
        let modulation = Modulation::Sawtooth { cycles: 100.0 };
        assert!(Period::of(modulation, 1e4, (-1e6, 1e6)).is_none());
        // 0.5 MHz and sidebands of 0.1 MHz.
        assert!(Period::of(modulation, 1e4, (-1e6, 0.55e6)).is_some());
        assert!(Period::of(Modulation::Sawtooth { cycles: 2e5 }, 1e2, (-1e6, 1e6)).is_none());
    }
}
