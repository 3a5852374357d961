//! Counts of all that a log holds, in words.

use std::fmt;

use crate::frames::{Count, Protocol};

/// Counts of one kind of message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Messages.
    pub count: u64,
    /// Messages whose fields were read.
    pub read: u64,
    /// Messages whose content does not fit their layout.
    pub malformed: u64,
}

/// Counts of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Contents {
    /// Protocols with a whole frame, and their frames.
    pub protocols: Vec<(Protocol, Count)>,
    /// Bytes that belong to no whole frame.
    pub skipped_bytes: u64,
    /// Kinds of messages by protocol and name.
    pub messages: Vec<(Protocol, String, Tally)>,
}

impl Contents {
    /// Binary protocol with the most frames.
    pub fn main_protocol(&self) -> Option<Protocol> {
        let binary = self.protocols.iter().filter(|(protocol, _)| *protocol != Protocol::Nmea);
        binary.rev().max_by_key(|(_, count)| count.frames).map(|(protocol, _)| *protocol)
    }

    /// Whole and damaged frames of one protocol.
    pub fn count(&self, protocol: Protocol) -> Count {
        let own = self.protocols.iter().find(|(known, _)| *known == protocol);
        own.map_or(Count::default(), |(_, count)| *count)
    }

    /// Messages of one protocol in words, each with its count.
    pub fn messages_of(&self, protocol: Protocol) -> String {
        let own = self.messages.iter().filter(|(known, _, _)| *known == protocol);
        list(own.map(|(_, name, tally)| (name, tally.count)))
    }
}

/// Names with their counts, those of none left out.
fn list<'a>(all: impl Iterator<Item = (&'a String, u64)>) -> String {
    let words: Vec<String> =
        all.filter(|(_, count)| *count > 0).map(|(name, count)| format!("{name} {count}")).collect();
    words.join(", ")
}

impl fmt::Display for Contents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (protocol, count) in &self.protocols {
            writeln!(f, "{:<14}{} frames, {} damaged", protocol.name(), count.frames, count.damaged)?;
        }
        writeln!(f, "{:<14}{} bytes belong to no whole frame", "outside", self.skipped_bytes)?;
        let messages = || self.messages.iter().map(|(_, name, tally)| (name, tally));
        let unread = |tally: &Tally| tally.count - tally.read - tally.malformed;
        for (title, text) in [
            ("messages", list(messages().map(|(name, tally)| (name, tally.read)))),
            ("not decoded", list(messages().map(|(name, tally)| (name, unread(tally))))),
            ("malformed", list(messages().map(|(name, tally)| (name, tally.malformed)))),
        ] {
            if !text.is_empty() {
                writeln!(f, "{title:<14}{text}")?;
            }
        }
        Ok(())
    }
}
