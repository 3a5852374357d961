use std::io::Read;

use super::Interpolation::{Bicubic, Bilinear};
use super::*;

/// IGS combined rapid map of 2010-12-04, every two hours.
const IGS: &[u8] = include_bytes!("../../../scenarios/igrg3380.10i.gz");

fn text() -> String {
    let mut text = String::new();
    flate2::read::GzDecoder::new(IGS).read_to_string(&mut text).unwrap();
    text
}

fn maps() -> Maps {
    Maps::read(IGS, "igrg3380.10i.gz").unwrap()
}

fn tecu(maps: &Maps, latitude_deg: f64, longitude_deg: f64, at: &str, how: Interpolation) -> f64 {
    let at = Epoch::parse(at).unwrap();
    maps.vertical_tecu(latitude_deg.to_radians(), longitude_deg.to_radians(), at, how)
}

#[test]
fn a_node_at_a_map_s_epoch_has_the_printed_value() {
    let maps = maps();
    let (first, last) = maps.span();
    assert_eq!(
        (first, last),
        (Epoch::parse("2010-12-04T00:00:00Z").unwrap(), Epoch::parse("2010-12-05T00:00:00Z").unwrap())
    );
    assert_eq!((maps.radius_m, maps.height_m), (6_371e3, 450e3));
    // Every value of every map, read off the text by its columns alone.
    let text = text();
    let (mut epoch, mut row, mut column, mut checked) = (Epoch::new(0, 0.0), 0.0, 0, 0);
    for line in text.lines().skip_while(|line| !line.ends_with("START OF TEC MAP")) {
        if line.contains("START OF RMS MAP") {
            break;
        } else if line.contains("EPOCH OF CURRENT MAP") {
            let fields: Vec<f64> = line[..36].split_whitespace().map(|x| x.parse().unwrap()).collect();
            let midnight = Epoch::parse("2010-12-01T00:00:00Z").unwrap();
            epoch = midnight.plus_s((fields[2] - 1.0) * 86_400.0 + fields[3] * 3600.0);
        } else if line.contains("LAT/LON1") {
            (row, column) = (line[2..8].trim().parse::<f64>().unwrap(), 0);
        } else if line.get(60..).is_none_or(|label| !label.contains("MAP")) {
            for value in line.split_whitespace() {
                let longitude = -180.0 + 5.0 * f64::from(column);
                for how in [Bilinear, Bicubic] {
                    let (latitude_rad, longitude_rad) = (f64::to_radians(row), f64::to_radians(longitude));
                    let found = maps.vertical_tecu(latitude_rad, longitude_rad, epoch, how);
                    // Degrees through radians and back are off by 1e-14 of a step times 1000 units of slope.
                    let printed = value.parse::<f64>().unwrap() / 10.0;
                    assert!((found - printed).abs() < 1e-9, "{row} {longitude} {epoch}: {found} {printed}");
                }
                (column, checked) = (column + 1, checked + 1);
            }
        }
    }
    assert_eq!(checked, 13 * 71 * 73);
}

#[test]
fn between_nodes_and_maps_the_value_is_that_of_the_format_s_equations() {
    let maps = maps();
    // 02:00 UT is a map: the middle of a cell is the mean of its four printed nodes (equation 1 with p = q =
    // 1/2).
    let at = |latitude: f64, longitude: f64| tecu(&maps, latitude, longitude, "2010-12-04T02:00:00Z", Bilinear);
    let mean = (at(20.0, 100.0) + at(20.0, 105.0) + at(22.5, 100.0) + at(22.5, 105.0)) / 4.0;
    assert!((at(21.25, 102.5) - mean).abs() < 1e-9);
    // A third of the way from 02 to 04 h: equation 3 with both maps turned by 10° and −20°, which are whole
    // columns.
    let now = tecu(&maps, 20.0, 100.0, "2010-12-04T02:40:00Z", Bilinear);
    let early = tecu(&maps, 20.0, 110.0, "2010-12-04T02:00:00Z", Bilinear);
    let late = tecu(&maps, 20.0, 80.0, "2010-12-04T04:00:00Z", Bilinear);
    assert!((now - (2.0 * early + late) / 3.0).abs() < 1e-9, "{now} {early} {late}");
}

