//! Obstructions of the sky: a horizon by azimuth, a sector up to a roof, or buildings at given positions.
//!
//! Horizon and sector take their loss from power within an edge of given width. A building is four walls;
//! each is a screen whose nearest edge diffracts (ITU-R P.526-15, 4.1, equation 31), so that the edge of its
//! shadow is as wide as Fresnel's zone, deep shadow is never quite dark, and what goes through the building
//! adds a given share of power. Only the first ray, the direct one, is obstructed: reflections come by other
//! ways. Limits: one edge at a time; a building has no roof to an antenna inside it; walls reach down without
//! end.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};

use crate::effect::ionosphere::smooth;
use crate::ray::{Effect, Ray, Sight};
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::signal::Signal;

/// An obstruction.
#[derive(Clone, Debug, PartialEq)]
pub enum Obstacle {
    /// Everything below a line given by azimuth (ascending, in [0, 2π)) and elevation, straight between its
    /// points.
    Horizon {
        /// Azimuths in [0, 2π), ascending, and elevations.
        points_rad: Vec<(f64, f64)>,
        /// Elevation over which the loss goes from nothing to all, in radians.
        edge_rad: f64,
        /// Share of the power that is left behind it.
        share: f64,
    },
    /// Everything below `roof_rad` from azimuth `from_rad` clockwise to `to_rad`.
    Sector {
        /// Azimuth at which the sector begins, in radians.
        from_rad: f64,
        /// Azimuth at which the sector ends, clockwise, in radians.
        to_rad: f64,
        /// Elevation of the upper edge, in radians.
        roof_rad: f64,
        /// Elevation over which the loss goes from nothing to all, in radians.
        edge_rad: f64,
        /// Share of the power that is left behind it.
        share: f64,
    },
    /// A block that diffracts over its edges.
    Building(Building),
}

/// Box on the ground, in metres east, north and up of the scene's first position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Building {
    /// West and east end in metres east of the scene's first position.
    pub east_m: [f64; 2],
    /// South and north end in metres north of the scene's first position.
    pub north_m: [f64; 2],
    /// Height of the roof above the scene's first position, in metres.
    pub top_m: f64,
    /// Share of the power that penetrates the building, 0 to 1.
    pub share: f64,
}

/// Obstructions of the direct ray.
#[derive(Clone, Debug, PartialEq)]
pub struct Obstruction {
    /// The obstructions.
    pub obstacles: Vec<Obstacle>,
    /// ECEF position that buildings are measured from, and the matrix to its east, north and up.
    origin_m: Vector3<f64>,
    ecef_to_enu: Matrix3<f64>,
}

impl Obstruction {
    /// Obstacles around a position; `origin_m` is ECEF.
    pub fn new(obstacles: Vec<Obstacle>, origin_m: Vector3<f64>) -> Self {
        let ecef_to_enu = Geodetic::from_ecef(&origin_m).ecef_to_enu();
        Self { obstacles, origin_m, ecef_to_enu }
    }

    /// Share of the power that remains of a ray that arrives at `user_m` (ECEF) from `look`.
    pub fn left(&self, user_m: &Vector3<f64>, look: Look, carrier_hz: f64) -> f64 {
        let here_m = self.ecef_to_enu * (user_m - self.origin_m);
        self.obstacles.iter().map(|obstacle| obstacle.left(&here_m, look, carrier_hz)).product()
    }
}

impl Obstacle {
    fn left(&self, here_m: &Vector3<f64>, look: Look, carrier_hz: f64) -> f64 {
        match self {
            Self::Horizon { points_rad, edge_rad, share } => {
                let depth_rad = horizon(points_rad, look.azimuth_rad) - look.elevation_rad;
                mixed(*share, 1.0 - covered(depth_rad, *edge_rad))
            }
            Self::Sector { from_rad, to_rad, roof_rad, edge_rad, share } => {
                let half_rad = 0.5 * (to_rad - from_rad).rem_euclid(TAU);
                let off_rad = (look.azimuth_rad - from_rad - half_rad + PI).rem_euclid(TAU) - PI;
                // Azimuths crowd towards the zenith.
                let inside_rad = (half_rad - off_rad.abs()) * libm::cos(look.elevation_rad);
                let below = covered(roof_rad - look.elevation_rad, *edge_rad);
                mixed(*share, 1.0 - below * covered(inside_rad, *edge_rad))
            }
            Self::Building(building) => {
                mixed(building.share, libm::pow(10.0, -building.loss_db(here_m, look, carrier_hz) / 10.0))
            }
        }
    }
}

