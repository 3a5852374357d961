//! Welch's estimate of a spectrum: its expectation, its scatter, and the samples it uses.
//!
//! Segments of N samples under a periodic Hann window w overlap by half (Welch 1967). The expectation is the
//! spectrum convolved with the window's. In lags it is the autocorrelation times the window's own, a(τ) = Σ
//! w(n)·w(n − τ).
//!
//! **Scatter** of Gaussian samples whose spectrum is smooth over a bin. Bins l apart in segments D samples
//! apart have the correlation |Σ w(n)·w(n − D)·e^(2πi·l·n/N)|²/(Σ w²)². The same bin of two neighbouring
//! segments has (1/6)² = 1/36, so that the mean of K segments has the relative variance 19/18/K. Over all l
//! these sum to N·Σ w²(n)·w²(n − D)/(Σ w²)² (Parseval): 35/18 in a segment, 1/12 with each neighbour. The
//! mean of n bins has (35/18 + 2/12)/(nK) = 19/9/(nK), less at its ends. Limits: segments further apart do
//! not overlap. A sum over few bins is taken as one over many, which is at most 2 % too large.

use std::ops::Range;

/// Points of the estimate.
pub const BINS: usize = 2048;
/// Length of the samples that are looked at, seconds.
pub(super) const LOOKED_S: f64 = 0.2;
/// Pieces that share it where the spectrum changes.
const PIECES: u64 = 60;
/// Relative variance of one bin, for one segment.
const ONE: f64 = 19.0 / 18.0;
/// Relative variance of the mean of many bins, for one segment and one bin.
const MANY: f64 = 19.0 / 9.0;

/// Samples of the estimate: the signal's start, or pieces spread over a scene whose spectrum changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Looks {
    /// Samples of a piece.
    pub length: u64,
    /// Distance from the start of one piece to that of the next, samples.
    pub stride: u64,
    /// Number of the segments.
    pub pieces: u64,
}

impl Looks {
    /// Pieces of `samples` samples at the rate `rate_hz`.
    pub fn at(samples: u64, rate_hz: f64, changing: bool) -> Self {
        let pieces = if changing { PIECES } else { 1 };
        let length = (LOOKED_S * rate_hz) as u64 / pieces;
        Self { length, stride: (samples / pieces).max(length), pieces }
    }

    /// Each of them, as far as there are samples.
    pub fn pieces(&self, samples: u64) -> impl Iterator<Item = Range<u64>> + '_ {
        let piece = move |number: u64| {
            let from = (number * self.stride).min(samples);
            from..(from + self.length).min(samples)
        };
        (0..self.pieces).map(piece).filter(|piece| !piece.is_empty())
    }

    /// Segments of so many bins in all of them.
    pub fn segments(&self, samples: u64, bins: usize) -> u64 {
        let (bins, half) = (bins as u64, bins as u64 / 2);
        self.pieces(samples)
            .map(|piece| (piece.end - piece.start).checked_sub(bins).map_or(0, |more| more / half + 1))
            .sum()
    }
}

/// Relative variance of the mean of `bins` neighbouring bins over `segments` segments.
pub fn variance(bins: usize, segments: f64) -> f64 {
    if bins == 1 { ONE / segments } else { MANY / (bins as f64 * segments) }
}

/// a(τ)/a(0) of a periodic Hann window of `bins` samples, for lags from 0 to `bins` − 1.
pub fn autocorrelation(bins: usize) -> Vec<f64> {
    // w = ½ − ½·cos(x), x = 2πn/N. Over the N − τ samples that overlap the products of cosines are sums of
    // geometric series; summed as they are, they take N² steps, a few milliseconds.
    let window: Vec<f64> =
        (0..bins).map(|n| 0.5 - 0.5 * libm::cos(std::f64::consts::TAU * n as f64 / bins as f64)).collect();
    let at = |lag: usize| window.iter().zip(window.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
    let whole = at(0);
    (0..bins).map(|lag| at(lag) / whole).collect()
}

/// Effective width of a bin against lines or chips of fixed power, in bins: 1/∫|W|⁴ of the window's unit
/// power spectrum.
pub const WIDTH_BINS: f64 = 2.0786;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlations_of_segments_and_bins_are_those_of_the_text() {
        let bins = 256;
        let window = |n: usize| {
            let sin = libm::sin(std::f64::consts::PI * n as f64 / bins as f64);
            sin * sin
        };
        let power: f64 = (0..bins).map(|n| window(n) * window(n)).sum();
        let pair = |apart: usize, l: usize| {
            let turn = std::f64::consts::TAU * l as f64 / bins as f64;
            let (re, im) = (apart..bins).fold((0.0, 0.0), |(re, im), n| {
                let (sin, cos) = libm::sincos(turn * n as f64);
                let product = window(n) * window(n - apart);
                (re + product * cos, im + product * sin)
            });
            (re * re + im * im) / (power * power)
        };
        assert!((pair(bins / 2, 0) - 1.0 / 36.0).abs() < 1e-9);
        let all = |apart: usize| (0..bins).map(|l| pair(apart, l)).sum::<f64>();
        assert!((all(0) - 35.0 / 18.0).abs() < 1e-9 && (all(bins / 2) - 1.0 / 12.0).abs() < 1e-9);
        let found = autocorrelation(bins);
        assert!((found[bins / 2] - 1.0 / 6.0).abs() < 1e-9 && (found[0] - 1.0).abs() < 1e-12);
        // ∫|W|⁴ over (∫|W|²)², by Parseval the sum of the squared autocorrelation.
        let squares = 2.0 * found.iter().map(|a| a * a).sum::<f64>() - 1.0;
        assert!((bins as f64 / squares - WIDTH_BINS).abs() < 1e-2, "{}", bins as f64 / squares);
    }

    #[test]
    fn looks_are_at_the_start_or_all_over_and_count_their_segments() {
        let start = Looks::at(26_000_000, 2.6e6, false);
        assert!(start.pieces(26_000_000).eq(std::iter::once(0..520_000)));
        // 520 000 = 2048 + 505 · 1024 + 832.
        assert_eq!(start.segments(26_000_000, BINS), 506);
        let spread = Looks::at(26_000_000, 2.6e6, true);
        assert_eq!(spread.pieces(26_000_000).count(), 60);
        assert_eq!(spread.pieces(26_000_000).last(), Some(59 * 433_333..59 * 433_333 + 8666));
        assert_eq!(spread.segments(26_000_000, BINS), 60 * 7);
        assert_eq!(Looks::at(1000, 2.6e6, false).segments(1000, BINS), 0);
    }
}
