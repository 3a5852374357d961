//! The navigation part of a reception alone: signals that are followed elsewhere are decoded, dated, observed
//! and solved as those of the receiver's own channels are.

use std::collections::BTreeMap;

use super::hear::{Hearing, Tracked, date, is_wrong_time};
use super::shared::Shared;
use super::step::Step;
use super::{WRONG_TIME_FIXES, assign, share};
use crate::authentic::Authentic;
use crate::decode::Decoder;
use crate::diagnosis::Stage;
use crate::observe::Reading;
use crate::outcome::{Outcome, ReceiveError};
use crate::output::{Record, Sink};
use crate::settings::Settings;
use crate::track::{LoopMargin, Measurement, Report};
use gnss::record::{AcquisitionRow, Event, EventRow};
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::{Link, Signal};
use gnss::time::Rate;

/// A signal that is followed elsewhere, at one tick.
#[derive(Clone, Debug)]
pub struct Given {
    /// Satellite and signal.
    pub link: Link,
    /// The search that found it since the tick before, if one did.
    pub found: Option<AcquisitionRow>,
    /// Events and symbols since the tick before, and the measurement at the tick.
    pub report: Report,
}

/// A signal whose messages are read.
struct Read {
    link: Link,
    /// True if symbols are inverted; `None` before the message shows it.
    inverted: Option<bool>,
}

impl Tracked for Read {
    fn link(&self) -> Link {
        self.link
    }

    fn resolve_half_cycle(&mut self, inverted: bool) {
        self.inverted = Some(inverted);
    }

    fn rename(&mut self, sv: Sv) {
        self.link.sv = sv;
    }
}

/// A given signal with its decoder.
struct Track {
    read: Read,
    decoder: Option<Decoder>,
    since: u64,
    symbols: u64,
    wrong_time: u32,
    /// Measurement at the running tick.
    measured: Option<Measurement>,
}

impl Track {
    fn reading(&self) -> Option<Reading> {
        let Link { sv, signal } = self.read.link;
        Reading::new(sv, signal, self.measured.as_ref()?, self.decoder.as_ref()?)
    }
}

/// Navigation by signals that are given tick by tick.
pub struct Navigation {
    shared: Shared,
    assigned: Vec<Vec<&'static Signal>>,
    loops: [LoopMargin; 5],
    rate: Rate,
    interval_ms: u64,
    number: u64,
    /// Followed signals, by the links under which they are given.
    tracks: BTreeMap<Link, Track>,
}

impl Navigation {
    /// A cold start; samples count as those of the first front end do.
    pub fn new(metadata: &[IfMetadata], settings: &Settings) -> Result<Self, ReceiveError> {
        let (assigned, noises) = assign(metadata, settings)?;
        let Some(first) = metadata.first() else { return Err(ReceiveError::NoFrontEnd) };
        let (shared, loops) = share(metadata, settings, noises)?;
        let operation = &settings.operation;
        let step_ms = u64::from(operation.tracking_interval_ms);
        let interval_ms = u64::from(operation.measurement_interval_ms) / step_ms.max(1) * step_ms;
        let rate = first.rate;
        Ok(Self { shared, assigned, loops, rate, interval_ms, number: 0, tracks: BTreeMap::new() })
    }

    /// Sample of the next tick.
    pub fn tick(&self) -> u64 {
        self.rate.first_sample_at(self.number * self.interval_ms, 1000)
    }

    /// Signals of each front end.
    pub fn assigned(&self) -> &[Vec<&'static Signal>] {
        &self.assigned
    }

    /// True from the first fix on.
    pub fn has_fix(&self) -> bool {
        self.shared.fixes > 0
    }

    /// Takes what is known of each signal at the tick, and goes on to the next one. Gives the links that lead
    /// nowhere.
    pub fn take(&mut self, given: &mut [Given], sink: &mut dyn Sink) -> Result<Vec<Link>, ReceiveError> {
        let tick = self.tick();
        self.number += 1;
        let lost = self.note(given, sink)?;
        let step = Step::new(0, self.rate, self.rate);
        for Given { link, report, .. } in given.iter_mut() {
            let Some(Track { read, decoder, symbols, measured, .. }) = self.tracks.get_mut(link) else { continue };
            if let Some(decoder) = decoder {
                self.shared.hear(Hearing { channel: read, decoder, report, symbols }, (tick, step), sink)?;
            }
            let half = if read.inverted == Some(true) { 0.5 } else { 0.0 };
            *measured = report.measurements.iter().find(|one| one.sample == tick).map(|one| Measurement {
                carrier_cycles: one.carrier_cycles + half,
                half_cycle_known: one.half_cycle_known || read.inverted.is_some(),
                ..*one
            });
        }
        if let Some(authentic) = &mut self.shared.authentic {
            authentic.verify(sink)?;
        }
        self.date(tick, sink)?;
        self.tracks.retain(|link, _| !lost.contains(link));
        self.measure(tick, sink)?;
        if let Some(detection) = self.shared.detection.as_mut().filter(|detection| detection.is_due(tick)) {
            detection.close(tick, sink)?;
        }
        self.retire(tick, sink)
    }

