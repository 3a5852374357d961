//! Trajectories from files: CSV with named columns, and NMEA 0183 GGA sentences.
//!
//! CSV columns, in any order: time as `time_s` (since the scene's start) or `gps_s` with an optional
//! `gps_fraction_s`; position as `x_m,y_m,z_m` (ECEF) or `latitude_deg,longitude_deg,height_m`; velocity, if
//! known, as `vx_mps,vy_mps,vz_mps` (ECEF) or `east_mps,north_mps,up_mps`. `#` begins a comment. NMEA heights
//! become ellipsoidal by the sentence's own geoid separation, or by EGM96's where it has none; what a logger
//! puts before a sentence is passed over. A file is read row by row and refused at the first bad one.

mod nmea;
mod rows;
mod smooth;

use std::io::{BufRead, BufReader, Read};

use nalgebra::Vector3;
use thiserror::Error;

use super::Trajectory;
use super::spline::Row;
use gnss::earth::Geodetic;
use gnss::nmea::read::sentences;
use gnss::time::Epoch;
pub use nmea::{Gga, Rmc, gga, rising, rmc};
use rows::Rows;
pub use smooth::Digits;
use smooth::decimals;

/// Rows read at most: eleven hours at 25 Hz. They become 80 MB of knots, and take three times that while
/// read.
pub const MAX_ROWS: usize = 1_000_000;
/// Bytes read at most.
pub const MAX_BYTES: u64 = 256 << 20;
/// Bytes of a row at most, so that a text without ends of lines takes no memory.
const MAX_ROW_BYTES: usize = 1 << 16;
/// Nearest to the Earth's centre, in metres: 50 km below the poles.
const LEAST_RADIUS_M: f64 = 6.3e6;

/// A degree along a meridian, in metres.
const DEGREE_M: f64 = 111_195.0;

/// Time scale of a file's rows and limits of their spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Start of the scene.
    pub start: Epoch,
    /// Longest time between two rows, in seconds.
    pub max_gap_s: f64,
    /// Largest distance in metres of the motion from rows with positions alone; `None` for a motion through
    /// all of them.
    pub tolerance_m: Option<f64>,
}

/// Reason for which a trajectory file is refused, and its position.
#[derive(Debug, Error)]
#[error("{file}: line {line}: {fault}")]
pub struct FileError {
    /// The file.
    pub file: String,
    /// Line number, from 1.
    pub line: u64,
    /// Error in the line.
    pub fault: Fault,
}

