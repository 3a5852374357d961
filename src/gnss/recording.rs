//! What metadata say of a recording before anything completes it: keys may be absent, samples packed, and a
//! file may have more than samples.

use crate::packed::{Components, Encoding, Interleaved, Layout, LayoutError};
use crate::samples::Format;
use crate::signal::Signal;
use crate::time::{Epoch, Rate};

/// How samples lie in a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// In whole bytes, as they are received.
    Whole(Format),
    /// Packed, or among those of other channels.
    Interleaved(Interleaved),
    /// Anywhere in words that repeat.
    Laid(Layout),
}

/// A recording as its metadata describe it.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// How samples lie in the file.
    pub samples: Option<Samples>,
    /// Samples a second.
    pub rate: Option<Rate>,
    /// The radio frequency at 0 Hz of the samples.
    pub center_hz: Option<f64>,
    /// Whether the spectrum is mirrored.
    pub inverted: bool,
    /// The signals in it; none where nothing says it.
    pub signals: Vec<&'static Signal>,
    /// What the recorder's clock read at the first sample.
    pub start: Option<Epoch>,
    /// Channels, a sample of each in turn.
    pub channels: u32,
    /// Bytes before the first sample, and after the last one.
    pub header_bytes: u64,
    /// Bytes after the last sample.
    pub trailing_bytes: u64,
    /// Samples before the first one that is described.
    pub skipped_samples: u64,
    /// The file of samples, where it is none of the same name.
    pub dataset: Option<String>,
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
            skipped_samples: 0,
            dataset: None,
        }
    }
}

impl Samples {
    /// A channel of several that have these samples in turn; channels count from 1.
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

    /// The format in which they are received, and how they are unpacked where they are not in it.
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
