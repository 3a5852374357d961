//! Satellites: those that are not there, and those that must be found, observed and used but are not, each
//! with its reason; and decoded navigation parameters.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::JudgeError;
use crate::expect::due::{Expectations, Satellite};
use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use gnss::facts::Fixes;
use gnss::record::{Event, Fix, IonosphereModel, NavigationRow};
use gnss::satellite::Sv;
use gnss::signal::Link;

/// Share of the time over which a satellite must be observed, of what is required. The rest is for one
/// unlucky search in many.
const OBSERVED_SHARE: f64 = 0.95;
/// Share of required satellites, over all epochs, that fixes may leave out, in percent: a residual test's
/// false alarms.
const UNUSED_PERCENT: f64 = 5.0;

impl Verdict {
    /// Judges the ionospheric model of the fixes against the settings and the decoded parameters.
    pub(super) fn ionosphere_of_fixes(&mut self, run: &Run) -> Result<(), JudgeError> {
        let setting = |key: &str| run.receiver.pointer(&format!("/settings/position/{key}"));
        let corrected = setting("ionosphere").and_then(serde_json::Value::as_str);
        if matches!(corrected, None | Some("none")) {
            return Ok(());
        }
        let decoded = run.events.iter().find(|row| row.event == Event::IonosphereDecoded).map(|row| row.sample);
        let known = |fix: &Fix| decoded.is_some_and(|since| since <= fix.sample);
        let required = setting("require_ionosphere").and_then(serde_json::Value::as_bool) == Some(true);
        let wrong = |fix: &Fix| match fix.ionosphere {
            IonosphereModel::None => true,
            IonosphereModel::Nominal => required || known(fix),
            IonosphereModel::Broadcast => !known(fix) || matches!(corrected, Some("nequick_g" | "bdgim")),
            IonosphereModel::NequickG => !known(fix) || matches!(corrected, Some("klobuchar" | "bdgim")),
            IonosphereModel::Bdgim => !known(fix) || matches!(corrected, Some("klobuchar" | "nequick_g")),
            IonosphereModel::Combined => corrected != Some("combined"),
            IonosphereModel::Grid => setting("sbas").and_then(serde_json::Value::as_str) == Some("none"),
        };
        let mut count: usize = 0;
        run.fixes.each(|fix| count += usize::from(wrong(&fix)))?;
        let source = "decoded parameters are used from their event on, and none before";
        self.judge("fixes whose word on the ionosphere is impossible", "", count, "", Bound::Max(0.0), source);
        Ok(())
    }

    pub(super) fn reception(&mut self, summary: &Summary) {
        let (satellites, navigation) = (&summary.satellites, &summary.navigation);
        self.judge(
            "false acquisitions",
            "satellites.false_acquired",
            satellites.false_acquired,
            "",
            Bound::Max(0.0),
            "the scene has no such satellite",
        );
        if navigation.parameters_checked > 0 {
            self.judge(
                "wrong navigation parameters",
                "navigation.parameters_wrong",
                navigation.parameters_wrong,
                "",
                Bound::Max(0.0),
                "what was sent",
            );
        } else {
            self.not_judged.push("navigation parameters: none decoded".to_owned());
        }
    }

    /// Satellites that the scene requires, against the receiver's own searches and observations.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub(super) fn satellites(&mut self, run: &Run, expected: &Expectations) -> Result<(), JudgeError> {
        if run.truth.is_empty() && run.scene.expect.fix(0.0) != Some(Fixes::None) {
            let source = "a scene without a signal proves nothing; [expect] fix = \"none\" says that it is meant";
            self.judge("satellites in view", "", 0.0, "", Bound::Min(1.0), source);
        }
        let seen = Seen::of(run);
        let must = |of: fn(&Satellite) -> bool| expected.satellites.iter().filter(move |(_, one)| of(one));
        let found = must(|one| one.acquired_by_s.is_some()).count();
        let missing: Vec<(&Link, &Satellite)> =
            must(|one| one.acquired_by_s.is_some()).filter(|(link, _)| !seen.acquired_s.contains_key(*link)).collect();
        if found > 0 {
            let source = format!("{found} in view are strong enough to be found with certainty in their time");
            let lines = missing.iter().map(|(link, one)| never_found(link, one, expected)).collect();
            self.judge("satellites in view never acquired", "", missing.len(), "", Bound::Max(0.0), &source);
            self.explain(lines);
        }
        self.observed(expected, |link, one| seen.why_unobserved(link, one));
        self.used(run, expected, &seen)?;
        let excused: Vec<String> = must(|one| one.acquired_by_s.is_none() && one.excuse.is_some())
            .filter_map(|(link, one)| Some(format!("{} ({})", link.sv, one.excuse?.word())))
            .collect();
        if !excused.is_empty() {
            self.not_judged.push(format!("satellites not required: {}", excused.join(", ")));
        }
        Ok(())
    }

    /// Satellites that must be observed; `why` says what became of one that is not.
    pub(crate) fn observed(&mut self, expected: &Expectations, why: impl Fn(&Link, &Satellite) -> String) {
        let due: Vec<(&Link, &Satellite)> = expected.satellites.iter().filter(|(_, one)| one.due > 0).collect();
        if due.is_empty() {
            self.not_judged.push("observations: no satellite is in view long enough to be due".to_owned());
            return;
        }
        let little: Vec<&(&Link, &Satellite)> = due.iter().filter(|(_, one)| one.share() < OBSERVED_SHARE).collect();
        let line = |(link, one): &&(&Link, &Satellite)| {
            let percent = 100.0 * one.share();
            format!("{}: {} of {} epochs ({percent:.0} %): {}", link.sv, one.observed, one.due, why(link, one))
        };
        let lines = little.iter().map(line).collect();
        let source = format!("{} must be observed over {:.0} % of their time", due.len(), 100.0 * OBSERVED_SHARE);
        self.judge("satellites observed too little", "", little.len(), "", Bound::Max(0.0), &source);
        self.explain(lines);
    }

    fn used(&mut self, run: &Run, expected: &Expectations, seen: &Seen) -> Result<(), JudgeError> {
        let mut fixes = run.fixes.finder()?;
        let (mut due, mut lacking) = (0_u64, 0_u64);
        let mut left_out: BTreeMap<String, usize> = BTreeMap::new();
        for epoch in expected.epochs.iter().filter(|epoch| epoch.used > 0) {
            let Some(fix) = fixes.get(epoch.sample) else { continue };
            due += u64::from(epoch.used);
            let excluded = fix.excluded.split_whitespace();
            // Where the scene expects any errors the residual test has a reason.
            let blameless = if run.scene.expect.bounded(epoch.time_s) { 0 } else { excluded.clone().count() as u32 };
            lacking += u64::from(epoch.used.saturating_sub(fix.satellites + blameless));
            excluded.for_each(|name| *left_out.entry(name.to_owned()).or_default() += 1);
        }
        if due == 0 {
            return Ok(());
        }
        let mut lines: Vec<String> =
            left_out.iter().map(|(name, count)| format!("{name}: excluded from {count} fixes")).collect();
        for (link, one) in expected.satellites.iter().filter(|(_, one)| one.used_due > 0) {
            if !seen.ephemerides.contains(&link.sv) {
                lines.push(format!(
                    "{}: no ephemeris in {:.1} s that were due",
                    link.sv,
                    one.used_due as f64 * expected.receiver.interval_s
                ));
            }
        }
        let percent = 100.0 * lacking as f64 / due as f64;
        let source = "healthy, above the receiver's mask, with an ephemeris that has been sent";
        self.judge("required satellites left out of fixes", "", percent, "%", Bound::Max(UNUSED_PERCENT), source);
        self.explain(if percent > 0.0 { lines } else { Vec::new() });
        Ok(())
    }
}

