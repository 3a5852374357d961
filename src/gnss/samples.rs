//! IF samples as files hold them: formats, packing, and the description of a recording as a data sheet gives
//! it.
//!
//! Formats carry SigMF's names (SigMF 1.2, "Dataset format"). Inside, samples are planar `f32`
//! in units of the format's least significant bit. Integers saturate symmetrically and round half to even.

use std::fmt;
use std::str::FromStr;

use num_complex::Complex;
use thiserror::Error;

use crate::place::nearest;
use crate::time::{Epoch, Rate};

/// Encoding of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Complex, 8 bits a component, two's complement.
    Ci8,
    /// Complex, 8 bits a component, offset binary: zero lies between 127 and 128.
    Cu8,
    /// Complex, 16 bits a component, little endian.
    Ci16Le,
    /// Complex, IEEE 754 single precision, little endian.
    Cf32Le,
    /// Real, 8 bits, two's complement.
    Ri8,
    /// Real, 16 bits, little endian.
    Ri16Le,
}

/// Error for a text that is not the name of a format.
#[derive(Debug, Error, PartialEq)]
#[error("unknown sample format '{name}'{hint}: expected one of ci8, cu8, ci16, cf32, ri8, ri16",
        name = .0, hint = Format::suggestion(.0))]
pub struct FormatError(String);

impl Format {
    /// Suggestion for a name that is no format's, for an error message; empty if none is similar.
    pub fn suggestion(name: &str) -> String {
        let known = Self::NAMES.map(|(_, name)| name);
        let near = nearest(name, &known).map(|near| near.trim_end_matches("_le").to_owned());
        near.map_or_else(String::new, |near| format!(" (did you mean {near}?)"))
    }

    /// Every format with its SigMF name.
    pub const NAMES: [(Self, &'static str); 6] = [
        (Self::Ci8, "ci8"),
        (Self::Cu8, "cu8"),
        (Self::Ci16Le, "ci16_le"),
        (Self::Cf32Le, "cf32_le"),
        (Self::Ri8, "ri8"),
        (Self::Ri16Le, "ri16_le"),
    ];

    /// SigMF's name.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(format, _)| *format == self).map_or("", |(_, name)| *name)
    }

    /// Number of bytes of one sample, both components if it is complex.
    pub fn bytes(self) -> usize {
        match self {
            Self::Ri8 => 1,
            Self::Ci8 | Self::Cu8 | Self::Ri16Le => 2,
            Self::Ci16Le => 4,
            Self::Cf32Le => 8,
        }
    }

    /// True if a sample has a quadrature component.
    pub fn is_complex(self) -> bool {
        !matches!(self, Self::Ri8 | Self::Ri16Le)
    }

    /// Largest magnitude of a component, in LSB; `None` for floating point.
    pub fn full_scale_lsb(self) -> Option<f32> {
        match self {
            Self::Ci8 | Self::Ri8 => Some(127.0),
            Self::Cu8 => Some(127.5),
            Self::Ci16Le | Self::Ri16Le => Some(32_767.0),
            Self::Cf32Le => None,
        }
    }

    /// Appends samples `i + jq`, in LSB, to `out`. Real formats ignore `q`.
    pub fn pack(self, i: &[f32], q: &[f32], out: &mut Vec<u8>) {
        let samples = if self.is_complex() { i.len().min(q.len()) } else { i.len() };
        let begin = out.len();
        out.resize(begin + samples * self.bytes(), 0);
        self.pack_into(i, q, &mut out[begin..]);
    }

    /// Packs like [`Self::pack`] into the bytes of `out`, as many whole samples as all three hold.
    #[inline(always)]
    pub fn pack_into(self, i: &[f32], q: &[f32], out: &mut [u8]) {
        match self {
            Self::Ci8 => {
                // Both components as one integer: shifts make vectors where placing bytes does not.
                let (pairs, _) = out.as_chunks_mut::<2>();
                for ((pair, i), q) in pairs.iter_mut().zip(i).zip(q) {
                    *pair = (u16::from(round_i8(*i) as u8) | u16::from(round_i8(*q) as u8) << 8).to_le_bytes();
                }
            }
            Self::Cu8 => interleave(i, q, out, |x| [round_u8(x)]),
            Self::Ci16Le => interleave(i, q, out, |x| round_i16(x).to_le_bytes()),
            Self::Cf32Le => interleave(i, q, out, f32::to_le_bytes),
            Self::Ri8 => out.iter_mut().zip(i).for_each(|(out, i)| *out = round_i8(*i) as u8),
            Self::Ri16Le => {
                let (pairs, _) = out.as_chunks_mut::<2>();
                pairs.iter_mut().zip(i).for_each(|(out, i)| *out = round_i16(*i).to_le_bytes());
            }
        }
    }

