//! Map projections of city models: coordinates of the plane to positions on the Earth.
//!
//! Formulas: IOGP Publication 373-7-2, Coordinate Conversions and Transformations: oblique stereographic
//! (method 9809) for the Dutch RD New, transverse Mercator (method 9807, Krüger's series to the fourth power)
//! for UTM. RD New passes from the datum Amersfoort to WGS 84 by EPSG's transformation 4833 (seven
//! parameters, stated accuracy 1 m). Distances within a city keep the centimetre: the projection itself is
//! exact to 0.1 mm, and the correction grid that transformation 4833 leaves out changes by less than 1 cm
//! over a kilometre. Limits: the codes of [`SUPPORTED`] and no others; heights are given above the ellipsoid,
//! see [`Reference::levelled`].

use nalgebra::Vector3;

use crate::earth::{ECCENTRICITY_SQUARED, FLATTENING, Geodetic, SEMI_MAJOR_AXIS_M};

/// Codes of EPSG that are understood, in words.
pub const SUPPORTED: &str = "EPSG 7415 or 28992 (RD New), 25828 to 25838 (ETRS89 / UTM), 32601 to 32660 or 32701 to \
                             32760 (WGS 84 / UTM)";

/// Reference system of a city model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Code of EPSG.
    pub code: u32,
    /// True if the system's own heights are above the sea and not above the ellipsoid.
    pub levelled: bool,
    plane: Plane,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Plane {
    RdNew,
    Utm { zone: u32, south: bool },
}

/// Ellipsoid of a datum: semi-major axis in metres, and the square of the first eccentricity.
#[derive(Clone, Copy, Debug)]
struct Ellipsoid {
    axis_m: f64,
    square: f64,
}

/// Bessel 1841 (EPSG 7004).
const BESSEL: Ellipsoid =
    Ellipsoid { axis_m: 6_377_397.155, square: FLATTENING_OF_BESSEL * (2.0 - FLATTENING_OF_BESSEL) };
const FLATTENING_OF_BESSEL: f64 = 1.0 / 299.152_812_8;
/// Natural origin of RD New in degrees, its scale, and its false origin in metres (EPSG 19914).
const RD_LATITUDE_DEG: f64 = 52.0 + 9.0 / 60.0 + 22.178 / 3600.0;
const RD_LONGITUDE_DEG: f64 = 5.0 + 23.0 / 60.0 + 15.5 / 3600.0;
const RD_SCALE: f64 = 0.999_907_9;
const RD_ORIGIN_M: [f64; 2] = [155_000.0, 463_000.0];
/// EPSG 4833, coordinate frame rotation (method 9607): metres, radians, and parts of one.
const TO_WGS84_M: Vector3<f64> = Vector3::new(565.4171, 50.3319, 465.5524);
const TO_WGS84_RAD: Vector3<f64> = Vector3::new(1.9342e-6, -1.6677e-6, 9.1019e-6);
const TO_WGS84_SCALE: f64 = 4.0725e-6;
/// Scale of UTM at its central meridian, and its false eastings and southern northings in metres (EPSG
/// 16000).
const UTM_SCALE: f64 = 0.9996;
const UTM_EASTING_M: f64 = 500_000.0;
const UTM_SOUTH_M: f64 = 10_000_000.0;
/// Repetitions of the latitude's series: each gains two digits and more.
const PASSES: u32 = 12;

impl Reference {
    /// Finds the system of a code of EPSG; `None` if it is not supported.
    pub fn of_code(code: u32) -> Option<Self> {
        let (plane, levelled) = match code {
            28_992 => (Plane::RdNew, true),
            7_415 => (Plane::RdNew, true),
            25_828..=25_838 => (Plane::Utm { zone: code - 25_800, south: false }, false),
            32_601..=32_660 => (Plane::Utm { zone: code - 32_600, south: false }, false),
            32_701..=32_760 => (Plane::Utm { zone: code - 32_700, south: true }, false),
            _ => return None,
        };
        Some(Self { code, levelled, plane })
    }

