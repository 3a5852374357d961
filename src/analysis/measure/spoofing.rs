//! What a spoofer did to the fixes: how far from the truth they went, and how near to its claim.
//!
//! A fix counts as captured when it lies nearer to what the first spoofer claims than to the truth and the
//! two are further apart than the fixes' own scatter. Limits: one spoofer; its clock is not judged.

use std::collections::HashMap;

use serde::Serialize;

use crate::analysis::read::Run;
use crate::analysis::statistics::percentile;

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

/// The fixes for which the first spoofer claims something.
pub fn moved(run: &Run) -> Vec<Moved> {
    let truth: HashMap<u64, _> = run.trajectory.iter().map(|row| (row.sample, row.position_m())).collect();
    let claims: HashMap<u64, _> = run.claimed.iter().map(|row| (row.sample, row.position_m())).collect();
    let one = |fix: &crate::gnss::record::Fix| {
        let (truth_m, claim_m) = (truth.get(&fix.sample)?, claims.get(&fix.sample)?);
        Some(Moved {
            time_s: run.time_s(fix.sample),
            from_truth_m: (fix.position_m() - truth_m).norm(),
            from_claim_m: (fix.position_m() - claim_m).norm(),
            claim_from_truth_m: (claim_m - truth_m).norm(),
        })
    };
    run.fixes.iter().filter_map(one).collect()
}

impl Spoofing {
    /// `None` in a run without a spoofer.
    pub fn of(run: &Run) -> Option<Self> {
        let claimed = || {
            let truth: HashMap<u64, _> = run.trajectory.iter().map(|row| (row.sample, row.position_m())).collect();
            let distance =
                |row: &crate::gnss::record::TrajectoryRow| Some((row.position_m() - truth.get(&row.sample)?).norm());
            run.claimed.iter().filter_map(distance).fold(0.0, f64::max)
        };
        if run.claimed.is_empty() {
            return None;
        }
        let fixes = moved(run);
        let apart: Vec<&Moved> = fixes.iter().filter(|fix| fix.claim_from_truth_m >= APART_M).collect();
        let captured: Vec<f64> =
            apart.iter().filter(|fix| fix.from_claim_m < fix.from_truth_m).map(|fix| fix.from_claim_m).collect();
        let farthest = fixes.iter().map(|fix| fix.from_truth_m).max_by(f64::total_cmp);
        Some(Self {
            displacement_max_m: farthest,
            claimed_displacement_max_m: claimed(),
            captured_share: (!apart.is_empty()).then(|| captured.len() as f64 / apart.len() as f64),
            from_claim_p95_m: percentile(&captured, 0.95),
        })
    }
}
