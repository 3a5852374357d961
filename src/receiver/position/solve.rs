//! Iterated weighted least squares for place and clock, and for velocity and drift.
//!
//! Starts at the Earth's centre. The Earth turns during the light time of the *geometric* range: a receiver
//! clock that is milliseconds off must not move the fix. Geometry that determines nothing is refused with
//! its condition number.

use nalgebra::{DMatrix, DVector, Matrix4, Vector3, Vector4};
use thiserror::Error;

use crate::gnss::broadcast::{ClockState, State};
use crate::gnss::earth::{EARTH_ROTATION_RADPS, SPEED_OF_LIGHT_MPS, rotate_earth};
use crate::gnss::satellite::Sv;

const MOST_ITERATIONS: usize = 12;
/// Position steps below this end the iteration.
const CONVERGED_M: f64 = 1e-4;
/// Geometry whose matrix has a larger condition number than this determines no position: errors grow ten-thousandfold.
const LARGEST_CONDITION: f64 = 1e8;

/// Why there is no position.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NoFix {
    #[error("{have} satellites have all that a position needs, of {need} needed")]
    TooFew { have: usize, need: usize },
    #[error(
        "the satellites' geometry determines no position: condition number {condition:.1e}, limit {LARGEST_CONDITION:.0e}"
    )]
    Singular { condition: f64 },
    #[error("the position did not converge in {iterations} iterations")]
    NotConverged { iterations: usize },
    #[error(
        "the residuals contradict each other and leaving out satellites does not help: {chi_square:.1} of {limit:.1} allowed"
    )]
    Inconsistent { chi_square: f64, limit: f64 },
}

/// One satellite's contribution.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    pub sv: Sv,
    /// Satellite when it sent, in the ECEF axes of that instant.
    pub satellite: State,
    /// Its clock then, group delay of this signal included.
    pub clock: ClockState,
    /// Speed of light times (receiver's clock − satellite's clock).
    pub pseudorange_m: f64,
    /// Rate of the pseudorange over receiver time.
    pub range_rate_mps: f64,
    /// Atmospheric delay to take off.
    pub delay_m: f64,
    /// Standard deviation that the range is weighted with, and that of its rate.
    pub sigma_m: f64,
    pub sigma_mps: f64,
}

/// A place and a clock.
#[derive(Clone, Debug)]
pub struct Place {
    pub position_m: Vector3<f64>,
    /// Receiver's clock minus GPS time, in metres.
    pub clock_m: f64,
    /// (HᵀWH)⁻¹ in ECEF axes and clock metres, and (HᵀH)⁻¹ for dilution of precision.
    pub covariance_m2: Matrix4<f64>,
    pub geometry: Matrix4<f64>,
    /// Measured minus modelled, per range, and their weighted sum of squares.
    pub residuals_m: Vec<f64>,
    pub chi_square: f64,
    pub iterations: usize,
}

/// A velocity and a clock drift.
#[derive(Clone, Copy, Debug)]
pub struct Movement {
    pub velocity_mps: Vector3<f64>,
    /// Drift of the receiver's clock, in seconds a second.
    pub clock_drift: f64,
}

/// Unit vector towards the satellite, geometric range, and the satellite in the axes of reception.
fn line(satellite_m: &Vector3<f64>, user_m: &Vector3<f64>) -> (Vector3<f64>, f64, Vector3<f64>) {
    let mut range_m = (satellite_m - user_m).norm();
    let mut seen_m = *satellite_m;
    // The light time changes by v/c = 1e-6 of itself a pass.
    for _ in 0..3 {
        seen_m = rotate_earth(satellite_m, range_m / SPEED_OF_LIGHT_MPS);
        range_m = (seen_m - user_m).norm();
    }
    ((seen_m - user_m) / range_m.max(1.0), range_m, seen_m)
}

/// The satellite in the ECEF axes of reception at `user_m`.
pub fn seen_from(satellite_m: &Vector3<f64>, user_m: &Vector3<f64>) -> Vector3<f64> {
    line(satellite_m, user_m).2
}

