//! Attitude of an array's body, and phases of its channels, from the carriers of its elements.
//!
//! An element at lever arm l is ahead of the first one by `κ u·R l` on a wave from direction u, with κ = 2π/λ
//! and R from the body's axes to east, north and up; its channel adds a phase of its own. The rotation and
//! these phases are solved for together, so that cables need no calibration (C. E. Cohen, Attitude
//! Determination, in Global Positioning System: Theory and Applications II, 1996). Whole cycles are found by
//! the ambiguity function (C. C. Counselman and S. A. Gourevitch 1981): the sum of phasors that a rotation
//! explains. The longest lever arm is pointed in all directions, which is the constraint of its length, and
//! the body is turned about it. Limits: three elements that are not in a line, plane waves.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use num_complex::Complex64;

use crate::settings::array::span_a_plane;

/// Share of a period between neighbouring rotations of a search, over the longest lever arm.
const STEP: f64 = 0.25;
/// Largest and smallest such step in radians: the larger one for short arms, the smaller one bounds the work.
const STEPS_RAD: [f64; 2] = [0.02, 0.35];
/// Directions of the longest arm about which the body is turned.
const DIRECTIONS: usize = 48;
/// Rotations that are solved from.
const CANDIDATES: usize = 16;
/// Last iteration of a solution, and the rotation in radians that ends it before.
const ITERATIONS: (u32, f64) = (15, 1e-10);
/// Largest rotation of one iteration in radians.
const LARGEST_RAD: f64 = 0.3;
/// Rotation in radians from which on two solutions are two.
const APART_RAD: f64 = 0.05;
/// Sum of squares by which a solution must be better than any other one: an odds ratio of e¹².
const BETTER: f64 = 24.0;

/// Carriers of one signal of one satellite in all elements.
#[derive(Clone, Debug)]
pub struct Look {
    /// Number of its kind, whose channels have one phase.
    pub kind: usize,
    /// Unit vector towards the satellite in east, north and up.
    pub towards: Vector3<f64>,
    /// Radians of carrier a metre.
    pub radians_per_m: f64,
    /// Phasors of unit size, the first one's 1.
    pub phasors: Vec<Complex64>,
    /// Deviation of each phase in radians.
    pub sigma_rad: f64,
}

/// Rotation that explains the phases.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Rotation from the body's axes to east, north and up.
    pub rotation: Matrix3<f64>,
    /// Deviations of the rotation about these axes, in radians.
    pub sigmas_rad: [f64; 3],
    /// Phases of the channels of the second and later elements, of each kind, with their deviations, radians.
    pub phases_rad: Vec<Vec<(f64, f64)>>,
    /// Weighted sum of squared residuals.
    pub chi_square: f64,
    /// Degrees of freedom of that sum.
    pub freedom: usize,
    /// True if no other rotation explains the phases as well.
    pub is_unique: bool,
}

/// Lever arms from the first element, and which of them is the longest.
#[derive(Clone, Debug)]
pub struct Body {
    arms_m: Vec<Vector3<f64>>,
    longest: usize,
}

impl Body {
    /// Lever arms in the body's axes; `None` for fewer than three elements and for elements in a line.
    pub fn new(lever_arms_m: &[[f64; 3]]) -> Option<Self> {
        let first = Vector3::from(*lever_arms_m.first()?);
        let arms_m: Vec<Vector3<f64>> = lever_arms_m.iter().map(|arm| Vector3::from(*arm) - first).collect();
        let longest = (0..arms_m.len()).max_by(|a, b| arms_m[*a].norm().total_cmp(&arms_m[*b].norm()))?;
        span_a_plane(lever_arms_m).then_some(Self { arms_m, longest })
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.arms_m.len()
    }

    /// Degrees of freedom of phases that a rotation and the channels are solved from; `None` below one.
    fn freedom(&self, looks: &[Look]) -> Option<usize> {
        let kinds = looks.iter().map(|look| look.kind + 1).max()?;
        let phases = looks.len() * (self.elements() - 1);
        phases.checked_sub(3 + kinds * (self.elements() - 1)).filter(|freedom| *freedom > 0)
    }

    /// Solves for the rotation, from `near` first and from everywhere if that does not explain the phases
    /// within `threshold`. `None` where there are too few phases.
    pub fn solve(&self, looks: &[Look], near: Option<&Matrix3<f64>>, threshold: f64) -> Option<Solution> {
        self.freedom(looks)?;
        if let Some(found) =
            near.and_then(|near| self.refined(looks, near)).filter(|one| one.is_unique && one.chi_square <= threshold)
        {
            return Some(found);
        }
        let mut found: Vec<Solution> =
            self.candidates(looks).iter().filter_map(|rotation| self.refined(looks, rotation)).collect();
        found.sort_by(|a, b| a.chi_square.total_cmp(&b.chi_square));
        let best = found.first()?;
        let is_other = |one: &&Solution| angle_rad(&(one.rotation * best.rotation.transpose())) > APART_RAD;
        let is_unique = found.iter().find(is_other).is_none_or(|other| other.chi_square >= best.chi_square + BETTER);
        Some(Solution { is_unique: is_unique && best.is_unique, ..best.clone() })
    }

