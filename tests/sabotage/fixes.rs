//! Damage to fixes: places, velocities, clocks, sigmas, what is said of geometry, times and rows.

use gnss::earth::Geodetic;
use nalgebra::Vector3;

use crate::Kind;
use crate::run::{BOUND_M, Rx, Scene};
use crate::table::{Table, normal};

const PLACE: [&str; 3] = ["x_m", "y_m", "z_m"];
const SPEED: [&str; 3] = ["vx_mps", "vy_mps", "vz_mps"];
const FLAT: [&str; 3] =
    ["horizontal error, mean", "horizontal error, 95 %", "horizontal error, largest against its limit"];
const UP: [&str; 3] = ["vertical error, mean", "vertical error, 95 %", "vertical error, largest against its limit"];
const BOUNDED: [&str; 1] = ["position error that the scene bounds, largest"];
const VELOCITY: [&str; 3] =
    ["velocity error, mean", "velocity error, 95 %", "velocity error, largest against its limit"];
const CLOCK: [&str; 3] = ["clock error, mean", "clock error, 95 %", "clock error, largest against its limit"];
const DRIFT: [&str; 3] =
    ["clock drift error, mean", "clock drift error, 95 %", "clock drift error, largest against its limit"];

fn vector(table: &Table, row: usize, columns: [&str; 3]) -> Vector3<f64> {
    Vector3::from(columns.map(|column| table.get(row, column)))
}

/// Adds a vector east, north, up to a place or a velocity.
fn add(rx: &mut Rx, columns: [&str; 3], of: impl Fn(usize, usize) -> Vector3<f64>) {
    let table = rx.table("fixes");
    let count = table.rows.len();
    for row in 0..count {
        let axes = Geodetic::from_ecef(&vector(table, row, PLACE)).ecef_to_enu();
        let moved = vector(table, row, columns) + axes.transpose() * of(row, count);
        columns.iter().zip(moved.iter()).for_each(|(column, value)| table.put(row, column, value));
    }
}

/// Moves all places by metres east, north and up.
pub fn move_by(rx: &mut Rx, enu_m: [f64; 3]) {
    add(rx, PLACE, |_, _| Vector3::from(enu_m));
}

fn scale(rx: &mut Rx, columns: &[&str], factor: f64) {
    columns.iter().for_each(|column| rx.table("fixes").map(column, |_, value| factor * value));
}

/// Makes each fix's values those of a time earlier, between the rows.
fn lag(rx: &mut Rx, columns: [&str; 3], epochs: f64) {
    let table = rx.table("fixes");
    let old: Vec<Vector3<f64>> = (0..table.rows.len()).map(|row| vector(table, row, columns)).collect();
    for row in 0..old.len() {
        let at = (row as f64 - epochs).max(0.0);
        let below = at.floor() as usize;
        let next = old.get(below + 1).unwrap_or(&old[below]);
        let value = old[below] + (next - old[below]) * at.fract();
        columns.iter().zip(value.iter()).for_each(|(column, value)| table.put(row, column, value));
    }
}

/// Turns the horizontal velocity.
fn turn(rx: &mut Rx, degrees: f64) {
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let table = rx.table("fixes");
    for row in 0..table.rows.len() {
        let axes = Geodetic::from_ecef(&vector(table, row, PLACE)).ecef_to_enu();
        let v = axes * vector(table, row, SPEED);
        let turned = axes.transpose() * Vector3::new(v.x * cos - v.y * sin, v.x * sin + v.y * cos, v.z);
        SPEED.iter().zip(turned.iter()).for_each(|(column, value)| table.put(row, column, value));
    }
}

/// Rounds latitude and longitude.
fn round(rx: &mut Rx, step_deg: f64) {
    let table = rx.table("fixes");
    for row in 0..table.rows.len() {
        let here = Geodetic::from_ecef(&vector(table, row, PLACE));
        let step = |x: f64| (x.to_degrees() / step_deg).round() * step_deg;
        let there = Geodetic::from_degrees(step(here.latitude_rad), step(here.longitude_rad), here.height_m).to_ecef();
        PLACE.iter().zip(there.iter()).for_each(|(column, value)| table.put(row, column, value));
    }
}

