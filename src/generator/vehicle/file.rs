//! Trajectories from files: CSV with named columns, and NMEA 0183 GGA sentences.
//!
//! CSV columns, in any order: time as `time_s` (since the scene's start) or `gps_s` with an optional
//! `gps_fraction_s`; position as `x_m,y_m,z_m` (ECEF) or `latitude_deg,longitude_deg,height_m`; velocity, if known, as
//! `vx_mps,vy_mps,vz_mps` (ECEF) or `east_mps,north_mps,up_mps`. `#` begins a comment. NMEA heights become
//! ellipsoidal by the sentence's own geoid separation. A file is read row by row and refused at the first bad one.

use std::io::{BufRead, BufReader, Read};

use nalgebra::Vector3;
use thiserror::Error;

use super::Trajectory;
use super::spline::{self, Row};
use crate::gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use crate::gnss::time::Epoch;

/// Rows read at most: eleven hours at 25 Hz. They become 80 MB of knots, and take three times that while read.
pub const MAX_ROWS: usize = 1_000_000;
/// Bytes read at most.
pub const MAX_BYTES: u64 = 256 << 20;
/// Bytes of a row at most, so that a text without ends of lines takes no memory.
const MAX_ROW_BYTES: usize = 1 << 16;
/// Fastest motion between rows.
const MAX_SPEED_MPS: f64 = 0.1 * SPEED_OF_LIGHT_MPS;
/// Nearest to the Earth's centre: 50 km below the poles.
const LEAST_RADIUS_M: f64 = 6.3e6;
/// Hardest motion: a hundred thousand g, beyond any gun.
const MAX_ACCELERATION_MPS2: f64 = 1e6;

/// Rows before and after the first bent knot among which the wrong one is looked for. From the hardest bend that the
/// largest speed allows, 1e11 m/s2 between rows 1 ms apart, to the limit is a factor 1e5 = 3.7^9: nine rows.
const BEFORE: usize = 2;
const AFTER: usize = 14;

/// Where a file's times lie and how far apart its rows may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    pub start: Epoch,
    pub max_gap_s: f64,
}

/// Why a trajectory file is refused, and where.
#[derive(Debug, Error)]
#[error("{file}: line {line}: {fault}")]
pub struct FileError {
    pub file: String,
    pub line: u64,
    pub fault: Fault,
}

