//! Finds frames in soft symbols, normal or inverted, and collects their content.
//!
//! Where a frame begins shows in the code word of its time, which is right by chance at times: the check of
//! subframe 2 decides.

use super::{FRAME, Frame, L1_NAV, OF_SET, SYMBOLS, coefficients_in, decode, of_electrons_in, of_set_in};
use crate::framed::{Content, Framed, Reported};
use crate::message::Read;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Reader of NavIC's message on L1.
pub type L1NavReader = Framed<L1NavContent>;

/// Content of a satellite's frames.
#[derive(Clone, Debug)]
pub struct L1NavContent {
    sv: Sv,
    reported: Reported,
}

impl Content for L1NavContent {
    type Frame = Frame;
    const SYMBOLS: usize = SYMBOLS;

    fn new(sv: Sv) -> Self {
        Self { sv, reported: Reported::default() }
    }

    fn may_begin(&self, symbols: &[f32]) -> bool {
        FRAME.may_begin(symbols)
    }

    fn decode(&self, symbols: &[f32]) -> Option<Frame> {
        decode(symbols)
    }

    fn read(&mut self, frame: Frame, _: u64, near: Epoch) -> Vec<Read> {
        if let Some(other) = frame.prn().filter(|prn| *prn != u128::from(self.sv.prn())) {
            return vec![Read::names_another("a frame", other)];
        }
        let sent = frame.sent_at(near);
        let (symbols, inverted) = (SYMBOLS as u64, frame.0.inverted);
        let mut news = vec![Read::Unit { symbols, of_week_s: frame.of_week_s(), inverted }, Read::Time(sent)];
        let set = OF_SET.decoded(self.sv, [&frame.0.two], sent);
        // A frame is of one ephemeris, and what it says besides bears its issue.
        let issue = u32::from(set.iode);
        if let Some(three) = frame.electrons() {
            news.push(Read::Ionosphere(coefficients_in(three)));
            news.push(Read::parameters(self.sv, &L1_NAV, issue, of_electrons_in(three)));
        }
        self.reported.take(L1_NAV.name, of_set_in(&frame.0.two), set, &mut news);
        news
    }

    fn missing(&self) -> Vec<u8> {
        self.reported.missing()
    }
}
