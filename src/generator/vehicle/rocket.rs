//! A rocket or projectile: rests on its pad, burns, and coasts under gravity and drag.
//!
//! Equations of motion in ECEF with centrifugal and Coriolis acceleration, integrated by the classical
//! Runge-Kutta method of order four. Gravity: WGS 84 ([`gnss::gravity`]) central, and J2 on request.
//! Drag: Cd·A/m with an exponential atmosphere that rotates with the Earth. Limits: thrust keeps its
//! direction (no guidance, no gravity turn), no wind, no lift. The pad hands the weight over in proportion to
//! the first ramp of the thrust, so that acceleration is continuous at lift-off.

use nalgebra::Vector3;
use thiserror::Error;

use super::ramp::Ramp;
use super::{Knot, Motion, Trajectory};
use gnss::earth::{EARTH_ROTATION_RADPS, Geodetic};
use gnss::gravity::{central_mps2, oblateness_mps2};

/// Density at sea level (U.S. Standard Atmosphere 1976) and the scale height that fits it within a fifth to
/// 30 km.
const SEA_LEVEL_DENSITY_KGPM3: f64 = 1.225;
const SCALE_HEIGHT_M: f64 = 7_400.0;
/// Longest step of the integration; error of a 100 s coast is below 1 µm.
const STEP_S: f64 = 0.02;

/// Longest flight that is integrated: 540 000 knots, 45 MB.
const LONGEST_FLIGHT_S: f64 = 10_800.0;

/// Construction and launch of the rocket.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rocket {
    /// Position of the launch pad.
    pub pad: Geodetic,
    /// Direction of the thrust at the pad, kept in ECEF.
    pub azimuth_rad: f64,
    /// Elevation of the launch, in radians.
    pub elevation_rad: f64,
    /// Ignition time, in true seconds since the scene's start.
    pub ignition_s: f64,
    /// Thrust over mass while it holds, in m/s².
    pub thrust_mps2: f64,
    /// Duration in seconds from ignition to the end of the thrust, both ramps included.
    pub burn_s: f64,
    /// Slope of the thrust's ramps, in m/s³.
    pub jerk_mps3: f64,
    /// Cd·A/m; 0 flies in vacuum.
    pub drag_m2pkg: f64,
    /// True if gravity includes the Earth's oblateness.
    pub oblate: bool,
}

/// Reason for which a rocket does not fly.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RocketError {
    /// Ramps of the thrust that take longer than the burn.
    #[error(
        "thrust_mps2 = {thrust_mps2} and jerk_mps3 = {jerk_mps3} need burn_s of at least {ramps_s:.3} s for both \
         ramps, not {burn_s}"
    )]
    Burn {
        /// Largest acceleration by the thrust, in m/s².
        thrust_mps2: f64,
        /// Jerk by which the acceleration grows, in m/s³.
        jerk_mps3: f64,
        /// Time that both ramps take, in seconds.
        ramps_s: f64,
        /// Length of the burn, in seconds.
        burn_s: f64,
    },
    /// A thrust that does not lift the rocket.
    #[error("thrust_mps2 = {thrust_mps2} at this elevation does not lift off: net {net_mps2:.2} m/s2 upwards")]
    Weak {
        /// Largest acceleration by the thrust, in m/s².
        thrust_mps2: f64,
        /// Thrust acceleration minus gravity, in m/s².
        net_mps2: f64,
    },
}

/// Position and velocity, or their rates.
type Pair = (Vector3<f64>, Vector3<f64>);

impl Rocket {
    /// The flight up to `until_s`, to the instant before the ground is reached again, or for three hours.
    pub fn trajectory(&self, until_s: f64) -> Result<Trajectory, RocketError> {
        let thrust = self.thrust()?;
        let pad_m = self.pad.to_ecef();
        let mut knots = vec![Knot { t_s: 0.0_f64.min(self.ignition_s - 1.0), motion: Motion::at_rest(pad_m) }];
        let corners: Vec<f64> = thrust.corners_s().iter().map(|t_s| self.ignition_s + t_s).collect();
        let mut state: Pair = (pad_m, Vector3::zeros());
        let (mut t_s, mut landed) = (self.ignition_s, false);
        knots.push(Knot { t_s, motion: Motion::at_rest(pad_m) });
        for end_s in corners.iter().skip(1).copied().chain([until_s.min(self.ignition_s + LONGEST_FLIGHT_S)]) {
            let (start_s, steps) = (t_s, ((end_s - t_s) / STEP_S).ceil().max(0.0));
            let mut k = 0.0;
            while k < steps && !landed {
                k += 1.0;
                let next_s = if k == steps { end_s } else { start_s + (end_s - start_s) * (k / steps) };
                state = self.step(&thrust, t_s, state, next_s - t_s);
                t_s = next_s;
                landed = Geodetic::from_ecef(&state.0).height_m < self.pad.height_m;
                if !landed {
                    let acceleration_mps2 = self.acceleration(&thrust, t_s, state);
                    let motion = Motion { position_m: state.0, velocity_mps: state.1, acceleration_mps2 };
                    knots.push(Knot { t_s, motion });
                }
            }
        }
        let weak = RocketError::Weak { thrust_mps2: self.thrust_mps2, net_mps2: f64::NAN };
        Trajectory::through(knots, corners).ok_or(weak)
    }

