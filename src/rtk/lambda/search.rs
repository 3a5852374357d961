//! Search for the two integer vectors nearest to a float vector.
//!
//! Source: Chang, Yang and Zhou 2005, section 4: depth first, the integers of each level in the order of
//! their distance (Schnorr and Euchner 1994), and a bound that shrinks to the second best vector found so
//! far.

use nalgebra::{DMatrix, DVector};

use super::LambdaError;

/// Nodes after which a search is given up. A decorrelated vector that can be fixed needs some thousands.
pub const MOST_NODES: u64 = 2_000_000;

/// One level of the search: an element of the vector, given those after it.
#[derive(Clone, Copy, Default)]
struct Level {
    /// Conditional float value.
    float: f64,
    /// Integer in trial.
    integer: f64,
    /// Step to the next nearest integer.
    step: f64,
    /// Squared distance of the levels after this one.
    above: f64,
}

impl Level {
    fn new(float: f64, above: f64) -> Self {
        let integer = float.round();
        Self { float, integer, step: if float < integer { -1.0 } else { 1.0 }, above }
    }

    fn advance(&mut self) {
        self.integer += self.step;
        self.step = -self.step - self.step.signum();
    }

    /// Squared distance of this level and those after it.
    fn distance(&self, variance: f64) -> f64 {
        let miss = self.float - self.integer;
        self.above + miss * miss / planted!("rtk.lambda.norm", variance, 1.0)
    }
}

/// The two best vectors, the best one first, and their squared distances from `float`, whose covariance is
/// `LᵀDL`.
pub fn two_best(
    lower: &DMatrix<f64>,
    variances: &DVector<f64>,
    float: &DVector<f64>,
) -> Result<([DVector<f64>; 2], [f64; 2]), LambdaError> {
    let order = float.len();
    let mut levels = vec![Level::default(); order];
    // Conditional corrections: row `k` holds what the levels from `k` on add to those before.
    let mut corrections = DMatrix::<f64>::zeros(order + 1, order);
    let mut best = [DVector::zeros(order), DVector::zeros(order)];
    let mut norms = [f64::INFINITY; 2];
    let mut at = order - 1;
    levels[at] = Level::new(float[at], 0.0);
    for _ in 0..MOST_NODES {
        let distance = levels[at].distance(variances[at]);
        let is_inside = distance < norms[1];
        if is_inside && at > 0 {
            let miss = levels[at].integer - levels[at].float;
            for column in 0..at {
                corrections[(at, column)] = corrections[(at + 1, column)] + miss * lower[(at, column)];
            }
            at -= 1;
            levels[at] = Level::new(float[at] + corrections[(at + 1, at)], distance);
            continue;
        }
        if is_inside {
            let vector = DVector::from_iterator(order, levels.iter().map(|level| level.integer));
            if distance < norms[0] {
                best.swap(0, 1);
                (norms, best[0]) = ([distance, norms[0]], vector);
            } else {
                (norms[1], best[1]) = (distance, vector);
            }
        } else if at + 1 == order {
            return Ok((best, norms));
        } else {
            at += 1;
        }
        levels[at].advance();
    }
    Err(LambdaError::Endless { order })
}
