//! Verification of Galileo's message authentication (OSNMA) while the receiver runs.
//!
//! Decoders hand on whole pages of E1-B; those of all channels go to one verifier in the order of time, with
//! the receiver's own time. That is the start that the recording states and the count of samples since, with
//! the error that the settings give it. No signal sets it, since a replayed one would set it wrong. What
//! becomes authentic makes ephemerides of its own ([`Authentic::data`]) for positions of verified data alone.
//! Limits: samples that are lost are not in the own time, whose bound has to cover them.

mod outcome;

use std::collections::BTreeSet;

use thiserror::Error;

use crate::output::{OutputError, Record, Sink};
use crate::position::Sets;
use crate::position::least_squares::UNKNOWNS;
use crate::settings::osnma::{OsnmaSettings, PositionData};
use gnss::broadcast::Ephemeris;
use gnss::galileo::e1::E1;
use gnss::galileo::inav::{GST_WEEK, INAV, ephemeris_of, ionosphere_of};
use gnss::ionosphere::Coefficients;
use gnss::message::SentPage;
use gnss::satellite::{Sv, System};
use gnss::signal::Signal;
use gnss::time::{Epoch, Rate, WEEK_S};
use osnma::page::{Page, satellite};
use osnma::report::{State, TagReport};
use osnma::time::Gst;
use osnma::verifier::{Authenticated, Settings, Verifier};
pub use outcome::{Authenticity, StateChange, counted};

/// Reason for which a receiver cannot verify authentication.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum AnchorError {
    /// Keys that are missing or contradict each other.
    #[error("{0}")]
    Keys(String),
    /// A recording that states no start.
    #[error(
        "[osnma] needs the receiver's own time, and the recording states no start: expected it in the metadata, or \
         --start TIME"
    )]
    NoOwnTime,
    /// Signals without authenticated pages.
    #[error("[osnma] verifies pages of Galileo E1, which is not received: expected it in acquisition.signals")]
    NoPages,
}

/// Page with the instant at which its last sample was read.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    page: Page,
    sample: u64,
    /// Own time at the page's beginning, in seconds of GST.
    own_s: f64,
}

/// Verifier of a reception.
pub struct Authentic {
    verifier: Verifier,
    start: &'static str,
    is_required: bool,
    /// Own time of the first sample, in seconds of GST.
    own_start_s: f64,
    rate: Rate,
    arrived: Vec<Arrival>,
    /// Sample of the newest page that was verified.
    newest: u64,
    sets: Sets,
    ionosphere: Option<Coefficients>,
    states: Vec<StateChange>,
    first_data: Option<u64>,
    first_fix: Option<u64>,
}

impl Authentic {
    /// Verifier with the keys of the settings, for a reception of these signals that began at `start`.
    ///
    /// # Errors
    /// [`AnchorError`].
    pub fn new(
        settings: &OsnmaSettings,
        signals: &[&'static Signal],
        start: Option<Epoch>,
        rate: Rate,
    ) -> Result<Self, AnchorError> {
        let (anchor, kind) = settings.anchor().map_err(AnchorError::Keys)?;
        if !signals.iter().any(|signal| signal.carries(&INAV)) {
            return Err(AnchorError::NoPages);
        }
        let start = start.ok_or(AnchorError::NoOwnTime)?;
        let own = E1.time.label(start);
        let own_start_s = (own.seconds() - GST_WEEK * WEEK_S) as f64 + own.fraction() + settings.clock_offset_s;
        let OsnmaSettings { time_uncertainty_s, tag_bits, .. } = *settings;
        let verifier = Verifier::new(anchor, Settings { time_uncertainty_s, tag_bits });
        let verifier = verifier.map_err(|error| AnchorError::Keys(format!("osnma.kroot: {error}")))?;
        Ok(Self {
            states: vec![StateChange { seconds: 0.0, state: verifier.state().name() }],
            verifier,
            start: kind,
            is_required: settings.position == PositionData::Authentic,
            own_start_s,
            rate,
            arrived: Vec::new(),
            newest: 0,
            sets: Sets::default(),
            ionosphere: None,
            first_data: None,
            first_fix: None,
        })
    }

    /// True if a position takes authentic data alone.
    pub fn is_required(&self) -> bool {
        self.is_required
    }

    /// Ephemerides that are authentic, and the ionosphere that they bring.
    pub fn data(&self) -> (&Sets, Option<Coefficients>) {
        (&self.sets, self.ionosphere)
    }

    /// Takes a page of a satellite whose newest symbol ended before a sample.
    pub fn take(&mut self, sv: Sv, sample: u64, page: SentPage) {
        if sv.system != System::Galileo {
            return;
        }
        let start = Gst::of_seconds(page.start.seconds() - GST_WEEK * WEEK_S);
        let since_s = page.symbols as f64 * INAV.symbol_s;
        let own_s = self.own_start_s + self.rate.elapsed_s(sample) - since_s;
        let [even, odd] = page.parts;
        self.arrived.push(Arrival { page: Page::new(sv.number, start, even, odd), sample, own_s });
    }

    /// Verifies the pages that have come, in the order of time, and gives the results of tags to `sink`.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn verify(&mut self, sink: &mut dyn Sink) -> Result<(), OutputError> {
        let mut arrived = std::mem::take(&mut self.arrived);
        arrived.sort_by_key(|arrival| (arrival.page.start, arrival.page.sender));
        for Arrival { page, sample, own_s } in arrived {
            let reports = self.verifier.page(&page, own_s);
            self.settle(&reports, self.newest.max(sample), sink)?;
        }
        Ok(())
    }

