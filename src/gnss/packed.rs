//! Packed recordings: samples that do not fill whole bytes, or that are interleaved with other channels.
//!
//! A [`Layout`] states which bits of a group of words are the samples of one channel; an [`Unpacker`] reads
//! them as a [`Format`] of whole bytes. Values of 1 to 4 bits lie in the middle of their step, at odd
//! numbers 1, 3, … to both sides of zero, as a quantiser without a zero has them: two's complement `x` is
//! `2x + 1`, sign and magnitude `±(2m + 1)`, offset binary `2x + 1 − 2^bits`, a sign alone `±1`. Of 8 and
//! 16 bits, two's complement is taken as it is and offset binary of 8 bits in the middle of its step.
//! A [`Packer`] writes what an [`Unpacker`] reads. Limits: no value lies across two words.

mod packer;

pub use packer::{CodeError, Packer};

use std::fmt;
use std::io::{self, Read};
use std::str::FromStr;

use thiserror::Error;

use crate::samples::Format;

/// Bytes that are read at once, about.
const READ_BYTES: usize = 1 << 16;
/// Most words of a group.
const MOST_WORDS: usize = 1 << 12;

/// Encoding of a value in its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// One bit: 1 is positive.
    Sign,
    /// One bit: 1 is negative.
    NegativeSign,
    /// The highest bit is the sign, 1 negative; the others are the magnitude.
    SignMagnitude,
    /// Two's complement.
    TwosComplement,
    /// The lowest value is 0.
    Offset,
}

/// A name that no encoding has.
#[derive(Debug, Error, PartialEq)]
#[error("unknown encoding '{0}': expected sign, negative-sign, sign-magnitude, twos-complement or offset")]
pub struct EncodingError(String);

impl Encoding {
    /// All encodings with their names.
    pub const NAMES: [(Self, &'static str); 5] = [
        (Self::Sign, "sign"),
        (Self::NegativeSign, "negative-sign"),
        (Self::SignMagnitude, "sign-magnitude"),
        (Self::TwosComplement, "twos-complement"),
        (Self::Offset, "offset"),
    ];

    /// The value of a code of so many bits.
    fn value(self, code: u32, bits: u32) -> i32 {
        let (code, half) = (code as i32, 1_i32 << (bits - 1));
        let signed = if code >= half { code - 2 * half } else { code };
        match self {
            Self::Sign => 2 * code - 1,
            Self::NegativeSign => 1 - 2 * code,
            Self::SignMagnitude if code >= half => planted!("gnss.packed.magnitude", -1, 1) * (2 * (code - half) + 1),
            Self::SignMagnitude => 2 * code + 1,
            Self::TwosComplement if bits >= 8 => signed,
            Self::TwosComplement => 2 * signed + planted!("gnss.packed.middle", 1, 0),
            Self::Offset => 2 * code + 1 - 2 * half,
        }
    }
}

impl fmt::Display for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(Self::NAMES.iter().find(|(encoding, _)| encoding == self).map_or("", |(_, name)| name))
    }
}

impl FromStr for Encoding {
    type Err = EncodingError;

    fn from_str(text: &str) -> Result<Self, EncodingError> {
        let wanted = text.trim().to_ascii_lowercase().replace('_', "-").replace('\'', "");
        let found = Self::NAMES.iter().find(|(_, name)| *name == wanted);
        found.map(|(encoding, _)| *encoding).ok_or_else(|| EncodingError(text.to_owned()))
    }
}

/// Components of a sample and their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Components {
    /// One.
    Real,
    /// I first, then Q.
    Iq,
    /// Q first, then I.
    Qi,
}

impl Components {
    /// Number of components.
    fn count(self) -> u32 {
        if self == Self::Real { 1 } else { 2 }
    }
}

