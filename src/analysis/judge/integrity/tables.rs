//! Rows of one table: doubled, out of order, repeated, missing within a lock, without a truth.
//!
//! Limits: two rows of a satellite count as doubled at the same sample, whatever else they say. A row repeats
//! the one before where all measured values are the same to the last bit, or where one is that noise has
//! changed in a tenth of a second: what is frozen is not measured. A receiver may hold observations back
//! while all satellites vanish at once, so a gap counts only where the scene does not expect any losses.

use std::collections::{HashMap, HashSet};

use super::{Finding, Found};
use crate::error::JudgeError;
use crate::measure::errors::{Errors, Link};
use crate::read::{Numbers, Run};
use crate::statistics::median;
use gnss::facts::Losses;
use gnss::record::{Event, Fix, Observation, TrackingRow};

/// Steps beyond this many usual ones are gaps.
const GAP: f64 = 1.5;
/// Length of an update as received over the one that is stated: codes and clocks are off by 1e-4 at most.
const LONGEST_UPDATE: f64 = 1.0001;

/// Time in which every loop has been updated, and every value of it with noise.
const RENEWED_S: f64 = 0.095;

/// Repetition of measured values, row after row.
struct Repeats<const N: usize> {
    renewed: Option<u64>,
    before: Option<[u64; N]>,
    last: Option<(u64, [u64; N])>,
}

impl<const N: usize> Repeats<N> {
    /// `run` tells whether there is noise, and how many samples renew every value.
    fn of(run: &Run) -> Self {
        let renewed = (RENEWED_S * run.scene.sample_rate_hz) as u64;
        Self { renewed: run.scene.noise.then_some(renewed), before: None, last: None }
    }

    /// True if the values at a sample are equal to those before.
    fn take(&mut self, sample: u64, values: [f64; N]) -> bool {
        let values = values.map(f64::to_bits);
        let all = self.before.replace(values) == Some(values);
        let Some(renewed) = self.renewed else { return all };
        let Some((since, old)) = self.last else {
            self.last = Some((sample, values));
            return all;
        };
        if sample.saturating_sub(since) < renewed {
            return all;
        }
        self.last = Some((sample, values));
        all || old.iter().zip(&values).any(|(old, new)| old == new)
    }
}

/// Faults of rows that are sought in every table.
#[derive(Default)]
struct Rows {
    doubled: Found,
    disordered: Found,
    repeated: Found,
    missing: Found,
}

impl Rows {
    /// Two successive samples of one key.
    fn order(&mut self, table: &str, key: &str, before: u64, after: u64) {
        let at = || format!("{table} {key} at sample {after}");
        if after == before {
            self.doubled.add(at);
        } else if after < before {
            self.disordered.add(at);
        }
    }
}

pub(super) fn findings(run: &Run, errors: &Errors) -> Result<Vec<Finding>, JudgeError> {
    let mut rows = Rows::default();
    for link in run.observations.keys() {
        observations(run, link, &mut rows)?;
    }
    for link in run.tracking.keys() {
        tracking(run, link, &mut rows)?;
    }
    fixes(run, &mut rows)?;
    short(run, &mut rows);
    let orphans = Found { count: errors.unmatched, first: None };
    let lost = run.fixes.len().saturating_sub(errors.positions.len());
    Ok(vec![
        Finding::none("rows doubled", rows.doubled, "one row a satellite and sample"),
        Finding::none("rows out of time order", rows.disordered, "a receiver writes as time goes"),
        Finding::none("rows that repeat the values before", rows.repeated, "noise never repeats to the last bit"),
        Finding::none("rows missing within a lock", rows.missing, "a lock that goes on is measured at every interval"),
        Finding::none("observations without a truth", orphans, "no such satellite or sample in the scene"),
        Finding::none("fixes without a truth", Found { count: lost, first: None }, "no such sample in the scene"),
    ])
}

fn observations(run: &Run, link: Link, rows: &mut Rows) -> Result<(), JudgeError> {
    let values = |row: &Observation| [row.pseudorange_m, row.carrier_cycles, row.doppler_hz, row.cn0_dbhz];
    let (key, mut repeats) = (run.name(link), Repeats::of(run));
    let (mut steps, mut before) = (Vec::new(), None);
    run.observations.each(link, |row| {
        steps.extend(before.replace(row.sample).map(|before| row.sample as f64 - before as f64));
    })?;
    let usual = median(&steps).unwrap_or(0.0);
    drop(steps);
    let mut before: Option<Observation> = None;
    run.observations.each(link, |row| {
        if repeats.take(row.sample, values(&row)) {
            rows.repeated.add(|| format!("observation of {key} at sample {}", row.sample));
        }
        let Some(old) = before.replace(row.clone()) else { return };
        let step = row.sample as f64 - old.sample as f64;
        rows.order("observation of", &key, old.sample, row.sample);
        let locked = row.locked_s - old.locked_s;
        let due = |sample: u64| run.scene.expect.losses(link.sv, run.time_s(sample)) != Some(Losses::Any);
        // The lock is as old as before and the time that passed: it went on.
        if step > GAP * usual
            && (due(old.sample) || due(row.sample))
            && (locked - step / run.scene.sample_rate_hz).abs() < 0.5 * usual / run.scene.sample_rate_hz
        {
            rows.missing.add(|| format!("observation of {key} before sample {}", row.sample));
        }
    })
}

