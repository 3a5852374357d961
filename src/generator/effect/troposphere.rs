//! The neutral atmosphere: zenith delays after Saastamoinen, brought to the line of sight by Niell's mapping functions.
//!
//! Sources: Davis et al. 1985 (hydrostatic, with Saastamoinen's gravity term), Saastamoinen 1972 (wet),
//! Niell 1996 (NMF), the Magnus formula with 237.3 °C. Weather below the tropopause follows the standard
//! atmosphere from a reference height. Limits: elevations below [`LOWEST_RAD`] take its mapping, where
//! the continued fractions still make sense; above 44.3 km the pressure, and so the delay, is zero.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::generator::ray::{Effect, Ray, Sight};
use crate::gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use crate::gnss::signal::Signal;
use crate::gnss::time::Epoch;

/// Elevation below which the mapping no longer grows: 1°. NMF was fitted from 3° up.
pub const LOWEST_RAD: f64 = PI / 180.0;
/// Standard atmosphere: relative loss of pressure base per metre, exponent, lapse rate (ICAO Doc 7488).
const PRESSURE_LAPSE_PM: f64 = 2.2557e-5;
const PRESSURE_EXPONENT: f64 = 5.2568;
const TEMPERATURE_LAPSE_KPM: f64 = 6.5e-3;
const TROPOPAUSE_M: f64 = 11_000.0;
const CELSIUS_K: f64 = 273.15;
const YEAR_DAYS: f64 = 365.25;

/// Weather at a height, from which that at every other height follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weather {
    /// Height at which the next three were measured, below 44 km.
    pub height_m: f64,
    pub pressure_hpa: f64,
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
    0.002_276_8 * pressure_hpa / gravity
}

/// Zenith wet delay in metres (Saastamoinen 1972).
pub fn zenith_wet_m(temperature_k: f64, vapour_hpa: f64) -> f64 {
    0.002_277 * (1255.0 / temperature_k + 0.05) * vapour_hpa
}

/// Niell's hydrostatic and wet mapping factors at an elevation, by place and day of year (from 1.0).
///
/// Niell 1996, equations 4 to 6 and tables 3 and 4; the factors hold still below [`LOWEST_RAD`].
pub fn niell(user: Geodetic, elevation_rad: f64, day_of_year: f64) -> (f64, f64) {
    let sin = libm::sin(elevation_rad.clamp(LOWEST_RAD, FRAC_PI_2));
    let south_days = if user.latitude_rad < 0.0 { YEAR_DAYS / 2.0 } else { 0.0 };
    let season = libm::cos(TAU * (day_of_year - 28.0 + south_days) / YEAR_DAYS);
    let latitude_deg = user.latitude_rad.abs().to_degrees();
    let dry = [0, 1, 2].map(|k| {
        interpolate(&HYDROSTATIC_AVERAGE[k], latitude_deg)
            - interpolate(&HYDROSTATIC_AMPLITUDE[k], latitude_deg) * season
    });
    let wet = [0, 1, 2].map(|k| interpolate(&WET[k], latitude_deg));
    let height_correction = (1.0 / sin - herring(sin, HEIGHT)) * user.height_m * 1e-3;
    (herring(sin, dry) + height_correction, herring(sin, wet))
}

/// Columns are latitudes 15°, 30°, 45°, 60°, 75°; rows a, b, c.
const HYDROSTATIC_AVERAGE: [[f64; 5]; 3] = [
    [1.2769934e-3, 1.2683230e-3, 1.2465397e-3, 1.2196049e-3, 1.2045996e-3],
    [2.9153695e-3, 2.9152299e-3, 2.9288445e-3, 2.9022565e-3, 2.9024912e-3],
    [62.610505e-3, 62.837393e-3, 63.721774e-3, 63.824265e-3, 64.258455e-3],
];
const HYDROSTATIC_AMPLITUDE: [[f64; 5]; 3] = [
    [0.0, 1.2709626e-5, 2.6523662e-5, 3.4000452e-5, 4.1202191e-5],
    [0.0, 2.1414979e-5, 3.0160779e-5, 7.2562722e-5, 11.723375e-5],
    [0.0, 9.0128400e-5, 4.3497037e-5, 84.795348e-5, 170.37206e-5],
];
const WET: [[f64; 5]; 3] = [
    [5.8021897e-4, 5.6794847e-4, 5.8118019e-4, 5.9727542e-4, 6.1641693e-4],
    [1.4275268e-3, 1.5138625e-3, 1.4572752e-3, 1.5007428e-3, 1.7599082e-3],
    [4.3472961e-2, 4.6729510e-2, 4.3908931e-2, 4.4626982e-2, 5.4736038e-2],
];
const HEIGHT: [f64; 3] = [2.53e-5, 5.49e-3, 1.14e-3];

