//! Parity of LNAV words: the (32, 26) Hamming code, whose six bits also depend on the two last bits of the
//! word before.
//!
//! Source: IS-GPS-200N, 20.3.5.2 and table 20-XIV. Any one or two wrong bits of the 32 are detected.

/// Masks of the data bits d1..d24 (d1 is bit 23) that enter D25..D30 (IS-GPS-200N, table 20-XIV).
const MASKS: [u32; 6] = [0xEC_7CD2, 0x76_3E69, 0xBB_1F34, 0x5D_8F9A, 0xAE_C7CD, 0x2D_EA27];
/// Previous bit that enters D25..D30: true for D29*, false for D30* (IS-GPS-200N, table 20-XIV).
const FROM_D29: [bool; 6] = [true, false, true, false, false, true];

/// The 24 data bits of a word.
pub(super) const DATA: u32 = 0xFF_FFFF;

/// The six parity bits of 24 source bits after a word that ended in the two low bits of `previous`.
fn parity(data: u32, previous: u32) -> u32 {
    MASKS.iter().zip(FROM_D29).fold(0, |bits, (mask, from_d29)| {
        let starred = if planted!("gnss.lnav.parity_star", from_d29, !from_d29) { previous >> 1 } else { previous };
        let mask = planted!("gnss.lnav.parity_mask", mask, &(mask & !0x10_0000));
        (bits << 1) | (((data & mask).count_ones() + starred) & 1)
    })
}

/// The 30 bits that are sent for 24 source bits: inverted where D30* is 1, then parity.
pub(super) fn encode(data: u32, previous: u32) -> u32 {
    let sent = if previous & 1 == 1 { !data & DATA } else { data & DATA };
    (sent << 6) | parity(data & DATA, previous)
}

/// `data` with its last two bits chosen so that the word ends in 00 (IS-GPS-200N, 20.3.3.2: the
/// non-information bits of words two and ten).
pub(super) fn solve_tail(data: u32, previous: u32) -> u32 {
    let blank = data & DATA & !3;
    let low = parity(blank, previous);
    // d24 enters both D29 and D30, d23 only D30.
    let d24 = (low >> 1) & 1;
    let d23 = (low & 1) ^ d24;
    blank | (d23 << 1) | d24
}

/// Returns the 24 source bits of a received 30-bit word, or `None` if its parity is wrong.
///
/// `previous` is the word before, of which only the two low bits (D29*, D30*) count. The check holds
/// for an inverted stream too, and the data come out upright.
pub fn check_parity(word: u32, previous: u32) -> Option<u32> {
    let received = (word >> 6) & DATA;
    let data = if previous & 1 == 1 { !received & DATA } else { received };
    planted!("gnss.lnav.parity_unchecked", parity(data, previous) == word & 0x3F, true).then_some(data)
}
