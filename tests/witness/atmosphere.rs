//! Atmospheric delays against worked values of another program.

use gnss_twin::generator::effect::mapping::vienna;
use gnss_twin::generator::effect::troposphere::{zenith_hydrostatic_m, zenith_wet_m};
use gnss_twin::gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss_twin::gnss::klobuchar::Klobuchar;
use gnss_twin::gnss::time::Epoch;
use gnss_twin::gnss::vienna::{self, Gpt3, MappingGrid};

use crate::data::external;

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

#[test]
fn gpt3_gives_what_the_authors_program_prints_for_graz() {
    // gpt3_5.m, saasthyd.m, asknewet.m and vmf3_ht.m of TU Wien, run in Octave for Graz (gnss.ell) at MJD 60 310.0, which
    // is 2024-01-01; each printed to the digits that bound it here.
    let Some(path) = external("ref/gpt3_5.grd") else { return };
    let gpt3 = Gpt3::read(&std::fs::read(path).unwrap(), "gpt3_5.grd").unwrap();
    let graz = Geodetic::from_degrees(47.0671, 15.4935, 538.30);
    let weather = gpt3.at(graz.latitude_rad, graz.longitude_rad, graz.height_m, 1.0);
    let near = |found: f64, printed: f64, half_step: f64| {
        assert!((found - printed).abs() <= half_step * 1.001, "{found} {printed}");
    };
    near(weather.pressure_hpa, 959.59, 5e-3);
    near(weather.temperature_k - 273.15, 1.24, 5e-3);
    near(weather.mean_temperature_k, 265.49, 5e-3);
    near(weather.vapour_hpa, 4.85, 5e-3);
    near(weather.a.hydrostatic, 0.001_210_94, 5e-9);
    near(weather.a.wet, 0.000_539_70, 5e-9);
    near(weather.vapour_decrease, 2.5189, 5e-5);
    near(weather.undulation_m, 45.784, 5e-4);
    near(zenith_hydrostatic_m(graz, weather.pressure_hpa), 2.1847, 5e-5);
    near(vienna::zenith_wet_m(&weather), 0.0580, 5e-5);
    // VMF3's factors; VMF1's b and c move them by 2e-4 at 30°, 1e-3 at 10° and 1e-2 at 5°, no more.
    for (elevation, dry, wet, off) in
        [(30.0, 1.9929, 1.9968, 2e-4), (10.0, 5.5586, 5.6640, 1e-3), (5.0, 10.1638, 10.7955, 1e-2)]
    {
        let found = vienna(weather.a, graz, f64::to_radians(elevation), 1.0);
        near(found.0, dry, off);
        near(found.1, wet, off);
    }
}

#[test]
fn a_mapping_grid_has_its_printed_values_at_its_nodes() {
    let Some(path) = external("ref/VMF3_20181125.H00") else { return };
    let grid = MappingGrid::read(&std::fs::read(path).unwrap(), "VMF3_20181125.H00").unwrap();
    // The node that Orekit's tests quote, and the first line of the file.
    for (latitude, longitude, dry, wet) in
        [(37.5, 277.5, 0.001_234_62, 0.000_471_01), (87.5, 2.5, 0.001_159_27, 0.000_741_58)]
    {
        let found = grid.at(f64::to_radians(latitude), f64::to_radians(longitude));
        assert!((found.hydrostatic - dry).abs() < 1e-14 && (found.wet - wet).abs() < 1e-14, "{found:?}");
        let west = grid.at(f64::to_radians(latitude), f64::to_radians(longitude - 360.0));
        assert!((west.hydrostatic - dry).abs() < 1e-14);
    }
    let damaged = Gpt3::read(b"% comment\n 87.5 2.5 1\n", "grid").unwrap_err().to_string();
    assert!(damaged.starts_with("grid:2") && damaged.contains("64 numbers"), "{damaged}");
}
