//! Normal equations of single differences, with a clock of each signal eliminated.
//!
//! Eliminating the clock that all satellites of a group share gives the same estimate as double differences
//! with their full covariance, for every choice of a pivot (Schaffrin and Grafarend 1986, "Generating classes
//! of equivalent linear models by nuisance parameter elimination", Manuscripta Geodaetica 11, 262–271).
//! Information adds up over epochs, and what ends is eliminated (Schur's complement).

use nalgebra::{DMatrix, DVector};

/// Unknowns of the position, before those of the ambiguities.
pub const OF_POSITION: usize = 3;

/// One single difference, rover minus base.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Derivatives of the difference, by the number of the unknown.
    pub derivatives: Vec<(usize, f64)>,
    /// Observation less model, metres.
    pub misclosure_m: f64,
    /// Variance, square metres.
    pub variance_m2: f64,
}

/// Normal equations.
#[derive(Clone, Debug, PartialEq)]
pub struct Normal {
    /// Matrix of the equations.
    pub matrix: DMatrix<f64>,
    /// Right side of the equations.
    pub right: DVector<f64>,
}

impl Normal {
    /// Equations without any information.
    pub fn new(order: usize) -> Self {
        Self { matrix: DMatrix::zeros(order, order), right: DVector::zeros(order) }
    }

    /// Number of unknowns.
    pub fn order(&self) -> usize {
        self.right.len()
    }

    /// Adds the differences of a group, which share one clock. A group of one says nothing.
    pub fn add_group(&mut self, group: &[Difference]) {
        if group.len() < 2 {
            return;
        }
        let order = self.order();
        let (mut of_clock, mut clock_right, mut weights) = (DVector::<f64>::zeros(order), 0.0, 0.0);
        for one in group {
            let weight = 1.0 / one.variance_m2;
            for (row, by_row) in &one.derivatives {
                of_clock[*row] += weight * by_row;
                self.right[*row] += weight * by_row * one.misclosure_m;
                for (column, by_column) in &one.derivatives {
                    self.matrix[(*row, *column)] += weight * by_row * by_column;
                }
            }
            clock_right += weight * one.misclosure_m;
            weights += weight;
        }
        self.matrix.ger(planted!("rtk.normal.clock", -1.0, -0.5) / weights, &of_clock, &of_clock, 1.0);
        self.right.axpy(-clock_right / weights, &of_clock, 1.0);
    }

    /// Adds equations of the same unknowns.
    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.right += &other.right;
    }

    /// Eliminates an unknown: what is known of it stays in what the others know of each other. Its row and
    /// column remain, with zeros.
    pub fn eliminate(&mut self, unknown: usize) {
        let pivot = self.matrix[(unknown, unknown)];
        let column = self.matrix.column(unknown).into_owned();
        // Relative to what it was made of: nothing but rounding is left of an unknown that no group holds.
        if pivot > 0.0 && pivot.is_finite() {
            let right = self.right[unknown];
            self.matrix.ger(-1.0 / pivot, &column, &column, 1.0);
            self.right.axpy(-right / pivot, &column, 1.0);
        }
        self.matrix.row_mut(unknown).fill(0.0);
        self.matrix.column_mut(unknown).fill(0.0);
        self.right[unknown] = 0.0;
    }

    /// Adds what is known of an unknown by itself: zero, with a variance.
    pub fn constrain(&mut self, unknown: usize, variance: f64) {
        self.matrix[(unknown, unknown)] += 1.0 / variance;
    }

    /// Lets an unknown walk randomly: adds to its variance, and leaves every estimate (Sherman and Morrison
    /// 1950).
    pub fn loosen(&mut self, unknown: usize, variance: f64) {
        if variance <= 0.0 {
            return;
        }
        let column = self.matrix.column(unknown).into_owned();
        let share = 1.0 / (1.0 / variance + column[unknown]);
        let right = self.right[unknown];
        self.matrix.ger(-share, &column, &column, 1.0);
        self.right.axpy(-share * right, &column, 1.0);
    }

    /// Equations of the unknowns that are listed, in that order; those that are new begin without
    /// information.
    pub fn arranged(&self, from: &[Option<usize>]) -> Self {
        let at = |row: usize, column: usize| match (from[row], from[column]) {
            (Some(row), Some(column)) => self.matrix[(row, column)],
            _ => 0.0,
        };
        Self {
            matrix: DMatrix::from_fn(from.len(), from.len(), at),
            right: DVector::from_fn(from.len(), |row, _| from[row].map_or(0.0, |row| self.right[row])),
        }
    }

    /// Solution and covariance of the unknowns that are listed, with the others at zero; `None` if the
    /// equations do not determine them.
    pub fn solve(&self, of: &[usize]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let matrix = self.matrix.select_rows(of).select_columns(of);
        let right = self.right.select_rows(of);
        // Scaled to a unit diagonal: metres and cycles differ, and so do the weights of code and phase.
        let scales = matrix.diagonal().map(|own| if own > 0.0 { 1.0 / own.sqrt() } else { 0.0 });
        let scaled =
            DMatrix::from_fn(of.len(), of.len(), |row, column| matrix[(row, column)] * scales[row] * scales[column]);
        let factor = scaled.cholesky()?;
        if factor.l_dirty().diagonal().iter().any(|own| *own < LEAST_PIVOT) {
            return None;
        }
        let covariance = factor.inverse();
        let covariance = DMatrix::from_fn(of.len(), of.len(), |row, column| {
            let both = 0.5 * (covariance[(row, column)] + covariance[(column, row)]);
            both * scales[row] * scales[column]
        });
        Some((&covariance * right, covariance))
    }
}

