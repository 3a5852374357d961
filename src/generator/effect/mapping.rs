//! Mapping functions of the neutral atmosphere: slant over zenith delay, hydrostatic and wet.
//!
//! Sources: Niell 1996 (NMF); Böhm, Werl & Schuh 2006 (VMF1: b and c in closed form); Landskron & Böhm 2018
//! (VMF3: b and c by position and season). VMF1 and VMF3 take a from a Vienna grid or GPT3, at zero height,
//! and add Niell's height correction to the hydrostatic factor. All were fitted from 3° of elevation without
//! refraction up. Below, their continued fractions would be 10 % too high at the horizon: a sine that is
//! raised there brings Niell's hydrostatic factor to that of rays traced through the standard atmosphere,
//! within 0.4 % at sea level, and the wet one to within 7 % of vapour whose density falls in 2 km to 2.5 km
//! by 1/e. One over the sine, in the height correction and in the cosecant, is bounded there. Limits: no
//! factor is defined below the horizon; a grid's coefficients are held for the whole scene. Those of VMF3's
//! grids and of GPT3 under VMF1's closed form differ from VMF3, by 2 cm of delay at 5° and 2 mm at 10°.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use gnss::earth::Geodetic;
use gnss::time::Epoch;
use gnss::vienna::{Gpt3, MappingA, MappingGrid, Vienna};
use gnss::vmf3::{MappingBc, Vmf3};

/// Sine of the elevation from which on the functions were fitted: 3° (Niell 1996).
const FITTED_SIN: f64 = 0.052_335_956;
/// Increase of the sine at the horizon, chosen so that Niell's hydrostatic factor at 45° is 33.4 there.
const RAISED_SIN: f64 = 0.0034;
/// Replacement for a sine of zero in one over it. The hydrostatic factor of rays traced along the horizon of
/// the standard atmosphere grows by 0.5 per kilometre of height up to 10 km. [`height_correction`] has that
/// slope at 0.56°.
const LEAST_SIN: f64 = 0.009_77;
const YEAR_DAYS: f64 = 365.25;
/// Day of the year about which seasons turn (Niell 1996; Böhm et al. 2006).
const WINTER_DAY: f64 = 28.0;

/// Growth of a zenith delay towards the horizon.
#[derive(Clone, Debug, PartialEq)]
pub enum Mapping {
    /// A flat atmosphere: 1/sin of the elevation for both parts.
    Cosecant,
    /// Niell's functions of latitude, height and day.
    Niell,
    /// VMF1's functions of coefficients a.
    Vmf1(Coefficients),
    /// VMF3's functions of coefficients a, and the harmonics of b and c.
    Vmf3(Coefficients, Box<Vmf3>),
}

/// Source of VMF's coefficients a.
#[derive(Clone, Debug, PartialEq)]
pub enum Coefficients {
    /// Coefficients from a grid of TU Wien, by position and time.
    Grid(Box<MappingGrid>),
    /// The climatology.
    Gpt3(Box<Gpt3>),
}

impl Coefficients {
    fn at(&self, user: Geodetic, day_of_year: f64) -> MappingA {
        match self {
            Self::Grid(grid) => grid.at(user.latitude_rad, user.longitude_rad),
            Self::Gpt3(gpt3) => gpt3.at(user.latitude_rad, user.longitude_rad, user.height_m, day_of_year).a,
        }
    }
}

impl Mapping {
    /// Hydrostatic and wet mapping factors; below the horizon they are those of the horizon.
    pub fn factors(&self, user: Geodetic, elevation_rad: f64, at: Epoch) -> (f64, f64) {
        let day = season_day(at);
        match self {
            Self::Cosecant => {
                let factor = 1.0 / bounded(sin(elevation_rad));
                (factor, factor)
            }
            Self::Niell => niell(user, elevation_rad, day),
            Self::Vmf1(a) => vmf1(a.at(user, day), user, elevation_rad, day),
            Self::Vmf3(a, bc) => {
                vmf3(a.at(user, day), bc.at(user.latitude_rad, user.longitude_rad, day), user, elevation_rad)
            }
        }
    }