    /// The thrust's history as the rate of a change: it rises, holds and falls linearly.
    fn thrust(&self) -> Result<Ramp, RocketError> {
        let ramp_s = self.thrust_mps2 / self.jerk_mps3;
        let hold_s = self.burn_s - 2.0 * ramp_s;
        if hold_s < 0.0 {
            return Err(RocketError::Burn {
                thrust_mps2: self.thrust_mps2,
                jerk_mps3: self.jerk_mps3,
                ramps_s: 2.0 * ramp_s,
                burn_s: self.burn_s,
            });
        }
        let pad_m = self.pad.to_ecef();
        let up = self.pad.ecef_to_enu().transpose() * Vector3::z();
        let net_mps2 = (self.direction() * self.thrust_mps2 + self.field(&(pad_m, Vector3::zeros()))).dot(&up);
        if net_mps2 <= 0.0 {
            return Err(RocketError::Weak { thrust_mps2: self.thrust_mps2, net_mps2 });
        }
        Ok(Ramp { rate: self.thrust_mps2, ramp_s, hold_s })
    }

    fn direction(&self) -> Vector3<f64> {
        let (sin_az, cos_az) = libm::sincos(self.azimuth_rad);
        let (sin_el, cos_el) = libm::sincos(self.elevation_rad);
        self.pad.ecef_to_enu().transpose() * Vector3::new(sin_az * cos_el, cos_az * cos_el, sin_el)
    }

    /// Gravity, the rotating frame and drag.
    fn field(&self, (r, v): &Pair) -> Vector3<f64> {
        let mut acceleration = central_mps2(r);
        if self.oblate {
            acceleration += oblateness_mps2(r);
        }
        let w = EARTH_ROTATION_RADPS;
        acceleration += Vector3::new(w * w * r.x + 2.0 * w * v.y, w * w * r.y - 2.0 * w * v.x, 0.0);
        if self.drag_m2pkg > 0.0 {
            let height_m = Geodetic::from_ecef(r).height_m;
            let density_kgpm3 = SEA_LEVEL_DENSITY_KGPM3 * libm::exp(-height_m / SCALE_HEIGHT_M);
            acceleration -= v * (0.5 * density_kgpm3 * self.drag_m2pkg * v.norm());
        }
        acceleration
    }

    fn acceleration(&self, thrust: &Ramp, t_s: f64, state: Pair) -> Vector3<f64> {
        let burning_s = t_s - self.ignition_s;
        let released = if burning_s < thrust.ramp_s { burning_s / thrust.ramp_s } else { 1.0 };
        self.direction() * thrust.at(burning_s).1 + self.field(&state) * released
    }

