//! State of a run as its page shows it: rows come in, a frame goes out.
//!
//! Rows are those of the tables and JSON lines that exist, by their names there. What they say is data of
//! others: texts and counts of names are bounded. Limits: errors are those of the newest fixes, against a
//! straight line between two true positions.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};

use analysis::statistics::percentile;
use gnss::earth::Geodetic;

/// Satellites and channels at most.
const MOST_NAMES: usize = 512;
/// Letters of a name at most.
const MOST_LETTERS: usize = 40;
/// True positions that are kept, to compare fixes that come later.
const MOST_TRUE: usize = 6000;
/// Errors that are kept.
const MOST_ERRORS: usize = 6000;
/// Events that are shown.
const MOST_EVENTS: usize = 20;
/// Ratio of the 95 % horizontal error to the standard deviation of one coordinate, of a normal distribution.
const HORIZONTAL_95: f64 = 2.45;
/// Ratio of the 95 % vertical error to its standard deviation.
const VERTICAL_95: f64 = 1.96;

/// Table of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// `truth/trajectory.csv`
    Trajectory,
    /// `truth/sky.csv`
    Sky,
    /// `truth/observations.csv`
    Observations,
    /// `rx/fixes.csv`, or a line of record `fix`.
    Fixes,
    /// `rx/tracking.csv`, or a line of record `channel`.
    Channels,
    /// An element of a line of record `satellites`.
    Sights,
}

/// Position and time of a row.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// GPS time since the first row, seconds.
    t_s: f64,
    position_m: Vector3<f64>,
}

/// Origin of the map.
#[derive(Clone, Copy, Debug)]
struct Origin {
    gps_s: f64,
    place: Geodetic,
    position_m: Vector3<f64>,
    axes: Matrix3<f64>,
}

/// Errors of the fixes against the truth.
#[derive(Clone, Debug, Default)]
struct Errors {
    horizontal_m: VecDeque<f64>,
    vertical_m: VecDeque<f64>,
    /// Variances as the receiver reports them: the mean of both horizontal coordinates, and the height's.
    reported_m2: VecDeque<[f64; 2]>,
}

/// Everything that the page shows of a run.
#[derive(Clone, Debug, Default)]
pub struct State {
    origin: Option<Origin>,
    sky: BTreeMap<String, [f64; 2]>,
    /// Sky of the tick that is not whole yet.
    sky_next: BTreeMap<String, [f64; 2]>,
    cn0: BTreeMap<String, f64>,
    cn0_next: BTreeMap<String, f64>,
    channels: BTreeMap<String, Value>,
    truth: VecDeque<Place>,
    newest_s: f64,
    fixes: u64,
    last_fix: Value,
    errors: Errors,
    events: VecDeque<String>,
    /// Last status line of the run.
    pub status: Value,
    /// State of the receiver's connection in words; empty without one.
    pub receiver: String,
    /// Scene time in seconds.
    pub t_s: f64,
    /// Density of the samples in dB per bin, from the lowest frequency, and these ends in Hz.
    pub spectrum: Option<([f64; 2], Vec<f64>)>,
}

fn number(row: &Value, key: &str) -> Option<f64> {
    row.get(key)?.as_f64().filter(|value| value.is_finite())
}

/// Name in a row, bounded.
fn name(row: &Value, keys: &[&str]) -> String {
    let words = keys.iter().filter_map(|key| row.get(*key)?.as_str());
    words.collect::<Vec<_>>().join(" ").chars().take(MOST_LETTERS).collect()
}

/// Puts a value under a name unless there are too many names.
fn put<T>(map: &mut BTreeMap<String, T>, name: String, value: T) {
    if map.len() < MOST_NAMES || map.contains_key(&name) {
        map.insert(name, value);
    }
}

/// Adds a value and removes the oldest of too many.
fn keep<T>(all: &mut VecDeque<T>, value: T, most: usize) {
    if all.len() >= most {
        all.pop_front();
    }
    all.push_back(value);
}

