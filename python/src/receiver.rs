//! The receiver, fed with arrays.

use std::sync::Mutex;

use gnss::samples::{Format, IfMetadata};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use receiver::Reception;

use crate::arrays;
use crate::call::long;
use crate::failure::Failure;
use crate::generator::busy;
use crate::scene::{Metadata, Scene, read_settings};
use crate::tables::Received;

/// Bytes between two looks at signals.
const STEP_BYTES: usize = 1 << 20;

/// Outcome of a reception.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Outcome {
    #[pyo3(get)]
    tables: Py<PyAny>,
    #[pyo3(get)]
    summary: Py<PyAny>,
    text: String,
}

#[pymethods]
impl Outcome {
    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        format!("<Outcome: {}>", self.text)
    }
}

/// A cold start on samples that come in pieces.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Receiver {
    formats: Vec<Format>,
    /// Gone at the end.
    reception: Mutex<(Option<Reception>, Received)>,
}

/// The settings and what the samples are: of a scene, of one front end or of several.
fn described(of: &Bound<'_, PyAny>, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Reception> {
    let (metadata, settings): (Vec<IfMetadata>, _) = if let Ok(scene) = of.cast::<Scene>() {
        let scene = scene.get();
        (scene.scenes.iter().map(|scene| scene.metadata.clone()).collect(), scene.settings(settings)?)
    } else {
        let all = if let Ok(one) = of.extract::<Metadata>() { vec![one] } else { several(of)? };
        let settings = settings.map(read_settings).transpose()?.unwrap_or_default();
        (all.into_iter().map(|metadata| metadata.0).collect(), settings)
    };
    Ok(Reception::of_several(&metadata, &settings).map_err(Failure::from)?)
}

fn several(of: &Bound<'_, PyAny>) -> PyResult<Vec<Metadata>> {
    of.extract().map_err(|_| PyTypeError::new_err("expected a Scene, Metadata or a list of Metadata"))
}

fn formats(of: &Bound<'_, PyAny>) -> PyResult<Vec<Format>> {
    let format = |metadata: &Metadata| metadata.0.format;
    if let Ok(scene) = of.cast::<Scene>() {
        return Ok(scene.get().scenes.iter().map(|scene| scene.metadata.format).collect());
    }
    match of.extract::<Metadata>() {
        Ok(one) => Ok(vec![format(&one)]),
        Err(_) => Ok(several(of)?.iter().map(format).collect()),
    }
}

#[pymethods]
impl Receiver {
    #[new]
    #[pyo3(signature = (of, settings = None))]
    fn new(of: &Bound<'_, PyAny>, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let (reception, formats) = (described(of, settings)?, formats(of)?);
        Ok(Self { formats, reception: Mutex::new((Some(reception), Received::default())) })
    }

    /// Takes the next samples, cut anywhere, and returns the tables of what they brought.
    #[pyo3(signature = (samples, *, front_end = 0))]
    fn push<'py>(
        &self,
        py: Python<'py>,
        samples: &Bound<'py, PyAny>,
        front_end: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let format = self.formats.get(front_end).copied();
        let format = format.ok_or_else(|| PyIndexError::new_err(format!("front_end = {front_end}: there is none")))?;
        let array = arrays::bytes(samples, format)?;
        let bytes = array.as_slice()?;
        let (reception, received) = &mut *self.reception.try_lock().map_err(busy("receiver"))?;
        let Some(reception) = reception else { return Err(over()) };
        long(py, |halt| {
            for piece in bytes.chunks(STEP_BYTES) {
                halt.check()?;
                reception.take_of(front_end, piece, received)?;
            }
            Ok(())
        })?;
        received.drain(py)
    }

    /// Ends the reception.
    fn finish(&self, py: Python<'_>) -> PyResult<Outcome> {
        let (reception, received) = &mut *self.reception.try_lock().map_err(busy("receiver"))?;
        let Some(reception) = reception.take() else { return Err(over()) };
        let text = long(py, |_| Ok(reception.finish(received)?.to_string()))?;
        Outcome::of(py, received, text)
    }
}

fn over() -> PyErr {
    PyRuntimeError::new_err("the reception is over")
}

impl Outcome {
    /// Outcome of the records that were received.
    pub fn of(py: Python<'_>, received: &mut Received, text: String) -> PyResult<Self> {
        let summary = received.drain_summary(py)?.unbind();
        Ok(Self { tables: received.drain(py)?.into_any().unbind(), summary, text })
    }
}

/// Receives an array from its first sample to its last.
#[pyfunction]
#[pyo3(signature = (samples, of, settings = None))]
pub fn receive<'py>(
    samples: &Bound<'py, PyAny>,
    of: &Bound<'py, PyAny>,
    settings: Option<&Bound<'py, PyAny>>,
) -> PyResult<Outcome> {
    let (mut reception, formats) = (described(of, settings)?, formats(of)?);
    let &[format] = &*formats else {
        return Err(PyTypeError::new_err("receive takes the samples of one front end: use a Receiver for several"));
    };
    let array = arrays::bytes(samples, format)?;
    let bytes = array.as_slice()?;
    let mut received = Received::default();
    let text = long(samples.py(), |halt| {
        for piece in bytes.chunks(STEP_BYTES) {
            halt.check()?;
            reception.take(piece, &mut received)?;
        }
        Ok(reception.finish(&mut received)?.to_string())
    })?;
    Outcome::of(samples.py(), &mut received, text)
}
