//! Search: which satellites are there, at which Doppler and code phase.
//!
//! Every code phase at once by FFT, Doppler by Doppler, coherent sums over code periods whose powers
//! are added (sources: Kaplan and Hegarty, chapter 8; Borre et al., chapter 6). The threshold follows from a
//! stated false-alarm probability and the noise floor of the satellite's own map. Found satellites
//! are refined for tracking. Dopplers that change by more than the step within the search,
//! and data symbols shorter than the coherent sum, are not searched for.
//!
//! **Multiple access.** Cross-correlation with strong satellites passes for weak ones. So the strong ones are
//! subtracted from the samples, code period by code period, and weak ones are looked for again; where the
//! strong ones have a good part of all power, or raise the cells of all codes, so is everything else. What is
//! strong among the rest goes the same way. Signals that are no candidates are not subtracted: where they
//! raise the cells of all codes, the threshold rises (`multiple_access`). Hits that strong ones of another
//! family may have made have to show without these (`across`). Continuous waves that could pass for
//! satellites are taken out first (`tone`).
//!
//! **Threshold.** A cell's statistic is Σ|S|² in units of half its noise power: chi-square with 2K degrees of
//! freedom for K sums. With N cells (lags in one code period times Dopplers), a cell is given 1 − (1 −
//! P)^(1/N) of the probability P. Between any two lags there is another cell, the sum of both (`powers`), and
//! N counts independent ones of the same law. Neighbours in Doppler are correlated, so this errs to the safe
//! side, but little: at half-cycle steps they share 40 % of their power, and where one exceeds a high
//! threshold the next does so in few of a hundred cases (measured in this module's tests).
//! Near a multiple of half the rate of a real recording a carrier meets its own image and a sum has one
//! degree of freedom only; there the statistic is scaled by the ratio of both thresholds.
//!
//! **Data and pilot** of equal power and equal codes' length are searched for together (`pair`), in eight
//! dwells where a single code has ten sums, and a Doppler is left early where nothing is (`dwells`).
//!
//! **Sensitivity.** By default 10 sums of 2 ms with half-cycle steps. At 38 dB-Hz and 2.6 Msps, with the
//! worst losses of code (1.5 dB) and Doppler (0.9 dB) and one sum in ten lost to a data bit, 20 + λ = 151 ±
//! 24 exceeds a threshold of 95. A bit that turns within a sum leaves a third of its power on average.

mod across;
mod choice;
mod codes;
mod dwells;
mod error;
mod family;
mod finding;
mod grid;
mod kernel;
mod modelled;
mod multiple_access;
mod near;
mod pair;
mod powers;
mod refine;
mod removal;
mod replica;
mod room;
mod settings;
mod shifted;
mod sums;
mod tone;
mod window;

use std::collections::BTreeMap;

use fft::Planner;
use rayon::prelude::*;

use crate::correlate::correlator::Shown;
use crate::lead::{beside, followed_db, lead};
use crate::source::{Block, Stretch};
use gnss::record::AcquisitionRow;
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::{Component, Layers, Link, Signal};

pub use codes::SEARCHED;
use codes::{Code, Codes};
use dwells::Rooms;
pub(crate) use dwells::pair_sums;
pub use error::AcquireError;
use family::Band;
use finding::Finding;
use grid::{Again, Grid, Map};
use multiple_access::LEAST_CODES;
use refine::Refined;
pub use room::{least_samples, samples_needed, shortened};
pub use settings::{ALL, AcquisitionSettings};
pub(crate) use settings::{MOST_DOPPLER_HZ, MOST_SUMS};
use window::Window;

/// Hits this much weaker than the strongest (10 dB) have to show without those that are stronger.
///
/// One C/A code appears in the correlator of another at most 21 dB down, several together seldom above 14 dB
/// down.
pub(crate) const WEAK_SHARE: f64 = 0.1;
/// Satellites with this share of the samples' power take 1.2 dB from those that were not found.
const MASKING_SHARE: f64 = 0.25;
/// C/N0 times the time searched from which a satellite can crowd the Dopplers of others: at 21 dB down its
/// cross-correlation then raises a cell by 4, where noise has 2 a sum.
const CROWDING: f64 = 250.0;
/// Looks at the samples, each without what the one before found strong.
const LARGEST_LOOKS: u32 = 4;

