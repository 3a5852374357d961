//! ARAIM: protection levels by multiple hypotheses and the separations of their solutions.
//!
//! Source: EU-US Cooperation on Satellite Navigation, Working Group C, ARAIM Technical Subgroup, Reference
//! Airborne Algorithm Description Document, version 3.1 (20 June 2019), sections 3 and 4. Faults are those of
//! single satellites and of whole constellations; combinations are monitored until the rest is less likely
//! than `p_threshold`, and that rest is taken from the promise. The document's fault-free solution weights by
//! the integrity covariance; here it is the receiver's own, whatever its weights, with its deviation under
//! that covariance. Limits: modes are not consolidated; after an exclusion the levels are those of the
//! remaining ranges, without the risk that the wrong one was excluded.

use std::collections::BTreeMap;

use super::geometry::{AXES, Estimator, Geometry};
use super::normal::{beyond, quantile};
use super::settings::IntegritySettings;
use super::{Levels, Unprotected};

/// Steps of the search for a level end within this, on the safe side (TOL_PL).
const TOLERANCE_M: f64 = 0.05;
/// Largest number of simultaneous independent faults that are monitored.
const LARGEST_ORDER: usize = 3;
/// Most combinations of faults that are monitored.
const LARGEST_COUNT: usize = 3000;
const UP: usize = 2;

/// A set of ranges under a fault and its probability.
struct Mode {
    probability: f64,
    sigmas_m: [f64; AXES],
    biases_m: [f64; AXES],
    thresholds_m: [f64; AXES],
    is_separated: bool,
}

/// Faults that may happen, each with the ranges that it concerns.
fn events(geometry: &Geometry, budget: &IntegritySettings) -> Vec<(f64, Vec<usize>)> {
    let groups = |of: &[usize], probability: f64| {
        let mut all: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        of.iter().enumerate().for_each(|(range, group)| all.entry(*group).or_default().push(range));
        all.into_values().filter(move |_| probability > 0.0).map(move |ranges| (probability, ranges))
    };
    let p_const = planted!("receiver.araim.constellations", budget.p_const, 0.0);
    groups(&geometry.satellites, budget.p_sat).chain(groups(&geometry.constellations, p_const)).collect()
}

/// Probability that more than `order` of independent events happen.
fn more_than(order: usize, events: &[(f64, Vec<usize>)]) -> f64 {
    let mut exactly = vec![0.0; order + 1];
    exactly[0] = 1.0;
    for (probability, _) in events {
        for count in (0..=order).rev() {
            let from_below = if count > 0 { exactly[count - 1] * probability } else { 0.0 };
            exactly[count] = exactly[count] * (1.0 - probability) + from_below;
        }
    }
    (1.0 - exactly.iter().sum::<f64>()).max(0.0)
}

/// Ranges that remain under each combination of up to `order` events, with the combinations' probability;
/// `None` if there are too many.
fn combined(geometry: &Geometry, events: &[(f64, Vec<usize>)], order: usize) -> Option<BTreeMap<Vec<bool>, f64>> {
    let mut found: BTreeMap<Vec<bool>, f64> = BTreeMap::new();
    let mut last = vec![(0, 1.0, vec![true; geometry.ranges()])];
    for _ in 0..order {
        let more = |(next, probability, kept): &(usize, f64, Vec<bool>)| {
            let one = |(place, (own, ranges)): (usize, &(f64, Vec<usize>))| {
                let mut kept = kept.clone();
                ranges.iter().for_each(|&range| kept[range] = false);
                (place + 1, probability * own, kept)
            };
            events.iter().enumerate().skip(*next).map(one).collect::<Vec<_>>()
        };
        last = last.iter().flat_map(more).collect();
        if last.len() > LARGEST_COUNT {
            return None;
        }
        for (_, probability, kept) in &last {
            *found.entry(kept.clone()).or_default() += probability;
        }
    }
    Some(found)
}

