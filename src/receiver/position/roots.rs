//! The other position that the same ranges lead to.
//!
//! As many ranges as unknowns are quadratic equations: they have two solutions, and an iteration ends at
//! either. With x = (r, b), the product ⟨x, y⟩ = r·r' − b b' and dᵢ = (sᵢ − r, ρᵢ − b) of a solution, another
//! one x + λu has ⟨dᵢ, dᵢ⟩ − 2λ⟨dᵢ, u⟩ + λ²⟨u, u⟩ = 0 for every i, the first term being zero: ⟨dᵢ, u⟩ = 1
//! gives u by linear equations, and λ = 2 / ⟨u, u⟩. Source: S. Bancroft, "An algebraic solution of the GPS
//! equations", IEEE Transactions on Aerospace and Electronic Systems 21 (1985), whose two roots these are. A
//! root with a distance below zero is none. What the algebra leaves out (the Earth's rotation, the
//! atmosphere, clocks of several systems) the iteration from there puts right. With more ranges both are
//! minima of the residuals, and the larger one is dropped.

use nalgebra::{Cholesky, Matrix4, Vector3, Vector4};

use crate::position::NoFix;
use crate::position::least_squares::{Corrections, Range, SPACE_M, Solution, freedom, position, velocity};
use gnss::earth::{EARTH_ROTATION_RADPS, Geodetic, SPEED_OF_LIGHT_MPS};

/// A line of sight that comes nearer to the Earth's centre is blocked: 57 km below the surface at the poles.
const EARTH_M: f64 = 6.3e6;
/// Faster than this nothing stays with the Earth (11.2 km/s at its surface).
const LARGEST_SPEED_MPS: f64 = 1.2e4;
/// Difference in chi-square that decides between two minima: e⁻¹⁵, 3e-7, in likelihood.
const DECIDING: f64 = 30.0;
/// Length that makes the algebra's numbers near one.
const UNIT_M: f64 = 1e7;
/// Solutions closer than this are the same one, reached twice.
const SAME_M: f64 = 1.0;

/// Solves from a first estimate that is not a position of the same receiver, such as the Earth's centre: of
/// two positions that the ranges agree on, the one where the receiver can be. Where the iteration does not
/// end, as on the way to the Moon, it begins at the roots of the equations.
///
/// # Errors
/// Errors of [`position`]; two positions where it can be, or, without a range to spare, none.
pub fn first(ranges: &[Range], start_m: Vector3<f64>, corrections: &Corrections) -> Result<Solution, NoFix> {
    let found = match position(ranges, start_m, corrections) {
        Err(diverged @ NoFix::Diverged { .. }) => {
            let ends =
                algebraic(ranges).into_iter().flatten().filter_map(|root| position(ranges, root, corrections).ok());
            ends.min_by(|one, other| one.chi_square.total_cmp(&other.chi_square)).ok_or(diverged)?
        }
        ended => ended?,
    };
    let Some(other) = other(ranges, &found, corrections) else {
        return if freedom(ranges) > 0 || is_possible(ranges, &found) { Ok(found) } else { Err(NoFix::Nowhere) };
    };
    let excess = found.chi_square - other.chi_square;
    if excess.abs() > DECIDING {
        return Ok(if excess > 0.0 { other } else { found });
    }
    match (is_possible(ranges, &found), is_possible(ranges, &other)) {
        (true, false) => Ok(found),
        (false, true) => Ok(other),
        (false, false) if freedom(ranges) > 0 => Ok(found),
        (false, false) => Err(NoFix::Nowhere),
        // Receivers are near the ground unless the ranges say otherwise.
        (true, true) => match (is_low(&found), is_low(&other)) {
            (true, false) => Ok(found),
            (false, true) => Ok(other),
            _ => Err(NoFix::TwoPlaces { separation_m: (found.position_m - other.position_m).norm() }),
        },
    }
}

/// True if a receiver can be at this solution: it sees its satellites past the Earth, and does not leave the
/// Earth.
pub fn is_possible(ranges: &[Range], solution: &Solution) -> bool {
    let place_m = &solution.position_m;
    let is_seen = |sight: &Vector3<f64>| {
        let ahead_m = (-place_m.dot(sight)).max(0.0);
        (place_m + ahead_m * sight).norm() > EARTH_M
    };
    let spin = Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS);
    let speed_mps = velocity(ranges, solution).map(|(velocity_mps, _)| (velocity_mps + spin.cross(place_m)).norm());
    solution.sights.iter().all(is_seen) && speed_mps.is_ok_and(|speed_mps| speed_mps < LARGEST_SPEED_MPS)
}

fn is_low(solution: &Solution) -> bool {
    Geodetic::from_ecef(&solution.position_m).height_m < SPACE_M
}

/// Positions, in metres, that the equations lead to without a first estimate, by one clock for all ranges;
/// none where the least squares of the equations has no real root.
///
/// With aᵢ = (sᵢ, ρᵢ) and y = (r, b), ⟨aᵢ − y, aᵢ − y⟩ = 0 says ⟨aᵢ, y⟩ = ⟨aᵢ, aᵢ⟩ / 2 + Λ with Λ = ⟨y, y⟩ /
/// 2. The linear equations give y = v + Λu, and Λ is a root of ⟨u, u⟩Λ² + 2(⟨u, v⟩ − 1)Λ + ⟨v, v⟩.
fn algebraic(ranges: &[Range]) -> Option<[Vector3<f64>; 2]> {
    let product = |a: &Vector4<f64>, b: &Vector4<f64>| a.xyz().dot(&b.xyz()) - a.w * b.w;
    let (mut normal, mut ones, mut halves) = (Matrix4::zeros(), Vector4::zeros(), Vector4::zeros());
    for range in ranges {
        let clear_m = range.pseudorange_m + SPEED_OF_LIGHT_MPS * range.clock.offset_s;
        let a = range.satellite.position_m.push(clear_m) / UNIT_M;
        let row = Vector4::new(a.x, a.y, a.z, -a.w);
        normal += row * row.transpose();
        ones += row;
        halves += 0.5 * product(&a, &a) * row;
    }
    let normal = Cholesky::new(normal)?;
    let (u, v) = (normal.solve(&ones), normal.solve(&halves));
    let (square, middle, rest) = (product(&u, &u), product(&u, &v) - 1.0, product(&v, &v));
    let spread = Some(middle * middle - square * rest).filter(|squared| *squared >= 0.0)?.sqrt();
    Some([spread, -spread].map(|spread| (v + u * ((spread - middle) / square)).xyz() * UNIT_M))
}

