//! [`Format::unpack`] compiled for the widest vectors that its loops make use of.

use super::correlate::Level;
use crate::gnss::samples::Format;

/// [`Format::unpack`] on the best instruction set of this processor: the same values on all.
pub(super) fn unpack(format: Format, bytes: &[u8], i: &mut Vec<f32>, q: &mut Vec<f32>) {
    at_level(Level::best(), format, bytes, i, q);
}

fn at_level(level: Level, format: Format, bytes: &[u8], i: &mut Vec<f32>, q: &mut Vec<f32>) {
    match level {
        Level::Baseline => format.unpack(bytes, i, q),
        // SAFETY: levels beyond the baseline come from `best` (and `all` in tests), which detected AVX2.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { unpack_avx2(format, bytes, i, q) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn unpack_avx2(format: Format, bytes: &[u8], i: &mut Vec<f32>, q: &mut Vec<f32>) {
    format.unpack(bytes, i, q);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_those_of_the_baseline_at_every_level_and_length() {
        let bytes: Vec<u8> = (0..4096_u32).map(|n| (n * 197 % 251) as u8).collect();
        for (format, _) in Format::NAMES {
            for length in (0..300).chain([4095, 4096]) {
                let unpacked = |level| {
                    let (mut i, mut q) = (vec![7.0; 5], Vec::new());
                    at_level(level, format, &bytes[..length], &mut i, &mut q);
                    [i, q].map(|plane| plane.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
                };
                let expected = unpacked(Level::Baseline);
                assert_eq!(expected[0].len(), length / format.bytes());
                for level in Level::all() {
                    assert_eq!(unpacked(level), expected, "{format} {level:?} {length}");
                }
            }
        }
    }
}
