//! The receiver's own troposphere: a standard atmosphere at the antenna's height, Saastamoinen's zenith
//! delays and Niell's mapping functions.
//!
//! Source: J. Saastamoinen, Bulletin Géodésique 107 (1973), in the form of J. L. Davis et al., Radio Science 20
//! (1985); A. E. Niell, J. Geophys. Res. 101 B2 (1996), tables 3 and 4. Written apart from the generator's on
//! purpose. Limits: elevations below 3° are mapped as 3°; above 30 km there is no delay.

use crate::gnss::earth::Geodetic;

/// Relative humidity that the receiver assumes.
const RELATIVE_HUMIDITY: f64 = 0.5;
/// Above this the remaining air delays by less than 3 cm at the zenith.
const CEILING_M: f64 = 30_000.0;
/// Below this Niell's functions are extrapolations.
const LOWEST_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// Latitudes of the rows below, every 15° from 15°.
const AVERAGE: [[f64; 3]; 5] = [
    [1.276_993_4e-3, 2.915_369_5e-3, 62.610_505e-3],
    [1.268_323_0e-3, 2.915_229_9e-3, 62.837_393e-3],
    [1.246_539_7e-3, 2.928_844_5e-3, 63.721_774e-3],
    [1.219_604_9e-3, 2.902_256_5e-3, 63.824_265e-3],
    [1.204_599_6e-3, 2.902_491_2e-3, 64.258_455e-3],
];
const AMPLITUDE: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1.270_962_6e-5, 2.141_497_9e-5, 9.012_840_0e-5],
    [2.652_366_2e-5, 3.016_077_9e-5, 4.349_703_7e-5],
    [3.400_045_2e-5, 7.256_272_2e-5, 84.795_348e-5],
    [4.120_219_1e-5, 11.723_375e-5, 170.372_06e-5],
];
const WET: [[f64; 3]; 5] = [
    [5.802_189_7e-4, 1.427_526_8e-3, 4.347_296_1e-2],
    [5.679_484_7e-4, 1.513_862_5e-3, 4.672_951_0e-2],
    [5.811_801_9e-4, 1.457_275_2e-3, 4.390_893_1e-2],
    [5.972_754_2e-4, 1.500_742_8e-3, 4.462_698_2e-2],
    [6.164_169_3e-4, 1.759_908_2e-3, 5.473_603_8e-2],
];
/// Height correction of the hydrostatic function.
const HEIGHT: [f64; 3] = [2.53e-5, 5.49e-3, 1.14e-3];

/// Delay in metres along a line of sight at `elevation_rad`, on `day_of_year` (1.0 is the first of January, 00:00).
pub fn delay_m(user: Geodetic, elevation_rad: f64, day_of_year: f64) -> f64 {
    if user.height_m > CEILING_M {
        return 0.0;
    }
    let (hydrostatic_m, wet_m) = zenith_m(user);
    let (hydrostatic, wet) = mapping(user, elevation_rad, day_of_year);
    hydrostatic * hydrostatic_m + wet * wet_m
}

/// Hydrostatic and wet zenith delays of the standard atmosphere.
fn zenith_m(user: Geodetic) -> (f64, f64) {
    let height_m = user.height_m.max(-1000.0);
    let pressure_hpa = 1013.25 * libm::pow((1.0 - 2.2557e-5 * height_m).max(0.0), 5.2568);
    let celsius = 15.0 - 6.5e-3 * height_m;
    let vapour_hpa = RELATIVE_HUMIDITY * 6.1078 * libm::pow(10.0, 7.5 * celsius / (celsius + 237.3));
    saastamoinen_m(user.latitude_rad, height_m, pressure_hpa, celsius + 273.15, vapour_hpa)
}