/// What is wrong with a row.
#[derive(Debug, Error)]
pub enum Fault {
    #[error("{0}")]
    Read(std::io::Error),
    #[error("not UTF-8 text")]
    NotText,
    #[error("a row of more than {MAX_ROW_BYTES} bytes: expected numbers")]
    LongRow,
    #[error("{fields} fields, but the header names {columns}: expected ',' between fields and '.' in numbers")]
    Fields { fields: u64, columns: u64 },
    #[error("fields are separated by {separator:?}: expected ','")]
    Separator { separator: char },
    #[error("no column for {what}: expected {expected}; found {found}")]
    Column { what: &'static str, expected: &'static str, found: String },
    #[error("column {column:?} appears twice")]
    ColumnTwice { column: String },
    #[error("{column} = {value:?}: expected {expected}")]
    Number { column: String, value: String, expected: &'static str },
    #[error("time {t_s} s repeats that of the row before")]
    SameTime { t_s: f64 },
    #[error("time {t_s} s is before the row before ({before_s} s): rows must ascend in time")]
    Unsorted { t_s: f64, before_s: f64 },
    #[error("{gap_s:.3} s since the row before: expected at most max_gap_s = {max_gap_s} s")]
    Gap { gap_s: f64, max_gap_s: f64 },
    #[error("{speed_mps:.6e} m/s since the row before: expected at most 0.1 c = 2.998e7 m/s")]
    Speed { speed_mps: f64 },
    #[error("the way from the row before passes {:.0} km from the Earth's centre: expected at least 6300 km", radius_m / 1e3)]
    Depth { radius_m: f64 },
    #[error("acceleration of {acceleration_mps2:.3e} m/s2: expected at most 1e6 m/s2")]
    Acceleration { acceleration_mps2: f64 },
    #[error("{have} rows: expected at least 2")]
    TooFew { have: usize },
    #[error("more than {MAX_ROWS} rows or 256 MiB")]
    TooLong,
    #[error("{sentence:?}: {reason}")]
    Sentence { sentence: String, reason: &'static str },
}

/// Rows as they come in, each checked against the one before.
struct Rows {
    rows: Vec<Row>,
    lines: Vec<u32>,
    max_gap_s: f64,
}

impl Rows {
    fn new(options: &Options) -> Self {
        Self { rows: Vec::new(), lines: Vec::new(), max_gap_s: options.max_gap_s }
    }

    fn push(&mut self, line: u64, row: Row) -> Result<(), Fault> {
        let mut speed_mps = row.velocity_mps.map_or(0.0, |v| v.norm());
        if let Some(before) = self.rows.last() {
            let gap_s = row.t_s - before.t_s;
            if gap_s == 0.0 {
                return Err(Fault::SameTime { t_s: row.t_s });
            } else if gap_s < 0.0 {
                return Err(Fault::Unsorted { t_s: row.t_s, before_s: before.t_s });
            } else if gap_s > self.max_gap_s {
                return Err(Fault::Gap { gap_s, max_gap_s: self.max_gap_s });
            }
            speed_mps = speed_mps.max((row.position_m - before.position_m).norm() / gap_s);
            let radius_m = nearest_m(&before.position_m, &row.position_m);
            if speed_mps <= MAX_SPEED_MPS && radius_m < LEAST_RADIUS_M {
                return Err(Fault::Depth { radius_m });
            }
        }
        if speed_mps > MAX_SPEED_MPS {
            return Err(Fault::Speed { speed_mps });
        }
        if self.rows.len() >= MAX_ROWS {
            return Err(Fault::TooLong);
        }
        self.rows.push(row);
        self.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        Ok(())
    }

    /// The spline through the rows, with a break at each of them.
    fn finish(self, file: &str) -> Result<Trajectory, FileError> {
        let error = |line, fault| FileError { file: file.to_owned(), line, fault };
        let last = self.lines.last().map_or(1, |line| u64::from(*line));
        let too_few = || error(last, Fault::TooFew { have: self.rows.len() });
        if self.rows.len() < 2 {
            return Err(too_few());
        }
        let knots = spline::knots(&self.rows);
        if let Some(bent) = knots.iter().position(|knot| knot.motion.acceleration_mps2.norm() > MAX_ACCELERATION_MPS2) {
            let (row, acceleration_mps2) = self.culprit(bent);
            let line = self.lines.get(row).map_or(last, |line| u64::from(*line));
            return Err(error(line, Fault::Acceleration { acceleration_mps2 }));
        }
        let breaks_s = self.rows.iter().map(|row| row.t_s).collect();
        Trajectory::through(knots, breaks_s).ok_or_else(too_few)
    }
}

impl Rows {
    /// The row that makes the spline bend too hard from knot `bent` on, and how hard.
    ///
    /// One wrong row bends the spline at its neighbours too, each a quarter as hard as the one before: it is the row without
    /// which the rows about it are smooth. Where the motion jumps for good, leaving out a row beside the jump takes no more
    /// than a third of the bend away: then it is the row after the fastest interval (within two rows of an end the two cannot be
    /// told apart, and the row beside the jump is named). Of fewer than five rows any could be
    /// the wrong one.
    fn culprit(&self, bent: usize) -> (usize, f64) {
        // At the end of the file more of those before it, so that there is something to be smooth.
        let first = bent.saturating_sub(BEFORE).min(self.rows.len().saturating_sub(AFTER));
        let rows = self.rows.get(first..(bent + AFTER).min(self.rows.len())).unwrap_or_default();
        let worst_mps2 = hardest(rows);
        if rows.len() < 5 {
            return (bent, worst_mps2);
        }
        let without = |left_out: usize| {
            let rest = rows.iter().enumerate().filter(|(row, _)| *row != left_out);
            hardest(&rest.map(|(_, row)| *row).collect::<Vec<_>>())
        };
        let smoothest = (0..rows.len()).map(|row| (row, without(row))).min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((row, left_mps2)) = smoothest
            && left_mps2 < 0.25 * worst_mps2
        {
            return (first + row, worst_mps2);
        }
        let speed = |(row, pair): (usize, &[Row])| match pair {
            [a, b] => (row + 1, (b.position_m - a.position_m).norm() / (b.t_s - a.t_s)),
            _ => (row, 0.0),
        };
        let fastest = rows.windows(2).enumerate().map(speed).max_by(|a, b| a.1.total_cmp(&b.1));
        (first + fastest.map_or(0, |(row, _)| row), worst_mps2)
    }
}

/// Least distance of the straight way between two places from the Earth's centre.
fn nearest_m(from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let way = to - from;
    let square = way.norm_squared();
    let share = if square > 0.0 { (-from.dot(&way) / square).clamp(0.0, 1.0) } else { 0.0 };
    (from + way * share).norm()
}

/// Hardest acceleration at the knots of the spline through some rows.
fn hardest(rows: &[Row]) -> f64 {
    spline::knots(rows).iter().map(|knot| knot.motion.acceleration_mps2.norm()).fold(0.0, f64::max)
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
            let expected = "a place at least 6300 km from the Earth's centre";
            return Err(Fault::Number { column: "x_m, y_m, z_m".to_owned(), value, expected });
        }
        Ok(position_m)
    }
}

