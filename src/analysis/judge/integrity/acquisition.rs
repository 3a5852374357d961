//! Searches against the truth: a found satellite's Doppler, code phase and C/N0, and whether found and
//! tracked agree.
//!
//! The truth has rows every tenth of a second or so; a search in between is compared with cubics through
//! values and rates. Limits: a search that begins before the first or after the last row is not compared with
//! anything, nor one at a time in which the scene expects errors of any size.

use std::collections::BTreeSet;

use super::{Finding, Found};
use crate::error::JudgeError;
use crate::expect::array::Filtered;
use crate::expect::due::receiver::front_end_costs_db;
use crate::expect::followed::{Entry, efficiency};
use crate::read::Run;
use crate::read::spill_store::Finder;
use crate::waveform::leading;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{AcquisitionRow, Event, Observation};
use gnss::signal::{Layer, Link, Shape, Signal};

/// A refined Doppler is right within half a bin of the search: 1/(2·2T) of a coherent time of a few periods.
const DOPPLER_BINS: f64 = 0.5;
/// A refined code phase is right within two thirds of a cell of the search, or within [`SIGMAS`] of its
/// noise.
const CELLS: f64 = 2.0 / 3.0;
/// Standard deviations of a refined code phase that are allowed: once in 1.7 million searches.
const SIGMAS: f64 = 5.0;
/// Largest error of the C/N0 of a search, dB, for the weakest signal that is found, 34 dB-Hz.
///
/// It is measured over 20 periods of a millisecond, each with a ratio s = 2.5 of signal to noise. It scatters
/// by 10 lg(e) √((1 + 2s)/20)/s = 0.95 dB, and three deviations are 2.8 dB. Three deviations of the code
/// phase, 0.21 chips, cost 2.1 dB. Longer periods scatter less.
const CN0_DB: f64 = 5.0;

pub(super) fn findings(run: &Run) -> Result<Vec<Finding>, JudgeError> {
    let mut verdicts = Found::default();
    for row in &run.acquisition {
        // A second look may refuse what the first one found.
        if row.acquired && row.statistic < row.threshold {
            verdicts.add(|| format!("{} at sample {}", row.sv, row.sample));
        }
    }
    let mut all = vec![Finding::none(
        "searches whose verdict contradicts their statistic",
        verdicts,
        "nothing is found below the threshold",
    )];
    all.extend(against_truth(run)?);
    let found: BTreeSet<Link> = run.acquisition.iter().filter(|row| row.acquired).map(|row| row.link()).collect();
    let begun: BTreeSet<Link> =
        run.events.iter().filter(|row| row.event == Event::Acquired).map(|row| row.link()).collect();
    let (mut tracked, mut odd) = (Found::default(), Found::default());
    for link in run.tracking.keys().chain(run.observations.keys()).filter(|link| !found.contains(link)) {
        tracked.add(|| run.name(link));
    }
    for link in found.symmetric_difference(&begun) {
        odd.add(|| run.name(*link));
    }
    all.push(Finding::none("satellites tracked that were never found", tracked, "tracking follows a search"));
    all.push(Finding::none(
        "satellites found without an event, or the reverse",
        odd,
        "each search that finds starts a channel",
    ));
    Ok(all)
}

/// Largest errors of the searches that found what the scene has, while it does not expect errors of any size.
fn against_truth(run: &Run) -> Result<Vec<Finding>, JudgeError> {
    let setting = |key: &str| run.receiver.pointer(&format!("/settings/acquisition/{key}"))?.as_f64();
    let (Some(periods), Some(cells)) = (setting("coherent_periods"), setting("cells_per_chip")) else {
        return Ok(Vec::new());
    };
    // As a search states its sums, which no sign may turn in, or by the settings.
    let coherent_s = |link: Link, period_s: f64| {
        let stated = Entry::of(&run.receiver, link.signal).and_then(|entry| Some(entry.search?.coherent_s));
        stated.unwrap_or(periods * period_s)
    };
    let (mut doppler, mut code, mut cn0) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut count = 0;
    let costs_db = front_end_costs_db(run);
    let filtered = Filtered::of(run)?;
    for link in run.truth.keys() {
        let searches: Vec<&AcquisitionRow> =
            run.acquisition.iter().filter(|row| row.acquired && row.link() == link).collect();
        if searches.is_empty() {
            continue;
        }
        let Some(component) = leading(link.signal) else { continue };
        let mut truth = run.truth.finder(link)?;
        let bin_hz = 1.0 / coherent_s(link, component.period_s());
        let refinement = Refinement::of(run, link.signal);
        for row in searches {
            let Some((true_row, after_s)) = near(&mut truth, row.sample, run.scene.sample_rate_hz) else { continue };
            if !run.scene.expect.bounded(run.time_s(row.sample)) {
                continue;
            }
            count += 1;
            doppler = doppler
                .max((row.doppler_hz - true_row.doppler_hz - run.common.doppler_hz).abs() / (DOPPLER_BINS * bin_hz));
            let chips = sent_chips(
                &true_row,
                after_s - run.common.code_delay_s(link.signal),
                component.chip_rate_hz,
                f64::from(component.code_chips),
            );
            let off = (row.code_phase_chips - chips).rem_euclid(f64::from(component.code_chips));
            let off = off.min(f64::from(component.code_chips) - off);
            let gain_db = 10.0 * libm::log10(filtered.satellite(row.sample, link.sv));
            let true_dbhz = true_row.cn0_dbhz + gain_db;
            let cn0_dbhz = true_dbhz - costs_db.get(link.signal).unwrap_or(&0.0);
            let noise_chips = refinement.as_ref().map_or(0.0, |refinement| refinement.sigma_chips(cn0_dbhz));
            code = code.max(off / (CELLS / cells).max(SIGMAS * noise_chips));
            // Without noise a search finds a C/N0 of its own rounding.
            if run.scene.noise {
                cn0 = cn0.max((row.cn0_dbhz - true_dbhz).abs());
            }
        }
    }
    if count == 0 {
        return Ok(Vec::new());
    }
    Ok(vec![
        Finding::most(
            "Doppler found over half a bin of the search, largest",
            doppler,
            "of 1",
            1.0,
            "refined within a bin",
        ),
        Finding::most(
            "code phase found over two thirds of a cell of the search, largest",
            code,
            "of 1",
            1.0,
            "refined within a cell or five standard deviations of its noise",
        ),
        Finding::most(
            "C/N0 found against the true one, largest",
            cn0,
            "dB",
            CN0_DB,
            "a few milliseconds, and cell offsets",
        ),
    ])
}

