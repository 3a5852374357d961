//! Cycle slips and losses of lock, each with its time, its size and what the truth says of its cause.
//!
//! A slip is a change of the constant between measured and true carrier: declared by the receiver's events,
//! or found against the truth and not declared. Its size is the difference of the medians around it, to the
//! half cycle of a Costas loop; where the count began again (another lock) it has none. The cause is the
//! first of these that the half second before it shows: the signal is not there or fell by [`FADE_DB`];
//! interference takes [`JAMMED_DB`] and leaves less than the loop needs; the true motion leaves a phase error
//! of which 3σ + θ > 45° (the loop of the receiver's settings, `expect::loops`); the oscillator's noise or
//! all noise alone breaks that rule. What is left is unexplained. Limits: causes are those that the truth's
//! rows, a tenth of a second apart, can show.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::loops::{self, update_s};
use crate::expect::multiple_access::MultipleAccess;
use crate::expect::stated::Stated;
use crate::expect::theory::pll;
use crate::measure::errors::{Errors, Link, SLIP_CYCLES, SignalError, first_jump_of};
use crate::measure::jitter::{Settings, motion_error_deg};
use crate::read::Run;
use crate::statistics::median;
use gnss::record::Event;

/// A fall of the true C/N0 against its median over the run that counts as an obstruction or a fade.
pub const FADE_DB: f64 = 6.0;
/// Loss of C/N0 by interference in decibels from which on it counts as a cause.
pub const JAMMED_DB: f64 = 3.0;
/// Time before a break in which a cause is sought, seconds.
const BEFORE_S: f64 = 0.5;
/// Time by which a cause may lie before the declaration of a break, seconds.
pub fn noticed_s(run: &Run) -> f64 {
    BEFORE_S + run.tracking_setting("loss_s").unwrap_or(0.0)
}

/// Rows on either side that fix the constant.
const SIDE: usize = 10;

/// Kind of break.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The count jumps and goes on.
    CycleSlip,
    /// The channel gives the signal up.
    LossOfLock,
}

/// Cause of a break.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The truth has no such satellite: a false lock ended.
    NotThere,
    /// The signal was blocked or faded.
    Obstruction,
    /// Interference was strong enough.
    Interference,
    /// The motion was too fast for the loop.
    Dynamics,
    /// The oscillator moves too much for the loop.
    Oscillator,
    /// Too little C/N0 for the loop.
    WeakSignal,
    /// Nothing in the truth explains it.
    Unexplained,
}

impl Cause {
    /// Every cause.
    pub const ALL: [Self; 7] = [
        Self::NotThere,
        Self::Obstruction,
        Self::Interference,
        Self::Dynamics,
        Self::Oscillator,
        Self::WeakSignal,
        Self::Unexplained,
    ];
}

/// A row of `slips.csv`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slip {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// The satellite.
    pub sv: String,
    /// Name of the signal.
    pub signal: &'static str,
    /// Slip or loss.
    pub kind: Kind,
    /// True if the receiver declared the break.
    pub declared: bool,
    /// Change of the carrier's constant, to the half cycle.
    pub size_cycles: Option<f64>,
    /// Remainder of the size after rounding to the half cycle, cycles.
    pub remainder_cycles: Option<f64>,
    /// Cause that the truth shows.
    pub cause: Cause,
    /// The evidence: least C/N0 that the scene allowed, what interference took of it, largest error that the
    /// motion leaves in the phase loop, and 3σ of its noise at that C/N0, the oscillator's with it.
    pub cn0_dbhz: Option<f64>,
    /// Loss of C/N0 by interference, dB.
    pub interference_db: Option<f64>,
    /// Error that the motion leaves in the phase loop, degrees.
    pub motion_deg: Option<f64>,
    /// Three standard deviations of the loop's noise, degrees.
    pub noise_3sigma_deg: Option<f64>,
}

/// The first line of `slips.csv`, which is there without slips too.
pub(crate) const COLUMNS: &str = "sample,time_s,sv,signal,kind,declared,size_cycles,remainder_cycles,\
     cause,cn0_dbhz,interference_db,motion_deg,noise_3sigma_deg\n";

/// All slips and losses of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slips {
    /// All, in the order of time.
    pub rows: Vec<Slip>,
}

