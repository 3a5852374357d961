//! Position and clock of a satellite at the emission of the signal that the antenna receives now.
//!
//! The light time solves |s(t − τ) − u| = cτ in the axes of reception, taken as inertial. The orbit is
//! evaluated at a guess of τ and taken as straight from there, so that one Newton step leaves half the
//! curvature of the range (below 2 m/s² for these orbits) times the step squared; it is evaluated again until
//! that is below a nanometre: twice from a guess for the Earth's surface, once from a neighbour's light time.
//! The satellite's clock is evaluated at true GPS time of emission.

use nalgebra::{Matrix3, SVector, Vector3};

use crate::catalogue::Catalogue;
use crate::ray::Sight;
use crate::vehicle::Motion;
use gnss::broadcast::{ClockState, Ephemeris, OrbitError, State};
use gnss::earth::{EARTH_ROTATION_RADPS, Geodetic, SPEED_OF_LIGHT_MPS, look_in, rotate_earth};
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// A first guess of the light time, good for any position near the Earth.
pub const LIGHT_TIME_S: f64 = 0.075;
/// A step of the light time over which the range may be taken as straight: 2 m/s² · step² / 2 is 0.9 nm.
const STRAIGHT_S: f64 = 3e-5;
/// Evaluations of the orbit at most; from any guess within a second the second step is below 1e-8 s.
const PASSES: u32 = 4;

/// Ranges that have no direction.
const LEAST_RANGE_M: f64 = 1.0;

/// Geometry and satellite clock for a signal that is received at one instant.
#[derive(Clone, Debug)]
pub struct Emission {
    /// Line of sight at reception.
    pub sight: Sight,
    /// Geometric light time, in seconds.
    pub travel_s: f64,
    /// Satellite's L1 C/A clock minus GPS time at emission in seconds, with relativity and T_GD included.
    pub satellite_clock_s: f64,
    /// Rate of the satellite clock against GPS time, in s/s.
    pub satellite_clock_drift: f64,
}

/// Antenna at one instant, as all satellites see it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// True GPS time.
    pub time: Epoch,
    /// True time since the scene's start, in seconds.
    pub elapsed_s: f64,
    /// Motion of the antenna.
    pub motion: Motion,
    user: Geodetic,
    /// East, north and up there.
    axes: Matrix3<f64>,
}

impl Place {
    /// Creates the antenna with `motion` at `time`, `elapsed_s` after the scene's start.
    pub fn new(time: Epoch, elapsed_s: f64, motion: Motion) -> Self {
        let user = Geodetic::from_ecef(&motion.position_m);
        Self { time, elapsed_s, motion, user, axes: user.ecef_to_enu() }
    }
}

fn earth_rotation() -> Vector3<f64> {
    Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS)
}

/// Emission from `sv` that reaches an antenna with `motion` (in the ECEF axes of `received`) at true GPS time
/// `received`. `None` when no ephemeris fits.
///
/// # Errors
/// [`OrbitError`] from the elements.
pub fn emission(
    catalogue: &Catalogue,
    sv: Sv,
    received: Epoch,
    motion: &Motion,
) -> Result<Option<Emission>, OrbitError> {
    emission_near(catalogue, sv, received, motion, LIGHT_TIME_S)
}

/// Like [`emission`], with a guess of the light time, on which the result depends only by rounding.
///
/// # Errors
/// Errors of [`emission`].
pub fn emission_near(
    catalogue: &Catalogue,
    sv: Sv,
    received: Epoch,
    motion: &Motion,
    guess_s: f64,
) -> Result<Option<Emission>, OrbitError> {
    emission_of(|at| catalogue.truth(sv, at), sv, &Place::new(received, 0.0, *motion), guess_s)
}

/// [`emission`] by one ephemeris, whether it is sent then or not.
///
/// # Errors
/// Errors of [`emission`].
pub fn emission_of_set(set: &Ephemeris, received: Epoch, motion: &Motion) -> Result<Option<Emission>, OrbitError> {
    let place = Place::new(received, 0.0, *motion);
    emission_of(|at| set.state_and_clock_l1(at).map(Some), set.sv, &place, LIGHT_TIME_S)
}

