//! `[motion]`: which vehicle, and its numbers.

use std::path::PathBuf;

use super::ScenarioError;
use super::read::Table;
use crate::generator::vehicle::orbit::Orbit;
use crate::generator::vehicle::rocket::Rocket;
use crate::generator::vehicle::route::{Limits, Turning, Waypoint};
use crate::gnss::earth::Geodetic;

/// Every key of `[motion]`; each kind knows some of them.
pub(super) const KEYS: &[&str] = &[
    "kind",
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "point",
    "turn_acceleration_mps2",
    "turn_radius_m",
    "acceleration_mps2",
    "jerk_mps3",
    "file",
    "format",
    "max_gap_s",
    "azimuth_deg",
    "elevation_deg",
    "ignition_s",
    "thrust_mps2",
    "burn_s",
    "drag_m2pkg",
    "gravity",
    "semi_major_axis_m",
    "eccentricity",
    "inclination_deg",
    "node_longitude_deg",
    "argument_of_perigee_deg",
    "mean_anomaly_deg",
];
pub(super) const PLACE: [&str; 3] = ["latitude_deg", "longitude_deg", "height_m"];
/// Keys of `[[motion.point]]`.
pub(super) const POINT_KEYS: &[&str] = &["latitude_deg", "longitude_deg", "height_m", "speed_mps", "hold_s"];

/// How a trajectory file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    Csv,
    Nmea,
}

/// The motion as meant, with its file not yet read.
#[derive(Clone, Debug, PartialEq)]
pub enum MotionSpec {
    Static(Geodetic),
    Waypoints { points: Vec<Waypoint>, limits: Limits },
    File { path: PathBuf, kind: FileKind, max_gap_s: f64 },
    Rocket(Rocket),
    Orbit(Orbit),
}

#[derive(Clone, Copy)]
enum Kind {
    Static,
    Waypoints,
    File,
    Rocket,
    Orbit,
}

impl MotionSpec {
    /// The kind as a scenario writes it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Static(_) => "static",
            Self::Waypoints { .. } => "waypoints",
            Self::File { .. } => "file",
            Self::Rocket(_) => "rocket",
            Self::Orbit(_) => "orbit",
        }
    }

    pub(super) fn read(table: &Table<'_>) -> Result<Self, ScenarioError> {
        let kinds = [
            ("static", Kind::Static),
            ("waypoints", Kind::Waypoints),
            ("file", Kind::File),
            ("rocket", Kind::Rocket),
            ("orbit", Kind::Orbit),
        ];
        let expected = "one of static, waypoints, file, rocket, orbit";
        let kind = table.choice("kind", &kinds)?.ok_or_else(|| table.bad("kind", expected))?;
        match kind {
            Kind::Static => {
                table.allow(&[&["kind"], PLACE.as_slice()].concat())?;
                Ok(Self::Static(place(table)?))
            }
            Kind::Waypoints => waypoints(table),
            Kind::File => file(table),
            Kind::Rocket => Ok(Self::Rocket(rocket(table)?)),
            Kind::Orbit => Ok(Self::Orbit(orbit(table)?)),
        }
    }
}

pub(super) fn place(table: &Table<'_>) -> Result<Geodetic, ScenarioError> {
    Ok(Geodetic::from_degrees(
        table.required("latitude_deg", -90.0..=90.0, "deg")?,
        table.required("longitude_deg", -180.0..=360.0, "deg")?,
        table.required("height_m", -12_000.0..=4e7, "m")?,
    ))
}

