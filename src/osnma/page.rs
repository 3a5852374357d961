//! Nominal pages of I/NAV on E1-B as a recording has them: an even and an odd part of 120 bits each.
//!
//! Source: Galileo OS SIS ICD 2.1, 4.3.2. A row of a recording is `TOW,WN,SV,240 bits as hexadecimal digits`,
//! the form of the published OSNMA test vectors. TOW is the second at which the page begins, an odd one on
//! E1-B. Limits: alert pages carry no word and no authentication and are refused by name.

use thiserror::Error;

use crate::bits::{part, unhex};
use crate::time::{Gst, WEEK_S};
use gnss::crc::crc24q;
use gnss::satellite::{Sv, System};

/// Bits of a part of a page, with its tail.
const PART_BITS: u32 = 120;
/// Satellites that Galileo numbers (OS SIS ICD 2.1, 3.5).
pub const SATELLITES: std::ops::RangeInclusive<u8> = 1..=36;
/// Pages of a sub-frame.
pub const PAGES: usize = 15;

/// Page of two seconds, its check not yet made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Page {
    /// Number of the satellite, from 1 to 36.
    pub sender: u8,
    /// Second at which the page begins.
    pub start: Gst,
    even: u128,
    odd: u128,
}

/// Reason for which a page is not used.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum PageError {
    /// Bits that fail the check.
    #[error("the page's checksum is wrong")]
    Checksum,
    /// Parts that are not an even and an odd one of a nominal page.
    #[error("not an even and an odd part of a nominal page")]
    Parts,
}

/// Reason for which a row of a recording is no page.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum RowError {
    /// A count of cells that is not four.
    #[error("expected 4 cells (TOW,WN,SV,page), found {0}")]
    Cells(usize),
    /// A number that its cell cannot hold.
    #[error("{cell} = {found:?}: expected a whole number from {least} to {most}")]
    Number {
        /// Name of the cell.
        cell: &'static str,
        /// Text of the cell.
        found: String,
        /// Least value.
        least: u32,
        /// Largest value.
        most: u32,
    },
    /// A page of another length.
    #[error("page: expected 60 hexadecimal digits (240 bits), found {0} characters")]
    Length(usize),
    /// A character that is no hexadecimal digit.
    #[error("page: expected a hexadecimal digit at character {0}")]
    Digit(usize),
}

impl Page {
    /// Page of its two parts, of which each has 120 low bits.
    pub fn new(sender: u8, start: Gst, even: u128, odd: u128) -> Self {
        Self { sender, start, even, odd }
    }

    /// Reads a row of a recording.
    ///
    /// # Errors
    /// [`RowError`].
    pub fn from_row(row: &str) -> Result<Self, RowError> {
        let cells: Vec<&str> = row.split(',').map(str::trim).collect();
        let [tow, week, number, page] = cells[..] else { return Err(RowError::Cells(cells.len())) };
        let tow_s = whole("TOW", tow, 0, WEEK_S - 1)?;
        let week = whole("WN", week, 0, 4095)?;
        let number = whole("SV", number, (*SATELLITES.start()).into(), (*SATELLITES.end()).into())?;
        if page.chars().count() != 60 {
            return Err(RowError::Length(page.chars().count()));
        }
        let bytes = unhex(page).map_err(|at| RowError::Digit(at + 1))?;
        let (even, odd) = bytes.split_at(15);
        let joined = |bytes: &[u8]| bytes.iter().fold(0_u128, |all, &byte| all << 8 | u128::from(byte));
        Ok(Self::new(number as u8, Gst::new(week as u16, tow_s), joined(even), joined(odd)))
    }

    /// Row of a recording, as [`Self::from_row`] reads it.
    pub fn row(&self) -> String {
        let Self { sender, start, even, odd } = self;
        format!("{},{},{sender},{even:030X}{odd:030X}", start.tow_s(), start.week())
    }