/// Which field of a row holds what.
struct Columns {
    names: Vec<String>,
    time: Time,
    geodetic: bool,
    position: [usize; 3],
    /// Whether it is east, north, up, and where.
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

/// Bytes that end in an error where a row is too long: one that nothing ends, or whose quotes nothing closes. What a signal has
/// interrupted is read again, as the table's reader does not.
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

/// Reads a CSV trajectory; also returns the names of columns that it did not use. `file` names it in errors.
pub fn read_csv(input: impl Read, file: &str, options: &Options) -> Result<(Trajectory, Vec<String>), FileError> {
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
        if record.position().is_some_and(|p| p.byte() > MAX_BYTES) {
            return Err(error(line, Fault::TooLong));
        }
    }
    Ok((rows.finish(file)?, columns.ignored))
}

/// Reads the GGA sentences of an NMEA file; also returns how many said that there was no fix and were left out.
pub fn read_nmea(input: impl Read, file: &str, options: &Options) -> Result<(Trajectory, usize), FileError> {
    let error = |line, fault| FileError { file: file.to_owned(), line, fault };
    let mut input = BufReader::new(input.take(MAX_BYTES + 1));
    let mut rows = Rows::new(options);
    let (mut bytes, mut line, mut without_fix, mut total) = (Vec::new(), 0, 0, 0);
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
        let text = std::str::from_utf8(&bytes).map_err(|_| error(line, Fault::NotText))?.trim();
        if text.starts_with('$') && text.get(3..7) == Some("GGA,") {
            let before_s = rows.rows.last().map(|row| row.t_s);
            match gga(text, options.start, before_s).map_err(|f| error(line, f))? {
                Some(row) => rows.push(line, row).map_err(|f| error(line, f))?,
                None => without_fix += 1,
            }
        }
    }
    Ok((rows.finish(file)?, without_fix))
}