fn tracking(run: &Run, link: Link, rows: &mut Rows) -> Result<(), JudgeError> {
    let mut before: Option<TrackingRow> = None;
    let mut steps = Numbers::new(run.tracking.directory());
    let key = run.name(link);
    let lost: Vec<u64> = run
        .events
        .iter()
        .filter(|row| row.link() == link && matches!(row.event, Event::LossOfLock | Event::Acquired))
        .map(|row| row.sample)
        .collect();
    // A channel that ended and began again has nothing between.
    let goes_on = |old: u64, sample: u64| !lost.iter().any(|at| (old..=sample).contains(at));
    let mut stood = false;
    for row in run.tracking.cursor(link) {
        let row = row?;
        if let Some(old) = &before {
            rows.order("loop update of", &key, old.sample, row.sample);
            let values = |row: &TrackingRow| {
                [row.prompt_i, row.prompt_q, row.dll_discriminator_chips, row.pll_discriminator_cycles]
                    .map(f64::to_bits)
            };
            // Updates that last as long as rows are apart pass over an interval now and then, as codes drift.
            let update = LONGEST_UPDATE * row.integration_s * run.scene.sample_rate_hz;
            let stands = row.prompt_i != 0.0 && values(old) == values(&row);
            if stands && (stood || (row.sample - old.sample.min(row.sample)) as f64 > update) {
                rows.repeated.add(|| format!("loop update of {key} at sample {}", row.sample));
            }
            stood = stands;
            if goes_on(old.sample, row.sample) {
                steps.push(row.sample as f64 - old.sample as f64)?;
            }
        }
        before = Some(row);
    }
    let usual = steps.percentile(0.5)?.unwrap_or(0.0);
    let mut before = None;
    run.tracking.each(link, |TrackingRow { sample, .. }| {
        let step = |old: &u64| sample as f64 - *old as f64;
        if before.replace(sample).is_some_and(|old| goes_on(old, sample) && step(&old) > GAP * usual) {
            rows.missing.add(|| format!("loop update of {key} before sample {sample}"));
        }
    })
}

fn fixes(run: &Run, rows: &mut Rows) -> Result<(), JudgeError> {
    let values =
        |fix: &Fix| [fix.x_m, fix.y_m, fix.z_m, fix.vx_mps, fix.vy_mps, fix.vz_mps, fix.clock_bias_s, fix.clock_drift];
    let (mut before, mut repeats): (Option<u64>, _) = (None, Repeats::of(run));
    run.fixes.each(|fix| {
        if let Some(old) = before.replace(fix.sample) {
            rows.order("fix", "", old, fix.sample);
        }
        if repeats.take(fix.sample, values(&fix)) {
            rows.repeated.add(|| format!("fix at sample {}", fix.sample));
        }
    })
}

/// Tables of a few rows.
fn short(run: &Run, rows: &mut Rows) {
    let mut seen = HashSet::new();
    for row in &run.navigation {
        if !seen.insert((row.sample, row.content())) {
            rows.doubled.add(|| format!("{} of {} in navigation", row.parameter, row.sv));
        }
    }
    // A search is written when it ends and bears the sample of its beginning: those of one front end follow
    // one another, those of two overlap.
    let (mut searched, mut begun) = (HashSet::new(), HashMap::new());
    for row in &run.acquisition {
        if !searched.insert((row.sample, row.sv, row.signal.name)) {
            rows.doubled.add(|| format!("acquisition of {} at sample {}", row.sv, row.sample));
        }
        if begun.insert(row.signal.name, row.sample).is_some_and(|before| row.sample < before) {
            rows.disordered.add(|| format!("acquisition of {} at sample {}", row.sv, row.sample));
        }
    }
    let mut events = HashSet::new();
    for row in &run.events {
        let link = row.link();
        if !events.insert((row.sample, link, row.event as u8)) {
            rows.doubled.add(|| format!("event of {} at sample {}", row.sv, row.sample));
        }
    }
}