/// Early and late sums of single code periods whose mean powers centre a code phase.
#[derive(Clone, Copy, Debug)]
struct Refinement {
    period_s: f64,
    /// Number of periods whose powers are added.
    periods: f64,
    /// Power that the replica finds, over the signal's.
    share: f64,
    /// Correlation at the early and late taps, and its slope there, 1/chip.
    correlation: f64,
    slope: f64,
}

impl Refinement {
    /// Refinement of a search that states its sums: its first component's strongest layer, with taps half a
    /// chip from the prompt, or a quarter of a step of its sub-carrier. `None` where it states none.
    fn of(run: &Run, signal: &Signal) -> Option<Self> {
        let searched = Entry::of(&run.receiver, signal)?.search?;
        let component = signal.components.get(*searched.components.first()?)?;
        let period_s = component.period_s();
        let layer = component.strongest().filter(|_| component.tone().is_none());
        let steps = layer.map_or(1, |layer| layer.pulse.len());
        let layers = [layer.copied().unwrap_or(Layer::BPSK)];
        let shape = Shape::between(&layers, &layers, component.chip_rate_hz);
        let at = |chips: f64| shape.correlation(chips / component.chip_rate_hz) / shape.correlation(0.0);
        let reach = if steps > 1 { 0.25 / steps as f64 } else { 0.5 };
        Some(Self {
            period_s,
            periods: f64::from(searched.sums) * searched.coherent_s / period_s,
            share: component.power_share * efficiency(component),
            correlation: at(reach),
            slope: (at(0.5 * reach) - at(reach)) / (0.5 * reach),
        })
    }

    /// Standard deviation of the refined code phase, chips, for a signal of so many dB-Hz in the samples.
    ///
    /// Early and late have the ratio s = R²·C/N0·T of signal to noise in a period. The mean power of K
    /// periods scatters by √((1 + 2s)/K) of the noise. An error of ε chips parts the two by 4·ε·R'·s/R with
    /// the slope R'.
    fn sigma_chips(&self, cn0_dbhz: f64) -> f64 {
        let snr = self.share * libm::pow(10.0, 0.1 * cn0_dbhz) * self.period_s * self.correlation.powi(2);
        self.correlation / self.slope * ((1.0 + 2.0 * snr) / self.periods).sqrt() / (8.0_f64.sqrt() * snr)
    }
}

/// The truth's row at or before a sample, and the time from it.
fn near(truth: &mut Finder<'_, Link, Observation>, sample: u64, rate_hz: f64) -> Option<(Observation, f64)> {
    let row = truth.until_sample(sample)?;
    let after_s = (sample - row.sample) as f64 / rate_hz;
    (after_s < 1.5).then_some((row, after_s))
}

/// Code phase that arrives a little after a row of the truth.
fn sent_chips(row: &Observation, after_s: f64, chip_rate_hz: f64, code_chips: f64) -> f64 {
    // Periods are whole in a second; the code runs by the Doppler's share faster.
    let rate = 1.0 + row.doppler_hz * row.signal.wavelength_m(row.sv) / SPEED_OF_LIGHT_MPS;
    ((row.sent_fraction_s + after_s * rate) * chip_rate_hz).rem_euclid(code_chips)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of a simulation in Python (numpy, 6000 searches): correlations of a BPSK code in white noise,
    /// the best of cells half a chip apart, three steps of the refinement over 16 periods of half of the
    /// power.
    #[test]
    fn refined_code_phases_scatter_as_the_judge_allows() {
        let refinement = Refinement { period_s: 1e-3, periods: 16.0, share: 0.5, correlation: 0.5, slope: 1.0 };
        for (cn0_dbhz, simulated_chips) in [(37.0, 0.108), (38.0, 0.089), (41.0, 0.056), (45.0, 0.033)] {
            // One hundredth of scatter, one of the cells' choice, half a digit.
            let ratio = refinement.sigma_chips(cn0_dbhz) / simulated_chips;
            assert!((ratio - 1.0).abs() < 0.04, "{cn0_dbhz} dB-Hz: {ratio}");
        }
    }
}
