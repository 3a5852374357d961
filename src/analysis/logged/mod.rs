//! Judging another receiver by its log as it came out of the device (UBX, RTCM 3, SBF).
//!
//! [`logs`] reads the log. Its observations and positions are judged as those of RINEX and NMEA files are
//! ([`crate::judge::foreign`]), with the digits of the log. [`reported`] compares what these formats do not
//! hold: velocities with their vertical part and the accuracies that the receiver reports. A log of several
//! protocols is judged by one of them, that with the most frames or the one asked for. Limits: messages
//! without a week get the week of the truth.

pub mod reported;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::Path;

use crate::error::JudgeError;
use crate::expect::due::receiver::front_end_costs_db;
use crate::expect::timeline::Timeline;
use crate::judge::foreign::{self, Files, ForeignSummary, Judged, Judgement, observables, place};
use crate::read::Run;
use crate::read::nmea::PlaceFix;
use crate::read::rinex_obs::{LARGEST_BYTES, ObservedEpoch, Values};
use gnss::time::{Epoch, WEEK_S};
use logs::contents::Contents;
use logs::frames::Protocol;
use logs::log::Log;
use logs::observed::{self, ClockReading, Event, Fix, Refinement};
use reported::Reported;

/// Judgement by a log.
pub struct Logged {
    /// Judgement as of RINEX and NMEA files.
    pub judgement: Judgement,
    /// Protocol that was judged.
    pub protocol: Protocol,
    /// Counts of all that the log holds.
    pub contents: Contents,
    /// Epochs whose message says that there is no fix.
    pub without_fix: usize,
    /// Velocities and reported accuracies, where the log has positions.
    pub reported: Option<Reported>,
}

/// Usable part of one protocol of a log.
#[derive(Default)]
struct Usable {
    epochs: Vec<ObservedEpoch>,
    fixes: Vec<Fix>,
    clocks: Vec<ClockReading>,
    without_fix: usize,
    /// True if a position has the digits of a message of their own.
    is_refined: bool,
}

/// Judges a receiver's log against the truth in a directory. Observations and positions of RINEX and NMEA
/// files, where there are any, go before those of the log.
///
/// # Errors
/// [`JudgeError::NotOfThisTruth`] for a log without usable messages or of another time, and all errors of
/// [`foreign::judge`].
pub fn judge(truth: &Path, log: &Path, asked: Option<Protocol>, files: &Files) -> Result<Logged, JudgeError> {
    let has_files = files.rinex_obs.is_some() || files.nmea.is_some();
    let base = if has_files { Some(foreign::judge(truth, files)?) } else { None };
    let run = match &base {
        Some(_) => None,
        None => Some(Run::read_truth(truth)?),
    };
    let Some(timeline) =
        Timeline::new(base.as_ref().map_or_else(|| run.as_ref(), |base| Some(&base.run)).ok_or_else(|| {
            JudgeError::NotOfThisTruth { path: truth.to_owned(), what: "no truth: expected one".to_owned() }
        })?)?
    else {
        let what = "no rows: expected the antenna's motion".to_owned();
        return Err(JudgeError::NotOfThisTruth { path: truth.join("trajectory.csv"), what });
    };
    let middle = timeline.origin.plus_s(0.5 * timeline.span_s().1);
    let (protocol, usable, contents) = read(log, asked, middle)?;
    let (run, mut judged) = match (base, run) {
        (Some(base), _) => (base.run, base.judged),
        (None, Some(run)) => {
            let judged = without_files(&run, &timeline);
            (run, judged)
        }
        (None, None) => return Err(refuse(log, "no truth: expected one")),
    };
    if !usable.epochs.is_empty() && judged.observables.is_none() {
        let labels: Vec<Epoch> = usable.epochs.iter().map(|epoch| epoch.label).collect();
        judged.rollover_s[0] = rollover_s(log, &labels, &timeline)?;
        let measured = observables::measure(&usable.epochs, &timeline, judged.rollover_s[0], &front_end_costs_db(&run));
        if measured.rows.is_empty() {
            return Err(elsewhere(log, &labels, &timeline));
        }
        judged.observables = Some(measured);
    }
    let mut reported = None;
    if !usable.fixes.is_empty() {
        let labels: Vec<Epoch> = usable.fixes.iter().map(|fix| fix.label).collect();
        let shift_s = rollover_s(log, &labels, &timeline)?;
        reported = Some(Reported::new(&usable.fixes, &usable.clocks, &timeline, shift_s));
        if judged.places.is_none() {
            judged.rollover_s[1] = shift_s;
            let fixes: Vec<PlaceFix> = usable.fixes.iter().map(place_fix).collect();
            let mut measured = place::measure(&fixes, &timeline, shift_s);
            measured.resolution_m = resolution_m(protocol, usable.is_refined);
            if measured.rows.is_empty() {
                return Err(elsewhere(log, &labels, &timeline));
            }
            judged.places = Some(measured);
        }
    }
    let summary = ForeignSummary::new(&judged);
    let judgement = Judgement { run, judged, summary };
    Ok(Logged { judgement, protocol, contents, without_fix: usable.without_fix, reported })
}

