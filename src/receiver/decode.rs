//! Message symbols become subframes, subframes become satellite time and ephemerides.
//!
//! A channel locks to the carrier upside down as often as not; the preamble and the parity of ten words tell. From
//! the first good subframe on, the time of every code period is known, to the code's own precision.

use std::collections::{BTreeMap, VecDeque};

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::gps::lnav::{self, Subframe};
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::record::NavigationRow;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::{Component, Message};
use crate::gnss::time::{Epoch, WEEK_S};
use crate::receiver::track::Symbol;

/// Bits of a subframe and seconds that it takes (IS-GPS-200N, 20.3.2).
const SUBFRAME_BITS: usize = 300;
const SUBFRAME_S: i64 = 6;
/// Subframes in a row that may fail before the frame is searched again.
const MOST_FAILURES: u32 = 3;
/// The first eight bits of a subframe (IS-GPS-200N, 20.3.3.1).
const PREAMBLE: u32 = 0x8B;

/// Satellite time of a channel's code periods: period `period` began at `second` by the satellite's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeTag {
    pub period: u64,
    /// Second of the GPS week.
    pub second_of_week: i64,
}

/// What a new symbol completed.
#[derive(Clone, Debug)]
pub enum Found {
    /// The frame is known, and whether the channel's carrier is upside down.
    Frame {
        inverted: bool,
    },
    Ephemeris(Box<Ephemeris>),
    Klobuchar(Klobuchar),
    Rows(Vec<NavigationRow>),
}

/// The decoder of one channel.
#[derive(Clone, Debug)]
pub struct Decoder {
    sv: Sv,
    message: Message,
    bits: VecDeque<(bool, u64)>,
    synchronised: Option<Synchronised>,
    subframes: BTreeMap<u8, Subframe>,
    issue: Option<u16>,
    tag: Option<TimeTag>,
}

#[derive(Clone, Copy, Debug)]
struct Synchronised {
    inverted: bool,
    /// Bits until the next subframe is whole.
    left: usize,
    failures: u32,
}

impl Decoder {
    /// A decoder of the message that a component carries; `None` for a pilot.
    pub fn new(sv: Sv, component: &Component) -> Option<Self> {
        let message = component.message?;
        Some(Self {
            sv,
            message,
            bits: VecDeque::new(),
            synchronised: None,
            subframes: BTreeMap::new(),
            issue: None,
            tag: None,
        })
    }

    /// Takes a symbol; `near` resolves the week number modulo 1024.
    pub fn push(&mut self, symbol: &Symbol, near: Epoch, found: &mut Vec<Found>) {
        match self.message {
            Message::GpsLnav => self.push_lnav(symbol, near, found),
        }
    }

    fn push_lnav(&mut self, symbol: &Symbol, near: Epoch, found: &mut Vec<Found>) {
        if self.bits.len() == SUBFRAME_BITS {
            self.bits.pop_front();
        }
        self.bits.push_back((symbol.soft < 0.0, symbol.first_period));
        if self.bits.len() < SUBFRAME_BITS {
            return;
        }
        let Some(mut state) = self.synchronised else {
            self.search(near, found);
            return;
        };
        state.left = state.left.saturating_sub(1);
        if state.left == 0 {
            state.left = SUBFRAME_BITS;
            match self.open(state.inverted) {
                Some(subframe) => {
                    state.failures = 0;
                    self.take(subframe, near, found);
                }
                None => state.failures += 1,
            }
        }
        self.synchronised = (state.failures < MOST_FAILURES).then_some(state);
    }

    /// Looks whether the last 300 bits are a subframe, either way up.
    fn search(&mut self, near: Epoch, found: &mut Vec<Found>) {
        let first = self.bits.iter().take(8).fold(0, |word, bit| (word << 1) | u32::from(bit.0));
        let inverted = match first {
            PREAMBLE => false,
            other if other == !PREAMBLE & 0xFF => true,
            _ => return,
        };
        if let Some(subframe) = self.open(inverted) {
            self.synchronised = Some(Synchronised { inverted, left: SUBFRAME_BITS, failures: 0 });
            found.push(Found::Frame { inverted });
            self.take(subframe, near, found);
        }
    }

    fn open(&self, inverted: bool) -> Option<Subframe> {
        let mut words = [0_u32; 10];
        for (index, bit) in self.bits.iter().enumerate() {
            let word = words.get_mut(index / 30)?;
            *word = (*word << 1) | u32::from(bit.0 != inverted);
        }
        // Words two and ten end in 00 by design, so the last two bits before any subframe are 0.
        Subframe::decode(&words, 0).ok()
    }

    fn take(&mut self, subframe: Subframe, near: Epoch, found: &mut Vec<Found>) {
        if let Some(&(_, period)) = self.bits.front() {
            // The count is that of the next subframe's beginning (IS-GPS-200N, 20.3.3.2).
            let second_of_week = (i64::from(subframe.tow_count) * SUBFRAME_S - SUBFRAME_S).rem_euclid(WEEK_S);
            self.tag = Some(TimeTag { period, second_of_week });
        }
        if let Some(klobuchar) = subframe.klobuchar() {
            found.push(Found::Klobuchar(klobuchar));
            found.push(Found::Rows(self.rows(&subframe, 0)));
        }
        if subframe.id > 3 {
            return;
        }
        self.subframes.insert(subframe.id, subframe);
        let (Some(one), Some(two), Some(three)) =
            (self.subframes.get(&1), self.subframes.get(&2), self.subframes.get(&3))
        else {
            return;
        };
        // Sets of different issues are refused there; the next frame completes the new one.
        let Ok(ephemeris) = lnav::ephemeris(self.sv, one, two, three, near) else { return };
        if self.issue != Some(ephemeris.iodc) {
            self.issue = Some(ephemeris.iodc);
            let issue = u32::from(ephemeris.iode);
            let rows = [one, two, three].into_iter().flat_map(|subframe| self.rows(subframe, issue)).collect();
            found.push(Found::Rows(rows));
            found.push(Found::Ephemeris(Box::new(ephemeris)));
        }
    }

    fn rows(&self, subframe: &Subframe, issue: u32) -> Vec<NavigationRow> {
        subframe
            .parameters()
            .into_iter()
            .map(|(parameter, raw)| NavigationRow { sv: self.sv, issue, parameter: parameter.to_owned(), raw })
            .collect()
    }

    /// The time of the channel's code periods, once known.
    pub fn tag(&self) -> Option<TimeTag> {
        self.tag.filter(|_| self.synchronised.is_some())
    }

    /// Of subframes 1 to 3, those not yet received.
    pub fn missing(&self) -> Vec<u8> {
        (1..=3).filter(|id| !self.subframes.contains_key(id)).collect()
    }
}

#[cfg(test)]
mod tests;
