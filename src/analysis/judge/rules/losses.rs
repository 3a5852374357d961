//! Losses of lock and cycle slips: each is excused for its own satellite in its own moment, or counted.

use crate::error::JudgeError;
use crate::expect::due::receiver::Receiver;
use crate::expect::due::satellite::{Excuse, SatelliteEpoch, Scene};
use crate::expect::due::timetable::Timetable;
use crate::expect::multiple_access::MultipleAccess;
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::measure::slips::{Kind, Slip, Slips};
use crate::read::Run;
use crate::statistics::median;
use gnss::facts::Losses;
use gnss::satellite::Sv;
use gnss::signal::Link;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// The lock detectors' memory: how long before a declared loss or slip the signal may have failed.
pub(super) const LOOK_BACK_S: f64 = 2.0;
/// Losses that are named; the rest is in `slips.csv`.
const NAMED: usize = 12;

impl Verdict {
    /// Judges what [`Slips`] found.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub(super) fn losses(&mut self, run: &Run, receiver: &Receiver, slips: &Slips) -> Result<(), JudgeError> {
        let mut links: Vec<(String, &'static str)> =
            slips.rows.iter().map(|row| (row.sv.clone(), row.signal)).collect();
        links.sort();
        links.dedup();
        let access = MultipleAccess::new(run);
        let mut judged: Vec<(&Slip, Option<Excuse>)> = Vec::new();
        for (sv, signal) in links {
            let (Ok(number), Some(known)) = (sv.parse::<Sv>(), Signal::find(signal)) else { continue };
            let receiver = &receiver.of_signal(known);
            let witness = Witness::new(run, &access, receiver, Link { sv: number, signal: known })?;
            let own = slips.rows.iter().filter(|row| row.sv == sv && row.signal == signal);
            judged.extend(own.map(|row| (row, witness.excuse(run, receiver, number, row))));
        }
        judged.sort_by_key(|(row, _)| row.sample);
        let rows = [
            ("unexpected losses of lock", "", Kind::LossOfLock),
            ("unexpected cycle slips", "tracking.cycle_slips", Kind::CycleSlip),
        ];
        for (figure, path, kind) in rows {
            let own: Vec<&(&Slip, Option<Excuse>)> = judged.iter().filter(|(row, _)| row.kind == kind).collect();
            let wrong: Vec<&Slip> = own.iter().filter(|(_, excuse)| excuse.is_none()).map(|(row, _)| *row).collect();
            let excused = own.len() - wrong.len();
            let more =
                if excused > 0 { format!("; {excused} more have one: {}", reasons(&own)) } else { String::new() };
            let source = format!("none without a reason of the satellite's own at that moment{more}");
            let line = |row: &&Slip| {
                let cn0 = row.cn0_dbhz.map_or(String::new(), |dbhz| format!(", {dbhz:.1} dB-Hz"));
                let size = row.size_cycles.map_or(String::new(), |size| format!(", {size:+.1} cycles"));
                format!("{} at {:.1} s{size}{cn0}", row.sv, row.time_s)
            };
            let mut lines: Vec<String> = wrong.iter().take(NAMED).map(line).collect();
            if wrong.len() > NAMED {
                lines.push(format!("and {} more (slips.csv)", wrong.len() - NAMED));
            }
            self.judge(figure, path, wrong.len(), "", Bound::Max(0.0), &source);
            if excused > 0 {
                self.without(&format!("{excused} with a reason: {}", reasons(&own)));
            }
            self.explain(lines);
        }
        Ok(())
    }
}

fn reasons(own: &[&(&Slip, Option<Excuse>)]) -> String {
    let mut found: Vec<Excuse> = own.iter().filter_map(|(_, excuse)| *excuse).collect();
    found.sort_unstable();
    let counts =
        found.chunk_by(|a, b| a == b).filter_map(|same| Some(format!("{} {}", same.len(), same.first()?.word())));
    counts.collect::<Vec<_>>().join(", ")
}

/// Truth about one satellite.
struct Witness {
    rows: Vec<SatelliteEpoch>,
    usual_dbhz: f64,
    interval_s: f64,
    timetable: Timetable<'static>,
}

impl Witness {
    fn new(run: &Run, access: &MultipleAccess<'_>, receiver: &Receiver, link: Link) -> Result<Self, JudgeError> {
        let mut most_hz = run.cn0_most_hz.finder();
        let rows = run.truth.map(link, |row| SatelliteEpoch {
            time_s: run.time_s(row.sample),
            cn0_dbhz: row.cn0_dbhz,
            effective_dbhz: access.effective_dbhz(&row) - receiver.cost_db,
            strongest_dbhz: Run::strongest_dbhz(&mut most_hz, row.sample, link.signal),
            doppler_hz: row.doppler_hz,
            above_mask: true,
        })?;
        let usual_dbhz = median(&rows.iter().map(|row| row.cn0_dbhz).collect::<Vec<_>>()).unwrap_or(0.0);
        let start = run.trajectory.first().map_or(Epoch::new(0, 0.0), |row| row.time().plus_s(-run.time_s(row.sample)));
        let timetable = Timetable::beside(link.signal, &run.signals, start);
        Ok(Self { rows, usual_dbhz, interval_s: run.truth_interval_s(), timetable })
    }

    /// Excuse for a loss or a slip at a time, if it is not the receiver's fault.
    fn excuse(&self, run: &Run, receiver: &Receiver, sv: Sv, slip: &Slip) -> Option<Excuse> {
        let scene = Scene {
            receiver,
            timetable: self.timetable,
            expect: &run.scene.expect,
            faults: &run.scene.faults,
            interval_s: self.interval_s,
        };
        if run.scene.expect.losses(sv, slip.time_s) == Some(Losses::None) {
            return None;
        }
        let from_s = slip.time_s - LOOK_BACK_S;
        let near: Vec<&SatelliteEpoch> =
            self.rows.iter().filter(|row| (from_s..=slip.time_s).contains(&row.time_s)).collect();
        if let Some(found) = near.iter().find_map(|row| scene.excuse(sv, row, self.usual_dbhz)) {
            return Some(found);
        }
        // A row that is missing at the end, in the middle, or before: the satellite was not there for a
        // while.
        let step_s = 1.5 * self.interval_s;
        let gone = near.windows(2).any(|two| two[1].time_s - two[0].time_s > step_s);
        // The row after counts too: a loss may be declared within an interval of the last one.
        let next_s = self.rows.iter().map(|row| row.time_s).find(|at_s| *at_s > slip.time_s).unwrap_or(f64::INFINITY);
        let until_s = next_s.min(run.trajectory.last().map_or(0.0, |row| run.time_s(row.sample)));
        let last_s = near.last().map_or(f64::NEG_INFINITY, |last| last.time_s);
        let ends = next_s - last_s > step_s && until_s - last_s > step_s;
        let begins = near.first().is_none_or(|first| first.time_s - from_s.max(0.0) > step_s);
        if gone || ends || begins {
            return Some(Excuse::NotThere);
        }
        // Without a frame for so long, a channel gives up what it cannot read.
        let garbled = scene.was_garbled(sv, slip.time_s);
        // The half cycle on which the loop has settled after a step shows in the next unit of the message.
        let stepped = scene.shows_half_cycle(sv, slip.time_s);
        let is_half = slip.kind == Kind::CycleSlip && slip.size_cycles.is_some_and(|cycles| cycles.abs() == 0.5);
        (garbled && slip.kind == Kind::LossOfLock || stepped && is_half).then_some(Excuse::Fault)
    }
}
