//! A receiver that this project did not write, against what its scene allows: as far as its files show it.
//!
//! Which satellites must be observed and when fixes are due follows from the scene, for a receiver of common
//! settings ([`Receiver`]) that begins when it likes within generous bounds ([`times`]). How it makes its
//! ranges is not known, so random errors are held against a plain receiver's ([`plain`]): satellite by
//! satellite ([`signals`]), by what they have in common ([`clocks`]), and in its positions ([`places`]).
//! Reflections widen the limits; where a spoofer sends, or the scene expects any errors, [`excused`] has what
//! is left.

mod atmosphere;
mod clocks;
mod excused;
mod places;
mod plain;
mod signals;
mod times;

use std::collections::{BTreeMap, BTreeSet};

use super::availability::Came;
use crate::error::JudgeError;
use crate::expect::due::Expectations;
use crate::expect::due::receiver::Receiver;
use crate::judge::foreign::measured::{Measured, ObservationError, Slip};
use crate::judge::foreign::place::Places;
use crate::judge::foreign::{ForeignSummary, Judgement};
use crate::judge::judgement::{Bound, Group};
use crate::judge::verdict::Verdict;
use crate::read::Run;
use crate::statistics::median;
use gnss::satellite::System;
use gnss::signal::{Link, Signal};
use plain::{PHASE_CYCLES, Scene};
use times::{Begin, Labels};

/// Share of a file's epochs, observations and positions that may be without a truth, in percent: those before
/// its clock is set.
const UNMATCHED_PERCENT: f64 = 1.0;
/// Share of carriers that may be declared broken, in percent: fades break a few.
const DECLARED_PERCENT: f64 = 10.0;