/// Reason for which a bit layout cannot describe samples.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum LayoutError {
    /// A width that nothing is written in.
    #[error("{0} bits a value: expected 1, 2, 3, 4, 8 or 16")]
    Bits(u32),
    /// A width that an encoding does not have.
    #[error("{encoding} of {bits} bits: expected {expected}")]
    Encoding {
        /// The encoding.
        encoding: Encoding,
        /// The width.
        bits: u32,
        /// Values that are possible.
        expected: &'static str,
    },
    /// Floating point, of which a channel cannot be taken.
    #[error("several channels in floating point: expected integers")]
    Float,
    /// Words that no machine has.
    #[error("words of {0} bytes: expected 1, 2, 4 or 8")]
    Word(usize),
    /// No such channel.
    #[error("channel {channel} of {channels}: expected 1 to {channels}, and 64 channels at most")]
    Channel {
        /// The channel, from 1.
        channel: u32,
        /// Channels that there are.
        channels: u32,
    },
    /// A value that begins in one word and ends in the next.
    #[error("a value of {bits} bits across two words of {word_bytes} bytes: expected each in one word")]
    Across {
        /// The width.
        bits: u32,
        /// Bytes of a word.
        word_bytes: usize,
    },
    /// No sample, or more than a group holds.
    #[error("a group of {words} words has no room for its samples, or none of them")]
    Group {
        /// Words of the group.
        words: usize,
    },
}

/// Consecutive samples of one channel, or of several in turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interleaved {
    /// Bits of a value.
    pub bits: u32,
    /// Encoding of the values.
    pub encoding: Encoding,
    /// Values of a sample.
    pub components: Components,
    /// True if the first value occupies the lowest bits of a word; otherwise it occupies the highest.
    pub lowest_first: bool,
    /// Bytes of a word.
    pub word_bytes: usize,
    /// True if the highest byte of a word comes first.
    pub big_endian: bool,
    /// Channels, a sample of each in turn.
    pub channels: u32,
    /// The one that is read, from 1.
    pub channel: u32,
}

/// Assignment of the bits in a group of words to samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    word_bytes: usize,
    big_endian: bool,
    words: usize,
    bits: u32,
    encoding: Encoding,
    complex: bool,
    /// Word and shift of every value, in the order in which they go out.
    fields: Vec<(usize, u32)>,
}

impl Layout {
    /// The layout of samples that follow each other.
    ///
    /// # Errors
    /// [`LayoutError`].
    pub fn interleaved(of: &Interleaved) -> Result<Self, LayoutError> {
        let Interleaved { bits, encoding, components, lowest_first, word_bytes, big_endian, channels, channel } = *of;
        if channel == 0 || channel > channels || channels > 64 {
            return Err(LayoutError::Channel { channel, channels });
        }
        check(bits, encoding, word_bytes)?;
        let word_bits = 8 * word_bytes as u32;
        let slot_bits = channels * components.count() * bits;
        // As many words as a whole number of samples of all channels fills.
        let words = (slot_bits / common(slot_bits, word_bits)) as usize;
        let slots = words as u32 * word_bits / slot_bits;
        let first = (channel - 1) * components.count() * bits;
        let starts = (0..slots).map(|slot| first + slot * slot_bits);
        Self::of_fields(Group { word_bytes, big_endian, words, lowest_first }, (bits, encoding, components), starts)
    }

    /// Creates the layout of samples each of which begins at one of `starts`. Bits count from the group's
    /// first.
    ///
    /// # Errors
    /// [`LayoutError`].
    pub fn of_fields(
        group: Group,
        (bits, encoding, components): (u32, Encoding, Components),
        starts: impl Iterator<Item = u32>,
    ) -> Result<Self, LayoutError> {
        let Group { word_bytes, big_endian, words, lowest_first } = group;
        check(bits, encoding, word_bytes)?;
        let word_bits = 8 * word_bytes as u32;
        let order: &[u32] = match components {
            Components::Real => &[0],
            Components::Iq => planted!("gnss.packed.order", &[0, 1], &[1, 0]),
            Components::Qi => &[1, 0],
        };
        let mut fields = Vec::new();
        for start in starts {
            for place in order {
                let at = start + place * bits;
                let (word, within) = (at / word_bits, at % word_bits);
                if within + bits > word_bits {
                    return Err(LayoutError::Across { bits, word_bytes });
                }
                if word as usize >= words {
                    return Err(LayoutError::Group { words });
                }
                let lowest_first = planted!("gnss.packed.first", lowest_first, !lowest_first);
                let shift = if lowest_first { within } else { word_bits - bits - within };
                fields.push((word as usize, shift));
            }
        }
        if fields.is_empty() || words > MOST_WORDS {
            return Err(LayoutError::Group { words });
        }
        let complex = components != Components::Real;
        Ok(Self { word_bytes, big_endian, words, bits, encoding, complex, fields })
    }

