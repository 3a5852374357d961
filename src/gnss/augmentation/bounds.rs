//! Bounds of corrections beyond their indicators: degradation (type 10), regions of a service (type 27), and
//! directions of a satellite's errors (type 28). Beside them, almanacs of the system's satellites (type 17).
//!
//! Source: RTCA DO-229D, A.4.4.6 (table A-9), A.4.4.12 (table A-17), A.4.4.13 (tables ),
//! A.4.4.16 (table A-23), and A.4.5.1 for their use.

use nalgebra::{Matrix4, Vector3, Vector4};

use crate::earth::Geodetic;

/// Largest number of regions in one message of type 27.
pub const LARGEST_REGIONS: usize = 5;

/// Factors of the bounds by indicator of type 27 (table A-22).
const FACTORS: [f64; 16] = [1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 20.0, 30.0, 40.0, 50.0, 100.0];

/// Degradation of corrections while they age or newer ones are lost (type 10).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Factors {
    /// Rounding of fast corrections, by which their rate is off, in metres.
    pub b_rrc_m: f64,
    /// Rounding of long-term corrections with rates, in metres.
    pub c_ltc_lsb_m: f64,
    /// Growth of the error of long-term corrections with rates, in m/s.
    pub c_ltc_v1_mps: f64,
    /// Time between long-term corrections with rates, in seconds.
    pub i_ltc_v1_s: f64,
    /// Step of the error of long-term corrections without rates, in metres.
    pub c_ltc_v0_m: f64,
    /// Time between long-term corrections without rates, in seconds.
    pub i_ltc_v0_s: f64,
    /// Rounding of the positions of the system's own satellites, in metres.
    pub c_geo_lsb_m: f64,
    /// Growth of their error, in m/s.
    pub c_geo_v_mps: f64,
    /// Time between their messages, in seconds.
    pub i_geo_s: f64,
    /// Error of corrections that are used en route beyond their time-out, in metres.
    pub c_er_m: f64,
    /// Step of the error of delays of the grid, in metres.
    pub c_iono_step_m: f64,
    /// Time between delays of the grid, in seconds.
    pub i_iono_s: f64,
    /// Growth of their error, in m/s.
    pub c_iono_ramp_mps: f64,
    /// True if degradations of corrections add as squares.
    pub is_squared: bool,
    /// True if degradations of delays add as squares.
    pub is_delay_squared: bool,
    /// Rounding of covariances, in steps of their scale.
    pub c_covariance: f64,
}

/// Almanac of one of the system's own satellites (type 17).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Almanac {
    /// Data set: 0.
    pub data: u8,
    /// Number of the satellite: 120 and more; 0 for none.
    pub number: u8,
    /// Health: bit 0 ranging, bit 1 corrections, bit 2 integrity are off; bits 4 to 7 name the provider.
    pub health: u8,
    /// ECEF position in metres.
    pub position_m: [f64; 3],
    /// ECEF velocity in m/s.
    pub velocity_mps: [f64; 3],
}

/// Almanacs of three of the system's own satellites (type 17).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Almanacs {
    /// The satellites.
    pub each: [Almanac; 3],
    /// Second of the day to which they refer, a multiple of 64 s.
    pub second_of_day: f64,
}

/// Area of a service: two corners in whole degrees, north and east.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Region {
    /// First corner.
    pub first_deg: [f64; 2],
    /// Second corner.
    pub second_deg: [f64; 2],
    /// True for a rectangle; false for the triangle with a third corner at the first one's latitude and the
    /// second one's longitude.
    pub is_square: bool,
}

impl Region {
    /// True if a position lies in it.
    pub fn holds(&self, place: Geodetic) -> bool {
        let ([north_1, east_1], [north_2, east_2]) = (self.first_deg, self.second_deg);
        let around = |east: f64| (east - east_1 + 180.0).rem_euclid(360.0) - 180.0;
        // Along each side from the first corner to the second, 0 to 1.
        let share = |of: f64, whole: f64| if whole == 0.0 { f64::NAN } else { of / whole };
        let up = share(place.latitude_rad.to_degrees() - north_1, north_2 - north_1);
        let right = share(around(place.longitude_rad.to_degrees()), around(east_2));
        let is_within = (0.0..=1.0).contains(&up) && (0.0..=1.0).contains(&right);
        is_within && (self.is_square || right >= up)
    }
}

/// Regions and how bounds are to be multiplied in them and outside (type 27).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Service {
    /// Issue of the service.
    pub iods: u8,
    /// Number of messages of this issue, less one.
    pub messages: u8,
    /// Number of this message, from 0.
    pub message: u8,
    /// Regions that are used.
    pub count: u8,
    /// Priority where regions of several messages overlap: the higher one counts.
    pub priority: u8,
    /// Indicator of the factor within the regions.
    pub inside: u8,
    /// Indicator of the factor outside of all regions.
    pub outside: u8,
    /// The regions.
    pub regions: [Region; LARGEST_REGIONS],
}

