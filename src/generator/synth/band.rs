//! Band-limited code edges: the step response of a linear-phase low-pass filter.
//!
//! The filter is a sinc of the stated cut-off under a Kaiser window of ±8 samples, symmetric, so its
//! group delay is zero. An edge at any phase is a row of the polyphase table, linear between rows
//! of 1/256 sample (error below 4e-6 of a unit step).

use std::f64::consts::PI;

/// Half width of the response in samples.
pub const HALF_WIDTH: usize = 8;
const WIDTH: usize = 2 * HALF_WIDTH;
const ROWS: usize = 256;
/// Points a sample in the table that the reference reads.
const FINE: usize = 4096;
/// Kaiser's shape parameter: 60 dB in the stop band.
const BETA: f64 = 5.65;

/// A low-pass filter, known by its response to a unit step.
#[derive(Clone, Debug)]
pub struct Filter {
    fine: Vec<f64>,
    rows: Vec<[f32; WIDTH]>,
    /// The same from `fine`, side by side.
    exact_rows: Vec<[f64; WIDTH]>,
}

impl Filter {
    /// A filter of that cut-off (−6 dB), in cycles a sample.
    pub fn new(cutoff_cps: f64) -> Self {
        let at = |x: f64| impulse(x, cutoff_cps);
        let cell = 1.0 / FINE as f64;
        let mut sum = 0.0;
        let mut fine = vec![0.0];
        for k in 0..WIDTH * FINE {
            let x = k as f64 * cell - HALF_WIDTH as f64;
            sum += cell / 6.0 * (at(x) + 4.0 * at(x + 0.5 * cell) + at(x + cell));
            fine.push(sum);
        }
        fine.iter_mut().for_each(|value| *value /= sum);
        let mut filter = Self { fine, rows: Vec::new(), exact_rows: Vec::new() };
        filter.rows = (0..=ROWS)
            .map(|row| {
                std::array::from_fn(|k| {
                    let x = k as f64 - HALF_WIDTH as f64 + row as f64 / ROWS as f64;
                    (filter.step(x) - if k >= HALF_WIDTH { 1.0 } else { 0.0 }) as f32
                })
            })
            .collect();
        filter.exact_rows = (0..=FINE)
            .map(|row| {
                std::array::from_fn(|k| {
                    let value = filter.fine.get(row + k * FINE).copied().unwrap_or(1.0);
                    value - if k >= HALF_WIDTH { 1.0 } else { 0.0 }
                })
            })
            .collect();
        filter
    }

    /// Response at `x` samples after a unit step: 0 before −8, 1 after +8.
    pub fn step(&self, x: f64) -> f64 {
        let place = (x + HALF_WIDTH as f64) * FINE as f64;
        if place <= 0.0 {
            return 0.0;
        }
        let index = place as usize;
        match (self.fine.get(index), self.fine.get(index + 1)) {
            (Some(a), Some(b)) => a + (b - a) * (place - index as f64),
            _ => 1.0,
        }
    }

    /// The response minus the ideal step, at the samples from 8 before to 7 after the first one that
    /// lies at or behind the edge, for an edge `fraction` (0..1) of a sample before that one.
    #[inline(always)]
    pub fn residual(&self, fraction: f64) -> [f32; WIDTH] {
        let place = fraction * ROWS as f64;
        let index = (place as usize).min(ROWS - 1);
        let weight = (place - index as f64) as f32;
        match self.rows.get(index..index + 2) {
            Some([a, b]) => std::array::from_fn(|k| a[k] + (b[k] - a[k]) * weight),
            _ => [0.0; WIDTH],
        }
    }

    /// [`Filter::residual`] in `f64`, linear between rows of 1/4096 sample (error below 2e-8).
    #[inline(always)]
    pub fn exact_residual(&self, fraction: f64) -> [f64; WIDTH] {
        let place = fraction * FINE as f64;
        let index = (place as usize).min(FINE - 1);
        let weight = place - index as f64;
        match self.exact_rows.get(index..index + 2) {
            Some([a, b]) => std::array::from_fn(|k| a[k] + (b[k] - a[k]) * weight),
            _ => [0.0; WIDTH],
        }
    }

    /// Mean power of a stepped waveform behind the filter, for its autocorrelation by whole steps.
    ///
    /// The pulse of one step is `g(x) = H(x) − H(x − 1/step)`; the power is
    /// `step · Σ_lag ρ(lag) ∫ g(x) g(x + lag/step) dx`, with lags as far as pulses overlap.
    pub fn power(&self, correlation: &[f64], step: f64) -> f64 {
        let duration = 1.0 / step;
        let pulse = |x: f64| self.step(x) - self.step(x - duration);
        let cell = 1.0 / 32.0;
        let cells = ((2.0 * HALF_WIDTH as f64 + duration) / cell) as usize + 1;
        let overlap = |shift: f64| {
            (0..=cells)
                .map(|k| {
                    let x = k as f64 * cell - HALF_WIDTH as f64;
                    pulse(x) * pulse(x + shift)
                })
                .sum::<f64>()
                * cell
        };
        let reach = ((2.0 * HALF_WIDTH as f64 + duration) * step) as usize + 1;
        let sides: f64 = (1..=reach)
            .map(|lag| 2.0 * correlation.get(lag).copied().unwrap_or(0.0) * overlap(lag as f64 * duration))
            .sum();
        step * (correlation.first().copied().unwrap_or(1.0) * overlap(0.0) + sides)
    }
}

fn impulse(x: f64, cutoff_cps: f64) -> f64 {
    windowed_sinc(x, cutoff_cps, HALF_WIDTH as f64, BETA)
}

/// The impulse response `x` samples from the middle of a low-pass filter under a Kaiser window of
/// ±`half_width` samples.
pub(crate) fn windowed_sinc(x: f64, cutoff_cps: f64, half_width: f64, beta: f64) -> f64 {
    let angle = 2.0 * PI * cutoff_cps * x;
    let sinc = if angle.abs() < 1e-9 { 1.0 } else { libm::sin(angle) / angle };
    let place = x / half_width;
    2.0 * cutoff_cps * sinc * bessel_i0(beta * (1.0 - place * place).max(0.0).sqrt()) / bessel_i0(beta)
}

/// Modified Bessel function of order zero by its power series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..30 {
        term *= quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_response_has_no_delay_and_ends_at_one() {
        let filter = Filter::new(0.45);
        for k in 0..200 {
            let x = f64::from(k) * 0.05;
            // Odd about the edge: a linear-phase filter with zero group delay.
            assert!((filter.step(x) + filter.step(-x) - 1.0).abs() < 1e-12, "{x}");
        }
        assert_eq!((filter.step(-8.5), filter.step(8.5)), (0.0, 1.0));
        // Linear interpolation over 1/256 sample of a function whose second derivative stays below 2.
        for k in 0..97 {
            let fraction = f64::from(k) / 97.0;
            for (j, value) in filter.residual(fraction).iter().enumerate() {
                let x = j as f64 - 8.0 + fraction;
                let exact = filter.step(x) - if j >= 8 { 1.0 } else { 0.0 };
                assert!((f64::from(*value) - exact).abs() < 4e-6, "{fraction} {j}");
            }
        }
    }
}
