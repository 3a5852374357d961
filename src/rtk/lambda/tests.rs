//! Laws of integer least squares: published cases, an exhaustive search, and the statistics of bootstrapping.

use nalgebra::{DMatrix, DVector};

use super::{Decorrelated, LambdaError};

/// Numbers of a line of the published cases by its name.
fn line(name: &str) -> Vec<f64> {
    let text = include_str!("../data/lambda_cases.csv");
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(','));
    line.unwrap().split(',').map(|number| number.parse().unwrap()).collect()
}

/// Uniform numbers of [0, 1): a linear congruential generator (Knuth, MMIX).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Number of the standard normal distribution (Box and Muller).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.uniform())
    }

    /// Covariance of `order` correlated numbers as ambiguities have it: a common part of rank three that is
    /// large, and a small one of each.
    fn covariance(&mut self, order: usize) -> DMatrix<f64> {
        let common = DMatrix::from_fn(order, 3.min(order), |_, _| 3.0 * self.normal());
        let own = DMatrix::from_diagonal(&DVector::from_fn(order, |_, _| 0.01 + 0.1 * self.uniform()));
        &common * common.transpose() + own
    }
}

fn is_same(found: &DVector<f64>, expected: &[f64]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(one, other)| one == other)
}

#[test]
fn published_cases_give_the_published_integers() {
    for number in 1..=2 {
        let float = DVector::from_vec(line(&format!("a{number}")));
        let order = float.len();
        let covariance = DMatrix::from_row_slice(order, order, &line(&format!("Q{number}")));
        let decorrelated = Decorrelated::new(&float, &covariance).unwrap();
        let found = decorrelated.search(0).unwrap();
        // The two vectors stand side by side, element by element.
        let both = line(&format!("F{number}"));
        for (index, norm) in line(&format!("s{number}")).into_iter().enumerate() {
            let expected: Vec<f64> = both.iter().skip(index).step_by(2).copied().collect();
            let back = decorrelated.back(&found.vectors[index]);
            assert!(is_same(&back, &expected), "case {number}, vector {index}: {back}");
            // Six decimals are printed, of covariances with six.
            let miss = (found.squared_norms[index] - norm).abs();
            assert!(miss < 1e-4 * norm, "case {number}: {} for {norm}", found.squared_norms[index]);
        }
    }
}

/// The two least squared norms among all integer vectors within a box around the float vector.
fn exhaustive(float: &DVector<f64>, covariance: &DMatrix<f64>, reach: i64) -> [(f64, Vec<f64>); 2] {
    let inverse = covariance.clone().try_inverse().unwrap();
    let order = float.len();
    let side = (2 * reach + 1) as usize;
    let mut best = [(f64::INFINITY, Vec::new()), (f64::INFINITY, Vec::new())];
    for mut number in 0..side.pow(order as u32) {
        let vector = DVector::from_fn(order, |row, _| {
            let step = (number % side) as i64 - reach;
            number /= side;
            float[row].round() + step as f64
        });
        let miss = float - &vector;
        let norm = (miss.transpose() * &inverse * &miss)[(0, 0)];
        if norm < best[1].0 {
            best[1] = (norm, vector.iter().copied().collect());
            if best[1].0 < best[0].0 {
                best.swap(0, 1);
            }
        }
    }
    best
}

#[test]
fn the_search_finds_what_trying_all_vectors_finds() {
    let mut random = Random(7);
    for trial in 0..300 {
        let order = 1 + trial % 4;
        let factor = DMatrix::from_fn(order, order, |_, _| random.normal());
        // Ellipsoids within the box: 1.5 cycles at most along an axis.
        let covariance: DMatrix<f64> = 0.03 * (&factor * factor.transpose()) + 0.01 * DMatrix::identity(order, order);
        let float = DVector::from_fn(order, |_, _| 20.0 * random.normal());
        let decorrelated = Decorrelated::new(&float, &covariance).unwrap();
        let found = decorrelated.search(0).unwrap();
        for (index, (norm, vector)) in exhaustive(&float, &covariance, 4).into_iter().enumerate() {
            assert!((found.squared_norms[index] - norm).abs() < 1e-8 * norm.max(1.0), "trial {trial}");
            assert!(is_same(&decorrelated.back(&found.vectors[index]), &vector), "trial {trial}, vector {index}");
        }
    }
}

#[test]
fn the_transformation_is_whole_keeps_volumes_and_decorrelates() {
    let mut random = Random(3);
    for order in 2..=24 {
        let covariance = random.covariance(order);
        let float = DVector::from_fn(order, |_, _| 1e6 * random.normal());
        let made = Decorrelated::new(&float, &covariance).unwrap();
        let z = made.transformation();
        assert!(z.iter().all(|entry| entry.fract() == 0.0));
        assert_eq!(z * &made.inverse, DMatrix::identity(order, order));
        // LᵀDL is the covariance of the transformed vector, to rounding.
        let made_of = made.lower.transpose() * DMatrix::from_diagonal(&made.variances) * &made.lower;
        let transformed = z.transpose() * &covariance * z;
        assert!((made_of - &transformed).amax() < 1e-6 * transformed.amax(), "order {order}");
        // Size reduction: no multiple of a later ambiguity is left in an earlier one.
        for column in 0..order {
            assert!((column + 1..order).all(|row| made.lower[(row, column)].abs() <= 0.5 + 1e-9));
        }
        // Permutations: the condition of Lovász with factor one.
        for at in 0..order - 1 {
            let below = made.lower[(at + 1, at)];
            assert!(made.variances[at] + below * below * made.variances[at + 1] >= made.variances[at + 1] * 0.99);
        }
        let plain = factors_of(&covariance);
        assert!(made.success_rate(0) >= plain - 1e-12, "order {order}");
    }
}

