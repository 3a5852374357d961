//! Multipath: delayed copies of the direct ray, with an amplitude and a phase of their own.
//!
//! A reflected ray's code and carrier are delayed by the same excess δ, so its carrier is −δ/λ cycles against
//! the direct one and fading, at δ̇/λ, is coherent with the code; what the surface adds to the phase stays
//! beside it. Planes reflect plane waves: δ = 2 h sin e above ground of distance h, and 2 d cos e cos(a −
//! a_w) before a wall at distance d, in direction a_w, that the wave passes first. Limits: surfaces are
//! endless, smooth and reflect once; no diffraction, no shadow; `amplitude` is what the antenna makes of the
//! ray, its pattern towards the surface included.

use nalgebra::Vector3;

use crate::ray::{Effect, Ray, Sight};
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Geometry of a reflected ray's detour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Detour {
    /// The excess at the scene's start and its rate.
    Given {
        /// Path beyond the direct one at the scene's start, in metres.
        excess_m: f64,
        /// Growth of that excess a second.
        rate_mps: f64,
    },
    /// Level ground, which keeps its distance to the antenna.
    Ground {
        /// Height of the antenna above the ground, in metres.
        height_m: f64,
    },
    /// A vertical plane in a direction (from north over east) that stays where it is while the antenna moves.
    Wall {
        /// Azimuth of the wall as seen from the antenna, in radians.
        azimuth_rad: f64,
        /// Distance of the wall, in metres.
        distance_m: f64,
    },
}

/// One reflected ray.
#[derive(Clone, Debug, PartialEq)]
pub struct Echo {
    /// Additional path length.
    pub detour: Detour,
    /// Amplitude relative to the direct ray.
    pub amplitude: f64,
    /// Carrier phase that the reflection adds, in cycles; a reversal of the field is half a cycle.
    pub phase_cycles: f64,
    /// Satellites that have the echo; all if the list is empty.
    pub satellites: Vec<Sv>,
}

/// Reflected rays of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Multipath {
    /// The reflections.
    pub echoes: Vec<Echo>,
    /// Start of the scene, from which excess paths and walls are counted.
    pub start: Epoch,
    /// Position of the antenna at the scene's start, ECEF, in metres.
    pub origin_m: Vector3<f64>,
}

impl Multipath {
    /// Distance of the antenna at `user_m` from a wall, in metres; negative behind it.
    pub fn clearance_m(&self, azimuth_rad: f64, distance_m: f64, user_m: &Vector3<f64>) -> f64 {
        distance_m - self.towards(azimuth_rad).dot(&(user_m - self.origin_m))
    }

    /// Additional path length of a detour along `sight`, in metres; `None` where nothing is reflected.
    pub fn excess_m(&self, detour: &Detour, sight: &Sight) -> Option<f64> {
        let wave = (sight.user_m - sight.satellite.position_m) / sight.range_m;
        let excess_m = match *detour {
            Detour::Given { excess_m, rate_mps } => excess_m + rate_mps * sight.received.since(self.start),
            Detour::Ground { height_m } => 2.0 * height_m * libm::sin(sight.look.elevation_rad),
            Detour::Wall { azimuth_rad, distance_m } => {
                2.0 * self.clearance_m(azimuth_rad, distance_m, &sight.user_m) * self.towards(azimuth_rad).dot(&wave)
            }
        };
        (excess_m >= 0.0).then_some(excess_m)
    }

    /// The horizontal direction at the start's position, in ECEF.
    fn towards(&self, azimuth_rad: f64) -> Vector3<f64> {
        let (sin, cos) = libm::sincos(azimuth_rad);
        Geodetic::from_ecef(&self.origin_m).ecef_to_enu().transpose() * Vector3::new(sin, cos, 0.0)
    }
}

