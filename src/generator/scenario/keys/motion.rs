//! Keys of `[motion]` and `[attitude]`.

use super::A_PATH;
use crate::scenario::schema::{Key, number, numbers, tables, text, word};

const fn latitude() -> Key {
    number("latitude_deg", -90.0, 90.0, "deg", "geodetic latitude, WGS 84")
}

const fn longitude() -> Key {
    number("longitude_deg", -180.0, 360.0, "deg", "longitude, east positive")
}

const fn height() -> Key {
    number("height_m", -12_000.0, 4e7, "m", "height above the ellipsoid")
}

/// A position that must be given.
pub(crate) const PLACE: [Key; 3] = [latitude().required(), longitude().required(), height().required()];
/// A position that may be absent as a whole.
pub(crate) const PLACE_IF_ANY: [Key; 3] = [latitude(), longitude(), height()];

const GROUND: &[&str] = &["static", "rocket", "pushed"];
const ROUTE: &[&str] = &["waypoints"];
const FROM_FILE: &[&str] = &["file"];
const TICKS: &[&str] = &["ticks"];
const PUSHED: &[&str] = &["pushed"];
const ROCKET: &[&str] = &["rocket"];
const ORBIT: &[&str] = &["orbit"];

pub(crate) const MOTION: &[Key] = &[
    word("kind", || vec!["static", "waypoints", "file", "rocket", "orbit", "pushed", "ticks"], "kind of motion")
        .required(),
    PLACE[0].of(GROUND),
    PLACE[1].of(GROUND),
    PLACE[2].of(GROUND),
    tables("point", POINT, "Point of the route; at least two.").required().of(ROUTE),
    number(
        "turn_acceleration_mps2",
        1e-3,
        1e5,
        "m/s2",
        "acceleration across the path in turns; not with turn_radius_m",
    )
    .or(2.0)
    .of(ROUTE),
    number("turn_radius_m", 0.1, 1e6, "m", "radius of turns").of(ROUTE),
    number("acceleration_mps2", 1e-3, 1e5, "m/s2", "largest acceleration along the path").or(2.0).of(ROUTE),
    number("jerk_mps3", 1e-3, 1e6, "m/s3", "largest jerk").or(2.0).of(ROUTE),
    text("file", A_PATH, "trajectory: CSV (`time_s` and a position per row) or NMEA GGA").required().of(FROM_FILE),
    word("format", || vec!["csv", "nmea"], "format of the file").or_else("by the file's name").of(FROM_FILE),
    number("max_gap_s", 0.001, 3600.0, "s", "longest time between rows that is interpolated").or(2.0).of(FROM_FILE),
    number(
        "tolerance_m",
        1e-6,
        100.0,
        "m",
        "largest distance of the motion from the logged positions, half of their last digit; the smoothest motion \
         within it is used",
    )
    .or_else("the motion passes every row")
    .of(FROM_FILE),
    text("file", A_PATH, "`ticks.csv` of a live run's record, for replay").required().of(TICKS),
    text("events", A_PATH, "`events.csv` of the same record, if it has events").of(TICKS),
    number("tick_s", 0.001, 0.1, "s", "length of a tick, rounded to samples; at least 4096 samples")
        .or(0.01)
        .of(&["pushed", "ticks"]),
    number("join_s", 0.001, 2.0, "s", "time over which the motion blends into the latest pushed state")
        .or(0.1)
        .of(PUSHED),
    number("hold_s", 0.001, 60.0, "s", "age of the latest pushed state up to which its acceleration is used")
        .or(0.5)
        .of(PUSHED),
    number("max_jerk_mps3", 1.0, 1e9, "m/s3", "largest jerk of a blend; a larger one is counted as a snap")
        .or(2e4)
        .of(PUSHED),
    number("azimuth_deg", -360.0, 360.0, "deg", "direction of flight from north over east").required().of(ROCKET),
    number("elevation_deg", 0.0, 90.0, "deg", "elevation of the direction of thrust").required().of(ROCKET),
    number("ignition_s", 0.0, 86_400.0, "s", "time of ignition").required().of(ROCKET),
    number("thrust_mps2", 0.1, 1e5, "m/s2", "thrust divided by mass").required().of(ROCKET),
    number("burn_s", 0.001, 3600.0, "s", "duration of the burn").required().of(ROCKET),
    number(
        "jerk_mps3",
        0.1,
        1e7,
        "m/s3",
        "rate of thrust rise at ignition and of its fall at burn-out, divided by mass",
    )
    .required()
    .of(ROCKET),
    number("drag_m2pkg", 0.0, 1.0, "m2/kg", "drag coefficient times area, divided by mass").or(0.0).of(ROCKET),
    word("gravity", || vec!["central", "j2"], "gravity model").or_else("j2").of(ROCKET),
    number("semi_major_axis_m", 6.4e6, 1e9, "m", "semi-major axis of the orbit").required().of(ORBIT),
    number("eccentricity", 0.0, 0.99, "", "eccentricity of the orbit").or(0.0).of(ORBIT),
    number("inclination_deg", 0.0, 180.0, "deg", "inclination of the orbit").required().of(ORBIT),
    number("node_longitude_deg", -360.0, 360.0, "deg", "longitude of the ascending node at the scene's start")
        .or(0.0)
        .of(ORBIT),
    number("argument_of_perigee_deg", -360.0, 360.0, "deg", "argument of perigee").or(0.0).of(ORBIT),
    number("mean_anomaly_deg", -360.0, 360.0, "deg", "mean anomaly at the scene's start").or(0.0).of(ORBIT),
];

pub(crate) const POINT: &[Key] = &[
    PLACE[0],
    PLACE[1],
    PLACE[2],
    number("speed_mps", 0.0, 1e5, "m/s", "speed at the point; 0 is a stop").required(),
    number("hold_s", 0.0, 86_400.0, "s", "duration of the stop; only with speed_mps = 0").or(0.0),
];

pub(crate) const ATTITUDE: &[Key] = &[
    word(
        "kind",
        || vec!["fixed", "velocity", "pushed"],
        "fixed to north, nose along the velocity, or pushed with the motion",
    )
    .required(),
    number(
        "yaw_deg",
        -360.0,
        360.0,
        "deg",
        "heading, or angle from the velocity; with kind = \"pushed\" the angle before the first state",
    )
    .or(0.0),
    number("pitch_deg", -90.0, 90.0, "deg", "nose up").or(0.0),
    number("roll_deg", -360.0, 360.0, "deg", "right side down; not with kind = \"velocity\"").or(0.0),
    number("spin_hz", -1000.0, 1000.0, "Hz", "rotation rate about the nose, in turns per second").or(0.0),
    numbers("lever_arm_m", 3, (-1e3, 1e3), "m", "vector from the moving point to the antenna: forward, right, down")
        .or_else("[0, 0, 0]"),
    numbers("boresight", 3, (-1e3, 1e3), "", "direction of the antenna's boresight: forward, right, down")
        .or_else("[0, 0, -1]"),
];
