//! Finds pages in soft symbols, normal or inverted, and hands on what they carry.

use super::{CNAV, PAGE_SYMBOLS, PATTERN, PATTERN_SYMBOLS, decode_soft, parameters};
use crate::framed::{Content, Framed, Pattern};
use crate::message::Read;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Pattern of a page. Of a page at the least C/N0 that codes hold one symbol in twenty is wrong.
const BEGIN: Pattern = Pattern { bits: PATTERN, symbols: PATTERN_SYMBOLS, tolerated: 3 };

/// Reader of C/NAV.
pub type CnavReader = Framed<CnavContent>;

/// Content of a satellite's pages.
#[derive(Clone, Debug)]
pub struct CnavContent {
    sv: Sv,
}

impl Content for CnavContent {
    /// A page, and true if its symbols were inverted.
    type Frame = (Vec<bool>, bool);
    const SYMBOLS: usize = PAGE_SYMBOLS;

    fn new(sv: Sv) -> Self {
        Self { sv }
    }

    fn may_begin(&self, symbols: &[f32]) -> bool {
        BEGIN.begins(symbols)
    }

    fn decode(&self, symbols: &[f32]) -> Option<Self::Frame> {
        decode_soft(symbols)
    }

    fn read(&mut self, (page, inverted): Self::Frame, _: u64, _: Epoch) -> Vec<Read> {
        vec![
            Read::Undated { symbols: PAGE_SYMBOLS as u64, inverted },
            Read::parameters(self.sv, &CNAV, 0, parameters(&page)),
        ]
    }

    fn missing(&self) -> Vec<u8> {
        Vec::new()
    }
}