fn saastamoinen_m(latitude_rad: f64, height_m: f64, pressure_hpa: f64, kelvin: f64, vapour_hpa: f64) -> (f64, f64) {
    let gravity = 1.0 - 0.00266 * libm::cos(2.0 * latitude_rad) - 0.000_28 * height_m * 1e-3;
    (0.002_276_8 * pressure_hpa / gravity, 0.002_277 * (1255.0 / kelvin + 0.05) * vapour_hpa)
}

/// Niell's hydrostatic and wet mapping functions.
fn mapping(user: Geodetic, elevation_rad: f64, day_of_year: f64) -> (f64, f64) {
    let sin_elevation = libm::sin(elevation_rad.max(LOWEST_RAD));
    let south = if user.latitude_rad < 0.0 { 0.5 } else { 0.0 };
    let season = libm::cos(std::f64::consts::TAU * ((day_of_year - 28.0) / 365.25 + south));
    let latitude_deg = user.latitude_rad.to_degrees().abs();
    let average = at_latitude(&AVERAGE, latitude_deg);
    let amplitude = at_latitude(&AMPLITUDE, latitude_deg);
    let hydrostatic: [f64; 3] = std::array::from_fn(|k| average[k] - amplitude[k] * season);
    let height_km = user.height_m * 1e-3;
    let correction = (1.0 / sin_elevation - herring(sin_elevation, HEIGHT)) * height_km;
    (herring(sin_elevation, hydrostatic) + correction, herring(sin_elevation, at_latitude(&WET, latitude_deg)))
}

/// The continued fraction of J. W. Marini as normalised by T. A. Herring.
fn herring(sin_elevation: f64, [a, b, c]: [f64; 3]) -> f64 {
    (1.0 + a / (1.0 + b / (1.0 + c))) / (sin_elevation + a / (sin_elevation + b / (sin_elevation + c)))
}

fn at_latitude(table: &[[f64; 3]; 5], latitude_deg: f64) -> [f64; 3] {
    let place = ((latitude_deg - 15.0) / 15.0).clamp(0.0, 4.0);
    let row = (place as usize).min(3);
    let share = place - row as f64;
    std::array::from_fn(|k| table[row][k] * (1.0 - share) + table[row + 1][k] * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mapping_functions_take_niell_s_values() {
        // Computed with the tables of Niell (1996) by another program; the last digit printed is the tolerance.
        for (day, latitude, height_m, elevation, hydrostatic, wet) in [
            (28.0, 45.0, 0.0, 5.0_f64, 10.151_761_745, 10.750_884_210),
            (210.5, 26.5, 130.0, 10.0, 5.546_867_982, 5.658_966_023),
            (100.0, -33.0, 2000.0, 15.0, 3.801_567_919, 3.833_858_129),
            (200.0, 80.0, 0.0, 3.0, 14.653_174_860, 16.323_500_496),
        ] {
            let got = mapping(Geodetic::from_degrees(latitude, 0.0, height_m), elevation.to_radians(), day);
            assert!((got.0 - hydrostatic).abs() < 1e-8 && (got.1 - wet).abs() < 1e-8, "{got:?}");
        }
    }

    #[test]
    fn zenith_delays_take_the_published_model_s_values() {
        for (latitude, height_m, pressure, celsius, humidity, hydrostatic, wet) in [
            (45.0_f64, 0.0, 1013.25, 15.0, 0.5, 2.306_968, 0.085_526),
            (26.5, 130.0, 998.0, 35.0, 0.8, 2.275_973, 0.422_210),
            (60.0, 2000.0, 795.0, 0.0, 0.5, 1.808_663, 0.032_297),
        ] {
            let vapour = humidity * 6.1078 * libm::pow(10.0, 7.5 * celsius / (celsius + 237.3));
            let got = saastamoinen_m(latitude.to_radians(), height_m, pressure, celsius + 273.15, vapour);
            assert!((got.0 - hydrostatic).abs() < 1e-6 && (got.1 - wet).abs() < 1e-6, "{got:?}");
        }
        assert_eq!(delay_m(Geodetic::from_degrees(0.0, 0.0, 4e5), 0.1, 1.0), 0.0);
    }
}
