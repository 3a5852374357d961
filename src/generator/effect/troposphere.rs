//! The neutral atmosphere: hydrostatic and wet zenith delays, each brought to the line of sight by its
//! mapping function.
//!
//! Sources: Davis et al. 1985 (hydrostatic, with Saastamoinen's gravity term), Saastamoinen 1972 (wet), the
//! Magnus formula with 237.3 °C; mapping functions are in [`super::mapping`]. Weather is the scene's, which
//! follows the standard atmosphere from a reference height, or GPT3's by place and season with the wet delay
//! of Askne & Nordius 1987. Limits: above 44.3 km the pressure of the standard atmosphere, and so the delay,
//! is zero; GPT3's fades there.

use crate::effect::ionosphere::smooth;
use crate::effect::mapping::{Mapping, season_day};
use crate::ray::{Effect, Ray, Sight};
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::signal::Signal;
use gnss::time::Epoch;
use gnss::vienna::{self, Gpt3};

/// Standard atmosphere: relative loss of pressure base per metre, exponent, lapse rate (ICAO Doc 7488).
const PRESSURE_LAPSE_PM: f64 = 2.2557e-5;
const PRESSURE_EXPONENT: f64 = 5.2568;
const TEMPERATURE_LAPSE_KPM: f64 = 6.5e-3;
const TROPOPAUSE_M: f64 = 11_000.0;
const CELSIUS_K: f64 = 273.15;
/// Heights between which what GPT3 says fades away: its own decay leaves 0.4 % of the delay there.
const FADE_M: f64 = 40e3;
const TOP_M: f64 = 50e3;

/// Weather at a height, from which that at every other height follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weather {
    /// Height at which the next three were measured, below 44 km.
    pub height_m: f64,
    /// Total pressure, in hPa.
    pub pressure_hpa: f64,
    /// Temperature.
    pub temperature_k: f64,
    /// 0 to 1, the same at every height.
    pub relative_humidity: f64,
}

impl Weather {
    /// Sea level of the standard atmosphere, half saturated.
    pub const STANDARD: Self =
        Self { height_m: 0.0, pressure_hpa: 1013.25, temperature_k: 288.15, relative_humidity: 0.5 };

    /// Pressure (hPa), temperature (K) and water vapour pressure (hPa) at `height_m`.
    pub fn at(&self, height_m: f64) -> (f64, f64, f64) {
        let base = |height_m: f64| (1.0 - PRESSURE_LAPSE_PM * height_m).max(0.0);
        let pressure_hpa = if height_m == self.height_m {
            self.pressure_hpa
        } else {
            self.pressure_hpa * libm::pow(base(height_m) / base(self.height_m), PRESSURE_EXPONENT)
        };
        let climbed_m = height_m.min(TROPOPAUSE_M) - self.height_m.min(TROPOPAUSE_M);
        let temperature_k = self.temperature_k - TEMPERATURE_LAPSE_KPM * climbed_m;
        // No more vapour than air.
        let vapour_hpa = (self.relative_humidity * saturation_hpa(temperature_k)).min(pressure_hpa);
        (pressure_hpa, temperature_k, vapour_hpa)
    }
}

/// Saturation pressure of water vapour (Magnus; Tetens 1930).
pub fn saturation_hpa(temperature_k: f64) -> f64 {
    let celsius = temperature_k - CELSIUS_K;
    6.1078 * libm::pow(10.0, 7.5 * celsius / (celsius + 237.3))
}

/// Zenith hydrostatic delay in metres (Davis et al. 1985, appendix A).
pub fn zenith_hydrostatic_m(user: Geodetic, pressure_hpa: f64) -> f64 {
    let gravity = 1.0 - 0.00266 * libm::cos(2.0 * user.latitude_rad) - 0.00028e-3 * user.height_m;
    planted!("generator.troposphere.zenith", 0.002_276_8, 0.002_32) * pressure_hpa / gravity
}

/// Zenith wet delay in metres (Saastamoinen 1972).
pub fn zenith_wet_m(temperature_k: f64, vapour_hpa: f64) -> f64 {
    0.002_277 * (1255.0 / temperature_k + 0.05) * vapour_hpa
}

/// Where pressure, temperature and humidity come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Air {
    /// One weather, and the standard atmosphere's change with height.
    Weather(Weather),
    /// A climatology by place and season.
    Gpt3(Box<Gpt3>),
}

/// Zenith delays × mapping functions, the same for code and carrier.
#[derive(Clone, Debug, PartialEq)]
pub struct Troposphere {
    /// Zenith delays of the air.
    pub air: Air,
    /// From zenith to slant delays.
    pub mapping: Mapping,
}

