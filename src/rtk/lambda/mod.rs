//! Integer least squares: the integer vectors that are nearest to a real one in the metric of its covariance.
//!
//! Sources: Teunissen 1995, "The least-squares ambiguity decorrelation adjustment", J. Geodesy 70, 65–82 (the
//! transformation Z); de Jonge and Tiberius 1996, "The LAMBDA method for integer ambiguity estimation", LGR
//! 12; Chang, Yang and Zhou 2005, "MLAMBDA", J. Geodesy 79, 552–565 (order of the permutations, search that
//! shrinks); Teunissen 1998, "Success probability of integer GPS ambiguity rounding and bootstrapping", J.
//! Geodesy 72, 606–612. Limits: entries of Z stay whole in `f64` up to 2^53; a search ends after a stated
//! number of nodes.

mod search;
#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector};
use thiserror::Error;

pub use search::MOST_NODES;

/// Reason for which there are no integers.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LambdaError {
    /// A covariance that is none.
    #[error(
        "covariance of {order} ambiguities: conditional variance {variance:e} at number {at}, expected a positive one"
    )]
    NotPositive {
        /// Number of ambiguities.
        order: usize,
        /// Ambiguity from which on it is not positive, from 0.
        at: usize,
        /// Conditional variance of that ambiguity.
        variance: f64,
    },
    /// A vector and a covariance of different orders, or none at all.
    #[error(
        "{have} ambiguities with a covariance of {rows} rows and {columns} columns: expected as many, at least one"
    )]
    Shape {
        /// Number of ambiguities.
        have: usize,
        /// Rows of the covariance.
        rows: usize,
        /// Columns of the covariance.
        columns: usize,
    },
    /// A search that found no end.
    #[error("search for {order} integers: not ended after {MOST_NODES} nodes")]
    Endless {
        /// Number of integers.
        order: usize,
    },
}

/// Float vector after decorrelation. The order of its elements is that in which bootstrapping takes them from
/// the last to the first.
#[derive(Clone, Debug)]
pub struct Decorrelated {
    /// Whole part of the original vector, which takes no part in the search.
    whole: DVector<f64>,
    /// Transformed remainder, `Zᵀ(a − whole)`.
    remainder: DVector<f64>,
    /// Unit lower triangular factor of the covariance `LᵀDL` of the transformed vector.
    lower: DMatrix<f64>,
    /// Conditional variances, the diagonal of `D`.
    variances: DVector<f64>,
    /// The transformation, whole numbers with determinant ±1.
    z: DMatrix<f64>,
    /// Inverse of the transformation, whole numbers too.
    inverse: DMatrix<f64>,
}

/// Two best integer vectors of the last elements of a decorrelated vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Integers of the transformed vector from `first` on, the best and the second best vector.
    pub vectors: [DVector<f64>; 2],
    /// Squared distances of the two from the float vector.
    pub squared_norms: [f64; 2],
    /// First element of the transformed vector that is fixed.
    pub first: usize,
}

impl Found {
    /// Squared distance of the second best vector relative to that of the best.
    pub fn ratio(&self) -> f64 {
        let [best, second] = self.squared_norms;
        if best > 0.0 { second / best } else { f64::INFINITY }
    }
}

impl Decorrelated {
    /// Decorrelates a float vector, in cycles, with its covariance, in cycles squared.
    ///
    /// # Errors
    /// [`LambdaError::Shape`] and [`LambdaError::NotPositive`].
    pub fn new(float: &DVector<f64>, covariance: &DMatrix<f64>) -> Result<Self, LambdaError> {
        let order = float.len();
        if order == 0 || covariance.shape() != (order, order) {
            let (rows, columns) = covariance.shape();
            return Err(LambdaError::Shape { have: order, rows, columns });
        }
        let (lower, variances) = factors(covariance)?;
        let whole = float.map(f64::round);
        let one = DMatrix::identity(order, order);
        let remainder = float - &whole;
        let mut made = Self { whole, remainder, lower, variances, z: one.clone(), inverse: one };
        made.reduce();
        made.remainder = made.z.transpose() * &made.remainder;
        Ok(made)
    }

    /// Number of ambiguities.
    pub fn order(&self) -> usize {
        self.variances.len()
    }

    /// Transformation to the decorrelated ambiguities `Zᵀa`.
    pub fn transformation(&self) -> &DMatrix<f64> {
        &self.z
    }

    /// Conditional variances of the decorrelated ambiguities, each by those after it, in cycles squared.
    pub fn conditional_variances(&self) -> &DVector<f64> {
        &self.variances
    }

