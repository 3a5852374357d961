//! NeQuick-G: the ionosphere model for which Galileo broadcasts three coefficients.
//!
//! Source: European GNSS (Galileo) Open Service, Ionospheric Correction Algorithm for Galileo Single
//! Frequency Users, issue 1.2 (2016). The electrons at a position are three Epstein layers below a peak whose
//! density and height the ITU's monthly maps give (`maps`, `profile`), and one above it. The delay is
//! their integral along the straight line to the satellite. Limits: the document takes latitudes and heights
//! above the ellipsoid for those on a sphere of 6371.2 km, and so does this; GPS time is taken for UT, which
//! moves the Sun by less than 0.1°; the model steps where a month begins and, by a day of the Sun's
//! declination, at 0 h UT.

use nalgebra::Vector3;

use crate::earth::Geodetic;
use crate::time::Epoch;
use profile::Sun;

mod maps;
mod profile;

/// Radius of the document's sphere, in kilometres (2.5.2).
const EARTH_KM: f64 = 6371.2;
/// Metres of delay at 1 Hz² for an electron per square metre (2.2): 40.3 m³/s².
const DELAY_M3PS2: f64 = 40.3;
/// Electrons in a square metre of a TECU.
const TECU: f64 = 1e16;
/// Ionisation where all three coefficients are zero, in solar flux units (3.3).
const DEFAULT_AZ_SFU: f64 = 63.7;
/// Largest ionisation that the document allows, in solar flux units (2.5.4).
const LARGEST_AZ_SFU: f64 = 400.0;
/// Heights at which the integral is divided, in kilometres: the electrons crowd between 100 and 600 km.
const DIVISIONS_KM: [f64; 9] = [100.0, 150.0, 200.0, 270.0, 350.0, 450.0, 650.0, 1000.0, 2000.0];
/// Nodes and weights of the Gauss-Legendre rule of eight nodes on −1 to 1 (Abramowitz and Stegun, table
/// 25.4): the half above zero.
const RULE: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Three broadcast coefficients of the effective ionisation: solar flux units, per degree of modified dip and
/// per degree squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NequickG {
    /// ai0, ai1 and ai2.
    pub coefficients: [f64; 3],
}

impl NequickG {
    /// Effective ionisation at a modified dip, in solar flux units (2.5.4, 3.3).
    fn ionisation_sfu(&self, modip_deg: f64) -> f64 {
        let [a0, a1, a2] = self.coefficients;
        if self.coefficients == [0.0; 3] {
            return DEFAULT_AZ_SFU;
        }
        (a0 + modip_deg * (a1 + modip_deg * a2)).clamp(0.0, LARGEST_AZ_SFU)
    }

    /// Electron content in TECU along the line from `user` to `satellite`, in a month and at an hour of UT.
    pub fn stec_tecu(&self, user: Geodetic, satellite: Geodetic, month: u8, ut_h: f64) -> f64 {
        let modip_deg = maps::modip_deg(user.latitude_rad, user.longitude_rad);
        let sun = Sun::new(month, ut_h, self.ionisation_sfu(modip_deg));
        let line = Line::between(user, satellite);
        line.integrate(|place_km| sun.electrons_per_m3(place_km)) * 1e3 / TECU
    }

    /// Group delay in seconds on a carrier of `carrier_hz` from `user` to `satellite`, which are earth-fixed
    /// positions, at GPS time `at`.
    pub fn delay_s(&self, user: Geodetic, satellite_m: &Vector3<f64>, at: Epoch, carrier_hz: f64) -> f64 {
        let (month, ut_h) = at.month_and_hour();
        let tecu = self.stec_tecu(user, Geodetic::from_ecef(satellite_m), month, ut_h);
        delay_s(tecu, carrier_hz)
    }
}

/// Group delay in seconds of a slant electron content in TECU on a carrier.
pub fn delay_s(tecu: f64, carrier_hz: f64) -> f64 {
    DELAY_M3PS2 * TECU * tecu / (carrier_hz * carrier_hz) / crate::earth::SPEED_OF_LIGHT_MPS
}

/// A straight line past the Earth's centre, by the distance from the position that is nearest to it.
struct Line {
    /// The nearest position, in kilometres.
    perigee_km: Vector3<f64>,
    /// Unit vector towards the satellite.
    along: Vector3<f64>,
    /// Distances of user and satellite along the line, in kilometres.
    from_km: f64,
    to_km: f64,
}

impl Line {
    fn between(user: Geodetic, satellite: Geodetic) -> Self {
        let (user_km, satellite_km) = (on_sphere_km(user), on_sphere_km(satellite));
        let way_km = satellite_km - user_km;
        let along = way_km.try_normalize(0.0).unwrap_or(Vector3::z());
        let from_km = user_km.dot(&along);
        Self { perigee_km: user_km - along * from_km, along, from_km, to_km: from_km + way_km.norm() }
    }

    /// Integral of `density` over the line, in its unit times kilometres.
    fn integrate(&self, density: impl Fn(&Vector3<f64>) -> f64) -> f64 {
        let perigee_km = self.perigee_km.norm();
        let mut ends_km: Vec<f64> = vec![self.from_km, self.to_km, 0.0];
        for height_km in DIVISIONS_KM {
            let radius_km = EARTH_KM + height_km;
            if radius_km > perigee_km {
                let away_km = ((radius_km - perigee_km) * (radius_km + perigee_km)).sqrt();
                ends_km.extend([-away_km, away_km]);
            }
        }
        ends_km.retain(|place| (self.from_km..=self.to_km).contains(place));
        ends_km.sort_by(f64::total_cmp);
        let part = |ends: &[f64]| {
            let (middle_km, half_km) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
            let at = |place_km: f64| density(&(self.perigee_km + self.along * place_km));
            let both = |(place, weight): &(f64, f64)| {
                weight * (at(middle_km - half_km * place) + at(middle_km + half_km * place))
            };
            half_km * RULE.iter().map(both).sum::<f64>()
        };
        ends_km.windows(2).map(part).sum()
    }
}

/// A position on the document's sphere, in kilometres from its centre.
fn on_sphere_km(place: Geodetic) -> Vector3<f64> {
    let (sin_lat, cos_lat) = libm::sincos(place.latitude_rad);
    let (sin_lon, cos_lon) = libm::sincos(place.longitude_rad);
    // Nobody is below the sea by more than a few kilometres but a solver's first guess.
    let radius_km = EARTH_KM + (1e-3 * place.height_m).max(-100.0);
    radius_km * Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat)
}

#[cfg(test)]
mod tests;