fn later(rx: &mut Rx, seconds: f64) {
    let table = rx.table("fixes");
    for row in 0..table.rows.len() {
        let fraction = table.get(row, "gps_fraction_s") + seconds;
        table.put(row, "gps_fraction_s", fraction);
    }
}

/// Exchanges two columns by a share: 1 swaps them.
fn mix(rx: &mut Rx, a: &str, b: &str, share: f64) {
    let table = rx.table("fixes");
    for row in 0..table.rows.len() {
        let (x, y) = (table.get(row, a), table.get(row, b));
        table.put(row, a, x + share * (y - x));
        table.put(row, b, y + share * (x - y));
    }
}

fn every(rows: f64) -> impl Fn(&Table, usize) -> bool {
    move |_, row| rows > 0.0 && row % (rows as usize) == 0
}

macro_rules! kind {
    ($name:expr, $unit:expr, $tolerable:expr, $broken:expr, $rows:expr, $scene:ident, $apply:expr) => {
        Kind {
            name: $name,
            unit: $unit,
            tolerable: $tolerable,
            broken: $broken,
            rows: $rows,
            scene: Scene::$scene,
            apply: $apply,
        }
    };
}
pub(crate) use kind;

pub fn kinds() -> Vec<Kind> {
    [places(), velocities(), clocks(), stated(), rows()].into_iter().flatten().collect()
}

fn places() -> Vec<Kind> {
    vec![
        kind!("all fixes moved east", "m", Some(0.2), 1.0, &FLAT, AtRest, |rx, m| add(rx, PLACE, |_, _| Vector3::x()
            * m)),
        kind!("all fixes moved south", "m", Some(0.2), 1.0, &FLAT, AtRest, |rx, m| add(rx, PLACE, |_, _| Vector3::y()
            * -m)),
        kind!("all fixes moved up", "m", Some(0.3), 2.0, &UP, AtRest, |rx, m| add(rx, PLACE, |_, _| Vector3::z() * m)),
        kind!("all fixes moved east, in motion", "m", Some(0.2), 1.0, &FLAT, InMotion, |rx, m| add(
            rx,
            PLACE,
            |_, _| Vector3::x() * m
        )),
        kind!("fixes that drift away north", "m at the end", Some(0.2), 2.0, &FLAT, AtRest, |rx, m| {
            add(rx, PLACE, |row, count| Vector3::y() * (m * row as f64 / count as f64));
        }),
        kind!("fixes that climb", "m at the end", Some(0.3), 3.0, &UP, AtRest, |rx, m| {
            add(rx, PLACE, |row, count| Vector3::z() * (m * row as f64 / count as f64));
        }),
        kind!(
            "one fix off where errors may have any size up to a bound",
            "m",
            Some(15.0),
            1.1 * BOUND_M,
            &BOUNDED,
            Bounded,
            |rx, m| {
                add(rx, PLACE, |row, _| if row == 100 { Vector3::y() * m } else { Vector3::zeros() });
            }
        ),
        kind!("4 % of the fixes far off", "m", Some(0.3), 2.0, &FLAT, AtRest, |rx, m| {
            add(rx, PLACE, |row, _| if row % 25 == 7 { Vector3::x() * m } else { Vector3::zeros() });
        }),
        kind!("one fix off", "m", Some(0.3), 2.0, &FLAT, AtRest, |rx, m| {
            add(rx, PLACE, |row, _| if row == 100 { Vector3::y() * m } else { Vector3::zeros() });
        }),
        kind!("one fix too high", "m", Some(0.4), 3.0, &UP, AtRest, |rx, m| {
            add(rx, PLACE, |row, _| if row == 100 { Vector3::z() * m } else { Vector3::zeros() });
        }),
        kind!("scattered fixes", "m, 1σ", Some(0.05), 0.5, &FLAT, AtRest, |rx, m| {
            add(rx, PLACE, |row, _| Vector3::new(normal(row, 1), normal(row, 2), 0.0) * m);
        }),
        kind!("scattered heights", "m, 1σ", Some(0.08), 1.0, &UP, AtRest, |rx, m| {
            add(rx, PLACE, |row, _| Vector3::z() * (m * normal(row, 3)));
        }),
        kind!("latitude and longitude rounded", "°", Some(1e-6), 7e-5, &FLAT, AtRest, round),
        kind!(
            "height above the geoid, undulation taken by this share",
            "of −53 m",
            Some(0.005),
            0.05,
            &UP,
            AtRest,
            |rx, share| {
                add(rx, PLACE, |_, _| Vector3::z() * (-53.0 * share));
            }
        ),
        kind!("positions of another epoch", "epochs", Some(0.05), 1.0, &FLAT, InMotion, |rx, epochs| lag(
            rx, PLACE, epochs
        )),
        kind!("Earth's rotation left out by this share", "of 33 m", Some(0.005), 0.05, &FLAT, AtRest, |rx, share| {
            add(rx, PLACE, |_, _| Vector3::x() * (33.0 * share));
        }),
        kind!("positions scaled from the Earth's centre", "", Some(3e-8), 4e-7, &UP, AtRest, |rx, part| scale(
            rx,
            &PLACE,
            1.0 + part
        )),
    ]
}

