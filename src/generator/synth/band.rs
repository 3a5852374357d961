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
/// Cells a sample in the table of the kernel in `f64`.
const CELLS: usize = 64;
/// Kaiser's shape parameter: 60 dB in the stop band.
const BETA: f64 = 5.65;

/// A low-pass filter, known by its response to a unit step.
#[derive(Clone, Debug)]
pub struct Filter {
    fine: Vec<f64>,
    rows: Vec<[f32; WIDTH]>,
    cells: Vec<Cell>,
}

/// Polynomials of the response to a change from −1 to 1 between two places in a sample, from the constant up,
/// with as many zeros before and after it as it may begin late in a block.
type Cell = [[f64; 2 * WIDTH]; 4];

/// The response to a change from −1 to 1, less the change itself, at consecutive samples.
#[derive(Clone, Copy, Debug)]
pub struct Response<'a, const N: usize> {
    rows: [&'a [f64; N]; 4],
    /// Where in its cell it is.
    x: f64,
}

impl<const N: usize> Response<'_, N> {
    /// At `B` samples of which `first` is the first.
    #[inline(always)]
    pub fn at<const B: usize>(&self, first: usize) -> [f64; B] {
        let row = |row: &[f64; N]| row.get(first..).and_then(|row| row.first_chunk::<B>()).copied();
        let mut values = [0.0; B];
        if let [Some(a), Some(b), Some(c), Some(d)] = self.rows.map(row) {
            for k in 0..B {
                values[k] = a[k] + self.x * (b[k] + self.x * (c[k] + self.x * d[k]));
            }
        }
        values
    }
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
        let mut filter = Self { fine, rows: Vec::new(), cells: Vec::new() };
        let jump = |k: usize| if k >= HALF_WIDTH { 1.0 } else { 0.0 };
        let x = |k: usize, fraction: f64| k as f64 - HALF_WIDTH as f64 + fraction;
        filter.rows = (0..=ROWS)
            .map(|row| std::array::from_fn(|k| (filter.step(x(k, row as f64 / ROWS as f64)) - jump(k)) as f32))
            .collect();
        // From the point of the fine table before it.
        let exactly = |x: f64| {
            let point = ((x + HALF_WIDTH as f64) * FINE as f64).floor();
            let from = point / FINE as f64 - HALF_WIDTH as f64;
            let more = (x - from) / 6.0 * (at(from) + 4.0 * at(0.5 * (from + x)) + at(x));
            filter.fine.get(point as usize).map_or(1.0, |before| before + more / sum)
        };
        let cell = |number: usize| {
            let mut cell = [[0.0; 2 * WIDTH]; 4];
            for k in 0..WIDTH {
                let value = |within: f64| 2.0 * (exactly(x(k, (number as f64 + within) / CELLS as f64)) - jump(k));
                cell.iter_mut().zip(cubic(value)).for_each(|(row, term)| row[HALF_WIDTH + k] = term);
            }
            cell
        };
        filter.cells = (0..CELLS).map(cell).collect();
        filter
    }

    /// Response at `x` samples after a unit step: 0 before −8, 1 after +8.
    pub fn step(&self, x: f64) -> f64 {
        let place = (x + HALF_WIDTH as f64) * FINE as f64;
        if place <= 0.0 {
            return 0.0;
        }
        let (index, t) = (place as usize, place - place.floor());
        let about = index.checked_sub(1).and_then(|from| self.fine.get(from..)?.first_chunk::<4>());
        match (about, self.fine.get(index), self.fine.get(index + 1)) {
            // By the four points about it (Lagrange).
            (Some([a, b, c, d]), ..) => {
                let ends = t * (t - 1.0) / 6.0 * ((2.0 - t) * a + (1.0 + t) * d);
                let middle = (1.0 + t) * (2.0 - t) / 2.0 * ((1.0 - t) * b + t * c);
                ends + middle
            }
            (None, Some(a), Some(b)) => a + (b - a) * t,
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

    /// Twice [`Filter::residual`] in `f64` (error below 1e-9) at samples of which number `place`, at most
    /// `HALF_WIDTH`, is the first that it reaches; `None` for more samples than that.
    #[inline(always)]
    pub fn response<const N: usize>(&self, fraction: f64, place: usize) -> Option<Response<'_, N>> {
        let within = fraction * CELLS as f64;
        let index = (within as i64).clamp(0, CELLS as i64 - 1);
        let from = HALF_WIDTH.saturating_sub(place);
        let [a, b, c, d] = self.cells.get(index as usize)?.each_ref().map(|row| row.get(from..)?.first_chunk());
        Some(Response { rows: [a?, b?, c?, d?], x: within - index as f64 })
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

/// The cubic polynomial, from the constant up, that is a function at Chebyshev's four points of 0 to 1.
fn cubic(value: impl Fn(f64) -> f64) -> [f64; 4] {
    let angle = |k: usize| (k as f64 + 0.5) * PI / 4.0;
    let values: [f64; 4] = std::array::from_fn(|k| value(0.5 + 0.5 * libm::cos(angle(k))));
    // Coefficients of Chebyshev's polynomials of 2x − 1.
    let [a, b, c, d]: [f64; 4] = std::array::from_fn(|j| {
        let sum: f64 = values.iter().enumerate().map(|(k, value)| value * libm::cos(j as f64 * angle(k))).sum();
        if j == 0 { sum / 4.0 } else { sum / 2.0 }
    });
    [a - b + c - d, 2.0 * b - 8.0 * c + 18.0 * d, 8.0 * c - 48.0 * d, 32.0 * d]
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

    #[test]
    fn a_response_in_f64_is_twice_the_step_s_wherever_it_begins() {
        for cutoff_cps in [0.05, 0.3, 0.45, 0.5] {
            let filter = Filter::new(cutoff_cps);
            // Twice a 24th of the fourth derivative, 4π³·edge⁴ at most, times a quarter of a cell to the
            // fourth, for a change of two. The window moves the band's edge out by half its transition.
            let edge = cutoff_cps + 0.12;
            let bound = 2.0 * 4.0 * PI.powi(3) * edge.powi(4) / 12.0 * (0.25 / CELLS as f64).powi(4);
            for k in 0..1000 {
                let (fraction, place) = (f64::from(k) / 1000.0, (k % 9) as usize);
                let response = filter.response::<{ 3 * HALF_WIDTH }>(fraction, place).unwrap();
                for (n, found) in response.at::<{ 3 * HALF_WIDTH }>(0).into_iter().enumerate() {
                    let x = n as f64 - place as f64 - HALF_WIDTH as f64 + fraction;
                    let ideal = if n >= place + HALF_WIDTH { 1.0 } else { 0.0 };
                    let within = (place..place + WIDTH).contains(&n);
                    let expected = if within { 2.0 * (filter.step(x) - ideal) } else { 0.0 };
                    assert!((found - expected).abs() < bound, "{cutoff_cps} {fraction} {n}: {found} {expected}");
                }
            }
        }
    }
}
