//! State vector of an orbit: position, velocity and the acceleration by Moon and Sun at a reference time. The
//! user integrates the equations of motion from it.
//!
//! Source: GLONASS ICD L1, L2 5.1, A.3.1.2 (simplified algorithm, fourth-order Runge-Kutta) with constants of
//! PZ-90.11, which agrees with WGS 84 and ITRF to centimetres: they are taken for the same. Steps of
//! [`STEP_S`] leave 0.1 mm in a quarter of an hour; where one ends the next begins, so that the
//! state is as smooth as the motion. Limits: the pull is held fast in earth-fixed axes, good for 15 min to
//! either side; a day away is refused. Those of augmentation systems are polynomials.

use nalgebra::Vector3;

use super::{OrbitError, State};
use crate::satellite::{Sv, System};

/// Gravitational constant, second zonal harmonic, equatorial radius and rotation of the Earth in PZ-90.11
/// (GLONASS ICD L1, L2 5.1, table A.1).
const MU_M3PS2: f64 = 3.986_004_418e14;
const J2: f64 = 1_082.625_75e-6;
const RADIUS_M: f64 = 6_378_136.0;
const ROTATION_RADPS: f64 = 7.292_115_146_7e-5;
/// Step of the integration.
const STEP_S: f64 = 30.0;
/// Furthest time from the reference time, in seconds.
const FARTHEST_S: f64 = 86_400.0;
/// Least and largest distance from the Earth's centre of a satellite's state, with room.
const DISTANCES_M: std::ops::RangeInclusive<f64> = 6.4e6..=1e8;

/// Earth-fixed state at the reference time, with the acceleration by Moon and Sun.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StateVector {
    /// Position, in metres.
    pub position_m: Vector3<f64>,
    /// Velocity in the rotating axes, in m/s.
    pub velocity_mps: Vector3<f64>,
    /// Acceleration by Moon and Sun in m/s². For augmentation systems it is the total acceleration in the
    /// rotating axes.
    pub acceleration_mps2: Vector3<f64>,
}

/// Position and velocity, or their rates.
type Phase = (Vector3<f64>, Vector3<f64>);

impl StateVector {
    /// State `since_s` seconds after the reference time, in the axes of that instant.
    ///
    /// # Errors
    /// [`OrbitError`] for what is no satellite's state, or a time that is too far away.
    pub fn state(&self, sv: Sv, since_s: f64) -> Result<State, OrbitError> {
        self.check(sv)?;
        if sv.system == System::Sbas {
            return Ok(self.straight(since_s));
        }
        if !(-FARTHEST_S..=FARTHEST_S).contains(&since_s) {
            return Err(OrbitError::Far { sv, since_s });
        }
        let whole = (since_s / STEP_S).trunc();
        let mut phase = (self.position_m, self.velocity_mps);
        for _ in 0..whole.abs() as u32 {
            phase = self.step(phase, STEP_S.copysign(since_s));
        }
        let (position_m, velocity_mps) = self.step(phase, since_s - whole * STEP_S);
        Ok(State { position_m, velocity_mps })
    }

    /// State of a geostationary satellite `since_s` seconds after the reference time. Its acceleration is
    /// given in the rotating axes (RTCA DO-229D, A.4.4.11).
    fn straight(&self, since_s: f64) -> State {
        let half_s = planted!("gnss.sbas.acceleration", 0.5 * since_s, since_s);
        State {
            position_m: self.position_m + (self.velocity_mps + self.acceleration_mps2 * half_s) * since_s,
            velocity_mps: self.velocity_mps + self.acceleration_mps2 * since_s,
        }
    }

    /// One step of the Runge-Kutta method of fourth order.
    fn step(&self, (position_m, velocity_mps): Phase, step_s: f64) -> Phase {
        let ahead = |rate: Phase, share: f64| {
            self.rates((position_m + rate.0 * (share * step_s), velocity_mps + rate.1 * (share * step_s)))
        };
        let first = self.rates((position_m, velocity_mps));
        let second = ahead(first, 0.5);
        let third = ahead(second, 0.5);
        let fourth = ahead(third, 1.0);
        let sixth = step_s / 6.0;
        let mean = |[a, b, c, d]: [Vector3<f64>; 4]| (a + (b + c) * 2.0 + d) * sixth;
        (
            position_m + mean([first.0, second.0, third.0, fourth.0]),
            velocity_mps + mean([first.1, second.1, third.1, fourth.1]),
        )
    }

