//! Band-pass filter of the front end, as a finite response around the signal's IF.
//!
//! A `brick_wall` is a sinc under a Kaiser window of 80 dB (Kaiser 1974), of linear phase; a `butterworth`
//! has the analogue filter's response, amplitude and phase, within the samples' band. In a real format the
//! filter acts on the real samples, on both sides of zero. Limits: a filter delays code and carrier's
//! envelope by its group delay, which every satellite shares; an ideal wall has edges of a twentieth of its
//! width.

use std::f64::consts::PI;

use num_complex::Complex64;

use crate::low_pass::kaiser;
use crate::stage::butterworth::{self, Analogue};
use crate::stage::{Block, Stage};
use gnss::facts::{FilterShape, FilterSpec, StageSpec};

/// Shape of a filter, by the name that a scenario uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A long symmetric filter with steep edges.
    BrickWall,
    /// A Butterworth filter, causal.
    Butterworth {
        /// Order of the filter.
        order: u32,
    },
}

/// Attenuation of a Kaiser window's side lobes, dB, and the β that it takes.
const KAISER_DB: f64 = 80.0;
/// Width of a wall's edge against the filter's width.
const EDGE: f64 = 0.05;
/// Longest response.
const MAX_TAPS: usize = 8192;

/// A band-pass filter.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    /// Shape of the response.
    pub shape: Shape,
    /// Width between the points of half power, in Hz (both sides of the IF together).
    pub bandwidth_hz: f64,
    /// Delay of the envelope in the middle of the band, in seconds.
    pub group_delay_s: f64,
    /// Frequency in the samples of its middle, in Hz.
    pub middle_hz: f64,
    /// The response by ascending lag; imaginary parts are zero for a filter around zero.
    re: Vec<f32>,
    im: Vec<f32>,
    /// True if only the in-phase plane is sent.
    real: bool,
}

/// Reason for which a filter cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FilterError {
    /// A band that the sample rate cannot hold.
    #[error("{bandwidth_hz} Hz at {rate_hz} samples a second: expected less than {limit_hz} Hz, or no filter")]
    Wide {
        /// The band asked for, in Hz.
        bandwidth_hz: f64,
        /// The sample rate, in Hz.
        rate_hz: f64,
        /// The widest band at that rate, in Hz.
        limit_hz: f64,
    },
    /// A band that would take too long a filter.
    #[error("{bandwidth_hz} Hz at {rate_hz} samples a second takes {taps} taps: expected at most 8192")]
    Narrow {
        /// The band asked for, in Hz.
        bandwidth_hz: f64,
        /// The sample rate, in Hz.
        rate_hz: f64,
        /// Taps that it would take.
        taps: usize,
    },
}

impl Filter {
    /// Designs a filter around `if_hz`. `real` is true for a format without quadrature.
    ///
    /// # Errors
    /// [`FilterError`] if the band does not fit into that of the samples, or needs too long a response.
    pub fn new(shape: Shape, bandwidth_hz: f64, rate_hz: f64, if_hz: f64, real: bool) -> Result<Self, FilterError> {
        let room_hz = if real { 2.0 * if_hz.abs().min(0.5 * rate_hz - if_hz.abs()) } else { rate_hz };
        let limit_hz = room_hz / (1.0 + EDGE);
        if bandwidth_hz >= limit_hz {
            return Err(FilterError::Wide { bandwidth_hz, rate_hz, limit_hz });
        }
        let width = bandwidth_hz / rate_hz;
        let middle = if_hz / rate_hz;
        // The length is checked first, because one hertz of a wide band takes millions of taps.
        let (taps, delay) = match shape {
            Shape::BrickWall => {
                let taps = short_enough(wall_taps(width), bandwidth_hz, rate_hz)?;
                (brick_wall(width, middle, taps, real), 0.5 * (taps - 1) as f64)
            }
            Shape::Butterworth { order } => {
                let filter = Analogue::new(order, width);
                short_enough(filter.length(), bandwidth_hz, rate_hz)?;
                butterworth::taps(&filter, middle, real)
            }
        };
        let re = taps.iter().map(|tap| tap.re as f32).collect();
        let im = if real { Vec::new() } else { taps.iter().map(|tap| tap.im as f32).collect() };
        Ok(Self { shape, bandwidth_hz, group_delay_s: delay / rate_hz, middle_hz: if_hz, re, im, real })
    }

