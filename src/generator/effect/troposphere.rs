//! Neutral atmosphere: hydrostatic and wet zenith delays, each mapped to the line of sight.
//!
//! Sources: Davis et al. 1985 (hydrostatic, with Saastamoinen's gravity term), Saastamoinen 1972 (wet), the
//! Magnus formula with 237.3 °C; mapping functions are in [`super::mapping`]. Weather is the scene's, which
//! follows the standard atmosphere from a reference height, or GPT3's by position and season with the wet
//! delay of Askne & Nordius 1987. A ray that comes from below the horizon passes a lowest point: its delay is
//! twice that along the horizon there less that of the ray which leaves upwards at the same angle, which is
//! exact for air in spherical layers and a straight ray. Against traced rays, which bend, the delay is 3 %
//! high at −1°, 7 % at −2° and 12 % at −3° for users at 5 km and 10 km, and within 1 % at and above the
//! horizon. Where the Earth stands in the way the lowest point stays near the ground, for the scene's mask
//! decides what is received. A user in space sees only satellites whose rays pass above the atmosphere: there
//! the delay is zero. Limits: above 44.3 km the pressure of the standard atmosphere, and so the zenith delay,
//! is zero; GPT3's fades there.

use crate::effect::ionosphere::smooth;
use crate::effect::mapping::{Mapping, season_day};
use crate::ray::{Effect, Ray, SPACE_M, Sight};
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
/// Height in metres above which what GPT3 states fades away: its own decay leaves 0.4 % of the delay there.
const FADE_M: f64 = 40e3;
/// Height in metres above which there is no neutral atmosphere: a user in space sees what passes above it.
pub const TOP_M: f64 = 50e3;
/// Mean radius of the Earth, and by how much air bends a ray that grazes the ground: half a degree.
const EARTH_RADIUS_M: f64 = 6_371e3;
const BENT_RAD: f64 = 8.7e-3;
/// Depth below the ground that bounds the angle of a ray from higher up, in metres.
const DEPTH_M: f64 = 2e3;

/// Weather at a height, from which that at every other height follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weather {
    /// Height in metres of pressure, temperature and humidity, below 44 km.
    pub height_m: f64,
    /// Total pressure, in hPa.
    pub pressure_hpa: f64,
    /// Temperature.
    pub temperature_k: f64,
    /// Relative humidity, 0 to 1, equal at every height.
    pub relative_humidity: f64,
}

impl Weather {
    /// Weather of the standard atmosphere at sea level, half saturated.
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

/// Saturation pressure of water vapour, in hPa (Magnus; Tetens 1930).
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

/// Source of pressure, temperature and humidity.
#[derive(Clone, Debug, PartialEq)]
pub enum Air {
    /// One weather, and the standard atmosphere's change with height.
    Weather(Weather),
    /// A climatology by position and season.
    Gpt3(Box<Gpt3>),
}

/// Effect of zenith delays times mapping functions, equal for code and carrier.
#[derive(Clone, Debug, PartialEq)]
pub struct Troposphere {
    /// Source of the zenith delays.
    pub air: Air,
    /// Mapping function from zenith to slant delays.
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

    /// Slant delay in metres. `elevation_rad` is the elevation of the straight line, also below the horizon.
    /// Zero from [`SPACE_M`] on.
    pub fn delay_m(&self, user: Geodetic, elevation_rad: f64, at: Epoch) -> f64 {
        if user.height_m >= SPACE_M {
            return 0.0;
        }
        if elevation_rad >= 0.0 {
            return self.upward_m(user, elevation_rad, at);
        }
        let (below_rad, height_m) = lowest_point(user.height_m, -elevation_rad);
        2.0 * self.upward_m(Geodetic { height_m, ..user }, 0.0, at) - self.upward_m(user, below_rad, at)
    }

    /// Slant delay in metres of a ray from the horizon or above.
    fn upward_m(&self, user: Geodetic, elevation_rad: f64, at: Epoch) -> f64 {
        let (zenith_hydrostatic_m, zenith_wet_m) = self.zenith_m(user, at);
        if zenith_hydrostatic_m <= 0.0 {
            return 0.0;
        }
        let (hydrostatic, wet) = self.mapping.factors(user, elevation_rad, at);
        hydrostatic * zenith_hydrostatic_m + wet * zenith_wet_m
    }
}

/// Bounded angle below the horizon and height of the lowest point, for a ray from below the horizon. Beyond
/// the ray that grazes the ground the angle stays within [`BENT_RAD`], and less from a height whence this
/// would lead deeper than [`DEPTH_M`].
fn lowest_point(height_m: f64, below_rad: f64) -> (f64, f64) {
    let radius_m = EARTH_RADIUS_M + height_m;
    let grazing_rad = libm::acos((EARTH_RADIUS_M / radius_m).min(1.0));
    // Depth that each radian beyond the grazing ray adds.
    let slope_m = radius_m * libm::sin(grazing_rad);
    let bent_rad = 1.0 / libm::hypot(1.0 / BENT_RAD, slope_m / DEPTH_M);
    let beyond = ((below_rad - grazing_rad) / bent_rad).max(0.0);
    let angle_rad = below_rad.min(grazing_rad) + bent_rad * (1.0 - libm::exp(-beyond));
    let half_sine = libm::sin(angle_rad / 2.0);
    (angle_rad, height_m - 2.0 * radius_m * half_sine * half_sine)
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
        for height_m in [-400.0, 0.0, 100.0, 3e3, 1.1e4, 3e4, 5e4, 9.9e4] {
            let mut before = f64::INFINITY;
            for elevation in [-90.0, -10.0, -5.0, -3.0, -1.0, -0.1, 0.0, 0.1, 1.0, 2.0, 5.0, 10.0, 45.0, 90.0] {
                let now = delay(height_m, elevation);
                assert!(now >= 0.0 && now <= before && now < 400.0, "{height_m} {elevation}: {now}");
                before = now;
            }
        }
    }