/// Least diagonal of the Cholesky factor of a scaled matrix: below it the unknown is not determined but by
/// rounding.
const LEAST_PIVOT: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    fn group() -> Vec<Difference> {
        (0..6)
            .map(|number| {
                let turn = f64::from(number);
                let derivatives = vec![
                    (0, libm::cos(turn)),
                    (1, libm::sin(1.7 * turn)),
                    (2, 0.3 + 0.1 * turn),
                    (3 + number as usize, 0.19),
                ];
                let variance_m2 = 1e-5 * (1.0 + turn);
                Difference { derivatives, misclosure_m: 0.1 * turn * turn - 0.2, variance_m2 }
            })
            .collect()
    }

    fn codes() -> Vec<Difference> {
        let of = |one: Difference| {
            let derivatives = one.derivatives.into_iter().filter(|(unknown, _)| *unknown < 3).collect();
            Difference { derivatives, variance_m2: 1e4 * one.variance_m2, ..one }
        };
        group().into_iter().map(of).collect()
    }

    /// Position and covariance by explicit double differences against a pivot, with their full covariance.
    fn by_double_differences(group: &[Difference], pivot: usize) -> (DVector<f64>, DMatrix<f64>) {
        let others: Vec<usize> = (0..group.len()).filter(|index| *index != pivot).collect();
        let dense = |one: &Difference| {
            let mut row = DVector::zeros(3);
            one.derivatives.iter().filter(|(unknown, _)| *unknown < 3).for_each(|(unknown, by)| row[*unknown] = *by);
            row
        };
        let design = DMatrix::from_fn(others.len(), 3, |row, column| {
            dense(&group[others[row]])[column] - dense(&group[pivot])[column]
        });
        let values =
            DVector::from_fn(others.len(), |row, _| group[others[row]].misclosure_m - group[pivot].misclosure_m);
        let covariance = DMatrix::from_fn(others.len(), others.len(), |row, column| {
            group[pivot].variance_m2 + if row == column { group[others[row]].variance_m2 } else { 0.0 }
        });
        let weight = covariance.try_inverse().unwrap();
        let of_position = (design.transpose() * &weight * &design).try_inverse().unwrap();
        (&of_position * design.transpose() * weight * values, of_position)
    }

    #[test]
    fn an_eliminated_clock_gives_what_double_differences_give_for_every_pivot() {
        let mut normal = Normal::new(3);
        normal.add_group(&codes());
        let (solution, covariance) = normal.solve(&[0, 1, 2]).unwrap();
        for pivot in 0..6 {
            let (expected, of_expected) = by_double_differences(&codes(), pivot);
            assert!((&solution - expected).norm() < 1e-9 * solution.norm(), "pivot {pivot}");
            assert!((&covariance - &of_expected).norm() < 1e-9 * of_expected.norm(), "pivot {pivot}");
        }
    }

    #[test]
    fn eliminating_unknowns_leaves_the_solution_of_the_others() {
        let mut normal = Normal::new(9);
        normal.add_group(&codes());
        normal.add_group(&group());
        // The first satellite is the pivot.
        let all = [0, 1, 2, 4, 5, 6, 7, 8];
        let (whole, covariance) = normal.solve(&all).unwrap();
        let mut reduced = normal.clone();
        [0, 1, 2, 5].into_iter().for_each(|unknown| reduced.eliminate(unknown));
        let kept = [4, 6, 7, 8];
        let (part, of_part) = reduced.solve(&kept).unwrap();
        for (own, unknown) in kept.iter().enumerate() {
            let index = all.iter().position(|one| one == unknown).unwrap();
            assert!((part[own] - whole[index]).abs() < 1e-6, "{unknown}");
            assert!((of_part[(own, own)] / covariance[(index, index)] - 1.0).abs() < 1e-6, "{unknown}");
        }
        let arranged = reduced.arranged(&[Some(8), None, Some(4)]);
        assert_eq!(arranged.matrix[(0, 2)], reduced.matrix[(8, 4)]);
        assert_eq!(arranged.matrix[(1, 1)], 0.0);
    }

    #[test]
    fn an_unknown_that_walks_has_more_variance_and_the_same_estimate() {
        let mut normal = Normal::new(3);
        normal.add_group(&codes());
        normal.constrain(1, 0.25);
        let (solution, mut covariance) = normal.solve(&[0, 1, 2]).unwrap();
        normal.loosen(1, 0.04);
        let (after, of_after) = normal.solve(&[0, 1, 2]).unwrap();
        covariance[(1, 1)] += 0.04;
        assert!((after - &solution).norm() < 1e-9 * solution.norm());
        assert!((&of_after - &covariance).norm() < 1e-9 * covariance.norm());
        let unchanged = normal.clone();
        normal.loosen(1, 0.0);
        assert_eq!(normal, unchanged);
    }

    #[test]
    fn what_no_observation_determines_has_no_solution() {
        let mut normal = Normal::new(9);
        normal.add_group(&group());
        assert!(normal.solve(&[0, 1, 2, 4, 5, 6, 7, 8]).is_none(), "phases alone");
        assert!(Normal::new(3).solve(&[0, 1, 2]).is_none());
    }
}
