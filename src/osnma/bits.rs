//! Rows of bits, the most significant first, as keys, tags and the data under a tag are sent.

use std::fmt;

/// Row of bits; the last byte is filled with zeros.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct Row {
    bytes: Vec<u8>,
    length: usize,
}

impl Row {
    /// Appends the low `count` bits of a value, 128 at most.
    pub fn push(&mut self, value: u128, count: usize) {
        for shift in (0..count).rev() {
            if self.length.is_multiple_of(8) {
                self.bytes.push(0);
            }
            let bit = (value >> shift & 1) as u8;
            if let Some(last) = self.bytes.last_mut() {
                *last |= bit << (7 - self.length % 8);
            }
            self.length += 1;
        }
    }

    /// Appends bytes.
    pub fn push_bytes(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.push(byte.into(), 8));
    }

    /// Appends another row.
    pub fn push_row(&mut self, other: &Self) {
        for index in 0..other.length {
            let byte = other.bytes.get(index / 8).copied().unwrap_or_default();
            self.push(u128::from(byte >> (7 - index % 8) & 1), 1);
        }
    }

    /// Appends zeros.
    pub fn push_zeros(&mut self, count: usize) {
        (0..count).for_each(|_| self.push(0, 1));
    }

    /// Number of bits.
    pub fn len(&self) -> usize {
        self.length
    }

    /// True if there is no bit.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Bytes, of which the last is filled with zeros.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

impl fmt::Debug for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bits {}", self.length, hex(&self.bytes))
    }
}

/// Value of `count` bits of a number that has `width`, from the bit `first` on; the first sent is bit 0.
pub(crate) fn part(value: u128, width: u32, first: u32, count: u32) -> u128 {
    let moved = value >> (width - first - count);
    if count >= 128 { moved } else { moved & ((1 << count) - 1) }
}

/// First `count` bits of bytes, 64 at most; missing bytes are zero.
pub(crate) fn leading(bytes: &[u8], count: usize) -> u64 {
    let all = bytes.iter().chain(std::iter::repeat(&0)).take(8).fold(0_u64, |all, &byte| all << 8 | u64::from(byte));
    if count == 0 { 0 } else { all >> (64 - count.min(64)) }
}

/// Hexadecimal digits of bytes, in capitals.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}

/// Bytes of hexadecimal digits, or the position of the first character that is none; an odd count of digits
/// names the end.
///
/// # Errors
/// Position of the character, from 0.
pub fn unhex(text: &str) -> Result<Vec<u8>, usize> {
    let digits: Vec<u8> = text
        .chars()
        .enumerate()
        .map(|(at, digit)| digit.to_digit(16).map(|digit| digit as u8).ok_or(at))
        .collect::<Result<_, _>>()?;
    let pairs = digits.chunks_exact(2);
    if pairs.remainder().is_empty() {
        Ok(pairs.map(|pair| pair[0] << 4 | pair[1]).collect())
    } else {
        Err(digits.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_joined_across_bytes_and_the_last_byte_is_filled_with_zeros() {
        let mut row = Row::default();
        row.push(0b101, 3);
        row.push(0x1ff, 9);
        let mut twice = Row::default();
        twice.push_row(&row);
        twice.push_row(&row);
        assert_eq!((row.bytes(), row.len()), (&[0b1011_1111, 0b1111_0000][..], 12));
        assert_eq!((twice.bytes(), twice.len()), (&[0b1011_1111, 0b1111_1011, 0xff][..], 24));
    }

    #[test]
    fn a_digit_that_is_none_is_named_by_its_position() {
        assert_eq!(unhex("0aF0"), Ok(vec![0x0a, 0xf0]));
        assert_eq!(unhex("0aG0"), Err(2));
        assert_eq!(unhex("0a0"), Err(3));
        assert_eq!(hex(&[0x0a, 0xf0]), "0AF0");
    }
}
