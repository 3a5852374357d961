//! The search proper: correlation with every code phase at once by FFT, for every Doppler.
//!
//! A dwell is a coherent sum over whole code periods. Each period is transformed by itself, from the sample
//! at which the code of that Doppler says it begins, turned to a fraction of a sample, and the spectra are
//! added, so neither a period of broken samples nor code Doppler smears the sum. Correlation is circular over
//! one period: with a period that is no whole number of samples its seam is off by at most half a sample, and
//! a data bit may turn anywhere within a dwell (it takes two thirds of that dwell's power on average). Only
//! the band of the code's main lobe goes back to lags.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use fft::{Fft, Planner};
use num_complex::Complex;
use rayon::prelude::*;

use super::Acquired;
use super::dwells::{Dwells, Room, Rooms, Spectra};
use super::kernel::Spectrum;
use super::multiple_access::{Law, Raised};
use super::powers;
use super::refine::{self, Refined};
use super::replica::Replica;
use super::settings::AcquisitionSettings;
use super::sums::Sums;
use crate::correlate::steps_of_chip;
use crate::source::Block;
use crate::threshold::{of_one_cell, threshold};
use gnss::samples::IfMetadata;
use gnss::signal::Component;

/// Cells within this of a peak are not noise.
const PEAK_CHIPS: f64 = 2.0;
/// The band that goes back to lags, over the one asked for or that of the samples, is this at least.
const BAND_SHARE: f64 = 0.98;

/// Everything about one signal's search that does not depend on the samples.
pub(super) struct Grid {
    /// Samples of one code period without Doppler.
    pub period_samples: f64,
    pub chips_per_sample: f64,
    pub rate_hz: f64,
    /// Intermediate frequency of the carrier in hertz. For one sideband of a sub-carrier it is the middle of
    /// that sideband.
    if_hz: f64,
    /// Frequency in the samples for each hertz of the carrier: negative in an inverted spectrum.
    doppler_sign: f64,
    pub(super) carrier_hz: f64,
    /// Code periods in a coherent sum.
    pub coherent_periods: u32,
    pub sums: u32,
    /// Code periods that the search looks at.
    pub periods: u32,
    pub(super) dwells: Dwells,
    /// True if data and pilot are searched for together.
    pub(super) is_pair: bool,
    pub dopplers_hz: Vec<f64>,
    /// Step between Dopplers, in hertz.
    pub step_hz: f64,
    /// Number of cells in one code period.
    pub lags: usize,
    /// Samples from one cell to the next. There is another cell between any two.
    pub lag_samples: f64,
    /// Independent cells that have the same law.
    pub cells: usize,
    /// Law of the threshold that a satellite's statistic has to exceed, by Doppler.
    pub(super) law: Law,
    /// Dwells after which a Doppler may be left for the first time, and the law then. Used for one code
    /// alone.
    pub(super) early: Option<(usize, Law)>,
    /// Factor of the statistic where a real recording's noise is not circular.
    pub(super) image_scale: f64,
    is_real: bool,
    pub(super) forward: Arc<dyn Fft<f32>>,
    pub(super) inverse: Arc<dyn Fft<f32>>,
}

/// The outcome for one satellite.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    /// Statistic of the largest cell, in units in which noise alone is chi-square with 2K degrees of freedom.
    pub statistic: f64,
    /// Threshold of the statistic at this Doppler.
    pub threshold: f64,
    /// True if no law of this Doppler would make the peak cross-correlation.
    pub is_sure: bool,
    pub doppler_hz: f64,
    /// Delay in halves of a cell.
    pub half_lag: usize,
}

/// The outcome for all satellites.
pub(super) struct Peaks {
    pub of: Vec<Peak>,
    /// Numbers of the Dopplers at which cross-correlation raises the cells of all codes.
    pub crowded: Vec<usize>,
    pub map: Map,
}