/// A satellite that was found.
#[derive(Clone, Copy, Debug)]
pub struct Acquired {
    /// The satellite.
    pub sv: Sv,
    /// The signal.
    pub signal: &'static Signal,
    /// Sample at which `code_phase_chips` holds.
    pub sample: u64,
    /// Code phase in [0, code length): chips of the received code already begun at `sample`.
    pub code_phase_chips: f64,
    /// Positive when approaching.
    pub doppler_hz: f64,
    /// C/N0 of the whole signal in dB-Hz, as the search estimated it.
    pub cn0_dbhz: f64,
}

impl Acquired {
    /// Satellite and signal of the hit.
    pub fn link(&self) -> Link {
        Link { sv: self.sv, signal: self.signal }
    }
}

/// True if a signal's carrier lies within the band of the samples, with both sidebands of its sub-carrier if
/// it has one. The IF of a real recording may lie beyond half the rate on purpose.
pub fn can_hold(metadata: &IfMetadata, signal: &Signal) -> bool {
    !metadata.format.is_complex() || far_hz(metadata, signal, signal.centre_hz()).abs() <= 0.5 * metadata.rate.hz()
}

/// True if a satellite's own carrier lies within the band of the samples.
pub(crate) fn can_hold_carrier(metadata: &IfMetadata, link: Link) -> bool {
    let far_hz = far_hz(metadata, link.signal, link.carrier_hz());
    !metadata.format.is_complex() || far_hz.abs() <= 0.5 * metadata.rate.hz()
}

/// Frequency of a carrier in the samples in hertz, or that of the farther sideband of its sub-carrier.
fn far_hz(metadata: &IfMetadata, signal: &Signal, carrier_hz: f64) -> f64 {
    let if_hz = metadata.if_hz(carrier_hz);
    if_hz + libm::copysign(signal.sides_hz(), if_hz)
}

/// Chips from one cell of a search for `signal` to the next; there is another between them.
///
/// # Errors
/// Errors of [`Searcher::search`] for a signal that has no code.
pub fn cell_chips(
    metadata: &IfMetadata,
    signal: &'static Signal,
    settings: &AcquisitionSettings,
) -> Result<f64, AcquireError> {
    grid(metadata, signal, settings).map(|grid| grid.lag_samples * grid.chips_per_sample)
}

/// Values that the largest cell of a Doppler has to exceed after each sum of a search for `signal`. The unit
/// is that in which noise is chi-square. Values are zero where no Doppler is left. Cross-correlation that
/// many codes show raises them.
///
/// # Errors
///
/// Same as [`cell_chips`].
pub fn bars(
    metadata: &IfMetadata,
    signal: &'static Signal,
    settings: &AcquisitionSettings,
) -> Result<Vec<f64>, AcquireError> {
    grid(metadata, signal, settings).map(|grid| grid.dwells.stay().to_vec())
}

/// Independent cells at a Doppler whose largest has the law of all of them in a search for `signal`.
///
/// # Errors
/// Errors of [`cell_chips`].
pub fn independent_cells(
    metadata: &IfMetadata,
    signal: &'static Signal,
    settings: &AcquisitionSettings,
) -> Result<usize, AcquireError> {
    grid(metadata, signal, settings).map(|grid| grid.cells)
}

fn grid(metadata: &IfMetadata, signal: &'static Signal, settings: &AcquisitionSettings) -> Result<Grid, AcquireError> {
    settings.validate()?;
    let one = |component| (component, companion(component, signal).is_some(), signal.centre_hz());
    let mut planner = Planner::<f32>::new();
    let grid = lead(signal).and_then(|component| Grid::new(one(component), metadata, settings, 0.0, &mut planner));
    grid.ok_or(AcquireError::NoCode { signal: signal.name, sv: Sv { system: signal.system, number: 0 } })
}

