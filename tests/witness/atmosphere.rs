//! Atmospheric delays against worked values of another program.

use generator::effect::mapping::{Coefficients, Mapping, vmf1, vmf3};
use generator::effect::troposphere::{zenith_hydrostatic_m, zenith_wet_m};
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::klobuchar::Klobuchar;
use gnss::time::Epoch;
use gnss::vienna::{self, Gpt3, MappingA, MappingGrid, Vienna};
use gnss::vmf3::Vmf3;

use super::data::external;

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
    // The same file: humidity 0.5 at the same place, a cosecant mapping and that program's own vapour
    // formula.
    let temperature_k = 15.0 - 6.5e-3 * 100.0 + 273.16;
    let pressure_hpa = 1013.25 * libm::pow(1.0 - 2.2557e-5 * 100.0, 5.2568);
    let vapour_hpa = 6.108 * 0.5 * libm::exp((17.15 * temperature_k - 4684.0) / (temperature_k - 38.45));
    let zenith_m = zenith_hydrostatic_m(place(), pressure_hpa) + zenith_wet_m(temperature_k, vapour_hpa);
    let slant_m = zenith_m / libm::sin(ELEVATION_RAD);
    assert!((slant_m - 2.447_998_701_440_88).abs() < 1e-8, "{slant_m}");
}

#[test]
fn gpt3_gives_what_the_authors_program_prints_for_graz() {
    // gpt3_5.m, saasthyd.m, asknewet.m and vmf3_ht.m of TU Wien, run in Octave for Graz (gnss.ell) at MJD 60
    // 310.0, which is 2024-01-01; each printed to the digits that bound it here.
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
    // VMF1's b and c move the factors by 2e-4 at 30°, 1e-3 at 10° and 1e-2 at 5°, no more.
    let bc = Vmf3::embedded().unwrap().at(graz.latitude_rad, graz.longitude_rad, 1.0);
    for (elevation, dry, wet, off) in
        [(30.0, 1.9929, 1.9968, 2e-4), (10.0, 5.5586, 5.6640, 1e-3), (5.0, 10.1638, 10.7955, 1e-2)]
    {
        let found = vmf3(weather.a, bc, graz, f64::to_radians(elevation));
        near(found.0, dry, 5e-5);
        near(found.1, wet, 5e-5);
        let found = vmf1(weather.a, graz, f64::to_radians(elevation), 1.0);
        near(found.0, dry, off);
        near(found.1, wet, off);
    }
}

/// Day of the year, seconds of that day, latitude, longitude, height, zenith distance, a_h, a_w; then the
/// factors printed.
type Printed = ([f64; 8], [f64; 2]);

/// Output of vmf3_ht.m of TU Wien in Octave for ten random places from 1982 to 2023, as the tests of iers2010
/// (github.com/xanthospap/iers2010) print it. The tenth is at 0.2° of elevation, where this program stops at
/// 1°.
#[rustfmt::skip]
const VMF3_HT: [Printed; 9] = [
    ([193.0, 63_840.313_720_4, -1.006_558_397_623_224_6, -1.269_846_006_397_009, 829.891_988_105_157_7,
        1.479_746_892_873_592_4, 0.003_573_009_869_538_646, 0.000_318_297_588_491_696_66], [8.121_899_082_072_08, 10.634_685_859_837_417]),
    ([92.0, 85_454.786_300_822, -0.999_610_057_356_385_3, -1.535_559_624_731_509_8, 2_024.084_328_148_853_3,
        1.009_382_911_196_703, 0.003_317_151_254_026_425, 0.000_276_563_069_629_145_9], [1.863_182_725_958_605, 1.877_041_709_129_812_6]),
    ([299.0, 45_968.822_588_632, -0.728_096_751_303_174_9, 0.646_579_721_587_588_4, 1_200.012_802_389_383_3,
        0.197_547_047_078_662_58, 0.016_320_441_271_823_055, 0.001_696_229_032_954_328_1], [1.019_183_700_146_594_2, 1.019_765_815_866_078]),
    ([365.0, 74_895.554_286_777, -0.143_421_503_168_819_08, 0.992_198_741_998_707_1, 1_009.329_529_676_551_4,
        0.205_924_711_386_944_96, 0.018_856_507_171_387_153, 0.001_401_940_533_142_904_1], [1.020_764_741_499_591_3, 1.021_521_453_423_524_2]),
    ([16.0, 14_428.517_423_314, -1.431_123_073_339_695_6, -1.370_891_390_550_610_6, 2_814.832_308_724_194_3,
        1.087_097_112_141_426_6, 0.010_966_365_644_944_61, 0.000_850_743_004_040_992_4], [2.070_552_000_134_979_3, 2.143_713_817_670_696]),
    ([260.0, 37_377.501_566_196, -0.024_877_477_510_830_47, -1.121_328_613_609_578_4, 1_504.494_626_368_838_2,
        0.524_818_595_598_359_6, 0.013_878_551_801_876_606, 0.001_487_592_022_419_750_6], [1.150_282_489_685_982, 1.154_941_832_791_584]),
    ([102.0, 21_841.862_341_063, -0.719_939_251_090_767_3, 2.006_684_850_039_577_3, 1_679.095_786_525_634_6,
        1.134_205_624_740_412_4, 0.002_825_562_596_402_173_5, 0.000_774_747_586_759_469], [2.335_588_285_645_833, 2.356_581_845_331_821_2]),
    ([334.0, 22_580.717_394_152, 0.824_489_492_903_653_3, -1.808_616_383_036_678_4, 83.822_848_622_028_69,
        0.333_079_405_293_400_13, 0.006_313_412_404_258_615, 0.001_510_784_883_304_944_9], [1.057_366_695_324_877, 1.057_965_731_514_443_5]),
    ([195.0, 40_460.378_009_873, 1.279_793_938_551_734_7, -1.585_092_092_504_546, 1_146.666_449_912_136_8,
        0.360_940_746_692_125_17, 0.002_807_614_575_435_422_3, 0.001_675_771_246_326_603_2], [1.068_453_283_432_329_7, 1.068_618_772_173_420_8]),
];

