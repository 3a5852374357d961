//! From symbols to messages: frame synchronisation, subframes, satellite time, ephemeris.
//!
//! A [`Decoder`] belongs to one channel. It finds the frame in the symbols whichever way up the carrier locked, ties
//! the channel's code period number to the satellite's time of week, and gathers what the satellite says.
//! Source: IS-GPS-200N, 20.3.2 to 20.3.5. Limits: GPS LNAV is the only message; a word with a wrong bit is lost.

use std::collections::{BTreeMap, VecDeque};

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::gps::lnav::{self, PREAMBLE, SUBFRAME_S, Subframe, check_parity};
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::record::NavigationRow;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{Component, Message, Signal};
use crate::gnss::time::{Epoch, WEEK_S};
use crate::receiver::track::Symbol;

/// Bits of a subframe, of a word, and of the two words that carry preamble and time.
const SUBFRAME_BITS: u64 = 300;
const WORD_BITS: usize = 30;
const HEADER_BITS: usize = 60;
/// The last bits of the word before, which parity needs.
const STARRED_BITS: usize = 2;
/// Headers are remembered for so many subframes while a second one is awaited.
const HEADER_MEMORY: u64 = 4 * SUBFRAME_BITS;
/// Subframes in a week.
const WEEK_SUBFRAMES: u32 = (WEEK_S / SUBFRAME_S) as u32;
const PREAMBLE_INVERTED: u32 = !PREAMBLE & 0xFF;

/// What a symbol completed.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// The frame was found: the satellite's time is known from here on.
    FrameSynchronised,
    /// Whether the symbols arrive upside down, as the latest header showed.
    Polarity { inverted: bool },
    /// The time that the latest header says contradicts the frame: synchronisation starts anew.
    Contradiction,
    /// Start of a subframe 1, with the week that it says, resolved near the given epoch.
    Time(Epoch),
    /// Subframes 1 to 3 of one issue are together.
    Ephemeris(Box<Ephemeris>),
    /// The ionosphere's parameters.
    Klobuchar(Klobuchar),
    /// Raw parameters as decoded.
    Parameters(Vec<NavigationRow>),
}

/// Satellite time of a code period: periods since the start of the week, modulo a week.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Anchor {
    period: u64,
    of_week: i64,
}

/// A header that passed its own checks.
#[derive(Clone, Copy, Debug)]
struct Header {
    /// Number of the bit with which the subframe begins.
    bit: u64,
    tow_count: u32,
    inverted: bool,
}

/// Reads the message of one channel.
#[derive(Clone, Debug)]
pub struct Decoder {
    sv: Sv,
    periods_per_symbol: u64,
    periods_per_second: i64,
    /// The latest bits and the code periods in which they began; `first_bit` numbers the oldest.
    bits: VecDeque<(bool, u64)>,
    first_bit: u64,
    headers: VecDeque<Header>,
    /// Number of the first bit of some subframe.
    frame: Option<u64>,
    anchor: Option<Anchor>,
    subframes: BTreeMap<u8, Subframe>,
    complete: Option<[Subframe; 3]>,
    decoded: u64,
    failed: u64,
}

impl Decoder {
    /// A decoder of the first message of `signal`; `None` for a pilot or a code without whole periods a second.
    pub fn new(signal: &Signal, sv: Sv) -> Option<Self> {
        let component: &Component = signal.components.iter().find(|component| component.message.is_some())?;
        let message = component.message?;
        match message {
            Message::GpsLnav => {}
        }
        let rate_hz = 1.0 / component.period_s();
        let periods_per_second = rate_hz.round();
        // Far from any rounding: a code that does not fit the second misses by more than a millionth.
        ((rate_hz - periods_per_second).abs() < 1e-6).then(|| Self {
            sv,
            periods_per_symbol: u64::from(message.periods_per_symbol()),
            periods_per_second: periods_per_second as i64,
            bits: VecDeque::new(),
            first_bit: 0,
            headers: VecDeque::new(),
            frame: None,
            anchor: None,
            subframes: BTreeMap::new(),
            complete: None,
            decoded: 0,
            failed: 0,
        })
    }

    /// Whether the satellite's time of week is known.
    pub fn is_synchronised(&self) -> bool {
        self.anchor.is_some()
    }

    /// Subframes decoded, and those of a known frame that failed their checks.
    pub fn subframe_counts(&self) -> (u64, u64) {
        (self.decoded, self.failed)
    }

    /// Those of subframes 1 to 3 that have not been decoded.
    pub fn missing(&self) -> Vec<u8> {
        (1..=3).filter(|id| !self.subframes.contains_key(id)).collect()
    }

    /// Time of week by the satellite's clock in the code period `period`, at `fraction` of it: whole seconds and
    /// a fraction. Exact in the periods. `None` before frame synchronisation.
    pub fn time_of_week(&self, period: u64, fraction: f64) -> Option<(i64, f64)> {
        let anchor = self.anchor?;
        let periods = anchor.of_week + (i128::from(period) - i128::from(anchor.period)) as i64;
        let periods = periods.rem_euclid(WEEK_S * self.periods_per_second);
        let whole = periods.div_euclid(self.periods_per_second);
        let fraction = planted!("receiver.observe.code_fraction", fraction, fraction + 3e-6);
        let rest = periods.rem_euclid(self.periods_per_second) as f64 + fraction;
        Some((whole, rest / self.periods_per_second as f64))
    }

