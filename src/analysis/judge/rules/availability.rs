//! Rules of availability: the first fix in time, no required epoch and no long segment without a fix.

use crate::error::JudgeError;
use crate::expect::due::{Due, Expectations};
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use gnss::facts::{Expect, Fixes};

/// Share of the epochs that may be without a fix, in percent.
const LACKING_PERCENT: f64 = 1.0;
/// Longest time without a fix that a user does not notice.
const GAP_S: f64 = 1.0;

/// A receiver's fixes, however it reports them.
pub(crate) struct Came {
    /// Epochs of the truth with a fix, sorted.
    pub samples: Vec<u64>,
    pub first_s: Option<f64>,
}

impl Came {
    /// Fixes of a run's table.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub(super) fn of(run: &Run) -> Result<Self, JudgeError> {
        let mut samples = run.fixes.map(|fix| fix.sample)?;
        samples.sort_unstable();
        Ok(Self { first_s: run.fixes.earliest_sample().map(|sample| run.time_s(sample)), samples })
    }
}

impl Came {
    fn has(&self, sample: u64) -> bool {
        self.samples.binary_search(&sample).is_ok()
    }
}

impl Verdict {
    pub(crate) fn availability(&mut self, duration_s: f64, expect: &Expect, expected: &Expectations, came: &Came) {
        self.first_fix(duration_s, expect, expected, came);
        self.coming(duration_s, expect, expected, came);
    }

    /// Judges the continuity of fixes once they have begun or are due.
    pub(super) fn coming(&mut self, duration_s: f64, expect: &Expect, expected: &Expectations, came: &Came) {
        self.unwanted(duration_s, expect, expected, came);
        let due = |due: &&Due| expected.measures(due) && expected.fix_due(expect, due, came.first_s);
        let all: Vec<&Due> = expected.epochs.iter().filter(due).collect();
        if all.is_empty() {
            return;
        }
        for (from_s, to_s, name) in stretches(expect, duration_s) {
            let own: Vec<&&Due> = all.iter().filter(|due| (from_s..to_s).contains(&due.time_s)).collect();
            if own.is_empty() {
                continue;
            }
            let lacking: Vec<f64> = own.iter().filter(|due| !came.has(due.sample)).map(|due| due.time_s).collect();
            let percent = 100.0 * lacking.len() as f64 / own.len() as f64;
            let source = format!("{} epochs have four satellites and their orbits, well placed", own.len());
            let figure = format!("epochs without a fix{name}");
            self.judge(&figure, "", percent, "%", Bound::Max(LACKING_PERCENT), &source);
            if let (Some(first_s), Some(last_s)) = (lacking.first(), lacking.last()) {
                self.explain(vec![format!("{} epochs between {first_s:.1} and {last_s:.1} s", lacking.len())]);
            }
        }
        let interval_s = expected.receiver.interval_s.max(step_s(&expected.epochs));
        let (gap_s, at_s) = longest_gap(&all, came, interval_s);
        let limit_s = GAP_S.max(3.0 * interval_s);
        self.judge(
            "longest time without a fix",
            "",
            gap_s,
            "s",
            Bound::Max(limit_s),
            "a second, or three intervals, where satellites allow a fix at each",
        );
        if gap_s > limit_s {
            self.explain(vec![format!("it began at {at_s:.1} s")]);
        }
    }