fn velocities() -> Vec<Kind> {
    vec![
        kind!("velocity off to the east", "m/s", Some(0.005), 0.05, &VELOCITY, AtRest, |rx, v| add(
            rx,
            SPEED,
            |_, _| Vector3::x() * v
        )),
        kind!("velocity off upwards", "m/s", Some(0.005), 0.1, &VELOCITY, AtRest, |rx, v| add(rx, SPEED, |_, _| {
            Vector3::z() * v
        })),
        kind!("4 % of the velocities off", "m/s", Some(0.03), 0.5, &VELOCITY, AtRest, |rx, v| {
            add(rx, SPEED, |row, _| if row % 25 == 7 { Vector3::y() * v } else { Vector3::zeros() });
        }),
        kind!("noisy velocities", "m/s, 1σ", Some(0.005), 0.1, &VELOCITY, AtRest, |rx, v| {
            add(rx, SPEED, |row, _| Vector3::new(normal(row, 4), normal(row, 5), normal(row, 6)) * v);
        }),
        kind!("velocity turned", "°", Some(0.05), 2.0, &VELOCITY, InMotion, turn),
        kind!("north and east of the velocity swapped", "", None, 1.0, &VELOCITY, InMotion, |rx, _| turn(rx, 90.0)),
        kind!("velocity scaled", "", Some(1e-3), 0.05, &VELOCITY, InMotion, |rx, part| scale(rx, &SPEED, 1.0 + part)),
        kind!("velocity with its sign turned", "", None, 1.0, &VELOCITY, InMotion, |rx, _| scale(rx, &SPEED, -1.0)),
        kind!("velocity of another epoch", "epochs", Some(0.02), 5.0, &VELOCITY, InMotion, |rx, epochs| lag(
            rx, SPEED, epochs
        )),
        kind!(
            "velocity in axes that do not rotate, by this share",
            "of 415 m/s",
            Some(1e-5),
            5e-4,
            &VELOCITY,
            AtRest,
            |rx, share| {
                add(rx, SPEED, |_, _| Vector3::x() * (415.0 * share));
            }
        ),
    ]
}

fn clocks() -> Vec<Kind> {
    vec![
        kind!("time of fixes late", "ns", Some(0.5), 10.0, &CLOCK, AtRest, |rx, ns| {
            later(rx, 1e-9 * ns);
            rx.table("fixes").map("clock_bias_s", |_, bias| bias - 1e-9 * ns);
        }),
        kind!(
            "clock bias against the time of fixes",
            "ns",
            Some(1e-5),
            1.0,
            &["clock bias of fixes against their time, largest"],
            AtRest,
            |rx, ns| {
                rx.table("fixes").map("clock_bias_s", |_, bias| bias + 1e-9 * ns);
            }
        ),
        kind!(
            "clock bias with its sign turned",
            "",
            None,
            1.0,
            &["clock bias of fixes against their time, largest"],
            AtRest,
            |rx, _| {
                rx.table("fixes").map("clock_bias_s", |_, bias| -bias);
            }
        ),
        kind!("time of one fix off", "ns", Some(0.7), 20.0, &CLOCK, AtRest, |rx, ns| {
            let table = rx.table("fixes");
            let (fraction, bias) = (table.get(50, "gps_fraction_s"), table.get(50, "clock_bias_s"));
            table.put(50, "gps_fraction_s", fraction + 1e-9 * ns);
            table.put(50, "clock_bias_s", bias - 1e-9 * ns);
        }),
        kind!("clock drift off", "s/s", Some(1e-11), 2e-10, &DRIFT, AtRest, |rx, part| {
            rx.table("fixes").map("clock_drift", |_, drift| drift + part);
        }),
        kind!("clock drift with its sign turned", "", None, 1.0, &DRIFT, AtRest, |rx, _| scale(
            rx,
            &["clock_drift"],
            -1.0
        )),
        kind!("noisy clock drift", "s/s, 1σ", Some(2e-11), 5e-10, &DRIFT, AtRest, |rx, part| {
            rx.table("fixes").map("clock_drift", |row, drift| drift + part * normal(row, 9));
        }),
        kind!("weeks too many in the time of fixes", "weeks", None, 1.0, &CLOCK, AtRest, |rx, weeks| {
            let table = rx.table("fixes");
            (0..table.rows.len()).for_each(|row| {
                let seconds: i64 = table.text(row, "gps_s").parse().unwrap();
                table.put(row, "gps_s", seconds + 604_800 * weeks as i64);
            });
        }),
        kind!("leap seconds in the time of fixes", "s", None, 15.0, &CLOCK, AtRest, |rx, seconds| {
            later(rx, -seconds);
        }),
    ]
}

