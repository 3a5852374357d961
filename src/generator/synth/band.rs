//! Band-limited code edges: the step response of a linear-phase low-pass filter.
//!
//! The filter is a sinc of the stated cut-off under a Kaiser window of ±8 samples, symmetric, so its
//! group delay is zero. The response to an edge at any phase is a polynomial of its cell of a sample.

use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

use super::pulse::Pulse;
pub use crate::low_pass::HALF_WIDTH;
use crate::low_pass::{CUTOFF_CPS, impulse};

/// Samples of the response.
pub(super) const WIDTH: usize = 2 * HALF_WIDTH;
/// Points per sample in the table that the reference reads.
const FINE: usize = 4096;
/// Cells a sample in the table of responses in `f64`.
pub(super) const CELLS: usize = 64;
/// Cells a sample in that of responses in [`UNIT`]s, which from the middle of a cell to its ends may not
/// change by 2^22 units: they do not where the cut-off is below 0.4995 cycles per sample.
pub(super) const UNIT_CELLS: usize = 128;
/// Unit of responses in whole numbers. 2^31 of them are 4, and no filter makes more than 1.7 times the
/// largest value of what it is given.
pub(super) const UNIT: f64 = 1.0 / (1_u32 << 29) as f64;
/// One in [`UNIT`]s.
pub(super) const UNITS: i32 = 1 << 29;
/// Constant with a last place of one, like each of its sums with a number below 2^22, so that bits of the sum
/// count it.
const COUNTER: f32 = 1.5 * (1 << 23) as f32;

/// Low-pass filter, given by its response to a unit step.
#[derive(Debug)]
pub struct Filter {
    fine: Vec<f64>,
    pulses: Mutex<Vec<Arc<Pulse>>>,
    cells: Vec<Cell>,
    unit_cells: Vec<UnitCell>,
}

/// The response to a change from −1 to 1, less the change itself, at the sixteen samples that it reaches, for
/// changes between two positions in a sample: cubic polynomials from the constant up (error below 1e-9).
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Cell([[f64; WIDTH]; 4]);

/// Cell in [`UNIT`]s: a whole number in the middle of the cell, and polynomials of the difference elsewhere,
/// from the linear term up. The error is below 1.6 units, 3e-9.
///
/// The number in the middle and the sum that becomes a whole number are rounded, by half a unit each. What is
/// more stays below 2^22 units, so that roundings of the position within the cell, of the linear coefficient,
/// of its sum with the higher terms and of the product are an eighth of a unit each at most. The cubic
/// polynomial is within 0.02 units.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct UnitCell {
    middle: [i32; WIDTH],
    more: [[f32; WIDTH]; 3],
}

impl Cell {
    /// Values at the position `x` within the cell, 0 to 1.
    #[inline(always)]
    pub(super) fn at(&self, x: f64) -> [f64; WIDTH] {
        let Self([a, b, c, d]) = self;
        let mut values = [0.0; WIDTH];
        for k in 0..WIDTH {
            values[k] = a[k] + x * (b[k] + x * (c[k] + x * d[k]));
        }
        values
    }
}

impl UnitCell {
    /// Values at the position `x` from the middle of the cell, −½ to ½.
    #[inline(always)]
    pub(super) fn at(&self, x: f32) -> [i32; WIDTH] {
        let Self { middle, more: [b, c, d] } = self;
        let mut values = [0; WIDTH];
        for k in 0..WIDTH {
            let counted = COUNTER + x * (b[k] + x * (c[k] + x * d[k]));
            values[k] = middle[k].wrapping_add(counted.to_bits() as i32);
        }
        values
    }
}

impl Default for Filter {
    /// The filter of a scene's band-limited edges.
    fn default() -> Self {
        Self::new(CUTOFF_CPS)
    }
}

