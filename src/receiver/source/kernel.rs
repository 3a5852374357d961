//! [`Format::unpack`], and the same to fixed-point numbers, compiled for the widest vectors that its loops
//! make use of.

use crate::correlate::fixed::POINT_BITS;
use gnss::samples::Format;

/// [`Format::unpack`] with the vectors of this processor: the same values on all.
pub(super) fn unpack(format: Format, bytes: &[u8], i: &mut Vec<f32>, q: &mut Vec<f32>) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has these instructions.
        unsafe { unpack_avx2(format, bytes, i, q) };
        return;
    }
    format.unpack(bytes, i, q);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn unpack_avx2(format: Format, bytes: &[u8], i: &mut Vec<f32>, q: &mut Vec<f32>) {
    format.unpack(bytes, i, q);
}

/// Fills `i` and `q` with samples of 8 bits in 2⁻⁴ of their last bit: the same values on all processors. Of
/// other formats there are none.
pub(super) fn fixed(format: Format, bytes: &[u8], i: &mut [i16], q: &mut [i16]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has these instructions.
        unsafe { fixed_avx2(format, bytes, i, q) };
        return;
    }
    fixed_plain(format, bytes, i, q);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fixed_avx2(format: Format, bytes: &[u8], i: &mut [i16], q: &mut [i16]) {
    fixed_plain(format, bytes, i, q);
}

#[inline(always)]
fn fixed_plain(format: Format, bytes: &[u8], i: &mut [i16], q: &mut [i16]) {
    const UNIT: i16 = 1 << POINT_BITS;
    // 127.5 of them.
    const MIDDLE: i16 = 255 * UNIT / 2;
    let pairs = bytes.as_chunks::<2>().0.iter().map(|pair| i16::from_le_bytes(*pair));
    match format {
        Format::Ci8 => {
            for ((i, q), both) in i.iter_mut().zip(q).zip(pairs) {
                (*i, *q) = (((both << 8) >> 8) * UNIT, (both >> 8) * UNIT);
            }
        }
        Format::Cu8 => {
            for ((i, q), both) in i.iter_mut().zip(q).zip(pairs) {
                (*i, *q) = ((both & 0xff) * UNIT - MIDDLE, (both >> 8 & 0xff) * UNIT - MIDDLE);
            }
        }
        Format::Ri8 => {
            for (i, byte) in i.iter_mut().zip(bytes) {
                *i = i16::from(*byte as i8) * UNIT;
            }
            q.fill(0);
        }
        Format::Ci16Le | Format::Ri16Le | Format::Cf32Le => {
            i.fill(0);
            q.fill(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_point_numbers_are_the_samples_at_every_length() {
        let bytes: Vec<u8> = (0..2048_u32).map(|n| (n * 197 % 256) as u8).collect();
        for format in [Format::Ci8, Format::Cu8, Format::Ri8] {
            for length in (0..100).chain([2048]) {
                let count = length / format.bytes();
                let (mut planes, mut expected) = ([vec![7; count], vec![7; count]], (Vec::new(), Vec::new()));
                let [i, q] = &mut planes;
                fixed(format, &bytes[..length], i, q);
                format.unpack(&bytes[..length], &mut expected.0, &mut expected.1);
                let found = planes.map(|plane| plane.iter().map(|x| f32::from(*x) / 16.0).collect::<Vec<_>>());
                assert_eq!(found, [expected.0, expected.1], "{format} {length}");
                let [mut i, mut q] = [vec![7; count], vec![7; count]];
                fixed_plain(format, &bytes[..length], &mut i, &mut q);
                assert_eq!([i, q].map(|plane| plane.iter().map(|x| f32::from(*x) / 16.0).collect::<Vec<_>>()), found);
            }
        }
    }

    #[test]
    fn samples_are_those_of_the_baseline_at_every_length() {
        let bytes: Vec<u8> = (0..4096_u32).map(|n| (n * 197 % 251) as u8).collect();
        for (format, _) in Format::NAMES {
            for length in (0..300).chain([4095, 4096]) {
                let unpacked = |unpack: fn(Format, &[u8], &mut Vec<f32>, &mut Vec<f32>)| {
                    let (mut i, mut q) = (vec![7.0; 5], Vec::new());
                    unpack(format, &bytes[..length], &mut i, &mut q);
                    [i, q].map(|plane| plane.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
                };
                let expected = unpacked(Format::unpack);
                assert_eq!(expected[0].len(), length / format.bytes());
                assert_eq!(unpacked(unpack), expected, "{format} {length}");
            }
        }
    }
}