    /// Packs complex samples, in LSB, like [`Self::pack`].
    pub fn pack_complex(self, samples: &[Complex<f32>]) -> Vec<u8> {
        let i: Vec<f32> = samples.iter().map(|sample| sample.re).collect();
        let q: Vec<f32> = samples.iter().map(|sample| sample.im).collect();
        let mut bytes = Vec::new();
        self.pack(&i, &q, &mut bytes);
        bytes
    }

    /// Unpacks the whole samples in `bytes` as complex values in LSB, like [`Self::unpack`].
    pub fn unpack_complex(self, bytes: &[u8]) -> Vec<Complex<f32>> {
        let (mut i, mut q) = (Vec::new(), Vec::new());
        self.unpack(bytes, &mut i, &mut q);
        i.into_iter().zip(q).map(|(re, im)| Complex { re, im }).collect()
    }

    /// Unpacks the whole samples in `bytes` into planar LSB values, which replace the content of `i` and `q`.
    /// Real formats give `q` = 0, and an incomplete sample at the end is ignored. A non-finite float becomes
    /// 0.
    #[inline(always)]
    pub fn unpack(self, bytes: &[u8], i: &mut Vec<f32>, q: &mut Vec<f32>) {
        // Whole samples as integers: shifts make vectors where picking bytes does not.
        match self {
            Self::Ci8 => split(bytes.as_chunks().0, i, q, |s| {
                let both = i16::from_le_bytes(*s);
                (f32::from((both << 8) >> 8), f32::from(both >> 8))
            }),
            Self::Cu8 => split(bytes.as_chunks().0, i, q, |s| {
                let both = u16::from_le_bytes(*s);
                (f32::from(both & 0xff) - 127.5, f32::from(both >> 8) - 127.5)
            }),
            Self::Ci16Le => split(bytes.as_chunks().0, i, q, |s| {
                let both = i32::from_le_bytes(*s);
                (((both << 16) >> 16) as f32, (both >> 16) as f32)
            }),
            Self::Cf32Le => split(bytes.as_chunks().0, i, q, |&[a, b, c, d, e, f, g, h]| {
                (finite(f32::from_le_bytes([a, b, c, d])), finite(f32::from_le_bytes([e, f, g, h])))
            }),
            Self::Ri8 => split(bytes.as_chunks().0, i, q, |&[s]| (f32::from(s as i8), 0.0)),
            Self::Ri16Le => split(bytes.as_chunks().0, i, q, |s| (f32::from(i16::from_le_bytes(*s)), 0.0)),
        }
    }
}

/// Fills `i` and `q` with the components of every sample.
#[inline(always)]
fn split<const N: usize>(
    samples: &[[u8; N]],
    i: &mut Vec<f32>,
    q: &mut Vec<f32>,
    components: impl Fn(&[u8; N]) -> (f32, f32),
) {
    i.resize(samples.len(), 0.0);
    q.resize(samples.len(), 0.0);
    for ((i, q), sample) in i.iter_mut().zip(q).zip(samples) {
        (*i, *q) = components(sample);
    }
}

/// Writes `i`, `q` in turn, each as the `N` bytes that `write` makes of it.
#[inline(always)]
fn interleave<const N: usize>(i: &[f32], q: &[f32], out: &mut [u8], write: impl Fn(f32) -> [u8; N]) {
    let (components, _) = out.as_chunks_mut::<N>();
    let (pairs, _) = components.as_chunks_mut::<2>();
    for ((pair, i), q) in pairs.iter_mut().zip(i).zip(q) {
        *pair = [write(*i), write(*q)];
    }
}

