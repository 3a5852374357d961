//! Motion that is pushed while the scene is sent, and its replay.
//!
//! Both are composed for the state with which the motion begins and know no more of it; a replay is given the
//! ticks of its log afterwards, through the same door as a live run. So nothing in the scene can differ.
//! Limits: one front end; no receiver's clock that feels the acceleration.

use std::fs::File;
use std::path::Path;

use super::files::Files;
use super::motion::MotionSpec;
use super::{Overrides, Scenario, ScenarioError};
use crate::event;
use crate::scene::Scene;
use crate::synth::RUN_SAMPLES;
use crate::vehicle::grown::Joining;
use crate::vehicle::{Knot, Motion, Trajectory, file, log};
use gnss::time::Rate;

/// Knots of a live run that are kept: four seconds at 1000 ticks a second.
const KEPT: usize = 4096;

impl Scenario {
    /// The motion's first state, from which it grows.
    pub(super) fn growing(
        &self,
        motion: &MotionSpec,
        directory: &Path,
        overrides: &Overrides,
    ) -> Result<Trajectory, ScenarioError> {
        match motion {
            MotionSpec::Pushed { place, tick_s, join_s, hold_s, max_jerk_mps3 } => {
                let joining = Joining {
                    tick_samples: self.tick_samples(*tick_s)?,
                    join_s: *join_s,
                    hold_s: *hold_s,
                    max_jerk_mps3: *max_jerk_mps3,
                };
                Ok(Trajectory::growing(Motion::at_rest(place.to_ecef()), joining, KEPT))
            }
            MotionSpec::Ticks { path, tick_s, .. } => {
                let tick_samples = self.tick_samples(*tick_s)?;
                let joining = Joining { tick_samples, join_s: 0.0, hold_s: 0.0, max_jerk_mps3: 0.0 };
                let first = self.states(path, tick_samples, 1, (directory, overrides))?;
                let (first, _) =
                    first.first().copied().ok_or_else(|| self.conflict("motion.file", "no state".to_owned()))?;
                Ok(Trajectory::growing(first, joining, usize::MAX))
            }
            other => Err(self.conflict("motion.kind", format!("{:?} does not grow", other.kind()))),
        }
    }

    /// Samples of a tick of the one front end.
    fn tick_samples(&self, tick_s: f64) -> Result<u64, ScenarioError> {
        let [front_end] = self.front_ends.as_slice() else {
            let reason = "pushed motion drives one front end: expected one, or choose one with --front-end";
            return Err(self.conflict("front_end", reason.to_owned()));
        };
        let rate: Rate = front_end.rate;
        let samples = (tick_s * rate.hz()).round();
        if samples < RUN_SAMPLES as f64 {
            return Err(self.conflict(
                "motion.tick_s",
                format!(
                    "{tick_s} s are {samples} samples at {} Hz: expected {RUN_SAMPLES} samples at least, {:.6} s",
                    rate.hz(),
                    RUN_SAMPLES as f64 / rate.hz()
                ),
            ));
        }
        Ok(samples as u64)
    }

    /// The first states of a log, at most `limit`.
    fn states(
        &self,
        path: &Path,
        tick_samples: u64,
        limit: usize,
        (directory, overrides): (&Path, &Overrides),
    ) -> Result<Vec<log::State>, ScenarioError> {
        let files = Files { directory, overrides };
        let turned = self.attitude.is_some_and(|attitude| attitude.first_turn().is_some());
        self.table("motion.file", path, &files, |input, name| log::read(input, name, (tick_samples, turned), limit))
    }

    /// A file of a record, as `read` reads it.
    fn table<T>(
        &self,
        key: &'static str,
        path: &Path,
        files: &Files<'_>,
        read: impl FnOnce(File, &str) -> Result<T, file::FileError>,
    ) -> Result<T, ScenarioError> {
        let full = self.resolve(key, files.directory, path, files.overrides)?;
        let input = File::open(&full).map_err(|e| self.unreadable(key, path, e))?;
        read(input, &path.display().to_string()).map_err(|e| match e.fault {
            file::Fault::Read(error) => self.unreadable(key, path, error),
            _ => self.conflict(key, e.to_string()),
        })
    }

    /// Begins the ticks of a growing motion `start_s` true seconds after the scene's start.
    pub(super) fn begin_ticks(&self, trajectory: &Trajectory, start_s: f64) -> Result<(), ScenarioError> {
        if trajectory.grown().is_some() && self.receiver_clock.per_g != 0.0 {
            let reason = "a clock that feels acceleration needs a motion that is known before: not with kind = \
                          \"pushed\" or \"ticks\"";
            return Err(self.conflict("receiver_clock.sensitivity_per_g", reason.to_owned()));
        }
        trajectory.begin(start_s);
        Ok(())
    }

    /// Gives a replay the ticks of its log.
    pub(super) fn replay(&self, scene: &Scene, files: &Files<'_>) -> Result<(), ScenarioError> {
        let (MotionSpec::Ticks { path, events, .. }, Some(tick_samples)) =
            (&self.motion, scene.trajectory.tick_samples())
        else {
            return Ok(());
        };
        // The last row of a record that was cut off may be half of one: those beyond the scene are not read.
        let most = usize::try_from(scene.samples.div_ceil(tick_samples)).unwrap_or(log::MAX_ROWS).saturating_add(1);
        let states = self.states(path, tick_samples, most, (files.directory, files.overrides))?;
        let known = tick_samples.saturating_mul(states.len() as u64 - 1);
        if known < scene.samples {
            let reason = format!(
                "{}: known up to sample {known}, but the scene has {}: expected duration_s = {:?} at most",
                path.display(),
                scene.samples,
                scene.clock.rate.elapsed_s(known)
            );
            return Err(self.conflict("motion.file", reason));
        }
        for (tick, (motion, turn)) in (1..).zip(states.into_iter().skip(1)) {
            scene.trajectory.append(Knot { t_s: scene.elapsed_s(tick * tick_samples), motion }, turn);
        }
        let Some(path) = events else { return Ok(()) };
        for (sample, event) in self.table("motion.events", path, files, event::read)? {
            if sample % tick_samples != 0 {
                let reason =
                    format!("{event} at sample {sample}: expected a multiple of {tick_samples}, the first of a tick");
                return Err(self.conflict("motion.events", reason));
            }
            event.apply(scene, sample / tick_samples).map_err(|e| self.conflict("motion.events", e.to_string()))?;
        }
        Ok(())
    }
}
