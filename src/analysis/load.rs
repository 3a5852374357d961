//! Everything that a run wrote, read into memory.
//!
//! Truth and estimate are CSV files of the rows in [`crate::gnss::record`]; the scene and the
//! receiver's settings are JSON. A file that is missing is named together with what would write it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::analysis::JudgeError;
use crate::analysis::jamming::Shape;
use crate::analysis::spectrum::Stage;
use crate::gnss::record::{
    AcquisitionRow, EventRow, Fix, InterferenceRow, LineRow, NavigationRow, Observation, RayRow, SkyRow, TrackingRow,
    TrajectoryRow,
};
use crate::gnss::signal::SIGNALS;

/// What `truth/scene.json` says of the scene; other keys are left alone.
#[derive(Clone, Debug, Deserialize)]
pub struct SceneFacts {
    pub name: String,
    pub seed: u64,
    pub duration_s: f64,
    pub sample_rate_hz: f64,
    #[serde(default)]
    pub center_hz: Option<f64>,
    /// Whether the samples' spectrum is mirrored about `center_hz`.
    #[serde(default)]
    pub inverted: bool,
    /// SigMF name of the sample format.
    #[serde(default)]
    pub format: String,
    #[serde(default)]
    pub code_edge: String,
    #[serde(default)]
    pub mask_deg: Option<f64>,
    /// Whether thermal noise was added.
    #[serde(default = "yes")]
    pub noise: bool,
    #[serde(default)]
    pub fidelity: String,
    /// Azimuth and elevation in degrees below which the direct path is obstructed at the start.
    #[serde(default)]
    pub skyline_deg: Vec<[f64; 2]>,
    /// Shapes of the sources of interference, in the order of their numbers.
    #[serde(default)]
    pub interference: Vec<Shape>,
    /// Standard deviation of the thermal noise per component, in LSB: the gain, also of a scene without noise.
    #[serde(default)]
    pub noise_lsb: Option<f64>,
    /// Stages of the front end, in order.
    #[serde(default)]
    pub front_end: Vec<Stage>,
    /// The receiver's oscillator, if the scene has one.
    #[serde(default)]
    pub oscillator: Option<Oscillator>,
}

/// Noise of an oscillator; other keys are left alone.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Oscillator {
    /// Strengths h₂, h₁, h₀, h₋₁, h₋₂ of S_y = Σ h f^α, in Hz^(−α − 1).
    pub h: [f64; 5],
}

fn yes() -> bool {
    true
}

/// How fast the stages ran: `speed.json`, and the section of the summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Speed {
    pub generate_x_real_time: Option<f64>,
    pub receive_x_real_time: Option<f64>,
    pub run_x_real_time: Option<f64>,
    pub cpu_s: Option<f64>,
    pub peak_memory_mib: Option<f64>,
}

/// One point of `psd.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PsdRow {
    /// Frequency in the samples (0 is `center_hz`).
    pub frequency_hz: f64,
    /// Decibels of LSB²/Hz.
    pub density_db: f64,
}

/// A run as read.
pub struct Run {
    pub scene: SceneFacts,
    /// The whole of `truth/scene.json`.
    pub scene_json: Value,
    /// The scene as it was written, where the run kept it.
    pub scenario: Option<String>,
    pub truth: Vec<Observation>,
    pub sky: Vec<SkyRow>,
    /// Reflected rays; none in a scene without multipath.
    pub rays: Vec<RayRow>,
    pub trajectory: Vec<TrajectoryRow>,
    pub truth_navigation: Vec<NavigationRow>,
    /// Empty without interference.
    pub interference: Vec<InterferenceRow>,
    /// What the first spoofer claims; empty without one.
    pub claimed: Vec<TrajectoryRow>,
    pub observations: Vec<Observation>,
    pub fixes: Vec<Fix>,
    pub acquisition: Vec<AcquisitionRow>,
    pub tracking: Vec<TrackingRow>,
    pub navigation: Vec<NavigationRow>,
    pub events: Vec<EventRow>,
    /// What the receiver told of lines in the spectrum; `None` of one that does not look.
    pub lines: Option<Vec<LineRow>>,
    /// `rx/receiver.json`, or null when there is none.
    pub receiver: Value,
    pub psd: Vec<PsdRow>,
    pub speed: Speed,
}

