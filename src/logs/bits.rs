//! Bits of a message in the order in which they are sent, the most significant first.

/// Reader of bits.
#[derive(Clone, Copy, Debug)]
pub struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bits<'a> {
    /// Bits of bytes, from the first one on.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Unsigned number of up to 64 bits; none where the message ends before it.
    pub fn unsigned(&mut self, count: usize) -> Option<u64> {
        if self.at + count > 8 * self.bytes.len() {
            return None;
        }
        let bit = |at: usize| self.bytes.get(at / 8).map_or(0, |byte| u64::from(byte >> (7 - at % 8) & 1));
        let number = (self.at..self.at + count).fold(0, |sum, at| sum << 1 | bit(at));
        self.at += count;
        Some(number)
    }

    /// Number in two's complement of 1 to 64 bits.
    pub fn signed(&mut self, count: usize) -> Option<i64> {
        let shift = 64 - count as u32;
        self.unsigned(count).map(|number| (number << shift) as i64 >> shift)
    }

    /// Text of so many bytes; those that are no printable ASCII become dots.
    pub fn text(&mut self, bytes: usize) -> Option<String> {
        let char_of = |byte: u64| match u8::try_from(byte) {
            Ok(byte) if byte.is_ascii_graphic() || byte == b' ' => char::from(byte),
            _ => '.',
        };
        (0..bytes).map(|_| self.unsigned(8).map(char_of)).collect()
    }
}

/// Writer of bits, the most significant of each number first.
#[derive(Clone, Debug, Default)]
pub struct Writer {
    bytes: Vec<u8>,
    count: usize,
}

impl Writer {
    /// Appends the lowest `count` bits of a number, 64 at most; of a negative one those of its two's
    /// complement.
    pub fn put(&mut self, number: i64, count: usize) {
        for place in (0..count.min(64)).rev() {
            if self.count.is_multiple_of(8) {
                self.bytes.push(0);
            }
            if let Some(last) = self.bytes.last_mut() {
                *last |= ((number >> place & 1) as u8) << (7 - self.count % 8);
            }
            self.count += 1;
        }
    }

    /// Bytes so far; the last one is filled up with zeros.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let numbers = [(5_i64, 3), (-1, 7), (i64::MIN, 64), (0, 1), (0x1_2345_6789, 33), (-8192, 14)];
        let mut writer = Writer::default();
        numbers.iter().for_each(|(number, count)| writer.put(*number, *count));
        let bytes = writer.into_bytes();
        let mut bits = Bits::new(&bytes);
        for (number, count) in numbers {
            let read = if number < 0 { bits.signed(count) } else { bits.unsigned(count).map(|read| read as i64) };
            assert_eq!(read, Some(number));
        }
        assert_eq!(bytes.len(), 122_usize.div_ceil(8));
    }

    #[test]
    fn numbers_follow_one_another_across_bytes() {
        let mut bits = Bits::new(&[0b1010_0111, 0b1111_0000, b'a']);
        assert_eq!([bits.unsigned(3), bits.unsigned(7)], [Some(0b101), Some(0b001_1111)]);
        assert_eq!(bits.signed(3), Some(-2));
        assert_eq!([bits.unsigned(3), bits.unsigned(9)], [Some(0), None]);
        assert_eq!(bits.text(1).as_deref(), Some("a"));
        assert_eq!(bits.unsigned(1), None);
    }
}
