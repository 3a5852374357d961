//! Height of mean sea level above the WGS 84 ellipsoid: the geoid EGM96.
//!
//! Source: NASA and NIMA (now NGA), EGM96, 1996, in the public domain: every fourth node of its 15' grid
//! `WW15MGH`, in whole centimetres, in `data/egm96_1deg.bin`. Values between nodes are bilinear. Limit: over
//! the whole grid of 15' the interpolation differs from it by 0.48 m (root mean square by area), by at most
//! 1.9 m at 95 % of the nodes, and by 13.7 m at worst, in Hawaii. A height that is written with its
//! separation loses nothing by that: their sum is the height above the ellipsoid.

/// Rows from the south pole to the north pole, each from 0° to 359° east; big-endian, centimetres.
static GRID: &[u8; 2 * ROWS * COLUMNS] = include_bytes!("data/egm96_1deg.bin");
const ROWS: usize = 181;
const COLUMNS: usize = 360;

fn node_m(row: usize, column: usize) -> f64 {
    let from = 2 * (row * COLUMNS + column % COLUMNS);
    GRID.get(from..from + 2).map_or(0.0, |two| f64::from(i16::from_be_bytes([two[0], two[1]])) / 100.0)
}

/// Separation of geoid and ellipsoid in metres, positive where the sea is above the ellipsoid. Angles are in
/// radians; a longitude may be of any turn.
pub fn separation_m(latitude_rad: f64, longitude_rad: f64) -> f64 {
    let y = (latitude_rad.to_degrees() + 90.0).clamp(0.0, 180.0);
    let x = longitude_rad.to_degrees().rem_euclid(360.0);
    let (row, column) = ((y as usize).min(ROWS - 2), x as usize);
    let (v, u) = (y - row as f64, x - column as f64);
    let along = |row| (1.0 - u) * node_m(row, column) + u * node_m(row, column + 1);
    (1.0 - v) * along(row) + v * along(row + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(latitude_deg: f64, longitude_deg: f64) -> f64 {
        separation_m(f64::to_radians(latitude_deg), f64::to_radians(longitude_deg))
    }

    /// Nodes of `WW15MGH` as Debian's `proj-data` 9.1.1 has them in `egm96_15.gtx`, in every quadrant, on the
    /// seam of longitudes and at the poles. A whole centimetre is 5 mm off at most.
    #[test]
    fn nodes_are_those_of_the_published_grid() {
        let nodes = [
            (90.0, 0.0, 13.6062),
            (-90.0, 0.0, -29.5338),
            (0.0, 0.0, 17.1616),
            (38.0, -90.0, -30.2623),
            (27.0, 80.0, -63.1887),
            (28.0, 92.0, -30.4039),
            (-34.0, 151.0, 22.3088),
            (65.0, -19.0, 67.1822),
            (-50.0, -71.0, 12.8791),
            (5.0, 78.0, -104.6826),
            (48.0, 11.0, 45.9564),
            (0.0, 180.0, 21.1533),
            (-17.0, -180.0, 51.4342),
            (-12.0, 359.0, 11.2408),
        ];
        for (latitude_deg, longitude_deg, published_m) in nodes {
            let found_m = at(latitude_deg, longitude_deg);
            assert!((found_m - published_m).abs() <= 0.005 + 1e-9, "{latitude_deg} {longitude_deg}: {found_m}");
        }
    }

    /// Points between nodes that NGA gives with its programs (`OUTINTPT.DAT`). The interpolation in steps of
    /// 1° is off by 0.48 m in root mean square, which none of the six exceeds.
    #[test]
    fn values_between_nodes_are_near_those_that_nga_gives() {
        let points = [
            (38.628_155, 269.779_155, -31.628),
            (-14.621_217, 305.021_114, -2.969),
            (46.874_319, 102.448_729, -43.575),
            (-23.617_446, 133.874_712, 15.871),
            (38.625_473, 359.999_5, 50.066),
            (-0.466_744, 0.002_3, 17.329),
        ];
        for (latitude_deg, longitude_deg, published_m) in points {
            let found_m = at(latitude_deg, longitude_deg);
            assert!((found_m - published_m).abs() < 0.48, "{latitude_deg} {longitude_deg}: {found_m}");
            assert!((found_m - at(latitude_deg, longitude_deg - 360.0)).abs() < 1e-9);
        }
    }

    #[test]
    fn it_is_continuous_everywhere_and_answers_whatever_it_is_asked() {
        for latitude_deg in [-90.0, -89.5, -45.0, 0.0, 60.0, 89.5, 90.0] {
            for longitude_deg in [-180.0, 0.0, 1.0, 90.0, 180.0, 360.0] {
                let [before_m, after_m] = [-1e-7, 1e-7].map(|step_deg| at(latitude_deg, longitude_deg + step_deg));
                // Neighbours are 25.5 m apart at most.
                assert!(
                    (before_m - after_m).abs() < 25.5 * 2e-7 + 1e-9,
                    "{latitude_deg} {longitude_deg}: {before_m} {after_m}"
                );
            }
        }
        assert!(at(120.0, 1e6).is_finite() && at(f64::NAN, 0.0).is_nan() && at(0.0, f64::INFINITY).is_nan());
    }
}