    /// Takes the channel's next symbol. `near` resolves the 10-bit week.
    pub fn take(&mut self, symbol: &Symbol, near: Epoch) -> Vec<News> {
        let mut news = Vec::new();
        let expected = self.bits.back().map(|(_, period)| period + self.periods_per_symbol);
        if expected.is_some_and(|period| period != symbol.first_period) {
            // Symbols were lost. Bits are numbered by periods from here; the frame is looked for again, the time stays.
            self.bits.clear();
            self.headers.clear();
            self.frame = None;
            self.first_bit = 0;
        }
        self.bits.push_back((symbol.soft < planted!("receiver.decode.bit_threshold", 0.0, 80.0), symbol.first_period));
        let longest = SUBFRAME_BITS as usize + STARRED_BITS;
        if self.bits.len() > longest {
            self.bits.pop_front();
            self.first_bit += 1;
        }
        self.look_for_header(&mut news);
        self.look_for_subframe(near, &mut news);
        news
    }

    /// The `count` bits that end `back` bits before the newest.
    fn word(&self, back: usize, count: usize) -> Option<u32> {
        let end = self.bits.len().checked_sub(back)?;
        let begin = end.checked_sub(count)?;
        Some(self.bits.range(begin..end).fold(0, |word, (bit, _)| (word << 1) | u32::from(*bit)))
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
        // Word 10 of the subframe before ends in 00 (IS-GPS-200N, 20.3.3.2), or 11 upside down.
        let upright = previous == if inverted { 3 } else { 0 };
        let plausible = upright && tow_count < WEEK_SUBFRAMES && (1..=5).contains(&id);
        plausible.then_some(Header { bit: self.next_bit() - HEADER_BITS as u64, tow_count, inverted })
    }

    fn look_for_header(&mut self, news: &mut Vec<News>) {
        let Some(header) = self.header() else { return };
        if let Some(frame) = self.frame {
            if (header.bit.abs_diff(frame)).is_multiple_of(SUBFRAME_BITS) {
                self.tie(header, news);
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
                && (old.tow_count + count) % WEEK_SUBFRAMES == header.tow_count
                && old.inverted == header.inverted
        };
        if self.headers.iter().any(follows) {
            self.frame = Some(header.bit);
            self.tie(header, news);
        } else {
            self.headers.push_back(header);
        }
    }

    /// Ties period numbers to the time that a trusted header says.
    fn tie(&mut self, header: Header, news: &mut Vec<News>) {
        let index = header.bit.checked_sub(self.first_bit).map(|index| index as usize);
        let Some(&(_, period)) = index.and_then(|index| self.bits.get(index)) else { return };
        let start_s = (i64::from(header.tow_count) - planted!("receiver.decode.handover_count", 1, 0))
            .rem_euclid(i64::from(WEEK_SUBFRAMES))
            * SUBFRAME_S;
        let anchor = Anchor { period, of_week: start_s * self.periods_per_second };
        let week = WEEK_S * self.periods_per_second;
        match self.anchor {
            None => news.push(News::FrameSynchronised),
            Some(old) => {
                let passed = (i128::from(anchor.period) - i128::from(old.period)) as i64;
                if (old.of_week + passed - anchor.of_week).rem_euclid(week) != 0 {
                    self.anchor = None;
                    self.frame = None;
                    self.headers.clear();
                    news.push(News::Contradiction);
                    return;
                }
            }
        }
        self.anchor = Some(anchor);
        news.push(News::Polarity { inverted: planted!("receiver.decode.polarity", header.inverted, !header.inverted) });
    }

    /// Looks at the newest 300 bits as a subframe.
    fn look_for_subframe(&mut self, near: Epoch, news: &mut Vec<News>) {
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
                self.tie(Header { bit: begin, tow_count: subframe.tow_count, inverted }, news);
                self.decoded += 1;
                self.read(subframe, near, news);
            }
            Err(_) if self.frame.is_some() => self.failed += 1,
            Err(_) => {}
        }
    }

    fn read(&mut self, subframe: Subframe, near: Epoch, news: &mut Vec<News>) {
        if let Some(klobuchar) = subframe.klobuchar() {
            news.push(News::Klobuchar(klobuchar));
            news.push(News::Parameters(self.rows(&subframe, 0)));
        }
        if !(1..=3).contains(&subframe.id) {
            return;
        }
        if subframe.id == 1 {
            let week = subframe.parameters().iter().find(|(name, _)| *name == "week").map(|(_, raw)| *raw);
            if let Some(week) = week {
                let ahead = (week - near.week() + 512).rem_euclid(1024) - 512;
                let count = (i64::from(subframe.tow_count) - 1).rem_euclid(i64::from(WEEK_SUBFRAMES));
                news.push(News::Time(Epoch::new((near.week() + ahead) * WEEK_S + count * SUBFRAME_S, 0.0)));
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
        if let Ok(ephemeris) = lnav::ephemeris(self.sv, one, two, three, near) {
            let set = [*one, *two, *three];
            let rows = set.iter().flat_map(|part| self.rows(part, u32::from(ephemeris.iode))).collect();
            self.complete = Some(set);
            news.push(News::Ephemeris(Box::new(ephemeris)));
            news.push(News::Parameters(rows));
        }
    }

    fn rows(&self, subframe: &Subframe, issue: u32) -> Vec<NavigationRow> {
        let row =
            |(parameter, raw): (&str, i64)| NavigationRow { sv: self.sv, issue, parameter: parameter.to_owned(), raw };
        subframe.parameters().into_iter().map(row).collect()
    }
}

#[cfg(test)]
mod tests;
