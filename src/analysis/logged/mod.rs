//! Judging another receiver by its log as it came out of the device (UBX, RTCM 3, SBF).
//!
//! [`logs`] reads the log. Its observations and positions are judged as those of RINEX and NMEA files are
//! ([`crate::judge::foreign`]), with the digits of the log. [`reported`] compares what these formats do not
//! hold: velocities with their vertical part and the accuracies that the receiver reports. A log of several
//! protocols is judged by one of them, that with the most frames or the one asked for. Limits: messages
//! without a week get the week of the truth.

pub mod reported;

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::JudgeError;
use crate::judge::foreign::{self, Draft, Files, Judgement};
use crate::read::nmea::PlaceFix;
use crate::read::rinex_obs::{ObservedEpoch, Values};
use gnss::time::Epoch;
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
    let mut draft = Draft::new(truth, files)?;
    let (protocol, usable, contents) = read(log, asked, draft.middle())?;
    if !usable.epochs.is_empty() && !draft.has_observations() {
        draft.observe(log, &usable.epochs, None)?;
    }
    let mut reported = None;
    if !usable.fixes.is_empty() {
        let labels: Vec<Epoch> = usable.fixes.iter().map(|fix| fix.label).collect();
        let shift_s = draft.rollover_s(log, &labels)?;
        reported = Some(Reported::new(&usable.fixes, &usable.clocks, &draft.timeline, shift_s));
        if !draft.has_positions() {
            let fixes: Vec<PlaceFix> = usable.fixes.iter().map(place_fix).collect();
            draft.place(log, &fixes, resolution_m(protocol, usable.is_refined))?;
        }
    }
    Ok(Logged { judgement: draft.finish(), protocol, contents, without_fix: usable.without_fix, reported })
}

/// Reads a log and chooses its protocol.
fn read(path: &Path, asked: Option<Protocol>, near: Epoch) -> Result<(Protocol, Usable, Contents), JudgeError> {
    let (file, _) = foreign::opened(path)?;
    let mut log = Log::new(file, Some(near));
    let mut all: BTreeMap<Protocol, Usable> = BTreeMap::new();
    for message in &mut log {
        let message = message.map_err(|source| foreign::unreadable(path, source))?;
        let own = all.entry(message.protocol).or_default();
        match message.event {
            Some(Event::Observations(epoch)) => own.take(epoch),
            Some(Event::Fix(fix)) if own.fixes.last().is_none_or(|before| fix.label.since(before.label) > 0.0) => {
                own.fixes.push(fix);
            }
            Some(Event::Refinement(refinement)) => own.refine(&refinement),
            Some(Event::Clock(reading)) => own.clocks.push(reading),
            Some(Event::NoFix) => own.without_fix += 1,
            Some(Event::Fix(_) | Event::Ephemeris(_) | Event::Undated) | None => {}
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

fn refuse(path: &Path, what: &str) -> JudgeError {
    JudgeError::NotOfThisTruth { path: path.to_owned(), what: what.to_owned() }
}

#[cfg(test)]
mod tests;
