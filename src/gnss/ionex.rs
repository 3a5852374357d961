//! IONEX files: global maps of the ionosphere's vertical electron content, and interpolation in them.
//!
//! Source: Schaer, Gurtner & Feltens 1998, "IONEX: The IONosphere Map EXchange Format Version 1". Between two
//! maps the value is linear in time, each map turned with the Sun by the time since it (their equation 3);
//! between nodes it is bilinear (their equation 1) or, with a continuous slope, bicubic (Catmull & Rom 1974).
//! Limits: only two-dimensional maps of the whole globe without gaps; beyond the last row towards a pole that
//! row's values hold.

use std::f64::consts::TAU;

use thiserror::Error;

use crate::inflate::{InflateError, inflate};
use crate::time::Epoch;

/// Largest file that is read, in bytes after decompression.
pub const LARGEST_BYTES: u64 = 64 << 20;
/// Values of all maps at most: 32 MiB of memory, 62 days of the IGS's maps.
const MOST_VALUES: usize = 4 << 20;
/// Value that a map contains where the electron content is unknown.
const NO_VALUE: f64 = 9999.0;
const DAY_S: f64 = 86_400.0;
/// A grid that ends farther from a pole than this is not one of the globe.
const POLAR_GAP_DEG: f64 = 5.0;

/// Method of interpolation between nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Bilinear interpolation from four nodes, as the format's authors propose and every user of the maps
    /// does; its slope has steps.
    Bilinear,
    /// Bicubic interpolation from sixteen nodes, through each of them, with a continuous slope.
    Bicubic,
}

/// Sequence of global maps of vertical electron content.
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    /// One for each map, ascending, at least two.
    epochs: Vec<Epoch>,
    latitudes: Axis,
    /// Longitudes of the grid, without a last column that repeats the first one.
    longitudes: Axis,
    /// Radius of the Earth in metres, as the header gives it.
    pub radius_m: f64,
    /// Height of the shell above the Earth's radius, in metres.
    pub height_m: f64,
    /// TEC units (1e16 electrons/m²): by map, latitude, longitude.
    values_tecu: Vec<f64>,
}

/// Evenly spaced nodes, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    first_deg: f64,
    step_deg: f64,
    count: usize,
}

/// Reason for which a file contains no usable maps.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IonexError {
    /// A file that cannot be decompressed.
    #[error("{name}: {source}: expected an IONEX file, plain or gzip")]
    Packed {
        /// Name of the file.
        name: String,
        /// Error of unpacking.
        source: InflateError,
    },
    /// A line that is not as the format has it.
    #[error("{name}:{line}: '{found}': expected {expected}")]
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
    /// A file that lacks something as a whole.
    #[error("{name}: {found}: expected {expected}")]
    Whole {
        /// Name of the file.
        name: String,
        /// Text that was found.
        found: String,
        /// Text that is expected.
        expected: String,
    },
}

impl Maps {
    /// Reads an IONEX file, plain or gzip, whose `name` goes into errors.
    ///
    /// # Errors
    /// [`IonexError`] with the line that is not as the format has it.
    pub fn read(bytes: &[u8], name: &str) -> Result<Self, IonexError> {
        let bytes =
            inflate(bytes, LARGEST_BYTES).map_err(|source| IonexError::Packed { name: name.to_owned(), source })?;
        let text = String::from_utf8_lossy(&bytes);
        Reader::new(&text, name).maps()
    }

    /// Returns the instants of the first and the last map.
    pub fn span(&self) -> (Epoch, Epoch) {
        let first = self.epochs.first().copied().unwrap_or(Epoch::new(0, 0.0));
        (first, self.epochs.last().copied().unwrap_or(first))
    }

    /// Vertical electron content in TEC units above a position (longitude of any turn) at GPS time `at`.
    ///
    /// Outside the [`Self::span`] the nearest pair of maps is carried on.
    pub fn vertical_tecu(&self, latitude_rad: f64, longitude_rad: f64, at: Epoch, how: Interpolation) -> f64 {
        let later = self.epochs.partition_point(|epoch| epoch.since(at) <= 0.0).clamp(1, self.epochs.len() - 1);
        let map = |index: usize| {
            let since_s = self.epochs.get(index).map_or(0.0, |epoch| at.since(*epoch));
            // The Sun's longitude falls with time: what is here now was east of here before.
            let longitude_rad = longitude_rad + TAU * since_s / DAY_S;
            (since_s, self.at_node(index, latitude_rad.to_degrees(), longitude_rad.to_degrees(), how))
        };
        let ((before_s, before), (after_s, after)) = (map(later - 1), map(later));
        (before * -after_s + after * before_s) / (before_s - after_s)
    }