fn stated() -> Vec<Kind> {
    const HORIZONTAL: [&str; 2] =
        ["horizontal sigma over the expected one, largest", "horizontal sigma over the expected one, smallest"];
    const EAST: [&str; 2] = ["east sigma over the expected one, largest", "east sigma over the expected one, smallest"];
    const VERTICAL: [&str; 2] =
        ["vertical sigma over the expected one, largest", "vertical sigma over the expected one, smallest"];
    const OF_CLOCK: [&str; 2] =
        ["clock sigma over the expected one, largest", "clock sigma over the expected one, smallest"];
    const GEOMETRY: [&str; 2] = [
        "dilutions and condition against the true geometry, largest difference",
        "dilutions against one another, largest difference",
    ];
    const ALL: [&str; 4] = ["sigma_east_m", "sigma_north_m", "sigma_up_m", "sigma_clock_m"];
    const CORRELATIONS: [&str; 1] = ["formal correlations (artanh) against the expected ones, 95 %"];
    vec![
        kind!("all sigmas larger", "times", Some(1.1), 1.6, &HORIZONTAL, AtRest, |rx, factor| scale(rx, &ALL, factor)),
        kind!("all sigmas smaller", "times", Some(0.9), 0.5, &HORIZONTAL, AtRest, |rx, factor| scale(rx, &ALL, factor)),
        kind!(
            "sigmas of a moving receiver three times too large",
            "times",
            Some(1.1),
            3.0,
            &HORIZONTAL,
            InMotion,
            |rx, factor| scale(rx, &ALL, factor)
        ),
        kind!("sigma east alone larger", "times", Some(1.1), 1.6, &EAST, AtRest, |rx, factor| scale(
            rx,
            &ALL[..1],
            factor
        )),
        kind!("sigma up alone larger", "times", Some(1.1), 1.6, &VERTICAL, AtRest, |rx, factor| scale(
            rx,
            &ALL[2..3],
            factor
        )),
        kind!("sigma up alone smaller", "times", Some(0.9), 0.6, &VERTICAL, AtRest, |rx, factor| scale(
            rx,
            &ALL[2..3],
            factor
        )),
        kind!("sigma of the clock larger", "times", Some(1.1), 1.6, &OF_CLOCK, AtRest, |rx, factor| scale(
            rx,
            &ALL[3..],
            factor
        )),
        kind!("sigma of the clock smaller", "times", Some(0.9), 0.6, &OF_CLOCK, AtRest, |rx, factor| scale(
            rx,
            &ALL[3..],
            factor
        )),
        kind!("sigmas of a tenth of the fixes larger", "times", Some(1.1), 1.6, &HORIZONTAL, AtRest, |rx, factor| {
            ALL.iter().for_each(|column| rx.table("fixes").map_where(column, every(10.0), |_, sigma| factor * sigma));
        }),
        kind!("sigmas east and up exchanged by this share", "", Some(0.05), 1.0, &VERTICAL, AtRest, |rx, share| mix(
            rx,
            "sigma_east_m",
            "sigma_up_m",
            share
        )),
        kind!("correlation of east and north off", "", Some(0.04), 0.3, &CORRELATIONS, AtRest, |rx, by| {
            rx.table("fixes").map("correlation_en", |_, value| value + by);
        }),
        kind!("all dilutions larger", "times", Some(1.0005), 1.02, &GEOMETRY, AtRest, |rx, factor| {
            scale(rx, &["gdop", "pdop", "hdop", "vdop", "tdop"], factor);
        }),
        kind!(
            "horizontal and vertical dilutions exchanged by this share",
            "",
            Some(1e-11),
            1.0,
            &GEOMETRY,
            AtRest,
            |rx, share| mix(rx, "hdop", "vdop", share)
        ),
        kind!("condition of the geometry larger", "times", Some(1.0005), 1.1, &GEOMETRY, AtRest, |rx, factor| scale(
            rx,
            &["condition"],
            factor
        )),
        kind!(
            "chi-square larger",
            "times",
            Some(3.0),
            40.0,
            &["chi-square of a fix over its threshold, largest"],
            AtRest,
            |rx, factor| scale(rx, &["chi_square"], factor)
        ),
        kind!(
            "fewer satellites in fixes than there are",
            "satellites",
            None,
            1.0,
            &["fixes of other satellites than those observed"],
            AtRest,
            |rx, by| {
                rx.table("fixes").map_where("satellites", |_, row| row < 20, |_, count| count - by);
            }
        ),
        kind!(
            "good satellites said to be excluded",
            "% of the fixes",
            None,
            20.0,
            &["share of fixes that exclude a good satellite"],
            AtRest,
            |rx, percent| {
                let table = rx.table("fixes");
                let most = (0.01 * percent * table.rows.len() as f64) as usize;
                (0..most).for_each(|row| {
                    table.put(row, "excluded", "G03");
                    let satellites = table.get(row, "satellites") - 1.0;
                    // What a fix without one satellite states is not known here: only those without a test of
                    // it.
                    table.put(row, "satellites", satellites);
                });
            }
        ),
        kind!(
            "fixes that say the ionosphere is not corrected",
            "fixes",
            None,
            30.0,
            &["fixes whose word on the ionosphere is impossible"],
            AtRest,
            |rx, count| {
                let table = rx.table("fixes");
                (0..count as usize).for_each(|row| table.put(row, "ionosphere", "nominal"));
            }
        ),
    ]
}

