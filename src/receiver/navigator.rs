//! The receiver from its channels on: decoding, observations, position, for signals that others follow.
//!
//! A [`Navigator`] asks for no samples. At each of its ticks it takes what channels would report, the
//! measurements, symbols and events of each signal, and writes the records that a [`crate::Reception`]
//! writes. Limits: no rows of searches, loops and spectra; the front part decides what is found and lost.

use crate::outcome::{Outcome, ReceiveError};
use crate::output::Sink;
use crate::run::summary::summary;
use crate::run::{diagnosis, searched};
use crate::session::{Given, Navigation};
use crate::settings::Settings;
use gnss::samples::IfMetadata;
use gnss::signal::{Link, Signal};

/// Navigation by signals that others follow.
pub struct Navigator {
    metadata: Vec<IfMetadata>,
    settings: Settings,
    navigation: Navigation,
}

impl Navigator {
    /// A cold start. Samples are counted as those of the first of the front ends.
    ///
    /// # Errors
    /// Settings out of range, signals that cannot be received.
    pub fn new(metadata: &[IfMetadata], settings: &Settings) -> Result<Self, ReceiveError> {
        settings.validate("settings")?;
        let settings = searched(metadata, settings);
        let navigation = Navigation::new(metadata, &settings)?;
        Ok(Self { metadata: metadata.to_vec(), settings, navigation })
    }

    /// Settings, with the signals that are received.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Signals that each front end receives.
    pub fn assigned(&self) -> &[Vec<&'static Signal>] {
        self.navigation.assigned()
    }

    /// Sample of the next tick.
    pub fn tick(&self) -> u64 {
        self.navigation.tick()
    }

    /// True from the first fix on.
    pub fn has_fix(&self) -> bool {
        self.navigation.has_fix()
    }

    /// Takes all signals at the next tick. A signal begins with the search that found it and ends with its
    /// event `LossOfLock`. Gives the links that were given up: their messages lead nowhere.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn take(&mut self, given: &mut [Given], sink: &mut dyn Sink) -> Result<Vec<Link>, ReceiveError> {
        self.navigation.take(given, sink)
    }

    /// Ends the reception of so many samples of the first front end, and returns what came of it.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn finish(mut self, samples: u64, sink: &mut dyn Sink) -> Result<Outcome, ReceiveError> {
        self.navigation.end_verification(sink)?;
        let Some(first) = self.metadata.first() else { return Err(ReceiveError::NoFrontEnd) };
        let mut outcome = self.navigation.outcome();
        (outcome.samples, outcome.seconds) = (samples, first.rate.elapsed_s(samples));
        if outcome.fixes == 0 {
            let stage = self.navigation.failed_stage();
            outcome.diagnosis = Some(diagnosis(stage, first, &self.settings, &outcome));
        }
        let names = |signals: &Vec<&'static Signal>| signals.iter().map(|signal| signal.name).collect();
        let signals: Vec<Vec<&'static str>> = self.assigned().iter().map(names).collect();
        sink.finish(&summary(&self.metadata, &signals, &self.settings, &outcome))?;
        Ok(outcome)
    }
}