    /// A value of one map, by position in degrees.
    fn at_node(&self, map: usize, latitude_deg: f64, longitude_deg: f64, how: Interpolation) -> f64 {
        let (rows, columns) = (self.latitudes.count, self.longitudes.count);
        let row = self.latitudes.place(latitude_deg).clamp(0.0, (rows - 1) as f64);
        let column = self.longitudes.place(longitude_deg).rem_euclid(columns as f64);
        let value = |row: i64, column: i64| {
            let row = row.clamp(0, rows as i64 - 1) as usize;
            let column = column.rem_euclid(columns as i64) as usize;
            self.values_tecu.get((map * rows + row) * columns + column).copied().unwrap_or(f64::NAN)
        };
        let (down, across) = (weights(row - row.floor(), how), weights(column - column.floor(), how));
        let (row, column) = (row.floor() as i64, column.floor() as i64);
        let mut sum = 0.0;
        for (i, down) in (-1..).zip(down) {
            for (j, across) in (-1..).zip(across) {
                // A node without weight may lie outside the grid.
                if down != 0.0 && across != 0.0 {
                    sum += down * across * value(row + i, column + j);
                }
            }
        }
        sum
    }
}

impl Axis {
    /// The position of a coordinate between the nodes, counted from the first.
    fn place(&self, degrees: f64) -> f64 {
        (degrees - self.first_deg) / self.step_deg
    }

    fn last_deg(&self) -> f64 {
        self.first_deg + self.step_deg * (self.count - 1) as f64
    }
}

/// Weights of the nodes at −1, 0, 1 and 2 for a point at `u` in [0, 1).
fn weights(u: f64, how: Interpolation) -> [f64; 4] {
    match how {
        Interpolation::Bilinear => [0.0, 1.0 - u, u, 0.0],
        Interpolation::Bicubic => [
            0.5 * u * (u * (2.0 - u) - 1.0),
            0.5 * (u * u * (3.0 * u - 5.0) + 2.0),
            0.5 * u * (u * (4.0 - 3.0 * u) + 1.0),
            0.5 * u * u * (u - 1.0),
        ],
    }
}

/// Header values that are needed to read the maps.
#[derive(Default)]
struct Header {
    radius_m: Option<f64>,
    height_m: Option<f64>,
    latitudes: Option<Axis>,
    longitudes: Option<Axis>,
    /// Power of ten of the values' unit in TEC units; −1 unless given.
    exponent: Option<i32>,
}

/// Lines with their numbers, and the data that were read from them.
struct Reader<'t> {
    lines: std::iter::Enumerate<std::str::Lines<'t>>,
    /// Number (from 1) and text of the last line.
    line: usize,
    text: &'t str,
    name: &'t str,
}

impl<'t> Reader<'t> {
    fn new(text: &'t str, name: &'t str) -> Self {
        Self { lines: text.lines().enumerate(), line: 0, text: "", name }
    }

    fn maps(mut self) -> Result<Maps, IonexError> {
        let header = self.header()?;
        let missing = |what: &str| self.whole("a header without it", what);
        let latitudes = header.latitudes.ok_or_else(|| missing("a line LAT1 / LAT2 / DLAT"))?;
        let longitudes = header.longitudes.ok_or_else(|| missing("a line LON1 / LON2 / DLON"))?;
        let mut maps = Maps {
            epochs: Vec::new(),
            latitudes,
            longitudes,
            radius_m: header.radius_m.ok_or_else(|| missing("a line BASE RADIUS"))?,
            height_m: header.height_m.ok_or_else(|| missing("a line HGT1 / HGT2 / DHGT"))?,
            values_tecu: Vec::new(),
        };
        self.globe(&mut maps)?;
        let exponent = header.exponent.unwrap_or(-1);
        while self.next() {
            match self.label() {
                "START OF TEC MAP" => self.map(&mut maps, exponent)?,
                "START OF RMS MAP" => self.skip("END OF RMS MAP")?,
                "START OF HEIGHT MAP" => self.skip("END OF HEIGHT MAP")?,
                "END OF FILE" => break,
                _ => return Err(self.wrong("START OF TEC MAP, START OF RMS MAP or END OF FILE")),
            }
        }
        if maps.epochs.len() < 2 {
            return Err(self.whole(&format!("{} maps", maps.epochs.len()), "at least two, between which time passes"));
        }
        Ok(maps)
    }