/// Events that observation depends on.
const FRAME: u8 = 1;
const SYMBOLS: u8 = 2;

/// Reception of the satellites by the receiver's tables.
#[derive(Default)]
struct Seen {
    acquired_s: BTreeMap<Link, f64>,
    /// Ephemerides are a satellite's, whichever of its signals brings them; the rest is of a signal.
    ephemerides: BTreeSet<Sv>,
    events: BTreeSet<(Link, u8)>,
    lost_s: BTreeMap<Link, Vec<f64>>,
}

impl Seen {
    fn of(run: &Run) -> Self {
        let mut seen = Self::default();
        for row in run.acquisition.iter().filter(|row| row.acquired) {
            let at_s = run.time_s(row.sample);
            let first_s = seen.acquired_s.entry(row.link()).or_insert(at_s);
            *first_s = first_s.min(at_s);
        }
        for row in &run.events {
            match row.event {
                Event::EphemerisComplete => seen.ephemerides.insert(row.sv),
                Event::FrameSynchronised => seen.events.insert((row.link(), FRAME)),
                Event::BitSynchronised => seen.events.insert((row.link(), SYMBOLS)),
                Event::LossOfLock => {
                    seen.lost_s.entry(row.link()).or_default().push(run.time_s(row.sample));
                    true
                }
                _ => true,
            };
        }
        seen
    }

    fn why_unobserved(&self, link: &Link, one: &Satellite) -> String {
        let Some(acquired_s) = self.acquired_s.get(link) else { return "never acquired".to_owned() };
        let mut text = format!("acquired at {acquired_s:.1} s");
        if let Some(lost_s) = self.lost_s.get(link) {
            let times: Vec<String> = lost_s.iter().take(3).map(|at_s| format!("{at_s:.1}")).collect();
            let more = if lost_s.len() > 3 { ", …" } else { "" };
            text += &format!(", lost at {}{more} s", times.join(", "));
        } else if one.observed == 0 && !self.events.contains(&(*link, SYMBOLS)) {
            text += ", no symbols";
        } else if one.observed == 0 && !self.events.contains(&(*link, FRAME)) {
            text += ", no frame of the message";
        }
        if let Some((from_s, to_s)) = one.missing_s {
            text += &format!(", missing between {from_s:.1} and {to_s:.1} s");
        }
        text
    }
}

fn never_found(link: &Link, one: &Satellite, expected: &Expectations) -> String {
    let by_s = one.acquired_by_s.unwrap_or(0.0);
    let mut text = format!("{}: {:.1} dB-Hz, due by {by_s:.1} s", link.sv, one.usual_dbhz);
    if let Some(most_hz) = expected.receiver.doppler_max_hz.filter(|most_hz| one.doppler_hz > *most_hz) {
        text += &format!(
            "; its Doppler reaches {:.0} Hz, the search {most_hz:.0} Hz: raise acquisition.doppler_max_hz",
            one.doppler_hz
        );
    }
    text
}

/// True if an augmentation system sent corrections, and the receiver has decoded some and may use them.
pub(super) fn is_augmented(run: &Run) -> bool {
    let choice = run.receiver.pointer("/settings/position/sbas").and_then(serde_json::Value::as_str);
    let corrects = |rows: &[NavigationRow]| rows.iter().any(|row| row.parameter == "prc_1_m");
    choice.is_some_and(|choice| choice != "none") && corrects(&run.truth_navigation) && corrects(&run.navigation)
}
