//! Whole ambiguities of double differences: pivots, the search, and whether its result is believed.
//!
//! Integers are believed if bootstrapping succeeds with a stated probability, if the second best vector is
//! worse by a stated ratio (Euler and Schaffrin 1991; the fixed threshold of 3 is usual, and no failure rate
//! follows from it), and if the best one is as near to the float vector as its covariance allows. Where the
//! whole vector is too weak, the part of it that is strong enough is fixed (Teunissen et al. 1999). Where a
//! strong vector is not believed, the ambiguity without which it would be is taken for one that is not whole:
//! half a cycle is missing, or a slip was not seen.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::carrier::Code;
use crate::lambda::Decorrelated;
use crate::pairs::Track;
use gnss::satellite::System;

/// Conditions under which integers are believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Belief {
    /// Least squared norm of the second best vector, relative to the best.
    pub ratio: f64,
    /// Least probability that bootstrapping gives the true integers.
    pub success_rate: f64,
}

/// Ambiguities of single differences as the float solution has them, pivots included.
#[derive(Clone, Debug)]
pub struct Floats {
    /// Satellite and signal of each, with the elevation by which pivots are chosen.
    pub tracks: Vec<(Track, f64)>,
    /// Whole number that was taken from each.
    pub references: Vec<f64>,
    /// Remainders, cycles. A pivot of the float solution is zero.
    pub values: DVector<f64>,
    /// Covariance of the remainders, cycles squared.
    pub covariance: DMatrix<f64>,
    /// Covariance of the position with the remainders, metres times cycles.
    pub with_position: DMatrix<f64>,
}

/// Double differences of ambiguities: the satellites, each with its pivot, by their numbers in [`Floats`].
#[derive(Clone, Debug, PartialEq)]
pub struct Doubles {
    /// Satellite and pivot of each.
    pub pairs: Vec<(usize, usize)>,
}

/// Integers of an epoch.
#[derive(Clone, Debug)]
pub struct Integers {
    /// Double differences that the integers belong to.
    pub doubles: Doubles,
    /// Rows of the whole transformation that are fixed: each gives a fixed number from the double
    /// differences.
    pub rows: DMatrix<f64>,
    /// Fixed numbers, without the references.
    pub fixed: DVector<f64>,
    /// Squared norm of the second best vector, relative to the best.
    pub ratio: f64,
    /// Probability that bootstrapping gives the true integers.
    pub success_rate: f64,
    /// True if all of the conditions hold.
    pub is_believed: bool,
    /// Correction of the float position, metres.
    pub correction_m: DVector<f64>,
    /// Reduction of the position's covariance, square metres.
    pub gain_m2: DMatrix<f64>,
}

impl Integers {
    /// True if every double difference is fixed.
    pub fn is_whole(&self) -> bool {
        self.fixed.len() == self.doubles.pairs.len()
    }
}

impl Floats {
    /// Double differences within each system and signal, against its highest satellite, of the tracks that
    /// `takes` accepts.
    pub fn doubles(&self, takes: impl Fn(Track) -> bool) -> Doubles {
        let mut groups: BTreeMap<(System, Code), Vec<usize>> = BTreeMap::new();
        for (index, ((sv, code), _)) in self.tracks.iter().enumerate() {
            if takes((*sv, *code)) {
                groups.entry((sv.system, *code)).or_default().push(index);
            }
        }
        let mut pairs = Vec::new();
        for group in groups.values() {
            let elevation = |index: &&usize| self.tracks[**index].1;
            let Some(pivot) = group.iter().max_by(|one, other| elevation(one).total_cmp(&elevation(other))) else {
                continue;
            };
            pairs.extend(group.iter().filter(|index| *index != pivot).map(|index| (*index, *pivot)));
        }
        Doubles { pairs }
    }

    /// Double differences of the remainders, and their covariance.
    fn differenced(&self, doubles: &Doubles) -> (DVector<f64>, DMatrix<f64>) {
        let pairs = &doubles.pairs;
        let values = DVector::from_fn(pairs.len(), |row, _| self.values[pairs[row].0] - self.values[pairs[row].1]);
        let covariance = DMatrix::from_fn(pairs.len(), pairs.len(), |row, column| {
            let ((own, pivot), (other, other_pivot)) = (pairs[row], pairs[column]);
            self.covariance[(own, other)] - self.covariance[(own, other_pivot)] - self.covariance[(pivot, other)]
                + self.covariance[(pivot, other_pivot)]
        });
        (values, covariance)
    }

