//! Check of a recording's bytes against the declared format.
//!
//! Noise from an antenna is nearly Gaussian about zero, so the bytes of each format have a typical
//! distribution. Single bytes have one peak about 0 or about 127.5. Samples of 16 bits have bytes of all
//! values in turn, with few about 0. Floats have exponents near that of one.
//!
//! Limits: real samples cannot be distinguished from complex samples of the same width. Nothing is reported
//! for silent, saturated or jammed samples whose bytes are all alike.

use std::fmt;

use gnss::samples::Format;

/// Bytes that are looked at, from the start of the recording.
pub const LOOKED_AT_BYTES: usize = 1 << 16;
/// Fewer bytes than these say nothing.
const LEAST_BYTES: usize = 1 << 12;
/// Root mean square of a byte of evenly spread values, about 0 and about 127.5 alike, is 73.9; below this it
/// has a peak there.
const PEAKED: f64 = 60.0;
/// And above this it is spread as evenly as the low byte of 16-bit samples with a deviation of a hundred or
/// more.
const SPREAD: f64 = 68.0;
/// Halves of bytes are alike within this sum of differences of their shares: of two antennas' recordings of 2
/// bits 0.012 and 0.014, of noise in whole bytes of any deviation 0.09 and more, and of 4096 bytes of one law
/// 0.06 at most.
const HALVES_APART: f64 = 0.07;
/// Values of a half that occur, each in this share of the bytes, and how uneven their shares are.
const LEAST_USED: f64 = 0.005;
const MOST_USED: usize = 14;
const UNEVEN: f64 = 1.5;
/// Bounds of the correlations of single bits: in two antennas' recordings 0.32 to 0.34 between neighbours,
/// and
/// 0.21 to 0.44 between bits two apart. In 4096 bytes of no law it is 0 ± 0.016.
const LEAST_ALIKE: f64 = 0.1;
const MOST_ALIKE: f64 = 0.8;
/// Part of the samples that must be as the format has them: the rest may be damaged.
const MOST: f64 = 0.95;

/// Encoding of the sample components, for one or two components per sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Two's complement of 8 bits.
    Signed8,
    /// 8 bits with an offset of 128.
    Offset8,
    /// Two's complement of 16 bits.
    Signed16,
    /// IEEE 754 of 32 bits, little-endian.
    Float32,
    /// Samples of few bits, several in a byte.
    Packed,
    /// Integers of 16 bits, most significant byte first, which cannot be received.
    Signed16BigEndian,
    /// IEEE 754 of 32 bits, big-endian.
    Float32BigEndian,
}

impl Look {
    /// Encoding of a declared format.
    pub fn of(format: Format) -> Self {
        match format {
            Format::Ci8 | Format::Ri8 => Self::Signed8,
            Format::Cu8 => Self::Offset8,
            Format::Ci16Le | Format::Ri16Le => Self::Signed16,
            Format::Cf32Le => Self::Float32,
        }
    }

    /// Encoding that the first bytes of a recording show; `None` where they are not clear.
    pub fn judge(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.get(..bytes.len().min(LOOKED_AT_BYTES))?;
        if bytes.len() < LEAST_BYTES || bytes.iter().all(|byte| Some(byte) == bytes.first()) {
            return None;
        }
        let [four_le, four_be] = [false, true].map(|swapped| {
            share(bytes.as_chunks::<4>().0, |four| {
                let value = if swapped { f32::from_be_bytes(*four) } else { f32::from_le_bytes(*four) };
                (1e-8..1e8).contains(&value.abs())
            })
        });
        // Bytes of all values have such exponents in one of five cases.
        match (four_le > MOST, four_be > MOST) {
            (true, false) => return Some(Self::Float32),
            (false, true) => return Some(Self::Float32BigEndian),
            _ => {}
        }
        let (pairs, _) = bytes.as_chunks::<2>();
        let signs = |high: usize| share(pairs, |pair| pair[high] == if pair[1 - high] < 128 { 0 } else { 255 });
        let about = |zero: f64, byte: usize| {
            let sum: f64 = pairs.iter().map(|pair| shifted(pair[byte], zero).powi(2)).sum();
            (sum / pairs.len() as f64).sqrt()
        };
        let (first, second) = (about(0.0, 0), about(0.0, 1));
        // A sample below 128 has a high byte that only repeats its sign; a larger one has low bytes of all
        // values.
        if signs(1) > MOST || (first > SPREAD && second < 0.5 * first) {
            return Some(Self::Signed16);
        }
        if signs(0) > MOST || (second > SPREAD && first < 0.5 * second) {
            return Some(Self::Signed16BigEndian);
        }
        if are_packed(bytes) || are_single_bits(bytes) {
            return Some(Self::Packed);
        }
        let offset = about(127.5, 0).max(about(127.5, 1));
        match (first.max(second) < PEAKED, offset < PEAKED) {
            (true, false) => Some(Self::Signed8),
            (false, true) => Some(Self::Offset8),
            _ => None,
        }
    }
}

