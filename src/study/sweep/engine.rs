//! Running a plan: missing shards on all cores of this machine.
//!
//! Groups of cases that share a signal are the unit of work; whichever core is free takes the next one, so
//! that shards are finished one after the other and the last ones fill all cores too. A shard is committed by
//! whoever finishes its last group. What a killed run had not committed is computed again: at most about as
//! many shards as there are cores.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use super::plan::Plan;
use super::shard::{self, CaseFigures, Found};
use super::spec::Level;
use super::{StudyError, plan, sampled, temporary};

/// State of a study's shards.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// Numbers of shards that are there and whole.
    pub whole: Vec<u32>,
    /// Numbers of shards that are not there.
    pub missing: Vec<u32>,
    /// Among the missing: those that are there and cannot be used, and why.
    pub bad: Vec<(u32, String)>,
}

/// Looks at every shard.
///
/// # Errors
/// A file that cannot be read.
pub fn status(plan: &Plan) -> Result<Status, StudyError> {
    let mut status = Status::default();
    for number in 0..plan.shards() {
        match shard::find(plan, number)? {
            Found::Whole(_) => status.whole.push(number),
            found => {
                status.missing.push(number);
                if let Found::Bad(reason) = found {
                    status.bad.push((number, reason));
                }
            }
        }
    }
    Ok(status)
}

/// Result of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ran {
    /// Shards that were made.
    pub shards: u32,
    /// Cases in them.
    pub cases: u64,
}

/// A shard in the making.
struct Making {
    shard: u32,
    first_case: u64,
    state: Mutex<(Vec<Option<CaseFigures>>, u64)>,
}

/// Runs these shards; `progress` gets how many of their cases are done.
///
/// # Errors
/// The first case or file that fails. What was committed stays.
pub fn run(plan: &Plan, shards: &[u32], progress: &(dyn Fn(u64) + Sync)) -> Result<Ran, StudyError> {
    run_while(plan, shards, progress, &|| true)
}

/// [`run`] as long as `goes_on` says so.
///
/// # Errors
/// Errors of [`run`], and [`StudyError::Stopped`].
pub fn run_while(
    plan: &Plan,
    shards: &[u32],
    progress: &(dyn Fn(u64) + Sync),
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Result<Ran, StudyError> {
    temporary::sweep(&plan.shard_directory());
    let sharing = plan.study.grid.sharing();
    let makings: Vec<Making> = shards
        .iter()
        .map(|&shard| {
            let cases = plan.cases(shard);
            let count = (cases.end - cases.start) as usize;
            Making { shard, first_case: cases.start, state: Mutex::new((Vec::new(), count as u64)) }
        })
        .collect();
    let groups = makings.iter().flat_map(|making| {
        let cases = plan.cases(making.shard);
        let end = cases.end;
        cases.step_by(sharing as usize).map(move |first| (making, first..(first + sharing).min(end)))
    });
    let (done, failed) = (AtomicU64::new(0), AtomicBool::new(false));
    let reason: Mutex<Option<StudyError>> = Mutex::new(None);
    let halt = || failed.load(Ordering::Relaxed) || !goes_on();
    groups.par_bridge().for_each(|(making, cases)| {
        let worked = if halt() { Err(StudyError::Stopped) } else { work(plan, making, cases.clone(), &halt) };
        match worked {
            Ok(()) => {
                let count = cases.end - cases.start;
                progress(done.fetch_add(count, Ordering::Relaxed) + count);
            }
            // The others end early and say that they were stopped: the first reason counts.
            Err(error) => {
                failed.store(true, Ordering::Relaxed);
                if let Ok(mut reason) = reason.lock() {
                    reason.get_or_insert(error);
                }
            }
        }
    });
    match reason.into_inner() {
        Ok(None) => Ok(Ran { shards: shards.len() as u32, cases: done.into_inner() }),
        Ok(Some(error)) => Err(error),
        Err(_) => Err(StudyError::Bug("a worker panicked".to_owned())),
    }
}

/// Runs cases that share a signal, and commits their shard if they were its last.
fn work(
    plan: &Plan,
    making: &Making,
    cases: std::ops::Range<u64>,
    halt: &(dyn Fn() -> bool + Sync),
) -> Result<(), StudyError> {
    let rows = rows(plan, cases.clone(), halt)?;
    // A poisoned lock means that a thread has panicked; the run ends with it anyway.
    let mut state = making.state.lock().map_err(|_| StudyError::Bug("a worker panicked".to_owned()))?;
    let (slots, left) = &mut *state;
    if slots.is_empty() {
        slots.resize(*left as usize, None);
    }
    for (case, row) in cases.zip(rows) {
        if let Some(slot) = slots.get_mut((case - making.first_case) as usize) {
            *slot = Some(row);
            *left -= 1;
        }
    }
    if *left > 0 {
        return Ok(());
    }
    let rows: Vec<CaseFigures> = std::mem::take(slots).into_iter().flatten().collect();
    drop(state);
    let bytes = shard::render(plan, making.shard, &rows);
    if let Found::Bad(_) = shard::find(plan, making.shard)? {
        shard::discard(plan, making.shard)?;
    }
    shard::commit(plan, making.shard, &bytes)
}

/// Figures of cases that share a signal.
fn rows(
    plan: &Plan,
    cases: std::ops::Range<u64>,
    halt: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<CaseFigures>, StudyError> {
    let study = &plan.study;
    let cases: Vec<_> = cases.map(|number| study.grid.case(number)).collect();
    match study.level {
        Level::Correlator => cases
            .iter()
            .map(|case| {
                let model = plan::modelled(study, &study.values(case)).map_err(|reason| StudyError::Case {
                    origin: study.origin.clone(),
                    case: case.number,
                    values: study.values_text(case),
                    reason,
                })?;
                if halt() {
                    return Err(StudyError::Stopped);
                }
                Ok(model.figures(study.seed_of(case, ""), &study.keep))
            })
            .collect(),
        _ => {
            let base = cases.first().and_then(|case| plan.base(case));
            let base = base.ok_or_else(|| StudyError::Bug("a case without a scene".to_owned()))?;
            sampled::run(study, base, &cases, &plan.shard_directory(), halt)
        }
    }
}
