//! Agreement of several columns about time: lock times, pseudoranges against times sent, a fix's bias against
//! its time.
//!
//! The offset of a receiver's clock from the truth's nominal time may be any constant. That constant is the
//! same for every row of every table. Limits: a receiver that sets its clock again within a run has several.
//! It may while the scene expects errors of any size, as where a spoofer's signals come late all at once:
//! rows of such a time are not compared.

use super::{Finding, Found};
use crate::error::JudgeError;
use crate::read::{Numbers, Run};
use crate::statistics::larger;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{Event, Observation};
use gnss::signal::Link;

/// Allowed error of a lock time in seconds: it counts whole updates, of which none is longer than a bit.
const LOCK_S: f64 = 0.02;
/// Largest deviation that rounding explains, metres. Pseudoranges of 1e8 m in a double are known to 2e-8 m,
/// and GPS time's fraction to 1e-16 s.
const READING_M: f64 = 1e-4;
/// Largest relative deviation of dilutions from one another.
const IDENTITY: f64 = 1e-9;

pub(super) fn findings(run: &Run) -> Result<Vec<Finding>, JudgeError> {
    let (mut lock_s, mut breaks, mut impossible) = (0.0_f64, Found::default(), Found::default());
    let mut readings = Numbers::new(run.observations.directory());
    for link in run.observations.keys() {
        lock_s = lock_s.max(locks(run, link, &mut breaks, &mut impossible)?);
        let mut truth = run.truth.finder(link)?;
        for row in run.observations.cursor(link) {
            let row = row?;
            let judged = run.scene.expect.bounded(run.time_s(row.sample));
            let Some(true_row) = truth.get(row.sample).filter(|_| judged) else { continue };
            let ahead_s = row.sent().since(true_row.sent());
            readings.push(row.pseudorange_m - true_row.pseudorange_m + SPEED_OF_LIGHT_MPS * ahead_s)?;
        }
    }
    let reading_m = readings.percentile(0.5)?;
    let mut all = vec![
        Finding::most("lock time against the samples", lock_s, "s", LOCK_S, "an update's length"),
        Finding::none("breaks of lock without an event", breaks, "lock time starts again with an event"),
        Finding::none("lock times longer than the run", impossible, "no lock is older than its acquisition"),
    ];
    if let Some(reading_m) = reading_m {
        let mut most = 0.0_f64;
        readings.each(|one| most = most.max((one - reading_m).abs()))?;
        let source = "one clock reads both";
        all.push(Finding::most("pseudorange against time sent, largest", most, "m", READING_M, source));
    }
    all.extend(fixes(run, reading_m)?);
    Ok(all)
}

/// Largest difference of lock time and samples passed; a lock that begins again needs an event.
fn locks(run: &Run, link: Link, breaks: &mut Found, impossible: &mut Found) -> Result<f64, JudgeError> {
    let events: Vec<u64> = run
        .events
        .iter()
        .filter(|row| row.link() == link)
        .filter(|row| matches!(row.event, Event::LossOfLock | Event::CycleSlip | Event::PhaseLocked | Event::Acquired))
        .map(|row| row.sample)
        .collect();
    let acquired = run.events.iter().find(|row| row.link() == link).map_or(0, |row| row.sample);
    let (mut most_s, mut before) = (0.0_f64, None::<Observation>);
    run.observations.each(link, |row| {
        let since_s = row.sample.saturating_sub(acquired) as f64 / run.scene.sample_rate_hz;
        if row.locked_s > since_s + LOCK_S || row.locked_s < 0.0 {
            impossible.add(|| format!("{} at sample {}", link.sv, row.sample));
        }
        let (sample, locked_s) = (row.sample, row.locked_s);
        let Some(old) = before.replace(row) else { return };
        let passed_s = sample.saturating_sub(old.sample) as f64 / run.scene.sample_rate_hz;
        let grown_s = locked_s - old.locked_s;
        if grown_s > -LOCK_S && (grown_s - passed_s).abs() <= LOCK_S {
            most_s = most_s.max((grown_s - passed_s).abs());
            return;
        }
        // The event may come an update after the row that shows it.
        let slack = (LOCK_S * run.scene.sample_rate_hz) as u64;
        let declared = events.iter().any(|at| (old.sample.saturating_sub(slack)..=sample + slack).contains(at));
        if !declared {
            breaks.add(|| format!("{} at sample {sample}", link.sv));
        }
    })?;
    Ok(most_s)
}

/// A fix's bias and time make the clock offset that pseudoranges have; its dilutions add up.
fn fixes(run: &Run, reading_m: Option<f64>) -> Result<Vec<Finding>, JudgeError> {
    let mut truth = run.trajectory.finder()?;
    let (mut any, mut most_m, mut most): (_, f64, Option<f64>) = (false, 0.0, None);
    run.fixes.each(|fix| {
        if let Some(true_row) = truth.get(fix.sample).filter(|_| run.scene.expect.bounded(run.time_s(fix.sample))) {
            // Both are by the scale of the fix, and what that is ahead of GPS time cancels.
            let bias_m = SPEED_OF_LIGHT_MPS * (fix.clock_bias_s - true_row.clock_bias_s);
            let one = SPEED_OF_LIGHT_MPS * fix.time().since(true_row.time()) + bias_m;
            (any, most_m) = (true, reading_m.map_or(most_m, |reading_m| most_m.max((one - reading_m).abs())));
        }
        let off = |whole: f64, a: f64, b: f64| ((a * a + b * b) / (whole * whole) - 1.0).abs();
        let new = off(fix.gdop, fix.pdop, fix.tdop).max(off(fix.pdop, fix.hdop, fix.vdop));
        most = larger(most, new);
    })?;
    let mut found = Vec::new();
    if reading_m.is_some() && any {
        let source = "time found and bias make the reading that pseudoranges have";
        found.push(Finding::most("clock bias of fixes against their time, largest", most_m, "m", READING_M, source));
    }
    if let Some(most) = most {
        let source = "squares of dilutions add up";
        found.push(Finding::most("dilutions against one another, largest difference", most, "of 1", IDENTITY, source));
    }
    Ok(found)
}
