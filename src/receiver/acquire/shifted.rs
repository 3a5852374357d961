//! Spectra of code periods, and those that several Dopplers share: whole bins of a period apart they are the
//! same spectrum, shifted.
//!
//! The period is transformed once, from the sample at which it begins at the Doppler in their middle. What it
//! begins later at another is a turn of the spectrum, as fractions of a sample are: the circular sum's seam
//! is off by so much more, two samples in 20 000 at 5 kHz from the middle after 20 ms.

use std::f64::consts::TAU;

use num_complex::Complex;
use rayon::prelude::*;

use super::grid::Grid;
use super::kernel;
use crate::source::Block;

/// Largest distance of a shift from a whole bin, in bins. A period's sum then loses 0.0002 of its power.
const MOST_OFF: f64 = 0.008;
/// Spectra are kept up to so many bytes.
const MOST_BYTES: usize = 64 << 20;

/// Room for a spectrum, and for making it.
type Rooms<'a> = (&'a mut [Complex<f32>], &'a mut [Complex<f32>]);

impl Grid {
    /// Adds the spectrum of one code period with carrier removed, turned to where the period begins.
    pub fn add_period(
        &self,
        block: &Block,
        scale: f64,
        doppler_hz: f64,
        period: u32,
        (long, scratch): Rooms<'_>,
        spectrum: &mut [Complex<f32>],
    ) {
        self.transform(block, scale, doppler_hz, period, (&mut *long, scratch));
        let begins = self.begins(doppler_hz, period);
        for (first, bins, places) in self.band(long.len()) {
            self.add_turned(&mut spectrum[places], &long[bins], (first, begins - begins.round()), Complex::ONE);
        }
    }

    /// Samples before a code period of that Doppler.
    fn begins(&self, doppler_hz: f64, period: u32) -> f64 {
        f64::from(period) * self.period_samples / (1.0 + doppler_hz / self.carrier_hz)
    }

    /// The spectrum of one code period with carrier removed, from the sample on at which it begins.
    fn transform(&self, block: &Block, scale: f64, doppler_hz: f64, period: u32, (long, scratch): Rooms<'_>) {
        let first = self.begins(doppler_hz, period).round();
        let step = self.phasor(-self.frequency_hz(doppler_hz), 1);
        let rotation = self.phasor(-self.frequency_hz(doppler_hz), first as u64) * scale;
        let from = (first as usize).min(block.i.len().min(block.q.len()));
        kernel::mix(long, (&block.i[from..], &block.q[from..]), rotation, step);
        self.forward.process_with_scratch(long, scratch);
    }

    /// Adds `bins`, the first of which has that signed number, as they are so many samples later, turned by
    /// `by` too.
    fn add_turned(
        &self,
        sums: &mut [Complex<f32>],
        bins: &[Complex<f32>],
        (first, samples): (f64, f64),
        by: Complex<f64>,
    ) {
        let shift = |number: f64| {
            let (sin, cos) = libm::sincos(TAU * samples * number / self.forward.len() as f64);
            Complex::new(cos, sin)
        };
        kernel::add_turned(sums, bins, shift(first) * by, shift(1.0));
    }

    #[cfg(test)]
    pub fn spectrum_of_period(&self, block: &Block, doppler_hz: f64, period: u32) -> Vec<Complex<f32>> {
        let (mut long, mut sum) =
            (vec![Complex::default(); self.forward.len()], vec![Complex::default(); self.inverse.len()]);
        let mut scratch = vec![Complex::default(); self.forward.get_inplace_scratch_len()];
        self.add_period(block, 1.0, doppler_hz, period, (&mut long, &mut scratch), &mut sum);
        sum
    }
}

/// The band of every period's spectrum, a set for each group of Dopplers.
pub(super) struct Shifted {
    groups: usize,
    /// Bins beyond the band on either side.
    reach: usize,
    /// Spectra by group, then by period; each begins `reach` bins below the band's lowest bin.
    spectra: Vec<Vec<Complex<f32>>>,
}

impl Shifted {
    /// `None` where the Dopplers of a grid share too little, or there is no room.
    pub fn new(grid: &Grid, block: &Block, scale: f64) -> Option<Self> {
        let length = grid.forward.len();
        let bin_hz = grid.rate_hz / length as f64;
        let groups = (bin_hz / grid.step_hz).round() as usize;
        let (count, periods) = (grid.dopplers_hz.len(), grid.periods as usize);
        if groups == 0 || count < 2 * groups {
            return None;
        }
        let shifts = |bin: usize| (bins(grid, groups, bin), bins(grid, groups, bin).round());
        let off = (0..count).map(shifts).map(|(shift, whole)| (shift - whole).abs()).fold(0.0, f64::max);
        let reach = (0..count).map(shifts).map(|(_, whole)| whole.abs() as usize).max()?;
        let stored = grid.inverse.len() + 2 * reach;
        if off > MOST_OFF || stored * groups * periods * size_of::<Complex<f32>>() > MOST_BYTES {
            return None;
        }
        let [_, (lowest, ..)] = grid.band(length);
        let rooms = || {
            let scratch = vec![Complex::default(); grid.forward.get_inplace_scratch_len()];
            (vec![Complex::default(); length], scratch)
        };
        let one = |(long, scratch): &mut (Vec<_>, Vec<_>), number: usize| {
            let doppler_hz = middle_hz(grid, groups, number / periods);
            grid.transform(block, scale, doppler_hz, (number % periods) as u32, (long, scratch));
            let from = lowest as i64 - reach as i64;
            (from..from + stored as i64).map(|bin| long[bin.rem_euclid(length as i64) as usize]).collect()
        };
        let spectra = (0..groups * periods).into_par_iter().map_init(rooms, one).collect();
        Some(Self { groups, reach, spectra })
    }

    /// Adds the spectrum of one code period at Doppler number `bin` of the grid, turned to where the period
    /// begins.
    pub fn add_period(&self, grid: &Grid, bin: usize, period: u32, spectrum: &mut [Complex<f32>]) {
        let group = bin % self.groups;
        let (doppler_hz, middle_hz) = (grid.dopplers_hz[bin], middle_hz(grid, self.groups, group));
        let first = grid.begins(middle_hz, period).round();
        let fraction = grid.begins(doppler_hz, period) - first;
        let turned = grid.phasor(grid.frequency_hz(middle_hz) - grid.frequency_hz(doppler_hz), first as u64);
        let shift = bins(grid, self.groups, bin).round() as i64;
        let stored = &self.spectra[group * grid.periods as usize + period as usize];
        let [_, (lowest, ..)] = grid.band(grid.forward.len());
        for (first, range, places) in grid.band(grid.forward.len()) {
            let from = (first - lowest) as i64 + self.reach as i64 + shift;
            let bins = &stored[from as usize..from as usize + range.len()];
            grid.add_turned(&mut spectrum[places], bins, (first, fraction), turned);
        }
    }
}

/// The Doppler in the middle of a group.
fn middle_hz(grid: &Grid, groups: usize, group: usize) -> f64 {
    let members = (grid.dopplers_hz.len() - group).div_ceil(groups);
    grid.dopplers_hz[group + members / 2 * groups]
}

/// Shift of a Doppler's spectrum against that of its group's middle, in bins.
fn bins(grid: &Grid, groups: usize, bin: usize) -> f64 {
    let apart_hz = grid.frequency_hz(grid.dopplers_hz[bin]) - grid.frequency_hz(middle_hz(grid, groups, bin % groups));
    apart_hz * grid.forward.len() as f64 / grid.rate_hz
}