/// Searches `block` once for every candidate; rows come in the order of the candidates.
///
/// # Errors
/// Errors of [`Searcher::search`].
pub fn search(
    metadata: &IfMetadata,
    block: &Block,
    candidates: &[Link],
    settings: &AcquisitionSettings,
) -> Result<Vec<(AcquisitionRow, Option<Acquired>)>, AcquireError> {
    Searcher::new(metadata, settings)?.search(block, candidates)
}

/// A search that keeps its FFT plans and code spectra, to be made again on later blocks.
pub struct Searcher {
    metadata: IfMetadata,
    settings: AcquisitionSettings,
    centre_hz: f64,
    /// Samples that there are, where a search has to do with them.
    have: Option<u64>,
    grids: BTreeMap<Band, Grid>,
    /// Signals with codes of one length share their transforms.
    planner: Planner<f32>,
    codes: Codes,
}

/// Row of a candidate, and its position where it was found.
type Found = (AcquisitionRow, Option<Acquired>);
/// A satellite that is known to be there, and its position.
type Known<'a> = (&'a Code, Refined);

/// The data beside a pilot, where both are searched for: they have the same power, and the pilot's secondary
/// code keeps coherent sums to one code period.
pub(crate) fn companion(component: &'static Component, signal: &'static Signal) -> Option<&'static Component> {
    let equal = |data: &&Component| (data.power_share / component.power_share - 1.0).abs() < 1e-9;
    (component.secondary_code.periods() > 1).then(|| beside(component, signal)).flatten().filter(equal)
}

impl Searcher {
    /// A search of samples as `metadata` describes them.
    ///
    /// # Errors
    /// Errors of [`AcquisitionSettings::validate`].
    pub fn new(metadata: &IfMetadata, settings: &AcquisitionSettings) -> Result<Self, AcquireError> {
        Self::around(metadata, settings, 0.0)
    }

    /// A search of Dopplers around `centre_hz`, to a step of the grid, in place of zero.
    ///
    /// # Errors
    ///
    /// Same as [`AcquisitionSettings::validate`].
    pub fn around(metadata: &IfMetadata, settings: &AcquisitionSettings, centre_hz: f64) -> Result<Self, AcquireError> {
        settings.validate()?;
        Ok(Self {
            metadata: metadata.clone(),
            settings: settings.clone(),
            centre_hz,
            have: None,
            grids: BTreeMap::new(),
            planner: Planner::<f32>::new(),
            codes: Codes::default(),
        })
    }

    /// A search that does with `have` samples: each signal is searched for as if it were alone, by as many
    /// sums as these have room for ([`shortened`]). Long codes of one signal cost the others nothing.
    ///
    /// # Errors
    /// Errors of [`AcquisitionSettings::validate`].
    pub(crate) fn fitted(
        metadata: &IfMetadata,
        settings: &AcquisitionSettings,
        centre_hz: f64,
        have: u64,
    ) -> Result<Self, AcquireError> {
        Ok(Self { have: Some(have), ..Self::around(metadata, settings, centre_hz)? })
    }

    /// Settings by which a signal is searched for; `None` where there are too few samples for it.
    fn settings_of(&self, signal: &Signal) -> Result<Option<AcquisitionSettings>, AcquireError> {
        let Some(have) = self.have else { return Ok(Some(self.settings.clone())) };
        let alone = AcquisitionSettings { signals: vec![signal.name.to_owned()], ..self.settings.clone() };
        // The Doppler farthest from zero makes code periods longest.
        let farthest_hz = (alone.doppler_max_hz + self.centre_hz.abs()).min(MOST_DOPPLER_HZ);
        let room = shortened(&self.metadata, &AcquisitionSettings { doppler_max_hz: farthest_hz, ..alone }, have)?;
        Ok(room.map(|room| AcquisitionSettings { doppler_max_hz: self.settings.doppler_max_hz, ..room }))
    }

    /// True if there are enough samples to search for this signal.
    ///
    /// # Errors
    ///
    /// Same as [`AcquisitionSettings::validate`].
    pub(crate) fn has_room(&self, signal: &Signal) -> Result<bool, AcquireError> {
        Ok(self.settings_of(signal)?.is_some())
    }

