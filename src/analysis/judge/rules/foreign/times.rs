//! Times at which a foreign receiver's observations and positions are due.
//!
//! The way it searches is unknown. It is also unknown if it writes observations before its first fix. So its
//! first observation and its first fix are due by one generous time. It holds the lock of satellites after a
//! slow search, their complete ephemerides, the ionosphere's page where that comes at once, and a reserve.
//! Observations before any orbit can be complete show the time of lock, and then that lock counts. From its
//! own first epoch on the receiver must continue to within seconds of the scene's end. Limits: a receiver
//! that writes only every second epoch counts as one of twice the interval, unless its header states the
//! interval.

use std::collections::{BTreeMap, BTreeSet};

use super::plain::Scene;
use crate::error::JudgeError;
use crate::expect::due::satellite::LOCK_S;
use crate::expect::due::timetable::Timetable;
use crate::expect::due::{Expectations, Observed};
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use crate::statistics::percentile;
use gnss::signal::{Link, Signal};
use gnss::time::Epoch;

/// Time within which a receiver without knowledge has locked four satellites in full view: one that searches
/// channel after channel, as GNSS-SDR does.
const SEARCH_S: f64 = 8.0;
/// Time within which a second search has found a satellite that the first one missed.
const AGAIN_S: f64 = LOCK_S + 15.0;
/// Time within which a receiver that searches one channel after another has found all: GNSS-SDR takes 40 s
/// for a sky of twelve.
const SLOW_S: f64 = 45.0;
/// Reserve for a solution, and for a receiver that waits for a satellite more.
const RESERVE_S: f64 = 6.0;
/// A page of the ionosphere that comes within so long after the orbits is waited for: one subframe of NavIC,
/// the longest unit of a message.
const PAGE_S: f64 = 12.5;
/// Truth's epochs that lie as near to a receiver's labels as those lie to each other.
pub(super) struct Labels {
    /// Sample and time of the truth's rows.
    epochs: Vec<(u64, f64)>,
    reach_s: f64,
    pub interval_s: f64,
    pub of_links: BTreeMap<Link, Vec<f64>>,
    /// First and last label of an observation.
    span_s: Option<(f64, f64)>,
    /// Latest beginning of each signal's satellites, seconds.
    late_s: BTreeMap<&'static Signal, f64>,
}

/// The usual interval of labels: the tenth percentile, as epochs may be missing.
fn interval_s(labels: &[f64]) -> Option<f64> {
    percentile(&labels.windows(2).map(|two| two[1] - two[0]).collect::<Vec<f64>>(), 0.1)
}

impl Labels {
    /// Labels of a receiver's epochs, and of each satellite's.
    pub fn new(run: &Run, all: &[f64], of_links: BTreeMap<Link, Vec<f64>>, truth_s: f64) -> Result<Self, JudgeError> {
        let interval_s = interval_s(all).unwrap_or(0.0).max(truth_s);
        // Labels count from the second that is nearest to the truth's first row.
        let first = run.trajectory.first();
        let origin = first.as_ref().map(|row| Epoch::new(row.gps_s, row.gps_fraction_s.round()));
        let since_s = |time: Epoch| origin.map_or(0.0, |origin| time.since(origin));
        let epochs = run.trajectory.map(|row| (row.sample, since_s(row.time())))?;
        let start = first.map(|row| row.time().plus_s(-run.time_s(row.sample)));
        let span_s = all.first().zip(all.last()).map(|(first, last)| (*first, *last));
        let late = |signal: &&'static Signal| {
            let table = Timetable::beside(signal, &run.signals, start?);
            // Who writes nothing before an orbit is whole waits for it with every satellite that it finds.
            let is_early = span_s.is_some_and(|(from_s, _)| from_s < table.ephemeris_by_s(0.0));
            let ready_s = if is_early { table.frame_by_s(AGAIN_S) } else { table.ephemeris_by_s(SLOW_S) };
            Some((*signal, ready_s + RESERVE_S))
        };
        let late_s = run.signals.iter().filter_map(late).collect();
        Ok(Self { epochs, reach_s: 0.5 * interval_s + 1e-3, interval_s, of_links, span_s, late_s })
    }

    pub fn near(&self, labels: &[f64]) -> Vec<u64> {
        let is_near = |t_s: f64| {
            let next = labels.partition_point(|label_s| *label_s < t_s - self.reach_s);
            labels.get(next).is_some_and(|label_s| *label_s <= t_s + self.reach_s)
        };
        let near = self.epochs.iter().filter(|(_, t_s)| is_near(*t_s)).map(|(sample, _)| *sample);
        let mut samples: Vec<u64> = near.collect();
        samples.sort_unstable();
        samples
    }

    /// True if a satellite that is never observed may still be in time when the file ends.
    pub fn may_come(&self, link: &Link) -> bool {
        let in_time_s = self.late_s.get(link.signal).copied().unwrap_or(0.0);
        !self.of_links.contains_key(link) && self.span_s.is_some_and(|(_, to_s)| in_time_s > to_s)
    }

    /// The truth's first epoch from a label on.
    pub fn sample_at(&self, label_s: f64) -> Option<u64> {
        let next = self.epochs.partition_point(|(_, t_s)| *t_s < label_s - 1e-3);
        self.epochs.get(next).map(|(sample, _)| *sample)
    }
}