#[test]
fn vmf3_gives_what_the_authors_program_prints() {
    let own = Vmf3::embedded().unwrap();
    for ([day, second, latitude_rad, longitude_rad, height_m, zenith_rad, hydrostatic, wet], printed) in VMF3_HT {
        let user = Geodetic { latitude_rad, longitude_rad, height_m };
        let bc = own.at(latitude_rad, longitude_rad, day + second / 86_400.0);
        let elevation_rad = std::f64::consts::FRAC_PI_2 - zenith_rad;
        let found = vmf3(MappingA { hydrostatic, wet }, bc, user, elevation_rad);
        // Rounding of a hundred terms, 1e-17 of b, moves a factor by 1e-14 at 5°. All but 2 of the table's
        // 3380 numbers, if a tenth off, would move one of these factors by more than this.
        assert!((found.0 - printed[0]).abs() < 1e-12 && (found.1 - printed[1]).abs() < 1e-12, "{found:?} {printed:?}");
    }
    // vmf3.m at the node 37.5° N, 277.5° E of 2018-11-25, as Orekit's tests quote it to 1e-6; that program
    // has no height.
    let user = Geodetic::from_degrees(37.5, 277.5, 0.0);
    let a = MappingA { hydrostatic: 0.001_234_62, wet: 0.000_471_01 };
    let bc = own.at(user.latitude_rad, user.longitude_rad, 329.0);
    for (elevation, dry, wet) in
        [(85.0, 1.003_810, 1.003_816), (38.0, 1.621_024, 1.623_023), (5.0, 10.132_802, 10.879_154)]
    {
        let found = vmf3(a, bc, user, f64::to_radians(elevation));
        assert!((found.0 - dry).abs() < 6e-7 && (found.1 - wet).abs() < 6e-7, "{elevation}: {found:?}");
    }
}

#[test]
fn a_mapping_grid_has_its_printed_values_at_its_nodes() {
    let Some(path) = external("ref/VMF3_20181125.H00") else { return };
    let grid = MappingGrid::read(&std::fs::read(path).unwrap(), "VMF3_20181125.H00").unwrap();
    assert_eq!(grid.fitted_with, Some(Vienna::Vmf3));
    // The node that Orekit's tests quote, and the first line of the file.
    for (latitude, longitude, dry, wet) in
        [(37.5, 277.5, 0.001_234_62, 0.000_471_01), (87.5, 2.5, 0.001_159_27, 0.000_741_58)]
    {
        let found = grid.at(f64::to_radians(latitude), f64::to_radians(longitude));
        assert!((found.hydrostatic - dry).abs() < 1e-14 && (found.wet - wet).abs() < 1e-14, "{found:?}");
        let west = grid.at(f64::to_radians(latitude), f64::to_radians(longitude - 360.0));
        assert!((west.hydrostatic - dry).abs() < 1e-14);
    }
    // The whole mapping, for that node's factors at 5°: the mean year's day is half a day off the calendar's,
    // which moves them by 1.1e-5 and 8e-7.
    let mapping = Mapping::Vmf3(Coefficients::Grid(Box::new(grid)), Box::new(Vmf3::embedded().unwrap()));
    let at = Epoch::parse("2018-11-25T00:00:00").unwrap();
    let found = mapping.factors(Geodetic::from_degrees(37.5, 277.5, 0.0), 5_f64.to_radians(), at);
    assert!((found.0 - 10.132_802).abs() < 1.2e-5 && (found.1 - 10.879_154).abs() < 2e-6, "{found:?}");
    let damaged = Gpt3::read(b"% comment\n 87.5 2.5 1\n", "grid").unwrap_err().to_string();
    assert!(damaged.starts_with("grid:2") && damaged.contains("64 numbers"), "{damaged}");
}