impl Slips {
    /// Finds them.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn find(run: &Run, errors: &Errors) -> Result<Self, JudgeError> {
        let evidence = Evidence::new(run);
        let lost = run.events.iter().filter(|row| row.event == Event::LossOfLock);
        let links: BTreeSet<Link> = errors.signals.keys().chain(lost.map(|row| row.link())).collect();
        let mut rows = Vec::new();
        for link in links {
            let found = breaks(run, link, &errors.signals.map(link, |row| Carrier::of(&row))?);
            if found.is_empty() {
                continue;
            }
            let known = Known::of(&evidence, link, &found)?;
            rows.extend(found.iter().map(|one| evidence.slip(link, one, known.as_ref())));
        }
        rows.sort_by(|a, b| (a.sample, &a.sv).cmp(&(b.sample, &b.sv)));
        Ok(Self { rows })
    }

    /// Number of slips for each cause.
    pub fn causes(&self) -> BTreeMap<Cause, usize> {
        let mut counts: BTreeMap<Cause, usize> = Cause::ALL.into_iter().map(|cause| (cause, 0)).collect();
        for row in &self.rows {
            *counts.entry(row.cause).or_insert(0) += 1;
        }
        counts
    }
}

/// A slip or a loss whose cause is not known yet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Break {
    sample: u64,
    kind: Kind,
    declared: bool,
    size_cycles: Option<f64>,
}

/// Data of an observation for the search for slips.
#[derive(Clone, Copy)]
struct Carrier {
    sample: u64,
    raw_cycles: f64,
    locked_s: f64,
}

impl Carrier {
    fn of(row: &SignalError) -> Self {
        Self { sample: row.sample, raw_cycles: row.raw_cycles, locked_s: row.locked_s }
    }
}

/// Losses of lock, then slips: those of the events, and those that the errors show.
fn breaks(run: &Run, link: Link, all: &[Carrier]) -> Vec<Break> {
    let of = |event: Event| {
        let own = run.events.iter().filter(move |row| row.link() == link && row.event == event);
        own.map(|row| row.sample)
    };
    let loss = |sample| Break { sample, kind: Kind::LossOfLock, declared: true, size_cycles: None };
    let mut found: Vec<Break> = of(Event::LossOfLock).map(loss).collect();
    let Some(first) = all.first().map(|row| row.sample) else { return found };
    let lost: Vec<u64> = of(Event::LossOfLock).filter(|sample| *sample > first).collect();
    let declared: Vec<u64> = of(Event::CycleSlip).filter(|sample| *sample > first).collect();
    let slip = |sample, declared, size_cycles| Break { sample, kind: Kind::CycleSlip, declared, size_cycles };
    found.extend(declared.iter().map(|&sample| slip(sample, true, size_across(all, sample, &lost))));
    found.extend(undeclared(all, &declared).into_iter().map(|(sample, size)| slip(sample, false, Some(size))));
    found
}

/// Difference of the carrier's constants on either side of a declared slip; `None` where a lock was lost in
/// between or a side has no rows.
fn size_across(all: &[Carrier], sample: u64, lost: &[u64]) -> Option<f64> {
    let at = all.partition_point(|row| row.sample < sample);
    let (before, after) = all.split_at(at);
    // The first rows after an interruption come when the carrier is locked again.
    let (last, next) = (before.last()?, after.first()?);
    if lost.iter().any(|lost| (last.sample..=next.sample).contains(lost)) {
        return None;
    }
    let carriers = |rows: &[Carrier]| median(&rows.iter().map(|row| row.raw_cycles).collect::<Vec<_>>());
    let before = carriers(&before[before.len().saturating_sub(SIDE)..])?;
    let after = carriers(&after[..after.len().min(SIDE)])?;
    Some(after - before)
}

