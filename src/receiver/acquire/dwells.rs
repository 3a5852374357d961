//! Coherent sums one after the other, and Dopplers that are left before all are made.
//!
//! Most satellites are absent, and of one that is there most Dopplers are wrong. A Doppler stays after some
//! of its dwells where its largest cell exceeds what that of noise exceeds with a stated probability; where
//! it does not, it is left. The threshold of all dwells is that of a search which leaves nothing, so false
//! alarms come no more often. When a Doppler may be left is a share of all dwells, as weak signals that ask
//! for many show late.
//!
//! **Data and pilot**: of ten dwells by the pilot alone eight dwells by both keep as many satellites, at any
//! C/N0 (model of signs, Doppler and lag in the tests of `pair`).
//!
//! **One code** leaves from the middle on. That costs 0.06 dB where half of all satellites are found and
//! 0.09 dB where nine in ten are, from 5 sums to 100 (a model in the tests of this module), and saves 0.47
//! of the sums.
//!
//! **Crowded Dopplers.** Cross-correlation may raise a Doppler for all codes; [`super::multiple_access`]
//! judges that by whole columns. Of data and pilot all codes stay where many do. C/A codes need more: one
//! satellite raises the cells of all others at every kilohertz, so most Dopplers of an open sky are crowded,
//! and those that are raised by too little to show so early make some pass for satellites. So one code has
//! to exceed what nine in ten of the others reach, and the search fills every column in which a candidate
//! stands that is not sure ([`Grid::search`]).

use std::sync::{Mutex, PoisonError};

use num_complex::Complex;

use super::grid::{Grid, Strip};
use super::kernel::{self, Spectrum};
use super::multiple_access::{LEAST_CODES, Law, Raised};
use super::powers::Powers;
use crate::threshold::{of_one_cell, threshold};

/// A share of the dwells after which a Doppler may be left, and the probability that noise stays.
type Stay = (f64, f64);
/// Dwell shares and probabilities for data and pilot together.
const PAIR: [Stay; 6] = [(0.25, 0.25), (0.375, 0.12), (0.5, 0.06), (0.625, 0.03), (0.75, 0.02), (0.875, 0.01)];
/// Dwell shares and probabilities for one code alone.
const ALONE: [Stay; 5] = [(0.5, 0.25), (0.6, 0.06), (0.7, 0.03), (0.8, 0.02), (0.9, 0.01)];
/// Fewer sums of one code are all made: a data bit that turns in the middle of one takes it, and with it a
/// half or a quarter of those before the first bar.
const LEAST_SUMS: u32 = 5;
/// Dwells of data and pilot for each code period that is asked for.
const DWELLS: f64 = 0.8;
/// Share of all codes that stay from which a Doppler is searched to its end for every code.
const MANY: f64 = 0.4;

/// Conjugate spectra of a satellite's codes: of one that is alone the same twice.
pub(super) type Spectra<'a> = [&'a Spectrum; 2];

/// Times of a search's dwells, and the rule for leaving a Doppler.
pub(super) struct Dwells {
    /// Code periods from the first sample to each, in the order in which they are looked at.
    begins: Vec<f64>,
    /// Value that the largest cell has to exceed after each dwell, in units of half a sum's noise power. It
    /// is zero where no Doppler is left.
    stay: Vec<f64>,
    /// Codes whose powers are added in a dwell.
    codes: usize,
}

/// Function that writes the spectrum of a dwell at a Doppler, into zeroed memory.
pub(super) type Make<'a> = dyn FnMut(usize, &mut [Complex<f32>]) + 'a;

/// Rooms for the Dopplers of all looks at some samples: as many as are worked on at a time.
#[derive(Default)]
pub(super) struct Rooms(Mutex<Vec<Room>>);

impl Rooms {
    /// Lends a room of that grid's size.
    pub fn with<T>(&self, grid: &Grid, work: impl FnOnce(&mut Room) -> T) -> T {
        let free = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let idle = free().pop();
        let mut room = idle.unwrap_or_else(|| grid.room());
        let made = work(&mut room);
        free().push(room);
        made
    }
}

/// Room in which the maps of a Doppler are made, to be used for one after the other.
pub(super) struct Room {
    fft: Vec<Complex<f32>>,
    short: Vec<Complex<f32>>,
    powers: Powers,
    /// Powers of the satellites that stay after the first dwells.
    kept: Vec<Powers>,
    /// Spectrum of every dwell, with a flag that is true once it has been made.
    spectra: Vec<(bool, Vec<Complex<f32>>)>,
}

impl Room {
    /// Forgets the spectra of the Doppler before.
    fn clear(&mut self) {
        self.spectra.iter_mut().for_each(|(made, _)| *made = false);
    }
}

