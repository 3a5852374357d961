//! Meaning of the indicators in SBAS corrections: accuracies, and the ageing of fast corrections.
//!
//! Source: RTCA DO-229D, tables A-6 (UDREI), A-17 (GIVEI), A-7 and A-8 (degradation factors) and A-25
//! (time-outs). Accuracies bound an error with a probability of 99.9 %: 3.29 standard deviations. Time-outs
//! are the shorter ones, of precision approach.

/// Indicator of a satellite that is not monitored.
pub const NOT_MONITORED: u8 = 14;
/// Indicator of a satellite, or of a point of the grid, that must not be used.
pub const DO_NOT_USE: u8 = 15;
/// Standard deviations of a bound of 99.9 %.
pub const BOUND_SIGMAS: f64 = 3.29;

/// UDREI: bound of a range's error after the corrections, and its variance (table A-6).
const RANGES: [(f64, f64); 14] = [
    (0.75, 0.0520),
    (1.0, 0.0924),
    (1.25, 0.1444),
    (1.75, 0.2830),
    (2.25, 0.4678),
    (3.0, 0.8315),
    (3.75, 1.2992),
    (4.5, 1.8709),
    (5.25, 2.5465),
    (6.0, 3.3260),
    (7.5, 5.1968),
    (15.0, 20.7870),
    (50.0, 230.9661),
    (150.0, 2078.695),
];

/// GIVEI: bound of a vertical delay's error, and its variance (table A-17).
const DELAYS: [(f64, f64); 15] = [
    (0.3, 0.0084),
    (0.6, 0.0333),
    (0.9, 0.0749),
    (1.2, 0.1331),
    (1.5, 0.2079),
    (1.8, 0.2994),
    (2.1, 0.4075),
    (2.4, 0.5322),
    (2.7, 0.6735),
    (3.0, 0.8315),
    (3.6, 1.1974),
    (4.5, 1.8709),
    (6.0, 3.3260),
    (15.0, 20.7870),
    (45.0, 187.0826),
];

/// Ageing of a fast correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ageing {
    /// Acceleration by which its error grows, in m/s².
    pub acceleration_mps2: f64,
    /// Seconds for which it may be used.
    pub timeout_s: f64,
    /// Seconds after which the next one comes at the latest.
    pub interval_s: f64,
}

const fn ageing(acceleration_mps2: f64, timeout_s: f64, interval_s: f64) -> Ageing {
    Ageing { acceleration_mps2, timeout_s, interval_s }
}

/// Ageing by degradation factor indicator (tables ).
const AGEING: [Ageing; 16] = [
    ageing(0.0, 120.0, 60.0),
    ageing(0.000_05, 120.0, 60.0),
    ageing(0.000_09, 102.0, 51.0),
    ageing(0.000_12, 90.0, 45.0),
    ageing(0.000_15, 90.0, 45.0),
    ageing(0.000_20, 78.0, 39.0),
    ageing(0.000_30, 66.0, 33.0),
    ageing(0.000_45, 54.0, 27.0),
    ageing(0.000_60, 42.0, 21.0),
    ageing(0.000_90, 30.0, 15.0),
    ageing(0.001_50, 30.0, 15.0),
    ageing(0.002_10, 18.0, 9.0),
    ageing(0.002_70, 18.0, 9.0),
    ageing(0.003_30, 18.0, 9.0),
    ageing(0.004_60, 12.0, 6.0),
    ageing(0.005_80, 12.0, 6.0),
];

/// Ageing of the fast corrections with this indicator of their degradation; of those beyond 15 the fastest.
pub fn ageing_of(indicator: u8) -> Ageing {
    AGEING.get(usize::from(indicator)).copied().unwrap_or(AGEING[15])
}

/// Variance of a corrected range in m²; `None` if the satellite is not monitored or must not be used.
pub fn range_variance_m2(udrei: u8) -> Option<f64> {
    RANGES.get(usize::from(udrei)).map(|(_, variance_m2)| *variance_m2)
}

/// Variance of a vertical delay in m²; `None` if it is not monitored.
pub fn delay_variance_m2(givei: u8) -> Option<f64> {
    DELAYS.get(usize::from(givei)).map(|(_, variance_m2)| *variance_m2)
}

/// Smallest indicator whose bound covers an error of a corrected range; 15 if there is none.
pub fn udrei_of(error_m: f64) -> u8 {
    let fits = RANGES.iter().position(|(bound_m, _)| error_m <= *bound_m);
    fits.map_or(DO_NOT_USE, |place| place as u8)
}

/// Smallest indicator whose bound covers an error of a vertical delay; 15 if there is none.
pub fn givei_of(error_m: f64) -> u8 {
    let fits = DELAYS.iter().position(|(bound_m, _)| error_m <= *bound_m);
    fits.map_or(DO_NOT_USE, |place| place as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables print both: the variance to four digits behind the point, or seven in all.
    #[test]
    fn variances_are_those_of_the_printed_bounds() {
        for (bound_m, variance_m2) in RANGES.into_iter().chain(DELAYS) {
            let sigma_m = bound_m / BOUND_SIGMAS;
            assert!((sigma_m * sigma_m - variance_m2).abs() < 1e-3 * variance_m2 + 1e-4, "{bound_m} {variance_m2}");
        }
    }

    #[test]
    fn an_error_has_the_least_indicator_that_bounds_it() {
        assert_eq!([0.0, 0.75, 0.76, 150.0, 151.0].map(udrei_of), [0, 0, 1, 13, DO_NOT_USE]);
        assert_eq!([0.3, 0.31, 45.0, 46.0].map(givei_of), [0, 1, 14, DO_NOT_USE]);
        assert_eq!([13, NOT_MONITORED, DO_NOT_USE].map(|it| range_variance_m2(it).is_some()), [true, false, false]);
        assert_eq!([14, DO_NOT_USE].map(|it| delay_variance_m2(it).is_some()), [true, false]);
    }

    #[test]
    fn a_correction_outlives_one_that_is_lost() {
        for indicator in 0..16 {
            let Ageing { timeout_s, interval_s, .. } = ageing_of(indicator);
            assert_eq!(timeout_s, 2.0 * interval_s, "{indicator}");
        }
    }
}
