//! Finds frames in soft symbols, normal or inverted, and collects their content.
//!
//! Where a frame begins shows in the code word of its time, which is right by chance at times: the check of
//! subframe 2 decides.

use super::{FRAME, Frame, L1_NAV, SYMBOLS, coefficients_in, decode, elements, of_electrons_in, of_set_in};
use crate::fec::frames::Frames;
use crate::message::{Parameters, Read, Reader};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Least agreement of 52 symbols with a time at which a frame is tried. Symbols with an amplitude of √2
/// standard deviations, near which the codes begin to fail, agree by 0.89 ± 0.05. The best of all times among
/// data symbols agrees by about half.
const LEAST_SHARE: f32 = 0.65;

/// Reads NavIC's message on L1.
#[derive(Clone, Debug)]
pub struct L1NavReader {
    sv: Sv,
    frames: Frames,
    /// Parameters of the ephemeris that was reported last.
    complete: Option<Parameters>,
}

impl L1NavReader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self { sv, frames: Frames::new(SYMBOLS), complete: None }
    }

    /// Takes a frame that ends with the newest symbol.
    fn read(&mut self, frame: &Frame, near: Epoch) -> Vec<Read> {
        if let Some(other) = frame.prn().filter(|prn| *prn != u128::from(self.sv.prn())) {
            return vec![Read::names_another("a frame", other)];
        }
        let sent = frame.sent_at(near);
        let (symbols, inverted) = (SYMBOLS as u64, frame.0.inverted);
        let mut news = vec![Read::Unit { symbols, of_week_s: frame.of_week_s(), inverted }, Read::Time(sent)];
        let set = elements(self.sv, &frame.0.two, sent);
        // A frame is of one ephemeris, and what it says besides bears its issue.
        let issue = u32::from(set.iode);
        if let Some(three) = frame.electrons() {
            news.push(Read::Ionosphere(coefficients_in(three)));
            news.push(Read::Parameters(self.rows(issue, of_electrons_in(three))));
        }
        let all = of_set_in(&frame.0.two);
        if self.complete.as_ref() != Some(&all) {
            let rows = self.rows(issue, all.clone());
            self.complete = Some(all);
            news.push(Read::Ephemeris(Box::new(set)));
            news.push(Read::Parameters(rows));
        }
        news
    }

    fn rows(&self, issue: u32, parameters: Parameters) -> Vec<NavigationRow> {
        NavigationRow::each(self.sv, L1_NAV.name, issue, parameters).collect()
    }
}

impl Reader for L1NavReader {
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