const TRUTH: &str = "the generator writes it: make the run again with `gnss-twin run`, or `gnss-twin generate`";
const RECEIVER: &str = "the receiver writes it: `gnss-twin receive FILE --out RUN/rx`, or make the run again";

impl Run {
    /// Reads a run's directory. `psd.csv`, `speed.json`, `scenario.toml` and `rx/receiver.json` may be missing.
    pub fn read(run: &Path) -> Result<Self, JudgeError> {
        Self::read_parts(run, &run.join("truth"), &run.join("rx"))
    }

    /// [`Self::read`] where truth and receiver wrote into directories of their own, so that several receivers share a truth.
    pub fn read_parts(run: &Path, truth: &Path, rx: &Path) -> Result<Self, JudgeError> {
        let psd = run.join("psd.csv");
        let rays = truth.join("rays.csv");
        let lines = rx.join("interference.csv");
        Ok(Self {
            scene: json(&truth.join("scene.json"))?
                .map(Self::folded)
                .ok_or_else(|| missing(&truth.join("scene.json"), TRUTH))?,
            scene_json: json(&truth.join("scene.json"))?.unwrap_or(Value::Null),
            scenario: text(&run.join("scenario.toml"))?,
            truth: dated(&truth.join("observations.csv"), TRUTH, |row: &Observation| row.sent_s)?,
            sky: rows(&truth.join("sky.csv"), TRUTH)?,
            rays: optional(&rays)?,
            trajectory: dated(&truth.join("trajectory.csv"), TRUTH, |row: &TrajectoryRow| row.gps_s)?,
            truth_navigation: rows(&truth.join("navigation.csv"), TRUTH)?,
            interference: optional(&truth.join("interference.csv"))?,
            claimed: optional(&truth.join("claimed.csv"))?,
            observations: dated(&rx.join("observations.csv"), RECEIVER, |row: &Observation| row.sent_s)?,
            fixes: dated(&rx.join("fixes.csv"), RECEIVER, |row: &Fix| row.gps_s)?,
            acquisition: rows(&rx.join("acquisition.csv"), RECEIVER)?,
            tracking: rows(&rx.join("tracking.csv"), RECEIVER)?,
            navigation: rows(&rx.join("navigation.csv"), RECEIVER)?,
            events: rows(&rx.join("events.csv"), RECEIVER)?,
            lines: match rows(&lines, RECEIVER) {
                Err(JudgeError::Missing { .. }) => None,
                other => Some(other?),
            },
            receiver: json(&rx.join("receiver.json"))?.unwrap_or(Value::Null),
            psd: optional(&psd)?,
            speed: json(&run.join("speed.json"))?.unwrap_or_default(),
        })
    }

    /// Reads a truth alone, for a receiver that writes files of its own.
    pub fn read_truth(truth: &Path) -> Result<Self, JudgeError> {
        let scene = truth.join("scene.json");
        Ok(Self {
            scene: json(&scene)?.map(Self::folded).ok_or_else(|| missing(&scene, TRUTH))?,
            scene_json: Value::Null,
            scenario: None,
            truth: dated(&truth.join("observations.csv"), TRUTH, |row: &Observation| row.sent_s)?,
            sky: rows(&truth.join("sky.csv"), TRUTH)?,
            rays: Vec::new(),
            trajectory: dated(&truth.join("trajectory.csv"), TRUTH, |row: &TrajectoryRow| row.gps_s)?,
            truth_navigation: Vec::new(),
            interference: optional(&truth.join("interference.csv"))?,
            claimed: Vec::new(),
            observations: Vec::new(),
            fixes: Vec::new(),
            acquisition: Vec::new(),
            tracking: Vec::new(),
            navigation: Vec::new(),
            events: Vec::new(),
            lines: None,
            receiver: Value::Null,
            psd: Vec::new(),
            speed: Speed::default(),
        })
    }

    /// Seconds from sample 0 by the receiver's clock.
    pub fn time_s(&self, sample: u64) -> f64 {
        sample as f64 / self.scene.sample_rate_hz
    }