impl Troposphere {
    /// Hydrostatic and wet zenith delays in metres.
    pub fn zenith_m(&self, user: Geodetic, at: Epoch) -> (f64, f64) {
        match &self.air {
            Air::Weather(weather) => {
                let (pressure_hpa, temperature_k, vapour_hpa) = weather.at(user.height_m);
                if pressure_hpa <= 0.0 {
                    return (0.0, 0.0);
                }
                (zenith_hydrostatic_m(user, pressure_hpa), zenith_wet_m(temperature_k, vapour_hpa))
            }
            Air::Gpt3(gpt3) => {
                let weather = gpt3.at(user.latitude_rad, user.longitude_rad, user.height_m, season_day(at));
                let left = 1.0 - smooth((user.height_m - FADE_M) / (TOP_M - FADE_M));
                (zenith_hydrostatic_m(user, weather.pressure_hpa) * left, vienna::zenith_wet_m(&weather) * left)
            }
        }
    }

    /// Slant delay in metres.
    pub fn delay_m(&self, user: Geodetic, elevation_rad: f64, at: Epoch) -> f64 {
        let (zenith_hydrostatic_m, zenith_wet_m) = self.zenith_m(user, at);
        if zenith_hydrostatic_m <= 0.0 {
            return 0.0;
        }
        let (hydrostatic, wet) = self.mapping.factors(user, elevation_rad, at);
        hydrostatic * zenith_hydrostatic_m + wet * zenith_wet_m
    }
}

impl Effect for Troposphere {
    fn name(&self) -> &'static str {
        "troposphere"
    }

    fn describe(&self) -> String {
        let mapping = self.mapping.describe();
        match &self.air {
            Air::Weather(weather) => format!(
                "Saastamoinen: {} hPa, {:.2} K, humidity {}, at {} m; {mapping}",
                weather.pressure_hpa, weather.temperature_k, weather.relative_humidity, weather.height_m
            ),
            Air::Gpt3(_) => format!("Saastamoinen with GPT3's pressure and vapour; {mapping}"),
        }
    }

    fn act(&self, sight: &Sight, _signal: &Signal, rays: &mut Vec<Ray>) {
        let delay_s = self.delay_m(sight.user, sight.look.elevation_rad, sight.received) / SPEED_OF_LIGHT_MPS;
        for ray in rays {
            ray.code_delay_s += delay_s;
            ray.carrier_delay_s += planted!("generator.troposphere.carrier_sign", delay_s, -delay_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zenith_delays_are_those_of_an_independent_program() {
        // Latitude, height, pressure, °C, humidity -> hydrostatic, wet; printed to 1e-6 m.
        let cases = [
            (45.0, 0.0, 1013.25, 15.0, 0.5, 2.306_968, 0.085_526),
            (26.5, 130.0, 998.0, 35.0, 0.8, 2.275_973, 0.422_210),
            (0.0, 0.0, 1013.25, 30.0, 0.9, 2.313_121, 0.364_285),
            (60.0, 2000.0, 795.0, 0.0, 0.5, 1.808_663, 0.032_297),
        ];
        for (latitude, height_m, pressure_hpa, celsius, relative_humidity, dry, wet) in cases {
            let user = Geodetic::from_degrees(latitude, 0.0, height_m);
            let weather = Weather { height_m, pressure_hpa, temperature_k: celsius + CELSIUS_K, relative_humidity };
            let (pressure_hpa, temperature_k, vapour_hpa) = weather.at(height_m);
            assert!((zenith_hydrostatic_m(user, pressure_hpa) - dry).abs() < 1e-6);
            assert!((zenith_wet_m(temperature_k, vapour_hpa) - wet).abs() < 1e-6);
        }
    }

    #[test]
    fn the_delay_falls_with_height_and_elevation_and_never_leaves_reason() {
        let model = Troposphere { air: Air::Weather(Weather::STANDARD), mapping: Mapping::Niell };
        let at = Epoch::from_week(1590, 0.0);
        let delay = |height_m: f64, elevation: f64| {
            model.delay_m(Geodetic::from_degrees(26.5, 80.2, height_m), f64::to_radians(elevation), at)
        };
        let mut before = f64::INFINITY;
        for height in [-400.0, 0.0, 1e3, 5e3, 1.1e4, 2e4, 3e4, 4e4, 4.4e4, 4.5e4, 2e7] {
            let now = delay(height, 20.0);
            assert!(now >= 0.0 && now <= before, "{height}: {now}");
            before = now;
        }
        assert_eq!(before, 0.0);
        let mut before = f64::INFINITY;
        for elevation in [-90.0, -5.0, -1.0, 0.0, 1.0, 2.0, 5.0, 10.0, 45.0, 90.0] {
            let now = delay(100.0, elevation);
            assert!(now > 2.3 && now <= before && now < 70.0, "{elevation}: {now}");
            before = now;
        }
    }
}