/// Results of a search that the next search in the same samples uses.
#[derive(Clone, Default)]
pub(super) struct Map {
    /// Strips by Doppler, then by satellite.
    pub(super) strips: Vec<Vec<Strip>>,
    /// Effect of cross-correlation by Doppler, as far as the first dwells showed it.
    pub(super) raised: Vec<Raised>,
    /// Scale factor of the samples.
    scale: f64,
}

/// A search again: of some satellites at all Dopplers, of the others at some, and what else was seen before
/// stays.
pub(super) struct Again<'a> {
    pub before: &'a Map,
    /// Numbers of the Dopplers for all satellites.
    pub dopplers: &'a [usize],
    /// Indices of the satellites in the earlier search. The flag is true for a satellite that is searched at
    /// all Dopplers.
    pub satellites: &'a [(usize, bool)],
}

impl Map {
    /// Takes over what a later search saw of some satellites.
    pub fn update(&mut self, satellites: &[(usize, bool)], later: &Self) {
        for (all, some) in self.strips.iter_mut().zip(&later.strips) {
            for ((satellite, _), strip) in satellites.iter().zip(some) {
                if let Some(place) = all.get_mut(*satellite) {
                    *place = *strip;
                }
            }
        }
    }
}

/// One satellite at one Doppler: the largest cell, and sums over all cells and over those near it, without
/// those between.
#[derive(Clone, Copy)]
pub(super) struct Strip {
    pub peak: f32,
    /// Delay in halves of a cell.
    pub half_lag: usize,
    pub total: f64,
    pub near: f64,
    pub near_cells: usize,
    /// Powers in every cell: fewer than all where the Doppler was left.
    pub sums: u32,
}

/// Samples up to the last lag of the last dwell, at the code rate of the slowest code over the nominal one.
pub(super) fn samples_needed(period_samples: f64, coherent_periods: f64, sums: u32, slowest: f64) -> u64 {
    let coherent_samples = coherent_periods * period_samples;
    let last_begins = f64::from(sums - 1) * coherent_samples / slowest;
    last_begins.ceil() as u64 + coherent_samples.round() as u64 + period_samples.ceil() as u64
}

/// Steps of a replica a second: cells are theirs, as its correlation is as narrow as they are.
fn step_rate_hz(component: &Component) -> Option<f64> {
    component.strongest()?;
    Some(component.chip_rate_hz * steps_of_chip(component) as f64)
}

impl Grid {
    pub fn new(
        (component, is_pair, carrier_hz): (&Component, bool, f64),
        metadata: &IfMetadata,
        settings: &AcquisitionSettings,
        centre_hz: f64,
        planner: &mut Planner<f32>,
    ) -> Option<Self> {
        let rate_hz = metadata.rate.hz();
        let period_samples = component.period_s() * rate_hz;
        let coherent_periods = settings.periods(component);
        let periods = f64::from(coherent_periods);
        let length = (period_samples.round() as usize).max(2);
        let narrow = settings.cells_per_chip * step_rate_hz(component)? / rate_hz * length as f64;
        // A hair of the band is given for a length that transforms faster.
        let band = fast_length((BAND_SHARE * narrow.min(length as f64)).ceil() as usize);
        let lag_samples = length as f64 / band as f64;
        let step_hz = settings.doppler_step_cycles / (periods * component.period_s());
        let side = (settings.doppler_max_hz / step_hz).ceil() as i64;
        let centre = (centre_hz / step_hz).round() as i64;
        let dopplers_hz: Vec<f64> = (centre - side..=centre + side).map(|bin| bin as f64 * step_hz).collect();
        let cell_s = lag_samples / rate_hz;
        let shape = refine::searched_shape(component);
        let cells = powers::independent(band, shape.correlation(cell_s) / shape.correlation(0.0));
        let per_cell = of_one_cell(settings.false_alarm_probability, (cells * dopplers_hz.len()) as f64);
        let looked = settings.sums(component);
        let dwells =
            if is_pair { Dwells::of_pair(looked, cells) } else { Dwells::alone(looked, coherent_periods, cells) };
        let sums = dwells.sums();
        // One degree of freedom a sum, with the same mean.
        let image_scale = threshold(per_cell, 2 * sums) / (2.0 * threshold(per_cell, sums));
        let bins = dopplers_hz.len();
        let of_sums = |sums| Law::new(settings.false_alarm_probability, cells, bins, sums, image_scale);
        let early = dwells.first_bar().filter(|_| !is_pair).map(|made| (made, of_sums(dwells.sums_after(made))));
        let side_hz = component.side_hz();
        let share = 1.0 + side_hz / carrier_hz;
        Some(Self {
            period_samples,
            chips_per_sample: component.chip_rate_hz / rate_hz,
            rate_hz,
            if_hz: metadata.if_hz(carrier_hz + side_hz),
            doppler_sign: if metadata.inverted { -share } else { share },
            carrier_hz,
            coherent_periods,
            sums,
            periods: looked * coherent_periods,
            dwells,
            is_pair,
            dopplers_hz,
            step_hz,
            lags: band,
            lag_samples,
            cells,
            law: of_sums(sums),
            early,
            image_scale,
            is_real: !metadata.format.is_complex(),
            forward: planner.plan_fft_forward(length),
            inverse: planner.plan_fft_inverse(band),
        })
    }

