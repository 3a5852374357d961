//! SBAS's grid of the ionosphere: where its points are, where a line of sight meets it, and the delay there.
//!
//! Source: RTCA DO-229D, A.4.4.9 (bands, table A-14), A.4.4.10.1 to A.4.4.10.4 (pierce points, cells,
//! interpolation, obliquity). Points are those of bands 0 to 8, 5° apart up to 55° of latitude. Limits: the
//! cells of 10° beyond 55° and the bands 9 and 10 around the poles are left out; a line of sight that meets
//! the shell there has no delay.

use crate::earth::{Geodetic, Look};

/// Height of the shell and radius of the Earth below it, in metres (A.4.4.10.1).
const SHELL_M: f64 = 350e3;
const EARTH_M: f64 = 6_378_136.3;
/// Number of bands whose points are listed by meridians.
pub const BANDS: u8 = 9;
const MERIDIANS: i16 = 8;
/// Degrees between meridians, and between points up to [`EDGE_DEG`].
pub const STEP_DEG: i16 = 5;
/// Latitude up to which cells are of five degrees.
pub const EDGE_DEG: i16 = 55;

/// Grid point: latitude and longitude in whole degrees, the longitude from −180 on.
pub type Point = (i16, i16);

/// Points of a meridian from south to north: every five degrees to 55°, on every second one those at 65° and
/// 75° too. Every ninety degrees one has that of 85° in the north and, 40° to its east, one that in the south
/// (table A-14).
fn meridian(longitude_deg: i16) -> Vec<Point> {
    let mut latitudes: Vec<i16> = (-EDGE_DEG..=EDGE_DEG).step_by(STEP_DEG as usize).collect();
    if planted!("gnss.sbas.bands", longitude_deg % 10 == 0, false) {
        latitudes.splice(0..0, [-75, -65]);
        latitudes.extend([65, 75]);
    }
    if longitude_deg % 90 == 0 {
        latitudes.push(85);
    }
    if (longitude_deg - 40) % 90 == 0 {
        latitudes.insert(0, -85);
    }
    latitudes.into_iter().map(|latitude_deg| (latitude_deg, longitude_deg)).collect()
}

/// Points of a band in the order in which its mask counts them, west to east and south to north. Empty for
/// bands that are not implemented.
pub fn points(band: u8) -> Vec<Point> {
    if band >= BANDS {
        return Vec::new();
    }
    let west_deg = -180 + MERIDIANS * STEP_DEG * i16::from(band);
    (0..MERIDIANS).flat_map(|count| meridian(west_deg + STEP_DEG * count)).collect()
}

/// Number of the band of a longitude, which is in whole degrees from −180 on.
pub fn band_of(longitude_deg: i16) -> u8 {
    ((longitude_deg + 180).rem_euclid(360) / (MERIDIANS * STEP_DEG)) as u8
}

/// Point at which a line of sight crosses the shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pierce {
    /// Latitude, north positive, in degrees.
    pub latitude_deg: f64,
    /// Longitude, east positive, from −180 on.
    pub longitude_deg: f64,
    /// Slant over vertical delay.
    pub obliquity: f64,
}

/// Computes the point at which the line from `user` towards `look` crosses the shell (A.4.4.10.1,
/// A.4.4.10.4).
pub fn pierce(user: Geodetic, look: Look) -> Pierce {
    let (sine, cosine) = libm::sincos(look.elevation_rad);
    let level = EARTH_M / (EARTH_M + SHELL_M) * cosine;
    let arc_rad = libm::atan2(cosine, sine) - libm::asin(level);
    let (sin_arc, cos_arc) = libm::sincos(arc_rad);
    let (sin_latitude, cos_latitude) = libm::sincos(user.latitude_rad);
    let (sin_azimuth, cos_azimuth) = libm::sincos(look.azimuth_rad);
    let up = sin_latitude * cos_arc + cos_latitude * sin_arc * cos_azimuth;
    // By two components, which holds over the poles as well.
    let (east, outward) = (sin_arc * sin_azimuth, cos_latitude * cos_arc - sin_latitude * sin_arc * cos_azimuth);
    let longitude_deg = (user.longitude_rad + libm::atan2(east, outward)).to_degrees();
    Pierce {
        latitude_deg: libm::asin(up.clamp(-1.0, 1.0)).to_degrees(),
        longitude_deg: (longitude_deg + 180.0).rem_euclid(360.0) - 180.0,
        obliquity: 1.0 / (1.0 - level * level).sqrt(),
    }
}

/// Vertical delay of a point in metres on L1, and the variance of its error in m².
pub type Vertical = (f64, f64);