impl Verdict {
    /// A foreign receiver's files against the scene that it was fed with.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of_foreign(found: &Judgement) -> Result<Self, JudgeError> {
        let (run, judged, summary) = (&found.run, &found.judged, &found.summary);
        let (measured, places) = (judged.observables.as_ref(), judged.places.as_ref());
        let scene = Scene::of(run)?;
        let mut of_links: BTreeMap<Link, Vec<f64>> = BTreeMap::new();
        for row in measured.iter().flat_map(|measured| &measured.rows) {
            of_links.entry(row.link).or_default().push(row.label_s);
        }
        let observed_s: Vec<f64> =
            measured.iter().flat_map(|measured| &measured.clock).map(|row| row.label_s).collect();
        let labels = Labels::new(run, &observed_s, of_links, judged.truth_interval_s)?;
        let mut receiver = Receiver::of(run);
        receiver.interval_s = labels.interval_s;
        let mut expected = Expectations::of(run, receiver, &labels)?;
        let begin = Begin::of(&scene, &expected, &labels);
        let mut verdict = Self::default();
        if let Some(measured) = measured {
            verdict.about(Group::Tables).observations(&scene, measured, summary);
            verdict.about(Group::Availability).span("observations", &scene, &observed_s, begin.observation_s);
            verdict.about(Group::Tables).stated_interval(measured.stated_interval_s, &observed_s);
            let signals: BTreeSet<&str> = labels.of_links.keys().map(|link| link.signal.name).collect();
            let others: BTreeSet<&str> = expected.satellites.keys().map(|link| link.signal.name).collect();
            for name in others.difference(&signals) {
                verdict.not_judged.push(format!("{name}: the receiver observes none of it"));
            }
            expected.satellites.retain(|link, _| signals.contains(link.signal.name));
            verdict.about(Group::Availability).observed(&expected, |link, _| {
                let seen = labels.of_links.contains_key(link);
                if seen { "lost, or late" } else { "never observed" }.to_owned()
            });
            let absent: Vec<String> = (expected.satellites.iter())
                .filter(|(link, one)| one.due > 0 && labels.may_come(link))
                .map(|(link, _)| run.name(*link))
                .collect();
            if !absent.is_empty() {
                let why = "a receiver that writes none before their orbits may find them later than the file ends";
                verdict.not_judged.push(format!("satellites never observed ({}): {why}", absent.join(", ")));
            }
            verdict.about(Group::Tracking).observables(&scene, measured, summary, &expected);
        }
        if let Some(places) = places {
            verdict.about(Group::Tables).positions(run, places, judged.labels_late_s);
            verdict.weeks_of_positions(run, summary.join.positions_week_offset);
            let fixes: Vec<f64> = places.rows.iter().map(|row| row.label_s).collect();
            let labels = Labels::new(run, &fixes, BTreeMap::new(), judged.truth_interval_s)?;
            verdict.about(Group::Availability).span("positions", &scene, &fixes, begin.fix_s);
            expected.receiver.interval_s = labels.interval_s;
            if let Some(last_s) = fixes.last() {
                expected.epochs.retain(|due| due.time_s <= scene.time_s(*last_s));
            }
            let first = fixes.first().and_then(|label_s| labels.sample_at(*label_s));
            let came = Came { samples: labels.near(&fixes), first_s: first.map(|sample| run.time_s(sample)) };
            expected.first_fix_s = begin.fix_s.map(|due_s| due_s.max(came.first_s.unwrap_or(due_s)));
            verdict.coming(run.scene.duration_s, &run.scene.expect, &expected, &came);
            verdict.about(Group::Position).repeated(places, &scene);
            verdict.places(&scene, places, &labels, &expected)?;
            let timed =
                places.rows.iter().filter_map(|row| Some((run.time_s(labels.sample_at(row.label_s)?), row.length_m())));
            verdict.within(&run.scene.expect, timed);
        }
        verdict.about(Group::Tracking).excused_foreign(&scene, measured, places);
        Ok(verdict)
    }

    /// Judges the match of the file with this scene, and of its signals with those that it names.
    fn observations(&mut self, scene: &Scene<'_>, measured: &Measured, summary: &ForeignSummary) {
        let percent = |without: usize, of: usize| 100.0 * without as f64 / of.max(1) as f64;
        let source = "the scene's truth has every epoch of its samples, and every satellite in view";
        let bound = Bound::Max(UNMATCHED_PERCENT);
        let epochs = percent((measured.epochs - measured.joined).saturating_sub(measured.at_edge.0), measured.epochs);
        self.judge("epochs of observations without a truth", "", epochs, "%", bound.clone(), source);
        let observations = percent(measured.unmatched.saturating_sub(measured.at_edge.1), measured.observations);
        self.judge("observations without a truth", "", observations, "%", bound, source);
        let source = "the other pseudoranges of their epochs";
        let path = "join.observations_outliers";
        let limit_m = |row: &ObservationError| measured.outlier_limit_m + scene.reach(&row.link).code_m;
        let is_far = |row: &&ObservationError| row.code_m.is_some_and(|code_m| code_m.abs() > limit_m(row));
        let far: Vec<_> = measured.rows.iter().filter(|row| scene.judges(row)).filter(is_far).collect();
        self.judge("pseudoranges of another signal", path, far.len(), "", Bound::Max(0.0), source);
        let names: BTreeSet<String> = far.iter().map(|row| scene.run.name(row.link)).collect();
        self.explain(names.into_iter().collect());
        let weeks = summary.join.observations_week_offset.abs();
        self.judge("weeks by which dates are off", "", weeks, "", Bound::Max(0.0), "the scene's dates");
    }

    /// Code, carrier, Doppler and C/N0.
    fn observables(
        &mut self,
        scene: &Scene<'_>,
        measured: &Measured,
        summary: &ForeignSummary,
        expected: &Expectations,
    ) {
        self.signs(measured, scene);
        let judged = |slip: &&Slip| scene.is_bounded(slip.label_s) && scene.is_sound(&slip.link, slip.label_s);
        let undeclared: Vec<&Slip> = measured.slips.iter().filter(|slip| !slip.declared).filter(judged).collect();
        let path = "carrier.slips_undeclared";
        let source = "the file's own indicator";
        self.judge("undeclared breaks of carriers", path, undeclared.len(), "", Bound::Max(0.0), source);
        self.explain(undeclared.iter().take(5).map(|slip| format!("{} at {:.1} s", slip.sv, slip.label_s)).collect());
        self.declared(measured);
        self.frozen(measured, scene);
        let ones = signals::ones(measured, scene, expected);
        self.time_tags(measured, &ones, scene);
        if ones.is_empty() {
            self.not_judged.push("sizes of errors: the scene expects any at all epochs of the file".to_owned());
            return;
        }
        if scene.run.scene.noise {
            self.strengths(&ones, scene);
        } else {
            self.not_judged.push("C/N0: the scene has no noise".to_owned());
        }
        if let Some(rms) = summary.carrier.rms_cycles.filter(|_| scene.is_always_bounded()) {
            let most = ones.iter().map(|one| scene.reach(&one.link).carrier_cycles).fold(0.0, f64::max);
            let source = "rule of thumb for a phase loop, 15 degrees, and reflections";
            let bound = Bound::Max(PHASE_CYCLES + most);
            self.judge("carrier, rms", "carrier.rms_cycles", rms, "cycles", bound, source);
        }
        self.codes(&ones, scene);
        self.offsets(measured, &ones, scene);
        self.dopplers(&ones, scene, measured);
        self.arcs(measured, &ones, scene);
        self.rates(measured, &ones, scene);
    }

    /// Indicators of carriers that go on from the epoch before: of those that begin, any may be set.
    fn declared(&mut self, measured: &Measured) {
        let mut links: BTreeMap<Link, Vec<&ObservationError>> = BTreeMap::new();
        for row in measured.rows.iter().filter(|row| row.values.carrier_cycles.is_some()) {
            links.entry(row.link).or_default().push(row);
        }
        let pairs =
            links.values().flat_map(|rows| rows.windows(2)).map(|two| (two[1].label_s - two[0].label_s, two[1]));
        let pairs: Vec<(f64, &ObservationError)> = pairs.collect();
        let Some(usual_s) = median(&pairs.iter().map(|(step_s, _)| *step_s).collect::<Vec<_>>()) else { return };
        let on: Vec<_> = pairs.iter().filter(|(step_s, _)| *step_s < 1.5 * usual_s).collect();
        let declared = on.iter().filter(|(_, row)| row.values.lost_lock).count();
        let percent = 100.0 * declared as f64 / on.len().max(1) as f64;
        let source = "an indicator is of a break since the epoch before";
        self.judge("carriers declared broken", "", percent, "%", Bound::Max(DECLARED_PERCENT), source);
    }

    fn positions(&mut self, run: &Run, places: &Places, labels_late_s: Option<i64>) {
        let percent = 100.0 * (places.fixes - places.rows.len()).saturating_sub(places.at_edge) as f64
            / places.fixes.max(1) as f64;
        let source = format!("the scene's truth has every second of its {} s", run.scene.duration_s);
        self.judge("positions without a truth", "", percent, "%", Bound::Max(UNMATCHED_PERCENT), &source);
        if let Some(late_s) = labels_late_s {
            self.explain(vec![format!("labels are {late_s} s late: GPS time in place of UTC")]);
        }
    }

    /// Dates of positions. A week number of ten bits does not say which of its eras it is of, and a receiver
    /// that was built later takes a later one.
    fn weeks_of_positions(&mut self, run: &Run, weeks: i64) {
        let ten_bits = |signal: &Signal| !matches!(signal.system, System::Galileo | System::BeiDou | System::Glonass);
        if weeks > 0 && run.signals.iter().all(|signal| ten_bits(signal)) {
            self.not_judged.push(format!(
                "era of positions' dates: they are {weeks} weeks ahead, and the message's week number has ten bits"
            ));
            return;
        }
        let source = "the scene's dates";
        self.judge("weeks by which dates of positions are off", "", weeks.abs(), "", Bound::Max(0.0), source);
    }
}