    /// One step of the classical Runge-Kutta method.
    fn step(&self, thrust: &Ramp, t_s: f64, state: Pair, h: f64) -> Pair {
        let rates = |t_s: f64, state: Pair| (state.1, self.acceleration(thrust, t_s, state));
        let moved = |k: Pair, dt: f64| (state.0 + k.0 * dt, state.1 + k.1 * dt);
        let k1 = rates(t_s, state);
        let k2 = rates(t_s + 0.5 * h, moved(k1, 0.5 * h));
        let k3 = rates(t_s + 0.5 * h, moved(k2, 0.5 * h));
        let k4 = rates(t_s + h, moved(k3, h));
        let mean = |a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>, d: Vector3<f64>| (a + (b + c) * 2.0 + d) / 6.0;
        (state.0 + mean(k1.0, k2.0, k3.0, k4.0) * h, state.1 + mean(k1.1, k2.1, k3.1, k4.1) * h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::earth::rotate_earth;
    use gnss::gravity::MU_M3PS2;

    const G_MPS2: f64 = 9.806_65;

    fn rocket() -> Rocket {
        Rocket {
            pad: Geodetic::from_degrees(26.5, 80.2, 130.0),
            azimuth_rad: 1.0,
            elevation_rad: 80_f64.to_radians(),
            ignition_s: 40.0,
            thrust_mps2: 23.0 * G_MPS2,
            burn_s: 6.0,
            jerk_mps3: 20.0 * G_MPS2,
            drag_m2pkg: 4e-5,
            oblate: true,
        }
    }

    #[test]
    fn the_boost_passes_twenty_g_with_bounded_jerk_and_starts_from_rest() {
        let flight = rocket().trajectory(110.0).unwrap();
        assert_eq!(flight.at(39.999).velocity_mps.norm(), 0.0);
        let peak = flight.max_acceleration_mps2() / G_MPS2;
        assert!(peak > 20.0 && peak < 23.0, "{peak}");
        let h = 1e-3;
        let mut largest = 0.0_f64;
        for k in 39_500..110_000 {
            let (a, b) = (flight.at(f64::from(k) * h), flight.at(f64::from(k + 1) * h));
            largest = largest.max((b.acceleration_mps2 - a.acceleration_mps2).norm() / h);
        }
        // The ramps have 20 g/s; the released weight takes 1 g off over 1.15 s, and burn-out adds the drag's
        // decay: 2 v v̇ of half ρ CdA/m v² is below 4e-5·0.6·1200·230 / 9.8 = 0.7 g/s.
        assert!(largest > 18.0 * G_MPS2 && largest < 21.5 * G_MPS2, "{}", largest / G_MPS2);
    }

    #[test]
    fn knots_satisfy_the_equation_of_motion_between_them() {
        let rocket = rocket();
        let (flight, thrust) = (rocket.trajectory(110.0).unwrap(), rocket.thrust().unwrap());
        for k in 0..7_000 {
            let t_s = 40.003 + f64::from(k) * 0.01;
            let m = flight.at(t_s);
            let want = rocket.acceleration(&thrust, t_s, (m.position_m, m.velocity_mps));
            // Hermite's second derivative over 0.02 s: knots rounded to 5e-10 m in h² give 5.8·1e-9/4e-4 =
            // 1.5e-5.
            assert!((m.acceleration_mps2 - want).norm() < 5e-5, "{t_s}");
        }
    }

    #[test]
    fn a_coast_in_vacuum_is_kepler_s_ellipse() {
        let rocket = Rocket { drag_m2pkg: 0.0, oblate: false, ..rocket() };
        let flight = rocket.trajectory(140.0).unwrap();
        let inertial = |m: &Motion, since_s: f64| {
            let w = Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS);
            let v = m.velocity_mps + w.cross(&m.position_m);
            (rotate_earth(&m.position_m, -since_s), rotate_earth(&v, -since_s))
        };
        let (r0, v0) = inertial(&flight.at(50.0), 0.0);
        let (r1, v1) = inertial(&flight.at(140.0), 90.0);
        // Lagrange's f and g from the eccentric anomaly (Battin, 1999, 3.6): closed form but for Kepler's
        // equation.
        let a = 1.0 / (2.0 / r0.norm() - v0.norm_squared() / MU_M3PS2);
        let n = (MU_M3PS2 / (a * a * a)).sqrt();
        let (ec, es) = (1.0 - r0.norm() / a, r0.dot(&v0) / (MU_M3PS2 * a).sqrt());
        let mut x = n * 90.0;
        for _ in 0..50 {
            let (s, c) = libm::sincos(x);
            x -= (x - ec * s + es * (1.0 - c) - n * 90.0) / (1.0 - ec * c + es * s);
        }
        let (s, c) = libm::sincos(x);
        let f = 1.0 - a / r0.norm() * (1.0 - c);
        let g = 90.0 - (x - s) / n;
        let want = r0 * f + v0 * g;
        // The orbit nearly falls through the centre (e ≈ 0.99): cancellation in f and g loses about three
        // digits of 6.4e6 m · 1e-16; Runge-Kutta itself is below 1e-6 m.
        assert!((r1 - want).norm() < 1e-4, "{}", (r1 - want).norm());
        let energy = |r: Vector3<f64>, v: Vector3<f64>| 0.5 * v.norm_squared() - MU_M3PS2 / r.norm();
        // 4500 steps, each rounding velocity by 1e-13 and position by 1e-9 (times g).
        assert!((energy(r1, v1) - energy(r0, v0)).abs() < 1e-4);
    }

    #[test]
    fn gravity_at_rest_is_normal_gravity() {
        // WGS 84 normal gravity (NGA.STND.0036, table 3.6): 9.780 325 335 9 at the equator, 9.832 184 937 9
        // at the pole; the normal field's J4 = -2.37e-6, left out here, weighs 5 g J4 = 1.16e-4 at the pole,
        // less at the equator.
        for (latitude, want) in [(0.0, 9.780_325), (90.0, 9.832_185)] {
            let pad = Geodetic::from_degrees(latitude, 10.0, 0.0);
            let got = Rocket { pad, ..rocket() }.field(&(pad.to_ecef(), Vector3::zeros())).norm();
            assert!((got - want).abs() < 1.3e-4, "{latitude} {got}");
        }
    }

    #[test]
    fn the_flight_ends_above_the_ground_and_impossible_rockets_are_refused() {
        let stone = Rocket { thrust_mps2: 30.0, burn_s: 3.0, jerk_mps3: 30.0, ..rocket() };
        let flight = stone.trajectory(500.0).unwrap();
        let end_s = flight.span_s().1;
        let last_m = Geodetic::from_ecef(&flight.at(end_s).position_m).height_m;
        // At most one step of 0.02 s above the pad, at the speed of impact.
        assert!(end_s < 100.0 && (130.0..132.0).contains(&last_m), "{end_s} {last_m}");
        assert!(matches!(Rocket { burn_s: 2.0, ..rocket() }.trajectory(60.0), Err(RocketError::Burn { .. })));
        let weak = Rocket { thrust_mps2: 9.0, ..rocket() };
        assert!(matches!(weak.trajectory(60.0), Err(RocketError::Weak { .. })));
    }
}