impl State {
    /// Takes a row; one without the numbers of its table changes nothing.
    pub fn take(&mut self, table: Table, row: &Value) {
        match table {
            Table::Trajectory => self.trajectory(row),
            Table::Sky | Table::Sights => {
                if let (Some(azimuth), Some(elevation)) = (number(row, "azimuth_deg"), number(row, "elevation_deg")) {
                    let map = if table == Table::Sky { &mut self.sky_next } else { &mut self.sky };
                    put(map, name(row, &["sv"]), [azimuth, elevation]);
                }
            }
            Table::Observations => {
                if let Some(cn0) = number(row, "cn0_dbhz") {
                    put(&mut self.cn0_next, name(row, &["sv", "signal"]), cn0);
                }
            }
            Table::Channels => {
                let keys = [
                    "cn0_dbhz",
                    "prompt_i",
                    "prompt_q",
                    "dll_discriminator_chips",
                    "pll_discriminator_cycles",
                    "fll_discriminator_hz",
                    "phase_lock",
                    "early_i",
                    "early_q",
                    "late_i",
                    "late_q",
                    "tap_spacing_chips",
                ];
                let values: Vec<Value> = keys.iter().map(|key| json!(number(row, key))).collect();
                put(&mut self.channels, name(row, &["sv", "signal"]), json!(values));
            }
            Table::Fixes => self.fix(row),
        }
    }

    /// Adds an event that was applied, or why one was not.
    pub fn event(&mut self, text: String) {
        keep(&mut self.events, text, MOST_EVENTS);
    }

    /// Removes the satellites of a receiver's sky before those of the next fix.
    pub fn clear_sights(&mut self) {
        if self.truth.is_empty() {
            self.sky.clear();
        }
    }

    /// Time of the newest fix or true position since the first one, seconds.
    pub fn newest_s(&self) -> f64 {
        self.newest_s
    }

    /// GPS time and ECEF position of a row; the first one sets the origin.
    fn place(&mut self, row: &Value) -> Option<Place> {
        let at = ["x_m", "y_m", "z_m"].map(|key| number(row, key));
        let [Some(x), Some(y), Some(z)] = at else { return None };
        let position_m = Vector3::new(x, y, z);
        let whole_s = number(row, "gps_s")?;
        let origin = self.origin.get_or_insert_with(|| {
            let place = Geodetic::from_ecef(&position_m);
            Origin { gps_s: whole_s, place, position_m, axes: place.ecef_to_enu() }
        });
        let t_s = whole_s - origin.gps_s + number(row, "gps_fraction_s")?;
        self.newest_s = self.newest_s.max(t_s);
        Some(Place { t_s, position_m })
    }

    fn trajectory(&mut self, row: &Value) {
        // The rows before were of the tick before, which is whole now.
        self.sky = std::mem::take(&mut self.sky_next);
        self.cn0 = std::mem::take(&mut self.cn0_next);
        if let Some(place) = self.place(row) {
            keep(&mut self.truth, place, MOST_TRUE);
        }
    }

    fn fix(&mut self, row: &Value) {
        let Some(place) = self.place(row) else { return };
        self.fixes += 1;
        self.last_fix = json!({
            "place": self.enu(&place.position_m),
            "satellites": number(row, "satellites"),
            "hdop": number(row, "hdop"),
        });
        let sigmas = ["sigma_east_m", "sigma_north_m", "sigma_up_m"].map(|key| number(row, key));
        let ([Some(east), Some(north), Some(up)], Some(truth_m), Some(origin)) =
            (sigmas, self.truth_at(place.t_s), self.origin)
        else {
            return;
        };
        let error = origin.axes * (place.position_m - truth_m);
        keep(&mut self.errors.horizontal_m, error.xy().norm(), MOST_ERRORS);
        keep(&mut self.errors.vertical_m, error.z.abs(), MOST_ERRORS);
        keep(&mut self.errors.reported_m2, [0.5 * (east * east + north * north), up * up], MOST_ERRORS);
    }

    /// True position at a time between or near two true ones.
    fn truth_at(&self, t_s: f64) -> Option<Vector3<f64>> {
        let after = self.truth.partition_point(|place| place.t_s < t_s).clamp(1, self.truth.len().max(2) - 1);
        let (a, b) = (self.truth.get(after - 1)?, self.truth.get(after)?);
        let share = (t_s - a.t_s) / (b.t_s - a.t_s);
        let near = (-1.0..=2.0).contains(&share);
        near.then(|| a.position_m + (b.position_m - a.position_m) * share)
    }

    /// East, north and up from the origin, metres, to the millimetre.
    fn enu(&self, position_m: &Vector3<f64>) -> Option<[f64; 3]> {
        let origin = self.origin?;
        let enu = origin.axes * (position_m - origin.position_m);
        Some([enu.x, enu.y, enu.z].map(|value| (value * 1e3).round() / 1e3))
    }

