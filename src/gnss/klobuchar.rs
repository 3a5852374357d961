//! The broadcast ionosphere: Klobuchar's eight coefficients and the user algorithm.
//!
//! Source: IS-GPS-200N, 20.3.3.5.2.5 and figure 20-4. It removes about half of the true delay. As
//! printed it steps by 2 % of the bulge where its cosine series ends (see [`SERIES_END_RAD`]), and where
//! local time wraps at midnight if the period exceeds 40 hours. Below the horizon the document has
//! nothing: there the elevation counts as zero, which keeps clear of the pole of ψ at −19.8°. Its shell is a
//! sphere that takes geodetic latitudes: up to 0.13 m of delay against an ellipsoid's. The generator smooths
//! the step (up to 0.16 m).

use std::f64::consts::{PI, TAU};

use crate::earth::{Geodetic, Look};
use crate::time::{BDT, Epoch};

/// Carrier frequency in Hz for which the coefficients are defined (IS-GPS-200N, 3.3.1.1).
pub const L1_HZ: f64 = 1_575.42e6;
/// Delay at night, in seconds (IS-GPS-200N, figure 20-4).
pub const NIGHT_S: f64 = 5e-9;
/// Local time of the bulge's maximum, in seconds (IS-GPS-200N, figure 20-4).
pub const MAXIMUM_S: f64 = 50_400.0;
/// Phase in radians beyond which the bulge is left out (IS-GPS-200N, figure 20-4).
pub const SERIES_END_RAD: f64 = 1.57;
/// Seconds of a day.
pub const DAY_S: f64 = 86_400.0;

/// Klobuchar's eight broadcast coefficients, in the document's units (seconds and powers of semicircles).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Klobuchar {
    /// Polynomial of the amplitude over geomagnetic latitude, in s, s/semicircle and higher powers.
    pub alpha: [f64; 4],
    /// Polynomial of the period: the same units.
    pub beta: [f64; 4],
}

impl Klobuchar {
    /// Names of the coefficients in messages, in their order.
    pub(crate) const PARAMETERS: [&str; 8] =
        ["alpha_0", "alpha_1", "alpha_2", "alpha_3", "beta_0", "beta_1", "beta_2", "beta_3"];
    /// Coefficients of which all are zero.
    pub const ZERO: Self = Self { alpha: [0.0; 4], beta: [0.0; 4] };

    /// Coefficients by the values of their names; `None` if one is missing.
    pub(crate) fn named(value: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        let mut found = Self::ZERO;
        let Self { alpha, beta } = &mut found;
        for (own, name) in alpha.iter_mut().chain(beta).zip(Self::PARAMETERS) {
            *own = value(name)?;
        }
        Some(found)
    }
}

/// Coefficients of a nominal ionosphere, for use before any are received. They are even in magnetic latitude,
/// with a period of 100 000 s.
///
/// The mean of what GPS satellites broadcast on seven days: 2005-04-02, 2010-07-01, 2020-11-29, 2021-09-22,
/// 2022-01-01, 2023-03-12 and 2024-04-01. Their amplitudes at the magnetic equator are 11, 5, 15, 8, 12, 33
/// and 26 ns.
pub const NOMINAL: Klobuchar = Klobuchar { alpha: [1.6e-8, 0.0, -6.0e-8, 0.0], beta: [1.0e5, 0.0, 0.0, 0.0] };

/// Intermediate quantities of the model along one line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bulge {
    /// Slant factor F.
    pub obliquity: f64,
    /// Amplitude of the bulge in seconds, never negative.
    pub amplitude_s: f64,
    /// Period of the bulge in seconds, at least 72 000.
    pub period_s: f64,
    /// Local time at the ionospheric point in seconds, [0, 86 400).
    pub local_s: f64,
}

impl Bulge {
    /// Phase of the bulge x at its local time, in radians.
    pub fn phase_rad(&self) -> f64 {
        TAU * (self.local_s - planted!("gnss.klobuchar.noon", MAXIMUM_S, 43_200.0)) / self.period_s
    }
}

