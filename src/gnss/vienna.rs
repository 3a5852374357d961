//! Vienna grids of the neutral atmosphere: GPT3 (weather by position and season) and the coefficients a of
//! the mapping functions, as TU Wien publishes them.
//!
//! Source: Landskron & Böhm 2018, "VMF3/GPT3: refined discrete and empirical troposphere mapping functions",
//! and the columns that head the files. Values are bilinear between nodes; beyond the last row towards a pole
//! that row's values hold. Limits: gradients are not read; a mapping grid is one epoch's. VMF3's b and c are
//! in [`super::vmf3`].

use std::f64::consts::TAU;

use thiserror::Error;

use crate::inflate::{InflateError, inflate};

/// Largest file that is read, in bytes after decompression: the 1° grid of GPT3 has 27 MB.
pub const LARGEST_BYTES: u64 = 64 << 20;
/// Gravity (m/s²), molar mass of dry air (kg/mol) and gas constant (J/K/mol) as GPT3 has them.
const GRAVITY_MPS2: f64 = 9.806_65;
const MOLAR_MASS_KGPMOL: f64 = 28.965e-3;
const GAS_JPKMOL: f64 = 8.3143;
const YEAR_DAYS: f64 = 365.25;

/// Reason for which a file contains no usable grid.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ViennaError {
    /// A file that cannot be decompressed.
    #[error("{name}: {source}: expected a grid, plain or gzip")]
    Packed {
        /// Name of the file.
        name: String,
        /// Error of unpacking.
        source: InflateError,
    },
    /// A line that is not as the format has it.
    #[error("{name}:{line}: {found}: expected {expected}")]
    Line {
        /// Name of the file.
        name: String,
        /// Line number, from 1.
        line: usize,
        /// Text that was found.
        found: String,
        /// Text that is expected.
        expected: String,
    },
}

/// The text of a file, plain or gzip.
fn unpack(bytes: &[u8], name: &str) -> Result<String, ViennaError> {
    let bytes =
        inflate(bytes, LARGEST_BYTES).map_err(|source| ViennaError::Packed { name: name.to_owned(), source })?;
    Ok(String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned()))
}

/// Values at the nodes of a regular grid of the globe, from north to south and from west to east.
#[derive(Clone, Debug, PartialEq)]
struct Globe<T> {
    north_deg: f64,
    west_deg: f64,
    latitude_step_deg: f64,
    longitude_step_deg: f64,
    columns: usize,
    nodes: Vec<T>,
}

impl<T> Globe<T> {
    /// Reads rows of `columns` numbers that begin with latitude and longitude in degrees; lines that begin
    /// with `!` or `%` are comments. `ranges` are columns with the least and the largest value that they may
    /// hold.
    fn read(
        text: &str,
        name: &str,
        columns: usize,
        ranges: &[(usize, f64, f64)],
        node: impl Fn(&[f64]) -> T,
    ) -> Result<Self, ViennaError> {
        let wrong = |line: usize, found: String, expected: &str| ViennaError::Line {
            name: name.to_owned(),
            line,
            found,
            expected: expected.to_owned(),
        };
        let (mut nodes, mut places) = (Vec::new(), Vec::new());
        for (index, line) in text.lines().enumerate() {
            if line.trim_start().starts_with(['!', '%']) || line.trim().is_empty() {
                continue;
            }
            let fields: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse::<f64>).collect();
            match fields {
                Ok(fields) if fields.len() == columns && fields.iter().all(|x| x.is_finite()) => {
                    let [latitude_deg, longitude_deg] =
                        [fields.first(), fields.get(1)].map(|x| x.copied().unwrap_or(0.0));
                    for &(column, low, high) in ranges {
                        let value = fields.get(column).copied().unwrap_or(f64::NAN);
                        if !(low..=high).contains(&value) {
                            let found = format!("number {} of the line is {value}", column + 1);
                            return Err(wrong(index + 1, found, &format!("{low} to {high}")));
                        }
                    }
                    places.push((index + 1, latitude_deg, longitude_deg));
                    nodes.push(node(&fields));
                }
                _ => {
                    let found = line.chars().take(40).collect::<String>();
                    return Err(wrong(index + 1, format!("'{found}'"), &format!("{columns} numbers")));
                }
            }
        }
        let end = |expected: &str| wrong(text.lines().count(), format!("{} nodes", places.len()), expected);
        let Some(&(_, north_deg, west_deg)) = places.first() else { return Err(end("a grid of the globe")) };
        let columns = places.iter().take_while(|(_, latitude_deg, _)| *latitude_deg == north_deg).count();
        let Some(&(_, second_deg, _)) = places.get(columns) else { return Err(end("more than one row")) };
        let longitude_step_deg = 360.0 / columns as f64;
        let latitude_step_deg = north_deg - second_deg;
        for (index, &(line, latitude_deg, longitude_deg)) in places.iter().enumerate() {
            let (row, column) = (index / columns, index % columns);
            let expected = (north_deg - row as f64 * latitude_step_deg, west_deg + column as f64 * longitude_step_deg);
            // Longitudes may count from -180 on after 180; positions are printed to 0.01 degrees.
            let turned_deg = (longitude_deg - expected.1 + 180.0).rem_euclid(360.0) - 180.0;
            if (latitude_deg - expected.0).abs() > 0.01 || turned_deg.abs() > 0.01 {
                let found = format!("node {latitude_deg}, {longitude_deg}");
                return Err(wrong(line, found, &format!("node {:.2}, {:.2}", expected.0, expected.1)));
            }
        }
        let south_deg = north_deg - (places.len() / columns - 1) as f64 * latitude_step_deg;
        if places.len() % columns != 0 || north_deg < 85.0 || south_deg > -85.0 {
            return Err(end("whole rows from pole to pole"));
        }
        Ok(Self { north_deg, west_deg, latitude_step_deg, longitude_step_deg, columns, nodes })
    }

    /// The four nodes around a position and their weights, which add up to one.
    fn around(&self, latitude_rad: f64, longitude_rad: f64) -> [(f64, Option<&T>); 4] {
        let rows = self.nodes.len() / self.columns;
        let row = (self.north_deg - latitude_rad.to_degrees()) / self.latitude_step_deg;
        let row = row.clamp(0.0, (rows - 1) as f64);
        let column = (longitude_rad.to_degrees() - self.west_deg) / self.longitude_step_deg;
        let column = column.rem_euclid(self.columns as f64);
        let (down, across) = (row - row.floor(), column - column.floor());
        let node = |i: usize, j: usize| {
            let row = (row as usize + i).min(rows - 1);
            self.nodes.get(row * self.columns + (column as usize + j) % self.columns)
        };
        [
            ((1.0 - down) * (1.0 - across), node(0, 0)),
            ((1.0 - down) * across, node(0, 1)),
            (down * (1.0 - across), node(1, 0)),
            (down * across, node(1, 1)),
        ]
    }
}

