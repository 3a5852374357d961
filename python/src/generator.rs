//! The generator as an iterator of batches.

use std::sync::{Arc, Mutex};

use generator::scene::Scene as Composed;
use generator::stream::{Options, Stream};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use self_cell::self_cell;

use crate::arrays;
use crate::call::long;
use crate::failure::Failure;
use crate::scene::{Metadata, Scene};
use crate::tables::Truth;

/// Gone once the last sample was made.
type Making<'a> = Option<Stream<'a>>;

self_cell!(
    struct Running {
        owner: Arc<Vec<Composed>>,
        #[not_covariant]
        dependent: Making,
    }
);

/// Error of an object that is busy in another thread.
pub fn busy<T>(what: &str) -> impl FnOnce(T) -> PyErr {
    move |_| PyRuntimeError::new_err(format!("the {what} is at work in another thread"))
}

/// Some samples of a scene, and what is true of them.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Batch {
    #[pyo3(get)]
    first_sample: u64,
    #[pyo3(get)]
    samples: Py<PyAny>,
    #[pyo3(get)]
    truth: Py<PyAny>,
}

/// Iterates a scene's samples.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Generator {
    metadata: Metadata,
    running: Mutex<Running>,
    step: u64,
}

#[pymethods]
impl Generator {
    #[new]
    #[pyo3(signature = (scene, *, batch_samples = 524_288))]
    fn new(scene: &Scene, batch_samples: u64) -> PyResult<Self> {
        if batch_samples == 0 {
            return Err(PyValueError::new_err("batch_samples = 0: expected 1 or more"));
        }
        let metadata = Metadata(scene.only()?.metadata.clone());
        let running = Running::try_new(Arc::clone(&scene.scenes), |scenes| {
            let scene = scenes.first().ok_or_else(|| Failure::bug("a scene without a front end"))?;
            Ok::<_, Failure>(Some(Stream::new(scene, &mut (), &Options::default())?))
        })?;
        Ok(Self { metadata, running: Mutex::new(running), step: batch_samples })
    }

    #[getter]
    fn metadata(&self) -> Metadata {
        self.metadata.clone()
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Batch>> {
        let running = &mut *self.running.try_lock().map_err(busy("generator"))?;
        let made = long(py, |_| {
            running.with_dependent_mut(|scenes, making| {
                let samples = scenes.first().map_or(0, |scene| scene.samples);
                let Some(mut stream) = making.take() else { return Ok(None) };
                let (mut truth, mut packed) = (Truth::default(), Vec::new());
                let first = stream.samples();
                let end = first.saturating_add(self.step).min(samples);
                let more = stream.advance(end, &mut truth, &mut packed)?;
                if end < samples {
                    *making = Some(stream);
                } else {
                    stream.finish(&mut truth)?;
                }
                Ok(more.then_some((first, packed, truth)))
            })
        })?;
        let Some((first_sample, packed, mut truth)) = made else { return Ok(None) };
        let samples = arrays::array(py, self.metadata.0.format, packed)?.unbind();
        Ok(Some(Batch { first_sample, samples, truth: truth.drain(py)?.into_any().unbind() }))
    }
}
