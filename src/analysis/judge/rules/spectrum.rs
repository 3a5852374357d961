//! The spectrum of each front end's samples against the expected one.

use crate::error::JudgeError;
use crate::expect::front_end::FrontEnd;
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::measure::spectrum::{Departure, Departures};
use crate::read::Run;

impl Verdict {
    /// Rows of level and shape, for each front end whose spectrum was estimated.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub(super) fn spectrum(&mut self, run: &Run) -> Result<(), JudgeError> {
        let others = run.other_psds.iter().map(|(place, rows)| (*place, rows));
        for (place, rows) in std::iter::once((0, &run.psd)).chain(others).filter(|(_, rows)| !rows.is_empty()) {
            let front_end = FrontEnd::of(run, place);
            let own = front_end.name.map_or_else(String::new, |name| format!(" of {name}"));
            let found = match Departures::of(run, &front_end, rows)? {
                Ok(found) => found,
                Err(reason) => {
                    self.not_judged.push(format!("spectrum of the samples{own}: {reason}"));
                    continue;
                }
            };
            match found.level {
                Some(level) => self.departure(&format!("level of the samples{own} over the expected one"), level, None),
                None => self.not_judged.push(format!("level of the samples{own}: the truth does not state it")),
            }
            let broad = format!("spectrum of the samples{own}, a thirty-second of the band, largest error");
            self.departure(&broad, found.broad, Some(found.broad.at_hz));
            if let Some(narrow) = found.narrow {
                self.departure(
                    &format!("spectrum of the samples{own}, one bin, largest error"),
                    narrow,
                    Some(narrow.at_hz),
                );
            }
        }
        Ok(())
    }

    fn departure(&mut self, figure: &str, found: Departure, at_hz: Option<f64>) {
        let source = "scatter of Welch's estimate and of codes as random chips";
        self.judge(figure, "", found.off_db.abs(), "dB", Bound::Max(found.limit_db), source);
        if let Some(at_hz) = at_hz {
            let sign = if found.off_db < 0.0 { "too weak" } else { "too strong" };
            self.explain(vec![format!("{sign} at {:+.3} MHz in the samples", at_hz / 1e6)]);
        }
    }
}
