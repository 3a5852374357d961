//! Finds messages in soft symbols whose code runs on, whichever way up they come, and gathers what they say.
//!
//! Both polynomials have an odd number of taps, so that symbols upside down are bits upside down. A message
//! is decoded once the code's memory after it is there too.

use std::collections::{BTreeMap, VecDeque};

use super::{BITS, CODE, IONOSPHERE, MESSAGE_S, SYMBOLS, checked, elements, ionosphere, message_type, parameters};
use crate::gnss::bits::number;
use crate::gnss::message::{Message, Parameters, Read, Reader};
use crate::gnss::record::NavigationRow;
use crate::gnss::satellite::Sv;
use crate::gnss::time::{Epoch, WEEK_S};

/// Symbols before and after a message by which its first and last bits are as sure as the others: some
/// constraint lengths.
const MARGIN: usize = 80;
const WINDOW: usize = MARGIN + SYMBOLS + MARGIN;
/// Messages in a row that fail where they are expected before they are sought elsewhere.
const FAILURES: u32 = 4;
/// Types whose parameters make up a set.
const OF_SET: [u8; 3] = [10, 11, 30];

/// Reads CNAV.
#[derive(Clone, Debug)]
pub struct CnavReader {
    message: &'static Message,
    sv: Sv,
    /// The latest symbols, a message with margins at most; `next` numbers the one to come.
    symbols: VecDeque<f32>,
    next: u64,
    /// Number of the first symbol of some message, and messages that failed since the last one that did not.
    frame: Option<u64>,
    failures: u32,
    /// The latest messages by type.
    messages: BTreeMap<u8, Vec<bool>>,
    /// What the set that was reported last said.
    complete: Option<Parameters>,
}

impl CnavReader {
    /// A reader of one of the two messages that has read nothing.
    pub fn of(message: &'static Message, sv: Sv) -> Self {
        Self {
            message,
            sv,
            symbols: VecDeque::with_capacity(WINDOW),
            next: 0,
            frame: None,
            failures: 0,
            messages: BTreeMap::new(),
            complete: None,
        }
    }

    /// Where a message may begin in the window: a preamble followed by what ends in a right check. The window
    /// is decoded for both ways in which symbols may be pairs.
    fn search(&mut self) -> Option<(usize, Vec<bool>, bool)> {
        let soft = self.symbols.make_contiguous();
        for offset in 0..2 {
            let bits = CODE.decode_open(soft.get(offset..)?);
            for first in 0..bits.len().saturating_sub(BITS - 1) {
                for inverted in [false, true] {
                    let own: Vec<bool> = bits.get(first..first + BITS)?.iter().map(|bit| bit ^ inverted).collect();
                    // The preamble before the sum over all bits.
                    if number(own.get(..8)?) == 0x8B
                        && let Some(message) = checked(own)
                    {
                        return Some((offset + 2 * first, message, inverted));
                    }
                }
            }
        }
        None
    }

    /// The message that begins after the margin.
    fn decode(&mut self) -> Option<(Vec<bool>, bool)> {
        let bits = CODE.decode_open(self.symbols.make_contiguous());
        let own = bits.get(MARGIN / 2..MARGIN / 2 + BITS)?.to_vec();
        let flipped: Vec<bool> = own.iter().map(|bit| !bit).collect();
        checked(own).map(|bits| (bits, false)).or_else(|| checked(flipped).map(|bits| (bits, true)))
    }

    /// Takes a message that began so many symbols before the newest.
    fn read(&mut self, bits: Vec<bool>, inverted: bool, symbols: u64, near: Epoch) -> Vec<Read> {
        let of_week_s = self.begun_s(&bits);
        if number(bits.get(8..14).unwrap_or_default()) != u128::from(self.sv.number) {
            return Vec::new();
        }
        let mut news = vec![Read::Unit { symbols, of_week_s, inverted }];
        // The week is that of the message's beginning.
        news.extend(self.sent_at(&bits, near).map(Read::Time));
        let kind = message_type(&bits);
        if kind == IONOSPHERE {
            let all = parameters(&bits).unwrap_or_default();
            let raw = |name: &str| all.iter().find(|(other, _)| *other == name).map(|(_, raw)| *raw);
            news.extend(ionosphere(&raw).map(Read::Ionosphere));
        }
        if OF_SET.contains(&kind) {
            self.messages.insert(kind, bits);
            self.look_for_set(near, &mut news);
        }
        news
    }

    /// When a message of type 10 was sent, its week near `near`.
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
        if self.complete.as_ref() == Some(&all) {
            return;
        }
        let Some(sent) = self.sent_at(one, near) else { return };
        let Some(set) = elements(self.sv, messages, sent) else { return };
        self.complete = Some(all.clone());
        let rows = NavigationRow::each(self.sv, self.message.name, u32::from(set.iode), all).collect();
        news.push(Read::Ephemeris(Box::new(set)));
        news.push(Read::Parameters(rows));
    }
}

impl Reader for CnavReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        if self.symbols.len() == WINDOW {
            self.symbols.pop_front();
        }
        self.symbols.push_back(soft);
        self.next += 1;
        if self.symbols.len() < WINDOW {
            return Vec::new();
        }
        let begin = self.next - WINDOW as u64;
        match self.frame {
            Some(frame) => {
                let first = begin + MARGIN as u64;
                // The message that was found has been read.
                if first <= frame || !(first - frame).is_multiple_of(SYMBOLS as u64) {
                    return Vec::new();
                }
                if let Some((bits, inverted)) = self.decode() {
                    self.failures = 0;
                    return self.read(bits, inverted, self.next - first, near);
                }
                self.failures += 1;
                if self.failures >= FAILURES {
                    self.doubt();
                }
                Vec::new()
            }
            // Every place comes by within the margins.
            None if self.next.is_multiple_of(MARGIN as u64) => match self.search() {
                Some((place, bits, inverted)) => {
                    let first = begin + place as u64;
                    (self.frame, self.failures) = (Some(first), 0);
                    self.read(bits, inverted, self.next - first, near)
                }
                None => Vec::new(),
            },
            None => Vec::new(),
        }
    }

    fn skip(&mut self) {
        self.symbols.clear();
        self.doubt();
    }

    fn doubt(&mut self) {
        (self.frame, self.failures) = (None, 0);
    }

    fn missing(&self) -> Vec<u8> {
        OF_SET.into_iter().filter(|kind| !self.messages.contains_key(kind)).collect()
    }
}

/// Messages are some whole seconds, so that the week's end is the end of one.
const _: () = assert!(WEEK_S % (2 * MESSAGE_S) == 0);
