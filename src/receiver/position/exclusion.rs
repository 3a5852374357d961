//! Exclusion of ranges that contradict the others: the residual test, and the search for the fewest to leave
//! out.
//!
//! A weighted sum of squared residuals above its chi-square threshold shows a fault, but not its position.
//! All sets of one satellite are tried, then all of two, and so on, as long as one degree of freedom is left
//! as proof. The smallest set that leaves consistent ranges is left out. Leaving out one range after another
//! would be deceived by two equal faults, because the first to go may be a good one. Sets are ranked by the
//! exact change of the sum of squares in the linearised problem. It is wᵀS⁻¹w of the set's own normalised
//! residuals and their covariance. Only the best few are solved.
//!
//! Two sets may leave consistent ranges at different positions. Nothing then shows which is right, and there
//! is no position ([`NoFix::Ambiguous`]). Positions within the effect of a wrong atmosphere model are not
//! separate faults, and the best fit is used. Limits: faults on so many satellites that good ones are the
//! minority, and faults that happen to fit another position. Residuals see only as many directions as there
//! are degrees of freedom.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::least_squares::{self, Corrections, Range, Solution, freedom};
use super::{NoFix, Solver};
use gnss::satellite::Sv;

/// Sets of one size that are tried: all five of twelve satellites, all four of thirteen.
const LARGEST_TRIED: usize = 1000;
/// Sets of one size that are solved.
const SOLVED: usize = 8;
/// Separation of two solutions in metres that a wrong model of the atmosphere causes. A troposphere of 2.4 m
/// at the zenith is 14 m at 10°. One satellite's range moves a position by about as much.
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
/// Errors of [`least_squares::position`]; [`NoFix::Inconsistent`] when a fault shows but no set explains it,
/// [`NoFix::Ambiguous`] when several do and lead to different positions.
pub fn consistent(
    ranges: Vec<Range>,
    start_m: Vector3<f64>,
    corrections: &Corrections,
    false_alarm: f64,
) -> Result<Consistent, NoFix> {
    let all = least_squares::position(&ranges, start_m, corrections)?;
    without_faults(ranges, all, corrections, false_alarm)
}

/// Leaves out the fewest satellites without which the residuals of a solution of all ranges fit.
///
/// # Errors
/// Errors of [`consistent`].
pub fn without_faults(
    ranges: Vec<Range>,
    all: Solution,
    corrections: &Corrections,
    false_alarm: f64,
) -> Result<Consistent, NoFix> {
    // Four ranges always fit, which proves nothing: as many as that are never left after an exclusion.
    let freedom = freedom(&ranges).max(0) as usize;
    let threshold = chi_square_threshold(freedom.max(1), false_alarm);
    if freedom == 0 || all.chi_square <= planted!("receiver.raim.threshold", threshold, 100.0 * threshold) {
        return Ok((ranges, all, Vec::new()));
    }
    let satellites = satellites(&ranges);
    for size in 1..freedom {
        let Some(ranked) = ranked(&all, &satellites, size) else { break };
        let mut fitting: Vec<(Vec<usize>, Solution)> = (ranked.into_iter().take(SOLVED))
            .filter_map(|set| {
                let kept = without(&ranges, &set);
                let left = usize::try_from(least_squares::freedom(&kept)).ok().filter(|left| *left > 0)?;
                let solution = least_squares::position(&kept, all.position_m, corrections).ok()?;
                (solution.chi_square <= chi_square_threshold(left, false_alarm)).then_some((set, solution))
            })
            .collect();
        fitting.sort_by(|a, b| a.1.chi_square.total_cmp(&b.1.chi_square));
        let mut fitting = fitting.into_iter();
        let Some((set, solution)) = fitting.next() else { continue };
        if let Some((other, rival)) = fitting.find(|(_, rival)| elsewhere(&solution, rival, false_alarm)) {
            let names = |set: &[usize]| {
                let mut names: Vec<Sv> = set.iter().map(|&index| ranges[index].sv).collect();
                names.dedup();
                names
            };
            let separation_m = (solution.position_m - rival.position_m).norm();
            return Err(NoFix::Ambiguous { one: names(&set), other: names(&other), separation_m });
        }
        let mut excluded: Vec<(Sv, f64)> =
            set.iter().map(|&index| (ranges[index].sv, all.residuals_m[index])).collect();
        excluded.dedup_by_key(|(sv, _)| *sv);
        return Ok((without(&ranges, &set), solution, excluded));
    }
    Err(NoFix::Inconsistent { chi_square: all.chi_square, threshold })
}