/// Position and clock from at least four ranges, starting at `start_m`.
pub fn place(ranges: &[Range], start_m: Vector3<f64>, start_clock_m: f64) -> Result<Place, NoFix> {
    if ranges.len() < 4 {
        return Err(NoFix::TooFew { have: ranges.len(), need: 4 });
    }
    let mut position_m = start_m;
    let mut clock_m = start_clock_m;
    for iteration in 1..=MOST_ITERATIONS {
        let system = System::at(ranges, &position_m, clock_m);
        let geometry = system.geometry()?;
        let covariance_m2 = system.normal_inverse()?;
        let step: Vector4<f64> = covariance_m2 * system.weighted_right();
        position_m += step.fixed_rows::<3>(0);
        clock_m += step[3];
        if step.fixed_rows::<3>(0).norm() < CONVERGED_M {
            let last = System::at(ranges, &position_m, clock_m);
            let residuals_m: Vec<f64> = last.right.iter().copied().collect();
            let chi_square = residuals_m.iter().zip(ranges).map(|(v, r)| (v / r.sigma_m) * (v / r.sigma_m)).sum();
            return Ok(Place {
                position_m,
                clock_m,
                covariance_m2,
                geometry,
                residuals_m,
                chi_square,
                iterations: iteration,
            });
        }
    }
    Err(NoFix::NotConverged { iterations: MOST_ITERATIONS })
}

/// The linear system of one iteration.
struct System {
    design: DMatrix<f64>,
    right: DVector<f64>,
    weights: DVector<f64>,
}

impl System {
    fn at(ranges: &[Range], position_m: &Vector3<f64>, clock_m: f64) -> Self {
        let mut design = DMatrix::zeros(ranges.len(), 4);
        let mut right = DVector::zeros(ranges.len());
        for (row, range) in ranges.iter().enumerate() {
            let (towards, range_m, _) = line(&range.satellite.position_m, position_m);
            let modelled_m = range_m + clock_m - SPEED_OF_LIGHT_MPS * range.clock.offset_s + range.delay_m;
            right[row] = range.pseudorange_m - modelled_m;
            design.row_mut(row).copy_from_slice(&[-towards.x, -towards.y, -towards.z, 1.0]);
        }
        let weights = DVector::from_iterator(ranges.len(), ranges.iter().map(|r| 1.0 / (r.sigma_m * r.sigma_m)));
        Self { design, right, weights }
    }

    fn geometry(&self) -> Result<Matrix4<f64>, NoFix> {
        let normal: Matrix4<f64> = (self.design.transpose() * &self.design).fixed_view::<4, 4>(0, 0).into_owned();
        invert(normal)
    }

    fn normal_inverse(&self) -> Result<Matrix4<f64>, NoFix> {
        let weighted = DMatrix::from_diagonal(&self.weights) * &self.design;
        let normal: Matrix4<f64> = (self.design.transpose() * weighted).fixed_view::<4, 4>(0, 0).into_owned();
        invert(normal)
    }

    fn weighted_right(&self) -> Vector4<f64> {
        let weighted = self.right.component_mul(&self.weights);
        (self.design.transpose() * weighted).fixed_rows::<4>(0).into_owned()
    }
}

/// The inverse of a symmetric matrix, or the condition number that forbids it.
fn invert(normal: Matrix4<f64>) -> Result<Matrix4<f64>, NoFix> {
    let eigenvalues = normal.symmetric_eigenvalues();
    let condition = eigenvalues.max() / eigenvalues.min();
    let condition = if condition > 0.0 { condition } else { f64::INFINITY };
    if condition > LARGEST_CONDITION {
        return Err(NoFix::Singular { condition });
    }
    normal.cholesky().map(|cholesky| cholesky.inverse()).ok_or(NoFix::Singular { condition })
}