/// Error in a row.
#[derive(Debug, Error)]
pub enum Fault {
    /// The row cannot be read.
    #[error("{0}")]
    Read(std::io::Error),
    /// Bytes that are no UTF-8.
    #[error("not UTF-8 text")]
    NotText,
    /// Text in a log of ticks that does not belong there.
    #[error("'{what}': expected {expected}")]
    Log {
        /// Text that was found.
        what: String,
        /// Text that is expected.
        expected: String,
    },
    /// A row beyond the length that is read.
    #[error("a row of more than {MAX_ROW_BYTES} bytes: expected numbers")]
    LongRow,
    /// A row with more or fewer fields than columns.
    #[error("{fields} fields, but the header names {columns}: expected ',' between fields and '.' in numbers")]
    Fields {
        /// Fields of the row.
        fields: u64,
        /// Columns of the header.
        columns: u64,
    },
    /// Another separator than a comma.
    #[error("fields are separated by {separator:?}: expected ','")]
    Separator {
        /// The one that is there.
        separator: char,
    },
    /// A file of another kind.
    #[error("{what}: expected {expected}")]
    Foreign {
        /// Format that the file seems to have.
        what: &'static str,
        /// Format that is expected, and a way to produce it.
        expected: &'static str,
    },
    /// A column that is missing.
    #[error("no column for {what}: expected {expected}; found {found}")]
    Column {
        /// Quantity of the column.
        what: &'static str,
        /// Values that are expected.
        expected: &'static str,
        /// Text that was found.
        found: String,
    },
    /// A column that comes twice.
    #[error("column {column:?} appears twice")]
    ColumnTwice {
        /// The column.
        column: String,
    },
    /// A field that is no number, or out of range.
    #[error("{column} = {value:?}: expected {expected}")]
    Number {
        /// The column.
        column: String,
        /// The value.
        value: String,
        /// Values that are expected.
        expected: &'static str,
    },
    /// Two rows of one time.
    #[error("time {t_s} s repeats that of the row before")]
    SameTime {
        /// Time of both rows, in seconds since the scene's start.
        t_s: f64,
    },
    /// A row that is earlier than the one before.
    #[error("time {t_s} s is before the row before ({before_s} s): rows must ascend in time")]
    Unsorted {
        /// Time of the earlier row, in seconds since the scene's start.
        t_s: f64,
        /// Time of the row before, in seconds.
        before_s: f64,
    },
    /// Rows too far apart.
    #[error("{gap_s:.3} s since the row before: expected at most max_gap_s = {max_gap_s} s")]
    Gap {
        /// Time between them, in seconds.
        gap_s: f64,
        /// Longest time between two rows, in seconds.
        max_gap_s: f64,
    },
    /// A motion that is too fast.
    #[error("{speed_mps:.6e} m/s since the row before: expected at most 0.1 c = 2.998e7 m/s")]
    Speed {
        /// The speed, in m/s.
        speed_mps: f64,
    },
    /// A way that passes through the Earth.
    #[error("the way from the row before passes {:.0} km from the Earth's centre: expected at least 6300 \
             km", radius_m / 1e3)]
    Depth {
        /// Least distance from the Earth's centre, in metres.
        radius_m: f64,
    },
    /// A motion that accelerates too much.
    #[error("acceleration of {acceleration_mps2:.3e} m/s2: expected at most 1e6 m/s2")]
    Acceleration {
        /// The acceleration, in m/s².
        acceleration_mps2: f64,
    },
    /// Tolerance for rows whose velocities already determine the motion.
    #[error("velocities beside tolerance_m: expected positions alone, or no tolerance_m")]
    Velocities,
    /// Fewer rows than a motion needs.
    #[error("{have} rows: expected at least 2")]
    TooFew {
        /// Number of rows.
        have: usize,
    },
    /// More rows than are read.
    #[error("more than {MAX_ROWS} rows or 256 MiB")]
    TooLong,
    /// An NMEA sentence that is not as it must be.
    #[error("{sentence:?}: {reason}")]
    Sentence {
        /// The sentence.
        sentence: String,
        /// Description of the error.
        reason: String,
    },
}

/// Reads a number within a range.
fn number(column: &str, text: &str, low: f64, high: f64, expected: &'static str) -> Result<f64, Fault> {
    let value = text.trim().parse::<f64>().ok().filter(|x| (low..=high).contains(x));
    value.ok_or_else(|| Fault::Number { column: column.to_owned(), value: text.to_owned(), expected })
}

/// A position by three numbers, ECEF or geodetic.
fn place(geodetic: bool, [a, b, c]: [(&str, &str); 3]) -> Result<Vector3<f64>, Fault> {
    if geodetic {
        let latitude = number(a.0, a.1, -90.0, 90.0, "a number from -90 to 90")?;
        let longitude = number(b.0, b.1, -180.0, 360.0, "a number from -180 to 360")?;
        let height_m = number(c.0, c.1, -12_000.0, 1e9, "a number from -12000 to 1e9")?;
        Ok(Geodetic::from_degrees(latitude, longitude, height_m).to_ecef())
    } else {
        let read = |(column, text)| number(column, text, -1e9, 1e9, "a number from -1e9 to 1e9");
        let position_m = Vector3::new(read(a)?, read(b)?, read(c)?);
        if position_m.norm() < LEAST_RADIUS_M {
            let value = format!("{}, {}, {}", a.1, b.1, c.1);
            let expected = "a position at least 6300 km from the Earth's centre";
            return Err(Fault::Number { column: "x_m, y_m, z_m".to_owned(), value, expected });
        }
        Ok(position_m)
    }
}

/// Columns of a row by their meaning.
struct Columns {
    names: Vec<String>,
    time: Time,
    geodetic: bool,
    position: [usize; 3],
    /// Velocity columns, with true for east, north, up and false for ECEF.
    velocity: Option<(bool, [usize; 3])>,
    ignored: Vec<String>,
}