    /// Searches the beginning of `block` for every candidate, by the component of its signal that leads; rows
    /// come in the order of the candidates. Of candidates with the same code and carrier only the first is
    /// acquired.
    ///
    /// # Errors
    /// A block that is too short, or a candidate that these samples cannot hold: see [`AcquireError`].
    pub fn search(
        &mut self,
        block: &Block,
        candidates: &[Link],
    ) -> Result<Vec<(AcquisitionRow, Option<Acquired>)>, AcquireError> {
        self.search_beside(block, candidates, &[])
    }

    /// Searches for `candidates` after the signals of known satellites have been subtracted from the samples.
    /// No candidate has to be one of the known satellites.
    ///
    /// # Errors
    ///
    /// Same as [`Searcher::search`].
    pub fn search_beside(
        &mut self,
        block: &Block,
        candidates: &[Link],
        known: &[Acquired],
    ) -> Result<Vec<(AcquisitionRow, Option<Acquired>)>, AcquireError> {
        if block.i.len() != block.q.len() {
            return Err(AcquireError::Uneven { i: block.i.len(), q: block.q.len() });
        }
        self.search_stretch(&Stretch::Planes(*block), candidates, known)
    }

    /// Searches samples that are given without a block.
    pub(crate) fn search_stretch(
        &mut self,
        stretch: &Stretch,
        candidates: &[Link],
        known: &[Acquired],
    ) -> Result<Vec<(AcquisitionRow, Option<Acquired>)>, AcquireError> {
        if let Stretch::Modelled(span) = stretch {
            return self.search_model(span, candidates);
        }
        let known_links = known.iter().map(Acquired::link);
        let links: Vec<Link> = candidates.iter().copied().chain(known_links).collect();
        for link in &links {
            self.prepare(*link)?;
        }
        let of: Vec<Band> = candidates.iter().copied().map(Band::of).collect();
        let mut results: Vec<Option<(AcquisitionRow, Option<Acquired>)>> = vec![None; candidates.len()];
        let bands: Vec<Band> = self.grids.keys().copied().collect();
        for band in bands {
            let chosen: Vec<(usize, Link)> = (0..)
                .zip(candidates)
                .zip(&of)
                .filter(|(_, own)| **own == band)
                .map(|((index, link), _)| (index, *link))
                .collect();
            if chosen.is_empty() {
                continue;
            }
            let mut sought: Vec<Link> = chosen.iter().map(|(_, link)| *link).collect();
            let mut found = self.search_band(stretch, band, &sought, known)?;
            if found.iter().any(|(_, hit)| hit.is_some()) {
                let others = band.others(&sought, &self.metadata);
                if !others.is_empty() {
                    sought.extend(others);
                    found = self.search_band(stretch, band, &sought, known)?;
                }
            }
            for ((index, _), result) in chosen.iter().zip(found) {
                if let Some(slot) = results.get_mut(*index) {
                    *slot = Some(result);
                }
            }
        }
        let mut results: Vec<(AcquisitionRow, Option<Acquired>)> = results.into_iter().flatten().collect();
        self.codes.trim();
        self.clear_across(stretch, known, &mut results)?;
        self.codes.trim();
        Ok(results)
    }

    /// Searches for candidates of one band.
    fn search_band(
        &mut self,
        stretch: &Stretch,
        band: Band,
        candidates: &[Link],
        known: &[Acquired],
    ) -> Result<Vec<Found>, AcquireError> {
        let known: Vec<&Acquired> = known.iter().filter(|one| Band::of(one.link()) == band).collect();
        let known_links: Vec<Link> = known.iter().map(|one| one.link()).collect();
        self.codes.trim();
        self.codes.make(&self.grids, candidates.iter().chain(&known_links))?;
        let Some(grid) = self.grids.get(&band) else { return Ok(Vec::new()) };
        let (have, need) = (stretch.samples() as u64, grid.samples_needed());
        if have < need {
            return Err(AcquireError::TooFewSamples { have, need });
        }
        let codes: Vec<(Link, &Code)> =
            candidates.iter().filter_map(|link| Some((*link, self.codes.get(link)?))).collect();
        let known: Vec<Known<'_>> = (known.into_iter())
            .filter_map(|one| Some((self.codes.get(&one.link())?, grid.refined(one, stretch.first()))))
            .collect();
        let window = Window::centred(stretch, need as usize);
        Ok(self.search_signal(band.signal, grid, (window, 0.0), (&codes, &known)))
    }