    /// Describes the mapping function for the plan.
    pub fn describe(&self) -> &'static str {
        match self {
            Self::Cosecant => "cosecant mapping",
            Self::Niell => "Niell's mapping",
            Self::Vmf1(Coefficients::Grid(grid)) if grid.fitted_with == Some(Vienna::Vmf3) => {
                "VMF1 mapping off a grid of VMF3"
            }
            Self::Vmf1(Coefficients::Grid(_)) => "VMF1 mapping off a grid",
            Self::Vmf1(Coefficients::Gpt3(_)) => "VMF1 mapping with GPT3's coefficients",
            Self::Vmf3(Coefficients::Grid(_), _) => "VMF3 mapping off a grid",
            Self::Vmf3(Coefficients::Gpt3(_), _) => "VMF3 mapping with GPT3's coefficients",
        }
    }
}

/// Niell's hydrostatic and wet mapping factors at an elevation, by position and day of year (from 1.0).
///
/// Niell 1996, equations 4 to 6 and tables 3 and 4; the factors hold still below the horizon.
pub fn niell(user: Geodetic, elevation_rad: f64, day_of_year: f64) -> (f64, f64) {
    let sin = sin(elevation_rad);
    let south_days = if user.latitude_rad < 0.0 { YEAR_DAYS / 2.0 } else { 0.0 };
    let season = libm::cos(TAU * (day_of_year - WINTER_DAY + south_days) / YEAR_DAYS);
    let latitude_deg = user.latitude_rad.abs().to_degrees();
    let dry = [0, 1, 2].map(|k| {
        interpolate(&HYDROSTATIC_AVERAGE[k], latitude_deg)
            - interpolate(&HYDROSTATIC_AMPLITUDE[k], latitude_deg) * season
    });
    let wet = [0, 1, 2].map(|k| interpolate(&WET[k], latitude_deg));
    (mapped(sin, dry) + height_correction(sin, user.height_m), mapped(sin, wet))
}

/// The sine of an elevation above the horizon.
fn sin(elevation_rad: f64) -> f64 {
    libm::sin(elevation_rad.clamp(0.0, FRAC_PI_2))
}

/// Distance of a sine below the fitted range: 1 at the horizon, 0 at 3° and above.
fn below(sin: f64) -> f64 {
    ((FITTED_SIN - sin) / FITTED_SIN).max(0.0)
}

/// The sine that the continued fractions take. Value and three derivatives go on at the seam.
fn raised(sin: f64) -> f64 {
    let square = below(sin) * below(sin);
    sin + RAISED_SIN * square * square
}

/// A sine that does not reach zero. Value and two derivatives go on at the seam.
fn bounded(sin: f64) -> f64 {
    let below = below(sin);
    sin + LEAST_SIN * below * below * below
}

/// Height correction of the hydrostatic factor (Niell 1996, equation 6).
fn height_correction(sin: f64, height_m: f64) -> f64 {
    let sin = bounded(sin);
    (1.0 / sin - herring(sin, HEIGHT)) * height_m * 1e-3
}

/// VMF1's hydrostatic and wet mapping factors with coefficients `a` at zero height, by day of year (from
/// 1.0).
///
/// Böhm et al. 2006, equations 3 to 6 and table 1; the factors hold still below the horizon.
pub fn vmf1(a: MappingA, user: Geodetic, elevation_rad: f64, day_of_year: f64) -> (f64, f64) {
    let sin = sin(elevation_rad);
    let (phase_rad, c10, c11) = if user.latitude_rad < 0.0 { (PI, 0.002, 0.007) } else { (0.0, 0.001, 0.005) };
    let season = libm::cos(TAU * (day_of_year - WINTER_DAY) / YEAR_DAYS + phase_rad);
    let c = 0.062 + ((season + 1.0) * c11 / 2.0 + c10) * (1.0 - libm::cos(user.latitude_rad));
    let dry = mapped(sin, [a.hydrostatic, 0.0029, c]) + height_correction(sin, user.height_m);
    (dry, mapped(sin, [a.wet, 0.00146, 0.04391]))
}

