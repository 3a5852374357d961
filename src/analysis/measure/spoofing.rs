//! Effect of a spoofer on the fixes: their distance from the truth, and from the spoofer's claim.
//!
//! A spoofer claims a position and a time. A fix counts as captured under two conditions. In position and
//! clock together it is nearer to what the first spoofer claims than to the truth. The two are further apart
//! than the fixes' own scatter. Limits: one spoofer; of a claimed time whole seconds are left out, because
//! codes repeat.

use serde::Serialize;

use crate::error::JudgeError;
use crate::read::Run;
use crate::statistics::percentile;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::TrajectoryRow;

/// Distance between truth and claim from which on a fix can be assigned to one of them.
pub const APART_M: f64 = 20.0;

/// `spoofing` in `summary.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spoofing {
    /// Largest distance of a fix from the true position while the spoofer was on.
    pub displacement_max_m: Option<f64>,
    /// Largest distance of the claim from the true position.
    pub claimed_displacement_max_m: f64,
    /// Largest offset of the claimed time from the true one without whole seconds, metres.
    pub claimed_clock_max_m: f64,
    /// Share of the fixes at claims at least [`APART_M`] from the truth, in position and clock, that lie
    /// nearer to the claim.
    pub captured_share: Option<f64>,
    /// Distance of the captured fixes from the claim.
    pub from_claim_p95_m: Option<f64>,
}

/// Largest shifts of a receiver that spoofers claim.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Claims {
    /// Distance of the claimed position, metres.
    pub place_m: f64,
    /// Offset of the claimed time, metres.
    pub clock_m: f64,
    /// Velocity of the claimed position beside the true one, m/s.
    pub speed_mps: f64,
    /// Rate of the claimed time beside the true one, m/s.
    pub drift_mps: f64,
    /// First and last time with a claim, in seconds from sample 0 by the receiver's clock.
    pub while_s: Option<(f64, f64)>,
}

impl Claims {
    /// Claims of a run; zero without a spoofer.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &Run) -> Result<Self, JudgeError> {
        let (mut claims, mut truth) = (Self::default(), run.trajectory.finder()?);
        run.claimed.each(|row| {
            let Some(own) = truth.get(row.sample) else { return };
            let time_s = run.time_s(row.sample);
            let (from_s, _) = claims.while_s.unwrap_or((time_s, time_s));
            claims.while_s = Some((from_s, time_s));
            let drift_mps = SPEED_OF_LIGHT_MPS * (row.clock_drift - own.clock_drift);
            claims.place_m = claims.place_m.max((row.position_m() - own.position_m()).norm());
            claims.clock_m = claims.clock_m.max(ahead_m(&row, &own).abs());
            claims.speed_mps = claims.speed_mps.max((row.velocity_mps() - own.velocity_mps()).norm());
            claims.drift_mps = claims.drift_mps.max(drift_mps.abs());
        })?;
        Ok(claims)
    }
}

/// Time of a claim ahead of the true one without whole seconds, in metres.
fn ahead_m(claim: &TrajectoryRow, truth: &TrajectoryRow) -> f64 {
    let ahead_s = claim.time().since(truth.time());
    SPEED_OF_LIGHT_MPS * (ahead_s - ahead_s.round())
}

/// One fix while the spoofer was on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Distance of the fix from the truth, metres.
    pub from_truth_m: f64,
    /// Distance of the fix from what the spoofer claims, metres.
    pub from_claim_m: f64,
    /// Distance of the claim from the truth, metres.
    pub claim_from_truth_m: f64,
    /// True if the fix is nearer to the claim than to the truth, in position and clock; `None` where the two
    /// are less than [`APART_M`] apart.
    pub is_captured: Option<bool>,
}

/// Shows `see` the fixes for which the first spoofer claims something.
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read.
pub fn moved(run: &Run, mut see: impl FnMut(Moved)) -> Result<(), JudgeError> {
    let (mut truth, mut claims) = (run.trajectory.finder()?, run.claimed.finder()?);
    run.fixes.each(|fix| {
        let (Some(truth), Some(claim)) = (truth.get(fix.sample), claims.get(fix.sample)) else { return };
        let (truth_m, claim_m) = (truth.position_m(), claim.position_m());
        let from_truth_m = (fix.position_m() - truth_m).norm();
        let from_claim_m = (fix.position_m() - claim_m).norm();
        let claim_from_truth_m = (claim_m - truth_m).norm();
        let ahead_m = ahead_m(&claim, &truth);
        // A clock that is set by signals from ahead of time is that much less ahead itself.
        let late_s = truth.clock_bias_s - fix.clock_bias_s;
        let late_m = SPEED_OF_LIGHT_MPS * (late_s - late_s.round());
        let is_apart = libm::hypot(claim_from_truth_m, ahead_m) >= APART_M;
        see(Moved {
            time_s: run.time_s(fix.sample),
            from_truth_m,
            from_claim_m,
            claim_from_truth_m,
            is_captured: is_apart
                .then(|| libm::hypot(from_claim_m, late_m - ahead_m) < libm::hypot(from_truth_m, late_m)),
        });
    })
}

impl Spoofing {
    /// `None` in a run without a spoofer.
    ///
    /// # Errors
    /// Errors of [`moved`].
    pub fn of(run: &Run) -> Result<Option<Self>, JudgeError> {
        if run.claimed.is_empty() {
            return Ok(None);
        }
        let claims = Claims::of(run)?;
        let (mut apart, mut captured, mut farthest_m) = (0_usize, Vec::new(), None);
        moved(run, |fix| {
            let farther = |most_m: &f64| most_m.total_cmp(&fix.from_truth_m).is_gt();
            farthest_m = farthest_m.filter(farther).or(Some(fix.from_truth_m));
            apart += usize::from(fix.is_captured.is_some());
            captured.extend((fix.is_captured == Some(true)).then_some(fix.from_claim_m));
        })?;
        Ok(Some(Self {
            displacement_max_m: farthest_m,
            claimed_displacement_max_m: claims.place_m,
            claimed_clock_max_m: claims.clock_m,
            captured_share: (apart > 0).then(|| captured.len() as f64 / apart as f64),
            from_claim_p95_m: percentile(&captured, 0.95),
        }))
    }
}