    /// Ends the verification: tags that still wait for their keys are not verifiable.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn finish(&mut self, sink: &mut dyn Sink) -> Result<(), OutputError> {
        self.verify(sink)?;
        let reports = self.verifier.finish();
        self.settle(&reports, self.newest, sink)
    }

    /// Takes a fix with these satellites. The first fix that authentic data alone determine is that with as
    /// many satellites whose data in use are authentic as there are unknowns.
    pub fn fixed(&mut self, sample: u64, used: &[Sv], in_use: &Sets) {
        if self.first_fix.is_some() || self.first_data.is_none() {
            return;
        }
        let orbits =
            |sets: &Sets, sv: Sv| -> BTreeSet<[u64; 5]> { sets.of(sv).iter().map(Ephemeris::orbit_bits).collect() };
        let is_authentic = |sv: &&Sv| self.is_required || !orbits(&self.sets, **sv).is_disjoint(&orbits(in_use, **sv));
        if used.iter().filter(is_authentic).count() >= UNKNOWNS {
            self.first_fix = Some(sample);
        }
    }

    fn settle(&mut self, reports: &[TagReport], sample: u64, sink: &mut dyn Sink) -> Result<(), OutputError> {
        self.newest = sample;
        for report in reports {
            sink.take(Record::Tag(report.row()))?;
        }
        for data in self.verifier.take_authentic() {
            self.first_data.get_or_insert(sample);
            self.trust(&data);
        }
        if self.first_data.is_none() && self.verifier.first_authentic().is_some() {
            self.first_data = Some(sample);
        }
        let state = self.verifier.state();
        if self.states.last().is_none_or(|last| last.state != state.name()) {
            self.states.push(StateChange { seconds: self.rate.elapsed_s(sample), state: state.name() });
        }
        if state == State::DoNotUse {
            // The system itself withdraws what it authenticated.
            (self.sets, self.ionosphere) = (Sets::default(), None);
        }
        Ok(())
    }

    /// Takes data that became authentic in place of those before them.
    fn trust(&mut self, data: &Authenticated) {
        let sv = satellite(data.satellite);
        let near = Epoch::new(data.sent.seconds() + GST_WEEK * WEEK_S, 0.0);
        if let Some(set) = ephemeris_of(sv, &data.words, near) {
            self.sets.insert(set.timed(|label| E1.time.instant(label)));
        }
        self.ionosphere = ionosphere_of(&data.words[4]).or(self.ionosphere);
    }

    /// Outcome up to now.
    pub fn outcome(&self) -> Authenticity {
        let seconds = |sample: Option<u64>| sample.map(|sample| self.rate.elapsed_s(sample));
        Authenticity {
            start: self.start,
            state: self.verifier.state().name(),
            states: self.states.clone(),
            counts: self.verifier.counts().clone(),
            satellites: self.sets.satellites().collect(),
            position_required: self.is_required,
            first_data_s: seconds(self.first_data),
            first_fix_s: seconds(self.first_fix),
            kroot: self.verifier.stored_root().map(|root| osnma::bits::hex(&root)),
        }
    }
}

#[cfg(test)]
mod tests;
