//! Finds pages in soft symbols, normal or inverted, and hands on what they carry.

use super::{CNAV, PAGE_SYMBOLS, PATTERN, PATTERN_SYMBOLS, decode_soft, parameters};
use crate::bits::bits_of;
use crate::fec::frames::Frames;
use crate::message::{Read, Reader};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Wrong symbols of the pattern of a position that is tried all the same: of a page at the least C/N0 that
/// codes hold one in twenty is wrong.
const WRONG_SYMBOLS: usize = 3;

/// Reads C/NAV.
#[derive(Clone, Debug)]
pub struct CnavReader {
    sv: Sv,
    pages: Frames,
}

impl CnavReader {
    /// Creates a reader that has received no symbols.
    pub fn new(sv: Sv) -> Self {
        Self { sv, pages: Frames::new(PAGE_SYMBOLS) }
    }
}

/// True if the symbols may begin with the pattern, normal or inverted.
fn may_begin(symbols: &[f32]) -> bool {
    let pattern = bits_of(PATTERN, PATTERN_SYMBOLS);
    let wrong = symbols.iter().zip(pattern).filter(|(soft, bit)| (**soft < 0.0) != *bit).count();
    wrong.min(PATTERN_SYMBOLS - wrong) <= WRONG_SYMBOLS
}

impl Reader for CnavReader {
    fn take(&mut self, soft: f32, _: Epoch) -> Vec<Read> {
        let Some((page, inverted)) = self.pages.take(soft, may_begin, decode_soft) else { return Vec::new() };
        let rows = NavigationRow::each(self.sv, CNAV.name, 0, parameters(&page)).collect();
        vec![Read::Undated { symbols: PAGE_SYMBOLS as u64, inverted }, Read::Parameters(rows)]
    }

    fn skip(&mut self) {
        self.pages.skip();
    }

    fn doubt(&mut self) {
        self.pages.doubt();
    }

    fn missing(&self) -> Vec<u8> {
        Vec::new()
    }
}
