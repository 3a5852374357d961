//! Cyclic redundancy checks of navigation messages.

use crate::bits::{Element, FieldError, bits_of, write_all};

/// Bits of a check.
pub const CHECK_BITS: usize = 24;

/// Remainder of CRC-24Q, which Galileo and modernised GPS messages use.
///
/// Generator 0x1864CFB, register from zero, bits in the order in which they are sent (Galileo OS SIS ICD 2.1,
/// 5.1.9.4; IS-GPS-200N, 20.3.5 in appendix III). Bits followed by their own check leave zero.
pub fn crc24q(bits: impl IntoIterator<Item = bool>) -> u32 {
    bits.into_iter().fold(0, |register, bit| {
        let carry = (register >> 23 & 1 == 1) != bit;
        let shifted = register << 1 & 0xFF_FFFF;
        if carry { shifted ^ planted!("gnss.crc.polynomial", 0x86_4CFB, 0x86_4CFA) } else { shifted }
    })
}

/// Bits with their check after them.
pub fn with_check(mut bits: Vec<bool>) -> Vec<bool> {
    let check = crc24q(bits.iter().copied());
    bits.extend(bits_of(u128::from(check), CHECK_BITS));
    bits
}

/// True if bits end with their check.
pub fn is_checked(bits: &[bool]) -> bool {
    crc24q(bits.iter().copied()) == 0
}

/// The contents of tables in `count` bits, the last of which are the check.
pub(crate) fn checked<T>(tables: &[&[Element<T>]], content: &T, count: usize) -> Result<Vec<bool>, FieldError> {
    let mut bits = vec![false; count - CHECK_BITS];
    tables.iter().try_for_each(|table| write_all(table, content, &mut bits))?;
    Ok(with_check(bits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_of_a_printed_text_is_the_printed_one() {
        // The check value of CRC-24/LTE-A's polynomial under its catalogue name: CRC-24Q of "123456789".
        let bits = b"123456789".iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1 == 1));
        assert_eq!(crc24q(bits), 0xCD_E703);
    }

    #[test]
    fn bits_with_their_check_leave_nothing() {
        let bits: Vec<bool> = (0..196_u32).map(|k| k.wrapping_mul(2_654_435_761) >> 31 == 1).collect();
        let check = crc24q(bits.iter().copied());
        let tail = (0..24).rev().map(|bit| check >> bit & 1 == 1);
        assert_eq!(crc24q(bits.iter().copied().chain(tail)), 0);
        assert_ne!(check, 0);
    }
}