/// Coefficients a of the mapping functions at zero height.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MappingA {
    /// Coefficient a of dry air.
    pub hydrostatic: f64,
    /// Coefficient a of water vapour.
    pub wet: f64,
}

/// Mapping functions to which coefficients a belong; each has its own coefficients b and c.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Vienna {
    /// Vienna mapping functions 1.
    Vmf1,
    /// Vienna mapping functions 3.
    Vmf3,
}

/// Grid of one epoch from a file `VMF1_…` or `VMF3_…`: latitude, longitude, a_h and a_w. The file's zenith
/// delays are not read.
#[derive(Clone, Debug, PartialEq)]
pub struct MappingGrid {
    globe: Globe<MappingA>,
    /// Mapping functions that the heading's line `Data_types` names, if there is one.
    pub fitted_with: Option<Vienna>,
}

impl MappingGrid {
    /// Reads a grid, plain or gzip, whose `name` goes into errors.
    ///
    /// # Errors
    /// [`ViennaError`] with the line that is not as the format has it.
    pub fn read(bytes: &[u8], name: &str) -> Result<Self, ViennaError> {
        let node = |fields: &[f64]| MappingA {
            hydrostatic: fields.get(2).copied().unwrap_or(f64::NAN),
            wet: fields.get(3).copied().unwrap_or(f64::NAN),
        };
        let text = unpack(bytes, name)?;
        let heading =
            text.lines().find(|line| line.starts_with('!') && line.contains("Data_types")).unwrap_or_default();
        let kinds = [("VMF1", Vienna::Vmf1), ("VMF3", Vienna::Vmf3)];
        let fitted_with = kinds.into_iter().find(|(word, _)| heading.contains(word)).map(|(_, kind)| kind);
        Ok(Self { globe: Globe::read(&text, name, 6, &[(2, 1e-5, 1e-2), (3, 1e-5, 1e-2)], node)?, fitted_with })
    }

    /// The coefficients at a position.
    pub fn at(&self, latitude_rad: f64, longitude_rad: f64) -> MappingA {
        let mut sum = MappingA::default();
        for (weight, node) in self.globe.around(latitude_rad, longitude_rad) {
            let Some(node) = node else { continue };
            sum.hydrostatic += weight * node.hydrostatic;
            sum.wet += weight * node.wet;
        }
        sum
    }
}

/// A mean, and the amplitudes of the year's cosine and sine and the half year's.
pub(super) type Season = [f64; 5];

/// Factors of a mean and its seasonal amplitudes on a day of the year, which counts from 1.0.
pub(super) fn season_terms(day_of_year: f64) -> Season {
    let (sin, cos) = libm::sincos(TAU * day_of_year / YEAR_DAYS);
    // Double angles are those of the half year.
    [1.0, cos, sin, cos * cos - sin * sin, 2.0 * sin * cos]
}

/// One node of GPT3, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Climate {
    pressure_pa: Season,
    temperature_k: Season,
    /// Specific humidity in kg/kg; then the lapse rate in K/m, and the geoid undulation in metres.
    humidity: Season,
    lapse_kpm: Season,
    undulation_m: f64,
    /// Height of the node's ground above the geoid, in metres.
    ground_m: f64,
    a_hydrostatic: Season,
    a_wet: Season,
    vapour_decrease: Season,
    mean_temperature_k: Season,
}

