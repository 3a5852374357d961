//! Pages of a pattern and one convolutional code word: data, their check and a tail of zeros, interleaved.
//!
//! Source: Galileo OS SIS ICD 2.1, 4.2.2 (F/NAV); Galileo HAS SIS ICD 1.0 (C/NAV); IRNSS SIS ICD for SPS
//! 1.1, data structure. Limits: where a page begins is for its reader to find.

use super::convolutional::Convolutional;
use super::interleaver::Interleaver;
use crate::bits::{bits_of, upright};
use crate::crc::{CHECK_BITS, is_checked, with_check};

/// A form of pages.
pub(crate) struct Form {
    /// Symbols of the pattern, the last one sent in the lowest bit, and their number.
    pub pattern: (u128, usize),
    /// Number of bits before the check.
    pub data_bits: usize,
    /// Number of zeros after the check.
    pub tail_bits: usize,
    /// Code of the bits.
    pub code: fn() -> Convolutional,
    /// Interleaver of the coded symbols.
    pub interleaver: Interleaver,
}

impl Form {
    /// Bits of the pattern.
    pub fn pattern(&self) -> impl Iterator<Item = bool> {
        bits_of(self.pattern.0, self.pattern.1)
    }

    /// The symbols of data after the pattern, with check and tail.
    pub fn coded(&self, data: &[bool]) -> Vec<bool> {
        let mut bits = with_check(data.to_vec());
        bits.resize(bits.len() + self.tail_bits, false);
        self.interleaver.interleave(&(self.code)().encode(&bits))
    }

    /// The data in soft symbols after the pattern, not inverted; `None` where the check is wrong.
    pub fn data(&self, coded: &[f32]) -> Option<Vec<bool>> {
        let mut bits = (self.code)().decode(&self.interleaver.deinterleave(coded));
        bits.truncate(self.data_bits + CHECK_BITS);
        let is_right = is_checked(&bits);
        bits.truncate(self.data_bits);
        is_right.then_some(bits)
    }

    /// The data in the soft symbols of a page, and whether they are inverted, by the sum over the pattern.
    /// `None` where the check is wrong.
    pub fn decode(&self, symbols: &[f32]) -> Option<(Vec<bool>, bool)> {
        let length = self.pattern.1 + 2 * (self.data_bits + CHECK_BITS + self.tail_bits);
        let (head, coded) = symbols.split_at_checked(self.pattern.1).filter(|_| symbols.len() == length)?;
        let sum: f32 = head.iter().zip(self.pattern()).map(|(soft, bit)| if bit { -soft } else { *soft }).sum();
        let inverted = sum < 0.0;
        Some((self.data(&upright(coded, inverted))?, inverted))
    }
}
