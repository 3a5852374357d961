//! Requirements of a scene on its receiver, epoch by epoch: satellites to find, observe and use, and times of
//! fixes.
//!
//! They follow from the truth (satellites in view, their strength and geometry), the receiver's settings
//! ([`receiver`]), the message's timetable ([`timetable`]) and the scene's own expectations
//! ([`gnss::facts`]); [`satellite`] has the rules. Outages that the scene causes are excluded. Limits:
//! searches are those of a cold start with worst losses, so a receiver may be earlier than required. Geometry
//! counts the satellites that must be used, not those that might be.

pub mod receiver;
pub mod satellite;
pub mod timetable;

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix4;

use crate::error::JudgeError;
use crate::expect::authenticated;
use crate::expect::message::Message;
use crate::expect::multiple_access::MultipleAccess;
use crate::read::Run;
use crate::statistics::median;
use gnss::earth::Geodetic;
use gnss::facts::{Expect, FaultKind, Fixes};
use gnss::ionosphere::Model;
use gnss::satellite::Sv;
use gnss::signal::Link;
use gnss::signal::Signal;
use gnss::time::Epoch;
use receiver::Receiver;
use satellite::{Excuse, Required, SatelliteEpoch, Scene};
use timetable::Timetable;

/// Dilution up to which satellites must give a fix.
pub const LARGEST_PDOP: f64 = 20.0;
/// Satellites that carry on a fix before the time at which one is due.
const ENOUGH: u32 = 5;
/// Height from which on a receiver's mask does not count.
const SPACE_M: f64 = 100e3;
/// Time that a solution may take once all is there.
const SOLVE_S: f64 = 1.0;

/// Requirements at one epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Due {
    /// Number of the sample, counted from the first one.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Satellites that must be used.
    pub used: u32,
    /// Satellites whose signal can be held.
    pub held: u32,
    /// Normal matrix of the directions of those that must be used, upper triangle.
    normal: [f32; 10],
}

impl Due {
    /// Adds a satellite that must be used, by its direction.
    pub fn add(&mut self, azimuth_rad: f64, elevation_rad: f64) {
        let ((sin_a, cos_a), (sin_e, cos_e)) = (libm::sincos(azimuth_rad), libm::sincos(elevation_rad));
        let h = [cos_e * sin_a, cos_e * cos_a, sin_e, 1.0];
        let pairs = (0..4).flat_map(|i| (i..4).map(move |j| (i, j)));
        for (sum, (i, j)) in self.normal.iter_mut().zip(pairs) {
            *sum += (h.get(i).copied().unwrap_or(0.0) * h.get(j).copied().unwrap_or(0.0)) as f32;
        }
        self.used += 1;
    }

    /// Position dilution of those that must be used; infinite where there is no position.
    pub fn pdop(&self) -> f64 {
        let (horizontal, vertical) = self.dilutions();
        libm::hypot(horizontal, vertical)
    }

    /// Horizontal and vertical dilution of those that must be used; infinite where there is no position.
    pub fn dilutions(&self) -> (f64, f64) {
        let none = (f64::INFINITY, f64::INFINITY);
        if self.used < 4 {
            return none;
        }
        let [a, b, c, d, e, f, g, h, i, j] = self.normal.map(f64::from);
        let normal = Matrix4::new(a, b, c, d, b, e, f, g, c, f, h, i, d, g, i, j);
        let Some(inverse) = normal.try_inverse() else { return none };
        let (horizontal, vertical) = (inverse.m11 + inverse.m22, inverse.m33);
        let is_position = horizontal > 0.0 && vertical > 0.0;
        if is_position { (horizontal.sqrt(), vertical.sqrt()) } else { none }
    }
}

/// Requirements on one satellite over the run, in epochs of the truth.
#[derive(Clone, Debug, Default)]
pub struct Satellite {
    /// Epochs in which the truth has it.
    pub epochs: usize,
    /// Median of its true C/N0, dB-Hz.
    pub usual_dbhz: f64,
    /// Time by which it must have been acquired, seconds.
    pub acquired_by_s: Option<f64>,
    /// Epochs at which it must be observed.
    pub due: usize,
    /// Number of those epochs at which it was observed.
    pub observed: usize,
    /// The latest of those at which it was not, and the first.
    pub missing_s: Option<(f64, f64)>,
    /// Epochs in which it had to be used.
    pub used_due: usize,
    /// Most frequent reason for not being required.
    pub excuse: Option<Excuse>,
    /// Largest of its true Doppler, Hz, without sign.
    pub doppler_hz: f64,
}

