//! Metadata of a recording before they are completed: keys may be absent, samples packed, and a file may
//! contain other bytes.

use std::io::Read;

use crate::packed::{Components, Encoding, Interleaved, Layout, LayoutError};
use crate::samples::Format;
use crate::signal::Signal;
use crate::time::{Epoch, Rate};

/// Arrangement of samples in a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Samples in whole bytes, as the receiver takes them.
    Whole(Format),
    /// Packed, or among those of other channels.
    Interleaved(Interleaved),
    /// Anywhere in words that repeat.
    Laid(Layout),
}

/// A recording as its metadata describe it.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Arrangement of samples in the file.
    pub samples: Option<Samples>,
    /// Samples per second.
    pub rate: Option<Rate>,
    /// Radio frequency in Hz that appears at 0 Hz in the samples.
    pub center_hz: Option<f64>,
    /// True if the spectrum is mirrored.
    pub inverted: bool,
    /// Signals in the recording; empty if no key states them.
    pub signals: Vec<&'static Signal>,
    /// Time of the first sample by the recorder's clock.
    pub start: Option<Epoch>,
    /// Channels, a sample of each in turn.
    pub channels: u32,
    /// Number of bytes before the first sample.
    pub header_bytes: u64,
    /// Bytes after the last sample.
    pub trailing_bytes: u64,
    /// Blocks of the file, each with a header and a footer that are not samples. Absent if the file has only
    /// samples.
    pub blocks: Option<Blocks>,
    /// Samples before the first one that is described.
    pub skipped_samples: u64,
    /// Name of the file of samples, if it differs from that of the metadata.
    pub dataset: Option<String>,
}

/// Layout of blocks of equal size, from the first byte of samples on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocks {
    /// Bytes before the samples of each.
    pub header_bytes: u64,
    /// Bytes of its samples, above zero.
    pub sample_bytes: u64,
    /// Bytes after them.
    pub footer_bytes: u64,
}

impl Blocks {
    /// Number of sample bytes among the first `bytes` of the file.
    pub fn samples_among(&self, bytes: u64) -> u64 {
        let whole = self.header_bytes + self.sample_bytes + self.footer_bytes;
        let begun = (bytes % whole).saturating_sub(self.header_bytes).min(self.sample_bytes);
        bytes / whole * self.sample_bytes + begun
    }
}

/// The samples of a stream of blocks.
#[derive(Debug)]
pub struct Unblocked<R> {
    blocks: Blocks,
    reader: R,
    /// Bytes that are no samples before the next one that is, and bytes of samples after these.
    skip: u64,
    left: u64,
}

impl<R: Read> Unblocked<R> {
    /// Creates a reader of the samples in blocks; `reader` begins with a header.
    pub fn new(blocks: Blocks, reader: R) -> Self {
        Self { blocks, reader, skip: blocks.header_bytes, left: blocks.sample_bytes }
    }
}

impl<R: Read> Read for Unblocked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.left == 0 {
            (self.skip, self.left) = (self.blocks.footer_bytes + self.blocks.header_bytes, self.blocks.sample_bytes);
        }
        while self.skip > 0 {
            let mut passed = [0; 512];
            let most = self.skip.min(passed.len() as u64) as usize;
            let count = self.reader.read(passed.get_mut(..most).unwrap_or_default())?;
            if count == 0 {
                return Ok(0);
            }
            self.skip -= count as u64;
        }
        let most = self.left.min(buffer.len() as u64) as usize;
        let count = self.reader.read(buffer.get_mut(..most).unwrap_or_default())?;
        self.left -= count as u64;
        Ok(count)
    }
}

impl Default for Description {
    fn default() -> Self {
        Self {
            samples: None,
            rate: None,
            center_hz: None,
            inverted: false,
            signals: Vec::new(),
            start: None,
            channels: 1,
            header_bytes: 0,
            trailing_bytes: 0,
            blocks: None,
            skipped_samples: 0,
            dataset: None,
        }
    }
}

impl Samples {
    /// Returns the description of one channel of interleaved samples; channels count from 1.
    ///
    /// # Errors
    /// [`LayoutError`]: no such channel, and floating point.
    pub fn of_channel(self, channel: u32, channels: u32) -> Result<Self, LayoutError> {
        let of = match self {
            Self::Whole(format) if channels > 1 => whole(format)?,
            Self::Interleaved(of) => of,
            whole if channel == 1 && channels == 1 => return Ok(whole),
            _ => return Err(LayoutError::Channel { channel, channels }),
        };
        let of = Interleaved { channel, channels, ..of };
        Layout::interleaved(&of).map(|_| Self::Interleaved(of))
    }

    /// Returns the format after unpacking, and the layout if the samples are packed.
    ///
    /// # Errors
    /// [`LayoutError`].
    pub fn unpacked(self) -> Result<(Format, Option<Layout>), LayoutError> {
        let layout = match self {
            Self::Whole(format) => return Ok((format, None)),
            Self::Interleaved(of) => Layout::interleaved(&of)?,
            Self::Laid(layout) => layout,
        };
        Ok((layout.format(), Some(layout)))
    }
}

/// Samples of whole bytes as bits.
fn whole(format: Format) -> Result<Interleaved, LayoutError> {
    let (bits, encoding) = match format {
        Format::Ci8 | Format::Ri8 => (8, Encoding::TwosComplement),
        Format::Cu8 => (8, Encoding::Offset),
        Format::Ci16Le | Format::Ri16Le => (16, Encoding::TwosComplement),
        Format::Cf32Le => return Err(LayoutError::Float),
    };
    let components = if format.is_complex() { Components::Iq } else { Components::Real };
    Ok(Interleaved {
        bits,
        encoding,
        components,
        lowest_first: false,
        word_bytes: bits as usize / 8,
        big_endian: false,
        channels: 1,
        channel: 1,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_of_whole_bytes_is_the_one_that_is_asked_for() {
        for (format, _) in Format::NAMES {
            let of = |channel| Samples::Whole(format).of_channel(channel, 2);
            if format == Format::Cf32Le {
                assert_eq!(of(1), Err(LayoutError::Float));
                continue;
            }
            let (unpacked, layout) = of(2).unwrap().unpacked().unwrap();
            let layout = layout.unwrap();
            let bytes: Vec<u8> = (0..2 * format.bytes() as u8).collect();
            let mut out = Vec::new();
            layout.unpack(&bytes, &mut out);
            if format == Format::Cu8 {
                // In steps of half a unit: offset binary lies between the integers.
                assert_eq!((unpacked, out), (Format::Ci16Le, [-251_i16, -249].map(i16::to_le_bytes).concat()));
            } else {
                assert_eq!((unpacked, out.as_slice()), (format, &bytes[format.bytes()..]));
            }
            assert_eq!(of(3), Err(LayoutError::Channel { channel: 3, channels: 2 }));
            assert_eq!(Samples::Whole(format).of_channel(1, 1), Ok(Samples::Whole(format)));
        }
    }
}
