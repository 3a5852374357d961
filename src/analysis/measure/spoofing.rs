//! Effect of a spoofer on the fixes: their distance from the truth, and from the spoofer's claim.
//!
//! A fix counts as captured under two conditions. It is nearer to the position that the first spoofer claims
//! than to the truth. The two positions are further apart than the fixes' own scatter. Limits: one spoofer,
//! whose clock is not judged.

use serde::Serialize;

use crate::error::JudgeError;
use crate::read::Run;
use crate::statistics::percentile;

/// Distance between truth and claim from which on a fix can be assigned to one of them.
pub const APART_M: f64 = 20.0;

/// `spoofing` in `summary.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spoofing {
    /// Largest distance of a fix from the true position while the spoofer was on.
    pub displacement_max_m: Option<f64>,
    /// Largest distance of the claim from the true position.
    pub claimed_displacement_max_m: f64,
    /// Share of the fixes at claims at least [`APART_M`] from the truth that lie nearer to the claim.
    pub captured_share: Option<f64>,
    /// Distance of the captured fixes from the claim.
    pub from_claim_p95_m: Option<f64>,
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
        see(Moved {
            time_s: run.time_s(fix.sample),
            from_truth_m: (fix.position_m() - truth_m).norm(),
            from_claim_m: (fix.position_m() - claim_m).norm(),
            claim_from_truth_m: (claim_m - truth_m).norm(),
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
        let (mut truth, mut claimed_m) = (run.trajectory.finder()?, 0.0_f64);
        run.claimed.each(|row| {
            let truth = truth.get(row.sample);
            claimed_m = truth.map_or(claimed_m, |truth| claimed_m.max((row.position_m() - truth.position_m()).norm()));
        })?;
        let (mut apart, mut captured, mut farthest_m) = (0_usize, Vec::new(), None);
        moved(run, |fix| {
            let farther = |most_m: &f64| most_m.total_cmp(&fix.from_truth_m).is_gt();
            farthest_m = farthest_m.filter(farther).or(Some(fix.from_truth_m));
            if fix.claim_from_truth_m >= APART_M {
                apart += 1;
                captured.extend((fix.from_claim_m < fix.from_truth_m).then_some(fix.from_claim_m));
            }
        })?;
        Ok(Some(Self {
            displacement_max_m: farthest_m,
            claimed_displacement_max_m: claimed_m,
            captured_share: (apart > 0).then(|| captured.len() as f64 / apart as f64),
            from_claim_p95_m: percentile(&captured, 0.95),
        }))
    }
}