impl fmt::Display for Look {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Signed8 => "ci8 or ri8",
            Self::Offset8 => "cu8",
            Self::Signed16 => "ci16 or ri16",
            Self::Float32 => "cf32",
            Self::Packed => {
                "packed samples of 1, 2 or 4 bits, of which --bits and the flags beside it say how they lie"
            }
            Self::Signed16BigEndian => "16-bit integers with the high byte first, which must be swapped",
            Self::Float32BigEndian => "floats with the high byte first, which must be swapped",
        })
    }
}

/// True if both halves of a byte have one distribution, and not an even one, as packed samples have. The
/// halves of whole numbers differ, because the higher half is the coarser part of one number.
fn are_packed(bytes: &[u8]) -> bool {
    let mut counts = [[0_u32; 16]; 2];
    for byte in bytes {
        counts[0][usize::from(byte >> 4)] += 1;
        counts[1][usize::from(byte & 15)] += 1;
    }
    let [high, low] = counts.map(|half| half.map(|count| f64::from(count) / bytes.len() as f64));
    let apart: f64 = high.iter().zip(&low).map(|(a, b)| (a - b).abs()).sum();
    let (least, most) =
        high.iter().fold((1.0_f64, 0.0_f64), |(least, most), share| (least.min(*share), most.max(*share)));
    let used = high.iter().filter(|share| **share > LEAST_USED).count();
    apart < HALVES_APART && used >= MOST_USED && most > UNEVEN * least
}

/// True if every bit of a byte is correlated with the next, or with the one after that where two components
/// or streams lie in turn, as single bits of a filtered signal are. Of whole numbers the highest bits are
/// equal, or the lowest are independent. Limits: single bits of white noise have no law.
fn are_single_bits(bytes: &[u8]) -> bool {
    [1, 2].into_iter().any(|apart| {
        let correlation = |place: u32| {
            let unequal: u32 = bytes.iter().map(|byte| u32::from((byte ^ (byte >> apart)) >> place & 1)).sum();
            1.0 - 2.0 * f64::from(unequal) / bytes.len() as f64
        };
        let all: Vec<f64> = (0..8 - apart).map(correlation).collect();
        let within = |sign: f64| all.iter().all(|one| (LEAST_ALIKE..MOST_ALIKE).contains(&(sign * one)));
        within(1.0) || within(-1.0)
    })
}

/// A byte as a number about 0: two's complement, or offset binary about `zero`.
fn shifted(byte: u8, zero: f64) -> f64 {
    if zero == 0.0 { f64::from(byte as i8) } else { f64::from(byte) - zero }
}

/// The part of the items that are not all zeros, which are so in every format, of which something holds.
fn share<const N: usize>(items: &[[u8; N]], holds: impl Fn(&[u8; N]) -> bool) -> f64 {
    let (mut count, mut held) = (0_u32, 0_u32);
    for item in items.iter().filter(|item| **item != [0; N]) {
        count += 1;
        held += u32::from(holds(item));
    }
    f64::from(held) / f64::from(count.max(1))
}

/// The beginning of a recording, until there is enough of it to judge.
#[derive(Clone, Debug)]
pub struct Check {
    format: Format,
    bytes: Vec<u8>,
}

impl Check {
    /// A check of a recording that is declared to have this format.
    pub fn new(format: Format) -> Self {
        Self { format, bytes: Vec::new() }
    }