/// The other solution, where there is one.
fn other(ranges: &[Range], found: &Solution, corrections: &Corrections) -> Option<Solution> {
    // A satellite turns with the Earth by 1e-5 of its distance while the signal travels.
    let distances_m = || ranges.iter().map(|range| (range.satellite.position_m - found.position_m).norm());
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for (sight, distance_m) in found.sights.iter().zip(distances_m()) {
        let row = Vector4::new(sight.x, sight.y, sight.z, -1.0);
        normal += row * row.transpose();
        right += row / distance_m;
    }
    let u = Cholesky::new(normal)?.solve(&right);
    let lambda = 2.0 / (u.xyz().norm_squared() - u.w * u.w);
    if distances_m().any(|distance_m| distance_m < lambda * u.w) {
        return None;
    }
    let other = position(ranges, found.position_m + lambda * u.xyz(), corrections).ok()?;
    ((other.position_m - found.position_m).norm() > SAME_M).then_some(other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::position::least_squares::Ionosphere;
    use crate::position::tests::{place, ranges_at};
    use gnss::earth::rotate_earth;

    const BARE: Corrections = Corrections { ionosphere: Ionosphere::Absent, troposphere: false, model_sigma_m: 1e-6 };

    #[test]
    fn four_satellites_anywhere_give_the_place_or_say_why_not() {
        let mut state = 5_u64;
        let mut uniform = |low: f64, high: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut elsewhere, mut refused) = (0, 0);
        for _ in 0..2000 {
            let towards = uniform(0.0, 360.0);
            let width = uniform(10.0, 180.0);
            let sky: Vec<(f64, f64, f64)> =
                (0..4).map(|_| (towards + uniform(-width, width), uniform(1.0, 90.0), uniform(2.0e7, 4.0e7))).collect();
            let sky = ranges_at(&sky, uniform(-1e-3, 1e-3));
            let is_here = |found: &Solution| (found.position_m - place().to_ecef()).norm() < 1.0;
            let Ok(plain) = position(&sky, Vector3::zeros(), &BARE) else { continue };
            elsewhere += usize::from(!is_here(&plain));
            match first(&sky, Vector3::zeros(), &BARE) {
                Ok(found) => assert!(is_here(&found), "{:?}", found.position_m),
                Err(_) => refused += 1,
            }
        }
        // The iteration alone ends at the other root now and then, or this test shows nothing.
        assert!(elsewhere > 10 && refused < 20, "{elsewhere} {refused}");
    }

    #[test]
    fn places_from_the_ground_to_the_moon_are_found() {
        let (mut astray, mut state) = (0, 3_u64);
        let mut uniform = |low: f64, high: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for _ in 0..200 {
            let mut somewhere = |radius_m: f64| loop {
                let cube = Vector3::from_fn(|_, _| uniform(-1.0, 1.0));
                if (0.1..1.0).contains(&cube.norm()) {
                    break cube.normalize() * radius_m;
                }
            };
            let towards = somewhere(1.0);
            let satellites_m: Vec<Vector3<f64>> = (0..12).map(|_| somewhere(2.656e7)).collect();
            let here_m = towards * 6.4e6 * libm::pow(60.0, uniform(0.0, 1.0));
            let mut ranges = ranges_at(&[(0.0, 0.0, 2e7); 12], uniform(-1.0, 1.0));
            for (range, seen_m) in ranges.iter_mut().zip(satellites_m) {
                let distance_m = (seen_m - here_m).norm();
                range.pseudorange_m += distance_m - 2e7;
                range.satellite.position_m = rotate_earth(&seen_m, -distance_m / SPEED_OF_LIGHT_MPS);
            }
            astray += usize::from(position(&ranges, Vector3::zeros(), &BARE).is_err());
            let found = first(&ranges, Vector3::zeros(), &BARE).unwrap();
            // Ranges of 4e8 m hold 6e-8 m, and dilutions stay below the largest condition, 1e4.
            assert!((found.position_m - here_m).norm() < 1e-3, "{here_m}: {found:?}");
        }
        // From the Earth's centre alone some are never found, or this test shows nothing.
        assert!(astray > 10, "{astray}");
    }

    #[test]
    fn ranges_whose_rates_leave_the_earth_agree_on_no_place() {
        // 1e6 Hz of one carrier are 190 km/s.
        let mut sky =
            ranges_at(&[(0.0, 80.0, 2.1e7), (10.0, 20.0, 2.3e7), (130.0, 25.0, 2.4e7), (250.0, 30.0, 2.2e7)], 0.0);
        assert!(first(&sky, Vector3::zeros(), &BARE).is_ok());
        sky[1].doppler_hz = 1e6;
        assert_eq!(first(&sky, Vector3::zeros(), &BARE).err(), Some(NoFix::Nowhere));
    }
}