enum Time {
    Elapsed(usize),
    Gps(usize, Option<usize>),
}

impl Columns {
    fn new(header: &csv::StringRecord) -> Result<Self, Fault> {
        let names: Vec<String> =
            header.iter().map(|name| name.trim().trim_start_matches('\u{feff}').trim().to_owned()).collect();
        if let Some(fault) = foreign(header) {
            return Err(fault);
        }
        if let [only] = names.as_slice()
            && let Some(separator) = only.chars().find(|c| [';', '\t', '|'].contains(c))
        {
            return Err(Fault::Separator { separator });
        }
        if let Some((_, twice)) =
            names.iter().enumerate().find(|(i, name)| names.iter().skip(i + 1).any(|o| o == *name))
        {
            return Err(Fault::ColumnTwice { column: twice.clone() });
        }
        let find = |name: &str| names.iter().position(|n| n == name);
        let three = |wanted: [&str; 3]| Some([find(wanted[0])?, find(wanted[1])?, find(wanted[2])?]);
        let missing = |what, expected| Fault::Column { what, expected, found: format!("{:?}", names.join(",")) };
        let time = match (find("time_s"), find("gps_s")) {
            (Some(time), _) => Time::Elapsed(time),
            (None, Some(whole)) => Time::Gps(whole, find("gps_fraction_s")),
            (None, None) => return Err(missing("time", "time_s, or gps_s")),
        };
        let (geodetic, position) =
            match (three(["x_m", "y_m", "z_m"]), three(["latitude_deg", "longitude_deg", "height_m"])) {
                (Some(position), _) => (false, position),
                (None, Some(position)) => (true, position),
                (None, None) => {
                    return Err(missing("position", "x_m,y_m,z_m or latitude_deg,longitude_deg,height_m"));
                }
            };
        let (ecef, local) = (["vx_mps", "vy_mps", "vz_mps"], ["east_mps", "north_mps", "up_mps"]);
        let velocity = three(ecef).map(|v| (false, v)).or_else(|| three(local).map(|v| (true, v)));
        if velocity.is_none() && ecef.iter().chain(&local).any(|name| find(name).is_some()) {
            return Err(missing("all of velocity", "vx_mps,vy_mps,vz_mps or east_mps,north_mps,up_mps, or none"));
        }
        let mut used: Vec<usize> = position.to_vec();
        used.extend(velocity.iter().flat_map(|(_, at)| at));
        match time {
            Time::Elapsed(time) => used.push(time),
            Time::Gps(whole, fraction) => used.extend([Some(whole), fraction].into_iter().flatten()),
        }
        let ignored = names.iter().enumerate().filter(|(i, _)| !used.contains(i)).map(|(_, n)| n.clone()).collect();
        Ok(Self { names, time, geodetic, position, velocity, ignored })
    }

    /// Value of the last digit of each coordinate, in metres, to the north for both angles.
    fn steps_m(&self, record: &csv::StringRecord) -> [f64; 3] {
        let unit_m = if self.geodetic { [DEGREE_M, DEGREE_M, 1.0] } else { [1.0; 3] };
        let worth =
            |(at, unit_m): (usize, f64)| unit_m * libm::pow(0.1, f64::from(decimals(record.get(at).unwrap_or(""))));
        let [a, b, c] = self.position;
        let [u, v, w] = unit_m;
        [worth((a, u)), worth((b, v)), worth((c, w))]
    }

    fn row(&self, record: &csv::StringRecord, start: Epoch) -> Result<Row, Fault> {
        let field = |i: usize| (self.names.get(i).map_or("", String::as_str), record.get(i).unwrap_or(""));
        let read = |i: usize, limit: f64| {
            let (column, text) = field(i);
            number(column, text, -limit, limit, "a finite number with '.' for decimals")
        };
        let t_s = match self.time {
            Time::Elapsed(time) => read(time, 1e9)?,
            Time::Gps(whole, fraction) => {
                let (column, text) = field(whole);
                let expected = "whole GPS seconds since 1980-01-06 (decimals in gps_fraction_s)";
                let value = || text.to_owned();
                let seconds = text
                    .trim()
                    .parse::<i64>()
                    .ok()
                    .filter(|s| (0..=10_000_000_000).contains(s))
                    .ok_or_else(|| Fault::Number { column: column.to_owned(), value: value(), expected })?;
                Epoch::new(seconds, fraction.map_or(Ok(0.0), |i| read(i, 1.0))?).since(start)
            }
        };
        let position_m = place(self.geodetic, self.position.map(field))?;
        let velocity_mps = match self.velocity {
            None => None,
            Some((local, at)) => {
                let read = |i: usize| read(i, 1e9);
                let v = Vector3::new(read(at[0])?, read(at[1])?, read(at[2])?);
                Some(if local { Geodetic::from_ecef(&position_m).ecef_to_enu().transpose() * v } else { v })
            }
        };
        Ok(Row { t_s, position_m, velocity_mps })
    }
}