    /// What [`Self::read`] does to the scene's facts: an IF above half the rate of real samples becomes the one at which they hold it.
    fn folded(mut scene: SceneFacts) -> SceneFacts {
        let (Some(center_hz), Some(signal)) = (scene.center_hz, SIGNALS.first()) else { return scene };
        let sign = |inverted: bool| if inverted { -1.0 } else { 1.0 };
        let if_hz = sign(scene.inverted) * (signal.carrier_hz - center_hz);
        let folded_hz = if_hz - scene.sample_rate_hz * (if_hz / scene.sample_rate_hz).round();
        if scene.format.starts_with('r') && if_hz.abs() > 0.5 * scene.sample_rate_hz {
            scene.inverted ^= folded_hz < 0.0;
            scene.center_hz = Some(signal.carrier_hz - sign(scene.inverted) * folded_hz.abs());
        }
        scene
    }

    /// A number among the receiver's tracking settings, if they name it.
    pub fn tracking_setting(&self, key: &str) -> Option<f64> {
        let settings = self.receiver.get("settings").unwrap_or(&self.receiver);
        settings.get("tracking")?.get(key)?.as_f64()
    }
}

fn missing(path: &Path, remedy: &'static str) -> JudgeError {
    JudgeError::Missing { path: path.to_owned(), remedy }
}

/// All rows of a CSV file; a file without even a header has none.
fn rows<T: DeserializeOwned>(path: &Path, remedy: &'static str) -> Result<Vec<T>, JudgeError> {
    let file = fs::File::open(path).map_err(|source| open_error(path, remedy, source))?;
    csv::Reader::from_reader(io::BufReader::new(file)).deserialize().collect::<Result<_, _>>().map_err(
        |error: csv::Error| {
            let path = path.to_owned();
            if !error.is_io_error() {
                return JudgeError::Row { path, source: error };
            }
            match error.into_kind() {
                csv::ErrorKind::Io(source) => JudgeError::Read { path, source },
                other => JudgeError::Read { path, source: io::Error::other(format!("{other:?}")) },
            }
        },
    )
}

/// Whole GPS seconds that a row may bear: 1980 to 2296, far from where arithmetic on them ends.
const SECONDS: std::ops::RangeInclusive<i64> = 0..=10_000_000_000;

/// All rows of a CSV file whose times are believable.
fn dated<T: DeserializeOwned>(
    path: &Path,
    remedy: &'static str,
    seconds: impl Fn(&T) -> i64,
) -> Result<Vec<T>, JudgeError> {
    let rows: Vec<T> = rows(path, remedy)?;
    match rows.iter().map(seconds).position(|s| !SECONDS.contains(&s)) {
        None => Ok(rows),
        Some(at) => {
            let what = format!("its GPS time is not within {} to {} s", SECONDS.start(), SECONDS.end());
            // The header is line 1.
            Err(JudgeError::Line { path: path.to_owned(), line: at as u64 + 2, what })
        }
    }
}

/// All rows of a CSV file that a run may lack.
fn optional<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, JudgeError> {
    match rows(path, "") {
        Err(JudgeError::Missing { .. }) => Ok(Vec::new()),
        other => other,
    }
}

fn open_error(path: &Path, remedy: &'static str, source: io::Error) -> JudgeError {
    match source.kind() {
        io::ErrorKind::NotFound => missing(path, remedy),
        _ => JudgeError::Read { path: path.to_owned(), source },
    }
}

/// A JSON file, or `None` if there is none.
fn json<T: DeserializeOwned>(path: &PathBuf) -> Result<Option<T>, JudgeError> {
    match fs::read(path) {
        Ok(bytes) => {
            serde_json::from_slice(&bytes).map(Some).map_err(|source| JudgeError::Json { path: path.clone(), source })
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(JudgeError::Read { path: path.clone(), source }),
    }
}

/// A text file, or `None` if there is none.
fn text(path: &Path) -> Result<Option<String>, JudgeError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(String::from_utf8_lossy(&bytes).into_owned())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(JudgeError::Read { path: path.to_owned(), source }),
    }
}