/// VMF3's hydrostatic and wet mapping factors with coefficients `a` at zero height, and `bc` of the position
/// and day.
///
/// Landskron & Böhm 2018; the factors hold still below the horizon.
pub fn vmf3(a: MappingA, bc: MappingBc, user: Geodetic, elevation_rad: f64) -> (f64, f64) {
    let sin = sin(elevation_rad);
    let dry = mapped(sin, [a.hydrostatic, bc.b_hydrostatic, bc.c_hydrostatic]);
    (dry + height_correction(sin, user.height_m), mapped(sin, [a.wet, bc.b_wet, bc.c_wet]))
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

/// A factor by its coefficients.
fn mapped(sin: f64, coefficients: [f64; 3]) -> f64 {
    herring(raised(sin), coefficients)
}

fn herring(sin: f64, [a, b, c]: [f64; 3]) -> f64 {
    (1.0 + a / (1.0 + b / (1.0 + c))) / (sin + a / (sin + b / (sin + c)))
}

/// Days into a mean year, 1.0 on the first of January 1980. It is within 0.8 days of the calendar, without
/// its step at the turn of the year. VMF3's factors at 5° change by 1.4e-4 in that time, which is 0.3 mm of
/// delay.
pub fn season_day(at: Epoch) -> f64 {
    (at.seconds() as f64 / 86_400.0 + 6.0).rem_euclid(YEAR_DAYS)
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn vmf1_is_the_conventions_worked_example() {
        // IERS Conventions 2010, software of chapter 9, VMF1_HT: modified Julian date 55 055, latitude
        // 0.6708665767, height 824.17 m, zenith distance 1.278564131; day 1.0 of the formula is MJD 44 239.
        let user = Geodetic { latitude_rad: 0.670_866_576_7, longitude_rad: 0.0, height_m: 824.17 };
        let a = MappingA { hydrostatic: 0.001_276_83, wet: 0.000_609_55 };
        let (dry, wet) = vmf1(a, user, FRAC_PI_2 - 1.278_564_131, 55_055.0 - 44_239.0 + 1.0);
        assert!((dry - 3.425_088_087_972_572).abs() < 1e-12, "{dry}");
        assert!((wet - 3.448_299_714_692_572).abs() < 1e-12, "{wet}");
    }

    #[test]
    fn vmf1_with_vmf3_s_coefficients_departs_from_vmf3_by_what_the_module_says() {
        // Greenbelt, 2018-11-25: a_h = 0.00123462, a_w = 0.00047101 and the factors 1.621024 and 1.623023 at
        // 38°, from vmf3.m of TU Wien as Orekit's tests quote them. At 38° b and c hardly count: 6e-5 of 2.2
        // m are 0.1 mm.
        let user = Geodetic::from_degrees(37.5, 277.5, 824.0);
        let a = MappingA { hydrostatic: 0.001_234_62, wet: 0.000_471_01 };
        let (dry, wet) = vmf1(a, user, 38_f64.to_radians(), 329.0);
        assert!((dry - 1.621_024).abs() < 6e-5 && (wet - 1.623_023).abs() < 2e-6, "{dry} {wet}");
        // Graz, 2024-01-01: a of the station's file, factors at 10° and 5° printed by vmf3.m to 1e-4.
        let user = Geodetic::from_degrees(47.0671, 15.4935, 0.0);
        let a = MappingA { hydrostatic: 0.001_204_80, wet: 0.000_581_78 };
        for (elevation, dry, wet, off) in [(10.0, 5.5575, 5.6568, 8e-4), (5.0, 10.1579, 10.7460, 9e-3)] {
            let found = vmf1(a, user, f64::to_radians(elevation), 1.0);
            assert!((found.0 - dry).abs() < off && (found.1 - wet).abs() < off, "{elevation}: {found:?}");
        }
    }

    #[test]
    fn the_cosecant_bounds_the_curved_atmosphere_from_above() {
        // An atmosphere on a sphere is shorter towards the horizon than on a plane, the same at the zenith.
        let user = Geodetic::from_degrees(45.0, 0.0, 0.0);
        let at = Epoch::from_week(1590, 0.0);
        for elevation in [3.0, 5.0, 10.0, 30.0, 60.0, 89.0] {
            let elevation_rad = f64::to_radians(elevation);
            let (flat, _) = Mapping::Cosecant.factors(user, elevation_rad, at);
            let (dry, wet) = Mapping::Niell.factors(user, elevation_rad, at);
            assert!(flat >= wet && wet >= dry && dry > 0.7 * flat, "{elevation}: {flat} {dry} {wet}");
        }
        assert_eq!(Mapping::Cosecant.factors(user, FRAC_PI_2, at), (1.0, 1.0));
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
