//! Rules for reported continuous waves and for a receiver that a spoofer captures.

use crate::error::JudgeError;
use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;

impl Verdict {
    pub(super) fn interference(&mut self, summary: &Summary) {
        let Some(lines) = summary.interference else { return };
        self.judge(
            "interference reported while there was none",
            "interference.false_told",
            lines.false_told,
            "",
            Bound::Max(0.0),
            "the detector's false alarms come once in 1e8 seconds",
        );
        if lines.offset_seconds > 0 {
            let seconds = lines.offset_seconds;
            let reason = "at 0 Hz in the samples it looks like a constant offset of the converter";
            self.not_judged.push(format!("{seconds} s of a continuous wave: {reason}"));
        }
        if lines.wave_seconds == 0 {
            return;
        }
        self.judge(
            "seconds of a continuous wave that were not reported",
            "",
            lines.wave_seconds - lines.wave_seconds_told,
            "",
            Bound::Max(0.0),
            "none of those with a wave of J/N0 ≥ 45 dB-Hz all through",
        );
        // Where a wave is never alone, what is reported may be another source's line.
        if let (Some(bin_hz), Some(error_hz)) = (lines.resolution_hz, lines.frequency_error_max_hz) {
            let source = "half a bin of the receiver's spectrum";
            self.judge(
                "frequency of the continuous wave, largest error",
                "interference.frequency_error_max_hz",
                error_hz,
                "Hz",
                Bound::Max(0.5 * bin_hz),
                source,
            );
        }
    }

    pub(super) fn spoofing(&mut self, run: &Run, summary: &Summary) -> Result<(), JudgeError> {
        let Some(spoofing) = &summary.spoofing else { return Ok(()) };
        let mut bounded = false;
        run.claimed.each(|row| bounded |= run.scene.expect.bounded(run.time_s(row.sample)))?;
        let expected = run.scene.expect.whole.iter().chain(run.scene.expect.intervals.iter().map(|one| &one.terms));
        let reasons: Vec<&str> = expected.map(|terms| terms.reason.as_str()).collect();
        if let Some(share) = spoofing.captured_share {
            if !run.claimed.is_empty() && !bounded {
                let percent = 100.0 * share;
                self.not_judged.push(format!(
                    "fixes captured by the spoofer ({percent:.0} %): the scene expects it: {}",
                    reasons.join("; ")
                ));
                return Ok(());
            }
            let source = "no fix should follow a spoofer";
            self.judge(
                "fixes captured by the spoofer",
                "spoofing.captured_share",
                share,
                "of 1",
                Bound::Max(0.0),
                source,
            );
        }
        Ok(())
    }
}
