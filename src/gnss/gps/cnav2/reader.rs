//! Finds frames in soft symbols, normal or inverted, and collects their content.
//!
//! Where a frame begins shows in the code word of its time, which is right by chance at times: the check of
//! subframe 2 decides.

use super::{CNAV2, FRAME, Frame, OF_SET, SYMBOLS, decode, klobuchar, of_set_in};
use crate::framed::{Content, Framed, Reported};
use crate::ionosphere::Coefficients;
use crate::message::Read;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Reader of CNAV-2.
pub type Cnav2Reader = Framed<Cnav2Content>;

/// Content of a satellite's frames.
#[derive(Clone, Debug)]
pub struct Cnav2Content {
    sv: Sv,
    /// The latest page 1.
    page_1: Option<Vec<bool>>,
    reported: Reported,
}

impl Content for Cnav2Content {
    type Frame = Frame;
    const SYMBOLS: usize = SYMBOLS;

    fn new(sv: Sv) -> Self {
        Self { sv, page_1: None, reported: Reported::default() }
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
        let unit = Read::Unit { symbols: SYMBOLS as u64, of_week_s: frame.of_week_s(), inverted: frame.0.inverted };
        let mut news = vec![unit, Read::Time(sent)];
        if let Some(page_1) = frame.page_1() {
            self.page_1 = Some(page_1.clone());
            news.push(Read::Ionosphere(Coefficients::Klobuchar(klobuchar(page_1))));
        }
        let Some(beside) = &self.page_1 else { return news };
        let all = of_set_in(&frame.0.two, beside);
        let set = OF_SET.decoded(self.sv, [&frame.0.two, beside], sent);
        self.reported.take(CNAV2.name, all, set, &mut news);
        news
    }

    fn missing(&self) -> Vec<u8> {
        self.reported.missing()
    }
}