/// Times of the events in a receiver's channels, in any form of report.
pub trait Observed {
    /// Times of a satellite's observations, in the epochs of the truth: samples, sorted.
    ///
    /// # Errors
    /// Rows that cannot be read.
    fn samples(&self, link: Link) -> Result<Vec<u64>, JudgeError>;
}

impl Observed for Run {
    fn samples(&self, link: Link) -> Result<Vec<u64>, JudgeError> {
        let mut samples = self.observations.map(link, |row| row.sample)?;
        samples.sort_unstable();
        Ok(samples)
    }
}

/// The whole of what a scene allows.
#[derive(Clone, Debug)]
pub struct Expectations {
    /// Expectations from the receiver's settings.
    pub receiver: Receiver,
    /// Required and achieved observations of each satellite's signal.
    pub satellites: BTreeMap<Link, Satellite>,
    /// Epochs of the truth at which the receiver measures.
    pub epochs: Vec<Due>,
    /// Time at which the first fix is due, if the scene allows one, seconds.
    pub first_fix_s: Option<f64>,
    /// Time at which satellites and geometry would have allowed it, without regard to the ionosphere,
    /// seconds.
    pub four_by_s: Option<f64>,
    /// Time since which nothing keeps the receiver from a fix, seconds; it may lie beyond the scene.
    fixes_from_s: f64,
    /// Messages that the satellites sent.
    message: Message,
}