/// The document's cosine: 1 − x²/2 + x⁴/24.
pub fn cosine_series(phase_rad: f64) -> f64 {
    let square = phase_rad * phase_rad;
    1.0 - square / 2.0 + square * square / 24.0
}

impl Klobuchar {
    /// Slant factor, amplitude, period and local time seen from `user` towards `look` at GPS time `at`.
    pub fn bulge(&self, user: Geodetic, look: Look, at: Epoch) -> Bulge {
        // Semicircles throughout, as the document has it.
        let elevation = look.elevation_rad.max(0.0) / PI;
        let psi = 0.0137 / (elevation + 0.11) - 0.022;
        let (sin_azimuth, cos_azimuth) = libm::sincos(look.azimuth_rad);
        let latitude = (user.latitude_rad / PI + psi * cos_azimuth).clamp(-0.416, 0.416);
        let longitude = user.longitude_rad / PI + psi * sin_azimuth / libm::cos(latitude * PI);
        let magnetic = latitude + 0.064 * libm::cos((longitude - planted!("gnss.klobuchar.pole", 1.617, 1.0)) * PI);
        let local_s = (43_200.0 * longitude + at.tow_s()).rem_euclid(DAY_S);
        let slant = planted!("gnss.klobuchar.obliquity", 0.53, 0.5) - elevation;
        Bulge {
            obliquity: 1.0 + 16.0 * slant * slant * slant,
            amplitude_s: cubic(&self.alpha, magnetic).max(0.0),
            period_s: cubic(&self.beta, magnetic).max(72_000.0),
            local_s: if local_s >= DAY_S { 0.0 } else { local_s },
        }
    }

    /// Slant delay in seconds by BeiDou's form of the model (BDS-SIS-ICD-B1I 3.0, 5.2.4.7), scaled from B1I
    /// to `carrier_hz`. The pierce point is 375 km above a sphere and has a geographic latitude. The cosine
    /// covers a quarter of its period on either side of 14 h.
    pub fn beidou_delay_s(&self, user: Geodetic, look: Look, at: Epoch, carrier_hz: f64) -> f64 {
        const EARTH_M: f64 = 6378e3;
        const SHELL_M: f64 = EARTH_M + 375e3;
        const B1I_HZ: f64 = 1_561.098e6;
        let elevation_rad = look.elevation_rad.max(0.0);
        let sine = EARTH_M / SHELL_M * libm::cos(elevation_rad);
        let psi_rad = PI / 2.0 - elevation_rad - libm::asin(sine);
        let (sin_psi, cos_psi) = libm::sincos(psi_rad);
        let (sin_user, cos_user) = libm::sincos(user.latitude_rad);
        let (sin_azimuth, cos_azimuth) = libm::sincos(look.azimuth_rad);
        let latitude_rad = libm::asin((sin_user * cos_psi + cos_user * sin_psi * cos_azimuth).clamp(-1.0, 1.0));
        let beside = sin_psi * sin_azimuth / libm::cos(latitude_rad);
        let longitude_rad = user.longitude_rad + libm::asin(beside.clamp(-1.0, 1.0));
        let local_s = (BDT.label(at).tow_s() + longitude_rad * 43_200.0 / PI).rem_euclid(DAY_S);
        let north = planted!("gnss.beidou.latitude", (latitude_rad / PI).abs(), latitude_rad / PI);
        let amplitude_s = cubic(&self.alpha, north).max(0.0);
        let period_s = cubic(&self.beta, north).clamp(72_000.0, 172_800.0);
        let phase_rad = TAU * (local_s - MAXIMUM_S) / period_s;
        let day_s = if phase_rad.abs() < PI / 2.0 { amplitude_s * libm::cos(phase_rad) } else { 0.0 };
        let scale = B1I_HZ / carrier_hz;
        (NIGHT_S + day_s) / (1.0 - sine * sine).sqrt() * scale * scale
    }

    /// Scales the coefficients so that their bulge on `defined_hz` equals the present one on L1. Delays at
    /// night are 5 ns on both.
    pub fn bulge_on(&self, defined_hz: f64) -> Self {
        let scale = L1_HZ / defined_hz;
        Self { alpha: self.alpha.map(|alpha| alpha * (scale * scale)), beta: self.beta }
    }