    /// Format of the unpacked samples.
    pub fn format(&self) -> Format {
        let wide = self.bits > 8 || (self.bits == 8 && self.encoding != Encoding::TwosComplement);
        match (wide, self.complex) {
            (false, false) => Format::Ri8,
            (false, true) => Format::Ci8,
            (true, false) => Format::Ri16Le,
            (true, true) => Format::Ci16Le,
        }
    }

    /// Bytes of a group.
    pub fn group_bytes(&self) -> usize {
        self.word_bytes * self.words
    }

    /// Samples of a group.
    pub fn group_samples(&self) -> usize {
        self.fields.len() / if self.complex { 2 } else { 1 }
    }

    /// Unpacks the whole groups of `bytes` and appends their samples.
    pub fn unpack(&self, bytes: &[u8], out: &mut Vec<u8>) {
        let mask = (1_u64 << self.bits) - 1;
        // Few bits have few values: each is worked out once.
        let values: Vec<i32> = if self.bits > 8 {
            Vec::new()
        } else {
            (0..=mask as u32).map(|code| self.encoding.value(code, self.bits)).collect()
        };
        let wide = matches!(self.format(), Format::Ri16Le | Format::Ci16Le);
        let mut words = vec![0_u64; self.words];
        for group in bytes.chunks_exact(self.group_bytes()) {
            for (word, bytes) in words.iter_mut().zip(group.chunks_exact(self.word_bytes)) {
                let join = |word: u64, byte: &u8| word << 8 | u64::from(*byte);
                *word = if self.big_endian { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) };
            }
            for (word, shift) in &self.fields {
                let code = words.get(*word).map_or(0, |word| word >> shift & mask) as u32;
                let value = values.get(code as usize).copied();
                let value = value.unwrap_or_else(|| self.encoding.value(code, self.bits));
                if wide {
                    out.extend_from_slice(&(value as i16).to_le_bytes());
                } else {
                    out.push(value as i8 as u8);
                }
            }
        }
    }
}

/// The words that repeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    /// Bytes of a word.
    pub word_bytes: usize,
    /// True if the highest byte of a word comes first.
    pub big_endian: bool,
    /// Words of the group.
    pub words: usize,
    /// True if bits are counted from the lowest bit of a word; otherwise from the highest.
    pub lowest_first: bool,
}

fn check(bits: u32, encoding: Encoding, word_bytes: usize) -> Result<(), LayoutError> {
    let refuse = |expected| Err(LayoutError::Encoding { encoding, bits, expected });
    match (bits, encoding) {
        (1, Encoding::Sign | Encoding::NegativeSign) => {}
        (1, _) => return refuse("sign or negative-sign of 1 bit"),
        (_, Encoding::Sign | Encoding::NegativeSign) => return refuse("1 bit"),
        (2..=4, _) | (8, Encoding::TwosComplement | Encoding::Offset) | (16, Encoding::TwosComplement) => {}
        (8, _) => return refuse("twos-complement or offset of 8 bits"),
        (16, _) => return refuse("twos-complement of 16 bits"),
        _ => return Err(LayoutError::Bits(bits)),
    }
    if matches!(word_bytes, 1 | 2 | 4 | 8) { Ok(()) } else { Err(LayoutError::Word(word_bytes)) }
}

/// The greatest common divisor.
fn common(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { common(b, a % b) }
}

