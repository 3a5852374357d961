//! Search by data and pilot together, for satellites that are mostly absent.
//!
//! Both components change sign from code period to code period, so a coherent sum is one period of one of
//! them, and the powers of both are added. Three things make it cheap. The samples of a dwell are transformed
//! once for every Doppler that is a whole number of bins away: the spectrum is read from another bin on. A
//! satellite's Doppler is left after a few dwells where its largest cell says that nothing is there. Dwells
//! begin at different places of the code, so a sign that turns in the middle of one turns elsewhere in
//! another.
//!
//! **Leaving.** After a dwell a Doppler stays where its largest cell exceeds what that of noise exceeds with
//! the probability in [`STAY`]. The threshold of all dwells is that of a search which leaves nothing, so
//! false alarms come no more often. Detections: of ten dwells by the pilot alone eight dwells by both keep as
//! many, at any C/N0 (model of signs, Doppler and lag in the tests of this module). Where cross-correlation
//! raises a Doppler for all codes, many of them stay; then all do, and [`super::multiple_access`] judges
//! whole columns.

use std::f64::consts::TAU;

use num_complex::Complex;
use rayon::prelude::*;

use super::grid::{Grid, Strip};
use super::kernel;
use crate::receiver::source::Block;
use crate::receiver::threshold::{of_one_cell, threshold};

/// Dwells for each ten code periods that the search looks at.
const DWELLS: f64 = 0.8;
/// Probability that noise stays after the first dwell, the second and so on; the last holds for all others.
const STAY: [f64; 7] = [1.0, 0.25, 0.12, 0.06, 0.03, 0.02, 0.01];
/// Share of all codes that stay from which a Doppler is searched to its end for every code.
const MANY: f64 = 0.4;
/// Fewer codes are no sample.
const LEAST_CODES: usize = 12;
/// Parts of a bin to which a Doppler is met.
const PARTS: f64 = 64.0;
/// Values of a phase ramp whose products are all values.
const RAMP: usize = 64;

/// When the dwells of a search by two components begin, and where a Doppler is left.
pub(super) struct Dwells {
    /// Code periods from the first sample to each, in the order in which they are looked at.
    begins: Vec<f64>,
    /// What the largest cell has to exceed after each dwell, in units of half a sum's noise power.
    stay: Vec<f64>,
}

/// Conjugate spectra of a satellite's two codes.
pub(super) type Spectra<'a> = [&'a [Complex<f32>]; 2];

/// Samples of every dwell as spectra, one for each part of a bin that a Doppler needs.
struct Transforms {
    parts: Vec<i64>,
    /// `[part][dwell][bin]`.
    spectra: Vec<Vec<Vec<Complex<f32>>>>,
}

/// What a thread works in.
struct Scratch {
    fft: Vec<Complex<f32>>,
    short: Vec<Complex<f32>>,
    powers: Vec<f32>,
}

impl Dwells {
    /// Within so many code periods, of maps with so many cells.
    pub fn new(periods: u32, lags: usize) -> Self {
        let count = (DWELLS * f64::from(periods)).ceil().max(1.0) as u32;
        let apart = f64::from(periods - 1) / f64::from((count - 1).max(1));
        let mut begins: Vec<f64> = (0..count).map(|dwell| f64::from(dwell) * apart).collect();
        // The second one that is looked at begins about half a period from the first.
        if begins.len() > 3 {
            begins.swap(1, 2);
        }
        let bar = |dwell: usize| {
            let probability = STAY.get(dwell).or(STAY.last()).copied().unwrap_or(1.0);
            let sums = 2 * (dwell as u32 + 1);
            if probability < 1.0 { threshold(of_one_cell(probability, lags as f64), 2 * sums) } else { 0.0 }
        };
        let stay = (0..begins.len()).map(bar).collect();
        Self { begins, stay }
    }

    #[cfg(test)]
    pub fn begins(&self) -> &[f64] {
        &self.begins
    }

    #[cfg(test)]
    pub fn stay(&self) -> &[f64] {
        &self.stay
    }

    /// Powers that are added.
    pub fn sums(&self) -> u32 {
        2 * self.begins.len() as u32
    }
}

