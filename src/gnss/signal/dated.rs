//! Time of the signals: some messages state their time and ephemerides, and signals without them use those.

use super::Signal;
use crate::message::Message;

impl Signal {
    /// The messages of its components.
    fn messages(&self) -> impl Iterator<Item = &'static Message> + '_ {
        self.components.iter().filter_map(|component| component.message)
    }

    /// True if one of the signal's messages states its time.
    pub fn is_dated(&self) -> bool {
        self.messages().any(Message::is_dated)
    }

    /// Selects the signals that supply time and ephemeris for this one, whose message does not state its
    /// time. They belong to the same satellites, and their ephemerides serve this signal.
    pub fn dated_by(
        &'static self,
        signals: impl IntoIterator<Item = &'static Self>,
    ) -> impl Iterator<Item = &'static Self> {
        let serves = move |other: &Self| other.messages().any(|message| (message.sets.serves)(self));
        let dates = move |other: &&'static Self| {
            other.system == self.system && other.time == self.time && other.is_dated() && serves(other)
        };
        signals.into_iter().filter(dates)
    }
}
