//! Atmospheric delays against worked values of another program.

use gnss_twin::generator::effect::troposphere::{zenith_hydrostatic_m, zenith_wet_m};
use gnss_twin::gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss_twin::gnss::klobuchar::Klobuchar;
use gnss_twin::gnss::time::Epoch;

const ELEVATION_RAD: f64 = 75.0 * std::f64::consts::PI / 180.0;

fn place() -> Geodetic {
    Geodetic::from_degrees(35.0, 140.0, 100.0)
}

#[test]
fn klobuchar_gives_the_worked_value_of_rtklib() {
    // Debian rtklib 2.4.3.b34, test/utest/t_atmos.c.
    let model = Klobuchar { alpha: [2e-8, -8e-9, -5e-8, 1e-7], beta: [2e5, 2e5, -1e5, -1e6] };
    let look = Look { azimuth_rad: 60_f64.to_radians(), elevation_rad: ELEVATION_RAD };
    let at = Epoch::parse("2007-01-16T01:00:00").unwrap();
    let delay_m = model.delay_s(place(), look, at, 1_575.42e6) * SPEED_OF_LIGHT_MPS;
    assert!((delay_m - 6.735_905_320_994_38).abs() < 1e-8, "{delay_m}");
}

#[test]
fn saastamoinen_gives_the_worked_value_of_rtklib() {
    // The same file: humidity 0.5 at the same place, a cosecant mapping and that program's own vapour formula.
    let temperature_k = 15.0 - 6.5e-3 * 100.0 + 273.16;
    let pressure_hpa = 1013.25 * libm::pow(1.0 - 2.2557e-5 * 100.0, 5.2568);
    let vapour_hpa = 6.108 * 0.5 * libm::exp((17.15 * temperature_k - 4684.0) / (temperature_k - 38.45));
    let zenith_m = zenith_hydrostatic_m(place(), pressure_hpa) + zenith_wet_m(temperature_k, vapour_hpa);
    let slant_m = zenith_m / libm::sin(ELEVATION_RAD);
    assert!((slant_m - 2.447_998_701_440_88).abs() < 1e-8, "{slant_m}");
}
