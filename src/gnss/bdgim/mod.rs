//! BDGIM: the global ionosphere model for which BeiDou's third generation broadcasts nine coefficients.
//!
//! Source: BDS-SIS-ICD-B1C 1.0, section 7.8 (7.8 of BDS-SIS-ICD-B2a 1.0 and 7.7 of BDS-SIS-ICD-B2b 1.0 have
//! the same). The vertical content is a sum of normalised spherical harmonics of the geomagnetic position,
//! its longitude counted from the mean Sun's: nine of degree 0 to 2 with the broadcast coefficients, and a
//! forecast of seventeen of degree 3 to 5, whose coefficients are sums of twelve periods ([`forecast_tecu`])
//! and change every two hours. The slant content is that of a thin shell 400 km above a sphere.
//!
//! The program of the model's authors (Li and Wang, 2021) differs from the document: it has the modified
//! single-layer mapping (0.9782) for the document's, 40.3 for 40.28, a geocentric pierce point, and a least
//! vertical content ([`Bdgim::least_tecu`]), without which the sum is below zero in places. That least
//! content alone is taken over here. Limits: time is that of BDT, where the document has modified Julian
//! date and no more (UTC is 4 s off, 5 mm of delay at most); geodetic latitudes are taken for those on the
//! sphere, as in the document; below the horizon the elevation counts as zero.

mod table;

use std::f64::consts::{PI, TAU};

use crate::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use crate::time::{BDT, Epoch};
use table::{AMPLITUDES, BROADCAST, FORECAST, PERIODS_D};

/// Radius of the sphere and height of the shell, in metres (7.8.2).
const EARTH_M: f64 = 6378e3;
const SHELL_M: f64 = 400e3;
/// The geomagnetic north pole (7.8.2), in degrees.
const POLE_LATITUDE_DEG: f64 = 80.27;
const POLE_LONGITUDE_DEG: f64 = -72.58;
/// Metres of delay at 1 Hz² for a TECU (equation 7-6).
const DELAY_M_HZ2_PTECU: f64 = 40.28e16;
/// Time for which the coefficients of the forecast hold, in seconds (7.8.2).
pub const INTERVAL_S: i64 = 7200;
/// Modified Julian date of the beginning of GPS time, 1980-01-06.
const FIRST_MJD: i64 = 44_244;
const DAY_S: i64 = 86_400;
/// Highest degree and order of the harmonics.
const DEGREE: usize = 5;
const ORDER: usize = 3;

/// The nine broadcast coefficients: α₁ to α₉, in TECU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bdgim {
    /// Coefficients in TECU of degree/order 0/0, 1/0, 1/1, 1/−1, 2/0, 2/1, 2/−1, 2/2 and 2/−2.
    pub alpha_tecu: [f64; 9],
}

/// Point at which the line of sight crosses the shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pierce {
    /// Geographic latitude, in radians.
    pub latitude_rad: f64,
    /// Geographic longitude, in radians.
    pub longitude_rad: f64,
    /// Slant over vertical content.
    pub obliquity: f64,
}

impl Pierce {
    /// The position that `user` sees towards `look`.
    pub fn new(user: Geodetic, look: Look) -> Self {
        let elevation_rad = look.elevation_rad.max(0.0);
        // Sine of the zenith angle at the shell.
        let sine = EARTH_M / (EARTH_M + SHELL_M) * libm::cos(elevation_rad);
        let psi_rad = PI / 2.0 - elevation_rad - libm::asin(sine);
        let (sin_psi, cos_psi) = libm::sincos(psi_rad);
        let (sin_user, cos_user) = libm::sincos(user.latitude_rad);
        let (sin_azimuth, cos_azimuth) = libm::sincos(look.azimuth_rad);
        let sin_latitude = (sin_user * cos_psi + cos_user * sin_psi * cos_azimuth).clamp(-1.0, 1.0);
        let east = libm::atan2(sin_psi * sin_azimuth * cos_user, cos_psi - sin_user * sin_latitude);
        Self {
            latitude_rad: libm::asin(sin_latitude),
            longitude_rad: user.longitude_rad + east,
            obliquity: planted!("gnss.bdgim.obliquity", 1.0, 1.01) / (1.0 - sine * sine).sqrt(),
        }
    }

