//! Where a satellite was, and what its clock said, when it sent what the antenna receives now.
//!
//! Light time is iterated in ECEF with the Earth's rotation while the signal travels: each pass
//! shrinks the error by v/c = 1.3e-5 at most, so three from 75 ms are below the rounding of doubles.
//! The satellite's clock is evaluated at true GPS time of emission.

use crate::generator::catalogue::Catalogue;
use crate::generator::ray::Sight;
use crate::generator::vehicle::Motion;
use crate::gnss::broadcast::{OrbitError, State};
use crate::gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS, look, rotate_earth};
use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;

/// A first guess of the light time, good for any place near the Earth.
const LIGHT_TIME_S: f64 = 0.075;
const PASSES: u32 = 4;

/// Geometry and satellite clock behind what is received at one instant.
#[derive(Clone, Debug)]
pub struct Emission {
    pub sight: Sight,
    /// Geometric light time.
    pub travel_s: f64,
    /// Satellite's L1 C/A clock minus GPS time at emission (relativity and T_GD in).
    pub satellite_clock_s: f64,
    /// Its rate against GPS time.
    pub satellite_clock_drift: f64,
}

/// What `sv` sent that reaches an antenna with `motion` (in the ECEF axes of `received`) at true GPS time
/// `received`; `None` when no ephemeris fits.
///
/// # Errors
/// [`OrbitError`] from the elements.
pub fn emission(
    catalogue: &Catalogue,
    sv: Sv,
    received: Epoch,
    motion: &Motion,
) -> Result<Option<Emission>, OrbitError> {
    let mut travel_s = LIGHT_TIME_S;
    let mut found = None;
    for _ in 0..PASSES {
        let Some((state, clock)) = catalogue.truth(sv, received.plus_s(-travel_s))? else { return Ok(None) };
        let satellite = State {
            position_m: rotate_earth(&state.position_m, travel_s),
            velocity_mps: rotate_earth(&state.velocity_mps, travel_s),
        };
        let range_m = (satellite.position_m - motion.position_m).norm();
        travel_s = range_m / SPEED_OF_LIGHT_MPS;
        found = Some((satellite, clock, range_m));
    }
    Ok(found.map(|(satellite, clock, range_m)| {
        let user = Geodetic::from_ecef(&motion.position_m);
        let down = -satellite.position_m;
        let to_user = motion.position_m - satellite.position_m;
        Emission {
            sight: Sight {
                sv,
                received,
                user,
                user_m: motion.position_m,
                user_mps: motion.velocity_mps,
                satellite,
                range_m,
                look: look(user, &motion.position_m, &satellite.position_m),
                off_nadir_rad: libm::atan2(down.cross(&to_user).norm(), down.dot(&to_user)),
            },
            travel_s,
            satellite_clock_s: clock.offset_s,
            satellite_clock_drift: clock.drift,
        }
    }))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::gnss::rinex;

    #[test]
    fn the_light_time_equation_holds_in_inertial_axes() {
        let (catalogue, _) = Catalogue::new(rinex::embedded().unwrap().ephemerides);
        let received = Epoch::from_week(1590, 377_000.25);
        for height_m in [0.0, 9e4, 2e6, 3.6e7] {
            let place = Geodetic::from_degrees(26.5, 80.2, height_m).to_ecef();
            let motion =
                Motion { position_m: place, velocity_mps: Vector3::zeros(), acceleration_mps2: Vector3::zeros() };
            let mut seen = 0;
            for sv in catalogue.satellites() {
                let Some(found) = emission(&catalogue, sv, received, &motion).unwrap() else { continue };
                // Axes of reception taken as inertial: the satellite's ECEF position then, turned into them.
                let sent = received.plus_s(-found.travel_s);
                let (state, clock) = catalogue.truth(sv, sent).unwrap().unwrap();
                let there = rotate_earth(&state.position_m, found.travel_s);
                let residual = (there - place).norm() - SPEED_OF_LIGHT_MPS * found.travel_s;
                // Two ulps of a coordinate, 4e-9 m each, and one of the time, 1.4e-17 s or 4e-9 m.
                assert!(residual.abs() < 3e-8, "{sv} {height_m}: {residual}");
                assert_eq!(clock.offset_s, found.satellite_clock_s);
                assert!(found.sight.off_nadir_rad >= 0.0 && found.sight.look.elevation_rad.abs() < 1.6);
                if found.sight.look.elevation_rad > 0.0 && height_m == 0.0 {
                    seen += 1;
                    assert!((2.0e7..2.6e7).contains(&found.sight.range_m));
                    assert!(found.sight.off_nadir_rad < 14_f64.to_radians());
                }
            }
            assert!(height_m > 0.0 || (7..=14).contains(&seen), "{seen}");
        }
    }

    #[test]
    fn earth_rotation_during_flight_is_the_sagnac_term() {
        let (catalogue, _) = Catalogue::new(rinex::embedded().unwrap().ephemerides);
        let received = Epoch::from_week(1590, 377_000.0);
        let place = Geodetic::from_degrees(0.0, 0.0, 0.0).to_ecef();
        let motion = Motion { position_m: place, velocity_mps: Vector3::zeros(), acceleration_mps2: Vector3::zeros() };
        for sv in catalogue.satellites() {
            let found = emission(&catalogue, sv, received, &motion).unwrap().unwrap();
            let (state, _) = catalogue.truth(sv, received.plus_s(-found.travel_s)).unwrap().unwrap();
            let (s, u) = (state.position_m, place);
            let sagnac_m = crate::gnss::earth::EARTH_ROTATION_RADPS / SPEED_OF_LIGHT_MPS * (s.x * u.y - s.y * u.x);
            let range_m = (s - u).norm();
            // The first-order formula is good to 0.14 mm (theory: second order (Ωτ)² r / 2).
            assert!((found.sight.range_m - range_m - sagnac_m).abs() < 5e-4, "{sv}");
        }
    }
}