/// Adding this to an `f32` of magnitude below 2^22 leaves its integer, rounded half to even, in the low bits.
const ROUNDING_BIAS: f32 = 12_582_912.0;

#[inline(always)]
fn round_i8(x: f32) -> i8 {
    (x.clamp(-127.0, 127.0) + ROUNDING_BIAS).to_bits() as i8
}

#[inline(always)]
fn round_u8(x: f32) -> u8 {
    ((x + 127.5).clamp(0.0, 255.0) + ROUNDING_BIAS).to_bits() as u8
}

#[inline(always)]
fn round_i16(x: f32) -> i16 {
    (x.clamp(-32_767.0, 32_767.0) + ROUNDING_BIAS).to_bits() as i16
}

fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// Name that flags and keys take: SigMF's without the byte order, which is little endian throughout.
impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name().trim_end_matches("_le"))
    }
}

impl FromStr for Format {
    type Err = FormatError;

    fn from_str(text: &str) -> Result<Self, FormatError> {
        let short = text.trim().to_ascii_lowercase();
        Self::NAMES
            .iter()
            .find(|(_, name)| *name == short || name.strip_suffix("_le") == Some(&short))
            .map(|(format, _)| *format)
            .ok_or_else(|| FormatError(text.to_owned()))
    }
}

/// Description of a sample stream as a data sheet gives it. The type has no field for truth.
#[derive(Clone, Debug, PartialEq)]
pub struct IfMetadata {
    /// Encoding of the samples.
    pub format: Format,
    /// Samples per second by the recorder's clock.
    pub rate: Rate,
    /// Radio frequency in Hz that appears at 0 Hz in the samples.
    pub center_hz: f64,
    /// True if the spectrum is mirrored about `center_hz` (local oscillator above the signal).
    pub inverted: bool,
    /// Time of sample 0 by the recorder's clock, if it was recorded.
    pub start: Option<Epoch>,
}

impl IfMetadata {
    /// Frequency in Hz at which a received carrier of `carrier_hz` appears in the samples.
    pub fn if_hz(&self, carrier_hz: f64) -> f64 {
        let offset_hz = carrier_hz - self.center_hz;
        if self.inverted { -offset_hz } else { offset_hz }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_formats_round_half_to_even_and_saturate_symmetrically() {
        let i = [0.5_f32, 1.5, -0.5, -2.5, 126.6, 127.4, 1e9, -1e9, f32::NAN];
        let q = [0.0_f32; 9];
        let (mut back_i, mut back_q) = (Vec::new(), Vec::new());
        let mut bytes = Vec::new();
        Format::Ci8.pack(&i, &q, &mut bytes);
        Format::Ci8.unpack(&bytes, &mut back_i, &mut back_q);
        assert_eq!(back_i[..8], [0.0, 2.0, 0.0, -2.0, 127.0, 127.0, 127.0, -127.0]);
        assert_eq!(back_q, q);
    }

    #[test]
    fn every_format_gives_back_what_it_can_hold() {
        for (format, name) in Format::NAMES {
            assert_eq!(name.parse::<Format>().unwrap(), format);
            let offset = if format == Format::Cu8 { 0.5 } else { 0.0 };
            let i: Vec<f32> = (-100..100).map(|x| x as f32 + offset).collect();
            let q: Vec<f32> = if format.is_complex() { i.iter().rev().copied().collect() } else { vec![0.0; i.len()] };
            let (mut bytes, mut back_i, mut back_q) = (Vec::new(), Vec::new(), Vec::new());
            format.pack(&i, &q, &mut bytes);
            assert_eq!(bytes.len(), i.len() * format.bytes());
            bytes.extend(vec![1; format.bytes() - 1]);
            format.unpack(&bytes, &mut back_i, &mut back_q);
            assert_eq!((back_i, back_q), (i, q), "{name}");
        }
        assert_eq!("CI16".parse(), Ok(Format::Ci16Le));
        assert!("ci12".parse::<Format>().is_err());
        let error = "ci16le".parse::<Format>().unwrap_err().to_string();
        assert!(error.contains("'ci16le' (did you mean ci16?): expected one of "), "{error}");
    }
}