/// Vertical delay at a pierce point and its variance, interpolated from four or three corners of its cell of
/// five degrees. `known` gives the values of a point (A.4.4.10.2, A.4.4.10.3).
pub fn vertical(at: Pierce, known: impl Fn(Point) -> Option<Vertical>) -> Option<Vertical> {
    let step_deg = f64::from(STEP_DEG);
    let corner = |deg: f64| (deg / step_deg).floor() as i16 * STEP_DEG;
    let (south, west) = (corner(at.latitude_deg), corner(at.longitude_deg));
    let north = south + STEP_DEG;
    if south < -EDGE_DEG || north > EDGE_DEG {
        return None;
    }
    let east = if west + STEP_DEG == 180 { -180 } else { west + STEP_DEG };
    let x = (at.longitude_deg - f64::from(west)) / step_deg;
    let y = (at.latitude_deg - f64::from(south)) / step_deg;
    // Corners north-east, north-west, south-west, south-east: by turns from the one opposite to the missing.
    let corners = [(north, east), (north, west), (south, west), (south, east)].map(known);
    let weights = match corners.map(|corner| corner.is_some()) {
        [true, true, true, true] => [x * y, (1.0 - x) * y, (1.0 - x) * (1.0 - y), x * (1.0 - y)],
        [false, true, true, true] => [0.0, y, 1.0 - x - y, x],
        [true, false, true, true] => [y, 0.0, 1.0 - x, x - y],
        [true, true, false, true] => [x + y - 1.0, 1.0 - x, 0.0, 1.0 - y],
        [true, true, true, false] => [x, y - x, 1.0 - y, 0.0],
        _ => return None,
    };
    if weights.iter().any(|weight| *weight < 0.0) {
        // In the half of the cell whose corner is missing.
        return None;
    }
    let sum = |part: fn(Vertical) -> f64| {
        let each = corners.iter().zip(weights).map(|(corner, weight)| corner.map_or(0.0, part) * weight);
        each.sum::<f64>()
    };
    Some((sum(|corner| corner.0), sum(|corner| corner.1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn bands_have_the_printed_numbers_of_points() {
        // Table A-14: the last points of bands 0 to 8.
        let counts: Vec<usize> = (0..=BANDS).map(|band| points(band).len()).collect();
        assert_eq!(counts, [201, 201, 201, 201, 201, 201, 201, 201, 200, 0]);
        // Band 0: 180° W has points 1 to 28, 175° W 29 to 51; band 1 begins with 85° S of 140° W.
        let (first, second) = (points(0), points(1));
        assert_eq!([first[0], first[27], first[28], first[50]], [(-75, -180), (85, -180), (-55, -175), (55, -175)]);
        assert_eq!([second[0], second[1], second[27]], [(-85, -140), (-75, -140), (75, -140)]);
        for (band, longitude) in [(0, -180), (0, -145), (1, -140), (4, 0), (8, 175), (0, 180)] {
            assert_eq!(band_of(longitude), band, "{longitude}");
        }
    }

    #[test]
    fn the_pierce_point_is_where_vectors_put_it() {
        for (latitude, longitude, azimuth, elevation) in
            [(26.5_f64, 80.2_f64, 33.0_f64, 5.0_f64), (-40.0, -179.0, 250.0, 15.0), (0.0, 0.0, 90.0, 89.0)]
        {
            let user = Geodetic::from_degrees(latitude, longitude, 0.0);
            let look = Look { azimuth_rad: azimuth.to_radians(), elevation_rad: elevation.to_radians() };
            let axes = user.ecef_to_enu().transpose();
            let (sine, cosine) = libm::sincos(look.elevation_rad);
            let (east, north) = libm::sincos(look.azimuth_rad);
            let from = axes * Vector3::new(0.0, 0.0, EARTH_M);
            let along = axes * Vector3::new(cosine * east, cosine * north, sine);
            let (half, radius) = (from.dot(&along), EARTH_M + SHELL_M);
            let point = from + along * ((half * half + radius * radius - EARTH_M * EARTH_M).sqrt() - half);
            let found = pierce(user, look);
            assert!((found.latitude_deg - libm::asin(point.z / radius).to_degrees()).abs() < 1e-9);
            let turn = (found.longitude_deg - libm::atan2(point.y, point.x).to_degrees()) / 360.0;
            assert!((turn - turn.round()).abs() < 1e-11 && (-180.0..180.0).contains(&found.longitude_deg));
            // Cosine between the line and the shell's normal.
            assert!((found.obliquity - radius / point.dot(&along)).abs() < 1e-9);
        }
    }

    /// A plane is what four corners and any three of them give back.
    #[test]
    fn between_corners_delays_are_those_of_a_plane() {
        let plane = |latitude_deg: f64, longitude_deg: f64| 3.0 + 0.1 * latitude_deg - 0.05 * longitude_deg;
        let at = |latitude_deg, longitude_deg| Pierce { latitude_deg, longitude_deg, obliquity: 1.0 };
        let corners = [(35, -105), (35, -110), (30, -110), (30, -105)];
        for missing in [None, Some(0), Some(1), Some(2), Some(3)] {
            let known = |point: Point| {
                let out = missing.is_some_and(|place: usize| corners[place] == point);
                (!out && corners.contains(&point))
                    .then(|| (plane(f64::from(point.0), f64::from(point.1)), f64::from(point.0 - 29)))
            };
            let mut inside = 0;
            // In each half of the cell along either diagonal.
            for (latitude_deg, longitude_deg) in [(31.5, -109.0), (31.0, -106.5), (34.0, -108.5), (33.5, -106.0)] {
                let Some((delay_m, variance_m2)) = vertical(at(latitude_deg, longitude_deg), known) else { continue };
                assert!((delay_m - plane(latitude_deg, longitude_deg)).abs() < 1e-12, "{missing:?}");
                assert!((1.0..=6.0).contains(&variance_m2));
                inside += 1;
            }
            assert_eq!(inside, if missing.is_none() { 4 } else { 2 }, "{missing:?}");
            assert_eq!(vertical(at(36.0, -109.0), known), None);
        }
        // Cells of five degrees end at 55°, and meet across 180°.
        let flat = |_: Point| Some((2.0, 1.0));
        assert_eq!(vertical(at(54.9, 178.0), flat).map(|found| found.0), Some(2.0));
        assert_eq!(vertical(at(55.1, 178.0), flat), None);
        let dateline = |(_, longitude): Point| (longitude.abs() >= 175).then_some((f64::from(longitude.signum()), 1.0));
        assert!((vertical(at(10.0, 177.5), dateline).unwrap().0).abs() < 1e-12);
    }
}