/// Dwells of data and pilot in place of so many code periods of one code.
pub(crate) fn pair_sums(periods: u32) -> u32 {
    (DWELLS * f64::from(periods)).ceil().max(1.0) as u32
}

impl Dwells {
    /// Sums of so many code periods one after the other, of maps with so many independent cells.
    pub fn alone(sums: u32, periods: u32, cells: usize) -> Self {
        let begins = (0..sums).map(|dwell| f64::from(dwell * periods)).collect();
        let leaves: &[Stay] = if sums < LEAST_SUMS { &[] } else { &ALONE };
        Self::leaving(begins, 1, leaves, cells)
    }

    /// Periods of data and pilot, among so many code periods, of maps with so many independent cells.
    pub fn of_pair(periods: u32, cells: usize) -> Self {
        let count = pair_sums(periods);
        let apart = f64::from(periods - 1) / f64::from((count - 1).max(1));
        let mut begins: Vec<f64> = (0..count).map(|dwell| f64::from(dwell) * apart).collect();
        // The second one that is looked at begins about half a period from the first.
        if begins.len() > 3 {
            begins.swap(1, 2);
        }
        Self::leaving(begins, 2, &PAIR, cells)
    }

    /// Dwells with the powers of so many codes each, which may be left at these shares of them.
    fn leaving(begins: Vec<f64>, codes: usize, leaves: &[Stay], cells: usize) -> Self {
        let mut stay = vec![0.0; begins.len()];
        for (share, probability) in leaves {
            let made = (share * begins.len() as f64 - 1e-9).ceil() as usize;
            // After the last there is nothing to leave.
            if let Some(bar) = made.checked_sub(1).filter(|_| made < begins.len()).and_then(|last| stay.get_mut(last)) {
                *bar = threshold(of_one_cell(*probability, cells as f64), (2 * codes * made) as u32);
            }
        }
        Self { begins, stay, codes }
    }

    pub fn begins(&self) -> &[f64] {
        &self.begins
    }

    /// Dwells that are made before a Doppler may be left at all.
    pub fn first_bar(&self) -> Option<usize> {
        self.stay.iter().position(|bar| *bar > 0.0).map(|last| last + 1)
    }

    /// Value that the largest cell has to exceed after each dwell; zero where no Doppler is left.
    pub fn stay(&self) -> &[f64] {
        &self.stay
    }

    /// Powers that are added.
    pub fn sums(&self) -> u32 {
        self.sums_after(self.begins.len())
    }

    pub fn sums_after(&self, dwells: usize) -> u32 {
        (self.codes * dwells) as u32
    }
}

