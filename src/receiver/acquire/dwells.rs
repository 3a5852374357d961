//! Coherent sums one after the other, and Dopplers that are left before all are made.
//!
//! Most satellites are absent, and of one that is there most Dopplers are wrong. Where data and pilot are
//! searched for together a Doppler stays after some of its dwells where its largest cell exceeds what that of
//! noise exceeds with a stated probability; where it does not, it is left. The threshold of all dwells is
//! that of a search which leaves nothing, so false alarms come no more often. Detections: of ten dwells by
//! the pilot alone eight dwells by both keep as many, at any C/N0 (model of signs, Doppler and lag in the
//! tests of `pair`). When a Doppler may be left is a share of all dwells, as weak signals that ask for many
//! show late.
//!
//! Where cross-correlation raises a Doppler for all codes, many of them stay; then all do, and
//! [`super::multiple_access`] judges whole columns. Of C/A codes alone none is left: one satellite raises the
//! cells of all others at every kilohertz, by too little to make many of them stay and by enough to make some
//! pass for satellites.

use num_complex::Complex;

use super::grid::{Grid, Strip};
use super::kernel::{self, Factors, Spectrum};
use crate::receiver::threshold::{of_one_cell, threshold};

/// Shares of the dwells after which a Doppler may be left, and probabilities that noise stays.
const STAY: [(f64, f64); 6] = [(0.25, 0.25), (0.375, 0.12), (0.5, 0.06), (0.625, 0.03), (0.75, 0.02), (0.875, 0.01)];
/// Dwells of data and pilot for each code period that is asked for.
const DWELLS: f64 = 0.8;
/// Share of all codes that stay from which a Doppler is searched to its end for every code.
const MANY: f64 = 0.4;
/// Fewer codes are no sample.
const LEAST_CODES: usize = 12;

/// Conjugate spectra of a satellite's codes: of one that is alone the same twice.
pub(super) type Spectra<'a> = [&'a Spectrum; 2];

/// When the dwells of a search begin, and where a Doppler is left.
pub(super) struct Dwells {
    /// Code periods from the first sample to each, in the order in which they are looked at.
    begins: Vec<f64>,
    /// What the largest cell has to exceed after each dwell, in units of half a sum's noise power; zero where
    /// nothing is left.
    stay: Vec<f64>,
    /// Codes whose powers are added in a dwell.
    codes: usize,
}

/// Room in which maps are made.
struct Scratch {
    fft: Vec<Complex<f32>>,
    short: Vec<Complex<f32>>,
    powers: Vec<f32>,
}

impl Dwells {
    /// Sums of so many code periods one after the other.
    pub fn alone(sums: u32, periods: u32) -> Self {
        let begins = (0..sums).map(|dwell| f64::from(dwell * periods)).collect();
        Self { begins, stay: vec![0.0; sums as usize], codes: 1 }
    }

    /// Periods of data and pilot, among so many code periods, of maps with so many cells.
    pub fn of_pair(periods: u32, lags: usize) -> Self {
        let count = (DWELLS * f64::from(periods)).ceil().max(1.0) as u32;
        let apart = f64::from(periods - 1) / f64::from((count - 1).max(1));
        let mut begins: Vec<f64> = (0..count).map(|dwell| f64::from(dwell) * apart).collect();
        // The second one that is looked at begins about half a period from the first.
        if begins.len() > 3 {
            begins.swap(1, 2);
        }
        let mut stay = vec![0.0; begins.len()];
        for (share, probability) in STAY {
            let made = (share * begins.len() as f64 - 1e-9).ceil() as usize;
            // After the last there is nothing to leave.
            if let Some(bar) = made.checked_sub(1).filter(|_| made < begins.len()).and_then(|last| stay.get_mut(last)) {
                *bar = threshold(of_one_cell(probability, lags as f64), 2 * 2 * made as u32);
            }
        }
        Self { begins, stay, codes: 2 }
    }

    pub fn begins(&self) -> &[f64] {
        &self.begins
    }

    #[cfg(test)]
    pub fn stay(&self) -> &[f64] {
        &self.stay
    }

    /// Powers that are added.
    pub fn sums(&self) -> u32 {
        self.sums_after(self.begins.len())
    }

    fn sums_after(&self, dwells: usize) -> u32 {
        (self.codes * dwells) as u32
    }
}

impl Grid {
    /// All satellites at one Doppler; `make` gives the spectrum of a dwell there.
    pub fn column(
        &self,
        doppler_hz: f64,
        spectra: &[Spectra<'_>],
        make: &mut dyn FnMut(usize) -> Vec<Complex<f32>>,
    ) -> Vec<Strip> {
        let mut scratch = self.scratch();
        let mut data = self.no_data();
        let all = self.meets_image(doppler_hz);
        let mut column: Vec<Strip> =
            spectra.iter().map(|codes| self.map(make, &mut data, codes, all, &mut scratch)).collect();
        let first_left = column.iter().map(|strip| strip.sums).min().unwrap_or(0);
        let stayed = column.iter().filter(|strip| strip.sums > first_left).count();
        if column.len() >= LEAST_CODES && stayed as f64 >= MANY * column.len() as f64 {
            for (strip, codes) in column.iter_mut().zip(spectra).filter(|(strip, _)| strip.sums < self.sums) {
                *strip = self.map(make, &mut data, codes, true, &mut scratch);
            }
        }
        column
    }

    /// One satellite at one Doppler with all its dwells.
    pub fn whole(&self, codes: &Spectra<'_>, make: &mut dyn FnMut(usize) -> Vec<Complex<f32>>) -> Strip {
        let mut data = self.no_data();
        self.map(make, &mut data, codes, true, &mut self.scratch())
    }

    fn no_data(&self) -> Vec<Option<Factors>> {
        self.dwells.begins.iter().map(|_| None).collect()
    }

    fn scratch(&self) -> Scratch {
        Scratch {
            fft: vec![Complex::default(); self.inverse.get_inplace_scratch_len()],
            short: vec![Complex::default(); self.inverse.len()],
            powers: vec![0.0; self.lags],
        }
    }

    /// One satellite at one Doppler, dwell by dwell until it is left. The peak of what was left is what it
    /// reached of the bar.
    fn map(
        &self,
        make: &mut dyn FnMut(usize) -> Vec<Complex<f32>>,
        data: &mut [Option<Factors>],
        codes: &Spectra<'_>,
        to_the_end: bool,
        scratch: &mut Scratch,
    ) -> Strip {
        scratch.powers.fill(0.0);
        for (dwell, (slot, &bar)) in data.iter_mut().zip(&self.dwells.stay).enumerate() {
            let factors = slot.get_or_insert_with(|| Factors::of(&make(dwell)));
            for code in codes.iter().take(self.dwells.codes) {
                kernel::multiply(&mut scratch.short, code, factors);
                self.inverse.process_with_scratch(&mut scratch.short, &mut scratch.fft);
                kernel::add_powers(&mut scratch.powers, &scratch.short);
            }
            if bar == 0.0 || to_the_end {
                continue;
            }
            let sums = self.dwells.sums_after(dwell + 1);
            let (peak, total) = kernel::peak_and_total(&scratch.powers);
            let floor = total / (2.0 * f64::from(sums) * scratch.powers.len() as f64);
            let height = if floor > 0.0 { f64::from(peak) / floor } else { 0.0 };
            if height <= bar {
                let reached = (height / bar) as f32;
                return Strip { peak: reached, lag: 0, total, near: 0.0, near_cells: 0, sums };
            }
        }
        self.strip(&scratch.powers)
    }
}