/// Power with `share` of it going through and `around` of the rest passing by; exactly 1 for a share of 1.
fn mixed(share: f64, around: f64) -> f64 {
    share + (1.0 - share) * around
}

/// Degree of coverage by the depth into the shadow: 0 clear of an edge, 1 well behind it.
fn covered(depth_rad: f64, edge_rad: f64) -> f64 {
    smooth(depth_rad / edge_rad + 0.5)
}

/// Elevation of the line at an azimuth.
fn horizon(points_rad: &[(f64, f64)], azimuth_rad: f64) -> f64 {
    let right = points_rad.partition_point(|(azimuth, _)| *azimuth <= azimuth_rad);
    let around = |index: usize| points_rad.get(index % points_rad.len().max(1)).copied();
    match (around(right + points_rad.len() - 1), around(right)) {
        (Some((a, low)), Some((b, high))) if a != b => {
            let (along, span) = ((azimuth_rad - a).rem_euclid(TAU), (b - a).rem_euclid(TAU));
            low + (high - low) * along / span
        }
        (Some((_, only)), _) => only,
        (None, _) => -PI,
    }
}

impl Building {
    /// Diffraction loss in dB of the wall that obstructs most, for an antenna at `here_m` (east, north, up,
    /// in metres).
    pub fn loss_db(&self, here_m: &Vector3<f64>, look: Look, carrier_hz: f64) -> f64 {
        let ([west, east], [south, north]) = (self.east_m, self.north_m);
        let walls = [
            ([west, south], [east, south]),
            ([east, south], [east, north]),
            ([east, north], [west, north]),
            ([west, north], [west, south]),
        ];
        let wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz;
        walls.into_iter().map(|(a, b)| screen_db(a, b, self.top_m, here_m, look, wavelength_m)).fold(0.0, f64::max)
    }
}

/// Loss in dB behind a vertical screen from `a` to `b` (east, north) up to `top_m`.
fn screen_db(a: [f64; 2], b: [f64; 2], top_m: f64, here_m: &Vector3<f64>, look: Look, wavelength_m: f64) -> f64 {
    let (sin_azimuth, cos_azimuth) = libm::sincos(look.azimuth_rad);
    let (sin_elevation, cos_elevation) = libm::sincos(look.elevation_rad);
    let length_m = libm::hypot(b[0] - a[0], b[1] - a[1]);
    let along = [(b[0] - a[0]) / length_m, (b[1] - a[1]) / length_m];
    let to = [a[0] - here_m.x, a[1] - here_m.y];
    // Where the line of sight crosses the screen's plane, in the ground's plane.
    let slope = sin_azimuth * along[1] - cos_azimuth * along[0];
    let ahead_m = (to[0] * along[1] - to[1] * along[0]) / slope;
    // Beside or behind: a plane that the line does not meet.
    if !(ahead_m.is_finite() && ahead_m > 0.0) {
        return 0.0;
    }
    let from_a_m = (to[0] * cos_azimuth - to[1] * sin_azimuth) / slope;
    // How far inside each edge the line passes, at right angles to it, and how far from the antenna that is.
    let up_m = top_m - here_m.z;
    let under_m = up_m * cos_elevation - ahead_m * sin_elevation;
    let (left_m, right_m) = (from_a_m * slope.abs(), (length_m - from_a_m) * slope.abs());
    let to_a_m = to[0] * sin_azimuth + to[1] * cos_azimuth;
    let to_b_m = to_a_m + length_m * (along[0] * sin_azimuth + along[1] * cos_azimuth);
    let edges = [
        (under_m, ahead_m * cos_elevation + up_m * sin_elevation),
        (left_m, to_a_m / cos_elevation),
        (right_m, to_b_m / cos_elevation),
    ];
    // Not nearer than a wavelength, where the formula does not hold.
    let nu =
        |(inside_m, distance_m): (f64, f64)| inside_m * (2.0 / (wavelength_m * distance_m.max(wavelength_m))).sqrt();
    knife_edge_db(edges.into_iter().map(nu).fold(f64::INFINITY, f64::min))
}

