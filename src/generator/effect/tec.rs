//! Ionosphere given by its electron content: on one thin shell, constant or from IONEX maps.
//!
//! A column of TEC electrons/m² delays the code by 40.3·TEC/f² metres and advances the carrier by as much
//! (IS-GPS-200N, 20.3.3.3.3.3 rests on the same 1/f²). The vertical column is taken where the straight line
//! meets the shell, and multiplied by 1/cos z' there (Schaer 1999, single-layer mapping) or as CODE does it
//! (modified single layer). Limits: the geometry is that of a user on the ground; above 350 km the delay
//! fades as in [`super::ionosphere`]. What satellites broadcast is not this module's.

use std::f64::consts::FRAC_PI_2;

use crate::effect::ionosphere::{delay_groups, share_above};
use crate::ray::{Effect, Ray, Sight};
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::ionex::{Interpolation, Maps};
use gnss::signal::Signal;

/// Metres of delay on a carrier of 1 Hz for one electron/m², times 1e16 electrons/m² of a TEC unit.
const METRES_PER_TECU_HZ2: f64 = 40.3e16;
/// CODE's modified single-layer mapping: share of the zenith angle, and height of the shell that it assumes.
const MODIFIED_SHARE: f64 = 0.9782;
const MODIFIED_HEIGHT_M: f64 = 506.7e3;
/// Mean radius of the Earth where no map gives one, in metres.
pub const EARTH_RADIUS_M: f64 = 6371e3;

/// Conversion of a vertical electron content to a slant one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// 1/cos of the zenith angle at the shell.
    SingleLayer,
    /// Modified single-layer mapping: 0.9782 of the zenith angle and a shell at 506.7 km, close to a Chapman
    /// profile.
    ModifiedSingleLayer,
}

/// Sphere that contains all electrons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shell {
    /// Radius of the Earth, in metres.
    pub radius_m: f64,
    /// Height above the sphere of the maps, in metres.
    pub height_m: f64,
    /// Conversion from vertical to slant content.
    pub mapping: Mapping,
}

/// Point at which a line of sight crosses the shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pierce {
    /// Geocentric latitude, in radians.
    pub latitude_rad: f64,
    /// Longitude, east positive, in radians.
    pub longitude_rad: f64,
    /// Slant over vertical column.
    pub slant: f64,
}

impl Shell {
    /// Computes the point at which the line from a `user` on the ground towards `look` leaves the shell.
    /// Below the horizon the line crosses the Earth and leaves on the far side, so the result is continuous
    /// at 0°.
    pub fn pierce(&self, user: Geodetic, look: Look) -> Pierce {
        let zenith_angle = |share: f64, height_m: f64| {
            let zenith_rad = share * (FRAC_PI_2 - look.elevation_rad);
            libm::asin(self.radius_m / (self.radius_m + height_m) * libm::sin(zenith_rad))
        };
        let there_rad = zenith_angle(1.0, self.height_m);
        // Angle at the Earth's centre between user and pierce point.
        let (sin_arc, cos_arc) = libm::sincos(FRAC_PI_2 - look.elevation_rad - there_rad);
        let (sin_azimuth, cos_azimuth) = libm::sincos(look.azimuth_rad);
        let (sin_latitude, cos_latitude) = libm::sincos(user.latitude_rad);
        let up = sin_latitude * cos_arc + cos_latitude * sin_arc * cos_azimuth;
        let (east, outward) = (sin_arc * sin_azimuth, cos_latitude * cos_arc - sin_latitude * sin_arc * cos_azimuth);
        let mapped_rad = match self.mapping {
            Mapping::SingleLayer => there_rad,
            Mapping::ModifiedSingleLayer => zenith_angle(MODIFIED_SHARE, MODIFIED_HEIGHT_M),
        };
        Pierce {
            latitude_rad: libm::atan2(up, libm::hypot(east, outward)),
            longitude_rad: user.longitude_rad + libm::atan2(east, outward),
            slant: 1.0 / libm::cos(mapped_rad),
        }
    }
}

/// Source of the vertical electron content.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Constant content everywhere at all times, in TEC units.
    Constant(f64),
    /// Content from maps. The scene's time plus `later_s` is the time in the maps.
    Maps {
        /// The maps of the file.
        maps: Box<Maps>,
        /// Time of the maps minus time of the scene, in seconds.
        later_s: f64,
        /// Method of interpolation between two maps.
        interpolation: Interpolation,
    },
}

/// Ionosphere of given electron content.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellIonosphere {
    /// Vertical content by position and time.
    pub content: Content,
    /// Shell in which the electrons are assumed.
    pub shell: Shell,
}

impl ShellIonosphere {
    /// Slant electron content of a complete crossing, in TEC units.
    pub fn slant_tecu(&self, user: Geodetic, look: Look, at: gnss::time::Epoch) -> f64 {
        let pierce = self.shell.pierce(user, look);
        let vertical_tecu = match &self.content {
            Content::Constant(tecu) => *tecu,
            Content::Maps { maps, later_s, interpolation } => {
                maps.vertical_tecu(pierce.latitude_rad, pierce.longitude_rad, at.plus_s(*later_s), *interpolation)
            }
        };
        pierce.slant * vertical_tecu
    }
}