    /// Makes sure that plans are there.
    fn prepare(&mut self, link: Link) -> Result<(), AcquireError> {
        let Link { sv, signal } = link;
        let no_code = AcquireError::NoCode { signal: signal.name, sv };
        let Some(component) = lead(signal) else {
            return Err(AcquireError::TooLong { signal: signal.name });
        };
        let rate_hz = self.metadata.rate.hz();
        if rate_hz < component.chip_rate_hz {
            return Err(AcquireError::RateTooLow { signal: signal.name, rate_hz, need_hz: component.chip_rate_hz });
        }
        if !can_hold_carrier(&self.metadata, link) {
            let (if_hz, half_hz) = (far_hz(&self.metadata, signal, link.carrier_hz()), 0.5 * rate_hz);
            return Err(AcquireError::OutOfBand { signal: signal.name, if_hz, half_hz });
        }
        if sv.system != signal.system {
            return Err(no_code);
        }
        let band = Band::of(link);
        if !self.grids.contains_key(&band) {
            let Some(settings) = self.settings_of(signal)? else {
                let alone = AcquisitionSettings { signals: vec![signal.name.to_owned()], ..self.settings.clone() };
                let need = least_samples(&self.metadata, &alone)?;
                return Err(AcquireError::TooFewSamples { have: self.have.unwrap_or(0), need });
            };
            let one = (component, companion(component, signal).is_some(), link.carrier_hz());
            let grid = Grid::new(one, &self.metadata, &settings, self.centre_hz, &mut self.planner);
            let Some(grid) = grid else {
                return Err(no_code);
            };
            self.grids.insert(band, grid);
        }
        Ok(())
    }