    fn header(&mut self) -> Result<Header, IonexError> {
        let mut header = Header::default();
        self.next();
        if self.label() != "IONEX VERSION / TYPE" || self.text.get(20..21) != Some("I") {
            return Err(self.wrong("a first line of type I that ends in IONEX VERSION / TYPE"));
        }
        while self.next() {
            match self.label() {
                "MAP DIMENSION" if self.number(0, 6)? != 2.0 => return Err(self.wrong("two-dimensional maps")),
                "BASE RADIUS" => header.radius_m = Some(self.within(0, 8, 6000.0..=7000.0, "km")? * 1e3),
                "HGT1 / HGT2 / DHGT" => header.height_m = Some(self.within(2, 6, 50.0..=2000.0, "km")? * 1e3),
                "LAT1 / LAT2 / DLAT" => header.latitudes = Some(self.axis()?),
                "LON1 / LON2 / DLON" => header.longitudes = Some(self.axis()?),
                "EXPONENT" => header.exponent = Some(self.exponent()?),
                "START OF AUX DATA" => self.skip("END OF AUX DATA")?,
                "END OF HEADER" => return Ok(header),
                _ => {}
            }
        }
        Err(self.wrong("END OF HEADER before the file ends"))
    }

    /// One map, from the line after its start to its end.
    fn map(&mut self, maps: &mut Maps, mut exponent: i32) -> Result<(), IonexError> {
        let mut rows = 0;
        let mut epoch = None;
        while self.next() {
            match self.label() {
                "EPOCH OF CURRENT MAP" => epoch = Some(self.epoch()?),
                "EXPONENT" => exponent = self.exponent()?,
                "LAT/LON1/LON2/DLON/H" => {
                    let expected = maps.latitudes.first_deg + maps.latitudes.step_deg * f64::from(rows);
                    let latitude_deg = self.number(2, 6)?;
                    // Latitudes are printed to 0.1 degrees.
                    if (latitude_deg - expected).abs() > 0.05 || rows as usize >= maps.latitudes.count {
                        return Err(self.wrong(&format!("the row of latitude {expected:.1}")));
                    }
                    self.row(maps, exponent)?;
                    rows += 1;
                }
                "END OF TEC MAP" => {
                    if rows as usize != maps.latitudes.count {
                        return Err(self.wrong(&format!("{} rows before it, not {rows}", maps.latitudes.count)));
                    }
                    let epoch = epoch.ok_or_else(|| self.wrong("EPOCH OF CURRENT MAP before it"))?;
                    if maps.epochs.last().is_some_and(|last| epoch.since(*last) <= 0.0) {
                        return Err(self.wrong("maps in ascending order of time"));
                    }
                    maps.epochs.push(epoch);
                    return Ok(());
                }
                _ => return Err(self.wrong("a row of the map or END OF TEC MAP")),
            }
        }
        Err(self.wrong("END OF TEC MAP before the file ends"))
    }

    /// The values of one row, in lines of 16; a last column that repeats the first is left out.
    fn row(&mut self, maps: &mut Maps, exponent: i32) -> Result<(), IonexError> {
        let scale_tecu = libm::pow(10.0, f64::from(exponent));
        let written = [maps.longitudes.count, maps.longitudes.count + 1];
        let [_, lon1, lon2, dlon] = [2, 8, 14, 20].map(|at| self.number(at, 6));
        let count = ((lon2? - lon1?) / dlon?).round() + 1.0;
        if !written.contains(&(count as usize)) {
            return Err(self.wrong("the longitudes of the header"));
        }
        if maps.values_tecu.len() + maps.longitudes.count > MOST_VALUES {
            return Err(self.wrong(&format!("at most {MOST_VALUES} values in all maps")));
        }
        for column in 0..count as usize {
            if column % 16 == 0 && !self.next() {
                return Err(self.wrong("values before the file ends"));
            }
            let value = self.number(column % 16 * 5, 5)?;
            if value == NO_VALUE {
                return Err(self.wrong("a value at every node (9999 means none)"));
            }
            let value_tecu = value * scale_tecu;
            if !(-10.0..=1000.0).contains(&value_tecu) {
                return Err(self.wrong("electrons from -10 to 1000 TECU (maps are smooth to a few below 0)"));
            }
            if column < maps.longitudes.count {
                maps.values_tecu.push(value_tecu);
            }
        }
        Ok(())
    }