    /// Errors and their limits so far.
    fn verdict(&self) -> Value {
        let errors = &self.errors;
        let count = errors.reported_m2.len();
        let [flat, up] = errors.reported_m2.iter().fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
        let p95 = |values: &VecDeque<f64>| percentile(&Vec::from_iter(values.iter().copied()), 0.95);
        let limit = |ratio: f64, sum: f64| (count > 0).then(|| ratio * (sum / count as f64).sqrt());
        json!({
            "fixes": self.fixes,
            "compared": count,
            "horizontal_p95_m": p95(&errors.horizontal_m),
            "horizontal_limit_m": limit(HORIZONTAL_95, flat),
            "vertical_p95_m": p95(&errors.vertical_m),
            "vertical_limit_m": limit(VERTICAL_95, up),
        })
    }

    /// A frame of the page, with what its server says of itself.
    pub fn frame(&self, page: &Value) -> Value {
        let here = self.origin.map(|origin| {
            let place = origin.place;
            json!([place.latitude_rad.to_degrees(), place.longitude_rad.to_degrees(), place.height_m])
        });
        json!({
            "t_s": self.t_s,
            "origin": here,
            "sky": self.sky,
            "cn0": self.cn0,
            "channels": self.channels,
            "truth": self.truth.back().and_then(|place| self.enu(&place.position_m)),
            "fix": self.last_fix,
            "verdict": self.verdict(),
            "spectrum": self.spectrum,
            "status": self.status,
            "events": self.events,
            "receiver": self.receiver,
            "page": page,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(t_s: f64, east_m: f64) -> Value {
        // East of the meridian of Greenwich is y on the equator.
        json!({
            "gps_s": 1_000_000_000 + t_s.floor() as i64, "gps_fraction_s": t_s.fract(),
            "x_m": 6_378_137.0, "y_m": east_m, "z_m": 0.0,
            "sigma_east_m": 1.0, "sigma_north_m": 1.0, "sigma_up_m": 2.0,
        })
    }

    #[test]
    fn a_fix_is_compared_with_the_truth_at_its_time() {
        let mut state = State::default();
        (0..30).for_each(|k| state.take(Table::Trajectory, &place(0.1 * f64::from(k), f64::from(k))));
        state.take(Table::Fixes, &place(1.25, 12.5 + 3.0));
        // Beyond the truth nothing is compared.
        state.take(Table::Fixes, &place(9.0, 0.0));
        let frame = state.frame(&Value::Null);
        let verdict = &frame["verdict"];
        assert_eq!((&verdict["fixes"], &verdict["compared"]), (&json!(2), &json!(1)));
        // Times are differences of numbers near 1e9 s whose fractions are exact to 1e-16 s: at 10 m/s, 1e-14
        // m.
        assert!((verdict["horizontal_p95_m"].as_f64().unwrap() - 3.0).abs() < 1e-6, "{verdict}");
        assert!((verdict["horizontal_limit_m"].as_f64().unwrap() - 2.45).abs() < 1e-12, "{verdict}");
        assert!((verdict["vertical_limit_m"].as_f64().unwrap() - 3.92).abs() < 1e-12, "{verdict}");
        assert_eq!(frame["truth"], json!([29.0, 0.0, 0.0]));
    }

    #[test]
    fn a_satellite_that_sets_leaves_the_sky() {
        let mut state = State::default();
        let sky = |sv: &str| json!({ "sv": sv, "azimuth_deg": 10.0, "elevation_deg": 20.0 });
        state.take(Table::Trajectory, &place(0.0, 0.0));
        state.take(Table::Sky, &sky("G01"));
        state.take(Table::Sky, &sky("G02"));
        state.take(Table::Trajectory, &place(0.1, 0.0));
        assert_eq!(state.sky.len(), 2);
        state.take(Table::Sky, &sky("G01"));
        state.take(Table::Trajectory, &place(0.2, 0.0));
        assert_eq!(state.sky.keys().collect::<Vec<_>>(), ["G01"]);
    }

    #[test]
    fn rows_of_others_are_bounded_and_may_be_nonsense() {
        let mut state = State::default();
        for k in 0..10_000 {
            state.take(Table::Channels, &json!({ "sv": format!("{k}{}", "x".repeat(1000)), "cn0_dbhz": "high" }));
            state.take(Table::Fixes, &json!({ "x_m": k }));
            state.event("e".to_owned());
        }
        assert_eq!((state.channels.len(), state.fixes, state.events.len()), (MOST_NAMES, 0, MOST_EVENTS));
        assert!(state.channels.keys().all(|name| name.chars().count() == MOST_LETTERS));
        state.take(Table::Fixes, &json!([1, 2]));
        assert!(state.frame(&Value::Null)["verdict"]["horizontal_p95_m"].is_null());
    }
}