/// Samples and sizes of jumps that the receiver did not declare.
fn undeclared(all: &[Carrier], declared: &[u64]) -> Vec<(u64, f64)> {
    let broken = |a: &Carrier, b: &Carrier| {
        b.locked_s < a.locked_s || declared.iter().any(|slip| (a.sample + 1..=b.sample).contains(slip))
    };
    let mut found = Vec::new();
    for arc in all.chunk_by(|a, b| !broken(a, b)) {
        let mut rest = arc;
        loop {
            let carrier: Vec<f64> = rest.iter().map(|row| row.raw_cycles).collect();
            let Some(jump) = first_jump_of(&carrier) else { break };
            let (before, after) = carrier.split_at(jump);
            let side =
                median(&before[before.len().saturating_sub(SIDE)..]).zip(median(&after[..after.len().min(SIDE)]));
            let (Some((before, after)), Some(row)) = (side, rest.get(jump)) else { break };
            if (after - before).abs() >= SLIP_CYCLES {
                found.push((row.sample, after - before));
            }
            rest = &rest[jump..];
        }
    }
    found
}

/// Evidence from the truth of a run.
struct Evidence<'r> {
    run: &'r Run,
    access: MultipleAccess<'r>,
    stated: Stated,
    settings: Option<Settings>,
    least_dbhz: f64,
    interval_s: f64,
    last: u64,
}

/// A satellite's strength at a sample.
struct Strength {
    sample: u64,
    cn0_dbhz: f64,
    effective_dbhz: f64,
}

/// Evidence about one satellite.
struct Known {
    rows: Vec<Strength>,
    usual_dbhz: f64,
    motion_deg: Vec<(f64, f64)>,
}

impl Known {
    /// `None` of a satellite that the truth does not have.
    fn of(evidence: &Evidence<'_>, link: Link, found: &[Break]) -> Result<Option<Self>, JudgeError> {
        let run = evidence.run;
        let rows = run.truth.map(link, |row| Strength {
            sample: row.sample,
            cn0_dbhz: row.cn0_dbhz,
            effective_dbhz: evidence.access.effective_dbhz(&row),
        })?;
        let Some(usual_dbhz) = median(&rows.iter().map(|row| row.cn0_dbhz).collect::<Vec<_>>()) else {
            return Ok(None);
        };
        let motion_deg = match evidence.settings.zip(update_s(run, link)) {
            Some(choice) => motion_error_deg(run, link, choice, |at_s| {
                found.iter().any(|one| evidence.before_s(run.time_s(one.sample)).contains(&at_s))
            })?,
            None => Vec::new(),
        };
        Ok(Some(Self { rows, usual_dbhz, motion_deg }))
    }
}

impl<'r> Evidence<'r> {
    fn new(run: &'r Run) -> Self {
        Self {
            run,
            access: MultipleAccess::new(run),
            stated: Stated::of(run),
            settings: Settings::of(run),
            least_dbhz: run.tracking_setting("cn0_threshold_dbhz").unwrap_or(f64::NEG_INFINITY),
            interval_s: run.truth_interval_s(),
            last: run.trajectory.last().map_or(0, |row| row.sample),
        }
    }

    /// Times at which the cause of what happened at a time is looked for: the channel notices after its own
    /// loss time.
    fn before_s(&self, time_s: f64) -> RangeInclusive<f64> {
        time_s - noticed_s(self.run)..=time_s
    }