    /// Rotations of the largest ambiguity functions.
    fn candidates(&self, looks: &[Look]) -> Vec<Matrix3<f64>> {
        let Some(longest) = self.arms_m.get(self.longest) else { return Vec::new() };
        let most = looks.iter().map(|look| look.radians_per_m).fold(1.0, f64::max);
        let step_rad = (STEP * TAU / (most * longest.norm())).clamp(STEPS_RAD[0], STEPS_RAD[1]);
        let count = (4.0 * PI / (step_rad * step_rad)).ceil() as usize;
        let along = longest.normalize();
        let mut directions: Vec<(f64, Vector3<f64>)> = (0..count)
            .map(|number| {
                let direction = spread(number, count);
                (self.explained(looks, &[self.longest], &|arm| direction * along.dot(arm)), direction)
            })
            .collect();
        directions.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<Vector3<f64>> = Vec::new();
        for (_, direction) in &directions {
            if chosen.iter().all(|one| (one - direction).norm() > step_rad) {
                chosen.push(*direction);
            }
            if chosen.len() == DIRECTIONS {
                break;
            }
        }
        let all: Vec<usize> = (0..self.elements()).collect();
        let turns = (TAU / step_rad).ceil() as u32;
        let mut rotations: Vec<(f64, Matrix3<f64>)> = Vec::new();
        for direction in &chosen {
            let pointed = pointing(&along, direction);
            for turn in 0..turns {
                let rotation = about(direction, TAU * f64::from(turn) / f64::from(turns)) * pointed;
                rotations.push((self.explained(looks, &all, &|arm| rotation * arm), rotation));
            }
        }
        rotations.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut candidates: Vec<Matrix3<f64>> = Vec::new();
        for (_, rotation) in rotations {
            if candidates.iter().all(|one| angle_rad(&(one * rotation.transpose())) > step_rad) {
                candidates.push(rotation);
            }
            if candidates.len() == CANDIDATES {
                break;
            }
        }
        candidates
    }

    /// Share of the phasors of some elements that arms turned by `turned` explain, with one phase for each
    /// element and kind.
    fn explained(&self, looks: &[Look], elements: &[usize], turned: &dyn Fn(&Vector3<f64>) -> Vector3<f64>) -> f64 {
        let kinds = looks.iter().map(|look| look.kind + 1).max().unwrap_or(0);
        let of = |element: &usize| -> f64 {
            let Some(arm) = self.arms_m.get(*element).map(turned) else { return 0.0 };
            let mut sums = vec![Complex64::ZERO; kinds];
            for look in looks {
                let ahead_rad = look.radians_per_m * look.towards.dot(&arm);
                let phasor = look.phasors.get(*element).copied().unwrap_or_default();
                sums[look.kind] += phasor * turn(-ahead_rad) / (look.sigma_rad * look.sigma_rad);
            }
            sums.iter().map(|sum| sum.norm()).sum()
        };
        elements.iter().map(of).sum()
    }

    /// Least squares from a rotation on. Where it does not settle, as with phases that no rotation
    /// explains, the last step counts, and is not unique.
    fn refined(&self, looks: &[Look], near: &Matrix3<f64>) -> Option<Solution> {
        let (elements, freedom) = (self.elements(), self.freedom(looks)?);
        let kinds = looks.iter().map(|look| look.kind + 1).max()?;
        let unknowns = 3 + kinds * (elements - 1);
        let mut rotation = *near;
        let mut phases = vec![vec![0.0; elements]; kinds];
        for (kind, phases) in phases.iter_mut().enumerate() {
            for (element, phase) in phases.iter_mut().enumerate().skip(1) {
                let own = looks.iter().filter(|look| look.kind == kind);
                let sum: Complex64 = own.map(|look| self.residual(look, &rotation, element) / look.sigma_rad).sum();
                *phase = libm::atan2(sum.im, sum.re);
            }
        }
        for iteration in 0..=ITERATIONS.0 {
            let mut normal = DMatrix::<f64>::zeros(unknowns, unknowns);
            let (mut right, mut chi_square) = (DVector::<f64>::zeros(unknowns), 0.0);
            for look in looks {
                let weight = 1.0 / (look.sigma_rad * look.sigma_rad);
                let mut rows: Vec<(DVector<f64>, f64)> = (0..elements)
                    .map(|element| self.row(look, &rotation, (&phases[look.kind], element), unknowns))
                    .collect();
                // The phase that all elements share is the satellite's own.
                let mean =
                    rows.iter().fold((DVector::zeros(unknowns), 0.0), |sum, row| (sum.0 + &row.0, sum.1 + row.1));
                for (row, residual) in &mut rows {
                    *row -= &mean.0 / elements as f64;
                    *residual -= mean.1 / elements as f64;
                    normal.ger(weight, row, row, 1.0);
                    right.axpy(weight * *residual, row, 1.0);
                    chi_square += weight * *residual * *residual;
                }
            }
            let factors = normal.cholesky()?;
            let change = factors.solve(&right);
            let turned = Vector3::new(change[0], change[1], change[2]);
            let is_settled = turned.norm() < ITERATIONS.1;
            if is_settled || iteration == ITERATIONS.0 {
                let covariance = factors.inverse();
                let sigma = |index: usize| covariance[(index, index)].sqrt();
                let phases_rad = (0..kinds).map(|kind| {
                    let of =
                        |element: usize| (wrapped_rad(phases[kind][element]), sigma(column(kind, element, elements)));
                    (1..elements).map(of).collect()
                });
                return Some(Solution {
                    rotation,
                    sigmas_rad: [0, 1, 2].map(sigma),
                    phases_rad: phases_rad.collect(),
                    chi_square,
                    freedom,
                    is_unique: is_settled,
                });
            }
            let size = turned.norm().max(LARGEST_RAD);
            rotation = cayley(&(turned * (LARGEST_RAD / size))) * rotation;
            for (kind, phases) in phases.iter_mut().enumerate() {
                for (element, phase) in phases.iter_mut().enumerate().skip(1) {
                    *phase += change[column(kind, element, elements)];
                }
            }
        }
        None
    }

