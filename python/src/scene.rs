//! Scenes, and what a data sheet says of samples.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use generator::GenerateError;
use generator::plan::Plan;
use generator::scenario::{Overrides, Scenario};
use generator::scene::{self, Grade};
use generator::stream::{Options, Stream};
use gnss::samples::{Format, IfMetadata};
use gnss::sigmf;
use gnss::signal::Signal;
use gnss::time::{Epoch, Rate};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use receiver::settings::Settings;
use twin::{settings_for, settle};

use crate::arrays;
use crate::call::long;
use crate::failure::Failure;
use crate::text::{Source, source, table};

/// Samples that are made between two looks at signals.
const STEP_SAMPLES: u64 = 1 << 19;

/// Metadata of a front end's samples.
#[pyclass(frozen, from_py_object, module = "gnss_twin")]
#[derive(Clone)]
pub struct Metadata(pub IfMetadata);

#[pymethods]
impl Metadata {
    #[new]
    #[pyo3(signature = (format, sample_rate_hz, *, center_hz = 1_575.42e6, inverted = false, start = None))]
    fn new(format: &str, sample_rate_hz: f64, center_hz: f64, inverted: bool, start: Option<&str>) -> PyResult<Self> {
        let wrong = |text: String| PyValueError::new_err(text);
        let format: Format = format.parse().map_err(|error| wrong(format!("format: {error}")))?;
        let rate = Rate::from_hz(sample_rate_hz)
            .ok_or_else(|| wrong(format!("sample_rate_hz = {sample_rate_hz}: expected above 0 and below 1e12")))?;
        if !center_hz.is_finite() || center_hz < 0.0 {
            return Err(wrong(format!("center_hz = {center_hz}: expected a radio frequency, 0 or more")));
        }
        let start = start.map(Epoch::parse).transpose().map_err(|error| wrong(format!("start: {error}")))?;
        Ok(Self(IfMetadata { format, rate, center_hz, inverted, start }))
    }

    /// Reads a `.sigmf-meta` file.
    #[staticmethod]
    fn open(path: PathBuf) -> PyResult<Self> {
        let text = std::fs::read_to_string(&path).map_err(|error| Failure::file(&path, &error))?;
        Ok(Self(sigmf::parse(&text, &path.display().to_string()).map_err(Failure::from)?))
    }

    /// The JSON text of a `.sigmf-meta` file.
    fn to_sigmf(&self) -> String {
        sigmf::write(&self.0)
    }

    #[getter]
    fn format(&self) -> &'static str {
        self.0.format.name()
    }

    #[getter]
    fn sample_rate_hz(&self) -> f64 {
        self.0.rate.hz()
    }

    #[getter]
    fn center_hz(&self) -> f64 {
        self.0.center_hz
    }

    #[getter]
    fn inverted(&self) -> bool {
        self.0.inverted
    }

    #[getter]
    fn start(&self) -> Option<String> {
        self.0.start.map(|start| start.to_string())
    }

    #[getter]
    fn sample_bytes(&self) -> usize {
        self.0.format.bytes()
    }

    fn __repr__(&self) -> String {
        let IfMetadata { format, rate, center_hz, inverted, .. } = &self.0;
        let mirrored = if *inverted { ", inverted=True" } else { "" };
        format!("Metadata({:?}, {}, center_hz={center_hz}{mirrored})", format.name(), rate.hz())
    }
}

/// A scene: a scenario, composed.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Scene {
    scenario: Scenario,
    directory: PathBuf,
    overrides: Overrides,
    /// One a front end.
    pub scenes: Arc<Vec<scene::Scene>>,
    settings: Settings,
    warnings: Vec<String>,
}

impl Scene {
    fn compose(
        scenario: Scenario,
        settings: Settings,
        directory: PathBuf,
        overrides: Overrides,
    ) -> Result<Self, Failure> {
        let (scenes, warnings) = scenario.compose_all(&directory, &overrides)?;
        Ok(Self { scenario, directory, overrides, scenes: Arc::new(scenes), settings, warnings })
    }

    /// Composes it again: a scene whose motion is pushed is driven once.
    pub fn fresh(&self) -> Result<Arc<Vec<scene::Scene>>, Failure> {
        Ok(Arc::new(self.scenario.compose_all(&self.directory, &self.overrides)?.0))
    }

