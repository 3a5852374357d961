//! Receiving antenna: gain and phase over direction, in the axes of the body that carries it.
//!
//! Patterns are a function of azimuth from the antenna's north over its east and of elevation above its
//! plane. On a body with an attitude north leans towards the nose; else antenna and local axes are the same.
//! A table is linear in dB and in degrees of phase between its directions. Limits: one polarisation, one
//! frequency.

use std::fmt;
use std::io::Read;
use std::sync::Arc;

use serde::Deserialize;
use thiserror::Error;

use super::wind_up::dipoles;
use crate::ray::Sight;
use crate::vehicle::Trajectory;
use gnss::earth::Look;
use gnss::time::Epoch;

/// Gain over angle (degrees, ascending), linear between the points and constant outside.
pub(super) type Curve = [(f64, f64)];

/// Receive gain of a patch over elevation, dBic.
const PATCH: [(f64, f64); 11] = [
    (-90.0, -15.0),
    (-10.0, -8.0),
    (0.0, -5.0),
    (5.0, -4.0),
    (10.0, -2.5),
    (20.0, -0.5),
    (30.0, 1.0),
    (45.0, 2.8),
    (60.0, 4.0),
    (75.0, 4.8),
    (90.0, 5.0),
];
/// Gain of crossed dipoles along their axis for their own polarisation, 3/2.
const TURNSTILE_DBIC: f64 = 1.760_912_590_556_812;
/// The turnstile's null is not deeper: nothing real is, and a carrier needs an amplitude.
const DEEPEST_DB: f64 = -60.0;
/// Directions of a table at most.
const MAX_DIRECTIONS: usize = 1 << 20;

/// Gain and phase of an antenna by direction.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// 0 dBic everywhere.
    Isotropic,
    /// A patch: 5 dBic at the zenith, −4 dBic at 5°.
    Patch,
    /// Crossed dipoles: (1 + cos)²/4 of 1.76 dBic over the angle from the axis, smooth everywhere.
    Turnstile,
    /// Gain and phase by direction.
    Table(Arc<Table>),
}

impl Pattern {
    /// Gain (dBic) and phase (cycles, growing with range) towards `look` in the antenna's axes.
    pub fn response(&self, look: Look) -> (f64, f64) {
        match self {
            Self::Isotropic => (0.0, 0.0),
            Self::Patch => (gain_db(&PATCH, look.elevation_rad.to_degrees()), 0.0),
            Self::Turnstile => {
                let amplitude = 0.5 * (1.0 + libm::sin(look.elevation_rad));
                (TURNSTILE_DBIC + (20.0 * libm::log10(amplitude)).max(DEEPEST_DB), 0.0)
            }
            Self::Table(table) => table.response(look),
        }
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Isotropic => f.write_str("isotropic antenna"),
            Self::Patch => f.write_str("patch antenna"),
            Self::Turnstile => f.write_str("turnstile antenna"),
            Self::Table(table) => {
                write!(f, "antenna by a table of {} x {} directions", table.azimuths.len(), table.elevations.len())
            }
        }
    }
}

/// Value of a curve at an angle.
pub(super) fn gain_db(curve: &Curve, angle_deg: f64) -> f64 {
    let right = curve.partition_point(|(angle, _)| *angle <= angle_deg);
    let left = right.checked_sub(1).and_then(|i| curve.get(i));
    match (left, curve.get(right)) {
        (Some((a, low)), Some((b, high))) => low + (high - low) * (angle_deg - a) / (b - a),
        (Some((_, gain)), None) | (None, Some((_, gain))) => *gain,
        (None, None) => 0.0,
    }
}

/// Antenna and the attitude of its body.
#[derive(Clone, Debug)]
pub struct Antenna {
    /// Gain and phase by direction.
    pub pattern: Pattern,
    /// Scene's start and the motion of the body, if it has an attitude.
    pub body: Option<(Epoch, Arc<Trajectory>)>,
}

impl Antenna {
    /// Creates an antenna that looks up.
    pub fn level(pattern: Pattern) -> Self {
        Self { pattern, body: None }
    }

    /// Gain (dBic) and phase (cycles) along `sight`.
    pub fn response(&self, sight: &Sight) -> (f64, f64) {
        self.pattern.response(self.look(sight))
    }

    /// Direction of the satellite in the antenna's axes.
    fn look(&self, sight: &Sight) -> Look {
        let turned = self.body.as_ref().and_then(|(start, trajectory)| {
            let axes = trajectory.orientation(sight.received.since(*start))?.axes();
            let up = trajectory.attitude()?.boresight;
            let towards = axes.inverse() * ((sight.satellite.position_m - sight.user_m) / sight.range_m);
            let (east, north) = dipoles(&up);
            let (e, n, u) = (towards.dot(&east), towards.dot(&north), towards.dot(&up));
            let azimuth_rad = libm::atan2(e, n).rem_euclid(std::f64::consts::TAU);
            Some(Look { azimuth_rad, elevation_rad: libm::atan2(u, libm::hypot(e, n)) })
        });
        turned.unwrap_or(sight.look)
    }
}