/// One GGA sentence (NMEA 0183, 6.3.29): checksum, UTC time of day, place and height above the ellipsoid.
fn gga(text: &str, start: Epoch, before_s: Option<f64>) -> Result<Option<Row>, Fault> {
    let fail = |reason| Fault::Sentence { sentence: text.to_owned(), reason };
    let (body, sum) = text.strip_prefix('$').and_then(|t| t.split_once('*')).ok_or_else(|| fail("no checksum"))?;
    let sum = u8::from_str_radix(sum.trim(), 16).map_err(|_| fail("the checksum is not two hexadecimal digits"))?;
    if body.bytes().fold(0, |x, b| x ^ b) != sum {
        return Err(fail("the checksum is wrong"));
    }
    let fields: Vec<&str> = body.split(',').collect();
    let [_, time, latitude, north, longitude, east, quality, _, _, height, _, geoid, ..] = fields.as_slice() else {
        return Err(fail("expected at least 12 fields"));
    };
    if *quality == "0" {
        return Ok(None);
    }
    let read = |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite());
    let sexagesimal = |text: &str, digits: usize| Some((read(text.get(..digits)?)?, read(text.get(digits..)?)?));
    let time_s = time_of_day_s(time).ok_or_else(|| fail("the time is not hhmmss"))?;
    let angle = |text, digits, sign: &str, signs: [&str; 2]| {
        let (degrees, minutes) = sexagesimal(text, digits)?;
        let size = degrees + minutes / 60.0;
        signs.iter().position(|s| *s == sign).map(|i| if i == 0 { size } else { -size })
    };
    let latitude = angle(latitude, 2, north, ["N", "S"]).filter(|x| x.abs() <= 90.0);
    let longitude = angle(longitude, 3, east, ["E", "W"]).filter(|x| x.abs() <= 180.0);
    let (latitude, longitude) =
        latitude.zip(longitude).ok_or_else(|| fail("the position is not ddmm.mm,N,dddmm.mm,E"))?;
    let height_m = read(height).ok_or_else(|| fail("no height"))?;
    let geoid_m = read(geoid).ok_or_else(|| fail("no geoid separation: the height above the ellipsoid is unknown"))?;
    let day_s = 86_400.0;
    let utc_start_s = (start.seconds() - start.leap_seconds()).rem_euclid(86_400) as f64 + start.fraction();
    let mut t_s = time_s - utc_start_s;
    // A time of day names no day: take the one nearest to the row before, or to the scene's start.
    t_s += day_s * ((before_s.unwrap_or(0.0) - t_s) / day_s).round();
    let position_m = Geodetic::from_degrees(latitude, longitude, height_m + geoid_m).to_ecef();
    Ok(Some(Row { t_s, position_m, velocity_mps: None }))
}