    /// The best integers of the double differences, or of a part of them, `None` if there is none that could
    /// be searched for; and the probability that bootstrapping gives all of the true ones, `None` without
    /// double differences.
    pub fn fix(&self, doubles: &Doubles, belief: Belief) -> (Option<Integers>, Option<f64>) {
        let (values, covariance) = self.differenced(doubles);
        let Ok(made) = Decorrelated::new(&values, &covariance) else { return (None, None) };
        (self.searched(doubles, (&values, &covariance), &made, belief), Some(made.success_rate(0)))
    }

    fn searched(
        &self,
        doubles: &Doubles,
        (values, covariance): (&DVector<f64>, &DMatrix<f64>),
        made: &Decorrelated,
        belief: Belief,
    ) -> Option<Integers> {
        let first = made.first_for(belief.success_rate).unwrap_or(0);
        let success_rate = made.success_rate(first);
        // What bootstrapping cannot fix is not searched for: the search would take for ever.
        if success_rate < LEAST_SEARCHED {
            return None;
        }
        let found = made.search(first).ok()?;
        let [fixed, _] = found.vectors.clone();
        let ratio = found.ratio();
        let is_near = found.squared_norms[0] <= largest_norm(fixed.len());
        let is_believed = success_rate >= belief.success_rate && ratio >= belief.ratio && is_near;
        // Rows of Zᵀ from the first fixed one on.
        let rows = made.transformation().transpose().rows(first, fixed.len()).into_owned();
        let inverse = (&rows * covariance * rows.transpose()).cholesky()?;
        let pairs = &doubles.pairs;
        let crossed = DMatrix::from_fn(self.with_position.nrows(), pairs.len(), |row, column| {
            self.with_position[(row, pairs[column].0)] - self.with_position[(row, pairs[column].1)]
        }) * rows.transpose();
        let correction_m = &crossed * inverse.solve(&(&fixed - &rows * values));
        let gain_m2 = &crossed * inverse.solve(&crossed.transpose());
        Some(Integers {
            doubles: doubles.clone(),
            rows,
            fixed,
            ratio,
            success_rate,
            is_believed,
            correction_m,
            gain_m2,
        })
    }

    /// [`Self::fix`] without one track more, if that makes integers believed that were not, and if the
    /// ambiguity of the track is then far from a whole number.
    pub fn without_one(&self, takes: impl Fn(Track) -> bool, belief: Belief) -> Option<(Track, Integers)> {
        let candidates = (0..self.tracks.len()).filter(|index| takes(self.tracks[*index].0));
        let fixed = candidates.filter_map(|left_out| {
            let track = self.tracks[left_out].0;
            let doubles = self.doubles(|other| takes(other) && other != track);
            let integers = self.fix(&doubles, belief).0.filter(|found| found.is_believed)?;
            let is_fractional = self.is_fractional(left_out, &integers)?;
            (is_fractional && doubles.pairs.len() >= LEAST_LEFT).then_some((track, integers))
        });
        fixed.max_by(|(_, one), (_, other)| one.ratio.total_cmp(&other.ratio))
    }

    /// True if an ambiguity, given the integers of the others, is far from a whole number for its deviation;
    /// `None` if none of the others is of its system and signal.
    fn is_fractional(&self, index: usize, integers: &Integers) -> Option<bool> {
        let (sv, code) = self.tracks[index].0;
        let is_own = |(_, pivot): &&(usize, usize)| {
            let (other, other_code) = self.tracks[*pivot].0;
            (other.system, other_code) == (sv.system, code)
        };
        let (_, pivot) = *integers.doubles.pairs.iter().find(is_own)?;
        let mut pairs = integers.doubles.pairs.clone();
        pairs.push((index, pivot));
        let (values, covariance) = self.differenced(&Doubles { pairs });
        let last = values.len() - 1;
        let crossed = &integers.rows * covariance.view((0, last), (last, 1));
        let own = &integers.rows * covariance.view((0, 0), (last, last)) * integers.rows.transpose();
        let gain = own.cholesky()?.solve(&crossed);
        let miss = &integers.fixed - &integers.rows * values.rows(0, last);
        let value = values[last] + gain.column(0).dot(&miss);
        let variance = covariance[(last, last)] - gain.column(0).dot(&crossed.column(0));
        let fraction = (value - value.round()).abs();
        Some(fraction > LEAST_FRACTION && fraction > FRACTION_SIGMAS * variance.max(0.0).sqrt())
    }
}