    /// Length of the response.
    pub fn taps(&self) -> usize {
        self.re.len()
    }

    /// Complex gain at `cycles` per sample.
    pub fn response(&self, cycles: f64) -> Complex64 {
        let im = self.im.iter().copied().chain(std::iter::repeat(0.0));
        self.re.iter().zip(im).enumerate().fold(Complex64::ZERO, |sum, (k, (re, im))| {
            let (sin, cos) = libm::sincos(-std::f64::consts::TAU * cycles * k as f64);
            sum + Complex64::new(f64::from(*re), f64::from(im)) * Complex64::new(cos, sin)
        })
    }
}

/// Kaiser's length for this attenuation and an edge of EDGE · `width`; odd.
fn wall_taps(width: f64) -> usize {
    ((KAISER_DB - 7.95) / (14.36 * EDGE * width)).ceil() as usize | 1
}

/// The number of taps, if it is one that a filter may have.
fn short_enough(taps: usize, bandwidth_hz: f64, rate_hz: f64) -> Result<usize, FilterError> {
    if taps > MAX_TAPS { Err(FilterError::Narrow { bandwidth_hz, rate_hz, taps }) } else { Ok(taps) }
}

/// A sinc of `width` cycles per sample under a Kaiser window, of unit gain in the middle of its band, which
/// is at `middle` cycles per sample.
fn brick_wall(width: f64, middle: f64, length: usize, real: bool) -> Vec<Complex64> {
    let beta = 0.1102 * (KAISER_DB - 8.7);
    let half = 0.5 * (length - 1) as f64;
    let low_pass: Vec<f64> = (0..length)
        .map(|k| {
            let x = k as f64 - half;
            let sinc = if x == 0.0 { width } else { libm::sin(PI * width * x) / (PI * x) };
            sinc * kaiser(x / (half + 0.5), beta)
        })
        .collect();
    let sum = low_pass.iter().fold(0.0, |sum, h| sum + h);
    // A real filter keeps both sides, each at full strength.
    let scale = if real { 2.0 } else { 1.0 } / sum;
    let carried = low_pass.iter().enumerate().map(|(k, h)| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * middle * (k as f64 - half));
        Complex64::new(cos, sin) * h * scale
    });
    carried.collect()
}

impl Stage for Filter {
    fn name(&self) -> &'static str {
        "filter"
    }

    fn describe(&self) -> String {
        let shape = match self.shape {
            Shape::BrickWall => "brick wall".to_owned(),
            Shape::Butterworth { order } => format!("Butterworth of order {order}"),
        };
        let delay_ns = 1e9 * self.group_delay_s;
        format!("{shape}, {} Hz wide, delay {delay_ns:.1} ns, {} taps", self.bandwidth_hz, self.taps())
    }

    fn spec(&self) -> Option<StageSpec> {
        let shape = match self.shape {
            Shape::BrickWall => FilterShape::BrickWall,
            Shape::Butterworth { order } => FilterShape::Butterworth { order },
        };
        let (bandwidth_hz, group_delay_s) = (self.bandwidth_hz, self.group_delay_s);
        Some(StageSpec::Filter(FilterSpec { shape, bandwidth_hz, group_delay_s, middle_hz: Some(self.middle_hz) }))
    }

    fn memory_samples(&self) -> usize {
        self.taps() - 1
    }

    fn act(&self, block: &mut Block<'_>) {
        let (i, q) = (block.i.to_vec(), block.q.to_vec());
        block.i.fill(0.0);
        block.q.fill(0.0);
        add(block.i, &i, &self.re, 1.0);
        if self.real {
            return;
        }
        add(block.q, &q, &self.re, 1.0);
        if self.im.iter().any(|h| *h != 0.0) {
            add(block.i, &q, &self.im, -1.0);
            add(block.q, &i, &self.im, 1.0);
        }
    }
}