    /// Begins the signals that were found, and hands their events on. Gives those that were lost.
    fn note(&mut self, given: &[Given], sink: &mut dyn Sink) -> Result<Vec<Link>, ReceiveError> {
        let mut events: Vec<(u64, Link, Event)> = Vec::new();
        for Given { link, found, report } in given {
            if let Some(row) = found {
                sink.take(Record::Acquisition(row.clone()))?;
                events.push((row.sample, *link, Event::Acquired));
            }
            events.extend(report.events.iter().map(|(sample, event)| (*sample, *link, *event)));
        }
        events.sort_by_key(|(sample, link, _)| (*sample, *link));
        let mut lost = Vec::new();
        for (sample, link, event) in events {
            match event {
                Event::Acquired => {
                    self.shared.acquired.insert(link.sv);
                    self.shared.progress.entry(link.sv).or_default();
                    let decoder = self.shared.decoder(link.signal, link.sv);
                    let read = Read { link, inverted: None };
                    let track = Track { read, decoder, since: sample, symbols: 0, wrong_time: 0, measured: None };
                    self.tracks.insert(link, track);
                }
                Event::CycleSlip => {
                    self.tracks.entry(link).and_modify(|track| track.read.inverted = None);
                }
                Event::LossOfLock => {
                    self.shared.losses += 1;
                    lost.push(link);
                }
                _ => {}
            }
            let Link { sv, signal } = self.tracks.get(&link).map_or(link, |track| track.read.link);
            sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
        }
        Ok(lost)
    }

    /// Dates signals that cannot know their time by themselves.
    fn date(&mut self, tick: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let is_waiting = |track: &Track| track.decoder.as_ref().is_some_and(Decoder::is_dated_elsewhere);
        if !self.tracks.values().any(is_waiting) {
            return Ok(());
        }
        let readings = self.tracks.values().filter_map(Track::reading);
        let known: Vec<Reading> = readings.filter(|reading| reading.signal.is_dated()).collect();
        for track in self.tracks.values_mut() {
            let link = track.read.link;
            let Some(decoder) = track.decoder.as_mut().filter(|decoder| decoder.is_dated_elsewhere()) else { continue };
            let Some(measurement) = track.measured.as_ref().filter(|one| one.locked) else { continue };
            if date(decoder, link, measurement, &known) {
                let event = Event::FrameSynchronised;
                let row = EventRow { sample: tick, sv: link.sv, signal: link.signal, event };
                sink.take(Record::Event(row))?;
            }
        }
        Ok(())
    }

    /// Observes and solves at one tick.
    fn measure(&mut self, tick: u64, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let mut readings: Vec<Reading> = self.tracks.values().filter_map(Track::reading).collect();
        readings.sort_by_key(|reading| (reading.sv, reading.signal));
        let Some(solved) = self.shared.solve(tick, &readings, sink)? else { return Ok(()) };
        let excluded = self.shared.settle((tick, self.rate), solved, sink)?;
        for track in self.tracks.values_mut() {
            let wrong = is_wrong_time(&excluded, track.read.link.sv);
            track.wrong_time = if wrong { track.wrong_time + 1 } else { 0 };
        }
        Ok(())
    }

    /// Takes away signals that say what cannot be, or lead nowhere.
    fn retire(&mut self, tick: u64, sink: &mut dyn Sink) -> Result<Vec<Link>, ReceiveError> {
        let limit = (self.shared.settings.operation.frame_limit_s * self.rate.hz()) as u64;
        let mut gone = Vec::new();
        for (link, track) in &self.tracks {
            let has_units = track.decoder.as_ref().is_some_and(Decoder::has_units);
            if track.wrong_time < WRONG_TIME_FIXES && (has_units || tick <= track.since + limit) {
                continue;
            }
            let Link { sv, signal } = track.read.link;
            let sample = tick.saturating_sub(1);
            sink.take(Record::Event(EventRow { sample, sv, signal, event: Event::LossOfLock }))?;
            self.shared.losses += 1;
            gone.push(*link);
        }
        self.tracks.retain(|link, _| !gone.contains(link));
        Ok(gone)
    }

    /// Ends the verification of authentication: tags that still wait for their keys are given as they are.
    pub fn end_verification(&mut self, sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        Ok(self.shared.authentic.as_mut().map_or(Ok(()), |authentic: &mut Authentic| authentic.finish(sink))?)
    }

    /// Outcome of navigation.
    pub fn outcome(&self) -> Outcome {
        Outcome { warnings: self.shared.warnings(), ..self.shared.outcome(&self.loops) }
    }

    /// The first stage that failed, where there was no fix.
    pub fn failed_stage(&self) -> Stage {
        self.shared.failed_stage()
    }
}
