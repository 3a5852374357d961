//! Finds frames in soft symbols, normal or inverted, and collects their content.
//!
//! Where a frame begins shows in the code word of its time, which is right by chance at times: the check of
//! subframe 2 decides.

use super::{CNAV2, FRAME, Frame, SYMBOLS, decode, elements, klobuchar, of_set_in};
use crate::fec::frames::Frames;
use crate::ionosphere::Coefficients;
use crate::message::{Parameters, Read, Reader};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Least agreement of 52 symbols with a time at which a frame is tried. Symbols with an amplitude of √2
/// standard deviations, near which the codes begin to fail, agree by 0.89 ± 0.05. The best of all times among
/// data symbols agrees by less than half.
const LEAST_SHARE: f32 = 0.65;

/// Reads CNAV-2.
#[derive(Clone, Debug)]
pub struct Cnav2Reader {
    sv: Sv,
    frames: Frames,
    /// The latest page 1.
    page_1: Option<Vec<bool>>,
    /// Parameters of the ephemeris that was reported last.
    complete: Option<Parameters>,
}

impl Cnav2Reader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self { sv, frames: Frames::new(SYMBOLS), page_1: None, complete: None }
    }

    /// Takes a frame that ends with the newest symbol.
    fn read(&mut self, frame: &Frame, near: Epoch) -> Vec<Read> {
        if let Some(other) = frame.prn().filter(|prn| *prn != u128::from(self.sv.prn())) {
            return vec![Read::names_another("a frame", other)];
        }
        let sent = frame.sent_at(near);
        let unit = Read::Unit { symbols: SYMBOLS as u64, of_week_s: frame.of_week_s(), inverted: frame.inverted };
        let mut news = vec![unit, Read::Time(sent)];
        if let Some(page_1) = frame.page_1() {
            self.page_1 = Some(page_1.clone());
            news.push(Read::Ionosphere(Coefficients::Klobuchar(klobuchar(page_1))));
        }
        let Some(beside) = &self.page_1 else { return news };
        let all = of_set_in(&frame.two, beside);
        if self.complete.as_ref() != Some(&all) {
            let set = elements(self.sv, &frame.two, beside, sent);
            let rows = NavigationRow::each(self.sv, CNAV2.name, u32::from(set.iode), all.clone()).collect();
            self.complete = Some(all);
            news.push(Read::Ephemeris(Box::new(set)));
            news.push(Read::Parameters(rows));
        }
        news
    }
}

impl Reader for Cnav2Reader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let may_begin = |symbols: &[f32]| FRAME.likely_times(symbols).1 > LEAST_SHARE;
        let found = self.frames.take(soft, may_begin, decode);
        found.map_or_else(Vec::new, |frame| self.read(&frame, near))
    }

    fn skip(&mut self) {
        self.frames.skip();
    }

    fn doubt(&mut self) {
        self.frames.doubt();
    }

    fn missing(&self) -> Vec<u8> {
        if self.complete.is_some() { Vec::new() } else { vec![1] }
    }
}