/// Success rate below which nothing is searched for.
const LEAST_SEARCHED: f64 = 0.5;
/// Double differences that must be left for one to be suspected.
const LEAST_LEFT: usize = 5;
/// Distance from a whole number, in cycles, from which on an ambiguity is none.
const LEAST_FRACTION: f64 = 0.25;
/// Deviations that this distance must have.
const FRACTION_SIGMAS: f64 = 4.0;
/// Deviations of the normal distribution beyond which a squared norm is not one of the true integers: a
/// probability of 1e-6.
const NORM_SIGMAS: f64 = 4.75;

/// Largest squared norm of so many integers (Wilson and Hilferty 1931).
fn largest_norm(count: usize) -> f64 {
    let count = count as f64;
    let spread = 2.0 / (9.0 * count);
    let root = 1.0 - spread + NORM_SIGMAS * spread.sqrt();
    count * root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::satellite::Sv;

    const BELIEF: Belief = Belief { ratio: 3.0, success_rate: 0.999 };

    /// Seven satellites with remainders near whole numbers, the first the pivot of the float solution.
    fn floats() -> Floats {
        let code = Code::new("1C").unwrap();
        let tracks = (1..=7).map(|number| ((Sv::gps(number), code), 0.1 * f64::from(number))).collect();
        let values = DVector::from_vec(vec![0.0, 3.01, -1.99, 5.02, 0.01, 7.99, -4.01]);
        // The pivot has no covariance; the others share its noise.
        let covariance = DMatrix::from_fn(7, 7, |row, column| match (row, column) {
            (0, _) | (_, 0) => 0.0,
            _ if row == column => 4e-4,
            _ => 2e-4,
        });
        let with_position = DMatrix::from_fn(3, 7, |axis, column| if column == 0 { 0.0 } else { 1e-5 * axis as f64 });
        Floats { tracks, references: vec![0.0; 7], values, covariance, with_position }
    }

    #[test]
    fn integers_do_not_depend_on_the_pivot() {
        let floats = floats();
        let all = floats.doubles(|_| true);
        // The highest is the pivot.
        assert!(all.pairs.iter().all(|(_, pivot)| *pivot == 6));
        let found = floats.fix(&all, BELIEF).0.unwrap();
        assert!(found.is_believed && found.is_whole());
        let whole = [0.0, 3.0, -2.0, 5.0, 0.0, 8.0, -4.0];
        for (row, fixed) in found.fixed.iter().enumerate() {
            let doubled = all
                .pairs
                .iter()
                .enumerate()
                .map(|(column, (own, pivot))| found.rows[(row, column)] * (whole[*own] - whole[*pivot]));
            assert_eq!(*fixed, doubled.sum::<f64>());
        }
    }

    #[test]
    fn a_half_cycle_is_found_in_every_track_the_pivot_too() {
        for at in 0..7 {
            let mut floats = floats();
            // Of the float solution's pivot, all others are off.
            let others = (0..7).filter(|index| if at == 0 { *index != 0 } else { *index == at });
            others.for_each(|index| floats.values[index] += 0.5);
            let all = floats.doubles(|_| true);
            assert!(floats.fix(&all, BELIEF).0.is_none_or(|found| !found.is_believed), "{at}");
            let (track, found) = floats.without_one(|_| true, BELIEF).unwrap();
            assert_eq!(track, floats.tracks[at].0);
            assert!(found.is_believed);
        }
    }

    #[test]
    fn what_is_weak_is_not_fixed_and_the_strong_part_is() {
        let mut floats = floats();
        floats.covariance[(3, 3)] = 9.0;
        let all = floats.doubles(|_| true);
        let (found, whole) = floats.fix(&all, BELIEF);
        let found = found.unwrap();
        assert!(found.is_believed && !found.is_whole());
        assert_eq!(found.fixed.len(), 5);
        // Of all it is the chance of the weak one, whose deviation is 3: 2Φ(1/6) − 1.
        assert!((whole.unwrap() - 0.1324).abs() < 1e-4 && found.success_rate > 0.999, "{whole:?}");
    }

    #[test]
    fn norms_of_true_integers_are_below_the_bound() {
        // Quantiles of chi squared at 1 − 1e-6: 23.93 and 50.83 for one and twelve degrees of freedom. The
        // approximation is above them, by a seventh for one.
        for (count, quantile) in [(1, 23.93), (12, 50.83)] {
            let ratio = largest_norm(count) / quantile;
            assert!((1.0..1.16).contains(&ratio), "{count}: {ratio}");
        }
    }
}