/// Reads packed samples as whole bytes.
pub struct Unpacker<R> {
    layout: Layout,
    reader: R,
    /// Bytes that are no whole group yet.
    packed: Vec<u8>,
    /// Samples, of which those before `taken` have gone out.
    samples: Vec<u8>,
    taken: usize,
}

impl<R: Read> Unpacker<R> {
    /// Reads what `layout` states from `reader`.
    pub fn new(layout: Layout, reader: R) -> Self {
        Self { layout, reader, packed: Vec::new(), samples: Vec::new(), taken: 0 }
    }
}

impl<R: Read> Read for Unpacker<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.samples.len() && !buffer.is_empty() {
            let kept = self.packed.len();
            self.packed.resize(kept + READ_BYTES, 0);
            let read = self.reader.read(self.packed.get_mut(kept..).unwrap_or_default());
            self.packed.truncate(kept + read.as_ref().map_or(0, |count| *count));
            if read? == 0 {
                return Ok(0);
            }
            let whole = self.packed.len() / self.layout.group_bytes() * self.layout.group_bytes();
            self.samples.clear();
            self.taken = 0;
            self.layout.unpack(self.packed.get(..whole).unwrap_or_default(), &mut self.samples);
            self.packed.drain(..whole);
        }
        let left = self.samples.get(self.taken..).unwrap_or_default();
        let count = left.len().min(buffer.len());
        for (to, from) in buffer.iter_mut().zip(left) {
            *to = *from;
        }
        self.taken += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Interleaved = Interleaved {
        bits: 2,
        encoding: Encoding::TwosComplement,
        components: Components::Real,
        lowest_first: false,
        word_bytes: 1,
        big_endian: false,
        channels: 1,
        channel: 1,
    };

    fn values(of: Interleaved, bytes: &[u8]) -> Vec<i8> {
        let layout = Layout::interleaved(&of).unwrap();
        let mut out = Vec::new();
        layout.unpack(bytes, &mut out);
        assert_eq!(out.len() % layout.format().bytes(), 0);
        out.into_iter().map(|byte| byte as i8).collect()
    }

    #[test]
    fn codes_are_values_in_the_middle_of_their_steps() {
        // 00 01 10 11, first in the highest bits.
        let bytes = [0b0001_1011];
        for (encoding, expected) in [
            (Encoding::TwosComplement, [1, 3, -3, -1]),
            (Encoding::SignMagnitude, [1, 3, -1, -3]),
            (Encoding::Offset, [-3, -1, 1, 3]),
        ] {
            assert_eq!(values(Interleaved { encoding, ..USUAL }, &bytes), expected, "{encoding}");
            let low = Interleaved { encoding, lowest_first: true, ..USUAL };
            let back: Vec<i8> = expected.into_iter().rev().collect();
            assert_eq!(values(low, &bytes), back, "{encoding}");
        }
        let signs = Interleaved { bits: 1, encoding: Encoding::Sign, ..USUAL };
        assert_eq!(values(signs, &[0b1000_0010]), [1, -1, -1, -1, -1, -1, 1, -1]);
        let signs = Interleaved { encoding: Encoding::NegativeSign, ..signs };
        assert_eq!(values(signs, &[0b1000_0010]), [-1, 1, 1, 1, 1, 1, -1, 1]);
        let four = Interleaved { bits: 4, ..USUAL };
        assert_eq!(values(four, &[0x07, 0x8f]), [1, 15, -15, -1]);
        // Every encoding is balanced: its values sum to nothing.
        for bits in [2, 3, 4] {
            for encoding in [Encoding::TwosComplement, Encoding::SignMagnitude, Encoding::Offset] {
                let sum: i32 = (0..1 << bits).map(|code| encoding.value(code, bits)).sum();
                assert_eq!(sum, 0, "{encoding} {bits}");
            }
        }
    }

    #[test]
    fn words_components_and_channels_are_taken_in_their_order() {
        // Channels A and B of 2-bit I and Q: a byte a sample of both, AI AQ BI BQ.
        let both = Interleaved { components: Components::Iq, channels: 2, ..USUAL };
        let bytes = [0b0001_1011, 0b1100_1001];
        assert_eq!(values(both, &bytes), [1, 3, -1, 1]);
        assert_eq!(values(Interleaved { channel: 2, ..both }, &bytes), [-3, -1, -3, 3]);
        assert_eq!(values(Interleaved { components: Components::Qi, ..both }, &bytes), [3, 1, 1, -1]);
        // The same bytes in words of two, whose first value is in the second byte.
        let words = Interleaved { word_bytes: 2, ..USUAL };
        assert_eq!(values(words, &bytes), [-1, 1, -3, 3, 1, 3, -3, -1]);
        assert_eq!(values(Interleaved { big_endian: true, ..words }, &bytes), [1, 3, -3, -1, -1, 1, -3, 3]);
        // Three channels of 2 bits fill three bytes four times.
        let three = Layout::interleaved(&Interleaved { channels: 3, channel: 2, ..USUAL }).unwrap();
        assert_eq!((three.group_bytes(), three.group_samples()), (3, 4));
        // Whole bytes too: the second of two channels, and the half of 16-bit pairs.
        let bytes = Interleaved { bits: 8, channels: 2, channel: 2, ..USUAL };
        assert_eq!(values(bytes, &[1, 2, 3, 0xfe]), [2, -2]);
        let wide = Layout::interleaved(&Interleaved { bits: 8, encoding: Encoding::Offset, ..USUAL }).unwrap();
        let mut out = Vec::new();
        wide.unpack(&[0, 127, 128, 255], &mut out);
        assert_eq!(out, [-255_i16, -1, 1, 255].map(i16::to_le_bytes).concat());
        assert_eq!(wide.format(), Format::Ri16Le);
    }

    #[test]
    fn a_reader_gives_the_same_however_its_bytes_arrive() {
        struct Pieces<'a>(&'a [u8], usize);
        impl Read for Pieces<'_> {
            fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
                let count = self.1.min(buffer.len()).min(self.0.len());
                buffer[..count].copy_from_slice(&self.0[..count]);
                self.0 = &self.0[count..];
                Ok(count)
            }
        }
        let bytes: Vec<u8> = (0..1000_u32).map(|n| (n * 37 % 251) as u8).collect();
        let layout = Layout::interleaved(&Interleaved { channels: 3, ..USUAL }).unwrap();
        let mut whole = Vec::new();
        layout.unpack(&bytes, &mut whole);
        // The last byte is no whole group.
        assert_eq!(whole.len(), 333 * 4);
        for piece in [1, 2, 5, 999, 5000] {
            let mut read = Vec::new();
            Unpacker::new(layout.clone(), Pieces(&bytes, piece)).read_to_end(&mut read).unwrap();
            assert_eq!(read, whole, "{piece}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let refused = |of: Interleaved| Layout::interleaved(&of).unwrap_err().to_string();
        for (of, word) in [
            (Interleaved { bits: 5, ..USUAL }, "5 bits"),
            (Interleaved { bits: 1, ..USUAL }, "sign or negative-sign"),
            (Interleaved { encoding: Encoding::Sign, ..USUAL }, "expected 1 bit"),
            (Interleaved { bits: 16, encoding: Encoding::Offset, ..USUAL }, "twos-complement of 16 bits"),
            (Interleaved { word_bytes: 3, ..USUAL }, "words of 3 bytes"),
            (Interleaved { channel: 3, channels: 2, ..USUAL }, "channel 3 of 2"),
            (Interleaved { bits: 3, ..USUAL }, "across two words"),
            (Interleaved { bits: 16, ..USUAL }, "across two words"),
        ] {
            assert!(refused(of).contains(word), "{}", refused(of));
        }
        for (encoding, name) in Encoding::NAMES {
            assert_eq!((name.parse(), encoding.to_string().as_str()), (Ok(encoding), name));
        }
        assert!("gray".parse::<Encoding>().unwrap_err().to_string().contains("sign-magnitude"));
    }
}