impl Expectations {
    /// Finds them.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &Run, receiver: Receiver, observed: &impl Observed) -> Result<Self, JudgeError> {
        let due = |sample: u64| Due { sample, time_s: run.time_s(sample), ..Due::default() };
        let mut found = Self {
            satellites: BTreeMap::new(),
            epochs: run.trajectory.map(|row| due(row.sample))?,
            receiver,
            first_fix_s: None,
            four_by_s: None,
            fixes_from_s: f64::NEG_INFINITY,
            message: Message::of(run),
        };
        let steps: Vec<f64> = found.epochs.windows(2).map(|two| two[1].time_s - two[0].time_s).collect();
        let (Some(first), Some(interval_s)) = (run.trajectory.first(), median(&steps)) else { return Ok(found) };
        let start = first.time().plus_s(-run.time_s(first.sample));
        let in_space = Geodetic::from_ecef(&first.position_m()).height_m >= SPACE_M;
        let access = MultipleAccess::new(run);
        let mut counted = Counted::default();
        let required = authenticated::Required::of(run, satellite::LOCK_S);
        let renewals = run.scene.renewals.iter().fold(BTreeMap::<Sv, Vec<f64>>::new(), |mut all, one| {
            all.entry(one.sv).or_default().push(one.at_s);
            all
        });
        for link in run.truth.keys() {
            let renewals_s = renewals.get(&link.sv).map_or(&[][..], Vec::as_slice);
            let receiver = found.receiver.of_signal(link.signal);
            let scene = Scene {
                receiver: &receiver,
                timetable: Timetable::beside(link.signal, &run.signals, start).renewed(renewals_s),
                expect: &run.scene.expect,
                faults: &run.scene.faults,
                interval_s,
            };
            counted.begin(link.sv, found.epochs.len());
            let serves = required.as_ref().is_none_or(|required| required.serves(link));
            let one = found.satellite(run, &scene, (&access, &mut counted), (link, serves), in_space, observed)?;
            found.satellites.insert(link, one);
        }
        found.fixes_due(&run.scene.expect, start, required.map(|required| required.from_s));
        Ok(found)
    }

    fn satellite(
        &mut self,
        run: &Run,
        scene: &Scene<'_>,
        (access, counted): (&MultipleAccess<'_>, &mut Counted),
        (link, serves): (Link, bool),
        in_space: bool,
        observed: &impl Observed,
    ) -> Result<Satellite, JudgeError> {
        let mut sky = run.seen_at(link.sv)?;
        let mut look = |sample: u64| {
            let row = sky.as_mut()?.get(sample)?;
            Some((row.azimuth_deg, row.elevation_deg))
        };
        let mut most_hz = run.cn0_most_hz.finder();
        let mut samples = Vec::with_capacity(run.truth.count(&link));
        let plain: Vec<SatelliteEpoch> = run.truth.map(link, |row| {
            let elevation_deg = look(row.sample).map_or(90.0, |(_, elevation_deg)| elevation_deg);
            samples.push(row.sample);
            SatelliteEpoch {
                time_s: run.time_s(row.sample),
                cn0_dbhz: row.cn0_dbhz,
                effective_dbhz: access.effective_dbhz(&row) - self.receiver.cost_db,
                strongest_dbhz: Run::strongest_dbhz(&mut most_hz, row.sample, link.signal),
                doppler_hz: row.doppler_hz,
                above_mask: in_space || elevation_deg >= self.receiver.mask_deg,
            }
        })?;
        let strengths: Vec<f64> = plain.iter().map(|row| row.cn0_dbhz).collect();
        let usual_dbhz = median(&strengths).unwrap_or(0.0);
        drop(strengths);
        let healthy =
            self.message.says_healthy(link) || run.scene.faults.iter().any(|fault| fault.kind == FaultKind::Health);
        let required = scene.required(link.sv, &plain, usual_dbhz, healthy);
        let seen = observed.samples(link)?;
        let mut one = Satellite { epochs: plain.len(), usual_dbhz, ..Satellite::default() };
        one.doppler_hz = plain.iter().map(|row| row.doppler_hz.abs()).fold(0.0, f64::max);
        let excuses: Vec<Excuse> = plain.iter().filter_map(|row| scene.excuse(link.sv, row, usual_dbhz)).collect();
        one.excuse = excuses.get(excuses.len() / 2).copied();
        let measured = self.measured();
        let dated_s = if link.signal.is_dated() { Some(f64::NEG_INFINITY) } else { counted.dated_s };
        for ((sample, row), required) in samples.iter().zip(&plain).zip(&required) {
            // What does not say its time has it once another signal of the satellite is observed.
            let dated = dated_s.is_some_and(|dated_s| row.time_s >= dated_s);
            let required = &if dated { *required } else { Required { observed: false, used: false, ..*required } };
            counted.date(link.signal, required, row.time_s);
            let Ok(at) = self.epochs.binary_search_by_key(sample, |due| due.sample) else { continue };
            one.take(row, required, measured.contains_at(at, self), seen.binary_search(sample).is_ok());
            let Some(due) = self.epochs.get_mut(at) else { continue };
            due.held += u32::from(required.held && Counted::is_first(&mut counted.held, at));
            let used = required.used && serves && Counted::is_first(&mut counted.used, at);
            if let (true, Some((azimuth_deg, elevation_deg))) = (used, look(*sample)) {
                due.add(azimuth_deg.to_radians(), elevation_deg.to_radians());
            }
        }
        Ok(one)
    }

    /// The epochs of the truth at which the receiver measures too.
    fn measured(&self) -> Measured {
        Measured { interval_s: self.receiver.interval_s }
    }

    fn fixes_due(&mut self, expect: &Expect, start: Epoch, authentic_s: Option<f64>) {
        let ready = |due: &&Due| due.pdop() <= LARGEST_PDOP;
        self.four_by_s = self.epochs.iter().find(ready).map(|due| due.time_s);
        let receiver = &self.receiver;
        let Some(four_s) = self.four_by_s else { return };
        let acquired_s = self.satellites.values().filter_map(|one| one.acquired_by_s).fold(f64::INFINITY, f64::min);
        let signals: BTreeSet<&'static Signal> = self.satellites.keys().map(|link| link.signal).collect();
        let table = |signal: &&'static Signal| Timetable::beside(signal, &signals, start);
        let page_s = |signal: &&'static Signal| table(signal).ionosphere_by_s(acquired_s + satellite::LOCK_S);
        let model = receiver.ionosphere_model(&signals);
        // Nine zeros are no coefficients of BDGIM.
        let model = model.filter(|model| *model != Model::Bdgim || self.message.ionosphere(*model).is_some());
        let brings = |signal: &&&'static Signal| {
            let mut messages = signal.components.iter().filter_map(|component| component.message);
            messages.any(|message| Some(message.ionosphere.model) == model)
        };
        let page_s = signals.iter().filter(brings).map(page_s).fold(f64::INFINITY, f64::min);
        let waited_s = four_s + receiver.ionosphere_wait_s;
        self.fixes_from_s = if receiver.requires_ionosphere { four_s.max(page_s) } else { waited_s } + SOLVE_S;
        if let Some(authentic_s) = authentic_s {
            self.fixes_from_s = self.fixes_from_s.max(authentic_s + SOLVE_S);
        }
        // Where the scene excuses a time, the clock begins again after it.
        self.first_fix_s = self.epochs.iter().find(|due| self.fix_due(expect, due, None)).map(|due| due.time_s);
    }

    /// True if there must be a fix at an epoch of a receiver whose first one came at `first_s`.
    pub fn fix_due(&self, expect: &Expect, due: &Due, first_s: Option<f64>) -> bool {
        match expect.fix(due.time_s) {
            Some(Fixes::None | Fixes::Any) => return false,
            Some(Fixes::Required) | None => {}
        }
        let on_time = due.time_s >= self.first_fix_s.unwrap_or(self.fixes_from_s);
        (on_time && due.pdop() <= LARGEST_PDOP)
            || (first_s.is_some_and(|first_s| due.time_s > first_s) && !on_time && due.held >= ENOUGH)
    }

    /// True if the receiver measures at an epoch of the truth.
    pub fn measures(&self, due: &Due) -> bool {
        self.measured().at(due.time_s)
    }
}