/// Velocity and clock drift from range rates, at a place already found. Receiver motion and clock enter exactly, to
/// second order in v/c.
pub fn movement(ranges: &[Range], position_m: &Vector3<f64>) -> Result<Movement, NoFix> {
    if ranges.len() < 4 {
        return Err(NoFix::TooFew { have: ranges.len(), need: 4 });
    }
    let mut movement = Movement { velocity_mps: Vector3::zeros(), clock_drift: 0.0 };
    for _ in 0..4 {
        let mut normal = Matrix4::zeros();
        let mut right = Vector4::zeros();
        for range in ranges {
            let (towards, _, _) = line(&range.satellite.position_m, position_m);
            let row = Vector4::new(-towards.x, -towards.y, -towards.z, SPEED_OF_LIGHT_MPS);
            let weight = 1.0 / (range.sigma_mps * range.sigma_mps);
            let misfit = range.range_rate_mps - modelled_rate_mps(range, position_m, &movement);
            normal += weight * row * row.transpose();
            right += weight * misfit * row;
        }
        // Scaled so that the clock's column is of the others' size.
        let scale = Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 1.0, 1.0 / SPEED_OF_LIGHT_MPS));
        let step = scale * invert(scale * normal * scale)? * scale * right;
        movement.velocity_mps += step.fixed_rows::<3>(0);
        movement.clock_drift += step[3];
    }
    Ok(movement)
}