    fn slip(&self, link: Link, found: &Break, known: Option<&Known>) -> Slip {
        let (run, sample) = (self.run, found.sample);
        let time_s = run.time_s(sample);
        let rounded = found.size_cycles.map(|size| (2.0 * size).round() / 2.0);
        let mut slip = Slip {
            sample,
            time_s,
            sv: link.sv.to_string(),
            signal: link.signal.name,
            kind: found.kind,
            declared: found.declared,
            size_cycles: rounded,
            remainder_cycles: found.size_cycles.zip(rounded).map(|(size, rounded)| size - rounded),
            cause: Cause::Unexplained,
            cn0_dbhz: None,
            interference_db: None,
            motion_deg: None,
            noise_3sigma_deg: None,
        };
        let Some(Known { rows, usual_dbhz, motion_deg }) = known else {
            slip.cause = Cause::NotThere;
            return slip;
        };
        let before_s = self.before_s(time_s);
        let within = |at: u64| before_s.contains(&run.time_s(at));
        let near = rows.iter().filter(|row| within(row.sample));
        let near: Vec<(f64, f64)> = near.map(|row| (row.cn0_dbhz, row.effective_dbhz)).collect();
        slip.cn0_dbhz = near.iter().map(|(_, effective_dbhz)| *effective_dbhz).reduce(f64::min);
        let set_dbhz = near.iter().map(|(cn0_dbhz, _)| *cn0_dbhz).reduce(f64::min);
        slip.interference_db = near.iter().map(|(cn0_dbhz, effective_dbhz)| cn0_dbhz - effective_dbhz).reduce(f64::max);
        let inside = motion_deg.iter().filter(|(t_s, _)| before_s.contains(t_s));
        slip.motion_deg = inside.map(|(_, error)| error.abs()).reduce(f64::max);
        let carrier = self.settings.map(|_| loops::Carrier::in_run(run, link.signal));
        let three_deg = |rad: f64| 3.0 * rad.to_degrees();
        slip.noise_3sigma_deg = slip.cn0_dbhz.zip(carrier).map(|(dbhz, carrier)| {
            let stated_dbhz = self.stated.expected_dbhz(link, dbhz);
            three_deg(carrier.jitter_rad(libm::pow(10.0, 0.1 * stated_dbhz)))
        });
        // No row within an interval and a half before: it has set, or something obstructs it.
        let before = rows.iter().rev().find(|row| row.sample <= sample);
        let absent = before.is_none_or(|row| time_s - run.time_s(row.sample) > 1.5 * self.interval_s);
        let gone = (near.len() < 2 || absent) && sample < self.last;
        let limit_deg = pll::LIMIT_RAD.to_degrees();
        let noise_deg = slip.noise_3sigma_deg.unwrap_or(0.0);
        let weak = noise_deg > limit_deg || slip.cn0_dbhz.is_some_and(|dbhz| dbhz < self.least_dbhz);
        slip.cause = if gone || set_dbhz.is_some_and(|dbhz| dbhz < usual_dbhz - FADE_DB) {
            Cause::Obstruction
        } else if weak && slip.interference_db.is_some_and(|db| db > JAMMED_DB) {
            Cause::Interference
        } else if slip.motion_deg.is_some_and(|motion| motion + noise_deg > limit_deg && motion > 0.5 * noise_deg) {
            Cause::Dynamics
        } else if carrier.is_some_and(|carrier| three_deg(carrier.oscillator_rad()) > limit_deg) {
            Cause::Oscillator
        } else if weak {
            Cause::WeakSignal
        } else {
            Cause::Unexplained
        };
        slip
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::errors::tests::arc;

    #[test]
    fn sizes_are_those_of_the_steps_and_what_is_declared_is_found_once() {
        let carrier: Vec<f64> =
            (0..60).map(|k| 7.3 + if k >= 20 { 0.5 } else { 0.0 } + if k >= 40 { -1.0 } else { 0.0 }).collect();
        let all: Vec<Carrier> = arc(&carrier).iter().map(Carrier::of).collect();
        let found = undeclared(&all, &[]);
        assert_eq!(found.iter().map(|slip| slip.0).collect::<Vec<_>>(), vec![2000, 4000]);
        assert!((found[0].1 - 0.5).abs() < 1e-12 && (found[1].1 + 1.0).abs() < 1e-12, "{found:?}");
        assert_eq!(undeclared(&all, &[1950]).len(), 1);
        assert!((size_across(&all, 1950, &[]).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(size_across(&all, 1950, &[1950]), None);
        assert_eq!(size_across(&all, 0, &[]), None);
    }

    #[test]
    fn the_file_has_its_columns_with_and_without_rows() {
        let run = tempfile::tempdir().unwrap();
        let slip = Slip {
            sample: 1,
            time_s: 0.1,
            sv: "G05".to_owned(),
            signal: "GPS L1 C/A",
            kind: Kind::LossOfLock,
            declared: true,
            size_cycles: None,
            remainder_cycles: None,
            cause: Cause::WeakSignal,
            cn0_dbhz: None,
            interference_db: None,
            motion_deg: None,
            noise_3sigma_deg: None,
        };
        for rows in [vec![slip], Vec::new()] {
            let lines = 1 + rows.len();
            crate::show::tables::write_slips(run.path(), &Slips { rows }).unwrap();
            let text = std::fs::read_to_string(run.path().join("slips.csv")).unwrap();
            assert!(text.starts_with(COLUMNS) && text.lines().count() == lines, "{text}");
        }
    }
}