/// Fault for a file that is not a table with a header, recognised by its first line.
fn foreign(first: &csv::StringRecord) -> Option<Fault> {
    let line = first.get(0).unwrap_or_default().trim().trim_start_matches('\u{feff}');
    if line.contains("$G") || line.starts_with('$') {
        let expected = "a table with a header, or format = \"nmea\" for such a file";
        return Some(Fault::Foreign { what: "sentences of NMEA", expected });
    }
    if line.starts_with('<') {
        let expected = "a table of CSV or sentences of NMEA, which converters such as gpsbabel make of KML and GPX";
        return Some(Fault::Foreign { what: "XML", expected });
    }
    let is_number = |field: &str| field.trim().parse::<f64>().is_ok();
    (first.len() > 1 && first.iter().all(is_number)).then_some(Fault::Foreign {
        what: "numbers in the first line",
        expected: "a header before them that names the columns, like time_s,latitude_deg,longitude_deg,height_m",
    })
}

/// Bytes that end in an error where a row is too long: one that nothing ends, or whose quotes nothing closes.
/// A read that a signal interrupts is repeated, since the table's reader does not repeat it.
struct ShortRows<R> {
    inner: R,
    since_end: usize,
    quoted: bool,
    comment: bool,
}

impl<R: Read> ShortRows<R> {
    fn of(inner: R) -> Self {
        Self { inner, since_end: 0, quoted: false, comment: false }
    }
}

impl<R: Read> Read for ShortRows<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let room = buffer.len().min(MAX_ROW_BYTES);
        let buffer = buffer.get_mut(..room).unwrap_or_default();
        let count = loop {
            match self.inner.read(buffer) {
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        for byte in buffer.get(..count).unwrap_or_default() {
            match byte {
                b'\n' if !self.quoted => {
                    (self.since_end, self.comment) = (0, false);
                    continue;
                }
                b'"' if !self.comment => self.quoted = !self.quoted,
                b'#' if self.since_end == 0 => self.comment = true,
                _ => {}
            }
            self.since_end += 1;
        }
        if self.since_end > MAX_ROW_BYTES {
            return Err(std::io::ErrorKind::InvalidData.into());
        }
        Ok(count)
    }
}

/// A trajectory of a table.
#[derive(Clone, Debug)]
pub struct CsvTrajectory {
    /// The motion.
    pub trajectory: Trajectory,
    /// Columns that were not used.
    pub ignored: Vec<String>,
    /// Effect of the positions' rounding on the motion, if they have no tolerance.
    pub digits: Option<Digits>,
}

/// Reads a CSV trajectory. `file` names it in errors.
///
/// # Errors
/// [`FileError`] with the first line that is not as it must be.
pub fn read_csv(input: impl Read, file: &str, options: &Options) -> Result<CsvTrajectory, FileError> {
    let error = |line, fault| FileError { file: file.to_owned(), line, fault };
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(ShortRows::of(input.take(MAX_BYTES + 1)));
    let fault = |e: csv::Error, line: u64| {
        let line = e.position().map_or(line, csv::Position::line);
        let fault = match e.into_kind() {
            csv::ErrorKind::Utf8 { .. } => Fault::NotText,
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                Fault::Fields { fields: len, columns: expected_len }
            }
            csv::ErrorKind::Io(e) if e.kind() == std::io::ErrorKind::InvalidData => Fault::LongRow,
            csv::ErrorKind::Io(e) => Fault::Read(e),
            other => Fault::Read(std::io::Error::other(format!("{other:?}"))),
        };
        error(line, fault)
    };
    let header = reader.headers().map_err(|e| fault(e, 1))?.clone();
    let columns = Columns::new(&header).map_err(|f| error(1, f))?;
    let mut rows = Rows::new(options);
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(|e| fault(e, 1))? {
        let line = record.position().map_or(0, csv::Position::line);
        let row = columns.row(&record, options.start).map_err(|f| error(line, f))?;
        rows.push(line, row).map_err(|f| error(line, f))?;
        rows.written(columns.steps_m(&record));
        if record.position().is_some_and(|p| p.byte() > MAX_BYTES) {
            return Err(error(line, Fault::TooLong));
        }
    }
    let digits = rows.digits();
    Ok(CsvTrajectory { trajectory: rows.finish(file)?, ignored: columns.ignored, digits })
}