    /// Probability that bootstrapping of the elements from `first` on gives the true integers, for errors of
    /// a normal distribution with the stated covariance: a lower bound for integer least squares (Teunissen
    /// 1998, equation 19).
    pub fn success_rate(&self, first: usize) -> f64 {
        let each = self.variances.iter().skip(first);
        let scale = planted!("rtk.lambda.success_rate", 8.0, 2.0);
        each.map(|variance| libm::erf(1.0 / (scale * variance).sqrt())).product()
    }

    /// First element from which on bootstrapping succeeds with at least this probability; `None` if the last
    /// one alone does not.
    pub fn first_for(&self, success_rate: f64) -> Option<usize> {
        (0..self.order()).find(|first| self.success_rate(*first) >= success_rate)
    }

    /// Searches for the two best integer vectors of the elements from `first` on, without regard to those
    /// before.
    ///
    /// # Errors
    /// [`LambdaError::Endless`].
    pub fn search(&self, first: usize) -> Result<Found, LambdaError> {
        let count = self.order() - first;
        let lower = self.lower.view((first, first), (count, count)).into_owned();
        let variances = self.variances.rows(first, count).into_owned();
        let float = self.remainder.rows(first, count).into_owned();
        let (mut vectors, squared_norms) = search::two_best(&lower, &variances, &float)?;
        let whole = self.z.transpose() * &self.whole;
        vectors.iter_mut().for_each(|vector| *vector += whole.rows(first, count));
        Ok(Found { vectors, squared_norms, first })
    }

    /// Vector of the original ambiguities that belongs to a whole transformed one.
    pub fn back(&self, transformed: &DVector<f64>) -> DVector<f64> {
        self.inverse.transpose() * transformed
    }

    /// Decorrelates by whole Gauss transformations and permutations, until no permutation of neighbours makes
    /// the later conditional variance smaller (Chang et al. 2005, algorithm 3.1).
    fn reduce(&mut self) {
        let order = self.order();
        if order < 2 {
            return;
        }
        let (mut at, mut not_reduced) = (order - 2, order - 2);
        loop {
            if at <= not_reduced {
                (at + 1..order).for_each(|row| self.gauss(row, at));
            }
            let below = self.lower[(at + 1, at)];
            let delta = self.variances[at] + below * below * self.variances[at + 1];
            // A gain of rounding alone would go round for ever.
            if delta < self.variances[at + 1] * (1.0 - 1e-9) {
                self.permute(at, delta);
                (at, not_reduced) = (order - 2, at);
            } else if at == 0 {
                return;
            } else {
                at -= 1;
            }
        }
    }

    /// Takes the whole part from one element of the triangular factor.
    fn gauss(&mut self, row: usize, column: usize) {
        let whole = self.lower[(row, column)].round();
        if whole == 0.0 {
            return;
        }
        for below in row..self.order() {
            self.lower[(below, column)] -= whole * self.lower[(below, row)];
        }
        for index in 0..self.order() {
            self.z[(index, column)] -= planted!("rtk.lambda.decorrelation", whole, -whole) * self.z[(index, row)];
            self.inverse[(row, index)] += whole * self.inverse[(column, index)];
        }
    }

    /// Exchanges an element with the next one; `delta` is the conditional variance that the later one gets.
    fn permute(&mut self, at: usize, delta: f64) {
        let below = self.lower[(at + 1, at)];
        let (share, other) = (self.variances[at] / delta, self.variances[at + 1] * below / delta);
        self.variances[at] = share * self.variances[at + 1];
        self.variances[at + 1] = delta;
        for column in 0..at {
            let (upper, under) = (self.lower[(at, column)], self.lower[(at + 1, column)]);
            self.lower[(at, column)] = under - below * upper;
            self.lower[(at + 1, column)] = share * upper + other * under;
        }
        self.lower[(at + 1, at)] = other;
        for row in at + 2..self.order() {
            self.lower.swap((row, at), (row, at + 1));
        }
        self.z.swap_columns(at, at + 1);
        self.inverse.swap_rows(at, at + 1);
    }
}

/// Factors `LᵀDL` of a covariance, with a unit lower triangular `L` (de Jonge and Tiberius 1996, section
/// 3.1).
fn factors(covariance: &DMatrix<f64>) -> Result<(DMatrix<f64>, DVector<f64>), LambdaError> {
    let order = covariance.nrows();
    let mut rest = covariance.clone();
    let mut lower = DMatrix::zeros(order, order);
    let mut variances = DVector::zeros(order);
    for at in (0..order).rev() {
        let variance = rest[(at, at)];
        if !(variance > 0.0 && variance.is_finite()) {
            return Err(LambdaError::NotPositive { order, at, variance });
        }
        variances[at] = variance;
        for column in 0..=at {
            lower[(at, column)] = rest[(at, column)] / variance;
        }
        for row in 0..at {
            for column in 0..=row {
                rest[(row, column)] -= variance * lower[(at, row)] * lower[(at, column)];
            }
        }
    }
    Ok((lower, variances))
}