#[test]
fn the_globe_closes_at_the_antimeridian_and_holds_at_the_poles() {
    let maps = maps();
    for how in [Bilinear, Bicubic] {
        let at = |latitude: f64, longitude: f64| tecu(&maps, latitude, longitude, "2010-12-04T13:17:00Z", how);
        for longitude in [-360.0, 0.0, 360.0, 720.0] {
            assert!((at(-12.3, 179.3 + longitude) - at(-12.3, 179.3)).abs() < 1e-9);
        }
        assert!((at(10.0, 180.0 - 1e-7) - at(10.0, -180.0 + 1e-7)).abs() < 1e-5);
        assert_eq!(at(90.0, 33.0), at(87.5, 33.0));
    }
}

#[test]
fn the_bicubic_surface_has_a_continuous_slope_and_the_bilinear_one_has_not() {
    let maps = maps();
    let kink = |how: Interpolation| {
        let at = |longitude: f64| tecu(&maps, 3.0, longitude, "2010-12-04T06:00:00Z", how);
        let step = 1e-4;
        (-36..36).map(f64::from).fold(0.0_f64, |worst, k| {
            let node = 5.0 * k;
            worst.max(((at(node + step) - at(node)) - (at(node) - at(node - step))).abs() / step)
        })
    };
    // Nodes 5° apart differ by up to 5 units: a second derivative of 1 over 1e-4° leaves 1e-4.
    let (bilinear, bicubic) = (kink(Bilinear), kink(Bicubic));
    assert!(bilinear > 0.1 && bicubic < 1e-3, "{bilinear} {bicubic}");
}

#[test]
fn a_damaged_file_is_refused_with_its_line() {
    let whole = text();
    let refuse = |from: &str, to: &str| {
        let damaged = whole.replacen(from, to, 1);
        assert!(damaged != whole, "{from} is not in the file");
        Maps::read(damaged.as_bytes(), "map").unwrap_err().to_string()
    };
    for (from, to, place, expected) in [
        ("   42   42   42", "   42   4x   42", "map:491", "columns 6 to 10"),
        ("   42   42   42", "   42 9999   42", "map:491", "a value at every node"),
        ("    85.0-180.0 180.0", "    82.5-180.0 180.0", "map:496", "row of latitude 85.0"),
        ("  2010    12     4     2", "  2010    13     4     2", "map:", "year, month"),
        ("  2010    12     4     2", "  2010    12     3     2", "map:", "ascending"),
        ("IONOSPHERE MAPS", "NAVIGATION DATA", "map:1", "type I"),
        ("  6371.0 ", "  637x.0 ", "map:", "columns 1 to 8"),
        (
            "     2                                                      MAP DIM",
            "     3                                                      MAP DIM",
            "map:",
            "two-dimensional",
        ),
        ("    87.5 -87.5  -2.5", "    60.0  30.0  -2.5", "map", "whole globe"),
        ("  -180.0 180.0   5.0 ", "     0.0  60.0   5.0 ", "map", "whole globe"),
        ("  -180.0 180.0   5.0 ", "  -180.0 180.0   0.0 ", "map:", "whole number of steps"),
        ("BASE RADIUS", "BASE RADIUM", "map", "BASE RADIUS"),
    ] {
        let error = refuse(from, to);
        assert!(error.starts_with(place) && error.contains(expected), "{error}");
    }
    let cut = |bytes: usize| Maps::read(&whole.as_bytes()[..bytes], "map").unwrap_err().to_string();
    assert!(cut(100).contains("END OF HEADER"), "{}", cut(100));
    let row = whole.find("    85.0-180.0").unwrap();
    assert!(cut(row).contains("END OF TEC MAP before the file ends"), "{}", cut(row));
    assert!(Maps::read(&IGS[..1000], "map").unwrap_err().to_string().contains("gzip"));
    assert!(Maps::read(b"", "map").is_err());
    let one = whole.find("END OF TEC MAP").unwrap() + 15;
    assert!(cut(one).contains("at least two"), "{}", cut(one));
}

proptest::proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(line in 0_usize..600, garbage in "\\PC{0,80}") {
        let whole = text();
        let instead = |(n, text)| if n == line { garbage.as_str() } else { text };
        let damaged: Vec<&str> = whole.lines().take(1000).enumerate().map(instead).collect();
        let _ = Maps::read(damaged.join("\n").as_bytes(), "map");
        let _ = Maps::read(garbage.as_bytes(), "map");
    }
}
