//! Sources of the coherent sums of a search.

use num_complex::Complex;

use super::grid::Grid;
use super::pair::Transforms;
use super::shifted::Shifted;
use crate::source::Block;

/// Samples from which the coherent sums of any Doppler are made.
pub(super) enum Sums<'a> {
    /// Sums of data and pilot together.
    Pair(Transforms),
    /// Sums of one code, from spectra that Dopplers share.
    Shared(Shifted),
    /// Sums of one code, where Dopplers share no spectra.
    Alone { block: &'a Block<'a>, scale: f64 },
}

impl<'a> Sums<'a> {
    pub fn new(grid: &Grid, block: &'a Block<'a>, scale: f64, everywhere: bool) -> Self {
        if grid.is_pair {
            return Self::Pair(grid.transforms(block, scale));
        }
        let shared = if everywhere { Shifted::new(grid, block, scale) } else { None };
        shared.map_or(Self::Alone { block, scale }, Self::Shared)
    }

    /// Function that makes the spectrum of one dwell after the other at a Doppler.
    pub fn at<'b>(&'b self, grid: &'b Grid, bin: usize) -> impl FnMut(usize, &mut [Complex<f32>]) + 'b {
        let doppler_hz = grid.dopplers_hz[bin];
        let (mut long, mut scratch) = (Vec::new(), Vec::new());
        move |dwell, spectrum| {
            let first = dwell as u32 * grid.coherent_periods;
            let periods = first..first + grid.coherent_periods;
            match self {
                Self::Pair(transforms) => grid.shifted(transforms, doppler_hz, dwell, spectrum),
                Self::Shared(shifted) => periods.for_each(|period| shifted.add_period(grid, bin, period, spectrum)),
                Self::Alone { block, scale } => {
                    long.resize(grid.forward.len(), Complex::default());
                    scratch.resize(grid.forward.get_inplace_scratch_len(), Complex::default());
                    for period in periods {
                        let rooms = (&mut long[..], &mut scratch[..]);
                        grid.add_period(block, *scale, doppler_hz, period, rooms, spectrum);
                    }
                }
            }
        }
    }
}