impl Grid {
    /// One strip for every Doppler and satellite. Those that were left have fewer sums, but of every
    /// satellite one has them all.
    pub fn strips_of_pairs(
        &self,
        dwells: &Dwells,
        block: &Block,
        scale: f64,
        spectra: &[Spectra<'_>],
    ) -> Vec<Vec<Strip>> {
        let transforms = self.transforms(dwells, block, scale);
        let mut strips: Vec<Vec<Strip>> = (self.dopplers_hz.par_iter())
            .map(|&doppler_hz| self.column(dwells, &transforms, doppler_hz, spectra))
            .collect();
        let whole = self.sums;
        let missing: Vec<(usize, usize)> = (0..spectra.len())
            .filter(|&satellite| strips.iter().all(|column| column[satellite].sums < whole))
            .filter_map(|satellite| {
                let height = |bin: &usize| strips[*bin][satellite].peak;
                let best = (0..strips.len()).max_by(|a, b| height(a).total_cmp(&height(b)))?;
                Some((best, satellite))
            })
            .collect();
        let found: Vec<Strip> = missing
            .par_iter()
            .map(|&(bin, satellite)| {
                let mut data = vec![None; dwells.begins.len()];
                let to = (&transforms, self.dopplers_hz[bin]);
                self.map(dwells, to, &mut data, &spectra[satellite], true, &mut self.scratch())
            })
            .collect();
        for ((bin, satellite), strip) in missing.into_iter().zip(found) {
            strips[bin][satellite] = strip;
        }
        strips
    }

    fn scratch(&self) -> Scratch {
        Scratch {
            fft: vec![Complex::default(); self.inverse.get_inplace_scratch_len()],
            short: vec![Complex::default(); self.inverse.len()],
            powers: vec![0.0; self.lags],
        }
    }

    /// All satellites at one Doppler.
    fn column(&self, dwells: &Dwells, transforms: &Transforms, doppler_hz: f64, spectra: &[Spectra<'_>]) -> Vec<Strip> {
        let mut scratch = self.scratch();
        let mut data = vec![None; dwells.begins.len()];
        let to = (transforms, doppler_hz);
        let all = self.meets_image(doppler_hz);
        let mut column: Vec<Strip> =
            spectra.iter().map(|codes| self.map(dwells, to, &mut data, codes, all, &mut scratch)).collect();
        let first_left = column.iter().map(|strip| strip.sums).min().unwrap_or(0);
        let stayed = column.iter().filter(|strip| strip.sums > first_left).count();
        if column.len() >= LEAST_CODES && stayed as f64 >= MANY * column.len() as f64 {
            for (strip, codes) in column.iter_mut().zip(spectra) {
                if strip.sums < self.sums {
                    *strip = self.map(dwells, to, &mut data, codes, true, &mut scratch);
                }
            }
        }
        column
    }

    /// One satellite at one Doppler, dwell by dwell until it is left. The peak of what was left is what it
    /// reached of the bar.
    fn map(
        &self,
        dwells: &Dwells,
        (transforms, doppler_hz): (&Transforms, f64),
        data: &mut [Option<Vec<Complex<f32>>>],
        codes: &Spectra<'_>,
        to_the_end: bool,
        scratch: &mut Scratch,
    ) -> Strip {
        scratch.powers.fill(0.0);
        for (dwell, (slot, &bar)) in data.iter_mut().zip(&dwells.stay).enumerate() {
            let spectrum = slot.get_or_insert_with(|| self.shifted(dwells, transforms, doppler_hz, dwell));
            for code in codes {
                kernel::multiply(&mut scratch.short, spectrum, code);
                self.inverse.process_with_scratch(&mut scratch.short, &mut scratch.fft);
                kernel::add_powers(&mut scratch.powers, &scratch.short);
            }
            let sums = 2 * (dwell as u32 + 1);
            if to_the_end || bar == 0.0 || sums == self.sums {
                continue;
            }
            let (peak, total) = kernel::peak_and_total(&scratch.powers);
            let floor = total / (2.0 * f64::from(sums) * scratch.powers.len() as f64);
            if f64::from(peak) <= bar * floor {
                let reached = if floor > 0.0 { f64::from(peak) / (bar * floor) } else { 0.0 };
                return Strip { peak: reached as f32, lag: 0, total: 0.0, near: 0.0, near_cells: 0, sums };
            }
        }
        self.strip(&scratch.powers)
    }

    /// Where a Doppler appears in the transform of a dwell: its bin, and the parts of a bin beyond that.
    fn place(&self, doppler_hz: f64) -> (i64, i64) {
        let bins = self.frequency_hz(doppler_hz) / self.rate_hz * self.forward.len() as f64;
        let parts = (bins * PARTS).round() as i64;
        let bin = (bins - 0.25).round() as i64;
        (bin, parts - bin * PARTS as i64)
    }

    fn transforms(&self, dwells: &Dwells, block: &Block, scale: f64) -> Transforms {
        let mut parts: Vec<i64> = self.dopplers_hz.iter().map(|&doppler_hz| self.place(doppler_hz).1).collect();
        parts.sort_unstable();
        parts.dedup();
        let wanted: Vec<(i64, f64)> =
            parts.iter().flat_map(|&part| dwells.begins.iter().map(move |&begin| (part, begin))).collect();
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
            spectrum
        };
        let spectra: Vec<Vec<Complex<f32>>> = wanted.par_iter().map(one).collect();
        let mut spectra = spectra.into_iter();
        let spectra = parts.iter().map(|_| spectra.by_ref().take(dwells.begins.len()).collect()).collect();
        Transforms { parts, spectra }
    }

    #[cfg(test)]
    pub fn spectrum_of_dwell(&self, block: &Block, doppler_hz: f64, dwell: usize) -> Vec<Complex<f32>> {
        let dwells = self.pair.as_ref().unwrap();
        self.shifted(dwells, &self.transforms(dwells, block, 1.0), doppler_hz, dwell)
    }

    /// The band of a dwell's spectrum around a Doppler, turned as if the dwell began with a code period of
    /// the satellite that began one with the first sample.
    fn shifted(&self, dwells: &Dwells, transforms: &Transforms, doppler_hz: f64, dwell: usize) -> Vec<Complex<f32>> {
        let (bin, part) = self.place(doppler_hz);
        let part = transforms.parts.binary_search(&part).unwrap_or(0);
        let long = &transforms.spectra[part][dwell];
        let (length, band) = (long.len(), self.inverse.len());
        let begin = dwells.begins[dwell];
        let period = self.period_samples / (1.0 + doppler_hz / self.carrier_hz);
        let late = begin.round() * period - (begin * self.period_samples).round();
        let (positive, reach) = (band.div_ceil(2), length.div_ceil(2));
        let mut out = vec![Complex::default(); band];
        let (above, below) = out.split_at_mut(positive);
        for (side, first) in [(above, 0_i64), (below, positive as i64 - band as i64)] {
            let (coarse, fine) = ramp(late, length, first, side.len());
            let mut place = (first + bin).rem_euclid(length as i64) as usize;
            for (n, out) in side.iter_mut().enumerate() {
                if (first + n as i64).unsigned_abs() < reach as u64 {
                    *out = long[place] * (coarse[n / RAMP] * fine[n % RAMP]);
                }
                place = if place + 1 == length { 0 } else { place + 1 };
            }
        }
        out
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
