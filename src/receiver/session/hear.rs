//! Intake of what a channel decoded and measured, whoever followed the signal.
//!
//! A [`Tracked`] signal is one of the receiver's own channels, or one that is given by its measurements
//! ([`super::Navigation`]). Both are decoded, dated, observed and solved by the same code.

use super::shared::Shared;
use super::step::Step;
use crate::authentic::Authentic;
use crate::decode::{Decoder, News};
use crate::observe::Reading;
use crate::outcome::ReceiveError;
use crate::output::{Record, Sink};
use crate::position::Solved;
use crate::track::{Channel, Measurement, Report};
use gnss::broadcast::Ephemeris;
use gnss::record::{Event, EventRow, Observation};
use gnss::satellite::Sv;
use gnss::signal::Link;
use gnss::time::Rate;

/// Residuals beyond this are no noise: the channel has the wrong time.
const WRONG_TIME_M: f64 = 10_000.0;

/// A signal that is followed.
pub(super) trait Tracked {
    /// Satellite and signal.
    fn link(&self) -> Link;
    /// Takes whether the message showed the symbols to be inverted.
    fn resolve_half_cycle(&mut self, inverted: bool);
    /// Takes the satellite that sends, where it is another than was assumed.
    fn rename(&mut self, sv: Sv);
}

impl Tracked for Channel {
    fn link(&self) -> Link {
        Self::link(self)
    }

    fn resolve_half_cycle(&mut self, inverted: bool) {
        Self::resolve_half_cycle(self, inverted);
    }

    fn rename(&mut self, sv: Sv) {
        Self::rename(self, sv);
    }
}

/// A signal that is followed, with its decoder and the symbols that wait for it.
pub(super) struct Hearing<'a, C> {
    pub channel: &'a mut C,
    pub decoder: &'a mut Decoder,
    pub report: &'a mut Report,
    /// Symbols so far.
    pub symbols: &'a mut u64,
}

/// Dates a decoder whose message does not say its time by what other signals of its satellite read at the
/// same instant; true if its time is known from here on.
pub(super) fn date(decoder: &mut Decoder, link: Link, measurement: &Measurement, known: &[Reading]) -> bool {
    let Link { sv, signal } = link;
    let other = known.iter().find(|other| other.sv == sv && other.signal.time == signal.time);
    other.is_some_and(|other| decoder.date(measurement.code_periods, other.sent_of_week))
}

/// True if a position excluded a satellite for what can only be a wrong time.
pub(super) fn is_wrong_time(excluded: &[(Sv, f64)], sv: Sv) -> bool {
    excluded.iter().any(|(out, miss_m)| *out == sv && miss_m.abs() > WRONG_TIME_M)
}

