//! Scatter of an estimated spectrum of a sweep that lasts about as long as a segment of the estimate.
//!
//! A segment shows what the sweep does within it. Its bin holds P(φ) = |Σ a_k e^(2πikφ)|², with φ the sweep's
//! phase in the segment's middle and a_k its lines under the window's transform. P has the harmonics
//! p_m = Σ a_(k+m) a_k*, and the mean over segments at phases φ0 + φ_s has p_m·H_m, where
//! H_m = mean of e^(2πimφ_s). The truth does not state φ0, so the estimate scatters by Σ 2|p_m H_m|²/p_0²
//! with m from 1. Limits: the phases φ_s are those of a resting antenna; sweeps longer than [`SEGMENTS`]
//! segments are not described.

use num_complex::Complex;

use crate::expect::jamming::turned;
use gnss::signal::sinc;

/// Longest sweep, in segments.
pub const SEGMENTS: f64 = 16.0;
/// Bins on either side of which lines count: the window's side lobes are 100 dB down there.
const REACH_BINS: f64 = 8.0;

/// Relative variance of the estimate at each frequency from the source's own, for segments that see the sweep
/// at `phases`, in cycles.
///
/// `lines` are the amplitudes of neighbouring lines, `repetition_hz` apart, with their frequencies.
pub fn wander(
    lines: &[(f64, Complex<f64>)],
    repetition_hz: f64,
    (offsets_hz, bin_hz): (impl Iterator<Item = f64>, f64),
    phases: &[f64],
) -> Vec<f64> {
    let most = (2.0 * REACH_BINS * bin_hz / repetition_hz) as usize + 1;
    // |H_m|² of each harmonic.
    let seen: Vec<f64> = (0..=most)
        .map(|m| {
            let turn = |phase: &f64| turned((m as f64 * phase).fract());
            (phases.iter().map(turn).sum::<Complex<f64>>() / phases.len().max(1) as f64).norm_sqr()
        })
        .collect();
    let of = |offset_hz: f64| {
        let first = lines.partition_point(|(hz, _)| *hz < offset_hz - REACH_BINS * bin_hz);
        let near = lines.get(first..).unwrap_or_default().iter();
        let near: Vec<Complex<f64>> = near
            .take_while(|(hz, _)| *hz <= offset_hz + REACH_BINS * bin_hz)
            .map(|(hz, line)| line * window((offset_hz - hz) / bin_hz))
            .collect();
        let harmonic = |m: usize| near.iter().skip(m).zip(&near).map(|(b, a)| b * a.conj()).sum::<Complex<f64>>();
        let mean = harmonic(0).re;
        if mean <= 0.0 {
            return 0.0;
        }
        let sum: f64 = (1..near.len()).zip(seen.iter().skip(1)).map(|(m, h)| 2.0 * harmonic(m).norm_sqr() * h).sum();
        sum / (mean * mean)
    };
    offsets_hz.map(of).collect()
}

/// Amplitude of a Hann window's transform, `x` bins from its middle.
fn window(x: f64) -> f64 {
    let edge = 1.0 - x * x;
    // At one bin sinc(x)/(1 − x²) is 1/2.
    if edge.abs() < 1e-6 { 0.5 } else { sinc(x) / edge }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines of one period of a sweep over `cycles` cycles, from a sum over its points.
    fn lines(cycles: f64, repetition_hz: f64) -> Vec<(f64, Complex<f64>)> {
        let points = 512;
        let line = |k: i32| {
            let at = |n: i32| {
                let x = f64::from(n) / f64::from(points);
                turned(0.5 * cycles * x * (x - 1.0) - f64::from(k) * x)
            };
            (f64::from(k) * repetition_hz, (0..points).map(at).sum::<Complex<f64>>() / f64::from(points))
        };
        (-60..60).map(line).collect()
    }

    #[test]
    fn the_scatter_is_that_of_segments_of_a_sweep_in_the_time_domain() {
        // A sweep of 40 kHz in 1 ms at 256 kHz, in segments of 128 samples: half of its length.
        let (rate_hz, size, repetition_hz, cycles) = (256e3, 128, 1e3, 40.0);
        let power = |offset_hz: f64, start: f64| {
            let at = |n: i32| {
                let t_s = (start + f64::from(n)) / rate_hz;
                let x = (t_s * repetition_hz).rem_euclid(1.0);
                let hann = 0.5 - 0.5 * turned(f64::from(n) / f64::from(size)).re;
                let turns = 0.5 * cycles * x * (x - 1.0) - offset_hz * t_s;
                hann * turned(turns)
            };
            (0..size).map(at).sum::<Complex<f64>>().norm_sqr()
        };
        // Three segments, half overlapped, at every phase.
        for offset_hz in [0.0, 7.3e3, -15e3] {
            let mean = |k: i32| (0..3).map(|j| power(offset_hz, f64::from(k) + f64::from(64 * j))).sum::<f64>() / 3.0;
            let all: Vec<f64> = (0..256).map(mean).collect();
            let mean = all.iter().sum::<f64>() / 256.0;
            let expected = all.iter().map(|one| (one / mean - 1.0).powi(2)).sum::<f64>() / 256.0;
            let phases = [0.0, 0.25, 0.5];
            let found = wander(&lines(cycles, 1e3), 1e3, (std::iter::once(offset_hz), 2e3), &phases)[0];
            assert!((found / expected - 1.0).abs() < 0.02 && expected > 0.1, "{offset_hz}: {found} {expected}");
        }
    }

    #[test]
    fn segments_at_all_phases_scatter_nothing() {
        let phases: Vec<f64> = (0..1000).map(|k| f64::from(k) / 1000.0).collect();
        let found = wander(&lines(40.0, 1e3), 1e3, (std::iter::once(3e3), 2e3), &phases);
        assert!(found[0] < 1e-20, "{found:?}");
    }
}
