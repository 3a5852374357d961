//! Fixes that the receiver's own tables allow: where it observes satellites whose orbits it says it knows, it
//! must give a position, whenever the message's timetable would make one due.
//!
//! Limits: satellites with a fault or an alert are not counted; fixes of receivers that must have the
//! ionosphere's parameters are due from the event on that says they are decoded.

use std::collections::BTreeMap;

use crate::error::JudgeError;
use crate::expect::authenticated::Required;
use crate::expect::due::receiver::Receiver;
use crate::expect::due::satellite::LOCK_S;
use crate::expect::due::{Due, LARGEST_PDOP};
use crate::judge::forecast::heard::Heard;
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use crate::read::spill_store::{Cursor, Finder};
use gnss::facts::Fixes;
use gnss::record::{Event, Observation, SkyRow};
use gnss::satellite::Sv;
use gnss::signal::Link;

/// Share of the epochs that may be without a fix, in percent; where the scene expects errors of any size, for
/// which a receiver's residual test may refuse a fix; and where it expects fixes or none.
const LACKING_PERCENT: [f64; 3] = [1.0, 50.0, 90.0];
/// Elevation above the receiver's mask from which on a satellite is surely used, degrees.
const ABOVE_DEG: f64 = 0.5;
/// Time that half cycles, residual tests and the solution may take.
const SETTLED_S: f64 = LOCK_S + 1.0;

/// One signal's observations beside its satellite's position in the sky.
struct Seen<'r> {
    link: Link,
    rows: std::iter::Peekable<Cursor<'r, Link, Observation>>,
    sky: Option<Finder<'r, Link, SkyRow>>,
}

impl Verdict {
    /// Epochs at which the receiver observes what a fix needs and gives none.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub(super) fn own_fixes(&mut self, run: &Run, receiver: &Receiver) -> Result<(), JudgeError> {
        let heard = Heard::of(run);
        let faulty = |sv: Sv| {
            run.scene.faults.iter().any(|fault| fault.satellites.as_ref().is_none_or(|list| list.contains(&sv)))
        };
        let rate_hz = run.scene.sample_rate_hz;
        let decoded = run.events.iter().find(|row| row.event == Event::IonosphereDecoded).map(|row| row.sample);
        let ionosphere = if receiver.requires_ionosphere { decoded.unwrap_or(u64::MAX) } else { 0 };
        let mut all = Vec::new();
        let required = Required::of(run, LOCK_S);
        let from_s = required.as_ref().map_or(0.0, |required| required.from_s);
        let serves = |link: &Link| required.as_ref().is_none_or(|required| required.serves(*link));
        for link in run.observations.keys().filter(|link| !faulty(link.sv) && serves(link)) {
            let sky = run.seen_at(link.sv)?;
            all.push(Seen { link, rows: run.observations.cursor(link).peekable(), sky });
        }
        let mut fixes = run.fixes.finder()?;
        let (mut since, mut tallies): (Option<u64>, [Tally; 3]) = (None, Default::default());
        while let Some(sample) = next(&mut all) {
            // Clocks of other systems are more unknowns: any one system must do.
            let mut systems: BTreeMap<&str, Due> = BTreeMap::new();
            let mut used: Vec<Sv> = Vec::new();
            for seen in &mut all {
                let row = seen.rows.next_if(|row| row.as_ref().map_or(true, |row| row.sample <= sample));
                let (Some(row), link) = (row.transpose()?, seen.link) else { continue };
                let sky = seen.sky.as_mut().and_then(|sky| sky.get(row.sample));
                let above = sky.filter(|sky| sky.elevation_deg > receiver.mask_deg + ABOVE_DEG);
                if let Some(sky) = above.filter(|_| !used.contains(&link.sv) && heard.usable(link, sample)) {
                    used.push(link.sv);
                    let system = systems.entry(link.signal.time.name).or_default();
                    system.add(sky.azimuth_deg.to_radians(), sky.elevation_deg.to_radians());
                }
            }
            let time_s = run.time_s(sample);
            let expected = run.scene.expect.fix(time_s);
            let enough = systems.values().any(|system| system.pdop() <= LARGEST_PDOP);
            let enough = enough && sample >= ionosphere && time_s >= from_s;
            if expected == Some(Fixes::None) || !enough {
                since = None;
                continue;
            }
            let began = *since.get_or_insert(sample);
            if sample - began < ((SETTLED_S + receiver.ionosphere_wait_s) * rate_hz) as u64 {
                continue;
            }
            let [due, large, any] = &mut tallies;
            let tally = match expected {
                Some(Fixes::Any) => any,
                _ if run.scene.expect.bounded(time_s) => due,
                _ => large,
            };
            tally.take(time_s, fixes.get(sample).is_some());
        }
        let whereof = ["", ", where errors of any size are expected", ", where the scene asks for none"];
        for ((tally, words), limit) in tallies.iter().zip(whereof).zip(LACKING_PERCENT) {
            if tally.due == 0 {
                continue;
            }
            let Tally { due, lacking, ends_s } = tally;
            let source =
                format!("{due} epochs have four satellites of one system observed, above the mask, with their orbits");
            let percent = 100.0 * *lacking as f64 / *due as f64;
            let figure = format!("epochs without a fix that its own observations allow{words}");
            self.judge(&figure, "", percent, "%", Bound::Max(limit), &source);
            if let Some((first_s, last_s)) = ends_s {
                self.explain(vec![format!("{lacking} epochs between {first_s:.1} and {last_s:.1} s")]);
            }
        }
        Ok(())
    }
}

/// Epochs at which a fix is due, those without, and when the first and the last of these are.
#[derive(Default)]
struct Tally {
    due: u64,
    lacking: u64,
    ends_s: Option<(f64, f64)>,
}

impl Tally {
    fn take(&mut self, time_s: f64, came: bool) {
        self.due += 1;
        if !came {
            self.lacking += 1;
            self.ends_s = Some((self.ends_s.map_or(time_s, |(first_s, _)| first_s), time_s));
        }
    }
}

/// The earliest sample that is not seen yet.
fn next(all: &mut [Seen<'_>]) -> Option<u64> {
    // One that cannot be read is looked at next, so that it is told.
    all.iter_mut().filter_map(|seen| Some(seen.rows.peek()?.as_ref().map_or(0, |row| row.sample))).min()
}