/// Epochs at which a satellite counts already by another of its signals: a second one adds no direction.
#[derive(Default)]
struct Counted {
    sv: Option<Sv>,
    held: Vec<bool>,
    used: Vec<bool>,
    /// Time since which one of its signals that state their time must be observed, seconds. They come before
    /// the others, as signals are sorted.
    dated_s: Option<f64>,
}

impl Counted {
    fn date(&mut self, signal: &Signal, required: &Required, time_s: f64) {
        if signal.is_dated() && required.observed {
            self.dated_s = Some(self.dated_s.map_or(time_s, |dated_s| dated_s.min(time_s)));
        }
    }

    fn begin(&mut self, sv: Sv, epochs: usize) {
        if self.sv.replace(sv) != Some(sv) {
            (self.held, self.used) = (vec![false; epochs], vec![false; epochs]);
            self.dated_s = None;
        }
    }

    /// Counts an epoch; returns true if it was not counted before.
    fn is_first(counted: &mut [bool], at: usize) -> bool {
        counted.get_mut(at).is_some_and(|counted| !std::mem::replace(counted, true))
    }
}

/// The grid of a receiver's measurements.
#[derive(Clone, Copy)]
struct Measured {
    interval_s: f64,
}

impl Measured {
    /// Samples are whole: a tick and its sample differ by less than one, 1e-3 s at the lowest rate that there
    /// is.
    fn at(self, time_s: f64) -> bool {
        let away = time_s / self.interval_s;
        (away - away.round()).abs() * self.interval_s < 1e-5
    }

    fn contains_at(self, at: usize, expectations: &Expectations) -> bool {
        expectations.epochs.get(at).is_some_and(|due| self.at(due.time_s))
    }
}

impl Satellite {
    fn take(&mut self, row: &SatelliteEpoch, required: &Required, measured: bool, seen: bool) {
        if required.acquired {
            self.acquired_by_s.get_or_insert(row.time_s);
        }
        if !measured {
            return;
        }
        self.used_due += usize::from(required.used);
        if required.observed {
            self.due += 1;
            self.observed += usize::from(seen);
            if !seen {
                let first_s = self.missing_s.map_or(row.time_s, |(first_s, _)| first_s);
                self.missing_s = Some((first_s, row.time_s));
            }
        }
    }

    /// Share of the time that it must be observed over which it was.
    pub fn share(&self) -> f64 {
        if self.due == 0 { 1.0 } else { self.observed as f64 / self.due as f64 }
    }
}