    fn first_fix(&mut self, duration_s: f64, expect: &Expect, expected: &Expectations, came: &Came) {
        let required = expect.whole.iter().chain(expect.intervals.iter().map(|one| &one.terms));
        let required = required.filter_map(|terms| terms.fix).any(|fix| fix == Fixes::Required);
        match (expected.first_fix_s, required) {
            (Some(limit_s), _) => {
                let page = if expected.receiver.requires_ionosphere {
                    ", then page 18 of subframe 4, which the settings require".to_owned()
                } else if expected.receiver.ionosphere_wait_s > 0.0 {
                    format!(", then up to {} s for the ionosphere", expected.receiver.ionosphere_wait_s)
                } else {
                    String::new()
                };
                let source = format!(
                    "the message's own timetable: four satellites found and locked within {} s, their subframes 1 to \
                     3 whole by {:.1} s{page}",
                    crate::expect::due::satellite::LOCK_S,
                    expected.four_by_s.unwrap_or(0.0)
                );
                self.judge(
                    "time to first fix",
                    "position.first_fix_s",
                    came.first_s,
                    "s",
                    Bound::Max(limit_s),
                    &source,
                );
            }
            (None, true) => {
                let source = "the scene requires a fix";
                self.judge(
                    "time to first fix",
                    "position.first_fix_s",
                    came.first_s,
                    "s",
                    Bound::Max(duration_s),
                    source,
                );
            }
            (None, false) => {
                let why = if expect.fix(0.0).is_some() {
                    "the scene asks for none".to_owned()
                } else {
                    match expected.four_by_s {
                        Some(four_s) => format!(
                            "four satellites are certain to be usable by {four_s:.1} s, the ionosphere's page not \
                             within {duration_s} s"
                        ),
                        None => format!(
                            "within {duration_s} s no four satellites that must be held are placed well and have \
                             sent their orbits"
                        ),
                    }
                };
                let first =
                    came.first_s.map_or("none came".to_owned(), |first_s| format!("the first came at {first_s:.1} s"));
                self.not_judged.push(format!("time to first fix ({first}): {why}"));
            }
        }
    }

    /// Fixes where the scene expects none.
    fn unwanted(&mut self, duration_s: f64, expect: &Expect, expected: &Expectations, came: &Came) {
        for (from_s, to_s, name) in stretches(expect, duration_s) {
            let terms = expect.at(from_s).find(|terms| terms.fix.is_some());
            let Some(terms) = terms.filter(|terms| terms.fix == Some(Fixes::None)) else { continue };
            let own = expected.epochs.iter().filter(|due| (from_s..to_s).contains(&due.time_s));
            let count = own.filter(|due| came.has(due.sample)).count();
            let source = format!("the scene expects none: {}", terms.reason);
            self.judge(&format!("fixes{name}"), "", count, "", Bound::Max(0.0), &source);
        }
    }
}

/// The scene cut where an expectation begins or ends: from, to, and what to call it.
fn stretches(expect: &Expect, duration_s: f64) -> Vec<(f64, f64, String)> {
    if expect.intervals.is_empty() {
        return vec![(0.0, f64::INFINITY, String::new())];
    }
    let mut edges: Vec<f64> = expect.intervals.iter().flat_map(|one| [one.from_s, one.to_s]).collect();
    edges.push(0.0);
    edges.retain(|at_s| *at_s < duration_s);
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    let ends: Vec<f64> = edges.iter().skip(1).copied().chain([f64::INFINITY]).collect();
    edges
        .into_iter()
        .zip(ends)
        .map(|(from_s, to_s)| {
            let inside = expect.intervals.iter().find(|one| (one.from_s..one.to_s).contains(&from_s));
            let why = inside.map_or(String::new(), |one| format!(" ({})", one.terms.reason));
            (from_s, to_s, format!(", {from_s} to {} s{why}", to_s.min(duration_s)))
        })
        .collect()
}

/// Median of the steps between epochs.
fn step_s(epochs: &[Due]) -> f64 {
    let steps: Vec<f64> = epochs.windows(2).map(|two| two[1].time_s - two[0].time_s).collect();
    crate::statistics::median(&steps).unwrap_or(0.0)
}

/// The longest time over epochs that follow one another without a fix at any, and when it began.
fn longest_gap(due: &[&Due], came: &Came, interval_s: f64) -> (f64, f64) {
    let mut longest = (0.0, 0.0);
    for run in due.chunk_by(|a, b| b.time_s - a.time_s < 1.5 * interval_s) {
        for gap in run.chunk_by(|a, b| came.has(a.sample) == came.has(b.sample)) {
            let (Some(first), Some(last)) = (gap.first(), gap.last()) else { continue };
            let length_s = last.time_s - first.time_s + interval_s;
            if !came.has(first.sample) && length_s > longest.0 {
                longest = (length_s, first.time_s);
            }
        }
    }
    longest
}
