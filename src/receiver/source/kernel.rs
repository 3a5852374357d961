//! [`Format::unpack`] compiled for the widest vectors that its loops make use of.

use crate::gnss::samples::Format;

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

#[cfg(test)]
mod tests {
    use super::*;

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
