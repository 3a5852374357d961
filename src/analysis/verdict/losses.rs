//! Losses of lock and cycle slips, those apart that a signal too weak to hold explains.

use super::{Bound, Verdict};
use crate::analysis::JudgeError;
use crate::analysis::errors::Errors;
use crate::analysis::load::Run;
use crate::analysis::summary::Summary;
use crate::analysis::theory::pll;
use crate::gnss::record::Event;

impl Verdict {
    pub(super) fn losses(&mut self, run: &Run, errors: &Errors, summary: &Summary) -> Result<(), JudgeError> {
        let tracking = &summary.tracking;
        let (unexpected, weak) = losses(run, errors)?;
        let source = match weak {
            0 => "none where thermal jitter stays below 15°".to_owned(),
            _ => format!("none where thermal jitter stays below 15°; {weak} more below that C/N0"),
        };
        self.judge("unexpected losses of lock", "", unexpected, "", Bound::Max(0.0), &source);
        if weak == 0 {
            let source = "none while every signal is strong enough to hold";
            self.judge("cycle slips", "tracking.cycle_slips", tracking.cycle_slips, "", Bound::Max(0.0), source);
        } else {
            self.not_judged.push(format!("cycle slips ({}): signals were too weak to hold", tracking.cycle_slips));
        }
        Ok(())
    }
}

/// Losses of lock at which the signal was strong enough to hold, and the others: by the C/N0 that the receiver could have, other
/// codes and interference counted as noise, at the last observation before, against that at which the phase loop's thermal
/// jitter reaches its threshold.
fn losses(run: &Run, errors: &Errors) -> Result<(usize, usize), JudgeError> {
    let setting = |key: &str, default: f64| run.tracking_setting(key).unwrap_or(default);
    let update_s = 1e-3 * setting("integration", 4.0);
    let least_dbhz = pll::cn0_dbhz(pll::THRESHOLD_RAD, setting("pll_bandwidth_hz", 18.0), update_s);
    let window = (LOOK_BACK_S * run.scene.sample_rate_hz) as u64;
    let (mut strong, mut weak) = (0, 0);
    for loss in run.events.iter().filter(|row| row.event == Event::LossOfLock) {
        let link = (loss.sv, loss.signal);
        // What the truth says around the loss; a satellite that it does not have is no signal at all.
        let rows = run.truth.rows(link)?;
        let near = rows.iter().filter(|row| row.sample <= loss.sample && loss.sample - row.sample <= window);
        let own = errors.signals.rows(link)?;
        let jammed = own.iter().rev().find(|row| row.sample <= loss.sample);
        let cost_db = jammed.map_or(0.0, |row| row.cn0_true_dbhz - row.cn0_effective_dbhz);
        let lowest_dbhz = near.map(|row| row.cn0_dbhz - cost_db).min_by(f64::total_cmp);
        let held = lowest_dbhz.is_some_and(|dbhz| dbhz >= least_dbhz);
        (strong, weak) = if held { (strong + 1, weak) } else { (strong, weak + 1) };
    }
    Ok((strong, weak))
}

/// The lock detectors' memory: how long before a declared loss the signal may have failed.
const LOOK_BACK_S: f64 = 2.0;
