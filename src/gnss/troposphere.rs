//! Model of the neutral atmosphere as receivers have it: a standard atmosphere, half saturated, and Niell's
//! mapping.
//!
//! Sources: zenith delays after Saastamoinen 1972 and Davis et al. 1985, Magnus' saturation pressure, mapping
//! functions of Niell 1996 (tables 3 and 4). The receiver knows no weather, so true delays differ from it by
//! several centimetres at the zenith. Below 2° the mapping is constant.

use crate::earth::Geodetic;

/// Niell's columns: a, b, c of the average hydrostatic, of its yearly amplitude, and of the wet mapping.
struct Column {
    latitude_deg: f64,
    average: [f64; 3],
    amplitude: [f64; 3],
    wet: [f64; 3],
}

/// Niell 1996, tables 3 and 4.
const COLUMNS: [Column; 5] = [
    Column {
        latitude_deg: 15.0,
        average: [1.276_993_4e-3, 2.915_369_5e-3, 62.610_505e-3],
        amplitude: [0.0, 0.0, 0.0],
        wet: [5.802_189_7e-4, 1.427_526_8e-3, 4.347_296_1e-2],
    },
    Column {
        latitude_deg: 30.0,
        average: [1.268_323_0e-3, 2.915_229_9e-3, 62.837_393e-3],
        amplitude: [1.270_962_6e-5, 2.141_497_9e-5, 9.012_840_0e-5],
        wet: [5.679_484_7e-4, 1.513_862_5e-3, 4.672_951_0e-2],
    },
    Column {
        latitude_deg: 45.0,
        average: [1.246_539_7e-3, 2.928_844_5e-3, 63.721_774e-3],
        amplitude: [2.652_366_2e-5, 3.016_077_9e-5, 4.349_703_7e-5],
        wet: [5.811_801_9e-4, 1.457_275_2e-3, 4.390_893_1e-2],
    },
    Column {
        latitude_deg: 60.0,
        average: [1.219_604_9e-3, 2.902_256_5e-3, 63.824_265e-3],
        amplitude: [3.400_045_2e-5, 7.256_272_2e-5, 84.795_348e-5],
        wet: [5.972_754_2e-4, 1.500_742_8e-3, 4.462_698_2e-2],
    },
    Column {
        latitude_deg: 75.0,
        average: [1.204_599_6e-3, 2.902_491_2e-3, 64.258_455e-3],
        amplitude: [4.120_219_1e-5, 11.723_375e-5, 170.372_06e-5],
        wet: [6.164_169_3e-4, 1.759_908_2e-3, 5.473_603_8e-2],
    },
];
/// Height correction (Niell 1996, equation 6).
const HEIGHT: [f64; 3] = [2.53e-5, 5.49e-3, 1.14e-3];
/// Day of the year with the northern winter's extreme.
const WINTER_DAY: f64 = 28.0;
/// Length of a year, days.
const YEAR_DAYS: f64 = 365.25;
/// Mapping at this elevation serves for all below it: sin 2°.
const LOWEST_SINE: f64 = 0.034_899_5;
/// Lowest height of the model in metres, below the lowest shore.
const LOWEST_M: f64 = -1000.0;
/// Highest height of the model in metres, where pressure vanishes.
const HIGHEST_M: f64 = 44_000.0;
const TROPOPAUSE_M: f64 = 11_000.0;
const RELATIVE_HUMIDITY: f64 = 0.5;

/// Marini's continued fraction in Herring's norm: one at the zenith.
fn fraction([a, b, c]: [f64; 3], sine: f64) -> f64 {
    let at = |x: f64| x + a / (x + b / (x + c));
    at(1.0) / at(sine)
}

/// Hydrostatic and wet mapping factors at the sine of an elevation on a day of the year (from 1.0).
pub fn mapping(user: Geodetic, sine: f64, day: f64) -> (f64, f64) {
    let sine = sine.max(LOWEST_SINE);
    let south = if user.latitude_rad < 0.0 { 0.5 } else { 0.0 };
    let season = libm::cos(std::f64::consts::TAU * ((day - WINTER_DAY) / YEAR_DAYS + south));
    let latitude_deg = user.latitude_rad.to_degrees().abs();
    let upper = COLUMNS.iter().find(|column| column.latitude_deg >= latitude_deg).unwrap_or(&COLUMNS[4]);
    let lower = COLUMNS.iter().rev().find(|column| column.latitude_deg <= latitude_deg).unwrap_or(&COLUMNS[0]);
    let gap_deg = upper.latitude_deg - lower.latitude_deg;
    let share = if gap_deg > 0.0 { (latitude_deg - lower.latitude_deg) / gap_deg } else { 0.0 };
    let between = |of: fn(&Column) -> [f64; 3]| {
        let (low, high) = (of(lower), of(upper));
        [0, 1, 2].map(|k: usize| low[k] + share * (high[k] - low[k]))
    };
    let (average, amplitude) = (between(|c| c.average), between(|c| c.amplitude));
    let dry = [0, 1, 2].map(|k: usize| average[k] - amplitude[k] * season);
    let lift = (1.0 / sine - fraction(HEIGHT, sine)) * user.height_m * 1e-3;
    (fraction(dry, sine) + lift, fraction(between(|c| c.wet), sine))
}