    /// Samples that a search looks at.
    pub fn samples_needed(&self) -> u64 {
        let slowest_hz = self.dopplers_hz.first().copied().unwrap_or(0.0);
        let sums = self.periods / self.coherent_periods;
        let periods = f64::from(self.coherent_periods);
        samples_needed(self.period_samples, periods, sums, 1.0 + slowest_hz / self.carrier_hz)
    }

    /// True if the carrier is so near its own image that a coherent sum's noise has one degree of freedom
    /// instead of two. Images of a real recording lie at multiples of half the rate.
    pub(super) fn meets_image(&self, doppler_hz: f64) -> bool {
        let turns = 2.0 * self.frequency_hz(doppler_hz) / self.rate_hz;
        let coherent_samples = f64::from(self.coherent_periods) * self.period_samples;
        self.is_real && (turns - turns.round()).abs() * coherent_samples < 0.75
    }

    /// Conjugate spectrum of a satellite's code, over the band. Sample n covers the phases from n to n + 1
    /// samples.
    pub fn spectrum(&self, replica: &Replica) -> Spectrum {
        let mut buffer = vec![Complex::default(); self.forward.len()];
        let mut means = vec![0.0; self.forward.len()];
        replica.means(0.0, self.chips_per_sample, &mut means);
        // Scaled so that powers stay near one whatever the length.
        let scale = 1.0 / self.forward.len() as f32;
        for (sample, mean) in buffer.iter_mut().zip(means) {
            *sample = Complex::new(mean * scale, 0.0);
        }
        self.forward.process(&mut buffer);
        let mut spectrum = vec![Complex::default(); self.inverse.len()];
        for (_, bins, places) in self.band(buffer.len()) {
            spectrum[places].iter_mut().zip(&buffer[bins]).for_each(|(own, bin)| *own = bin.conj());
        }
        Spectrum::of(&spectrum)
    }

    /// The bins of a long spectrum within the band, those from zero on and those below: the signed number of
    /// the first, their positions, and those in the order of the short transform. The others of the short one
    /// have none.
    pub(super) fn band(&self, length: usize) -> [(f64, Range<usize>, Range<usize>); 2] {
        let band = self.inverse.len();
        let (positive, reach) = (band.div_ceil(2), length.div_ceil(2));
        let above = positive.min(reach);
        let below = (band - positive).min(reach.saturating_sub(1));
        [(0.0, 0..above, 0..above), (-(below as f64), length - below..length, band - below..band)]
    }