fn waypoints(table: &Table<'_>) -> Result<MotionSpec, ScenarioError> {
    table.allow(&["kind", "point", "turn_acceleration_mps2", "turn_radius_m", "acceleration_mps2", "jerk_mps3"])?;
    let acceleration = table.number("turn_acceleration_mps2", 1e-3..=1e5, "m/s2")?;
    let radius = table.number("turn_radius_m", 0.1..=1e6, "m")?;
    let turning = match (acceleration, radius) {
        (Some(_), Some(_)) => {
            return Err(table.bad("turn_radius_m", "only one of turn_acceleration_mps2 and turn_radius_m"));
        }
        (None, Some(m)) => Turning::Radius { m },
        (acceleration, None) => Turning::Acceleration { mps2: acceleration.unwrap_or(2.0) },
    };
    let limits = Limits {
        turning,
        acceleration_mps2: table.number("acceleration_mps2", 1e-3..=1e5, "m/s2")?.unwrap_or(2.0),
        jerk_mps3: table.number("jerk_mps3", 1e-3..=1e6, "m/s3")?.unwrap_or(2.0),
    };
    let expected = "two or more [[motion.point]] tables, at most 10000";
    let tables = table.tables("point")?.filter(|points| (2..=10_000).contains(&points.len()));
    let tables = tables.ok_or_else(|| table.bad("point", expected))?;
    let mut points = Vec::with_capacity(tables.len());
    for point in &tables {
        point.allow(POINT_KEYS)?;
        let waypoint = Waypoint {
            place: place(point)?,
            speed_mps: point.required("speed_mps", 0.0..=1e5, "m/s")?,
            hold_s: point.number("hold_s", 0.0..=86_400.0, "s")?.unwrap_or(0.0),
        };
        if waypoint.speed_mps > 0.0 && waypoint.hold_s > 0.0 {
            return Err(point.bad("hold_s", "0, because speed_mps is not 0 there"));
        }
        points.push(waypoint);
    }
    Ok(MotionSpec::Waypoints { points, limits })
}

fn file(table: &Table<'_>) -> Result<MotionSpec, ScenarioError> {
    table.allow(&["kind", "file", "format", "max_gap_s"])?;
    let path = PathBuf::from(table.text("file", "a path")?.ok_or_else(|| table.bad("file", "a path"))?);
    let by_name = match path.extension().and_then(|e| e.to_str()) {
        Some("nmea" | "NMEA" | "ubx" | "log") => FileKind::Nmea,
        _ => FileKind::Csv,
    };
    let formats = [("csv", FileKind::Csv), ("nmea", FileKind::Nmea)];
    let kind = table.choice("format", &formats)?.unwrap_or(by_name);
    let max_gap_s = table.number("max_gap_s", 0.001..=3600.0, "s")?.unwrap_or(2.0);
    Ok(MotionSpec::File { path, kind, max_gap_s })
}

fn rocket(table: &Table<'_>) -> Result<Rocket, ScenarioError> {
    let own = [
        "kind",
        "azimuth_deg",
        "elevation_deg",
        "ignition_s",
        "thrust_mps2",
        "burn_s",
        "jerk_mps3",
        "drag_m2pkg",
        "gravity",
    ];
    table.allow(&[own.as_slice(), PLACE.as_slice()].concat())?;
    Ok(Rocket {
        pad: place(table)?,
        azimuth_rad: table.required("azimuth_deg", -360.0..=360.0, "deg")?.to_radians(),
        elevation_rad: table.required("elevation_deg", 0.0..=90.0, "deg")?.to_radians(),
        ignition_s: table.required("ignition_s", 0.0..=86_400.0, "s")?,
        thrust_mps2: table.required("thrust_mps2", 0.1..=1e5, "m/s2")?,
        burn_s: table.required("burn_s", 0.001..=3600.0, "s")?,
        jerk_mps3: table.required("jerk_mps3", 0.1..=1e7, "m/s3")?,
        drag_m2pkg: table.number("drag_m2pkg", 0.0..=1.0, "m2/kg")?.unwrap_or(0.0),
        oblate: table.choice("gravity", &[("central", false), ("j2", true)])?.unwrap_or(true),
    })
}

fn orbit(table: &Table<'_>) -> Result<Orbit, ScenarioError> {
    table.allow(&[
        "kind",
        "semi_major_axis_m",
        "eccentricity",
        "inclination_deg",
        "node_longitude_deg",
        "argument_of_perigee_deg",
        "mean_anomaly_deg",
    ])?;
    let angle = |key: &str| -> Result<f64, ScenarioError> {
        Ok(table.number(key, -360.0..=360.0, "deg")?.unwrap_or(0.0).to_radians())
    };
    Ok(Orbit {
        semi_major_axis_m: table.required("semi_major_axis_m", 6.4e6..=1e9, "m")?,
        eccentricity: table.number("eccentricity", 0.0..=0.99, "")?.unwrap_or(0.0),
        inclination_rad: table.required("inclination_deg", 0.0..=180.0, "deg")?.to_radians(),
        node_longitude_rad: angle("node_longitude_deg")?,
        argument_of_perigee_rad: angle("argument_of_perigee_deg")?,
        mean_anomaly_rad: angle("mean_anomaly_deg")?,
    })
}
