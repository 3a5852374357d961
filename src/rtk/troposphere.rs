//! Neutral atmosphere of both receivers: what differs between them is their height.
//!
//! Source: Saastamoinen 1972 by the standard atmosphere of ISO 2533, mapping of Black and Eisner 1984. A
//! difference of 100 m in height is 3 cm of zenith delay. Limits: no weather; below 5° of elevation the
//! mapping is off by per cent, which both receivers share.

/// Zenith delay in metres at a height above the ellipsoid, half saturated.
fn zenith_m(height_m: f64) -> f64 {
    let height_m = height_m.clamp(-1000.0, 11_000.0);
    let temperature_k = 288.15 - 0.0065 * height_m;
    let pressure_hpa = 1013.25 * libm::pow(temperature_k / 288.15, 5.2559);
    // Saturation pressure of water (Magnus), half of it.
    let celsius = temperature_k - 273.15;
    let vapour_hpa = 0.5 * 6.1078 * libm::exp(17.269 * celsius / (celsius + 237.3));
    0.002_277 * (pressure_hpa + (1255.0 / temperature_k + 0.05) * vapour_hpa)
}

/// Slant delay in metres at an elevation.
pub fn delay_m(height_m: f64, elevation_rad: f64) -> f64 {
    let sine = libm::sin(elevation_rad.max(0.0));
    zenith_m(height_m) * 1.001 / (0.002_001 + sine * sine).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zenith_delay_is_that_of_a_standard_atmosphere_and_falls_with_height() {
        // 2.31 m dry (Davis et al. 1985) and a wet part of 0.1 m for 8.5 hPa.
        assert!((zenith_m(0.0) - 2.40).abs() < 0.03, "{}", zenith_m(0.0));
        let fall = zenith_m(0.0) - zenith_m(100.0);
        assert!((0.027..0.033).contains(&fall), "{fall}");
        assert!((delay_m(0.0, 0.5 * std::f64::consts::PI) / zenith_m(0.0) - 1.0).abs() < 1e-4);
        assert!((delay_m(0.0, 0.174_533) / zenith_m(0.0) - 5.6).abs() < 0.1);
    }
}
