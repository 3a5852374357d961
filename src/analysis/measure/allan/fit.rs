//! Strengths of the power-law noises behind an Allan deviation.
//!
//! ln σ²(τ) is fitted by ln Σ h_α × closed form (see [`crate::expect::theory::clock`]), each point
//! weighted by half its degrees of freedom, the inverse variance of ln χ². No h is negative, and one is
//! admitted only if it lowers the sum of squares by four. Limits: estimates at different τ are correlated, so
//! no errors of h are given; white and flicker phase noise differ by a logarithm only and share what there is
//! of either.

use nalgebra::{DMatrix, DVector};

use super::Point;
use crate::expect::theory::clock::{EXPONENTS, PowerLaw, allan_variance_of_each};

/// Reduction of the weighted sum of squares that a further noise must bring: that of two standard deviations.
const WORTH: f64 = 4.0;
/// Steps of Gauss and Newton, of which fewer than ten are needed.
const STEPS: usize = 50;

/// An estimate to be fitted.
struct Datum {
    variance: f64,
    weight: f64,
    /// Variance with h = 1 of each noise.
    units: [f64; 5],
}

/// Fits noises up to `cutoff_hz` to (overlapping) Allan deviations; `None` without a point that has degrees
/// of freedom.
pub fn power_law(points: &[Point], cutoff_hz: f64) -> Option<PowerLaw> {
    let data: Vec<Datum> = points
        .iter()
        .filter_map(|point| {
            let weight = 0.5 * point.freedom?;
            let variance = point.deviation * point.deviation;
            Some(Datum { variance, weight, units: allan_variance_of_each(point.tau_s, cutoff_hz) })
        })
        .collect();
    let sets = 1_u32..1 << EXPONENTS.len();
    let fits = sets.filter_map(|set| {
        let members: Vec<usize> = (0..EXPONENTS.len()).filter(|noise| set >> noise & 1 == 1).collect();
        let (law, squares) = fit(&data, &members)?;
        Some((law, squares + WORTH * members.len() as f64))
    });
    fits.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(law, _)| law)
}

/// The best strengths of these noises alone, with their sum of squares; `None` unless all are positive.
fn fit(data: &[Datum], members: &[usize]) -> Option<(PowerLaw, f64)> {
    if data.len() < members.len() {
        return None;
    }
    let mut law = PowerLaw::default();
    let mut squares = f64::INFINITY;
    // The first linearisation is about the data themselves.
    let mut about: Vec<f64> = data.iter().map(|datum| datum.variance).collect();
    for _ in 0..STEPS {
        let next = step(data, members, &about)?;
        about = data.iter().map(|datum| model(&next, datum)).collect();
        let sum = data.iter().zip(&about).map(|(datum, model)| cost(datum, *model)).sum::<f64>();
        // Steps end where they no longer help: at the minimum to rounding.
        let helps = sum < squares * (1.0 - 1e-9);
        if !helps {
            break;
        }
        (law, squares) = (next, sum);
    }
    squares.is_finite().then_some((law, squares))
}

fn model(law: &PowerLaw, datum: &Datum) -> f64 {
    law.h.iter().zip(datum.units).map(|(h, unit)| h * unit).sum()
}

fn cost(datum: &Datum, model: f64) -> f64 {
    let miss = libm::log(datum.variance / model);
    datum.weight * miss * miss
}

/// Weighted least squares of ln σ² linearised about `about`: ln(σ²/about) + 1 = Σ h × unit/about.
fn step(data: &[Datum], members: &[usize], about: &[f64]) -> Option<PowerLaw> {
    let rows = data.len();
    // Columns scaled to unit length: the h of a clock span twenty decades.
    let entry = |row: usize, column: usize| data[row].weight.sqrt() * data[row].units[members[column]] / about[row];
    let mut matrix = DMatrix::from_fn(rows, members.len(), entry);
    let lengths: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    for (mut column, length) in matrix.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let right = |row: usize| data[row].weight.sqrt() * (libm::log(data[row].variance / about[row]) + 1.0);
    let solution = matrix.svd(true, true).solve(&DVector::from_fn(rows, |row, _| right(row)), 1e-12).ok()?;
    let mut law = PowerLaw::default();
    for ((value, length), noise) in solution.iter().zip(&lengths).zip(members) {
        law.h[*noise] = Some(value / length).filter(|h| *h > 0.0)?;
    }
    Some(law)
}