    /// Takes the next bytes, however they arrive.
    pub fn take(&mut self, bytes: &[u8]) {
        let room = LOOKED_AT_BYTES.saturating_sub(self.bytes.len()).min(bytes.len());
        self.bytes.extend_from_slice(bytes.get(..room).unwrap_or_default());
    }

    /// A warning, if the bytes look like another format.
    pub fn warning(&self) -> Option<String> {
        let look = Look::judge(&self.bytes).filter(|look| *look != Look::of(self.format))?;
        Some(format!("the format {} was taken, but the first {} bytes look like {look}", self.format, self.bytes.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gaussian enough: the sum of twelve even numbers.
    fn noise(count: usize, sigma: f32) -> Vec<f32> {
        let mut state = 7_u64;
        let mut even = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        (0..count).map(|_| ((0..12).map(|_| even()).sum::<f32>() - 6.0) * sigma).collect()
    }

    #[test]
    fn every_format_looks_like_itself_from_weak_to_strong() {
        for (format, _) in Format::NAMES {
            let sigmas: &[f32] = match format {
                Format::Ci8 | Format::Cu8 | Format::Ri8 => &[0.6, 1.0, 3.0, 14.0, 28.0, 42.0],
                Format::Ci16Le | Format::Ri16Le => &[1.0, 10.0, 28.0, 100.0, 512.0, 2000.0, 7000.0],
                Format::Cf32Le => &[1e-4, 1.0, 100.0, 1e5],
            };
            for sigma in sigmas {
                let (i, q) = (noise(40_000, *sigma), noise(80_000, *sigma));
                let mut bytes = Vec::new();
                format.pack(&i, &q[40_000..], &mut bytes);
                let look = Look::judge(&bytes);
                assert_eq!(look, Some(Look::of(format)), "{format} {sigma}");
                let mut check = Check::new(format);
                bytes.chunks(1001).for_each(|piece| check.take(piece));
                assert_eq!(check.warning(), None);
            }
        }
    }

    #[test]
    fn samples_of_two_bits_four_in_a_byte_are_told_from_whole_bytes() {
        let codes: Vec<u8> =
            noise(40_000, 1.0).iter().map(|x| u8::from(*x < 0.0) << 1 | u8::from(x.abs() > 1.0)).collect();
        let bytes: Vec<u8> = codes.chunks(4).map(|four| four.iter().fold(0, |byte, code| byte << 2 | code)).collect();
        assert_eq!(Look::judge(&bytes), Some(Look::Packed));
        let mut check = Check::new(Format::Ci8);
        check.take(&bytes);
        assert!(check.warning().is_some_and(|text| text.contains("--bits")));
    }

    #[test]
    fn single_bits_of_a_filtered_signal_are_told_from_whole_bytes() {
        // Sums of two values share one with the next: 2/π · asin(1/2), a third, is the correlation of their
        // signs.
        let signs = |lag: usize| -> Vec<u8> {
            noise(80_000, 1.0).windows(lag + 1).map(|x| u8::from(x[0] + x[lag] < 0.0)).collect()
        };
        let pack = |bits: &[u8]| -> Vec<u8> {
            bits.chunks(8).map(|eight| eight.iter().fold(0, |byte, bit| byte << 1 | bit)).collect()
        };
        for lag in [1, 2] {
            assert_eq!(Look::judge(&pack(&signs(lag))), Some(Look::Packed), "{lag}");
        }
        // One more bit of every third byte repeats the one two before it: halves of bytes are unlike then.
        let mut bits = signs(2);
        for place in (6..bits.len()).step_by(24) {
            bits[place] = bits[place - 2];
        }
        let bytes = pack(&bits);
        assert!(!are_packed(&bytes) && Look::judge(&bytes) == Some(Look::Packed));
        let mut check = Check::new(Format::Ci8);
        check.take(&bytes);
        assert!(check.warning().is_some_and(|text| text.contains("packed samples of 1,")));
    }

    #[test]
    fn silence_and_evenly_spread_bytes_say_nothing() {
        assert_eq!(Look::judge(&[0; 10_000]), None);
        assert_eq!(Look::judge(b"short"), None);
        let even: Vec<u8> = noise(20_000, 1e4).iter().map(|x| *x as i32 as u8).collect();
        assert_eq!(Look::judge(&even), None);
    }
}
