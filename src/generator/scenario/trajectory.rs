//! Conversion of a motion as written to a trajectory. Files are read, a body is given its attitude, and spans
//! are checked. Pushed motion is in `pushed`.

use std::fs::File;
use std::path::Path;

use super::motion::{FileKind, MotionSpec};
use super::{Overrides, Scenario, ScenarioError};
use crate::vehicle::attitude::Nose;
use crate::vehicle::file::Digits;
use crate::vehicle::{Trajectory, file, route};

impl Scenario {
    /// A motion, with its file read.
    pub(super) fn trajectory_of(
        &self,
        motion: &MotionSpec,
        directory: &Path,
        overrides: &Overrides,
        warnings: &mut Vec<String>,
    ) -> Result<Trajectory, ScenarioError> {
        match motion {
            MotionSpec::Static(place) => Ok(Trajectory::fixed(place.to_ecef())),
            MotionSpec::Waypoints { points, limits } => {
                route::trajectory(points, limits).map_err(|e| self.conflict("motion.point", e.to_string()))
            }
            MotionSpec::Rocket(rocket) => {
                // A second more than the scene, for a receiver's clock that lags.
                let until_s =
                    self.duration_s * (1.0 + self.receiver_clock.drift.abs()) + 1.0 + self.receiver_clock.bias_s.abs();
                rocket.trajectory(until_s).map_err(|e| self.conflict("motion", e.to_string()))
            }
            MotionSpec::Orbit(orbit) => {
                let reach_s = 2.0 + self.receiver_clock.bias_s.abs();
                let until_s = self.duration_s * (1.0 + self.receiver_clock.drift.abs()) + reach_s;
                orbit.trajectory(-reach_s, until_s).map_err(|e| self.conflict("motion", e.to_string()))
            }
            MotionSpec::Pushed { .. } | MotionSpec::Ticks { .. } => self.growing(motion, directory, overrides),
            MotionSpec::File { path, kind, max_gap_s, tolerance_m } => {
                let options = file::Options { start: self.start, max_gap_s: *max_gap_s, tolerance_m: *tolerance_m };
                let full = self.resolve("motion.file", directory, path, overrides)?;
                let input = File::open(&full).map_err(|e| self.unreadable("motion.file", path, e))?;
                let name = path.display().to_string();
                let refuse = |e: file::FileError| match e.fault {
                    file::Fault::Read(error) => self.unreadable("motion.file", path, error),
                    _ => self.conflict("motion.file", e.to_string()),
                };
                match kind {
                    FileKind::Csv => {
                        let found = file::read_csv(input, &name, &options).map_err(refuse)?;
                        if !found.ignored.is_empty() {
                            let ignored = found.ignored.join(", ");
                            warnings.push(format!("{name}: columns not used: {}", ignored.escape_debug()));
                        }
                        warnings.extend(rough(&name, found.digits));
                        Ok(found.trajectory)
                    }
                    FileKind::Nmea => {
                        let found = file::read_nmea(input, &name, &options).map_err(refuse)?;
                        if found.without_fix > 0 {
                            warnings
                                .push(format!("{name}: {} GGA sentences without a fix left out", found.without_fix));
                        }
                        if found.separations_assumed > 0 {
                            warnings.push(format!(
                                "{name}: {} GGA sentences without a geoid separation: heights taken as above mean sea \
                                 level, EGM96's separation added",
                                found.separations_assumed
                            ));
                        }
                        warnings.extend(rough(&name, found.digits));
                        Ok(found.trajectory)
                    }
                }
            }
        }
    }

    /// The motion of a body with the scenario's attitude.
    pub(super) fn turned(&self, trajectory: Trajectory) -> Result<Trajectory, ScenarioError> {
        let Some(attitude) = self.attitude else { return Ok(trajectory) };
        if matches!(attitude.nose, Nose::Velocity { .. }) && trajectory.is_static() {
            let reason = "kind = \"velocity\", but the motion is at rest: use kind = \"fixed\", or let it move";
            return Err(self.conflict("attitude", reason.to_owned()));
        }
        if matches!(attitude.nose, Nose::Pushed { .. }) && trajectory.grown().is_none() {
            let reason = "kind = \"pushed\" needs a motion that is pushed too: [motion] kind = \"pushed\" or \"ticks\"";
            return Err(self.conflict("attitude", reason.to_owned()));
        }
        Ok(trajectory.with_attitude(attitude))
    }

    /// Refuses a motion that does not last from `start_s` to `end_s`.
    pub(super) fn covers(
        &self,
        motion: &MotionSpec,
        trajectory: &Trajectory,
        start_s: f64,
        end_s: f64,
    ) -> Result<(), ScenarioError> {
        let (from_s, to_s) = trajectory.span_s();
        if from_s > start_s || to_s < end_s {
            let kind = motion.kind();
            return Err(self.conflict(
                "motion",
                format!(
                    "kind = {kind:?} is known from {from_s:.3} s to {to_s:.3} s, but the scene needs {start_s:.6} s \
                     to {end_s:.6} s: change duration_s, or let the motion end at rest"
                ),
            ));
        }
        Ok(())
    }
}

/// Accelerations that nobody means, from which a warning is due: a tenth of g.
const ROUGH_MPS2: f64 = 1.0;

/// Warning for positions whose rounding disturbs the motion.
fn rough(name: &str, digits: Option<Digits>) -> Option<String> {
    let Digits { step_m, interval_s, acceleration_mps2 } =
        digits.filter(|digits| digits.acceleration_mps2 > ROUGH_MPS2)?;
    Some(format!(
        "{name}: the last digit of its positions, {step_m:.2e} m every {interval_s:.3} s, makes accelerations of \
         {acceleration_mps2:.1} m/s2 rms: motion.tolerance_m = {:.2e} takes the smoothest motion within it",
        0.5 * step_m
    ))
}