    /// Holds the page to its form and its check of 24 bits (OS SIS ICD 2.1, 5.1.9.4).
    ///
    /// # Errors
    /// [`PageError`].
    pub fn check(&self) -> Result<(), PageError> {
        // The first bit is 0 in an even part and 1 in an odd one, the second is 0 in a nominal page.
        if part(self.even, PART_BITS, 0, 2) != 0b00 || part(self.odd, PART_BITS, 0, 2) != 0b10 {
            return Err(PageError::Parts);
        }
        let bits = |value: u128, first: u32, count: u32| {
            (first..first + count).map(move |at| part(value, PART_BITS, at, 1) == 1)
        };
        let checked = bits(self.even, 0, 114).chain(bits(self.odd, 0, 106));
        if crc24q(checked) == 0 { Ok(()) } else { Err(PageError::Checksum) }
    }

    /// Word of 128 bits.
    pub fn word(&self) -> u128 {
        part(self.even, PART_BITS, 2, 112) << 16 | part(self.odd, PART_BITS, 2, 16)
    }

    /// Eight bits of the header and root key section (ICD, 3.1).
    pub fn hkroot(&self) -> u8 {
        part(self.odd, PART_BITS, 18, 8) as u8
    }

    /// Bits of the MAC and key section: 32.
    pub fn mack(&self) -> u32 {
        part(self.odd, PART_BITS, 26, 32) as u32
    }

    /// Position of the page in its sub-frame, from 0 to 14.
    pub fn index(&self) -> usize {
        (self.start.since_s(self.start.subframe()) / 2) as usize
    }
}

/// Satellite of a Galileo number.
pub fn satellite(number: u8) -> Sv {
    Sv { system: System::Galileo, number }
}

fn whole(cell: &'static str, found: &str, least: u32, most: u32) -> Result<u32, RowError> {
    let error = || RowError::Number { cell, found: found.to_owned(), least, most };
    let digits = !found.is_empty() && found.bytes().all(|byte| byte.is_ascii_digit());
    let value = if digits { found.parse().map_err(|_| error())? } else { return Err(error()) };
    if (least..=most).contains(&value) { Ok(value) } else { Err(error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Page that satellite E02 sent on 2023-08-16, as recorded.
    const ROW: &str = "277201,1251,2,021333662A4249DD4A6EBB4CAE1900BD2A5C9E8497BA6AAAAA6A9778C100";

    #[test]
    fn a_recorded_page_passes_its_check_and_a_changed_bit_fails_it() {
        let page = Page::from_row(ROW).unwrap();
        assert_eq!((page.sender, page.start, page.index()), (2, Gst::new(1251, 277_201), 0));
        assert_eq!(page.check(), Ok(()));
        assert_eq!((page.word() >> 122, page.row().as_str()), (2, ROW));
        let changed = Page::from_row(&ROW.replace("277201,1251,2,0213", "277201,1251,2,0212")).unwrap();
        assert_eq!(changed.check(), Err(PageError::Checksum));
        let swapped = Page { even: page.odd, odd: page.even, ..page };
        assert_eq!(swapped.check(), Err(PageError::Parts));
    }

    #[test]
    fn a_row_that_is_no_page_is_refused_with_its_cell() {
        let refused = |row: &str| Page::from_row(row).unwrap_err();
        assert_eq!(refused("1,2,3"), RowError::Cells(3));
        assert!(refused(&ROW.replace("277201", "604800")).to_string().contains("TOW = \"604800\": expected"));
        assert!(refused(&ROW.replace("1251", "-1")).to_string().starts_with("WN"));
        assert!(refused(&ROW.replace(",2,", ",37,")).to_string().contains("from 1 to 36"));
        assert_eq!(refused(&ROW[..ROW.len() - 1]), RowError::Length(59));
        assert_eq!(refused(&ROW.replace("C100", "C1x0")), RowError::Digit(59));
    }
}