/// Levels of a fix, and whether its ranges contradict each other.
///
/// # Errors
/// [`Unprotected`] where faults that no test sees are likelier than the promise, or the geometry is singular.
pub fn levels(geometry: &Geometry, budget: &IntegritySettings) -> Result<Levels, Unprotected> {
    let all = geometry.of_all().ok_or(Unprotected::Singular)?;
    let (modes, missed) = modes(geometry, budget, &all)?;
    let promised = budget.phmi_vertical + budget.phmi_horizontal;
    if missed >= promised {
        return Err(Unprotected::Unmonitored { probability: missed, promised });
    }
    let (sigmas_m, biases_m) = (all.sigmas_m(&geometry.integrity), all.biases_m(&geometry.biases_m));
    let share = 1.0 - missed / promised;
    // The horizontal promise is divided between east and north.
    let phmi = [0.5 * budget.phmi_horizontal, 0.5 * budget.phmi_horizontal, budget.phmi_vertical];
    let level = |axis: usize| {
        let mut terms = vec![Term { weight: 2.0, middle_m: biases_m[axis], sigma_m: sigmas_m[axis] }];
        terms.extend(modes.iter().map(|mode| Term {
            weight: mode.probability,
            middle_m: mode.thresholds_m[axis] + planted!("receiver.araim.bias", mode.biases_m[axis], 0.0),
            sigma_m: mode.sigmas_m[axis],
        }));
        solve(&terms, phmi[axis] * share)
    };
    let emt = modes.iter().filter(|mode| mode.probability >= budget.p_emt).map(|mode| mode.thresholds_m[UP]);
    let horizontal_m = libm::hypot(level(0), level(1));
    Ok(Levels {
        hpl_m: Some(horizontal_m),
        vpl_m: Some(level(UP)),
        emt_m: Some(emt.fold(0.0, f64::max)),
        sigma_v_acc_m: Some(all.sigmas_m(&geometry.accuracy)[UP]),
        is_contradicted: modes.iter().any(|mode| mode.is_separated),
    })
}

/// Faults that are monitored, and the probability of the others.
fn modes(geometry: &Geometry, budget: &IntegritySettings, all: &Estimator) -> Result<(Vec<Mode>, f64), Unprotected> {
    let events = events(geometry, budget);
    let order = (0..=LARGEST_ORDER).find(|order| more_than(*order, &events) <= budget.p_threshold);
    let promised = budget.phmi_vertical + budget.phmi_horizontal;
    let too_many = || Unprotected::Unmonitored { probability: more_than(LARGEST_ORDER, &events), promised };
    let order = order.ok_or_else(too_many)?;
    let mut missed = more_than(order, &events);
    let mut found = Vec::new();
    for (kept, probability) in combined(geometry, &events, order).ok_or_else(too_many)? {
        match geometry.estimator(&kept, &geometry.integrity) {
            Some(estimator) => found.push((probability, estimator)),
            // Without its ranges there is no position, so that no test sees the fault.
            None => missed += probability,
        }
    }
    // K_fa of equations for east, north and up: both sides, and half of the horizontal share each.
    let count = found.len() as f64;
    let horizontal = quantile(budget.false_alarm_horizontal / (4.0 * count));
    let vertical = quantile(budget.false_alarm_vertical / (2.0 * count));
    let factors = [horizontal, horizontal, planted!("receiver.araim.axis", vertical, horizontal)];
    let apart = planted!("receiver.araim.ure", &geometry.accuracy, &geometry.integrity);
    let mode = |(probability, estimator): (f64, Estimator)| {
        let separation = estimator.less(all);
        let apart_m = &separation.0 * &geometry.residuals_m;
        let sigmas_m = separation.sigmas_m(apart);
        let thresholds_m: [f64; AXES] = std::array::from_fn(|axis| factors[axis] * sigmas_m[axis]);
        Mode {
            probability,
            sigmas_m: estimator.sigmas_m(&geometry.integrity),
            biases_m: estimator.biases_m(&geometry.biases_m),
            is_separated: (0..AXES).any(|axis| apart_m[axis].abs() > thresholds_m[axis]),
            thresholds_m,
        }
    };
    Ok((found.into_iter().map(mode).collect(), missed))
}

/// One hypothesis of the equation of a level: its weight, and where the error's tail begins.
struct Term {
    weight: f64,
    middle_m: f64,
    sigma_m: f64,
}

/// The level whose exceedance has a probability: half-interval search between the levels that one hypothesis
/// alone needs with all of the probability, and with an equal part of it.
fn solve(terms: &[Term], probability: f64) -> f64 {
    let tail = |level_m: f64, term: &Term| {
        let over_m = level_m - term.middle_m;
        term.weight * if over_m > 0.0 { beyond(over_m / term.sigma_m) } else { 1.0 }
    };
    let end = |part: f64| {
        let of = |term: &Term| term.middle_m + term.sigma_m * quantile(part / term.weight).max(-1e9);
        terms.iter().map(of).fold(0.0, f64::max)
    };
    let (mut low_m, mut high_m) = (end(probability), end(probability / terms.len() as f64));
    while high_m - low_m > TOLERANCE_M {
        let middle_m = 0.5 * (low_m + high_m);
        let risk: f64 = terms.iter().map(|term| tail(middle_m, term)).sum();
        if risk > probability { low_m = middle_m } else { high_m = middle_m }
    }
    high_m
}

#[cfg(test)]
mod tests;