/// Loss in dB behind a knife edge by Fresnel's parameter ν (ITU-R P.526-15, equation 31); zero below −0.78.
pub fn knife_edge_db(nu: f64) -> f64 {
    if nu <= -0.78 {
        return 0.0;
    }
    let shifted = nu - 0.1;
    (6.9 + 20.0 * libm::log10((shifted * shifted + 1.0).sqrt() + shifted)).max(0.0)
}

impl Effect for Obstruction {
    fn name(&self) -> &'static str {
        "obstruction"
    }

    fn describe(&self) -> String {
        let count = |of: fn(&Obstacle) -> bool| self.obstacles.iter().filter(|obstacle| of(obstacle)).count();
        let kinds = [
            (count(|o| matches!(o, Obstacle::Horizon { .. })), "horizon"),
            (count(|o| matches!(o, Obstacle::Sector { .. })), "sector"),
            (count(|o| matches!(o, Obstacle::Building(_))), "building"),
        ];
        let present = kinds.iter().filter(|(n, _)| *n > 0);
        let names: Vec<String> =
            present.map(|(n, kind)| format!("{n} {kind}{}", if *n == 1 { "" } else { "s" })).collect();
        format!("{}: the direct ray loses power behind them", names.join(", "))
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        if let Some(direct) = rays.first_mut() {
            direct.cn0_hz *= self.left(&sight.user_m, sight.look, signal.carrier_hz(sight.sv));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const L1_HZ: f64 = 1_575.42e6;

    fn look(azimuth_deg: f64, elevation_deg: f64) -> Look {
        Look { azimuth_rad: azimuth_deg.to_radians(), elevation_rad: elevation_deg.to_radians() }
    }

    fn origin() -> Vector3<f64> {
        Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef()
    }

    fn left(obstacle: Obstacle, azimuth_deg: f64, elevation_deg: f64) -> f64 {
        Obstruction::new(vec![obstacle], origin()).left(&origin(), look(azimuth_deg, elevation_deg), L1_HZ)
    }

    #[test]
    fn the_knife_edge_has_the_recommendation_s_losses() {
        // ITU-R P.526-15, figure 9: 6 dB at grazing, 13 dB at ν = 1, 20 dB at ν = 2.4, 0 dB at −0.78;
        // far behind the edge Fresnel's asymptote 20 lg(ν √2 π).
        for (nu, db, off) in [(-1.0, 0.0, 0.0), (-0.78, 0.0, 0.01), (0.0, 6.0, 0.1), (1.0, 13.9, 0.2), (2.4, 20.5, 0.3)]
        {
            assert!((knife_edge_db(nu) - db).abs() <= off, "{nu}: {}", knife_edge_db(nu));
        }
        let asymptote = 20.0 * libm::log10(10.0 * 2_f64.sqrt() * PI);
        assert!((knife_edge_db(10.0) - asymptote).abs() < 0.1);
    }

    #[test]
    fn a_horizon_blocks_below_its_line_all_the_way_round() {
        let points_rad =
            [(10.0, 20.0), (180.0, 40.0), (350.0, 10.0)].map(|(a, e): (f64, f64)| (a.to_radians(), e.to_radians()));
        let mask = |share: f64| Obstacle::Horizon { points_rad: points_rad.to_vec(), edge_rad: 0.01, share };
        // North lies half way between 350° and 10°: 15°. Half way up the first side, 95°, is 30°.
        for (azimuth, elevation, expected) in [
            (0.0, 14.0, 0.0),
            (0.0, 16.0, 1.0),
            (95.0, 29.0, 0.0),
            (95.0, 31.0, 1.0),
            (180.0, 41.0, 1.0),
            (359.9, 5.0, 0.0),
        ] {
            assert_eq!(left(mask(0.0), azimuth, elevation), expected, "{azimuth} {elevation}");
        }
        assert!((left(mask(0.1), 0.0, 3.0) - 0.1).abs() < 1e-12);
        // The edge is half way at the line itself.
        assert!((left(mask(0.0), 180.0, 40.0) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn a_sector_may_reach_over_north() {
        let sector = Obstacle::Sector {
            from_rad: 340_f64.to_radians(),
            to_rad: 30_f64.to_radians(),
            roof_rad: 50_f64.to_radians(),
            edge_rad: 0.01,
            share: 0.01,
        };
        for (azimuth, elevation, blocked) in [
            (0.0, 10.0, true),
            (345.0, 45.0, true),
            (29.0, 45.0, true),
            (330.0, 10.0, false),
            (40.0, 10.0, false),
            (0.0, 52.0, false),
        ] {
            assert_eq!(left(sector.clone(), azimuth, elevation) < 0.5, blocked, "{azimuth} {elevation}");
        }
    }

    #[test]
    fn a_building_shades_what_geometry_says_and_six_decibels_at_its_edges() {
        // 20 m to the north, 30 m wide, 20 m above the antenna: the roof is at 45°, the corners at
        // ±atan(15/20).
        let building = Building { east_m: [-15.0, 15.0], north_m: [20.0, 60.0], top_m: 20.0, share: 0.0 };
        let loss = |azimuth: f64, elevation: f64| building.loss_db(&Vector3::zeros(), look(azimuth, elevation), L1_HZ);
        assert!((loss(0.0, 45.0) - 6.0).abs() < 0.1, "{}", loss(0.0, 45.0));
        assert!((loss(libm::atan2(15.0, 20.0).to_degrees(), 20.0) - 6.0).abs() < 0.1);
        for (azimuth, elevation) in [(0.0, 60.0), (90.0, 5.0), (180.0, 5.0), (50.0, 10.0), (0.0, 90.0)] {
            assert_eq!(loss(azimuth, elevation), 0.0, "{azimuth} {elevation}");
        }
        // Half as steep as the roof the line passes 8.9 m below its edge, 26.8 m from here.
        let (sin, cos) = libm::sincos(0.46365);
        let (distance, inside) = (20.0 * (cos + sin), 20.0 * (cos - sin));
        let nu = inside * (2.0_f64 / (0.190_293_67 * distance)).sqrt();
        assert!((loss(0.0, 0.46365_f64.to_degrees()) - knife_edge_db(nu)).abs() < 1e-3);
        // Walking 100 m east leaves it behind.
        let aside = building.loss_db(&Vector3::new(100.0, 0.0, 0.0), look(0.0, 10.0), L1_HZ);
        assert_eq!(aside, 0.0);
    }

    #[test]
    fn without_loss_not_a_bit_changes_and_only_the_direct_ray_is_touched() {
        let ray = |cn0_hz: f64| Ray { code_delay_s: 0.1, carrier_delay_s: 0.1, phase_cycles: 0.2, cn0_hz };
        let points_rad = vec![(0.0, 1.5)];
        for (share, kept) in [(1.0, true), (0.0, false)] {
            let obstacles = vec![
                Obstacle::Horizon { points_rad: points_rad.clone(), edge_rad: 0.01, share },
                Obstacle::Sector { from_rad: 0.0, to_rad: 6.0, roof_rad: 1.5, edge_rad: 0.01, share },
                Obstacle::Building(Building { east_m: [-50.0, 50.0], north_m: [5.0, 9.0], top_m: 90.0, share }),
            ];
            let effect = Obstruction::new(obstacles, origin());
            let mut rays = vec![ray(31_622.776_601), ray(5e3)];
            effect.act(&crate::effect::link::tests::sight(30.0, 0.0), &gnss::gps::l1ca::L1_CA, &mut rays);
            assert_eq!(rays[0] == ray(31_622.776_601), kept);
            assert_eq!(rays[1], ray(5e3));
        }
    }

    #[test]
    fn no_direction_meets_a_step() {
        let building = Building { east_m: [-15.0, 15.0], north_m: [20.0, 60.0], top_m: 20.0, share: 0.0 };
        let mut steepest = 0.0_f64;
        for elevation in 0..90 {
            let db =
                |k: i32| building.loss_db(&Vector3::zeros(), look(f64::from(k) * 0.02, f64::from(elevation)), L1_HZ);
            steepest = (0..18_000).map(|k| (db(k + 1) - db(k)).abs()).fold(steepest, f64::max);
        }
        // 0.02° at 22 m (the near corners) are 8 mm; ν counts in 1.4 m there and a unit of it is 9 dB at
        // most. At the far corners 22 mm in 2.4 m: 0.08 dB.
        assert!(steepest < 0.12, "{steepest}");
    }
}