/// Weighted sum of squared residuals of a solution of all ranges, and its degrees of freedom; `None` without
/// any.
pub(super) fn tested(ranges: &[Range], all: &Solution) -> Option<(f64, usize)> {
    let freedom = usize::try_from(freedom(ranges)).ok().filter(|freedom| *freedom > 0)?;
    Some((all.chi_square, freedom))
}

impl Solver {
    /// Residual test of all ranges in the latest solution, before any was left out: the weighted sum of
    /// squares, and its degrees of freedom. `None` without one since it was asked for last.
    pub fn take_tested(&mut self) -> Option<(f64, usize)> {
        self.tested.take()
    }
}

/// The ranges but for those of an ascending set.
fn without(ranges: &[Range], set: &[usize]) -> Vec<Range> {
    let kept = ranges.iter().enumerate().filter(|(index, _)| !set.contains(index));
    kept.map(|(_, range)| range.clone()).collect()
}

/// Indices of the ranges of each satellite: a fault of it is in all of them.
fn satellites(ranges: &[Range]) -> Vec<Vec<usize>> {
    let mut groups: Vec<(Sv, Vec<usize>)> = Vec::new();
    for (index, range) in ranges.iter().enumerate() {
        match groups.iter_mut().find(|(sv, _)| *sv == range.sv) {
            Some((_, group)) => group.push(index),
            None => groups.push((range.sv, vec![index])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// The ranges of all sets of `size` satellites, those first whose removal leaves the smallest sum of squares;
/// `None` if there are too many.
fn ranked(solution: &Solution, satellites: &[Vec<usize>], size: usize) -> Option<Vec<Vec<usize>>> {
    let sets = sets(satellites.len(), size)?.into_iter().map(|set| {
        let mut ranges: Vec<usize> = set.iter().flat_map(|&group| satellites[group].iter().copied()).collect();
        ranges.sort_unstable();
        ranges
    });
    // Behind position and clocks: the ionosphere's three common errors, of unit prior deviation.
    let unknowns = solution.covariance.nrows();
    let rows: Vec<DVector<f64>> = (0..solution.sights.len())
        .filter_map(|index| {
            let row = solution.row(index)?;
            let all = row.iter().chain(solution.commons_m.get(index)?.iter()).copied();
            Some(DVector::from_iterator(unknowns + 3, all) / *solution.sigmas_m.get(index)?)
        })
        .collect();
    let prior = DMatrix::from_fn(unknowns + 3, unknowns + 3, |a, b| f64::from(u8::from(a == b && a >= unknowns)));
    let normal = rows.iter().fold(prior, |mut sum, row| {
        sum.ger(1.0, row, row, 1.0);
        sum
    });
    let covariance = normal.cholesky()?.inverse();
    let normalised: Vec<f64> =
        solution.residuals_m.iter().zip(&solution.sigmas_m).map(|(residual, sigma)| residual / sigma).collect();
    let left = |set: &[usize]| {
        let seen = DMatrix::from_fn(set.len(), set.len(), |a, b| {
            let unity = if a == b { 1.0 } else { 0.0 };
            unity - rows[set[a]].dot(&(&covariance * &rows[set[b]]))
        });
        let of = DVector::from_fn(set.len(), |a, _| normalised[set[a]]);
        // No inverse: the rest gives no position without the set.
        seen.cholesky().map_or(f64::INFINITY, |seen| solution.chi_square - of.dot(&seen.solve(&of)))
    };
    let mut ranked: Vec<(f64, Vec<usize>)> = sets.map(|set| (left(&set), set)).collect();
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

/// True if two solutions lie further apart than the noise of both explains at that probability. Common noise
/// is counted twice, so that only clear separations count.
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