    /// Front ends at the level that keeps their budget without samples; `None` where there is none.
    pub fn settled(&self) -> Result<Option<Vec<scene::Scene>>, Failure> {
        if !self.scenes.iter().any(|scene| matches!(scene.fidelity.grade, Grade::Budget(_))) {
            return Ok(None);
        }
        let (mut scenes, _) = self.scenario.compose_all(&self.directory, &self.overrides)?;
        Ok(settle(&mut scenes)?.then_some(scenes))
    }

    /// The settings that are asked for, or else the scene's own, with the scene's signals.
    pub fn settings(&self, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Settings> {
        let given = settings.map(read_settings).transpose()?;
        Ok(settings_for(&self.scenes, given.as_ref().unwrap_or(&self.settings)))
    }

    /// Only front end of the scene.
    pub fn only(&self) -> PyResult<&scene::Scene> {
        match &**self.scenes {
            [only] => Ok(only),
            several => {
                let names = self.scenario.front_end_names().join(", ");
                let text = format!("the scene has {} front ends: choose one by front_end: {names}", several.len());
                Err(PyValueError::new_err(text))
            }
        }
    }
}

/// Settings from a text, a file or a dictionary.
pub fn read_settings(object: &Bound<'_, PyAny>) -> PyResult<Settings> {
    let read = match source(object, "settings")? {
        Source::Text(text) => Settings::parse(&text, "settings"),
        Source::Table(table) => Settings::from_table(table, "settings"),
        Source::File(path) => {
            let text = std::fs::read_to_string(&path).map_err(|error| Failure::file(&path, &error))?;
            Settings::parse(&text, &path.display().to_string())
        }
    };
    Ok(read.map_err(Failure::from)?)
}

fn overrides(seed: Option<u64>, format: Option<&str>, allow_outside: bool) -> PyResult<Overrides> {
    let format = format.map(str::parse::<Format>).transpose();
    let format = format.map_err(|error| PyValueError::new_err(format!("format: {error}")))?;
    Ok(Overrides { seed, format, allow_outside })
}

/// The scenario of one of its stations with one of its front ends, where they are named.
fn chosen(scenario: Scenario, station: Option<&str>, front_end: Option<&str>) -> Result<Scenario, Failure> {
    let scenario = match station {
        Some(name) => scenario.with_station(name)?,
        None => scenario,
    };
    Ok(match front_end {
        Some(name) => scenario.with_front_end(name)?,
        None => scenario,
    })
}

#[pymethods]
impl Scene {
    /// Reads a file; files that it names are relative to its directory.
    #[staticmethod]
    #[pyo3(signature = (path, *, seed = None, format = None, station = None, front_end = None,
        allow_outside = false))]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        seed: Option<u64>,
        format: Option<&str>,
        station: Option<&str>,
        front_end: Option<&str>,
        allow_outside: bool,
    ) -> PyResult<Self> {
        let overrides = overrides(seed, format, allow_outside)?;
        long(py, |_| {
            let scenario = chosen(Scenario::open(&path)?, station, front_end)?;
            let text = std::fs::read_to_string(&path).map_err(|error| Failure::file(&path, &error))?;
            let settings = Settings::of_scenario(&text, &path.display().to_string())?;
            let directory = path.parent().unwrap_or(Path::new(".")).to_owned();
            Self::compose(scenario, settings, directory, overrides)
        })
    }

    /// Reads a text; files that it names are relative to `directory`.
    #[staticmethod]
    #[pyo3(signature = (text, *, directory = None, seed = None, format = None, station = None,
        front_end = None, allow_outside = false))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword of Python")]
    fn from_toml(
        py: Python<'_>,
        text: &str,
        directory: Option<PathBuf>,
        seed: Option<u64>,
        format: Option<&str>,
        station: Option<&str>,
        front_end: Option<&str>,
        allow_outside: bool,
    ) -> PyResult<Self> {
        let overrides = overrides(seed, format, allow_outside)?;
        let directory = directory.unwrap_or_else(|| PathBuf::from("."));
        long(py, |_| {
            let scenario =
                chosen(Scenario::parse_in(text, "scenario", &directory, allow_outside)?, station, front_end)?;
            Self::compose(scenario, Settings::of_scenario(text, "scenario")?, directory, overrides)
        })
    }

    /// Reads a dictionary with the keys of a scenario.
    #[staticmethod]
    #[pyo3(signature = (keys, *, directory = None, seed = None, format = None, station = None,
        front_end = None, allow_outside = false))]
    fn from_dict(
        keys: &Bound<'_, PyDict>,
        directory: Option<PathBuf>,
        seed: Option<u64>,
        format: Option<&str>,
        station: Option<&str>,
        front_end: Option<&str>,
        allow_outside: bool,
    ) -> PyResult<Self> {
        let overrides = overrides(seed, format, allow_outside)?;
        let directory = directory.unwrap_or_else(|| PathBuf::from("."));
        let mut table = table(keys, "")?;
        let receiver = table.remove("receiver");
        let text = toml::to_string(&table).map_err(|error| PyValueError::new_err(error.to_string()))?;
        long(keys.py(), |_| {
            let settings = match receiver {
                None => Settings::default(),
                Some(toml::Value::Table(receiver)) => Settings::from_table(receiver, "receiver")?,
                Some(_) => return Err(Failure::other("receiver: expected a dict")),
            };
            let scenario = Scenario::parse_in(&text, "scenario", &directory, allow_outside)
                .map_err(|error| Failure::of_table(&error))?;
            Self::compose(chosen(scenario, station, front_end)?, settings, directory, overrides)
        })
    }

    #[getter]
    fn name(&self) -> String {
        self.scenario.name.clone()
    }

    #[getter]
    fn duration_s(&self) -> f64 {
        self.scenario.duration_s
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.scenes.first().map_or(0, |scene| scene.seed)
    }

    /// Names of the signals that its satellites send.
    #[getter]
    fn signals(&self) -> Vec<&'static str> {
        let mut names: Vec<&'static str> = Vec::new();
        for signal in self.scenes.iter().flat_map(|scene| scene.signals.iter().map(|signal: &&Signal| signal.name)) {
            if !names.contains(&signal) {
                names.push(signal);
            }
        }
        names
    }

    /// Number of samples of its first front end.
    #[getter]
    fn samples(&self) -> u64 {
        self.scenes.first().map_or(0, |scene| scene.samples)
    }

    /// Metadata of its only front end.
    #[getter]
    fn metadata(&self) -> PyResult<Metadata> {
        self.only().map(|scene| Metadata(scene.metadata.clone()))
    }

    /// Metadata of each of its front ends.
    #[getter]
    fn front_ends(&self) -> Vec<Metadata> {
        self.scenes.iter().map(|scene| Metadata(scene.metadata.clone())).collect()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Samples `first` to before `end` of its only front end: the same bits as in the whole.
    #[pyo3(signature = (first = 0, end = None))]
    fn slice<'py>(&self, py: Python<'py>, first: u64, end: Option<u64>) -> PyResult<Bound<'py, PyAny>> {
        let scene = self.only()?;
        let end = end.unwrap_or(scene.samples);
        if first > end || end > scene.samples {
            let text = format!("samples {first} to {end}: the scene has {}", scene.samples);
            return Err(PyIndexError::new_err(text));
        }
        let bytes = long(py, |halt| {
            let mut stream = Stream::of(scene, first..end, &mut (), &Options::default())?;
            let (mut all, mut packed) = (Vec::new(), Vec::new());
            let short = end - first <= STEP_SAMPLES;
            if !short {
                all.reserve_exact((end - first) as usize * scene.metadata.format.bytes());
            }
            let mut to = first;
            while to < end {
                halt.check()?;
                to = (to + STEP_SAMPLES).min(end);
                stream.advance(to, &mut (), &mut packed)?;
                if short {
                    return Ok(packed);
                }
                all.extend_from_slice(&packed);
            }
            Ok(all)
        })?;
        arrays::array(py, scene.metadata.format, bytes)
    }

    /// Plan in words: computations, omissions and their reasons.
    fn plan(&self, py: Python<'_>) -> PyResult<String> {
        long(py, |_| {
            let texts: Result<Vec<String>, GenerateError> =
                self.scenes.iter().map(|scene| Ok(Plan::of(scene)?.to_string())).collect();
            Ok(texts?.join("\n"))
        })
    }

    fn __repr__(&self) -> String {
        format!("<Scene {:?}: {} s, {}>", self.scenario.name, self.scenario.duration_s, self.signals().join(", "))
    }
}
