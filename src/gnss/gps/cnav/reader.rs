//! Collects the content of messages found in soft symbols ([`Running`]).

use std::collections::BTreeMap;

use super::fields::DELAY;
use super::{BITS, IONOSPHERE, MESSAGE_S, elements, ionosphere, is_message, message_type, parameters};
use crate::bits::number;
use crate::fec::running::Running;
use crate::framed::Reported;
use crate::message::{Message, Parameters, Read, Reader, raw_of};
use crate::satellite::Sv;
use crate::time::{Epoch, WEEK_S};

/// Types whose parameters make up an ephemeris.
const OF_SET: [u8; 3] = [10, 11, 30];

/// Reads CNAV.
#[derive(Clone, Debug)]
pub struct CnavReader {
    message: &'static Message,
    sv: Sv,
    code: Running,
    /// The latest messages by type.
    messages: BTreeMap<u8, Vec<bool>>,
    reported: Reported,
}

impl CnavReader {
    /// Creates a reader of one of the two messages that has received no symbols.
    pub fn of(message: &'static Message, sv: Sv) -> Self {
        Self {
            message,
            sv,
            code: Running::new(BITS, is_message),
            messages: BTreeMap::new(),
            reported: Reported::default(),
        }
    }

    /// Takes a message that began so many symbols before the newest.
    fn read(&mut self, bits: Vec<bool>, inverted: bool, symbols: u64, near: Epoch) -> Vec<Read> {
        let of_week_s = self.begun_s(&bits);
        let named = number(bits.get(8..14).unwrap_or_default());
        if named != u128::from(self.sv.number) {
            return vec![Read::names_another("a message", named)];
        }
        let mut news = vec![Read::Unit { symbols, of_week_s, inverted }];
        // The week is that of the message's beginning.
        news.extend(self.sent_at(&bits, near).map(Read::Time));
        let kind = message_type(&bits);
        if kind == IONOSPHERE {
            let all = parameters(&bits).unwrap_or_default();
            let raw = |name: &str| raw_of(&all, name);
            news.extend(ionosphere(&raw).map(Read::Ionosphere));
            // Its reference time is that of its ephemeris, by which ephemerides are numbered.
            if let Some(issue) = raw("toc_5min") {
                let own = all.iter().filter(|(name, _)| DELAY.iter().any(|element| element.field.name == *name));
                news.push(Read::parameters(self.sv, self.message, issue as u32, own.copied().collect()));
            }
        }
        if OF_SET.contains(&kind) {
            self.messages.insert(kind, bits);
            self.look_for_set(near, &mut news);
        }
        news
    }

    /// Transmission time of a message of type 10, with its week near `near`.
    fn sent_at(&self, bits: &[bool], near: Epoch) -> Option<Epoch> {
        let week = number(bits.get(38..51)?) as i64;
        let begun_s = near.nearest_week(week, 8192) * WEEK_S + self.begun_s(bits);
        (message_type(bits) == 10).then(|| Epoch::new(begun_s, 0.0))
    }

    /// Seconds of the week at which a message began: its count is that of the one after.
    fn begun_s(&self, bits: &[bool]) -> i64 {
        let count = bits.get(20..37).map_or(0, number) as i64;
        (count * MESSAGE_S - planted!("gnss.cnav.count", self.message.unit_s, 0)).rem_euclid(WEEK_S)
    }

    fn look_for_set(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let own = OF_SET.map(|kind| self.messages.get(&kind));
        let [Some(one), Some(two), Some(three)] = own else { return };
        let messages = [one, two, three];
        let all: Parameters = messages.into_iter().filter_map(parameters).flatten().collect();
        let Some(sent) = self.sent_at(one, near) else { return };
        let set = || elements(self.sv, messages, sent);
        self.reported.take_whole(self.message.name, all, (set, "messages 10, 11 and 30"), news);
    }
}

impl Reader for CnavReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let found = self.code.take(soft);
        found.map_or_else(Vec::new, |found| self.read(found.bits, found.inverted, found.symbols, near))
    }

    fn skip(&mut self) {
        self.code.skip();
    }

    fn doubt(&mut self) {
        self.code.doubt();
    }

    fn missing(&self) -> Vec<u8> {
        OF_SET.into_iter().filter(|kind| !self.messages.contains_key(kind)).collect()
    }
}

/// Messages are some whole seconds, so that the week's end is the end of one.
const _: () = assert!(WEEK_S % (2 * MESSAGE_S) == 0);
