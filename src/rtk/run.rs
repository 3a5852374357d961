//! A baseline from two runs, from their files to its judgement.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use crate::error::RtkError;
use crate::files;
use crate::judge::{Figures, Judge, Row};
use crate::pairs::{Choice, Pair, pairs};
use crate::rows::of_base as of_base_by_codes;
use crate::solver::{Settings, Solver};
use crate::truth::{Truth, each};
use gnss::record::Fix;

/// Source of the base's position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum BasePosition {
    /// The truth of its run, epoch by epoch.
    #[default]
    Truth,
    /// A position that is given, ECEF in metres.
    Given(Vector3<f64>),
    /// Position by the base's own codes, epoch by epoch: the base moves, and nothing else knows where it is.
    Codes,
}

/// Inputs of a baseline.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    /// Directories of the runs of base and rover, or RINEX files of observations.
    pub base: PathBuf,
    /// Run of the rover.
    pub rover: PathBuf,
    /// Navigation files; those of the runs if there is none.
    pub navigation: Vec<PathBuf>,
    /// Signals that take part.
    pub choice: Choice,
    /// Site of the base.
    pub position: BasePosition,
}

/// Baseline that was found.
#[derive(Clone, Debug)]
pub struct Baseline {
    /// Epochs.
    pub rows: Vec<Row>,
    /// Figures of all epochs.
    pub figures: Figures,
    /// True if a truth judged them.
    pub is_judged: bool,
    /// Distance of a base at rest from the mean of its own fixes, metres, if its run has fixes.
    pub base_from_fixes_m: Option<f64>,
}

/// Finds the baseline of two runs and judges it, where they have a truth.
///
/// # Errors
/// [`RtkError`]: files that cannot be read, receivers without a fix, and two that have nothing in common.
pub fn baseline(inputs: &Inputs, settings: Settings) -> Result<Baseline, RtkError> {
    let base = files::receiver(&inputs.base, "base")?;
    let rover = files::receiver(&inputs.rover, "rover")?;
    let orbits = files::orbits([&inputs.base, &inputs.rover], &inputs.navigation)?;
    let pairs = pairs(&base, &rover, &orbits, &inputs.choice)?;
    let truths = [Truth::read(&inputs.base)?, Truth::read(&inputs.rover)?];
    let fixes = fixes(&inputs.base)?;
    solve(&pairs, [&truths[0], &truths[1]], inputs, (settings, fixes))
}

/// Solves epochs that are in memory.
///
/// # Errors
/// [`RtkError::NoPosition`].
pub fn solve(
    pairs: &[Pair],
    [of_base, of_rover]: [&Option<Truth>; 2],
    inputs: &Inputs,
    (settings, fixes): (Settings, Option<Vector3<f64>>),
) -> Result<Baseline, RtkError> {
    let truths = of_base.as_ref().zip(of_rover.as_ref()).map(|(base, rover)| [base, rover]);
    let judge = Judge::new(settings.belief.success_rate);
    let (mut solver, mut judge, mut rows) = (Solver::new(settings), judge, Vec::new());
    let resting_m = match inputs.position {
        BasePosition::Given(given_m) => Some(given_m),
        BasePosition::Truth => of_base.as_ref().and_then(Truth::resting_m),
        BasePosition::Codes => None,
    };
    let mut by_codes_m = None;
    let mut off_m: Option<f64> = None;
    for pair in pairs {
        let true_m = of_base.as_ref().and_then(|truth| truth.position_m(pair.labels[0]));
        let base_m = match inputs.position {
            BasePosition::Given(given_m) => Some(given_m),
            BasePosition::Truth => true_m.or(resting_m),
            BasePosition::Codes => {
                let found_m = of_base_by_codes(pair, by_codes_m, settings.mask_rad);
                by_codes_m = found_m.or(by_codes_m);
                found_m
            }
        };
        // Between two rows of its truth, or with too few codes, a base that moves has no position.
        let Some(base_m) = base_m else {
            solver.pass(pair);
            continue;
        };
        if let Some(true_m) = true_m {
            let own_m = (base_m - true_m).norm();
            off_m = Some(off_m.map_or(own_m, |most_m| most_m.max(own_m)));
        }
        let solved = solver.epoch(pair, &base_m);
        rows.push(judge.take(pair, &base_m, &solved, truths));
    }
    if rows.is_empty() {
        return Err(RtkError::NoPosition { path: inputs.base.clone() });
    }
    let mut figures = judge.finish();
    figures.base_off_m = off_m;
    let base_from_fixes_m = fixes.zip(resting_m).map(|(fixes, resting_m)| (fixes - resting_m).norm());
    Ok(Baseline { rows, figures, is_judged: truths.is_some(), base_from_fixes_m })
}

/// Mean of a run's fixes.
fn fixes(run: &Path) -> Result<Option<Vector3<f64>>, RtkError> {
    let path = run.join("rx").join("fixes.csv");
    if !path.exists() {
        return Ok(None);
    }
    let (mut sum_m, mut count) = (Vector3::zeros(), 0_u32);
    each(&path, |fix: Fix| {
        sum_m += fix.position_m();
        count += 1;
    })?;
    Ok((count > 0).then(|| sum_m / f64::from(count)))
}
