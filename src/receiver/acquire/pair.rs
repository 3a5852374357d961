//! Search by data and pilot together.
//!
//! Both components change sign from code period to code period, so a coherent sum is one period of one of
//! them, and the powers of both are added. The samples of a dwell are transformed once for every Doppler that
//! is a whole number of bins away: the spectrum is read from another bin on. Dwells begin at different
//! positions of the code, so a sign that turns in the middle of one turns elsewhere in another.

use std::f64::consts::TAU;

use num_complex::Complex;
use rayon::prelude::*;

use super::grid::Grid;
use crate::source::Block;

/// Parts of a bin to which a Doppler is met.
const PARTS: f64 = 64.0;
/// Values of a phase ramp whose products are all values.
const RAMP: usize = 64;

/// Samples of every dwell as spectra, one for each part of a bin that a Doppler needs.
pub(super) struct Transforms {
    parts: Vec<i64>,
    /// Number of the first bin that is kept.
    from: i64,
    /// `[part][dwell][bin]`, of the bins that Dopplers need.
    spectra: Vec<Vec<Vec<Complex<f32>>>>,
}

impl Grid {
    /// Position of a Doppler in the transform of a dwell: its bin, and the rest in parts of a bin.
    fn place(&self, doppler_hz: f64) -> (i64, i64) {
        let bins = self.frequency_hz(doppler_hz) / self.rate_hz * self.forward.len() as f64;
        let parts = (bins * PARTS).round() as i64;
        let bin = (bins - 0.25).round() as i64;
        (bin, parts - bin * PARTS as i64)
    }

    /// The transforms of all dwells.
    pub(super) fn transforms(&self, block: &Block, scale: f64) -> Transforms {
        let begins = self.dwells.begins();
        let places: Vec<(i64, i64)> = self.dopplers_hz.iter().map(|&doppler_hz| self.place(doppler_hz)).collect();
        let mut parts: Vec<i64> = places.iter().map(|place| place.1).collect();
        let (lowest, highest) =
            places.iter().fold((i64::MAX, i64::MIN), |(a, b), place| (a.min(place.0), b.max(place.0)));
        let (length, band) = (self.forward.len() as i64, self.inverse.len() as i64);
        let from = lowest - band / 2;
        let kept = (highest - lowest + band).min(length);
        parts.sort_unstable();
        parts.dedup();
        let wanted: Vec<(i64, f64)> =
            parts.iter().flat_map(|&part| begins.iter().map(move |&begin| (part, begin))).collect();
        let one = |&(part, begin): &(i64, f64)| {
            let length = self.forward.len();
            let (coarse, fine) = ramp(-(part as f64) / PARTS, length, 0, length);
            let first = (begin * self.period_samples).round() as usize;
            let samples = block.i.iter().zip(block.q).skip(first);
            let mut spectrum = vec![Complex::default(); length];
            for (n, (out, (i, q))) in spectrum.iter_mut().zip(samples).enumerate() {
                *out = Complex::new(*i, *q) * (coarse[n / RAMP] * fine[n % RAMP]) * scale as f32;
            }
            self.forward.process(&mut spectrum);
            (from..from + kept).map(|bin| spectrum[bin.rem_euclid(length as i64) as usize]).collect()
        };
        let spectra: Vec<Vec<Complex<f32>>> = wanted.par_iter().map(one).collect();
        let mut spectra = spectra.into_iter();
        let spectra = parts.iter().map(|_| spectra.by_ref().take(begins.len()).collect()).collect();
        Transforms { parts, from, spectra }
    }

    #[cfg(test)]
    pub fn spectrum_of_dwell(&self, block: &Block, doppler_hz: f64, dwell: usize) -> Vec<Complex<f32>> {
        let mut out = vec![Complex::default(); self.inverse.len()];
        self.shifted(&self.transforms(block, 1.0), doppler_hz, dwell, &mut out);
        out
    }

    /// The band of a dwell's spectrum around a Doppler, turned as if the dwell began with a code period of
    /// the satellite that began one with the first sample.
    pub(super) fn shifted(&self, transforms: &Transforms, doppler_hz: f64, dwell: usize, out: &mut [Complex<f32>]) {
        let (bin, part) = self.place(doppler_hz);
        let part = transforms.parts.binary_search(&part).unwrap_or(0);
        let kept = &transforms.spectra[part][dwell];
        let (length, band) = (self.forward.len(), self.inverse.len());
        let begin = self.dwells.begins()[dwell];
        let period = self.period_samples / (1.0 + doppler_hz / self.carrier_hz);
        let late = begin.round() * period - (begin * self.period_samples).round();
        let (positive, reach) = (band.div_ceil(2), length.div_ceil(2));
        let (above, below) = out.split_at_mut(positive);
        for (side, first) in [(above, 0_i64), (below, positive as i64 - band as i64)] {
            let (coarse, fine) = ramp(late, length, first, side.len());
            let mut place = (first + bin - transforms.from).rem_euclid(length as i64) as usize;
            for (n, out) in side.iter_mut().enumerate() {
                if (first + n as i64).unsigned_abs() < reach as u64 {
                    *out = kept[place] * (coarse[n / RAMP] * fine[n % RAMP]);
                }
                place = if place + 1 == length { 0 } else { place + 1 };
            }
        }
    }
}

/// e^{j2π·shift·n/length} for n = `first` … as products: entry n / [`RAMP`] of the one by entry n % [`RAMP`]
/// of the other.
fn ramp(shift: f64, length: usize, first: i64, count: usize) -> (Vec<Complex<f32>>, Vec<Complex<f32>>) {
    let at = |n: i64| {
        let turns = shift * n as f64 / length as f64;
        let (sin, cos) = libm::sincos(TAU * (turns - turns.floor()));
        Complex::new(cos as f32, sin as f32)
    };
    let coarse = (0..count.div_ceil(RAMP)).map(|k| at(first + (k * RAMP) as i64)).collect();
    (coarse, (0..RAMP as i64).map(at).collect())
}