fn rows() -> Vec<Kind> {
    vec![
        kind!("fixes doubled", "rows", None, 1.0, &["rows doubled"], AtRest, |rx, count| {
            let table = rx.table("fixes");
            (0..count as usize).for_each(|k| table.rows.insert(10 + k, table.rows[10 + k].clone()));
        }),
        kind!("fixes out of order", "pairs", None, 1.0, &["rows out of time order"], AtRest, |rx, _| rx
            .table("fixes")
            .rows
            .swap(10, 11)),
        kind!("fixes frozen", "epochs", None, 3.0, &["rows that repeat the values before"], AtRest, |rx, count| {
            let table = rx.table("fixes");
            for row in 50..50 + count as usize {
                let sample = table.text(row, "sample").to_owned();
                table.rows[row] = table.rows[49].clone();
                table.put(row, "sample", sample);
            }
        }),
        kind!("positions frozen, all else alive", "epochs", None, 60.0, &FLAT, InMotion, |rx, count| {
            let table = rx.table("fixes");
            for row in 150..150 + count as usize {
                PLACE.iter().for_each(|column| {
                    let old = table.text(150, column).to_owned();
                    table.put(row, column, old);
                });
            }
        }),
        kind!("samples of fixes off by one", "samples", None, 1.0, &["fixes without a truth"], AtRest, |rx, by| {
            let table = rx.table("fixes");
            (5..10).for_each(|row| {
                let sample = table.get(row, "sample") + by;
                table.put(row, "sample", sample as u64);
            });
        }),
        kind!(
            "fixes labelled with an earlier sample",
            "epochs",
            None,
            1.0,
            &["fixes without a truth", "clock error, mean", "horizontal error, largest against its limit"],
            InMotion,
            |rx, epochs| {
                let step = epochs * 0.1 * rx.rate_hz();
                rx.table("fixes").map("sample", |_, sample| sample - step);
            }
        ),
    ]
}
