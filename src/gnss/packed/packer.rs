//! Packing of samples in whole bytes into the form that [`Layout::unpack`] reads.

use std::io::{self, Write};

use thiserror::Error;

use super::{Encoding, Layout};
use crate::samples::Format;

/// Values of codes of at most 8 bits lie between these.
const LEAST: i32 = -256;
const MOST: i32 = 255;

/// Error for a value that has no code.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("a sample has the value {value}, which {bits} bits of {encoding} do not: expected {expected}")]
pub struct CodeError {
    value: i32,
    bits: u32,
    encoding: Encoding,
    expected: String,
}

impl Layout {
    /// Appends the packed form of the whole groups in `samples`, which are in [`Layout::format`].
    ///
    /// # Errors
    /// [`CodeError`] with the first value that has no code.
    pub fn pack(&self, samples: &[u8], out: &mut Vec<u8>) -> Result<(), CodeError> {
        let wide = matches!(self.format(), Format::Ri16Le | Format::Ci16Le);
        let width = if wide { 2 } else { 1 };
        let codes = self.codes();
        for group in samples.chunks_exact(width * self.fields.len()) {
            let mut words = vec![0_u64; self.words];
            for (bytes, (word, shift)) in group.chunks_exact(width).zip(&self.fields) {
                let value = match *bytes {
                    [low, high] => i32::from(i16::from_le_bytes([low, high])),
                    [byte] => i32::from(byte as i8),
                    _ => 0,
                };
                let code = self.code(&codes, value)?;
                if let Some(word) = words.get_mut(*word) {
                    *word |= u64::from(code) << shift;
                }
            }
            for word in &words {
                let bytes = word.to_be_bytes();
                let own = bytes.get(8 - self.word_bytes..).unwrap_or_default();
                if self.big_endian { out.extend(own) } else { out.extend(own.iter().rev()) }
            }
        }
        Ok(())
    }

    /// The code of every value from [`LEAST`] on, of codes of at most 8 bits.
    fn codes(&self) -> Vec<Option<u32>> {
        let mut codes = vec![None; (MOST - LEAST + 1) as usize];
        if self.bits <= 8 {
            for code in 0..1_u32 << self.bits {
                let place = (self.encoding.value(code, self.bits) - LEAST) as usize;
                if let Some(entry) = codes.get_mut(place) {
                    *entry = Some(code);
                }
            }
        }
        codes
    }

    fn code(&self, codes: &[Option<u32>], value: i32) -> Result<u32, CodeError> {
        // Wider ones are the value itself.
        if self.bits > 8 {
            return Ok(value as u32 & 0xffff);
        }
        let known = usize::try_from(value - LEAST).ok().and_then(|place| codes.get(place).copied().flatten());
        known.ok_or_else(|| {
            let all: Vec<String> = (LEAST..).zip(codes).filter_map(|(v, code)| code.map(|_| v.to_string())).collect();
            CodeError { value, bits: self.bits, encoding: self.encoding, expected: all.join(", ") }
        })
    }
}

/// Writes samples of whole bytes as packed ones.
pub struct Packer<W> {
    layout: Layout,
    writer: W,
    /// Samples that are no whole group yet.
    samples: Vec<u8>,
    packed: Vec<u8>,
}

impl<W: Write> Packer<W> {
    /// Writes to `writer` as `layout` states.
    pub fn new(layout: Layout, writer: W) -> Self {
        Self { layout, writer, samples: Vec::new(), packed: Vec::new() }
    }

    /// Ends the samples.
    ///
    /// # Errors
    /// Errors of the writer, and samples that fill no group.
    pub fn finish(mut self) -> io::Result<()> {
        let left = self.samples.len() / self.layout.format().bytes();
        if left > 0 {
            let of = self.layout.group_samples();
            return Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                format!("{left} samples are left of groups of {of}: expected whole groups"),
            ));
        }
        self.writer.flush()
    }
}

impl<W: Write> Write for Packer<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.samples.extend_from_slice(bytes);
        let group = self.layout.group_samples() * self.layout.format().bytes();
        let whole = self.samples.len() / group * group;
        self.packed.clear();
        let packed = self.layout.pack(self.samples.get(..whole).unwrap_or_default(), &mut self.packed);
        packed.map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        self.samples.drain(..whole);
        self.writer.write_all(&self.packed)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packed::{Components, Interleaved};

    #[test]
    fn what_is_packed_is_unpacked_again_in_every_form_however_it_is_written() {
        let mut forms = 0;
        for (bits, encoding) in [1, 2, 3, 4, 8, 16].iter().flat_map(|bits| Encoding::NAMES.map(|(e, _)| (*bits, e))) {
            for components in [Components::Real, Components::Iq, Components::Qi] {
                for (lowest_first, word_bytes, big_endian) in [(false, 1, false), (true, 2, true), (false, 4, false)] {
                    let (channels, channel) = (1, 1);
                    let of = Interleaved {
                        bits,
                        encoding,
                        components,
                        lowest_first,
                        word_bytes,
                        big_endian,
                        channels,
                        channel,
                    };
                    let Ok(layout) = Layout::interleaved(&of) else { continue };
                    // Whole groups of every code.
                    let bytes: Vec<u8> = (0..60 * 64_u32).map(|n| (n * 37 % 251) as u8).collect();
                    let whole = bytes.len() / layout.group_bytes() * layout.group_bytes();
                    let mut samples = Vec::new();
                    layout.unpack(&bytes[..whole], &mut samples);
                    for piece in [1, 7, 4096] {
                        let mut back = Vec::new();
                        let mut packer = Packer::new(layout.clone(), &mut back);
                        samples.chunks(piece).for_each(|piece| packer.write_all(piece).unwrap());
                        packer.finish().unwrap();
                        assert!(back == bytes[..whole], "{of:?}");
                    }
                    forms += 1;
                }
            }
        }
        assert!(forms > 60, "{forms}");
    }

    #[test]
    fn a_value_without_a_code_and_half_a_group_are_refused() {
        let of = Interleaved {
            bits: 2,
            encoding: Encoding::SignMagnitude,
            components: Components::Real,
            lowest_first: false,
            word_bytes: 1,
            big_endian: false,
            channels: 1,
            channel: 1,
        };
        let layout = Layout::interleaved(&of).unwrap();
        let mut out = Vec::new();
        layout.pack(&[1, 3, 0xff, 0xfd], &mut out).unwrap();
        assert_eq!(out, [0b0001_1011]);
        let error = layout.pack(&[1, 3, 2, 1], &mut out).unwrap_err().to_string();
        assert!(error.contains("value 2") && error.contains("expected -3, -1, 1, 3"), "{error}");
        let mut packer = Packer::new(layout, Vec::new());
        packer.write_all(&[1, 1, 1, 1, 3]).unwrap();
        assert!(packer.finish().unwrap_err().to_string().contains("1 samples are left of groups of 4"));
    }
}
