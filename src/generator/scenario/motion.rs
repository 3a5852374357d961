//! Table `[motion]`: the kind of vehicle, and its parameters.

use std::path::PathBuf;

use super::ScenarioError;
use super::read::Table;
use crate::vehicle::orbit::Orbit;
use crate::vehicle::rocket::Rocket;
use crate::vehicle::route::{Limits, Turning, Waypoint};
use gnss::earth::Geodetic;

/// Format of a trajectory file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// Rows of time and position.
    Csv,
    /// NMEA sentences of kind GGA.
    Nmea,
}

/// Motion as meant, with its file not yet read.
#[derive(Clone, Debug, PartialEq)]
pub enum MotionSpec {
    /// Antenna at rest at a position.
    Static(Geodetic),
    /// Route through waypoints with smooth turns.
    Waypoints {
        /// The positions, with the speeds between them.
        points: Vec<Waypoint>,
        /// Limits of the route's acceleration.
        limits: Limits,
    },
    /// Rows of a file.
    File {
        /// The file.
        path: PathBuf,
        /// Format of the file.
        kind: FileKind,
        /// Longest time between two rows, in seconds.
        max_gap_s: f64,
        /// Largest distance in metres between the motion and its rows.
        tolerance_m: Option<f64>,
    },
    /// A powered flight.
    Rocket(Rocket),
    /// A free flight round the Earth.
    Orbit(Orbit),
    /// Motion that is pushed while the scene is sent, tick by tick.
    Pushed {
        /// Position before the first push.
        place: Geodetic,
        /// Length of a tick, in seconds.
        tick_s: f64,
        /// Time in seconds in which the transmitted motion joins the pushed one.
        join_s: f64,
        /// Age of a push up to which its acceleration is kept.
        hold_s: f64,
        /// Largest jerk of a join, in m/s³.
        max_jerk_mps3: f64,
    },
    /// The ticks of a live run again.
    Ticks {
        /// Path of the log of ticks.
        path: PathBuf,
        /// Path of the table of events during the run.
        events: Option<PathBuf>,
        /// Length of a tick, in seconds.
        tick_s: f64,
    },
}

#[derive(Clone, Copy)]
enum Kind {
    Static,
    Waypoints,
    File,
    Rocket,
    Orbit,
    Pushed,
    Ticks,
}

impl MotionSpec {
    /// Name of the kind as a scenario writes it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Static(_) => "static",
            Self::Waypoints { .. } => "waypoints",
            Self::File { .. } => "file",
            Self::Rocket(_) => "rocket",
            Self::Orbit(_) => "orbit",
            Self::Pushed { .. } => "pushed",
            Self::Ticks { .. } => "ticks",
        }
    }

    pub(super) fn read(table: &Table<'_>) -> Result<Self, ScenarioError> {
        let kinds = [
            ("static", Kind::Static),
            ("waypoints", Kind::Waypoints),
            ("file", Kind::File),
            ("rocket", Kind::Rocket),
            ("orbit", Kind::Orbit),
            ("pushed", Kind::Pushed),
            ("ticks", Kind::Ticks),
        ];
        match table.need_choice("kind", &kinds)? {
            Kind::Static => Ok(Self::Static(place(table)?)),
            Kind::Waypoints => waypoints(table),
            Kind::File => file(table),
            Kind::Rocket => Ok(Self::Rocket(rocket(table)?)),
            Kind::Orbit => Ok(Self::Orbit(orbit(table)?)),
            Kind::Pushed => Ok(Self::Pushed {
                place: place(table)?,
                tick_s: table.need("tick_s")?,
                join_s: table.need("join_s")?,
                hold_s: table.need("hold_s")?,
                max_jerk_mps3: table.need("max_jerk_mps3")?,
            }),
            Kind::Ticks => {
                let events = table.text("events")?.map(PathBuf::from);
                Ok(Self::Ticks { path: PathBuf::from(table.need_text("file")?), events, tick_s: table.need("tick_s")? })
            }
        }
    }
}