impl Effect for ShellIonosphere {
    fn name(&self) -> &'static str {
        "ionosphere"
    }

    fn describe(&self) -> String {
        let source = match &self.content {
            Content::Constant(tecu) => format!("{tecu} TECU everywhere"),
            Content::Maps { maps, later_s, interpolation } => {
                let (first, last) = maps.span();
                let how = match interpolation {
                    Interpolation::Bilinear => "bilinear",
                    Interpolation::Bicubic => "bicubic",
                };
                let shifted = if *later_s == 0.0 { String::new() } else { format!(", read {later_s} s later") };
                format!("IONEX maps of {first} to {last}, {how}{shifted}")
            }
        };
        let mapping = match self.shell.mapping {
            Mapping::SingleLayer => "single layer",
            Mapping::ModifiedSingleLayer => "modified single layer",
        };
        format!("{source}, {mapping} at {} km: code delayed, carrier advanced", self.shell.height_m / 1e3)
    }

    fn act(&self, sight: &Sight, signal: &Signal, rays: &mut Vec<Ray>) {
        let slant_tecu = self.slant_tecu(sight.user, sight.look, sight.received) * share_above(sight.user.height_m);
        let carrier_hz = signal.carrier_hz(sight.sv);
        delay_groups(rays, METRES_PER_TECU_HZ2 * slant_tecu / (carrier_hz * carrier_hz) / SPEED_OF_LIGHT_MPS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::link::tests::sight;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::Carrier;

    const SHELL: Shell = Shell { radius_m: EARTH_RADIUS_M, height_m: 450e3, mapping: Mapping::SingleLayer };

    fn look(azimuth_deg: f64, elevation_deg: f64) -> Look {
        Look { azimuth_rad: azimuth_deg.to_radians(), elevation_rad: elevation_deg.to_radians() }
    }

    #[test]
    fn a_unit_of_content_at_the_zenith_is_sixteen_centimetres_on_l1_and_27_on_l2() {
        // 40.3e16 / f²: 0.1624 m at 1575.42 MHz (Misra & Enge), (77/60)² times that at 1227.6 MHz.
        let effect = ShellIonosphere { content: Content::Constant(1.0), shell: SHELL };
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        effect.act(&sight(90.0, 0.0), &L1_CA, &mut rays);
        let delay_m = rays[0].code_delay_s * SPEED_OF_LIGHT_MPS;
        assert!((delay_m - 0.1624).abs() < 5e-5, "{delay_m}");
        assert_eq!(rays[0].carrier_delay_s, -rays[0].code_delay_s);
        let signal = Signal { carrier: Carrier::Common(1_227.6e6), ..L1_CA };
        let mut second = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        effect.act(&sight(90.0, 0.0), &signal, &mut second);
        let ratio = second[0].code_delay_s / rays[0].code_delay_s;
        assert!((ratio - 5929.0 / 3600.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_added_by_an_empty_ionosphere_or_above_it() {
        let before = Ray { code_delay_s: 0.07, carrier_delay_s: 0.07, phase_cycles: 0.3, cn0_hz: 3e4 };
        for (tecu, height_m) in [(0.0, 0.0), (80.0, 1.0e6)] {
            let effect = ShellIonosphere { content: Content::Constant(tecu), shell: SHELL };
            let mut rays = vec![before];
            effect.act(&sight(20.0, height_m), &L1_CA, &mut rays);
            assert_eq!(rays, [before]);
        }
    }

    #[test]
    fn the_pierce_point_is_where_vectors_put_it() {
        // The straight line from a sphere's surface, by vectors instead of by spherical triangles.
        for (latitude, longitude, azimuth, elevation) in [
            (26.5, 80.2, 33.0, 5.0),
            (-70.0, -179.0, 250.0, 15.0),
            (89.9, 10.0, 0.0, 20.0),
            (0.0, 0.0, 90.0, 89.0),
            (45.0, 5.0, 180.0, -4.0),
        ] {
            let user = Geodetic::from_degrees(latitude, longitude, 0.0);
            let (radius, shell) = (SHELL.radius_m, SHELL.radius_m + SHELL.height_m);
            let axes = user.ecef_to_enu();
            let direction = look(azimuth, elevation);
            let (sin, cos) = libm::sincos(direction.elevation_rad);
            let (east, north) = libm::sincos(direction.azimuth_rad);
            let enu = nalgebra::Vector3::new(cos * east, cos * north, sin);
            let (from, along) = (axes.transpose() * nalgebra::Vector3::new(0.0, 0.0, radius), axes.transpose() * enu);
            let half = from.dot(&along);
            let distance = -half + (half * half + shell * shell - radius * radius).sqrt();
            let point = from + along * distance;
            let found = SHELL.pierce(user, direction);
            assert!((found.latitude_rad - libm::asin(point.z / shell)).abs() < 1e-9, "{latitude}");
            let turn = found.longitude_rad - libm::atan2(point.y, point.x);
            assert!((turn / std::f64::consts::TAU - (turn / std::f64::consts::TAU).round()).abs() < 1e-9, "{latitude}");
            // Cosine between the line and the shell's normal.
            assert!((found.slant - shell / point.dot(&along)).abs() < 1e-9 * found.slant);
        }
    }

    #[test]
    fn the_two_mappings_agree_at_the_zenith_and_part_towards_the_horizon() {
        let user = Geodetic::from_degrees(26.5, 80.2, 0.0);
        let modified = Shell { mapping: Mapping::ModifiedSingleLayer, ..SHELL };
        let slants = |elevation: f64| {
            (SHELL.pierce(user, look(0.0, elevation)).slant, modified.pierce(user, look(0.0, elevation)).slant)
        };
        assert_eq!(slants(90.0), (1.0, 1.0));
        // sin z' = 6371/6821 and 6371/6877.7 · sin(0.9782 · 90°): closed forms.
        let (single, modified) = slants(0.0);
        assert!((single - 2.79954).abs() < 1e-5, "{single}");
        assert!((modified - 2.64513).abs() < 1e-5, "{modified}");
    }
}
