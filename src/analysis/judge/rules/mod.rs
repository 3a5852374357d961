//! The limits that need no user, one file a subject.
//!
//! Every figure is compared with one limit whose origin is stated: a threshold of theory, the receiver's own
//! covariance, or a user's file ([`super::limits`]). A figure within a tenth of its limit is marginal. A
//! figure that a scene cannot have is named with the reason why it is not judged. Limits: the thresholds are
//! rules of thumb, not the points at which a receiver fails; several figures of one run share their causes.

mod attitude;
mod availability;
mod cases;
mod detection;
mod dispersion;
mod excused;
mod foreign;
mod hints;
mod inertial;
mod interference;
mod kind;
mod links;
mod losses;
mod motion;
mod osnma;
mod own_fixes;
mod position;
mod protection;
mod reception;
mod scales;
mod spectrum;
mod tables;
#[cfg(test)]
mod tests;
mod tracking;
mod values;
mod within;

use crate::error::JudgeError;
use crate::expect::due::Expectations;
use crate::expect::due::receiver::Receiver;
use crate::judge::judgement::Group;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::measure::errors::Errors;
use crate::measure::slips::Slips;
use crate::read::Run;
use availability::Came;

/// Level of fidelity at which a model answers for correlators.
pub(crate) const CORRELATIONS: &str = "correlations";
/// Level of fidelity at which theory stands for searches and loops.
pub(crate) const OBSERVATIONS: &str = "observations";

impl Verdict {
    /// A run against the limits that need no user: those of theory and of the receiver's own covariance.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &Run, errors: &Errors, slips: &Slips, summary: &Summary) -> Result<Self, JudgeError> {
        let mut verdict = Self::default();
        let expected = Expectations::of(run, Receiver::of(run), run)?;
        verdict.about(Group::Availability).satellites(run, &expected)?;
        verdict.availability(run.scene.duration_s, &run.scene.expect, &expected, &Came::of(run)?);
        let receiver = expected.receiver.clone();
        // They have a row an epoch.
        drop(expected);
        verdict.own_fixes(run, &receiver)?;
        verdict.about(Group::Position).values(run, errors, summary)?;
        let places = errors.positions.map(|error| (error.time_s, error.enu_m.norm()))?;
        verdict.within(&run.scene.expect, places.into_iter());
        verdict.about(Group::Protection).protection(summary);
        verdict.about(Group::Tracking).tracking(run, summary);
        verdict.links(run, errors, summary)?;
        verdict.excused(run, errors)?;
        verdict.losses(run, &receiver, slips)?;
        verdict.about(Group::Messages).reception(summary);
        verdict.osnma(summary);
        verdict.about(Group::Tracking).cn0(run, summary);
        verdict.about(Group::Samples).spectrum(run)?;
        verdict.about(Group::Interference).interference(summary);
        verdict.spoofing(run, summary)?;
        verdict.detection(summary);
        verdict.about(Group::Attitude).attitude(run, summary);
        verdict.about(Group::Inertial).inertial(run, summary);
        verdict.about(Group::Tables).tables(run, errors)?;
        if run.scene.fidelity == OBSERVATIONS {
            let rows = "spectrum of the samples, prompts and discriminators of the loops, rows of tracking";
            verdict.not_judged.push(format!("{rows}: the level {OBSERVATIONS} has none"));
        }
        verdict.hint(run);
        Ok(verdict)
    }
}