impl Filter {
    /// A filter of that cut-off (−6 dB), in cycles per sample.
    pub fn new(cutoff_cps: f64) -> Self {
        let at = |x: f64| impulse(x, cutoff_cps);
        let cell = 1.0 / FINE as f64;
        let mut sum = 0.0;
        let mut fine = vec![0.0];
        // At every half cell from the middle on; it is even.
        let half: Vec<f64> = (0..=2 * HALF_WIDTH * FINE).map(|k| at(0.5 * cell * k as f64)).collect();
        let halves_on = |k: usize| half.get(k.abs_diff(2 * HALF_WIDTH * FINE)).copied().unwrap_or(0.0);
        for k in 0..WIDTH * FINE {
            sum += cell / 6.0 * (halves_on(2 * k) + 4.0 * halves_on(2 * k + 1) + halves_on(2 * k + 2));
            fine.push(sum);
        }
        fine.iter_mut().for_each(|value| *value /= sum);
        let mut filter = Self { fine, cells: Vec::new(), unit_cells: Vec::new(), pulses: Mutex::default() };
        let jump = |k: usize| if k >= HALF_WIDTH { 1.0 } else { 0.0 };
        let x = |k: usize, fraction: f64| k as f64 - HALF_WIDTH as f64 + fraction;
        // From the point of the fine table before it.
        let exactly = |x: f64| {
            let point = ((x + HALF_WIDTH as f64) * FINE as f64).floor();
            let from = point / FINE as f64 - HALF_WIDTH as f64;
            let more = (x - from) / 6.0 * (at(from) + 4.0 * at(0.5 * (from + x)) + at(x));
            filter.fine.get(point as usize).map_or(1.0, |before| before + more / sum)
        };
        // Between two positions of the change behind the sample before it.
        let polynomials = |number: usize, cells: usize| -> [[f64; 4]; WIDTH] {
            let from = |k: usize, within: f64| x(k, 1.0 - (number as f64 + within) / cells as f64);
            std::array::from_fn(|k| cubic(|within| 2.0 * (exactly(from(k, within)) - jump(k))))
        };
        let cell = |number| {
            let terms = polynomials(number, CELLS);
            Cell(std::array::from_fn(|power| terms.map(|terms| terms[power])))
        };
        let unit_cell = |number| {
            // About the middle.
            let terms = polynomials(number, UNIT_CELLS).map(|[a, b, c, d]| {
                [a + 0.5 * b + 0.25 * c + 0.125 * d, b + c + 0.75 * d, c + 1.5 * d, d].map(|term| term / UNIT)
            });
            UnitCell {
                middle: terms.map(|[a, ..]| (a.round() as i32).wrapping_sub(COUNTER.to_bits() as i32)),
                more: [1, 2, 3].map(|power| terms.map(|terms| terms[power] as f32)),
            }
        };
        filter.cells = (0..CELLS).map(cell).collect();
        filter.unit_cells = (0..UNIT_CELLS).map(unit_cell).collect();
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

    /// The response to a pulse of one chip in equal steps of those levels, at `step` chips per sample; `None`
    /// for a chip of more than 48 samples. It is made once.
    pub(super) fn pulse(&self, levels: &[f64], step: f64) -> Option<Arc<Pulse>> {
        let mut known = self.pulses.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pulse) = known.iter().find(|pulse| pulse.is_of(levels, step)) {
            return Some(Arc::clone(pulse));
        }
        let pulse = Arc::new(Pulse::new(self, levels, step)?);
        known.push(Arc::clone(&pulse));
        Some(pulse)
    }

    /// The response to a change from −1 to 1 less the change itself, in the cells of a sample in the order in
    /// which a change may lie behind the sample before it.
    #[inline(always)]
    pub(super) fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Responses to a change from −1 to 1, less the change itself, in [`UNIT`]s.
    #[inline(always)]
    pub(super) fn unit_cells(&self) -> &[UnitCell] {
        &self.unit_cells
    }

    /// Mean power of a stepped waveform behind the filter, from its autocorrelation by whole steps.
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

/// The cubic polynomial, from the constant up, that is a function at Chebyshev's four points of 0 to 1.
pub(super) fn cubic(value: impl Fn(f64) -> f64) -> [f64; 4] {
    let angle = |k: usize| (k as f64 + 0.5) * PI / 4.0;
    let values: [f64; 4] = std::array::from_fn(|k| value(0.5 + 0.5 * libm::cos(angle(k))));
    // Coefficients of Chebyshev's polynomials of 2x − 1.
    let [a, b, c, d]: [f64; 4] = std::array::from_fn(|j| {
        let sum: f64 = values.iter().enumerate().map(|(k, value)| value * libm::cos(j as f64 * angle(k))).sum();
        if j == 0 { sum / 4.0 } else { sum / 2.0 }
    });
    [a - b + c - d, 2.0 * b - 8.0 * c + 18.0 * d, 8.0 * c - 48.0 * d, 32.0 * d]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_response_has_no_delay_and_ends_at_one() {
        let filter = Filter::default();
        for k in 0..200 {
            let x = f64::from(k) * 0.05;
            // Odd about the edge: a linear-phase filter with zero group delay.
            assert!((filter.step(x) + filter.step(-x) - 1.0).abs() < 1e-12, "{x}");
        }
        assert_eq!((filter.step(-8.5), filter.step(8.5)), (0.0, 1.0));
    }

    #[test]
    fn responses_of_cells_are_twice_the_step_s_wherever_a_change_lies() {
        for cutoff_cps in [0.05, 0.3, 0.45, 0.499, 0.5] {
            let filter = Filter::new(cutoff_cps);
            // Twice a 24th of the fourth derivative, 4π³·edge⁴ at most, times a quarter of a cell to the
            // fourth, for a change of two. The window moves the band's edge out by half its transition.
            let edge = cutoff_cps + 0.12;
            let bound = |cells: usize| 2.0 * 4.0 * PI.powi(3) * edge.powi(4) / 12.0 * (0.25 / cells as f64).powi(4);
            for k in 0..1000 {
                let place = f64::from(k) / 1000.0;
                let of = |cells: usize| ((place * cells as f64) as usize, (place * cells as f64).fract());
                let ((cell, x), (unit_cell, unit_x)) = (of(CELLS), of(UNIT_CELLS));
                let found = filter.cells()[cell].at(x);
                let units = filter.unit_cells()[unit_cell].at((unit_x - 0.5) as f32);
                for n in 0..WIDTH {
                    let x = n as f64 - HALF_WIDTH as f64 + 1.0 - place;
                    let expected = 2.0 * (filter.step(x) - if n >= HALF_WIDTH { 1.0 } else { 0.0 });
                    assert!((found[n] - expected).abs() < bound(CELLS), "{cutoff_cps} {place} {n}");
                    // Three halves of a unit as documented, and the polynomial's.
                    let error = (f64::from(units[n]) * UNIT - expected).abs();
                    let counts = cutoff_cps < 0.4995;
                    assert!(!counts || error < 1.5 * UNIT + bound(UNIT_CELLS), "{cutoff_cps} {place} {n} {error}");
                }
            }
        }
    }
}