/// Seconds of the day of `hhmmss.ss`.
fn time_of_day_s(text: &str) -> Option<f64> {
    let hours: u32 = text.get(..2)?.parse().ok().filter(|h| *h < 24)?;
    let minutes: u32 = text.get(2..4)?.parse().ok().filter(|m| *m < 60)?;
    let seconds: f64 = text.get(4..)?.parse().ok().filter(|s| (0.0..61.0).contains(s))?;
    Some(f64::from(hours * 3600 + minutes * 60) + seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> Options {
        Options { start: Epoch::parse("2010-07-01T10:00:00").unwrap(), max_gap_s: 2.0 }
    }

    fn csv(text: &str) -> Result<(Trajectory, Vec<String>), FileError> {
        read_csv(text.as_bytes(), "ride.csv", &options())
    }

    const HEADER: &str = "time_s,x_m,y_m,z_m\n";

    #[test]
    fn rows_come_back_in_any_column_order_and_either_coordinates() {
        let place = Geodetic::from_degrees(26.5, 80.2, 130.0);
        let p = place.to_ecef();
        let ecef = format!("# a ride\n{HEADER}0,{},{},{}\n1.5,{},{},{}\n", p.x, p.y, p.z, p.x + 3.0, p.y, p.z);
        let (trajectory, ignored) = csv(&ecef).unwrap();
        assert!(ignored.is_empty());
        // Rust prints the shortest text that reads back as the same number.
        assert_eq!(trajectory.at(0.0).position_m, p);
        assert_eq!(trajectory.at(1.5).position_m, p + Vector3::new(3.0, 0.0, 0.0));
        assert_eq!(trajectory.breaks_s(), [0.0, 1.5]);
        let geodetic =
            "\u{feff}height_m, speed ,longitude_deg,time_s,latitude_deg\r\n130,9,80.2,0,26.5\r\n130,9,80.2,1,26.5\r\n";
        let (trajectory, ignored) = csv(geodetic).unwrap();
        assert_eq!((trajectory.at(0.0).position_m, ignored), (p, vec!["speed".to_owned()]));
    }

    #[test]
    fn absolute_times_and_velocities_are_used() {
        let start = options().start;
        let p = Geodetic::from_degrees(0.0, 0.0, 0.0).to_ecef();
        let row = |s: i64, north: f64| {
            format!("{},0.25,{},{},{},0,{north},0\n", start.seconds() + s, p.x, p.y, p.z + 2.0 * s as f64)
        };
        let text =
            format!("gps_s,gps_fraction_s,x_m,y_m,z_m,east_mps,north_mps,up_mps\n{}{}", row(3, 2.0), row(4, 2.0));
        let (trajectory, _) = csv(&text).unwrap();
        assert_eq!(trajectory.span_s(), (3.25, 4.25));
        // North at latitude 0 is z, but for the geodetic latitude of z = 6 m, 1e-6 rad.
        assert!((trajectory.at(3.75).velocity_mps - Vector3::new(0.0, 0.0, 2.0)).norm() < 1e-5);
    }

    #[test]
    fn each_damage_is_refused_at_its_line_with_its_reason() {
        let good = "0,6400000,0,0\n";
        let cases: [(String, u64, &str); 17] = [
            (format!("{HEADER}{good}-1,6400000,0,0\n"), 3, "must ascend"),
            (format!("{HEADER}{good}{good}"), 3, "repeats"),
            (format!("{HEADER}{good}1,NaN,0,0\n"), 3, "x_m = \"NaN\""),
            (format!("{HEADER}{good}1,,0,0\n"), 3, "x_m = \"\""),
            (format!("{HEADER}{good}9,6400000,0,0\n"), 3, "max_gap_s = 2"),
            (format!("{HEADER}{good}1,6400000,40000000,0\n"), 3, "0.1 c"),
            (format!("{HEADER}{good}1,6400000,20000000,0\n2,6400000,0,0\n"), 3, "1e6 m/s2"),
            (format!("{HEADER}{good}1,6400000,0,0,7\n"), 3, "5 fields, but the header names 4"),
            (format!("{HEADER}{good}1,\"6400000,5\",0,0\n"), 3, "x_m = \"6400000,5\""),
            ("time_s;x_m;y_m;z_m\n0;1;2;3\n".to_owned(), 1, "separated by ';'"),
            (format!("{HEADER}{good}"), 2, "at least 2"),
            (HEADER.to_owned(), 1, "at least 2"),
            (String::new(), 1, "time_s, or gps_s"),
            ("time_s,x_m,y_m\n".to_owned(), 1, "latitude_deg,longitude_deg,height_m"),
            ("time_s,time_s,x_m,y_m,z_m\n".to_owned(), 1, "twice"),
            ("time_s,x_m,y_m,z_m,vx_mps\n".to_owned(), 1, "or none"),
            ("time_s,latitude_deg,longitude_deg,height_m\n0,91,0,0\n".to_owned(), 2, "from -90 to 90"),
        ];
        for (text, line, reason) in cases {
            let error = csv(&text).unwrap_err();
            let message = error.to_string();
            assert!(error.line == line && message.contains(reason), "{text:?}: {message}");
            assert!(message.starts_with("ride.csv: line "));
        }
        let error = read_csv(&b"time_s,x_m,y_m,z_m\n0,\xff,0,0\n"[..], "ride.csv", &options()).unwrap_err();
        assert!(matches!(error.fault, Fault::NotText), "{error}");
    }

    #[test]
    fn a_way_through_the_earth_is_refused_at_the_row_where_it_ends() {
        let error = csv(&format!("{HEADER}0,6400000,0,0\n1,6400000,10,0\n3,-6400000,10,0\n")).unwrap_err();
        assert!(error.line == 4 && matches!(error.fault, Fault::Depth { radius_m } if radius_m < 11.0), "{error}");
        assert!(csv(&format!("{HEADER}0,6400000,0,0\n1,6400000,900000,0\n")).is_ok());
    }

    #[test]
    fn a_row_that_jumps_is_named_and_not_its_neighbours() {
        // A walk at 1 m/s and 10 Hz, with and without velocities.
        let walk = |velocities: bool, wrong: &dyn Fn(i32) -> (f64, f64)| {
            let mut text =
                if velocities { "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n".to_owned() } else { HEADER.to_owned() };
            for k in 0..60 {
                let (jump_m, jump_mps) = wrong(k);
                let t_s = 0.1 * f64::from(k);
                text += &format!("{t_s},6400000,{},0", t_s + jump_m);
                text += &if velocities { format!(",0,{},0\n", 1.0 + jump_mps) } else { "\n".to_owned() };
            }
            csv(&text).map(|_| ()).map_err(|error| (error.line, matches!(error.fault, Fault::Acceleration { .. })))
        };
        for row in 0..60 {
            // The header is line 1.
            let line = row as u64 + 2;
            for jump_m in [2e4, 1e5, 1e6, 2.9e6] {
                let one = walk(false, &|k| (if k == row { jump_m } else { 0.0 }, 0.0));
                assert_eq!(one, Err((line, true)), "row {row} alone by {jump_m} m");
                let one = walk(true, &|k| (if k == row { jump_m } else { 0.0 }, 0.0));
                assert_eq!(one, Err((line, true)), "row {row} alone by {jump_m} m, with velocities");
                // With less than three rows on either side of it, a jump is as well a wrong row beside it.
                if (3..58).contains(&row) {
                    let rest = walk(false, &|k| (if k >= row { jump_m } else { 0.0 }, 0.0));
                    assert_eq!(rest, Err((line, true)), "from row {row} on by {jump_m} m");
                }
            }
            let velocity = walk(true, &|k| (0.0, if k == row { 1e6 } else { 0.0 }));
            assert_eq!(velocity, Err((line, true)), "the velocity of row {row}");
        }
    }

    #[test]
    fn a_written_truth_flies_again_as_it_was() {
        use crate::generator::vehicle::rocket::Rocket;
        use crate::gnss::record::TrajectoryRow;
        let g = 9.806_65;
        let rocket = Rocket {
            pad: Geodetic::from_degrees(26.5, 80.2, 130.0),
            azimuth_rad: 1.0,
            elevation_rad: 1.4,
            ignition_s: 1.0,
            thrust_mps2: 22.0 * g,
            burn_s: 4.0,
            jerk_mps3: 20.0 * g,
            drag_m2pkg: 4e-5,
            oblate: true,
        };
        let flight = rocket.trajectory(12.0).unwrap();
        let mut writer = csv::Writer::from_writer(Vec::new());
        for k in 0..=100_u64 {
            let (at, m) = (options().start.plus_s(k as f64 * 0.1), flight.at(k as f64 * 0.1));
            let (p, v) = (m.position_m, m.velocity_mps);
            let row = TrajectoryRow {
                sample: k,
                gps_s: at.seconds(),
                gps_fraction_s: at.fraction(),
                x_m: p.x,
                y_m: p.y,
                z_m: p.z,
                vx_mps: v.x,
                vy_mps: v.y,
                vz_mps: v.z,
                clock_bias_s: 0.0,
                clock_drift: 0.0,
            };
            writer.serialize(row).unwrap();
        }
        let text = writer.into_inner().unwrap();
        let (again, ignored) = read_csv(text.as_slice(), "trajectory.csv", &options()).unwrap();
        assert_eq!(ignored, ["sample", "clock_bias_s", "clock_drift"]);
        for k in 0..1_000 {
            let t_s = f64::from(k) * 0.01;
            let (a, b) = (flight.at(t_s), again.at(t_s));
            // A corner of the thrust between rows: half the slope's jump J = 196 m/s3 over h = 0.1 s. Hermite's error
            // for a jump of the third derivative is at most J h³/192 with exact accelerations; those of the spline
            // are off by less than J h/8, which weighs h²/32 more: 1.0e-3 m + 0.8e-3 m.
            assert!((a.position_m - b.position_m).norm() < 2e-3, "{t_s}");
            assert!((a.velocity_mps - b.velocity_mps).norm() < 0.1, "{t_s}");
        }
    }

    fn sentence(body: &str) -> String {
        format!("${body}*{:02X}\r\n", body.bytes().fold(0, |x, b| x ^ b))
    }

    #[test]
    fn gga_gives_ellipsoidal_height_and_crosses_midnight() {
        let start = Epoch::parse("2010-07-01T23:59:59Z").unwrap();
        let options = Options { start, max_gap_s: 2.0 };
        let rmc = sentence("GPRMC,235958.50,A,2630.0,N,08012.0,E,0,0,010710,,");
        let text = [
            rmc,
            sentence("GPGGA,235959.50,0030.0000,N,00012.0000,E,1,08,0.9,100.0,M,-30.0,M,,"),
            sentence("GPGGA,000000.00,,,,,0,00,,,M,,M,,"),
            sentence("GNGGA,000000.50,0030.0000,S,00012.0000,W,1,08,0.9,100.0,M,-30.0,M,,"),
        ];
        let text = text.concat();
        // Over equator and meridian in 1 s: 1.2e5 m/s, and two rows make no acceleration.
        let (trajectory, without_fix) = read_nmea(text.as_bytes(), "ride.nmea", &options).unwrap();
        assert_eq!((trajectory.span_s(), without_fix), ((0.5, 1.5), 1));
        let (first, last) = (trajectory.at(0.5).position_m, trajectory.at(1.5).position_m);
        assert!((first - Geodetic::from_degrees(0.5, 0.2, 70.0).to_ecef()).norm() < 1e-8);
        assert!((last - Geodetic::from_degrees(-0.5, -0.2, 70.0).to_ecef()).norm() < 1e-8);
    }

    #[test]
    fn damaged_gga_is_refused_with_its_reason() {
        let good = sentence("GPGGA,100000,2630.0,N,08012.0,E,1,08,0.9,100.0,M,-30.0,M,,");
        for (text, reason) in [
            (good.replace("2630.0", "2631.0"), "checksum is wrong"),
            (good.replace('*', ","), "no checksum"),
            (sentence("GPGGA,100000,2630.0,N,08012.0,E,1,08,0.9,100.0,M,,M,,"), "geoid"),
            (sentence("GPGGA,250000,2630.0,N,08012.0,E,1,08,0.9,100.0,M,-30.0,M,,"), "hhmmss"),
            (sentence("GPGGA,100000,9930.0,N,08012.0,E,1,08,0.9,100.0,M,-30.0,M,,"), "position"),
            (sentence("GPGGA,100000,2630.0,N"), "12 fields"),
            ("nothing here\n".to_owned(), "at least 2"),
        ] {
            let error = read_nmea(text.as_bytes(), "ride.nmea", &options()).unwrap_err().to_string();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }

    proptest::proptest! {
        #[test]
        fn no_bytes_make_the_readers_panic(bytes: Vec<u8>, rows in "[-0-9.,e\\n]{0,80}", tail in "[0-9A-Z.,*]{0,60}") {
            let _ = read_csv(bytes.as_slice(), "any", &options());
            let _ = read_nmea(bytes.as_slice(), "any", &options());
            let _ = csv(&format!("{HEADER}{rows}"));
            let _ = read_nmea(format!("$GPGGA,{tail}").as_bytes(), "any", &options());
            let _ = read_nmea(sentence(&format!("GPGGA,{tail}")).as_bytes(), "any", &options());
        }
    }
}
