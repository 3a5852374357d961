//! Tables of NeQuick-G: the grid of the modified dip, and the ITU's monthly maps of the F2 layer.
//!
//! Source: the document's annexes; the maps are those of ITU-R P.1239. `maps.bin` holds, little-endian, for
//! every month the F2 layer's critical frequency (quiet and active Sun, 76 functions of the position, 13 of
//! the time) and the transmission factor M(3000)F2 (49 and 9) as `f64`, and then the dip as `i16` in
//! hundredths of a degree: 39 rows of 39, a row every 5° of latitude and a column every 10° of longitude,
//! both beginning one before −90° and −180°.

use std::f64::consts::PI;

static TABLES: &[u8] = include_bytes!("maps.bin");

/// Functions of the position and of the time in a map.
struct Map {
    places: usize,
    times: usize,
    /// Numbers in a month before those of this map.
    before: usize,
}

const FREQUENCY: Map = Map { places: 76, times: 13, before: 0 };
const FACTOR: Map = Map { places: 49, times: 9, before: 2 * 76 * 13 };
/// Numbers of one month.
const MONTH: usize = 2 * (76 * 13 + 49 * 9);
/// Rows and columns of the dip's grid.
const GRID: usize = 39;

/// Powers of the sine of the dip in the map of the frequency, for each multiple of the longitude
/// (2.5.5.3.2.2).
const FREQUENCY_POWERS: [usize; 9] = [12, 12, 9, 5, 2, 1, 1, 1, 1];
/// Powers of the sine of the dip in the map of the transmission factor, for each multiple of the longitude
/// (2.5.5.3.2.3).
const FACTOR_POWERS: [usize; 7] = [7, 8, 6, 3, 2, 1, 1];

fn number(index: usize) -> f64 {
    let bytes = TABLES.get(8 * index..8 * index + 8).and_then(|bytes| bytes.try_into().ok());
    bytes.map_or(0.0, f64::from_le_bytes)
}

fn dip_deg(row: usize, column: usize) -> f64 {
    let at = 8 * 12 * MONTH + 2 * (GRID * row + column);
    let bytes = TABLES.get(at..at + 2).and_then(|bytes| bytes.try_into().ok());
    bytes.map_or(0.0, |bytes| 0.01 * f64::from(i16::from_le_bytes(bytes)))
}

/// The maps of a month at a time and for a Sun: coefficients of the functions of the position.
#[derive(Clone, Debug)]
pub struct Maps {
    frequency: Vec<f64>,
    factor: Vec<f64>,
}

impl Maps {
    /// Creates the maps of a `month` (1 to 12) at `ut_h` hours for an effective number of sunspots
    /// (2.5.5.3.2.1).
    pub fn new(month: u8, ut_h: f64, sunspots: f64) -> Self {
        let month = usize::from(month.clamp(1, 12)) - 1;
        let turn_rad = (15.0 * ut_h - 180.0).to_radians();
        let times: Vec<f64> = std::iter::once(1.0)
            .chain((1..=6).flat_map(|multiple| {
                let (sin, cos) = libm::sincos(f64::from(multiple) * turn_rad);
                [sin, cos]
            }))
            .collect();
        let active = 0.01 * sunspots;
        let of = |map: Map| -> Vec<f64> {
            let size = map.places * map.times;
            let first = month * MONTH + map.before;
            let place = |place: usize| {
                let one = |(time, function): (usize, &f64)| {
                    let index = first + place * map.times + time;
                    function * ((1.0 - active) * number(index) + active * number(index + size))
                };
                times.iter().take(map.times).enumerate().map(one).sum()
            };
            (0..map.places).map(place).collect()
        };
        Self { frequency: of(FREQUENCY), factor: of(FACTOR) }
    }

    /// Critical frequency of the F2 layer in megahertz and its transmission factor at a position, of which
    /// the dip is `modip_deg`.
    pub fn at(&self, modip_deg: f64, latitude_cos: f64, longitude_rad: f64) -> (f64, f64) {
        let mut powers = [1.0; 12];
        let sine = libm::sin(modip_deg.to_radians());
        for index in 1..powers.len() {
            powers[index] = powers[index - 1] * sine;
        }
        let (sin, cos) = libm::sincos(longitude_rad);
        let sum = |coefficients: &[f64], used: &[usize]| {
            let mut rest = coefficients.iter();
            let (mut sum, mut latitude, mut turn) = (0.0, 1.0, (1.0, 0.0));
            for (multiple, &count) in used.iter().enumerate() {
                let mut part = 0.0;
                for power in powers.iter().take(count) {
                    let (Some(of_cos), zero) = (rest.next(), 0.0) else { break };
                    let of_sin = if multiple == 0 { &zero } else { rest.next().unwrap_or(&zero) };
                    part += power * (of_cos * turn.0 + of_sin * turn.1);
                }
                sum += latitude * part;
                latitude *= latitude_cos;
                turn = (turn.0 * cos - turn.1 * sin, turn.1 * cos + turn.0 * sin);
            }
            sum
        };
        (sum(&self.frequency, &FREQUENCY_POWERS), sum(&self.factor, &FACTOR_POWERS).max(1.0))
    }
}

/// The modified dip at a position, in degrees (2.5.4.3).
pub fn modip_deg(latitude_rad: f64, longitude_rad: f64) -> f64 {
    let (latitude_deg, longitude_deg) = (latitude_rad * 180.0 / PI, longitude_rad * 180.0 / PI);
    if latitude_deg.abs() >= 90.0 {
        return latitude_deg.signum() * 90.0;
    }
    // The row and the column before the position, and how far it is beyond them.
    let (row, down) = cell((latitude_deg + 90.0) / 5.0, 35);
    let (column, right) = cell((longitude_deg + 180.0).rem_euclid(360.0) / 10.0, 35);
    let along = |column: usize| cubic([0, 1, 2, 3].map(|k| dip_deg(row + k, column)), down);
    cubic([0, 1, 2, 3].map(|k| along(column + k)), right)
}

/// Whole cells and the rest.
fn cell(place: f64, last: usize) -> (usize, f64) {
    let whole = (place.max(0.0) as usize).min(last);
    (whole, place - whole as f64)
}

/// The document's polynomial of third order through four values at −1, 0, 1 and 2 (2.5.7.1).
fn cubic(values: [f64; 4], place: f64) -> f64 {
    let [before, left, right, after] = values;
    let x = 2.0 * place - 1.0;
    let (sum, difference) = (right + left, right - left);
    let (outer_sum, outer_difference) = (after + before, (after - before) / 3.0);
    let (a0, a1) = (9.0 * sum - outer_sum, 9.0 * difference - outer_difference);
    let (a2, a3) = (outer_sum - sum, outer_difference - difference);
    (a0 + x * (a1 + x * (a2 + x * a3))) / 16.0
}