    /// Holds the grid against the globe, and takes a repeated last column off it.
    fn globe(&self, maps: &mut Maps) -> Result<(), IonexError> {
        let (latitudes, longitudes) = (maps.latitudes, maps.longitudes);
        let (north, south) =
            (latitudes.first_deg.max(latitudes.last_deg()), latitudes.first_deg.min(latitudes.last_deg()));
        let around = (360.0 / longitudes.step_deg.abs()).round();
        let whole = (around * longitudes.step_deg.abs() - 360.0).abs() < 1e-6;
        let count = longitudes.count as f64;
        if north < 90.0 - POLAR_GAP_DEG
            || south > POLAR_GAP_DEG - 90.0
            || !whole
            || !(around..=around + 1.0).contains(&count)
        {
            let found = format!(
                "a grid from {south} to {north} deg of latitude and {} to {} deg of longitude",
                longitudes.first_deg,
                longitudes.last_deg()
            );
            return Err(self.whole(&found, "one of the whole globe"));
        }
        maps.longitudes.count = around as usize;
        Ok(())
    }

    fn axis(&self) -> Result<Axis, IonexError> {
        let [first_deg, last_deg, step_deg] = [2, 8, 14].map(|at| self.number(at, 6));
        let (first_deg, last_deg, step_deg) = (first_deg?, last_deg?, step_deg?);
        let steps = (last_deg - first_deg) / step_deg;
        let limits = first_deg.abs() <= 360.0 && last_deg.abs() <= 360.0;
        if limits && (1.0..4000.0).contains(&steps) && (steps - steps.round()).abs() < 1e-6 {
            return Ok(Axis { first_deg, step_deg, count: steps.round() as usize + 1 });
        }
        Err(self.wrong("first, last and step in degrees, a whole number of steps apart"))
    }

    /// UT as GPS time; 24 h of a day are 0 h of the next.
    fn epoch(&self) -> Result<Epoch, IonexError> {
        let mut fields = [0.0; 6];
        for (index, field) in fields.iter_mut().enumerate() {
            *field = self.number(index * 6, 6)?;
        }
        let [year, month, day, hour, minute, second] = fields;
        let midnight = Epoch::parse(&format!("{year:04.0}-{month:02.0}-{day:02.0}T00:00:00Z"));
        let since_s = hour * 3600.0 + minute * 60.0 + second;
        match midnight {
            Ok(midnight) if (0.0..=DAY_S).contains(&since_s) => Ok(midnight.plus_s(since_s)),
            _ => Err(self.wrong("year, month, day, hour, minute and second")),
        }
    }

    fn exponent(&self) -> Result<i32, IonexError> {
        self.within(0, 6, -9.0..=3.0, "as a power of ten").map(|x| x as i32)
    }

    /// Passes over lines up to the one with `label`.
    fn skip(&mut self, label: &str) -> Result<(), IonexError> {
        while self.next() {
            if self.label() == label {
                return Ok(());
            }
        }
        Err(self.wrong(&format!("{label} before the file ends")))
    }

    /// Goes to the next line, and states whether there is one.
    fn next(&mut self) -> bool {
        match self.lines.next() {
            Some((index, text)) => {
                (self.line, self.text) = (index + 1, text);
                true
            }
            None => false,
        }
    }

    fn label(&self) -> &'t str {
        self.text.get(60..).unwrap_or("").trim()
    }

    fn number(&self, from: usize, width: usize) -> Result<f64, IonexError> {
        let end = (from + width).min(self.text.len());
        let field = self.text.get(from..end).unwrap_or("").trim();
        let number = field.parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| self.wrong(&format!("a number in columns {} to {}", from + 1, from + width)))
    }

    fn within(
        &self,
        from: usize,
        width: usize,
        range: std::ops::RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, IonexError> {
        let number = self.number(from, width)?;
        let expected = || format!("a number from {} to {} {unit}", range.start(), range.end());
        if range.contains(&number) { Ok(number) } else { Err(self.wrong(&expected())) }
    }

    fn wrong(&self, expected: &str) -> IonexError {
        IonexError::Line {
            name: self.name.to_owned(),
            line: self.line,
            found: self.text.chars().take(80).collect::<String>().trim_end().to_owned(),
            expected: expected.to_owned(),
        }
    }

    fn whole(&self, found: &str, expected: &str) -> IonexError {
        IonexError::Whole { name: self.name.to_owned(), found: found.to_owned(), expected: expected.to_owned() }
    }
}

#[cfg(test)]
mod tests;
