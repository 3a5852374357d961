//! Readers of messages whose frames have one length: [`Frames`] finds a frame, [`Content`] takes what it
//! carries.

use std::fmt;

use crate::broadcast::Ephemeris;
use crate::fec::frames::Frames;
use crate::message::{Parameters, Read, Reader};
use crate::record::NavigationRow;
use crate::time::Epoch;

/// Content of the frames of one satellite.
pub trait Content: Clone + fmt::Debug + Send + Sync {
    /// Frame whose checks are right.
    type Frame;
    /// Number of symbols of a frame.
    const SYMBOLS: usize;
    /// Frames in a row that fail where they are expected before they are sought elsewhere.
    const FAILURES: u32 = 4;

    /// True if a frame may begin with the first of these symbols, as many as a frame has.
    fn may_begin(&self, symbols: &[f32]) -> bool;
    /// Decodes the symbols of a frame, normal or inverted. `None` if its checks fail.
    fn decode(&self, symbols: &[f32]) -> Option<Self::Frame>;
    /// Takes a frame that ends with the newest symbol. `begin` is the number of its first symbol. `near`
    /// resolves weeks.
    fn read(&mut self, frame: Self::Frame, begin: u64, near: Epoch) -> Vec<Read>;
    /// Forgets what depends on the numbers of symbols, which no longer tell where frames are.
    fn forget_places(&mut self) {}
    /// Parts of an ephemeris that have not been decoded.
    fn missing(&self) -> Vec<u8>;
    /// Takes a time that is known to within a year.
    fn know(&mut self, _near: Epoch) {}
}

/// Reader of a message whose frames have one length.
#[derive(Clone, Debug)]
pub struct Framed<C> {
    frames: Frames,
    content: C,
}

impl<C: Content> Framed<C> {
    /// Creates a reader that has received no symbols.
    pub(crate) fn of(content: C) -> Self {
        Self { frames: Frames::new(C::SYMBOLS, C::FAILURES), content }
    }
}

impl<C: Content> Reader for Framed<C> {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let (content, was_known) = (&self.content, self.frames.are_known());
        let found = self.frames.take(soft, |symbols| content.may_begin(symbols), |symbols| content.decode(symbols));
        if was_known && !self.frames.are_known() {
            self.content.forget_places();
        }
        found.map_or_else(Vec::new, |(frame, begin)| self.content.read(frame, begin, near))
    }

    fn know(&mut self, near: Epoch) {
        self.content.know(near);
    }

    fn skip(&mut self) {
        self.frames.skip();
        self.content.forget_places();
    }

    fn doubt(&mut self) {
        self.frames.doubt();
        self.content.forget_places();
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

    /// True before the first ephemeris.
    pub fn is_none(&self) -> bool {
        self.last.is_none()
    }

    /// Reports the ephemeris that `set` makes of parameters, unless it was the last. `parts` names what makes
    /// none, which is told until the first ephemeris.
    pub fn take(
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
            news.extend(self.is_none().then(|| Read::make_no_set(parts)));
            return;
        };
        self.last = Some(content);
        let rows = NavigationRow::each(set.sv, message, u32::from(set.iode), all).collect();
        news.push(Read::Ephemeris(Box::new(set)));
        news.push(Read::Parameters(rows));
    }
}