/// Success rate of bootstrapping without a transformation.
fn factors_of(covariance: &DMatrix<f64>) -> f64 {
    let (_, variances) = super::factors(covariance).unwrap();
    variances.iter().map(|variance| libm::erf(1.0 / (8.0 * variance).sqrt())).product()
}

/// Integers that a vector is bootstrapped to: each rounded, given those after it.
fn bootstrapped(made: &Decorrelated) -> DVector<f64> {
    let order = made.order();
    let mut fixed = made.remainder.clone();
    for at in (0..order).rev() {
        let corrections =
            (at + 1..order).map(|later| made.lower[(later, at)] * (fixed[later] - conditional(made, &fixed, later)));
        fixed[at] = (made.remainder[at] + corrections.sum::<f64>()).round();
    }
    fixed + made.z.transpose() * &made.whole
}

fn conditional(made: &Decorrelated, fixed: &DVector<f64>, at: usize) -> f64 {
    let corrections =
        (at + 1..made.order()).map(|later| made.lower[(later, at)] * (fixed[later] - conditional(made, fixed, later)));
    made.remainder[at] + corrections.sum::<f64>()
}

#[test]
fn bootstrapping_succeeds_as_often_as_stated_and_least_squares_no_less() {
    let mut random = Random(11);
    // A covariance after decorrelation whose success rate is far from zero and one.
    let factor = DMatrix::from_fn(4, 4, |_, _| random.normal());
    let covariance: DMatrix<f64> = 0.02 * (&factor * factor.transpose()) + 0.03 * DMatrix::identity(4, 4);
    let root = covariance.clone().cholesky().unwrap().l();
    let truth = DVector::from_vec(vec![12.0, -7.0, 1_000_003.0, 0.0]);
    let (mut right, mut least_squares) = (0, 0);
    let mut stated = 0.0;
    const TRIALS: usize = 20_000;
    for _ in 0..TRIALS {
        let float = &truth + &root * DVector::from_fn(4, |_, _| random.normal());
        let made = Decorrelated::new(&float, &covariance).unwrap();
        stated = made.success_rate(0);
        right += usize::from(made.back(&bootstrapped(&made)) == truth);
        least_squares += usize::from(made.back(&made.search(0).unwrap().vectors[0]) == truth);
    }
    let share = right as f64 / TRIALS as f64;
    // Four standard deviations of a share of so many trials.
    let bound = 4.0 * (stated * (1.0 - stated) / TRIALS as f64).sqrt();
    assert!((0.5..0.99).contains(&stated), "{stated}");
    assert!((share - stated).abs() < bound, "{share} for {stated} within {bound}");
    assert!(least_squares as f64 / TRIALS as f64 > stated - bound, "{least_squares} of {TRIALS}");
}

#[test]
fn a_part_of_the_vector_is_fixed_where_the_whole_cannot_be() {
    // One ambiguity of which nothing is known beside three that are known well.
    let variances = DVector::from_vec(vec![1e-4, 4.0, 1e-4, 1e-4]);
    let float = DVector::from_vec(vec![5.01, 0.4, -3.02, 8.0]);
    let made = Decorrelated::new(&float, &DMatrix::from_diagonal(&variances)).unwrap();
    assert!(made.success_rate(0) < 0.3);
    let first = made.first_for(0.999).unwrap();
    assert_eq!(first, 1);
    let found = made.search(first).unwrap();
    let mut of_all = found.vectors[0].iter().copied().collect::<Vec<_>>();
    of_all.sort_by(f64::total_cmp);
    assert_eq!(of_all, [-3.0, 5.0, 8.0]);
    assert_eq!(made.first_for(1.0 - 1e-17), Some(1));
}

#[test]
fn what_is_no_covariance_is_refused_with_its_place() {
    let float = DVector::from_vec(vec![0.0, 0.0]);
    let indefinite = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
    let refused = Decorrelated::new(&float, &indefinite).unwrap_err();
    assert_eq!(refused, LambdaError::NotPositive { order: 2, at: 0, variance: -3.0 });
    let refused = Decorrelated::new(&float, &DMatrix::identity(3, 3)).unwrap_err();
    assert_eq!(refused, LambdaError::Shape { have: 2, rows: 3, columns: 3 });
    let not_finite = DMatrix::from_element(2, 2, f64::NAN);
    assert!(matches!(Decorrelated::new(&float, &not_finite), Err(LambdaError::NotPositive { .. })));
}