/// Hydrostatic and wet zenith delays in metres, for pressure and vapour in hPa and temperature in K.
pub fn zenith_m(user: Geodetic, pressure_hpa: f64, temperature_k: f64, vapour_hpa: f64) -> (f64, f64) {
    let gravity = 1.0 - 0.002_66 * libm::cos(2.0 * user.latitude_rad) - 0.000_28 * user.height_m * 1e-3;
    (0.002_276_8 * pressure_hpa / gravity, 0.002_277 * (1255.0 / temperature_k + 0.05) * vapour_hpa)
}

/// Slant delay in metres at the sine of an elevation; none outside of the air.
pub fn delay_m(user: Geodetic, sine: f64, day: f64) -> f64 {
    if !(LOWEST_M..HIGHEST_M).contains(&user.height_m) {
        return 0.0;
    }
    // Standard atmosphere (ICAO Doc 7488): 1013.25 hPa and 15 °C at sea level, 6.5 K less each kilometre.
    let pressure_hpa = 1013.25 * libm::pow(1.0 - 2.255_7e-5 * user.height_m, 5.256_8);
    let celsius = 15.0 - 6.5e-3 * user.height_m.min(TROPOPAUSE_M);
    let saturation_hpa = 6.1078 * libm::pow(10.0, 7.5 * celsius / (celsius + 237.3));
    let vapour_hpa = (RELATIVE_HUMIDITY * saturation_hpa).min(pressure_hpa);
    let (dry_m, wet_m) = zenith_m(user, pressure_hpa, celsius + 273.15, vapour_hpa);
    let (dry, wet) = mapping(user, sine, day);
    dry_m * dry + wet_m * wet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mapping_agrees_with_an_independent_implementation_of_niell() {
        // Reference values computed elsewhere from the same paper, printed to 1e-9.
        for (day, latitude, height_m, elevation, dry, wet) in [
            (28.0, 45.0, 0.0, 5.0, 10.151_761_745, 10.750_884_210),
            (210.5, 26.5, 130.0, 10.0, 5.546_867_982, 5.658_966_023),
            (100.0, -33.0, 2000.0, 15.0, 3.801_567_919, 3.833_858_129),
            (200.0, 80.0, 0.0, 3.0, 14.653_174_860, 16.323_500_496),
        ] {
            let user = Geodetic::from_degrees(latitude, 0.0, height_m);
            let (have_dry, have_wet) = mapping(user, libm::sin(f64::to_radians(elevation)), day);
            assert!((have_dry - dry).abs() < 2e-9, "{have_dry} {dry}");
            assert!((have_wet - wet).abs() < 2e-9, "{have_wet} {wet}");
        }
    }

    #[test]
    fn zenith_delays_agree_with_the_reference_values() {
        for (latitude, height_m, pressure_hpa, celsius, humidity, dry_m, wet_m) in [
            (45.0, 0.0, 1013.25, 15.0, 0.5, 2.306_968, 0.085_526),
            (26.5, 130.0, 998.0, 35.0, 0.8, 2.275_973, 0.422_210),
            (60.0, 2000.0, 795.0, 0.0, 0.5, 1.808_663, 0.032_297),
        ] {
            let user = Geodetic::from_degrees(latitude, 0.0, height_m);
            let vapour_hpa = humidity * 6.1078 * libm::pow(10.0, 7.5 * celsius / (celsius + 237.3));
            let (dry, wet) = zenith_m(user, pressure_hpa, celsius + 273.15, vapour_hpa);
            assert!((dry - dry_m).abs() < 1e-6 && (wet - wet_m).abs() < 1e-6, "{dry} {wet}");
        }
    }

    #[test]
    fn there_is_no_delay_outside_the_air_and_it_stays_bounded_at_the_horizon() {
        assert_eq!(delay_m(Geodetic::from_degrees(10.0, 0.0, 1e5), 0.5, 1.0), 0.0);
        let low = delay_m(Geodetic::from_degrees(10.0, 0.0, 0.0), -0.5, 1.0);
        assert!(low > 20.0 && low < 60.0, "{low}");
    }
}