/// [`emission_near`] of a satellite whose orbit and clock are those of `truth`.
fn emission_of(
    truth: impl Fn(Epoch) -> Result<Option<(State, ClockState)>, OrbitError>,
    sv: Sv,
    place: &Place,
    guess_s: f64,
) -> Result<Option<Emission>, OrbitError> {
    let Place { time: received, motion, user, axes, .. } = *place;
    let mut travel_s = guess_s;
    let mut found = None;
    for _ in 0..PASSES {
        let sent = received.plus_s(planted!("generator.sky.light_time", -travel_s, 0.0));
        let Some((state, clock)) = truth(sent)? else { return Ok(None) };
        let position_m = rotate_earth(&state.position_m, planted!("generator.sky.earth_rotation", travel_s, 0.0));
        let velocity_mps = rotate_earth(&state.velocity_mps, travel_s);
        let inertial_mps = velocity_mps + earth_rotation().cross(&position_m);
        let sight_m = position_m - motion.position_m;
        let range_m = sight_m.norm();
        if range_m < LEAST_RANGE_M {
            return Err(OrbitError::Near { sv, range_m });
        }
        let approach_mps = inertial_mps.dot(&sight_m) / range_m;
        let step_s = (range_m - SPEED_OF_LIGHT_MPS * travel_s) / (SPEED_OF_LIGHT_MPS + approach_mps);
        travel_s += step_s;
        let satellite = State { position_m: position_m - inertial_mps * step_s, velocity_mps };
        let offset_s = clock.offset_s - clock.drift * step_s;
        found = Some((satellite, planted!("generator.sky.clock_sign", offset_s, -offset_s), clock.drift));
        if step_s.abs() < STRAIGHT_S {
            break;
        }
    }
    Ok(found.map(|(satellite, satellite_clock_s, satellite_clock_drift)| {
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
                range_m: to_user.norm(),
                look: look_in(&axes, &motion.position_m, &satellite.position_m),
                off_nadir_rad: libm::atan2(down.cross(&to_user).norm(), down.dot(&to_user)),
            },
            travel_s,
            satellite_clock_s,
            satellite_clock_drift,
        }
    }))
}

/// Nodes of an [`Arc`].
const ARC_NODES: usize = 6;
/// Light times that an arc has room for, to three Earth radii beyond the orbits.
const ARC_LEAD_S: f64 = 0.3;

/// Position, velocity, clock and its rate.
type Row = SVector<f64, 8>;

/// Orbit and clock of a satellite over some seconds: the polynomial of degree five through six states of the
/// catalogue.
///
/// The remainder is `r (ω h)⁶ / (32 · 6!)` with half a span h and ω below 3e-4 rad/s in ECEF: 1e-12 m over 16
/// s, so what is left is rounding; at the edge of a hand-over of Δ metres, whose jerk jumps, 3e-6 Δ.
#[derive(Clone, Debug)]
pub struct Arc {
    sv: Sv,
    middle: Epoch,
    nodes_s: [f64; ARC_NODES],
    /// Newton's divided differences.
    differences: [Row; ARC_NODES],
    /// Light time at the middle in seconds, and its rate in s/s.
    guess: (f64, f64),
}

impl Arc {
    /// Computes the arc for signals that are received from `from` to `to`. `None` where the catalogue lacks
    /// an ephemeris.
    ///
    /// # Errors
    /// [`OrbitError`] from the elements.
    pub fn through(catalogue: &Catalogue, sv: Sv, from: Epoch, to: Epoch) -> Result<Option<Self>, OrbitError> {
        let half_s = 0.5 * (to.since(from) + ARC_LEAD_S);
        let middle = to.plus_s(-half_s);
        let (mut nodes_s, mut differences) = ([0.0; ARC_NODES], [Row::zeros(); ARC_NODES]);
        for (k, (node_s, row)) in nodes_s.iter_mut().zip(&mut differences).enumerate() {
            *node_s = -half_s * libm::cos(std::f64::consts::PI * (k as f64 + 0.5) / ARC_NODES as f64);
            let Some((state, clock)) = catalogue.truth(sv, middle.plus_s(*node_s))? else { return Ok(None) };
            row.fixed_rows_mut::<3>(0).copy_from(&state.position_m);
            row.fixed_rows_mut::<3>(3).copy_from(&state.velocity_mps);
            (row[6], row[7]) = (clock.offset_s, clock.drift);
        }
        for order in 1..ARC_NODES {
            for k in (order..ARC_NODES).rev() {
                differences[k] = (differences[k] - differences[k - 1]) / (nodes_s[k] - nodes_s[k - order]);
            }
        }
        Ok(Some(Self { sv, middle, nodes_s, differences, guess: (LIGHT_TIME_S, 0.0) }))
    }

