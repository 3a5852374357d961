//! Sub-frame of one satellite: 15 pages of which some may be missing.

use std::collections::BTreeMap;

use crate::bits::Row;
use crate::fields::{DsmHeader, NmaHeader};
use crate::page::{PAGES, Page};
use crate::time::Gst;

/// Bits of the MAC and key section of a page.
const MACK_PAGE_BITS: usize = 32;
/// Bits of the MAC and key section of a sub-frame.
pub(crate) const MACK_BITS: usize = PAGES * MACK_PAGE_BITS;
/// Bytes of a block of a digital signature message.
pub(crate) const BLOCK_BYTES: usize = 13;

/// Pages of one satellite and one sub-frame.
#[derive(Clone, Debug)]
pub(crate) struct Subframe {
    pub(crate) sender: u8,
    pub(crate) start: Gst,
    pages: [Option<Page>; PAGES],
    /// Largest delay, in seconds, that any of its pages may have by the receiver's own clock.
    pub(crate) delay_bound_s: f64,
}

impl Subframe {
    pub(crate) fn new(sender: u8, start: Gst) -> Self {
        Self { sender, start, pages: [None; PAGES], delay_bound_s: f64::NEG_INFINITY }
    }

    /// Puts a page where it belongs; returns false if a page was there already.
    pub(crate) fn put(&mut self, page: &Page, delay_bound_s: f64) -> bool {
        let Some(slot) = self.pages.get_mut(page.index()) else { return false };
        if slot.is_some() {
            return false;
        }
        *slot = Some(*page);
        self.delay_bound_s = self.delay_bound_s.max(delay_bound_s);
        true
    }

    /// False if the field of all pages is the same, as satellites send that do not authenticate: zeros, or a
    /// pattern. A section with a key and tags cannot repeat a page 15 times.
    pub(crate) fn is_signed(&self) -> bool {
        let mut fields = self.pages.iter().flatten().map(|page| (page.hkroot(), page.mack()));
        let Some(first) = fields.next() else { return false };
        if first == (0, 0) {
            return fields.any(|field| field != first);
        }
        let mut others = fields.peekable();
        others.peek().is_none() || others.any(|field| field != first)
    }

    /// NMA header, which the first page has.
    pub(crate) fn nma_header(&self) -> Option<NmaHeader> {
        self.pages[0].map(|page| NmaHeader(page.hkroot()))
    }

    /// Block of a digital signature message, if all pages are there.
    pub(crate) fn dsm_block(&self) -> Option<(DsmHeader, [u8; BLOCK_BYTES])> {
        let header = DsmHeader(self.pages[1]?.hkroot());
        let mut block = [0; BLOCK_BYTES];
        for (byte, page) in block.iter_mut().zip(&self.pages[2..]) {
            *byte = page.as_ref()?.hkroot();
        }
        Some((header, block))
    }

    /// Bits of the MAC and key section, if their pages are there.
    pub(crate) fn mack(&self, first: usize, count: usize) -> Option<Row> {
        let mut row = Row::default();
        for bit in first..first + count {
            let page = self.pages.get(bit / MACK_PAGE_BITS)?.as_ref()?;
            row.push(u128::from(page.mack() >> (MACK_PAGE_BITS - 1 - bit % MACK_PAGE_BITS) & 1), 1);
        }
        Some(row)
    }

    /// Bits of the section as a number, 64 at most.
    pub(crate) fn mack_value(&self, first: usize, count: usize) -> Option<u64> {
        self.mack(first, count).map(|row| crate::bits::leading(row.bytes(), count))
    }

    /// Words by their type; the last of a type counts.
    pub(crate) fn words(&self) -> BTreeMap<u8, u128> {
        let words = self.pages.iter().flatten().map(Page::word);
        words.map(|word| ((word >> 122) as u8, word)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(index: u32, field: u64) -> Page {
        Page::new(7, Gst::new(1251, 30 + 2 * index + 1), 0, 1 << 119 | u128::from(field) << 62)
    }

    #[test]
    fn a_field_that_is_the_same_in_all_pages_is_no_authentication() {
        let full = |field: fn(u32) -> u64| {
            let mut subframe = Subframe::new(7, Gst::new(1251, 30));
            (0..15).for_each(|index| assert!(subframe.put(&page(index, field(index)), 0.0)));
            subframe
        };
        assert!(!full(|_| 0).is_signed());
        assert!(!full(|_| 0xaa_aaaa_aaaa).is_signed());
        assert!(full(|index| u64::from(index) << 32).is_signed());
    }

    #[test]
    fn bits_of_a_missing_page_are_missing_and_the_others_are_not() {
        let mut subframe = Subframe::new(7, Gst::new(1251, 30));
        (0..15).filter(|&index| index != 3).for_each(|index| {
            subframe.put(&page(index, 0x80_0000_0001), 0.0);
        });
        assert!(!subframe.put(&page(2, 0), 0.0));
        assert_eq!(subframe.mack_value(0, 33), Some(2));
        assert_eq!(subframe.mack_value(80, 17), None);
        assert_eq!(subframe.mack_value(127, 2), None);
        assert!(subframe.mack(MACK_BITS - 128, 128).is_some());
        assert!(subframe.mack(MACK_BITS - 128, 129).is_none());
        assert!(subframe.dsm_block().is_none());
    }
}