fn interpolate(row: &[f64; 5], latitude_deg: f64) -> f64 {
    let place = ((latitude_deg - 15.0) / 15.0).clamp(0.0, 4.0);
    let left = (place as usize).min(3);
    let share = place - left as f64;
    match (row.get(left), row.get(left + 1)) {
        (Some(a), Some(b)) => a * (1.0 - share) + b * share,
        _ => f64::NAN,
    }
}

fn herring(sin: f64, [a, b, c]: [f64; 3]) -> f64 {
    (1.0 + a / (1.0 + b / (1.0 + c))) / (sin + a / (sin + b / (sin + c)))
}

/// Days into a mean year, 1.0 on the first of January of 1980. Within 0.8 days of the calendar, and
/// without its step at the turn of the year.
fn season_day(at: Epoch) -> f64 {
    (at.seconds() as f64 / 86_400.0 + 6.0).rem_euclid(YEAR_DAYS)
}

/// Saastamoinen's zenith delays × Niell's mapping functions, the same for code and carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saastamoinen {
    pub weather: Weather,
}

impl Saastamoinen {
    /// Slant delay in metres.
    pub fn delay_m(&self, user: Geodetic, elevation_rad: f64, at: Epoch) -> f64 {
        let (pressure_hpa, temperature_k, vapour_hpa) = self.weather.at(user.height_m);
        if pressure_hpa <= 0.0 {
            return 0.0;
        }
        let (hydrostatic, wet) = niell(user, elevation_rad, season_day(at));
        hydrostatic * zenith_hydrostatic_m(user, pressure_hpa) + wet * zenith_wet_m(temperature_k, vapour_hpa)
    }
}

impl Effect for Saastamoinen {
    fn name(&self) -> &'static str {
        "troposphere"
    }

    fn act(&self, sight: &Sight, _signal: &Signal, rays: &mut Vec<Ray>) {
        let delay_s = self.delay_m(sight.user, sight.look.elevation_rad, sight.received) / SPEED_OF_LIGHT_MPS;
        for ray in rays {
            ray.code_delay_s += delay_s;
            ray.carrier_delay_s += delay_s;
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
    fn mapping_factors_are_those_of_an_independent_program() {
        let cases = [
            (28.0, 45.0, 0.0, 5.0, 10.151_761_745, 10.750_884_210),
            (210.5, 26.5, 130.0, 10.0, 5.546_867_982, 5.658_966_023),
            (100.0, -33.0, 2000.0, 15.0, 3.801_567_919, 3.833_858_129),
            (200.0, 80.0, 0.0, 3.0, 14.653_174_860, 16.323_500_496),
        ];
        for (day, latitude, height_m, elevation, dry, wet) in cases {
            let user = Geodetic::from_degrees(latitude, 0.0, height_m);
            let found = niell(user, f64::to_radians(elevation), day);
            assert!((found.0 - dry).abs() < 1e-8 && (found.1 - wet).abs() < 1e-8, "{found:?} {dry} {wet}");
        }
    }

    #[test]
    fn the_delay_falls_with_height_and_elevation_and_never_leaves_reason() {
        let model = Saastamoinen { weather: Weather::STANDARD };
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

    #[test]
    fn the_season_stays_near_the_calendar_and_takes_no_step() {
        for text in ["1980-01-06T00:00:00", "2010-07-01T00:00:00", "2026-12-31T12:00:00", "2100-01-01T00:00:00"] {
            let at = Epoch::parse(text).unwrap();
            let apart = season_day(at) - at.day_of_year();
            // Quarter days of leap years, and the day that 2100 lacks.
            assert!(apart.abs() < 1.8 || apart.abs() > YEAR_DAYS - 1.8, "{text}: {apart}");
        }
    }
}
