//! Generator and receiver in one loop, judged where the files are kept.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use analysis::judge_against;
use analysis::show::staged::Staged;
use generator::scene::Scene as Composed;
use generator::truth::{self, Writer};
use gnss::samples::IfMetadata;
use pyo3::prelude::*;
use receiver::Reception;
use receiver::output::{self, Output};
use receiver::settings::Settings;
use serde_json::Value;
use twin::{Done, Halting, feed, modelled};

use crate::call::{Halt, long};
use crate::failure::Failure;
use crate::scene::Scene;
use crate::tables::{Received, Truth, object};

/// Outcome of a run.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Run {
    #[pyo3(get)]
    truth: Py<PyAny>,
    #[pyo3(get)]
    receiver: Py<PyAny>,
    #[pyo3(get)]
    summary: Py<PyAny>,
    #[pyo3(get)]
    judgement: Option<Py<PyAny>>,
    text: String,
}

#[pymethods]
impl Run {
    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        format!("<Run: {}>", self.text)
    }
}

/// Generates and receives; a line of each side on what was done.
fn closed_loop(
    scenes: &[Composed],
    settings: &Settings,
    truth: &mut (dyn truth::Sink + Send),
    records: &mut (dyn output::Sink + Send),
    halt: &Halt,
) -> Result<String, Failure> {
    let mut stoppable = Halting { records, halt: &|| halt.is_set() };
    let modelled = modelled(scenes, settings, (truth, &mut stoppable), &mut |_| ());
    halt.check()?;
    if let Some(Done { generated, outcome }) = modelled? {
        let duration_s = scenes.first().map_or(0.0, |scene| scene.metadata.rate.elapsed_s(scene.samples));
        let made: Vec<String> = generated.iter().map(|one| one.modelled(duration_s)).collect();
        return Ok(format!("{}\n{outcome}", made.join("\n")));
    }
    let metadata: Vec<IfMetadata> = scenes.iter().map(|scene| scene.metadata.clone()).collect();
    let mut reception = Reception::of_several(&metadata, settings)?;
    let fed = feed(scenes, truth, &mut |number, samples| {
        halt.check()?;
        reception.take_of(number, samples, records).map_err(Failure::from)
    })?;
    let outcome = reception.finish(records)?;
    let made: Vec<String> = fed.generated.iter().map(ToString::to_string).collect();
    Ok(format!("{}\n{outcome}", made.join("\n")))
}

/// Directory in which a run's files grow, hidden beside the final one.
struct Files {
    making: Staged,
    truth: Writer,
    output: Output,
}

impl Files {
    fn create(target: &Path) -> Result<Self, Failure> {
        if target.exists() {
            let there = io::Error::new(io::ErrorKind::AlreadyExists, "expected a new directory");
            return Err(Failure::file(target, &there));
        }
        let name = target.file_name().ok_or_else(|| Failure::other(format!("{}: no name", target.display())))?;
        let hidden = target.with_file_name(format!(".{}.part", name.to_string_lossy()));
        let failed = |error: io::Error| Failure::file(target, &error);
        let making = Staged::directory(hidden).map_err(failed)?;
        let (truth, rx) = (making.path().join("truth"), making.path().join("rx"));
        fs::create_dir(&truth).and_then(|()| fs::create_dir(&rx)).map_err(failed)?;
        Ok(Self { truth: Writer::create(&truth)?, output: Output::create(&rx)?, making })
    }
}

/// Runs a scene; with `out`, its files are written there and judged.
#[pyfunction]
#[pyo3(signature = (scene, settings = None, *, out = None))]
pub fn run(py: Python<'_>, scene: &Scene, settings: Option<&Bound<'_, PyAny>>, out: Option<PathBuf>) -> PyResult<Run> {
    let settings = scene.settings(settings)?;
    let (mut truth, mut received) = (Truth::default(), Received::default());
    let (text, judgement) = long(py, |halt| {
        let settled = scene.settled()?;
        let scenes = settled.as_deref().unwrap_or(&scene.scenes);
        let Some(target) = &out else {
            return Ok((closed_loop(scenes, &settings, &mut truth, &mut received, halt)?, None));
        };
        let Files { making, truth: mut rows, mut output } = Files::create(target)?;
        let (truths, records) = (&mut (&mut truth, &mut rows), &mut (&mut received, &mut output));
        let text = closed_loop(scenes, &settings, truths, records, halt)?;
        drop((rows, output));
        let judgement = judged(making.path())?;
        making.finish(target).map_err(|error| Failure::file(target, &error))?;
        Ok((text, Some(judgement)))
    })?;
    Ok(Run {
        truth: truth.drain(py)?.into_any().unbind(),
        summary: received.drain_summary(py)?.unbind(),
        receiver: received.drain(py)?.into_any().unbind(),
        judgement: judgement.map(|judgement| object(py, &judgement)).transpose()?.map(Bound::unbind),
        text,
    })
}

fn judged(directory: &Path) -> Result<Value, Failure> {
    let summary = judge_against(directory, None)?;
    serde_json::to_value(&summary).map_err(|error| Failure::bug(&error.to_string()))
}

/// Judges the files of a run, writes tables, pictures and a report beside them, and returns the summary.
#[pyfunction]
pub fn judge(py: Python<'_>, directory: PathBuf) -> PyResult<Py<PyAny>> {
    let summary = long(py, |_| judged(&directory))?;
    Ok(object(py, &summary)?.unbind())
}