impl Grid {
    /// All satellites at one Doppler, and whether that is crowded, as far as codes that were left show it:
    /// then with what nine codes in ten would at most reach by all sums; `make` gives the spectrum of a
    /// dwell there.
    pub fn column(
        &self,
        doppler_hz: f64,
        spectra: &[Spectra<'_>],
        make: &mut Make<'_>,
        room: &mut Room,
    ) -> (Vec<Strip>, Raised) {
        room.clear();
        let all = self.meets_image(doppler_hz);
        if let Some((first, law)) = self.early.as_ref().filter(|_| !all) {
            return self.column_alone(spectra, make, room, (*first, law));
        }
        let mut column: Vec<Strip> = spectra.iter().map(|codes| self.map(make, codes, all, room)).collect();
        let first_left = column.iter().map(|strip| strip.sums).min().unwrap_or(0);
        let stayed = column.iter().filter(|strip| strip.sums > first_left).count();
        if column.len() >= LEAST_CODES && stayed as f64 >= MANY * column.len() as f64 {
            self.fill_by(&mut column, spectra, make, room);
        }
        (column, Raised::Perhaps)
    }

    /// Column of a Doppler with one code per satellite. The `first` dwells of all codes show the power that
    /// cross-correlation adds.
    fn column_alone(
        &self,
        spectra: &[Spectra<'_>],
        make: &mut Make<'_>,
        room: &mut Room,
        (first, law): (usize, &Law),
    ) -> (Vec<Strip>, Raised) {
        let least = self.dwells.stay[first - 1];
        let (mut heights, mut stayed) = (Vec::new(), Vec::new());
        let mut column = Vec::with_capacity(spectra.len());
        for (number, codes) in spectra.iter().enumerate() {
            room.powers.clear();
            (0..first).for_each(|dwell| self.add(make, codes, dwell, room));
            let (height, total) = self.height(&room.powers, first);
            heights.push(height);
            column.push(self.left(height / least, total, first));
            if height > least {
                match room.kept.get_mut(stayed.len()) {
                    Some(place) => place.copy(&room.powers),
                    None => room.kept.push(room.powers.clone()),
                }
                stayed.push(number);
            }
        }
        let raised = law.raised(heights.clone());
        // Cross-correlation is the same in every dwell.
        let rise = match raised {
            Raised::Yes(reached) => f64::max(reached - least, 0.0) / first as f64,
            Raised::No | Raised::Perhaps => 0.0,
        };
        let bar = |made: usize| match self.dwells.stay[made - 1] {
            0.0 => 0.0,
            noise => noise + rise * made as f64,
        };
        for (place, number) in stayed.into_iter().enumerate().filter(|(_, number)| heights[*number] > bar(first)) {
            std::mem::swap(&mut room.powers, &mut room.kept[place]);
            column[number] = (first + 1..=self.dwells.stay.len())
                .find_map(|made| {
                    self.add(make, &spectra[number], made - 1, room);
                    let (height, total) = self.height(&room.powers, made);
                    (height <= bar(made)).then(|| self.left(height / bar(made), total, made))
                })
                .unwrap_or_else(|| self.strip(&room.powers));
        }
        let all = self.dwells.stay.len() as f64 / first as f64;
        (column, if let Raised::Yes(reached) = raised { Raised::Yes(reached * all) } else { raised })
    }

    /// Gives the satellites of a column the dwells that they were left without.
    pub fn fill(&self, column: &mut [Strip], spectra: &[Spectra<'_>], make: &mut Make<'_>, room: &mut Room) {
        room.clear();
        self.fill_by(column, spectra, make, room);
    }

    fn fill_by(&self, column: &mut [Strip], spectra: &[Spectra<'_>], make: &mut Make<'_>, room: &mut Room) {
        for (strip, codes) in column.iter_mut().zip(spectra).filter(|(strip, _)| strip.sums < self.sums) {
            *strip = self.map(make, codes, true, room);
        }
    }

    /// One satellite at one Doppler with all its dwells.
    pub fn whole(&self, codes: &Spectra<'_>, make: &mut Make<'_>, room: &mut Room) -> Strip {
        room.clear();
        self.map(make, codes, true, room)
    }

    /// Room for the maps of any Doppler.
    fn room(&self) -> Room {
        Room {
            fft: vec![Complex::default(); self.inverse.get_inplace_scratch_len()],
            short: vec![Complex::default(); self.inverse.len()],
            powers: Powers::new(self.lags),
            kept: Vec::new(),
            spectra: self.dwells.begins.iter().map(|_| (false, Vec::new())).collect(),
        }
    }

    /// One satellite at one Doppler, dwell by dwell until it is left.
    fn map(&self, make: &mut Make<'_>, codes: &Spectra<'_>, to_the_end: bool, room: &mut Room) -> Strip {
        room.powers.clear();
        for (dwell, &bar) in self.dwells.stay.iter().enumerate() {
            self.add(make, codes, dwell, room);
            if bar == 0.0 || to_the_end {
                continue;
            }
            let (height, total) = self.height(&room.powers, dwell + 1);
            if height <= bar {
                return self.left(height / bar, total, dwell + 1);
            }
        }
        self.strip(&room.powers)
    }

    /// Adds the powers of a dwell.
    fn add(&self, make: &mut Make<'_>, codes: &Spectra<'_>, dwell: usize, room: &mut Room) {
        let Some((made, spectrum)) = room.spectra.get_mut(dwell) else { return };
        if !*made {
            spectrum.clear();
            spectrum.resize(self.inverse.len(), Complex::default());
            make(dwell, spectrum);
            *made = true;
        }
        for code in codes.iter().take(self.dwells.codes) {
            kernel::multiply(&mut room.short, code, spectrum);
            self.inverse.process_with_scratch(&mut room.short, &mut room.fft);
            room.powers.add(&room.short);
        }
    }

    /// The largest of the powers after so many dwells in units of half a sum's noise, and the sum of all.
    fn height(&self, powers: &Powers, dwells: usize) -> (f64, f64) {
        let (peak, total) = powers.peak_and_total();
        let floor = total / (2.0 * f64::from(self.dwells.sums_after(dwells)) * self.lags as f64);
        (if floor > 0.0 { peak / floor } else { 0.0 }, total)
    }

    /// Strip of a Doppler with all dwells.
    fn strip(&self, powers: &Powers) -> Strip {
        powers.strip(self.near_cells(), self.sums)
    }

    /// Strip of a Doppler that was left after `dwells` dwells. The peak is the share of the bar that it
    /// reached.
    fn left(&self, reached: f64, total: f64, dwells: usize) -> Strip {
        let sums = self.dwells.sums_after(dwells);
        Strip { peak: reached as f32, half_lag: 0, total, near: 0.0, near_cells: 0, sums }
    }
}
