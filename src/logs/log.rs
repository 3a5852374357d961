//! A log message by message: names, tables, events, and counts of all that was met.
//!
//! Memory is that of one message, of the lock times of its signals, and of one count per kind of message. An
//! unknown message is counted by its name or number. A message whose check holds but whose content does not
//! fit its layout is counted as malformed.

use std::collections::BTreeMap;
use std::io::{self, Read};

use crate::contents::{Contents, Tally};
use crate::frames::{Frame, Frames, Protocol};
use crate::observed::{Calendar, Event, Locks};
use crate::rtcm;
use crate::sbf;
use crate::table::Table;
use crate::ubx;
use gnss::time::Epoch;

/// Message of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Protocol of its frame.
    pub protocol: Protocol,
    /// Bytes of the log before its frame.
    pub offset: u64,
    /// Name or number.
    pub name: String,
    /// Fields, where they are known.
    pub table: Option<Table>,
    /// Content that can be joined with a truth.
    pub event: Option<Event>,
}

/// A log in reading.
pub struct Log<R> {
    frames: Frames<R>,
    decoder: Decoder,
    /// Counts by protocol and name.
    pub tallies: BTreeMap<(Protocol, String), Tally>,
}

/// State that messages of one log share.
#[derive(Debug, Default)]
struct Decoder {
    calendar: Calendar,
    locks: Locks,
}

impl<R: Read> Log<R> {
    /// A log from its beginning; `near` is a time within three days of it, for messages without a week.
    pub fn new(input: R, near: Option<Epoch>) -> Self {
        let decoder = Decoder { calendar: Calendar::new(near), ..Decoder::default() };
        Self { frames: Frames::new(input), decoder, tallies: BTreeMap::new() }
    }

    /// Frames as they were found so far, with their counts.
    pub fn frames(&self) -> &Frames<R> {
        &self.frames
    }

    /// Counts so far.
    pub fn contents(&self) -> Contents {
        let count = |protocol: Protocol| (protocol, self.frames.count_of(protocol));
        let messages = self.tallies.iter().map(|((protocol, name), tally)| (*protocol, name.clone(), *tally));
        Contents {
            protocols: Protocol::ALL.map(count).into_iter().filter(|(_, count)| count.frames > 0).collect(),
            skipped_bytes: self.frames.skipped_bytes,
            messages: messages.collect(),
        }
    }

    fn message(&mut self, frame: &Frame) -> Message {
        let Decoder { calendar, locks } = &mut self.decoder;
        let (name, is_known, table, event) = match frame.protocol {
            Protocol::Ubx => {
                let (name, layout, table) = ubx::read(&frame.bytes);
                let event = table.as_ref().and_then(|table| ubx::event(table, calendar, locks));
                (name, layout.is_some(), table, event)
            }
            Protocol::Rtcm => {
                let content = rtcm::read(&frame.bytes, calendar, locks);
                (content.name, content.is_known, content.table, content.event)
            }
            Protocol::Sbf => {
                let content = sbf::read(&frame.bytes, calendar, locks);
                (content.name, content.is_known, content.table, content.event)
            }
            Protocol::Nmea => (sentence(&frame.bytes), false, None, None),
        };
        let tally = self.tallies.entry((frame.protocol, name.clone())).or_default();
        tally.count += 1;
        tally.read += u64::from(table.is_some());
        tally.malformed += u64::from(is_known && table.is_none());
        Message { protocol: frame.protocol, offset: frame.offset, name, table, event }
    }
}

impl<R: Read> Iterator for Log<R> {
    type Item = io::Result<Message>;

    fn next(&mut self) -> Option<Self::Item> {
        let frame = self.frames.next()?;
        Some(frame.map(|frame| self.message(&frame)))
    }
}

/// Messages of a protocol of which the judge needs one.
pub fn needed(protocol: Protocol) -> &'static str {
    match protocol {
        Protocol::Ubx => ubx::NEEDED,
        Protocol::Rtcm => rtcm::NEEDED,
        Protocol::Sbf => sbf::NEEDED,
        Protocol::Nmea => "GGA in an NMEA file",
    }
}

/// Talker and kind of a sentence.
fn sentence(bytes: &[u8]) -> String {
    let word = bytes.iter().skip(1).take(10).take_while(|byte| byte.is_ascii_alphanumeric());
    word.map(|byte| char::from(*byte)).collect()
}

#[cfg(test)]
#[path = "log_tests.rs"]
mod tests;
