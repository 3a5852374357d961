//! Error rates of the two codes in noise.

use super::*;
use crate::fec::reliability::is_as_codes_of_its_length;

#[test]
fn both_codes_fulfil_their_checks_and_fail_between_shannon_s_limit_and_one_decibel_and_a_half_above_it() {
    is_as_codes_of_its_length(&CODE_2, BITS_2);
    is_as_codes_of_its_length(&CODE_3, BITS_3);
}
