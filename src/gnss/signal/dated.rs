//! Signals whose messages say when they are sent and from where, and those that take it from these.

use super::Signal;
use crate::message::Message;

impl Signal {
    /// The messages of its components.
    fn messages(&self) -> impl Iterator<Item = &'static Message> + '_ {
        self.components.iter().filter_map(|component| component.message)
    }

    /// Whether a message of it says its time.
    pub fn is_dated(&self) -> bool {
        self.messages().any(Message::is_dated)
    }

    /// Of some signals those that give the time of this one, whose message does not say it, and where its
    /// satellites are: signals of the same satellites whose sets serve this one.
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