    /// Velocity, and acceleration in axes that turn with the Earth.
    fn rates(&self, (position_m, velocity_mps): Phase) -> Phase {
        let square = position_m.norm_squared();
        let pull = MU_M3PS2 / (square * square.sqrt());
        let rotation_radps = planted!("gnss.glonass.rotation", ROTATION_RADPS, -ROTATION_RADPS);
        let flattening = 1.5 * planted!("gnss.glonass.zonal", J2, 0.0) * RADIUS_M * RADIUS_M / square;
        let height = 5.0 * position_m.z * position_m.z / square;
        let centrifugal = rotation_radps * rotation_radps;
        let level = -pull * (1.0 + flattening * (1.0 - height)) + centrifugal;
        let axial = -pull * (1.0 + flattening * (3.0 - height));
        let of_moon_and_sun = planted!("gnss.glonass.pull", self.acceleration_mps2, -self.acceleration_mps2);
        let acceleration = Vector3::new(
            level * position_m.x + 2.0 * rotation_radps * velocity_mps.y,
            level * position_m.y - 2.0 * rotation_radps * velocity_mps.x,
            axial * position_m.z,
        );
        (velocity_mps, acceleration + of_moon_and_sun)
    }

    fn check(&self, sv: Sv) -> Result<(), OrbitError> {
        let error = |element, value, expected| Err(OrbitError::Element { sv, element, value, expected });
        let distance_m = self.position_m.norm();
        if !DISTANCES_M.contains(&distance_m) {
            return error("distance", distance_m, "6.4e6 to 1e8 m");
        }
        let speed_mps = self.velocity_mps.norm();
        if !(0.0..=2e4).contains(&speed_mps) {
            return error("speed", speed_mps, "at most 2e4 m/s");
        }
        let pull_mps2 = self.acceleration_mps2.norm();
        if sv.system == System::Sbas {
            // As much as type 9 has bits for.
            return if pull_mps2 <= 0.034 { Ok(()) } else { error("acceleration", pull_mps2, "at most 0.034 m/s2") };
        }
        if !(0.0..=1e-3).contains(&pull_mps2) {
            return error("acceleration by Moon and Sun", pull_mps2, "at most 1e-3 m/s2");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SV: Sv = Sv { system: System::Glonass, number: 5 };

    fn example() -> StateVector {
        StateVector {
            position_m: Vector3::new(10_060_607.421_88, 20_896_772.460_94, 10_592_854.003_91),
            velocity_mps: Vector3::new(488.517_761_230_5, 1_375.846_862_793, -3_180.986_404_419),
            acceleration_mps2: Vector3::new(0.0, -1.862_645_149_231e-6, -9.313_225_746_155e-7),
        }
    }

    #[test]
    fn the_state_is_smooth_where_steps_end_and_velocity_is_its_rate() {
        let at = |s: f64| example().state(SV, s).unwrap();
        assert_eq!(at(0.0).position_m, example().position_m);
        for s in [-900.0, -30.0, 30.0, 300.0, 900.0] {
            // 4 km/s for a microsecond, and what rounding leaves of 2e7 m.
            assert!((at(s + 5e-7).position_m - at(s - 5e-7).position_m).norm() < 4.1e-3, "{s}");
            let (h, p) = (5.0, |dt: f64| at(s + dt).position_m);
            let numeric = (p(-2.0 * h) - p(2.0 * h) + (p(h) - p(-h)) * 8.0) / (12.0 * h);
            // Rounding of 4e-9 m over 5 s, truncation h⁴/30 of the fifth derivative, 1.5e-4⁵ · 2.5e7 m.
            assert!((numeric - at(s).velocity_mps).norm() < 1e-7, "{s} {}", (numeric - at(s).velocity_mps).norm());
        }
    }

    #[test]
    fn a_tenth_of_the_step_changes_less_than_a_tenth_of_a_millimetre_and_back_is_where_it_began() {
        for end_s in [-900.0, 900.0] {
            let coarse = example().state(SV, end_s).unwrap();
            let mut fine = (example().position_m, example().velocity_mps);
            for _ in 0..300 {
                fine = example().step(fine, end_s / 300.0);
            }
            assert!((coarse.position_m - fine.0).norm() < 1e-4, "{}", (coarse.position_m - fine.0).norm());
            let there = StateVector { position_m: coarse.position_m, velocity_mps: coarse.velocity_mps, ..example() };
            let back = there.state(SV, -end_s).unwrap();
            assert!((back.position_m - example().position_m).norm() < 1e-4);
        }
    }

    #[test]
    fn what_is_no_state_is_refused_by_name() {
        let refused = |vector: StateVector, s: f64| vector.state(SV, s).unwrap_err().to_string();
        assert!(refused(StateVector::default(), 0.0).contains("distance = 0"));
        assert!(
            refused(example(), 90_000.0).contains("at most 86400 s") && refused(example(), f64::NAN).contains("NaN")
        );
        let fast = StateVector { velocity_mps: Vector3::new(f64::NAN, 0.0, 0.0), ..example() };
        assert!(refused(fast, 0.0).contains("speed"));
        let pulled = StateVector { acceleration_mps2: Vector3::new(1.0, 0.0, 0.0), ..example() };
        assert!(refused(pulled, 0.0).contains("Moon and Sun"));
    }
}