/// Adds `sign` times the convolution of `input` with `taps`; before `input` there is silence. Tap by tap, so
/// that each sample's sum has one order however many samples are done at once.
fn add(output: &mut [f32], input: &[f32], taps: &[f32], sign: f32) {
    const PIECE: usize = 2048;
    for (piece, output) in output.chunks_mut(PIECE).enumerate() {
        let start = piece * PIECE;
        for (lag, tap) in taps.iter().enumerate() {
            let tap = sign * tap;
            let skip = lag.saturating_sub(start).min(output.len());
            let from = start + skip - lag.min(start + skip);
            let Some(input) = input.get(from..from + output.len() - skip) else { continue };
            for (sum, x) in output[skip..].iter_mut().zip(input) {
                *sum += tap * x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn acted(filter: &Filter, mut i: Vec<f32>, mut q: Vec<f32>) -> (Vec<f32>, Vec<f32>) {
        let mut block = Block::whole(0, &mut i, &mut q);
        filter.act(&mut block);
        (i, q)
    }

    #[test]
    fn a_wall_halves_the_amplitude_where_the_filter_says_and_keeps_its_edges() {
        for (rate_hz, if_hz, real) in [(10e6, 0.0, false), (10e6, 1.1e6, false), (12e6, 3e6, true)] {
            let filter = Filter::new(Shape::BrickWall, 2.5e6, rate_hz, if_hz, real).unwrap();
            let gain = |hz: f64| filter.response((if_hz + hz) / rate_hz).norm();
            for edge_hz in [-1.25e6, 1.25e6] {
                assert!((gain(edge_hz) - 0.5).abs() < 0.01, "{if_hz}: {}", gain(edge_hz));
            }
            // 80 dB of ripple and of side lobes.
            assert!((gain(0.0) - 1.0).abs() < 2e-4, "{}", gain(0.0));
            assert!((gain(1.15e6) - 1.0).abs() < 2e-4 && gain(1.35e6) < 2e-4);
        }
    }

    #[test]
    fn a_tone_comes_out_with_the_response_of_its_frequency() {
        let filter = Filter::new(Shape::Butterworth { order: 2 }, 3e6, 10e6, 1e6, false).unwrap();
        let cycles = 0.23;
        let tone = |n: usize| libm::sincos(std::f64::consts::TAU * cycles * n as f64);
        let (i, q) = acted(
            &filter,
            (0..9000).map(|n| tone(n).1 as f32).collect(),
            (0..9000).map(|n| tone(n).0 as f32).collect(),
        );
        let expected = filter.response(cycles);
        for n in [2047, 2048, 5000, 8999] {
            let found = Complex64::new(f64::from(i[n]), f64::from(q[n]));
            let carrier = Complex64::new(tone(n).1, tone(n).0);
            // Single precision: a few hundred products of 6e-8 each.
            assert!((found - expected * carrier).norm() < 1e-5, "{n}");
        }
    }

    #[test]
    fn a_band_that_does_not_fit_is_refused_with_the_one_that_does() {
        let wide = Filter::new(Shape::BrickWall, 11e6, 10e6, 0.0, false).unwrap_err();
        assert!(wide.to_string().contains("9523809"), "{wide}");
        // No memory for what is refused: the second response alone would have 10¹⁵ taps.
        for width_hz in [10.0, 1e-7] {
            for shape in [Shape::BrickWall, Shape::Butterworth { order: 4 }] {
                let narrow = Filter::new(shape, width_hz, 10e6, 0.0, false);
                assert!(matches!(narrow, Err(FilterError::Narrow { .. })));
            }
        }
        assert!(matches!(Filter::new(Shape::BrickWall, 3e6, 10e6, 1e6, true), Err(FilterError::Wide { .. })));
    }
}
