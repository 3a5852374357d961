//! The printed words of subframe 1.

use super::*;

#[test]
fn words_of_number_and_time_are_the_printed_ones() {
    // BDS-SIS-ICD-B1C 1.0, 6.2.1: numbers 1 to 3 and times 1 and 2 in hexadecimal.
    let word = |bits: &[bool]| number(bits) as u64;
    for (prn, expected) in [(1, 0x00_A4CB), (2, 0x01_4996), (3, 0x01_ED5D)] {
        assert_eq!(word(&first_symbols(prn, 0)[..21]), expected);
    }
    for (time, expected) in [(1, 0x0F3A_905B_4BE3), (2, 0x114F_B0ED_DC25)] {
        assert_eq!(word(&first_symbols(1, time)[21..]), expected);
    }
}