    /// The largest cell of every satellite, in their order; `again` after something was subtracted from the
    /// samples.
    pub fn search(&self, block: &Block, spectra: &[Spectra<'_>], again: Option<&Again<'_>>, rooms: &Rooms) -> Peaks {
        let power: f64 = block.i.iter().chain(block.q).map(|x| f64::from(x * x)).sum();
        let rms = (power / block.i.len().max(1) as f64).sqrt();
        if rms == 0.0 {
            let none =
                Peak { statistic: 0.0, threshold: self.law.threshold, is_sure: false, doppler_hz: 0.0, half_lag: 0 };
            return Peaks { of: vec![none; spectra.len()], crowded: Vec::new(), map: Map::default() };
        }
        // What is compared with strips of before has their scale.
        let again = again.filter(|_| !self.is_pair);
        let scale = again.map_or(1.0 / rms, |again| again.before.scale);
        let everywhere = again.is_none_or(|again| again.satellites.iter().any(|(_, everywhere)| *everywhere));
        let sums = Sums::new(self, block, scale, everywhere);
        let column = |bin: usize, spectra: &[Spectra<'_>], room: &mut Room| {
            self.column(self.dopplers_hz[bin], spectra, &mut sums.at(self, bin), room)
        };
        let one = |room: &mut Room, bin: usize| match again {
            Some(again) if !again.dopplers.contains(&bin) => {
                let wanted = |number: usize| again.satellites.get(number).is_some_and(|(_, everywhere)| *everywhere);
                let some: Vec<Spectra<'_>> = (0..).zip(spectra).filter(|(n, _)| wanted(*n)).map(|(_, s)| *s).collect();
                let (seen, raised) =
                    if some.is_empty() { (Vec::new(), Raised::Perhaps) } else { column(bin, &some, room) };
                let mut seen = seen.into_iter();
                let before = |satellite: usize| again.before.strips.get(bin)?.get(satellite).copied();
                let strips = (again.satellites.iter())
                    .filter_map(|(satellite, everywhere)| if *everywhere { seen.next() } else { before(*satellite) })
                    .collect();
                (strips, raised)
            }
            _ => column(bin, spectra, room),
        };
        let (strips, raised) =
            (0..self.dopplers_hz.len()).into_par_iter().map(|bin| rooms.with(self, |room| one(room, bin))).unzip();
        let mut map = Map { strips, raised, scale };
        let missing = self.missing(&map.strips, spectra.len());
        self.complete(&mut map.strips, &missing, spectra, &sums, rooms);
        // Satellites that are not looked at again were seen beside what has been subtracted since.
        let old = |bin: usize, satellite: usize| {
            let again = again.filter(|again| !again.dopplers.contains(&bin));
            again.and_then(|again| again.satellites.get(satellite)).is_some_and(|(_, everywhere)| !everywhere)
        };
        let mut filled = BTreeSet::new();
        let (of, mut crowded) = loop {
            let (of, crowded) = self.peaks(&map, spectra.len());
            let left = self.left_lobes(&map, &of);
            if !left.is_empty() {
                self.complete(&mut map.strips, &left, spectra, &sums, rooms);
                continue;
            }
            // Of others all sums are enough: what was subtracted since made them larger, if anything.
            let is_open = |bin: usize, satellite: usize| {
                !filled.contains(&bin) && (old(bin, satellite) || self.is_unknown(&map, bin))
            };
            let doubtful = self.doubtful(&of, is_open);
            if doubtful.is_empty() {
                break (of, crowded);
            }
            let columns = map.strips.par_iter_mut().enumerate().filter(|(bin, _)| doubtful.contains(bin));
            columns.for_each(|(bin, column)| {
                column.iter_mut().enumerate().filter(|(n, _)| old(bin, *n)).for_each(|(_, strip)| strip.sums = 0);
                rooms.with(self, |room| self.fill(column, spectra, &mut sums.at(self, bin), room));
            });
            filled.extend(doubtful);
        };
        crowded
            .extend((0..).zip(&map.raised).filter_map(|(bin, raised)| matches!(raised, Raised::Yes(_)).then_some(bin)));
        crowded.sort_unstable();
        crowded.dedup();
        let of = of.into_iter().map(|(_, peak)| peak).collect();
        Peaks { of, crowded, map }
    }

    /// Threshold of a statistic in noise alone.
    #[cfg(test)]
    pub fn threshold(&self) -> f64 {
        self.law.threshold
    }

    /// Dopplers of satellites of which no strip stayed: of each the one that came nearest to the bar.
    fn missing(&self, strips: &[Vec<Strip>], satellites: usize) -> Vec<(usize, usize)> {
        (0..satellites)
            .filter(|&satellite| strips.iter().all(|column| column[satellite].sums < self.sums))
            .filter_map(|satellite| {
                let height = |bin: &usize| strips[*bin][satellite].peak;
                let best = (0..strips.len()).max_by(|a, b| height(a).total_cmp(&height(b)))?;
                Some((best, satellite))
            })
            .collect()
    }

    /// Completes strips of given Dopplers and satellites with all dwells.
    fn complete(
        &self,
        strips: &mut [Vec<Strip>],
        wanted: &[(usize, usize)],
        spectra: &[Spectra<'_>],
        sums: &Sums<'_>,
        rooms: &Rooms,
    ) {
        let whole = |&(bin, satellite): &(usize, usize)| {
            rooms.with(self, |room| self.whole(&spectra[satellite], &mut sums.at(self, bin), room))
        };
        let found: Vec<Strip> = wanted.par_iter().map(whole).collect();
        for (&(bin, satellite), strip) in wanted.iter().zip(found) {
            strips[bin][satellite] = strip;
        }
    }

    pub(super) fn near_cells(&self) -> usize {
        (PEAK_CHIPS / (self.chips_per_sample * self.lag_samples)).ceil() as usize
    }

    /// Delay and Doppler of a known satellite at sample `first`.
    pub fn refined(&self, known: &Acquired, first: u64) -> Refined {
        let later = first as f64 - known.sample as f64;
        let code_phase_chips = known.code_phase_chips + later * self.received_chips_per_sample(known.doppler_hz);
        let period_chips = (self.period_samples * self.chips_per_sample).round();
        Refined {
            code_phase_chips: code_phase_chips.rem_euclid(period_chips),
            doppler_hz: known.doppler_hz,
            cn0_hz: libm::pow(10.0, known.cn0_dbhz / 10.0),
            power: 0.0,
        }
    }

    /// Frequency of a carrier in the samples at a Doppler, in hertz.
    pub fn frequency_hz(&self, doppler_hz: f64) -> f64 {
        self.if_hz + self.doppler_sign * doppler_hz
    }

    /// Doppler per hertz in the samples: negative where the spectrum is inverted.
    pub fn doppler_sign(&self) -> f64 {
        1.0 / self.doppler_sign
    }

    /// e^{jθ} of a tone at sample `n`.
    pub fn phasor(&self, frequency_hz: f64, n: u64) -> Complex<f64> {
        let turns = frequency_hz / self.rate_hz * n as f64;
        let (sin, cos) = libm::sincos(TAU * (turns - turns.floor()));
        Complex::new(cos, sin)
    }

    /// Chips that pass in one sample at that Doppler.
    pub fn received_chips_per_sample(&self, doppler_hz: f64) -> f64 {
        self.chips_per_sample * (1.0 + doppler_hz / self.carrier_hz)
    }

    /// Code phase at the first sample of the block, in chips (not reduced), if the largest cell is at
    /// `half_lag` halves of one.
    pub fn code_phase_chips(&self, half_lag: usize, doppler_hz: f64) -> f64 {
        let lag_samples = 0.5 * half_lag as f64 * self.lag_samples;
        // The replica's first sample represents the middle of its interval.
        0.5 * self.chips_per_sample - lag_samples * self.received_chips_per_sample(doppler_hz)
    }
}

/// The smallest product of 2, 3 and 5 that is a multiple of 16 and not below `least`.
fn fast_length(least: usize) -> usize {
    let least = least.next_multiple_of(16).max(16);
    (least..)
        .step_by(16)
        .find(|&n| {
            let mut rest = n;
            for prime in [2, 3, 5] {
                while rest.is_multiple_of(prime) {
                    rest /= prime;
                }
            }
            rest == 1
        })
        .unwrap_or(least)
}