    /// Adds a guess of the light time for users near a position in ECEF, metres. One evaluation suffices
    /// there.
    pub fn near(self, place_m: &Vector3<f64>) -> Self {
        let (State { position_m, velocity_mps }, _) = self.at(self.middle);
        let sight_m = position_m - place_m;
        let range_m = sight_m.norm().max(LEAST_RANGE_M);
        let guess = (range_m / SPEED_OF_LIGHT_MPS, velocity_mps.dot(&sight_m) / range_m / SPEED_OF_LIGHT_MPS);
        Self { guess, ..self }
    }

    /// Orbit and clock at `at`.
    fn at(&self, at: Epoch) -> (State, ClockState) {
        let t_s = at.since(self.middle);
        let mut row = Row::zeros();
        for (difference, node_s) in self.differences.iter().zip(&self.nodes_s).rev() {
            row = row * (t_s - node_s) + difference;
        }
        let state = State {
            position_m: row.fixed_rows::<3>(0).into_owned(),
            velocity_mps: row.fixed_rows::<3>(3).into_owned(),
        };
        (state, ClockState { offset_s: row[6], drift: row[7] })
    }

    /// Emission from the arc's satellite that reaches a position, like the function [`emission`].
    ///
    /// # Errors
    /// None by itself.
    pub fn emission(&self, place: &Place) -> Result<Option<Emission>, OrbitError> {
        let (guess_s, gain) = self.guess;
        // Without a position of its own, the guess is the same number at all times.
        let guess_s = if gain == 0.0 { guess_s } else { guess_s + gain * place.time.since(self.middle) };
        emission_of(|at| Ok(Some(self.at(at))), self.sv, place, guess_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::rinex;

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
                // The last step's share of it is far below an ulp, but may tip a rounding.
                assert!((clock.offset_s - found.satellite_clock_s).abs() <= clock.offset_s.abs() * f64::EPSILON);
                // From any guess comes the same: 1 nm where the step is straight, and the rounding of another
                // evaluation of the orbit. Its five angles reach 2π, of which half an ulp is 4.4e-16 rad or
                // 1.2e-8 m: 6e-8 m for each of the two in the worst case.
                for guess_s in [found.travel_s, found.travel_s + 2.9e-5, found.travel_s - 2.9e-5, 0.0, 0.3] {
                    let near = emission_near(&catalogue, sv, received, &motion, guess_s).unwrap().unwrap();
                    let moved_m = (near.travel_s - found.travel_s) * SPEED_OF_LIGHT_MPS;
                    assert!(moved_m.abs() < 1.2e-7, "{sv} {height_m} {guess_s}: {moved_m}");
                    let moved_m = (near.sight.satellite.position_m - found.sight.satellite.position_m).norm();
                    assert!(moved_m < 1.2e-7, "{sv} {height_m} {guess_s}: {moved_m}");
                    // Two ulps: those of the offset and of its change over the step.
                    let clock_s = near.satellite_clock_s - found.satellite_clock_s;
                    assert!(clock_s.abs() <= 2.0 * f64::EPSILON * found.satellite_clock_s.abs(), "{sv}: {clock_s}");
                }
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
    fn an_arc_is_the_orbit_to_the_rounding_of_its_coordinates() {
        let (catalogue, _) = Catalogue::new(rinex::embedded().unwrap().ephemerides);
        let from = Epoch::from_week(1590, 374_760.0);
        let place = Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef();
        let motion = Motion::at_rest(place);
        for sv in catalogue.satellites() {
            let Some(arc) = Arc::through(&catalogue, sv, from, from.plus_s(16.2)).unwrap() else { continue };
            for k in 0..=30 {
                let at = from.plus_s(0.54 * f64::from(k));
                let Some(exact) = emission(&catalogue, sv, at, &motion).unwrap() else { continue };
                let found = arc.emission(&Place::new(at, 0.0, motion)).unwrap().unwrap();
                // Coordinates are rounded to 4e-9 m, three of them, in six nodes whose weights add up to 2.2
                // at most; each evaluation of Kepler's equation rounds an angle of some radians, 4e-16, to
                // 1e-8 m.
                assert!((found.sight.range_m - exact.sight.range_m).abs() < 6e-8, "{sv} {k}");
                assert!((found.satellite_clock_s - exact.satellite_clock_s).abs() < 1e-16, "{sv} {k}");
            }
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
            let sagnac_m = gnss::earth::EARTH_ROTATION_RADPS / SPEED_OF_LIGHT_MPS * (s.x * u.y - s.y * u.x);
            let range_m = (s - u).norm();
            // The first-order formula is good to 0.14 mm (theory: second order (Ωτ)² r / 2).
            assert!((found.sight.range_m - range_m - sagnac_m).abs() < 5e-4, "{sv}");
        }
    }
}
