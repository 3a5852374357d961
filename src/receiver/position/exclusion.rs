//! Which ranges contradict the others: the residual test, and the search for the fewest that have to go.
//!
//! A weighted sum of squared residuals above its chi-square threshold shows a fault, not where it is. All
//! sets of one satellite are tried, then all of two, and so on, as far as at least one degree of freedom is
//! left to prove the rest: a set of the smallest size that leaves ranges which agree is left out. Leaving out
//! one after another instead is deceived by two equal faults, as the first to go may be a good one. Sets are
//! ranked by the exact change of the sum of squares in the linearised problem, wᵀS⁻¹w of the set's own
//! normalised residuals and their covariance; only the best few are solved.
//!
//! Where two sets leave ranges that agree within themselves but on different places, nothing tells which is
//! right: then there is no position ([`NoFix::Ambiguous`]). Places nearer than what a wrong model of the
//! atmosphere does are no faults told apart: the best fit serves. Limits: faults on so many satellites that
//! good ones are the minority, and faults that happen to fit another position: n − 4 directions are all that
//! residuals see.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::NoFix;
use super::least_squares::{self, Corrections, Range, Solution, UNKNOWNS};
use crate::gnss::satellite::Sv;

/// Sets of one size that are tried: all five of twelve satellites, all four of thirteen.
const LARGEST_TRIED: usize = 1000;
/// Sets of one size that are solved.
const SOLVED: usize = 8;
/// How far apart an atmosphere that is modelled wrongly takes two sets: a troposphere of 2.4 m at the zenith
/// is 14 m at 10°, and one satellite's range moves a position by about as much.
const ATMOSPHERE_M: f64 = 20.0;

/// The value that chi-square with so many degrees of freedom exceeds with the probability `false_alarm`.
pub fn chi_square_threshold(freedom: usize, false_alarm: f64) -> f64 {
    ChiSquared::new(freedom as f64).map_or(f64::INFINITY, |law| law.inverse_cdf(1.0 - false_alarm))
}

/// Ranges that agree, their solution, and satellites left out with their residuals before.
pub type Consistent = (Vec<Range>, Solution, Vec<(Sv, f64)>);

/// Solves, and leaves out the fewest satellites without which the residuals fit.
///
/// # Errors
/// As [`least_squares::position`]; [`NoFix::Inconsistent`] when a fault shows but no set explains it, [`NoFix::Ambiguous`] when
/// several do and lead to different places.
pub fn consistent(
    ranges: Vec<Range>,
    start_m: Vector3<f64>,
    corrections: &Corrections,
    false_alarm: f64,
) -> Result<Consistent, NoFix> {
    let all = least_squares::position(&ranges, start_m, corrections)?;
    // Four ranges always fit, which proves nothing: as many as that are never left after an exclusion.
    let freedom = ranges.len() - UNKNOWNS;
    let threshold = chi_square_threshold(freedom.max(1), false_alarm);
    if freedom == 0 || all.chi_square <= planted!("receiver.raim.threshold", threshold, 100.0 * threshold) {
        return Ok((ranges, all, Vec::new()));
    }
    for size in 1..freedom {
        let Some(ranked) = ranked(&all, size) else { break };
        let limit = chi_square_threshold(freedom - size, false_alarm);
        let mut fitting: Vec<(Vec<usize>, Solution)> = (ranked.into_iter().take(SOLVED))
            .filter_map(|set| {
                let solution = least_squares::position(&without(&ranges, &set), all.position_m, corrections).ok()?;
                (solution.chi_square <= limit).then_some((set, solution))
            })
            .collect();
        fitting.sort_by(|a, b| a.1.chi_square.total_cmp(&b.1.chi_square));
        let mut fitting = fitting.into_iter();
        let Some((set, solution)) = fitting.next() else { continue };
        if let Some((other, rival)) = fitting.find(|(_, rival)| elsewhere(&solution, rival, false_alarm)) {
            let names = |set: &[usize]| set.iter().map(|&index| ranges[index].sv).collect();
            let separation_m = (solution.position_m - rival.position_m).norm();
            return Err(NoFix::Ambiguous { one: names(&set), other: names(&other), separation_m });
        }
        let excluded = set.iter().map(|&index| (ranges[index].sv, all.residuals_m[index])).collect();
        return Ok((without(&ranges, &set), solution, excluded));
    }
    Err(NoFix::Inconsistent { chi_square: all.chi_square, threshold })
}

