//! Walls and roofs of a city around the antenna: what they block, what they reflect.
//!
//! The direct ray loses what the surfaces take ([`trace`]); each way by one or two mirrors that comes about
//! while the antenna moves is a ray of its own. Ways are sought once, when the scene is composed
//! ([`search`]), at positions half a metre apart and at least every five seconds. So the list of rays is the
//! same at all times, and a way that is not there now is a silent ray; each ray's delay and phase are
//! continuous, and its amplitude rises and falls with Fresnel's zones. Far from its life a way is not
//! followed, and its ray is silent beside the direct one. Limits: those of [`trace`], [`material`] and
//! [`search`]; the ground reflects nothing, `[[multipath]]` has it; the antenna is level, with the gain for
//! an echo that it has for the satellite, which is exact for vertical walls and a pattern without azimuth.

pub mod facet;
pub mod material;
pub mod search;
pub mod trace;
pub mod tree;

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use crate::ray::{Effect, Ray, Sight};
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::place::counted;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;
use material::Material;
use trace::{Carrier, Mirrors, Walls};

/// Time in seconds beyond a way's life over which its geometry is followed: longer than any polynomial.
const BESIDE_S: f64 = 20.0;
/// Distance of a satellite of which the direction alone is known, in metres.
const FAR_M: f64 = 2e7;

/// A way by mirrors that comes about in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    /// Surfaces that reflect.
    pub mirrors: Mirrors,
    /// First and last time at which it was found, in seconds since the scene's start.
    pub life_s: [f64; 2],
    /// Phase in cycles from which the phase of its field is counted, so that it does not wrap.
    pub phase_cycles: f64,
}

/// City of a scene.
#[derive(Clone, Debug)]
pub struct City {
    /// Walls and roofs, in metres east, north and up of the origin.
    pub walls: Walls,
    /// Material of all of them.
    pub material: Material,
    /// Amplitude with which the antenna receives left-hand waves, of right-hand ones.
    pub cross: f64,
    /// Axes of the walls.
    pub axes: Axes,
    /// Start of the scene, from which lives count.
    pub start: Epoch,
    /// Ways of each satellite.
    pub ways: BTreeMap<Sv, Vec<Way>>,
}

/// East, north and up at a position.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    origin_m: Vector3<f64>,
    ecef_to_enu: Matrix3<f64>,
}

impl Axes {
    /// Axes at a position in ECEF, metres.
    pub fn at(origin_m: Vector3<f64>) -> Self {
        Self { origin_m, ecef_to_enu: Geodetic::from_ecef(&origin_m).ecef_to_enu() }
    }

    /// A position in ECEF as metres east, north and up.
    pub fn local_m(&self, position_m: &Vector3<f64>) -> Vector3<f64> {
        self.ecef_to_enu * (position_m - self.origin_m)
    }

    /// Position in ECEF of a point given in metres east, north and up.
    pub fn ecef_m(&self, local_m: &Vector3<f64>) -> Vector3<f64> {
        self.origin_m + self.ecef_to_enu.transpose() * local_m
    }

    /// Antenna and satellite of a sight. A satellite without a range is far away in the direction of the
    /// sight.
    fn ends_m(&self, sight: &Sight) -> [Vector3<f64>; 2] {
        let antenna_m = self.local_m(&sight.user_m);
        if sight.range_m > 1.0 {
            return [antenna_m, self.local_m(&sight.satellite.position_m)];
        }
        let (sin_azimuth, cos_azimuth) = libm::sincos(sight.look.azimuth_rad);
        let (sin, cos) = libm::sincos(sight.look.elevation_rad);
        let towards = Vector3::new(sin_azimuth * cos, cos_azimuth * cos, sin);
        let own = sight.user.ecef_to_enu();
        [antenna_m, antenna_m + self.ecef_to_enu * (own.transpose() * towards) * FAR_M]
    }
}

/// Phase of a field in cycles, within half a cycle of `near`.
fn phase_cycles(field: Complex64, near: f64) -> f64 {
    let cycles = libm::atan2(field.im, field.re) / TAU;
    cycles + (near - cycles).round()
}

impl Effect for City {
    fn name(&self) -> &'static str {
        "city"
    }

    fn describe(&self) -> String {
        let ways: usize = self.ways.values().map(Vec::len).sum();
        format!(
            "{} of {}: the direct ray is obstructed, {} of {}",
            counted(self.walls.facets().len(), "surface"),
            self.material.name(),
            counted(ways, "echo path"),
            counted(self.ways.len(), "satellite")
        )
    }

    /// Adds a ray for each way of the satellite, and weakens the direct ray.
    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let Some(direct) = rays.first().copied() else { return };
        let carrier = Carrier::new(signal.carrier_hz(sight.sv), &self.material, self.cross);
        let [antenna_m, satellite_m] = self.axes.ends_m(sight);
        let t_s = sight.received.since(self.start);
        for way in self.ways.get(&sight.sv).into_iter().flatten() {
            let mut ray = Ray { cn0_hz: 0.0, ..direct };
            let [from_s, to_s] = way.life_s;
            if (from_s - BESIDE_S..=to_s + BESIDE_S).contains(&t_s) {
                let excess_m = self.walls.excess_m(way.mirrors, &antenna_m, &satellite_m).unwrap_or(0.0);
                ray.code_delay_s += excess_m / SPEED_OF_LIGHT_MPS;
                ray.carrier_delay_s += excess_m / SPEED_OF_LIGHT_MPS;
                let echo = self.walls.echo(way.mirrors, &antenna_m, &satellite_m, &carrier, &mut |_| ());
                // A carrier counts backwards: it grows with range.
                ray.phase_cycles -= echo.map_or(way.phase_cycles, |echo| phase_cycles(echo.field, way.phase_cycles));
                ray.cn0_hz = direct.cn0_hz * echo.map_or(0.0, |echo| echo.amplitude * echo.amplitude);
            }
            rays.push(ray);
        }
        if let Some(direct) = rays.first_mut() {
            let share = self.walls.direct(&antenna_m, &satellite_m, &carrier);
            direct.cn0_hz *= share * share;
        }
    }
}