/// Trajectory of NMEA sentences, with the sentences that were skipped and the values that were assumed.
#[derive(Clone, Debug)]
pub struct NmeaTrajectory {
    /// The motion.
    pub trajectory: Trajectory,
    /// GGA sentences that state that there is no fix.
    pub without_fix: usize,
    /// GGA sentences without a geoid separation, for which EGM96's was added.
    pub separations_assumed: usize,
    /// Effect of the positions' rounding on the motion, if they have no tolerance.
    pub digits: Option<Digits>,
}

/// Reads the GGA sentences of an NMEA file. Of several talkers in one epoch the first is taken.
///
/// # Errors
/// [`FileError`] with the first line that is not as it must be.
pub fn read_nmea(input: impl Read, file: &str, options: &Options) -> Result<NmeaTrajectory, FileError> {
    let error = |line, fault| FileError { file: file.to_owned(), line, fault };
    let mut input = BufReader::new(input.take(MAX_BYTES + 1));
    let mut rows = Rows::new(options);
    let (mut bytes, mut line, mut without_fix, mut separations_assumed, mut total) = (Vec::new(), 0, 0, 0, 0);
    let mut talker = String::new();
    let (mut found_any, mut of_rmc) = (false, false);
    loop {
        bytes.clear();
        line += 1;
        let read = input.by_ref().take(4096).read_until(b'\n', &mut bytes).map_err(|e| error(line, Fault::Read(e)))?;
        total += read as u64;
        if read == 0 {
            break;
        } else if total > MAX_BYTES {
            return Err(error(line, Fault::TooLong));
        }
        for text in sentences(&bytes) {
            found_any = true;
            of_rmc |= text.get(3..7) == Some(b"RMC,");
            if text.get(3..7) != Some(b"GGA,") {
                continue;
            }
            let text = std::str::from_utf8(text).map_err(|_| error(line, Fault::NotText))?.trim();
            let before_s = rows.last_s();
            let Some(found) = gga(text, options.start, before_s).map_err(|f| error(line, f))? else {
                without_fix += 1;
                continue;
            };
            if before_s == Some(found.row.t_s) && talker != found.talker {
                continue;
            }
            talker = found.talker;
            separations_assumed += usize::from(found.separation_assumed);
            rows.push(line, found.row).map_err(|f| error(line, f))?;
            // Minutes of latitude and longitude, and metres.
            let fields: Vec<&str> = text.split(',').collect();
            let worth = |at: usize, unit_m: f64| {
                fields.get(at).map_or(unit_m, |field| unit_m * libm::pow(0.1, f64::from(decimals(field))))
            };
            rows.written([worth(2, DEGREE_M / 60.0), worth(4, DEGREE_M / 60.0), worth(9, 1.0)]);
        }
    }
    let what = match (rows.last_s(), found_any, of_rmc) {
        (Some(_), ..) => {
            let digits = rows.digits();
            return Ok(NmeaTrajectory { trajectory: rows.finish(file)?, without_fix, separations_assumed, digits });
        }
        (None, ..) if without_fix > 0 => "no GGA sentence with a fix",
        (None, false, _) => "no sentence of NMEA",
        (None, _, false) => "no GGA sentence",
        (None, ..) => "RMC sentences, which have no height, and none of GGA",
    };
    Err(error(line, Fault::Foreign { what, expected: "GGA sentences with a fix, two at least" }))
}

#[cfg(test)]
mod tests;