    /// Finds the code in the name of a reference system: `https://www.opengis.net/def/crs/EPSG/0/7415`,
    /// `urn:ogc:def:crs:EPSG::7415` or `EPSG:7415`.
    pub fn code_of(name: &str) -> Option<u32> {
        let is_epsg = name.to_ascii_uppercase().contains("EPSG");
        let digits = name.rsplit(['/', ':']).next().filter(|_| is_epsg)?;
        digits.parse().ok()
    }

    /// Position on WGS 84 of a point of the plane; `height_m` is above the ellipsoid.
    pub fn geodetic(&self, east_m: f64, north_m: f64, height_m: f64) -> Geodetic {
        let (latitude_rad, longitude_rad) = match self.plane {
            Plane::RdNew => to_wgs84(oblique_stereographic(east_m, north_m)),
            Plane::Utm { zone, south } => {
                let earth = Ellipsoid { axis_m: SEMI_MAJOR_AXIS_M, square: ECCENTRICITY_SQUARED };
                let from_equator_m = north_m - if south { UTM_SOUTH_M } else { 0.0 };
                let meridian_rad = (6.0 * f64::from(zone) - 183.0).to_radians();
                let (latitude_rad, from_meridian_rad) = transverse_mercator(
                    earth,
                    FLATTENING,
                    (east_m - UTM_EASTING_M) / UTM_SCALE,
                    from_equator_m / UTM_SCALE,
                );
                (latitude_rad, meridian_rad + from_meridian_rad)
            }
        };
        Geodetic { latitude_rad, longitude_rad, height_m }
    }
}

/// Isometric latitude's part of the ellipsoid: e/2 · ln((1 − e sin φ)/(1 + e sin φ)).
fn flattened(eccentricity: f64, sine: f64) -> f64 {
    -eccentricity * libm::atanh(eccentricity * sine)
}

/// Latitude and longitude on Bessel's ellipsoid of a point of RD New (method 9809, reverse).
fn oblique_stereographic(east_m: f64, north_m: f64) -> (f64, f64) {
    let Ellipsoid { axis_m, square } = BESSEL;
    let e = square.sqrt();
    let (origin_rad, meridian_rad) = (RD_LATITUDE_DEG.to_radians(), RD_LONGITUDE_DEG.to_radians());
    let (sin0, cos0) = libm::sincos(origin_rad);
    let flat = 1.0 - square * sin0 * sin0;
    // Radius of the conformal sphere: √(ρ₀ ν₀).
    let radius_m = axis_m * (1.0 - square).sqrt() / flat;
    let n = (1.0 + square * cos0 * cos0 * cos0 * cos0 / (1.0 - square)).sqrt();
    // w₁ = (S₁ S₂^e)^n, by its logarithm.
    let w1 = libm::exp(2.0 * n * (libm::atanh(sin0) + flattened(e, sin0)));
    let sin00 = (w1 - 1.0) / (w1 + 1.0);
    let c = (n + sin0) * (1.0 - sin00) / ((n - sin0) * (1.0 + sin00));
    let w2 = c * w1;
    let chi0 = libm::asin((w2 - 1.0) / (w2 + 1.0));
    let (x_m, y_m) = (east_m - RD_ORIGIN_M[0], north_m - RD_ORIGIN_M[1]);
    let twice_m = 2.0 * radius_m * RD_SCALE;
    let g = twice_m * libm::tan(std::f64::consts::FRAC_PI_4 - 0.5 * chi0);
    let h = 2.0 * twice_m * libm::tan(chi0) + g;
    let i = libm::atan2(x_m, h + y_m);
    let j = libm::atan2(x_m, g - y_m) - i;
    let chi = chi0 + 2.0 * libm::atan((y_m - x_m * libm::tan(0.5 * j)) / twice_m);
    let longitude_rad = (j + 2.0 * i) / n + meridian_rad;
    // ½ ln((1 + sin χ)/(c (1 − sin χ)))/n
    let isometric = (libm::atanh(libm::sin(chi)) - 0.5 * libm::log(c)) / n;
    (latitude(e, isometric), longitude_rad)
}

/// Latitude of an isometric latitude, by repetition.
fn latitude(e: f64, isometric: f64) -> f64 {
    let mut sine = libm::tanh(isometric);
    for _ in 0..PASSES {
        sine = libm::tanh(isometric - flattened(e, sine));
    }
    libm::asin(sine)
}