    /// Phasor of an element that a rotation does not explain.
    fn residual(&self, look: &Look, rotation: &Matrix3<f64>, element: usize) -> Complex64 {
        let arm = self.arms_m.get(element).copied().unwrap_or_default();
        let ahead_rad = look.radians_per_m * look.towards.dot(&(rotation * arm));
        look.phasors.get(element).copied().unwrap_or_default() * turn(-ahead_rad)
    }

    /// Derivatives of an element's phase, and its residual.
    fn row(
        &self,
        look: &Look,
        rotation: &Matrix3<f64>,
        (phases, element): (&[f64], usize),
        unknowns: usize,
    ) -> (DVector<f64>, f64) {
        let arm = self.arms_m.get(element).copied().unwrap_or_default();
        let by_rotation = look.radians_per_m * (rotation * arm).cross(&look.towards);
        let mut row = DVector::zeros(unknowns);
        row.rows_mut(0, 3).copy_from(&by_rotation);
        if element > 0 {
            row[column(look.kind, element, self.elements())] = 1.0;
        }
        let left = self.residual(look, rotation, element) * turn(-phases.get(element).copied().unwrap_or(0.0));
        (row, libm::atan2(left.im, left.re))
    }
}

/// Column of the phase of an element's channel.
fn column(kind: usize, element: usize, elements: usize) -> usize {
    3 + kind * (elements - 1) + element - 1
}

fn turn(radians: f64) -> Complex64 {
    let (sin, cos) = libm::sincos(radians);
    Complex64::new(cos, sin)
}

fn wrapped_rad(radians: f64) -> f64 {
    radians - TAU * (radians / TAU).round()
}

/// Direction `number` of `count` that cover the sphere evenly (a spiral by the golden angle).
fn spread(number: usize, count: usize) -> Vector3<f64> {
    let z = 1.0 - (2.0 * number as f64 + 1.0) / count as f64;
    let (sin, cos) = libm::sincos(PI * (3.0 - 5.0_f64.sqrt()) * number as f64);
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vector3::new(r * cos, r * sin, z)
}

/// Some rotation that turns `from` into `to`, both unit vectors.
fn pointing(from: &Vector3<f64>, to: &Vector3<f64>) -> Matrix3<f64> {
    let (across, cosine) = (from.cross(to).cross_matrix(), from.dot(to));
    if cosine > -1.0 + 1e-9 {
        return Matrix3::identity() + across + across * across / (1.0 + cosine);
    }
    let beside = if from.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let axis = from.cross(&beside).normalize();
    axis * axis.transpose() * 2.0 - Matrix3::identity()
}

/// Rotation about a unit vector.
fn about(axis: &Vector3<f64>, radians: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(radians);
    Matrix3::identity() * cos + axis.cross_matrix() * sin + axis * axis.transpose() * (1.0 - cos)
}

/// Rotation by a small vector, exactly one: of half the tangent of the half angle.
fn cayley(turned: &Vector3<f64>) -> Matrix3<f64> {
    let half = turned.cross_matrix() * 0.5;
    let inverse = (Matrix3::identity() - half).try_inverse().unwrap_or_else(Matrix3::identity);
    inverse * (Matrix3::identity() + half)
}

/// Angle of a rotation in radians.
fn angle_rad(rotation: &Matrix3<f64>) -> f64 {
    libm::acos((0.5 * (rotation.trace() - 1.0)).clamp(-1.0, 1.0))
}