    fn search_signal(
        &self,
        signal: &'static Signal,
        grid: &Grid,
        (mut window, taken): (Window, f64),
        (codes, known): (&[(Link, &Code)], &[Known<'_>]),
    ) -> Vec<Found> {
        let Some(component) = lead(signal) else { return Vec::new() };
        let code_chips = f64::from(component.code_chips);
        let complex = self.metadata.format.is_complex();
        let searched_s = f64::from(grid.periods) * component.period_s();
        tone::remove(&mut window, grid.rate_hz, complex);
        let mut strongest = taken;
        for (code, place) in known {
            strongest = f64::max(strongest, code.subtract(grid, (code_chips, complex), place, &mut window));
        }
        let rooms = Rooms::default();
        let (found, mut crowded, mut map) = self.detect(grid, component, &window.block(), codes, (None, &rooms));
        let mut findings: Vec<Finding> = found.into_iter().map(|finding| finding.beside(strongest)).collect();
        // Codes that are not subtracted yet.
        let mut open: Vec<usize> = (0..codes.len()).collect();
        for _ in 1..LARGEST_LOOKS {
            let hits = || open.iter().filter_map(|&index| Some((index, findings[index].hit?)));
            let here = hits().map(|(_, hit)| hit.power).fold(0.0, f64::max);
            let mut strong: Vec<(usize, Refined)> = hits().filter(|(_, hit)| hit.power >= WEAK_SHARE * here).collect();
            let weak = hits().count() > strong.len();
            let band_hz = if complex { grid.rate_hz } else { 0.5 * grid.rate_hz };
            let masking_hz: f64 = strong.iter().map(|(_, hit)| hit.cn0_hz).sum();
            let masked = masking_hz > MASKING_SHARE * (band_hz + masking_hz);
            let crowding = !crowded.is_empty() && strong.iter().any(|(_, hit)| hit.cn0_hz * searched_s > CROWDING);
            if !(weak || masked || crowding) {
                break;
            }
            strongest = f64::max(strongest, here);
            strong.sort_by(|a, b| b.1.power.total_cmp(&a.1.power));
            for (index, hit) in &strong {
                codes[*index].1.subtract(grid, (code_chips, complex), hit, &mut window);
            }
            open.retain(|index| strong.iter().all(|(taken, _)| taken != index));
            // Weak hits alone need few codes; what the strong ones hid may be any.
            let again: Vec<usize> =
                (open.iter().copied()).filter(|&index| findings[index].hit.is_some() || masked || crowding).collect();
            // Codes of those that were subtracted are as good a sample as others.
            let is_sample = again.len() < LEAST_CODES && (masked || crowding);
            let taken = (0..codes.len()).filter(|index| is_sample && !open.contains(index));
            let looked: Vec<usize> = again.iter().copied().chain(taken).collect();
            let chosen: Vec<(Link, &Code)> = looked.iter().map(|&index| codes[index]).collect();
            // Where the strong ones are no noise to speak of, the others are looked at where they were
            // raised.
            let satellites: Vec<(usize, bool)> =
                looked.iter().map(|&index| (index, masked || findings[index].hit.is_some())).collect();
            let some = Again { before: &map, dopplers: &crowded, satellites: &satellites };
            let (found, still, seen) = self.detect(grid, component, &window.block(), &chosen, (Some(&some), &rooms));
            map.update(&satellites, &seen);
            crowded = still;
            for (index, finding) in again.into_iter().zip(found) {
                findings[index] = finding.beside(strongest);
            }
        }
        for index in 1..codes.len() {
            let same = |earlier: usize| codes[earlier].1.is_alike(codes[index].1);
            if (0..index).any(|earlier| findings[earlier].hit.is_some() && same(earlier)) {
                findings[index].hit = None;
            }
        }
        let rows = findings.iter().zip(codes);
        let followed_db = followed_db(component, Layers::Strongest);
        rows.map(|(finding, (link, _))| finding.report((*link, followed_db), window.first, code_chips)).collect()
    }

    /// One search of these samples, and refinement of what passes the threshold; with the crowded Dopplers,
    /// and what was seen.
    fn detect(
        &self,
        grid: &Grid,
        component: &Component,
        block: &Block,
        codes: &[(Link, &Code)],
        (again, rooms): (Option<&Again<'_>>, &Rooms),
    ) -> (Vec<Finding>, Vec<usize>, Map) {
        let (sums, coherent) = (grid.sums, grid.coherent_periods);
        let spectra: Vec<dwells::Spectra<'_>> = codes.iter().map(|(_, code)| code.spectra()).collect();
        let coherent_s = component.period_s() * f64::from(coherent);
        let peaks = grid.search(block, &spectra, again, rooms);
        let shown = &Shown::whole(block.first, (block.i, block.q).into());
        let findings = (peaks.of)
            .into_par_iter()
            .zip(codes)
            .map(|(peak, (link, code))| {
                let excess = peak.statistic / (2.0 * f64::from(sums)) - 1.0;
                let coarse = Refined {
                    code_phase_chips: grid.code_phase_chips(peak.half_lag, peak.doppler_hz),
                    doppler_hz: peak.doppler_hz,
                    cn0_hz: excess.max(f64::MIN_POSITIVE) / coherent_s,
                    power: 0.0,
                };
                let coded = if peak.statistic > peak.threshold { code.correlator(*link) } else { None };
                let periods = grid.periods as usize;
                let hit = coded.map(|coded| refine::refine(grid, shown, component, &coded, coarse, periods));
                Finding { statistic: peak.statistic, threshold: peak.threshold, coarse, hit }
            })
            .collect();
        (findings, peaks.crowded, peaks.map)
    }
}

#[cfg(test)]
mod dwell_tests;
#[cfg(test)]
mod pair_tests;
#[cfg(test)]
mod sky_tests;
#[cfg(test)]
pub(crate) mod tests;