/// c (1 − dT_s/dT_r): emission and reception by their own clocks, with the Earth turning in between.
fn modelled_rate_mps(range: &Range, position_m: &Vector3<f64>, movement: &Movement) -> f64 {
    let (towards, range_m, seen_m) = line(&range.satellite.position_m, position_m);
    let seen_mps = rotate_earth(&range.satellite.velocity_mps, range_m / SPEED_OF_LIGHT_MPS);
    let turning = EARTH_ROTATION_RADPS * Vector3::new(seen_m.y, -seen_m.x, 0.0);
    // r' = û·(v_s (1 − τ') + Ω-term τ' − v_u) with τ' = r'/c, solved for r'.
    let still = towards.dot(&(seen_mps - movement.velocity_mps));
    let feedback = towards.dot(&(turning - seen_mps)) / SPEED_OF_LIGHT_MPS;
    let travel_rate = still / (1.0 - feedback) / SPEED_OF_LIGHT_MPS;
    let sent_rate = (1.0 - travel_rate) * (1.0 + range.clock.drift) / (1.0 + movement.clock_drift);
    SPEED_OF_LIGHT_MPS * (1.0 - sent_rate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::earth::{Geodetic, look};

    /// Satellites at given azimuths and elevations over Kanpur, with exact ranges to a user there.
    fn sky(directions: &[(f64, f64)], clock_m: f64, moving: Vector3<f64>, drift: f64) -> (Vector3<f64>, Vec<Range>) {
        let here = Geodetic::from_degrees(26.5, 80.2, 130.0);
        let user_m = here.to_ecef();
        let axes = here.ecef_to_enu().transpose();
        let ranges = directions
            .iter()
            .enumerate()
            .map(|(k, &(azimuth, elevation))| {
                let (azimuth, elevation) = (f64::to_radians(azimuth), f64::to_radians(elevation));
                let (se, ce) = libm::sincos(elevation);
                let (sa, ca) = libm::sincos(azimuth);
                let seen_m = user_m + axes * Vector3::new(ce * sa, ce * ca, se) * 2.2e7;
                let travel_s = (seen_m - user_m).norm() / SPEED_OF_LIGHT_MPS;
                let velocity_mps = Vector3::new(1000.0 - 300.0 * k as f64, 2500.0, -900.0 * (k % 3) as f64);
                let satellite = State { position_m: rotate_earth(&seen_m, -travel_s), velocity_mps };
                let clock = ClockState { offset_s: 1e-5 * k as f64, drift: 1e-11 * k as f64 };
                let mut range = Range {
                    sv: Sv::gps(k as u8 + 1),
                    satellite,
                    clock,
                    pseudorange_m: 2.2e7 + clock_m - SPEED_OF_LIGHT_MPS * clock.offset_s,
                    range_rate_mps: 0.0,
                    delay_m: 0.0,
                    sigma_m: 1.0,
                    sigma_mps: 0.1,
                };
                range.range_rate_mps = rate_by_differences(&range, &user_m, &moving, drift);
                range
            })
            .collect();
        (user_m, ranges)
    }

    /// The pseudorange rate from two instants 0.02 s apart, solved on their own.
    fn rate_by_differences(range: &Range, user_m: &Vector3<f64>, moving: &Vector3<f64>, drift: f64) -> f64 {
        let travel_s = line(&range.satellite.position_m, user_m).1 / SPEED_OF_LIGHT_MPS;
        let pseudorange = |t: f64| {
            let user = user_m + moving * t;
            let mut travel = travel_s;
            for _ in 0..6 {
                // Emitted at t − travel; the state is of t = 0 minus travel_s.
                let sent = range.satellite.position_m + range.satellite.velocity_mps * (t - travel + travel_s);
                travel = (rotate_earth(&sent, travel) - user).norm() / SPEED_OF_LIGHT_MPS;
            }
            SPEED_OF_LIGHT_MPS * (travel + drift * t - range.clock.drift * (t - travel))
        };
        (pseudorange(0.01) - pseudorange(-0.01)) / 0.02 / (1.0 + drift)
    }

    const REFERENCE: [(f64, f64); 10] = [
        (20.0, 75.0),
        (65.0, 42.0),
        (110.0, 18.0),
        (150.0, 55.0),
        (190.0, 33.0),
        (225.0, 12.0),
        (260.0, 63.0),
        (300.0, 25.0),
        (335.0, 48.0),
        (15.0, 9.0),
    ];

    #[test]
    fn the_place_is_found_from_the_centre_of_the_earth_whatever_the_clock_says() {
        // 11 ms of receiver clock would shift the fix by 4.6 m if the Earth turned with the raw pseudorange.
        for clock_m in [0.0, 11e-3 * SPEED_OF_LIGHT_MPS] {
            let (user_m, ranges) = sky(&REFERENCE, clock_m, Vector3::zeros(), 0.0);
            let found = place(&ranges, Vector3::zeros(), 0.0).unwrap();
            // Ten ulps of a range of 2.2e7 m, times the geometry.
            assert!((found.position_m - user_m).norm() < 2e-5, "{}", (found.position_m - user_m).norm());
            assert!((found.clock_m - clock_m).abs() < 2e-5);
            assert!(found.iterations <= 8 && found.chi_square < 1e-9);
        }
    }

    #[test]
    fn dilution_of_precision_of_the_reference_sky_is_as_computed_elsewhere() {
        let (user_m, ranges) = sky(&REFERENCE, 0.0, Vector3::zeros(), 0.0);
        let found = place(&ranges, Vector3::zeros(), 0.0).unwrap();
        let here = Geodetic::from_ecef(&user_m);
        let local = here.ecef_to_enu() * found.geometry.fixed_view::<3, 3>(0, 0) * here.ecef_to_enu().transpose();
        let hdop = (local[(0, 0)] + local[(1, 1)]).sqrt();
        for (got, expected) in [
            (hdop, 0.822),
            (local[(2, 2)].sqrt(), 1.152),
            (found.geometry[(3, 3)].sqrt(), 0.732),
            (found.geometry.trace().sqrt(), 1.593),
        ] {
            assert!((got - expected).abs() < 1e-3, "{got} {expected}");
        }
        let seen = look(here, &user_m, &seen_from(&ranges[2].satellite.position_m, &user_m));
        assert!((seen.elevation_rad.to_degrees() - 18.0).abs() < 1e-6);
    }

    #[test]
    fn velocity_and_drift_are_those_of_the_ranges() {
        let moving = Vector3::new(120.0, -340.0, 55.0);
        let (user_m, ranges) = sky(&REFERENCE, 300.0, moving, 2e-6);
        let found = movement(&ranges, &user_m).unwrap();
        // Differences of 2.2e7 m over 0.02 s resolve 4e-7 m/s; the third derivative of the range adds less.
        assert!((found.velocity_mps - moving).norm() < 1e-5, "{}", (found.velocity_mps - moving).norm());
        assert!((found.clock_drift - 2e-6).abs() * SPEED_OF_LIGHT_MPS < 1e-5);
    }

    #[test]
    fn too_few_satellites_or_all_on_a_cone_give_no_position() {
        let (_, ranges) = sky(&REFERENCE, 0.0, Vector3::zeros(), 0.0);
        assert_eq!(place(&ranges[..3], Vector3::zeros(), 0.0).unwrap_err(), NoFix::TooFew { have: 3, need: 4 });
        let cone: Vec<(f64, f64)> = (0..5).map(|k| (72.0 * f64::from(k), 30.0)).collect();
        let (user_m, ranges) = sky(&cone, 0.0, Vector3::zeros(), 0.0);
        assert!(matches!(place(&ranges, user_m, 0.0), Err(NoFix::Singular { .. })));
    }
}
