//! Linear model of a fix: derivatives of its ranges, covariances of their errors, and the estimators of its
//! coordinates from all ranges or from some.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Coordinates of a fix: east, north, up.
pub const AXES: usize = 3;

/// Ranges of a fix, linear about it.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Derivatives of each range by east, north, up and the clocks: as many rows as ranges.
    pub rows: DMatrix<f64>,
    /// Index of each range's satellite.
    pub satellites: Vec<usize>,
    /// Index of each range's constellation.
    pub constellations: Vec<usize>,
    /// Covariance in m² whose inverse weights the ranges of the fix.
    pub weighting: DMatrix<f64>,
    /// Covariance in m² that bounds the errors for integrity.
    pub integrity: DMatrix<f64>,
    /// Covariance in m² of the errors for accuracy and continuity.
    pub accuracy: DMatrix<f64>,
    /// Largest bias of each range without a fault, in metres.
    pub biases_m: Vec<f64>,
    /// Measured minus computed ranges at the fix, in metres.
    pub residuals_m: DVector<f64>,
}

/// Estimator of east, north and up: three rows, one column a range; ranges that are left out have zeros.
#[derive(Clone, Debug)]
pub struct Estimator(pub DMatrix<f64>);

impl Geometry {
    /// Number of ranges.
    pub fn ranges(&self) -> usize {
        self.rows.nrows()
    }

    /// Estimator of the fix itself; `None` where its geometry is singular.
    pub fn of_all(&self) -> Option<Estimator> {
        self.estimator(&vec![true; self.ranges()], &self.weighting)
    }

    /// Estimator by the ranges that are kept, weighted by the inverse of their part of a covariance; `None`
    /// where they give no position. A clock that only ranges that are left out have is no unknown.
    pub fn estimator(&self, kept: &[bool], covariance: &DMatrix<f64>) -> Option<Estimator> {
        let own: Vec<usize> = (0..self.ranges()).filter(|&index| kept.get(index) == Some(&true)).collect();
        let is_known = |column: &usize| *column < AXES || own.iter().any(|&row| self.rows[(row, *column)] != 0.0);
        let columns: Vec<usize> = (0..self.rows.ncols()).filter(is_known).collect();
        if own.len() < columns.len() {
            return None;
        }
        let rows = DMatrix::from_fn(own.len(), columns.len(), |a, b| self.rows[(own[a], columns[b])]);
        let part = DMatrix::from_fn(own.len(), own.len(), |a, b| covariance[(own[a], own[b])]);
        let weighted = Cholesky::new(part)?.solve(&rows);
        let estimator = Cholesky::new(rows.transpose() * &weighted)?.solve(&weighted.transpose());
        let mut whole = DMatrix::zeros(AXES, self.ranges());
        for (place, &index) in own.iter().enumerate() {
            for axis in 0..AXES {
                whole[(axis, index)] = estimator[(axis, place)];
            }
        }
        whole.iter().all(|value| value.is_finite()).then_some(Estimator(whole))
    }
}

impl Estimator {
    /// Standard deviations east, north and up of what the estimator makes of errors with this covariance.
    pub fn sigmas_m(&self, covariance: &DMatrix<f64>) -> [f64; AXES] {
        let all = self.covariance(covariance);
        std::array::from_fn(|axis| all[(axis, axis)].max(0.0).sqrt())
    }

    /// Covariance of east, north and up, in m².
    pub fn covariance(&self, of_ranges: &DMatrix<f64>) -> DMatrix<f64> {
        &self.0 * of_ranges * self.0.transpose()
    }

    /// Largest effects of biases of the ranges on east, north and up.
    pub fn biases_m(&self, biases_m: &[f64]) -> [f64; AXES] {
        let of = |axis: usize| self.0.row(axis).iter().zip(biases_m).map(|(gain, bias_m)| gain.abs() * bias_m).sum();
        std::array::from_fn(of)
    }

    /// The estimator less another one: its separation.
    pub fn less(&self, other: &Self) -> Self {
        Self(&self.0 - &other.0)
    }
}