/// Weather that GPT3 gives for a position on a day of the year.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gpt3Weather {
    /// Pressure of the air, in hPa.
    pub pressure_hpa: f64,
    /// Temperature of the air.
    pub temperature_k: f64,
    /// Pressure of the water vapour, in hPa.
    pub vapour_hpa: f64,
    /// Mean temperature of the water vapour above.
    pub mean_temperature_k: f64,
    /// Exponent of the vapour's decrease relative to pressure, less one.
    pub vapour_decrease: f64,
    /// Coefficients of the mapping functions.
    pub a: MappingA,
    /// Height of the geoid above the ellipsoid, in metres.
    pub undulation_m: f64,
}

/// Empirical model GPT3 on its grid of 5° (`gpt3_5.grd`) or 1°.
#[derive(Clone, Debug, PartialEq)]
pub struct Gpt3(Globe<Climate>);

impl Gpt3 {
    /// Reads the grid, plain or gzip, whose `name` goes into errors.
    ///
    /// # Errors
    /// [`ViennaError`] with the line that is not as the format has it.
    pub fn read(bytes: &[u8], name: &str) -> Result<Self, ViennaError> {
        let node = |fields: &[f64]| {
            let season =
                |from: usize, scale: f64| [0, 1, 2, 3, 4].map(|k| fields.get(from + k).map_or(f64::NAN, |x| x * scale));
            let single = |at: usize| fields.get(at).copied().unwrap_or(f64::NAN);
            Climate {
                pressure_pa: season(2, 1.0),
                temperature_k: season(7, 1.0),
                humidity: season(12, 1e-3),
                lapse_kpm: season(17, 1e-3),
                undulation_m: single(22),
                ground_m: single(23),
                a_hydrostatic: season(24, 1e-3),
                a_wet: season(29, 1e-3),
                vapour_decrease: season(34, 1.0),
                mean_temperature_k: season(39, 1.0),
            }
        };
        // Mean pressure (Pa), temperature (K) and thousands of both coefficients.
        let ranges = [(2, 3e4, 1.1e5), (7, 200.0, 320.0), (24, 0.1, 10.0), (29, 0.01, 10.0)];
        Globe::read(&unpack(bytes, name)?, name, 64, &ranges, node).map(Self)
    }

    /// Weather at a position and ellipsoidal height, on a day of the year that counts from 1.0.
    pub fn at(&self, latitude_rad: f64, longitude_rad: f64, height_m: f64, day_of_year: f64) -> Gpt3Weather {
        let terms = season_terms(day_of_year);
        let season = |values: &Season| values.iter().zip(terms).map(|(value, term)| value * term).sum::<f64>();
        let mut sum = Gpt3Weather::default();
        for (weight, node) in self.0.around(latitude_rad, longitude_rad) {
            let Some(node) = node else { continue };
            let above_m = height_m - node.undulation_m - node.ground_m;
            let (ground_pa, humidity) = (season(&node.pressure_pa), season(&node.humidity));
            let ground_k = season(&node.temperature_k);
            let virtual_k = ground_k * (1.0 + 0.6077 * humidity);
            let decay = libm::exp(-GRAVITY_MPS2 * MOLAR_MASS_KGPMOL / (GAS_JPKMOL * virtual_k) * above_m);
            let vapour_decrease = season(&node.vapour_decrease);
            let ground_vapour_pa = humidity * ground_pa / (0.622 + 0.378 * humidity);
            sum.pressure_hpa += weight * ground_pa * decay / 100.0;
            sum.temperature_k += weight * (ground_k + season(&node.lapse_kpm) * above_m);
            sum.vapour_hpa += weight * ground_vapour_pa * libm::pow(decay, vapour_decrease + 1.0) / 100.0;
            sum.mean_temperature_k += weight * season(&node.mean_temperature_k);
            sum.vapour_decrease += weight * vapour_decrease;
            sum.a.hydrostatic += weight * season(&node.a_hydrostatic);
            sum.a.wet += weight * season(&node.a_wet);
            sum.undulation_m += weight * node.undulation_m;
        }
        sum
    }
}

/// Zenith wet delay in metres (Askne & Nordius 1987, with the refractivities of Bevis et al. 1994 as in
/// GPT3).
pub fn zenith_wet_m(weather: &Gpt3Weather) -> f64 {
    const K1_KPHPA: f64 = 77.604;
    const K2_KPHPA: f64 = 64.79;
    const K3_K2PHPA: f64 = 377_600.0;
    // Molar masses of vapour and dry air.
    let k2_prime = K2_KPHPA - K1_KPHPA * 18.0152 / 28.9644;
    let dry_gas = GAS_JPKMOL / MOLAR_MASS_KGPMOL;
    1e-6 * (k2_prime + K3_K2PHPA / weather.mean_temperature_k) * dry_gas * weather.vapour_hpa
        / ((weather.vapour_decrease + 1.0) * GRAVITY_MPS2)
}