    /// Converts the point to geomagnetic coordinates, with its longitude relative to the mean Sun at a time
    /// (7-9, 7-10).
    pub fn under_sun(&self, at: Epoch) -> UnderSun {
        let (sin_pole, cos_pole) = libm::sincos(POLE_LATITUDE_DEG.to_radians());
        let pole_rad = planted!("gnss.bdgim.pole", POLE_LONGITUDE_DEG, 72.58).to_radians();
        let (sin_latitude, cos_latitude) = libm::sincos(self.latitude_rad);
        let (sin_east, cos_east) = libm::sincos(self.longitude_rad - pole_rad);
        let sin_magnetic = (sin_pole * sin_latitude + cos_pole * cos_latitude * cos_east).clamp(-1.0, 1.0);
        let magnetic_rad = libm::atan2(cos_latitude * sin_east * cos_pole, sin_pole * sin_magnetic - sin_latitude);
        let day = BDT.label(at).seconds().rem_euclid(DAY_S) as f64 + at.fraction();
        let sun_rad = PI * (1.0 - 2.0 * day / DAY_S as f64);
        let (sin_sun, cos_sun) = libm::sincos(sun_rad - pole_rad);
        let sun_magnetic_rad = libm::atan2(sin_sun, sin_pole * cos_sun);
        UnderSun { sin_latitude: sin_magnetic, longitude_rad: magnetic_rad - sun_magnetic_rad }
    }
}

/// A position in geomagnetic coordinates, as the Sun sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnderSun {
    /// Sine of the geomagnetic latitude.
    pub sin_latitude: f64,
    /// Geomagnetic longitude east of the mean Sun's, in radians.
    pub longitude_rad: f64,
}

impl UnderSun {
    /// The normalised harmonics (7-11 to 7-13) by degree n and order m: `[n][m]` those of cos mλ, and of sin
    /// mλ beside them.
    fn harmonics(&self) -> [[[f64; 2]; ORDER + 1]; DEGREE + 1] {
        let x = self.sin_latitude;
        let cosine = ((1.0 - x) * (1.0 + x)).sqrt();
        let mut all = [[[0.0; 2]; ORDER + 1]; DEGREE + 1];
        let mut diagonal = 1.0;
        for m in 0..=ORDER {
            let (mut before, mut own) = (0.0, diagonal);
            let (sin_m, cos_m) = libm::sincos(m as f64 * self.longitude_rad);
            for (n, orders) in all.iter_mut().enumerate().skip(m) {
                if n > m {
                    let (two_n, sum) = ((2 * n - 1) as f64, (n + m - 1) as f64);
                    (before, own) = (own, (two_n * x * own - sum * before) / (n - m) as f64);
                }
                if let Some(both) = orders.get_mut(m) {
                    let normed = norm(n, m) * own;
                    *both = [normed * cos_m, normed * sin_m];
                }
            }
            diagonal *= (2 * m + 1) as f64 * cosine;
        }
        all
    }
}

/// The factor that makes a Legendre function's mean square over the sphere 1 (7-12).
fn norm(n: usize, m: usize) -> f64 {
    // (n − m)! / (n + m)!
    let ratio: f64 = (n - m + 1..=n + m).map(|k| 1.0 / k as f64).product();
    let both = if m == 0 { 1.0 } else { planted!("gnss.bdgim.norm", 2.0, 1.0) };
    (both * (2 * n + 1) as f64 * ratio).sqrt()
}