/// Judgement before any file.
fn without_files(run: &Run, timeline: &Timeline) -> Judged {
    Judged {
        scene: run.scene.name.clone(),
        receiver: None,
        truth_interval_s: timeline.interval_s(),
        interpolation: timeline.interpolation,
        sampler_drift: run.trajectory.first().map_or(0.0, |row| row.clock_drift),
        rollover_s: [0; 2],
        observables: None,
        places: None,
        labels_late_s: None,
        separations_assumed: 0,
    }
}

/// Reads a log and chooses its protocol.
fn read(path: &Path, asked: Option<Protocol>, near: Epoch) -> Result<(Protocol, Usable, Contents), JudgeError> {
    let failed = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => {
            JudgeError::Missing { path: path.to_owned(), remedy: "it is the log of the receiver under test" }
        }
        _ => JudgeError::Read { path: path.to_owned(), source },
    };
    let about = fs::metadata(path).map_err(failed)?;
    // A pipe or a device has no size, and perhaps no end.
    if !about.is_file() {
        return Err(refuse(path, "is not an ordinary file"));
    }
    if about.len() > LARGEST_BYTES {
        return Err(refuse(path, &format!("{} bytes: expected at most 256 MiB", about.len())));
    }
    let mut log = Log::new(File::open(path).map_err(failed)?, Some(near));
    let mut all: BTreeMap<Protocol, Usable> = BTreeMap::new();
    for message in &mut log {
        let message = message.map_err(failed)?;
        let own = all.entry(message.protocol).or_default();
        match message.event {
            Some(Event::Observations(epoch)) => own.take(epoch),
            Some(Event::Fix(fix)) if own.fixes.last().is_none_or(|before| fix.label.since(before.label) > 0.0) => {
                own.fixes.push(fix);
            }
            Some(Event::Refinement(refinement)) => own.refine(&refinement),
            Some(Event::Clock(reading)) => own.clocks.push(reading),
            Some(Event::NoFix) => own.without_fix += 1,
            Some(Event::Fix(_) | Event::Undated) | None => {}
        }
    }
    let contents = log.contents();
    let protocol = asked.or_else(|| contents.main_protocol());
    let Some(protocol) = protocol.filter(|protocol| contents.count(*protocol).frames > 0) else {
        let wanted = asked.map_or("UBX, RTCM 3 or SBF", Protocol::name);
        let has: Vec<String> = contents
            .protocols
            .iter()
            .map(|(own, count)| format!("{} frames of {}", count.frames, own.name()))
            .collect();
        let has = if has.is_empty() { "none of any protocol".to_owned() } else { has.join(", ") };
        return Err(refuse(path, &format!("no frame of {wanted}, but {has}: expected the log of a receiver")));
    };
    let usable = all.remove(&protocol).unwrap_or_default();
    if usable.epochs.is_empty() && usable.fixes.is_empty() {
        let needed = logs::log::needed(protocol);
        let without = match usable.without_fix {
            0 => String::new(),
            count => format!(", where {count} say that there is no fix"),
        };
        let has = contents.messages_of(protocol);
        let what = format!("{} with nothing to judge: it has {has}{without}; expected {needed}", protocol.name());
        return Err(refuse(path, &what));
    }
    Ok((protocol, usable, contents))
}