/// Gain and phase on a grid of directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Degrees, ascending; the last azimuth is 360 and repeats the first.
    azimuths: Vec<f64>,
    elevations: Vec<f64>,
    /// dBic and degrees, elevation by elevation within an azimuth.
    values: Vec<(f64, f64)>,
}

/// Reason for which a table is refused.
#[derive(Debug, Error)]
pub enum PatternError {
    /// A table that is no CSV file.
    #[error("{name}: {source}; expected columns azimuth_deg, elevation_deg, gain_dbic, phase_deg")]
    Csv {
        /// The file.
        name: String,
        /// Error of the CSV reader.
        source: csv::Error,
    },
    /// A number that is out of range.
    #[error("{name}, row {row}: {column} = {value}: expected {expected}")]
    Value {
        /// The file.
        name: String,
        /// Line of the table, from 1.
        row: usize,
        /// Column of the table.
        column: &'static str,
        /// The value that is there.
        value: f64,
        /// Values that are expected.
        expected: &'static str,
    },
    /// Rows that form no complete grid of azimuths and elevations.
    #[error("{name}: {rows} rows for {azimuths} azimuths and {elevations} elevations: expected each pair once")]
    Grid {
        /// The file.
        name: String,
        /// Rows found.
        rows: usize,
        /// Different azimuths.
        azimuths: usize,
        /// Different elevations.
        elevations: usize,
    },
    /// Azimuths that are not equally spaced over the whole circle.
    #[error(
        "{name}: the phase changes by {step_deg:.1} deg between neighbours: expected less than 180; add or subtract \
         turns"
    )]
    Wrap {
        /// The file.
        name: String,
        /// Largest change of the phase between neighbours, in degrees.
        step_deg: f64,
    },
}

#[derive(Deserialize)]
struct Row {
    azimuth_deg: f64,
    elevation_deg: f64,
    gain_dbic: f64,
    phase_deg: f64,
}

impl Table {
    /// Reads a CSV table; `name` is used in errors. Directions may come in any order but must make a whole
    /// grid.
    ///
    /// # Errors
    /// [`PatternError`] with row and column.
    pub fn read(input: impl Read, name: &str) -> Result<Self, PatternError> {
        let mut rows = Vec::new();
        let failed = |source| PatternError::Csv { name: name.to_owned(), source };
        let mut reader = csv::Reader::from_reader(input);
        // Rows alone would take a header that cannot be read for one that is not there.
        reader.headers().map_err(failed)?;
        for row in reader.into_deserialize::<Row>() {
            let row = row.map_err(failed)?;
            let checks = [
                ("azimuth_deg", row.azimuth_deg, 0.0, 359.999, "0 to less than 360"),
                ("elevation_deg", row.elevation_deg, -90.0, 90.0, "-90 to 90"),
                ("gain_dbic", row.gain_dbic, -100.0, 60.0, "-100 to 60 dBic"),
                ("phase_deg", row.phase_deg, -36_000.0, 36_000.0, "-36000 to 36000"),
            ];
            for (column, value, low, high, expected) in checks {
                if !(low..=high).contains(&value) {
                    // The header is line 1.
                    let row = rows.len() + 2;
                    return Err(PatternError::Value { name: name.to_owned(), row, column, value, expected });
                }
            }
            rows.push(row);
            if rows.len() > MAX_DIRECTIONS {
                break;
            }
        }
        let distinct = |of: fn(&Row) -> f64| {
            let mut all: Vec<f64> = rows.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        };
        let (mut azimuths, elevations) = (distinct(|row| row.azimuth_deg), distinct(|row| row.elevation_deg));
        rows.sort_by(|a, b| a.azimuth_deg.total_cmp(&b.azimuth_deg).then(a.elevation_deg.total_cmp(&b.elevation_deg)));
        let twice = rows
            .windows(2)
            .any(|w| matches!(w, [a, b] if a.azimuth_deg == b.azimuth_deg && a.elevation_deg == b.elevation_deg));
        if rows.is_empty() || twice || rows.len() != azimuths.len() * elevations.len() {
            let (rows, azimuths, elevations) = (rows.len(), azimuths.len(), elevations.len());
            return Err(PatternError::Grid { name: name.to_owned(), rows, azimuths, elevations });
        }
        let mut values: Vec<(f64, f64)> = rows.iter().map(|row| (row.gain_dbic, row.phase_deg)).collect();
        if let Some(first) = azimuths.first().copied() {
            azimuths.push(first + 360.0);
            values.extend_from_within(..elevations.len());
        }
        let table = Self { azimuths, elevations, values };
        let step_deg = table.largest_phase_step_deg();
        if step_deg >= 180.0 {
            return Err(PatternError::Wrap { name: name.to_owned(), step_deg });
        }
        Ok(table)
    }