impl Effect for Multipath {
    fn name(&self) -> &'static str {
        "multipath"
    }

    fn describe(&self) -> String {
        let text = |echo: &Echo| {
            let from = match echo.detour {
                Detour::Given { excess_m, rate_mps: 0.0 } => format!("{excess_m} m more"),
                Detour::Given { excess_m, rate_mps } => format!("{excess_m} m more, {rate_mps:+} m/s"),
                Detour::Ground { height_m } => format!("ground {height_m} m below"),
                Detour::Wall { azimuth_rad, distance_m } => {
                    format!("wall {distance_m} m off at {:.0} deg", azimuth_rad.to_degrees())
                }
            };
            format!("{from} ({:.1} dB)", 20.0 * libm::log10(echo.amplitude))
        };
        self.echoes.iter().map(text).collect::<Vec<_>>().join(", ")
    }

    /// Adds a ray for each reflection of the direct one, silent where there is none now.
    fn act(&self, sight: &Sight, _signal: &Signal, rays: &mut Vec<Ray>) {
        let Some(direct) = rays.first().copied() else { return };
        for echo in self.echoes.iter().filter(|e| e.satellites.is_empty() || e.satellites.contains(&sight.sv)) {
            let excess_m = self.excess_m(&echo.detour, sight);
            let delay_s = excess_m.unwrap_or(0.0) / SPEED_OF_LIGHT_MPS;
            let amplitude = if excess_m.is_some() { echo.amplitude } else { 0.0 };
            rays.push(Ray {
                code_delay_s: direct.code_delay_s + delay_s,
                carrier_delay_s: direct.carrier_delay_s + delay_s,
                // A carrier counts backwards: it grows with range.
                phase_cycles: direct.phase_cycles - echo.phase_cycles,
                cn0_hz: direct.cn0_hz * amplitude * amplitude,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::broadcast::State;
    use gnss::earth::look;
    use gnss::gps::l1ca::L1_CA;

    /// A satellite at 2e7 m in that direction.
    fn sight(azimuth_deg: f64, elevation_deg: f64, moved_enu_m: Vector3<f64>) -> (Sight, Vector3<f64>) {
        let place = Geodetic::from_degrees(26.5, 80.2, 130.0);
        let axes = place.ecef_to_enu().transpose();
        let origin_m = place.to_ecef();
        let (sin_a, cos_a) = libm::sincos(azimuth_deg.to_radians());
        let (sin_e, cos_e) = libm::sincos(elevation_deg.to_radians());
        let user_m = origin_m + axes * moved_enu_m;
        let position_m = user_m + axes * Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e) * 2e7;
        let user = Geodetic::from_ecef(&user_m);
        let sight = Sight {
            sv: Sv::gps(1),
            received: Epoch::from_week(1590, 374_760.0),
            user,
            user_m,
            user_mps: Vector3::zeros(),
            satellite: State { position_m, velocity_mps: Vector3::zeros() },
            range_m: 2e7,
            look: look(user, &user_m, &position_m),
            off_nadir_rad: 0.1,
        };
        (sight, origin_m)
    }

    fn multipath(detour: Detour, origin_m: Vector3<f64>) -> Multipath {
        let echo = Echo { detour, amplitude: 0.5, phase_cycles: 0.5, satellites: Vec::new() };
        Multipath { echoes: vec![echo], start: Epoch::from_week(1590, 374_760.0), origin_m }
    }

    #[test]
    fn planes_lengthen_the_path_to_the_antenna_s_mirror_image() {
        // The image of the antenna lies twice the plane's distance away; the wave reaches it that much later.
        let image = |enu_m: Vector3<f64>, azimuth_deg: f64, elevation_deg: f64| {
            let (sin_a, cos_a) = libm::sincos(f64::to_radians(azimuth_deg));
            let (sin_e, cos_e) = libm::sincos(f64::to_radians(elevation_deg));
            -enu_m.dot(&Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e))
        };
        for (azimuth, elevation) in [(10.0, 20.0), (100.0, 70.0), (200.0, 5.0), (300.0, 45.0)] {
            let (from, origin_m) = sight(azimuth, elevation, Vector3::zeros());
            let cases = [
                (Detour::Ground { height_m: 1.7 }, Vector3::new(0.0, 0.0, -3.4)),
                (Detour::Wall { azimuth_rad: 0.0, distance_m: 12.0 }, Vector3::new(0.0, 24.0, 0.0)),
                (
                    Detour::Wall { azimuth_rad: 1.5 * std::f64::consts::PI, distance_m: 8.0 },
                    Vector3::new(-16.0, 0.0, 0.0),
                ),
            ];
            for (detour, enu_m) in cases {
                let expected = image(enu_m, azimuth, elevation);
                // The ellipsoid's normal bends by 1e-15 over the position's rounding; sines of degrees within
                // 1e-15.
                match multipath(detour, origin_m).excess_m(&detour, &from) {
                    Some(found) => assert!((found - expected).abs() < 1e-7, "{detour:?} {found} {expected}"),
                    None => assert!(expected < 1e-7, "{detour:?} {expected}"),
                }
            }
        }
    }

    #[test]
    fn a_wall_stays_where_it_is() {
        let wall = Detour::Wall { azimuth_rad: std::f64::consts::FRAC_PI_2, distance_m: 10.0 };
        let (from, origin_m) = sight(270.0, 0.0, Vector3::new(4.0, 100.0, 0.0));
        let found = multipath(wall, origin_m).excess_m(&wall, &from).unwrap();
        // 6 m are left; 100 m to the north turn east by 8e-6 rad.
        assert!((found - 12.0).abs() < 2e-3, "{found}");
    }

    #[test]
    fn code_and_carrier_of_an_echo_are_delayed_alike_and_a_silent_one_stays_in_its_place() {
        let (from, origin_m) = sight(10.0, 30.0, Vector3::zeros());
        let direct = Ray { code_delay_s: 3e-8, carrier_delay_s: -1e-8, phase_cycles: 0.25, cn0_hz: 1e4 };
        let mut rays = vec![direct];
        multipath(Detour::Ground { height_m: 2.0 }, origin_m).act(&from, &L1_CA, &mut rays);
        let excess_s = 2.0 / SPEED_OF_LIGHT_MPS;
        assert_eq!((rays.len(), rays[0], rays[1].cn0_hz, rays[1].phase_cycles), (2, direct, 2.5e3, -0.25));
        for delay_s in [rays[1].code_delay_s - 3e-8, rays[1].carrier_delay_s + 1e-8] {
            assert!((delay_s - excess_s).abs() < 1e-16, "{delay_s}");
        }
        let mut rays = vec![direct];
        multipath(Detour::Wall { azimuth_rad: 0.2, distance_m: 5.0 }, origin_m).act(&from, &L1_CA, &mut rays);
        assert_eq!((rays.len(), rays[1].cn0_hz), (2, 0.0));
    }
}
