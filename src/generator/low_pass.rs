//! The window of low-pass filters, and the filter of band-limited code edges by its impulse response and by
//! what it leaves of frequencies. No phase is turned: the filter is symmetric.

use std::f64::consts::PI;

/// Cut-off (−6 dB) of band-limited edges, in cycles per sample. The filter falls from 0.29 to 0.51 cycles per
/// sample: what folds back is down by 42 dB at the end of the band and by 60 dB from 0.51 on. With a cut-off
/// of 0.45, codes of C/A at 2.6 Msps err 24 times as much and keep 0.02 dB more of their power.
pub(crate) const CUTOFF_CPS: f64 = 0.40;
/// Half width of the low-pass filter in samples.
pub const HALF_WIDTH: usize = 8;
/// Kaiser's shape parameter: 60 dB in the stop band.
const BETA: f64 = 5.65;

/// Frequency response of the filter.
#[derive(Debug)]
pub struct Response {
    /// The impulse response from its middle on, at [`Response::CELLS`] points per sample; half of the last
    /// one.
    impulse: Vec<f64>,
}

impl Response {
    /// Points per sample: images lie sixteen times the rate away, where the filter leaves nothing.
    const CELLS: usize = 16;

    /// Computes the response of the filter with this cut-off, in cycles per sample.
    pub fn new(cutoff_cps: f64) -> Self {
        let points = 0..=HALF_WIDTH * Self::CELLS;
        let mut impulse: Vec<f64> = points.map(|k| impulse(k as f64 / Self::CELLS as f64, cutoff_cps)).collect();
        // The trapezoid rule: the window ends at a fiftieth of its height.
        impulse.last_mut().into_iter().for_each(|end| *end *= 0.5);
        Self { impulse }
    }

    /// The amplitude left at that many cycles per sample, one at zero. The phase is not turned.
    pub fn at(&self, cps: f64) -> f64 {
        let Some((middle, rest)) = self.impulse.split_first() else { return 1.0 };
        // Chebyshev's recurrence of cosines of equal steps.
        let step = libm::cos(2.0 * PI * cps / Self::CELLS as f64);
        let (mut before, mut cos) = (1.0, step);
        let (mut sum, mut all) = (*middle, *middle);
        for value in rest {
            sum += 2.0 * value * cos;
            all += 2.0 * value;
            (before, cos) = (cos, 2.0 * step * cos - before);
        }
        sum / all
    }
}

/// The impulse response of the filter of that cut-off, `x` samples from its middle.
pub(crate) fn impulse(x: f64, cutoff_cps: f64) -> f64 {
    windowed_sinc(x, cutoff_cps, HALF_WIDTH as f64, BETA)
}

/// The impulse response `x` samples from the middle of a low-pass filter under a Kaiser window of
/// ±`half_width` samples.
pub(crate) fn windowed_sinc(x: f64, cutoff_cps: f64, half_width: f64, beta: f64) -> f64 {
    let angle = 2.0 * PI * cutoff_cps * x;
    let sinc = if angle.abs() < 1e-9 { 1.0 } else { libm::sin(angle) / angle };
    2.0 * cutoff_cps * sinc * kaiser(x / half_width, beta)
}

/// Kaiser's window at `x` of its half width.
pub(crate) fn kaiser(x: f64, beta: f64) -> f64 {
    bessel_i0(beta * (1.0 - x * x).max(0.0).sqrt()) / bessel_i0(beta)
}

/// Modified Bessel function of the first kind and order zero, by its series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}
