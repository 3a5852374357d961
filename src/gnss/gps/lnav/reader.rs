//! Finds subframes in the symbols of a satellite, normal or inverted, and collects their content.
//!
//! Two headers a whole number of subframes apart, or one whole subframe with its parity, show where subframes
//! begin. Source: IS-GPS-200N, 20.3.2 to 20.3.5. Limits: a word with a wrong bit is lost.

use std::collections::{BTreeMap, VecDeque};

use super::{PREAMBLE, SUBFRAME_S, Subframe, TOW_COUNTS, check_parity, ephemeris};
use crate::ionosphere::Coefficients;
use crate::message::{Read, Reader, raw_of};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::{Epoch, WEEK_S};

/// Bits of a subframe, of a word, and of the two words that carry preamble and time.
const SUBFRAME_BITS: u64 = 300;
const WORD_BITS: usize = 30;
const HEADER_BITS: usize = 60;
/// The last bits of the word before, which parity needs.
const STARRED_BITS: usize = 2;
/// Headers are remembered for so many subframes while a second one is awaited.
const HEADER_MEMORY: u64 = 4 * SUBFRAME_BITS;
const PREAMBLE_INVERTED: u32 = !PREAMBLE & 0xFF;

/// A header that passed its own checks.
#[derive(Clone, Copy, Debug)]
struct Header {
    /// Number of the bit with which the subframe begins.
    bit: u64,
    tow_count: u32,
    inverted: bool,
}

/// Reads LNAV.
#[derive(Clone, Debug)]
pub struct LnavReader {
    sv: Sv,
    /// The latest bits; `first_bit` numbers the oldest.
    bits: VecDeque<bool>,
    first_bit: u64,
    headers: VecDeque<Header>,
    /// Number of the first bit of some subframe.
    frame: Option<u64>,
    subframes: BTreeMap<u8, Subframe>,
    complete: Option<[Subframe; 3]>,
}