impl Observed for Labels {
    /// Samples of the file. Before it begins and after it ends nothing is due. Nothing is due either before a
    /// satellite's own first one where that is in time.
    fn samples(&self, link: Link) -> Result<Vec<u64>, JudgeError> {
        let Some((from_s, to_s)) = self.span_s else { return Ok(Vec::new()) };
        let labels = self.of_links.get(&link).map_or(&[][..], Vec::as_slice);
        let in_time_s = self.late_s.get(link.signal).copied().unwrap_or(0.0).max(from_s + RESERVE_S);
        let own_s = labels.first().copied().unwrap_or(f64::INFINITY).min(in_time_s);
        let mut samples = self.near(labels);
        let pardoned = |t_s: f64| t_s < own_s || t_s > to_s;
        samples.extend(self.epochs.iter().filter(|(_, t_s)| pardoned(*t_s)).map(|(sample, _)| *sample));
        samples.sort_unstable();
        samples.dedup();
        Ok(samples)
    }
}

/// Longest unit of the scene's messages, seconds. Who gives epochs out when a unit confirms their time loses
/// those of the last one.
fn unit_s(run: &Run) -> f64 {
    let components = run.signals.iter().flat_map(|signal| signal.components);
    components.filter_map(|component| component.message).map(|message| message.unit_s as f64).fold(0.0, f64::max)
}

/// Latest times of the first observation and the first fix, in seconds from sample 0.
pub(super) struct Begin {
    pub observation_s: Option<f64>,
    pub fix_s: Option<f64>,
}

impl Begin {
    pub fn of(scene: &Scene<'_>, expected: &Expectations, labels: &Labels) -> Self {
        let none = Self { observation_s: None, fix_s: None };
        let run = scene.run;
        let due_s = expected.first_fix_s.or(expected.four_by_s);
        let (Some(first), Some(due_s)) = (run.trajectory.first(), due_s) else { return none };
        let start = first.time().plus_s(-run.time_s(first.sample));
        let signals: BTreeSet<&'static Signal> = expected.satellites.keys().map(|link| link.signal).collect();
        let with_four: Vec<&'static Signal> = {
            let count = |signal: &Signal| expected.satellites.keys().filter(|link| link.signal == signal).count();
            signals.iter().copied().filter(|signal| count(signal) >= 4).collect()
        };
        let of = if with_four.is_empty() { signals.iter().copied().collect() } else { with_four };
        let table = |signal: &&'static Signal| Timetable::beside(signal, &signals, start);
        // Which of them a receiver uses is not known.
        let orbits_s = |locked_s: f64| of.iter().map(|one| table(one).ephemeris_by_s(locked_s)).fold(0.0, f64::max);
        let by = |locked_s: f64| {
            let orbit_s = orbits_s(locked_s);
            let pages_s = of.iter().map(|one| table(one).ionosphere_by_s(locked_s));
            pages_s.filter(|page_s| *page_s <= orbit_s + PAGE_S).fold(orbit_s, f64::max)
        };
        // What the scene takes away delays more than the timetable does.
        let usual_s = by(SEARCH_S).max(due_s) + RESERVE_S;
        let begun_s = labels.span_s.map(|(from_s, _)| scene.time_s(from_s));
        // Observations that come before any orbit is whole show when their satellites were locked.
        let shown_s = begun_s.filter(|begun_s| *begun_s < orbits_s(0.0)).map(|begun_s| {
            let timed =
                |locked_s: f64| of.iter().map(|one| table(one).frame_by_s(locked_s)).fold(f64::INFINITY, f64::min);
            let locked = (0..40).map(|step| 0.5 * f64::from(step)).take_while(|locked_s| timed(*locked_s) <= begun_s);
            by(locked.last().unwrap_or(0.0).min(begun_s)) + RESERVE_S
        });
        // They show nothing of a scene that takes satellites away.
        let fix_s = shown_s.filter(|_| due_s <= by(LOCK_S) + RESERVE_S).unwrap_or(usual_s);
        Self { observation_s: Some(usual_s), fix_s: expected.first_fix_s.map(|_| fix_s) }
    }
}

/// Relative difference that the usual interval of epochs may have from the header's. Causes are clocks that
/// are set by milliseconds, and labels that are rounded.
const INTERVAL: f64 = 0.02;

impl Verdict {
    /// Judges the interval of epochs against the file's header.
    pub(super) fn stated_interval(&mut self, stated_s: Option<f64>, labels: &[f64]) {
        let (Some(stated_s), Some(found_s)) = (stated_s, interval_s(labels)) else { return };
        let source = "the header states the interval of the epochs";
        let value = (found_s / stated_s - 1.0).abs();
        self.judge("interval of epochs against the header's", "", value, "of 1", Bound::Max(INTERVAL), source);
        self.explain(vec![format!("{found_s:.3} s, stated {stated_s:.3} s")]);
    }

    /// Judges the beginning and the end of the observations, and missing epochs.
    pub(super) fn span(&mut self, what: &str, scene: &Scene<'_>, labels: &[f64], begin_s: Option<f64>) {
        let (Some(first_s), Some(last_s)) = (labels.first().copied(), labels.last().copied()) else { return };
        let step_s = interval_s(labels).unwrap_or(0.0);
        if let Some(limit_s) = begin_s {
            let source = format!(
                "satellites locked within {SEARCH_S} s, or as the first observations show, their orbits whole, and \
                 {RESERVE_S} s"
            );
            let value = scene.time_s(first_s);
            let limit_s = limit_s + step_s;
            self.judge(&format!("time to the first of the {what}"), "", value, "s", Bound::Max(limit_s), &source);
        }
        if labels.len() < 2 {
            self.not_judged.push(format!("time without {what} at the end: one epoch has no interval"));
            return;
        }
        let left_s = scene.run.scene.duration_s - scene.time_s(last_s);
        let source = "the longest unit of the scene's messages, with which a receiver may give its epochs out, and two \
                      intervals";
        let limit_s = unit_s(scene.run) + 2.0 * step_s;
        let figure = format!("time without {what} at the end");
        self.judge(&figure, "", left_s, "s", Bound::Max(limit_s), source);
    }
}