/// Latitude and longitude on WGS 84 of those on the datum Amersfoort, by EPSG 4833. A height of 0 on Bessel's
/// ellipsoid stands for all: 50 m change the position by a millimetre.
fn to_wgs84((latitude_rad, longitude_rad): (f64, f64)) -> (f64, f64) {
    let (sin_lat, cos_lat) = libm::sincos(latitude_rad);
    let (sin_lon, cos_lon) = libm::sincos(longitude_rad);
    let normal_m = BESSEL.axis_m / (1.0 - BESSEL.square * sin_lat * sin_lat).sqrt();
    let old_m = Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, (1.0 - BESSEL.square) * sin_lat) * normal_m;
    // A rotation of the axes: x + r_z y − r_y z, and so on.
    let turned_m = old_m - TO_WGS84_RAD.cross(&old_m);
    let new = Geodetic::from_ecef(&(TO_WGS84_M + turned_m * (1.0 + TO_WGS84_SCALE)));
    (new.latitude_rad, new.longitude_rad)
}

/// Latitude, and longitude from the central meridian, of a point of the transverse Mercator projection of
/// scale 1, counted from the equator and the meridian (method 9807, reverse).
fn transverse_mercator(earth: Ellipsoid, flattening: f64, east_m: f64, north_m: f64) -> (f64, f64) {
    let n = flattening / (2.0 - flattening);
    let (n2, n3, n4) = (n * n, n * n * n, n * n * n * n);
    let rectifying_m = earth.axis_m / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
    let series = [
        n / 2.0 - 2.0 / 3.0 * n2 + 37.0 / 96.0 * n3 - n4 / 360.0,
        n2 / 48.0 + n3 / 15.0 - 437.0 / 1440.0 * n4,
        17.0 / 480.0 * n3 - 37.0 / 840.0 * n4,
        4397.0 / 161_280.0 * n4,
    ];
    let (xi, eta) = (north_m / rectifying_m, east_m / rectifying_m);
    let (mut xi0, mut eta0) = (xi, eta);
    for (k, h) in (1..).zip(series) {
        let twice = 2.0 * f64::from(k);
        let (sine, cosine) = libm::sincos(twice * xi);
        xi0 -= h * sine * libm::cosh(twice * eta);
        eta0 -= h * cosine * libm::sinh(twice * eta);
    }
    let conformal = libm::asin(libm::sin(xi0) / libm::cosh(eta0));
    let isometric = libm::asinh(libm::tan(conformal));
    let longitude_rad = libm::asin(libm::tanh(eta0) / libm::cos(conformal));
    (latitude(earth.square.sqrt(), isometric), longitude_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance in metres on the ground between two positions given in degrees.
    fn apart_m(one: (f64, f64), other: (f64, f64)) -> f64 {
        let at = |(latitude, longitude)| Geodetic::from_degrees(latitude, longitude, 0.0).to_ecef();
        (at(one) - at(other)).norm()
    }

    #[test]
    fn rd_new_has_the_point_of_the_guidance_note() {
        // IOGP 373-7-2, oblique stereographic: 53° N, 6° E on the datum Amersfoort, printed to a millimetre;
        // and the origin.
        for (point, expected) in
            [([196_105.283, 557_057.739], (53.0, 6.0)), ([155_000.0, 463_000.0], (RD_LATITUDE_DEG, RD_LONGITUDE_DEG))]
        {
            let (latitude_rad, longitude_rad) = oblique_stereographic(point[0], point[1]);
            let found = (latitude_rad.to_degrees(), longitude_rad.to_degrees());
            assert!(apart_m(found, expected) < 1e-3, "{found:?}");
        }
    }

    #[test]
    fn the_tower_of_amersfoort_stands_where_the_cadastre_s_own_transformation_has_it() {
        let found = Reference::of_code(7415).unwrap().geodetic(155_000.0, 463_000.0, 0.0);
        let found = (found.latitude_rad.to_degrees(), found.longitude_rad.to_degrees());
        // RDNAPTRANS2018. The seven parameters are good to 0.25 m in the Netherlands.
        assert!(apart_m(found, (52.155_172_897, 5.387_203_657)) < 0.25, "{found:?}");
    }

    #[test]
    fn the_scale_of_the_plane_is_kept_to_the_centimetre() {
        // On the ground a distance of the plane is longer by 1/k, 0.9999079 at the origin and growing by
        // (r/2R)² outwards, on an ellipsoid that differs from Bessel's by the transformation's 4 parts in a
        // million.
        let rd = Reference::of_code(28_992).unwrap();
        for (x, y) in [(155_000.0, 463_000.0), (85_000.0, 447_500.0), (90_500.0, 435_600.0)] {
            let position = |dx: f64, dy: f64| rd.geodetic(x + dx, y + dy, 0.0).to_ecef();
            let r_m = libm::hypot(x - 155_000.0, y - 463_000.0);
            let scale = RD_SCALE * (1.0 + (r_m / (2.0 * 6.3826e6)).powi(2)) / (1.0 + TO_WGS84_SCALE);
            for (dx, dy) in [(1000.0, 0.0), (0.0, 1000.0), (600.0, -800.0)] {
                let found_m = (position(dx, dy) - position(0.0, 0.0)).norm();
                // The scale changes by a part in 10⁶ over the kilometre, and the Bessel height of 0 is 43 m
                // above.
                assert!((found_m - 1000.0 / scale).abs() < 0.01, "{found_m} {}", 1000.0 / scale);
            }
        }
    }

    #[test]
    fn transverse_mercator_has_the_point_of_the_guidance_note() {
        // IOGP 373-7-2, transverse Mercator: 50.5° N, 0.5° E on Airy's ellipsoid, in the British National
        // Grid, printed to a centimetre. Its origin is M₀ = 5 429 228.602 m from the equator, at 2° W.
        let flattening = 1.0 / 299.324_964_6;
        let airy = Ellipsoid { axis_m: 6_377_563.396, square: flattening * (2.0 - flattening) };
        let scale = 0.999_601_271_7;
        let (east_m, north_m) = ((577_274.99 - 400_000.0) / scale, (69_740.50 + 100_000.0) / scale + 5_429_228.602);
        let (latitude_rad, longitude_rad) = transverse_mercator(airy, flattening, east_m, north_m);
        let found = (latitude_rad.to_degrees(), longitude_rad.to_degrees() - 2.0);
        assert!(apart_m(found, (50.5, 0.5)) < 0.02, "{found:?}");
    }

    #[test]
    fn zones_of_utm_are_six_degrees_wide_and_count_from_the_equator() {
        let at = |code: u32, north_m: f64| {
            let found = Reference::of_code(code).unwrap().geodetic(500_000.0, north_m, 7.0);
            (found.latitude_rad.to_degrees(), found.longitude_rad.to_degrees(), found.height_m)
        };
        for (code, longitude_deg) in [(32_631, 3.0), (25_832, 9.0)] {
            let found = at(code, 0.0);
            assert!(found.0 == 0.0 && (found.1 - longitude_deg).abs() < 1e-12 && found.2 == 7.0, "{found:?}");
        }
        let (south, north) = (at(32_733, 1e7 - 3e6), at(32_633, 3e6));
        assert!((south.0 + north.0).abs() < 1e-12 && (south.1 - 15.0).abs() < 1e-12, "{south:?} {north:?}");
    }

    #[test]
    fn names_of_reference_systems_give_their_codes() {
        for name in
            ["https://www.opengis.net/def/crs/EPSG/0/7415", "urn:ogc:def:crs:EPSG::7415", "EPSG:7415", "epsg:7415"]
        {
            assert_eq!(Reference::code_of(name), Some(7415), "{name}");
        }
        for name in ["7415", "EPSG", "EPSG:", "urn:ogc:def:crs:OGC::CRS84", ""] {
            assert_eq!(Reference::code_of(name), None, "{name}");
        }
        for (code, is_known) in
            [(7415, true), (25_832, true), (32_644, true), (32_733, true), (2056, false), (4326, false)]
        {
            assert_eq!(Reference::of_code(code).is_some(), is_known, "{code}");
        }
    }
}