impl Service {
    /// True if one of the regions holds a position.
    pub fn holds(&self, place: Geodetic) -> bool {
        self.regions.iter().take(usize::from(self.count)).any(|region| region.holds(place))
    }

    /// Factor of the bounds within the regions.
    pub fn factor_inside(&self) -> f64 {
        factor(self.inside)
    }

    /// Factor of the bounds outside of all regions.
    pub fn factor_outside(&self) -> f64 {
        factor(self.outside)
    }
}

fn factor(indicator: u8) -> f64 {
    FACTORS.get(usize::from(indicator)).copied().unwrap_or(FACTORS[15])
}

/// Directions of a satellite's errors: the upper triangle of a factor of their covariance (type 28).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Covariance {
    /// Position in the mask from 1; 0 for none.
    pub place: u8,
    /// Exponent of the scale.
    pub exponent: u8,
    /// Elements (1,1), (2,2), (3,3) and (4,4).
    pub diagonal: [u16; 4],
    /// Elements (1,2), (1,3), (1,4), (2,3), (2,4) and (3,4).
    pub above: [i16; 6],
}

impl Covariance {
    /// Step of the elements: 2 to the power of the exponent less 5.
    pub fn scale(&self) -> f64 {
        libm::ldexp(1.0, i32::from(self.exponent) - 5)
    }

    /// The factor R of the covariance RᵀR.
    pub fn factor(&self) -> Matrix4<f64> {
        let [a, b, c, d] = self.diagonal.map(f64::from);
        let [ab, ac, ad, bc, bd, cd] = self.above.map(f64::from);
        let rows = [a, ab, ac, ad, 0.0, b, bc, bd, 0.0, 0.0, c, cd, 0.0, 0.0, 0.0, d];
        self.scale() * Matrix4::from_row_slice(&rows)
    }

    /// Factor of the bound of a range in a direction: δUDRE. `sight` is the unit vector from the user to the
    /// satellite in ECEF, and the rounding of the elements is `c_covariance` steps (A.4.5.1.4.1).
    pub fn delta(&self, sight: &Vector3<f64>, c_covariance: f64) -> f64 {
        let line = Vector4::new(sight.x, sight.y, sight.z, 1.0);
        (self.factor() * line).norm() + c_covariance * self.scale()
    }
}

/// Covariances of two satellites (type 28).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Covariances {
    /// Issue of the mask.
    pub iodp: u8,
    /// The satellites'.
    pub both: [Covariance; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(latitude_deg: f64, longitude_deg: f64) -> Geodetic {
        Geodetic::from_degrees(latitude_deg, longitude_deg, 0.0)
    }

    #[test]
    fn a_region_holds_what_lies_between_its_corners_and_a_triangle_half_of_that() {
        let square = Region { first_deg: [20.0, 170.0], second_deg: [60.0, -150.0], is_square: true };
        assert!(square.holds(at(40.0, 175.0)) && square.holds(at(40.0, -155.0)) && square.holds(at(20.0, 170.0)));
        assert!(!square.holds(at(40.0, 165.0)) && !square.holds(at(61.0, 175.0)) && !square.holds(at(40.0, -149.0)));
        // Third corner at 20° north, 150° west.
        let triangle = Region { is_square: false, ..square };
        assert!(triangle.holds(at(25.0, -155.0)) && !triangle.holds(at(55.0, 175.0)));
        let none = Region { first_deg: [20.0, 10.0], second_deg: [20.0, 30.0], is_square: true };
        assert!(!none.holds(at(20.0, 20.0)));
    }

    /// RᵀR of a diagonal factor: the squares of the elements along the line of sight.
    #[test]
    fn a_direction_takes_its_own_elements_of_the_covariance() {
        let of = Covariance { place: 1, exponent: 5, diagonal: [3, 0, 0, 4], above: [0; 6] };
        assert!((of.delta(&Vector3::x(), 0.0) - 5.0).abs() < 1e-12);
        assert!((of.delta(&Vector3::y(), 0.5) - 4.5).abs() < 1e-12);
        // Orbit and clock that cancel along x.
        let bound = Covariance { diagonal: [4, 0, 0, 0], above: [0, 0, -4, 0, 0, 0], exponent: 2, ..of };
        assert_eq!(bound.delta(&Vector3::x(), 0.0), 0.0);
        assert!((bound.delta(&-Vector3::x(), 0.0) - 1.0).abs() < 1e-12);
    }
}
