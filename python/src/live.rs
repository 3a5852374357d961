//! Lock step with a simulation: a state in, samples, truth and what the receiver makes of them out.

use std::sync::{Arc, Mutex};

use generator::event::Event;
use generator::scene::Scene as Composed;
use generator::truth::Sink as _;
use generator::vehicle::joining::Push;
use generator::vehicle::turn::PushedTurn;
use live::lockstep::{Finished, Lockstep};
use nalgebra::Vector3;
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use receiver::output::Sink as _;
use self_cell::self_cell;

use crate::arrays;
use crate::failure::Failure;
use crate::generator::busy;
use crate::receiver::Outcome;
use crate::scene::{Metadata, Scene};
use crate::tables::{Received, Truth};

/// Gone at the end.
type Stepping<'a> = Option<Lockstep<'a>>;

self_cell!(
    struct Running {
        owner: Arc<Vec<Composed>>,
        #[not_covariant]
        dependent: Stepping,
    }
);

/// Result of a step.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Step {
    #[pyo3(get)]
    first_sample: u64,
    #[pyo3(get)]
    samples: Py<PyAny>,
    #[pyo3(get)]
    truth: Py<PyAny>,
    #[pyo3(get)]
    receiver: Py<PyAny>,
    #[pyo3(get)]
    position_m: [f64; 3],
    #[pyo3(get)]
    velocity_mps: [f64; 3],
    #[pyo3(get)]
    made_of: &'static str,
    #[pyo3(get)]
    gap_m: f64,
}

/// A scene whose motion is pushed, step by step.
#[pyclass(frozen, module = "gnss_twin")]
pub struct Live {
    #[pyo3(get)]
    metadata: Metadata,
    #[pyo3(get)]
    start_position_m: [f64; 3],
    running: Mutex<Running>,
}

fn over() -> PyErr {
    PyRuntimeError::new_err("the run is finished")
}

impl Live {
    /// Does something with what is running, without Python's lock.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Lockstep<'_>) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        let running = &mut *self.running.try_lock().map_err(busy("run"))?;
        let done = py.detach(|| running.with_dependent_mut(|_, stepping| stepping.as_mut().map(work)));
        Ok(done.ok_or_else(over)??)
    }
}

#[pymethods]
impl Live {
    #[new]
    #[pyo3(signature = (scene, settings = None, *, receive = true))]
    fn new(scene: &Scene, settings: Option<&Bound<'_, PyAny>>, receive: bool) -> PyResult<Self> {
        if !receive && settings.is_some() {
            return Err(PyTypeError::new_err("settings without a receiver: expected receive=True"));
        }
        let metadata = Metadata(scene.only()?.metadata.clone());
        let settings = if receive { Some(scene.settings(settings)?) } else { None };
        let mut start_position_m = [0.0; 3];
        let running = Running::try_new(scene.fresh()?, |scenes| {
            let scene = scenes.first().ok_or_else(|| Failure::bug("a scene without a front end"))?;
            start_position_m = scene.trajectory.composed_for().position_m.into();
            Ok::<_, Failure>(Some(Lockstep::new(scene, settings.as_ref())?))
        })?;
        Ok(Self { metadata, start_position_m, running: Mutex::new(running) })
    }

    /// Time of the state that the next step takes: its end, in seconds since the scene's start.
    #[getter]
    fn next_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |twin| Ok(twin.next_s()))
    }

    /// True if the last sample was made.
    #[getter]
    fn is_done(&self, py: Python<'_>) -> PyResult<bool> {
        self.with(py, |twin| Ok(twin.is_done()))
    }

    /// Switches something from the next step on, and returns its first sample.
    fn switch(&self, py: Python<'_>, event: &str) -> PyResult<u64> {
        self.with(py, |twin| Ok(twin.switch(&event.parse::<Event>()?)?))
    }

    /// Makes the next step.
    #[pyo3(signature = (position_m = None, velocity_mps = None, acceleration_mps2 = None, *, jerk_mps3 = None,
        angles_rad = None, rates_radps = None, t_s = None))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword of Python")]
    fn step(
        &self,
        py: Python<'_>,
        position_m: Option<[f64; 3]>,
        velocity_mps: Option<[f64; 3]>,
        acceleration_mps2: Option<[f64; 3]>,
        jerk_mps3: Option<[f64; 3]>,
        angles_rad: Option<[f64; 3]>,
        rates_radps: Option<[f64; 3]>,
        t_s: Option<f64>,
    ) -> PyResult<Step> {
        let rest = [velocity_mps, acceleration_mps2, jerk_mps3, angles_rad, rates_radps];
        if position_m.is_none() && (t_s.is_some() || rest.iter().any(Option::is_some)) {
            return Err(PyTypeError::new_err("a state without position_m"));
        }
        if angles_rad.is_none() && rates_radps.is_some() {
            return Err(PyTypeError::new_err("rates_radps without angles_rad"));
        }
        let vector = |value: Option<[f64; 3]>| value.map(Vector3::from);
        let push = |next_s: f64| {
            position_m.map(|position_m| Push {
                velocity_mps: vector(velocity_mps),
                acceleration_mps2: vector(acceleration_mps2),
                jerk_mps3: vector(jerk_mps3),
                turn: angles_rad.map(|angles_rad| PushedTurn { angles_rad, rates_radps }),
                ..Push::at(t_s.unwrap_or(next_s), position_m.into())
            })
        };
        let (step, bytes) = self.with(py, |twin| {
            let push = push(twin.next_s());
            Ok((twin.step(push.as_ref())?, twin.samples().to_vec()))
        })?;
        let (mut truth, mut received) = (Truth::default(), Received::default());
        step.truth.into_iter().try_for_each(|record| truth.take(record)).map_err(Failure::from)?;
        step.received.into_iter().try_for_each(|record| received.take(record)).map_err(Failure::from)?;
        // A scene that is stepped is one whose motion is pushed: its steps are all ticks of such a motion.
        let tick = step.made.tick.ok_or_else(|| Failure::bug("a step without motion"))?;
        Ok(Step {
            first_sample: step.made.samples.0,
            samples: arrays::array(py, self.metadata.0.format, bytes)?.unbind(),
            truth: truth.drain(py)?.into_any().unbind(),
            receiver: received.drain(py)?.into_any().unbind(),
            position_m: tick.end.position_m.into(),
            velocity_mps: tick.end.velocity_mps.into(),
            made_of: tick.kind.name(),
            gap_m: tick.gap_m,
        })
    }

    /// Ends the run: what the receiver found last, and the truth that is known at the end alone.
    fn finish(&self, py: Python<'_>) -> PyResult<(Outcome, Py<PyAny>)> {
        let running = &mut *self.running.try_lock().map_err(busy("run"))?;
        let mut truth = Truth::default();
        let finished =
            py.detach(|| running.with_dependent_mut(|_, stepping| stepping.take().map(|twin| twin.finish(&mut truth))));
        let Finished { generated, received: rest, outcome } = finished.ok_or_else(over)?.map_err(Failure::from)?;
        let mut received = Received::default();
        rest.into_iter().try_for_each(|record| received.take(record)).map_err(Failure::from)?;
        let text = outcome.map_or_else(|| generated.to_string(), |outcome| outcome.to_string());
        Ok((Outcome::of(py, &mut received, text)?, truth.drain(py)?.into_any().unbind()))
    }
}