pub(super) fn place(table: &Table<'_>) -> Result<Geodetic, ScenarioError> {
    Ok(Geodetic::from_degrees(table.need("latitude_deg")?, table.need("longitude_deg")?, table.need("height_m")?))
}

fn waypoints(table: &Table<'_>) -> Result<MotionSpec, ScenarioError> {
    let acceleration = table.number("turn_acceleration_mps2")?;
    let radius = table.number("turn_radius_m")?;
    let turning = match (acceleration, radius) {
        (Some(_), Some(_)) => {
            return Err(table.bad("turn_radius_m", "only one of turn_acceleration_mps2 and turn_radius_m"));
        }
        (None, Some(m)) => Turning::Radius { m },
        (_, None) => Turning::Acceleration { mps2: table.need("turn_acceleration_mps2")? },
    };
    let limits =
        Limits { turning, acceleration_mps2: table.need("acceleration_mps2")?, jerk_mps3: table.need("jerk_mps3")? };
    let expected = "two or more [[motion.point]] tables, at most 10000";
    let tables = table.tables("point")?.filter(|points| (2..=10_000).contains(&points.len()));
    let tables = tables.ok_or_else(|| table.bad("point", expected))?;
    let mut points = Vec::with_capacity(tables.len());
    for point in &tables {
        let waypoint =
            Waypoint { place: place(point)?, speed_mps: point.need("speed_mps")?, hold_s: point.need("hold_s")? };
        if waypoint.speed_mps > 0.0 && waypoint.hold_s > 0.0 {
            return Err(point.bad("hold_s", "0, because speed_mps is not 0 there"));
        }
        points.push(waypoint);
    }
    Ok(MotionSpec::Waypoints { points, limits })
}

fn file(table: &Table<'_>) -> Result<MotionSpec, ScenarioError> {
    let path = PathBuf::from(table.need_text("file")?);
    let by_name = match path.extension().and_then(|e| e.to_str()) {
        Some("nmea" | "NMEA" | "ubx" | "log") => FileKind::Nmea,
        _ => FileKind::Csv,
    };
    let formats = [("csv", FileKind::Csv), ("nmea", FileKind::Nmea)];
    let kind = table.choice("format", &formats)?.unwrap_or(by_name);
    let max_gap_s = table.need("max_gap_s")?;
    Ok(MotionSpec::File { path, kind, max_gap_s, tolerance_m: table.number("tolerance_m")? })
}

fn rocket(table: &Table<'_>) -> Result<Rocket, ScenarioError> {
    Ok(Rocket {
        pad: place(table)?,
        azimuth_rad: table.need("azimuth_deg")?.to_radians(),
        elevation_rad: table.need("elevation_deg")?.to_radians(),
        ignition_s: table.need("ignition_s")?,
        thrust_mps2: table.need("thrust_mps2")?,
        burn_s: table.need("burn_s")?,
        jerk_mps3: table.need("jerk_mps3")?,
        drag_m2pkg: table.need("drag_m2pkg")?,
        oblate: table.choice("gravity", &[("central", false), ("j2", true)])?.unwrap_or(true),
    })
}

fn orbit(table: &Table<'_>) -> Result<Orbit, ScenarioError> {
    let angle = |key: &str| -> Result<f64, ScenarioError> { Ok(table.need(key)?.to_radians()) };
    Ok(Orbit {
        semi_major_axis_m: table.need("semi_major_axis_m")?,
        eccentricity: table.need("eccentricity")?,
        inclination_rad: table.need("inclination_deg")?.to_radians(),
        node_longitude_rad: angle("node_longitude_deg")?,
        argument_of_perigee_rad: angle("argument_of_perigee_deg")?,
        mean_anomaly_rad: angle("mean_anomaly_deg")?,
    })
}
