//! Time that the cases of a study take on one core, roughly, and the cut into shards that follows from it.
//!
//! Limits: speeds are those of one processor, and of scenes with a dozen satellites.

use super::axis;
use super::plan::{Cut, modelled};
use super::sampled::{self, Base};
use super::spec::{Level, Study};
use generator::scene::Grade;

/// Largest number of shards unless set otherwise: clusters take arrays of a thousand tasks by default.
const MOST_SHARDS: u64 = 1000;
/// Least number of shards where there are enough cases, so that a kill costs little.
const LEAST_SHARDS: u64 = 50;
/// Length of a shard unless set otherwise.
const SHARD_MINUTES: f64 = 1.0;
/// Simulated seconds per second of one core, of the loops.
const MODEL_SPEED: f64 = 3000.0;
/// Samples per second of one core, for each satellite generated and tracked at 2.6 Msps.
const SAMPLES_PER_S: f64 = 0.6e9;
/// Seconds of one satellite per second of one core, received by modelled correlations.
const CORRELATIONS_PER_S: f64 = 2000.0;
/// Seconds of one satellite per second of one core, received by modelled observations.
const OBSERVATIONS_PER_S: f64 = 20_000.0;
/// Number of satellites in a scene.
const SATELLITES: f64 = 12.0;
/// Cost of a search and of the judge, seconds.
const OVERHEAD_S: f64 = 0.5;

/// Seconds of one core that a case takes, roughly.
fn cost_s(study: &Study, bases: &[Base], case: &axis::Case) -> f64 {
    let values = study.values(case);
    match study.level {
        Level::Correlator => modelled(study, &values).map_or(1.0, |model| model.simulated_s() / MODEL_SPEED),
        level => {
            let base = bases.iter().find(|base| Some(base.written.as_path()) == study.scenario_of(case));
            let read = base.and_then(|base| sampled::read(level, base, &sampled::patched(base, &values).ok()?).ok());
            read.map_or(OVERHEAD_S, |(scenario, _)| {
                let each_s = scenario.front_ends.iter().map(|front_end| match front_end.fidelity.grade {
                    Grade::Correlations => 1.0 / CORRELATIONS_PER_S,
                    Grade::Observations => 1.0 / OBSERVATIONS_PER_S,
                    _ => front_end.rate.hz() / SAMPLES_PER_S,
                });
                let each_s: f64 = each_s.sum();
                OVERHEAD_S + scenario.duration_s * each_s * SATELLITES
            })
        }
    }
}

/// Seconds of one core that a case in the middle takes, roughly.
pub(super) fn case_s(study: &Study, bases: &[Base]) -> f64 {
    let grid = &study.grid;
    let ends = [0, grid.cases().saturating_sub(1)].map(|case| cost_s(study, bases, &grid.case(case)));
    0.5 * (ends[0] + ends[1])
}

/// Cases a shard: those that share a signal stay together.
pub(super) fn shard_size(study: &Study, bases: &[Base], cut: Cut) -> u64 {
    let (grid, case_s) = (&study.grid, case_s(study, bases));
    let of_minutes = |minutes: f64| (60.0 * minutes / case_s).clamp(1.0, grid.cases() as f64) as u64;
    let size = match cut {
        Cut::Shards(count) => grid.cases().div_ceil(count.max(1)),
        Cut::Minutes(minutes) => of_minutes(minutes),
        Cut::Default => {
            let small = of_minutes(SHARD_MINUTES).min(grid.cases().div_ceil(LEAST_SHARDS));
            small.max(grid.cases().div_ceil(MOST_SHARDS))
        }
    };
    size.max(1).next_multiple_of(grid.sharing()).min(grid.cases())
}
