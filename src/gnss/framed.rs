//! Readers of messages whose frames have one length: [`Frames`] finds a frame, [`Content`] takes what it
//! carries.

use std::fmt;

use crate::bits::bits_of;
use crate::broadcast::Ephemeris;
use crate::fec::frames::Frames;
use crate::message::{Parameters, Read, Reader};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Symbols that begin or end a frame.
#[derive(Clone, Copy, Debug)]
pub struct Pattern {
    /// Bits of the pattern, the last one sent in the lowest bit.
    pub bits: u128,
    /// Number of its symbols.
    pub symbols: usize,
    /// Number of symbols that may be wrong.
    pub tolerated: usize,
}

impl Pattern {
    /// Number of soft symbols that agree with the pattern. A logical 1 is negative.
    fn agreeing(&self, soft: &[f32]) -> usize {
        soft.iter().zip(bits_of(self.bits, self.symbols)).filter(|(soft, one)| (**soft < 0.0) == *one).count()
    }

    /// True if soft symbols begin with the pattern, normal or inverted.
    pub fn begins(&self, soft: &[f32]) -> bool {
        let agreeing = self.agreeing(soft);
        agreeing.min(self.symbols - agreeing) <= self.tolerated
    }

    /// True if soft symbols begin with the inverted pattern rather than the normal one.
    pub fn is_inverted(&self, soft: &[f32]) -> bool {
        2 * self.agreeing(soft) < self.symbols
    }
}

/// Content of the frames of one satellite.
pub trait Content: Clone + fmt::Debug + Send + Sync {
    /// Frame whose checks are right.
    type Frame;
    /// Number of symbols of a frame.
    const SYMBOLS: usize;
    /// Frames in a row that fail where they are expected before they are sought elsewhere.
    const FAILURES: u32 = 4;

    /// Content of a satellite before the first frame.
    fn new(sv: Sv) -> Self;
    /// True if a frame may begin with the first of these symbols, as many as a frame has.
    fn may_begin(&self, symbols: &[f32]) -> bool;
    /// Decodes the symbols of a frame, normal or inverted. `None` if its checks fail.
    fn decode(&self, symbols: &[f32]) -> Option<Self::Frame>;
    /// Takes a frame that ends with the newest symbol. `begin` is the number of its first symbol. `near`
    /// resolves weeks.
    fn read(&mut self, frame: Self::Frame, begin: u64, near: Epoch) -> Vec<Read>;
    /// Forgets what depends on the numbers of symbols, which no longer tell where frames are.
    fn forget_positions(&mut self) {}
    /// Parts of an ephemeris that have not been decoded.
    fn missing(&self) -> Vec<u8>;
    /// Takes a time that is known to within a year.
    fn know(&mut self, _near: Epoch) {}
    /// Hands on whole pages from here on.
    fn keep_pages(&mut self) {}
}

/// Reader of a message whose frames have one length.
#[derive(Clone, Debug)]
pub struct Framed<C> {
    frames: Frames,
    content: C,
}

impl<C: Content> Framed<C> {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self::of(C::new(sv))
    }

    /// Creates a reader that continues content.
    pub(crate) fn of(content: C) -> Self {
        Self { frames: Frames::new(C::SYMBOLS, C::FAILURES), content }
    }
}

impl<C: Content> Reader for Framed<C> {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let (content, was_known) = (&self.content, self.frames.are_known());
        let found = self.frames.take(soft, |symbols| content.may_begin(symbols), |symbols| content.decode(symbols));
        if was_known && !self.frames.are_known() {
            self.content.forget_positions();
        }
        found.map_or_else(Vec::new, |(frame, begin)| self.content.read(frame, begin, near))
    }

    fn know(&mut self, near: Epoch) {
        self.content.know(near);
    }

    fn keep_pages(&mut self) {
        self.content.keep_pages();
    }

    fn skip(&mut self) {
        self.frames.skip();
        self.content.forget_positions();
    }

    fn doubt(&mut self) {
        self.frames.doubt();
        self.content.forget_positions();
    }

    fn missing(&self) -> Vec<u8> {
        self.content.missing()
    }
}

/// Ephemeris that was reported last, by its raw parameters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reported {
    last: Option<Parameters>,
    /// Parameters that change while the ephemeris stays.
    passing: &'static [&'static str],
}

impl Reported {
    /// State before the first ephemeris, of which these parameters are no part.
    pub fn without(passing: &'static [&'static str]) -> Self {
        Self { last: None, passing }
    }

    /// Numbers of the units that are missing, where one unit has a whole ephemeris: 1 before the first.
    pub fn missing(&self) -> Vec<u8> {
        if self.last.is_none() { vec![1] } else { Vec::new() }
    }

    /// Reports an ephemeris of parameters, unless it was the last.
    pub fn take(&mut self, message: &'static str, all: Parameters, set: Ephemeris, news: &mut Vec<Read>) {
        self.take_whole(message, all, (|| Some(set), ""), news);
    }

    /// Reports the ephemeris that `set` makes of parameters, unless it was the last. `parts` names what may
    /// make none, which is told until the first ephemeris.
    pub fn take_whole(
        &mut self,
        message: &'static str,
        all: Parameters,
        (set, parts): (impl FnOnce() -> Option<Ephemeris>, &str),
        news: &mut Vec<Read>,
    ) {
        let content: Parameters = all.iter().filter(|(name, _)| !self.passing.contains(name)).copied().collect();
        if self.last.as_ref() == Some(&content) {
            return;
        }
        let Some(set) = set() else {
            news.extend(self.last.is_none().then(|| Read::make_no_set(parts)));
            return;
        };
        self.last = Some(content);
        let rows = NavigationRow::each(set.sv, message, u32::from(set.iode), all).collect();
        news.push(Read::Ephemeris(Box::new(set)));
        news.push(Read::Parameters(rows));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_is_there_with_as_many_wrong_symbols_as_are_tolerated_either_way_up() {
        let pattern = Pattern { bits: 0b1101_0010, symbols: 8, tolerated: 1 };
        let sent = [-1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 7.0];
        for sign in [1.0_f32, -1.0] {
            let wrong = |count: usize| -> Vec<f32> {
                sent.iter().enumerate().map(|(k, soft)| sign * if k < count { -soft } else { *soft }).collect()
            };
            assert_eq!([0, 1, 2, 4].map(|count| pattern.begins(&wrong(count))), [true, true, false, false]);
            assert_eq!([0, 1].map(|count| pattern.is_inverted(&wrong(count))), [sign < 0.0; 2]);
        }
    }
}
