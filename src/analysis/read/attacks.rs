//! Times at which the scene's jammers and spoofers send.

use crate::error::JudgeError;
use crate::read::files::each_of_any;
use crate::read::run::Run;
use gnss::record::TrajectoryRow;

/// Interval in which somebody jams or spoofs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attack {
    /// First sample at which the truth has it.
    pub from: u64,
    /// Last sample at which the truth has it.
    pub to: u64,
    /// True for a spoofer, false for a jammer.
    pub is_spoofing: bool,
}

/// Intervals of ascending samples, joined where they are at most `gap` apart.
fn joined(samples: impl IntoIterator<Item = u64>, gap: u64, is_spoofing: bool) -> Vec<Attack> {
    let mut all: Vec<Attack> = Vec::new();
    for sample in samples {
        match all.last_mut().filter(|last| sample.saturating_sub(last.to) <= gap) {
            Some(last) => last.to = last.to.max(sample),
            None => all.push(Attack { from: sample, to: sample, is_spoofing }),
        }
    }
    all
}

impl Run {
    /// Intervals in which the scene has a jammer or a spoofer, by their beginnings.
    ///
    /// # Errors
    /// Tables that cannot be read.
    pub fn attacks(&self) -> Result<Vec<Attack>, JudgeError> {
        // A row may be missing where the truth's clock and the samples' do not meet.
        let gap = (2.5 * self.truth_interval_s() * self.scene.sample_rate_hz) as u64;
        let mut jammed: Vec<u64> = self.interference.iter().map(|row| row.sample).collect();
        jammed.sort_unstable();
        let mut all = joined(jammed, gap, false);
        let mut claimed = self.claimed.map(|row| row.sample)?;
        for number in 2..=self.scene.spoofers.len() {
            let path = self.truth_place.join(format!("claimed_{number}.csv"));
            each_of_any(&path, |_, row: TrajectoryRow| {
                claimed.push(row.sample);
                Ok(())
            })?;
        }
        claimed.sort_unstable();
        all.extend(joined(claimed, gap, true));
        all.sort_by_key(|attack| (attack.from, attack.is_spoofing));
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_that_follow_each_other_are_one_attack() {
        let of = |from, to| Attack { from, to, is_spoofing: true };
        assert_eq!(joined([10, 20, 20, 30, 90, 100], 25, true), [of(10, 30), of(90, 100)]);
        assert!(joined([], 25, false).is_empty());
    }
}