    #[test]
    fn a_user_in_space_has_no_delay_and_below_that_no_ray_leads_deep_into_the_ground() {
        let model = Troposphere { air: Air::Weather(Weather::STANDARD), mapping: Mapping::Niell };
        let at = Epoch::from_week(1590, 0.0);
        for height_m in [SPACE_M, 2.02e7, 5.4e8] {
            for elevation in [-90.0, -89.35, -76.0, -8.0, 0.0, 30.0] {
                let user = Geodetic::from_degrees(26.5, 80.2, height_m);
                assert_eq!(model.delay_m(user, f64::to_radians(elevation), at), 0.0, "{height_m} {elevation}");
            }
        }
        for height_m in [0.0, 100.0, 5e3, 3e4, 9.9e4] {
            let (_, lowest_m) = lowest_point(height_m, std::f64::consts::FRAC_PI_2);
            // What the angle's bound adds to the depth: R/2 of its square.
            let depth_m = DEPTH_M + 0.5 * EARTH_RADIUS_M * BENT_RAD * BENT_RAD;
            assert!((-depth_m..0.0).contains(&lowest_m), "{height_m}: {lowest_m}");
        }
    }

    /// Height, elevation, and by how many metres a ray through the dry standard atmosphere is longer than the
    /// straight line. Another program traced them: Snell's law in spherical layers (n r cos e is constant), n
    /// − 1 = 77.604e-6 p/T, 6371 km, 20 000 steps to 100 km, the elevation at the user iterated until the ray
    /// leaves in the straight line's direction. The last column is by what part the model may differ, as its
    /// module states.
    const TRACED: [(f64, f64, f64, f64); 25] = [
        (0.0, 10.0, 12.7820, 0.005),
        (0.0, 5.0, 23.3291, 0.005),
        (0.0, 3.0, 33.7205, 0.005),
        (0.0, 2.0, 42.4945, 0.01),
        (0.0, 1.0, 55.8156, 0.01),
        (0.0, 0.5, 65.1268, 0.01),
        (0.0, 0.0, 76.9846, 0.01),
        (5000.0, 5.0, 12.5806, 0.005),
        (5000.0, 3.0, 18.3757, 0.005),
        (5000.0, 2.0, 23.3910, 0.01),
        (5000.0, 1.0, 31.2218, 0.01),
        (5000.0, 0.5, 36.8420, 0.01),
        (5000.0, 0.0, 44.1582, 0.01),
        (5000.0, -0.5, 53.7977, 0.03),
        (5000.0, -1.0, 66.6254, 0.03),
        (5000.0, -2.0, 106.9640, 0.07),
        (10000.0, 3.0, 9.1326, 0.01),
        (10000.0, 2.0, 11.7244, 0.01),
        (10000.0, 1.0, 15.8962, 0.01),
        (10000.0, 0.5, 18.9913, 0.01),
        (10000.0, 0.0, 23.1447, 0.01),
        (10000.0, -0.5, 28.8033, 0.03),
        (10000.0, -1.0, 36.5906, 0.03),
        (10000.0, -2.0, 62.4487, 0.07),
        (10000.0, -3.0, 112.8327, 0.125),
    ];

    fn dry() -> Troposphere {
        let weather = Weather { relative_humidity: 0.0, ..Weather::STANDARD };
        Troposphere { air: Air::Weather(weather), mapping: Mapping::Niell }
    }

    #[test]
    fn delays_near_and_below_the_horizon_are_those_of_traced_rays() {
        let at = Epoch::from_week(1590, 0.0);
        for (height_m, elevation, traced_m, part) in TRACED {
            let user = Geodetic::from_degrees(45.0, 0.0, height_m);
            let found_m = dry().delay_m(user, f64::to_radians(elevation), at);
            println!("{height_m} {elevation}: {found_m:.3} {traced_m} {:.4}", found_m / traced_m - 1.0);
            assert!((found_m / traced_m - 1.0).abs() < part, "{height_m} {elevation}: {found_m} {traced_m}");
        }
    }

    #[test]
    fn the_delay_s_slope_takes_no_step_on_the_way_through_the_horizon() {
        let at = Epoch::from_week(1590, 0.0);
        for mapping in [Mapping::Niell, Mapping::Cosecant] {
            let model = Troposphere { mapping, ..dry() };
            for height_m in [0.0, 100.0, 3e3, 1e4, 3e4] {
                let user = Geodetic::from_degrees(45.0, 0.0, height_m);
                let delay_m = |elevation: f64| model.delay_m(user, f64::to_radians(elevation), at);
                // Metres a degree, over a thousandth of one.
                let slopes: Vec<f64> = (-9000..9000)
                    .map(|k| f64::from(k) * 1e-3)
                    .map(|e| (delay_m(e + 1e-3) - delay_m(e)) * 1e3)
                    .collect();
                let steepest = slopes.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
                let step = slopes.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
                // Curvature over the least angle on which anything changes, half a degree of 0.001°.
                println!("{height_m}: steepest {steepest}, step {step}");
                assert!(steepest.is_finite() && step < 0.01 * steepest, "{height_m}: {steepest} {step}");
            }
        }
    }
}