impl Usable {
    /// Adds an epoch, whose values belong to the last one where several messages share a time. An epoch that
    /// does not come after the one before is left out.
    fn take(&mut self, epoch: observed::ObservedEpoch) {
        let since_s = self.epochs.last().map_or(f64::INFINITY, |before| epoch.label.since(before.label));
        let values = epoch.values.into_iter().map(|value| ((value.sv, value.code.to_owned()), values(&value)));
        match self.epochs.last_mut() {
            Some(last) if since_s == 0.0 => last.values.extend(values),
            _ if since_s > 0.0 => self.epochs.push(ObservedEpoch { label: epoch.label, values: values.collect() }),
            _ => {}
        }
    }

    /// Gives the last position its further digits, if they are of the same time.
    fn refine(&mut self, refinement: &Refinement) {
        let same = |fix: &&mut Fix| fix.label.since(refinement.label).abs() < reported::SAME_S;
        if let Some(fix) = self.fixes.last_mut().filter(same) {
            fix.position_m = refinement.position_m;
            self.is_refined = true;
        }
    }
}

fn values(value: &observed::Observed) -> Values {
    Values {
        pseudorange_m: value.pseudorange_m,
        carrier_cycles: value.carrier_cycles,
        lost_lock: value.lost_lock,
        half_cycle_ambiguous: value.half_cycle_ambiguous,
        doppler_hz: value.doppler_hz,
        cn0_dbhz: value.cn0_dbhz,
    }
}

fn place_fix(fix: &Fix) -> PlaceFix {
    let ground = fix.velocity_enu_mps.map(|[east, north, _]| (libm::hypot(east, north), libm::atan2(east, north)));
    PlaceFix { label: fix.label, position_m: fix.position_m, satellites: fix.satellites, ground_mps_rad: ground }
}

/// Smallest step of a latitude in a protocol's positions, metres.
fn resolution_m(protocol: Protocol, is_refined: bool) -> f64 {
    // A minute of latitude is a nautical mile.
    let degree_m = 60.0 * 1852.0;
    match protocol {
        Protocol::Ubx if is_refined => 1e-9 * degree_m,
        Protocol::Ubx => 1e-7 * degree_m,
        _ => 0.0,
    }
}

/// Seconds, a multiple of 1024 weeks, by which labels lie ahead of the truth.
fn rollover_s(path: &Path, labels: &[Epoch], timeline: &Timeline) -> Result<i64, JudgeError> {
    const PERIOD_S: i64 = 1024 * WEEK_S;
    const NEAR_S: f64 = 86_400.0;
    let (from_s, to_s) = timeline.span_s();
    let first_s = labels.first().map_or(0.0, |first| first.since(timeline.origin));
    let shift_s = (first_s / PERIOD_S as f64).round() as i64 * PERIOD_S;
    let near =
        |label: &Epoch| (from_s - NEAR_S..=to_s + NEAR_S).contains(&(label.since(timeline.origin) - shift_s as f64));
    if labels.iter().any(near) { Ok(shift_s) } else { Err(elsewhere(path, labels, timeline)) }
}

fn elsewhere(path: &Path, labels: &[Epoch], timeline: &Timeline) -> JudgeError {
    let (from_s, to_s) = timeline.span_s();
    let [from, to] = [from_s, to_s].map(|t_s| timeline.origin.plus_s(t_s));
    let own = labels.first().zip(labels.last());
    let own = own.map_or("nothing".to_owned(), |(first, last)| format!("{first} to {last}"));
    let what = format!("epochs from {own} of GPS time have no truth: expected epochs from {from} to {to}");
    refuse(path, &what)
}

fn refuse(path: &Path, what: &str) -> JudgeError {
    JudgeError::NotOfThisTruth { path: path.to_owned(), what: what.to_owned() }
}

#[cfg(test)]
mod tests;
