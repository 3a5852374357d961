//! Searches against the truth: a found satellite's Doppler, code phase and C/N0, and whether found and
//! tracked agree.
//!
//! The truth has rows every tenth of a second or so; a search in between is compared with cubics through
//! values and rates. Limits: a search that begins before the first or after the last row is not compared with
//! anything.

use std::collections::BTreeSet;

use super::{Finding, Found};
use crate::error::JudgeError;
use crate::expect::followed::Entry;
use crate::read::Run;
use crate::read::spill_store::Finder;
use crate::waveform::leading;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{AcquisitionRow, Event, Observation};
use gnss::signal::Link;

/// A refined Doppler is right within half a bin of the search: 1/(2·2T) of a coherent time of a few periods.
const DOPPLER_BINS: f64 = 0.5;
/// A refined code phase is right within two thirds of a cell of the search: a third of a chip, where there
/// are two cells a chip and the deviation at 34 dB-Hz is 0.07.
const CELLS: f64 = 2.0 / 3.0;
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

/// Largest errors of the searches that found what the scene has.
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
    for link in run.truth.keys() {
        let searches: Vec<&AcquisitionRow> =
            run.acquisition.iter().filter(|row| row.acquired && row.link() == link).collect();
        if searches.is_empty() {
            continue;
        }
        let Some(component) = leading(link.signal) else { continue };
        let mut truth = run.truth.finder(link)?;
        let bin_hz = 1.0 / coherent_s(link, component.period_s());
        for row in searches {
            let Some((true_row, after_s)) = near(&mut truth, row.sample, run.scene.sample_rate_hz) else { continue };
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
            code = code.max(off / (CELLS / cells));
            // Without noise a search finds a C/N0 of its own rounding.
            if run.scene.noise && run.scene.expect.bounded(run.time_s(row.sample)) {
                cn0 = cn0.max((row.cn0_dbhz - true_row.cn0_dbhz).abs());
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
            "refined within a cell",
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