impl Shared {
    /// Gives every symbol that ended before the sample `until` to its decoder and takes in what comes out.
    pub fn hear<C: Tracked>(
        &mut self,
        heard: Hearing<'_, C>,
        (until, step): (u64, Step),
        sink: &mut dyn Sink,
    ) -> Result<(), ReceiveError> {
        let Hearing { channel, decoder, report, symbols } = heard;
        let (near, known) = (self.near(), self.known());
        let Link { mut sv, signal } = channel.link();
        // A position of verified data alone takes nothing that no tag covers.
        let all_data = !self.authentic.as_ref().is_some_and(Authentic::is_required);
        known.into_iter().for_each(|known| decoder.know(known));
        let slipped = report.events.iter().any(|(_, event)| *event == Event::CycleSlip);
        let mut all = Vec::new();
        let ended = report.symbols.partition_point(|symbol| symbol.end <= until);
        for symbol in report.symbols.drain(..ended) {
            *symbols += 1;
            all.extend(decoder.take(&symbol, near).into_iter().map(|news| (symbol.end, news)));
        }
        let progress = self.progress.entry(sv).or_default();
        progress.symbols |= *symbols > 0;
        progress.frame |= decoder.is_synchronised();
        if !decoder.is_dated_elsewhere() {
            progress.missing = decoder.missing();
        }
        for (sample, news) in all {
            let event = match news {
                News::FrameSynchronised => Some(Event::FrameSynchronised),
                News::Polarity { inverted } => {
                    if !slipped {
                        channel.resolve_half_cycle(inverted);
                    }
                    None
                }
                News::Contradiction => {
                    self.refuse(sv, "the time of a unit contradicts that of those before it".to_owned());
                    None
                }
                News::Refused(why) => {
                    self.refuse(sv, why);
                    None
                }
                News::Time(time) => {
                    self.timebase.take_time(time);
                    None
                }
                // Of several models the receiver takes one.
                News::Ionosphere(sent) if self.ionosphere_model == Some(sent.model()) => {
                    let before = self.ionosphere.replace(sent);
                    (before != Some(sent)).then_some(Event::IonosphereDecoded)
                }
                News::Ionosphere(_) => None,
                News::Sender(other) => {
                    // Another of those that are alike was found: what follows is of it.
                    self.rename(sv, other);
                    channel.rename(other);
                    sv = other;
                    Some(Event::Identified)
                }
                News::Page(page) => {
                    if let Some(authentic) = &mut self.authentic {
                        authentic.take(sv, step.main(sample), page);
                    }
                    None
                }
                News::Parameters(mut rows) => {
                    rows.iter_mut().for_each(|row| row.sample = step.main(sample));
                    sink.take(Record::Navigation(rows))?;
                    None
                }
                News::Augmentation { sent, content } => {
                    if all_data {
                        self.solver.take_augmentation(sv, sent, &content);
                    }
                    None
                }
                News::AheadOfGps { scale, ahead } => {
                    if all_data {
                        self.solver.take_ahead(scale, ahead);
                    }
                    None
                }
                News::Reduced { set, with_delays } => {
                    let serves = all_data && self.solver.take_reduced(*set, with_delays);
                    (serves && self.ephemerides.of(sv).is_empty()).then_some(Event::ReducedElements)
                }
                News::Ephemeris(ephemeris) => {
                    // What was refused on the way to it has done no harm.
                    self.refused.remove(&sv);
                    let is_sick = |set: &Ephemeris| set.is_healthy_on(signal) == Some(false);
                    let sick = is_sick(&ephemeris);
                    let before = self.ephemerides.insert(*ephemeris).as_ref().is_some_and(is_sick);
                    sink.take(Record::Event(EventRow { sample, sv, signal, event: Event::EphemerisComplete }))?;
                    match (before, sick) {
                        (false, true) => Some(Event::Unhealthy),
                        (true, false) => Some(Event::Healthy),
                        _ => None,
                    }
                }
            };
            if let Some(event) = event {
                sink.take(Record::Event(EventRow { sample, sv, signal, event }))?;
            }
        }
        Ok(())
    }

    /// Observes and solves by the readings of one tick; `None` where they give no position.
    pub fn solve(
        &mut self,
        tick: u64,
        readings: &[Reading],
        sink: &mut dyn Sink,
    ) -> Result<Option<Solved>, ReceiveError> {
        let observed = self.timebase.observe(tick, readings);
        for one in observed.iter().filter(|one| one.half_cycle_known) {
            sink.take(Record::Observation(one.observation.clone()))?;
        }
        let Some(clock) = self.timebase.clock() else { return Ok(None) };
        let observations: Vec<Observation> = observed.into_iter().map(|one| one.observation).collect();
        let verified = self.authentic.as_ref().filter(|authentic| authentic.is_required());
        let (sets, ionosphere) = verified.map_or((&self.ephemerides, self.ionosphere), Authentic::data);
        let solved = self.solver.solve(tick, clock, &observations, sets, ionosphere);
        if let Some(detection) = &mut self.detection {
            detection.take_observations(&observations);
            detection.take_residuals(self.solver.take_tested());
        }
        Ok(solved.map_err(|reason| self.reason = Some(reason)).ok())
    }

    /// Takes in a position of one tick, whose samples have that rate, and writes it. Gives the satellites
    /// that were excluded, with their residuals.
    pub fn settle(
        &mut self,
        (tick, rate): (u64, Rate),
        solved: Solved,
        sink: &mut dyn Sink,
    ) -> Result<Vec<(Sv, f64)>, ReceiveError> {
        if let Some(detection) = &mut self.detection {
            detection.take_fix(&solved.fix);
        }
        sink.take(Record::Fix(solved.fix.clone()))?;
        sink.take(Record::Clocks(solved.clocks))?;
        self.sights.clone_from(&solved.sights);
        sink.take(Record::Sights(solved.sights))?;
        sink.take(Record::Ionosphere(solved.ionosphere))?;
        if let Some(row) = solved.integrity {
            sink.take(Record::Integrity(Box::new(row)))?;
        }
        let condition = solved.fix.condition;
        self.worst_condition = Some(self.worst_condition.map_or(condition, |worst| worst.max(condition)));
        self.fixes += 1;
        if let Some(authentic) = &mut self.authentic {
            authentic.fixed(tick, &solved.used, &self.ephemerides);
        }
        self.clock_drift = Some(solved.fix.clock_drift);
        self.latest = Some(solved.fix);
        self.first_fix_s.get_or_insert(rate.elapsed_s(tick));
        self.used.extend(solved.used);
        Ok(solved.excluded)
    }
}