/// Number of the two-hour interval in which a time lies, since modified Julian date 0 of BDT, and the seconds
/// since its beginning.
pub fn interval(at: Epoch) -> (i64, f64) {
    let seconds = BDT.label(at).seconds() + FIRST_MJD * DAY_S;
    (seconds.div_euclid(INTERVAL_S), seconds.rem_euclid(INTERVAL_S) as f64 + at.fraction())
}

/// Forecast coefficients β₁ to β₁₇ in TECU of an interval of two hours. They are those of its middle, an odd
/// hour (7-15).
pub fn forecast_tecu(interval: i64) -> [f64; 17] {
    // Half intervals are hours.
    let hours = 2 * interval + planted!("gnss.bdgim.hour", 1, 0);
    let waves = PERIODS_D.map(|period_d| {
        let turns = hours as f64 / (24.0 * period_d);
        libm::sincos(TAU * (turns - turns.floor()))
    });
    AMPLITUDES.map(|row| {
        let (mean, pairs) = row.split_first().unwrap_or((&0, &[]));
        let sums = pairs.chunks_exact(2).zip(&waves).map(|(pair, (sine, cosine))| match pair {
            [a, b] => f64::from(*a) * cosine + f64::from(*b) * sine,
            _ => 0.0,
        });
        0.01 * (f64::from(*mean) + sums.sum::<f64>())
    })
}

impl Bdgim {
    /// The model of coefficients that are not all zero, as they are where a message states nothing.
    pub fn given(alpha_tecu: [f64; 9]) -> Option<Self> {
        alpha_tecu.iter().any(|alpha| *alpha != 0.0).then_some(Self { alpha_tecu })
    }

    /// The sum of the broadcast harmonics and those of a forecast at a position, in TECU: as the document has
    /// it, and in places below zero.
    pub fn series_tecu(&self, place: &UnderSun, forecast_tecu: &[f64; 17]) -> f64 {
        let harmonics = place.harmonics();
        let sum = |coefficients: &[f64], numbers: &[(usize, i8)]| -> f64 {
            let terms = coefficients.iter().zip(numbers).map(|(coefficient, (n, m))| {
                let both = harmonics.get(*n).and_then(|orders| orders.get(usize::from(m.unsigned_abs())));
                let [cosine, sine] = both.copied().unwrap_or_default();
                coefficient * if *m < 0 { sine } else { cosine }
            });
            terms.sum()
        };
        sum(&self.alpha_tecu, &BROADCAST) + sum(forecast_tecu, &FORECAST)
    }

    /// Least vertical content in TECU as in the authors' program: a share of α₁, the mean over the sphere.
    pub fn least_tecu(&self) -> f64 {
        let [mean, ..] = self.alpha_tecu;
        let part = match mean {
            mean if mean > 35.0 => 10.0,
            mean if mean > 20.0 => 8.0,
            mean if mean > 12.0 => 6.0,
            _ => 4.0,
        };
        mean / planted!("gnss.bdgim.least", part, 2.0 * part)
    }

    /// Vertical content at a position by a forecast, in TECU.
    pub fn vertical_tecu(&self, place: &UnderSun, forecast_tecu: &[f64; 17]) -> f64 {
        self.series_tecu(place, forecast_tecu).max(self.least_tecu())
    }

    /// Group delay in seconds on a carrier of `carrier_hz` from `user` towards `look` at GPS time `at` (7-6).
    pub fn delay_s(&self, user: Geodetic, look: Look, at: Epoch, carrier_hz: f64) -> f64 {
        let pierce = Pierce::new(user, look);
        let forecast = forecast_tecu(interval(at).0);
        delay_s(pierce.obliquity * self.vertical_tecu(&pierce.under_sun(at), &forecast), carrier_hz)
    }
}

/// Group delay in seconds of a slant electron content in TECU on a carrier (7-6).
pub fn delay_s(tecu: f64, carrier_hz: f64) -> f64 {
    DELAY_M_HZ2_PTECU * tecu / (carrier_hz * carrier_hz) / SPEED_OF_LIGHT_MPS
}

#[cfg(test)]
mod tests;