impl LnavReader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self {
            sv,
            bits: VecDeque::new(),
            first_bit: 0,
            headers: VecDeque::new(),
            frame: None,
            subframes: BTreeMap::new(),
            complete: None,
        }
    }

    /// The `count` bits that end `back` bits before the newest.
    fn word(&self, back: usize, count: usize) -> Option<u32> {
        let end = self.bits.len().checked_sub(back)?;
        let begin = end.checked_sub(count)?;
        Some(self.bits.range(begin..end).fold(0, |word, bit| (word << 1) | u32::from(*bit)))
    }

    /// Number of the bit after the newest.
    fn next_bit(&self) -> u64 {
        self.first_bit + self.bits.len() as u64
    }

    /// Looks at the newest two words as telemetry and handover words.
    fn header(&self) -> Option<Header> {
        let previous = self.word(HEADER_BITS, STARRED_BITS)?;
        let telemetry = self.word(WORD_BITS, WORD_BITS)?;
        let found = telemetry >> 22;
        if found != PREAMBLE && found != PREAMBLE_INVERTED {
            return None;
        }
        let handover = self.word(0, WORD_BITS)?;
        let inverted = previous & 1 == 1;
        if check_parity(telemetry, previous)? >> 16 != PREAMBLE || (handover ^ previous) & 3 != 0 {
            return None;
        }
        let data = check_parity(handover, telemetry)?;
        let (tow_count, id) = (data >> 7, (data >> 2) & 7);
        // Word 10 of the subframe before ends in 00 (IS-GPS-200N, 20.3.3.2), or 11 inverted.
        let upright = previous == if inverted { 3 } else { 0 };
        let plausible = upright && tow_count < TOW_COUNTS && (1..=5).contains(&id);
        plausible.then_some(Header { bit: self.next_bit() - HEADER_BITS as u64, tow_count, inverted })
    }

    fn look_for_header(&mut self, news: &mut Vec<Read>) {
        let Some(header) = self.header() else { return };
        if let Some(frame) = self.frame {
            if (header.bit.abs_diff(frame)).is_multiple_of(SUBFRAME_BITS) {
                news.push(self.begun(header));
            }
            return;
        }
        while self.headers.front().is_some_and(|old| header.bit - old.bit > HEADER_MEMORY) {
            self.headers.pop_front();
        }
        let follows = |old: &Header| {
            let bits = header.bit - old.bit;
            let count = (bits / SUBFRAME_BITS) as u32;
            bits.is_multiple_of(SUBFRAME_BITS)
                && (old.tow_count + count) % TOW_COUNTS == header.tow_count
                && old.inverted == header.inverted
        };
        if self.headers.iter().any(follows) {
            self.frame = Some(header.bit);
            news.push(self.begun(header));
        } else {
            self.headers.push_back(header);
        }
    }

    /// The time at which the subframe of a trusted header began.
    fn begun(&self, header: Header) -> Read {
        let count = i64::from(header.tow_count) - planted!("gnss.lnav.handover_read", 1, 0);
        Read::Unit {
            symbols: self.next_bit() - header.bit,
            of_week_s: count.rem_euclid(i64::from(TOW_COUNTS)) * SUBFRAME_S,
            inverted: header.inverted,
        }
    }

    /// Looks at the newest 300 bits as a subframe.
    fn look_for_subframe(&mut self, near: Epoch, news: &mut Vec<Read>) {
        let bits = SUBFRAME_BITS as usize;
        if self.bits.len() < bits + STARRED_BITS {
            return;
        }
        let begin = self.next_bit() - SUBFRAME_BITS;
        if self.frame.is_some_and(|frame| !begin.abs_diff(frame).is_multiple_of(SUBFRAME_BITS)) {
            return;
        }
        let Some(previous) = self.word(bits, STARRED_BITS) else { return };
        let mut words = [0; 10];
        for (number, word) in words.iter_mut().enumerate() {
            let Some(value) = self.word(bits - WORD_BITS * (number + 1), WORD_BITS) else { return };
            *word = value;
        }
        if words[0] >> 22 != PREAMBLE && words[0] >> 22 != PREAMBLE_INVERTED && self.frame.is_none() {
            return;
        }
        match Subframe::decode(&words, previous) {
            Ok(subframe) => {
                // Ten words with parity are beyond chance: they show the frame by themselves.
                self.frame = Some(begin);
                let inverted = previous & 1 == 1;
                news.push(self.begun(Header { bit: begin, tow_count: subframe.tow_count, inverted }));
                self.read(subframe, near, news);
            }
            Err(error) if error.is_read() => news.push(Read::Refused(error.to_string())),
            Err(_) => {}
        }
    }

    fn read(&mut self, subframe: Subframe, near: Epoch, news: &mut Vec<Read>) {
        if let Some(klobuchar) = subframe.klobuchar() {
            news.push(Read::Ionosphere(Coefficients::Klobuchar(klobuchar)));
            news.push(Read::parameters(self.sv, &super::LNAV, 0, subframe.parameters()));
        }
        if !(1..=3).contains(&subframe.id) {
            return;
        }
        if subframe.id == 1 {
            let week = raw_of(&subframe.parameters(), "week");
            if let Some(week) = week {
                let count = (i64::from(subframe.tow_count) - 1).rem_euclid(i64::from(TOW_COUNTS));
                let week = near.nearest_week(week, 1024);
                news.push(Read::Time(Epoch::new(week * WEEK_S + count * SUBFRAME_S, 0.0)));
            }
        }
        self.subframes.insert(subframe.id, subframe);
        let (Some(one), Some(two), Some(three)) =
            (self.subframes.get(&1), self.subframes.get(&2), self.subframes.get(&3))
        else {
            return;
        };
        // Words 1 and 2 carry no elements and change with every subframe.
        let same = |a: &Subframe, b: &Subframe| a.data[2..] == b.data[2..];
        if self.complete.is_some_and(|[a, b, c]| same(&a, one) && same(&b, two) && same(&c, three)) {
            return;
        }
        let ephemeris = match ephemeris(self.sv, one, two, three, near) {
            Ok(ephemeris) => ephemeris,
            Err(error) => {
                news.extend(self.complete.is_none().then(|| Read::Refused(error.to_string())));
                return;
            }
        };
        let set = [*one, *two, *three];
        let issue = u32::from(ephemeris.iode);
        let rows = set
            .iter()
            .flat_map(|part| NavigationRow::each(self.sv, super::LNAV.name, issue, part.parameters()))
            .collect();
        self.complete = Some(set);
        news.push(Read::Ephemeris(Box::new(ephemeris)));
        news.push(Read::Parameters(rows));
    }
}

impl Reader for LnavReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let mut news = Vec::new();
        self.bits.push_back(soft < 0.0);
        let longest = SUBFRAME_BITS as usize + STARRED_BITS;
        if self.bits.len() > longest {
            self.bits.pop_front();
            self.first_bit += 1;
        }
        self.look_for_header(&mut news);
        self.look_for_subframe(near, &mut news);
        news
    }

    fn skip(&mut self) {
        self.bits.clear();
        self.first_bit = 0;
        self.doubt();
    }

    fn doubt(&mut self) {
        self.headers.clear();
        self.frame = None;
    }

    fn missing(&self) -> Vec<u8> {
        (1..=3).filter(|id| !self.subframes.contains_key(id)).collect()
    }
}