    fn largest_phase_step_deg(&self) -> f64 {
        let count = self.elevations.len();
        let along = self.values.chunks(count).flat_map(|column| column.windows(2).map(|w| (w[1].1 - w[0].1).abs()));
        let across = self.values.iter().zip(self.values.iter().skip(count)).map(|(a, b)| (b.1 - a.1).abs());
        along.chain(across).fold(0.0, f64::max)
    }

    /// Gain (dBic) and phase (cycles), bilinear; elevations beyond the table's take its nearest.
    fn response(&self, look: Look) -> (f64, f64) {
        let first = self.azimuths.first().copied().unwrap_or(0.0);
        let azimuth_deg = first + (look.azimuth_rad.to_degrees() - first).rem_euclid(360.0);
        let (column, right) = place(&self.azimuths, azimuth_deg);
        let (row, up) = place(&self.elevations, look.elevation_rad.to_degrees());
        let count = self.elevations.len();
        let next = (row + 1).min(count - 1);
        let last = self.azimuths.len() - 1;
        let at =
            |column: usize, row: usize| self.values.get(column.min(last) * count + row).copied().unwrap_or_default();
        let mix = |a: (f64, f64), b: (f64, f64), share: f64| (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share);
        let left = mix(at(column, row), at(column, next), up);
        let (gain_dbic, phase_deg) = mix(left, mix(at(column + 1, row), at(column + 1, next), up), right);
        (gain_dbic, phase_deg / 360.0)
    }
}

/// The interval of ascending `points` that holds `x`, and the share of it below `x`.
fn place(points: &[f64], x: f64) -> (usize, f64) {
    let right = points.partition_point(|point| *point <= x).min(points.len().saturating_sub(1));
    let left = right.saturating_sub(1);
    match (points.get(left), points.get(right)) {
        (Some(a), Some(b)) if a < b => (left, ((x - a) / (b - a)).clamp(0.0, 1.0)),
        _ => (left, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(azimuth_deg: f64, elevation_deg: f64) -> Look {
        Look { azimuth_rad: azimuth_deg.to_radians(), elevation_rad: elevation_deg.to_radians() }
    }

    const HEADER: &str = "azimuth_deg,elevation_deg,gain_dbic,phase_deg\n";

    #[test]
    fn a_table_is_itself_at_its_directions_and_bilinear_between_them_all_the_way_round() {
        let text = format!("{HEADER}0,0,-5,0\n0,90,5,10\n120,0,-3,20\n120,90,5,10\n240,0,-1,-20\n240,90,5,10\n");
        let pattern = Pattern::Table(Arc::new(Table::read(text.as_bytes(), "t").unwrap()));
        let cases = [
            (0.0, 0.0, -5.0, 0.0),
            (120.0, 0.0, -3.0, 20.0),
            (60.0, 0.0, -4.0, 10.0),
            (300.0, 0.0, -3.0, -10.0),
            (359.999_999, 90.0, 5.0, 10.0),
            (60.0, 45.0, 0.5, 10.0),
            (120.0, -40.0, -3.0, 20.0),
        ];
        for (azimuth, elevation, gain_dbic, phase_deg) in cases {
            let found = pattern.response(look(azimuth, elevation));
            // A direction is rounded to 6e-14 deg; slopes are below 0.2 a degree.
            assert!((found.0 - gain_dbic).abs() < 1e-12 && (found.1 * 360.0 - phase_deg).abs() < 1e-11, "{found:?}");
        }
    }

    #[test]
    fn a_table_with_a_hole_a_wrap_or_a_wrong_number_is_refused() {
        let error = |rows: &str| Table::read(format!("{HEADER}{rows}").as_bytes(), "t").unwrap_err().to_string();
        assert!(error("0,0,1,0\n0,90,1,0\n90,0,1,0\n").contains("3 rows for 2 azimuths and 2 elevations"));
        assert!(error("").contains("0 rows"));
        assert!(error("0,0,1,0\n0,90,1,200\n").contains("changes by 200.0 deg"));
        assert!(error("360,0,1,0\n").contains("row 2: azimuth_deg = 360"));
        assert!(error("0,0,nan,0\n").contains("gain_dbic"));
        assert!(error("0,0,x,0\n").contains("expected columns"));
    }

    #[test]
    fn a_turnstile_radiates_what_it_is_fed_with() {
        // Mean over the sphere of the gain for its own polarisation: one half, the other half is of the other
        // sense.
        let steps = 2000;
        let mean = (0..steps).map(|k| (f64::from(k) + 0.5) / f64::from(steps) * 2.0 - 1.0).map(|sin| {
            let elevation_rad = libm::asin(sin);
            let (gain_dbic, _) = Pattern::Turnstile.response(Look { azimuth_rad: 0.0, elevation_rad });
            libm::pow(10.0, gain_dbic / 10.0) / f64::from(steps)
        });
        // Midpoint rule: second derivative 0.75 times (1/1000)²/24.
        assert!((mean.sum::<f64>() - 0.5).abs() < 1e-6);
    }
}
