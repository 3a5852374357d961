//! Cycle slips that no receiver announced, as single differences of phases from epoch to epoch show them.
//!
//! A phase less its modelled range changes from epoch to epoch by the receivers' clocks, which all
//! signals share, and by the rover's motion beyond the approximate positions. What is left is the noise of
//! the phases, some millimetres, or a slip: half a cycle is 9 cm on L1. The largest residual is taken out
//! until all are small (Baarda's data snooping). Limits: with few phases a slip cannot be told from a motion,
//! and the faulty one of two cannot be told from the other; then both begin again.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::pairs::Track;

/// Least size of a slip, in cycles: between noise and half a cycle.
const LEAST_CYCLES: f64 = 0.3;
/// Deviation of the change of a phase's single difference, metres: low satellites have the most.
const NOISE_M: f64 = 0.01;
/// Deviations that a slip must have.
const SIGMAS: f64 = 4.0;
/// Least redundancy of a phase: below it the others do not tell whether it slipped.
const LEAST_REDUNDANCY: f64 = 1e-3;

/// Change of a phase since the epoch before.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Satellite and signal.
    pub track: Track,
    /// Change of phase less modelled range, metres.
    pub change_m: f64,
    /// Unit vector from the satellite to the rover.
    pub direction: Vector3<f64>,
    /// Length of the carrier's wave, metres.
    pub wavelength_m: f64,
}

/// Tracks that slipped, of those that both epochs have. A rover at rest does not move beyond its approximate
/// position.
pub fn slipped(changes: &[Change], is_static: bool) -> Vec<Track> {
    let unknowns = if is_static { 1 } else { 4 };
    let mut kept: Vec<Change> = changes.to_vec();
    let mut found = Vec::new();
    while let Some(misses) = misses(&kept, is_static) {
        let Some(worst) = (0..kept.len()).max_by(|one, other| misses[*one].0.total_cmp(&misses[*other].0)) else {
            break;
        };
        let (normalised_m, slip_m) = misses[worst];
        if normalised_m <= SIGMAS * NOISE_M || slip_m <= LEAST_CYCLES * kept[worst].wavelength_m {
            return found;
        }
        if kept.len() <= unknowns + 1 {
            // Which one it is cannot be told.
            found.extend(kept.iter().map(|change| change.track));
            return found;
        }
        found.push(kept.swap_remove(worst).track);
    }
    found
}

/// Residual of each change after a common clock and a displacement: divided by the root of its redundancy, by
/// which residuals of unlike geometry compare, and by the redundancy, the slip that it would be. In metres;
/// `None` if the changes do not determine the unknowns.
fn misses(changes: &[Change], is_static: bool) -> Option<Vec<(f64, f64)>> {
    let unknowns = if is_static { 1 } else { 4 };
    if changes.len() <= unknowns {
        return None;
    }
    let design = DMatrix::from_fn(changes.len(), unknowns, |row, column| match column {
        0 => 1.0,
        axis => changes[row].direction[axis - 1],
    });
    let values = DVector::from_fn(changes.len(), |row, _| changes[row].change_m);
    let inverse = (design.transpose() * &design).cholesky()?.inverse();
    let residuals = &values - &design * (&inverse * (design.transpose() * &values));
    let miss = |row: usize| {
        let own = design.row(row);
        let redundancy = 1.0 - (own * &inverse * own.transpose())[(0, 0)];
        if redundancy < LEAST_REDUNDANCY {
            return (0.0, 0.0);
        }
        (residuals[row].abs() / redundancy.sqrt(), residuals[row].abs() / redundancy)
    };
    Some((0..changes.len()).map(miss).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::carrier::Code;
    use gnss::satellite::Sv;

    fn changes(count: u8) -> Vec<Change> {
        (0..count)
            .map(|number| {
                let (azimuth, elevation) = (2.4 * f64::from(number), 0.3 + 0.13 * f64::from(number));
                let direction = -Vector3::new(
                    libm::cos(elevation) * libm::sin(azimuth),
                    libm::cos(elevation) * libm::cos(azimuth),
                    libm::sin(elevation),
                );
                // A clock of 300 m, a motion of 40 m and millimetres of noise.
                let noise_m = 0.002 * libm::sin(12.9 * f64::from(number));
                let change_m = 300.0 + direction.dot(&Vector3::new(30.0, -20.0, 17.0)) + noise_m;
                let track = (Sv::gps(number + 1), Code::new("1C").unwrap());
                Change { track, change_m, direction, wavelength_m: 0.190_29 }
            })
            .collect()
    }

    #[test]
    fn half_a_cycle_is_found_in_every_phase_and_noise_in_none() {
        assert!(slipped(&changes(9), false).is_empty());
        for at in 0..9 {
            for cycles in [0.5, -0.5, 1.0, 1e6] {
                let mut all = changes(9);
                all[at].change_m += cycles * all[at].wavelength_m;
                assert_eq!(slipped(&all, false), [all[at].track], "{at} {cycles}");
            }
        }
    }

    #[test]
    fn a_motion_is_none_for_a_rover_that_moves_and_slips_for_one_at_rest() {
        let resting: Vec<Change> = changes(6)
            .into_iter()
            .map(|own| Change { change_m: own.change_m - own.direction.dot(&Vector3::new(30.0, -20.0, 17.0)), ..own })
            .collect();
        assert!(slipped(&resting, true).is_empty());
        assert!(!slipped(&changes(6), true).is_empty());
    }

    #[test]
    fn where_the_faulty_phase_cannot_be_told_all_begin_anew() {
        let mut all = changes(5);
        all[2].change_m += 0.5 * all[2].wavelength_m;
        let found = slipped(&all, false);
        // The one degree of freedom sees a fault and not where; a direction may hide it.
        assert!(found.is_empty() || found.len() == 5, "{found:?}");
        let mut two = changes(2);
        two[0].change_m += 50.0;
        assert_eq!(slipped(&two, false).len(), 0);
    }
}