/// The ranges but for those of an ascending set.
fn without(ranges: &[Range], set: &[usize]) -> Vec<Range> {
    let kept = ranges.iter().enumerate().filter(|(index, _)| !set.contains(index));
    kept.map(|(_, range)| range.clone()).collect()
}

/// All sets of `size` ranges, those first whose removal leaves the smallest sum of squares; `None` if there
/// are too many.
fn ranked(solution: &Solution, size: usize) -> Option<Vec<Vec<usize>>> {
    let sets = sets(solution.residuals_m.len(), size)?;
    // Behind position and clock: the ionosphere's three common errors, of unit prior deviation.
    let rows: Vec<SVector<f64, 7>> = (solution.sights.iter().zip(&solution.sigmas_m).zip(&solution.commons_m))
        .map(|((sight, sigma_m), common_m)| {
            let row = [-sight.x, -sight.y, -sight.z, 1.0, common_m.x, common_m.y, common_m.z];
            SVector::<f64, 7>::from(row) / *sigma_m
        })
        .collect();
    let prior = SMatrix::<f64, 7, 7>::from_diagonal(&SVector::from([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]));
    let normal = rows.iter().fold(prior, |sum, row| sum + row * row.transpose());
    let covariance = normal.cholesky()?.inverse();
    let normalised: Vec<f64> =
        solution.residuals_m.iter().zip(&solution.sigmas_m).map(|(residual, sigma)| residual / sigma).collect();
    let left = |set: &[usize]| {
        let seen = DMatrix::from_fn(set.len(), set.len(), |a, b| {
            let unity = if a == b { 1.0 } else { 0.0 };
            unity - (rows[set[a]].transpose() * covariance * rows[set[b]])[(0, 0)]
        });
        let of = DVector::from_fn(set.len(), |a, _| normalised[set[a]]);
        // No inverse: the rest gives no position without the set.
        seen.cholesky().map_or(f64::INFINITY, |seen| solution.chi_square - of.dot(&seen.solve(&of)))
    };
    let mut ranked: Vec<(f64, Vec<usize>)> = sets.into_iter().map(|set| (left(&set), set)).collect();
    ranked.sort_by(|a, b| planted!("receiver.raim.choice", a.0.total_cmp(&b.0), b.0.total_cmp(&a.0)));
    Some(ranked.into_iter().map(|(_, set)| set).collect())
}

/// All ascending sets of `size` numbers below `count`; `None` if there are more than are tried.
fn sets(count: usize, size: usize) -> Option<Vec<Vec<usize>>> {
    let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
    for _ in 0..size {
        sets = (sets.iter())
            .flat_map(|set| {
                let next = set.last().map_or(0, |last| last + 1);
                (next..count).map(move |more| [&set[..], &[more]].concat())
            })
            .collect();
        if sets.len() > LARGEST_TRIED {
            return None;
        }
    }
    Some(sets)
}

/// Whether two solutions lie further apart than the noise of both explains at that probability. What both share is
/// counted twice, so that only clear separations count.
fn elsewhere(one: &Solution, other: &Solution, false_alarm: f64) -> bool {
    let block = |solution: &Solution| -> Matrix3<f64> { solution.covariance.fixed_view::<3, 3>(0, 0).into_owned() };
    let apart_m = one.position_m - other.position_m;
    if apart_m.norm() < ATMOSPHERE_M {
        return false;
    }
    (block(one) + block(other))
        .cholesky()
        .is_none_or(|both| apart_m.dot(&both.solve(&apart_m)) > chi_square_threshold(3, false_alarm))
}