    /// Group delay on a carrier of `carrier_hz`, in seconds, seen from `user` towards `look` at GPS time
    /// `at`.
    pub fn delay_s(&self, user: Geodetic, look: Look, at: Epoch, carrier_hz: f64) -> f64 {
        self.delay_from_s(L1_HZ, user, look, at, carrier_hz)
    }

    /// Group delay in seconds like [`Self::delay_s`], for coefficients that give the delay on `defined_hz`,
    /// at night too.
    pub fn delay_from_s(&self, defined_hz: f64, user: Geodetic, look: Look, at: Epoch, carrier_hz: f64) -> f64 {
        let bulge = self.bulge(user, look, at);
        let phase_rad = bulge.phase_rad();
        let day_s = if phase_rad.abs() < SERIES_END_RAD { bulge.amplitude_s * cosine_series(phase_rad) } else { 0.0 };
        let scale = defined_hz / carrier_hz;
        bulge.obliquity * (NIGHT_S + day_s) * scale * scale
    }
}

fn cubic(coefficients: &[f64; 4], x: f64) -> f64 {
    let [c0, c1, c2, c3] = *coefficients;
    c0 + (c1 + (c2 + c3 * x) * x) * x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::SPEED_OF_LIGHT_MPS;

    const EXAMPLE: Klobuchar =
        Klobuchar { alpha: [1.118e-8, -7.451e-9, -5.961e-8, 1.192e-7], beta: [1.167e5, -2.294e5, -1.311e5, 1.049e6] };

    fn delay_m(latitude: f64, longitude: f64, azimuth: f64, elevation: f64, tow_s: f64) -> f64 {
        let look = Look { azimuth_rad: azimuth.to_radians(), elevation_rad: elevation.to_radians() };
        let user = Geodetic::from_degrees(latitude, longitude, 0.0);
        EXAMPLE.delay_s(user, look, Epoch::from_week(1500, tow_s), L1_HZ) * SPEED_OF_LIGHT_MPS
    }

    #[test]
    fn delays_are_those_of_independent_programs() {
        // Computed outside this project; printed to 1e-9 m.
        assert!((delay_m(40.0, -100.0, 210.0, 20.0, 374_400.0) - 3.261_779_218).abs() < 1e-8);
        assert!((delay_m(26.5123, 80.2329, 45.0, 60.0, 280_800.0) - 4.420_660_998).abs() < 1e-8);
        assert!((delay_m(0.0, 0.0, 0.0, 90.0, 50_400.0) - 4.790_941_494).abs() < 1e-8);
        assert!((delay_m(-33.0, 151.0, 300.0, 5.0, 100_000.0) - 12.845_266_641).abs() < 1e-8);
    }

    #[test]
    fn poles_horizon_and_antimeridian_give_finite_and_continuous_delays() {
        for latitude in [-90.0, -89.9, 89.9, 90.0] {
            for elevation in [-90.0, -19.8, -1.0, 0.0, 90.0] {
                let delay = delay_m(latitude, 10.0, 33.0, elevation, 50_400.0);
                assert!(delay.is_finite() && (1.4..40.0).contains(&delay), "{latitude} {elevation} {delay}");
            }
        }
        // The two names of the antimeridian are one place: 43 200 s of local time in doubles leaves 1e-11 s.
        let east = delay_m(10.0, 180.0, 90.0, 30.0, 10_000.0);
        assert!((east - delay_m(10.0, -180.0, 90.0, 30.0, 10_000.0)).abs() < 1e-9);
    }

    #[test]
    fn the_delay_grows_with_the_square_of_the_wavelength() {
        let look = Look { azimuth_rad: 0.0, elevation_rad: 1.0 };
        let user = Geodetic::from_degrees(26.5, 80.2, 0.0);
        let at = Epoch::from_week(1500, 30_000.0);
        let ratio = EXAMPLE.delay_s(user, look, at, 1_227.6e6) / EXAMPLE.delay_s(user, look, at, L1_HZ);
        // (77/60)², the ratio of the two carriers.
        assert!((ratio - 5929.0 / 3600.0).abs() < 1e-12);
    }
}
